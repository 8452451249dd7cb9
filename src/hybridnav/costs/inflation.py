"""Nav2's inflation: the cost of a cell by its distance from the nearest obstacle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._trig import exp
from hybridnav.grid import CellClass
from hybridnav.grid.clearance import clearance_cells

if TYPE_CHECKING:
    from hybridnav._typing import ByteArray
    from hybridnav.grid import OccupancyGrid

LETHAL, INSCRIBED, HIGHEST = 254, 253, 252
"""Costs of an occupied cell, of one within the inscribed radius, and the highest of all others."""


def cost_at(distance_m: float, scaling: float, inscribed_m: float) -> int:
    """Return the cost of a cell at a distance from an obstacle, as Nav2's `computeCost` does.

    Parameters
    ----------
    distance_m, inscribed_m
        Distance between the centres of cells, and inscribed radius, in metres.
    scaling
        `cost_scaling_factor`, 1 / m.

    Notes
    -----
    `nav2_costmap_2d/inflation_layer.hpp` (open-navigation/navigation2): a conversion to unsigned
    char truncates.
    """
    if distance_m == 0:
        return LETHAL
    if distance_m <= inscribed_m:
        return INSCRIBED
    return int(HIGHEST * exp(-scaling * (distance_m - inscribed_m)))


def inflated_costs(
    grid: OccupancyGrid, inflation_m: float, scaling: float, inscribed_m: float
) -> ByteArray:
    """Return the cost of each cell, uint8 (rows, cols), from 0 to 254.

    Nav2 rounds the inflation radius up to whole cells (`Costmap2D::cellDistance`), and inflates a
    cell whose centre is that far.
    """
    resolution_m = grid.resolution_m
    distance = clearance_cells(grid.measured == CellClass.OCCUPIED)
    reach = min(math.ceil(inflation_m / resolution_m), sum(grid.shape))
    costs = np.zeros(grid.shape, dtype=np.uint8)
    is_near = distance <= reach
    # Distances between centres are roots of whole numbers.
    squared = np.rint(distance[is_near] ** 2).astype(np.int64)
    present, at = np.unique(squared, return_inverse=True)
    cost_of = [
        cost_at(math.sqrt(number) * resolution_m, scaling, inscribed_m)
        for number in present.tolist()
    ]
    costs[is_near] = np.array(cost_of, dtype=np.uint8)[at]
    return costs
