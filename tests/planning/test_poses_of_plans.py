"""Poses of plans by every preset: headings at start and goal, and no pose twice in a row."""

import csv
import itertools
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

import hybridnav as hn
from hybridnav.messages import pose_of
from hybridnav.planning import load_preset
from tests.plans import TWO_ROOMS, grid_of, map_of, points_in, scene_map
from tests.strategies import Scene, examples, scenes

PLAIN = ("shortest", "octile", "grid-astar", "paper", "robot")
OMPL = ("r2", "se2", "dubins", "reeds-shepp", "differential")
NEEDS_YAW = OMPL[1:]
SMOOTH: Any = ("none", "line-of-sight", "arcs")
START_YAW, GOAL_YAW = 2.0, -1.57


def planner_of(topology: hn.TopologicalMap, preset: str) -> hn.HybridPlanner:
    if preset not in OMPL:
        return hn.HybridPlanner(topology, preset=preset)
    pytest.importorskip("ompl")
    turning = "" if preset not in {"dubins", "reeds-shepp"} else ", turning_radius_m: 0.04"
    section = f"planner.ompl={{space: {preset}, budget_s: 0.4{turning}}}"
    chosen = load_preset("ompl", overrides=[section])
    return hn.HybridPlanner(topology, preset=chosen)


def repeated(poses: Any) -> Any:
    """Indices of poses that the next one repeats, by the cosines of their headings."""
    steps = np.diff(poses, axis=0)
    still = np.hypot(steps[:, 0], steps[:, 1]) < 1e-12
    return np.flatnonzero(still & (1 - np.cos(steps[:, 2]) < 1e-14))


def check_poses(path: hn.Path, spacing_m: float = 0.05) -> None:
    """No pose occurs twice in a row; one place, only where the robot turns on the spot."""
    headings = np.zeros(len(path.points)) if path.headings_rad is None else path.headings_rad
    points = np.column_stack([path.points, headings])
    assert (np.diff(points, axis=0) != 0).any(axis=1).all()
    poses = path.poses(spacing_m)
    assert not len(repeated(poses))
    assert len(path.directions(spacing_m)) == len(poses)
    still = np.flatnonzero((np.diff(poses[:, :2], axis=0) == 0).all(axis=1))
    spots = path.points[path.spot_turns]
    for at in still.tolist():
        assert (poses[at, :2] == spots).all(axis=1).any()


def by_message(path: hn.Path) -> Any:
    return np.array([pose_of(each, "pose", "pose") for each in path.to_message()["poses"]])


def table(file: Path) -> Any:
    with file.open(newline="") as stream:
        return np.array([[float(cell) for cell in row] for row in list(csv.reader(stream))[1:]])


@pytest.fixture(scope="module")
def two_rooms() -> hn.TopologicalMap:
    return map_of(grid_of(TWO_ROOMS))


@pytest.mark.parametrize("preset", [*PLAIN, *OMPL])
def test_every_preset_starts_and_ends_with_the_yaw_asked_for(two_rooms, preset, tmp_path):
    planner = planner_of(two_rooms, preset)
    centres = two_rooms.grid.frame.points_of([(7, 1), (1, 13)]).tolist()
    start, goal = (*centres[0], START_YAW), (*centres[1], GOAL_YAW)
    result = planner.plan(start, goal)
    path: Any = result.path
    assert result.solved
    assert (result.start, result.goal) == (start, goal)
    poses = path.poses()
    np.testing.assert_allclose(poses[[0, -1]], [start, goal], atol=1e-6)
    assert path.headings_at_points[[0, -1]] == pytest.approx([START_YAW, GOAL_YAW], abs=1e-6)
    check_poses(path)
    np.testing.assert_allclose(by_message(path), poses, atol=1e-9)
    assert result.to_dict()["headings_rad"][-1] == pytest.approx(GOAL_YAW, abs=1e-6)
    hn.export_path(result, tmp_path / "path.csv")
    np.testing.assert_allclose(table(tmp_path / "path.csv")[[0, -1], :3], [start, goal], atol=1e-6)
    if preset not in NEEDS_YAW:  # a disc turns on the spot, and drives as without
        plain: Any = planner.plan(*centres).path
        if preset not in OMPL:
            np.testing.assert_array_equal(path.points, plain.points)
            np.testing.assert_array_equal(poses[1:-1], plain.poses())
        assert {0, len(path.points) - 1} <= set(path.spot_turns.tolist())
    planner.close()


@pytest.mark.parametrize("preset", PLAIN)
@pytest.mark.parametrize("smooth", SMOOTH)
def test_a_yaw_at_one_end_or_without_a_way_is_kept(two_rooms, preset, smooth):
    if smooth == "arcs" and preset != "robot":
        return  # arcs are for costs
    planner = hn.HybridPlanner(two_rooms, preset=preset)
    one, other = two_rooms.grid.frame.points_of([(7, 1), (1, 13)]).tolist()
    without: Any = planner.plan(one, other, smooth=smooth)
    travel = without.path.poses()
    for start, goal, first, last in (
        ((*one, 2.0), other, [2.0, travel[0, 2]], travel[-1:, 2]),
        (one, (*other, 9.0), travel[:1, 2], [travel[-1, 2], 9.0 - math.tau]),
        ((*one, travel[0, 2]), (*other, travel[-1, 2]), travel[:2, 2], travel[-2:, 2]),
        ((*one, 2.0), (*one, -1.0), [2.0, -1.0], [2.0, -1.0]),
        ((*one, 2.0), (*one, 2.0), [2.0], [2.0]),
        ((*one, 2.0), one, [2.0], [2.0]),
        (one, (*one, -1.0), [-1.0], [-1.0]),
    ):
        path: Any = planner.plan(start, goal, smooth=smooth).path
        faced = path.poses()[:, 2]
        assert faced[: len(first)] == pytest.approx(first)
        assert faced[-len(last) :] == pytest.approx(last)
        check_poses(path)
        if goal[:2] == one:
            assert len(faced) == len(first)


@pytest.mark.parametrize("preset", PLAIN)
@pytest.mark.parametrize("yaw", [math.nan, math.inf, "east", None])
def test_a_yaw_that_is_no_number_is_refused(two_rooms, preset, yaw):
    planner = hn.HybridPlanner(two_rooms, preset=preset)
    one, other = two_rooms.grid.frame.points_of([(7, 1), (1, 13)]).tolist()
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"goal must be .* radians, got"
    ) as caught:
        planner.plan(one, (*other, yaw))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("preset", PLAIN)
def test_plans_and_batches_take_yaws_too(two_rooms: hn.TopologicalMap, preset: str) -> None:
    planner = hn.HybridPlanner(two_rooms, preset=preset)
    one, other = two_rooms.grid.frame.points_of([(7, 1), (1, 13)]).tolist()
    result = planner.plan((*one, 1.0), (*other, GOAL_YAW))
    assert result.path.poses()[[0, -1], 2].tolist() == pytest.approx([1.0, GOAL_YAW])
    batch = planner.plan_many([(*one, 1.0)], [(*other, GOAL_YAW)])
    assert batch.cost == pytest.approx(planner.plan(one, other).cost)
    assert batch.headings_rad is None


def test_alternatives_keep_the_yaw(two_rooms: hn.TopologicalMap) -> None:
    planner = hn.HybridPlanner(two_rooms)
    one, other = two_rooms.grid.frame.points_of([(7, 1), (1, 13)]).tolist()
    found = hn.plan_alternatives(planner, (*one, 1.0), (*other, GOAL_YAW), 2)
    assert len(found) == 1
    for each in found:
        assert each.result.path.poses()[[0, -1], 2] == pytest.approx([1.0, GOAL_YAW])


@pytest.mark.parametrize("preset", PLAIN)
@given(scene=scenes(max_side=12))
@settings(max_examples=examples(40), deadline=None, derandomize=True)
def test_no_pose_occurs_twice_on_random_maps(preset: str, scene: Scene) -> None:
    topology = scene_map(scene)
    rng = np.random.default_rng(scene.seed)
    costs = None
    if preset == "robot":
        costs = hn.CostLayer(rng.choice([1.0, 1.0, 2.0, 7.0], topology.grid.shape))
    planner = hn.HybridPlanner(topology, preset=preset, costs=costs)
    for number, (one, other) in enumerate(points_in(topology.grid, rng, 4)):
        for smooth in SMOOTH if preset == "robot" else SMOOTH[:2]:
            yaws = [[], [0.7]][number % 2]  # that of the frame, so of some paths
            result = planner.plan((*one, *yaws), (*other, *yaws), smooth=smooth)
            if result.path is not None:
                check_poses(result.path, 0.02)


@pytest.mark.parametrize("preset", OMPL)
def test_no_pose_occurs_twice_with_ompl(two_rooms: hn.TopologicalMap, preset: str) -> None:
    planner = planner_of(two_rooms, preset)
    pairs = points_in(two_rooms.grid, np.random.default_rng(5), 4)
    paths = [planner.plan((*one, 0.3), (*other, -1.0)).path for one, other in pairs]
    planner.close()
    assert any(paths)
    for path in filter(None, paths):
        check_poses(path, 0.02)


@pytest.fixture(scope="module")
def office() -> hn.TopologicalMap:
    return map_of(hn.example_map("office"))


@pytest.mark.parametrize("preset", PLAIN)
def test_no_pose_occurs_twice_in_the_office(office, preset, tmp_path):
    planner = hn.HybridPlanner(office, preset=preset)
    arcs = 0
    for number, (one, other) in enumerate(points_in(office.grid, np.random.default_rng(3), 12)):
        for smooth in SMOOTH if preset == "robot" else SMOOTH[:2]:
            result = planner.plan(one, other, smooth=smooth)
            if result.path is None:
                continue
            check_poses(result.path)
            arcs += result.path.is_curved
            if number < 3:
                assert not len(repeated(by_message(result.path)))
                for ending in ("csv", "json"):
                    hn.export_path(result, tmp_path / f"path.{ending}")
                rows = table(tmp_path / "path.csv")[:, :3].tolist()
                assert all(row != after for row, after in itertools.pairwise(rows))
    assert (arcs > 5) == (preset == "robot")


def test_no_pose_occurs_twice_where_the_plans_of_a_tour_meet(two_rooms, tmp_path):
    """Straight on over a waypoint, back from one, and on from one with the yaw of both plans."""
    planner = hn.HybridPlanner(two_rooms)
    a, b, c = two_rooms.grid.frame.points_of([(1, 1), (1, 3), (1, 5)]).tolist()
    for waypoints, turns in (([a, b, c], 0), ([a, c, b], 1), ([a, (*b, 1.0), c], 2)):
        hn.export_path(hn.plan_tour(planner, waypoints), tmp_path / "tour.csv")
        rows = table(tmp_path / "tour.csv")
        assert not len(repeated(rows[:, :3]))
        still = (np.diff(rows[:, :2], axis=0) == 0).all(axis=1)
        assert still.sum() == turns


def spots_of_pure_pursuit(poses: Any) -> set[int]:
    """Where Nav2's Regulated Pure Pursuit sees a cusp or a turn on the spot: by the sign of the
    product of two steps, and by points that are equal, exactly, with other orientations."""
    place = [(each["pose"]["position"]["x"], each["pose"]["position"]["y"]) for each in poses]
    faced = [each["pose"]["orientation"] for each in poses]
    found = set()
    for i in range(1, len(poses) - 1):
        before = np.subtract(place[i], place[i - 1])
        behind = np.subtract(place[i + 1], place[i])
        if before @ behind < 0:
            found.add(i)
        for step, pair in ((before, faced[i - 1 : i + 1]), (behind, faced[i : i + 2])):
            if np.hypot(*step) == 0 and pair[0] != pair[1]:
                found.add(i)
    return found


@pytest.mark.parametrize("preset", [*PLAIN, *OMPL])
@pytest.mark.parametrize("yaws", [(), (START_YAW, GOAL_YAW)])
def test_messages_are_as_the_controllers_of_nav2_take_them(two_rooms, preset, yaws):
    if preset in NEEDS_YAW and not yaws:
        return
    planner = planner_of(two_rooms, preset)
    one, other = two_rooms.grid.frame.points_of([(7, 1), (1, 13)]).tolist()
    path: Any = planner.plan((*one, *yaws[:1]), (*other, *yaws[1:])).path
    planner.close()
    message = path.to_message("map", spacing_m=0.05, stamp_ns=7_000_000_008)
    header = {"stamp": {"sec": 7, "nanosec": 8}, "frame_id": "map"}
    assert message["header"] == header
    for each in message["poses"]:
        assert each["header"] == header
        place, turn = each["pose"]["position"], each["pose"]["orientation"]
        assert (place["z"], turn["x"], turn["y"]) == (0, 0, 0)
        assert math.hypot(turn["z"], turn["w"]) == pytest.approx(1, abs=1e-12)
        assert all(map(math.isfinite, (*place.values(), *turn.values())))
    for each, after in itertools.pairwise(message["poses"]):
        assert each["pose"] != after["pose"]
        step = [after["pose"]["position"][axis] - each["pose"]["position"][axis] for axis in "xy"]
        assert math.hypot(*step) <= 0.05 * (1 + 1e-9)
        if step == [0, 0]:
            assert each["pose"]["orientation"] != after["pose"]["orientation"]
        else:
            assert math.hypot(*step) > 1e-9
    # The robot turns or reverses wherever a controller thinks so.
    poses = path.poses(0.05)
    stops = path.points[np.union1d(path.spot_turns, path.reversals)]
    for at in spots_of_pure_pursuit(message["poses"]):
        assert np.abs(stops - poses[at, :2]).max(axis=1).min() < 1e-9


@pytest.mark.parametrize("preset", PLAIN)
def test_a_message_from_a_point_to_itself_has_a_pose(two_rooms, preset):
    planner = hn.HybridPlanner(two_rooms, preset=preset)
    (point,) = two_rooms.grid.frame.points_of([(7, 1)]).tolist()
    path: Any = planner.plan(point, point).path
    assert len(path.to_message()["poses"]) == 1
    turned: Any = planner.plan((*point, 1.0), (*point, 2.0)).path
    assert len(turned.to_message()["poses"]) == 2
