"""Shortest paths that stay on an earlier one while that costs little more."""

from functools import partial

import numpy as np

from hybridnav._base.moves import path_length_in_cells
from hybridnav._base.typing import LongArray
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.geometry import polyline_length
from hybridnav.planning.methods.cheapest import cells_passed
from hybridnav.refine import CostLine
from hybridnav.refine.one_way import obeys
from hybridnav.search.found import Found, Query


def staying(grid: OccupancyGrid, line: CostLine, query: Query, found: Found) -> Found:
    """Return the rest of the kept path of a query instead of a shortest path, if it may be driven
    and costs little more.

    `grid`: the map; `line`: its open cells, without those closed for the query; `found`: what the
    method has found; its bound holds for both.
    """
    kept = query.kept
    assert kept is not None  # noqa: S101 - the caller has asked
    most_m = (1 + kept.within) * found.cost_m
    if kept.cells is None:
        points = line.rest_of(kept.points, query.points[0], most_m)
        if points is None or not obeys(line, query, points):
            return found
        passed, cost_m = partial(cells_passed, query, line, points), polyline_length(points)
        return Found(passed, cost_m, min(found.lower_bound_m, cost_m), points, stats=found.stats)
    cells, one_way = _rest_of_cells(kept.cells, query.cells[0]), query.one_way
    if (
        cells is None
        or (one_way is not None and one_way.meets(cells))
        or not _is_legal(cells, line, corner_cutting=grid.corner_cutting)
    ):
        return found
    cost_m = path_length_in_cells(cells) * grid.resolution_m
    if cost_m > most_m:
        return found
    return Found(cells, cost_m, min(found.lower_bound_m, cost_m), stats=found.stats)


def _rest_of_cells(cells: LongArray, start: tuple[int, int]) -> LongArray | None:
    """Return the rest of a path of cells from a cell on it or beside it; None from farther off."""
    apart = np.abs(cells - start).max(axis=1)
    on = np.flatnonzero(apart == 0)
    if len(on):
        return cells[on[-1] :]
    beside = np.flatnonzero(apart == 1)
    return np.concatenate([[start], cells[beside[-1] :]]) if len(beside) else None


def _is_legal(cells: LongArray, line: CostLine, *, corner_cutting: bool) -> bool:
    """Return whether all cells are open, and no diagonal cuts a corner where none may."""
    free = line.free
    (rows, cols), (to_rows, to_cols) = cells[:-1].T, cells[1:].T
    sides = free[rows, to_cols] & free[to_rows, cols]
    is_straight = (rows == to_rows) | (cols == to_cols)
    return bool(free[tuple(cells.T)].all() and (corner_cutting or (is_straight | sides).all()))
