"""Routes on the room level: from room to room through doors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.search.arc_search import ArcSearch

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, IntArray, LongArray
    from hybridnav.topology import Rooms


@dataclass(frozen=True)
class RoomRoute:
    """A route on the room level."""

    rooms: tuple[str | None, ...]
    """Names of the rooms passed, None for what lies in no room."""
    arcs: tuple[int, ...]
    """Arcs of the room level between them, one fewer than rooms."""


class RoomSearch:
    """Search of the room level for the routes that are shortest through the middles of rooms.

    An arc costs `through_m`, the length from the surviving cell of one room across its boundary to
    that of the next. That is no bound on a path from elsewhere, but there is a route wherever there
    is a path, for rooms are connected.

    Parameters
    ----------
    rooms
        The room level.
    allow_unexplored
        Whether unexplored parts may be passed.

    Examples
    --------
    >>> from hybridnav.route import RoomSearch
    >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0)
    >>> labels = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, 1, 1]]))
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    >>> RoomSearch(topology.rooms).search("kitchen", "hall").rooms
    ('kitchen', 'hall')
    """

    def __init__(self, rooms: Rooms, *, allow_unexplored: bool = False) -> None:
        level = rooms.level
        self._rooms = rooms
        self._allowed: BoolArray = rooms.is_free
        if allow_unexplored:
            self._allowed = np.ones_like(rooms.is_free)
        kept = np.flatnonzero(~level.is_self_loop & self._allowed[level.arcs].all(axis=1))
        self._part = _parts(level.arcs[kept], level.n_vertices)
        self._search = ArcSearch(
            self._allowed,
            level.arcs,
            level.through_m,
            np.zeros(level.n_arcs),
            kept=kept,
        )

    def search(self, start: str, goal: str) -> RoomRoute | None:
        """Find a route between two rooms.

        Parameters
        ----------
        start, goal
            Names of rooms. If a room has several parts, the largest that a route reaches counts.

        Returns
        -------
        RoomRoute | None
            None where no route joins them.

        Raises
        ------
        InvalidValueError
            When no room has such a name.
        """
        first, last = self._vertices_of(start), self._vertices_of(goal)
        joined = self._part[first][:, None] == self._part[last][None, :]
        if not joined.any():
            return None
        # Both are sorted by area: the first pair has the largest parts.
        at_first, at_last = np.argwhere(joined)[0].tolist()
        found = self._search.search(int(first[at_first]), int(last[at_last]))
        assert found.vertices is not None  # noqa: S101 - both lie in one component
        labels = self._rooms.label_of_vertex[found.vertices].tolist()
        names = tuple(self._rooms.name_of(label) for label in labels)
        return RoomRoute(names, tuple(found.arcs.tolist()))

    def _vertices_of(self, name: str) -> LongArray:
        """Return the parts of a room that may be entered, free ones first, then by area."""
        rooms = self._rooms
        is_named = rooms.label_of_vertex == rooms.labels.index(name)
        found = np.flatnonzero(is_named & self._allowed)
        return found[np.lexsort((-rooms.level.areas[found], ~rooms.is_free[found]))]


def _parts(arcs: IntArray, n_vertices: int) -> LongArray:
    """Return the connected component of each vertex."""
    from scipy.sparse import coo_array  # noqa: PLC0415 - most planners search no rooms
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    ones = np.ones(len(arcs), dtype=np.int8)
    graph = coo_array((ones, (arcs[:, 0], arcs[:, 1])), shape=(n_vertices, n_vertices))
    label: LongArray = connected_components(graph, directed=False)[1].astype(np.int64)
    return label
