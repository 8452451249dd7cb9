"""One query in, one value out: what every search method is asked, and what it answers.

All lengths, costs and bounds are in metres, so that nobody has to know how a method counts.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

import numpy as np

from hybridnav._base.copies import Source, made
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.trig import dist
from hybridnav._base.typing import BoolArray, FloatArray, LongArray

if TYPE_CHECKING:
    from hybridnav.maps import OccupancyGrid
    from hybridnav.maps.cells import Box
    from hybridnav.maps.costs import CostLayer
    from hybridnav.route.route import Route
    from hybridnav.search.directed import DirectedSides
    from hybridnav.search.distance_table import LabelSource
    from hybridnav.topology import TopologicalMap

Cell = tuple[int, int]
Position = tuple[float, float]
Pose = tuple[float, ...]
Metric = Literal["octile", "weighted", "any-angle", "any-angle-weighted", "dubins", "reeds-shepp"]
"""What a path is judged by: the kind of its length, or of its cost."""


class PlanStatus(str, Enum):
    """Outcome of a plan, as a value, not an error.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> print(hn.HybridPlanner(topology).plan((-1.0, 0.0), (0.5, 0.5)).status)
    start outside the map
    """

    SOLVED = "solved"
    START_OUTSIDE = "start outside the map"
    GOAL_OUTSIDE = "goal outside the map"
    START_OCCUPIED = "start occupied"
    GOAL_OCCUPIED = "goal occupied"
    START_UNEXPLORED = "start unexplored"
    GOAL_UNEXPLORED = "goal unexplored"
    START_BLOCKED = "start blocked"
    GOAL_BLOCKED = "goal blocked"
    NO_PATH = "no path"
    APPROXIMATE = "approximate"
    """A sampling-based planner came near the goal but did not reach it."""
    NEAR_GOAL = "near the goal"
    """The goal cannot be reached, and the path ends at the nearest point that can be, as asked for
    by `within_m`."""
    TIMEOUT = "timeout"
    """A sampling-based planner found nothing in its time."""

    __str__ = str.__str__


@dataclass(frozen=True)
class PlanStats:
    """Effort of a query."""

    expanded: int = 0
    """Number of cells that the refiner expanded, or nodes of the lattice."""
    expanded_places: int = 0
    """Number of places that the coarse search expanded, with the fields below them in a descent."""
    expanded_intervals: int = 0
    """Number of intervals that the search on the mesh expanded."""
    corridor_cells: int = 0
    """Number of cells in the corridor; 0 for the whole map. A descent counts the cells of the last
    fields that its route passes."""
    seconds: dict[str, float] = field(default_factory=dict)
    """Wall-clock seconds per stage."""


@dataclass(frozen=True, eq=False)
class ClosedCells:
    """The closed cells of one map, computed once for several queries."""

    flat: LongArray
    """int64 (n,), flat cells, sorted, each once."""
    solid: LongArray | None = None
    """int64 (m,), flat cells that no part of a footprint may meet; None for none. Discs are kept
    off by the closed cells alone."""
    one_way: DirectedSides | None = None
    """Sides that may be crossed in one direction only; None for none."""

    def holds(self, flat: LongArray) -> BoolArray:
        """Return which of some flat cells are closed."""
        if not len(self.flat):
            return np.zeros(len(flat), dtype=np.bool_)
        at = np.minimum(np.searchsorted(self.flat, flat), len(self.flat) - 1)
        return self.flat[at] == flat

    def __or__(self, other: ClosedCells) -> ClosedCells:
        """Return what either closes."""
        solids = [each.solid for each in (self, other) if each.solid is not None]
        solid = np.unique(np.concatenate(solids)) if solids else None
        one, two = self.one_way, other.one_way
        one_way = one | two if one and two and one is not two else one or two
        return ClosedCells(np.union1d(self.flat, other.flat), solid, one_way)

    def meets(self, cells: LongArray, grid: OccupancyGrid) -> bool:
        """Return whether a path stands on a closed cell, illegally passes one on a diagonal, or
        crosses a side the wrong way.

        `cells`: int64 (n, 2), legal moves; `grid`: the map; if its corners may be cut, diagonals
        need no side cells.
        """
        if self.one_way is not None and self.one_way.meets(cells):
            return True
        if not len(self.flat):
            return False
        cols = grid.shape[1]
        flat = cells[:, 0] * cols + cells[:, 1]
        if not grid.corner_cutting:
            side_cells = cells[:-1, 0] * cols + cells[1:, 1], cells[1:, 0] * cols + cells[:-1, 1]
            flat = np.concatenate([flat, *side_cells])
        return bool(self.holds(flat).any())


class KeptLine(NamedTuple):
    """A line that an answer stays on while it may be driven, and costs little more than another."""

    points: FloatArray
    """float64 (n, 2), n >= 2, `(x, y)` in metres, map frame, to the goal."""
    within: float
    """Most that it may cost more, as a part of the cost of the other."""
    cells: LongArray | None = None
    """int64 (n, 2), the cells of a path of cells, (row, col); None of others."""


class Query(NamedTuple):
    """One query: two cells that may be entered, points in them, and what is closed for it. Searches
    need no more than the first three; the planner reads the rest from its caller."""

    cells: tuple[Cell, Cell]
    """Start and goal, (row, col); (0, 0) for one outside the map."""
    points: tuple[FloatArray, FloatArray]
    """float64 (2,) each, start and goal, `(x, y)` in metres, map frame."""
    closed: ClosedCells | None = None
    """Closed cells, not including start and goal; None for none."""
    kept: KeptLine | None = None
    """The line to stay on; None for none."""
    positions: tuple[Position, Position] | None = None
    """The points as (row, col) in grid units; None where nobody has found them yet."""
    refused: PlanStatus | None = None
    """Why start or goal is none, so that no search is asked; None if both may be entered."""
    poses: tuple[Pose, Pose] = ((), ())
    """Start and goal as planned between, `(x, y)` or `(x, y, yaw)` each, metres and radians, map
    frame; empty where a search alone is asked."""
    goal_name: str | None = None
    """The name by which the goal was given; None for a point."""
    began: float = 0.0
    """The time at which reading began, of `clock`."""

    @property
    def one_way(self) -> DirectedSides | None:
        """Sides that may be crossed in one direction only; None for none."""
        return None if self.closed is None else self.closed.one_way

    @property
    def straight_m(self) -> float:
        """Distance of the points, a bound on the length of every path."""
        return dist(*self.points)


class QueryMany(NamedTuple):
    """Many queries with the same closures, arrays of n."""

    cells: tuple[LongArray, LongArray]
    """int64 (n, 2) each, the cells of the starts, and of the goals; they may be entered."""
    points: tuple[FloatArray, FloatArray]
    """float64 (n, 2) each, starts and goals, `(x, y)` in metres, map frame."""
    closed: ClosedCells | None = None
    """Closed cells; a start or a goal may be one. None for none."""


@dataclass(frozen=True, eq=False)
class Found:
    """The answer to one query: a path with its cost and bound, or the proof that there is none."""

    cells_source: Source[LongArray] | None
    """The cells of the path, or how to find them; None without a path."""
    cost_source: Source[float] = math.inf
    """Length or cost in the metric of the method, metres, or how to find it; infinite without a
    path."""
    lower_bound_m: float = math.inf
    """Proved bound on the cost of all paths; infinite where it is proved that there is none."""
    points: FloatArray | None = None
    """float64 (m, 2), centres of the cells if known already, or where an any-angle path turns."""
    route_source: Source[Route] | None = None
    """The route that was chosen before the path, or how to name it; None to derive it from the
    path."""
    optimum: Callable[[], float] | None = None
    """How to find the least cost of all paths of cells, metres, for those who read a gap; None
    where `lower_bound_m` is all that is known."""
    stats: PlanStats = field(default_factory=PlanStats)
    proof: dict[str, Any] | None = None
    """A proof of the answer, for the harness; see `PlanResult.proof`. None for none."""
    measured_m: float | None = None
    """Length of the lines between `points`; None to have them measured when they are read."""

    @property
    def has_path(self) -> bool:
        """Whether there is a path."""
        return self.cells_source is not None

    @cached_property
    def cost_m(self) -> float:
        """Length or cost in the metric of the method, metres; infinite without a path."""
        return made(self.cost_source)

    @cached_property
    def cells(self) -> LongArray:
        """int64 (n, 2), legal moves from start to goal; only of an answer with a path."""
        assert self.cells_source is not None  # noqa: S101 - the caller has looked
        return made(self.cells_source)


@dataclass(frozen=True, eq=False)
class FoundMany:
    """Answers to many queries, arrays of n."""

    is_done: BoolArray
    """bool (n,), whether the answer is that of `find`; False if `find` must still be called."""
    cost_m: FloatArray
    """float64 (n,), infinite if there is no path."""
    lower_bound_m: FloatArray
    path_start: LongArray
    """int64 (n + 1,), offsets of the points of each path."""
    points: FloatArray
    """float64 (m, 2), (x, y) in metres, map frame."""


class MapChange(NamedTuple):
    """A map after its cells changed."""

    grid: OccupancyGrid
    """The map now."""
    topology: TopologicalMap | None
    """Its places; None if they are not built."""
    costs: CostLayer | None
    """Its costs; None for lengths."""
    cells: LongArray
    """int64 (m, 2), (row, col) of the cells whose class is another one than before."""


class Method(Protocol):
    """A search for paths on one map. A class that derives from it need only write `metric`, `find`
    and a constructor, `Class(grid, *, costs=None, allow_unexplored=False)`.

    The same class serves both: a planner, by `method: module:Class` in a preset, gives it the
    keywords; the harness, by `--baseline module:Class`, the grid alone, and costs in a run with
    costs. `prepare` is called once, before the first query.
    """

    metric: Metric
    """The metric of all its paths, `octile`, `weighted` or `any-angle`."""

    def find(self, query: Query) -> Found:
        """Find a path of the quality that the preset requires, which meets no closed cell."""
        ...

    def find_many(self, queries: QueryMany) -> FoundMany | None:  # noqa: ARG002 - a default
        """Find paths for many queries at once; None where `find` must be called for each.

        A path between cells may meet a closed cell: the caller looks.
        """
        return None

    def labels(self, closed: ClosedCells | None = None) -> LabelSource | None:  # noqa: ARG002
        """Return what makes labels for tables of distances round closed cells; None for plans of
        each pair."""
        return None

    @property
    def prepared(self) -> object | None:
        """The structure for queries that is worth keeping; None until it is built, and without."""
        return None

    def prepare(self, progress: Progress = no_progress) -> object:
        """Build the structures for queries, once, and report each step; else the first query does
        it."""
        progress(1, 1)
        return None

    def changed(self, change: MapChange) -> Method | None:  # noqa: ARG002 - a default
        """Return the method of a changed map, this one stays as it is; None to make it anew."""
        return None

    def take_costs(self, costs: CostLayer, box: Box) -> bool:  # noqa: ARG002 - a default
        """Plan by other costs from now on; no query runs meanwhile. False to be made anew.

        `costs`: the new costs of all cells; `box`: first row, last row + 1, first column, last
        column + 1 of the cells that differ.
        """
        return False
