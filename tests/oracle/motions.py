"""Motions of a robot judged by shapely, state by state in fine steps, in the map frame."""

import math
from typing import Any

import numpy as np
import shapely

from hybridnav.maps import CellClass, OccupancyGrid


class ShapelyRobot:
    """A robot and a map as shapely geometries: the outline, occupied ground, ground for the base.

    `corners_m`: corners of the outline, robot frame; None for a disc on an inflated grid; `inside`:
    cells that the base may stand on, None for all.
    """

    def __init__(self, grid: OccupancyGrid, corners_m: Any, inside: Any = None) -> None:
        stand = grid.enterable() if inside is None else grid.enterable() & inside
        self.corners_m = corners_m
        self.occupied = _ground(grid, grid.measured == CellClass.OCCUPIED)
        self.stand = _ground(grid, stand)

    def is_hit(self, poses: Any, *, grown_m: float) -> bool:
        """Whether the robot, grown or shrunk by a little, fails in any of some poses.

        `poses`: `(x, y, yaw)`, (n, 3); `grown_m`: below 0 only what goes deeper than that counts,
        above 0 what comes as near as that too.
        """
        bases = shapely.points(poses[:, :2])
        ground = self.stand.buffer(max(-grown_m, 0), join_style="mitre")
        reach = bases if grown_m <= 0 else shapely.buffer(bases, grown_m)
        shapely.prepare(ground)
        if not shapely.covers(ground, reach).all():
            return True
        if self.corners_m is None:
            return False
        bodies = shapely.buffer(self._outlines(poses), grown_m, join_style="mitre")
        shapely.prepare(self.occupied)
        return bool(shapely.intersects(self.occupied, bodies).any())

    def _outlines(self, poses: Any) -> Any:
        cosine, sine = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
        x, y = np.transpose(self.corners_m)
        xs = poses[:, 0, None] + cosine * x - sine * y
        ys = poses[:, 1, None] + sine * x + cosine * y
        return shapely.polygons(np.stack([xs, ys], axis=-1))


def turning_poses(start: Any, goal: Any, n: int) -> Any:
    """Poses of an even motion that turns the short way, (n, 3)."""
    share = np.linspace(0, 1, n)[:, None]
    way = np.subtract(goal, start)
    way[2] = math.remainder(way[2], math.tau)
    return np.asarray(start) + share * way


def _ground(grid: OccupancyGrid, cells: Any) -> Any:
    low = np.argwhere(cells)
    around = np.array([[0, 0], [0, 1], [1, 1], [1, 0]])
    corners = grid.frame.points_of_grid(low[:, None] + around)
    # Rounding must not leave gaps between neighbours.
    return shapely.union_all(shapely.polygons(corners), grid_size=1e-9)


def drive_phases(start: Any, goal: Any, n: int, *, backwards: bool = False) -> list[list[Any]]:
    """What a robot does that turns on the spot, drives straight, and turns again.

    Returns the phases in order; of each the ways to do it, as poses (n, 3). A turn goes either way
    round.
    """
    way = np.subtract(goal, start)[:2]
    if not way.any():
        return [_turns(start, goal[2], n)]
    heading = math.atan2(way[1], way[0]) + math.pi * backwards
    first, last = np.append(start[:2], heading), np.append(goal[:2], heading)
    return [_turns(start, heading, n), [turning_poses(first, last, n)], _turns(last, goal[2], n)]


def _turns(pose: Any, heading: float, n: int) -> list[Any]:
    """Poses of a turn on the spot, the short way and the other way round."""
    short = math.remainder(heading - pose[2], math.tau)
    ways = []
    for turn in (short, short - math.copysign(math.tau, short)):
        poses = np.tile(np.asarray(pose, dtype=float), (n, 1))
        poses[:, 2] += np.linspace(0, turn, n)
        ways.append(poses)
    return ways
