"""From records to figures: the outcomes of all methods on all maps. Public: `Study`, `load_study`
and `to_frame`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.extension import in_html
from hybridnav._base.typing import FloatArray, PathLike
from hybridnav.errors import InvalidValueError
from hybridnav.harness.columns import EFFICIENCY_COLUMNS, figures
from hybridnav.harness.names import BASELINES, REFERENCE
from hybridnav.harness.outcome import MapQuery, Outcome, not_everywhere, pairs_in_common
from hybridnav.harness.records import (
    Record,
    commands_of,
    latest_sources,
    loads_of,
    query_key,
    read_records,
    who_of,
)
from hybridnav.harness.tables import Row, Table, latex_of, table_of
from hybridnav.harness.timing import Circumstances, circumstances_of, lay_times
from hybridnav.harness.yardstick import OPTIMA, YARDSTICKS, Yardstick, check_yardstick

if TYPE_CHECKING:
    import pandas as pd


@dataclass
class Study:
    """The outcomes of a run, maps in the order of the records, the reference first on each."""

    outcomes: list[Outcome]
    metric: Yardstick = "both"
    """What losses refer to."""
    circumstances: Circumstances = field(default_factory=Circumstances)
    """Those of its times."""
    left_out: list[str] = field(default_factory=list)
    """Answers that no table shows, in words: of classes before they were mended."""

    @property
    def warnings(self) -> list[str]:
        """What to know of the tables: answers left out, and what speaks against the times."""
        return [*self.left_out, *self.circumstances.warnings]

    @property
    def costs(self) -> str:
        """Costs of the run as a text, empty for lengths."""
        return self.outcomes[0].costs if self.outcomes else ""

    @cached_property
    def common(self) -> set[MapQuery]:
        """The pairs that all methods solved, on all maps."""
        return pairs_in_common(self.outcomes)

    @cached_property
    def losses(self) -> dict[str, FloatArray]:
        """Losses of each method over the pairs in common, for `viz.plot_losses`: over the any-angle
        optimum, or that of `metric`. A method without paths has none."""
        optimum = YARDSTICKS[self.metric][0]
        parts: dict[str, list[FloatArray]] = {}
        for outcome in self.outcomes:
            if outcome.is_asked and not outcome.has_plans_alone:
                own = outcome.losses_over(optimum)[outcome.among(self.common)]
                parts.setdefault(outcome.label, []).append(own)
        joined = {label: np.concatenate(losses) for label, losses in parts.items()}
        return {label: losses for label, losses in joined.items() if np.isfinite(losses).any()}

    @cached_property
    def table(self) -> Table:
        """A row for each method: what it solved, its losses, its times, and its contradictions."""
        optimum = YARDSTICKS[self.metric][0]
        losses = (f"{optimum} loss mean %", f"{optimum} loss max %")
        columns = ("metric", "solved %", *losses, "query ms, median", "preparation s", "faults")
        caption = f"{len(self.common):,} pairs that all solved; loss over {OPTIMA[optimum]}"
        return table_of(rows_of_study(self), columns, caption)

    def __str__(self) -> str:
        """Return the table, and how many pairs it is about."""
        return str(self.table)

    def _repr_html_(self) -> str | None:
        """Return the losses as a picture and the table for a notebook, if pictures are there."""
        return in_html(self)

    def to_latex(self) -> str:
        """Return the table for LaTeX, with the rules of the package booktabs."""
        return latex_of(self.table)

    @property
    def maps(self) -> list[str]:
        """Labels of the maps."""
        return list(dict.fromkeys(outcome.map_name for outcome in self.outcomes))

    @property
    def labels(self) -> list[str]:
        """Labels of the methods."""
        return list(dict.fromkeys(outcome.label for outcome in self.outcomes))

    @property
    def presets(self) -> set[str]:
        """Labels of the methods that are presets."""
        return {o.label for o in self.outcomes if o.preparation.get("preset") is not None}

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

    @property
    def any_angle_checked(self) -> str:
        """How many of the any-angle optima an independent search confirmed, "3 of 16"; empty if
        there are none."""
        records = [r for outcome in self.of_method(REFERENCE) for r in outcome.records]
        measured = [record for record in records if "any_angle_m" in record]
        checked = sum("visibility_optimum_m" in record for record in measured)
        return f"{checked:,} of {len(measured):,}" if measured else ""

    @property
    def faults(self) -> list[tuple[Outcome, Record, str]]:
        """Every contradiction found."""
        return [(outcome, *fault) for outcome in self.outcomes for fault in outcome.faults]


def load_study(
    folder: PathLike, *, root: PathLike | None = None, metric: Yardstick = "both"
) -> Study:
    """Read the records of a run.

    Parameters
    ----------
    folder
        The run's folder.
    root
        Maps below this folder are named by their paths from it; None names them by their files.
    metric
        Reference of losses. "any-angle" is the any-angle optimum for all paths, "octile" the octile
        optimum, without losses for any-angle paths. "weighted", in a run with costs, is the least
        cost of paths of cells. "both" is "weighted" in a run with costs, else the optimum in each
        path's own metric.

    Raises
    ------
    InvalidValueError
        When a line is no record, runs differ in their costs, or there is no such metric.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.harness import load_study
    >>> load_study(Path("run")).labels  # of the example of `write_records`
    ['grid-astar', 'octile']
    """
    check_yardstick(metric)
    folder, root = Path(folder), None if root is None else Path(root)
    preparations: dict[tuple[str, str], Record] = {}
    pairs: dict[tuple[str, str], list[Record]] = {}
    timed: list[Record] = []
    for record in read_records(folder):
        key = record["map_sha"], record["method_sha"]
        if record["type"] in {"timing", "timed pair"}:
            timed.append(record)
        elif record["type"] == "preparation":
            preparations[key] = record
        else:
            pairs.setdefault(key, []).append(record)
    every, preparations = preparations, _latest(preparations, folder)
    together = lay_times(timed, pairs)
    metric = _metric_of(preparations, metric, folder)
    names = _map_labels(every, root)
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
        name, label = names[sha], record["method"]
        if len(digests[f"{label}@{name}"]) > 1:
            label = f"{label} {method[:4]}"
        answers = pairs.get((sha, method), [])
        outcomes.append(Outcome(name, label, record, answers, optima.get(sha, {}), metric))
    order = {name: at for at, name in enumerate(dict.fromkeys(names.values()))}
    place = {name: at for at, name in enumerate(BASELINES)}
    outcomes.sort(
        key=lambda outcome: (
            order[outcome.map_name],
            outcome.is_any_angle,
            place.get(outcome.preparation["method"], len(place)),
            outcome.label,
        )
    )
    about = circumstances_of(timed, outcomes, together, commands_of(folder), loads_of(folder))
    return Study(outcomes, metric, about, _left_out(every, preparations, pairs, names))


def to_frame(study: Study) -> pd.DataFrame:
    """Return a study as a table with a row for each map, method and pair.

    Parameters
    ----------
    study
        The study.

    Returns
    -------
    pandas.DataFrame
        Columns `map`, `method`, `metric`, `kind`, `start_row`, `start_col`, `goal_row`, `goal_col`,
        `status` of the record, and `faults`, the number of its contradictions. `length_m` is NaN
        where the method found no path without a fault itself; it and what follows is NaN for equal
        cells, and where the reference found no path. `octile_optimum_m` and `any_angle_optimum_m`
        follow, and as shares `octile_loss` and `any_angle_loss` over them. `plan_loss` and
        `in_order_loss` are Thrun's losses of the plan, `plan_steps` its steps, and `backups` his
        count: nodes times steps, of cells for a method without plans. Then `seconds` of the query
        and `reference_seconds` of A* on the whole grid, and `expanded` cells, intervals and nodes
        together. A run with costs also has `costs`, their text, `cost_m`, `weighted_optimum_m` and
        `cost_lower_bound_m`. Any-angle paths with a bound on paths of cells have
        `cost_grid_bound_m`. `weighted_loss`, `gap` and `grid_gap` are shares.

    Raises
    ------
    InvalidValueError
        When pandas is not installed.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.harness import load_study, to_frame
    >>> frame = to_frame(load_study(Path("run")))  # of the example of `write_records`
    >>> frame.groupby("method")["octile_loss"].max().to_dict()
    {'grid-astar': 0.0, 'octile': 0.0}
    """
    try:
        import pandas as pd  # noqa: PLC0415 - an optional extra
    except ImportError as error:
        raise InvalidValueError(
            "a data frame needs pandas: pip install 'hybridnav[study]'"
        ) from error
    parts = [pd.DataFrame(_columns(outcome)) for outcome in study.outcomes if outcome.records]
    return pd.concat(parts, ignore_index=True) if parts else pd.DataFrame()


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


def _columns(outcome: Outcome) -> dict[str, object]:
    """Return the columns of a data frame; those of numbers are NaN where an outcome has none."""
    pairs, frame = outcome.records, outcome.frame
    ends = {
        f"{end}_{axis}": [record[end][at] for record in pairs]
        for end in ("start", "goal")
        for at, axis in enumerate(("row", "col"))
    }
    figures = {
        "length_m": frame["lengths_m"],
        "octile_optimum_m": frame["optima_m"],
        "any_angle_optimum_m": frame["any_angle_optima_m"],
        "octile_loss": frame["octile_losses"],
        "any_angle_loss": frame["any_angle_losses"],
        "plan_loss": frame["plan_losses"],
        "in_order_loss": frame["in_order_losses"],
        "plan_steps": frame["plan_steps"],
        "backups": frame["backups"],
        "seconds": frame["seconds"],
        "reference_seconds": frame["reference_seconds"],
        "expanded": frame["expansions"],
    }
    if outcome.costs:
        figures |= {
            "cost_m": frame["costs_m"],
            "weighted_optimum_m": frame["weighted_optima_m"],
            "cost_lower_bound_m": outcome.figure("cost_lower_bound_m"),
            "cost_grid_bound_m": outcome.figure("cost_grid_bound_m"),
            "weighted_loss": frame["weighted_losses"],
            "gap": frame["gaps"],
            "grid_gap": frame["grid_gaps"],
        }
    places = {query_key(record): at for at, record in enumerate(outcome.references)}
    at = [places.get(query_key(record), -1) for record in pairs]
    return {
        "map": outcome.map_name,
        "method": outcome.label,
        "metric": outcome.metric,
        "kind": [record["kind"] for record in pairs],
        **ends,
        "status": [record["status"] for record in pairs],
        "faults": [len(record["faults"]) for record in pairs],
        **{name: np.append(values, np.nan)[at] for name, values in figures.items()},
        **({"costs": outcome.costs} if outcome.costs else {}),
    }


def _latest(
    preparations: dict[tuple[str, str], Record], folder: Path
) -> dict[tuple[str, str], Record]:
    """Return the preparations without those of a class before it was mended, on any map.

    Its last version is the one of the last run, else the one whose records came last.
    """
    sources = latest_sources(folder)
    shown: dict[str, str | None] = {}
    for record in preparations.values():
        who, names = who_of(record), (record["method"], record.get("made_by"))
        latest = next((sources[name] for name in names if name in sources), None)
        if who not in shown or shown[who] != latest:
            shown[who] = record.get("source")
    return {
        key: record
        for key, record in preparations.items()
        if record.get("source") == shown[who_of(record)]
    }


def _left_out(
    preparations: dict[tuple[str, str], Record],
    shown: dict[tuple[str, str], Record],
    pairs: dict[tuple[str, str], list[Record]],
    names: dict[str, str],
) -> list[str]:
    """Return in words the answers that no table shows, a sentence for each method."""
    current = {(who_of(record), sha) for (sha, _), record in shown.items()}
    counts_of: dict[str, list[str]] = {}
    for key, record in preparations.items():
        if key not in shown:
            method, sha = record["method"], key[0]
            made_by = record.get("made_by", method)
            made_of = made_by if made_by == method else f"{made_by} ({method})"
            again = "asked again" if (who_of(record), sha) in current else "not asked again"
            count = f"{len(pairs.get(key, ())):,} on {names[sha]} ({again})"
            counts_of.setdefault(made_of, []).append(count)
    return [
        f"Left out, because class {made_of} was changed after them: answers {', '.join(counts)}."
        for made_of, counts in counts_of.items()
    ]


def _metric_of(
    preparations: dict[tuple[str, str], Record], metric: Yardstick, folder: Path
) -> Yardstick:
    """Return the yardstick for the runs in a folder, which all have the same costs.

    Raises `InvalidValueError` when they have not, or there are no costs to refer to.
    """
    costs = {str(record.get("costs", "")) for record in preparations.values()}
    if len(costs) > 1:
        texts = ", ".join(repr(text) for text in sorted(costs))
        raise InvalidValueError(
            f"run {folder} has records with different costs, {texts}: take a folder for each"
        )
    if metric == "weighted" and costs == {""}:
        raise InvalidValueError(
            f"run {folder} has no costs to refer to: run it with costs, or take another metric"
        )
    return "weighted" if metric == "both" and costs - {""} else metric


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
