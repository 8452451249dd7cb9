"""A fine cut of free space, along wall lines in every local direction and at its narrow places."""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from scipy import ndimage

from hybridnav._base.trig import cos, tan
from hybridnav._base.typing import BoolArray, ByteArray, FloatArray, IntArray
from hybridnav.maps.clearance import clearance_cells, closing
from hybridnav.rooms.kernels import segmentation as _segmentation_kernels

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
_MOST_DIRECTIONS = 4
_APART_RAD = math.radians(8.0)
_ALIKE_RAD = math.radians(0.8)
_ABSORBED_RAD = math.radians(1.3)
_SECOND = 0.35
_FAINT = 0.05
"""A second direction of a window has at least that share of the sharpness of the first, a direction
of the map at least that of the strongest."""


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
    clearance: FloatArray
    """float64 (rows, cols), in cells; 1 everywhere on a map without obstacles."""
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
            holes, _ = ndimage.label(~free & ~occupied)
            small = np.bincount(holes.ravel()) * (resolution_m * resolution_m) < _HOLE_M2
            small[0] = False
            free = free | small[holes]
            occupied = occupied | _rim(free)
        near = clearance_cells(~free) * resolution_m <= _RIM_M
        clearance = clearance_cells(occupied)
        clearance[~np.isfinite(clearance)] = 1.0
        return cls(free, occupied & near, clearance, resolution_m)


def fine_segments(ground: Ground) -> IntArray:
    """Cut free space so finely that hardly any segment lies in two rooms.

    `ground`: what counts as free and as wall. Returns int32 (rows, cols), a segment for each free
    cell, -1 elsewhere and for specks below 0.1 m2 that touch no other free cell.
    """
    free = ground.free
    cut = np.zeros_like(free)
    for angle_rad, within in wall_directions(ground.wall, ground.resolution_m):
        _cut_in(ground, angle_rad, within, cut)
    lines = _large_parts(free & ~cut, ground)
    everywhere = np.where(free, np.int32(0), np.int32(-1))
    _segmentation_kernels.grow_labels(lines, everywhere, free.size)
    whole = _large_parts(free & (lines < 0), ground)  # gaps have taken all of its cells
    lines = np.where(whole >= 0, whole + lines.max(initial=-1) + 1, lines)
    basins = _basins(ground)
    inside = (lines >= 0) & (basins >= 0)
    both = lines[inside] * (np.int64(basins.max(initial=0)) + 1) + basins[inside]
    segments = np.full(free.shape, -1, dtype=np.int32)
    segments[inside] = np.unique(both, return_inverse=True)[1]
    return segments


def _large_parts(mask: BoolArray, ground: Ground) -> IntArray:
    """Number the connected parts of a mask that are no specks, int32 (rows, cols), -1 elsewhere."""
    parts, _ = ndimage.label(mask)
    kept = np.bincount(parts.ravel()) * (ground.resolution_m * ground.resolution_m) >= _LEAST_M2
    kept[0] = False
    return np.where(kept[parts], parts - 1, -1).astype(np.int32)


def wall_directions(wall: BoolArray, resolution_m: float) -> list[tuple[float, BoolArray]]:
    """Find the directions of walls, in windows of 25 m that overlap by half.

    A direction is the angle at which the projection of the wall cells is sharpest; a window has up
    to two, 8 degrees apart or more, the map up to four.

    `wall`: bool (rows, cols); `resolution_m`: side of a cell in metres. Returns an angle from -pi/4
    to pi/4 that turns the rows of the grid into it, and bool (rows, cols), the windows in which
    walls have it; the most frequent first.
    """
    side = max(8, round(_WINDOW_M / resolution_m))
    votes: list[tuple[float, float, int, int]] = []
    for row in range(0, max(1, wall.shape[0] - side // 2), side // 2):
        for col in range(0, max(1, wall.shape[1] - side // 2), side // 2):
            inside = wall[row : row + side, col : col + side]
            votes += [(a, s, row, col) for a, s in _directions_of(inside, side, resolution_m)]
    found: list[tuple[float, BoolArray]] = []
    strongest = 0.0
    while votes and len(found) < _MOST_DIRECTIONS:
        angles, scores, rows, cols = np.array(votes).T
        support = [scores[_apart(angles, a) < _ALIKE_RAD].sum() for a in angles]
        best = int(np.argmax(support))
        strongest = max(strongest, float(support[best]))
        if support[best] < _FAINT * strongest:
            break
        alike = _apart(angles, angles[best]) < _ALIKE_RAD
        shifts = _wrapped(angles[alike] - angles[best])
        angle = angles[best] + np.average(shifts, weights=scores[alike])
        taken = _apart(angles, angles[best]) < _ABSORBED_RAD
        within = np.zeros_like(wall)
        for at_row, at_col in zip(rows[taken].astype(int), cols[taken].astype(int), strict=True):
            within[at_row : at_row + side, at_col : at_col + side] = True
        found.append((float(_wrapped(angle)), within))
        votes = [vote for vote, gone in zip(votes, taken.tolist(), strict=True) if not gone]
    return found


def _directions_of(wall: BoolArray, side: int, resolution_m: float) -> list[tuple[float, float]]:
    """Find up to two directions of one window, with how far their sharpness exceeds the median."""
    cells = np.argwhere(wall) - side / 2
    if len(cells) * resolution_m < _LEAST_WALL_CELLS_M:
        return []
    cells = cells[np.linspace(0, len(cells) - 1, min(len(cells), _MOST_POINTS)).astype(int)]
    rows, cols = np.ascontiguousarray(cells.T)
    coarse = np.radians(np.arange(-45.0, 45.0))
    sharp = _segmentation_kernels.sharpness(rows, cols, coarse)
    median, order = float(np.median(sharp)), np.argsort(-sharp, kind="stable")
    found: list[tuple[float, float]] = []
    for k in order.tolist():
        if sharp[k] - median < _SECOND * (sharp[order[0]] - median) or len(found) == 2:  # noqa: PLR2004
            break
        if all(_apart(coarse[k], angle) >= _APART_RAD for angle, _ in found):
            fine = coarse[k] + np.radians(np.arange(-1.0, 1.01, 0.25))
            near = _segmentation_kernels.sharpness(rows, cols, fine)
            found.append((float(fine[near.argmax()]), float(near.max()) - median))
    return found


def _wrapped(angle_rad: FloatArray) -> FloatArray:
    """Return angles of crosses, from -pi/4 to pi/4."""
    return (angle_rad + math.pi / 4) % (math.pi / 2) - math.pi / 4


def _apart(angle_rad: FloatArray, other_rad: float) -> FloatArray:
    return np.abs(_wrapped(angle_rad - other_rad))


def _cut_in(ground: Ground, angle_rad: float, within: BoolArray, cut: BoolArray) -> None:
    """Add the gaps between walls on lines in a direction, and square to it."""
    slack = max(1, round(_SLACK_M / ground.resolution_m))
    along = cos(angle_rad) / ground.resolution_m
    lengths = _segmentation_kernels.GapLengths(
        *(max(1, round(length_m * along)) for length_m in _LENGTHS_M)
    )
    for turned in (False, True):
        wall, free, inside, out = (
            np.ascontiguousarray(mask.T if turned else mask)
            for mask in (ground.wall, ground.free, within, np.zeros_like(cut))
        )
        slope = -tan(angle_rad) if turned else tan(angle_rad)
        size = 2 * slack + 1
        wall = ndimage.maximum_filter1d(wall.view(np.uint8), size, 0, mode="constant") > 0
        _segmentation_kernels.cut_along(wall, free, slope, inside, lengths, _FREE_SHARE, out)
        cut |= out.T if turned else out


def _basins(ground: Ground) -> IntArray:
    """Find the basins of the clearance, parted at narrow passages."""
    clearance = np.pad(ground.clearance, 1)
    inside = np.flatnonzero(np.pad(ground.free, 1))
    flat = clearance.ravel()
    order = inside[np.argsort(-flat[inside], kind="stable")]
    basins: IntArray = _segmentation_kernels.flood_basins(
        flat, order, clearance.shape[1], _PASSAGE, _PASSAGE_M / ground.resolution_m
    )
    return basins.reshape(clearance.shape)[1:-1, 1:-1]


def closed_by_disc(free: BoolArray, occupied: BoolArray, reach: float) -> BoolArray:
    """Return free cells, and those that a closing by a disc fills, but no obstacle."""
    size = max(1, round(reach))
    return closing(free, math.sqrt(size * size + 1)) & ~occupied


def _rim(free: BoolArray) -> BoolArray:
    return ndimage.binary_dilation(free, np.ones((3, 3), dtype=np.bool_)) & ~free
