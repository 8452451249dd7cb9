"""A search of the mesh may be stopped at any time, with a bound; and what it looked at."""

import itertools
import math
import threading
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, example
from hypothesis import strategies as st
from numpy.typing import NDArray

from hybridnav.maps import CellClass
from hybridnav.search.mesh import MeshPath, MeshSearch, build_mesh
from tests.oracle.mesh import KINDS, search_of
from tests.strategies import class_grids, seeds, tried

SLACK = 1e-9
Cell = tuple[int, int]


def some_cells(free: NDArray[np.bool_], seed: int, number: int) -> list[Cell]:
    rng = np.random.default_rng(seed)
    cells = np.argwhere(free)
    return [(row, col) for row, col in cells[rng.integers(len(cells), size=number)].tolist()]


def scattered() -> NDArray[np.bool_]:
    """A map with many paths round small obstacles."""
    free = np.random.default_rng(3).random((40, 40)) > 0.2
    free[0, 0] = free[-1, -1] = True
    return free


def between(search: MeshSearch, start: Cell, goal: Cell, **effort: Any) -> MeshPath:
    centres = (start[0] + 0.5, start[1] + 0.5), (goal[0] + 0.5, goal[1] + 0.5)
    return search.path((start, goal), centres, **effort)


def interrupted(
    search: MeshSearch, start: Cell, goal: Cell, monkeypatch: pytest.MonkeyPatch
) -> Iterator[MeshPath]:
    """The answers of a search that is stopped after one step, after two, and so on, until it is
    done before it is stopped."""
    monkeypatch.setattr("hybridnav.search.mesh.search.SLICE", 1)
    for steps in itertools.count(1):
        clock = itertools.count()
        monkeypatch.setattr(
            "hybridnav.search.mesh.search.perf_counter", lambda now=clock: next(now)
        )
        found = between(search, start, goal, budget_s=steps)
        yield found
        if next(clock) <= steps:
            return


_ROUNDED = """
1111111011
1011101111
1111110111
1111111111
0110111110
1111010111
1111111111
1111110111
1111011111
1111011101
"""
"""Where a search is stopped one step before it ends, with a bound that rounding put above."""


@tried(40, classes=class_grids(max_side=14), seed=seeds, kind=st.sampled_from(KINDS))
@example(
    classes=np.array([list(row) for row in _ROUNDED.split()], dtype=np.uint8),
    seed=139,
    kind="intervals",
)
def test_bounds_rise_to_the_optimum_at_every_step(classes: Any, seed: int, kind: str) -> None:
    free = classes == CellClass.FREE
    assume(free.any())
    search = search_of(build_mesh(free), kind)
    start, goal = some_cells(free, seed, 2)
    optimum = between(search, start, goal).length_cells
    with pytest.MonkeyPatch.context() as patch:
        found = list(interrupted(search, start, goal, patch))
    bounds = [path.lower_bound_cells for path in found]
    lengths = [path.length_cells for path in found]
    assert bounds == sorted(bounds)
    assert lengths == sorted(lengths, reverse=True)
    assert found[-1].lower_bound_cells == found[-1].length_cells == optimum
    if math.isfinite(optimum):
        assert max(bounds) <= optimum <= min(lengths)
    for path in found:
        assert (path.positions is None) == math.isinf(path.length_cells)
    # What was stopped leaves nothing behind.
    assert between(search, start, goal).length_cells == optimum


@tried(
    40,
    classes=class_grids(max_side=14),
    seed=seeds,
    epsilon=st.sampled_from([0.01, 0.1, 1.0]),
    kind=st.sampled_from(KINDS),
)
def test_epsilon_bounds_the_ratio_of_length_and_bound(classes, seed, epsilon, kind):
    free = classes == CellClass.FREE
    assume(free.any())
    search = search_of(build_mesh(free), kind)
    start, goal = some_cells(free, seed, 2)
    plain = between(search, start, goal)
    found = between(search, start, goal, epsilon=epsilon)
    assert found.expanded <= plain.expanded
    if math.isinf(plain.length_cells):
        assert found.positions is None
        assert found.lower_bound_cells == math.inf
    else:
        assert found.lower_bound_cells <= plain.length_cells <= found.length_cells
        assert found.length_cells <= (1 + epsilon) * found.lower_bound_cells + SLACK


@pytest.mark.parametrize("kind", KINDS)
def test_a_search_out_of_time_without_a_path_still_bounds(monkeypatch, kind):
    search = search_of(build_mesh(scattered()), kind)
    found = list(interrupted(search, (0, 0), (39, 39), monkeypatch))
    assert len(found) > 10
    assert found[0].positions is None
    assert math.isinf(found[0].length_cells)
    assert math.hypot(39, 39) - SLACK <= found[0].lower_bound_cells < found[-1].length_cells


def test_a_search_prepares_itself_when_that_has_paid(monkeypatch: pytest.MonkeyPatch) -> None:
    """That is when its queries have expanded as many intervals as there are corners; later ones
    expand less than half of what they would."""
    monkeypatch.setattr("hybridnav.search.mesh.search._WORTH", 0)
    free = scattered()
    search, plain = MeshSearch(build_mesh(free)), MeshSearch(build_mesh(free))
    expanded = {False: [0, 0], True: [0, 0]}
    for seed in range(150):
        start, goal = some_cells(free, seed, 2)
        has_paid = plain.expanded >= len(plain.mesh.corners)
        found, alone = between(search, start, goal), between(plain, start, goal, budget_s=100.0)
        assert found.length_cells == pytest.approx(alone.length_cells)
        assert (search.graph is not None) == has_paid
        expanded[has_paid][0] += found.expanded
        expanded[has_paid][1] += alone.expanded
    assert expanded[False][0] == expanded[False][1] > 0
    assert 0 < 2 * expanded[True][0] < expanded[True][1]


def test_queries_of_a_large_map_do_not_wait_for_the_graph(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is built behind them, once; if memory does not suffice, they go on without it."""
    begun, may_end = [], threading.Event()

    def prepare(search: MeshSearch) -> None:
        begun.append(search)
        may_end.wait(60)
        raise MemoryError

    monkeypatch.setattr("hybridnav.search.mesh.search._WORTH", 0)
    monkeypatch.setattr("hybridnav.search.mesh.search.MANY_CORNERS", 0)
    monkeypatch.setattr(MeshSearch, "prepare", prepare)
    free = scattered()
    search, plain = MeshSearch(build_mesh(free)), MeshSearch(build_mesh(free))
    for seed in range(30):
        ends = some_cells(free, seed, 2)
        alone = between(plain, *ends, budget_s=100.0)
        assert between(search, *ends).length_cells == alone.length_cells
    assert search.expanded > len(search.mesh.corners)
    behind = [each for each in threading.enumerate() if each.name == "hybridnav-behind"]
    may_end.set()
    for each in behind:
        each.join()
    assert begun == [search]
    assert search.graph is None


def test_a_search_with_a_budget_does_not_prepare_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hybridnav.search.mesh.search._WORTH", 0)
    search = MeshSearch(build_mesh(scattered()))
    found = [between(search, (0, 0), (39, 39), budget_s=100.0).expanded for _ in range(12)]
    assert found == [found[0]] * 12


def test_too_many_edges_leave_the_search_as_it_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hybridnav.search.mesh.build._MOST_EDGES", 1)
    search = MeshSearch(build_mesh(scattered()))
    before = between(search, (0, 0), (39, 39))
    search.prepare()
    after = between(search, (0, 0), (39, 39))
    assert (after.length_cells, after.expanded) == (before.length_cells, before.expanded)
