"""How much of a path another one shares."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely.ops import substring

from hybridnav.costs import cost_along

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from hybridnav.costs import CostLayer
    from hybridnav.grid import OccupancyGrid
    from hybridnav.planner.legs import Leg
    from hybridnav.planner.tour import Tour

LegKey = tuple[int | None, str | None, int | None]
"""Number of the door before a leg, name of its room, number of the door behind; None for none."""

_ROUNDING_M = 1e-9


def keys_of_legs(legs: tuple[Leg, ...]) -> list[LegKey]:
    """Return the room of each leg with the doors at both ends, as a person knows it."""
    doors = [None if leg.door is None else leg.door.number for leg in legs]
    return list(zip([None, *doors[:-1]], [leg.room for leg in legs], doors, strict=True))


class Track:
    """The line of a tour, for comparisons with others.

    Parameters
    ----------
    tour
        A solved tour of one plan.
    near_m
        Distance up to which two paths count as one, in metres.
    by_legs
        Whether legs between the same two doors of one room are common, wherever they pass.
    costs
        The map and the costs of its cells, by which the tour was planned: then shares are of its
        cost. None for lengths.
    """

    def __init__(
        self,
        tour: Tour,
        near_m: float,
        *,
        by_legs: bool = True,
        costs: tuple[OccupancyGrid, CostLayer] | None = None,
    ) -> None:
        self._by_legs, self._costs = by_legs, costs
        path = tour.results[0].path
        assert path is not None  # noqa: S101 - the tour is solved
        points = path.points if len(path.points) > 1 else path.points.repeat(2, axis=0)
        self._line = shapely.LineString(shapely.LineString(points).simplify(_ROUNDING_M).coords)
        self._beside = self._line.buffer(near_m)
        self._keys = keys_of_legs(tour.legs)
        self._lengths_m = [leg.length_m for leg in tour.legs]
        self.cost_m = tour.length_m if costs is None else tour.cost
        """Length of the tour, or its cost, in metres."""

    def share(self, other: Track) -> float:
        """Return the share of this path that it has in common with another one, from 0 to 1: of its
        length, or of its cost.

        That is what lies near the other path, and, unless rooms are looked into, the whole of each
        leg between the same two doors of one room.
        """
        if self.cost_m <= 0:
            return 1.0
        known = set(other._keys) if self._by_legs else set()
        begin, common_m, apart = 0.0, 0.0, []
        for key, length_m in zip(self._keys, self._lengths_m, strict=True):
            end = begin + length_m
            if key in known:
                common_m += length_m if self._costs is None else self._between(begin, end)
            else:
                apart.append(substring(self._line, begin, end))
            begin = end
        rest = apart if self._keys else [self._line]
        common_m += sum(self._measured(part.intersection(other._beside)) for part in rest)
        return float(min(common_m / self.cost_m, 1.0))

    def _between(self, begin: float, end: float) -> float:
        """Return the cost between two lengths along the path."""
        return self._measured(substring(self._line, begin, end))

    def _measured(self, line: BaseGeometry) -> float:
        """Return the length, or the cost, of parts of the path."""
        if self._costs is None:
            return float(line.length)
        parts = (shapely.get_coordinates(part) for part in np.atleast_1d(shapely.get_parts(line)))
        return sum(cost_along(*self._costs, points) for points in parts if len(points))
