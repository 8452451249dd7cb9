"""`check_graph` finds each kind of planted fault, and nothing in a sound graph."""

import json
import math
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.graphs import BUILDING_KINDS, KINDS, SEVERITIES, Finding
from hybridnav.graphs.gather import Findings
from hybridnav.harness.judges import segment_faults
from tests.drawn_rooms import HOUSE, topology_of
from tests.strategies import class_grids, occupancy_grid, tried

HERE = topology_of(HOUSE, origin_m=(-3.0, 1.0), yaw_rad=0.4)
SOUND = hn.graphs.build_lane_graph(HERE)


@pytest.fixture
def features(tmp_path):
    hn.graphs.export_nav2(SOUND, tmp_path / "sound.geojson")
    return json.loads((tmp_path / "sound.geojson").read_text())["features"]


@pytest.fixture
def checked(tmp_path):
    """Write features, read and check them; return count of each kind, and the check."""

    def check(features):
        whole = {"type": "FeatureCollection", "features": features}
        (tmp_path / "planted.geojson").write_text(json.dumps(whole))
        found = hn.graphs.check_graph(HERE, hn.ext.fleet.load_graph(tmp_path / "planted.geojson"))
        return {each.kind: each.count for each in found.findings}, found

    return check


def nodes_of(features):
    return [one for one in features if one["geometry"]["type"] == "Point"]


def edges_of(features):
    return [one for one in features if one["geometry"]["type"] == "LineString"]


def new_node(features, point):
    number = 10_000 + len(features)
    geometry = {"type": "Point", "coordinates": list(map(float, point))}
    node = {"type": "Feature", "properties": {"id": number}, "geometry": geometry}
    features.append(node)
    return node


def join(features, one, other, *, both=True):
    for tail, head in ((one, other), (other, one))[: 1 + both]:
        ids = tail["properties"]["id"], head["properties"]["id"]
        line = [tail["geometry"]["coordinates"], head["geometry"]["coordinates"]]
        properties = {"id": 10_000 + len(features), "startid": ids[0], "endid": ids[1]}
        geometry = {"type": "LineString", "coordinates": line}
        features.append({"type": "Feature", "properties": properties, "geometry": geometry})


def drop_edges(features, wrong):
    """Remove the edges for which a function of tail id, head id and properties is true."""
    kept = [
        one
        for one in features
        if "startid" not in one["properties"]
        or not wrong(one["properties"]["startid"], one["properties"]["endid"], one["properties"])
    ]
    features[:] = kept


def point_at(row, col):
    """The point in metres of a place in the drawing, from its lower left corner in cells."""
    return HERE.grid.frame.points_of_grid(np.array([row, col]))


def near(features, room, row, col):
    """A new node in a room, joined to the node of that room that is nearest in sight."""
    node = new_node(features, point_at(row, col))
    at = np.array(node["geometry"]["coordinates"])
    mates = [
        one
        for one in nodes_of(features)[:-1]
        if one["properties"].get("metadata", {}).get("room") == room
        and not segment_faults(HERE.grid, [at, one["geometry"]["coordinates"]])
    ]
    mates.sort(key=lambda one: np.hypot(*(at - one["geometry"]["coordinates"])))
    join(features, node, mates[0])
    return node


def test_a_graph_of_the_map_has_no_findings(features, checked):
    counts, found = checked(features)
    assert counts == {}
    assert found.is_free.all()
    assert found.is_clear.all()
    assert found.doors == (6, 6)  # with the opening of the hall, which has a node of its own
    assert found.doors[1] == len(set(SOUND.doors[SOUND.doors > 0].tolist()))
    assert found.rooms == (len(HERE.rooms.names),) * 2
    assert found.in_sight > 0.99


def test_a_node_in_a_wall_and_its_edges(features, checked):
    near(features, "corridor", 6.5, 20.5)  # the wall north of it begins at row 8
    moved = nodes_of(features)[-1]
    moved["geometry"]["coordinates"] = point_at(8.5, 20.5).tolist()
    counts, found = checked(features)
    assert (counts["node-in-wall"], counts["edge-through-wall"]) == (1, 2)
    assert str(moved["properties"]["id"]) in found.findings[0].examples[0].where or any(
        str(moved["properties"]["id"]) in each.examples[0].where for each in found.findings
    )


def test_a_node_outside_the_map(features, checked):
    far = new_node(features, (500.0, 500.0))
    join(features, far, nodes_of(features)[0])
    counts, _ = checked(features)
    assert (counts["node-outside"], counts["edge-through-wall"]) == (1, 2)


def test_an_edge_through_a_wall_is_found_where_it_is_blocked(features, checked):
    kitchen = near(features, "kitchen", 11.5, 8.5)
    archive = near(features, "archive", 11.5, 10.5)  # a wall of one cell between both
    join(features, kitchen, archive)
    counts, found = checked(features)
    assert counts == {"edge-through-wall": 2}
    where = found.findings[0].examples[0].where
    at = [float(word.rstrip(",")) for word in where.split("blocked at ")[1].split()]
    assert np.allclose(at, point_at(11.5, 9.0), atol=0.01)


def test_an_edge_that_the_walk_of_nav2_leaves(features, checked):
    # Straight through the door of the kitchen; from cell to cell one column farther left.
    tail, head = near(features, "corridor", 6.05, 2.98), near(features, "kitchen", 9.1, 4.98)
    join(features, tail, head)
    counts, found = checked(features)
    assert counts == {"edge-walk": 2}
    assert found.is_clear.all()
    ends = [tuple(one["geometry"]["coordinates"]) for one in (tail, head)]
    assert found.findings[0].examples[0].points == tuple(ends)


def test_components_that_free_space_connects(features, checked):
    kitchen = {
        one["properties"]["id"]
        for one in nodes_of(features)
        if one["properties"].get("metadata", {}).get("room") == "kitchen"
    }
    drop_edges(features, lambda tail, head, _: (tail in kitchen) != (head in kitchen))
    counts, found = checked(features)
    assert counts["components"] == 1
    assert f"{len(kitchen)} nodes" in next(
        each.examples[0].where for each in found.findings if each.kind == "components"
    )


def test_a_door_that_no_edge_passes(features, checked):
    number = next(door.number for door in HERE.rooms.doors if "bath" in door.rooms)
    drop_edges(features, lambda _tail, _head, facts: number in facts["metadata"].get("doors", []))
    counts, found = checked(features)
    assert counts["missing-door"] == 1
    (missing,) = [each for each in found.findings if each.kind == "missing-door"]
    assert missing.examples[0].where.startswith(f"door {number} between ")
    assert missing.severity == "note"
    assert found.doors == (5, 6)


def test_a_room_without_a_node(features, checked):
    den = {
        one["properties"]["id"]
        for one in nodes_of(features)
        if one["properties"].get("metadata", {}).get("room") == "den"
    }
    drop_edges(features, lambda tail, head, _: tail in den or head in den)
    features[:] = [one for one in features if one["properties"]["id"] not in den]
    # "missing-room" is the same for a name that nobody gave.
    counts, found = checked(features)
    assert counts["missing-named-room"] == 1
    assert {one.kind: one.severity for one in found.findings}["missing-named-room"] == "warning"
    assert found.rooms == (len(HERE.rooms.names) - 1, len(HERE.rooms.names))


def test_a_node_without_edges(features, checked):
    new_node(features, point_at(6.5, 20.5))
    assert checked(features)[0] == {"alone": 1}


def test_a_way_in_without_a_way_out(features, checked):
    node = new_node(features, point_at(6.5, 20.5))
    mates = [
        one
        for one in nodes_of(features)[:-1]
        if not segment_faults(
            HERE.grid, [node["geometry"]["coordinates"], one["geometry"]["coordinates"]]
        )
    ]
    join(features, mates[0], node, both=False)
    assert checked(features)[0] == {"one-way": 1}


def test_an_edge_that_is_there_twice(features, checked):
    again = json.loads(json.dumps(edges_of(features)[0]))
    again["properties"]["id"] = 99_999
    features.append(again)
    assert checked(features)[0] == {"repeated-edge": 1}


def test_two_nodes_at_one_point(features, checked):
    first = nodes_of(features)[0]
    twin = new_node(features, first["geometry"]["coordinates"])
    other = edges_of(features)[0]["properties"]["endid"]
    join(features, twin, next(one for one in features if one["properties"]["id"] == other))
    assert checked(features)[0] == {"same-point": 1}


def test_a_loop(features, checked):
    first = nodes_of(features)[0]
    join(features, first, first, both=False)
    assert checked(features)[0] == {"loop": 1}


def test_an_id_that_two_edges_have(features, checked):
    edges = edges_of(features)
    edges[1]["properties"]["id"] = edges[0]["properties"]["id"]
    assert checked(features)[0] == {"repeated-id": 1}


def test_an_id_of_a_node_and_an_edge(features, checked):
    edges_of(features)[1]["properties"]["id"] = nodes_of(features)[3]["properties"]["id"]
    assert checked(features)[0] == {"repeated-id": 1}


@pytest.mark.parametrize("number", ["a", None, [1]])
def test_an_id_that_nav2_cannot_hold(features, checked, number):
    edges_of(features)[0]["properties"]["id"] = number
    assert checked(features)[0] == {"bad-id": 1}


@pytest.mark.parametrize("number", [-1, 2**32 + 99_999, 99_999.5])
def test_an_id_that_becomes_another_one_in_nav2(features, checked, number):
    edges_of(features)[0]["properties"]["id"] = number
    counts, found = checked(features)
    assert counts == {"fails-later": 1}
    assert found.findings[0].examples[0].where.endswith({-1: "4294967295"}.get(number, "99999"))


def test_a_node_without_coordinates_takes_its_edges_along(features, checked):
    node = near(features, "corridor", 6.5, 20.5)
    node["geometry"]["coordinates"] = []
    assert checked(features)[0] == {"no-coordinates": 1, "unknown-node": 2}


def test_an_edge_to_a_node_that_is_not_there(features, checked):
    ends = {"id": 77_777, "startid": 0, "endid": 88_888}
    line = {"type": "LineString", "coordinates": [[0, 0], [1, 1]]}
    features.append({"type": "Feature", "properties": ends, "geometry": line})
    assert checked(features)[0] == {"unknown-node": 1}


@pytest.mark.parametrize(
    ("cost", "kind"), [(-0.1, "bad-cost"), (float("nan"), "stops-loader"), ("dear", "stops-loader")]
)
def test_a_cost_that_is_none(features, checked, cost, kind):
    edge = edges_of(features)[0]
    edge["properties"]["cost"] = cost
    counts, found = checked(features)
    assert counts == {kind: 1}
    points = list(map(tuple, edge["geometry"]["coordinates"]))
    assert list(found.findings[0].examples[0].points) == points


def test_a_limit_that_is_a_whole_number(features, checked):
    edges_of(features)[0]["properties"]["metadata"]["speed_limit"] = 50
    assert checked(features)[0] == {"fails-later": 1}


def test_null_in_metadata(features, checked):
    edges_of(features)[0]["properties"]["metadata"]["speed"] = {"limit": [None]}
    assert checked(features)[0] == {"stops-loader": 1}


def test_a_line_that_ends_elsewhere(features, checked):
    edges_of(features)[0]["geometry"]["coordinates"][-1] = [0.0, 0.0]
    assert checked(features)[0] == {"line-elsewhere": 1}


def test_unexplored_space_and_parts_without_nodes():
    classes = np.full((10, 30), int(hn.CellClass.FREE), dtype=np.uint8)
    classes[:, 10:12] = hn.CellClass.UNEXPLORED
    classes[:, 20] = hn.CellClass.OCCUPIED
    plain: nx.Graph[Any] = nx.Graph()
    plain.add_nodes_from([("a", {"x": 5, "y": 5}), ("b", {"x": 15, "y": 5})])
    plain.add_nodes_from([("c", {"x": 10.5, "y": 8})])
    plain.add_edges_from([("a", "b"), ("a", "c")])
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(classes)))
    found = hn.graphs.check_graph(topology, hn.graphs.WaypointGraph.from_networkx(plain))
    assert {each.kind: each.count for each in found.findings} == {
        "node-unexplored": 1,
        "edge-unexplored": 4,
        "missing-part": 1,
    }
    assert found.is_free.tolist() == [True, True, False]


# A house with a door, and the free margin of its image, which nothing joins with it.
WITH_MARGIN = (
    "o" * 26,
    *("o" + "#" * 24 + "o",),
    *("o#" + "k" * 10 + "##" + "a" * 10 + "#o",) * 8,
    *("o#" + "k" * 11 + "aa" + "a" * 9 + "#o",) * 2,
    *("o#" + "k" * 10 + "##" + "a" * 10 + "#o",) * 4,
    *("o" + "#" * 24 + "o",),
    "o" * 26,
)


def test_free_ground_outside_the_building_gets_no_nodes_and_a_warning():
    nameless = [line.replace("o", ".") for line in WITH_MARGIN]
    topology = topology_of(nameless)
    letters = np.array([list(line) for line in reversed(WITH_MARGIN)])
    graph = hn.graphs.build_lane_graph(topology, spacing_m=2.0)
    cells = topology.grid.frame.cells_of(graph.points)
    assert set(letters[tuple(cells.T)]) == {"k", "a"}
    plain = graph.to_networkx()
    assert nx.is_connected(plain.to_undirected())
    plain.add_node(9000, x=0.25, y=0.25)
    found = hn.graphs.check_graph(topology, hn.graphs.WaypointGraph.from_networkx(plain))
    (beyond,) = found.findings
    assert (beyond.kind, beyond.severity, beyond.count) == ("node-beyond", "warning", 1)
    assert beyond.examples[0].where == "node 9000"
    assert found.in_sight == 1.0
    assert hn.graphs.judge_route_graph(graph, pairs=200).best.solved == 1.0


def test_a_room_outside_is_no_free_ground():
    topology = topology_of(WITH_MARGIN)
    graph = hn.graphs.build_lane_graph(topology, spacing_m=2.0)
    assert "hall" in graph.rooms
    (island,) = hn.graphs.check_graph(
        topology, hn.graphs.WaypointGraph.from_networkx(graph.to_networkx())
    ).findings
    assert (island.kind, island.severity, island.count) == ("island", "note", 1)


SHUT = ("############", *("#aaaa##bbbb#",) * 4, "############")


@pytest.mark.parametrize(
    ("nodes", "edges", "counts"),
    [
        ("abc", "ab", {"island": 1}),  # a node from which nothing is reached
        ("abcd", "ab cd", {"island": 1}),
        ("abcd", "ab", {"island": 1, "alone": 2}),  # of two single nodes beside each other one
        ("abc", "ab bc", {"edge-through-wall": 2}),
        ("ab", "ab", {"missing-named-room": 1, "missing-part": 1}),
    ],
)
def test_a_component_from_which_nothing_else_is_reached(nodes, edges, counts):
    topology = topology_of(SHUT)
    place = dict(zip("abcd", [(2.5, 1.5), (2.5, 3.5), (2.5, 8.5), (2.5, 10.5)], strict=True))
    plain: nx.Graph[Any] = nx.Graph()
    for node in nodes:
        x, y = topology.grid.frame.points_of_grid(np.array(place[node])).tolist()
        plain.add_node(node, x=x, y=y)
    plain.add_edges_from(edges.split())
    found = hn.graphs.check_graph(topology, hn.graphs.WaypointGraph.from_networkx(plain))
    assert {each.kind: each.count for each in found.findings} == counts


def test_a_component_that_nothing_leads_out_of(features, checked):
    """Three nodes in a ring that one edge leads into."""
    ring = [
        new_node(features, point_at(row, col))
        for row, col in ((6.5, 19.5), (6.5, 20.5), (5.5, 20.5))
    ]
    for one, other in zip(ring, ring[1:] + ring[:1], strict=True):
        join(features, one, other, both=False)
    mate = near(features, "corridor", 6.25, 18.75)
    join(features, mate, ring[0], both=False)
    assert checked(features)[0] == {"one-way": 3}


def test_errors_come_first():
    severities = [Finding(kind, 1, ()).severity for kind in (*KINDS, *BUILDING_KINDS)]
    assert set(severities) == set(SEVERITIES)
    findings = Findings()
    for kind in ("missing-door", "loop", "node-in-wall"):
        findings.add(kind, "here")
    assert [found.severity for found in findings.collected()] == list(SEVERITIES)


def test_a_lift_that_cannot_be_placed_is_a_warning(tmp_path):
    path = tmp_path / "a.building.yaml"
    path.write_text(
        "{coordinate_system: cartesian_meters, levels: {a: {vertices: [[1, 1, 0, a], [2, 1, 0, b]],"
        " lanes: [[0, 1, {}]]}}, lifts: {L: {x: 9, y: 9, yaw: 0, width: 1, depth: 1,"
        " level_doors: {a: []}}}}"
    )
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    found = hn.graphs.check_graph(topology, hn.ext.fleet.load_graph(path)).findings
    assert ("link-unread", "warning") in [(each.kind, each.severity) for each in found]


def test_every_kind_of_finding_is_planted_here_or_in_a_test_of_a_format():
    here = Path(__file__)
    formats = here.parents[1] / "ext" / "fleet" / "files"
    own = here, here.with_name("test_one_way.py"), *(here.parent / "files").glob("test_*.py")
    files = (*own, *formats.glob("test_*.py"))
    text = "".join(each.read_text(encoding="utf-8") for each in files)
    assert [kind for kind in KINDS if f'"{kind}"' not in text] == []


@tried(60, class_grids(16), st.data())
def test_free_nodes_and_edges_are_those_of_exact_geometry(classes, data):
    rows, cols = classes.shape
    coordinate = st.tuples(
        st.floats(-1, cols + 1, allow_nan=False), st.floats(-1, rows + 1, allow_nan=False)
    )
    points = data.draw(st.lists(coordinate, min_size=2, max_size=6, unique=True))
    plain = nx.complete_graph(len(points), create_using=nx.DiGraph)
    for node, (x, y) in enumerate(points):
        plain.nodes[node].update(x=x, y=y)
    graph = hn.graphs.WaypointGraph.from_networkx(plain)
    grid = occupancy_grid(classes)
    if not (classes == hn.CellClass.FREE).any():
        return
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    found = hn.graphs.check_graph(topology, graph)
    # A point on the side of two cells lies in the one above or to the right, as Nav2 takes it.
    cells = [(math.floor(y + 1e-9), math.floor(x + 1e-9)) for x, y in points]
    free = {tuple(cell) for cell in np.argwhere(classes == hn.CellClass.FREE).tolist()}
    assert found.is_free.tolist() == [cell in free for cell in cells]
    for edge, (tail, head) in enumerate(graph.edges.tolist()):
        is_clear = not segment_faults(grid, [points[tail], points[head]])
        assert found.is_clear[edge] == (is_clear and {cells[tail], cells[head]} <= free)


def test_maps_that_allow_corner_cutting_are_refused():
    grid = hn.OccupancyGrid(np.zeros((4, 4), np.float32), robot_radius_m=0, corner_cutting=True)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    plain: nx.Graph[Any] = nx.Graph()
    plain.add_node(1, x=1, y=1)
    graph = hn.graphs.WaypointGraph.from_networkx(plain)
    with pytest.raises(hn.errors.InvalidValueError, match="corner_cutting"):
        hn.graphs.check_graph(topology, graph)
    with pytest.raises(hn.errors.InvalidValueError, match="expected a WaypointGraph"):
        hn.graphs.check_graph(topology, plain)  # type: ignore[arg-type]
