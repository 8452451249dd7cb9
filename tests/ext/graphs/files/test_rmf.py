"""Navigation graphs for Open-RMF, read again by the rules of its fleet adapter, and read back."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import replace

import pytest
from hypothesis import assume, given, settings

import hybridnav as hn
from hybridnav.ext.fleet import BuildingGraph, LinkEnd, align_floors, join_links
from tests.ext.fleet.files.drawn_buildings import buildings
from tests.ext.graphs.files.rmf_reader import read_rmf
from tests.strategies import examples


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return tmp_path_factory.mktemp("rmf") / "graph.yaml"


def has_edges(building):
    return any(floor.graph.n_edges for floor in building.floors)


def lifts_apart(building):
    """Whether the vertices of every lift would be its own: no node in two lifts."""
    ends = [(end.floor, end.position_m) for link in building.links for end in link.ends]
    return len(set(ends)) == len(ends) and all(
        math.dist(a[1], b[1]) > 0.1 for a in ends for b in ends if a[0] == b[0] and a != b
    )


@given(buildings(aligned=True))
@settings(max_examples=examples(150))
def test_the_fleet_adapter_sees_every_node_edge_door_and_lift(file, building):
    assume(has_edges(building) and lifts_apart(building))
    hn.export_rmf(building, file)
    found = read_rmf(file)
    joined = join_links(building)
    offset = 0
    lanes: Counter[tuple[int, int]] = Counter()
    for floor in joined.floors:
        graph = floor.graph
        for node, point in enumerate(graph.points.tolist()):
            level, *at = found.waypoints[offset + node]
            assert level == floor.name
            assert at == pytest.approx(point, abs=1e-6)
            is_charger = graph.node_facts.get(node, {}).get("is_charger", False)
            assert ("is_charger" in found.flags[offset + node]) == is_charger
        for tail, head in graph.edges.tolist():
            lanes[tail + offset, head + offset] += 1
        offset += graph.n_nodes
    assert len(found.waypoints) == offset
    n_lanes = sum(lanes.values())
    assert Counter(lane[:2] for lane in found.lanes[:n_lanes]) == lanes
    lifts = [link for link in building.links if link.kind == "lift"]
    assert set(found.lifts) == {link.name for link in lifts}
    for link in lifts:
        stops = [at for at, name in found.lift_of.items() if name == link.name]
        assert [found.waypoints[at][0] for at in stops] == [end.floor for end in link.ends]
    names = {door.name: floor.name for floor in building.floors for door in floor.doors}
    assert {name: where for name, (_, where) in found.doors.items()} == names


@given(buildings(kinds=["lift"], aligned=True))
@settings(max_examples=examples(150))
def test_what_is_read_back_is_what_was_written(file, building):
    assume(has_edges(building) and lifts_apart(building))
    hn.export_rmf(building, file)
    back = hn.load_building_graph(file)
    joined = join_links(building)
    assert back.name == building.name
    assert [floor.name for floor in back.floors] == [floor.name for floor in joined.floors]
    for read, written in zip(back.floors, joined.floors, strict=True):
        assert read.graph.points == pytest.approx(written.graph.points, abs=1e-6)
        assert read.graph.edges.tolist() == written.graph.edges.tolist()
        assert [door.name for door in read.doors] == [door.name for door in written.doors]
        assert not read.graph.findings
        for edge, facts in written.graph.edge_facts.items():
            known = read.graph.edge_facts.get(edge, {})
            assert known.get("door_name") == facts.get("door_name")
            assert known.get("speed_limit") == facts.get("speed_limit")
    for link, known in zip(back.links, building.links, strict=True):
        assert (link.name, link.kind) == (known.name, "lift")
        radius = known.max_radius_m
        assert link.max_radius_m == (1.0 if math.isinf(radius) else radius)
        for one, other in zip(link.ends, known.ends, strict=True):
            assert one.floor == other.floor
            assert one.position_m == pytest.approx(other.position_m, abs=0.011)


HOUSE = """
building_name: house
levels:
  L1: {vertices: [[0, 0, {name: a}], [3, 4, {name: "", lift: east}]], lanes: [[0, 1, {}]]}
  L2: {vertices: [[3, 4, {lift: east}], [9, 4, {name: b}]], lanes: [[0, 1, {}]]}
lifts: {east: {position: [3, 4, 0], dims: [1.5, 2.0]}}
doors: {d: {endpoints: [[1, 0], [0, 1]], map: L1}}
"""


@pytest.fixture
def house(tmp_path):
    path = tmp_path / "house.yaml"
    path.write_text(HOUSE)
    return hn.load_building_graph(path)


def test_a_file_drawn_by_hand(house):
    (lift,) = house.links
    assert (lift.name, lift.kind, lift.max_radius_m) == ("east", "lift", 0.75)
    assert lift.ends == (LinkEnd("L1", (3.0, 4.0)), LinkEnd("L2", (3.0, 4.0)))
    assert house.floor("L1").graph.names == ("a", 1)
    assert house.floor("L1").doors[0].ends == ((1.0, 0.0), (0.0, 1.0))
    assert house.floor("L1").graph.edges.tolist() == [[0, 1]]


def test_lifts_that_do_not_line_up_are_refused_and_aligned(house, tmp_path):
    (lift,) = house.links
    moved = replace(lift, ends=(lift.ends[0], LinkEnd("L2", (9.0, 4.0))))
    apart = BuildingGraph(name="house", floors=house.floors, links=(moved,))
    with pytest.raises(
        hn.InvalidValueError, match=r"lie 6\.00 m apart, and Open-RMF allows 0\.1 m"
    ):
        hn.export_rmf(apart, tmp_path / "a.yaml")
    hn.export_rmf(align_floors(apart), tmp_path / "a.yaml")
    assert read_rmf(tmp_path / "a.yaml").lifts["east"][:2] == (3.0, 4.0)


def test_the_ends_of_a_lift_that_lie_apart_on_maps_are_joined_at_their_mean(house, tmp_path):
    (lift,) = house.links
    moved = replace(lift, ends=(lift.ends[0], LinkEnd("L2", (3.3, 4.2))))
    notes = hn.export_rmf(replace(house, links=(moved,)), tmp_path / "a.yaml")
    assert notes == ("lift east: its own ends, 0.36 m apart: vertices lie at their mean",)
    found = read_rmf(tmp_path / "a.yaml")
    stops = [at for at, name in found.lift_of.items() if name == "east"]
    assert [found.waypoints[at] for at in stops] == [("L1", 3.15, 4.1), ("L2", 3.15, 4.1)]
    for stop in stops:
        joined = {lane[0] for lane in found.lanes if lane[1] == stop}
        (node,) = {at for at in joined if found.waypoints[at][0] == found.waypoints[stop][0]}
        assert math.dist(found.waypoints[node][1:3], (3.15, 4.1)) < 0.25
        assert any(lane[:2] == (stop, node) for lane in found.lanes)
    back = hn.load_building_graph(tmp_path / "a.yaml")
    assert back.links[0].ends == (LinkEnd("L1", (3.15, 4.1)), LinkEnd("L2", (3.15, 4.1)))


def test_what_the_format_has_no_place_for_is_said(house, tmp_path):
    (lift,) = house.links
    stairs = replace(lift, name="steps", kind="stairs")
    both = BuildingGraph(name="h", floors=house.floors, links=(replace(lift, wait_s=9.0), stairs))
    assert hn.export_rmf(both, tmp_path / "a.yaml", doors=False) == (
        "lift east: its waiting time, ride time and cost",
        "stairs steps: Open-RMF knows lifts only",
        "doors: as asked",
    )
    assert not read_rmf(tmp_path / "a.yaml").doors


def test_two_lifts_at_one_point_are_refused(house, tmp_path):
    twin = replace(house.links[0], name="west")
    both = replace(house, links=(*house.links, twin))
    with pytest.raises(hn.InvalidValueError, match="the lifts 'east' and 'west' end at one node"):
        hn.export_rmf(both, tmp_path / "a.yaml")
