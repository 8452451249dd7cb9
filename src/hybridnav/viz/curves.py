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
"""How much more room arcs are given than self-loops, so that one may pass the other."""
_PER_CELL = 4
"""Points per cell at which a straight arc is looked at."""
_NEAR_END = 2.0
"""Clearances from its ends within which a straight arc may come close to a wall."""
_SLIPPED = 2.0
"""Cells from its boundary beyond which a crossing is one of another boundary."""


@dataclass(frozen=True, eq=False)
class Arc:
    """An arc between two places, to be drawn inside their fields."""

    one: Field
    other: Field
    boundary: LongArray
    """int64 (n, 2, 2), pairs of cells in the grid, the first in the field of `one`."""

    @property
    def clearance(self) -> float:
        """How far a curve keeps from what lies in neither field where there is room, in cells."""
        return _WIDER * self.one.clearance

    @cached_property
    def corner(self) -> LongArray:
        """(row, col) of the first cell of the window round both fields."""
        return np.minimum(self.one.corner, self.other.corner)

    @cached_property
    def owner(self) -> LongArray:
        """Field of each cell in the window: 1, 2, or 0 for neither."""
        ends = [field.corner + field.mask.shape for field in (self.one, self.other)]
        owner = np.zeros(np.maximum(*ends) - self.corner, dtype=np.int64)
        for name, field in ((1, self.one), (2, self.other)):
            owner[tuple((field.cells + field.corner - self.corner).T)] = name
        return owner

    @cached_property
    def distance(self) -> FloatArray:
        """Distance of each cell to the nearest one in neither field."""
        return distance_to_rim(self.owner > 0)

    def curve(self) -> FloatArray:
        """A curve from one surviving cell to the other.

        Straight where both fields leave it room, else the shortest walk across the boundary made
        smooth, so that arcs on two sides of a thing run on two sides of it.

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
        """Whether a straight line keeps off everything else as far as a curve would."""
        along = np.hypot(*(line - line[0]).T)
        inner = np.minimum(along, along[-1] - along) > _NEAR_END * self.clearance
        room = self.distance[tuple(np.rint(line).astype(np.int64).T)]
        return bool((room > 0).all() and (room[inner] >= self.clearance).all())

    def _crosses(self, curve: FloatArray) -> bool:
        """Whether a curve crosses the boundary, and others there and back if at all."""
        cells = np.rint(curve).astype(np.int64)
        owner = self.owner[tuple(cells.T)]
        cells, owner = cells[owner > 0], owner[owner > 0]
        at = np.flatnonzero(np.diff(owner))
        middles = self.boundary.mean(axis=1) - self.corner
        off = (cells[at] + cells[at + 1])[:, None] / 2 - middles
        own = np.hypot(*np.moveaxis(off, -1, 0)).min(axis=1) <= _SLIPPED
        return bool(own.sum() % 2 == 1)

    def _walk(self) -> FloatArray:
        """Cells of the shortest walk across the boundary."""
        sides = []
        for field, cells in zip((self.one, self.other), self.boundary.swapaxes(0, 1), strict=True):
            sides.append(field.number[tuple((cells - field.corner).T)])
        lengths = self.one.walks.length[sides[0]] + self.other.walks.length[sides[1]]
        best = int(lengths.argmin())
        out = self.one.walks.to(int(sides[0][best])) + self.one.corner
        back = self.other.walks.to(int(sides[1][best])) + self.other.corner
        return np.concatenate([out, back[::-1]]) - self.corner
