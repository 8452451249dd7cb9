"""The source paper's Fig. 1 for any map: simple graph and dual graph side by side. Public:
`plot_figure1`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from hybridnav._base.typing import ByteArray
from hybridnav.errors import InvalidValueError
from hybridnav.pyramid import Level
from hybridnav.pyramid.graphs import FaceKind
from hybridnav.topology import TopologicalMap
from hybridnav.viz import style
from hybridnav.viz.boundaries import Boundaries
from hybridnav.viz.canvas import PAD_IN, Canvas, known_view
from hybridnav.viz.layout import Entry, add_legend, finish, frame_axes
from hybridnav.viz.places import Places, colour_vertices
from hybridnav.viz.style import Sizes
from hybridnav.viz.topology import (
    FAINT,
    LEAST_AREA_M2,
    Graph,
    draw_graph,
    draw_ground,
    drawable,
    graph_entries,
)

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


# Pictures of the dual graph: boundaries, and the points at which they meet.

_MARKERS = {
    FaceKind.ORDINARY: ("o", 4.2, style.INK, "meeting point or ring"),
    FaceKind.PROTECTED: ("D", 5.2, style.HOLE, "protected: a hole"),
    FaceKind.OUTSIDE: ("s", 5.8, style.OUTSIDE, "outside"),
}


def plot_dual(
    places: Level | TopologicalMap,
    *,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the dual graph over the pale fields of its vertices.

    A dual edge runs along the boundary of its arc; that of a self-loop crosses the place from the
    hole that the loop encloses. Dual vertices are meeting points of boundaries (dots), holes
    (diamonds) and the outside (squares); inside the occupied cells of a hole thin lines lead to its
    dual vertex.

    Parameters
    ----------
    places
        The topological map, or any level of a pyramid.
    ax
        Axes to draw on; by default new ones in a new figure. Leave room below for the legend.
    title
        Title instead of the map's name and the counts; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Raises
    ------
    InvalidValueError
        When the level has more than 20,000 vertices.

    Examples
    --------
    >>> from hybridnav.viz import plot_dual
    >>> pyramid = hn.DualGraphPyramid.build(hn.example_map("figure1"))
    >>> plot_dual(hn.TopologicalMap(pyramid), title="graph and dual").get_title()
    'graph and dual'
    """
    level = drawable(places)
    canvas = Canvas.opened(ax, width_in, known_view(level.grid))
    draw_ground(canvas, level.grid, level.field_of, Places(level).colours())
    draw_dual(canvas, level)
    counts = np.bincount(level.dual.kinds, minlength=len(FaceKind))
    words = [
        level.grid.name,
        f"dual graph: {level.n_arcs} edges",
        f"vertices: {counts[FaceKind.ORDINARY]} ordinary",
        f"{counts[FaceKind.PROTECTED]} protected",
        f"{counts[FaceKind.OUTSIDE]} outside",
    ]
    entries = dual_entries(level, canvas.sizes)
    return finish(canvas, entries, words if title is None else [title], framed=True)


def draw_dual(canvas: Canvas, level: Level) -> None:
    """Draw dual edges and dual vertices."""
    sizes, frame = canvas.sizes, level.grid.frame
    drawn = Boundaries(level)
    look = {"capstyle": "round", "joinstyle": "round", "zorder": 3}
    edges = map(frame.points_of_grid, drawn.lines)
    width = 1.3 * sizes.line
    canvas.add_lines(edges, colors=style.INK, linewidths=width, **look, gid="dual-edges")
    for kind in (FaceKind.PROTECTED, FaceKind.OUTSIDE):
        _, _, colour, _ = _MARKERS[kind]
        holes = [hole for face, hole in drawn.holes.items() if level.dual.kinds[face] == kind]
        links = [frame.points_of_grid(link) for hole in holes for link in hole.links]
        gid = f"{kind.name.lower()}-links"
        canvas.add_lines(links, colors=colour, linewidths=sizes.line, **look, gid=gid)
    for kind, (marker, size, colour, _) in _MARKERS.items():
        at = frame.points_of_grid(drawn.positions[level.dual.kinds == kind])
        if kind == FaceKind.OUTSIDE:  # may lie outside the visible part of the map
            at = np.clip(at, canvas.view.low, canvas.view.high)
        canvas.add_dots(
            at,
            size * sizes.line,
            c=colour,
            marker=marker,
            edgecolors=style.FREE,
            linewidths=0.5 * sizes.line,
            clip_on=kind != FaceKind.OUTSIDE,
            zorder=5,
            gid=f"{kind.name.lower()}-faces",
        )


def dual_entries(level: Level, sizes: Sizes) -> list[Entry]:
    """Return the legend entries for dual edges and dual vertices."""
    entries: list[Entry] = [
        (Line2D([], [], color=style.INK, lw=1.3 * sizes.line), "boundary (dual edge)")
    ]
    for kind, (marker, size, colour, label) in _MARKERS.items():
        if (level.dual.kinds == kind).any():
            dot = Line2D([], [], ls="", marker=marker, ms=size * sizes.line, color=colour)
            dot.set_markeredgecolor("none")
            entries.append((dot, label))
    return entries
