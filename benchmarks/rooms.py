"""Rooms against people's labels: segmentation, doors, routes between all pairs of rooms.

    python -m benchmarks.rooms [--data FOLDER] [-o FOLDER]

Needs the floors `bwi_gdc/2`, `3` and `3ne` of the reference data (or HYBRIDNAV_DATA). Tables in
Markdown go to stdout, a picture per floor (true and found) to the folder, `out/rooms` by default.
"""

from __future__ import annotations

import argparse
import itertools
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, get_args

import numpy as np
from matplotlib.figure import Figure

import hybridnav as hn
from benchmarks._rooms_truth import FLOORS, RADIUS_M, Floor
from hybridnav.grid.names import Segmentation
from hybridnav.metrics import compare_rooms
from hybridnav.route import MaxDistanceSearch, RoomSearch
from hybridnav.topology.merging import Segments
from hybridnav.topology.segments import (
    contracted_segments,
    wall_line_segments,
    walled_segments,
    watershed_segments,
)
from hybridnav.viz import plot_rooms

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray
    from hybridnav.metrics import RoomAgreement

METHODS: tuple[Segmentation, ...] = get_args(Segmentation)
SEGMENTS = {
    "wall lines alone": wall_line_segments,
    "walls": walled_segments,
    "watershed": watershed_segments,
    "contraction": contracted_segments,
}
LEAST_M2 = 1.0
NEAR_M = 1.0
"""How far a found door may lie from a true one."""


def only_segments(floor: Floor, method: str) -> hn.RoomLabels:
    """What a method cuts, before segments are merged: only those below the least area are."""
    segments = Segments(SEGMENTS[method](floor.grid), floor.grid.resolution_m)
    segments.merge_small(LEAST_M2)
    labels = segments.label_of
    return hn.RoomLabels(tuple(map(str, range(int(labels.max()) + 1))), labels)


def agreement(floor: Floor, found: hn.RoomLabels) -> RoomAgreement:
    """Found rooms against true ones where both count."""
    return compare_rooms(floor.rooms.label_of[floor.compared], found.label_of[floor.compared])


@dataclass(frozen=True)
class DoorsMet:
    """True doors against found ones."""

    offsets_m: list[float]
    """Distance of each found true door's middle from its found door."""
    n_met: int
    """Found doors that lie at a true one, or where the true rooms change all the same."""
    n_found: int


def doors_met(floor: Floor, found: hn.TopologicalMap) -> DoorsMet:
    """Set doors of found rooms against true ones.

    A true door is found when the rooms on both sides differ and a found door lies near. A found
    door is right when a true one lies near, or when two true rooms lie near it: labels meet in open
    space too, and not every door is drawn. Found doors where nothing is labelled near do not count,
    nor those that the robot cannot reach.
    """
    labels = found.rooms.labels.label_of
    at = np.array([door.position for door in found.rooms.doors]).reshape(-1, 2)
    offsets = []
    for door in floor.reachable_doors:
        sides = labels[tuple(floor.grid.frame.cells_of(door.approaches).T)]
        offset = np.hypot(*(at - door.middle).T).min(initial=np.inf)
        if sides[0] != sides[1] and offset <= NEAR_M:
            offsets.append(float(offset))
    middles = np.array([door.middle for door in floor.doors])
    counted = [n for n in (_rooms_near(floor, point, middles) for point in at) if n is not None]
    return DoorsMet(offsets, sum(counted), len(counted))


def _rooms_near(floor: Floor, point: FloatArray, middles: FloatArray) -> bool | None:
    """Whether a found door is right; None where nothing is known."""
    if np.hypot(*(middles - point).T).min() <= NEAR_M:
        return True
    grid = floor.grid
    row, col = grid.frame.cell_of(*point.tolist())
    reach = round(NEAR_M / grid.resolution_m)
    window = np.s_[max(row - reach, 0) : row + reach + 1, max(col - reach, 0) : col + reach + 1]
    rooms = floor.rooms.label_of[window][floor.compared[window]]
    return None if len(rooms) == 0 else len(np.unique(rooms)) > 1


def segmentation_table(floors: list[Floor]) -> dict[tuple[str, str], hn.RoomLabels]:
    """Print the results of every way on every floor; return what the methods found."""
    print("## Segmentation against the labels\n")
    print(
        f"Cells that are labelled and reachable with a radius of {RADIUS_M:g} m; doors whose two "
        f"approaches are reachable; found within {NEAR_M:g} m of the true middle. A found door is "
        f"right when a true door or two true rooms lie within {NEAR_M:g} m; where nothing is "
        "labelled it does not count.\n"
    )
    print(
        "| floor | method | MCC | rooms found / true | precision | recall | doors | offset, m "
        "| found doors right | s |"
    )
    print("|---|---|---|---|---|---|---|---|---|---|")
    found: dict[tuple[str, str], hn.RoomLabels] = {}
    for floor in floors:
        for method in SEGMENTS:
            _print_row(floor, f"{method}, not merged", only_segments(floor, method), "")
        for method in METHODS:
            began = time.perf_counter()
            rooms = found[floor.name, method] = hn.find_rooms(floor.grid, method=method)
            _print_row(floor, method, rooms, f"{time.perf_counter() - began:.1f}")
    return found


def _print_row(floor: Floor, method: str, found: hn.RoomLabels, seconds: str) -> None:
    score = agreement(floor, found)
    doors = doors_met(floor, floor.topology(found))
    offsets = doors.offsets_m
    total = len(floor.reachable_doors)
    print(
        f"| {floor.name} | {method} | {score.mcc:.3f} | {score.n_found} / {len(score.true_labels)} "
        f"| {score.precision.mean():.2f} | {score.recall.mean():.2f} "
        f"| {len(offsets)} / {total}, {len(offsets) / total:.0%} "
        f"| {np.mean(offsets) if offsets else np.nan:.2f} "
        f"| {doors.n_met} / {doors.n_found}, {doors.n_met / max(doors.n_found, 1):.0%} "
        f"| {seconds} |",
        flush=True,
    )


def room_tables(floors: list[Floor], found: dict[tuple[str, str], hn.RoomLabels]) -> None:
    """Print precision and recall of each room."""
    for floor in floors:
        print(f"\n### Floor {floor.name}, each room: precision / recall\n")
        print(f"| room | m² | {' | '.join(METHODS)} |")
        print(f"|---|---|{'---|' * len(METHODS)}")
        scores = [agreement(floor, found[floor.name, method]) for method in METHODS]
        for row, label in enumerate(scores[0].true_labels.tolist()):
            cells = int((floor.rooms.label_of[floor.compared] == label).sum())
            figures = [f"{score.precision[row]:.2f} / {score.recall[row]:.2f}" for score in scores]
            area_m2 = cells * floor.grid.resolution_m**2
            print(f"| {floor.rooms.names[label]} | {area_m2:.1f} | {' | '.join(figures)} |")


def draw(floor: Floor, found: dict[tuple[str, str], hn.RoomLabels], folder: Path) -> Path:
    """Draw true rooms and what each method found, one below the other."""
    rows, cols = floor.grid.shape
    panels = [("true", floor.rooms), *((m, found[floor.name, m]) for m in METHODS)]
    figure = Figure(figsize=(12.0, len(panels) * 12.0 * rows / cols))
    for axes, (name, labels) in zip(figure.subplots(len(panels)), panels, strict=True):
        topology = floor.topology(labels)
        plot_rooms(topology, ax=axes, names=name == "true", title=f"{floor.name}, {name}")
    path = folder / f"{floor.name}.png"
    figure.savefig(path, dpi=110, bbox_inches="tight")
    return path


def routes_table(floors: list[Floor]) -> bool:
    """Print the routes between all pairs of rooms; return whether every level agrees."""
    print("\n## Routes between every ordered pair of rooms, true rooms\n")
    print(
        "The grid is the preset `grid-astar`, A* on the whole map, between the rooms' points "
        "and between the endpoints that plans from anywhere to anywhere chose. Plans of `portals` "
        "must be solved exactly when it is, and the levels of places and rooms must agree; "
        "connected free cells, labelled by scipy, say the same of any two rooms.\n"
    )
    print(
        "| floor | pairs | solved by the grid, points | anywhere | components against grid "
        "| planner, places, points | planner, rooms, anywhere | longest against grid | s |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    good = True
    for floor in floors:
        began = time.perf_counter()
        topology = floor.topology(floor.rooms)
        found = _all_pairs(floor, topology)
        n_pairs = len(floor.rooms.names) * (len(floor.rooms.names) - 1)
        good &= found.by_component == found.by_point == found.by_set == 0
        seconds = time.perf_counter() - began
        print(
            f"| {floor.name} | {n_pairs:,} | {found.solved:,} | {found.solved_anywhere:,} "
            f"| {found.by_component} disagree | {found.by_point} disagree "
            f"| {found.by_set} disagree | +{found.longest:.2%} | {seconds:.0f} |",
            flush=True,
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
    planner = hn.HybridPlanner(topology, preset="portals")
    on_grid = hn.HybridPlanner(topology, preset="grid-astar")
    names = floor.rooms.names
    places, rooms = MaxDistanceSearch(topology), RoomSearch(topology.rooms)
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
        on_rooms = rooms.search(a, b) is not None
        found.by_set += not (somewhere.solved == any_plan.solved == on_rooms)
        found.solved += best.solved
        found.solved_anywhere += somewhere.solved
        if best.solved and plan.solved and best.cost > 0:
            found.longest = max(found.longest, plan.cost / best.cost - 1)
    return found


def passed_table(floors: list[Floor]) -> None:
    """Print whether the doors that routes pass are doors."""
    print("\n## Passages from room to room on those routes, true rooms\n")
    print(
        "`listed`: at a door of doors.yaml between the same rooms; `neighbours`: the data's "
        "connectivity.yaml joins the rooms, no door is drawn; `label line`: the labels meet in "
        "open space and the data says nothing of it. Gaps between two outlines are passed over.\n"
    )
    print("| floor | passages | listed | neighbours | label line | the last ones |")
    print("|---|---|---|---|---|---|")
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
        figures = " | ".join(map(str, counts))
        print(f"| {floor.name} | {len(kinds)} | {figures} | {'; '.join(rest)} |", flush=True)


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


def main() -> None:
    """Read the command line and print all tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", default=os.environ.get("HYBRIDNAV_DATA"))
    parser.add_argument("-o", "--out", default="out/rooms", type=Path)
    parser.add_argument("--floors", nargs="+", default=FLOORS, choices=FLOORS)
    parser.add_argument("--no-routes", action="store_true", help="segmentation alone")
    arguments = parser.parse_args()
    if not arguments.data:
        sys.exit("give the reference data with --data FOLDER")
    folder = Path(arguments.data) / "bwi_gdc"
    floors = [Floor.read(folder / name) for name in arguments.floors]
    found = segmentation_table(floors)
    room_tables(floors, found)
    arguments.out.mkdir(parents=True, exist_ok=True)
    print("\npictures:", ", ".join(str(draw(floor, found, arguments.out)) for floor in floors))
    if not arguments.no_routes:
        agree = routes_table(floors)
        passed_table(floors)
        if not agree:
            sys.exit("the levels do not agree on what can be reached")


if __name__ == "__main__":
    main()
