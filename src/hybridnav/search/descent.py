"""A descent through the levels of a pyramid: routes of ever smaller fields, and a path of cells.

A route of places is found first. Its fields and those beside them are kept, and the next route is
found among their sons, some levels down; so on to fields of some hundred cells, along which A*
finds the path, window by window. N. Sturtevant and M. Buro (Partial pathfinding using map
abstraction and refinement, 2005) plan so on abstractions of a grid, and refine a part of the path
at a time.
"""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.kernels.moves import legal_moves
from hybridnav._base.threads import Pool
from hybridnav.maps.costs.factors import UNIT_BITS
from hybridnav.pyramid.record import SURVIVES, Record
from hybridnav.route.route import Corridor
from hybridnav.search.grid_search import move_tables
from hybridnav.search.kernels import descent as _kernels
from hybridnav.search.kernels.descent import LevelFields, MapCells, Marks
from hybridnav.search.kernels.grid_search import BUCKETS

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.pyramid import DualGraphPyramid
    from hybridnav.pyramid.level import Level
    from hybridnav.pyramid.record import Record

T = TypeVar("T")
Cell = tuple[int, int]
_ROOM = 1024
_ROOT_2 = math.sqrt(2)
_WINDOWS = 1 << 20
"""More windows than a descent has."""
NEARLY = 0.85
"""Part of `step` that is enough: no level has exactly so many fields."""
MANY_PLACES = 1000
"""Places above which small ones are joined in blocks."""
MOST_BLOCKS, MOST_AT_TOP = 300, 4000
"""Most fields of the first level, if they are blocks, and if they are places."""
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
    """Length of the path, cells; 0 without one."""


def levels_of(pyramid: DualGraphPyramid, settings: DescentSettings) -> list[int]:
    """Return the levels that a descent visits, from the top down.

    The top is that of the places, or that of the regions, if the pyramid has any.
    """
    top = pyramid.place_level if pyramid.region_cells is None else pyramid.region_level
    sizes = np.array([size.vertices for size in pyramid.stats.sizes[: top + 1]])
    means = sizes[0] / np.maximum(sizes, 1)
    off = np.maximum(means / settings.field_cells, settings.field_cells / np.maximum(means, 1))
    levels = [int(np.argmin(off))]
    for level in range(levels[0] + 1, top):
        if means[level] >= settings.step * means[levels[-1]] * NEARLY:
            levels.append(level)
    if len(levels) > 1 and means[top] < settings.step * means[levels[-1]] * NEARLY:
        levels.pop()
    return [*([top] if top != levels[-1] else []), *reversed(levels)]


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


class Layer(NamedTuple):
    """The fields of one level of a descent, made of the vertices of a level of the pyramid."""

    of: LongArray
    """int64 (vertices,), the field of each; -1 for none."""
    vertex: LongArray
    """int64 (n,), the vertex of each field whose surviving cell stands for it."""
    arcs: LongArray
    """int64 (m,), the arcs of the pyramid's level that join fields of this one."""
    costs: FloatArray | None = None
    """float64 (m,), costs of these arcs, cells; None for octile distances between centres of
    gravity."""


def layers_of(pyramid: DualGraphPyramid, levels: list[int]) -> list[Layer]:
    """Return the fields of some levels, the highest first, of the vertices of the last one.

    At the top an arc costs its `max_distance_m`, which the source paper has.
    """
    lowest, record, cols = pyramid[levels[-1]], pyramid.record, pyramid.grid.shape[1]
    survivors = lowest.cells[:, 0] * cols + lowest.cells[:, 1]
    vertex_end, edge_end = record.vertex_end[survivors], record.edge_end[lowest.base_edges]
    costs: FloatArray | None = pyramid[levels[0]].max_distance_m / pyramid.grid.resolution_m
    layers = []
    for level in levels:
        arcs = np.flatnonzero(edge_end >= min(2 * level + 2, SURVIVES))
        alive = np.flatnonzero(vertex_end > level)
        layers.append(Layer(_ancestors(record, survivors, level), alive, arcs, costs))
        costs = None
    return layers


def joined(level: Level, below: Layer, is_open: BoolArray, side: int) -> Layer:
    """Return the fields of a level above: those that arcs connect inside a square block of cells.

    `level`: the level of whose vertices fields are made; `below`: the fields that are joined;
    `is_open`: bool (vertices,), those that paths may pass; `side`: of a block, in cells.
    """
    arcs = below.of[level.arcs[below.arcs]]
    cells, may_pass = level.cells[below.vertex], is_open[below.vertex]
    arcs = arcs[((arcs >= 0) & may_pass[arcs]).all(axis=1)]
    of, nearest = _kernels.join_in_blocks(cells, may_pass, arcs, side)
    return Layer(np.append(of, -1)[below.of], below.vertex[nearest], below.arcs)


def _by_fields_above(layer: Layer, above: Layer) -> Layer:
    """Return a layer with its fields in the order of those above: neighbours lie close in memory,
    which saves a descent a fourth of its time at the levels of large maps."""
    order = np.argsort(above.of[layer.vertex], kind="stable")
    rank = np.full(len(order) + 1, -1)
    rank[order] = np.arange(len(order))
    return layer._replace(of=rank[layer.of], vertex=layer.vertex[order])


def layers_within(
    pyramid: DualGraphPyramid, enterable: BoolArray, settings: DescentSettings
) -> tuple[Level, list[Layer], int]:
    """Return the fields of a descent: the level of whose vertices they are made, the layers from
    the top down, and which of them is that of the places; -1 for none.

    Where places are many and smaller than the last fields, these are blocks of joined places. Where
    a level has too many fields to be the top, there are blocks of theirs above it.
    """
    n_cells, n_places = (pyramid.stats.sizes[k].vertices for k in (0, pyramid.place_level))
    levels = levels_of(pyramid, settings)
    is_by_places, most = levels[0] == pyramid.place_level, MOST_AT_TOP
    level = pyramid[levels[-1]]
    is_open = enterable[tuple(level.cells.T)]
    if is_by_places and n_places > MANY_PLACES and n_cells < settings.field_cells * n_places:
        level, most, is_by_places = pyramid[pyramid.place_level], MOST_BLOCKS, False
        is_open = enterable[tuple(level.cells.T)]
        every, side = np.arange(level.n_vertices), max(round(math.sqrt(settings.field_cells)), 1)
        layers = [joined(level, Layer(every, every, np.arange(level.n_arcs)), is_open, side)]
    else:
        layers = layers_of(pyramid, levels)
        side = math.isqrt(n_cells // max(len(layers[0].vertex), 1)) + 1
    n_below = len(layers)
    while len(layers[0].vertex) > most:
        side *= BLOCK_SIDE
        layers.insert(0, joined(level, layers[0], is_open, side))
        if len(layers[0].vertex) > NEARLY * len(layers[1].vertex):
            layers.pop(0)  # parts that no arc connects
            break
    named = len(layers) - n_below if is_by_places else -1
    for k in range(max(named, 0) + 1, len(layers)):
        layers[k] = _by_fields_above(layers[k], layers[k - 1])
    return level, layers, named


def pack(
    level: Level,
    layers: list[Layer],
    *,
    enterable: BoolArray,
    units: IntArray | None = None,
) -> LevelFields:
    """Return the fields of a descent for kernels.

    Where no other cost is given, an arc costs the octile distance between the centres of gravity of
    its two fields (ours), with `units` times the mean of their factors.

    `level`: the level of whose vertices fields are made; `layers`: those of the descent, the
    highest first; `enterable`: bool (rows, cols), the cells that paths may use; `units`: int32
    (rows, cols), factor of each cell; None for lengths.
    """
    cols = enterable.shape[1]
    survivors = level.cells[:, 0] * cols + level.cells[:, 1]
    flat = None if units is None else np.ascontiguousarray(units).ravel()
    sums = _kernels.field_sums(level.field_of.ravel(), cols, flat, level.n_vertices)
    starts, parts, n_arcs = [0], [], 0
    above: LongArray | None = None  # the field of the level above of each vertex
    total = np.empty((0, 4))
    for of, vertex, edges, given in layers:
        n_fields, held = len(vertex), of >= 0
        total = np.stack([np.bincount(of[held], part[held], n_fields) for part in sums.T], axis=1)
        means = total[:, 1:] / total[:, :1]
        ends, is_open = of[level.arcs[edges].T], np.append(enterable.flat[survivors[vertex]], False)
        may_pass = is_open[ends[0]] & is_open[ends[1]] & (ends[0] != ends[1])
        middle = means[:, :2] if given is None else level.cells[vertex].astype(np.float64)
        ends = ends[:, may_pass]
        keys = ends * n_fields + ends[::-1]
        pairs = np.sort(keys, axis=None)  # several times faster than np.unique
        pairs = pairs[np.diff(pairs, prepend=-1) > 0]
        tails, neighbour = np.divmod(pairs, max(n_fields, 1))
        first = np.searchsorted(tails, np.arange(n_fields))
        if given is None:
            rows_cols = np.abs(middle[tails] - middle[neighbour])
            cost = rows_cols.max(axis=1) + (_ROOT_2 - 1) * rows_cols.min(axis=1)
            if units is not None:
                cost *= (means[tails, 2] + means[neighbour, 2]) / (2 << UNIT_BITS)
        else:
            cost = np.empty(len(pairs))  # arcs between the same two fields cost the same
            cost[np.searchsorted(pairs, keys)] = given[may_pass]
        parent = np.full(n_fields, -1) if above is None else above[vertex] + starts[-2]
        parts.append((first + n_arcs, neighbour + starts[-1], cost, parent, middle))
        n_arcs += len(neighbour)
        starts.append(starts[-1] + n_fields)
        above = of
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    dtypes: list[Any] = [np.int64, np.int32, np.float32, np.int32, np.float32]
    arrays: list[Any] = [c.astype(dtype) for c, dtype in zip(columns, dtypes, strict=True)]
    arrays[0] = np.append(arrays[0], n_arcs)
    areas = total[:, 0].astype(np.int64)
    return LevelFields._make([np.array(starts), *arrays, survivors[layers[-1].vertex], areas])


def _ancestors(record: Record, cells: LongArray, level: int) -> LongArray:
    """Return the vertex of a level that holds each surviving cell, flat, of a level below."""
    holder = cells.copy()
    while (gone := record.vertex_end[holder] <= level).any():
        holder[gone] = record.vertex_parent[holder[gone]]
    return np.searchsorted(cells[record.vertex_end[cells] > level], holder)


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

    Between queries it holds some 60 bytes for each field of its levels, and four bytes a cell for
    the field of each. A search for a path takes eight bytes a cell for its records.

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
        level, layers, self._named = layers_within(pyramid, enterable, settings)
        self.fields = pack(level, layers, enterable=enterable, units=units)
        self.field_of = np.append(layers[-1].of, -1).astype(np.int32)[level.field_of]
        """int32 (rows, cols), the last field of each cell; -1 for none."""
        rings = np.full(len(layers), settings.ring)
        rings[: max(self._named + 1, 1)] += 2 if settings.ring else 0
        self._rings, self._horizon = rings, float(settings.horizon_cells)
        moves = legal_moves(np.ascontiguousarray(enterable), corner_cutting)
        successors, _ = move_tables(corner_cutting=corner_cutting)
        self._ground = MapCells(
            moves.ravel(), enterable.shape[1], self.field_of.ravel(), successors
        )
        self._works = Pool(partial(_Work, self.fields, enterable.size))

    @property
    def memory_bytes(self) -> int:
        """Bytes held between descents that do not overlap."""
        with self._works.lent() as work:
            held = [*self.fields, *work.marks, *self._ground]
            return sum(array.nbytes for array in held if isinstance(array, np.ndarray))

    def find(self, start: Cell, goal: Cell) -> Descended:
        """Find a path between the centres of two cells; it need not be a shortest one.

        `start`, `goal`: cells of places that may be passed, (row, col).
        """
        return self._descend(start, goal, self._horizon, _nothing)[0]

    def corridor(self, start: Cell, goal: Cell) -> tuple[Descended, Corridor | None]:
        """Find the last fields alone, with the rings round them, as a corridor; None without a
        route."""
        found, listed = self._descend(start, goal, 0.0, _listed)
        if listed is None:
            return found, None
        inside = np.zeros(len(self.fields.survivor), dtype=np.bool_)
        inside[listed - self.fields.starts[-2]] = True
        return found, Corridor(self.field_of, inside, found.corridor_cells)

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
        self, start: Cell, goal: Cell, horizon: float, look: Callable[[Marks, int], T]
    ) -> tuple[Descended, T | None]:
        """Return the outcome of a descent, and what `look` returns of what it wrote, by its number;
        None without a route."""
        cols = self._ground.cols
        ends = start[0] * cols + start[1], goal[0] * cols + goal[1]
        work = self._works.take()
        while True:
            marks, number = work.marks, work.number + 1
            route, cells = _kernels.descend(
                self.fields, marks, self._ground, number, ends, self._rings, horizon, self._named
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
        places = route[::-1]
        length = n - 1 - diagonals + diagonals * _ROOT_2 if n else 0.0
        fields, expanded, corridor = effort
        path = cells if n else None
        return Descended(places, path, expanded, fields, corridor, length), seen


def _nothing(_marks: Marks, _number: int) -> None:
    """Look at nothing of what a descent wrote."""


def _listed(marks: Marks, _number: int) -> IntArray:
    """Return the last fields."""
    listed: IntArray = marks.listed[: marks.told[0]].copy()
    return listed
