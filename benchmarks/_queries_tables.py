"""Figures and tables of the table of queries, from the records of its maps."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from benchmarks._queries_measure import METHODS, SLACK, YARDSTICK, Record, optima_m
from hybridnav.harness.analysis import nanmean, nanquantile
from hybridnav.harness.tables import text_of, to_markdown

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._typing import FloatArray

Row = dict[str, str | float]

KINDS = ("building", "open floor", "MovingAI")
KIND_COLUMNS = (
    "preset",
    "maps",
    "speed-up",
    "worst",
    "loss mean %",
    "loss max %",
    "optimal %",
    "gap mean %",
    "gap p95 %",
)
LEAST_US = 1000.0
"""Maps where A* takes as long count for the speed-up."""
N_WORST = 10


def figures(record: Record, name: str) -> Row:
    """Figures of a method on a map; only why, where it could not be prepared.

    Parameters
    ----------
    record
        What `measure` returned.
    name
        Of the method.

    Returns
    -------
    dict
        By column. `speed-up` is the median over pairs of A*'s time over the method's, `slower by
        us` the median difference; preparation and bytes are the planner's own, on top of the
        topological map. Queries to break even count only the planner's preparation, or the
        topological map's too.
    """
    answers, yard = record["methods"][name], record["methods"][YARDSTICK]
    if "error" in answers:
        return {"error": answers["error"]}
    us, yard_us = np.array(answers["us"]), np.array(yard["us"])
    losses, gaps = 100 * losses_of(record, name), 100 * gaps_of(record, name)
    cells = record["traversable_cells"]
    gain_s = 1e-6 * nanmean(yard_us - us)
    return {
        "success %": 100 * answers["agreed"] / record["asked"],
        "us": nanquantile(us, 0.5),
        "us p95": nanquantile(us, 0.95),
        "search us": nanquantile(np.array(answers["search_us"]), 0.5),
        "speed-up": nanquantile(yard_us / us, 0.5),
        "slower by us": nanquantile(us - yard_us, 0.5),
        **_of_losses(losses),
        "gap mean %": nanmean(gaps),
        "gap p95 %": nanquantile(gaps, 0.95),
        "expanded": nanmean(np.array(answers["expanded"])),
        "preparation s": answers["seconds"],
        "us/cell": 1e6 * answers["seconds"] / cells,
        "B/cell": answers["bytes"] / cells,
        "break-even": _break_even(answers["seconds"], gain_s),
        "break-even with places": _break_even(
            answers["seconds"] + record["places_seconds"], gain_s
        ),
    }


def losses_of(record: Record, name: str) -> FloatArray:
    """Cost over the optimum of the metric - 1 for each pair, none where no optimum is known."""
    best = optima_m(record, METHODS[name])
    if best is None:
        return np.empty(0)
    losses: FloatArray = np.array(record["methods"][name]["cost_m"]) / best - 1
    return losses


def gaps_of(record: Record, name: str) -> FloatArray:
    """Cost over lower bound - 1 for each pair."""
    cost, bound = (np.array(record["methods"][name][key]) for key in ("cost_m", "bound_m"))
    gaps: FloatArray = cost / bound - 1
    return gaps


def _of_losses(percent: FloatArray) -> Row:
    return {
        "loss mean %": nanmean(percent),
        "loss p95 %": nanquantile(percent, 0.95),
        "loss max %": nanquantile(percent, 1.0),
        "optimal %": 100 * nanmean(np.asarray(percent <= 100 * SLACK, dtype=np.float64)),
    }


def _break_even(price_s: float, gain_s: float) -> float:
    """Queries after which the gain of each has paid the preparation."""
    return math.ceil(price_s / gain_s) if gain_s > 0 else math.inf


def page(records: Sequence[Record], *, pairs: int) -> str:
    """All tables in Markdown."""
    slow = [record for record in records if _yard_us(record) >= LEAST_US]
    exact = sum(record["any_angle_m"] is not None for record in records)
    summary = "Speed-ups and times: the median within a map, then the median, and the worst, over"
    return f"""# Queries: every preset against grid A*

{len(records)} maps, up to {pairs} pairs in the largest component of each. One process, pairs
interleaved, everything timed at `planner.plan`; search us is the time inside searches and kernels.
A* expands a cell in {_ns_per_expansion(records)} ns: median over maps, least and most.
Octile losses are against its paths, any-angle ones against the exact any-angle optimum, which is
known on {exact} of the maps; there the grid optimum is {text_of(_of_the_grid(records))} % longer.

Promises broken: {len(violations(records))}.

## The {len(slow)} maps where A* takes at least 1 ms

{summary} maps.
Losses and gaps: over all pairs.

{to_markdown([_summary(slow, name) for name in METHODS])}
## All {len(records)} maps

{to_markdown([_summary(records, name) for name in METHODS])}
## By kind of map, with what preparation takes

us and bytes per traversable cell on top of the topological map, median and worst over maps; queries
until preparation has paid, median over maps, without and with the topological map.

{to_markdown(_by_kind(records))}
## Map by map

Speed-up and mean loss of each preset. core %: how much of the time the process had a core; well
below 100 the machine was busy with other things.

{to_markdown([_line(record) for record in records])}{_not_prepared(records)}
## The {N_WORST} worst pairs of each preset

{to_markdown([row for name in METHODS for row in _worst(records, name)])}
## All figures

{to_markdown(_all_figures(records))}"""


def _all_figures(records: Sequence[Record]) -> list[Row]:
    return [
        {"map": record["map"], "preset": name, **figures(record, name)}
        for record in records
        for name in METHODS
    ]


def violations(records: Sequence[Record]) -> list[str]:
    """All broken promises, one line each."""
    return [f"{record['map']}: {text}" for record in records for text in record["violations"]]


def _yard_us(record: Record) -> float:
    return nanquantile(np.array(record["methods"][YARDSTICK]["us"]), 0.5)


def _ns_of(record: Record) -> float:
    """A*'s time for a cell: median over the half of the pairs that expand most, where what a query
    takes besides counts little."""
    yard = record["methods"][YARDSTICK]
    us, expanded = np.array(yard["search_us"]), np.array(yard["expanded"])
    long = expanded >= max(nanquantile(expanded, 0.5), 1)
    return nanquantile(1e3 * us[long] / expanded[long], 0.5)


def _ns_per_expansion(records: Sequence[Record]) -> str:
    values = np.array([_ns_of(record) for record in records])
    middle, least, most = (text_of(nanquantile(values, share)) for share in (0.5, 0.0, 1.0))
    return f"{middle} ({least} to {most})"


def _of_the_grid(records: Sequence[Record]) -> float:
    """How much longer the grid optimum is than the any-angle one, mean over pairs in per cent."""
    parts = [
        np.array(record["methods"][YARDSTICK]["cost_m"]) / np.array(record["any_angle_m"])
        for record in records
        if record["any_angle_m"] is not None
    ]
    return 100 * (nanmean(_pooled(parts)) - 1)


def _pooled(parts: Sequence[FloatArray]) -> FloatArray:
    return np.concatenate(parts) if parts else np.empty(0)


def _prepared(records: Sequence[Record], name: str) -> list[Record]:
    return [record for record in records if "error" not in record["methods"][name]]


def _summary(records: Sequence[Record], name: str) -> Row:
    """A preset over some maps."""
    there = _prepared(records, name)
    rows = [(record["map"], figures(record, name)) for record in there]
    if not rows:
        return {"preset": name, "maps": 0}
    slowest, least = min(((m, f["speed-up"]) for m, f in rows), key=lambda pair: pair[1])
    losses = 100 * _pooled([losses_of(record, name) for record in there])
    gaps = 100 * _pooled([gaps_of(record, name) for record in there])
    of_losses = _of_losses(losses)
    return {
        "preset": name,
        "maps": len(rows),
        "success %": min(_column(rows, "success %")),
        "us": nanquantile(_column(rows, "us"), 0.5),
        "us p95": nanquantile(_column(rows, "us p95"), 0.5),
        "search us": nanquantile(_column(rows, "search us"), 0.5),
        "speed-up": nanquantile(_column(rows, "speed-up"), 0.5),
        "worst": least,
        "on": slowest,
        "slower by us, worst": max(0.0, *_column(rows, "slower by us")),
        **{key: of_losses[key] for key in ("loss mean %", "loss p95 %", "loss max %", "optimal %")},
        "gap mean %": nanmean(gaps),
        "gap p95 %": nanquantile(gaps, 0.95),
    }


def _column(rows: Sequence[tuple[str, Row]], key: str) -> FloatArray:
    return np.array([row[key] for _, row in rows], dtype=np.float64)


def _by_kind(records: Sequence[Record]) -> list[Row]:
    table: list[Row] = []
    for kind in KINDS:
        of_kind = [record for record in records if record["kind"] == kind]
        for name in METHODS:
            there = _prepared(of_kind, name)
            if there:
                table.append({"kind": kind, **_kind_row(there, name)})
        table += _places(of_kind, kind)
    return table


def _kind_row(records: Sequence[Record], name: str) -> Row:
    rows = [(record["map"], figures(record, name)) for record in records]
    whole = _summary(records, name)
    row: Row = {key: whole[key] for key in KIND_COLUMNS}
    row["expanded"] = nanmean(_column(rows, "expanded"))
    row |= _median_and_worst(rows, "us/cell") | _median_and_worst(rows, "B/cell")
    for key in ("break-even", "break-even with places"):
        row[key] = float(np.median(_column(rows, key)))
    return row


def _places(records: Sequence[Record], kind: str) -> list[Row]:
    """What the topological map takes, which all planners share."""
    rows: list[tuple[str, Row]] = [
        (
            record["map"],
            {
                "us/cell": 1e6 * record["places_seconds"] / record["traversable_cells"],
                "B/cell": record["places_bytes"] / record["traversable_cells"],
            },
        )
        for record in records
    ]
    if not rows:
        return []
    first: Row = {"kind": kind, "preset": "(topological map)", "maps": len(rows)}
    return [first | _median_and_worst(rows, "us/cell") | _median_and_worst(rows, "B/cell")]


def _median_and_worst(rows: Sequence[tuple[str, Row]], key: str) -> Row:
    values = _column(rows, key)
    return {key: nanquantile(values, 0.5), f"{key}, worst": nanquantile(values, 1.0)}


def _line(record: Record) -> Row:
    """A map in one line."""
    row: Row = {
        "map": record["map"],
        "kind": record["kind"],
        "M cells": record["traversable_cells"] / 1e6,
        "A* ms": 1e-3 * _yard_us(record),
        "ns/expansion": _ns_of(record),
        "core %": 100 * record["core_share"],
    }
    for name in METHODS:
        if name == YARDSTICK:
            continue
        one = figures(record, name)
        loss = text_of(one.get("loss mean %", math.nan))
        speed = text_of(one.get("speed-up", math.nan))
        row[name] = "-" if "error" in one else f"{speed}x" + (f" {loss} %" if loss else "")
    return row


def _not_prepared(records: Sequence[Record]) -> str:
    lines = [
        f"* {record['map']}, {name}: {answers['error']}\n"
        for record in records
        for name, answers in record["methods"].items()
        if "error" in answers
    ]
    return "\nNot prepared:\n\n" + "".join(lines) if lines else ""


def _worst(records: Sequence[Record], name: str) -> list[Row]:
    """The pairs that lose most, those that lose nothing left out."""
    found: list[tuple[float, Record, int]] = [
        (float(loss), record, i)
        for record in _prepared(records, name)
        for i, loss in enumerate(losses_of(record, name))
        if loss > SLACK
    ]
    found.sort(key=lambda entry: -entry[0])
    return [
        {
            "preset": name,
            "map": record["map"],
            "start": str(tuple(record["starts"][i])),
            "goal": str(tuple(record["goals"][i])),
            "cost m": record["methods"][name]["cost_m"][i],
            "loss %": 100 * loss,
        }
        for loss, record, i in found[:N_WORST]
    ]
