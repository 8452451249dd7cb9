"""Buildings in VDMA's Layout Interchange Format: valid by a schema, and read back."""

import itertools
import json
from collections import Counter
from datetime import datetime, timedelta, timezone

import pytest
from hypothesis import assume

import hybridnav as hn
from hybridnav.ext.fleet import join_links
from tests.ext.fleet.files.drawn_buildings import buildings
from tests.ext.fleet.files.lif_schema import read_lif
from tests.strategies import tried

NOON = datetime(2026, 3, 1, 12, 30, 15, 120000, tzinfo=timezone.utc)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("lif") / "house.json"


@tried(150, buildings())
def test_a_master_control_finds_every_node_and_edge(file, building):
    joined = join_links(building)
    ids = [f"{floor.name}/{node}" for floor in joined.floors for node in range(floor.graph.n_nodes)]
    assume(len(set(ids)) == len(ids))
    hn.ext.fleet.export_lif(building, file, vehicle_types=["A.B", "C.D"], exported_at=NOON)
    data = read_lif(file)
    assert data["metaInformation"]["exportTimestamp"] == "2026-03-01T12:30:15.12Z"
    for layout, floor in zip(data["layouts"], joined.floors, strict=True):
        assert layout["layoutLevelId"] == floor.name
        for node, point in zip(layout["nodes"], floor.graph.points.tolist(), strict=True):
            assert tuple(node["nodePosition"].values()) == pytest.approx(tuple(point), abs=1e-6)
        for entry in [*layout["nodes"], *layout["edges"]]:
            types = entry.get("vehicleTypeNodeProperties", entry.get("vehicleTypeEdgeProperties"))
            assert [kind["vehicleTypeId"] for kind in types] == ["A.B", "C.D"]
    crossing = Counter(
        (edge["edgeName"], layout["layoutId"])
        for layout in data["layouts"]
        for edge in layout["edges"]
        if edge["endNodeId"] not in {node["nodeId"] for node in layout["nodes"]}
    )
    wanted = Counter(
        (f"{link.kind} {link.name}", floor)
        for link in building.links
        for low, high in itertools.pairwise(end.floor for end in link.ends)
        for floor, way in ((low, "up"), (high, "down"))
        if link.one_way in (None, way)
    )
    assert crossing == wanted


@tried(150, buildings())
def test_what_is_read_back_is_what_was_written(file, building):
    joined = join_links(building)
    hn.ext.fleet.export_lif(building, file, vehicle_types=["A.B"])
    back = hn.ext.fleet.load_building_graph(file)
    assert [floor.name for floor in back.floors] == [floor.name for floor in joined.floors]
    for read, written in zip(back.floors, joined.floors, strict=True):
        assert read.graph.points == pytest.approx(written.graph.points, abs=1e-6)
        assert read.graph.edges.tolist() == written.graph.edges.tolist()
        speeds = [
            [graph.edge_facts.get(edge, {}).get("speed_limit") for edge in range(graph.n_edges)]
            for graph in (read.graph, written.graph)
        ]
        assert speeds[0] == speeds[1]
    assert {(link.name, link.kind, link.one_way) for link in back.links} == {
        (link.name, link.kind, link.one_way) for link in building.links
    }
    ends = {link.name: link.ends for link in back.links}
    for link in building.links:
        for one, other in zip(ends[link.name], link.ends, strict=True):
            assert one.floor == other.floor
            assert one.position_m == pytest.approx(other.position_m, abs=0.011)


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("levels: {L1: {vertices: [[0, 0, {}], [3, 4, {}]], lanes: [[0, 1, {}]]}}")
    return hn.ext.fleet.load_building_graph(path)


def test_times_are_written_in_utc(small, tmp_path):
    here = NOON.astimezone(timezone(timedelta(hours=2)))
    for at in (NOON, here):
        hn.ext.fleet.export_lif(small, tmp_path / "a.lif", vehicle_types=["A.B"], exported_at=at)
        data = json.loads((tmp_path / "a.lif").read_text())
        assert data["metaInformation"]["exportTimestamp"] == "2026-03-01T12:30:15.12Z"
    plain = NOON.replace(tzinfo=None)
    with pytest.raises(hn.errors.InvalidValueError, match="expected a time with a time zone"):
        hn.ext.fleet.export_lif(small, tmp_path / "a.lif", vehicle_types=["A.B"], exported_at=plain)


@pytest.mark.parametrize("types", [[], "A.B", [""], [3]])
def test_a_layout_needs_vehicle_types(small, tmp_path, types):
    with pytest.raises(hn.errors.InvalidValueError, match="expected one or more texts"):
        hn.ext.fleet.export_lif(small, tmp_path / "a.json", vehicle_types=types)


@pytest.mark.parametrize(
    ("drawn", "read"),
    [
        (["lift A", "B"], ["lift A", "lift B"]),
        (["lift A", "A"], ["lift lift A", "lift A"]),
        (["lift A", "stairs A"], ["lift lift A", "stairs stairs A"]),
        (["lift lift A", "lift A"], ["lift lift A", "lift A"]),
        (["A", "lift A", "lift lift A"], ["lift A", "lift lift A", "lift lift lift A"]),
    ],
)
def test_links_of_any_names_are_read(tmp_path, drawn, read):
    """`read` has the kind before each name."""
    node = {"nodePosition": {"x": 1, "y": 2}}
    edges = [
        {"edgeId": f"e{at}", "edgeName": name, "startNodeId": "a", "endNodeId": "b"}
        for at, name in enumerate(drawn)
    ]
    layouts = [
        {"layoutLevelId": "1", "nodes": [node | {"nodeId": "a"}], "edges": edges},
        {"layoutLevelId": "2", "nodes": [node | {"nodeId": "b"}]},
    ]
    (tmp_path / "a.json").write_text(json.dumps({"layouts": layouts}))
    links = hn.ext.fleet.load_building_graph(tmp_path / "a.json").links
    assert [f"{link.kind} {link.name}" for link in links] == read


def test_graphs_of_one_floor_are_graphs(small, tmp_path):
    hn.ext.fleet.export_lif(small, tmp_path / "a.json", vehicle_types=["A.B"])
    graph = hn.ext.fleet.load_graph(tmp_path / "a.json")
    assert (graph.format, graph.n_nodes, graph.n_edges) == ("lif", 2, 1)


def test_a_layout_of_version_2_is_named(tmp_path):
    # VDMA's LIF 2.0.0 has its layouts under `origins`.
    data = {"metaInformation": {"lifVersion": "2.0.0"}, "origins": [{"layouts": []}]}
    (tmp_path / "a.lif.json").write_text(json.dumps(data))
    with pytest.raises(hn.errors.MapError, match=r"LIF 2\.0\.0 is not read, 1\.0\.0 is: export"):
        hn.ext.fleet.load_graph(tmp_path / "a.lif.json")


def test_stations_are_facts_of_their_nodes(tmp_path):
    node = {"nodePosition": {"x": 1, "y": 2}}
    stations = [
        {"stationId": "s1", "stationName": "dock", "interactionNodeIds": ["a"]},
        {"stationId": "s2", "interactionNodeIds": ["a", "gone"]},
    ]
    nodes = [node | {"nodeId": "a"}, {"nodeId": "b", "nodePosition": {"x": 3, "y": 2}}]
    layouts = [{"layoutId": "1", "nodes": nodes, "edges": [], "stations": stations}]
    (tmp_path / "a.json").write_text(json.dumps({"metaInformation": {}, "layouts": layouts}))
    graph = hn.ext.fleet.load_graph(tmp_path / "a.json")
    assert graph.node_facts[0]["stations"] == ["dock", "s2"]
    assert "stations" not in graph.node_facts[1]
