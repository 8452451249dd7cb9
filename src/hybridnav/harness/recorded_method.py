"""Recorded paths as a method of the harness, beside live ones. Public: `RecordedMethod`."""

from pathlib import Path
from typing import Any

import numpy as np

from hybridnav._base.files import printable
from hybridnav._base.trig import hypots
from hybridnav.errors import MapError, MapNotFoundError
from hybridnav.harness.baselines import AnyAngleResult, MethodResult
from hybridnav.harness.names import content_hash
from hybridnav.harness.path_files import Unit, load_paths
from hybridnav.maps import OccupancyGrid

Cell = tuple[int, int]

NOT_RECORDED = "not recorded"
"""Status of a pair of which no path was recorded."""


class RecordedMethod:
    """The paths of a folder; see `baselines.Solver`.

    A path answers the pair of the cells in which it begins and ends; the first of several does. It
    is joined to the centres of these cells, as the harness judges paths between centres. It has no
    times and no expansions. The answer to other pairs is "not recorded", which claims nothing.

    `grid`: the map; `folder`: a folder of files that `load_paths` reads, or one of them; `unit`,
    `frame`: see there. Raises `MapError` when a file cannot be read, or there is none.
    """

    region_of = None
    n_edges = 0

    def __init__(
        self, grid: OccupancyGrid, folder: str, unit: Unit | None = None, frame: str | None = None
    ) -> None:
        self.name = f"recorded {Path(folder).stem}"
        self._grid = grid
        self._points_of: dict[tuple[Cell, Cell], Any] = {}
        for file in files_of(folder):
            for each in load_paths(file, grid, unit=unit, frame=frame):
                start, goal = map(tuple, grid.frame.cells_of(each.points[[0, -1]]).tolist())
                self._points_of.setdefault((start, goal), each.points)
        self.n_nodes = len(self._points_of)
        self.memory_bytes = sum(points.nbytes for points in self._points_of.values())

    @property
    def pairs(self) -> tuple[tuple[Cell, Cell], ...]:
        """The pairs that were recorded, in the order of their files."""
        return tuple(self._points_of)

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Return the path that was recorded between two cells."""
        points = self._points_of.get((start, goal))
        if points is None:
            return MethodResult(None, gave_up=NOT_RECORDED)
        centres = self._grid.frame.points_of(np.array([start, goal]))
        joined = np.concatenate([centres[:1], points, centres[1:]])
        moves = np.append(True, (np.diff(joined, axis=0) != 0).any(axis=1))
        line = joined[moves]
        length_m = float(hypots(*np.diff(line, axis=0).T).sum())
        return MethodResult(None, any_angle=AnyAngleResult(line, length_m))


def files_of(folder: str) -> tuple[Path, ...]:
    """Return the files of a folder in the order of their names, or the file itself.

    Raises `MapNotFoundError` when there is no such folder, `MapError` when it is empty.
    """
    place = Path(folder)
    if not place.exists():
        raise MapNotFoundError(f"recorded paths {printable(folder)}: no such folder: name another")
    is_bag = (place / "metadata.yaml").exists()
    if not place.is_dir() or is_bag:
        return (place,)
    files = tuple(sorted(each for each in place.iterdir() if not each.name.startswith(".")))
    if not files:
        raise MapError(
            f"recorded paths {printable(folder)}: the folder is empty, expected files of paths: "
            "put some there"
        )
    return files


def content_of(folder: str) -> str:
    """Return a short hash of the files: paths that were recorded again are another method."""
    each = [one.rglob("*") if one.is_dir() else [one] for one in files_of(folder)]
    return content_hash(file for some in each for file in some if file.is_file())
