"""Bags whose small files unpack to far more: memory stays bounded, and one line states why."""

from __future__ import annotations

import bz2
import struct
import tracemalloc
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from lz4.frame import compress as lz4_compress  # type: ignore[import-untyped]
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

import hybridnav as hn
from hybridnav.ext.live.files import bag_files

if TYPE_CHECKING:
    from pathlib import Path

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


KINDS = ("ros1-bz2", "ros1-lz4", "mcap-storage", "mcap-message", "mcap-file", "sqlite3-file")


def refused(bag, match):
    """Check that a bag ends in one line, in little memory; return the line."""
    tracemalloc.start()
    with pytest.raises(hn.MapError, match=match) as error:
        hn.load_bag_map(bag)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < BOMB // 4
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize("kind", KINDS)
def test_a_map_that_unpacks_to_too_much_ends_in_one_line(kind, tmp_path, monkeypatch):
    monkeypatch.setattr(bag_files, "MOST_BYTES", LIMIT)
    monkeypatch.setattr(bag_files, "MOST_TIMES", 2)
    small = bag_of(tmp_path, kind, np.zeros((40, 60), np.int8))
    assert hn.load_bag_map(small).shape == (40, 60)
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
