"""Files of OpenStreetMap as readers of area graphs take them, in metres of the plane that touches
the Earth.

Written after `Parsing_Osm2AreaGraph` and the rules of the draft of the indoor osmAG standard
(jiajiezhang7/osmAG-from-cad); the plane by way of geocentric coordinates. Shares no code with
hybridnav.
"""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass, field

AREA_TYPES = ("room", "corridor", "structure", "elevator", "stairs")


@dataclass
class Area:
    """An area of an area graph."""

    name: str
    kind: str
    level: float
    outline: list[tuple[float, float]]


@dataclass
class Read:
    """What a file holds."""

    points: dict[int, tuple[float, float]] = field(default_factory=dict)
    tags: dict[int, dict[str, str]] = field(default_factory=dict)
    areas: dict[int, Area] = field(default_factory=dict)
    passages: list[tuple[int, int, list[int], dict[str, str]]] = field(default_factory=list)
    ways: list[tuple[list[int], dict[str, str]]] = field(default_factory=list)
    """Ways with `highway`."""


def _geocentric(latitude, longitude):
    a, squared = 6378137.0, 6.69437999014e-3
    phi, lam = math.radians(latitude), math.radians(longitude)
    n = a / math.sqrt(1 - squared * math.sin(phi) ** 2)
    x = n * math.cos(phi) * math.cos(lam)
    return x, n * math.cos(phi) * math.sin(lam), n * (1 - squared) * math.sin(phi)


def east_north(origin, place):
    """Metres to the east and north of an origin, both (latitude, longitude)."""
    phi, lam = map(math.radians, origin)
    dx, dy, dz = (b - a for a, b in zip(_geocentric(*origin), _geocentric(*place), strict=True))
    east = -math.sin(lam) * dx + math.cos(lam) * dy
    out = math.cos(lam) * dx + math.sin(lam) * dy
    return east, math.cos(phi) * dz - math.sin(phi) * out


def read_osm(path) -> Read:
    """Read a file; what breaks a rule fails."""
    root = ET.parse(path).getroot()  # noqa: S314
    assert root.tag == "osm"
    assert root.get("version") == "0.6"
    found = Read()
    places = {}
    for node in root.iter("node"):
        number = int(node.attrib["id"])
        assert number < 0
        assert number not in places
        assert node.attrib["action"] == "modify"
        assert node.attrib["visible"] == "true"
        places[number] = float(node.attrib["lat"]), float(node.attrib["lon"])
        found.tags[number] = {tag.attrib["k"]: tag.attrib["v"] for tag in node.iter("tag")}
    (origin,) = [
        places[n]
        for n, tags in found.tags.items()
        if tags.get("name") == "root" and "level" not in tags
    ]
    found.points = {number: east_north(origin, place) for number, place in places.items()}
    kinds = [child.tag for child in root]
    assert kinds == sorted(kinds), "nodes stand before ways"
    for way in root.iter("way"):
        _take(found, way)
    for start, end, _, _ in found.passages:
        assert start in found.areas
        assert end in found.areas
    return found


def _take(found, way):
    number = int(way.attrib["id"])
    refs = [int(nd.attrib["ref"]) for nd in way.iter("nd")]
    tags = {tag.attrib["k"]: tag.attrib["v"] for tag in way.iter("tag")}
    assert all(ref in found.points for ref in refs)
    assert [float(level) for level in tags["level"].split(";")]
    if tags.get("osmAG:type") == "area":
        assert number not in found.areas
        assert refs[0] == refs[-1]
        assert len(refs) > 3
        assert tags["osmAG:areaType"] in AREA_TYPES
        outline = [found.points[ref] for ref in refs[:-1]]
        found.areas[number] = Area(
            tags["name"], tags["osmAG:areaType"], float(tags["level"]), outline
        )
    elif tags.get("osmAG:type") == "passage":
        assert len(refs) == 2
        assert "name" in tags
        ends = int(tags["osmAG:from"]), int(tags["osmAG:to"])
        found.passages.append((*ends, refs, tags))
    else:
        assert "highway" in tags
        found.ways.append((refs, tags))
