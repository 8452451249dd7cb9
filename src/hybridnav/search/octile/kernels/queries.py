"""Kernels of queries on a jump-point graph: the search, and the cells of the path that it finds."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.places import fixed, fixed_rows, room, room_rows
from hybridnav._base.moves import FAR
from hybridnav.search.contraction import corners_between
from hybridnav.search.octile.kernels.legs import (
    FROM_START,
    CornerCells,
    row_col_kind,
    shortest,
)


@njit(cache=True, nogil=True)
def _step(rows, cols):
    """Return -1, 0 or 1 for each of two offsets."""
    return int(rows > 0) - int(rows < 0), int(cols > 0) - int(cols < 0)


@njit(cache=True, nogil=True)
def _walk(cells, n_cells, rows, cols, is_straight_first):
    """Append the cells of a leg, by its offsets from the cell before.

    Return their number and the moves of the leg along a side and along a diagonal.
    """
    diagonal = min(abs(rows), abs(cols))
    straight = max(abs(rows), abs(cols)) - diagonal
    row, col = cells[n_cells - 1, 0], cells[n_cells - 1, 1]
    for part in range(2):
        if (part == 0) == is_straight_first:
            is_tall = abs(rows) > abs(cols)
            row_step, col_step = _step(rows if is_tall else 0, 0 if is_tall else cols)
            count = straight
        else:
            row_step, col_step = _step(rows, cols)
            count = diagonal
        for _ in range(count):
            row += row_step
            col += col_step
            cells[n_cells, 0], cells[n_cells, 1] = row, col
            n_cells += 1
    return n_cells, straight, diagonal


@njit(cache=True, nogil=True)
def cells_of(graph, endpoints, meeting, nodes, origin, cells, n_cells):
    """Append the cells of a path to `cells`.

    Parameters
    ----------
    graph, endpoints, meeting
        See `shortest`.
    nodes
        int32 (m,), the corner cells on the path.
    origin
        As in `paths`.
    cells, n_cells
        int64 (room, 2) as (row, col), and how many of them are filled.

    Returns
    -------
    tuple
        The cells, in a new array if there was no room; their number; the moves of the path along
        sides and along diagonals.
    """
    width, places = graph.tables[3], graph.places
    row, col = endpoints[0] // width, endpoints[0] % width
    cells = _with_room(cells, n_cells, 1 + _moves(places, width, endpoints, nodes))
    cells[n_cells, 0], cells[n_cells, 1] = row + origin[0], col + origin[1]
    n_cells += 1
    n_straight = n_diagonal = np.int64(0)
    for i in range(nodes.size + 1):
        to_row, to_col = endpoints[1] // width, endpoints[1] % width
        if i < nodes.size:
            to_row, to_col, _ = row_col_kind(places[nodes[i]])
        rows, cols = to_row - row, to_col - col
        # The last leg is free in the order of the goal.
        is_straight_first = i == nodes.size and meeting != FROM_START
        n_cells, straight, diagonal = _walk(cells, n_cells, rows, cols, is_straight_first)
        n_straight += straight
        n_diagonal += diagonal
        row, col = to_row, to_col
    return cells, n_cells, n_straight, n_diagonal


@njit(cache=True, nogil=True)
def _moves(places, width, endpoints, nodes):
    """Count the moves of a path."""
    row, col = endpoints[0] // width, endpoints[0] % width
    count = np.int64(0)
    for i in range(nodes.size + 1):
        to_row, to_col = endpoints[1] // width, endpoints[1] % width
        if i < nodes.size:
            to_row, to_col, _ = row_col_kind(places[nodes[i]])
        count += max(abs(to_row - row), abs(to_col - col))
        row, col = to_row, to_col
    return count


@njit(cache=True, nogil=True)
def _with_room(cells, n_cells, more):
    """Return an array of cells with room for `more`: the same one, or a copy."""
    if n_cells + more <= cells.shape[0]:
        return cells
    # The first path gets the room that it needs; after that the room doubles.
    larger = np.empty((2 * n_cells + more, 2), np.int64)
    larger[:n_cells] = cells[:n_cells]
    return larger


@njit(cache=True, nogil=True)
def _parts(places, ahead, behind):
    """Return a graph, the corner cells that its arcs lead past, and work; see `path_between`."""
    index, order = fixed_rows(places, 0, np.int64), fixed(places, 1, np.int32)
    width = places[9, 0]
    graph = CornerCells(
        (index, ahead, order, width),
        fixed(places, 2, np.int64),
        fixed(places, 3, np.int32),
        room_rows(places, 4, np.int64),
        fixed(places, 5, np.int32),
        fixed_rows(places, 6, np.int64),
        (index, behind, order, width),
        fixed_rows(places, 8, np.bool_),
    )
    heaps = room_rows(places, 13, np.int64), room_rows(places, 14, np.int64)
    touched, found = room(places, 15, np.int64), room(places, 16, np.int32)
    work = room_rows(places, 12, np.int64), heaps, touched, found
    return graph, fixed(places, 7, np.int64), work


@njit(cache=True, nogil=True)
def _append(parts, origin, ends, cells, n_cells, counts):
    """Append the cells of a shortest path to others, and set its counts; return the cells, in a new
    array if there was no room, and their number."""
    graph, middles, work = parts
    width, first = graph.tables[3], graph.first
    records, _, touched, _ = work
    (row, col), (to_row, to_col) = ends
    pair = (
        (row - origin[0]) * width + col - origin[1],
        (to_row - origin[0]) * width + to_col - origin[1],
    )
    cost, meeting, counts[2], n_touched = shortest(graph, pair, middles.size > 0, work)
    counts[0] = counts[1] = -1
    if cost < FAR:
        nodes = touched[:0]
        if meeting >= 0:
            nodes = corners_between((first, middles), meeting, records)
        cells, n_cells, counts[0], counts[1] = cells_of(
            graph, pair, meeting, nodes, origin, cells, n_cells
        )
    for k in range(n_touched):
        records[touched[k], 0] = records[touched[k], 1] = FAR
    return cells, n_cells


@guarded
@njit(cache=True, nogil=True)
def path_between(places, ahead, behind, ends):
    """Find a shortest path between two free cells.

    `places`: `places_of` of the index, order, places, component, follow, first, arcs, middles and
    reach of a graph, its width, its origin, and work, see `shortest`; `ahead`, `behind`: see
    `JumpGraph`; `ends`: (row, col) of start and goal. Returns int64 (n, 2), the cells (row, col);
    moves along sides, moves along diagonals, -1 for both where there is no path, and corner cells
    expanded.
    """
    counts, origin = np.empty(3, np.int64), (places[10, 0], places[11, 0])
    parts, cells = _parts(places, ahead, behind), np.empty((0, 2), np.int64)
    cells, n_cells = _append(parts, origin, ends, cells, 0, counts)
    return cells[:n_cells], counts[0], counts[1], counts[2]


@guarded
@njit(cache=True, nogil=True)
def paths(places, ahead, behind, endpoints):
    """Find shortest paths between pairs of cells.

    `places`, `ahead`, `behind`: see `path_between`; `endpoints`: int64 (k, 4), row and column of
    the start, then of the goal; free cells. Returns int64 (k + 1,), where the cells of each path
    begin; int64 (c, 2), the cells (row, col); int64 (k, 3), as the numbers of `path_between`.
    """
    origin = places[10, 0], places[11, 0]
    parts, cells = _parts(places, ahead, behind), np.empty((0, 2), np.int64)
    n = endpoints.shape[0]
    begin, counts, n_cells = np.zeros(n + 1, np.int64), np.empty((n, 3), np.int64), 0
    for i in range(n):
        ends = (endpoints[i, 0], endpoints[i, 1]), (endpoints[i, 2], endpoints[i, 3])
        cells, n_cells = _append(parts, origin, ends, cells, n_cells, counts[i])
        begin[i + 1] = n_cells
    return begin, cells[:n_cells], counts
