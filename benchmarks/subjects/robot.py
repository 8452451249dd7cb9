"""The preset `robot` on the study's maps: times against A* by the same costs, gaps, steadiness.

The maps are those of the study, and the office of `maps/office`; robot radius 0.25 m, on MovingAI
maps 0. Pairs are drawn from the largest connected part. Columns:

    plan        median and 95 % quantile of one `plan`, ms, the least of two runs; planners prepared
    A*          the same of `grid-astar` by the same costs, whose path of cells is no line
    A*, arcs    the same where its path is settled and rounded as that of `robot`
    speedup     median of A* over plan, and the part of the pairs where it is below 1
    of arcs     the same for A* with arcs
    bound       median and 95 % quantile of the first reading of `lower_bound`, ms
    gap         mean and 95 % quantile of `gap`, %
    steady      part of the plans from points along a path, to its goal, that stay within a cell of
                its rest, and the farthest that one leaves it, in cells
    moved       the same for starts moved by 5 cm, which count for nothing; of paths that leave the
                old one by more than a cell, what that costs more from there (`keep`), mean in %
    duplicates  queries that got another path when they were asked again, in reverse order
"""

from argparse import Namespace
from typing import Any

import numpy as np
import shapely
from shapely.ops import substring

import hybridnav as hn
from benchmarks.common import (
    NEEDED_DATA,
    OFFICE,
    SEED,
    largest_part,
    option,
    print_head,
    print_load,
    print_row,
    read,
    timed,
)
from benchmarks.subjects._study_maps import maps_of
from hybridnav._base.typing import FloatArray

MEASURED = ("plan", "A*", "A*, arcs", "bound", "gap", "steady", "moved", "dearer")
COLUMNS = ("map", *MEASURED[:3], "speedup", "of arcs", *MEASURED[3:-1], "duplicates")
MOVED_M = 0.05


def strayed_cells(
    planner: hn.HybridPlanner, points: FloatArray, n: int, resolution_m: float
) -> list[float]:
    """Plan again from points along a path; return how far each new path leaves the old one."""
    path, found = shapely.LineString(points), []
    for part in np.linspace(0, 1, n + 1)[:-1]:
        rest = substring(path, part, 1, normalized=True)
        if rest.length < 2 * resolution_m:
            continue
        again = planner.plan(rest.coords[0], rest.coords[-1], smooth="line-of-sight")
        if again.path is not None:  # a point on the side of a closed cell may lie in that
            new = shapely.segmentize(shapely.LineString(again.path.points), resolution_m)
            old = shapely.segmentize(rest, resolution_m)
            found.append(float(shapely.hausdorff_distance(old, new)) / resolution_m)
    return found


def moved(
    planner: hn.HybridPlanner, pair: FloatArray, result: hn.PlanResult, angle: float
) -> tuple[list[float], list[float]]:
    """Plan from a start that moved a little; return how far the path leaves the old one in cells,
    and, if by more than a cell, what the old one costs more from there, as a share; none where a
    plan ends in a wall."""
    start = pair[0] + MOVED_M * np.array([np.cos(angle), np.sin(angle)])
    again = planner.plan(start, pair[1], smooth="line-of-sight")
    kept = planner.plan(start, pair[1], smooth="line-of-sight", keep=result)
    if again.path is None or kept.path is None or result.path is None:
        return [], []
    cell_m = planner.grid.resolution_m
    lines = (again.path.points, result.path.points)
    new, old = (shapely.segmentize(shapely.LineString(line), cell_m) for line in lines)
    apart = (float(shapely.hausdorff_distance(old, new)) - MOVED_M) / cell_m
    return [apart], [kept.cost / again.cost - 1] if apart > 1 else []


def measured(grid: hn.OccupancyGrid, pairs: FloatArray, n_steady: int) -> dict[str, Any]:
    """Return the figures of one map."""
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    planner = hn.HybridPlanner(topology, preset="robot")
    rival = hn.HybridPlanner(topology, preset="grid-astar", costs=hn.CostLayer.clearance(grid))
    planner.prepare()
    planner.plan(*pairs[0]).gap  # noqa: B018 - kernels load
    rival.plan(*pairs[0])
    seconds, rival_seconds, arc_seconds, bound_seconds = [], [], [], []
    gaps, strayed, apart, dearer, paths = [], [], [], [], []
    angles = np.random.default_rng(0).uniform(0, 2 * np.pi, len(pairs))
    for start, goal in pairs:
        result, s = timed(lambda: planner.plan(start, goal), 2)  # noqa: B023 - called at once
        _, rival_s = timed(lambda: rival.plan(start, goal), 2)  # noqa: B023
        _, arc_s = timed(lambda: rival.plan(start, goal, smooth="arcs"), 2)  # noqa: B023
        _, bound_s = timed(lambda: result.lower_bound)  # noqa: B023
        assert result.path is not None  # noqa: S101 - ends lie in one part
        seconds.append(s)
        rival_seconds.append(rival_s)
        arc_seconds.append(arc_s)
        bound_seconds.append(bound_s)
        gaps.append(result.gap)
        paths.append(result.path.points)
    for start, goal in pairs[:n_steady]:
        path = planner.plan(start, goal, smooth="line-of-sight").path
        assert path is not None  # noqa: S101
        strayed += strayed_cells(planner, path.points, 50, grid.resolution_m)
    for pair, angle in zip(pairs, angles, strict=True):
        line = planner.plan(*pair, smooth="line-of-sight")
        farther, more = moved(planner, pair, line, angle)
        apart += farther
        dearer += more
    again = [planner.plan(start, goal).path for start, goal in pairs[::-1]][::-1]
    return {
        "plan": np.array(seconds),
        "A*": np.array(rival_seconds),
        "A*, arcs": np.array(arc_seconds),
        "bound": np.array(bound_seconds),
        "gap": np.array(gaps),
        "steady": np.array(strayed),
        "moved": np.array(apart),
        "dearer": np.array(dearer),
        "duplicates": sum(
            path is None or not np.array_equal(path.points, points)
            for path, points in zip(again, paths, strict=True)
        ),
    }


def ms(seconds: FloatArray) -> str:
    """Write median and 95 % quantile in milliseconds."""
    return f"{1e3 * np.median(seconds):.2f} / {1e3 * np.quantile(seconds, 0.95):.2f}"


def row(name: str, found: dict[str, Any]) -> None:
    """Print the line of a map."""
    speedups = [found[rival] / found["plan"] for rival in MEASURED[1:3]]
    gap, steady, apart = 100 * found["gap"], found["steady"], found["moved"]
    more = 100 * found["dearer"].mean() if found["dearer"].size else 0.0
    print_row(
        name,
        ms(found["plan"]),
        ms(found["A*"]),
        ms(found["A*, arcs"]),
        *(f"{np.median(each):.2f}, {np.mean(each < 1):.2f} below 1" for each in speedups),
        ms(found["bound"]),
        f"{gap.mean():.2f} / {np.quantile(gap, 0.95):.2f}",
        f"{100 * np.mean(steady <= 1):.1f} %, {steady.max():.1f}" if steady.size else "",
        f"{100 * np.mean(apart <= 1):.0f} %, {apart.max():.1f}; {more:.2f}" if apart.size else "",
        found["duplicates"],
    )


OPTIONS = [
    NEEDED_DATA,
    option("--map", action="append", default=[], metavar="GLOB"),
    option("--pairs", type=int, default=40),
    option("--steady", type=int, default=6, help="pairs that are planned again along their paths"),
    SEED,
]


def main(given: Namespace) -> None:
    """Print the table."""
    files = [] if given.map else [OFFICE]
    files += [one.path for one in maps_of(given.data, given.map)]
    print_load()
    print_head(*COLUMNS)
    every: list[dict[str, Any]] = []
    for file in files:
        grid = read(file)
        cells = largest_part(grid.enterable())
        drawn = np.random.default_rng(given.seed).choice(cells, (given.pairs, 2))
        points = grid.frame.points_of(drawn.reshape(-1, 2)).reshape(-1, 2, 2)
        every.append(measured(grid, points, given.steady))
        row(file.parent.name + "/" + file.stem, every[-1])
    whole = {key: np.concatenate([found[key] for found in every]) for key in MEASURED}
    row("all pairs", {**whole, "duplicates": sum(found["duplicates"] for found in every)})
    for rival in MEASURED[1:3]:
        medians = [np.median(found[rival] / found["plan"]) for found in every]
        print(f"{rival}: median of the maps {np.median(medians):.2f}, least {min(medians):.2f}")
    print_load()
