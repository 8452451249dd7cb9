"""Routes, the topological answer to a query: the places and arcs that a cell path passes, and the
corridor of receptive fields in which a refiner may stand.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.typing import BoolArray, IntArray, LongArray

if TYPE_CHECKING:  # a result is read where there is no map
    from hybridnav.pyramid import Level
    from hybridnav.rooms import Rooms
    from hybridnav.topology import TopologicalMap


@dataclass(frozen=True)
class Route:
    """The topological answer: the places passed and the arcs between them.

    Examples
    --------
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> planner = hn.HybridPlanner(hn.TopologicalMap(pyramid))
    >>> planner.plan((0.5, 0.5), (2.0, 2.5)).route
    Route(places=(2, 0, 5, 9), arcs=(0, 3, 11))
    """

    places: tuple[int, ...]
    """Ids of the places, from that of the start to that of the goal, one for each visit but grazes
    of a border (`docs/reference/results.md`)."""
    arcs: tuple[int, ...]
    """Ids of the arcs, one fewer than places; -1 for a step between two occupied cells, if corners
    may be cut."""


_GRAZE = 10
"""Most cells of a visit that does not count if it leaves by the arc it came by."""


@copies_alike
class RouteFinder:
    """The places and arcs that paths pass.

    A visit of at most ten cells that leaves by the arc it came by is left out: a straight line cuts
    the teeth of a border.

    Parameters
    ----------
    topology
        The map, or its rooms; where its arcs cross is computed at the first path.

    Examples
    --------
    >>> from hybridnav.route import RouteFinder
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(np.zeros((1, 30))))
    >>> finder = RouteFinder(hn.TopologicalMap(pyramid))
    >>> finder.of(np.array([[0, col] for col in range(30)]))
    ([0, 1, 2, 3, 4, 5, 6], [0, 1, 2, 3, 4, 5])
    """

    def __init__(self, topology: TopologicalMap | Rooms) -> None:
        self._topology, self._cols = topology, topology.grid.shape[1]

    @cached_property
    def _level(self) -> Level:
        return self._topology.level  # that of a version is made here

    @cached_property
    def _place_of(self) -> IntArray:
        return self._level.field_of.ravel()

    @cached_property
    def _table(self) -> tuple[LongArray, LongArray]:
        """Return the base edges between different places, ascending, and the arc of each."""
        edges, arcs = self._level.boundary_table
        plain = ~self._level.is_self_loop[arcs]
        order = np.argsort(edges[plain], kind="stable")
        return edges[plain][order], arcs[plain][order]

    def of(self, cells: LongArray) -> tuple[list[int], list[int]]:
        """Return places and arcs of a path, as dense indices; one arc fewer than places.

        Parameters
        ----------
        cells
            int64 (n, 2), legal moves. A diagonal between two places passes one of its side cells:
            one that lies in either place if there is one. Where corners may be cut and both side
            cells are occupied, it crosses no boundary: its arc is -1.
        """
        places, arcs, _ = self.crossings(cells)
        return places, arcs

    def crossings(self, cells: LongArray) -> tuple[list[int], list[int], list[int]]:
        """Return the result of `of`, and the step that crosses each arc, the first one if grazes
        follow: from `cells[step]` to the next cell."""
        steps: list[int] = []
        flat = cells[:, 0] * self._cols + cells[:, 1]
        place = self._place_of[flat]
        places, arcs = [int(place[0])], []
        for step in np.flatnonzero(place[1:] != place[:-1]).tolist():
            flat_cells = [int(flat[step]), int(flat[step + 1])]
            side_cell = self._side_cell(cells[step].tolist(), cells[step + 1].tolist())
            if side_cell is not None:
                flat_cells.insert(1, side_cell)
            for tail, head in itertools.pairwise(flat_cells):
                if self._place_of[tail] != self._place_of[head]:
                    arcs.append(self._arc_between(tail, head))
                    places.append(int(self._place_of[head]))
                    steps.append(step)
                    is_back = len(arcs) > 1 and arcs[-1] == arcs[-2] >= 0
                    if is_back and step - steps[-2] <= _GRAZE:
                        del places[-2:], arcs[-2:], steps[-2:]
        return places, arcs, steps

    def _arc_between(self, tail: int, head: int) -> int:
        """Return the arc whose boundary lies between two neighbours; -1 if they meet at a
        corner."""
        (row, col), (to_row, to_col) = divmod(tail, self._cols), divmod(head, self._cols)
        if row != to_row and col != to_col:
            return -1
        edge = 2 * min(tail, head) + (row != to_row)
        edges, arcs = self._table
        return int(arcs[np.searchsorted(edges, edge)])

    def _side_cell(self, tail: list[int], head: list[int]) -> int | None:
        """Return the side cell that a diagonal passes; None if both are occupied, and for a step
        along a side."""
        if tail[0] == head[0] or tail[1] == head[1]:
            return None
        endpoints = {int(self._place_of[cell[0] * self._cols + cell[1]]) for cell in (tail, head)}
        side_cells = tail[0] * self._cols + head[1], head[0] * self._cols + tail[1]
        passable = [side_cell for side_cell in side_cells if self._place_of[side_cell] >= 0]
        own = (side_cell for side_cell in passable if int(self._place_of[side_cell]) in endpoints)
        return next(own, passable[0] if passable else None)


def route_of_cells(topology: TopologicalMap, finder: RouteFinder, cells: LongArray) -> Route:
    """Return the ids of the places and arcs that a path passes; `cells`: int64 (n, 2), legal
    moves."""
    places, arcs = finder.of(cells)
    place_ids, arc_ids = topology.place_ids, topology.arc_ids
    passed = [int(arc_ids[arc]) if arc >= 0 else -1 for arc in arcs]
    return Route(tuple(place_ids[places].tolist()), tuple(passed))


def route_of_places(topology: TopologicalMap, places: IntArray) -> Route:
    """Return the route of some places, int32 (n,), dense indices, an arc from each to the next: of
    parallel ones that with the least `through_m`."""
    level, ids = topology.level, topology.arc_ids
    ends = np.sort(level.arcs, axis=1)
    chosen = []
    for pair in itertools.pairwise(places.tolist()):
        arcs = np.flatnonzero((ends == sorted(pair)).all(axis=1))
        # The lengths through all arcs take a search of the whole map.
        best = arcs[np.argmin(level.through_m[arcs])] if len(arcs) > 1 else arcs[0]
        chosen.append(int(ids[best]))
    return Route(tuple(topology.place_ids[places].tolist()), tuple(chosen))


@dataclass(frozen=True, eq=False)
class Corridor:
    """Union of the receptive fields of some places. Moves are judged on the whole grid: a corridor
    limits only the cells stood on."""

    field_of: IntArray
    """int32 (rows, cols), the place of each cell."""
    places: BoolArray
    """bool (n_places,), those in the corridor."""
    n_cells: int
    """Number of cells in the corridor."""

    def mask(self) -> BoolArray:
        """Return the cells in the corridor, bool (rows, cols)."""
        return (self.field_of >= 0) & self.places[self.field_of]
