"""Maps and scans of bags of ROS 1 and ROS 2; plans and maps into bags."""

import math
import warnings
from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np

from hybridnav._base.files import printable
from hybridnav._base.trig import atan2, cos, sin
from hybridnav._base.typing import FloatArray, PathLike
from hybridnav.errors import InvalidValueError, MapError, MapWarning
from hybridnav.ext.live.files import bag_files
from hybridnav.ext.live.files.bag_files import check_rosbags
from hybridnav.ext.live.files.scan_log import ScanLog
from hybridnav.ext.live.mapping import LaserScan
from hybridnav.guide import Tour
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.checks import checked_between, checked_radius, checked_thresholds, checked_type
from hybridnav.messages import number_of, stamp_ns_of, value_of
from hybridnav.planning import PlanResult

_MOST_TILT_RAD = 0.1
"""Angle between the vertical and the axis of a laser up to which its scans count as level."""
_MOST_YAW_RAD = 7.0
"""Yaw in radians that may be stated: one turn to either side, and what rounding adds."""
_FIXED = ("map", "odom")
"""Usual names of the frame in which a robot moves, the better first."""


def load_bag_map(  # noqa: PLR0913 - the settings have defaults
    path: PathLike,
    *,
    topic: str | None = None,
    yaw_rad: float | None = None,
    robot_radius_m: float | None = None,
    free_threshold: float = 0.196,
    occupied_threshold: float = 0.65,
) -> OccupancyGrid:
    """Read the last map of a bag of ROS 1 or ROS 2. Needs the extra `bags`; ROS is not needed.

    Parameters
    ----------
    path
        A file (.bag, .mcap, .db3), or the folder of a bag of ROS 2.
    topic
        Topic of `nav_msgs/OccupancyGrid`; None for `/map`, or the only one.
    yaw_rad
        Yaw, in radians, of maps whose origin has the quaternion 0, 0, 0, 0, which states none; None
        to refuse them.
    robot_radius_m, free_threshold, occupied_threshold
        As in `OccupancyGrid`.

    Returns
    -------
    OccupancyGrid
        The map, named after its topic.

    Raises
    ------
    MapNotFoundError
        When there is no such bag.
    MapError
        When it is no bag or damaged, holds no such topic or several, its map is wrong, or rosbags
        is not installed.
    InvalidValueError
        When the radius, the yaw or a threshold is out of range.

    Warns
    -----
    MapWarning
        When the last map is wrong and an earlier one is taken, or `yaw_rad` is.

    Examples
    --------
    >>> from hybridnav.ext.live import load_bag_map, save_bag
    >>> save_bag("office.bag", grid=hn.example_map("office"))
    >>> load_bag_map("office.bag").shape
    (580, 960)
    """
    checked_thresholds(free_threshold, occupied_threshold)
    if robot_radius_m is not None:
        checked_radius(robot_radius_m)
    if yaw_rad is not None:
        yaw_rad = checked_between("yaw_rad", yaw_rad, -_MOST_YAW_RAD, _MOST_YAW_RAD)
    bag = bag_files.Bag(path)
    if topic is None and "/map" in bag.topics_of({bag_files.GRID}):
        topic = "/map"
    topic = bag.topic_of(bag_files.GRID, topic)
    read = partial(
        OccupancyGrid.from_message,
        robot_radius_m=robot_radius_m,
        free_threshold=free_threshold,
        occupied_threshold=occupied_threshold,
        name=topic.strip("/") or "map",
    )
    where, taken = f"{bag.where}, {topic}", bag.last(topic)
    is_blank, doubts = _turned(taken, yaw_rad), []
    try:
        grid = read(taken)
    except InvalidValueError as error:
        fault, good = error, None
        is_asked = is_blank and yaw_rad is None
        hint = "; state its yaw by yaw_rad, --yaw of hybridnav map" if is_asked else ""
        for _, message in bag.messages([topic]):
            of_this = _turned(message, yaw_rad)
            with suppress(InvalidValueError):
                good, is_blank = read(message), of_this
        if good is None:
            raise MapError(f"{where}: {fault}{hint}") from None
        grid = good
        doubts.append(f"the last map is wrong ({fault}{hint}), taken is the last good one")
    if is_blank:
        doubts.append(f"the quaternion of the origin is zero, taken is the stated yaw {yaw_rad:g}")
    for doubt in doubts:
        warnings.warn(f"{where}: {doubt}", MapWarning, stacklevel=2)
    return grid


def _turned(message: Any, yaw_rad: float | None) -> bool:
    """Return whether the quaternion of a map's origin is zero; give it the yaw that is stated."""
    path = "info.origin.orientation"
    with suppress(InvalidValueError):  # a message of another definition, which `read` refuses
        if not any(number_of(message, f"{path}.{axis}", "occupancy grid") for axis in "xyzw"):
            if yaw_rad is not None:
                turn = value_of(message, path, "occupancy grid")
                turn.z, turn.w = sin(yaw_rad / 2), cos(yaw_rad / 2)
            return True
    return False


class BagLog(ScanLog):
    """The laser scans of a bag of ROS 1 or ROS 2, as an iterable. Needs the extra `bags`.

    The pose of a scan is that of its frame at its time, by the transforms of the bag (tf, and
    odometry for frames that they lack). Scans are left out and counted if there is no transform at
    their time, or the laser is tilted by more than 0.1 radians. So are scans that do not follow
    from the ones before (see `ScanSequence`). A laser that hangs upside down is read as such.
    Readings below the scan's `range_min` are none.

    Parameters
    ----------
    path
        A file (.bag, .mcap, .db3), or the folder of a bag of ROS 2.
    topic
        Topic of `sensor_msgs/LaserScan`; None for the only one.
    frame
        Frame in which the robot moves; None for `map`, `odom`, or the root of the transforms,
        whichever is there first.

    Raises
    ------
    MapNotFoundError
        When there is no such bag.
    MapError
        When it is no bag or damaged, holds no such topic or several, or rosbags is not installed.

    Examples
    --------
    >>> from hybridnav.ext.live import BagLog, save_bag
    >>> save_bag("plans.bag", grid=hn.example_map("figure1"))
    >>> try:
    ...     BagLog("plans.bag", topic="/scan")
    ... except hn.errors.MapError as error:
    ...     print(str(error).partition(";")[0])
    bag plans.bag: expected topic '/scan' of sensor_msgs/LaserScan, got no topic of that type
    """

    expected = "messages of sensor_msgs/LaserScan, with transforms of their frame"

    def __init__(
        self, path: PathLike, *, topic: str | None = None, frame: str | None = None
    ) -> None:
        self._bag = bag_files.Bag(path)
        self._topic = self._bag.topic_of(bag_files.LASER, topic)
        self._count = self._bag.topics[self._topic][1]
        self._frame = frame
        super().__init__(path, self._bag.size_bytes)

    def _read(self) -> Iterator[LaserScan | str]:
        transforms = self._transforms()
        n_wrong, fixed = transforms.n_wrong, self._frame
        if n_wrong:
            self.notes.append(f"{n_wrong} transforms are wrong")
        messages = self._bag.messages([self._topic])
        for done in count(1):
            self.bytes_read = self.size_bytes * min(done, self._count) // max(self._count, 1)
            try:
                following = next(messages, None)
            except MapError:
                yield "rest of the bag damaged"
                break
            if following is None:
                break
            message = following[1]
            try:
                fixed = fixed or _fixed_frame(
                    transforms, bag_files.frame_of(message, "header.frame_id")
                )
                yield _scan_of(message, transforms, fixed)
            except (bag_files.NoPoseError, InvalidValueError) as fault:
                named = isinstance(fault, bag_files.NoPoseError)
                yield str(fault) if named else "pose, angle, time or range out of range"

    def _transforms(self) -> bag_files.Transforms:
        """Return the transforms of the bag; what is damaged in it ends them."""
        transforms, is_whole = _transforms_of(self._bag)
        if not is_whole:
            self.notes.append("transforms of a damaged bag")
        return transforms


def _transforms_of(bag: bag_files.Bag) -> tuple[bag_files.Transforms, bool]:
    """Return the transforms of a bag, and whether it is whole: what is damaged in it ends them."""
    of_odometry = bag.topics_of({bag_files.ODOMETRY})
    of_frames = bag.topics_of(bag_files.TRANSFORMS)
    transforms, odometry, is_whole = bag_files.Transforms(), bag_files.Transforms(), True
    try:
        for topic, message in bag.messages([*of_odometry, *of_frames]):
            if topic in of_odometry:
                odometry.add_odometry(message)
            else:
                transforms.add_message(message, is_static=topic.endswith("tf_static"))
    except MapError:
        is_whole = False
    transforms.join(odometry)
    return transforms, is_whole


def _fixed_frame(transforms: bag_files.Transforms, frame: str) -> str:
    """Return the frame in which a robot moves, of those above the frame of its laser."""
    above = transforms.ancestors(frame)
    named = next((name for name in _FIXED if name in above), None)
    if named is None and not transforms.has_motion(above):
        raise bag_files.NoPoseError(f"no transforms of a robot that moves above {frame:.40}")
    return named or above[-1]


def _scan_of(message: Any, transforms: bag_files.Transforms, fixed: str) -> LaserScan:
    what = "scan"
    stamp_ns = stamp_ns_of(message, what)
    frame = bag_files.frame_of(message, "header.frame_id")
    rotation, place = transforms.pose(frame, fixed, stamp_ns)
    upright = cos(_MOST_TILT_RAD)
    if abs(rotation[2, 2]) < upright:
        raise bag_files.NoPoseError("laser tilted")
    side = math.copysign(1.0, rotation[2, 2])  # a laser upside down counts clockwise
    far_m = float(value_of(message, "range_max", what))
    return LaserScan(
        _ranges(message),
        (float(place[0]), float(place[1]), atan2(rotation[1, 0], rotation[0, 0])),
        start_rad=side * number_of(message, "angle_min", what),
        step_rad=side * number_of(message, "angle_increment", what),
        max_range_m=far_m if far_m > 0 else math.inf,
        time_s=stamp_ns / 1e9,
    )


def _ranges(message: Any) -> FloatArray:
    try:
        with np.errstate(invalid="ignore"):  # not every NaN survives the cast in silence
            ranges = np.array(value_of(message, "ranges", "scan"), dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidValueError("scan: ranges must be numbers") from None
    ranges[ranges < number_of(message, "range_min", "scan")] = math.nan
    return ranges


# Recorded paths.


def bag_paths(
    path: PathLike, *, topic: str | None = None, frame: str | None = None
) -> Iterator[tuple[str, FloatArray, FloatArray | None]]:
    """Yield the recorded paths of a bag: name, points (x, y) in metres, and seconds, or None.

    `topic`: of `nav_msgs/Path`, each message of which is a path, or of messages with one pose,
    which are one path; None for the only one, paths first; `frame`: the frame that is the map's,
    None for "map": poses in others are brought into it by transforms. Raises `MapNotFoundError`
    when there is no such bag, `MapError` when it is damaged, has no such topic or several, or no
    transform leads to the frame.
    """
    bag, wanted = bag_files.Bag(path), frame or "map"
    of_paths = bag.topics_of({bag_files.PATH})
    topics = [topic] if topic is not None else of_paths or bag.topics_of(bag_files.POSES)
    kind = bag.topics.get(topics[0], ("", 0))[0] if len(topics) == 1 else ""
    if kind != bag_files.PATH and kind not in bag_files.POSES:
        there = [*of_paths, *bag.topics_of(bag_files.POSES)]
        raise MapError(
            f"{bag.where}: topic {topic or 'of a path'!r:.80} is not one of paths or poses, or one "
            f"of several, expected one of {', '.join(there)[:200] or 'none there'}: state --topic"
        )
    at = bag_files.POSES.get(kind, "pose.position")
    transforms: bag_files.Transforms | None = None
    rows: list[tuple[float, float, float]] = []
    number = 0
    for _, message in bag.messages(topics):
        poses = [message] if kind in bag_files.POSES else value_of(message, "poses", "path")
        if kind == bag_files.PATH:
            rows = []
        for pose in poses:
            x, y, z = (number_of(pose, f"{at}.{axis}", "path") for axis in "xyz")
            stamp_ns = stamp_ns_of(pose, "path")
            own = bag_files.frame_of(message, "header.frame_id")
            if own != wanted:
                transforms = transforms or _transforms_of(bag)[0]
                try:
                    rotation, place = transforms.pose(own, wanted, stamp_ns)
                except bag_files.NoPoseError as why:
                    raise MapError(
                        f"{bag.where}: {topics[0]} is in frame {own!r:.60}, expected "
                        f"{wanted!r:.60} ({why}): state --frame {own:.40} if it is the frame of "
                        "the map"
                    ) from None
                x, y, _ = ((rotation * (x, y, z)).sum(axis=1) + place).tolist()
            rows.append((x, y, stamp_ns / _SECOND_NS))
        if kind == bag_files.PATH and rows:
            number += 1
            yield f"{topics[0]} {number}", *_timed(rows)
    if kind in bag_files.POSES and rows:
        yield topics[0], *_timed(rows)


def _timed(rows: list[tuple[float, float, float]]) -> tuple[FloatArray, FloatArray | None]:
    """Return points, and seconds since the first one where they differ."""
    values = np.array(rows)
    seconds = values[:, 2] - values[0, 2]
    return values[:, :2], seconds if seconds.any() else None


# Writer of bags of ROS 1 and ROS 2: maps and plans.

_SECOND_NS = 1_000_000_000
_STORAGES = ("mcap", "sqlite3")


def save_bag(  # noqa: PLR0913 - the last five have defaults
    path: PathLike,
    plans: Sequence[PlanResult | Tour] = (),
    *,
    grid: OccupancyGrid | None = None,
    frame: str = "map",
    stamp_ns: int = 0,
    storage: str = "mcap",
) -> None:
    """Write plans, and their map, as a bag of ROS 1 or ROS 2. Needs the extra `bags`.

    Topics are `/plan` (`nav_msgs/Path`, poses 5 cm apart, one message a plan, a second apart) and
    `/map` (`nav_msgs/OccupancyGrid`). Plans without a path are left out. Foxglove opens both kinds
    of bags.

    Parameters
    ----------
    path
        A name that ends in .bag makes a file of ROS 1; any other one a folder of ROS 2. Nothing may
        have that name; folders that it lacks are made.
    plans
        Results of a planner.
    grid
        A map; None for none.
    frame
        Name of the map frame.
    stamp_ns
        Time of the map and of the first plan, in nanoseconds since 1970.
    storage
        Format of a bag of ROS 2, `"mcap"` or `"sqlite3"`.

    Raises
    ------
    InvalidValueError
        When there is nothing to write, or something else than plans and a map, or a name, time or
        format is wrong.
    MapError
        When the name is taken, the bag cannot be written, or rosbags is not installed.

    Examples
    --------
    >>> from hybridnav.ext.live import load_bag_map, save_bag
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> result = hn.HybridPlanner(topology).plan((0.5, 0.5), (2.0, 2.5))
    >>> save_bag("plans", [result], grid=topology.grid)
    >>> load_bag_map("plans").shape == topology.grid.shape
    True
    """
    target = Path(path)
    where = f"bag {printable(target)}"
    if storage not in _STORAGES:
        raise InvalidValueError(
            f"storage must be one of {', '.join(_STORAGES)}, got {storage!r:.80}"
        )
    messages = list(_messages(plans, grid, frame, stamp_ns))
    if not messages:
        raise InvalidValueError(f"{where}: nothing to write, expected a plan with a path, or a map")
    check_rosbags(where)
    try:
        if target.exists():
            raise MapError(f"{where}: the name is taken, expected a new one: bags are not replaced")
        _write(target, messages, storage)
    except OSError as error:
        raise MapError(f"{where}: cannot write: {error.strerror}") from None


def _messages(
    plans: Sequence[PlanResult | Tour], grid: OccupancyGrid | None, frame: str, stamp_ns: int
) -> Iterator[tuple[str, str, int, dict[str, Any]]]:
    """Yield topic, type, time in nanoseconds, and content of each message."""
    if grid is not None:
        content = checked_type("grid", grid, OccupancyGrid).to_message(frame, stamp_ns=stamp_ns)
        yield "/map", bag_files.GRID, stamp_ns, content
    for plan in plans:
        for result in plan.results if isinstance(plan, Tour) else (plan,):
            path = checked_type("plans", result, PlanResult).path
            if path is not None:
                yield "/plan", bag_files.PATH, stamp_ns, path.to_message(frame, stamp_ns=stamp_ns)
                stamp_ns += _SECOND_NS


def _write(
    target: Path, messages: list[tuple[str, str, int, dict[str, Any]]], storage: str
) -> None:
    from rosbags.rosbag1 import Writer as Writer1  # noqa: PLC0415 - an extra
    from rosbags.rosbag2 import StoragePlugin, Writer  # noqa: PLC0415
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415

    is_1 = target.suffix.lower() == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if is_1 else Stores.ROS2_HUMBLE)
    serialize = store.serialize_ros1 if is_1 else store.serialize_cdr
    plugin = StoragePlugin.MCAP if storage == "mcap" else StoragePlugin.SQLITE3
    writer: Any = Writer1(target) if is_1 else Writer(target, version=8, storage_plugin=plugin)
    with writer:
        topics: dict[str, Any] = {}
        for topic, msgtype, stamp_ns, content in messages:
            if topic not in topics:
                kept = _kept(topic, is_1=is_1)
                topics[topic] = writer.add_connection(topic, msgtype, typestore=store, **kept)
            message = _filled(store, msgtype, content)
            writer.write(topics[topic], stamp_ns, serialize(message, msgtype))


def _kept(topic: str, *, is_1: bool) -> dict[str, Any]:
    """Return how players keep the last message of a topic for late listeners: that of the map."""
    if topic != "/map":
        return {}
    if is_1:
        return {"latching": 1}
    from rosbags import interfaces as ros  # noqa: PLC0415 - an extra

    unset = ros.QosTime(0, 0)
    return {
        "offered_qos_profiles": [
            ros.Qos(
                ros.QosHistory.KEEP_LAST,
                1,
                ros.QosReliability.RELIABLE,
                ros.QosDurability.TRANSIENT_LOCAL,
                unset,
                unset,
                ros.QosLiveliness.SYSTEM_DEFAULT,
                unset,
                avoid_ros_namespace_conventions=False,
            )
        ]
    }


def _filled(store: Any, msgtype: str, content: Any) -> Any:
    """Return the message of a type with some content; fields that it lacks are 0."""
    if msgtype.endswith("/OccupancyGrid"):
        content = content | {"data": np.array(content["data"], dtype=np.int8)}
    values = {}
    for name, (_, kind) in store.fielddefs[msgtype][1]:
        value = content.get(name, 0)
        if isinstance(value, dict):
            value = _filled(store, kind, value)
        elif isinstance(value, list):
            value = [_filled(store, kind[0][1], each) for each in value]
        values[name] = value
    return store.types[msgtype](**values)
