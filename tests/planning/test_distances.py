"""Tables of distances, against plans of each pair and lengths by scipy."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

import hybridnav as hn
from benchmarks.worlds import office_world
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass
from hybridnav.planning import questions
from hybridnav.search import distance_table
from hybridnav.search.distance_table import distance_blocks
from hybridnav.search.mesh import CornerHierarchy, MeshSearch, build_mesh
from hybridnav.search.mesh.labels import MeshLabels, ViewLabels
from tests.oracle.any_angle import some_positions
from tests.oracle.grid import distances, move_graph
from tests.strategies import class_grids, examples, occupancy_grid

PLAIN = settings(max_examples=examples(60), deadline=None, derandomize=True)
PRESETS = ("shortest", "octile", "grid-astar", "robot", "paper")


def planner_of(grid: hn.OccupancyGrid, preset: str) -> hn.HybridPlanner:
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    return hn.HybridPlanner(topology, preset=hn.load_preset(preset))


def ends_in(grid: hn.OccupancyGrid, seed: int, count: int = 6) -> Any:
    """Points of free cells, some on sides and corners of cells, one off the map, one in a wall."""
    free = grid.classes == CellClass.FREE
    rng = np.random.default_rng(seed)
    positions = [position for _, position in some_positions(free, seed)]
    picked = rng.integers(len(positions), size=(2, count))
    starts, goals = (grid.frame.points_of_grid(np.array(positions)[part]) for part in picked)
    goals[0], goals[1] = starts[0], (-7.0, 1.0)
    return starts, goals


def pair_by_pair(planner: Any, starts: Any, goals: Any, **asked: Any) -> Any:
    found = np.empty((len(starts), len(goals)))
    for i, j in itertools.product(range(len(starts)), range(len(goals))):
        result = planner.plan(starts[i], goals[j], **asked)
        is_answer = result.solved or result.status is hn.PlanStatus.NO_PATH
        found[i, j] = result.cost if is_answer else math.nan
    return found


@PLAIN
@given(class_grids(), st.integers(0, 99), st.sampled_from(PRESETS[:2]))
def test_tables_hold_the_costs_of_plans(classes, seed, preset):
    if not (classes == CellClass.FREE).any():
        return
    planner = planner_of(occupancy_grid(classes), preset)
    starts, goals = ends_in(planner.grid, seed)
    table = planner.distances(starts, goals)
    np.testing.assert_allclose(table, pair_by_pair(planner, starts, goals), rtol=1e-9, atol=1e-8)


@PLAIN
@given(class_grids(), st.integers(0, 99), st.sampled_from(("shortest", "octile", "grid-astar")))
def test_tables_round_closures_and_by_costs_hold_the_costs_of_plans(classes, seed, preset):
    if not (classes == CellClass.FREE).any():
        return
    grid, rng = occupancy_grid(classes), np.random.default_rng(seed)
    factors = rng.uniform(1, 4, grid.shape).astype(np.float32)
    costs = hn.CostLayer(factors) if preset == "grid-astar" and seed % 2 else None
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    planner = hn.HybridPlanner(topology, preset=preset, costs=costs)
    starts, goals = ends_in(grid, seed)
    blocked = {"cells": np.argwhere(rng.random(grid.shape) < 0.1)} if seed % 3 else None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(questions, "_WORTH", 0)
        table = planner.distances(starts, goals, blocked=blocked)
    plans = pair_by_pair(planner, starts, goals, blocked=blocked)
    np.testing.assert_allclose(table, plans, rtol=1e-9, atol=1e-8)


@PLAIN
@given(class_grids(), st.integers(0, 99))
def test_octile_tables_agree_with_scipy(classes, seed):
    free = classes == CellClass.FREE
    if not free.any():
        return
    planner = planner_of(occupancy_grid(classes), "octile")
    cells = np.random.default_rng(seed).choice(np.argwhere(free), 5)
    table = planner.distances(*[planner.grid.frame.points_of(cells)] * 2)
    graph = move_graph(free)
    for row, cell in zip(table, cells.tolist(), strict=True):
        true = distances(graph, free.shape, tuple(cell))[tuple(cells.T)]
        np.testing.assert_allclose(row, true, rtol=1e-12)


@pytest.mark.parametrize("preset", PRESETS)
def test_every_preset_answers_with_and_without_closures(preset, monkeypatch):
    monkeypatch.setattr(distance_table, "BLOCK", 4)  # several blocks
    grid = office_world().grid(robot_radius_m=0.25)
    planner = planner_of(grid, preset)
    free = np.argwhere(grid.classes == CellClass.FREE)
    cells = np.random.default_rng(1).choice(free, (2, 9))
    starts, goals = grid.frame.points_of(cells)
    goals[3] = (-50.0, 0.0)
    for blocked in (None, {"cells": free[:: len(free) // 40]}):
        plans = pair_by_pair(planner, starts, goals, blocked=blocked)
        table = planner.distances(starts, goals, blocked=blocked)
        np.testing.assert_allclose(table, plans, rtol=1e-9, atol=1e-8)
        some = planner.distance(starts[2], goals[4], blocked=blocked)
        np.testing.assert_allclose(some, plans[2, 4], rtol=1e-9)
    done: list[tuple[int, int]] = []
    near = planner.distances(starts, goals, nearest=3, progress=lambda *step: done.append(step))
    assert done[-1][0] == done[-1][1]
    assert isinstance(near, sparse.csr_array)
    for row, costs in enumerate(planner.distances(starts, goals)):
        part = slice(near.indptr[row], near.indptr[row + 1])
        least = np.sort(costs[np.isfinite(costs)])[:3]
        np.testing.assert_array_equal([near.data[part], costs[near.indices[part]]], [least] * 2)
    # From a to c tables of searches or labels hold no more than over b: other costs need plans.
    ends = grid.frame.points_of(np.random.default_rng(0).choice(free, 24))
    table = planner.distances(ends, ends)
    over = (table[:, :, None] + table).min(axis=1)
    assert (table <= over * (1 + 1e-9) + 1e-8).all() == (preset in PRESETS[:3])


@PLAIN
@given(class_grids(), st.integers(0, 99))
def test_labels_without_a_hierarchy_agree_with_those_of_one(classes, seed):
    free = classes == CellClass.FREE
    if not free.any():
        return
    search = MeshSearch(build_mesh(free))
    search.prepare()
    if not isinstance(search.graph, CornerHierarchy) or search.edges is None:
        return
    picked = some_positions(free, seed)[:8]
    cells = np.array([cell for cell, _ in picked])
    ends = cells, np.array([position for _, position in picked], np.float64)
    for source in (MeshLabels(search, search.graph), ViewLabels(search, search.edges)):
        for rows, columns, lengths in distance_blocks(source, ends, ends):
            for i, j in itertools.product(range(rows.start, rows.stop), range(columns.stop)):
                (one, at), (other, to) = picked[i], picked[j]
                path = search.path((one, other), (at, to))
                found = lengths[i - rows.start, j - columns.start]
                assert found == pytest.approx(path.length_cells, rel=1e-9, abs=1e-8)


def test_hostile_tables_end_in_one_line_and_empty_ones_are_empty():
    planner = planner_of(hn.example_map("figure1"), "shortest")
    assert planner.distances([], [(0.5, 0.5)]).shape == (0, 1)
    assert planner.distances([(0.5, 0.5)], []).shape == (1, 0)
    assert planner.distances([(0.5, 0.5)], [], nearest=2).shape == (1, 0)
    wrong: list[Any] = [0, -1, 1.5, True]
    for nearest in wrong:
        with pytest.raises(InvalidValueError, match=r"\Anearest must be[^\n]+\Z"):
            planner.distances([(0.5, 0.5)], [(0.5, 0.5)], nearest=nearest)
    with pytest.raises(InvalidValueError, match=r"\Astarts must be[^\n]+\Z"):
        planner.distances([(math.nan, 0)], [(0.5, 0.5)])
    assert math.isnan(planner.distance((-50, 0), (0.5, 0.5)))
