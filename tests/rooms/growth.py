"""A pyramid whose arcs resist by rules: what `merge` does, field by field."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import count

import numpy as np

import hybridnav as hn
from hybridnav._base.typing import FloatArray, IntArray, LongArray
from hybridnav.pyramid.darts import WORST_RANK, Darts
from hybridnav.rooms.kernels import merging as _merging_kernels
from hybridnav.rooms.merging import JudgedSegments, Rule

_PATIENCE = 48
"""Levels at which an arc waits for better ones at its endpoints; a pyramid has 126 at most."""


def contract(segments: JudgedSegments, rules: Sequence[Rule]) -> hn.DualGraphPyramid:
    """Contract segments until every boundary between them resists.

    `segments`, `rules`: as of `Growth`; the segments merge as the fields do. Result: its places are
    the segments as they were, the fields of its apex those that are left.
    """
    free = segments.label_of >= 0
    occupied = np.where(free, 0.0, 1.0).astype(np.float32)
    return hn.DualGraphPyramid.build(
        hn.OccupancyGrid(occupied, hn.Frame(1.0), robot_radius_m=0.0),
        merge_distance_m=math.inf,
        resistance=Growth(segments, rules),
    )


class Growth:
    """The resistance of boundaries between segments by rules, one after the other; see `Resists`.

    `segments`: the segments; they merge as the fields do; `rules`: when no arc may be contracted by
    one of them, the next one decides.
    """

    def __init__(self, segments: JudgedSegments, rules: Sequence[Rule]) -> None:
        self._segments, self._rules = segments, rules
        self._label_of = segments.label_of
        self.kept_apart: IntArray = _colours(segments)[self._label_of]
        self.shape = self._label_of.shape

    def steering(self, field_of: IntArray, n_vertices: int) -> GrowingSegments:
        inside = field_of >= 0
        segment_of = np.full(n_vertices, -1, dtype=np.int64)
        segment_of[field_of[inside]] = self._label_of.ravel()[inside]
        return GrowingSegments(self._segments, self._rules, segment_of)


class GrowingSegments:
    """A steering by the boundaries of segments; see `Steering`.

    An arc waits while a better one meets one of its endpoints, so that segments merge nearly in the
    order of one contraction at a time, and boundaries of a merged segment are rated anew before the
    next level.

    `segments`, `rules`: see `Growth`; `segment_of`: int64 (n_vertices,), the segment of each vertex
    of the level to start from, -1 for none.
    """

    def __init__(
        self, segments: JudgedSegments, rules: Sequence[Rule], segment_of: LongArray
    ) -> None:
        self._segments, self._segment_of = segments, segment_of
        self._rules = list(rules)
        self._grown = np.empty(0, dtype=np.int64)
        self._levels = 0
        self._of_arc = np.empty(0)

    def candidates(
        self, field_of: Callable[[], IntArray], darts: Darts, vertices: object
    ) -> tuple[LongArray, LongArray]:
        """Return the arcs that may be contracted, and that no better one keeps waiting."""
        u, v = self._segment_of[darts.origin.reshape(-1, 2).T]
        loops = darts.origin[::2] == darts.origin[1::2]
        ratings = self._rated(u, v)
        ratings[(u == v) & (u >= 0) & ~loops] = 1.0  # parts of one segment that have met
        may = ratings > 0
        if not may.any() and len(self._rules) > 1:
            self._rules.pop(0)
            return self.candidates(field_of, darts, vertices)
        self._of_arc = ratings
        self._levels += 1
        if self._waits:
            best = np.zeros(self._segments.n_segments)
            np.maximum.at(best, u[may], ratings[may])
            np.maximum.at(best, v[may], ratings[may])
            may[may] = ratings[may] >= np.maximum(best[u[may]], best[v[may]])
        arcs = np.flatnonzero(may)
        return arcs, (WORST_RANK * (1.0 - ratings[arcs])).astype(np.int64)

    def refuse_leaves(self, parent: IntArray, kernel_dart: IntArray) -> None:
        """Undo all joins of a star but the best: the others are rated again without it."""
        if not self._waits:
            return
        leaves = np.flatnonzero(kernel_dart >= 0)
        leaves = leaves[np.argsort(-self._of_arc[kernel_dart[leaves] >> 1], kind="stable")]
        _, first = np.unique(parent[leaves], return_index=True)
        undone = np.delete(leaves, first)
        parent[undone], kernel_dart[undone] = undone, -1

    def merge(self, merged_into: IntArray, n_vertices: int) -> None:
        before, segments = self._segment_of, self._segments
        segment_of = np.full(n_vertices, -1, dtype=np.int64)
        segment_of[merged_into] = before
        stars = np.bincount(merged_into)[merged_into] > 1
        joins = np.stack([segment_of[merged_into[stars]], before[stars]], axis=1)
        grown: list[int] = []
        while len(joins):
            apart = []
            for one, other in joins.tolist():
                u, v = (int(segments.owner_of[segment]) for segment in (one, other))
                if u == v:
                    continue
                pairs = _merging_kernels.pairs_of(segments.state, u)
                pairs = pairs[(segments.state.endpoints[pairs] == v).any(axis=1)]
                if not len(pairs):  # two leaves of a star: once its centre has joined, they touch
                    apart.append((one, other))
                else:
                    grown += segments.merge(pairs).tolist()
            joins = np.array(apart)
        self._grown = np.unique(segments.owner_of[grown])
        self._segment_of = segments.owner_of[segment_of]

    @property
    def _waits(self) -> bool:
        return self._levels <= _PATIENCE

    def _rated(self, u: LongArray, v: LongArray) -> FloatArray:
        """Return the rating of the arcs between segments, 0 for the others."""
        of_pair = self._rules[0].ratings(self._segments, self._grown)
        endpoints, n = self._segments.state.endpoints, self._segments.n_segments
        alive = np.flatnonzero(endpoints[:, 0] >= 0)
        low, high = np.sort(endpoints[alive], axis=1).T
        keys = low * n + high
        order = np.argsort(keys, kind="stable")
        between = (u != v) & (u >= 0) & (v >= 0)
        wanted = (np.minimum(u, v) * n + np.maximum(u, v))[between]
        ratings = np.zeros(len(u))
        ratings[between] = of_pair[alive[order[np.searchsorted(keys, wanted, sorter=order)]]]
        return ratings


def _colours(segments: JudgedSegments) -> IntArray:
    """Return a number for each segment that none beside it has: a pyramid has few kinds of cells.

    The last one, for no segment, is -1.
    """
    colour_of = np.full(segments.n_segments + 1, -1, dtype=np.int32)
    for segment in np.flatnonzero(segments.state.versions >= 0).tolist():
        pairs = _merging_kernels.pairs_of(segments.state, segment)
        beside = segments.state.endpoints[pairs].sum(axis=1) - segment
        taken = set(colour_of[beside].tolist())
        colour_of[segment] = next(colour for colour in count() if colour not in taken)
    return colour_of
