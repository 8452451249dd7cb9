"""Levels and their duals as networkx graphs, also after JSON, and what a simple graph loses."""

import dataclasses
import json
from collections import Counter
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.graphs import ArcGroup, FaceKind, report_of
from tests.strategies import drawn, examples, level_of, occupancy_grid, scenes

FIGURE1 = Path(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"
SOME = settings(max_examples=examples(40), deadline=None)


def through_json(graph):
    text = json.dumps(nx.node_link_data(graph, edges="edges"))
    return nx.node_link_graph(json.loads(text), edges="edges")


def edges_by_key(graph):
    return {key: (frozenset((u, v)), data) for u, v, key, data in graph.edges(keys=True, data=True)}


@pytest.fixture(scope="module")
def figure1():
    return DualGraphPyramid.build(hn.load_map(FIGURE1, robot_radius_m=0), merge_distance_m=10.0)[-1]


@SOME
@given(scenes(max_side=16), st.integers(0, 9))
def test_a_graph_says_what_the_level_says(scene, index):
    level = level_of(scene, index)
    graph = level.to_networkx()
    grid = level.grid
    assert list(graph.nodes) == list(range(level.n_vertices))
    for vertex, data in graph.nodes(data=True):
        row, col = data["cell"]
        assert level.field_of[row, col] == vertex
        np.testing.assert_allclose(data["position"], grid.frame.points_of([row, col]))
        assert data["class"] == hn.CellClass(grid.classes[row, col]).name.lower()
        size = (level.field_of == vertex).sum()
        assert data["area_m2"] == pytest.approx(size * grid.resolution_m**2)
    edges = edges_by_key(graph)
    assert sorted(edges) == list(range(level.n_arcs))
    for arc, (endpoints, data) in edges.items():
        assert endpoints == frozenset(level.arcs[arc].tolist())
        assert data["max_distance_m"] == level.max_distance_m[arc]
        assert data["through_m"] == level.through_m[arc]
        assert data["n_cracks"] == len(level.boundary(arc))
        assert data["base_pair"] == level.base_pairs[arc].tolist()


@SOME
@given(scenes(max_side=16), st.integers(0, 9))
def test_a_dual_says_what_the_level_says(scene, index):
    level = level_of(scene, index)
    graph = level.dual_to_networkx()
    kinds = [data["kind"] for _, data in graph.nodes(data=True)]
    assert kinds == [FaceKind(kind).name.lower() for kind in level.dual.kinds.tolist()]
    edges = edges_by_key(graph)
    assert sorted(edges) == list(range(level.n_arcs))
    for arc, (endpoints, data) in edges.items():
        assert endpoints == frozenset(level.dual.edges[arc].tolist())
        assert data["vertices"] == level.arcs[arc].tolist()
        assert data["n_cracks"] == len(level.boundary(arc))
        length = data["n_cracks"] * level.grid.resolution_m
        assert data["length_m"] == pytest.approx(length)


@SOME
@given(scenes(max_side=16), st.integers(0, 9))
def test_the_two_graphs_obey_euler(scene, index):
    level = level_of(scene, index)
    graph, dual = level.to_networkx(), level.dual_to_networkx()
    isolated = list(nx.isolates(graph))
    assert dual.graph["n_isolated"] == len(isolated)
    left = len(graph) - graph.number_of_edges() + len(dual)
    assert left == 2 * nx.number_connected_components(graph) - len(isolated)


@SOME
@given(scenes(max_side=16), st.integers(0, 9))
def test_json_keeps_everything(scene, index):
    level = level_of(scene, index)
    for graph in (level.to_networkx(), level.dual_to_networkx(), level.to_simple_graph().graph):
        again = through_json(graph)
        assert again.graph == graph.graph
        assert dict(again.nodes(data=True)) == dict(graph.nodes(data=True))
        if graph.is_multigraph():
            assert edges_by_key(again) == edges_by_key(graph)
        else:
            assert nx.utils.graphs_equal(again, graph)


def test_parallel_arcs_and_self_loops_stay_what_they_are(figure1):
    graph = figure1.to_networkx()
    free, outer, island = (
        next(v for v, data in graph.nodes(data=True) if data["class"] == "free"),
        *sorted(
            (v for v, data in graph.nodes(data=True) if data["class"] == "unexplored"),
            key=lambda v: -graph.nodes[v]["area_m2"],
        ),
    )
    assert graph.number_of_edges(free, outer) == 2
    assert graph.number_of_edges(free, free) == 1
    assert graph.number_of_edges(free, island) == 1
    assert graph.graph["name"] == "figure1"


def test_the_dual_tells_the_island_from_the_neighbour(figure1):
    dual = figure1.dual_to_networkx()
    face = {data["kind"]: face for face, data in dual.nodes(data=True)}
    assert dual.number_of_edges(face["outside"], face["protected"]) == 2
    assert dual.number_of_edges(face["ordinary"], face["ordinary"]) == 1
    assert dual.number_of_edges(face["ordinary"], face["protected"]) == 1


def test_a_vertex_without_an_arc_is_counted():
    grid = occupancy_grid(drawn("..#.", "..##", "####"))
    level = DualGraphPyramid.build(grid, merge_distance_m=1.5)[0]
    assert level.dual_to_networkx().graph["n_isolated"] == 1
    assert len(level.to_networkx()) == 5


def test_a_map_without_vertices_gives_empty_graphs():
    level = DualGraphPyramid.build(occupancy_grid(drawn("##", "##")), merge_distance_m=4.0)[-1]
    assert len(level.to_networkx()) == len(level.dual_to_networkx()) == 0
    assert len(level.to_simple_graph().graph) == 0


ROOT = Path(__file__).parents[2]
MAPS = ROOT / "maps"
MORE = settings(max_examples=examples(60), deadline=None)


@pytest.fixture(scope="module")
def apex():
    grid = hn.load_map(MAPS / "figure1" / "figure1.yaml", robot_radius_m=0)
    return hn.TopologicalMap(DualGraphPyramid.build(grid, merge_distance_m=10.0))


@MORE
@given(scenes(max_side=20), st.integers(0, 9))
def test_what_is_left_and_what_is_dropped_make_up_the_level(scene, index):
    pyramid = DualGraphPyramid.build(
        scene.grid, merge_distance_m=scene.merge_distance_m, seed=scene.seed
    )
    level = pyramid[min(index, len(pyramid) - 1)]
    simple, graph = level.to_simple_graph(), level.to_networkx()
    dropped = simple.dropped
    counts = Counter(frozenset(endpoints) for endpoints in level.arcs.tolist())
    assert dropped.n_self_loops_dropped == nx.number_of_selfloops(graph)
    assert dropped.n_parallel_dropped == sum(n - 1 for p, n in counts.items() if len(p) == 2)
    assert dropped.n_edges == simple.graph.number_of_edges()
    assert nx.number_of_selfloops(simple.graph) == 0
    assert {frozenset(edge) for edge in simple.graph.edges} == {p for p in counts if len(p) == 2}
    assert dict(simple.graph.nodes(data=True)) == dict(graph.nodes(data=True))
    for group in dropped.parallel + dropped.self_loops:
        endpoints = {tuple(sorted(level.arcs[arc].tolist())) for arc in group.arcs}
        assert endpoints == {group.vertices}
        assert len(group.arcs) == counts[frozenset(group.vertices)]
    for low, high, data in simple.graph.edges(data=True):
        parallel = [graph.edges[low, high, arc] for arc in graph[low][high]]
        assert data["through_m"] == min(arc["through_m"] for arc in parallel)
        assert data["through_m"] == level.through_m[data["arc"]]
        assert {arc["max_distance_m"] for arc in parallel} == {data["max_distance_m"]}


def test_figure_1_loses_one_parallel_arc_and_one_self_loop(apex):
    level = apex.level
    simple = level.to_simple_graph()
    dropped = simple.dropped
    assert (dropped.n_parallel_dropped, dropped.n_self_loops_dropped) == (1, 1)
    assert simple.graph.number_of_edges() == 2
    free = int(np.flatnonzero(level.classes == hn.CellClass.FREE)[0])
    assert dropped.self_loops[0].vertices == (free, free)
    assert free in dropped.parallel[0].vertices
    assert len(dropped.parallel[0].arcs) == 2


def test_the_topological_map_and_the_page_count_alike(apex):
    assert apex.parallel_arcs() == 1
    grid = hn.load_map(MAPS / "office" / "office.yaml", robot_radius_m=0.25)
    office = hn.TopologicalMap(DualGraphPyramid.build(grid))
    dropped = office.level.to_simple_graph().dropped
    assert office.parallel_arcs() >= 20
    assert office.parallel_arcs() == dropped.n_parallel_dropped
    page = " ".join((ROOT / "docs" / "pyramid.md").read_text(encoding="utf-8").split())
    loops = f"{dropped.n_self_loops_dropped} self-loops of {dropped.n_arcs}"
    assert f"drops {dropped.n_parallel_dropped} arcs and {loops}" in page


def test_the_report_is_for_people(apex):
    text = str(apex.level.to_simple_graph().dropped).splitlines()
    assert text == [
        "3 vertices, 4 arcs; a simple graph keeps 2 and drops 1 parallel arc and 1 self-loop",
        "  between 1 and 2: arcs 0, 3, one of them is kept",
        "  at 2: self-loop 2",
    ]


def test_a_long_report_lists_the_first_and_counts_the_rest():
    arcs = np.repeat(np.stack([np.arange(20), np.arange(1, 21)], axis=1), 2, axis=0)
    lines = str(report_of(arcs.astype(np.int32), 21)).splitlines()
    assert len(lines) < 12
    assert lines[-1] == "  and 12 more"
    assert "keeps 20 and drops 20 parallel arcs and 0 self-loops" in lines[0]


def test_the_order_of_the_ends_does_not_matter():
    report = report_of(np.array([[4, 1], [1, 4], [2, 2], [0, 1]], dtype=np.int32), 5)
    assert report.parallel == (ArcGroup((1, 4), (0, 1)),)
    assert report.self_loops == (ArcGroup((2, 2), (2,)),)


def test_a_level_without_arcs_loses_nothing():
    level = DualGraphPyramid.build(occupancy_grid(drawn(".#.")), merge_distance_m=4.0)[-1]
    dropped = level.to_simple_graph().dropped
    assert (dropped.n_vertices, dropped.n_edges, dropped.parallel) == (2, 0, ())
    assert "keeps 0" in str(dropped)


def test_a_report_is_a_value(apex):
    dropped = apex.level.to_simple_graph().dropped
    assert dropped == apex.level.to_simple_graph().dropped
    with pytest.raises(dataclasses.FrozenInstanceError):
        dropped.n_arcs = 0
