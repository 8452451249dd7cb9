"""Local maps: the metric map of a place in a frame of its own (the source paper's section 2)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.maps import CellClass, Frame, OccupancyGrid

if TYPE_CHECKING:
    from hybridnav.pyramid import Level


Pose = tuple[float, float, float]
"""`(x, y, yaw)` of one frame in another, in metres and radians."""


def local_grid(level: Level, vertex: int) -> OccupancyGrid:
    """Return the map of one field in a frame with its origin at the surviving cell.

    Cells that belong to no field are kept as far as they can decide on the classes of its own.
    """
    grid, side_m = level.grid, level.grid.resolution_m
    reach = math.ceil(grid.robot_radius_m / side_m)
    low_row, low_col, high_row, high_col = level.boxes[vertex].tolist()
    kept = _window(grid.shape, (low_row, low_col, high_row, high_col), 1 + reach)
    # Obstacles so far away decide on the cells near the rim of what is kept.
    window = _window(grid.shape, (low_row, low_col, high_row, high_col), 1 + 2 * reach)
    field_of = level.field_of[window]
    obstacle = grid.measured[window] == CellClass.OCCUPIED
    near = np.zeros(grid.shape, dtype=np.bool_)
    near[kept] = True
    own = (field_of == vertex) | obstacle | (near[window] & (field_of < 0))
    row, col = level.cells[vertex].tolist()
    first_row, first_col = window[0].start, window[1].start
    origin_m = ((first_col - col - 0.5) * side_m, (first_row - row - 0.5) * side_m)
    return replace(
        grid,
        probability=np.where(own, grid.probability[window], np.float32(np.nan)),
        frame=Frame(side_m, origin_m),
        name=f"{grid.name}, place {vertex}",
        least_island_m2=0.0,
    )


def _window(
    shape: tuple[int, int], box: tuple[int, int, int, int], margin: int
) -> tuple[slice, slice]:
    """Return the rows and columns of a box of cells with a margin, cut to the grid."""
    rows, cols = shape
    return (
        slice(max(box[0] - margin, 0), min(box[2] + 1 + margin, rows)),
        slice(max(box[1] - margin, 0), min(box[3] + 1 + margin, cols)),
    )


def local_pose(level: Level, vertex: int) -> Pose:
    """Return the pose of a field's own frame in the map frame."""
    x, y = level.grid.frame.points_of(level.cells[vertex]).tolist()
    return x, y, level.grid.frame.yaw_rad


def transform_of(level: Level, arc: int) -> Pose:
    """Return the pose of the frame of an arc's second field in that of the first."""
    one, other = level.cells[level.arcs[arc]]
    x, y = ((other - one)[::-1] * level.grid.resolution_m).tolist()
    return x, y, 0.0
