"""Poses along a path: even, complete, and turned the way the robot drives."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.planning import MotionLimits
from hybridnav.refine.curves import shortest_curve
from tests.strategies import drawn, occupancy_grid

SPACING = st.floats(0.01, 3.0)
LENGTH = st.floats(-5, 5).map(lambda x: round(x, 3))
POINTS = st.lists(st.tuples(LENGTH, LENGTH), min_size=1, max_size=8)
YAW = st.floats(-3.1, 3.1)
POSE = st.tuples(LENGTH, LENGTH, YAW)


def path_of(points: Any, headings: Any = None, **kind: Any) -> hn.Path:
    points = np.array(points, dtype=np.float64).reshape(-1, 2)
    chords_m = np.hypot(*np.diff(points, axis=0).T)
    headings = None if headings is None else np.array(headings, dtype=np.float64)
    if kind.get("is_curved"):
        half = np.angle(np.exp(1j * np.diff(headings))) / 2
        chords_m = chords_m / np.sinc(half / np.pi)
    length_m = float(chords_m.sum())
    return hn.Path(np.zeros((1, 2), np.int64), points, length_m, headings, **kind)


def curve_path(start: Any, goal: Any, radius_m: float, *, reverses: bool = True) -> hn.Path:
    """As the planner makes one of a Reeds-Shepp or Dubins curve: poses a cell apart."""
    curve = shortest_curve(start, goal, radius_m=radius_m, reverses=reverses)
    poses = curve.poses(min(0.1, radius_m))
    points, headings = poses[:, :2].copy(), poses[:, 2].copy()
    return hn.Path(np.zeros((1, 2), np.int64), points, curve.length_m, headings, is_curved=True)


def gaps(poses: Any) -> Any:
    return np.hypot(*np.diff(poses[:, :2], axis=0).T)


def turned(angles: Any) -> Any:
    return (np.asarray(angles) + np.pi) % (2 * np.pi) - np.pi


@given(points=POINTS, spacing_m=SPACING)
@settings(deadline=None)
def test_poses_on_straight_lines(points: Any, spacing_m: float) -> None:
    path = path_of(points)
    poses = path.poses(spacing_m)
    assert poses.dtype == np.float64
    np.testing.assert_array_equal(poses[[0, -1], :2], path.points[[0, -1]])
    assert gaps(poses).max(initial=0) <= spacing_m * (1 + 1e-9)
    assert gaps(poses).sum() == pytest.approx(path.length_m, abs=1e-9)
    assert (-np.pi <= poses[:, 2]).all()
    assert (poses[:, 2] < np.pi).all()
    # Every pose faces the next one, the last the way it came.
    steps = np.diff(poses[:, :2], axis=0)
    moves = gaps(poses) > 1e-7
    faced = np.arctan2(steps[:, 1], steps[:, 0])[moves]
    np.testing.assert_allclose(turned(faced - poses[:-1][moves, 2]), 0, atol=1e-6)
    if moves.any():
        assert abs(turned(faced[-1] - poses[-1, 2])) < 1e-6
    assert (path.directions(spacing_m) == 1).all()
    assert len(path.directions(spacing_m)) == len(poses)
    assert path.reversals.size == 0
    # All points where it bends are among the poses.
    for at in range(1, len(points) - 1):
        before, behind = (
            path.points[at] - path.points[at - 1],
            path.points[at + 1] - path.points[at],
        )
        if abs(before[0] * behind[1] - before[1] * behind[0]) > 1e-4:
            assert gaps_to(poses, path.points[at]) == 0


def gaps_to(poses: Any, point: Any) -> float:
    return float(np.abs(poses[:, :2] - point).max(axis=1).min())


def test_points_on_one_line_do_not_break_the_even_spacing() -> None:
    # Cells along a row, a diagonal and a column, in a frame far away.
    cells = [(0, col) for col in range(40)] + [(k, 39 + k) for k in range(1, 30)]
    frame = hn.Frame(0.05, (5000.0, -3000.0), 0.3)
    path = path_of(frame.points_of(cells))
    poses = path.poses(0.7)
    assert len(poses) == 1 + 3 + 3
    assert gaps(poses)[:3] == pytest.approx([0.65] * 3)
    assert gaps(poses)[3:] == pytest.approx([29 * 0.05 * math.sqrt(2) / 3] * 3)
    assert poses[:3, 2] == pytest.approx([0.3] * 3)


@given(start=POSE, goal=POSE, radius_m=st.floats(0.3, 2), reverses=st.booleans(), spacing_m=SPACING)
@example(start=(0.0, 0.0, 0.0), goal=(0.0, 1.0, 0.0), radius_m=0.5, reverses=False, spacing_m=3.0)
@settings(deadline=None)
def test_poses_on_curves(start, goal, radius_m, reverses, spacing_m):
    assume(math.dist(start[:2], goal[:2]) > 0.01)
    # Poses farther apart than half a circle do not tell which way round the robot drove.
    spacing_m = min(spacing_m, 2.9 * radius_m)
    path = curve_path(start, goal, radius_m, reverses=reverses)
    poses, ahead = path.poses(spacing_m), path.directions(spacing_m)
    assert path.headings_rad is not None
    assert poses[-1, :2] == pytest.approx(path.points[-1], abs=1e-9)
    assert turned(poses[-1, 2] - goal[2]) == pytest.approx(0, abs=1e-6)
    assert turned(poses[0, 2] - start[2]) == pytest.approx(0, abs=1e-9)
    # The steps between two changes of direction are equal, as few as possible, on the curve.
    pieces = shortest_curve(start, goal, radius_m=radius_m, reverses=reverses).lengths_m.tolist()
    kept = [length for length in pieces if abs(length) > 1e-10]
    stretches = [sum(each) for _, each in itertools.groupby(kept, key=lambda length: length > 0)]
    counts = [math.ceil(abs(length) / spacing_m - 1e-9) for length in stretches]
    assert len(poses) == 1 + sum(counts)
    along = np.append(0, np.cumsum(np.repeat(np.abs(stretches) / counts, counts)))
    dense = path.profile(MotionLimits(), spacing_m / 50)
    for axis in range(2):
        on_curve = np.interp(along, dense.along_m, dense.poses[:, axis])
        np.testing.assert_allclose(poses[:, axis], on_curve, atol=spacing_m**2 / 1e4 / radius_m)
    assert ahead[:-1].tolist() == np.repeat(np.sign(stretches), counts).tolist()
    if not reverses:
        assert (ahead == 1).all()
        assert path.reversals.size == 0


def test_short_arcs_between_lines_make_no_short_steps() -> None:
    # A line, an arc of 0.3 mm, and a line: 1.0003 m in 21 equal steps.
    turn, arc_m = 0.003, 0.0003
    end = (0.5 + arc_m * math.cos(turn / 2), arc_m * math.sin(turn / 2))
    goal = (end[0] + 0.5 * math.cos(turn), end[1] + 0.5 * math.sin(turn))
    path = path_of([(0, 0), (0.5, 0), end, goal], [0.0, 0.0, turn, turn], is_curved=True)
    assert gaps(path.poses(0.05)) == pytest.approx([path.length_m / 21] * 21, rel=1e-5)


def test_a_reversal_is_marked_where_it_is() -> None:
    # Sideways by a little: a car goes ahead and backs up.
    path = curve_path((0.0, 0.0, 0.0), (0.0, 0.3, 0.0), 1.0)
    assert len(path.reversals) >= 1
    poses, ahead = path.poses(0.02), path.directions(0.02)
    changes = np.flatnonzero(np.diff(ahead[:-1])) + 1
    np.testing.assert_allclose(poses[changes, :2], path.points[path.reversals], atol=1e-9)
    steps = np.diff(poses[:, :2], axis=0)
    along = steps[:, 0] * np.cos(poses[:-1, 2]) + steps[:, 1] * np.sin(poses[:-1, 2])
    np.testing.assert_array_equal(np.sign(along), ahead[:-1])


def test_a_turn_on_the_spot_is_two_poses_at_one_point() -> None:
    # Turn to the goal, drive, turn to its heading.
    points = [(0, 0), (0, 0), (1, 0), (1, 0), (1, 1), (1, 1)]
    headings = [2.0, 0.0, 0.0, math.pi / 2, math.pi / 2, -1.0]
    path = path_of(points, headings)
    poses = path.poses(0.25)
    assert len(poses) == 6 + 2 * 3
    assert poses[[0, 1], 2] == pytest.approx([2.0, 0.0])
    assert gaps(poses) == pytest.approx([0, *[0.25] * 4, 0, *[0.25] * 4, 0])
    assert poses[-2:, 2] == pytest.approx([math.pi / 2, -1.0])
    assert (path.directions(0.25) == 1).all()
    assert path.reversals.size == 0


def test_a_robot_that_slides_turns_evenly_on_its_way() -> None:
    path = path_of([(0, 0), (2, 0)], [3.0, -3.0])
    poses = path.poses(0.5)
    step = (2 * math.pi - 6) / 4
    np.testing.assert_allclose(turned(np.diff(poses[:, 2])), step)
    assert poses[:, 1].tolist() == [0.0] * 5


@pytest.mark.parametrize("spacing_m", [0.0, -1.0, math.nan, 1e-9])
def test_a_spacing_that_is_none_is_refused(spacing_m: float) -> None:
    with pytest.raises(
        hn.errors.InvalidValueError, match="spacing_m must be above 0 and yield"
    ) as error:
        path_of([(0, 0), (1, 0)]).poses(spacing_m)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("smooth", ["none", "line-of-sight"])
def test_poses_of_a_plan(smooth: Any) -> None:
    grid = occupancy_grid(drawn(".........", "..####...", "..#..#...", "..####...", "........."))
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    result = hn.HybridPlanner(topology).plan((0.5, 2.5), (8.2, 2.4), smooth=smooth)
    poses = result.path.poses()
    assert gaps(poses).sum() == pytest.approx(result.path.length_m)
    assert gaps(poses).max() <= 0.05 * (1 + 1e-9)
    np.testing.assert_array_equal(poses[[0, -1], :2], result.path.points[[0, -1]])
