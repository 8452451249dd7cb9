"""The picture of a graph that was checked: what is wrong is drawn where it is."""

from __future__ import annotations

from typing import Any

import networkx as nx
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb

import hybridnav as hn
from hybridnav.viz import plot_graph_check
from hybridnav.viz.style import PATH


def checked(points, edges):
    cells = np.zeros((20, 40), dtype=np.float32)
    cells[:15, 20] = 1.0
    grid = hn.OccupancyGrid(cells, robot_radius_m=0, name="hall")
    plain: nx.Graph[Any] = nx.Graph(name="drawn")
    for node, (x, y) in points.items():
        plain.add_node(node, x=x, y=y)
    plain.add_edges_from(edges)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=8.0))
    return hn.check_graph(topology, hn.WaypointGraph.from_networkx(plain))


def names(ax):
    return {text.get_text() for text in ax.get_legend().get_texts()}


def red_lines(ax):
    drawn = [one for one in ax.collections if isinstance(one, LineCollection)]
    return [
        line.tolist()
        for one in drawn
        if np.allclose(np.asarray(one.get_color())[0, :3], to_rgb(PATH))
        for line in one.get_segments()
    ]


def test_a_sound_graph_is_drawn_in_one_colour():
    ax = plot_graph_check(checked({"a": (5, 5), "b": (5, 15)}, [("a", "b")]))
    assert "nothing found" in ax.get_title()
    assert red_lines(ax) == []
    assert names(ax) == {"edges", "nodes", "occupied"}


def test_blocked_edges_and_nodes_are_drawn_where_they_are():
    points = {"a": (5, 5), "b": (35, 5), "c": (20.5, 5), "far": (48, 5), "lost": (5, 12)}
    ax = plot_graph_check(checked(points, [("a", "b"), ("a", "c"), ("b", "far")]))
    wanted = [[[5, 5], [20.5, 5]], [[5, 5], [35, 5]], [[35, 5], [48, 5]]]
    assert sorted(red_lines(ax)) == wanted
    assert names(ax) >= {
        "edges that the robot cannot follow",
        "nodes where the robot does not fit",
        "not connected",
    }
    marked = {tuple(point) for line in ax.lines for point in np.asarray(line.get_xydata()).tolist()}
    assert {(20.5, 5.0), (48.0, 5.0), (5.0, 12.0)} <= marked
    assert ax.get_xlim()[1] > 48
    assert "hall" in ax.get_title()
    assert plot_graph_check(checked(points, []), title="").get_title() == ""
