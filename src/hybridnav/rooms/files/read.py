"""Files of rooms: outlines or seed points in metres, or an image of labels."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from hybridnav._base.files import printable
from hybridnav._base.typing import IntArray, PathLike
from hybridnav._base.yaml_file import read_marked
from hybridnav.errors import (
    InvalidValueError,
    MapNotFoundError,
    RoomsError,
    RoomsNotFoundError,
    brief,
)
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid, RoomLabels
from hybridnav.maps.files.image import read_raster
from hybridnav.maps.names import check_names
from hybridnav.maps.occupancy import extent
from hybridnav.maps.room_labels import Point
from hybridnav.rooms.files.cells import CellImage, read_image
from hybridnav.rooms.files.earlier import PackedCells, unpacked
from hybridnav.rooms.files.entries import (
    LIMITS,
    Outline,
    Read,
    checked_rings,
    fingerprint,
    list_of,
    number_of,
    read_entries,
)
from hybridnav.rooms.files.paint import cells_inside, outlined, without_slivers


def load_rooms(path: PathLike, grid: OccupancyGrid) -> RoomLabels:
    r"""Read the rooms of a map.

    Parameters
    ----------
    path
        A YAML file of one of two forms. `rooms:` is a list of rooms with a `name` and either a
        `polygon` (a ring of [x, y] in metres, map frame), `polygons` (rings: parts and holes) or a
        `seed`. A `seed` [x, y] names the room that segmentation finds there. Optional is a `point`
        [x, y] that represents the room. Rings are filled by the even-odd rule, also where a ring
        crosses itself. Entries of one name are one room, if their outlines lie beside each other.
        Where outlines overlap, one that a person has drawn or changed since the file was written
        has the cells, and the later one of several. In addition, `points:` is a list of named
        points. `doors:` is a mapping from numbers of doors to a point [x, y] of the boundary, or a
        list with `number` and `point`. The door nearest to it, within a metre, keeps the number.
        `one_way:` is a list of rules as text, such as `door:5=corridor`; see `OneWayRule`.
        `cells:` names the image of the cells of written outlines. In the other form `locations:` is
        a list of names. Beside it stands an image `data:` of the size of the map's, whose pixel
        values index the list, or flat `polygons:` in pixels of that image. Polygons win if both are
        present, and the first of overlapping ones.
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
        When one of them cannot be read. When a room has no name or the name of one elsewhere,
        leaves the map, or has no free cell of its own. When a named point lies outside the map or
        in an obstacle, or the number of a door is invalid or occurs twice.

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
    marked = read_marked(
        path, what="rooms", error=RoomsError, missing=RoomsNotFoundError, limits=LIMITS
    )
    values, where = marked.values, f"rooms {printable(path)}"
    if "locations" in values:
        read = _locations(values, Path(path), where, grid)
    elif "rooms" in values:
        read = read_entries(marked, where, grid)
        read.folder = Path(path).resolve().parent
    else:
        raise RoomsError(f"{where}: lacks rooms, or locations")
    return rooms_of(read, grid)


def rooms_of(read: Read, grid: OccupancyGrid) -> RoomLabels:
    """Return the rooms that a file describes.

    Raises `RoomsError` as by `load_rooms`.
    """
    try:
        check_names(tuple(read.names))
        label_of = read.label_of
        if label_of is None:
            label_of = labels_of(read, grid)
        check_rooms(read, label_of, grid)
        check_points(read.points, read.where, grid)
        names, rules = tuple(read.names), tuple(read.one_way)
        return RoomLabels(names, label_of, read.points, read.doors, read.uses, rules)
    except InvalidValueError as error:
        raise RoomsError(f"{read.where}: {error}") from None


def labels_of(read: Read, grid: OccupancyGrid) -> IntArray:
    """Return the room of each cell by the outlines, cells and seeds of a file, int32 (rows, cols).

    Outlines that were written have the cells that were written with them; those that a person has
    drawn or changed take the cells that they contain.
    """
    cells: CellImage | PackedCells = PackedCells({})
    if read.cells:
        packed = None if isinstance(read.cells, str) else read.cells
        cells = read_image(read, grid) if packed is None else unpacked(packed, read.where, grid)
    by_hand = [each for each in read.outlines if each.fingerprint not in cells.written]
    drawn = outlined(read, by_hand, grid)
    if isinstance(cells, CellImage):
        written = cells.label_of
    else:
        others = [each for each in read.outlines if each.fingerprint in cells.written]
        written = cells.labels(outlined(read, others, grid), others, drawn, grid)
    label_of = np.where(drawn == NO_ROOM, written, drawn)
    if read.seeds:
        label_of = _seeded(read, label_of, grid)
    if read.lines:
        rooms = {each.room for each in by_hand} | set(read.seeds)
        label_of = without_slivers(label_of, grid, rooms)
    return label_of


def _locations(values: dict[str, Any], path: Path, where: str, grid: OccupancyGrid) -> Read:
    """Read the form with a label image, whose polygons are flat lists of x, y in pixels, y down."""
    read = Read(where)
    for name in list_of(values["locations"], f"{where}: locations"):
        if not isinstance(name, str):
            raise RoomsError(f"{where}: locations: expected names, got {name!r:.80}")
        read.names.append(name)
    if "polygons" not in values:
        read.label_of = _label_image(values.get("data"), path, where, grid, len(read.names))
        return read
    polygons = list_of(values["polygons"], f"{where}: polygons")
    if len(polygons) != len(read.names):
        raise RoomsError(f"{where}: {len(read.names)} locations but {len(polygons)} polygons")
    for room, flat in enumerate(polygons):
        numbers = [number_of(value, read.of(room)) for value in list_of(flat, read.of(room))]
        if len(numbers) % 2:
            raise RoomsError(f"{read.of(room)}: a polygon of {len(numbers)} numbers, expected x, y")
        pixels = np.array(numbers).reshape(-1, 2)
        corners = np.stack([pixels[:, 0], grid.shape[0] - pixels[:, 1]], axis=1)
        rings = checked_rings([corners], read.of(room), grid)
        read.outlines.append(Outline(room, rings, fingerprint(rings)))
    return read


def _label_image(data: Any, path: Path, where: str, grid: OccupancyGrid, n_rooms: int) -> IntArray:
    if not isinstance(data, str) or not data:
        raise RoomsError(f"{where}: data must be the path of an image, got {brief(data)}")

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


def _seeded(read: Read, label_of: IntArray, grid: OccupancyGrid) -> IntArray:
    """Return the rooms that segmentation finds round the seeds.

    If several seeds lie in one room, each takes the cells nearest to it.
    """
    # Loads scipy and numba.
    from hybridnav.rooms.find import divide_rooms, find_rooms  # noqa: PLC0415

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
            raise RoomsError(f"{read.of(room)}: the seed lies in room {brief(read.names[other])}")
        if found[row, col] == NO_ROOM:
            raise RoomsError(f"{read.of(room)}: no room is found round the seed, draw a polygon")
        seeded[row, col] = room
    # All at once: each seed spreads inside the room that was found round it, and stops at outlines.
    region = np.where(label_of == NO_ROOM, found, np.int32(NO_ROOM))
    divided = divide_rooms(region, {room: cell for cell, room in seeded.items()})
    return np.where(label_of == NO_ROOM, divided, label_of)


def check_rooms(read: Read, label_of: IntArray, grid: OccupancyGrid) -> None:
    """Refuse rooms without a cell that was measured as free, whatever the robot's radius."""
    is_free = grid.measured == CellClass.FREE
    free = label_of[is_free & (label_of >= 0)]
    for room in np.flatnonzero(np.bincount(free, minlength=len(read.names)) == 0).tolist():
        rings = [ring for each in read.outlines if each.room == room for ring in each.rings]
        inside = cells_inside(rings, grid.shape) if rings else np.empty(0, dtype=np.int64)
        over = label_of.ravel()[inside[is_free.ravel()[inside]]]
        over = over[over >= 0]
        if len(over):
            other = read.of(int(np.bincount(over).argmax()))
            drawn_over = other.removeprefix(f"{read.where}, ").removeprefix(f"{read.where}: ")
            raise RoomsError(
                f"{read.of(room)}: holds no free cell of its own, they overlap {drawn_over}: "
                "give both rooms one name to make them one, or draw one smaller"
            )
        raise RoomsError(f"{read.of(room)}: holds no free cell of the map")


def check_points(points: Mapping[str, Point], where: str, grid: OccupancyGrid) -> None:
    """Refuse named points that lie outside the map or in an obstacle.

    Points may lie near an obstacle or in unexplored cells; the status of a plan states whether the
    robot can go there.
    """
    for name, point in points.items():
        row, col = grid.frame.cell_of(*point)
        if not (0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]):
            raise RoomsError(
                f"{where}: point {brief(name)}: ({point[0]:.10g}, {point[1]:.10g}) lies outside "
                f"the map, which spans {extent(grid)}"
            )
        if grid.measured[row, col] == CellClass.OCCUPIED:
            raise RoomsError(
                f"{where}: point {brief(name)}: ({point[0]:.10g}, {point[1]:.10g}) lies in an "
                "obstacle"
            )
