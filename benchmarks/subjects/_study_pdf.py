"""The study as a PDF of a few pages, and its charts: vectors, and no picture of a map."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Protocol

import numpy as np

from benchmarks.subjects._study_data import common_pairs, groups, studies_of
from benchmarks.subjects._study_page import CHARTS, about, circumstances, in_short, rules
from benchmarks.subjects._study_sheets import Sheets
from benchmarks.subjects._study_tables import TITLES, tables_of
from hybridnav.errors import InvalidValueError
from hybridnav.harness.columns import DEFINITION
from hybridnav.harness.outcome import nanquantile
from hybridnav.viz import method_styles, plot_losses, plot_speed, save_figure

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from matplotlib.axes import Axes

    from benchmarks.subjects._study_data import Data
    from hybridnav._base.typing import FloatArray
    from hybridnav.harness.analysis import Study
    from hybridnav.harness.yardstick import Optimum
    from hybridnav.viz.charts import MethodStyle

    Styles = Mapping[str, MethodStyle]

MOST_PAGES = 8
TITLE = "hybridnav: the study"
_CHART_IN, _LEGEND_LINE_IN = 2.2, 0.165
_SPARED = ("maps", "work", "not asked")
"""Tables that the PDF leaves out where it is too long, the first one first."""
_NOT_PRINTED = ("map by map",)
"""Tables that the page has and the PDF has not: one row for each map."""


class Draw(Protocol):
    """What draws a chart into axes, or, for None, into a figure of its own."""

    def __call__(self, ax: Axes | None) -> Axes: ...


def charts_of(folder: Path, root: Path) -> dict[str, Draw]:
    """Return by the name of its file what draws each chart into axes, or into new ones."""
    drawn: dict[str, Draw] = {}
    for name, study in studies_of(folder, root).items():
        whole, _ = groups(study)
        styles = method_styles(whole)
        for file, (optimum, is_speed) in _CHARTED[name].items():
            losses, times_ms = _samples(study, optimum)
            if losses and is_speed:
                drawn[file] = _drawer_of_speed(losses, times_ms, styles)
            elif losses:
                drawn[file] = _drawer_of_losses(losses, styles)
    return drawn


_CHARTED: dict[str, dict[str, tuple[Optimum, bool]]] = {
    "lengths": {"study-loss.svg": ("octile", False), "study-speed.svg": ("any-angle", True)},
    "costs": {"study-costs.svg": ("weighted", True)},
    "ompl": {"study-ompl-loss.svg": ("any-angle", False)},
}
"""By the charts of a part, what losses refer to, and whether times are beside them."""


def _drawer_of_losses(losses: Mapping[str, FloatArray], styles: Styles) -> Draw:
    return lambda ax: plot_losses(losses, styles=styles, ax=ax)


def _drawer_of_speed(
    losses: Mapping[str, FloatArray], times_ms: Mapping[str, float], styles: Styles
) -> Draw:
    timed = {name: losses[name] for name in losses if times_ms[name] > 0}
    return lambda ax: plot_speed(timed, times_ms, styles=styles, ax=ax)


def _samples(study: Study, optimum: Optimum) -> tuple[dict[str, FloatArray], dict[str, float]]:
    """Return by method the losses over an optimum of the pairs in common, and the median time in
    milliseconds."""
    whole, _ = groups(study)
    common = common_pairs(study, whole)
    losses, times_ms = {}, {}
    for label in whole:
        outcomes = study.of_method(label)
        of_maps = [np.where(o.among(common), o.losses_over(optimum), math.nan) for o in outcomes]
        seconds = np.concatenate([o.seconds[o.among(common)] for o in outcomes])
        losses[label] = np.concatenate(of_maps)
        times_ms[label] = 1e3 * nanquantile(seconds, 0.5)
    return {name: one for name, one in losses.items() if np.isfinite(one).any()}, times_ms


def write_charts(charts: Mapping[str, Draw], folder: Path) -> None:
    """Write each chart as an SVG."""
    for file, draw in charts.items():
        save_figure(draw(None), folder / file)


def sheets_of(data: Data, charts: Mapping[str, Draw], without: tuple[str, ...] = ()) -> Sheets:
    """Return the pages of the PDF, without tables of some names."""
    sheets = Sheets(TITLE)
    sheets.heading("The study: consistency, loss, efficiency", 16)
    for name, value in circumstances(data):
        sheets.paragraph(f"{name[0].upper()}{name[1:]}: {value}.")
    sheets.paragraph(rules(data))
    sheets.paragraph(DEFINITION)
    sheets.heading("In short")
    for line in in_short(data).splitlines():
        sheets.paragraph(_plain(line))
    for part in data["parts"]:
        sheets.heading(TITLES[part], 14)
        sheets.paragraph(_plain(about(data, part)))
        _set_tables(sheets, data, part, without)
        height_in = max(_CHART_IN, _LEGEND_LINE_IN * (len(data["parts"][part]["methods"]) + 2))
        for file, what in CHARTS[part]:
            if file in charts:
                sheets.chart(charts[file], height_in, f"{what}.")
    _set_tables(sheets, data, "", without)
    return sheets


def write_pdf(data: Data, charts: Mapping[str, Draw], path: Path) -> None:
    """Write the study as a PDF; tables that the page has too are left out where it is too long.

    Raises
    ------
    InvalidValueError
        When it has more than `MOST_PAGES`.
    """
    sheets = sheets_of(data, charts)
    for count in range(1, len(_SPARED) + 1):
        if len(sheets.pages) > MOST_PAGES:
            sheets = sheets_of(data, charts, _SPARED[:count])
    if len(sheets.pages) > MOST_PAGES:
        raise InvalidValueError(f"the PDF has {len(sheets.pages)} pages, at most {MOST_PAGES}")
    sheets.save(path, TITLE)


def _set_tables(sheets: Sheets, data: Data, part: str, without: tuple[str, ...]) -> None:
    """Set the tables of a part, or with an empty text those of all parts."""
    for table in tables_of(data):
        if table.part == part and table.name not in {*_NOT_PRINTED, *without}:
            sheets.table(table.title, table.columns, table.rows, table.note)


def _plain(text: str) -> str:
    """Return a line of Markdown without its marks."""
    return text.removeprefix("* ").replace("`", "").replace("\\*", "*")
