"""Loss against work of `paper` as the level at which its descent ends goes from places to cells.

On each map of the study, the same sampled pairs for each size of the last fields, `field_cells`.
Loss is over the octile optimum, in the mean; work is what is expanded, fields and cells, over the
cells that `grid-astar` expands. Neither depends on the machine or on its load.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patheffects import withStroke

import hybridnav as hn
from benchmarks.common import read
from benchmarks.subjects._study_data import Data
from benchmarks.subjects._study_maps import StudyMap
from benchmarks.tables import print_head, print_row
from hybridnav.harness.scenes import sample_pairs
from hybridnav.viz import style
from hybridnav.viz.canvas import new_figure

PLACES = "places"
SIZES = {str(n): n for n in (1, 4, 16, 64, 128, 512, 2048)} | {PLACES: 0}
"""Mean cells of the last fields, by their names; 0 for those of the places of each map."""
DEFAULT = "128"
"""That of the preset."""
PAIRS, SEED = 32, 0
CHART = "study-descent.svg"
_COLOURS = {"ROS": "#0072b2", "SLAM": "#d55e00", "MovingAI": "#009e73"}
_LOSS, _WORK = "loss mean %", "work %"


def levels_of(maps: Sequence[StudyMap], root: Path) -> Data:
    """Return loss and work of each map, by its name from a folder, and print them."""
    found: Data = {}
    print_head("map: loss %, work %", *SIZES, "octile")
    for one in maps:
        name = one.path.relative_to(root).with_suffix("").as_posix()
        found[name] = _measured(one)
        rows = found[name]["figures"].values()
        print_row(name, *(f"{row[_LOSS]:.2f}, {row[_WORK]:.3g}" for row in rows))
    means = {name: means_of(found, name) for name in (*SIZES, "octile")}
    print_row("all", *(f"{loss:.2f}, {work:.3g}" for work, loss in means.values()))
    return found


def _measured(one: StudyMap) -> Data:
    """Return loss and work in per cent for each size, and those of `octile`."""
    grid = read(one.path)
    merge_m = 40.0 if one.kind == "MovingAI" else 4.0  # as in the study
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=merge_m)
    topology = hn.TopologicalMap(pyramid)
    of_places = pyramid[0].n_vertices // pyramid[pyramid.place_level].n_vertices
    pairs = [p for p in sample_pairs(grid, PAIRS, seed=SEED) if p.kind == "sampled"]
    ends = [grid.frame.points_of([pair.start, pair.goal]) for pair in pairs]

    def answers(preset: Any) -> np.ndarray[Any, Any]:
        """Return the cost of each answer, and what is expanded."""
        planner = hn.HybridPlanner(topology, preset=preset)
        found = [planner.plan(*two) for two in ends]
        rows = [(r.cost, r.stats.expanded + r.stats.expanded_places) for r in found]
        return np.array(rows, float)

    whole = answers("grid-astar")
    rows = {
        name: answers(
            hn.load_preset("paper", overrides=[f"planner.field_cells={size or of_places}"])
        )
        for name, size in SIZES.items()
    }
    rows["octile"] = answers("octile")
    figures = {}
    for name, (costs, work) in ((name, each.T) for name, each in rows.items()):
        losses = 100 * (costs / whole[:, 0] - 1)
        share = 100 * work.sum() / whole[:, 1].sum()
        row = {_LOSS: losses.mean(), "loss max %": losses.max(), _WORK: share}
        figures[name] = {column: float(f"{value:.4g}") for column, value in row.items()}
    return {"kind": one.kind, "pairs": len(pairs), "figures": figures}


def means_of(levels: Data, name: str) -> tuple[float, float]:
    """Return work and loss in the mean over the maps, for one size or `octile`."""
    rows = [one["figures"][name] for one in levels.values()]
    work, loss = np.mean([(row[_WORK], row[_LOSS]) for row in rows], axis=0).tolist()
    return work, loss


def plot_levels_of(levels: Data, ax: Axes | None = None) -> Axes:
    """Draw one curve a map, the mean of all, and A* and `octile` as points."""
    if ax is None:
        ax = new_figure(7.0, 0.62).subplots()
    for one in levels.values():
        rows = [one["figures"][name] for name in SIZES]
        curve = [row[_WORK] for row in rows], [row[_LOSS] for row in rows]
        ax.plot(*curve, color=_COLOURS[one["kind"]], lw=0.7, alpha=0.55)
        point = one["figures"]["octile"]
        ax.plot(point[_WORK], point[_LOSS], "v", ms=4, mfc="none", color=style.ARC)
    means = [means_of(levels, name) for name in SIZES]
    ax.plot(*zip(*means, strict=True), "o-", color=style.INK, lw=1.8, ms=4, zorder=5)
    for name, at in zip(SIZES, means, strict=True):
        step = (-3, -11) if SIZES[name] in {1, 4} else (5, 3)  # beside the curve, not on it
        text = ax.annotate(name, at, textcoords="offset points", xytext=step, fontsize=8, zorder=4)
        text.set_path_effects([withStroke(linewidth=2.5, foreground="white")])
    ax.plot(100, 0, "s", color=style.PATH, ms=6, zorder=6)
    looks: dict[str, dict[str, Any]] = {
        "mean, by cells of the last fields": {"color": style.INK, "marker": "o"},
        **{f"a {kind} map": {"color": colour} for kind, colour in _COLOURS.items()},
        "octile, on each map": {"color": style.ARC, "marker": "v", "ls": "", "mfc": "none"},
        "A* on all cells": {"color": style.PATH, "marker": "s", "ls": ""},
    }
    for label, look in looks.items():
        ax.plot([], [], label=label, **look)
    ax.set(xscale="log", xlabel="work, in % of what A* on all cells expands")
    ax.set_yscale("symlog", linthresh=0.1)
    ax.set(ylabel="mean loss over the octile optimum, %", ylim=(-0.02, None))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_formatter("{x:g}")
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(frameon=False, fontsize=8)
    return ax
