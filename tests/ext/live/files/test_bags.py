"""Bags of ROS 1 and ROS 2: maps and scans out of them, plans into them, damaged ones and bombs."""

import bz2
import cmath
import math
import struct
import sys
import tracemalloc
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from lz4.frame import compress as lz4_compress  # type: ignore[import-untyped]
from rosbags.highlevel import AnyReader
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore
from scipy.spatial.transform import Rotation

import hybridnav as hn
from hybridnav.ext.live.files import bag_files
from hybridnav.ext.live.files.bag_files import Transforms
from tests.ext.live.files.bag_writer import GRID, KINDS, BagWriter
from tests.ext.live.files.drive import (
    BEGAN,
    LASER,
    SECOND,
    about_z,
    base_at,
    driven,
    laser_at,
    stamp,
)
from tests.layers import grid_of
from tests.strategies import seeds, tried


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("case", ["plain", "flipped", "odometry"])
def test_scans_have_the_poses_of_the_transforms(kind: str, case: str, tmp_path: Path) -> None:
    bag = driven(kind, flipped=case == "flipped", odometry=case == "odometry")
    log = hn.ext.live.BagLog(bag.write(tmp_path))
    scans = list(log)
    assert len(scans) == log.n_scans == 40
    assert log.summary() == "left out 0 of 40 scans"
    assert log.bytes_read == log.size_bytes > 1000
    for index, scan in enumerate(scans):
        seconds = 0.05 + index / 10
        place, heading = laser_at(seconds)
        assert scan.time_s == pytest.approx(BEGAN / SECOND + seconds, abs=1e-6)
        assert scan.pose[:2] == pytest.approx((place.real, place.imag), abs=1e-3)
        assert cmath.exp(1j * (scan.pose[2] - heading)) == pytest.approx(1, abs=1e-6)
        # Every beam ends on a wall.
        angles = scan.pose[2] + scan.start_rad + scan.step_rad * np.arange(90)
        ends = complex(*scan.pose[:2]) + scan.ranges_m * np.exp(1j * angles)
        away = np.minimum(np.abs(np.abs(ends.real) - 4), np.abs(np.abs(ends.imag) - 3))
        assert away.max() < 5e-3
        assert scan.max_range_m == 30
    assert [scan.pose for scan in log] == [scan.pose for scan in scans]  # read again


def test_the_frame_of_the_poses_can_be_chosen(tmp_path: Path) -> None:
    path = driven("mcap").write(tmp_path)
    in_odom = next(iter(hn.ext.live.BagLog(path, frame="odom")))
    place, yaw = base_at(0.05)
    place += LASER[0] * cmath.exp(1j * yaw)
    assert in_odom.pose[:2] == pytest.approx((place.real, place.imag), abs=1e-3)
    assert list(hn.ext.live.BagLog(path, frame="moon")) == []
    log = hn.ext.live.BagLog(path, frame="moon")
    assert not list(log)
    assert log.skipped == {"no transforms from laser to moon": 40}


@tried(60, st.data())
def test_rotations_are_blended_evenly_about_one_axis(data: st.DataObject) -> None:
    """Between two rotations, by the matrix exponential of scipy."""
    numbers = st.floats(-1, 1)
    turns = [np.array(data.draw(st.tuples(*[numbers] * 4))) for _ in range(2)]
    if min(map(np.linalg.norm, turns)) < 0.1:
        return
    turns = [turn / np.linalg.norm(turn) for turn in turns]
    if abs(turns[0] @ turns[1]) < 1e-3:  # half a turn apart: two ways are as short
        return
    part = data.draw(st.floats(0, 1))
    moves = [np.array(data.draw(st.tuples(*[st.floats(-9, 9)] * 3))) for _ in range(2)]
    bag = BagWriter("mcap")
    transforms = Transforms()
    for at, turn, move in zip((0, 1000), turns, moves, strict=True):
        bag.add_tf("a", "b", at, move, turn)
        transforms.add_message(bag.messages[-1][-1], is_static=False)
    at = round(1000 * part)
    rotation, place = transforms.pose("b", "a", at)
    first, last = map(Rotation.from_quat, turns)
    between = Rotation.from_rotvec((last * first.inv()).as_rotvec() * at / 1000) * first
    assert np.allclose(rotation, between.as_matrix(), atol=1e-7)
    assert np.allclose(place, moves[0] + (moves[1] - moves[0]) * at / 1000)


def test_faults_of_scans_are_left_out_and_counted(tmp_path: Path) -> None:
    bag = driven("ros1")
    plain = [2.0] * 90
    bag.add_scan(stamp(9.0), plain)  # after the last transform
    bag.add_scan(stamp(1.01), plain, frame="camera")
    bag.add_scan(stamp(1.02), plain, angle_min=math.nan)
    bag.add_scan(stamp(1.03), plain, range_min=math.nan)
    bag.add_scan(stamp(1.04), plain, angle_increment=1e9)
    bag.add_tf("base", "tilted", stamp(0), (0, 0, 0), (0.5, 0, 0, math.sqrt(0.75)), "/tf_static")
    bag.add_scan(stamp(1.06), plain, frame="tilted")
    log = hn.ext.live.BagLog(bag.write(tmp_path))
    assert sum(1 for _ in log) == 40
    assert log.skipped == {
        "no transform at its time": 1,
        "no transforms from camera to map": 1,
        "pose, angle, time or range out of range": 3,
        "laser tilted": 1,
    }


def test_readings_that_are_none_are_told_apart(tmp_path: Path) -> None:
    bag = driven("mcap")
    bag.messages = [each for each in bag.messages if each[0] != "/scan"]
    bag.add_scan(stamp(1), [math.nan, math.inf, -math.inf, 0.05, 0.2, 29.0], range_max=math.inf)
    (scan,) = hn.ext.live.BagLog(bag.write(tmp_path))
    assert np.isnan(scan.ranges_m[[0, 2, 3]]).all()
    assert scan.ranges_m[[1, 4, 5]] == pytest.approx([math.inf, 0.2, 29.0])
    assert scan.max_range_m == math.inf


def test_a_signalling_nan_is_no_reading(tmp_path: Path) -> None:
    bag = driven("mcap")
    bag.messages = [each for each in bag.messages if each[0] != "/scan"]
    odd = np.array([0x7F800001, 0x40000000], np.uint32).view(np.float32)
    bag.add_scan(stamp(1), [1.0, 2.0])
    bag.messages[-1][-1].ranges[:] = odd
    (scan,) = hn.ext.live.BagLog(bag.write(tmp_path))
    assert np.isnan(scan.ranges_m[0])
    assert scan.ranges_m[1] == 2


def test_wrong_transforms_are_left_out_and_counted(tmp_path: Path) -> None:
    bag = driven("sqlite3")
    at = stamp(1.05)
    bag.add_tf("odom", "base", at, (math.nan, 0, 0), about_z(0))
    bag.add_tf("odom", "base", at, (9e9, 0, 0), (0, 0, 0, 0))
    bag.add_tf("odom", "base", at, (9e9, 0, 0), (0, 0, 2, 0))
    bag.add_tf("base", "base", at, (1, 0, 0), about_z(0))
    bag.add_tf("", "base", at, (1, 0, 0), about_z(0))
    log = hn.ext.live.BagLog(bag.write(tmp_path))
    assert sum(1 for _ in log) == 40
    assert log.summary() == "left out 0 of 40 scans; 5 transforms are wrong"


def test_frames_in_a_circle_are_left_out(tmp_path: Path) -> None:
    bag = BagWriter("mcap")
    for second in range(5):
        for parent, child in (("a", "laser"), ("b", "a"), ("laser", "b")):
            bag.add_tf(parent, child, stamp(second), (1, 0, 0), about_z(0))
        bag.add_scan(stamp(second), [1.0] * 9)
    log = hn.ext.live.BagLog(bag.write(tmp_path))
    assert list(log) == []
    assert log.skipped == {"frames in a circle": 5}


def test_scans_without_any_motion_of_the_robot_make_no_map(tmp_path: Path) -> None:
    """A bag without odometry: all scans would lie on one another."""
    bag = BagWriter("mcap")
    bag.add_tf("base", "laser", stamp(0), (0, 0, 0), about_z(0), "/tf_static")
    bag.add_scan(stamp(1), [1.0] * 9)
    log = hn.ext.live.BagLog(bag.write(tmp_path))
    assert list(log) == []
    assert log.skipped == {"no transforms of a robot that moves above laser": 1}
    (scan,) = hn.ext.live.BagLog(tmp_path / "drive", frame="base")  # asked for by name
    assert scan.pose == (0, 0, 0)


def test_the_root_is_the_frame_where_no_usual_one_is(tmp_path: Path) -> None:
    bag = BagWriter("mcap")
    for second in range(3):
        bag.add_tf("world", "laser", stamp(second), (second, 0, 0), about_z(0))
    bag.add_scan(stamp(0.5), [1.0] * 9)
    (scan,) = hn.ext.live.BagLog(bag.write(tmp_path))
    assert scan.pose == pytest.approx((0.5, 0, 0))


def test_the_topic_must_be_one_of_scans(tmp_path: Path) -> None:
    bag = driven("mcap")
    bag.add_scan(stamp(1), [1.0] * 9, topic="/rear")
    path = bag.write(tmp_path)
    with pytest.raises(
        hn.errors.MapError, match=r"expected a topic of .*LaserScan, got /rear, /scan: name"
    ):
        hn.ext.live.BagLog(path)
    with pytest.raises(hn.errors.MapError, match="expected topic '/tf' of"):
        hn.ext.live.BagLog(path, topic="/tf")
    assert sum(1 for _ in hn.ext.live.BagLog(path, topic="/scan")) == 40
    with pytest.raises(
        hn.errors.MapError, match=r"got no topic of that type; topics: /odom|topics: .*/rear, /scan"
    ):
        hn.ext.live.load_bag_map(path)


# --- maps and plans -----------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
@tried(16, data=st.data())
def test_maps_survive_a_round_trip(tmp_path_factory, kind, data):
    shape = data.draw(st.tuples(st.integers(1, 9), st.integers(1, 9)))
    rng = np.random.default_rng(data.draw(seeds))
    percent = rng.integers(-1, 101, shape)
    probability = np.where(percent < 0, np.nan, percent / 100)
    side = data.draw(st.sampled_from([0.05, 0.1, 0.3, 1.0]))
    frame = hn.Frame(side, (data.draw(st.floats(-99, 99)), 2.0), data.draw(st.floats(-3, 3)))
    grid = grid_of(probability, frame, robot_radius_m=0)
    folder = tmp_path_factory.mktemp("bag")
    path = folder / ("m.bag" if kind == "ros1" else "m")
    hn.ext.live.save_bag(
        path, grid=grid, storage=kind if kind != "ros1" else "mcap", stamp_ns=BEGAN
    )
    again = hn.ext.live.load_bag_map(path, robot_radius_m=0)
    assert (again.classes == grid.classes).all()
    assert np.allclose(again.probability, grid.probability, atol=1e-7, equal_nan=True)
    assert again.resolution_m == grid.resolution_m  # though messages hold it in 32 bits
    corners = [[0, 0], [shape[0], shape[1]]]
    assert np.allclose(again.frame.points_of_grid(corners), frame.points_of_grid(corners))
    assert again.name == "map"
    inside = path if kind == "ros1" else next(path.glob("*.mcap" if kind == "mcap" else "*.db3"))
    assert (hn.ext.live.load_bag_map(inside, robot_radius_m=0).classes == grid.classes).all()


@pytest.mark.parametrize("kind", KINDS)
def test_plans_are_read_by_others_as_they_were_written(kind: str, tmp_path: Path) -> None:
    grid = hn.example_map("figure1")
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    first = planner.plan((0.5, 0.5), (2.0, 2.5))
    tour = hn.plan_tour(planner, [(0.5, 0.5), (1.5, 0.5), (0.5, 0.5)])
    nothing = planner.plan((0.5, 0.5), (99.0, 0.5))
    path = tmp_path / ("p.bag" if kind == "ros1" else "p")
    storage = "sqlite3" if kind == "sqlite3" else "mcap"
    plans: Any = [first, nothing, tour]
    hn.ext.live.save_bag(path, plans, grid=grid, frame="floor", stamp_ns=BEGAN, storage=storage)
    expected = [result.path for result in (first, *tour.results)]
    with AnyReader([path]) as reader:
        assert {each.topic for each in reader.connections} == {"/plan", "/map"}
        messages = [
            (connection.topic, stamp_ns, reader.deserialize(raw, connection.msgtype))
            for connection, stamp_ns, raw in reader.messages()
        ]
        kept = next(each.ext for each in reader.connections if each.topic == "/map")
    assert messages[0][0] == "/map"
    assert getattr(kept, "latching", 1) == 1
    found: Any = [each for each in messages if each[0] == "/plan"]
    assert [stamp_ns for _, stamp_ns, _ in found] == [BEGAN + i * SECOND for i in range(3)]
    for planned, (_, stamp_ns, message) in zip(expected, found, strict=True):
        poses = planned.poses(0.05)
        assert message.header.frame_id == "floor"
        assert message.header.stamp.sec * SECOND + message.header.stamp.nanosec == stamp_ns
        at = [(each.pose.position.x, each.pose.position.y) for each in message.poses]
        assert np.array_equal(at, poses[:, :2])
        turns = [each.pose.orientation for each in message.poses]
        assert np.allclose([2 * math.atan2(q.z, q.w) for q in turns], poses[:, 2])
        assert all(each.header.frame_id == "floor" for each in message.poses)


def test_the_last_map_of_a_topic_counts_and_topics_are_named(tmp_path: Path) -> None:
    bag = BagWriter("ros1")
    store = bag.store
    for at, value in enumerate((0, 100)):
        for topic in ("/map", "/costmap"):
            origin = bag.make(
                "geometry_msgs/Pose",
                position=bag.make("geometry_msgs/Point", x=0.0, y=0.0, z=0.0),
                orientation=bag.quaternion((0, 0, 0, 1)),
            )
            header = bag.header("map", at)
            info = bag.make(
                "nav_msgs/MapMetaData",
                map_load_time=header.stamp,
                resolution=0.5,
                width=1,
                height=1,
                origin=origin,
            )
            data = np.array([value if topic == "/map" else 50], np.int8)
            message = store.types[GRID](header=header, info=info, data=data)
            bag.add(topic, GRID, at, message)
    path = bag.write(tmp_path)
    assert hn.ext.live.load_bag_map(path, robot_radius_m=0).classes.tolist() == [[0]]
    assert hn.ext.live.load_bag_map(path, topic="/costmap", robot_radius_m=0).classes.tolist() == [
        [2]
    ]
    out_of_range: list[dict[str, Any]] = [{"robot_radius_m": -1.0}, {"free_threshold": 0.9}]
    for wrong in out_of_range:  # no fault of the bag
        with pytest.raises(hn.errors.InvalidValueError, match="must") as refused:
            hn.ext.live.load_bag_map(path, **wrong)
        assert str(path) not in str(refused.value)
    with pytest.raises(
        hn.errors.MapError, match="expected topic '/floor' of nav_msgs/OccupancyGrid, got"
    ):
        hn.ext.live.load_bag_map(path, topic="/floor")
    # A last map of 0 x 0 cells does not make the bag useless.
    empty = bag.make(
        "nav_msgs/MapMetaData",
        map_load_time=header.stamp,
        resolution=0.5,
        width=0,
        height=0,
        origin=origin,
    )
    message = store.types[GRID](header=header, info=empty, data=np.zeros(0, np.int8))
    bag.add("/map", GRID, 2, message)
    (tmp_path / "again").mkdir()
    path = bag.write(tmp_path / "again")
    with pytest.warns(hn.errors.MapWarning, match=r"the last map is wrong .*, taken is the last"):
        grid = hn.ext.live.load_bag_map(path, robot_radius_m=0)
    assert grid.classes.tolist() == [[0]]


def test_a_map_without_a_yaw_takes_the_stated_one(tmp_path: Path, cli: Any) -> None:
    bag = BagWriter("mcap")
    values = hn.OccupancyGrid(np.zeros((1, 1), np.float32)).to_message()
    origin = bag.make(
        "geometry_msgs/Pose",
        position=bag.make("geometry_msgs/Point", x=0.0, y=0.0, z=0.0),
        orientation=bag.quaternion((0, 0, 0, 0)),
    )
    header = bag.header("map", 0)
    info = values["info"] | {"map_load_time": header.stamp, "origin": origin}
    message = bag.make(
        "nav_msgs/OccupancyGrid",
        header=header,
        info=bag.make("nav_msgs/MapMetaData", **info),
        data=np.zeros(1, np.int8),
    )
    bag.add("/floor", GRID, 0, message)
    path = bag.write(tmp_path)
    with pytest.raises(
        hn.errors.MapError, match=r"bag .*drive, /floor: .* quaternion of zeros.*; state .*--yaw"
    ) as error:
        hn.ext.live.load_bag_map(path)
    assert "\n" not in str(error.value)
    with pytest.warns(hn.errors.MapWarning, match=r"drive, /floor: .* taken is the stated yaw 0.5"):
        grid = hn.ext.live.load_bag_map(path, yaw_rad=0.5, robot_radius_m=0)
    assert grid.frame.yaw_rad == pytest.approx(0.5)
    with pytest.raises(hn.errors.InvalidValueError, match="yaw_rad"):
        hn.ext.live.load_bag_map(path, yaw_rad=math.nan)
    out = tmp_path / "floor.yaml"
    call = ("map", path, "--topic", "/floor", "-o", out)
    assert cli(*call).refuses(3, "quaternion of zeros", "--yaw")
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        done = cli(*call, "--yaw", "0")
    assert (done.code, done.err.count("\n")) == (0, 1)
    assert "the quaternion of the origin is zero, taken is the stated yaw 0" in done.err
    assert "origin: [0.0, 0.0, 0.0]" in out.read_text()
    assert cli("map", path, "-o", tmp_path / "b.yaml", "--yaw", "0").refuses(2, "--yaw goes with")


# --- what cannot be read or written -------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_bags_end_in_one_line_or_keep_what_is_whole(kind: str, tmp_path: Path) -> None:
    path = driven(kind).write(tmp_path)
    file = path if kind == "ros1" else next(each for each in path.iterdir() if each.stem == "drive")
    whole = file.read_bytes()
    rng = np.random.default_rng(1)
    for _ in range(25):
        damaged = bytearray(whole)
        if rng.random() < 0.4:
            damaged = damaged[: rng.integers(len(whole))]
        else:
            for at in rng.integers(0, len(whole), 20):
                damaged[at] = rng.integers(256)
        file.write_bytes(bytes(damaged))
        message = ""
        try:
            n_scans = sum(1 for _ in hn.ext.live.BagLog(path))
        except hn.errors.MapError as error:
            message = str(error)
        assert "\n" not in message
        assert len(message) < 400
        assert message or n_scans <= 40


@pytest.mark.parametrize("name", ["a.bag", "a.mcap", "a.db3", "a.txt"])
@pytest.mark.parametrize("content", [b"", b"#ROSBAG V2.0\n", bytes(range(256)) * 40])
def test_files_that_are_no_bags_end_in_one_line(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    for load in (hn.ext.live.load_bag_map, hn.ext.live.BagLog):
        with pytest.raises(hn.errors.MapError, match="no bag, or damaged") as error:
            load(tmp_path / name)
        assert "\n" not in str(error.value)
    with pytest.raises(hn.errors.MapNotFoundError, match="no such file or folder"):
        hn.ext.live.BagLog(tmp_path / "none.bag")
    (tmp_path / "folder").mkdir()
    with pytest.raises(hn.errors.MapError, match="no bag"):
        hn.ext.live.load_bag_map(tmp_path / "folder")


def test_what_cannot_be_written_is_refused_in_one_line(tmp_path: Path) -> None:
    grid = hn.example_map("figure1")
    with pytest.raises(hn.errors.InvalidValueError, match="nothing to write"):
        hn.ext.live.save_bag(tmp_path / "a.bag")
    with pytest.raises(hn.errors.InvalidValueError, match="nothing to write"):
        hn.ext.live.save_bag(tmp_path / "a.bag", [hn.PlanResult(hn.PlanStatus.NO_PATH)])
    with pytest.raises(hn.errors.InvalidValueError, match="storage must be one of"):
        hn.ext.live.save_bag(tmp_path / "a", grid=grid, storage="zip")
    with pytest.raises(hn.errors.InvalidValueError, match="name of a frame"):
        hn.ext.live.save_bag(tmp_path / "a", grid=grid, frame="")
    with pytest.raises(hn.errors.InvalidValueError, match="expected a PlanResult"):
        hn.ext.live.save_bag(tmp_path / "a", ["plan"])  # type: ignore[list-item]
    with pytest.raises(hn.errors.InvalidValueError, match="expected an OccupancyGrid"):
        hn.ext.live.save_bag(tmp_path / "a", grid="map")  # type: ignore[arg-type]
    (tmp_path / "taken").mkdir()
    with pytest.raises(hn.errors.MapError, match="cannot write: File name too long"):
        hn.ext.live.save_bag(tmp_path / ("long" * 99), grid=hn.example_map("figure1"))
    with pytest.raises(hn.errors.MapError, match="the name is taken"):
        hn.ext.live.save_bag(tmp_path / "taken", grid=grid)
    (tmp_path / "file").write_text("")
    with pytest.raises(hn.errors.MapError, match="cannot write"):
        hn.ext.live.save_bag(tmp_path / "file" / "bag", grid=grid)
    with pytest.raises(hn.errors.MapError, match="cannot write"):
        hn.ext.live.save_bag(tmp_path / "none" / "a.bag", grid=grid)
    assert not (tmp_path / "a").exists()
    assert not (tmp_path / "a.bag").exists()


def test_without_rosbags_one_line_says_how_to_get_it(tmp_path, monkeypatch):
    (tmp_path / "a.bag").write_bytes(b"")
    monkeypatch.setitem(sys.modules, "rosbags", None)
    monkeypatch.setitem(sys.modules, "rosbags.highlevel", None)
    needs = r"rosbags is needed, .*pip install 'hybridnav\[bags\]'"
    with pytest.raises(hn.errors.MapError, match=needs):
        hn.ext.live.BagLog(tmp_path / "a.bag")
    with pytest.raises(hn.errors.MapError, match=needs):
        hn.ext.live.save_bag(tmp_path / "b.bag", grid=hn.example_map("figure1"))


LIMIT = 1 << 20
BOMB = 1 << 27


def grid_message(store, data):
    make = lambda name, **values: store.types[name](**values)  # noqa: E731
    stamp = make("builtin_interfaces/msg/Time", sec=0, nanosec=0)
    point = make("geometry_msgs/msg/Point", x=0.0, y=0.0, z=0.0)
    turn = make("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
    info = make(
        "nav_msgs/msg/MapMetaData",
        map_load_time=stamp,
        resolution=0.05,
        width=data.shape[1],
        height=data.shape[0],
        origin=make("geometry_msgs/msg/Pose", position=point, orientation=turn),
    )
    seq = {"seq": 0} if "seq" in store.types["std_msgs/msg/Header"].__dataclass_fields__ else {}
    header = make("std_msgs/msg/Header", **seq, stamp=stamp, frame_id="map")
    return make("nav_msgs/msg/OccupancyGrid", header=header, info=info, data=data.ravel())


def bag_of(folder: Path, kind: str, data) -> Path:
    """A bag of one map, packed as `kind` states."""
    container, packing = kind.split("-")
    name = "nav_msgs/msg/OccupancyGrid"
    if container == "ros1":
        store = get_typestore(Stores.ROS1_NOETIC)
        path = folder / "map.bag"
        writer: Any = Writer1(path)
        writer.set_compression(getattr(Writer1.CompressionFormat, packing.upper()))
        pack = store.serialize_ros1
    else:
        store = get_typestore(Stores.ROS2_HUMBLE)
        path = folder / "map"
        plugin = StoragePlugin.MCAP if container == "mcap" else StoragePlugin.SQLITE3
        writer = Writer(path, version=9, storage_plugin=plugin)
        writer.set_compression(getattr(CompressionMode, packing.upper()), CompressionFormat.ZSTD)
        pack = store.serialize_cdr
    with writer:
        connection = writer.add_connection("/map", name, typestore=store)
        writer.write(connection, 1, pack(grid_message(store, data), name))
    return path


PACKED = ("ros1-bz2", "ros1-lz4", "mcap-storage", "mcap-message", "mcap-file", "sqlite3-file")


def refused(bag, match):
    """Check that a bag ends in one line, in little memory; return the line."""
    tracemalloc.start()
    with pytest.raises(hn.errors.MapError, match=match) as error:
        hn.ext.live.load_bag_map(bag)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < BOMB // 4
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("kind", PACKED)
def test_a_map_that_unpacks_to_too_much_ends_in_one_line(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(bag_files, "MOST_BYTES", LIMIT)
    monkeypatch.setattr(bag_files, "MOST_TIMES", 2)
    small = bag_of(tmp_path, kind, np.zeros((40, 60), np.int8))
    assert hn.ext.live.load_bag_map(small).shape == (40, 60)
    (tmp_path / "bomb").mkdir()
    bomb = bag_of(tmp_path / "bomb", kind, np.zeros((BOMB >> 13, 1 << 13), np.int8))
    size = sum(file.stat().st_size for file in [bomb, *bomb.parent.rglob("*")] if file.is_file())
    assert size < BOMB // 50
    line = refused(bomb, r"map.*: .* unpacks to more than 1 MiB")
    assert len(line) < 300


@pytest.mark.parametrize("packing", ["lz4", "zstd"])
def test_a_chunk_that_states_too_small_a_size_is_stopped_there(packing, tmp_path):
    # The chunk of a sound bag is replaced by one of many zeros that states the old size.
    from backports import zstd

    path = bag_of(tmp_path, "mcap-storage", np.zeros((40, 60), np.int8))
    (file,) = path.glob("*.mcap")
    whole = file.read_bytes()
    at = whole.index(struct.pack("<I", 4) + b"zstd") - 28 - 9
    assert whole[at] == 6  # a record of the kind chunk
    times = whole[at + 9 : at + 9 + 28]
    pack = {"lz4": lz4_compress, "zstd": zstd.compress}[packing]
    packed = pack(bytes(BOMB))
    content = times + struct.pack("<I", len(packing)) + packing.encode()
    content += struct.pack("<Q", len(packed)) + packed
    alone = whole[:at] + b"\x06" + struct.pack("<Q", len(content)) + content
    file = tmp_path / "alone.mcap"
    file.write_bytes(alone)
    refused(file, r"alone\.mcap: ")


def test_frames_one_after_another_are_unpacked_up_to_the_limit():
    frames = bz2.compress(b"one ") + bz2.compress(b"two")
    assert bag_files.unpacked(bz2.BZ2Decompressor, frames, "it", 7) == b"one two"
    with pytest.raises(bag_files.TooLargeError, match="it unpacks to more than"):
        bag_files.unpacked(bz2.BZ2Decompressor, frames, "it", 6)
    with pytest.raises(EOFError):
        bag_files.unpacked(bz2.BZ2Decompressor, frames[:-3], "it", 100)
    with pytest.raises(EOFError):
        bag_files.unpacked(bz2.BZ2Decompressor, bz2.compress(b"") * 20_000, "it", 100)
