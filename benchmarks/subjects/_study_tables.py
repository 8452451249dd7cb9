"""The tables of the study as texts, of which the page shows most."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from benchmarks.subjects._study_data import Data
from benchmarks.subjects._study_run import GRAPHS
from hybridnav.harness.tables import shown, text_of
from hybridnav.harness.yardstick import OPTIMA, YARDSTICKS

TITLES = {"lengths": "Lengths", "costs": "Costs", "ompl": "OMPL"}
"""Parts of the study, and their headings."""

_SHORT = (
    "metric", "solved %", "{} loss mean %", "{} loss p95 %", "{} loss max %",
    "gap mean %", "query ms, median", "speed-up", "speed-up of means",
    "preparation s", "memory MB",
)  # fmt: skip
"""Columns of the page; the records have more."""
_OTHERS = (
    "metric", "solved %", "pairs in common", "any-angle loss mean %", "octile loss mean %",
    "weighted loss mean %", "query ms, median", "speed-up", "speed-up of octile",
)  # fmt: skip
_GRAPHS = (
    "maps", "nodes", "edges", "solved %", "any-angle loss mean %", "expansions", "work in cells",
    "query ms, median", "preparation s",
)  # fmt: skip


@dataclass(frozen=True)
class StudyTable:
    """One table."""

    part: str
    """The part of the study, empty for all."""
    name: str
    """What kind of table it is."""
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    note: str = ""
    """What a reader must know, a sentence or two."""


def tables_of(data: Data) -> list[StudyTable]:
    """Return all tables of a study, part by part."""
    found = [table for name in data["parts"] for table in _of_part(name, data["parts"][name])]
    return [*found, *_not_asked(data)]


def _of_part(name: str, part: Data) -> list[StudyTable]:
    def table(kind: str, rows: Sequence[Data], columns: Iterable[str], title: str) -> StudyTable:
        return _table(name, kind, title, rows, columns)

    rows = part["methods"]
    optimum = YARDSTICKS[part["metric"]][0]
    title = f"Loss over {OPTIMA[optimum]}, time and memory"
    found = [table("short", rows, [column.format(optimum) for column in _SHORT], title)]
    graphs = _graphs(part)
    if graphs:
        title = f"Graphs of waypoints, loss over {OPTIMA['any-angle']}"
        made = table("graphs", graphs, _GRAPHS, title)
        settings = "; ".join(f"{row['method']}: {row['settings']}" for row in graphs)
        found.append(replace(made, note=f"{made.note} Settings: {settings}."))
    others = [row for row in part["others"] if row.get("pairs in common")]
    if others:
        found.append(table("others", others, _OTHERS, "Methods over pairs of their own"))
    return found


def _graphs(part: Data) -> list[Data]:
    """Return the rows of the graphs of waypoints, wherever else they stand."""
    names = {method.name for method in GRAPHS}
    return [
        {"settings": part["settings"].get(row["method"], ""), "maps": len(part["by map"]), **row}
        for row in (*part["methods"], *part["others"])
        if row["method"] in names
    ]


def _table(
    part: str, kind: str, title: str, rows: Sequence[Data], columns: Iterable[str]
) -> StudyTable:
    """Return a table without columns that are empty."""
    kept = ["method", *(c for c in columns if any(_has(row, c) for row in rows))]
    heads = kept if kind == "others" else [shown(column) for column in kept]
    texts = tuple(tuple(_text(row.get(column)) for column in kept) for row in rows)
    return StudyTable(part, kind, title, tuple(heads), texts, _NOTES.get(kind, ""))


_NOTES = {
    "graphs": "Nodes of all maps in the mean, and each passage as one edge; routes join a graph at "
    "the nearest node in sight. The figures of each over the pairs that it and all methods of the "
    "tables of losses solved.",
    "others": "Each over the pairs that it and all methods of the table above solved.",
}


def _has(row: Data, column: str) -> bool:
    return row.get(column) not in {None, ""}


def _text(value: Any) -> str:
    return "" if value is None else text_of(math.inf if value == "never" else value)


def _not_asked(data: Data) -> list[StudyTable]:
    """Return the table of what has no answer, and why; none where everything has one."""
    rows = [
        (
            TITLES[name],
            entry["method"],
            entry["what"],
            text_of(entry["queries"]),
            text_of(len(entry["maps"])),
            entry["first"].partition(", this map")[0],
        )
        for name, part in data["parts"].items()
        for entry in part["unanswered"]
    ]
    rows += [
        (
            "all",
            name,
            "not installed",
            "",
            "",
            f"{why.split(': pip')[0]}: [extras](howto/install.md)",
        )
        for name, why in data["missing"].items()
    ]
    columns = ("part", "method", "what", "queries", "maps", "reason, on the first of these maps")
    return [StudyTable("", "not asked", "Not asked, or without an answer", columns, tuple(rows))][
        : len(rows)
    ]
