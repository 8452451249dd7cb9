"""What changed between graphs, and whether routes hold, against networkx and the map."""

import itertools
from dataclasses import replace
from typing import Any, Literal

import networkx as nx
import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.fleet import load_graph
from hybridnav.graphs import (
    WaypointGraph,
    build_lane_graph,
    export_nav2,
    first_broken_edge,
    graph_changes,
)
from tests.drawn_rooms import HOUSE, topology_of

EMPTY: dict[str, list[Any]] = {"added": [], "gone": [], "moved": []}
NOTHING = {"nodes": EMPTY, "edges": EMPTY}


def built(lines=HOUSE, **options):
    return build_lane_graph(topology_of(lines), spacing_m=2.0, **options)


def shut(lines, letter):
    """The map with all cells of a room occupied."""
    return tuple(line.replace(letter, "#") for line in lines)


def test_an_unchanged_map_changes_nothing_and_a_file_holds_as_much(tmp_path):
    graph = built()
    export_nav2(graph, tmp_path / "graph.geojson")
    loaded = load_graph(tmp_path / "graph.geojson")
    assert graph_changes(loaded, graph) == graph_changes(graph, loaded) == NOTHING
    assert graph_changes(loaded, built(keep=loaded)) == NOTHING


def test_ids_of_before_are_kept_moved_or_gone():
    before = built()
    after = built(shut(HOUSE, "k"), keep=before)
    changes = graph_changes(before, after)
    for at, kind in enumerate(("nodes", "edges")):
        old, new = (set(graph.ids[at].tolist()) for graph in (before, after))
        assert set(changes[kind]["added"]) == new - old
        assert set(changes[kind]["gone"]) == old - new
        assert set(changes[kind]["moved"]) <= old & new
    # A door's node lies on either side, and moves off.
    places = zip(before.ids[0].tolist(), before.rooms, before.kinds, strict=True)
    in_kitchen = {n for n, *place in places if place == ["kitchen", "room"]}
    assert in_kitchen
    assert in_kitchen <= set(changes["nodes"]["gone"])
    # A node that is moved takes its edges with it.
    positions = before.positions.copy()
    positions[0] += 0.1
    moved = graph_changes(before, replace(before, positions=positions))
    number = int(before.ids[0][0])
    assert moved["nodes"] == {"added": [], "gone": [], "moved": [number]}
    at_it = (before.edges == 0).any(axis=1)
    assert moved["edges"]["moved"] == before.ids[1][at_it].tolist()


def route_between(graph, start, goal):
    """Ids of the nodes and of the edges of a shortest route between nodes in two rooms."""
    network: nx.DiGraph[int] = nx.DiGraph()
    for number, (tail, head) in zip(graph.ids[1].tolist(), graph.edges.tolist(), strict=True):
        network.add_edge(tail, head, number=number)
    ends = [graph.rooms.index(name) for name in (start, goal)]
    nodes = nx.shortest_path(network, *ends)
    edges = [network.edges[pair]["number"] for pair in itertools.pairwise(nodes)]
    return [int(graph.ids[0][node]) for node in nodes], edges


def test_a_route_holds_until_the_map_or_the_graph_breaks_it(tmp_path):
    graph = built()
    nodes, edges = route_between(graph, "kitchen", "lab")
    kinds: tuple[Literal["nodes", "edges"], ...] = ("nodes", "edges")
    for by, route in zip(kinds, (nodes, edges), strict=True):
        assert first_broken_edge(graph, route, by=by) is None
        # The lab is closed: the first edge that is not free is the first that touches its cells.
        now = topology_of(shut(HOUSE, "l")).grid
        broken = first_broken_edge(graph, route, now, by=by)
        assert broken is not None
        free = now.enterable(allow_unexplored=False)
        points = dict(zip(graph.ids[0].tolist(), graph.points, strict=True))
        for at, (tail, head) in enumerate(itertools.pairwise(nodes)):
            along = now.frame.cells_of(np.linspace(points[tail], points[head], 500))
            is_free = bool(free[tuple(along.T)].all())
            assert is_free or at >= broken
            if at == broken:
                assert not is_free
        # In the graph of that map the ids of the lab are gone.
        after = built(shut(HOUSE, "l"), keep=graph)
        ids = set(after.ids[0].tolist())
        assert set(nodes) - ids
        kept = set(map(tuple, after.ids[0][after.edges].tolist()))
        found = first_broken_edge(after, nodes)
        assert found is not None
        pairs = list(itertools.pairwise(nodes))
        assert pairs[found] not in kept
        assert set(pairs[:found]) <= kept
        export_nav2(graph, tmp_path / "graph.geojson")
        loaded = load_graph(tmp_path / "graph.geojson")
        assert first_broken_edge(loaded, route, graph.grid, by=by) is None
        assert first_broken_edge(loaded, route, now, by=by) == broken
    assert first_broken_edge(graph, [edges[0], edges[2]], by="edges") == 1  # it leaves one out
    assert first_broken_edge(graph, [nodes[0], nodes[2]]) == 0
    assert first_broken_edge(graph, [nodes[0], 10**6]) == 0
    assert first_broken_edge(graph, nodes[:1]) is first_broken_edge(graph, []) is None


def test_a_graph_off_the_map_is_broken_and_one_from_a_file_needs_a_map():
    plain: nx.DiGraph[int] = nx.DiGraph()
    plain.add_node(1, pos=(1.0, 1.0))
    plain.add_node(2, pos=(900.0, 1.0))
    plain.add_edge(1, 2)
    graph = WaypointGraph.from_networkx(plain)
    assert first_broken_edge(graph, [1, 2], topology_of(HOUSE).grid) == 0
    with pytest.raises(hn.errors.InvalidValueError, match="give grid"):
        first_broken_edge(graph, [1, 2])
    with pytest.raises(hn.errors.InvalidValueError, match="by must be"):
        first_broken_edge(graph, [1, 2], topology_of(HOUSE).grid, by="both")  # type: ignore[arg-type]
