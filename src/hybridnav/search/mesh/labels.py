"""Labels of points on a mesh, for tables of distances: shortest paths at any angle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.moves import FAR
from hybridnav.search.distance_table import BLOCK, ROOM, by_number, climbing_room
from hybridnav.search.mesh.kernels.ends import (
    costs_to_corners,
    labels_of_points,
    polygons_of_points,
    straight_costs,
    views_of_points,
)
from hybridnav.search.mesh.kernels.views import UNITS
from hybridnav.search.mesh.search import rounded_into

if TYPE_CHECKING:
    from hybridnav._base.typing import FloatArray, IntArray, LongArray
    from hybridnav.search.distance_table import Ends, Labels
    from hybridnav.search.mesh import CornerHierarchy, MeshSearch

    Placed = tuple[FloatArray, LongArray, IntArray]
    """float64 (n, 2) points, (row, col), and their polygons: offsets, int32."""


class MeshLabels:
    """Labels of points in a hierarchy of corners: shortest paths at any angle.

    `search`: a search that is prepared.
    """

    most = BLOCK

    def __init__(self, search: MeshSearch, graph: CornerHierarchy) -> None:
        mesh = search.mesh
        self._mesh, self._polygon_at = search.arrays, mesh.polygon_at
        self._hierarchy = mesh.kinds, graph.first, graph.arcs, graph.follow
        self.n_corners, self._n_polygons = len(mesh.corners), mesh.n_polygons

    def placed(self, ends: Ends) -> Placed:
        """Return points with the polygons that contain them."""
        cells, points = ends[0], rounded_into(*ends)
        return points, *polygons_of_points(self._mesh, self._polygon_at, (cells, points))

    def labels(self, ends: Placed) -> Labels:
        """Return the labels of ends."""
        work = climbing_room(self.n_corners)
        return labels_of_points(self._mesh, self._hierarchy, ends, work)

    goal_labels = labels

    def direct(self, starts: Placed, goals: Placed, table: LongArray) -> None:
        """Set the entries of ends that see each other."""
        points, offset, listed = goals
        begin, order = by_number(listed, self._n_polygons)
        members = np.repeat(np.arange(len(points), dtype=np.int32), np.diff(offset))[order]
        straight_costs(self._mesh, starts, (points, begin, members), table)

    def lengths(self, table: LongArray) -> FloatArray:
        """Return costs as lengths in cells."""
        return np.where(table < FAR, table / UNITS, np.inf)


class ViewLabels(MeshLabels):
    """The same on a graph of corners that is not contracted, as those of raw scans are: a start
    holds all corners, a goal those that it sees.

    `search`: a search that is prepared; `edges`: the edges between corners.
    """

    most = 16

    def __init__(self, search: MeshSearch, edges: tuple[LongArray, IntArray]) -> None:
        mesh = search.mesh
        self._mesh, self._polygon_at = search.arrays, mesh.polygon_at
        self._edges = edges
        self.n_corners, self._n_polygons = len(mesh.corners), mesh.n_polygons

    def labels(self, ends: Placed) -> Labels:
        """Return the costs from each start to all corners."""
        offset, seen, to_seen = self.goal_labels(ends)
        points = ends[0]
        costs = np.full((len(points), self.n_corners), FAR, np.int64)
        before, heap = np.empty(self.n_corners, np.int32), np.empty((ROOM, 2), np.int64)
        for k, point in enumerate(points):
            part = slice(offset[k], offset[k + 1])
            work = costs[k], before, heap
            heap = costs_to_corners(
                self._mesh, self._edges, point, (seen[part], to_seen[part]), work
            )
        ends_at = np.arange(len(points) + 1) * self.n_corners
        corners = np.tile(np.arange(self.n_corners, dtype=np.int32), len(points))
        return ends_at, corners, costs.ravel()

    def goal_labels(self, ends: Placed) -> Labels:
        """Return the corners that each goal sees."""
        return views_of_points(self._mesh, ends)
