"""The table of queries: every preset against the tuned grid A*, at `planner.plan`.

    python -m benchmarks.queries --data FOLDER -o DIR [--pairs 200] [--seed 0] [--map GLOB]

All ROS maps of kind `map` in FOLDER/maps.tsv with at least 0.3 M cells (robot radius 0.25 m, merge
distance 4 m) and all MovingAI maps (a point robot, merge distance 40 cells); `--map`, which may be
repeated, takes instead the maps of any size whose path in FOLDER it matches. Everything runs in one
process: on each map all planners share one topological map, and every pair is put to every planner
before the next pair, in another order each time. DIR/queries.jsonl gets a line for each map, with
all times and costs; maps that it has already, with the same pairs and seed, are not measured again.
DIR/queries.md gets the tables, which are printed too.

The answers are checked as well: paths are legal, statuses agree with A*'s, lower bound <= optimum
<= cost, gap <= epsilon. Where one is not, all are listed and the exit code is 1.
"""

from __future__ import annotations

import argparse
import fnmatch
import gc
import json
import os
import sys
import time
from pathlib import Path

from benchmarks._queries_measure import METHODS, Record, measure, read, warm_up
from benchmarks._queries_tables import figures, page, violations

LEAST_CELLS = 300_000


def maps_of(data: Path) -> list[str]:
    """Paths of all maps in the data folder, the ROS maps first."""
    lines = (data / "maps.tsv").read_text(encoding="utf-8").splitlines()[1:]
    ros = [path for path, kind in (line.split("\t") for line in lines) if kind == "map"]
    movingai = sorted((data / "movingai").rglob("*.map"))
    return ros + [path.relative_to(data).as_posix() for path in movingai]


def run(data: Path, out: Path, globs: list[str], *, pairs: int, seed: int) -> list[Record]:
    """Measure the maps that are not measured yet; the records of all maps that were asked for."""
    file = out / "queries.jsonl"
    known = _known(file, pairs=pairs, seed=seed)
    chosen = [
        name
        for name in maps_of(data)
        if not globs or any(fnmatch.fnmatch(name, glob) for glob in globs)
    ]
    if not set(chosen) <= set(known):
        warm_up()
    for number, name in enumerate(chosen, start=1):
        if name in known:
            continue
        grid = read(data / name)
        if not globs and grid.classes.size < LEAST_CELLS and not name.endswith(".map"):
            continue
        began = time.perf_counter()
        record: Record = {"map": name, "pairs": pairs, "seed": seed}
        record |= measure(data / name, grid, pairs=pairs, seed=seed)
        record["figures"] = {method: figures(record, method) for method in METHODS}
        with file.open("a", encoding="utf-8") as stream:
            stream.write(json.dumps(record) + "\n")
        known[name] = record
        del grid
        gc.collect()
        sys.stderr.write(
            f"{number} of {len(chosen)}: {name}, {time.perf_counter() - began:.0f} s, peak "
            f"{record['peak_gb']:.1f} GB, {len(record['violations'])} violations\n"
        )
    return [known[name] for name in chosen if name in known]


def _known(file: Path, *, pairs: int, seed: int) -> dict[str, Record]:
    """Records of an earlier run with the same settings, by map; a line cut short is left out."""
    known = {}
    lines = file.read_text(encoding="utf-8").splitlines(keepends=True) if file.exists() else []
    if lines and not lines[-1].endswith("\n"):
        file.write_text("".join(lines[:-1]), encoding="utf-8")
        lines.pop()
    for line in lines:
        record = json.loads(line)
        if (record["pairs"], record["seed"]) == (pairs, seed):
            known[record["map"]] = record
    return known


def main() -> int:
    """Run, write the tables, list what is wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--data", type=Path, default=os.environ.get("HYBRIDNAV_DATA"))
    parser.add_argument("-o", "--out", type=Path, required=True)
    parser.add_argument("--pairs", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--map", action="append", default=[], metavar="GLOB")
    arguments = parser.parse_args()
    if arguments.data is None:
        parser.error("the table needs --data or HYBRIDNAV_DATA")
    arguments.out.mkdir(parents=True, exist_ok=True)
    records = run(
        Path(arguments.data),
        arguments.out,
        arguments.map,
        pairs=arguments.pairs,
        seed=arguments.seed,
    )
    if not records:
        parser.error("no map matches")
    text = page(records, pairs=arguments.pairs)
    (arguments.out / "queries.md").write_text(text, encoding="utf-8")
    print(text)
    broken = violations(records)
    for line in broken:
        sys.stderr.write(f"violation: {line}\n")
    if broken:
        sys.stderr.write(f"{len(broken)} violations\n")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
