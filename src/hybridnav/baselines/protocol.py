"""The protocol of methods in the harness: two layers on one map, and answers to queries."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, IntArray, LongArray

Cell = tuple[int, int]

CUT_CORNERS = "moves past corners are not in its graph"
"""Reason of a method to give up where corners may be cut, if sides alone join its nodes."""


@dataclass(frozen=True, eq=False)
class AnyAngleResult:
    """A path at any angle, with the claims of its method.

    Examples
    --------
    >>> from hybridnav.baselines import AnyAngleResult
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
    """float64 (n,), the direction of travel at each point: from one to the next the path is the arc
    of a circle tangent to both, a line if they are equal. None for lines alone."""
    by_grid: bool | None = None
    """Whether the method found nothing itself and this is the shortened path of the grid; None if a
    method has no such fallback."""


@dataclass(frozen=True)
class CostClaim:
    """What a method that plans by costs claims about the cost of its path.

    Examples
    --------
    >>> from hybridnav.baselines import CostClaim, MethodResult
    >>> MethodResult(np.array([[0, 0], [0, 1]]), by_costs=CostClaim(1.5, 1.5)).by_costs.cost_m
    1.5
    """

    cost_m: float
    """Cost of the path: the integral of the factors along it, in metres. Arcs may be priced along
    chords of a quarter of a cell."""
    lower_bound_m: float = 0.0
    """Proved lower bound on the costs of all paths of cells, or, beside an `any_angle` path, of all
    any-angle paths, in metres."""
    grid_bound_m: float | None = None
    """Proved lower bound on the costs of all paths of cells, beside an `any_angle` path, which may
    cost less; None for none."""


@dataclass(frozen=True, eq=False)
class MethodResult:
    """A method's answer to one query.

    Examples
    --------
    >>> from hybridnav.baselines import MethodResult
    >>> MethodResult(cells=np.array([[0, 0], [0, 1]]), expanded=2).is_path
    True
    """

    cells: LongArray | None
    """int64 (n, 2), the path as (row, col) from start to goal, legal moves of the octile grid; None
    if the method found none, or an `any_angle` one."""
    nodes: tuple[int, ...] | None = None
    """The topological plan: labels of `Method.region_of` in the order passed, the start's first;
    None if the method has no topological layer or made no plan. A plan without a path contradicts
    consistency, which the harness reports unless the method `gave_up`."""
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
    expanded_border_cells: int = 0
    """Border cells expanded by a search over tables of distances between them."""
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

    @property
    def is_path(self) -> bool:
        """Whether there is a path, of cells or at any angle."""
        return self.cells is not None or self.any_angle is not None


class Method(Protocol):
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
