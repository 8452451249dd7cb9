"""Grid A*, Dijkstra and weighted A* behind the protocol, against scipy's Dijkstra."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.errors import InvalidValueError
from hybridnav.harness.baselines.grid import GridAstar, GridDijkstra, WeightedAstar
from hybridnav.maps import CellClass, OccupancyGrid
from tests.oracle.grid import assert_legal, distances, move_graph, recounted
from tests.strategies import class_grids, drawn, examples, occupancy_grid

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav.harness.baselines import Method

METHODS: dict[str, Callable[[OccupancyGrid], Method]] = {
    "grid-astar": GridAstar,
    "grid-dijkstra": GridDijkstra,
    "weighted-astar-1.5": WeightedAstar,
    "weighted-astar-1": lambda grid: WeightedAstar(grid, weight=1.0),
    "weighted-astar-4": lambda grid: WeightedAstar(grid, weight=4.0),
}

WALL = drawn(
    "......#......",
    "......#......",
    "......#......",
    "......#......",
    "......#......",
    ".............",
)


def make(name: str, grid: OccupancyGrid) -> Method:
    """The method that tables call by this name."""
    method = METHODS[name](grid)
    assert method.name == name
    return method


def cells_of(classes: Any, seed: int, count: int) -> list[tuple[int, int]]:
    """Some free cells of a map."""
    free = np.argwhere(classes == CellClass.FREE)
    if not len(free):
        return []
    chosen = np.random.default_rng(seed).integers(len(free), size=count)
    return [(int(row), int(col)) for row, col in free[chosen]]


@pytest.mark.parametrize("name", METHODS)
@settings(max_examples=examples(40))
@given(classes=class_grids(), seed=st.integers(0, 1000))
def test_paths_are_legal_and_as_long_as_the_bound_allows(
    name: str, classes: Any, seed: int
) -> None:
    grid = occupancy_grid(classes)
    method = make(name, grid)
    enterable = classes == CellClass.FREE
    graph = move_graph(enterable)
    assert method.n_nodes == enterable.sum()
    assert method.n_edges == graph.nnz
    chosen = cells_of(classes, seed, 5)
    for start in chosen:
        optima = distances(graph, grid.shape, start)
        for goal in chosen:
            answer = method.solve(start, goal)
            if math.isinf(optima[goal]):
                assert answer.cells is None
                assert math.isinf(answer.bound)
                continue
            assert answer.cells is not None
            assert_legal(answer.cells, enterable)
            assert tuple(answer.cells[0]) == start
            assert tuple(answer.cells[-1]) == goal
            length = recounted(answer.cells)
            assert length >= optima[goal] - 1e-9
            assert length <= answer.bound * optima[goal] + 1e-9
            assert answer.nodes is None
            assert answer.expanded <= method.n_nodes or name == "grid-astar"


@pytest.mark.parametrize("name", ["grid-astar", "grid-dijkstra", "weighted-astar-1"])
def test_exact_methods_say_so(name: str) -> None:
    method = make(name, occupancy_grid(WALL))
    answer = method.solve((5, 0), (5, 12))
    assert answer.cells is not None
    assert answer.bound == 1.0
    assert recounted(answer.cells) == pytest.approx(2 + 10 * math.sqrt(2))


def test_weighted_bound_is_the_weight_or_less() -> None:
    rng = np.random.default_rng(5)
    classes = np.where(rng.random((60, 60)) < 0.3, 0, 1).astype(np.uint8)
    method = WeightedAstar(occupancy_grid(classes), weight=3.0)
    chosen = cells_of(classes, 1, 60)
    answers = [method.solve(a, b) for a, b in zip(chosen, reversed(chosen), strict=True)]
    bounds = [answer.bound for answer in answers if answer.cells is not None]
    assert all(1.0 <= bound <= 3.0 for bound in bounds)
    assert np.median(bounds) < 2.0, "a search proves more than its weight on most maps"


def test_greater_weights_expand_fewer_cells_and_dijkstra_most() -> None:
    grid = occupancy_grid(np.ones((80, 80), dtype=np.uint8))
    counts = {name: make(name, grid).solve((40, 10), (45, 70)).expanded for name in METHODS}
    assert counts["weighted-astar-4"] <= counts["weighted-astar-1.5"] < counts["grid-dijkstra"]
    assert counts["grid-astar"] < counts["grid-dijkstra"]
    assert counts["weighted-astar-1.5"] == 60, "without obstacles only the path is expanded"


@pytest.mark.parametrize("name", METHODS)
def test_start_is_goal(name: str) -> None:
    answer = make(name, occupancy_grid(WALL)).solve((2, 3), (2, 3))
    assert answer.cells is not None
    assert answer.cells.tolist() == [[2, 3]]
    assert answer.bound == 1.0


@pytest.mark.parametrize("name", METHODS)
def test_queries_do_not_depend_on_those_before(name: str) -> None:
    rng = np.random.default_rng(2)
    classes = np.where(rng.random((40, 40)) < 0.25, 0, 1).astype(np.uint8)
    grid = occupancy_grid(classes)
    used = make(name, grid)
    chosen = cells_of(classes, 3, 20)
    for start, goal in zip(chosen, reversed(chosen), strict=True):
        again, fresh = used.solve(start, goal), make(name, grid).solve(start, goal)
        assert again.expanded == fresh.expanded
        assert again.bound == fresh.bound
        assert (again.cells is None) == (fresh.cells is None)
        if again.cells is not None and fresh.cells is not None:
            assert (again.cells == fresh.cells).all()


@pytest.mark.parametrize("name", METHODS)
def test_corners_are_cut_where_the_grid_allows_it(name: str) -> None:
    grid = occupancy_grid(drawn("#.", ".#"))
    assert make(name, grid).solve((0, 0), (1, 1)).cells is None
    cutting = OccupancyGrid(grid.probability, corner_cutting=True)
    answer = make(name, cutting).solve((0, 0), (1, 1))
    assert answer.cells is not None
    assert answer.cells.tolist() == [[0, 0], [1, 1]]


@pytest.mark.parametrize("weight", [0.5, math.nan, math.inf])
def test_weights_below_one_are_refused(weight: float) -> None:
    with pytest.raises(InvalidValueError, match="weight must be"):
        WeightedAstar(occupancy_grid(WALL), weight=weight)
