"""All that one method did on one map, in arrays."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.harness.contradictions import (
    ANSWERED,
    ANY_ANGLE_SLACK,
    NOT_ASKED,
    SLACK,
    TOO_SLOW,
    contradiction,
    is_any_angle,
    octile_optimum_m,
)
from hybridnav.harness.paths import path_steps
from hybridnav.metrics import thrun_count

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray
    from hybridnav.harness.records import Record
    from hybridnav.harness.yardstick import Optimum, Yardstick

EXPANSIONS = {
    "expanded": "cells expanded",
    "expanded_nodes": "nodes expanded",
    "expanded_border_cells": "border cells expanded",
    "expanded_intervals": "intervals expanded",
}
"""Fields of records that count things taken from the queue of a search, and their columns."""

_FINE = ("ready", NOT_ASKED, *ANSWERED)

QueryKey = tuple[str, tuple[int, ...], tuple[int, ...]]
MapQuery = tuple[str, QueryKey]


def query_key(record: Record) -> QueryKey:
    """Return the key that the records of all methods share for one query on a map."""
    return record["kind"], tuple(record["start"]), tuple(record["goal"])


@dataclass
class Outcome:
    """All that one method did on one map.

    Arrays have one entry for each pair of different cells that the method answered and the
    reference solved, in the reference's order; NaN for a missing figure.
    """

    map_name: str
    label: str
    """The method's name, with its hash where a run holds it with several settings."""
    preparation: Record
    records: list[Record]
    """One record for each pair, of every kind."""
    optimum: dict[QueryKey, Record] = field(repr=False)
    """The reference's records on this map."""
    yardstick: Yardstick = "both"
    """What `losses` refer to."""

    @property
    def is_asked(self) -> bool:
        """Whether the method was asked on this map, which it may refuse by a limit of its own."""
        return bool(self.preparation["status"] != NOT_ASKED)

    @cached_property
    def _matched(self) -> list[Record | None]:
        own = {query_key(record): record for record in self.records}
        return [own.get(query_key(record)) for record in self.references]

    @cached_property
    def references(self) -> list[Record]:
        """The reference's records of the pairs in the arrays."""
        asked = {query_key(record) for record in self.records if self.is_asked}
        return [
            record
            for key, record in self.optimum.items()
            if (record.get("length_m") or 0) > 0 and not record.get("faults") and key in asked
        ]

    def figure(self, key: str) -> FloatArray:
        """Return one number of each record."""
        values = (record and record.get(key) for record in self._matched)
        return np.array([math.nan if value is None else value for value in values], dtype=float)

    @cached_property
    def metric(self) -> str:
        """Metric of the method's paths: "octile" or "any-angle"; "weighted" or "any-angle-weighted"
        if it planned by costs."""
        if self.preparation.get("by_costs"):
            return "any-angle-weighted" if self.is_any_angle else "weighted"
        return "any-angle" if self.is_any_angle else "octile"

    @cached_property
    def is_any_angle(self) -> bool:
        """Whether some of the method's paths are any-angle ones."""
        return any(map(is_any_angle, (self.preparation, *self.records)))

    @property
    def costs(self) -> str:
        """Costs of the run, as a text; empty for lengths."""
        return str(self.preparation.get("costs", ""))

    @cached_property
    def optima_m(self) -> FloatArray:
        """Lengths of the shortest path of cells."""
        return np.array([octile_optimum_m(record) for record in self.references], dtype=float)

    @cached_property
    def weighted_optima_m(self) -> FloatArray:
        """Least costs of paths of cells; NaN in a run without costs."""
        known = [record.get("weighted_m", math.nan) for record in self.references]
        return np.array(known, dtype=float)

    @cached_property
    def any_angle_optima_m(self) -> FloatArray:
        """Lengths of the any-angle optimum between the same endpoints; NaN if paths may cut
        corners."""
        known = [record.get("any_angle_m", math.nan) for record in self.references]
        return np.array(known, dtype=float)

    @cached_property
    def _octile_optima_m(self) -> FloatArray:
        """Octile optima; NaN for any-angle paths, which have no loss over them."""
        lines = [bool(record and is_any_angle(record)) for record in self._matched]
        return np.where(lines, math.nan, self.optima_m)

    @cached_property
    def best_m(self) -> FloatArray:
        """Reference lengths of the losses, or costs."""
        if self.yardstick == "weighted":
            return self.weighted_optima_m
        if self.yardstick == "octile":
            return self._octile_optima_m
        if self.yardstick == "any-angle":
            return self.any_angle_optima_m
        lines = np.isnan(self._octile_optima_m)
        return np.where(lines, self.any_angle_optima_m, self.optima_m)

    @cached_property
    def losses(self) -> FloatArray:
        """Lengths, or costs, over those of the reference, minus one. An any-angle path may cost
        less than the cheapest path of cells: then its loss is negative."""
        return loss_of(self.judged_m, self.best_m)

    @property
    def judged_m(self) -> FloatArray:
        """What losses are computed from: the costs of the method's own paths, or their lengths."""
        return self.costs_m if self.yardstick == "weighted" else self.lengths_m

    @cached_property
    def weighted_losses(self) -> FloatArray:
        """Cost over the least cost of paths of cells, minus one, for paths in any metric."""
        return loss_of(self.costs_m, self.weighted_optima_m)

    @cached_property
    def gaps(self) -> FloatArray:
        """Proved distances from the optimum: cost over the proved lower bound on costs, minus one;
        NaN without costs or bound."""
        bounds = self.figure("cost_lower_bound_m")
        gaps: FloatArray = np.divide(
            self.costs_m, bounds, out=np.full(len(bounds), math.nan), where=bounds > 0
        )
        gaps -= 1
        return np.where(gaps <= SLACK, 0.0, gaps)

    @cached_property
    def grid_gaps(self) -> FloatArray:
        """Costs over the proved lower bounds on paths of cells, minus one; below 0 for any-angle
        paths that cost less; NaN without such a bound."""
        return loss_of(self.costs_m, self.figure("cost_grid_bound_m"))

    @cached_property
    def octile_losses(self) -> FloatArray:
        """Length over the octile optimum, minus one; NaN for any-angle paths."""
        return loss_of(self.lengths_m, self._octile_optima_m)

    @cached_property
    def any_angle_losses(self) -> FloatArray:
        """Lengths over the any-angle optimum, minus one, for paths in any metric."""
        return loss_of(self.lengths_m, self.any_angle_optima_m)

    @cached_property
    def solved_keys(self) -> set[MapQuery]:
        """The pairs that the method solved itself, without a fault."""
        solved = np.isfinite(self.lengths_m)
        return {(self.map_name, query_key(self.references[at])) for at in np.flatnonzero(solved)}

    def losses_over(self, optimum: Optimum) -> FloatArray:
        """Return lengths, or with "weighted" costs, over an optimum, minus one."""
        losses: FloatArray = getattr(self, f"{optimum.replace('-', '_')}_losses")
        return losses

    @cached_property
    def expansions(self) -> FloatArray:
        """Things taken from the queues of the searches, of all kinds; NaN without a path, and for a
        method that counts none."""
        kinds = np.array([self.figure(key) for key in EXPANSIONS])
        if not np.nansum(kinds) > 0:
            return np.full(len(self.references), math.nan)
        return np.where(np.isfinite(self.lengths_m), np.nansum(kinds, axis=0), math.nan)

    def among(self, pairs: set[MapQuery]) -> BoolArray:
        """Return whether each pair is one of some."""
        mine = [(self.map_name, query_key(record)) in pairs for record in self.references]
        return np.array(mine, dtype=np.bool_)

    @cached_property
    def lengths_m(self) -> FloatArray:
        """Lengths of the method's own paths without faults."""
        return np.where(self._by_grid, math.nan, self._sound("length_m"))

    @cached_property
    def costs_m(self) -> FloatArray:
        """Costs of the same paths; NaN in a run without costs."""
        return np.where(self._by_grid, math.nan, self._sound("cost_m"))

    @cached_property
    def fallback_losses(self) -> FloatArray:
        """Loss of the grid's paths that stand in for the method's own."""
        key = "cost_m" if self.yardstick == "weighted" else "length_m"
        return loss_of(np.where(self._by_grid, self._sound(key), math.nan), self.best_m)

    @cached_property
    def by_grid(self) -> float:
        """Number of paths that are the grid's, because the method found none; NaN for a method
        without such a fallback."""
        counted = [(record or {}).get("by_grid") for record in self._matched]
        return math.nan if all(one is None for one in counted) else float(self._by_grid.sum())

    @cached_property
    def _by_grid(self) -> BoolArray:
        return np.nan_to_num(self.figure("by_grid")) > 0

    def _sound(self, key: str) -> FloatArray:
        """Return one number of each path without a fault."""
        faulty = [bool(record and record.get("faults")) for record in self._matched]
        return np.where(faulty, math.nan, self.figure(key))

    @cached_property
    def plan_losses(self) -> FloatArray:
        """Thrun's loss of the plan: the best path of cells inside its regions, over the best of
        all, by length or, in a run with costs, by cost."""
        best = self.weighted_optima_m if self.costs else self.optima_m
        return loss_of(self.figure("plan_optimum_m"), best)

    @cached_property
    def seconds(self) -> FloatArray:
        """Wall-clock seconds of each query that the method solved without a fault."""
        return np.where(np.isfinite(self.lengths_m), self.figure("seconds"), math.nan)

    @cached_property
    def reference_seconds(self) -> FloatArray:
        """Wall-clock seconds of the reference on the same pairs."""
        return np.array([record["seconds"] for record in self.references], dtype=float)

    @cached_property
    def reference_expansions(self) -> FloatArray:
        """Expansions of the reference on the same pairs."""
        counts = [sum(record.get(key) or 0 for key in EXPANSIONS) for record in self.references]
        return np.array(counts, dtype=float)

    @cached_property
    def coarse_seconds(self) -> FloatArray:
        """Seconds of the answers themselves, without those in the metric layer."""
        asked = np.where(
            np.isfinite(self.figure("asked_seconds")),
            self.figure("asked_seconds"),
            self.figure("seconds"),
        )
        return np.where(np.isfinite(self.lengths_m), asked, math.nan) - self.refine_seconds

    @cached_property
    def spreads(self) -> FloatArray:
        """Longest minus shortest time of the repeats of each pair, over their median."""
        spreads = []
        for record in self._matched:
            times = (record or {}).get("repeats") or ()
            known = len(times) > 1
            spreads.append(
                (max(times) - min(times)) / float(np.median(times)) if known else math.nan
            )
        return np.array(spreads, dtype=float)

    @cached_property
    def refine_seconds(self) -> FloatArray:
        """Seconds of these queries in the metric layer."""
        return self._stage("refine")

    def _stage(self, name: str) -> FloatArray:
        stages = ((record or {}).get("stages") or {} for record in self._matched)
        return np.array([stage.get(name, math.nan) for stage in stages], dtype=float)

    @property
    def preparation_seconds(self) -> float:
        """Seconds from the loaded map to the first query; NaN if the preparation failed."""
        record = self.preparation
        return float(record.get("pyramid_seconds", math.nan)) + float(
            record.get("method_seconds", math.nan)
        )

    @cached_property
    def thrun_count(self) -> float:
        """Thrun's count: nodes times mean steps of a plan; for a method without a topological
        layer, cells times mean steps of a path. NaN for plans that no search in that layer made,
        which tell nothing of its price."""
        steps = self.figure("plan_steps")
        if np.isfinite(steps).any():
            if not np.nansum(self.figure("expanded_nodes")) > 0:
                return math.nan
        else:
            paths = ((record or {}).get("path") for record in self._matched)
            steps = np.array([math.nan if path is None else path_steps(path) for path in paths])
        return thrun_count(self.preparation.get("n_nodes", math.nan), nanmean(steps))

    @cached_property
    def faults(self) -> list[tuple[Record, str]]:
        """Every contradiction: what the judge found, lengths below the optimum, broken bounds."""
        found = [(self.preparation, fault) for fault in self.preparation.get("faults", ())]
        for record in self.records:
            found += [(record, fault) for fault in record.get("faults", ())]
            reference = self.optimum.get(query_key(record))
            wrong = None if reference is None else contradiction(record, reference)
            if wrong:
                found.append((record, wrong))
        return found

    @property
    def checks(self) -> int:
        """Number of judged answers."""
        return sum(record["status"] in ANSWERED for record in self.records)

    @property
    def failure(self) -> Record | None:
        """The first record that says why there is no answer: of the preparation, or a query."""
        failed = [r for r in (self.preparation, *self.records) if r["status"] not in _FINE]
        return failed[0] if failed else None

    @property
    def failures(self) -> int:
        """Queries without an answer: errors, time-outs, lost workers, and those given up."""
        return sum(record["status"] not in (NOT_ASKED, *ANSWERED) for record in self.records)

    @property
    def failed(self) -> list[Record]:
        """Records of queries in which the method raised, fell silent, or ended its process."""
        told = (NOT_ASKED, TOO_SLOW)
        return [r for r in self.records if "length_m" not in r and r["status"] not in told]


def loss_of(lengths: FloatArray, best: FloatArray) -> FloatArray:
    """Return lengths over the best ones, minus one. Values that are below zero by rounding alone
    become zero."""
    loss = lengths / best - 1
    rounded: FloatArray = np.where((loss <= SLACK) & (loss >= -ANY_ANGLE_SLACK), 0.0, loss)
    return rounded


def nanmean(values: FloatArray) -> float:
    """Return the mean of the finite values, NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else math.nan


def nanquantile(values: FloatArray, share: float) -> float:
    """Return a quantile of the finite values, NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(np.quantile(finite, share)) if finite.size else math.nan
