"""The source paper's Fig. 1 for any map: simple graph and dual graph side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.figure import Figure

from hybridnav.errors import InvalidValueError
from hybridnav.viz import style
from hybridnav.viz.canvas import PAD_IN, Canvas, known_view
from hybridnav.viz.colouring import colour_vertices
from hybridnav.viz.dual import draw_dual, dual_entries
from hybridnav.viz.layout import add_legend, frame_axes
from hybridnav.viz.topology import (
    FAINT,
    LEAST_AREA_M2,
    Graph,
    draw_graph,
    draw_ground,
    drawable,
    graph_entries,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes

    from hybridnav._typing import ByteArray
    from hybridnav.pyramid import Level
    from hybridnav.topology import TopologicalMap

_TITLES = ("a) places", "b) simple graph", "c) dual graph pyramid, top", "d) its dual")
_GAP_IN = 0.12


def plot_figure1(
    places: Level | TopologicalMap,
    *,
    axes: Sequence[Axes] | None = None,
    least_area_m2: float = LEAST_AREA_M2,
    width_in: float = style.FULL_WIDTH_IN,
) -> tuple[Axes, ...]:
    """Draw places, their simple graph, the top of the dual graph pyramid, and its dual.

    Parameters
    ----------
    places
        The topological map, or any level of a pyramid; both free and unexplored places have the
        colours of surfaces.
    axes
        Four axes to draw on; by default new ones in a new figure. Leave room below the last two for
        their legends.
    least_area_m2
        Places under this area in square metres, their arcs, and self-loops round less than it are
        left out of the two graphs.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    tuple of Axes
        The four axes drawn on; `axes[0].figure` is the figure.

    Raises
    ------
    InvalidValueError
        When the level has more than 20,000 vertices, or there are not four axes.

    Examples
    --------
    >>> from hybridnav.viz import plot_figure1
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"))
    >>> len(plot_figure1(hn.TopologicalMap(pyramid)))
    4
    """
    level = drawable(places)
    if axes is None:
        canvases = _panels(level, width_in)
    elif len(axes) == len(_TITLES):
        canvases = [Canvas.opened(ax, width_in, known_view(level.grid)) for ax in axes]
    else:
        raise InvalidValueError(f"Fig. 1 has {len(_TITLES)} panels, got {len(axes)} axes")
    graph, colours = Graph(level, least_area_m2), _surfaces(level)
    for canvas, title in zip(canvases, _TITLES, strict=True):
        share = 1.0 if canvas is canvases[0] else FAINT
        draw_ground(canvas, level.grid, level.field_of, colours, share)
        frame_axes(canvas)
        font = canvas.sizes.font
        canvas.ax.set_title(title, fontsize=font, pad=0.5 * font, color=style.INK, loc="left")
    draw_graph(canvases[1], graph, simple=True)
    draw_graph(canvases[2], graph, simple=False)
    draw_dual(canvases[3], level)
    sizes = canvases[2].sizes
    entries = (graph_entries(graph, sizes, simple=False), dual_entries(level, sizes))
    legends = [
        add_legend(canvas, own, bar=0, below=0.4 * sizes.font)
        for canvas, own in zip(canvases[2:], entries, strict=True)
    ]
    if axes is None:
        figure = canvases[0].ax.figure.figure
        figure.draw_without_rendering()
        lowest = min(legend.get_window_extent().y0 for legend in legends)
        below = float(canvases[2].ax.get_window_extent().y0 - lowest) / figure.dpi
        _arrange(figure, canvases, below + PAD_IN)
    return tuple(canvas.ax for canvas in canvases)


def _panels(level: Level, width_in: float) -> list[Canvas]:
    """Return two rows of two panels in a new figure, of the shape of the map."""
    figure = Figure(figsize=(width_in, width_in))
    view = known_view(level.grid)
    share = (width_in - 3 * _GAP_IN) / 2 / width_in
    canvases = []
    for _ in _TITLES:
        ax = figure.add_axes((0.0, 0.0, share, share))
        canvases.append(Canvas.opened(ax, width_in, view))
    _arrange(figure, canvases, 0.0)
    return canvases


def _arrange(figure: Figure, canvases: Sequence[Canvas], below_in: float) -> None:
    """Put the panels side by side, with room for titles, and for legends below."""
    width = float(figure.get_size_inches()[0])
    panel = (width - 3 * _GAP_IN) / 2
    tall = panel * float(canvases[0].view.size[1] / canvases[0].view.size[0])
    title = 2.0 * canvases[0].sizes.font / 72
    height = 2 * (tall + title) + _GAP_IN + below_in
    figure.set_size_inches(width, height)
    for number, canvas in enumerate(canvases):
        row, col = divmod(number, 2)
        left = _GAP_IN + col * (panel + _GAP_IN)
        bottom = height - (row + 1) * (tall + title) - row * _GAP_IN
        canvas.ax.set_position((left / width, bottom / height, panel / width, tall / height))


def _surfaces(level: Level) -> ByteArray:
    """Return the colours of all vertices, and one for cells without a vertex."""
    index = np.arange(level.n_vertices)
    if level.n_vertices > len(style.PLACES):
        index = colour_vertices(level.arcs, level.n_vertices)
    return np.concatenate([style.rgb(*style.PLACES)[index], style.rgb(style.BLOCKED)])
