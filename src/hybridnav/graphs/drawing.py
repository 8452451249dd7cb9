"""Chains of cells on their way to straight edges, and the edges that shorten ways between these."""

import heapq
import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hybridnav._base.trig import dist, hypots
from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.graphs.kernels import bends
from hybridnav.graphs.sketch import DOOR, END, NOTHING, ROOM, Sketch
from hybridnav.graphs.strands import Passage, Strand, crosses, is_beside, length_between

_COARSE = 8
"""Cells between the points by which the length of a chain is measured: its steps are stairs."""
_KEPT = 0.85
"""Share of its clearance that a chain keeps where it is made straight, up to what is asked for."""
_SWAY = 0.3
"""How far a straight edge lies off the middle at little cost, in clearances."""
_LEAST_SWAY = 1.5
_REACH = 100
"""Most points of a chain that one edge passes."""


@dataclass(frozen=True)
class _Line:
    """A chain of cells between two nodes."""

    tail: int
    head: int
    cells: FloatArray
    length: float
    narrow: float
    """Its least clearance, without its ends."""


class ChainGraph:
    """A plane graph of chains of cells.

    `nodes`: float64 (n, 2), centres of cells; `kinds`: what each node is for, as `Sketch` has it;
    `strands`: the chains between them; `passage`: how much room there is.
    """

    def __init__(
        self, nodes: FloatArray, kinds: LongArray, strands: list[Strand], passage: Passage
    ) -> None:
        self._passage = passage
        self._positions = dict(enumerate(nodes))
        self._kinds: dict[int, int] = dict(enumerate(kinds.tolist()))
        self._lines: dict[int, _Line] = {}
        self._at: dict[int, set[int]] = {node: set() for node in self._positions}
        self._last = 0
        for strand in strands:
            self._add(strand.tail, strand.head, strand.cells)

    def _add(self, tail: int, head: int, cells: FloatArray) -> int:
        coarse = np.concatenate([cells[:-1:_COARSE], cells[-1:]])
        length = float(hypots(*np.diff(coarse, axis=0).T).sum())
        inner = cells[1:-1] if len(cells) > 2 else cells  # noqa: PLR2004
        self._last += 1
        narrow = float(self._passage.at(inner).min())
        self._lines[self._last] = _Line(tail, head, cells, length, narrow)
        self._at[tail].add(self._last)
        self._at[head].add(self._last)
        return self._last

    def _drop(self, key: int) -> _Line:
        line = self._lines.pop(key)
        self._at[line.tail].discard(key)
        self._at[line.head].discard(key)
        return line

    def _drop_node(self, node: int) -> None:
        del self._positions[node], self._at[node], self._kinds[node]

    def prune(self, small: float, small_narrow: tuple[float, float]) -> None:
        """Leave out one side of each small ring, the one with less room.

        `small`: length of a small ring in cells; `small_narrow`: the same where the side has less
        room than is asked for: a little less, and none.
        """
        comfort, lines = self._passage.comfort, self._lines
        order = sorted(lines, key=lambda k: (min(lines[k].narrow, comfort), -lines[k].length, k))
        for key in order:
            line = lines[key]
            lack = 1 - min(line.narrow / comfort, 1) if comfort else 0.0
            limit = small_narrow[0] + (small_narrow[1] - small_narrow[0]) * lack
            rest = (limit if lack else small) - line.length
            ends = {line.tail, line.head}
            # A door keeps both its sides.
            if any(self._kinds[end] >= DOOR and len(self._at[end]) < 3 for end in ends):  # noqa: PLR2004
                continue
            if rest >= 0 and len(self._at[line.tail]) > 1 and self._detour(key, rest) <= rest:
                self._drop(key)
        self._join()

    def _detour(self, skip: int, limit: float) -> float:
        """Return the length of the way between the ends of a line without it, up to a limit."""
        line = self._lines[skip]

        def edges_from(here: int) -> Iterator[tuple[int, float]]:
            for key in sorted(self._at[here] - {skip}):
                other = self._lines[key]
                yield other.tail + other.head - here, other.length

        return length_between(edges_from, line.tail, line.head, limit)

    def _join(self) -> None:
        """Drop lines that end at nothing, and nodes in the middle of lines."""
        waiting = sorted(self._positions)
        while waiting:
            node = waiting.pop()
            if self._kinds.get(node, 0) != NOTHING:
                continue
            keys = sorted(self._at[node])
            lines = [self._lines[key] for key in keys]
            if not 0 < len(keys) < 3 or any(line.tail == line.head for line in lines):  # noqa: PLR2004
                continue
            ends = [line.tail + line.head - node for line in lines]
            for key in keys:
                self._drop(key)
            self._drop_node(node)
            if len(keys) == 1:
                waiting.append(ends[0])
                continue
            one, other = lines
            first = one.cells if one.head == node else one.cells[::-1]
            second = other.cells if other.tail == node else other.cells[::-1]
            self._add(ends[0], ends[1], np.concatenate([first, second[1:]]))

    def merge(self, near: float) -> None:
        """Make one node of two that are near along a line, if only one is a room or a door.

        Doors stay apart from what lies beyond half of the distance.
        """
        heap = [(line.length, key) for key, line in self._lines.items()]
        heapq.heapify(heap)
        while heap and heap[0][0] < near:
            length, key = heapq.heappop(heap)
            line = self._lines.get(key)
            if line is None or line.tail == line.head:
                continue
            kinds = sorted(self._kinds[node] for node in (line.tail, line.head))
            if kinds[0] < ROOM and (kinds[1] < DOOR or length <= near / 2):
                self._drop(key)
                for new in self._merged(line):
                    heapq.heappush(heap, (self._lines[new].length, new))
        self._join()

    def _merged(self, line: _Line) -> list[int]:
        """Make one node of the ends of a line; return the lines that have changed."""
        kept, gone, cells = line.tail, line.head, line.cells
        if not self._at[kept] or self._kinds[gone] >= DOOR:
            kept, gone, cells = gone, kept, cells[::-1]
        # In the widest cell, near the middle; doors and what a stub ends at stay where they are.
        room = self._passage.at(cells) - abs(np.arange(len(cells)) / len(cells) - 0.5)
        stays = self._kinds[kept] >= DOOR or not self._at[gone]
        middle = 0 if stays else int(np.argmax(room))
        self._kinds[kept] = max(self._kinds[kept], self._kinds[gone])
        self._positions[kept] = cells[middle]
        changed = []
        for node, lead in ((kept, cells[middle::-1]), (gone, cells[middle:])):
            for key in sorted(self._at[node]):
                one = self._drop(key)
                chain, tail, head = one.cells, one.tail, one.head
                if tail == node:
                    chain, tail = np.concatenate([lead[:-1], chain]), kept
                if head == node:
                    chain, head = np.concatenate([chain, lead[-2::-1]]), kept
                changed.append(self._add(tail, head, chain))
        self._drop_node(gone)
        return [key for key in changed if key in self._lines]

    def straightened(self, step: int, bend: float) -> Sketch:
        """Return the drawing with straight edges, and nodes where chains bend.

        `step`: cells between those of a chain at which it may bend; `bend`: cost of a bend, in
        cells of a chain as far off its straight edge as it may be.
        """
        index = {node: k for k, node in enumerate(self._positions)}
        positions, kinds = list(self._positions.values()), list(self._kinds.values())
        edges: list[tuple[int, int]] = []
        for line in self._lines.values():
            cells, last = line.cells, len(line.cells) - 1
            picks = np.append(np.arange(0, last, step), last)
            # Chains may pass specks, edges not.
            is_free = self._passage.at(cells[picks]) > 0
            is_free[[0, -1]] = True
            cuts = self._cuts(cells, picks[is_free], bend)
            if line.tail == line.head and len(cuts) < 4:  # noqa: PLR2004 - a ring needs a triangle
                cuts = [0, last // 3, 2 * last // 3, last]
            inner = range(len(positions), len(positions) + len(cuts) - 2)
            positions += list(cells[cuts[1:-1]])
            kinds += [NOTHING] * len(inner)
            edges += pairwise([index[line.tail], *inner, index[line.head]])
        ends = np.array(edges, dtype=np.int64).reshape(-1, 2)
        return Sketch(np.array(positions), np.array(kinds, dtype=np.int64), ends, self._passage)

    def _cuts(self, cells: FloatArray, picks: LongArray, bend: float) -> list[int]:
        """Choose the cells at which a chain bends: few edges near it, with room.

        The edges of least cost are found from point to point: each costs a bend, and the mean
        square of how far the chain lies off it, times its length.
        """
        points, count = cells[picks], len(picks)
        room, comfort = self._passage.at(points), self._passage.comfort
        # With more room than is asked for, there is no need to keep to the middle.
        sway = np.maximum(np.maximum(_SWAY * room, _LEAST_SWAY), room - comfort)
        weights = np.gradient(picks.astype(np.float64)) if count > 1 else np.ones(count)
        heads = np.arange(1, count)
        reached = np.minimum(heads, _REACH)
        tails = np.arange(reached.sum()) - np.repeat(reached.cumsum() - heads, reached)
        least = self._passage.least(points[tails], points[np.repeat(heads, reached)])
        asked = np.minimum(comfort, _KEPT * room)
        before = bends(points, weights, sway, least, asked, bend, _REACH)
        cuts = [count - 1]
        while cuts[-1]:
            cuts.append(int(before[cuts[-1]]))
        return [int(pick) for pick in picks[cuts[::-1]]]


# Fewer dead ends, and chords: edges that shorten long ways through a sketch.

_ROOM = 0.8
"""Share of the clearance that is asked for that chords have."""
_LEAST_ROOM = 0.2
"""The same where a chord saves much, unless an edge has less already: so no graph gets narrower."""
_MUCH = 1.5
"""Length of a way, in lengths of its chord, from which on that is much."""
_MOST_BESIDE = 5
"""Edges of a node from which on it gets no chord: people draw crossings, no stars."""
_SEEN = 0.97
"""Share of what sees a dead end that must see another node, so that robots miss nothing."""


def drop_ends(sketch: Sketch, reach: float, far: float, step: int) -> None:
    """Leave out dead ends without a purpose where robots see another node nearby.

    Who joins a graph at its nearest node would go all the way along from there.

    `reach`: distance in cells within which positions see a dead end; `far`: distance within which
    they must see another node; `step`: cells between the positions that are looked at.
    """
    space, at, kinds = sketch.passage.space, sketch.positions, sketch.kinds
    spots: FloatArray = np.argwhere(space.free[::step, ::step]).astype(np.float64) * step + 0.5
    from scipy.spatial import KDTree  # noqa: PLC0415 - on demand

    tree = KDTree(spots)
    beside = sketch.neighbours()
    waiting = [node for node, others in beside.items() if len(others) == 1]
    while waiting:
        node = waiting.pop()
        if kinds[node] > END or len(beside[node]) != 1:
            continue
        near = spots[np.sort(np.array(tree.query_ball_point(at[node], reach), dtype=np.int64))]
        near = near[space.sight.clear(near, np.repeat(at[[node]], len(near), axis=0))]
        others = np.array([k for k in beside if k != node], dtype=np.int64)
        steps = at[others] - at[node]
        unseen, count = near, len(near)
        for other in others[hypots(steps[:, 0], steps[:, 1]) <= reach + far].tolist():
            steps = unseen - at[other]
            is_seen = hypots(steps[:, 0], steps[:, 1]) <= far
            tails = np.repeat(at[[other]], int(is_seen.sum()), axis=0)
            is_seen[is_seen] = space.sight.clear(tails, unseen[is_seen])
            unseen = unseen[~is_seen]
        if len(unseen) <= (1 - _SEEN) * count:
            (other,) = beside.pop(node)
            beside[other].discard(node)
            waiting.append(other)
    sketch.keep_nodes(np.array(sorted(beside), dtype=np.int64))


def add_chords(sketch: Sketch, reach: float, detour: float, least_rad: float) -> None:
    """Join nodes that see each other where the way between them is long.

    `reach`: length of the longest chord in cells; `detour`: least length of that way, in lengths of
    the chord; `least_rad`: least angle between a chord and another edge of its nodes.
    """
    from scipy.spatial import KDTree  # noqa: PLC0415 - on demand

    at, comfort = sketch.positions, sketch.passage.comfort
    pairs = KDTree(at).query_pairs(reach, output_type="ndarray").astype(np.int64)
    pairs = np.sort(pairs.reshape(-1, 2), axis=1)
    least = sketch.least(at, pairs)
    narrowest = max(sketch.least(at, sketch.edges).min(initial=comfort), _LEAST_ROOM * comfort)
    fits = least >= min(narrowest, _ROOM * comfort)
    pairs, saves = pairs[fits], np.where(least[fits] < _ROOM * comfort, _MUCH, detour)
    steps = at[pairs[:, 1]] - at[pairs[:, 0]]
    lengths = hypots(steps[:, 0], steps[:, 1])
    beside: list[dict[int, float]] = [{} for _ in at]
    ways = [each.items() for each in beside]
    edges = sketch.edges.tolist()
    for one, other in edges:
        beside[one][other] = beside[other][one] = dist(at[one], at[other])
    for k in np.lexsort((pairs[:, 1], pairs[:, 0], lengths)).tolist():
        (one, other), length = pairs[k].tolist(), float(lengths[k])
        if length <= 0 or max(len(beside[one]), len(beside[other])) >= _MOST_BESIDE:
            continue
        if length_between(ways.__getitem__, one, other, float(saves[k]) * length) < math.inf:
            continue
        both = ((one, other), (other, one))
        if any(is_beside(at, a, b, list(beside[a]), least_rad) for a, b in both):
            continue
        if edges and crosses(at[one], at[other], *at[np.array(edges)].swapaxes(0, 1)).any():
            continue
        edges.append([one, other])
        beside[one][other] = beside[other][one] = length
    sketch.set_edges(edges)
