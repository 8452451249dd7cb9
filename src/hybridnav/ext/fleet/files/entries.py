"""Entries of a file that describes a building, with the lines in which they stand."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, get_args

from hybridnav._base.files import printable
from hybridnav._base.typing import PathLike
from hybridnav._base.yaml_file import Limits, Marked, read_marked
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError, brief
from hybridnav.ext.fleet import LinkKind
from hybridnav.ext.fleet.links import DIRECTIONS, Direction
from hybridnav.maps import OneWayRule
from hybridnav.planning import Profile

MOST_FLOORS = 99
"""Most floors of a building."""
_MOST_LINKS = 1000
_LIMITS = Limits(max_bytes=2**20, max_values=30_000)
_FILE_KEYS = ("floors", "links", "speed_m_s", "profiles")
_MOST_PROFILES = 100
_MOST_RULES = 1000
_FLOOR_KEYS = ("name", "map", "elevation_m", "rooms", "find_rooms", "one_way")
_LINK_KEYS = ("name", "kind", "ends", "wait_s", "ride_s", "cost_m", "max_radius_m", "one_way")
_END_KEYS = ("floor", "at", "room", "door", "yaw_rad")
_FARTHEST = 1e9


@dataclass(frozen=True)
class FloorEntry:
    """A floor as the file describes it."""

    name: str
    map_file: str
    elevation_m: float
    rooms_file: str | None
    find_rooms: bool
    one_way: tuple[OneWayRule, ...]
    at: str
    """Place in the file, with which messages begin."""


@dataclass(frozen=True)
class EndEntry:
    """An end of a link: a point, or what it is found by."""

    floor: str
    point: tuple[float, float] | None
    room: str | None
    door: int | None
    yaw_rad: float | None
    at: str


@dataclass(frozen=True)
class LinkEntry:
    """A link as the file describes it."""

    name: str
    kind: LinkKind
    ends: tuple[EndEntry, ...]
    numbers: dict[str, float]
    """Its times, its cost, and the radius of robots that fit in, by their names."""
    one_way: Direction | None
    at: str


@dataclass(frozen=True)
class Entries:
    """Contents of the file."""

    where: str
    floors: tuple[FloorEntry, ...]
    links: tuple[LinkEntry, ...]
    speed_m_s: float | None
    profiles: tuple[Profile, ...] = ()


def read_building_entries(path: PathLike) -> Entries:
    """Read the description of a building.

    `path`: the file, YAML. Raises `MapNotFoundError` when there is no such file, `MapError` when it
    cannot be read, or a key is missing, not known, or has a value of another kind; one line that
    names the file and the line.
    """
    marked = read_marked(
        path, what="building", error=MapError, missing=MapNotFoundError, limits=_LIMITS
    )
    where = f"building {printable(path)}"
    values = _Values(marked.values, where, _FILE_KEYS)
    floors = values.list_of("floors", MOST_FLOORS)
    if not floors:
        raise MapError(f"{where}: floors is empty, expected at least one floor")
    links = values.list_of("links", _MOST_LINKS)
    entries = Entries(
        where,
        tuple(_floor(item, _at(marked, where, "floors", i)) for i, item in enumerate(floors)),
        tuple(_link(marked, where, item, i) for i, item in enumerate(links)),
        values.number("speed_m_s"),
        _profiles(marked, where, values.list_of("profiles", _MOST_PROFILES)),
    )
    _check_names("floor", entries.floors)
    _check_names("link", entries.links)
    return entries


def _profiles(marked: Marked, where: str, items: list[Any]) -> tuple[Profile, ...]:
    profiles: dict[str, Profile] = {}
    keys = {one.name: one for one in fields(Profile)}
    for number, item in enumerate(items):
        at = _at(marked, where, "profiles", number)
        values = _Values(item, at, tuple(keys))
        name = values.name("name", needed=True) or ""
        given: dict[str, Any] = {}
        for key in values.given.keys() - {"name"}:
            is_flag = isinstance(keys[key].default, bool)
            if is_flag and not isinstance(values.given[key], bool):
                shown = brief(values.given[key])
                raise MapError(f"{at}: profile {name}: {key} must be true or false, got {shown}")
            given[key] = values.given[key] if is_flag else values.number(key)
        if name in profiles:
            raise MapError(f"{at}: profile {name}: the name is given twice")
        try:
            profiles[name] = Profile(name=name, **given)
        except InvalidValueError as error:
            raise MapError(f"{at}: {error}") from None
    return tuple(profiles.values())


def _check_names(what: str, entries: Sequence[FloorEntry | LinkEntry]) -> None:
    """Refuse a name that occurs twice, with the line of the second."""
    seen = set()
    for entry in entries:
        if entry.name in seen:
            raise MapError(f"{entry.at}: {what} {entry.name}: the name is given twice")
        seen.add(entry.name)


def _at(marked: Marked, where: str, *keys: str | int) -> str:
    return f"{where}, line {marked.line(*keys)}"


def _floor(item: Any, at: str) -> FloorEntry:
    values = _Values(item, at, _FLOOR_KEYS)
    name, elevation_m = values.name("name", needed=True), values.number("elevation_m")
    rooms_file, find = values.text("rooms"), values.given.get("find_rooms", False)
    if not isinstance(find, bool):
        raise MapError(f"{at}: find_rooms must be true or false, got {brief(find)}")
    if find and rooms_file is not None:
        raise MapError(f"{at}: rooms and find_rooms are both given: leave one out")
    map_file = values.text("map")
    if map_file is None:
        raise MapError(f"{at}: floor {name}: map is missing, expected a map file or a model")
    try:
        rules = tuple(map(OneWayRule.of, values.list_of("one_way", _MOST_RULES)))
    except InvalidValueError as error:
        raise MapError(f"{at}: floor {name}: {error}") from None
    return FloorEntry(name or "", map_file, elevation_m or 0.0, rooms_file, find, rules, at)


def _link(marked: Marked, where: str, item: Any, index: int) -> LinkEntry:
    at = _at(marked, where, "links", index)
    values = _Values(item, at, _LINK_KEYS)
    name: str = values.name("name", needed=True) or ""
    kind: Any = values.given.get("kind")
    kinds = get_args(LinkKind)
    if kind not in kinds:
        raise MapError(f"{at}: link {name}: kind must be {', '.join(kinds)}, got {brief(kind)}")
    one_way = values.given.get("one_way")
    if one_way is not None and one_way not in DIRECTIONS:
        ways = f"{' or '.join(DIRECTIONS)}, or left out for both ways"
        raise MapError(f"{at}: link {name}: one_way must be {ways}, got {brief(one_way)}")
    ends = values.list_of("ends", MOST_FLOORS)
    numbers = {key: values.number(key) for key in _LINK_KEYS[3:-1]}
    return LinkEntry(
        name,
        kind,
        tuple(
            _end(end, f"{_at(marked, where, 'links', index, 'ends', i)}: link {name}")
            for i, end in enumerate(ends)
        ),
        {key: number for key, number in numbers.items() if number is not None},
        one_way,
        at,
    )


def _end(item: Any, at: str) -> EndEntry:
    values = _Values(item, at, _END_KEYS)
    floor, room = values.name("floor", needed=True) or "", values.name("room")
    at = f"{at}: its end on floor {floor}"
    door, point = values.given.get("door"), values.given.get("at")
    if door is not None and (isinstance(door, bool) or not isinstance(door, int)):
        raise MapError(f"{at}: door must be the number of a door, got {brief(door)}")
    if point is not None and door is not None:
        raise MapError(f"{at}: at and door are both given: leave one out")
    if point is None and door is None and room is None:
        raise MapError(f"{at} lacks its place: give at: [x, y], room: NAME or door: NUMBER")
    xy = None
    if point is not None:
        if not isinstance(point, list) or len(point) != 2:  # noqa: PLR2004
            raise MapError(f"{at}: at must be [x, y] in metres, got {brief(point)}")
        x, y = (_number(number, f"{at}: at") for number in point)
        xy = x, y
    return EndEntry(floor, xy, room, door, values.number("yaw_rad"), at)


class _Values:
    """A mapping of the file, whose values are checked as they are read."""

    def __init__(self, given: Any, at: str, keys: tuple[str, ...]) -> None:
        if not isinstance(given, dict):
            expected = f"expected a mapping with {', '.join(keys[:3])}"
            raise MapError(f"{at}: {expected}, got {brief(given)}")
        for key in given:
            if key not in keys:
                shown = brief(key)
                raise MapError(f"{at}: unknown key {shown}; known are {', '.join(keys)}")
        self.given, self._at = given, at

    def list_of(self, key: str, most: int) -> list[Any]:
        value = self.given.get(key)
        if value is None:
            return []
        if not isinstance(value, list):
            raise MapError(f"{self._at}: {key} must be a list, got {brief(value)}")
        if len(value) > most:
            raise MapError(f"{self._at}: {key} has {len(value)} items, at most {most} are read")
        return value

    def text(self, key: str) -> str | None:
        value = self.given.get(key)
        if value is not None and (not isinstance(value, str) or not value):
            raise MapError(f"{self._at}: {key} must be a text, got {brief(value)}")
        return value

    def name(self, key: str, *, needed: bool = False) -> str | None:
        """Return a name, also one that YAML takes for a whole number."""
        value = self.given.get(key)
        if isinstance(value, int) and not isinstance(value, bool):
            value = str(value)
        if value is None and not needed:
            return None
        if isinstance(value, float):
            raise MapError(f'{self._at}: {key} {value} is a number: write it as "{value}"')
        if not isinstance(value, str) or not value.strip() or not value.isprintable():
            raise MapError(f"{self._at}: {key} must be a name, got {brief(value)}")
        return value

    def number(self, key: str) -> float | None:
        value = self.given.get(key)
        return None if value is None else _number(value, f"{self._at}: {key}")


def _number(value: Any, at: str) -> float:
    number = math.nan
    if isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value) if abs(value) <= _FARTHEST else math.nan
    if not math.isfinite(number):
        raise MapError(f"{at} must be a finite number, got {brief(value)}")
    return number
