"""Parts of proofs: trees of cheapest paths, corners with distances, and chains of walls."""

import base64
import math
import zlib
from typing import Any, NamedTuple

import numpy as np
from scipy import ndimage

from hybridnav._base.moves import FAR
from hybridnav._base.trig import hypots
from hybridnav._base.typing import AnyArray, BoolArray, ByteArray, FloatArray, IntArray, LongArray
from hybridnav.check_proof import (
    COS,
    LEVEL,
    ONE,
    PLAIN,
    SIN,
    TILTED,
    bars_of,
    costs_of_cells,
    costs_of_corners,
    strings_in,
)
from hybridnav.search.directed import DirectedSides
from hybridnav.search.kernels.proofs import OUTSIDE, strings_of, tree_of, walls_round
from hybridnav.search.lattice import slopes_of
from hybridnav.search.mesh.slits import lines_of

_LESS = 1e-11
"""Cells by which a distance that is stated is below the one that holds without."""


class Grid(NamedTuple):
    """The part of a map that a proof by moves is about, with a rim of walls."""

    walls: BoolArray
    factors: LongArray
    """In units, one where there is none."""
    low: LongArray
    """int64 (2,), what rows and columns of the map have more."""
    ends: LongArray
    """int64 (2, 2), the nodes (row, col) here."""
    barred: ByteArray
    """uint8, bit k for a move in direction k that directions forbid."""


def grid_near(
    free: BoolArray,
    units: IntArray | None,
    ends: LongArray,
    length_cells: float,
    one_way: DirectedSides | None = None,
) -> Grid:
    """Return the part of a map where a path between two nodes may be shorter than a length.

    `free`: bool (rows, cols), cells that may be entered; `units`: int32 (rows, cols), the factors
    of the cells in units of 2^-14; None for 1; `ends`: int64 (2, 2), the nodes (row, col), cells or
    corners of cells; `length_cells`: length that no path of interest has; `one_way`: directed
    sides, None for none.
    """
    low, high = _box_of(free, (ends[0], ends[1]), length_cells)
    part = np.s_[low[0] : high[0], low[1] : high[1]]
    # There are more corners than cells in a row.
    walls = np.pad(~free[part], (1, 2), constant_values=True)
    factors = np.full(walls.shape, ONE)
    if units is not None:
        factors[1:-2, 1:-2] = units[part]
    barred = np.zeros(walls.shape, np.uint8)
    if one_way is not None:
        barred[1:-2, 1:-2] = one_way.moves[part]
    return Grid(walls, factors, low - 1, ends - low + 1, barred)


def moves_of_cells(grid: Grid, limit: int) -> dict[str, Any]:
    """Return the proof that no path of cells costs less than a limit, in units."""
    costs = costs_of_cells(grid.walls, grid.factors)
    start, goal = map(tuple, grid.ends.tolist())
    tree, _ = tree_of(costs, grid.barred, start, goal, limit, PLAIN)
    return _stated(grid, tree)


def moves_of_king(grid: Grid, limit: int, known: tuple[Any, ...]) -> tuple[dict[str, Any], int]:
    """Return the proof that no line costs less than a bound, and that bound, in units.

    The tilts of cells are those of the direction in which costs grow, where all four corners
    belong to the tree, and elsewhere the one of an empty map. `known` is for `slopes_of`.
    """
    start, goal = map(tuple, grid.ends.tolist())
    shape = grid.walls.shape
    down, across = (abs(np.arange(n) - at) for n, at in zip(shape, goal, strict=True))
    plain = TILTED[:, LEVEL].tolist()
    ahead = np.maximum(down[:, None], across) * plain[0]
    ahead += np.minimum(down[:, None], across) * (plain[1] - plain[0])
    ahead *= 2 * ONE
    tilts = np.full(shape, LEVEL, np.uint8)
    least_moves = int(TILTED[0].min()), int(TILTED[1].min())
    cells, rises = slopes_of(*known)
    steep, flat = np.sort(abs(rises), axis=1).T[::-1]
    found = np.argmax(steep * COS[:, None] + flat * SIN[:, None], axis=0)
    tilts[tuple((cells - grid.low).T)] = found
    while True:
        costs = costs_of_corners(grid.walls, grid.factors, tilts)
        tree, cost = tree_of(costs, grid.barred, start, goal, limit, least_moves)
        bound = int(cost[goal])
        outside = cost + ahead >= bound
        out = np.zeros(shape, np.bool_)
        out[:-1, :-1] = np.max(
            [outside[i : i - 1 or None, j : j - 1 or None] for i in (0, 1) for j in (0, 1)], axis=0
        )
        if not (out & (tilts != LEVEL)).any():
            break
        tilts[out] = LEVEL  # fewer with each turn
    tree[outside] = OUTSIDE
    return _stated(grid, tree, tilts), bound


def _stated(grid: Grid, tree: ByteArray, tilts: ByteArray | None = None) -> dict[str, Any]:
    is_shown = tree < OUTSIDE
    if tilts is not None:
        is_shown |= tilts != LEVEL
    shown = np.concatenate([np.argwhere(is_shown), grid.ends])
    first, last = shown.min(axis=0), shown.max(axis=0) + 1
    part = np.s_[first[0] : last[0], first[1] : last[1]]
    stated = {
        "box": [*(first + grid.low).tolist(), *(last - first).tolist()],
        "tree": _packed(tree[part]),
    }
    return stated if tilts is None else stated | {"tilts": _packed(tilts[part])}


def _packed(array: ByteArray) -> str:
    return base64.b85encode(zlib.compress(array.tobytes(), 9)).decode()


def _box_of(
    free: BoolArray, cells: tuple[AnyArray, AnyArray], length_cells: float
) -> tuple[LongArray, LongArray]:
    """Return the first row and column, and the ends of both, of all cells that a path of some
    length between two cells can reach, and of some more."""
    low, high = np.minimum(*cells), np.maximum(*cells)
    spare = np.maximum(length_cells - (high - low), 0) / 2 + 3
    first = np.maximum(low - spare, 0).astype(np.int64)
    return first, np.minimum(high + spare, free.shape).astype(np.int64)


def reached_from(
    free: BoolArray, one_way: DirectedSides | None, cell: tuple[int, int]
) -> BoolArray:
    """Return the cells that are reached from a free cell, bool (rows, cols)."""
    if one_way is None:
        labels, _ = ndimage.label(free)
        together: BoolArray = labels == labels[cell]
        return together
    grid = grid_near(free, None, np.array([cell, cell]), math.inf, one_way)
    start, costs = tuple(grid.ends[0].tolist()), costs_of_cells(grid.walls, grid.factors)
    tree, _ = tree_of(costs, grid.barred, start, start, FAR, PLAIN)
    reached: BoolArray = (tree != OUTSIDE)[1:-2, 1:-2]
    return reached


def region_of(free: BoolArray, one_way: DirectedSides | None, start: tuple[int, int]) -> str:
    """Return the cells that are reached from a cell, as a proof states them."""
    return _packed(reached_from(free, one_way, start).astype(np.uint8))


def parting_sides(
    free: BoolArray, one_way: DirectedSides, ends: tuple[tuple[int, int], tuple[int, int]]
) -> tuple[tuple[str, ...], bool] | None:
    """Return what alone leads out of all that is reached from a start, or into all from which a
    goal is reached, but in the other direction only: the fewer names, and whether they are those
    round the start. None if the goal is reached.

    `free`: bool (rows, cols); `ends`: free cells (row, col) of start and goal, joined without
    directions.
    """
    reached = reached_from(free, one_way, ends[0])
    if reached[ends[1]]:
        return None
    back = DirectedSides.of([("", one_way.sides[:, [2, 3, 0, 1]])], free.shape)
    behind = reached_from(free, back, ends[1])
    one, two = tuple(one_way.sides[:, :2].T), tuple(one_way.sides[:, 2:].T)
    both = free[one] & free[two]
    leaves, enters = both & reached[two] & ~reached[one], both & behind[one] & ~behind[two]
    names = [
        tuple(name for name, places in one_way.parts.items() if which[places].any())
        for which in (leaves, enters)
    ]
    return (names[0], True) if len(names[0]) <= len(names[1]) else (names[1], False)


def parting_chain(
    free: BoolArray, start: tuple[int, int], goal: tuple[int, int]
) -> LongArray | None:
    """Return walls that part two cells: a closed chain that goes round one of the two.

    `free`: bool (rows, cols), cells that may be entered; all else, and the outside, are walls;
    `start`, `goal`: free cells (row, col). Returns int64 (n, 2), (row, col), the last one equal to
    the first one; each is an 8-neighbour of the next one. Cells outside the map, from -1 to rows or
    columns, are its rim. It is the shorter border of all that one of both reaches, beside the
    other. None if they are joined.
    """
    parts, _ = ndimage.label(np.pad(free, 2))
    one, other = (parts[row + 2, col + 2] for row, col in (start, goal))
    if one == other:
        return None
    chains = _chain_round(parts == one, goal), _chain_round(parts == other, start)
    return min(chains, key=len)


def _chain_round(area: BoolArray, goal: tuple[int, int]) -> LongArray:
    """Return the walls round an area of cells, framed by two, on the side of a cell."""
    others, _ = ndimage.label(~area, np.ones((3, 3)))
    side = others == others[goal[0] + 2, goal[1] + 2]
    row, col = divmod(int(np.argmax(area[1:] & side[:-1])), area.shape[1])
    chain = walls_round(area, row + 1, col) - 2
    chain = np.concatenate([chain, chain[:1]])
    is_new = np.ones(len(chain), np.bool_)
    is_new[1:] = (chain[1:] != chain[:-1]).any(axis=1)
    return chain[is_new]


def strings_near(
    free: AnyArray, ends: Any, bound_cells: float, one_way: DirectedSides | None
) -> tuple[list[Any], float]:
    """Return the corners over which a path may be shorter than a bound, as far as the straight way
    to the goal tells.

    `free`: bool or uint8 (rows, cols), cells that may be entered; `ends`: float64 (2, 2), positions
    (row, col) of start and goal in grid units; `bound_cells`: length in cells; `one_way`: directed
    sides, None for none. Returns rows of (row, col, distance from the start in cells), of four
    where the cells at a corner differ; and the least length of all paths, at most the bound, or 0
    where no sides had to be looked at.
    """
    free, ends, length = free.view(np.bool_), np.array(ends), 0.0
    lines = [] if one_way is None else lines_of(free, one_way.sides)
    cells = np.floor(ends).astype(np.int64)
    low, high = _box_of(free, (cells[0], cells[1]), bound_cells)
    walls = np.pad(~free[low[0] : high[0], low[1] : high[1]], 1, constant_values=True)
    inside = ends - low + 1
    corners = np.rint(inside).astype(np.int64)
    is_corner = (abs(inside - corners) < 1e-6).all(axis=1)  # noqa: PLR2004
    # There an end is in one of several cells.
    if lines or any(walls[r - 1 : r + 1, c - 1 : c + 1].any() for r, c in corners[is_corner]):
        bars = bars_of(np.add(free.shape, 2), {"one_way": lines})[::2]
        part = np.s_[:, low[0] : high[0] + 2, low[1] : high[1] + 2]
        found, length = _directed_strings(walls, bars[part], inside, bound_cells)
    else:
        grain = 2 ** (30 - max(walls.shape).bit_length())
        points = np.rint(inside * grain).astype(np.int64)
        found = strings_of(walls, grain, inside, points, bound_cells).tolist()
    heights = [
        [int(row) + int(low[0]), int(col) + int(low[1]), *(round(far, 10) for far in lengths)]
        for row, col, *lengths in found
    ]
    return heights, length


def _directed_strings(
    walls: BoolArray, bars: BoolArray, ends: FloatArray, bound_cells: float
) -> tuple[list[Any], float]:
    """Return the rows and the bound of `strings_near`: distances in the graph of what sees what."""
    from scipy.sparse import csgraph, csr_array  # noqa: PLC0415 - other proofs do not need it

    nodes, plain, in_sight = strings_in(walls, bars, ends, bound_cells)
    size, straight = len(nodes), np.tile(hypots(*(nodes - ends[0]).T), 4)
    pairs = np.hstack([np.stack(pair) for pair in in_sight(straight, straight < plain)])
    tail, head = pairs[:, np.argsort(pairs[0], kind="stable")]
    far = hypots(*(nodes[head % size] - nodes[tail % size]).T)
    first = np.searchsorted(tail, np.arange(len(plain) + 1))
    # A pair may be there twice, which a graph of triples would add up.
    graph = csr_array((far, head, first), shape=(len(plain), len(plain)))
    starts = np.arange(0, len(plain), size)
    length = np.minimum(csgraph.dijkstra(graph, indices=starts, min_only=True), plain)
    corners, q = nodes[2:].astype(np.int64), np.arange(4)
    stated = (length < plain - _LESS).reshape(4, -1).any(axis=0)[2:]
    lengths = length.reshape(4, -1)[:, 2:].T
    is_wall = walls[corners[:, :1] - q // 2, corners[:, 1:] - q % 2]
    lengths = np.where(is_wall, lengths.min(axis=1, keepdims=True), lengths)
    rows = [
        [*at, *(each if max(each) > min(each) else each[:1])]
        for at, each in zip((corners - 1)[stated].tolist(), lengths[stated].tolist(), strict=True)
    ]
    return rows, float(length[1::size].min())
