"""Shortest any-angle paths by the visibility graph, and ends that are hard for those who search."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.metrics import _segment_kernels as segments

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav.grid import OccupancyGrid
    from hybridnav.metrics import VisibilityGraph

Position = tuple[float, float]


def some_positions(free: NDArray[np.bool_], seed: int) -> list[tuple[tuple[int, int], Position]]:
    """Cells and positions in them: centres, anywhere, on sides, at corners."""
    rng = np.random.default_rng(seed)
    cells = np.argwhere(free)
    found: list[tuple[tuple[int, int], Position]] = []
    for _ in range(6):
        row, col = cells[rng.integers(len(cells))].tolist()
        up, right = rng.choice([0.0, 0.5, 0.5, 1.0, rng.integers(1, 2**24) / 2**24], 2).tolist()
        position = row + up, col + right
        if not _is_pinch(free, position):
            found.append(((row, col), position))
    return found


def _is_pinch(free: NDArray[np.bool_], position: Position) -> bool:
    """Whether two free cells meet at this corner alone: there sight asks which cell it is in."""
    row, col = position
    if row % 1 or col % 1:
        return False
    padded = np.pad(free, 1)
    (a, b), (c, d) = padded[int(row) : int(row) + 2, int(col) : int(col) + 2]
    return bool(a == d and b == c and a != b)


def by_visibility(
    grid: OccupancyGrid, graph: VisibilityGraph, start: Position, goal: Position
) -> float:
    """Length of a shortest path between positions by the visibility graph, in cells."""
    free_of = np.array([False, True, False])
    if start == goal:
        return 0.0
    if segments.segment_code(grid.classes, free_of, *start, *goal) == segments.CLEAR:
        return math.dist(start, goal)
    seen = [
        segments.visible_from(grid.classes, free_of, *end, graph.corners, graph._slopes)
        for end in (start, goal)
    ]
    left = np.hypot(*(graph.corners - goal).T)
    chain = segments.cheapest_corners(graph._offsets, graph._heads, graph._lengths, *seen, left)
    if not len(chain):
        return math.inf
    way = np.concatenate([[start], graph.corners[chain], [goal]])
    return float(np.hypot(*np.diff(way, axis=0).T).sum())
