"""Levels of a pyramid side by side: fields that grow, and the graph over them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from matplotlib.figure import Figure

from hybridnav.errors import InvalidValueError
from hybridnav.viz import style
from hybridnav.viz.canvas import PAD_IN, Canvas, known_view
from hybridnav.viz.layout import add_title, frame_axes, wrapped
from hybridnav.viz.places import Places
from hybridnav.viz.topology import Graph, draw_graph, draw_ground

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from hybridnav.pyramid import DualGraphPyramid, Level

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
        axes = _panels(chosen, columns, width_in)
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


def _panels(levels: Sequence[Level], columns: int, width_in: float) -> list[Axes]:
    """Return axes in rows, of the shape of the map, in a new figure with room for their titles."""
    view = known_view(levels[0].grid)
    rows = math.ceil(len(levels) / columns)
    panel_in = (width_in - (columns - 1) * _GAP_IN - 2 * PAD_IN) / columns
    tall_in = panel_in * float(view.size[1] / view.size[0])
    font = style.Sizes.fitting(panel_in, 1.0).font
    room = 72 * (panel_in - 2 * PAD_IN)
    lines = max(wrapped(_words(level), font, room).count("\n") + 1 for level in levels)
    row_in = tall_in + (0.6 + 1.4 * lines) * font / 72
    height_in = rows * row_in + (rows - 1) * _GAP_IN + 2 * PAD_IN
    figure = Figure(figsize=(width_in, height_in))
    axes = []
    for number in range(len(levels)):
        row, col = divmod(number, columns)
        left_in = PAD_IN + col * (panel_in + _GAP_IN)
        bottom_in = height_in - PAD_IN - (row + 1) * row_in - row * _GAP_IN
        box = left_in / width_in, bottom_in / height_in, panel_in / width_in, tall_in / height_in
        axes.append(figure.add_axes(box))
    return axes
