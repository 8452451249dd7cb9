"""`load_map`: map files by their suffix, one function that reads every kind."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from hybridnav._base.extension import extension, extensions
from hybridnav._base.files import printable
from hybridnav._base.typing import PathLike
from hybridnav.errors import MapError
from hybridnav.maps import DEFAULT_MAX_CELLS, OccupancyGrid
from hybridnav.maps.files.movingai import load_movingai_map
from hybridnav.maps.files.ros import load_ros_map

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
        known = [*_LOADERS, *(each for each in extensions("formats") if each.startswith("."))]
        hint = f"expected one of {', '.join(known)}"
        if suffix in _IMAGES:
            hint = "pass the YAML file that names this image"
        raise MapError(f"map {printable(path)}: {hint}")
    return loader(
        path,
        robot_radius_m=robot_radius_m,
        free_threshold=free_threshold,
        occupied_threshold=occupied_threshold,
        max_cells=max_cells,
    )
