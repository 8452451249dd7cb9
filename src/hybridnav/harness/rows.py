"""Figures of a study by column: a row for each method, on a map, or on all maps together."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.harness.analysis import pairs_in_common
from hybridnav.harness.methods import REFERENCE
from hybridnav.harness.outcome import nanmean, nanquantile
from hybridnav.harness.tables import text_of
from hybridnav.metrics import distance_buckets, summarise

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._typing import BoolArray, FloatArray
    from hybridnav.harness.analysis import Study
    from hybridnav.harness.outcome import MapQuery, Outcome
    from hybridnav.harness.tables import Row
    from hybridnav.harness.yardstick import Yardstick

_LOSS_COLUMNS = (
    "metric",
    "pairs",
    "solved",
    "by the grid",
    "faults",
    "pairs in common",
    "any-angle loss %",
    "octile loss %",
    "loss mean %",
    "loss 95 % interval",
    "loss median %",
    "loss p95 %",
    "loss p99 %",
    "loss max %",
    "without loss %",
    "loss of the plan %",
    "loss mean m",
)
_COST_COLUMNS = (
    "length mean m",
    "cost mean m",
    "weighted loss %",
    "gap mean %",
    "gap max %",
    "gap to cells mean %",
    "gap to cells p99 %",
)
EFFICIENCY_COLUMNS = (
    "nodes",
    "backups",
    "backups of the grid / backups",
    "cells expanded",
    "nodes expanded",
    "query ms, median",
    "query ms, p95",
    "without refinement ms",
    "with preparation ms",
    "speed-up",
    "preparation s",
    "memory MB",
    "break-even queries",
)


def loss_columns(metric: Yardstick) -> tuple[str, ...]:
    """Return the columns of a table of losses; the loss over the requested optimum comes first."""
    if metric == "weighted":
        at = _LOSS_COLUMNS.index("any-angle loss %")
        return _LOSS_COLUMNS[:at] + _COST_COLUMNS + _LOSS_COLUMNS[at + 2 :]
    leading, other = "any-angle loss %", "octile loss %"
    if metric != "octile":
        return _LOSS_COLUMNS
    swapped = {leading: other, other: leading}
    return tuple(swapped.get(column, column) for column in _LOSS_COLUMNS)


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
        The pairs over which losses of different methods are compared.

    Returns
    -------
    dict
        By column. Losses are pooled over all pairs; nodes, memory and preparation are means over
        the maps; counts and times are means or quantiles over all pairs. Columns about costs are
        those of runs with costs alone.
    """
    losses = _pooled([outcome.losses for outcome in outcomes])
    finite = losses[np.isfinite(losses)]
    summary = summarise(finite)
    lengths = _pooled([outcome.lengths_m for outcome in outcomes])
    judged = _pooled([outcome.judged_m for outcome in outcomes])
    shared = np.array([one for outcome in outcomes for one in outcome.among(common)], np.bool_)
    best = _pooled([outcome.best_m for outcome in outcomes])
    fallbacks = [outcome.by_grid for outcome in outcomes if not math.isnan(outcome.by_grid)]
    low, high = (100 * end for end in summary.mean_interval)
    return {
        "metric": outcomes[0].metric if outcomes else "",
        "pairs": len(losses),
        "solved": int(np.isfinite(lengths).sum()),
        "by the grid": int(sum(fallbacks)) if fallbacks else math.nan,
        "faults": sum(len(outcome.faults) for outcome in outcomes),
        "pairs in common": int(np.isfinite(lengths[shared]).sum()),
        "any-angle loss %": 100 * nanmean(_pooled([o.any_angle_losses for o in outcomes])[shared]),
        "octile loss %": 100 * nanmean(_pooled([o.octile_losses for o in outcomes])[shared]),
        **(_of_costs(outcomes, shared) if any(outcome.costs for outcome in outcomes) else {}),
        "loss mean %": 100 * summary.mean,
        "loss 95 % interval": f"{text_of(low)} to {text_of(high)}" if len(finite) else "",
        "loss median %": 100 * summary.median,
        "loss p95 %": 100 * summary.p95,
        "loss p99 %": 100 * summary.p99,
        "loss max %": 100 * summary.max,
        "without loss %": 100 * summary.share_without_loss,
        "loss of the plan %": 100 * nanmean(_pooled([o.plan_losses for o in outcomes])),
        "loss mean m": nanmean(judged - best),
        **_efficiency(outcomes, references),
    }


def _of_costs(outcomes: Sequence[Outcome], shared: BoolArray) -> Row:
    """Return lengths and costs over the pairs in common, beside each other, and proved gaps."""
    gaps = _pooled([outcome.gaps for outcome in outcomes])
    to_cells = _pooled([outcome.grid_gaps for outcome in outcomes])
    return {
        "length mean m": nanmean(_pooled([outcome.lengths_m for outcome in outcomes])[shared]),
        "cost mean m": nanmean(_pooled([outcome.costs_m for outcome in outcomes])[shared]),
        "weighted loss %": 100
        * nanmean(_pooled([outcome.weighted_losses for outcome in outcomes])[shared]),
        "gap mean %": 100 * nanmean(gaps),
        "gap max %": 100 * nanquantile(gaps, 1.0),
        "gap to cells mean %": 100 * nanmean(to_cells),
        "gap to cells p99 %": 100 * nanquantile(to_cells, 0.99),
    }


def _efficiency(outcomes: Sequence[Outcome], references: Sequence[Outcome]) -> Row:
    seconds = _pooled([outcome.seconds for outcome in outcomes])
    whole = _pooled([outcome.reference_seconds for outcome in outcomes])
    coarse = seconds - _pooled([outcome.refine_seconds for outcome in outcomes])
    preparation = nanmean(np.array([outcome.preparation_seconds for outcome in outcomes]))
    queries = len(seconds) / max(len(outcomes), 1)
    own = nanmean(np.array([outcome.preparation_seconds for outcome in references]))
    counts = np.array([outcome.thrun_count for outcome in outcomes])
    grid_counts = np.array([outcome.thrun_count for outcome in references])
    return {
        "nodes": _mean_of(outcomes, "n_nodes"),
        "backups": nanmean(counts),
        "backups of the grid / backups": nanquantile(_ratio(grid_counts, counts), 0.5),
        "cells expanded": nanmean(_pooled([outcome.figure("expanded") for outcome in outcomes])),
        "nodes expanded": nanmean(
            _pooled([outcome.figure("expanded_nodes") for outcome in outcomes])
        ),
        "query ms, median": 1e3 * nanquantile(seconds, 0.5),
        "query ms, p95": 1e3 * nanquantile(seconds, 0.95),
        "without refinement ms": 1e3 * nanquantile(coarse, 0.5),
        "with preparation ms": 1e3 * (nanmean(seconds) + preparation / max(queries, 1)),
        "speed-up": nanquantile(_ratio(whole, seconds), 0.5),
        "preparation s": preparation,
        "memory MB": _mean_of(outcomes, "memory_bytes") / 1e6,
        "break-even queries": _break_even(preparation - own, nanmean(whole - seconds)),
    }


def _break_even(price: float, gain: float) -> float:
    """Return the queries after which a gain for each has paid a price, seconds both. The result is
    infinite without a gain, and NaN if nothing is known or the method is the reference itself."""
    if not abs(gain) > 0:
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
    """Return one row for each method on a map."""
    outcomes = study.of_map(name)
    reference = [outcome for outcome in outcomes if outcome.label == REFERENCE]
    common = pairs_in_common(outcomes)
    return [
        {"map": name, "method": outcome.label, **figures([outcome], reference, common)}
        for outcome in outcomes
    ]


def rows_of_study(study: Study) -> list[Row]:
    """Return one row for each method, over all of its maps."""
    references = {outcome.map_name: outcome for outcome in study.of_method(REFERENCE)}
    common = pairs_in_common(study.outcomes)
    rows = []
    for label in study.labels:
        outcomes = [o for o in study.of_method(label) if o.map_name in references]
        there = [references[outcome.map_name] for outcome in outcomes]
        rows.append({"method": label, "maps": len(outcomes), **figures(outcomes, there, common)})
    return rows


def rows_by_distance(study: Study, name: str) -> list[Row]:
    """Return the mean loss in per cent by the length of the optimum, one row for each method on a
    map."""
    rows = []
    for outcome in study.of_map(name):
        buckets = distance_buckets(outcome.optima_m)
        row: Row = {"method": outcome.label}
        for at, label in enumerate(buckets.labels):
            inside = outcome.losses[buckets.indices == at]
            if len(inside):
                row[f"{label} ({len(inside)})"] = 100 * nanmean(inside)
        rows.append(row)
    return rows
