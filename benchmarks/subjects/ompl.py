"""The table of OMPL: on the whole map and in the corridor, and checks of what it returns.

Parts: `table` (eight maps, three planners, three budgets), `confinements` (the ways of
keeping a search in the corridor, on three maps), `footprint` (600 plans of a long robot through
doors, checked by shapely), `soak` (2,000 plans in one process), `pictures` (the search of a
corridor beside that of the whole map, on the project's own office). All by default. DIR gets
`records.jsonl`, to which a run that was stopped adds what is missing, `ompl.md`, which is printed
too, and the pictures. The exit code is 1 where a path touches a wall, too few are found, or memory
grows.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.common import NEEDED_DATA, SEED, matches, option
from benchmarks.subjects import _ompl_checks as checks
from benchmarks.subjects._ompl_measure import MAPS, Bench, Method, methods
from benchmarks.subjects._ompl_tables import table
from hybridnav.harness.records import RecordFile, read_records

if TYPE_CHECKING:
    from argparse import Namespace

PARTS = ("table", "confinements", "footprint", "soak", "pictures")
COMPARED = (
    "willow/willow-2010-02-18-0.10.yaml",
    "movingai/mazes/maze512-8-5.map",
    "movingai/rooms/32room_005.map",
)
Record = dict[str, Any]


def measure(arguments: Namespace, names: list[str], wanted_methods: list[Method]) -> list[Record]:
    """Measure what is missing; all records of these maps and methods."""
    data, out = arguments.data, arguments.out
    wanted: set[str] = set()
    with RecordFile(out) as file:
        for name in names:
            bench = Bench(data / name, pairs=arguments.pairs, seed=arguments.seed)
            for method in wanted_methods:
                for record in bench.records(method, file.ids):
                    file.append([record])
                wanted |= {bench.record_id(method, problem) for problem in bench.problems}
                sys.stderr.write(f"{name}: {method.name}\n")
    return [record for record in read_records(out) if record["id"] in wanted]


def page_of(arguments: Namespace) -> tuple[str, list[str]]:
    """The page, and what is wrong."""
    parts: list[str] = arguments.part or list(PARTS)
    sections, wrong = [], []
    for part, maps in (("table", MAPS), ("confinements", COMPARED)):
        names = [n for n in maps if not arguments.map or matches(n, arguments.map)]
        if part not in parts or not names:
            continue
        found = measure(arguments, names, methods(confinements=part == "confinements"))
        sections.append(f"## {part}\n\n{table(found, ('planner', 'scope', 'budget_s'))}")
        sections.append(table(found, ("map", "planner", "scope", "budget_s")))
        wrong += [f"{r['id']}: {fault}" for r in found for fault in r["faults"]]
    if "footprint" in parts:
        counts = checks.footprint_runs(arguments.runs)
        lines = [f"* {space}: {figures}" for space, figures in counts.items()]
        sections.append("## footprint\n\n" + "\n".join(lines) + "\n")
        wrong += [f"{space}: violations" for space, c in counts.items() if c["violations"]]
        wrong += [
            f"{space}: {c['solved']} of {c['runs']} solved"
            for space, c in counts.items()
            if c["solved"] < checks.LEAST_SOLVED[space] * c["runs"]
        ]
    if "soak" in parts:
        figures = checks.soak(arguments.plans)
        sections.append(f"## soak\n\n{figures}\n")
        if figures["unsolved"] or figures["gained_bytes"] > checks.SOAK_BYTES:
            wrong.append(f"soak: {figures}")
    if "pictures" in parts:
        from benchmarks.subjects._ompl_pictures import draw  # noqa: PLC0415 - matplotlib on demand

        sections.append(f"## pictures\n\n{', '.join(str(path) for path in draw(arguments.out))}\n")
    return "\n".join(sections), wrong


OPTIONS = [
    NEEDED_DATA,
    option("-o", "--out", type=Path, required=True),
    option("--pairs", type=int, default=20),
    SEED,
    option("--map", action="append", default=[], metavar="GLOB"),
    option("--part", action="append", choices=PARTS),
    option("--runs", type=int, default=600, help="plans of the footprint part"),
    option("--plans", type=int, default=2000, help="plans of the soak"),
]


def main(given: Namespace) -> int:
    """Run, write the page, list what is wrong."""
    given.out.mkdir(parents=True, exist_ok=True)
    page, wrong = page_of(given)
    (given.out / "ompl.md").write_text(page, encoding="utf-8")
    print(page)
    for line in wrong:
        sys.stderr.write(f"wrong: {line}\n")
    return 1 if wrong else 0
