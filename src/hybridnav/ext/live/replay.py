"""Replays of maps that change: grid by grid, or scan by scan through a mapper."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.ext.live.identities import Flips, Numbered, flips_between, shift_of
from hybridnav.ext.live.pyramid import OnlinePyramid
from hybridnav.ext.live.regions import OnlineRegions
from hybridnav.ext.live.room_versions import OnlineRooms
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.checks import checked_type
from hybridnav.pyramid import DualGraphPyramid

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from hybridnav._base.typing import BoolArray
    from hybridnav.ext.live.mapping import LaserScan, Mapper
    from hybridnav.ext.live.pyramid import Update
    from hybridnav.ext.live.regions import RegionsUpdate
    from hybridnav.ext.live.room_versions import RoomsUpdate
    from hybridnav.maps import RoomLabels


@dataclass(frozen=True, eq=False)
class ReplayStep:
    """A map of a replay, with its places, its rooms and, if asked for, its regions.

    Examples
    --------
    >>> from hybridnav.ext.live import replay
    >>> grid = hn.OccupancyGrid(np.zeros((8, 8)), hn.Frame(0.25), robot_radius_m=0)
    >>> first, second = replay([grid, grid])
    >>> second.number, second.rooms.numbers, second.update.died
    (1, (1,), ())
    """

    number: int
    """Number of the map, from 0."""
    places: OnlinePyramid
    """The places."""
    rooms: OnlineRooms
    """The newest rooms; they may be some maps old."""
    update: Update | None
    """What became of the places; None for the first map."""
    rooms_update: RoomsUpdate | None
    """What became of the rooms; None where they were not brought up to date."""
    seconds: float
    """Time of the update of the places; that of a build for the first map."""
    rooms_seconds: float
    """Time of the update of the rooms, 0 where there was none."""
    place_flips: Flips | None
    """Flips of places; None for the first map."""
    room_flips: Flips | None
    """Flips of rooms; None where they were not brought up to date."""
    regions: OnlineRegions | None = None
    """The regions, those of `places`; None if they are not followed."""
    regions_update: RegionsUpdate | None = None
    """What became of the regions; None for the first map, and if they are not followed."""
    regions_seconds: float = 0.0
    """Time of the update of the regions; that of a build for the first map."""
    region_flips: Flips | None = None
    """Flips of regions; None for the first map, and if they are not followed."""


def replay(
    grids: Iterable[OccupancyGrid],
    *,
    merge_distance_m: float = 4.0,
    rooms_every: int = 1,
    rooms: RoomLabels | None = None,
    most_cells: int | None = None,
) -> Iterator[ReplayStep]:
    """Follow a sequence of maps with places, rooms and doors, and with regions if asked to.

    Parameters
    ----------
    grids
        The maps; each has to cover the one before, cell on cell.
    merge_distance_m
        U_d of the places.
    rooms_every
        Maps after which rooms are brought up to date, at least 1; the last map always counts.
    rooms
        Rooms of the first map, whose names and numbers of doors are followed; None to find them.
    most_cells
        Most cells of a region, >= 1, as in `OnlineRegions.of`; None to follow no regions.

    Yields
    ------
    ReplayStep
        One for each map.

    Raises
    ------
    InvalidValueError
        When there is no map, a map does not cover the one before, the rooms are not those of the
        first map, or a number is out of range.

    Examples
    --------
    >>> from hybridnav.ext.live import replay
    >>> cells = np.zeros((9, 21))
    >>> door_open = hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)
    >>> cells[4, 10] = 1.0
    >>> post = hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)
    >>> steps = list(replay([door_open, post], most_cells=100))
    >>> [(step.places.n_places, step.regions.n_regions) for step in steps]
    [(1, 1), (1, 1)]
    """
    _check_every("rooms_every", rooms_every, "maps")
    step: ReplayStep | None = None
    for number, grid, is_last in _with_last(grids):
        checked_type("a map of the replay", grid, OccupancyGrid)
        if step is None:
            step = _with_first_regions(_first(grid, merge_distance_m, rooms), most_cells)
        else:
            following = _next(step, grid, with_rooms=is_last or number % rooms_every == 0)
            step = _with_next_regions(following, step.regions)
        yield step
    if step is None:
        raise InvalidValueError("there is no map to replay, expected one or more")


def grids_of_scans(
    scans: Iterable[LaserScan],
    mapper: Mapper,
    *,
    every: int = 1,
    robot_radius_m: float | None = None,
) -> Iterator[OccupancyGrid]:
    """Add scans to a map, and yield the map as it grows.

    Parameters
    ----------
    scans
        Scans with poses, such as those of a `CarmenLog`. Scans that the mapper refuses are left
        out.
    mapper
        What they are added to.
    every
        Scans after which a map is yielded, at least 1; the last map has all scans.
    robot_radius_m
        Radius of the robot in metres; None is the default, 0.25 m.

    Yields
    ------
    OccupancyGrid
        The map so far, cut to the cells that scans have met.

    Raises
    ------
    InvalidValueError
        When `every` is no whole number of 1 or more.

    Examples
    --------
    >>> from hybridnav.ext.live.mapping import LaserScan, Mapper
    >>> from hybridnav.ext.live import grids_of_scans
    >>> beams = {"start_rad": 0.0, "step_rad": 0.1}
    >>> scans = [LaserScan(np.full(9, 2.0), pose=(x, 0.0, 0.0), **beams) for x in (0.0, 1.0)]
    >>> [grid.shape[1] for grid in grids_of_scans(scans, Mapper(resolution_m=0.5))]
    [5, 7]
    """
    _check_every("every", every, "scans")
    n_waiting = 0
    for scan in scans:
        n_waiting += bool(mapper.add(scan))
        if n_waiting >= every and mapper.has_cells:
            yield mapper.to_grid(robot_radius_m=robot_radius_m)
            n_waiting = 0
    if n_waiting and mapper.has_cells:
        yield mapper.to_grid(robot_radius_m=robot_radius_m)


def _check_every(name: str, every: int, what: str) -> None:
    if not isinstance(every, int | np.integer) or every < 1:
        raise InvalidValueError(
            f"{name} is {every!r:.40}, expected a whole number of {what}, 1 or more"
        )


def _with_last(grids: Iterable[OccupancyGrid]) -> Iterator[tuple[int, OccupancyGrid, bool]]:
    """Yield the number of each grid, the grid, and whether it is the last one."""
    number, waiting = -1, None
    for number, grid in enumerate(grids):
        if number:
            yield number - 1, cast("OccupancyGrid", waiting), False
        waiting = grid
    if number >= 0:
        yield number, cast("OccupancyGrid", waiting), True


def _first(grid: OccupancyGrid, merge_distance_m: float, labels: RoomLabels | None) -> ReplayStep:
    began = time.perf_counter()
    pyramid = DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m)
    places = OnlinePyramid.of(pyramid)
    built = time.perf_counter()
    rooms = OnlineRooms.of(grid, labels)
    found = time.perf_counter()
    return ReplayStep(0, places, rooms, None, None, built - began, found - built, None, None)


def _with_first_regions(step: ReplayStep, most_cells: int | None) -> ReplayStep:
    if most_cells is None:
        return step
    began = time.perf_counter()
    regions = OnlineRegions.of(step.places, most_cells)
    return replace(step, regions=regions, regions_seconds=time.perf_counter() - began)


def _with_next_regions(step: ReplayStep, before: OnlineRegions | None) -> ReplayStep:
    """Return a step with the regions after those of the step before."""
    if before is None:
        return step
    began = time.perf_counter()
    update = before.update(step.places)
    seconds = time.perf_counter() - began
    return replace(
        step,
        regions=update.version,
        regions_update=update,
        regions_seconds=seconds,
        region_flips=flips_between(_numbered(before), _numbered(update.version)),
    )


def _next(step: ReplayStep, grid: OccupancyGrid, *, with_rooms: bool) -> ReplayStep:
    before, rooms = step.places, step.rooms
    changed = changed_cells(before.grid, grid)
    began = time.perf_counter()
    update = before.update(grid, changed=changed)
    updated = time.perf_counter()
    rooms_update = rooms.update(grid) if with_rooms else None
    found = time.perf_counter()
    after = update.version
    return ReplayStep(
        step.number + 1,
        after,
        rooms if rooms_update is None else rooms_update.version,
        update,
        rooms_update,
        updated - began,
        found - updated if with_rooms else 0.0,
        flips_between(_numbered(before), _numbered(after)),
        None
        if rooms_update is None
        else flips_between(_numbered(rooms), _numbered(rooms_update.version)),
    )


def changed_cells(before: OccupancyGrid, after: OccupancyGrid) -> BoolArray:
    """Return bool (rows, cols) of the newer grid, the cells of the older one whose class differs.

    Cells by which the map grew are left out, as updates look at them anyway.

    Raises
    ------
    InvalidValueError
        When the newer grid does not cover the older one, cell on cell.
    """
    rows, cols = shift_of(before, after, otherwise="begin a new replay")
    changed = np.zeros(after.shape, np.bool_)
    inside = np.s_[rows : rows + before.shape[0], cols : cols + before.shape[1]]
    changed[inside] = after.classes[inside] != before.classes
    return changed


def _numbered(version: OnlinePyramid | OnlineRegions | OnlineRooms) -> Numbered:
    """Return the cells of a version; rooms know no robot."""
    grid = version.places.grid if isinstance(version, OnlineRegions) else version.grid
    is_rooms = isinstance(version, OnlineRooms)
    return Numbered(grid, grid.measured if is_rooms else grid.classes, version.number_of)
