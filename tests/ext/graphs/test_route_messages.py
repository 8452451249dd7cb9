"""Routes over a route graph as messages of Nav2."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.graphs import route_messages
from tests.layers import grid_of
from tests.nav2_reader import read_nav2


@pytest.fixture(scope="module")
def graph() -> hn.RouteGraph:
    plan = np.zeros((30, 40))
    plan[:20, 20] = 1.0
    grid = grid_of(plan, hn.Frame(0.1, (3.0, 4.0), 1.0), robot_radius_m=0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))
    return hn.build_route_graph(topology, nodes=12)


def walk(graph: hn.RouteGraph, rng: np.random.Generator, steps: int) -> list[int]:
    """A walk along edges."""
    nodes = [int(rng.integers(graph.n_nodes))]
    for _ in range(steps):
        heads = graph.edges[graph.edges[:, 0] == nodes[-1], 1]
        nodes.append(int(rng.choice(heads)))
    return nodes


@pytest.mark.parametrize("seed", range(10))
def test_a_route_has_the_ids_and_costs_of_the_exported_file(
    graph: hn.RouteGraph, seed: int, tmp_path: Any
) -> None:
    hn.export_nav2(graph, tmp_path / "graph.geojson")
    file = read_nav2(tmp_path / "graph.geojson")
    nodes = walk(graph, np.random.default_rng(seed), seed)
    found = json.loads(json.dumps(route_messages(graph, nodes, frame_id="floor", stamp_ns=5)))
    route, path = found["route"], found["path"]
    header = {"stamp": {"sec": 0, "nanosec": 5}, "frame_id": "floor"}
    assert route["header"] == path["header"] == header
    assert [node["nodeid"] for node in route["nodes"]] == nodes
    for node in route["nodes"]:
        at = node["position"]
        assert (at["x"], at["y"], at["z"]) == pytest.approx((*file.points[node["nodeid"]], 0))
    ids = [edge["edgeid"] for edge in route["edges"]]
    assert [file.edges[number] for number in ids] == list(pairwise(nodes))
    assert route["route_cost"] == pytest.approx(sum(file.costs[number] for number in ids))
    poses = [pose["pose"]["position"] for pose in path["poses"]]
    at = np.array([(pose["x"], pose["y"]) for pose in poses])
    assert np.hypot(*np.diff(at, axis=0).T).max(initial=0) <= 0.05 + 1e-9
    assert np.hypot(*np.diff(at, axis=0).T).sum() == pytest.approx(route["route_cost"])
    for node in nodes:
        assert min(math.dist(point, file.points[node]) for point in at) < 1e-9


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        ([], "at least one node"),
        ([-1], "no node -1, nodes are 0 to"),
        ([99999], "no node 99999"),
        (["0"], "no node '0'"),
        ([0.5], "no node 0.5"),
        ([0, 0], "no edge leads from node 0 to node 0"),
    ],
)
def test_wrong_routes_are_refused_in_one_line(graph: hn.RouteGraph, nodes: Any, words: str) -> None:
    with pytest.raises(hn.InvalidValueError, match=words):
        route_messages(graph, nodes)


def test_ids_that_messages_cannot_hold_are_refused(graph: hn.RouteGraph) -> None:
    """Nodes that no edge leads to push the ids of edges over 65,535."""
    many = np.zeros((65_536, 2))
    many[: graph.n_nodes] = graph.positions
    large = replace(graph, positions=many)
    assert route_messages(large, [65_535])["route"]["nodes"][0]["nodeid"] == 65_535
    with pytest.raises(hn.InvalidValueError, match="build the graph with fewer nodes"):
        route_messages(large, graph.edges[0].tolist())


def test_other_things_than_graphs_are_refused() -> None:
    with pytest.raises(hn.InvalidValueError, match="expected a RouteGraph"):
        route_messages("graph", [0])  # type: ignore[arg-type]
