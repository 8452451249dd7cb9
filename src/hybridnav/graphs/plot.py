"""The picture of a graph that others have made, with what is wrong with it."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from hybridnav._base.rows import unique_rows
from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.graphs import GraphCheck, RouteGraph
from hybridnav.maps import OccupancyGrid
from hybridnav.viz import style
from hybridnav.viz.canvas import Canvas, View, draw_classes, draw_shades, known_view
from hybridnav.viz.layout import Entry, finish
from hybridnav.viz.maps import ground_entries

_COLOURS = {"error": style.PATH, "warning": style.HOLE, "note": style.PARALLEL}
_MARKS = "sD^vo<>phP"
"""Marks of the kinds of findings, again from the first where there are more."""
_SMALLEST, _LARGER, _LARGEST = 4.0, 0.8, 9.0
"""Size of the first mark, and how much larger the next are, up to a limit, in line widths: marks at
one point are all seen."""
_MARGIN_M = 0.5
_SHADE = 96
"""Opacity of keepout zones, of 255."""


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

    Examples
    --------
    >>> import networkx as nx
    >>> from hybridnav.graphs import WaypointGraph, check_graph, plot_graph_check
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> plain = nx.Graph()
    >>> plain.add_node("a", x=2.5, y=5.0)
    >>> plain.add_node("b", x=30.0, y=5.0)
    >>> plain.add_edge("a", "b")
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=12.0))
    >>> check = check_graph(topology, WaypointGraph.from_networkx(plain))
    >>> plot_graph_check(check, title="checked").get_title()
    'checked'
    """
    grid, graph = check.grid, check.graph
    view = known_view(grid).holding(graph.points, _MARGIN_M)
    canvas = _opened(ax, width_in, view, grid)
    line = canvas.sizes.line
    entries: list[Entry] = []
    for chosen, name, colour, width in (
        (check.is_clear, "edges", style.ARC, 0.5),
        (~check.is_clear, "edges that the robot cannot follow", style.PATH, 0.9),
    ):
        bent = graph.lines if check.along_lines else {}
        straight = chosen.copy()
        straight[list(bent)] = False
        ends = unique_rows(np.sort(graph.edges[straight], axis=1)).rows
        drawn = [*graph.points[ends], *(bent[edge] for edge in bent if chosen[edge])]
        if drawn:
            look: dict[str, Any] = {"color": colour, "linewidth": width * line}
            canvas.add_lines(drawn, colors=colour, linewidths=width * line, zorder=2)
            entries.append((Line2D([], [], **look), name))
    entries += _draw_arrows(canvas, check, line)
    entries += _draw_nodes(canvas, graph.points[check.is_free], ("nodes", style.INK, "o", 2.2))
    entries += _draw_findings(canvas, check, line)
    what = f"{check.count:,} findings" if check.findings else "nothing found"
    counts = [f"{graph.n_nodes:,} nodes", f"{graph.n_edges:,} edges", what]
    words = [f"{graph.name} on {grid.name}", *counts] if title is None else [title]
    finish(canvas, [*entries, *ground_entries(grid)], words)
    return canvas.ax


def _opened(ax: Axes | None, width_in: float, view: View, grid: OccupancyGrid) -> Canvas:
    canvas = Canvas.opened(ax, width_in, view)
    draw_classes(canvas, grid)
    return canvas


def _draw_nodes(
    canvas: Canvas, points: FloatArray, look: tuple[str, str, str, float]
) -> list[Entry]:
    """Draw nodes by their name, colour, mark and size in line widths; return their entry."""
    name, colour, mark, size = look
    if not len(points):
        return []
    marks: dict[str, Any] = {"color": colour, "marker": mark, "linestyle": "none"}
    marks["markersize"] = size * canvas.sizes.line
    canvas.ax.plot(*points.T, markeredgewidth=0, zorder=3, **marks)
    return [(Line2D([], [], **marks), name)]


def _draw_arrows(canvas: Canvas, check: GraphCheck, line: float) -> list[Entry]:
    graph = check.graph
    both = set(map(tuple, graph.edges.tolist()))
    bent = graph.lines if check.along_lines else {}
    lines = [
        bent.get(edge, graph.points[[tail, head]])
        for edge, (tail, head) in enumerate(graph.edges.tolist())
        if tail != head and (head, tail) not in both
    ]
    if not lines:
        return []
    # In the middle of the edge, on polylines of the segment there.
    at = np.array([each[(len(each) - 2) // 2 : (len(each) - 2) // 2 + 2] for each in lines])
    look: dict[str, Any] = {"color": style.INK}
    canvas.add_arrows(at.mean(axis=1), at[:, 1] - at[:, 0], zorder=3.5, **look)
    mark = Line2D([], [], marker=">", linestyle="none", markersize=5.0 * line, **look)
    return [(mark, "edges that lead one way")]


def _draw_findings(canvas: Canvas, check: GraphCheck, line: float) -> list[Entry]:
    """Mark each finding: at its point, or in the middle of its edge."""
    entries: list[Entry] = []
    # What lies far outside is marked at the rim.
    low, high = canvas.view.low + _MARGIN_M, canvas.view.high - _MARGIN_M
    for number, found in enumerate(check.findings):
        points = [
            np.clip(np.mean(each.points, axis=0), low, high)
            for each in found.examples
            if each.points
        ]
        look: dict[str, Any] = {
            "color": _COLOURS[found.severity],
            "marker": _MARKS[number % len(_MARKS)],
            "markersize": min(_SMALLEST + number * _LARGER, _LARGEST) * line,
            "markerfacecolor": "none",
            "markeredgewidth": 1.1 * line,
            "linestyle": "none",
        }
        name = found.text.partition(",")[0]
        if points:
            canvas.ax.plot(*np.array(points).T, zorder=4, **look)
        else:
            name, look["marker"] = f"{name}: not drawn", "None"
        entries.append((Line2D([], [], **look), f"{found.severity}: {name}"))
    return entries


# Pictures of route graphs over their map.

_KINDS = {
    "lane": ("lanes", style.SELF_LOOP, "o", 1.6),
    "bend": ("bends", style.PARALLEL, "o", 2.0),
    "end": ("ends", style.PARALLEL, "s", 3.0),
    "crossing": ("crossings", style.INK, "o", 3.0),
    "room": ("rooms", style.PATH, "s", 4.0),
    "door": ("doors", style.HOLE, "D", 4.0),
}
"""Name, colour, mark and size in line widths of each kind of node, the least important first."""


def plot_route_graph(
    graph: RouteGraph,
    *,
    keepout: BoolArray | None = None,
    ax: Axes | None = None,
    title: str | None = None,
    width_in: float = style.FULL_WIDTH_IN,
) -> Axes:
    """Draw the nodes and edges of a route graph over its map.

    Parameters
    ----------
    graph
        The graph.
    keepout
        bool (rows, cols), cells of keepout zones; None for none.
    ax
        Axes to draw on; by default new ones in a new figure.
    title
        Title instead of the map's name and the counts; empty for none.
    width_in
        Width of a new figure in inches; its height follows.

    Examples
    --------
    >>> from hybridnav.graphs import build_lane_graph, plot_route_graph
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=12.0))
    >>> plot_route_graph(build_lane_graph(topology), title="graph").get_title()
    'graph'
    """
    grid = graph.grid
    canvas = _opened(ax, width_in, known_view(grid), grid)
    ends = unique_rows(np.sort(graph.edges, axis=1)).rows
    line = canvas.sizes.line
    canvas.add_lines(graph.points[ends], colors=style.ARC, linewidths=0.35 * line, zorder=2)
    entries: list[Entry] = [(Line2D([], [], color=style.ARC, linewidth=0.5 * line), "edges")]
    if keepout is not None and keepout.any():
        shades = np.zeros((*keepout.shape, 4), dtype=np.uint8)
        shades[keepout] = np.append(style.rgb(style.HOLE)[0], _SHADE)
        draw_shades(canvas, grid, shades, gid="keepout")
        entries.append((Patch(fc=style.HOLE, alpha=_SHADE / 255), "keepout zones"))
    kinds = np.array(graph.kinds)
    for kind, look in _KINDS.items():
        entries += _draw_nodes(canvas, graph.points[kinds == kind], look)
    counts = [f"{graph.n_nodes:,} nodes", f"{graph.n_edges:,} edges"]
    words = [grid.name, *counts] if title is None else [title]
    finish(canvas, [*entries, *ground_entries(grid)], words)
    return canvas.ax
