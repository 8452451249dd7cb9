"""Graphs that others have made: what is read is what was written, in each format."""

import json
import math
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from tests.ext.fleet.files import graph_writers as writers
from tests.ext.fleet.files.graph_writers import Plain
from tests.nav2_reader import read_nav2
from tests.strategies import tried

_NUMBERS = st.floats(-1e6, 1e6, allow_nan=False)
_TEXTS = st.text(st.characters(codec="utf-8", categories=("L", "N", "P", "S")), max_size=20)
_NESTED = st.recursive(
    st.one_of(st.booleans(), st.integers(-(2**40), 2**40), _NUMBERS, _TEXTS),
    lambda inner: st.one_of(
        st.lists(inner, max_size=3), st.dictionaries(_TEXTS, inner, max_size=3)
    ),
    max_leaves=8,
)
_PLAIN = st.one_of(st.booleans(), st.integers(-(2**31), 2**32 - 1), _NUMBERS, _TEXTS)
_HELD = st.recursive(  # as Nav2's metadata hold it: objects nest, lists do not
    st.one_of(_PLAIN, st.lists(_PLAIN, max_size=3)),
    lambda inner: st.dictionaries(_TEXTS, inner, max_size=3),
    max_leaves=8,
)
_WORDS = st.text("abcdefghäß0123456789_-", min_size=1, max_size=12).filter(
    lambda word: word not in {"node", "edges", "vertices", "waypoint"}
)


@st.composite
def plain_graphs(draw, names=_WORDS, values=_NESTED, least_edges=0):
    nodes = draw(st.lists(names, min_size=1, max_size=8, unique=True))
    points = {node: draw(st.tuples(_NUMBERS, _NUMBERS)) for node in nodes}
    pairs = st.tuples(st.sampled_from(nodes), st.sampled_from(nodes))
    edges = draw(st.lists(pairs, min_size=least_edges, max_size=12, unique=True))
    return Plain(points, edges, draw(st.dictionaries(_TEXTS, values, max_size=3)))


for_nav2 = plain_graphs(values=_HELD, least_edges=1)


def means(graph):
    """What a graph states: a point for each node, and ends for each edge."""
    points = dict(zip(graph.names, map(tuple, graph.points.tolist()), strict=True))
    ends = [(graph.names[tail], graph.names[head]) for tail, head in graph.edges.tolist()]
    return points, sorted(ends, key=str)


def expected(plain):
    return plain.points, sorted(plain.edges, key=str)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("graphs")


@tried(60, for_nav2)
def test_nav2(folder, plain):
    ids = writers.write_nav2(folder / "a.geojson", plain)
    graph = hn.ext.fleet.load_graph(folder / "a.geojson")
    assert (graph.format, graph.frame, graph.findings, graph.lines) == ("nav2", "map", (), {})
    points = {ids[node]: point for node, point in plain.points.items()}
    assert means(graph) == (points, sorted([(ids[a], ids[b]) for a, b in plain.edges], key=str))
    assert all(facts["metadata"] == plain.facts for facts in graph.node_facts.values())
    operation = {"type": "go", "trigger": "ON_EXIT", "metadata": plain.facts}
    assert all(facts == {"operations": {"go": operation}} for facts in graph.edge_facts.values())
    assert graph.costs.tolist() == [k / 7 for k in range(len(ids), len(ids) + graph.n_edges)]


_ANY_NAMES = st.one_of(_TEXTS, st.integers())
_GML_NAMES = st.text("abäc<>&' ]#", min_size=1, max_size=8)
_XML_NAMES = st.text("abc<>&'\" ]", min_size=1, max_size=8)
FORMATS = {
    "a.tplg": (writers.write_strands, "strands", "drawn", _WORDS),
    "a.tmap2": (writers.write_tmap2, "tmap2", "drawn", _WORDS),  # with anchors and aliases
    "a.tmap": (writers.write_text, "strands-text", "a", _WORDS),
    "a.graphml": (writers.write_graphml, "graphml", "drawn", _XML_NAMES),
    "a.gml": (writers.write_gml, "gml", "drawn", _GML_NAMES),
    "a.json": (writers.write_node_link, "node-link", "drawn", _ANY_NAMES),
}


@pytest.mark.parametrize("file", FORMATS)
@tried(60, st.data())
def test_what_is_written_is_read(folder, file, data):
    write, form, name, names = FORMATS[file]
    plain = data.draw(plain_graphs(names))
    write(folder / file, plain)
    graph = hn.ext.fleet.load_graph(folder / file)
    assert (graph.format, graph.name, graph.findings) == (form, name, ())
    assert means(graph) == expected(plain)
    nodes, edges = graph.node_facts.values(), graph.edge_facts.values()
    if form in {"strands", "tmap2"}:
        assert all(facts["properties"] == plain.facts for facts in nodes)
        assert all(facts["goal"] == plain.facts for facts in edges)
    elif form == "strands-text":
        assert all(facts["pose"]["qw"] == 1.0 for facts in nodes)
        assert all(facts == {"action": "move_base"} for facts in edges)


@tried(60, plain_graphs(_ANY_NAMES))
def test_networkx_there_and_back(plain):
    graph = hn.graphs.WaypointGraph.from_networkx(plain.directed)
    assert means(graph) == expected(plain)
    back = graph.to_networkx()
    assert dict(back.nodes("x")) == {node: x for node, (x, _) in plain.points.items()}
    assert sorted(((a, b) for a, b in back.edges()), key=str) == expected(plain)[1]
    assert means(hn.graphs.WaypointGraph.from_networkx(back)) == means(graph)


@tried(60, for_nav2)
def test_nav2_written_again_means_the_same(folder, plain):
    writers.write_nav2(folder / "a.geojson", plain)
    graph = hn.ext.fleet.load_graph(folder / "a.geojson")
    hn.graphs.export_nav2(graph, folder / "b.geojson")
    before, after = (read_lenient(folder / name) for name in ("a.geojson", "b.geojson"))
    assert before == after
    read_nav2(folder / "b.geojson", lines=False)
    assert means(hn.ext.fleet.load_graph(folder / "b.geojson")) == means(graph)


def read_lenient(path):
    """What Nav2 holds of a file: nodes and edges by id, with all their properties."""
    nodes: dict[int, Any] = {}
    edges: dict[int, Any] = {}
    for feature in json.loads(path.read_text())["features"]:
        properties = {"frame": "map", **feature["properties"]}
        geometry = feature["geometry"]
        if geometry["type"] == "Point":
            properties["at"] = geometry["coordinates"]
            nodes[properties["id"]] = properties
        elif geometry["type"] in {"LineString", "MultiLineString"}:
            properties.pop("frame")
            edges.setdefault(properties.pop("id"), []).append(properties)
    return nodes, edges


NAV2 = (
    "nav2_bringup/depot_graph.geojson",
    "nav2_bringup/turtlebot3_graph.geojson",
    "nav2_route/aws_graph.geojson",
    "nav2_route/sample_graph.geojson",
    "nav2_route/turtlebot3_graph.geojson",
    "nav2_route/turtlebot4_graph.geojson",
    "nav2_route_test/error_codes.geojson",
    "nav2_route_test/no_frame.json",
)


@pytest.mark.parametrize("name", NAV2)
def test_nav2s_own_graphs_mean_the_same_again(data, tmp_path, name):
    file = data / "nav2" / "graphs" / name
    graph = hn.ext.fleet.load_graph(file)
    hn.graphs.export_nav2(graph, tmp_path / "again.geojson")
    nodes, edges = read_lenient(tmp_path / "again.geojson")
    old_nodes, old_edges = read_lenient(file)
    assert nodes == old_nodes

    def contents(of):
        return sorted(json.dumps(one, sort_keys=True) for each in of.values() for one in each)

    # Ids that two edges have in a sample are replaced for one of them: Nav2 wants them unique.
    assert contents(edges) == contents(old_edges)
    assert old_edges.keys() <= edges.keys()
    if all(len(each) == 1 for each in old_edges.values()):
        assert edges == old_edges
    strict = read_nav2(tmp_path / "again.geojson", costs=False, lines=False)
    assert len(strict.edges) == graph.n_edges


def test_nav2s_damaged_graph_ends_in_one_line(data):
    with pytest.raises(hn.errors.MapError, match="line 1, column 1: no JSON"):
        hn.ext.fleet.load_graph(data / "nav2" / "graphs" / "nav2_route_test" / "invalid.json")


@pytest.mark.parametrize(
    ("name", "form"),
    [
        ("tsc_y3/tsc_y3_final.tplg", ("strands", 82, 239)),
        ("tsc_y4/tsc_y4_final.tplg.tpl", ("strands", 91, 249)),
        ("g4s/g4s_sim.tplg", ("strands-text", 18, 34)),
        ("g4s/g4s_y2.tmap", ("strands-text", 40, 84)),
    ],
)
def test_maps_of_strands(data, tmp_path, name, form):
    file = data / "strands" / name
    graph = hn.ext.fleet.load_graph(file)
    assert (graph.format, graph.n_nodes, graph.n_edges) == form
    assert graph.findings == ()
    text = file.read_text()
    word = "\n  node:\n" if graph.format == "strands" else "node:"
    assert text.count(word) == graph.n_nodes
    # For Nav2, with the names and facts of STRANDS as metadata.
    hn.graphs.export_nav2(graph, tmp_path / "strands.geojson")
    again = read_nav2(tmp_path / "strands.geojson", costs=False)
    assert [facts["name"] for facts in again.node_facts.values()] == list(graph.names)
    assert list(again.points.values()) == [tuple(point) for point in graph.points.tolist()]


def test_what_is_wrong_in_a_file_is_read_around_and_found(tmp_path):
    def node(number, at, **facts):
        geometry = {"type": "Point", "coordinates": at} if at is not None else None
        return {"type": "Feature", "properties": {"id": number, **facts}, "geometry": geometry}

    def edge(number, tail, head, line=None, **facts):
        geometry = {"type": "LineString", "coordinates": line or []}
        properties = {"id": number, "startid": tail, "endid": head, **facts}
        return {"type": "Feature", "properties": properties, "geometry": geometry}

    polygon = {
        "type": "Feature",
        "properties": {"class": "zone"},
        "geometry": {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [1, 1], [0, 0]]]},
    }
    features = [
        node(0, [0, 0], metadata={"region": {"x": [1, 2], "deep": {"er": "yes"}}}),
        node(1, [5, 0]),
        node(1, [6, 0]),
        node(2, []),
        node(3, None),
        node(4, [math.nan, 1]),
        node(5, [1, 2], metadata={"gone": None}),
        node(-7, [2, 2]),
        node("seven", [2, 3]),
        edge(10, 0, 1),
        edge(10, 1, 0, cost=-1),
        edge(11, 0, 99),
        edge(12, 0, 2),
        edge(13, 0, 5, [[0, 0], [9, 9]]),
        edge(5, 0, 5),
        polygon,
    ]
    path = tmp_path / "bad.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    graph = hn.ext.fleet.load_graph(path)
    assert {found.kind: found.count for found in graph.findings} == {
        "no-coordinates": 3,
        "repeated-id": 3,  # node 1, edge 10, and 5 of a node and an edge
        "bad-id": 1,
        "unknown-node": 2,
        "bad-cost": 1,
        "stops-loader": 3,  # no geometry, NaN, null in metadata
        "fails-later": 1,  # -7 becomes 4294967289
        "line-elsewhere": 1,
    }
    # The last node of an id has the edges, as in Nav2.
    assert graph.points[graph.edges[0, 1]].tolist() == [6.0, 0.0]
    assert graph.others == (polygon,)
    assert graph.node_facts[0]["metadata"]["region"]["deep"] == {"er": "yes"}
    hn.graphs.export_nav2(graph, path)
    again = json.loads(path.read_text())["features"]
    assert polygon in again
    clean = hn.ext.fleet.load_graph(path)
    assert {found.kind for found in clean.findings} == {"line-elsewhere", "bad-cost"}


def test_columns_of_drawing_programs_that_are_null_are_no_facts(tmp_path):
    columns = {"id": None, "startid": None, "endid": None, "cost": None, "note": None}
    line = {"type": "MultiLineString", "coordinates": [[[0, 0], [1, 0]]]}
    features = [
        {"properties": columns | {"id": 1}, "geometry": {"type": "Point", "coordinates": [0, 0]}},
        {"properties": columns | {"id": 2}, "geometry": {"type": "Point", "coordinates": [1, 0]}},
        {"properties": columns | {"id": 3, "startid": 1, "endid": 2}, "geometry": line},
        {"properties": {"id": 4, "startid": 2, "endid": 1}},
    ]
    path = tmp_path / "columns.geojson"
    path.write_text(json.dumps({"features": features}))
    graph = hn.ext.fleet.load_graph(path)
    assert (graph.names, graph.edges.tolist()) == ((1, 2), [[0, 1], [1, 0]])
    (found,) = graph.findings  # null where Nav2 does not read it is nothing, as GDAL writes it
    assert [each.where for each in found.examples] == [
        "edge 3 from 1 to 2: cost is null, expected a number",
        "edge 4 from 2 to 1: no geometry",
    ]
    hn.graphs.export_nav2(graph, path)
    assert len(read_nav2(path, costs=False).edges) == 2
    assert hn.ext.fleet.load_graph(path).findings == ()


# The form is that of SWAGGER 0.1.0 (nvidia-isaac/SWAGGER): waypoint_graph_generator.py gives nodes
# `world` (x, y, z) and `pixel`, nx.write_gml writes lists as repeated keys; its own converter takes
# nodes without labels too (integration/nav2/tools/gml_to_geojson.py).
SWAGGER = """graph [
  # a "graph
  node [
    id 0
    {0}
    world 1.5
    world 2.E-05
    world 0.0
    pixel 30
    pixel 40
  ]
  node [
    id 1
    {1}
    world 1e1
    world -2.5e-3
    world 0.0
    pixel 10
    pixel 3
    node_type "1e5 walls"
  ]
  edge [
    source 0
    target 1
    weight 1.2E+1
    edge_type "skeleton"
  ]
]
"""


@pytest.mark.parametrize(
    ("labels", "names"),
    [
        (('label "0"', 'label "1"'), (0, 1)),
        (('label "dock"', 'label "1"'), ("dock", 1)),
        (('label "a"', 'label "a"'), (0, 1)),
        (("", ""), (0, 1)),
    ],
)
def test_gml_of_swagger(tmp_path, labels, names):
    path = tmp_path / "graph.gml"
    path.write_text(SWAGGER.format(*labels))
    graph = hn.ext.fleet.load_graph(path)
    assert (graph.format, graph.names, graph.findings) == ("gml", names, ())
    assert graph.points.tolist() == [[1.5, 2e-5], [10.0, -0.0025]]
    assert graph.edges.tolist() == [[0, 1], [1, 0]]
    assert graph.costs.tolist() == [12.0, 12.0]
    assert graph.node_facts[1]["node_type"] == "1e5 walls"
    hn.graphs.export_nav2(graph, tmp_path / "a.geojson")
    read_nav2(tmp_path / "a.geojson")


def feature(at=None, **properties):
    kind = "LineString" if at is None else "Point"
    geometry = {"type": kind, "coordinates": at or [[0, 0], [1, 0]]}
    return {"type": "Feature", "properties": properties, "geometry": geometry}


NODE, EDGE = feature([0, 0], id=1), feature(id=3, startid=1, endid=2)
GO = {"type": "go", "trigger": "NODE"}


# Each by geojson_graph_file_loader.cpp of nav2_route 1.5.0 and the types that nlohmann/json
# converts: what throws stops the loader; the scorers' any_cast and route_planner.cpp come later.
@pytest.mark.parametrize(
    ("kind", "node", "edge"),
    [
        (None, {"metadata": None, "operations": None, "cost": None, "overridable": None}, {}),
        (None, {"note": None, "region": {"a": [None]}}, {"note": None, "frame": None}),
        (None, {"id": 1.0}, {"id": 3.0, "startid": 1, "endid": 2.0, "cost": True}),
        (None, {"metadata": "text"}, {"metadata": {}, "operations": {}, "overridable": False}),
        (None, {"operations": {"go": GO | {"metadata": None}}}, {"metadata": [{"a": None}, 1]}),
        ("stops-loader", {"frame": None}, {}),
        ("stops-loader", {"frame": 7}, {}),
        ("stops-loader", {"metadata": {"a": {"b": None}}}, {}),
        ("stops-loader", {"metadata": {"a": [1, None]}}, {}),
        ("stops-loader", {"metadata": {"a": [[1]]}}, {}),
        ("stops-loader", {}, {"metadata": {"a": [{"b": 1}]}}),
        ("stops-loader", {}, {"cost": "5"}),
        ("stops-loader", {}, {"cost": None}),
        ("stops-loader", {}, {"overridable": 1}),
        ("stops-loader", {}, {"operations": [{"type": "go"}]}),
        ("stops-loader", {"operations": {"go": {"trigger": "NODE"}}}, {}),
        ("stops-loader", {"operations": "go"}, {}),
        ("stops-loader", {"operations": [GO | {"metadata": {"a": None}}]}, {}),
        ("stops-loader", {"anything": math.nan}, {}),
        ("stops-loader", {}, {"anything": [{"a": -math.inf}]}),
        ("stops-loader", {"anything": "\ud800"}, {}),
        ("stops-loader", {"anything": 10**400}, {}),
        ("bad-id", {}, {"id": "3"}),
        ("fails-later", {}, {"id": -1}),  # 4294967295
        ("fails-later", {}, {"id": 3.5}),  # 3
        ("fails-later", {}, {"metadata": {"speed_limit": 50}}),
        ("fails-later", {}, {"metadata": {"speed_limit": 0.0}}),
        ("fails-later", {}, {"metadata": {"abs_speed_limit": 1}}),
        ("fails-later", {}, {"metadata": {"abs_time_taken": "1.5"}}),
        ("fails-later", {}, {"metadata": {"penalty": 3}}),
        ("fails-later", {"metadata": {"class": 3}}, {}),
        ("fails-later", {}, {"metadata": {"class": ["door"]}}),
        ("fails-later", {}, {"cost": 0, "overridable": False}),
        ("fails-later", {"operations": [GO | {"trigger": "on_enter"}]}, {}),
        ("fails-later", {}, {"operations": [GO | {"metadata": {"service_name": 3}}]}),
    ],
)
def test_what_stops_nav2_is_an_error_and_what_fails_later_a_warning(tmp_path, kind, node, edge):
    nodes = [feature([0, 0], **{"id": 1, "frame": "map"} | node), feature([1, 0], id=2)]
    path = tmp_path / "a.geojson"
    link = feature(**{"id": 3, "startid": 1, "endid": 2, "cost": 2.5} | edge)
    path.write_text(json.dumps({"type": "FeatureCollection", "features": [*nodes, link]}))
    graph = hn.ext.fleet.load_graph(path)
    severity = {"fails-later": "warning"}.get(kind or "", "error")
    assert [(one.kind, one.count, one.severity) for one in graph.findings] == (
        [] if kind is None else [(kind, 1, severity)]
    )
    assert graph.edges.tolist() == [[0, 1]]
    hn.graphs.export_nav2(graph, path)
    read_nav2(path, costs=False)
    assert hn.ext.fleet.load_graph(path).findings == ()


@pytest.mark.parametrize("more", ['"crs": NaN', '"n": [1e999]', '"n": {"a": "\\udc00"}'])
def test_what_no_json_holds_stops_nav2_anywhere_in_the_file(tmp_path, more):
    features = json.dumps([NODE, feature([1, 0], id=2), EDGE])
    path = tmp_path / "a.geojson"
    path.write_text(f'{{"features": {features}, {more}}}')
    (found,) = hn.ext.fleet.load_graph(path).findings
    assert (found.kind, found.count) == ("stops-loader", 1)


def test_coordinates_as_texts_stop_nav2(tmp_path):
    path = tmp_path / "a.geojson"
    path.write_text(json.dumps({"features": [feature(["0", "0"], id=1), NODE | EDGE]}))
    graph = hn.ext.fleet.load_graph(path)
    assert graph.points.tolist() == [[0.0, 0.0]]
    assert "expected numbers" in graph.findings[-1].examples[0].where


def test_a_graph_that_nav2_has_saved_is_read_as_it_was(tmp_path):
    # geojson_graph_file_saver.cpp of nav2_route 1.5.0: a MultiLineString without coordinates,
    # operations as an object by their types, numbers of 32 bits, and no `metadata` where none are.
    nodes = [(0, [0.10000000149011612, 2.5]), (7, [3.299999952316284, 2.5])]
    operation = {"OpenDoor": {"type": "OpenDoor", "trigger": "ON_ENTER", "metadata": {"door": 1}}}
    properties = {"id": 9, "startid": 0, "endid": 7, "cost": 3.200000047683716}
    saved = [feature(at, id=number, frame="map") for number, at in nodes]
    saved.append(feature(**properties, overridable=True, operations=operation))
    saved[-1]["geometry"] = {"type": "MultiLineString"}
    path = tmp_path / "saved.geojson"
    path.write_text(json.dumps({"type": "FeatureCollection", "features": saved}))
    graph = hn.ext.fleet.load_graph(path)
    assert (graph.findings, graph.lines, graph.names) == ((), {}, (0, 7))
    hn.graphs.export_nav2(graph, tmp_path / "again.geojson")
    assert read_lenient(tmp_path / "again.geojson") == read_lenient(path)
    again = hn.ext.fleet.load_graph(tmp_path / "again.geojson")
    changes = hn.graphs.graph_changes(graph, again)
    assert not any(ids for of in changes.values() for ids in of.values())


def test_limits_in_metres_per_second_are_those_of_the_time_scorer(tmp_path):
    # time_scorer.cpp reads `abs_speed_limit` in m/s; adjust_speed_limit.cpp publishes
    # `speed_limit` as per cent of full speed.
    (tmp_path / "a.yaml").write_text(
        "levels: {L1: {vertices: [[0, 0, {}], [3, 4, {}]], lanes: "
        "[[0, 1, {speed_limit: 1}], [1, 0, {speed_limit: 0.5}]]}}"
    )
    graph = hn.ext.fleet.load_graph(tmp_path / "a.yaml")
    hn.graphs.export_nav2(graph, tmp_path / "a.geojson")
    facts = list(read_nav2(tmp_path / "a.geojson", costs=False).edge_facts.values())
    assert [each["abs_speed_limit"] for each in facts] == [1.0, 0.5]
    assert all("speed_limit" not in each for each in facts)


def test_points_in_a_frame_of_their_own_are_turned_and_moved(tmp_path):
    turn = {"w": math.cos(math.pi / 4), "x": 0.0, "y": 0.0, "z": math.sin(math.pi / 4)}
    place = {"child": "topo", "parent": "map", "rotation": turn, "translation": {"x": 10, "y": 20}}
    nodes = [
        {"node": {"name": frame, "parent_frame": frame, "pose": {"position": {"x": 3, "y": 1}}}}
        for frame in ("topo", "map")
    ]
    path = tmp_path / "a.tmap2"
    path.write_text(json.dumps({"transformation": place, "nodes": nodes}))  # JSON is YAML
    graph = hn.ext.fleet.load_graph(path)
    assert graph.points[0].tolist() == pytest.approx([9.0, 23.0])
    assert graph.points[1].tolist() == [3.0, 1.0]


@pytest.mark.parametrize(
    "facts",
    [
        {"x": 1.5, "y": -2},
        {"pos": (1.5, -2.0)},
        {"pos": "1.5, -2"},
        {"point": np.array([1.5, -2.0])},
        {"world": [1.5, -2.0, 0.0], "pos": (300, 400)},
        {"x": "1.5", "y": "-2"},
    ],
)
def test_attributes_that_hold_a_point(facts):
    graph: nx.Graph[Any] = nx.Graph()
    graph.add_node("a", **facts)
    assert hn.graphs.WaypointGraph.from_networkx(graph).points.tolist() == [[1.5, -2.0]]


def test_undirected_graphs_and_loops_have_the_edges_that_they_mean(tmp_path):
    plain: nx.MultiGraph[Any] = nx.MultiGraph()
    plain.add_nodes_from([("a", {"x": 0, "y": 0}), ("b", {"x": 3, "y": 4})])
    plain.add_edges_from([("a", "b"), ("a", "b"), ("a", "a")])
    here = hn.graphs.WaypointGraph.from_networkx(plain)
    nx.write_graphml(plain, tmp_path / "a.graphml")
    (tmp_path / "a.json").write_text(json.dumps(nx.node_link_data(plain, edges="edges")))
    for graph in (
        here,
        *map(hn.ext.fleet.load_graph, (tmp_path / "a.graphml", tmp_path / "a.json")),
    ):
        assert means(graph)[1] == [("a", "a"), *[("a", "b")] * 2, *[("b", "a")] * 2]
        assert set(graph.lengths_m.tolist()) == {0.0, 5.0}
