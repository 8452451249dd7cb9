"""What the planner's process and the worker tell each other."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.config import OmplSettings
    from hybridnav.grid import OccupancyGrid

Outcome = Literal["solved", "approximate", "timeout"]


SEARCH_S = 60.0
"""Seconds beyond its time that a query may take where the trees of the search are wanted too."""


@dataclass(frozen=True, eq=False)
class Setup:
    """What a worker is told once."""

    grid: OccupancyGrid
    field_of: NDArray[np.int16 | np.int32] | None
    """int16 or int32 (rows, cols), the field of each cell, -1 for none; None where the whole map is
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
    """int64 (n, 2), a legal path of cells from the start's to the goal's."""
    deadline_s: float
    """When the time is over, by `time.monotonic`, which all processes share."""
    corridors: tuple[tuple[str, BoolArray | None], ...]
    """Names of the corridors to try, one after the other, and the fields of each, bool (n_fields,);
    None for the whole map."""
    closed: LongArray | None = None
    """int64 (m,), flat cells that may not be entered."""
    tells_search: bool = False
    """Whether states and trees of the search are wanted too."""


@dataclass(eq=False)
class Search:
    """What a search looked at, for pictures."""

    states: list[tuple[float, float]] = field(default_factory=list)
    """States that were found valid, map frame."""
    edges: list[tuple[float, float, float, float]] = field(default_factory=list)
    """Motions of the trees or roadmaps."""


@dataclass(frozen=True, eq=False)
class Reply:
    """What came out; a worker may send several for one query, each better than the one before."""

    outcome: Outcome
    points: FloatArray
    """float64 (n, 3), states of the path in order; of an approximate one it ends elsewhere than at
    the goal. None, shape (0, 3), where there is no path."""
    cost: float
    """Its cost by the objective, metres where that is the length."""
    length_m: float = 0.0
    """What the robot's base covers."""
    bound_m: float = 0.0
    """No path is shorter: the length without obstacles."""
    steps: tuple[str, ...] = ()
    """What was tried, and how it ended, in order."""
    trace: tuple[tuple[float, float], ...] = ()
    """Seconds since the query arrived and cost, of each better path."""
    iterations: int = 0
    """Iterations of planners and simplification."""
    is_last: bool = True
    search: Search | None = None


@dataclass(frozen=True, eq=False)
class Failure:
    """What ended a search that found no end of its own; what it sent before counts."""

    reason: str
    """One line."""


def without_answer() -> Reply:
    """The reply of a worker from which none came."""
    return Reply("timeout", np.empty((0, 3)), np.inf)


def ended(best: Reply, reason: str) -> Reply:
    """The best reply of a search that something else ended."""
    return replace(best, steps=(*best.steps, reason), is_last=True)
