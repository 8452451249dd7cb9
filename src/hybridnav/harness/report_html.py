"""The harness's report as one HTML text that opens without network: tables, charts, worst cases."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, TypeVar

from hybridnav.errors import InvalidValueError
from hybridnav.harness.charts import LIGHT_CSS, figure, loss_chart, speed_chart
from hybridnav.harness.map_picture import PICTURE_CSS, draw_case
from hybridnav.harness.svg import CHART_CSS, Look, escape, looks

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hybridnav._typing import ByteArray, FloatArray

_T = TypeVar("_T")

_PAGE_CSS = (
    f"{LIGHT_CSS}"
    "@media screen and (prefers-color-scheme:dark){:root{--paper:#14181d;--ink:#e6e9ed;"
    "--quiet:#9aa4af;--rule:#343b44;--link:#79b8ff;"
    "--bad:#ff9b93;--bad-paper:#3a1715;--good:#7ee08f;--good-paper:#12301a}}"
    "html{color-scheme:light dark}"
    "body{margin:0 auto;padding:1.5rem 1rem 3rem;max-width:72rem;background:var(--paper);"
    "color:var(--ink);font:16px/1.5 system-ui,sans-serif;overflow-wrap:break-word}"
    "h1,h2,h3{line-height:1.25}h2{margin-top:2.5rem;border-bottom:1px solid var(--rule)}"
    "a{color:var(--link)}.quiet{color:var(--quiet)}"
    ".box{padding:.7rem 1rem;border-radius:.3rem;border-left:.4rem solid}"
    ".bad{background:var(--bad-paper);color:var(--bad);border-color:var(--bad)}"
    ".good{background:var(--good-paper);color:var(--good);border-color:var(--good)}"
    "dl{display:grid;grid-template-columns:max-content 1fr;gap:.15rem 1rem}"
    "dt{color:var(--quiet)}dd{margin:0;min-width:0}"
    "nav ul{columns:14rem;padding-left:1.2rem}"
    ".wide{overflow-x:auto;margin:1rem 0}table{border-collapse:collapse;font-size:.9rem;"
    "font-variant-numeric:tabular-nums}"
    "caption{text-align:left;font-weight:600;padding-bottom:.3rem}"
    "th,td{padding:.25rem .7rem;border-bottom:1px solid var(--rule);text-align:left}"
    "thead th{border-bottom:2px solid var(--quiet);vertical-align:bottom}"
    "tbody th{font-weight:500}.n{text-align:right}td.n{white-space:nowrap}"
    "figure{margin:1rem 0}figcaption{font-size:.9rem;color:var(--quiet);max-width:48rem}"
    "svg{max-width:100%;height:auto}"
    ".cases{display:flex;flex-wrap:wrap;gap:1rem 1.5rem;align-items:flex-end}"
    ".cases figure{margin:0;max-width:320px}"
    "@media print{body{max-width:none;padding:0;font-size:10pt}.wide{overflow:visible}"
    "figure,tr,.box{break-inside:avoid}h2,h3,caption{break-after:avoid}"
    "*{print-color-adjust:exact;-webkit-print-color-adjust:exact}}"
)


@dataclass(frozen=True)
class Table:
    """A table of texts."""

    columns: list[str]
    rows: list[list[str]]
    caption: str
    numeric: frozenset[int] = frozenset()
    """Indices of the columns that are aligned to the right."""

    def __post_init__(self) -> None:
        for row in self.rows:
            if len(row) != len(self.columns):
                raise InvalidValueError(
                    f"table {self.caption!r}: a row has {len(row)} cells, "
                    f"expected {len(self.columns)}"
                )


@dataclass(frozen=True, eq=False)
class WorstCase:
    """A pair with a large loss, to be drawn."""

    title: str
    classes: ByteArray
    """uint8 (rows, cols) `CellClass`, row 0 at the lowest y: the whole map."""
    resolution_m: float
    path: FloatArray
    """float64 (n, 2), the method's path as (row, col), centres of cells at whole numbers."""
    optimum: FloatArray | None = None
    """float64 (m, 2), a shortest path of cells; None where there is none to show."""


@dataclass(frozen=True, eq=False)
class MapSection:
    """What the report says of one map."""

    name: str
    facts: list[tuple[str, str]] = field(default_factory=list)
    tables: list[Table] = field(default_factory=list)
    losses: dict[str, FloatArray] = field(default_factory=dict)
    """Per method, the loss of each solved pair; 0.01 is 1 %."""
    times_ms: dict[str, float] = field(default_factory=dict)
    """Per method, the median time of a query in milliseconds."""
    worst: list[WorstCase] = field(default_factory=list)


@dataclass(frozen=True, eq=False)
class ReportData:
    """All that a report says."""

    title: str
    facts: list[tuple[str, str]]
    faults: list[str]
    """Counter-examples to consistency and paths that failed a check, one line each."""
    checks: int
    """Checks made, passed or not."""
    criteria: Table
    """Thrun's three criteria, a row per method, all maps together."""
    maps: list[MapSection]
    overall_losses: dict[str, FloatArray] = field(default_factory=dict)
    overall_times_ms: dict[str, float] = field(default_factory=dict)
    metric_of: dict[str, str] = field(default_factory=dict)
    """Per method, the metric of its paths where losses refer to it, octile unless said otherwise:
    each has charts of its own."""


def render_report(report: ReportData) -> str:
    """The report as one HTML text without scripts and without references to other files.

    Equal data give equal text. Losses and times that are not finite are left out of the charts,
    and so are methods that have none left; each chart names those.

    Parameters
    ----------
    report
        What to say. Texts may hold any characters.

    Returns
    -------
    str
        An HTML document, to be written as UTF-8.
    """
    looks_of = looks(_method_names(report))
    losses, times_ms = report.overall_losses, report.overall_times_ms
    overall = [
        speed_chart(
            _of(names, losses),
            _of(names, times_ms),
            looks_of,
            f"Speed against loss, all maps{kind}",
        )
        for kind, names in _by_metric(report.metric_of, losses, times_ms)
    ]
    sections = (
        _map_section(index, section, looks_of, report.metric_of)
        for index, section in enumerate(report.maps, 1)
    )
    body = "\n".join(
        [
            f"<header><h1>{escape(report.title)}</h1>",
            _verdict(report.faults, report.checks),
            f"{_facts(report.facts)}</header>",
            _contents(report.maps),
            '<main><section id="all"><h2>All maps together</h2>',
            _table(report.criteria),
            *overall,
            "</section>",
            *sections,
            "</main>",
        ]
    )
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(report.title)}</title>\n"
        f"<style>{_PAGE_CSS}{CHART_CSS}{PICTURE_CSS}</style>\n"
        f"</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def _by_metric(
    metric_of: Mapping[str, str], *of_methods: Mapping[str, object]
) -> list[tuple[str, set[str]]]:
    """The methods of each metric, and what titles add for it: nothing where all are octile."""
    groups: dict[str, set[str]] = {}
    for name in (name for names in of_methods for name in names):
        groups.setdefault(metric_of.get(name, "octile"), set()).add(name)
    if groups.keys() <= {"octile"}:
        return [("", {name for names in of_methods for name in names})]
    return [(f", {metric} paths", names) for metric, names in groups.items()]


def _of(names: set[str], values: Mapping[str, _T]) -> dict[str, _T]:
    """The part of a mapping that is about some methods, in its order."""
    return {name: value for name, value in values.items() if name in names}


def _map_section(
    index: int, section: MapSection, looks_of: Mapping[str, Look], metric_of: Mapping[str, str]
) -> str:
    name = section.name
    parts = [f'<section id="map-{index}"><h2>{escape(name)}</h2>', _facts(section.facts)]
    parts += [_table(table) for table in section.tables]
    if section.losses or section.times_ms:
        title = f"Speed against loss, {name}"
        for kind, names in _by_metric(metric_of, section.losses, section.times_ms):
            losses, times_ms = _of(names, section.losses), _of(names, section.times_ms)
            parts.append(loss_chart(losses, looks_of, f"Loss, {name}{kind}"))
            parts.append(speed_chart(losses, times_ms, looks_of, f"{title}{kind}"))
    if section.worst:
        parts.append(
            "<h3>Worst cases</h3>"
            '<p class="quiet">Thick line: the path; dashed line: a shortest path on the grid; '
            "disc: start; square: goal.</p>"
        )
        parts.append(f'<div class="cases">{"".join(map(_case, section.worst))}</div>')
    return "\n".join([*parts, "</section>"])


def _case(case: WorstCase) -> str:
    svg = draw_case(
        case.classes, case.path, case.optimum, resolution_m=case.resolution_m, title=case.title
    )
    return figure(case.title, svg, "", [])


def _verdict(faults: Sequence[str], checks: int) -> str:
    if faults:
        count = f"{len(faults)} counter-example{'s' if len(faults) > 1 else ''}"
        items = "".join(f"<li>{escape(fault)}</li>" for fault in faults)
        told = f"{count} in {checks:,} checks"
        return f'<div class="box bad"><strong>{told}</strong><ul>{items}</ul></div>'
    if checks == 0:
        return '<p class="box">Nothing was checked.</p>'
    return f'<p class="box good">No counter-example in {checks:,} checks.</p>'


def _facts(facts: Sequence[tuple[str, str]]) -> str:
    items = "".join(f"<dt>{escape(key)}</dt><dd>{escape(told)}</dd>" for key, told in facts)
    return f"<dl>{items}</dl>" if items else ""


def _contents(maps: Sequence[MapSection]) -> str:
    links = "".join(
        f'<li><a href="#map-{index}">{escape(section.name)}</a></li>'
        for index, section in enumerate(maps, 1)
    )
    return (
        '<nav aria-label="Contents"><h2>Contents</h2>'
        f'<ul><li><a href="#all">All maps together</a></li>{links}</ul></nav>'
    )


def _table(table: Table) -> str:
    styles = [' class="n"' if i in table.numeric else "" for i in range(len(table.columns))]
    head = "".join(
        f'<th scope="col"{style}>{escape(column)}</th>'
        for column, style in zip(table.columns, styles, strict=True)
    )
    rows = []
    for row in table.rows:
        cells = [f"<td{style}>{escape(cell)}</td>" for cell, style in zip(row, styles, strict=True)]
        if cells and 0 not in table.numeric:
            cells[0] = f'<th scope="row">{escape(row[0])}</th>'
        rows.append(f"<tr>{''.join(cells)}</tr>")
    caption = escape(table.caption)
    return (
        f'<div class="wide" role="region" tabindex="0" aria-label="{caption}"><table>'
        f"<caption>{caption}</caption><thead><tr>{head}</tr></thead>"
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def _method_names(report: ReportData) -> list[str]:
    names = [*report.overall_losses, *report.overall_times_ms]
    for section in report.maps:
        names += [*section.losses, *section.times_ms]
    return names
