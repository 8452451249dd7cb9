"""Robots that turn on the spot and drive straight: motions are judged like by shapely."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.refine import MotionCheck
from hybridnav.refine.curves import driven
from hybridnav.refine.footprint import Footprint
from tests.oracle.motions import ShapelyRobot, drive_phases, turning_poses
from tests.strategies import examples, seeds

CELL_M = 0.05
EXACT_M = 2e-6 * CELL_M
"""What rounding may hide."""
NEAR_M = 0.01 * CELL_M
"""How deep a body may go into a cell between two samples of the oracle."""
TRUCK = [[0.9, 0.3], [0.9, -0.3], [-0.9, -0.3], [-0.9, 0.3]]
TRAILING = [[1.5, 0.3], [1.5, -0.3], [-0.1, -0.3], [-0.1, 0.3]]
"""A robot whose base is near its rear, so that it needs room ahead to turn."""


class Yard:
    """A small map and a robot of any outline, often with its base off the middle."""

    def __init__(self, seed: int) -> None:
        self.rng = rng = np.random.default_rng(seed)
        rows, cols = rng.integers(8, 24, 2)
        self.frame = Frame(CELL_M, (12.3, -7.1), float(rng.choice([0.0, 0.7, -2.5])))
        if rng.random() < 0.5:
            # Sides and corners on the lattice, where a body touches cells all along.
            a, b, c, d = rng.integers(1, 4, 4)
            corners = np.array([[a, b], [-c, b], [-c, -d], [a, -d]]) * CELL_M
        else:
            n = rng.integers(3, 8)
            angles = np.linspace(0, math.tau, n, endpoint=False) + rng.uniform(0, 0.8, n)
            radii_m = rng.uniform(0.3, 3, n) * CELL_M
            corners = radii_m[:, None] * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            corners += rng.uniform(-1.5, 1.5, 2) * CELL_M
        occupied = rng.random((rows, cols)) < rng.choice([0.01, 0.03, 0.08])
        self.grid = OccupancyGrid(occupied.astype(np.float32), frame=self.frame, robot_radius_m=0)
        self.check = MotionCheck(self.grid, footprint=Footprint(corners))
        self.oracle = ShapelyRobot(self.grid, corners)

    def starts(self, n: int) -> list[Any]:
        """Valid poses, some at corners of cells and along the axes of the grid."""
        positions = self.rng.random((n, 2)) * self.grid.shape
        positions[::2] = np.rint(positions[::2])
        yaws = self.rng.uniform(-4, 4, n)
        yaws[::4] = self.frame.yaw_rad + self.rng.integers(0, 4, len(yaws[::4])) * math.pi / 2
        poses = np.column_stack([self.frame.points_of_grid(positions), yaws])
        return [pose for pose in poses if self.check.state_valid(*pose)]

    def beside(self, pose: Any) -> Any:
        """A pose some cells away, now and then at the same point, in any heading."""
        offset = self.rng.normal(0, 3, 2) * CELL_M * (self.rng.random() > 0.1)
        return pose + np.append(offset, self.rng.uniform(-3.5, 3.5))

    def is_hit(self, phases: list[list[Any]], grown_m: float) -> bool:
        """Whether some phase fails in every way to do it, by shapely's word."""
        return any(
            all(self.oracle.is_hit(poses, grown_m=grown_m) for poses in ways) for ways in phases
        )


yards = st.builds(Yard, seeds)


@given(yards)
@settings(max_examples=examples(25), derandomize=True)
def test_turns_on_the_spot_agree_with_shapely(yard: Yard) -> None:
    for start in yard.starts(12):
        goal = start + np.array([0, 0, yard.rng.uniform(-3, 3)])
        valid = yard.check.turn_valid(*start, *goal)
        poses = turning_poses(start, goal, 400)
        assert yard.oracle.is_hit(poses, grown_m=-EXACT_M if valid else NEAR_M) is not valid


@given(yards, st.booleans())
@settings(max_examples=examples(25), derandomize=True)
def test_drives_agree_with_shapely(yard: Yard, backwards: bool) -> None:
    for start in yard.starts(10):
        goal = yard.beside(start)
        valid = yard.check.drive_valid(*start, *goal, backwards=backwards)
        phases = drive_phases(start, goal, 300, backwards=backwards)
        assert yard.is_hit(phases, -EXACT_M if valid else NEAR_M) is not valid
        # What is driven ahead is driven back backwards.
        assert yard.check.drive_valid(*goal, *start, backwards=not backwards) is valid


@given(yards, st.booleans())
@settings(max_examples=examples(30), derandomize=True)
def test_paths_are_spelled_out_as_turns_and_drives(yard: Yard, reverses: bool) -> None:
    def may_go(first: Any, second: Any) -> bool:
        ways = (False, True) if reverses else (False,)
        return any(yard.check.drive_valid(*first, *second, backwards=back) for back in ways)

    for start in yard.starts(4):
        visited = [start]
        for _ in range(12):
            pose = yard.beside(visited[-1])
            if may_go(visited[-1], pose):
                visited.append(pose)
        poses = driven(yard.check, np.array(visited), reverses=reverses)
        # Headings between the endpoints are left out, and no path is lost by that.
        assert len(poses)
        assert_turns_and_drives(poses, reverses=reverses)
        np.testing.assert_array_equal(poses[[0, -1], :2], np.array(visited)[[0, -1], :2])
        np.testing.assert_allclose(np.cos(poses[[0, -1], 2] - np.array(visited)[[0, -1], 2]), 1)
        assert not yard.oracle.is_hit(sampled(poses, 60), grown_m=-EXACT_M)


def assert_turns_and_drives(poses: Any, *, reverses: bool = False) -> None:
    """Between two poses the robot only turns, the short way, or only drives along its heading."""
    for first, second in itertools.pairwise(poses):
        way = second[:2] - first[:2]
        if not way.any():
            assert abs(math.remainder(second[2] - first[2], math.tau)) > 0
            continue
        assert second[2] == first[2]
        off = math.remainder(first[2] - math.atan2(way[1], way[0]), math.tau)
        assert abs(off) < 1e-6 or (reverses and abs(off) > math.pi - 1e-6)


def sampled(poses: Any, n: int) -> Any:
    """Poses on the way, n between each two."""
    pairs = itertools.pairwise(poses)
    return np.concatenate([poses[:1], *(turning_poses(*pair, n) for pair in pairs)])


def posts(*cells: tuple[int, int]) -> OccupancyGrid:
    """A yard of 5 x 5 m with posts of one cell."""
    occupied = np.zeros((100, 100), dtype=np.float32)
    for cell in cells:
        occupied[cell] = 1
    return OccupancyGrid(occupied, frame=Frame(CELL_M), robot_radius_m=0)


def test_a_slight_turn_may_pass_a_post_nearer_than_its_hull() -> None:
    """The hull of the two headings covers the post's corner, which no heading between them does."""
    check = MotionCheck(posts((50, 50)), footprint=TRUCK)
    below = (50 - 6 - 5e-4) * CELL_M
    assert check.turn_valid(2.5, below, 0.0, 2.5, below, 1.5e-4)
    assert not check.turn_valid(2.5, below, 0.0, 2.5, below, 0.1)


def test_a_post_between_two_free_headings_stops_the_turn() -> None:
    check = MotionCheck(posts((50, 66)), footprint=TRUCK)
    pose = (2.525, 2.525)
    assert check.spin(*pose, -0.6, -2.5) == pytest.approx(-1.9)
    # The short way is barred by the post, on the other the other end hits it.
    assert math.isnan(check.spin(*pose, -0.6, 0.6))


def test_a_robot_beside_a_wall_turns_the_long_way_round() -> None:
    occupied = np.zeros((100, 100), dtype=np.float32)
    occupied[60:] = 1
    check = MotionCheck(
        OccupancyGrid(occupied, frame=Frame(CELL_M), robot_radius_m=0), footprint=TRAILING
    )
    near_wall = (2.5, 2.5)
    turn = check.spin(*near_wall, 0.1, math.pi - 0.1)
    assert turn == pytest.approx(math.pi - 0.2 - math.tau)
    assert not check.turn_valid(*near_wall, 0.1, *near_wall, math.pi - 0.1)
    poses = driven(check, np.array([[*near_wall, 0.1], [*near_wall, math.pi - 0.1]]))
    # With a heading between, so that each step is the short way.
    np.testing.assert_allclose(poses[:, 2], [0.1, -math.pi / 2, math.pi - 0.1])
    assert check.path_valid(poses)


def test_a_long_robot_drives_where_it_cannot_turn() -> None:
    occupied = np.zeros((200, 200), dtype=np.float32)
    occupied[:, 60:140] = 1
    occupied[92:108, 60:140] = 0
    check = MotionCheck(
        OccupancyGrid(occupied, frame=Frame(CELL_M), robot_radius_m=0), footprint=TRUCK
    )
    assert check.drive_valid(1.5, 5.0, 2.0, 8.5, 5.0, 2.0)
    assert check.drive_valid(1.5, 5.0, 2.0, 8.5, 5.0, 2.0, backwards=True)
    assert check.drive_valid(1.5, 5.0, 2.0, 5.0, 5.0, 0.0)
    assert not check.drive_valid(1.5, 5.0, 2.0, 5.0, 5.0, math.pi)
    assert check.drive_valid(1.5, 5.0, 2.0, 5.0, 5.0, math.pi, backwards=True)
    # A holonomic robot goes sideways, this one does not.
    assert check.turn_valid(5.0, 5.0, 0.0, 5.0, 5.08, 0.0)
    assert not check.drive_valid(5.0, 5.0, 0.0, 5.0, 5.08, 0.0)


def test_drives_in_one_line_become_one() -> None:
    check = MotionCheck(posts(), footprint=TRUCK)
    line = np.array([[1.0, 2.5, 1.0], [1.7, 2.5, -2.0], [3.1, 2.5, 0.3], [4.0, 2.5, 1.0]])
    poses = driven(check, line)
    np.testing.assert_allclose(poses, [[1, 2.5, 1], [1, 2.5, 0], [4, 2.5, 0], [4, 2.5, 1]])
    assert not len(driven(check, np.array([[1.0, 2.5, 1.0], [9.0, 2.5, 1.0]])))


@pytest.mark.parametrize("wrong", [math.nan, math.inf, 1e300])
def test_drives_that_make_no_sense_are_not_valid(wrong: float) -> None:
    check = MotionCheck(posts(), footprint=TRUCK)
    good = [2.0, 2.5, 0.3, 3.0, 2.5, 0.4]
    assert check.drive_valid(*good)
    for index in range(6):
        bad = list(good)
        bad[index] = wrong
        assert not check.drive_valid(*bad)
    assert math.isnan(check.spin(2.0, 2.5, 0.0, wrong))
    assert math.isnan(check.spin(wrong, 2.5, 0.0, 1.0))


def test_a_disc_turns_anywhere_and_drives_where_its_base_does() -> None:
    check = MotionCheck(posts((50, 50)))
    for x in (1.0, 2.5, 2.51, 4.0):
        endpoints = (x, 1.0), (x, 4.0)
        runs = check.motion_valid(*endpoints[0], *endpoints[1])
        assert check.drive_valid(*endpoints[0], 1.0, *endpoints[1], -2.0) is runs
    assert check.spin(2.4, 2.4, 0.0, 3.0) == pytest.approx(3.0)
    assert math.isnan(check.spin(2.525, 2.525, 0.0, 3.0))


@pytest.mark.parametrize("side", [1, -1])
def test_half_a_turn_takes_the_side_that_is_free(side: int) -> None:
    occupied = np.zeros((40, 40), dtype=np.float32)
    occupied[20 + 8 * side, 18:23] = 1
    frame = Frame(CELL_M, (-20.5 * CELL_M, -20.5 * CELL_M))
    grid = OccupancyGrid(occupied, frame=frame, robot_radius_m=0.05)
    footprint = [(-0.1, -0.1), (0.6, -0.1), (0.6, 0.1), (-0.1, 0.1)]
    check = MotionCheck(grid, footprint=footprint)
    spelled = driven(check, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, math.pi]]))
    assert spelled[:, 2].tolist() == pytest.approx([0, -side * math.pi / 2, math.pi])
    assert check.path_valid(spelled)
