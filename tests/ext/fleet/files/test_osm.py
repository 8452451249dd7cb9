"""Buildings as OpenStreetMap's XML: read by the rules of area graphs, and read back."""

import math
import re
from collections import Counter
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.fleet import (
    BuildingGraph,
    DoorLine,
    FloorArea,
    FloorGraph,
    Link,
    LinkEnd,
    join_links,
    load_building_graph,
    to_networkx,
)
from tests.drawn_rooms import HOUSE, topology_of
from tests.ext.fleet.files.drawn_buildings import buildings
from tests.ext.fleet.files.osm_reader import east_north, read_osm
from tests.strategies import tried

ANCHORS = st.builds(
    hn.ext.fleet.Anchor, st.floats(-60, 60), st.floats(-179, 179), st.floats(-360, 360)
)
NEAR = st.floats(-200, 200)
PLACE = hn.ext.fleet.Anchor(48.15, 11.57)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("osm") / "house.osm"


@tried(300, ANCHORS, NEAR, NEAR)
def test_degrees_are_those_of_the_plane_that_touches_the_earth(anchor, x, y):
    place = anchor.degrees_of((x, y))
    east, north = east_north((anchor.latitude_deg, anchor.longitude_deg), place)
    turn = math.radians(anchor.heading_deg)
    ahead = math.sin(turn), math.cos(turn)  # the y axis
    assert east == pytest.approx(x * ahead[1] + y * ahead[0], abs=0.02)
    assert north == pytest.approx(y * ahead[1] - x * ahead[0], abs=0.02)
    assert anchor.point_of(*place) == pytest.approx((x, y), abs=1e-6)


@pytest.mark.parametrize("bad", [(91, 0), (86, 0), (0, 181), (math.nan, 0), (0, 0, math.inf)])
def test_no_place_on_the_earth(bad):
    with pytest.raises(hn.errors.InvalidValueError, match="an anchor has"):
        hn.ext.fleet.Anchor(*bad)


def in_xml(text):
    """A text with what XML 1.0 cannot hold replaced."""
    return re.sub("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "\ufffd", text)


def facts_of(graph):
    """Edges with their facts, and how often."""
    facts = [graph.edge_facts.get(edge, {}) for edge in range(graph.n_edges)]
    return Counter(
        (*ends, known.get("door_name"), known.get("speed_limit"))
        for ends, known in zip(graph.edges.tolist(), facts, strict=True)
    )


@tried(150, buildings(), ANCHORS)
def test_what_is_read_back_is_what_was_written(file, building, anchor):
    joined = join_links(building)
    hn.ext.fleet.export_osm(building, file, anchor=anchor)
    back = hn.ext.fleet.load_building_graph(file)
    names = [in_xml(floor.name) for floor in joined.floors]
    assert len(back.floors) == len(names)
    if len(set(names)) == len(names):
        assert [floor.name for floor in back.floors] == names
    for read, written in zip(back.floors, joined.floors, strict=True):
        assert read.graph.points == pytest.approx(written.graph.points, abs=1e-5)
        assert facts_of(read.graph) == facts_of(written.graph)
        assert not read.graph.findings
    for link, known in zip(back.links, building.links, strict=True):
        assert link.name.startswith(in_xml(known.name))
        for key in ("kind", "wait_s", "ride_s", "cost_m", "max_radius_m", "one_way"):
            assert getattr(link, key) == getattr(known, key)
        for one, other in zip(link.ends, known.ends, strict=True):
            assert one.position_m == pytest.approx(other.position_m, abs=0.011)


LIFT = Link(
    name="lift", kind="lift", ends=(LinkEnd("1", (3.1, 3.3)), LinkEnd("2", (3.1, 3.3))), wait_s=20
)
STAIRS = Link(
    name="steps", kind="stairs", ends=(LinkEnd("1", (9.1, 3.3)), LinkEnd("2", (8.1, 3.3)))
)


@pytest.fixture(scope="module")
def house():
    topology = topology_of(HOUSE)
    graph = hn.graphs.build_lane_graph(topology, spacing_m=6)
    links = (LIFT, STAIRS)
    floors = [
        hn.ext.fleet.floor_graph(topology, graph, name=name, links=links, elevation_m=height)
        for name, height in (("1", 0.0), ("2", 3.5))
    ]
    return topology, BuildingGraph(name="house", floors=tuple(floors), links=links)


def test_an_area_graph_joins_the_rooms_as_their_doors_do(house, file):
    topology, building = house
    hn.ext.fleet.export_osm(building, file, anchor=PLACE)
    found = read_osm(file)
    rooms = {(area.level, area.name): area for area in found.areas.values() if area.kind == "room"}
    assert set(rooms) == {(level, name) for level in (1, 2) for name in topology.rooms.names}
    for (level, name), area in rooms.items():
        floor = building.floor(f"{level:g}")
        own = next(shapely.Polygon(each.outline) for each in floor.areas if each.name == name)
        assert shapely.Polygon(area.outline).is_valid
        assert own.symmetric_difference(shapely.Polygon(area.outline)).area < 0.6
    joined: nx.Graph[Any] = nx.Graph()
    for one, other, refs, tags in found.passages:
        ends = [(found.areas[at].level, found.areas[at].name) for at in (one, other)]
        joined.add_edge(*ends)
        if tags["name"].split("_")[0] in {"1", "2"} and "_door" in tags["name"]:
            # Nodes of a door are corners of the outlines of both rooms.
            outlines = [shapely.Polygon(found.areas[at].outline) for at in (one, other)]
            for ref in refs:
                at = shapely.Point(found.points[ref])
                assert all(outline.exterior.distance(at) < 1e-6 for outline in outlines)
    wanted = {
        frozenset({(level, room) for room in door.rooms})
        for level in (1, 2) for door in topology.rooms.doors if door.passable
    }  # fmt: skip
    between = {
        frozenset(pair)
        for pair in joined.edges
        if {name for _, name in pair} <= set(topology.rooms.names)
    }
    assert between == wanted
    assert nx.is_connected(joined)


def test_foot_ways_and_links_are_one_graph_over_both_floors(house, file):
    _, building = house
    hn.ext.fleet.export_osm(building, file, anchor=PLACE)
    found = read_osm(file)
    roads: nx.Graph[Any] = nx.Graph()
    for refs, tags in found.ways:
        nx.add_path(roads, refs)
        assert tags["highway"] in {"footway", "elevator", "steps"}
        levels = {found.tags[ref]["level"] for ref in refs}
        assert levels == set(tags["level"].split(";"))
    assert len(roads) == sum(floor.graph.n_nodes for floor in building.floors)
    assert nx.is_connected(roads)
    doors = [tags for tags in found.tags.values() if tags.get("door") == "yes"]
    assert len(doors) == sum(not d.is_opening for f in building.floors for d in f.doors)


def test_doors_and_rooms_are_read_back(house, file):
    _, building = house
    hn.ext.fleet.export_osm(building, file, anchor=PLACE)
    back = hn.ext.fleet.load_building_graph(file)
    for read, written in zip(back.floors, building.floors, strict=True):
        assert read.elevation_m == written.elevation_m
        assert [(d.name, d.rooms, d.is_opening) for d in read.doors] == [
            (d.name, d.rooms, d.is_opening) for d in written.doors
        ]
        for one, other in zip(read.doors, written.doors, strict=True):
            assert np.array(one.ends) == pytest.approx(np.array(other.ends), abs=1e-5)
        assert [area.name for area in read.areas] == [area.name for area in written.areas]
    assert [(link.name, link.kind, link.wait_s) for link in back.links] == [
        ("lift", "lift", 20.0), ("steps", "stairs", 0.0)
    ]  # fmt: skip


def test_without_ways_rooms_and_doors_are_the_graph(house, file):
    """As a file of osmAG has it: the edges are judged on the map."""
    topology, building = house
    hn.ext.fleet.export_osm(building, file, anchor=PLACE)
    text = file.read_text().replace('k="highway"', 'k="was"')
    file.write_text(text)
    back = hn.ext.fleet.load_building_graph(file)
    assert [(link.name, link.kind) for link in back.links] == [
        ("lift", "lift"),
        ("steps", "stairs"),
    ]
    whole = to_networkx(back)
    assert nx.is_strongly_connected(nx.DiGraph(whole))
    check = hn.graphs.check_graph(topology, back.floor("1").graph)
    assert check.doors[0] == check.doors[1]
    assert check.rooms[0] == check.rooms[1]


HAND = """<osm version="0.6">
<node id="1" lat="50.00000" lon="8.00000"/><node id="2" lat="50.00000" lon="8.00010"/>
<node id="3" lat="50.00005" lon="8.00010"/><node id="4" lat="50.00005" lon="8.00000"/>
<node id="5" lat="50.00010" lon="8.00010"/><node id="6" lat="50.00010" lon="8.00000"/>
<node id="7" lat="50.00005" lon="8.00005"><tag k="door" v="hinged"/><tag k="level" v="0"/></node>
<node id="8" lat="50.00002" lon="8.00002">
 <tag k="highway" v="elevator"/><tag k="level" v="-1-1"/></node>
<way id="10"><nd ref="1"/><nd ref="2"/><nd ref="3"/><nd ref="7"/><nd ref="4"/><nd ref="1"/>
 <tag k="indoor" v="room"/><tag k="level" v="0;1"/><tag k="name" v="shop"/></way>
<way id="11"><nd ref="4"/><nd ref="7"/><nd ref="3"/><nd ref="5"/><nd ref="6"/><nd ref="4"/>
 <tag k="indoor" v="corridor"/><tag k="level" v="0"/><tag k="level:ref" v="EG"/></way>
</osm>"""


def test_rooms_and_doors_of_simple_indoor_tagging(tmp_path):
    path = tmp_path / "hand.osm"
    path.write_text(HAND)
    back = hn.ext.fleet.load_building_graph(path)
    assert [floor.name for floor in back.floors] == ["EG", "1"]
    ground = back.floors[0]
    assert ground.graph.names == ("way 10", "way 11", "node 7")
    assert sorted(ground.graph.edges.tolist()) == [[0, 2], [1, 2], [2, 0], [2, 1]]
    assert [(area.name, area.kind) for area in ground.areas] == [
        ("shop", "room"), ("way 11", "corridor")
    ]  # fmt: skip
    (lift,) = back.links
    assert [end.floor for end in lift.ends] == ["EG", "1"]
    east, north = east_north((50.0, 8.0), (50.00002, 8.00002))
    assert lift.ends[0].position_m == pytest.approx((east, north), abs=1e-3)
    with pytest.raises(hn.errors.MapError, match="it has the floors EG, 1: choose one"):
        hn.ext.fleet.load_graph(path)
    assert hn.ext.fleet.load_graph(path, floor="EG").n_nodes == 3
    with pytest.raises(hn.errors.MapError, match="no floor is called 'roof': there are EG, 1"):
        hn.ext.fleet.load_graph(path, floor="roof")


@tried(100, st.floats(-1, 7), st.floats(-1, 5), st.floats(-1, 7), st.floats(-1, 5))
def test_ends_of_doors_never_make_an_outline_cross_itself(file, a, b, c, d):
    outline = np.array([[0, 0], [6, 0], [6, 4], [3, 4], [3, 0.2], [2.9, 4], [0, 4.0]])
    floor = FloorGraph(
        name="0",
        graph=hn.graphs.WaypointGraph.from_networkx(_pair()),
        doors=(DoorLine("d", ((a, b), (c, d)), ("k", "h")),),
        areas=(FloorArea("k", "room", outline), FloorArea("h", "corridor", outline + 10)),
    )
    hn.ext.fleet.export_osm(BuildingGraph(name="b", floors=(floor,)), file, anchor=PLACE)
    for area in read_osm(file).areas.values():
        assert shapely.Polygon(area.outline).is_valid
        assert shapely.LinearRing(area.outline).is_ccw


def _pair():
    plain: nx.Graph[Any] = nx.Graph()
    plain.add_node(0, x=0, y=0)
    plain.add_node(1, x=1, y=0)
    plain.add_edge(0, 1)
    return plain


HALL = [(1, 0.0, 0.0), (2, 0.0, 9.0), (3, 9.0, 9.0), (4, 9.0, 0.0)]


def drawn(tmp_path, ways, nodes=None, tags=None):
    """Load a file of nodes, about as many metres apart, and ways of their numbers with tags."""
    lines = ['<osm version="0.6">']
    for number, north, east in [*HALL, *(nodes or [])]:
        own = "".join(f'<tag k="{k}" v="{v}"/>' for k, v in (tags or {}).get(number, {}).items())
        place = f'lat="{48 + north * 9e-6}" lon="{11 + east * 1.34e-5}"'
        lines.append(f'<node id="{number}" {place}>{own}</node>')
    for number, (refs, facts) in enumerate(ways):
        body = "".join(f'<nd ref="{ref}"/>' for ref in refs)
        body += "".join(f'<tag k="{key}" v="{value}"/>' for key, value in facts.items())
        lines.append(f'<way id="{100 + number}">{body}</way>')
    path = tmp_path / "drawn.osm"
    path.write_text("\n".join([*lines, "</osm>"]))
    return load_building_graph(path)


def left_out(building):
    found = building.floors[0].graph.findings
    return [each.where for one in found if one.kind == "link-unread" for each in one.examples]


ROOMS = [([1, 2, 3, 4, 1], {"indoor": "room", "level": "0", "repeat_on": "1-2"})]
WALKS = [
    ([1, 2], {"highway": "footway", "level": "0"}),
    ([3, 4], {"highway": "footway", "level": "1"}),
]


@pytest.mark.parametrize(
    ("tags", "kind"),
    [
        # OpenStreetMap's wiki, Simple Indoor Tagging, Key:level and Key:repeat_on, of 2026.
        ({"highway": "steps", "level": "0;1"}, "stairs"),
        ({"highway": "steps", "level": "0-1"}, "stairs"),
        ({"highway": "footway", "level": "0;1", "incline": "up"}, "ramp"),
        ({"highway": "elevator", "level": "0", "repeat_on": "1"}, "lift"),
    ],
)
def test_links_between_foot_ways_have_their_levels_on_the_way(tmp_path, tags, kind):
    building = drawn(tmp_path, [*WALKS, ([2, 3], tags)])
    (link,) = building.links
    assert (link.kind, [end.floor for end in link.ends]) == (kind, ["0", "1"])
    at = dict(zip((1, 2, 3, 4), building.floors[0].graph.points.tolist(), strict=False))
    assert link.ends[0].position_m == pytest.approx(tuple(at[2]))
    assert left_out(building) == []


@pytest.mark.parametrize(
    ("tags", "way"),
    [
        # OpenStreetMap's wiki, Key:conveying and Key:oneway, of 2026: escalators are steps that
        # convey along the line or back, and `reversible` ones either way.
        ({"conveying": "forward"}, "up"),
        ({"conveying": "backward"}, "down"),
        ({"conveying": "reversible"}, None),
        ({"oneway": "yes"}, "up"),
        ({"oneway": "-1"}, "down"),
        ({"oneway": "no", "conveying": "yes"}, None),
    ],
)
def test_escalators_and_moving_walkways_lead_one_way(tmp_path, tags, way):
    for refs, turned in (([2, 3], way), ([3, 2], {"up": "down", "down": "up"}.get(way))):
        steps = refs, {"highway": "steps", "level": "0;1"} | tags
        walkway = [{2: 1, 3: 4}[ref] for ref in refs], {"highway": "footway", "level": "0"} | tags
        building = drawn(tmp_path, [*WALKS, steps, walkway])
        assert building.links[0].one_way == turned
        graph = building.floors[0].graph
        tail, head = (graph.names.index(node) for node in (1, 4))
        edges = [[tail, head], [head, tail]]
        is_there = [edge in graph.edges.tolist() for edge in edges]
        assert is_there == [turned != "down", turned != "up"]


@pytest.mark.parametrize(
    "tags", [{"highway": "elevator"}, {"room": "elevator"}, {"room": "stairs"}, {"stairs": "yes"}]
)
def test_links_that_are_areas_stop_in_their_middle_on_every_level(tmp_path, tags):
    nodes = [(5, 0.0, 11.0), (6, 2.0, 11.0), (7, 2.0, 9.0)]
    area = [2, 5, 6, 7, 2], {"indoor": "room", "level": "0-2"} | tags
    building = drawn(tmp_path, [*ROOMS, area], nodes)
    (link,) = building.links
    assert [end.floor for end in link.ends] == ["0", "1", "2"]
    assert len({end.position_m for end in link.ends}) == 1
    assert link.ends[0].position_m == pytest.approx((10.0, 1.0), abs=0.1)


# OpenStreetMap's wiki, highway=elevator, of 2026: a node or an area, and in buildings often both.
@pytest.mark.parametrize("on_area", ["0-2", "0"])
def test_a_lift_drawn_as_node_and_area_is_one_link(tmp_path, on_area):
    nodes = [(5, 0.0, 11.0), (6, 2.0, 11.0), (7, 2.0, 9.0), (8, 1.0, 10.0)]
    area = [2, 5, 6, 7, 2], {"indoor": "room", "room": "elevator", "level": on_area}
    tags = {8: {"highway": "elevator", "level": "0-2"}}
    building = drawn(tmp_path, [*ROOMS, area], nodes, tags)
    (link,) = building.links
    assert [end.floor for end in link.ends] == ["0", "1", "2"]
    assert left_out(building) == []


def test_steps_without_a_level_between_levels_are_a_finding(tmp_path):
    building = drawn(tmp_path, [*WALKS, ([2, 3], {"highway": "steps"})])
    assert building.links == ()
    assert left_out(building) == ["stairs, way 102: no level, beside 1"]
    assert left_out(drawn(tmp_path, [*WALKS, ([1, 2], {"highway": "steps"})])) == []


@pytest.mark.parametrize(
    "stated", [{"door": "yes"}, {"indoor": "door"}, {"entrance": "main"}, {"door": "hinged"}]
)
def test_doors_are_tagged_in_three_ways(tmp_path, stated):
    tags = {2: stated | {"level": "0"}, 3: {"door": "no"}}
    building = drawn(tmp_path, ROOMS, tags=tags)
    assert [(floor.graph.n_nodes, floor.graph.n_edges) for floor in building.floors] == [(2, 2)] * 3


@pytest.mark.parametrize(
    ("way", "where"),
    [
        (([8, 9], {"highway": "steps", "level": "0;1"}), "stairs, way 102"),
        (([8, 9], {"highway": "steps", "level": "5;6"}), "stairs, way 102"),
        (([2, 3, 9, 2], {"indoor": "room", "highway": "elevator", "level": "0"}), "lift, way 102"),
    ],
)
def test_a_link_that_cannot_be_placed_is_a_finding(tmp_path, way, where):
    building = drawn(tmp_path, [*WALKS, way], [(8, 4.0, 4.0), (9, 4.0, 8.0)])
    assert building.links == ()
    assert left_out(building) == [where]
