"""Straight edges set as a person would draw them: along walls, few, and crossing nowhere."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from hybridnav._base.trig import dist, hypot, hypots
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.graphs.strands import Passage, aligned, crosses, crossing, length_between, turn_of

NOTHING, END, ROOM, DOOR = -1, 0, 1, 2
"""What a node is for: its edges only, the end of a lane, a room, a door; door n is
`DOOR - 1 + n`."""

_KEPT = 0.8
"""Share of its clearance that an edge keeps where it is moved, up to what is asked for."""
_MERGED = 0.5
"""The same where two nodes become one."""
_STRAIGHT = 0.7
"""The same where a bend goes."""
_FRACTION = 2.0**10
"""Parts of a cell to which positions that were computed are rounded."""
_RIM = 2.0**-5
"""Least distance of these from the sides of their cell, in cells."""
_TOUCHING = 1e-6
"""Distance in cells from an edge at which a node lies on it."""
_ROUNDS = 50
_TRIED = 20
"""Nearest edges that a point is joined to, if it sees them."""


def settled(positions: FloatArray) -> FloatArray:
    """Return positions rounded, and off the sides of their cells."""
    rounded = np.round(positions * _FRACTION) / _FRACTION
    cells = np.floor(rounded)
    return cells + np.clip(rounded - cells, _RIM, 1 - _RIM)


class Sketch:
    """A graph of straight edges.

    `positions`: float64 (n, 2), (row, col) in grid units; `kinds`: int64 (n,), what each node is
    for; `edges`: int64 (m, 2); `passage`: how much room there is.
    """

    def __init__(
        self, positions: FloatArray, kinds: LongArray, edges: LongArray, passage: Passage
    ) -> None:
        self.positions, self.kinds, self.edges = positions, kinds, edges
        self.passage = passage

    def least(self, positions: FloatArray, edges: LongArray) -> FloatArray:
        """Return the least clearance of edges, as `Passage.least` does."""
        return self.passage.least(positions[edges[:, 0]], positions[edges[:, 1]])

    def add_nodes(self, positions: FloatArray) -> list[int]:
        """Return the nodes at some positions; they are added where there are none."""
        found: list[int] = []
        for at in positions:
            known = np.flatnonzero((self.positions == at).all(axis=1))
            found.append(int(known[0]) if len(known) else len(self.positions))
            if not len(known):
                self.positions = np.concatenate([self.positions, at[None]])
                self.kinds = np.append(self.kinds, NOTHING)
        return found

    def add_path(self, tail: int, head: int, inner: FloatArray) -> list[tuple[int, int]]:
        """Add nodes between two; return the edges from one to the next."""
        return list(pairwise([tail, *self.add_nodes(inner), head]))

    def repair(self) -> None:
        """Lead edges that the robot cannot follow round what is in their way."""
        is_bad = self.least(self.positions, self.edges) < 0
        space, bad = self.passage.space, self.edges[is_bad]
        part = space.components_at(self.positions)
        bad = bad[(part[bad[:, 0]] == part[bad[:, 1]]) & (bad[:, 0] != bad[:, 1])]
        edges = self.edges[~is_bad].tolist()
        if len(bad):
            paths = space.paths(self.positions[bad[:, 0]], self.positions[bad[:, 1]])
            lines = np.split(paths.positions, paths.path_start[1:-1])
            for (tail, head), line in zip(bad.tolist(), lines, strict=True):
                edges += self.add_path(tail, head, space.joinable(line)[1:-1])
        self.set_edges(edges)

    def set_edges(self, edges: Sequence[Sequence[int]]) -> None:
        """Keep each edge once, lower node first."""
        rows = sorted({(min(edge), max(edge)) for edge in edges if edge[0] != edge[1]})
        self.edges = np.array(rows, dtype=np.int64).reshape(-1, 2)

    def snap(self, angle_rad: float, most: float) -> None:
        """Set edges along the main directions of walls, where there is room.

        `angle_rad`: angle that turns the rows of the grid into a main direction; `most`: how far
        nodes move at most, in cells.
        """
        turn = turn_of(angle_rad)
        turned = self.positions @ turn.T
        reach = np.clip(0.4 * self.passage.at(self.positions), 1.0, most)
        reach[self.kinds >= DOOR] = np.minimum(reach[self.kinds >= DOOR], most / 4)
        aim = [aligned(turned, self.edges, reach, axis, most) for axis in (0, 1)]
        self.move(np.stack(aim, axis=1) @ turn)

    def move(self, aim: FloatArray) -> None:
        """Move nodes, float64 (n, 2), where all their edges keep their room."""
        start, aim = self.positions, settled(aim)
        now = np.where(self._is_free(aim)[:, None], aim, start)
        want = np.minimum(self.passage.comfort, _KEPT * self.least(start, self.edges))
        while True:
            back = np.unique(self.edges[self.least(now, self.edges) < want])
            back = back[(now[back] != start[back]).any(axis=1)]
            if not len(back):
                break
            now[back] = start[back]
        self.positions = now

    def simplify(self, near: float, longest: float) -> None:
        """Merge nodes that are near each other, and drop bends that edges can do without.

        `near`: distance in cells below which nodes without a purpose are merged with others;
        `longest`: length of the longest edge that a dropped bend may leave, in cells.
        """
        beside = self.neighbours()
        waiting = list(beside)
        while waiting:
            node = waiting.pop()
            if node not in beside:
                continue
            changed = self._merged(node, beside, near) or self._dropped(node, beside, longest)
            waiting += sorted(changed)
        nodes = np.array(sorted(beside), dtype=np.int64)
        index = {node: k for k, node in enumerate(nodes.tolist())}
        self.positions, self.kinds = self.positions[nodes], self.kinds[nodes]
        self.set_edges([(index[one], index[other]) for one in beside for other in beside[one]])

    def neighbours(self) -> dict[int, set[int]]:
        """Return the nodes next to each node."""
        beside: dict[int, set[int]] = {node: set() for node in range(len(self.positions))}
        for one, other in self.edges.tolist():
            if one != other:
                beside[one].add(other)
                beside[other].add(one)
        return beside

    def _merged(self, node: int, beside: dict[int, set[int]], near: float) -> set[int]:
        """Merge a node with the nearest neighbour that can take its edges over."""
        if self.kinds[node] > END:
            return set()
        at, comfort = self.positions, self.passage.comfort
        gaps = {other: dist(at[node], at[other]) for other in beside[node]}
        for other in sorted(gaps, key=lambda k: (gaps[k], k)):
            rest = sorted(beside[node] - {other})
            if gaps[other] > near or beside[other] & set(rest):
                continue
            pairs = np.array([(k, one) for k in (node, other) for one in rest], dtype=np.int64)
            least = self.least(at, pairs.reshape(-1, 2)).reshape(2, -1)
            if (least[1] < np.minimum(comfort, _MERGED * least[0])).any():
                continue
            self.kinds[other] = max(self.kinds[node], self.kinds[other])
            for one in rest:
                beside[one].add(other)
                beside[other].add(one)
            _remove(node, beside)
            return {other, *rest}
        return set()

    def _dropped(self, node: int, beside: dict[int, set[int]], longest: float) -> set[int]:
        """Drop a bend if its neighbours can be joined."""
        if self.kinds[node] != NOTHING or len(beside[node]) != 2:  # noqa: PLR2004
            return set()
        one, other = sorted(beside[node])
        at, comfort = self.positions, self.passage.comfort
        step = at[other] - at[one]
        length = hypot(*step)
        if other in beside[one] or not 0 < length <= longest:
            return set()
        off = abs(float((at[node] - at[one]) @ np.array([-step[1], step[0]]))) / length
        room = float(self.passage.at(at[node][None])[0])
        if off > max(0.3 * room, 1.0, room - comfort):
            return set()
        least = self.least(at, np.array([(one, other), (one, node), (node, other)]))
        if least[0] < min(comfort, _STRAIGHT * min(least[1:])):
            return set()
        _remove(node, beside)
        beside[one].add(other)
        beside[other].add(one)
        return {one, other}

    def keep(self, known: FloatArray, edges: LongArray, same: LongArray, near: float) -> None:
        """Keep a graph before where the robot can follow it, and add what it lacks.

        `known`: float64 (k, 2), the nodes of that graph; `edges`: int64 (m, 2), its edges; `same`:
        int64 (n,), which node of it each node is, -1 for none; `near`: distance in cells within
        which one of its nodes stands for a node that it sees.
        """
        from scipy.spatial import KDTree  # noqa: PLC0415 - on demand

        space, count = self.passage.space, len(known)
        is_free = self._is_free(known)
        edges = edges[is_free[edges].all(axis=1)]
        edges = edges[self.least(known, edges) >= 0]
        is_free[np.setdiff1d(np.arange(count), edges)] = False
        # A node stands for itself, for one before at its place, or for one before that is near.
        stands = np.where((same >= 0) & is_free[same], same, count + np.arange(len(same)))
        own, kept = np.flatnonzero(stands >= count), np.flatnonzero(is_free)
        if len(own) and len(kept):
            away, at = KDTree(known[kept]).query(self.positions[own])
            other = kept[np.asarray(at, dtype=np.int64)]
            sees = (np.asarray(away) <= near) & (same[own] < 0)
            sees[sees] = space.joins(self.positions[own[sees]], known[other[sees]])
            stands[own[sees]] = other[sees]
        kinds = np.full(count, NOTHING, dtype=np.int64)
        np.maximum.at(kinds, stands[stands < count], self.kinds[stands < count])
        new = stands[self.edges]
        both = np.concatenate([known, self.positions])
        new = new[(self.least(both, new) >= 0) & (new[:, 0] != new[:, 1])]
        self.positions, self.kinds = both, np.append(kinds, self.kinds)
        self.set_edges([*edges.tolist(), *self._lacking(edges, new)])
        self.keep_nodes(np.unique(np.append(self.edges, stands)))

    def keep_nodes(self, nodes: LongArray) -> None:
        """Keep some nodes, ascending, and the edges between them."""
        self.positions, self.kinds = self.positions[nodes], self.kinds[nodes]
        is_kept = np.isin(self.edges, nodes).all(axis=1)
        self.set_edges(np.searchsorted(nodes, self.edges[is_kept]).tolist())

    def freed(self, positions: FloatArray, most: float) -> FloatArray:
        """Move positions that are not free to free ones within a distance in cells: of those with
        the room that is asked for, or else the most, the nearest."""
        free, passage = self.passage.space.free, self.passage
        moved = positions.copy()
        for k in np.flatnonzero(~self._is_free(positions)).tolist():
            low = np.maximum(np.floor(positions[k] - most), 0).astype(np.int64)
            high = np.maximum(np.ceil(positions[k] + most), 0).astype(np.int64)
            spots = np.argwhere(free[low[0] : high[0], low[1] : high[1]]) + low + 0.5
            away = hypots(*(spots - positions[k]).T)
            spots, away = spots[away < most], away[away < most]
            if len(spots):
                room = np.minimum(passage.at(spots), passage.comfort)
                moved[k] = spots[np.lexsort((away, -room))[0]]
        return moved

    def _is_free(self, positions: FloatArray) -> BoolArray:
        free = self.passage.space.free
        inside = np.asarray(
            ((positions > 0) & (positions < free.shape)).all(axis=1), dtype=np.bool_
        )
        inside[inside] = free[tuple(positions[inside].astype(np.int64).T)]
        return inside

    def _lacking(self, edges: LongArray, new: LongArray) -> list[list[int]]:
        """Return the new edges without which some ways are twice as long, and that cross none."""
        at = self.positions
        beside: list[dict[int, float]] = [{} for _ in at]
        ways = [each.items() for each in beside]
        known = edges.tolist()
        for one, other in known:
            beside[one][other] = beside[other][one] = dist(at[one], at[other])
        added: list[list[int]] = []
        for one, other in new.tolist():
            length = dist(at[one], at[other])
            if length_between(ways.__getitem__, one, other, 2 * length) < math.inf:
                continue
            ends = np.array([*known, *added], dtype=np.int64).reshape(-1, 2)
            if not crosses(at[one], at[other], at[ends[:, 0]], at[ends[:, 1]]).any():
                added.append([one, other])
                beside[one][other] = beside[other][one] = length
        return added

    def add_points(self, points: FloatArray, near: float, within: BoolArray | None = None) -> None:
        """Add nodes at points, each joined to the nearest edge where that is in sight.

        `points`: float64 (k, 2); `near`: distance in cells from its ends, and from a point, within
        which an edge gets no node for the point: it is joined to the end, or led through the point;
        `within`: bool (rows, cols), the cells in which edges are joined, also to nodes that have
        some; None for all.
        """
        for node in self.add_nodes(points):
            if within is None and (self.edges == node).any():
                continue
            at = self.positions[node]
            tails = self.positions[self.edges[:, 0]]
            steps = self.positions[self.edges[:, 1]] - tails
            lengths = np.maximum((steps**2).sum(axis=1), 1e-9)
            along = np.clip(((at - tails) * steps).sum(axis=1) / lengths, 0, 1)
            feet = tails + along[:, None] * steps
            away = hypots(*(feet - at).T)
            order = np.argsort(away, kind="stable")
            if within is not None:
                order = order[within[tuple(feet[order].astype(np.int64).T)]]
                order = order[(self.edges[order] != node).all(axis=1)]
            for edge in order[:_TRIED].tolist():
                joined = self._stub(node, edge, feet[edge], near)
                if joined:
                    self.set_edges([*np.delete(self.edges, edge, axis=0).tolist(), *joined])
                    break

    def _stub(
        self, node: int, edge: int, foot: FloatArray, near: float
    ) -> list[tuple[int, int]] | None:
        """Return the edges that join a node to an edge and stand for it, None if none are free."""
        tail, head = self.edges[edge].tolist()
        at, ends = self.positions[node], self.positions[[tail, head]]
        joins = self.passage.space.joins
        if dist(at, foot) <= near and joins(np.stack([at, at]), ends).all():
            return [(tail, node), (node, head)]
        gaps = hypots(*(ends - foot).T)
        if gaps.min() > near:
            foot = settled(foot[None])
            if self._is_free(foot)[0]:
                spots = np.repeat(foot, 3, axis=0)
                if joins(spots, np.concatenate([ends, at[None]])).all():
                    (new,) = self.add_nodes(foot)
                    return [(tail, new), (new, head), (new, node)]
        for end in np.argsort(gaps, kind="stable").tolist():
            if joins(at[None], ends[[end]])[0]:
                return [(tail, head), (node, (tail, head)[end])]
        return None

    def split(self, longest: float) -> None:
        """Divide edges into equal ones of about a length in cells at most."""
        edges: list[Sequence[int]] = []
        for tail, head in self.edges.tolist():
            start, end = self.positions[[tail, head]]
            parts = max(1, math.ceil(dist(start, end) / longest - 0.2))
            along = np.arange(1, parts)[:, None] / parts
            inner = settled(start + (end - start) * along)
            line = np.concatenate([start[None], inner, end[None]])
            is_free = parts > 1 and bool(self.passage.space.joins(line[:-1], line[1:]).all())
            edges += self.add_path(tail, head, inner) if is_free else [(tail, head)]
        self.set_edges(edges)

    def unify(self) -> None:
        """Make one node of those at one place."""
        first = {tuple(at): node for node, at in reversed([*enumerate(self.positions.tolist())])}
        index = np.array([first[tuple(at)] for at in self.positions.tolist()], dtype=np.int64)
        np.maximum.at(self.kinds, index, self.kinds)
        kept = np.unique(index)
        self.positions, self.kinds = self.positions[kept], self.kinds[kept]
        self.set_edges(np.searchsorted(kept, index[self.edges]).tolist())

    def make_plane(self) -> None:
        """Put a node wherever edges cross or touch, or leave out an edge that is not needed.

        Nodes at one place become one.
        """
        self.unify()
        for _ in range(_ROUNDS + 4 * len(self.edges)):
            found = crossing(self.positions, self.edges, _TOUCHING)
            if found is None:
                return
            self._part(*found)

    def _part(self, which: list[int], at: FloatArray) -> None:
        """Lead edges through a common node, or leave the longest out that is not needed; those of
        doors come last."""
        space, there = self.passage.space, np.flatnonzero((self.positions == at).all(axis=1))
        ends = np.unique(self.edges[which]).tolist()
        rest = np.delete(self.edges, which, axis=0).tolist()
        near = np.floor(
            at + np.array([(down, right) for down in (-1, 1) for right in (-1, 1)]) / 512
        )
        aims = (
            self.positions[there] if len(there) else np.concatenate([settled(at[None]), near + 0.5])
        )
        aims = aims[self._is_free(aims)]
        for aim in aims:
            spots = np.repeat(aim[None], len(ends), axis=0)
            if space.joins(spots, self.positions[ends]).all():
                (node,) = self.add_nodes(aim[None])
                self.set_edges([*rest, *((node, end) for end in ends)])
                return
        lengths = np.diff(self.positions[self.edges[which]], axis=1)[:, 0]
        is_door = self.kinds[self.edges[which]].max(axis=1) >= DOOR
        for k in np.lexsort((-hypots(*lengths.T), is_door)).tolist():
            edges = np.delete(self.edges, which[k], axis=0).tolist()
            beside: list[dict[int, float]] = [{} for _ in self.positions]
            ways = [each.items() for each in beside]
            for one, other in edges:
                beside[one][other] = beside[other][one] = 1.0
            tail, head = self.edges[which[k]].tolist()
            if length_between(ways.__getitem__, tail, head, math.inf) < math.inf:
                self.set_edges(edges)
                return
        # Both are needed, and no straight edges lead there: paths do.
        (node,) = self.add_nodes(aims[-1:])
        spots = np.repeat(self.positions[node][None], len(ends), axis=0)
        paths = space.paths(spots, self.positions[ends])
        for end, line in zip(ends, np.split(paths.positions, paths.path_start[1:-1]), strict=True):
            rest += self.add_path(node, end, space.joinable(line)[1:-1])
        self.set_edges(rest)


def _remove(node: int, beside: dict[int, set[int]]) -> None:
    for other in beside.pop(node):
        beside[other].discard(node)
