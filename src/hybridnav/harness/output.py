"""Outputs of a run beside its records: tables as CSV and Markdown, and the report."""

import json
import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hybridnav._base.files import replace_file, without_controls
from hybridnav._base.typing import FloatArray, PathLike
from hybridnav.harness import columns, tables
from hybridnav.harness.analysis import Study, load_study, rows_of_map, rows_of_study
from hybridnav.harness.judges import distance_buckets
from hybridnav.harness.names import REFERENCE
from hybridnav.harness.outcome import Outcome, nanmean, nanquantile, pairs_in_common
from hybridnav.harness.records import Record
from hybridnav.harness.report import (
    CaseKey,
    MapSection,
    ReportData,
    cases_of,
    counter_examples,
    render_report,
)
from hybridnav.harness.yardstick import OPTIMA, REFERS_TO, REGIONS, YARDSTICKS, Optimum, Yardstick
from hybridnav.planning import Preset
from hybridnav.refine.ompl import OmplSettings

_EFFICIENCY = "Efficiency"
_BY_DISTANCE = "Mean loss over {} in per cent, by length of the octile optimum (pairs)"


def write_outputs(
    folder: PathLike,
    *,
    title: str = "hybridnav evaluation",
    root: PathLike | None = None,
    metric: Yardstick = "both",
) -> Study:
    """Write `summary.csv`, `maps.csv`, `summary.md` and `report.html` into the folder of a run.

    Parameters
    ----------
    folder
        The run's folder.
    title
        Title of the report.
    root
        Maps below this folder are named by their paths from it; None names them by their files.
    metric
        Reference of losses; see `load_study`.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.harness import write_outputs
    >>> write_outputs(Path("run")).faults  # of the example of `write_records`
    []
    """
    folder = Path(folder)
    study = load_study(folder, root=root, metric=metric)
    overall = rows_of_study(study)
    by_map = {name: rows_of_map(study, name) for name in study.maps}
    replace_file(folder / "summary.csv", tables.to_csv(overall).encode())
    every = [row for rows in by_map.values() for row in rows]
    replace_file(folder / "maps.csv", tables.to_csv(every).encode())
    replace_file(folder / "summary.md", markdown(overall, study).encode())
    report = report_of(study, title, overall, by_map)
    replace_file(folder / "report.html", render_report(report).encode())
    return study


def markdown(overall: Sequence[tables.Row], study: Study) -> str:
    """Return the tables of all maps together, one for consistency, one for the losses over each
    optimum, one for efficiency."""
    checked = study.any_angle_checked
    consistency, *others = _tables(study, overall)
    text = (
        f"## Consistency\n\n{study.checks:,} answers checked, {len(study.faults)} "
        f"counter-examples, {study.failures} queries without an answer."
        f"{f' Checked any-angle: {checked}.' if checked else ''}\n\n"
        f"{tables.markdown_of(consistency.columns, consistency.rows)}\n"
    )
    methods = _methods(study)
    text += f"## Methods\n\n{tables.markdown_of(methods.columns, methods.rows)}\n"
    failures = failures_of(study)
    if failures:
        text += "## Methods without answers\n\n"
    for reason, trace in failures:
        text += f"* {reason}\n\n" + (f"```text\n{trace.rstrip()}\n```\n\n" if trace else "")
    warnings = "".join(f"{warning}\n\n" for warning in study.warnings)
    for table in others:
        # Warnings are about times, so they stand in front of the table that has them.
        text += warnings if table.caption == _EFFICIENCY else ""
        text += f"## {table.caption}\n\n{tables.markdown_of(table.columns, table.rows)}\n"
        text += f"{table.note}\n\n" if table.note else ""
    text += "" if any(table.caption == _EFFICIENCY for table in others) else warnings
    return without_controls(text.rstrip("\n") + "\n")


def report_of(
    study: Study,
    title: str,
    overall: Sequence[tables.Row],
    by_map: dict[str, list[tables.Row]],
    *,
    first: int = 1,
) -> ReportData:
    """Return the contents of the report.

    `overall`, `by_map`: rows of all maps together, and of each map; `first`: number of the first
    section, in a report that has sections of other studies before it. It has a section of all
    maps together only where there are several.
    """
    drawn: dict[CaseKey, str] = {}
    maps = [
        _section(study, name, by_map[name], number, drawn)
        for number, name in enumerate(study.maps, start=first)
    ]
    together = _tables(study, overall) if len(maps) > 1 else []
    methods = _methods(study)
    facts = [
        *_machines(study).items(),
        ("maps", str(len(study.maps))),
        ("methods", ", ".join(study.labels)),
        *([("costs", study.costs)] if study.costs else []),
        ("losses refer to", REFERS_TO[study.metric]),
        ("pairs", _pairs_text(study)),
        *study.circumstances.facts,
        ("queries without an answer", f"{study.failures:,}"),
        *([("checked any-angle", checked)] if (checked := study.any_angle_checked) else []),
    ]
    several = _drawn(study, study.outcomes) if together else {}
    used = dict.fromkeys(
        column
        for table in [methods, *together, *(t for m in maps for t in m.tables)]
        for column in table.columns
    )
    return ReportData(
        title=title,
        facts=facts,
        faults=counter_examples(study, drawn),
        n_faults=len(study.faults),
        checks=study.checks,
        methods=methods,
        overall=together,
        maps=maps,
        failures=failures_of(study),
        warnings=study.warnings,
        definition=columns.DEFINITION,
        meanings=[
            (column, columns.MEANINGS[column]) for column in used if column in columns.MEANINGS
        ],
        overall_losses=several,
        overall_times_ms=_times_ms(study, study.outcomes) if together else {},
    )


def _rows_by_distance(study: Study, name: str, optimum: Optimum) -> list[tables.Row]:
    """Return the mean loss over an optimum in per cent by the length of the octile optimum.

    Each method on a map has a row, over the pairs that all methods solved.
    """
    outcomes = [outcome for outcome in study.of_map(name) if outcome.is_asked]
    common = pairs_in_common(outcomes)
    rows = []
    for outcome in outcomes:
        buckets = distance_buckets(outcome.optima_m)
        losses = np.where(outcome.among(common), outcome.losses_over(optimum), math.nan)
        row: tables.Row = {"method": outcome.label}
        for at, label in enumerate(buckets.labels):
            inside = losses[(buckets.indices == at) & np.isfinite(losses)]
            if len(inside):
                row[f"{label} ({len(inside)})"] = 100 * nanmean(inside)
        if len(row) > 1:
            rows.append(row)
    return rows


def failures_of(study: Study) -> list[tuple[str, str]]:
    """Return for each method and map with queries without an answer the reason of the first, and
    its traceback, empty for none."""
    failures = []
    for outcome in study.outcomes:
        record = outcome.failure
        if record is not None:
            reason = record.get("error", record["status"])
            what = "preparation" if record["type"] == "preparation" else "a query"
            text = (
                f"{outcome.map_name}, {outcome.label}: {outcome.failures:,} queries without an "
                f"answer; {what}: {reason}"
            )
            failures.append((text, str(record.get("traceback", ""))))
    return failures


def _pairs_text(study: Study) -> str:
    """Return the number of pairs, and how many of them all methods solved."""
    asked = sum(len(outcome.references) for outcome in study.of_method(REFERENCE))
    text = f"{asked:,} of joined cells; all methods solved {len(study.common):,} of them"
    shares = {
        label: sum(len(outcome.solved_keys) for outcome in study.of_method(label))
        for label in study.labels
    }
    fewest = min((label for label in shares if shares[label]), key=shares.__getitem__, default="")
    if fewest and shares[fewest] < asked:
        text += f"; the fewest, {shares[fewest]:,}, {fewest}"
    return text


def _machines(study: Study) -> dict[str, str]:
    """Return versions and host of the runs, as recorded; several if they differ."""
    machines: dict[str, dict[str, None]] = {}
    for outcome in study.outcomes:
        for key, value in outcome.preparation.get("environment", {}).items():
            machines.setdefault(key, {})[value] = None
    return {key: ", ".join(values) for key, values in machines.items()}


def _methods(study: Study) -> tables.Table:
    return tables.table_of(rows_of_methods(study), tables.METHOD_COLUMNS, "Versions and settings")


def _tables(study: Study, rows: Sequence[tables.Row]) -> list[tables.Table]:
    """Return the tables of Thrun's three criteria: one of losses over each optimum."""
    presets = study.presets
    parts = [tables.table_of(rows, columns.CONSISTENCY_COLUMNS, "Consistency")]
    for optimum in YARDSTICKS[study.metric]:
        chosen = columns.loss_columns(optimum)
        with_loss = [row for row in rows if _has_loss(row, optimum)]
        if with_loss:
            note = tables.ahead_of_presets(with_loss, chosen, presets)
            parts.append(tables.table_of(with_loss, chosen, f"Loss over {OPTIMA[optimum]}", note))
    timed = any(tables.with_values(rows, column) for column in columns.EFFICIENCY_COLUMNS)
    if timed:
        note = tables.ahead_of_presets(rows, columns.EFFICIENCY_COLUMNS, presets)
        parts.append(tables.table_of(rows, columns.EFFICIENCY_COLUMNS, _EFFICIENCY, note))
    return parts


def _has_loss(row: tables.Row, optimum: Optimum) -> bool:
    """Return whether a method has losses over an optimum: of its paths, or of its plans alone,
    which are compared with paths of cells."""
    of_plans = row["metric"] == REGIONS and optimum != "any-angle"
    column = "loss of the plan %" if of_plans else f"{optimum} loss mean %"
    return bool(tables.with_values([row], column))


def _section(
    study: Study, name: str, rows: list[tables.Row], number: int, drawn: dict[CaseKey, str]
) -> MapSection:
    """Return the section of a map; the anchors of its pictures are added to `drawn`."""
    outcomes = study.of_map(name)
    first = outcomes[0].preparation
    shape = first.get("shape", [0, 0])
    parts = _tables(study, rows)
    for optimum in YARDSTICKS[study.metric]:
        distance = _rows_by_distance(study, name, optimum)
        chosen = [key for row in distance for key in row if key != "method"]
        if chosen:
            caption = _BY_DISTANCE.format(OPTIMA[optimum])
            parts.append(tables.table_of(distance, list(dict.fromkeys(chosen)), caption))
    cases = [case for outcome in outcomes for case in cases_of(outcome)]
    for at, (key, _) in enumerate(cases, start=1):
        drawn.setdefault(key, f"case-{number}-{at}")
    return MapSection(
        name=name,
        facts=[
            ("size", f"{shape[0]} x {shape[1]} cells of {first.get('resolution_m', 0):g} m"),
            ("free cells", f"{first.get('free_cells', 0):,}"),
            ("robot radius", f"{first.get('robot_radius_m', 0):g} m"),
            ("SHA-256", str(first["map_sha"])[:16]),
        ],
        tables=parts,
        losses=_drawn(study, outcomes),
        times_ms=_times_ms(study, outcomes),
        worst=[case for _, case in cases],
    )


def _times_ms(study: Study, outcomes: Iterable[Outcome]) -> dict[str, float]:
    """Return the median time of each method over the pairs that all methods solved."""
    parts: dict[str, list[FloatArray]] = {}
    for outcome in outcomes:
        of_method = parts.setdefault(outcome.label, [])
        of_method.append(outcome.seconds[outcome.among(study.common)])
    return {label: 1e3 * nanquantile(np.concatenate(times), 0.5) for label, times in parts.items()}


def _drawn(study: Study, outcomes: Iterable[Outcome]) -> dict[str, dict[str, FloatArray]]:
    """Return the losses over each optimum by its name, per method, over the pairs that all methods
    solved: those of the tables. A method without paths has none, and the reference alone, whose
    octile losses are 0, no chart beside another one."""
    asked = [outcome for outcome in outcomes if outcome.is_asked and not outcome.has_plans_alone]
    drawn: dict[str, dict[str, FloatArray]] = {}
    for optimum in YARDSTICKS[study.metric]:
        parts: dict[str, list[FloatArray]] = {}
        for outcome in asked:
            if optimum != "octile" or not outcome.is_any_angle:
                losses = outcome.losses_over(optimum)[outcome.among(study.common)]
                parts.setdefault(outcome.label, []).append(losses)
        joined = {label: np.concatenate(losses) for label, losses in parts.items()}
        is_known = any(np.isfinite(losses).any() for losses in joined.values())
        if is_known and not (drawn and joined.keys() == {REFERENCE}):
            drawn[OPTIMA[optimum]] = joined
    return drawn


# The methods of a run in a table.


def rows_of_methods(study: Study) -> list[tables.Row]:
    """Return one row for each method of a study."""
    rows: list[tables.Row] = []
    for label in study.labels:
        outcomes = study.of_method(label)
        # A method that could not be made on a map has no version there.
        best = max((o.preparation for o in outcomes), key=len)
        rows.append(
            {
                "method": label,
                "kind": _kind(best),
                "version": _version(best),
                "settings": _settings(best),
                "not asked": _not_asked(outcomes, len(study.maps)),
            }
        )
    return rows


def _kind(record: Record) -> str:
    made_by = str(record.get("made_by", record["method"]))
    if "graph" in record:
        return f"graph, {record['graph']['format']}"
    kind = "class"
    if record.get("preset") is not None:
        kind, made_by = "preset", str(record["preset"].get("name", made_by))
    elif ":" not in made_by:
        # Earlier versions had names for planners of others, and noted the versions of these.
        kind = "planner of others" if "version" in record else "baseline"
    # A class is shown by the name that it gives itself.
    is_named = made_by != record["method"] or kind == "class"
    return f"{kind} {made_by}" if is_named else kind


def _version(record: Record) -> str:
    if record.get("version"):
        return str(record["version"])
    if "source" in record:
        return f"file {record['source']}"
    own = record.get("environment", {}).get("hybridnav", "")
    return f"hybridnav {own}" if own and "graph" not in record else ""


def _settings(record: Record) -> str:
    given = record.get("settings") or {}
    if record.get("preset") is not None:
        given = _unlike(record["preset"].get("planner", {}), _DEFAULTS["planner"])
    return record.get("settings_text") or _words(given)


_DEFAULTS = Preset().model_dump()
_OF_OMPL = OmplSettings().model_dump() | {"planner": None}


def _words(settings: dict[str, Any]) -> str:
    texts = {
        key: value if isinstance(value, str) else json.dumps(value)
        for key, value in settings.items()
    }
    return ", ".join(f"{key} {text}" for key, text in texts.items())


def _unlike(own: dict[str, Any], usual: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Return the settings that differ from the usual ones, by dotted key."""
    differing: dict[str, Any] = {}
    for key, value in own.items():
        other = usual.get(key)
        if isinstance(value, dict):
            inner = other if isinstance(other, dict) else (_OF_OMPL if key == "ompl" else {})
            differing |= _unlike(value, inner, f"{prefix}{key}.")
        elif value != other and value is not None:
            differing[f"{prefix}{key}"] = value
    return differing


def _not_asked(outcomes: Sequence[Outcome], n_maps: int) -> str:
    """Return the maps on which a method was not asked, and the reason on the first."""
    without = [outcome for outcome in outcomes if not outcome.is_asked]
    if not without:
        return ""
    reason = str(without[0].preparation.get("error", ""))
    where = "" if n_maps == 1 else f"on {len(without)} of {n_maps} maps: "
    return where + reason
