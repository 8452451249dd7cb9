"""The table of queries: presets against the tuned grid A*, at `planner.plan`.

All ROS maps of kind `map` in FOLDER/maps.tsv (robot radius 0.25 m, merge distance 4 m) and all
MovingAI maps (a point robot, merge distance 40 cells), or those whose path in FOLDER a glob of
`--maps` matches. `--presets` takes names, separated by commas, with overrides behind colons, as in
`octile:planner.smooth=line-of-sight`; by default all presets without OMPL. Everything runs in one
process: on each map all planners share one topological map, and every pair is put to every planner
before the next pair, in another order each time. Tables are printed; FILE.csv gets a row for each
map and preset as soon as the map is measured, and a run that was stopped goes on: maps that it has
already are not measured again.

The answers are checked as well: paths are legal, statuses agree with A*'s, lower bound <= optimum
<= cost in the metric of the path, gap <= epsilon. Where one is not, it is listed on stderr and the
exit code is 1.
"""

from __future__ import annotations

import csv
import gc
import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import hybridnav as hn
from benchmarks.common import DATA, SEED, Refused, maps_of, option, read
from benchmarks.subjects._queries_measure import measure, presets_of, warm_up
from benchmarks.subjects._queries_tables import n_broken, page
from hybridnav.harness.tables import to_csv

if TYPE_CHECKING:
    from argparse import Namespace

    from benchmarks.subjects._queries_measure import Presets
    from hybridnav.harness.tables import Row

Asked = dict[str, int]
"""Pairs that were asked for, and their seed."""
_WORDS = frozenset({"map", "preset", "kind", "metric", "error"})


def run(files: dict[str, Path], presets: Presets, out: Path | None, asked: Asked) -> list[Row]:
    """Measure the maps that are not measured yet; the rows of all."""
    known = _known(out, presets, asked)
    if not set(files) <= set(known):
        warm_up(presets)
    for number, (name, file) in enumerate(files.items(), start=1):
        if name in known:
            continue
        began = time.perf_counter()
        rows, broken = measure(file, read(file), presets, asked)
        known[name] = [{"map": name, **asked, **row} for row in rows]
        for line in broken:
            sys.stderr.write(f"broken promise: {name}: {line}\n")
        if out is not None:
            everything = [row for rows in known.values() for row in rows]
            out.write_text(to_csv(everything), encoding="utf-8")
        gc.collect()
        seconds, load = time.perf_counter() - began, os.getloadavg()[0]
        sys.stderr.write(f"{number} of {len(files)}: {name}, {seconds:.0f} s, load {load:.1f}\n")
    return [row for name in files for row in known[name]]


def _known(out: Path | None, presets: Presets, asked: Asked) -> dict[str, list[Row]]:
    """Rows of an earlier run by map, which must have had the same presets and settings."""
    found: dict[str, list[Row]] = {}
    if out is None or not out.exists():
        return found
    with out.open(encoding="utf-8", newline="") as stream:
        for text in csv.DictReader(stream):
            row: Row = {
                key: value if key in _WORDS else float(value or "nan")
                for key, value in text.items()
            }
            found.setdefault(str(row["map"]), []).append(row)
    for rows in found.values():
        same = all(row[key] == value for row in rows for key, value in asked.items())
        if not same or [row["preset"] for row in rows] != list(presets):
            raise hn.errors.InvalidValueError(
                f"{out} holds a run with other presets, pairs or seed: take a new file"
            )
    return found


OPTIONS = [
    DATA,
    option("-o", "--out", type=Path),
    option("--presets", metavar="A,B"),
    option("--maps", action="append", default=[], metavar="GLOB"),
    option("--pairs", type=int),
    SEED,
]


def main(given: Namespace) -> int:
    """Run and print the tables."""
    names = [] if given.data is None else maps_of(given.data, given.maps)
    if not names:
        raise Refused("no map: the table needs --data or HYBRIDNAV_DATA, and --maps that match")
    all_presets = ",".join(name for name in hn.preset_names() if name != "ompl")
    presets = presets_of((given.presets or all_presets).split(","))
    files = {name: given.data / name for name in names}
    try:
        pairs = {"asked": given.pairs or 200, "seed": given.seed}
        rows = run(files, presets, given.out, pairs)
    except hn.errors.InvalidValueError as error:
        raise Refused(str(error)) from error
    print(page(rows))
    return 1 if n_broken(rows) else 0
