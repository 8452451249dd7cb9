"""Tables of exact distances between many ends, by labels in a hierarchy."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Protocol

import numpy as np

from hybridnav._base.moves import FAR, length_in_cells
from hybridnav._base.threads import cores
from hybridnav.search.kernels.labels import meet
from hybridnav.search.mesh.kernels.ends import (
    costs_to_corners,
    labels_of_points,
    polygons_of_points,
    straight_costs,
    views_of_points,
)
from hybridnav.search.mesh.kernels.views import UNITS
from hybridnav.search.mesh.search import rounded_into
from hybridnav.search.octile.kernels.ends import direct_costs, labels_of_cells

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._base.typing import FloatArray, IntArray, LongArray
    from hybridnav.search.mesh import CornerHierarchy, MeshSearch
    from hybridnav.search.octile import JumpSearch

    Labels = tuple[LongArray, IntArray, LongArray]
    """Offsets of ends, corners, costs."""
    Ends = tuple[LongArray, FloatArray]
    """int64 (n, 2) free cells, and float64 (n, 2) points in them, (row, col) in grid units."""

_BLOCK = 1024
"""Ends whose labels are held at a time."""
_ROOM = 4096


class LabelSource(Protocol):
    """What makes labels of ends, on one kind of hierarchy."""

    n_corners: int
    most: int
    """Starts whose labels are held at a time."""

    def labels(self, ends: Ends) -> Labels:
        """Return the labels of starts."""

    def goal_labels(self, ends: Ends) -> Labels:
        """Return the labels of goals."""

    def direct(self, starts: Ends, goals: Ends, table: LongArray) -> None:
        """Set the entries of a table whose path passes no corner."""

    def lengths(self, table: LongArray) -> FloatArray:
        """Return costs as lengths in cells, infinite for `FAR`."""


class MeshLabels:
    """Labels of points in a hierarchy of corners: shortest paths at any angle.

    Parameters
    ----------
    search
        A search that is prepared.
    graph
        Its graph.
    """

    most = _BLOCK

    def __init__(self, search: MeshSearch, graph: CornerHierarchy) -> None:
        mesh = search.mesh
        self._mesh, self._place = search.arrays, (mesh.component, mesh.polygon_at)
        self._hierarchy = mesh.kinds, graph.first, graph.arcs, graph.follow
        self.n_corners, self._n_polygons = len(mesh.corners), mesh.n_polygons

    def labels(self, ends: Ends) -> Labels:
        """Return the labels of ends."""
        inside = np.empty(self._n_polygons, np.int32)
        work = inside, _view_room(), _climbing_room(self.n_corners)
        found: Labels = labels_of_points(
            self._mesh, self._hierarchy, self._place, (ends[0], rounded_into(*ends)), work
        )
        return found

    goal_labels = labels

    def direct(self, starts: Ends, goals: Ends, table: LongArray) -> None:
        """Set the entries of ends that see each other."""
        inside = np.empty(self._n_polygons, np.int32)
        near, far = ((cells, rounded_into(cells, points)) for cells, points in (starts, goals))
        offset, listed = polygons_of_points(self._mesh, self._place, near, inside)
        to_offset, to_listed = polygons_of_points(self._mesh, self._place, far, inside)
        begin, order = _by_number(to_listed, self._n_polygons)
        members = np.repeat(np.arange(len(far[0])), np.diff(to_offset))[order]
        goal_lists = far[1], begin, members.astype(np.int32)
        straight_costs(self._mesh, (near[1], offset, listed), goal_lists, _view_room(), table)

    def lengths(self, table: LongArray) -> FloatArray:
        """Return costs as lengths in cells."""
        return np.where(table < FAR, table / UNITS, np.inf)


class ViewLabels(MeshLabels):
    """The same on a graph of corners that is not contracted, as those of raw scans are: a start
    holds all corners, a goal those that it sees.

    Parameters
    ----------
    search
        A search that is prepared.
    edges
        The edges between corners.
    """

    most = 16

    def __init__(self, search: MeshSearch, edges: tuple[LongArray, IntArray]) -> None:
        mesh = search.mesh
        self._mesh, self._place = search.arrays, (mesh.component, mesh.polygon_at)
        self._edges = edges
        self.n_corners, self._n_polygons = len(mesh.corners), mesh.n_polygons

    def labels(self, ends: Ends) -> Labels:
        """Return the costs from each start to all corners."""
        offset, seen, to_seen = self.goal_labels(ends)
        points = rounded_into(*ends)
        costs = np.full((len(points), self.n_corners), FAR, np.int64)
        before, heap = np.empty(self.n_corners, np.int32), np.empty((_ROOM, 2), np.int64)
        for k, point in enumerate(points):
            part = slice(offset[k], offset[k + 1])
            work = costs[k], before, heap
            heap = costs_to_corners(
                self._mesh, self._edges, point, (seen[part], to_seen[part]), work
            )
        ends_at = np.arange(len(points) + 1) * self.n_corners
        corners = np.tile(np.arange(self.n_corners, dtype=np.int32), len(points))
        return ends_at, corners, costs.ravel()

    def goal_labels(self, ends: Ends) -> Labels:
        """Return the corners that each goal sees."""
        work = np.empty(self._n_polygons, np.int32), _view_room()
        found: Labels = views_of_points(
            self._mesh, self._place, (ends[0], rounded_into(*ends)), work
        )
        return found


class JumpLabels:
    """Labels of cells in a contracted jump-point graph: shortest octile paths.

    Parameters
    ----------
    search
        A search on a contracted graph.
    """

    most = _BLOCK

    def __init__(self, search: JumpSearch) -> None:
        graph = search.graph
        self._tables, self._places, _, follow, _ = search.arrays
        kinds = (graph.places & 15).astype(np.uint8)
        self._hierarchy = kinds, graph.first, graph.arcs, follow
        self._origin, self.n_corners = graph.origin, graph.n_corners

    def _flat(self, ends: Ends) -> LongArray:
        flat: LongArray = (ends[0] - np.array(self._origin)) @ np.array([self._tables[3], 1])
        return flat

    def labels(self, ends: Ends) -> Labels:
        """Return the labels of ends."""
        work = _climbing_room(self.n_corners)
        found: Labels = labels_of_cells(
            self._tables, self._places, self._hierarchy, self._flat(ends), work
        )
        return found

    goal_labels = labels

    def direct(self, starts: Ends, goals: Ends, table: LongArray) -> None:
        """Set the entries of cells with one free leg between them."""
        direct_costs(self._tables, self._flat(starts), self._flat(goals), table)

    def lengths(self, table: LongArray) -> FloatArray:
        """Return costs as lengths in cells."""
        found = np.full(table.shape, np.inf)
        reached = table < FAR
        found[reached] = length_in_cells(table[reached])
        return found


def _view_room() -> tuple[IntArray, FloatArray, IntArray]:
    return np.empty((_ROOM, 2), np.int32), np.empty((_ROOM, 4)), np.empty(_ROOM, np.int32)


def _climbing_room(n_corners: int) -> tuple[LongArray, LongArray]:
    return np.full((n_corners, 2), FAR, np.int64), np.empty((_ROOM, 2), np.int64)


def _by_number(numbers: IntArray, count: int) -> tuple[LongArray, LongArray]:
    """Return where the entries of each number begin, and their order."""
    begin = np.zeros(count + 1, np.int64)
    np.cumsum(np.bincount(numbers, minlength=count), out=begin[1:])
    return begin, np.argsort(numbers, kind="stable")


def distance_blocks(
    source: LabelSource, starts: Ends, goals: Ends
) -> Iterator[tuple[slice, slice, FloatArray]]:
    """Yield the lengths of shortest paths between ends, in cells, block by block.

    Labels of a block of goals are sorted into buckets by corner, and looked up for each start, on
    all cores. Memory is that of two blocks of labels and the blocks of the table at work.

    Parameters
    ----------
    source
        Makes labels.
    starts, goals
        The ends; their cells are free.

    Yields
    ------
    tuple
        The rows and columns of a block, and float64 lengths, infinite without a path.
    """
    for first in range(0, len(goals[0]), _BLOCK):
        columns = slice(first, min(first + _BLOCK, len(goals[0])))
        block = goals[0][columns], goals[1][columns]
        offset, corners, costs = source.goal_labels(block)
        begin, order = _by_number(corners, source.n_corners)
        which = np.repeat(np.arange(len(block[0]), dtype=np.int32), np.diff(offset))[order]
        buckets = begin, which, costs[order]

        def fill(rows: slice, block: Ends = block, buckets: Labels = buckets) -> FloatArray:
            some = starts[0][rows], starts[1][rows]
            table = np.full((len(some[0]), len(block[0])), FAR, np.int64)
            source.direct(some, block, table)
            meet(source.labels(some), buckets, table)
            return source.lengths(table)

        size = max(1, min(source.most, -(-len(starts[0]) // cores())))
        parts = [slice(at, min(at + size, len(starts[0]))) for at in range(0, len(starts[0]), size)]
        with ThreadPoolExecutor(cores()) as pool:
            for rows, lengths in zip(parts, pool.map(fill, parts), strict=True):
                yield rows, columns, lengths
