"""What a route over floors costs beside plans on one floor, and how fast a building loads.

The building has floors 2 and 3 of the GDC building (Building-Wide Intelligence project, `bwi_gdc`
of the reference data), with its three lifts by the names of their rooms; the third floor is the map
of floor 2 once more, and the ten floors are both in turn. Queries go from the lowest of three
floors to the highest. A single query is one of `HybridPlanner.plan` between two points of one of
these floors; both kinds take turns in one process. Timings of a shared machine vary: read the
ratios.
"""

from __future__ import annotations

import statistics
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from benchmarks.common import NEEDED_DATA, option, timed

if TYPE_CHECKING:
    from argparse import Namespace
    from collections.abc import Sequence

    from hybridnav._base.typing import FloatArray

LIFTS = ("south", "east", "west")
SLACK_US = 200.0
"""Microseconds beside three single queries that a query over three floors may take."""


def description(data: Path, names: Sequence[str], maps: Sequence[str]) -> str:
    """The YAML of a building of GDC's floors: `names` of floors, and the floor whose map each
    has."""
    lines = ["floors:"]
    for number, (name, of) in enumerate(zip(names, maps, strict=True)):
        folder = data / "bwi_gdc" / of
        files = f'map: "{folder / f"{of}.yaml"}", rooms: "{folder / "locations.yaml"}"'
        lines.append(f'- {{name: "{name}", elevation_m: {4.0 * number}, {files}}}')
    lines.append("links:")
    for lift in LIFTS:
        lines += [f"- name: {lift} lift", "  kind: lift", "  wait_s: 20", "  ride_s: 8", "  ends:"]
        for name, of in zip(names, maps, strict=True):
            lines.append(f'  - {{floor: "{name}", room: l{of}_elev_{lift}}}')
    return "\n".join(lines) + "\n"


def built(
    data: Path, folder: Path, names: Sequence[str], maps: Sequence[str]
) -> hn.ext.fleet.Building:
    """A prepared building of GDC's floors."""
    file = folder / "building.yaml"
    file.write_text(description(data, names, maps), encoding="utf-8")
    building = hn.ext.fleet.load_building(file, robot_radius_m=0.25)
    building.prepare()
    return building


def reachable(
    building: hn.ext.fleet.Building, floor: str, count: int, seed: int
) -> list[FloatArray]:
    """Free points of a floor from which its first lift can be reached."""
    planner = building.floor(floor).planner
    grid, end = planner.topology.grid, building.links[0].end_on(floor)
    assert end is not None  # noqa: S101 - the lift stops on every floor
    rng = np.random.default_rng(seed)
    cells = np.argwhere(grid.enterable())
    points = grid.frame.points_of(cells[rng.integers(len(cells), size=4 * count)])
    batch = planner.plan_many(points, np.tile(end.position_m, (len(points), 1)))
    found: list[FloatArray] = list(points[np.isfinite(batch.cost)][:count])
    return found


def compare_queries(building: hn.ext.fleet.Building, count: int) -> None:
    """Print what a query over three floors takes beside single ones."""
    names = [floor.name for floor in building.floors]
    low, high = (reachable(building, name, count, seed) for seed, name in enumerate(names[::2]))
    lower, upper = (building.floor(name).planner for name in names[::2])
    across: list[float] = []
    single: list[float] = []
    planned = []
    for number, (start, goal) in enumerate(zip(low, high, strict=False)):
        plan = building.plan((names[0], start), (names[2], goal))
        assert plan.solved  # noqa: S101 - all lifts stop everywhere
        assert plan.gap == 0.0  # noqa: S101 - shortest is exact
        ends = (names[0], start), (names[2], goal)
        across.append(1e6 * timed(partial(building.plan, *ends), 3)[1])
        planner, points = ((lower, low), (upper, high))[number % 2]
        other = points[(number + 1) % len(points)]
        single.append(1e6 * timed(partial(planner.plan, points[number], other), 3)[1])
        planned.append(len(plan.results))
    over, one = statistics.median(across), statistics.median(single)
    mean_over, mean_one = statistics.fmean(across), statistics.fmean(single)
    limit = 3 * one + SLACK_US
    print(f"{len(across)} queries over three floors, {np.mean(planned):.2f} floors driven on")
    print(f"median     {over:.0f} us over floors, {one:.0f} us single: {over / one:.2f} times")
    print(f"mean       {mean_over:.0f} us and {mean_one:.0f} us: {mean_over / mean_one:.2f} times")
    print(f"aim        below {limit:.0f} us (three single ones and 200 us): {over / limit:.2f}")


def compare_loading(building: hn.ext.fleet.Building, folder: Path) -> None:
    """Print how long the model of a building takes to load, and to answer its first query."""
    file = folder / "building.hnm"
    hn.save(building, file)
    first, last = building.floors[0], building.floors[-1]
    start = reachable(building, first.name, 1, 0)[0]
    goal = reachable(building, last.name, 1, 1)[0]
    seconds, computed, answered = [], [], []
    for _ in range(5):
        began, cpu = time.perf_counter(), time.process_time()
        loaded = hn.ext.fleet.load_building(file)
        seconds.append(time.perf_counter() - began)
        computed.append(time.process_time() - cpu)
        plan = loaded.plan((first.name, start), (last.name, goal))
        answered.append(time.perf_counter() - began)
        assert plan.solved  # noqa: S101 - all lifts stop everywhere
    size = file.stat().st_size / 1e6
    print(f"{len(building.floors)} floors in {size:.0f} MB")
    print(f"loads      in {min(seconds):.3f} s, median {statistics.median(seconds):.3f} s")
    print(f"           with {statistics.median(computed):.3f} s of the processor, on all cores")
    print(f"answers    after {min(answered):.3f} s, median {statistics.median(answered):.3f} s")
    print(f"aim        below 1 s: {statistics.median(seconds):.2f}")


OPTIONS = [
    NEEDED_DATA,
    option("--queries", type=int, default=300),
]


def main(given: Namespace) -> None:
    """Measure both aims of buildings."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        compare_queries(built(given.data, folder, ("2", "3", "4"), ("2", "3", "2")), given.queries)
        names = [str(number) for number in range(1, 11)]
        ten = built(given.data, folder, names, ["2", "3"] * 5)
        # Planners of floors with one map are one: a building of ten maps has ten.
        floors = [
            hn.ext.fleet.Floor(floor.name, own_planner(floor.planner), floor.elevation_m)
            for floor in ten.floors
        ]
        ten = hn.ext.fleet.Building(floors, ten.links)
        ten.prepare()
        compare_loading(ten, folder)


def own_planner(planner: hn.HybridPlanner) -> hn.HybridPlanner:
    """Another planner of the same map."""
    return hn.HybridPlanner(planner.topology, preset=planner.preset, prepared=planner.prepared)
