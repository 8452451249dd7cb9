"""Where a robot goes next: unexplored places, and places from which it should look again. Public:
`Goals`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from hybridnav._base.moves import legal_moves, length_in_cells
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, Frame, OccupancyGrid
from hybridnav.maps.clearance import clearance_cells
from hybridnav.search.grid_search import costs_from
from hybridnav.topology import TopologicalMap


@dataclass(frozen=True, eq=False)
class Goals:
    """The unexplored places that a robot can drive up to, each with the free cell to drive to.

    A frontier after Yamauchi (1997) is the boundary between free and unexplored cells. In the
    topological map unexplored places are nodes, as in the source paper, and frontiers arcs between
    them and free places; all frontiers of one unexplored place are one goal.

    Examples
    --------
    >>> from hybridnav.ext.live.explore import Goals
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 0.0, 0.5, 0.5, 1.0, 0.5]]), robot_radius_m=0)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    >>> goals = Goals.of(topology, (0, 0), np.zeros(grid.shape, dtype=bool))
    >>> goals.cells, goals.beyond, goals.costs_m
    (array([[0, 1]]), array([[0, 2]]), array([1.]))
    """

    cells: LongArray = field(repr=False)
    """int64 (n, 2), of the free cells beside each place the one that costs least to reach."""
    beyond: LongArray = field(repr=False)
    """int64 (n, 2), the unexplored cell beside it."""
    costs_m: FloatArray = field(repr=False)
    """float64 (n,), length of the shortest path of cells to each from the robot's cell."""
    places: LongArray = field(repr=False)
    """int64 (n,), the unexplored place of each."""
    sizes: LongArray = field(repr=False)
    """int64 (n,), cell sides of the frontiers of each place that the robot can reach."""

    @classmethod
    def of(cls, topology: TopologicalMap, cell: tuple[int, int], left_out: BoolArray) -> Goals:
        """Return the goals that can be reached from a cell, one for each unexplored place.

        Parameters
        ----------
        topology
            The places of the known map.
        cell
            (row, col) of the robot, a free cell.
        left_out
            bool (rows, cols), unexplored cells that are no goals.
        """
        grid = topology.grid
        edges, arc = topology.level.boundary_table
        pairs = np.stack([edges >> 1, (edges >> 1) + np.where(edges & 1, grid.shape[1], 1)], axis=1)
        classes, field_of = grid.classes.ravel(), topology.level.field_of.ravel()
        free = classes[pairs] == CellClass.FREE
        kept = free[:, 0] != free[:, 1]
        pairs, free, arc = pairs[kept], free[kept], arc[kept]
        pairs = np.where(free[:, :1], pairs, pairs[:, ::-1])
        pairs = pairs[~left_out.ravel()[pairs[:, 1]]]
        moves = legal_moves(classes.reshape(grid.shape) == CellClass.FREE, grid.corner_cutting)
        cost = costs_from(moves, cell, pairs[:, 0])
        pairs = pairs[cost[pairs[:, 0]] >= 0]
        place = field_of[pairs[:, 1]]
        order = np.lexsort((pairs[:, 1], pairs[:, 0], cost[pairs[:, 0]], place))
        places, first, sizes = np.unique(place[order], return_index=True, return_counts=True)
        best = pairs[order][first]
        cols = grid.shape[1]
        return cls(
            np.stack(np.divmod(best[:, 0], cols), axis=1),
            np.stack(np.divmod(best[:, 1], cols), axis=1),
            length_in_cells(cost[best[:, 0]]) * grid.resolution_m,
            places.astype(np.int64),
            sizes,
        )

    def __len__(self) -> int:
        return len(self.costs_m)


# Doubtful cells that may close a door, and where to see them from.

DOUBTFUL_BELOW = 0.9
"""Probability below which an occupied cell is doubtful."""


def doubtful_spots(grid: OccupancyGrid, cell: tuple[int, int]) -> LongArray:
    """Return the cells in reach beside what would be in reach without doubtful cells.

    The doubtful occupied cells are taken away. Each connected set of cells that a robot could then
    reach in addition, and from which it could see unexplored cells beside, has one spot: its first
    neighbour, in the order of rows, among the cells that the robot can reach. A cell beside several
    sets counts for one of them.

    `grid`: what the robot knows; `cell`: (row, col) of the robot, a free cell. Returns int64 (n,
    2), (row, col).
    """
    doubtful = (grid.measured == CellClass.OCCUPIED) & (grid.probability < DOUBTFUL_BELOW)
    if not doubtful.any():
        return np.zeros((0, 2), np.int64)
    without = replace(grid, probability=np.where(doubtful, np.float32(0.0), grid.probability))
    reach, more = _connected(grid, cell), _connected(without, cell)
    beyond = ndimage.binary_dilation(without.classes == CellClass.UNEXPLORED)
    parts, n_parts = ndimage.label(more & ~reach)
    leads_on = np.zeros(n_parts + 1, dtype=np.bool_)
    leads_on[parts[beyond]] = True
    leads_on[0] = False
    rows, cols = np.nonzero(ndimage.binary_dilation(leads_on[parts]) & reach)
    part = ndimage.maximum_filter(np.where(leads_on[parts], parts, 0), footprint=_CROSS)[rows, cols]
    _, first = np.unique(part, return_index=True)
    return np.stack([rows[first], cols[first]], axis=1)


def narrow_spots(grid: OccupancyGrid, cell: tuple[int, int]) -> LongArray:
    """Return the cells in reach that are nearest to where only a thinner robot could go on.

    A wall may be mapped a cell too thick. So the cells are looked for that a robot could reach in
    addition if its radius were a cell less: in connected sets, two cells or more off the reach,
    that have unexplored cells beside, or nearer and beside more unexplored cells than it covers.
    Each gap through which they are entered has one spot: the cell in reach nearest to it. A set
    behind two doors has two, for from one door nothing is seen of the other.

    `grid`: what the robot knows; `cell`: (row, col) of the robot, a free cell. Returns int64 (n,
    2), (row, col).
    """
    if grid.robot_radius_m < grid.resolution_m:
        return np.zeros((0, 2), np.int64)
    thin = replace(grid, robot_radius_m=grid.robot_radius_m - grid.resolution_m)
    reach, more = _connected(grid, cell), _connected(thin, cell)
    beside = ndimage.binary_dilation(reach, _SQUARE)
    unexplored, _ = ndimage.label(thin.classes == CellClass.UNEXPLORED)
    parts, _ = ndimage.label(more & ~beside)
    leads_on = np.unique(parts[ndimage.binary_dilation(unexplored > 0)])
    entered = np.isin(parts, leads_on[leads_on > 0]) & ndimage.binary_dilation(beside & more)
    large = (
        np.bincount(unexplored.ravel())
        > math.pi * grid.robot_radius_m * grid.robot_radius_m / grid.cell_area_m2
    )
    large[0] = False
    entered |= more & beside & ~reach & ndimage.binary_dilation(large[unexplored])
    gaps, _ = ndimage.label(entered, _SQUARE)
    if not gaps.any():
        return np.zeros((0, 2), np.int64)
    cells_off, nearest = ndimage.distance_transform_edt(~reach, return_indices=True)
    cells = np.argwhere(gaps)
    order = np.lexsort((cells_off[tuple(cells.T)], gaps[tuple(cells.T)]))
    _, first = np.unique(gaps[tuple(cells[order].T)], return_index=True)
    rows, cols = cells[order[first]].T
    return nearest[:, rows, cols].T.astype(np.int64)


def _connected(grid: OccupancyGrid, cell: tuple[int, int]) -> BoolArray:
    """Return the free cells that a robot in a cell can reach, bool (rows, cols)."""
    labels, _ = ndimage.label(grid.classes == CellClass.FREE)
    return labels == labels[cell]


_CROSS = ndimage.generate_binary_structure(2, 1)
"""A cell and its four neighbours."""
_SQUARE = np.ones((3, 3), np.bool_)
"""A cell and its eight neighbours, which are less than two cells off."""


# Floor plans that a simulated robot drives in: walls, rims, and what can be reached.


def walled(world: OccupancyGrid) -> OccupancyGrid:
    """Return a plan in which all is wall that is not free, and so is a rim round it."""
    walls = np.where(world.measured == CellClass.FREE, np.float32(0.0), np.float32(1.0))
    return replace(rimmed(world, walls, 1.0), least_island_m2=0.0)


def rimmed(grid: OccupancyGrid, probability: NDArray[np.float32], rim: float) -> OccupancyGrid:
    """Return a grid with other probabilities, and a rim round it that is a cell wide."""
    x, y = grid.frame.points_of_grid([-1, -1]).tolist()
    frame = Frame(grid.resolution_m, (x, y), grid.frame.yaw_rad)
    return replace(grid, probability=np.pad(probability, 1, constant_values=rim), frame=frame)


def widest_point(plan: OccupancyGrid) -> tuple[float, float]:
    """Return the point of a walled plan that is farthest from walls."""
    clearance = clearance_cells(plan.measured == CellClass.OCCUPIED)
    cell = np.unravel_index(int(clearance.argmax()), plan.shape)
    x, y = plan.frame.points_of(np.array(cell)).tolist()
    return x, y


def cells_in_reach(plan: OccupancyGrid, start: tuple[float, float]) -> BoolArray:
    """Return the cells of a walled plan that a robot can reach, bool (rows, cols)."""
    try:
        point = np.asarray(start, dtype=np.float64)
    except (TypeError, ValueError):
        point = np.empty(0)
    if point.shape != (2,) or not np.isfinite(point).all():
        raise InvalidValueError(f"the start must be two finite metres (x, y), got {start!r:.60}")
    row, col = plan.frame.cells_of(point).tolist()
    inside = 0 <= row < plan.shape[0] and 0 <= col < plan.shape[1]
    if not inside or plan.classes[row, col] != CellClass.FREE:
        raise InvalidValueError(
            f"the start ({point[0]:g}, {point[1]:g}) is not in a free cell of the plan: choose a "
            f"point on the map that is more than {plan.robot_radius_m:g} m from walls"
        )
    return _connected(plan, (row, col))
