"""Poses of frames at a time, from transforms between frames, as tf2 finds them."""

from __future__ import annotations

import math
from array import array
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.messages import number_of, quaternion_of, stamp_ns_of, value_of
from hybridnav._base.trig import acos, sin

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._base.typing import FloatArray

_STRAIGHT = 1e-6
"""Radians between two rotations below which they are blended along a straight line."""


class NoPoseError(Exception):
    """A pose that cannot be found; its text is why in a few words."""


class Transforms:
    """Transforms between frames over time: a tree, from each frame to its parent."""

    def __init__(self) -> None:
        self._series: dict[str, _Series] = {}
        self.n_wrong = 0
        """Transforms that were left out: numbers that are not finite, no unit quaternion, no
        name."""

    def __contains__(self, child: str) -> bool:
        return child in self._series

    def add_message(self, message: Any, *, is_static: bool) -> None:
        """Take the transforms of a `tf2_msgs/TFMessage`."""
        for each in value_of(message, "transforms", "transforms"):
            names = ("child_frame_id", "transform.translation", "transform.rotation")
            self._take(each, names, is_static=is_static)

    def add_odometry(self, message: Any) -> None:
        """Take the pose of a `nav_msgs/Odometry`."""
        names = ("child_frame_id", "pose.pose.position", "pose.pose.orientation")
        self._take(message, names, is_static=False)

    def _take(self, message: Any, names: tuple[str, str, str], *, is_static: bool) -> None:
        child_name, position, orientation = names
        try:
            parent = frame_of(message, "header.frame_id")
            child = frame_of(message, child_name)
            stamp_ns = stamp_ns_of(message, "transform")
            place = [number_of(message, f"{position}.{axis}", "transform") for axis in "xyz"]
            turn = quaternion_of(message, orientation, "transform")
        except ValueError:
            self.n_wrong += 1
            return
        if not parent or not child or parent == child:
            self.n_wrong += 1
            return
        series = self._series.get(child)
        if series is None or series.parent != parent:  # as in tf2, the newest parent counts
            series = self._series[child] = _Series(parent)
        series.add(stamp_ns, [*place, *turn], is_static=is_static)

    def join(self, other: Transforms) -> None:
        """Take the frames of other transforms that these lack."""
        self._series = other._series | self._series
        self.n_wrong += other.n_wrong

    def ancestors(self, frame: str) -> list[str]:
        """Return a frame, its parent, and so on up to the root.

        Raises `NoPoseError` when they form a circle.
        """
        found = [frame]
        while (series := self._series.get(found[-1])) is not None:
            if series.parent in found:
                raise NoPoseError("frames in a circle")
            found.append(series.parent)
        return found

    def has_motion(self, frames: Iterable[str]) -> bool:
        """Return whether the transform of one of some frames changes with time."""
        known = (self._series[frame] for frame in frames if frame in self._series)
        return any(not series.is_static for series in known)

    def pose(self, frame: str, fixed: str, stamp_ns: int) -> tuple[FloatArray, FloatArray]:
        """Return the rotation and the place of a frame in one of its ancestors.

        Between two transforms, places are blended along a line and rotations along an arc.

        `frame`, `fixed`: names of the two; `stamp_ns`: the time, in nanoseconds. Returns float64
        (3, 3) and float64 (3,), metres. Raises `NoPoseError` when no chain of transforms leads up
        to it, or there are none at that time.
        """
        chain = self.ancestors(frame)
        if fixed not in chain:
            raise NoPoseError(f"no transforms from {frame:.40} to {fixed:.40}")
        rotation, place = np.eye(3), np.zeros(3)
        for name in chain[: chain.index(fixed)]:
            turn, move = self._series[name].at(stamp_ns)
            rotation, place = _applied(turn, rotation), _applied(turn, place) + move
        return rotation, place


class _Series:
    """The transforms of one frame to its parent."""

    def __init__(self, parent: str) -> None:
        self.parent = parent
        self._stamps_ns = array("q")
        self._values = array("d")
        self.is_static = False
        self._sorted: tuple[Any, FloatArray] | None = None

    def add(self, stamp_ns: int, values: list[float], *, is_static: bool) -> None:
        self._sorted = None
        if is_static:  # the last one counts, at all times
            self.is_static = True
            self._stamps_ns, self._values = array("q"), array("d")
        elif self.is_static:
            return
        self._stamps_ns.append(stamp_ns)
        self._values.extend(values)

    def at(self, stamp_ns: int) -> tuple[FloatArray, FloatArray]:
        """Return rotation and translation at a time."""
        stamps, values = self._in_order()
        if self.is_static:
            return rotation_of(values[0, 3:]), values[0, :3]
        after = int(np.searchsorted(stamps, stamp_ns))
        if after < len(stamps) and stamps[after] == stamp_ns:
            return rotation_of(values[after, 3:]), values[after, :3]
        if not 0 < after < len(stamps):
            raise NoPoseError("no transform at its time")
        first, last = values[after - 1], values[after]
        part = (stamp_ns - int(stamps[after - 1])) / int(stamps[after] - stamps[after - 1])
        turn = rotation_of(_blended(first[3:], last[3:], part))
        return turn, first[:3] + part * (last[:3] - first[:3])

    def _in_order(self) -> tuple[Any, FloatArray]:
        if self._sorted is None:
            stamps = np.array(self._stamps_ns, dtype=np.int64)
            values = np.array(self._values, dtype=np.float64).reshape(-1, 7)
            order = np.argsort(stamps, kind="stable")
            self._sorted = stamps[order], values[order]
        return self._sorted


def frame_of(message: Any, path: str) -> str:
    """Return the name of a frame, without the stroke before names of ROS 1."""
    return str(value_of(message, path, "message")).lstrip("/")


def rotation_of(quaternion: FloatArray) -> FloatArray:
    """Return the rotation of a unit quaternion x, y, z, w, float64 (3, 3)."""
    x, y, z, w = quaternion.tolist()
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )


def _applied(turn: FloatArray, other: FloatArray) -> FloatArray:
    """Return the product of a matrix and a matrix or vector, its sums in order."""
    columns = zip(turn.T, other, strict=True)
    product: FloatArray = sum(np.multiply.outer(column, row) for column, row in columns)
    return product


def _blended(first: FloatArray, last: FloatArray, part: float) -> FloatArray:
    """Return the rotation a share of the way between two, along the shorter arc (Shoemake 1985)."""
    dot = float((first * last).sum())
    last, dot = (-last, -dot) if dot < 0 else (last, dot)
    angle = acos(min(dot, 1.0))
    if angle < _STRAIGHT:
        blended = first + part * (last - first)
    else:
        near, far = sin((1 - part) * angle), sin(part * angle)
        blended = (near * first + far * last) / sin(angle)
    unit: FloatArray = blended / math.sqrt((blended * blended).sum())
    return unit
