"""Writer of MovingAI maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.grid import CellClass, OccupancyGrid
from hybridnav.grid.checks import checked_type
from hybridnav.io.new_file import NewFile

if TYPE_CHECKING:
    from hybridnav._typing import PathLike


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
