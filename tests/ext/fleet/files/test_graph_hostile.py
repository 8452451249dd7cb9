"""Damaged and hostile files of graphs: one clear line, or a graph, in bounded time and memory."""

import json
import subprocess
import sys
import textwrap
from typing import Any

import networkx as nx
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import hybridnav as hn
from tests.ext.fleet.files import graph_writers as writers
from tests.ext.fleet.files.graph_writers import Plain
from tests.ext.hostile import reader
from tests.nav2_reader import read_nav2
from tests.strategies import examples

NODE = '{"type":"Feature","properties":{"id":1},"geometry":{"type":"Point","coordinates":[1,2]}}'
SMALL = Plain({"a": (0.5, 0.5), "b": (3.5, 0.5)}, [("a", "b"), ("b", "a")], {"k": [1, {"z": 2}]})
BOMB = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]\n" for k in range(1, 12)
)
POSE = "pose: {position: {x: 1, y: 2}}, edges: [{node: a}, {node: b}]"
ODD = '{"id": null, "x": 1e999, "y": 0}'
LINK = '{"source": [1, [2]], "target": {"a": 1}}'
ENTITIES = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 10))


@pytest.fixture
def read(tmp_path):
    return reader(hn.ext.fleet.load_graph, tmp_path)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.geojson", "", "expected '{'"),
        ("a.geojson", "[1, 2]", "expected '{'"),
        ("a.geojson", b"\xff\xfe", "not UTF-8"),
        ("a.geojson", '{"features": [', "no JSON"),
        ("a.geojson", '{"features": [1]}', "list of objects"),
        ("a.geojson", '{"features": {}}', "list of objects"),
        ("a.geojson", '{"features": []}', "no node has a point"),
        ("a.geojson", f'{{"features": [{NODE}]}} more', "more text after the end"),
        ("a.geojson", '{"features": [' + "[" * 100_000, "nested"),
        ("a.geojson", '{"features": [{"a": ' + "9" * 5000 + "}]}", "too many digits"),
        ("a.geojson", '{"a": "' + "x" * 5_000_000 + '"}', "one value of more than"),
        ("a.geojson", '{"a": [' + "[]," * 9_000_000 + "[]]}", "values is not read"),
        ("a.json", '{"nodes": []}', "expected a graph of Nav2"),
        ("a.json", '{"nodes": [{"x": 1}], "links": []}', "a node has no id"),
        ("a.json", '{"nodes": [{"id": 1, "x": 1, "y": 2}], "links": [{}]}', "no source"),
        ("a.json", '{"nodes": [{"id": 1}], "links": []}', "no node has a point"),
        ("a.graphml", "", "no XML"),
        ("a.graphml", "<html></html>", "expected GraphML"),
        ("a.graphml", f"<!DOCTYPE g [{ENTITIES}]><graphml>&e9;</graphml>", "DOCTYPE"),
        ("a.graphml", "<graphml>" + "<a>" * 100_000, "nested more than"),
        ("a.graphml", "<graphml><graph><node/></graph></graphml>", "a node has no id"),
        ("a.graphml", "<graphml><graph><edge/></graph></graphml>", "an edge has no source"),
        ("a.graphml", "<graphml></graphml>", "no node has a point"),
        ("a.gml", "", "no GML"),
        ("a.gml", "<gml/>", "no GML"),
        ("a.gml", "graph [ node [ id 0 ] ]", "no node has a point"),
        ("a.gml", "graph [ node [ id 0 x 1 y nan ] ]", "no GML"),
        ("a.gml", "graph [ node [ id 0 x 1.0 y 2.0 ] edge [ source 0 ] ]", "no GML"),
        ("a.gml", "graph [ node [ id 0 x 1 y 1e999999 ] ]", "no node has a point"),
        ("a.gml", "graph " + "[ a " * 100_000, "nested deeper"),
        ("a.tmap2", "", "expected a topological map"),
        ("a.tmap2", "nodes: 7", "expected a topological map"),
        ("a.tmap2", "- 1", "expected a mapping 'node'"),
        ("a.tmap2", "nodes: [{node: {name: a, edges: [1]}}]", "expected edges with 'node'"),
        ("a.tmap2", "nodes: []", "no node has a point"),
        ("a.tmap2", BOMB, "more than 300000 values"),
        ("a.tmap2", "nodes: &n [*n]", "stands for what contains it"),
        ("a.tmap2", "a: &a {b: &b {c: *a}}", "stands for what contains it"),
        ("a.tmap2", "nodes: [*none]", "undefined alias"),
        ("a.tmap2", "nodes: " + "[" * 5000, "nested more than 32 deep"),
        ("a.tmap2", "x0: &x0 [1]\n" + "".join(
            f"x{k}: &x{k} [*x{k - 1}]\n" for k in range(1, 60)), "nested more than 32 deep"),
        ("a.tmap2", "nodes: !!python/object/apply:os.system [ls]", "tags are not supported"),
        ("a.tmap", "node: \n\ta\n\tjunk\n", "line 3: expected a section"),
        ("a.tmap", "node: \n\ta\n\tvertices:\n\t\tx,y\n", "line 4: expected a vertex"),
        ("a.tmap", "node: \n\ta\n\tedges:\n\t\t b, go\n", "no node has a point"),
        ("a.tmap", b"node: \n\ta\n\x00\x1b[31m\n", "expected a section"),
    ],
)  # fmt: skip
def test_what_is_no_graph_ends_in_one_line(read, name, content, words):
    assert words in read(name, content)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("a.geojson", f'{{"features": [{NODE}], "deep": {{"a": {"[" * 500}{"]" * 500}}}}}'),
        ("a.geojson", f'\ufeff{{"features": [{NODE}], "n": NaN, "i": -Infinity}}'),
        ("a.geojson", f'{{"features": [{NODE}, {{}}, {{"geometry": 7, "properties": []}}]}}'),
        ("a.tmap2", f"v: &v [1]\nnodes: [{{node: {{name: a, verts: *v, {POSE}}}}}]"),
        ("a.tmap", "node: \n\ta\n\twaypoint:\n\t\t1,2\n\tedges:\n\t\t a, go, 0.5, nan\n"),
        ("a.json", f'{{"nodes": [{{"id": [1, [2]], "x": 1, "y": 2}}, {ODD}], "links": [{LINK}]}}'),
    ],
)  # fmt: skip
def test_what_can_be_read_around_is_read(read, name, content):
    graph = read(name, content)
    assert graph.points.tolist() == [[1.0, 2.0]]


WRITERS = {
    "a.geojson": writers.write_nav2,
    "a.tplg": writers.write_strands,
    "a.tmap2": writers.write_tmap2,
    "a.tmap": writers.write_text,
    "a.graphml": writers.write_graphml,
    "a.gml": writers.write_gml,
    "a.json": writers.write_node_link,
}


@pytest.mark.parametrize("name", WRITERS)
@given(st.data())
@settings(max_examples=examples(120), suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_files_with_bytes_changed_and_cut(read, tmp_path, name, data):
    WRITERS[name](tmp_path / name, SMALL)
    content = bytearray((tmp_path / name).read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, len(content) - 1))
        content[at : at + data.draw(st.integers(0, 3))] = data.draw(st.binary(max_size=3))
        if not content:
            break
    found = read(name, bytes(content[: data.draw(st.integers(0, len(content)))]))
    assert isinstance(found, str) or found.n_nodes >= 1


def test_a_control_character_does_not_break_the_line_about_gml(read):
    assert "cannot tokenize" in read("a.gml", b"\0")


def test_no_file_and_a_folder(tmp_path):
    with pytest.raises(hn.errors.MapNotFoundError, match="no such file"):
        hn.ext.fleet.load_graph(tmp_path / "none.geojson")
    with pytest.raises(hn.errors.MapError, match="this is a directory"):
        hn.ext.fleet.load_graph(tmp_path)


def test_a_fact_that_contains_itself_is_refused_when_it_is_written(tmp_path):
    endless: dict[str, object] = {}
    endless["again"] = [endless]
    plain: nx.DiGraph[Any] = nx.DiGraph()
    plain.add_node(1, x=0, y=0, fact=endless)
    plain.add_node(2, x=1, y=0)
    plain.add_edge(1, 2)
    graph = hn.graphs.WaypointGraph.from_networkx(plain)
    with pytest.raises(hn.errors.InvalidValueError, match="contains itself"):
        hn.graphs.export_nav2(graph, tmp_path / "a.geojson")


def test_facts_that_json_has_no_value_for_are_left_out(tmp_path):
    plain: nx.DiGraph[Any] = nx.DiGraph()
    odd = {"nan": float("nan"), "none": None, "huge": 10**5000, "set": {1}, "list": [1, None, "b"]}
    plain.add_node(1, x=0, y=0, odd=odd)
    plain.add_node("two", x=1, y=0)
    plain.add_edge(1, "two", cost=float("inf"))
    hn.graphs.export_nav2(hn.graphs.WaypointGraph.from_networkx(plain), tmp_path / "a.geojson")
    node, other, edge = json.loads((tmp_path / "a.geojson").read_text())["features"]
    assert node["properties"]["metadata"]["odd"] == {"set": "{1}", "list": [1, "b"]}
    assert other["properties"]["metadata"]["name"] == "two"
    assert (node["properties"]["id"], other["properties"]["id"]) == (1, 0)
    assert "cost" not in edge["properties"]


@pytest.mark.full
@pytest.mark.parametrize("name", ["a.geojson", "a.graphml", "a.tmap"])
def test_a_million_edges_in_a_gigabyte(tmp_path, name):
    script = f"""
        import hybridnav as hn
        from tests.memory import peak_kb
        n, m = 1000, 1_000_000
        with open({str(tmp_path / name)!r}, "w") as file:
            write = file.write
            if {name!r} == "a.geojson":
                write('{{"type": "FeatureCollection", "features": [')
                for k in range(n):
                    write('{{"type": "Feature", "properties": {{"id": %d}}, "geometry": {{"type":'
                          ' "Point", "coordinates": [%d, 0]}}}},' % (k, k))
                for k in range(m):
                    write('%s{{"type": "Feature", "properties": {{"id": %d, "startid": %d, '
                          '"endid": %d}}, "geometry": {{"type": "LineString", "coordinates": '
                          '[[%d, 0], [%d, 0]]}}}}'
                          % ("," * (k > 0), n + k, k % n, k * 7 % n, k % n, k * 7 % n))
                write("]}}")
            elif {name!r} == "a.graphml":
                write("<graphml><graph edgedefault='directed'>")
                for k in range(n):
                    write("<node id='%d'><data key='pos'>%d, 0</data></node>" % (k, k))
                for k in range(m):
                    write("<edge source='%d' target='%d'/>" % (k % n, k * 7 % n))
                write("</graph></graphml>")
            else:
                for k in range(n):
                    write("node: \\n\\t%d\\n\\twaypoint:\\n\\t\\t%d,0\\n\\tedges:\\n" % (k, k))
                    write("".join("\\t\\t %d, go\\n" % (j * 7 % n) for j in range(m // n)))
        graph = hn.ext.fleet.load_graph({str(tmp_path / name)!r})
        peak = peak_kb()
        assert (graph.n_nodes, graph.n_edges) == (n, m), (graph.n_nodes, graph.n_edges)
        assert peak < 2**20, peak
    """
    subprocess.run([sys.executable, "-c", textwrap.dedent(script)], check=True, timeout=300)


_ANY = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.sampled_from(["Point", "LineString", "x", "1", "", "map", "topo", "NODE", "\ud800"]),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(
                [
                    "id",
                    "startid",
                    "endid",
                    "type",
                    "geometry",
                    "properties",
                    "coordinates",
                    "cost",
                    "metadata",
                    "frame",
                    "operations",
                    "trigger",
                    "class",
                    "speed_limit",
                    "overridable",
                    "source",
                    "target",
                    "x",
                    "y",
                    "pos",
                    "node",
                    "name",
                    "edges",
                    "meta",
                    "pose",
                    "position",
                    "parent_frame",
                    "verts",
                ]
            ),
            inner,
            max_size=5,
        )
    ),
    max_leaves=12,
)


@given(st.lists(_ANY, max_size=4), st.lists(_ANY, max_size=3), st.booleans())
@settings(max_examples=examples(300), suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_values_of_any_kind_at_any_place(read, tmp_path, values, more, is_mapping):
    """A graph, which can be written for Nav2 unless it has no edge, or one line."""
    text = json.dumps
    files = {
        "a.geojson": text({"features": [json.loads(NODE), *values]}),
        "a.json": text({"nodes": [{"id": 1, "x": 1, "y": 1}, *values], "links": more}),
        "a.tmap2": text({"nodes": values, "transformation": more} if is_mapping else values),
    }
    for name, content in files.items():
        # JSON's infinities are plain words to YAML.
        graph = read(name, content)
        if not isinstance(graph, str) and graph.n_edges:
            hn.graphs.export_nav2(graph, tmp_path / "out.geojson")
            again = hn.ext.fleet.load_graph(tmp_path / "out.geojson")
            assert (again.n_nodes, again.n_edges) == (graph.n_nodes, graph.n_edges)
            kinds = {one.kind for one in again.findings}
            assert not {"stops-loader", "fails-later", "bad-id", "repeated-id"} & kinds
            read_nav2(tmp_path / "out.geojson", costs=False, lines=False)
