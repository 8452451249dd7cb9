"""Writer of bags of ROS 1 and ROS 2: maps and plans."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._files import printable
from hybridnav.errors import InvalidValueError, MapError
from hybridnav.grid import OccupancyGrid
from hybridnav.grid.checks import checked_type
from hybridnav.io.bag_files import GRID, PATH, check_rosbags
from hybridnav.planner import Tour
from hybridnav.result import PlanResult

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from hybridnav._typing import PathLike

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
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> result = hn.HybridPlanner(topology).plan((0.5, 0.5), (2.0, 2.5))
    >>> hn.save_bag("plans", [result], grid=topology.grid)
    >>> hn.load_bag_map("plans").shape == topology.grid.shape
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
        yield "/map", GRID, stamp_ns, content
    for plan in plans:
        for result in plan.results if isinstance(plan, Tour) else (plan,):
            path = checked_type("plans", result, PlanResult).path
            if path is not None:
                yield "/plan", PATH, stamp_ns, path.to_message(frame, stamp_ns=stamp_ns)
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
    from rosbags.interfaces import (  # noqa: PLC0415 - an extra
        Qos,
        QosDurability,
        QosHistory,
        QosLiveliness,
        QosReliability,
        QosTime,
    )

    unset = QosTime(0, 0)
    return {
        "offered_qos_profiles": [
            Qos(
                QosHistory.KEEP_LAST,
                1,
                QosReliability.RELIABLE,
                QosDurability.TRANSIENT_LOCAL,
                unset,
                unset,
                QosLiveliness.SYSTEM_DEFAULT,
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
