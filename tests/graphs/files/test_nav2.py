"""Route graphs for Nav2, read again by the rules of its loader."""

import json
import math
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.harness.judges import segment_faults
from tests.drawn_rooms import HOUSE, topology_of
from tests.nav2_reader import read_nav2
from tests.strategies import class_grids, occupancy_grid, tried


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("graphs")


def topology(classes):
    return hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(classes)))


@tried(40, class_grids(20))
def test_edges_are_free_and_nodes_connected_exactly_where_free_space_is(folder, classes):
    if not (classes == hn.CellClass.FREE).any():
        return
    here = topology(classes)
    built = hn.graphs.build_lane_graph(here)
    if not built.n_edges:
        return
    hn.graphs.export_nav2(built, folder / "any.geojson")
    graph = read_nav2(folder / "any.geojson")
    for line in graph.lines.values():
        assert segment_faults(here.grid, line) == ()
    part_at, count = ndimage.label(classes == hn.CellClass.FREE)
    touched = [
        set.intersection(*(_labels_at(part_at, graph.points[node]) for node in part))
        for part in graph.parts()
    ]
    # Parts have nodes but for the margin of the image; a single node is left out.
    expected = set(range(1, count + 1)) - _margin(part_at, count)
    found = [min(part) for part in touched]
    assert len(set(found)) == len(found)
    assert set(found) <= expected


def _margin(part_at, count):
    """The part that reaches all sides of the map, fills half of its border, and surrounds free
    cells: a tenth of its own at least."""
    rows, cols = part_at.shape
    border = [
        [(row, col) for row in range(rows) for col in range(cols) if side(row, col)]
        for side in (
            lambda row, _: row == 0,
            lambda row, _: row == rows - 1,
            lambda _, col: col == 0,
            lambda _, col: col == cols - 1,
        )
    ]
    reached = {
        n: [sum(part_at[cell] == n for cell in side) for side in border] for n in range(count + 1)
    }
    inside = sum(int((part_at == n).sum()) for n in range(1, count + 1) if not any(reached[n]))
    return {
        n
        for n in range(1, count + 1)
        if all(reached[n])
        and 2 * sum(reached[n]) >= sum(map(len, border))
        and 10 * inside >= (part_at == n).sum()
    }


def test_the_margin_of_an_image_gets_no_nodes(folder):
    classes = np.full((12, 12), hn.CellClass.FREE)
    classes[1:11, 1:11] = hn.CellClass.UNEXPLORED
    classes[2:10, 2:10] = hn.CellClass.FREE
    hn.graphs.export_nav2(hn.graphs.build_lane_graph(topology(classes)), folder / "rim.geojson")
    points = read_nav2(folder / "rim.geojson").points.values()
    assert points
    assert all(2 < x < 10 and 2 < y < 10 for x, y in points)


def _labels_at(part_at, point):
    """The parts whose closed cells a point lies in."""
    x, y = point
    rows = {math.floor(y), math.ceil(y) - 1}
    cols = {math.floor(x), math.ceil(x) - 1}
    shape = part_at.shape
    cells = [(r, c) for r in rows for c in cols if 0 <= r < shape[0] and 0 <= c < shape[1]]
    return {int(part_at[cell]) for cell in cells} - {0}


@pytest.mark.parametrize("yaw_rad", [0.0, 0.7, -3.0])
def test_a_file_holds_the_graph_in_metres_of_the_map_frame(folder, yaw_rad):
    here = topology_of(HOUSE, origin_m=(-3.0, 12.5), yaw_rad=yaw_rad)
    built = hn.graphs.build_lane_graph(here)
    hn.graphs.export_nav2(built, folder / "house.geojson", frame="floor")
    graph = read_nav2(folder / "house.geojson")
    assert set(graph.frames.values()) == {"floor"}
    assert list(graph.points.values()) == list(map(tuple, built.points.tolist()))
    assert list(graph.edges.values()) == list(map(tuple, built.edges.tolist()))
    # Turned and moved back, the points are those of the cells.
    plain = built.positions[:, ::-1] * here.grid.resolution_m
    turn = np.array([[np.cos(yaw_rad), np.sin(yaw_rad)], [-np.sin(yaw_rad), np.cos(yaw_rad)]])
    points = (np.array(list(graph.points.values())) - [-3.0, 12.5]) @ turn.T
    assert np.allclose(points, plain)
    for number, (tail, head) in graph.edges.items():
        assert (head, tail) in graph.edges.values()
        length_m = math.dist(graph.points[tail], graph.points[head])
        assert graph.costs[number] == pytest.approx(length_m)


def test_rooms_and_doors_have_nodes_and_edges_name_the_doors_that_they_pass(folder):
    here = topology_of(HOUSE)
    hn.graphs.export_nav2(hn.graphs.build_lane_graph(here), folder / "house.geojson")
    graph = read_nav2(folder / "house.geojson")
    names = {facts.get("room") for facts in graph.node_facts.values()}
    assert set(here.rooms.names) <= names
    doors = {door.number for door in here.rooms.doors}
    assert {facts.get("door") for facts in graph.node_facts.values()} - {None} == doors
    # Without the edges of a door, no other room is reached from behind it.
    kitchen = {n for n, facts in graph.node_facts.items() if facts.get("room") == "kitchen"}
    number = next(door.number for door in here.rooms.doors if "kitchen" in door.rooms)
    left = nx.Graph(
        edge
        for key, edge in graph.edges.items()
        if number not in graph.edge_facts[key].get("doors", [])
    )
    left.add_nodes_from(graph.points)
    start = next(n for n in kitchen if graph.node_facts[n]["class"] == "room")
    inside = nx.node_connected_component(left, start)
    assert {graph.node_facts[n].get("room") for n in inside} <= {"kitchen", "corridor"}
    in_corridor = [n for n in inside if graph.node_facts[n].get("room") == "corridor"]
    assert all(graph.node_facts[n].get("door") == number for n in in_corridor)


def test_measures_beside_an_edge_are_those_of_the_walls(folder):
    # A corridor of 3 x 12 m, closed all round; the left of an eastward edge is north.
    cells = np.ones((32, 122), dtype=np.float32)
    cells[1:31, 1:121] = 0.0
    grid = hn.OccupancyGrid(cells, hn.Frame(0.1, (-0.1, -0.1)), robot_radius_m=0)
    here = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=4.0))
    hn.graphs.export_nav2(hn.graphs.build_lane_graph(here), folder / "corridor.geojson")
    graph = read_nav2(folder / "corridor.geojson")
    eastward = 0
    for number, (tail, head) in graph.edges.items():
        (x, y), (to_x, to_y) = graph.points[tail], graph.points[head]
        if abs(y - to_y) < 0.05 and to_x > x:
            eastward += 1
            facts = graph.edge_facts[number]
            assert (facts["left_m"], facts["right_m"]) == pytest.approx(
                (3 - max(y, to_y), min(y, to_y)), abs=1e-3
            )
            assert facts["width_m"] == 3.0
    assert eastward


def test_what_nav2_would_refuse_is_refused_in_one_line(folder):
    def square(cells, side_m):
        grid = hn.OccupancyGrid(np.zeros(cells), hn.Frame(side_m), robot_radius_m=0)
        return hn.TopologicalMap(hn.DualGraphPyramid.build(grid))

    assert hn.graphs.build_lane_graph(square((2, 2), 0.5)).n_edges == 2
    alone = hn.graphs.build_lane_graph(square((1, 1), 1.0))
    assert (alone.n_nodes, alone.n_edges) == (1, 0)
    with pytest.raises(hn.errors.InvalidValueError, match=r"no edge.*a smaller spacing_m"):
        hn.graphs.export_nav2(alone, folder / "alone.geojson")
    built = hn.graphs.build_lane_graph(topology_of(HOUSE))
    with pytest.raises(hn.errors.MapError, match="geojson"):
        hn.graphs.export_nav2(built, folder / "graph.txt")
    with pytest.raises(hn.errors.MapError, match="cannot write"):
        hn.graphs.export_nav2(built, folder / "none" / "graph.geojson")
    with pytest.raises(hn.errors.InvalidValueError, match="frame"):
        hn.graphs.export_nav2(built, folder / "graph.geojson", frame="")
    assert not (folder / "alone.geojson").exists()


def test_names_of_any_text_survive(folder):
    label_of = np.zeros((4, 8), dtype=int)
    label_of[:, 4:] = 1
    names = ('a "room" \\ über', "日本\n")
    names = (names[0], names[1].strip())
    grid = hn.OccupancyGrid(np.zeros((4, 8), dtype=np.float32), robot_radius_m=0)
    pyramid = hn.DualGraphPyramid.build(grid, rooms=hn.RoomLabels(names, label_of))
    hn.graphs.export_nav2(
        hn.graphs.build_lane_graph(hn.TopologicalMap(pyramid)), folder / "names.geojson"
    )
    graph = read_nav2(folder / "names.geojson")
    assert {facts["room"] for facts in graph.node_facts.values()} == set(names)
    assert json.loads((folder / "names.geojson").read_bytes())["features"]


@given(st.sampled_from([0, -1, math.nan, math.inf]))
def test_bad_arguments_are_refused(value):
    here = topology_of(HOUSE)
    with pytest.raises(hn.errors.InvalidValueError, match="spacing_m"):
        hn.graphs.build_lane_graph(here, spacing_m=value)
