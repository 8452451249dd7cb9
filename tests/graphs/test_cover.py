"""Each room and door that the robot passes has a lane, or a line that says why not."""

import numpy as np
import pytest
from PIL import Image

import hybridnav as hn
from hybridnav.graphs import build_lane_graph
from hybridnav.graphs.attach import Network
from hybridnav.graphs.cover import left_out
from hybridnav.graphs.free_space import FreeSpace

SIDE_M = 0.05


def narrow():
    """A corridor, two rooms of 0.9 m and 3 m behind doors of 0.9 m, and one seen through glass."""
    cells = np.ones((160, 240), dtype=np.float32)
    cells[90:134, 4:236] = 0.0
    cells[4:86, 60:78] = cells[86:90, 60:78] = 0.0
    cells[14:86, 120:180] = cells[86:90, 140:158] = 0.0
    cells[30:90, 200:232] = 0.0
    labels = np.full(cells.shape, -1)
    labels[90:134], labels[:90, 60:78], labels[:90, 120:180], labels[:90, 200:232] = 0, 1, 2, 3
    labels[cells > 0] = -1
    return cells, hn.RoomLabels(("room-1", "room-2", "room-3", "room-4"), labels)


def grown(cells, rooms, radius_m=0.2, side_m=SIDE_M):
    grid = hn.OccupancyGrid(cells, hn.Frame(side_m), robot_radius_m=radius_m)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))


def test_a_room_that_the_robot_just_fits_into_has_a_lane_and_one_behind_glass_a_line():
    cells, rooms = narrow()
    cells[88:90, 200:232] = 1.0
    topology = grown(cells, rooms)
    graph = build_lane_graph(topology)
    doors = {door.number for door in topology.rooms.listed_doors}
    assert set(graph.doors.tolist()) - {0} == doors
    assert {number for passed in graph.edge_doors for number in passed} == doors
    assert {"room-1", "room-2", "room-3"} <= set(graph.rooms)
    reached = {graph.rooms[n] for n in graph.edges.ravel()}
    lines = left_out(topology, graph)
    assert ("room-4" in reached) != any(
        line.startswith("room-4: no way leads there") for line in lines
    )
    assert set(graph.edges.ravel().tolist()) == set(range(graph.n_nodes))


def test_two_doors_between_two_rooms_have_both_a_lane():
    cells = np.ones((120, 120), dtype=np.float32)
    cells[4:58, 4:116] = cells[62:116, 4:116] = 0.0
    cells[58:62, 20:38] = cells[58:62, 44:62] = 0.0
    labels = np.where(
        cells > 0, -1, (np.arange(120) >= 60)[:, None] * np.ones((120, 120), dtype=int)
    )
    topology = grown(cells, hn.RoomLabels(("south", "north"), labels))
    graph = build_lane_graph(topology)
    assert len(topology.rooms.listed_doors) == 2
    assert set(graph.doors.tolist()) - {0} == {1, 2}
    assert {number for passed in graph.edge_doors for number in passed} == {1, 2}


def test_nothing_lies_in_rooms_that_lists_leave_out():
    cells, _ = narrow()
    cells[88:90, 200:232] = 1.0
    cells[30:88, 200:218] = 1.0  # a ray of 0.7 m is left
    labels = np.full(cells.shape, -1)
    labels[90:134], labels[:90, 60:78], labels[:90, 120:180], labels[:90, 218:232] = 0, 1, 2, 3
    labels[cells > 0] = -1
    topology = grown(cells, hn.RoomLabels(("room-1", "room-2", "room-3", "room-4"), labels))
    assert topology.rooms.is_listed.tolist() == [True, True, True, False]
    assert "room-4" not in build_lane_graph(topology).rooms
    report = hn.graphs.build_lane_graph(topology)
    assert "room-4" not in report.rooms


def test_a_closed_room_has_a_lane_of_its_own():
    cells = np.ones((120, 120), dtype=np.float32)
    cells[4:44, 4:116] = cells[50:116, 4:56] = cells[50:116, 60:84] = 0.0
    labels = np.full(cells.shape, -1)
    labels[:47], labels[47:, :58], labels[47:, 58:] = 0, 1, 2
    labels[cells > 0] = -1
    topology = grown(cells, hn.RoomLabels(("hall", "store", "shaft"), labels))
    graph = build_lane_graph(topology)
    assert {graph.rooms[node] for node in graph.edges.ravel()} == {"hall", "store", "shaft"}
    lines = left_out(topology, graph)
    assert [line.partition(":")[0] for line in lines] == ["store", "shaft"]
    assert all(": lanes of its own, for no way leads there" in line for line in lines)


def row_of_doors(seed):
    """Two halls full of posts, and a row of doors of 0.3 to 0.5 m in the wall between them."""
    rng = np.random.default_rng(seed)
    cells = np.ones((60, 60), dtype=np.float32)
    cells[2:58, 2:58] = 0.0
    for row, col in rng.integers(8, 52, (25, 2)):
        cells[row : row + 2, col : col + 2] = 1.0
    cells[29:31], first = 1.0, 3
    while first < 56:
        width = int(rng.integers(3, 6))
        cells[29:31, first : first + width] = 0.0
        first += width + int(rng.integers(1, 4))
    return cells, np.where(cells > 0, -1, np.arange(60)[:, None] // 30)


@pytest.mark.parametrize("seed", [7, 11, 55])
@pytest.mark.parametrize("turns", [0, 1])
def test_each_of_a_row_of_doors_has_its_lane(seed, turns):
    cells, labels = (np.ascontiguousarray(np.rot90(each, turns)) for each in row_of_doors(seed))
    rooms = hn.RoomLabels(("south", "north"), labels)
    topology = grown(cells, rooms, radius_m=0.1, side_m=0.1)
    graph = build_lane_graph(topology)
    doors = {door.number for door in topology.rooms.listed_doors if door.passable}
    assert len(doors) >= 6
    assert set(graph.doors.tolist()) - {0} == doors
    assert {number for passed in graph.edge_doors for number in passed} == doors


def strips():
    """A hall; a strip of 0.7 m with a neck of 0.3 m, and another one that joins its far part."""
    cells = np.ones((260, 100), dtype=np.float32)
    cells[4:44, 4:96] = 0.0
    cells[44:248, 40:54] = cells[234:248, 40:96] = cells[60:248, 80:94] = 0.0
    cells[120:124, 40:48] = 1.0
    labels = np.digitize(np.arange(260), (44, 220))[:, None] * np.ones((1, 100), dtype=int)
    labels[46:, 60:] = 2
    labels[cells > 0] = -1
    return cells, hn.RoomLabels(("room-1", "room-2", "room-3"), np.asarray(labels, dtype=np.int32))


def test_a_room_without_a_way_in_has_no_node_in_the_part_of_another_room_beside_it():
    topology = grown(*strips())
    assert topology.rooms.is_listed.tolist() == [True, True, False]
    graph = build_lane_graph(topology)
    assert set(graph.rooms) == {"room-1", "room-2"}
    assert max(graph.positions[:, 0]) < 120
    (line,) = left_out(topology, graph)
    assert line.startswith("free space at")
    # Who names the strip wants to see it, and what it leads to.
    cells, rooms = strips()
    topology = grown(cells, hn.RoomLabels(("room-1", "room-2", "strip"), rooms.label_of))
    assert topology.rooms.is_listed.all()
    assert set(build_lane_graph(topology).rooms) == {"room-1", "room-2", "strip"}


MAPS = (
    "bwi_gdc/3ne/3ne.yaml",
    "giraff_homes/UMA_236.yaml",
    "aws_small_warehouse/002/map.yaml",
    "willow/willow-2010-02-18-0.10.yaml",
    pytest.param("strands/tsc_y4/tsc_1701.yaml", marks=pytest.mark.full),
    pytest.param("radish_grids/infinite-corridor.yaml", marks=pytest.mark.full),
)


@pytest.mark.parametrize("name", MAPS)
def test_rooms_doors_and_free_points_of_real_maps(data, name):
    grid = hn.load_map(data / name, robot_radius_m=0.25)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid)))
    graph = build_lane_graph(topology)
    rooms, space = topology.rooms, FreeSpace.of(grid)
    lines = [line for line in left_out(topology, graph) if "of its own" not in line]
    told = {line.partition(":")[0] for line in lines}
    listed = np.array(rooms.names)[rooms.is_listed & rooms.fits].tolist()
    assert set(listed) <= set(graph.rooms) | told
    assert "room" not in {name.partition("-")[0] for name in told}
    visited = rooms.labels.label_of[tuple(np.floor(graph.positions).astype(int).T)]
    assert np.append(rooms.is_listed, True)[visited].all()
    passed = {number for doors in graph.edge_doors for number in doors} & set(graph.doors.tolist())
    listed = {door.number for door in rooms.listed_doors if door.passable}
    assert {f"door {n}" for n in listed - passed} <= told
    free = np.argwhere(space.free & space.kept(rooms)[space.component_of])
    at = free[np.random.default_rng(0).integers(len(free), size=2000)]
    network = Network.of(space.sight, graph.positions, graph.edges)
    offsets, _, _ = network.in_sight(np.asarray(at + 0.5, dtype=np.float64))
    assert (offsets[1:] > offsets[:-1]).mean() >= 0.97


def test_what_export_prints_is_what_the_file_holds(cli, tmp_path):
    cells, _ = narrow()
    Image.fromarray(np.uint8(254 * (cells[::-1] == 0))).save(tmp_path / "map.pgm")
    zone = np.full(cells.shape, 255, dtype=np.uint8)
    zone[:, 160:200] = 0
    Image.fromarray(zone).save(tmp_path / "zone.pgm")
    text = "image: {}.pgm\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\n"
    text += "occupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n"
    for name in ("map", "zone"):
        (tmp_path / f"{name}.yaml").write_text(text.format(name))
    given = ("--robot-radius", 0.2, "--bundle", tmp_path / "robot", "--json")
    picture = tmp_path / "graph.svg"
    costs = ("--costs", f"keepout:{tmp_path / 'zone.yaml'}", "--plot", picture)
    printed = cli("export", tmp_path / "map.yaml", *given, *costs).answer
    file = hn.ext.fleet.load_graph(tmp_path / "robot" / "graph.geojson")
    assert (printed["nodes"], printed["edges"]) == (file.n_nodes, file.n_edges)
    assert np.unique(file.edges).tolist() == list(range(file.n_nodes))
    assert any("keepout" in line for line in printed["left_out"])
    assert "keepout" in picture.read_text()
