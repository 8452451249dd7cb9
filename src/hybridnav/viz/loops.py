"""Self-loops as closed curves inside their place, round the holes that they enclose."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.path import Path
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order

from hybridnav.grid.runs import unique_rows
from hybridnav.viz.fields import smoothed

if TYPE_CHECKING:
    from hybridnav._typing import AnyArray, BoolArray, FloatArray, LongArray
    from hybridnav.viz.fields import Field

_MOST_LINES = 6
"""Most self-loops that are distinguished while one is drawn: the work doubles with each."""
_TINY = 0.25
"""Side of a hole for which a petal is enough, in clearances."""
_OUTSIDE = 1
_PETAL_POINTS = 33
_ALL_ROUND = np.ones((3, 3), dtype=np.bool_)


@dataclass(frozen=True, eq=False)
class Loops:
    """The self-loops of a place and the holes in its field.

    A hole is an 8-connected set of cells that are not in the field; 1 is the outside. Every
    self-loop joins two holes by the line of its dual edge, and together these make a tree.
    """

    field: Field

    @cached_property
    def hole_of(self) -> AnyArray:
        """Hole of each cell, from 1, 0 in the field; the outside is met first."""
        label, _ = ndimage.label(~self.field.mask, structure=_ALL_ROUND)
        return np.asarray(label)

    @cached_property
    def endpoints(self) -> dict[int, list[int]]:
        """The two holes that each self-loop of the place joins."""
        of_place = (self.field.level.arcs == self.field.vertex).all(axis=1)
        return {loop: self._endpoints_of(loop) for loop in np.flatnonzero(of_place).tolist()}

    def _endpoints_of(self, loop: int) -> list[int]:
        low, high = self._cells_beside(loop)
        # Ends of the sides between two cells, each named by the cell to its upper right.
        corners = np.concatenate([high, high + (high - low)[:, ::-1]])
        found = unique_rows(corners)
        rows, cols = found.rows[found.n_times == 1].T
        around = np.stack([self.hole_of[rows - i, cols - j] for i in (0, 1) for j in (0, 1)])
        return [int(hole) for hole in around.max(axis=0)]

    def _cells_beside(self, loop: int) -> tuple[LongArray, LongArray]:
        """Return the lower and the higher cell beside each side of a self-loop's line."""
        low, high = np.moveaxis(np.sort(self.field.level.boundary(loop), axis=1), 1, 0)
        return low - self.field.corner, high - self.field.corner

    @cached_property
    def enclosed(self) -> dict[int, BoolArray]:
        """For each self-loop the cells of the holes that it encloses."""
        joined = np.array(list(self.endpoints.values()))
        size = int(self.hole_of.max()) + 1
        tree = coo_array((np.ones(len(joined)), joined.T), shape=(size, size)).tocsr()
        order, above = breadth_first_order(tree, _OUTSIDE, directed=False)
        below = {int(hole): np.arange(size) == hole for hole in order}
        for hole in order[:0:-1]:  # leaves first
            below[int(above[hole])] |= below[int(hole)]
        inner = {loop: a if above[a] == b else b for loop, (a, b) in self.endpoints.items()}
        return {loop: below[hole][self.hole_of] for loop, hole in inner.items()}

    def curve(self, loop: int) -> FloatArray:
        """Return a closed curve from the surviving cell round the holes that a loop encloses.

        Parameters
        ----------
        loop
            A self-loop of the place.

        Returns
        -------
        FloatArray
            float64 (n, 2), (row, col) in grid units, where cell (0, 0) spans [0, 1] x [0, 1]. A
            petal that only points at the holes if they are too small or lie among too many others.
        """
        field = self.field
        if self.enclosed[loop].sum() < (_TINY * field.clearance) ** 2:
            return self._petal(loop)
        # Most curves are right if only the loop's own line counts; others need all nearby lines.
        for loops in ([loop], self._nearest(loop)):
            walk = self._walk(loops)
            curve = smoothed(walk, field.distance, field.clearance)
            if self.is_round(walk, loop) and self.is_round(curve, loop):
                return curve + field.corner + 0.5
        return self._petal(loop)

    def is_round(self, curve: FloatArray, loop: int) -> bool:
        """Return whether a closed curve surrounds exactly the holes that a self-loop encloses.

        The curve is in cells of the window; most of each hole counts.
        """
        cells = np.argwhere(self.hole_of > _OUTSIDE)
        hole = self.hole_of[tuple(cells.T)]
        size = int(self.hole_of.max()) + 1
        held = np.bincount(hole, Path(curve).contains_points(cells), minlength=size)
        meant = np.bincount(hole, self.enclosed[loop][tuple(cells.T)], minlength=size)
        return bool(((2 * held > np.bincount(hole, minlength=size)) == (meant > 0)).all())

    def _walk(self, loops: list[int]) -> FloatArray:
        """Return the cells of a shortest closed walk round the first of some loops.

        It crosses the line of the first loop an odd number of times and those of the others an even
        number of times.
        """
        field = self.field
        lines = np.zeros((2, *field.mask.shape), dtype=np.int64)
        for bit, loop in enumerate(loops):
            low, high = self._cells_beside(loop)
            lines[(high - low)[:, 1], low[:, 0], low[:, 1]] ^= 1 << bit
        return field.walks_from(field.start, lines).to(int(field.start[0]), copy=1)

    def _nearest(self, loop: int) -> list[int]:
        """Return a self-loop of the place and those that join the holes nearest to it in the
        tree."""
        reached, found = set(self.endpoints[loop]), [loop]
        others = set(self.endpoints) - {loop}
        while others and len(found) < _MOST_LINES:
            found.append(min(other for other in others if reached & set(self.endpoints[other])))
            reached |= set(self.endpoints[found[-1]])
            others.remove(found[-1])
        return found

    def _petal(self, loop: int) -> FloatArray:
        """Return a closed curve to just behind the middle of the holes that a loop encloses."""
        field, width = self.field, self.field.clearance
        at = field.level.cells[field.vertex] + 0.5
        to = np.argwhere(self.enclosed[loop]).mean(axis=0) + field.corner + 0.5 - at
        reach = max(float(np.hypot(*to)), 1e-9)
        tip = to * max(1 + width / reach, 3 * width / reach)
        across = np.array([-to[1], to[0]]) / reach * 2 * width
        t = np.linspace(0, 1, _PETAL_POINTS)[:, None]
        # Inner control points that lie 4/3 out make a cubic curve pass through the tip at 1/2.
        out, back = 4 * t * (1 - t) ** 2, 4 * t**2 * (1 - t)
        petal: FloatArray = at + out * (tip + across) + back * (tip - across)
        return petal
