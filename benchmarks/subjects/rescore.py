"""Public benchmarks of paths, rescored by proved optima; docs/rescored.md is made of the tables.

    barn           the BARN navigation benchmark: for each world the length by which its score
                   divides, and what encloses the shortest path of a disc among the cylinders
    dynamic        the sample of the Grid-based Path Planning Competition's dynamic track: the
                   stated optimum of each query between the patches of its map
    floorplanqa    example layouts of FloorplanQA: shortest paths between the centroids of objects,
                   held against shapely
    movingai       scenarios of MovingAI: the stated octile optimum, and the proved any-angle one

`--out FOLDER` keeps a table of the reference lengths of BARN, and a proof of each bound. With
`--barn FOLDER`, a checkout of the benchmark, all its worlds are read from their own files instead
of the half that the reference data has.
"""

import gzip
import hashlib
import itertools
import json
import math
import time
from argparse import Namespace
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely

import hybridnav as hn
from benchmarks.common import read
from benchmarks.options import NEEDED_DATA, Refused, option
from benchmarks.subjects.proofs import is_accepted
from benchmarks.tables import print_head, print_load, print_row
from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.maps import ShapeGrids
from hybridnav.maps.files import load_scenarios

CYLINDER_M = 0.075
DISC_M = 0.225
"""Radius of the disc that is judged: the clearance that the stored paths keep in the median."""
SIDE_M = 0.015
START, GOAL = (-2.25, 3.0), (-2.25, 13.0)
"""As the benchmark's run.py states them; its report_test.py starts at x = -2."""
BOUNDS = (-4.6, 0.0, 0.1, 14.0)
CLEARANCE_M = 0.1
"""As FloorplanQA asks for."""
COVERINGS = ("rug", "carpet", "mat", "light", "chandelier", "fan", "pendant", "runner")
"""What FloorplanQA lets a path cross: parts of labels."""


class Enclosed(NamedTuple):
    """Plans that enclose a shortest path among shapes."""

    below: hn.PlanResult
    above: hn.PlanResult

    @property
    def gap(self) -> float:
        """Share by which the feasible path may be longer than the shortest one."""
        return self.above.cost / self.below.lower_bound - 1


def enclosed(grids: ShapeGrids, start: Any, goal: Any) -> Enclosed:
    """Plan on both grids."""
    below, above = (planner(grid, "shortest").plan(start, goal) for grid in grids[::-1])
    return Enclosed(below, above)


def planner(grid: hn.OccupancyGrid, preset: str) -> hn.HybridPlanner:
    """Return a planner of a grid."""
    return hn.HybridPlanner(grid, preset=preset)


class World(NamedTuple):
    """A world of BARN."""

    number: int
    centres: FloatArray
    """Of its cylinders, float64 (n, 2), metres."""
    stored: FloatArray
    """The path that its score takes for the shortest one, float64 (m, 2), with its ends."""


def worlds_of(data: Path, checkout: Path | None) -> Iterator[World]:
    """Read the worlds of the reference data, or of a checkout."""
    if checkout is not None:
        for folder in sorted(checkout.rglob("BARN")):
            for number in range(300):
                file = folder / f"world_{number}.world"
                if file.exists():
                    shapes = hn.load_shapes(file).shapes
                    cells = np.load(folder / "path_files" / f"path_{number}.npy")
                    yield World(number, shapely.get_coordinates(shapes), stored_path(cells))
            return
        raise Refused(f"{checkout} holds no folder BARN with worlds: give the benchmark's checkout")
    centres = np.loadtxt(data / "barn" / "cylinders.tsv", skiprows=1)
    cells = np.loadtxt(data / "barn" / "reference_paths.tsv", skiprows=1)
    for number in np.unique(centres[:, 0]):
        of_path = cells[cells[:, 0] == number, 1:]
        yield World(int(number), centres[centres[:, 0] == number, 1:], stored_path(of_path))


def stored_path(cells: FloatArray) -> FloatArray:
    """Return a stored path in metres, as `path_coord_to_gazebo_coord` of run.py makes it."""
    points = np.asarray(cells, float) * 2 * CYLINDER_M + (-CYLINDER_M - 30 * 2 * CYLINDER_M, 5.075)
    return np.vstack([START, points, GOAL])


def length_of(points: FloatArray) -> float:
    """Return the length of a polyline."""
    return float(shapely.LineString(points).length)


def barn(given: Namespace) -> None:
    """Enclose the shortest path of each world, and compare the stored one."""
    print("## BARN\n")
    print_head(
        "world", "stored m", "proved below m", "feasible above m", "too long at least %", "s"
    )
    rows, lengths = [], ["world\tstored_m\tbelow_m\tabove_m\tproof_below\tproof_above"]
    for world in worlds_of(given.data, given.barn):
        began = time.thread_time()
        reach = CYLINDER_M + DISC_M
        grids = hn.grids_of_shapes(shapely.points(world.centres), SIDE_M, BOUNDS, radii_m=reach)
        found = enclosed(grids, START, GOAL)
        seconds = time.thread_time() - began
        stored, above, below = length_of(world.stored), found.above.cost, found.below.lower_bound
        line = shapely.LineString(world.stored[1:-1])
        clear = line.distance(shapely.MultiPoint(world.centres)) - CYLINDER_M
        drawn = shapely.LineString(found.above.raise_for_status().path.points)  # type: ignore[union-attr]
        is_free = drawn.distance(shapely.MultiPoint(world.centres)) >= reach - 1e-9
        other = length_of(np.vstack([(-2.0, 3.0), world.stored[1:]]))
        rows.append((stored / above - 1, found.gap, clear, seconds, is_free, other / stored - 1))
        if given.worlds:
            shown = f"{stored:.4f}", outward(below, 4), outward(above, 4, up=True)
            print_row(world.number, *shown, f"{100 * rows[-1][0]:.1f}", f"{seconds:.2f}")
        digests = kept_proofs(given.out, world.number, grids, found)
        lengths.append(
            f"{world.number}\t{stored:.6f}\t{outward(below, 6)}\t"
            f"{outward(above, 6, up=True)}\t{digests}"
        )
    loss, gap, clear, seconds, free, other = np.array(rows).T
    print_head("worlds", "stored path longer than a feasible one", "above / below - 1",
               "clearance of stored m", "CPU s a world", "feasible by shapely",
               "stored length by report_test.py")  # fmt: skip
    print_row(
        len(rows),
        f"{(loss > 0).sum()}, mean {100 * loss.mean():.1f} %, {100 * loss.min():.1f} to "
        f"{100 * loss.max():.1f} %",
        f"mean {100 * gap.mean():.3f} %, most {100 * gap.max():.2f} %",
        f"median {np.median(clear):.3f}, least {clear.min():.3f}",
        f"mean {seconds[1:].mean():.3f}, most {seconds[1:].max():.3f}",
        f"{int(free.sum())} of {len(free)}",
        f"{100 * other.min():+.1f} to {100 * other.max():+.1f} %",
    )
    if given.out is not None:
        (given.out / "barn.tsv").write_text("\n".join(lengths) + "\n", encoding="utf-8")


def outward(value: float, decimals: int, *, up: bool = False) -> str:
    """Write a bound, rounded down, or a length that encloses from above, rounded up."""
    scaled = (math.ceil if up else math.floor)(value * 10**decimals)
    return f"{scaled / 10**decimals:.{decimals}f}"


def kept_proofs(out: Path | None, world: int, grids: ShapeGrids, found: Enclosed) -> str:
    """Write the proofs of a world, checked, and return their digests."""
    if out is None:
        return "\t"
    digests = []
    for name, grid, result in zip(("above", "below"), grids, found[::-1], strict=True):
        proof = hn.prove(result)
        if not is_accepted(grid, proof):
            raise Refused(f"the proof {name} of world {world} is rejected: please report this")
        content = json.dumps(proof).encode()
        out.mkdir(parents=True, exist_ok=True)
        file = out / f"barn_{world}_{name}.json.gz"
        file.write_bytes(gzip.compress(content, mtime=0))
        digests.append(hashlib.sha256(content).hexdigest())
    return "\t".join(digests[::-1])


def dynamic(given: Namespace) -> None:
    """Compare the stated optimum of each query."""
    print("\n## The dynamic grid competition's sample\n")
    queries = confirmed = maps = 0
    shorter = []
    for name in sorted((given.data / "gppc_dynamic").glob("*.scen")):
        for free, batch in patched(name):
            maps += 1
            grid = hn.OccupancyGrid((~free[::-1]).astype(np.float32), robot_radius_m=0)
            octile, straight = planner(grid, "octile"), planner(grid, "shortest")
            for x, y, goal_x, goal_y, stated in batch:
                ends = (x + 0.5, len(free) - y - 0.5), (goal_x + 0.5, len(free) - goal_y - 0.5)
                cost = octile.plan(*ends).cost
                queries += 1
                # The file's numbers have eleven decimals, and -1 where there is no path.
                confirmed += math.isinf(cost) if stated < 0 else abs(cost - stated) < 1e-6
                if math.isfinite(cost) and cost:
                    shorter.append(straight.plan(*ends).cost / cost)
    print_head("queries", "maps between patches", "stated optimum confirmed", "any-angle optimum")
    mean = 100 * (1 - np.mean(shorter))
    print_row(queries, maps, confirmed, f"{mean:.2f} % shorter in the mean")


def patched(scenario: Path) -> Iterator[tuple[BoolArray, list[list[float]]]]:
    """Return each map of a dynamic scenario, row 0 on top, with its queries x, y, x, y, optimum."""
    head, _, commands = scenario.read_text(encoding="utf-8").partition("\ncommands\n")
    facts = dict(line.split(maxsplit=1) for line in head.splitlines())
    patches = []
    for patch in (
        (scenario.parent / facts["patch"]).read_text(encoding="utf-8").split("\npatch ")[1:]
    ):
        rows = patch.split("\nmap\n")[1].split()
        patches.append(np.array([[letter in ".GS" for letter in row] for row in rows]))
    free, batch = np.ones((int(facts["height"]), int(facts["width"])), bool), []
    for kind, lines in itertools.groupby(commands.split("\n"), key=lambda line: line[:1]):
        values = [[float(word) for word in line.split()[2:]] for line in lines if kind]
        if kind == "P":
            for number, x, y in np.array(values, int):
                rows, cols = patches[number].shape
                free[y : y + rows, x : x + cols] = patches[number]
        elif kind == "Q":
            batch = values
            yield free.copy(), batch


def floorplanqa(given: Namespace) -> None:
    """Answer each pair of objects of each layout, and judge the answers by shapely."""
    print("\n## FloorplanQA\n")
    print_head("layout", "pairs", "no path, proved", "answers legal by shapely",
               "above / below - 1, mean and most")  # fmt: skip
    for file in sorted((given.data / "floorplanqa").glob("*.json")):
        layout = json.loads(file.read_text(encoding="utf-8"))
        room = polygon(layout["room_boundary"])
        objects = {
            one["label"]: polygon(one["points"])
            for one in layout["objects"]
            if not any(word in one["label"].lower() for word in COVERINGS)
        }
        gaps, legal, none = [], 0, 0
        pairs = list(itertools.combinations(objects, 2))
        for pair in pairs:
            others = [shape for label, shape in objects.items() if label not in pair]
            ends = [centroid(objects[one]) for one in pair]
            for side_m in (SIDE_M, SIDE_M / 4):
                found = enclosed(room_grids(room, others, side_m), *ends)
                if found.above.solved or not found.below.solved:
                    break
            none += not found.below.solved
            if found.above.path is not None:
                line = shapely.LineString(found.above.path.points)
                is_clear = (shapely.distance(line, others) >= CLEARANCE_M - 1e-9).all()
                legal += bool(is_clear and room.buffer(1e-9).covers(line))
                gaps.append(found.gap if found.above.cost else 0.0)
        shown = f"{100 * np.mean(gaps):.2f} %, {100 * max(gaps):.1f} %"
        print_row(file.stem, len(pairs), none, f"{legal} of {len(gaps)}", shown)


def polygon(points: Sequence[dict[str, float]]) -> shapely.Polygon:
    """Return a polygon of a layout."""
    return shapely.Polygon([(point["x"], point["y"]) for point in points])


def centroid(shape: shapely.Polygon) -> tuple[float, float]:
    """Return the centroid as FloorplanQA does, to a millimetre."""
    return round(shape.centroid.x, 3), round(shape.centroid.y, 3)


def room_grids(room: shapely.Polygon, others: list[shapely.Polygon], side_m: float) -> ShapeGrids:
    """Return the grids of a room: its walls may be touched, the objects come as near as allowed."""
    bounds = room.buffer(side_m, join_style="mitre").bounds
    outside = shapely.box(*bounds).buffer(side_m, join_style="mitre").difference(room)
    radii = [0.0] + [CLEARANCE_M] * len(others)
    return hn.grids_of_shapes([outside, *others], side_m, bounds, radii_m=radii)


def movingai(given: Namespace) -> None:
    """Compare the stated optimum of evenly chosen scenarios of each map."""
    print("\n## MovingAI\n")
    print_head("map", "scenarios", "stated optimum confirmed", "any-angle optimum shorter, mean %")
    for file in sorted((given.data / "movingai").rglob("*.scen")):
        grid = read(file.with_suffix(""))
        scenarios = load_scenarios(file, shape=grid.shape)
        chosen = [scenarios[i] for i in np.linspace(0, len(scenarios) - 1, given.pairs).astype(int)]
        octile, straight = planner(grid, "octile"), planner(grid, "shortest")
        confirmed, shorter = 0, []
        for one in chosen:
            ends = grid.frame.points_of([one.start, one.goal])
            cost = octile.plan(*ends).cost
            # Files state two decimals or more, some of them of a number in single precision.
            decimals = max(2, len(repr(one.optimum_cells).partition(".")[2]))
            rounding = 0.51 * 10.0**-decimals + 1e-6 * one.optimum_cells
            confirmed += abs(cost - one.optimum_cells) <= rounding
            if cost:
                shorter.append(1 - straight.plan(*ends).cost / cost)
        print_row(file.stem, len(chosen), confirmed, f"{100 * np.mean(shorter):.2f}")


SUBJECTS = {"barn": barn, "dynamic": dynamic, "floorplanqa": floorplanqa, "movingai": movingai}
OPTIONS = [
    NEEDED_DATA,
    option("benchmarks", nargs="*", choices=[*SUBJECTS, []], help="which, all by default"),
    option("--barn", type=Path, metavar="FOLDER", help="checkout of the BARN benchmark"),
    option("--worlds", action="store_true", help="a row for each world of BARN"),
    option("--out", type=Path, metavar="FOLDER", help="where lengths and proofs of BARN are kept"),
    option("--pairs", type=int, default=20, help="scenarios of each MovingAI map"),
]


def main(given: Namespace) -> None:
    """Print the tables."""
    print_load()
    for name, run in SUBJECTS.items():
        if not given.benchmarks or name in given.benchmarks:
            run(given)
