"""The room level of a pyramid: rooms with names, and the doors between them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.grid import NO_ROOM, CellClass
from hybridnav.grid.clearance import clearance_cells
from hybridnav.pyramid.level import LevelArc

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.grid import OccupancyGrid, RoomLabels
    from hybridnav.pyramid import DualGraphPyramid, Level


@dataclass(frozen=True)
class Door:
    """A boundary that can be crossed between two rooms: one arc of the room level."""

    number: int
    """From 1, in the order of arcs; what people are told."""
    arc: LevelArc
    """The arc of the room level."""
    rooms: tuple[str | None, str | None]
    """Names of the rooms on both sides, in the order of the arc's ends; None for no room."""
    position: tuple[float, float]
    """A point on the boundary, in its middle; `(x, y)` in metres, map frame."""
    width_m: float
    """Diameter of the largest disc round a point of the boundary that no occupied cell enters:
    between two door posts, the distance between them."""


class Rooms:
    """The rooms of a pyramid that was built with some.

    A room is one or more vertices of the room level: a class of cells each, and where obstacles cut
    a room into parts, one for each part. What lies in no room is a vertex too, without a name.

    Parameters
    ----------
    pyramid
        Built with rooms.

    Raises
    ------
    InvalidValueError
        When it has none.
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
    def label_of_vertex(self) -> IntArray:
        """int32 (n_vertices,), index of the name of each vertex of the room level, -1 for none."""
        labels: IntArray = self.labels.label_of[tuple(self.level.cells.T)]
        return labels

    @cached_property
    def is_free(self) -> BoolArray:
        """bool (n_vertices,), vertices of free cells."""
        free: BoolArray = self.level.classes == CellClass.FREE
        return free

    def name_of(self, label: int) -> str | None:
        """The name of a label, None for -1."""
        return None if label == NO_ROOM else self.names[label]

    def vertices_of(self, name: str) -> LongArray:
        """Free parts of a room, as vertices of the room level, the largest first.

        Raises
        ------
        InvalidValueError
            When no room has this name.
        """
        found = np.flatnonzero((self.label_of_vertex == self.labels.index(name)) & self.is_free)
        return found[np.argsort(-self.level.areas[found], kind="stable")]

    @cached_property
    def areas_m2(self) -> FloatArray:
        """float64 (n_rooms,), free area of each room in square metres."""
        named = self.is_free & (self.label_of_vertex >= 0)
        cells = np.bincount(
            self.label_of_vertex[named], self.level.areas[named], minlength=len(self.names)
        )
        areas: FloatArray = cells * np.float64(self.grid.resolution_m**2)
        return areas

    @cached_property
    def clearance_m(self) -> FloatArray:
        """float64 (rows, cols), distance from the centre of each cell to the next occupied cell's
        nearest side, in metres; infinite where none is occupied."""
        cells = clearance_cells(self.grid.measured == CellClass.OCCUPIED)
        return np.maximum(cells - 0.5, 0.0) * self.grid.resolution_m

    @cached_property
    def widths_m(self) -> FloatArray:
        """float64 (n_arcs,), width of each arc of the room level, as of a `Door`."""
        edges, arc = self.level.boundary_table
        cols = self.grid.shape[1]
        first = edges >> 1
        second = first + np.where(edges & 1, cols, 1)
        clear = self.clearance_m.ravel()
        widest = np.zeros(self.level.n_arcs)
        np.maximum.at(widest, arc, np.minimum(clear[first], clear[second]))
        length_m = np.bincount(arc, minlength=self.level.n_arcs) * self.grid.resolution_m
        # Without a single occupied cell a boundary is as wide as it is long.
        return np.where(np.isfinite(widest), 2 * widest, length_m)

    @cached_property
    def doors(self) -> tuple[Door, ...]:
        """All boundaries between free parts of different rooms, in the order of arcs."""
        labels = self.label_of_vertex[self.level.arcs]
        between = (labels[:, 0] != labels[:, 1]) & self.is_free[self.level.arcs].all(axis=1)
        positions = self.level.boundary_middles
        return tuple(
            Door(
                number,
                LevelArc(self.level.index, arc),
                (self.name_of(int(labels[arc, 0])), self.name_of(int(labels[arc, 1]))),
                (float(positions[arc, 0]), float(positions[arc, 1])),
                float(self.widths_m[arc]),
            )
            for number, arc in enumerate(np.flatnonzero(between).tolist(), start=1)
        )

    @cached_property
    def door_of_arc(self) -> dict[int, Door]:
        """The door of each arc of the room level that is one, by the arc's dense index."""
        return {door.arc.index: door for door in self.doors}

    def door(self, number: int) -> Door:
        """Return the door that has a number.

        Raises
        ------
        InvalidValueError
            When there is no such door.
        """
        for door in self.doors:
            if door.number == number:
                return door
        numbers = [door.number for door in self.doors]
        known = f"doors are {min(numbers)} to {max(numbers)}" if numbers else "it has none"
        raise InvalidValueError(
            f"there is no door {number} on this map, {known}; hybridnav rooms MAP lists them"
        )

    def point_of(self, name: str) -> tuple[float, float]:
        """The point that stands for a room: its named point, else where most clearance is.

        Parameters
        ----------
        name
            A room with free cells, or a named point.

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
        largest = int(self.vertices_of(name)[0])
        cells = self.level.receptive_field(largest)
        clear = self.clearance_m[tuple(cells.T)]
        x, y = self.grid.frame.points_of(cells[int(np.argmax(clear))])
        return float(x), float(y)
