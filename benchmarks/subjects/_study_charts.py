"""The charts of the study: vectors, and no picture of a map."""

import json
import math
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Protocol

import numpy as np
from matplotlib.axes import Axes

from benchmarks.subjects._study_data import LEVELS_FILE, common_pairs, groups, studies_of
from benchmarks.subjects._study_descent import CHART, plot_levels_of
from hybridnav._base.typing import FloatArray
from hybridnav.harness.analysis import Study
from hybridnav.harness.outcome import nanquantile
from hybridnav.harness.yardstick import Optimum
from hybridnav.viz import method_styles, plot_losses, plot_speed, save_figure
from hybridnav.viz.charts import MethodStyle

Styles = Mapping[str, MethodStyle]


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
    levels = folder / LEVELS_FILE
    if levels.exists():
        drawn[CHART] = partial(plot_levels_of, json.loads(levels.read_text("utf-8")))
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
