"""Labels of cells on a jump-point graph, for tables of distances: shortest octile paths."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.moves import FAR, length_in_cells
from hybridnav.search.distance_table import BLOCK, climbing_room
from hybridnav.search.octile.jumps import JumpSearch, build_jump_graph, contract_graph
from hybridnav.search.octile.kernels.ends import direct_costs, labels_of_cells

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, LongArray
    from hybridnav.search.distance_table import Ends, Labels


class JumpLabels:
    """Labels of cells in a contracted jump-point graph: shortest octile paths.

    `search`: a search on a contracted graph.
    """

    most = BLOCK

    def __init__(self, search: JumpSearch) -> None:
        graph = search.graph
        self._tables, self._places = search.arrays.tables, search.arrays.places
        kinds = (graph.places & 15).astype(np.uint8)
        self._hierarchy = kinds, graph.first, graph.arcs, search.arrays.follow
        self._origin, self.n_corners = graph.origin, graph.n_corners

    def placed(self, ends: Ends) -> LongArray:
        """Return flat cells in the framed rectangle."""
        return (ends[0] - np.array(self._origin)) @ np.array([self._tables[3], 1])

    def labels(self, ends: LongArray) -> Labels:
        """Return the labels of ends."""
        work = climbing_room(self.n_corners)
        return labels_of_cells(self._tables, self._places, self._hierarchy, ends, work)

    goal_labels = labels

    def direct(self, starts: LongArray, goals: LongArray, table: LongArray) -> None:
        """Set the entries of cells with one free leg between them."""
        direct_costs(self._tables, starts, goals, table)

    def lengths(self, table: LongArray) -> FloatArray:
        """Return costs as lengths in cells."""
        found = np.full(table.shape, np.inf)
        reached = table < FAR
        found[reached] = length_in_cells(table[reached])
        return found


def jump_labels(free: BoolArray) -> JumpLabels | None:
    """Build a contracted graph of free cells, bool (rows, cols), for labels; None where contraction
    takes too long."""
    graph = contract_graph(build_jump_graph(free))
    return JumpLabels(JumpSearch(graph)) if graph.is_contracted else None
