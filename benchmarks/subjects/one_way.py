"""The table of directions: queries with one-way doors, against those without.

The office of `maps/office`, the two floors of `maps/building`, and the maps whose path in FOLDER a
glob of `--map` matches; robot radius 0.25 m, on MovingAI maps 0. Rooms and doors are found in maps.
`--sets` times so many doors as `--doors` says are drawn, each to be passed one way only, and
`--pairs` pairs of points, cells of the largest connected part of a floor. Each pair is planned
without the directions and with them, in turn, the least of three times each; `building` states them
in its file, `building, a query` in each query. A cell of the table is the median of the ratios,
time of the processor with directions over that without, and in brackets how many pairs:

    all       all pairs
    same      the path without directions is legal, or another one costs as much
    other     another path costs more
    none      there is no legal path
    first     the first query with a set of doors, once for each set
    us        the median time of a query without directions, microseconds
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import yaml

import hybridnav as hn
from benchmarks.common import RADIUS_M, ROOT, largest_part, office_and_maps, prepared, read, timed
from benchmarks.options import DATA, MAPS, SEED, option
from benchmarks.tables import print_head, print_load, print_row

if TYPE_CHECKING:
    from argparse import Namespace

    from hybridnav.rooms import Door

COLUMNS = ("all", "same", "other", "none", "first")
RUNS = 3
SAME = 1e-9
"""Metres by which paths of one length may differ."""
BUILDING = ROOT / "maps" / "building" / "building.yaml"


class Drawn(NamedTuple):
    """One set of doors: plans without and with their directions, and pairs of ends."""

    plain: Callable[..., Any]
    directed: Callable[..., Any]
    ends: Callable[[], Iterable[Any]]


def directions(doors: list[Door], n_doors: int, rng: np.random.Generator) -> list[tuple[int, Any]]:
    """Draw doors, and for each the room into which it leads: their places, and the rooms."""
    chosen = rng.permutation(len(doors))[:n_doors].tolist()
    return [(k, doors[k].rooms[rng.integers(2)]) for k in chosen]


def passable(planner: hn.HybridPlanner) -> list[Door]:
    """The doors of a map that the robot fits through."""
    return [door for door in planner.topology.rooms.doors if door.passable]


def on_map(planner: hn.HybridPlanner, n_doors: int, rng: np.random.Generator) -> Drawn:
    """Draw doors of a map."""
    grid, doors = planner.topology.grid, passable(planner)
    cells = largest_part(grid.enterable())
    pairs = [(doors[k].number, room) for k, room in directions(doors, n_doors, rng)]
    directed = partial(planner.plan, one_way=hn.OneWay(doors=pairs))
    return Drawn(
        planner.plan, directed, lambda: grid.frame.points_of(rng.choice(cells, 2, replace=False))
    )


def in_building(
    building: hn.ext.fleet.Building, n_doors: int, rng: np.random.Generator, *, in_file: bool
) -> Drawn:
    """Draw doors of all floors."""
    floors = building.floors
    doors = [(floor.name, door) for floor in floors for door in passable(floor.planner)]
    rules: dict[str, list[hn.OneWayRule]] = {floor.name: [] for floor in floors}
    for k, room in directions([door for _, door in doors], n_doors, rng):
        rules[doors[k][0]].append(hn.OneWayRule(doors[k][1].number, room))
    cells = [largest_part(floor.planner.grid.enterable()) for floor in floors]

    def end() -> tuple[str, Any]:
        k = int(rng.integers(len(floors)))
        return floors[k].name, floors[k].planner.grid.frame.points_of(rng.choice(cells[k], 1))[0]

    one_way = {name: hn.Blocked(one_way=hn.OneWay.of(own)) for name, own in rules.items() if own}
    directed: Callable[..., Any] = partial(building.plan, blocked=one_way)
    if in_file:
        directed = loaded(floors[0].planner.preset.name, rules).plan
    return Drawn(building.plan, directed, lambda: (end(), end()))


def loaded(preset: str, rules: dict[str, list[hn.OneWayRule]]) -> hn.ext.fleet.Building:
    """Load the building with directions in its file."""
    tree = yaml.safe_load(BUILDING.read_text(encoding="utf-8"))
    for floor in tree["floors"]:
        floor |= {key: str(BUILDING.parent / floor[key]) for key in ("map", "rooms")}
        floor["one_way"] = [str(rule) for rule in rules.get(floor["name"], [])]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "building.yaml"
        file.write_text(yaml.safe_dump(tree), encoding="utf-8")
        building = hn.ext.fleet.load_building(file, robot_radius_m=RADIUS_M, preset=preset)
    building.prepare()
    return building


def measure(
    name: str, preset: str, given: Namespace, draw: Callable[[int, np.random.Generator], Drawn]
) -> None:
    """Print the line of one map or building, and of one preset."""
    rng, times = np.random.default_rng(given.seed), list[float]()
    ratios: dict[str, list[float]] = {column: [] for column in COLUMNS}
    for _ in range(given.sets):
        plain_plan, directed_plan, ends_of = draw(given.doors, rng)
        for number in range(given.pairs):
            ends = tuple(ends_of())
            plain, plain_s = timed(partial(plain_plan, *ends), RUNS, time.thread_time)
            asked = partial(timed, partial(directed_plan, *ends), clock=time.thread_time)
            if number == 0:
                ratios["first"].append(asked()[1] / plain_s)
            other, other_s = asked(runs=RUNS)
            is_same = other.cost < np.inf and other.cost <= plain.cost + SAME
            kind = "same" if is_same else "none" if other.cost == np.inf else "other"
            ratios[kind].append(other_s / plain_s)
            ratios["all"].append(other_s / plain_s)
            times.append(plain_s * 1e6)
    row = [f"{np.median(each or [np.nan]):.2f} ({len(each)})" for each in ratios.values()]
    print_row(name, preset, *row, f"{np.median(times):.0f}")


OPTIONS = [
    DATA,
    MAPS,
    option("--preset", action="append", default=[], metavar="NAME"),
    option("--doors", type=int, default=10),
    option("--sets", type=int, default=5),
    option("--pairs", type=int, default=60),
    SEED,
]


def main(given: Namespace) -> None:
    """Run the program."""
    print_load()
    print_head("map", "preset", *COLUMNS, "us")
    presets = given.preset or ("shortest", "octile", "paper")
    for name, file in office_and_maps(given).items():
        for preset in presets:
            planner = prepared(read(file), preset, rooms=True)
            measure(name, preset, given, partial(on_map, planner))
    for preset in presets:
        building = loaded(preset, {})
        measure("building", preset, given, partial(in_building, building, in_file=True))
        measure("building, a query", preset, given, partial(in_building, building, in_file=False))
