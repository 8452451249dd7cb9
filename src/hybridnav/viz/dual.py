"""Pictures of the dual graph: boundaries, and the points at which they meet."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.lines import Line2D

from hybridnav.pyramid.dual import FaceKind
from hybridnav.viz import style
from hybridnav.viz.boundaries import Boundaries
from hybridnav.viz.canvas import Canvas, known_view
from hybridnav.viz.layout import finish
from hybridnav.viz.places import Places
from hybridnav.viz.topology import draw_ground, drawable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hybridnav.pyramid import Level
    from hybridnav.topology import TopologicalMap
    from hybridnav.viz.layout import Entry
    from hybridnav.viz.style import Sizes

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

    Returns
    -------
    Axes
        The axes drawn on; `axes.figure` is the figure.

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
    ax, sizes, frame = canvas.ax, canvas.sizes, level.grid.frame
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
        ax.scatter(
            at[:, 0],
            at[:, 1],
            s=(size * sizes.line) ** 2,
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
