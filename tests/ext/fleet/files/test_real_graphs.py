"""Graphs that people have drawn on their maps, and floors of a real building in every format."""

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.fleet import (
    BuildingGraph,
    FloorGraph,
    Link,
    LinkEnd,
    align_floors,
    check_building_graph,
    judge_building_graph,
    match_graph,
    moved_floor,
)
from hybridnav.graphs.method import GraphMethod
from hybridnav.harness.judges import judge_line, segment_faults
from hybridnav.harness.scenes import sample_pairs
from tests.nav2_reader import read_nav2

ANCHOR = hn.ext.fleet.Anchor(30.2862, -97.7366, heading_deg=12)


@pytest.fixture(scope="module")
def gdc(data):
    """The maps of the floors 2 and 3 with a lift at a node of each, and their building."""
    topologies, graphs, at = {}, {}, {}
    for name in ("2", "3"):
        grid = hn.load_map(data / "bwi_gdc" / name / f"{name}.yaml", robot_radius_m=0.25)
        topologies[name] = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
        graphs[name] = hn.graphs.build_lane_graph(topologies[name])
        degrees = np.bincount(graphs[name].edges[:, 0], minlength=graphs[name].n_nodes)
        x, y = graphs[name].points[int(degrees.argmax())].tolist()
        at[name] = LinkEnd(name, (x + 0.02, y))
    lift = Link(name="lift", kind="lift", ends=(at["2"], at["3"]), ride_s=10, max_radius_m=0.5)
    floors = [
        hn.ext.fleet.floor_graph(
            topologies[name], graphs[name], name=name, elevation_m=height, links=[lift]
        )
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
        hn.ext.fleet.export_rmf(building, path)
    elif kind == "osm":
        hn.ext.fleet.export_osm(building, path, anchor=ANCHOR)
    else:
        hn.ext.fleet.export_lif(building, path, vehicle_types=["A.B"])
    back = hn.ext.fleet.load_building_graph(path)
    (lift,) = back.links
    assert [end.floor for end in lift.ends] == ["2", "3"]
    (x, y), (u, v) = (end.position_m for end in own.links[0].ends)
    for floor, shift in zip(back.floors, ((0.0, 0.0), (u - x, v - y)), strict=True):
        written = own.floor(floor.name)
        read = moved_floor(floor, (*shift, 0.0)).graph
        assert read.points == pytest.approx(written.graph.points, abs=1e-5)
        assert read.n_edges == written.graph.n_edges
        check = hn.graphs.check_graph(topologies[floor.name], written.graph)
        again = hn.graphs.check_graph(topologies[floor.name], read)
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
    floors = [hn.ext.fleet.Floor(name, hn.HybridPlanner(topologies[name])) for name in ("2", "3")]
    house = hn.ext.fleet.Building(floors, own.links)
    path = tmp_path / {"rmf": "a.yaml", "osm": "a.osm", "lif": "a.json"}[kind]
    writers = {
        "rmf": lambda graph: hn.ext.fleet.export_rmf(graph, path),
        "osm": lambda graph: hn.ext.fleet.export_osm(graph, path, anchor=ANCHOR),
        "lif": lambda graph: hn.ext.fleet.export_lif(graph, path, vehicle_types=["A.B"]),
    }
    writers[kind](align_floors(own))
    matched = match_graph(house, hn.ext.fleet.load_building_graph(path), align=True)
    for name, floor in matched.floors.items():
        # A node on the side of a blocked cell is placed a grain of the cell, 0.05 m / 1024, aside.
        assert np.allclose(floor.graph.points, own.floor(name).graph.points, rtol=0, atol=5e-5)
    check = check_building_graph(matched)
    assert {found.kind for found in check.findings} <= {"island"}  # as free space has them
    for checked in check.floors.values():
        assert checked.is_free.all()
        assert checked.is_clear.all()
    report = judge_building_graph(matched, pairs=40)
    assert report.contradictions == ()
    assert set(report.counts["all"].answers) <= {"solved", "no path, right", "no node in sight"}
    assert report.counts["two floors"].answers["solved"] > 10


def _graphs_of(file, folder):
    """The graph of a file, and the same through the formats of fleets; none if it is no graph."""
    try:
        graph = hn.ext.fleet.load_graph(file)
    except hn.errors.MapError:
        return []
    house = BuildingGraph(name="a", floors=(FloorGraph(name="0", graph=graph),))
    hn.ext.fleet.export_rmf(house, folder / "a.yaml")
    hn.ext.fleet.export_osm(house, folder / "a.osm", anchor=ANCHOR)
    hn.ext.fleet.export_lif(house, folder / "a.json", vehicle_types=["A.B"])
    return [
        graph,
        *(hn.ext.fleet.load_graph(folder / f"a.{end}") for end in ("yaml", "osm", "json")),
    ]


@pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")
def test_nav2_takes_every_graph_that_can_be_written_of_the_reference_data(data, tmp_path):
    endings = (".geojson", ".json", ".tplg", ".tpl", ".tmap", ".tmap2", ".graphml", ".osm", ".gml")
    taken = 0
    for file in sorted(each for each in data.rglob("*") if each.suffix in endings):
        for graph in _graphs_of(file, tmp_path):
            hn.graphs.export_nav2(graph, tmp_path / "nav2.geojson")
            read_nav2(tmp_path / "nav2.geojson", costs=False, lines=False)
            assert hn.ext.fleet.load_graph(tmp_path / "nav2.geojson").findings == ()
            taken += 1
    assert taken >= 4 * 12


FITS = {
    "nav2/graphs/nav2_bringup/depot_graph.geojson": "nav2/maps/depot.yaml",
    "nav2/graphs/nav2_bringup/turtlebot3_graph.geojson": "nav2/maps/tb3_sandbox.yaml",
    "nav2/graphs/nav2_route/aws_graph.geojson": "aws_small_warehouse/005/map.yaml",
    "strands/g4s/g4s_sim.tplg": "strands/g4s/g4s_sim_cropped.yaml",
    "strands/g4s/g4s_y2.tmap": "strands/g4s/g4s_y2.yaml",
    "strands/tsc_y3/tsc_y3_final.tplg": "strands/tsc_y3/tsc20160523.yaml",
    "strands/tsc_y4/tsc_y4_final.tplg.tpl": "strands/tsc_y4/tsc_1701.yaml",
}


@pytest.mark.filterwarnings("ignore::hybridnav.errors.MapWarning")
@pytest.mark.parametrize("name", FITS)
def test_what_is_clear_and_what_routes_are_is_judged_by_exact_geometry(data, name):
    graph = hn.ext.fleet.load_graph(data / name)
    grid = hn.load_map(data / FITS[name], robot_radius_m=0.2)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=4.0))
    found = hn.graphs.check_graph(topology, graph)
    points = graph.points.tolist()
    for edge, (tail, head) in enumerate(graph.edges.tolist()):
        wrong = segment_faults(grid, [points[tail], points[head]])
        assert found.is_clear[edge] == (not wrong), graph.edge_text(edge)
    assert found.is_clear.sum() > graph.n_edges / 2  # the graph and the map fit
    method = GraphMethod(grid, graph, clear_edges_only=True)
    solved = 0
    for pair in sample_pairs(grid, 40, seed=0):
        answer = method.solve(pair.start, pair.goal)
        if answer.any_angle is not None:
            line = answer.any_angle
            verdict = judge_line(grid, line.points, start=pair.start, goal=pair.goal)
            assert verdict.faults == ()
            assert line.length_m == pytest.approx(verdict.length_m)
            solved += 1
    assert solved
