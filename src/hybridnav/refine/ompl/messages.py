"""Messages between the planner's process and the worker."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.config import OmplSettings
    from hybridnav.grid import OccupancyGrid

ReplyStatus = Literal["solved", "approximate", "timeout"]


SEARCH_S = 60.0
"""Seconds beyond its time that a query with the trees of the search may take."""


@dataclass(frozen=True, eq=False)
class Setup:
    """Setup of a worker, sent once."""

    grid: OccupancyGrid
    field_of: NDArray[np.int16 | np.int32] | None
    """int16 or int32 (rows, cols), the field of each cell, -1 for none; None if the whole map is
    the corridor."""
    settings: OmplSettings
    allow_unexplored: bool


@dataclass(frozen=True, eq=False)
class Query:
    """One problem."""

    start: FloatArray
    """float64 (3,), x and y in metres, heading in radians; map frame."""
    goal: FloatArray
    cells: LongArray
    """int64 (n, 2), a legal path of cells from the cell of the start to that of the goal."""
    deadline_s: float
    """Time of `time.monotonic`, which all processes share, at which the query ends."""
    corridors: tuple[tuple[str, BoolArray | None], ...]
    """Names of the corridors to try, one after the other, and the fields of each, bool (n_fields,);
    None for the whole map."""
    closed: LongArray | None = None
    """int64 (m,), flat cells that may not be entered."""
    tells_search: bool = False
    """Whether to return states and trees of the search too."""


@dataclass(eq=False)
class Search:
    """States and motions of a search, for pictures."""

    states: list[tuple[float, float]] = field(default_factory=list)
    """States that were found valid, map frame."""
    edges: list[tuple[float, float, float, float]] = field(default_factory=list)
    """Motions of the trees or roadmaps."""


@dataclass(frozen=True, eq=False)
class Reply:
    """Result of a query; a worker may send several for one query, each better than the last."""

    outcome: ReplyStatus
    points: FloatArray
    """float64 (n, 3), states of the path in order; an approximate path does not end at the goal.
    Shape (0, 3) if there is no path."""
    cost: float
    """Cost of the path by the objective, in metres if that is the length."""
    length_m: float = 0.0
    """Length of the path of the robot's base."""
    bound_m: float = 0.0
    """No path is shorter: the length without obstacles."""
    steps: tuple[str, ...] = ()
    """Attempts and their outcomes, in order."""
    trace: tuple[tuple[float, float], ...] = ()
    """Seconds since the query arrived and cost, of each better path."""
    iterations: int = 0
    """Iterations of planners and simplification."""
    is_last: bool = True
    search: Search | None = None


@dataclass(frozen=True, eq=False)
class Failure:
    """Reason for a search that broke off; its earlier replies count."""

    reason: str
    """One line."""


def without_answer() -> Reply:
    """Return the reply for a worker that sent none."""
    return Reply("timeout", np.empty((0, 3)), np.inf)


def ended(best: Reply, reason: str) -> Reply:
    """Return the best reply of a search that was ended for a reason."""
    return replace(best, steps=(*best.steps, reason), is_last=True)
