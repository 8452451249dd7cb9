"""Writer of files of rooms, with outlines in metres that a person can edit."""

from __future__ import annotations

import math
from pathlib import Path

import yaml

from hybridnav._base.files import printable, replace_file
from hybridnav._base.typing import FloatArray, PathLike
from hybridnav.errors import InvalidValueError, RoomsError
from hybridnav.maps import OccupancyGrid, RoomLabels, RoomUse
from hybridnav.maps.checks import checked_type
from hybridnav.rooms.files.cells import cells_file, image_of
from hybridnav.rooms.files.entries import LIMITS, Read, fingerprint
from hybridnav.rooms.files.outlines import TOLERANCE_M, decimals_of, outlines_of
from hybridnav.rooms.files.read import check_points, check_rooms
from hybridnav.rooms.files.text import NOTES, Draft, written


def save_rooms(
    path: PathLike, rooms: RoomLabels, grid: OccupancyGrid, *, tolerance_m: float | None = None
) -> None:
    """Write rooms as a file that `load_rooms` reads and a person can edit.

    Outlines have few corners, and neighbours share their common border. The room of each cell is in
    an image beside the file, `rooms.cells.png` for `rooms.yaml`, so that every cell is read with
    the room that it has, or with none. The doors are written with their numbers, so that lists,
    pictures and plans of the file use the same.

    Where the file exists, its comments and the outlines of rooms whose cells are those before are
    kept.

    Parameters
    ----------
    path
        The file to write.
    rooms
        Labels of the cells of the map.
    grid
        The map.
    tolerance_m
        Corners of outlines go whose triangle with the two beside them has less area than a square
        of this side, in metres. None for 0.3.

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
    tolerance_m = TOLERANCE_M if tolerance_m is None else tolerance_m
    if not 0 < tolerance_m < math.inf:
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
    outlines = outlines_of(rooms.label_of, len(rooms.names), grid, tolerance_m)
    image = cells_file(Path(path))
    prints = [[fingerprint(rings)] for rings in outlines]
    draft = Draft(
        [_entry(rooms, name, rings) for name, rings in zip(rooms.names, outlines, strict=True)],
        _rest(rooms, image.name, grid),
        prints,
    )
    text, prints = written(Path(path), draft, " ".join(grid.name.split()), rooms, grid)
    size = len(text.encode())
    # A value has two bytes or more.
    n_values = 0 if size < 2 * LIMITS.max_values else _n_values(text)
    if n_values > LIMITS.max_values or size > LIMITS.max_bytes:
        raise RoomsError(
            f"{where}: {len(rooms.names)} rooms take {n_values} values and {size} bytes, "
            f"at most {LIMITS.max_values} and {LIMITS.max_bytes} are read"
        )
    try:
        replace_file(image, image_of(rooms.label_of, prints, grid))
        replace_file(Path(path), text.encode())
    except OSError as error:
        raise RoomsError(f"{where}: cannot write: {error.strerror}") from None


def _entry(rooms: RoomLabels, name: str, rings: list[FloatArray]) -> str:
    lines = [f"- name: {_scalar(name)}"]
    if len(rings) == 1:
        lines.append(f"  polygon: {_ring(rings[0])}")
    else:
        lines += ["  polygons:", *(f"  - {_ring(ring)}" for ring in rings)]
    if name in rooms.points:
        lines.append(f"  point: {_corner(*rooms.points[name])}")
    use = rooms.uses.get(name, RoomUse())
    lines += ["  use: private"] * use.private + ["  prefer: corridor"] * use.corridor
    lines += [f"  cost: {_number(use.cost)}"] * (use.cost > 1)
    return "".join(f"{line}\n" for line in lines)


def _rest(rooms: RoomLabels, image: str, grid: OccupancyGrid) -> str:
    """Return what stands behind the rooms."""
    # Loads scipy and numba.
    from hybridnav.rooms.doors import numbered  # noqa: PLC0415

    points = {name: at for name, at in rooms.points.items() if name not in rooms.names}
    lines = ["points:"] * bool(points)
    for name, at in points.items():
        lines += [f"- name: {_scalar(name)}", f"  point: {_corner(*at)}"]
    doors, decimals = numbered(rooms, grid), decimals_of(grid)
    lines += [f"doors:  {NOTES[0]}"] * bool(doors)
    lines += [
        f"  {number}: {_corner(round(x, decimals), round(y, decimals))}"
        for number, (x, y) in doors.items()
    ]
    lines += ["one_way:"] * bool(rooms.one_way)
    lines += [f"- {_scalar(str(rule))}" for rule in rooms.one_way]
    lines.append(f"cells: {_scalar(image)}  {NOTES[1]}")
    return "".join(f"{line}\n" for line in lines)


def _n_values(text: str) -> int:
    """Return the number of values that a reader counts."""
    return sum(isinstance(each, yaml.NodeEvent) for each in yaml.parse(text))


def _scalar(name: str) -> str:
    """Return a text as YAML, for any place in a file."""
    found = yaml.safe_dump([name], allow_unicode=True, width=9999, default_flow_style=True)
    return str(found).strip()[1:-1]


def _ring(points: FloatArray) -> str:
    return f"[{', '.join(_corner(*point) for point in points.tolist())}]"


def _corner(x: float, y: float) -> str:
    return f"[{_number(x)}, {_number(y)}]"


def _number(value: float) -> str:
    """Return a number in as few letters as it needs."""
    return repr(float(value) + 0.0).removesuffix(".0")
