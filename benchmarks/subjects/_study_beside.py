"""The chart of the first page: time and loss of every method on one map of the study, as bars."""

from matplotlib.axes import Axes

from benchmarks.subjects._study_data import Data
from hybridnav.viz import style
from hybridnav.viz.canvas import new_figure

CHART, MAP = "beside-peers.svg", "bwi_gdc/3/3"
_NAMES = {
    "shortest": "shortest",
    "octile": "octile",
    "paper": "paper",
    "grid-astar": "A*",
    "weighted-astar": "weighted A*",
    "hpa-star": "HPA*",
    "thrun": "Thrun's regions",
    "simple-graph": "a simple graph",
    "nano-astar": "nano-astar",
    "tcod": "tcod",
}
"""What the chart calls the methods; ours come first in their colour."""
_OURS = ("shortest", "octile", "paper")


def plot_beside(data: Data) -> Axes:
    """Draw two bars for each method: the median time of a query, and the mean loss of its paths
    over the shortest ones at any angle."""
    (row,) = [one for one in data["parts"]["lengths"]["by map"] if one["map"] == MAP]
    (about,) = [one for one in data["maps"] if one["map"] == MAP]
    methods = sorted(_NAMES.keys() & row.keys(), key=lambda name: row[name]["ms"], reverse=True)
    figure = new_figure(7.0, 0.4)
    axes = figure.subplots(1, 2, sharey=True)
    colours = [style.PATH if name in _OURS else style.ARC for name in methods]
    shown = {
        "ms": "ms a query, median, in a log scale",
        "loss": "% longer than the shortest path, mean",
    }
    for ax, (key, title) in zip(axes, shown.items(), strict=True):
        values = [row[name][key] for name in methods]
        bars = ax.barh([_NAMES[name] for name in methods], values, color=colours, height=0.7)
        ax.bar_label(bars, [f"{value:.2g}" for value in values], padding=3, fontsize=8)
        ax.set_title(title, fontsize=9, loc="left")
        ax.spines[["top", "right", "bottom"]].set_visible(False)
        ax.tick_params(which="both", left=False, bottom=False, labelbottom=False, labelsize=8)
        ax.margins(x=0.12)
    axes[0].set_xscale("log")
    axes[0].set_xlim(0.1, 200)
    for label, name in zip(axes[0].get_yticklabels(), methods, strict=True):
        label.set(color=style.PATH if name in _OURS else style.INK)
    where = f"{about['map']}, {about['free cells']:,} free cells, {data['plan']['pairs']} pairs"
    figure.text(0.99, 0.01, f"{where}; red: presets of hybridnav", ha="right", fontsize=7)
    figure.subplots_adjust(left=0.16, right=0.98, top=0.9, bottom=0.07, wspace=0.08)
    return axes[0]
