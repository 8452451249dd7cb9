"""Buildings in random sequences of all that changes, against planners made anew and an oracle.

`python -m tests.ext.fleet.sequences --buildings 200 --steps 20` changes, in random order, the maps
of floors, the costs of cells, and the journal; each query has closed cells, lines, links and stairs
of its own, and some a profile. Every answer is held against that of a building made anew with the
same state, and, but for profiles, against `tests.ext.fleet.directed`; every report of a line that
lies nowhere in free space, against the cells. It exits with 1 if anything is wrong.
"""

import argparse
import itertools
import math
import sys
import tempfile
import time
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

import hybridnav as hn
from hybridnav.ext.fleet import Building, Floor, Link, LinkEnd
from tests.ext.fleet.directed import Spot, optimum
from tests.one_way import CELLS, random_sides, sides_beside
from tests.oracle.one_way import OneWayPlane
from tests.strategies import occupancy_grid

SHAPE = 6, 7
FLOORS = "0", "1"
LINKS = "lift", "stairs", "ramp"
BY_COSTS = ("grid-astar", "paper")
"""Presets whose costs of cells the oracle knows."""
PRESETS = ("shortest", "octile", "grid-astar", "paper", "robot")
GUEST = hn.Profile(name="guest")
"""Passes no private rooms."""


class Sequence:
    """A building that lives, and what it is made of."""

    def __init__(self, seed: int, preset: str, folder: Path) -> None:
        self.rng = rng = np.random.default_rng([640, seed])
        self.preset = preset
        self.frees = [rng.random(SHAPE) > rng.choice([0.05, 0.2, 0.4]) for _ in FLOORS]
        has_costs = preset in BY_COSTS and rng.random() < 0.5
        self.factors = [self.random_factors() for _ in FLOORS] if has_costs else []
        self.lines = [[self.random_line() for _ in range(rng.integers(0, 3))] for _ in FLOORS]
        """Of the rooms, for good: corners of cells."""
        self.has_places = [True, True]
        ends = [[self.kept_cell(index) for index in range(2)] for _ in LINKS]
        self.links = [
            Link(
                name=name,
                kind=name,  # type: ignore[arg-type]
                ends=tuple(
                    LinkEnd(floor, (col + 0.5, row + 0.5))
                    for floor, (row, col) in zip(FLOORS, cells, strict=True)
                ),
                cost_m=float(rng.integers(0, 4)),
                one_way=[None, None, "up", "down"][rng.integers(4)],  # type: ignore[arg-type]
            )
            for name, cells in zip(LINKS, ends, strict=True)
        ]
        self.journal = hn.Journal(folder / f"house-{seed}-{preset}.yaml")
        self.in_journal: dict[str, tuple[int, list[tuple[int, int]]]] = {}
        """The floor and the line of each item; no corners for a link."""
        self.planners = [self.planner(index) for index in range(2)]
        self.building = self.made(self.planners)

    def random_factors(self) -> Any:
        return self.rng.choice([1.0, 1.0, 2.0, 3.5], SHAPE)

    def random_line(self) -> list[tuple[int, int]]:
        """Corners of a straight line on the map, of a cell or more."""
        row, col = int(self.rng.integers(1, SHAPE[0])), int(self.rng.integers(1, SHAPE[1]))
        up, right = [(0, 1), (1, 0), (0, -1), (-1, 0)][self.rng.integers(4)]
        chain = [(row + k * up, col + k * right) for k in range(int(self.rng.integers(2, 6)))]
        return [(r, c) for r, c in chain if 0 <= r <= SHAPE[0] and 0 <= c <= SHAPE[1]]

    def kept_cell(self, index: int) -> tuple[int, int]:
        """A cell of a floor at which a link ends, free for good."""
        cell = tuple(self.rng.integers(SHAPE).tolist())
        self.frees[index][cell] = True
        return cell

    def topology(self, index: int) -> hn.TopologicalMap:
        label_of = np.zeros(SHAPE, np.int32)
        label_of[:, SHAPE[1] // 2 :] = 1
        label_of[SHAPE[0] // 2 :, SHAPE[1] // 2 :] = 2
        names = tuple(f"{index}-{name}" for name in "abc")
        rules = tuple(rule_of(line) for line in self.lines[index])
        uses = {names[1]: hn.RoomUse(private=True)}
        rooms = hn.RoomLabels(names, label_of, uses=uses, one_way=rules)
        grid = occupancy_grid(self.frees[index].astype(np.uint8))
        return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))

    def layer(self, index: int) -> hn.CostLayer | None:
        return hn.CostLayer(self.factors[index]) if self.factors else None

    def planner(self, index: int) -> hn.HybridPlanner:
        costs = self.layer(index)
        return hn.HybridPlanner(self.topology(index), preset=self.preset, costs=costs)

    def made(self, planners: list[hn.HybridPlanner]) -> Building:
        floors = [Floor(name, one) for name, one in zip(FLOORS, planners, strict=True)]
        return Building(floors, self.links, journal=self.journal)

    # What changes.

    def change(self) -> Iterator[str]:
        """Change one thing; yield what was not reported as it should be."""
        index, kind = int(self.rng.integers(2)), self.rng.integers(4)
        if kind == 0:
            yield from self.change_map(index)
        elif kind == 1 and self.factors:
            self.factors[index] = self.random_factors()
            self.planners[index].update(costs=self.layer(index))
        elif kind == 2 and self.in_journal:
            what = list(self.in_journal)[self.rng.integers(len(self.in_journal))]
            self.journal.open(what)
            del self.in_journal[what]
        else:
            self.close_something(index)

    def change_map(self, index: int) -> Iterator[str]:
        free = self.frees[index] ^ (self.rng.random(SHAPE) < self.rng.choice([0.05, 0.2]))
        for link in self.links:
            x, y = link.ends[index].position_m
            free[int(y), int(x)] = True
        self.frees[index] = free
        alone = self.preset != "paper" and self.rng.random() < 0.5
        self.has_places[index] = not alone
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", hn.errors.MapWarning)
            if alone:
                grid = occupancy_grid(free.astype(np.uint8))
                self.planners[index].update(grid=grid)
            else:
                self.planners[index].update(topology=self.topology(index))
            self.planners[index].plan(*[self.links[0].ends[index].position_m] * 2)
        told = {str(one.message).partition(" lies")[0] for one in caught}
        lost = {
            f"one-way line {number} of the rooms"
            for number, line in enumerate(self.lines[index], start=1)
            if is_lost(line, free) and line not in self.lines[index][: number - 1]  # said once
        }
        if told != lost:
            yield f"reported {told}, lost are {lost}"

    def close_something(self, index: int) -> None:
        link, line = LINKS[self.rng.integers(3)], self.random_line()
        what: str = self.rng.choice(
            [
                f"link:{link}",
                f"link:{link}@{FLOORS[index]}",
                f"one-way:link:{link}={['up', 'down'][self.rng.integers(2)]}",
                *[f"{FLOORS[index]}:one-way:{rule_of(line)}"] * 3,
            ]
        )
        self.journal.close(what)
        self.in_journal[what] = index, [] if "link:" in what else line

    # What is asked.

    def faults(self) -> Iterator[str]:
        """What is wrong with the answer to one random query."""
        rng = self.rng
        spots: list[Spot] = []
        for _ in range(2):
            index = int(rng.integers(2))
            cells = np.argwhere(self.frees[index])
            spots.append((index, tuple(cells[rng.integers(len(cells))].tolist())))
        sides = [np.empty((0, 4), np.int32), np.empty((0, 4), np.int32)]
        shut = [np.zeros(SHAPE, bool), np.zeros(SHAPE, bool)]
        blocked: dict[str, Any] = {}
        for index in np.flatnonzero(rng.random(2) < 0.3).tolist():
            sides[index] = random_sides(rng, *SHAPE)
            shut[index] = self.frees[index] & (rng.random(SHAPE) < rng.choice([0.0, 0.15]))
            for _, cell in (spot for spot in spots if spot[0] == index):
                shut[index][cell] = False
            cells = np.argwhere(shut[index])
            blocked[FLOORS[index]] = {"cells": cells, "one_way": {"sides": sides[index]}}
        names = [*LINKS, *(f"{name}={way}" for name in LINKS for way in ("up", "down"))]
        closed = [name for name in names if rng.random() < 0.07]
        stairs = bool(rng.random() < 0.8)
        profile = GUEST if all(self.has_places) and rng.random() < 0.3 else None
        ends = [(FLOORS[k], (col + 0.5, row + 0.5)) for k, (row, col) in spots]
        how: dict[str, Any] = {"blocked": blocked, "closed_links": closed, "stairs": stairs}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", hn.errors.MapWarning)
            plan = self.building.plan(*ends, profile=profile, **how)
            anew = self.made([self.planner(k) for k in range(2)]).plan(
                *ends, profile=profile, **how
            )
        asked = f"{spots[0]} to {spots[1]}, {profile and profile.name}: "
        for name in ("status", "cost", "lower_bound"):
            one, other = getattr(plan, name), getattr(anew, name)
            if one != other and not (name != "status" and math.isclose(one, other, abs_tol=1e-9)):
                yield f"{asked}{name} is {one}, made anew {other}"
        if profile is None:
            closed += [what.rpartition("link:")[2] for what in self.in_journal if "link:" in what]
            closed += [] if stairs else ["stairs"]
            least = optimum(
                self.building,
                [self.plane(k, shut[k], sides[k]) for k in range(2)],
                spots,
                by_cells=self.preset in CELLS,
                closed=closed,
                factors=self.factors,
            )
            yield from (asked + fault for fault in self.against(plan, least))

    def plane(self, index: int, shut: Any, sides: Any) -> OneWayPlane:
        """A floor as the oracle takes it, with all that has a direction on it."""
        lines = [
            *self.lines[index],
            *(item[1] for item in self.in_journal.values() if item[0] == index),
        ]
        lasting = [side for line in lines for side in sides_beside(line, *SHAPE)]
        both = np.concatenate([sides, np.array(lasting, np.int32).reshape(-1, 4)])
        return OneWayPlane(self.frees[index] & ~shut, both)

    def against(self, plan: Any, least: float) -> Iterator[str]:
        """What the oracle says against a plan."""
        if plan.solved != math.isfinite(least):
            yield f"{plan.status}, the optimum is {least}"
        elif plan.solved:
            # `robot` counts more than lengths, and `paper` may find longer paths.
            most = math.inf if self.preset in {"paper", "robot"} else least
            highest = plan.cost if self.preset == "robot" else least
            if not least - 1e-9 <= plan.cost <= most + 1e-9 or plan.lower_bound > highest + 1e-9:
                yield f"cost {plan.cost}, bound {plan.lower_bound}, the optimum is {least}"


def rule_of(corners: list[tuple[int, int]]) -> hn.OneWayRule:
    (row, col), (last_row, last_col) = corners[0], corners[-1]
    return hn.OneWayRule(line=((col, row), (last_col, last_row)))


def is_lost(line: list[tuple[int, int]], free: Any) -> bool:
    """Whether no side of a line lies between two free cells."""
    sides = sides_beside(line, *SHAPE)
    return not any(free[r, c] and free[to_r, to_c] for r, c, to_r, to_c in sides)


def sequence_faults(seed: int, preset: str, steps: int, folder: Path) -> Iterator[str]:
    """What is wrong in one sequence."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hn.errors.MapWarning)
        sequence = Sequence(seed, preset, folder)
    for step in range(steps):
        for fault in itertools.chain(sequence.change(), sequence.faults()):
            yield f"{preset}, building {seed}, step {step}: {fault}"


def main() -> int:
    """Run sequences; return 1 if anything is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--buildings", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="seed of the first building")
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--presets", nargs="+", default=PRESETS)
    given = parser.parse_args()
    for preset in given.presets:
        began, found = time.process_time(), 0
        with tempfile.TemporaryDirectory() as folder:
            for seed in range(given.first, given.first + given.buildings):
                for fault in sequence_faults(seed, preset, given.steps, Path(folder)):
                    found += 1
                    sys.stdout.write(f"{fault}\n")
        steps, seconds = given.buildings * given.steps, time.process_time() - began
        sys.stdout.write(f"{preset}: {found} wrong of {steps} steps, {seconds:.0f} s\n")
        sys.stdout.flush()
    return int(found > 0)


if __name__ == "__main__":
    sys.exit(main())
