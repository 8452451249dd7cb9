"""What `hybridnav plan` was asked for, alternatives among it, and how it is answered."""

from __future__ import annotations

import itertools
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any

import typer

import hybridnav as hn
from hybridnav._base.extension import extension
from hybridnav._base.files import replace_file
from hybridnav.cli.common import UsageError, complain, islands_figures, stage
from hybridnav.cli.reading import (
    MapOptions,
    check_room_to_be,
    grow_topology,
    load_model,
    outside,
    refused_result,
)
from hybridnav.cli.rendering import Waypoint, draw, query_of, respond
from hybridnav.cli.warm import compiling_beside

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from hybridnav.cli.options import Closing, Costs
    from hybridnav.planning.named import At


@dataclass(frozen=True)
class Wanted:
    """What is asked for beside the plan: alternatives, as for `plan_alternatives`."""

    count: int
    max_overlap: float | None
    max_stretch: float | None


@dataclass(frozen=True)
class Request:
    """What a command line asks for: a plan between two points, or a tour described in rooms."""

    map_file: Path
    settings: hn.Preset
    reading: MapOptions
    waypoints: list[Waypoint]
    """The start, what lies between, the goal."""
    closing: Closing
    profile: str | None
    costs: Costs
    rooms_file: Path | None
    at: At
    within_m: float | None
    leave_zone: bool
    wanted: Wanted
    compare: bool
    why: bool
    plot: Path | None
    poses: Path | None
    bag: Path | None
    proof: Path | None
    language: str
    as_json: bool

    @property
    def is_tour(self) -> bool:
        """Whether rooms are needed, for the plan itself or to describe it."""
        names_rooms = (
            any(isinstance(waypoint, str) for waypoint in self.waypoints)
            or self.closing.needs_rooms
            or self.profile is not None
        )
        has_more = len(self.waypoints) > 2 or self.wanted.count > 1  # noqa: PLR2004 - start and goal
        return names_rooms or has_more or self.rooms_file is not None

    def run(self) -> bool:
        """Plan, print the answer, draw it, and return whether it is solved."""
        seconds: dict[str, float] = {}
        settings = self.settings
        if settings.planner.method == "ompl":
            hn.refine.ompl.start_ahead()
        model = load_model(self.map_file, settings, seconds, self.reading)
        grid = model.grid
        check_room_to_be(grid, allow_unexplored=settings.planner.allow_unexplored)
        closed, costs = self.closing.read(grid), self.costs.read(grid)
        status = outside(grid, self.waypoints) if self.plot is None else None
        if status is not None and (self.within_m is None or "goal" not in status):
            refused = refused_result(status, settings, self.waypoints)
            outcome = hn.Tour((refused,), ()) if self.is_tour else refused
            self._respond(grid, outcome, self._beside_refusal(refused), seconds)
            return False
        topology = self._grown(model, seconds)
        with stage("preparing the planner", seconds, "prepare"):
            planner = model.planner(settings, topology=topology, costs=costs)
            if self.profile is not None:
                planner = hn.under(planner, self.profile)
                topology, grid = planner.topology, planner.grid
        outcome = self._planned(planner, closed, seconds)
        found = self._alternatives(planner, closed, seconds)
        beside: dict[str, Any] = {}
        if found is not None:
            beside = _alternatives_figures(found)
        elif self.compare and isinstance(outcome, hn.PlanResult):
            beside = _compared(self._on_whole_grid(topology, closed, costs), outcome)
        beside |= _leaving(outcome, closed, planner) | self._why(planner, outcome, closed, seconds)
        self._respond(grid, outcome, beside, seconds)
        if self.poses is not None:
            hn.export_path(outcome, self.poses)
        if self.bag is not None:
            extension("formats", "bag").save_bag(self.bag, [outcome], grid=grid)
        if self.proof is not None:
            result = outcome if isinstance(outcome, hn.PlanResult) else outcome.results[0]
            text = json.dumps(hn.prove(result), separators=(",", ":"), allow_nan=False)
            replace_file(self.proof, text.encode())
        if self.plot is not None:
            optimum_m = beside["optimum_m"] if beside.get("loss") is not None else None
            draw(
                self.plot,
                topology,
                found or outcome,
                self.waypoints,
                optimum_m,
                costs=planner.costs,
                blocked=closed,
            )
        return outcome.solved or (isinstance(outcome, hn.PlanResult) and outcome.ends_well)

    def _grown(self, model: hn.Model, seconds: dict[str, float]) -> hn.TopologicalMap:
        """Build the pyramid, with rooms for a tour, while the search is compiled.

        They are those of a file that is named, of the model, of a file in the map's folder, or
        found.
        """
        rooms_file, beside = self.rooms_file, self.map_file.parent / "rooms.yaml"
        if rooms_file is None and model.rooms is None and self.is_tour:
            rooms_file = beside if beside.is_file() else None
        if self.is_tour and rooms_file is None and model.rooms is None:
            complain(
                "no rooms.yaml lies beside the map, so rooms are found; see hybridnav rooms --help"
            )
        settings = self.settings
        allowed = settings.planner.allow_unexplored
        if settings.planner.underlying.method == "shortest" and not model.is_filed:
            from hybridnav.planning.methods.shortest import announce_mesh  # noqa: PLC0415 - numba

            announce_mesh(model.grid.enterable(allow_unexplored=allowed))
        with compiling_beside(settings) as compiled:
            topology = grow_topology(
                model,
                settings,
                seconds,
                rooms_file=rooms_file,
                find_rooms=self.is_tour,
                waypoints=self.waypoints,
                closing=self.closing,
            )
            compiled()
        return topology

    def _planned(
        self, planner: hn.HybridPlanner, closed: hn.Blocked | None, seconds: dict[str, float]
    ) -> hn.PlanResult | hn.Tour:
        spent: dict[str, float] = {}
        with stage("planning", spent, "plan"):
            if not self.is_tour:  # the result has the seconds of its stages
                return planner.plan(
                    *self.waypoints,
                    blocked=closed,
                    within_m=self.within_m,
                    leave_zone=self.leave_zone,
                )
            tour = hn.plan_tour(planner, self.waypoints, at=self.at, blocked=closed)
        counted = sum(sum(result.stats.seconds.values()) for result in tour.results)
        seconds["plan"] = round(max(spent["plan"] - counted, 0.0), 6)  # what no stage counts
        return tour

    def _alternatives(
        self, planner: hn.HybridPlanner, closed: hn.Blocked | None, seconds: dict[str, float]
    ) -> hn.Alternatives | None:
        """Find alternatives between the two waypoints, if asked for."""
        if self.wanted.count == 1:
            return None
        with stage("finding alternatives", seconds, "alternatives"):
            return hn.plan_alternatives(
                planner,
                self.waypoints[0],
                self.waypoints[-1],
                self.wanted.count,
                max_overlap=self.wanted.max_overlap,
                max_stretch=self.wanted.max_stretch,
                at=self.at,
                blocked=closed,
            )

    def _why(
        self,
        planner: hn.HybridPlanner,
        outcome: hn.PlanResult | hn.Tour,
        closed: hn.Blocked | None,
        seconds: dict[str, float],
    ) -> dict[str, Any]:
        """Explain why there is no path, or, if asked, where a path is tightest."""
        if (outcome.solved and not self.why) or "outside" in outcome.status:
            return {}
        from hybridnav.reasons.why import explain_solved  # noqa: PLC0415 - loads shapely

        results = (outcome,) if isinstance(outcome, hn.PlanResult) else outcome.results
        with stage("explaining", seconds, "why"):
            found = [
                explain_solved(
                    planner, (one.start, one.goal), named, blocked=_closed_for(one, closed)
                )
                for one, named in zip(results, self._named(planner, outcome), strict=False)
                if one.start is not None and one.goal is not None and one.solved == outcome.solved
            ]
        tightest = min(found, key=lambda one: one.widest_m, default=None)
        if tightest is None:
            return {"why": None}
        return {"why": tightest.to_dict() | {"words": tightest.words(self.language)}}

    def _named(
        self, planner: hn.HybridPlanner, outcome: hn.PlanResult | hn.Tour
    ) -> Iterator[tuple[Any, Any]]:
        """Yield the ends of each leg; a name only where the leg may choose its end in it."""
        is_choice = outcome.solved and self.at == "anywhere" and not planner.needs_headings
        for leg in itertools.pairwise(self.waypoints):
            yield leg if is_choice else (None, None)

    def _on_whole_grid(
        self, topology: hn.TopologicalMap, closed: hn.Blocked | None, costs: hn.CostLayer | None
    ) -> hn.PlanResult:
        # Loads pydantic, which help can do without.
        from hybridnav.planning import CostSettings, planner_settings  # noqa: PLC0415

        settings = self.settings
        own, by = settings.planner, CostSettings(clearance=settings.planner.clearance)
        allowed = own.allow_unexplored
        whole = planner_settings("grid-astar", allow_unexplored=allowed, costs=by)
        preset = settings.model_copy(update={"name": "grid-astar", "planner": whole})
        start, goal = (waypoint[:2] for waypoint in self.waypoints)
        planner = hn.HybridPlanner(topology, preset=preset, costs=costs)
        return planner.plan(start, goal, blocked=closed)

    def _beside_refusal(self, refused: hn.PlanResult) -> dict[str, Any]:
        """Return the figures of what was asked for beside a plan that was refused."""
        if self.wanted.count > 1:
            # Loads numba, which help and wrong usage can do without.
            from hybridnav.guide.alternatives import unplanned  # noqa: PLC0415

            return _alternatives_figures(unplanned(refused.status))
        return _compared(refused, None) if self.compare else {}

    def _respond(
        self,
        grid: hn.OccupancyGrid,
        outcome: hn.PlanResult | hn.Tour,
        beside: dict[str, Any],
        seconds: dict[str, float],
    ) -> None:
        by_costs = bool(self.costs) and self.reading.preset is None
        figures = outcome.to_dict() | {"map": str(self.map_file), "by_costs": by_costs}
        if not isinstance(outcome, hn.PlanResult):  # `hn.Tour` would load the words
            figures["words"] = outcome.words(self.language)
        islands, closed = islands_figures(grid), self.closing.to_dict()
        if self.is_tour:
            waypoints = [
                waypoint if isinstance(waypoint, str) else list(waypoint)
                for waypoint in self.waypoints
            ]
            figures |= (
                {"waypoints": waypoints, "query": query_of(self.waypoints)}
                | closed
                | beside
                | islands
            )
        else:
            figures |= islands | closed | beside
        figures["seconds"] = seconds | figures["seconds"]
        respond(grid, self.waypoints, figures, as_json=self.as_json)


def _compared(grid_result: hn.PlanResult, result: hn.PlanResult | None) -> dict[str, Any]:
    """Return the figures of a plan on the whole grid, and the loss of a result against it."""
    cost, loss = grid_result.cost if grid_result.solved else None, None
    alike = result is None or result.metric == grid_result.metric
    if cost is not None and result is not None and result.solved and alike:
        loss = result.cost / cost - 1 if cost > 0 else 0.0
    return {
        "optimum_m": cost if alike else None,
        "loss": loss,
        "grid_length_m": grid_result.path.length_m if grid_result.path is not None else None,
        "grid_cost": cost,
        "grid_expanded": grid_result.stats.expanded,
        "grid_seconds": round(sum(grid_result.stats.seconds.values()), 6),
    }


def _closed_for(result: hn.PlanResult, closed: hn.Blocked | None) -> Any:
    """Return what is closed for a result: all but the way out of a zone that it leaves."""
    source = result.proof_source
    return closed if result.leaves_m is None or source is None else source[2]


def _leaving(
    outcome: hn.PlanResult | hn.Tour, closed: hn.Blocked | None, planner: hn.HybridPlanner
) -> dict[str, Any]:
    """Return what reasons call the closures that a plan leaves; nothing of others."""
    if not isinstance(outcome, hn.PlanResult) or outcome.leaves_m is None:
        return {}
    from hybridnav.reasons.why import each_closure  # noqa: PLC0415 - loads shapely
    from hybridnav.reasons.why_words import Closure, closure_words  # noqa: PLC0415

    assert outcome.start is not None  # noqa: S101 - every plan has one
    grid, costs = planner.grid, planner.costs
    row, col = grid.frame.cell_of(*outcome.start[:2])
    flat, closures = row * grid.shape[1] + col, each_closure(closed or hn.Blocked())
    left = [one for one, own in closures if flat in own.cells_of(planner.topology)]
    if costs is not None and flat in costs.closed_flat:
        left.append(Closure("costs", None))
    return {"leaves": [closure_words(one, "en") for one in left]}


def _alternatives_figures(found: hn.Alternatives) -> dict[str, Any]:
    """Return alternatives with the rooms and doors that they pass, and whether they are all."""
    from hybridnav.planning import COST_METRICS  # noqa: PLC0415 - loads numpy

    routes = []
    by_costs = bool(found) and found[0].result.metric in COST_METRICS
    for number, other in enumerate(found):
        rooms = [
            (leg.room or f"the {leg.shape}")
            + (f" ({leg.door.kind} {leg.door.number})" if leg.door else "")
            for leg in other.tour.legs
        ]
        pair = found[0].tour, other.tour
        first_m, own_m = (tour.cost if by_costs else tour.length_m for tour in pair)
        stretch = own_m / first_m if number and first_m > 0 else 1.0
        routes.append(other.to_dict() | {"rooms": rooms, "stretch": stretch})
    return {
        "alternatives": routes,
        "alternatives_complete": found.complete,
        "alternatives_note": found.note,
    }


# Options of alternatives, and their checks.


AlternativesOption = Annotated[
    int,
    typer.Option(
        "--alternatives",
        metavar="N",
        min=1,
        max=20,
        help="Up to N routes by other doors, the plain plan first.",
    ),
]
OverlapOption = Annotated[
    float | None,
    typer.Option(
        "--max-overlap",
        metavar="SHARE",
        min=0,
        max=1,
        help="Share that an alternative may have in common with a shorter one.",
        show_default="0.8",
    ),
]
StretchOption = Annotated[
    float | None,
    typer.Option(
        "--max-stretch",
        metavar="FACTOR",
        min=1,
        help="Length of an alternative over that of the first, at most.",
        show_default="2.0",
    ),
]


def wanted_of(count: int, max_overlap: float | None, max_stretch: float | None) -> Wanted:
    """Return the alternatives that the options ask for; None stands for one that is not given."""
    options = {"--max-overlap": max_overlap, "--max-stretch": max_stretch}
    idle = [name for name, value in options.items() if value is not None]
    if idle and count == 1:
        raise UsageError(f"{idle[0]} is for alternatives: add --alternatives N, or leave it out")
    return Wanted(count, max_overlap, max_stretch)
