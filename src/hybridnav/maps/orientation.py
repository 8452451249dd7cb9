"""One orientation for all turned and mirrored images of a map."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from hybridnav._base.typing import AnyArray, FloatArray


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
    def of(cls, cells: AnyArray) -> Orientation:
        """Find that of a map by the shape of the cells that are not 0, one at least.

        Rows run along the longer extent, and both axes away from the heavier half; where that
        leaves a choice, the image that comes first by its numbers is chosen.
        """
        row, col = (np.flatnonzero(cells.any(axis=axis))[[0, -1]].tolist() for axis in (1, 0))
        inside = cells[row[0] : row[1] + 1, col[0] : col[1] + 1]

        counts = [np.count_nonzero(inside, axis=axis).astype(np.int64) for axis in (1, 0)]
        away = [2 * np.arange(len(count)) - len(count) + 1 for count in counts]
        sums = [int(count @ off) for count, off in zip(counts, away, strict=True)]
        extents = [int(count @ (off * off)) for count, off in zip(counts, away, strict=True)]

        def rank(image: Orientation) -> tuple[object, ...]:
            order = 1 - 2 * image.swaps
            signs = zip(sums[::order], image.flips, strict=True)
            return -extents[image.swaps], *(s - 2 * s * f for s, f in signs), inside.shape[::order]

        images = [
            cls(cells.shape, swaps, (down, left)) for swaps, down, left in product((0, 1), repeat=3)
        ]
        first = min(map(rank, images))
        alike = [image for image in images if rank(image) == first]
        return min(alike, key=lambda image: image.turned(inside).tobytes() if alike[1:] else b"")

    def turned(self, cells: AnyArray) -> AnyArray:
        """Return an array (rows, cols), turned."""
        swapped = cells.T if self.swaps else cells
        down, left = self.flips
        return np.ascontiguousarray(swapped[:: 1 - 2 * down, :: 1 - 2 * left])

    def turned_back(self, cells: AnyArray) -> AnyArray:
        """Return an array of the turned map as it lies on the map."""
        down, left = self.flips
        flipped = cells[:: 1 - 2 * down, :: 1 - 2 * left]
        return flipped.T if self.swaps else flipped

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
