"""Planners of others on the whole grid, as methods of the harness; each needs its own package.

    hybridnav evaluate MAP --baseline benchmarks.rivals:Tcod

`rivals_any_angle` has those whose paths are not of cells.
"""

import importlib
import importlib.metadata
import math
import time
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from hybridnav._base.moves import STEPS, legal_moves, moves_along
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError, UnsuitableMapError
from hybridnav.harness.baselines.regions import CUT_CORNERS, CostClaim, MethodResult
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.costs import CostLayer

Cell = tuple[int, int]

MAX_NETWORKX_CELLS = 100_000
"""Free cells up to which a graph of networkx is made: about a kilobyte each."""
MAX_ROUTINGKIT_CELLS = 100_000
"""Free cells up to which pyroutingkit prepares unless it is told: 0.15 to 0.3 ms each."""


def needed_package(package: str) -> Any:
    """Return a package that only one rival needs.

    Raises `InvalidValueError` when it is not installed.
    """
    try:
        return importlib.import_module(package.replace("-", "_"))
    except ImportError:
        raise InvalidValueError(
            f"this method needs {package}: pip install 'hybridnav[bench]'"
        ) from None


def refuse_corner_cutting(grid: OccupancyGrid) -> None:
    """Refuse a map on which paths may cut corners, which no any-angle path does.

    Raises `UnsuitableMapError` when they may.
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
    package: str
    """Its package, as it is installed; "-" is "_" where it is imported."""

    def __init__(self, grid: OccupancyGrid, settings: str) -> None:
        self.version = f"{self.package} {importlib.metadata.version(self.package)}"
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


class Tcod(Rival):
    """Dijkstra of python-tcod over the legal moves, until the goal is reached.

    Its costs are whole numbers, 70 straight and 99 diagonal, so paths may be longer than the
    octile optimum by rounding.
    """

    name = package = "tcod"

    def __init__(self, grid: OccupancyGrid) -> None:
        needed_package("tcod")
        path = importlib.import_module("tcod.path")
        super().__init__(grid, "Dijkstra, costs 70 and 99")
        # On a single row or column tcod reports loops in its own paths.
        single = [(0, int(size == 1)) for size in grid.shape]
        moves = legal_moves(np.pad(self.free, single), grid.corner_cutting)
        rows, cols = moves.shape
        self._path, self._graph = path, path.CustomGraph(moves.shape, order="C")
        self._masks = []
        for bit, (row, col) in enumerate(STEPS.tolist()):
            mask = np.ascontiguousarray((moves >> bit) & 1, dtype=np.int8)
            self._masks.append(mask)
            cost = 99 if row and col else 70
            # tcod asks for the cost of the cell that is entered: the mask lies there.
            entered = np.zeros_like(mask)
            entered[_to(row, rows), _to(col, cols)] = mask[_to(-row, rows), _to(-col, cols)]
            self._graph.add_edge((row, col), cost, cost=entered)
        self.memory_bytes = 2 * sum(mask.nbytes for mask in self._masks)

    def between(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two different free cells."""
        began = time.perf_counter()
        finder = self._path.Pathfinder(self._graph)
        finder.add_root(start)
        cells = finder.path_to(goal)
        seconds = {"refine": time.perf_counter() - began}
        if len(cells) < 2:
            return MethodResult(None, seconds=seconds)
        return MethodResult(np.asarray(cells, dtype=np.int64), seconds=seconds)


def _to(step: int, size: int) -> slice:
    """Return the rows, or columns, that a step leads to inside the map."""
    return slice(max(step, 0), size + min(step, 0))


class Pyastar2d(Rival):
    """A* of pyastar2d, which prices diagonals like straight steps and cuts corners.

    A diagonal beside a blocked cell becomes two straight steps past the free one. A path that
    passes between two blocked cells has no such remedy: then there is no answer.
    """

    name = package = "pyastar2d"

    def __init__(self, grid: OccupancyGrid) -> None:
        self._find = needed_package("pyastar2d").astar_path
        super().__init__(grid, "A*, allow_diagonal")
        self._costs = np.where(self.free, np.float32(1), np.float32(np.inf))
        self.memory_bytes = self._costs.nbytes

    def between(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two different free cells."""
        cells = self._cells(start, goal)
        if cells is None:
            return MethodResult(None)
        legal = self._round_corners(np.asarray(cells, dtype=np.int64))
        gave_up = "its path passes between two blocked cells" if legal is None else ""
        return MethodResult(legal, gave_up=gave_up)

    def _cells(self, start: Cell, goal: Cell) -> Any:
        return self._find(self._costs, start, goal, allow_diagonal=True)

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


class ScikitImage(Pyastar2d):
    """Dijkstra of scikit-image (`MCP_Geometric`) until the goal is reached, which cuts corners.

    Its paths are made legal as those of `Pyastar2d`.
    """

    name = package = "scikit-image"

    def __init__(self, grid: OccupancyGrid) -> None:
        self._graph = needed_package("skimage").graph
        Rival.__init__(self, grid, "MCP_Geometric")
        self._costs = np.where(self.free, 1.0, -1.0)  # below zero is blocked
        self.memory_bytes = self._costs.nbytes

    def _cells(self, start: Cell, goal: Cell) -> Any:
        finder = self._graph.MCP_Geometric(self._costs)
        try:
            finder.find_costs([start], [goal])
            return finder.traceback(goal)
        except ValueError:
            return None


class Scipy(Rival):
    """Dijkstra of scipy (`csgraph.dijkstra`) over the legal moves, from the start to all cells."""

    name = package = "scipy"

    def __init__(self, grid: OccupancyGrid) -> None:
        super().__init__(grid, "csgraph.dijkstra")
        moves, n_cells = legal_moves(self.free, grid.corner_cutting).ravel(), self.free.size
        parts = []
        for direction, step in enumerate(STEPS.tolist()):
            tails, heads = moves_along(moves, grid.shape[1], direction)
            parts.append((np.full(len(tails), math.hypot(*step)), tails, heads))
        lengths, tails, heads = (np.concatenate(part) for part in zip(*parts, strict=True))
        self._moves = csr_array((lengths, (tails, heads)), shape=(n_cells, n_cells))
        self.n_edges = len(lengths) // 2
        self.memory_bytes = self._moves.data.nbytes + self._moves.indices.nbytes

    def between(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two different free cells."""
        first, last = (int(np.ravel_multi_index(cell, self.free.shape)) for cell in (start, goal))
        _, before = dijkstra(self._moves, indices=[first], return_predecessors=True)
        if before[0, last] < 0:
            return MethodResult(None)
        cells = [last]
        while cells[-1] != first:
            cells.append(int(before[0, cells[-1]]))
        path = np.column_stack(np.unravel_index(cells[::-1], self.free.shape))
        return MethodResult(path.astype(np.int64), bound=1 + 1e-9)


class Networkx(Rival):
    """A* of networkx over a graph of the legal moves."""

    name = package = "networkx"

    def __init__(self, grid: OccupancyGrid, *, most_cells: int = MAX_NETWORKX_CELLS) -> None:
        super().__init__(grid, "A*, octile heuristic")
        if self.n_nodes > most_cells:
            raise UnsuitableMapError(
                f"a graph of networkx is made of up to {most_cells:,} free cells, this map has "
                f"{self.n_nodes:,}"
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

    def between(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two different free cells."""
        try:
            cells = self._networkx.astar_path(self._graph, start, goal, heuristic=_octile)
        except self._networkx.NetworkXNoPath:
            return MethodResult(None)
        return MethodResult(np.array(cells, dtype=np.int64), bound=1 + 1e-9)


class NanoAstar(Rival):
    """A* of nano-astar, whose diagonals pass no blocked cell; it knows no other rule."""

    name = package = "nano-astar"

    def __init__(self, grid: OccupancyGrid) -> None:
        self._find = needed_package("nano-astar").astar
        super().__init__(grid, "A*, diagonal, octile heuristic")
        self._cuts_corners = grid.corner_cutting
        self._blocked = np.ascontiguousarray(~self.free, dtype=np.uint8)
        self.memory_bytes = self._blocked.nbytes

    def between(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two different free cells."""
        found = self._find(self._blocked, start, goal, heuristic="octile", diagonal=True)
        if found is None:
            return MethodResult(None, gave_up=CUT_CORNERS if self._cuts_corners else "")
        bound = math.inf if self._cuts_corners else 1 + 1e-6
        return MethodResult(np.asarray(found[0], dtype=np.int64), bound=bound)


class RoutingKit(Rival):
    """Customizable contraction hierarchies of pyroutingkit over the legal moves.

    J. Dibbelt, B. Strasser, D. Wagner: Customizable contraction hierarchies, 2016. Weights are
    whole numbers below 2^31 along any path, so on large maps a step has few units: the bound of an
    answer holds their rounding.

    `grid`: the map; free cells are entered, all others not; `costs`: costs of its cells, by which
    paths are cheapest; None for lengths; `most_cells`: free cells up to which it prepares, which
    takes 0.15 to 0.3 ms a cell.
    """

    name = package = "pyroutingkit"

    def __init__(
        self,
        grid: OccupancyGrid,
        *,
        costs: CostLayer | None = None,
        most_cells: int = MAX_ROUTINGKIT_CELLS,
    ) -> None:
        kit = needed_package("pyroutingkit")
        self._costs, self._resolution_m = costs, grid.resolution_m
        self._cells = np.argwhere(grid.classes == CellClass.FREE)
        if len(self._cells) > most_cells:
            raise UnsuitableMapError(
                f"pyroutingkit prepares up to {most_cells:,} free cells, this map has "
                f"{len(self._cells):,}"
            )
        self._node_of = np.full(grid.shape, -1, dtype=np.int64)
        self._node_of[tuple(self._cells.T)] = np.arange(len(self._cells))
        tails, heads, prices = self._arcs(grid)
        units = _units_of(prices, len(self._cells))
        super().__init__(grid, f"a straight step is {units:,} units")
        self.n_edges = len(tails) // 2
        # A step of price p weighs from p - 1 / (2 units) to p + 1 / (2 units), and p is at least 1.
        self._factor = (1 + 0.5 / units) / (1 - 0.5 / units)
        weights = np.rint(prices * units).astype(np.uint32)
        self._metric = self._hierarchy(kit, tails, heads, weights) if len(tails) else None
        self._none = kit.INF_WEIGHT
        self.memory_bytes = self._cells.nbytes + self._node_of.nbytes

    def _arcs(self, grid: OccupancyGrid) -> tuple[LongArray, LongArray, FloatArray]:
        """Return the nodes that each move joins, and its price in cells."""
        moves = legal_moves(grid.classes == CellClass.FREE, grid.corner_cutting).ravel()
        nodes = self._node_of.ravel()
        factors = None if self._costs is None else self._costs.factors.ravel().astype(np.float64)
        parts = []
        for direction, step in enumerate(STEPS.tolist()):
            tails, heads = moves_along(moves, grid.shape[1], direction)
            prices = np.full(len(tails), math.hypot(*step))
            if factors is not None:
                prices *= (factors[tails] + factors[heads]) / 2
            parts.append((nodes[tails], nodes[heads], prices))
        tails, heads, prices = (np.concatenate(part) for part in zip(*parts, strict=True))
        return tails, heads, prices

    def _hierarchy(
        self, kit: Any, tails: LongArray, heads: LongArray, weights: NDArray[np.uint32]
    ) -> Any:
        self._topology = kit.CCHTopology()  # the metric refers to it
        rows, cols = self._cells.T.astype(np.float32)
        ends = tails.astype(np.uint32), heads.astype(np.uint32)
        self._topology.build(*ends, rows, cols, len(self._cells))
        metric = kit.CCHMetric(self._topology)
        metric.customize(weights)
        return metric

    def between(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two different free cells."""
        if self._metric is None:
            return MethodResult(None)
        ends = int(self._node_of[start]), int(self._node_of[goal])
        distance, nodes, _ = self._metric.query(*ends)
        if distance >= self._none:
            return MethodResult(None)
        cells = self._cells[np.asarray(nodes, dtype=np.int64)]
        if self._costs is None:
            return MethodResult(cells, bound=self._factor)
        cost_m = self._costs.cost_of_cells(cells) * self._resolution_m
        return MethodResult(cells, by_costs=CostClaim(cost_m, cost_m / self._factor))


_MOST_WEIGHT = 2**31 - 2
_MOST_UNITS = 10_000


def _units_of(prices: FloatArray, n_cells: int) -> int:
    """Return the units of a straight step with which no path's weight overflows.

    Raises `UnsuitableMapError` when a path may be so dear that a step would have less than ten.
    """
    dearest = float(prices.max(initial=1.0)) * max(n_cells, 1)
    units = min(_MOST_UNITS, int(_MOST_WEIGHT / dearest) - 1)
    if units < 10:
        raise UnsuitableMapError(
            f"its weights are below 2^31 along any path, too few for {n_cells:,} free cells with "
            f"steps of up to {float(prices.max()):.3g}"
        )
    return units


def _octile(first: Cell, second: Cell) -> float:
    """Return the octile distance of two cells, in cells."""
    rows, cols = abs(first[0] - second[0]), abs(first[1] - second[1])
    return max(rows, cols) + (math.sqrt(2) - 1) * min(rows, cols)
