"""ROS maps: the YAML of map_server and the image it names, read as Nav2 reads them, and written."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from hybridnav._base.files import NewFile, printable
from hybridnav._base.typing import ByteArray, PathLike
from hybridnav._base.yaml_file import read_yaml
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError, MapWarning, brief
from hybridnav.maps import DEFAULT_MAX_CELLS, CellClass, Frame, OccupancyGrid
from hybridnav.maps.checks import checked_type
from hybridnav.maps.files.image import Raster, read_raster
from hybridnav.maps.files.limits import check_max_cells, check_size
from hybridnav.maps.messages import levels_by_class

_MODES = ("trinary", "scale", "raw")
_BOOLEANS = {"true": True, "yes": True, "on": True, "y": True, "1": True} | {
    "false": False, "no": False, "off": False, "n": False, "0": False,
}  # fmt: skip
_WHITE = 255
_UNKNOWN_GREY = 205
"""The grey that map_saver and most SLAM tools write for "unknown"."""


def load_ros_map(
    path: PathLike,
    *,
    robot_radius_m: float | None = None,
    free_threshold: float | None = None,
    occupied_threshold: float | None = None,
    max_cells: int = DEFAULT_MAX_CELLS,
) -> OccupancyGrid:
    """Load a map of ROS's map_server.

    In the modes trinary and scale a pixel of brightness v in [0, 1] has the occupancy 1 - v, or v
    with `negate`. Pixels that are not fully opaque were never measured. In the mode raw the 8-bit
    values 0 to 100 are percentages, all others unknown. Numbers are those of Nav2 in ROS Jazzy and
    later: colours weigh 0.299, 0.587 and 0.114, grey has 8 bits, and the arithmetic is float32.

    Parameters
    ----------
    path
        The YAML file.
    robot_radius_m
        Radius in metres by which occupied cells are inflated, 0 for a robot that is a point; None
        is the default, 0.25 m.
    free_threshold, occupied_threshold
        U1 and U2 instead of the file's `free_thresh` and `occupied_thresh`.
    max_cells
        The most cells that the map may have; see `load_map`.

    Returns
    -------
    OccupancyGrid
        The grid, named after the file, or after its folder if the file is called map.

    Raises
    ------
    MapNotFoundError
        When the YAML file or the image that it names does not exist.
    MapError
        When one of them cannot be read, or holds too many cells; the text names the file and the
        key.
    InvalidValueError
        When the radius, a threshold or the limit is out of range.

    Warns
    -----
    MapWarning
        When the thresholds call grey 205, the usual mark of unknown cells, free; leave no cell
        free, or none occupied; or call most greys of probabilities unexplored.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.maps.files import load_ros_map
    >>> _ = Path("tiny.pgm").write_bytes(b"P5 3 1 255 " + bytes([254, 205, 0]))
    >>> _ = Path("tiny.yaml").write_text(
    ...     "{image: tiny.pgm, resolution: 0.1, origin: [0, 0, 0], negate: 0, "
    ...     "free_thresh: 0.196, occupied_thresh: 0.65}"
    ... )
    >>> load_ros_map("tiny.yaml").frame.resolution_m
    0.1
    """
    description = _read_description(Path(path), free_threshold, occupied_threshold)
    raster = _read_image(description, max_cells)
    probability = _probability(raster, description)
    grid = OccupancyGrid(
        probability,
        description.frame,
        free_threshold=description.free_threshold,
        occupied_threshold=description.occupied_threshold,
        robot_radius_m=robot_radius_m,
        name=_name_of(Path(path)),
    )
    for doubt in _doubts(raster, description, grid):
        warnings.warn(f"{description.where}: {doubt}", MapWarning, stacklevel=3)
    return grid


def read_mask(path: PathLike, *, max_cells: int) -> tuple[NDArray[np.int8], Frame]:
    """Read a map of map_server as the values of a `nav_msgs/OccupancyGrid`.

    `max_cells`: the most cells that the map may have. Returns int8 (rows, cols), from 0 to 100, -1
    for unknown, row 0 at the lowest y; and the place of the cells. Trinary maps hold 0, 100 and -1;
    in the mode `scale` occupancies between the thresholds are spread over 0 to 100. Raises
    `MapNotFoundError, MapError, InvalidValueError` as in `load_ros_map`.
    """
    description = _read_description(Path(path), None, None)
    occupancy = _probability(_read_image(description, max_cells), description)
    low, high = np.float32(description.free_threshold), np.float32(description.occupied_threshold)
    if description.mode == "raw":
        values = np.rint(occupancy * 100)
    else:
        values = np.full_like(occupancy, math.nan)
        if description.mode == "scale" and low < high:
            width = np.float32(description.occupied_threshold - description.free_threshold)
            scaled = (occupancy - low) / width * np.float32(100)
            values = np.floor(scaled) + (scaled % 1 >= 0.5)  # noqa: PLR2004 - C's round
        values[occupancy >= high] = 100
        values[occupancy <= low] = 0
    return np.where(np.isnan(values + occupancy), -1, values).astype(np.int8), description.frame


def occupancy_of_greys(*, negate: bool = False) -> NDArray[np.float32]:
    """Return the occupancy of each grey of 8 bits, float32 (256,), step by step as Nav2 does."""
    brightness = np.arange(256, dtype=np.float32) / np.float32(255)
    return brightness if negate else np.float32(1) - brightness


def _read_image(description: _Description, max_cells: int) -> Raster:
    """Return the image of a map, unless it holds too many cells."""
    check_max_cells(max_cells)
    return read_raster(
        description.image,
        what=f"{description.where}: image",
        check_size=partial(
            check_size,
            max_cells=max_cells,
            where=f"{description.where}: image {printable(description.image)}",
        ),
    )


def files_of(path: Path) -> list[Path]:
    """Return the YAML file of a map and the image that it names.

    Raises `MapError` when the YAML file cannot be read.
    """
    return [path, _read_description(path, None, None).image]


@dataclass(frozen=True)
class _Description:
    """Contents of the YAML file, after overrides."""

    where: str
    image: Path
    frame: Frame
    mode: str
    negate: bool
    free_threshold: float
    occupied_threshold: float


def _read_description(
    path: Path, free_threshold: float | None, occupied_threshold: float | None
) -> _Description:
    values = read_yaml(path, what="map", error=MapError, missing=MapNotFoundError)
    where = f"map {printable(path)}"
    required = ("image", "resolution", "origin", "negate", "occupied_thresh", "free_thresh")
    if "floors" in values:
        raise MapError(
            f"{where}: a building, expected one map: name that of a floor, or have the building "
            "read by a command of routes (plan, export, check, view) or load_building"
        )
    options = {"free_thresh": free_threshold, "occupied_thresh": occupied_threshold}
    given = {key: value for key, value in options.items() if value is not None}
    if any(not 0 <= value <= 1 for value in given.values()):
        raise InvalidValueError(f"{where}: thresholds must be within [0, 1], got {brief(given)}")
    values |= given
    absent = [key for key in required if key not in values]
    if absent:
        usual = {"free_thresh": "0.196", "occupied_thresh": "0.65"}  # as map_saver writes them
        ways = [
            f"add {key}: {usual[key]}, or state it by --{key.replace('_thresh', '-threshold')}"
            for key in absent
            if key in usual
        ]
        hint = "; ".join(ways) if len(ways) == len(absent) else "add what is missing"
        raise MapError(
            f"{where}: lacks {', '.join(absent)}, expected {', '.join(required)}: {hint}"
        )
    low = _threshold(values, "free_thresh", where)
    high = _threshold(values, "occupied_thresh", where)
    if low > high:
        kind = MapError if free_threshold is occupied_threshold is None else InvalidValueError
        raise kind(
            f"{where}: free_thresh must be at most occupied_thresh, got {low:g} and {high:g}"
        )
    return _Description(
        where=where,
        image=_image_path(values["image"], path, where),
        frame=_frame(values, where),
        mode=_mode(values.get("mode", "trinary"), where),
        negate=_negate(values["negate"], where),
        free_threshold=low,
        occupied_threshold=high,
    )


def _number(value: Any, key: str, where: str) -> float:
    """Return the finite number of a YAML value.

    PyYAML reads 5e-2 as a text, Nav2 as a number.
    """
    number = math.nan
    if isinstance(value, int | float | str) and not isinstance(value, bool):
        try:
            number = float(value)
        except (ValueError, OverflowError):
            number = math.nan
    if not math.isfinite(number):
        raise MapError(f"{where}: {key} must be a finite number, got {brief(value)}")
    return number


def _threshold(values: dict[str, Any], key: str, where: str) -> float:
    number = _number(values[key], key, where)
    if not 0 <= number <= 1:
        raise MapError(f"{where}: {key} must be within [0, 1], got {number:g}")
    return number


def _frame(values: dict[str, Any], where: str) -> Frame:
    resolution = _number(values["resolution"], "resolution", where)
    origin = values["origin"]
    if not isinstance(origin, list) or len(origin) != 3:  # noqa: PLR2004
        raise MapError(f"{where}: origin must be [x, y, yaw], got {brief(origin)}")
    x, y, yaw = (_number(value, "origin", where) for value in origin)
    try:
        return Frame(resolution, (x, y), yaw)
    except InvalidValueError as error:
        raise MapError(f"{where}: {error}") from None


def _mode(value: Any, where: str) -> str:
    mode = value.lower() if isinstance(value, str) else value
    if mode not in _MODES:
        raise MapError(f"{where}: mode must be one of {', '.join(_MODES)}, got {brief(value)}")
    return str(mode)


def _negate(value: Any, where: str) -> bool:
    negate = _BOOLEANS.get(value.lower()) if isinstance(value, str) else value
    if not isinstance(negate, int) or negate not in {0, 1}:
        raise MapError(f"{where}: negate must be 0 or 1, got {brief(value)}")
    return bool(negate)


def _image_path(value: Any, path: Path, where: str) -> Path:
    if not isinstance(value, str) or not value:
        raise MapError(f"{where}: image must be the path of a file, got {brief(value)}")
    try:
        image = Path(value).expanduser()
    except RuntimeError:  # no such user: an ordinary name
        image = Path(value)
    image = path.parent / image
    beside = path.parent / PurePath(value.replace("\\", "/")).name
    is_beside = False
    with suppress(OSError):  # a name that no file can have: who opens it says so
        is_beside = not image.exists() and beside.is_file()
    if is_beside:
        raise MapError(
            f"{where}: image {brief(value)} does not exist, the file lies beside the map: "
            f"write `image: {printable(beside.name)}`"
        )
    return image


def _name_of(path: Path) -> str:
    return (path.absolute().parent.name or path.stem) if path.stem == "map" else path.stem


def _probability(raster: Raster, description: _Description) -> NDArray[np.float32]:
    """Return the occupancy, from a table over the levels, row 0 at the bottom of the image."""
    if description.mode == "raw":
        percent = np.arange(256)
        table = np.where(percent <= 100, percent / 100, math.nan)  # noqa: PLR2004
    else:
        table = occupancy_of_greys(negate=description.negate)
    grey = raster.grey
    probability = np.empty(grey.shape, np.float32)
    for row, of_row in zip(probability, grey[::-1], strict=True):
        row[:] = table[of_row]  # for all at once, numpy makes indices of 8 bytes a cell
    if raster.opaque is not None and description.mode != "raw":  # Nav2: raw ignores opacity
        probability[~raster.opaque[::-1]] = math.nan
    return probability


def _doubts(raster: Raster, description: _Description, grid: OccupancyGrid) -> Iterator[str]:
    """Yield what looks wrong about the thresholds, one text each."""
    low, high = description.free_threshold, description.occupied_threshold
    is_grey = description.mode != "raw"
    occupancy = occupancy_of_greys(negate=description.negate)
    if is_grey and occupancy[_UNKNOWN_GREY] <= np.float32(low):
        unknown = raster.grey == _UNKNOWN_GREY
        if raster.opaque is not None:
            unknown &= raster.opaque
        if count := np.count_nonzero(unknown):
            yield (
                f"{count} cells have grey {_UNKNOWN_GREY}, the usual mark of unknown, and count as "
                f"free at a free threshold of {low:g}; to make them unexplored set free_threshold "
                "to 0.196"
            )
    counts = np.bincount(grid.measured.ravel(), minlength=3)
    for kind in (CellClass.FREE, CellClass.OCCUPIED):
        if not counts[kind]:
            yield (
                f"no cell is {kind.name.lower()} at the thresholds {low:g} and {high:g}: look at "
                "them, at `negate` and at `mode`"
            )
    levels = np.bincount(raster.grey.ravel(), minlength=256)
    levels[(occupancy <= np.float32(low)) | (occupancy >= np.float32(high))] = 0
    doubtful = int(levels.sum() - levels.max())  # the most common grey marks the unknown
    known = counts[CellClass.FREE] + counts[CellClass.OCCUPIED]
    if description.mode == "trinary" and raster.opaque is None and 3 * doubtful > known:
        yield (
            f"{doubtful} cells have greys between the thresholds and count as unexplored; if greys "
            "are probabilities, as in Cartographer's maps, try a free threshold of 0.45 and an "
            "occupied threshold of 0.55"
        )


# The project's own maps, which come with the package.

_PACKAGE = Path(__file__).parents[2]
_FOLDERS = (_PACKAGE / "example_maps", _PACKAGE.parents[1] / "maps")
"""Folders of maps: inside an installed package, or beside `src` in a checkout."""
_NAMES = ("figure1", "office")


def example_map(name: str = "office", *, robot_radius_m: float | None = None) -> OccupancyGrid:
    """Load one of the project's own maps, a file in the repository's `maps/`.

    Parameters
    ----------
    name
        `"office"`, a floor of 42 x 25 m as in a scan, or `"figure1"`, a small map after the source
        paper's Fig. 1.
    robot_radius_m
        Radius in metres: a cell is blocked when its centre lies within it of the centre of an
        occupied cell; 0 for a point. None is the default, 0.25 m.

    Returns
    -------
    OccupancyGrid
        Row 0 at the lowest y, placed in the map frame.

    Raises
    ------
    InvalidValueError
        When there is no such map, or the radius is negative or not finite.

    Examples
    --------
    >>> hn.example_map("office").shape
    (580, 960)
    >>> hn.example_map("figure1").class_counts()
    {'free': 330, 'unexplored': 341, 'occupied': 205, 'blocked': 324}
    """
    if name not in _NAMES:
        raise InvalidValueError(
            f"there is no example map {name!r:.80}, only {' and '.join(_NAMES)}: "
            "load a map of your own with load_map"
        )
    files = [folder / name / f"{name}.yaml" for folder in _FOLDERS]
    return load_ros_map(next(filter(Path.is_file, files)), robot_radius_m=robot_radius_m)


def write_ros_map(grid: OccupancyGrid, path: PathLike) -> None:
    """Write a map as map_server, Nav2 and `load_map` read it: a YAML file and a PGM image.

    A cell of occupancy p becomes a pixel of brightness 255 (1 - p), rounded, but never across a
    threshold: free, occupied and unexplored cells keep their class. Cells that were never measured
    become grey 205, or the nearest grey that the thresholds call unexplored. A map that was read
    from grey of 8 bits, in the mode trinary or scale and without `negate`, is written with equal
    pixels.

    The robot's radius and dropped islands are no part of such a map: what was measured is written.

    Parameters
    ----------
    grid
        The map.
    path
        The YAML file, ending in .yaml or .yml; the image gets the same name, ending in .pgm. Files
        that exist are replaced.

    Raises
    ------
    InvalidValueError
        When the map is none.
    MapError
        When the name does not end so, a file cannot be written, or cells are of a class for which
        the thresholds leave no grey.

    Examples
    --------
    >>> hn.write_ros_map(hn.example_map("figure1"), "figure1.yaml")
    >>> hn.load_map("figure1.yaml").class_counts() == hn.example_map("figure1").class_counts()
    True
    """
    checked_type("grid", grid, OccupancyGrid)
    target = Path(path)
    where = f"map {printable(target)}"
    if target.suffix.lower() not in {".yaml", ".yml"}:
        raise MapError(f"{where}: a ROS map must be named .yaml or .yml, its image gets .pgm")
    image = target.with_suffix(".pgm")
    pixels = _pixels(grid, where)
    rows, cols = pixels.shape
    x, y, yaw = (_decimal(value) for value in (*grid.frame.origin_m, grid.frame.yaw_rad))
    lines = [
        yaml.safe_dump({"image": image.name}, allow_unicode=True, width=math.inf).strip(),
        "mode: trinary",
        f"resolution: {_decimal(grid.resolution_m)}",
        f"origin: [{x}, {y}, {yaw}]",
        "negate: 0",
        f"occupied_thresh: {_decimal(grid.occupied_threshold)}",
        f"free_thresh: {_decimal(grid.free_threshold)}",
    ]
    NewFile(image, where).write(b"P5\n%d %d\n255\n" % (cols, rows) + pixels.tobytes())
    NewFile(target, where).write(("\n".join(lines) + "\n").encode())


def _decimal(value: float) -> str:
    """Return a number in digits: YAML 1.1 takes exponents without a point for text."""
    return np.format_float_positional(value, trim="0")


def _pixels(grid: OccupancyGrid, where: str) -> ByteArray:
    """Return the image, uint8 (rows, cols), row 0 at the top."""
    thresholds = grid.free_threshold, grid.occupied_threshold
    greys = levels_by_class(occupancy_of_greys(), thresholds)
    pixels = np.zeros(grid.shape, dtype=np.uint8)
    level = np.rint((1.0 - grid.probability.astype(np.float64)) * _WHITE)
    level[np.isnan(level)] = _UNKNOWN_GREY
    for kind, allowed in greys.items():
        cells = grid.measured == kind
        if not cells.any():
            continue
        if not allowed.size:
            raise MapError(
                f"{where}: the thresholds {thresholds[0]:g} and {thresholds[1]:g} "
                f"leave no grey of 8 bits for {kind.name.lower()} cells: set them wider apart"
            )
        pixels[cells] = np.clip(level[cells], allowed[0], allowed[-1])
    return pixels[::-1]
