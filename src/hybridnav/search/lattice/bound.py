"""A lower bound on the cost of all paths at any angle. Public: `slopes_of`."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from hybridnav._base.trig import dist, hypots
from hybridnav._base.typing import AnyArray, FloatArray, LongArray
from hybridnav.search.lattice.kernels import bound as kernels

Position = tuple[float, float]
Cell = tuple[int, int]


_RATIO = math.sqrt(4 - 2 * math.sqrt(2))
"""Most by which a path over corners is dearer than one at any angle, 1.0824."""
_MOST = 2.0**40
"""Cost from which on nothing is searched, in cells."""
_LEAST, _ITERATIONS, _EFFORT = 64, 256, 2**22
"""Most iterations, and most cells in all of them together."""
_ENOUGH = 0.99
"""Part of the cost of the known path that no bound need exceed."""
_ROUNDING = 1e-9
_CORNERS = np.array([[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])


def cost_bound(
    free: AnyArray,
    factors: AnyArray,
    ends: tuple[Position, Position],
    cells: tuple[Cell, Cell],
    known: float = math.inf,
) -> float:
    """Return a lower bound on the cost of all paths between two positions, in cells.

    Paths may touch blocked cells, but not pass between two that meet at a corner. A *potential*, a
    function that nowhere rises by more than the factor, is a bound by itself. No path costs less
    than the potential rises from its start to its goal. One that is linear on four triangles a cell
    is found by fast marching from both ends. A primal-dual iteration raises it; where it is still
    too steep, the excess is subtracted. It covers the cells over which a path may cost less than
    the known one. Paths that leave them cost more. Between two corners of cells, the cheapest path
    along sides and diagonals is at most 1.0824 times as dear as the cheapest at any angle, whatever
    the factors are. Along a side the smaller factor of its two cells counts.

    Parameters
    ----------
    free
        uint8 (rows, cols), 1 where a cell may be entered.
    factors
        float32 (rows, cols), >= 1.
    ends
        Positions (row, col) of start and goal, in grid units.
    cells
        The free cells (row, col) that hold them.
    known
        Cost of a path; a bound above it is of no use. Without one, the bound is that of sides and
        diagonals alone.

    Returns
    -------
    float
        At least the distance of the two; at most `known`.

    Notes
    -----
    The ratio for squares with any factors: arXiv 2404.07562, 2024.

    Examples
    --------
    >>> from hybridnav.search.lattice import cost_bound
    >>> free, factors = np.ones((9, 9), np.uint8), np.full((9, 9), 2, np.float32)
    >>> ends, cells = ((0, 0), (9, 4)), ((0, 0), (8, 3))
    >>> 19.3 < cost_bound(free, factors, ends, cells, 20) < 19.7  # the line costs 19.70
    True
    """
    return _bound_of(free, factors, ends, cells, known)[0]


def slopes_of(
    free: AnyArray,
    factors: AnyArray,
    ends: tuple[Position, Position],
    cells: tuple[Cell, Cell],
    known: float,
) -> tuple[LongArray, FloatArray]:
    """Return the slopes of the potential that `cost_bound` finds.

    Int64 (n, 2), the cells (row, col) that it covers, and float64 (n, 2), by how much it rises up
    and to the right in them.
    """
    return _bound_of(free, factors, ends, cells, known)[1:]


def _bound_of(
    free: AnyArray,
    factors: AnyArray,
    ends: tuple[Position, Position],
    cells: tuple[Cell, Cell],
    known: float,
) -> tuple[float, LongArray, FloatArray]:
    corners: list[Any] = []
    joins = 0.0
    covered, slopes = np.empty((0, 2), np.int64), np.empty((0, 2))
    for (row, col), cell in zip(ends, cells, strict=True):
        corner = round(row), round(col)
        joins += float(factors[tuple(cell)]) * dist((row, col), corner)
        corners.append(np.array(corner, dtype=np.int64))
    limit = min((known + joins) * _RATIO, _MOST)
    # As no factor is below 1, nothing outside of this box is within the limit.
    low, high = np.minimum(*corners), np.maximum(*corners)
    spare = np.maximum(limit - (high - low), 0) / 2 + 2
    low = np.maximum(low - spare, 0).astype(np.int64)
    high = np.minimum(high + spare, free.shape).astype(np.int64)
    box = slice(low[0], high[0]), slice(low[1], high[1])
    free, factors = np.ascontiguousarray(free[box]), np.ascontiguousarray(factors[box])
    inside: Any = [
        (tuple(end - low), tuple((cell - low).tolist()))
        for end, cell in zip(ends, cells, strict=True)
    ]
    start, goal = (
        kernels.corner_of(free, *(corner - low), cell[0])
        for corner, (_, cell) in zip(corners, inside, strict=True)
    )
    most = int(limit * kernels.UNITS)
    nothing = np.empty(0, np.int64)
    forth = kernels.costs_over_corners(free, factors, start, goal, most, nothing)
    over_corners = int(forth[goal])
    if over_corners > most:
        return known, covered, slopes
    found = over_corners / kernels.UNITS / _RATIO - joins
    if math.isfinite(known):
        back = kernels.costs_over_corners(free, factors, goal, start, most, forth)
        band = kernels.band_of(free, forth, back, most)
        by_potential, four = _by_potential(factors, band, (forth, back), inside, known)
        found = max(found, by_potential)
        covered = np.stack(np.divmod(band[0], factors.shape[1]), axis=1) + low
        slopes = np.stack([four[:, 2] + four[:, 3], four[:, 1] + four[:, 3]], axis=1)
        slopes -= np.stack([four[:, 0] + four[:, 1], four[:, 0] + four[:, 2]], axis=1)
    return min(max(found, dist(*ends)), known), covered, slopes / 2


def _by_potential(
    factors: AnyArray,
    band: tuple[LongArray, LongArray, LongArray],
    costs: tuple[LongArray, LongArray],
    ends: Sequence[tuple[Position, Cell]],
    known: float,
) -> tuple[float, FloatArray]:
    """Return the bound of a potential on some cells, on paths that stay in them, and its values at
    their corners."""
    flat, corners, flat_corners = band
    flat_ends = [row * factors.shape[1] + col for _, (row, col) in ends]
    own = np.searchsorted(flat, flat_ends)
    if len(flat) == 0 or (flat.take(own, mode="clip") != flat_ends).any():
        return 0.0, np.zeros((len(flat), 4))
    of_cells = factors.ravel()[flat].astype(np.float64)
    waves, joints = [], np.empty((2, 5))
    for k, (from_end, (position, cell)) in enumerate(zip(costs, ends, strict=True)):
        inside = np.clip(np.subtract(position, cell), 0.0, 1.0)
        wave = np.full(len(flat_corners), np.inf)
        wave[corners[own[k]]] = of_cells[own[k]] * hypots(*(_CORNERS - inside).T)
        order = np.argsort(from_end[flat_corners[corners]].min(axis=1), kind="stable")
        kernels.march(corners, of_cells, order, wave)
        waves.append(wave)
        joints[k] = own[k], *_weights_of(inside)
    potential = 0.5 * (waves[0] - waves[1])
    iterations = min(_ITERATIONS, max(_LEAST, _EFFORT // len(flat)))
    found: float = kernels.raise_potential(
        corners, of_cells, potential, joints, iterations, _ENOUGH * known
    )
    return found * (1 - _ROUNDING) - _ROUNDING, potential[corners]


def _weights_of(inside: FloatArray) -> tuple[int, float, float, float]:
    """Return the side whose triangle holds a position in a cell, and the weights of the middle and
    of the corners of the side there."""
    down, across = (2 * inside - 1).tolist()
    if abs(down) >= abs(across):
        side, inward, along = int(down > 0), abs(down), across
    else:
        side, inward, along = 2 + int(across > 0), abs(across), down
    return side, 1 - inward, 0.5 * (inward - along), 0.5 * (inward + along)
