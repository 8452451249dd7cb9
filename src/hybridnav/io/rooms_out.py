"""Writer of files of rooms, with outlines in metres that a person can edit."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
import yaml
from scipy import ndimage

from hybridnav._files import printable, replace_file
from hybridnav.errors import RoomsError
from hybridnav.io.rooms_in import LIMITS, check_points, check_rooms, in_cells
from hybridnav.io.rooms_paint import painted, without_slivers

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from hybridnav._typing import FloatArray, IntArray, PathLike
    from hybridnav.grid import OccupancyGrid, RoomLabels

_MOST_CORNERS = 20_000
"""Most corners in a file, if outlines can be simplified."""
_TOLERANCE_M = 0.15
_KEPT = 0.7
"""Least share of its cells that every room keeps with simplified outlines."""
_DECIMALS = 3


def save_rooms(path: PathLike, rooms: RoomLabels, grid: OccupancyGrid) -> None:
    """Write rooms as a file that `load_rooms` reads and a person can edit.

    Outlines are simplified together, so that neighbours keep their common border: by 15 cm, up to
    60 cm if the file would otherwise have more than 20,000 corners, and not at all if a room would
    lose too much. The doors of these outlines are written with their numbers in `rooms`, so that
    lists, pictures and plans of the file use the same numbers.

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
    check_rooms(rooms.names, rooms.label_of, where, grid)
    check_points(rooms.points, where, grid)
    # Loads scipy and numba.
    from hybridnav.topology.doors import renumbered  # noqa: PLC0415

    rings_of, label_of = _rings_to_write(rooms, where, grid)
    doors = renumbered(rooms, label_of, grid)
    text, n_values = _written(replace(rooms, doors=doors), rings_of, grid)
    size = len(text.encode())
    if n_values > LIMITS.max_values or size > LIMITS.max_bytes:
        raise RoomsError(
            f"{where}: {len(rooms.names)} rooms take {n_values} values and {size} bytes, "
            f"at most {LIMITS.max_values} and {LIMITS.max_bytes} are read"
        )
    try:
        replace_file(Path(path), text.encode())
    except OSError as error:
        raise RoomsError(f"{where}: cannot write: {error.strerror}") from None


def _rings_to_write(
    rooms: RoomLabels, where: str, grid: OccupancyGrid
) -> tuple[list[list[FloatArray]], IntArray]:
    """Return the rings of each room in metres, float64 (n, 2), and the labels that they read back
    as."""
    boxes = ndimage.find_objects(rooms.label_of + 1, len(rooms.names))
    shapes = [_outline(rooms.label_of, label, *box) for label, box in enumerate(boxes)]
    simple = [_rings(s, grid) for s in _simplified(shapes, _TOLERANCE_M / grid.resolution_m)]
    outlines = {n: [in_cells(ring, grid) for ring in rings] for n, rings in enumerate(simple)}
    try:
        again = painted(outlines, rooms.names, where, grid)
        check_rooms(rooms.names, again, where, grid)
    except RoomsError:
        return [_rings(shape, grid) for shape in shapes], without_slivers(rooms.label_of, grid)
    inside = rooms.label_of >= 0
    is_kept = rooms.label_of[inside] == again[inside]
    kept = np.bincount(rooms.label_of[inside], is_kept, len(rooms.names))
    if (kept < _KEPT * np.bincount(rooms.label_of[inside])).any():
        return [_rings(shape, grid) for shape in shapes], without_slivers(rooms.label_of, grid)
    return simple, without_slivers(again, grid)


def _written(
    rooms: RoomLabels, rings_of: list[list[FloatArray]], grid: OccupancyGrid
) -> tuple[str, int]:
    """Return the text of a file, and the number of values that a reader counts."""
    lines = [
        f"# Rooms of {' '.join(grid.name.split())}: outlines in metres, map frame, [x, y].",
        "# Rename rooms, move corners, or give a room `seed: [x, y]` in place of an outline.",
        "rooms:" if rooms.names else "rooms: []",
    ]
    for name, rings in zip(rooms.names, rings_of, strict=True):
        lines.append(f"- {_name(name)}")
        if len(rings) == 1:
            lines.append(f"  polygon: {_ring(rings[0])}")
        else:
            lines += ["  polygons:", *(f"  - {_ring(ring)}" for ring in rings)]
        if name in rooms.points:
            lines.append(f"  point: {_corner(*rooms.points[name])}")
    others = {name: at for name, at in rooms.points.items() if name not in rooms.names}
    if others:
        lines.append("points:")
        for name, at in others.items():
            lines += [f"- {_name(name)}", f"  point: {_corner(*at)}"]
    if rooms.doors:
        lines.append("doors:  # their numbers; a point of each")
        for number, at in rooms.doors.items():
            lines.append(f"- {{number: {number}, point: {_corner(*at)}}}")
    # A list counts as one value in addition to its own values; a corner is a list of two.
    n_corners = sum(len(ring) for rings in rings_of for ring in rings)
    n_lists = sum(1 + len(rings) for rings in rings_of)
    n_values = 7 + 4 * len(rooms.names) + n_lists + 3 * n_corners
    n_values += 7 * len(rooms.points) + 7 * len(rooms.doors)
    return "\n".join(lines) + "\n", n_values


def _name(name: str) -> str:
    return yaml.safe_dump({"name": name}, allow_unicode=True, width=999).strip()


def _outline(label_of: IntArray, label: int, rows: slice, cols: slice) -> BaseGeometry:
    """Return the area of the cells of a label, x along columns and y along rows, one unit a
    cell."""
    steps = np.diff(np.pad(label_of[rows, cols] == label, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, starts = np.nonzero(steps == 1)
    _, ends = np.nonzero(steps == -1)
    bottom, left = row + rows.start, cols.start
    return shapely.union_all(shapely.box(starts + left, bottom, ends + left, bottom + 1))


def _simplified(shapes: list[BaseGeometry], tolerance: float) -> list[BaseGeometry]:
    """Return outlines with few corners and the same common borders; the tolerance is in cells."""
    for factor in (1, 2, 4):
        simple = list(shapely.coverage_simplify(shapes, factor * tolerance))
        # A shape so small that it would vanish keeps its corners.
        simple = [new if new.area > 0 else old for new, old in zip(simple, shapes, strict=True)]
        if sum(shapely.get_num_coordinates(shape) for shape in simple) <= _MOST_CORNERS:
            break
    return simple


def _polygons(shape: BaseGeometry) -> list[shapely.Polygon]:
    return [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]


def _rings(shape: BaseGeometry, grid: OccupancyGrid) -> list[FloatArray]:
    """Return the outer rings and holes in metres, rounded as in the file.

    Filled by the even-odd rule they form the shape again.
    """
    rings = [ring for part in _polygons(shape) for ring in (part.exterior, *part.interiors)]
    corners = [shapely.get_coordinates(ring)[:-1, ::-1] for ring in rings]
    return [grid.frame.points_of_grid(ring).round(_DECIMALS) + 0.0 for ring in corners]


def _ring(points: FloatArray) -> str:
    return f"[{', '.join(_corner(*point) for point in points.tolist())}]"


def _corner(x: float, y: float) -> str:
    return f"[{round(float(x), _DECIMALS) + 0.0!r}, {round(float(y), _DECIMALS) + 0.0!r}]"
