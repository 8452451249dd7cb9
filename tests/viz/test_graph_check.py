"""The picture of a graph that was checked: what is wrong is drawn where it is."""

from __future__ import annotations

import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import networkx as nx
import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.quiver import Quiver

import hybridnav as hn
from hybridnav.ext.graphs import plot_graph_check
from hybridnav.viz.style import PATH


def checked(points, edges, *, directed=False):
    cells = np.zeros((20, 40), dtype=np.float32)
    cells[:15, 20] = 1.0
    grid = hn.OccupancyGrid(cells, robot_radius_m=0, name="hall")
    plain: Any = nx.DiGraph(name="drawn") if directed else nx.Graph(name="drawn")
    for node, (x, y) in points.items():
        plain.add_node(node, x=x, y=y)
    plain.add_edges_from(edges)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=8.0))
    return hn.check_graph(topology, hn.WaypointGraph.from_networkx(plain))


def checked_links(nodes, links):
    whole = {"directed": True, "nodes": nodes, "links": links}
    grid = hn.OccupancyGrid(np.zeros((20, 40), np.float32), robot_radius_m=0, name="hall")
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=8.0))
    with TemporaryDirectory() as folder:
        path = Path(folder, "graph.json")
        path.write_text(json.dumps(whole))
        return hn.check_graph(topology, hn.load_graph(path))


def names(ax):
    return {text.get_text() for text in ax.get_legend().get_texts()}


def marks(ax):
    return {tuple(point) for line in ax.lines for point in np.asarray(line.get_xydata()).tolist()}


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
        "error: nodes outside the map",
        "error: nodes where the robot does not fit",
        "error: edges that the robot cannot follow",
        "warning: nodes without edges",
    }
    marked = marks(ax)
    assert {(20.5, 5.0), (48.0, 5.0), (5.0, 12.0)} <= marked
    assert {(12.75, 5.0), (20.0, 5.0), (41.5, 5.0)} <= marked  # the middles of blocked edges
    assert ax.get_xlim()[1] > 48
    assert "hall" in ax.get_title()
    assert plot_graph_check(checked(points, []), title="").get_title() == ""


def test_every_finding_is_marked_or_said_not_to_be_drawn():
    points = {"a": (5, 5), "b": (5, 15), "c": (5, 15), "d": (8, 15), "e": (9, 9)}
    edges = [("a", "b"), ("b", "a"), ("b", "c"), ("c", "b"), ("d", "d"), ("a", "gone")]
    nodes: list[Any] = [{"id": name, "x": x, "y": y} for name, (x, y) in points.items()]
    nodes += [{"id": "f", "x": 500, "y": 5}, {"id": "no"}]
    links: list[Any] = [{"source": tail, "target": head} for tail, head in edges]
    links[0]["cost"] = -1
    check = checked_links(nodes, links)
    ax = plot_graph_check(check)
    legend = {name.removesuffix(": not drawn") for name in names(ax)}
    for found in check.findings:
        assert f"{found.severity}: {found.text.partition(',')[0]}" in legend
    assert {name for name in names(ax) if name.endswith("not drawn")} == {
        "error: nodes without coordinates: not drawn"
    }
    marked = marks(ax)
    assert {(5.0, 10.0), (8.0, 15.0), (5.0, 15.0), (9.0, 9.0), (5.0, 5.0)} <= marked
    # A node far away is marked at the rim of the picture.
    right = ax.get_xlim()[1]
    assert any(right - 1.0 <= x <= right and y == 5.0 for x, y in marked)


def test_edges_that_lead_one_way_have_an_arrow_on_them():
    points = {"a": (5, 5), "b": (5, 15), "c": (15, 15)}
    edges = [("a", "b"), ("b", "c"), ("c", "b")]
    ax = plot_graph_check(checked(points, edges, directed=True))
    (arrows,) = [each for each in ax.collections if isinstance(each, Quiver)]
    assert np.asarray(arrows.get_offsets()).tolist() == [[5.0, 10.0]]
    assert np.asarray(arrows.U).tolist() == [0.0]
    assert (np.asarray(arrows.V) > 0).all()
    assert "edges that lead one way" in names(ax)
    both = plot_graph_check(checked(points, edges))
    assert not [each for each in both.collections if isinstance(each, Quiver)]
