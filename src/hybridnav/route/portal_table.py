"""Routes by a table of distances between portals, and their cell paths from stored directions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from hybridnav.errors import InvalidValueError
from hybridnav.search._costs import STRAIGHT
from hybridnav.topology import _portal_kernels as kernels
from hybridnav.topology.portals import STEPS_PER_CELL, Portals

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import LongArray

    FloatArray32 = NDArray[np.float32]
    ShortArray = NDArray[np.int16]

MAX_PORTALS = 8000
"""A table grows with the square of the portals: this many make 400 MB, and 1 GB on the way."""


@dataclass(frozen=True, eq=False)
class PortalRoute:
    """The shortest way over portals between two cells of different fields."""

    portals: LongArray
    """int64 (n,), portals in the order passed."""
    cells: LongArray
    """int64 (m,), flat cells of the path, from start to goal."""


class PortalTable:
    """Distances between all portals of a map, and the next portal on each shortest way.

    Parameters
    ----------
    portals
        At most `MAX_PORTALS`.

    Raises
    ------
    InvalidValueError
        When there are more.
    """

    def __init__(self, portals: Portals, cols: int) -> None:
        if portals.n_portals > MAX_PORTALS:
            raise InvalidValueError(
                f"a table of {portals.n_portals} portals is too large, at most {MAX_PORTALS}: "
                "take larger fields or a wider spacing"
            )
        self.portals = portals
        self._cols = cols
        self._across = portals.cost[portals.side_portal] * portals.side_is_high
        self._lift = (self._across * (STEPS_PER_CELL / STRAIGHT)).astype(np.float32)
        self._length, self._before = self._table()
        order = np.lexsort((portals.side_is_high, portals.side_portal))
        self._sides = order.reshape(-1, 2)
        self._cells = np.stack([portals.low_cell, portals.high_cell], axis=1)

    @property
    def memory_bytes(self) -> int:
        """Of the table and the portals' fields."""
        own = self._length.nbytes + self._before.nbytes
        return own + sum(int(array.nbytes) for array in vars(self.portals).values())

    def _table(self) -> tuple[FloatArray32, ShortArray]:
        """Lengths in steps between the lower sides, and the portal before the last."""
        portals = self.portals
        counts = np.diff(portals.between_start)
        tail = np.repeat(np.arange(len(counts)), counts)
        field = np.repeat(np.arange(portals.n_fields), np.diff(portals.side_start))
        head = portals.side_start[field[tail]] + np.arange(len(tail)) - portals.between_start[tail]
        known = (portals.between < np.iinfo(np.int32).max) & (tail != head)
        tail, head = tail[known], head[known]
        cost = portals.between[known] + self._across[tail] + self._across[head]
        one, other = portals.side_portal[tail], portals.side_portal[head]
        order = np.lexsort((cost, other, one))
        one, other, cost = one[order], other[order], cost[order]
        best = np.ones(len(order), dtype=np.bool_)
        best[1:] = (np.diff(one) != 0) | (np.diff(other) != 0)
        n = portals.n_portals
        if n == 0:
            return np.empty((0, 0), dtype=np.float32), np.empty((0, 0), dtype=np.int16)
        edges = (cost[best].astype(np.float64), (one[best], other[best]))
        graph = sparse.coo_array(edges, shape=(n, n)).tocsr()
        length, before = csgraph.dijkstra(graph, return_predecessors=True)
        steps = (length * (STEPS_PER_CELL / STRAIGHT)).astype(np.float32)
        return steps, before.astype(np.int16)

    def route(self, start: int, goal: int) -> PortalRoute | None:
        """Shortest way over portals from a cell to another.

        Parameters
        ----------
        start, goal
            Flat free cells. Between cells of one field it leads over a portal too, which is a
            detour unless the shortest path leaves the field.

        Returns
        -------
        PortalRoute or None
            None where no portals join them.
        """
        portals = self.portals
        first, last = self._sides_of(start), self._sides_of(goal)
        i, j, steps = kernels.best_portals(
            portals.side_portal[first],
            self._steps(first, start),
            portals.side_portal[last],
            self._steps(last, goal),
            self._length,
        )
        if i < 0:
            return None
        origin = portals.side_portal[first][i]
        passed = [int(portals.side_portal[last][j])]
        while passed[-1] != origin:
            passed.append(int(self._before[origin, passed[-1]]))
        way = np.array(passed[::-1], dtype=np.int64)
        # No move is shorter than a cell; each leg begins anew, and its length is rounded.
        path = np.empty(int(steps / STEPS_PER_CELL) + 3 * len(way) + 4, dtype=np.int64)
        count = kernels.way(
            start,
            goal,
            self._cols,
            portals.field_of,
            portals.place_in_field,
            way,
            self._sides,
            self._cells,
            portals.offset,
            portals.towards,
            path,
            self._across,
            portals.side_start,
            portals.between,
            portals.between_start,
        )
        return PortalRoute(way, path[:count])

    def _sides_of(self, cell: int) -> slice:
        field = self.portals.field_of[cell]
        return slice(*self.portals.side_start[field : field + 2])

    def _steps(self, sides: slice, cell: int) -> FloatArray32:
        """Steps from a cell to the lower side of each portal of its field."""
        at = self.portals.offset[:-1][sides] + self.portals.place_in_field[cell]
        reached = self.portals.towards[at] != kernels.UNREACHED
        steps = np.where(reached, self.portals.steps[at].astype(np.float32), np.float32(np.inf))
        for far in np.flatnonzero(steps == kernels.FARTHEST):
            steps[far] = kernels.steps_to_source(
                self.portals.towards,
                self.portals.offset[:-1][sides][far],
                self.portals.place_in_field,
                self._cols,
                cell,
            )
        return steps + self._lift[sides]
