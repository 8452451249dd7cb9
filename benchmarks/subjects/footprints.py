"""The table of footprints: what two discs answer before OMPL is asked, beside OMPL alone.

A cart of 0.9 x 0.6 m that turns on the spot and drives ahead (`differential`), 25 queries on each
of eight maps of FOLDER, which are inflated by 0.3 m. Start and goal are poses in which the cart
stands, drawn from all such cells, also from those that no path joins. The same queries go to the
preset `ompl` and to the same preset without the discs. Columns: solved, proved to have no path, and
neither; what answered (the circumscribed disc, the inscribed one, OMPL, the grid's path); seconds,
median / p95; loss over the bound, that no disc is shorter, mean / p95, of the queries that both
solved. `near` counts paths of which a pose comes within 2 cm of an obstacle, by `MotionCheck`.
"""

from __future__ import annotations

from collections import Counter
from functools import partial
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

import hybridnav as hn
from benchmarks.common import (
    NEEDED_DATA,
    SEED,
    matches,
    option,
    print_head,
    print_load,
    print_row,
    read,
    timed,
)
from hybridnav.planning import load_preset
from hybridnav.planning.result import Answer
from hybridnav.refine import MotionCheck
from hybridnav.refine.footprint import Footprint

if TYPE_CHECKING:
    from argparse import Namespace

    from hybridnav._base.typing import FloatArray

MAPS = (
    "willow/willow-2010-02-18-0.10.yaml",
    "bwi_gdc/3/3.yaml",
    "strands/tsc_y4/tsc_1701.yaml",
    "radish_grids/intel.yaml",
    "radish_grids/freiburg-101.yaml",
    "nav2/maps/depot.yaml",
    "cob_environments/ipa-production-plant/map.yaml",
    "aws_small_warehouse/002/map.yaml",
)
CART = [[0.45, 0.3], [0.45, -0.3], [-0.45, -0.3], [-0.45, 0.3]]
NEAR_M = 0.0199
Timed = tuple[hn.PlanResult, float]


def poses_of(check: MotionCheck, grid: hn.OccupancyGrid, pairs: int, seed: int) -> list[FloatArray]:
    """Poses in which the cart stands, float64 (2, 3) for each pair."""
    cells, rng = np.argwhere(grid.enterable()), np.random.default_rng(seed)
    found: list[FloatArray] = []
    while len(found) < 2 * pairs:
        pose = np.append(grid.frame.points_of(rng.choice(cells, 1)), rng.uniform(-np.pi, np.pi))
        if check.state_valid(*pose.tolist()):
            found.append(pose)
    return [np.stack(found[i : i + 2]) for i in range(0, len(found), 2)]


def is_near(path: hn.Path, check: MotionCheck) -> bool:
    """Whether a pose of a path fails the check of a larger cart."""
    poses = np.column_stack([path.points, path.headings_at_points])
    return not all(check.state_valid(*pose) for pose in poses.tolist())


def cells_of(answers: list[Timed], gaps: list[float], near: int) -> list[str]:
    """The cells of a row of the table."""
    kinds = Counter("solved" if r.solved else str(r.status) for r, _ in answers)
    by = Counter(r.refinement.by for r, _ in answers if r.refinement is not None and _is_told(r))
    seconds = np.array([s for _, s in answers])
    solved, none = kinds["solved"], kinds["no path"]
    loss = np.array(gaps or [np.nan]) * 100
    return [
        f"{solved} of {len(answers)}",
        str(none),
        str(len(answers) - solved - none),
        " / ".join(str(by[name]) for name in get_args(Answer)),
        f"{np.median(seconds) * 1e3:.1f} / {np.percentile(seconds, 95) * 1e3:.0f} ms",
        f"{loss.mean():.2f} / {np.percentile(loss, 95):.1f} %",
        str(near),
    ]


def _is_told(result: hn.PlanResult) -> bool:
    """Whether there is an answer at all."""
    return result.solved or result.status is hn.PlanStatus.NO_PATH


OPTIONS = [
    NEEDED_DATA,
    SEED,
    option("--map", action="append", default=[], metavar="GLOB"),
    option("--pairs", type=int, default=25),
    option("--padding", type=float, default=0.0, help="footprint_padding_m"),
    option("--budget", type=float, default=1.0, help="seconds of a query"),
]


def main(given: Namespace) -> None:
    """Run the program."""
    print_load()
    columns = "none", "neither", "circumscribed / inscribed / OMPL / grid", "time", "loss", "near"
    print_head("map", "method", "solved", *columns)
    wanted = [name for name in MAPS if not given.map or matches(name, given.map)]
    padding, budget = f"footprint_padding_m: {given.padding}", f"budget_s: {given.budget}"
    section = f"{{space: differential, footprint: {CART}, {padding}, {budget}}}"
    preset = load_preset("ompl", overrides=[f"planner.ompl={section}"])
    every: dict[str, tuple[list[Timed], list[float], int]] = {}
    for name in wanted:
        grid = read(given.data / name, 0.3)
        cart = MotionCheck(grid, footprint=Footprint.of(CART).padded(given.padding))
        wide = MotionCheck(grid, footprint=Footprint.of(CART).padded(NEAR_M))
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
        queries, answers = poses_of(cart, grid, given.pairs, given.seed), {}
        for method in ("discs and OMPL", "OMPL alone"):
            planner: Any = hn.HybridPlanner(topology, preset=preset)
            planner.prepare()
            if method == "OMPL alone":
                planner._now.ompl.discs = None  # noqa: SLF001 - no setting: nobody wants it
            planner.plan(*queries[0])
            answers[method] = [timed(partial(planner.plan, *query)) for query in queries]
            planner.close()
        both = [a[0].solved and b[0].solved for a, b in zip(*answers.values(), strict=True)]
        for method, found in answers.items():
            gaps = [r.gap for (r, _), is_both in zip(found, both, strict=True) if is_both]
            near = sum(is_near(r.path, wide) for r, _ in found if r.path is not None and r.solved)
            print_row(name, method, *cells_of(found, gaps, near))
            before = every.get(method, ([], [], 0))
            every[method] = (before[0] + found, before[1] + gaps, before[2] + near)
    for method, sums in every.items():
        print_row("all", method, *cells_of(*sums))
