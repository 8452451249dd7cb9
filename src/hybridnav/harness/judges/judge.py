"""Judges of paths that share no code with planners: legal cells, segments, lengths. Public:
`Verdict` and `ScipyOptimum`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse
from scipy.sparse import csgraph

from hybridnav._base.trig import hypot, hypots
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges import kernels
from hybridnav.maps import CellClass, Frame
from hybridnav.maps.checks import checked_points

if TYPE_CHECKING:
    from hybridnav.maps import OccupancyGrid


Cell = tuple[int, int]

_BETWEEN = "passes between two blocked cells that meet at a corner"
_WORDS = {
    kernels.OUTSIDE: "leaves the map",
    kernels.BLOCKED: "enters a blocked cell",
    kernels.BETWEEN: _BETWEEN,
    kernels.SEAM: "runs along the side between two blocked cells",
}
_QUANTUM = 2.0**-24
_OUTERMOST = 2.0**28
"""Position in cells at which points farther away are judged: beyond any map, and exact."""


@dataclass(frozen=True)
class Verdict:
    """Findings of the judge on a path."""

    faults: tuple[str, ...]
    """One line for each kind of fault, with its first place and the number of others."""
    length_m: float
    """Length of the polyline through the centres of the cells, in metres."""

    @property
    def ok(self) -> bool:
        """Whether the path has no fault."""
        return not self.faults


def judge_path(
    grid: OccupancyGrid,
    cells: ArrayLike,
    *,
    start: Cell,
    goal: Cell,
    allow_unexplored: bool = False,
) -> Verdict:
    """Judge a cell path by the rules of the octile grid and by exact geometry.

    Parameters
    ----------
    grid
        The map.
    cells
        The path, whole numbers (n, 2) of (row, col).
    start, goal
        The cells that the path should join.
    allow_unexplored
        Whether unexplored cells count as free.

    Returns
    -------
    Verdict
        Faults: wrong first or last cell; cells outside the map or not free; a step that does not go
        to one of the 8 neighbours. A segment between centres that enters a blocked cell or passes
        between two that meet at a corner is a fault. So is a diagonal step with one blocked side
        cell ("cuts a corner": legal for a line, not for a move of the octile grid). A cell that is
        not free counts as blocked. On a grid with `corner_cutting` there are no faults about
        corners.

    Raises
    ------
    InvalidValueError
        When the cells are no integer array of shape (n, 2).

    Examples
    --------
    >>> from hybridnav.harness.judges import judge_path
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 0.0], [0.0, 1.0]]), robot_radius_m=0)
    >>> judge_path(grid, [(0, 1), (1, 0)], start=(0, 1), goal=(1, 0)).faults
    ('the step from (0, 1) to (1, 0) cuts a corner',)
    """
    path = _checked_cells(cells)
    if not len(path):
        return Verdict(("the path has no cells",), 0.0)
    rows, cols = grid.shape
    free_of = free_classes(allow_unexplored=allow_unexplored)
    inside: BoolArray = np.all((path >= 0) & (path < (rows, cols)), axis=1)
    free = inside.copy()
    free[inside] = free_of[grid.classes[path[inside, 0], path[inside, 1]]]
    # As floats, so that no number from a faulty planner overflows.
    steps = np.diff(path.astype(np.float64), axis=0)
    near = np.abs(steps).max(axis=1, initial=0.0) <= 1  # a cell may come twice: no length
    # Halves are exact in float64, and so are the tests of segments between centres.
    centres = np.clip(path.astype(np.float64), -_OUTERMOST, _OUTERMOST) + 0.5
    codes = kernels.segment_codes(grid.classes, free_of, centres)[: len(steps)]
    cut = _cut_corners(grid, path, near & inside[1:], free_of)
    corners = (
        *_about_steps(path, codes == kernels.BETWEEN, _BETWEEN),
        *_about_steps(path, cut, "cuts a corner"),
    )
    return Verdict(
        (
            *_wrong_endpoints(path, start, goal),
            *_about_cells(path, ~inside, "outside the map"),
            *_about_cells(path, inside & ~free, "not free"),
            *_about_steps(path, ~near, "does not go to a neighbour"),
            *_about_steps(path, codes == kernels.BLOCKED, _WORDS[kernels.BLOCKED]),
            *(() if grid.corner_cutting else corners),
        ),
        _length_in_cells(steps) * grid.resolution_m,
    )


def segment_faults(
    grid: OccupancyGrid, points: ArrayLike, *, allow_unexplored: bool = False
) -> tuple[str, ...]:
    """Return the faults of any polyline against the free space of a map.

    Free space is the union of the closed squares of the free cells; outside the map nothing is
    free. A segment may touch the side or corner of a blocked cell. It may not enter one, run along
    a side that two of them share, or pass between two that meet at a corner, straight or bent.

    Points are converted to grid units and rounded to 2^-24 of a cell, so that corners and centres
    of cells, the bends of shortest paths, are exact again. Every test after that is exact. A point
    interpolated on a segment that grazes a corner can lie on the wrong side of it: judge a path
    before it is resampled.

    Parameters
    ----------
    grid
        The map.
    points
        `(x, y)` in metres, map frame, shape (n, 2), n >= 1, finite.
    allow_unexplored
        Whether unexplored cells count as free.

    Returns
    -------
    tuple of str
        One line for each faulty segment and each faulty bend, in order; empty for a legal line.

    Raises
    ------
    InvalidValueError
        When the points are no finite array of shape (n, 2) or there is none.

    Examples
    --------
    >>> from hybridnav.harness.judges import segment_faults
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 1.0, 0.0]]), robot_radius_m=0)
    >>> segment_faults(grid, [(0.5, 0.5), (2.5, 0.5)])
    ('the segment from (0.500, 0.500) to (2.500, 0.500) m enters a blocked cell',)
    """
    xy = checked_points(points)
    positions = grid_positions(grid.frame, xy)
    free_of = free_classes(allow_unexplored=allow_unexplored)
    codes = kernels.segment_codes(grid.classes, free_of, positions)
    crossed = kernels.crossed_joints(grid.classes, free_of, positions)
    endpoints = np.stack([xy[: len(codes)], xy[-len(codes) :]], axis=1)
    faults = []
    for i in np.flatnonzero(codes).tolist():
        start, end = endpoints[i]
        what = _WORDS[int(codes[i])]
        faults.append((i, 1, f"the segment from {_at(start)} to {_at(end)} m {what}"))
    bends = np.flatnonzero(crossed).tolist()
    faults.extend((i, 0, f"the bend at {_at(xy[i])} m {_BETWEEN}") for i in bends)
    return tuple(text for _, _, text in sorted(faults))


def free_classes(*, allow_unexplored: bool) -> BoolArray:
    """Return whether a cell of each `CellClass` is free.

    `allow_unexplored`: whether unexplored cells count as free. Returns bool (3,), indexed by class.
    """
    free_of = np.zeros(len(CellClass), dtype=np.bool_)
    free_of[CellClass.FREE] = True
    free_of[CellClass.UNEXPLORED] = allow_unexplored
    return free_of


def _checked_cells(cells: ArrayLike) -> LongArray:
    path = np.asarray(cells)
    if path.ndim != 2 or path.shape[1] != 2 or path.dtype.kind not in "iu":  # noqa: PLR2004
        raise InvalidValueError(
            f"cells must be whole numbers of shape (n, 2), got {path.dtype} of shape {path.shape}: "
            "convert them by astype(int); points in metres go into AnyAngleResult"
        )
    return path.astype(np.int64)


def grid_positions(frame: Frame, xy: FloatArray) -> FloatArray:
    """Return the positions (row, col) of points, rounded to 2^-24 of a cell, held near the map."""
    positions = np.clip(frame.positions_of(xy), -_OUTERMOST, _OUTERMOST)
    return np.rint(positions / _QUANTUM) * _QUANTUM


def _wrong_endpoints(path: LongArray, start: Cell, goal: Cell) -> list[str]:
    return [
        f"the {which} cell is {_cell(cell)}, not {_cell(wanted)}"
        for which, cell, wanted in (("first", path[0], start), ("last", path[-1], goal))
        if tuple(cell) != tuple(wanted)
    ]


def _about_cells(path: LongArray, wrong: BoolArray, what: str) -> list[str]:
    where = np.flatnonzero(wrong).tolist()
    return [f"cell {_cell(path[at])} is {what}{more(len(where))}" for at in where[:1]]


def _about_steps(path: LongArray, wrong: BoolArray, what: str) -> list[str]:
    where = np.flatnonzero(wrong).tolist()
    ends = [(_cell(path[at]), _cell(path[at + 1])) for at in where[:1]]
    return [f"the step from {tail} to {head} {what}{more(len(where))}" for tail, head in ends]


def _cut_corners(
    grid: OccupancyGrid, path: LongArray, judged: BoolArray, free_of: BoolArray
) -> BoolArray:
    """Return the diagonal steps to a neighbour with exactly one of two side cells blocked."""
    cut = np.zeros(len(path) - 1, dtype=np.bool_)
    diagonal = np.flatnonzero(judged & (path[1:] != path[:-1]).all(axis=1))
    tail, head = path[diagonal], path[diagonal + 1]
    within = ((tail >= 0) & (tail < grid.shape)).all(axis=1)
    diagonal, tail, head = diagonal[within], tail[within], head[within]
    one = free_of[grid.classes[tail[:, 0], head[:, 1]]]
    other = free_of[grid.classes[head[:, 0], tail[:, 1]]]
    cut[diagonal] = one != other
    return cut


def _length_in_cells(steps: FloatArray) -> float:
    # Count equal steps instead of adding them: a + b sqrt 2, rounded once for each kind of step.
    lengths, counts = np.unique(hypots(steps[:, 0], steps[:, 1]), return_counts=True)
    return math.fsum((lengths * counts).tolist())


def _cell(cell: LongArray | Cell) -> str:
    return f"({int(cell[0])}, {int(cell[1])})"


def _at(point: FloatArray) -> str:
    return f"({point[0]:.3f}, {point[1]:.3f})"


def more(count: int) -> str:
    """Return the number of further faults beside the first one, in brackets."""
    return "" if count == 1 else f" (and {count - 1} more)"


# Optimal lengths on the octile grid by scipy, an oracle independent of the planners.

# In the order of the flat indices that they lead to, so that the matrix has sorted rows.
_STEPS = ((-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1))


class ScipyOptimum:
    """The graph of all legal moves of a grid, and Dijkstra's algorithm on it by scipy.

    Moves go to the 8 neighbours; a diagonal needs both side cells free. The graph takes up to 96
    bytes for each free cell.

    Parameters
    ----------
    grid
        The map.
    allow_unexplored
        Whether unexplored cells may be entered.

    Examples
    --------
    >>> from hybridnav.harness.judges import ScipyOptimum
    >>> optimum = ScipyOptimum(hn.OccupancyGrid(np.zeros((2, 3)), robot_radius_m=0))
    >>> optimum.lengths_from((0, 0)).round(3)
    array([[0.   , 1.   , 2.   ],
           [1.   , 1.414, 2.414]])
    """

    def __init__(self, grid: OccupancyGrid, *, allow_unexplored: bool = False) -> None:
        self._free = free_classes(allow_unexplored=allow_unexplored)[grid.classes]
        self._node_of = np.where(self._free, np.cumsum(self._free).reshape(grid.shape) - 1, -1)
        self._graph = _move_graph(self._free)
        self._resolution_m = grid.resolution_m

    def lengths_from(self, start: Cell) -> FloatArray:
        """Return the length of the shortest path from a cell to every cell.

        Parameters
        ----------
        start
            (row, col), inside the map.

        Returns
        -------
        FloatArray
            float64 (rows, cols), metres, a sum of steps (1e-12 off at most, relatively); infinite
            where there is no path, and everywhere when the start is not free.

        Raises
        ------
        InvalidValueError
            When the cell lies outside the map.

        Notes
        -----
        E. W. Dijkstra: A note on two problems in connexion with graphs, 1959.
        """
        row, col = start
        rows, cols = self._free.shape
        if not (0 <= row < rows and 0 <= col < cols):
            raise InvalidValueError(
                f"cell ({row}, {col}) lies outside the map of {rows} x {cols} cells"
            )
        lengths: FloatArray = np.full(self._free.shape, np.inf)
        node = int(self._node_of[tuple(start)])
        if node >= 0:
            reached = csgraph.dijkstra(self._graph, directed=True, indices=[node])[0]
            lengths[self._free] = reached * self._resolution_m
        return lengths


def _move_graph(free: BoolArray) -> sparse.csr_array[np.float64, tuple[int, int]]:
    """Return the legal moves between free cells, numbered in the order of the map; in cells."""
    padded = np.pad(free, 1)
    number = np.cumsum(padded, dtype=np.int32).reshape(padded.shape) - 1
    row, col = (index.astype(np.int32) + 1 for index in np.nonzero(free))
    legal = np.empty((len(row), len(_STEPS)), dtype=np.bool_)
    heads = np.empty(legal.shape, dtype=np.int32)
    for k, (up, right) in enumerate(_STEPS):
        legal[:, k] = padded[row + up, col + right]
        if up and right:
            legal[:, k] &= padded[row + up, col] & padded[row, col + right]
        heads[:, k] = number[row + up, col + right]
    offsets = np.zeros(len(row) + 1, dtype=np.int32)
    np.cumsum(legal.sum(axis=1), out=offsets[1:])
    lengths = np.array([hypot(*step) for step in _STEPS])
    weights = np.broadcast_to(lengths, legal.shape)[legal]
    return sparse.csr_array((weights, heads[legal], offsets), shape=(len(row), len(row)))
