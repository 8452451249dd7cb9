"""The walk through the topological map that a cell path makes."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hybridnav._typing import LongArray
    from hybridnav.topology import Rooms, TopologicalMap


class Walks:
    """Finds the places and arcs that paths pass.

    Parameters
    ----------
    topology
        The map, or its rooms; where its arcs cross is computed here, once.
    """

    def __init__(self, topology: TopologicalMap | Rooms) -> None:
        self._cols = topology.grid.shape[1]
        self._place_of = topology.level.field_of.ravel()
        edges, arcs = topology.level.boundary_table
        plain = ~topology.level.is_self_loop[arcs]
        order = np.argsort(edges[plain], kind="stable")
        self._edges, self._arcs = edges[plain][order], arcs[plain][order]

    def of(self, cells: LongArray) -> tuple[list[int], list[int]]:
        """Places and arcs of a path, as dense indices; one arc fewer than places.

        Parameters
        ----------
        cells
            int64 (n, 2), legal moves without corner cutting. A diagonal between two places passes
            one of its side cells: one that lies in either place if there is one.
        """
        places, arcs, _ = self.crossings(cells)
        return places, arcs

    def crossings(self, cells: LongArray) -> tuple[list[int], list[int], list[int]]:
        """Places and arcs of a path, as `of` gives them, and the step that crosses each arc: from
        `cells[step]` to the next."""
        steps: list[int] = []
        flat = cells[:, 0] * self._cols + cells[:, 1]
        place = self._place_of[flat]
        places, arcs = [int(place[0])], []
        for step in np.flatnonzero(place[1:] != place[:-1]).tolist():
            way = [int(flat[step]), int(flat[step + 1])]
            if (cells[step] != cells[step + 1]).all():
                way.insert(1, self._side(cells[step].tolist(), cells[step + 1].tolist()))
            for tail, head in itertools.pairwise(way):
                if self._place_of[tail] != self._place_of[head]:
                    edge = 2 * min(tail, head) + (abs(head - tail) != 1)
                    arcs.append(int(self._arcs[np.searchsorted(self._edges, edge)]))
                    places.append(int(self._place_of[head]))
                    steps.append(step)
        return places, arcs, steps

    def _side(self, tail: list[int], head: list[int]) -> int:
        ends = {int(self._place_of[cell[0] * self._cols + cell[1]]) for cell in (tail, head)}
        sides = tail[0] * self._cols + head[1], head[0] * self._cols + tail[1]
        return next((side for side in sides if int(self._place_of[side]) in ends), sides[0])
