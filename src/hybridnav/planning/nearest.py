"""The nearest point to a goal that a robot can reach, and the nearest out of closed cells."""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence

import numpy as np

from hybridnav._base.moves import STEPS
from hybridnav._base.trig import hypot
from hybridnav._base.typing import BoolArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps import OccupancyGrid
from hybridnav.search.directed import DirectedSides
from hybridnav.search.found import ClosedCells
from hybridnav.search.grid_search import costs_from, directed_moves

_INSIDE = 1e-6
"""Cells that the point lies inside its cell, so that rounding takes it into no other."""


def check_within(within_m: float) -> None:
    """Refuse a distance that is no number of metres."""
    is_number = isinstance(within_m, int | float | np.number) and not isinstance(within_m, bool)
    if not is_number or not within_m >= 0:
        raise InvalidValueError(f"within_m must be metres, 0 or more, got {brief(within_m)}")


def nearest_reachable(
    grid: OccupancyGrid,
    is_open: BoolArray,
    ends: tuple[Sequence[float], Sequence[float]],
    within_m: float,
    one_way: DirectedSides | None = None,
) -> tuple[float, float] | None:
    """Find the point nearest to a goal, by the crow, in the free space that a start can reach.

    `grid`: the map; `is_open`: bool (rows, cols), the cells that may be entered, that of the start
    among them; `ends`: start and goal, `(x, y)` in metres, map frame, the goal maybe off the map;
    `within_m`: the farthest it may lie from the goal; `one_way`: sides that may be crossed in one
    direction only. Returns `(x, y)` in metres, or None.
    """
    from scipy import ndimage  # noqa: PLC0415 - plans to reachable goals need none of it

    start, goal = ends
    at = np.array(grid.frame.position_of(goal[0], goal[1]))
    reach = min(within_m / grid.resolution_m, hypot(*grid.shape) + float(np.abs(at).max()))
    low = np.clip(np.floor(at - reach) - 1, 0, grid.shape).astype(np.int64)
    high = np.clip(np.ceil(at + reach) + 1, 0, grid.shape).astype(np.int64)
    if not (low < high).all():
        return None
    here = grid.frame.cell_of(start[0], start[1])
    if one_way is None:
        # The moves of planners: a diagonal needs both its side cells, unless corners may be cut.
        labels, _ = ndimage.label(is_open, np.ones((3, 3)) if grid.corner_cutting else None)
        within = labels[low[0] : high[0], low[1] : high[1]] == labels[here]
    else:
        moves = directed_moves(is_open, one_way, corner_cutting=grid.corner_cutting)
        costs = costs_from(moves, here, np.flatnonzero(is_open)).reshape(grid.shape)
        within = costs[low[0] : high[0], low[1] : high[1]] >= 0
    cells = low + np.argwhere(within)
    nearest = np.clip(at, cells + _INSIDE, cells + 1 - _INSIDE)
    apart = nearest - at
    squared = (apart * apart).sum(axis=1)
    if not len(cells) or squared.min() > (reach + _INSIDE) ** 2:
        return None
    # Where several cells are equally near, the one in the first row.
    x, y = grid.frame.points_of_grid(nearest[squared.argmin()]).tolist()
    return x, y


def way_out(
    may_enter: BoolArray,
    closed: ClosedCells,
    start: int,
    *,
    corner_cutting: bool,
    one_way: DirectedSides | None = None,
) -> tuple[list[int], float] | None:
    """Find the shortest way of cells from a closed cell to the nearest one that is open.

    `may_enter`: bool (rows, cols), cells without walls; `start`: a flat cell; `one_way`: sides that
    may be crossed in one direction only. Returns the flat cells of the way, with those that its
    diagonals need beside them, and its length in cells; None where walls leave no way. Equal ways
    are broken by the order of rows.

    A way that left one of these cells but the last would have been shorter: so no path through
    them is longer inside, or passes the closed cells elsewhere.
    """
    rows, cols = may_enter.shape
    forbidden: dict[int, int] = {}
    if one_way is not None:
        flat, masks = one_way.forbidden
        forbidden = dict(zip(flat.tolist(), masks.tolist(), strict=True))
    before: dict[int, tuple[int, list[int]]] = {}
    queue: list[tuple[float, int, int, list[int]]] = [(0.0, start, start, [])]
    while queue:
        length, cell, source, beside = heapq.heappop(queue)
        if cell in before:
            continue
        before[cell] = source, beside
        if not closed.holds(np.array([cell]))[0]:
            break
        row, col = divmod(cell, cols)
        for k, (down, right) in enumerate(STEPS.tolist()):
            is_on = 0 <= row + down < rows and 0 <= col + right < cols
            if not is_on or forbidden.get(cell, 0) >> k & 1:
                continue
            to = cell + down * cols + right
            sides = [cell + down * cols, cell + right] if down and right else []
            needed = [] if corner_cutting else sides
            if all(may_enter.flat[each] for each in (to, *needed)):
                # Rounded, so that equal ways are equal in whatever order they are added up.
                further = round(length + (math.sqrt(2) if sides else 1.0), 9)
                heapq.heappush(queue, (further, to, cell, needed))
    else:
        return None
    way = [cell]
    while cell != start:
        cell, beside = before[cell]
        way += [cell, *beside]
    return way, length
