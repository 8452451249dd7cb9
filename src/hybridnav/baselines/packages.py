"""What planners of others share: their packages, their versions, the maps that they cannot take."""

from __future__ import annotations

import importlib
import importlib.metadata
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.baselines.protocol import MethodResult
from hybridnav.errors import InvalidValueError, UnsuitableMapError
from hybridnav.grid import CellClass

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray
    from hybridnav.grid import OccupancyGrid

Cell = tuple[int, int]


def needed_package(package: str) -> Any:
    """Return a package that only one rival needs.

    Raises
    ------
    InvalidValueError
        When it is not installed.
    """
    try:
        return importlib.import_module(package)
    except ImportError:
        raise InvalidValueError(
            f"this method needs {package}: pip install 'hybridnav[bench]'"
        ) from None


def refuse_corner_cutting(grid: OccupancyGrid) -> None:
    """Refuse a map on which paths may cut corners, which no any-angle path does.

    Raises
    ------
    UnsuitableMapError
        When they may.
    """
    if grid.corner_cutting:
        raise UnsuitableMapError(
            "its any-angle paths never pass between two blocked cells that meet at a corner, and "
            "this run lets paths do so"
        )


class Rival:
    """What rivals share: a version, no regions, and the same answers where nothing is to be
    planned."""

    region_of = None

    def __init__(self, grid: OccupancyGrid, package: str, settings: str) -> None:
        self.version = f"{package} {importlib.metadata.version(package)}"
        self.settings = settings
        """Its settings in a few words, for tables."""
        self.free: BoolArray = grid.classes == CellClass.FREE
        self.n_nodes = int(self.free.sum())
        self.n_edges = 0
        self.memory_bytes = 0

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two cells; there is no path from or to one that is not free."""
        if not (self.free[start] and self.free[goal]):
            return MethodResult(None)
        if start == goal:
            return MethodResult(np.array([start], dtype=np.int64))
        return self.between(start, goal)

    def between(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two different free cells."""
        raise NotImplementedError
