"""Straight edges in the plane: how much room they have, ways over them, angles between them, and
where they cross."""

from __future__ import annotations

import heapq
import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.trig import cos, sin
from hybridnav.ext.graphs.kernels import least_along

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from hybridnav._base.typing import BoolArray, FloatArray, LongArray
    from hybridnav.ext.graphs.judge import FreeSpace

_SLOPE = 0.35
"""Slope up to which an edge counts as one along a main direction."""


def turn_of(angle_rad: float) -> FloatArray:
    """Return the matrix, float64 (2, 2), that turns a main direction into that of rows."""
    along, across = cos(angle_rad), sin(angle_rad)
    return np.array([[along, across], [-across, along]])


class Passage:
    """How much room positions and straight edges have."""

    def __init__(self, space: FreeSpace, clearance: FloatArray, comfort: float) -> None:
        self.space, self.comfort = space, comfort
        """Free space; the clearance that is asked for, in cells."""
        self._clearance = np.ascontiguousarray(clearance)

    def at(self, positions: FloatArray) -> FloatArray:
        """Return the clearance of positions in cells, float64 (n,)."""
        found: FloatArray = self._clearance[tuple(positions.astype(np.int64).T)]
        return found

    def least(self, tails: FloatArray, heads: FloatArray) -> FloatArray:
        """Return the least clearance of segments in cells, float64 (n,), -1 for those that the
        robot cannot follow."""
        found = np.full(len(tails), -1.0)
        fits = self.space.joins(tails, heads)
        ends = np.concatenate([tails[fits], heads[fits]])
        pairs = np.ascontiguousarray(np.arange(len(ends)).reshape(2, -1).T)
        found[fits] = least_along(self.space.free, self._clearance, ends, pairs)[0]
        return found


def length_between(
    neighbours: Callable[[int], Iterable[tuple[int, float]]], start: int, goal: int, limit: float
) -> float:
    """Return the length of the way between two nodes, infinite above a limit; `neighbours`
    returns the nodes next to a node, and how far they are."""
    costs = {start: 0.0}
    heap = [(0.0, start)]
    while heap:
        cost, here = heapq.heappop(heap)
        if here == goal:
            return cost
        for there, length in neighbours(here) if cost <= costs[here] else ():
            through = cost + length
            if through <= limit and through < costs.get(there, math.inf):
                costs[there] = through
                heapq.heappush(heap, (through, there))
    return math.inf


def is_beside(at: FloatArray, node: int, head: int, others: list[int], least_rad: float) -> bool:
    """Return whether an edge makes a smaller angle with another one of its node."""
    steps = at[[head, *others]] - at[node]
    steps /= np.maximum(np.hypot(steps[:, 0], steps[:, 1]), 1e-9)[:, None]
    return bool((steps[1:] @ steps[0] > cos(least_rad)).any())


def crosses(one: FloatArray, other: FloatArray, tails: FloatArray, heads: FloatArray) -> BoolArray:
    """Return which segments have a point in common with a segment, but no end; bool (m,)."""

    def side(first: FloatArray, second: FloatArray, third: FloatArray) -> FloatArray:
        step, away = second - first, third - first
        across = step[..., 0] * away[..., 1] - step[..., 1] * away[..., 0]
        found: FloatArray = np.sign(across)
        return found

    meets = side(tails, heads, one) * side(tails, heads, other) <= 0
    meets &= side(one, other, tails) * side(one, other, heads) <= 0
    low, high = np.minimum(tails, heads), np.maximum(tails, heads)
    meets &= ((np.maximum(one, other) >= low) & (np.minimum(one, other) <= high)).all(axis=1)
    for end in (one, other):
        meets &= ~((tails == end).all(axis=1) | (heads == end).all(axis=1))
    return np.asarray(meets, dtype=np.bool_)


def crossing(
    positions: FloatArray, edges: LongArray, touching: float
) -> tuple[list[int], FloatArray] | None:
    """Find two edges that cross, or one that a node lies on.

    Parameters
    ----------
    positions
        float64 (n, 2), the nodes.
    edges
        int64 (m, 2).
    touching
        Distance from an edge at which a node lies on it.

    Returns
    -------
    tuple
        One edge or two, and where, float64 (2,); None if there are none.
    """
    import shapely  # noqa: PLC0415 - on demand

    lines = np.asarray(shapely.linestrings(positions[edges]))
    tree = shapely.STRtree(list(lines))
    near, edge = tree.query(shapely.points(positions), predicate="dwithin", distance=touching)
    on = np.flatnonzero((edges[edge] != near[:, None]).all(axis=1))
    if len(on):
        return [int(edge[on[0]])], positions[near[on[0]]]
    one, other = tree.query(lines, predicate="crosses")
    apart = (edges[one][:, :, None] != edges[other][:, None]).all(axis=(1, 2))
    pairs = np.flatnonzero((one < other) & apart)
    if not len(pairs):
        return None
    pair = [int(one[pairs[0]]), int(other[pairs[0]])]
    point = shapely.intersection(lines[pair[0]], lines[pair[1]])
    return pair, shapely.get_coordinates(point)[0]


def aligned(
    turned: FloatArray, edges: LongArray, reach: FloatArray, axis: int, most: float
) -> FloatArray:
    """Return coordinates that are equal along the edges of one direction, float64 (n,).

    The longest edges come first; their nodes share a coordinate as long as all can reach it.
    """
    steps = abs(turned[edges[:, 1]] - turned[edges[:, 0]])
    along, off = steps[:, 1 - axis], steps[:, axis]
    fits = (off < _SLOPE * along) | ((off < most) & (along > 1.5 * off))
    group, value = np.arange(len(turned)), turned[:, axis]
    low, high = value - reach, value + reach
    members = [[node] for node in range(len(turned))]
    for edge in np.argsort(-along, kind="stable").tolist():
        one, other = group[edges[edge]].tolist()
        least, greatest = max(low[one], low[other]), min(high[one], high[other])
        if fits[edge] and one != other and least <= greatest:
            low[one], high[one] = least, greatest
            members[one] += members[other]
            group[members[other]] = one
    found = value.copy()
    for one in np.unique(group).tolist():
        found[members[one]] = np.clip(value[members[one]].mean(), low[one], high[one])
    return found
