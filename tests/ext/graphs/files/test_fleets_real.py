"""Two floors of a real building in every format of fleets, read back and judged on their maps."""

from __future__ import annotations

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.fleet import (
    BuildingGraph,
    Link,
    LinkEnd,
    align_floors,
    check_building_graph,
    judge_building_graph,
    match_graph,
    moved_floor,
)

ANCHOR = hn.Anchor(30.2862, -97.7366, heading_deg=12)


@pytest.fixture(scope="module")
def gdc(data):
    """The maps of the floors 2 and 3 with a lift at a node of each, and their building."""
    topologies, graphs, at = {}, {}, {}
    for name in ("2", "3"):
        grid = hn.load_map(data / "bwi_gdc" / name / f"{name}.yaml", robot_radius_m=0.25)
        topologies[name] = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
        graphs[name] = hn.build_route_graph(topologies[name], nodes=300)
        degrees = np.bincount(graphs[name].edges[:, 0], minlength=graphs[name].n_nodes)
        x, y = graphs[name].points[int(degrees.argmax())].tolist()
        at[name] = LinkEnd(name, (x + 0.02, y))
    lift = Link(name="lift", kind="lift", ends=(at["2"], at["3"]), ride_s=10, max_radius_m=0.5)
    floors = [
        hn.floor_graph(topologies[name], graphs[name], name=name, elevation_m=height, links=[lift])
        for name, height in (("2", 5.0), ("3", 10.0))
    ]
    building = BuildingGraph(name="gdc", floors=tuple(floors), links=(lift,))
    return topologies, building


@pytest.mark.parametrize("kind", ["rmf", "osm", "lif"])
def test_two_floors_survive_and_their_edges_stay_free(gdc, tmp_path, kind):
    topologies, own = gdc
    building = align_floors(own)
    path = tmp_path / {"rmf": "a.yaml", "osm": "a.osm", "lif": "a.json"}[kind]
    if kind == "rmf":
        hn.export_rmf(building, path)
    elif kind == "osm":
        hn.export_osm(building, path, anchor=ANCHOR)
    else:
        hn.export_lif(building, path, vehicle_types=["A.B"])
    back = hn.load_building_graph(path)
    (lift,) = back.links
    assert [end.floor for end in lift.ends] == ["2", "3"]
    (x, y), (u, v) = (end.position_m for end in own.links[0].ends)
    for floor, shift in zip(back.floors, ((0.0, 0.0), (u - x, v - y)), strict=True):
        written = own.floor(floor.name)
        read = moved_floor(floor, (*shift, 0.0)).graph
        assert read.points == pytest.approx(written.graph.points, abs=1e-5)
        assert read.n_edges == written.graph.n_edges
        check = hn.check_graph(topologies[floor.name], written.graph)
        again = hn.check_graph(topologies[floor.name], read)
        # Nodes at a wall may lie in it after a shift that is rounded; those of a floor that stays
        # do not.
        if floor.name == "2":
            assert {one.kind: one.count for one in again.findings} == {
                one.kind: one.count for one in check.findings
            }
            assert again.is_clear.all()


@pytest.mark.parametrize("kind", ["rmf", "osm", "lif"])
def test_the_graph_of_both_floors_is_judged_as_if_no_file_lay_between(gdc, tmp_path, kind):
    topologies, own = gdc
    floors = [hn.Floor(name, hn.HybridPlanner(topologies[name])) for name in ("2", "3")]
    house = hn.Building(floors, own.links)
    path = tmp_path / {"rmf": "a.yaml", "osm": "a.osm", "lif": "a.json"}[kind]
    writers = {
        "rmf": lambda graph: hn.export_rmf(graph, path),
        "osm": lambda graph: hn.export_osm(graph, path, anchor=ANCHOR),
        "lif": lambda graph: hn.export_lif(graph, path, vehicle_types=["A.B"]),
    }
    writers[kind](align_floors(own))
    matched = match_graph(house, hn.load_building_graph(path), align=True)
    for name, floor in matched.floors.items():
        assert np.allclose(floor.graph.points, own.floor(name).graph.points, rtol=0, atol=1e-5)
    check = check_building_graph(matched)
    assert check.findings == ()
    for checked in check.floors.values():
        assert checked.is_free.all()
        assert checked.is_clear.all()
    report = judge_building_graph(matched, pairs=40)
    assert report.contradictions == ()
    assert set(report.counts["all"].answers) <= {"solved", "no path, right", "no node in sight"}
    assert report.counts["two floors"].answers["solved"] > 10
