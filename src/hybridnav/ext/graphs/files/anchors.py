"""Where a map lies on the Earth: from metres to latitude and longitude, and back."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from hybridnav._base.trig import cos, sin
from hybridnav.errors import InvalidValueError

_EQUATOR_M = 6378137.0
_SQUARED_ECCENTRICITY = 6.69437999014e-3
"""WGS 84."""
_MOST_LATITUDE_DEG = 85.0


@dataclass(frozen=True)
class Anchor:
    """The place of a map frame's origin on the Earth, and where its y axis points.

    The projection is local: metres to the north are degrees of latitude times the radius of
    curvature of the meridian at the anchor, metres to the east degrees of longitude times that of
    the parallel, on the ellipsoid of WGS 84. Up to 200 m from the anchor, and 60 degrees from the
    equator, that is within 2 cm of the plane that touches the Earth there.

    Raises
    ------
    InvalidValueError
        When a number is out of range.

    Examples
    --------
    >>> from hybridnav.ext.graphs import Anchor
    >>> anchor = Anchor(48.0, 11.0)
    >>> latitude, longitude = anchor.degrees_of((100.0, 0.0))
    >>> round(latitude, 7), round(longitude, 7)
    (48.0, 11.00134)
    >>> x, y = anchor.point_of(latitude, longitude)
    >>> round(x, 6), round(y, 6)
    (100.0, 0.0)
    """

    latitude_deg: float
    """Degrees to the north of the equator, from -85 to 85."""
    longitude_deg: float
    """Degrees to the east, from -180 to 180."""
    heading_deg: float = 0.0
    """Direction of the y axis in degrees, clockwise from north: with 0, x points east."""

    def __post_init__(self) -> None:
        """Refuse what is no place."""
        for name, most in (("latitude", _MOST_LATITUDE_DEG), ("longitude", 180.0)):
            value = getattr(self, f"{name}_deg")
            if not -most <= value <= most:
                raise InvalidValueError(
                    f"an anchor has {name} {value}, expected degrees from -{most:g} to {most:g}"
                )
        if not math.isfinite(self.heading_deg):
            raise InvalidValueError(
                f"an anchor has heading {self.heading_deg}, expected degrees clockwise from north"
            )

    @cached_property
    def _radii_m(self) -> tuple[float, float]:
        """Metres per radian to the north and to the east."""
        sine = sin(math.radians(self.latitude_deg))
        bulge = 1.0 - _SQUARED_ECCENTRICITY * sine * sine
        north = _EQUATOR_M * (1.0 - _SQUARED_ECCENTRICITY) / (bulge * math.sqrt(bulge))
        east = _EQUATOR_M / math.sqrt(bulge) * cos(math.radians(self.latitude_deg))
        return north, east

    def degrees_of(self, point: tuple[float, float]) -> tuple[float, float]:
        """Return latitude and longitude of a point `(x, y)` in metres, in degrees."""
        sine, cosine = self._turn
        east = cosine * point[0] + sine * point[1]
        north = cosine * point[1] - sine * point[0]
        per_north, per_east = self._radii_m
        return (
            self.latitude_deg + math.degrees(north / per_north),
            self.longitude_deg + math.degrees(east / per_east),
        )

    def point_of(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """Return the point `(x, y)` in metres at a latitude and longitude in degrees."""
        sine, cosine = self._turn
        per_north, per_east = self._radii_m
        north = math.radians(latitude_deg - self.latitude_deg) * per_north
        east = math.radians(longitude_deg - self.longitude_deg) * per_east
        return cosine * east - sine * north, sine * east + cosine * north

    @property
    def _turn(self) -> tuple[float, float]:
        heading = math.radians(self.heading_deg)
        return sin(heading), cos(heading)
