"""Pictures of how a pyramid grows. Public: `plot_levels` and `plot_kernels`.

Its levels side by side, and the arcs that are contracted and removed in one step.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass
from hybridnav.pyramid import DualGraphPyramid, Level
from hybridnav.viz import style
from hybridnav.viz.canvas import PAD_IN, Canvas, View, known_view
from hybridnav.viz.layout import Entry, add_title, finish_with_axes, frame_axes, wrapped
from hybridnav.viz.places import Places
from hybridnav.viz.topology import Graph, draw_graph, draw_ground, drawable

GRAPH_UP_TO = 150
"""Most vertices of a panel with a graph: more would cover their own fields."""
_GAP_IN = 0.1
_STRENGTH = 0.75


def plot_levels(  # noqa: PLR0913 - all but the first have defaults
    pyramid: DualGraphPyramid,
    levels: Sequence[int] | None = None,
    *,
    axes: Sequence[Axes] | None = None,
    columns: int = 3,
    graph_up_to: int = GRAPH_UP_TO,
    width_in: float = style.FULL_WIDTH_IN,
) -> tuple[Axes, ...]:
    """Draw levels of a pyramid side by side, each with its fields and, high up, its graph.

    Neighbouring fields never have the same colour; unexplored ones are grey. Arcs are drawn as in
    `plot_topology`: parallel ones in blue, self-loops in red dashes.

    Parameters
    ----------
    pyramid
        The pyramid.
    levels
        Indices of levels, in the order of the panels; negative ones count from the apex. By default
        all.
    axes
        Axes to draw on, one for each level; by default new ones in a new figure.
    columns
        Panels in a row of a new figure, >= 1.
    graph_up_to
        Most vertices of a level with a graph; other levels are drawn as fields alone.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    tuple of Axes
        The axes drawn on, one for each level; `axes[0].figure` is the figure.

    Raises
    ------
    IndexError
        When there is no such level.
    InvalidValueError
        When there are no levels or no columns, or not as many axes as levels.

    Examples
    --------
    >>> from hybridnav.viz import plot_levels
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> len(plot_levels(pyramid, [0, 2, 4]))
    3
    """
    chosen = [pyramid[index] for index in (range(len(pyramid)) if levels is None else levels)]
    if not chosen or columns < 1:
        raise InvalidValueError(
            f"expected at least one level and one column, got {len(chosen)} and {columns}"
        )
    if axes is None:
        view, words = known_view(chosen[0].grid), [_words(level) for level in chosen]
        axes = panels(view, words, columns, width_in)
    elif len(axes) != len(chosen):
        raise InvalidValueError(f"{len(chosen)} levels need as many axes, got {len(axes)}")
    for ax, level in zip(axes, chosen, strict=True):
        canvas = Canvas.opened(ax, width_in, known_view(level.grid))
        draw_ground(canvas, level.grid, level.field_of, Places(level).colours(), _STRENGTH)
        if level.n_vertices <= graph_up_to:
            draw_graph(canvas, Graph(level, 0.0), simple=False)
        frame_axes(canvas)
        add_title(canvas, _words(level))
    return tuple(axes)


def _words(level: Level) -> list[str]:
    """Return the parts of a panel's title."""
    return [f"level {level.index}", f"{level.n_vertices:,} vertices", f"{level.n_arcs:,} arcs"]


def panels(view: View, titles: Sequence[list[str]], columns: int, width_in: float) -> list[Axes]:
    """Return axes in rows, of the shape of a view, in a new figure with room for their titles."""
    rows = math.ceil(len(titles) / columns)
    panel_in = (width_in - (columns - 1) * _GAP_IN - 2 * PAD_IN) / columns
    tall_in = panel_in * float(view.size[1] / view.size[0])
    font = style.Sizes.fitting(panel_in, 1.0).font
    room = 72 * (panel_in - 2 * PAD_IN)
    lines = max(wrapped(words, font, room).count("\n") + 1 for words in titles)
    row_in = tall_in + (0.6 + 1.4 * lines) * font / 72
    height_in = rows * row_in + (rows - 1) * _GAP_IN + 2 * PAD_IN
    figure = Figure(figsize=(width_in, height_in))
    axes = []
    for number in range(len(titles)):
        row, col = divmod(number, columns)
        left_in = PAD_IN + col * (panel_in + _GAP_IN)
        bottom_in = height_in - PAD_IN - (row + 1) * row_in - row * _GAP_IN
        box = left_in / width_in, bottom_in / height_in, panel_in / width_in, tall_in / height_in
        axes.append(figure.add_axes(box))
    return axes


# One step of a pyramid: contracted and removed arcs.


_NUMBERED_UP_TO = 40
_CLEARANCE = 2.4  # points on a picture of full width
_CONTRACTED, _REMOVED, _KEPT = "contraction kernel", "removal kernel", "arc of the next level"
_STROKES = {
    _KEPT: (style.RIM_ARC, 0.8, "solid"),
    _REMOVED: (style.HOLE, 1.3, (0, (2.2, 1.4))),
    _CONTRACTED: (style.INK, 2.4, "solid"),
}
_DOTS = {"surviving": (5.6, style.INK), "not surviving": (4.4, style.FREE)}


def plot_kernels(  # noqa: PLR0913 - all but the first two have defaults
    pyramid: DualGraphPyramid,
    level: int,
    *,
    ax: Axes | None = None,
    removed: bool = True,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the step from a level to the next one: the paper's Fig. 2 for any map.

    Thick lines are contracted arcs: each is a spoke of a star, whose centre, a black dot, survives.
    Dashed arcs are redundant after that, and removed; thin ones are the arcs of the next level.
    Each colour is the field of one vertex of the next level, a reduction window. Where there are at
    most 40 arcs, each has its number in `pyramid[level].arcs`. Axes are in metres.

    Parameters
    ----------
    pyramid
        The pyramid.
    level
        Index of the lower of the two levels; negative ones count from the apex.
    ax
        Axes to draw on; by default new ones in a new figure. Leave room below for the legend.
    removed
        Whether to draw the removed arcs.
    title
        Title instead of the counts; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Raises
    ------
    IndexError
        When there is no such level, or none above it.
    InvalidValueError
        When the level has more than 20,000 vertices.

    Examples
    --------
    >>> from hybridnav.viz import plot_kernels
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0)
    >>> plot_kernels(pyramid, 2, title="level 2 to 3").get_title()
    'level 2 to 3'
    """
    lower = drawable(pyramid[level])
    upper = pyramid[lower.index + 1]
    canvas = Canvas.opened(ax, width_in, known_view(lower.grid))
    draw_ground(canvas, lower.grid, upper.field_of, Places(upper).colours(), style.PALE * 2)
    graph = Graph(lower, 0.0)
    kinds = _kinds(pyramid, lower.index, lower.n_arcs)
    if not removed:
        kinds[_REMOVED][:] = False
    curves = graph.curves(_CLEARANCE * canvas.sizes.line / canvas.sizes.points_per_metre)
    for label, (colour, width, dashes) in _STROKES.items():
        arcs = np.flatnonzero(kinds[label]).tolist()
        canvas.add_lines(
            [curves[arc] for arc in arcs if arc in curves],
            colors=colour,
            linewidths=width * canvas.sizes.line,
            linestyles=[dashes],
            zorder=3,
            gid=label.replace(" ", "-"),
        )
        if lower.n_arcs <= _NUMBERED_UP_TO:
            _number(canvas, {arc: curves[arc] for arc in arcs if arc in curves}, colour)
    cols = lower.grid.shape[1]
    survives = np.isin(lower.cells @ [cols, 1], upper.cells @ [cols, 1])
    _draw_dots(canvas, graph.positions, survives, lower.classes == CellClass.FREE)
    n_gone, n_removed = (int(kinds[label].sum()) for label in (_CONTRACTED, _REMOVED))
    words = [
        f"level {lower.index} to {upper.index}: {lower.n_vertices} to {upper.n_vertices} vertices",
        f"{n_gone} arcs contracted",
        *([f"{n_removed} removed"] if removed else []),
    ]
    entries = _entries(canvas, kinds, survives)
    finish_with_axes(canvas, entries, words if title is None else [title])
    return canvas.ax


def _number(canvas: Canvas, curves: Mapping[int, FloatArray], colour: str) -> None:
    """Write the number of each arc on the middle of its curve."""
    for arc, curve in curves.items():
        x, y = (curve[(len(curve) - 1) // 2] + curve[len(curve) // 2]) / 2
        canvas.ax.text(
            x,
            y,
            str(arc),
            fontsize=0.9 * canvas.sizes.font,
            color=colour,
            ha="center",
            va="center",
            bbox={"boxstyle": "round,pad=0.1", "fc": "white", "ec": "none"},
            zorder=5,
            gid="arc-number",
        )


def _kinds(pyramid: DualGraphPyramid, level: int, n_arcs: int) -> dict[str, BoolArray]:
    """Return the masks of the arcs of a level: contracted, removed, kept."""
    masks = {label: np.zeros(n_arcs, dtype=np.bool_) for label in _STROKES}
    masks[_CONTRACTED][pyramid.contraction_kernel(level)] = True
    masks[_REMOVED][pyramid.removal_kernel(level)] = True
    masks[_KEPT] = ~masks[_CONTRACTED] & ~masks[_REMOVED]
    return masks


def _draw_dots(canvas: Canvas, at: FloatArray, survives: BoolArray, free: BoolArray) -> None:
    for (label, (size, face)), mask in zip(_DOTS.items(), (survives, ~survives), strict=True):
        edges = [style.INK if is_free else style.UNEXPLORED_NODE for is_free in free[mask]]
        fill = edges if label == "surviving" else face
        canvas.add_dots(
            at[mask],
            size * canvas.sizes.line,
            c=fill,
            edgecolors=edges,
            linewidths=0.9 * canvas.sizes.line,
            zorder=4,
            gid=label.replace(" ", "-"),
        )


def _entries(canvas: Canvas, kinds: dict[str, BoolArray], survives: BoolArray) -> list[Entry]:
    line = canvas.sizes.line
    entries: list[Entry] = []
    for (label, (size, face)), mask in zip(_DOTS.items(), (survives, ~survives), strict=True):
        if mask.any():
            dot = Line2D([], [], ls="", marker="o", ms=size * line, mfc=face, mec=style.INK)
            entries.append((dot, f"{label} vertex"))
    for label, (colour, width, dashes) in reversed(_STROKES.items()):
        if kinds[label].any():
            entries.append((Line2D([], [], color=colour, lw=width * line, ls=dashes), label))
    return entries
