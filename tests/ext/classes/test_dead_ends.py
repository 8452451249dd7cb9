"""Dead ends: what a passage parts from start and goal, against networkx on the cells."""

from typing import Any

import networkx as nx
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hybridnav.ext.classes.search import DeadEnds
from hybridnav.maps import CellClass
from tests.strategies import class_grids, drawn


def walks_of(free):
    """Cells that may be entered, joined by their sides: no move cuts a corner."""
    walks = nx.grid_2d_graph(*free.shape)
    walks.remove_nodes_from([cell for cell in walks if not free[cell]])
    return walks


def runs_of(free, longest):
    """Cells of each run along a row or a column that is not too long, by looking at each cell."""
    found = []
    for step in ((0, 1), (1, 0)):
        runs: Any = nx.Graph()
        runs.add_nodes_from(walks_of(free))
        runs.add_edges_from(
            (a, b) for a, b in walks_of(free).edges if (b[0] - a[0], b[1] - a[1]) == step
        )
        found += [run for run in nx.connected_components(runs) if len(run) <= longest]
    return found


@given(classes=class_grids(12), reach=st.integers(1, 4), seed=st.integers(0, 2**32 - 1))
def test_what_is_taken_out_lies_behind_a_passage_from_start_and_goal(classes, reach, seed):
    free = classes == CellClass.FREE
    cells = np.argwhere(free)
    if len(cells) == 0:
        return
    chosen = np.random.default_rng(seed).choice(cells, 2).tolist()
    start, goal = (tuple(cell) for cell in chosen)
    walks = walks_of(free)
    if not nx.has_path(walks, start, goal):
        return
    left = DeadEnds(free, reach).left(start, goal)
    assert not (left & ~free).any()
    assert left[start]
    assert left[goal]
    behind = set()
    for run in runs_of(free, reach + 1):
        rest = walks.subgraph(set(walks) - run)
        endpoints = {end for end in (start, goal) if end in rest}
        for part in nx.connected_components(rest):
            if not endpoints & part and any(
                beside in run for cell in part for beside in walks[cell]
            ):
                behind |= part
    taken = set(map(tuple, np.argwhere(free & ~left).tolist()))
    assert taken <= behind


ROOMS = drawn(
    "##############",
    "#.....#......#",
    "#.....#..##..#",
    "#........##..#",
    "#.....#......#",
    "#.....#......#",
    "##############",
)


def test_a_room_with_one_narrow_door_is_taken_out_unless_an_end_lies_there():
    free = ROOMS == CellClass.FREE
    west, hall = (2, 2), (1, 8)
    # From the hall the western room is a dead end; from there all behind the doorway is.
    left = DeadEnds(free, 1).left(hall, (5, 12))
    assert not left[:, :6].any()
    assert (left[:, 6:] == free[:, 6:]).all()
    left = DeadEnds(free, 1).left(west, (5, 4))
    assert (left[:, :6] == free[:, :6]).all()
    assert not left[:, 7:].any()
    assert (DeadEnds(free, 1).left(west, hall) == free).all()


def test_a_room_with_two_doors_or_a_wide_one_is_no_dead_end():
    for doors in ([1], [2], [4]):  # a second one, and one of two cells
        free = ROOMS == CellClass.FREE
        free[doors, 6] = True
        left = DeadEnds(free, 1 if doors == [1] else 0).left((1, 8), (5, 12))
        assert left[1:6, 1:6].all()
