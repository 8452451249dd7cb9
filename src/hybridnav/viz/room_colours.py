"""Colours of rooms: neighbours differ, also through a wall, and equal names have equal colours."""

from __future__ import annotations

import networkx as nx
import numpy as np

from hybridnav._base.typing import IntArray, LongArray
from hybridnav.maps import NO_ROOM, OccupancyGrid, RoomLabels
from hybridnav.viz.places import N_COLOURS

_WALL_M = 1.0
"""Width of walls up to which the rooms on both sides are neighbours."""


def colour_rooms(labels: RoomLabels, grid: OccupancyGrid, *others: RoomLabels) -> LongArray:
    """Colour rooms with six colours, so that neighbours differ.

    The rooms that are hardest to place come first (Matula and Beck's smallest-last order), and each
    takes the colour least used among those that its neighbours leave. Equal input has equal
    colours.

    `labels`, `grid`: the rooms, and their map; `others`: rooms of other maps of the building with
    cells as large, whose rooms of the same names have the same colours when they are coloured with
    these. Result: int64 (n_rooms,), colours from 0 to 5.
    """
    maps = (labels, *others)
    names = sorted({name for each in maps for name in each.names})
    number_of = {name: number for number, name in enumerate(names)}
    graph = nx.empty_graph(len(names))
    # Ties hang on the order of the edges, which must not hang on that of the maps.
    edges = {
        tuple(sorted((len(each.names[at]), each.names[at]) for at in pair))
        for each in maps
        for pair in neighbours(each.label_of, grid.resolution_m).tolist()
    }
    graph.add_edges_from([number_of[name] for _, name in pair] for pair in sorted(edges))
    colour_of: dict[int, int] = {}
    n_used = [0] * N_COLOURS
    for room in nx.coloring.strategy_smallest_last(graph, colour_of):
        beside = [colour_of[other] for other in graph[room] if other in colour_of]
        # The rooms of two maps may leave none: the one that the fewest have.
        colour = min(range(N_COLOURS), key=lambda each: (beside.count(each), n_used[each]))
        colour_of[room] = colour
        n_used[colour] += 1
    return np.array([colour_of[number_of[name]] for name in labels.names], np.int64)


def neighbours(label_of: IntArray, resolution_m: float) -> LongArray:
    """Return the pairs of rooms that touch or have a wall between them, int64 (n, 2), each once.

    `label_of`: int32 (rows, cols), -1 for no room. A wall is crossed along a row or a column.
    """
    n_rooms = int(label_of.max(initial=0)) + 1
    pairs = []
    for of in (label_of, label_of.T):
        row, col = np.divmod(np.flatnonzero(of != NO_ROOM), of.shape[1])
        one, other = of[row[:-1], col[:-1]], of[row[1:], col[1:]]
        faces = (one != other) & (np.diff(row) == 0) & (np.diff(col) * resolution_m <= _WALL_M)
        low, high = np.sort([one[faces], other[faces]], axis=0).astype(np.int64)
        pairs.append(low * n_rooms + high)
    return np.stack(np.divmod(np.unique(np.concatenate(pairs)), n_rooms), axis=1)
