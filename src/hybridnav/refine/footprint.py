"""Footprints: the outline of a robot, its radii and its convex parts."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely

from hybridnav._base.copies import copies_alike
from hybridnav._base.trig import hypots
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError, brief

MAX_CORNERS = 1000
"""Most corners of a footprint."""
_FARTHEST_M = 1e4
_ROUNDING = 1e-12


@copies_alike
@dataclass(frozen=True, eq=False)
class Footprint:
    """Outline of a robot in its own frame: x ahead, y to its left, the base at the origin.

    Parameters
    ----------
    corners_m
        The corners of a simple polygon in order, (n, 2) in metres, n from 3 to `MAX_CORNERS`, at
        most 10 km away; the last may repeat the first. Stored counter-clockwise, each once.

    Raises
    ------
    InvalidValueError
        When the corners are no simple polygon with an area, too many or too far.

    Examples
    --------
    >>> from hybridnav.refine.footprint import Footprint
    >>> Footprint([[0.3, 0.2], [0.3, -0.2], [-0.1, -0.2], [-0.1, 0.2]]).inscribed_radius_m
    0.1
    """

    corners_m: FloatArray
    """float64 (n, 2), counter-clockwise, metres, robot frame."""
    inscribed_radius_m: float = field(init=False)
    """Radius of the largest disc about the base inside the outline; 0 with the base outside."""
    circumscribed_radius_m: float = field(init=False)
    """Distance from the base to the farthest corner."""

    def __post_init__(self) -> None:
        polygon = _polygon_of(self.corners_m)
        corners = shapely.get_coordinates(polygon.exterior)[:-1]
        corners.flags.writeable = False
        base = shapely.Point(0.0, 0.0)
        inscribed_m = polygon.exterior.distance(base) if polygon.contains(base) else 0.0
        object.__setattr__(self, "corners_m", corners)
        object.__setattr__(self, "inscribed_radius_m", float(inscribed_m))
        object.__setattr__(self, "circumscribed_radius_m", float(hypots(*corners.T).max()))

    @classmethod
    def of(cls, shape: Any) -> Footprint:
        """Return a footprint from another one, from a shapely polygon or from corners.

        `shape`: a footprint; a shapely `Polygon` without holes; or corners in order, (n, 2).
        Metres, robot frame. Raises `InvalidValueError` when the polygon has holes, or the corners
        are refused.
        """
        if isinstance(shape, cls):
            return shape
        if not isinstance(shape, shapely.Polygon):
            return cls(shape)
        if len(shape.interiors):
            raise InvalidValueError("a footprint must have no holes")
        return cls(shapely.get_coordinates(shape.exterior))

    def padded(self, padding_m: float) -> Footprint:
        """Return the outline with each side moved outwards, corners kept sharp (mitred).

        Nav2 moves each corner outwards along both axes of the robot: the same for a rectangle along
        them about the base, and less than the padding for some others.

        `padding_m`: metres, >= 0.
        """
        if not padding_m > 0:
            return self
        return Footprint.of(shapely.Polygon(self.corners_m).buffer(padding_m, join_style="mitre"))

    def convex_parts(self) -> list[FloatArray]:
        """Return the corners of convex polygons that form the outline, float64 (n, 2) each, metres.

        A convex outline is returned itself, any other as triangles (constrained Delaunay).
        """
        polygon = shapely.Polygon(self.corners_m)
        hull = shapely.convex_hull(polygon)
        if hull.area - polygon.area <= _ROUNDING * hull.area:
            return [self.corners_m]
        triangles = shapely.constrained_delaunay_triangles(polygon)
        return [shapely.get_coordinates(part)[:-1] for part in triangles.geoms]


def _polygon_of(corners_m: Any) -> shapely.Polygon:
    """Return the polygon of some corners, checked, counter-clockwise, each corner once."""
    try:
        corners = np.array(corners_m, dtype=np.float64)
    except (TypeError, ValueError):
        corners = np.empty(0)
    if corners.ndim != 2 or corners.shape[1] != 2 or not 3 <= len(corners) <= MAX_CORNERS + 1:  # noqa: PLR2004
        raise InvalidValueError(
            f"a footprint needs 3 to {MAX_CORNERS} corners [x, y] in metres, got {brief(corners_m)}"
        )
    # NaN fails this comparison too.
    if not (np.abs(corners) <= _FARTHEST_M).all():
        raise InvalidValueError(f"corners of a footprint must lie within {_FARTHEST_M:g} m")
    distinct = corners[(corners != np.roll(corners, 1, axis=0)).any(axis=1)]
    polygon = shapely.Polygon(distinct) if len(distinct) > 2 else shapely.Polygon()  # noqa: PLR2004
    if not polygon.is_valid:
        why = shapely.is_valid_reason(polygon)
        raise InvalidValueError(f"a footprint must be a simple polygon, got {why}")
    if polygon.area <= _ROUNDING * polygon.length * polygon.length:
        raise InvalidValueError("a footprint must be a simple polygon with an area, got none")
    return polygon if polygon.exterior.is_ccw else polygon.reverse()
