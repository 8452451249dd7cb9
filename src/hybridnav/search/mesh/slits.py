"""A convex mesh whose polygons have directed sides. Public: `cells_across`.

Each straight line of such sides is a side of polygons on both hands, of which one leads nowhere. A
corner at which lines end occurs once for each part of its surroundings between which there is no
way back; paths may bend there where three cells in turn may be passed round it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.moves import STEPS
from hybridnav.search.mesh.cut import Seams
from hybridnav.search.mesh.kernels.corners import MANY
from hybridnav.search.mesh.kernels.intervals import DIRECTED, LEFTWARD, RIGHTWARD
from hybridnav.search.mesh.kernels.slits import DOWN, UP
from hybridnav.search.mesh.kernels.state import Slits
from hybridnav.search.mesh.search import MeshPath, MeshSearch

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, ByteArray, FloatArray, IntArray, LongArray
    from hybridnav.search.directed import DirectedSides
    from hybridnav.search.mesh.build import ConvexMesh

    Cell = tuple[int, int]

_ROUND = np.array([(0, 0), (0, -1), (-1, -1), (-1, 0)])
"""Cells round a lattice point, less that point, counter-clockwise with columns to the right."""
_PAIR = 2
"""Sides at a point through which a line may go on."""
_SLIVER_CELLS = 1e-9
"""Shorter segments of a line are rounding: the line passes the corner of a cell."""


@dataclass(frozen=True, eq=False)
class Reach:
    """Which polygons of a mesh with directed sides lead to which."""

    part: IntArray
    """int32 (p,), the set of polygons that lead to each other to which each belongs."""
    ahead: dict[int, set[int]]
    """The sets that each leads to; of those that lead to others alone."""

    @classmethod
    def of(cls, twins: IntArray, polygon_of: IntArray, n_polygons: int) -> Reach:
        """Find the sets from the sides that may be crossed; `twins`: -1 for those that may not."""
        from scipy import sparse  # noqa: PLC0415 - a quarter of a second that others do not need
        from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

        slots = np.flatnonzero(twins >= 0)
        ends = polygon_of[slots], polygon_of[twins[slots]]
        graph = sparse.csr_array((np.ones(len(slots), np.int8), ends), (n_polygons, n_polygons))
        _, part = connected_components(graph, directed=True, connection="strong")
        ahead: dict[int, set[int]] = {}
        for one, two in set(zip(*(part[of].tolist() for of in ends), strict=True)):
            if one != two:
                ahead.setdefault(one, set()).add(two)
        for first, found in ahead.items():
            waiting = list(found)
            while waiting:
                further = ahead.get(waiting.pop(), set()) - found - {first}
                found.update(further)
                waiting += further
        return cls(part.astype(np.int32), ahead)

    def leads(self, one: int, two: int) -> bool:
        """Return whether a polygon leads to another."""
        first, last = int(self.part[one]), int(self.part[two])
        return first == last or last in self.ahead.get(first, ())


class DirectedSearch(MeshSearch):
    """The search of a mesh with directed sides: where there is no way, nothing is searched."""

    reach: Reach

    def path(self, cells: tuple[Cell, Cell], positions: Any, **how: Any) -> MeshPath:
        """Find a shortest path between two positions; see `MeshSearch`."""
        from hybridnav.search.mesh.kernels.ends import polygons_of_points  # noqa: PLC0415 - rare

        at = np.array(cells)
        offset, found = polygons_of_points(self.arrays, self.mesh.polygon_at, (at, at + 0.5))
        if not self.reach.leads(found[0], found[offset[1]]):
            return MeshPath(None, math.inf, math.inf, 0)
        return super().path(cells, positions, **how)


def slits_of(free: BoolArray, sides: IntArray) -> tuple[Slits, Seams]:
    """Return directed sides as straight lines, without those that do not lie between two free
    cells; and the lines that a mesh needs for them.

    `free`: bool (rows, cols); `sides`: int (n, 4), cells (row, col) from which, and to which, each
    may be crossed.
    """
    cols = free.shape[1]
    one, two = sides[:, :2].astype(np.int64), sides[:, 2:].astype(np.int64)
    is_open = free[tuple(one.T)] & free[tuple(two.T)]
    one, two = one[is_open], two[is_open]
    # A side lies on a line of the lattice, along rows (0) or columns, at a place.
    axis = (one[:, 0] == two[:, 0]).astype(np.int64)
    upper = np.maximum(one, two)
    line, place = np.where(axis, upper[:, ::-1].T, upper.T)
    size = np.int64(max(free.shape) + 1)
    key, at = np.unique((axis * size + line) * size + place, return_inverse=True)
    ways = np.full(len(key), UP | DOWN, np.uint8)
    is_up = (two > one).any(axis=1)
    np.bitwise_and.at(ways, at, np.where(is_up, UP, DOWN).astype(np.uint8))
    axis, line, place = key // size // size, key // size % size, key % size
    step = np.where(axis, cols + 1, 1)
    first = np.where(axis, place, line) * (cols + 1) + np.where(axis, line, place)
    touched, count = np.unique(np.concatenate([first, first + step]), return_counts=True)
    # A line goes on where no other ends, in one direction.
    goes_on = (key[1:] == key[:-1] + 1) & (ways[1:] == ways[:-1])
    goes_on &= count[np.searchsorted(touched, first[1:])] <= _PAIR
    begins = np.flatnonzero(np.append([True], ~goes_on))[: len(key)]
    lasts = np.append(begins[1:], len(key))[: len(begins)] - 1
    ends = np.stack([first[begins], (first + step)[lasts]], axis=1)
    points = np.unique(ends)
    flat = np.array([cols, 1])
    one, two = one @ flat, two @ flat
    round_points = _surroundings(free, points, two * free.size + one)
    lines = np.stack(np.divmod(ends, cols + 1)[::-1], axis=2).reshape(-1, 4).astype(np.float64)
    slits = Slits(lines, ways[begins], points, *round_points, cols + 1)
    return slits, Seams(ends, np.unique([one, two]))


def lines_of(free: BoolArray, sides: IntArray) -> list[Any]:
    """Return directed sides as straight lines, which are crossed from their left to their right:
    rows of two corners of cells (row, col)."""
    slits, _ = slits_of(free, sides)
    ends = slits.lines.astype(np.int64).reshape(-1, 2, 2)[:, :, ::-1]
    # The left of a line along a row is the upper side, of one along a column the lower one.
    is_row = ends[:, 0, 0] == ends[:, 1, 0]
    ahead, back = (slits.ways & np.where(is_row, *way) == 0 for way in ((UP, DOWN), (DOWN, UP)))
    found: list[Any] = np.concatenate([ends[ahead], ends[back, ::-1]]).tolist()
    return found


def _surroundings(
    free: BoolArray, points: LongArray, barred: LongArray
) -> tuple[BoolArray, ByteArray]:
    """Return `reach` and `kinds` of `Slits`; `barred`: moves that are not, as flat cells."""
    rows, cols = free.shape
    at = np.stack(np.divmod(points, cols + 1), axis=1)[:, None] + _ROUND
    inside = ((at >= 0) & (at < free.shape)).all(axis=2)
    cells = np.where(inside, at @ np.array([cols, 1]), 0)
    is_free = inside & free.ravel()[cells]
    after = np.roll(cells, -1, axis=1)
    both = is_free & np.roll(is_free, -1, axis=1)
    left = both & ~np.isin(cells * rows * cols + after, barred)
    right = both & ~np.isin(after * rows * cols + cells, barred)
    reach: BoolArray = np.zeros((len(points), 4, 4), np.bool_)
    number = np.arange(4)
    following = (number + 1) % 4
    reach[:, number, number] = is_free
    reach[:, number, following] = left
    reach[:, following, number] = right
    for _ in range(2):
        reach = np.any(reach[:, :, :, None] & reach[:, None], axis=2)
    kinds = np.zeros((len(points), 4), np.uint8)
    for k in range(3):
        for bit, way in ((LEFTWARD, left), (RIGHTWARD, right)):
            passes = way & np.roll(way, -1, axis=1)
            kinds |= np.roll(passes, k, axis=1) * np.uint8(bit)
    # Cells between which one may go to and fro are one part.
    mutual = reach & reach.transpose(0, 2, 1)
    kinds = np.bitwise_or.reduce(np.where(mutual, kinds[:, None], 0), axis=2).astype(np.uint8)
    return reach, np.where(kinds > 0, kinds | DIRECTED, MANY).astype(np.uint8)


def directed_search(made: ConvexMesh, slits: Slits, ends: LongArray) -> MeshSearch:
    """Return the search of a mesh that has slits as sides; `ends`: those of `Seams`.

    It has corners of slits once for each part of their surroundings. Its blocks are those of a mesh
    that is passed in both directions.
    """
    wide = slits.wide
    flat = made.corners @ np.array([wide, 1], dtype=np.int64)
    begins, finishes = flat[made.begins], flat[made.finishes]

    # Slots along slits: the polygon of one that leads up a column, or down a row, is on the lower
    # hand.
    is_shut = made.twins < 0
    is_row = slits.lines[:, 1] == slits.lines[:, 3]
    many = np.int64(flat.max(initial=0) + 1)
    for way, leaves in ((ends, (DOWN, UP)), (ends[:, ::-1], (UP, DOWN))):
        shut = way[slits.ways & np.where(is_row, *leaves) == 0]
        is_shut |= np.isin(begins * many + finishes, shut @ np.array([many, 1]))

    # Each slot begins at the part of its corner that lies counter-clockwise of it.
    slots = np.flatnonzero(np.isin(begins, slits.points))
    at = np.searchsorted(slits.points, begins[slots])
    down, across = (made.corners[made.finishes[slots]] - made.corners[made.begins[slots]]).T
    cell = np.select(
        [(across > 0) & (down >= 0), (down > 0) & (across <= 0), (across < 0) & (down <= 0)],
        [0, 1, 2],
        3,
    )
    mutual = slits.reach & slits.reach.transpose(0, 2, 1)
    part = 4 * at + mutual.argmax(axis=2)[at, cell]
    parts, where, of = np.unique(part, return_index=True, return_inverse=True)
    old = made.begins[slots[where]]
    is_first = np.append([True], parts[1:] // 4 != parts[:-1] // 4)[: len(parts)]
    number = np.where(is_first, old, len(flat) - 1 + np.cumsum(~is_first)).astype(np.int32)
    corners = np.concatenate([made.corners, made.corners[old[~is_first]]])
    kinds = np.concatenate([made.kinds, np.zeros(np.count_nonzero(~is_first), np.uint8)])
    kinds[number] = slits.kinds[parts // 4, parts % 4]
    new_begins = made.begins.copy()
    new_begins[slots] = number[of]
    for array in (corners, kinds, new_begins):
        array.flags.writeable = False
    mesh = replace(made, corners=corners, kinds=kinds, begins=new_begins)
    search = DirectedSearch(mesh)
    backs, twins = mesh.twins.copy(), np.where(is_shut, np.int32(-1), mesh.twins)
    backs[mesh.twins[is_shut & (mesh.twins >= 0)]] = -1
    backs.flags.writeable = twins.flags.writeable = False
    search.reach = Reach.of(twins, mesh.polygon_of, mesh.n_polygons)
    search.arrays = mesh.arrays._replace(twins=twins, backs=backs)
    search.is_prepared = True  # edges between corners lead both ways
    return search


def cells_across(
    free: BoolArray, sides: DirectedSides, positions: FloatArray, ends: tuple[Cell, Cell]
) -> LongArray:
    """Return the cells that a legal path passes, int64 (n, 2), each side crossed in its direction.

    `free`: bool (rows, cols); `positions`: float64 (n, 2), (row, col) in grid units; `ends`: the
    cells of its ends. Along a side it passes the cell on one hand; at a corner of cells it goes
    round it.
    """
    steps: list[list[tuple[Cell, int]]] = [[(ends[0], 0)]]
    for first, last in pairwise(positions):
        shares = _cuts(first, last)
        for a, b in pairwise(shares):
            at, middle = (first + share * (last - first) for share in (a, (a + b) / 2))
            _go_round(sides, steps, (_cells_at(free, at), _cells_at(free, middle)))
    _go_round(sides, steps, (_cells_at(free, positions[-1]), [ends[1]]))
    cells: list[Cell] = []
    place = 0
    for step in steps[::-1]:
        cell, place = step[place]
        if not cells or cells[-1] != cell:
            cells.append(cell)
    return np.array(cells[::-1])


def _cuts(first: FloatArray, last: FloatArray) -> FloatArray:
    """Return the shares of a segment at which it meets lines between cells, and 0 and 1."""
    shares = [np.array([0.0, 1.0])]
    for a, b in zip(first, last, strict=True):
        if a != b:
            shares.append((np.arange(math.ceil(min(a, b)), max(a, b)) - a) / (b - a))
    found = np.sort(np.concatenate(shares))
    length = np.abs(last - first).max()
    return (
        found[np.append([True], np.diff(found) * length > _SLIVER_CELLS)] if length else found[:0]
    )


def _cells_at(free: BoolArray, point: FloatArray) -> list[Cell]:
    """Return the free cells whose closed square has a point."""
    around = np.floor(np.add.outer(point, (-_SLIVER_CELLS, _SLIVER_CELLS))).astype(np.int64)
    rows, cols = (
        np.unique(at[(at >= 0) & (at < n)]).tolist()
        for at, n in zip(around, free.shape, strict=True)
    )
    return [cell for cell in product(rows, cols) if free[cell]]


def _go_round(sides: DirectedSides, steps: list[list[tuple[Cell, int]]], cells: Any) -> None:
    """Append the cells that are reached round a point: one list a move, with places in the list
    before. `cells`: those at the point, and those that are wanted."""
    around, wanted = cells
    for _ in range(3):
        now = {cell: place for place, (cell, _) in reversed(list(enumerate(steps[-1])))}
        for (row, col), place in list(now.items()):
            for k in range(0, 8, 2):
                other = row + int(STEPS[k, 0]), col + int(STEPS[k, 1])
                is_there = other in around and other not in now
                if is_there and not sides.moves[row, col] >> k & 1:
                    now[other] = place
        steps.append(list(now.items()))
    steps.append([(c, place) for place, (c, _) in enumerate(steps[-1]) if c in wanted])
