"""Motions of a robot: a disc is judged like by the judge, a shape like by shapely."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges import segment_faults
from hybridnav.maps import CellClass, Frame, OccupancyGrid
from hybridnav.refine import MotionCheck
from hybridnav.refine.curves import shortest_curve
from hybridnav.refine.footprint import Footprint
from tests.oracle.motions import ShapelyRobot, turning_poses
from tests.strategies import class_grids, drawn, examples, framed, seeds

yaws = st.sampled_from([0.0, 0.7, -2.5])


def segments_of(grid: OccupancyGrid, rng: np.random.Generator, n: int) -> list[Any]:
    """Segments anywhere on the map and a little beyond; many between corners and centres."""
    endpoints = (1.2 * rng.random((n, 2, 2)) - 0.1) * grid.shape
    endpoints[::2] = np.rint(2 * endpoints[::2]) / 2
    endpoints[::3, 1] = endpoints[::3, 0] + rng.integers(-3, 4, (len(endpoints[::3]), 2))
    endpoints[::6, 1, 0] = endpoints[::6, 0, 0]
    return list(grid.frame.points_of_grid(endpoints))


@given(class_grids(max_side=16), seeds, yaws)
@settings(max_examples=examples(80), derandomize=True)
def test_straight_motions_of_a_disc_are_those_that_the_judge_passes(classes, seed, yaw_rad):
    grid = framed(classes, yaw_rad)
    allow_unexplored = bool(seed % 2)
    check = MotionCheck(grid, allow_unexplored=allow_unexplored)
    for points in segments_of(grid, np.random.default_rng(seed), 40):
        faults = segment_faults(grid, points, allow_unexplored=allow_unexplored)
        assert check.motion_valid(*points[0], *points[1]) is not bool(faults)
        faults = segment_faults(grid, points[:1], allow_unexplored=allow_unexplored)
        assert check.state_valid(*points[0]) is not bool(faults)


@given(class_grids(max_side=16), seeds, yaws)
@settings(max_examples=examples(40), derandomize=True)
def test_corridor_holds_what_stays_in_it_and_forbids_no_corner_between_free_cells(
    classes: Any, seed: int, yaw_rad: float
) -> None:
    rng = np.random.default_rng(seed)
    grid = framed(classes, yaw_rad)
    inside = rng.random(grid.shape) < 0.7
    closed = np.flatnonzero(rng.random(grid.shape) < 0.1)
    check = MotionCheck(grid, inside=inside, closed=closed)
    # The same with walls around the corridor: stricter at its corners only.
    walled, free = classes.copy(), classes.copy()
    free.flat[closed] = CellClass.OCCUPIED
    walled[(free == CellClass.OCCUPIED) | ~inside] = CellClass.OCCUPIED
    for points in segments_of(grid, rng, 40):
        valid = check.motion_valid(*points[0], *points[1])
        faults = segment_faults(framed(walled, yaw_rad), points)
        if not valid:
            assert faults
        elif faults:
            assert "meet at a corner" in faults[0]
            assert not segment_faults(framed(free, yaw_rad), points)


def test_diagonal_leaves_the_corridor_at_a_corner_only_where_the_map_is_free() -> None:
    inside = np.eye(3, dtype=np.bool_)
    free = framed(drawn("...", "...", "..."))
    endpoints = free.frame.points_of([[0, 0], [2, 2]]).ravel().tolist()
    assert MotionCheck(free, inside=inside).motion_valid(*endpoints)
    walled = drawn("##.", "#.#", ".##")
    assert not MotionCheck(framed(walled), inside=inside).motion_valid(*endpoints)
    assert MotionCheck(framed(walled, corner_cutting=True)).motion_valid(*endpoints)


@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf, 1e300, -1e300])
def test_what_is_no_place_on_the_map_is_not_valid(wrong: float) -> None:
    grid = framed(drawn("...", "...", "..."))
    check = MotionCheck(grid)
    x, y = grid.frame.points_of((1, 1)).tolist()
    assert check.state_valid(x, y)
    assert not check.state_valid(wrong, y)
    assert not check.motion_valid(x, y, x, wrong)
    assert not check.motion_valid(wrong, wrong, x, y)


def test_masks_and_closed_cells_of_another_map_are_refused() -> None:
    grid = framed(drawn("...", "..."))
    with pytest.raises(InvalidValueError, match=r"shape \(2, 3\), got \(3, 2\)"):
        MotionCheck(grid, inside=np.ones((3, 2), dtype=np.bool_))
    with pytest.raises(InvalidValueError, match="below 6, got 0 to 6"):
        MotionCheck(grid, closed=np.array([0, 6]))


CELL_M = 0.05
EXACT_M, NEAR_M = 2e-6 * CELL_M, 0.02 * CELL_M
"""What rounding may hide, and what a motion that is refused may miss an obstacle by."""
TRUCK = [[0.9, 0.3], [0.9, -0.3], [-0.9, -0.3], [-0.9, 0.3]]


class Scenario:
    """A small map, often with a corridor, and a robot of any outline, convex or not."""

    def __init__(self, seed: int, blocked: float) -> None:
        self.rng = rng = np.random.default_rng(seed)
        rows, cols = rng.integers(6, 24, 2)
        yaw_rad = float(rng.choice([0.0, 0.7, -2.5]))
        self.frame = Frame(CELL_M, (12.3, -7.1), yaw_rad)
        n = rng.integers(5, 8)
        angles = np.linspace(0, math.tau, n, endpoint=False) + rng.uniform(0, 0.8, n)
        radii_m = rng.uniform(0.3, 2.5, n) * CELL_M
        corners = radii_m[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self.corners_m = corners + rng.uniform(-1, 1, 2) * CELL_M * rng.integers(0, 2)
        footprint = Footprint(self.corners_m)
        self.grid = OccupancyGrid(
            (rng.random((rows, cols)) < blocked).astype(np.float32),
            frame=self.frame,
            robot_radius_m=footprint.inscribed_radius_m * rng.integers(0, 2),
        )
        self.inside = rng.random((rows, cols)) < 0.95 if rng.random() < 0.5 else None
        self.check = MotionCheck(self.grid, footprint=footprint, inside=self.inside)
        self.oracle = ShapelyRobot(self.grid, self.corners_m, self.inside)

    def poses(self, n: int) -> list[Any]:
        points = self.frame.points_of_grid(self.rng.random((n, 2)) * self.grid.shape)
        return [np.append(point, self.rng.uniform(-4, 4)) for point in points]

    def beside(self, pose: Any) -> Any:
        """A pose some cells away, every third time with the same heading."""
        moved = pose + np.append(self.rng.normal(0, 3, 2) * CELL_M, self.rng.uniform(-2, 2))
        if self.rng.random() < 1 / 3:
            moved[2] = pose[2]
        return moved

    def driven(self, pose: Any, radius_m: float, *, backwards: bool) -> Any:
        """The pose at the end of an arc of up to a radian."""
        turn, way = self.rng.uniform(-1, 1), -1 if backwards else 1
        ahead = math.sin(abs(turn)) * way + 1j * math.copysign(1 - math.cos(turn), turn)
        moved = radius_m * ahead * complex(math.cos(pose[2]), math.sin(pose[2]))
        return pose + np.array([moved.real, moved.imag, way * turn])

    def agrees(self, poses: Any, *, valid: bool) -> bool:
        """Return whether shapely agrees on the poses of a motion."""
        if valid:
            return not self.oracle.is_hit(poses, grown_m=-EXACT_M)
        return self.oracle.is_hit(poses, grown_m=NEAR_M)


scenarios = st.builds(Scenario, seeds, st.sampled_from([0.02, 0.05, 0.1, 0.2]))


@given(scenarios)
@settings(max_examples=examples(25), derandomize=True)
def test_states_of_a_footprint_agree_with_shapely(scenario: Scenario) -> None:
    for pose in scenario.poses(40):
        valid = scenario.check.state_valid(*pose)
        oracle = scenario.oracle
        assert not (valid and oracle.is_hit(pose[None], grown_m=-EXACT_M))
        assert valid or oracle.is_hit(pose[None], grown_m=EXACT_M)


@given(scenarios)
@settings(max_examples=examples(25), derandomize=True)
def test_turns_are_valid_where_shapely_finds_no_state_that_is_not(scenario: Scenario) -> None:
    check = scenario.check
    for start in scenario.poses(25):
        if not check.state_valid(*start):
            continue
        goal = scenario.beside(start)
        valid = check.turn_valid(*start, *goal)
        assert scenario.agrees(turning_poses(start, goal, 300), valid=valid)


@pytest.mark.parametrize("reverses", [False, True])
def test_curves_are_valid_where_shapely_finds_no_state_that_is_not(reverses: bool) -> None:
    n_valid = n_refused = 0
    for seed in range(examples(10)):
        scenario = Scenario(seed, 0.03)
        check, rng = scenario.check, scenario.rng
        steer = check.reeds_shepp_valid if reverses else check.dubins_valid
        pairs = [(start, scenario.beside(start)) for start in scenario.poses(20)]
        radii_m = rng.uniform(0.5, 4, 30) * CELL_M
        # Most curves to a pose beside are long, and hit something; short drives do not.
        starts = [start for start in scenario.poses(100) if check.state_valid(*start)][:10]
        for start, radius_m in zip(starts, radii_m[20:], strict=False):
            backwards = reverses and rng.random() < 0.5
            pairs.append((start, scenario.driven(start, radius_m, backwards=backwards)))
        for (start, goal), radius_m in zip(pairs, radii_m.tolist(), strict=False):
            valid = steer(*[*start, *goal, radius_m])
            curve = shortest_curve(tuple(start), tuple(goal), radius_m=radius_m, reverses=reverses)
            word = curve.kinds, curve.lengths_m
            assert check.curve_valid(start[0], start[1], start[2], *word, radius_m) is valid
            assert scenario.agrees(curve.poses(0.02 * CELL_M), valid=valid)
            n_valid += valid
            n_refused += not valid
    assert min(n_valid, n_refused) > 4 * examples(10)


def door(width_cells: int, wall_cells: int = 1, robot_radius_m: float = 0.3) -> OccupancyGrid:
    """Two rooms of 5 x 10 m with one door in the middle of the wall between them."""
    occupied = np.zeros((200, 200), dtype=np.float32)
    occupied[:, 100 : 100 + wall_cells] = 1
    low = 100 - width_cells // 2
    occupied[low : low + width_cells, 100 : 100 + wall_cells] = 0
    return OccupancyGrid(occupied, frame=Frame(CELL_M), robot_radius_m=robot_radius_m)


def test_truck_drives_through_its_door_and_no_narrower_one() -> None:
    y = 5.0
    wide = MotionCheck(door(18), footprint=TRUCK)
    assert wide.turn_valid(3.0, y, 0.0, 7.0, y, 0.0)
    assert wide.turn_valid(3.0, y, 0.05, 7.0, y, -0.05)
    # Backwards, and sideways where the disc of the base would pass.
    assert wide.turn_valid(3.0, y, math.pi, 7.0, y, math.pi)
    assert wide.motion_valid(3.0, y, 7.0, y)
    assert not wide.turn_valid(3.0, y, math.pi / 2.0, 7.0, y, math.pi / 2.0)
    assert not wide.turn_valid(3.0, y, 0.0, 7.0, y, 1.5)
    # Sides that touch the jambs all along; one cell less is too narrow.
    tight, narrow = door(12, 3, robot_radius_m=0), door(11, 3, robot_radius_m=0)
    assert MotionCheck(tight, footprint=TRUCK).turn_valid(3.0, y, 0.0, 7.0, y, 0.0)
    assert not MotionCheck(narrow, footprint=TRUCK).turn_valid(3.0, y, 0.0, 7.0, y, 0.0)
    assert not MotionCheck(narrow, footprint=TRUCK).turn_valid(
        3.0, y - 0.025, 0.0, 7.0, y - 0.025, 0.0
    )


def test_post_as_thin_as_a_cell_stops_every_motion_over_it() -> None:
    occupied = np.zeros((100, 100), dtype=np.float32)
    occupied[50, 50] = 1
    check = MotionCheck(
        OccupancyGrid(occupied, frame=Frame(CELL_M), robot_radius_m=0), footprint=TRUCK
    )
    x, y = 2.525, 2.525
    assert not check.turn_valid(x - 1.5, y, 0.0, x + 1.5, y, 0.0)
    assert not check.turn_valid(x, y - 1.0, 0.0, x, y + 1.0, 0.0)
    # Half a turn on the spot: free at both endpoints, the post on the way of the long side.
    assert not check.turn_valid(x, y - 0.7, 0.0, x, y - 0.7, math.pi)
    assert check.turn_valid(x, y - 1.0, 0.0, x, y - 1.0, math.pi)
    # A circle round (x, y - 1.2) whose upper half runs over the post.
    kinds, quarter_m = np.array([1]), np.array([math.pi / 2])
    assert not check.curve_valid(x, y - 2.2, 0.0, kinds, 3 * quarter_m, 1.0)
    assert not check.curve_valid(x, y - 2.2, 0.0, kinds, -3 * quarter_m, 1.0)
    assert check.curve_valid(x, y - 2.2, 0.0, kinds, quarter_m, 1.0)


def test_heading_turns_the_short_way_over_the_seam() -> None:
    check = MotionCheck(door(18), footprint=TRUCK)
    assert check.turn_valid(3.9, 1.0, math.pi - 0.1, 3.9, 1.0, -math.pi + 0.1)
    assert check.turn_valid(3.9, 1.0, math.pi - 0.1, 3.9, 1.0, 9 * math.pi + 0.1)
    assert not check.turn_valid(4.6, 1.0, math.pi / 2.0, 4.6, 1.0, -math.pi / 2.0)


@given(class_grids(max_side=12), seeds)
@settings(max_examples=examples(100), derandomize=True)
def test_paths_are_judged_with_their_bends(classes: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = framed(classes)
    check = MotionCheck(grid)
    for _ in range(20):
        steps = rng.integers(-1, 2, (4, 2)) * rng.choice([0.5, 1.0])
        positions = np.cumsum(np.vstack([rng.integers(0, grid.shape), steps]), axis=0)
        points = grid.frame.points_of_grid(positions)
        assert check.path_valid(points) is not bool(segment_faults(grid, points))


def test_path_of_poses_is_valid_where_its_turns_are() -> None:
    check = MotionCheck(door(18), footprint=TRUCK)
    poses: list[Any] = [[1, 1, 0], [3, 5, 0], [7, 5, 0], [7, 5, 1.5]]
    assert check.path_valid(poses)
    assert not check.path_valid([*poses, [5.05, 5, 0]])
    assert check.path_valid(poses[:1])
    assert not check.path_valid([[5.05, 5, 1.5]])
    with pytest.raises(InvalidValueError, match=r"got \(0,\)"):
        check.path_valid([])


def test_check_in_another_corridor_keeps_the_footprint() -> None:
    grid = door(18)
    inside = np.zeros(grid.shape, dtype=np.bool_)
    inside[:, :100] = True
    check = MotionCheck(grid, footprint=TRUCK)
    left = check.confined(inside=inside)
    for other in (left, MotionCheck(grid, footprint=TRUCK, inside=inside)):
        assert other.turn_valid(2.0, 5.0, 0.0, 3.0, 5.0, 0.0)
        assert not other.turn_valid(3.0, 5.0, 0.0, 7.0, 5.0, 0.0)
        # The base stays in the corridor, the body may reach out of it.
        assert other.state_valid(4.95, 5.0, 0.0)
        assert not other.state_valid(4.95, 5.0, 1.5)
    assert check.turn_valid(3.0, 5.0, 0.0, 7.0, 5.0, 0.0)
    assert left.confined().turn_valid(3.0, 5.0, 0.0, 7.0, 5.0, 0.0)


@pytest.mark.parametrize("wrong", [math.nan, math.inf, 1e300])
def test_poses_and_curves_that_make_no_sense_are_not_valid(wrong: float) -> None:
    check = MotionCheck(door(18), footprint=TRUCK)
    kinds, lengths_m = np.array([1, 0]), np.array([1.0, 0.5])
    assert check.curve_valid(2.0, 5.0, 0.0, kinds, lengths_m, 1.5)
    assert not check.curve_valid(2.0, 5.0, 0.0, kinds, np.array([1.0, wrong]), 1.5)
    assert not check.curve_valid(2.0, 5.0, 0.0, kinds, np.array([wrong, 1.0]), 1.5)
    assert not check.curve_valid(wrong, 5.0, 0.0, kinds, lengths_m, 1.5)
    assert not check.curve_valid(2.0, 5.0, 0.0, kinds, lengths_m, 0.0)
    assert not check.curve_valid(2.0, 5.0, 0.0, kinds, lengths_m, -1.0)
    assert not check.curve_valid(2.0, 5.0, 0.0, kinds, lengths_m, math.nan)
    # Round and round.
    assert not check.curve_valid(2.0, 5.0, 0.0, kinds[:1], np.array([30.0]), 1.5)
    assert not check.dubins_valid(2.0, 5.0, 0.0, wrong, 5.0, 0.0, 1.5)
    assert not check.reeds_shepp_valid(2.0, 5.0, 0.0, 3.0, 5.0, 0.0, 0.0)
    assert not check.turn_valid(2.0, 5.0, 0.0, 3.0, wrong, 0.0)
    assert not check.turn_valid(2.0, 5.0, 0.0, 3.0, 5.0, wrong)
    assert not check.dubins_valid(2.0, 5.0, wrong, 3.0, 5.0, 0.0, 1.5)
    assert not check.reeds_shepp_valid(2.0, 5.0, 0.0, 3.0, 5.0, wrong, 1.5)
    assert not check.state_valid(4.5, 5.0, wrong)
    assert not check.curve_valid(2.0, 5.0, wrong, kinds, lengths_m, 1.5)


def test_footprint_of_thousands_of_cells_is_refused() -> None:
    grid = OccupancyGrid(np.zeros((3, 3), dtype=np.float32), frame=Frame(1e-4), robot_radius_m=0)
    with pytest.raises(InvalidValueError, match=r"reaches 0\.948683 m on cells of 0\.0001 m"):
        MotionCheck(grid, footprint=TRUCK)


def test_a_body_that_turns_is_checked_between_different_corners_too() -> None:
    """The hull of two poses can have an edge from a rear corner of one to a front corner of the
    other; this robot would cut a door's jamb by 1.6 cm half-way."""
    occupied = np.zeros((100, 200), dtype=np.float32)
    occupied[:, 120:123] = 1
    occupied[40:58, 120:123] = 0
    grid = OccupancyGrid(occupied, Frame(0.05), robot_radius_m=0.3)
    footprint = [[0.9, 0.3], [0.9, -0.3], [-0.9, -0.3], [-0.9, 0.3]]
    check = MotionCheck(grid, footprint=footprint)
    first, second = (5.3978755, 2.32446213, 0.32920898), (6.66782561, 2.7793473, 0.3940011)
    middle = tuple(0.5 * (np.array(first) + second))
    assert check.state_valid(*first)
    assert check.state_valid(*second)
    assert not check.state_valid(*middle)
    assert not check.turn_valid(*first, *second)
