"""Replays of maps that change, grid by grid or scan by scan, and their figures."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from hybridnav._base.clock import clock
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live.identities import Flips, Numbered, flips_between
from hybridnav.ext.live.mapping import LaserScan, Mapper
from hybridnav.ext.live.pyramid import OnlinePyramid, Update, changed_cells
from hybridnav.ext.live.room_versions import OnlineRooms, RoomsUpdate
from hybridnav.maps import OccupancyGrid, RoomLabels
from hybridnav.maps.checks import checked_type
from hybridnav.pyramid import DualGraphPyramid, Level
from hybridnav.pyramid.cracks import endpoints_of, find_cracks


@dataclass(frozen=True, eq=False)
class ReplayStep:
    """A map of a replay, with its places and its rooms.

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


def replay(
    grids: Iterable[OccupancyGrid],
    *,
    merge_distance_m: float = 4.0,
    rooms_every: int = 1,
    rooms: RoomLabels | None = None,
) -> Iterator[ReplayStep]:
    """Follow a sequence of maps with places, rooms and doors.

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
    >>> [step.places.n_places for step in replay([door_open, post])]
    [1, 1]
    """
    _check_every("rooms_every", rooms_every, "maps")
    step: ReplayStep | None = None
    for number, grid, is_last in _with_last(grids):
        checked_type("a map of the replay", grid, OccupancyGrid)
        if step is None:
            step = _first(grid, merge_distance_m, rooms)
        else:
            step = _next(step, grid, with_rooms=is_last or number % rooms_every == 0)
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
        The mapper to which they are added.
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
    number, waiting = -1, None
    for number, grid in enumerate(grids):
        if number:
            yield number - 1, cast("OccupancyGrid", waiting), False
        waiting = grid
    if number >= 0:
        yield number, cast("OccupancyGrid", waiting), True


def _first(grid: OccupancyGrid, merge_distance_m: float, labels: RoomLabels | None) -> ReplayStep:
    began = clock()
    pyramid = DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m)
    places = OnlinePyramid.of(pyramid)
    built = clock()
    rooms = OnlineRooms.of(grid, labels)
    ended = clock()
    return ReplayStep(0, places, rooms, None, None, built - began, ended - built, None, None)


def _next(step: ReplayStep, grid: OccupancyGrid, *, with_rooms: bool) -> ReplayStep:
    before, rooms = step.places, step.rooms
    changed = changed_cells(before.grid, grid)
    began = clock()
    update = before.update(grid, changed=changed)
    updated = clock()
    rooms_update = rooms.update(grid) if with_rooms else None
    ended = clock()
    after = update.version
    return ReplayStep(
        step.number + 1,
        after,
        rooms if rooms_update is None else rooms_update.version,
        update,
        rooms_update,
        updated - began,
        ended - updated if with_rooms else 0.0,
        flips_between(_numbered(before), _numbered(after)),
        None
        if rooms_update is None
        else flips_between(_numbered(rooms), _numbered(rooms_update.version)),
    )


def _numbered(version: OnlinePyramid | OnlineRooms) -> Numbered:
    """Return the cells of a version; rooms know no robot."""
    is_rooms = isinstance(version, OnlineRooms)
    grid = version.grid
    return Numbered(grid, grid.measured if is_rooms else grid.classes, version.number_of)


# Figures: times, events, flips, and a check of the last version.

_EVENTS = ("born", "died", "merged", "split")
_OF_DOORS = (*_EVENTS, "changed")


class Identities:
    """Events and flips of places or of rooms, over a replay."""

    def __init__(self) -> None:
        self.seconds: list[float] = []
        self.events: Counter[str] = Counter()
        self._cells: Counter[str] = Counter()
        self._flips = {kind: _Flipped() for kind in ("untouched", "apart", "far")}

    def add(self, update: object, flips: Flips, seconds: float) -> None:
        """Count an update."""
        self.seconds.append(seconds)
        for event in _EVENTS:
            self.events[event] += len(getattr(update, event))
        for name in ("cells", "merged", "cut_off", "free"):
            self._cells[name] += getattr(flips, name)
        for kind, flipped in self._flips.items():
            flipped.add(getattr(flips, kind), flips.flipped)

    def figures(self) -> dict[str, Any]:
        """Return plain values; None where there was no update."""
        n_updates, cells = len(self.seconds), self._cells
        median, high = np.percentile(self.seconds, [50, 95]) if n_updates else (None, None)
        return {
            "updates": n_updates,
            "median_ms": None if median is None else round(1000 * median, 3),
            "p95_ms": None if high is None else round(1000 * high, 3),
            **{event: self.events[event] for event in _EVENTS},
            "flipped_cells": round(cells["cells"] / n_updates, 3) if n_updates else None,
            "flipped_share": round(cells["cells"] / max(cells["free"], 1), 8),
            "flipped_by_merging": round(cells["merged"] / max(cells["cells"], 1), 8),
            "flipped_by_cutting_off": round(cells["cut_off"] / max(cells["cells"], 1), 8),
            **{kind: flipped.figures() for kind, flipped in self._flips.items()},
        }


class _Flipped:
    """Places of a kind, and those of them that flip."""

    def __init__(self) -> None:
        self._ever: set[int] = set()
        self._ever_flipped: set[int] = set()
        self._seen = self._n_flips = 0

    def add(self, places: frozenset[int], flipped: frozenset[int]) -> None:
        """Count the places of an update."""
        self._ever |= places
        self._ever_flipped |= places & flipped
        self._seen += len(places)
        self._n_flips += len(places & flipped)

    def figures(self) -> dict[str, Any]:
        """Return plain values."""
        return {
            "places": len(self._ever),
            "flipped": len(self._ever_flipped),
            "flips": self._n_flips,
            "share_an_update": round(self._n_flips / max(self._seen, 1), 8),
        }


class ReplayFigures:
    """Figures of a replay: times, events of places, rooms and doors, flips of numbers.

    Examples
    --------
    >>> from hybridnav.ext.live import ReplayFigures, replay
    >>> cells = np.zeros((9, 21))
    >>> first = hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)
    >>> cells[4, 10] = 1.0
    >>> figures = ReplayFigures()
    >>> for step in replay([first, hn.OccupancyGrid(cells, hn.Frame(0.25), robot_radius_m=0)]):
    ...     figures.add(step)
    >>> figures.figures()["places"]["apart"]["flipped"], figures.figures()["faults"]
    (0, [])
    """

    def __init__(self) -> None:
        self._places, self._rooms = Identities(), Identities()
        self._last: ReplayStep | None = None
        self._n_doors: Counter[str] = Counter()
        self._lost_names: list[str] = []
        self._lost_one_way: list[str] = []

    def add(self, step: ReplayStep) -> None:
        """Count a step."""
        self._last = step
        if step.place_flips is not None:
            self._places.add(step.update, step.place_flips, step.seconds)
        if step.rooms_update is not None and step.room_flips is not None:
            self._rooms.add(step.rooms_update, step.room_flips, step.rooms_seconds)
            for event in _OF_DOORS:
                self._n_doors[event] += len(getattr(step.rooms_update.doors, event))
            self._lost_names += step.rooms_update.lost_names.values()
            self._lost_one_way += map(str, step.rooms_update.lost_one_way)

    def figures(self) -> dict[str, Any]:
        """Return the figures as plain values for JSON.

        Returns
        -------
        dict
            `places` and `rooms` with `updates`, `median_ms` and `p95_ms` of an update, counts of
            events, and `flipped_cells` an update. `flipped_share` is their share of the cells that
            stayed free; the shares of them that flip by merging and by cutting off follow. For
            places that are `untouched`, `apart` and `far` in some update (see `Flips`) there are
            their number, how many flip, the number of flips, and the share in an update. `doors`
            has events, `lost_names` the names of rooms that died. Counts of the last map follow,
            and `faults` of its levels, see `faults_of`.
        """
        last = self._last
        if last is None:
            return {}
        pyramid = last.places.pyramid
        return {
            "maps": last.number + 1,
            "cells": list(last.places.grid.shape),
            "n_places": last.places.n_places,
            "n_rooms": len(last.rooms.numbers),
            "n_doors": sum(not door.is_gap for door in last.rooms.doors.values()),
            "places": self._places.figures(),
            "rooms": self._rooms.figures(),
            "doors": {event: self._n_doors[event] for event in _OF_DOORS},
            "lost_names": list(self._lost_names),
            "lost_one_way": list(self._lost_one_way),
            "levels": len(pyramid),
            "faults": faults_of(pyramid),
        }


def faults_of(levels: Iterable[Level]) -> list[str]:
    """Compare the arcs of every level with boundaries that are read from the fields alone.

    A boundary is a set of cracks that are joined in 2 x 2 blocks with exactly two of them. Two
    fields have as many arcs as boundaries.

    `levels`: levels, such as those of a pyramid. Returns a line on each level whose arcs are
    others; none if all is well.
    """
    return [fault for level in levels for fault in _faults(level)]


def _faults(level: Level) -> Iterable[str]:
    rows, cols = level.grid.shape
    edges, classes = find_cracks(level.field_of.ravel(), rows, cols)
    _, first = np.unique(classes, return_index=True)
    one, other = endpoints_of(edges[first], cols)
    fields = level.field_of.ravel()
    read = np.sort(np.stack([fields[one], fields[other]], axis=1), axis=1)
    arcs = np.sort(level.arcs[~level.is_self_loop], axis=1)
    if not np.array_equal(read[np.lexsort(read.T)], arcs[np.lexsort(arcs.T)]):
        yield f"level {level.index} has {len(arcs)} arcs, its fields have {len(read)} boundaries"
