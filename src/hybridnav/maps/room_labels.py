"""Rooms on a grid: a name for every cell that has one."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.typing import IntArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps.names import check_names, check_number, did_you_mean
from hybridnav.maps.occupancy import OccupancyGrid
from hybridnav.maps.one_way import OneWayRule

MAX_ROOMS = 10_000
"""Most rooms of a map."""

NO_ROOM = -1
"""Label of cells without a room."""

Point = tuple[float, float]

MOST_COST = 100.0
"""Most that a metre in a room may cost, as a factor."""


@dataclass(frozen=True)
class RoomUse:
    """Use of a room by routes, and the cost of a metre in it; profiles heed it.

    Raises
    ------
    InvalidValueError
        When the cost is no number from 1 to 100.

    Examples
    --------
    >>> hn.RoomUse(private=True).cost
    1.0
    """

    private: bool = False
    """Whether routes only start or end in it."""
    corridor: bool = False
    """Whether it is there to walk through: a profile may let a metre elsewhere cost more."""
    cost: float = 1.0
    """Factor by which a metre in it costs more than a metre."""

    def __post_init__(self) -> None:
        """Refuse costs that are out of range."""
        if not 1 <= self.cost <= MOST_COST:
            raise InvalidValueError(
                f"the cost of a room is a factor from 1 to {MOST_COST:g}, got {self.cost!r:.40}"
            )


@copies_alike
@dataclass(frozen=True, eq=False)
class RoomLabels:
    """The room of each cell, and points with names of their own.

    Parameters
    ----------
    names
        Name of each room, all different, one printable line each.
    label_of
        int32 (rows, cols), the room of each cell as an index into `names`, -1 for none; copied.
    points
        Named points, `(x, y)` in metres, map frame. A point with the name of a room represents the
        room.
    doors
        Known numbers of doors, each with a point of its boundary, `(x, y)` in metres: a door keeps
        its number when rooms are written, read, or planned on for another robot.
    uses
        What routes may do in some rooms, by their names; others have no limits.
    one_way
        Doors and lines that all plans pass in one direction alone.

    Raises
    ------
    InvalidValueError
        When a name is given twice, empty, too long, not one printable line or reads as a point
        (`1,2`). When a label has no name, a point is not finite, the number of a door is not a
        positive whole one, or a use is that of no room. When a door leads into no room.

    Examples
    --------
    >>> labels = np.array([[0, 0, -1, 1]])
    >>> rooms = hn.RoomLabels(("kitchen", "hall"), labels)
    >>> rooms.index("hall")
    1
    """

    names: tuple[str, ...]
    label_of: IntArray = field(repr=False)
    points: Mapping[str, Point] = field(default_factory=dict)
    doors: Mapping[int, Point] = field(default_factory=dict, repr=False)
    uses: Mapping[str, RoomUse] = field(default_factory=dict, repr=False)
    one_way: tuple[OneWayRule, ...] = field(default=(), repr=False)

    def __post_init__(self) -> None:
        names = tuple(self.names)
        if len(names) > MAX_ROOMS:
            raise InvalidValueError(f"a map has at most {MAX_ROOMS} rooms, got {len(names)}")
        check_names(names)
        label_of = np.array(self.label_of, dtype=np.int32, order="C")
        if label_of.ndim != 2 or label_of.size == 0:  # noqa: PLR2004
            raise InvalidValueError(f"room labels need rows and columns, got {label_of.shape}")
        if label_of.min() < NO_ROOM or label_of.max() >= len(names):
            raise InvalidValueError(
                f"room labels must be from -1 to {len(names) - 1}, "
                f"got {label_of.min()} to {label_of.max()}"
            )
        label_of.flags.writeable = False
        check_names(tuple(self.points))
        points = {name: _point(f"point {name!r:.80}", at) for name, at in self.points.items()}
        doors = {check_number(n): _point(f"door {n!r:.80}", at) for n, at in self.doors.items()}
        if unknown := [name for name in self.uses if name not in names]:
            raise InvalidValueError(f"uses: no room is called {unknown[0]!r:.80}")
        uses = {name: use for name, use in self.uses.items() if use != RoomUse()}
        one_way = tuple(dict.fromkeys(map(OneWayRule.of, self.one_way)))
        for rule in one_way:
            if rule.into is not None and rule.into not in names:
                known = did_you_mean(rule.into, names)
                raise InvalidValueError(f"one_way {brief(str(rule))}: there is no such room{known}")
        for name, value in (
            ("names", names),
            ("label_of", label_of),
            ("points", MappingProxyType(points)),
            ("doors", MappingProxyType(doors)),
            ("uses", MappingProxyType(uses)),
            ("one_way", one_way),
        ):
            object.__setattr__(self, name, value)

    def index(self, name: str) -> int:
        """Return the label of a room.

        Raises
        ------
        InvalidValueError
            When no room has this name; the message suggests the nearest ones.
        """
        if name in self.names:
            return self.names.index(name)
        raise InvalidValueError(f"no room is called {name!r:.80}{did_you_mean(name, self.names)}")

    def at(self, point: Point, grid: OccupancyGrid) -> str | None:
        """Return the name of the room that a point lies in.

        Parameters
        ----------
        point
            `(x, y)` in metres, map frame.
        grid
            The map of these rooms.

        Returns
        -------
        str or None
            The name; None for a point in no room or outside the map. Rooms that are found reach
            0.25 m into walls and furniture; an outline drawn by hand holds all that lies in it.

        Raises
        ------
        InvalidValueError
            When the coordinates are not two finite numbers.

        Examples
        --------
        >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0)
        >>> rooms = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, -1, 1]]))
        >>> rooms.at((1.5, 0.5), grid), rooms.at((2.5, 0.5), grid)
        ('kitchen', None)
        """
        row, col = grid.frame.cell_of(*_point("point", point))
        rows, cols = self.label_of.shape
        if not (0 <= row < rows and 0 <= col < cols) or self.label_of[row, col] == NO_ROOM:
            return None
        return self.names[int(self.label_of[row, col])]


def _point(what: str, at: Point) -> Point:
    try:
        x, y = float(at[0]), float(at[1])
    except (TypeError, ValueError, IndexError, OverflowError):
        x = y = math.nan
    if not (math.isfinite(x) and math.isfinite(y)):
        raise InvalidValueError(
            f"{what}: expected two finite coordinates (x, y) in metres, got {at!r:.80}"
        )
    return x, y
