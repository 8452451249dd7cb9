"""Results of a planner: statuses, routes, bounds. Public: `COST_METRICS`, `Refinement` and
`Metric`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Protocol

import numpy as np

from hybridnav._base.copies import on_demand
from hybridnav._base.extension import in_html
from hybridnav._base.trig import dist
from hybridnav.errors import PlanError, renamed
from hybridnav.planning.text import rounded_bound
from hybridnav.route.route import Route
from hybridnav.search.found import Metric as Metric  # noqa: PLC0414 - they are public here
from hybridnav.search.found import PlanStats as PlanStats  # noqa: PLC0414
from hybridnav.search.found import PlanStatus as PlanStatus  # noqa: PLC0414

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import ArrayLike
    from typing_extensions import Self

    from hybridnav._base.typing import FloatArray
    from hybridnav.guide.words import Instruction
    from hybridnav.maps import OccupancyGrid
    from hybridnav.planning.costs import PlannerCosts
    from hybridnav.planning.path import Path
    from hybridnav.planning.speed import MotionLimits
    from hybridnav.reasons import Explanation
    from hybridnav.search.found import ClosedCells
    from hybridnav.topology import TopologicalMap

COST_METRICS: frozenset[Metric] = frozenset({"weighted", "any-angle-weighted"})
"""Metrics of plans by a `CostLayer`: costs are metres, each counted by the factors along it."""


class RouteSource(Protocol):
    """Data from which a route is found when somebody reads it: naming it takes longer than to plan
    some paths."""

    def route(self) -> Route:
        """Find the route."""
        ...


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


class Walk(NamedTuple):
    """What the instructions of a path are found from, beside the path."""

    topology: TopologicalMap
    """The map with its rooms."""
    goal: ArrayLike | str
    """As it was given: a point in metres, or a name."""
    start: Sequence[float]
    """`(x, y)`, or `(x, y, yaw)` of a robot with a heading."""


Answer = Literal["circumscribed disc", "inscribed disc", "OMPL", "grid"]


@dataclass(frozen=True)
class Refinement:
    """History of the path of a sampling-based planner."""

    steps: tuple[str, ...]
    """Attempts in order, with outcomes: `corridor: timeout`, `widened corridor: solved`."""
    by: Answer
    """The source of the answer. The path of the `circumscribed disc` is valid with every heading.
    The `inscribed disc` proves that there is no path, or the robot can drive its cheapest one.
    `OMPL` sampled it. The path of the `grid`, pulled taut, counts where all else failed."""
    trace: tuple[tuple[float, float], ...] = ()
    """Seconds and cost of each better path."""
    iterations: int = 0
    """Iterations of planners and simplification."""

    @property
    def by_grid(self) -> bool:
        """Whether the path is the grid's, shortened by line of sight."""
        return self.by == "grid"


@on_demand("settings")
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
    route_source: RouteSource | Route | None = field(default=None, repr=False)
    """The route, or the data to find it from; nothing of the planner."""
    bound_source: float | Callable[[], float] = field(default=math.inf, repr=False)
    """The lower bound, or how to find it."""
    stats: PlanStats = field(default_factory=PlanStats)
    settings: dict[str, Any] = field(default_factory=dict)
    """Preset, and settings of the planner and the pyramid; its `limits`, if it has any."""
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
    instruction_source: Walk | tuple[Instruction, ...] = field(default=(), repr=False)
    """The instructions, or the data to find them from."""
    why_source: Callable[[], Explanation] | Explanation | None = field(default=None, repr=False)
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
        source = self.bound_source
        return source() if callable(source) else source

    @cached_property
    def route(self) -> Route | None:
        """The places and arcs of the path: chosen before it (`paper`), or derived from it (all
        other presets); None unless there is a path."""
        source = self.route_source
        return source if source is None or isinstance(source, Route) else source.route()

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
        source = self.instruction_source
        if not isinstance(source, Walk):
            return source
        if self.path is None:
            return ()
        from hybridnav.guide.words.itinerary import instructions_of  # noqa: PLC0415 - with rooms

        return instructions_of(self.path, *source)

    @cached_property
    def explanation(self) -> Explanation | None:
        """Why there is no path, found when it is read first, in about a second on a million cells;
        None with a path, and in batches."""
        source = self.why_source
        return source() if callable(source) else source

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
        """Return the state with what is found on demand, so that copies hold no map."""
        found = {"route", "instructions", "lower_bound", "duration_s", "explanation"}
        state = {name: value for name, value in vars(self).items() if name not in found}
        return state | {
            "route_source": self.route,
            "instruction_source": self.instructions,
            "bound_source": self.lower_bound,
            "settings": self.settings,
            "why_source": self.explanation,
            "ground": None,
        }

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


@dataclass(frozen=True, eq=False)
class PlanDraft:
    """A plan between two waypoints, for those who compare many and want the result of few."""

    status: PlanStatus
    cost: float
    """As in `PlanResult`."""
    bound_source: float | Callable[[], float]
    """The lower bound, or how to find it."""
    stats: PlanStats
    result: Callable[[], PlanResult]
    """Makes the result."""

    @classmethod
    def of(cls, result: PlanResult) -> Self:
        """Return the draft of a result that is made already."""
        bound = partial(getattr, result, "lower_bound")
        return cls(result.status, result.cost, bound, result.stats, lambda: result)

    @property
    def lower_bound(self) -> float:
        """As in `PlanResult`."""
        return self.bound_source() if callable(self.bound_source) else self.bound_source

    def __reduce__(self) -> tuple[Callable[[PlanResult], PlanDraft], tuple[PlanResult]]:
        """Make the result, with which copies travel without the planner and its map."""
        return PlanDraft.of, (self.result(),)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(item) for key, item in value.items()}
    return None if isinstance(value, float) and not math.isfinite(value) else value
