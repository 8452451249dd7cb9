"""The tables of the study as texts: the page, the PDF and the HTML report show the same ones."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from benchmarks.subjects._study_data import Data
from benchmarks.subjects._study_run import GRAPHS
from hybridnav.harness.columns import CONSISTENCY_COLUMNS, loss_columns
from hybridnav.harness.tables import shown, text_of
from hybridnav.harness.yardstick import OPTIMA, YARDSTICKS

TITLES = {
    "lengths": "Lengths",
    "costs": "Costs",
    "ompl": "OMPL",
}
"""Parts of the study, and their headings."""

WORK = (
    "backups", "backups of the grid / backups", "expansions", "an expansion in cells",
    "work in cells",
)  # fmt: skip
TIME = (
    "query ms, median", "query ms, p95", "spread %", "speed-up", "speed-up of means",
    "preparation s", "memory MB", "break-even queries",
)  # fmt: skip
_OTHERS = (
    "metric", "solved %", "by the grid %", "pairs in common", "any-angle loss mean %",
    "octile loss mean %", "weighted loss mean %", "query ms, median", "speed-up",
    "speed-up of octile", "speed-up of shortest",
)  # fmt: skip
_GRAPHS = (
    "maps", "nodes", "edges", "solved %", "any-angle loss mean %", "expansions", "work in cells",
    "query ms, median", "preparation s",
)  # fmt: skip
_BY_MAP = ("grid-astar", "paper", "octile", "shortest", "robot", "ompl-rrtconnect")
"""Methods of the tables map by map, as far as they were asked."""
_LEFT_OUT = {
    "weighted": (
        "weighted loss median %",
        "weighted loss 95 % interval",
        "by the grid %",
        "loss of the plan %",
        "in order %",
        "cost mean m",
        "gap max %",
    )
}
"""Columns of losses that the records have, and a page has no room for."""


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
    """Return all tables of a study, part by part, the maps last."""
    found = [table for name in data["parts"] for table in _of_part(name, data["parts"][name])]
    return [*found, *_not_asked(data), _maps(data)]


def _of_part(name: str, part: Data) -> list[StudyTable]:
    def table(kind: str, rows: Sequence[Data], columns: Iterable[str], title: str) -> StudyTable:
        return _table(name, kind, title, rows, columns)

    rows = part["methods"]
    found = [table("consistency", part["consistency"], CONSISTENCY_COLUMNS, "Consistency")]
    for optimum in YARDSTICKS[part["metric"]]:
        known = [row for row in rows if _has(row, f"{optimum} loss mean %")]
        if len(known) > 1:
            columns = [c for c in loss_columns(optimum) if c not in _LEFT_OUT.get(optimum, ())]
            title = f"Loss over {OPTIMA[optimum]}"
            found.append(table(f"loss {optimum}", known, columns, title))
    found.append(table("time", rows, TIME, "Time and memory"))
    if name == "lengths":
        found.append(table("work", rows, WORK, "Work"))
    graphs = _graphs(part)
    if graphs:
        title = f"Graphs of waypoints, loss over {OPTIMA['any-angle']}"
        made = table("graphs", graphs, _GRAPHS, title)
        settings = "; ".join(f"{row['method']}: {row['settings']}" for row in graphs)
        found.append(replace(made, note=f"{made.note} Settings: {settings}."))
    others = [row for row in part["others"] if row.get("pairs in common")]
    if others:
        found.append(table("others", others, _OTHERS, "Methods over pairs of their own"))
    return [*found, _map_by_map(name, part)]


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
    "consistency": "Contradictions of checks, by kind. A cell is empty if that check had no case.",
    "loss octile": "The loss of the plan is that of the best path of cells inside its regions; in "
    "order, of the best path that passes them in the plan's order. The presets that read the plan "
    "off a path have zeros by construction. A path may be better than its plan: `paper` and "
    "`simple-graph` also search places beside the route.",
    "time": "Medians over the pairs in common. A speed-up is the reference's time over the "
    "method's, below 1 where it is slower: the median of the ratios, and the ratio of the means.",
    "work": "Backups are Thrun's count, nodes times mean steps of a plan (for the grid cells times "
    "mean steps of a path), a mean over the maps. The next column is the median of the grid's over "
    "it. They leave out the search of cells inside the plan, which expansions hold. An expansion "
    "is an entry taken from the queue of a search. Its price is the time of all queries over all "
    "expansions, in the time in which the reference expands a cell.",
    "graphs": "Nodes of all maps in the mean, and each passage as one edge; routes join a graph at "
    "the nearest node in sight. The figures of each over the pairs that it and all methods of the "
    "tables of losses solved.",
    "others": "Each method over the pairs that it and all methods of the tables above solved. "
    "Our presets' speed-ups over the same pairs stand beside its own.",
}


def _has(row: Data, column: str) -> bool:
    return row.get(column) not in {None, ""}


def _text(value: Any) -> str:
    return "" if value is None else text_of(math.inf if value == "never" else value)


def _map_by_map(name: str, part: Data) -> StudyTable:
    """Return the losses and times of a few methods on each map."""
    labels = {row["method"] for row in part["methods"]}
    chosen = [label for label in _BY_MAP if label in labels]
    optimum = YARDSTICKS[part["metric"]][0]
    columns = ["map", *(f"{label} {what}" for what in ("loss %", "ms") for label in chosen)]
    rows = [
        (
            row["map"],
            *(_text(row[label][what]) for what in ("loss", "ms") for label in chosen),
        )
        for row in part["by map"]
    ]
    title = f"Map by map: mean loss over {OPTIMA[optimum]}, median time of a query"
    return StudyTable(name, "map by map", title, tuple(columns), tuple(rows))


def _not_asked(data: Data) -> list[StudyTable]:
    """Return the table of what has no answer, and why; none where everything has one."""
    rows = [
        (
            TITLES[name],
            entry["method"],
            entry["what"],
            text_of(entry["queries"]),
            text_of(len(entry["maps"])),
            entry["first"],
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


def _maps(data: Data) -> StudyTable:
    columns = ("map", "kind", "cells", "free cells", "cell m", "robot radius m")
    rows = tuple(
        (
            *(_text(row[column]) for column in columns[:4]),
            *(f"{row[column]:g}" for column in columns[4:]),
        )
        for row in data["maps"]
    )
    return StudyTable("", "maps", "The maps", columns, rows)


def best_of(rows: Sequence[Data], column: str, best: Callable[[Any], Any] = min) -> str:
    """Return the method with the best figure in a column, and the figure; empty for none."""
    known = {row["method"]: row[column] for row in rows if isinstance(row.get(column), int | float)}
    if not known:
        return ""
    value = best(known.values())
    names = [f"`{name}`" for name, figure in known.items() if figure == value]
    return f"{', '.join(names)} ({text_of(value)})"
