"""The judge's own Dijkstra by costs, against scipy's."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.harness.judges import CheapestCost, ScipyOptimum
from tests.layers import grid_of, layer_of
from tests.oracle.grid import distances, move_graph
from tests.search.test_weighted import weighted
from tests.strategies import class_grids, examples, occupancy_grid


@given(class_grids(max_side=20), st.integers(0, 2**32 - 1))
@settings(max_examples=examples(80), deadline=None)
def test_costs_are_those_of_scipy(classes: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = occupancy_grid(classes, resolution_m=0.5)
    most = rng.choice([1.0, 3.0, 1000.0])
    layer = layer_of(rng.uniform(1, most, grid.shape), rng.random(grid.shape) < 0.05)
    is_open = grid.enterable()
    is_open.flat[layer.closed_flat] = False
    graph = weighted(move_graph(is_open), layer.factors.astype(float))
    start = tuple(rng.integers(grid.shape).tolist())
    least = distances(graph, grid.shape, start) * 0.5
    least[start] = 0.0
    search = CheapestCost(grid, layer)
    for goal in np.ndindex(grid.shape):
        known = least[goal] if is_open[goal] and is_open[start] else np.inf
        assert search.cost_m(start, goal) == pytest.approx(known, rel=1e-12)


def test_lengths_are_those_of_scipy_on_a_map() -> None:
    grid = hn.example_map("office", robot_radius_m=0.25)
    free = np.argwhere(grid.enterable())
    rng = np.random.default_rng(0)
    lengths, scipy = CheapestCost(grid), ScipyOptimum(grid)
    start = tuple(free[rng.integers(len(free))].tolist())
    known = scipy.lengths_from(start)
    for cell in free[rng.integers(len(free), size=20)].tolist():
        goal = (cell[0], cell[1])
        assert lengths.cost_m(start, goal) == pytest.approx(known[goal], rel=1e-12)


def test_corners_are_cut_where_the_map_allows_it() -> None:
    grid = grid_of(np.array([[0.0, 1.0], [0.0, 0.0]]), robot_radius_m=0)
    cut = dataclasses.replace(grid, corner_cutting=True)
    layer = layer_of(np.array([[1.0, 1.0], [9.0, 3.0]]))
    assert CheapestCost(grid, layer).cost_m((0, 0), (1, 1)) == 11.0
    assert CheapestCost(cut, layer).cost_m((0, 0), (1, 1)) == pytest.approx(2 * 2**0.5)


def test_cells_and_layers_of_other_maps_are_refused() -> None:
    grid = grid_of(np.zeros((2, 3)), robot_radius_m=0)
    with pytest.raises(
        hn.InvalidValueError,
        match=r"goal is cell \(2, 0\), expected one of the map of 2 rows and 3 columns",
    ):
        CheapestCost(grid).cost_m((0, 0), (2, 0))
    with pytest.raises(hn.InvalidValueError, match="costs of 4 x 4 cells are not those"):
        CheapestCost(grid, layer_of(np.ones((4, 4))))
