"""Outlines of few corners that follow walls, and whose common borders neighbours share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from scipy import ndimage
from shapely import LineString
from shapely.geometry.base import BaseGeometry

from hybridnav._base.rows import unique_rows
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid
from hybridnav.maps.clearance import closing
from hybridnav.rooms.files.straight import straightened

_SLACK = 1.02
"""Steps of a cell are within a tolerance of a cell, whatever the rounding."""
_COLLINEAR_M = 0.01
"""Distance from a straight line at which a corner is none any more."""
_SHORT_M = 0.2
"""Length up to which a border between two rooms is a corner."""
_DECIMALS = 2
"""Decimals of coordinates: centimetres."""


class Outlines:
    """The outlines of rooms, for any tolerance.

    Furniture, pillars, and narrow bays in walls belong to the rooms round them.

    `label_of`: int32 (rows, cols), -1 for no room. Every room has a free cell. `n_rooms`: number of
    rooms.
    """

    def __init__(self, label_of: IntArray, n_rooms: int, grid: OccupancyGrid) -> None:
        # Loads scipy and numba.
        from hybridnav.rooms.cutting import wall_directions  # noqa: PLC0415

        is_kept = _kept_cells(label_of, grid)
        region_of = _without_bays(_without_islands(label_of, is_kept, grid), is_kept, grid)
        self._grid = grid
        self._steps = Borders.of(region_of, n_rooms)
        self._borders = self._steps.without_short(_SHORT_M / grid.resolution_m)
        self._directions = wall_directions(_rim(region_of), grid.resolution_m)

    def within(self, tolerance_m: float) -> list[list[FloatArray]]:
        """Return outlines of few corners, straightened to walls.

        Neighbours share the corners of their common border. Free cells near an outline may lie on
        its other side.

        `tolerance_m`: how far an outline may lie from the steps of the cells, in metres, before its
        sides are brought into line with walls. Result: rings of each room, outer ones and holes,
        float64 (n, 2), `(x, y)` in metres, map frame, rounded to centimetres, or finer where cells
        are below 5 cm or a room is too thin. Filled by the even-odd rule they form the room.
        """
        side_m = self._grid.resolution_m
        simple = _simplified(self._borders.lines, _SLACK * tolerance_m / side_m)
        straight = straightened(simple, self._directions, side_m)
        if straight is not simple:
            straight = _simplified(straight, _COLLINEAR_M / side_m)
        n_rooms = len(self._borders.chains_of)
        areas = [self._borders.area(room, straight) for room in range(n_rooms)]
        rings = [_rings(area, self._grid) for area in areas]
        return [own if _has_area(own) else self._exact(room) for room, own in enumerate(rings)]

    def _exact(self, room: int) -> list[FloatArray]:
        """Return the outline of a room that is too thin for rounded corners."""
        return _rings(self._steps.area(room, self._steps.lines), self._grid, _DECIMALS + 1)


def _has_area(rings: list[FloatArray]) -> bool:
    return any(shapely.Polygon(ring).area > 0 for ring in rings)


def _rim(region_of: IntArray) -> BoolArray:
    """Return the cells of rooms with another room, or none, above or to the right of them."""
    padded = np.pad(region_of, ((0, 1), (0, 1)), constant_values=-1)
    inner = padded[:-1, :-1]
    return (inner != padded[1:, :-1]) | (inner != padded[:-1, 1:])


def _simplified(lines: BaseGeometry, tolerance: float) -> BaseGeometry:
    """Return chains with few corners, which cross nowhere; the tolerance is in cells.

    They keep their ends and lie within the tolerance (Douglas and Peucker 1973).
    """
    return shapely.simplify(lines, tolerance, preserve_topology=True)


def _rings(area: BaseGeometry, grid: OccupancyGrid, decimals: int = _DECIMALS) -> list[FloatArray]:
    """Return the outer rings and holes in metres, rounded as in the file."""
    rings = [ring for part in shapely.get_parts(area) for ring in shapely.get_rings(part)]
    corners = [shapely.get_coordinates(r)[:-1, ::-1].clip(0, grid.shape) for r in rings]
    decimals += decimals_of(grid) - _DECIMALS
    return [grid.frame.points_of_grid(ring).round(decimals) + 0.0 for ring in corners]


def decimals_of(grid: OccupancyGrid) -> int:
    """Return the decimals of coordinates in metres: centimetres, or a fifth of a cell."""
    decimals = _DECIMALS
    while float(f"1e-{decimals}") > grid.resolution_m / 5:
        decimals += 1
    return decimals


# Regions of rooms for outlines: free cells, with furniture and the bays in walls round them.

_BAY_M = 0.5
"""Half the width of bays in walls and unexplored cells that an outline runs across."""
_SQUARE_M = 0.02
"""Side of the squares of small cells that are taken together where bays are looked for."""
_LARGEST_ISLAND_M2 = 4.0
"""Area of furniture and pillars inside rooms; larger islands keep an outline."""
_LEAST_NAMELESS_M2 = 1.0


def _kept_cells(label_of: IntArray, grid: OccupancyGrid) -> BoolArray:
    """Return the free cells with a room, and those without that are a square metre in one piece,
    bool (rows, cols): outlines grow over no others."""
    is_free = grid.measured == CellClass.FREE
    part_of, _ = ndimage.label(is_free & (label_of == NO_ROOM))
    is_many = np.bincount(part_of.ravel()) * grid.cell_area_m2 >= _LEAST_NAMELESS_M2
    is_many[0] = False
    return (is_free & (label_of != NO_ROOM)) | is_many[part_of]


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


# Borders of regions on a grid, cut where three of them meet.


@dataclass(frozen=True, eq=False)
class Borders:
    """The borders of rooms as chains of corners, each between two regions.

    x lies along columns and y along rows, one unit a cell.
    """

    lines: BaseGeometry
    """The chains, a MultiLineString."""
    chains_of: list[LongArray]
    """The chains round each room."""

    @classmethod
    def of(cls, region_of: IntArray, n_rooms: int) -> Borders:
        """Return the borders of the rooms on a grid.

        `region_of`: int32 (rows, cols), the room of each cell, -1 for none; `n_rooms`: number of
        rooms.
        """
        padded = np.pad(region_of, 1, constant_values=-1)
        sides = [_sides(padded), _sides(padded.T)[..., ::-1]]
        merged = shapely.line_merge(shapely.multilinestrings(np.concatenate(sides) - 1))
        chains = [_from_corner(chain) for chain in shapely.get_parts(merged)]
        beside = np.array([_beside(padded, chain) for chain in chains]).reshape(-1, 2)
        chains_of = [np.flatnonzero((beside == room).any(axis=1)) for room in range(n_rooms)]
        return cls(shapely.MultiLineString(chains), chains_of)

    def area(self, room: int, lines: BaseGeometry) -> BaseGeometry:
        """Return the area of a room, whose chains may have been simplified or moved.

        `lines`: the chains in the same order.
        """
        chains: Any = shapely.get_geometry(lines, self.chains_of[room])
        return shapely.build_area(shapely.MultiLineString(list(chains[shapely.length(chains) > 0])))

    def without_short(self, at_most: float) -> Borders:
        """Return borders on which chains as short as a given length are points.

        All corners where chains meet that short chains join become one, in their middle. If borders
        would then cross, or a part of a room would go, the result is these borders.

        `at_most`: length in cells.
        """
        chains = shapely.get_parts(self.lines)
        if not len(chains):
            return self
        points, chain = shapely.get_coordinates(chains, return_index=True)
        begins = np.searchsorted(chain, np.arange(len(chains)))
        ends = np.append(begins[1:], len(chain)) - 1
        corners, _, at, _ = unique_rows(points[[begins, ends]].reshape(-1, 2))
        begin, end = at.reshape(2, -1)
        short = (shapely.length(chains) <= at_most) & (begin != end)
        group = _joined(len(corners), begin[short], end[short])
        count = np.bincount(group)[:, None]
        middles = np.stack([np.bincount(group, xy) for xy in corners.T], axis=1) / count
        places = middles[group]
        points[begins], points[ends] = places[begin], places[end]
        inner = short[chain]
        inner[begins] = inner[ends] = False
        points[inner] = places[begin[chain[inner]]]
        moved_chains = list(shapely.get_parts(shapely.linestrings(points, indices=chain)))
        moved = Borders(shapely.MultiLineString(moved_chains), self.chains_of)
        long = [one for one, is_short in zip(moved_chains, short, strict=True) if not is_short]
        is_sound = shapely.is_simple(shapely.MultiLineString(long))
        return moved if is_sound and moved._n_parts() == self._n_parts() else self

    def _n_parts(self) -> list[int]:
        """Return the number of parts of each room."""
        areas = [self.area(room, self.lines) for room in range(len(self.chains_of))]
        return [int(shapely.get_num_geometries(area)) for area in areas]


def _sides(label_of: IntArray) -> FloatArray:
    """Return the sides between rows of different labels, float64 (n, 2, 2), `(x, y)`.

    Sides on one line with the same labels beside them are one, but where another line may cross.
    """
    below, above = label_of[:-1], label_of[1:]
    differs = below != above
    # A side goes on where both labels do: no third line ends there.
    goes_on = differs[:, 1:] & differs[:, :-1]
    goes_on &= (below[:, 1:] == below[:, :-1]) & (above[:, 1:] == above[:, :-1])
    begins, ends = differs.copy(), differs.copy()
    begins[:, 1:] &= ~goes_on
    ends[:, :-1] &= ~goes_on
    row, first = np.nonzero(begins)
    _, last = np.nonzero(ends)
    y = row + 1.0
    return np.stack([np.stack([first, y], axis=1), np.stack([last + 1.0, y], axis=1)], axis=1)


def _joined(count: int, begin: LongArray, end: LongArray) -> LongArray:
    """Return the number of the connected set of each of some nodes, joined by edges."""
    from scipy.sparse import coo_array  # noqa: PLC0415 - on demand
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415

    edges = coo_array((np.ones(len(begin), dtype=np.int8), (begin, end)), (count, count))
    return connected_components(edges, directed=False)[1].astype(np.int64)


def _from_corner(chain: LineString) -> LineString:
    """Return a chain that begins at a corner, if it is closed: its begin always stays."""
    points = shapely.get_coordinates(chain)
    if (points[0] != points[-1]).any():
        return chain
    ring = points[:-1]
    # The outermost corner in a direction that is no wall's.
    first = int(np.argmax(ring[:, 0] + 0.618 * ring[:, 1]))
    return shapely.LineString(np.roll(ring, -first, axis=0)[[*range(len(ring)), 0]])


def _beside(padded: IntArray, chain: BaseGeometry) -> tuple[int, int]:
    """Return the labels on both sides of a chain."""
    (x, y), (to_x, to_y) = shapely.get_coordinates(chain)[:2]
    row, col = int(min(y, to_y)) + 1, int(min(x, to_x)) + 1
    if y == to_y:
        return int(padded[row - 1, col]), int(padded[row, col])
    return int(padded[row, col - 1]), int(padded[row, col])
