"""Figures of a study by column: a row for each method, on a map, or on all maps together."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.harness.analysis import not_everywhere, pairs_in_common
from hybridnav.harness.columns import EFFICIENCY_COLUMNS, OPTIMA
from hybridnav.harness.kinds import consistency_row
from hybridnav.harness.methods import REFERENCE
from hybridnav.harness.outcome import EXPANSIONS, nanmean, nanquantile
from hybridnav.harness.tables import text_of
from hybridnav.metrics import distance_buckets, summarise

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._typing import BoolArray, FloatArray
    from hybridnav.harness.analysis import Study
    from hybridnav.harness.outcome import MapQuery, Outcome
    from hybridnav.harness.tables import Row
    from hybridnav.harness.yardstick import Optimum


def figures(
    outcomes: Sequence[Outcome], references: Sequence[Outcome], common: set[MapQuery]
) -> Row:
    """Return the figures of one method on some maps.

    Parameters
    ----------
    outcomes
        Outcomes of the method, one for each map.
    references
        Outcomes of the reference on the same maps, in the same order.
    common
        The pairs over which methods are compared: losses, times and expansions are theirs.

    Returns
    -------
    dict
        By column, see `MEANINGS`. Nodes, memory and preparation are means over the maps. Columns
        about costs are those of runs with costs alone; losses over an optimum that no pair has are
        left out.
    """
    lengths = _pooled([outcome.lengths_m for outcome in outcomes])
    shared = np.array([one for outcome in outcomes for one in outcome.among(common)], np.bool_)
    fallbacks = [outcome.by_grid for outcome in outcomes if not math.isnan(outcome.by_grid)]
    by_grid = int(sum(fallbacks)) if fallbacks else math.nan
    solved, pairs = int(np.isfinite(lengths).sum()), len(lengths)
    by_costs = any(outcome.costs for outcome in outcomes)
    # A method that was not asked on a map says nothing of its metric there.
    asked = [outcome for outcome in outcomes if outcome.is_asked] or outcomes
    row: Row = {
        "metric": asked[0].metric if asked else "",
        "pairs": pairs,
        "solved": solved,
        "solved %": 100 * solved / pairs if pairs else math.nan,
        "by the grid": by_grid,
        "by the grid %": 100 * by_grid / pairs if pairs else math.nan,
        "faults": sum(len(outcome.faults) for outcome in outcomes),
        "pairs in common": int(np.isfinite(lengths[shared]).sum()),
        **consistency_row(outcomes),
    }
    for optimum in OPTIMA:
        if optimum != "weighted" or by_costs:
            row |= _losses(outcomes, shared, optimum)
    plan = _pooled([outcome.plan_losses for outcome in outcomes])[shared]
    row["loss of the plan %"] = 100 * nanmean(plan)
    if by_costs:
        row |= _of_costs(outcomes, shared)
    return row | _efficiency(outcomes, references, shared)


def _losses(outcomes: Sequence[Outcome], shared: BoolArray, optimum: Optimum) -> Row:
    """Return the losses over one optimum: over the pairs in common, and, in one column, over all
    that the method solved."""
    every = _pooled([outcome.losses_over(optimum) for outcome in outcomes])
    finite = every[shared & np.isfinite(every)]
    summary = summarise(finite)
    low, high = (100 * end for end in summary.mean_interval)
    figures: Row = {
        "mean %": 100 * summary.mean,
        "95 % interval": f"{text_of(low)} to {text_of(high)}" if len(finite) else "",
        "median %": 100 * summary.median,
        "p95 %": 100 * summary.p95,
        "p99 %": 100 * summary.p99,
        "max %": 100 * summary.max,
        "without loss %": 100 * summary.share_without_loss,
        "mean of all solved %": 100 * nanmean(every),
    }
    return {f"{optimum} loss {what}": value for what, value in figures.items()}


def _of_costs(outcomes: Sequence[Outcome], shared: BoolArray) -> Row:
    """Return lengths and costs over the pairs in common, beside each other, and proved gaps."""
    gaps = _pooled([outcome.gaps for outcome in outcomes])[shared]
    to_cells = _pooled([outcome.grid_gaps for outcome in outcomes])[shared]
    return {
        "length mean m": nanmean(_pooled([outcome.lengths_m for outcome in outcomes])[shared]),
        "cost mean m": nanmean(_pooled([outcome.costs_m for outcome in outcomes])[shared]),
        "gap mean %": 100 * nanmean(gaps),
        "gap max %": 100 * nanquantile(gaps, 1.0),
        "gap to cells mean %": 100 * nanmean(to_cells),
        "gap to cells p99 %": 100 * nanquantile(to_cells, 0.99),
    }


def _efficiency(
    outcomes: Sequence[Outcome], references: Sequence[Outcome], shared: BoolArray
) -> Row:
    """Return counts and times over the pairs in common, and what preparation takes."""
    seconds = _pooled([outcome.seconds for outcome in outcomes])[shared]
    whole = _pooled([outcome.reference_seconds for outcome in outcomes])[shared]
    coarse = _pooled([outcome.coarse_seconds for outcome in outcomes])[shared]
    spreads = _pooled([outcome.spreads for outcome in outcomes])[shared]
    expansions = _pooled([outcome.expansions for outcome in outcomes])[shared]
    of_grid = _pooled([outcome.reference_expansions for outcome in outcomes])[shared]
    preparation = nanmean(np.array([outcome.preparation_seconds for outcome in outcomes]))
    queries = len(_pooled([outcome.lengths_m for outcome in outcomes])) / max(len(outcomes), 1)
    own = nanmean(np.array([outcome.preparation_seconds for outcome in references]))
    counts = np.array([outcome.thrun_count for outcome in outcomes])
    of_map = {outcome.map_name: outcome.thrun_count for outcome in references}
    grid_counts = np.array([of_map.get(outcome.map_name, math.nan) for outcome in outcomes])
    kinds: Row = {
        column: nanmean(_pooled([outcome.figure(key) for outcome in outcomes])[shared])
        for key, column in EXPANSIONS.items()
    }
    both = np.isfinite(seconds)
    each = _quotient(float(np.nansum(seconds)), float(np.nansum(expansions)))
    of_cell = _quotient(float(whole[both].sum()), float(of_grid[both].sum()))
    return {
        "nodes": _mean_of(outcomes, "n_nodes"),
        "edges": _mean_of(outcomes, "n_edges"),
        "backups": nanmean(counts),
        "backups of the grid / backups": nanquantile(_ratio(grid_counts, counts), 0.5),
        **kinds,
        "expansions": nanmean(expansions),
        "expansions of the grid / expansions": nanquantile(_ratio(of_grid, expansions), 0.5),
        "us an expansion": 1e6 * each,
        "an expansion in cells": _quotient(each, of_cell),
        "work in cells": _quotient(nanmean(seconds), of_cell),
        "query ms, median": 1e3 * nanquantile(seconds, 0.5),
        "query ms, p95": 1e3 * nanquantile(seconds, 0.95),
        "spread %": 100 * nanquantile(spreads, 0.5),
        "query ms, mean": 1e3 * nanmean(seconds),
        "without refinement ms": 1e3 * nanquantile(coarse, 0.5),
        "with preparation ms": 1e3 * (nanmean(seconds) + preparation / max(queries, 1)),
        "speed-up": nanquantile(_ratio(whole, seconds), 0.5),
        "speed-up of means": _quotient(nanmean(whole[both]), nanmean(seconds)),
        "preparation s": preparation,
        "memory MB": _mean_of(outcomes, "memory_bytes") / 1e6,
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
    quotients: FloatArray = np.divide(
        first, second, out=np.full(len(first), math.nan), where=second > 0
    )
    return quotients


def _mean_of(outcomes: Sequence[Outcome], key: str) -> float:
    values = [outcome.preparation.get(key, math.nan) for outcome in outcomes]
    return nanmean(np.array(values, dtype=float))


def _pooled(parts: list[FloatArray]) -> FloatArray:
    return np.concatenate(parts) if parts else np.empty(0)


def rows_of_map(study: Study, name: str) -> list[Row]:
    """Return one row for each method on a map that was asked there."""
    outcomes = [outcome for outcome in study.of_map(name) if outcome.is_asked]
    reference = [outcome for outcome in outcomes if outcome.label == REFERENCE]
    common = pairs_in_common(outcomes)
    return [
        {"map": name, "method": outcome.label, **figures([outcome], reference, common)}
        for outcome in outcomes
    ]


def rows_of_study(study: Study) -> list[Row]:
    """Return one row for each method, over all of its maps.

    One that was not asked on some of them has no losses and times here: they would be those of
    other pairs. The rows of the maps have them.
    """
    references = {outcome.map_name: outcome for outcome in study.of_method(REFERENCE)}
    partly = not_everywhere(study.outcomes)
    rows = []
    for label in study.labels:
        outcomes = [outcome for outcome in study.of_method(label) if outcome.is_asked]
        if not outcomes:
            continue
        common = set() if label in partly else study.common
        there = [references[o.map_name] for o in outcomes if o.map_name in references]
        row: Row = {"method": label, "maps": len(outcomes)}
        row |= figures(outcomes, there, common)
        if label in partly:
            row |= dict.fromkeys(EFFICIENCY_COLUMNS, math.nan)
        rows.append(row)
    return rows


def rows_by_distance(study: Study, name: str, optimum: Optimum) -> list[Row]:
    """Return the mean loss over an optimum in per cent by the length of the octile optimum, one row
    for each method on a map, over the pairs that all methods solved."""
    outcomes = [outcome for outcome in study.of_map(name) if outcome.is_asked]
    common = pairs_in_common(outcomes)
    rows = []
    for outcome in outcomes:
        buckets = distance_buckets(outcome.optima_m)
        losses = np.where(outcome.among(common), outcome.losses_over(optimum), math.nan)
        row: Row = {"method": outcome.label}
        for at, label in enumerate(buckets.labels):
            inside = losses[(buckets.indices == at) & np.isfinite(losses)]
            if len(inside):
                row[f"{label} ({len(inside)})"] = 100 * nanmean(inside)
        if len(row) > 1:
            rows.append(row)
    return rows
