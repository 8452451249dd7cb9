"""Files of closed areas: GeoJSON in metres of the map frame, masks of Nav2, or images. Public:
`load_blocked`.
"""

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from hybridnav._base.files import printable
from hybridnav._base.typing import BoolArray, PathLike
from hybridnav._base.yaml_file import Limits, open_file
from hybridnav.closures.areas import parts_on
from hybridnav.closures.blocked import Blocked
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError, brief
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.clearance import within_radius
from hybridnav.maps.costs.files import load_keepout_mask
from hybridnav.maps.files.image import read_raster
from hybridnav.maps.files.ros import occupancy_of_greys

LIMITS = Limits(max_bytes=2**22, max_values=100_000)
"""Most bytes of a GeoJSON file, and most values in it."""
_MOST_OUTLINE_CELLS = 50_000
"""Most cells of all outlines on the map; the time to find their closed cells is proportional: five
seconds for the longest, with a radius of five cells."""

_GEOJSON = (".geojson", ".json")
_MASKS = (".yaml", ".yml")
_KINDS = ("Polygon", "MultiPolygon", "LineString", "MultiLineString")
_FEWEST = {"LineString": 2, "Polygon": 3}


def load_blocked(
    path: PathLike,
    grid: OccupancyGrid,
    *,
    keepout: bool = False,
    pose: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> Blocked:
    """Read the closed areas of a map from a file.

    They are obstacles, such as pallets: the robot keeps its radius off them. With `keepout` they
    are zones for the *centre* of the robot, to which nothing is added. Nav2 lays the mask of its
    keepout filter over the inflated map in the same way.

    Parameters
    ----------
    path
        A GeoJSON file (`.geojson`, `.json`), a mask of map_server (`.yaml`) or an image. GeoJSON is
        a `FeatureCollection`, a `Feature` or a geometry, of `Polygon`, `MultiPolygon`, `LineString`
        and `MultiLineString`; coordinates are `[x, y]` in metres, map frame. A mask of map_server
        closes cells as `CostLayer.keepout_mask` does, also for presets that know no costs. An image
        is a mask of one pixel a cell, in the orientation of the map's image. An opaque pixel closes
        its cell when its darkness, 1 - brightness in [0, 1], is at least the map's occupied
        threshold. Lighter and transparent pixels close nothing.
    grid
        The map.
    keepout
        Whether only the centre of the robot keeps out.
    pose
        `(x, y, yaw)` of the frame of a mask of map_server in the map frame, in metres and radians.

    Raises
    ------
    MapNotFoundError
        When the file does not exist.
    MapError
        When the file cannot be read, an area does not meet the map, or an image is
        not of the map's size.
    InvalidValueError
        When the pose is out of range, or given for a file that is no mask of map_server.

    Examples
    --------
    >>> from pathlib import Path
    >>> line = '{"type": "LineString", "coordinates": [[1.0, 0.0], [1.0, 2.0]]}'
    >>> _ = Path("closed.geojson").write_text(line)
    >>> hn.load_blocked("closed.geojson", hn.example_map("figure1")).polygons
    (<LINESTRING (1 0, 1 2)>,)
    """
    suffix = Path(path).suffix.lower()
    if suffix in _MASKS:
        return _mask(path, grid, pose, keepout=keepout)
    if any(pose):
        raise InvalidValueError(
            f"blocked {printable(path)}: a pose goes with a mask of map_server "
            f"({', '.join(_MASKS)}) alone: leave it out"
        )
    if suffix not in _GEOJSON:
        return _image(path, grid, keepout=keepout)
    areas = _areas(path, grid)
    return Blocked(keepout=areas) if keepout else Blocked(polygons=areas)


def _closing(cells: BoolArray, grid: OccupancyGrid, *, keepout: bool) -> Blocked:
    radius_m = 0.0 if keepout else grid.robot_radius_m
    return Blocked(
        cells=np.argwhere(within_radius(cells, radius_cells=radius_m / grid.resolution_m))
    )


def _mask(
    path: PathLike, grid: OccupancyGrid, pose: tuple[float, float, float], *, keepout: bool
) -> Blocked:
    closed = load_keepout_mask(path, grid, pose=pose).keepout
    return Blocked() if closed is None else _closing(closed, grid, keepout=keepout)


def _image(path: PathLike, grid: OccupancyGrid, *, keepout: bool) -> Blocked:
    where = f"blocked {printable(path)}"

    def check_size(cols: int, rows: int) -> None:
        if (rows, cols) != grid.shape:
            expected = "{1} x {0}".format(*grid.shape)
            raise MapError(
                f"{where}: a mask of {cols} x {rows} pixels, expected {expected}, those of the map"
            )

    raster = read_raster(path, what="blocked", check_size=check_size)
    closed = (occupancy_of_greys() >= np.float32(grid.occupied_threshold))[raster.grey[::-1]]
    if raster.opaque is not None:
        closed &= raster.opaque[::-1]
    return _closing(closed, grid, keepout=keepout)


def _areas(path: PathLike, grid: OccupancyGrid) -> list[BaseGeometry]:
    where = f"blocked {printable(path)}"
    areas: list[BaseGeometry] = []
    outline_cells = 0.0
    for at, geometry in _geometries(_read_json(path, where), where):
        area = _area(geometry, at)
        try:
            Blocked(polygons=[area])
            outline_cells += _outline_cells(parts_on(area, grid), grid)
        except InvalidValueError as error:
            raise MapError(f"{at}: {error}") from None
        if outline_cells > _MOST_OUTLINE_CELLS:
            raise MapError(
                f"{at}: outlines of {outline_cells:.0f} cells on the map, at most "
                f"{_MOST_OUTLINE_CELLS} are read: leave out detail, or paint a mask image"
            )
        areas.append(area)
    if not areas:
        raise MapError(f"{where}: closes nothing, expected at least one feature")
    return areas


def _outline_cells(parts: list[BaseGeometry], grid: OccupancyGrid) -> float:
    """Return the length of outlines and lines on the map, in cells."""
    rows, cols = grid.shape
    lines = [part if part.geom_type == "LineString" else part.boundary for part in parts]
    return float(shapely.length(shapely.clip_by_rect(lines, 0, 0, cols, rows)).sum())


def _read_json(path: PathLike, where: str) -> Any:
    with open_file(path, what="blocked", error=MapError, missing=MapNotFoundError) as stream:
        content = stream.read(LIMITS.max_bytes + 1)
    if len(content) > LIMITS.max_bytes:
        raise MapError(f"{where}: GeoJSON of more than {LIMITS.max_bytes} bytes is not read")
    # Every number except the last one of a list or a position has a comma behind it.
    if content.count(b",") > LIMITS.max_values:
        raise MapError(f"{where}: GeoJSON of more than {LIMITS.max_values} values is not read")
    try:
        return json.loads(content.decode("utf-8-sig"), object_pairs_hook=_without_repeats)
    except UnicodeDecodeError:
        raise MapError(f"{where}: not UTF-8 text") from None
    except RecursionError:
        raise MapError(f"{where}: nested too deep for GeoJSON") from None
    except json.JSONDecodeError as failure:
        raise MapError(f"{where}, line {failure.lineno}: {failure.msg}") from None
    except ValueError as failure:  # a key given twice, an integer of 4,301 digits
        raise MapError(f"{where}: {failure!s:.100}") from None


def _without_repeats(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    values = dict(pairs)
    if len(values) < len(pairs):
        raise ValueError("a key is given twice in one object")
    return values


def _geometries(data: Any, where: str) -> Iterator[tuple[str, Any]]:
    """Yield the geometries of a file, each with its place in the file."""
    kind = data.get("type") if isinstance(data, dict) else None
    if kind == "Feature":
        yield where, data.get("geometry")
    elif kind == "FeatureCollection":
        features = data.get("features")
        if not isinstance(features, list):
            raise MapError(f"{where}: features must be a list, got {brief(features)}")
        for number, feature in enumerate(features, start=1):
            at = f"{where}: feature {number}"
            if not isinstance(feature, dict) or feature.get("type") != "Feature":
                raise MapError(f"{at}: expected a Feature, got {brief(feature)}")
            yield at, feature.get("geometry")
    elif isinstance(data, dict):
        yield where, data
    else:
        raise MapError(f"{where}: expected a GeoJSON object, got {brief(data)}")


def _area(geometry: Any, at: str) -> BaseGeometry:
    kind = geometry.get("type") if isinstance(geometry, dict) else None
    if kind not in _KINDS:
        given = brief(geometry if kind is None else kind)
        raise MapError(f"{at}: expected a geometry of {', '.join(_KINDS)}, got {given}")
    coordinates = geometry.get("coordinates")
    if kind == "LineString":
        return shapely.LineString(_points(coordinates, kind, at))
    if kind == "Polygon":
        return _polygon(coordinates, at)
    parts = _list_of(coordinates, at)
    if kind == "MultiPolygon":
        return shapely.MultiPolygon([_polygon(part, at) for part in parts])
    return shapely.MultiLineString([_points(part, "LineString", at) for part in parts])


def _polygon(rings: Any, at: str) -> shapely.Polygon:
    outline, *holes = [_points(ring, "Polygon", at) for ring in _list_of(rings, at)]
    return shapely.Polygon(outline, holes)


def _points(positions: Any, kind: str, at: str) -> list[tuple[float, float]]:
    points = [_point(position, at) for position in _list_of(positions, at)]
    if len(points) < _FEWEST[kind]:
        raise MapError(f"{at}: a {kind} needs {_FEWEST[kind]} points, got {len(points)}")
    return points


def _list_of(value: Any, at: str) -> list[Any]:
    if not isinstance(value, list) or not value:
        raise MapError(f"{at}: coordinates must be lists of positions, got {brief(value)}")
    return value


def _point(position: Any, at: str) -> tuple[float, float]:
    """Return x and y of a position `[x, y]` or `[x, y, height]`."""
    x = y = math.nan
    if isinstance(position, list) and len(position) >= 2:  # noqa: PLR2004
        x, y = (_number(value) for value in position[:2])
    if not (math.isfinite(x) and math.isfinite(y)):
        raise MapError(
            f"{at}: a position must be [x, y], finite numbers of metres, got {brief(position)}"
        )
    return x, y


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf
