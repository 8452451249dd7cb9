"""Limits on what compressed bags unpack to: a small file may hold any number of zeros.

rosbags unpacks a chunk at once, whatever its size. Its decompressors are replaced by ones that stop
at a limit, which changes nothing for bags within it.
"""

from __future__ import annotations

import bz2
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

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


class _Unpacker(Protocol):
    """What bz2, lz4 and zstd have in common."""

    @property
    def eof(self) -> bool: ...
    @property
    def unused_data(self) -> bytes | None: ...
    def decompress(self, data: bytes, max_length: int = -1) -> bytes: ...


def unpacked(make: Callable[[], Any], data: bytes, what: str, most_bytes: int) -> bytes:
    """Return what compressed frames hold.

    Parameters
    ----------
    make
        Makes a decompressor of one frame, as in the module bz2.
    data
        The frames.
    what
        Words for them in messages.
    most_bytes
        Size in bytes at which to stop.

    Raises
    ------
    TooLargeError
        When they hold more.
    EOFError
        When the last one has no end, or there are more than 10,000.
    """
    parts: list[bytes] = []
    left = most_bytes
    for _ in range(_MOST_FRAMES):
        unpacker: _Unpacker = make()
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
        found: bytes = self._file.read(size)
        self._left -= len(found)
        if self._left < 0:
            raise TooLargeError("a file of the bag", self._most)
        return found


@cache
def bound_rosbags() -> None:
    """Replace the decompressors of rosbags, once."""
    from lz4.frame import (  # type: ignore[import-untyped]  # noqa: PLC0415 - an extra
        LZ4FrameDecompressor,
    )
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
