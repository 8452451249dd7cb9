"""Floor plans that a simulated robot drives in: walls, rims, and what can be reached."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass, Frame, OccupancyGrid
from hybridnav.grid.clearance import clearance_cells

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray


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
    from scipy import ndimage  # noqa: PLC0415 - half a second

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
    labels, _ = ndimage.label(plan.classes == CellClass.FREE)
    reached: BoolArray = labels == labels[row, col]
    return reached
