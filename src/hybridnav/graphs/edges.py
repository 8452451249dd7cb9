"""Edges of a route graph: a spanner of sight, joined wherever free space is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.graphs._spanner_kernels import spanner
from hybridnav.graphs.checked_components import components_of

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, LongArray
    from hybridnav.graphs.nodes import Nodes

_NEAREST = 200
"""Number of nearest nodes to which a node may have edges."""
_MOST_NODES = 1 << 31
"""More than any number of nodes, so that two nodes make one number."""
_TRIED = 8
"""Nearest nodes of other parts that are tried as partners of a part without connection."""


class SightPairs:
    """Which nodes near each other edges may join; a pair is tested once, while nodes are added."""

    def __init__(self, nodes: Nodes) -> None:
        self._nodes = nodes
        self._keys = np.empty(0, dtype=np.int64)
        self._seen = np.empty(0, dtype=np.bool_)

    def among(self, needed: LongArray) -> LongArray:
        """Return the pairs that edges may join among the nearest nodes of each.

        Parameters
        ----------
        needed
            int64 (k, 2), pairs in sight that count although others are nearer.

        Returns
        -------
        LongArray
            int64 (m, 2), lower node first.
        """
        from scipy.spatial import KDTree  # noqa: PLC0415 - most uses of the package need no graph

        positions = self._nodes.positions
        near = min(_NEAREST, len(positions) - 1)
        heads = np.asarray(KDTree(positions).query(positions, k=list(range(2, near + 2)))[1])
        tails = np.repeat(np.arange(len(positions)), near)
        pairs = np.stack([tails, heads.ravel()], axis=1).astype(np.int64)
        pairs = np.concatenate([pairs, needed])
        # One sorted number a pair: rows take ten times as long, and unique three times.
        keys = np.sort(pairs.min(axis=1) * _MOST_NODES + pairs.max(axis=1))
        keys = keys[np.diff(keys, prepend=-1) > 0]
        tails, heads = np.divmod(keys, _MOST_NODES)
        seen = np.zeros(len(keys), dtype=np.bool_)
        at = np.searchsorted(self._keys, keys)
        is_known = at < len(self._keys)
        is_known[is_known] = self._keys[at[is_known]] == keys[is_known]
        seen[is_known] = self._seen[at[is_known]]
        new = ~is_known
        seen[new] = self._nodes.space.joins(positions[tails[new]], positions[heads[new]])
        self._keys, self._seen = keys, seen
        return np.stack([tails[seen], heads[seen]], axis=1)


def sight_edges(nodes: Nodes, known: SightPairs, stretch: float, needed: LongArray) -> LongArray:
    """Choose edges between nodes in sight of each other.

    Parameters
    ----------
    nodes
        The nodes.
    known
        The pairs of these nodes.
    stretch
        For two nodes in sight, a route over the chosen edges is at most this many times as long as
        the segment between them.
    needed
        int64 (k, 2), pairs in sight that count although others are nearer.

    Returns
    -------
    LongArray
        int64 (m, 2), lower node first, by length.

    Notes
    -----
    I. Althöfer, G. Das, D. Dobkin, D. Joseph, J. Soares: On sparse spanners of weighted graphs,
    1993 (the greedy spanner).
    """
    positions = nodes.positions
    if len(positions) < 2:  # noqa: PLR2004
        return np.empty((0, 2), dtype=np.int64)
    pairs = known.among(needed)
    steps = positions[pairs[:, 1]] - positions[pairs[:, 0]]
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    order = np.argsort(lengths, kind="stable")
    pairs, lengths = pairs[order], lengths[order]
    found: LongArray = pairs[spanner(positions, pairs, lengths, stretch)]
    return found


def missing_bends(nodes: Nodes, edges: LongArray) -> list[FloatArray]:
    """Find paths that join parts of a graph which free space connects.

    Parameters
    ----------
    nodes
        The nodes.
    edges
        The edges between them.

    Returns
    -------
    list of FloatArray
        For each part but the largest in its part of free space, positions on the shortest path to
        one of the nearest nodes of another part, (row, col) in grid units.
    """
    positions = nodes.positions
    part = components_of(len(positions), edges, "weak")
    component = nodes.space.components_at(positions)
    starts, goals = [], []
    for where in np.unique(component).tolist():
        inside = np.flatnonzero(component == where)
        parts, sizes = np.unique(part[inside], return_counts=True)
        for one in np.delete(parts, int(sizes.argmax())).tolist():
            mine, others = inside[part[inside] == one], inside[part[inside] != one]
            steps = positions[others][:, None] - positions[mine][None]
            away = (steps**2).sum(axis=2).min(axis=1)
            for other in others[np.argsort(away, kind="stable")[:_TRIED]].tolist():
                steps = positions[mine] - positions[other]
                starts.append(mine[int((steps**2).sum(axis=1).argmin())])
                goals.append(other)
    if not starts:
        return []
    paths = nodes.space.paths(positions[starts], positions[goals])
    best: dict[int, int] = {}
    for k, start in enumerate(starts):
        known = best.get(int(part[start]), k)
        best[int(part[start])] = min(known, k, key=lambda at: paths.length_cells[at])
    lines = np.split(paths.positions, paths.path_start[1:-1])
    return [nodes.space.joinable(lines[k]) for k in best.values()]
