"""Kernels of the distances between the border cells of a field: sweeps over its cells."""

from __future__ import annotations

import numpy as np

from hybridnav._jit import njit
from hybridnav.overlay._cost_kernels import clique_place, field_moves, slot_of
from hybridnav.overlay._lane_kernels import FAR, LANES, STEP_BITS, keep_steps, relax_cell


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
