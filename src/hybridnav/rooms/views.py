"""Rooms by a vote of several views of a map, turned against its walls.

Where the cells of a map happen to lie decides much: turned a little, it has other rooms. So free
space is cut and judged in four coarse views, and what half of them hold for one room is one room.

A. Strehl, J. Ghosh: Cluster ensembles, Journal of Machine Learning Research 3, 2002; the vote is
joined by average linkage.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from scipy import sparse

from hybridnav._base.trig import cos, sin
from hybridnav._base.typing import ByteArray, FloatArray, IntArray, LongArray
from hybridnav.maps import NO_ROOM
from hybridnav.rooms.cutting import (
    Directions,
    Ground,
    Kind,
    fine_segments,
    least_cells,
    spread,
    wall_directions,
    wrapped,
)
from hybridnav.rooms.kernels import cutting as _cell_kernels
from hybridnav.rooms.kernels import views as _kernels
from hybridnav.rooms.kernels.views import ViewFrame
from hybridnav.rooms.merging import JudgedSegments, Rule, Small, merge

_TURNS_RAD = tuple(math.radians(degrees) for degrees in (0.0, 22.5, 45.0, 67.5))
"""Angles of the views, from the first direction of walls on."""
_CELL_M = 0.1
"""Side of their cells: four views have about as many as a map of cells of 5 cm. A map of larger
ones is seen once, as it is."""
_MOST_POINTS = 100
"""Points along the side of a cell that are looked at; more than cells of a millimetre have."""
_MOST_TIMES = 4
"""Cells of a view over those of the map: a long map that is turned lies in a large square of
nothing. Up to five times as long as wide, a map has all views."""
_LEVEL_RAD = math.radians(0.3)
"""Up to it, walls run along the cells of the map."""
_ATOM_M2 = 0.25
"""Below it, what all views hold for one room goes to a neighbour before the vote."""
_HALF = 0.5 - 1e-9
"""Share of the views from which on two segments are one room; shares are rounded."""
_ROUND = 2
"""Cells to each side of one on a border that say which room it is in: views cut at angles of their
own, and without it borders have steps."""
_STEPS = 6
"""Cells that labels spread where another view sees a wall."""


def frame_over(shape: tuple[int, ...], angle_rad: float, side: float) -> ViewFrame:
    """Return the frame that is turned about the middle of a map by an angle and holds all of it.

    `shape`: rows and columns of the map; `side`: side of the frame's cells, in those of the map.
    """
    rows, cols = shape
    cosine, sine = cos(angle_rad), sin(angle_rad)
    high = rows * abs(cosine) + cols * abs(sine)
    wide = cols * abs(cosine) + rows * abs(sine)
    n_rows, n_cols = (math.ceil(extent / side - 1e-9) for extent in (high, wide))
    return ViewFrame(n_rows, n_cols, cosine, sine, side)


def voted_rooms(
    kinds: ByteArray, resolution_m: float, rules: Callable[[float], list[Rule]], least_m2: float
) -> IntArray:
    """Return the rooms of the cells inside by the vote of the views, int32 (rows, cols), -1 for
    none.

    `kinds`: uint8 (rows, cols), see `Kind`; `resolution_m`: side of a cell in metres; `rules`:
    those by which segments become rooms, for cells of an area in square metres; `least_m2`: least
    area of a room in square metres.
    """
    joined, base = _voted_segments(kinds, resolution_m, rules, min(_ATOM_M2, least_m2))
    free = kinds == Kind.INSIDE
    whole = frame_over(kinds.shape, 0.0, 1.0)
    room_of = _kernels.brought(_kernels.smoothed(joined.label_of, _ROUND), base, whole, free)
    spread(room_of, free, free.size)
    # What is small is small on the map itself.
    areas = np.zeros(joined.n_segments + 1, np.int64)
    for row in room_of:  # an array of all cells takes eight bytes more for each
        areas += np.bincount(row + 1, minlength=len(areas))
    joined.state.free[:] = areas[1:]
    least = least_cells(least_m2, resolution_m * resolution_m)
    merge(joined, [Small(least)])
    owner_of = np.append(joined.owner_of, NO_ROOM).astype(np.int32)
    for row in room_of:
        row[:] = owner_of[row]
    # What hangs together in coarse cells alone, and what is too narrow for them.
    part_of: IntArray = _cell_kernels.large_parts(room_of, least, NO_ROOM)
    spread(part_of, free, free.size)
    left = free & (part_of < 0)
    part_of[left] = _cell_kernels.large_parts(left, 1)[left] + np.int32(part_of.max() + 1)
    return part_of


def _voted_segments(
    kinds: ByteArray, resolution_m: float, rules: Callable[[float], list[Rule]], atom_m2: float
) -> tuple[JudgedSegments, ViewFrame]:
    """Return what half of the views hold for one room, and the frame of its cells."""
    side = max(1.0, _CELL_M / resolution_m)
    cell_m, n_points = side * resolution_m, min(_MOST_POINTS, math.ceil(side - 1e-9))
    is_coarse = resolution_m > _CELL_M * (1 + 1e-9)
    level = frame_over(kinds.shape, 0.0, side)
    ground = Ground.of(_kernels.seen(kinds, level, n_points), cell_m)
    walls = wall_directions(ground.wall, cell_m)
    ahead = walls[0][0] if walls and not is_coarse and abs(walls[0][0]) > _LEVEL_RAD else 0.0
    angles = [ahead + turn for turn in _TURNS_RAD[: 1 if is_coarse else None]]
    views = [(angle, frame_over(kinds.shape, angle, side)) for angle in angles]
    most = _MOST_TIMES * level.rows * level.cols
    views = [view for view in views if view[1].rows * view[1].cols <= most] or [(0.0, level)]
    labels: list[IntArray] = []
    for angle, frame in views:
        if frame != level:
            ground = Ground.of(_kernels.seen(kinds, frame, n_points), cell_m)
        if not labels:
            base, first = frame, ground
        segments = JudgedSegments(
            fine_segments(ground, _turned(walls, angle, level, frame)), ground
        )
        merge(segments, rules(cell_m * cell_m))
        own = _kernels.brought(segments.label_of, frame, base, first.free)
        spread(own, first.free, _STEPS)
        labels.append(own)
    atoms = labels[0].copy()
    for own in labels:  # the first too: its numbers have gaps
        _cell_kernels.cross(atoms, own)
    voted = JudgedSegments(atoms, first)
    merge(voted, [Small(least_cells(atom_m2, cell_m * cell_m)), Voted(atoms, labels)])
    return voted, base


def _turned(walls: Directions, turn_rad: float, level: ViewFrame, frame: ViewFrame) -> Directions:
    """Return the directions of walls in a frame, as the one that is not turned has them."""
    everywhere = np.ones((frame.rows, frame.cols), np.bool_)
    angles = wrapped(np.array([angle for angle, _ in walls]) - turn_rad)
    windows = (within.astype(np.int32) for _, within in walls)
    return [
        (angle, _kernels.brought(within, level, frame, everywhere) > 0)
        for angle, within in zip(angles.tolist(), windows, strict=True)
    ]


class Voted:
    """The rule that two segments merge which half of the views hold for one room, by the mean over
    the pairs of their cells: average linkage.

    `atoms`: int32 (rows, cols), the segments before they merge, what all views hold for one room,
    -1 for none; `labels`: the room of each cell in each view, int32 (rows, cols).
    """

    def __init__(self, atoms: IntArray, labels: list[IntArray]) -> None:
        n, has_atom = int(atoms.max(initial=-1)) + 1, atoms >= 0
        of = atoms[has_atom]
        self._areas = np.bincount(of, minlength=n)
        shares, each = self._areas / math.sqrt(len(labels)), np.arange(n)
        counts = []
        for own in labels:
            room_of = np.zeros(n, np.int32)
            room_of[of] = own[has_atom]  # the same for all cells of an atom
            shape = (n, room_of.max(initial=0) + 1)
            counts.append(sparse.coo_array((shares, (each, room_of)), shape))
        self._counts = sparse.csr_array(sparse.hstack(counts))
        """A row for each atom: its cells in each room of each view, over the root of the views."""

    def ratings(self, segments: JudgedSegments, _grown: LongArray) -> FloatArray:
        """Return the share of the views of each pair, 0 below a half; see `Rule`."""
        state, n = segments.state, segments.n_segments
        may = (state.endpoints[:, 0] >= 0) & (state.open_sides > 0)
        one, other = state.endpoints[may].T
        owner_of = segments.owner_of
        counts = sparse.csr_array((np.ones(n), (owner_of, np.arange(n))), (n, n)) @ self._counts
        areas = np.bincount(owner_of, self._areas, n)
        alike = counts[one].multiply(counts[other]).sum(axis=1)
        ratings = np.zeros(len(may))
        ratings[may] = alike / (areas[one] * areas[other])
        return np.where(ratings >= _HALF, ratings, 0.0)
