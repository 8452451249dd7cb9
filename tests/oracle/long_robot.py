"""A long robot among rooms: its poses against the raw cells, by shapely alone."""

import itertools
import math
from typing import Any

import numpy as np
import shapely

import hybridnav as hn

CORNERS = ((0.9, 0.3), (0.9, -0.3), (-0.9, -0.3), (-0.9, 0.3))
"""A robot of 0.6 x 1.8 m."""
DOOR_M = 0.9
RESOLUTION_M = 0.05
FINE_M = 0.01
"""Metres and radians between the poses that the independent check looks at."""


def rooms() -> hn.OccupancyGrid:
    """Six rooms of 20 x 12 m in all with doors of 0.9 m, and a dead end 1.2 m wide."""
    occupied = np.zeros((240, 400), dtype=np.float32)
    occupied[:2] = occupied[-2:] = occupied[:, :2] = occupied[:, -2:] = 1
    door = round(DOOR_M / RESOLUTION_M)
    for col, doors in ((120, (40, 160)), (260, (60, 180))):
        occupied[:, col : col + 3] = 1
        for row in doors:
            occupied[row : row + door, col : col + 3] = 0
    occupied[120:123] = 1
    for col in (60, 180, 320):
        occupied[120:123, col : col + door] = 0
    occupied[4:50, 340:343] = occupied[4:50, 367:370] = 1
    return hn.OccupancyGrid(occupied, hn.Frame(RESOLUTION_M), robot_radius_m=0.3, name="doors")


class Walls:
    """The raw occupied cells of a map whose frame is at the origin, asked by shapely alone."""

    def __init__(self, grid: hn.OccupancyGrid) -> None:
        low = np.argwhere(grid.measured == hn.CellClass.OCCUPIED)[:, ::-1] * grid.resolution_m
        self._cells = shapely.STRtree(shapely.box(*low.T, *(low + grid.resolution_m).T))
        self._size = np.array(grid.shape)[::-1] * grid.resolution_m

    def collides(self, x: float, y: float, yaw: float) -> bool:
        """Whether the robot overlaps a cell by more than a thousandth of its side."""
        cosine, sine = math.cos(yaw), math.sin(yaw)
        corners = np.array(CORNERS) @ np.array([[cosine, sine], [-sine, cosine]]) + (x, y)
        body = shapely.Polygon(corners).buffer(-1e-3 * RESOLUTION_M)
        return bool(len(self._cells.query(body, predicate="intersects")))

    def pose(self, rng: np.random.Generator) -> Any:
        """A random pose that collides with nothing, 5 cm from touching."""
        while True:
            pose = np.append(rng.uniform(0.4, self._size - 0.4), rng.uniform(-math.pi, math.pi))
            if not any(self.collides(*(pose + shift)) for shift in _SHIFTS):
                return pose

    def touched(self, poses: Any, *, curved: bool) -> int:
        """Poses in collision, of those `FINE_M` apart between some poses: on a straight line with
        an even turn, or on the arc that joins them."""
        count = 0
        for first, second in itertools.pairwise(poses):
            turn = math.remainder(second[2] - first[2], math.tau)
            offset = (second - first)[:2]
            steps = math.ceil(math.hypot(*offset, turn) / FINE_M) + 1
            for along in np.linspace(0, 1, steps):
                yaw = first[2] + along * turn
                x, y = first[:2] + along * offset
                if curved and abs(turn) > 1e-9:
                    x, y = first[:2] + _on_arc(first[2], turn, offset, along)
                count += self.collides(x, y, yaw)
        return count


def _on_arc(heading: float, turn: float, chord: Any, along: float) -> Any:
    """Where a share of the turn leads on the arc over a chord, from its start."""
    middle = np.array([math.cos(heading + turn / 2), math.sin(heading + turn / 2)])
    radius = float(chord @ middle) / (2 * math.sin(turn / 2))
    now = heading + along * turn
    return radius * np.array([math.sin(now) - math.sin(heading), math.cos(heading) - math.cos(now)])


_SHIFTS = 0.05 * np.array([[0, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0]])
