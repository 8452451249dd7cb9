"""All that one method did on one map, in arrays."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.harness.judges import thrun_count
from hybridnav.harness.records import QueryKey, Record, path_steps, query_key
from hybridnav.harness.yardstick import (
    ANSWERED,
    ANY_ANGLE_SLACK,
    NOT_ASKED,
    PLANNED,
    REGIONS,
    SLACK,
    TOO_SLOW,
    Optimum,
    Yardstick,
    is_any_angle,
    octile_optimum_m,
)

EXPANSIONS = {
    "expanded": "cells expanded",
    "expanded_nodes": "nodes expanded",
    "expanded_intervals": "intervals expanded",
}
"""Fields of records that count things taken from the queue of a search, and their columns."""

_FINE = ("ready", NOT_ASKED, *ANSWERED)

MapQuery = tuple[str, QueryKey]


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
    def matched(self) -> list[Record | None]:
        """The method's record of each pair in the arrays, None for none."""
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
        values = (record and record.get(key) for record in self.matched)
        return np.array([math.nan if value is None else value for value in values], dtype=float)

    @cached_property
    def metric(self) -> str:
        """Metric of the method's paths: "octile" or "any-angle"; "weighted" or "any-angle-weighted"
        if it planned by costs; "regions" if it has plans alone."""
        if self.has_plans_alone:
            return REGIONS
        if self.preparation.get("by_costs"):
            return "any-angle-weighted" if self.is_any_angle else "weighted"
        return "any-angle" if self.is_any_angle else "octile"

    @cached_property
    def is_any_angle(self) -> bool:
        """Whether some of the method's paths are any-angle ones."""
        return any(map(is_any_angle, (self.preparation, *self.records)))

    @cached_property
    def _faulty(self) -> BoolArray:
        return np.array([bool(r and r.get("faults")) for r in self.matched], dtype=np.bool_)

    @cached_property
    def planned(self) -> BoolArray:
        """Whether each pair was answered by regions alone, without a fault."""
        planned = [bool(record and record["status"] == PLANNED) for record in self.matched]
        return np.array(planned, dtype=np.bool_) & ~self._faulty

    @cached_property
    def has_plans_alone(self) -> bool:
        """Whether the method planned, and found no path."""
        return bool(self.planned.any() and not np.isfinite(self._lengths["lengths_m"]).any())

    @cached_property
    def answered(self) -> BoolArray:
        """Whether the method solved each pair itself without a fault; of one that has plans alone,
        whether it planned."""
        return self.planned if self.has_plans_alone else np.isfinite(self._lengths["lengths_m"])

    @property
    def costs(self) -> str:
        """Costs of the run, as a text; empty for lengths."""
        return str(self.preparation.get("costs", ""))

    @cached_property
    def frame(self) -> dict[str, FloatArray]:
        """The arrays by name; each is an attribute, too."""
        return self._lengths | self._losses | self._efforts | self._steps()

    @cached_property
    def _lengths(self) -> dict[str, FloatArray]:
        """What was found and the optima: of the method's own paths without faults, of the grid's
        paths that stand in for them, and of all."""
        figure, own = self.figure, [record or {} for record in self.matched]
        of_grid = np.nan_to_num(figure("by_grid")) > 0
        lines = np.array([is_any_angle(record) for record in own], dtype=np.bool_)
        octile = np.array([octile_optimum_m(record) for record in self.references], dtype=float)
        weighted, any_angle = self._known("weighted_m"), self._known("any_angle_m")
        # An any-angle path has no loss over the octile optimum.
        of_cells = np.where(lines, math.nan, octile)
        best = {
            "weighted": weighted,
            "octile": of_cells,
            "any-angle": any_angle,
            "both": np.where(lines, any_angle, octile),
        }
        measured = {"lengths_m": figure("length_m"), "costs_m": figure("cost_m")}
        judged = measured["costs_m" if self.yardstick == "weighted" else "lengths_m"]
        missed = of_grid | self._faulty
        return {
            **{name: np.where(missed, math.nan, values) for name, values in measured.items()},
            "judged_m": np.where(missed, math.nan, judged),
            "fallback_m": np.where(of_grid & ~self._faulty, judged, math.nan),
            "best_m": best[self.yardstick],
            "optima_m": octile,
            "octile_optima_m": of_cells,
            "any_angle_optima_m": any_angle,
            "weighted_optima_m": weighted,
        }

    @cached_property
    def _losses(self) -> dict[str, FloatArray]:
        """Lengths, or costs, over what they are compared with, minus one."""
        of, figure = self._lengths, self.figure
        lengths, costs = of["lengths_m"], of["costs_m"]
        of_all = of["weighted_optima_m" if self.costs else "optima_m"]
        return {
            "losses": loss_of(of["judged_m"], of["best_m"]),
            "octile_losses": loss_of(lengths, of["octile_optima_m"]),
            "any_angle_losses": loss_of(lengths, of["any_angle_optima_m"]),
            "weighted_losses": loss_of(costs, of["weighted_optima_m"]),
            "fallback_losses": loss_of(of["fallback_m"], of["best_m"]),
            # Thrun's: the best path of cells inside the regions of the plan, over the best of all.
            "plan_losses": loss_of(figure("plan_optimum_m"), of_all),
            "in_order_losses": loss_of(figure("in_order_m"), of_all),
            "gaps": _gaps(costs, figure("cost_lower_bound_m")),
            # Below 0 for any-angle paths that cost less than the bound on paths of cells.
            "grid_gaps": loss_of(costs, figure("cost_grid_bound_m")),
        }

    @cached_property
    def _efforts(self) -> dict[str, FloatArray]:
        """Times, and the things taken from the queues of searches: none of a method that counts
        none."""
        figure, own = self.figure, [record or {} for record in self.matched]
        solved = self.answered
        seconds, asked = figure("seconds"), figure("asked_seconds")
        answered = np.where(np.isfinite(asked), asked, seconds)
        refined = np.array([(one.get("stages") or {}).get("refine", math.nan) for one in own])
        kinds = np.array([figure(key) for key in EXPANSIONS])
        counted = solved & (np.nansum(kinds) > 0)
        return {
            "expansions": np.where(counted, np.nansum(kinds, axis=0), math.nan),
            "reference_expansions": sum((self._known(key, 0) for key in EXPANSIONS), 0.0),
            "seconds": np.where(solved, seconds, math.nan),
            "reference_seconds": self._known("seconds"),
            # Seconds of the answers, without those that the metric layer took of them.
            "coarse_seconds": np.where(solved, answered, math.nan) - refined,
            "spreads": np.array([_spread(one.get("repeats") or ()) for one in own], dtype=float),
        }

    def __getattr__(self, name: str) -> FloatArray:
        if name.startswith("_") or name in vars(type(self)) or name not in (frame := self.frame):
            raise AttributeError(f"an outcome has no {name}")
        return frame[name]

    def _known(self, key: str, missing: float = math.nan) -> FloatArray:
        """Return one number of each record of the reference."""
        values = (record.get(key) for record in self.references)
        return np.array([missing if value is None else value for value in values], dtype=float)

    @cached_property
    def solved_keys(self) -> set[MapQuery]:
        """The pairs in `answered`."""
        at = np.flatnonzero(self.answered)
        return {(self.map_name, query_key(self.references[one])) for one in at}

    def losses_over(self, optimum: Optimum) -> FloatArray:
        """Return lengths, or with "weighted" costs, over an optimum, minus one."""
        return self.frame[f"{optimum.replace('-', '_')}_losses"]

    def among(self, pairs: set[MapQuery]) -> BoolArray:
        """Return whether each pair is one of some."""
        mine = [(self.map_name, query_key(record)) in pairs for record in self.references]
        return np.array(mine, dtype=np.bool_)

    @cached_property
    def by_grid(self) -> float:
        """Number of paths that are the grid's, because the method found none; NaN for a method
        without such a fallback."""
        asked = [record for record in self.matched if record and record.get("by_grid") is not None]
        return float(sum(record["by_grid"] for record in asked)) if asked else math.nan

    @property
    def preparation_seconds(self) -> float:
        """Seconds from the loaded map to the first query; NaN if the preparation failed."""
        record = self.preparation
        return float(record.get("pyramid_seconds", math.nan)) + float(
            record.get("method_seconds", math.nan)
        )

    @property
    def thrun_count(self) -> float:
        """Thrun's count: nodes times mean steps of a plan; for a method without a topological
        layer, cells times mean steps of a path. NaN for plans that are read off paths, which tell
        nothing of its price."""
        return thrun_count(self.preparation.get("n_nodes", math.nan), nanmean(self.steps))

    def _steps(self) -> dict[str, FloatArray]:
        """Return the steps of the plans without a fault, and the steps that Thrun counts."""
        plans = counted = np.where(self._faulty, math.nan, self.figure("plan_steps"))
        if not np.isfinite(plans).any():
            paths = ((record or {}).get("path") for record in self.matched)
            steps = [math.nan if path is None else path_steps(path) for path in paths]
            counted = np.array(steps, dtype=float)
            counted[self._faulty] = math.nan
        elif not (self.has_plans_alone or np.nansum(self.figure("expanded_nodes")) > 0):
            counted = np.full(len(plans), math.nan)
        nodes = self.preparation.get("n_nodes", math.nan)
        return {"plan_steps": plans, "steps": counted, "backups": nodes * counted}

    @cached_property
    def faults(self) -> list[tuple[Record, str]]:
        """Every contradiction, one of each kind in a record; see `read_records`."""
        every = (self.preparation, *self.records)
        return [(record, fault) for record in every for fault in record.get("faults", ())]

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
    return np.where((loss <= SLACK) & (loss >= -ANY_ANGLE_SLACK), 0.0, loss)


def _gaps(costs: FloatArray, bounds: FloatArray) -> FloatArray:
    """Return costs over proved lower bounds on them, minus one; NaN without costs or bound."""
    nothing = np.full(len(bounds), math.nan)
    gaps: FloatArray = np.divide(costs, bounds, out=nothing, where=bounds > 0) - 1
    return np.where(gaps <= SLACK, 0.0, gaps)


def _spread(times: Sequence[float]) -> float:
    """Return the longest minus the shortest of some times, over their median."""
    return (max(times) - min(times)) / float(np.median(times)) if len(times) > 1 else math.nan


def nanmean(values: FloatArray) -> float:
    """Return the mean of the finite values, NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else math.nan


def nanquantile(values: FloatArray, share: float) -> float:
    """Return a quantile of the finite values, NaN if there are none."""
    finite = values[np.isfinite(values)]
    return float(np.quantile(finite, share)) if finite.size else math.nan


def not_everywhere(outcomes: Iterable[Outcome]) -> set[str]:
    """Return the labels of methods that were not asked on some of the maps, by their own limits."""
    return {outcome.label for outcome in outcomes if not outcome.is_asked}


def pairs_in_common(outcomes: Iterable[Outcome]) -> set[MapQuery]:
    """Return the pairs that all methods solved; methods without a solved pair are left out, and
    those that were not asked on each of the maps."""
    solved: dict[str, set[MapQuery]] = {}
    given = list(outcomes)
    partly = not_everywhere(given)
    for outcome in given:
        if outcome.label in partly:
            continue
        solved.setdefault(outcome.label, set()).update(outcome.solved_keys)
    of_methods = [pairs for pairs in solved.values() if pairs]
    return set.intersection(*of_methods) if of_methods else set()
