"""The pose of a drawn floor on its map, by links of which some may be drawn in a wrong place."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.building.align import fitted_pose, moved_points

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._typing import BoolArray, FloatArray
    from hybridnav.building.align import Pose
    from hybridnav.grid import OccupancyGrid

_AGREED_M = 0.1
"""Distance in metres up to which the ends of all links agree: files and maps round."""
_MOST_M = 1.0
"""Metres that one link counts at most, however far off it is drawn."""
_WALLS_M = 4.0
"""Metres that count as much as a graph that lies in walls altogether."""
_MOST_PAIRS = 200
"""Pairs of links of which poses are tried."""
_MOST_POINTS = 2000
"""Points of the graph that are looked up on the map."""
_SPREAD = 3.0
"""Distance, over the median one, up to which a link is taken to be drawn well."""


def placed_pose(
    own: FloatArray, wanted: FloatArray, graph: FloatArray, grid: OccupancyGrid
) -> Pose:
    """Return the pose that brings the ends of links to those of the building.

    Where one rigid motion brings them all there, it is that with the least squares. Otherwise one
    or more are drawn in a wrong place. Then poses by one, two or all of them are compared, and the
    best one has the least sum of distances, each counted up to 1 m, and of 4 m times the share of
    the graph's points that lie in walls or outside the map. The links that are near to theirs by
    this pose are fitted once more, by least squares.

    Parameters
    ----------
    own
        float64 (n, 2), the ends of links in the graph, metres, at least one.
    wanted
        float64 (n, 2), those of the building, in the frame of the map.
    graph
        float64 (k, 2), points of the graph where a robot should fit, in the frame of `own`.
    grid
        The map.
    """
    whole = fitted_pose(own, wanted)
    if _away(own, wanted, whole).max() <= _AGREED_M:
        return whole
    free = grid.enterable()
    points = graph[:: max(1, len(graph) // _MOST_POINTS)]

    def badness(pose: Pose) -> float:
        away = np.minimum(_away(own, wanted, pose), _MOST_M).sum()
        in_walls = _share_in_walls(moved_points(points, pose), free, grid)
        return round(float(away) + _WALLS_M * in_walls, 6)

    best = min(itertools.chain([whole], _poses(own, wanted)), key=badness)
    away = _away(own, wanted, best)
    middle = float(np.sort(away)[(len(away) - 1) // 2])
    is_near = away <= min(max(_AGREED_M, _SPREAD * middle), _MOST_M)
    return fitted_pose(own[is_near], wanted[is_near]) if is_near.sum() > 1 else best


def _poses(own: FloatArray, wanted: FloatArray) -> Iterator[Pose]:
    """Yield a shift by each link, and the motions that bring one link of a pair to its place, or
    both near to theirs, and the other into its direction."""
    for one, there in zip(own, wanted, strict=True):
        yield float(there[0] - one[0]), float(there[1] - one[1]), 0.0
    pairs = itertools.combinations(range(len(own)), 2)
    for pair in map(list, itertools.islice(pairs, _MOST_PAIRS)):
        pose = fitted_pose(own[pair], wanted[pair])
        yield pose
        for off in wanted[pair] - moved_points(own[pair], pose):
            yield pose[0] + float(off[0]), pose[1] + float(off[1]), pose[2]


def _away(own: FloatArray, wanted: FloatArray, pose: Pose) -> FloatArray:
    """Return the distance of each end from that of the building, float64 (n,), in metres."""
    found: FloatArray = np.hypot(*(moved_points(own, pose) - wanted).T)
    return found


def _share_in_walls(points: FloatArray, free: BoolArray, grid: OccupancyGrid) -> float:
    cells = np.floor(grid.frame.positions_of(points)).astype(np.int64)
    is_inside = ((cells >= 0) & (cells < free.shape)).all(axis=1)
    return 1.0 - float(free[tuple(cells[is_inside].T)].sum()) / len(points)
