"""Lanes that keep to the right where two robots fit side by side, and edges that bend."""

import math
from dataclasses import replace

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.graphs import plot_graph_check
from hybridnav.harness.judges import segment_faults
from tests.drawn_rooms import HOUSE, SIDE, topology_of
from tests.nav2_reader import read_nav2
from tests.strategies import class_grids, examples, occupancy_grid

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
    plain = hn.ext.graphs.build_route_graph(here, stretch=1.02)
    graph = hn.ext.graphs.keep_right(here, plain, apart_m=APART)
    straight = set(map(tuple, plain.edges.tolist()))
    points = graph.points
    found = lanes_of(graph)
    assert len(found) > 50
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


@given(class_grids(20), st.sampled_from([0.5, 1.0, 2.0]))
@settings(max_examples=examples(60))
def test_lanes_are_free_and_cut_nothing(classes, apart_m):
    if not (classes == hn.CellClass.FREE).any():
        return
    grid = occupancy_grid(classes)
    here = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    plain = hn.ext.graphs.build_route_graph(here)
    graph = hn.ext.graphs.keep_right(here, plain, apart_m=apart_m)
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
    found = hn.ext.graphs.check_graph(
        here, hn.ext.graphs.WaypointGraph.from_networkx(_with_points(graph))
    )
    assert {one.kind for one in found.findings} <= {"same-point"}


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
        graph = hn.ext.graphs.build_route_graph(here, spacing_m=2.0)
        graph = hn.ext.graphs.keep_right(here, graph, apart_m=0.8)
        assert ("lane" in graph.kinds) == fits
        assert graph.is_lane.any() == fits


def test_lanes_are_marked_in_the_file(tmp_path):
    here = topology_of(HOUSE)
    graph = hn.ext.graphs.keep_right(here, hn.ext.graphs.build_route_graph(here), apart_m=APART)
    hn.ext.graphs.export_nav2(graph, tmp_path / "lanes.geojson")
    read = read_nav2(tmp_path / "lanes.geojson")
    assert len(read.parts()) == 1
    lanes = {n for n, facts in read.node_facts.items() if facts["class"] == "lane"}
    for number, ends in read.edges.items():
        assert (read.edge_facts[number].get("lane") == "right") == bool(lanes & set(ends))


@pytest.mark.parametrize("apart_m", [0, -1, math.nan, math.inf, 0.59, "wide"])
def test_distances_out_of_range_are_refused(apart_m):
    grid = hn.OccupancyGrid(np.zeros((20, 40), np.float32), hn.Frame(0.1), robot_radius_m=0.3)
    here = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0))
    graph = hn.ext.graphs.build_route_graph(here)
    with pytest.raises(hn.errors.InvalidValueError, match="apart_m"):
        hn.ext.graphs.keep_right(here, graph, apart_m=apart_m)
    with pytest.raises(hn.errors.InvalidValueError, match="built from this topology"):
        hn.ext.graphs.keep_right(topology_of(HOUSE), graph, apart_m=0.8)


KEPT = {"room", "door", "place"}


@given(class_grids(20))
@settings(max_examples=examples(60))
def test_polylines_are_free_and_connect_what_was_connected(classes):
    if not (classes == hn.CellClass.FREE).any():
        return
    grid = occupancy_grid(classes)
    graph = hn.ext.graphs.build_route_graph(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    bent = hn.ext.graphs.merge_bends(graph)
    kept = [node for node, kind in enumerate(graph.kinds) if kind in KEPT]
    assert np.array_equal(bent.points, graph.points[kept])
    full: nx.Graph[int] = graph.to_networkx().to_undirected()
    for edge, (tail, head) in enumerate(bent.edges.tolist()):
        line = bent.lines.get(edge, bent.points[[tail, head]])
        assert np.array_equal(line[[0, -1]], bent.points[[tail, head]])
        assert segment_faults(grid, line) == ()
        length_m = np.hypot(*np.diff(line, axis=0).T).sum()
        assert bent.costs[edge] == pytest.approx(length_m)
        shortest = nx.shortest_path_length(full, kept[tail], kept[head], weight="length_m")
        assert bent.costs[edge] == pytest.approx(shortest)
    pairs = set(map(tuple, bent.edges.tolist()))
    assert {(head, tail) for tail, head in pairs} == pairs
    joined: nx.Graph[int] = nx.Graph()
    joined.add_nodes_from(range(len(kept)))
    joined.add_edges_from(pairs)
    index = {node: at for at, node in enumerate(kept)}
    before = [{index[n] for n in part if n in index} for part in nx.connected_components(full)]
    after = list(nx.connected_components(joined))
    assert sorted(map(sorted, filter(None, before))) == sorted(map(sorted, after))


@pytest.mark.parametrize("stretch", [1.0, 1.05, 1.5])
def test_routes_between_kept_nodes_stay_nearly_as_short(stretch):
    graph = hn.ext.graphs.build_route_graph(topology_of(HOUSE))
    bent = hn.ext.graphs.merge_bends(graph, stretch=stretch)
    kept = [node for node, kind in enumerate(graph.kinds) if kind in KEPT]
    full = graph.to_networkx()
    few: nx.DiGraph[int] = nx.DiGraph()
    for (tail, head), cost in zip(bent.edges.tolist(), bent.costs.tolist(), strict=True):
        few.add_edge(tail, head, length_m=cost)
    lengths = dict(nx.all_pairs_dijkstra_path_length(few, weight="length_m"))
    ratios = []
    for a, node in enumerate(kept):
        shortest = nx.single_source_dijkstra_path_length(full, node, weight="length_m")
        ratios += [lengths[a][b] / shortest[kept[b]] for b in range(len(kept)) if a != b]
    assert min(ratios) >= 1 - 1e-9
    assert max(ratios) <= stretch + 1e-6


@pytest.mark.parametrize("stretch", [1.0, 1.05])
def test_no_polyline_is_one_too_many(stretch):
    bent = hn.ext.graphs.merge_bends(
        hn.ext.graphs.build_route_graph(topology_of(HOUSE)), stretch=stretch
    )
    pairs = {tuple(sorted(pair)) for pair in bent.edges.tolist()}
    # Where polylines of three nodes make one way, no fourth one goes along it.
    costs = dict(zip(map(tuple, bent.edges.tolist()), bent.costs.tolist(), strict=True))
    for one, other in pairs:
        without: nx.Graph[int] = nx.Graph()
        for (tail, head), cost in costs.items():
            if {tail, head} != {one, other}:
                without.add_edge(tail, head, length_m=cost)
        if one in without and other in without and nx.has_path(without, one, other):
            around = nx.shortest_path_length(without, one, other, weight="length_m")
            assert around > costs[one, other] * (1 + 1e-9)


@pytest.mark.parametrize("stretch", [0.99, np.nan])
def test_a_stretch_that_is_none_is_refused(stretch):
    graph = hn.ext.graphs.build_route_graph(topology_of(HOUSE))
    with pytest.raises(hn.errors.InvalidValueError, match="stretch"):
        hn.ext.graphs.merge_bends(graph, stretch=stretch)


def test_the_file_holds_polylines_doors_and_rooms(tmp_path):
    here = topology_of(HOUSE)
    graph = hn.ext.graphs.build_route_graph(here)
    hn.ext.graphs.export_nav2(
        hn.ext.graphs.merge_bends(graph), tmp_path / "bent.geojson", frame="floor"
    )
    read = read_nav2(tmp_path / "bent.geojson")
    assert set(read.frames.values()) == {"floor"}
    assert {facts["class"] for facts in read.node_facts.values()} <= KEPT
    bent = 0
    for number, line in read.lines.items():
        facts = read.edge_facts[number]
        assert ("polyline" in facts) == (len(line) > 2)
        if len(line) > 2:
            bent += 1
            values = facts["polyline"]["x_values"], facts["polyline"]["y_values"]
            assert list(zip(*values, strict=True)) == line
    assert bent
    # Without the edges of its door, the kitchen is a part of its own.
    number = next(door.number for door in here.rooms.doors if "kitchen" in door.rooms)
    left: nx.Graph[int] = nx.Graph(
        ends
        for key, ends in read.edges.items()
        if number not in read.edge_facts[key].get("doors", [])
    )
    start = next(
        node
        for node, facts in read.node_facts.items()
        if (facts["class"], facts.get("room")) == ("room", "kitchen")
    )
    left.add_node(start)
    inside = nx.node_connected_component(left, start)
    assert {read.node_facts[node].get("room") for node in inside} <= {"kitchen", "corridor"}


def test_the_check_follows_lines_where_robots_do():
    here = topology_of(HOUSE)
    bent = hn.ext.graphs.merge_bends(hn.ext.graphs.build_route_graph(here))
    along = hn.ext.graphs.check_graph(here, bent, along_lines=True)
    assert along.findings == ()
    assert along.doors == (6, 6)
    assert along.is_clear.all()
    straight = hn.ext.graphs.check_graph(here, bent)
    for edge, ends in enumerate(bent.edges.tolist()):
        assert straight.is_clear[edge] == (not segment_faults(here.grid, bent.points[ends]))
    assert not straight.is_clear.all()
    # A line through a wall is found, although its nodes see each other.
    clear = [edge for edge in range(bent.n_edges) if straight.is_clear[edge]]
    tail, head = bent.points[bent.edges[clear[0]]]
    lines = bent.lines | {clear[0]: np.array([tail, [0.25, 0.25], head])}
    wrong = hn.ext.graphs.check_graph(here, replace(bent, lines=lines), along_lines=True)
    assert np.flatnonzero(~wrong.is_clear).tolist() == [clear[0]]
    assert [(one.kind, one.count) for one in wrong.findings] == [("edge-through-wall", 1)]
    lines[clear[0]] = np.array([tail, [-500.0, 0.25], head])
    wrong = hn.ext.graphs.check_graph(here, replace(bent, lines=lines), along_lines=True)
    assert np.flatnonzero(~wrong.is_clear).tolist() == [clear[0]]
    drawn = plot_graph_check(along)
    shown = [line for one in drawn.collections for line in getattr(one, "get_segments", list)()]
    assert max(map(len, shown)) > 2


def test_lanes_are_refused():
    here = topology_of(HOUSE)
    graph = hn.ext.graphs.keep_right(here, hn.ext.graphs.build_route_graph(here), apart_m=1.0)
    with pytest.raises(hn.errors.InvalidValueError, match="has lanes"):
        hn.ext.graphs.merge_bends(graph)
