"""Boundaries between rooms on the map as measured: the same for every robot, seed and merge
distance, so that the numbers of doors are lasting names."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from hybridnav._base.rows import connected_parts, unique_rows
from hybridnav._base.trig import cos, hypots, sin, sines_and_cosines
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.maps import CellClass, OccupancyGrid, RoomLabels
from hybridnav.maps.clearance import clearance_cells
from hybridnav.maps.one_way import OneWayRule
from hybridnav.maps.room_labels import Point
from hybridnav.pyramid.cracks import endpoints_of, find_cracks, middles_of, sides_of
from hybridnav.pyramid.start import kinds_of

LEAST_DOOR_M = 0.3
"""Passage below which a boundary counts as a gap, in metres: a scan's noise makes many. Gaps have
numbers too, after those of all doors; lists and pictures count them and leave them out."""
MOST_DOOR_M = 2.0
"""Width above which a boundary counts as an opening, in metres: double doors are narrower."""
_DIRECTIONS = 36
"""Directions in which the extent of a boundary is measured: at most 0.1 % are lost between two."""
_ROW_M, _MOST_ROW_M = 1.5, 3.0
"""Boundaries between the same two rooms with less than the first between them make one row. In a
row that is wider than the second, posts and furniture part an opening, and no jambs doors."""
_THIN_M = 0.1
"""Side of the squares; one crack of a boundary in each is looked at for rows."""
_ASIDE_M = 0.2
"""Clearance below which the endpoints of a boundary may run along a wall: an outline that lies
beside a door by less is no wider than the door, and ends between its jambs."""
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
    """float64 (n_boundaries,), distance between the two points of each that lie farthest apart,
    without ends that run along a wall."""
    passages_m: FloatArray
    """float64 (n_boundaries,), diameter of the largest disc round a point of each that no occupied
    cell enters; its length where no cell is occupied."""
    between_jambs: BoolArray
    """bool (n_boundaries,), boundaries whose two ends lie beside cells that are not free, or within
    0.2 m of an occupied one, and that are in no wide row. The others close into a ring, end in free
    space where three rooms meet, or are an opening that furniture divides."""
    resolution_m: float
    """Side of a cell in metres."""

    @property
    def n_boundaries(self) -> int:
        """Number of boundaries."""
        return len(self.labels)

    @classmethod
    def of(cls, rooms: RoomLabels, grid: OccupancyGrid, clearance_m: FloatArray) -> RoomBoundaries:
        """Find the boundaries of rooms.

        `grid`: the map; the robot's radius changes nothing; `clearance_m`: as
        `measured_clearance_m` returns it.
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
        order = np.argsort(begins, kind="stable")  # edges ascend: the first of each is its least
        rank = np.empty_like(order)
        rank[order] = np.arange(len(order))
        boundary_of = rank[dense.reshape(-1)].astype(np.int64)
        begins = begins[order]
        label_of = rooms.label_of.ravel()
        labels = np.stack([label_of[first[begins]], label_of[second[begins]]], axis=1)
        sides = grid.frame.points_of_grid(sides_of(edges, cols))
        aside = _ASIDE_M / grid.resolution_m
        count = len(begins)
        widest = np.zeros(count)
        clear = np.minimum(clearance_m.ravel()[first], clearance_m.ravel()[second])
        np.maximum.at(widest, boundary_of, clear)
        length_m = np.bincount(boundary_of, minlength=count) * grid.resolution_m
        passages_m = np.where(np.isfinite(widest), 2 * widest, length_m)
        widths = _widths(edges, cols, boundary_of, clear / grid.resolution_m, aside)
        jambs = _jambs(edges, boundary_of, free.reshape(rows, cols), clear <= _ASIDE_M)
        row_of = _rows_of(labels, boundary_of, sides)
        in_row = row_of[boundary_of]
        row_widths = _widths(edges, cols, in_row, clear / grid.resolution_m, aside)[row_of]
        return cls(
            edges,
            boundary_of,
            labels,
            sides,
            middles_of(sides, boundary_of, count),
            widths * grid.resolution_m,
            passages_m,
            (jambs >= 2) & (row_widths * grid.resolution_m <= _MOST_ROW_M),  # noqa: PLR2004
            grid.resolution_m,
        )

    def numbers(self, known: Mapping[int, Point]) -> LongArray:
        """Number the boundaries.

        `known`: a point in metres of each boundary that has a number. Returns int64
        (n_boundaries,). A boundary keeps a known number whose point lies within a metre of it, the
        nearest first. The others follow above the known ones: doors, then gaps, in the order of
        their first edges.
        """
        numbers = np.zeros(self.n_boundaries, dtype=np.int64)
        for number, boundary in self._nearest(known):
            numbers[boundary] = number
        fresh = np.flatnonzero(numbers == 0)
        fresh = fresh[np.argsort(self.passages_m[fresh] < LEAST_DOOR_M, kind="stable")]
        numbers[fresh] = np.arange(len(fresh)) + max(known, default=0) + 1
        return numbers

    def _nearest(self, known: Mapping[int, Point]) -> list[tuple[int, int]]:
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
        to_middle = hypots(*(points[row] - self.middles[boundary]).T)
        names = names[row]
        order = np.lexsort((boundary, names, to_middle, half_cells))
        candidates = dict.fromkeys(
            zip(names[order].tolist(), boundary[order].tolist(), strict=True)
        )
        taken: set[int] = set()
        found: dict[int, int] = {}
        for number, at in candidates:
            if number not in found and at not in taken:
                found[number] = at
                taken.add(at)
        return list(found.items())


def _widths(
    edges: LongArray, cols: int, boundary_of: LongArray, clearance: FloatArray, aside: float
) -> FloatArray:
    """Return the width of each boundary in cells.

    The middle part is measured, which lies off the walls, and what lies between its endpoints and
    them is added: between two posts all of it, beside a wall only the distance to that.
    """
    extents = _extents(edges, cols, boundary_of)
    widest = np.zeros(len(extents))
    np.maximum.at(widest, boundary_of, clearance)
    middle = clearance >= np.minimum(aside, widest / 2)[boundary_of]
    endpoints = np.full(len(extents), np.inf)
    np.minimum.at(endpoints, boundary_of[middle], clearance[middle])
    inner = _extents(edges[middle], cols, boundary_of[middle])
    return np.minimum(extents, inner + 2 * np.maximum(endpoints - 0.5, 0.0))


def _extents(edges: LongArray, cols: int, boundary_of: LongArray) -> FloatArray:
    """Return the greatest extent of each boundary in any direction, in cells."""
    if not len(edges):
        return np.zeros(0)
    along = np.where((edges & 1)[:, None] == 1, [0.0, 0.5], [0.5, 0.0])  # sides lie across edges
    middles = sides_of(edges, cols)
    order = np.argsort(boundary_of, kind="stable")
    begins = np.flatnonzero(np.diff(boundary_of[order], prepend=-1))
    extents = np.zeros(len(begins))
    for angle_rad in (np.arange(_DIRECTIONS) * (np.pi / _DIRECTIONS)).tolist():
        by_row, by_col = cos(angle_rad), sin(angle_rad)
        at, half = (side[order, 0] * by_row + side[order, 1] * by_col for side in (middles, along))
        half = np.abs(half)
        highest = np.maximum.reduceat(at + half, begins)
        extents = np.maximum(extents, highest - np.minimum.reduceat(at - half, begins))
    return extents


def farthest_ends(edges: LongArray, cols: int) -> FloatArray:
    """Return the two corners of sides that lie farthest apart, of those that are outermost in any
    of 36 directions.

    `edges`: int64 (n,), base edges that cross the sides, one or more; `cols`: columns of the map.
    Returns float64 (2, 2), (row, col) in grid units.
    """
    corners = _corners(edges, cols).astype(np.float64)
    sines, cosines = sines_and_cosines(np.arange(_DIRECTIONS) * (np.pi / _DIRECTIONS))
    along = corners[:, :1] * cosines + corners[:, 1:] * sines
    pairs = corners[np.stack([along.argmin(axis=0), along.argmax(axis=0)], axis=1)]
    lengths = hypots(*(pairs[:, 1] - pairs[:, 0]).T)
    return pairs[int(lengths.argmax())]


def _corners(edges: LongArray, cols: int) -> LongArray:
    """Return both corners of each side, int64 (2 n, 2), (row, col) of the lattice."""
    row, col = np.divmod(edges >> 1, cols)
    upward = (edges & 1).astype(np.int64)
    return np.stack([row + upward, col + 1 - upward, row + 1, col + 1], axis=1).reshape(-1, 2)


def _rows_of(labels: IntArray, boundary_of: LongArray, sides: FloatArray) -> LongArray:
    """Return the row that each boundary is part of, int64 (n_boundaries,), dense."""
    from scipy.spatial import KDTree  # noqa: PLC0415 - most imports of the package need no rooms

    squares = np.floor(sides / _THIN_M).astype(np.int64)
    thin = unique_rows(np.column_stack([boundary_of, squares])).first
    pair = unique_rows(np.sort(labels, axis=1)).number_of[boundary_of[thin]]
    # Boundaries of other rooms are far away in a third dimension.
    near = KDTree(np.column_stack([sides[thin], 2 * _ROW_M * pair])).query_pairs(
        _ROW_M, output_type="ndarray"
    )
    return connected_parts(boundary_of[thin[near]], len(labels))


def _jambs(
    edges: LongArray, boundary_of: LongArray, free: BoolArray, is_near: BoolArray
) -> LongArray:
    """Return how many ends of each boundary have a jamb.

    A jamb is a cell that is not free, or the rim, at the end of the last crack, or an occupied cell
    near that crack.
    """
    around = np.pad(free, 1)
    blocks = around[:-1, :-1] & around[:-1, 1:] & around[1:, :-1] & around[1:, 1:]
    corners = _corners(edges, free.shape[1])
    of = boundary_of.repeat(2)
    # Corners inside a boundary belong to two of its cracks.
    found = unique_rows(np.column_stack([of, corners]))
    ends = found.first[found.n_times == 1]
    has_jamb = ~blocks[tuple(corners[ends].T)] | is_near[ends // 2]
    return np.bincount(of[ends][has_jamb], minlength=int(boundary_of.max(initial=-1)) + 1)


def measured_clearance_m(grid: OccupancyGrid) -> FloatArray:
    """Return the distance from the centre of each cell to the next occupied cell's nearest side.

    `grid`: the map; cells count as measured. Returns float64 (rows, cols), in metres; infinite
    where no cell is occupied.
    """
    cells = clearance_cells(grid.measured == CellClass.OCCUPIED)
    return np.maximum(cells - 0.5, 0.0) * grid.resolution_m


def numbered(rooms: RoomLabels, grid: OccupancyGrid) -> dict[int, Point]:
    """Return the doors of rooms with their numbers, as a file of rooms lists them.

    Result: number and middle of each door. Numbers that are known and that no boundary has any more
    stay in it, so that no other door takes one. Gaps without a known number are left out: they are
    many, and lists and pictures leave them out too.
    """
    found = RoomBoundaries.of(rooms, grid, measured_clearance_m(grid))
    is_door = found.passages_m >= LEAST_DOOR_M
    doors: dict[int, Point] = dict(rooms.doors)
    each = zip(found.numbers(rooms.doors).tolist(), found.middles.tolist(), is_door, strict=True)
    doors |= {n: (x, y) for n, (x, y), door in each if door or n in rooms.doors}
    return dict(sorted(doors.items()))


def one_way_that_holds(
    rules: Collection[OneWayRule], rooms: RoomLabels, grid: OccupancyGrid
) -> list[OneWayRule]:
    """Return the rules whose door is there and joins their room, or whose line meets free cells."""
    rooms_of: dict[int | None, set[str | None]] = {}
    if any(rule.door is not None for rule in rules):
        found, names = RoomBoundaries.of(rooms, grid, measured_clearance_m(grid)), rooms.names
        each = zip(found.numbers(rooms.doors).tolist(), found.labels.tolist(), strict=True)
        rooms_of = {n: {None if at < 0 else names[at] for at in sides} for n, sides in each}
    free = grid.measured == CellClass.FREE

    def is_free(line: Sequence[Point]) -> bool:
        ends = grid.frame.positions_of(np.array(line))
        steps = 2 * int(np.abs(np.diff(ends, axis=0)).max()) + 2
        cells = np.floor([np.linspace(*pair, steps) for pair in pairwise(ends)]).astype(np.int64)
        inside = cells[((cells >= 0) & (cells < grid.shape)).all(axis=-1)]
        return bool(free[tuple(inside.T)].any())

    return [
        rule
        for rule in rules
        if (rule.into in rooms_of.get(rule.door, ()) if rule.door else is_free(rule.line))
    ]
