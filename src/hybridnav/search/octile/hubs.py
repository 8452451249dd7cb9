"""Hub labels of the corner cells of a jump-point graph: octile distances in microseconds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.moves import FAR
from hybridnav.search.kernels.labels import labels_of_corners
from hybridnav.search.octile.kernels import hubs as kernels
from hybridnav.search.octile.kernels.legs import legs_that_follow

if TYPE_CHECKING:
    from hybridnav._base.typing import AnyArray, BoolArray, IntArray, LongArray


@copies_alike
@dataclass(frozen=True, eq=False)
class JumpHubs:
    """Labels of corner cells, and the corner cells that each square of the map is joined to."""

    entries: LongArray
    """int64 (m,), the rank of the hub, and below it the cost from the corner cell."""
    offset: IntArray
    """int32 (17 n + 1,), offsets of the parts of each label: the corner cell itself, then the
    paths that begin with a leg of each class."""
    begin: IntArray
    """int32 (squares + 1,), offsets of the views of each square of 4 by 4 cells."""
    views: IntArray
    """int32 (v, 2), a corner cell, and a bit for each cell of the square that is joined to it."""

    @cached_property
    def ranges(self) -> LongArray:
        """See `ranges_of_legs`."""
        return kernels.ranges_of_legs(legs_that_follow())

    @property
    def arrays(self) -> tuple[AnyArray, ...]:
        """The arrays in the order of the kernels."""
        return self.entries, self.offset, self.begin, self.views

    def fault(self, shape: tuple[int, int], n_corners: int) -> str:
        """Return what would lead a query out of the arrays, on a graph of a shape with so many
        corner cells; empty for nothing."""
        down, across = (-(size // -kernels.SIDE) for size in shape)
        if len(self.begin) != down * across + 1:
            return f"{len(self.begin) - 1} squares"
        hubs = self.entries >> kernels.BITS
        if (hubs >= n_corners).any() or (self.views[:, 0] >= n_corners).any():
            return "views or entries name what does not exist"
        return ""

    def room(self, n_corners: int) -> tuple[LongArray, LongArray]:
        """Return work arrays of a query."""
        most = int(np.diff(self.begin).max(initial=1))
        return np.empty((2, kernels.PARTS * most, 3), np.int64), np.full(n_corners, FAR)

    @property
    def n_bytes(self) -> int:
        """Bytes of memory."""
        return sum(array.nbytes for array in self.arrays)


def label_corner_cells(
    tables: tuple[Any, ...],
    places: LongArray,
    plain: tuple[AnyArray, ...],
    is_free: BoolArray,
    most_mb: float,
) -> JumpHubs | None:
    """Label the corner cells of a graph with hubs, within some memory.

    `tables`: see the kernel `join`; their order numbers the corner cells of the graph; `places`:
    the places of the corner cells of the graph; `plain`: places, offsets of arcs, and arcs of the
    graph before it was contracted; int32 (n,), its corner cells, those on most paths first;
    `is_free`: bool (rows, cols), the free cells of the framed rectangle; `most_mb`: most memory of
    the labels, in 10^6 bytes. Returns None if they need more memory.
    """
    order, (at_places, first, arcs, ranked) = tables[2], plain
    most, n = int(most_mb * 1e6), len(places)
    starts, hubs, lengths, onward, is_whole = labels_of_corners(
        (at_places, legs_that_follow()), (first, arcs), ranked, most // 8
    )
    if not is_whole:
        return None
    at = np.repeat(np.arange(n, dtype=np.int32), np.diff(starts))
    # Each corner cell is a hub of its own.
    parts = kernels.PARTS * order[ranked].astype(np.int64)
    parts = np.concatenate([parts, kernels.parts_of(at_places, order, at, onward)])
    ranks = np.concatenate([np.arange(n), hubs]).astype(np.int64)
    costs = np.concatenate([np.zeros(n), lengths]).astype(np.int64)
    by_part = np.argsort(parts, kind="stable")
    entries = (ranks << kernels.BITS | costs)[by_part]
    offset = np.searchsorted(parts[by_part], np.arange(kernels.PARTS * n + 1)).astype(np.int32)
    room = (most - entries.nbytes - offset.nbytes) // 8
    begin, views, is_whole = kernels.views_of_squares(tables, places, is_free, room)
    made = JumpHubs(entries, offset, begin, views)
    if not is_whole or made.n_bytes > most:
        return None
    for array in made.arrays:
        array.flags.writeable = False
    return made
