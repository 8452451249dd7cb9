"""The levels of a decimation, one after the other, in arrays that shrink and work space that they
share.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.typing import AnyArray, BoolArray, ByteArray, IntArray, KeyArray
from hybridnav.errors import InvalidValueError
from hybridnav.pyramid import CombinatorialMap
from hybridnav.pyramid.darts import Steering
from hybridnav.pyramid.kernels import base as _base_kernels
from hybridnav.pyramid.kernels import darts as dart_kernels
from hybridnav.pyramid.kernels import decimation as _kernels
from hybridnav.pyramid.kernels import fields as _field_kernels
from hybridnav.pyramid.kernels import hulls as _hull_kernels
from hybridnav.pyramid.record import MAX_LEVELS, BuildStats, LevelSize
from hybridnav.pyramid.start import N_CLASSES, Start, pieces_of


class Scratch(NamedTuple):
    """Work space of all levels: 17 bytes an edge and 21 a vertex, shared by consecutive passes.

    By edge: `keys`, `rest`, `state`; by vertex: `best`, `matched`, `parent`, `kernel_dart`,
    `has_leaf`.
    """

    keys: KeyArray
    rest: KeyArray
    state: ByteArray
    best: KeyArray
    matched: IntArray
    parent: AnyArray
    kernel_dart: IntArray
    has_leaf: BoolArray

    @classmethod
    def of_size(cls, n_vertices: int, n_edges: int) -> Scratch:
        """Return work space for a level of this size, which suits all levels above it."""
        by_edge, by_vertex = ("u8", "u8", "u1"), ("u8", "i4", "u4", "i4", "?")
        arrays = [np.empty(n_edges, kind) for kind in by_edge]
        return cls._make(arrays + [np.empty(n_vertices, kind) for kind in by_vertex])

    def for_level(self, n_vertices: int, n_edges: int) -> Scratch:
        """Return views of the length of a level."""
        by_edge, by_vertex = self[:3], self[3:]
        arrays = [array[:n_edges] for array in by_edge]
        return Scratch._make(arrays + [array[:n_vertices] for array in by_vertex])

    # Keys and matching are free once the stars are chosen.

    @property
    def inverse(self) -> AnyArray:
        """uint32 by dart, the inverse of sigma."""
        return self.rest.view(np.uint32)

    @property
    def by_edge(self) -> AnyArray:
        """uint32: darts of the faces that contraction has changed; then by edge its new number."""
        return self.keys.view(np.uint32)

    @property
    def merged_into(self) -> AnyArray:
        """uint32 by vertex, the one of the next level that it goes into."""
        return self.matched.view(np.uint32)

    @property
    def shift(self) -> IntArray:
        """int32 by vertex, scratch of `contract`."""
        return self.best.view(np.int32)


NO_LIMIT = 2**62
"""A squared distance beyond all others."""
_NO_HULLS = _kernels.Hulls(np.empty(0, np.int64), np.empty((0, 2), np.int32))
"""Hulls where distances do not count."""


class Window(NamedTuple):
    """Where the map of a decimation lies on a larger one: edges of equal attribute are ordered as
    there."""

    row: int
    """Its first row, a multiple of 16: blocks are those of the larger map."""
    col: int
    """Its first column, another multiple."""
    cols: int
    """Columns of the larger map."""


class Decimation:
    """The shrinking arrays of the current level; every pass works on them in place."""

    survivors: BoolArray | None = None
    """By flat cell, those that survive whatever they merge with; None for no such cells."""

    def __init__(
        self,
        start: Start,
        seed: int,
        linkage: int = _kernels.SURVIVOR,
        limit: int = NO_LIMIT,
        window: Window | None = None,
    ) -> None:
        self.stats = BuildStats()
        self._began = clock()
        self._linkage = linkage
        self._limit = limit
        row, col, cols = (0, 0, start.cols) if window is None else window
        numbers = (
            seed * 0x9E3779B1 + 0x7F4A7C15 & 0xFFFFFFFF,
            2 * (row * cols + col),
            2 * start.cols,
            2 * (cols - start.cols),
        )
        self._order = _kernels.Order(*map(np.uint64, numbers))
        self._hulls = _NO_HULLS
        self._steering: Steering | None = None
        self.record, darts, self._vertices, self._level, self._cols = start
        sigma, origin = darts.sigma.view(np.uint32), darts.origin.view(np.uint32)
        self._darts = darts._replace(sigma=sigma, origin=origin)
        self._blocks = self._vertices.boxes.copy() if linkage != _kernels.SURVIVOR else None
        self._merged: list[AnyArray] = []
        self._sizes = [LevelSize(self.n_vertices, len(self._darts.base_edge), 0)]
        self._pieces = pieces_of(self._vertices, self._darts)
        self._whole_at = int(self._vertices.whole_at.max(initial=0))
        self._scratch = Scratch.of_size(len(self._vertices.cells), len(self._darts.base_edge))

    def recall(self, stats: BuildStats) -> None:
        """Take over what is known of the levels up to this one."""
        self._sizes = stats.sizes[: self._level + 1]
        self.stats.seconds = dict(stats.seconds)
        self.stats.tops = [self._level]

    @property
    def n_vertices(self) -> int:
        """Vertices of the current level."""
        return len(self._vertices.cells)

    def plane_map(self) -> CombinatorialMap:
        """Return the current level as a plane map of its own."""
        sigma, origin, _, protected, base_edge, _ = (array.copy() for array in self._darts)
        darts = sigma.view(np.int32), origin.view(np.int32)
        return CombinatorialMap(*darts, protected, base_edge, self.n_vertices)

    def exhaust(self) -> None:
        """Contract until no edge may be contracted, and record the level reached."""
        self.contract_all()
        self.stats.tops.append(self._level)

    def contract_all(self) -> None:
        """Contract until no edge may be contracted."""
        while self.step():
            pass

    def lift_limit(self) -> None:
        """Let vertices merge however far apart they are."""
        self._limit = NO_LIMIT
        self._hulls, self._blocks = _NO_HULLS, None

    def steer(self, steering: Steering) -> None:
        """Let a steering decide from here on which arcs are contracted, in place of distances."""
        self._steering = steering

    def forget_rooms(self) -> None:
        """Reduce the kind of each vertex to its class."""
        kinds = self._vertices.classes
        kinds[:] = (kinds - 1) % N_CLASSES + 1

    def rename_rooms(self, room_of: IntArray) -> None:
        """Let some rooms become one: int32 (n_rooms,), the room that each one lies in."""
        kinds = self._vertices.classes
        room, of_class = np.divmod(kinds.astype(np.int64) - 1, N_CLASSES)
        kinds[:] = N_CLASSES * (np.append(room_of, -1)[room - 1] + 1) + of_class + 1

    def step(self) -> bool:
        """Build the next level; return False if this one is the apex."""
        count = self._find_candidates()
        self._lap("candidates")
        if count == 0 and self._level >= self._whole_at:
            return False
        self._level += 1
        if self._level > MAX_LEVELS:
            raise InvalidValueError(f"the map needs more than {MAX_LEVELS} levels")
        scratch = self._scratch.for_level(self.n_vertices, len(self._darts.base_edge))
        self._select(scratch, count)
        self._make_level(scratch)
        self._lap("compaction")
        return True

    def _make_level(self, scratch: Scratch) -> None:
        """Contract the chosen stars and remove the edges that this makes redundant."""
        self._merge_vertices(scratch)
        self._lap("vertices")
        merged, by_edge = scratch.merged_into, (scratch.state, scratch.inverse)
        more = scratch.shift, scratch.by_edge, self._cols
        touched, any_loop = dart_kernels.contract(
            self._darts, merged, scratch.kernel_dart, *by_edge, *more
        )
        self._lap("contraction")
        level = self._vertices.whole_at, self._level, self._level > self._whole_at
        dart_kernels.simplify(
            self._darts, scratch.by_edge[:touched], any_loop, *by_edge, self._cols, *level
        )
        self._lap("removal")
        self._close_gaps(scratch)
        origin = self._darts.origin
        loops = int((origin[::2] == origin[1::2]).sum()) if any_loop else 0
        self._sizes.append(LevelSize(self.n_vertices, len(origin) // 2, loops))

    def _select(self, scratch: Scratch, count: int) -> None:
        """Choose the stars of this level from its first `count` candidates."""
        darts, keys = self._darts, scratch.keys[:count]
        _kernels.match(darts.origin, keys, scratch.best, scratch.matched, scratch.rest)
        self._lap("matching")
        stars = (scratch.parent, scratch.kernel_dart, scratch.has_leaf)
        chosen = keys, scratch.state, scratch.matched, scratch.best
        of_level = darts.origin, darts.base_edge, *chosen, self._vertices
        _kernels.select_stars(*of_level, self._order, stars)
        if self._steering is not None:
            self._steering.refuse_leaves(scratch.parent.view(np.int32), scratch.kernel_dart)
        elif self._linkage == _kernels.DIAMETER and len(self._hulls.start):
            _kernels.refuse_leaves(
                scratch.parent, scratch.kernel_dart, scratch.matched, self._hulls, self._limit
            )
        self._lap("stars")

    def _find_candidates(self) -> int:
        if self._steering is not None:
            return self._find_steered(self._steering)
        count = self._try_candidates()
        if count == _kernels.UNDECIDED:
            self._start_hulls()
            count = self._try_candidates()
        if self.survivors is not None:
            keys, state = self._scratch.keys[:count], self._scratch.state
            _base_kernels.let_survive(
                self._darts.origin, keys, self._vertices.cells, self._cols, self.survivors, state
            )
        return count

    def _try_candidates(self) -> int:
        darts, scratch, hulls = self._darts, self._scratch, self._hulls
        of_level = self._level, self._linkage, self._limit, self._order
        filled = scratch.keys, scratch.state, scratch.best
        at = darts.origin, darts.base_edge, self._vertices
        return int(_kernels.contractible(*at, hulls, *of_level, *filled))

    def _find_steered(self, steering: Steering) -> int:
        """Fill the keys with the arcs that the steering offers, and return their number."""
        scratch, darts = self._scratch, self._darts
        arcs, ranks = steering.candidates(self.field_of, darts, self._vertices)
        keys, base_edge = scratch.keys[: len(arcs)], darts.base_edge
        _kernels.open_candidates(
            darts.origin, base_edge, arcs, ranks, self._order, keys, scratch.state, scratch.best
        )
        return len(arcs)

    def _start_hulls(self) -> None:
        """Build the hull of every vertex, once bounding boxes no longer decide every edge."""
        field_of = np.arange(self.n_vertices, dtype=np.int32)
        for merged_into in reversed(self._merged):
            field_of = field_of[merged_into]
        self._merged = []
        self._make_hulls(field_of)
        self._lap("hulls")

    def _make_hulls(self, field_of_block: IntArray) -> None:
        """Make hulls from blocks, and blocks of one row from these; only diameters need less."""
        boxes = self._vertices.boxes
        first_row, rows, self._field_of_block = _hull_kernels.block_rows(
            self._blocks, field_of_block, boxes
        )
        self._blocks = rows
        self._hulls = _kernels.Hulls(2 * first_row, rows.reshape(-1, 2))
        if self._linkage == _kernels.DIAMETER:
            left, right = rows[:, 1].copy(), rows[:, 3].copy()
            self._hulls = _kernels.Hulls(
                *_hull_kernels.hulls_of_rows(boxes, first_row, left, right)
            )

    def field_of(self) -> IntArray:
        """Return the current vertex of each flat cell, int32 (n_cells,), -1 for none."""
        record = self.record
        return _field_kernels.label_fields(record.vertex_end, record.vertex_parent, MAX_LEVELS)[0]

    def _merge_vertices(self, scratch: Scratch) -> None:
        merged = scratch.parent, scratch.merged_into
        ends = self.record.vertex_end, self.record.vertex_parent
        n_vertices = _kernels.compact_vertices(
            self._vertices, *merged, self._cols, self._level, *ends
        )
        if self._steering is not None:
            self._steering.merge(scratch.merged_into.astype(np.int32), n_vertices)
        elif self._blocks is not None and not len(self._hulls.start):
            self._merged.append(scratch.merged_into.copy())
        self._vertices = _kernels.Vertices(*(array[:n_vertices] for array in self._vertices))
        if len(self._hulls.start):
            self._make_hulls(scratch.merged_into[self._field_of_block])

    def _close_gaps(self, scratch: Scratch) -> None:
        n_edges = dart_kernels.compact_darts(
            self._darts, scratch.state, scratch.by_edge, self._level, self.record.edge_end
        )
        *by_dart, base_edge, waits = self._darts
        kept = *(array[: 2 * n_edges] for array in by_dart), base_edge[:n_edges], waits[:n_edges]
        self._darts = dart_kernels.Darts._make(kept)

    def finish(self) -> None:
        """Record the sizes of all levels."""
        for level, (vertices, arcs) in enumerate(self._pieces):
            size = self._sizes[level]
            self._sizes[level] = replace(
                size, vertices=size.vertices + vertices, arcs=size.arcs + arcs
            )
        self.stats.sizes = self._sizes
        self._lap("sizes")

    def _lap(self, stage: str) -> None:
        now = clock()
        self.stats.seconds[stage] = self.stats.seconds.get(stage, 0.0) + now - self._began
        self._began = now
