"""Kernels on the base of a level: walks round its vertices and faces by the ends of edges.

A level is rebuilt from these ends (`edge_end`: 0: no edge, 255: alive at the apex, else twice the
level at which the edge goes, plus one where it is removed and not contracted).
"""

from __future__ import annotations

from hybridnav._jit import njit


@njit(cache=True, nogil=True)
def next_at_cell(cell, direction, edge_end, cols):
    """Return the first dart of a base cell counter-clockwise after a direction, else -1.

    Directions are 0 east to 3 south. Darts of the base are 2 * base edge + half; the full turn ends
    with the direction itself.
    """
    for i in range(1, 5):
        turned = (direction + i) & 3
        if turned == 0:
            dart = 4 * cell
        elif turned == 1:
            dart = 4 * cell + 2
        elif turned == 2:
            dart = 4 * (cell - 1) + 1
        else:
            dart = 4 * (cell - cols) + 3
        if dart >= 0 and edge_end[dart >> 1] != 0:
            return dart
    return -1


@njit(cache=True, nogil=True)
def base_sigma(dart, edge_end, cols):
    """Return the next dart counter-clockwise in the base."""
    edge = dart >> 1
    cell = edge >> 1
    direction = edge & 1  # 0 east, 1 north of the lower cell
    if dart & 1:
        cell += cols if direction else 1
        direction += 2
    return next_at_cell(cell, direction, edge_end, cols)
