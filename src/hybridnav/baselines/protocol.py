"""What the harness asks of every method: two layers on one map, and answers to queries."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from hybridnav._typing import IntArray, LongArray

Cell = tuple[int, int]


@dataclass(frozen=True, eq=False)
class Answer:
    """A method's answer to one query."""

    cells: LongArray | None
    """int64 (n, 2), the path as (row, col) from start to goal, legal moves of the octile grid; None
    where the method found none."""
    nodes: tuple[int, ...] | None = None
    """The topological plan: labels of `Method.region_of` in the order passed, the start's first;
    None where the method has no topological layer or made no plan. A plan without a path
    (`cells` None) contradicts consistency, and the harness says so."""
    arcs: tuple[int, ...] | None = None
    """Dense ids of the edges between those nodes, where the method's edges have ids."""
    plan_steps: int | None = None
    """Edges of the topological search's own path, in the graph that `n_nodes` counts; None where
    that is the way from node to node of `nodes`."""
    bound: float = math.inf
    """Proved: the path is at most `bound` times as long as the shortest; infinite for no proof."""
    expanded: int = 0
    """Cells expanded by the metric layer."""
    expanded_nodes: int = 0
    """Nodes expanded by the topological layer."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall-clock seconds by stage: `coarse` for the topological search, `refine` for the metric."""


class Method(Protocol):
    """One method prepared for one map. Preparation happens when it is made."""

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
