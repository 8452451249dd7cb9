"""A jump-point graph that follows changes answers as Dijkstra's algorithm does on the map now."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hybridnav.search.octile import JumpSearch, build_jump_graph, contract_graph
from tests.oracle.grid import assert_legal, distances, move_graph, recounted
from tests.strategies import MAX_SIDE, examples

SEEDS = st.integers(0, 2**32 - 1)


def some_map(rng: np.random.Generator) -> Any:
    """Noise or blocks, larger than a tile of the patch, with two far corners free."""
    rows, cols = (int(side) for side in rng.integers(1, 3 * MAX_SIDE, 2))
    free = rng.random((rows, cols)) < rng.choice([0.6, 0.9, 0.99, 1.0])
    if rng.random() < 0.5:
        coarse = rng.random((rows // 8 + 1, cols // 8 + 1)) < 0.8
        free = np.kron(coarse, np.ones((8, 8), np.bool_))[:rows, :cols]
    free = np.ascontiguousarray(free)
    free[0, 0] = free[-1, -1] = True
    return free


def changed(free: Any, rng: np.random.Generator) -> Any:
    """The map with a box freed, blocked or shuffled, or with single cells changed."""
    new = free.copy()
    row, col = (int(rng.integers(side)) for side in free.shape)
    box = np.s_[row : row + rng.integers(1, 12), col : col + rng.integers(1, 12)]
    kind = rng.integers(4)
    if kind == 3:
        new ^= rng.random(free.shape) < 0.005
    else:
        new[box] = rng.random(new[box].shape) < kind / 2
    new[0, 0] = new[-1, -1] = True
    return new


@settings(max_examples=examples(60), deadline=None)
@given(SEEDS, st.booleans())
def test_paths_after_changes_are_shortest(seed: int, contracted: bool) -> None:  # noqa: FBT001
    rng = np.random.default_rng(seed)
    free = some_map(rng)
    graph = build_jump_graph(free)
    search: JumpSearch | None = JumpSearch(contract_graph(graph) if contracted else graph)
    for _ in range(3):
        new = changed(free, rng)
        assert search is not None
        search = search.renewed(new, np.argwhere(new != free))
        assume(search is not None)
        assert search is not None
        free = new
        graph_of_moves, cells = move_graph(free), np.argwhere(free)
        start = tuple(cells[rng.integers(len(cells))].tolist())
        least = distances(graph_of_moves, free.shape, start)
        goals = cells[rng.integers(len(cells), size=12)]
        many = search.many(np.tile(start, (12, 1)), goals)
        for goal, length in zip(map(tuple, goals.tolist()), many.length_cells, strict=True):
            found = search.path(start, goal)
            assert found.length_cells == length == pytest.approx(least[goal], rel=1e-12)
            if found.cells is not None:
                assert_legal(found.cells, free)
                assert tuple(found.cells[0]) == start
                assert tuple(found.cells[-1]) == goal
                assert recounted(found.cells) == pytest.approx(least[goal], rel=1e-12)


def test_a_search_stays_as_it_is_when_its_map_changes() -> None:
    free = np.ones((20, 20), np.bool_)
    search = JumpSearch(build_jump_graph(free))
    wall = free.copy()
    wall[:19, 10] = False
    after = search.renewed(wall, np.argwhere(wall != free))
    assert after is not None
    assert search.path((0, 0), (0, 19)).length_cells == 19
    assert after.path((0, 0), (0, 19)).length_cells == pytest.approx(
        distances(move_graph(wall), wall.shape, (0, 0))[0, 19]
    )


def test_a_graph_is_built_anew_for_cells_it_has_no_room_for() -> None:
    free = np.zeros((20, 20), np.bool_)
    free[5:15, 5:15] = True
    search = JumpSearch(build_jump_graph(free))
    wider = free.copy()
    wider[5, 3:5] = True
    assert search.renewed(wider, np.array([[5, 3], [5, 4]])) is None
    everywhere = np.argwhere(np.ones((200, 200), np.bool_))
    large = JumpSearch(build_jump_graph(np.ones((200, 200), np.bool_)))
    assert large.renewed(np.zeros((200, 200), np.bool_), everywhere) is None
