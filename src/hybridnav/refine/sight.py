"""Which positions see each other: exact tests of many segments at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.refine.kernels.segments import apart, clear_segments, reaches, shared
from hybridnav.refine.kernels.taut import marks_of

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray


class Sight:
    """Exact tests of segments against the free cells of a map; it holds one byte a cell.

    Parameters
    ----------
    free
        bool (rows, cols); cells outside are blocked.

    Examples
    --------
    >>> from hybridnav.refine import Sight
    >>> sight = Sight(np.array([[True, False, True], [True, True, True]]))
    >>> sight.clear(np.array([[0.5, 0.5], [1.5, 0.5]]), np.array([[0.5, 2.5], [1.5, 2.5]]))
    array([False,  True])
    """

    def __init__(self, free: BoolArray) -> None:
        cells = np.ascontiguousarray(free).view()
        cells.flags.writeable = False
        self._marks = marks_of(cells)

    def clear(self, tails: FloatArray, heads: FloatArray) -> BoolArray:
        """Return which segments stay in free space, as `LineOfSight` defines it.

        Parameters
        ----------
        tails, heads
            float64 (n, 2), endpoints (row, col) in grid units, inside the map, in free space and
            rounded to 2^-24 of a cell.

        Returns
        -------
        BoolArray
            bool (n,); true for two equal endpoints.
        """
        found: BoolArray = clear_segments(
            self._marks, np.ascontiguousarray(tails), np.ascontiguousarray(heads)
        )
        return found

    def apart(
        self, taken: FloatArray, candidates: FloatArray, spacing_cells: float, most: int
    ) -> BoolArray:
        """Choose positions one by one that see no other within a distance.

        Parameters
        ----------
        taken
            float64 (k, 2), positions as in `clear` that are there already.
        candidates
            float64 (n, 2), positions to choose from, in the order in which they are tried.
        spacing_cells
            The distance in cells; with 0, only equal positions are left out.
        most
            Number of positions, taken ones included, at which to stop.

        Returns
        -------
        BoolArray
            bool (n,), the chosen candidates.
        """
        both = np.concatenate([taken, candidates])
        found: BoolArray = apart(self._marks, both, len(taken), spacing_cells, most)[len(taken) :]
        return found

    def reaches(self, corners: FloatArray, steps: FloatArray, farthest: float) -> FloatArray:
        """Return about how far rays from lattice corners run through free cells.

        Parameters
        ----------
        corners
            float64 (n, 2), (row, col) in grid units.
        steps
            float64 (n, 2), steps of length 1 along the rays.
        farthest
            Distance in cells at which rays end.

        Returns
        -------
        FloatArray
            float64 (n,), in cells, up to a step of half a cell.
        """
        found: FloatArray = reaches(self._marks, corners, steps, farthest)
        return found

    def shared(
        self, starts: FloatArray, goals: FloatArray, limits: FloatArray, positions: FloatArray
    ) -> BoolArray:
        """Return which pairs see a common position over which the way is short enough.

        Parameters
        ----------
        starts, goals
            float64 (n, 2), as in `clear`.
        limits
            float64 (n,), lengths in cells up to which a way is short enough.
        positions
            float64 (k, 2), as in `clear`.

        Returns
        -------
        BoolArray
            bool (n,).
        """
        found: BoolArray = shared(self._marks, starts, goals, limits, positions)
        return found
