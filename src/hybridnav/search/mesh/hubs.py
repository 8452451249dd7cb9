"""Hub labels of the corners of a mesh: shortest any-angle paths in microseconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.progress import no_progress
from hybridnav.search.kernels.labels import labels_of_corners, uses_of_corners
from hybridnav.search.mesh.kernels.hubs import ABOVE
from hybridnav.search.mesh.kernels.squares import (
    corners_by_square,
    squares_of_polygons,
    squares_of_views,
    views_of_squares,
)

if TYPE_CHECKING:
    from hybridnav._base.progress import Progress
    from hybridnav._base.typing import AnyArray, FloatArray, IntArray, LongArray
    from hybridnav.search.mesh import ConvexMesh

    Edges = tuple[LongArray, IntArray]

_SIDES = (4, 8, 16, 32, 64)
"""Sides of squares in cells; the first that the memory allows is taken."""
_SOURCES = 100
"""Corners from which paths are counted to rank all: four times as many leave 5 % fewer entries."""
_BYTES, _BYTES_OF_VIEW = 8, 12
"""Bytes of an entry of a label, and of a corner of a square."""

_MOST_CORNERS = 1 << 23
"""Most corners that leave room for the bits of a view."""
_MOST_SEEN = 1 << ABOVE
"""Most corners of a square."""
_MOST_BITS = 46
"""Most bits of a distance, so that the number of a corner has room below the sum of two."""


@copies_alike
@dataclass(frozen=True, eq=False)
class HubLabels:
    """Labels of the corners at which paths bend, and the corners that each square of the map sees.

    A shortest path leads from its start to a corner that it sees, from there to a hub, and on to a
    corner that its goal sees. Both corners have the hub in their labels.

    Examples
    --------
    >>> from hybridnav.search.mesh import MeshSearch, build_mesh
    >>> search = MeshSearch(build_mesh(np.array([[True, False, True], [True, True, True]])))
    >>> search.label(1.0)
    True
    >>> len(search.labels.entries), round(search.path(((0, 0), (0, 2)),
    ...     ((0.5, 0.5), (0.5, 2.5))).length_cells, 3)
    (5, 2.414)
    """

    entries: LongArray
    """int64 (m,), the rank of the hub, and below it the distance from the corner in units."""
    layout: FloatArray
    """float64 (4,), side of the squares in cells, number of them in a row, bits of a distance, and
    the unit in cells."""
    begin: IntArray
    """int32 (squares + 1,), offsets of the views of each square."""
    views: IntArray
    """int32 (v, 3), a corner that sees something of the square, with eight bits below. For each
    quarter of the square they say whether the corner sees all free space there, and below these
    whether it sees something. Then its entries from one to before another; on all others, a path
    from the square would be slack."""
    first: IntArray
    """int32 (2 n + 1,), the label of corner i in two parts. Paths of `first[2 i]` to `first[2 i +
    1]` go on into one of the two quadrants beside its blocked cell, paths of `first[2 i + 1]` to
    `first[2 i + 2]` into the other. The corner itself comes first, then directions nearest to the
    wall."""
    offset: IntArray
    """int32 (p + 1,), offsets of the entries of each part."""
    heads: IntArray
    """int32 (p,), the next corner on the paths of each part, the corner itself for itself."""

    @property
    def arrays(self) -> tuple[AnyArray, ...]:
        """The arrays in the order of the kernels."""
        kept = self.entries, self.layout, self.begin, self.views
        return *kept, self.first, self.offset, self.heads

    @property
    def n_bytes(self) -> int:
        """Bytes of memory."""
        return sum(array.nbytes for array in self.arrays)

    def fault(self, shape: tuple[int, int], n_corners: int) -> str:
        """Return what would lead a query out of the arrays, on a map of a shape with so many
        corners; empty for nothing."""
        side, n_across, bits, unit = self.layout.tolist()
        is_whole = side >= 1 and side == int(side) and bits in range(1, _MOST_BITS + 1)
        if not is_whole or not 0 < unit < np.inf:
            return f"a layout of {self.layout}"
        rows, cols = (size // int(side) + 2 for size in shape)
        if n_across != cols or len(self.begin) != rows * cols + 1:
            return f"{len(self.begin) - 1} squares of {side:.0f} cells"
        if np.diff(self.begin).max(initial=0) > _MOST_SEEN:
            return "more corners of a square than have a number"
        seen, low, high = self.views.T
        is_inside = (seen >> 8 < n_corners) & (low <= high) & (high <= len(self.entries))
        if not is_inside.all() or (self.entries >> int(bits) >= n_corners).any():
            return "views or entries name what does not exist"
        return ""


def label_corners(
    mesh: ConvexMesh,
    arrays: tuple[AnyArray, ...],
    edges: Edges,
    most_mb: float,
    progress: Progress = no_progress,
) -> HubLabels | None:
    """Label the corners of a mesh with hubs, within some memory.

    `arrays`: arrays for the kernel `successors`; `edges`: edges of `find_edges`; `most_mb`: most
    memory of the labels, in 10^6 bytes; `progress`: called after each step with the number of steps
    done and of all steps. Returns None if they need more memory: the work ends as soon as that is
    known.
    """
    most = int(most_mb * 1e6)
    if len(mesh.corners) > _MOST_CORNERS:
        return None
    bending = np.flatnonzero(mesh.is_convex)
    sources = bending[:: max(1, len(bending) // _SOURCES)].astype(np.int32)
    uses = uses_of_corners(arrays, edges, sources)
    ranked = bending[np.argsort(-uses[bending], kind="stable")].astype(np.int32)
    progress(1, 3)
    *labels, is_whole = labels_of_corners(arrays, edges, ranked, most // _BYTES)
    progress(2, 3)
    if not is_whole:
        return None
    entries, first, offset, heads, turns, scale = _parted(mesh, ranked, labels)
    left = most - sum(array.nbytes for array in (entries, first, offset, heads))
    squares = _squares(mesh, arrays, (first, offset, turns), left)
    progress(3, 3)
    if squares is None:
        return None
    sizes, begin, views = squares
    found = HubLabels(entries, np.array([*sizes, *scale]), begin, views, first, offset, heads)
    for array in found.arrays:
        array.flags.writeable = False
    return found


def _parted(
    mesh: ConvexMesh, ranked: IntArray, labels: list[AnyArray]
) -> tuple[LongArray, IntArray, IntArray, IntArray, FloatArray, tuple[float, float]]:
    """Part labels of `labels_of_corners` by the next corner.

    Returns the arrays `entries`, `first`, `offset` and `heads` of `HubLabels`; float32 (p, 2), the
    direction to the next corner, along the wall and away from it; bits of a distance, and the unit
    in cells.
    """
    offset, hubs, lengths, onward = labels
    n = len(mesh.corners)
    at = np.repeat(np.arange(n, dtype=np.int32), np.diff(offset))
    towards = (mesh.corners[onward] - mesh.corners[at])[:, ::-1].astype(np.float64)
    # See `lobe_of`.
    kinds = mesh.kinds[at]
    ex, ey = np.where(kinds & 1, 1, -1), np.where(kinds & 2, 1, -1)
    lobe = 1 - ((towards[:, 0] * ex >= 0) & (towards[:, 1] * ey <= 0))
    along = np.where(lobe[:, None] == 1, np.abs(towards[:, ::-1]), np.abs(towards))
    turns = (along / np.sqrt((along * along).sum(axis=1))[:, None]).astype(np.float32)
    # Each corner is a hub of its own, in both quadrants.
    own, ranks = np.repeat(ranked, 2), np.repeat(np.arange(len(ranked), dtype=np.int32), 2)
    place = np.concatenate([2 * own + np.arange(len(own)) % 2, 2 * at + lobe])
    heads = np.concatenate([own, onward])
    turns = np.concatenate([np.tile(np.array([1, 0], np.float32), (len(own), 1)), turns])
    is_other = np.arange(len(place)) >= len(own)
    order = np.lexsort((heads, turns[:, 1], is_other, place))
    place, heads, turns = place[order], heads[order], turns[order]
    begins = np.ones(len(order), np.bool_)
    begins[1:] = (place[1:] != place[:-1]) | (heads[1:] != heads[:-1])
    begin = np.flatnonzero(begins)
    first = np.searchsorted(place[begin], np.arange(2 * n + 1)).astype(np.int32)
    bits = min(_MOST_BITS, 62 - len(ranked).bit_length())
    longest = int(lengths.max(initial=float(sum(mesh.polygon_at.shape))))
    unit = 2.0 ** (longest.bit_length() - bits)
    units = np.concatenate([np.zeros(len(own)), np.round(lengths / unit)]).astype(np.int64)
    entries = (np.concatenate([ranks, hubs]).astype(np.int64) << bits | units)[order]
    ends = np.append(begin, len(order)).astype(np.int32)
    return entries, first, ends, heads[begin], turns[begin], (float(bits), unit)


def _squares(
    mesh: ConvexMesh, arrays: tuple[AnyArray, ...], parts: tuple[AnyArray, ...], most: int
) -> tuple[tuple[int, int], IntArray, IntArray] | None:
    """Return side and number in a row of squares that fit into so many bytes, and their views; None
    if none do."""
    walls = np.full(len(mesh.corners), -1, np.int32)
    slots = np.flatnonzero(mesh.twins < 0)
    walls[mesh.begins[slots]] = slots
    rows, cols = mesh.polygon_at.shape
    for side in _SIDES:
        half, across = side / 2, (cols // side + 2, 2 * cols // side + 2)
        n_squares, n_quarters = across[0] * (rows // side + 2), across[1] * (2 * rows // side + 2)
        room = max(most - 4 * n_squares, 0) // _BYTES_OF_VIEW
        squares = squares_of_polygons(arrays, half, across[1])
        layout = half, across[1], n_quarters
        found = np.empty(min(4 * room, 1 << 20), np.int32)
        offset = squares_of_views(arrays, walls, squares, layout, found)
        if offset[-1] > 4 * room:
            continue
        if offset[-1] > len(found):
            found = np.empty(offset[-1], np.int32)
            offset = squares_of_views(arrays, walls, squares, layout, found)
        begin, listed = corners_by_square(
            offset, found[: offset[-1]], across[1], (across[0], n_squares)
        )
        if len(listed) > room:
            continue
        begin, seen = views_of_squares(arrays, parts, (float(side), across[0]), begin, listed)
        return None if np.diff(begin).max() > _MOST_SEEN else ((side, across[0]), begin, seen)
    return None
