"""The record of a decimation, from which every level is rebuilt. Public: `Linkage`."""

from __future__ import annotations

import math
import operator
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps import OccupancyGrid, RoomLabels
from hybridnav.pyramid.darts import Resists
from hybridnav.pyramid.kernels.fields import field_extents, label_fields, level_sizes
from hybridnav.pyramid.kernels.hulls import field_hulls, hull_distances

Linkage = Literal["throats", "survivor", "radius", "diameter"]
"""Rules for the distance that must be below U_d where two fields merge."""

SURVIVES = 255
"""End of a vertex or edge that still exists at the apex."""

MAX_LEVELS = 126
"""Levels that one byte per edge can distinguish; real maps have 10 to 15."""


@dataclass(frozen=True, eq=False)
class Record:
    """Level and kind of the end of each vertex and edge of the base: 7 bytes a cell.

    All arrays are flat, in the order of cells (row-major) and of base edges (two a cell).
    """

    vertex_end: ByteArray
    """0: no vertex; SURVIVES; else the level at which the cell stops being a surviving cell."""
    vertex_parent: IntArray
    """The surviving cell that a contracted vertex went into."""
    edge_end: ByteArray
    """0: no edge; SURVIVES; else 2 * level, plus 1 where the edge is removed, not contracted."""

    def up_to(self, level: int) -> Record:
        """Return a copy with which all that is left at a level survives."""
        vertex_end, edge_end = self.vertex_end.copy(), self.edge_end.copy()
        vertex_end[vertex_end > level] = SURVIVES
        edge_end[edge_end >= min(2 * level + 2, SURVIVES)] = SURVIVES
        return Record(vertex_end, self.vertex_parent.copy(), edge_end)

    def sizes(self, cols: int, n_levels: int) -> list[LevelSize]:
        """Count what each level has, without making the levels; `cols` are those of the grid."""
        ends = self.vertex_end, self.vertex_parent, self.edge_end
        return [LevelSize(*size) for size in level_sizes(*ends, cols, n_levels).tolist()]


class Patch(NamedTuple):
    """What differs between the records of two maps: whole places, in a window."""

    low: tuple[int, int]
    """Row and column of the first cell of the window."""
    was: BoolArray
    """bool (rows, cols), the cells of places that are no more, or other ones than before."""
    record: Record
    """Record of the window's cells, for the places that are new, or other ones; parents are flat
    cells of the window. `vertex_end` of all other cells is 0."""

    def fields(self, level: int) -> tuple[IntArray, LongArray]:
        """Return the vertex of a level that holds each cell of the window, int32 (rows, cols), -1
        for none, and the surviving cells, flat in the window."""
        record = self.record
        label, survivors = label_fields(record.vertex_end, record.vertex_parent, level)
        return label.reshape(self.was.shape), survivors

    def place_hulls(self) -> tuple[LongArray, IntArray]:
        """Return the convex hulls of the places, as `Level.hulls` of the map."""
        label, survivors = self.fields(SURVIVES - 1)
        cols = self.was.shape[1]
        boxes = field_extents(label.ravel(), cols, len(survivors))[1]
        start, points = field_hulls(label.ravel(), cols, boxes)
        return start, points + np.array(self.low, np.int32)


def farthest_apart(hulls: tuple[LongArray, IntArray], pairs: LongArray) -> LongArray:
    """Return the largest squared distance between cells of the fields of each pair, (n, 2)."""
    squared: LongArray = hull_distances(*hulls, pairs.astype(np.int32))
    return squared


@dataclass(frozen=True)
class LevelSize:
    """Size of one level."""

    vertices: int
    arcs: int
    self_loops: int


@dataclass
class BuildStats:
    """Statistics of a build: sizes from the base to the apex, seconds of processor-bound stages."""

    sizes: list[LevelSize] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)
    tops: list[int] = field(default_factory=list)
    """Levels at which contraction ended: the places; then, as far as there are any, the regions and
    the rooms; and the apex, where contraction went on above the places."""


# Checks of what a pyramid is built with, and of vertices.


def checked_settings(merge_distance_m: float, linkage: str, seed: int) -> int:
    """Return the seed if all settings of a pyramid are in range."""
    try:
        is_none = math.isnan(merge_distance_m)
    except TypeError:
        is_none = True
    if is_none or merge_distance_m <= 0:
        raise InvalidValueError(
            f"merge distance must be a positive number of metres, got {brief(merge_distance_m)}"
        )
    if linkage not in get_args(Linkage):
        raise InvalidValueError(
            f"linkage must be one of {', '.join(get_args(Linkage))}, got {brief(linkage)}"
        )
    try:
        return operator.index(seed)
    except TypeError:
        raise InvalidValueError(f"seed must be a whole number, got {seed!r:.80}") from None


def checked_most_cells(most_cells: int) -> int:
    """Return the most cells of a region."""
    try:
        found = 0 if isinstance(most_cells, bool) else operator.index(most_cells)
    except TypeError:
        found = 0
    if found < 1:
        raise InvalidValueError(
            f"regions have at most {brief(most_cells)} cells, expected a whole number >= 1"
        )
    return found


def check_fit(grid: OccupancyGrid, rooms: RoomLabels | None, resistance: Resists | None) -> None:
    """Refuse rooms and resistances of other grids, and both together."""
    if rooms is not None and rooms.label_of.shape != grid.shape:
        raise InvalidValueError(
            f"rooms are labels of {rooms.label_of.shape} cells, the grid has {grid.shape}"
        )
    if resistance is not None and (rooms is not None or resistance.shape != grid.shape):
        raise InvalidValueError(
            f"a resistance was given with rooms or for a map not of {grid.shape} cells: give "
            "it alone, made from this map"
        )


def checked_vertices(vertices: ArrayLike, level: int, n_vertices: int) -> LongArray:
    """Return indices of vertices of a level as an array."""
    found = np.asarray(vertices)
    if found.size == 0:
        return found.astype(np.int64)
    if not np.issubdtype(found.dtype, np.integer):
        raise InvalidValueError(f"vertices must be whole numbers, got {vertices!s:.80}")
    if found.min() < 0 or found.max() >= n_vertices:
        raise InvalidValueError(
            f"vertices of level {level} are 0 to {n_vertices - 1}, got {vertices!s:.80}"
        )
    return found.astype(np.int64)
