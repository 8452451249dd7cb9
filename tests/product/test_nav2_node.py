"""The node of ROS 2 in examples/, against a stand-in for ROS that follows its documented calls."""

import importlib.util
import math
import re
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import networkx as nx
import numpy as np
import pytest
from rosbags.typesys import Stores, get_typestore

import hybridnav as hn
from hybridnav.graphs import build_lane_graph, export_bundle, route_messages
from hybridnav.messages import fill_message
from tests import ros_stand_in
from tests.nav2_reader import read_nav2

FILE = Path(__file__).parents[2] / "examples" / "nav2_node.py"
RADIUS_M = 0.1
START_YAW, GOAL_YAW = 0.5, -1.57


@pytest.fixture(scope="module")
def patch() -> Any:
    with pytest.MonkeyPatch.context() as found:
        yield found


@pytest.fixture(scope="module")
def actions(patch: pytest.MonkeyPatch) -> Any:
    return ros_stand_in.install(patch)


@pytest.fixture(scope="module")
def node(
    actions: Any,  # noqa: ARG001 - installed before the node is imported
    patch: pytest.MonkeyPatch,
    tmp_path_factory: pytest.TempPathFactory,
) -> Any:
    """The node on a floor of two rooms, and a third that no door leads to."""
    plan = np.zeros((40, 60))
    plan[[0, -1], :] = plan[:, [0, -1]] = 1.0
    plan[:, 30] = 1.0
    plan[18:24, 30] = 0.0
    plan[:, 50] = 1.0
    plan[5:12, 5:12] = np.nan
    grid = hn.OccupancyGrid(
        plan.astype(np.float32), hn.Frame(0.1, (1.0, -2.0), 0.3), robot_radius_m=RADIUS_M
    )
    folder = tmp_path_factory.mktemp("node")
    model, bundle = folder / "floor.hnm", folder / "nav2"
    hn.save(grid, model)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=hn.find_rooms(grid)))
    graph = build_lane_graph(topology)
    # Ids as `--keep` leaves them: they are not those of the order.
    graph = replace(graph, ids=(graph.ids[0] * 3 + 700, graph.ids[1] * 3 + 701))
    export_bundle(topology, graph, bundle)
    given = {"model": str(model), "graph": str(bundle / "graph.geojson")}
    patch.setattr(ros_stand_in.Node, "given", given)
    spec = importlib.util.spec_from_file_location("nav2_node", FILE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.PlanningNode()


def posed(node: Any, at: Any, yaw: float) -> Any:
    """A stamped pose at a position (row, col) in cells."""
    found: Any = ros_stand_in.message("geometry_msgs/PoseStamped")()
    x, y = node.planner.grid.frame.points_of_grid(at).tolist()
    found.pose.position.x, found.pose.position.y = x, y
    found.pose.orientation.z, found.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
    found.header.frame_id = "map"
    return found


def asked(action: Any, node: Any, start: Any, goal: Any, **fields: Any) -> Any:
    """A goal between two positions in cells."""
    found = action.Goal()
    found.use_start = True
    found.start = posed(node, start, START_YAW)
    found.goal = posed(node, goal, GOAL_YAW)
    for name, value in fields.items():
        setattr(found, name, value)
    return found


def call(node: Any, name: str, goal: Any) -> Any:
    return node.actions[name].call(goal)


def place(point: Any) -> tuple[float, float]:
    return point.x, point.y


LEFT, RIGHT, SHUT = (30.5, 10.5), (30.5, 40.5), (30.5, 55.5)


def test_a_path_is_that_of_the_planner(actions: Any, node: Any) -> None:
    goal = asked(actions.ComputePathToPose, node, LEFT, RIGHT)
    status, result = call(node, "compute_path_to_pose", goal)
    assert (status, result.error_code, result.error_msg) == ("succeeded", 0, "")
    start, end = place(goal.start.pose.position), place(goal.goal.pose.position)
    poses = result.path.poses
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(node.planner.grid)))
    expected = planner.plan(start, end).path
    turns = [2 * math.atan2(pose.pose.orientation.z, pose.pose.orientation.w) for pose in poses]
    # The robot turns on the spot at the start, from its yaw, and at the goal, to that of the goal.
    assert (turns[0], turns[-1]) == pytest.approx((START_YAW, GOAL_YAW))
    assert (place(poses[0].pose.position), place(poses[-1].pose.position)) == (start, end)
    between = poses[1:-1]
    assert np.allclose([place(pose.pose.position) for pose in between], expected.poses()[:, :2])
    assert np.allclose(np.cos(turns[1:-1] - expected.poses()[:, 2]), 1)
    assert result.path.header.frame_id == "map"
    assert result.path.header.stamp.sec == 1_700_000_000
    assert (result.planning_time.sec, result.planning_time.nanosec) == (0, 10**6)


@pytest.mark.parametrize(
    ("start", "goal", "code"),
    [
        ((-5, 0), RIGHT, "START_OUTSIDE_MAP"),
        (LEFT, (0, 99), "GOAL_OUTSIDE_MAP"),
        ((30.5, 30.5), RIGHT, "START_OCCUPIED"),
        (LEFT, (30.5, 50.5), "GOAL_OCCUPIED"),
        ((8.5, 8.5), RIGHT, "START_OCCUPIED"),  # unexplored
        (LEFT, SHUT, "NO_VALID_PATH"),
    ],
)
def test_a_plan_without_path_aborts_with_a_code_of_nav2(actions, node, start, goal, code):
    action = actions.ComputePathToPose
    status, result = call(node, "compute_path_to_pose", asked(action, node, start, goal))
    assert status == "aborted"
    assert result.error_code == getattr(action.Result, code) > 200
    assert result.path.poses == []


def test_every_status_of_a_plan_has_a_code(actions: Any, node: Any) -> None:
    results = {}
    for status in hn.PlanStatus:
        plan = hn.PlanResult(status)
        node_of = type(
            "Planner", (), {"needs_headings": False, "plan": lambda *_, found=plan: found}
        )()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(node, "planner", node_of)
            if status is not hn.PlanStatus.SOLVED:
                goal = ros_goal(actions)
                results[status] = call(node, "compute_path_to_pose", goal)[1].error_code
    assert len(results) == len(hn.PlanStatus) - 1
    assert all(200 < code <= 208 for code in results.values()), results


def ros_goal(actions: Any) -> Any:
    goal = actions.ComputePathToPose.Goal()
    goal.use_start = True
    return goal


def test_the_robot_is_the_start_unless_one_is_given(actions, node, monkeypatch):
    goal = asked(actions.ComputePathToPose, node, LEFT, RIGHT, use_start=False)
    status, result = call(node, "compute_path_to_pose", goal)
    assert (status, result.error_code) == ("aborted", actions.ComputePathToPose.Result.TF_ERROR)
    assert "base_link" in result.error_msg
    at: Any = ros_stand_in.message("geometry_msgs/TransformStamped")()
    start = posed(node, (25.5, 20.5), START_YAW).pose
    at.transform.translation.x, at.transform.translation.y = place(start.position)
    at.transform.rotation = start.orientation
    monkeypatch.setattr(ros_stand_in.Buffer, "known", {("map", "base_link"): at})
    status, result = call(node, "compute_path_to_pose", goal)
    assert status == "succeeded"
    assert place(result.path.poses[0].pose.position) == pytest.approx(place(start.position))
    assert result.path.poses[0].pose.orientation.z == pytest.approx(start.orientation.z)


@pytest.mark.parametrize("name", ["start", "goal"])
def test_poses_in_other_frames_are_refused(actions: Any, node: Any, name: str) -> None:
    goal = asked(actions.ComputePathToPose, node, LEFT, RIGHT)
    getattr(goal, name).header.frame_id = "odom"
    status, result = call(node, "compute_path_to_pose", goal)
    assert (status, result.error_code) == ("aborted", actions.ComputePathToPose.Result.TF_ERROR)
    assert "frame map" in result.error_msg
    if name == "start":  # which does not count when the robot is the start
        goal.use_start = False
        assert "base_link" in call(node, "compute_path_to_pose", goal)[1].error_msg


@pytest.mark.parametrize(("turn", "words"), [({"w": 0.0}, "quaternion of"), ({"x": 1.0}, "unit")])
def test_hostile_goals_are_refused_with_words(actions, node, turn, words):
    goal = asked(actions.ComputePathToPose, node, LEFT, RIGHT)
    goal.goal.pose.orientation.z = 0.0
    for name, value in turn.items():
        setattr(goal.goal.pose.orientation, name, value)
    status, result = call(node, "compute_path_to_pose", goal)
    assert (status, result.error_code) == ("aborted", actions.ComputePathToPose.Result.UNKNOWN)
    assert words in result.error_msg
    goal.goal.pose.position.x = math.nan
    assert call(node, "compute_path_to_pose", goal)[0] == "aborted"


def test_a_route_is_the_shortest_of_the_graph_of_the_bundle(actions: Any, node: Any) -> None:
    """By a reader of Nav2's file, and networkx on what it read."""
    file = read_nav2(Path(node.given["graph"]))
    assert min(file.points) == 700  # ids of the file, as `route_server` has them
    network: Any = nx.DiGraph()
    for number, (tail, head) in file.edges.items():
        network.add_edge(tail, head, cost=file.costs[number], id=number)
    lengths = dict(nx.all_pairs_dijkstra_path_length(network, weight="cost"))
    tried = 0
    for tail in list(file.points)[:4]:
        for head in list(file.points)[:10]:
            goal = actions.ComputeRoute.Goal()
            goal.start_id, goal.goal_id = tail, head
            status, result = call(node, "compute_route", goal)
            if head not in lengths[tail]:
                assert (status, result.error_code) == ("aborted", 405)
                continue
            tried += 1
            assert (status, result.error_code) == ("succeeded", 0)
            route = result.route
            assert route.route_cost == pytest.approx(lengths[tail][head])
            nodes = [each.nodeid for each in route.nodes]
            assert (nodes[0], nodes[-1]) == (tail, head)
            for each in route.nodes:
                assert place(each.position) == pytest.approx(file.points[each.nodeid])
            for edge, pair in zip(route.edges, pairwise(nodes), strict=True):
                assert network.edges[pair]["id"] == edge.edgeid
                assert place(edge.start) == pytest.approx(file.points[pair[0]])
                assert place(edge.end) == pytest.approx(file.points[pair[1]])
            ends = [place(result.path.poses[at].pose.position) for at in (0, -1)]
            assert ends[0] == pytest.approx(file.points[tail])
            assert ends[1] == pytest.approx(file.points[head])
            assert route.header.frame_id == result.path.header.frame_id == "map"
    assert tried > 5


def test_a_route_between_poses_runs_between_nodes_near_them(actions: Any, node: Any) -> None:
    goal = asked(actions.ComputeRoute, node, LEFT, RIGHT, use_poses=True)
    status, result = call(node, "compute_route", goal)
    assert status == "succeeded"
    first, last = (place(result.route.nodes[at].position) for at in (0, -1))
    away = [math.dist(first, place(goal.start.pose.position))]
    away += [math.dist(last, place(goal.goal.pose.position))]
    assert max(away) < 2.0
    # The start lies left of the wall, and so does its node: the nearest by path, not by air.
    cols = node.planner.grid.frame.cells_of([first, last])[:, 1]
    assert cols[0] < 31 < cols[1]


@pytest.mark.parametrize("goal", [{"goal_id": 9999}, {"use_poses": True}])
def test_without_a_route_there_is_a_code(actions: Any, node: Any, goal: Any) -> None:
    asked_for = asked(actions.ComputeRoute, node, LEFT, (0.5, 0.5), **goal)
    status, result = call(node, "compute_route", asked_for)
    assert (status, result.error_code) == ("aborted", 405)
    assert result.route.nodes == []


def test_results_of_older_versions_lack_fields(actions, node, monkeypatch):
    """Humble has neither error_code nor error_msg, and no constants."""
    old = type("Result", (ros_stand_in.Message,), {"fields": {
        name: kind
        for name, kind in actions.ComputePathToPose.Result.fields.items()
        if not name.startswith("error")
    }})  # fmt: skip
    monkeypatch.setattr(actions.ComputePathToPose, "Result", old)
    for goal, status in ((RIGHT, "succeeded"), (SHUT, "aborted")):
        asked_for = asked(actions.ComputePathToPose, node, LEFT, goal)
        assert call(node, "compute_path_to_pose", asked_for)[0] == status


def test_the_node_is_short_and_imports_no_private_module() -> None:
    text = FILE.read_text()
    assert len(text.splitlines()) < 80
    assert [name for name in re.findall(r"hybridnav[\w.]*", text) if "._" in name] == []


def test_the_stand_in_is_as_strict_as_rosidl() -> None:
    point: Any = ros_stand_in.message("geometry_msgs/Point")()
    for value in (1, "1", None, np.float32(1)):
        with pytest.raises(AssertionError):
            point.x = value
    with pytest.raises(AttributeError):
        point.w = 1.0
    edge: Any = ros_stand_in.message("nav2_msgs/RouteEdge")()
    for number in (-1, 2**16, 1.0, np.int64(3)):
        with pytest.raises(AssertionError):
            edge.edgeid = number


def plain(value: Any) -> Any:
    if isinstance(value, ros_stand_in.Message):
        return {name: plain(getattr(value, name)) for name in value.fields}
    return [plain(each) for each in value] if isinstance(value, list) else value


@pytest.mark.usefixtures("actions")
def test_messages_are_filled_as_rosidl_fills_them(node: Any) -> None:
    values = route_messages(node.graph, node.graph.edges[0].tolist(), stamp_ns=7, spacing_m=0.5)
    for kind, name in (("nav_msgs/Path", "path"), ("nav2_msgs/Route", "route")):
        judge: Any = ros_stand_in.message(kind)()
        ros_stand_in.set_message_fields(judge, values[name])
        assert plain(fill_message(ros_stand_in.message(kind)(), values[name])) == plain(judge)
    with pytest.raises(AttributeError):
        fill_message(ros_stand_in.message("nav_msgs/Path")(), {"points": []})


def true_message(store: Any, kind: str, given: Any) -> Any:
    """A message of rosbags, made of the true definitions of a release, with the same values."""

    def part(kind: str, value: Any) -> Any:
        if kind.startswith("list["):
            return [part(kind[5:-1], each) for each in value]
        return true_message(store, kind.replace("__", "/"), value) if "__" in kind else value

    made = store.types[kind]
    kinds = {name: kind for name, kind in made.__annotations__.items() if name != "__msgtype__"}
    assert kinds.keys() == given.fields.keys()
    return made(**{name: part(kind, getattr(given, name)) for name, kind in kinds.items()})


def sent(store: Any, kind: str, given: Any) -> Any:
    sent = store.serialize_cdr(true_message(store, kind, given), kind)
    return store.deserialize_cdr(sent, kind)


@pytest.mark.parametrize("release", ["HUMBLE", "JAZZY", "KILTED", "LYRICAL"])
def test_the_node_takes_and_makes_messages_of_each_release(actions, node, release):
    """Those of common_interfaces, whose definitions rosbags has; of Nav2's it has none."""
    store, posed_kind = get_typestore(Stores[f"ROS2_{release}"]), "geometry_msgs/msg/PoseStamped"
    ends = [
        sent(store, posed_kind, posed(node, at, yaw))
        for at, yaw in ((LEFT, START_YAW), (RIGHT, GOAL_YAW))
    ]
    asked_for = SimpleNamespace(use_start=True, start=ends[0], goal=ends[1])
    handle = ros_stand_in.GoalHandle(asked_for)
    result = node.answer(handle)
    assert (handle.status, result.error_code) == ("succeeded", 0)
    path = sent(store, "nav_msgs/msg/Path", result.path)
    own = call(node, "compute_path_to_pose", asked(actions.ComputePathToPose, node, LEFT, RIGHT))[1]
    assert [place(pose.pose.position) for pose in path.poses] == [
        place(pose.pose.position) for pose in own.path.poses
    ]
    assert (path.header.frame_id, path.poses[-1].header.frame_id) == ("map", "map")
    assert path.header.stamp.sec == 1_700_000_000
    took = sent(store, "builtin_interfaces/msg/Duration", result.planning_time)
    assert (took.sec, took.nanosec) == (0, 10**6)
