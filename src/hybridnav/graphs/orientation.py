"""One orientation for all turned and mirrored images of a map."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from hybridnav._base.typing import AnyArray, BoolArray, FloatArray


@dataclass(frozen=True)
class Orientation:
    """How a map is turned and mirrored: choices between equals go by index, and are the same there
    for all images of the map."""

    shape: tuple[int, ...]
    """Rows and cols of the map."""
    swaps: int = 0
    """Whether rows and cols change places."""
    flips: tuple[int, int] = (0, 0)
    """Whether rows are reversed then, and cols."""

    @classmethod
    def of(cls, cells: BoolArray) -> Orientation:
        """Find that of a map by the shape of some cells, one at least.

        Rows run along the longer extent, and both axes away from the heavier half; where that
        leaves a choice, the image that comes first is chosen.
        """
        row, col = (np.flatnonzero(cells.any(axis=axis))[[0, -1]].tolist() for axis in (1, 0))
        inside = cells[row[0] : row[1] + 1, col[0] : col[1] + 1]

        def rank(image: Orientation) -> tuple[object, ...]:
            turned = image.turned(inside)
            counts = [np.count_nonzero(turned, axis=axis).astype(np.int64) for axis in (1, 0)]
            off = [2 * np.arange(len(count)) - len(count) + 1 for count in counts]
            sums = [int(count @ away) for count, away in zip(counts, off, strict=True)]
            return -int(counts[0] @ off[0] ** 2), *sums, turned.shape, turned.tobytes()

        images = (
            cls(cells.shape, swaps, (down, left)) for swaps, down, left in product((0, 1), repeat=3)
        )
        return min(images, key=rank)

    def turned(self, cells: AnyArray) -> AnyArray:
        """Return an array (rows, cols), turned."""
        swapped = cells.T if self.swaps else cells
        down, left = self.flips
        return np.ascontiguousarray(swapped[:: 1 - 2 * down, :: 1 - 2 * left])

    def there(self, positions: AnyArray) -> FloatArray:
        """Return where positions, float64 (..., 2), lie on the turned map."""
        order = 1 - 2 * self.swaps
        at = positions[..., ::order]
        return np.where(self.flips, self.shape[::order] - at, at)

    def back(self, positions: AnyArray) -> FloatArray:
        """Return where positions on the turned map, float64 (..., 2), lie on the map."""
        order = 1 - 2 * self.swaps
        at = np.where(self.flips, self.shape[::order] - positions, positions)
        return at[..., ::order]
