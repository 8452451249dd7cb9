"""From records to figures: losses, times, counts, faults, for every map and method."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.harness.contradictions import (
    ANSWERED,
    ANY_ANGLE_SLACK,
    SLACK,
    contradiction,
    is_any_angle,
)
from hybridnav.harness.methods import BASELINES, REFERENCE
from hybridnav.harness.paths import path_steps
from hybridnav.harness.records import read_records
from hybridnav.harness.yardstick import check_yardstick
from hybridnav.metrics import thrun_count

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._typing import BoolArray, FloatArray
    from hybridnav.harness.records import Record
    from hybridnav.harness.yardstick import Yardstick

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

    @cached_property
    def _matched(self) -> list[Record | None]:
        own = {query_key(record): record for record in self.records}
        return [own.get(query_key(record)) for record in self.references]

    @cached_property
    def references(self) -> list[Record]:
        """The reference's records of the pairs in the arrays."""
        asked = {query_key(record) for record in self.records}
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
        """Metric of the method's paths: "octile" or "any-angle"."""
        return (
            "any-angle" if any(map(is_any_angle, (self.preparation, *self.records))) else "octile"
        )

    @cached_property
    def optima_m(self) -> FloatArray:
        """Lengths of the optimum on the grid."""
        return np.array([record["length_m"] for record in self.references], dtype=float)

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
        """Reference lengths of the losses."""
        if self.yardstick == "octile":
            return self._octile_optima_m
        if self.yardstick == "any-angle":
            return self.any_angle_optima_m
        lines = np.isnan(self._octile_optima_m)
        return np.where(lines, self.any_angle_optima_m, self.optima_m)

    @cached_property
    def losses(self) -> FloatArray:
        """Lengths over their reference lengths, minus one."""
        return loss_of(self.lengths_m, self.best_m)

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

    def among(self, pairs: set[MapQuery]) -> BoolArray:
        """Return whether each pair is one of some."""
        mine = [(self.map_name, query_key(record)) in pairs for record in self.references]
        return np.array(mine, dtype=np.bool_)

    @cached_property
    def lengths_m(self) -> FloatArray:
        """Lengths of the method's own paths without faults."""
        return np.where(self._by_grid, math.nan, self._sound_m)

    @cached_property
    def fallback_losses(self) -> FloatArray:
        """Loss of the grid's paths that stand in for the method's own."""
        return loss_of(np.where(self._by_grid, self._sound_m, math.nan), self.best_m)

    @cached_property
    def by_grid(self) -> float:
        """Number of paths that are the grid's, because the method found none; NaN for a method
        without such a fallback."""
        counted = [(record or {}).get("by_grid") for record in self._matched]
        return math.nan if all(one is None for one in counted) else float(self._by_grid.sum())

    @cached_property
    def _by_grid(self) -> BoolArray:
        return np.nan_to_num(self.figure("by_grid")) > 0

    @cached_property
    def _sound_m(self) -> FloatArray:
        faulty = [bool(record and record.get("faults")) for record in self._matched]
        return np.where(faulty, math.nan, self.figure("length_m"))

    @cached_property
    def plan_losses(self) -> FloatArray:
        """Thrun's loss of the plan: the best grid path inside its regions, over the optimum."""
        return loss_of(self.figure("plan_optimum_m"), self.optima_m)

    @cached_property
    def seconds(self) -> FloatArray:
        """Wall-clock seconds of each query that the method solved without a fault."""
        return np.where(np.isfinite(self.lengths_m), self.figure("seconds"), math.nan)

    @cached_property
    def first_seconds(self) -> FloatArray:
        """Seconds until the first path of these queries, for planners that improve their path."""
        return np.where(np.isfinite(self.lengths_m), self._stage("first path"), math.nan)

    @cached_property
    def reference_seconds(self) -> FloatArray:
        """Wall-clock seconds of the reference on the same pairs."""
        return np.array([record["seconds"] for record in self.references], dtype=float)

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
        layer, cells times mean steps of a path."""
        steps = self.figure("plan_steps")
        if not np.isfinite(steps).any():
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
    def failures(self) -> int:
        """Queries without an answer: errors, time-outs, lost workers."""
        return sum(record["status"] not in ANSWERED for record in self.records)


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


def pairs_in_common(outcomes: Iterable[Outcome]) -> set[MapQuery]:
    """Return the pairs that all methods solved; methods without a solved pair are left out."""
    solved: dict[str, set[MapQuery]] = {}
    for outcome in outcomes:
        solved.setdefault(outcome.label, set()).update(outcome.solved_keys)
    known = [pairs for pairs in solved.values() if pairs]
    return set.intersection(*known) if known else set()


@dataclass
class Study:
    """The outcomes of a run, maps in the order of the records, the reference first on each."""

    outcomes: list[Outcome]
    metric: Yardstick = "both"
    """What losses refer to."""

    @property
    def maps(self) -> list[str]:
        """Labels of the maps."""
        return list(dict.fromkeys(outcome.map_name for outcome in self.outcomes))

    @property
    def labels(self) -> list[str]:
        """Labels of the methods."""
        return list(dict.fromkeys(outcome.label for outcome in self.outcomes))

    def of_map(self, name: str) -> list[Outcome]:
        """Return the outcomes on one map."""
        return [outcome for outcome in self.outcomes if outcome.map_name == name]

    def of_method(self, label: str) -> list[Outcome]:
        """Return the outcomes of one method."""
        return [outcome for outcome in self.outcomes if outcome.label == label]

    @property
    def checks(self) -> int:
        """Number of judged answers."""
        return sum(outcome.checks for outcome in self.outcomes)

    @property
    def failures(self) -> int:
        """Queries without an answer."""
        return sum(outcome.failures for outcome in self.outcomes)

    def pooled(self, label: str, name: str) -> FloatArray:
        """Return an array of a method, such as "losses" or "seconds", over all its maps."""
        arrays = [getattr(outcome, name) for outcome in self.of_method(label)]
        return np.concatenate(arrays) if arrays else np.empty(0)

    @property
    def faults(self) -> list[tuple[Outcome, Record, str]]:
        """Every contradiction found."""
        return [(outcome, *fault) for outcome in self.outcomes for fault in outcome.faults]


def load_study(folder: Path, *, root: Path | None = None, metric: Yardstick = "both") -> Study:
    """Read the records of a run.

    Parameters
    ----------
    folder
        The run's folder.
    root
        Maps below this folder are named by their paths from it; None names them by their files.
    metric
        Reference of losses: "any-angle", for all paths the any-angle optimum; "octile", the octile
        optimum, without losses for any-angle paths; "both", the optimum in each path's own metric.

    Returns
    -------
    Study
        Its outcomes in the order of the records.

    Raises
    ------
    InvalidValueError
        When a line is no record, or there is no such metric.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.harness import load_study
    >>> load_study(Path("run")).labels  # of the example of `evaluate`
    ['grid-astar', 'octile']
    """
    check_yardstick(metric)
    preparations: dict[tuple[str, str], Record] = {}
    pairs: dict[tuple[str, str], list[Record]] = {}
    for record in read_records(folder):
        key = record["map_sha"], record["method_sha"]
        if record["type"] == "preparation":
            preparations[key] = record
        else:
            pairs.setdefault(key, []).append(record)
    names = _map_labels(preparations, root)
    digests: dict[str, set[tuple[str, str]]] = {}
    for record in preparations.values():
        settings = record["method_sha"], names[record["map_sha"]]
        digests.setdefault(f"{record['method']}@{settings[1]}", set()).add(settings)
    optima = {
        sha: {query_key(record): record for record in pairs.get((sha, method), ())}
        for (sha, method), record in preparations.items()
        if record["method"] == REFERENCE
    }
    outcomes = []
    for (sha, method), record in preparations.items():
        name = names[sha]
        several = len(digests[f"{record['method']}@{name}"]) > 1
        label = f"{record['method']} {method[:4]}" if several else record["method"]
        own = pairs.get((sha, method), [])
        outcomes.append(Outcome(name, label, record, own, optima.get(sha, {}), metric))
    order = {name: at for at, name in enumerate(dict.fromkeys(names.values()))}
    place = {name: at for at, name in enumerate(BASELINES)}
    outcomes.sort(
        key=lambda outcome: (
            order[outcome.map_name],
            outcome.metric != "octile",
            place.get(outcome.preparation["method"], len(place)),
            outcome.label,
        )
    )
    return Study(outcomes, metric)


def _map_labels(preparations: dict[tuple[str, str], Record], root: Path | None) -> dict[str, str]:
    """Return the name of each map, with a part of its hash if two maps share a name."""
    named = {sha: _map_label(record, root) for (sha, _), record in preparations.items()}
    for (sha, _), record in preparations.items():
        if record["status"] == "ready":  # a lost worker leaves only the file's name
            named[sha] = _map_label(record, root)
    taken: dict[str, list[str]] = {}
    for sha, name in named.items():
        taken.setdefault(name, []).append(sha)
    return {
        sha: name if len(taken[name]) == 1 else f"{name} {sha[:6]}" for sha, name in named.items()
    }


def _map_label(record: Record, root: Path | None) -> str:
    file = Path(record.get("file", ""))
    if root is None or not file.is_relative_to(root.resolve()):
        return str(record["map"])
    return file.relative_to(root.resolve()).with_suffix("").as_posix()
