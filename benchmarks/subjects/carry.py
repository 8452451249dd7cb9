"""How many names of rooms and numbers of doors are carried from a map to a later one.

Rooms are found on both maps. A person would carry a name if at least 0.6 of what both maps show of
either room lies in the other, and half of the old room is shown; it is wrong to carry one if either
share is below 0.4. Both are counted with the true transform, cell by cell. A person would carry the
number of a door if a new one lies within half a metre and joins a room that is carried; it is wrong
to carry it to one that passes farther than 1 m away.

Pairs: the office of the project and maps of FOLDER with later ones made of them (turned by any
angle, cropped, bent by drift, with furniture and walls moved and doors shut, seeds 1 to --seeds);
tsc_y3 and tsc_y4, one site in two years, whose frames agree within 5 cm, also turned and cropped;
the three dates of fetch_maps, where the true transform of a pair is that by way of the third date.
The last rows are pairs of maps of different sites: nothing may be carried. The error is the median
of free points, seconds are of processor time without finding the rooms.
Thresholds were set on the office, fetch_maps, GDC 2, and seven maps of small or wide places.
"""

from __future__ import annotations

import itertools
import time
import warnings
from dataclasses import dataclass, field
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from benchmarks.common import NEEDED_DATA, OFFICE, maps_of, option, print_head, print_row
from benchmarks.subjects._carry_pairs import Changes, Pair, changed, doors_to_carry, truth_of
from hybridnav.rooms import carry_names

if TYPE_CHECKING:
    from argparse import Namespace

    from hybridnav.rooms import CarriedNames, Transform

KINDS = {
    "turned": Changes(),
    "cropped": Changes(crop=0.7, furniture=0.02),
    "furniture, walls, doors": Changes(furniture=0.04, walls=6, shut=0.2),
    "drift": Changes(drift=0.003, furniture=0.02),
    "all": Changes(crop=0.8, drift=0.003, furniture=0.03, walls=4, shut=0.2),
}
MADE = (
    "willow/willow-2010-02-18-0.10.yaml",
    "bwi_gdc/3/3.yaml",
    "bwi_gdc/3ne/3ne.yaml",
    "bwi_mapper/intel.yaml",
    "nav2/maps/depot.yaml",
    "strands/g4s/g4s_y2.yaml",
    "giraff_homes/UMA_236_237.yaml",
)
YEARS = "strands/tsc_y3/tsc20160523.yaml", "strands/tsc_y4/tsc_1701.yaml"
DATES = tuple(f"fetch_maps/{name}.yaml" for name in ("3_1_16_localization", "4_26_15", "9_16_15"))
MOST_CELLS = 6_000_000
LEAST_FREE = 10_000
"""Free cells below which a map is left out of the pairs of different sites."""


@lru_cache(20)
def read(path: str) -> hn.OccupancyGrid:
    """Return a map."""
    return hn.load_map(path, robot_radius_m=0)


@lru_cache(20)
def rooms_of(grid: hn.OccupancyGrid) -> hn.RoomLabels:
    """Return the rooms of a map."""
    return hn.find_rooms(grid)


@lru_cache(20)
def topology_of(grid: hn.OccupancyGrid) -> hn.TopologicalMap:
    """Return the topological map with rooms."""
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms_of(grid)))


@dataclass
class Row:
    """The figures of one row, summed over pairs."""

    pairs: int = 0
    found: int = 0
    counts: dict[str, int] = field(default_factory=dict)
    errors: list[tuple[float, float]] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    def add(self, pair: Pair) -> None:
        """Carry the names of a pair, and judge."""
        old, new = rooms_of(pair.old), rooms_of(pair.new)
        begun = time.process_time()
        carried = carry_names(old, pair.old, new, pair.new)
        self.seconds.append(time.process_time() - begun)
        self.pairs += 1
        self.found += carried.transform is not None
        if carried.transform is not None:
            self.errors.append(pair.error(carried.transform))
        self._judge(pair, carried)

    def _judge(self, pair: Pair, carried: CarriedNames) -> None:
        truth = truth_of(pair, rooms_of(pair.old), rooms_of(pair.new))
        to = {n: each.new for n, each in carried.rooms.items() if each.status == "carried"}
        self._count("to carry", len(truth.to_carry))
        self._count("of them", sum(to.get(n) == new for n, new in truth.to_carry.items()))
        self._count("carried", len(to))
        self._count("wrong", sum(each not in truth.allowed for each in to.items()))
        self._count("undecided", len(carried.undecided))
        before, after = topology_of(pair.old).rooms, topology_of(pair.new).rooms
        doors, allowed = doors_to_carry(pair, truth, before, after)
        kept = {n: each.new for n, each in carried.doors.items() if each.status == "carried"}
        self._count("doors to carry", len(doors))
        self._count("doors of them", sum(kept.get(n) in others for n, others in doors.items()))
        self._count("doors carried", len(kept))
        self._count("doors wrong", sum(each not in allowed for each in kept.items()))

    def _count(self, what: str, number: int) -> None:
        self.counts[what] = self.counts.get(what, 0) + number

    def show(self, name: str) -> None:
        """Print the row."""
        of = self.counts
        metres, degrees = (
            (max(each, default=0.0) for each in zip(*self.errors, strict=True))
            if (self.errors)
            else (0.0, 0.0)
        )
        print_row(
            *(name, f"{self.found} of {self.pairs}", f"{of['of them']} of {of['to carry']}"),
            *(f"{of['wrong']} of {of['carried']}", f"{of['undecided']}"),
            f"{of['doors of them']} of {of['doors to carry']}",
            f"{of['doors wrong']} of {of['doors carried']}",
            *(f"{metres:.2f}", f"{degrees:.2f}", f"{max(self.seconds):.1f}"),
        )


def made_pair(grid: hn.OccupancyGrid, seed: int, what: Changes) -> Pair:
    """Return a map and a later one made of it, in which some doors are shut."""
    doors = [
        (*door.position, door.width_m)
        for door in topology_of(grid).rooms.doors
        if not door.is_gap and not door.is_opening
    ]
    return changed(grid, seed, what, np.array(doors).reshape(-1, 3))


def through(old: str, middle: str, new: str) -> Pair:
    """Return the pair of two dates, with the transform by way of a third."""
    steps = [transform(a, b) for a, b in ((old, middle), (middle, new))]
    angle = sum(each.rotation_rad for each in steps)
    return Pair(
        read(old),
        read(new),
        lambda points: steps[0].inverse.moved(steps[1].inverse.moved(points)),
        angle,
    )


@cache
def transform(old: str, new: str) -> Transform:
    """Return the transform that is found between two maps."""
    found = carry_names(rooms_of(read(old)), read(old), rooms_of(read(new)), read(new)).transform
    assert found is not None  # noqa: S101
    return found


def turned_year(data: Path, seed: int, crop: float) -> Pair:
    """Return tsc_y3 with tsc_y4, turned and cropped."""
    old, later = (read(str(data / name)) for name in YEARS)
    made = changed(later, seed, Changes(crop=crop, noise=0.0), np.empty((0, 3)))
    return Pair(old, made.new, made.to_old, made.angle_rad)


OPTIONS = [
    NEEDED_DATA,
    option("--seeds", type=int, default=2),
    option("--others", type=int, default=100, help="pairs of maps of different sites"),
]


def main(given: Namespace) -> None:
    """Print the table."""
    warnings.simplefilter("ignore", hn.errors.MapWarning)
    print_head(
        *("pairs", "transform found", "rooms carried of those to carry", "rooms wrong"),
        *("undecided", "doors carried of those to carry", "doors wrong"),
        *("error, m, at most", "degrees, at most", "s, at most"),
    )
    seeds = range(1, given.seeds + 1)
    old, new = (read(str(given.data / name)) for name in YEARS)
    for name, pairs in {
        "tsc_y3, tsc_y4": [Pair(old, new, lambda points: points, 0.0)],
        "tsc_y4, tsc_y3": [Pair(new, old, lambda points: points, 0.0)],
        "tsc_y3, tsc_y4 turned": [turned_year(given.data, seed, 1.0) for seed in seeds],
        "tsc_y3, tsc_y4 turned, cropped": [turned_year(given.data, seed, 0.7) for seed in seeds],
    }.items():
        row = Row()
        for pair in pairs:
            row.add(pair)
        row.show(name)
    dates = [str(given.data / name) for name in DATES]
    for a, b, c in itertools.permutations(dates):
        row = Row()
        row.add(through(a, b, c))
        row.show(f"{Path(a).stem}, {Path(c).stem}")
    made = [str(OFFICE), *(str(given.data / name) for name in MADE)]
    for kind, what in KINDS.items():
        row = Row()
        for path, seed in itertools.product(made, seeds):
            row.add(made_pair(read(path), seed, what))
        row.show(f"made of {len(made)} maps, {kind}")
    different(given)


def different(given: Namespace) -> None:
    """Print how many pairs of maps of different sites end without a transform."""
    paths = [name for name in maps_of(given.data) if not name.startswith("movingai")]
    pairs = [
        (a, b) for a, b in itertools.combinations(paths, 2) if a.split("/")[0] != b.split("/")[0]
    ]
    rng = np.random.default_rng(0)
    count = carried = 0
    for at in rng.permutation(len(pairs)).tolist():
        if count == given.others:
            break
        grids = [read(str(given.data / name)) for name in pairs[at]]
        sizes = [int((grid.measured == hn.CellClass.FREE).sum()) for grid in grids]
        if max(grid.measured.size for grid in grids) > MOST_CELLS:
            continue
        if min(sizes) < LEAST_FREE:
            continue
        nothing = [hn.RoomLabels((), np.full(grid.shape, -1)) for grid in grids]
        found = carry_names(nothing[0], grids[0], nothing[1], grids[1]).transform
        count += 1
        if found is not None:
            carried += 1
            print(f"transform between {' and '.join(pairs[at])}: {found}")
    print(f"{count} pairs of maps of different sites: {carried} with a transform")
