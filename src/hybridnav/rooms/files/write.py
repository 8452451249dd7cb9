"""Writer of files of rooms, with outlines in metres that a person can edit."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml

from hybridnav._base.files import printable, replace_file
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, PathLike
from hybridnav.errors import InvalidValueError, RoomsError
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid, RoomLabels, RoomUse
from hybridnav.maps.checks import checked_type
from hybridnav.maps.room_labels import Point
from hybridnav.rooms.files.entries import LIMITS, Outline, Read, fingerprint, in_cells, packed
from hybridnav.rooms.files.outlines import Outlines, decimals_of
from hybridnav.rooms.files.paint import apart, by_rule, outlined
from hybridnav.rooms.files.read import check_points, check_rooms, labels_of
from hybridnav.rooms.files.text import HEADER, NOTES, OldText, scalar

_MOST_BYTES = 20_000
"""Size of a file above which coarser outlines are tried: more than a person edits."""
_TOLERANCES_M = (0.05, 0.075, 0.1, 0.125, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4, 0.5, 0.6)


def save_rooms(
    path: PathLike, rooms: RoomLabels, grid: OccupancyGrid, *, tolerance_m: float | None = None
) -> None:
    """Write rooms as a file that `load_rooms` reads and a person can edit.

    Outlines have few corners, lie along walls, and neighbours share their common border. The cells
    that they miss are kept in `cells`, so that every cell is read with the room that it has, or
    with none. The doors are written with their numbers, so that lists, pictures and plans of the
    file use the same.

    Where the file exists, outlines that still hold, and all comments, are kept. Where
    a room has the cells that it had and another name, the name alone is changed.

    Parameters
    ----------
    path
        The file to write.
    rooms
        Labels of the cells of the map.
    grid
        The map.
    tolerance_m
        How far outlines may lie from the steps of the cells, in metres, before they are brought
        into line with walls. None for the least of twelve from 0.05 to 0.6 m with which the file
        has at most 20 kB, else 0.6.

    Raises
    ------
    InvalidValueError
        When the tolerance is not positive and finite, these are no rooms or no map, or the rooms
        are those of a map of another size.
    RoomsError
        When the file cannot be written, or there are too many rooms. When it could not be read
        again: a room has no free cell, or a named point lies outside the map or in an obstacle.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0)
    >>> rooms = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, 1, 1]]))
    >>> hn.save_rooms("rooms.yaml", rooms, grid)
    >>> hn.load_rooms("rooms.yaml", grid).names
    ('kitchen', 'hall')
    """
    if tolerance_m is not None and not 0 < tolerance_m < math.inf:
        raise InvalidValueError(f"tolerance_m must be positive and finite, got {tolerance_m}")
    checked_type("rooms", rooms, RoomLabels)
    checked_type("grid", grid, OccupancyGrid)
    where = f"rooms {printable(path)}"
    if rooms.label_of.shape != grid.shape:
        raise InvalidValueError(
            f"rooms are labels of {rooms.label_of.shape} cells, expected those of the grid, "
            f"{grid.shape}: after an update give the grid of that version"
        )
    check_rooms(Read(where, list(rooms.names)), rooms.label_of, grid)
    check_points(rooms.points, where, grid)
    old = OldText.of(path, rooms, grid)
    tolerances_m = _TOLERANCES_M if tolerance_m is None else (tolerance_m,)
    text = _Writer(rooms, grid, where).fitting(old, tolerances_m).text
    size = len(text.encode())
    # A value has two bytes or more.
    n_values = 0 if size < 2 * LIMITS.max_values else _n_values(text)
    if n_values > LIMITS.max_values or size > LIMITS.max_bytes:
        raise RoomsError(
            f"{where}: {len(rooms.names)} rooms take {n_values} values and {size} bytes, "
            f"at most {LIMITS.max_values} and {LIMITS.max_bytes} are read"
        )
    try:
        replace_file(Path(path), text.encode())
    except OSError as error:
        raise RoomsError(f"{where}: cannot write: {error.strerror}") from None


@dataclass(frozen=True, eq=False)
class _Draft:
    """A file."""

    lines: list[str]
    """Those up to the cells."""
    cells: list[str]
    """Those of the cells."""
    read: Read
    """What a reader makes of them, before it paints the outlines."""
    newline: str = "\n"
    """How they end."""

    @property
    def text(self) -> str:
        """The whole text."""
        return "".join(f"{line}{self.newline}" for line in [*self.lines, *self.cells])


@dataclass(frozen=True, eq=False)
class _Target:
    """What a file has to be read as, but for the outlines that a person has drawn."""

    label_of: IntArray
    """int32 (rows, cols), -1 where such outlines lie, and for rooms that have no others."""
    is_drawn: BoolArray
    """bool (rows, cols), the cells in such outlines."""
    by_rule: IntArray
    """int32 (rows, cols), what these labels of free cells make of the others."""


class _Writer:
    """Drafts of a file with outlines of several tolerances."""

    def __init__(self, rooms: RoomLabels, grid: OccupancyGrid, where: str) -> None:
        self._rooms = rooms
        self._grid = grid
        self._where = where
        self._outlines = Outlines(rooms.label_of, len(rooms.names), grid)
        self._apart = apart(grid)
        self._names = [_name(name) for name in rooms.names]

    def fitting(self, old: OldText | None, tolerances_m: Sequence[float]) -> _Draft:
        """Return the finest draft of at most 20 kB that is read as these rooms, else the
        coarsest; tolerances ascend."""
        # Loads scipy and numba.
        from hybridnav.rooms.doors import numbered  # noqa: PLC0415

        doors = _door_lines(numbered(self._rooms, self._grid), self._grid)
        rules = self._rooms.one_way
        doors += ["one_way:"] * bool(rules) + [f"- {scalar(str(rule))}" for rule in rules]
        most = _MOST_BYTES - sum(len(line.encode()) + 1 for line in doors)
        for kept in [old, None] if old is not None and old.blocks else [None]:
            target = self._target(kept)
            best: _Draft | None = None
            low, high = 0, len(tolerances_m)
            while low < high:
                # The coarsest first: it may be the only one.
                middle = len(tolerances_m) - 1 if best is None else (low + high) // 2
                draft = self._draft(self._outlines.within(tolerances_m[middle]), target, kept)
                fits = len(draft.text.encode()) <= most
                best = draft if fits or best is None else best
                low, high = (low, middle) if fits else (middle + 1, high)
            if best is not None and self._is_right(best):
                comments = old.comments if kept is None and old is not None else []
                return replace(best, lines=[*comments, *best.lines, *doors])
        raise AssertionError  # a draft without an old file always holds

    def _target(self, old: OldText | None) -> _Target:
        """Return what the cells have to be read as beside what an old file holds."""
        kept = [] if old is None else old.outlines
        unchanged = set() if old is None else old.written
        drawn = [each for each in kept if each.fingerprint not in unchanged]
        read = Read(self._where, list(self._rooms.names), [1] * len(self._rooms.names), drawn)
        is_drawn = outlined(read, (), self._grid)[1] != NO_ROOM
        others = {each.room for each in kept if each.fingerprint in unchanged}
        without = is_drawn | np.isin(
            self._rooms.label_of, [each.room for each in drawn if each.room not in others]
        )
        label_of = np.where(without, np.int32(NO_ROOM), self._rooms.label_of)
        return _Target(label_of, is_drawn, by_rule(label_of, self._grid))

    def _draft(
        self, rings_of: list[list[FloatArray]], target: _Target, old: OldText | None
    ) -> _Draft:
        """Return a draft without doors, with these outlines for the rooms that the old file does
        not hold as they are."""
        rooms, grid = self._rooms, self._grid
        fresh = {
            room: Outline(room, [in_cells(ring, grid) for ring in rings], fingerprint(rings))
            for room, rings in enumerate(rings_of)
        }
        kept = [] if old is None else old.outlines
        done = {outline.room for outline in kept}
        outlines = sorted(
            [*kept, *(fresh[room] for room in fresh if room not in done)],
            key=lambda each: each.room,
        )
        unchanged = set() if old is None else old.written
        written = [o for o in outlines if o.room not in done or o.fingerprint in unchanged]
        read = Read(self._where, list(rooms.names), [1] * len(rooms.names), outlines)
        plain, _ = outlined(read, [outline.fingerprint for outline in written], grid)
        plain[self._apart] = NO_ROOM
        plain = np.where(grid.measured == CellClass.FREE, plain, target.by_rule)
        missed = (plain != target.label_of) & ~target.is_drawn
        cells = packed(missed, target.label_of, [(o.room, o.fingerprint) for o in written], grid)
        entries = {room: self._entry(room, rings) for room, rings in enumerate(rings_of)}
        if old is None:
            lines = [HEADER[0].format(" ".join(grid.name.split())), *HEADER[1:]]
            lines.append("rooms:" if rooms.names else "rooms: []")
            lines += [line for room in entries for line in entries[room]]
            lines += _point_lines(rooms)
        else:
            lines = old.with_entries(entries, _point_lines(rooms))
        newline = "\n" if old is None else old.newline
        return _Draft(lines, _cell_lines(cells), replace(read, cells=cells), newline)

    def _is_right(self, draft: _Draft) -> bool:
        """Return whether a draft is read as these rooms; outlines of an old file may prevent it."""
        return bool((labels_of(draft.read, self._grid) == self._rooms.label_of).all())

    def _entry(self, room: int, rings: list[FloatArray]) -> list[str]:
        lines = [f"- {self._names[room]}"]
        if len(rings) == 1:
            lines.append(f"  polygon: {_ring(rings[0])}")
        else:
            lines += ["  polygons:", *(f"  - {_ring(ring)}" for ring in rings)]
        points, name = self._rooms.points, self._rooms.names[room]
        if name in points:
            lines.append(f"  point: {_corner(*points[name])}")
        use = self._rooms.uses.get(name, RoomUse())
        lines += ["  use: private"] * use.private + ["  prefer: corridor"] * use.corridor
        return [*lines, f"  cost: {_number(use.cost)}"] if use.cost > 1 else lines


def _n_values(text: str) -> int:
    """Return the number of values that a reader counts."""
    return sum(isinstance(each, yaml.NodeEvent) for each in yaml.parse(text))


def _point_lines(rooms: RoomLabels) -> list[str]:
    others = {name: at for name, at in rooms.points.items() if name not in rooms.names}
    lines = ["points:"] if others else []
    for name, at in others.items():
        lines += [f"- {_name(name)}", f"  point: {_corner(*at)}"]
    return lines


def _door_lines(doors: Mapping[int, Point], grid: OccupancyGrid) -> list[str]:
    lines = [f"doors:  {NOTES[0]}"] if doors else []
    decimals = decimals_of(grid)
    for number, (x, y) in doors.items():
        lines.append(f"  {number}: {_corner(round(x, decimals), round(y, decimals))}")
    return lines


def _cell_lines(cells: list[str]) -> list[str]:
    """Return the lines of cells, none without rooms."""
    return [f"cells:  {NOTES[1]}", *(f"- {line}" for line in cells)]


def _name(name: str) -> str:
    return f"name: {scalar(name)}"


def _ring(points: FloatArray) -> str:
    return f"[{', '.join(_corner(*point) for point in points.tolist())}]"


def _corner(x: float, y: float) -> str:
    return f"[{_number(x)},{_number(y)}]"


def _number(value: float) -> str:
    """Return a number in as few letters as it needs."""
    return repr(float(value) + 0.0).removesuffix(".0")
