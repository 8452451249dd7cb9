"""Colours of rooms: neighbours differ, also through a wall, and equal names have equal colours."""

from __future__ import annotations

import networkx as nx
import numpy as np
from scipy import ndimage

from hybridnav._base.typing import IntArray, LongArray
from hybridnav.maps import NO_ROOM, OccupancyGrid, RoomLabels
from hybridnav.viz.places import N_COLOURS

_WALL_M = 1.0
"""Width of walls up to which the rooms on both sides are neighbours."""
_SIDE_M = 0.1
"""Side of the cells on which walls are measured, of finer maps every second, third, ... one."""


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
    for each in maps:
        numbers = np.array([number_of[name] for name in each.names], np.int64)
        graph.add_edges_from(numbers[neighbours(each.label_of, grid.resolution_m)].tolist())
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

    `label_of`: int32 (rows, cols), -1 for no room.
    """
    n_rooms = int(label_of.max(initial=0)) + 1
    step = max(1, int(_SIDE_M / resolution_m))
    coarse = label_of[::step, ::step]
    away, (row, col) = ndimage.distance_transform_edt(coarse == NO_ROOM, return_indices=True)
    near = away * (step * resolution_m) <= _WALL_M / 2
    grown = np.where(near, coarse[row, col], np.int32(NO_ROOM))
    pairs = [np.empty(0, np.int64)]
    for of in (label_of, grown):
        for one, other in ((of[:, :-1], of[:, 1:]), (of[:-1], of[1:])):
            between = (one != other) & (one != NO_ROOM) & (other != NO_ROOM)
            low, high = np.sort([one[between], other[between]], axis=0).astype(np.int64)
            pairs.append(np.unique(low * n_rooms + high))
    return np.stack(np.divmod(np.unique(np.concatenate(pairs)), n_rooms), axis=1)
