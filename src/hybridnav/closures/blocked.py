"""Closures for one query, and the cells that they close. Public: `Blocked`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from typing import Any, cast

import numpy as np
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from hybridnav._base.copies import copies_alike
from hybridnav._base.rows import in_runs
from hybridnav._base.typing import LongArray
from hybridnav.closures.areas import cells_on_boundaries, checked_area, runs_near, runs_of, shown
from hybridnav.closures.ids import arc_on, door_on, found_ids
from hybridnav.closures.one_way import OneWay, OneWayLike, as_one_way, checked_named, joined, union
from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid
from hybridnav.pyramid import LevelArc
from hybridnav.rooms import Door
from hybridnav.topology import TopologicalMap
from hybridnav.topology.map import no_places


@copies_alike
@dataclass(frozen=True, eq=False)
class Blocked:
    """Closures for one query: doors, rooms, arcs, places, cells, and areas in metres.

    Areas are obstacles, such as pallets: the robot keeps its radius (`grid.robot_radius_m`) off
    them, as off occupied cells, unless they are given as `keepout`. That and everything else closes
    cells for the centre of the robot alone, which may pass beside them. All items must be on the
    map: an unknown number or name, and an area that closes no cell of the map, are refused. `first
    | second` is the union of two closures.

    Parameters
    ----------
    arcs
        Ids of arcs of the places, or a `LevelArc` for an arc of any level. No move crosses the
        boundary of a closed arc: one of each two cells that face each other across it is closed.
        The choice first keeps other arcs open, such as a second door between the same places. Then
        it loses few free cells, closed or cut off from the rest of their place. Only a cell that
        two doors share may close both. Moves past a point where four places meet lie on no
        boundary. A self-loop joins a place to itself and cannot be closed.
    places
        Ids of places; all the cells of their receptive fields are closed.
    cells
        `(row, col)`, shape (n, 2).
    polygons
        Each a shapely `Polygon`, `MultiPolygon`, `LineString` or `MultiLineString`, or the corners
        of a polygon as `(x, y)`, shape (n, 2); metres, map frame. Holes stay open. A cell is closed
        when the inside of its square lies nearer than the robot's radius to the area, or, with a
        radius of 0, meets it. A line has no inside. With a radius of 0, a line along a side between
        two cells closes the cell with the higher index (as in `Frame.cells_of`). So no path passes
        a line.
    keepout
        Areas as in `polygons` that the *centre* of the robot does not enter: their cells are those
        of a robot of radius 0.
    doors
        Numbers of doors, but not those of gaps, or `Door` objects of this map: no
        move crosses their boundaries, which close like those of arcs. Other doors between the same
        rooms stay open. If corners may be cut, all cells on both sides close. A diagonal between
        two cells that were measured as occupied crosses no door.
    rooms
        Names of rooms; all their cells are closed.
    one_way
        What may be crossed in one direction only: a `OneWay`, a line, or a mapping of its
        attributes.
    named
        Other closures by what reasons call them: `{"keepout: zone.yaml": Blocked(...)}`. In a union
        a name is that of both.

    Raises
    ------
    InvalidValueError
        When ids are not integers, cells are not integers of shape (n, 2), or names are not text.
        When an area has fewer than three points, is not finite, or intersects itself.

    Examples
    --------
    >>> closed = hn.Blocked(cells=[(0, 2)]) | hn.Blocked(places=[3])
    >>> closed.cells, closed.places
    (array([[0, 2]]), (3,))
    """

    arcs: Sequence[int | LevelArc] = ()
    places: Sequence[int] = ()
    cells: ArrayLike = ()
    polygons: Sequence[BaseGeometry | ArrayLike] = ()
    doors: Sequence[int | Door] = ()
    rooms: Sequence[str] = ()
    keepout: Sequence[BaseGeometry | ArrayLike] = ()
    named: Mapping[str, Blocked] = field(default_factory=dict)
    one_way: OneWayLike | None = None

    def __post_init__(self) -> None:
        checked = {
            "arcs": _checked_ids("arcs", self.arcs, LevelArc),
            "places": _checked_ids("places", self.places),
            "cells": _checked_cells(self.cells),
            "polygons": _checked_areas("polygons", self.polygons),
            "keepout": _checked_areas("keepout", self.keepout),
            "doors": _checked_ids("doors", self.doors, Door),
            "rooms": _checked_names(self.rooms),
            "named": checked_named(self.named, Blocked),
            "one_way": None if self.one_way is None else as_one_way(self.one_way),
        }
        for name, value in checked.items():
            object.__setattr__(self, name, value)

    def __or__(self, other: Blocked) -> Blocked:
        """Return the union of two closures."""
        if not isinstance(other, Blocked):
            return NotImplemented
        both = {
            one.name: (*getattr(self, one.name), *getattr(other, one.name))
            for one in fields(self)
            if one.name not in {"cells", "named", "one_way"}
        }
        cells = np.concatenate([np.asarray(self.cells), np.asarray(other.cells)])
        named = union(self.named, other.named)
        one_way = joined([self.one_way, other.one_way])
        return Blocked(**both, cells=cells, named=named, one_way=one_way)

    @property
    def directions(self) -> OneWay | None:
        """What may be crossed in one direction only, that of `named` too; None for nothing."""
        return joined([self.one_way, *(one.directions for one in self.named.values())])

    @property
    def key(self) -> tuple[object, ...]:
        """Key for look-ups, equal for equal closures."""
        areas = [
            tuple(area.wkb for area in cast("Sequence[BaseGeometry]", given))
            for given in (self.polygons, self.keepout)
        ]
        cells = np.asarray(self.cells).tobytes()
        named = tuple((name, one.key) for name, one in self.named.items())
        directed = () if self.one_way is None else as_one_way(self.one_way).key
        return (
            tuple(self.arcs),
            tuple(self.places),
            cells,
            *areas,
            self.doors,
            self.rooms,
            named,
            directed,
        )

    def cells_of(self, topology: TopologicalMap) -> LongArray:
        """Find the cells that may not be entered; occupied ones may be among them.

        Parameters
        ----------
        topology
            The map that the ids belong to.

        Returns
        -------
        LongArray
            int64 (n,), flat cells `row * cols + col`, sorted, each once.

        Raises
        ------
        InvalidValueError
            When the map has no such door, room, arc, place or cell, or a door is one of another
            map. When an arc is a self-loop, or an area closes no cell of the map.
        """
        return self.cells_on(topology.grid, topology)

    def cells_on(self, grid: OccupancyGrid, topology: TopologicalMap | None) -> LongArray:
        """Find the cells as `cells_of` does, on a grid whose places may not be built: None."""
        cells = _inside(np.asarray(self.cells), grid.shape)
        closed = [cells[:, 0] * grid.shape[1] + cells[:, 1]]
        closed += [one.cells_on(grid, topology) for one in self.named.values()]
        if self.arcs or self.places or self.doors or self.rooms:
            if topology is None:
                no_places()
            closed += self._in_places(topology) + self._in_rooms(topology)
            closed += self._on_boundaries(topology)
        single = np.concatenate(closed)
        if not (self.polygons or self.keepout):  # rooms have many cells, and need no runs
            return np.unique(single)
        runs = [np.stack([single, single + 1], axis=1)]
        for given, radius_m in ((self.polygons, grid.robot_radius_m), (self.keepout, 0.0)):
            areas = cast("Sequence[BaseGeometry]", given)
            runs += [runs_of(area, grid, radius_m=radius_m) for area in areas]
        return _cells_in_runs(np.concatenate(runs))

    def solid_on(self, grid: OccupancyGrid) -> LongArray | None:
        """Find the cells of the areas that are obstacles, for a robot with a footprint; None
        without any."""
        areas = cast("Sequence[BaseGeometry]", self.polygons)
        runs = [runs_near(area, grid, radius_m=0.0) for area in areas]
        closed = [one.solid_on(grid) for one in self.named.values()]
        closed.append(_cells_in_runs(np.concatenate(runs)) if runs else None)
        solid = [cells for cells in closed if cells is not None]
        return np.unique(np.concatenate(solid)) if solid else None

    def _in_places(self, topology: TopologicalMap) -> list[LongArray]:
        if not len(self.places):
            return []
        places = found_ids("place", self.places, topology.place_ids)
        across = np.array([topology.grid.shape[1], 1])
        return [topology.level.receptive_field(place) @ across for place in places.tolist()]

    def _in_rooms(self, topology: TopologicalMap) -> list[LongArray]:
        if not self.rooms:
            return []
        labels = topology.rooms.labels
        closed = [labels.index(name) for name in self.rooms]
        return [np.flatnonzero(np.isin(labels.label_of, closed))]

    def _on_boundaries(self, topology: TopologicalMap) -> list[LongArray]:
        """Return the cells of arcs and doors, level by level, so that no closed arc is spared."""
        if not self.arcs and not self.doors:
            return []
        closed = [arc_on(topology, arc) for arc in self.arcs]
        doors = [door_on(topology.rooms, door) for door in self.doors]
        whole = []
        if topology.grid.corner_cutting:
            # A diagonal between two cells closed by inflation crosses the door on no arc.
            whole = [topology.rooms.cells_beside(door.number) for door in doors]
        else:
            closed += [arc for door in doors for arc in door.arcs]
        return whole + [
            cells
            for level in sorted({arc.level for arc in closed})
            for cells in cells_on_boundaries(
                topology.pyramid[level],
                np.unique([arc.index for arc in closed if arc.level == level]),
            )
        ]


Closable = Blocked | Door | OneWay | BaseGeometry | Mapping[str, Any]
"""Types that a planner accepts as `blocked`: a `Blocked`, one door, a `OneWay`, one area, or a
mapping from the names of the attributes of a `Blocked`."""


def as_blocked(value: Closable) -> Blocked:
    """Convert any accepted form of closures to a `Blocked`.

    `value`: a `Blocked`, one `Door`, a `OneWay`, one shapely geometry, or a mapping from the names
    of its attributes. Raises `InvalidValueError` when the value is of another kind, has other
    names, or invalid content.
    """
    if isinstance(value, Blocked):
        return value
    if isinstance(value, Door):
        return Blocked(doors=(value,))
    if isinstance(value, OneWay):
        return Blocked(one_way=value)
    if isinstance(value, BaseGeometry):
        return Blocked(polygons=(value,))
    names = tuple(one.name for one in fields(Blocked))
    if not isinstance(value, Mapping):
        raise InvalidValueError(
            "blocked must be a Blocked, a Door, a shapely geometry or a mapping, as "
            f"{{'doors': [4]}}, got {shown(value)}"
        )
    if unknown := [name for name in value if name not in names]:
        raise InvalidValueError(
            f"blocked takes {', '.join(names)}, got {', '.join(map(str, unknown)):.80}"
        )
    return Blocked(**value)


def _checked_ids(name: str, ids: Any, typed: type | None = None) -> tuple[Any, ...]:
    """Return ids as integers, followed by objects of the accepted type."""
    is_listed = not isinstance(ids, str) and hasattr(ids, "__iter__")
    given = list(ids) if is_listed else [None]
    objects = [one for one in given if typed is not None and isinstance(one, typed)]
    numbers = [one for one in given if typed is None or not isinstance(one, typed)]
    try:
        array = np.asarray(numbers)
    except (TypeError, ValueError):
        array = np.empty((0, 0))
    are_whole = array.ndim == 1 and array.dtype.kind in "iu"
    if numbers and (not are_whole or any(isinstance(one, bool) for one in numbers)):
        expected = "integer ids" if typed is None else f"integer ids or {typed.__name__} objects"
        if any(isinstance(one, Door) for one in numbers):
            expected += " (doors go under doors)"
        raise InvalidValueError(f"{name} must be a sequence of {expected}, got {shown(ids)}")
    return (*(array.tolist() if numbers else ()), *objects)


def _checked_names(names: Any) -> tuple[str, ...]:
    is_listed = not isinstance(names, str) and hasattr(names, "__iter__")
    given = tuple(names) if is_listed else (None,)
    if not all(isinstance(name, str) for name in given):
        raise InvalidValueError(f"rooms must be a sequence of names, got {shown(names)}")
    return tuple(map(str, given))


def _checked_areas(name: str, areas: Any) -> tuple[BaseGeometry, ...]:
    if isinstance(areas, BaseGeometry | str) or not hasattr(areas, "__iter__"):
        raise InvalidValueError(f"{name} must be a sequence of areas, got {shown(areas)}")
    return tuple(map(checked_area, areas))


def _checked_cells(cells: ArrayLike) -> LongArray:
    try:
        array = np.array(cells)
    except ValueError:
        array = np.empty(())
    if array.size == 0 and array.ndim:
        array = np.empty((0, 2), dtype=np.int64)
    if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "iu":  # noqa: PLR2004
        raise InvalidValueError(
            f"cells must be integers (row, col) of shape (n, 2), got {shown(cells)}"
        )
    kept: LongArray = array.astype(np.int64)
    kept.flags.writeable = False
    return kept


def _inside(cells: LongArray, shape: tuple[int, int]) -> LongArray:
    outside = ((cells < 0) | (cells >= np.array(shape))).any(axis=1)
    if outside.any():
        row, col = cells[np.argmax(outside)].tolist()
        raise InvalidValueError(
            f"cells must lie on the map of {shape[0]} x {shape[1]} cells, got ({row}, {col})"
        )
    return cells


def _cells_in_runs(runs: LongArray) -> LongArray:
    """Return the cells of the union of runs, without arrays larger than the result."""
    if not len(runs):
        return np.empty(0, dtype=np.int64)
    start, stop = runs[np.argsort(runs[:, 0], kind="stable")].T
    stop = np.maximum.accumulate(stop)
    begins = np.concatenate([[True], start[1:] > stop[:-1]])
    start, stop = start[begins], stop[np.concatenate([begins[1:], [True]])]
    return in_runs(start, stop - start)
