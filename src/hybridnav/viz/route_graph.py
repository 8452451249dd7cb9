"""Pictures of route graphs over their map."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from hybridnav.grid.runs import unique_rows
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, draw_cells, known_view
from hybridnav.viz.layout import finish
from hybridnav.viz.maps import ground_entries

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hybridnav.graphs import RouteGraph
    from hybridnav.viz.layout import Entry

_KINDS = {
    "cover": ("further nodes", style.ARC, "o", 1.6),
    "lane": ("lanes", style.SELF_LOOP, "o", 1.6),
    "bend": ("bends", style.PARALLEL, "o", 2.0),
    "place": ("places", style.INK, "o", 3.0),
    "room": ("rooms", style.PATH, "s", 4.0),
    "door": ("doors", style.HOLE, "D", 4.0),
}
"""Name, colour, mark and size in line widths of each kind of node, the least important first."""


def plot_route_graph(
    graph: RouteGraph,
    *,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the nodes and edges of a route graph over its map.

    Parameters
    ----------
    graph
        The graph.
    ax
        Axes to draw on; by default new ones in a new figure.
    title
        Title instead of the map's name and the counts; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    Axes
        The axes drawn on; `axes.figure` is the figure.

    Examples
    --------
    >>> from hybridnav.viz import plot_route_graph
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=12.0))
    >>> plot_route_graph(hn.build_route_graph(topology), title="graph").get_title()
    'graph'
    """
    grid = graph.grid
    canvas = Canvas.opened(ax, width_in, known_view(grid))
    classes = (style.BLOCKED, style.FREE, style.UNEXPLORED)
    draw_cells(canvas, grid, grid.classes, style.rgb(*classes))
    ends = np.sort(graph.edges, axis=1)
    ends = unique_rows(ends).rows
    line = canvas.sizes.line
    canvas.add_lines(graph.points[ends], colors=style.ARC, linewidths=0.35 * line, zorder=2)
    entries: list[Entry] = [(Line2D([], [], color=style.ARC, linewidth=0.5 * line), "edges")]
    kinds = np.array(graph.kinds)
    for kind, (name, colour, mark, size) in _KINDS.items():
        points = graph.points[kinds == kind]
        if not len(points):
            continue
        look: dict[str, Any] = {
            "color": colour,
            "marker": mark,
            "markersize": size * line,
            "linestyle": "none",
        }
        canvas.ax.plot(*points.T, markeredgewidth=0, zorder=3, **look)
        entries.append((Line2D([], [], **look), name))
    counts = [f"{graph.n_nodes:,} nodes", f"{graph.n_edges:,} edges"]
    words = [grid.name, *counts] if title is None else [title]
    finish(canvas, [*entries, *ground_entries(grid)], words)
    return canvas.ax
