"""The tables of costs: cheapest paths over the overlay against weighted A*, and while costs change.

    python -m benchmarks.costs [--data FOLDER] [--maps GLOB] [--pairs 100] [--seed 0]
                               [--scale 0.5,1,2,4,8] [--peer-cells 300000]

The office of `maps/office`; with FOLDER 12 buildings, 4 raw SLAM maps and 4 open halls, or those
whose path in FOLDER a glob of `--maps` matches. Robot radius 0.25 m, the costs of Nav2's inflation.
Everything runs in one process: each pair is put to weighted A* (`GridSearch` with units), to the
overlay, exact and with epsilon 0.01, in another order each time, and twice in a row: `cold` is the
first time, `again` the second. Ratios are A*'s time over that of the overlay on the same pair in
the same turn. Then a door on the path of some pairs is closed, and opened.

`--scale` measures the office again, repeated to so many millions of free cells, with a box of 60 x
60 cells changed both ways; an empty text leaves that out. The last table has medians and the worst
figures beside the aims. pyroutingkit's customizable contraction
hierarchies (extra `bench`) answer the same pairs on maps of at most `--peer-cells` free cells.

Answers are judged: 50 pairs of each map by Dijkstra's algorithm of scipy on the same integer costs,
on more than 3 M free cells by that of the harness, all others by A*. What is wrong is listed on
stderr, and the exit code is 1.
"""

from __future__ import annotations

import argparse
import fnmatch
import gc
import math
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from benchmarks._costs_changes import doors, scale
from benchmarks._costs_measure import measure, prepared, warm_up
from benchmarks._costs_paths import paths
from benchmarks._costs_peer import peer
from hybridnav.harness.outcome import nanquantile
from hybridnav.harness.tables import to_markdown

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav.harness.tables import Row

ROOT = Path(__file__).parents[1]
OFFICE = ROOT / "maps" / "office" / "office.yaml"
MAPS = {
    "building": (
        "bwi_gdc/2/2.yaml",
        "bwi_gdc/3/3.yaml",
        "bwi_gdc/3ne/3ne.yaml",
        "bwi_mapper/intel.yaml",
        "f1tenth_simulator/stata_basement.yaml",
        "fetch_maps/3_1_16_localization.yaml",
        "fetch_maps/4_26_15.yaml",
        "fetch_maps/9_16_15.yaml",
        "strands/g4s/g4s_y2.yaml",
        "strands/tsc_y3/tsc20160523.yaml",
        "strands/tsc_y4/tsc_1701.yaml",
        "willow/willow-2010-02-18-0.10.yaml",
    ),
    "raw SLAM": (
        "radish_grids/aces.yaml",
        "radish_grids/belgioioso.yaml",
        "radish_grids/infinite-corridor.yaml",
        "radish_grids/orebro.yaml",
    ),
    "open hall": (
        "aws_small_warehouse/002/map.yaml",
        "cob_environments/ipa-production-plant/map.yaml",
        "cob_environments/izs-carpark-top/map.yaml",
        "turtlebot4/depot.yaml",
    ),
}
_TABLES = {
    "Preparation, and queries: ms": measure,
    "A door of 17 x 17 cells on the path, closed and opened: ms": doors,
    "Clearance and length, plans of robot: m, ms": paths,
}
_SUMMED = (
    "us/cell",
    "B/cell",
    "A* ms",
    "exact ms",
    "exact cold x",
    "exact again x",
    "epsilon cold x",
    "epsilon again x",
    "excess mean %",
    "gap <= 1 % of pairs",
)


def files_of(data: Path | None, globs: list[str]) -> dict[Path, str]:
    """Return the map files to measure, with their kinds."""
    if data is None:
        return {OFFICE: "building"}
    names = {name: kind for kind, group in MAPS.items() for name in group}
    wanted = {
        data / name: kind
        for name, kind in names.items()
        if not globs or any(fnmatch.fnmatch(name, glob) for glob in globs)
    }
    has_office = not globs or any(fnmatch.fnmatch("office", glob) for glob in globs)
    return ({OFFICE: "building"} if has_office else {}) | wanted


def run(
    files: dict[Path, str], pairs: int, seed: int, peer_cells: int
) -> tuple[str, int, Iterable[list[Row]]]:
    """Measure maps; return the tables as text, the number of wrong answers, and the tables."""
    tables: dict[str, list[Row]] = {title: [] for title in _TABLES}
    peers: list[Row] = []
    n_wrong = 0
    for number, (file, kind) in enumerate(files.items(), start=1):
        began = time.perf_counter()
        bench = prepared(file, pairs, seed)
        for title, table in _TABLES.items():
            row, wrong = table(bench)
            tables[title].append({"map": file.stem, "kind": kind, **row})
            n_wrong += len(wrong)
            for line in wrong:
                sys.stderr.write(f"wrong: {file.stem}: {line}\n")
        if bench.n_free <= peer_cells:
            peers += [{"map": file.stem, **row} for row in peer(bench)]
        del bench
        gc.collect()
        seconds, load = time.perf_counter() - began, os.getloadavg()[0]
        sys.stderr.write(
            f"{number} of {len(files)}: {file.stem}, {seconds:.0f} s, load {load:.1f}\n"
        )
    text = "".join(f"## {title}\n\n{to_markdown(rows)}\n" for title, rows in tables.items())
    text += _by_kind(next(iter(tables.values())))
    if peers:
        text += f"\n## pyroutingkit, customizable contraction hierarchies\n\n{to_markdown(peers)}"
    return text, n_wrong, tables.values()


def _by_kind(rows: list[Row]) -> str:
    """Return the medians of each kind of map, and the worst ratio."""
    table: list[Row] = []
    for kind in dict.fromkeys(row["kind"] for row in rows):
        own = [row for row in rows if row["kind"] == kind]
        medians: Row = {
            key: nanquantile(np.array([float(row[key]) for row in own]), 0.5) for key in _SUMMED
        }
        worst = min(float(row["epsilon cold x"]) for row in own)
        table.append({"kind": kind, "maps": len(own), **medians, "epsilon cold x, worst": worst})
    return f"## Medians by kind of map\n\n{to_markdown(table)}"


_AIMS = (
    ("overlay with epsilon, times faster than A*", ">= 15, worst 3", "epsilon cold x", min),
    ("plan of robot, times faster than that of A*", ">= 15, worst 3", "robot: plan x", min),
    ("cost with epsilon, % above the optimum", "<= 0.1", "excess mean %", max),
    ("pairs with a proved gap <= 1 %, %", ">= 99", "gap <= 1 % of pairs", min),
    ("exact, times faster than A*", ">= 8", "exact cold x", min),
    ("preparation, us a cell", "<= 3", "us/cell", max),
    ("preparation, bytes a cell", "<= 150", "B/cell", max),
    ("a door closed, ms", "<= 5", "close", max),
    ("the next exact answer, ms", "<= 1", "closed: first answer", max),
    ("A* with the door closed, ms", "", "A*", max),
)
"""Aims on buildings: words, aim, column, and which value is the worst."""


def _beside_aims(tables: Iterable[list[Row]], scaled: list[Row]) -> str:
    """Return the figures that have an aim, over the buildings, and on repeated offices."""
    rows: list[Row] = []
    buildings = [row for table in tables for row in table if row["kind"] == "building"]
    for what, aim, key, worst in _AIMS:
        values = [float(row[key]) for row in buildings if key in row]
        known = [value for value in values if not math.isnan(value)]
        if known:
            median = nanquantile(np.array(known), 0.5)
            rows.append({"what": what, "aim": aim, "median": median, "worst": worst(known)})
    for row in scaled:
        if "update" in row:
            size = f"{float(row['M free']):.1f} M cells"
            both = float(row["update"]) + float(row["changed: first answer"])
            what = f"60 x 60 cells changed both ways and an exact answer, {size}, ms"
            rows.append({"what": what, "aim": "<= 20 on 4 M", "median": both, "worst": math.nan})
            growth = float(row["cost of a cell, times the first"])
            what = f"preparation of a cell, {size}, times that of the smallest"
            rows.append({"what": what, "aim": "<= 1.3", "median": growth, "worst": math.nan})
    return f"## Beside the aims\n\n{to_markdown(rows)}" if rows else ""


def main() -> int:
    """Run and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    parser.add_argument("--maps", action="append", default=[], metavar="GLOB")
    parser.add_argument("--pairs", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--scale", default="0.5,1,2,4,8", metavar="MILLIONS")
    parser.add_argument("--peer-cells", type=int, default=300_000)
    given = parser.parse_args()
    files = files_of(None if given.data is None else Path(given.data), given.maps)
    print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores, {given.pairs} pairs a map\n")
    warm_up()
    text, n_wrong, tables = run(files, given.pairs, given.seed, given.peer_cells)
    print(text)
    millions = [float(text) for text in given.scale.split(",") if text]
    rows: list[Row] = []
    if millions:
        rows, wrong = scale(millions, given.pairs, given.seed)
        n_wrong += len(wrong)
        sys.stderr.writelines(f"wrong: {line}\n" for line in wrong)
        print(f"## The office repeated, and a box of 60 x 60 cells: ms\n\n{to_markdown(rows)}")
    print(_beside_aims(tables, rows))
    print(f"load {os.getloadavg()[0]:.1f}, {n_wrong} wrong answers")
    return 1 if n_wrong else 0


if __name__ == "__main__":
    sys.exit(main())
