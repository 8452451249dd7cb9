"""Speeds along a path: within every limit, and as fast as a linear program finds them."""

import itertools
import json
import math
import pickle
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import strategies as st
from scipy import sparse
from scipy.optimize import linprog

import hybridnav as hn
from hybridnav.planning import LimitSettings, MotionLimits, SpeedMap, load_preset
from tests._base.test_poses import curve_path, path_of, turned
from tests.plans import TWO_ROOMS, grid_of, map_of
from tests.strategies import tried

LIMIT = st.floats(0.2, 3.0).map(lambda x: round(x, 2))
LIMITS = st.builds(MotionLimits, LIMIT, LIMIT, LIMIT, LIMIT, LIMIT, LIMIT)
PIECE = st.tuples(
    st.floats(0.05, 3.0), st.sampled_from([0.0, 0.0, 0.5, -0.5, 2.0, -3.0]), st.booleans()
)
"""Metres, curvature, and whether the robot first turns on the spot by a radian."""
PIECES = st.lists(PIECE, min_size=1, max_size=6)


def tangent_path(pieces: Any) -> hn.Path:
    """Lines and arcs, each tangent to the next but for turns on the spot, as `robot` plans them."""
    points, headings = [(1.0, 2.0)], [0.3]
    for length_m, curvature, spot in pieces:
        (x, y), yaw = points[-1], headings[-1]
        if spot:
            yaw += 1.0
            points.append((x, y))
            headings.append(yaw)
        for _ in range(4):  # arcs of less than half a circle
            part, turn = length_m / 4, curvature * length_m / 4
            chord = part * np.sinc(turn / 2 / np.pi)
            x, y = x + chord * math.cos(yaw + turn / 2), y + chord * math.sin(yaw + turn / 2)
            yaw += turn
            points.append((x, y))
            headings.append(yaw)
    made = path_of(points, np.array(headings), is_curved=True)
    assert made.length_m == pytest.approx(sum(length for length, _, _ in pieces))
    return made


def most_squares(pieces: Any, limits: MotionLimits, along: Any) -> Any:
    """The square of the greatest speed at each distance: the least of the pieces that meet there,
    and 0 where the robot stands still."""
    most, begun = np.full(len(along), math.inf), 0.0
    for length_m, curvature, spot in pieces:
        bent = max(abs(curvature), 1e-9)
        rate = limits.max_turning_rate_rad_s / bent
        own = min(limits.max_speed_m_s**2, rate**2, limits.max_lateral_acceleration_m_s2 / bent)
        inside = (along > begun - 1e-9) & (along < begun + length_m + 1e-9)
        most[inside] = np.minimum(most[inside], own)
        most[spot & (np.abs(along - begun) < 1e-9)] = 0.0
        begun += length_m
    most[[0, -1]] = 0.0
    return most


def by_linear_program(along: Any, most: Any, limits: MotionLimits) -> Any:
    """The squares of speeds with the greatest sum whose differences keep the accelerations."""
    n = len(along)
    rises: Any = sparse.diags([-np.ones(n - 1), np.ones(n - 1)], [0, 1], shape=(n - 1, n))
    steps = 2 * np.diff(along)
    within = [steps * limits.max_acceleration_m_s2, steps * limits.max_deceleration_m_s2]
    both: Any = sparse.vstack([rises, -rises])
    found = linprog(
        -np.ones(n),
        A_ub=both,
        b_ub=np.concatenate(within),
        bounds=[(0.0, top) for top in most.tolist()],
    )
    assert found.success
    return found.x


def spot_seconds(angle_rad: float, limits: MotionLimits) -> float:
    """By small steps of time: the rate rises to its limit or to half of the turn, then the same
    backwards."""
    angle, rate, seconds, dt = 0.0, 0.0, 0.0, 1e-4
    while angle < angle_rad / 2:
        angle += rate * dt
        gained = rate + limits.max_angular_acceleration_rad_s2 * dt
        rate = min(gained, limits.max_turning_rate_rad_s)
        seconds += dt
    return 2 * seconds


@tried(40, pieces=PIECES, limits=LIMITS)
def test_no_linear_program_finds_a_faster_profile(pieces: Any, limits: MotionLimits) -> None:
    path = tangent_path(pieces)
    profile = path.profile(limits, 0.05)
    along = profile.along_m
    best = by_linear_program(along, most_squares(pieces, limits, along), limits)
    np.testing.assert_allclose(profile.speed_m_s**2, best, atol=1e-6)
    # Fine steps of constant acceleration take as long, but for those in which it changes.
    fine = path.profile(limits, 5e-4)
    speed, driven = fine.speed_m_s, np.diff(fine.along_m)
    moves = driven > 0
    seconds = (2 * driven[moves] / (speed[1:] + speed[:-1])[moves]).sum()
    seconds += sum(spot for _, _, spot in pieces) * spot_seconds(1.0, limits)
    assert profile.duration_s <= seconds + 1e-9
    assert profile.duration_s == pytest.approx(seconds, rel=2e-3, abs=0.02)


@tried(60, pieces=PIECES, limits=LIMITS, spacing_m=st.floats(0.03, 2.0))
def test_no_limit_is_violated_and_the_spacing_changes_no_time(pieces, limits, spacing_m):
    path = tangent_path(pieces)
    profile = path.profile(limits, spacing_m)
    speed, time_s = profile.speed_m_s, profile.time_s
    n = len(profile.poses)
    for each in fields(profile):
        assert len(getattr(profile, each.name)) == n
        assert not getattr(profile, each.name).flags.writeable
    slack = 1 + 1e-9
    assert (speed >= 0).all()
    assert (speed <= limits.max_speed_m_s * slack).all()
    for curvature in (profile.curvature_per_m, np.append(0.0, profile.curvature_per_m[:-1])):
        bent = np.abs(curvature)
        assert (speed**2 * bent <= limits.max_lateral_acceleration_m_s2 * slack).all()
        assert (speed * bent <= limits.max_turning_rate_rad_s * slack).all()
    driven = np.diff(profile.along_m)
    change = np.diff(speed**2)
    assert (change <= 2 * limits.max_acceleration_m_s2 * driven + 1e-9).all()
    assert (-change <= 2 * limits.max_deceleration_m_s2 * driven + 1e-9).all()
    assert speed[[0, -1]].tolist() == [0, 0]
    still = np.flatnonzero(driven == 0)
    assert (speed[still] == 0).all()
    assert (speed[still + 1] == 0).all()
    assert time_s[0] == 0
    assert (np.diff(time_s) > 0).all()
    # No step takes less time than its greatest speed allows.
    assert (np.diff(time_s) * limits.max_speed_m_s >= driven * (1 - 1e-9)).all()
    assert profile.along_m[-1] == pytest.approx(path.length_m)
    assert profile.duration_s == pytest.approx(path.profile(limits, math.inf).duration_s)
    assert profile.duration_s == pytest.approx(path.profile(limits, 0.011).duration_s)


@tried(60, pieces=PIECES, limits=LIMITS, more=st.floats(1.0, 3.0))
def test_higher_limits_are_never_slower_and_time_scales(pieces, limits, more):
    path = tangent_path(pieces)
    seconds = path.profile(limits).duration_s
    for each in fields(limits):
        higher = replace(limits, **{each.name: more * getattr(limits, each.name)})
        assert path.profile(higher).duration_s <= seconds * (1 + 1e-9)
    # All speeds twice as high, accelerations four times: the same film at twice its speed.
    film = {
        each.name: getattr(limits, each.name) * (4 if "acceleration" in each.name else 2)
        for each in fields(limits)
    }
    film["max_deceleration_m_s2"] = 4 * limits.max_deceleration_m_s2
    assert path.profile(MotionLimits(**film)).duration_s == pytest.approx(seconds / 2)


@tried(60, pieces=PIECES, limits=LIMITS)
def test_backwards_along_the_same_way_takes_as_long(pieces: Any, limits: MotionLimits) -> None:
    path = tangent_path(pieces)
    assert path.headings_rad is not None
    back = path_of(path.points[::-1], path.headings_rad[::-1], is_curved=True)
    swapped = replace(
        limits,
        max_acceleration_m_s2=limits.max_deceleration_m_s2,
        max_deceleration_m_s2=limits.max_acceleration_m_s2,
    )
    profile = back.profile(swapped)
    moves = np.append(np.diff(profile.along_m) > 0, False)
    assert (profile.directions[moves] == -1).all()
    assert profile.duration_s == pytest.approx(path.profile(limits).duration_s)


def test_a_line_is_a_trapezoid_and_a_short_one_a_triangle() -> None:
    limits = MotionLimits(max_speed_m_s=1.0, max_acceleration_m_s2=1.0, max_deceleration_m_s2=2.0)
    # 0.5 m to speed up, 0.25 m to brake, the rest at 1 m/s.
    profile = path_of([(0, 0), (2, 0)]).profile(limits, 0.25)
    assert profile.duration_s == pytest.approx(1.0 + 1.25 + 0.5)
    assert profile.speed_m_s[[1, 2, 7]] == pytest.approx([math.sqrt(0.5), 1.0, 1.0])
    assert profile.time_s[2] == pytest.approx(1.0)
    # Between two poses at rest: up to z = 2 a d / (a + d) * 0.3.
    short = path_of([(0, 0), (0.3, 0)]).profile(limits, 1.0)
    peak = math.sqrt(2 * 1.0 * 2.0 / 3.0 * 0.3)
    assert short.speed_m_s.tolist() == [0, 0]
    assert short.duration_s == pytest.approx(peak / 1.0 + peak / 2.0)


def test_bends_of_lines_are_turns_on_the_spot_in_two_poses() -> None:
    limits = MotionLimits(max_turning_rate_rad_s=1.0, max_angular_acceleration_rad_s2=2.0)
    path = path_of([(0, 0), (1, 0), (1, 1), (1, 2)], start_heading_rad=-2.5, goal_heading_rad=1.8)
    profile = path.profile(limits, 0.5)
    assert profile.poses[:2].tolist() == [[0, 0, -2.5], [0, 0, 0]]
    np.testing.assert_allclose(profile.poses[3:5], [[1.0, 0.0, 0.0], [1.0, 0.0, math.pi / 2]])
    np.testing.assert_allclose(profile.poses[-2:], [[1.0, 2.0, math.pi / 2], [1.0, 2.0, 1.8]])
    line = path_of([(0, 0), (1, 0)]).profile(limits).duration_s
    both = path_of([(0, 0), (2, 0)]).profile(limits).duration_s
    turns = [2.5, math.pi / 2, 1.8 - math.pi / 2]
    want = line + both + sum(spot_seconds(angle, limits) for angle in turns)
    assert profile.duration_s == pytest.approx(want, abs=2e-3)
    assert profile.duration_s == pytest.approx(path.profile(limits, 0.013).duration_s)
    one_place = path_of([(1, 1)], start_heading_rad=0.0, goal_heading_rad=1.0).profile(limits)
    assert one_place.duration_s == pytest.approx(spot_seconds(1.0, limits), abs=1e-3)
    assert path_of([(1, 1)]).profile(limits).duration_s == 0


def test_a_robot_that_slides_stops_where_its_direction_jumps_alone() -> None:
    path = path_of([(0, 0), (1, 0), (2, 0), (2, 1)], [0.0, 1.0, 0.5, 0.5])
    profile = path.profile(MotionLimits(), 0.1)
    stops = np.flatnonzero(profile.speed_m_s == 0)
    np.testing.assert_allclose(profile.poses[stops, :2], [(0, 0), (2, 0), (2, 1)])


@pytest.mark.parametrize("goal", [(0.0, 0.3, 0.0), (-1.0, 0.5, 2.0)])
def test_the_robot_stops_where_it_reverses(goal: Any) -> None:
    path = curve_path((0.0, 0.0, 0.0), goal, 1.0)
    assert len(path.reversals) >= 1
    profile = path.profile(MotionLimits(), 0.02)
    stops = profile.poses[np.flatnonzero(profile.speed_m_s == 0), :2]
    places = path.points[[0, *path.reversals, -1]]
    np.testing.assert_allclose(stops, places, atol=1e-9)


# Zones.


@tried(80, data=st.data())
def test_zones_slow_down_whatever_touches_them(data: Any) -> None:
    cells = data.draw(st.lists(st.sampled_from([0.1, 0.4, math.inf]), min_size=12, max_size=12))
    limits = np.array(cells).reshape(3, 4)
    frame = hn.Frame(0.5, (1.0, -2.0), data.draw(st.sampled_from([0.0, 0.7])))
    spot = st.floats(-1.0, 5.0).map(lambda x: round(x * 4) / 4)  # corners and sides too
    positions = data.draw(st.lists(st.tuples(spot, spot), min_size=2, max_size=5))
    points = frame.points_of_grid(positions)
    found = SpeedMap(limits, frame).least_along(points)
    for i, (one, other) in enumerate(itertools.pairwise(positions)):
        segment = shapely.LineString([one, other])
        touched = [
            value
            for (row, col), value in np.ndenumerate(limits)
            if shapely.box(row, col, row + 1, col + 1).distance(segment) < 1e-9
        ]
        assert found[i] == min(touched, default=math.inf)


def test_the_profile_keeps_the_limits_of_zones_and_brakes_before_them() -> None:
    grid = hn.OccupancyGrid(np.zeros((4, 40), np.float32), hn.Frame(0.1), robot_radius_m=0)
    mask = np.zeros((4, 40), dtype=np.int64)
    mask[:, 15:25] = 60  # per cent below full speed
    layer = hn.CostLayer.speed_mask(grid, mask)
    zones = SpeedMap(0.5 / layer.factors, grid.frame)
    path = path_of([(0.05, 0.25), (3.95, 0.25)])
    limits = MotionLimits()
    free, slow = path.profile(limits, 0.05), path.profile(limits, 0.05, speed_map=zones)
    inside = (slow.poses[:, 0] >= 1.5) & (slow.poses[:, 0] <= 2.5)
    assert inside.sum() > 15
    np.testing.assert_allclose(slow.speed_m_s[inside], 0.2)
    before = np.flatnonzero(inside)[0]
    want = math.sqrt(0.04 + 2 * 2.5 * (1.5 - slow.poses[before - 1, 0]))
    assert 0.2 < slow.speed_m_s[before - 1] <= want + 1e-9
    assert slow.duration_s > free.duration_s + 0.9 * (1 / 0.2 - 1 / 0.5)
    unbound = SpeedMap(np.full((4, 40), math.inf), grid.frame)
    np.testing.assert_array_equal(path.profile(limits, speed_map=unbound).time_s, free.time_s)


@pytest.mark.parametrize("value", [0, -1.0, math.nan, math.inf, True, "fast", None])
@pytest.mark.parametrize("name", [each.name for each in fields(MotionLimits)])
def test_a_limit_that_is_none_is_refused_in_one_line(name: str, value: Any) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match=f"{name} must be a finite") as caught:
        MotionLimits(**{name: value})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("limits", [[1.0], [[0.0]], [[-1.0]], [[math.nan]], "slow", [["x"]], None])
def test_a_map_of_speeds_that_is_none_is_refused_in_one_line(limits: Any) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match="speed limits must be") as caught:
        SpeedMap(limits, hn.Frame(1.0))
    assert "\n" not in str(caught.value)
    path: Any = path_of([(0, 0), (1, 0)])
    with pytest.raises(hn.errors.InvalidValueError, match="MotionLimits"):
        path.profile(0.5)
    with pytest.raises(hn.errors.InvalidValueError, match="SpeedMap"):
        path.profile(MotionLimits(), speed_map=np.ones((1, 1)))


# Lengths: of what is driven.


def check_length(path: hn.Path) -> None:
    """Chords between dense poses grow to the length, with the square of the spacing."""
    short = []
    for spacing_m in (0.04, 0.02, 0.01):
        poses = path.poses(spacing_m)
        short.append(path.length_m - np.hypot(*np.diff(poses[:, :2], axis=0).T).sum())
    bent = path.max_curvature_per_m
    for spacing_m, lacking in zip((0.04, 0.02, 0.01), short, strict=True):
        assert -1e-9 * (1 + path.length_m) <= lacking
        assert lacking <= path.length_m * (spacing_m * bent) ** 2 / 24 + 1e-9


@tried(30, pieces=PIECES)
def test_the_length_is_that_of_lines_and_arcs(pieces: Any) -> None:
    check_length(tangent_path(pieces))


@tried(
    30, goal=st.tuples(st.floats(-3, 3), st.floats(-3, 3), st.floats(-3, 3)), reverses=st.booleans()
)
def test_the_length_is_that_of_turning_circles(goal: Any, *, reverses: bool) -> None:
    if math.hypot(*goal[:2]) > 0.1:
        path = curve_path((0.0, 0.0, 0.0), goal, 0.8, reverses=reverses)
        check_length(path)
        driven = path.profile(MotionLimits(), 0.02).along_m[-1]
        assert driven == pytest.approx(path.length_m, rel=1e-6)


# Results.

ROOMS = map_of(grid_of(TWO_ROOMS))
START, GOAL = ROOMS.grid.frame.points_of([(7, 1), (1, 13)]).tolist()


def test_results_of_robot_state_how_long_they_take() -> None:
    planner = hn.HybridPlanner(ROOMS, preset="robot")
    plain, result = planner.plan(START, GOAL), planner.plan((*START, 2.0), (*GOAL, -1.57))
    path: Any = result.path
    limits = result.limits
    assert limits == MotionLimits()
    assert LimitSettings().model_dump() == {
        each.name: each.default for each in fields(MotionLimits)
    }
    profile = path.profile(limits)
    assert result.duration_s == pytest.approx(profile.duration_s)
    np.testing.assert_allclose(profile.poses[[0, -1]], [(*START, 2.0), (*GOAL, -1.57)], atol=1e-6)
    # The turns at both ends come on top, from standstill to standstill.
    yaws = profile.poses[[0, 1, -2, -1], 2]
    ends = [abs(turned(yaws[1] - yaws[0])), abs(turned(yaws[3] - yaws[2]))]
    assert plain.duration_s is not None
    more = sum(spot_seconds(float(angle), limits) for angle in ends)
    assert result.duration_s == pytest.approx(plain.duration_s + more, abs=1e-3)
    check_length(path)
    told = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert told["duration_s"] == result.duration_s
    copy, again = pickle.loads(pickle.dumps((result, profile)))  # noqa: S301 - made here
    assert "duration_s" not in vars(copy)
    assert copy.duration_s == result.duration_s
    np.testing.assert_array_equal(again.time_s, profile.time_s)


def test_other_limits_are_set_in_a_preset_and_without_any_there_is_no_duration() -> None:
    slow = load_preset("robot", overrides=["limits.max_speed_m_s=0.1"])
    planner = hn.HybridPlanner(ROOMS, preset=slow)
    result = planner.plan(START, GOAL)
    assert result.limits == MotionLimits(max_speed_m_s=0.1)
    assert result.duration_s is not None
    assert result.duration_s > result.path.length_m / 0.1
    shortest = hn.HybridPlanner(ROOMS).plan(START, GOAL)
    assert (shortest.limits, shortest.duration_s) == (None, None)
    assert shortest.to_dict()["duration_s"] is None
    both = load_preset("shortest", overrides=["limits.max_speed_m_s=0.1"])
    timed = hn.HybridPlanner(ROOMS, preset=both)
    assert timed.plan(START, GOAL).duration_s is not None
    assert timed.plan((-9.0, 0.0), GOAL).duration_s is None
    tour = hn.plan_tour(timed, [START, GOAL, START])
    assert tour.duration_s == pytest.approx(sum(each.duration_s or 0 for each in tour.results))
    assert tour.to_dict()["duration_s"] == tour.duration_s


@pytest.mark.parametrize(
    ("setting", "word"),
    [
        ("limits.max_speed_m_s=0", "limits.max_speed_m_s: should be greater than 0"),
        ("limits.max_speed_m_s=.inf", "limits.max_speed_m_s: should be a finite number"),
        ("limits.max_speed_m_s=yes", "limits.max_speed_m_s: should be a number"),
        ("limits.speed=1", "limits.speed: unknown key; known are max_speed_m_s, "),
        ("limits=1", "section.key=value"),
    ],
)
@pytest.mark.parametrize("preset", ["robot", "shortest"])
def test_limits_of_a_preset_that_are_none_are_refused(preset: str, setting: str, word: str) -> None:
    with pytest.raises(hn.errors.PresetError) as caught:
        load_preset(preset, overrides=[setting])
    assert word in str(caught.value)
