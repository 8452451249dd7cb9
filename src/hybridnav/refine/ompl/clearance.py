"""Length weighted by nearness to obstacles."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.refine.ompl._clearance_kernels import weighted_length

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray
    from hybridnav.config import OmplSettings
    from hybridnav.grid import OccupancyGrid


class Clearance:
    """Length weighted by nearness to obstacles, on one map.

    A metre costs 1 + `clearance_weight` in a cell beside a cell that may not be entered, linearly
    less with the distance of the centres, and 1 from `clearance_m` on. The table takes four bytes a
    cell.

    Parameters
    ----------
    grid
        The map.
    settings
        Settings with distance and weight.
    allow_unexplored
        Whether unexplored cells may be entered.
    """

    def __init__(
        self, grid: OccupancyGrid, settings: OmplSettings, *, allow_unexplored: bool = False
    ) -> None:
        from scipy import ndimage  # noqa: PLC0415 - half a second that other objectives do not need

        free = grid.enterable(allow_unexplored=allow_unexplored)
        away_m = ndimage.distance_transform_edt(free) * grid.resolution_m
        nearness = np.clip(1 - away_m / settings.clearance_m, 0, 1)
        self._factors = (1 + settings.clearance_weight * nearness).astype(np.float32)
        self._frame = grid.frame.for_kernels

    def cost(self, x0: float, y0: float, x1: float, y1: float) -> float:
        """Return the cost of a straight line, metres, map frame."""
        cost: float = weighted_length(self._factors, self._frame, x0, y0, x1, y1)
        return cost

    def cost_of(self, points: FloatArray) -> float:
        """Return the cost of a path, points (n, 2) or states (n, 3)."""
        steps = itertools.pairwise(points[:, :2].tolist())
        return math.fsum(self.cost(*first, *second) for first, second in steps)
