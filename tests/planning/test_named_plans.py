"""Plans between rooms with names, tours with waypoints, the route in words, and their command
lines."""

import itertools
import math
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely
from PIL import Image

import hybridnav as hn
from hybridnav.guide.words.itinerary import Guide
from hybridnav.maps import RoomLabels
from hybridnav.planning import Path, load_preset
from hybridnav.planning.named import points_of_waypoints
from hybridnav.viz import plot_rooms, plot_tour
from tests.strategies import drawn, occupancy_grid

# Kitchen and lab over a hall, a store that cannot be reached; cells of half a metre.
CLASSES = drawn(
    "###################",
    "#.....#.....#.....#",
    "#.....#.....#.....#",
    "#.....#.....#.....#",
    "#.....#.....#.....#",
    "###.#####.#########",
    "#.................#",
    "#.................#",
    "#.................#",
    "###################",
)
SIDE = 0.5
NAMES = ("kitchen", "lab", "store", "hall")


def stops_of(planner, waypoints):
    return points_of_waypoints(planner.topology, planner.preset.planner, waypoints)


def labels():
    label_of = np.full(CLASSES.shape, -1, dtype=np.int32)
    label_of[5:9, 1:6], label_of[5:9, 7:12], label_of[5:9, 13:18] = 0, 1, 2
    label_of[1:4, 1:18] = 3
    label_of[4, 3], label_of[4, 9] = 0, 1
    return RoomLabels(NAMES, label_of, {"sink": (0.75, 4.25), "lab": (5.75, 4.25)})


@pytest.fixture(scope="module", params=["shortest", "octile", "grid-astar"])
def planner(request):
    grid = occupancy_grid(CLASSES, resolution_m=SIDE)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=2.0, rooms=labels())
    return hn.HybridPlanner(hn.TopologicalMap(pyramid), preset=request.param)


def test_anywhere_in_a_room_means_its_nearest_cells(planner):
    result = planner.plan("kitchen", "lab")
    # From the kitchen's doorway down into the hall, six columns on, and up into the lab's.
    assert result.solved
    assert [tuple(c) for c in result.path.cells[[0, -1]].tolist()] == [(4, 3), (4, 9)]
    if result.metric == "any-angle":  # round the corners of the two doorways
        assert result.cost == pytest.approx(SIDE * (5 + 2 * math.hypot(0.5, 0.5)))
    else:
        assert result.cost == pytest.approx(SIDE * 8)


def test_the_point_of_a_room_is_used_when_asked_for(planner):
    result = planner.plan("kitchen", "lab", at="point")
    assert tuple(result.path.cells[-1].tolist()) == (8, 11)
    to_point = planner.plan("kitchen", (5.75, 4.25))
    assert to_point.cost <= result.cost
    assert planner.plan("sink", "kitchen").cost == 0.0


def test_a_room_that_cannot_be_reached_is_an_outcome(planner):
    assert planner.plan("kitchen", "store").status is hn.PlanStatus.NO_PATH
    assert hn.plan_tour(planner, ["kitchen", "store", "lab"]).status is hn.PlanStatus.NO_PATH


def test_bad_points_beside_names_keep_their_status(planner):
    assert planner.plan("kitchen", (99.0, 0.0)).status is hn.PlanStatus.GOAL_OUTSIDE
    assert planner.plan((0.1, 0.1), "lab").status is hn.PlanStatus.START_OCCUPIED
    with pytest.raises(hn.errors.InvalidValueError, match="two finite coordinates"):
        planner.plan("kitchen", (1.0, float("nan")))


def test_names_and_words_that_are_wrong_are_explained(planner):
    with pytest.raises(hn.errors.InvalidValueError, match="'kichen': did you mean kitchen"):
        planner.plan("kichen", "lab")
    with pytest.raises(hn.errors.InvalidValueError, match="did you mean sink"):
        planner.plan("lab", "sinc")
    for ends in (("lab", "sink"), ((0.75, 0.75), (1.25, 0.75))):
        with pytest.raises(hn.errors.InvalidValueError, match="at must be 'anywhere' or 'point'"):
            planner.plan(*ends, at="once")
    with pytest.raises(hn.errors.InvalidValueError, match="at least two"):
        hn.plan_tour(planner, ["lab"])


def test_what_is_blocked_is_not_chosen_for_a_stop(planner):
    free = planner.plan("kitchen", "lab")
    closed = planner.plan("kitchen", "lab", blocked={"cells": [(4, 3)]})
    assert free.solved
    assert not closed.solved


def test_a_map_without_rooms_says_so():
    plain = hn.TopologicalMap(hn.DualGraphPyramid.build(occupancy_grid(CLASSES)))
    with pytest.raises(hn.errors.InvalidValueError, match="no rooms"):
        hn.HybridPlanner(plain).plan("kitchen", "lab")


def test_a_tour_is_told_by_rooms_and_doors(planner):
    tour = hn.plan_tour(planner, ["sink", "lab", "hall"])
    assert tour.solved
    assert [leg.room for leg in tour.legs] == ["kitchen", "hall", "lab", "lab", "hall"]
    assert tour.length_m == pytest.approx(sum(leg.length_m for leg in tour.legs))
    doors = [leg.door for leg in tour.legs if leg.door is not None]
    assert [door.rooms for door in doors] == [("hall", "kitchen"), ("hall", "lab"), ("hall", "lab")]
    words = tour.words()
    assert words[0] == "start in the kitchen"
    assert words[1] == "leave the kitchen by door 1 into the hall"
    assert words[2] == "go through door 2 into the lab, and you are there"  # there is no other
    assert words[-1].endswith("on the right (door 2) into the hall, and you are there")


def test_a_path_that_only_touches_a_room_is_not_told_of_it(planner):
    cells = np.array(
        [[6, 3], [5, 3], [4, 3], [3, 3], [4, 3], [5, 3], [4, 3], [3, 3], [3, 4], [3, 5]]
    )
    points = planner.grid.frame.points_of(cells)
    legs = Guide(planner.topology.rooms).legs(Path(cells, points, 9 * SIDE))
    assert [leg.room for leg in legs] == ["kitchen", "hall"]
    assert sum(leg.length_m for leg in legs) == pytest.approx(9 * SIDE)


def test_legs_of_an_any_angle_path_share_its_length(planner):
    tour = hn.plan_tour(planner, ["sink", "lab"], at="point", smooth="line-of-sight")
    assert tour.results[0].metric == "any-angle"
    assert sum(leg.length_m for leg in tour.legs) == pytest.approx(tour.length_m)


@pytest.fixture
def driving():
    """Makes planners with OMPL on the same map; skipped where it is not installed."""
    pytest.importorskip("ompl")
    grid = occupancy_grid(CLASSES, resolution_m=SIDE)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=2.0, rooms=labels())

    def make(*settings):
        preset = load_preset("ompl", overrides=[f"planner.ompl.{setting}" for setting in settings])
        return hn.HybridPlanner(hn.TopologicalMap(pyramid), preset=preset)

    return make


def test_stops_have_headings_where_the_robot_has(driving):
    waypoints: list[Any] = ["hall", "sink", (8.25, 0.75, 0.5), "lab"]
    tour = hn.plan_tour(driving("space=se2"), waypoints)
    assert tour.solved
    yaws = [np.asarray(result.path.headings_rad) for result in tour.results if result.path]
    # From the hall's cell below the doorway up to the sink.
    assert yaws[0][0] == pytest.approx(math.pi / 2)
    assert math.sin(yaws[0][-1]) > 0.7
    assert yaws[1][-1] == yaws[2][0] == pytest.approx(0.5)
    assert yaws[2][-1] == pytest.approx(math.pi / 2, abs=0.8)
    assert [own[-1] for own in yaws[:-1]] == pytest.approx([own[0] for own in yaws[1:]])
    assert any("(8.25, 0.75)" in line for line in tour.words())


def test_a_named_stop_faces_the_way_on_a_turned_map():
    pytest.importorskip("ompl")
    classes = drawn("#######", "#.....#", "#######")
    frame = hn.Frame(1.0, (3.0, -2.0), 0.7)
    grid = hn.OccupancyGrid((classes == 0).astype(np.float32), frame, robot_radius_m=0)
    points = {name: tuple(frame.points_of((1, col))) for name, col in (("west", 1), ("east", 5))}
    rooms = RoomLabels(("hall",), np.zeros(classes.shape, dtype=np.int32), points)
    planner = hn.HybridPlanner(
        hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms)),
        preset=load_preset("ompl", overrides=["planner.ompl.space=se2"]),
    )
    east, west, again = map(np.asarray, stops_of(planner, ["east", "west", "west"]))
    assert [east[2], west[2]] == pytest.approx([0.7 - math.pi] * 2)
    assert again[2] == 0.0  # no way leads from a point to itself
    east = np.asarray(stops_of(planner, [(*points["west"], 3.0), "east"])[1])
    assert east[2] == pytest.approx(0.7)


@pytest.mark.parametrize("half_m", [0.2, 0.45, 0.6, 0.9])
def test_a_footprint_fits_at_the_stops_chosen_for_it(driving, half_m):
    """The nearest cells of the rooms are in doorways half a metre wide, where it does not; 0.9 is
    too long to turn in any room."""
    corners = [[half_m, 0.15], [-half_m, 0.15], [-half_m, -0.15], [half_m, -0.15]]
    planner = driving("space=se2", f"footprint={corners}", "budget_s=0.5")
    rooms, points_of = planner.topology.rooms, planner.grid.frame.points_of
    low = np.argwhere(CLASSES == 0)[:, ::-1] * SIDE
    walls = shapely.union_all(shapely.box(*low.T, *(low + SIDE).T))
    for start, goal in (("kitchen", "hall"), ("hall", "lab")):
        clear = []
        for name, pose in zip((start, goal), stops_of(planner, [start, goal]), strict=True):
            cells = np.argwhere((CLASSES == 1) & (rooms.labels.label_of == NAMES.index(name)))
            room = shapely.points(points_of(cells))
            fits = room[shapely.distance(room, walls) >= math.hypot(half_m, 0.15)]
            at = shapely.Point(np.asarray(pose)[:2])
            clear.append(len(fits) > 0)
            assert at in (fits if clear[-1] else [shapely.Point(rooms.point_of(name))])
        assert all(clear) == (half_m < 0.9)
        if all(clear):
            assert "occupied" not in str(planner.plan(start, goal).status)
    planner.close()


def test_points_without_the_heading_that_is_needed_are_explained(driving):
    with pytest.raises(hn.errors.InvalidValueError, match="x, y, yaw"):
        hn.plan_tour(driving("space=se2"), ["kitchen", (8.25, 0.75)])


def test_all_levels_agree_on_which_rooms_a_route_joins(planner):
    rooms = planner.topology.rooms
    arcs = rooms.level.arcs
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(np.flatnonzero(rooms.is_free).tolist())
    graph.add_edges_from(arcs[rooms.is_free[arcs].all(axis=1)].tolist())
    for a, b in itertools.permutations(NAMES, 2):
        ends = itertools.product(rooms.vertices_of(a).tolist(), rooms.vertices_of(b).tolist())
        is_joined = any(nx.has_path(graph, first, last) for first, last in ends)
        assert is_joined == planner.plan(a, b).solved == ("store" not in {a, b})


def by_gid(ax, gid):
    return [artist for artist in ax.get_children() if artist.get_gid() == gid]


def test_the_picture_of_a_named_plan_shows_its_paths_stops_rooms_and_scale(planner):
    tour = hn.plan_tour(planner, ["sink", "lab", "hall"], at="point")
    ax = plot_tour(planner.topology, tour)
    paths = by_gid(ax, "path")
    assert len(paths) == 2
    for line, result in zip(paths, tour.results, strict=True):
        assert np.allclose(np.column_stack(line.get_data()), result.path.points)
    endpoints = [np.column_stack(waypoint.get_data()) for waypoint in by_gid(ax, "waypoints")]
    assert np.allclose(endpoints[0], [[0.75, 4.25], [5.75, 4.25]])
    written = [by_gid(ax, f"room-{label}")[0] for label in range(len(NAMES))]
    assert [text.get_text() for text in written] == list(NAMES)
    for label, text in enumerate(written):
        cell = planner.grid.frame.cell_of(*text.get_position())
        assert labels().label_of[cell] == label
    (doors,) = by_gid(ax, "doors")
    drawn_at = np.column_stack(doors.get_data())
    assert np.allclose(drawn_at, [door.position for door in planner.topology.rooms.doors])
    (bar,), (length,) = by_gid(ax, "scale-bar"), by_gid(ax, "scale-bar-label")
    assert length.get_text() == f"{np.ptp(bar.get_xdata()):g} m"
    assert f"{tour.length_m:.1f} m" in ax.get_title()


def test_a_tour_without_a_path_is_drawn_as_rooms_with_the_reason(planner):
    ax = plot_tour(planner.topology, hn.plan_tour(planner, ["kitchen", "store"]))
    assert not by_gid(ax, "path")
    assert "no path" in ax.get_title()


def test_labels_are_drawn_with_their_own_map_only():
    grid = occupancy_grid(CLASSES, resolution_m=SIDE)
    ax = plot_rooms(labels(), grid)
    assert ax.get_xlabel() == "x in metres"
    with pytest.raises(hn.errors.InvalidValueError, match="give the grid"):
        plot_rooms(labels())
    with pytest.raises(hn.errors.InvalidValueError, match=r"\(10, 19\).*\(3, 3\)"):
        plot_rooms(labels(), occupancy_grid(np.ones((3, 3), dtype=np.uint8)))


@pytest.fixture
def map_file(tmp_path):
    """The map as a ROS map with its rooms beside it."""
    pixels = np.where(CLASSES[::-1] == 0, 0, 254).astype(np.uint8)
    Image.fromarray(pixels).save(tmp_path / "house.pgm")
    path = tmp_path / "house.yaml"
    path.write_text(
        f"image: house.pgm\nresolution: {SIDE}\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    hn.save_rooms(tmp_path / "rooms.yaml", labels(), hn.load_map(path, robot_radius_m=0))
    return path


def test_plan_takes_names_from_the_file_beside_the_map(cli, map_file):
    done = cli("plan", map_file, "--from", "kitchen", "--to", "lab", "--robot-radius", "0")
    assert done.code == 0
    assert "house, kitchen to lab" in done.out
    assert "words      start in the kitchen" in done.out
    assert "and you are there" in done.out
    assert done.err == ""


def test_plan_with_stops_as_json_and_as_a_picture(cli, map_file, tmp_path):
    done = cli(
        *("plan", map_file, "--from", "sink", "--via", "lab", "--to", "1.25,1.25", "--json"),
        *("--at", "point", "--robot-radius", "0", "--plot", tmp_path / "tour.svg"),
    )
    assert done.answer["status"] == "solved"
    assert done.answer["waypoints"] == ["sink", "lab", [1.25, 1.25]]
    points = done.answer["points"]
    assert (points[0], points[-1]) == (done.answer["start"], done.answer["goal"])
    assert len(points) == len(done.answer["headings_rad"])
    assert "you are at (1.25, 1.25) in the hall" in done.answer["words"][-1]
    assert sum(leg["length_m"] for leg in done.answer["legs"]) == pytest.approx(
        done.answer["length_m"]
    )
    assert (tmp_path / "tour.svg").read_text().count('id="path"') == 2


def test_every_length_and_cost_names_its_metric(cli, map_file):
    query = ("plan", map_file, "--from", "sink", "--to", "lab", "--robot-radius", "0")
    done = cli(*query, "--alternatives", "2")
    lines = [line for line in done.out.splitlines() if line.startswith(("length", "route "))]
    assert len(lines) > 1
    assert " m (any-angle)" in lines[0]
    assert all(" m (any-angle)" in line for line in lines[1:])
    cells = cli(*query, "--alternatives", "2", "--preset", "octile")
    assert "\nroute 1    " in cells.out
    assert " m (octile), by " in cells.out
    answer = cli(*query, "--alternatives", "2", "--json").answer
    assert [len(route["points"]) > 1 for route in answer["alternatives"]] == [True] * (
        len(lines) - 1
    )
    assert answer["alternatives_complete"] is True
    assert cli(*query, "--alternatives", "0").code == 2
    assert cli(*query, "--alternatives", "2", "--via", "hall").refuses(2, "--via")
    done = cli(*query, "--at", "point", "--preset", "robot")
    told = dict(line.split(maxsplit=1) for line in done.out.splitlines())
    assert told["length"].endswith(" m")
    assert told["cost"].endswith(" (any-angle-weighted)")
    assert float(told["cost"].split()[0]) > float(told["length"].split()[0])
    assert "(any-angle-weighted)" in told["bound"]


def test_plan_takes_stops_with_headings(cli, map_file):
    pytest.importorskip("ompl")
    done = cli(
        *("plan", map_file, "--from", "kitchen", "--to", "8.25,0.75,1.5", "--robot-radius", "0"),
        *("--preset", "ompl", "--set", "planner.ompl.space=se2", "--json"),
    )
    assert done.answer["status"] == "solved"
    assert done.answer["waypoints"] == ["kitchen", [8.25, 0.75, 1.5]]


def test_plan_to_a_room_out_of_reach_exits_with_1(cli, map_file):
    done = cli("plan", map_file, "--from", "kitchen", "--to", "store", "--robot-radius", "0")
    assert done.code == 1
    assert "status     no path" in done.out


def test_plan_without_a_file_finds_rooms_and_says_so(cli, map_file):
    (map_file.parent / "rooms.yaml").unlink()
    query = ("plan", map_file, "--from", "room-1", "--to", "room-1", "--robot-radius", "0")
    done = cli(*query, "--set", "pyramid.merge_distance_m=2")
    assert done.code == 0
    assert "no rooms.yaml" in done.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--from", "kitchn", "--to", "lab"], ["'kitchn'", "did you mean kitchen"]),
        (["--from", "kitchen"], ["missing option '--goal' or '--to'"]),
        (["--from", "kitchen", "--start", "1,1", "--to", "lab"], ["only one", "'--from'"]),
        (["--from", "kitchen", "--to", "lab", "--at", "noon"], ["--at", "'noon'"]),
        (["--from", "kitchen", "--to", "lab", "--compare"], ["--compare"]),
        (["--from", "kitchen", "--to", "nan,1"], ["finite"]),
    ],
)
def test_wrong_names_and_options_end_in_one_line(cli, map_file, arguments, words):
    assert cli("plan", map_file, "--robot-radius", "0", *arguments).refuses(2, *words)


def test_a_bad_file_of_rooms_is_unreadable_input(cli, map_file):
    (map_file.parent / "rooms.yaml").write_text("rooms: 7\n")
    query = ("plan", map_file, "--from", "kitchen", "--to", "lab")
    assert cli(*query).refuses(3, "rooms.yaml", "expected a list")


def test_rooms_writes_a_file_once_and_draws(cli, map_file, tmp_path):
    out, picture = tmp_path / "found.yaml", tmp_path / "found.svg"
    query = ("rooms", map_file, "--find", "-o", out, "--robot-radius", "0", "--plot", picture)
    done = cli(*query)
    assert done.code == 0
    assert "room-1" in done.out
    assert hn.load_rooms(out, hn.load_map(map_file, robot_radius_m=0)).names[0] == "room-1"
    assert 'id="room-0"' in picture.read_text()
    assert cli(*query).refuses(2, "found.yaml exists", "--force")
    assert cli(*query, "--force").code == 0


@pytest.mark.parametrize("name", ["rooms.docx", "rooms.geojson", "rooms"])
def test_rooms_are_written_to_files_of_yaml_only(cli, map_file, tmp_path, name):
    done = cli("rooms", map_file, "-o", tmp_path / name)
    assert done.refuses(2, "--out must end in .yaml, .yml", name)
    assert not (tmp_path / name).exists()


def test_rooms_lists_those_of_a_file(cli, map_file):
    done = cli("rooms", map_file, "--rooms", map_file.parent / "rooms.yaml", "--robot-radius", "0")
    assert "kitchen" in done.out
    assert "hall (1: 0.50 m)" in done.out


@pytest.mark.parametrize("option", [("--find",), ("--least-area", "1")])
def test_rooms_of_a_file_are_not_found_too(cli, map_file, option):
    query = ("rooms", map_file, "--rooms", map_file.parent / "rooms.yaml", *option)
    assert cli(*query).refuses(2, option[0], "--rooms")


def test_rooms_refuses_an_endless_least_area(cli, map_file):
    assert cli("rooms", map_file, "--least-area", "inf").refuses(2, "least area", "inf")
