"""Borders of regions on a grid, cut where three of them meet."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely

from hybridnav.grid.runs import unique_rows

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
        return shapely.build_area(shapely.MultiLineString(list(chains[shapely.length(chains) > 0])))

    def without_short(self, at_most: float) -> Borders:
        """Return borders on which chains as short as a given length are points.

        All corners where chains meet that short chains join become one, in their middle. If borders
        would then cross, or a part of a room would go, the result is these borders.

        Parameters
        ----------
        at_most
            Length in cells.
        """
        chains = shapely.get_parts(self.lines)
        if not len(chains):
            return self
        points, chain = shapely.get_coordinates(chains, return_index=True)
        begins = np.searchsorted(chain, np.arange(len(chains)))
        ends = np.append(begins[1:], len(chain)) - 1
        corners, _, at, _ = unique_rows(points[[begins, ends]].reshape(-1, 2))
        begin, end = at.reshape(2, -1)
        short = (shapely.length(chains) <= at_most) & (begin != end)
        group = _joined(len(corners), begin[short], end[short])
        count = np.bincount(group)[:, None]
        middles = np.stack([np.bincount(group, xy) for xy in corners.T], axis=1) / count
        places = middles[group]
        points[begins], points[ends] = places[begin], places[end]
        inner = short[chain]
        inner[begins] = inner[ends] = False
        points[inner] = places[begin[chain[inner]]]
        moved_chains = list(shapely.get_parts(shapely.linestrings(points, indices=chain)))
        moved = Borders(shapely.MultiLineString(moved_chains), self.chains_of)
        long = [one for one, is_short in zip(moved_chains, short, strict=True) if not is_short]
        is_sound = shapely.is_simple(shapely.MultiLineString(long))
        return moved if is_sound and moved._n_parts() == self._n_parts() else self

    def _n_parts(self) -> list[int]:
        """Return the number of parts of each room."""
        areas = [self.area(room, self.lines) for room in range(len(self.chains_of))]
        return [int(shapely.get_num_geometries(area)) for area in areas]


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


def _joined(count: int, begin: LongArray, end: LongArray) -> LongArray:
    """Return the number of the connected set of each of some nodes, joined by edges."""
    from scipy.sparse import coo_array  # noqa: PLC0415 - on demand
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    edges = coo_array((np.ones(len(begin), dtype=np.int8), (begin, end)), (count, count))
    group: LongArray = connected_components(edges, directed=False)[1].astype(np.int64)
    return group


def _from_corner(chain: LineString) -> LineString:
    """Return a chain that begins at a corner, if it is closed: its begin always stays."""
    points = shapely.get_coordinates(chain)
    if (points[0] != points[-1]).any():
        return chain
    ring = points[:-1]
    # The outermost corner in a direction that is no wall's.
    first = int(np.argmax(ring[:, 0] + 0.618 * ring[:, 1]))
    return shapely.LineString(np.roll(ring, -first, axis=0)[[*range(len(ring)), 0]])


def _beside(padded: IntArray, chain: BaseGeometry) -> tuple[int, int]:
    """Return the labels on both sides of a chain."""
    (x, y), (to_x, to_y) = shapely.get_coordinates(chain)[:2]
    row, col = int(min(y, to_y)) + 1, int(min(x, to_x)) + 1
    if y == to_y:
        return int(padded[row - 1, col]), int(padded[row, col])
    return int(padded[row, col - 1]), int(padded[row, col])
