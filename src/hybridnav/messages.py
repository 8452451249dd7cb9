"""Messages of ROS without ROS: mappings, or objects of any type, with the fields of a message."""

from __future__ import annotations

import importlib
import math
import operator
from collections.abc import Mapping
from typing import Any, TypeVar

from hybridnav._base.trig import asin, atan2, cos, hypot, sin
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError, brief

_T = TypeVar("_T")

MOST_ID = 2**16 - 1
"""Greatest id of a node or an edge in the messages of Nav2's route server."""
_NOT_UNIT = 0.01
"""Difference of the squared norm of a quaternion from 1 at which tf2 refuses it."""
_MOST_TILT_RAD = 0.02
"""Angle between the vertical and the z axis of a pose up to which the pose is one in the plane."""
_NANO = 1_000_000_000
_MOST_STAMP_NS = 2**31 * _NANO

Quaternion = tuple[float, float, float, float]
"""x, y, z, w."""


def value_of(message: Any, path: str, what: str) -> Any:
    """Return a field of a message.

    `message`: a mapping, or an object with attributes; so are the messages in it; `path`: names
    joined by dots; `what`: name of the message in errors. Raises `InvalidValueError` when the
    message has no such field.
    """
    value = message
    for name in path.split("."):
        try:
            value = value[name] if isinstance(value, Mapping) else getattr(value, name)
        except (KeyError, AttributeError):
            raise InvalidValueError(
                f"{what} has no field {path}: expected the fields of the ROS message"
            ) from None
    return value


def number_of(message: Any, path: str, what: str) -> float:
    """Return a field that is a finite number; parameters and errors as for `value_of`."""
    value = value_of(message, path, what)
    number = math.nan
    if not isinstance(value, bool | str | bytes):
        try:
            number = float(value)
        except (TypeError, ValueError, OverflowError):
            number = math.nan
    if not math.isfinite(number):
        raise InvalidValueError(f"{what}: {path} must be a finite number, got {brief(value)}")
    return number


def count_of(message: Any, path: str, what: str) -> int:
    """Return a field that is a whole number of 1 or more; parameters and errors as for
    `value_of`."""
    value = value_of(message, path, what)
    try:
        number = operator.index(value)
    except TypeError:
        number = 0
    if number < 1:
        raise InvalidValueError(
            f"{what}: {path} must be a whole number of 1 or more, got {brief(value)}"
        )
    return number


def quaternion_of(message: Any, path: str, what: str) -> Quaternion:
    """Return a field that is a quaternion, with the norm 1.

    `message`, `path`, `what`: as in `value_of`; the field has x, y, z and w. Raises
    `InvalidValueError` when a number is missing or not finite, or the squared norm is 0.01 or more
    away from 1.
    """
    x, y, z, w = (number_of(message, f"{path}.{name}", what) for name in "xyzw")
    norm = math.sqrt(x * x + y * y + z * z + w * w)
    if not abs(norm * norm - 1) < _NOT_UNIT:
        kind = "zeros, which states no direction" if norm == 0 else f"length {norm:.6g}"
        raise InvalidValueError(
            f"{what}: {path} is a quaternion of {kind}, expected a unit quaternion: w 1 and x, y, "
            "z 0 for no rotation"
        )
    return x / norm, y / norm, z / norm, w / norm


def yaw_of(quaternion: Quaternion) -> float:
    """Return the direction of the x axis of a pose, in radians, counter-clockwise."""
    x, y, z, w = quaternion
    return atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def tilt_of(quaternion: Quaternion) -> float:
    """Return the angle between the vertical and the z axis of a pose, in radians."""
    x, y, _, _ = quaternion
    return 2 * asin(min(1.0, hypot(x, y)))


def pose_of(message: Any, path: str, what: str) -> tuple[float, float, float]:
    """Return a field that is a pose in the plane, `(x, y, yaw)`; its height is left out.

    Parameters
    ----------
    message, path, what
        As in `value_of`; the field is a `geometry_msgs/Pose`.

    Raises
    ------
    InvalidValueError
        When a number is missing or not finite, the orientation is no unit quaternion, or tilted by
        more than 0.02 radians.

    Examples
    --------
    >>> from hybridnav.messages import pose_message, pose_of
    >>> goal = {"header": {"frame_id": "map"}, "pose": pose_message((1.0, 2.0, 0.5))}
    >>> [round(value, 9) for value in pose_of(goal, "pose", "goal")]
    [1.0, 2.0, 0.5]
    """
    return _in_plane(message, (f"{path}.position", f"{path}.orientation"), what)


def transform_of(message: Any, path: str, what: str) -> tuple[float, float, float]:
    """Return a field that is a `geometry_msgs/Transform` as a pose.

    Parameters
    ----------
    message, path, what
        As in `value_of`.

    Raises
    ------
    InvalidValueError
        As for `pose_of`.

    Examples
    --------
    >>> from hybridnav.messages import pose_message, transform_of
    >>> pose = pose_message((1.0, 2.0, 0.5))
    >>> found = {"translation": pose["position"], "rotation": pose["orientation"]}
    >>> [round(value, 9) for value in transform_of({"transform": found}, "transform", "robot")]
    [1.0, 2.0, 0.5]
    """
    return _in_plane(message, (f"{path}.translation", f"{path}.rotation"), what)


def _in_plane(message: Any, paths: tuple[str, str], what: str) -> tuple[float, float, float]:
    place, turn = paths
    x, y = (number_of(message, f"{place}.{name}", what) for name in "xy")
    quaternion = quaternion_of(message, turn, what)
    tilt = tilt_of(quaternion)
    if tilt > _MOST_TILT_RAD:
        raise InvalidValueError(
            f"{what}: {turn} is tilted by {tilt:.3g} radians, expected a rotation about the "
            "vertical alone"
        )
    return x, y, yaw_of(quaternion)


def pose_message(pose: tuple[float, float, float]) -> dict[str, Any]:
    """Return a `geometry_msgs/Pose` in the plane.

    Parameters
    ----------
    pose
        `(x, y, yaw)` in metres and radians.

    Examples
    --------
    >>> from hybridnav.messages import pose_message
    >>> pose_message((1.0, 2.0, 0.0))["orientation"]
    {'x': 0.0, 'y': 0.0, 'z': 0.0, 'w': 1.0}
    """
    x, y, yaw = pose
    return {
        "position": {"x": x, "y": y, "z": 0.0},
        "orientation": {"x": 0.0, "y": 0.0, "z": sin(yaw / 2), "w": cos(yaw / 2)},
    }


def header_message(frame_id: str, stamp_ns: int) -> dict[str, Any]:
    """Return a `std_msgs/Header` of ROS 2.

    Parameters
    ----------
    frame_id
        Name of the frame.
    stamp_ns
        Time in nanoseconds since 1970.

    Raises
    ------
    InvalidValueError
        When the name is no text or empty, or the time does not fit.

    Examples
    --------
    >>> from hybridnav.messages import header_message
    >>> header_message("map", 1_500_000_000)
    {'stamp': {'sec': 1, 'nanosec': 500000000}, 'frame_id': 'map'}
    """
    if not isinstance(frame_id, str) or not frame_id:
        raise InvalidValueError(
            f"frame_id must be the name of a frame, such as map, got {brief(frame_id)}"
        )
    try:
        stamp = operator.index(stamp_ns)
    except TypeError:
        stamp = -1
    if not 0 <= stamp < _MOST_STAMP_NS:
        raise InvalidValueError(
            f"stamp_ns must be whole nanoseconds since 1970, 0 to {_MOST_STAMP_NS - 1}, "
            f"got {brief(stamp_ns)}"
        )
    return {"stamp": {"sec": stamp // _NANO, "nanosec": stamp % _NANO}, "frame_id": frame_id}


def stamp_ns_of(message: Any, what: str) -> int:
    """Return the time of the header of a message, in nanoseconds; names as in ROS 2 or ROS 1.

    `message`, `what`: see `value_of`. Raises `InvalidValueError` when it has no time, or one that
    does not fit.
    """
    stamp = value_of(message, "header.stamp", what)
    names = ("sec", "nanosec") if _has(stamp, "sec") else ("secs", "nsecs")
    seconds, nanoseconds = (number_of(stamp, name, f"{what}: header.stamp") for name in names)
    found = int(seconds) * _NANO + int(nanoseconds)
    if not 0 <= found < _MOST_STAMP_NS:
        raise InvalidValueError(f"{what}: header.stamp is out of range: {found} nanoseconds")
    return found


def _has(message: Any, name: str) -> bool:
    return name in message if isinstance(message, Mapping) else hasattr(message, name)


def path_message(poses: FloatArray, frame_id: str, stamp_ns: int) -> dict[str, Any]:
    """Return a `nav_msgs/Path` of poses, float64 (n, 3), `(x, y, yaw)` in metres and radians; see
    `header_message`."""
    header = header_message(frame_id, stamp_ns)
    return {
        "header": header,
        "poses": [
            {"header": header | {"stamp": dict(header["stamp"])}, "pose": pose_message(tuple(pose))}
            for pose in poses.tolist()
        ],
    }


def fill_message(message: _T, values: Mapping[str, Any]) -> _T:
    """Fill a message of ROS 2 with values, in place.

    It does what `set_message_fields` of rosidl_runtime_py does, without its copies, which take
    longer than most plans.

    Parameters
    ----------
    message
        A message of rclpy, or a part of one.
    values
        Values of some of its fields: numbers, texts, lists, messages, and mappings for messages in
        it.

    Raises
    ------
    AttributeError
        When it has no such field.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> from hybridnav.messages import fill_message
    >>> header = SimpleNamespace(stamp=SimpleNamespace(sec=0, nanosec=0), frame_id="")
    >>> fill_message(header, {"stamp": {"sec": 3}, "frame_id": "map"})
    namespace(stamp=namespace(sec=3, nanosec=0), frame_id='map')
    """
    for name, value in values.items():
        part = getattr(message, name)
        if isinstance(value, Mapping):
            fill_message(part, value)
        elif isinstance(value, list) and value and isinstance(value[0], Mapping):
            make = _element_type(message, name)
            setattr(message, name, [fill_message(make(), each) for each in value])
        else:
            setattr(message, name, value)
    return message


def _element_type(message: Any, name: str) -> Any:
    """Return the class of the messages in a sequence, as `sequence<geometry_msgs/Pose>` names
    it."""
    kind = message.get_fields_and_field_types()[name]
    package, _, short = kind.removeprefix("sequence<").removesuffix(">").partition("/")
    return getattr(importlib.import_module(f"{package}.msg"), short)
