"""Levels and their duals as networkx graphs: they hold what the arrays hold, also after JSON."""

from __future__ import annotations

import json
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.dual import FaceKind
from tests.strategies import drawn, examples, occupancy_grid, scenes

FIGURE1 = Path(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"
SOME = settings(max_examples=examples(40), deadline=None)


def level_of(scene, index):
    pyramid = DualGraphPyramid.build(
        scene.grid, merge_distance_m=scene.merge_distance_m, seed=scene.seed
    )
    return pyramid[min(index, len(pyramid) - 1)]


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
    """The two boundaries of the neighbour join hole and outside, the island's is a ring."""
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
