"""Grids and paths as messages of ROS, without ROS: round trips, rotations, hostile messages."""

import array
import json
import math
import tracemalloc
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.messages import pose_message, quaternion_of, tilt_of, yaw_of
from tests.layers import grid_of
from tests.strategies import tried

ZEROS = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0}


def message(data: Any, cols: Any, rows: Any, resolution: Any = 1.0, **origin: Any) -> Any:
    """A message by hand, as a mapping."""
    pose = {"position": {"x": 0.0, "y": 0.0, "z": 0.0}, "orientation": ZEROS | {"w": 1.0}} | origin
    info = {"resolution": resolution, "width": cols, "height": rows, "origin": pose}
    return {"header": {"frame_id": "map"}, "info": info, "data": data}


def as_object(value: Any) -> Any:
    """The same message as an object with attributes, as rclpy and rospy have them."""
    if isinstance(value, dict):
        return SimpleNamespace(**{key: as_object(item) for key, item in value.items()})
    return value


def euler(roll: float, pitch: float, yaw: float) -> Any:
    """The rotation about x, then y, then z."""
    cx, sx, cy, sy = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    cz, sz = math.cos(yaw), math.sin(yaw)
    about_x = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    about_y = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    about_z = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def hamilton(a: Any, b: Any) -> tuple[float, float, float, float]:
    """The product of two quaternions x, y, z, w."""
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


@tried(120, st.data())
def test_values_and_frame_survive_a_round_trip(data: st.DataObject) -> None:
    rows, cols = data.draw(st.integers(1, 8)), data.draw(st.integers(1, 8))
    values = data.draw(st.lists(st.integers(-1, 100), min_size=rows * cols, max_size=rows * cols))
    yaw = data.draw(st.floats(-math.pi, math.pi))
    x, y = data.draw(st.floats(-1e6, 1e6)), data.draw(st.floats(-1e6, 1e6))
    side = data.draw(st.floats(1e-3, 100))
    given_message = message(values, cols, rows, side, **pose_message((x, y, yaw)))
    low, high = sorted(
        data.draw(st.lists(st.integers(0, 100), min_size=2, max_size=2, unique=True))
    )
    grid = hn.OccupancyGrid.from_message(
        as_object(given_message) if data.draw(st.booleans()) else given_message,
        robot_radius_m=0,
        free_threshold=low / 100,
        occupied_threshold=high / 100,
    )
    flat = np.array(values)
    kinds = np.where(flat <= low, hn.CellClass.FREE, hn.CellClass.UNEXPLORED)
    kinds = np.where(flat >= high, hn.CellClass.OCCUPIED, kinds)
    kinds[flat < 0] = hn.CellClass.UNEXPLORED
    assert (grid.classes == kinds.reshape(rows, cols)).all()
    assert grid.frame.origin_m == (x, y)
    assert math.isclose(math.cos(grid.frame.yaw_rad - yaw), 1, abs_tol=1e-9)
    back = json.loads(json.dumps(grid.to_message("floor", stamp_ns=3_000_000_007)))
    assert back["data"] == values
    assert back["info"] | {"origin": 0} == {
        "map_load_time": {"sec": 3, "nanosec": 7},
        "resolution": grid.resolution_m,
        "width": cols,
        "height": rows,
        "origin": 0,
    }
    assert back["header"] == {"stamp": {"sec": 3, "nanosec": 7}, "frame_id": "floor"}
    again = hn.OccupancyGrid.from_message(back, robot_radius_m=0)
    assert np.allclose(again.frame.points_of([0, 0]), grid.frame.points_of([0, 0]), rtol=1e-12)


@tried(80, st.data())
def test_no_cell_changes_its_class_by_rounding(data: st.DataObject) -> None:
    thresholds = sorted(data.draw(st.lists(st.floats(0, 1), min_size=2, max_size=2, unique=True)))
    if np.float32(thresholds[0]) == np.float32(thresholds[1]):
        return
    occupancies = st.floats(0, 1, width=32) | st.sampled_from([*thresholds, math.nan])
    probability = np.array([data.draw(st.lists(occupancies, min_size=1, max_size=20))])
    both: Any = dict(zip(("free_threshold", "occupied_threshold"), thresholds, strict=True))
    grid = grid_of(probability, robot_radius_m=0, **both)
    again = hn.OccupancyGrid.from_message(grid.to_message(), robot_radius_m=0, **both)
    assert (again.classes == grid.classes).all()


@pytest.mark.parametrize(
    "data",
    [
        (0, -1, 100),
        array.array("b", [0, -1, 100]),
        np.array([0, -1, 100], np.int8),
        np.array([0, -1, 100], np.int64),
    ],
)
def test_data_may_be_any_sequence_of_integers(data: Any) -> None:
    grid = hn.OccupancyGrid.from_message(message(data, 3, 1), robot_radius_m=0)
    assert grid.classes.tolist() == [[1, 2, 0]]


def test_a_resolution_in_float32_is_the_decimal_number_that_was_meant() -> None:
    sent = float(np.float32(0.05))
    assert sent != 0.05
    frame = hn.OccupancyGrid.from_message(message([0], 1, 1, sent)).frame
    assert frame == hn.Frame(0.05)


def test_yaw_of_a_rotated_origin_turns_the_cells() -> None:
    half = {"x": 0.0, "y": 0.0, "z": math.sqrt(0.5), "w": math.sqrt(0.5)}
    place = {"position": {"x": 10.0, "y": 5.0, "z": 3.0}, "orientation": half}
    grid = hn.OccupancyGrid.from_message(message([0, 100], 2, 1, 2.0, **place), robot_radius_m=0)
    # A quarter turn: columns run along y. The second cell lies 3 m up and 1 m to the left.
    assert grid.frame.points_of([0, 1]) == pytest.approx([9.0, 8.0])


@tried(200, *[st.floats(-math.pi, math.pi)] * 3)
def test_yaw_and_tilt_are_those_of_the_rotation(roll: float, pitch: float, yaw: float) -> None:
    parts = [
        (math.sin(roll / 2), 0, 0, math.cos(roll / 2)),
        (0, math.sin(pitch / 2), 0, math.cos(pitch / 2)),
        (0, 0, math.sin(yaw / 2), math.cos(yaw / 2)),
    ]
    x, y, z, w = hamilton(parts[2], hamilton(parts[1], parts[0]))
    found = quaternion_of({"q": {"x": x, "y": y, "z": z, "w": w}}, "q", "test")
    turned = euler(roll, pitch, yaw)
    assert math.cos(tilt_of(found)) == pytest.approx(turned[2, 2], abs=1e-9)
    if math.hypot(turned[0, 0], turned[1, 0]) > 1e-6:  # else the x axis is vertical
        expected = math.atan2(turned[1, 0], turned[0, 0])
        assert math.cos(yaw_of(found) - expected) == pytest.approx(1, abs=1e-9)


@given(st.floats(0.99, 1.01))
def test_lengths_near_1_are_made_1(length: float) -> None:
    q = {"x": 0.0, "y": 0.0, "z": 0.6 * length, "w": 0.8 * length}
    if abs(length**2 - 1) < 0.0099:
        assert math.hypot(*quaternion_of({"q": q}, "q", "test")) == pytest.approx(1, abs=1e-12)
    elif abs(length**2 - 1) > 0.0101:
        with pytest.raises(hn.errors.InvalidValueError, match="unit quaternion"):
            quaternion_of({"q": q}, "q", "test")


def turned(**numbers: float) -> Any:
    return {"orientation": ZEROS | numbers}


HOSTILE = {
    "nothing": (None, "no field info.width"),
    "a list": ([], "no field info.width"),
    "no origin": ({"info": {"width": 1, "height": 1, "resolution": 1}}, "info.origin"),
    "resolution NaN": (message([0], 1, 1, math.nan), "info.resolution must be a finite number"),
    "resolution infinite": (message([0], 1, 1, math.inf), "finite"),
    "resolution 0": (message([0], 1, 1, 0.0), "resolution must be a positive number"),
    "resolution negative": (message([0], 1, 1, -0.05), "resolution must be a positive number"),
    "resolution text": (message([0], 1, 1, "0.05"), "finite number, got '0.05'"),
    "resolution huge": (message([0], 1, 1, 10**400), "finite number"),
    "origin NaN": (message([0], 1, 1, position={"x": math.nan, "y": 0.0}), "position.x"),
    "origin far": (message([0], 1, 1, position={"x": 1e300, "y": 0.0}), "within 1e"),
    "no data": (message([], 1, 1), "data has 0 values, expected width 1 x height 1"),
    "short data": (message([0] * 5, 2, 3), "5 values, expected width 2 x height 3 = 6"),
    "long data": (message([0] * 7, 2, 3), "7 values"),
    "width 0": (message([], 0, 3), "width must be a whole number of 1 or more, got 0"),
    "width negative": (message([0], -1, -1), "got -1"),
    "width a fraction": (message([0], 1.5, 1), "got 1.5"),
    "width huge": (message([0], 2**62, 2**62), "at most"),
    "101": (message([0, 101], 2, 1), r"data\[1\] is 101, expected 0 to 100"),
    "-2": (message([-2], 1, 1), "is -2"),
    "255": (message(np.array([255], np.uint8), 1, 1), "is 255"),
    "floats": (message([0.5], 1, 1), "integers"),
    "text": (message("0", 1, 1), "integers"),
    "bytes": (message(b"0", 1, 1), "integers"),
    "nested": (message([[0]], 1, 1), "flat sequence of integers"),
    "ragged": (message([[0], [0, 0]], 1, 1), "flat sequence of integers"),
    "big integers": (message([10**30], 1, 1), "integers"),
    "data missing": ({"info": message([], 1, 1)["info"]}, "no field data"),
    "zero quaternion": (message([0], 1, 1, **turned()), "quaternion of zeros"),
    "long quaternion": (message([0], 1, 1, **turned(w=2.0)), "length 2, expected a unit"),
    "short quaternion": (message([0], 1, 1, **turned(z=0.1, w=0.1)), "expected a unit"),
    "NaN quaternion": (message([0], 1, 1, **turned(w=math.nan)), "orientation.w"),
    "huge quaternion": (message([0], 1, 1, **turned(w=1e308, z=1e308)), "expected a unit"),
    "rolled": (message([0], 1, 1, **turned(x=0.1, w=math.sqrt(0.99))), "tilted by 0.2"),
    "upside down": (message([0], 1, 1, **turned(x=1.0)), "tilted by 3.14"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_messages_end_in_one_clear_line(name: str) -> None:
    hostile, words = HOSTILE[name]
    with pytest.raises(hn.errors.InvalidValueError, match=words) as error:
        hn.OccupancyGrid.from_message(hostile)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 300


def test_a_message_that_contains_itself_ends_in_one_line() -> None:
    circle: dict[str, Any] = message([0], 1, 1)
    circle["info"]["origin"]["position"] = circle
    with pytest.raises(hn.errors.InvalidValueError, match=r"no field info\.origin\.position\.x"):
        hn.OccupancyGrid.from_message(circle)
    numbers: list[Any] = []
    numbers.append(numbers)
    with pytest.raises(hn.errors.InvalidValueError, match="flat sequence"):
        hn.OccupancyGrid.from_message(message(numbers, 1, 1))


def test_a_size_that_is_too_large_costs_no_memory() -> None:
    tracemalloc.start()
    with pytest.raises(hn.errors.InvalidValueError, match="expected width"):
        hn.OccupancyGrid.from_message(message([0], 10_000, 10_000))
    assert tracemalloc.get_traced_memory()[1] < 1e6
    tracemalloc.stop()


@pytest.mark.parametrize(
    ("frame_id", "stamp_ns", "words"),
    [
        ("", 0, "name of a frame"),
        (7, 0, "name of a frame"),
        ("map", -1, "nanoseconds"),
        ("map", 1.5, "nanoseconds"),
        ("map", 2**31 * 10**9, "nanoseconds"),
    ],
)
def test_headers_hold_what_ros_can_hold(frame_id: Any, stamp_ns: Any, words: str) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match=words):
        grid_of(np.zeros((1, 1))).to_message(frame_id, stamp_ns=stamp_ns)


def test_a_path_is_its_poses_with_a_quaternion_each() -> None:
    points = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]])
    path = hn.Path(np.zeros((3, 2), np.int64), points, 3.0)
    found = path.to_message("floor", spacing_m=0.5, stamp_ns=1_500_000_000)
    header = {"stamp": {"sec": 1, "nanosec": 500_000_000}, "frame_id": "floor"}
    assert found["header"] == header
    assert [pose["header"] for pose in found["poses"]] == [header] * 7
    place = [pose["pose"]["position"] for pose in found["poses"]]
    along = [(0, 0), (0.5, 0), (1, 0), (1.5, 0), (2, 0), (2, 0.5), (2, 1)]
    assert [(p["x"], p["y"], p["z"]) for p in place] == [(x, y, 0) for x, y in along]
    turn = [pose["pose"]["orientation"] for pose in found["poses"]]
    ahead, left = (0, 0, 0, 1), (0, 0, math.sqrt(0.5), math.sqrt(0.5))
    assert np.allclose([list(q.values()) for q in turn], [ahead] * 4 + [left] * 3)
    assert list(turn[0]) == ["x", "y", "z", "w"]
    json.dumps(found, allow_nan=False)


def test_spacing_of_path_messages_is_checked() -> None:
    path = hn.Path(np.zeros((2, 2), np.int64), np.array([[0.0, 0.0], [9.0, 0.0]]), 9.0)
    with pytest.raises(hn.errors.InvalidValueError, match="spacing_m"):
        path.to_message(spacing_m=0.0)


@tried(
    60,
    st.lists(st.tuples(*[st.floats(-1e4, 1e4)] * 3), min_size=1, max_size=6),
    st.floats(500, 5000),
)
def test_poses_are_found_again_in_the_message(poses: Any, spacing: float) -> None:
    """Yaw by the rotation of the x axis: (1 - 2 z z, 2 z w)."""
    points, headings = np.array(poses)[:, :2], np.array(poses)[:, 2]
    length = float(np.hypot(*np.diff(points, axis=0).T).sum())
    path = hn.Path(np.zeros((1, 2), np.int64), points, length, headings)
    found = json.loads(json.dumps(path.to_message(spacing_m=spacing)))["poses"]
    expected = path.poses(spacing)
    assert len(found) == len(expected)
    for (x, y, yaw), each in zip(expected.tolist(), found, strict=True):
        pose = each["pose"]
        assert pose["position"] == {"x": x, "y": y, "z": 0.0}
        q = pose["orientation"]
        assert (q["x"], q["y"]) == (0, 0)
        axis = 1 - 2 * q["z"] ** 2, 2 * q["z"] * q["w"]
        assert axis == pytest.approx((math.cos(yaw), math.sin(yaw)), abs=1e-9)


ANYTHING = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=5)
    | st.binary(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=4), inner, max_size=4)
    ),
    max_leaves=8,
)
LEAVES = (
    ("data",),
    ("info",),
    ("info", "width"),
    ("info", "height"),
    ("info", "resolution"),
    ("info", "origin"),
    ("info", "origin", "position"),
    ("info", "origin", "position", "x"),
    ("info", "origin", "orientation"),
    ("info", "origin", "orientation", "w"),
)


@tried(150, path=st.sampled_from(LEAVES), value=ANYTHING, whole=st.booleans())
def test_whatever_stands_in_a_field_makes_a_grid_or_one_line(path, value, *, whole):
    hostile: Any = value if whole else message([0, 100], 2, 1)
    if not whole:
        inner = hostile
        for name in path[:-1]:
            inner = inner[name]
        inner[path[-1]] = value
    text = ""
    try:
        hn.OccupancyGrid.from_message(hostile)
    except hn.errors.InvalidValueError as error:
        text = str(error)
    assert "\n" not in text
    assert len(text) < 400
