"""Parts of proofs: trees of cheapest paths, corners with distances, and chains of walls."""

from __future__ import annotations

import base64
import zlib
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

from hybridnav.search.kernels.proofs import ONE, OUTSIDE, tree_of, walls_round
from hybridnav.search.mesh import MeshSearch, build_mesh, shortest_paths

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._base.typing import (
        AnyArray,
        BoolArray,
        ByteArray,
        FloatArray,
        IntArray,
        LongArray,
    )


class CostTree:
    """The tree of cheapest paths between two nodes, cells or corners of cells.

    Parameters
    ----------
    free
        bool (rows, cols), cells that may be entered.
    units
        int32 (rows, cols), the factors of the cells in units of 2^-14; None for 1.
    costs_of
        Returns the costs of moves between nodes, from walls and factors with a rim.
    ends
        int64 (2, 2), the nodes (row, col).
    length_cells
        Length that no path of interest has.
    """

    def __init__(
        self,
        free: BoolArray,
        units: IntArray | None,
        costs_of: Callable[[BoolArray, AnyArray], LongArray],
        ends: LongArray,
        length_cells: float,
    ) -> None:
        self._low, high = _box_of(free, (ends[0], ends[1]), length_cells)
        part = np.s_[self._low[0] : high[0], self._low[1] : high[1]]
        # There are more corners than cells in a row.
        walls = np.pad(~free[part], (1, 2), constant_values=True)
        factors = np.full(walls.shape, ONE)
        if units is not None:
            factors[1:-2, 1:-2] = units[part]
        self._costs = costs_of(walls, factors)
        self._ends = ends - self._low + 1

    def grown(self, limit: int) -> tuple[ByteArray, int]:
        """Return the tree up to a limit, with a rim, and the least cost of the second node."""
        start, goal = map(tuple, self._ends.tolist())
        tree, cost = tree_of(self._costs, start, goal, limit)
        return tree, int(cost)

    def stated(self, limit: int) -> dict[str, Any]:
        """Return the part of the tree that proves that no path costs less than a limit."""
        tree, _ = self.grown(limit)
        shown = np.concatenate([np.argwhere(tree < OUTSIDE), self._ends])
        first, last = shown.min(axis=0), shown.max(axis=0) + 1
        kept = tree[first[0] : last[0], first[1] : last[1]]
        text = base64.b85encode(zlib.compress(kept.tobytes(), 9)).decode()
        return {"box": [*(first + self._low - 1).tolist(), *kept.shape], "tree": text}


def _box_of(
    free: BoolArray, cells: tuple[AnyArray, AnyArray], length_cells: float
) -> tuple[LongArray, LongArray]:
    """Return the first row and column, and the ends of both, of all cells that a path of some
    length between two cells can reach, and of some more."""
    low, high = np.minimum(*cells), np.maximum(*cells)
    spare = np.maximum(length_cells - (high - low), 0) / 2 + 3
    first = np.maximum(low - spare, 0).astype(np.int64)
    return first, np.minimum(high + spare, free.shape).astype(np.int64)


def parting_chain(
    free: BoolArray, start: tuple[int, int], goal: tuple[int, int]
) -> LongArray | None:
    """Return walls that part two cells: a closed chain that goes round one of the two.

    Parameters
    ----------
    free
        bool (rows, cols), cells that may be entered; all else, and the outside, are walls.
    start, goal
        Free cells (row, col).

    Returns
    -------
    LongArray | None
        int64 (n, 2), (row, col), the last one equal to the first one; each is an 8-neighbour of
        the next one. Cells outside the map, from -1 to rows or columns, are its rim. It is the
        border of all that can be reached from the start, on the side of the goal. None where the
        two are connected.
    """
    parts, _ = ndimage.label(np.pad(free, 2))
    area = parts == parts[start[0] + 2, start[1] + 2]
    if area[goal[0] + 2, goal[1] + 2]:
        return None
    others, _ = ndimage.label(~area, np.ones((3, 3)))
    side = others == others[goal[0] + 2, goal[1] + 2]
    row, col = divmod(int(np.argmax(area[1:] & side[:-1])), area.shape[1])
    chain = walls_round(area, row + 1, col) - 2
    chain = np.concatenate([chain, chain[:1]])
    is_new = np.ones(len(chain), np.bool_)
    is_new[1:] = (chain[1:] != chain[:-1]).any(axis=1)
    found: LongArray = chain[is_new]
    return found


def corners_near(
    free: BoolArray, ends: FloatArray, cells: LongArray, bound_cells: float
) -> tuple[LongArray, FloatArray]:
    """Return the corners (row, col) over which a path may be shorter than the bound, as far as
    their distances from the start and the straight way to the goal tell, and these distances."""
    low, high = _box_of(free, (cells[0], cells[1]), bound_cells)
    part = np.pad(free[low[0] : high[0], low[1] : high[1]], 1)
    walls = [~part[i : i - 1 or None, j : j - 1 or None] for i in (0, 1) for j in (0, 1)]
    corners = np.argwhere(np.sum(walls, axis=0) == 1)
    to_goal = np.hypot(*(corners + low - ends[1]).T)
    is_near = np.hypot(*(corners + low - ends[0]).T) + to_goal < bound_cells
    corners, to_goal = corners[is_near], to_goal[is_near]
    if not len(corners):
        return corners, to_goal
    # Of the three free cells at a corner, the one below it on the left or the one above that.
    at = corners - 1
    at[~part[tuple(corners.T)]] += (1, 0)
    count = len(corners)
    found = shortest_paths(
        MeshSearch(build_mesh(np.ascontiguousarray(part[1:-1, 1:-1]))),
        (np.tile(cells[0] - low, (count, 1)), at),
        (np.tile(ends[0] - low, (count, 1)), corners.astype(np.float64)),
    ).length_cells
    is_near = found + to_goal < bound_cells
    return corners[is_near] + low, found[is_near]
