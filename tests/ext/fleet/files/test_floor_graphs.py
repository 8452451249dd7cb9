"""Graphs of floors from their maps: names of rooms, doors on edges, ends of links in sight."""

import numpy as np
import pytest
import shapely

import hybridnav as hn
from hybridnav.ext.fleet import BuildingGraph, Link, LinkEnd
from hybridnav.harness.judges import segment_faults
from tests.drawn_rooms import HOUSE, topology_of
from tests.ext.fleet.files.rmf_reader import read_rmf

LIFT = Link(name="lift", kind="lift", ends=(LinkEnd("1", (3.1, 3.3)), LinkEnd("2", (3.1, 3.3))))


@pytest.fixture(scope="module")
def floors():
    topology = topology_of(HOUSE)
    graph = hn.graphs.build_lane_graph(topology)
    return topology, [
        hn.ext.fleet.floor_graph(topology, graph, name=name, links=[LIFT]) for name in ("1", "2")
    ]


def test_edges_cross_the_lines_of_the_doors_that_they_name(floors):
    topology, (floor, _) = floors
    doors = {d.name: shapely.LineString(d.ends) for d in floor.doors if not d.is_opening}
    assert len(doors) == sum(door.kind == "door" for door in topology.rooms.doors) == 5
    for edge, ends in enumerate(floor.graph.points[floor.graph.edges]):
        segment = shapely.LineString(ends)
        named = floor.graph.edge_facts.get(edge, {}).get("door_name")
        crossed = {name for name, line in doors.items() if line.distance(segment) < 1e-9}
        inner = {name for name, line in doors.items() if line.crosses(segment)}
        assert named is None or named in crossed
        assert bool(inner) <= (named is not None)


def test_a_door_is_as_wide_as_its_line(floors):
    topology, (floor, _) = floors
    assert sum(line.is_opening for line in floor.doors) == 1
    for line in floor.doors:
        door = topology.rooms.door(
            int(line.name.removeprefix(f"1_{'opening' if line.is_opening else 'door'}"))
        )
        assert line.rooms == door.rooms
        (x, y), (u, v) = line.ends
        assert np.hypot(x - u, y - v) == pytest.approx(door.width_m)
        assert ((x + u) / 2, (y + v) / 2) == pytest.approx(
            door.position, abs=0.26
        )  # which lies on a side of a cell of 0.5 m


def test_every_room_has_its_name_at_one_node_inside_its_area(floors):
    topology, (floor, _) = floors
    areas = {area.name: shapely.Polygon(area.outline) for area in floor.areas}
    assert set(areas) == set(topology.rooms.names)
    named = {
        facts["name"]: node for node, facts in floor.graph.node_facts.items() if "name" in facts
    }
    assert set(named) == set(areas)
    for name, node in named.items():
        assert areas[name].covers(shapely.Point(floor.graph.points[node]))


def test_the_end_of_a_link_is_joined_to_what_it_sees(floors, tmp_path):
    topology, both = floors
    graph = both[0].graph
    assert graph.names[-1] == "link lift"
    for edge in (-2, -1):
        ends = graph.points[graph.edges[edge]]
        assert segment_faults(topology.grid, ends) == ()
    building = BuildingGraph(name="house", floors=tuple(both), links=(LIFT,))
    hn.ext.fleet.export_rmf(building, tmp_path / "house.yaml")
    found = read_rmf(tmp_path / "house.yaml")
    assert len(found.lift_of) == 2
    assert {"1 kitchen", "2 kitchen"} <= set(found.keys)
    assert {event for _, _, event in found.lanes if event.startswith("door")} == {
        f"door {door.name}" for floor in both for door in floor.doors if not door.is_opening
    }
    # A robot can get from every waypoint to every other, over both floors.
    reached, todo = {0}, [0]
    while todo:
        here = todo.pop()
        new = {end for begin, end, _ in found.lanes if begin == here} - reached
        reached |= new
        todo += new
    assert len(reached) == len(found.waypoints)


@pytest.mark.parametrize(
    ("at", "words"), [((0.1, 0.1), "is not free"), ((900.0, 3.0), "is not free")]
)
def test_an_end_in_a_wall_is_refused(floors, at, words):
    topology, _ = floors
    graph = hn.graphs.build_lane_graph(topology, spacing_m=20)
    lift = Link(name="lift", kind="lift", ends=(LinkEnd("1", at), LinkEnd("2", at)))
    with pytest.raises(hn.errors.InvalidValueError, match=words):
        hn.ext.fleet.floor_graph(topology, graph, name="1", links=[lift])


def test_a_graph_of_another_map_is_refused(floors):
    topology, _ = floors
    other = topology_of(HOUSE)
    with pytest.raises(hn.errors.InvalidValueError, match="expected one of the topological map's"):
        hn.ext.fleet.floor_graph(
            other, hn.graphs.build_lane_graph(topology, spacing_m=20), name="1"
        )
