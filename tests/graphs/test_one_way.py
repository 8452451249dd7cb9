"""One-way doors in the graphs that are written and checked, and one-way edges as rules for maps."""

from collections.abc import Callable
from pathlib import Path

import networkx as nx
import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.fleet import (
    Anchor,
    BuildingGraph,
    export_lif,
    export_osm,
    export_rmf,
    floor_graph,
    load_graph,
)
from hybridnav.graphs import (
    RouteGraph,
    WaypointGraph,
    build_lane_graph,
    check_graph,
    export_nav2,
    judge_route_graph,
    keep_right,
    one_way_rules,
)

WALL_M = 6.1
RULES = tuple(map(hn.OneWayRule.of, ("door:1=right", "door:2=left")))
"""Through the lower door to the right, through the upper one to the left."""


def rooms_with(*rules: hn.OneWayRule) -> hn.TopologicalMap:
    """Two rooms of 6 x 8 m beside each other, and two doors of 1 m in the wall between them."""
    occupied = np.zeros((80, 121), np.float32)
    occupied[[0, -1]] = occupied[:, [0, -1]] = occupied[:, 60] = 1
    occupied[15:25, 60] = occupied[55:65, 60] = 0
    grid = hn.OccupancyGrid(occupied, hn.Frame(0.1), robot_radius_m=0.2)
    label_of = np.where(np.arange(121) < 61, 0, 1)[None].repeat(80, axis=0).astype(np.int32)
    doors = {1: (6.1, 2.0), 2: (6.1, 6.0)}
    rooms = hn.RoomLabels(("left", "right"), label_of, doors=doors, one_way=rules)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))


@pytest.fixture(scope="module")
def topology() -> hn.TopologicalMap:
    return rooms_with(*RULES)


@pytest.fixture(scope="module")
def built(topology: hn.TopologicalMap) -> RouteGraph:
    return build_lane_graph(topology, spacing_m=2.0)


def ways(graph: RouteGraph | WaypointGraph) -> set[tuple[str, str]]:
    """The door, lower or upper, and the direction of each edge over the wall."""
    found = set()
    for tail, head in graph.points[graph.edges].tolist():
        if min(tail[0], head[0]) < WALL_M < max(tail[0], head[0]):
            door = "lower" if (tail[1] + head[1]) / 2 < 4 else "upper"
            found.add((door, "right" if tail[0] < head[0] else "left"))
    return found


def _fleet(export: Callable[..., object]) -> Callable[[hn.TopologicalMap, RouteGraph, Path], None]:
    def write(topology: hn.TopologicalMap, graph: RouteGraph, file: Path) -> None:
        floor = floor_graph(topology, graph, name="0")
        export(BuildingGraph(name="house", floors=(floor,)), file)

    return write


WRITERS = {
    ".geojson": lambda _, graph, file: export_nav2(graph, file),
    ".yaml": _fleet(export_rmf),
    ".json": _fleet(lambda graph, file: export_lif(graph, file, vehicle_types=["A.B"])),
    ".osm": _fleet(lambda graph, file: export_osm(graph, file, anchor=Anchor(52.0, 13.0))),
}


@pytest.mark.parametrize("ending", WRITERS)
def test_what_is_written_has_one_way_edges_and_is_read_so(topology, built, ending, tmp_path):
    assert ways(built) == {("lower", "right"), ("upper", "left")}
    file = tmp_path / f"graph{ending}"
    WRITERS[ending](topology, built, file)
    read = load_graph(file)
    assert ways(read) == ways(built)
    found = {one.kind for one in check_graph(topology, read).findings}
    assert not found & {"edge-against", "missing-door", "one-way", "components"}


@pytest.mark.parametrize("slant_m", [-0.4, 0.0, 0.4])
def test_an_edge_through_a_door_shuts_the_door_wherever_its_middle_lies(slant_m: float) -> None:
    """A line across its middle lay in the room beside the door, and paths went round its end."""
    topology = rooms_with()
    planner = hn.HybridPlanner(topology)
    left, right = (4.0, 2.0), (8.0, 2.0)
    edge = ((6.0, 2.0), (7.4, 2.0 + slant_m)), ((5.95, 2.0 + slant_m), (6.3, 2.0))
    for ends in (*edge, *((head, tail) for tail, head in edge)):
        rules = one_way_rules(graph_of([ends]), topology.grid)
        there, back = (left, right) if ends[0][0] < ends[1][0] else (right, left)
        assert planner.plan(there, back, one_way=hn.OneWay.of(rules)).cost == pytest.approx(4)
        assert planner.plan(back, there, one_way=hn.OneWay.of(rules)).cost > 8


def test_lanes_keep_the_directions(topology: hn.TopologicalMap, built: RouteGraph) -> None:
    assert ways(keep_right(topology, built, apart_m=0.6)) == ways(built)


def test_reports_compare_with_the_shortest_legal_paths(topology, built):
    plain, legal = (judge_route_graph(built, pairs=200, topology=one) for one in (None, topology))
    assert plain.nearest.greatest > 1
    assert legal.nearest.greatest < 0.6
    assert legal.best.mean < plain.best.mean
    assert plain.pairs == legal.pairs == 200


def test_a_graph_that_contradicts_is_found(topology: hn.TopologicalMap) -> None:
    plain: nx.Graph[int] = nx.Graph()
    for at, (x, y) in enumerate([(4, 2), (8, 2), (4, 6), (8, 6), (2, 4)]):
        plain.add_node(at, x=x, y=y)
    plain.add_edges_from([(0, 1), (2, 3), (4, 0)])
    graph = WaypointGraph.from_networkx(plain)
    check = check_graph(topology, graph)
    found = {one.kind: one for one in check.findings}
    against = found["edge-against"]
    assert against.count == 2
    assert {one.points for one in against.examples} == {
        ((8.0, 2.0), (4.0, 2.0)),
        ((4.0, 6.0), (8.0, 6.0)),
    }
    assert "edge-against" not in {one.kind for one in check_graph(rooms_with(), graph).findings}


def graph_of(edges: list[tuple[tuple[float, float], tuple[float, float]]]) -> WaypointGraph:
    plain: nx.DiGraph[tuple[float, float]] = nx.DiGraph()
    for tail, head in edges:
        for x, y in (tail, head):
            plain.add_node((x, y), x=x, y=y)
        plain.add_edge(tail, head)
    return WaypointGraph.from_networkx(plain)


def test_one_way_edges_become_lines_from_wall_to_wall() -> None:
    grid = hn.OccupancyGrid(np.pad(np.zeros((4, 20), np.float32), 1, constant_values=1))
    east = graph_of([((2, 2), (12, 2)), ((12, 2), (18, 4)), ((18, 4), (12, 2))])
    (rule,) = one_way_rules(east, grid)
    assert rule == hn.OneWayRule(line=((7, 0.5), (7, 5)))
    sides = hn.OneWay.of([rule]).on(grid).sides
    assert sides.tolist() == [[row, 6, row, 7] for row in range(1, 5)]


def test_lanes_in_both_directions_share_the_way() -> None:
    grid = hn.OccupancyGrid(np.pad(np.zeros((6, 20), np.float32), 1, constant_values=1))
    both = graph_of([((2, 2), (18, 2)), ((18, 6), (2, 6)), ((2, 6.5), (2, 6.8))])
    rules = set(map(str, one_way_rules(both, grid)))
    assert {"line:10,0.5:10,4", "line:10,7:10,4"} <= rules


def test_edges_in_walls_state_nothing() -> None:
    grid = hn.OccupancyGrid(np.ones((4, 20), np.float32))
    assert one_way_rules(graph_of([((2, 2), (18, 2)), ((2, 2), (-90, 2))]), grid) == ()
