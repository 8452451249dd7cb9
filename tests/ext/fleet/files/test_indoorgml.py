"""The dual graph as IndoorGML 2.0: valid by the draft's schema, true to the map, and read back."""

import json
import math
from collections import Counter
from dataclasses import replace
from typing import Any

import jsonschema
import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from referencing import Registry, Resource
from referencing.jsonschema import DRAFT202012

import hybridnav as hn
from hybridnav.ext.fleet import Building, Floor, Link, LinkEnd
from tests.drawn_rooms import HOUSE, topology_of
from tests.ext.hostile import reader
from tests.strategies import class_grids, examples, occupancy_grid, tried

POSITION = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 3}


def _geometry(kind, coordinates):
    kinds = {"type": {"const": kind}, "coordinates": coordinates}
    return {"type": "object", "required": ["type", "coordinates"], "properties": kinds}


def _list(items, least):
    return {"type": "array", "items": items, "minItems": least}


# The geometry objects of OGC Features and Geometries JSON (JSON-FG, 21-045), as far as the core
# schema of IndoorGML 2.0 names them: closed rings of four positions or more, as in GeoJSON.
JSON_FG = {
    "$schema": "https://json-schema.org/draft/2020-12/schema",
    "$defs": {
        "Point": _geometry("Point", POSITION),
        "LineString": _geometry("LineString", _list(POSITION, 2)),
        "Polygon": _geometry("Polygon", _list(_list(POSITION, 4), 1)),
        "Polyhedron": _geometry("Polyhedron", {"type": "array"}),
    },
}
GEOMETRY = "https://schemas.opengis.net/json-fg/geometry-object.json"


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    return tmp_path_factory.mktemp("indoor") / "house.json"


def topology(classes, labels=None):
    rooms = None if labels is None else hn.RoomLabels(("west", "east"), labels)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(classes), rooms=rooms))


def house():
    floors = [Floor(name, hn.HybridPlanner(topology_of(HOUSE))) for name in ("ground", "1")]
    middle = floors[0].planner.topology.rooms.point_of("corridor")
    ends = tuple(LinkEnd(floor.name, middle) for floor in floors)
    return Building(floors, [Link(name="west", kind="lift", ends=ends, ride_s=20, max_radius_m=1)])


def test_a_map_and_a_building_are_valid_by_the_schema_of_the_draft(data, path):
    schema = json.loads((data / "indoorgml2" / "indoorjson.core.schema.json").read_text())
    resource = Resource.from_contents(JSON_FG, default_specification=DRAFT202012)
    registry = Registry().with_resource(GEOMETRY, resource)
    validator = jsonschema.Draft202012Validator(schema, registry=registry)
    for source in (topology_of(HOUSE), house(), topology(np.full((3, 3), hn.CellClass.FREE))):
        hn.ext.fleet.export_indoorgml(source, path)
        written = json.loads(path.read_text())
        validator.validate(written)
        # `maximum` stands in the draft where `maxItems` is meant.
        for layer in written["layers"]:
            edges = layer["dualSpace"]["edgeMember"]
            assert all(len(set(edge["connects"])) == len(edge["connects"]) == 2 for edge in edges)
        del written["layers"][0]["dualSpace"]["nodeMember"][0]["duality"]
        with pytest.raises(jsonschema.ValidationError):
            validator.validate(written)


def _by_id(members):
    assert len({each["id"] for each in members}) == len(members)
    return {each["id"]: each for each in members}


def _check_duality(layer):
    primal, dual = layer["primalSpace"], layer["dualSpace"]
    cells, nodes = _by_id(primal["cellSpaceMember"]), _by_id(dual["nodeMember"])
    lines, edges = _by_id(primal["cellBoundaryMember"]), _by_id(dual["edgeMember"])
    for ones, others in ((cells, nodes), (nodes, cells), (edges, lines), (lines, edges)):
        for name, each in ones.items():
            assert "duality" not in each or others[each["duality"]]["duality"] == name
    for name, edge in edges.items():
        for end in edge["connects"]:
            assert name in nodes[end]["connects"]
            if "duality" in edge:
                assert edge["duality"] in cells[nodes[end]["duality"]]["boundedBy"]
    return cells, nodes, lines, edges


@tried(60, class_grids(14))
def test_cells_are_places_and_edges_are_arcs_with_the_lines_between_them(path, classes):
    here = topology(classes)
    if not here.n_places:
        return
    hn.ext.fleet.export_indoorgml(here, path)
    (layer,) = json.loads(path.read_text())["layers"]
    cells, nodes, lines, edges = _check_duality(layer)
    areas = {}
    for cell, entry in cells.items():
        outer, *inner = entry["cellSpaceGeom"]["geometry2D"]["coordinates"]
        areas[cell] = shapely.Polygon(outer, inner)
        assert areas[cell].is_valid
        assert areas[cell].exterior.is_ccw
        place = int(cell.removeprefix("P0."))
        assert areas[cell].area == here.areas_m2[place]
        assert nodes[entry["duality"]]["geometry"]["coordinates"] == here.positions[place].tolist()
        assert areas[cell].covers(shapely.Point(here.positions[place]))
    assert sum(area.area for area in areas.values()) == shapely.union_all([*areas.values()]).area
    ends = []
    for edge in edges.values():
        both = [nodes[end]["duality"] for end in edge["connects"]]
        ends.append(tuple(sorted(int(cell.removeprefix("P0.")) for cell in both)))
        line = lines[edge["duality"]]["cellBoundaryGeom"]["geometry2D"]["coordinates"]
        for cell in both:
            assert areas[cell].boundary.covers(shapely.LineString(line))
    arcs = np.sort(here.arcs, axis=1).tolist()
    assert Counter(ends) == Counter(tuple(pair) for pair in arcs if pair[0] != pair[1])
    # A boundary inside one place, round what it encloses, has no edge.
    loops = [name for name, line in lines.items() if "duality" not in line]
    assert len(loops) == sum(one == other for one, other in arcs)
    lengths = {
        name: shapely.LineString(line["cellBoundaryGeom"]["geometry2D"]["coordinates"]).length
        for name, line in lines.items()
    }
    assert [lengths[f"A0.{arc}"] for arc in here.arc_ids] == here.level.n_cracks.tolist()


@tried(60, class_grids(14), st.booleans())
def test_what_is_written_is_read_and_written_again(path, classes, with_rooms):
    labels = np.where(np.arange(classes.shape[1]) < classes.shape[1] // 2, 0, 1)
    labels = np.broadcast_to(labels, classes.shape)
    here = topology(classes, labels if with_rooms else None)
    if not here.n_places:
        return
    hn.ext.fleet.export_indoorgml(here, path)
    model, before = hn.ext.fleet.load_indoorgml(path), path.read_bytes()
    assert hn.ext.fleet.export_indoorgml(model, path) == ()
    assert path.read_bytes() == before


def test_rooms_contain_their_places_and_doors_join_them(path):
    here = topology_of(HOUSE)
    assert hn.ext.fleet.export_indoorgml(here, path) == ()
    for layer in json.loads(path.read_text())["layers"]:
        _check_duality(layer)
    model = hn.ext.fleet.load_indoorgml(path)
    layers: dict[str, Any] = dict(model.layers)
    places, rooms = layers["places"], layers["rooms"]
    names = dict(rooms.nodes("name"))
    assert sorted(names.values()) == sorted(here.rooms.names)
    doors = Counter(tuple(sorted(map(str, door.rooms))) for door in here.rooms.doors)
    assert doors == Counter(tuple(sorted((names[a], names[b]))) for a, b in rooms.edges())
    assert {expression for expression, _, _ in model.connections} == {"CONTAINS"}
    inside = Counter(place for _, _, place in model.connections)
    assert set(inside.values()) == {1}
    for _, room, place in model.connections:
        (outer, *holes), (own, *_) = rooms.nodes[room]["polygon"], places.nodes[place]["polygon"]
        assert shapely.Polygon(outer, holes).buffer(1e-5).covers(shapely.Polygon(own))


def test_a_room_of_occupied_cells_alone_is_left_out(path):
    classes = np.full((4, 8), hn.CellClass.FREE)
    classes[:, 4:] = hn.CellClass.OCCUPIED
    hn.ext.fleet.export_indoorgml(topology(classes, np.arange(8) // 4 * np.ones((4, 1), int)), path)
    rooms: Any = hn.ext.fleet.load_indoorgml(path).layers["rooms"]
    assert [name for _, name in rooms.nodes("name")] == ["west"]


def test_directions_are_said_to_be_left_out(path):
    building = house()
    links = [replace(link, one_way="up") for link in building.links]
    up = hn.ext.fleet.Building(building.floors, links)
    assert "lift west ↑: its direction" in hn.ext.fleet.export_indoorgml(up, path)
    rule = hn.OneWayRule(line=((4, 0), (4, 4)))
    names = "west", "east"
    label_of = (np.arange(8) // 4 * np.ones((4, 1), int)).astype(np.int32)
    labels = hn.RoomLabels(names, label_of, one_way=(rule,))
    grid = occupancy_grid(np.ones((4, 8), np.uint8))
    directed = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    left_out = hn.ext.fleet.export_indoorgml(directed, path)
    assert left_out == ("directions of 1 one-way doors and lines",)


def test_floors_are_levels_and_a_lift_is_a_transfer_space_on_each(path):
    building = house()
    left_out = hn.ext.fleet.export_indoorgml(building, path)
    assert left_out == ("lift west: the largest robot that fits in",)
    places: Any = hn.ext.fleet.load_indoorgml(path).layers["places"]
    n_places = building.floors[0].planner.topology.n_places
    assert Counter(level for _, level in places.nodes("level")) == {
        "ground": n_places + 1,
        "1": n_places + 1,
    }
    lifts = [cell for cell, kind in places.nodes("kind") if kind == "TransferSpace"]
    assert [places.nodes[cell]["name"] for cell in lifts] == ["lift west"] * 2
    (ride,) = places.get_edge_data(*lifts).values()
    assert ride["weight"] == 10.0  # 20 s at 0.5 m/s
    read = hn.ext.fleet.load_building_graph(path)
    assert [floor.name for floor in read.floors] == ["ground", "1"]
    assert [(link.kind, link.name, link.ends) for link in read.links] == [
        ("lift", "west", building.links[0].ends)
    ]
    floor = hn.ext.fleet.load_graph(path, floor="1")
    assert floor.n_nodes == n_places + 1
    assert (floor.format, floor.findings) == ("indoorgml", ())


# In the manner of others: references with paths, names without the colon, booleans as texts, null
# for no dual, lines without `geometry2D`, words in lower case (test_postgresql_indoordb.py of a
# provider of pygeoapi for IndoorGML 2.0, 2026).
OF_OTHERS = {
    "featureType": "IndoorFeatures",
    "id": "shop",
    "layers": [
        {
            "id": "TL-1",
            "featureType": "ThematicLayer",
            "semanticExtension": "false",
            "primalSpace": {
                "id": "PS-1",
                "cellSpaceMember": [
                    {
                        "id": name,
                        "duality": f"TL-1:DS-1:{node}",
                        "poi": True,
                        "level": "1F",
                        "cellSpaceName": name.lower(),
                        "cellSpaceGeom": {"geometry2D": {"type": "Polygon", "coordinates": ring}},
                        "boundedBy": ["TL-1:PS-1:B1"],
                    }
                    for name, node, ring in (
                        ("C1", "N1", [[[0, 0], [2, 0], [2, 2], [0, 2], [0, 0]]]),
                        ("C2", "N2", [[[2, 0], [4, 0], [4, 2], [2, 2], [2, 0]]]),
                    )
                ],
                "cellBoundaryMember": [
                    {
                        "id": "B1",
                        "isVirtual": False,
                        "duality": None,
                        "cellBoundaryGeom": {"type": "LineString", "coordinates": [[2, 0], [2, 2]]},
                    }
                ],
            },
            "dualSpace": {
                "id": "DS-1",
                "isDirected": True,
                "nodeMember": [
                    {"id": "N1", "duality": "TL-1:PS-1:C1",
                     "geometry": {"type": "Point", "coordinates": [1, 1]}},
                    {"id": "N2", "duality": "#C2",
                     "geometry": {"type": "Point", "coordinates": [3, 1, 0]}},
                ],
                "edgeMember": [
                    {"id": "E1", "duality": "B1", "weight": 1.5,
                     "connects": ["TL-1:DS-1:N1", "TL-1:DS-1:N2"]},
                    {"id": "E2", "weight": 2, "connects": ["N1", "N2"]},
                ],
            },
        },
        {
            "id": "TL-2",
            "primalSpace": {"cellSpaceMember": [{"id": "all", "poi": False}]},
            "dualSpace": {"nodeMember": [{"id": "M1", "duality": "all"}]},
        },
    ],
    "layerConnections": [
        {"id": "X", "typeOfTopoExpression": "contains", "connectedNodes": ["TL-2:D:M1", "N1"]}
    ],
}  # fmt: skip


def test_a_file_in_the_manner_of_others_is_read_and_becomes_one_by_the_draft(path):
    path.write_text(json.dumps(OF_OTHERS))
    model = hn.ext.fleet.load_indoorgml(path)
    layer = model.layers["TL-1"]
    assert (model.name, list(model.layers), layer.is_directed()) == ("shop", ["TL-1", "TL-2"], True)
    assert [(a, b, key) for a, b, key in layer.edges(keys=True)] == [
        ("C1", "C2", "E1"),
        ("C1", "C2", "E2"),
    ]
    assert layer.edges["C1", "C2", "E1"]["line"] == [(2.0, 0.0), (2.0, 2.0)]
    assert layer.nodes["C2"]["point"] == (3.0, 1.0)
    assert model.connections == (("CONTAINS", "all", "C1"),)
    graph = hn.ext.fleet.load_graph(path)
    assert (graph.names, graph.edges.tolist()) == (("C1", "C2"), [[0, 1], [0, 1]])
    assert graph.costs.tolist() == [1.5, 2.0]
    hn.ext.fleet.export_indoorgml(model, path)
    written = json.loads(path.read_text())
    assert written["layers"][0]["primalSpace"]["cellSpaceMember"][0]["cellSpaceName:"] == "c1"
    for each in written["layers"]:
        _check_duality(each)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"featureType": "ThematicLayer"}, "expected IndoorGML 2.0"),
        ({"layers": 3}, "layers"),
        ({"layers": [{"primalSpace": {"cellSpaceMember": [{}]}}]}, "expected an id of its own"),
        ({"layers": [{"dualSpace": {"nodeMember": [{"id": "n", "duality": "x"}]}}]}, "of nothing"),
        ({"layerConnections": [{"connectedCells": ["C1"]}]}, "expected two ends"),
        ({"layerConnections": [{"connectedCells": ["C1", {}]}]}, "of nothing"),
    ],
)
def test_what_is_no_indoorgml_ends_in_one_line(tmp_path, change, words):
    content = json.dumps(OF_OTHERS | change)
    assert words in reader(hn.ext.fleet.load_indoorgml, tmp_path)("a.json", content)


@pytest.mark.parametrize("number", ["Infinity", "NaN", "-1e999"])
def test_a_number_that_json_cannot_hold_is_refused(tmp_path, number):
    content = json.dumps(OF_OTHERS | {"level": 7}).replace('"level": 7', f'"level": {number}')
    words = reader(hn.ext.fleet.load_indoorgml, tmp_path)("a.json", content)
    assert f"{number} is no number of JSON" in words


def _places(value, path=()):
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, each in items:
        yield (*path, key)
        if isinstance(each, (dict, list)):
            yield from _places(each, (*path, key))


@given(st.sampled_from(list(_places(OF_OTHERS))), st.data())
@settings(max_examples=examples(120), suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_value_of_any_kind_at_any_place(tmp_path, at, data):
    changed = json.loads(json.dumps(OF_OTHERS))
    target: Any = changed
    for key in at[:-1]:
        target = target[key]
    odd: st.SearchStrategy[Any] = st.sampled_from(
        [None, True, -1, math.inf, "", "C1", [], {}, [[]], ["N1"], [{"id": 3}]]
    )
    target[at[-1]] = data.draw(odd)
    content = json.dumps(changed)
    model = reader(hn.ext.fleet.load_indoorgml, tmp_path)("a.json", content)
    if not isinstance(model, str):
        hn.ext.fleet.export_indoorgml(model, tmp_path / "b.json")
        again = hn.ext.fleet.load_indoorgml(tmp_path / "b.json")
        assert list(again.layers) == list(model.layers)
        reader(hn.ext.fleet.load_graph, tmp_path)("a.json", content)


def test_other_things_are_refused(tmp_path):
    with pytest.raises(hn.errors.InvalidValueError, match="expected a TopologicalMap"):
        hn.ext.fleet.export_indoorgml(3, tmp_path / "a.json")  # type: ignore[arg-type]
    with pytest.raises(hn.errors.MapError, match="json"):
        hn.ext.fleet.export_indoorgml(topology_of(HOUSE), tmp_path / "a.gml")
