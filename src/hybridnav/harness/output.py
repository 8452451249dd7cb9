"""Outputs of a run beside its records: tables, the report, pictures of counter-examples."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav._files import replace_file
from hybridnav.errors import MapError
from hybridnav.grid import MAX_CELLS
from hybridnav.harness.analysis import Study, load_study
from hybridnav.harness.methods import REFERENCE
from hybridnav.harness.outcome import Outcome, nanquantile, query_key
from hybridnav.harness.paths import decode_path
from hybridnav.harness.records import map_digest
from hybridnav.harness.report import MapSection, ReportData, Table, WorstCase, render_report
from hybridnav.harness.rows import (
    EFFICIENCY_COLUMNS,
    loss_columns,
    rows_by_distance,
    rows_of_map,
    rows_of_study,
)
from hybridnav.harness.scenes import MapSpec, read_map
from hybridnav.harness.tables import Row, text_of, to_csv, to_markdown
from hybridnav.metrics import chords_of

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from hybridnav._typing import FloatArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.harness.records import Record
    from hybridnav.harness.yardstick import Yardstick

MAX_FAULTS_SHOWN = 50
WORST_CASES = 2

_WORDS = ("method", "map", "metric")
"""Columns that hold no numbers."""

REFERS_TO: dict[Yardstick, str] = {
    "both": "the optimum in the metric of each path",
    "any-angle": "the any-angle optimum, for all paths",
    "octile": "the octile optimum; any-angle paths have none",
    "weighted": "the least cost of paths of cells, for the costs of all paths",
}
"""What losses refer to, in words."""


def write_outputs(
    folder: Path,
    *,
    title: str = "hybridnav evaluation",
    root: Path | None = None,
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

    Returns
    -------
    Study
        The results; `faults` lists every counter-example.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.harness import write_outputs
    >>> write_outputs(Path("run")).faults  # of the example of `evaluate`
    []
    """
    study = load_study(folder, root=root, metric=metric)
    overall = rows_of_study(study)
    by_map = {name: rows_of_map(study, name) for name in study.maps}
    replace_file(folder / "summary.csv", to_csv(overall).encode())
    every = [row for rows in by_map.values() for row in rows]
    replace_file(folder / "maps.csv", to_csv(every).encode())
    replace_file(folder / "summary.md", markdown(overall, study).encode())
    report = _report(study, title, overall, by_map)
    replace_file(folder / "report.html", render_report(report).encode())
    return study


def markdown(overall: Sequence[Row], study: Study) -> str:
    """Return the tables of all maps together, one for each of Thrun's criteria."""
    found = len(study.faults)
    return (
        f"## Consistency\n\n{study.checks:,} answers checked, {found} counter-examples, "
        f"{study.failures} queries without an answer.\n\n"
        f"## Loss\n\n{to_markdown(overall, ('method', 'maps', *loss_columns(study.metric)))}\n"
        f"## Efficiency\n\n{to_markdown(overall, ('method', *EFFICIENCY_COLUMNS))}"
    )


def _report(
    study: Study, title: str, overall: Sequence[Row], by_map: dict[str, list[Row]]
) -> ReportData:
    faults = [
        f"{outcome.map_name}, {outcome.label}, {_pair_text(record)}: {fault}"
        for outcome, record, fault in study.faults
    ]
    hidden = len(faults) - MAX_FAULTS_SHOWN
    if hidden > 0:
        faults = [*faults[:MAX_FAULTS_SHOWN], f"and {hidden} more, see records.jsonl"]
    drawn = dict.fromkeys(outcome.label for outcome in _drawn(study, study.outcomes))
    facts = [
        *_machines(study).items(),
        ("maps", str(len(study.maps))),
        ("methods", ", ".join(study.labels)),
        *([("costs", study.costs)] if study.costs else []),
        ("losses refer to", REFERS_TO[study.metric]),
        ("queries without an answer", f"{study.failures:,}"),
    ]
    return ReportData(
        title=title,
        facts=facts,
        faults=faults,
        checks=study.checks,
        criteria=_table(
            overall,
            ("method", "maps", *loss_columns(study.metric), *EFFICIENCY_COLUMNS),
            "All maps together",
        ),
        maps=[_section(study, name, by_map[name]) for name in study.maps],
        overall_losses={label: study.pooled(label, "losses") for label in drawn},
        overall_times_ms={
            label: 1e3 * nanquantile(study.pooled(label, "seconds"), 0.5) for label in drawn
        },
        metric_of={
            outcome.label: outcome.metric for outcome in study.outcomes if study.metric == "both"
        },
    )


def _machines(study: Study) -> dict[str, str]:
    """Return versions and host of the runs, as recorded; several if they differ."""
    found: dict[str, dict[str, None]] = {}
    for outcome in study.outcomes:
        for key, value in outcome.preparation.get("environment", {}).items():
            found.setdefault(key, {})[value] = None
    return {key: ", ".join(values) for key, values in found.items()}


def _pair_text(record: Record) -> str:
    if record["type"] != "pair":
        return "all pairs"
    return f"{tuple(record['start'])} to {tuple(record['goal'])}"


def _table(rows: Sequence[Row], columns: Sequence[str], caption: str) -> Table:
    kept = [column for column in columns if any(column in row for row in rows)]
    numeric = frozenset(at for at, column in enumerate(kept) if column not in _WORDS)
    return Table(
        columns=kept,
        rows=[[text_of(row.get(column, "")) for column in kept] for row in rows],
        caption=caption,
        numeric=numeric,
    )


def _section(study: Study, name: str, rows: list[Row]) -> MapSection:
    outcomes = study.of_map(name)
    drawn = _drawn(study, outcomes)
    first = outcomes[0].preparation
    shape = first.get("shape", [0, 0])
    distance = rows_by_distance(study, name)
    columns = list(dict.fromkeys(key for row in distance for key in row))
    return MapSection(
        name=name,
        facts=[
            ("size", f"{shape[0]} x {shape[1]} cells of {first.get('resolution_m', 0):g} m"),
            ("free cells", f"{first.get('free_cells', 0):,}"),
            ("robot radius", f"{first.get('robot_radius_m', 0):g} m"),
            ("SHA-256", str(first["map_sha"])[:16]),
        ],
        tables=[
            _table(rows, ("method", *loss_columns(study.metric)), "Loss"),
            _table(rows, ("method", *EFFICIENCY_COLUMNS), "Efficiency"),
            _table(distance, columns, "Mean loss in per cent by length of the optimum (pairs)"),
        ],
        losses={outcome.label: outcome.losses for outcome in drawn},
        times_ms={outcome.label: 1e3 * nanquantile(outcome.seconds, 0.5) for outcome in drawn},
        worst=[case for outcome in outcomes for case in _worst(outcome)],
    )


def _drawn(study: Study, outcomes: Sequence[Outcome]) -> Sequence[Outcome]:
    """Return the methods for charts, each with those that its losses are compared with."""
    if study.metric == "octile":
        return [outcome for outcome in outcomes if not outcome.is_any_angle]
    others = [outcome for outcome in outcomes if outcome.label != REFERENCE]
    if study.metric == "both" and all(outcome.metric == "any-angle" for outcome in others):
        return others or outcomes
    return outcomes


def _worst(outcome: Outcome) -> list[WorstCase]:
    """Return counter-examples, and the pairs with the largest losses: two of presets, one of
    others."""
    cases = [_case(outcome, record, fault) for record, fault in outcome.faults[:WORST_CASES]]
    if outcome.label != REFERENCE:
        shown = WORST_CASES if outcome.preparation.get("preset") is not None else 1
        own = {query_key(record): record for record in outcome.records}
        how = "dear" if outcome.yardstick == "weighted" else "long"
        order = np.argsort(-np.nan_to_num(outcome.losses, nan=0.0), kind="stable")[:shown]
        for at in order[outcome.losses[order] > 0]:
            reference = outcome.references[at]
            record = own[query_key(reference)]
            cases.append(_case(outcome, record, f"{100 * outcome.losses[at]:.1f} % too {how}"))
    return [case for case in cases if case is not None]


def _case(outcome: Outcome, record: Record, text: str) -> WorstCase | None:
    from hybridnav.harness.figures import paths_uri  # noqa: PLC0415 - loads matplotlib

    about = outcome.preparation
    if "file" not in about:
        return None
    try:
        # As large as it may be: the run has read it.
        spec = MapSpec(about["file"], about["robot_radius_m"], about["corner_cutting"], MAX_CELLS)
        grid = read_map(spec)
    except MapError:  # it is no longer there
        return None
    if map_digest(grid) != about.get("grid_sha", about["map_sha"]):
        return None
    optimum = None
    if record["type"] == "pair":
        path = _path(record, grid)
        reference = outcome.optimum.get(query_key(record))
        if reference is not None and reference.get("path"):
            optimum = _path(reference, grid)
    else:  # a fault of the regions: the two cells that show it
        path = grid.frame.points_of(record["fault_cells"][record["faults"].index(text)])
    title = f"{outcome.label}, {_pair_text(record)}: {text}"
    return WorstCase(title, paths_uri(grid, path, optimum))


def _path(record: Record, grid: OccupancyGrid) -> FloatArray:
    """Return the points to draw for an answer: its path, or its endpoints if it has none."""
    start, goal = record["start"], record["goal"]
    if record.get("points"):
        points = np.array(record["points"], dtype=np.float64)
        if record.get("headings_rad") and np.isfinite(points).all():
            points = chords_of(grid, points, record["headings_rad"]).points
        return points[np.isfinite(points).all(axis=1)]
    if record.get("path"):
        return grid.frame.points_of(decode_path((start[0], start[1]), record["path"]))
    return grid.frame.points_of([start, goal])
