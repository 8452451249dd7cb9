"""Arcs as curves: inside their two places, across their own boundary."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.viz.fields import distance_to_rim, smoothed

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, LongArray
    from hybridnav.viz.fields import Field

_WIDER = 1.5
"""Factor on the clearance of arcs over that of self-loops, so that one may pass the other."""
_PER_CELL = 4
"""Points per cell at which a straight arc is tested."""
_NEAR_END = 2.0
"""Clearances from its ends within which a straight arc may come close to a wall."""
_SLIPPED = 2.0
"""Cells from its boundary beyond which a crossing belongs to another boundary."""


@dataclass(frozen=True, eq=False)
class Arc:
    """An arc between two places, drawn inside their fields."""

    one: Field
    other: Field
    boundary: LongArray
    """int64 (n, 2, 2), pairs of cells in the grid, the first in the field of `one`."""

    @property
    def clearance(self) -> float:
        """Distance that a curve keeps from cells in neither field where there is room, in cells."""
        return _WIDER * self.one.clearance

    @cached_property
    def corner(self) -> LongArray:
        """(row, col) of the first cell of the window round both fields."""
        return np.minimum(self.one.corner, self.other.corner)

    @cached_property
    def owner(self) -> LongArray:
        """Field of each cell in the window: 1, 2, or 0 for neither."""
        endpoints = [field.corner + field.mask.shape for field in (self.one, self.other)]
        owner = np.zeros(np.maximum(*endpoints) - self.corner, dtype=np.int64)
        for name, field in ((1, self.one), (2, self.other)):
            owner[tuple((field.cells + field.corner - self.corner).T)] = name
        return owner

    @cached_property
    def distance(self) -> FloatArray:
        """Distance of each cell to the nearest one in neither field."""
        return distance_to_rim(self.owner > 0)

    def curve(self) -> FloatArray:
        """Return a curve from one surviving cell to the other.

        The curve is straight if both fields have room for it, else it is the smoothed shortest walk
        across the boundary, so that arcs on two sides of an obstacle run on two sides of it.

        Returns
        -------
        FloatArray
            float64 (n, 2), (row, col) in grid units, where cell (0, 0) spans [0, 1] x [0, 1].
        """
        line = self._straight()
        if self._has_room(line) and self._crosses(line):
            return line[[0, -1]] + self.corner + 0.5
        walk = self._walk()
        curve = smoothed(walk, self.distance, self.clearance)
        return (curve if self._crosses(curve) else walk) + self.corner + 0.5

    def _straight(self) -> FloatArray:
        fields = (self.one, self.other)
        start, end = (field.level.cells[field.vertex] - self.corner for field in fields)
        count = int(_PER_CELL * np.hypot(*(end - start))) + 2
        return np.linspace(start, end, count)

    def _has_room(self, line: FloatArray) -> bool:
        """Return whether a straight line keeps the clearance of a curve."""
        along = np.hypot(*(line - line[0]).T)
        inner = np.minimum(along, along[-1] - along) > _NEAR_END * self.clearance
        room = self.distance[tuple(np.rint(line).astype(np.int64).T)]
        return bool((room > 0).all() and (room[inner] >= self.clearance).all())

    def _crosses(self, curve: FloatArray) -> bool:
        """Return whether a curve crosses the boundary, and any other boundary there and back."""
        cells = np.rint(curve).astype(np.int64)
        owner = self.owner[tuple(cells.T)]
        cells, owner = cells[owner > 0], owner[owner > 0]
        at = np.flatnonzero(np.diff(owner))
        middles = self.boundary.mean(axis=1) - self.corner
        off = (cells[at] + cells[at + 1])[:, None] / 2 - middles
        own = np.hypot(*np.moveaxis(off, -1, 0)).min(axis=1) <= _SLIPPED
        return bool(own.sum() % 2 == 1)

    def _walk(self) -> FloatArray:
        """Return the cells of the shortest walk across the boundary."""
        halves = []
        for field, cells in zip((self.one, self.other), self.boundary.swapaxes(0, 1), strict=True):
            halves.append(field.number[tuple((cells - field.corner).T)])
        lengths = self.one.walks.length[halves[0]] + self.other.walks.length[halves[1]]
        best = int(lengths.argmin())
        out = self.one.walks.to(int(halves[0][best])) + self.one.corner
        back = self.other.walks.to(int(halves[1][best])) + self.other.corner
        return np.concatenate([out, back[::-1]]) - self.corner
