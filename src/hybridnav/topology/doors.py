"""Boundaries between rooms on the map as measured: the same for every robot, seed and merge
distance, so that the numbers of doors are lasting names."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.grid import CellClass, RoomLabels
from hybridnav.grid.clearance import clearance_cells
from hybridnav.pyramid.cracks import endpoints_of, find_cracks, middles_of, sides_of
from hybridnav.pyramid.start import kinds_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hybridnav._typing import FloatArray, IntArray, LongArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.grid.room_labels import Point

LEAST_DOOR_M = 0.3
"""Width below which a boundary counts as a gap, in metres: a scan's noise makes many. Gaps have
numbers too, after those of all doors; lists and pictures count them and leave them out."""
_SAME_DOOR_M = 1.0
"""How far from a boundary a known point of it may lie, in metres: people move corners."""
_NEAREST_CRACKS = 64
"""Cracks round a known point that are looked at: 3 m of a boundary of cells of 5 cm."""


@dataclass(frozen=True, eq=False)
class RoomBoundaries:
    """Connected boundaries between free cells of different rooms, of a map as measured.

    Two cracks belong to one boundary when they lie in the same full 2x2 block that holds exactly
    two. Inflation takes cracks away and joins none, so each arc of the room level for any robot
    lies on one of these boundaries.
    """

    edges: LongArray
    """int64 (n_cracks,), base edges that lie on a boundary, ascending."""
    boundary_of: LongArray
    """int64 (n_cracks,), the boundary of each, in the order of their first edges."""
    labels: IntArray
    """int32 (n_boundaries, 2), rooms on both sides of the first edge, the lower cell's first; -1
    for no room."""
    sides: FloatArray
    """float64 (n_cracks, 2), the middle of each crack, `(x, y)` in metres, map frame."""
    middles: FloatArray
    """float64 (n_boundaries, 2), the point in the middle of each, `(x, y)` in metres."""
    widths_m: FloatArray
    """float64 (n_boundaries,), diameter of the largest disc round a point of each that no occupied
    cell enters; its length where no cell is occupied."""
    resolution_m: float
    """Side of a cell in metres."""

    @property
    def n_boundaries(self) -> int:
        """Number of boundaries."""
        return len(self.labels)

    @classmethod
    def of(cls, rooms: RoomLabels, grid: OccupancyGrid, clearance_m: FloatArray) -> RoomBoundaries:
        """Find the boundaries of rooms.

        Parameters
        ----------
        rooms
            The rooms.
        grid
            The map; the robot's radius changes nothing.
        clearance_m
            As `measured_clearance_m` returns it.
        """
        rows, cols = grid.shape
        kinds = kinds_of(grid.measured, rooms.label_of).astype(np.int32).ravel() - np.int32(1)
        kinds.flags.writeable = False  # as the kernel is compiled for
        edges, classes = find_cracks(kinds, rows, cols)
        first, second = endpoints_of(edges, cols)
        free = grid.measured.ravel() == CellClass.FREE
        between = free[first] & free[second]  # then their rooms differ
        edges, first, second = edges[between], first[between], second[between]
        _, begins, dense = np.unique(classes[between], return_index=True, return_inverse=True)
        order = np.argsort(begins)  # edges ascend: the first of each is its least
        rank = np.empty_like(order)
        rank[order] = np.arange(len(order))
        boundary_of = rank[dense.reshape(-1)].astype(np.int64)
        begins = begins[order]
        label_of = rooms.label_of.ravel()
        labels = np.stack([label_of[first[begins]], label_of[second[begins]]], axis=1)
        sides = grid.frame.points_of_grid(sides_of(edges, cols))
        count = len(begins)
        widest = np.zeros(count)
        clear = clearance_m.ravel()
        np.maximum.at(widest, boundary_of, np.minimum(clear[first], clear[second]))
        length_m = np.bincount(boundary_of, minlength=count) * grid.resolution_m
        return cls(
            edges,
            boundary_of,
            labels,
            sides,
            middles_of(sides, boundary_of, count),
            np.where(np.isfinite(widest), 2 * widest, length_m),
            grid.resolution_m,
        )

    def numbers(self, known: Mapping[int, Point], pairs: Mapping[int, list[int]]) -> LongArray:
        """Number the boundaries.

        Parameters
        ----------
        known
            A point in metres of each boundary that has a number.
        pairs
            For some of these numbers the rooms on both sides, which then have to be the same.

        Returns
        -------
        LongArray
            int64 (n_boundaries,). A boundary keeps a known number whose point lies within a metre
            of it, the nearest first. The others follow above the known ones: doors, then gaps, in
            the order of their first edges.
        """
        numbers = np.zeros(self.n_boundaries, dtype=np.int64)
        for number, boundary in self._nearest(known, pairs):
            numbers[boundary] = number
        fresh = np.flatnonzero(numbers == 0)
        fresh = fresh[np.argsort(self.widths_m[fresh] < LEAST_DOOR_M, kind="stable")]
        numbers[fresh] = np.arange(len(fresh)) + max(known, default=0) + 1
        return numbers

    def _nearest(
        self, known: Mapping[int, Point], pairs: Mapping[int, list[int]]
    ) -> list[tuple[int, int]]:
        """Return known numbers with their boundaries, each at most once."""
        if not known or not len(self.edges):
            return []
        from scipy.spatial import KDTree  # noqa: PLC0415 - rooms without known doors need none

        points, names = np.array(list(known.values())), np.array(list(known))
        near = KDTree(self.sides).query(
            points,
            k=list(range(1, min(_NEAREST_CRACKS, len(self.edges)) + 1)),
            distance_upper_bound=_SAME_DOOR_M,
        )
        away, nearest = np.asarray(near[0]), np.asarray(near[1])
        row, col = np.nonzero(np.isfinite(away))
        boundary = self.boundary_of[nearest[row, col]]
        half_cells = np.round(2 * away[row, col] / self.resolution_m)
        to_middle = np.hypot(*(points[row] - self.middles[boundary]).T)
        names = names[row]
        order = np.lexsort((boundary, names, to_middle, half_cells))
        candidates = dict.fromkeys(
            zip(names[order].tolist(), boundary[order].tolist(), strict=True)
        )
        taken: set[int] = set()
        found: dict[int, int] = {}
        for number, at in candidates:
            same = number not in pairs or sorted(pairs[number]) == sorted(self.labels[at].tolist())
            if same and number not in found and at not in taken:
                found[number] = at
                taken.add(at)
        return list(found.items())


def measured_clearance_m(grid: OccupancyGrid) -> FloatArray:
    """Return the distance from the centre of each cell to the next occupied cell's nearest side.

    Parameters
    ----------
    grid
        The map; cells count as measured.

    Returns
    -------
    FloatArray
        float64 (rows, cols), in metres; infinite where no cell is occupied.
    """
    cells = clearance_cells(grid.measured == CellClass.OCCUPIED)
    return np.maximum(cells - 0.5, 0.0) * grid.resolution_m


def renumbered(before: RoomLabels, label_of: IntArray, grid: OccupancyGrid) -> dict[int, Point]:
    """Return the doors of rooms whose borders have moved a little, with the numbers they had.

    Parameters
    ----------
    before
        The rooms as they were.
    label_of
        int32 (rows, cols), the same rooms with other borders.
    grid
        The map.

    Returns
    -------
    dict
        Number and middle of each boundary. Numbers that are known and that no boundary has any
        more stay in it, so that no other door takes one.
    """
    clearance_m = measured_clearance_m(grid)
    old = RoomBoundaries.of(before, grid, clearance_m)
    numbers = old.numbers(before.doors, {}).tolist()
    known = dict(before.doors) | _by_number(numbers, old.middles)
    pairs = dict(zip(numbers, old.labels.tolist(), strict=True))
    new = RoomBoundaries.of(RoomLabels(before.names, label_of), grid, clearance_m)
    kept = dict(before.doors) | _by_number(new.numbers(known, pairs).tolist(), new.middles)
    return dict(sorted(kept.items()))


def _by_number(numbers: list[int], middles: FloatArray) -> dict[int, Point]:
    return {number: (x, y) for number, (x, y) in zip(numbers, middles.tolist(), strict=True)}
