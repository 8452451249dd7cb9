"""Waypoints with names: their cells, and the best positions of waypoints in rooms."""

import itertools
import math
from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.trig import atan2
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps import CellClass, OccupancyGrid, RoomLabels
from hybridnav.maps.clearance import clearance_cells
from hybridnav.maps.costs import CostLayer
from hybridnav.maps.names import did_you_mean
from hybridnav.planning import PlannerSettings
from hybridnav.planning.endpoints import check_at
from hybridnav.search.directed import DirectedSides
from hybridnav.search.found import ClosedCells
from hybridnav.search.grid_search import GridSearch, cheapest_waypoints
from hybridnav.topology import TopologicalMap

At = Literal["anywhere", "point"]
"""Position in a named room at which a path starts or ends."""

_ROUNDING_CELLS = 1e-6
_FACING_M = 1.0
"""Length of path that determines the heading of a robot at a waypoint with a name."""


class _Space(NamedTuple):
    """What a search between waypoints moves in."""

    topology: TopologicalMap
    enterable: BoolArray
    """bool (rows, cols), cells that may be entered."""
    units: IntArray | None
    """int32 (rows, cols), factors in units; None for lengths."""
    one_way: DirectedSides | None
    """Sides that may be crossed in one direction only; None for none."""


def points_of_waypoints(  # noqa: PLR0913 - the last three have defaults
    topology: TopologicalMap,
    settings: PlannerSettings,
    waypoints: Sequence[ArrayLike | str],
    *,
    at: At = "anywhere",
    closed: ClosedCells | None = None,
    costs: CostLayer | None = None,
) -> list[ArrayLike]:
    """Return a point for each waypoint, so that the path through all of them is cheapest.

    `settings`: settings of the planner, which determine the cells that may be entered, and whether
    points have headings; `waypoints`: two or more points `(x, y)` in metres, names of rooms or of
    named points that passed `check_names`. With OMPL in a space with headings, points are
    `(x, y, yaw)`, radians. `at`: position in a room: anywhere, or at the room's point; `closed`:
    what is closed for this query; `costs`: costs of the cells; None makes costs lengths.
    Result: points `(x, y)` in metres, map frame; given points are unchanged. If no path visits all
    waypoints, or a point cannot be entered, rooms are represented by their points, and so is a room
    without a cell at whose centre the robot's footprint fits with any heading. In a space with
    headings, a name becomes `(x, y, yaw)` and faces along the shortest path of cells that leads to
    it; the first waypoint faces along the path that leaves it. Raises `InvalidValueError` when `at`
    is another word.
    """
    check_at(at)
    enterable = topology.grid.enterable(allow_unexplored=settings.allow_unexplored)
    if closed is not None:
        enterable = enterable.copy()
        enterable.ravel()[closed.flat] = False
    fixed: list[Any] = [_point_of(topology, waypoint, at) for waypoint in waypoints]
    one_way = None if closed is None else closed.one_way
    space = _Space(topology, enterable, None if costs is None else costs.units, one_way)
    points = _chosen(space, waypoints, fixed, _radius_m(settings))
    if settings.sampling is not None and settings.sampling.has_heading:
        return _facing_along_paths(space, waypoints, points)
    return points


def check_names(topology: TopologicalMap, waypoints: Sequence[ArrayLike | str]) -> None:
    """Refuse waypoints with unusable names, before anything is computed for the others.

    Raises `InvalidValueError` when a name is not known, a room has no free cell, or the map has no
    rooms.
    """
    if any(isinstance(waypoint, str) for waypoint in waypoints):
        check_waypoints(topology.rooms.labels, topology.grid, waypoints)


def check_waypoints(
    rooms: RoomLabels, grid: OccupancyGrid, waypoints: Sequence[ArrayLike | str]
) -> None:
    """Refuse unknown names, and rooms that the robot does not fit in.

    `rooms`: the rooms, read or found; no pyramid is needed; `grid`: the map, inflated by the
    robot's radius; `waypoints`: points, and names of rooms or of named points. Raises
    `InvalidValueError` when a waypoint is refused; the message has the name and the nearest known
    ones.
    """
    for waypoint in waypoints:
        if not isinstance(waypoint, str) or (
            waypoint in rooms.points and waypoint not in rooms.names
        ):
            continue
        if waypoint not in rooms.names:
            known = (*rooms.names, *rooms.points)
            raise InvalidValueError(
                f"no room or point is called {waypoint!r:.80}{did_you_mean(waypoint, known)}"
            )
        if not (grid.classes[rooms.label_of == rooms.index(waypoint)] == CellClass.FREE).any():
            raise InvalidValueError(
                f"room {brief(waypoint)} has no free cell for this robot radius, "
                f"{grid.robot_radius_m:g} m: "
                "choose a smaller one, or another room"
            )


def _chosen(
    space: _Space, waypoints: Sequence[ArrayLike | str], fixed: list[Any], radius_m: float
) -> list[Any]:
    """Return the given points, and for rooms the points that make the path cheapest."""
    if all(point is not None for point in fixed):
        return fixed
    topology, enterable, units, one_way = space
    grid = topology.grid
    rooms = {
        waypoint: _where_it_fits(grid, _cells_in_room(topology, enterable, waypoint), radius_m)
        for waypoint, point in zip(waypoints, fixed, strict=True)
        if point is None and isinstance(waypoint, str)
    }
    fixed = [
        topology.rooms.point_of(str(waypoint))
        if point is None and not len(rooms[str(waypoint)])
        else point
        for waypoint, point in zip(waypoints, fixed, strict=True)
    ]
    sets = [
        rooms[str(waypoint)] if point is None else _cell_at(topology, enterable, point)
        for waypoint, point in zip(waypoints, fixed, strict=True)
    ]
    found = None
    if all(map(len, sets)):
        found = cheapest_waypoints(
            enterable, sets, corner_cutting=grid.corner_cutting, units=units, one_way=one_way
        )
    if found is None:
        return [
            topology.rooms.point_of(str(waypoint)) if point is None else point
            for waypoint, point in zip(waypoints, fixed, strict=True)
        ]
    centres = grid.frame.points_of(np.stack(np.divmod(found, grid.shape[1]), axis=1))
    return [
        centre if point is None else point for point, centre in zip(fixed, centres, strict=True)
    ]


def _facing_along_paths(
    space: _Space, waypoints: Sequence[ArrayLike | str], points: list[Any]
) -> list[Any]:
    """Return the points, with headings along a cheapest path of cells for waypoints with names."""
    topology, enterable, units, one_way = space
    grid = topology.grid
    search = GridSearch(enterable, corner_cutting=grid.corner_cutting, units=units)
    cells = [_cell_at(topology, enterable, point) for point in points]
    arriving = [math.nan]
    leaving = []
    for first, last in itertools.pairwise(cells):
        path = None
        if len(first) and len(last):
            endpoints = (divmod(int(cell[0]), grid.shape[1]) for cell in (first, last))
            path = search.search(*endpoints, one_way=one_way).cells
        leaving.append(math.nan if path is None else _heading(grid, path[: _steps(grid) + 1]))
        arriving.append(math.nan if path is None else _heading(grid, path[-_steps(grid) - 1 :]))
    leaving.append(math.nan)
    posed = list(points)
    for number, waypoint in enumerate(waypoints):
        if isinstance(waypoint, str):
            known = [yaw for yaw in (arriving[number], leaving[number]) if math.isfinite(yaw)]
            posed[number] = (*np.asarray(points[number]).tolist(), known[0] if known else 0.0)
    return posed


def _steps(grid: OccupancyGrid) -> int:
    return max(1, round(_FACING_M / grid.resolution_m))


def _heading(grid: OccupancyGrid, path: LongArray) -> float:
    """Return the direction of a segment of a path in the map frame; NaN if it has no length."""
    points = grid.frame.points_of(path[[0, -1]])
    x, y = (points[1] - points[0]).tolist()
    return atan2(y, x) if len(path) > 1 else math.nan


def _point_of(topology: TopologicalMap, waypoint: ArrayLike | str, at: At) -> ArrayLike | None:
    """Return the point of a waypoint by itself; None for anywhere in a room."""
    if not isinstance(waypoint, str):
        return waypoint
    rooms = topology.rooms
    if waypoint not in rooms.names:
        return rooms.labels.points[waypoint]
    return rooms.point_of(waypoint) if at == "point" else None


def _cells_in_room(topology: TopologicalMap, enterable: BoolArray, name: str) -> LongArray:
    labels = topology.rooms.labels
    return np.flatnonzero(enterable & (labels.label_of == labels.index(name)))


def _radius_m(settings: PlannerSettings) -> float:
    """Return the circumscribed radius of a robot's footprint about its base, in metres.

    It is 0 for a disc, by which the map was inflated.
    """
    ompl = settings.sampling
    if ompl is None or ompl.footprint is None:
        return 0.0
    # Loads shapely.
    from hybridnav.refine.footprint import Footprint  # noqa: PLC0415

    return Footprint.of(ompl.footprint).circumscribed_radius_m


def _where_it_fits(grid: OccupancyGrid, cells: LongArray, radius_m: float) -> LongArray:
    """Return the flat cells whose centres are at least a radius away from measured occupied cells.

    At these centres a footprint fits with any heading.
    """
    if radius_m <= 0 or not len(cells):
        return cells
    radius_cells = radius_m / grid.resolution_m + _ROUNDING_CELLS
    rows, cols = np.divmod(cells, grid.shape[1])
    # Cells farther away do not matter; the window has a cell of slack on every side.
    reach = min(math.ceil(radius_cells), max(grid.shape)) + 1
    row, col = max(rows.min() - reach, 0), max(cols.min() - reach, 0)
    window = grid.measured[row : rows.max() + reach + 1, col : cols.max() + reach + 1]
    distance = _to_sides(window == CellClass.OCCUPIED)[rows - row, cols - col]
    return cells[distance >= radius_cells]


def _to_sides(occupied: BoolArray) -> FloatArray:
    """Return the exact distance from each cell's centre to the nearest occupied square, in cells.

    It is computed on points half a cell apart: the point of a square nearest to any centre is one
    of its nine.
    """
    rows, cols = occupied.shape
    within = np.zeros((2 * rows + 1, 2 * cols + 1), dtype=np.bool_)
    for up, right in itertools.product(range(3), repeat=2):
        within[up : up + 2 * rows : 2, right : right + 2 * cols : 2] |= occupied
    return clearance_cells(within)[1::2, 1::2] / 2


def _cell_at(topology: TopologicalMap, enterable: BoolArray, point: ArrayLike) -> LongArray:
    """Return the cell of a point, or no cell if it cannot be entered.

    The status of the plan then states the reason.
    """
    try:
        row, col = topology.grid.frame.cells_of(np.asarray(point)[:2]).tolist()
    except (InvalidValueError, TypeError, ValueError, IndexError):
        return np.empty(0, dtype=np.int64)
    rows, cols = enterable.shape
    if not (0 <= row < rows and 0 <= col < cols and enterable[row, col]):
        return np.empty(0, dtype=np.int64)
    return np.array([row * cols + col], dtype=np.int64)
