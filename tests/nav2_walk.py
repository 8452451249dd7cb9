"""Nav2's collision walk over an edge of a route graph, and nothing of hybridnav's.

It follows `LineIterator` of nav2_util and the collision monitor of nav2_route: the ends of an edge
become cells by a floor, and every cell that Bresenham's line visits between them must cost less
than one within the inscribed radius.
"""

import math
from collections.abc import Iterator

import numpy as np
from scipy import ndimage

from hybridnav import OccupancyGrid


class Costmap:
    """The cells of a map that its costs let a disc enter.

    A cell costs 253 or more when its centre lies within the radius of the centre of an occupied
    cell, or when it is unknown.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        is_lethal = grid.probability >= np.float32(grid.occupied_threshold)
        self.is_free = ~is_lethal & (grid.probability <= np.float32(grid.free_threshold))
        if is_lethal.any():
            away_m = ndimage.distance_transform_edt(~is_lethal) * grid.frame.resolution_m
            self.is_free &= away_m > grid.robot_radius_m
        self.frame = grid.frame

    def cell_of(self, x: float, y: float) -> tuple[float, float]:
        """Column and row of a point, before the floor; Nav2's maps have no yaw, this one may."""
        (x0, y0), yaw = self.frame.origin_m, self.frame.yaw_rad
        along = math.cos(yaw) * (x - x0) + math.sin(yaw) * (y - y0)
        across = math.cos(yaw) * (y - y0) - math.sin(yaw) * (x - x0)
        return along / self.frame.resolution_m, across / self.frame.resolution_m

    def depth(self, x: float, y: float) -> float:
        """How deep a point lies inside a free cell, in cells; 0 for none."""
        col, row = self.cell_of(x, y)
        if not self._is_free(math.floor(col), math.floor(row)):
            return 0.0
        return min(min(value % 1, 1 - value % 1) for value in (col, row))

    def collides(self, tail: tuple[float, float], head: tuple[float, float]) -> bool:
        """Whether Nav2's walk from a point to another one meets a cell that may not be entered."""
        ends = [math.floor(value) for end in (tail, head) for value in self.cell_of(*end)]
        return not all(self._is_free(col, row) for col, row in line_cells(*ends))

    def _is_free(self, col: int, row: int) -> bool:
        rows, cols = self.is_free.shape
        return 0 <= row < rows and 0 <= col < cols and bool(self.is_free[row, col])


def line_cells(x: int, y: int, to_x: int, to_y: int) -> Iterator[tuple[int, int]]:
    """The cells of `nav2_util::LineIterator`, one after the other."""
    delta_x, delta_y = abs(to_x - x), abs(to_y - y)
    step_x, step_y = (1 if to_x >= x else -1), (1 if to_y >= y else -1)
    if delta_x >= delta_y:
        denominator, added = delta_x, delta_y
        sometimes, always = (0, step_y), (step_x, 0)
    else:
        denominator, added = delta_y, delta_x
        sometimes, always = (step_x, 0), (0, step_y)
    numerator = denominator // 2
    for _ in range(denominator + 1):
        yield x, y
        numerator += added
        if numerator >= denominator:
            numerator -= denominator
            x, y = x + sometimes[0], y + sometimes[1]
        x, y = x + always[0], y + always[1]
