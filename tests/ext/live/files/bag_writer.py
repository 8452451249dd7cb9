"""Bags written with rosbags alone, for tests of their readers."""

from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

KINDS = ("ros1", "mcap", "sqlite3")
TFS, SCAN, ODOM, GRID = (
    "tf2_msgs/msg/TFMessage",
    "sensor_msgs/msg/LaserScan",
    "nav_msgs/msg/Odometry",
    "nav_msgs/msg/OccupancyGrid",
)


class BagWriter:
    """Messages for a bag of one kind."""

    def __init__(self, kind: str) -> None:
        self.kind = kind
        stores = {"ros1": Stores.ROS1_NOETIC}
        self.store: Any = get_typestore(stores.get(kind, Stores.ROS2_HUMBLE))
        if kind == "ros1":  # whose store has no tf2
            definition = "geometry_msgs/TransformStamped[] transforms"
            self.store.register(get_types_from_msg(definition, TFS))
        self.messages: list[tuple[str, str, int, Any]] = []

    def make(self, name: str, **values: Any) -> Any:
        package, _, short = name.partition("/")
        return self.store.types[f"{package}/msg/{short}"](**values)

    def header(self, frame: str, stamp_ns: int) -> Any:
        stamp = self.make(
            "builtin_interfaces/Time", sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9
        )
        of_ros_1 = {"seq": 0} if self.kind == "ros1" else {}
        return self.make("std_msgs/Header", **of_ros_1, stamp=stamp, frame_id=frame)

    def quaternion(self, turn: Any) -> Any:
        x, y, z, w = map(float, turn)
        return self.make("geometry_msgs/Quaternion", x=x, y=y, z=z, w=w)

    def add(self, topic: str, kind: str, stamp_ns: int, message: Any) -> None:
        self.messages.append((topic, kind, stamp_ns, message))

    def add_tf(  # noqa: PLR0913, PLR0917
        self, parent: str, child: str, stamp_ns: int, place: Any, turn: Any, topic: str = "/tf"
    ) -> None:
        x, y, z = map(float, place)
        move = self.make("geometry_msgs/Vector3", x=x, y=y, z=z)
        transform = self.make(
            "geometry_msgs/Transform", translation=move, rotation=self.quaternion(turn)
        )
        stamped = self.make(
            "geometry_msgs/TransformStamped",
            header=self.header(parent, stamp_ns),
            child_frame_id=child,
            transform=transform,
        )
        self.add(topic, TFS, stamp_ns, self.make("tf2_msgs/TFMessage", transforms=[stamped]))

    def add_odometry(self, stamp_ns: int, place: Any, turn: Any) -> None:
        x, y, z = map(float, place)
        point = self.make("geometry_msgs/Point", x=x, y=y, z=z)
        pose = self.make("geometry_msgs/Pose", position=point, orientation=self.quaternion(turn))
        zero = self.make("geometry_msgs/Vector3", x=0.0, y=0.0, z=0.0)
        twist = self.make("geometry_msgs/Twist", linear=zero, angular=zero)
        spread = np.zeros(36)
        with_spread = self.make("geometry_msgs/PoseWithCovariance", pose=pose, covariance=spread)
        moving = self.make("geometry_msgs/TwistWithCovariance", twist=twist, covariance=spread)
        message = self.make(
            "nav_msgs/Odometry",
            header=self.header("odom", stamp_ns),
            child_frame_id="base",
            pose=with_spread,
            twist=moving,
        )
        self.add("/odom", ODOM, stamp_ns, message)

    def add_scan(
        self,
        stamp_ns: int,
        ranges: Any,
        topic: str = "/scan",
        frame: str = "laser",
        **others: float,
    ) -> None:
        """Take a scan of equal steps all round."""
        values = {
            "angle_min": -np.pi,
            "angle_max": np.pi,
            "angle_increment": 2 * np.pi / len(ranges),
            "time_increment": 0.0,
            "scan_time": 0.1,
            "range_min": 0.1,
            "range_max": 30.0,
        } | others
        message = self.make(
            "sensor_msgs/LaserScan",
            header=self.header(frame, stamp_ns),
            ranges=np.array(ranges, np.float32),
            intensities=np.zeros(0, np.float32),
            **values,
        )
        self.add(topic, SCAN, stamp_ns, message)

    def write(self, folder: Path, name: str = "drive") -> Path:
        """Write the bag in order of time, and return its path."""
        is_1 = self.kind == "ros1"
        path = folder / (f"{name}.bag" if is_1 else name)
        plugin = StoragePlugin.MCAP if self.kind == "mcap" else StoragePlugin.SQLITE3
        writer: Any = Writer1(path) if is_1 else Writer(path, version=9, storage_plugin=plugin)
        serialize = self.store.serialize_ros1 if is_1 else self.store.serialize_cdr
        with writer:
            topics = {
                (topic, kind): writer.add_connection(topic, kind, typestore=self.store)
                for topic, kind in dict.fromkeys((t, k) for t, k, _, _ in self.messages)
            }
            for topic, kind, stamp_ns, message in sorted(self.messages, key=lambda each: each[2]):
                writer.write(topics[topic, kind], stamp_ns, serialize(message, kind))
        return path
