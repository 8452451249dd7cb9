"""Outlines of few corners that follow walls, and whose common borders neighbours share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from scipy import ndimage

from hybridnav.grid import NO_ROOM, CellClass

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from hybridnav._typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.grid import OccupancyGrid

TOLERANCES_M = (0.2, 0.3, 0.4, 0.6)
"""Tolerances that are tried: side of the square whose area an outline loses with a corner."""
_STRAIGHTENED_M = 0.05
"""How far a corner moves at most to bring walls into line."""
_LEAST_WALL_M = 0.3
_SKEW = 0.1
"""Slope up to which a side counts as one along a wall: six degrees."""
_BAY_M = 0.5
"""Half the width of bays in walls and unexplored cells that an outline runs across."""
_LARGEST_ISLAND_M2 = 4.0
"""Area of furniture and pillars inside rooms; larger islands keep an outline."""
_LEAST_NAMELESS_M2 = 1.0
_DECIMALS = 2
"""Decimals of coordinates: centimetres."""


def areas_of(label_of: IntArray, n_rooms: int, grid: OccupancyGrid) -> list[BaseGeometry]:
    """Return the areas of rooms, x along columns and y along rows, one unit a cell.

    Furniture, pillars, and narrow bays in walls belong to the rooms round them.

    Parameters
    ----------
    label_of
        int32 (rows, cols), -1 for no room. Every room has a free cell.
    n_rooms
        Number of rooms.
    grid
        The map.
    """
    is_kept = kept_cells(label_of, grid)
    region_of = _without_bays(_without_islands(label_of, is_kept, grid), is_kept, grid)
    boxes = ndimage.find_objects(region_of + 1, n_rooms)
    return [_area(region_of, room, *box) for room, box in enumerate(boxes)]


def outlines_of(
    areas: list[BaseGeometry], grid: OccupancyGrid, tolerance_m: float
) -> list[list[FloatArray]]:
    """Return outlines of few corners, straightened to walls.

    Neighbours share the corners of their common border. Free cells near an outline may lie on its
    other side.

    Parameters
    ----------
    areas
        As `areas_of` returned them.
    grid
        The map.
    tolerance_m
        How coarse the outlines are, in metres.

    Returns
    -------
    list
        Rings of each room, outer ones and holes, float64 (n, 2), `(x, y)` in metres, map frame,
        rounded to centimetres, or finer where cells are below 5 cm. Filled by the even-odd rule
        they form the room.
    """
    simple = _simplified(areas, tolerance_m / grid.resolution_m)
    simple = _straightened(simple, grid.resolution_m)
    rings = [_rings(shape, grid) for shape in simple]
    # A room may be too thin for rounded corners.
    return [
        new if _has_area(new) else _rings(area, grid, _DECIMALS + 1)
        for new, area in zip(rings, areas, strict=True)
    ]


def _has_area(rings: list[FloatArray]) -> bool:
    return any(shapely.Polygon(ring).area > 0 for ring in rings)


def kept_cells(label_of: IntArray, grid: OccupancyGrid) -> BoolArray:
    """Return the free cells with a room, and those without that are a square metre in one piece.

    A file of rooms keeps them as they are, bool (rows, cols).
    """
    is_free = grid.measured == CellClass.FREE
    part_of, _ = ndimage.label(is_free & (label_of == NO_ROOM))
    is_many = np.bincount(part_of.ravel()) * grid.resolution_m**2 >= _LEAST_NAMELESS_M2
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
    is_island = np.bincount(padded.ravel()) * grid.resolution_m**2 < _LARGEST_ISLAND_M2
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
    """Return regions grown across narrow bays that hold no free cell and no other region."""
    radius = _BAY_M / grid.resolution_m
    margin = int(radius) + 2
    filled_of = region_of.copy()
    for room, box in enumerate(ndimage.find_objects(region_of + 1)):
        if box is None or radius < 1:
            continue
        window = tuple(slice(max(span.start - margin, 0), span.stop + margin) for span in box)
        inside = np.pad(region_of[window] == room, margin)
        near = ndimage.distance_transform_edt(~inside) <= radius
        closed = ndimage.distance_transform_edt(near) > radius
        part = filled_of[window]
        bays = closed[margin:-margin, margin:-margin] & (part == NO_ROOM) & ~is_kept[window]
        part[bays] = room
    return filled_of


def _area(label_of: IntArray, label: int, rows: slice, cols: slice) -> BaseGeometry:
    """Return the area of the cells of a label, x along columns and y along rows, one unit a
    cell."""
    steps = np.diff(np.pad(label_of[rows, cols] == label, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, starts = np.nonzero(steps == 1)
    _, ends = np.nonzero(steps == -1)
    bottom, left = row + rows.start, cols.start
    return shapely.union_all(shapely.box(starts + left, bottom, ends + left, bottom + 1))


def _simplified(shapes: list[BaseGeometry], tolerance: float) -> list[BaseGeometry]:
    """Return shapes with few corners and the same common borders; the tolerance is in cells."""
    simple = shapely.coverage_simplify(shapes, tolerance)
    # A shape so small that it would vanish keeps its corners.
    return [new if new.area > 0 else old for new, old in zip(simple, shapes, strict=True)]


def _straightened(shapes: list[BaseGeometry], resolution_m: float) -> list[BaseGeometry]:
    """Return shapes whose sides along walls lie on common lines, if they still fit together.

    The corners at both ends of a side along a direction of the walls come to lie on one line, as
    long as no corner moves far.
    """
    points, of_corner = np.unique(
        shapely.get_coordinates(shapes).round(9), axis=0, return_inverse=True
    )
    of_corner = of_corner.reshape(-1)
    _, ring = shapely.get_coordinates(shapely.get_rings(_polygons(shapes)), return_index=True)
    sides = np.stack([of_corner[:-1], of_corner[1:]], axis=1)[ring[1:] == ring[:-1]]
    sides = np.unique(np.sort(sides, axis=1), axis=0)
    if not len(sides):
        return shapes
    turn = _direction(points, sides)
    turned = points @ turn.T
    most = _STRAIGHTENED_M / resolution_m
    for axis in (0, 1):
        step = np.abs(turned[sides[:, 1]] - turned[sides[:, 0]])
        along = (step[:, axis] <= _SKEW * step[:, 1 - axis]) & (
            step[:, 1 - axis] * resolution_m >= _LEAST_WALL_M
        )
        ordered = sides[along][np.argsort(step[along, axis], kind="stable")]
        turned[:, axis] = _lined_up(turned[:, axis], ordered, most)
    moved = turned @ turn
    straight = list(shapely.set_coordinates(np.array(shapes), moved[of_corner]))
    if not (shapely.is_valid(straight).all() and shapely.coverage_is_valid(straight)):
        return shapes
    # Corners on a straight side, where no third room meets, are none any more.
    return _simplified(straight, most / 2)


def _polygons(shapes: list[BaseGeometry]) -> list[BaseGeometry]:
    return [part for part in shapely.get_parts(shapes) if part.geom_type == "Polygon"]


def _direction(points: FloatArray, sides: LongArray) -> FloatArray:
    """Return the rotation that turns most walls along the axes; the identity below a degree."""
    step = (points[sides[:, 1]] - points[sides[:, 0]]) @ np.array([1, 1j])
    # To the fourth power, directions a right angle apart are the same; long walls count more.
    angle = float(np.angle((step**4 / np.abs(step) ** 2).sum())) / 4
    if abs(angle) < np.radians(1):
        angle = 0.0
    return np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])


def _lined_up(values: FloatArray, pairs: LongArray, most: float) -> FloatArray:
    """Return values in which the two of a pair are equal, unless one would change by more than
    `most`; pairs come first that differ least."""
    group = np.arange(len(values))
    members = {n: [n] for n in range(len(values))}
    for one, other in group[pairs].tolist():
        first, second = int(group[one]), int(group[other])
        joined = members[first] + members[second]
        span = values[joined]
        if first == second or span.max() - span.min() > most:
            continue
        members[first] = joined
        group[members.pop(second)] = first
    lined = values.copy()
    for joined in members.values():
        lined[joined] = np.median(values[joined])
    return lined


def _rings(shape: BaseGeometry, grid: OccupancyGrid, decimals: int = _DECIMALS) -> list[FloatArray]:
    """Return the outer rings and holes in metres, rounded as in the file."""
    rings = [ring for part in _polygons([shape]) for ring in shapely.get_rings(part)]
    corners = [shapely.get_coordinates(r)[:-1, ::-1].clip(0, grid.shape) for r in rings]
    decimals = max(decimals, int(np.ceil(-np.log10(grid.resolution_m / 5))))
    return [grid.frame.points_of_grid(ring).round(decimals) + 0.0 for ring in corners]
