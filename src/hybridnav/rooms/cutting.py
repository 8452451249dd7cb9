"""A fine cut of free space, along wall lines in every local direction and at its narrow places."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from hybridnav._base.trig import cos, tan
from hybridnav._base.typing import AnyArray, BoolArray, ByteArray, FloatArray, IntArray
from hybridnav.maps.clearance import clearance_cells, closing, within_radius
from hybridnav.rooms.kernels import cutting as _cell_kernels

_ROUNDING = 1e-9
_ALONE, _NOISE, _MANY, _WIDEST_M = 7, 0.003, 30, 0.1
"""Free cells of the eight round an occupied one from which on it is alone; how many such there are
in a map of noise, for each free cell and in all, and how wide they are: pillars are no noise. No
real map of 43 has more than 0.0026 for each: legs of chairs."""
_CLOSE_M = 0.15
_CLOSE_RAYS_M = 0.25
_HOLE_M2 = 0.5
"""Unexplored cells between the rays of a scan count as free: those that a closing fills, and holes
below this area."""
_RAYS = 0.8
_NO_WALLS = 0.97
"""Share of the rim of closed free space that is unexplored, from which on a map is one of single
rays, and from which on it shows no walls but the unexplored cells."""
_RIM_M = 0.3
"""Only the rim of a solid mass is a wall."""
_SLACK_M = 0.15
_LENGTHS_M = (9.0, 1.5, 5.0, 1.0, 2.5)
"""The longest gap, a door, the window in which wall is counted beside a gap, the least wall on
either side of a gap, and on both sides together."""
_FREE_SHARE = 0.7
_LEAST_M2 = 0.1
_PASSAGE, _PASSAGE_M = 0.7, 1.5
"""Passages with less clearance than these, as a share of both sides and in metres, are cut."""
_WINDOW_M = 25.0
_MOST_POINTS = 6000
_LEAST_WALL_CELLS_M = 8.0
_MOST_DIRECTIONS = 2
_APART_RAD = math.radians(8.0)
_ALIKE_RAD = math.radians(0.8)
_ABSORBED_RAD = math.radians(1.3)
_SECOND = 0.35
_FAINT = 0.05
"""A second direction of a window has at least that share of the sharpness of the first, a direction
of the map at least that of the strongest."""


Directions = list[tuple[float, BoolArray]]
"""Directions of walls; see `wall_directions`."""


def least_cells(least_m2: float, cell_m2: float) -> int:
    """Return the fewest cells that make an area, so that 2 m2 are 200 cells of a decimetre and not
    201."""
    return math.ceil(least_m2 / cell_m2 * (1 - _ROUNDING))


class Kind(IntEnum):
    """Kind of a cell for the cut into segments."""

    UNKNOWN = 0
    OUTSIDE = 1
    """Free, but outside of the building."""
    INSIDE = 2
    """Free, inside of it."""
    WALL = 3


@dataclass(frozen=True, eq=False)
class Ground:
    """What counts as free and as wall when a map is cut into segments."""

    free: BoolArray
    """bool (rows, cols)."""
    wall: BoolArray
    """bool (rows, cols), rims of obstacles near free cells."""
    squares: IntArray
    """int32 (rows, cols), those of the clearance of free cells, in cells; 1 on a map without
    obstacles."""
    resolution_m: float
    """Side of a cell in metres."""

    @classmethod
    def of(cls, kinds: ByteArray, resolution_m: float) -> Ground:
        """Return the ground of some cells.

        On a scan of single rays, the unexplored cells between them count as free, and what is
        unexplored beyond as wall.

        `kinds`: uint8 (rows, cols), see `Kind`; `resolution_m`: side of a cell in metres.
        """
        occupied, free = kinds == Kind.WALL, kinds == Kind.INSIDE
        closed = closed_by_disc(free, occupied, _CLOSE_M / resolution_m)
        rim = _rim(closed)
        n_unexplored = np.count_nonzero(rim & (kinds == Kind.UNKNOWN))
        unexplored = float(n_unexplored / max(1, int(np.count_nonzero(rim))))
        if unexplored > _NO_WALLS:
            occupied = occupied | (_rim(free) & (kinds != Kind.OUTSIDE))
        elif unexplored > _RAYS:
            free = closed_by_disc(free, occupied, _CLOSE_RAYS_M / resolution_m)
            holes = ~free & ~occupied
            least = least_cells(_HOLE_M2, resolution_m * resolution_m)
            free = free | holes & (_cell_kernels.large_parts(holes, least) < 0)
            occupied = occupied | _rim(free)
        clearance = clearance_cells(occupied) if occupied.any() else np.ones(free.shape)
        clearance *= clearance
        squares = np.rint(clearance, out=clearance).astype(np.int32)
        depths = np.sqrt(np.arange((_RIM_M / resolution_m + 1) ** 2))
        depth = depths[depths * resolution_m <= _RIM_M].max()
        return cls(free, occupied & within_radius(free, radius_cells=depth), squares, resolution_m)


def without_noise(kinds: ByteArray, resolution_m: float) -> ByteArray:
    """Return cells with the occupied ones free that are noise: small, many, and alone among free
    ones.

    `kinds`: uint8 (rows, cols), see `Kind`; `resolution_m`: side of a cell in metres.
    """
    if resolution_m > _WIDEST_M:
        return kinds
    free = np.pad(kinds == Kind.INSIDE, 1).view(np.uint8)
    beside = free[:-2] + free[1:-1] + free[2:]
    beside = beside[:, :-2] + beside[:, 1:-1] + beside[:, 2:]
    alone = (kinds == Kind.WALL) & (beside >= _ALONE)
    if np.count_nonzero(alone) <= max(_MANY, _NOISE * np.count_nonzero(free)):
        return kinds
    return np.where(alone, np.uint8(Kind.INSIDE), kinds)


def fine_segments(ground: Ground, directions: Directions | None = None) -> IntArray:
    """Cut free space so finely that hardly any segment lies in two rooms.

    `ground`: what counts as free and as wall; `directions`: those of its walls, if they are known.
    Returns int32 (rows, cols), a segment for each free cell, without gaps from 0, -1 elsewhere and
    for specks below 0.1 m2 that touch no other free cell.
    """
    free = ground.free
    least = least_cells(_LEAST_M2, ground.resolution_m * ground.resolution_m)
    lines: IntArray = _cell_kernels.large_parts(free & ~_gaps(ground, directions), least)
    spread(lines, free, free.size)
    taken = free & (lines < 0)
    if taken.any():  # gaps have taken all cells
        whole = _cell_kernels.large_parts(taken, least)
        whole[whole >= 0] += lines.max() + np.int32(1)
        np.maximum(lines, whole, out=lines)
        del whole
    broad = _PASSAGE_M / ground.resolution_m
    basins = _cell_kernels.flood_basins(ground.squares, free, _PASSAGE, broad)
    _cell_kernels.cross(lines, basins)
    return lines


def spread(label_of: IntArray, region: AnyArray, most_steps: int) -> None:
    """Spread labels by steps along sides, each cell taking the nearest, in place.

    Steps go only between cells of one region, none into region -1, and at most `most_steps` from
    where a label begins. `label_of`: int32 (rows, cols); `region`: likewise, or bool, the cells of
    one region.
    """
    if region.dtype == np.bool_:
        region = region.view(np.int8) - np.int8(1)
    to_label = (label_of < 0) & (region >= 0)
    beside = within_radius(to_label, radius_cells=1.0) & (label_of >= 0)
    first = np.flatnonzero(beside)
    queue = np.empty(len(first) + np.count_nonzero(to_label), np.int64)
    queue[: len(first)] = first
    _cell_kernels.grow_labels(label_of, region, queue, len(first), most_steps)


def wall_directions(wall: BoolArray, resolution_m: float) -> Directions:
    """Find the directions of walls, in windows of 25 m that overlap by half.

    A direction is the angle at which the projection of the wall cells is sharpest; a window has up
    to two, 8 degrees apart or more, and so has the map.

    `wall`: bool (rows, cols); `resolution_m`: side of a cell in metres. Returns an angle from -pi/4
    to pi/4 that turns the rows of the grid into it, and bool (rows, cols), the windows in which
    walls have it; the most frequent first.
    """
    side = max(8, round(_WINDOW_M / resolution_m))
    votes: list[tuple[float, float, int, int]] = []
    rows, cols = np.divmod(np.flatnonzero(wall), wall.shape[1])
    for row in range(0, max(1, wall.shape[0] - side // 2), side // 2):
        begin, end = np.searchsorted(rows, (row, row + side))
        for col in range(0, max(1, wall.shape[1] - side // 2), side // 2):
            near = begin + np.flatnonzero((cols[begin:end] >= col) & (cols[begin:end] < col + side))
            cells = np.stack([rows[near] - row, cols[near] - col]) - side / 2
            votes += [(a, s, row, col) for a, s in _directions_of(cells, resolution_m)]
    found: Directions = []
    strongest = 0.0
    while votes and len(found) < _MOST_DIRECTIONS:
        angles, scores, rows, cols = np.array(votes).T
        support = [scores[_apart(angles, a) < _ALIKE_RAD].sum() for a in angles]
        best = int(np.argmax(support))
        strongest = max(strongest, float(support[best]))
        if support[best] < _FAINT * strongest:
            break
        alike = _apart(angles, angles[best]) < _ALIKE_RAD
        shifts = wrapped(angles[alike] - angles[best])
        angle = angles[best] + np.average(shifts, weights=scores[alike])
        taken = _apart(angles, angles[best]) < _ABSORBED_RAD
        within = np.zeros_like(wall)
        for at_row, at_col in zip(rows[taken].astype(int), cols[taken].astype(int), strict=True):
            within[at_row : at_row + side, at_col : at_col + side] = True
        found.append((float(wrapped(angle)), within))
        votes = [vote for vote, gone in zip(votes, taken.tolist(), strict=True) if not gone]
    return found


def _directions_of(cells: FloatArray, resolution_m: float) -> list[tuple[float, float]]:
    """Find up to two directions of the walls of one window, with how far their sharpness exceeds
    the median. `cells`: float64 (2, n), rows and columns from its middle."""
    n = cells.shape[1]
    if n * resolution_m < _LEAST_WALL_CELLS_M:
        return []
    kept = np.linspace(0, n - 1, min(n, _MOST_POINTS)).astype(int)
    rows, cols = np.ascontiguousarray(cells[:, kept])
    coarse = np.radians(np.arange(-45.0, 45.0))
    sharp = _cell_kernels.sharpness(rows, cols, coarse)
    median, order = float(np.median(sharp)), np.argsort(-sharp, kind="stable")
    found: list[tuple[float, float]] = []
    for k in order.tolist():
        if sharp[k] - median < _SECOND * (sharp[order[0]] - median) or len(found) == 2:  # noqa: PLR2004
            break
        if all(_apart(coarse[k], angle) >= _APART_RAD for angle, _ in found):
            fine = coarse[k] + np.radians(np.arange(-1.0, 1.01, 0.25))
            near = _cell_kernels.sharpness(rows, cols, fine)
            found.append((float(fine[near.argmax()]), float(near.max()) - median))
    return found


def wrapped(angle_rad: FloatArray) -> FloatArray:
    """Return angles of crosses, from -pi/4 to pi/4."""
    return (angle_rad + math.pi / 4) % (math.pi / 2) - math.pi / 4


def _apart(angle_rad: FloatArray, other_rad: float) -> FloatArray:
    return np.abs(wrapped(angle_rad - other_rad))


def _gaps(ground: Ground, directions: Directions | None) -> BoolArray:
    """Return the cells of gaps between walls, on lines in each direction of walls, and square to
    it."""
    cut = np.zeros_like(ground.free)
    if directions is None:
        directions = wall_directions(ground.wall, ground.resolution_m)
    for turned in (False, True):
        wall, free, found, *windows = (
            _cell_kernels.transposed(mask) if turned else mask
            for mask in (ground.wall, ground.free, cut, *(within for _, within in directions))
        )
        thick = wall.copy()
        for away in range(1, max(1, round(_SLACK_M / ground.resolution_m)) + 1):
            thick[away:] |= wall[:-away]
            thick[:-away] |= wall[away:]
        for (angle_rad, _), within in zip(directions, windows, strict=True):
            along = cos(angle_rad) / ground.resolution_m
            lengths = _cell_kernels.GapLengths(
                *(max(1, round(length_m * along)) for length_m in _LENGTHS_M)
            )
            slope = -tan(angle_rad) if turned else tan(angle_rad)
            _cell_kernels.cut_along(thick, free, slope, within, lengths, _FREE_SHARE, found)
        if turned:
            cut |= _cell_kernels.transposed(found)
    return cut


def closed_by_disc(free: BoolArray, occupied: BoolArray, reach: float) -> BoolArray:
    """Return free cells, and those that a closing by a disc fills, but no obstacle."""
    size = max(1, round(reach))
    return closing(free, math.sqrt(size * size + 1)) & ~occupied


def with_beside(cells: BoolArray) -> BoolArray:
    """Return cells, and the eight round each."""
    return within_radius(cells, radius_cells=1.5)


def _rim(free: BoolArray) -> BoolArray:
    return with_beside(free) & ~free
