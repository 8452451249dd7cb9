"""What is wrong with the graph of a building that others have made, and with its routes."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np

from hybridnav._base.clock import clock
from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet.building import Building
from hybridnav.ext.fleet.checks import parts_of
from hybridnav.ext.fleet.graph_match import (
    Answer,
    BuildingGraphCheck,
    BuildingGraphReport,
    MatchedGraph,
    MatchedLink,
    RouteCounts,
    rides_of,
)
from hybridnav.ext.fleet.graph_network import BuildingNetwork, GraphRoute, Position
from hybridnav.ext.fleet.links import Link
from hybridnav.ext.fleet.plan import BuildingPlan
from hybridnav.graphs.check import GraphCheck, check_graph
from hybridnav.graphs.free_space import LEAST_AREA_M2
from hybridnav.graphs.gather import Findings, shown
from hybridnav.graphs.judge import excess_of
from hybridnav.graphs.waypoint_graph import (
    add_one_way,
    components_of,
    cut_off,
    islands,
    one_way_nodes,
)
from hybridnav.maps.checks import checked_between, checked_type
from hybridnav.planning.settings import ShortestSettings
from hybridnav.rooms.find import outside_of


def check_building_graph(matched: MatchedGraph) -> BuildingGraphCheck:
    """Find the faults of the graph of a building.

    Each floor is checked as by `check_graph`, but a node is `one-way`, and a component an `island`,
    only if routes over other floors lead there neither. `graphs.BUILDING_KINDS` lists the kinds of
    findings beside them. The graph need not have links that the robot does not fit in.

    Parameters
    ----------
    matched
        The graph, matched to the building.

    Raises
    ------
    InvalidValueError
        When a map allows corner cutting.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, building_graph
    >>> from hybridnav.ext.fleet import check_building_graph, match_graph
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = Building([Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")])
    >>> drawn = building_graph(Building(house.floors[:1]))
    >>> check = check_building_graph(match_graph(house, drawn))
    >>> [found.kind for found in check.findings]
    ['floor-missing']
    """
    checked_type("matched", matched, MatchedGraph)
    building = matched.building
    findings = Findings()
    for floor in building.floors:
        if floor.name not in matched.floors:
            findings.add("floor-missing", f"floor {floor.name}")
    for name in matched.unknown_floors:
        findings.add("floor-unknown", f"floor {shown(name)}")
    network = BuildingNetwork(matched)
    _add_links(findings, matched, network)
    _add_pieces(findings, network)
    return BuildingGraphCheck(matched, _checked_floors(network), findings.collected())


def _checked_floors(network: BuildingNetwork) -> dict[str, GraphCheck]:
    """Return what is wrong on each floor, by its name; routes there and back may lead over others,
    by the links of the graph that this robot fits in."""
    one_way = one_way_nodes(network.n_nodes, network.edges())
    checks = {}
    for floor in network.floors.values():
        graph = floor.graph.graph
        check = check_graph(network.building.floor(floor.name).planner.topology, graph)
        findings = Findings()
        findings.add_all(finding for finding in check.findings if finding.kind not in _WHOLE)
        here = one_way - floor.base
        add_one_way(findings, graph, here[(here >= 0) & (here < graph.n_nodes)])
        checks[floor.name] = replace(check, findings=findings.collected())
    return checks


def _add_links(findings: Findings, matched: MatchedGraph, network: BuildingNetwork) -> None:
    met = {link.own.name for link in matched.links if link.own is not None}
    for own in matched.building.links:
        if own.name not in met and own.admits(matched.building.robot_radius_m):
            findings.add("link-missing", f"{own.kind} {own.name}")
    for link in matched.links:
        what = f"{link.drawn.kind} {shown(link.drawn.name)}"
        if link.own is None:
            findings.add("link-unknown", what, *link.ends.values())
        else:
            _add_link(findings, link, link.own, network)


def _add_link(findings: Findings, link: MatchedLink, own: Link, network: BuildingNetwork) -> None:
    """Add what is wrong with a link that stands for one of the building."""
    what = f"{link.drawn.kind} {shown(link.drawn.name)}"
    drawn_on = {floor.name for floor in network.floors.values()}
    if own.kind != link.drawn.kind:
        findings.add("link-kind", f"{what}, which is of the kind {own.kind}")
    for one, other, may in rides_of(link):
        if not may:
            findings.add("link-against", f"{what} from floor {one} to {other}", link.ends[one])
    for end in own.ends:
        if end.floor in drawn_on and end.floor not in link.ends:
            findings.add("stop-missing", f"{what} at floor {end.floor}", end.position_m)
    for floor, point in link.ends.items():
        fault = network.stop_fault(link, floor)
        if fault:
            kind = "stop-unknown" if own.end_on(floor) is None else "stop-elsewhere"
            findings.add(kind, f"{what} at floor {floor}: {fault}", point)


def _add_pieces(findings: Findings, network: BuildingNetwork) -> None:
    """Add pieces of the graph that no edge or ride connects, in one part of the building or not."""
    part_of = _parts(network)
    piece_of = components_of(network.n_nodes, network.edges(), "weak")
    for kind, find in (("pieces", cut_off), ("island", islands)):
        for index, count, most in find(part_of, piece_of):
            floor, node = network.node(index)
            graph = floor.graph.graph
            where = f"{count} nodes with node {shown(graph.names[node])} of floor {floor.name}"
            x, y = graph.points[node].tolist()
            findings.add(kind, f"{where}, apart from {most}", (x, y))


def _parts(network: BuildingNetwork) -> LongArray:
    """Return the part of the building that each node lies in, int64 (n,), -1 in no free cell: parts
    of floors that links join are one."""
    part_at = [parts_of(floor) for floor in network.building.floors]
    bases = np.cumsum([0, *(int(labels.max(initial=-1)) + 1 for labels in part_at)]).tolist()
    joined = []
    names = [floor.name for floor in network.building.floors]
    for link in network.building.links:
        if link.admits(network.building.robot_radius_m):
            at = []
            for end in link.ends:
                index = names.index(end.floor)
                grid = network.building.floors[index].planner.grid
                part = int(part_at[index][grid.frame.cell_of(*end.position_m)])
                at += [bases[index] + part] if part >= 0 else []
            joined += [(at[0], other) for other in at[1:]]
    whole = components_of(bases[-1], np.array(joined, dtype=np.int64).reshape(-1, 2), "weak")
    part_of = np.full(network.n_nodes, -1, dtype=np.int64)
    for index, floor in network.floors.items():
        free = np.flatnonzero(floor.placed.is_free)
        labels = part_at[index][tuple(floor.placed.cells[free].T)]
        part_of[floor.base + free] = whole[bases[index] + labels]
    return part_of


# How the routes on the graph of a building compare with its shortest ones, over all floors.


_MOST_EXAMPLES = 100
_WHOLE = frozenset({"one-way", "island"})
"""Kinds that hold of the graph of all floors, not of each."""
_ROUNDED = 1.0 - 1e-9
"""Factor on the optimum below which no route costs, sums being rounded."""


@dataclass(frozen=True)
class _Judged:
    answer: Answer
    cost: float
    optimum: float
    steps: int
    expanded: int
    seconds: tuple[float, float]
    is_same_floor: bool


def judge_building_graph(
    matched: MatchedGraph,
    *,
    pairs: int = 400,
    seed: int = 0,
    stairs: bool = True,
    clear_edges_only: bool = False,
) -> BuildingGraphReport:
    """Compare routes on the graph of a building with its own, over all floors.

    Half of the pairs have both ends on one floor, half on two. A route runs straight from the start
    to the nearest node in sight of it. It takes the edges and rides that cost least to the nearest
    node in sight of the goal, and runs straight to the goal, as in `evaluate --graph`. Rides have
    the charge of the building, whatever the graph states, and the distance from the nodes of the
    graph to the ends of the building's link. The optimum is that of `Building.plan`.

    An answer is `solved`, or `contradicted` where the route leads through a wall, takes a ride that
    the building does not have, or costs less than the optimum. It is `no path, wrong` where the
    building has a route and the graph has none, and `no path, right` where neither has. It is `no
    node in sight` where the graph does not reach an end.

    Parameters
    ----------
    matched
        The graph, matched to the building.
    pairs
        Number of random pairs of free cells, in parts of 1 m² or more.
    seed
        Seed of the pairs.
    stairs
        Whether the robot takes stairs.
    clear_edges_only
        Whether edges and rides that the robot cannot follow are left out; else the graph is taken
        as it is.

    Raises
    ------
    InvalidValueError
        When the planners of the building do not find shortest paths in free space, or there is no
        pair.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, Link, LinkEnd, building_graph
    >>> from hybridnav.ext.fleet import judge_building_graph, match_graph
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floors = [Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")]
    >>> ends = LinkEnd("1", (0.5, 0.5)), LinkEnd("2", (0.5, 0.5))
    >>> house = Building(floors, [Link(name="lift", kind="lift", ends=ends)])
    >>> matched = match_graph(house, building_graph(house))
    >>> judge_building_graph(matched, pairs=20).counts["all"].answers
    {'solved': 20}
    """
    checked_type("matched", matched, MatchedGraph)
    checked_between("pairs", pairs, 1, 1e6)
    building = matched.building
    _check_planners(building)
    network = BuildingNetwork(matched, stairs=stairs, clear_edges_only=clear_edges_only)
    judged: list[_Judged] = []
    contradictions: list[str] = []
    for start, goal in drawn_pairs(building, pairs, np.random.default_rng(seed)):
        one, why = _judged(network, start, goal, stairs=stairs)
        judged.append(one)
        if why and len(contradictions) < _MOST_EXAMPLES:
            ends = (_end(building, end) for end in (start, goal))
            where = " to ".join(f"{name}:{x:.2f},{y:.2f}" for name, (x, y) in ends)
            contradictions.append(f"{where}: {why}")
    groups = {
        "one floor": [one for one in judged if one.is_same_floor],
        "two floors": [one for one in judged if not one.is_same_floor],
        "all": judged,
    }
    return BuildingGraphReport(
        {name: _counts(group) for name, group in groups.items() if group}, tuple(contradictions)
    )


def _check_planners(building: Building) -> None:
    preset = building.floors[0].planner.preset
    settings = preset.planner
    is_plain = isinstance(settings, ShortestSettings) and not settings.allow_unexplored
    if not is_plain or settings.epsilon or settings.budget_s:
        raise InvalidValueError(
            f"the building is planned by preset {preset.name}, and routes are compared with "
            "shortest paths in free space: load it with preset shortest"
        )


def drawn_pairs(
    building: Building, count: int, rng: np.random.Generator
) -> list[tuple[Position, Position]]:
    """Draw pairs of centres of free cells, every second one on two floors if there are several."""
    cells_of: dict[int, FloatArray] = {}
    for index, floor in enumerate(building.floors):
        labels = parts_of(floor)
        area_m2 = np.bincount(labels[labels >= 0], minlength=1).astype(np.float64)
        area_m2 *= floor.planner.grid.cell_area_m2
        is_inside = (labels >= 0) & ~outside_of(floor.planner.grid)
        large = np.argwhere(is_inside & (area_m2[labels] >= LEAST_AREA_M2))
        if len(large):
            cells_of[index] = large.astype(np.float64) + 0.5
    if not cells_of:
        raise InvalidValueError(
            f"no floor has a part of {LEAST_AREA_M2:g} m² of free space for a robot radius of "
            f"{building.robot_radius_m:g} m: lower the radius"
        )
    floors = list(cells_of)
    drawn = []
    for number in range(count):
        first = int(rng.choice(floors))
        others = [floor for floor in floors if floor != first] if number % 2 else []
        last = int(rng.choice(others)) if others else first
        start, goal = (cells_of[at][rng.integers(len(cells_of[at]))] for at in (first, last))
        drawn.append(((first, start), (last, goal)))
    return drawn


def _judged(
    network: BuildingNetwork, start: Position, goal: Position, *, stairs: bool
) -> tuple[_Judged, str]:
    """Return the answer of a graph to one pair, and why the building contradicts it."""
    began = clock()
    route = network.route(start, goal)
    graph_s = clock() - began
    building = network.building
    ends = [_end(building, end) for end in (start, goal)]
    began = clock()
    plan = building.plan(ends[0], ends[1], stairs=stairs)
    seconds = graph_s, clock() - began
    answer, why = _answer(route, plan)
    cost, steps, expanded = math.inf, 0, 0
    if not isinstance(route, str):
        cost, expanded = route.cost, route.expanded
        steps = sum(len(line) - 1 for line in route.lines) + len(route.rides)
    is_same_floor = start[0] == goal[0]
    return _Judged(answer, cost, plan.cost, steps, expanded, seconds, is_same_floor), why


def _answer(route: GraphRoute | str, plan: BuildingPlan) -> tuple[Answer, str]:
    """Return the answer of a graph, and why the plan of the building contradicts it."""
    if isinstance(route, str):
        if route:
            return "no node in sight", ""
        if not plan.solved:
            return "no path, right", ""
        by = ", ".join(ride.link.name for ride in plan.rides)
        way = f" by {by}" if by else ""
        return "no path, wrong", f"the graph has no route, and the building has one{way}"
    if route.fault:
        return "contradicted", route.fault
    if route.cost < plan.lower_bound * _ROUNDED:
        return "contradicted", f"it costs {route.cost!r} m, below {plan.lower_bound!r} m"
    return "solved", ""


def _counts(judged: Sequence[_Judged]) -> RouteCounts:
    counted = Counter(one.answer for one in judged)
    answers = {answer: counted[answer] for answer in get_args(Answer) if counted[answer]}
    solved = [one for one in judged if one.answer == "solved"]
    compared = np.array([(one.cost, one.optimum) for one in solved if one.optimum > 0])
    excess = excess_of(*compared.T) if len(compared) else None
    efforts = [(one.steps, one.expanded) for one in solved] or [(0, 0)]
    seconds = np.median([one.seconds for one in judged], axis=0).tolist()
    steps, expanded = np.mean(efforts, axis=0).tolist()
    return RouteCounts(answers, excess, steps, expanded, tuple(seconds))


def _end(building: Building, end: Position) -> tuple[str, FloatArray]:
    """Return the name of a floor, and a point on it in metres."""
    floor = building.floors[end[0]]
    return floor.name, floor.planner.grid.frame.points_of_grid(end[1][None])[0]
