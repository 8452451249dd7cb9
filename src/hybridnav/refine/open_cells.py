"""The cells that paths may use, less those that costs or a query close."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, LongArray
    from hybridnav.grid import OccupancyGrid


def open_cells(grid: OccupancyGrid, *closed: LongArray | None, allow_unexplored: bool) -> BoolArray:
    """Return which cells may be entered, bool (rows, cols), in an array of its own.

    Parameters
    ----------
    grid
        The map.
    closed
        int64 (n,), flat cells that may not be entered; None for none.
    allow_unexplored
        Whether unexplored cells may be entered.
    """
    free = grid.enterable(allow_unexplored=allow_unexplored)
    for cells in closed:
        if cells is not None:
            free.flat[cells] = False
    return free
