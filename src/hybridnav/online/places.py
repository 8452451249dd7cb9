"""The table of places, in chunks that versions share."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav._copies import frozen

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from hybridnav._typing import AnyArray

PLACE = np.dtype(
    [
        ("area", np.int64),
        ("cell", np.int32, (2,)),
        ("box", np.int32, (4,)),
        ("whole_at", np.uint8),
    ]
)
"""A place: its cells, 0 where there is no place; its surviving cell; its least row and column, and
the first ones beyond it; the level from which it is whole."""

_CHUNK = 256


class PlaceTable:
    """Places by number. A number is never used again; chunks without a place are dropped.

    Parameters
    ----------
    chunks
        Read-only arrays of `PLACE` by the number of their first place over their length.
    """

    def __init__(self, chunks: Mapping[int, AnyArray]) -> None:
        self._chunks = dict(chunks)
        self._own: set[int] = set()

    def next_version(self) -> PlaceTable:
        """Return a table that shares all chunks with this one."""
        return PlaceTable(self._chunks)

    def close(self) -> None:
        """Drop empty chunks and make all others read-only: the version is complete."""
        for at in self._own:
            if not self._chunks[at]["area"].any():
                del self._chunks[at]
            else:
                frozen(self._chunks[at])
        self._own.clear()

    def has(self, place: int) -> bool:
        """Return whether there is such a place."""
        chunk = self._chunks.get(place // _CHUNK)
        return chunk is not None and bool(chunk[place % _CHUNK]["area"])

    def known(self, places: Iterable[int]) -> list[int]:
        """Return those of some numbers that are places."""
        return [place for place in places if self.has(place)]

    def read(self, places: Iterable[int]) -> AnyArray:
        """Return the rows of some places, `PLACE` (n,)."""
        rows = [self._chunks[place // _CHUNK][place % _CHUNK] for place in places]
        return np.array(rows, PLACE)

    def write(self, places: Iterable[int], rows: AnyArray) -> None:
        """Set the rows of some places."""
        for place, row in zip(places, rows, strict=True):
            at = place // _CHUNK
            if at not in self._own:
                chunk = self._chunks.get(at)
                self._chunks[at] = np.zeros(_CHUNK, PLACE) if chunk is None else chunk.copy()
                self._own.add(at)
            self._chunks[at][place % _CHUNK] = row

    def drop(self, places: Iterable[int]) -> None:
        """Forget some places."""
        gone = list(places)
        self.write(gone, np.zeros(len(gone), PLACE))

    def numbers(self, first: int = 0) -> list[int]:
        """Return the numbers of all places from a first one on, ascending."""
        return [
            number
            for at in sorted(at for at in self._chunks if at >= first // _CHUNK)
            for i in np.flatnonzero(self._chunks[at]["area"])
            if (number := at * _CHUNK + int(i)) >= first
        ]
