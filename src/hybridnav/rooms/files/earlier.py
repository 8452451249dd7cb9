"""Files of earlier versions, whose cells are packed as text: what their outlines miss."""

from __future__ import annotations

import base64
import binascii
import lzma
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import ndimage

from hybridnav._base.rows import in_runs
from hybridnav._base.typing import IntArray, LongArray
from hybridnav.errors import RoomsError
from hybridnav.maps import NO_ROOM, CellClass, OccupancyGrid
from hybridnav.rooms.files.entries import Outline, signature_of

_NAMELESS = 0
"""Fingerprint that stands for no room."""
_MOST_BYTES = 2**20
_BITS = 7
_BY_RULE = " by rule"
"""What the signatures of files have more than those of still earlier versions."""
_LEAST_NAMELESS_M2 = 1.0
_FORMAT = lzma.FORMAT_RAW
_FILTERS = [{"id": lzma.FILTER_LZMA2, "dict_size": _MOST_BYTES, "lc": 0, "lp": 0, "pb": 0}]


@dataclass(frozen=True)
class PackedCells:
    """The cells that outlines miss."""

    runs_of: Mapping[int, tuple[LongArray, LongArray]]
    """First flat cell and length of each run, by the fingerprint of the outline."""
    by_rule: bool = True
    """Whether cells inside no outline, in walls and in pockets follow the rule of rooms that are
    found; else the outlines alone."""

    @property
    def written(self) -> Collection[int]:
        """The fingerprints of the outlines that were written with these cells."""
        return self.runs_of.keys()

    def labels(
        self, written: IntArray, outlines: Sequence[Outline], drawn: IntArray, grid: OccupancyGrid
    ) -> IntArray:
        """Return the rooms of the outlines that nobody has changed, int32 (rows, cols).

        `written`: what these outlines contain, it is overwritten; `outlines`: themselves; `drawn`:
        the rooms of the others, which take what they contain.
        """
        if self.by_rule and outlines:
            # Loads scipy and numba.
            from hybridnav.rooms.find import reaching  # noqa: PLC0415

            is_free = grid.measured == CellClass.FREE
            part_of, _ = ndimage.label(is_free)
            small = np.bincount(part_of.ravel()) * grid.cell_area_m2 < _LEAST_NAMELESS_M2
            written[is_free & small[part_of]] = NO_ROOM
            self._give(written, outlines)
            written[~is_free | (drawn != NO_ROOM)] = NO_ROOM
            written = np.where(is_free, written, reaching(written, grid))
        self._give(written, outlines)
        return written

    def _give(self, label_of: IntArray, outlines: Sequence[Outline]) -> None:
        """Give the cells that outlines miss to their rooms, and take away those of no room."""
        flat = label_of.ravel()
        if _NAMELESS in self.runs_of:
            flat[in_runs(*self.runs_of[_NAMELESS])] = NO_ROOM
        for outline in outlines:
            flat[in_runs(*self.runs_of[outline.fingerprint])] = outline.room


def unpacked(lines: Sequence[Any], where: str, grid: OccupancyGrid) -> PackedCells:
    """Return the cells that belong to each outline beyond those that it would have.

    `lines`: what the file has; `where`: the file, for messages; `grid`: the map. If it is not the
    one that the lines were packed for, there are no cells. Raises `RoomsError` when the lines are
    damaged.
    """
    try:
        reader = lzma.LZMADecompressor(_FORMAT, filters=_FILTERS)
        content = reader.decompress(base64.b64decode("".join(lines), validate=True), _MOST_BYTES)
        numbers = _varints(content)
        signature = next(numbers)
        by_rule = signature == signature_of(grid, _BY_RULE)
        if not by_rule and signature != signature_of(grid):
            return PackedCells({})
        return PackedCells(dict(_runs(numbers, grid.shape)), by_rule)
    except (TypeError, ValueError, binascii.Error, lzma.LZMAError, StopIteration, RuntimeError):
        problem = "damaged, delete the list: the outlines alone then count"
        raise RoomsError(f"{where}: cells: {problem}") from None


def _runs(
    numbers: Iterator[int], shape: tuple[int, int]
) -> Iterator[tuple[int, tuple[LongArray, LongArray]]]:
    rows, cols = shape
    heads = [(next(numbers), _limited(next(numbers))) for _ in range(_limited(next(numbers)))]
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


def _varints(content: bytes) -> Iterator[int]:
    """Return the whole numbers of a text of bytes, seven bits each, the low ones first."""
    number, shift = 0, 0
    for byte in content:
        number += (byte % (1 << _BITS)) << shift
        shift += _BITS
        if shift > 9 * _BITS:
            raise ValueError
        if byte < 1 << _BITS:
            yield number
            number, shift = 0, 0
