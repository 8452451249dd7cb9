"""The project's own maps, made in memory because an installed package has no map files."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hybridnav.errors import InvalidValueError
from hybridnav.grid.worlds import figure1_world, office_world

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav.grid import OccupancyGrid
    from hybridnav.grid.worlds import World

_WORLDS: dict[str, Callable[[], World]] = {"figure1": figure1_world, "office": office_world}


def example_map(name: str = "office", *, robot_radius_m: float | None = None) -> OccupancyGrid:
    """Make one of the project's own maps, the same as its file in the repository's `maps/`.

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
    make = _WORLDS.get(name)
    if make is None:
        raise InvalidValueError(
            f"there is no example map {name!r:.80}, only {' and '.join(sorted(_WORLDS))}: "
            "load a map of your own with load_map"
        )
    return make().grid(robot_radius_m=robot_radius_m)
