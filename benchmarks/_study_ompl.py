"""The part of the study that is about OMPL: its presets on the same maps, with fewer pairs."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from hybridnav.config import load_preset
from hybridnav.harness.analysis import pairs_in_common
from hybridnav.harness.methods import REFERENCE
from hybridnav.harness.outcome import nanmean, nanquantile
from hybridnav.harness.rows import figures
from hybridnav.harness.run import RunSettings, evaluate
from hybridnav.harness.tables import to_markdown
from hybridnav.viz import plot_losses

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from matplotlib.axes import Axes

    from hybridnav.config import Preset
    from hybridnav.harness.analysis import Study
    from hybridnav.harness.outcome import Outcome
    from hybridnav.harness.tables import Row

BESIDE = "portals"
"""Preset whose grid paths, shortened by line of sight, are set beside OMPL's."""

_COLUMNS = (
    "method", "pairs", "solved by itself", "by the grid", "without an answer", "faults",
    "any-angle loss mean %", "any-angle loss 95 % interval", "any-angle loss median %",
    "any-angle loss p95 %", "any-angle loss max %",
    "loss by the grid %", "first path ms, median", "query ms, median", "query ms, max",
)  # fmt: skip
_OF_MAPS = (
    "map", "method", "solved by itself", "by the grid", "any-angle loss mean %",
    "any-angle loss max %",
    "first path ms, median", "query ms, median",
)  # fmt: skip


def presets(budget_s: float | None) -> tuple[Preset, ...]:
    """OMPL's presets, with their own budgets or another, and the one beside them."""
    budget = [] if budget_s is None else [f"planner.ompl.budget_s={budget_s}"]
    names = [name for name in hn.preset_names() if name.startswith("ompl-")]
    beside = load_preset(BESIDE, overrides=["planner.smooth=line-of-sight"])
    return *(load_preset(name, overrides=budget) for name in names), beside


def run(
    maps: Sequence[tuple[Path, str | None]],
    folder: Path,
    *,
    pairs: int,
    budget_s: float | None,
    workers: int,
) -> None:
    """All queries of this part.

    Parameters
    ----------
    maps
        Files, and their scenario files where they have one.
    folder
        Where the records go.
    pairs
        Of each map.
    budget_s
        Seconds that OMPL may take for a query; None for the presets' own.
    workers
        Processes; more than the machine has cores would eat up each other's budgets.
    """
    for number, (path, scenarios) in enumerate(maps, start=1):
        settings = RunSettings(
            maps=(str(path),),
            presets=presets(budget_s),
            pairs=pairs,
            scenarios=scenarios,
            workers=workers,
        )
        made = evaluate(settings, folder)
        sys.stderr.write(f"OMPL, {number} of {len(maps)}: {path.name}, {made} records\n")


def page(study: Study, *, pairs: int, budget_s: float | None) -> str:
    """The page of this part."""
    overall = [_figures(study.of_method(label)) for label in _labels(study)]
    of_maps = [
        {"map": name, **_figures([outcome])}
        for name in study.maps
        for outcome in study.of_map(name)
        if outcome.metric == "any-angle"
    ]
    whole = study.of_method(REFERENCE)
    longer = nanmean(np.concatenate([outcome.any_angle_losses for outcome in whole]))
    budget = f"{1.0 if budget_s is None else budget_s:g} s"
    return f"""# The study: OMPL in the corridor

Thrun's three questions, asked of the presets `ompl-*` on {len(study.maps)} maps of
[the study](study.md), up to {pairs} pairs a map, with a budget of {budget} a query. Beside them
`{BESIDE}+line-of-sight`: the shortest path of the grid, shortened by line of sight.
`python -m benchmarks.study --part ompl --data FOLDER -o DIR` makes this page anew. The page
[harness.md](harness.md) describes the columns.

All these paths are any-angle, and so is what their loss refers to: the shortest any-angle path,
proved. The grid's optimum itself is {100 * longer:.1f} % longer than that. A path counts as a
method's own where OMPL found it; where it found none in its time the grid's path, shortened by line
of sight, stands in, and is counted by itself.

## Consistency

{study.checks:,} answers checked: {len(study.faults)} counter-examples, {study.failures} queries
without an answer.

## OMPL

{to_markdown(overall, _COLUMNS)}
RRTConnect ends with its first path, simplified; the others go on improving theirs, until the budget
is spent at the latest. Times are of queries that a method solved itself, but for the longest, which
is of all; OMPL's include what it takes to send a query to its process.

![Share of pairs that lose more than x, for each method](images/study-ompl-loss.svg)

## Map by map

{to_markdown(of_maps, _OF_MAPS)}"""


def chart(study: Study) -> Axes:
    """Draw the any-angle losses of all methods' own paths."""
    return plot_losses({label: study.pooled(label, "losses") for label in _labels(study)})


def _labels(study: Study) -> list[str]:
    lines = [o.label for o in study.outcomes if o.metric == "any-angle"]
    return list(dict.fromkeys(lines))


def _figures(outcomes: Sequence[Outcome]) -> Row:
    found = figures(outcomes, outcomes, pairs_in_common(outcomes))
    firsts = np.concatenate([outcome.first_seconds for outcome in outcomes])
    asked = np.concatenate([outcome.figure("seconds") for outcome in outcomes])
    fallbacks = np.concatenate([outcome.fallback_losses for outcome in outcomes])
    return {
        "method": outcomes[0].label,
        **found,
        "solved by itself": found["solved"],
        "without an answer": sum(outcome.failures for outcome in outcomes),
        "loss by the grid %": 100 * nanmean(fallbacks),
        "first path ms, median": 1e3 * nanquantile(firsts, 0.5),
        "query ms, max": 1e3 * float(np.nanmax(asked, initial=-math.inf)),
    }
