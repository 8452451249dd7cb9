"""Plans of a robot that turns on the spot and drives straight, with OMPL."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.worlds import office_world
from hybridnav.planning import load_preset
from tests.oracle.long_robot import CORNERS, Walls
from tests.oracle.long_robot import rooms as rooms_with_doors
from tests.refine.test_differential import assert_turns_and_drives
from tests.strategies import full_but

pytest.importorskip("ompl")

BACK = ("RRTConnect", "RRTstar", "InformedRRTstar", "PRM", "PRMstar")
DRIVES = [("RRTConnect", False), ("BITstar", False), *((p, True) for p in BACK), ("RRT", False)]
ROBOT = str([list(corner) for corner in CORNERS])


def planner_of(
    topology: hn.TopologicalMap, *settings: str, budget_s: float = 2
) -> hn.HybridPlanner:
    """A planner for a robot of 0.6 x 1.8 m, or another."""
    given = ["space=differential", f"footprint={ROBOT}", f"budget_s={budget_s}", *settings]
    # The doors of the corridor's own fields may leave no room to turn before them.
    overrides = ["planner.corridor=neighbours", *(f"planner.ompl.{text}" for text in given)]
    return hn.HybridPlanner(topology, preset=load_preset("ompl", overrides=overrides))


def topology_of(occupied: Any) -> hn.TopologicalMap:
    grid = hn.OccupancyGrid(occupied, hn.Frame(0.05), robot_radius_m=0.3)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid))


def poses_of(result: hn.PlanResult, *, reverses: bool = False) -> Any:
    """Poses of a path, judged: turns and drives alone, which touch no wall by shapely's word."""
    assert result.status is hn.PlanStatus.SOLVED
    assert result.path.headings_rad is not None
    poses = np.column_stack([result.path.points, result.path.headings_rad])
    assert_turns_and_drives(poses, reverses=reverses)
    steps = np.diff(result.path.points, axis=0)
    assert result.cost == result.path.length_m == pytest.approx(np.hypot(*steps.T).sum())
    assert result.metric == "any-angle"
    return poses


@pytest.fixture(scope="module")
def rooms() -> hn.TopologicalMap:
    """Rooms with doors of 0.9 m."""
    return hn.TopologicalMap(hn.DualGraphPyramid.build(rooms_with_doors()))


@pytest.mark.parametrize(("planner", "reverses"), full_but(DRIVES[:4], DRIVES))
def test_every_planner_of_the_space_goes_through_doors_without_touching(rooms, planner, reverses):
    settings = f"planner={planner}", f"reverses={str(reverses).lower()}"
    start, goal = (2.0, 3.0, 0.5), (17.0, 9.0, 1.0)
    result = planner_of(rooms, *settings).plan(start, goal)
    if result.status is hn.PlanStatus.APPROXIMATE:  # the budget is of wall time, beside other jobs
        result = planner_of(rooms, *settings, budget_s=60).plan(start, goal)
    poses = poses_of(result, reverses=reverses)
    assert not result.refinement.by_grid
    np.testing.assert_allclose(poses[0], start, atol=1e-6)
    np.testing.assert_allclose(poses[-1], goal, atol=1e-6)
    assert Walls(rooms.grid).touched(poses, curved=False) == 0
    assert math.dist(start[:2], goal[:2]) <= result.lower_bound <= result.cost


def test_the_robot_heads_where_it_goes_through_the_office() -> None:
    """With `se2` the angle between heading and travel was 12 to 83 degrees in the mean."""
    grid = office_world().grid(robot_radius_m=0.25)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    footprint = "footprint=[[0.5, 0.25], [0.5, -0.25], [-0.3, -0.25], [-0.3, 0.25]]"
    for endpoints in (
        ((1.0, 13.2, 0.0), (40.6, 19.4, 2.0)),
        ((10.6, 10.6, 1.57), (15.6, 10.3, -1.57)),
    ):
        poses = poses_of(planner_of(topology, footprint).plan(*endpoints))
        drives = [(a, b) for a, b in itertools.pairwise(poses) if (a[:2] != b[:2]).any()]
        travel = [math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in drives]
        off = [
            abs(math.remainder(a[2] - at, math.tau))
            for (a, _), at in zip(drives, travel, strict=True)
        ]
        assert max(off) < 1e-6
        assert len(drives) > 2


def narrow() -> Any:
    """Two rooms joined by a passage of 0.8 m, and a dead end as wide in the second."""
    occupied = np.ones((160, 360), dtype=np.float32)
    occupied[10:150, 10:110] = occupied[10:150, 190:290] = 0
    occupied[72:88, 110:190] = occupied[100:116, 290:350] = 0
    return occupied


def test_a_long_robot_drives_through_a_way_in_which_it_cannot_turn() -> None:
    topology = topology_of(narrow())
    made = planner_of(topology)
    poses = poses_of(made.plan((2.0, 6.0, math.pi), (12.0, 2.0, math.pi / 2)))
    assert Walls(topology.grid).touched(poses, curved=False) == 0
    inside = (poses[:, 0] > 6.5) & (poses[:, 0] < 8.5)
    assert np.abs(np.sin(poses[inside, 2])).max(initial=0.0) < 0.1


def test_only_a_robot_that_reverses_gets_out_of_a_dead_end() -> None:
    topology = topology_of(narrow())
    parked, out = (16.5, 5.4, 0.0), (12.0, 2.0, math.pi / 2)
    ahead = planner_of(topology, "budget_s=1")
    assert ahead.plan(parked, out).status in {hn.PlanStatus.APPROXIMATE, hn.PlanStatus.TIMEOUT}
    poses = poses_of(planner_of(topology, "reverses=true").plan(parked, out), reverses=True)
    assert Walls(topology.grid).touched(poses, curved=False) == 0
    # Back out of it, and in again ahead.
    first, second = next(
        pair for pair in itertools.pairwise(poses) if (pair[0][:2] != pair[1][:2]).any()
    )
    assert second[0] < first[0]
    assert first[2] == pytest.approx(0.0, abs=0.2)
    poses_of(ahead.plan(out, parked))


def test_where_time_is_short_the_grid_path_is_spelled_out_too(rooms: hn.TopologicalMap) -> None:
    free = topology_of(np.zeros((120, 160)))
    made = planner_of(free, "planner=BITstar", "budget_s=0.01", "confine=mask")
    result = made.plan((2.0, 3.0, 2.5), (6.0, 4.0, -1.0))
    poses = poses_of(result)
    assert len(poses) == 4
    # No path for this robot along the grid's path: the answer is none, and not one that touches.
    blind = planner_of(rooms, "planner=BITstar", "budget_s=0.01", "confine=mask")
    assert blind.plan((2.0, 3.0, 0.5), (17.0, 9.0, 1.0)).path is None


def test_equal_seeds_give_equal_paths_and_a_turn_alone_is_one(rooms: hn.TopologicalMap) -> None:
    made = planner_of(rooms, "iterations=3000", "budget_s=60")
    endpoints = (2.0, 3.0, 0.5), (17.0, 9.0, 1.0)
    np.testing.assert_array_equal(*(poses_of(made.plan(*endpoints)) for _ in range(2)))
    result = made.plan((3.0, 3.0, 0.5), (3.0, 3.0, -2.0))
    np.testing.assert_allclose(poses_of(result), [[3, 3, 0.5], [3, 3, -2.0]], atol=1e-9)
    assert (result.cost, result.lower_bound, result.gap) == (0.0, 0.0, 0.0)
