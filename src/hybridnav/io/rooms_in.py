"""Files of rooms: outlines or seed points in metres, or an image of labels."""

from __future__ import annotations

import math
import reprlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._files import printable
from hybridnav.config.yaml_file import Limits, read_yaml
from hybridnav.errors import InvalidValueError, MapNotFoundError, RoomsError, RoomsNotFoundError
from hybridnav.grid import NO_ROOM, CellClass, RoomLabels
from hybridnav.grid.names import check_names, check_number
from hybridnav.grid.occupancy import extent
from hybridnav.io.image import read_raster
from hybridnav.io.rooms_paint import painted, without_slivers

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hybridnav._typing import FloatArray, IntArray, PathLike
    from hybridnav.grid import OccupancyGrid
    from hybridnav.grid.room_labels import Point

_ROOM_KEYS = ("name", "polygon", "polygons", "seed", "point")
_OUTSIDE_CELLS = 1.0
"""Greatest distance that an outline may reach over the rim of the map."""
_FEWEST_CORNERS = 3
_LEAST_AREA_CELLS = 1e-6

LIMITS = Limits(max_bytes=2**22, max_values=100_000)
"""Limits of a file of rooms; hostile files take three seconds."""


@dataclass
class _Read:
    """Contents of a file: rings of outlines in cells, x along columns and y along rows."""

    where: str
    names: list[str] = field(default_factory=list)
    outlines: dict[int, list[FloatArray]] = field(default_factory=dict)
    seeds: dict[int, tuple[float, float]] = field(default_factory=dict)
    points: dict[str, tuple[float, float]] = field(default_factory=dict)
    doors: dict[int, tuple[float, float]] = field(default_factory=dict)
    label_of: IntArray | None = None

    def of(self, room: int) -> str:
        return f"{self.where}: room {self.names[room]!r}"


def load_rooms(path: PathLike, grid: OccupancyGrid) -> RoomLabels:
    r"""Read the rooms of a map.

    Parameters
    ----------
    path
        A YAML file of one of two forms. `rooms:` is a list of rooms with a `name` and either a
        `polygon` (a ring of [x, y] in metres, map frame), `polygons` (rings: parts and holes) or a
        `seed` [x, y], which names the room that segmentation finds there; and optionally a `point`
        [x, y] that represents the room. Rings are filled by the even-odd rule, also where a ring
        crosses itself. In addition, `points:` is a list of named points, and `doors:` a list of
        numbers of doors, each with a `point` of its boundary: the door nearest to it, within a
        metre, keeps the number. In the other form `locations:` is a list of names, with an image
        `data:` of the size of the map's, whose pixel values index the list, or flat `polygons:` in
        pixels of that image; polygons win if both are present.
    grid
        The map.

    Returns
    -------
    RoomLabels
        Cells of each room.

    Raises
    ------
    RoomsNotFoundError
        When the file or the image does not exist.
    RoomsError
        When one of them cannot be read; a room has no name or the name of another one, leaves the
        map, overlaps another or has no free cell; a named point lies outside the map or in an
        obstacle; or the number of a door is invalid or occurs twice.

    Examples
    --------
    >>> from pathlib import Path
    >>> square = "[[0, 0], [2, 0], [2, 2], [0, 2]]"
    >>> _ = Path("rooms.yaml").write_text(f"rooms:\n- name: kitchen\n  polygon: {square}\n")
    >>> grid = hn.OccupancyGrid(np.zeros((2, 4)), robot_radius_m=0)
    >>> hn.load_rooms("rooms.yaml", grid).label_of
    array([[ 0,  0, -1, -1],
           [ 0,  0, -1, -1]], dtype=int32)
    """
    values = read_yaml(
        path, what="rooms", error=RoomsError, missing=RoomsNotFoundError, limits=LIMITS
    )
    where = f"rooms {printable(path)}"
    if "locations" in values:
        read = _locations(values, Path(path), where, grid)
    elif "rooms" in values:
        read = _outlines(values, where, grid)
    else:
        raise RoomsError(f"{where}: lacks rooms, or locations")
    try:
        check_names(tuple(read.names))
        label_of = read.label_of
        if label_of is None:
            label_of = painted(read.outlines, read.names, where, grid)
        if read.seeds:
            label_of = _seeded(read, label_of, grid)
        if "rooms" in values:
            label_of = without_slivers(label_of, grid)
        check_rooms(read.names, label_of, where, grid)
        check_points(read.points, where, grid)
        return RoomLabels(tuple(read.names), label_of, read.points, read.doors)
    except InvalidValueError as error:
        raise RoomsError(f"{where}: {error}") from None


def files_of(path: Path) -> list[Path]:
    """Return a file of rooms and the image that it names, if it names one.

    Raises
    ------
    RoomsError
        When the file cannot be read.
    """
    values = read_yaml(
        path, what="rooms", error=RoomsError, missing=RoomsNotFoundError, limits=LIMITS
    )
    data = values.get("data")
    return [path, path.parent / data] if isinstance(data, str) else [path]


def _outlines(values: dict[str, Any], where: str, grid: OccupancyGrid) -> _Read:
    """Read the form with rooms."""
    read = _Read(where)
    _check_keys(values, ("rooms", "points", "doors", "map"), where)
    for number, entry in enumerate(_list_of(values["rooms"], f"{where}: rooms")):
        at = f"{where}: room {number + 1}"
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
            raise RoomsError(f"{at}: expected a mapping with a name, got {reprlib.repr(entry)}")
        read.names.append(entry["name"])
        at = read.of(number)
        _check_keys(entry, _ROOM_KEYS, at)
        shapes = [key for key in ("polygon", "polygons", "seed") if key in entry]
        if len(shapes) != 1:
            raise RoomsError(
                f"{at}: expected one of polygon, polygons and seed, got {', '.join(shapes) or '-'}"
            )
        if "point" in entry:
            read.points[entry["name"]] = _xy(entry["point"], f"{at}: point")
        if "seed" in entry:
            read.seeds[number] = _xy(entry["seed"], f"{at}: seed")
            continue
        rings = [entry["polygon"]] if "polygon" in entry else entry["polygons"]
        outlines = [_ring(ring, f"{at}: polygon") for ring in _list_of(rings, f"{at}: polygons")]
        read.outlines[number] = _checked([in_cells(ring, grid) for ring in outlines], at, grid)
    taken = {*read.points, *read.names}
    for entry in _list_of(values.get("points", []), f"{where}: points"):
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
            raise RoomsError(f"{where}: points: expected a name and a point, got {entry!r:.80}")
        if entry["name"] in taken:
            raise RoomsError(f"{where}: point {entry['name']!r}: the name is given twice")
        taken.add(entry["name"])
        read.points[entry["name"]] = _xy(entry.get("point"), f"{where}: point {entry['name']!r}")
    read.doors = _doors(values.get("doors", []), where)
    return read


def _doors(entries: Any, where: str) -> dict[int, tuple[float, float]]:
    """Return the numbers of doors, each with a point of its boundary."""
    doors: dict[int, tuple[float, float]] = {}
    for entry in _list_of(entries, f"{where}: doors"):
        if not isinstance(entry, dict) or "number" not in entry:
            raise RoomsError(
                f"{where}: doors: expected a number and a point, got {reprlib.repr(entry)}"
            )
        try:
            number = check_number(entry["number"])
        except InvalidValueError as error:
            raise RoomsError(f"{where}: doors: {error}") from None
        at = f"{where}: door {number}"
        _check_keys(entry, ("number", "point"), at)
        if number in doors:
            raise RoomsError(f"{at}: the number is given twice, every door needs its own")
        doors[number] = _xy(entry.get("point"), f"{at}: point")
    return doors


def _locations(values: dict[str, Any], path: Path, where: str, grid: OccupancyGrid) -> _Read:
    """Read the form with a label image, whose polygons are flat lists of x, y in pixels, y down."""
    read = _Read(where)
    for name in _list_of(values["locations"], f"{where}: locations"):
        if not isinstance(name, str):
            raise RoomsError(f"{where}: locations: expected names, got {name!r:.80}")
        read.names.append(name)
    if "polygons" not in values:
        read.label_of = _label_image(values.get("data"), path, where, grid, len(read.names))
        return read
    polygons = _list_of(values["polygons"], f"{where}: polygons")
    if len(polygons) != len(read.names):
        raise RoomsError(f"{where}: {len(read.names)} locations but {len(polygons)} polygons")
    for room, flat in enumerate(polygons):
        numbers = [_number(value, read.of(room)) for value in _list_of(flat, read.of(room))]
        if len(numbers) % 2:
            raise RoomsError(f"{read.of(room)}: a polygon of {len(numbers)} numbers, expected x, y")
        pixels = np.array(numbers).reshape(-1, 2)
        corners = np.stack([pixels[:, 0], grid.shape[0] - pixels[:, 1]], axis=1)
        read.outlines[room] = _checked([corners], read.of(room), grid)
    return read


def _label_image(data: Any, path: Path, where: str, grid: OccupancyGrid, n_rooms: int) -> IntArray:
    if not isinstance(data, str) or not data:
        raise RoomsError(f"{where}: data must be the path of an image, got {reprlib.repr(data)}")

    def check_size(cols: int, rows: int) -> None:
        if (rows, cols) != grid.shape:
            raise RoomsError(
                f"{where}: image of {cols} x {rows} pixels, the map has {grid.shape[::-1]} cells"
            )

    try:
        raster = read_raster(path.parent / data, what=f"{where}: image", check_size=check_size)
    except MapNotFoundError as error:
        raise RoomsNotFoundError(str(error)) from None
    level = raster.level[::-1]
    return np.where(level < n_rooms, level.astype(np.int32), np.int32(NO_ROOM))


def _checked(rings: list[FloatArray], at: str, grid: OccupancyGrid) -> list[FloatArray]:
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


def _seeded(read: _Read, label_of: IntArray, grid: OccupancyGrid) -> IntArray:
    """Return the rooms that segmentation finds round the seeds.

    If several seeds lie in one room, each takes the cells nearest to it.
    """
    # Loads scipy and numba.
    from hybridnav.topology.segmentation import divide_rooms, find_rooms  # noqa: PLC0415

    found = find_rooms(grid).label_of
    seeded: dict[tuple[int, int], int] = {}
    for room, point in read.seeds.items():
        row, col = grid.frame.cell_of(*point)
        if not (0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]):
            raise RoomsError(
                f"{read.of(room)}: the seed lies outside the map, which spans {extent(grid)}"
            )
        if grid.classes[row, col] != CellClass.FREE:
            raise RoomsError(f"{read.of(room)}: the seed lies in no free cell")
        other = seeded.get((row, col), int(label_of[row, col]))
        if other != NO_ROOM:
            raise RoomsError(f"{read.of(room)}: the seed lies in room {read.names[other]!r}")
        if found[row, col] == NO_ROOM:
            raise RoomsError(f"{read.of(room)}: no room is found round the seed, draw a polygon")
        seeded[row, col] = room
    # All at once: each seed spreads inside the room that was found round it, and stops at outlines.
    region = np.where(label_of == NO_ROOM, found, np.int32(NO_ROOM))
    divided = divide_rooms(region, {room: cell for cell, room in seeded.items()})
    return np.where(label_of == NO_ROOM, divided, label_of)


def check_rooms(names: Sequence[str], label_of: IntArray, where: str, grid: OccupancyGrid) -> None:
    """Refuse rooms without a cell that was measured as free, whatever the robot's radius."""
    free = label_of[(grid.measured == CellClass.FREE) & (label_of >= 0)]
    for room in np.flatnonzero(np.bincount(free, minlength=len(names)) == 0).tolist():
        raise RoomsError(f"{where}: room {names[room]!r}: holds no free cell of the map")


def check_points(points: Mapping[str, Point], where: str, grid: OccupancyGrid) -> None:
    """Refuse named points that lie outside the map or in an obstacle.

    Points may lie near an obstacle or in unexplored cells; the status of a plan states whether the
    robot can go there.
    """
    for name, point in points.items():
        row, col = grid.frame.cell_of(*point)
        if not (0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]):
            raise RoomsError(
                f"{where}: point {name!r}: ({point[0]:.10g}, {point[1]:.10g}) lies outside the "
                f"map, which spans {extent(grid)}"
            )
        if grid.measured[row, col] == CellClass.OCCUPIED:
            raise RoomsError(
                f"{where}: point {name!r}: ({point[0]:.10g}, {point[1]:.10g}) lies in an obstacle"
            )


def in_cells(points: FloatArray, grid: OccupancyGrid) -> FloatArray:
    """Convert points in metres to cells, x along columns and y along rows."""
    return grid.frame.positions_of(points)[:, ::-1]


def _check_keys(values: dict[Any, Any], known: tuple[str, ...], at: str) -> None:
    for key in values:
        if key not in known:
            raise RoomsError(f"{at}: unknown key {key!r:.80}; known are {', '.join(known)}")


def _list_of(value: Any, at: str) -> list[Any]:
    if not isinstance(value, list):
        raise RoomsError(f"{at}: expected a list, got {reprlib.repr(value)}")
    return value


def _ring(value: Any, at: str) -> FloatArray:
    """Return the corners in metres, float64 (n, 2), without rows for an empty list."""
    corners = [_xy(corner, at) for corner in _list_of(value, at)]
    return np.array(corners, dtype=np.float64).reshape(-1, 2)


_FARTHEST = 1e9
"""Metres or pixels beyond which a coordinate counts as a mistake."""


def _number(value: Any, at: str) -> float:
    number = math.nan
    if isinstance(value, int | float) and not isinstance(value, bool):
        number = float(value) if abs(value) <= _FARTHEST else math.nan
    if not math.isfinite(number):
        raise RoomsError(f"{at}: expected a number, got {reprlib.repr(value)}")
    return number


def _xy(value: Any, at: str) -> tuple[float, float]:
    if not isinstance(value, list) or len(value) != 2:  # noqa: PLR2004
        raise RoomsError(f"{at}: expected [x, y] in metres, got {reprlib.repr(value)}")
    return _number(value[0], at), _number(value[1], at)
