"""What a simple graph loses: counted against networkx."""

from __future__ import annotations

import dataclasses
from collections import Counter
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.simple import ArcGroup, report_of
from tests.strategies import drawn, examples, occupancy_grid, scenes

ROOT = Path(__file__).parents[2]
MAPS = ROOT / "maps"
SOME = settings(max_examples=examples(60), deadline=None)


@pytest.fixture(scope="module")
def figure1():
    grid = hn.load_map(MAPS / "figure1" / "figure1.yaml", robot_radius_m=0)
    return hn.TopologicalMap(DualGraphPyramid.build(grid, merge_distance_m=10.0))


@SOME
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


def test_figure_1_loses_one_parallel_arc_and_one_self_loop(figure1):
    level = figure1.level
    simple = level.to_simple_graph()
    dropped = simple.dropped
    assert (dropped.n_parallel_dropped, dropped.n_self_loops_dropped) == (1, 1)
    assert simple.graph.number_of_edges() == 2
    free = int(np.flatnonzero(level.classes == hn.CellClass.FREE)[0])
    assert dropped.self_loops[0].vertices == (free, free)
    assert free in dropped.parallel[0].vertices
    assert len(dropped.parallel[0].arcs) == 2


def test_the_topological_map_and_the_page_count_alike(figure1):
    assert figure1.parallel_arcs() == 1
    grid = hn.load_map(MAPS / "office" / "office.yaml", robot_radius_m=0.25)
    office = hn.TopologicalMap(DualGraphPyramid.build(grid))
    dropped = office.level.to_simple_graph().dropped
    assert office.parallel_arcs() >= 20
    assert office.parallel_arcs() == dropped.n_parallel_dropped
    page = " ".join((ROOT / "docs" / "pyramid.md").read_text(encoding="utf-8").split())
    loops = f"{dropped.n_self_loops_dropped} self-loops of {dropped.n_arcs}"
    assert f"drops {dropped.n_parallel_dropped} arcs and {loops}" in page


def test_the_report_is_for_people(figure1):
    text = str(figure1.level.to_simple_graph().dropped).splitlines()
    assert text == [
        "3 vertices, 4 arcs; a simple graph keeps 2 and drops 1 parallel arc and 1 self-loop",
        "  between 1 and 2: arcs 0, 3, one of them is kept",
        "  at 1: self-loop 2",
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


def test_a_report_is_a_value(figure1):
    dropped = figure1.level.to_simple_graph().dropped
    assert dropped == figure1.level.to_simple_graph().dropped
    with pytest.raises(dataclasses.FrozenInstanceError):
        dropped.n_arcs = 0
