"""Areas of a map that changed, as boxes of cells.

In every public function `changed` is one of these: a shapely geometry or `(x_min, y_min, x_max,
y_max)` in metres, map frame; a mask of the cells; None for the whole map. Inside the package a box
of cells is `(first row, last row + 1, first column, last column + 1)`, as slices count.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.typing import BoolArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps.cells import Box
from hybridnav.maps.frame import Frame
from hybridnav.maps.occupancy import OccupancyGrid

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

_ROUNDING_CELLS = 1e-6


def box_of_area(
    changed: BaseGeometry | ArrayLike | None, frame: Frame, shape: tuple[int, int]
) -> Box:
    """Return the box of all cells that an area overlaps.

    `changed`: a shapely geometry in metres, whose bounds are taken, or
    `(x_min, y_min, x_max, y_max)` in metres, map frame; a mask, bool (rows, cols); None for the
    whole map; `frame`: place of the map; `shape`: its rows and columns. Result: first row, last row
    + 1, first column, last column + 1; nothing of it lies outside the map, and it is empty for an
    area outside the map, or a mask of no cell. Raises `InvalidValueError` when the area is no mask
    of the map and not described by four finite numbers, the least first.
    """
    if changed is None:
        return 0, shape[0], 0, shape[1]
    mask = getattr(changed, "dtype", None) == np.bool_
    return _box_of_changed(changed, shape) if mask else _box_of_bounds(changed, frame, shape)


def _box_of_changed(changed: Any, shape: tuple[int, int]) -> Box:
    mask: BoolArray = np.asarray(changed)
    if mask.shape != shape:
        raise InvalidValueError(
            f"changed is a mask of shape {mask.shape}, expected one of {shape} cells: make it for "
            "this map"
        )
    return box_of_mask(mask)


def box_of_mask(mask: BoolArray) -> Box:
    """Return the least box that holds the cells of a mask, one of no cells if it has none."""
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if not len(rows):
        return 0, 0, 0, 0
    return int(rows[0]), int(rows[-1]) + 1, int(cols[0]), int(cols[-1]) + 1


def _box_of_bounds(changed: Any, frame: Frame, shape: tuple[int, int]) -> Box:
    try:
        x_min, y_min, x_max, y_max = np.asarray(getattr(changed, "bounds", changed), np.float64)
        given = bool(x_min <= x_max < np.inf and y_min <= y_max < np.inf)
        given = given and min(x_min, y_min) > -np.inf
    except (TypeError, ValueError, OverflowError):
        given = False
    if not given:
        what = " ".join(f"{changed!r:.80}".split())
        raise InvalidValueError(
            f"changed is {what}, expected an area in metres: give a shapely geometry that is not "
            "empty, (x_min, y_min, x_max, y_max), or a mask, bool (rows, cols)"
        )
    corners = [frame.position_of(x, y) for x in (x_min, x_max) for y in (y_min, y_max)]
    first_row, high_row = _cells_over([row for row, _ in corners], shape[0])
    first_col, high_col = _cells_over([col for _, col in corners], shape[1])
    return first_row, high_row, first_col, high_col


def _cells_over(positions: list[float], count: int) -> tuple[int, int]:
    """Return the first cell along an axis between positions, and the first one beyond them."""
    low, high = min(positions) + _ROUNDING_CELLS, max(positions) - _ROUNDING_CELLS
    return math.floor(min(max(low, 0), count)), math.ceil(min(max(high, 0), count))


def class_rules(grid: OccupancyGrid) -> tuple[float, ...]:
    """Return what decides on the class of a cell beside the probabilities."""
    return (grid.free_threshold, grid.occupied_threshold, grid.robot_radius_m, grid.least_island_m2)


def class_reach(grid: OccupancyGrid) -> int:
    """Return the cells within which an obstacle decides on the class of a cell, and one more."""
    return math.ceil(grid.robot_radius_m / grid.resolution_m) + 1
