"""Outlines of few corners that follow walls, and whose common borders neighbours share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely

from hybridnav.io.borders import Borders
from hybridnav.io.regions import regions_of
from hybridnav.io.straight import straightened

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from hybridnav._typing import BoolArray, FloatArray, IntArray
    from hybridnav.grid import OccupancyGrid

_SLACK = 1.02
"""Steps of a cell are within a tolerance of a cell, whatever the rounding."""
_COLLINEAR_M = 0.01
"""Distance from a straight line at which a corner is none any more."""
_SHORT_M = 0.2
"""Length up to which a border between two rooms is a corner."""
_DECIMALS = 2
"""Decimals of coordinates: centimetres."""


class Outlines:
    """The outlines of rooms, for any tolerance.

    Furniture, pillars, and narrow bays in walls belong to the rooms round them.

    Parameters
    ----------
    label_of
        int32 (rows, cols), -1 for no room. Every room has a free cell.
    n_rooms
        Number of rooms.
    grid
        The map.
    """

    def __init__(self, label_of: IntArray, n_rooms: int, grid: OccupancyGrid) -> None:
        # Loads scipy and numba.
        from hybridnav.topology.cutting import wall_directions  # noqa: PLC0415

        region_of = regions_of(label_of, grid)
        self._grid = grid
        self._steps = Borders.of(region_of, n_rooms)
        self._borders = self._steps.without_short(_SHORT_M / grid.resolution_m)
        self._directions = wall_directions(_rim(region_of), grid.resolution_m)

    def within(self, tolerance_m: float) -> list[list[FloatArray]]:
        """Return outlines of few corners, straightened to walls.

        Neighbours share the corners of their common border. Free cells near an outline may lie on
        its other side.

        Parameters
        ----------
        tolerance_m
            How far an outline may lie from the steps of the cells, in metres, before its sides are
            brought into line with walls.

        Returns
        -------
        list
            Rings of each room, outer ones and holes, float64 (n, 2), `(x, y)` in metres, map frame,
            rounded to centimetres, or finer where cells are below 5 cm or a room is too thin.
            Filled by the even-odd rule they form the room.
        """
        side_m = self._grid.resolution_m
        simple = _simplified(self._borders.lines, _SLACK * tolerance_m / side_m)
        straight = straightened(simple, self._directions, side_m)
        if straight is not simple:
            straight = _simplified(straight, _COLLINEAR_M / side_m)
        n_rooms = len(self._borders.chains_of)
        areas = [self._borders.area(room, straight) for room in range(n_rooms)]
        rings = [_rings(area, self._grid) for area in areas]
        return [own if _has_area(own) else self._exact(room) for room, own in enumerate(rings)]

    def _exact(self, room: int) -> list[FloatArray]:
        """Return the outline of a room that is too thin for rounded corners."""
        return _rings(self._steps.area(room, self._steps.lines), self._grid, _DECIMALS + 1)


def _has_area(rings: list[FloatArray]) -> bool:
    return any(shapely.Polygon(ring).area > 0 for ring in rings)


def _rim(region_of: IntArray) -> BoolArray:
    """Return the cells of rooms with another room, or none, above or to the right of them."""
    padded = np.pad(region_of, ((0, 1), (0, 1)), constant_values=-1)
    inner = padded[:-1, :-1]
    rim: BoolArray = (inner != padded[1:, :-1]) | (inner != padded[:-1, 1:])
    return rim


def _simplified(lines: BaseGeometry, tolerance: float) -> BaseGeometry:
    """Return chains with few corners, which cross nowhere; the tolerance is in cells.

    They keep their ends and lie within the tolerance (Douglas and Peucker 1973).
    """
    return shapely.simplify(lines, tolerance, preserve_topology=True)


def _rings(area: BaseGeometry, grid: OccupancyGrid, decimals: int = _DECIMALS) -> list[FloatArray]:
    """Return the outer rings and holes in metres, rounded as in the file."""
    rings = [ring for part in shapely.get_parts(area) for ring in shapely.get_rings(part)]
    corners = [shapely.get_coordinates(r)[:-1, ::-1].clip(0, grid.shape) for r in rings]
    decimals += decimals_of(grid) - _DECIMALS
    return [grid.frame.points_of_grid(ring).round(decimals) + 0.0 for ring in corners]


def decimals_of(grid: OccupancyGrid) -> int:
    """Return the decimals of coordinates in metres: centimetres, or a fifth of a cell."""
    decimals = _DECIMALS
    while float(f"1e-{decimals}") > grid.resolution_m / 5:
        decimals += 1
    return decimals
