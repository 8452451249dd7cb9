"""How sure arcs are: the thresholds of the map at which each of them exists."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import frozen
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.clearance import greatest_within
from hybridnav.pyramid.cracks import endpoints_of
from hybridnav.pyramid.kernels.certainty import grow_cores

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, ByteArray, FloatArray, IntArray, LongArray

_FOREST = np.int64, np.uint8, np.float64, np.int64, np.uint8
"""Types of the arrays of a forest of cells."""


@dataclass(frozen=True, eq=False)
class Certainty:
    """The thresholds at which each arc of a level exists, one of them moved at a time.

    The *core* of a field is what holds together at moved thresholds: the 4-connected component,
    among its cells that keep their class, of more than half of all its cells. An arc between two
    fields exists while one of the cell pairs of its boundary joins the cores of both. A self-loop
    exists while a closed path inside the core of its field separates the two ends of the line of
    its dual edge. With free threshold U1 and occupied threshold U2, an arc exists exactly for
    `free_from <= U1 < free_below` at the map's U2, and for `U2 > occupied_above` at the map's U1.

    Occupied cells take all cells within the robot's radius from free places, so U2 decides on
    narrow doors. Cells that `drop_islands` made unexplored stay so at all thresholds.

    Examples
    --------
    >>> hall = np.array([[0.02, 0.02, 0.15, 0.02, 0.02]])
    >>> grid = hn.OccupancyGrid(hall, robot_radius_m=0)
    >>> level = hn.DualGraphPyramid.build(grid, merge_distance_m=2.0)[-1]
    >>> level.certainty.free_from.round(2), level.certainty.free_below
    (array([0.15]), array([0.65]))
    >>> level.certainty.margin.round(3)
    array([0.046])
    """

    free_threshold: float
    """U1 of the map."""
    occupied_threshold: float
    """U2 of the map."""
    free_from: FloatArray = field(repr=False)
    """float64 (n_arcs,), the least U1; 0 between unexplored places."""
    free_below: FloatArray = field(repr=False)
    """float64 (n_arcs,), U1 must be less; U2 of the map between free places."""
    occupied_above: FloatArray = field(repr=False)
    """float64 (n_arcs,), U2 must be greater; U1 of the map where no cell decides."""

    @property
    def margin(self) -> FloatArray:
        """float64 (n_arcs,), by how much either threshold may move, in either direction, before the
        arc ends to exist."""
        low, high = self.free_threshold, self.occupied_threshold
        lengths = low - self.free_from, self.free_below - low, high - self.occupied_above
        margin: FloatArray = np.maximum(np.minimum.reduce(lengths), 0.0)  # they are float32
        return margin

    def columns(self) -> dict[str, list[float]]:
        """Return the ranges and margins as attributes of edges, a list of numbers each."""
        names = ("free_from", "free_below", "occupied_above", "margin")
        return {name: getattr(self, name).tolist() for name in names}


def certainty_of(
    grid: OccupancyGrid,
    field_of: IntArray,
    classes: ByteArray,
    arcs: IntArray,
    boundary_table: tuple[LongArray, LongArray],
) -> Certainty:
    """Return the thresholds at which arcs exist: bottlenecks, by joining cells in order.

    Takes time in proportion to the cells, but for sorting them; and once more for the cells of
    fields with several self-loops, for each of these.

    Parameters
    ----------
    grid
        The map.
    field_of
        int32 (rows, cols), the vertex of each cell, -1 for none.
    classes
        uint8 (n_vertices,), `CellClass` of each vertex.
    arcs
        int32 (n_arcs, 2), the vertices that each arc joins.
    boundary_table
        Base edges of all boundaries and the arc of each, sorted by arc.
    """
    low, high = grid.free_threshold, grid.occupied_threshold
    free, reached = _keys(grid, field_of)
    is_free = classes[arcs] == CellClass.FREE
    times, closed = _times(free, field_of, arcs, boundary_table)
    joined = np.where(_loops(arcs), closed, _least(times.max(axis=1), arcs, boundary_table))
    sides = _sides(times, field_of, arcs, boundary_table)
    mixed = is_free[:, 0] != is_free[:, 1]
    free_from = np.where(mixed, np.where(is_free, sides, 0.0).sum(axis=1), joined)
    free_below = -np.where(mixed, np.where(is_free, 0.0, sides).sum(axis=1), joined)
    free_from[~is_free.any(axis=1)] = 0.0
    free_below[is_free.all(axis=1)] = high
    times, closed = _times(reached, field_of, arcs, boundary_table)
    above = np.where(_loops(arcs), closed, _least(times.max(axis=1), arcs, boundary_table))
    return Certainty(
        low,
        high,
        frozen(free_from),
        frozen(np.minimum(free_below, high)),
        frozen(np.maximum(above, low)),
    )


def _keys(grid: OccupancyGrid, field_of: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return what must not exceed U1, negative for unexplored cells, and what U2 must exceed.

    Both are float64 (rows * cols,); -inf where no threshold changes the class.
    """
    p = grid.probability.astype(np.float64)
    unexplored = (grid.classes == CellClass.UNEXPLORED) & (field_of >= 0)
    keys = np.where(unexplored, -p, p)
    keys[np.isnan(p) | (unexplored & (grid.measured == CellClass.FREE))] = -math.inf
    radius = grid.robot_radius_m / grid.resolution_m
    reached = greatest_within(np.where(np.isnan(p), -math.inf, p), radius_cells=radius)
    return keys.ravel(), reached.ravel()


def _loops(arcs: IntArray) -> BoolArray:
    loops: BoolArray = arcs[:, 0] == arcs[:, 1]
    return loops


def _times(
    keys: FloatArray,
    field_of: IntArray,
    arcs: IntArray,
    boundary_table: tuple[LongArray, LongArray],
) -> tuple[FloatArray, FloatArray]:
    """Return the keys at which both cells of each base edge of boundaries are in the cores of
    their fields, (n, 2), and those at which self-loops are closed, (n_arcs,)."""
    labels, cols = field_of.ravel(), field_of.shape[1]
    cells = np.flatnonzero(labels >= 0)
    order = cells[np.argsort(keys[cells], kind="stable")]
    most = np.bincount(labels[cells]) // 2 + 1
    edges, of_arc = boundary_table
    asked = np.stack(endpoints_of(edges, cols), axis=1)
    closed = np.full(len(arcs), np.inf)
    crossed = np.zeros(2 * keys.size, np.uint8)
    forest = tuple(np.empty(keys.size, kind) for kind in _FOREST)
    times, _ = grow_cores(order, keys, labels, most, crossed, forest, asked.ravel(), cols)
    left = np.flatnonzero(_loops(arcs))
    while left.size:  # one self-loop of each field at a time
        fields, first = np.unique(arcs[left, 0], return_index=True)
        loops = left[first]
        lines = edges[np.isin(of_arc, loops)]
        np.bitwise_xor.at(crossed, lines, np.uint8(1))
        order = order[np.isin(labels[order], fields)]
        _, when = grow_cores(order, keys, labels, most, crossed, forest, asked[:0, 0], cols)
        crossed[lines] = 0
        closed[loops] = when[fields]
        left = np.delete(left, first)
    return times.reshape(-1, 2), closed


def _least(
    times: FloatArray, arcs: IntArray, boundary_table: tuple[LongArray, LongArray]
) -> FloatArray:
    """Return the least time over the base edges of each arc."""
    least = np.full(len(arcs), np.inf)
    np.minimum.at(least, boundary_table[1], times)
    return least


def _sides(
    times: FloatArray,
    field_of: IntArray,
    arcs: IntArray,
    boundary_table: tuple[LongArray, LongArray],
) -> FloatArray:
    """Return the least time on each of the two sides of arcs, float64 (n_arcs, 2)."""
    edges, of_arc = boundary_table
    first = field_of.ravel()[edges >> 1]
    turned = first != arcs[of_arc, 0]
    times = np.where(turned[:, None], times[:, ::-1], times)
    columns = [_least(column, arcs, boundary_table) for column in times.T]
    return np.stack(columns, axis=1)
