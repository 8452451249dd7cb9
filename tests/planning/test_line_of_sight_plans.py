"""Any-angle paths of every preset, by `smooth="line-of-sight"`."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.harness.judges import VisibilityGraph, segment_faults
from tests.oracle.grid import length_of_points
from tests.plans import (
    PLAIN,
    PRESETS,
    TWO_ROOMS,
    answer,
    grid_of,
    map_of,
    points_in,
    presets,
    scene_map,
)
from tests.strategies import Scene, scenes


def check_smooth(planner: hn.HybridPlanner, start: Any, goal: Any) -> hn.PlanResult:
    """An any-angle plan beside the plain one: exact ends, legal, no longer, bounded."""
    plain = planner.plan(start, goal)
    result = planner.plan(start, goal, smooth="line-of-sight")
    assert result.status is plain.status
    if result.path is None or plain.path is None:
        assert result.cost == result.lower_bound == math.inf
        return result
    assert (plain.metric, result.metric) == ("octile", "any-angle")
    points = result.path.points
    assert np.array_equal(points[0], start)
    assert np.array_equal(points[-1], goal)
    assert segment_faults(planner.grid, points) == ()
    assert result.cost == pytest.approx(length_of_points(points), abs=1e-12)
    over_centres = np.concatenate([[start], plain.path.points[1:-1], [goal]])
    assert result.cost <= length_of_points(over_centres) * (1 + 1e-9) + 1e-12
    assert np.array_equal(result.path.cells, plain.path.cells)
    assert 0 <= result.lower_bound <= result.cost
    assert result.lower_bound >= min(result.cost, math.dist(start, goal)) - 1e-12
    assert result.gap >= 0
    return result


@given(scene=scenes(max_side=16), at_centres=st.booleans())
@PLAIN
def test_an_any_angle_path_is_legal_and_its_bound_holds(scene: Scene, at_centres: bool) -> None:
    topology = scene_map(scene)
    grid = topology.grid
    graph = VisibilityGraph(grid)
    planners = [hn.HybridPlanner(topology, preset=preset) for preset in PRESETS]
    for start, goal in points_in(grid, np.random.default_rng(scene.seed), 3):
        cells = [grid.frame.cell_of(*point) for point in (start, goal)]
        endpoints = grid.frame.points_of(cells) if at_centres else (start, goal)
        optimum = graph.shortest(cells[0], cells[1]).length_m
        for planner in planners:
            result = check_smooth(planner, *endpoints)
            assert result.solved == math.isfinite(optimum)
            if at_centres and result.solved:
                assert result.lower_bound <= optimum + 1e-9
                assert optimum <= result.cost + 1e-9


@presets
def test_any_angle_paths_of_the_office(office_planners, preset):
    planner = office_planners[preset]
    grid = planner.grid
    pairs = points_in(grid, np.random.default_rng(4), 40)
    results = [check_smooth(planner, start, goal) for start, goal in pairs]
    solved = [result.path for result in results if result.path is not None]
    assert len(solved) > 20
    assert sum(len(path.points) for path in solved) < 0.1 * sum(len(path.cells) for path in solved)


@presets
def test_the_presets_own_smooth_and_the_argument_agree(office, preset):
    smoothing = hn.load_preset(preset, overrides=["planner.smooth=line-of-sight"])
    by_setting = hn.HybridPlanner(office, preset=smoothing)
    by_argument = hn.HybridPlanner(office, preset=preset)
    for start, goal in points_in(office.grid, np.random.default_rng(5), 10):
        asked = by_argument.plan(start, goal, smooth="line-of-sight")
        assert answer(by_setting.plan(start, goal)) == answer(asked)
        plain = by_argument.plan(start, goal)
        assert answer(by_setting.plan(start, goal, smooth="none")) == answer(plain)
        assert answer(by_argument.plan(start, goal, smooth="none")) == answer(plain)


@presets
def test_an_any_angle_path_inside_one_cell_is_the_line_itself(preset: str) -> None:
    planner = hn.HybridPlanner(map_of(grid_of(TWO_ROOMS)), preset=preset)
    start, goal = planner.grid.frame.points_of_grid([(2.1, 3.2), (2.9, 3.9)])
    result = check_smooth(planner, start, goal)
    assert result.cost == pytest.approx(0.05 * math.hypot(0.8, 0.7))
    assert result.gap == pytest.approx(0, abs=1e-12)
    assert planner.plan(start, goal).cost == 0
    same = planner.plan(start, start, smooth="line-of-sight")
    assert same.cost == same.lower_bound == same.gap == 0
    assert same.path.points.tolist() == [start.tolist()]


def test_an_any_angle_path_may_cross_unexplored_cells_where_they_may_be_entered() -> None:
    classes = np.ones((9, 30), dtype=np.uint8)
    classes[:, 12:18] = 2
    overrides = ["planner.allow_unexplored=true", "planner.smooth=line-of-sight"]
    for preset in PRESETS:
        setting = hn.load_preset(preset, overrides=overrides)
        planner = hn.HybridPlanner(map_of(grid_of(classes), merge_distance_m=0.3), preset=setting)
        start, goal = planner.grid.frame.points_of_grid([(4.5, 2.5), (2.1, 27.5)])
        result = planner.plan(start, goal).raise_for_status()
        assert len(result.path.points) == 2
        assert result.gap == pytest.approx(0, abs=1e-12)


@presets
@pytest.mark.parametrize("smooth", ["los", "", "LINE-OF-SIGHT", True])
def test_a_smooth_that_does_not_exist_is_refused(preset: str, smooth: Any) -> None:
    planner = hn.HybridPlanner(map_of(grid_of(TWO_ROOMS)), preset=preset)
    start, goal = planner.grid.frame.points_of([(2, 2), (2, 12)])
    with pytest.raises(hn.errors.HybridNavError, match=r"smooth.*line-of-sight"):
        planner.plan(start, goal, smooth=smooth)
