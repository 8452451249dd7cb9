"""Rooms against people's labels: segmentation, doors, routes between all pairs of rooms.

Needs `bwi_gdc` and `rose2_rooms` of the reference data (or HYBRIDNAV_DATA). Tables in Markdown go
to stdout, a picture per building (people's rooms and found ones) to the folder, `out/rooms` by
default. The judge of rooms is trained anew for each site, on the others alone.
"""

import itertools
import sys
import time
from argparse import Namespace
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import networkx as nx
import numpy as np

import hybridnav as hn
from benchmarks.options import NEEDED_DATA, option
from benchmarks.tables import print_head, print_row
from hybridnav.rooms.merging import Forest
from hybridnav.route import MaxDistanceSearch
from research._rooms_buildings import SITES, Building
from research._rooms_measures import measures_table
from research._rooms_truth import FLOORS, Floor
from research._rooms_views import cost_table, names_table, views_table

NEAR_M = 1.0
"""How far a passage may lie from a true door."""


def routes_table(floors: list[Floor]) -> bool:
    """Print the routes between all pairs of rooms; return whether every level agrees."""
    print("\n## Routes between every ordered pair of rooms, true rooms\n")
    print(
        "The grid is the preset `grid-astar`, A* on the whole map, between the rooms' points "
        "and between the endpoints that plans from anywhere to anywhere chose. Plans of `octile` "
        "must be solved exactly when it is, and the levels of places and rooms must agree; "
        "connected free cells, labelled by scipy, say the same of any two rooms.\n"
    )
    columns = "floor", "pairs", "solved by the grid, points", "anywhere", "components against grid"
    levels = "planner, places, points", "planner, rooms, anywhere"
    print_head(*columns, *levels, "longest against grid", "s")
    good = True
    for floor in floors:
        began = time.perf_counter()
        topology = floor.topology(floor.rooms)
        found = _all_pairs(floor, topology)
        n_pairs = len(floor.rooms.names) * (len(floor.rooms.names) - 1)
        good &= found.by_component == found.by_point == found.by_set == 0
        seconds = time.perf_counter() - began
        wrong = (found.by_component, found.by_point, found.by_set)
        print_row(
            *(floor.name, f"{n_pairs:,}", f"{found.solved:,}", f"{found.solved_anywhere:,}"),
            *(f"{count} disagree" for count in wrong),
            *(f"+{found.longest:.2%}", f"{seconds:.0f}"),
        )
    return good


@dataclass
class AllPairs:
    """What plans between all ordered pairs of rooms came to."""

    solved: int = 0
    solved_anywhere: int = 0
    by_component: int = 0
    """Pairs for which the grid's search and connected free cells differ."""
    by_point: int = 0
    """Pairs of points for which the grid, the planner and the places differ."""
    by_set: int = 0
    """Pairs of rooms for which the grid, the planner and the room level differ."""
    longest: float = 0.0
    """By how much the planner's path between points exceeds the grid's at most."""


def _all_pairs(floor: Floor, topology: hn.TopologicalMap) -> AllPairs:
    """Plan between all pairs of rooms, by their points and from anywhere to anywhere."""
    planner = hn.HybridPlanner(topology, preset="octile")
    on_grid = hn.HybridPlanner(topology, preset="grid-astar")
    names = floor.rooms.names
    places, part_of = MaxDistanceSearch(topology), room_parts(topology.rooms)
    cells = {n: floor.grid.frame.cell_of(*topology.rooms.point_of(n)) for n in names}
    parts = {
        label: set(np.unique(floor.components[floor.rooms.label_of == label]).tolist()) - {0}
        for label in range(len(names))
    }
    found = AllPairs()
    for (i, a), (j, b) in itertools.permutations(enumerate(names), 2):
        best, plan = on_grid.plan(a, b, at="point"), planner.plan(a, b, at="point")
        on_places = places.search(topology.place_at(cells[a]), topology.place_at(cells[b]))
        any_plan = planner.plan(a, b)
        endpoints = (a, b) if any_plan.path is None else any_plan.path.points[[0, -1]]
        somewhere = on_grid.plan(*endpoints)
        joined = floor.components[cells[a]] == floor.components[cells[b]]
        found.by_component += (joined, bool(parts[i] & parts[j])) != (best.solved, somewhere.solved)
        found.by_point += not (best.solved == plan.solved == (on_places is not None))
        on_rooms = bool(part_of[a] & part_of[b])
        found.by_set += not (somewhere.solved == any_plan.solved == on_rooms)
        found.solved += best.solved
        found.solved_anywhere += somewhere.solved
        if best.solved and plan.solved and best.cost > 0:
            found.longest = max(found.longest, plan.cost / best.cost - 1)
    return found


def room_parts(rooms: hn.Rooms) -> dict[str, set[int]]:
    """The connected parts of the free room level that each room touches."""
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(np.flatnonzero(rooms.is_free).tolist())
    inside = rooms.level.arcs[rooms.is_free[rooms.level.arcs].all(axis=1)]
    graph.add_edges_from(inside.tolist())
    parts = list(nx.connected_components(graph))
    return {
        name: {k for k, part in enumerate(parts) if part & set(rooms.vertices_of(name).tolist())}
        for name in rooms.names
    }


def passed_table(floors: list[Floor]) -> None:
    """Print whether the doors that routes pass are doors."""
    print("\n## Passages from room to room on those routes, true rooms\n")
    print(
        "`listed`: at a door of doors.yaml between the same rooms; `neighbours`: the data's "
        "connectivity.yaml joins the rooms, no door is drawn; `label line`: the labels meet in "
        "open space and the data says nothing of it. Gaps between two outlines are passed over.\n"
    )
    print_head("floor", "passages", "listed", "neighbours", "label line", "the last ones")
    for floor in floors:
        topology = floor.topology(floor.rooms)
        passages = passages_on_routes(topology, hn.HybridPlanner(topology), floor)
        kinds = {passage: kind_of(floor, passage) for passage in passages}
        counts = [sum(kind == k for kind in kinds.values()) for k in KINDS]
        rest = sorted(
            f"{passage.rooms[0]} to {passage.rooms[1]}"
            for passage, kind in kinds.items()
            if kind == "label line"
        )
        print_row(floor.name, len(kinds), *counts, "; ".join(rest))


KINDS = ("listed", "neighbours", "label line")


@dataclass(frozen=True)
class Passage:
    """The route from one named room to the next, through one door, or two with a gap between."""

    rooms: tuple[str, str]
    doors: tuple[hn.Door, ...]


def passages_on_routes(
    topology: hn.TopologicalMap, planner: hn.HybridPlanner, floor: Floor
) -> set[Passage]:
    """The passages on routes between all pairs of reachable rooms."""
    cells = {n: floor.grid.frame.cell_of(*topology.rooms.point_of(n)) for n in floor.rooms.names}
    names = [name for name in floor.rooms.names if floor.reachable[cells[name]]]
    met = set()
    for pair in itertools.combinations(names, 2):
        room, doors = None, list[hn.Door]()
        for leg in hn.plan_tour(planner, pair, at="point").legs:
            if leg.room is not None:
                if room is not None and leg.room != room:
                    met.add(_passage(room, leg.room, doors))
                room, doors = leg.room, []
            if leg.door is not None:
                doors.append(leg.door)
    return met


def _passage(room: str, other: str, doors: list[hn.Door]) -> Passage:
    forward = room < other
    ordered = tuple(doors if forward else doors[::-1])
    return Passage((room, other) if forward else (other, room), ordered)


def kind_of(floor: Floor, passage: Passage) -> str:
    """Return what the data holds on a passage between true rooms."""
    rooms = frozenset(passage.rooms)
    for true in floor.doors:
        offsets = [np.hypot(*(true.middle - door.position)) for door in passage.doors]
        if rooms == frozenset(true.rooms) and min(offsets) <= NEAR_M:
            return KINDS[0]
    return KINDS[1] if rooms in floor.neighbours else KINDS[2]


ALONE: dict[str, Callable[[Namespace], None]] = {
    "cost": lambda given: cost_table(given.data),
    "names": lambda given: names_table(given.data),
    "views": lambda given: views_table(
        [Building.read(given.data, name) for name in given.building or SITES],
        lambda _: Forest.shipped(),
    ),
}
"""Tables that need no judge of their own, and so no training."""

OPTIONS = [
    NEEDED_DATA,
    option("-o", "--out", default="out/rooms", type=Path),
    option("--no-routes", action="store_true", help="segmentation alone"),
    option("--only", choices=sorted(ALONE), help="one table, by the judge of the package"),
    option("--building", action="append", choices=sorted(SITES), help="views of these alone"),
    option("--generated", type=int, default=0, metavar="N", help="judge of N generated floors"),
]


def main(given: Namespace) -> None:
    """Read the command line and print all tables."""
    if given.only:
        ALONE[given.only](given)
        return
    given.out.mkdir(parents=True, exist_ok=True)
    measures_table(given.data, given.out, given.generated)
    if not given.no_routes:
        floors = [Floor.read(given.data / "bwi_gdc" / name) for name in FLOORS]
        agree = routes_table(floors)
        passed_table(floors)
        if not agree:
            sys.exit("the levels do not agree on what can be reached")
