"""The HTML report of the study: its tables first, then the sections of the harness, map by map."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from benchmarks.subjects._study_data import studies_of
from benchmarks.subjects._study_page import circumstances, rules
from benchmarks.subjects._study_tables import TITLES, tables_of
from hybridnav._base.files import replace_file
from hybridnav.harness.columns import MEANINGS, rows_of_map
from hybridnav.harness.output import report_of
from hybridnav.harness.report import ReportData, render_report
from hybridnav.harness.tables import Table

if TYPE_CHECKING:
    from pathlib import Path

    from benchmarks.subjects._study_data import Data
    from benchmarks.subjects._study_tables import StudyTable

_WORDS = ("method", "metric", "map", "kind", "part", "what")


def write_report(data: Data, folder: Path, root: Path, path: Path) -> None:
    """Write the report of all parts; its pictures show maps."""
    reports: list[ReportData] = []
    for name, study in studies_of(folder, root).items():
        by_map = {of_map: rows_of_map(study, of_map) for of_map in study.maps}
        first = 1 + sum(len(report.maps) for report in reports)
        made = report_of(study, "", [], by_map, first=first)
        named = [replace(one, name=f"{one.name} ({TITLES[name].lower()})") for one in made.maps]
        reports.append(replace(made, maps=named))
    tables = [_table(table) for table in tables_of(data)]
    whole = replace(
        reports[0],
        title="hybridnav: the study",
        facts=[*(fact for fact in circumstances(data) if fact[0] != "warning"), _rules(data)],
        faults=[fault for report in reports for fault in report.faults],
        n_faults=sum(report.n_faults for report in reports),
        checks=sum(report.checks for report in reports),
        overall=tables,
        maps=[section for report in reports for section in report.maps],
        failures=[],
        warnings=[warning for report in reports for warning in report.warnings],
        meanings=list(dict(pair for report in reports for pair in report.meanings).items())
        + [(c, MEANINGS[c]) for c in ("maps", "nodes", "edges")],
    )
    replace_file(path, render_report(whole).encode())


def _rules(data: Data) -> tuple[str, str]:
    return "rules", rules(data)


def _table(table: StudyTable) -> Table:
    note = f" {table.note}" if table.note else ""
    part = f"{TITLES[table.part]}: " if table.part else ""
    numeric = {at for at, head in enumerate(table.columns) if at and not head.startswith(_WORDS)}
    return Table(
        columns=list(table.columns),
        rows=[list(row) for row in table.rows],
        caption=f"{part}{table.title}.{note}",
        numeric=frozenset(at for at in numeric if "reason" not in table.columns[at]),
    )
