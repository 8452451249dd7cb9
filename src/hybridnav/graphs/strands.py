"""Strands, lines of cells in the middle of corridors, and in halls as nets; plane segments."""

import heapq
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from hybridnav._base.trig import cos, hypots, sin
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.graphs.free_space import FreeSpace
from hybridnav.graphs.kernels import least_along, spread, thinned
from hybridnav.maps.clearance import clearance_cells

_HALL = 1.5
"""Width from which on free space is a hall, in distances between lanes: it gets two lanes or
more."""
_OFF = 0.6
"""Least clearance of a pillar, in distances between lanes."""
_LEAST_OFF = 2.0
"""The same in cells: nearer to what is not free, a pillar has no ring of free cells round it."""
_STEP = 1.2
"""Length of a step of `spread` in cells, on average."""
COVER = 1.1
"""Distance from strands from which on free space gets one of its own, in distances between
lanes."""
_MIDDLE_CELLS = 0.6
"""How much less clearance an end may have than any cell of its part, in cells."""
_FARTHEST = 0.125
"""How much nearer an end may lie than any cell of its part, in distances between lanes."""
_ROUNDS = 12


@dataclass(frozen=True)
class Layout:
    """What strands are to be like, in cells."""

    apart: float
    """Distance between the lanes of a hall."""
    speck: float
    """Side of the largest obstacle, with the robot's radius round it, that lanes do not ring."""
    least: float
    """Clearance below which free space gets no strand for its own sake."""
    angle_rad: float
    """Angle that turns the rows of the grid into the main direction of walls."""


@dataclass(frozen=True, eq=False)
class RoomAnchors:
    """The rooms of a map."""

    label_of: IntArray
    """int32 (rows, cols), the room of each cell, -1 for none."""
    cells: LongArray
    """int64 (k, 2), a cell in each room that the robot fits into."""


@dataclass(frozen=True)
class Strand:
    """A chain of cells between two nodes."""

    tail: int
    head: int
    cells: FloatArray
    """float64 (k, 2), centres of cells from tail to head, with both."""


def lines_of(
    part_of: IntArray, clearance: FloatArray, rooms: RoomAnchors, layout: Layout
) -> tuple[BoolArray, BoolArray]:
    """Find the cells of strands.

    `part_of`: int32 (rows, cols), the connected part of each free cell, -1 elsewhere and along the
    rim; `clearance`: float64 (rows, cols), distance to the next cell that is not free, in cells;
    `rooms`: the rooms; each gets a strand if it has room for one; `layout`: what strands are to be
    like. Returns bool (rows, cols), the cells of the lines, 4-connected and one cell wide; bool
    (rows, cols), those at which lines end on purpose.
    """
    free = part_of >= 0
    inside = _without_specks(part_of, layout.speck)
    pillars = _pillars(clearance_cells(~inside), layout)
    ordered = clearance
    if len(pillars):
        whole = inside.copy()
        inside[tuple(pillars.T)] = False
        ordered = np.minimum(clearance, clearance_cells(inside != whole))
    order = np.flatnonzero(inside)
    order = order[np.argsort(ordered.ravel()[order], kind="stable")].astype(np.int64)
    ends = np.zeros_like(inside)
    for tries in range(_ROUNDS):
        lines = inside.copy()
        thinned(lines, ordered, order, ends)
        away = spread(free, np.flatnonzero(lines & free).astype(np.int64)) * _STEP
        new = np.empty(0, dtype=np.int64)
        if not tries:
            at = tuple(rooms.cells.T)
            is_bare = ~np.isin(rooms.label_of[at], rooms.label_of[lines])
            new = rooms.cells[is_bare] @ np.array([free.shape[1], 1])
        if not len(new):
            new = _uncovered(away, clearance, layout)
        if not len(new):
            break
        ends.ravel()[new] = True
    return lines, ends


def _without_specks(part_of: IntArray, most: float) -> BoolArray:
    """Return free cells, with obstacles that are no larger than some cells and part nothing."""
    holes, count = ndimage.label(part_of < 0, structure=np.ones((3, 3)))
    is_speck = np.zeros(count + 1, dtype=np.bool_)
    for hole, (rows, cols) in enumerate(ndimage.find_objects(holes), start=1):
        if max(rows.stop - rows.start, cols.stop - cols.start) <= most:
            around = part_of[
                max(rows.start - 1, 0) : rows.stop + 1, max(cols.start - 1, 0) : cols.stop + 1
            ]
            is_speck[hole] = len(np.unique(around[around >= 0])) == 1
    is_speck[holes[0, 0]] = False
    return (part_of >= 0) | is_speck[holes]


def _pillars(clearance: FloatArray, layout: Layout) -> LongArray:
    """Return the cells round which the lanes of halls run, int64 (k, 2).

    Lanes lie midway between them and from the walls, so a lattice of pillars makes a net.
    """
    half = _HALL * layout.apart / 2
    wide = clearance >= half
    if not wide.any():
        return np.empty((0, 2), dtype=np.int64)
    halls, _ = ndimage.label(clearance_cells(wide) < half)
    turn = turn_of(layout.angle_rad)
    found = []
    for hall, box in enumerate(ndimage.find_objects(halls), start=1):
        cells = np.argwhere(halls[box] == hall) + [side.start for side in box]
        turned = cells @ turn.T
        low, high = turned.min(axis=0), turned.max(axis=0)
        counts = np.maximum(np.round((high - low) / layout.apart), 1).astype(int)
        # A hall with room for one lane only has its pillars in its middle.
        axes = [
            low[k] + (high[k] - low[k]) * np.arange(1, max(n, 2)) / max(n, 2)
            for k, n in enumerate(counts.tolist())
        ]
        lattice = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2) @ turn
        at = np.round(lattice).astype(np.int64)
        at = at[((at > 0) & (at < np.array(halls.shape) - 1)).all(axis=1)]
        is_off = clearance[tuple(at.T)] >= max(_OFF * layout.apart, _LEAST_OFF)
        found.append(at[is_off & (halls[tuple(at.T)] == hall)])
    return np.concatenate(found)


def _uncovered(away: FloatArray, clearance: FloatArray, layout: Layout) -> LongArray:
    """Return a cell of each part that lies far from strands, flat.

    It is one in the middle, so that the line there is straight, and one of the farthest; of these
    the one amid the others.
    """
    cover = COVER * layout.apart
    far = (away > cover) & (clearance >= layout.least)
    parts, count = ndimage.label(far)
    at = np.flatnonzero(far)
    part = parts.ravel()[at]
    for of, most, slack in (
        (clearance, cover / 3, _MIDDLE_CELLS),
        (away, np.inf, _FARTHEST * layout.apart),
    ):
        values = np.minimum(of.ravel()[at], most)
        most_of = np.zeros(count + 1)
        np.maximum.at(most_of, part, values)
        kept = values >= most_of[part] - slack
        at, part = at[kept], part[kept]
    n_cells = np.bincount(part, minlength=count + 1)[part]
    off = [n_cells * x - np.bincount(part, weights=x)[part] for x in divmod(at, far.shape[1])]
    order = np.lexsort((off[0] ** 2 + off[1] ** 2, part))
    return at[order[np.flatnonzero(np.diff(part[order], prepend=0))]]


_SIDES = ((0, 1), (-1, 0), (0, -1), (1, 0))


def strands_of(lines: BoolArray, marks: BoolArray) -> tuple[LongArray, list[Strand]]:
    """Return lines as a graph.

    `lines`: bool (rows, cols), 4-connected lines one cell wide; `marks`: bool (rows, cols), cells
    of lines that are nodes, beside crossings and ends. Returns int64 (n, 2), the cell of each node;
    the strands between them, some of them rings.
    """
    lines = np.pad(lines, 1)
    cols = lines.shape[1]
    cells = np.argwhere(lines)
    flat: list[int] = (cells @ np.array([cols, 1])).tolist()
    on = lines.ravel()
    near = {
        cell: [cell + row * cols + col for row, col in _SIDES if on[cell + row * cols + col]]
        for cell in flat
    }
    is_marked = np.pad(marks, 1).ravel()
    nodes = {cell: 0 for cell in flat if len(near[cell]) != 2 or is_marked[cell]}  # noqa: PLR2004
    strands: list[tuple[list[int], int, int]] = []
    passed: set[int] = set(nodes)
    done: set[tuple[int, int]] = set()

    def walk(start: int) -> None:
        for first in near[start]:
            if (start, first) in done:
                continue
            chain = [start, first]
            while chain[-1] not in nodes:
                one, other = near[chain[-1]]
                chain.append(other if one == chain[-2] else one)
            done.add((chain[-1], chain[-2]))
            passed.update(chain)
            strands.append((chain, start, chain[-1]))

    for start in list(nodes):
        walk(start)
    for cell in flat:  # rings without a node
        if cell not in passed:
            nodes[cell] = 0
            walk(cell)
    index = {cell: k for k, cell in enumerate(nodes)}
    at = np.stack(np.divmod(np.array(list(nodes), dtype=np.int64), cols), axis=1) - 1
    return at, [
        Strand(index[one], index[other], np.stack(np.divmod(np.array(chain), cols), axis=1) - 0.5)
        for chain, one, other in strands
    ]


# Straight edges in the plane: how much room they have, ways over them, angles, and crossings.

_SLOPE = 0.35
"""Slope up to which an edge counts as one along a main direction."""


def turn_of(angle_rad: float) -> FloatArray:
    """Return the matrix, float64 (2, 2), that turns a main direction into that of rows."""
    along, across = cos(angle_rad), sin(angle_rad)
    return np.array([[along, across], [-across, along]])


class Passage:
    """How much room positions and straight edges have."""

    def __init__(self, space: FreeSpace, clearance: FloatArray, comfort: float) -> None:
        self.space, self.comfort = space, comfort
        """Free space; the clearance that is asked for, in cells."""
        self._clearance = np.ascontiguousarray(clearance)

    def at(self, positions: FloatArray) -> FloatArray:
        """Return the clearance of positions in cells, float64 (n,)."""
        return self._clearance[tuple(positions.astype(np.int64).T)]

    def least(self, tails: FloatArray, heads: FloatArray) -> FloatArray:
        """Return the least clearance of segments in cells, float64 (n,), -1 for those that the
        robot cannot follow."""
        found = np.full(len(tails), -1.0)
        fits = self.space.joins(tails, heads)
        ends = np.concatenate([tails[fits], heads[fits]])
        pairs = np.ascontiguousarray(np.arange(len(ends)).reshape(2, -1).T)
        found[fits] = least_along(self.space.free, self._clearance, ends, pairs)[0]
        return found


def length_between(
    neighbours: Callable[[int], Iterable[tuple[int, float]]], start: int, goal: int, limit: float
) -> float:
    """Return the length of the way between two nodes, infinite above a limit; `neighbours`
    returns the nodes next to a node, and how far they are."""
    costs = {start: 0.0}
    heap = [(0.0, start)]
    while heap:
        cost, here = heapq.heappop(heap)
        if here == goal:
            return cost
        for there, length in neighbours(here) if cost <= costs[here] else ():
            through = cost + length
            if through <= limit and through < costs.get(there, math.inf):
                costs[there] = through
                heapq.heappush(heap, (through, there))
    return math.inf


def is_beside(at: FloatArray, node: int, head: int, others: list[int], least_rad: float) -> bool:
    """Return whether an edge makes a smaller angle with another one of its node."""
    steps = at[[head, *others]] - at[node]
    steps /= np.maximum(hypots(steps[:, 0], steps[:, 1]), 1e-9)[:, None]
    return bool((steps[1:] @ steps[0] > cos(least_rad)).any())


def crosses(one: FloatArray, other: FloatArray, tails: FloatArray, heads: FloatArray) -> BoolArray:
    """Return which segments have a point in common with a segment, but no end; bool (m,)."""

    def side(first: FloatArray, second: FloatArray, third: FloatArray) -> FloatArray:
        step, away = second - first, third - first
        across = step[..., 0] * away[..., 1] - step[..., 1] * away[..., 0]
        return np.sign(across)

    meets = side(tails, heads, one) * side(tails, heads, other) <= 0
    meets &= side(one, other, tails) * side(one, other, heads) <= 0
    low, high = np.minimum(tails, heads), np.maximum(tails, heads)
    meets &= ((np.maximum(one, other) >= low) & (np.minimum(one, other) <= high)).all(axis=1)
    for end in (one, other):
        meets &= ~((tails == end).all(axis=1) | (heads == end).all(axis=1))
    return np.asarray(meets, dtype=np.bool_)


def crossing(
    positions: FloatArray, edges: LongArray, touching: float
) -> tuple[list[int], FloatArray] | None:
    """Find two edges that cross, or one that a node lies on.

    `positions`: float64 (n, 2), the nodes; `edges`: int64 (m, 2); `touching`: distance from an edge
    at which a node lies on it. Returns one edge or two, and where, float64 (2,); None if there are
    none.
    """
    import shapely  # noqa: PLC0415 - on demand

    lines = np.asarray(shapely.linestrings(positions[edges]))
    tree = shapely.STRtree(list(lines))
    near, edge = tree.query(shapely.points(positions), predicate="dwithin", distance=touching)
    on = np.flatnonzero((edges[edge] != near[:, None]).all(axis=1))
    if len(on):
        return [int(edge[on[0]])], positions[near[on[0]]]
    one, other = tree.query(lines, predicate="crosses")
    apart = (edges[one][:, :, None] != edges[other][:, None]).all(axis=(1, 2))
    pairs = np.flatnonzero((one < other) & apart)
    if not len(pairs):
        return None
    pair = [int(one[pairs[0]]), int(other[pairs[0]])]
    point = shapely.intersection(lines[pair[0]], lines[pair[1]])
    return pair, shapely.get_coordinates(point)[0]


def aligned(
    turned: FloatArray, edges: LongArray, reach: FloatArray, axis: int, most: float
) -> FloatArray:
    """Return coordinates that are equal along the edges of one direction, float64 (n,).

    The longest edges come first; their nodes share a coordinate as long as all can reach it.
    """
    steps = abs(turned[edges[:, 1]] - turned[edges[:, 0]])
    along, off = steps[:, 1 - axis], steps[:, axis]
    fits = (off < _SLOPE * along) | ((off < most) & (along > 1.5 * off))
    group, value = np.arange(len(turned)), turned[:, axis]
    low, high = value - reach, value + reach
    members = [[node] for node in range(len(turned))]
    for edge in np.argsort(-along, kind="stable").tolist():
        one, other = group[edges[edge]].tolist()
        least, greatest = max(low[one], low[other]), min(high[one], high[other])
        if fits[edge] and one != other and least <= greatest:
            low[one], high[one] = least, greatest
            members[one] += members[other]
            group[members[other]] = one
    found = value.copy()
    for one in np.unique(group).tolist():
        found[members[one]] = np.clip(value[members[one]].mean(), low[one], high[one])
    return found
