"""Regions of rooms for outlines: free cells, with furniture and the bays in walls round them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

from hybridnav.grid import NO_ROOM, CellClass
from hybridnav.grid.clearance import closing

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, IntArray
    from hybridnav.grid import OccupancyGrid

_BAY_M = 0.5
"""Half the width of bays in walls and unexplored cells that an outline runs across."""
_SQUARE_M = 0.02
"""Side of the squares of small cells that are taken together where bays are looked for."""
_LARGEST_ISLAND_M2 = 4.0
"""Area of furniture and pillars inside rooms; larger islands keep an outline."""
_LEAST_NAMELESS_M2 = 1.0


def regions_of(label_of: IntArray, grid: OccupancyGrid) -> IntArray:
    """Return rooms grown over furniture, pillars, and narrow bays in walls, int32 (rows, cols).

    Parameters
    ----------
    label_of
        int32 (rows, cols), -1 for no room. Every room has a free cell.
    grid
        The map.
    """
    is_kept = _kept_cells(label_of, grid)
    return _without_bays(_without_islands(label_of, is_kept, grid), is_kept, grid)


def _kept_cells(label_of: IntArray, grid: OccupancyGrid) -> BoolArray:
    """Return the free cells with a room, and those without that are a square metre in one piece,
    bool (rows, cols): outlines grow over no others."""
    is_free = grid.measured == CellClass.FREE
    part_of, _ = ndimage.label(is_free & (label_of == NO_ROOM))
    is_many = np.bincount(part_of.ravel()) * grid.cell_area_m2 >= _LEAST_NAMELESS_M2
    is_many[0] = False
    kept: BoolArray = (is_free & (label_of != NO_ROOM)) | is_many[part_of]
    return kept


def _without_islands(label_of: IntArray, is_kept: BoolArray, grid: OccupancyGrid) -> IntArray:
    """Return labels without parts in walls, with those of rooms on furniture and pillars."""
    region_of = label_of.copy()
    for room, box in enumerate(ndimage.find_objects(label_of + 1)):
        if box is None:
            continue
        inside = label_of[box] == room
        part_of, n_parts = ndimage.label(inside)
        is_held = np.zeros(n_parts + 1, dtype=np.bool_)
        is_held[part_of[inside & is_kept[box]]] = True
        region_of[box][inside & ~is_held[part_of]] = NO_ROOM
    outside = region_of == NO_ROOM
    padded, _ = ndimage.label(np.pad(outside, 1, constant_values=True))
    is_island = np.bincount(padded.ravel()) * grid.cell_area_m2 < _LARGEST_ISLAND_M2
    is_island[[0, padded[0, 0]]] = False
    part_of = padded[1:-1, 1:-1]
    is_island[part_of[is_kept & outside]] = False
    island = is_island[part_of]
    if island.any():
        row, col = ndimage.distance_transform_edt(
            outside, return_distances=False, return_indices=True
        )
        region_of[island] = region_of[row[island], col[island]]
    return region_of


def _without_bays(region_of: IntArray, is_kept: BoolArray, grid: OccupancyGrid) -> IntArray:
    """Return regions grown across narrow bays that hold no free cell and no other region.

    Cells below 2 cm are taken together, in squares that a region touches or does not.
    """
    size = max(1, int(_SQUARE_M / grid.resolution_m))
    radius = _BAY_M / (grid.resolution_m * size)
    margin = int(radius) + 2
    filled_of = region_of.copy()
    for room, box in enumerate(ndimage.find_objects(region_of + 1)):
        if box is None or radius < 1:
            continue
        window = tuple(
            slice(max(span.start - margin * size, 0), span.stop + margin * size) for span in box
        )
        part = filled_of[window]
        squares = _squares(region_of[window] == room, size)
        bays = closing(squares, radius) & ~squares
        bays = bays.repeat(size, axis=0).repeat(size, axis=1)[: part.shape[0], : part.shape[1]]
        part[bays & (part == NO_ROOM) & ~is_kept[window]] = room
    return filled_of


def _squares(cells: BoolArray, size: int) -> BoolArray:
    """Return whether squares of cells hold one, bool."""
    rows, cols = cells.shape
    padded = np.pad(cells, ((0, -rows % size), (0, -cols % size)))
    shape = (padded.shape[0] // size, size, padded.shape[1] // size, size)
    return np.asarray(padded.reshape(shape).any(axis=(1, 3)))
