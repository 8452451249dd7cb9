"""Cheapest walks on the arcs of a graph, parallel arcs allowed: Dijkstra's algorithm."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav.route.kernels import arcs as _kernels

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray


@dataclass(frozen=True, eq=False)
class ArcWalk:
    """Outcome of a search: vertices in the order passed, and the arcs between them.

    Both are None if no walk joins start and goal.
    """

    vertices: LongArray | None
    arcs: LongArray
    expanded: int


@copies_alike
class ArcSearch:
    """Search of an undirected graph for the cheapest walks.

    Parameters
    ----------
    allowed
        bool (n_vertices,), the vertices that walks may pass.
    arcs
        int (n_arcs, 2), the vertices that each arc joins.
    costs, ties
        float64 (n_arcs,), the cost of an arc, and a second cost that decides between walks of equal
        cost; >= 0, any unit.
    kept
        Indices of the arcs that walks may use; None for all.
    """

    def __init__(
        self,
        allowed: BoolArray,
        arcs: IntArray | LongArray,
        costs: FloatArray,
        ties: FloatArray,
        *,
        kept: LongArray | None = None,
    ) -> None:
        used = np.arange(len(arcs)) if kept is None else kept
        tail = np.concatenate([arcs[used, 0], arcs[used, 1]])
        order = np.argsort(tail, kind="stable")
        self._first = np.searchsorted(tail[order], np.arange(len(allowed) + 1))
        head = np.concatenate([arcs[used, 1], arcs[used, 0]])
        self._neighbour = head[order].astype(np.int64)
        self._arc = np.tile(used, 2)[order]
        self._arcs = arcs
        self._costs, self._ties = costs, ties
        self._allowed = allowed

    @property
    def n_vertices(self) -> int:
        """Number of vertices, including those that may not be passed."""
        return len(self._allowed)

    def search(self, start: int, goal: int) -> ArcWalk:
        """Find the cheapest walk between two vertices that may be passed."""
        arcs, reached, expanded = _kernels.cheapest_arcs(
            self._first,
            self._neighbour,
            self._arc,
            self._costs,
            self._ties,
            self._allowed,
            start,
            goal,
        )
        if not reached:
            return ArcWalk(None, arcs, int(expanded))
        vertices = [start]
        for u, v in self._arcs[arcs].tolist():
            vertices.append(v if u == vertices[-1] else u)
        return ArcWalk(np.array(vertices, dtype=np.int64), arcs, int(expanded))
