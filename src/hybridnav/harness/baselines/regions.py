"""Planning on regions: a coarse search on their graph, then the best path inside them. Public:
`AnyAngleResult`, `CostClaim`, `MethodResult` and `Solver`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.copies import copies_alike
from hybridnav._base.rows import unique_rows
from hybridnav._base.typing import FloatArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass
from hybridnav.pyramid import Level
from hybridnav.route.coarse import ArcSearch, Beside, along
from hybridnav.search.grid_search import GridSearch
from hybridnav.topology import TopologicalMap


@copies_alike
class RegionPlanner:
    """A coarse search on a graph of regions, then grid A* on the cells of the route's regions.

    `region_of`: int32 (rows, cols), the region of each free cell, -1 elsewhere; `corner_cutting`:
    whether diagonals may cut corners; `joined`: int (n, 2), the arcs by which regions beside a
    route belong to its corridor, as those of the preset `paper` do; None for the regions of the
    route alone.
    """

    def __init__(
        self,
        region_of: IntArray,
        graph: ArcSearch,
        *,
        corner_cutting: bool = False,
        joined: IntArray | None = None,
    ) -> None:
        self._region_of = region_of
        self._graph = graph
        self._joined = np.empty((0, 2), dtype=np.int32) if joined is None else joined
        self._beside: Beside = "route" if joined is None else "joined"
        self._grid_search = GridSearch(region_of >= 0, corner_cutting=corner_cutting)
        self.memory_bytes = array_bytes(self, graph) + self._grid_search.memory_bytes

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells.

        Raises `InvalidValueError` when a cell lies outside the map or is not free.
        """
        first = region_at(self._region_of, start)
        last = region_at(self._region_of, goal)
        began = clock()
        plan = self._graph.search(first, last)
        seconds = {"coarse": clock() - began}
        if plan.vertices is None:
            return MethodResult(None, expanded_nodes=plan.expanded, seconds=seconds)
        began = clock()
        in_corridor = along(self._joined, plan.vertices, self._beside, self._graph.allowed)
        answer = self._grid_search.search(
            start, goal, field_of=self._region_of, in_corridor=in_corridor
        )
        seconds["refine"] = clock() - began
        return MethodResult(
            answer.cells,
            nodes=tuple(plan.vertices.tolist()),
            expanded=answer.expanded,
            expanded_nodes=plan.expanded,
            seconds=seconds,
        )


def array_bytes(*holders: object) -> int:
    """Return the bytes of arrays in attributes of objects; an array and its views count once."""
    held = (value for holder in holders for value in vars(holder).values())
    arrays = (value for value in held if isinstance(value, np.ndarray))
    return sum({array.ctypes.data: array.nbytes for array in arrays}.values())


def free_fields(topology: TopologicalMap) -> IntArray:
    """Return the dense index of each free cell's place, int32 (rows, cols), -1 elsewhere;
    read-only."""
    free = topology.grid.classes == CellClass.FREE
    region_of: IntArray = np.where(free, topology.level.field_of, np.int32(-1))
    region_of.flags.writeable = False
    return region_of


def region_at(region_of: IntArray, cell: Cell) -> int:
    """Return the region of a free cell.

    Raises `InvalidValueError` when the cell lies outside the map or is not free.
    """
    rows, cols = region_of.shape
    row, col = cell
    region = int(region_of[row, col]) if 0 <= row < rows and 0 <= col < cols else -1
    if region < 0:
        raise InvalidValueError(
            f"expected a free cell (row, col) of a map of {rows} x {cols} cells, got ({row}, {col})"
        )
    return region


# The protocol of methods in the harness: two layers on one map, and answers to queries.

Cell = tuple[int, int]

CUT_CORNERS = "moves past corners are not in its graph"
"""Reason of a method to give up where corners may be cut, if sides alone join its nodes."""


@dataclass(frozen=True, eq=False)
class AnyAngleResult:
    """A path at any angle, with the claims of its method.

    Examples
    --------
    >>> from hybridnav.harness.baselines import AnyAngleResult
    >>> line = AnyAngleResult(points=np.array([[0.5, 0.5], [2.5, 0.5]]), length_m=2.0)
    >>> line.lower_bound_m
    0.0
    """

    points: FloatArray
    """float64 (n, 2), (x, y) in metres, map frame, from the centre of the start's cell to that of
    the goal's cell."""
    length_m: float
    """Length in metres."""
    lower_bound_m: float = 0.0
    """Proved lower bound on all any-angle paths, in metres."""
    headings_rad: FloatArray | None = None
    """float64 (n,), the direction of travel at each point. From one to the next the path is the arc
    of a circle tangent to both, a line if they are equal. None for lines alone."""
    by_grid: bool | None = None
    """Whether the method found nothing itself and this is the shortened path of the grid; None if a
    method has no such fallback."""


@dataclass(frozen=True)
class CostClaim:
    """Claims of a method that plans by costs about the cost of its path.

    Examples
    --------
    >>> from hybridnav.harness.baselines import CostClaim, MethodResult
    >>> MethodResult(np.array([[0, 0], [0, 1]]), by_costs=CostClaim(1.5, 1.5)).by_costs.cost_m
    1.5
    """

    cost_m: float
    """Cost of the path: the integral of the factors along it, in metres. Arcs may be priced along
    chords of a quarter of a cell."""
    lower_bound_m: float | Callable[[], float] = 0.0
    """Proved lower bound in metres on the costs of all paths of cells, or, beside an `any_angle`
    path, of all any-angle paths. It may be a function, whose time is no part of planning."""
    grid_bound_m: float | None = None
    """Proved lower bound on the costs of all paths of cells, beside an `any_angle` path, which may
    cost less; None for none."""


@dataclass(frozen=True, eq=False)
class MethodResult:
    """A method's answer to one query.

    Examples
    --------
    >>> from hybridnav.harness.baselines import MethodResult
    >>> MethodResult(cells=np.array([[0, 0], [0, 1]]), expanded=2).is_path
    True
    """

    cells: LongArray | None
    """int64 (n, 2), the path as (row, col) from start to goal, legal moves of the octile grid; None
    if the method found none, or an `any_angle` one."""
    nodes: tuple[int, ...] | None = None
    """The topological plan: labels of `Solver.region_of` in the order passed, the start's first;
    None if the method has no topological layer or made no plan. Without a path they are the whole
    answer: the harness checks that they are a route, and measures what it loses."""
    arcs: tuple[int, ...] | None = None
    """Dense ids of the edges between those nodes, if the method's edges have ids."""
    plan_steps: int | None = None
    """Edges of the topological search's own path, in the graph that `n_nodes` counts; None if that
    is the path from node to node of `nodes`."""
    bound: float = math.inf
    """Proved factor: the path of cells is at most `bound` times as long as the shortest; infinite
    for no proof. It is about lengths: claims about costs are in `by_costs`."""
    expanded: int = 0
    """Cells expanded by the metric layer."""
    expanded_nodes: int = 0
    """Nodes expanded by the topological layer."""
    expanded_intervals: int = 0
    """Intervals expanded by a search on a mesh."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall-clock seconds by stage: `coarse` for the topological search, `refine` for the metric
    one; `first path` until the first path of a planner that improves its path."""
    any_angle: AnyAngleResult | None = None
    """The path, if it is not one of cells."""
    by_costs: CostClaim | None = None
    """Claims about the cost of the path; None if the method planned by lengths."""
    gave_up: str = ""
    """Reason for no path and no claim that none exists, such as "timeout"."""
    proof: dict[str, Any] | None = None
    """A proof of the answer, which `check_proof` checks; see `PlanResult.proof`. None for none."""

    @property
    def is_path(self) -> bool:
        """Whether there is a path, of cells or at any angle."""
        return self.cells is not None or self.any_angle is not None


class Solver(Protocol):
    """One method prepared for one map.

    A method that cannot take a map, by a limit of its own, raises `UnsuitableMapError` in its
    construction: it is then not asked there. Its texts `version` and `settings`, if there are any,
    are shown in the table of methods.

    Its construction prepares it; its `close`, if there is one, is called after the last query. If
    its constructor has a parameter `costs`, it is called with `costs=layer` in a run with costs,
    where cells that the layer closes are occupied. Other methods are made as in any run, and what
    they find is judged by the cost of their paths.
    """

    @property
    def name(self) -> str:
        """Name of the method in tables."""
        ...

    @property
    def region_of(self) -> IntArray | None:
        """int32 (rows, cols), the region of each cell, -1 for none; None without regions."""
        ...

    @property
    def n_nodes(self) -> int:
        """Number of nodes of the topological layer; for a pure grid method, of enterable cells."""
        ...

    @property
    def n_edges(self) -> int:
        """Number of edges of the topological layer, directed ones counted once."""
        ...

    @property
    def memory_bytes(self) -> int:
        """Bytes of all arrays of the method, beyond the map's own classes."""
        ...

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells."""
        ...


# The pyramid's places on a simple graph: parallel arcs merged, self-loops dropped.


@copies_alike
class SimpleGraphPyramid:
    """The topological map reduced to a simple graph: two places share at most one edge.

    Regular and irregular pyramids of simple graphs (P. Meer: Stochastic image pyramids, 1989; J.-M.
    Jolion, A. Montanvert: The adaptive pyramid, 1992) keep one edge for two regions with any number
    of common boundaries. The places are those of the topological map. An edge costs the
    `max_distance_m` of its arcs, which is the same for all of them; ties are decided by the
    `through_m` of the arc with the lowest index, since a simple graph keeps the first arc that it
    meets and ignores the others. (`Level.to_simple_graph` is kinder: it keeps the shortest.) The
    path is the shortest inside the fields of the route and of the places that its edges join to it,
    as with the preset `paper`. If corners may be cut, a missing route proves nothing, and the
    method gives up.

    `topology`: the map whose free places are planned on.
    """

    def __init__(self, topology: TopologicalMap) -> None:
        level = topology.level
        free = level.classes == CellClass.FREE
        kept = first_arcs(level)
        kept = kept[free[level.arcs[kept]].all(axis=1)]  # arcs join places of two classes, too
        self.name = "simple-graph"
        self.region_of: IntArray = free_fields(topology)
        self.n_nodes = int(free.sum())
        self.n_edges = len(kept)
        graph = ArcSearch(free, level.arcs, level.max_distance_m, level.through_m, kept=kept)
        self._corner_cutting = topology.grid.corner_cutting
        self._planner = RegionPlanner(
            self.region_of, graph, corner_cutting=self._corner_cutting, joined=level.arcs[kept]
        )
        self.memory_bytes = self._planner.memory_bytes

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        """Plan between two free cells; nodes are dense indices of places. See `RegionPlanner`."""
        answer = self._planner.solve(start, goal)
        if self._corner_cutting and not answer.is_path:
            return replace(answer, gave_up=CUT_CORNERS)
        return answer


def first_arcs(level: Level) -> LongArray:
    """Return the arcs that a simple graph keeps, the lowest index between each two vertices."""
    plain = np.flatnonzero(~level.is_self_loop)
    endpoints = np.sort(level.arcs[plain], axis=1)
    first = unique_rows(endpoints).first
    return np.sort(plain[first])
