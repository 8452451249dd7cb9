"""Writer of files of rooms, with outlines in metres that a person can edit."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import yaml

from hybridnav._files import printable, replace_file
from hybridnav.errors import RoomsError
from hybridnav.io.outlines import TOLERANCES_M, areas_of, kept_cells, outlines_of
from hybridnav.io.rooms_cells import fingerprint, packed
from hybridnav.io.rooms_entries import LIMITS, Outline, Read, in_cells
from hybridnav.io.rooms_in import check_points, check_rooms, labels_of
from hybridnav.io.rooms_paint import painted
from hybridnav.io.rooms_text import HEADER, OldText

if TYPE_CHECKING:
    from collections.abc import Mapping

    from hybridnav._typing import FloatArray, IntArray, PathLike
    from hybridnav.grid import OccupancyGrid, RoomLabels
    from hybridnav.grid.room_labels import Point

_MOST_BYTES = 20_000
"""Size of a file above which coarser outlines are tried: more than a person edits."""
_DECIMALS = 3


def save_rooms(path: PathLike, rooms: RoomLabels, grid: OccupancyGrid) -> None:
    """Write rooms as a file that `load_rooms` reads and a person can edit.

    Outlines have few corners, lie along walls, and neighbours share their common border. They are
    coarser, by up to 60 cm, where outlines and cells would exceed 20 kB. The free cells that they
    miss are kept in `cells`, so that every free cell is read with the room that it has; only
    nameless ones below a square metre may get one. The doors are written with their numbers, so
    that lists, pictures and plans of the file use the same.

    Where the file exists, outlines that still hold, and all comments, are kept.

    Parameters
    ----------
    path
        The file to write.
    rooms
        Labels of the cells of the map.
    grid
        The map.

    Raises
    ------
    RoomsError
        When the file cannot be written, or could not be read again: a room has no free cell, a
        named point lies outside the map or in an obstacle, or there are too many rooms.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.zeros((1, 4)), robot_radius_m=0)
    >>> rooms = hn.RoomLabels(("kitchen", "hall"), np.array([[0, 0, 1, 1]]))
    >>> hn.save_rooms("rooms.yaml", rooms, grid)
    >>> hn.load_rooms("rooms.yaml", grid).names
    ('kitchen', 'hall')
    """
    where = f"rooms {printable(path)}"
    check_rooms(Read(where, list(rooms.names)), rooms.label_of, grid)
    check_points(rooms.points, where, grid)
    # Loads scipy and numba.
    from hybridnav.topology.doors import renumbered  # noqa: PLC0415

    old = OldText.of(path, rooms, grid)
    draft = _fitting(rooms, grid, old, where)
    doors = renumbered(rooms, draft.label_of, grid)
    text = "\n".join([*draft.lines, *_door_lines(doors), *_cell_lines(draft.cells)]) + "\n"
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
    """A file without its doors."""

    lines: list[str]
    cells: list[str]
    label_of: IntArray
    """int32 (rows, cols), the rooms as they are read."""

    @property
    def size(self) -> int:
        """Number of bytes, about."""
        return sum(len(line.encode()) + 1 for line in (*self.lines, *self.cells))


def _fitting(rooms: RoomLabels, grid: OccupancyGrid, old: OldText | None, where: str) -> _Draft:
    """Return the finest draft of at most 20 kB that is read as these rooms, else the finest."""
    areas = areas_of(rooms.label_of, len(rooms.names), grid)
    for kept in [old, None] if old is not None and old.blocks else [None]:
        best: _Draft | None = None
        for tolerance_m in TOLERANCES_M:
            rings_of = outlines_of(areas, grid, tolerance_m)
            draft = _drafted(rooms, rings_of, grid, kept, where)
            best = draft if best is None else best
            if draft is None or draft.size <= _MOST_BYTES:
                best = draft
                break
        if best is not None:
            if kept is None and old is not None:
                return replace(best, lines=[*old.comments, *best.lines])
            return best
    raise AssertionError  # a draft without an old file always holds


def _drafted(
    rooms: RoomLabels,
    rings_of: list[list[FloatArray]],
    grid: OccupancyGrid,
    old: OldText | None,
    where: str,
) -> _Draft | None:
    """Return a draft with these outlines for the rooms that the old file does not hold as they
    are; None if it would be read otherwise."""
    fresh = {
        room: Outline(room, [in_cells(ring, grid) for ring in rings], fingerprint(rings))
        for room, rings in enumerate(rings_of)
    }
    entries = {
        room: _entry(name, rings, rooms)
        for room, (name, rings) in enumerate(zip(rooms.names, rings_of, strict=True))
    }
    kept = [] if old is None else old.outlines
    done = {outline.room for outline in kept}
    outlines = sorted(
        [*kept, *(fresh[room] for room in fresh if room not in done)], key=lambda each: each.room
    )
    written = [o for o in outlines if o.room not in done or o.fingerprint in _unchanged(old)]
    read = Read(where, list(rooms.names), [1] * len(rooms.names), outlines)
    none = np.empty(0, dtype=np.int64)
    plain = painted(read, {outline.fingerprint: (none, none) for outline in written}, grid)
    is_kept = kept_cells(rooms.label_of, grid)
    missed = is_kept & (plain != rooms.label_of)
    cells = packed(missed, rooms.label_of, [(o.room, o.fingerprint) for o in written], grid)
    label_of = labels_of(replace(read, cells=cells), grid)
    if (label_of != rooms.label_of)[is_kept].any():
        return None
    if old is None:
        lines = [HEADER[0].format(" ".join(grid.name.split())), *HEADER[1:]]
        lines.append("rooms:" if rooms.names else "rooms: []")
        lines += [line for room in entries for line in entries[room]]
        lines += _point_lines(rooms)
    else:
        lines = old.with_entries(entries, _point_lines(rooms))
    return _Draft(lines, cells, label_of)


def _n_values(text: str) -> int:
    """Return the number of values that a reader counts."""
    return sum(isinstance(each, yaml.NodeEvent) for each in yaml.parse(text))


def _unchanged(old: OldText | None) -> set[int]:
    """Return the fingerprints of the outlines that were written with their cells."""
    return set() if old is None else old.written


def _entry(name: str, rings: list[FloatArray], rooms: RoomLabels) -> list[str]:
    lines = [f"- {_name(name)}"]
    if len(rings) == 1:
        lines.append(f"  polygon: {_ring(rings[0])}")
    else:
        lines += ["  polygons:", *(f"  - {_ring(ring)}" for ring in rings)]
    if name in rooms.points:
        lines.append(f"  point: {_corner(*rooms.points[name])}")
    return lines


def _point_lines(rooms: RoomLabels) -> list[str]:
    others = {name: at for name, at in rooms.points.items() if name not in rooms.names}
    lines = ["points:"] if others else []
    for name, at in others.items():
        lines += [f"- {_name(name)}", f"  point: {_corner(*at)}"]
    return lines


def _door_lines(doors: Mapping[int, Point]) -> list[str]:
    lines = ["doors:  # their numbers; a point of each"] if doors else []
    for number, at in doors.items():
        x, y = (round(value, _DECIMALS) for value in at)
        lines.append(f"- {{number: {number}, point: {_corner(x, y)}}}")
    return lines


def _cell_lines(cells: list[str]) -> list[str]:
    """Return the lines of cells, none without rooms."""
    return ["cells:  # which the outlines miss; hybridnav's own", *(f"- {line}" for line in cells)]


def _name(name: str) -> str:
    return yaml.safe_dump({"name": name}, allow_unicode=True, width=999).strip()


def _ring(points: FloatArray) -> str:
    return f"[{', '.join(_corner(*point) for point in points.tolist())}]"


def _corner(x: float, y: float) -> str:
    return f"[{float(x) + 0.0!r}, {float(y) + 0.0!r}]"
