"""Files of rooms: outlines or seed points in metres, or an image of labels."""

from __future__ import annotations

import math
import reprlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import shapely

from hybridnav.config.yaml_file import printable, read_yaml
from hybridnav.errors import InvalidValueError, MapNotFoundError, RoomsError, RoomsNotFoundError
from hybridnav.grid import NO_ROOM, CellClass, RoomLabels
from hybridnav.grid.rooms import check_names
from hybridnav.io.image import read_raster

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from hybridnav._typing import BoolArray, FloatArray, IntArray, PathLike
    from hybridnav.grid import OccupancyGrid

_ROOM_KEYS = ("name", "polygon", "polygons", "seed", "point")
_LEAST_OVERLAP = 0.01
"""Share of the smaller room that two outlines may have in common: lines drawn by hand."""
_OUTSIDE_CELLS = 1.0
"""How far an outline may reach over the rim of the map."""
_MOST_CROSSED = 64
"""Polygons with more corners may not cross themselves: to sort that out takes very long."""
_FEWEST_CORNERS = 3


@dataclass
class _Read:
    """What a file says: outlines in cells, x along columns and y along rows."""

    where: str
    names: list[str] = field(default_factory=list)
    outlines: dict[int, BaseGeometry] = field(default_factory=dict)
    seeds: dict[int, tuple[float, float]] = field(default_factory=dict)
    points: dict[str, tuple[float, float]] = field(default_factory=dict)
    label_of: IntArray | None = None

    def of(self, room: int) -> str:
        return f"{self.where}: room {self.names[room]!r}"


def load_rooms(path: PathLike, grid: OccupancyGrid) -> RoomLabels:
    """Read the rooms of a map.

    Parameters
    ----------
    path
        A YAML file of one of two forms. `rooms:` is a list of rooms with a `name` and either a
        `polygon` (a ring of [x, y] in metres, map frame), `polygons` (rings, filled by the even-odd
        rule: parts and holes) or a `seed` [x, y], which names the room that segmentation finds
        there; and a `point` [x, y] that stands for the room, if wanted. Beside it `points:` is a
        list of named points. Or `locations:` is a list of names, with an image `data:` whose pixel
        values index it, the size of the map's, or flat `polygons:` in pixels of that image; these
        win where both are given.
    grid
        The map.

    Returns
    -------
    RoomLabels
        Cells of each room.

    Raises
    ------
    RoomsNotFoundError
        When the file or the image is not there.
    RoomsError
        When one of them cannot be read, or a room has no name or one that is taken, leaves the map,
        overlaps another, has no free cell, or none that the robot's radius leaves; one line.
    """
    values = read_yaml(path, what="rooms", error=RoomsError, missing=RoomsNotFoundError)
    where = f"rooms {printable(path)}"
    if "locations" in values:
        read = _locations(values, Path(path), where, grid)
    elif "rooms" in values:
        read = _outlines(values, where, grid)
    else:
        raise RoomsError(f"{where}: lacks rooms, or locations")
    try:
        check_names(tuple(read.names))
        label_of = _painted(read, grid) if read.label_of is None else read.label_of
        if read.seeds:
            label_of = _seeded(read, label_of, grid)
        _check_rooms(read, label_of, grid)
        return RoomLabels(tuple(read.names), label_of, read.points)
    except InvalidValueError as error:
        raise RoomsError(f"{where}: {error}") from None


def _outlines(values: dict[str, Any], where: str, grid: OccupancyGrid) -> _Read:
    """The form with rooms."""
    read = _Read(where)
    _check_keys(values, ("rooms", "points", "map"), where)
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
        corners = [
            np.array([_xy(corner, f"{at}: polygon") for corner in _list_of(ring, f"{at}: polygon")])
            for ring in _list_of(rings, f"{at}: polygons")
        ]
        read.outlines[number] = _shape([_in_cells(ring, grid) for ring in corners], at)
    for entry in _list_of(values.get("points", []), f"{where}: points"):
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
            raise RoomsError(f"{where}: points: expected a name and a point, got {entry!r:.80}")
        if entry["name"] in {*read.points, *read.names}:
            raise RoomsError(f"{where}: point {entry['name']!r}: the name is given twice")
        read.points[entry["name"]] = _xy(entry.get("point"), f"{where}: point {entry['name']!r}")
    return read


def _locations(values: dict[str, Any], path: Path, where: str, grid: OccupancyGrid) -> _Read:
    """The form with a label image, whose polygons are flat lists of x, y in pixels, y down."""
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
        read.outlines[room] = _shape([corners], read.of(room))
    return read


def _label_image(data: Any, path: Path, where: str, grid: OccupancyGrid, n_rooms: int) -> IntArray:
    if not isinstance(data, str) or not data:
        raise RoomsError(f"{where}: data must be the path of an image, got {reprlib.repr(data)}")
    try:
        raster = read_raster(path.parent / data, what=f"{where}: image")
    except MapNotFoundError as error:
        raise RoomsNotFoundError(str(error)) from None
    level = raster.level[::-1]
    if level.shape != grid.shape:
        size = "{1} x {0}".format(*level.shape)
        raise RoomsError(f"{where}: image of {size} pixels, the map has {grid.shape[::-1]} cells")
    return np.where(level < n_rooms, level.astype(np.int32), np.int32(NO_ROOM))


def _shape(rings: list[FloatArray], at: str) -> BaseGeometry:
    """The area of rings by the even-odd rule."""
    shape: BaseGeometry = shapely.Polygon()
    for ring in rings:
        if len(ring) < _FEWEST_CORNERS:
            raise RoomsError(f"{at}: a polygon needs at least three corners, got {len(ring)}")
        polygon = shapely.Polygon(ring)
        if len(ring) > _MOST_CROSSED and not polygon.is_valid:
            raise RoomsError(f"{at}: a polygon of {len(ring)} corners crosses itself")
        shape = shapely.symmetric_difference(shape, shapely.make_valid(polygon))
    if shape.area <= 0:
        raise RoomsError(f"{at}: the polygon has no area")
    return shape


def _painted(read: _Read, grid: OccupancyGrid) -> IntArray:
    """The label of each cell by the outline that holds its centre."""
    label_of = np.full(grid.shape, NO_ROOM, dtype=np.int32)
    if not read.outlines:
        return label_of
    rooms = list(read.outlines)
    shapes = [read.outlines[room] for room in rooms]
    for room, shape in zip(rooms, shapes, strict=True):
        left, bottom, right, top = shape.bounds
        rim = _OUTSIDE_CELLS
        if min(left, bottom) < -rim or right > grid.shape[1] + rim or top > grid.shape[0] + rim:
            raise RoomsError(
                f"{read.of(room)}: the polygon leaves the map, which spans {_extent(grid)}"
            )
    tree = shapely.STRtree(shapes)
    for one, other in tree.query(shapes, predicate="intersects").T.tolist():
        if one >= other:
            continue
        common = shapely.intersection(shapes[one], shapes[other]).area
        if common > _LEAST_OVERLAP * min(shapes[one].area, shapes[other].area):
            area_m2 = common * grid.resolution_m**2
            raise RoomsError(
                f"{read.of(rooms[one])} and room {read.names[rooms[other]]!r} overlap "
                f"in {area_m2:.2f} square metres"
            )
    for room, shape in zip(rooms, shapes, strict=True):
        window, inside = _cells_in(shape, grid.shape)
        label_of[window][inside & (label_of[window] == NO_ROOM)] = room
    return label_of


def _cells_in(shape: BaseGeometry, size: tuple[int, int]) -> tuple[tuple[slice, slice], BoolArray]:
    """The window of a grid that holds a shape, and the cells there whose centres lie inside."""
    left, bottom, right, top = shape.bounds
    rows = slice(max(math.floor(bottom), 0), min(math.ceil(top), size[0]))
    cols = slice(max(math.floor(left), 0), min(math.ceil(right), size[1]))
    x, y = np.meshgrid(
        np.arange(cols.start, cols.stop) + 0.5, np.arange(rows.start, rows.stop) + 0.5
    )
    shapely.prepare(shape)
    return (rows, cols), np.asarray(shapely.contains_xy(shape, x, y), dtype=np.bool_)


def _seeded(read: _Read, label_of: IntArray, grid: OccupancyGrid) -> IntArray:
    """Rooms that segmentation finds round the seeds; where several seeds lie in one, each takes the
    cells that are nearest to it."""
    from hybridnav.topology._segmentation_kernels import grow_labels  # noqa: PLC0415 - scipy, numba
    from hybridnav.topology.segmentation import find_rooms  # noqa: PLC0415

    found = find_rooms(grid).label_of
    seeded = np.full(grid.shape, NO_ROOM, dtype=np.int32)
    for room, point in read.seeds.items():
        row, col = grid.frame.cell_of(*point)
        if not (0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]):
            raise RoomsError(
                f"{read.of(room)}: the seed lies outside the map, which spans {_extent(grid)}"
            )
        if grid.classes[row, col] != CellClass.FREE:
            raise RoomsError(f"{read.of(room)}: the seed lies in no free cell")
        if label_of[row, col] != NO_ROOM or seeded[row, col] != NO_ROOM:
            other = max(label_of[row, col], seeded[row, col])
            raise RoomsError(f"{read.of(room)}: the seed lies in room {read.names[other]!r}")
        if found[row, col] == NO_ROOM:
            raise RoomsError(f"{read.of(room)}: no room is found round the seed, draw a polygon")
        seeded[row, col] = room
    # All at once: each spreads inside the room that was found round it, and stops at outlines.
    region = np.where(label_of == NO_ROOM, found, np.int32(NO_ROOM))
    grow_labels(seeded, region, region.size)
    return np.where(label_of == NO_ROOM, seeded, label_of)


def _check_rooms(read: _Read, label_of: IntArray, grid: OccupancyGrid) -> None:
    """Refuse rooms without a free cell."""
    n_rooms = len(read.names)

    def counted(free: BoolArray) -> Any:
        return np.bincount(label_of[free & (label_of >= 0)], minlength=n_rooms)

    measured = counted(grid.measured == CellClass.FREE)
    left = counted(grid.classes == CellClass.FREE)
    for room in range(n_rooms):
        if measured[room] == 0:
            raise RoomsError(f"{read.of(room)}: holds no free cell of the map")
        if left[room] == 0:
            raise RoomsError(
                f"{read.of(room)}: a robot radius of {grid.robot_radius_m:g} m leaves it "
                "no free cell"
            )


def _in_cells(points: FloatArray, grid: OccupancyGrid) -> FloatArray:
    """Points in metres as x along columns and y along rows, in cells."""
    frame = grid.frame
    offset = (points - np.array(frame.origin_m)) / frame.resolution_m
    cosine, sine = math.cos(frame.yaw_rad), math.sin(frame.yaw_rad)
    x = cosine * offset[:, 0] + sine * offset[:, 1]
    return np.stack([x, cosine * offset[:, 1] - sine * offset[:, 0]], axis=1)


def _extent(grid: OccupancyGrid) -> str:
    corners = grid.frame.points_of_grid(np.array([[0, 0], [0, 1], [1, 0], [1, 1]]) * grid.shape)
    (left, bottom), (right, top) = corners.min(axis=0), corners.max(axis=0)
    return f"x {left:.2f} to {right:.2f} m, y {bottom:.2f} to {top:.2f} m"


def _check_keys(values: dict[Any, Any], known: tuple[str, ...], at: str) -> None:
    for key in values:
        if key not in known:
            raise RoomsError(f"{at}: unknown key {key!r:.80}; known are {', '.join(known)}")


def _list_of(value: Any, at: str) -> list[Any]:
    if not isinstance(value, list):
        raise RoomsError(f"{at}: expected a list, got {reprlib.repr(value)}")
    return value


_FARTHEST = 1e9
"""Metres or pixels beyond which a coordinate is taken for a mistake."""


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
