"""What a file of rooms states of each room besides its outline: area, extent, a point."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hybridnav.maps import CellClass, OccupancyGrid, RoomLabels
from hybridnav.maps.room_labels import Point


@dataclass(frozen=True)
class RoomMeasures:
    """Place and size of a room's cells measured as free, in metres, map frame."""

    centre_m: Point
    """Centre of gravity `(x, y)`; it may lie outside the room."""
    low_m: Point
    """Lower left corner of the smallest box along x and y that holds the cells."""
    high_m: Point
    """Upper right corner of that box."""

    @property
    def size_m(self) -> Point:
        """Width in x and height in y."""
        return self.high_m[0] - self.low_m[0], self.high_m[1] - self.low_m[1]


def measures_of(rooms: RoomLabels, grid: OccupancyGrid) -> list[RoomMeasures]:
    """Return place and size of each room, in the order of the names.

    `rooms`: the rooms; each has a free cell; `grid`: their map, as measured.
    """
    cells = np.argwhere((grid.measured == CellClass.FREE) & (rooms.label_of >= 0))
    labels = rooms.label_of[tuple(cells.T)]
    order = np.argsort(labels, kind="stable")
    starts = np.searchsorted(labels[order], np.arange(len(rooms.names)))
    points = grid.frame.points_of(cells[order])
    # A square of a turned map reaches farther along x and y than half its side.
    half = np.abs(grid.frame.axes_m).sum(axis=0) / 2
    if not len(starts):
        return []
    low, high = np.minimum.reduceat(points, starts), np.maximum.reduceat(points, starts)
    centre = np.add.reduceat(points, starts) / np.diff(starts, append=len(points))[:, None]
    return [
        RoomMeasures(_pair(middle), _pair(least), _pair(most))
        for middle, least, most in zip(centre, low - half, high + half, strict=True)
    ]


def _pair(point: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> Point:
    return float(point[0]), float(point[1])
