"""The project's own maps, which come with the package."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from hybridnav.errors import InvalidValueError
from hybridnav.io.ros import load_ros_map

if TYPE_CHECKING:
    from hybridnav.grid import OccupancyGrid

_PACKAGE = Path(__file__).parents[1]
_FOLDERS = (_PACKAGE / "maps", _PACKAGE.parents[1] / "maps")
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
