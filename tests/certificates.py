"""Plans held against what they prove: lower bound <= optimum <= cost."""

import itertools
import math
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.search.grid_search import GridSearch
from tests.oracle.grid import assert_legal, distances, move_graph, recounted
from tests.strategies import Scene

Cell = tuple[int, int]

CHOICES = [("paper", ()), ("grid-astar", ()), ("octile", ())]
"""Presets whose paths are paths of cells by length, and settings."""

DIRECTIONS = tuple(move for move in itertools.product((-1, 0, 1), repeat=2) if move != (0, 0))


def planners_of(topology: hn.TopologicalMap, *overrides: str) -> list[hn.HybridPlanner]:
    """Return a planner for each of the choices, prepared.

    Where corners may be cut, paths go where the places have no arcs (see `OccupancyGrid`): what
    the paper's rule cannot reach there is left out, and tested by itself.
    """
    choices = CHOICES[1:] if topology.grid.corner_cutting else CHOICES
    presets = [hn.load_preset(name, overrides=[*own, *overrides]) for name, own in choices]
    planners = [hn.HybridPlanner(topology, preset=preset) for preset in presets]
    for planner in planners:
        planner.prepare()
    return planners


def planned(planner: hn.HybridPlanner, start: Any, goal: Any) -> hn.PlanResult:
    """The plan between the centres of two cells."""
    return planner.plan(*planner.grid.frame.points_of([start, goal]))


def assert_proved(result: hn.PlanResult, optimum: float, *, is_exact: bool) -> None:
    """A result against the length of a shortest path in metres, infinite where there is none."""
    assert result.metric == "octile"
    if math.isinf(optimum):
        assert result.status is hn.PlanStatus.NO_PATH
        assert result.cost == result.lower_bound == math.inf
        assert math.isnan(result.gap)
        return
    assert result.status is hn.PlanStatus.SOLVED
    assert 0 <= result.lower_bound <= result.cost
    assert result.lower_bound <= optimum * (1 + 1e-9)
    assert optimum <= result.cost * (1 + 1e-9)
    if optimum == 0:
        assert result.cost == result.lower_bound == result.gap == 0
        return
    # Distinct cells are a cell apart at least, and so much every preset knows.
    assert result.lower_bound > 0
    assert result.gap == pytest.approx(result.cost / result.lower_bound - 1, abs=1e-12)
    if is_exact:
        assert result.gap == 0
        assert result.cost == pytest.approx(optimum, rel=1e-9)


def check_plan(planner: hn.HybridPlanner, start: Any, goal: Any, optimum: float) -> hn.PlanResult:
    """Plan, and hold the answer against the optimum, the legal moves and the preset's promise."""
    grid, setting = planner.grid, planner.preset.planner
    result = planned(planner, start, goal)
    # All presets but the paper's promise the optimum.
    assert_proved(result, optimum, is_exact=setting.method != "paper")
    if result.path is not None:
        enterable = grid.enterable(allow_unexplored=setting.allow_unexplored)
        cells = result.path.cells
        assert cells[[0, -1]].tolist() == [list(start), list(goal)]
        if not grid.corner_cutting:
            assert_legal(cells, enterable)
        assert enterable[cells[:, 0], cells[:, 1]].all()
        assert result.cost == pytest.approx(recounted(cells) * grid.resolution_m, rel=1e-12)
    return result


def check_pairs(planners: list[hn.HybridPlanner], pairs: Any, *, by_scipy: bool) -> None:
    """Hold every planner's answers against optima that none of them computed."""
    grid = planners[0].topology.grid
    enterable = grid.enterable(allow_unexplored=planners[0].preset.planner.allow_unexplored)
    graph = move_graph(enterable) if by_scipy else None
    search = GridSearch(enterable, corner_cutting=grid.corner_cutting)
    for start, goal in pairs:
        if graph is not None:
            optimum = float(distances(graph, grid.shape, start)[goal])
        else:
            found = search.search(start, goal).cells
            optimum = math.inf if found is None else recounted(found)
        for planner in planners:
            check_plan(planner, start, goal, optimum * grid.resolution_m)


def random_pairs(enterable: Any, rng: np.random.Generator, count: int) -> list[tuple[Cell, Cell]]:
    """Pairs of cells: anywhere, and as many from the two sides of a step."""
    cells = np.argwhere(enterable)
    if not len(cells):
        return []
    far = rng.choice(cells, (count, 2)).reshape(-1, 4)
    near = rng.choice(cells, count)
    beside = near + rng.choice(DIRECTIONS, count)
    inside = ((beside >= 0) & (beside < enterable.shape)).all(axis=1)
    near, beside = near[inside], beside[inside]
    free = enterable[beside[:, 0], beside[:, 1]]
    both = np.concatenate([far, np.concatenate([near[free], beside[free]], axis=1)])
    return [((a, b), (c, d)) for a, b, c, d in both.tolist()]


def built(scene: Scene, *, corner_cutting: bool = False) -> hn.TopologicalMap:
    plain = scene.grid
    grid = hn.OccupancyGrid(
        plain.probability, plain.frame, corner_cutting=corner_cutting, robot_radius_m=0
    )
    pyramid = hn.DualGraphPyramid.build(
        grid, merge_distance_m=scene.merge_distance_m, seed=scene.seed
    )
    return hn.TopologicalMap(pyramid)
