"""Kernels of the distances inside fields of upper levels, over the cliques of the level below."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.overlay._clique_kernels import largest
from hybridnav.overlay._cost_kernels import clique_place
from hybridnav.overlay._lane_kernels import FAR, LANES, relax_row


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
def distances_among(levels, fields, sources, table):
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
        for i in range(n):
            for lane in range(lanes):
                table[begin + lane, i] = distance[i * LANES + lane]
    return most


@njit(cache=True, nogil=True)
def fill_tables(levels, fields):
    """Compute tables, where they are kept, and cliques of some fields of an upper level.

    Parameters
    ----------
    levels
        Its tables and cliques are changed.
    fields
        int32 (k,), the fields.

    Returns
    -------
    int
        The largest distance that was reached.
    """
    most = np.int32(0)
    for field in fields:
        first, last = levels.node_at[field], levels.node_at[field + 1]
        inside = (levels.inner_at[field], levels.inner_at[field + 1])
        begin, end = levels.node_at[inside[0]], levels.node_at[inside[1]]
        at = levels.table_at[field]
        n, width = last - first, end - begin
        if levels.table_at[field + 1] > at:
            table = levels.table[at : at + n * width].reshape(n, width)
        else:
            table = np.empty((n, width), np.int32)
        most = max(most, distances_among(levels, inside, levels.below[first:last], table))
        at = levels.clique_at[field]
        for i in range(n):
            for j in range(i + 1):
                levels.clique[at + clique_place(i, j)] = table[i, levels.below[first + j] - begin]
    return most
