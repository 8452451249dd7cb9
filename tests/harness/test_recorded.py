"""Recorded paths judged: losses against the visibility graph, parts, costs, two maps."""

import json
import math

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges import VisibilityGraph
from tests.strategies import drawn, framed, occupancy_grid

WALL = drawn("..........", "..........", ".########.", "..........", "..........")


def test_the_optimum_is_that_of_the_visibility_graph():
    for yaw in (0.0, 0.4):
        grid = framed(WALL, yaw)
        cells = [(1, 4), (0, 0), (4, 0), (4, 4)]
        points = grid.frame.points_of(np.array(cells))
        found = hn.judge(grid, points)
        best = VisibilityGraph(grid).shortest(cells[0], cells[-1]).length_m
        assert found.legal
        assert found.contacts == ()
        assert found.optimum_m == pytest.approx((best, best), rel=1e-9)
        assert found.loss == found.loss_at_most == pytest.approx(found.length_m / best - 1)
        assert hn.prove(found.optimum)["cost"] == pytest.approx(best)


def test_parts_lose_all_that_is_lost_and_the_worst_comes_first():
    grid = occupancy_grid(np.ones((20, 40), np.uint8))
    points = [(1, 1), (10, 1), (12, 9), (14, 1), (25, 1), (26, 3), (27, 1), (38, 1)]
    found = hn.judge(grid, np.array(points) + 0.25)
    lost = found.length_m - found.optimum_m[1]
    assert sum(part.loss_m for part in found.detours) == pytest.approx(lost, rel=1e-6)
    first, second = found.detours
    assert first.loss_m > second.loss_m
    assert first.start[0] == pytest.approx(10.25, abs=0.5)
    assert second.start[0] == pytest.approx(25.25, abs=0.5)


def test_an_illegal_path_has_a_loss_below_nothing():
    grid = occupancy_grid(WALL)
    found = hn.judge(grid, [(4.5, 0.5), (4.5, 4.5)])
    assert not found.legal
    assert [each.what for each in found.contacts] == ["obstacle"]
    assert found.loss < 0
    assert all(part.loss_m > 0 for part in found.detours)


def test_an_end_that_is_blocked_leaves_no_optimum_and_strict_json():
    found = hn.judge(occupancy_grid(WALL), [(4.5, 2.5), (4.5, 4.5)])
    assert found.optimum.status == "start occupied"
    assert found.optimum_m == (math.inf, math.inf)
    assert math.isnan(found.loss)
    told = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert told["status"] == "start occupied"
    assert told["loss"] is told["optimum_low_m"] is None
    assert found.detours == ()


def test_times_tell_speeds_and_a_standing_robot_does_not_turn():
    grid = occupancy_grid(np.ones((10, 10), np.uint8))
    points = [(1, 1), (4, 1), (4.1, 1.1), (3.9, 1.0), (4, 5)]
    found = hn.judge(grid, points, times_s=[0, 2, 3, 4, 8])
    assert found.duration_s == 8
    assert found.max_speed_m_s == 1.5
    assert found.turning_rad == pytest.approx(math.pi / 2)
    assert found.max_curvature_per_m == pytest.approx(math.pi / 2 / 3.5)
    assert found.mean_speed_m_s == pytest.approx(found.length_m / 8)
    with pytest.raises(InvalidValueError, match="ascending"):
        hn.judge(grid, points, times_s=[0, 2, 1, 4, 8])
    with pytest.raises(InvalidValueError, match="ascending"):
        hn.judge(grid, points, times_s=[0, 2])


def test_two_maps_enclose_the_optimum_and_leave_some_paths_undecided():
    inner, outer = WALL.copy(), WALL.copy()
    inner[2, 8] = inner[2, 1] = 1
    grids = occupancy_grid(outer), occupancy_grid(inner)
    found = hn.judge(grids[0], [(4.5, 0.5), (8.5, 1.5), (8.5, 3.5), (4.5, 4.5)], inner=grids[1])
    low, high = found.optimum_m
    assert low < high
    assert found.loss < found.loss_at_most
    assert found.legal is None
    assert hn.judge(grids[0], [(4.5, 0.5), (4.5, 4.5)], inner=grids[1]).legal is False
    assert hn.judge(grids[0], [(4.5, 0.5), (4.5, 1.5)], inner=grids[1]).legal is True


def test_a_planner_on_a_grid_alone_plans_and_refuses_places():
    grid = occupancy_grid(WALL)
    planner = hn.HybridPlanner(grid)
    whole = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    ends = (4.5, 0.5), (4.5, 4.5)
    result = planner.plan(*ends)
    assert result.cost == whole.plan(*ends).cost
    assert result.route is None
    assert result.to_dict()["settings"]["pyramid"] == {"robot_radius_m": 0.0}
    with pytest.raises(InvalidValueError, match="a grid alone"):
        _ = planner.topology
    with pytest.raises(InvalidValueError, match="a grid alone"):
        planner.plan("kitchen", ends[1])
    with pytest.raises(InvalidValueError, match="plans on the places"):
        hn.HybridPlanner(grid, preset="paper")


def test_what_is_no_map_or_planner_of_shortest_paths_is_refused():
    grid = occupancy_grid(WALL)
    with pytest.raises(InvalidValueError, match="expected a map or a planner of shortest paths"):
        hn.judge(hn.HybridPlanner(grid, preset="grid-astar"), [(0.5, 0.5), (1.5, 0.5)])
    with pytest.raises(InvalidValueError, match="which has none"):
        hn.judge(grid, [(0.5, 0.5), (1.5, 0.5)], costs=hn.HybridPlanner(grid))
