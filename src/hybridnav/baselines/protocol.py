"""What the harness asks of every method: two layers on one map, and answers to queries."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray, IntArray, LongArray

Cell = tuple[int, int]

CUT_CORNERS = "moves past corners are not in its graph"
"""Why a method whose nodes are joined by sides alone gives up where corners may be cut."""


@dataclass(frozen=True, eq=False)
class Line:
    """A path at any angle, and what its method says of it."""

    points: FloatArray
    """float64 (n, 2), (x, y) in metres, map frame, from the centre of the start's cell to that of
    the goal's."""
    length_m: float
    """Length in metres."""
    lower_bound_m: float = 0.0
    """Proved: no any-angle path is shorter, metres."""
    by_grid: bool | None = None
    """Whether the method found nothing itself and this is the grid's path, shortened; None where a
    method has no such way out."""


@dataclass(frozen=True, eq=False)
class Answer:
    """A method's answer to one query."""

    cells: LongArray | None
    """int64 (n, 2), the path as (row, col) from start to goal, legal moves of the octile grid; None
    where the method found none, or a `line`."""
    nodes: tuple[int, ...] | None = None
    """The topological plan: labels of `Method.region_of` in the order passed, the start's first;
    None where the method has no topological layer or made no plan. A plan without a path
    contradicts consistency, and the harness says so, unless the method `gave_up`."""
    arcs: tuple[int, ...] | None = None
    """Dense ids of the edges between those nodes, where the method's edges have ids."""
    plan_steps: int | None = None
    """Edges of the topological search's own path, in the graph that `n_nodes` counts; None where
    that is the way from node to node of `nodes`."""
    bound: float = math.inf
    """Proved: the path of cells is at most `bound` times as long as the shortest; infinite for no
    proof."""
    expanded: int = 0
    """Cells expanded by the metric layer."""
    expanded_nodes: int = 0
    """Nodes expanded by the topological layer."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall-clock seconds by stage: `coarse` for the topological search, `refine` for the metric;
    `first path` until a planner that improves its path had one."""
    line: Line | None = None
    """The path, where it is none of cells."""
    gave_up: str = ""
    """Why there is no path and no claim that there is none, such as "timeout"."""

    @property
    def is_path(self) -> bool:
        """Whether there is a path, of cells or at any angle."""
        return self.cells is not None or self.line is not None


class Method(Protocol):
    """One method prepared for one map. Preparation happens when it is made; where it has a `close`,
    that is called when no more is asked."""

    @property
    def name(self) -> str:
        """What tables call it."""
        ...

    @property
    def region_of(self) -> IntArray | None:
        """int32 (rows, cols), the region of each cell, -1 for none; None without regions."""
        ...

    @property
    def n_nodes(self) -> int:
        """Nodes of the topological layer; of a pure grid method, its enterable cells."""
        ...

    @property
    def n_edges(self) -> int:
        """Edges of the topological layer, directed ones counted once."""
        ...

    @property
    def memory_bytes(self) -> int:
        """What it holds beyond the map's own classes, as the sum of its arrays."""
        ...

    def solve(self, start: Cell, goal: Cell) -> Answer:
        """Plan between two free cells."""
        ...
