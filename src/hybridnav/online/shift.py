"""Where the cells of an older grid lie in a newer one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    from hybridnav._typing import AnyArray
    from hybridnav.grid import OccupancyGrid

MOST_SIDE = 32_767
"""Rows or columns of the largest grid: steps between cells have two bytes."""
_ALIGNED = 1e-6
"""Part of a cell by which the origins of two grids may lie beside whole cells."""


def shift_of(before: OccupancyGrid, after: OccupancyGrid, *, otherwise: str) -> tuple[int, int]:
    """Return the rows and columns by which cell (0, 0) of a newer grid lies lower.

    Parameters
    ----------
    before, after
        The grids; the newer one has to cover the older one, cell on cell.
    otherwise
        What a caller can do when the cells have another size, for the message.

    Raises
    ------
    InvalidValueError
        When the newer grid has cells of another size or at other points, or does not cover the
        older one.
    """
    old, new = before.frame, after.frame
    if (old.resolution_m, old.yaw_rad) != (new.resolution_m, new.yaw_rad):
        raise InvalidValueError(
            f"the grid has cells of {new.resolution_m:g} m with yaw {new.yaw_rad:g}, expected "
            f"{old.resolution_m:g} m and {old.yaw_rad:g}: {otherwise}"
        )
    exact = [-value for value in old.position_of(*new.origin_m)]
    rows, cols = map(round, exact)
    if max(abs(exact[0] - rows), abs(exact[1] - cols)) > _ALIGNED:
        raise InvalidValueError(
            f"the origin of the grid lies {exact[0]:g} rows and {exact[1]:g} columns lower, "
            "expected whole numbers: keep the cells where they are"
        )
    if (
        min(rows, cols) < 0
        or rows + before.shape[0] > after.shape[0]
        or cols + before.shape[1] > after.shape[1]
    ):
        raise InvalidValueError(
            f"the grid of {after.shape} cells, {rows} rows and {cols} columns lower, does not "
            f"cover the one before, of {before.shape} cells: mark lost cells as unexplored"
        )
    return rows, cols


def placed(
    array: AnyArray, shape: tuple[int, int], at: tuple[int, int], nothing: float
) -> AnyArray:
    """Return an array of an older grid on the cells of a newer one.

    Parameters
    ----------
    array
        Shape of the older grid.
    shape
        That of the newer one.
    at
        As `shift_of` returns it.
    nothing
        Value of the cells that are new.
    """
    if array.shape == shape:
        return array
    whole = np.full(shape, nothing, array.dtype)
    whole[at[0] : at[0] + array.shape[0], at[1] : at[1] + array.shape[1]] = array
    return whole


def check_sides(grid: OccupancyGrid) -> None:
    """Raise `InvalidValueError` if a grid has too many rows or columns."""
    if max(grid.shape) > MOST_SIDE:
        raise InvalidValueError(
            f"the grid has {grid.shape} cells, expected at most {MOST_SIDE} rows and columns: "
            "divide the map"
        )
