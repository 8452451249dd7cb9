"""Stops with names: their cells, and the best positions of stops in rooms."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.grid.clearance import clearance_cells
from hybridnav.grid.names import did_you_mean
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.stops import cheapest_stops

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.config import PlannerSettings
    from hybridnav.grid import OccupancyGrid, RoomLabels
    from hybridnav.planner.closed import ClosedCells
    from hybridnav.topology import TopologicalMap

At = Literal["anywhere", "point"]
"""Position in a named room at which a path starts or ends."""

_ROUNDING_CELLS = 1e-6
_FACING_M = 1.0
"""Length of path that determines the heading of a robot at a stop with a name."""


def stop_points(
    topology: TopologicalMap,
    settings: PlannerSettings,
    stops: Sequence[ArrayLike | str],
    *,
    at: At = "anywhere",
    closed: ClosedCells | None = None,
) -> list[ArrayLike]:
    """Return a point for each stop, so that the path through all of them is shortest.

    Parameters
    ----------
    topology
        The map.
    settings
        Settings of the planner, which determine the cells that may be entered, and whether points
        have headings.
    stops
        Two or more points `(x, y)` in metres, names of rooms or of named points that passed
        `check_names`. With OMPL in a space with headings, points are `(x, y, yaw)`, radians.
    at
        Position in a room: anywhere, or at the room's point.
    closed
        Cells that are closed for this query.

    Returns
    -------
    list
        Points `(x, y)` in metres, map frame; given points are unchanged. If no path visits all
        stops, or a point cannot be entered, rooms are represented by their points, and so is a room
        without a cell at whose centre the robot's footprint fits with any heading. In a space with
        headings, a name becomes `(x, y, yaw)` and faces along the shortest path of cells that
        leads to it; the first stop faces along the path that leaves it.

    Raises
    ------
    InvalidValueError
        When `at` is another word.
    """
    if at not in get_args(At):
        raise InvalidValueError(f"at must be 'anywhere' or 'point', got {at!r:.80}")
    enterable = topology.grid.enterable(allow_unexplored=settings.allow_unexplored)
    if closed is not None:
        enterable = enterable.copy()
        enterable.ravel()[closed.flat] = False
    fixed: list[Any] = [_point_of(topology, stop, at) for stop in stops]
    points = _chosen(topology, enterable, stops, fixed, _radius_m(settings))
    if settings.ompl is not None and settings.ompl.has_heading:
        return _facing_the_way(topology, enterable, stops, points)
    return points


def check_names(topology: TopologicalMap, stops: Sequence[ArrayLike | str]) -> None:
    """Refuse stops with unusable names, before anything is computed for the others.

    Raises
    ------
    InvalidValueError
        When a name is not known, a room has no free cell, or the map has no rooms.
    """
    if any(isinstance(stop, str) for stop in stops):
        check_stops(topology.rooms.labels, topology.grid, stops)


def check_stops(rooms: RoomLabels, grid: OccupancyGrid, stops: Sequence[ArrayLike | str]) -> None:
    """Refuse unknown names, and rooms that the robot does not fit in.

    Parameters
    ----------
    rooms
        The rooms, read or found; no pyramid is needed.
    grid
        The map, inflated by the robot's radius.
    stops
        Points, and names of rooms or of named points.

    Raises
    ------
    InvalidValueError
        When a stop is refused; the message has the name and the nearest known ones.
    """
    for stop in stops:
        if not isinstance(stop, str) or (stop in rooms.points and stop not in rooms.names):
            continue
        if stop not in rooms.names:
            known = (*rooms.names, *rooms.points)
            raise InvalidValueError(
                f"no room or point is called {stop!r:.90}{did_you_mean(stop, known)}"
            )
        if not (grid.classes[rooms.label_of == rooms.index(stop)] == CellClass.FREE).any():
            raise InvalidValueError(
                f"room {stop!r} has no free cell for this robot radius, {grid.robot_radius_m:g} m: "
                "choose a smaller one, or another room"
            )


def _chosen(
    topology: TopologicalMap,
    enterable: BoolArray,
    stops: Sequence[ArrayLike | str],
    fixed: list[Any],
    radius_m: float,
) -> list[Any]:
    """Return the given points, and for rooms the points that make the path shortest."""
    if all(point is not None for point in fixed):
        return fixed
    grid = topology.grid
    rooms = {
        stop: _where_it_fits(grid, _cells_in_room(topology, enterable, stop), radius_m)
        for stop, point in zip(stops, fixed, strict=True)
        if point is None and isinstance(stop, str)
    }
    fixed = [
        topology.rooms.point_of(str(stop)) if point is None and not len(rooms[str(stop)]) else point
        for stop, point in zip(stops, fixed, strict=True)
    ]
    sets = [
        rooms[str(stop)] if point is None else _cell_at(topology, enterable, point)
        for stop, point in zip(stops, fixed, strict=True)
    ]
    found = None
    if all(map(len, sets)):
        found = cheapest_stops(enterable, sets, corner_cutting=grid.corner_cutting)
    if found is None:
        return [
            topology.rooms.point_of(str(stop)) if point is None else point
            for stop, point in zip(stops, fixed, strict=True)
        ]
    centres = grid.frame.points_of(np.stack(np.divmod(found, grid.shape[1]), axis=1))
    return [
        centre if point is None else point for point, centre in zip(fixed, centres, strict=True)
    ]


def _facing_the_way(
    topology: TopologicalMap,
    enterable: BoolArray,
    stops: Sequence[ArrayLike | str],
    points: list[Any],
) -> list[Any]:
    """Return the points, with headings along a shortest path of cells for stops with names."""
    grid = topology.grid
    search = GridSearch(enterable, corner_cutting=grid.corner_cutting)
    cells = [_cell_at(topology, enterable, point) for point in points]
    arriving = [math.nan]
    leaving = []
    for first, last in itertools.pairwise(cells):
        way = None
        if len(first) and len(last):
            ends = (divmod(int(cell[0]), grid.shape[1]) for cell in (first, last))
            way = search.search(*ends).cells
        leaving.append(math.nan if way is None else _heading(grid, way[: _steps(grid) + 1]))
        arriving.append(math.nan if way is None else _heading(grid, way[-_steps(grid) - 1 :]))
    leaving.append(math.nan)
    posed = list(points)
    for number, stop in enumerate(stops):
        if isinstance(stop, str):
            known = [yaw for yaw in (arriving[number], leaving[number]) if math.isfinite(yaw)]
            posed[number] = (*np.asarray(points[number]).tolist(), known[0] if known else 0.0)
    return posed


def _steps(grid: OccupancyGrid) -> int:
    return max(1, round(_FACING_M / grid.resolution_m))


def _heading(grid: OccupancyGrid, way: LongArray) -> float:
    """Return the direction of a piece of a path in the map frame; NaN if it has no length."""
    points = grid.frame.points_of(way[[0, -1]])
    x, y = (points[1] - points[0]).tolist()
    return math.atan2(y, x) if len(way) > 1 else math.nan


def _point_of(topology: TopologicalMap, stop: ArrayLike | str, at: At) -> ArrayLike | None:
    """Return the point of a stop by itself; None for anywhere in a room."""
    if not isinstance(stop, str):
        return stop
    rooms = topology.rooms
    if stop not in rooms.names:
        return rooms.labels.points[stop]
    return rooms.point_of(stop) if at == "point" else None


def _cells_in_room(topology: TopologicalMap, enterable: BoolArray, name: str) -> LongArray:
    labels = topology.rooms.labels
    return np.flatnonzero(enterable & (labels.label_of == labels.index(name)))


def _radius_m(settings: PlannerSettings) -> float:
    """Return the circumscribed radius of a robot's footprint about its base, in metres.

    It is 0 for a disc, by which the map was inflated.
    """
    ompl = settings.ompl
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
    fitting: LongArray = cells[distance >= radius_cells]
    return fitting


def _to_sides(occupied: BoolArray) -> FloatArray:
    """Return the exact distance from each cell's centre to the nearest occupied square, in cells.

    It is computed on points half a cell apart: the point of a square nearest to any centre is one
    of its nine.
    """
    rows, cols = occupied.shape
    within = np.zeros((2 * rows + 1, 2 * cols + 1), dtype=np.bool_)
    for up, right in itertools.product(range(3), repeat=2):
        within[up : up + 2 * rows : 2, right : right + 2 * cols : 2] |= occupied
    distance: FloatArray = clearance_cells(within)[1::2, 1::2] / 2
    return distance


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
