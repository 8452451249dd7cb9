"""Damaged and hostile files of buildings: one clear line, or a building, in bounded time."""

import json

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import hybridnav as hn
from tests.ext.hostile import reader
from tests.strategies import examples

BOMB = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]\n" + "".join(
    f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 10)}]\n" for k in range(1, 12)
)
ENTITIES = "".join(f'<!ENTITY e{k} "{f"&e{k - 1};" * 10}">' for k in range(1, 10))
PLACE = '<node id="1" lat="50" lon="8"/><node id="2" lat="50" lon="8.0001"/>'
ROUTE = '<way id="3"><nd ref="1"/><nd ref="2"/><tag k="highway" v="path"/></way>'
LEVELS = "{L1: {vertices: [[0, 0, {}], [1, 0, {}]], lanes: [[0, 1, {}]]}}"
NODE = '{"nodeId": "a", "nodePosition": {"x": 1, "y": 2}}'


@pytest.fixture
def read(tmp_path):
    return reader(hn.ext.fleet.load_building_graph, tmp_path)


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("a.yaml", "", "expected a file of Open-RMF"),
        ("a.yaml", "levels: 3", "expected a file of Open-RMF"),
        ("a.yaml", "levels: {}", "no level has a vertex"),
        ("a.yaml", "levels: {L1: 7}", "expected the level as a mapping"),
        ("a.yaml", "levels: {L1: {vertices: 7}}", "expected vertices as a list"),
        ("a.yaml", "levels: {L1: {vertices: [7]}}", "expected [x, y, options] as a list"),
        ("a.yaml", "levels: {L1: {vertices: [[.nan, 0, {}]]}}", "no level has a vertex"),
        ("a.yaml", "levels: {L1: {vertices: [[null, 0, {}]]}}", "no level has a vertex"),
        ("a.yaml", "levels: {L1: {vertices: [[1e99, 0, {}]]}}", "no level has a vertex"),
        ("a.yaml", "levels: {L1: {vertices: [[0, 0, [1]]]}}", "expected options as a mapping"),
        ("a.yaml", "levels: {L1: {vertices: [[0, 0]], lanes: [[0]]}}", "with two numbers"),
        ("a.yaml", "levels: {L1: {vertices: [[0, 0]], lanes: [[0, 1.5]]}}", "with two numbers"),
        ("a.yaml", f"levels: {LEVELS}\ndoors: {{d: {{map: L9}}}}", "level 'L9', which is not"),
        ("a.yaml", f"levels: {LEVELS}\ndoors: {{d: {{map: L1, endpoints: [[0, 0]]}}}}",
         "expected endpoints"),
        ("a.yaml", f"levels: {LEVELS}\nlifts: {{l: 3}}", "expected the lift as a mapping"),
        ("a.yaml", f"levels: {{{', '.join(f'L{k}: {{}}' for k in range(1001))}}}", "1000 levels"),
        ("a.yaml", f"levels: {{}}\n{BOMB}", "more than 300000 values"),
        ("a.yaml", "levels: {L1: " + "[" * 5000, "nested more than 32 deep"),
        ("a.yaml", "levels: !!python/object/apply:os.system [ls]", "tags are not supported"),
        ("a.yaml", b"levels: \xff", "not UTF-8"),
        ("a.osm", "", "no XML"),
        ("a.osm", "<html></html>", "expected XML of OpenStreetMap"),
        ("a.osm", f"<!DOCTYPE osm [{ENTITIES}]><osm>&e9;</osm>", "DOCTYPE"),
        ("a.osm", "<osm>" + "<a>" * 100_000, "nested more than"),
        ("a.osm", "<osm></osm>", "no node has a latitude"),
        ("a.osm", '<osm><node id="x" lat="1" lon="1"/></osm>', "expected <node id=NUMBER>"),
        ("a.osm", '<osm><node id="1" lat="nan" lon="1"/></osm>', "no node has a latitude"),
        ("a.osm", '<osm><node id="1" lat="91" lon="1"/></osm>', "no node has a latitude"),
        ("a.osm", f"<osm>{PLACE}</osm>", "no level has a node"),
        ("a.osm", f'<osm>{PLACE}<way id="3"><tag k="a"/></way></osm>', "a tag has no k or no v"),
        ("a.osm", f'<osm>{PLACE}<way id="3"><nd ref="1.5"/></way></osm>', "expected <nd ref"),
        ("a.osm", "<osm>" + PLACE + "".join(
            f'<way id="{k}"><nd ref="1"/><nd ref="2"/><tag k="highway" v="path"/>'
            f'<tag k="level" v="{k}"/></way>' for k in range(1001)) + "</osm>", "1000 levels"),
        ("a.osm", "<osm>" + "".join(
            f'<node id="{k}" lat="50" lon="8"><tag k="highway" v="elevator"/>'
            '<tag k="level" v="1;2"/></node>' for k in range(1, 20_000)) + "".join(
            f'<way id="{k}"><nd ref="1"/><nd ref="2"/><tag k="highway" v="path"/>'
            f'<tag k="level" v="{k}"/></way>' for k in (1, 2)) + "</osm>", "1000 lifts, stairs"),
        ("a.osm", "<osm>" + " " * 2**25, "is not read"),
        ("a.json", " " * 2**26 + "{}", "is not read"),
        ("a.json", "[]", "expected a layout"),
        ("a.json", '{"layouts": 7}', "expected layouts as a list"),
        ("a.json", '{"layouts": []}', "no layout has a node"),
        ("a.json", '{"layouts": [7]}', "expected the layout as a mapping"),
        ("a.json", '{"layouts": [{"nodes": [{}]}]}', "expected nodeId as a text"),
        ("a.json", f'{{"layouts": [{{"nodes": [{NODE}], "edges": [{{}}]}}]}}', "startNodeId"),
        ("a.json", json.dumps({"layouts": [
            {"layoutLevelId": "1", "nodes": [json.loads(NODE)], "edges": [
                {"edgeId": f"e{k}", "edgeName": f"lift {k}", "startNodeId": "a", "endNodeId": "b"}
                for k in range(1001)]},
            {"layoutLevelId": "2", "nodes": [json.loads(NODE) | {"nodeId": "b"}]}]}),
         "1000 lifts, stairs"),
        ("a.yaml", "levels:\n" + "".join(
            f" L{k}: {{vertices: [{', '.join(f'[0, 0, {{lift: l{n}}}]' for n in range(1001))}]}}\n"
            for k in (1, 2)) + f"lifts: {{{', '.join(f'l{n}: {{}}' for n in range(1001))}}}",
         "1000 lifts"),
        ("a.json", '{"layouts": ' + "[" * 100_000, "nested"),
        ("a.json", '{"layouts": ' + "9" * 5000 + "}", "too many digits"),
        ("a.json", '{"layouts": [' + "[]," * 9_000_000 + "[]]}", "values is not read"),
    ],
)  # fmt: skip
def test_what_is_no_building_ends_in_one_line(read, name, content, words):
    assert words in read(name, content)


@pytest.mark.parametrize(
    "encoding",
    ["utf-7", "gb2312", "nonsense", "utf-16", "utf-32", "iso-8859-1", "koi8-r", "hex", "idna",
     "utf-8-sig", "big5", "cp037", "rot13", "undefined", "x" * 5000],
)  # fmt: skip
@pytest.mark.parametrize("name", ["a.osm", "a.graphml"])
def test_another_encoding_of_xml_ends_in_one_line(tmp_path, name, encoding):
    (tmp_path / name).write_text(f'<?xml version="1.0" encoding="{encoding}"?><osm>{PLACE}</osm>')
    load = hn.ext.fleet.load_building_graph if name == "a.osm" else hn.ext.fleet.load_graph
    with pytest.raises(hn.errors.MapError) as refused:
        load(tmp_path / name)
    assert f"{name}: declares the encoding {encoding[:20]!r}"[:-1] in str(refused.value)
    assert "expected UTF-8" in str(refused.value)
    assert len(str(refused.value).replace(str(tmp_path), "")) < 150


@pytest.mark.parametrize("encoding", ["UTF-8", "utf-8", "us-ascii"])
def test_utf_8_may_be_declared(read, encoding):
    head = f'<?xml version="1.0" encoding="{encoding}"?>'
    assert len(read("a.osm", f"{head}<osm>{PLACE}{ROUTE}</osm>").floors) == 1


def test_what_can_be_read_around_is_a_finding(read):
    text = """levels:
      L1: {vertices: [[0, 0, {name: a}], [1, 0, {name: a}], [null, 2, {}]],
           lanes: [[0, 1], [1, 9, {}], [-1, 0, {}], [2, 0]]}
      L2: {vertices: [[5, 5, {name: a, lift: one}]], lanes: []}
      L3: {vertices: []}"""
    building = read("a.yaml", text)
    assert [floor.name for floor in building.floors] == ["L1", "L2"]
    first, second = (floor.graph for floor in building.floors)
    assert {found.kind: found.count for found in first.findings} == {
        "no-coordinates": 1, "repeated-id": 1, "unknown-node": 3, "link-unread": 1
    }  # fmt: skip
    assert (first.names, first.edges.tolist()) == (("a", 1), [[0, 1]])
    assert [found.kind for found in second.findings] == ["repeated-id"]
    assert building.links == ()
    floors = read("a.osm", f'<osm>{PLACE}{ROUTE}<node id="9" lat="x"/>'
                  '<way id="4"><nd ref="1"/><nd ref="9"/><nd ref="77"/>'
                  '<tag k="highway" v="path"/></way></osm>').floors  # fmt: skip
    assert {found.kind: found.count for found in floors[0].graph.findings} == {
        "no-coordinates": 1, "unknown-node": 4
    }  # fmt: skip


def test_areas_that_cross_themselves_are_read(read):
    ring = "".join(f'<nd ref="{k}"/>' for k in (1, 2, 3, 4, 1))
    nodes = "".join(
        f'<node id="{k}" lat="{50 + y / 1e4}" lon="{8 + x / 1e4}"/>'
        for k, (x, y) in enumerate([(0, 0), (1, 1), (1, 0), (0, 1)], start=1)
    )
    tags = '<tag k="indoor" v="room"/><tag k="name" v="bow"/>'
    building = read("a.osm", f'<osm>{nodes}<way id="5">{ring}{tags}</way></osm>')
    assert building.floors[0].graph.n_nodes == 1


def test_many_doors_of_one_area_take_bounded_time(read):
    """A corridor of 3,000 doors, whose pairs would be four million."""
    doors = "".join(
        f'<node id="{k}" lat="{50 + (k % 7) / 1e6}" lon="{8 + k / 1e6}"><tag k="door" v=""/></node>'
        for k in range(1, 3000)
    )
    ring = "".join(f'<nd ref="{k}"/>' for k in [*range(1, 3000), 1])
    building = read(
        "a.osm", f'<osm>{doors}<way id="5">{ring}<tag k="indoor" v="area"/></way></osm>'
    )
    assert building.floors[0].graph.n_nodes == 3000


_ANY = st.recursive(
    st.one_of(st.none(), st.booleans(), st.integers(), st.floats(), st.sampled_from(["L1", "1"])),
    lambda inner: (
        st.lists(inner, max_size=5)
        | st.dictionaries(
            st.sampled_from(
                ["levels", "vertices", "lanes", "doors", "lifts", "name", "lift", "dims", "map",
                 "endpoints", "elevation", "measurements", "fiducials", "x", "y", "yaw", "width",
                 "depth", "level_doors", "graph_idx", "nodes", "edges", "nodeId", "nodePosition",
                 "startNodeId", "endNodeId", "layoutLevelId", "vehicleTypeEdgeProperties"]
            ),
            inner,
            max_size=5,
        )
    ),
    max_leaves=14,
)  # fmt: skip


@given(_ANY, _ANY, _ANY)
@settings(max_examples=examples(400), suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_values_of_any_kind_at_any_place(read, tmp_path, one, other, third):
    nav = {"levels": {"L1": {"vertices": [[0, 0, one], [1, 0, {}]], "lanes": [[0, 1, other]]}}}
    drawn = {"levels": {"L1": {
        "vertices": [[0, 0, 0, one], [9, 9, 0, ""], third], "lanes": [[0, 1, {}]],
        "measurements": [[0, 1, {"distance": [3, 4]}]], "doors": other, "fiducials": third,
    }}}  # fmt: skip
    lif = {"layouts": [{"nodes": [json.loads(NODE), one], "edges": [other]}, third]}
    files = {
        "a.yaml": [nav, nav | {"lifts": other, "doors": third}, drawn, drawn | {"lifts": other},
                   {"levels": one}, {"levels": {"L1": one, "L2": other}}],
        "a.json": [lif, {"layouts": one, "metaInformation": other}],
    }  # fmt: skip
    for name, contents in files.items():
        for content in contents:
            building = read(name, json.dumps(content))
            if not isinstance(building, str):
                hn.ext.fleet.export_osm(
                    building, tmp_path / "b.osm", anchor=hn.ext.fleet.Anchor(0, 0)
                )
                hn.ext.fleet.export_lif(building, tmp_path / "b.lif", vehicle_types=["A.B"])


OSM = st.sampled_from(
    ["<osm>", "</osm>", PLACE, ROUTE, "<way id='7'>", "</way>", "<nd ref='1'/>", "<nd ref='2'/>",
     "<nd ref='8'/>", "<tag k='level' v='0;1'/>", "<tag k='level' v='1-9999'/>",
     "<tag k='indoor' v='room'/>", "<tag k='osmAG:type' v='area'/>",
     "<tag k='osmAG:type' v='passage'/>", "<tag k='osmAG:from' v='7'/>",
     "<tag k='osmAG:to' v='6'/>", "<tag k='osmAG:areaType' v='elevator'/>",
     "<tag k='highway' v='elevator'/>", "<tag k='highway' v='steps'/>", "<tag k='name' v='n'/>",
     "<tag k='hybridnav:ride_s' v='1e400'/>", "<tag k='height' v='high'/>", "<way id='6'>",
     "<node id='8' lat='50.00002' lon='8.00002'>", "</node>", "<tag k='door' v='yes'/>",
     "<tag k='maxspeed' v='walk'/>", "<tag k='oneway' v='-1'/>", "<relation>", "</relation>"]
)  # fmt: skip


@given(st.lists(OSM, max_size=30))
@settings(max_examples=examples(400), suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_elements_in_any_order(read, tmp_path, parts):
    for text in ("".join(parts), f"<osm>{PLACE}{ROUTE}{''.join(parts)}</osm>"):
        building = read("a.osm", text)
        if not isinstance(building, str):
            hn.ext.fleet.export_osm(building, tmp_path / "b.osm", anchor=hn.ext.fleet.Anchor(0, 0))
