"""Tables of the table of queries, from the rows of its maps."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from benchmarks.subjects._queries_measure import YARDSTICK
from hybridnav.harness.outcome import nanmean, nanquantile
from hybridnav.harness.tables import text_of, to_markdown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._base.typing import FloatArray
    from hybridnav.harness.tables import Row

LEAST_MS = 1.0
"""Maps where A* takes as long in the median have a table of their own."""
_MEDIANS = (
    "ms median",
    "ms mean",
    "ms p95",
    "times A*",
    "preparation s",
    "us/cell",
    "B/cell",
    "expanded",
)
_MEANS = ("any-angle loss %", "octile loss %", "optimal %", "gap mean %")
_WORST = ("ms median", "ms p95", "us/cell", "B/cell", "any-angle loss max %", "octile loss max %")


def page(rows: Sequence[Row]) -> str:
    """All tables in Markdown."""
    maps = len({row["map"] for row in rows})
    return f"""# Queries: presets against grid A*

{maps} maps, one process, pair by pair, presets in shuffled order, timed at `planner.plan` over the
pairs that all solved. `times A*` is the median over pairs of A*'s time over the preset's, on the
same pair. Times, preparation, bytes and expansions are medians over maps, losses and gaps means;
`worst` is over maps. Preparation lasts up to the first answer, on top of the topological map, and
both are per free cell. Promises broken: {n_broken(rows)}.

## All maps

{to_markdown(_by_preset(rows))}
{_slow(rows)}## By kind of map

{to_markdown(_by_kind(rows))}
## Map by map: milliseconds, median / p95

{to_markdown(_map_by_map(rows))}{_not_prepared(rows)}"""


def _slow(rows: Sequence[Row]) -> str:
    """The part about maps where A* takes long, nothing where there are none."""
    of_cells = [row for row in rows if row["preset"] == YARDSTICK]
    maps = {row["map"] for row in of_cells if float(row["ms median"]) >= LEAST_MS}
    if not maps:
        return ""
    table = to_markdown(_by_preset([row for row in rows if row["map"] in maps]))
    return f"## Maps where A* takes {LEAST_MS:g} ms and more: {len(maps)}\n\n{table}\n"


def n_broken(rows: Sequence[Row]) -> int:
    """How many answers break a promise."""
    return int(sum(_column([row for row in rows if not row.get("error")], "broken")))


def _by_preset(rows: Sequence[Row]) -> list[Row]:
    names = dict.fromkeys(str(row["preset"]) for row in rows)
    return [_summary(name, [r for r in rows if r["preset"] == name]) for name in names]


def _by_kind(rows: Sequence[Row]) -> list[Row]:
    kinds = dict.fromkeys(str(row["kind"]) for row in rows)
    return [
        {"kind": kind, **row}
        for kind in kinds
        for row in _by_preset([row for row in rows if row["kind"] == kind])
    ]


def _summary(name: str, rows: Sequence[Row]) -> Row:
    ready = [row for row in rows if not row.get("error")]
    summary: Row = {"preset": name, "maps": len(ready)}
    summary |= {key: nanquantile(_column(ready, key), 0.5) for key in _MEDIANS}
    summary |= {key: nanmean(_column(ready, key)) for key in _MEANS}
    summary |= {f"{key}, worst": nanquantile(_column(ready, key), 1.0) for key in _WORST}
    summary["times A*, worst"] = nanquantile(_column(ready, "times A*"), 0.0)
    summary["broken"] = n_broken(ready)
    return summary


def _column(rows: Sequence[Row], key: str) -> FloatArray:
    return np.array([row[key] for row in rows], dtype=np.float64)


def _map_by_map(rows: Sequence[Row]) -> list[Row]:
    table: dict[str, Row] = {}
    for row in rows:
        first = ("map", "kind", "free cells", "load", "core %", "places s")
        line = table.setdefault(str(row["map"]), {key: row[key] for key in first})
        times = "-"
        if not row.get("error"):
            times = f"{text_of(float(row['ms median']))} / {text_of(float(row['ms p95']))}"
        line[str(row["preset"])] = times
    return list(table.values())


def _not_prepared(rows: Sequence[Row]) -> str:
    failed = [row for row in rows if row.get("error")]
    lines = [f"* {row['map']}, {row['preset']}: {row['error']}\n" for row in failed]
    return "\nNot prepared:\n\n" + "".join(lines) if lines else ""
