"""Rooms that grow out of segments: levels of a pyramid above them, in which boundaries resist."""

from __future__ import annotations

import math
from itertools import count
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.darts import WORST_RANK, Darts
from hybridnav.topology.rooms.kernels import merging as _merging_kernels

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hybridnav._base.typing import FloatArray, IntArray, LongArray
    from hybridnav.topology.rooms.merging import JudgedSegments

    Judge = Callable[[LongArray, FloatArray], FloatArray]

_PATIENCE = 48
"""Levels at which an arc waits for better ones at its endpoints; a pyramid has 126 at most."""


class Rule(Protocol):
    """What decides which pairs of segments may merge."""

    def ratings(self, segments: JudgedSegments, grown: LongArray) -> FloatArray:
        """Return the rating of each pair, float64 (n_pairs,), above 0 where it may merge.

        Parameters
        ----------
        segments
            The segments as they are now.
        grown
            int64 (n,), segments that have grown since the last call.
        """


class Likely:
    """The rule that two segments merge where a judge finds it likely that both are one room.

    Parameters
    ----------
    judge
        Returns probabilities, float64 (n,), for int64 (n,) pairs and their evidence, float64
        (n, len(EVIDENCE)).
    least
        Probability from which on a pair may merge, in (0, 1].
    """

    def __init__(self, judge: Judge, least: float) -> None:
        self._judge, self._least = judge, least
        self._likely = np.empty(0)

    def ratings(self, segments: JudgedSegments, grown: LongArray) -> FloatArray:
        """Return the probability of each pair, 0 below the least; see `Rule`."""
        state = segments.state
        if len(self._likely):
            beside = [_merging_kernels.pairs_of(state, int(segment)) for segment in grown]
            pairs = np.unique(np.concatenate([np.empty(0, np.int64), *beside]))
        else:
            self._likely = np.zeros(len(state.endpoints))
            pairs = np.flatnonzero(state.endpoints[:, 0] >= 0)
        pairs = pairs[state.open_sides[pairs] > 0]
        if len(pairs):
            self._likely[pairs] = self._judge(pairs, segments.evidence(pairs))
        ratings: FloatArray = np.where(self._likely >= self._least, self._likely, 0.0)
        return ratings


class Small:
    """The rule that a small segment merges with the neighbour of the longest open border.

    Parameters
    ----------
    least_cells
        Free cells from which on a segment is not small. Those without a neighbour stay.
    """

    def __init__(self, least_cells: float) -> None:
        self._least = least_cells

    def ratings(self, segments: JudgedSegments, _grown: LongArray) -> FloatArray:
        """Return a rating that is the higher, the smaller the segment; see `Rule`."""
        state = segments.state
        pairs = np.flatnonzero((state.endpoints[:, 0] >= 0) & (state.open_sides > 0)).repeat(2)
        ends = state.endpoints[pairs[::2]].ravel()
        small = state.free[ends] < self._least
        pairs, ends = pairs[small], ends[small]
        order = np.lexsort((pairs, -state.open_sides[pairs], ends))
        _, first = np.unique(ends[order], return_index=True)
        widest = order[first]
        ratings = np.zeros(len(state.endpoints))
        np.maximum.at(ratings, pairs[widest], 1.0 - state.free[ends[widest]] / self._least)
        return ratings


class Growth:
    """The resistance of boundaries between segments by rules, one after the other; see `Resists`.

    Parameters
    ----------
    segments
        The segments; they merge as the fields do.
    rules
        When no arc may be contracted by one of them, the next one decides.
    """

    def __init__(self, segments: JudgedSegments, rules: Sequence[Rule]) -> None:
        self._segments, self._rules = segments, rules
        self._label_of = segments.label_of
        self.kept_apart: IntArray = _colours(segments)[self._label_of]
        self.shape = self._label_of.shape

    def steering(self, field_of: IntArray, n_vertices: int) -> GrowingSegments:
        """Return the steering from a level on whose fields are the segments."""
        inside = field_of >= 0
        segment_of = np.full(n_vertices, -1, dtype=np.int64)
        segment_of[field_of[inside]] = self._label_of.ravel()[inside]
        return GrowingSegments(self._segments, self._rules, segment_of)


class GrowingSegments:
    """A steering by the boundaries of segments; see `Steering`.

    An arc waits while a better one meets one of its endpoints, so that segments merge nearly in the
    order of one contraction at a time, and boundaries of a merged segment are rated anew before the
    next level.

    Parameters
    ----------
    segments, rules
        As of `Growth`.
    segment_of
        int64 (n_vertices,), the segment of each vertex of the level to start from, -1 for none.
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
        """Merge the segments as their vertices do."""
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
                pair = segments.pair_of(u, v)
                if pair < 0:  # two leaves of a star: once its centre has joined, they touch
                    apart.append((one, other))
                else:
                    grown.append(segments.merge(pair))
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


def contract(segments: JudgedSegments, rules: Sequence[Rule]) -> DualGraphPyramid:
    """Contract segments until every boundary between them resists.

    Parameters
    ----------
    segments, rules
        As of `Growth`; the segments merge as the fields do.

    Returns
    -------
    DualGraphPyramid
        Its places are the segments as they were, the fields of its apex those that are left.
    """
    free = segments.label_of >= 0
    grid = OccupancyGrid(
        np.where(free, 0.0, 1.0).astype(np.float32), Frame(1.0), robot_radius_m=0.0
    )
    return DualGraphPyramid.build(
        grid, merge_distance_m=math.inf, resistance=Growth(segments, rules)
    )
