"""The cells that outlines of few corners miss, packed into a few lines of a file of rooms."""

from __future__ import annotations

import base64
import binascii
import lzma
import zlib
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hybridnav.errors import RoomsError
from hybridnav.maps import NO_ROOM

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.maps import OccupancyGrid

Runs = tuple["LongArray", "LongArray"]
"""First flat cell and length of each run of cells."""

NAMELESS = 0
"""Fingerprint that stands for no room."""
_DECIMALS = 4
_LINE = 120
"""Characters in a line."""
_MOST_BYTES = 2**20
_BITS = 7
_BY_RULE = " by rule"
"""What the signatures of files have more than those of earlier versions."""
_FORMAT = lzma.FORMAT_RAW
_FILTERS = [{"id": lzma.FILTER_LZMA2, "dict_size": _MOST_BYTES, "lc": 0, "lp": 0, "pb": 0}]
"""For bytes that are small numbers: no bits of those before, nor of their positions."""


class Missed(NamedTuple):
    """The cells of a file that its outlines miss."""

    runs_of: Mapping[int, Runs]
    """By the fingerprint of each outline that was written with them."""
    by_rule: bool = True
    """Whether cells inside no outline, in walls and in pockets follow `rooms_paint.by_rule`; in
    files of earlier versions they follow the outlines alone."""


def fingerprint(rings: Sequence[FloatArray]) -> int:
    """Return a number of the coordinates of an outline, which another outline hardly has."""
    text = ";".join(",".join(f"{n:.{_DECIMALS}f}" for n in ring.ravel().tolist()) for ring in rings)
    return zlib.crc32(text.encode()) or 1


def packed(
    missed: BoolArray, label_of: IntArray, outlines: Sequence[tuple[int, int]], grid: OccupancyGrid
) -> list[str]:
    """Return lines that hold the rooms of the cells that outlines miss, and which outlines these
    are.

    Parameters
    ----------
    missed
        bool (rows, cols), cells whose room is not the one that they would be read with.
    label_of
        int32 (rows, cols), -1 for no room.
    outlines
        The room and the fingerprint of each outline that is written.
    grid
        The map.
    """
    cells = np.flatnonzero(missed)
    labels = label_of.ravel()[cells]
    heads: list[int] = []
    starts: list[LongArray] = []
    lengths: list[LongArray] = []
    packed_rooms: set[int] = set()
    for label, number in [(NO_ROOM, NAMELESS), *outlines]:
        mine = cells[(labels == label) & (label not in packed_rooms)]
        packed_rooms.add(label)
        begins = np.flatnonzero(np.diff(mine, prepend=-2) != 1)
        heads += [number, len(begins)]
        starts.append(np.diff(mine[begins], prepend=0))
        lengths.append(np.diff(begins, append=len(mine)))
    # Numbers of a kind beside each other take fewer bytes.
    runs = np.concatenate([*starts, *lengths]).tolist()
    numbers = [_signature(grid, _BY_RULE), len(heads) // 2, *heads, *runs]
    content = lzma.compress(b"".join(map(_varint, numbers)), _FORMAT, filters=_FILTERS)
    text = base64.b64encode(content).decode()
    return [text[at : at + _LINE] for at in range(0, len(text), _LINE)]


def unpacked(lines: Sequence[Any], where: str, grid: OccupancyGrid) -> Missed:
    """Return the cells that belong to each outline beyond those that it would have.

    Parameters
    ----------
    lines
        As `packed` returned them.
    where
        The file, for messages.
    grid
        The map. If it is not the one that the lines were packed for, there are no cells.

    Raises
    ------
    RoomsError
        When the lines are damaged.
    """
    if not lines:
        return Missed({})
    damaged = RoomsError(f"{where}: cells: damaged, delete the list: the outlines alone then count")
    try:
        text = "".join(lines)
        reader = lzma.LZMADecompressor(_FORMAT, filters=_FILTERS)
        content = reader.decompress(base64.b64decode(text, validate=True), _MOST_BYTES)
        numbers = _varints(content)
        signature = next(numbers)
        by_rule = signature == _signature(grid, _BY_RULE)
        if not by_rule and signature != _signature(grid):
            return Missed({})
        return Missed(dict(_runs(numbers, grid.shape)), by_rule)
    except (TypeError, ValueError, binascii.Error, lzma.LZMAError, StopIteration, RuntimeError):
        raise damaged from None


def _runs(numbers: Iterator[int], shape: tuple[int, int]) -> Iterator[tuple[int, Runs]]:
    rows, cols = shape
    n_outlines = _limited(next(numbers))
    heads = [(next(numbers), _limited(next(numbers))) for _ in range(n_outlines)]
    count = _limited(sum(count for _, count in heads))
    steps, lengths = ([next(numbers) for _ in range(count)] for _ in range(2))
    at = 0
    for number, n_runs in heads:
        here = slice(at, at + n_runs)
        at += n_runs
        starts = np.cumsum(np.array(steps[here], dtype=np.int64))
        sizes = np.array(lengths[here], dtype=np.int64)
        ends = starts + sizes
        if n_runs and (starts.min() < 0 or sizes.min() < 0 or ends.max() > rows * cols):
            raise ValueError
        if (starts[1:] < ends[:-1]).any():
            raise ValueError
        yield number, (starts, sizes)


def _limited(count: int) -> int:
    if count > _MOST_BYTES:
        raise ValueError
    return count


def _signature(grid: OccupancyGrid, more: str = "") -> int:
    """Return a number of the frame and the size of a map, and of some text."""
    frame = grid.frame
    values = (*grid.shape, frame.resolution_m, *frame.origin_m, frame.yaw_rad)
    return zlib.crc32((" ".join(f"{value:.9g}" for value in values) + more).encode())


def _varint(number: int) -> bytes:
    """Return a whole number >= 0 in as few bytes as it needs, the low bits first."""
    out = bytearray()
    while number >= 1 << _BITS:
        out.append(number % (1 << _BITS) + (1 << _BITS))
        number >>= _BITS
    out.append(number)
    return bytes(out)


def _varints(content: bytes) -> Iterator[int]:
    number, shift = 0, 0
    for byte in content:
        number += (byte % (1 << _BITS)) << shift
        shift += _BITS
        if shift > 9 * _BITS:
            raise ValueError
        if byte < 1 << _BITS:
            yield number
            number, shift = 0, 0
