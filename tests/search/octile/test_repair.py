"""A jump-point graph that follows changed cells is the one built of the map then, bit for bit.

`python -m tests.search.octile.test_repair 5000` makes so many changes.
"""

import sys

import numpy as np
import pytest
from numpy.typing import NDArray

from hybridnav.search.octile import JumpGraph, JumpSearch, build_jump_graph
from hybridnav.search.octile.repair import FollowingGraph
from tests.strategies import examples

Free = NDArray[np.bool_]


def drawn_map(rng: np.random.Generator) -> Free:
    """A map of noise, of rooms with doors, or open."""
    free = rng.random(rng.integers(3, 60, 2)) > rng.choice([0, 0.02, 0.1, 0.3])
    if rng.random() < 0.5:
        free[:: rng.integers(4, 12)] = False
        free[:, rng.integers(0, free.shape[1], 3)] = True
    free[tuple(rng.integers(free.shape))] = True
    return free


def patched(free: Free, before: list[Free], rng: np.random.Generator) -> Free:
    """The map with a box closed, opened or drawn anew, one cell flipped, as it was once, closed or
    open as a whole."""
    now, (row, col) = free.copy(), rng.integers(free.shape)
    box = np.s_[row : row + rng.integers(1, 12), col : col + rng.integers(1, 12)]
    kind = rng.integers(10)
    if kind < 6:
        now[box] = (False, True, rng.random(now[box].shape) < 0.5)[kind % 3]
    elif kind == 6:
        now[row, col] ^= True
    elif kind < 9:
        now = before[rng.integers(len(before))].copy()
    else:
        now[:] = rng.random() < 0.5
    return now


def distances(graph: JumpGraph, free: Free) -> NDArray[np.int64]:
    """The distances ahead of each free cell, in the order of rows."""
    cells = (np.argwhere(free) - graph.origin) @ np.array([graph.shape[1], 1])
    words = graph.index[cells >> 6, 0].view(np.uint64)
    before = words & ((np.uint64(1) << (cells & 63).astype(np.uint64)) - np.uint64(1))
    return graph.ahead[(graph.index[cells >> 6, 2] >> 32) + np.bitwise_count(before)].astype(int)


def corner_cells(graph: JumpGraph) -> NDArray[np.int64]:
    """Row, column and blocked corners of each corner cell."""
    row, col, kind = graph.places >> 28, graph.places >> 4 & (1 << 24) - 1, graph.places & 15
    return np.stack([row + graph.origin[0], col + graph.origin[1], kind])


def assert_alike(found: JumpGraph, free: Free) -> None:
    """Assert that a graph is that of free cells, in whichever rectangle."""
    expected = build_jump_graph(free)
    assert np.array_equal(distances(found, free), distances(expected, free))
    assert np.array_equal(corner_cells(found), corner_cells(expected))
    for name in ("order", "first", "arcs", "component"):
        array, other = getattr(found, name), getattr(expected, name)
        assert array.dtype == other.dtype
        assert np.array_equal(array, other), name


def follow(n: int, rng: np.random.Generator) -> int:
    """Make so many changes; return after how many the graph was built anew."""
    n_anew = made = 0
    while made < n:
        free = drawn_map(rng)
        following, before = FollowingGraph(build_jump_graph(free)), [free]
        for _ in range(10):
            now = patched(free, before, rng)
            cells = np.argwhere(now != free)
            is_followed = following.follow(cells, now[tuple(cells.T)])
            free, made = now, made + 1
            before.append(free)
            if not is_followed:
                following, n_anew = FollowingGraph(build_jump_graph(free)), n_anew + 1
            assert_alike(following.graph, free)
    return n_anew


@pytest.mark.parametrize("seed", range(4))
def test_a_graph_that_follows_changes_is_one_built_anew(seed: int) -> None:
    n = examples(60)
    assert follow(n, np.random.default_rng(seed)) < n / 2


def test_freed_cells_beyond_the_rectangle_and_without_room_need_a_new_graph() -> None:
    free = np.zeros((9, 9), np.bool_)
    free[3:6, 3:6] = True
    following = FollowingGraph(build_jump_graph(free))
    before = following.graph
    assert not following.follow(np.array([[2, 4]]), np.array([True]))
    assert following.graph is before
    assert following.follow(np.array([[2, 4], [4, 4]]), np.array([False, False]))
    free[4, 4] = False
    assert_alike(following.graph, free)


def test_a_word_of_cells_takes_room_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hybridnav.search.octile.repair._LEAST_ROOM", 3)
    free = np.ones((40, 62), np.bool_)
    free[20] = False
    following, cells = FollowingGraph(build_jump_graph(free)), np.array([[20, 7]])
    for turn in range(9):
        free[20, 7] = turn % 2 == 0
        assert following.follow(cells, free[20, 7:8])
        assert_alike(following.graph, free)
    rows = np.stack([np.full(62, 20), np.arange(62)], axis=1)
    assert following.follow(rows, np.ones(62, np.bool_))
    free[:] = False
    more = np.argwhere(~free)
    assert following.follow(more, np.zeros(len(more), np.bool_))
    assert_alike(following.graph, free)
    assert not following.follow(more, np.ones(len(more), np.bool_))


def test_a_search_that_follows_finds_the_path_of_one_built_anew() -> None:
    rng = np.random.default_rng(5)
    free = rng.random((50, 70)) > 0.1
    following = FollowingGraph(build_jump_graph(free))
    for _ in range(8):
        now = patched(free, [free], rng)
        cells = np.argwhere(now != free)
        if not following.follow(cells, now[tuple(cells.T)]):
            following = FollowingGraph(build_jump_graph(now))
        free = now
        one, other = JumpSearch(following.graph), JumpSearch(build_jump_graph(free))
        ends = np.argwhere(free)
        for start, goal in ends[rng.integers(len(ends), size=(20, 2))] if len(ends) else ():
            found, expected = (each.path(tuple(start), tuple(goal)) for each in (one, other))
            assert found.length_cells == expected.length_cells
            assert (found.cells is None) == (expected.cells is None)
            if found.cells is not None and expected.cells is not None:
                assert np.array_equal(found.cells, expected.cells)


if __name__ == "__main__":
    n_changes = int(sys.argv[1])
    n_anew = follow(n_changes, np.random.default_rng(0))
    print(f"{n_changes} changes, equal bit for bit; built anew after {n_anew}")  # noqa: T201
