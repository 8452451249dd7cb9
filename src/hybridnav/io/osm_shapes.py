"""Outlines of areas that share points with passages, and areas of lifts and stairs."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import shapely

if TYPE_CHECKING:
    from hybridnav.building import FloorGraph

Point = tuple[float, float]
Ring = list[Point]

_NEAR_M = 0.3
"""Distance in metres up to which the end of a door becomes a corner of an outline beside it."""
_LEAST_M = 0.01
"""Least distance in metres of a new corner from both corners of its side: it makes no spike."""
_DECIMALS = 3
"""Decimals of metres to which outlines must not cross themselves, as degrees are rounded."""
_CABIN_M = 2.0
"""Side in metres of the area of a link that holds robots of any size."""


class Shapes:
    """The outlines of a floor's areas, counter-clockwise, with the ends of doors as corners.

    Parameters
    ----------
    floor
        The floor.
    """

    def __init__(self, floor: FloorGraph) -> None:
        self._names = [area.name for area in floor.areas]
        self._polygons = [shapely.Polygon(area.outline) for area in floor.areas]
        self.rings = [
            _counter_clockwise([(x, y) for x, y in a.outline.tolist()]) for a in floor.areas
        ]
        self.corners: dict[Point, int] = {}
        """Node of each corner, filled by the writer."""
        place = {name: at for at, name in reversed(list(enumerate(self._names)))}
        for door in floor.doors:
            for room in door.rooms:
                if room in place:
                    ring = self.rings[place[room]]
                    for end in door.ends:
                        ring = with_corner(ring, end)
                    self.rings[place[room]] = ring

    def area_at(self, point: Point) -> str:
        """Return the name of the first area that covers a point, empty for none."""
        at = shapely.Point(point)
        names = zip(self._names, self._polygons, strict=True)
        return next((name for name, polygon in names if polygon.covers(at)), "")


def with_corner(ring: Ring, point: Point) -> Ring:
    """Return a ring with a point as corner, in the side nearest to it.

    The same ring if the point is a corner already, lies more than 0.3 m away or beyond the side, or
    would make the ring cross itself.
    """
    if point in ring:
        return ring
    sides = [shapely.LineString(side) for side in zip(ring, ring[1:] + ring[:1], strict=True)]
    at = shapely.Point(point)
    away = [side.distance(at) for side in sides]
    nearest = min(range(len(away)), key=away.__getitem__)
    along = sides[nearest].project(at)
    is_inside = _LEAST_M < along < sides[nearest].length - _LEAST_M
    if away[nearest] > _NEAR_M or not is_inside:
        return ring
    changed = [*ring[: nearest + 1], point, *ring[nearest + 1 :]]
    coarse = [(round(x, _DECIMALS), round(y, _DECIMALS)) for x, y in changed]
    return changed if shapely.Polygon(coarse).is_valid else ring


def cabin_corners(middle: Point, max_radius_m: float) -> Ring:
    """Return a square round the end of a link that the largest robot just fits in, or of 2 m."""
    half = max_radius_m if math.isfinite(max_radius_m) else _CABIN_M / 2
    x, y = middle
    return [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]


def _counter_clockwise(ring: Ring) -> Ring:
    return ring if shapely.LinearRing(ring).is_ccw else ring[::-1]
