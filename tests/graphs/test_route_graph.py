"""Route graphs that Nav2 can follow: nodes and edges clear by its own walk, routes round corners,
routes as messages."""

import json
import math
import warnings
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.graphs import route_messages
from hybridnav.maps.geometry import walks_clear
from tests.drawn_rooms import HOUSE, topology_of
from tests.layers import grid_of
from tests.nav2_reader import read_nav2
from tests.nav2_walk import Costmap, line_cells
from tests.strategies import class_grids, occupancy_grid, tried

ROOT = Path(__file__).parents[2]
RADIUS_M = 0.25
OWN = ("figure1/figure1.yaml", "office/office.yaml")
OTHERS = ("aws_small_warehouse/005/map.yaml", "strands/g4s/g4s_y2.yaml", "turtlebot4/depot.yaml")
DEEP_CELLS = 0.01
"""Least depth of a node in its cell: more than the 32-bit numbers of Nav2's loader lose."""


def map_of(name, *, radius_m=RADIUS_M):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hn.errors.MapWarning)
        grid = hn.load_map(name, robot_radius_m=radius_m)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid))


def boxes(seed, *, radius_m=0.1, **frame):
    """8 x 8 m with boxes and posts, and walls of one cell."""
    rng = np.random.default_rng(seed)
    cells = np.zeros((80, 80), dtype=np.float32)
    for row, col in rng.integers(4, 64, size=(8, 2)).tolist():
        height, width = rng.integers(3, 16, size=2).tolist()
        cells[row : row + height, col : col + width] = 1.0
    for row, col in rng.integers(2, 76, size=(25, 2)).tolist():
        cells[row, col] = cells[row + 1, col + 1] = 1.0
    cells[:60, 40] = cells[30, 10:70] = 1.0
    grid = hn.OccupancyGrid(cells, hn.Frame(0.1, **frame), robot_radius_m=radius_m)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))


def slanted():
    """Two halls between walls that the lattice turns into stairs, and a slanted gap of 0.4 m."""
    row, col = np.indices((90, 120))
    along, across = col * 0.93 + row * 0.37, row * 0.93 - col * 0.37
    cells = ((along < 8) | (along > 110) | (across < -30) | (across > 66)).astype(np.float32)
    cells[(abs(across - 18) < 1.2) & (abs(along - 60) > 4)] = 1.0
    grid = hn.OccupancyGrid(cells, hn.Frame(0.1), robot_radius_m=0.15)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))


def agreed(topology, folder):
    """Export the graph of a map, and compare all who judge it; return the graph."""
    built = hn.graphs.build_lane_graph(topology)
    hn.graphs.export_nav2(built, folder / "graph.geojson")
    graph, costmap = read_nav2(folder / "graph.geojson"), Costmap(topology.grid)
    planner = hn.HybridPlanner(topology)
    begin = next(iter(graph.points.values()))
    for point in graph.points.values():
        assert costmap.depth(*point) > DEEP_CELLS
        assert planner.plan(begin, point).status in {"solved", "no path"}
    for tail, head in graph.edges.values():
        assert not costmap.collides(graph.points[tail], graph.points[head])
    check = hn.graphs.check_graph(topology, hn.ext.fleet.load_graph(folder / "graph.geojson"))
    # An export with few nodes may leave out rooms on purpose; none of these does.
    assert {found.kind for found in check.findings} <= {"island"}
    return built


@pytest.mark.parametrize("name", OWN)
def test_own_maps(name, tmp_path):
    radius_m = 0 if name.startswith("figure1") else RADIUS_M
    topology = map_of(ROOT / "maps" / name, radius_m=radius_m)
    agreed(topology, tmp_path)


@pytest.mark.parametrize("yaw_rad", [0.0, 0.4])
def test_rooms_and_doors(yaw_rad, tmp_path):
    topology = topology_of(HOUSE, origin_m=(-3.0, 1.0), yaw_rad=yaw_rad)
    kinds = agreed(topology, tmp_path).kinds
    assert {"room", "door", "bend"} <= set(kinds)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_boxes(seed, tmp_path):
    agreed(boxes(seed, radius_m=0.1 * (seed % 2)), tmp_path)


def test_walls_aslant(tmp_path):
    agreed(slanted(), tmp_path)


@pytest.mark.parametrize("name", OTHERS)
def test_maps_of_others(data, name, tmp_path):
    agreed(map_of(data / name), tmp_path)


@pytest.mark.parametrize("apart_m", [0.4, 0.5, 0.65])
def test_lanes(apart_m, tmp_path):
    topology = boxes(0)
    graph = hn.graphs.keep_right(topology, hn.graphs.build_lane_graph(topology), apart_m=apart_m)
    assert "lane" in graph.kinds
    hn.graphs.export_nav2(graph, tmp_path / "lanes.geojson")
    read, costmap = read_nav2(tmp_path / "lanes.geojson"), Costmap(topology.grid)
    assert min(costmap.depth(*point) for point in read.points.values()) > 5e-4
    assert not any(
        costmap.collides(read.points[tail], read.points[head]) for tail, head in read.edges.values()
    )


@tried(60, class_grids(14))
def test_any_map(classes):
    if not (classes == hn.CellClass.FREE).any():
        return
    grid = occupancy_grid(classes)
    graph = hn.graphs.build_lane_graph(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    costmap, points = Costmap(grid), graph.points.tolist()
    assert min(costmap.depth(*point) for point in points) > DEEP_CELLS
    for tail, head in graph.edges.tolist():
        assert not costmap.collides(tuple(points[tail]), tuple(points[head]))


@tried(100, class_grids(12), st.data())
def test_walks_are_those_of_nav2(classes, data):
    free = classes == hn.CellClass.FREE
    cell = st.tuples(*(st.integers(0, side - 1) for side in free.shape))
    tails = np.array(data.draw(st.lists(cell, min_size=1, max_size=8)))
    heads = np.array(data.draw(st.lists(cell, min_size=len(tails), max_size=len(tails))))
    for pair, is_clear in enumerate(walks_clear(free, tails, heads).tolist()):
        (row, col), (to_row, to_col) = tails[pair].tolist(), heads[pair].tolist()
        cells = line_cells(col, row, to_col, to_row)
        assert is_clear == all(free[at[::-1]] for at in cells)


@pytest.fixture(scope="module")
def graph() -> hn.graphs.RouteGraph:
    plan = np.zeros((30, 40))
    plan[:20, 20] = 1.0
    grid = grid_of(plan, hn.Frame(0.1, (3.0, 4.0), 1.0), robot_radius_m=0)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))
    return hn.graphs.build_lane_graph(topology)


def walk(graph: hn.graphs.RouteGraph, rng: np.random.Generator, steps: int) -> list[int]:
    nodes = [int(rng.integers(graph.n_nodes))]
    for _ in range(steps):
        heads = graph.edges[graph.edges[:, 0] == nodes[-1], 1]
        nodes.append(int(rng.choice(heads)))
    return nodes


@pytest.mark.parametrize("seed", range(10))
def test_a_route_has_the_ids_and_costs_of_the_exported_file(graph, seed, tmp_path):
    hn.graphs.export_nav2(graph, tmp_path / "graph.geojson")
    file = read_nav2(tmp_path / "graph.geojson")
    nodes = walk(graph, np.random.default_rng(seed), seed)
    found = json.loads(json.dumps(route_messages(graph, nodes, frame_id="floor", stamp_ns=5)))
    route, path = found["route"], found["path"]
    header = {"stamp": {"sec": 0, "nanosec": 5}, "frame_id": "floor"}
    assert route["header"] == path["header"] == header
    assert [node["nodeid"] for node in route["nodes"]] == nodes
    for node in route["nodes"]:
        at = node["position"]
        assert (at["x"], at["y"], at["z"]) == pytest.approx((*file.points[node["nodeid"]], 0))
    ids = [edge["edgeid"] for edge in route["edges"]]
    assert [file.edges[number] for number in ids] == list(pairwise(nodes))
    assert route["route_cost"] == pytest.approx(sum(file.costs[number] for number in ids))
    poses = [pose["pose"]["position"] for pose in path["poses"]]
    at = np.array([(pose["x"], pose["y"]) for pose in poses])
    assert np.hypot(*np.diff(at, axis=0).T).max(initial=0) <= 0.05 + 1e-9
    assert np.hypot(*np.diff(at, axis=0).T).sum() == pytest.approx(route["route_cost"])
    for node in nodes:
        assert min(math.dist(point, file.points[node]) for point in at) < 1e-9


@pytest.mark.parametrize(
    ("nodes", "words"),
    [
        ([], "at least one node"),
        ([-1], "no node -1, nodes are 0 to"),
        ([99999], "no node 99999"),
        (["0"], "no node '0'"),
        ([0.5], "no node 0.5"),
        ([0, 0], "no edge leads from node 0 to node 0"),
    ],
)
def test_wrong_routes_are_refused_in_one_line(graph, nodes, words):
    with pytest.raises(hn.errors.InvalidValueError, match=words):
        route_messages(graph, nodes)


def test_ids_that_messages_cannot_hold_are_refused(graph: hn.graphs.RouteGraph) -> None:
    large = replace(graph, ids=(graph.ids[0] + 65_535, graph.ids[1] + 65_535))
    assert route_messages(large, [0])["route"]["nodes"][0]["nodeid"] == 65_535
    with pytest.raises(hn.errors.InvalidValueError, match="build the graph with fewer nodes"):
        route_messages(large, graph.edges[0].tolist())


def test_other_things_than_graphs_are_refused() -> None:
    with pytest.raises(hn.errors.InvalidValueError, match="expected a RouteGraph"):
        route_messages("graph", [0])  # type: ignore[arg-type]
