"""Files of rooms out: outlines in metres that a person edits."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import shapely
import yaml

from hybridnav.errors import RoomsError

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from hybridnav._typing import BoolArray, FloatArray, PathLike
    from hybridnav.grid import OccupancyGrid, RoomLabels

_MOST_CORNERS = 2500
"""Corners in a file at most, which keeps it inside the limits of reading."""
_TOLERANCE_M = 0.15
_DECIMALS = 3


def save_rooms(path: PathLike, rooms: RoomLabels, grid: OccupancyGrid) -> None:
    """Write rooms as a file that `load_rooms` reads and a person can edit.

    Outlines are simplified together, so that neighbours keep their common border: by 15
    cm, more where the file would else have more than 2500 corners.

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
        When the file cannot be written, or a room has no cell.
    """
    shapes = [_outline(rooms.label_of == label) for label in range(len(rooms.names))]
    for name, shape in zip(rooms.names, shapes, strict=True):
        if shape.is_empty:
            raise RoomsError(f"room {name!r}: has no cell to write")
    lines = [
        f"# Rooms of {' '.join(grid.name.split())}: outlines in metres, map frame, [x, y].",
        "# Rename rooms, move corners, or give a room `seed: [x, y]` in place of an outline.",
        "rooms:" if shapes else "rooms: []",
    ]
    for name, shape in zip(
        rooms.names, _simplified(shapes, _TOLERANCE_M / grid.resolution_m), strict=True
    ):
        lines.append(f"- {yaml.safe_dump({'name': name}, allow_unicode=True, width=999).strip()}")
        rings = [_ring(ring, grid) for ring in _rings(shape)]
        if len(rings) == 1:
            lines.append(f"  polygon: {rings[0]}")
        else:
            lines += ["  polygons:", *(f"  - {ring}" for ring in rings)]
        if name in rooms.points:
            lines.append(f"  point: {_corner(*rooms.points[name])}")
    others = {name: at for name, at in rooms.points.items() if name not in rooms.names}
    if others:
        lines.append("points:")
        for name, at in others.items():
            lines.append(f"- {yaml.safe_dump({'name': name}, allow_unicode=True).strip()}")
            lines.append(f"  point: {_corner(*at)}")
    try:
        Path(path).write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise RoomsError(f"rooms {path}: cannot write: {error.strerror}") from None


def _outline(mask: BoolArray) -> BaseGeometry:
    """The area of some cells, x along columns and y along rows, one unit a cell."""
    padded = np.pad(mask, ((0, 0), (1, 1))).astype(np.int8)
    rows, starts = np.nonzero(np.diff(padded, axis=1) == 1)
    _, ends = np.nonzero(np.diff(padded, axis=1) == -1)
    return shapely.union_all(shapely.box(starts, rows, ends, rows + 1))


def _simplified(shapes: list[BaseGeometry], tolerance: float) -> list[BaseGeometry]:
    """Outlines with few corners, common borders kept; the tolerance is in cells."""
    while True:
        simple = list(shapely.coverage_simplify(shapes, tolerance))
        # What is so small that it vanishes keeps its corners.
        simple = [new if new.area > 0 else old for new, old in zip(simple, shapes, strict=True)]
        few = sum(len(ring.coords) for shape in simple for ring in _rings(shape)) <= _MOST_CORNERS
        if few or tolerance > 2.0**20:
            return simple
        tolerance *= 2


def _rings(shape: BaseGeometry) -> list[shapely.LinearRing]:
    """Outer rings and holes; filled by the even-odd rule they make the shape again."""
    parts = [part for part in shapely.get_parts(shape) if part.geom_type == "Polygon"]
    return [ring for part in parts for ring in (part.exterior, *part.interiors)]


def _ring(ring: shapely.LinearRing, grid: OccupancyGrid) -> str:
    xy: FloatArray = shapely.get_coordinates(ring)[:-1]
    points = grid.frame.points_of_grid(xy[:, ::-1])
    return f"[{', '.join(_corner(*point) for point in points.tolist())}]"


def _corner(x: float, y: float) -> str:
    return f"[{round(float(x), _DECIMALS) + 0.0!r}, {round(float(y), _DECIMALS) + 0.0!r}]"
