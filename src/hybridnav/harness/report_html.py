"""The harness's report as one HTML text that opens without network: tables, charts, worst cases."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.harness.map_picture import PICTURE_CSS, draw_case
from hybridnav.harness.svg import (
    CHART_CSS,
    Look,
    Rect,
    Scale,
    axes,
    coordinate,
    drawing,
    escape,
    labels,
    legend,
    legend_size,
    looks,
    number,
    percent,
    round_step,
    rounded_share,
    shortened,
    text,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from hybridnav._typing import ByteArray, FloatArray, LongArray

NO_LOSS = 1e-9
"""Largest loss that counts as none: costs are recounted as a + b sqrt 2 to this accuracy."""
LEAST_LOSS_DRAWN = 1e-4

_LOSS_BOX = Rect(58, 30, 440, 230)
_SPEED_BOX = Rect(58, 30, 620, 290)
_ZERO_PX = 52
"""Width of the strip left of the logarithmic axis, where a loss of nothing has its place."""

_LIGHT_CSS = (
    ":root{--paper:#fff;--ink:#1b1f24;--quiet:#57606a;--rule:#d8dee4;--link:#0550ae;"
    "--bad:#b3261e;--bad-paper:#fdecea;--good:#116329;--good-paper:#e8f5ea}"
)
_PAGE_CSS = (
    f"{_LIGHT_CSS}"
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
    path: LongArray
    """int64 (n, 2), the method's path as (row, col)."""
    optimum: LongArray | None = None
    """int64 (m, 2), a shortest path; None where there is none to show."""


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
    overall = speed_chart(
        report.overall_losses, report.overall_times_ms, looks_of, "Speed against loss, all maps"
    )
    sections = (
        _map_section(index, section, looks_of) for index, section in enumerate(report.maps, 1)
    )
    body = "\n".join(
        [
            f"<header><h1>{escape(report.title)}</h1>",
            _verdict(report.faults, report.checks),
            f"{_facts(report.facts)}</header>",
            _contents(report.maps),
            '<main><section id="all"><h2>All maps together</h2>',
            _table(report.criteria),
            f"{overall}</section>",
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


def loss_chart(losses: Mapping[str, FloatArray], looks_of: Mapping[str, Look], title: str) -> str:
    """Figure of the share of pairs that lose more than x, a line per method; x is logarithmic."""
    known = {name: _known(values) for name, values in losses.items()}
    drawn = {name: values for name, values in known.items() if len(values)}
    missing = [name for name in losses if name not in drawn]
    if not drawn:
        return _figure(title, "", "No pair has a known loss.", missing)
    box = _LOSS_BOX
    largest = max(float(values[-1]) for values in drawn.values())
    x = Scale("log", LEAST_LOSS_DRAWN, max(1e-2, largest), box.left + _ZERO_PX, box.right - 6)
    most = max(1e-2, *(_share_above(values, NO_LOSS) for values in drawn.values()))
    step = round_step(most / 5)
    y = Scale("linear", 0, min(1.0, step * math.ceil(most / step)), box.bottom, box.top)
    zero = box.left + 14
    lines = [_survival(values, looks_of[name], x, y, zero) for name, values in drawn.items()]
    entries = [
        (looks_of[name], f"{shortened(name)}: {rounded_share(1 - _share_above(values, NO_LOSS))}")
        for name, values in drawn.items()
    ]
    x_ticks = [(zero, "0"), *((x(tick), percent(tick)) for tick in x.ticks(46))]
    frame = axes(
        box,
        x_ticks,
        [(y(tick), percent(tick)) for tick in y.ticks(28)],
        x_label="loss",
        y_label="pairs that lose more",
    )
    width, height = legend_size([content for _, content in entries])
    key_left = box.right + 22
    keys = text(key_left, box.top - 10, "pairs without loss", class_="quiet")
    keys += legend(key_left, box.top - 2, entries)
    size = key_left + max(width, 120), max(box.bottom + 44, box.top + height + 4)
    told = (
        "Each line is the share of pairs whose loss is above the value below it; at 0, the share "
        "with any loss. A line further down and left is better."
    )
    return _figure(title, drawing(*size, title, frame, *lines, keys), told, missing)


def speed_chart(
    losses: Mapping[str, FloatArray],
    times_ms: Mapping[str, float],
    looks_of: Mapping[str, Look],
    title: str,
) -> str:
    """Figure of each method's mean loss over its median time of a query, with labelled points."""
    names = list(dict.fromkeys([*losses, *times_ms]))
    points = {}
    for name in names:
        values, time = _known(losses.get(name)), times_ms.get(name, math.nan)
        if len(values) and math.isfinite(time) and time > 0:
            points[name] = (float(time), float(values.mean()))
    missing = [name for name in names if name not in points]
    if not points:
        return _figure(title, "", "No method has both a time and a loss.", missing)
    box = _SPEED_BOX
    times, means = zip(*points.values(), strict=True)
    slow = max(*times, 10 * min(times)) * 1.3
    x = Scale("log", min(times) / 1.3, slow, box.left, box.right)
    low = min(0.0, *means) * 1.3
    y = Scale("symlog", low, max(1e-3, *means) * 1.3, box.bottom - 10, box.top + 8)
    places = [(x(time), y(mean)) for time, mean in points.values()]
    frame = axes(
        box,
        [(x(tick), number(tick)) for tick in x.ticks(44)],
        [(y(tick), percent(tick)) for tick in y.ticks(22)],
        x_label="median time of a query, ms",
        y_label="mean loss",
    )
    dots = [
        looks_of[name].dot(*place, f"{name}: {time:.3g} ms, {100 * mean:.3g} %")
        for (name, (time, mean)), place in zip(points.items(), places, strict=True)
    ]
    names_drawn = labels(places, [shortened(name) for name in points], box)
    svg = drawing(box.right + 12, box.bottom + 44, title, frame, names_drawn, *dots)
    return _figure(
        title,
        svg,
        "Down and to the left is better; the loss axis is logarithmic above 0.01\u00a0%.",
        missing,
    )


def chart_file(figure: str) -> str:
    """A figure's drawing as the text of an SVG file of its own, in the light palette."""
    svg = figure[figure.index("<svg") : figure.index("</svg>") + len("</svg>")]
    head, _, rest = svg.partition(">")
    opening = head.replace("<svg", '<svg xmlns="http://www.w3.org/2000/svg"')
    style = f"{_LIGHT_CSS}{CHART_CSS}svg{{font:13px system-ui,sans-serif}}"
    paper = '<rect width="100%" height="100%" fill="#fff"/>'
    return f"{opening}><style>{style}</style>{paper}{rest}\n"


def _survival(values: FloatArray, look: Look, x: Scale, y: Scale, zero: float) -> str:
    """A falling staircase with one corner per unit of x at most, and a marker at no loss."""
    columns = np.arange(math.ceil(x.end - x.start) + 1)
    power = np.log10(x.low) + columns / (x.end - x.start) * np.log10(x.high / x.low)
    shares = 1 - np.searchsorted(values, 10**power, side="right") / len(values)
    path = [f"M{coordinate(zero)} {coordinate(y(_share_above(values, NO_LOSS)))}"]
    path.append(f"L{coordinate(x.start)} {coordinate(y(float(shares[0])))}")
    corners = np.flatnonzero(np.diff(shares)) + 1
    path += [
        f"H{coordinate(x.start + column)}V{coordinate(y(float(shares[column])))}"
        for column in corners.tolist()
    ]
    end = x.end if shares[-1] > 0 or not len(corners) else x.start + corners[-1]
    path.append(f"H{coordinate(float(end))}")
    return look.line("".join(path)) + look.dot(zero, y(_share_above(values, NO_LOSS)))


def _map_section(index: int, section: MapSection, looks_of: Mapping[str, Look]) -> str:
    name = section.name
    parts = [f'<section id="map-{index}"><h2>{escape(name)}</h2>', _facts(section.facts)]
    parts += [_table(table) for table in section.tables]
    if section.losses or section.times_ms:
        parts.append(loss_chart(section.losses, looks_of, f"Loss, {name}"))
        parts.append(
            speed_chart(section.losses, section.times_ms, looks_of, f"Speed against loss, {name}")
        )
    if section.worst:
        parts.append(
            "<h3>Worst cases</h3>"
            '<p class="quiet">Thick line: the path; dashed line: a shortest path; '
            "disc: start; square: goal.</p>"
        )
        parts.append(f'<div class="cases">{"".join(map(_case, section.worst))}</div>')
    return "\n".join([*parts, "</section>"])


def _case(case: WorstCase) -> str:
    svg = draw_case(
        case.classes, case.path, case.optimum, resolution_m=case.resolution_m, title=case.title
    )
    return _figure(case.title, svg, "", [])


def _figure(title: str, svg: str, told: str, missing: Sequence[str]) -> str:
    left_out = f" Not drawn, for want of values: {', '.join(missing)}." if missing else ""
    caption = f"<strong>{escape(title)}.</strong> {escape(told + left_out)}".rstrip()
    return f"<figure>{svg}<figcaption>{caption}</figcaption></figure>"


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


def _known(values: FloatArray | None) -> FloatArray:
    """Finite losses, rising."""
    if values is None:
        return np.empty(0)
    return np.sort(values[np.isfinite(values)])


def _share_above(values: FloatArray, loss: float) -> float:
    return 1 - float(np.searchsorted(values, loss, side="right")) / len(values)
