"""States of the robot along a path of cells, where the legs of a chain meet."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._trig import atan2, cos, sin

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray
    from hybridnav.refine.ompl.messages import Query
    from hybridnav.refine.ompl.search_area import SearchArea
    from hybridnav.refine.ompl.spaces import StateSpace

_AHEAD_M = 1.0
"""Distance before and behind a cell over which the direction of the path is taken."""
_TURNS = tuple(math.radians(degrees) for degrees in (0, 15, -15, 30, -30, 60, -60, 90, -90))
_ASIDE_CELLS = (0, 2, -2, 4, -4, 8, -8)


class Poses:
    """Valid states at cells of a path.

    The endpoints are those of the query. The others head along the path, turned or moved aside if
    that is not valid.

    Parameters
    ----------
    query
        Query with the path of cells.
    corridor
        Corridor that states must lie in.
    whole
        State space of the corridor.
    """

    def __init__(self, query: Query, corridor: SearchArea, whole: StateSpace) -> None:
        self._check = corridor.check
        self._has_heading = whole.dimension > 2  # noqa: PLR2004
        self._resolution_m = corridor.grid.resolution_m
        self._centres = corridor.grid.frame.points_of(query.cells)
        last = len(query.cells) - 1
        self._known: dict[int, FloatArray | None] = {last: query.goal}
        self._known[0] = query.start

    def at(self, index: int) -> FloatArray | None:
        """Return the state at a cell of the path, float64 (3,); None if no state near it is
        valid."""
        if index not in self._known:
            self._known[index] = self._found(index)
        return self._known[index]

    def pair(self, first: int, last: int) -> tuple[FloatArray, FloatArray]:
        """Return the states at two cells that have valid ones."""
        one, other = self.at(first), self.at(last)
        assert one is not None  # noqa: S101 - the caller has looked
        assert other is not None  # noqa: S101
        return one, other

    def _found(self, index: int) -> FloatArray | None:
        x, y = self._centres[index].tolist()
        if not self._has_heading:
            return np.array([x, y, 0.0])
        steps = max(int(_AHEAD_M / self._resolution_m), 1)
        ahead = self._centres[min(index + steps, len(self._centres) - 1)]
        ahead = ahead - self._centres[max(index - steps, 0)]
        heading = atan2(ahead[1], ahead[0])
        for aside in _ASIDE_CELLS:
            offset_m = aside * self._resolution_m
            at_x, at_y = x - offset_m * sin(heading), y + offset_m * cos(heading)
            for turn in _TURNS:
                if self._check.state_valid(at_x, at_y, heading + turn):
                    return np.array([at_x, at_y, math.remainder(heading + turn, math.tau)])
        return None
