"""Segments of free space, cut at its narrow places: the first stage of the segmentation into
rooms."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from hybridnav._base.trig import atan2, cos, exp, sin
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.clearance import clearance_cells
from hybridnav.topology.rooms.kernels import segmentation as _segmentation_kernels

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, IntArray

_PERSISTENCE = 0.8
"""A passage parts two segments when its clearance is below this share of that of either segment."""
_PINCH = 0.4
_PINCH_M = 0.65
"""Besides wall lines only a passage with less clearance than this, and than this share of that on
both sides, parts two segments: a door in a wall that is no line."""

_GAP_M = 6.0
_DOOR_M = 1.5
_WINDOW_M = 5.0
_SIDE_M = 1.5
_BOTH_M = 4.0
_FREE_SHARE = 0.7
_RIM_M = 0.3
_WALL_SLACK_M = 0.15
"""A wall bends by so much at most where it continues another, on either side."""
_LEAST_TILT_RAD = 0.02
LEAST_SEGMENT_M2 = 1.0
"""Smaller segments between wall lines go to neighbours, unless the caller allows smaller rooms."""


def watershed_segments(grid: OccupancyGrid) -> IntArray:
    """Cut free space along the watersheds of the clearance, where passages are narrow.

    The distance transform is flooded from its peaks. Two basins merge where they meet unless the
    saddle is low against the lower peak: a relative persistence, in place of h-maxima, so that
    broad rooms may have broad doors. S. Beucher, C. Lantuejoul: Use of watersheds in contour
    detection, 1979; for rooms R. Bormann, F. Jordan, W. Li, J. Hampp, M. Haegele: Room
    segmentation: survey, implementation, and analysis, ICRA 2016.

    Parameters
    ----------
    grid
        The map; cells count as they were measured, whatever the robot's radius.

    Returns
    -------
    IntArray
        int32 (rows, cols), a segment for each free cell, -1 elsewhere.
    """
    return _basins(grid, ratio=_PERSISTENCE, broad_m=math.inf)


def _basins(grid: OccupancyGrid, *, ratio: float, broad_m: float) -> IntArray:
    """Return the basins of the clearance. Two merge where it is not below `ratio` times that of the
    lower peak, or not below `broad_m`."""
    free = grid.measured == CellClass.FREE
    clearance = np.pad(_clearance(grid), 1)
    inside = np.flatnonzero(np.pad(free, 1))
    flat = clearance.ravel()
    order = inside[np.argsort(-flat[inside], kind="stable")]
    broad = broad_m / grid.resolution_m
    basins = _segmentation_kernels.flood_basins(flat, order, clearance.shape[1], ratio, broad)
    segments: IntArray = basins.reshape(clearance.shape)[1:-1, 1:-1].copy()
    return segments


def _clearance(grid: OccupancyGrid) -> FloatArray:
    """Return the clearance in cells of the map as measured. Without an occupied cell it is 1
    everywhere, so that all is one segment."""
    clearance = clearance_cells(grid.measured == CellClass.OCCUPIED)
    clearance[~np.isfinite(clearance)] = 1.0
    return clearance


def walled_segments(grid: OccupancyGrid, *, least_m2: float = LEAST_SEGMENT_M2) -> IntArray:
    """Cut free space along wall lines, and at pinched passages between them.

    Parameters
    ----------
    grid
        The map; cells count as they were measured, whatever the robot's radius.
    least_m2
        As in `wall_line_segments`.

    Returns
    -------
    IntArray
        int32 (rows, cols), a segment for each free cell, -1 elsewhere.
    """
    lines = wall_line_segments(grid, least_m2=least_m2).astype(np.int64)
    basins = _basins(grid, ratio=_PINCH, broad_m=_PINCH_M)
    both = np.where((lines >= 0) & (basins >= 0), lines * (int(basins.max()) + 1) + basins, -1)
    found, dense = np.unique(both, return_inverse=True)
    none = int(np.searchsorted(found, 0))
    segments: IntArray = (dense.reshape(both.shape) - none).astype(np.int32)
    return np.maximum(segments, -1)


def wall_line_segments(grid: OccupancyGrid, *, least_m2: float = LEAST_SEGMENT_M2) -> IntArray:
    """Cut free space along the lines of its walls, where they continue behind an opening.

    In the two main directions of the building, a gap between two walls on one line counts as an
    opening: up to 6 m with enough wall on both sides, up to 1.5 m (doors) with enough on one. Cells
    that stay connected form a segment; small ones go to their neighbours. Kin to the wall lines
    of M. Luperto, F. Amigoni: Extracting structure of buildings using layout reconstruction, 2019.

    Parameters
    ----------
    grid
        The map; cells count as they were measured, whatever the robot's radius.
    least_m2
        Square metres of free cells below which a segment goes to its neighbours.

    Returns
    -------
    IntArray
        int32 (rows, cols), a segment for each free cell, -1 elsewhere.
    """
    free = grid.measured == CellClass.FREE
    occupied = grid.measured == CellClass.OCCUPIED
    tilt_rad = main_direction(occupied)
    # Only the rim of a solid mass is a wall: otherwise a space in it would be a gap throughout.
    rim = ndimage.distance_transform_edt(~free) * grid.resolution_m <= _RIM_M
    occupied = occupied & rim
    if abs(tilt_rad) < _LEAST_TILT_RAD:
        cut = _gaps(occupied, free, grid.resolution_m)
    else:
        upright = _turned(occupied, tilt_rad), _turned(free, tilt_rad)
        cut = _turned_back(_gaps(*upright, grid.resolution_m), tilt_rad, grid.shape)
    labels, _ = ndimage.label(free & ~cut)
    areas_m2 = np.bincount(labels.ravel()) * grid.cell_area_m2
    kept = areas_m2 >= least_m2
    kept[0] = False
    segments: IntArray = np.where(kept[labels], labels - 1, -1).astype(np.int32)
    everywhere = np.where(free, np.int32(0), np.int32(-1))
    _segmentation_kernels.grow_labels(segments, everywhere, free.size)
    return segments


def main_direction(occupied: BoolArray) -> float:
    """Return the angle that turns the rows of a grid into the direction of most walls, in radians.

    Parameters
    ----------
    occupied
        bool (rows, cols).

    Returns
    -------
    float
        From -pi/4 to pi/4, counter-clockwise with row 0 at the bottom; 0 without walls.
    """
    weights = np.array([exp(-k * k / 8) for k in range(-8, 9)])  # a deviation of two cells
    smooth = occupied.astype(np.float64)
    for axis in (0, 1):
        smooth = ndimage.correlate1d(smooth, weights / weights.sum(), axis)
    if min(occupied.shape) < 2:  # noqa: PLR2004 - no gradient
        return 0.0
    by_row, by_col = (np.asarray(each) for each in np.gradient(smooth))
    # Four times the angle makes walls and their normals, whichever way they face, one direction.
    steepness: FloatArray = np.hypot(by_row, by_col)
    is_steep = steepness > 0
    by_row, by_col, steepness = by_row[is_steep], by_col[is_steep], steepness[is_steep]
    ahead, aside = by_col * by_col - by_row * by_row, 2 * by_row * by_col
    rights = (ahead * ahead - aside * aside) / (steepness * steepness * steepness)
    ups = 2 * ahead * aside / (steepness * steepness * steepness)
    return atan2(float(ups.sum()), float(rights.sum())) / 4


def _gaps(occupied: BoolArray, free: BoolArray, resolution_m: float) -> BoolArray:
    """Return the cells between walls that continue each other along rows or columns."""
    slack = max(1, round(_WALL_SLACK_M / resolution_m))
    longest, short, window, side, both = (
        max(1, round(length_m / resolution_m))
        for length_m in (_GAP_M, _DOOR_M, _WINDOW_M, _SIDE_M, _BOTH_M)
    )
    gaps = np.zeros_like(free)
    for axis in (0, 1):
        wall = ndimage.binary_dilation(occupied if axis == 0 else occupied.T, _upright(slack))
        other = free if axis == 0 else free.T
        found = _segmentation_kernels.gaps_in_rows(
            np.ascontiguousarray(wall),
            np.ascontiguousarray(other),
            longest,
            short,
            window,
            side,
            both,
            _FREE_SHARE,
        )
        gaps |= found if axis == 0 else found.T
    return gaps & free


def _upright(slack: int) -> BoolArray:
    return np.ones((2 * slack + 1, 1), dtype=np.bool_)


def _rotation(tilt_rad: float) -> FloatArray:
    """Return the matrix that turns offsets (row, col) of an upright image into those of the
    grid."""
    cosine, sine = cos(tilt_rad), sin(tilt_rad)
    return np.array([[cosine, sine], [-sine, cosine]])


def _turned(mask: BoolArray, tilt_rad: float) -> BoolArray:
    """Return a mask on an image that is turned so that walls run along its rows, large enough for
    all."""
    side = math.ceil(math.hypot(*mask.shape)) + 2
    turn = _rotation(tilt_rad)
    middle = (np.array(mask.shape) - 1) / 2
    offset = middle - (turn * ((side - 1) / 2)).sum(axis=1)
    found: BoolArray = ndimage.affine_transform(
        mask.astype(np.uint8), turn, offset, (side, side), order=0
    ).astype(np.bool_)
    return found


def _turned_back(mask: BoolArray, tilt_rad: float, shape: tuple[int, int]) -> BoolArray:
    turn = _rotation(tilt_rad).T
    middle = (np.array(mask.shape) - 1) / 2
    offset = middle - (turn * ((np.array(shape) - 1) / 2)).sum(axis=1)
    found: BoolArray = ndimage.affine_transform(
        mask.astype(np.uint8), turn, offset, shape, order=0
    ).astype(np.bool_)
    # Turned lines of one cell have holes at their steps.
    closed: BoolArray = ndimage.binary_dilation(found, np.ones((2, 2), dtype=np.bool_))
    return closed
