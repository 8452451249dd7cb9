"""Decimation of a combinatorial map by maximal independent edge sets, from the base to the apex.

Y. Haxhimusa, R. Glantz, M. Saib, G. Langs, W. G. Kropatsch: Logarithmic tapering graph pyramid,
DAGM 2002 (MIES); contraction and removal kernels after L. Brun, W. Kropatsch: Introduction to
combinatorial pyramids, 2001.
"""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.combinatorial import CombinatorialMap
from hybridnav.combinatorial import darts as dart_kernels
from hybridnav.errors import InvalidValueError
from hybridnav.pyramid import _base_kernels, _field_kernels, _hull_kernels, _kernels
from hybridnav.pyramid.expansion import Expansion
from hybridnav.pyramid.hulls import merge_hulls
from hybridnav.pyramid.record import MAX_LEVELS, BuildStats, LevelSize, Linkage, Record
from hybridnav.pyramid.scratch import Scratch
from hybridnav.pyramid.start import N_CLASSES, kinds_of, start_at_base, start_at_level

if TYPE_CHECKING:
    from hybridnav._typing import ByteArray, IntArray
    from hybridnav.pyramid.level import Level
    from hybridnav.pyramid.start import Start
    from hybridnav.pyramid.steering import Resists, Steering

KERNEL = _kernels.select_stars
"""The kernel whose compiled form shows that a pyramid was built before."""

_LINKAGES: dict[Linkage, int] = {
    "survivor": _kernels.SURVIVOR,
    "radius": _kernels.RADIUS,
    "diameter": _kernels.DIAMETER,
}

_ROUNDING = 1e-9
_FARTHEST = 2.0**62
_NO_LIMIT = int(_FARTHEST)
_NO_HULLS = _kernels.Hulls(np.empty(0, np.int64), np.empty((0, 2), np.int32))
"""Hulls where distances do not count."""
_NO_PIECES = (np.empty(0, np.uint8), np.empty(0, np.int32), np.empty(0, np.uint8))
"""Where blocks alone are in pieces, which need no record."""


def squared_limit(merge_distance_m: float, resolution_m: float) -> int:
    """Return the least squared distance in cells that is not strictly below the merge distance."""
    ratio = merge_distance_m / resolution_m
    return math.ceil(min(ratio * ratio * (1 - _ROUNDING), _FARTHEST))


def decimate(  # noqa: PLR0913 - each criterion of merging is an argument of its own
    classes: ByteArray,
    *,
    linkage: Linkage,
    limit: int,
    seed: int,
    rooms: IntArray | None = None,
    resistance: Resists | None = None,
) -> tuple[Record, BuildStats, CombinatorialMap]:
    """Contract stars level by level until no edge may be contracted.

    With rooms there are three rounds: below the limit and inside rooms, which makes the places;
    inside rooms without a limit, which makes the rooms; and without rooms. With a resistance the
    last round ends when every arc resists; the labels that it keeps apart, if any, stand for rooms.

    Parameters
    ----------
    classes
        uint8 `CellClass`, shape `(rows, cols)`.
    linkage
        The distance that stays below the limit.
    limit
        See `squared_limit`.
    seed
        Breaks ties between edges of equal attribute.
    rooms
        int32, label of each cell's room, -1 for none; same shape.
    resistance
        The rule by which arcs resist above the places.

    Returns
    -------
    Record, BuildStats
        All levels, and their sizes.
    CombinatorialMap
        The darts of the places: from the record they take longer than a build.
    """
    labels = rooms if resistance is None else resistance.kept_apart
    kinds = classes if labels is None else kinds_of(classes, labels)
    began = time.perf_counter()
    start = start_at_base(kinds, limit)
    run = _Decimation(start, seed, _LINKAGES[linkage], limit)
    run.stats.seconds["base"] = time.perf_counter() - began
    run.exhaust()
    places = run.plane_map()
    if labels is not None:
        run.lift_limit()
        run.exhaust()
        run.forget_rooms()
    if resistance is not None:
        run.lift_limit()
        run.steer(resistance.steering(run.field_of(), run.n_vertices))
    if labels is not None or resistance is not None:
        run.exhaust()
    run.finish()
    return run.record, run.stats, places


def contract_all(start: Start, linkage: Linkage, limit: int, seed: int) -> None:
    """Contract stars from a start until no edge may be contracted, into the start's record.

    Vertices of the start may be fields in pieces, for which the record is complete. The parameters
    are those of `decimate`.
    """
    run = _Decimation(start, seed, _LINKAGES[linkage], limit)
    run.fields_in_pieces = True
    run.exhaust()


def go_on_above(  # noqa: PLR0913 - what a pyramid is made of
    places: Level,
    record: Record,
    stats: BuildStats,
    *,
    most_cells: int,
    seed: int,
    rooms: IntArray | None = None,
) -> tuple[Record, BuildStats]:
    """Contract the arcs of the place level in the order of the expansion rating, up to the apex.

    There are two rounds: up to a number of cells a field, which makes the regions, and without such
    a limit. With rooms the first two stay inside them, and a third one forgets them.

    Parameters
    ----------
    places
        The level to start at.
    record, stats
        Those of its pyramid, which stay as they are.
    most_cells
        Most cells of a region.
    seed
        Breaks ties between arcs of equal rating.
    rooms
        int32, label of each cell's room, -1 for none.

    Returns
    -------
    Record, BuildStats
        Up to the level of the places they describe the same levels.
    """
    classes = places.grid.classes
    kinds = classes if rooms is None else kinds_of(classes, rooms)
    run = _Decimation(start_at_level(places, record, kinds), seed)
    run.recall(stats)
    expansion = Expansion(places, most_cells)
    run.steer(expansion)
    run.exhaust()
    expansion.lift_limit()
    run.exhaust()
    if rooms is not None:
        run.forget_rooms()
        run.exhaust()
    run.finish()
    return run.record, run.stats


class _Decimation:
    """The shrinking arrays of the current level; every pass works on them in place."""

    fields_in_pieces = False
    """Whether vertices other than blocks are in pieces at the start."""

    def __init__(
        self, start: Start, seed: int, linkage: int = _kernels.SURVIVOR, limit: int = _NO_LIMIT
    ) -> None:
        self.stats = BuildStats()
        self._began = time.perf_counter()
        self._linkage = linkage
        self._limit = limit
        self._seed = np.uint64((seed * 0x9E3779B1 + 0x7F4A7C15) & 0xFFFFFFFF)
        self._hulls = _NO_HULLS
        self._steering: Steering | None = None
        self.record, self._darts, self._vertices, self._level, self._cols = start
        self._loops = [0]
        self._whole_at = int(self._vertices.whole_at.max(initial=0))
        self._scratch = Scratch.of_size(len(self._vertices.cells), len(self._darts.base_edge))

    def recall(self, stats: BuildStats) -> None:
        """Take over what is known of the levels up to this one."""
        self._loops = [size.self_loops for size in stats.sizes[: self._level + 1]]
        self.stats.seconds = dict(stats.seconds)
        self.stats.tops = [self._level]

    @property
    def n_vertices(self) -> int:
        """Vertices of the current level."""
        return len(self._vertices.cells)

    def plane_map(self) -> CombinatorialMap:
        """Return the current level as a plane map of its own."""
        darts = self._darts
        return CombinatorialMap(
            sigma=darts.sigma.copy(),
            origin=darts.origin.copy(),
            protected=darts.protected.copy(),
            base_edge=darts.base_edge.copy(),
            n_vertices=self.n_vertices,
        )

    def exhaust(self) -> None:
        """Contract until no edge may be contracted, and record the level reached."""
        while self.step():
            pass
        self.stats.tops.append(self._level)

    def lift_limit(self) -> None:
        """Let vertices merge however far apart they are."""
        self._limit = _NO_LIMIT
        self._hulls = _NO_HULLS

    def steer(self, steering: Steering) -> None:
        """Let a steering decide from here on which arcs are contracted, in place of distances."""
        self._steering = steering

    def forget_rooms(self) -> None:
        """Reduce the kind of each vertex to its class."""
        kinds = self._vertices.classes
        kinds[:] = (kinds - 1) % N_CLASSES + 1

    def step(self) -> bool:
        """Build the next level; return False if this one is the apex."""
        count = self._find_candidates()
        self._lap("candidates")
        if count == 0 and self._level >= self._whole_at:
            return False
        self._level += 1
        if self._level > MAX_LEVELS:
            raise InvalidValueError(f"the map needs more than {MAX_LEVELS} levels")
        scratch = self._scratch.for_level(len(self._vertices.cells), len(self._darts.base_edge))
        self._select(scratch, count)
        self._merge_vertices(scratch)
        self._lap("vertices")
        touched, any_loop = dart_kernels.contract(
            self._darts,
            scratch.parent,
            scratch.new_vertex,
            scratch.kernel_dart,
            scratch.state,
            scratch.inverse,
            scratch.shift,
            scratch.touched,
            self._cols,
        )
        self._lap("contraction")
        dart_kernels.simplify(
            self._darts,
            scratch.touched[:touched],
            any_loop,
            scratch.state,
            scratch.inverse,
            self._cols,
            self._record_so_far(),
            self._vertices.whole_at,
            self._level,
            self._level > self._whole_at,
        )
        self._lap("removal")
        self._close_gaps(scratch)
        self._note_loops()
        self._lap("compaction")
        return True

    def _record_so_far(self) -> tuple[ByteArray, IntArray, ByteArray]:
        """Return what states how vertices other than blocks are in pieces, up to this level."""
        if not self.fields_in_pieces:
            return _NO_PIECES
        record, scratch = self.record, self._scratch
        base_edge = self._darts.base_edge
        gone = scratch.state[: len(base_edge)] == dart_kernels.CONTRACTED
        record.edge_end[base_edge[gone]] = 2 * self._level
        return record.vertex_end, record.vertex_parent, record.edge_end

    def _select(self, scratch: Scratch, count: int) -> None:
        """Choose the stars of this level from its first `count` candidates."""
        darts, keys = self._darts, scratch.keys[:count]
        _kernels.match(darts.origin, keys, scratch.best, scratch.matched, scratch.rest)
        self._lap("matching")
        stars = (scratch.parent, scratch.kernel_dart, scratch.has_leaf)
        _kernels.select_stars(
            darts.origin,
            darts.base_edge,
            keys,
            scratch.state,
            scratch.matched,
            scratch.best,
            self._vertices,
            self._seed,
            stars,
        )
        if self._steering is not None:
            self._steering.refuse_leaves(scratch.parent, scratch.kernel_dart)
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
        return count

    def _try_candidates(self) -> int:
        return int(
            _kernels.contractible(
                self._darts.origin,
                self._darts.base_edge,
                self._vertices,
                self._hulls,
                self._level,
                self._linkage,
                self._limit,
                self._seed,
                self._scratch.keys,
                self._scratch.state,
                self._scratch.best,
            )
        )

    def _find_steered(self, steering: Steering) -> int:
        """Fill the keys with the arcs that the steering offers, and return their number."""
        scratch, darts = self._scratch, self._darts
        arcs, ranks = steering.candidates(self.field_of, darts, self._vertices)
        keys, base_edge = scratch.keys[: len(arcs)], darts.base_edge
        _kernels.open_candidates(
            darts.origin, base_edge, arcs, ranks, self._seed, keys, scratch.state, scratch.best
        )
        return len(arcs)

    def _start_hulls(self) -> None:
        """Build the hull of every vertex, once bounding boxes no longer decide every edge."""
        self._hulls = _kernels.Hulls(
            *_hull_kernels.field_hulls(self.field_of(), self._cols, self._vertices.boxes)
        )
        self._lap("hulls")

    def field_of(self) -> IntArray:
        """Return the current vertex of each flat cell, int32 (n_cells,), -1 for none."""
        record = self.record
        labels: IntArray = _field_kernels.label_fields(
            record.vertex_end, record.vertex_parent, MAX_LEVELS
        )[0]
        return labels

    def _merge_vertices(self, scratch: Scratch) -> None:
        record = self.record
        n_vertices = _kernels.compact_vertices(
            self._vertices,
            scratch.parent,
            scratch.new_vertex,
            self._cols,
            self._level,
            record.vertex_end,
            record.vertex_parent,
        )
        if self._steering is not None:
            self._steering.merge(scratch.new_vertex[scratch.parent], n_vertices)
        elif len(self._hulls.start):
            merged_into = scratch.new_vertex[scratch.parent]
            self._hulls = merge_hulls(self._hulls, merged_into, n_vertices)
        self._vertices = _kernels.Vertices(*(array[:n_vertices] for array in self._vertices))

    def _close_gaps(self, scratch: Scratch) -> None:
        n_edges = dart_kernels.compact_darts(
            self._darts, scratch.state, scratch.new_edge, self._level, self.record.edge_end
        )
        sigma, origin, sweep, protected, base_edge = self._darts
        self._darts = dart_kernels.Darts(
            sigma[: 2 * n_edges],
            origin[: 2 * n_edges],
            sweep[: 2 * n_edges],
            protected[: 2 * n_edges],
            base_edge[:n_edges],
        )

    def _note_loops(self) -> None:
        origin = self._darts.origin
        self._loops.append(int((origin[::2] == origin[1::2]).sum()))

    def finish(self) -> None:
        """Record the sizes of all levels."""
        vertex_ends = _base_kernels.count_bytes(self.record.vertex_end).sum(axis=0)
        edge_ends = _base_kernels.count_bytes(self.record.edge_end).reshape(2, -1, 2).sum((0, 2))
        vertices, edges = (
            ends[::-1].cumsum()[::-1][1:].tolist() for ends in (vertex_ends, edge_ends)
        )
        self.stats.sizes = [
            LevelSize(*size) for size in zip(vertices, edges, self._loops, strict=False)
        ]
        self._lap("sizes")

    def _lap(self, stage: str) -> None:
        now = time.perf_counter()
        self.stats.seconds[stage] = self.stats.seconds.get(stage, 0.0) + now - self._began
        self._began = now
