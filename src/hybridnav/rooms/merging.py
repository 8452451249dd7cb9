"""Segments of free space, and the forest that sees which of them are one room."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from itertools import chain
from typing import Protocol

import numpy as np

from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.maps.clearance import within_radius
from hybridnav.rooms.cutting import Ground, with_beside
from hybridnav.rooms.kernels import cutting as _cell_kernels
from hybridnav.rooms.kernels import forest as _forest_kernels
from hybridnav.rooms.kernels import merging as _merging_kernels
from hybridnav.rooms.kernels.merging import SegmentState

Judge = Callable[[LongArray, FloatArray], FloatArray]
"""Returns the probability that both segments of each pair belong to one room, float64 (n,), by
their evidence, float64 (n, len(EVIDENCE))."""


def grown(
    label_of: IntArray, reach_cells: float, *, into: tuple[IntArray, BoolArray] | None = None
) -> IntArray:
    """Return labels spread to the unlabelled cells within reach, walls or not: each takes the
    nearest one.

    `into`: labels that are changed in place instead, int32, and the only cells that are,
    bool, both (rows, cols).
    """
    side = int(reach_cells)
    row, col = np.mgrid[-side : side + 1, -side : side + 1].reshape(2, -1)
    squares = row * row + col * col
    order = np.lexsort((row, col, squares))
    order = order[np.sqrt(squares[order]) <= reach_cells]
    found, wanted = (label_of.copy(), label_of < 0) if into is None else into
    radius = math.sqrt(squares[order[-1]])
    wanted = wanted & within_radius(label_of >= 0, radius_cells=radius)
    offsets = np.stack([row[order], col[order]], axis=1)
    _cell_kernels.take_nearest(label_of, wanted, offsets, found)
    return found


EVIDENCE = (
    *("open_m", "span_m", "covered", "deviation_m", "bent", "jamb_low", "jamb_high", "walled"),
    *("passage_m", "mean_passage_m", "passage_of_lower", "passage_of_higher"),
    *("open_share", "open_of_small_rim", "open_of_large_rim"),
    *("opened_small", "opened_large", "opened_both"),
    *("solid_small", "solid_large", "solid_both", "solid_gain"),
    *("peak_small_m", "peak_large_m", "broad_small_m", "broad_large_m"),
    *("long_small", "long_large", "long_both", "open_of_small_breadth", "open_of_large_breadth"),
    *("axes_alike", "square_to_small", "square_to_large", "n_small", "n_large"),
    *("open_of_passage", "n_openings", "longest_m", "flush_low", "flush_high", "flush_mean"),
)
"""What is measured of each boundary between a smaller segment and a larger one."""
_EVIDENCE_REACH_M = 0.25
"""How far segments reach into what is not free: walls between two segments are about half as
thick."""
_JAMB_M = 2.0
"""Length of wall on either side of an opening that is looked at."""
TABLE = "room_judge.npz"
_POSSIBLE = (0.25, 0.1)
"""Least probability, in any corridor and in an even one."""
_BROADEST_M, _ALIKE, _UNEVEN, _UNNARROWED, _LONG = 4.0, 0.6, 1.8, 0.8, 1.5
"""A corridor: breadth, breadths of two parts against each other, twice the greatest clearance
against the breadth, twice that on their opening against the breadth of the narrower part, length in
breadths. Sums over many cells, for the greatest clearance of a part changes with a speck."""
_EVEN = (1.45, 0.8)
"""Less than `_UNEVEN`, and more than `_ALIKE`, in an even corridor."""
_OPENED = (0.7, 1.5)
"""Breadth of the widest opening over that of both parts of a corridor."""


@dataclass(frozen=True, eq=False)
class Forest:
    """Complete trees of one depth, level by level: right is what lies above a threshold."""

    features: LongArray
    """int64 (n_trees, 2^depth - 1), index into `EVIDENCE`."""
    thresholds: FloatArray
    """float64 (n_trees, 2^depth - 1), infinite where all goes left."""
    leaves: FloatArray
    """float64 (n_trees, 2^depth), added log odds."""
    base: float
    """Log odds without evidence."""

    @classmethod
    @cache
    def shipped(cls) -> Forest:
        """Read the forest of the package; `python -m benchmarks train_rooms` makes it."""
        with (resources.files("hybridnav.rooms") / TABLE).open("rb") as file:
            table = np.load(file)
            return cls(
                table["features"].astype(np.int64),
                table["thresholds"].astype(np.float64),
                table["leaves"].astype(np.float64),
                float(table["base"]),
            )

    def judge(self, _pairs: LongArray, evidence: FloatArray) -> FloatArray:
        """Return the probability that two segments belong to one room, float64 (n,)."""
        return _forest_kernels.probabilities(
            evidence, self.features, self.thresholds, self.leaves, self.base
        )


class JudgedSegments:
    """Segments of free space, with the evidence on their boundaries; merging keeps it up to date.

    `label_of`: int32 (rows, cols), a segment for each free cell, without gaps from 0, -1 elsewhere;
    `ground`: what counts as free and as wall.
    """

    def __init__(self, label_of: IntArray, ground: Ground) -> None:
        self._label_of = label_of
        self.n_segments = int(label_of.max(initial=-1)) + 1
        self.resolution_m = ground.resolution_m
        self.state = _state(self._label_of, self.n_segments, ground)
        self.owner_of = np.arange(self.n_segments)
        """int64 (n_segments,), the segment that each one is part of by now."""

    @property
    def label_of(self) -> IntArray:
        """int32 (rows, cols), the segments as they are now; numbers have gaps."""
        return np.append(self.owner_of, -1).astype(np.int32)[self._label_of]

    def evidence(self, pairs: LongArray) -> FloatArray:
        """Return the evidence on pairs with an open border, float64 (n, len(EVIDENCE))."""
        found = np.zeros((len(pairs), len(EVIDENCE)))
        _merging_kernels.fill_evidence(
            self.state,
            pairs,
            self.resolution_m,
            _EVIDENCE_REACH_M / self.resolution_m,
            max(1, round(_JAMB_M / self.resolution_m)),
            found,
        )
        return found

    def merge(self, pairs: LongArray) -> LongArray:
        """Merge the two segments of each pair, no segment of two pairs; return those left."""
        sizes = self.state.hull_sizes[self.state.endpoints[pairs]].sum()
        if self.state.hulls_used[0] + sizes > len(self.state.hulls):
            hulls = np.empty((sizes + len(self.state.hulls), 2))
            hulls = np.concatenate([self.state.hulls, hulls])
            self.state = self.state._replace(hulls=hulls)
        kept, gone = _merging_kernels.merge_pairs(self.state, pairs).T
        into = np.arange(self.n_segments)
        into[gone] = kept
        self.owner_of = into[self.owner_of]
        return kept


def _state(label_of: IntArray, n: int, ground: Ground) -> SegmentState:
    """Measure segments and the pairs that touch."""
    reaching = grown(label_of, _EVIDENCE_REACH_M / ground.resolution_m)
    measured = _merging_kernels.measure_segments(label_of, reaching, ground.squares, n)
    shapes = _merging_kernels.SegmentShapes(*chain(*measured))
    pairs, sides, clear = _cell_kernels.sides_between(label_of, ground.squares)
    order, opened, run_begins, run_ends = _runs(pairs, n)
    _, border, border_begins, border_ends = _runs(
        _cell_kernels.sides_between(reaching, ground.squares)[0], n
    )
    keys = np.union1d(opened, border)
    at, count = np.searchsorted(keys, opened), len(keys)
    endpoints = np.stack([keys // max(1, n), keys % max(1, n)], axis=1)
    open_sides, border_sides, widest, clearances = (np.zeros(count) for _ in range(4))
    head, begin, end = np.full(count, -1), np.zeros(count, np.int64), np.zeros(count, np.int64)
    open_sides[at], head[at], begin[at], end[at] = run_ends - run_begins, at, run_begins, run_ends
    border_sides[np.searchsorted(keys, border)] = border_ends - border_begins
    if len(opened):
        widest[at] = np.maximum.reduceat(clear[order], run_begins)
        clearances[at] = np.add.reduceat(clear[order], run_begins)
    hulls = np.empty((2 * len(shapes.hulls) + 16, 2))
    hulls[: len(shapes.hulls)] = shapes.hulls
    first_half, next_half = _halves(endpoints, n)
    return SegmentState(
        **shapes._replace(hulls=hulls)._asdict(),
        opened=np.bincount(endpoints.ravel(), np.repeat(open_sides, 2), n),
        degrees=np.bincount(endpoints.ravel(), minlength=n),
        first_half=first_half,
        versions=np.zeros(n, np.int64),
        endpoints=endpoints,
        open_sides=open_sides,
        border_sides=border_sides,
        widest=widest,
        clearances=clearances,
        head=head,
        tail=head.copy(),
        next_half=next_half,
        next_run=np.full(count, -1),
        run_begins=begin,
        run_ends=end,
        sides=sides[order],
        wall=with_beside(ground.wall),
        hulls_used=np.array([len(shapes.hulls)]),
        mark=np.full(n, -1),
    )


def _runs(pairs: LongArray, n: int) -> tuple[LongArray, LongArray, LongArray, LongArray]:
    """Return the order of sides by pair, each pair's key, and where its sides begin and end."""
    keys = pairs[:, 0] * n + pairs[:, 1]
    order = np.argsort(keys, kind="stable")
    found, begins, counts = np.unique(keys[order], return_index=True, return_counts=True)
    return order, found, begins, begins + counts


def _halves(endpoints: LongArray, n: int) -> tuple[LongArray, LongArray]:
    """Return linked lists of the half pairs of each segment."""
    first, following = np.full(n, -1), np.full(2 * len(endpoints), -1)
    order = np.argsort(endpoints.ravel(), kind="stable")
    of = endpoints.ravel()[order]
    last = np.append(of[1:] != of[:-1], True) if len(of) else np.zeros(0, bool)
    following[order[:-1][~last[:-1]]] = order[1:][~last[:-1]]
    begins = np.flatnonzero(np.diff(of, prepend=-1))
    first[of[begins]] = order[begins]
    return first, following


class Rule(Protocol):
    """What decides which pairs of segments may merge."""

    def ratings(self, segments: JudgedSegments, grown: LongArray) -> FloatArray:
        """Return the rating of each pair, float64 (n_pairs,), above 0 where it may merge.

        `segments`: the segments as they are now; `grown`: int64 (n,), segments that have grown
        since the last call.
        """


class Likely:
    """The rule that two segments merge where a judge finds it likely that both are one room.

    `judge`: returns probabilities, float64 (n,), for int64 (n,) pairs and their evidence, float64
    (n, len(EVIDENCE)); `least`: probability from which on a pair may merge, in (0, 1].
    """

    def __init__(self, judge: Judge, least: float) -> None:
        self._judge, self._least = judge, least
        self._likely = np.empty(0)

    def ratings(self, segments: JudgedSegments, grown: LongArray) -> FloatArray:
        """Return the probability of each pair, 0 below the least; see `Rule`."""
        state = segments.state
        if len(self._likely):
            has_grown = np.zeros(segments.n_segments, dtype=np.bool_)
            has_grown[grown] = True
            judged = has_grown[state.endpoints].any(axis=1)
        else:
            self._likely, judged = np.zeros(len(state.endpoints)), True
        pairs = np.flatnonzero((state.endpoints[:, 0] >= 0) & (state.open_sides > 0) & judged)
        if len(pairs):
            self._likely[pairs] = self._judge(pairs, segments.evidence(pairs))
        may = (state.endpoints[:, 0] >= 0) & (self._likely >= self._least)
        return np.where(may, self._likely, 0.0)


class GoesOn:
    """The rule that two segments merge where a corridor goes on, also round a bend or a crossing.

    The corridor is judged as a whole: both parts and their union are about as broad as the opening
    between them. The judge of boundaries only has to hold it for possible, since a wall beside a
    branch looks to it like that beside a door. `judge`: see `Likely`.
    """

    def __init__(self, judge: Judge) -> None:
        self._judge = judge

    def ratings(self, segments: JudgedSegments, _grown: LongArray) -> FloatArray:
        """Return the probability of pairs of one corridor, else 0; see `Rule`."""
        state = segments.state
        pairs = np.flatnonzero((state.endpoints[:, 0] >= 0) & (state.open_sides > 0))
        ends = state.endpoints[pairs]
        free, squares, peaks = state.free[ends], state.squares[ends], state.peaks[ends]
        breadths = _breadths(squares, free)
        joined = _breadths(squares.sum(axis=1), free.sum(axis=1))
        goes_on = joined * segments.resolution_m < _BROADEST_M
        goes_on &= 2 * peaks.max(axis=1) < _UNEVEN * joined
        goes_on &= breadths.min(axis=1) > _ALIKE * breadths.max(axis=1)
        goes_on &= 2 * state.widest[pairs] > _UNNARROWED * breadths.min(axis=1)
        goes_on &= (free > _LONG * breadths * breadths).all(axis=1)
        is_even = 2 * peaks.max(axis=1) < _EVEN[0] * joined
        is_even &= breadths.min(axis=1) > _EVEN[1] * breadths.max(axis=1)
        opened = _merging_kernels.widest_openings(state, pairs[goes_on])[:, None]
        opened = opened / breadths[goes_on]
        goes_on[goes_on] = ((opened > _OPENED[0]) & (opened < _OPENED[1])).all(axis=1)
        likely = np.zeros(len(pairs))
        likely[goes_on] = self._judge(pairs[goes_on], segments.evidence(pairs[goes_on]))
        likely[likely < np.where(is_even, _POSSIBLE[1], _POSSIBLE[0])] = 0.0
        ratings = np.zeros(len(state.endpoints))
        ratings[pairs] = likely
        return ratings


def _breadths(squares: FloatArray, free: FloatArray) -> FloatArray:
    """Return the breadths of segments, in cells, by their sums of squared clearances and counts of
    cells: between parallel walls, straight or not, the mean is a twelfth of the breadth squared."""
    return np.sqrt(12 * squares / free)


class Small:
    """The rule that a small segment merges with the neighbour of the longest open border.

    `least_cells`: free cells from which on a segment is not small. Those without a neighbour stay.
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


def merge(segments: JudgedSegments, rules: Sequence[Rule]) -> None:
    """Merge segments by rules, one after the other, until no pair may merge by any of them.

    Pairs merge that no better pair meets at either segment; then those that touch what has grown
    are rated again.
    """
    for rule in rules:
        changed = np.empty(0, dtype=np.int64)
        while len(pairs := _best(segments.state.endpoints, rule.ratings(segments, changed))):
            changed = segments.merge(pairs)


def _best(endpoints: LongArray, ratings: FloatArray) -> LongArray:
    """Return pairs of segments, each the best at both ends, none with an end in common."""
    pairs = np.flatnonzero(ratings > 0)
    pairs = pairs[np.argsort(-ratings[pairs], kind="stable")]
    place = np.arange(len(pairs))[:, None]
    first = np.full(endpoints.max(initial=0) + 1, len(pairs))
    np.minimum.at(first, endpoints[pairs], place)
    return pairs[(first[endpoints[pairs]] == place).all(axis=1)]
