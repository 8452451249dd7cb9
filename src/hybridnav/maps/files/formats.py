"""Map files by their suffix: one function that reads every kind, and the writers of ROS and
MovingAI maps.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import yaml

from hybridnav._base.extension import extension, extensions
from hybridnav._base.files import NewFile, printable, replace_file
from hybridnav.errors import MapError
from hybridnav.maps import DEFAULT_MAX_CELLS, CellClass, OccupancyGrid
from hybridnav.maps.checks import checked_type
from hybridnav.maps.files.movingai import load_movingai_map
from hybridnav.maps.files.ros import load_ros_map, occupancy_of_greys

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._base.typing import ByteArray, PathLike

_LOADERS = {".yaml": load_ros_map, ".yml": load_ros_map, ".map": load_movingai_map}
_IMAGES = {".pgm", ".png", ".pnm", ".ppm", ".pbm", ".bmp", ".tif", ".tiff", ".gif", ".jpg", ".jpeg"}


def load_map(
    path: PathLike,
    *,
    robot_radius_m: float | None = None,
    free_threshold: float | None = None,
    occupied_threshold: float | None = None,
    max_cells: int = DEFAULT_MAX_CELLS,
) -> OccupancyGrid:
    """Load an occupancy grid from a file.

    Parameters
    ----------
    path
        A ROS map (.yaml or .yml, beside its image), a MovingAI map (.map, cells of 1 m), or the
        map of a model (.hnm). Other packages add formats: a function with these parameters, as the
        entry point of its suffix in `hybridnav.formats`.
    robot_radius_m
        Radius in metres: a cell is blocked when its centre lies within it of the centre of an
        occupied cell. 0 for a robot that is a point; None is the default: 0.25 m, or for a model
        the radius of the model.
    free_threshold, occupied_threshold
        U1 and U2: occupancy up to U1 is free, from U2 on occupied. By default those of the file.
    max_cells
        The most cells of the map, checked in the header before memory is taken: a small file may
        hold a huge map. A cell takes about 16 bytes while the map is read, and up to 300 for
        planning.

    Returns
    -------
    OccupancyGrid
        Row 0 at the lowest y, placed in the map frame.

    Raises
    ------
    MapNotFoundError
        When the file, or the image that it names, does not exist.
    MapError
        When a file cannot be read, or holds more than `max_cells`; the message is one line with the
        fault and its place.
    InvalidValueError
        When the radius, a threshold or the limit is out of range.

    Warns
    -----
    MapWarning
        When the thresholds of a ROS map call grey 205, the usual mark of unknown cells, free.

    Examples
    --------
    >>> from pathlib import Path
    >>> _ = Path("tiny.pgm").write_bytes(b"P5 3 1 255 " + bytes([254, 205, 0]))
    >>> _ = Path("tiny.yaml").write_text(
    ...     "{image: tiny.pgm, resolution: 0.1, origin: [0, 0, 0], negate: 0, "
    ...     "free_thresh: 0.196, occupied_thresh: 0.65}"
    ... )
    >>> hn.load_map("tiny.yaml", robot_radius_m=0).classes
    array([[1, 2, 0]], dtype=uint8)
    """
    suffix = Path(path).suffix.lower()
    loader: Callable[..., OccupancyGrid] | None = _LOADERS.get(suffix)
    if loader is None and suffix in extensions("formats"):
        loader = extension("formats", suffix)
    if loader is None:
        hint = (
            "pass the YAML file that names this image"
            if suffix in _IMAGES
            else "expected .yaml or .yml (ROS map_server), .map (MovingAI) or .hnm (a model)"
        )
        raise MapError(f"map {printable(path)}: {hint}")
    return loader(
        path,
        robot_radius_m=robot_radius_m,
        free_threshold=free_threshold,
        occupied_threshold=occupied_threshold,
        max_cells=max_cells,
    )


_WHITE = 255
_UNKNOWN_GREY = 205
"""The grey that map_saver writes for cells that were never measured."""


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
    x, y, yaw = (_number(value) for value in (*grid.frame.origin_m, grid.frame.yaw_rad))
    lines = [
        yaml.safe_dump({"image": image.name}, allow_unicode=True, width=math.inf).strip(),
        "mode: trinary",
        f"resolution: {_number(grid.resolution_m)}",
        f"origin: [{x}, {y}, {yaw}]",
        "negate: 0",
        f"occupied_thresh: {_number(grid.occupied_threshold)}",
        f"free_thresh: {_number(grid.free_threshold)}",
    ]
    try:
        replace_file(image, b"P5\n%d %d\n255\n" % (cols, rows) + pixels.tobytes())
        replace_file(target, ("\n".join(lines) + "\n").encode())
    except OSError as error:
        raise MapError(f"{where}: cannot write: {error.strerror}") from None


def _number(value: float) -> str:
    """Return a number in digits: YAML 1.1 takes exponents without a point for text."""
    return np.format_float_positional(value, trim="0")


def _pixels(grid: OccupancyGrid, where: str) -> ByteArray:
    """Return the image, uint8 (rows, cols), row 0 at the top."""
    occupancy = occupancy_of_greys()
    low, high = np.float32(grid.free_threshold), np.float32(grid.occupied_threshold)
    greys = {
        CellClass.FREE: np.flatnonzero(occupancy <= low),
        CellClass.OCCUPIED: np.flatnonzero((occupancy >= high) & (occupancy > low)),
        CellClass.UNEXPLORED: np.flatnonzero((occupancy > low) & (occupancy < high)),
    }
    pixels = np.zeros(grid.shape, dtype=np.uint8)
    level = np.rint((1.0 - grid.probability.astype(np.float64)) * _WHITE)
    level[np.isnan(level)] = _UNKNOWN_GREY
    for kind, allowed in greys.items():
        cells = grid.measured == kind
        if not cells.any():
            continue
        if not allowed.size:
            raise MapError(
                f"{where}: the thresholds {grid.free_threshold:g} and {grid.occupied_threshold:g} "
                f"leave no grey of 8 bits for {kind.name.lower()} cells: set them wider apart"
            )
        pixels[cells] = np.clip(level[cells], allowed[0], allowed[-1])
    return pixels[::-1]


# Writer of MovingAI maps.


def write_movingai_map(grid: OccupancyGrid, path: PathLike) -> None:
    """Write a map in the format of the MovingAI benchmarks, as `load_map` reads it.

    Free cells become `.`, all others `@`: the format has no unexplored cells. It has no frame
    either: a cell is 1 m wide when it is read again, and its corner lies at (0, 0). The robot's
    radius and dropped islands are no part of such a map: what was measured is written.

    Parameters
    ----------
    grid
        The map.
    path
        The file, ending in .map; one that exists is replaced.

    Raises
    ------
    InvalidValueError
        When the map is none.
    MapError
        When the name does not end so, or the file cannot be written.

    Examples
    --------
    >>> hn.write_movingai_map(hn.example_map("figure1"), "figure1.map")
    >>> hn.load_map("figure1.map").shape == hn.example_map("figure1").shape
    True
    """
    checked_type("grid", grid, OccupancyGrid)
    file = NewFile.named(path, "map", "a MovingAI map", (".map",))
    rows, cols = grid.shape
    letters = np.full((rows, cols + 1), ord("@"), dtype=np.uint8)
    letters[:, :-1][grid.measured == CellClass.FREE] = ord(".")
    letters[:, -1] = ord("\n")
    head = f"type octile\nheight {rows}\nwidth {cols}\nmap\n".encode()
    file.write(head + letters[::-1].tobytes())
