"""Floors brought into one frame, so that lifts lie above each other."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from hybridnav._base.copies import frozen
from hybridnav._base.trig import atan2, cos, hypots, sin
from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet.link_nodes import BuildingGraph, FloorArea, FloorGraph
from hybridnav.ext.fleet.links import Link, LinkEnd
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.checks import checked_type

Pose = tuple[float, float, float]
"""`(x, y, yaw)` of one frame in another, in metres and radians."""


def moved_floor(floor: FloorGraph, pose: Pose) -> FloorGraph:
    """Return a floor in another frame.

    Parameters
    ----------
    floor
        The floor.
    pose
        `(x, y, yaw)` of its frame in the new one, in metres and radians.

    Raises
    ------
    InvalidValueError
        When the pose is not three finite numbers.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, building_graph, moved_floor
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = Building([Floor("0", hn.HybridPlanner(topology))])
    >>> (floor,) = building_graph(house).floors
    >>> moved = moved_floor(floor, (10.0, 0.0, np.pi / 2)).graph.points
    >>> bool(np.allclose(moved, [[10 - y, x] for x, y in floor.graph.points]))
    True
    """
    checked_type("floor", floor, FloorGraph)
    if len(pose) != 3 or not all(map(math.isfinite, pose)):  # noqa: PLR2004
        raise InvalidValueError(f"pose is {pose!r:.80}, expected (x, y, yaw), finite numbers")
    graph = floor.graph
    doors = [
        replace(door, ends=(moved_point(door.ends[0], pose), moved_point(door.ends[1], pose)))
        for door in floor.doors
    ]
    return replace(
        floor,
        graph=replace(
            graph,
            points=moved_points(graph.points, pose),
            lines={edge: moved_points(line, pose) for edge, line in graph.lines.items()},
        ),
        doors=tuple(doors),
        areas=tuple(FloorArea(a.name, a.kind, moved_points(a.outline, pose)) for a in floor.areas),
    )


def align_floors(building: BuildingGraph) -> BuildingGraph:
    """Move floors so that the ends of links lie above each other as well as possible.

    Maps of two floors seldom have one frame. The first floor stays. Floors that links join to it,
    and so on, are moved, and turned where two or more links determine that. It is the rigid motion
    with the least sum of squared distances between the ends of links (Kabsch 1976). Stairs and
    ramps count where no lift leads to the floor. Other floors stay as they are.

    Parameters
    ----------
    building
        The building.

    Returns
    -------
    BuildingGraph
        With the ends of links moved too. Lengths do not change.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, Link, LinkEnd, align_floors
    >>> from hybridnav.ext.fleet import building_graph
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floors = [Floor(name, hn.HybridPlanner(topology)) for name in "12"]
    >>> ends = LinkEnd("1", (0.5, 0.5)), LinkEnd("2", (1.5, 0.5))
    >>> house = Building(floors, [Link(name="lift", kind="lift", ends=ends)])
    >>> align_floors(building_graph(house)).links[0].ends[1].position_m
    (0.5, 0.5)
    """
    checked_type("building", building, BuildingGraph)
    poses: dict[str, Pose] = {building.floors[0].name: (0.0, 0.0, 0.0)}
    while True:
        # The floor with the most links to those that are placed is next.
        pairs = {
            floor.name: _pairs(building.links, floor.name, poses)
            for floor in building.floors
            if floor.name not in poses
        }
        best = max(pairs, key=lambda name: len(pairs[name]), default=None)
        if best is None or not pairs[best]:
            break
        poses[best] = fitted_pose(*(np.array(points) for points in zip(*pairs[best], strict=True)))
    floors = [
        moved_floor(floor, poses[floor.name]) if floor.name in poses else floor
        for floor in building.floors
    ]
    links = [
        replace(link, ends=tuple(_end(end, poses) for end in link.ends)) for link in building.links
    ]
    return replace(building, floors=tuple(floors), links=tuple(links))


def _pairs(
    links: Sequence[Link], floor: str, poses: dict[str, Pose]
) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return each end on a floor, and the mean of the placed ends of its link; only of lifts where
    there is one, because flights of stairs lead sideways."""
    pairs = []
    for link in links:
        end = link.end_on(floor)
        placed = [moved_point(e.position_m, poses[e.floor]) for e in link.ends if e.floor in poses]
        if end is not None and placed:
            x, y = np.mean(placed, axis=0).tolist()
            pairs.append((link.kind == "lift", (end.position_m, (x, y))))
    has_lift = any(is_lift for is_lift, _ in pairs)
    return [pair for is_lift, pair in pairs if is_lift or not has_lift]


def fitted_pose(own: FloatArray, wanted: FloatArray) -> Pose:
    """Return the pose that brings points nearest to others, by least squares."""
    middle, there = own.mean(axis=0), wanted.mean(axis=0)
    (x, y), (u, v) = (own - middle).T, (wanted - there).T
    yaw = atan2(float((x * v - y * u).sum()), float((x * u + y * v).sum()))
    turned_x, turned_y = moved_point((float(middle[0]), float(middle[1])), (0.0, 0.0, yaw))
    return float(there[0]) - turned_x, float(there[1]) - turned_y, yaw


def _end(end: LinkEnd, poses: dict[str, Pose]) -> LinkEnd:
    pose = poses.get(end.floor)
    return end if pose is None else LinkEnd(end.floor, moved_point(end.position_m, pose))


def moved_point(point: tuple[float, float], pose: Pose) -> tuple[float, float]:
    """Return a point in another frame."""
    x, y = moved_points(np.array([point], dtype=np.float64), pose)[0].tolist()
    return x, y


def moved_points(points: FloatArray, pose: Pose) -> FloatArray:
    """Return points in another frame, float64 (n, 2)."""
    x, y, yaw = pose
    cosine, sine = cos(yaw), sin(yaw)
    ahead, aside = points.T
    along = x + cosine * ahead - sine * aside, y + sine * ahead + cosine * aside
    return frozen(np.stack(along, axis=1))


# The pose of a drawn floor on its map, by links; some may be drawn in a wrong place.

_AGREED_M = 0.1
"""Distance in metres up to which the ends of all links agree: files and maps round."""
_MOST_M = 1.0
"""Metres that one link counts at most, however far off it is drawn."""
_WALLS_M = 4.0
"""Metres that count as much as a graph that lies in walls altogether."""
_MOST_PAIRS = 200
"""Pairs of links whose poses are tried."""
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

    `own`: float64 (n, 2), the ends of links in the graph, metres, at least one; `wanted`: float64
    (n, 2), those of the building, in the frame of the map; `graph`: float64 (k, 2), points of the
    graph where a robot should fit, in the frame of `own`.
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
    return hypots(*(moved_points(own, pose) - wanted).T)


def _share_in_walls(points: FloatArray, free: BoolArray, grid: OccupancyGrid) -> float:
    cells = np.floor(grid.frame.positions_of(points)).astype(np.int64)
    is_inside = ((cells >= 0) & (cells < free.shape)).all(axis=1)
    return 1.0 - float(free[tuple(cells[is_inside].T)].sum()) / len(points)
