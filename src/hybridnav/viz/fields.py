"""Walks inside the field of a place, and their smoothing to curves."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from matplotlib.path import Path
from scipy import ndimage
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, dijkstra

from hybridnav._base.rows import unique_rows
from hybridnav._base.trig import hypots, lengths_along
from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, LongArray
from hybridnav.pyramid import Level

_NEAR_RIM = 4.0
"""Extra cost of a step at the rim of a field, in steps."""
_STEPS, _LAST_STEPS = 100, 8
"""Steps of smoothing a curve, and the last of them, which no longer push."""
_PUSH = 0.3
"""Share of the missing clearance by which one step moves a curve."""
_SPACING, _LEAST_SPACING = 0.3, 0.5
"""Spacing of a curve's points while it is smoothed, in clearances, and its least in cells."""


@dataclass(frozen=True, eq=False)
class Field:
    """The field of one place in a window of the grid, with a margin of one cell.

    Cells are (row, col) in the window; as real numbers, centres of cells are integers.
    """

    level: Level
    vertex: int
    clearance: float
    """Distance that curves keep from the rim of the field where there is room, in cells."""

    @cached_property
    def corner(self) -> LongArray:
        """(row, col) of the window's first cell in the grid."""
        return self.level.receptive_field(self.vertex).min(axis=0) - 1

    @cached_property
    def cells(self) -> LongArray:
        """int64 (n, 2), cells of the field."""
        return self.level.receptive_field(self.vertex) - self.corner

    @cached_property
    def mask(self) -> BoolArray:
        """Cells of the field."""
        mask = np.zeros(self.cells.max(axis=0) + 2, dtype=np.bool_)
        mask[tuple(self.cells.T)] = True
        return mask

    @cached_property
    def distance(self) -> FloatArray:
        """Distance of each cell to the nearest cell that is not in the field."""
        return distance_to_rim(self.mask)

    @cached_property
    def number(self) -> LongArray:
        """Index of each cell in `cells`, -1 for those of other fields."""
        number = np.full(self.mask.shape, -1, dtype=np.int64)
        number[tuple(self.cells.T)] = np.arange(len(self.cells))
        return number

    def graph(self, lines: LongArray | None = None) -> Any:
        """Return the moves between the cells of copies of the field, dearer at the rim.

        `lines`: int64 (2, rows, cols), a set of bits for the side between each cell and its
        neighbour north, and that between it and its neighbour east. Walks are distinguished by the
        set of sides that they cross an odd number of times: each set has a copy of the field, and a
        walk across a side continues in another copy. By default there is one copy.
        """
        if lines is None:
            lines = np.zeros((2, *self.mask.shape), dtype=np.int64)
        n, copies = len(self.cells), 1 << int(lines.max()).bit_length()
        tail, head, flip = _moves(self.number, lines)
        near = 1 + _NEAR_RIM * np.clip(1 - self.distance[self.mask] / self.clearance, 0, 1)
        cost = hypots(*(self.cells[tail] - self.cells[head]).T) * (near[tail] + near[head])
        copy = np.arange(copies)[:, None]
        endpoints = (tail + n * copy).ravel(), (head + n * (copy ^ flip)).ravel()
        size = n * copies
        return coo_array((np.tile(cost, copies), endpoints), shape=(size, size)).tocsr()

    def walks_from(self, cells: LongArray, lines: LongArray | None = None) -> WalkTree:
        """Return the shortest walks from the nearest of some cells, given by number, to all
        cells."""
        length, before, _ = dijkstra(
            self.graph(lines),
            directed=False,
            indices=cells,
            return_predecessors=True,
            min_only=True,
        )
        return WalkTree(self.cells, length, before)

    @property
    def start(self) -> LongArray:
        """The number of the surviving cell, as an array of one."""
        return self.number[tuple((self.level.cells[[self.vertex]] - self.corner).T)]

    @cached_property
    def walks(self) -> WalkTree:
        """Shortest walks from the surviving cell to all cells."""
        return self.walks_from(self.start)


@dataclass(frozen=True, eq=False)
class WalkTree:
    """Shortest walks from one cell."""

    cells: LongArray
    length: AnyArray
    before: AnyArray

    def to(self, cell: int, copy: int = 0) -> FloatArray:
        """Return the walk to a cell of a copy of the field, as float64 (n, 2)."""
        at = cell + copy * len(self.cells)
        walk = [at]
        while (at := int(self.before[at])) >= 0:
            walk.append(at)
        return self.cells[np.array(walk[::-1]) % len(self.cells)].astype(np.float64)


def distance_to_rim(mask: BoolArray) -> FloatArray:
    """Return the distance of each cell of a mask to the nearest cell outside it, in cells."""
    return np.asarray(ndimage.distance_transform_edt(mask), dtype=np.float64)


def smoothed(walk: FloatArray, distance: FloatArray, clearance: float) -> FloatArray:
    """Return a walk smoothed like a rubber band that is fixed at its endpoints and pushed off the
    rim.

    `walk`: float64 (n, 2), cells; `distance`: distance of each cell to the cells that the band
    avoids; `clearance`: distance that the band keeps where there is room. Returns float64 (n, 2), a
    smooth curve; it may slip over obstacles of a cell or two.
    """
    slope = [np.gradient(distance, axis=axis) for axis in (0, 1)]
    potential = np.stack([distance, *slope], axis=-1)
    band = walk
    for step in range(_STEPS):
        if step % 25 == 0:
            band = _evenly(band, max(_SPACING * clearance, _LEAST_SPACING))
        inner = band[1:-1]
        pull = (band[:-2] + band[2:]) / 2 - inner
        push = np.zeros_like(inner)
        if step < _STEPS - _LAST_STEPS:  # the last steps smooth the staircase of cells
            at = _between(potential, inner)
            push = _PUSH * at[:, 1:] * np.maximum(clearance - at[:, :1], 0)
        # Where no cell is as clear as that, the push would drive the band out of the window.
        moved = np.clip(inner + 0.5 * pull + push, -0.5, np.array(distance.shape) - 0.5)
        band = np.concatenate([band[:1], moved, band[-1:]])
    return rounded(band)


def _between(values: FloatArray, points: FloatArray) -> FloatArray:
    """Return bilinear values between cells, in a third of the time of `ndimage.map_coordinates`."""
    low = np.minimum(points.astype(np.int64), np.array(values.shape[:2]) - 2)
    row, col = low.T
    up, right = (points - low).T[..., None]
    lower = values[row, col] * (1 - right) + values[row, col + 1] * right
    upper = values[row + 1, col] * (1 - right) + values[row + 1, col + 1] * right
    return lower * (1 - up) + upper * up


def _evenly(line: FloatArray, spacing: float) -> FloatArray:
    length = lengths_along(line)
    at = np.linspace(0, length[-1], max(round(length[-1] / spacing), 12) + 1)
    return np.stack([np.interp(at, length, part) for part in line.T], axis=1)


def rounded(line: FloatArray) -> FloatArray:
    """Return a line after Chaikin's corner cutting, with the same endpoints."""
    for _ in range(2):
        early, late = line[:-1] * 0.75 + line[1:] * 0.25, line[:-1] * 0.25 + line[1:] * 0.75
        cut = np.stack([early, late], axis=1).reshape(-1, 2)
        line = np.concatenate([line[:1], cut, line[-1:]])
    return line


def _moves(number: LongArray, crossed: LongArray) -> tuple[LongArray, LongArray, LongArray]:
    """Return the moves between 8-neighbours, and the sides that each crosses.

    Both cells beside a diagonal are in the field.
    """
    north, east = crossed
    # The window has a margin: rolled arrays wrap round outside the field.
    north_east = north ^ np.roll(east, -1, axis=0)
    north_west = north ^ np.roll(east, (-1, 1), axis=(0, 1))
    steps = (((1, 0), north), ((0, 1), east), ((1, 1), north_east), ((1, -1), north_west))
    moves = []
    for (up, right), across in steps:
        beyond = np.roll(number, (-up, -right), axis=(0, 1))
        beside = (np.roll(number, -up, axis=0), np.roll(number, -right, axis=1))
        legal = np.minimum.reduce([number, beyond, *beside]) >= 0
        moves.append((number[legal], beyond[legal], across[legal]))
    tail, head, crossing = (np.concatenate(part) for part in zip(*moves, strict=True))
    return tail, head, crossing


# Self-loops as closed curves inside their place, round the holes that they enclose.

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
        points = unique_rows(corners)
        rows, cols = points.rows[points.n_times == 1].T
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

        `loop`: a self-loop of the place. Returns float64 (n, 2), (row, col) in grid units, where
        cell (0, 0) spans [0, 1] x [0, 1]. A petal that only points at the holes if they are too
        small or lie among too many others.
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
        reached, chain = set(self.endpoints[loop]), [loop]
        others = set(self.endpoints) - {loop}
        while others and len(chain) < _MOST_LINES:
            chain.append(min(other for other in others if reached & set(self.endpoints[other])))
            reached |= set(self.endpoints[chain[-1]])
            others.remove(chain[-1])
        return chain

    def _petal(self, loop: int) -> FloatArray:
        """Return a closed curve to just behind the middle of the holes that a loop encloses."""
        field, width = self.field, self.field.clearance
        at = field.level.cells[field.vertex] + 0.5
        to = np.argwhere(self.enclosed[loop]).mean(axis=0) + field.corner + 0.5 - at
        reach = max(float(hypots(*to)), 1e-9)
        tip = to * max(1 + width / reach, 3 * width / reach)
        across = np.array([-to[1], to[0]]) / reach * 2 * width
        t = np.linspace(0, 1, _PETAL_POINTS)[:, None]
        # Inner control points that lie 4/3 out make a cubic curve pass through the tip at 1/2.
        out, back = 4 * t * (1 - t) ** 2, 4 * t**2 * (1 - t)
        return at + out * (tip + across) + back * (tip - across)
