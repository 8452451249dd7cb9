"""Results of a planner, of one query and of a batch: statuses, routes, bounds. Public:
`COST_METRICS` and `Metric`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import Self

from hybridnav._base.copies import Source, copies_alike, frozen, made, made_state
from hybridnav._base.extension import in_html
from hybridnav._base.trig import dist
from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, LongArray
from hybridnav.errors import PlanError, renamed
from hybridnav.maps import CellClass
from hybridnav.planning.path import Path, check_length, is_length
from hybridnav.planning.text import rounded_bound
from hybridnav.search.found import ClosedCells, FoundMany, Method, QueryMany
from hybridnav.search.found import Metric as Metric  # noqa: PLC0414 - they are public here
from hybridnav.search.found import PlanStats as PlanStats  # noqa: PLC0414
from hybridnav.search.found import PlanStatus as PlanStatus  # noqa: PLC0414

if TYPE_CHECKING:
    from hybridnav.guide.words import Instruction
    from hybridnav.maps import OccupancyGrid
    from hybridnav.planning.costs import PlannerCosts
    from hybridnav.planning.finishes import Refinement
    from hybridnav.planning.speed import MotionLimits
    from hybridnav.reasons import Explanation
    from hybridnav.route.route import Route
    from hybridnav.topology import TopologicalMap

COST_METRICS: frozenset[Metric] = frozenset({"weighted", "any-angle-weighted"})
"""Metrics of plans by a `CostLayer`: costs are metres, each counted by the factors along it."""


class PlannedOn(NamedTuple):
    """What was planned on: proofs and pictures are made of it."""

    grid: OccupancyGrid
    """The map."""
    costs: PlannerCosts
    """The costs of its cells."""
    closed: ClosedCells | None
    """The closed cells of the query."""
    topology: TopologicalMap | None
    """The places of the map; None while they are not built."""


@dataclass(frozen=True)
class Walk:
    """What the instructions of a path are found from, when somebody reads them."""

    path: Path
    topology: TopologicalMap
    """The map with its rooms."""
    goal: ArrayLike | str
    """As it was given: a point in metres, or a name."""
    start: Sequence[float]
    """`(x, y)`, or `(x, y, yaw)` of a robot with a heading."""

    def __call__(self) -> tuple[Instruction, ...]:
        """Find the instructions."""
        from hybridnav.guide.words.itinerary import instructions_of  # noqa: PLC0415 - with rooms

        return instructions_of(self.path, self.topology, self.goal, self.start)


@dataclass(frozen=True, eq=False)
class PlanResult:
    """Outcome of one query; `path` and `route` are None unless it is solved.

    The path of an approximate result ends short of the goal.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> result = hn.HybridPlanner(topology).plan((0.5, 0.5), (2.0, 2.5))
    >>> result.solved, round(result.cost, 3), result.gap
    (True, 2.546, 0.0)
    """

    status: PlanStatus
    metric: Metric = "octile"
    path: Path | None = None
    route_source: Source[Route | None] = field(default=None, repr=False)
    """The route, or how to find it; nothing of the planner."""
    lower_bound_source: Source[float] = field(default=math.inf, repr=False)
    """The lower bound, or how to find it."""
    stats: PlanStats = field(default_factory=PlanStats)
    settings_source: Source[dict[str, Any]] = field(default_factory=dict, repr=False)
    """The settings, or how to state them."""
    weighted_cost: float | None = None
    """Cost in a metric other than the length, as with costs of cells; None for the length."""
    refinement: Refinement | None = None
    """History of the path, with OMPL only."""
    start: tuple[float, ...] | None = None
    """Start of the plan, `(x, y)` or `(x, y, yaw)`, metres and radians, map frame; in a room the
    chosen point."""
    goal: tuple[float, ...] | None = None
    """Goal of the plan, like `start`."""
    grid_bound: float | None = None
    """Proved bound on the cost of all paths of cells, metres, of an any-angle path by costs."""
    line: FloatArray | None = field(default=None, repr=False)
    """float64 (m, 2), the straight lines of a path by method `cheapest` before its bends were
    rounded, `(x, y)` in metres, map frame; None of other paths."""
    instructions_source: Source[tuple[Instruction, ...]] = field(default=(), repr=False)
    """The instructions, or how to find them."""
    explanation_source: Source[Explanation | None] = field(default=None, repr=False)
    """The explanation, or how to find it."""
    leaves_m: float | None = None
    """Metres from the start out of closed cells, which `leave_zone` opened; None of others."""
    ground: PlannedOn | None = field(default=None, repr=False)
    """What was planned on; None in copies of a result."""

    def __repr__(self) -> str:
        """Return three lines: status, length and preset; the bound; the route and its ends."""
        stated = f"{self.status} by preset {self.settings.get('preset', 'none')}"
        start, goal = (
            "no point" if end is None else f"({', '.join(f'{n:.10g}' for n in end)})"
            for end in (self.start, self.goal)
        )
        between = f"from {start} to {goal}"
        if self.path is None:
            return f"{stated}\n{self.reason or 'without a path'}\n{between}"
        by_costs, bound = self.weighted_cost is not None, "no bound: it does not reach its goal"
        if self.ends_well:
            least, how = rounded_bound(self.lower_bound, self.cost)
            bound = f"none below {least} m: {how.replace('long', 'dear') if by_costs else how}"
        cost = f", cost {self.cost:.2f} m" if by_costs and self.ends_well else ""
        ids = () if self.route is None else (self.route.places, self.route.arcs)
        counts = zip(map(len, ids), ("place", "arc"), strict=False)
        passed = "".join(f", {n} {what}{'' if n == 1 else 's'}" for n, what in counts)
        length = f"{self.path.length_m:.2f} m{cost} ({self.metric})"
        return f"{stated}: {length}\n{bound}\n{between}{passed}"

    def _repr_html_(self) -> str | None:
        """Return the picture and the lines for a notebook, if pictures are registered."""
        return in_html(self)

    @cached_property
    def lower_bound(self) -> float:
        """A proved bound on the optimum in the metric, metres; infinite where there is no path.

        With a footprint it is the shortest path of the largest disc inside it: no disc is shorter.
        It is no claim that the path is the shortest one of the footprint.

        That of an any-angle path by costs is found when it is read first, in tens of milliseconds
        on maps of buildings: see `search.lattice.cost_bound`.
        """
        return made(self.lower_bound_source)

    @cached_property
    def route(self) -> Route | None:
        """The places and arcs of the path: chosen before it (`paper`), or derived from it (all
        other presets); None unless there is a path."""
        return made(self.route_source)

    @cached_property
    def settings(self) -> dict[str, Any]:
        """Preset, and settings of the planner and the pyramid; its `limits`, if it has any."""
        return made(self.settings_source)

    @property
    def limits(self) -> MotionLimits | None:
        """The robot's limits, those of the section `limits` of the preset; None without it."""
        stated = self.settings.get("limits")
        if stated is None:
            return None
        # Loads a module that plans without limits do not need.
        from hybridnav.planning.speed import MotionLimits  # noqa: PLC0415

        return MotionLimits(**stated)

    @cached_property
    def duration_s(self) -> float | None:
        """Seconds that the robot drives and turns within `limits`, from standstill to standstill;
        None without limits or a path. `Path.profile` has other limits, and zones."""
        limits = self.limits
        if limits is None or self.path is None:
            return None
        return self.path.profile(limits, math.inf).duration_s

    @cached_property
    def instructions(self) -> tuple[Instruction, ...]:
        """Instructions for a person; none without a path, and on a map without rooms."""
        return made(self.instructions_source)

    @cached_property
    def explanation(self) -> Explanation | None:
        """Why there is no path, found when it is read first, in about a second on a million cells;
        None with a path, and in batches."""
        return made(self.explanation_source)

    @property
    def reason(self) -> str:
        """Why the goal is not reached, in one line: see `hybridnav.explain`; empty if it is."""
        return "" if self.explanation is None else self.explanation.reason

    def words(self, language: str = "en") -> list[str]:
        """Return `hybridnav.words(result, language)`: write that."""
        renamed("PlanResult.words(...)", "hybridnav.words(result, ...)")
        from hybridnav.guide.words import words  # noqa: PLC0415 - an old name alone needs it

        return words(self, language)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state with all values made, so that copies hold no map."""
        names = {each.name for each in fields(self)}
        late = {name: value for name, value in made_state(self).items() if name in names}
        return late | {"ground": None}

    @property
    def solved(self) -> bool:
        """Whether there is a path."""
        return self.status is PlanStatus.SOLVED

    @property
    def ends_well(self) -> bool:
        """Whether there is a path to the goal or, by `within_m`, to the point nearest to it."""
        return self.status in {PlanStatus.SOLVED, PlanStatus.NEAR_GOAL}

    @property
    def cost(self) -> float:
        """Cost in the metric, metres; infinite where there is no path to the goal. Near the goal,
        this and the bound are those of the point at which the path ends."""
        if self.path is None or not self.ends_well:
            return math.inf
        return self.path.length_m if self.weighted_cost is None else self.weighted_cost

    @property
    def gap(self) -> float:
        """Proved distance from the optimum, cost / lower bound - 1; NaN where there is no path."""
        if self.path is None or not self.ends_well:
            return math.nan
        return self.cost / self.lower_bound - 1 if self.lower_bound > 0 else 0.0

    @property
    def grid_gap(self) -> float:
        """Proved distance from the cheapest path of cells, cost / `grid_bound` - 1, below 0 for a
        cheaper path; NaN without that bound."""
        if self.grid_bound is None or not self.solved:
            return math.nan
        return self.cost / self.grid_bound - 1 if self.grid_bound > 0 else 0.0

    @property
    def short_m(self) -> float:
        """Metres from the end of the path to the goal, for `near the goal`; 0 if it is solved,
        infinite without a path."""
        if self.solved:
            return 0.0
        if self.path is None or self.goal is None:
            return math.inf
        return dist(self.path.points[-1], self.goal[:2])

    def raise_for_status(self) -> Self:
        """Return the result itself if it is solved, or near the goal as asked for.

        Raises
        ------
        PlanError
            When the result is not solved; the text has the status and the reason.
        """
        if not self.ends_well:
            raise PlanError(f"no path was planned: {self.status}. {self.reason}".rstrip(". "))
        return self

    def proof(self) -> dict[str, Any]:
        """Return `hybridnav.prove(result)`: write that."""
        renamed("PlanResult.proof()", "hybridnav.prove(result)")
        from hybridnav.reasons import prove  # noqa: PLC0415 - an old name alone needs it

        return prove(self)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for strict JSON, under the names of the attributes.

        Infinite or missing values are None. If the path has no headings, `headings_rad` holds the
        direction of travel at each point.
        """
        return {
            "status": str(self.status),
            "metric": self.metric,
            "start": None if self.start is None else list(self.start),
            "goal": None if self.goal is None else list(self.goal),
            "length_m": self.path.length_m if self.path else None,
            "duration_s": self.duration_s,
            "short_m": self.short_m if self.ends_well else None,
            "leaves_m": self.leaves_m,
            "cost": self.cost if self.ends_well else None,
            "lower_bound": self.lower_bound if self.ends_well else None,
            "gap": self.gap if self.ends_well else None,
            "grid_bound": self.grid_bound,
            "grid_gap": self.grid_gap if self.grid_bound is not None else None,
            "places": list(self.route.places) if self.route else None,
            "arcs": list(self.route.arcs) if self.route else None,
            "points": np.round(self.path.points, 6).tolist() if self.path else None,
            "headings_rad": np.round(self.path.headings_at_points, 6).tolist()
            if self.path
            else None,
            "steps": list(self.refinement.steps) if self.refinement else None,
            "expanded": self.stats.expanded,
            "expanded_places": self.stats.expanded_places,
            "expanded_intervals": self.stats.expanded_intervals,
            "corridor_cells": self.stats.corridor_cells,
            "seconds": {stage: round(s, 6) for stage, s in self.stats.seconds.items()},
            "settings": _finite(self.settings),
        }


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value


# Many queries at once: those that look-ups answer in one kernel, the others one by one.


@copies_alike
@dataclass(frozen=True, eq=False)
class PlanBatch:
    """Outcomes of many queries, arrays of n.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> planner = hn.HybridPlanner(topology)
    >>> batch = planner.plan_many([(0.5, 0.5), (0.5, 0.5)], [(2.0, 2.5), (1.5, 0.5)])
    >>> batch.cost.round(3)
    array([2.546, 1.   ])
    """

    status: AnyArray
    """str (n,), the values of `PlanStatus`."""
    cost: FloatArray
    """float64 (n,), metres; infinite where there is no path."""
    lower_bound_source: Source[FloatArray]
    """The lower bounds, or how to find them."""
    path_start: LongArray
    """int64 (n + 1,), query i has the points `path_start[i]` to `path_start[i + 1]`."""
    points: FloatArray
    """float64 (m, 2), (x, y) in metres, map frame, of all paths."""
    headings_rad: FloatArray | None = None
    """float64 (m,), the heading at each point; None in spaces without headings."""

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for array in (self.status, self.cost, self.path_start, self.points):
            frozen(array)
        if self.headings_rad is not None:
            frozen(self.headings_rad)

    @cached_property
    def lower_bound(self) -> FloatArray:
        """float64 (n,), metres, as in `PlanResult`; those of any-angle paths by costs are found
        when they are read first, in tens of milliseconds each on maps of buildings."""
        return frozen(made(self.lower_bound_source))

    @property
    def gap(self) -> FloatArray:
        """float64 (n,), proved distances from the optimum; NaN where there is no path."""
        gap = np.full(len(self.cost), np.nan)
        solved = np.isfinite(self.cost)
        np.divide(self.cost, self.lower_bound, out=gap, where=solved & (self.lower_bound > 0))
        gap[solved & (self.lower_bound <= 0)] = 1.0
        return gap - 1

    def path(self, query: int) -> FloatArray:
        """Return the points of one path, float64 (k, 2); none where there is no path."""
        return self.points[self.path_start[query] : self.path_start[query + 1]]


def plan_many(
    grid: OccupancyGrid,
    at_once: Method | None,
    endpoints: tuple[FloatArray, FloatArray],
    closed: ClosedCells | None,
    alone: Callable[[FloatArray, FloatArray], PlanResult],
) -> PlanBatch:
    """Return the answers to pairs of points, in arrays.

    `at_once`: planner for many queries at once; None leaves all to `alone`; `endpoints`: starts and
    goals, float64 (n, 2) each, or poses (n, 3); `closed`: closed cells; None for none; `alone`:
    plans one of the remaining queries, between two of the `endpoints`.
    """
    starts, goals = endpoints
    n = len(starts)
    status = np.full(n, str(PlanStatus.SOLVED), dtype=f"U{max(map(len, PlanStatus))}")
    cost, bound = np.full(n, np.inf), np.full(n, np.inf)
    counts, source = np.zeros(n, np.int64), np.zeros(n, np.int64)
    paths: dict[int, FloatArray] = {}
    headings = [np.empty(0)]
    late: dict[int, Callable[[], float]] = {}
    left = np.ones(n, dtype=np.bool_)
    first, last = grid.frame.cells_of(starts[:, :2]), grid.frame.cells_of(goals[:, :2])
    asked = np.flatnonzero(_are_free(grid, first) & _are_free(grid, last))
    found = None
    if len(asked) and at_once is not None:
        cells = first[asked], last[asked]
        found = at_once.find_many(QueryMany(cells, (starts[asked], goals[asked]), closed))
    if at_once is not None and found is not None:
        kept = found.is_done
        _check_lengths(found, at_once.metric)
        if closed is not None:
            on_cells = found if at_once.metric == "octile" else None
            kept = kept & ~_met(closed, cells, grid, on_cells)
        done = asked[kept]
        left[done] = False
        cost[done] = found.cost_m[kept]
        bound[done] = np.minimum(found.lower_bound_m[kept], cost[done])
        status[done[np.isinf(cost[done])]] = str(PlanStatus.NO_PATH)
        source[done] = found.path_start[:-1][kept]
        counts[done] = np.diff(found.path_start)[kept]
        still = done[~(cost[done] > 0)]
        counts[still] = np.minimum(counts[still], 1)
    for i in np.flatnonzero(left).tolist():
        result = alone(starts[i], goals[i])
        status[i], cost[i] = str(result.status), result.cost
        if callable(result.lower_bound_source):
            late[i] = result.lower_bound_source
        else:
            bound[i] = result.lower_bound_source
        if result.path is not None:
            paths[i] = result.path.points
            counts[i] = len(paths[i])
            if result.path.headings_rad is not None:
                headings.append(result.path.headings_rad)
    path_start = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    is_whole = found is not None and not left.any() and path_start[-1] == len(found.points)
    points = found.points if found is not None and is_whole else np.empty((path_start[-1], 2))
    if found is not None and not is_whole:
        counts[left] = 0
        points[_rows(path_start[:-1], counts)] = found.points[_rows(source, counts)]
    for i, path in paths.items():
        points[path_start[i] : path_start[i + 1]] = path
    has_yaw = starts.shape[1] > 2  # noqa: PLR2004
    return PlanBatch(
        status=status,
        cost=cost,
        lower_bound_source=partial(_with_late, bound, late) if late else bound,
        path_start=path_start,
        points=points,
        headings_rad=np.concatenate(headings) if has_yaw else None,
    )


def _check_lengths(found: FoundMany, metric: str) -> None:
    """Refuse paths whose costs are not the lengths of their points, by metrics of lengths."""
    if metric not in {"octile", "any-angle"}:
        return
    from hybridnav.maps.geometry import polyline_lengths  # noqa: PLC0415 - compiled

    driven_m = polyline_lengths(found.points, found.path_start)
    goes = found.is_done & np.isfinite(found.cost_m)
    stated_m, driven_m = found.cost_m[goes], driven_m[goes]
    for wrong in np.flatnonzero(~is_length(stated_m, driven_m))[:1]:
        check_length(stated_m[wrong], driven_m[wrong])


def _rows(begin: LongArray, counts: LongArray) -> LongArray:
    """Return the rows of runs that begin somewhere, one run after the other."""
    before = np.cumsum(counts) - counts
    return np.repeat(begin - before, counts) + np.arange(counts.sum())


def _with_late(bound: FloatArray, late: dict[int, Callable[[], float]]) -> FloatArray:
    """Return bounds with those that are found only now."""
    bound = bound.copy()
    for i, source in late.items():
        bound[i] = source()
    return bound


def _met(
    closed: ClosedCells,
    endpoints: tuple[LongArray, LongArray],
    grid: OccupancyGrid,
    found: FoundMany | None,
) -> BoolArray:
    """Return which queries meet closed cells with an endpoint, or with their paths, bool (n,).

    Only paths of cells are given; None for others.
    """
    across = np.array([grid.shape[1], 1])
    met: BoolArray = closed.holds(endpoints[0] @ across) | closed.holds(endpoints[1] @ across)
    if found is None:
        return met
    for k in np.flatnonzero(found.is_done & ~met).tolist():
        points = found.points[found.path_start[k] : found.path_start[k + 1]]
        met[k] = len(points) and closed.meets(grid.frame.cells_of(points), grid)
    return met


def _are_free(grid: OccupancyGrid, cells: LongArray) -> BoolArray:
    """Return whether cells (n, 2) lie on the map and are free."""
    classes = grid.classes
    inside = ((cells >= 0) & (cells < classes.shape)).all(axis=1)
    free = np.zeros(len(cells), dtype=np.bool_)
    free[inside] = classes[tuple(cells[inside].T)] == CellClass.FREE
    return free
