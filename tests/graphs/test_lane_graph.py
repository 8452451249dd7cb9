"""Route graphs of lanes: plane, free, connected as free space is, in the middle, and steady."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import strategies as st
from scipy import ndimage
from scipy.spatial import KDTree

import hybridnav as hn
from hybridnav.graphs import build_lane_graph
from hybridnav.graphs.drawing import drop_ends
from hybridnav.graphs.free_space import FreeSpace
from hybridnav.graphs.kernels import spread, thinned
from hybridnav.graphs.sketch import END, NOTHING, ROOM, Sketch
from hybridnav.graphs.strands import Passage
from hybridnav.graphs.waypoint_graph import components_of
from hybridnav.harness.judges import segment_faults
from hybridnav.maps.clearance import clearance_cells
from tests.drawn_rooms import HOUSE, topology_of
from tests.graphs.test_route_graph import boxes, map_of, slanted
from tests.nav2_reader import read_nav2
from tests.nav2_walk import Costmap
from tests.strategies import class_grids, occupancy_grid, tried

OTHERS = ("aws_small_warehouse/005/map.yaml", "strands/g4s/g4s_y2.yaml", "nav2/maps/depot.yaml")


def floor(cells, *, radius_m=0.2, side_m=0.1, **frame):
    grid = hn.OccupancyGrid(
        np.asarray(cells, dtype=np.float32), hn.Frame(side_m, **frame), robot_radius_m=radius_m
    )
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0))


def hall(rows, cols):
    cells = np.ones((rows + 2, cols + 2))
    cells[1:-1, 1:-1] = 0.0
    return cells


def checked(topology, **options):
    """Build a graph, and judge it by tests that the builder does not use; return it."""
    graph = build_lane_graph(topology, **options)
    grid, costmap = topology.grid, Costmap(topology.grid)
    for tail, head in graph.edges.tolist():
        ends = graph.points[[tail, head]]
        assert segment_faults(grid, ends) == ()
        assert not costmap.collides(*map(tuple, ends.tolist()))
    # Two edges have a point in common only where they share a node.
    ends = graph.points[graph.edges[graph.edges[:, 0] < graph.edges[:, 1]]]
    lines = [shapely.LineString(pair) for pair in ends]
    network = shapely.node(shapely.MultiLineString(lines))
    assert len(getattr(network, "geoms", [network])) == len(lines) or not lines
    # Parts of the graph are those of free space, of 1 m² or more.
    free = grid.enterable(allow_unexplored=False)
    labels, count = ndimage.label(free)
    part_of = labels[tuple(grid.frame.cells_of(graph.points).T)]
    large = np.flatnonzero(
        np.bincount(labels.ravel(), minlength=count + 1) * grid.cell_area_m2 >= 1
    )
    parts = components_of(graph.n_nodes, graph.edges, "strong")
    pairs = set(zip(part_of.tolist(), parts.tolist(), strict=True))
    assert len(pairs) == len({part for part, _ in pairs}) == len({part for _, part in pairs})
    assert {part for part, _ in pairs} <= set(large.tolist()) - {0}
    return graph


@tried(80, class_grids(24))
def test_any_map(classes):
    if (classes == hn.CellClass.FREE).any():
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(classes)))
        checked(topology, spacing_m=2.0, margin_m=0.5)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_boxes_and_posts(seed):
    checked(boxes(seed, radius_m=0.1 * (seed % 2)))


def test_walls_aslant():
    checked(slanted())


@pytest.mark.parametrize("name", OTHERS)
def test_maps_of_others(data, name):
    checked(map_of(data / name))


def test_a_corridor_has_one_lane_in_its_middle_along_its_walls():
    for yaw_rad in (0.0, 0.4):
        graph = checked(floor(hall(20, 200), yaw_rad=yaw_rad))
        turned = graph.positions
        assert np.ptp(turned[:, 0]) <= 0.5
        assert abs(turned[:, 0].mean() - 11) <= 0.6
        assert np.ptp(turned[:, 1]) * 0.1 >= 20 - 2 * 3.6
        assert graph.n_nodes <= 6


def test_a_hall_has_a_net_of_lanes():
    graph = checked(floor(hall(160, 200)), spacing_m=4.0)
    lengths = graph.lengths_m
    assert 2.5 <= np.median(lengths) <= 5.0
    assert lengths.max() <= 1.25 * 4.0 * 1.3
    away, _ = KDTree(graph.positions).query(np.argwhere(hall(160, 200) == 0) + 0.5)
    assert np.max(away) * 0.1 <= 4.0
    steps = np.abs(np.diff(graph.positions[graph.edges], axis=1)[:, 0])
    assert (steps.min(axis=1) <= 0.05 * steps.max(axis=1)).mean() >= 0.7


def test_a_small_hall_has_a_finer_net_and_a_large_one_that_of_4_m():
    small, large = floor(hall(50, 50)), floor(hall(160, 200))
    assert checked(small).n_edges >= 2 * checked(small).n_nodes  # rings, where 4 m leaves none
    assert checked(small, spacing_m=4.0).n_edges < 2 * checked(small, spacing_m=4.0).n_nodes
    assert np.array_equal(checked(large).positions, checked(large, spacing_m=4.0).positions)


def test_rooms_and_doors_have_nodes_and_edges_have_names():
    topology = topology_of(HOUSE)
    graph = checked(topology)
    doors = {door.number for door in topology.rooms.doors}
    assert set(graph.doors.tolist()) - {0} == doors
    assert {n for passed in graph.edge_doors for n in passed} == doors
    rooms = {room for room, kind in zip(graph.rooms, graph.kinds, strict=True) if kind == "room"}
    assert rooms == set(topology.rooms.names)


def test_lanes_keep_their_margin_where_there_is_as_much():
    # A post leaves 0.6 m on one side and 2 m on the other.
    cells = hall(40, 160)
    cells[11:19, 80:84] = 1.0
    graph = checked(floor(cells, radius_m=0.2), margin_m=0.4)
    assert graph.clearances_m.min() >= 0.6 - 0.1


def test_a_small_post_has_a_lane_on_one_side_only():
    cells = hall(40, 160)
    cells[20:22, 80:82] = 1.0
    graph = checked(floor(cells))
    assert graph.n_edges == 2 * (graph.n_nodes - 1)
    cells[16:28, 60:100] = 1.0
    ring = checked(floor(cells))
    assert ring.n_edges >= 2 * ring.n_nodes


def changed(topology, seed):
    grid, rng = topology.grid, np.random.default_rng(seed)
    cells = np.where(grid.measured == hn.CellClass.FREE, 0.0, 1.0)
    free = np.argwhere(cells == 0)
    for row, col in free[rng.integers(len(free), size=max(1, len(free) // 2500))].tolist():
        cells[row : row + 5, col : col + 5] = 1.0
    new = hn.OccupancyGrid(cells.astype(np.float32), grid.frame, robot_radius_m=grid.robot_radius_m)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(new, merge_distance_m=2.0))


@pytest.mark.parametrize("seed", range(4))
def test_a_changed_map_keeps_nodes_and_ids(seed):
    topology = boxes(seed, radius_m=0.1)
    before = build_lane_graph(topology, spacing_m=2.0)
    after = checked(changed(topology, seed), spacing_m=2.0, keep=before)
    at = dict(zip(before.ids[0].tolist(), before.points.tolist(), strict=True))
    now = dict(zip(after.ids[0].tolist(), after.points.tolist(), strict=True))
    assert len(now.keys() & at.keys()) >= 0.9 * before.n_nodes
    assert all(np.hypot(*np.subtract(now[n], at[n])) <= 1.0 + 1e-6 for n in now.keys() & at.keys())
    ends = [
        dict(zip(one.ids[1].tolist(), one.ids[0][one.edges].tolist(), strict=True))
        for one in (before, after)
    ]
    assert all(ends[0][n] == ends[1][n] for n in ends[0].keys() & ends[1].keys())
    every = [*after.ids[0].tolist(), *after.ids[1].tolist()]
    assert len(set(every)) == len(every)
    # What is new has ids that nothing had.
    old = {*before.ids[0].tolist(), *before.ids[1].tolist()}
    assert not old & (ends[1].keys() - ends[0].keys())
    assert not old & (now.keys() - at.keys())


def test_a_node_that_a_box_covers_moves_off_and_keeps_its_id():
    topology = floor(hall(160, 200))
    before = build_lane_graph(topology, spacing_m=4.0)
    degree = np.bincount(before.edges.ravel(), minlength=before.n_nodes)
    for node in np.flatnonzero(degree == degree.max())[:3].tolist():
        cells = hall(160, 200)
        row, col = topology.grid.frame.cell_of(*before.points[node])
        cells[row - 3 : row + 3, col - 3 : col + 3] = 1.0
        after = checked(floor(cells), spacing_m=4.0, keep=before)
        assert set(before.ids[0].tolist()) <= set(after.ids[0].tolist())
        now = after.points[after.ids[0].tolist().index(before.ids[0][node])]
        assert 0.3 <= np.hypot(*(now - before.points[node])) <= 1.0


@pytest.mark.parametrize(
    ("kind", "wall", "left"),
    [(END, False, 1), (ROOM, False, 4), (END, True, 4)],
    ids=["in sight", "of a room", "behind a wall"],
)
def test_dead_ends_are_left_out_where_robots_see_another_node(kind, wall, left):
    cells = np.zeros((60, 60), dtype=np.float32)
    cells[30, 10:] = cells[34:, 30] = wall
    space = FreeSpace.of(hn.OccupancyGrid(cells, hn.Frame(0.1), robot_radius_m=0))
    at = np.array([[10.5, 50.5], [10.5, 5.5], [50.5, 5.5], [50.5, 50.5]])
    kinds = np.array([ROOM, NOTHING, NOTHING, kind])
    passage = Passage(space, clearance_cells(~space.free), 2.0)
    sketch = Sketch(at, kinds, np.array([[0, 1], [1, 2], [2, 3]]), passage)
    drop_ends(sketch, 60.0, 90.0, 3)
    # Once the end is gone the next is one, and from the first room all of the hall is in sight.
    assert len(sketch.positions) == len(sketch.kinds) == left
    assert sketch.edges.max(initial=0) < len(sketch.positions)


def test_an_unchanged_map_keeps_everything_through_a_file(tmp_path):
    topology = topology_of(HOUSE)
    graph = build_lane_graph(topology)
    hn.graphs.export_nav2(graph, tmp_path / "a.geojson")
    known = hn.ext.fleet.load_graph(tmp_path / "a.geojson")
    again = build_lane_graph(topology, keep=known)
    hn.graphs.export_nav2(again, tmp_path / "b.geojson")
    assert (tmp_path / "a.geojson").read_bytes() == (tmp_path / "b.geojson").read_bytes()
    own = build_lane_graph(topology, keep=graph)
    assert np.array_equal(own.points, graph.points)


def test_files_and_messages_have_the_ids_of_the_graph(tmp_path):
    graph = build_lane_graph(topology_of(HOUSE))
    ids = graph.ids[0] * 3 + 5, graph.ids[1] * 3 + 6
    graph = replace(graph, ids=ids)
    hn.graphs.export_nav2(graph, tmp_path / "a.geojson")
    read = read_nav2(tmp_path / "a.geojson")
    assert list(read.points) == ids[0].tolist()
    assert read.edges == dict(
        zip(ids[1].tolist(), map(tuple, ids[0][graph.edges].tolist()), strict=True)
    )
    route = hn.graphs.route_messages(graph, graph.edges[3].tolist())["route"]
    assert [node["nodeid"] for node in route["nodes"]] == ids[0][graph.edges[3]].tolist()
    assert [edge["edgeid"] for edge in route["edges"]] == [ids[1][3]]


POINTS = {"dock": (3.3, 5.3), "shelf": (15.8, 2.9), "lift": (20.26, 5.7), "on the lane": (6.0, 3.5)}


@pytest.mark.parametrize("yaw_rad", [0.0, 0.4])
def test_named_points_are_nodes_where_they_are(tmp_path, yaw_rad):
    topology = topology_of(HOUSE, robot_radius_m=0.3, yaw_rad=yaw_rad)
    turn = np.array([[np.cos(yaw_rad), np.sin(yaw_rad)], [-np.sin(yaw_rad), np.cos(yaw_rad)]])
    points = {name: tuple((np.array(at) @ turn).tolist()) for name, at in POINTS.items()}
    plain, graph = checked(topology), checked(topology, points=points)
    at = dict(zip(graph.names, graph.points.tolist(), strict=True))
    for name, point in points.items():
        assert np.hypot(*np.subtract(at[name], point)) <= 0.5 / 16
    # Each adds itself and where its lane begins at most, and the rest of the graph is the same.
    assert graph.n_nodes <= plain.n_nodes + 2 * len(points)
    away, _ = KDTree(graph.points).query(plain.points)
    assert np.max(away) <= 1e-9
    kinds = dict(zip(graph.names, graph.kinds, strict=True))
    assert {kinds[name] for name in points} <= {"point", "room", "door"}
    assert kinds["dock"] == "point"
    hn.graphs.export_nav2(graph, tmp_path / "a.geojson")
    facts = read_nav2(tmp_path / "a.geojson").node_facts
    assert {facts[n]["name"] for n in facts if "name" in facts[n]} == set(points)
    known = hn.ext.fleet.load_graph(tmp_path / "a.geojson")
    hn.graphs.export_nav2(
        build_lane_graph(topology, points=points, keep=known), tmp_path / "b.geojson"
    )
    assert (tmp_path / "a.geojson").read_bytes() == (tmp_path / "b.geojson").read_bytes()
    # Fleets and robots on two lanes know them by the same names.
    floor = hn.ext.fleet.floor_graph(topology, graph, name="1")
    names = {facts["name"] for facts in floor.graph.node_facts.values() if "name" in facts}
    assert set(points) <= names
    apart = hn.graphs.keep_right(topology, graph, apart_m=0.8)
    assert "lane" in apart.kinds
    assert apart.names[: graph.n_nodes] == graph.names


@tried(60, class_grids(20), st.integers(0, 99))
def test_named_points_of_any_map(classes, seed):
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(classes)))
    rng = np.random.default_rng(seed)
    spots = rng.permutation(np.argwhere(classes == hn.CellClass.FREE))[:3] + rng.random(2)
    points = dict(zip("abc", map(tuple, topology.grid.frame.points_of_grid(spots)), strict=False))
    try:
        graph = checked(topology, spacing_m=2.0, points=points)
    except hn.errors.InvalidValueError as error:
        assert "no free part" in str(error) or "without lanes" in str(error)  # noqa: PT017
        return
    found = [n for n, name in enumerate(graph.names) if name is not None]
    assert sorted(graph.names[n] for n in found) == sorted(points)
    away = graph.points[found] - [points[graph.names[n]] for n in found]
    assert np.hypot(*away.T).max(initial=0) <= topology.grid.resolution_m / 16


@pytest.mark.parametrize(
    ("points", "words"),
    [
        ({"wall": (0.1, 0.1)}, "'wall'.*is not free.*move it"),
        ({"far": (1e4, 0.0)}, "is not free"),
        ({"none": (np.nan, 0.0)}, "must be .x, y. in metres"),
        ({"one": (1.0,)}, "must be .x, y. in metres"),
        ({"": (3.3, 5.3)}, "must be texts"),
        ({"a": (3.3, 5.3), "b": (3.3, 5.3)}, "two at one place"),
    ],
)
def test_points_that_are_none_are_refused(points, words):
    with pytest.raises(hn.errors.InvalidValueError, match=words):
        build_lane_graph(topology_of(HOUSE), points=points)


@pytest.mark.parametrize("name", ["a.yaml", "a.osm", "a.json"])
def test_files_of_fleets_keep_ids(tmp_path, name):
    topology = boxes(1, radius_m=0.1)
    graph = build_lane_graph(topology, spacing_m=2.0)
    # Ids as after some changes of the map: with gaps, and in no order.
    at = np.random.default_rng(0).permutation(graph.n_nodes + graph.n_edges) * 2 + 7
    graph = replace(graph, ids=(at[: graph.n_nodes], at[graph.n_nodes :]))
    floors = (hn.ext.fleet.floor_graph(topology, graph, name="2"),)
    house = hn.ext.fleet.BuildingGraph(name="house", floors=floors)
    writers: dict[str, Any] = {
        "a.yaml": hn.ext.fleet.export_rmf,
        "a.osm": partial(hn.ext.fleet.export_osm, anchor=hn.ext.fleet.Anchor(48.1, 11.5, 20)),
        "a.json": partial(hn.ext.fleet.export_lif, vehicle_types=["A.B"]),
    }
    write = writers[name]
    write(house, tmp_path / name)
    known = hn.ext.fleet.load_graph(tmp_path / name)
    again = build_lane_graph(topology, spacing_m=2.0, keep=known)
    # By their ids, nodes are where they were, and edges lead from the same nodes to the same.
    assert hn.graphs.graph_changes(graph, again) == hn.graphs.graph_changes(graph, graph)
    assert set(known.ids[0]) == set(graph.ids[0].tolist())
    # A file that was read is written with the same ids.
    (tmp_path / name).unlink()
    write(hn.ext.fleet.BuildingGraph(
        name="house", floors=(hn.ext.fleet.FloorGraph(name="2", graph=known),)
    ), tmp_path / name)  # fmt: skip
    assert hn.ext.fleet.load_graph(tmp_path / name).ids[0] == known.ids[0]
    after = build_lane_graph(changed(topology, 1), spacing_m=2.0, keep=known)
    stays = np.isin(graph.ids[0], after.ids[0]).mean()
    assert stays >= 0.9


def test_arguments_out_of_range_are_refused():
    topology = floor(hall(20, 40))
    with pytest.raises(hn.errors.InvalidValueError, match="spacing_m"):
        build_lane_graph(topology, spacing_m=0.1)
    for value in (-1, np.nan):
        with pytest.raises(hn.errors.InvalidValueError, match="margin_m"):
            build_lane_graph(topology, margin_m=value)
    with pytest.raises(hn.errors.InvalidValueError, match="no free part"):
        build_lane_graph(floor(np.ones((20, 40))))


@tried(80, class_grids(16))
def test_thinned_cells_are_as_connected_as_before_and_thin(classes):
    inside = np.pad(classes == hn.CellClass.FREE, 1)
    clearance = ndimage.distance_transform_edt(inside)
    order = np.flatnonzero(inside)
    order = order[np.argsort(clearance.ravel()[order], kind="stable")]
    lines = inside.copy()
    thinned(lines, clearance, order, np.zeros_like(inside))
    assert not (lines & ~inside).any()
    around = np.ones((3, 3))
    for cells, kind in ((lines, None), (~lines, around)):
        before = inside if kind is None else ~inside
        labels, count = ndimage.label(cells, structure=kind)
        _, known = ndimage.label(before, structure=kind)
        assert count == known
        if kind is None:
            whole, _ = ndimage.label(before)
            assert (
                len(set(zip(whole[lines].tolist(), labels[lines].tolist(), strict=True))) == count
            )
    block = np.zeros_like(lines[2:, 2:], dtype=int)
    block += sum(lines[i : i + lines.shape[0] - 2, j : j + lines.shape[1] - 2].astype(int)
                for i in range(3) for j in range(3))  # fmt: skip
    assert block.max(initial=0) < 9


@tried(60, class_grids(16))
def test_steps_spread_to_what_is_connected_and_about_as_far(classes):
    free = np.pad(classes == hn.CellClass.FREE, 1)
    if not free.any():
        return
    source = int(np.flatnonzero(free)[0])
    steps = spread(free, np.array([source]))
    labels, _ = ndimage.label(free)
    assert np.array_equal(steps >= 0, labels == labels.flat[source])
    for row, col in np.argwhere(steps > 0).tolist():
        near = steps[row - 1 : row + 2, col - 1 : col + 2]
        assert near[near >= 0].min() < steps[row, col]
    row, col = divmod(source, free.shape[1])
    away = np.hypot(*(np.argwhere(steps >= 0) - (row, col)).T)
    assert (steps[steps >= 0] >= away / 2**0.5 - 1e-9).all()


def test_pairs_of_corners_are_not_needed():
    """A square ring has four corners and no fan: each node has two neighbours."""
    cells = hall(80, 80)
    cells[21:61, 21:61] = 1.0
    graph = checked(floor(cells))
    assert (np.bincount(graph.edges[:, 0]) == 2).all()
    corners = graph.points[[kind == "bend" for kind in graph.kinds]]
    hull = shapely.convex_hull(shapely.multipoints(graph.points))
    assert shapely.area(hull) == pytest.approx(
        shapely.area(shapely.oriented_envelope(hull)), rel=0.05
    )
    assert len(corners) >= 4
