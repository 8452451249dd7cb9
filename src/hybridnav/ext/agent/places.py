"""Names and places as programs give them, and what an answer shows of a room."""

import itertools
import math
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from hybridnav._base.trig import dist, hypots
from hybridnav.closures import Blocked
from hybridnav.errors import InvalidValueError
from hybridnav.ext.agent.questions import ListRooms, UnclearError
from hybridnav.maps import CellClass
from hybridnav.maps.names import did_you_mean, folded, matching, natural_key, nearest
from hybridnav.planning import HybridPlanner
from hybridnav.planning.profile import rebuilt
from hybridnav.reasons import Explanation
from hybridnav.rooms import Door, Rooms

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


class Thing(NamedTuple):
    """A thing that is closed."""

    kind: str
    """`doors`, `rooms` or `links`."""
    which: int | str
    """The number of a door, or a name."""
    floor: str | None = None
    """Its floor; None on one map, and for a link that is closed on all floors."""

    @property
    def shown(self) -> int | str:
        """What an answer calls it."""
        if self.kind == "links":
            return str(self.which) if self.floor is None else f"{self.which}@{self.floor}"
        if self.floor is None:
            return self.which
        return f"floor {self.floor}, {'door ' if self.kind == 'doors' else ''}{self.which}"


def blocked_of(things: Iterable[Thing]) -> Blocked:
    """Return doors and rooms as planners close them."""
    by: dict[str, dict[Any, None]] = {"doors": {}, "rooms": {}}
    for one in things:
        by[one.kind][one.which] = None
    return Blocked(doors=list(by["doors"]), rooms=list(by["rooms"]))


class NamedPlaces:
    """The rooms and doors of one map, by what programs call them."""

    def __init__(self, rooms: Rooms) -> None:
        self.rooms = rooms

    def listed(self) -> list[str]:
        """Return the names of the rooms that lists show, in natural order."""
        rooms = self.rooms
        names = [name for name, on in zip(rooms.names, rooms.is_listed, strict=True) if on]
        return sorted(names, key=natural_key)

    def names(self, *, points: bool = False) -> list[str]:
        """Return the names of all rooms, with `points` of named points too."""
        labels = self.rooms.labels
        return list(dict.fromkeys((*labels.names, *(labels.points if points else ()))))

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

    def facts(self) -> dict[str, Any]:
        """Return what describes the map: its size, and what there is."""
        grid, kinds = self.rooms.grid, [self.kind(one) for one in self.listed()]
        rows, cols = grid.shape
        size = [round(cols * grid.resolution_m, 2), round(rows * grid.resolution_m, 2)]
        free_m2 = float((grid.measured == CellClass.FREE).sum() * grid.cell_area_m2)
        return {
            "size_m": size,
            "corners": grid.frame.points_of_grid(np.array([[0, 0], [rows, cols]]))
            .round(2)
            .tolist(),
            "free_m2": round(free_m2, 1),
            "rooms": {kind: kinds.count(kind) for kind in ("room", "corridor", "hall")},
            "doors": len(self.rooms.listed_doors),
        }

    def asked(self, asked: ListRooms) -> list[dict[str, Any]]:
        """Return the rooms of a kind, or by a part of the name."""
        names = [one for one in self.listed() if asked.kind in {None, self.kind(one)}]
        if asked.name.strip():
            names = [names[at] for at in matching(asked.name, names)]
        return [self.room(name) for name in names]

    def where(self, point: Point) -> dict[str, Any]:
        """Return the room of a point, what lies beside it, and the nearest door."""
        rooms, grid, (x, y) = self.rooms, self.rooms.grid, point
        row, col = grid.frame.cell_of(x, y)
        if not (0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]):
            raise InvalidValueError("the point lies outside the map: describe_map has its corners")
        name, ground = rooms.at(point), CellClass(grid.measured[row, col])
        place = "no room"
        if name is not None:
            place = f"{self.kind(name)} {name}".replace("room room", "room")
        text = f"({x:g}, {y:g}) lies in {place}"
        if ground != CellClass.FREE:
            text += f", on {ground.name.lower()} ground"
        beside = [
            {"door": door.number, "to": other, "kind": door.kind}
            for door in ([] if name is None else self.doors_of(name))
            for other in door.rooms
            if other != name
        ]
        answer: dict[str, Any] = {
            "text": f"{text}.",
            "room": name,
            "ground": ground.name.lower(),
            "beside": beside[:SHOWN],
        }
        near = min(rooms.listed_doors, key=lambda door: dist(door.position, point), default=None)
        if near is not None:
            straight_m = round(dist(near.position, point), 2)
            answer["nearest_door"] = {"number": near.number, "straight_m": straight_m}
        return answer

    def meant(self, name: str, known: list[str]) -> str:
        """Return the one name that a text means; see `meant`."""
        return meant(name, known, self.choices)

    def choices(self, names: Iterable[str]) -> list[dict[str, Any]]:
        """Return what an answer shows of names to choose from."""
        listed = self.rooms.names
        return [self.room(one) if one in listed else {"name": one} for one in names]

    def place(self, place: str | list[float]) -> str | tuple[float, float]:
        """Return a place as planners take it."""
        if not isinstance(place, str):
            return place[0], place[1]
        return self.meant(place, self.names(points=True))

    def things(self, things: list[int | str], *, of_doors: bool = False) -> list[Thing]:
        """Return what a list names: doors by number or as "door 12", rooms by name.

        `of_doors`: whether "12" is a door too.
        """
        items = []
        for thing in things:
            number = door_of(thing, of_doors=of_doors)
            if number is not None:
                items.append(Thing("doors", self.rooms.listed_door(number).number))
            else:
                items.append(Thing("rooms", self.meant(str(thing).strip(), list(self.rooms.names))))
        return items

    def candidates(
        self, of: str, start: str | tuple[float, float]
    ) -> list[tuple[dict[str, Any], tuple[float, float]]]:
        """Return rooms or doors of a kind or name, each with a point to go to; none for no such
        thing."""
        rooms, word = self.rooms, folded(of).strip()
        kind = next((one for one, words in _KINDS.items() if word in words), None)
        if kind == "door":
            return [
                ({"number": door.number, "rooms": list(door.rooms)}, self._beside(door))
                for door in rooms.listed_doors
                if door.passable and not door.is_opening
            ]
        names = [name for name in self.listed() if name != start]
        fitting = [name for name in names if self.kind(name) == kind]
        # A map without halls may have a room called "hall 3".
        fitting = fitting or [names[at] for at in matching(kind or of, names)]
        return [(self.room(name), rooms.point_of(name)) for name in fitting]

    def _beside(self, door: Door) -> tuple[float, float]:
        """Return a point in a door that the robot can stand on."""
        grid = self.rooms.grid
        cells = np.stack(divmod(self.rooms.cells_beside(door.number), grid.shape[1]), axis=1)
        cells = cells[grid.classes[tuple(cells.T)] == CellClass.FREE]
        points = grid.frame.points_of(cells)
        x, y = points[hypots(*(points - door.position).T).argmin()].tolist()
        return x, y


def door_of(thing: int | str, *, of_doors: bool = False) -> int | None:
    """Return the number of a door that is named, None for another thing.

    `of_doors`: whether "12" is a door too.
    """
    text = str(thing).strip()
    number = _DOOR.fullmatch(text)
    is_number = isinstance(thing, int) or (of_doors and text.isascii() and text.isdecimal())
    return int(number[1]) if number else int(text) if is_number else None


Choices: TypeAlias = "Callable[[Iterable[str]], list[dict[str, Any]]]"
"""Returns what an answer shows of names to choose from."""


def meant(name: str, known: Sequence[str], choices: Choices) -> str:
    """Return the one name that a text means.

    Raises `UnclearError` when it means none, or several.
    """
    if name in known:
        return name
    wanted = folded(name).split()
    while len(wanted) > 1 and wanted[0] in _ARTICLES:
        wanted = wanted[1:]
    text = " ".join(wanted)
    fitting = [known[at] for at in matching(text, known)]
    plain = _SIGNS.sub(" ", text).strip()
    alike = [one for one in known if _SIGNS.sub(" ", folded(one)).strip() == plain]
    fitting = alike or fitting
    if len(fitting) == 1:
        return fitting[0]
    if not fitting:
        raise nothing(name, "no room", known, choices)
    raise UnclearError(
        f"{name!r:.80} may mean {len(fitting)} of them: ask again with one of the names",
        choices(fitting[:SHOWN]),
    )


def nothing(name: str, what: str, known: Iterable[str], choices: Choices) -> UnclearError:
    """Return the refusal of a name that means nothing, with the names that are like it."""
    names = tuple(known)
    text = f"{what} is called {name!r:.80}{did_you_mean(name, names)}"
    return UnclearError(text, choices(nearest(name, names)))


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
