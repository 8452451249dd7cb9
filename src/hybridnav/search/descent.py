"""A descent through the levels of a pyramid: routes of ever smaller fields, and a path of cells.

A route of places is found first. Its fields and those beside them are kept, and the next route is
found among their sons, some levels down; so on to fields of some hundred cells, along which A*
finds the path, window by window. N. Sturtevant and M. Buro (Partial pathfinding using map
abstraction and refinement, 2005) plan so on abstractions of a grid, and refine a part of the path
at a time.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from copy import copy
from functools import partial
from typing import Any, NamedTuple, TypeVar

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.kernels.moves import STRAIGHT, legal_moves
from hybridnav._base.moves import STEPS
from hybridnav._base.rows import unique_rows
from hybridnav._base.threads import Pool, keep_last
from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray
from hybridnav.maps.costs.factors import UNIT_BITS
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.record import Patch
from hybridnav.route.route import Corridor
from hybridnav.search.directed import DirectedSides
from hybridnav.search.grid_search import (
    ALL_BUT_BACK,
    UNLIMITED,
    limited,
    move_tables,
    moves_by_turn,
)
from hybridnav.search.kernels import descent as _kernels
from hybridnav.search.kernels import fields as _field_kernels
from hybridnav.search.kernels.descent import LevelFields, MapCells, Marks
from hybridnav.search.kernels.grid_search import BUCKETS, LONG_GENERATIONS
from hybridnav.search.lowest import Layer, Lowest, lowest_of, patched, patched_ends

T = TypeVar("T")
Cell = tuple[int, int]
_ROOM = 1024
_ROOT_2 = math.sqrt(2)
_WINDOWS = 1 << 20
"""More windows than a descent has."""
_MOST_WINDOWS = LONG_GENERATIONS >> 2
"""Windows after which new arrays are taken, long before their numbers are too large."""
_KEPT = 4
"""Number of maps with directions that are kept for queries with the same ones."""
NEARLY = 0.85
"""Part of `step` that is enough: no level has exactly so many fields."""
MANY_PLACES = 1000
"""Places above which small ones are joined in blocks."""
MOST_BLOCKS, MOST_AT_TOP = 300, 4000
"""Most fields of the first level, if they are blocks, and if they are places."""
WAY_ROUND = 2.0
"""Horizons within which a window goes round closed cells."""
BLOCK_SIDE = 6
"""Side of the blocks of a level, in sides of those of the next one."""


class DescentSettings(NamedTuple):
    """How a descent goes down."""

    field_cells: int = 128
    """Mean size of the fields at which it ends, in cells: the level that comes nearest."""
    step: float = 8.0
    """How many times smaller the fields of each level are than those of the one before."""
    ring: int = 1
    """Rings of fields kept beside the route at each level; places keep two more."""
    horizon_cells: int = 128
    """Cells that a window of A* looks ahead along the last fields."""


class Descended(NamedTuple):
    """The outcome of a descent."""

    places: IntArray
    """int32 (n,), the places of the route at the top, in their order; none without a route."""
    cells: LongArray | None
    """int64 (k, 2), the path of cells, None if none was asked for or found."""
    expanded: int
    """Cells expanded."""
    expanded_fields: int
    """Fields expanded, at all levels."""
    corridor_cells: int
    """Cells of the last fields: those of the corridor, or of the route alone."""
    length: float
    """Length of the path, cells; without one 0, infinite where it is proved that there is none."""


def sizes_of(pyramid: DualGraphPyramid) -> list[int]:
    """Return how many vertices the levels have that a descent may visit, the base first.

    The top is that of the places, or that of the regions, if the pyramid has any.
    """
    top = pyramid.place_level if pyramid.region_cells is None else pyramid.region_level
    return [size.vertices for size in pyramid.stats.sizes[: top + 1]]


def levels_by(sizes: list[int], settings: DescentSettings) -> list[int]:
    """Return the levels that a descent visits, from the top down; `sizes`: see `sizes_of`."""
    top, counts = len(sizes) - 1, np.array(sizes)
    means = counts[0] / np.maximum(counts, 1)
    off = np.maximum(means / settings.field_cells, settings.field_cells / np.maximum(means, 1))
    levels = [int(np.argmin(off))]
    for level in range(levels[0] + 1, top):
        if means[level] >= settings.step * means[levels[-1]] * NEARLY:
            levels.append(level)
    if len(levels) > 1 and means[top] < settings.step * means[levels[-1]] * NEARLY:
        levels.pop()
    return [*([top] if top != levels[-1] else []), *reversed(levels)]


def has_small_places(sizes: list[int], settings: DescentSettings) -> bool:
    """Return whether places, the last of some levels, are many and smaller than the last fields."""
    n_cells, n_places = sizes[0], sizes[-1]
    return n_places > MANY_PLACES and n_cells < settings.field_cells * n_places


class KeptFields(NamedTuple):
    """What a descent kept of the fields of one level."""

    field_of: IntArray
    """int32 (rows, cols), the field of each cell, -1 for none."""
    arcs: IntArray
    """int32 (m, 2), fields between which a route may lead, each pair twice."""
    kept: BoolArray
    """bool (n,), the fields that were kept: those of the route and, except at the last level, the
    rings round them. The route of the next level leads through their sons."""
    route: IntArray
    """int32 (k,), the fields of the route, from start to goal."""


class WatchedDescent(NamedTuple):
    """A descent, level by level, for pictures."""

    levels: list[KeptFields]
    """What it kept, from the top down."""
    cells: LongArray
    """int64 (k, 2), the cells of the path, (row, col)."""


def joined(lowest: Lowest, below: Layer, enterable: BoolArray, side: int) -> Layer:
    """Return the fields of a level above: those that arcs connect inside a square block of cells.

    `lowest`: the vertices of which fields are made; `below`: the fields that are joined;
    `enterable`: bool (rows, cols), the cells that paths may pass; `side`: of a block, in cells.
    """
    flat, arcs = lowest.cells[below.vertex], below.of[lowest.arcs]
    may_pass = enterable.ravel()[flat]
    is_open = (arcs >= 0) & may_pass[arcs]
    arcs = arcs[is_open[:, 0] & is_open[:, 1]]
    cells = np.stack(np.divmod(flat, enterable.shape[1]), axis=1)
    of, nearest = _field_kernels.join_in_blocks(cells, may_pass, arcs, side)
    return Layer(np.append(of, -1)[below.of], below.vertex[nearest])


def _by_fields_above(layer: Layer, above: Layer) -> Layer:
    """Return a layer with its fields in the order of those above: neighbours lie close in memory,
    which saves a descent a fourth of its time at the levels of large maps."""
    order = np.argsort(above.of[layer.vertex], kind="stable")
    rank = np.full(len(order) + 1, -1)
    rank[order] = np.arange(len(order))
    return layer._replace(of=rank[layer.of], vertex=layer.vertex[order])


class Planes(NamedTuple):
    """The layers of a descent, from the top down."""

    layers: list[Layer]
    named: int
    """Which of them is that of the places; -1 for none."""
    given: int
    """Which has costs of its own; -1 for none."""


def layers_over(
    lowest: Lowest, enterable: BoolArray, settings: DescentSettings, *, is_by_places: bool
) -> Planes:
    """Return the fields of a descent.

    Where places are many and smaller than the last fields, these are blocks of joined places. Where
    a level has too many fields to be the top, there are blocks of theirs above it.

    `is_by_places`: whether the highest level of the pyramid is that of the places.
    """
    is_small, most = lowest.top is None, MOST_AT_TOP
    layers, n_cells = list(lowest.layers), int(lowest.sums[:, 0].sum())
    if is_small:
        side, most = max(round(math.sqrt(settings.field_cells)), 1), MOST_BLOCKS
        layers = [joined(lowest, layers[0], enterable, side)]
    else:
        side = math.isqrt(n_cells // max(len(layers[0].vertex), 1)) + 1
    n_below = len(layers)
    while len(layers[0].vertex) > most:
        side *= BLOCK_SIDE
        layers.insert(0, joined(lowest, layers[0], enterable, side))
        if len(layers[0].vertex) > NEARLY * len(layers[1].vertex):
            layers.pop(0)  # parts that no arc connects
            break
    given = -1 if is_small else len(layers) - n_below
    named = given if is_by_places else -1
    for k in range(max(named, 0) + 1, len(layers)):
        layers[k] = _by_fields_above(layers[k], layers[k - 1])
    return Planes(layers, named, given)


def pack(lowest: Lowest, planes: Planes, enterable: BoolArray, *, by_units: bool) -> LevelFields:
    """Return the fields of a descent for kernels.

    Where no other cost is given, an arc costs the octile distance between the centres of gravity of
    its two fields (ours), with `by_units` times the mean of their factors.

    `enterable`: bool (rows, cols), the cells that paths may use.
    """
    starts, parts, n_arcs, cols = [0], [], 0, enterable.shape[1]
    above: LongArray | None = None  # the field of the level above of each vertex
    total = np.empty((0, 4))
    for k, (of, vertex) in enumerate(planes.layers):
        n_fields, held = len(vertex), of >= 0
        total = np.stack(
            [np.bincount(of[held], part[held], n_fields) for part in lowest.sums.T], axis=1
        )
        means = total[:, 1:] / total[:, :1]
        cells = lowest.cells[vertex]
        first, heads = _field_kernels.neighbours_of(lowest.arcs, of, enterable.ravel()[cells])
        tails = np.repeat(np.arange(n_fields), np.diff(first))
        if k == planes.given and lowest.top is not None:
            middle = np.stack(np.divmod(cells, cols), axis=1).astype(np.float64)
            costs = lowest.top.of(cells[tails], cells[heads], enterable.size)
        else:
            middle = means[:, :2]
            costs = _field_kernels.octile_costs(first, heads, middle)
            if by_units:
                costs *= (means[tails, 2] + means[heads, 2]) / (2 << UNIT_BITS)
        parent = np.full(n_fields, -1) if above is None else above[vertex] + starts[-2]
        parts.append((first[:-1] + n_arcs, heads + np.int32(starts[-1]), costs, parent, middle))
        n_arcs += len(heads)
        starts.append(starts[-1] + n_fields)
        above = of
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    dtypes: list[Any] = [np.int64, np.int32, np.float32, np.int32, np.float32]
    arrays: list[Any] = [c.astype(dtype) for c, dtype in zip(columns, dtypes, strict=True)]
    arrays[0] = np.append(arrays[0], n_arcs)
    last = lowest.cells[planes.layers[-1].vertex]
    return LevelFields._make([np.array(starts), *arrays, last, total[:, 0].astype(np.int64)])


class _Work:
    """What one descent writes, and its number."""

    def __init__(self, fields: LevelFields, n_cells: int) -> None:
        n_fields = len(fields.parent)
        self.number = 0
        self.marks = Marks(
            cost=np.empty(n_fields),
            came=np.empty(n_fields, dtype=np.int32),
            seen=np.zeros(n_fields, dtype=np.int64),
            kept=np.zeros(n_fields, dtype=np.int64),
            listed=np.zeros(n_fields, dtype=np.int32),
            told=np.zeros(6, dtype=np.int64),
            heap=np.empty((_ROOM, 2)),
            records=np.zeros(n_cells, dtype=np.int64),
            waiting=np.empty(_ROOM * BUCKETS, dtype=np.int32),
        )

    def make_room(self) -> None:
        """Make the open lists twice as large."""
        heap, waiting = self.marks.heap, self.marks.waiting
        self.marks = self.marks._replace(
            heap=np.empty((2 * len(heap), 2)), waiting=np.empty(2 * waiting.size, dtype=np.int32)
        )


@copies_alike
class Descent:
    """The descents of one map; threads may share it.

    Between queries it holds some 120 bytes for each field of its levels, and six bytes a cell: the
    moves from each, and the vertex that holds it. A search for a path takes eight bytes a cell for
    its records.

    Parameters
    ----------
    pyramid
        The pyramid; if it has many small places, fields are made of them, block by block.
    enterable
        bool (rows, cols), the cells that paths may use.
    settings
        How it goes down.
    units
        int32 (rows, cols), the factor of each cell; None for lengths.

    Examples
    --------
    >>> from hybridnav.search.descent import Descent
    >>> grid = hn.example_map("figure1")
    >>> pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=1.0)
    >>> free = grid.enterable(allow_unexplored=False)
    >>> descent = Descent(pyramid, free)
    >>> found = descent.find((5, 5), (25, 20))
    >>> found.cells[[0, -1]].tolist(), len(found.places) > 1
    ([[5, 5], [25, 20]], True)
    """

    def __init__(
        self,
        pyramid: DualGraphPyramid,
        enterable: BoolArray,
        settings: DescentSettings = DescentSettings(),  # noqa: B008 - it does not change
        *,
        units: IntArray | None = None,
        corner_cutting: bool = False,
    ) -> None:
        sizes = sizes_of(pyramid)
        self._is_by_places = pyramid.region_cells is None
        self._settings, self._corner_cutting = settings, corner_cutting
        is_small = self._is_by_places and has_small_places(sizes, settings)
        levels = [pyramid.place_level] if is_small else levels_by(sizes, settings)
        lowest = lowest_of(pyramid, sizes, levels, units, by_distance=not is_small)
        self._lay(lowest, enterable, by_units=units is not None)

    def _lay(self, lowest: Lowest, enterable: BoolArray, *, by_units: bool) -> None:
        """Pack the fields that are made of some vertices."""
        settings = self._settings
        planes = layers_over(lowest, enterable, settings, is_by_places=self._is_by_places)
        self._lowest, self._named = lowest, planes.named
        self.fields = pack(lowest, planes, enterable, by_units=by_units)
        rings = np.full(len(planes.layers), settings.ring)
        rings[: max(self._named + 1, 1)] += 2 if settings.ring else 0
        self._rings, self._horizon = rings, float(settings.horizon_cells)
        moves = legal_moves(np.ascontiguousarray(enterable), self._corner_cutting)
        successors, _ = move_tables(corner_cutting=self._corner_cutting)
        self._ground = MapCells(
            moves.ravel(),
            enterable.shape[1],
            lowest.holder.ravel(),
            lowest.cells,
            planes.layers[-1].of,
            successors,
            UNLIMITED,
        )
        self._field_of: IntArray | None = None
        self._directed: dict[DirectedSides, tuple[LevelFields, MapCells]] = {}
        self.n_cells = int(np.count_nonzero(enterable))
        """Cells that paths may use."""
        self._moves_to_edit: Pool[ByteArray] = Pool(partial(np.copy, self._ground.moves))
        self._works = Pool(partial(_Work, self.fields, enterable.size))

    @property
    def field_of(self) -> IntArray:
        """int32 (rows, cols), the last field of each cell; -1 for none."""
        if self._field_of is None:
            fields = np.append(self._ground.field_of, -1).astype(np.int32)
            self._field_of = fields[self._lowest.field_of]
        return self._field_of

    def changed(self, patch: Patch, enterable: BoolArray, units: IntArray | None) -> Descent | None:
        """Return the descents of a map after a change, this one stays as it is.

        They are those that are made of the whole pyramid of the map now, in the time of the change,
        of copies of four bytes a cell, and of packing the fields. None where other levels have to
        be visited now.

        `patch`: what became of the pyramid's record; `enterable`, `units`: as in the constructor.
        """
        lowest, settings = self._lowest, self._settings
        ended, sizes = patched_ends(lowest, patch)
        is_small = has_small_places(sizes, settings)
        levels = [len(sizes) - 1] if is_small else levels_by(sizes, settings)
        if is_small is not (lowest.top is None) or levels[1:] != lowest.levels[1:]:
            return None
        made = copy(self)
        now = patched(lowest, patch, levels, ended, units)
        Descent._lay(made, now, enterable, by_units=units is not None)
        return made

    @property
    def memory_bytes(self) -> int:
        """Bytes held between descents that do not overlap."""
        with self._works.lent() as work:
            held = [*self.fields, *work.marks, *self._ground]
            return sum(array.nbytes for array in held if isinstance(array, np.ndarray))

    def find(
        self,
        start: Cell,
        goal: Cell,
        *,
        closed: LongArray | None = None,
        one_way: DirectedSides | None = None,
    ) -> Descended:
        """Find a path between the centres of two cells; it need not be a shortest one.

        `start`, `goal`: cells of places that may be passed, (row, col); `closed`: int64 (n,), flat
        cells that windows go round, if the way round is short; then no path proves nothing;
        `one_way`: sides that routes and windows cross in one direction only.
        """
        fields, ground = (self.fields, self._ground) if one_way is None else self._on(one_way)
        if closed is None:
            # Along a legal route most windows are legal: those that obey expand more cells.
            found, _ = self._descend(start, goal, self._horizon, _nothing, (fields, self._ground))
            if one_way is None or found.cells is None or not one_way.meets(found.cells):
                return found
            return self._descend(start, goal, self._horizon, _nothing, (fields, ground))[0]
        limits = closed, one_way, self._corner_cutting
        with limited(self._moves_to_edit, ground.cols, limits) as moves:
            limit = int(WAY_ROUND * self._horizon) * STRAIGHT
            ground = ground._replace(moves=moves, limit=limit)
            return self._descend(start, goal, self._horizon, _nothing, (fields, ground))[0]

    def _on(self, one_way: DirectedSides) -> tuple[LevelFields, MapCells]:
        """Return fields and cells with directions; the last ones are kept.

        A field leads to another one if a cell of it does.
        """
        kept = self._directed.pop(one_way, None)
        if kept is None:
            fields, moves = self.fields, self._ground.moves & ~one_way.moves.ravel()
            neighbour, field_of = fields.neighbour.copy(), self.field_of.ravel()
            shut = self._crossed(~moves & self._ground.moves, field_of)
            legal = self._crossed(moves, field_of)
            for _ in range(len(fields.starts) - 1):
                key = np.array([len(fields.parent), 1])
                for tail, head in shut[~np.isin(shut @ key, legal @ key)].tolist():
                    arcs = slice(*fields.first[tail : tail + 2].tolist())
                    # Nothing is gained by an arc to its own tail.
                    neighbour[arcs][neighbour[arcs] == head] = tail
                shut, legal = (
                    unique_rows(above[above[:, 0] != above[:, 1]]).rows
                    for above in (fields.parent[shut], fields.parent[legal])
                )
            ground = self._ground._replace(moves=moves, successors=moves_by_turn(ALL_BUT_BACK))
            kept = fields._replace(neighbour=neighbour), ground
        return keep_last(self._directed, one_way, kept, _KEPT)

    def _crossed(self, moves: ByteArray, field_of: IntArray) -> IntArray:
        """Return from which of the last fields to which other one some straight moves lead, int32
        (n, 2), each pair once."""
        found = []
        for k in range(0, 8, 2):
            cells = np.flatnonzero(moves >> k & 1)
            to = cells + STEPS[k] @ np.array([self._ground.cols, 1])
            pairs = np.stack([field_of[cells], field_of[to]], axis=1)
            is_out = (pairs[:, 0] != pairs[:, 1]) & (pairs >= 0).all(axis=1)
            found.append(pairs[is_out] + np.int32(self.fields.starts[-2]))
        return unique_rows(np.concatenate(found)).rows

    def corridor(
        self, start: Cell, goal: Cell, *, up: int = 0
    ) -> tuple[Descended, Corridor | None]:
        """Find the last fields alone, with the rings round them, as a corridor; None without a
        route.

        `up`: so many levels above the last one; the corridor is what a descent kept there.
        """
        found, inside = self._descend(start, goal, 0.0, partial(self._kept_above, up))
        if inside is None:
            return found, None
        n_cells = int(self.fields.areas[inside].sum())
        return found, Corridor(self.field_of, inside, n_cells)

    def _kept_above(self, up: int, marks: Marks, number: int) -> BoolArray:
        """Return the last fields that lie in those kept so many levels above."""
        starts, parent = self.fields.starts, self.fields.parent
        at = np.arange(starts[-2], starts[-1])
        for _ in range(min(up, len(starts) - 2)):
            at = np.where(at >= 0, parent[at], -1)
        inside: BoolArray = (marks.kept[at] == number) & (at >= 0)
        return inside

    def watch(self, start: Cell, goal: Cell) -> WatchedDescent | None:
        """Find a path as `find` does, and return what was kept at each level; None without a path.

        `start`, `goal`: cells of places that may be passed, (row, col).
        """
        horizon = self._horizon or float(DescentSettings().horizon_cells)
        found, levels = self._descend(start, goal, horizon, partial(self._kept, goal))
        if found.cells is None or levels is None:
            return None
        return WatchedDescent(levels, found.cells)

    def _kept(self, goal: Cell, marks: Marks, number: int) -> list[KeptFields]:
        """Return what a descent kept, from the top down."""
        starts, parent = self.fields.starts, self.fields.parent
        field_of, at, levels = self.field_of, int(starts[-2] + self.field_of[goal]), []
        for k in range(len(starts) - 2, -1, -1):
            low, high = int(starts[k]), int(starts[k + 1])
            bounds = self.fields.first[low : high + 1]
            own = slice(int(bounds[0]), int(bounds[-1]))
            tails = np.repeat(np.arange(high - low, dtype=np.int32), np.diff(bounds))
            arcs = np.stack([tails, self.fields.neighbour[own] - np.int32(low)], axis=1)
            route, v = [], at
            while v >= 0:
                route.append(v - low)
                v = int(marks.came[v])
            kept = marks.kept[low:high] == number
            levels.append(KeptFields(field_of, arcs, kept, np.array(route[::-1], dtype=np.int32)))
            if k:
                above = parent[low:high] - np.int32(starts[k - 1])
                field_of, at = np.append(above, np.int32(-1))[field_of], int(parent[at])
        return levels[::-1]

    def _descend(
        self,
        start: Cell,
        goal: Cell,
        horizon: float,
        look: Callable[[Marks, int], T],
        on: tuple[LevelFields, MapCells] | None = None,
    ) -> tuple[Descended, T | None]:
        """Return the outcome of a descent, and what `look` returns of what it wrote, by its number;
        None without a route."""
        fields, ground = on or (self.fields, self._ground)
        cols = ground.cols
        ends = start[0] * cols + start[1], goal[0] * cols + goal[1]
        work = self._works.take()
        if work.number > _MOST_WINDOWS:
            work = _Work(self.fields, len(ground.moves))
        while True:
            marks, number = work.marks, work.number + 1
            route, cells = _kernels.descend(
                fields, marks, ground, number, ends, self._rings, horizon, self._named
            )
            status, last, *effort, diagonals = marks.told.tolist()
            if status != _kernels.FULL:
                break
            work.make_room()
            work.number += _WINDOWS  # what the stopped descent stamped counts no more
        seen = look(marks, number) if status >= 0 else None
        work.number = max(number, last)
        self._works.give(work)
        n = len(cells)
        length = n - 1 - diagonals + diagonals * _ROOT_2 if n else 0.0
        if status == _kernels.NO_WAY and last == number:  # no route of the first level
            length = math.inf
        n_fields, expanded, corridor = effort
        path = cells if n else None
        return Descended(route[::-1], path, expanded, n_fields, corridor, length), seen


def _nothing(_marks: Marks, _number: int) -> None:
    """Look at nothing of what a descent wrote."""
