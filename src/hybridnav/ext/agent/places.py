"""Names and places as programs give them, and what an answer shows of a room."""

from __future__ import annotations

import itertools
import math
import re
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.errors import HybridNavError
from hybridnav.maps import CellClass
from hybridnav.maps.names import did_you_mean, folded, matching, natural_key, nearest
from hybridnav.planner import Blocked, Explanation, HybridPlanner
from hybridnav.planner.profile import rebuilt

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav.topology.rooms import Door, Rooms

Point = tuple[float, float]
_ARTICLES = {"the", "a", "an", "der", "die", "das", "dem", "den", "ein", "eine", "einen", "einem"}
_DOOR = re.compile(r"(?:door|tür|tuer)[ :#-]*(\d{1,9})", re.IGNORECASE)
_KINDS = {
    "door": {"door", "doors", "tur", "turen"},
    "room": {"room", "rooms", "raum", "raume", "zimmer"},
    "corridor": {"corridor", "corridors", "flur", "flure"},
    "hall": {"hall", "halls", "halle", "hallen"},
}
"""Words for each kind of thing, folded."""
_SIGNS = re.compile(r"[\W_]+")
_MOST_LETTERS = 900
"""Letters of the words of a route: a whole answer has at most 2 kB."""
SHOWN = 10
"""Choices, doors and neighbours of an answer."""


class UnclearError(HybridNavError):
    """A name that means nothing, or several things."""

    def __init__(self, text: str, choices: Iterable[dict[str, Any]] = ()) -> None:
        super().__init__(text)
        self.choices = list(choices)


class NamedPlaces:
    """The rooms and doors of one map, by what programs call them."""

    def __init__(self, rooms: Rooms) -> None:
        self.rooms = rooms

    def listed(self) -> list[str]:
        """Return the names of the rooms that lists show, in natural order."""
        rooms = self.rooms
        names = [name for name, on in zip(rooms.names, rooms.is_listed, strict=True) if on]
        return sorted(names, key=natural_key)

    def kind(self, name: str) -> str:
        """Return what a room is: `room`, `corridor` or `hall`."""
        kind = self.rooms.kinds[self.rooms.labels.index(name)]
        return "room" if kind is None else kind.name

    def doors_of(self, name: str) -> list[Door]:
        """Return the listed doors of a room."""
        return [door for door in self.rooms.listed_doors if name in door.rooms]

    def room(self, name: str) -> dict[str, Any]:
        """Return what a list shows of a room."""
        rooms = self.rooms
        return {
            "name": name,
            "kind": self.kind(name),
            "area_m2": round(float(rooms.areas_m2[rooms.labels.index(name)]), 1),
            "point": rounded(rooms.point_of(name)),
            "doors": [door.number for door in self.doors_of(name)][:SHOWN],
        }

    def meant(self, name: str, known: list[str]) -> str:
        """Return the one name that a text means.

        Raises `UnclearError` when it means none, or several.
        """
        if name in known:
            return name
        wanted = folded(name).split()
        while len(wanted) > 1 and wanted[0] in _ARTICLES:
            wanted = wanted[1:]
        text = " ".join(wanted)
        found = [known[at] for at in matching(text, known)]
        plain = _SIGNS.sub(" ", text).strip()
        alike = [one for one in known if _SIGNS.sub(" ", folded(one)).strip() == plain]
        found = alike or found
        if len(found) == 1:
            return found[0]
        if not found:
            raise self._nothing(name, "no room", known)
        raise UnclearError(
            f"{name!r:.80} may mean {len(found)} of them: ask again with one of the names",
            self._choices(found[:SHOWN]),
        )

    def _choices(self, names: Iterable[str]) -> list[dict[str, Any]]:
        listed = self.rooms.names
        return [self.room(one) if one in listed else {"name": one} for one in names]

    def _nothing(self, name: str, what: str, known: Iterable[str]) -> UnclearError:
        """Return the refusal of a name that means nothing, with the names that are like it."""
        names = tuple(known)
        text = f"{what} is called {name!r:.80}{did_you_mean(name, names)}"
        return UnclearError(text, self._choices(nearest(name, names)))

    def place(self, place: str | list[float]) -> str | tuple[float, float]:
        """Return a place as planners take it."""
        if not isinstance(place, str):
            return place[0], place[1]
        labels = self.rooms.labels
        return self.meant(place, list(dict.fromkeys((*labels.names, *labels.points))))

    def blocked(self, things: list[int | str], *, of_doors: bool = False) -> Blocked:
        """Return what a list names: doors by number or as "door 12", rooms by name.

        `of_doors`: whether "12" is a door too.
        """
        doors, rooms = [], []
        for thing in things:
            text = str(thing).strip()
            number = _DOOR.fullmatch(text)
            if number or isinstance(thing, int) or (of_doors and text.isdecimal()):
                doors.append(self.rooms.listed_door(int(number[1] if number else text)).number)
            else:
                rooms.append(self.meant(text, list(self.rooms.names)))
        return Blocked(doors=doors, rooms=rooms)

    def candidates(
        self, of: str, start: str | tuple[float, float]
    ) -> list[tuple[dict[str, Any], tuple[float, float]]]:
        """Return rooms or doors of a kind or name, each with a point to go to."""
        rooms, word = self.rooms, folded(of).strip()
        kind = next((one for one, words in _KINDS.items() if word in words), None)
        if kind == "door":
            return [
                ({"number": door.number, "rooms": list(door.rooms)}, self._beside(door))
                for door in rooms.listed_doors
                if door.passable and not door.is_opening
            ]
        names = [name for name in self.listed() if name != start]
        found = [name for name in names if self.kind(name) == kind]
        # A map without halls may have a room called "hall 3".
        found = found or [names[at] for at in matching(kind or of, names)]
        if not found:
            raise self._nothing(of, "nothing", names)
        return [(self.room(name), rooms.point_of(name)) for name in found]

    def _beside(self, door: Door) -> tuple[float, float]:
        """Return a point in a door that the robot can stand on."""
        grid = self.rooms.grid
        cells = np.stack(divmod(self.rooms.cells_beside(door.number), grid.shape[1]), axis=1)
        cells = cells[grid.classes[tuple(cells.T)] == CellClass.FREE]
        points = grid.frame.points_of(cells)
        x, y = points[np.hypot(*(points - door.position).T).argmin()].tolist()
        return x, y


def rounded(point: tuple[float, ...] | None) -> list[float] | None:
    """Return a point to the millimetre."""
    return None if point is None else [round(number, 3) for number in point]


def rounded_down(bound: float, digits: int = 3) -> float:
    """Return a bound with so many digits, none of which is above it."""
    return math.floor(bound * 10**digits) / 10**digits


def fitting(lines: list[str]) -> list[str]:
    """Return the first lines, as many as an answer holds, one at least."""
    ends = itertools.accumulate(len(line) for line in lines)
    return lines[: max(1, sum(end <= _MOST_LETTERS for end in ends))]


def doubled(radius_m: float) -> float | None:
    """Return the width of a radius, rounded down; None for no limit."""
    return math.floor(radius_m * 2000) / 1000 if math.isfinite(radius_m) else None


def tight_of(why: Explanation) -> dict[str, Any]:
    """Return where the widest path is tightest."""
    if why.tight is None:
        return {}
    door = None if why.tight.door is None else why.tight.door.number
    return {"tight": {"point": rounded(why.tight.point), "door": door}}


def narrowed(planner: HybridPlanner, radius_m: float) -> HybridPlanner:
    """Return the planner of a robot of another radius on the same map, with the same rooms."""
    grid = replace(planner.grid, robot_radius_m=radius_m)
    return HybridPlanner(rebuilt(planner.topology, grid), preset=planner.preset)
