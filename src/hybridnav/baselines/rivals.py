"""Planners of others on the whole grid, as methods of the harness; each needs its own package."""

from __future__ import annotations

import importlib
import importlib.metadata
import math
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.baselines.protocol import MethodResult
from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.search.moves import STEPS, legal_moves

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._typing import BoolArray, LongArray
    from hybridnav.grid import OccupancyGrid

Cell = tuple[int, int]

MAX_NETWORKX_CELLS = 100_000
"""Free cells up to which a graph of networkx is made: about a kilobyte each."""


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


class _Rival:
    """What rivals share: they know cells alone."""

    region_of = None

    def __init__(self, grid: OccupancyGrid, package: str) -> None:
        self.version = f"{package} {importlib.metadata.version(package)}"
        self.free: BoolArray = grid.classes == CellClass.FREE
        self.n_nodes = int(self.free.sum())
        self.n_edges = 0
        self.memory_bytes = 0


class Tcod(_Rival):
    """Dijkstra of python-tcod over the legal moves, until the goal is reached.

    Its costs are whole numbers, 70 straight and 99 diagonal, so paths may be longer than the
    octile optimum by rounding.
    """

    name = "tcod"

    def __init__(self, grid: OccupancyGrid) -> None:
        path = needed_package("tcod.path")
        super().__init__(grid, "tcod")
        moves = legal_moves(self.free, grid.corner_cutting)
        self._path, self._graph = path, path.CustomGraph(grid.shape, order="C")
        self._masks = []
        for bit, (row, col) in enumerate(STEPS.tolist()):
            mask = np.ascontiguousarray((moves >> bit) & 1, dtype=np.int8)
            self._masks.append(mask)
            cost = 99 if row and col else 70
            # tcod asks for the cost of the cell that is entered: the mask lies there.
            entered = np.zeros_like(mask)
            entered[_to(row, grid.shape[0]), _to(col, grid.shape[1])] = mask[
                _to(-row, grid.shape[0]), _to(-col, grid.shape[1])
            ]
            self._graph.add_edge((row, col), cost, cost=entered)
        self.memory_bytes = 2 * sum(mask.nbytes for mask in self._masks)

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells."""
        began = time.perf_counter()
        finder = self._path.Pathfinder(self._graph)
        finder.add_root(start)
        cells = finder.path_to(goal)
        seconds = {"refine": time.perf_counter() - began}
        if len(cells) < 2 and start != goal:  # noqa: PLR2004 - the goal alone: not reached
            return MethodResult(None, seconds=seconds)
        return MethodResult(np.asarray(cells, dtype=np.int64), seconds=seconds)


def _to(step: int, size: int) -> slice:
    """Return the rows, or columns, that a step leads to inside the map."""
    return slice(max(step, 0), size + min(step, 0))


class Pyastar2d(_Rival):
    """A* of pyastar2d, which prices diagonals like straight steps and cuts corners.

    A diagonal beside a blocked cell becomes two straight steps past the free one. A path that
    passes between two blocked cells has no such remedy: then there is no answer.
    """

    name = "pyastar2d"

    def __init__(self, grid: OccupancyGrid) -> None:
        self._find = needed_package("pyastar2d").astar_path
        super().__init__(grid, "pyastar2d")
        self._costs = np.where(self.free, np.float32(1), np.float32(np.inf))
        self.memory_bytes = self._costs.nbytes

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells."""
        if start == goal:
            return MethodResult(np.array([start], dtype=np.int64))
        cells = self._find(self._costs, start, goal, allow_diagonal=True)
        if cells is None:
            return MethodResult(None)
        legal = self._round_corners(np.asarray(cells, dtype=np.int64))
        gave_up = "its path passes between two blocked cells" if legal is None else ""
        return MethodResult(legal, gave_up=gave_up)

    def _round_corners(self, cells: LongArray) -> LongArray | None:
        """Return the path with two straight steps for each diagonal past one blocked cell, None if
        it passes between two."""
        round_: list[Cell] = [(int(cells[0, 0]), int(cells[0, 1]))]
        for row, col in cells[1:].tolist():
            last = round_[-1]
            sides = [(last[0], col), (row, last[1])]
            free = [side for side in sides if self.free[side]]
            if row != last[0] and col != last[1]:
                if not free:
                    return None
                if len(free) == 1:
                    round_.append(free[0])
            round_.append((row, col))
        return np.array(round_, dtype=np.int64)


class Networkx(_Rival):
    """A* of networkx over a graph of the legal moves."""

    name = "networkx"

    def __init__(self, grid: OccupancyGrid) -> None:
        super().__init__(grid, "networkx")
        if self.n_nodes > MAX_NETWORKX_CELLS:
            raise InvalidValueError(
                f"a graph of networkx is made of up to {MAX_NETWORKX_CELLS:,} free cells, this map "
                f"has {self.n_nodes:,}"
            )
        self._networkx = needed_package("networkx")
        self._graph = self._networkx.Graph()
        self._graph.add_nodes_from(map(tuple, np.argwhere(self.free).tolist()))
        self._graph.add_weighted_edges_from(self._edges(grid))
        self.n_edges = self._graph.number_of_edges()

    def _edges(self, grid: OccupancyGrid) -> Iterable[tuple[Cell, Cell, float]]:
        moves = legal_moves(self.free, grid.corner_cutting)
        for bit, (row, col) in enumerate(STEPS.tolist()):
            if (row, col) < (0, 0):  # the opposite of another
                continue
            for at in np.argwhere((moves >> bit) & 1).tolist():
                yield (at[0], at[1]), (at[0] + row, at[1] + col), math.hypot(row, col)

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells."""
        try:
            cells = self._networkx.astar_path(self._graph, start, goal, heuristic=_octile)
        except self._networkx.NetworkXNoPath:
            return MethodResult(None)
        return MethodResult(np.array(cells, dtype=np.int64), bound=1 + 1e-9)


def _octile(first: Cell, second: Cell) -> float:
    """Return the octile distance of two cells, in cells."""
    rows, cols = abs(first[0] - second[0]), abs(first[1] - second[1])
    return max(rows, cols) + (math.sqrt(2) - 1) * min(rows, cols)
