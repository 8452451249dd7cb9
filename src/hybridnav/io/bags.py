"""Maps and scans of bags of ROS 1 and ROS 2; plans and maps into bags."""

from __future__ import annotations

import math
from itertools import count
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._trig import atan2, cos
from hybridnav.errors import InvalidValueError, MapError
from hybridnav.grid import OccupancyGrid
from hybridnav.grid.checks import checked_radius, checked_thresholds
from hybridnav.io.bag_files import GRID, LASER, ODOMETRY, TRANSFORMS, Bag
from hybridnav.io.bag_poses import NoPoseError, Transforms, frame_of
from hybridnav.io.scan_log import ScanLog
from hybridnav.mapping import LaserScan
from hybridnav.messages import number_of, stamp_ns_of, value_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._typing import FloatArray, PathLike

_MOST_TILT_RAD = 0.1
"""Angle between the vertical and the axis of a laser up to which its scans count as level."""
_FIXED = ("map", "odom")
"""Usual names of the frame in which a robot moves, the better first."""


def load_bag_map(
    path: PathLike,
    *,
    topic: str | None = None,
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
        When the radius or a threshold is out of range.

    Examples
    --------
    >>> hn.save_bag("office.bag", grid=hn.example_map("office"))
    >>> hn.load_bag_map("office.bag").shape
    (580, 960)
    """
    checked_thresholds(free_threshold, occupied_threshold)
    if robot_radius_m is not None:
        checked_radius(robot_radius_m)
    bag = Bag(path)
    if topic is None and "/map" in bag.topics_of({GRID}):
        topic = "/map"
    topic = bag.topic_of(GRID, topic)
    message = bag.last(topic)
    try:
        return OccupancyGrid.from_message(
            message,
            robot_radius_m=robot_radius_m,
            free_threshold=free_threshold,
            occupied_threshold=occupied_threshold,
            name=topic.strip("/") or "map",
        )
    except InvalidValueError as error:
        raise MapError(f"{bag.where}, {topic}: {error}") from None


class BagLog(ScanLog):
    """The laser scans of a bag of ROS 1 or ROS 2, as an iterable. Needs the extra `bags`.

    The pose of a scan is that of its frame at its time, by the transforms of the bag (tf, and
    odometry for frames that they lack). Scans are left out and counted if there is no transform at
    their time, the laser is tilted by more than 0.1 radians, or they do not follow from those
    before (see `ScanSequence`). A laser that hangs upside down is read as such. Readings below the
    scan's `range_min` are none.

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
    >>> hn.save_bag("plans.bag", grid=hn.example_map("figure1"))
    >>> try:
    ...     hn.BagLog("plans.bag", topic="/scan")
    ... except hn.MapError as error:
    ...     print(error)
    bag plans.bag: expected topic '/scan' of sensor_msgs/LaserScan, got no topic of that type
    """

    expected = "messages of sensor_msgs/LaserScan, with transforms of their frame"

    def __init__(
        self, path: PathLike, *, topic: str | None = None, frame: str | None = None
    ) -> None:
        self._bag = Bag(path)
        self._topic = self._bag.topic_of(LASER, topic)
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
                found = next(messages, None)
            except MapError:
                yield "rest of the bag damaged"
                break
            if found is None:
                break
            message = found[1]
            try:
                fixed = fixed or _fixed_frame(transforms, frame_of(message, "header.frame_id"))
                yield _scan_of(message, transforms, fixed)
            except (NoPoseError, InvalidValueError) as fault:
                named = isinstance(fault, NoPoseError)
                yield str(fault) if named else "pose, angle, time or range out of range"

    def _transforms(self) -> Transforms:
        """Return the transforms of the bag; what is damaged in it ends them."""
        of_odometry = self._bag.topics_of({ODOMETRY})
        of_frames = self._bag.topics_of(TRANSFORMS)
        found, odometry = Transforms(), Transforms()
        try:
            for topic, message in self._bag.messages([*of_odometry, *of_frames]):
                if topic in of_odometry:
                    odometry.add_odometry(message)
                else:
                    found.add_message(message, is_static=topic.endswith("tf_static"))
        except MapError:
            self.notes.append("transforms of a damaged bag")
        found.join(odometry)
        return found


def _fixed_frame(transforms: Transforms, frame: str) -> str:
    """Return the frame in which a robot moves, of those above the frame of its laser."""
    above = transforms.ancestors(frame)
    named = next((name for name in _FIXED if name in above), None)
    if named is None and not transforms.has_motion(above):
        raise NoPoseError(f"no transforms of a robot that moves above {frame:.40}")
    return named or above[-1]


def _scan_of(message: Any, transforms: Transforms, fixed: str) -> LaserScan:
    what = "scan"
    stamp_ns = stamp_ns_of(message, what)
    frame = frame_of(message, "header.frame_id")
    rotation, place = transforms.pose(frame, fixed, stamp_ns)
    upright = cos(_MOST_TILT_RAD)
    if abs(rotation[2, 2]) < upright:
        raise NoPoseError("laser tilted")
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
