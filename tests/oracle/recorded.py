"""Verdicts on a path that somebody recorded, by shapely and by fractions: free ground or not, how
deep, how near to what is occupied. Written from the definitions alone, in units of cells.
"""

import math
from fractions import Fraction
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import shapely

from hybridnav.maps import CellClass, OccupancyGrid

STEP_CELLS = 1 / 256
"""Distance of the samples at which depth is measured: no depth between two is larger by more than
half of it."""


class Run(NamedTuple):
    """A maximal part of the line that is not on free ground; of length 0 between two corners."""

    begin: float
    """Cells along the line, as `end`."""
    end: float
    depth: float
    """Largest sampled distance to free ground."""
    kinds: frozenset[str]
    """What the cells are that it enters."""


class Verdict(NamedTuple):
    """What is known of a line."""

    runs: list[Run]
    length: float
    clearance: float
    """Least distance to the squares of occupied cells, infinite where there is none."""
    mean: float
    at: Any
    """Distances at even samples, float64 (n,)."""

    @property
    def legal(self) -> bool:
        return not self.runs


class RecordedJudge:
    """A map as shapely geometries: free ground, and what was measured as occupied."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._free, self._classes = grid.enterable(), grid.classes
        self._occupied_cells = grid.measured == CellClass.OCCUPIED
        self.ground = squares(self._free)
        self.occupied = squares(self._occupied_cells)

    def verdict(self, positions: Any) -> Verdict:
        """Judge a line through positions (row, col), each a multiple of 2^-24."""
        line = [(Fraction(row), Fraction(col)) for row, col in np.asarray(positions).tolist()]
        pieces = _pieces(line)
        lengths = np.array([math.sqrt(float(_squared(*piece))) for piece in pieces])
        ends = np.concatenate([[0.0], np.cumsum(lengths)])
        cells = [self._standing(piece) for piece in pieces]
        runs: list[Run] = []
        begun: int | None = None
        for index, found in enumerate([*cells, {(0, 0)}]):
            if not found and begun is None:
                begun = index
            elif found and begun is not None:
                runs.append(self._run(pieces, ends, begun, index))
                begun = None
        for index, (one, two) in enumerate(pairwise(cells)):
            if one and two and not self._joined(one, two, pieces[index][1]):
                at = float(ends[index + 1])
                runs.append(Run(at, at, 0.0, frozenset({"corner"})))
        at = shapely.distance(_points(_samples(pieces, 1 / 64)), self.occupied)
        is_none = self.occupied.is_empty
        return Verdict(
            sorted(runs),
            float(ends[-1]),
            math.inf if is_none else shapely.distance(_shape(positions), self.occupied),
            math.inf if is_none else float(at.mean()),
            at,
        )

    def covers(self, positions: Any) -> bool:
        """Whether shapely alone calls a line free, but for pairs of corners."""
        return bool(self.ground.covers(_shape(positions)))

    def _around(self, point: Any) -> list[tuple[int, int]]:
        """Return the free cells whose closed squares hold a point."""
        rows, cols = ({math.floor(value), math.ceil(value) - 1} for value in point)
        return [cell for cell in ((r, c) for r in rows for c in cols) if self._is_free(*cell)]

    def _is_free(self, row: int, col: int) -> bool:
        rows, cols = self._free.shape
        return 0 <= row < rows and 0 <= col < cols and bool(self._free[row, col])

    def _standing(self, piece: Any) -> set[tuple[int, int]]:
        """Return the free cells whose closed squares hold a piece: no side of a cell cuts it."""
        return set(self._around([(a + b) / 2 for a, b in zip(*piece, strict=True)]))

    def _joined(self, one: set[Any], two: set[Any], point: Any) -> bool:
        """Whether one may step at a point from cells to others, over sides that lie there."""
        seen, todo = set(one), list(one)
        around = set(self._around(point))
        while todo:
            row, col = todo.pop()
            for cell in ((row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)):
                if cell in around and cell not in seen:
                    seen.add(cell)
                    todo.append(cell)
        return bool(seen & two)

    def _run(self, pieces: Any, ends: Any, begun: int, after: int) -> Run:
        own = pieces[begun:after]
        depths = shapely.distance(_points(_samples(own, STEP_CELLS)), self.ground)
        depth = math.inf if self.ground.is_empty else depths.max()
        kinds: set[str] = set()
        for one, two in own:  # at its ends it touches more cells than it passes
            for point in (one, two, [(a + b) / 2 for a, b in zip(one, two, strict=True)]):
                rows, cols = ({math.floor(value), math.ceil(value) - 1} for value in point)
                kinds |= {self._kind(row, col) for row in rows for col in cols}
        return Run(float(ends[begun]), float(ends[after]), float(depth), frozenset(kinds))

    def _kind(self, row: int, col: int) -> str:
        rows, cols = self._free.shape
        if not (0 <= row < rows and 0 <= col < cols):
            return "outside the map"
        if self._classes[row, col] == CellClass.UNEXPLORED:
            return "unexplored"
        return "obstacle" if self._occupied_cells[row, col] else "near an obstacle"


def squares(cells: Any) -> Any:
    """Return the union of the closed squares of cells, x along columns."""
    low = np.argwhere(cells)[:, ::-1]
    return shapely.union_all(shapely.box(*low.T, *(low + 1).T))


def _shape(positions: Any) -> Any:
    points = np.asarray(positions)[:, ::-1]
    is_point = (points == points[0]).all()
    return shapely.Point(points[0]) if is_point else shapely.LineString(points)


def _pieces(line: list[Any]) -> list[Any]:
    """Cut a line at its points and wherever it meets a side of cells; points alone stay whole."""
    pieces: list[Any] = []
    for one, two in pairwise(line):
        if one == two:
            continue
        shares = {Fraction(0), Fraction(1)}
        for a, b in zip(one, two, strict=True):
            low, high = sorted((a, b))
            if a != b:
                shares |= {(n - a) / (b - a) for n in range(math.ceil(low), math.floor(high) + 1)}
        points = [
            tuple(a + share * (b - a) for a, b in zip(one, two, strict=True))
            for share in sorted(shares)
        ]
        pieces += pairwise(points)
    return pieces or [(line[0], line[0])]


def _squared(one: Any, two: Any) -> Fraction:
    return sum(((b - a) ** 2 for a, b in zip(one, two, strict=True)), Fraction(0))


def _samples(pieces: Any, step: float) -> Any:
    """Return positions along pieces, float64 (n, 2), no further apart than a step."""
    found = []
    for one, two in pieces:
        count = math.ceil(math.sqrt(float(_squared(one, two))) / step) + 1
        share = np.linspace(0, 1, count)[:, None]
        found.append(np.array(one, float) * (1 - share) + np.array(two, float) * share)
    return np.concatenate(found)


def _points(positions: Any) -> Any:
    return shapely.points(positions[:, ::-1])
