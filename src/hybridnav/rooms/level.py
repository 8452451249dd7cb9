"""The room level of a pyramid: rooms with names, and the doors between them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid, RoomLabels
from hybridnav.pyramid import DualGraphPyramid, Level
from hybridnav.pyramid.cracks import endpoints_of
from hybridnav.pyramid.level import LevelArc
from hybridnav.rooms.doors import (
    LEAST_DOOR_M,
    MOST_DOOR_M,
    RoomBoundaries,
    farthest_ends,
    measured_clearance_m,
)
from hybridnav.rooms.listing import Listing, RoomKind, kinds_of


@dataclass(frozen=True)
class Door:
    """A connected boundary between two rooms on the map as measured, the same for every robot.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0)
    >>> labels = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, 1, 1]]))
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    >>> door = topology.rooms.doors[0]
    >>> door.number, door.rooms, door.position
    (1, ('kitchen', 'hall'), (2.0, 0.5))
    """

    number: int
    """Number for people, from 1. A file of rooms keeps it."""
    rooms: tuple[str | None, str | None]
    """Names of the rooms on both sides; None for nameless space."""
    position: tuple[float, float]
    """A point on the boundary, in its middle; `(x, y)` in metres, map frame."""
    width_m: float
    """Distance between the endpoints of the boundary: between two door posts, that between them."""
    arcs: tuple[LevelArc, ...]
    """Its arcs at the room level: none where the map's robot radius closes it,
    several where inflated obstacles divide it."""
    passage_m: float = math.inf
    """Diameter of the largest disc round a point of the boundary that no occupied cell enters: what
    furniture leaves of its width, or the room before and behind it."""
    between_jambs: bool = True
    """Whether both endpoints of the boundary lie beside cells that are not free."""

    @property
    def is_opening(self) -> bool:
        """Whether it is wider than 2 m or not between jambs: no door that could be shut."""
        return self.width_m > MOST_DOOR_M or not self.between_jambs

    @property
    def kind(self) -> str:
        """Its word for people: "door" or "opening"."""
        return "opening" if self.is_opening else "door"

    @property
    def passable(self) -> bool:
        """Whether a robot of the map's radius passes over a side of its boundary. Where corners may
        be cut, a diagonal may pass a door that has no arc."""
        return bool(self.arcs)

    @property
    def is_gap(self) -> bool:
        """Whether its passage is below 0.3 m: lists and pictures count gaps and leave them out."""
        return self.passage_m < LEAST_DOOR_M


class Rooms:
    """The rooms of a pyramid that was built with some.

    A room is one or more vertices of the room level: a class of cells each, and where obstacles cut
    a room into parts, one for each part. Cells in no room have vertices too, without a name.

    Parameters
    ----------
    pyramid
        A pyramid that was built with rooms.

    Raises
    ------
    InvalidValueError
        When it has none.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0)
    >>> labels = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, 1, 1]]))
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    >>> topology.rooms.names
    ('kitchen', 'hall')
    """

    def __init__(self, pyramid: DualGraphPyramid) -> None:
        self.level: Level = pyramid[pyramid.room_level]
        assert pyramid.rooms is not None  # noqa: S101 - the room level exists
        self.labels: RoomLabels = pyramid.rooms

    @property
    def grid(self) -> OccupancyGrid:
        """The map."""
        return self.level.grid

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the rooms."""
        return self.labels.names

    @cached_property
    def kinds(self) -> tuple[RoomKind | None, ...]:
        """What each room is by its shape, None for one that is just a room."""
        found = kinds_of(
            self.labels.label_of, self.grid.measured == CellClass.FREE, self.grid.resolution_m
        )
        return (*found, *(None,) * (len(self.names) - len(found)))

    @cached_property
    def label_of_vertex(self) -> IntArray:
        """int32 (n_vertices,), index of the name of each vertex of the room level, -1 for none."""
        return self.labels.label_of[tuple(self.level.cells.T)]

    @cached_property
    def is_free(self) -> BoolArray:
        """bool (n_vertices,), vertices of free cells."""
        return self.level.classes == CellClass.FREE

    def name_of(self, label: int) -> str | None:
        """Return the name of a label, None for -1."""
        return None if label == NO_ROOM else self.names[label]

    def at(self, point: tuple[float, float]) -> str | None:
        """Return the name of the room that a point `(x, y)` in metres lies in, None for no room.

        Raises
        ------
        InvalidValueError
            When the coordinates are not two finite numbers.
        """
        return self.labels.at(point, self.grid)

    def vertices_of(self, name: str) -> LongArray:
        """Return the free parts of a room, as vertices of the room level, the largest first.

        Raises
        ------
        InvalidValueError
            When no room has this name.
        """
        found = np.flatnonzero((self.label_of_vertex == self.labels.index(name)) & self.is_free)
        return found[np.argsort(-self.level.areas[found], kind="stable")]

    @cached_property
    def areas_m2(self) -> FloatArray:
        """float64 (n_rooms,), area of the free cells of each room as measured, whatever the robot's
        radius, in square metres."""
        return room_areas_m2(self.labels, self.grid)

    @cached_property
    def fits(self) -> BoolArray:
        """bool (n_rooms,), rooms in which the map's robot radius leaves a free cell."""
        named = self.label_of_vertex[self.is_free & (self.label_of_vertex >= 0)]
        return np.bincount(named, minlength=len(self.names)) > 0

    @cached_property
    def clearance_m(self) -> FloatArray:
        """float64 (rows, cols), distance from the centre of each cell to the next occupied cell's
        nearest side, in metres; infinite where none is occupied."""
        return measured_clearance_m(self.grid)

    @cached_property
    def _boundaries(self) -> RoomBoundaries:
        return RoomBoundaries.of(self.labels, self.grid, self.clearance_m)

    @cached_property
    def _numbers(self) -> LongArray:
        """int64 (n_boundaries,), the number of each boundary."""
        return self._boundaries.numbers(self.labels.doors)

    @cached_property
    def doors(self) -> tuple[Door, ...]:
        """All boundaries between free cells of different rooms, by number; also gaps, and doors
        that no robot of the map's radius passes."""
        found = self._boundaries
        arcs: list[list[int]] = [[] for _ in range(found.n_boundaries)]
        labels = self.label_of_vertex[self.level.arcs]
        between = (labels[:, 0] != labels[:, 1]) & self.is_free[self.level.arcs].all(axis=1)
        kept = np.flatnonzero(between)
        on = found.boundary_of[np.searchsorted(found.edges, self.level.base_edges[kept])]
        for arc, boundary in zip(kept.tolist(), on.tolist(), strict=True):
            arcs[boundary].append(arc)
        numbers = self._numbers
        return tuple(
            Door(
                int(numbers[at]),
                (self.name_of(int(found.labels[at, 0])), self.name_of(int(found.labels[at, 1]))),
                (float(found.middles[at, 0]), float(found.middles[at, 1])),
                float(found.widths_m[at]),
                tuple(LevelArc(self.level.index, arc) for arc in arcs[at]),
                float(found.passages_m[at]),
                bool(found.between_jambs[at]),
            )
            for at in np.argsort(numbers, kind="stable").tolist()
        )

    @cached_property
    def _listing(self) -> Listing:
        return Listing.of(self.labels, self.level)

    @property
    def is_listed(self) -> BoolArray:
        """bool (n_rooms,), rooms in lists and pictures.

        They are wider than 1 m in the mean, or have a name of their own, or the map's robot can
        enter them from such a one or the largest. A laser sees the others through glass.
        """
        return self._listing.is_listed[: len(self.names)]

    @property
    def begin_cells(self) -> BoolArray:
        """bool (rows, cols), free cells as measured, of rooms and other spaces in which a robot may
        begin: the free cells that they are joined with have a way in."""
        return np.append(self._listing.begins, np.False_)[self._listing.space_of]

    @cached_property
    def listed_labels(self) -> RoomLabels:
        """The rooms in lists and pictures; cells of the others are in no room."""
        of = self.labels.label_of
        shown = np.where(np.append(self.is_listed, False)[of], of, np.int32(NO_ROOM))
        return replace(self.labels, label_of=shown)

    @cached_property
    def listed_doors(self) -> tuple[Door, ...]:
        """Doors in lists and pictures, by number: no gaps, and both sides are listed. A side in no
        room is listed if the robot can enter it and it has 1 m² and a mean width of 1 m."""
        found, listing = self._boundaries, self._listing
        first = found.edges[np.unique(found.boundary_of, return_index=True)[1]]
        ends = np.stack(endpoints_of(first, self.grid.shape[1]))
        both = listing.is_listed[listing.space_of.ravel()[ends]].all(axis=0)
        shown = set(self._numbers[both].tolist())
        return tuple(door for door in self.doors if door.number in shown and not door.is_gap)

    def door(self, number: int) -> Door:
        """Return the door with a number.

        Raises
        ------
        InvalidValueError
            When no door has it; the message states the numbers in the list of doors.
        """
        return self._numbered(number, self._door_of_number)

    def listed_door(self, number: int) -> Door:
        """Return the door with a number, unless it is a gap.

        Raises
        ------
        InvalidValueError
            As for `door`.
        """
        listed = {door.number: door for door in self.doors if not door.is_gap}
        return self._numbered(number, listed)

    def _numbered(self, number: int, doors: dict[int, Door]) -> Door:
        if number not in doors:
            shown = [door.number for door in self.listed_doors]
            known = f"the doors are {_in_runs(shown)}" if shown else "the map has no doors to list"
            raise InvalidValueError(
                f"no door has the number {number!r:.80}: {known}; hybridnav rooms MAP lists them"
            )
        return doors[number]

    @cached_property
    def _door_of_number(self) -> dict[int, Door]:
        return {door.number: door for door in self.doors}

    @cached_property
    def door_of_arc(self) -> dict[int, Door]:
        """The door of each arc of the room level that lies on one, by the arc's dense index."""
        return {arc.index: door for door in self.doors for arc in door.arcs}

    def cells_beside(self, number: int) -> LongArray:
        """Return the cells on both sides of a door's boundary, sorted, int64 (n,); see
        `moves_through`. The robot's radius may have taken some of them away."""
        return np.unique(self.moves_through(number))

    def moves_through(self, number: int) -> LongArray:
        """Return the moves across a door's boundary, on the map as measured.

        Parameters
        ----------
        number
            The number of a door.

        Returns
        -------
        LongArray
            int64 (n, 2), the flat cells on both sides, 4-adjacent, the lower one first.

        Raises
        ------
        InvalidValueError
            When no door has the number.
        """
        found = self._boundaries
        of_door = self._numbers == self.door(number).number
        edges = found.edges[of_door[found.boundary_of]]
        return np.stack(endpoints_of(edges, self.grid.shape[1]), axis=1)

    def door_ends(self, number: int) -> tuple[tuple[float, float], tuple[float, float]]:
        """Return the two points of a door's boundary that lie farthest apart, `(x, y)` in metres,
        map frame.

        Parameters
        ----------
        number
            The number of a door.

        Raises
        ------
        InvalidValueError
            When no door has the number.
        """
        found = self._boundaries
        of_door = self._numbers == self.door(number).number
        ends = farthest_ends(found.edges[of_door[found.boundary_of]], self.grid.shape[1])
        (x, y), (u, v) = self.grid.frame.points_of_grid(ends).tolist()
        return (x, y), (u, v)

    @property
    def is_building(self) -> bool:
        """Whether any listed door has walls on both sides. On a map without, rooms are parts of
        open space: a race track, a yard, a hall."""
        return any(not door.is_opening for door in self.listed_doors)

    def counted(self, *, everything: bool = False) -> tuple[str, str, str]:
        """Describe how many rooms, doors and openings there are, and how many of them this robot
        cannot use.

        Parameters
        ----------
        everything
            Count all rooms and doors, not only listed ones.

        Returns
        -------
        tuple of str
            Counts of rooms and of doors, such as "22 rooms, 1 of them too small for a robot 0.5 m
            wide". The last counts the left out ones, such as "3 rooms, 43 gaps below 0.3 m and 12
            other doors"; empty if there are none.
        """
        shown = self.doors if everything else self.listed_doors
        fits = self.fits if everything else self.fits[self.is_listed]
        openings = [door for door in shown if door.is_opening]
        doors = [door for door in shown if not door.is_opening]
        robot = f"for a robot {2 * self.grid.robot_radius_m:g} m wide"
        narrow = f"too narrow {robot}"
        passages = _counted("doors", [door.passable for door in doors], narrow)
        if openings:
            passable = [door.passable for door in openings]
            why = narrow if all(door.passable for door in doors) else "too narrow"
            passages += ", " + _counted("openings", passable, why)
        rooms = _counted("rooms", fits.tolist(), f"too small {robot}")
        return rooms, passages, "" if everything else self._left_out()

    def _left_out(self) -> str:
        """Return what lists and pictures leave out."""
        n_gaps = sum(door.is_gap for door in self.doors)
        counts = [
            (int((~self.is_listed).sum()), "narrow room{s} without a way in"),
            (n_gaps, f"gap{{s}} below {LEAST_DOOR_M:g} m"),
            (len(self.doors) - len(self.listed_doors) - n_gaps, "door{s} to what is not listed"),
        ]
        return ", ".join(
            f"{count} {things.format(s='s' if count != 1 else '')}"
            for count, things in counts
            if count
        )

    def point_of(self, name: str) -> tuple[float, float]:
        """Return the point that stands for a room. This is its named point, else the point of most
        clearance in the largest part that the robot's radius leaves free. If it leaves none, the
        whole room counts.

        Parameters
        ----------
        name
            A room, or a named point.

        Returns
        -------
        tuple of float
            `(x, y)` in metres, map frame.

        Raises
        ------
        InvalidValueError
            When there is no such room or point.
        """
        if name in self.labels.points:
            return self.labels.points[name]
        parts = self.vertices_of(name)
        cells = self.level.receptive_field(int(parts[0])) if len(parts) else self._measured(name)
        if not len(cells):
            raise InvalidValueError(f"room {brief(name)} has no cell, so no point stands for it")
        clear = self.clearance_m[tuple(cells.T)]
        x, y = self.grid.frame.points_of(cells[int(np.argmax(clear))])
        return float(x), float(y)

    def _measured(self, name: str) -> LongArray:
        """Return the cells (row, col) of a room that were measured as free, all if none was."""
        inside = self.labels.label_of == self.labels.index(name)
        free = inside & (self.grid.measured == CellClass.FREE)
        return np.argwhere(free if free.any() else inside)


def _counted(things: str, usable: list[bool], why_not: str) -> str:
    """Return how many things there are, and how many are not usable, and why."""
    unusable = usable.count(False)
    named = things if len(usable) != 1 else things.removesuffix("s")
    return f"{len(usable)} {named}" + (f", {unusable} of them {why_not}" if unusable else "")


def room_areas_m2(labels: RoomLabels, grid: OccupancyGrid) -> FloatArray:
    """Return the area of the free cells of each room as measured, float64 (n_rooms,), in square
    metres."""
    free = labels.label_of[grid.measured == CellClass.FREE]
    cells = np.bincount(free[free >= 0], minlength=len(labels.names))
    return cells * np.float64(grid.cell_area_m2)


def _in_runs(numbers: list[int]) -> str:
    """Return numbers in order as text, neighbours as one run: 1-4, 7."""
    begins = [each for each in numbers if each - 1 not in numbers]
    ends = [each for each in numbers if each + 1 not in numbers]
    runs = zip(sorted(begins), sorted(ends), strict=True)
    return ", ".join(str(low) if low == high else f"{low}-{high}" for low, high in runs)
