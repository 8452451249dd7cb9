"""Plans of the preset `robot`: times, costs, proofs, and how steady they are.

    git worktree add /tmp/before 4f9a53394
    python -m benchmarks robot_speed --old /tmp/before --data FOLDER

Each checkout has a process of its own; the two plan the same pairs in turn, and read the points of
the paths. Without --old there is nothing to compare with. Times are those of the processor, the
least of `--runs`; the maps are those of the study. Columns:

    us before       median by pair of the other checkout
    ratio           median by pair of the times, this checkout over the other one
    cost            mean by pair of what this one costs more, and the most, in %
    above           pairs that cost more by over 0.3 %
    A*              median by pair of the times of `grid-astar` by the same costs over this one's;
                    the same where its path is settled and rounded as that of `robot`
    gap             mean of the proved gap, other and this checkout, %; median us of this proof
    steady          part of the plans from points along a line, to its goal, that stay within a cell
                    of its rest, other and this checkout, %
    moved           the same for starts moved by 5 cm, which count for nothing, of this checkout; of
                    lines that leave the old one, what that costs more from there (`keep`), %
"""

import json
import sys
import time
from argparse import Namespace
from functools import cache, cached_property, partial
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.ops import substring

import hybridnav as hn
from benchmarks.common import OFFICE, ROOT, Checkout, prepared, random_pairs, read, timed
from benchmarks.options import MAPS, NEEDED_DATA, SEED, option
from benchmarks.subjects._study_maps import maps_of
from benchmarks.tables import print_head, print_load, print_row

FINISHES: tuple[Any, ...] = (None, "arcs")
N_ALONG, MOVED_M = 50, 0.05
"""Plans from points along a line; how far a start is moved."""
MOST = 0.3
"""Percent that a pair may cost more."""
_CODE = "from benchmarks.subjects.robot_speed import answer_all; answer_all()"
_LINE: dict[str, Any] = {"smooth": "line-of-sight"}


class Asked:
    """The planners of one map, and what is asked about a pair of ends."""

    def __init__(self, file: str) -> None:
        self.planner = prepared(read(Path(file)), "robot")
        self.cell_m = self.planner.grid.resolution_m

    def plan(self, ends: Any, runs: int) -> Any:
        """Return cost and seconds of a plan."""

        def plan() -> Any:
            result = self.planner.plan(*ends)
            return result.cost, result.path and result.path.points

        (cost, _), seconds = timed(plan, runs, time.thread_time)
        return cost, seconds

    def rival(self, ends: Any, runs: int) -> Any:
        """Return the seconds of A* by the same costs, without arcs and with them."""
        plans = (partial(self._rival.plan, *ends, smooth=smooth) for smooth in FINISHES)
        return [timed(plan, runs, time.thread_time)[1] for plan in plans]

    @cached_property
    def _rival(self) -> hn.HybridPlanner:
        costs = hn.CostLayer.clearance(self.planner.grid)
        rival = hn.HybridPlanner(self.planner.topology, preset="grid-astar", costs=costs)
        free = self.planner.grid.frame.points_of(np.argwhere(self.planner.grid.enterable())[:1])
        rival.plan(*free.repeat(2, axis=0), smooth="arcs")  # kernels load
        return rival

    def gap(self, ends: Any, _runs: int) -> Any:
        """Return the gap of a plan, and the seconds of its proof."""
        result = self.planner.plan(*ends)
        _, seconds = timed(lambda: result.lower_bound, clock=time.thread_time)
        return result.gap, seconds

    def steady(self, ends: Any, _runs: int) -> list[float]:
        """Plan again from points along a line; return how far each leaves the old one, cells."""
        path, found = self.planner.plan(*ends, **_LINE).path, []
        assert path is not None  # noqa: S101 - ends lie in one part
        for part in np.linspace(0, 1, N_ALONG + 1)[:-1]:
            rest = substring(shapely.LineString(path.points), part, 1, normalized=True)
            if rest.length < 2 * self.cell_m:
                continue
            again = self.planner.plan(rest.coords[0], rest.coords[-1], **_LINE).path
            if again is not None:  # a point on the side of a closed cell may lie in that
                found.append(self._apart_m(again.points, rest.coords) / self.cell_m)
        return found

    def moved(self, ends: Any, number: int) -> Any:
        """Plan from a start that moved a little; return how far the line leaves the old one in
        cells, and what the old one costs more from there, as a share; None in a wall."""
        angle = np.random.default_rng(number).uniform(0, 2 * np.pi)
        start = ends[0] + MOVED_M * np.array([np.cos(angle), np.sin(angle)])
        old = self.planner.plan(*ends, **_LINE)
        again, kept = (self.planner.plan(start, ends[1], keep=k, **_LINE) for k in (None, old))
        if again.path is None or kept.path is None or old.path is None:
            return None
        apart = self._apart_m(again.path.points, old.path.points) - MOVED_M
        return apart / self.cell_m, kept.cost / again.cost - 1

    def _apart_m(self, *lines: Any) -> float:
        one, other = (shapely.segmentize(shapely.LineString(each), self.cell_m) for each in lines)
        return float(shapely.hausdorff_distance(one, other))


def answer_all() -> None:
    """Answer the questions of standard input."""
    about = cache(Asked)
    for line in sys.stdin:
        what, file, ends, number = json.loads(line)
        sys.stdout.write(json.dumps(getattr(about(file), what)(ends, number)) + "\n")
        sys.stdout.flush()


def measured(sides: list[Checkout], file: Path, given: Namespace) -> dict[str, Any]:
    """Return the figures of one map, by pair, the other checkout first."""
    pairs = random_pairs(read(file), given.pairs, given.seed).tolist()

    def all_say(what: str, pair: Any, number: int = 1, turn: int = 1) -> list[Any]:
        return [side.ask(what, str(file), pair, number) for side in sides[::turn]][::turn]

    all_say("gap", pairs[0])  # kernels load
    plans = [all_say("plan", pair, given.runs, k % 2 * 2 - 1) for k, pair in enumerate(pairs)]
    gaps = [all_say("gap", pair) for pair in pairs[: given.gaps]]
    steady = [all_say("steady", pair) for pair in pairs[: given.steady]]
    moved = [sides[-1].ask("moved", str(file), pair, k) for k, pair in enumerate(pairs)]
    return {
        "plan": np.array(plans),
        "A*": np.array([sides[-1].ask("rival", str(file), pair, given.runs) for pair in pairs]),
        "gap": np.array(gaps).reshape(-1, len(sides), 2),
        "moved": np.array([one for one in moved if one is not None]).reshape(-1, 2),
        "strayed": [list(chain(*side)) for side in zip(*steady, strict=True)],
    }


def row(name: str, found: dict[str, Any]) -> None:
    """Print the line of a map."""
    costs, seconds = found["plan"][..., 0], found["plan"][..., 1]
    more = 100 * (costs[:, -1] / costs[:, 0] - 1)
    apart, dearer = found["moved"].T
    steady = [f"{100 * np.mean(np.array(each) <= 1):.1f}" for each in found["strayed"] if each]
    gaps, proof_s = (
        np.moveaxis(found["gap"], 2, 0) if len(found["gap"]) else (np.empty((0, 0)),) * 2
    )
    print_row(
        name,
        f"{1e6 * np.median(seconds[:, 0]):.0f}",
        f"{np.median(seconds[:, -1] / seconds[:, 0]):.2f}",
        f"{more.mean():+.3f}, {more.max():+.2f}",
        int((more > MOST).sum()),
        " / ".join(f"{x:.2f}" for x in np.median(found["A*"] / seconds[:, -1:], axis=0)),
        " / ".join(f"{100 * np.mean(each):.2f}" for each in gaps.T if each.size)
        + (f"; {1e6 * np.median(proof_s[:, -1]):.0f}" if proof_s.size else ""),
        " / ".join(steady),
        f"{100 * np.mean(apart <= 1):.0f}; {100 * np.mean([0, *dearer[apart > 1]]):.2f}",
    )


OPTIONS = [
    NEEDED_DATA,
    option("--old", type=Path, metavar="PATH", help="another checkout, to be compared with"),
    MAPS,
    option("--pairs", type=int, default=40),
    option("--runs", type=int, default=3),
    option("--gaps", type=int, default=10, help="pairs whose gap is proved"),
    option("--steady", type=int, default=6, help="pairs that are planned again along their lines"),
    SEED,
]


def main(given: Namespace) -> None:
    """Print the table."""
    sides = [Checkout(path / "src", _CODE) for path in (given.old, ROOT) if path is not None]
    print_load()
    heads = "map", "us before", "ratio", "cost", "above", "A*", "gap", "steady", "moved"
    print_head(*heads)
    every: list[dict[str, Any]] = []
    files = [] if given.map else [OFFICE]
    for file in files + [one.path for one in maps_of(given.data, given.map)]:
        every.append(measured(sides, file, given))
        row(f"{file.parent.name}/{file.stem}", every[-1])
    arrays = "plan", "A*", "gap", "moved"
    whole: dict[str, Any] = {key: np.concatenate([each[key] for each in every]) for key in arrays}
    both = zip(*(each["strayed"] for each in every), strict=True)
    row("all pairs", whole | {"strayed": [list(chain(*side)) for side in both]})
    ratios = [np.median(one[:, -1, 1] / one[:, 0, 1]) for one in (each["plan"] for each in every)]
    print(f"ratio: median of the maps {np.median(ratios):.2f}, most {max(ratios):.2f}")
    print_load()
    for side in sides:
        side.process.communicate()
