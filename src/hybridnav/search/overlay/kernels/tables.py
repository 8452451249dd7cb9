"""Kernels of the distances inside fields of upper levels, over the cliques of the level below."""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav.search.overlay.kernels.costs import clique_place, field_moves, slot_of
from hybridnav.search.overlay.kernels.exits import pack_table
from hybridnav.search.overlay.kernels.lanes import (
    FAR,
    LANES,
    STEP_BITS,
    keep_steps,
    match_row,
    relax_cell,
    relax_row,
)
from hybridnav.search.overlay.kernels.paths import mark_paths


@njit(cache=True, nogil=True)
def _through_clique(levels, field, distance, first, improved, is_new, is_old):
    """Lower the distances of the nodes of a field to those of its improved ones plus the clique's.

    Parameters
    ----------
    levels
        See `Levels`.
    field
        A field of the level.
    distance
        int32 (n * LANES,), changed.
    first
        Node of row 0 of `distance`.
    improved
        int32 (n,), work space.
    is_new, is_old
        bool (n,), changed: rows whose value came from outside, and rows whose crossing moves have
        to be looked at.

    Returns
    -------
    bool
        Whether a row of the field was improved from outside.
    """
    begin, end = levels.node_at[field] - first, levels.node_at[field + 1] - first
    n, count = end - begin, 0
    for i in range(n):
        if is_new[begin + i]:
            improved[count] = i
            count += 1
            is_new[begin + i] = False
    at = levels.clique_at[field]
    for j in range(n if count > 0 else 0):
        bits = np.int32(0)
        for c in range(count):
            i = improved[c]
            cost = levels.clique[at + clique_place(i, j)]
            bits |= relax_row(distance, np.int64(begin + j), np.int64(begin + i), cost)
        if bits != 0:
            is_old[begin + j] = True
    return count > 0


@njit(cache=True, nogil=True)
def _across(levels, field, distance, first, last, is_new, is_old):
    """Lower the distances at the far ends of the moves that leave a field.

    Parameters
    ----------
    levels
        See `Levels`.
    field
        A field of the level.
    distance
        int32 (n * LANES,), changed.
    first, last
        Node of row 0 of `distance`, and the one after that of its last row.
    is_new, is_old
        See `_through_clique`.
    """
    for node in range(levels.node_at[field], levels.node_at[field + 1]):
        if not is_old[node - first]:
            continue
        is_old[node - first] = False
        for at in range(levels.move_at[node], levels.move_at[node + 1]):
            other = levels.move_to[at]
            if other < first or other >= last:
                continue
            row, cost = np.int64(other - first), levels.move_cost[at]
            if relax_row(distance, row, np.int64(node - first), cost) != 0:
                is_new[row] = is_old[row] = True


@njit(cache=True, nogil=True)
def _note_exits(levels, fields, distance, is_exit):
    """Note the nodes that no other node of their field is on the way for, a bit for each lane.

    Parameters
    ----------
    levels
        See `Levels`.
    fields
        The first field and the one after the last.
    distance
        int32 (n * LANES,), the distances to the nodes of these fields.
    is_exit
        uint16 (n,), changed.
    """
    begin = levels.node_at[fields[0]]
    for field in range(fields[0], fields[1]):
        first, count = levels.node_at[field] - begin, levels.node_at[field + 1] - begin
        count -= first
        at = levels.clique_at[field]
        for i in range(count):
            others, row = np.int32(0), np.int64(first + i)
            for j in range(count):
                if j != i:
                    cost = levels.clique[at + clique_place(i, j)]
                    others |= match_row(distance, row, np.int64(first + j), cost)
            is_reached = np.int32(0)
            for lane in range(LANES):
                is_reached |= np.int32(distance[row * LANES + lane] < FAR) << lane
            is_exit[first + i] = is_reached & ~others


@njit(cache=True, nogil=True)
def distances_among(levels, fields, sources, table, is_exit):
    """Compute distances over the nodes of some fields of one level, their cliques and moves.

    Parameters
    ----------
    levels
        See `Levels`.
    fields
        The first field and the one after the last.
    sources
        int32 (m,), nodes of these fields.
    table
        int32 (m, n), changed: the distance from each source to each node of the fields.
    is_exit
        uint16 (blocks of LANES sources, n), changed: a bit for each source, whether a node is an
        exit towards it; nothing where exits are not asked for.

    Returns
    -------
    int
        The largest distance that was reached.
    """
    first, last = levels.node_at[fields[0]], levels.node_at[fields[1]]
    n = last - first
    distance = np.empty(n * LANES, np.int32)
    is_new, is_old = np.zeros(n, np.bool_), np.zeros(n, np.bool_)
    improved = np.empty(n, np.int32)
    most = np.int32(0)
    for begin in range(0, sources.size, LANES):
        lanes = min(LANES, sources.size - begin)
        distance[:] = FAR
        for lane in range(lanes):
            row = sources[begin + lane] - first
            distance[row * LANES + lane] = 0
            is_new[row] = is_old[row] = True
        turn, changed = 0, True
        while changed:
            changed = False
            for k in range(fields[1] - fields[0]):
                field = fields[0] + k if turn & 1 == 0 else fields[1] - 1 - k
                if _through_clique(levels, field, distance, first, improved, is_new, is_old):
                    changed = True
                    _across(levels, field, distance, first, last, is_new, is_old)
            turn += 1
        most = max(most, largest(distance))
        if len(is_exit) > 0:
            _note_exits(levels, fields, distance, is_exit[begin // LANES])
        for i in range(n):
            for lane in range(lanes):
                table[begin + lane, i] = distance[i * LANES + lane]
    return most


@guarded
@njit(cache=True, nogil=True)
def fill_clique(levels, field):
    """Compute the clique of a field of an upper level, and its marks on the second one.

    Parameters
    ----------
    levels
        Its marks and cliques are changed.
    field
        The field.

    Returns
    -------
    tuple
        The largest distance that was reached, and what is stored of the exits inside the field,
        nothing on the second level; see `pack_table`.
    """
    first, last = levels.node_at[field], levels.node_at[field + 1]
    inside = (levels.inner_at[field], levels.inner_at[field + 1])
    begin, end = levels.node_at[inside[0]], levels.node_at[inside[1]]
    n, width = last - first, end - begin
    has_exits = inside[0] >= levels.level_at[1]
    distance = np.empty((n, width), np.int32)
    is_exit = np.empty(((n + LANES - 1) // LANES if has_exits else 0, width), np.uint16)
    most = distances_among(levels, inside, levels.below[first:last], distance, is_exit)
    at = levels.clique_at[field]
    for i in range(n):
        for j in range(i + 1):
            levels.clique[at + clique_place(i, j)] = distance[i, levels.below[first + j] - begin]
    if has_exits:
        return most, pack_table(levels, field, distance, is_exit)
    mark_paths(levels, field, distance)
    return most, np.empty(0, np.int32)


# Kernels of the distances between the border cells of a field: sweeps over its cells.


@njit(cache=True, nogil=True)
def largest(distance):
    """Return the largest distance of what is reached, 0 for nothing."""
    most = np.int32(0)
    for i in range(distance.size):
        value = distance[i] if distance[i] < FAR else np.int32(0)
        most = max(most, value)
    return most


@njit(cache=True, nogil=True)
def _sweep(near, cost, distance, n):
    """Lower the distances of n cells until no move lowers one: forwards, backwards, and again."""
    changed = True
    while changed:
        bits = np.int32(0)
        for i in range(n):
            bits |= relax_cell(distance, near, cost, np.int64(i))
        for i in range(n - 1, -1, -1):
            bits |= relax_cell(distance, near, cost, np.int64(i))
        changed = bits != 0


@njit(cache=True, nogil=True)
def _largest_beside(near, cost, distance, is_reached):
    """Return the largest distance from the first of the cells that were not reached, and so on."""
    n, most = is_reached.size, np.int32(0)
    for source in range(n):
        if is_reached[source]:
            continue
        distance[:] = FAR
        distance[source * LANES] = 0
        _sweep(near, cost, distance, n)
        most = max(most, largest(distance))
        for i in range(n):
            is_reached[i] |= distance[i * LANES] < FAR
    return most


@njit(cache=True, nogil=True)
def _clique_of(near, cost, sources, n, clique, steps):
    """Compute the distances inside a field between some of its cells, and the steps to them.

    Parameters
    ----------
    near, cost
        See `field_moves`.
    sources
        int32 (m,), places of the cells.
    n
        Number of cells of the field.
    clique
        int32 (m * (m + 1) / 2,), changed: the distances; see `clique_place`.
    steps
        uint16 (blocks of LANES sources * n * STEP_BITS,), changed; see `Levels`.

    Returns
    -------
    int
        Not less than half of the largest distance between two cells that reach each other.
    """
    m = sources.size
    distance = np.empty((n + 1) * LANES, np.int32)
    is_reached = np.zeros(n, np.bool_)
    most = np.int32(0)
    for first in range(0, m, LANES):
        distance[:] = FAR
        lanes = min(LANES, m - first)
        for lane in range(lanes):
            distance[sources[first + lane] * LANES + lane] = 0
        _sweep(near, cost, distance, n)
        most = max(most, largest(distance))
        for i in range(n):
            at = (first // LANES * n + i) * STEP_BITS
            keep_steps(distance, near, cost, np.int64(i), steps, np.int64(at))
        for lane in range(lanes):
            for j in range(first + lane + 1):
                clique[clique_place(first + lane, j)] = distance[sources[j] * LANES + lane]
        for i in range(n):
            for lane in range(lanes):
                is_reached[i] |= distance[i * LANES + lane] < FAR
    if np.int64(cost.max()) * n < FAR // 2:  # no path is that long
        return most
    return max(most, _largest_beside(near, cost, distance, is_reached))


@njit(cache=True, nogil=True)
def _cells_of(ground, box, field):
    """Return the flat cells of a field, ascending, from the rows and columns that hold it."""
    cells, n = np.empty((box[1] - box[0]) * (box[3] - box[2]), np.int64), 0
    for row in range(box[0], box[1]):
        for cell in range(row * ground.cols + box[2], row * ground.cols + box[3]):
            if ground.field_of[slot_of(ground, cell)] == field:
                cells[n] = cell
                n += 1
    return cells[:n]


@njit(cache=True, nogil=True)
def fill_cliques(levels, ground, fields):
    """Compute the distances between the nodes of some fields of the first level.

    Parameters
    ----------
    levels
        See `Levels`; its cliques and steps are changed.
    ground
        See `CellCosts`.
    fields
        int32 (k,), the fields.

    Returns
    -------
    int
        Not less than half of the largest distance between two cells of one of these fields.
    """
    place_of = levels.place_of
    most = np.int32(0)
    for field in fields:
        first, last = levels.node_at[field], levels.node_at[field + 1]
        cells = _cells_of(ground, levels.box[field], field)
        near, cost = field_moves(ground, cells, place_of)
        sources = np.empty(last - first, np.int32)
        for i in range(last - first):
            sources[i] = place_of[slot_of(ground, np.int64(levels.cell_of[first + i]))]
        clique = levels.clique[levels.clique_at[field] : levels.clique_at[field + 1]]
        steps = levels.steps[levels.steps_at[field] : levels.steps_at[field + 1]]
        most = max(most, _clique_of(near, cost, sources, cells.size, clique, steps))
    return most
