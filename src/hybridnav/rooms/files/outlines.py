"""Outlines of few corners, whose common borders neighbours share."""

from __future__ import annotations

from typing import Any

import numpy as np
import shapely
from scipy import ndimage

from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, IntArray
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid
from hybridnav.rooms.files.paint import with_small_parts

TOLERANCE_M = 0.3
"""Side of the square below whose area a corner, with the two beside it, is none."""
_LARGEST_ISLAND_M2 = 4.0
"""Area of furniture and pillars inside rooms; larger islands keep an outline."""
_LEAST_NAMELESS_M2 = 1.0
_LEAST_PART_M2 = 0.25
"""Area below which a part of a room beside its largest has no outline, at 0.3 m: in walls."""
_DECIMALS = 2
"""Decimals of coordinates: centimetres."""


def outlines_of(
    label_of: IntArray, n_rooms: int, grid: OccupancyGrid, tolerance_m: float = TOLERANCE_M
) -> list[list[FloatArray]]:
    """Return outlines of few corners; neighbours share those of their common border.

    Furniture and pillars belong to the rooms round them. Free cells near an outline may lie on its
    other side; parts of a room below 0.25 m2 (at 0.3 m), beside its largest, have none.

    `label_of`: int32 (rows, cols), -1 for no room; every room has a free cell; `n_rooms`: number of
    rooms; `tolerance_m`: corners go whose triangle with the two beside them has less area than a
    square of this side (Visvalingam and Whyatt 1993). Result: rings of each room, outer ones and
    holes, float64 (n, 2), `(x, y)` in metres, map frame, rounded to centimetres, or finer where
    cells are below 5 cm or a room is too thin. Filled by the even-odd rule they form the room.
    """
    if not n_rooms:
        return []
    least_m2 = _LEAST_PART_M2 * min(1.0, tolerance_m / TOLERANCE_M) ** 2
    steps = _coverage(_without_islands(label_of, grid), n_rooms, least_m2 / grid.cell_area_m2)
    simple = shapely.coverage_simplify(steps, tolerance_m / grid.resolution_m)
    decimals = decimals_of(grid)
    rings = [_rings(area, grid, decimals) for area in simple]
    return [
        own
        if any(shapely.Polygon(ring).area > 0 for ring in own)
        else _rings(area, grid, decimals + 1)
        for own, area in zip(rings, steps, strict=True)
    ]


def decimals_of(grid: OccupancyGrid) -> int:
    """Return the decimals of coordinates in metres: centimetres, or a fifth of a cell."""
    decimals = _DECIMALS
    while float(f"1e-{decimals}") > grid.resolution_m / 5:
        decimals += 1
    return decimals


def _rings(area: Any, grid: OccupancyGrid, decimals: int) -> list[FloatArray]:
    """Return the outer rings and holes in metres, rounded as in the file."""
    rings = [ring for part in shapely.get_parts(area) for ring in shapely.get_rings(part)]
    corners = [shapely.get_coordinates(ring)[:-1, ::-1] for ring in rings]
    return [grid.frame.points_of_grid(ring).round(decimals) + 0.0 for ring in corners]


def _without_islands(label_of: IntArray, grid: OccupancyGrid) -> IntArray:
    """Return labels with those of rooms on furniture and pillars.

    Free cells without a room that are a square metre in one piece stay as they are.
    """
    outside = label_of == NO_ROOM
    part_of, _ = ndimage.label(outside & (grid.measured == CellClass.FREE))
    large = np.bincount(part_of.ravel()) * grid.cell_area_m2 >= _LEAST_NAMELESS_M2
    large[0] = False
    spared = large[part_of]
    spared[[0, -1]] = spared[:, [0, -1]] = True
    below = _LARGEST_ISLAND_M2 / grid.cell_area_m2
    return with_small_parts(label_of, outside, below, spared=spared)


def _coverage(region_of: IntArray, n_rooms: int, least: float) -> AnyArray:
    """Return the area of each room, whose corners are those of cells, x along columns.

    Parts of less than the `least` cells are left out, but not the largest part of a room.
    """
    padded = np.pad(region_of, 1, constant_values=NO_ROOM)
    sides = np.concatenate([_sides(padded), _sides(padded.T)[..., ::-1]]) - 1
    lines: Any = shapely.linestrings(sides)
    faces = shapely.get_parts(shapely.polygonize(lines))
    corners, face = shapely.get_coordinates(shapely.get_exterior_ring(faces), return_index=True)
    # The first cell of a face lies above and to the right of its lowest corner, the leftmost one.
    order = np.lexsort((*corners.T, face))
    col, row = corners[order[np.searchsorted(face[order], np.arange(len(faces)))]].astype(int).T
    room_of, size = region_of[row, col], shapely.area(faces)
    areas = []
    for room in range(n_rooms):
        own = np.flatnonzero(room_of == room)
        is_kept = size[own] >= min(least, size[own].max())
        areas.append(shapely.multipolygons(faces[own[is_kept]]))
    return np.array(areas, dtype=object)


def _sides(label_of: IntArray) -> FloatArray:
    """Return the sides between rows of different labels, float64 (n, 2, 2), `(x, y)`.

    Sides on one line with the same labels beside them are one, but where another line may cross.
    """
    below, above = label_of[:-1], label_of[1:]
    differs = below != above
    # A side goes on where both labels do: no third line ends there.
    goes_on: BoolArray = differs[:, 1:] & differs[:, :-1]
    goes_on &= (below[:, 1:] == below[:, :-1]) & (above[:, 1:] == above[:, :-1])
    begins, ends = differs.copy(), differs.copy()
    begins[:, 1:] &= ~goes_on
    ends[:, :-1] &= ~goes_on
    row, first = np.nonzero(begins)
    _, last = np.nonzero(ends)
    y = row + 1.0
    return np.stack([np.stack([first, y], axis=1), np.stack([last + 1.0, y], axis=1)], axis=1)
