"""`hybridnav plan`: from a map file to a route, step by step."""

from __future__ import annotations

import itertools
import json
from collections.abc import Sequence
from typing import Any

import typer

import hybridnav as hn
from hybridnav._base.extension import extension
from hybridnav._base.files import replace_file
from hybridnav.cli.common import EXIT_NOT_SOLVED, complain, islands_figures, stage
from hybridnav.cli.query import PlanOptions, TypedQuery, checked_at
from hybridnav.cli.reading import check_room_to_be, grow_topology, outside, refused_result
from hybridnav.cli.rendering import draw, query_of, respond
from hybridnav.cli.warm import compiling_beside

Seconds = dict[str, float]
"""Seconds of each stage."""


def plan(args: PlanOptions) -> None:
    """Plan a route on MAP from a point or room to another.

    MAP may be a building, and the route then leads over its floors. Without --rooms, rooms are
    those of rooms.yaml beside the map, if there. Things that `hybridnav closed` has closed stay
    closed.

    Exits with 0 when it is solved, or ends within --within of the goal, 1 when it is not, 2 on
    wrong usage, 3 on unreadable input.

    Example: hybridnav plan maps/office/office.yaml --from room-3 --to room-5
    """
    if args.is_building:
        extension("formats", "building").plan_over_floors(args)
        return
    query = TypedQuery.read(args)
    if not _answer(query, {}):
        raise typer.Exit(EXIT_NOT_SOLVED)


def _answer(query: TypedQuery, seconds: Seconds) -> bool:
    """Read the map, plan, print, write and draw; return whether it is solved."""
    args, settings = query.args, query.settings
    if settings.planner.method == "ompl":
        hn.refine.ompl.start_ahead()
    model = args.load(settings, seconds)
    check_room_to_be(model.grid, allow_unexplored=settings.planner.allow_unexplored)
    closed, costs = query.closing.read(model.grid), query.costs.read(model.grid)
    status = outside(model.grid, query.waypoints) if args.plot is None else None
    if status is not None and (args.within_m is None or "goal" not in status):
        print_refusal(query, model.grid, status, seconds)
        return False
    topology = grow(query, model, seconds)
    with stage("preparing the planner", seconds, "prepare"):
        planner = model.planner(settings, topology=topology, costs=costs)
        planner = planner if args.profile is None else hn.under(planner, args.profile)
    outcome = find(query, planner, closed, seconds)
    routes = find_alternatives(query, planner, closed, seconds)
    figures: dict[str, Any] = {}
    if routes is not None:
        figures = alternatives_figures(routes)
    elif args.compare and isinstance(outcome, hn.PlanResult):
        figures = compare(plan_on_whole_grid(query, planner, closed, costs), outcome)
    figures |= left_closures(outcome, closed, planner)
    figures |= explain(query, planner, outcome, closed, seconds)
    print_answer(query, planner.grid, outcome, figures, seconds)
    write_files(args, outcome, planner.grid)
    if args.plot is not None:
        optimum_m = figures["optimum_m"] if figures.get("loss") is not None else None
        shown, on = routes or outcome, (planner.topology, closed, planner.costs)
        draw(args.plot, shown, query.waypoints, optimum_m, on=on)
    return outcome.solved or (isinstance(outcome, hn.PlanResult) and outcome.ends_well)


# The pyramid, and what is planned on it.


def grow(query: TypedQuery, model: hn.Model, seconds: Seconds) -> hn.TopologicalMap:
    """Build the pyramid, with rooms for a tour, while the search is compiled.

    They are those of a file that is named, of the model, of a file in the map's folder, or found.
    """
    map_file, rooms_file = query.args.map_file, query.args.rooms_file
    needs_file = query.is_tour and rooms_file is None and model.rooms is None
    if needs_file and not map_file.with_name("rooms.yaml").is_file():
        complain(
            "no rooms.yaml lies beside the map, so rooms are found; see hybridnav rooms --help"
        )
    settings = query.settings
    if settings.planner.underlying.method == "shortest" and not model.is_filed:
        from hybridnav.planning.methods.shortest import announce_mesh  # noqa: PLC0415 - numba

        allowed = settings.planner.allow_unexplored
        announce_mesh(model.grid.enterable(allow_unexplored=allowed))
    with compiling_beside(settings) as compiled:
        topology = grow_topology(
            model,
            settings,
            seconds,
            rooms_file=rooms_file,
            find_rooms=query.is_tour,
            map_file=map_file,
            waypoints=query.waypoints,
            closing=query.closing,
        )
        compiled()
    return topology


def find(
    query: TypedQuery, planner: hn.HybridPlanner, closed: hn.Blocked | None, seconds: Seconds
) -> hn.PlanResult | hn.Tour:
    """Plan between two points, or a tour."""
    args, spent = query.args, Seconds()
    with stage("planning", spent, "plan"):
        if not query.is_tour:  # the result has the seconds of its stages
            how: Any = {"within_m": args.within_m, "leave_zone": args.leave_zone}
            return planner.plan(*query.waypoints, blocked=closed, **how)
        tour = hn.plan_tour(planner, query.waypoints, at=checked_at(args.at), blocked=closed)
    counted = sum(sum(result.stats.seconds.values()) for result in tour.results)
    seconds["plan"] = round(max(spent["plan"] - counted, 0.0), 6)  # what no stage counts
    return tour


def find_alternatives(
    query: TypedQuery, planner: hn.HybridPlanner, closed: hn.Blocked | None, seconds: Seconds
) -> hn.Alternatives | None:
    """Find alternatives between the two waypoints, None if they are not asked for."""
    args = query.args
    if args.alternatives == 1:
        return None
    with stage("finding alternatives", seconds, "alternatives"):
        return hn.plan_alternatives(
            planner,
            query.waypoints[0],
            query.waypoints[-1],
            args.alternatives,
            max_overlap=args.max_overlap,
            max_stretch=args.max_stretch,
            at=checked_at(args.at),
            blocked=closed,
        )


def plan_on_whole_grid(
    query: TypedQuery,
    planner: hn.HybridPlanner,
    closed: hn.Blocked | None,
    costs: hn.CostLayer | None,
) -> hn.PlanResult:
    """Plan between the same points on all cells, by the same costs."""
    # Loads pydantic, which help can do without.
    from hybridnav.planning import CostSettings, planner_settings  # noqa: PLC0415

    own = query.settings.planner
    by = CostSettings(clearance=own.clearance)
    whole = planner_settings("grid-astar", allow_unexplored=own.allow_unexplored, costs=by)
    preset = query.settings.model_copy(update={"name": "grid-astar", "planner": whole})
    start, goal = (waypoint[:2] for waypoint in query.waypoints)
    on_cells = hn.HybridPlanner(planner.topology, preset=preset, costs=costs)
    return on_cells.plan(start, goal, blocked=closed)


# The figures beside a plan.


def compare(on_grid: hn.PlanResult, result: hn.PlanResult | None) -> dict[str, Any]:
    """Return the figures of a plan on the whole grid, and the loss of a result against it."""
    cost, loss = on_grid.cost if on_grid.solved else None, None
    alike = result is None or result.metric == on_grid.metric
    if cost is not None and result is not None and result.solved and alike:
        loss = result.cost / cost - 1 if cost > 0 else 0.0
    return {
        "optimum_m": cost if alike else None,
        "loss": loss,
        "grid_length_m": on_grid.path.length_m if on_grid.path is not None else None,
        "grid_cost": cost,
        "grid_expanded": on_grid.stats.expanded,
        "grid_seconds": round(sum(on_grid.stats.seconds.values()), 6),
    }


def alternatives_figures(routes: hn.Alternatives) -> dict[str, Any]:
    """Return alternatives with the rooms and doors that they pass, and whether they are all."""
    from hybridnav.planning import COST_METRICS  # noqa: PLC0415 - loads numpy

    listed = []
    by_costs = bool(routes) and routes[0].result.metric in COST_METRICS
    for number, route in enumerate(routes):
        rooms = [
            (leg.room or f"the {leg.shape}")
            + (f" ({leg.door.kind} {leg.door.number})" if leg.door else "")
            for leg in route.tour.legs
        ]
        pair = routes[0].tour, route.tour
        first_m, own_m = (tour.cost if by_costs else tour.length_m for tour in pair)
        stretch = own_m / first_m if number and first_m > 0 else 1.0
        listed.append(route.to_dict() | {"rooms": rooms, "stretch": stretch})
    return {
        "alternatives": listed,
        "alternatives_complete": routes.complete,
        "alternatives_note": routes.note,
    }


def left_closures(
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
    left = [closure for closure, own in closures if flat in own.cells_of(planner.topology)]
    if costs is not None and flat in costs.closed_flat:
        left.append(Closure("costs", None))
    return {"leaves": [closure_words(closure, "en") for closure in left]}


def explain(
    query: TypedQuery,
    planner: hn.HybridPlanner,
    outcome: hn.PlanResult | hn.Tour,
    closed: hn.Blocked | None,
    seconds: Seconds,
) -> dict[str, Any]:
    """Explain why there is no path, or, if asked, where a path is tightest."""
    args = query.args
    if (outcome.solved and not args.why) or "outside" in outcome.status:
        return {}
    from hybridnav.reasons.why import explain_solved  # noqa: PLC0415 - loads shapely

    # A name counts only where the leg may choose its end in the room.
    may_choose = outcome.solved and args.at == "anywhere" and not planner.needs_headings
    reasons = []
    with stage("explaining", seconds, "why"):
        for leg, names in zip(_results(outcome), itertools.pairwise(query.waypoints), strict=False):
            if leg.start is None or leg.goal is None or leg.solved != outcome.solved:
                continue
            source = leg.ground
            # All that is closed but the way out of a zone that the leg leaves.
            shut: Any = closed if leg.leaves_m is None or source is None else source.closed
            named: Any = names if may_choose else (None, None)
            reasons.append(explain_solved(planner, (leg.start, leg.goal), named, blocked=shut))
    tightest = min(reasons, key=lambda reason: reason.widest_m, default=None)
    if tightest is None:
        return {"why": None}
    return {"why": tightest.to_dict() | {"words": tightest.words(args.language)}}


def _results(outcome: hn.PlanResult | hn.Tour) -> Sequence[hn.PlanResult]:
    return (outcome,) if isinstance(outcome, hn.PlanResult) else outcome.results


# What is printed, and what is written.


def print_refusal(
    query: TypedQuery, grid: hn.OccupancyGrid, status: hn.PlanStatus, seconds: Seconds
) -> None:
    """Print the answer for points outside the map, as a planner would give it."""
    refused = refused_result(status, query.settings, query.waypoints)
    figures: dict[str, Any] = {}
    if query.args.alternatives > 1:
        # Loads numba, which help and wrong usage can do without.
        from hybridnav.guide.alternatives import unplanned  # noqa: PLC0415

        figures = alternatives_figures(unplanned(refused.status))
    elif query.args.compare:
        figures = compare(refused, None)
    outcome = hn.Tour((refused,), ()) if query.is_tour else refused
    print_answer(query, grid, outcome, figures, seconds)


def print_answer(
    query: TypedQuery,
    grid: hn.OccupancyGrid,
    outcome: hn.PlanResult | hn.Tour,
    beside: dict[str, Any],
    seconds: Seconds,
) -> None:
    """Print a plan or tour, and the figures `beside` it."""
    args = query.args
    by_costs = bool(query.costs) and args.preset is None
    figures = outcome.to_dict() | {"map": str(args.map_file), "by_costs": by_costs}
    if not isinstance(outcome, hn.PlanResult):  # `hn.Tour` would load the words
        figures["words"] = outcome.words(args.language)
    islands, closed = islands_figures(grid), query.closing.to_dict()
    if query.is_tour:
        waypoints = [each if isinstance(each, str) else list(each) for each in query.waypoints]
        figures |= {"waypoints": waypoints, "query": query_of(query.waypoints)}
        figures |= closed | beside | islands
    else:
        figures |= islands | closed | beside
    figures["seconds"] = seconds | figures["seconds"]
    respond(grid, query.waypoints, figures, as_json=args.as_json)


def write_files(
    args: PlanOptions, outcome: hn.PlanResult | hn.Tour, grid: hn.OccupancyGrid
) -> None:
    """Write the poses, the bag and the proof that are asked for."""
    if args.poses is not None:
        hn.export_path(outcome, args.poses)
    if args.bag is not None:
        extension("formats", "bag").save_bag(args.bag, [outcome], grid=grid)
    if args.proof is not None:
        proof = hn.prove(_results(outcome)[0])
        text = json.dumps(proof, separators=(",", ":"), allow_nan=False)
        replace_file(args.proof, text.encode())
