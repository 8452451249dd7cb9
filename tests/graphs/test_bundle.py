"""Bundles for Nav2, read by Nav2's rules: `tests.nav2_robot`."""

import math
from pathlib import Path

import numpy as np
import pytest
import yaml
from PIL import Image

import hybridnav as hn
from hybridnav.graphs import build_lane_graph, export_bundle
from tests.drawn_rooms import HOUSE, topology_of
from tests.nav2_reader import read_nav2
from tests.nav2_robot import Mask, ZoneFilter, called, is_lethal, read_bundle, score, speed_limit


def bundle_of(here, folder, **options):
    graph = build_lane_graph(here, spacing_m=1.0)
    return graph, export_bundle(here, graph, folder, **options)


def mask_file(folder, name, values, side, mode="raw"):
    """A mask of values, row 0 lowest, over the map's origin."""
    rows, cols = np.shape(values)
    head = f"P5 {cols} {rows} 255\n".encode()
    pixels = np.asarray(values, np.uint8)[::-1].tobytes()
    (folder / f"{name}.pgm").write_bytes(head + pixels)
    path = folder / f"{name}.yaml"
    path.write_text(
        f"{{image: {name}.pgm, resolution: {side}, origin: [0, 0, 0], negate: 0, mode: {mode}, "
        "free_thresh: 0.196, occupied_thresh: 0.65}"
    )
    return path


@pytest.mark.parametrize("yaw_rad", [0.0, 0.7, -2.0])
def test_the_state_of_the_zone_filter_is_the_room(tmp_path, yaw_rad):
    here = topology_of(HOUSE, origin_m=(-3.0, 12.5), yaw_rad=yaw_rad)
    _, left_out = bundle_of(here, tmp_path / "robot")
    assert left_out == ()
    parameters, _, _ = read_bundle(tmp_path / "robot")
    costmap = parameters["global_costmap"]["global_costmap"]["ros__parameters"]
    server = parameters["rooms_mask_server"]["ros__parameters"]
    mask = Mask.load(Path(server["yaml_filename"]))
    zones = ZoneFilter(costmap["rooms_filter"], mask)
    names = yaml.safe_load((tmp_path / "robot" / "room_names.yaml").read_text())["rooms"]
    assert sorted(names) == sorted(zones.names)
    assert sorted(names.values()) == sorted(here.rooms.names)
    # At the middles of its cells a mask can be exact; the map's own are the same without yaw.
    for row, col in np.argwhere(mask.data >= 0)[::3].tolist():
        x, y = (
            (k + 0.5) * mask.resolution + o for k, o in zip((col, row), mask.origin, strict=True)
        )
        assert names.get(zones.process(x, y)) == here.rooms.at((x, y))
    assert zones.process(-1e3, 0) == 0


def test_more_rooms_than_the_mode_raw_holds_lose_the_smallest(tmp_path):
    columns = np.minimum(np.arange(29) // 3, 9)  # the last one is narrower
    label_of = columns + 10 * (np.arange(33) // 3)[:, None]
    rooms = hn.RoomLabels(tuple(f"n{k}" for k in range(110)), label_of.astype(np.int32))
    grid = hn.OccupancyGrid(np.zeros((33, 29), np.float32), robot_radius_m=0)
    here = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    _, left_out = bundle_of(here, tmp_path / "robot")
    assert left_out == tuple(f"room n{k}: masks hold 100 rooms" for k in range(19, 110, 10))
    mask = Mask.load(tmp_path / "robot" / "rooms_mask.yaml")
    assert sorted(np.unique(mask.data).tolist()) == list(range(101))
    text = (tmp_path / "robot" / "room_names.yaml").read_text()
    names = yaml.safe_load(text)["rooms"]
    for k in range(110):
        number = mask.data[3 * (k // 10), 3 * (k % 10)]
        assert names.get(number) == (
            None if f"room n{k}: masks hold 100 rooms" in left_out else f"n{k}"
        )
    assert "# left out: room n19" in text


def test_scorers_read_limits_penalties_and_classes(tmp_path):
    here = topology_of(HOUSE, robot_radius_m=0.3)
    rng = np.random.default_rng(3)
    values = rng.choice([0, 0, 50, 75, 20], (7, 23))
    slow = mask_file(tmp_path, "slow", values, 1.0)
    graph, _ = bundle_of(here, tmp_path / "robot", costs=[f"speed:{slow}"])
    read_nav2(tmp_path / "robot" / "graph.geojson")
    parameters, edges, nodes = read_bundle(tmp_path / "robot")
    server = parameters["route_server"]["ros__parameters"]
    info = parameters["speed_filter_info_server"]["ros__parameters"]
    mask = Mask.load(tmp_path / "robot" / "speed_mask.yaml")
    assert len(edges) == graph.n_edges
    for edge in edges:
        facts, (tail, head) = edge["metadata"], (nodes[edge[end]] for end in ("startid", "endid"))
        along = np.linspace(tail[0], head[0], 200)
        seen = {speed_limit(mask, info, *point) or 100.0 for point in along.tolist()}
        near = {
            speed_limit(mask, info, *(point + off)) or 100.0
            for point in along
            for off in ([0.51, 0], [-0.51, 0], [0, 0.51], [0, -0.51])
        }
        assert facts["speed_limit"] in seen | near  # cells that it touches count
        assert facts["speed_limit"] <= min(seen)
        assert facts["speed_limit"] >= min(seen | near)
        length = math.dist(tail[0], head[0])
        assert 0 <= facts.get("penalty", 0) <= length + 1e-3
        if facts["clearance_m"] >= 0.551:
            assert "penalty" not in facts
        elif facts["clearance_m"] <= 0.54:
            assert facts["penalty"] > 0
        cost = length * 100 / facts["speed_limit"] + facts.get("penalty", 0.0)
        assert score(server, facts, tail, head) == pytest.approx(cost)
    assert {edge["metadata"]["speed_limit"] for edge in edges} == {25.0, 50.0, 80.0, 100.0}


def test_a_door_costs_its_class_once_a_passage(tmp_path):
    here = topology_of(HOUSE)
    graph = build_lane_graph(here, spacing_m=1.0)
    export_bundle(here, graph, tmp_path / "robot")
    parameters, edges, nodes = read_bundle(tmp_path / "robot")
    server = parameters["route_server"]["ros__parameters"]
    plain = [score(server, e["metadata"], nodes[e["startid"]], nodes[e["endid"]]) for e in edges]
    server["SemanticScorer"]["door"] = 7.0
    dear = [score(server, e["metadata"], nodes[e["startid"]], nodes[e["endid"]]) for e in edges]
    shut = {door.number for door in here.rooms.doors if not door.is_opening}
    assert shut
    for more, less, edge in zip(dear, plain, edges, strict=True):
        passes = bool(shut & set(edge["metadata"].get("doors", [])))
        assert more - less == pytest.approx(7.0 * passes)
    classes = {
        e["metadata"]["room"]: e["metadata"]["class"]
        for e in edges
        if not e["metadata"].get("doors")
    }
    kinds = {
        name: kind and kind.name
        for name, kind in zip(here.rooms.names, here.rooms.kinds, strict=True)
    }
    assert classes == {name: kinds[name] or "room" for name in classes}
    assert classes["corridor"] == "corridor"
    assert classes["kitchen"] == "room"


def test_without_a_mask_nothing_limits_and_a_metre_costs_one(tmp_path):
    here = topology_of(HOUSE)
    bundle_of(here, tmp_path / "robot")
    parameters, edges, nodes = read_bundle(tmp_path / "robot")
    server = parameters["route_server"]["ros__parameters"]
    server["edge_cost_functions"] = ["DistanceScorer"]
    for edge in edges:
        tail, head = nodes[edge["startid"]], nodes[edge["endid"]]
        assert score(server, edge["metadata"], tail, head) == pytest.approx(edge["cost"])
    assert list(parameters["global_costmap"]["global_costmap"]["ros__parameters"]["filters"]) == [
        "rooms_filter"
    ]


def test_limits_in_metres_a_second_are_those_of_the_time_scorer(tmp_path):
    here = topology_of(HOUSE)
    slow = mask_file(tmp_path, "slow", np.full((7, 23), 40), 1.0)
    costs = [f"speed:{slow},unit=m/s,base=0,multiplier=0.01,full_speed_mps=0.8"]
    bundle_of(here, tmp_path / "robot", costs=costs)
    parameters, edges, nodes = read_bundle(tmp_path / "robot")
    assert parameters["speed_filter_info_server"]["ros__parameters"]["type"] == 2
    timed = {"edge_cost_functions": ["T"], "T": {"plugin": "nav2_route::TimeScorer"}}
    for edge in edges:
        tail, head = nodes[edge["startid"]], nodes[edge["endid"]]
        assert edge["metadata"]["speed_limit"] == 50.0
        assert score(timed, edge["metadata"], tail, head) == pytest.approx(edge["cost"] / 0.4)


def test_edges_keep_out_of_zones_that_the_keepout_filter_closes(tmp_path):
    here = topology_of(HOUSE)
    zones = np.zeros((14, 46))
    zones[4:8, 20:24] = 100
    zones[0, 0] = 255  # unknown: it must not clear the costmap
    shut = mask_file(tmp_path, "shut", zones, 0.5)
    graph, left_out = bundle_of(here, tmp_path / "robot", costs=[f"keepout:{shut}"])
    parameters, edges, _ = read_bundle(tmp_path / "robot")
    mask = Mask.load(tmp_path / "robot" / "keepout_mask.yaml")
    assert np.array_equal(mask.data, np.where(zones > 100, -1, zones))
    n_gone = graph.n_edges - len(edges)
    assert left_out == (f"{n_gone} edges through keepout zones",)
    kept = {edge["id"] for edge in edges}
    for number, (tail, head) in zip(graph.ids[1].tolist(), graph.points[graph.edges], strict=True):
        meets = any(is_lethal(mask, *at) for at in np.linspace(tail, head, 300).tolist())
        assert number not in kept or not meets
    info = parameters["keepout_filter_info_server"]["ros__parameters"]
    assert (info["type"], info["base"], info["multiplier"]) == (0, 0.0, 1.0)
    whole = mask_file(tmp_path, "whole", np.full((14, 46), 100), 0.5)
    with pytest.raises(hn.errors.InvalidValueError, match="no edge"):
        bundle_of(here, tmp_path / "other", costs=[f"keepout:{whole}"])
    assert not (tmp_path / "other").exists()


def test_doors_are_opened_by_services_that_the_server_knows(tmp_path):
    here = topology_of(HOUSE)
    for operations in (False, True):
        bundle_of(here, tmp_path / "robot", operations=operations)
        parameters, edges, _ = read_bundle(tmp_path / "robot")
        server = parameters["route_server"]["ros__parameters"]
        for edge in edges:
            listed = edge.get("operations", [])
            shut = [
                number
                for number in edge["metadata"].get("doors", [])
                if not here.rooms.door(number).is_opening
            ]
            expected = [f"/door_{number}/open" for number in shut] if operations else []
            assert called(server, listed, "ON_ENTER") == expected
            assert called(server, listed, "ON_EXIT") == called(server, listed, "NODE") == []
    assert any("operations" in edge for edge in edges)


# Names that YAML, JSON or ROS would take for something else, and one that a room has, too.
LIFTS = {
    "\u5317 \U0001f6d7": "/lift_u5317_U0001f6d7/call",
    '"}, \\: [#\n- {{ ../..': "/lift/call",
    "1": "/lift_1/call",
    "kitchen": "/lift_kitchen/call",
    "x" * 300: f"/lift_{'x' * 195}/call",
}
SPOTS = ((3.3, 5.3), (15.8, 2.9), (20.26, 5.7), (2.6, 3.7), (6.0, 3.5))  # the fourth in a door


@pytest.mark.parametrize("is_one_way", [False, True])
def test_edges_that_end_at_a_lift_call_it_after_doors(tmp_path, is_one_way):
    here = topology_of(HOUSE, robot_radius_m=0.3)
    points = dict(zip(LIFTS, SPOTS, strict=True))
    graph = build_lane_graph(here, points=points | {"dock": (11.0, 5.3)})
    if is_one_way:
        graph = hn.graphs.keep_right(here, graph, apart_m=0.8)
    folder, counts = tmp_path / "robot", set()
    for operations in (False, True):
        export_bundle(here, graph, folder, operations=operations, lifts=iter(LIFTS))
        parameters, edges, nodes = read_bundle(folder)
        server = parameters["route_server"]["ros__parameters"]
        for edge in edges:
            name, doors = nodes[edge["endid"]][1].get("name"), edge["metadata"].get("doors", [])
            expected = [f"/door_{n}/open" for n in doors if not here.rooms.door(n).is_opening]
            expected += [LIFTS[name]] if name in LIFTS else []
            listed = edge.get("operations", [])
            assert called(server, listed, "ON_ENTER") == (expected if operations else [])
            asked = [each["metadata"]["lift"] for each in listed if each["type"] == "CallLift"]
            assert asked == ([name] if operations and name in LIFTS else [])
            counts.add((len(expected), bool(name in LIFTS)))
        assert ("CallLift" in (folder / "README.md").read_text()) == operations
        poses = yaml.safe_load((folder / "poses.yaml").read_text())
        for name, spot in points.items():
            at = poses[name]["position"]
            assert (at["x"], at["y"]) == pytest.approx(spot, abs=0.5 / 16)
    assert {(0, False), (1, False), (1, True), (2, True)} <= counts
    read_nav2(folder / "graph.geojson")
    export_bundle(here, graph, folder, operations=True)
    assert not any("CallLift" in path.read_text("latin-1") for path in folder.iterdir())


@pytest.mark.parametrize(
    ("lifts", "words"),
    [
        (["c"], "lift 'c' must be a named point"),
        ([None], "must be a named point"),
        (["a b", "a-b"], "'a-b' must be .* a service that no other lift has, got /lift_a_b/call"),
    ],
)
def test_lifts_that_are_none_or_called_alike_are_refused(tmp_path, lifts, words):
    here = topology_of(HOUSE)
    graph = build_lane_graph(here, points={"a b": (3.3, 5.3), "a-b": (15.8, 2.9)})
    with pytest.raises(hn.errors.InvalidValueError, match=words):
        export_bundle(here, graph, tmp_path / "robot", lifts=lifts)
    assert not (tmp_path / "robot").exists()


def test_servers_and_filters_of_masks_speak_of_the_same_topics(tmp_path):
    here = topology_of(HOUSE)
    masks = {
        name: mask_file(tmp_path, name, np.zeros((7, 23)), 1.0) for name in ("keepout", "speed")
    }
    costs = [f"{name}:{path}" for name, path in masks.items()]
    bundle_of(here, tmp_path / "robot", costs=costs, operations=True, frame="floor")
    parameters, _, _ = read_bundle(tmp_path / "robot")
    costmap = parameters["global_costmap"]["global_costmap"]["ros__parameters"]
    kinds = {"rooms": 4, "keepout": 0, "speed": 1}
    assert costmap["filters"] == [f"{kind}_filter" for kind in kinds]
    for kind, number in kinds.items():
        server, info = (
            parameters[f"{kind}_{what}_server"]["ros__parameters"]
            for what in ("mask", "filter_info")
        )
        assert costmap[f"{kind}_filter"]["filter_info_topic"] == info["filter_info_topic"]
        assert info["mask_topic"] == server["topic_name"]
        assert server["frame_id"] == "floor"
        assert info["type"] == number
        assert {type(info["base"]), type(info["multiplier"])} == {float}
        Mask.load(Path(server["yaml_filename"]))
    written = {path.name for path in (tmp_path / "robot").iterdir()}
    readme = (tmp_path / "robot" / "README.md").read_text()
    assert all(name in readme for name in written - {"README.md"})
    for node in parameters:
        assert node in readme or node == "global_costmap"


@pytest.mark.parametrize("yaw_rad", [0.0, 1.2])
def test_poses_stand_in_rooms_and_doors_and_head_into_the_room(tmp_path, yaw_rad):
    here = topology_of(HOUSE, yaw_rad=yaw_rad)
    graph, _ = bundle_of(here, tmp_path / "robot")
    poses = yaml.safe_load((tmp_path / "robot" / "poses.yaml").read_text())
    doors = {number for number in graph.doors.tolist() if number}
    assert set(here.rooms.names) <= set(poses)
    assert len(poses) == len(here.rooms.names) + 2 * len(doors)
    for name, pose in poses.items():
        x, y = pose["position"]["x"], pose["position"]["y"]
        yaw = 2 * math.atan2(pose["orientation"]["z"], pose["orientation"]["w"])
        room = name.rpartition("into ")[2]
        ahead = 0.0 if room == name else 1.0
        assert here.rooms.at((x + ahead * math.cos(yaw), y + ahead * math.sin(yaw))) == room


def test_a_bundle_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    here = topology_of(HOUSE)
    folder = tmp_path / "robot"
    bundle_of(here, folder)
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    written = []

    def full(path, content):
        written.append(path)
        if len(written) == 3:
            raise OSError(28, "No space left on device")
        with path.open("wb") as file:
            return file.write(content)

    with monkeypatch.context() as patched:
        patched.setattr(Path, "write_bytes", full)
        with pytest.raises(hn.errors.MapError, match="No space left"):
            bundle_of(here, folder, operations=True)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    assert [path.name for path in tmp_path.iterdir()] == ["robot"]
    bundle_of(here, folder)
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before
    (folder / "mine.txt").write_text("x")
    with pytest.raises(hn.errors.InvalidValueError, match=r"it holds mine\.txt"):
        bundle_of(here, folder)
    (tmp_path / "notes").mkdir()
    bundle_of(here, tmp_path / "notes")  # an empty folder is a new one
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "README.md").write_text("mine")
    with pytest.raises(hn.errors.InvalidValueError, match=r"it holds README\.md"):
        bundle_of(here, tmp_path / "own")
    assert (tmp_path / "own" / "README.md").read_text() == "mine"


def test_rooms_keep_their_numbers_when_a_bundle_is_replaced(tmp_path):
    bundle_of(topology_of(HOUSE), tmp_path / "robot")
    file = tmp_path / "robot" / "room_names.yaml"
    before = yaml.safe_load(file.read_text())["rooms"]
    # Without the kitchen, and with a bath of another name in the old bundle.
    old = {number + 5: name for number, name in before.items() if name != "bath"}
    file.write_text(yaml.safe_dump({"rooms": old}))
    bundle_of(topology_of(HOUSE), tmp_path / "robot")
    after = yaml.safe_load(file.read_text())["rooms"]
    assert {number: name for number, name in after.items() if name != "bath"} == old
    (bath,) = set(after) - set(old)
    assert bath == 1


def test_names_beyond_sixteen_bits_are_those_of_the_rooms(tmp_path):
    here = topology_of(HOUSE)
    names = tuple(f"{name} \U0001f6d7" for name in here.rooms.names)
    rooms = hn.RoomLabels(names, here.rooms.labels.label_of)
    bundle_of(hn.TopologicalMap(hn.DualGraphPyramid.build(here.grid, rooms=rooms)), tmp_path / "a")
    known = yaml.safe_load((tmp_path / "a" / "room_names.yaml").read_text())["rooms"]
    assert set(known.values()) == set(names)
    assert set(names) <= set(yaml.safe_load((tmp_path / "a" / "poses.yaml").read_text()))


def test_what_is_no_mask_of_a_bundle_is_refused(tmp_path):
    here = topology_of(HOUSE)
    for costs in (["clearance"], ["speed:a", "speed:b"], ["fast:a"]):
        with pytest.raises(hn.errors.InvalidValueError, match="costs"):
            bundle_of(here, tmp_path / "robot", costs=costs)
    with pytest.raises(hn.errors.MapNotFoundError):
        bundle_of(here, tmp_path / "robot", costs=["speed:none.yaml"])
    bare = hn.TopologicalMap(hn.DualGraphPyramid.build(here.grid))
    with pytest.raises(hn.errors.InvalidValueError, match="rooms"):
        bundle_of(bare, tmp_path / "robot")
    assert not (tmp_path / "robot").exists()


MAPS = (
    ("fetch_maps/9_16_15_keepout.yaml", 9),
    ("aws_small_house/map.yaml", 1),
    ("bwi_mapper/intel.yaml", 4),
    ("giraff_homes/UMA_236.yaml", 0),
)


@pytest.mark.parametrize(("name", "hidden"), MAPS)
def test_rooms_are_the_same_in_lists_masks_goals_and_checks(cli, tmp_path, data, name, hidden):
    """Those of lists have a number and cells in the mask; where the robot fits, a goal, and
    `check` looks for a node."""
    given, bundle = (data / name, "--robot-radius", 0.25), tmp_path / "robot"
    rooms = cli("rooms", *given, "--json").answer["rooms"]
    listed = {one["name"]: one["fits"] for one in rooms if one["is_listed"]}
    assert len(rooms) - len(listed) == hidden
    assert cli("export", *given, "--bundle", bundle).code == 0
    numbers = yaml.safe_load((bundle / "room_names.yaml").read_text())["rooms"]
    assert set(numbers.values()) == set(listed)
    with Image.open(bundle / "rooms_mask.pgm") as mask:
        assert set(np.unique(np.asarray(mask)).tolist()) - {0} == set(numbers)
    goals = yaml.safe_load((bundle / "poses.yaml").read_text())
    fitting = {room for room, fits in listed.items() if fits}
    assert {goal for goal in goals if not goal.startswith("door ")} == fitting
    found = cli("check", *given, bundle / "graph.geojson", "--json", "--fail-on", "never").answer
    assert found["rooms"]["all"] == len(fitting)
