"""Lanes that keep to the right where two robots fit side by side, and checks of edges that bend."""

import math
from dataclasses import replace
from itertools import permutations

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.graphs import plot_graph_check
from hybridnav.harness.judges import segment_faults
from tests.drawn_rooms import HOUSE, SIDE, topology_of
from tests.nav2_reader import read_nav2
from tests.strategies import class_grids, occupancy_grid, tried

APART = 1.0


def lanes_of(graph):
    """For each edge between two lane nodes: the nodes before and after, and its own two."""
    kinds = np.array(graph.kinds)
    before: dict[int, list[int]] = {}
    after: dict[int, list[int]] = {}
    for tail, head in graph.edges.tolist():
        if kinds[head] == "lane" != kinds[tail]:
            before.setdefault(head, []).append(tail)
        if kinds[tail] == "lane" != kinds[head]:
            after.setdefault(tail, []).append(head)
    return [
        (before[tail], tail, head, after[head])
        for tail, head in graph.edges.tolist()
        if kinds[tail] == kinds[head] == "lane"
    ]


@pytest.mark.parametrize("yaw_rad", [0.0, 0.7])
def test_lanes_run_on_the_right_of_their_edge_and_apart(yaw_rad):
    here = topology_of(HOUSE, origin_m=(3.0, -2.0), yaw_rad=yaw_rad)
    plain = hn.graphs.build_lane_graph(here)
    graph = hn.graphs.keep_right(here, plain, apart_m=APART)
    straight = set(map(tuple, plain.edges.tolist()))
    points = graph.points
    found = lanes_of(graph)
    assert len(found) > 1
    middles = {}
    for tails, one, other, heads in found:
        # Where lanes meet in a node, the edge is the one that this lane runs along.
        edges = [(a, b) for a in tails for b in heads if (a, b) in straight]
        lane = points[other] - points[one]
        (tail, head), *_ = [
            (a, b)
            for a, b in edges
            if abs(_cross(_unit(points[b] - points[a]), _unit(lane))) < 1e-6
        ]
        step = points[head] - points[tail]
        for node in (one, other):
            assert _cross(step, points[node] - points[tail]) < 0  # on the right, y up
            line = shapely.LineString([points[tail], points[head]])
            away = line.distance(shapely.Point(points[node])) - APART / 2
            assert -1e-6 <= away <= SIDE / 64 + 1e-6  # off the sides of cells, never nearer
        middles[tail, head] = shapely.LineString([points[one], points[other]])
    for (tail, head), lane in middles.items():
        assert -1e-6 <= lane.distance(middles[head, tail]) - APART <= SIDE / 32 + 1e-6


def _cross(one, other):
    return one[0] * other[1] - one[1] * other[0]


def _unit(step):
    return step / math.hypot(*step)


@tried(60, class_grids(20), st.sampled_from([0.5, 1.0, 2.0]))
def test_lanes_are_free_and_cut_nothing(classes, apart_m):
    if not (classes == hn.CellClass.FREE).any():
        return
    grid = occupancy_grid(classes)
    here = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    plain = hn.graphs.build_lane_graph(here)
    graph = hn.graphs.keep_right(here, plain, apart_m=apart_m)
    assert np.array_equal(graph.points[: plain.n_nodes], plain.points)
    for edge in graph.edges.tolist():
        assert segment_faults(grid, graph.points[edge]) == ()
    directed = graph.to_networkx()
    parts = [part & set(range(plain.n_nodes)) for part in nx.connected_components(
        plain.to_networkx().to_undirected())]  # fmt: skip
    strong = [part & set(range(plain.n_nodes)) for part in
              nx.strongly_connected_components(directed)]  # fmt: skip
    assert sorted(map(sorted, parts)) == sorted(sorted(part) for part in strong if part)
    keys = graph.edges[:, 0] * graph.n_nodes + graph.edges[:, 1]
    assert len(np.unique(keys)) == len(keys)
    found = hn.graphs.check_graph(here, hn.graphs.WaypointGraph.from_networkx(_with_points(graph)))
    # Where free space has several parts, so has the graph.
    assert {one.kind for one in found.findings} <= {"same-point", "island", "missing-part"}


def _with_points(graph):
    plain: nx.DiGraph[int] = nx.DiGraph()
    for node, (x, y) in enumerate(graph.points.tolist()):
        plain.add_node(node, x=x, y=y)
    plain.add_edges_from(graph.edges.tolist())
    return plain


def test_a_corridor_too_narrow_for_two_has_no_lanes_and_a_wide_one_has():
    for width, fits in ((9, False), (16, True)):
        cells = np.ones((width + 2, 120), dtype=np.float32)
        cells[1:-1, 1:-1] = 0.0
        grid = hn.OccupancyGrid(cells, hn.Frame(0.1), robot_radius_m=0.3)
        here = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=4.0))
        graph = hn.graphs.build_lane_graph(here, spacing_m=2.0)
        graph = hn.graphs.keep_right(here, graph, apart_m=0.8)
        assert ("lane" in graph.kinds) == fits
        assert graph.is_lane.any() == fits


def test_lanes_are_marked_in_the_file(tmp_path):
    here = topology_of(HOUSE)
    graph = hn.graphs.keep_right(here, hn.graphs.build_lane_graph(here), apart_m=APART)
    hn.graphs.export_nav2(graph, tmp_path / "lanes.geojson")
    read = read_nav2(tmp_path / "lanes.geojson")
    assert len(read.parts()) == 1
    lanes = {n for n, facts in read.node_facts.items() if facts["class"] == "lane"}
    for number, ends in read.edges.items():
        assert (read.edge_facts[number].get("lane") == "right") == bool(lanes & set(ends))


@pytest.mark.parametrize("apart_m", [0, -1, math.nan, math.inf, 0.59, "wide"])
def test_distances_out_of_range_are_refused(apart_m):
    grid = hn.OccupancyGrid(np.zeros((20, 40), np.float32), hn.Frame(0.1), robot_radius_m=0.3)
    here = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0))
    graph = hn.graphs.build_lane_graph(here)
    with pytest.raises(hn.errors.InvalidValueError, match="apart_m"):
        hn.graphs.keep_right(here, graph, apart_m=apart_m)
    with pytest.raises(hn.errors.InvalidValueError, match="built from this topology"):
        hn.graphs.keep_right(topology_of(HOUSE), graph, apart_m=0.8)


def test_the_check_follows_lines_where_robots_do():
    here = topology_of(HOUSE)
    # From room to room along the shortest routes, as files with lines of edges have them.
    full = hn.graphs.build_lane_graph(here)
    network, points = full.to_networkx(), full.points
    ends = [node for node, kind in enumerate(full.kinds) if kind == "room"]
    plain: nx.DiGraph[int] = nx.DiGraph()
    for node in ends:
        plain.add_node(node, x=points[node, 0], y=points[node, 1])
    plain.add_edges_from(permutations(ends, 2))
    bent = hn.graphs.WaypointGraph.from_networkx(plain)
    routes = [
        nx.shortest_path(network, ends[tail], ends[head], weight="length_m")
        for tail, head in bent.edges.tolist()
    ]
    bent = replace(bent, lines={edge: points[route] for edge, route in enumerate(routes)})
    along = hn.graphs.check_graph(here, bent, along_lines=True)
    assert along.findings == ()
    assert along.doors == (6, 6)
    assert along.is_clear.all()
    straight = hn.graphs.check_graph(here, bent)
    for edge, ends in enumerate(bent.edges.tolist()):
        assert straight.is_clear[edge] == (not segment_faults(here.grid, bent.points[ends]))
    assert not straight.is_clear.all()
    # A line through a wall is found, although its nodes see each other.
    clear = [edge for edge in range(bent.n_edges) if straight.is_clear[edge]]
    tail, head = bent.points[bent.edges[clear[0]]]
    lines = bent.lines | {clear[0]: np.array([tail, [0.25, 0.25], head])}
    wrong = hn.graphs.check_graph(here, replace(bent, lines=lines), along_lines=True)
    assert np.flatnonzero(~wrong.is_clear).tolist() == [clear[0]]
    assert [(one.kind, one.count) for one in wrong.findings] == [("edge-through-wall", 1)]
    lines[clear[0]] = np.array([tail, [-500.0, 0.25], head])
    wrong = hn.graphs.check_graph(here, replace(bent, lines=lines), along_lines=True)
    assert np.flatnonzero(~wrong.is_clear).tolist() == [clear[0]]
    drawn = plot_graph_check(along)
    shown = [line for one in drawn.collections for line in getattr(one, "get_segments", list)()]
    assert max(map(len, shown)) > 2
