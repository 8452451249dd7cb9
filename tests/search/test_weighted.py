"""Grid search with factors in the cells, against scipy's Dijkstra on the graph of moves."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy import sparse

from hybridnav._base.moves import octile_distance_in_cells
from hybridnav.maps import CellClass
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.kernels import weighted as kernels
from tests.oracle.grid import assert_legal, distances, move_graph
from tests.strategies import class_grids, drawn, examples

seeds = st.integers(0, 2**32 - 1)
ONE = 1 << 14


def weighted(graph: Any, factors: Any) -> Any:
    """The graph of moves with lengths times the mean factors of their cells, as floats."""
    entries = graph.tocoo()
    tails, heads = entries.coords
    flat = factors.ravel()
    weights = entries.data * (flat[tails] + flat[heads]) / 2
    return sparse.coo_array((weights, (tails, heads)), shape=graph.shape).tocsr()


def counted(cells: Any, factors: Any) -> float:
    """Cost of a path of cells, counted move by move."""
    along = factors[cells[:, 0], cells[:, 1]]
    lengths = np.hypot(*np.diff(cells, axis=0).T)
    return float((lengths * (along[1:] + along[:-1]) / 2).sum())


def random_units(shape: tuple[int, int], rng: np.random.Generator) -> Any:
    """Units of all kinds: ones, noise, slopes, a few walls of high cost."""
    kind = rng.integers(5)
    if kind == 0:
        return np.full(shape, ONE, np.int32)
    if kind == 1:
        return rng.integers(ONE, 3 * ONE, shape, dtype=np.int32)
    if kind == 2:
        slope = np.add.outer(np.arange(shape[0]), np.arange(shape[1]))
        return (ONE + slope * rng.integers(1, 2000)).astype(np.int32)
    if kind == 3:
        return np.where(rng.random(shape) < 0.3, 1000 * ONE, ONE).astype(np.int32)
    return rng.choice(np.array([2 * ONE, 2 * ONE + 1, 5 * ONE], np.int32), shape)


@given(class_grids(max_side=24), seeds)
@settings(max_examples=examples(200))
def test_the_path_is_the_cheapest(classes: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    enterable = classes == CellClass.FREE
    assume(enterable.any())
    units = random_units(enterable.shape, rng)
    factors = units / ONE
    search = GridSearch(enterable, units=units)
    graph = weighted(move_graph(enterable), factors)
    free = np.argwhere(enterable)
    for _ in range(4):
        start, goal = (tuple(free[rng.integers(len(free))].tolist()) for _ in range(2))
        optimum = distances(graph, enterable.shape, start)[goal]
        found = search.search(start, goal)
        assert (found.cells is None) == np.isinf(optimum)
        if found.cells is not None:
            assert_legal(found.cells, enterable)
            assert tuple(found.cells[0]) == start
            assert tuple(found.cells[-1]) == goal
            cost = counted(found.cells, factors)
            assert abs(cost - optimum) <= 1e-9 * optimum
            assert cost >= octile_distance_in_cells(start, goal) * (1 - 1e-12)


@given(class_grids(max_side=16), seeds)
@settings(max_examples=examples(100))
def test_a_corridor_and_closed_cells_are_kept(classes: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    enterable = classes == CellClass.FREE
    units = random_units(enterable.shape, rng)
    field_of = rng.integers(0, 4, enterable.shape).astype(np.int32)
    in_corridor = rng.random(4) < 0.8
    blocked = np.flatnonzero(rng.random(enterable.size) < 0.1)
    is_open = enterable.copy()
    is_open.flat[blocked] = False
    inside = is_open & in_corridor[field_of]
    assume(inside.any())
    search = GridSearch(enterable, units=units)
    cells = np.argwhere(inside)
    start, goal = (tuple(cells[rng.integers(len(cells))].tolist()) for _ in range(2))
    for standable, more in (
        (is_open, {}),
        (inside, {"field_of": field_of, "in_corridor": in_corridor}),
    ):
        graph = weighted(move_graph(is_open, standable), units / ONE)
        optimum = distances(graph, enterable.shape, start)[goal]
        found = search.search(start, goal, blocked=blocked, **more)
        assert (found.cells is None) == np.isinf(optimum)
        if found.cells is not None:
            assert_legal(found.cells, is_open, standable)
            assert abs(counted(found.cells, units / ONE) - optimum) <= 1e-9 * optimum


def test_equal_factors_cost_as_many_times_the_length() -> None:
    enterable = np.ones((30, 30), np.bool_)
    enterable[5:25, 12] = False
    plain = GridSearch(enterable).search((10, 2), (15, 28)).cells
    for units in (ONE, 7 * ONE + 3):
        search = GridSearch(enterable, units=np.full(enterable.shape, units, np.int32))
        found = search.search((10, 2), (15, 28)).cells
        assert plain is not None
        assert found is not None
        ones = np.ones(enterable.shape)
        assert counted(found, ones) == counted(plain, ones)


def test_a_path_keeps_its_distance_where_that_is_cheap() -> None:
    enterable = drawn(".......", ".......", ".......") == CellClass.FREE
    units = np.full(enterable.shape, ONE, np.int32)
    units[0, 1:6] = 3 * ONE
    found = GridSearch(enterable, units=units).search((0, 0), (0, 6)).cells
    assert found is not None
    assert found[:, 0].tolist() == [0, 1, 1, 1, 1, 1, 0]


def test_searches_that_start_anew_forget_the_first_ones() -> None:
    rng = np.random.default_rng(3)
    enterable = rng.random((12, 12)) > 0.2
    units = random_units(enterable.shape, rng)
    search, graph = GridSearch(enterable, units=units), weighted(move_graph(enterable), units / ONE)
    with search._works.lent() as work:
        work.generation = kernels.GENERATIONS - 3
    free = np.argwhere(enterable)
    for _ in range(8):
        start, goal = (tuple(free[rng.integers(len(free))].tolist()) for _ in range(2))
        optimum = distances(graph, enterable.shape, start)[goal]
        cells = search.search(start, goal).cells
        assert (cells is None) == np.isinf(optimum)
        if cells is not None:
            assert abs(counted(cells, units / ONE) - optimum) <= 1e-9 * optimum


def test_a_full_bucket_starts_the_search_anew_with_more_room() -> None:
    rng = np.random.default_rng(0)
    enterable = np.ones((300, 300), np.bool_)
    units = rng.integers(ONE, 3 * ONE, enterable.shape, dtype=np.int32)
    search = GridSearch(enterable, units=units)
    first = search.search((0, 0), (299, 299)).cells
    with search._works.lent() as work:
        work.waiting = work.waiting[: kernels.n_buckets(ONE, 3 * ONE) * 2]
    second = search.search((0, 0), (299, 299)).cells
    assert first is not None
    assert second is not None
    assert (first == second).all()
