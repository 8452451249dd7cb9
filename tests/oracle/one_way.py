"""Shortest paths where sides of cells are crossed in one direction only, found a second time.

Written from the definition alone. A point of a path has a *sector*, the cell through which it is
reached: one of up to four at a corner of cells, one of two on a side. To go round a point from one
sector to the next costs nothing, and crosses the side between the two. Lines that pass no corner of
cells join two points, and cross sides on their way; so no walk ever asks whether it touches one.
"""

import math
from fractions import Fraction
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

Cell = tuple[int, int]
Exact = tuple[Fraction, Fraction]
Positions = list[tuple[float, float]]
STEPS = ((0, 1), (1, 0), (0, -1), (-1, 0))
AROUND = ((0, 0), (0, -1), (-1, -1), (-1, 0))
"""Cells round a corner (row, col), less that corner, counter-clockwise."""
TURN = (2, 3, 0, 1)
"""The step from each cell of `AROUND` to the next one."""


class OneWayPlane:
    """A map with directed sides.

    `free`: bool (rows, cols); `sides`: int (n, 4), cells (row, col) of each: it may be crossed from
    the first cell to the second one, and not back.
    """

    def __init__(self, free: NDArray[np.bool_], sides: NDArray[np.int32]) -> None:
        self.free, self.shape = free, free.shape
        wide = np.pad(free, 1)
        rows, cols = free.shape
        self.crosses = np.stack(
            [free & wide[1 + r : 1 + r + rows, 1 + c : 1 + c + cols] for r, c in STEPS]
        )
        for row_from, col_from, row_to, col_to in sides:
            back = STEPS.index((row_from - row_to, col_from - col_to))
            self.crosses[back, row_to, col_to] = False

    def may_cross(self, cell: Cell, step: int) -> bool:
        """Whether one may go from a cell to the next."""
        row, col = cell
        inside = 0 <= row < self.shape[0] and 0 <= col < self.shape[1]
        return inside and bool(self.crosses[step, row, col])

    def cells_length(
        self, start: Cell, goal: Cell, factors: NDArray[np.float64] | None = None
    ) -> float:
        """Least length of moves between two cells, infinite for none; with `factors` of cells, the
        least cost: each move counts the mean of its two."""
        source, target = (row * self.shape[1] + col for row, col in (start, goal))
        moves = self._moves
        if factors is not None:
            weights = factors.ravel()
            moves = moves.copy()
            tails = np.repeat(np.arange(self.free.size), np.diff(moves.indptr))
            moves.data *= (weights[tails] + weights[moves.indices]) / 2
        return float(dijkstra(moves, indices=source)[target])

    @cached_property
    def _moves(self) -> csr_array:
        tails, heads, lengths = [], [], []
        n = self.free.size
        for row, col in np.argwhere(self.free).tolist():
            for k, (up, across) in enumerate(STEPS):
                if self.may_cross((row, col), k):
                    tails.append(row * self.shape[1] + col)
                    heads.append((row + up) * self.shape[1] + col + across)
                    lengths.append(1.0)
            for up in (1, 3):
                for across in (0, 2):
                    one = self._detour((row, col), (up, across))
                    other = self._detour((row, col), (across, up))
                    if self._has_corner((row, col), up, across) and (one or other):
                        r, c = STEPS[up][0], STEPS[across][1]
                        tails.append(row * self.shape[1] + col)
                        heads.append((row + r) * self.shape[1] + col + c)
                        lengths.append(math.sqrt(2))
        return csr_array((lengths, (tails, heads)), shape=(n, n))

    def allows_moves(self, cells: list[Cell], *, strict: bool) -> bool:
        """Whether each cell is reached from the one before by a move that is legal; if not strict,
        one of the cells beside a diagonal may be blocked."""
        for a, b in pairwise(cells):
            way = b[0] - a[0], b[1] - a[1]
            if way in STEPS:
                if not self.may_cross(a, STEPS.index(way)):
                    return False
                continue
            if max(map(abs, way)) > 1:
                return False
            up, across = (1 if way[0] > 0 else 3), (0 if way[1] > 0 else 2)
            if strict and not self._has_corner(a, up, across):
                return False
            if not self._detour(a, (up, across)) and not self._detour(a, (across, up)):
                return False
        return True

    def _has_corner(self, cell: Cell, up: int, across: int) -> bool:
        """Whether all four cells of a diagonal move are free."""
        (r, _), (_, c) = STEPS[up], STEPS[across]
        rows, cols = (cell[0], cell[0] + r), (cell[1], cell[1] + c)
        if min(rows) < 0 or min(cols) < 0 or max(rows) >= self.shape[0]:
            return False
        return max(cols) < self.shape[1] and bool(self.free[np.ix_(rows, cols)].all())

    def _detour(self, cell: Cell, steps: tuple[int, int]) -> bool:
        for step in steps:
            if not self.may_cross(cell, step):
                return False
            cell = cell[0] + STEPS[step][0], cell[1] + STEPS[step][1]
        return True

    def lengths(
        self, starts: list[tuple[Cell, Exact]], goals: list[tuple[Cell, Exact]]
    ) -> NDArray[np.float64]:
        """Lengths of shortest any-angle paths, (starts, goals), in cells; infinite for none.

        Each end is a free cell (row, col) and an exact position in its closed square.
        """
        graph = _Graph(self)
        first = [graph.end(*end) for end in starts]
        last = [graph.end(*end) for end in goals]
        return graph.distances(first)[:, last]

    def allows(self, cells: tuple[Cell, Cell], path: list[Exact]) -> bool:
        """Whether a path through exact positions is legal, from one cell to another."""
        sectors = {cells[0]}
        for a, b in pairwise(path):
            for p, q in pairwise(_cut(a, b)) if a != b else ():
                sectors = self._reached(p, sectors)
                sectors = {
                    line[-1] for line in _lines(p, q) if line[0] in sectors and self._open(line)
                }
        return cells[1] in self._reached(path[-1], sectors)

    def _open(self, line: list[Cell]) -> bool:
        is_free = all(0 <= r < self.shape[0] and 0 <= c < self.shape[1] for r, c in line)
        return (
            is_free
            and bool(self.free[line[0]])
            and all(
                self.may_cross(a, STEPS.index((b[0] - a[0], b[1] - a[1])))
                for a, b in pairwise(line)
            )
        )

    def _reached(self, point: Exact, sectors: set[Cell]) -> set[Cell]:
        round_it = set(_sectors(point))
        found, waiting = set(sectors), list(sectors)
        while waiting:
            cell = waiting.pop()
            for k, (up, across) in enumerate(STEPS):
                other = cell[0] + up, cell[1] + across
                if other in round_it - found and self.may_cross(cell, k):
                    found.add(other)
                    waiting.append(other)
        return found


def _sectors(point: Exact) -> list[Cell]:
    """Cells whose closed square has a point."""
    rows, cols = (
        [math.floor(at)] if at % 1 else [math.floor(at) - 1, math.floor(at)] for at in point
    )
    return [(row, col) for row in rows for col in cols]


def _cut(a: Exact, b: Exact) -> list[Exact]:
    """A segment, cut at the corners of cells that it passes."""
    cuts = []
    for k in (0, 1):
        low, high = sorted((a[k], b[k]))
        for at in range(math.ceil(low), math.floor(high) + 1):
            if low < high:
                share = (at - a[k]) / (b[k] - a[k])
                point = a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])
                if point[0] % 1 == 0 and point[1] % 1 == 0 and 0 < share < 1:
                    cuts.append((share, point))
    return [a, *(point for _, point in sorted(set(cuts))), b]


def _lines(a: Exact, b: Exact) -> list[list[Cell]]:
    """The cells from one point to another; none if a corner of cells lies between the two, two
    lines along a side."""
    steps = []
    for k in (0, 1):
        low, high = sorted((a[k], b[k]))
        if low == high:
            continue
        for at in range(math.floor(low) + 1, math.ceil(high)):
            way = [0, 0]
            way[k] = 1 if b[k] > a[k] else -1
            steps.append((Fraction(at - a[k]) / (b[k] - a[k]), tuple(way)))
    for k in (0, 1):
        if a[k] == b[k] and a[k] % 1 == 0:
            if a == b or steps:
                return []
            at = math.floor(min(a[1 - k], b[1 - k]))
            both = int(a[k]) - 1, int(a[k])
            return [[(each, at) if k == 0 else (at, each)] for each in both]
    shares = [share for share, _ in steps]
    if a == b or len(set(shares)) < len(shares):
        return []
    cell = tuple(math.ceil(a[k]) - 1 if b[k] < a[k] else math.floor(a[k]) for k in (0, 1))
    line = [cell]
    for _, (up, across) in sorted(steps):
        cell = cell[0] + up, cell[1] + across
        line.append(cell)
    return [line]  # type: ignore[list-item]


class _Graph:
    """Corners of cells by sectors, and ends; edges are lines that pass no corner."""

    def __init__(self, plane: OneWayPlane) -> None:
        self.plane = plane
        rows, cols = plane.shape
        self.n = 4 * (rows + 1) * (cols + 1)
        self.number: dict[tuple[Exact, Cell], int] = {}
        self.ends: list[Exact] = []
        self.edges: list[tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]] = []
        self._join_corners()

    def _at(self, row: int, col: int, sector: int) -> int:
        return 4 * (row * (self.plane.shape[1] + 1) + col) + sector

    def _join_corners(self) -> None:
        rows, cols = self.plane.shape
        pad = max(rows, cols) + 1
        free = np.pad(self.plane.free, pad)
        crosses = np.pad(self.plane.crosses, ((0, 0), (pad, pad), (pad, pad)))
        at = np.arange((rows + 1) * (cols + 1)).reshape(rows + 1, cols + 1) * 4

        def seen(array: NDArray[np.bool_], cell: Cell) -> NDArray[np.bool_]:
            row, col = cell[0] + pad, cell[1] + pad
            return array[row : row + rows + 1, col : col + cols + 1]

        for k, cell in enumerate(AROUND):
            after = AROUND[(k + 1) % 4]
            ahead, back = seen(crosses[TURN[k]], cell), seen(crosses[TURN[k] - 2], after)
            self._edge(at[ahead] + k, at[ahead] + (k + 1) % 4, 0.0)
            self._edge(at[back] + (k + 1) % 4, at[back] + k, 0.0)
        for up in range(-rows, rows + 1):
            for across in range(-cols, cols + 1):
                if math.gcd(up, across) != 1:
                    continue
                for line in _lines((Fraction(0), Fraction(0)), (Fraction(up), Fraction(across))):
                    is_open = seen(free, line[0]).copy()
                    for a, b in pairwise(line):
                        step = STEPS.index((b[0] - a[0], b[1] - a[1]))
                        is_open &= seen(crosses[step], a)
                    head = 4 * (up * (cols + 1) + across)
                    one = AROUND.index(line[0])
                    two = AROUND.index((line[-1][0] - up, line[-1][1] - across))
                    tails = at[is_open]
                    self._edge(tails + one, tails + head + two, math.hypot(up, across))

    def _edge(self, tails: NDArray[np.int64], heads: NDArray[np.int64], length: float) -> None:
        self.edges.append((tails, heads, np.full(len(tails), length)))

    def end(self, cell: Cell, point: Exact) -> int:
        """The node of an end, joined to all corners and ends that it sees."""
        if all(at % 1 == 0 for at in point):
            row, col = int(point[0]), int(point[1])
            return self._at(row, col, AROUND.index((cell[0] - row, cell[1] - col)))
        if (point, cell) not in self.number:
            sectors = _sectors(point)
            for each in sectors:
                self.number[point, each] = self.n
                self.n += 1
            for one in sectors:
                for two in sectors:
                    if abs(one[0] - two[0]) + abs(one[1] - two[1]) == 1 and self.plane.may_cross(
                        one, STEPS.index((two[0] - one[0], two[1] - one[1]))
                    ):
                        self._single(self.number[point, one], self.number[point, two], 0.0)
            corners = [
                (Fraction(row), Fraction(col))
                for row in range(self.plane.shape[0] + 1)
                for col in range(self.plane.shape[1] + 1)
            ]
            for other in corners + self.ends:
                self._see(point, other)
                self._see(other, point)
            self.ends.append(point)
        return self.number[point, cell]

    def _see(self, a: Exact, b: Exact) -> None:
        for line in _lines(a, b):
            if self.plane._open(line):
                length = math.hypot(float(b[0] - a[0]), float(b[1] - a[1]))
                self._single(self.end(line[0], a), self.end(line[-1], b), length)

    def _single(self, tail: int, head: int, length: float) -> None:
        self._edge(np.array([tail]), np.array([head]), length)

    def distances(self, sources: list[int]) -> NDArray[np.float64]:
        tails, heads, lengths = (np.concatenate(part) for part in zip(*self.edges, strict=True))
        graph = csr_array((lengths, (tails, heads)), shape=(self.n, self.n))
        found: NDArray[np.float64] = dijkstra(graph, indices=sources)
        return found
