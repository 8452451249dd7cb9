"""Optimal paths on the octile grid: A* with integer costs, buckets and pruned successors; and the
cheapest waypoints, one cell from each of several sets that are visited in order.

P. E. Hart, N. J. Nilsson, B. Raphael: A formal basis for the heuristic determination of minimum
cost paths, 1968. The open list is that of E. A. Dinic, 1978, by f in place of g. Successors are
pruned by the direction of arrival as D. Harabor and A. Grastien do (Online graph pruning for
pathfinding on grid maps, 2011), without jumps: N. R. Sturtevant and S. Rabin call that canonical A*
(Canonical orderings on grids, 2016). With factors in the cells all moves ahead are successors.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from hybridnav._base.copies import copies_alike
from hybridnav._base.kernels.moves import (
    BUCKET_FULL,
    COL_STEP,
    DIAGONAL,
    ROW_STEP,
    STRAIGHT,
    legal_moves,
    trace_cells,
)
from hybridnav._base.threads import Pool
from hybridnav._base.typing import BoolArray, ByteArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.search.directed import DirectedSides
from hybridnav.search.kernels import grid_search as _kernels
from hybridnav.search.kernels import waypoints as _waypoint_kernels
from hybridnav.search.watched import SearchRecord, recorded

Cell = tuple[int, int]

KERNEL = _kernels.astar
"""The kernel whose compiled form shows that a search was run before."""
UNLIMITED = 1 << 62
"""A limit above all costs."""
_ROOM = 1024
_MOST_UNITS = 1 << 24
"""More than any cell has."""


@dataclass(frozen=True, eq=False)
class CellPath:
    """Outcome of a grid search: the cells of an optimal path, None if there is none."""

    cells: LongArray | None
    expanded: int


class _Work:
    """Work arrays of one search: a record for each cell, and the open list."""

    def __init__(self, n_cells: int, weights: _Weights | None = None) -> None:
        weighted = weights is not None
        self.records = np.zeros(n_cells, dtype=np.int64 if weighted else np.uint32)
        n_buckets = _kernels.BUCKETS if weights is None else weights.n_buckets
        self.waiting = np.empty(n_buckets * _ROOM, dtype=np.int32)
        self.generation = 0
        self._last = _kernels.WIDE_GENERATIONS if weighted else _kernels.GENERATIONS

    def next_generation(self) -> int:
        """Return the number of the next search; its records hold nothing of earlier ones."""
        if self.generation == self._last:
            self.records.fill(0)
            self.generation = 0
        self.generation += 1
        return self.generation


@copies_alike
class _Weights:
    """The factors of the cells in units, and what they determine.

    `units`: int32 (rows, cols); `enterable`: bool (rows, cols), the cells whose units matter.
    """

    def __init__(self, units: IntArray, enterable: BoolArray) -> None:
        # Kernels are compiled for each memory layout, and again for read-only arrays.
        self.units = np.ascontiguousarray(units).ravel().view()
        self.units.flags.writeable = False
        of_enterable = units[enterable]
        least = int(of_enterable.min(initial=_MOST_UNITS))
        most = int(of_enterable.max(initial=least))
        self.n_buckets = _kernels.n_buckets(least, most)
        self.given = self.units, 2 * least, _kernels.bucket_shift(least), self.n_buckets
        """What the kernel takes."""


class GridSearch:
    """A* on the cells of one grid; threads may share it.

    It holds one byte a cell for the legal moves. Each search that runs at the same time as others
    takes four bytes a cell for its records (eight with units), some 32 kB for its open list, which
    grows as needed, and one byte a cell if it had blocked cells.

    Moves go to the 8 neighbours; a diagonal needs both side cells enterable (no corner cutting).
    Moves are judged once, on the whole grid; a corridor limits only the cells stood on.

    `enterable`: bool (rows, cols), cells that paths may use; start and goal must be among them;
    `corner_cutting`: whether a diagonal needs no side cell enterable; `units`: int32 (rows, cols),
    the factor of each cell in units, from 1 to 2^24: a move costs its length times the sum of the
    units of its two cells. None makes costs lengths.
    """

    def __init__(
        self, enterable: BoolArray, *, corner_cutting: bool = False, units: IntArray | None = None
    ) -> None:
        self._cols = enterable.shape[1]
        self._corner_cutting = corner_cutting
        moves = legal_moves(np.ascontiguousarray(enterable), corner_cutting)
        self._moves = moves.ravel()
        self._weights = None if units is None else _Weights(units, enterable)
        self._works = Pool(partial(_Work, enterable.size, self._weights))
        self._moves_to_edit: Pool[ByteArray] = Pool(partial(np.copy, self._moves))

    @cached_property
    def _directed(self) -> tuple[_Weights, Pool[_Work]]:
        """The factors and the work arrays of searches where moves have a direction.

        Records of 32 bits hold so little of a cost that a cell must be within a few moves of those
        beside it: not so where there is no way back. Those of 64 bits hold all of it.
        """
        if self._weights is not None:
            return self._weights, self._works
        ones = np.ones((self._moves.size // self._cols, self._cols), np.int32)
        weights = _Weights(ones, ones > 0)
        return weights, Pool(partial(_Work, ones.size, weights))

    @property
    def memory_bytes(self) -> int:
        """Bytes held between searches that do not overlap."""
        with self._works.lent() as work:
            units = 0 if self._weights is None else self._weights.units.nbytes
            return int(self._moves.nbytes + work.records.nbytes + work.waiting.nbytes + units)

    def search(  # noqa: PLR0913 - independent limits of one search
        self,
        start: Cell,
        goal: Cell,
        *,
        field_of: NDArray[np.int16 | np.int32] | None = None,
        in_corridor: BoolArray | None = None,
        limit: int | None = None,
        blocked: LongArray | None = None,
        one_way: DirectedSides | None = None,
    ) -> CellPath:
        """Find a path of the least cost between the centres of two cells.

        `start`, `goal`: enterable cells as (row, col); with a corridor, inside it; `field_of`:
        int16 or int32 (rows, cols), a label for each enterable cell; None for the whole grid;
        `in_corridor`: bool, whether the cells of each label may be stood on; goes with `field_of`;
        `limit`: integer cost: only cheaper paths are searched; None for all. Lengths are counted in
        `STRAIGHT` and `DIAGONAL`. `blocked`: int64 (n,), flat cells of the grid that this search
        may not enter, or pass on a diagonal unless corners may be cut; the time is proportional to
        n. `one_way`: sides that it may cross in one direction only; not with a limit.
        """
        first = start[0] * self._cols + start[1]
        last = goal[0] * self._cols + goal[1]
        corridor = (None if field_of is None else field_of.ravel(), in_corridor)
        bound = UNLIMITED if limit is None else limit
        none = blocked is None or len(blocked) == 0
        if none and one_way is None:
            return self._path(self._moves, (first, last), bound, corridor)
        shut = np.empty(0, np.int64) if blocked is None else blocked
        if first in shut or last in shut:
            return CellPath(None, 0)
        limits = shut, one_way, self._corner_cutting
        with limited(self._moves_to_edit, self._cols, limits) as moves:
            is_directed = one_way is not None
            return self._path(moves, (first, last), bound, corridor, is_directed=is_directed)

    def watch(self, start: Cell, goal: Cell) -> SearchRecord:
        """Search between two cells by lengths, and return what was reached on the way.

        Raises `InvalidValueError` when the search is by costs.
        """
        if self._weights is not None:
            raise InvalidValueError("a search by costs leaves no record: give it no units")
        cols, work = self._cols, _Work(len(self._moves))
        ends = start[0] * cols + start[1], goal[0] * cols + goal[1]
        cost = BUCKET_FULL
        while cost == BUCKET_FULL:
            generation = work.next_generation()
            tables = move_tables(corner_cutting=self._corner_cutting)
            of_work = None, None, work.records, generation, work.waiting
            cost, _ = KERNEL(self._moves, cols, ends, UNLIMITED, None, *tables, *of_work)
            work.waiting = np.empty(2 * work.waiting.size, dtype=np.int32)
        path: LongArray | None = None if cost < 0 else trace_cells(work.records, cols, *ends)
        low_bits = 32 - _kernels.GENERATIONS.bit_length()
        records: LongArray = work.records.astype(np.int64)
        reached = np.flatnonzero(records >> low_bits == generation)
        k = records[reached] & 7
        is_start = reached == ends[0]
        came = np.where(is_start, ends[0], reached - ROW_STEP[k] * cols - COL_STEP[k])
        parents = np.where(is_start, -1, np.searchsorted(reached, came))
        steps = np.where(is_start, 0, np.where(k & 1, DIAGONAL, STRAIGHT))
        cells = np.stack(np.divmod(reached, cols), axis=1)
        found = (None, None) if cost < 0 else (int(cost), path)
        return recorded(cells, parents, steps, np.array(goal), found)

    def _path(
        self,
        moves: ByteArray,
        endpoints: tuple[int, int],
        limit: int,
        corridor: tuple[NDArray[np.int16 | np.int32] | None, BoolArray | None],
        *,
        is_directed: bool = False,
    ) -> CellPath:
        """Find a path of the least cost between two flat cells; see `search`."""
        weights, works = self._directed if is_directed else (self._weights, self._works)
        tables = (
            move_tables(corner_cutting=self._corner_cutting)
            if weights is None
            else (moves_by_turn(ALL_BUT_BACK if is_directed else AHEAD), None)
        )
        given = limit, weights and weights.given, *tables, *corridor
        with works.lent() as work:
            cost = BUCKET_FULL
            while cost == BUCKET_FULL:
                generation = work.next_generation()
                of_work = work.records, generation, work.waiting
                cost, expanded = _kernels.astar(moves, self._cols, endpoints, *given, *of_work)
                if cost == BUCKET_FULL:
                    work.waiting = np.empty(2 * work.waiting.size, dtype=np.int32)
            if cost < 0:
                return CellPath(None, int(expanded))
            cells: LongArray = trace_cells(work.records, self._cols, *endpoints)
        return CellPath(cells, int(expanded))


@contextmanager
def limited(
    pool: Pool[ByteArray], cols: int, limits: tuple[LongArray, DirectedSides | None, bool]
) -> Iterator[ByteArray]:
    """Lend the legal moves of a map without those of one query.

    `pool`: copies of the moves, uint8 (n_cells,); `limits`: flat cells that may not be entered,
    sides with a direction, and whether corners may be cut.
    """
    blocked, one_way, corner_cutting = limits
    with pool.lent() as moves:
        touched, masks = _kernels.forbid(moves, cols, blocked, corner_cutting)
        if one_way is not None:
            flat, forbidden = one_way.forbidden
            own = moves[flat]
            moves[flat] = own & ~forbidden
        yield moves
        if one_way is not None:
            moves[flat] = own
        moves[touched] = masks


AHEAD = (0, 7, 1, 6, 2)
"""Turns by at most 90 degrees, in steps of 45, straight on first."""
ALL_BUT_BACK = (*AHEAD, 5, 3)
"""Where a move is legal in one direction only, the paths that a successor is left out for may be
illegal."""


@lru_cache
def moves_by_turn(turns: tuple[int, ...]) -> NDArray[np.uint32]:
    """Return the legal moves that make one of some turns, by direction of arrival.

    Returns uint32 (9 * 256,), as the successors of `move_tables`.
    """
    mask = np.arange(256, dtype=np.uint32)
    successors = np.zeros((9, 256), dtype=np.uint32)
    for d in range(9):
        for turn in turns if d < 8 else range(8):  # noqa: PLR2004 - 8 directions
            k = (d + turn) & 7
            _put_first(successors[d], mask >> k & 1 == 1, k)
    successors.flags.writeable = False
    return successors.ravel()


@lru_cache
def move_tables(*, corner_cutting: bool) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Return the successors of a cell by direction of arrival and mask of legal moves.

    Let x be the cell, p the cell before it, d the direction from p to x.

    A successor y is left out when a path from p to y without x is shorter, or as short and diagonal
    first. Still, every cell y is reached at its least cost, by induction over that cost: take a
    cell x before y on a shortest path. If x leaves y out for a path of the same length, that path
    goes from p to z along a diagonal and from z to y along a side, so z too lies before y on a
    shortest path; and a cell leaves out a successor along a side only for a shorter path.

    Some of these paths stand on a third cell z, next to x: d straight, y one turn of 45 degrees to
    the left or right of d, z two turns; d diagonal, y two turns, z three. These y are the detours,
    and must be put back where z is outside a corridor. All other paths are one move from p to y.

    Returns uint32 (9 * 256,) each, index 256 * d + mask, d = 8 for the start: the successors, and
    the detours that are not among them. Moves are digits of four bits, 8 + direction, the first one
    lowest.
    """
    mask = np.arange(256, dtype=np.uint32)
    legal = [mask >> k & 1 == 1 for k in range(8)]
    successors = np.zeros((9, 256), dtype=np.uint32)
    detours = np.zeros((9, 256), dtype=np.uint32)
    for d in range(8):
        # The last move in the list is expanded next, before all waiting cells: straight on is put
        # first.
        for turn in (0, 7, 1, 6, 2, 5, 3, 4):
            k = (d + turn) & 7
            kept, left_out = _after_turn(legal, d, turn, corner_cutting=corner_cutting)
            _put_first(successors[d], legal[k] & kept, k)
            _put_first(detours[d], legal[k] & left_out, k)
    for k in range(8):
        _put_first(successors[8], legal[k], k)
    successors.flags.writeable = detours.flags.writeable = False
    return successors.ravel(), detours.ravel()


def _after_turn(
    legal: list[BoolArray], d: int, turn: int, *, corner_cutting: bool
) -> tuple[BoolArray, BoolArray]:
    """Return for each mask whether a legal move is a successor, and whether it is a detour."""
    hand = 1 if turn < 4 else -1  # noqa: PLR2004 - 8 directions
    turns = min(turn, 8 - turn)
    second, third = (legal[(d + hand * n) & 7] for n in (2, 3))
    never, always = np.zeros(256, dtype=np.bool_), np.ones(256, dtype=np.bool_)
    if turns == 0 or (turns == 1 and d & 1):
        return always, never
    if turns == 1:
        # The diagonal from p to z: illegal past a blocked cell, unless corners are cut.
        is_open = second if corner_cutting else third
        return ~is_open, is_open
    if turns == 2:  # noqa: PLR2004
        if d & 1:
            return ~third, third
        return (never if corner_cutting else ~third), never
    return never, never


def _put_first(lists: NDArray[np.uint32], where: BoolArray, k: int) -> None:
    lists[where] = lists[where] << 4 | 8 | k


def cheapest_waypoints(
    enterable: BoolArray,
    sets: Sequence[LongArray],
    *,
    corner_cutting: bool = False,
    units: IntArray | None = None,
    one_way: DirectedSides | None = None,
) -> list[int] | None:
    """Choose a cell from each set so that the path through them, in order, is cheapest.

    Dijkstra's algorithm runs from set to set: the search for the next set begins with the costs of
    the cells of the last one.

    `enterable`: bool (rows, cols), cells that the path may use. Moves go to the 8 neighbours; a
    diagonal needs both side cells, unless corners may be cut. `sets`: two or more sets, int64 (n,),
    of flat enterable cells; `corner_cutting`: whether a diagonal needs no side cell; `units`: int32
    (rows, cols), the factor of each cell in units; None makes costs lengths; `one_way`: sides that
    may be crossed in one direction only. Returns a flat cell of each set; None if one of them
    cannot be reached.
    """
    moves = directed_moves(enterable, one_way, corner_cutting=corner_cutting).ravel()
    weights = None if units is None else np.ascontiguousarray(units).ravel()
    sources, costs = sets[0], np.zeros(len(sets[0]), dtype=np.int64)
    origins: list[LongArray] = []
    for number, goals in enumerate(sets[1:], start=2):
        is_target = np.zeros(moves.size, dtype=np.bool_)
        is_target[goals] = True
        cost, came = _waypoint_kernels.spread(
            moves, weights, enterable.shape[1], sources, costs, is_target, number < len(sets)
        )
        reached = goals[cost[goals] >= 0]
        if len(reached) == 0:
            return None
        origins.append(np.stack([reached, sources[came[reached]]], axis=1))
        sources, costs = reached, cost[reached]
    waypoints = [int(sources[np.argmin(costs)])]
    for pairs in reversed(origins):
        waypoints.append(int(pairs[np.argmax(pairs[:, 0] == waypoints[-1]), 1]))
    return waypoints[::-1]


def directed_moves(
    enterable: BoolArray, one_way: DirectedSides | None, *, corner_cutting: bool
) -> ByteArray:
    """Return the legal moves between cells, uint8 (rows, cols), by sides with a direction."""
    moves: ByteArray = legal_moves(np.ascontiguousarray(enterable), corner_cutting)
    return moves if one_way is None else moves & ~one_way.moves


def costs_from(moves: ByteArray, cell: tuple[int, int], targets: LongArray) -> LongArray:
    """Return the octile costs of shortest paths from a cell, int64 (rows * cols,), -1 where
    unsettled.

    `moves`: uint8 (rows, cols), legal moves of each cell; `cell`: where the search starts, (row,
    col); `targets`: int64 (n,), flat cells: the search ends once all that can be reached are
    settled.
    """
    cols = moves.shape[1]
    is_target = np.zeros(moves.size, dtype=np.bool_)
    is_target[targets] = True
    source = np.array([cell[0] * cols + cell[1]])
    start_cost = np.zeros(1, dtype=np.int64)
    return _waypoint_kernels.spread(moves.ravel(), None, cols, source, start_cost, is_target, True)[
        0
    ]


def far_apart(enterable: BoolArray) -> tuple[Cell, Cell]:
    """Return two cells of the largest part of a map, for examples: one that is farthest from its
    first cell, and one that is farthest from that one.

    `enterable`: bool (rows, cols), the cells that paths may use; one at least.
    """
    from scipy import ndimage  # noqa: PLC0415 - plans do not need it

    labels, _ = ndimage.label(enterable)
    part = np.flatnonzero(labels == np.bincount(labels[enterable]).argmax())
    moves, cols, ends = legal_moves(enterable, False), enterable.shape[1], [int(part[0])]
    for _ in range(2):
        costs = costs_from(moves, divmod(ends[-1], cols), part)
        ends.append(int(part[costs[part].argmax()]))
    return divmod(ends[1], cols), divmod(ends[2], cols)
