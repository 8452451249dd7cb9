"""The form of a file that lists rooms: its entries, with their lines."""

from __future__ import annotations

import math
import zlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from hybridnav._base.typing import FloatArray, IntArray
from hybridnav._base.yaml_file import Limits, Marked
from hybridnav.errors import InvalidValueError, RoomsError, brief
from hybridnav.maps import OccupancyGrid, OneWayRule, RoomUse
from hybridnav.maps.names import check_number
from hybridnav.maps.occupancy import extent

USE_KEYS = ("use", "prefer", "cost")
ROOM_KEYS = ("name", "polygon", "polygons", "seed", "point", *USE_KEYS)
SHAPE_KEYS = ("polygon", "polygons", "seed")
FILE_KEYS = ("rooms", "points", "doors", "one_way", "cells", "map")
_OUTSIDE_CELLS = 1.0
"""Greatest distance that an outline may reach over the rim of the map."""
_FEWEST_CORNERS = 3
_LEAST_AREA_CELLS = 1e-6
_BESIDE_M = 0.5
"""Distance up to which two outlines of one name make one room: walls are thinner."""
_FARTHEST = 1e9
"""Metres or pixels beyond which a coordinate counts as a mistake."""

_DECIMALS = 4
"""Digits after the point of the coordinates in a fingerprint."""

LIMITS = Limits(max_bytes=2**22, max_values=100_000)
"""Limits of a file of rooms; hostile files take three seconds."""


def signature_of(grid: OccupancyGrid, more: str = "") -> int:
    """Return a number of the frame and the size of a map, and of some text."""
    frame = grid.frame
    values = (*grid.shape, frame.resolution_m, *frame.origin_m, frame.yaw_rad)
    return zlib.crc32((" ".join(f"{value:.9g}" for value in values) + more).encode())


def fingerprint(rings: Sequence[FloatArray]) -> int:
    """Return a number of the coordinates of an outline, which another outline hardly has."""
    text = ";".join(",".join(f"{n:.{_DECIMALS}f}" for n in ring.ravel().tolist()) for ring in rings)
    return zlib.crc32(text.encode()) or 1


@dataclass(frozen=True, eq=False)
class Outline:
    """The outline of an entry."""

    room: int
    rings: list[FloatArray]
    """float64 (n, 2) each, in cells, x along columns and y along rows."""
    fingerprint: int
    """Number of these coordinates; an outline that a person has changed has another."""
    line: int = 0
    """Line of the file in which the entry begins."""


@dataclass
class Read:
    """Contents of a file."""

    where: str
    names: list[str] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    """Line of the first entry of each room; empty where the file has no entries."""
    outlines: list[Outline] = field(default_factory=list)
    seeds: dict[int, tuple[float, float]] = field(default_factory=dict)
    points: dict[str, tuple[float, float]] = field(default_factory=dict)
    doors: dict[int, tuple[float, float]] = field(default_factory=dict)
    uses: dict[str, RoomUse] = field(default_factory=dict)
    one_way: list[OneWayRule] = field(default_factory=list)
    folder: Path = Path()
    """Where the file lies, and images beside it."""
    cells: str | list[Any] = ""
    """The image of cells beside the file; in files of earlier versions, cells packed as text."""
    label_of: IntArray | None = None

    def of(self, room: int, line: int = 0) -> str:
        """Return the file, the line and the room, as a message about the room begins."""
        line = line or (self.lines[room] if self.lines else 0)
        return f"{self.where}{f', line {line}' if line else ''}: room {brief(self.names[room])}"


def read_entries(marked: Marked, where: str, grid: OccupancyGrid) -> Read:
    """Read the form of a file that lists rooms.

    Entries of one name are one room, if their outlines lie beside each other.

    Raises `RoomsError` when an entry is wrong; the message names its line.
    """
    values, read = marked.values, Read(where)
    check_keys(values, FILE_KEYS, where)
    for number, entry in enumerate(list_of(values["rooms"], f"{where}: rooms")):
        line = marked.line("rooms", number)
        at = f"{where}, line {line}: room {number + 1}"
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
            raise RoomsError(f"{at}: expected a mapping with a name, got {brief(entry)}")
        _read_room(read, entry, line, grid)
    _check_beside(read, grid)
    taken = {*read.points, *read.names}
    for number, entry in enumerate(list_of(values.get("points", []), f"{where}: points")):
        at = f"{where}, line {marked.line('points', number)}"
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
            raise RoomsError(f"{at}: points: expected a name and a point, got {entry!r:.80}")
        if entry["name"] in taken:
            raise RoomsError(f"{at}: point {brief(entry['name'])}: the name is given twice")
        taken.add(entry["name"])
        read.points[entry["name"]] = xy_of(
            entry.get("point"), f"{at}: point {brief(entry['name'])}"
        )
    read.doors = _doors(marked, where)
    for number, text in enumerate(list_of(values.get("one_way", []), f"{where}: one_way")):
        try:
            read.one_way.append(OneWayRule.of(text))
        except InvalidValueError as error:
            raise RoomsError(f"{where}, line {marked.line('one_way', number)}: {error}") from None
    read.cells = values.get("cells", "")
    if not isinstance(read.cells, str | list):
        raise RoomsError(f"{where}: cells: expected the name of an image, got {brief(read.cells)}")
    return read


def _read_room(read: Read, entry: dict[str, Any], line: int, grid: OccupancyGrid) -> None:
    name = entry["name"]
    is_new = name not in read.names
    if is_new:
        read.names.append(name)
        read.lines.append(line)
    room = read.names.index(name)
    at = read.of(room, line)
    check_keys(entry, ROOM_KEYS, at)
    shapes = [key for key in SHAPE_KEYS if key in entry]
    if len(shapes) != 1:
        raise RoomsError(
            f"{at}: expected one of polygon, polygons and seed, got {', '.join(shapes) or '-'}"
        )
    if "point" in entry:
        if name in read.points:
            raise RoomsError(f"{at}: the room has a point in line {read.lines[room]}, keep one")
        read.points[name] = xy_of(entry["point"], f"{at}: point")
    if any(key in entry for key in USE_KEYS):
        if name in read.uses:
            raise RoomsError(f"{at}: the room has a use in line {read.lines[room]}, keep one")
        read.uses[name] = _use(entry, at)
    if "seed" in entry:
        if not is_new:
            raise RoomsError(
                f"{at}: the name is given twice, first in line {read.lines[room]}: "
                "only outlines are joined, give the seed another name"
            )
        read.seeds[room] = xy_of(entry["seed"], f"{at}: seed")
        return
    if room in read.seeds:
        raise RoomsError(
            f"{at}: the name is given twice, first in line {read.lines[room]}: "
            "only outlines are joined, give the seed another name"
        )
    rings = [entry["polygon"]] if "polygon" in entry else entry["polygons"]
    outlines = [_ring(ring, f"{at}: polygon") for ring in list_of(rings, f"{at}: polygons")]
    checked = checked_rings([in_cells(ring, grid) for ring in outlines], at, grid)
    read.outlines.append(Outline(room, checked, fingerprint(outlines), line))


def _use(entry: dict[str, Any], at: str) -> RoomUse:
    for key, word in (("use", "private"), ("prefer", "corridor")):
        if entry.get(key, word) != word:
            raise RoomsError(f"{at}: {key} must be {word}, got {brief(entry[key])}")
    try:
        cost = number_of(entry.get("cost", 1.0), f"{at}: cost")
        return RoomUse("use" in entry, "prefer" in entry, cost)
    except InvalidValueError as error:
        raise RoomsError(f"{at}: {error}") from None


def _check_beside(read: Read, grid: OccupancyGrid) -> None:
    """Refuse outlines of one name that lie apart: a name given twice by mistake."""
    lines_of: dict[int, list[Outline]] = {}
    for outline in read.outlines:
        lines_of.setdefault(outline.room, []).append(outline)
    most = _BESIDE_M / grid.resolution_m
    for room, outlines in lines_of.items():
        shapes = [shapely.multilinestrings(_closed(outline.rings)) for outline in outlines]
        for number, outline in enumerate(outlines[1:], start=1):
            others = [shape for at, shape in enumerate(shapes) if at != number]
            shapely.prepare(shapes[number])
            if not shapely.dwithin(shapes[number], others, most).any():
                raise RoomsError(
                    f"{read.of(room, outline.line)}: the name is given twice, first in line "
                    f"{outlines[0].line}, and these outlines lie more than {_BESIDE_M:g} m apart: "
                    "give them two names, or draw them beside each other to make them one room"
                )


def _closed(rings: list[FloatArray]) -> list[Any]:
    return [shapely.linestrings(np.concatenate([ring, ring[:1]])) for ring in rings]


def _doors(marked: Marked, where: str) -> dict[int, tuple[float, float]]:
    """Return the numbers of doors, each with a point of its boundary.

    Older files have a list of numbers and points.
    """
    value = marked.values.get("doors", {})
    if isinstance(value, dict):
        at = f"{where}, line {marked.line('doors')}: doors" if value else where
        each = [(at, number, point) for number, point in value.items()]
    else:
        each = []
        for index, entry in enumerate(list_of(value, f"{where}: doors")):
            at = f"{where}, line {marked.line('doors', index)}: doors"
            if not isinstance(entry, dict) or "number" not in entry:
                raise RoomsError(f"{at}: expected a number and a point, got {brief(entry)}")
            check_keys(entry, ("number", "point"), f"{at}: door {entry['number']!r:.20}")
            each.append((at, entry["number"], entry.get("point")))
    doors: dict[int, tuple[float, float]] = {}
    for at, given, point in each:
        try:
            number = check_number(given)
        except InvalidValueError as error:
            raise RoomsError(f"{at}: {error}") from None
        if number in doors:
            raise RoomsError(f"{at}: door {number}: the number is given twice, keep one")
        doors[number] = xy_of(point, f"{at}: door {number}: point")
    return doors


def checked_rings(rings: list[FloatArray], at: str, grid: OccupancyGrid) -> list[FloatArray]:
    """Return the rings after a check that they have corners, an area, and a place on the map."""
    for ring in rings:
        if len(ring) < _FEWEST_CORNERS:
            raise RoomsError(f"{at}: a polygon needs at least three corners, got {len(ring)}")
    if all(_is_straight(ring) for ring in rings):
        raise RoomsError(f"{at}: the polygon has no area")
    corners, rim = np.concatenate(rings), np.array(grid.shape[::-1]) + _OUTSIDE_CELLS
    if (corners < -_OUTSIDE_CELLS).any() or (corners > rim).any():
        raise RoomsError(f"{at}: the polygon leaves the map, which spans {extent(grid)}")
    return rings


def _is_straight(ring: FloatArray) -> bool:
    """Return whether all corners lie on one line."""
    offset = ring - ring[0]
    far = offset[np.argmax(np.abs(offset).sum(axis=1))]
    cross = offset[:, 0] * far[1] - offset[:, 1] * far[0]
    return bool((np.abs(cross) <= _LEAST_AREA_CELLS).all())


def in_cells(points: FloatArray, grid: OccupancyGrid) -> FloatArray:
    """Convert points in metres to cells, x along columns and y along rows."""
    return grid.frame.positions_of(points)[:, ::-1]


def check_keys(values: dict[Any, Any], known: tuple[str, ...], at: str) -> None:
    """Refuse keys that are not known."""
    for key in values:
        if key not in known:
            raise RoomsError(f"{at}: unknown key {key!r:.80}; known are {', '.join(known)}")


def list_of(value: Any, at: str) -> list[Any]:
    """Return a value that must be a list."""
    if not isinstance(value, list):
        raise RoomsError(f"{at}: expected a list, got {brief(value)}")
    return value


def _ring(value: Any, at: str) -> FloatArray:
    """Return the corners in metres, float64 (n, 2), without rows for an empty list."""
    corners = [xy_of(corner, at) for corner in list_of(value, at)]
    return np.array(corners, dtype=np.float64).reshape(-1, 2)


def number_of(value: Any, at: str) -> float:
    """Return a value that must be a finite number."""
    number = math.nan
    if isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value) if abs(value) <= _FARTHEST else math.nan
    if not math.isfinite(number):
        raise RoomsError(f"{at}: expected a number, got {brief(value)}")
    return number


def xy_of(value: Any, at: str) -> tuple[float, float]:
    """Return a value that must be two finite numbers."""
    if not isinstance(value, list) or len(value) != 2:  # noqa: PLR2004
        raise RoomsError(f"{at}: expected [x, y] in metres, got {brief(value)}")
    return number_of(value[0], at), number_of(value[1], at)
