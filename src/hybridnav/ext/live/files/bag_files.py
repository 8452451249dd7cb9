"""Bags of ROS 1 and ROS 2 by the package rosbags: their topics, and their messages one by one."""

from __future__ import annotations

import bz2
import math
from array import array
from collections.abc import Callable, Collection, Iterable, Iterator
from contextlib import contextmanager
from functools import cache, cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.files import printable
from hybridnav._base.trig import acos, sin
from hybridnav._base.typing import FloatArray, PathLike
from hybridnav.errors import HybridNavError, MapError, MapNotFoundError, brief
from hybridnav.messages import number_of, quaternion_of, stamp_ns_of, value_of

if TYPE_CHECKING:
    from rosbags.highlevel import AnyReader


GRID, LASER, ODOMETRY, PATH = (
    f"{package}/msg/{name}"
    for package, name in (
        ("nav_msgs", "OccupancyGrid"),
        ("sensor_msgs", "LaserScan"),
        ("nav_msgs", "Odometry"),
        ("nav_msgs", "Path"),
    )
)
POSES = {
    ODOMETRY: "pose.pose.position",
    "geometry_msgs/msg/PoseStamped": "pose.position",
    "geometry_msgs/msg/PoseWithCovarianceStamped": "pose.pose.position",
}
"""Messages with one pose, and where its position stands."""
TRANSFORMS = frozenset({"tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"})


class Bag:
    """A bag: a file of ROS 1 (.bag), a folder of ROS 2, or one of its files (.mcap, .db3).

    `path`: the file or folder. Raises `MapNotFoundError` when it does not exist, `MapError` when
    rosbags is not installed.
    """

    def __init__(self, path: PathLike) -> None:
        self._path = Path(path)
        self.where = f"bag {printable(path)}"
        """Name of the bag in messages."""
        try:
            is_there = self._path.exists()
        except (OSError, ValueError):
            is_there = False
        if not is_there:
            raise MapNotFoundError(f"{self.where}: no such file or folder")
        check_rosbags(self.where)

    @property
    def size_bytes(self) -> int:
        """Size of its files."""
        path = self._path
        files = path.iterdir() if path.is_dir() else [path]
        return sum(file.stat().st_size for file in files if file.is_file())

    @cached_property
    def topics(self) -> dict[str, tuple[str, int]]:
        """The type of the messages of each topic, and how many there are.

        Raises `MapError` when the file is no bag, or damaged.
        """
        with self._open() as reader:
            return {
                name: (topic.msgtype or "", topic.msgcount) for name, topic in reader.topics.items()
            }

    def topics_of(self, msgtypes: Collection[str]) -> list[str]:
        """Return the topics of messages of some types, in order; errors as for `topics`."""
        return sorted(name for name, (kind, _) in self.topics.items() if kind in msgtypes)

    def topic_of(self, msgtype: str, topic: str | None) -> str:
        """Return the topic of messages of a type.

        `topic`: name of the topic; None for the only one. Raises `MapError` when there is none,
        more than one and none was named, or the file is damaged.
        """
        topics = self.topics_of({msgtype})
        short = msgtype.replace("/msg/", "/")
        if topic is None and len(topics) == 1:
            return topics[0]
        if topic in topics:
            return str(topic)
        named = "a topic" if topic is None else f"topic {brief(topic)}"
        if not topics:
            there = ", ".join(sorted(self.topics)) or "none"
            raise MapError(
                f"{self.where}: expected {named} of {short}, got no topic of that type; topics: "
                f"{there:.200}"
            )
        raise MapError(
            f"{self.where}: expected {named} of {short}, got {', '.join(topics):.200}: name one"
        )

    def messages(self, topics: Collection[str]) -> Iterator[tuple[str, Any]]:
        """Yield the messages of some topics with these, in the order in which they were recorded.

        Raises `MapError` when the file is damaged; what was yielded before is sound.
        """
        with self._open() as reader:
            wanted = [each for each in reader.connections if each.topic in topics]
            if not wanted:
                return
            for connection, _, raw in reader.messages(wanted):
                yield connection.topic, reader.deserialize(raw, connection.msgtype)

    def last(self, topic: str) -> Any:
        """Return the last message of a topic.

        Raises `MapError` when there is none, or the file is damaged.
        """
        with self._open() as reader:
            wanted = [each for each in reader.connections if each.topic == topic]
            newest = None
            for connection, _, raw in reader.messages(wanted):
                newest = connection, raw
            if newest is None:
                raise MapError(f"{self.where}: topic {topic} has no message")
            return reader.deserialize(newest[1], newest[0].msgtype)

    @contextmanager
    def _open(self) -> Iterator[AnyReader]:
        from rosbags.highlevel import AnyReader  # noqa: PLC0415 - an extra

        bound_rosbags()
        try:
            with AnyReader([self._path], default_typestore=_usual_types()) as reader:
                yield reader
        except HybridNavError:
            raise
        except TooLargeError as failure:
            raise MapError(f"{self.where}: {failure}") from None
        except MemoryError:  # sizes stand in the file, and may be any number
            raise MapError(f"{self.where}: damaged, or larger than the memory") from None
        except Exception as failure:  # noqa: BLE001 - the parsers raise anything
            text = printable(" ".join(str(failure).split())[:100]) or type(failure).__name__
            raise MapError(f"{self.where}: no bag, or damaged ({text})") from None


@cache
def _usual_types() -> Any:
    """Return the types of messages, for bags of ROS 2 that do not define theirs."""
    from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - an extra

    return get_typestore(Stores.ROS2_HUMBLE)


def check_rosbags(where: str) -> None:
    """Raise `MapError` if the package that reads and writes bags is not installed."""
    try:
        import rosbags.highlevel  # noqa: F401, PLC0415 - an extra
    except ImportError:
        raise MapError(
            f"{where}: the package rosbags is needed, and is not installed: "
            "python -m pip install 'hybridnav[bags]'"
        ) from None


# Limits on what compressed bags unpack to: a small file may hold any number of zeros.
#
# rosbags unpacks a chunk at once, whatever its size. Its decompressors are replaced by ones that
# stop at a limit, which changes nothing for bags within it.

MOST_BYTES = 1 << 29
"""Bytes that a chunk or message may unpack to; chunks are some MB, maps of 400 Mcells 400 MB."""
MOST_TIMES = 200
"""How many times as large as the file what it unpacks to may be, where that is more."""
_MOST_FRAMES = 10_000
"""Compressed frames that may follow each other in a chunk; writers make one."""


class TooLargeError(Exception):
    """More than the limit; its text is the whole reason."""

    def __init__(self, what: str, most_bytes: int) -> None:
        super().__init__(
            f"{what} unpacks to more than {most_bytes / 2**20:,.0f} MiB, expected at most that: "
            "unpack it by the tools of ROS if it is sound"
        )


def unpacked(make: Callable[[], Any], data: bytes, what: str, most_bytes: int) -> bytes:
    """Return what compressed frames hold.

    `make`: makes a decompressor of one frame, as in the module bz2; `what`: words for them in
    messages; `most_bytes`: size in bytes at which to stop. Raises `TooLargeError` when they hold
    more, `EOFError` when the last one has no end, or there are more than 10,000.
    """
    parts: list[bytes] = []
    left = most_bytes
    for _ in range(_MOST_FRAMES):
        unpacker = make()
        parts.append(unpacker.decompress(data, max_length=left + 1))
        left -= len(parts[-1])
        if left < 0:
            raise TooLargeError(what, most_bytes)
        if not unpacker.eof:
            break
        data = unpacker.unused_data or b""
        if not data:
            return b"".join(parts)
    raise EOFError("compressed data without an end")


class _BoundedZstd:
    """The two functions of the module zstd that the reader of bags of ROS 2 calls."""

    def __init__(self, zstd: Any) -> None:
        self._zstd = zstd

    def decompress(self, data: bytes) -> bytes:
        return unpacked(self._zstd.ZstdDecompressor, data, "a message", MOST_BYTES)

    @contextmanager
    def open(self, file: Any, mode: str) -> Iterator[_BoundedFile]:
        size = file.seek(0, 2)
        file.seek(0)
        with self._zstd.open(file, mode) as unpacking:
            yield _BoundedFile(unpacking, max(MOST_BYTES, MOST_TIMES * size))


class _BoundedFile:
    """A file that is read up to a limit."""

    def __init__(self, file: Any, most_bytes: int) -> None:
        self._file, self._most, self._left = file, most_bytes, most_bytes

    def read(self, size: int) -> bytes:
        chunk: bytes = self._file.read(size)
        self._left -= len(chunk)
        if self._left < 0:
            raise TooLargeError("a file of the bag", self._most)
        return chunk


@cache
def bound_rosbags() -> None:
    """Replace the decompressors of rosbags, once."""
    from lz4.frame import LZ4FrameDecompressor  # type: ignore[import-untyped]  # noqa: PLC0415 - an extra
    from rosbags.rosbag1 import reader as reader_1  # noqa: PLC0415
    from rosbags.rosbag2 import reader as reader_2  # noqa: PLC0415
    from rosbags.rosbag2 import storage_mcap  # noqa: PLC0415

    at_2: Any = reader_2
    zstd = at_2.zstd
    of_1: dict[str, Any] = reader_1.decompressors
    for name, make in (("bz2", bz2.BZ2Decompressor), ("lz4", LZ4FrameDecompressor)):
        of_1[name] = lambda data, make=make: unpacked(make, data, "a chunk", MOST_BYTES)
    of_mcap: dict[str, Any] = storage_mcap.DECOMPRESSORS
    for name, make in (("lz4", LZ4FrameDecompressor), ("zstd", zstd.ZstdDecompressor)):
        of_mcap[name] = lambda data, size, make=make: unpacked(
            make, data, "a chunk", min(size, MOST_BYTES)
        )
    at_2.zstd = _BoundedZstd(zstd)


# Poses of frames at a time, from transforms between frames, as tf2 finds them.

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
        chain = [frame]
        while (series := self._series.get(chain[-1])) is not None:
            if series.parent in chain:
                raise NoPoseError("frames in a circle")
            chain.append(series.parent)
        return chain

    def has_motion(self, frames: Iterable[str]) -> bool:
        """Return whether the transform of one of some frames changes with time."""
        series_of = (self._series[frame] for frame in frames if frame in self._series)
        return any(not series.is_static for series in series_of)

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
    return sum(np.multiply.outer(column, row) for column, row in columns)


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
    return blended / math.sqrt((blended * blended).sum())
