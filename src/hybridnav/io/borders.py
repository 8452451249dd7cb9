"""Borders of regions on a grid, cut where three of them meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

if TYPE_CHECKING:
    from shapely import LineString
    from shapely.geometry.base import BaseGeometry

    from hybridnav._typing import FloatArray, IntArray, LongArray


@dataclass(frozen=True, eq=False)
class Borders:
    """The borders of rooms as chains of corners, each between two regions.

    x lies along columns and y along rows, one unit a cell.
    """

    lines: BaseGeometry
    """The chains, a MultiLineString."""
    chains_of: list[LongArray]
    """The chains round each room."""

    @classmethod
    def of(cls, region_of: IntArray, n_rooms: int) -> Borders:
        """Return the borders of the rooms on a grid.

        Parameters
        ----------
        region_of
            int32 (rows, cols), the room of each cell, -1 for none.
        n_rooms
            Number of rooms.
        """
        padded = np.pad(region_of, 1, constant_values=-1)
        sides = [_sides(padded), _sides(padded.T)[..., ::-1]]
        merged = shapely.line_merge(shapely.multilinestrings(np.concatenate(sides) - 1))
        chains = [_from_corner(chain) for chain in shapely.get_parts(merged)]
        beside = np.array([_beside(padded, chain) for chain in chains]).reshape(-1, 2)
        chains_of = [np.flatnonzero((beside == room).any(axis=1)) for room in range(n_rooms)]
        return cls(shapely.MultiLineString(chains), chains_of)

    def area(self, room: int, lines: BaseGeometry) -> BaseGeometry:
        """Return the area of a room, whose chains may have been simplified or moved.

        Parameters
        ----------
        room
            Its number.
        lines
            The chains in the same order.
        """
        chains = shapely.get_parts(lines)[self.chains_of[room]]
        return shapely.build_area(shapely.MultiLineString(list(chains)))


def _sides(label_of: IntArray) -> FloatArray:
    """Return the sides between rows of different labels, float64 (n, 2, 2), `(x, y)`.

    Sides on one line with the same labels beside them are one, but where another line may cross.
    """
    below, above = label_of[:-1], label_of[1:]
    differs = below != above
    # A side goes on where both labels do: no third line ends there.
    goes_on = differs[:, 1:] & differs[:, :-1]
    goes_on &= (below[:, 1:] == below[:, :-1]) & (above[:, 1:] == above[:, :-1])
    begins, ends = differs.copy(), differs.copy()
    begins[:, 1:] &= ~goes_on
    ends[:, :-1] &= ~goes_on
    row, first = np.nonzero(begins)
    _, last = np.nonzero(ends)
    y = row + 1.0
    return np.stack([np.stack([first, y], axis=1), np.stack([last + 1.0, y], axis=1)], axis=1)


def _from_corner(chain: LineString) -> LineString:
    """Return a chain that begins at a corner, if it is closed: its begin always stays."""
    points = shapely.get_coordinates(chain)
    if (points[0] != points[-1]).any():
        return chain
    ring = points[:-1]
    # The outermost corner in a direction that is no wall's.
    first = int(np.argmax(ring @ (1.0, 0.618)))
    return shapely.LineString(np.roll(ring, -first, axis=0)[[*range(len(ring)), 0]])


def _beside(padded: IntArray, chain: BaseGeometry) -> tuple[int, int]:
    """Return the labels on both sides of a chain."""
    (x, y), (to_x, to_y) = shapely.get_coordinates(chain)[:2]
    row, col = int(min(y, to_y)) + 1, int(min(x, to_x)) + 1
    if y == to_y:
        return int(padded[row - 1, col]), int(padded[row, col])
    return int(padded[row, col - 1]), int(padded[row, col])
