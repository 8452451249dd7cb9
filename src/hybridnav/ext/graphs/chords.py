"""Fewer dead ends, and chords: edges that shorten long ways through a sketch."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import KDTree

from hybridnav.ext.graphs.sketch import END
from hybridnav.ext.graphs.strands import crosses, is_beside, length_between

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray
    from hybridnav.ext.graphs.sketch import Sketch

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

    Parameters
    ----------
    sketch
        The graph.
    reach
        Distance in cells within which positions see a dead end.
    far
        Distance within which they must see another node.
    step
        Cells between the positions that are looked at.
    """
    space, at, kinds = sketch.passage.space, sketch.positions, sketch.kinds
    spots: FloatArray = np.argwhere(space.free[::step, ::step]).astype(np.float64) * step + 0.5
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
        for other in others[np.hypot(steps[:, 0], steps[:, 1]) <= reach + far].tolist():
            steps = unseen - at[other]
            is_seen = np.hypot(steps[:, 0], steps[:, 1]) <= far
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

    Parameters
    ----------
    sketch
        The graph.
    reach
        Length of the longest chord in cells.
    detour
        Least length of that way, in lengths of the chord.
    least_rad
        Least angle between a chord and another edge of its nodes.
    """
    at, comfort = sketch.positions, sketch.passage.comfort
    pairs = KDTree(at).query_pairs(reach, output_type="ndarray").astype(np.int64)
    pairs = np.sort(pairs.reshape(-1, 2), axis=1)
    least = sketch.least(at, pairs)
    narrowest = max(sketch.least(at, sketch.edges).min(initial=comfort), _LEAST_ROOM * comfort)
    fits = least >= min(narrowest, _ROOM * comfort)
    pairs, saves = pairs[fits], np.where(least[fits] < _ROOM * comfort, _MUCH, detour)
    steps = at[pairs[:, 1]] - at[pairs[:, 0]]
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    beside: list[dict[int, float]] = [{} for _ in at]
    ways = [each.items() for each in beside]
    edges = sketch.edges.tolist()
    for one, other in edges:
        beside[one][other] = beside[other][one] = math.dist(at[one], at[other])
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
