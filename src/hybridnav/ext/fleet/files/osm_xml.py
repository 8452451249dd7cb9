"""OpenStreetMap's XML: nodes and ways with their tags, and where on the Earth they lie. Public:
`Anchor`.
"""

import math
import re
from dataclasses import dataclass, field
from functools import cached_property
from xml.parsers import expat

import numpy as np

from hybridnav._base.trig import cos, sin
from hybridnav._base.xml_reader import MOST_BYTES, XmlReader
from hybridnav.errors import InvalidValueError, MapError
from hybridnav.ext.fleet import LinkKind
from hybridnav.graphs.gather import number_of, pair_of, shown

# From metres to latitude and longitude, and back.

_DECIMALS = 5
_INDOOR = ("room", "corridor", "area")
_EQUATOR_M = 6378137.0
_SQUARED_ECCENTRICITY = 6.69437999014e-3
"""WGS 84."""
_MOST_LATITUDE_DEG = 85.0
_HEAD = 4096
"""Characters in which the first element begins."""
_MOST_LEVELS = 100
"""Levels that one `level` may list."""


@dataclass(frozen=True)
class Anchor:
    """The place of a map frame's origin on the Earth, and where its y axis points.

    The projection is local, on the ellipsoid of WGS 84. Metres to the north are degrees of latitude
    times the radius of curvature of the meridian at the anchor. Metres to the east are degrees of
    longitude times that of the parallel. Up to 200 m from the anchor, and 60 degrees from the
    equator, that is within 2 cm of the plane that touches the Earth there.

    Raises
    ------
    InvalidValueError
        When a number is out of range.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Anchor
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


# Nodes and ways with their tags, element by element.

_RANGE = re.compile(r"(-?\d{1,4})-(-?\d{1,4})")

Tags = dict[str, str]


@dataclass
class OsmWay:
    """A way."""

    id: int
    refs: list[int] = field(default_factory=list)
    tags: Tags = field(default_factory=dict)

    @property
    def is_closed(self) -> bool:
        """Whether it ends where it begins, round an area."""
        return len(self.refs) > 3 and self.refs[0] == self.refs[-1]  # noqa: PLR2004


@dataclass
class OsmData:
    """What a file holds."""

    places: dict[int, tuple[float, float]] = field(default_factory=dict)
    """Latitude and longitude of each node in degrees."""
    tags: dict[int, Tags] = field(default_factory=dict)
    """Tags of the nodes that have some."""
    ways: list[OsmWay] = field(default_factory=list)
    lost: list[int] = field(default_factory=list)
    """Nodes without a place on the Earth."""

    @cached_property
    def closed(self) -> frozenset[int]:
        """Ids of the closed ways."""
        return frozenset(way.id for way in self.ways if way.is_closed)

    @cached_property
    def door_names(self) -> frozenset[str]:
        """Names of the doors that are nodes."""
        return frozenset(tags.get("name", "") for tags in self.tags.values() if is_door(tags))


def is_osm(text: str) -> bool:
    """Return whether the first element of a text is that of OpenStreetMap's XML."""
    first = re.search(r"<([A-Za-z]+)[\s>]", text[:_HEAD])
    return first is not None and first[1] == "osm"


def read_osm_xml(text: str, where: str) -> OsmData:
    """Read nodes and ways; relations and all else are passed over.

    `where`: what messages begin with. Raises `MapError` when it is no XML of OpenStreetMap, or
    declares a document type: entities could make it endless.
    """
    if len(text) > MOST_BYTES:
        raise MapError(f"{where}: XML of OpenStreetMap of more than {MOST_BYTES} bytes is not read")
    reader = _Reader(where)
    reader.parse(text, expat.ParserCreate("utf-8"))
    return reader.data


class _Reader(XmlReader):
    def __init__(self, where: str) -> None:
        super().__init__(where)
        self.data = OsmData()
        self._node: int | None = None
        self._way: OsmWay | None = None

    def start(self, tag: str, given: dict[str, str]) -> None:
        """Begin an element."""
        if self._depth == 1 and tag != "osm":
            raise MapError(f"{self._where}: expected XML of OpenStreetMap (osm), got {tag!r:.40}")
        if given.get("action") == "delete" or given.get("visible") == "false":
            return
        if tag == "node":
            self._node = self._id(given, "id", tag)
            place = number_of(given.get("lat")), number_of(given.get("lon"))
            if abs(place[0]) <= 90 and abs(place[1]) <= 180:  # noqa: PLR2004 - degrees
                self.data.places[self._node] = place
            else:
                self.data.lost.append(self._node)
        elif tag == "way":
            self._way = OsmWay(self._id(given, "id", tag))
            self.data.ways.append(self._way)
        elif tag == "nd" and self._way is not None:
            self._way.refs.append(self._id(given, "ref", tag))
        elif tag == "tag":
            self._add_tag(given)

    def _add_tag(self, given: dict[str, str]) -> None:
        key, value = given.get("k"), given.get("v")
        if key is None or value is None:
            raise MapError(f"{self._where}: a tag has no k or no v")
        if self._way is not None:
            self._way.tags[key] = value
        elif self._node is not None:
            self.data.tags.setdefault(self._node, {})[key] = value

    def end(self, tag: str) -> None:
        if tag == "node":
            self._node = None
        elif tag == "way":
            self._way = None

    def _id(self, given: dict[str, str], key: str, tag: str) -> int:
        text = given.get(key, "")
        if not re.fullmatch(r"-?\d{1,19}", text):
            raise MapError(f"{self._where}: expected <{tag} {key}=NUMBER>, got {shown(text)!r:.60}")
        return int(text)


def levels_of(tags: Tags) -> list[float]:
    """Return the levels that an element states, ascending: `1`, `0;1`, `0-3`; none for none.

    As on the pages of the keys `level` and `repeat_on` in OpenStreetMap's wiki: what repeats lies
    at the same point of each.
    """
    levels: set[float] = set()
    for part in f"{tags.get('level', '')};{tags.get('repeat_on', '')}".split(";"):
        ends = _RANGE.fullmatch(part.strip())
        if ends:
            low, high = int(ends[1]), int(ends[2])
            levels.update(range(low, min(high, low + _MOST_LEVELS) + 1))
        else:
            levels.add(number_of(part))
        if len(levels) > _MOST_LEVELS:
            break
    return sorted(level for level in levels if not math.isnan(level))


def is_door(tags: Tags) -> bool:
    """Return whether a node is a door: `door`, `indoor=door` or `entrance`, unless it says no."""
    stated = {tags.get("door", "no"), tags.get("entrance", "no")} - {"no"}
    return bool(stated) or tags.get("indoor") == "door"


def link_kind(tags: Tags, *, is_line: bool) -> LinkKind | None:
    """Return what joins levels, None for what does not.

    Stairs and lifts are ways, areas or nodes (`highway`, `room`, `stairs`); any other line with
    `highway` on several levels is a ramp.
    """
    if tags.get("hybridnav:link") == "ramp":
        return "ramp"
    kind = _LINKS.get(tags.get("highway", "")) or _LINKS.get(tags.get("room", ""))
    if kind is None and tags.get("stairs", "no") != "no":
        kind = "stairs"
    is_ramp = is_line and "highway" in tags and "repeat_on" not in tags
    return kind or ("ramp" if is_ramp and len(levels_of(tags)) > 1 else None)


_LINKS: dict[str, LinkKind] = {"elevator": "lift", "steps": "stairs", "stairs": "stairs"}


def part_of(element: OsmWay) -> str:
    """Return the list of a floor that an element belongs to, empty for none."""
    kind = element.tags.get("osmAG:type")
    if kind == "passage":
        return "passages"
    if element.is_closed and (kind == "area" or element.tags.get("indoor") in _INDOOR):
        return "areas"
    is_route = (
        "highway" in element.tags and not element.is_closed and "hybridnav:link" not in element.tags
    )
    return "routes" if is_route else ""


def title_of(data: OsmData, name: str) -> str:
    """Return the name of the building that a file has, else `name`."""
    return next(
        (t["hybridnav:building"] for t in data.tags.values() if "hybridnav:building" in t), name
    )


def anchor_of(data: OsmData) -> Anchor:
    """Return the anchor of a file: its root, or the corner of its nodes."""
    for node, tags in data.tags.items():
        if tags.get("name") == "root" and node in data.places:
            heading = number_of(tags.get("hybridnav:heading_deg", 0.0))
            latitude, longitude = data.places[node]
            return _clipped(latitude, longitude, 0.0 if math.isnan(heading) else heading)
    latitude, longitude = np.array(list(data.places.values())).min(axis=0).tolist()
    return _clipped(latitude, longitude, 0.0)


def _clipped(latitude: float, longitude: float, heading: float) -> Anchor:
    return Anchor(min(max(latitude, -85.0), 85.0), longitude, heading)


def points_of(data: OsmData, anchor: Anchor) -> dict[int, tuple[float, float] | None]:
    """Return the points of the nodes in metres, rounded.

    Else nodes at a wall would lie in it after a round trip, by less than the last decimal of
    degrees.
    """
    points: dict[int, tuple[float, float] | None] = {}
    for node, place in data.places.items():
        x, y = anchor.point_of(*place)
        points[node] = pair_of((round(x, _DECIMALS), round(y, _DECIMALS)))
    return points
