"""The picture of a graph that others have made, with what is wrong with it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, draw_cells, known_view
from hybridnav.viz.layout import finish
from hybridnav.viz.maps import ground_entries

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from hybridnav.graphs import GraphCheck
    from hybridnav.viz.layout import Entry

_BAD_NODES = ("node-outside", "node-in-wall", "node-unexplored")
_MARKS = (
    (("alone", "components", "one-way"), "not connected", style.PARALLEL, "o"),
    (("missing-door",), "doors that no edge passes", style.HOLE, "D"),
    (("missing-room", "missing-part"), "rooms and parts without nodes", style.OUTSIDE, "^"),
    (_BAD_NODES, "nodes where the robot does not fit", style.PATH, "s"),
)
"""Kinds of findings, their name, colour and mark, the least important first."""
_MARGIN_M = 0.5


def plot_graph_check(
    check: GraphCheck,
    *,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw a graph over its map, and where something is wrong.

    Parameters
    ----------
    check
        The graph, its map, and the findings; up to 1,000 of a kind are drawn.
    ax
        Axes to draw on; by default new ones in a new figure.
    title
        Title instead of the names and counts; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Returns
    -------
    Axes
        The axes drawn on; `axes.figure` is the figure.

    Examples
    --------
    >>> import networkx as nx
    >>> from hybridnav.viz import plot_graph_check
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> plain = nx.Graph()
    >>> plain.add_node("a", x=2.5, y=5.0)
    >>> plain.add_node("b", x=30.0, y=5.0)
    >>> plain.add_edge("a", "b")
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=12.0))
    >>> check = hn.check_graph(topology, hn.WaypointGraph.from_networkx(plain))
    >>> plot_graph_check(check, title="checked").get_title()
    'checked'
    """
    grid, graph = check.grid, check.graph
    view = known_view(grid).holding(graph.points, _MARGIN_M)
    canvas = Canvas.opened(ax, width_in, view)
    draw_cells(
        canvas,
        grid,
        grid.classes,
        style.rgb(style.BLOCKED, style.FREE, style.UNEXPLORED),
    )
    line = canvas.sizes.line
    entries: list[Entry] = []
    for chosen, name, colour, width in (
        (check.is_clear, "edges", style.ARC, 0.5),
        (~check.is_clear, "edges that the robot cannot follow", style.PATH, 0.9),
    ):
        bent = graph.lines if check.along_lines else {}
        straight = chosen.copy()
        straight[list(bent)] = False
        ends = np.unique(np.sort(graph.edges[straight], axis=1), axis=0)
        drawn = [*graph.points[ends], *(bent[edge] for edge in bent if chosen[edge])]
        if drawn:
            look: dict[str, Any] = {"color": colour, "linewidth": width * line}
            canvas.add_lines(drawn, colors=colour, linewidths=width * line, zorder=2)
            entries.append((Line2D([], [], **look), name))
    entries += _draw_nodes(canvas, check, line)
    what = f"{check.count:,} findings" if check.findings else "nothing found"
    counts = [f"{graph.n_nodes:,} nodes", f"{graph.n_edges:,} edges", what]
    words = [f"{graph.name} on {grid.name}", *counts] if title is None else [title]
    finish(canvas, [*entries, *ground_entries(grid)], words)
    return canvas.ax


def _draw_nodes(canvas: Canvas, check: GraphCheck, line: float) -> list[Entry]:
    """Draw the nodes, and the findings that lie at points."""
    entries: list[Entry] = []

    def draw(points: Any, name: str, **look: Any) -> None:
        look |= {"linestyle": "none"}
        canvas.ax.plot(*np.reshape(points, (-1, 2)).T, markeredgewidth=0, **look)
        entries.append((Line2D([], [], **look), name))

    sound = check.graph.points[check.is_free]
    if len(sound):
        draw(sound, "nodes", color=style.INK, marker="o", markersize=2.2 * line, zorder=3)
    examples = {found.kind: found.examples for found in check.findings}
    for kinds, name, colour, mark in _MARKS:
        points = [each.points[0] for kind in kinds for each in examples.get(kind, ())]
        if points:
            draw(points, name, color=colour, marker=mark, markersize=4.0 * line, zorder=4)
    return entries
