"""Outputs of a run beside its records: tables as CSV and Markdown, and the report."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hybridnav._files import replace_file, without_controls
from hybridnav.harness.ahead import ahead_of_presets
from hybridnav.harness.analysis import Study, load_study
from hybridnav.harness.columns import EFFICIENCY_COLUMNS, OPTIMA, YARDSTICKS, loss_columns, shown
from hybridnav.harness.kinds import CONSISTENCY_COLUMNS
from hybridnav.harness.method_table import METHOD_COLUMNS, rows_of_methods
from hybridnav.harness.report import render_report
from hybridnav.harness.rows import rows_of_map, rows_of_study
from hybridnav.harness.sections import failures_of, report_of, with_values
from hybridnav.harness.tables import Row, to_csv, to_markdown

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from hybridnav.harness.yardstick import Yardstick


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
    report = report_of(study, title, overall, by_map)
    replace_file(folder / "report.html", render_report(report).encode())
    return study


def markdown(overall: Sequence[Row], study: Study) -> str:
    """Return the tables of all maps together, one for consistency, one for the losses over each
    optimum, one for efficiency."""
    found, checked = len(study.faults), study.any_angle_checked
    text = (
        f"## Consistency\n\n{study.checks:,} answers checked, {found} counter-examples, "
        f"{study.failures} queries without an answer."
        f"{f' Checked any-angle: {checked}.' if checked else ''}\n\n"
        f"{_table(overall, CONSISTENCY_COLUMNS)}\n"
    )
    text += f"## Methods\n\n{_table(rows_of_methods(study), METHOD_COLUMNS)}\n"
    failures = failures_of(study)
    if failures:
        text += "## Methods without answers\n\n"
    for reason, trace in failures:
        text += f"* {reason}\n\n" + (f"```text\n{trace.rstrip()}\n```\n\n" if trace else "")
    for optimum in YARDSTICKS[study.metric]:
        rows = with_values(overall, f"{optimum} loss mean %")
        if rows:
            columns = loss_columns(optimum)
            text += f"## Loss over {OPTIMA[optimum]}\n\n{_table(rows, columns)}\n"
            text += _note(rows, columns, study)
    text += "".join(f"{warning}\n\n" for warning in study.warnings)
    timed = any(with_values(overall, column) for column in EFFICIENCY_COLUMNS)
    if timed:
        text += f"## Efficiency\n\n{_table(overall, EFFICIENCY_COLUMNS)}\n"
        text += _note(overall, EFFICIENCY_COLUMNS, study)
    return without_controls(text.rstrip("\n") + "\n")


def _note(rows: Sequence[Row], columns: Sequence[str], study: Study) -> str:
    note = ahead_of_presets(rows, columns, study.presets)
    return f"{note}\n\n" if note else ""


def _table(rows: Sequence[Row], columns: Sequence[str]) -> str:
    """Return rows as Markdown without columns that are empty."""
    kept = ["method", *(column for column in columns if with_values(rows, column))]
    renamed = [{shown(column): row.get(column, "") for column in kept} for row in rows]
    return to_markdown(renamed, [shown(column) for column in kept])
