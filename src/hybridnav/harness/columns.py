"""The columns of the report: what each holds, and how it is computed from the outcomes.

S. Thrun: Learning metric-topological maps for indoor mobile robot navigation, Artificial
Intelligence 99(1), 1998.
"""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from operator import attrgetter, methodcaller

import numpy as np

from hybridnav._base.typing import FloatArray
from hybridnav.harness.judges import summarise
from hybridnav.harness.outcome import EXPANSIONS, MapQuery, Outcome, nanmean, nanquantile
from hybridnav.harness.records import Record, query_key
from hybridnav.harness.tables import METHOD_COLUMNS, Row, text_of
from hybridnav.harness.yardstick import ANSWERED, KINDS, OPTIMA, Kind, Optimum

RIGHTLY, WRONGLY = '"no path", right', '"no path", wrong'
CONSISTENCY_COLUMNS = {
    "regions": "contradictions in checks of a map: every region is connected, and regions are "
    "joined by edges exactly when moves join their cells, for all pairs of cells at once",
    "plan to path": "contradictions in checked plans: a metric path leads through the regions of "
    "the plan, arc by arc, in their order",
    "path to plan": "contradictions in checked paths: each step between two regions has an edge",
    "paths": "contradictions in checked paths: endpoints, steps, exact intersection with blocked "
    "cells",
    RIGHTLY: "pairs for which it said rightly that there is no path",
    WRONGLY: "answers that contradict the grid on whether there is a path: no path "
    "where there is one, or a path where there is none",
    "bounds": "contradictions in checked answers by the optima: a length or cost below the "
    "optimum, a bound that is broken, a claim about its own path that is wrong",
    "proofs": "proofs of answers that `check_proof` rejected, or that are about another query, of "
    "those that the method handed in",
    "without an answer": "queries that ended in an error, out of time, or with a lost process",
}
"""Columns of the table of consistency, and their meaning."""

_OF_LOSS = {
    "mean %": "mean of length (or cost) over the optimum of the caption, minus 1, over the pairs "
    "that all methods solved",
    "of means %": "sum of the lengths (or costs) of these pairs over that of their optima, minus 1",
    "95 % interval": "bootstrap interval of that mean, over pairs, not over maps",
    "median %": "median of the same losses over the same pairs",
    "p95 %": "their 95th percentile",
    "max %": "the largest of them",
    "without loss %": "share of the same pairs whose loss is 0",
}
_OF_PLAN = {
    "loss of the plan %": "Thrun's loss: mean over the same pairs of the best path of cells inside "
    "the regions of the plan over the best of all, minus 1, whatever path the method takes there, "
    "or beside them",
    "in order %": "the same of the best path of cells that passes these regions in their order; of "
    "plans that were searched for, in runs without costs",
}
_OF_COSTS = {
    "length mean m": "mean length over the same pairs, metres",
    "cost mean m": "mean cost over the same pairs, metres times factors",
    "gap mean %": "mean of cost over the lower bound that the method proved, minus 1, over the "
    "same pairs",
    "gap max %": "the largest of these gaps",
    "gap to cells mean %": "the mean gap to a proved bound on paths of cells alone, for any-angle "
    "paths; below 0 where they cost less",
}
_SOLVED = {
    "metric": "metric of its paths: octile, paths of cells; any-angle, paths of points; weighted "
    "and any-angle-weighted, the same, planned by costs; regions, none: it has plans alone",
    "solved %": "share of the pairs of two joined cells for which it found a path of its own "
    "without a fault",
    "planned %": "share of these pairs for which it answered with regions alone, without a fault",
    "by the grid %": "share of these pairs for which the path of the grid, shortened by line of "
    "sight, replaced one that it did not find; it counts in no other column",
}
EFFICIENCY_COLUMNS = {
    "expansions": "mean over the pairs that all methods solved of the things taken from the queue "
    "of a search: cells, intervals of the mesh, nodes; maps.csv has each kind by "
    "itself. They differ in price: see the next two columns",
    "an expansion in cells": "price of one such thing, with its look-ups in tables, tests of sight "
    "and unpacking: time of all queries over all expansions, divided by the same ratio of the "
    "reference, which expands cells alone (a ratio of sums)",
    "work in cells": "expansions times that price: the mean time of a query in the unit in which "
    "the reference expands one cell. Work of different methods can be compared, their expansions "
    "cannot",
    "steps": "mean steps of its plans, of a method without a topological layer those of its paths; "
    "none of plans that are read off paths",
    "backups": "Thrun's count of value-iteration backups: nodes times steps, mean over the maps",
    "query ms, median": "median wall-clock time of one query over these pairs, from two ends to "
    "the path, kernels warm; with repeats the time of a pair is their median",
    "query ms, p95": "95th percentile of these times",
    "spread %": "longest minus shortest time of the repeats of a pair, over their median: the "
    "median of this over these pairs",
    "speed-up": "median over these pairs of the ratio of the reference's time to the method's; "
    "below 1 the method is slower",
    "speed-up of means": "ratio of the reference's mean time to the method's, over the same pairs: "
    "what a robot saves that asks them all",
    "preparation s": "mean over the maps of the seconds from the loaded map to the first query",
    "memory MB": "mean over the maps of the arrays that the prepared method holds, without those "
    "of OMPL's process and those inside packages of others",
    "break-even queries": "queries after which the longer preparation has paid off, by mean times; "
    "never without a gain",
}
"""Columns of the table of efficiency, and their meaning."""

MEANINGS = {
    "method": "name of the method",
    "maps": "number of maps",
    "nodes": "mean over the maps of the nodes of its graph or topological layer",
    "edges": "mean over the maps of the edges of the same, both directions as one",
    **METHOD_COLUMNS,
    **_SOLVED,
    **_OF_LOSS,
    **_OF_PLAN,
    **_OF_COSTS,
    **EFFICIENCY_COLUMNS,
    **CONSISTENCY_COLUMNS,
}
"""What each column of the report holds."""

DEFINITION = (
    "Two layers are consistent when each path of one has its counterpart in the other (S. Thrun: "
    "Learning metric-topological maps for indoor mobile robot navigation, Artificial Intelligence "
    "99(1), 1998, pages 21-71). Every plan over regions has a metric path inside them, and every "
    "metric path maps to a walk over regions. Both agree on whether there is a path. "
    "Connectivity is computed by scipy, not by the planners. Beside these the harness checks that "
    "paths are paths and that bounds hold. A cell reads: contradictions of checks; it is empty "
    "if that check had no case. A plan that is read off a path is consistent with it by "
    "construction, and loses nothing: its zeros say that the reading is right, no more."
)
"""What the table of consistency holds."""


def loss_columns(optimum: Optimum) -> tuple[str, ...]:
    """Return the columns of the table of losses over an optimum."""
    losses = (f"{optimum} loss {what}" for what in _OF_LOSS)
    plan = () if optimum == "any-angle" else _OF_PLAN
    return (*_SOLVED, *losses, *plan, *(_OF_COSTS if optimum == "weighted" else ()))


def consistency_row(outcomes: Sequence[Outcome]) -> Row:
    """Return the contradictions of one method on some maps, by kind.

    `outcomes`: outcomes of the method, one for each map. Result: by column: for each kind a text
    "WRONG of CHECKED", empty where nothing was checked, and both numbers as "KIND wrong" and "KIND
    checked". A record with several contradictions of a kind counts once.
    """
    wrong: Counter[Kind] = Counter()
    checked: Counter[Kind] = Counter()
    rightly = 0
    for outcome in outcomes:
        for record in (outcome.preparation, *outcome.records):
            reference = outcome.optimum.get(query_key(record)) if "start" in record else None
            kinds: set[Kind] = set(record.get("fault_kinds", ()))
            wrong.update(kinds)
            checked.update(_checked(record, reference) | kinds)
            rightly += record["status"] == "no path" and "no path" not in kinds
    row: Row = {}
    for kind in KINDS:
        row[WRONGLY if kind == "no path" else kind] = _share(wrong[kind], checked[kind])
        row[f"{kind} wrong"], row[f"{kind} checked"] = wrong[kind], checked[kind]
    row[RIGHTLY] = rightly
    row["without an answer"] = sum(outcome.failures for outcome in outcomes)
    return row


def _checked(record: Record, reference: Record | None) -> set[Kind]:
    kinds: set[Kind] = set(record.get("checked", ()))
    if record["type"] == "pair" and record["status"] in ANSWERED:
        if record["status"] == "solved":
            kinds.add("paths")
        if reference is not None and reference["status"] in ANSWERED:
            kinds.add("no path")
            if record["status"] == reference["status"] == "solved":
                kinds.add("bounds")
    return kinds


def _share(wrong: int, checked: int) -> str:
    return f"{wrong:,} of {checked:,}" if checked else ""


class _Pool:
    """Arrays of the outcomes of one method, laid end to end: of all pairs, and of those in
    common."""

    def __init__(self, outcomes: Sequence[Outcome], common: set[MapQuery]) -> None:
        self._outcomes = outcomes
        self._shared = np.array([x for one in outcomes for x in one.among(common)], np.bool_)

    def of(self, get: Callable[[Outcome], FloatArray]) -> FloatArray:
        """Return an array over all pairs."""
        parts = [get(outcome) for outcome in self._outcomes]
        return np.concatenate(parts) if parts else np.empty(0)

    def shared(self, get: str | Callable[[Outcome], FloatArray]) -> FloatArray:
        """Return an array, or the one of this name, over the pairs in common."""
        return self.of(attrgetter(get) if isinstance(get, str) else get)[self._shared]

    def mean_of(self, key: str) -> float:
        """Return the mean over the maps of a field of the records of preparation."""
        values = [outcome.preparation.get(key, math.nan) for outcome in self._outcomes]
        return nanmean(np.array(values, dtype=float))


def figures(
    outcomes: Sequence[Outcome], references: Sequence[Outcome], common: set[MapQuery]
) -> Row:
    """Return the figures of one method on some maps.

    `outcomes`: outcomes of the method, one for each map; `references`: outcomes of the reference on
    the same maps, in the same order; `common`: the pairs over which methods are compared: losses,
    times and expansions are theirs. Result: by column, see `MEANINGS`. Nodes, memory and
    preparation are means over the maps. Columns about costs are those of runs with costs alone;
    losses over an optimum that no pair has are left out.
    """
    pool = _Pool(outcomes, common)
    lengths = pool.of(attrgetter("lengths_m"))
    fallbacks = [outcome.by_grid for outcome in outcomes if not math.isnan(outcome.by_grid)]
    by_grid = int(sum(fallbacks)) if fallbacks else math.nan
    solved, pairs = int(np.isfinite(lengths).sum()), len(lengths)
    planned = sum(int(outcome.planned.sum()) for outcome in outcomes)
    by_costs = any(outcome.costs for outcome in outcomes)
    # A method that was not asked on a map says nothing of its metric there.
    asked = [outcome for outcome in outcomes if outcome.is_asked] or outcomes
    row: Row = {
        "metric": asked[0].metric if asked else "",
        "pairs": pairs,
        "solved": solved,
        "solved %": 100 * solved / pairs if pairs else math.nan,
        "planned %": 100 * planned / pairs if planned else math.nan,
        "by the grid": by_grid,
        "by the grid %": 100 * by_grid / pairs if pairs else math.nan,
        "faults": sum(len(outcome.faults) for outcome in outcomes),
        "pairs in common": int(pool.shared("answered").sum()),
        **consistency_row(outcomes),
    }
    for optimum in OPTIMA:
        if optimum != "weighted" or by_costs:
            row |= _losses(pool, optimum)
    row["loss of the plan %"] = 100 * nanmean(pool.shared("plan_losses"))
    row["in order %"] = 100 * nanmean(pool.shared("in_order_losses"))
    if by_costs:
        row |= {
            "length mean m": nanmean(pool.shared("lengths_m")),
            "cost mean m": nanmean(pool.shared("costs_m")),
            "gap mean %": 100 * nanmean(pool.shared("gaps")),
            "gap max %": 100 * nanquantile(pool.shared("gaps"), 1.0),
            "gap to cells mean %": 100 * nanmean(pool.shared("grid_gaps")),
            "gap to cells p99 %": 100 * nanquantile(pool.shared("grid_gaps"), 0.99),
        }
    return row | _efficiency(pool, outcomes, references)


def _losses(pool: _Pool, optimum: Optimum) -> Row:
    """Return the losses over one optimum: over the pairs in common, and, in one column, over all
    that the method solved."""
    losses = methodcaller("losses_over", optimum)
    every, shared = pool.of(losses), pool.shared(losses)
    of_optima = np.where(
        np.isfinite(shared), pool.shared(f"{optimum.replace('-', '_')}_optima_m"), np.nan
    )
    summary = summarise(shared[np.isfinite(shared)])
    low, high = (text_of(100 * end) for end in summary.mean_interval)
    figures: Row = {
        "mean %": 100 * summary.mean,
        "of means %": 100
        * _quotient(float(np.nansum(shared * of_optima)), float(np.nansum(of_optima))),
        "95 % interval": f"{low} to {high}" if np.isfinite(shared).any() else "",
        "median %": 100 * summary.median,
        "p95 %": 100 * summary.p95,
        "p99 %": 100 * summary.p99,
        "max %": 100 * summary.max,
        "without loss %": 100 * summary.share_without_loss,
        "mean of all solved %": 100 * nanmean(every),
    }
    return {f"{optimum} loss {what}": value for what, value in figures.items()}


def _efficiency(pool: _Pool, outcomes: Sequence[Outcome], references: Sequence[Outcome]) -> Row:
    """Return counts and times over the pairs in common, and what preparation takes."""
    seconds, expansions = pool.shared("seconds"), pool.shared("expansions")
    whole, of_grid = pool.shared("reference_seconds"), pool.shared("reference_expansions")
    preparation, own = (
        nanmean(np.array([outcome.preparation_seconds for outcome in some]))
        for some in (outcomes, references)
    )
    queries = len(pool.of(attrgetter("seconds"))) / max(len(outcomes), 1)
    counts = np.array([outcome.thrun_count for outcome in outcomes])
    of_map = {outcome.map_name: outcome.thrun_count for outcome in references}
    grid_counts = np.array([of_map.get(outcome.map_name, math.nan) for outcome in outcomes])
    both = np.isfinite(seconds)
    each = _quotient(float(np.nansum(seconds)), float(np.nansum(expansions)))
    of_cell = _quotient(float(whole[both].sum()), float(of_grid[both].sum()))
    return {
        "nodes": pool.mean_of("n_nodes"),
        "edges": pool.mean_of("n_edges"),
        "steps": nanmean(pool.of(attrgetter("steps"))),
        "backups": nanmean(counts),
        "backups of the grid / backups": nanquantile(_ratio(grid_counts, counts), 0.5),
        **{
            column: nanmean(pool.shared(methodcaller("figure", key)))
            for key, column in EXPANSIONS.items()
        },
        "expansions": nanmean(expansions),
        "expansions of the grid / expansions": nanquantile(_ratio(of_grid, expansions), 0.5),
        "us an expansion": 1e6 * each,
        "an expansion in cells": _quotient(each, of_cell),
        "work in cells": _quotient(nanmean(seconds), of_cell),
        "query ms, median": 1e3 * nanquantile(seconds, 0.5),
        "query ms, p95": 1e3 * nanquantile(seconds, 0.95),
        "spread %": 100 * nanquantile(pool.shared("spreads"), 0.5),
        "query ms, mean": 1e3 * nanmean(seconds),
        "without refinement ms": 1e3 * nanquantile(pool.shared("coarse_seconds"), 0.5),
        "with preparation ms": 1e3 * (nanmean(seconds) + preparation / max(queries, 1)),
        "speed-up": nanquantile(_ratio(whole, seconds), 0.5),
        "speed-up of means": _quotient(nanmean(whole[both]), nanmean(seconds)),
        "preparation s": preparation,
        "memory MB": pool.mean_of("memory_bytes") / 1e6,
        "break-even queries": _break_even(preparation - own, nanmean(whole - seconds)),
    }


def _quotient(first: float, second: float) -> float:
    """Return a quotient, NaN for a zero divisor."""
    return first / second if second else math.nan


def _break_even(price: float, gain: float) -> float:
    """Return the queries after which a gain for each has paid a price, seconds both. The result is
    infinite without a gain, and NaN if nothing is known or the method is the reference itself."""
    if not abs(gain) > 0 or math.isnan(price):
        return math.nan
    return math.ceil(max(price, 0.0) / gain) if gain > 0 else math.inf


def _ratio(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return quotients, NaN for a zero divisor."""
    return np.divide(first, second, out=np.full(len(first), math.nan), where=second > 0)
