"""What sides with a direction make of a jump-point graph."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.kernels.moves import legal_moves
from hybridnav._base.moves import STEPS
from hybridnav.search.contraction import HEAD_SHIFT, pack
from hybridnav.search.octile.kernels.legs import BACKWARD, ONWARD
from hybridnav.search.octile.kernels.tables import turning_cells

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray
    from hybridnav.search.directed import DirectedSides


def near_sides(
    framed: ByteArray, one_way: DirectedSides, origin: tuple[int, int]
) -> tuple[ByteArray, ByteArray, LongArray, LongArray]:
    """Return what sides with a direction forbid, by framed cell: moves, and moves backwards; and
    the flat cells beside the forbidden ones, and those of them where paths may turn."""
    width = framed.shape[1]
    is_free = framed.view(np.bool_)
    moves, steps = legal_moves(is_free, False).ravel(), STEPS @ np.array([width, 1])
    rows, cols = np.divmod(one_way.forbidden[0], one_way.shape[1]) - np.array(origin)[:, None]
    is_in = (rows > 0) & (rows < len(framed) - 1) & (cols > 0) & (cols < width - 1)
    cells, masks = (rows * width + cols)[is_in], one_way.forbidden[1][is_in]
    barred, against = np.zeros((2, moves.size), np.uint8)
    barred[cells] = masks & moves[cells]
    moves &= ~barred
    heads = [cells]
    for k in range(8):
        heads.append(cells[barred[cells] >> k & 1 == 1] + steps[k])
        against[heads[-1]] |= np.uint8(1 << (k + 4 & 7))
    ends = np.unique(np.concatenate(heads))
    zone = np.unique(ends[:, None] + np.append(steps, 0))
    zone = zone[is_free.ravel()[zone]]
    barred, against = barred.reshape(framed.shape), against.reshape(framed.shape)
    return barred, against, zone, zone[turning_cells(moves, width, zone)]


def with_corners(
    tables: tuple[LongArray, ByteArray],
    corners: IntArray,
    kinds: ByteArray,
    near: Sequence[LongArray],
) -> tuple[IntArray, ByteArray]:
    """Return the corner cells and their kinds with more of them, which the tables are told.

    `tables`: the index and the kinds by framed cell, see `number_cells`;
    `near`: the flat cells beside sides with a direction, whose kind is 0, and the corner cells
    among them.
    """
    (index, halts), (zone, turns) = tables, near
    every = np.union1d(corners, turns).astype(np.int32)
    found = np.zeros(len(every), np.uint8)
    found[np.searchsorted(every, corners)] = kinds
    found[np.isin(every, zone)] = 0
    halts.ravel()[turns] = 1
    np.bitwise_or.at(index[:, 1], turns >> 6, np.int64(1) << (turns & 63))
    before = np.searchsorted(every, np.arange(len(index)) << 6)
    index[:, 2] = index[:, 2] >> 32 << 32 | before
    return every, found


def with_reverses(first: IntArray, arcs: LongArray) -> tuple[IntArray, LongArray]:
    """Return arcs of which each comes with its reverse: marked as `ONWARD` and `BACKWARD`, if the
    graph has none."""
    n = len(first) - 1
    tails, heads = np.repeat(np.arange(n), np.diff(first)), arcs[:, 1] >> HEAD_SHIFT
    is_lone = ~np.isin(heads * n + tails, tails * n + heads)
    near, far = arcs[is_lone, 1] >> 6 & 63, arcs[is_lone, 1] & 63
    back = np.stack([arcs[is_lone, 0], pack(tails[is_lone], far + BACKWARD, near)], axis=1)
    arcs[is_lone, 1] += ONWARD << 6
    tails = np.concatenate([tails, heads[is_lone]])
    order = np.argsort(tails, kind="stable")
    return offsets_by(tails, n), np.concatenate([arcs, back])[order]


def offsets_by(tails: LongArray, n: int) -> IntArray:
    """Return where the arcs of each of n corner cells begin, int32 (n + 1,), by their tails."""
    return np.append(0, np.cumsum(np.bincount(tails, minlength=n))).astype(np.int32)


def strong_parts(first: IntArray, arcs: LongArray) -> tuple[IntArray, BoolArray]:
    """Return the strong part of each corner cell, int32 (n,), and which of the first k parts can be
    left for which, bool (k, k): those in connected parts that are not strong; one at least."""
    # Loads scipy, which graphs without directions do not need.
    from scipy.sparse import csr_array  # noqa: PLC0415
    from scipy.sparse.csgraph import connected_components, dijkstra  # noqa: PLC0415

    n = len(first) - 1
    heads = (arcs[:, 1] >> HEAD_SHIFT).astype(np.int32)
    graph = csr_array((np.ones(len(heads), np.int8), heads, first), shape=(n, n))
    _, weak = connected_components(graph, connection="weak")
    n_strong, strong = connected_components(graph, connection="strong")
    whole = np.zeros(n_strong, np.int32)
    whole[strong] = weak
    is_split = np.bincount(whole)[whole] > 1
    number = np.empty(n_strong, np.int32)
    number[np.argsort(~is_split, kind="stable")] = np.arange(n_strong)
    k = max(int(is_split.sum()), 1)
    part = number[strong]
    tails = part[np.repeat(np.arange(n), np.diff(first))]
    links = np.stack([tails, part[heads]])[:, tails < k]
    joined = csr_array((np.ones(links.shape[1]), links), shape=(k, k))
    return part.astype(np.int32), np.isfinite(dijkstra(joined, unweighted=True))
