"""The jump-point graph of free cells, and the hierarchy that contraction makes of it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import copies_alike
from hybridnav.jumps._join_kernels import arcs_of, components
from hybridnav.jumps._leg_kernels import COLUMN_BITS, KIND_BITS, legs_that_follow
from hybridnav.jumps._table_kernels import look_ahead, number_cells
from hybridnav.search._contract_kernels import contract

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray, IntArray, LongArray

_SHORT = 32_000
"""Longest side of a map whose distances fit 16 bits."""
_SETTLED = 10
"""Corner cells that a search for another way settles at most when the graph is contracted. With 80
there are 1 to 3 % fewer shortcuts, and it takes four times as long."""
_NO_LIMIT = 1 << 62
"""More arcs than any contraction looks at."""


@copies_alike
@dataclass(frozen=True, eq=False)
class JumpGraph:
    """Corner cells, arcs between those with no other one on their way, and what each cell sees.

    A corner cell has a blocked cell at one of its corners and is free beside that one: there
    shortest paths turn. An arc is a leg: moves along one diagonal and one side next to it, which
    may come in any order. Cells are those of the smallest rectangle that holds all free ones, in a
    frame of blocked ones; a flat cell is its place in there.
    """

    origin: tuple[int, int]
    """Row and column of the frame's first cell."""
    width: int
    """Columns of the framed rectangle."""
    number: IntArray
    """int32 (c,), the number of each flat cell, those of corner cells first; -1 for a blocked
    one."""
    ahead: NDArray[np.int16 | np.int32]
    """int16 or int32 (n_free, 8), by number and direction: along a side the distance to the next
    corner cell, along a diagonal to the next cell that is one or sees one along a side; where there
    is none, minus the moves that are legal."""
    places: LongArray
    """int64 (n,), row and column in the frame of each corner cell and its blocked corners."""
    first: IntArray
    """int32 (n + 1,), where the arcs of each corner cell begin."""
    arcs: LongArray
    """int64 (m, 2), the cost of each arc in the units of `hybridnav.search`, its head and the class
    of its leg."""
    component: IntArray
    """int32 (n,), the connected part of the graph that each corner cell belongs to."""

    @property
    def n_corners(self) -> int:
        """Number of corner cells."""
        return len(self.places)

    @property
    def memory_bytes(self) -> int:
        """Bytes of its arrays."""
        arrays = self.number, self.ahead, self.places, self.first, self.arcs, self.component
        return sum(array.nbytes for array in arrays)


@copies_alike
@dataclass(frozen=True, eq=False)
class JumpHierarchy:
    """The graph contracted: arcs from each corner cell to those that were contracted after it."""

    first: IntArray
    """int32 (n + 1,), where the arcs of each corner cell begin."""
    arcs: LongArray
    """int64 (u, 2), as `JumpGraph.arcs`; classes of the first leg, and of the last backwards."""
    middles: IntArray
    """int32 (u,), the corner cell that a shortcut leads past, -1 for an arc of the graph."""

    @property
    def memory_bytes(self) -> int:
        """Bytes of its arrays."""
        return self.first.nbytes + self.arcs.nbytes + self.middles.nbytes


def build_jump_graph(free: BoolArray) -> JumpGraph:
    """Build the jump-point graph of free cells.

    Parameters
    ----------
    free
        bool (rows, cols); what lies outside is blocked.

    Returns
    -------
    JumpGraph
        Without a corner cell where no path turns. Work and memory are linear in cells, but for the
        arcs.

    Notes
    -----
    D. Harabor, T. Uras, P. Stuckey, S. Koenig: Regarding jump point search and subgoal graphs,
    2019. T. Uras, S. Koenig, C. Hernández: Subgoal graphs for optimal pathfinding in eight-neighbor
    grids, 2013 (arcs where no other corner cell lies between).
    """
    rows, cols = (np.flatnonzero(free.any(axis=axis)) for axis in (1, 0))
    low = (int(rows[0]), int(cols[0])) if len(rows) else (0, 0)
    high = (int(rows[-1]) + 1, int(cols[-1]) + 1) if len(rows) else (0, 0)
    inside = np.ascontiguousarray(free[low[0] : high[0], low[1] : high[1]])
    width = inside.shape[1] + 2
    number, corners, kinds = number_cells(inside)
    distances = np.int16 if max(inside.shape) <= _SHORT else np.int32
    ahead = np.empty((int(number.max()) + 1, 8), dtype=distances)
    look_ahead(number, width, len(corners), ahead)
    row, col = np.divmod(corners.astype(np.int64), width)
    places = (row << COLUMN_BITS | col) << KIND_BITS | kinds
    first, arcs = arcs_of((number, ahead, width, len(corners)), corners, places)
    arrays = (number, ahead, places, first, arcs, components(first, arcs))
    for array in arrays:
        array.flags.writeable = False
    return JumpGraph((low[0] - 1, low[1] - 1), width, *arrays)


def contract_graph(graph: JumpGraph) -> JumpHierarchy:
    """Contract a jump-point graph into a hierarchy, which makes queries several times faster.

    Parameters
    ----------
    graph
        The graph, which stays as it is.

    Notes
    -----
    R. Geisberger, P. Sanders, D. Schultes, D. Delling: Contraction hierarchies: faster and simpler
    hierarchical routing in road networks, 2008.
    """
    kinds = (graph.places & (1 << KIND_BITS) - 1).astype(np.uint8)
    arrays = contract(kinds, graph.first, graph.arcs, legs_that_follow(), (_SETTLED, _NO_LIMIT))
    for array in arrays:
        array.flags.writeable = False
    return JumpHierarchy(*arrays)
