"""Decimation of a combinatorial map by maximal independent edge sets, from the base to the apex.

Y. Haxhimusa, R. Glantz, M. Saib, G. Langs, W. G. Kropatsch: Logarithmic tapering graph pyramid,
DAGM 2002 (MIES); contraction and removal kernels after L. Brun, W. Kropatsch: Introduction to
combinatorial pyramids, 2001.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Literal

import numpy as np

from hybridnav.combinatorial import _kernels as dart_kernels
from hybridnav.errors import InvalidValueError
from hybridnav.pyramid import _field_kernels, _kernels
from hybridnav.pyramid.record import MAX_LEVELS, SURVIVES, BuildStats, LevelSize, Record

if TYPE_CHECKING:
    from hybridnav._typing import ByteArray, IntArray

Linkage = Literal["survivor", "radius", "diameter"]

_LINKAGES: dict[Linkage, int] = {
    "survivor": _kernels.SURVIVOR,
    "radius": _kernels.RADIUS,
    "diameter": _kernels.DIAMETER,
}

_ROUNDING = 1e-9


def squared_limit(merge_distance_m: float, resolution_m: float) -> int:
    """Least squared distance in cells that is not strictly below the merge distance."""
    ratio = merge_distance_m / resolution_m
    return math.ceil(min(ratio * ratio * (1 - _ROUNDING), 2.0**62))


def decimate(
    classes: ByteArray, *, linkage: Linkage, limit: int, seed: int
) -> tuple[Record, BuildStats]:
    """Contract stars level by level until no edge may be contracted.

    Parameters
    ----------
    classes
        uint8 `CellClass`, shape `(rows, cols)`.
    linkage
        What stays below the limit.
    limit
        See `squared_limit`.
    seed
        Breaks ties between edges of equal attribute.
    """
    run = _Decimation(classes, _LINKAGES[linkage], limit, seed)
    while run.step():
        pass
    return run.record, run.stats


class _Decimation:
    """The shrinking arrays of the current level; every pass works on them in place."""

    def __init__(self, classes: ByteArray, linkage: int, limit: int, seed: int) -> None:
        self.stats = BuildStats()
        self._began = time.perf_counter()
        self._cols = classes.shape[1]
        self._linkage = linkage
        self._limit = limit
        self._seed = np.uint64((seed * 0x9E3779B1 + 0x7F4A7C15) & 0xFFFFFFFF)
        vertex, edge, n_vertices, n_edges = dart_kernels.number_base(classes)
        self._darts = dart_kernels.base_darts(classes, vertex, edge, n_edges)
        self._vertices = _kernels.base_vertices(classes, n_vertices)
        self.record = Record(
            np.where(classes.ravel() > 0, np.uint8(SURVIVES), np.uint8(0)),
            np.full(classes.size, -1, np.int32),
            np.where(edge >= 0, np.uint8(SURVIVES), np.uint8(0)),
        )
        self._candidates = _kernels.Candidates(
            np.empty(n_edges, np.int32),
            np.empty(n_edges, np.int32),
            np.empty(n_edges, np.int32),
            np.empty(n_edges, np.uint64),
            np.empty(n_edges, np.uint8),
        )
        self._state = np.empty(n_edges, np.uint8)
        self._inverse = np.empty(2 * n_edges, np.int32)
        self._edge_scratch = np.empty(n_edges, np.int32)
        self._touched = np.empty(4 * n_edges, np.int32)
        self._new_vertex = np.empty(n_vertices, np.int32)
        self._shift = np.empty(n_vertices, np.int32)
        self._hulls = _kernels.Hulls(np.empty(0, np.int64), np.empty((0, 2), np.int32))
        self._level = 0
        self._note_size()
        self._lap("base")

    def step(self) -> bool:
        """Go from this level to the next one; False when this one is the apex."""
        count = self._find_candidates()
        self._lap("candidates")
        if count == 0:
            return False
        self._level += 1
        if self._level > MAX_LEVELS:
            raise InvalidValueError(f"the map needs more than {MAX_LEVELS} levels")
        candidates = _kernels.Candidates(*(array[:count] for array in self._candidates))
        matched = _kernels.match(candidates, len(self._vertices.cells))
        self._lap("matching")
        parent, kernel_dart = _kernels.select_stars(candidates, matched, self._vertices)
        if self._linkage == _kernels.DIAMETER and len(self._hulls.start):
            _kernels.refuse_leaves(parent, kernel_dart, matched, self._hulls, self._limit)
        self._lap("stars")
        self._merge_vertices(parent)
        self._lap("vertices")
        touched, any_loop = dart_kernels.contract(
            self._darts,
            parent,
            self._new_vertex,
            kernel_dart,
            self._state,
            self._inverse,
            self._shift,
            self._touched,
            self._cols,
        )
        self._lap("contraction")
        dart_kernels.simplify(
            self._darts, self._touched[:touched], any_loop, self._state, self._inverse, self._cols
        )
        self._lap("removal")
        self._close_gaps()
        self._note_size()
        self._lap("compaction")
        return True

    def _find_candidates(self) -> int:
        def find() -> int:
            return int(
                _kernels.contractible(
                    self._darts.origin,
                    self._darts.base_edge,
                    self._vertices,
                    self._hulls,
                    self._linkage,
                    self._limit,
                    self._seed,
                    self._candidates,
                )
            )

        count = find()
        if count == _kernels.UNDECIDED:
            self._start_hulls()
            count = find()
        return count

    def _start_hulls(self) -> None:
        """Give every vertex its hull: bounding boxes have stopped deciding every edge."""
        record = self.record
        field_of, _ = _field_kernels.label_fields(
            record.vertex_end, record.vertex_parent, self._level
        )
        self._hulls = _kernels.Hulls(
            *_field_kernels.field_hulls(field_of, self._cols, self._vertices.boxes)
        )
        self._lap("hulls")

    def _merge_vertices(self, parent: IntArray) -> None:
        record = self.record
        n_vertices = _kernels.compact_vertices(
            self._vertices,
            parent,
            self._new_vertex,
            self._cols,
            self._level,
            record.vertex_end,
            record.vertex_parent,
        )
        if len(self._hulls.start):
            self._hulls = _kernels.Hulls(
                *_field_kernels.merge_hulls(*self._hulls, parent, self._new_vertex, n_vertices)
            )
        self._vertices = _kernels.Vertices(*(array[:n_vertices] for array in self._vertices))

    def _close_gaps(self) -> None:
        n_edges = dart_kernels.compact_darts(
            self._darts, self._state, self._edge_scratch, self._level, self.record.edge_end
        )
        sigma, origin, sweep, protected, base_edge = self._darts
        self._darts = dart_kernels.Darts(
            sigma[: 2 * n_edges],
            origin[: 2 * n_edges],
            sweep[: 2 * n_edges],
            protected[: 2 * n_edges],
            base_edge[:n_edges],
        )

    def _note_size(self) -> None:
        origin = self._darts.origin
        loops = int((origin[::2] == origin[1::2]).sum())
        self.stats.sizes.append(
            LevelSize(len(self._vertices.cells), len(self._darts.base_edge), loops)
        )

    def _lap(self, stage: str) -> None:
        now = time.perf_counter()
        self.stats.seconds[stage] = self.stats.seconds.get(stage, 0.0) + now - self._began
        self._began = now
