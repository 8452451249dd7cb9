"""Planning on the grid alone: A*, Dijkstra, weighted A*."""

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.moves import legal_moves, length_in_cells, path_length_in_cells, trace
from hybridnav._base.threads import Pool
from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.harness.baselines import kernels as _kernels
from hybridnav.harness.baselines.regions import Cell, CostClaim, MethodResult, array_bytes
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.costs import CostLayer
from hybridnav.search.grid_search import GridSearch


class GridAstar:
    """A* on all free cells, the reference of every comparison: its paths are shortest.

    P. E. Hart, N. J. Nilsson, B. Raphael: A formal basis for the heuristic determination of minimum
    cost paths, 1968.

    `grid`: the map; free cells are entered, all others not; `costs`: costs of its cells, by which
    paths are cheapest; None for lengths.
    """

    def __init__(self, grid: OccupancyGrid, *, costs: CostLayer | None = None) -> None:
        self.name = "grid-astar"
        self.region_of: IntArray | None = None
        self._costs, self._resolution_m = costs, grid.resolution_m
        enterable = grid.classes == CellClass.FREE
        units = None if costs is None else costs.units
        self._search = GridSearch(enterable, corner_cutting=grid.corner_cutting, units=units)
        moves = legal_moves(enterable, grid.corner_cutting)
        self.n_nodes, self.n_edges = _graph_size(enterable, moves)
        self.memory_bytes = self._search.memory_bytes

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Find a shortest path between two free cells, or a cheapest one; the bound is its own."""
        began = clock()
        answer = self._search.search(start, goal)
        seconds = {"refine": clock() - began}
        if self._costs is not None and answer.cells is not None:
            cost_m = self._costs.cost_of_cells(answer.cells) * self._resolution_m
            claim = CostClaim(cost_m, cost_m)
            return MethodResult(
                answer.cells, by_costs=claim, expanded=answer.expanded, seconds=seconds
            )
        bound = math.inf if answer.cells is None else 1.0
        return MethodResult(answer.cells, bound=bound, expanded=answer.expanded, seconds=seconds)


class GridDijkstra:
    """Dijkstra's algorithm on all free cells, up to the goal.

    E. W. Dijkstra: A note on two problems in connexion with graphs, 1959. Open cells are kept in
    buckets as wide as a straight step (E. A. Dinic, 1978), so that some cells in the goal's own
    bucket are expanded, some not.

    `grid`: the map; free cells are entered, all others not.
    """

    def __init__(self, grid: OccupancyGrid) -> None:
        self.name = "grid-dijkstra"
        self.region_of: IntArray | None = None
        self._works, (self.n_nodes, self.n_edges) = _workspaces(grid)
        with self._works.lent() as work:
            self.memory_bytes = array_bytes(work)

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Find a shortest path between two free cells; the bound is 1."""
        began = clock()
        with self._works.lent() as work:
            has_path, expanded = work.search(_kernels.dijkstra, start, goal)
            cells = work.path(start, goal) if has_path else None
        seconds = {"refine": clock() - began}
        bound = 1.0 if has_path else math.inf
        return MethodResult(cells, bound=bound, expanded=expanded, seconds=seconds)


class WeightedAstar:
    """Weighted A* on all free cells: no cell is expanded twice.

    The path is at most `weight` times as long as the shortest, because the octile distance is a
    consistent estimate.

    I. Pohl: Heuristic search viewed as path finding in a graph, 1970. The bound of an answer is the
    weight or, if it is less, the path's length over the least g + h of the cells that were still
    open or would have had to be expanded again (E. A. Hansen, R. Zhou: Anytime heuristic search,
    2007; M. Likhachev, G. Gordon, S. Thrun: ARA*, 2003).

    `grid`: the map; free cells are entered, all others not; `weight`: factor on the estimate, >= 1.
    Raises `InvalidValueError` when the weight is less than 1 or not finite.
    """

    def __init__(self, grid: OccupancyGrid, *, weight: float = 1.5) -> None:
        if not (math.isfinite(weight) and weight >= 1):
            raise InvalidValueError(f"weight must be a finite number >= 1, got {weight}")
        self.name = f"weighted-astar-{weight:g}"
        self.region_of: IntArray | None = None
        self._weight = float(weight)
        self._works, (self.n_nodes, self.n_edges) = _workspaces(grid)
        with self._works.lent() as work:
            self.memory_bytes = array_bytes(work)

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Find a path between two free cells, with a proved bound on its excess over the
        shortest."""
        began = clock()
        with self._works.lent() as work:
            lower, expanded = work.search(_kernels.weighted_astar, start, goal, self._weight)
            cells = work.path(start, goal) if lower >= 0 else None
        bound = math.inf if cells is None else self._bound(cells, lower)
        seconds = {"refine": clock() - began}
        return MethodResult(cells, bound=bound, expanded=expanded, seconds=seconds)

    def _bound(self, cells: LongArray, lower: int) -> float:
        """Return the weight, or a lower bound that the search proved."""
        if lower == 0:
            return 1.0
        ratio = path_length_in_cells(cells) / float(length_in_cells(lower))
        return max(1.0, min(self._weight, ratio))


class _Workspace:
    """Legal moves of a grid and the arrays of one search at a time: 18 bytes a cell.

    Searches differ by their generation, so nothing is cleared between them.
    """

    def __init__(self, moves: ByteArray, cols: int) -> None:
        self._cols = cols
        self._moves = moves
        self._cost_of = np.zeros(moves.size, dtype=np.int64)
        self._came = np.zeros(moves.size, dtype=np.uint8)
        self._mark = np.zeros(moves.size, dtype=np.int64)
        self._generation = 0

    def search(
        self, kernel: Callable[..., Any], start: Cell, goal: Cell, *parameters: float
    ) -> tuple[int, int]:
        """Return a kernel's result for the path between two cells, and the cells expanded."""
        self._generation += 1
        said, expanded = kernel(
            self._moves,
            self._cols,
            self._flat(start),
            self._flat(goal),
            *parameters,
            self._cost_of,
            self._came,
            self._mark,
            self._generation,
        )
        return int(said), int(expanded)

    def path(self, start: Cell, goal: Cell) -> LongArray:
        """Return the cells of the path of the last search."""
        flat = trace(self._came, self._cols, self._flat(start), self._flat(goal))
        return np.stack(divmod(flat, self._cols), axis=1)

    def _flat(self, cell: Cell) -> int:
        return cell[0] * self._cols + cell[1]


def _workspaces(grid: OccupancyGrid) -> tuple[Pool[_Workspace], tuple[int, int]]:
    """Return work space for searches of the free cells, and the numbers of cells and moves."""
    enterable = grid.classes == CellClass.FREE
    moves: ByteArray = legal_moves(enterable, grid.corner_cutting)
    works = Pool(partial(_Workspace, moves.ravel(), grid.shape[1]))
    return works, _graph_size(enterable, moves)


def _graph_size(enterable: BoolArray, moves: ByteArray) -> tuple[int, int]:
    """Return the number of enterable cells, and of moves between them, both directions counted
    once."""
    return int(enterable.sum()), int(np.bitwise_count(moves).sum(dtype=np.int64)) // 2
