"""Words that arrive: a walker who knows only the sentences, on floors that nobody looked at.

Needs `bwi_gdc` and `rose2_rooms` of the reference data (or HYBRIDNAV_DATA). Routes lead from the
point of a room to another room, both drawn with a seed.
"""

import re
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import hybridnav as hn
from benchmarks.options import NEEDED_DATA, SEED, option
from benchmarks.subjects._words_walker import Lost, Place, Walker
from benchmarks.tables import print_head, print_row
from hybridnav.guide import Tour
from research._rooms_buildings import Building

REPORTED = ("2", "freiburg_building101", "ubremen-cartesium-demo4")
"""The maps of the reported figures: nobody looks at their routes before the words are finished."""
DEVELOPED = (
    *("3", "3ne", "freiburg_building79", "map15", "map23", "NOGT-intel_map", "map_with_clutter"),
)
"""The maps on which words and walker were developed."""


def topology_of(data: Path, name: str) -> hn.TopologicalMap:
    """Return a floor with people's rooms; those without names are called room-1, room-2, ..."""
    building = Building.read(data, name)
    grid = hn.OccupancyGrid(building.grid.probability, building.grid.frame, robot_radius_m=0.25)
    if building.drawn is not None:
        rooms = hn.load_rooms(data / "bwi_gdc" / name / "locations.yaml", grid)
    else:
        label_of = building.spread(building.true)
        names = tuple(f"room-{number}" for number in range(1, int(label_of.max()) + 2))
        rooms = hn.RoomLabels(names, label_of)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))


def routes(planner: hn.HybridPlanner, count: int, seed: int) -> list[Tour]:
    """Return routes that lead through a door at least."""
    random, names = np.random.default_rng(seed), planner.topology.rooms.names
    found: list[Tour] = []
    for _ in range(50 * count):
        start, goal = (names[k] for k in random.choice(len(names), 2, replace=False))
        tour = hn.plan_tour(planner, [start, goal], at="point")
        if len(found) < count and tour.solved and len(tour.legs) > 1:
            found.append(tour)
    return found


def corrupted(words: Sequence[str], how: str) -> list[str]:
    """Return English sentences with hands swapped, or with other numbers."""
    others = {"left": "right", "right": "left"}
    if how == "numbers":
        others = {"first": "third", "second": "first", "third": "fifth", "fourth": "second"}
        others |= {"fifth": "second", "nearest": "third nearest"}
    pattern = re.compile(rf"\b({'|'.join(others)})\b|(after|for about) (\d+) m")

    def other(found: re.Match[str]) -> str:
        if found[1]:
            return others[found[1]]
        return found[0] if how == "hands" else f"{found[2]} {2 * int(found[3]) + 8} m"

    return [pattern.sub(other, line) for line in words]


def failure(place: Place, tour: Tour, words: Sequence[str], language: str = "en") -> str | None:
    """Return why a walker does not come to the goal of a tour; None if it does.

    How long its metre is, from 0.9 to 1.1 m, depends on the length of the tour.
    """
    start, goal = tour.start, tour.legs[-1].room
    assert start is not None  # noqa: S101 - solved
    stride = float(np.random.default_rng(round(1000 * tour.length_m)).uniform(0.9, 1.1))
    try:
        end = Walker(place, np.array(start[:2]), stride).follow(words, language)
    except Lost as lost:
        return str(lost)
    return None if end == goal else f"came to {end}"


OPTIONS = [
    NEEDED_DATA,
    SEED,
    option("--maps", nargs="+", default=REPORTED),
    option("--routes", type=int, default=20, help="routes on each map"),
    option("-v", "--verbose", action="store_true", help="print the words that lead astray"),
]


def main(given: Namespace) -> None:
    """Print how many walkers arrive."""
    columns = "map", "routes", "en", "de", "en, no signs", "hands swapped", "other numbers"
    print_head(*columns)
    sums = np.zeros(len(columns) - 1, dtype=np.int64)
    for name in given.maps:
        topology = topology_of(given.data, name)
        tours = routes(hn.HybridPlanner(topology), given.routes, given.seed)
        place, blind = Place(topology), Place(topology, has_signs=False)
        counts = np.zeros_like(sums)
        for tour in tours:
            words = tour.words()
            why = failure(place, tour, words)
            walks = [
                why,
                failure(place, tour, tour.words("de"), "de"),
                failure(blind, tour, words),
                failure(place, tour, corrupted(words, "hands")),
                failure(place, tour, corrupted(words, "numbers")),
            ]
            counts += [1, *(each is None for each in walks)]
            if why is not None and given.verbose:
                print(f"{name}: {why}", *words, sep="\n    ")
        print_row(name, *counts.tolist())
        sums += counts
    print_row("all", *sums.tolist())
