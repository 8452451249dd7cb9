"""Ends of any-angle paths that are hard for those who search."""

import numpy as np
from numpy.typing import NDArray

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
