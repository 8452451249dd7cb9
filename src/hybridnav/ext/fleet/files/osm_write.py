"""Writer of OpenStreetMap's XML with indoor tags, and those of area graphs (osmAG)."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from xml.sax.saxutils import quoteattr

import shapely

from hybridnav._base.files import NewFile
from hybridnav._base.typing import FloatArray, PathLike
from hybridnav.ext.fleet import BuildingGraph, FloorGraph, Link, join_links
from hybridnav.ext.fleet.files.osm_xml import Anchor
from hybridnav.ext.fleet.files.rmf_write import speed_limit_of
from hybridnav.ext.fleet.link_nodes import nodes_of_link
from hybridnav.graphs.gather import number_of
from hybridnav.maps.checks import checked_type

_DECIMALS = 11
"""Decimals of degrees: a micrometre. OpenStreetMap itself keeps 7, a centimetre."""
_HIGHWAYS = {"lift": "elevator", "stairs": "steps", "ramp": "footway"}
AREA_TYPES = {"lift": "elevator", "stairs": "stairs", "ramp": "room"}
"""Values of `osmAG:areaType` for what joins floors; it has none for ramps."""
ALONE = "hybridnav:alone"
"""Key of the nodes that no edge joins: no way has them."""
ID, ID_BACK = "hybridnav:id", "hybridnav:id_back"
"""Keys of the id of a node or edge, and of the edge that leads back along the same way."""
_KM_H = 3.6
_MOST_LEVEL = 1000
"""Greatest number of a floor that is taken for its level."""

Tags = dict[str, str]


def export_osm(building: BuildingGraph, path: PathLike, *, anchor: Anchor) -> tuple[str, ...]:
    """Write a building as OpenStreetMap's XML, for editors, area graphs and road graphs.

    * Rooms are closed ways with `indoor`, `level`, `level:ref` and `name`, as in Simple Indoor
      Tagging of OpenStreetMap's wiki, and `osmAG:type=area` with `osmAG:areaType`.
    * Doors are nodes with `door=yes`. Doors and openings between two rooms are ways of two nodes,
      shared with the outlines of both where these are near. They have `osmAG:type=passage`, and the
      ids of the two areas as `osmAG:from` and `osmAG:to`. So it is in the draft "Indoor osmAG Map
      Standard" and `OsmAGExporter.cpp` (jiajiezhang7/osmAG-from-cad).
    * Edges are ways with `highway=footway`, `indoor=yes`, and `oneway=yes` where no edge leads
      back.
    * Links are ways through their ends from the lowest to the highest, with `highway` elevator,
      steps or footway, all levels in `level`, and `oneway` where they lead one way. On each floor
      they are an area with a passage to the room around.

    Other facts of a `Link`, the name of an edge's door, and the ids of nodes and edges that are
    whole numbers have keys that begin with `hybridnav:`.

    Parameters
    ----------
    building
        The floors and links, all floors in one frame.
    path
        The file, ending in .osm or .xml; one that exists is replaced.
    anchor
        Where that frame lies on the Earth.

    Returns
    -------
    tuple of str
        What the file does not hold, one line each.

    Raises
    ------
    InvalidValueError
        When this is no building graph, or no anchor.
    MapError
        When the name ends otherwise, or the file cannot be written.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Anchor, Building, Floor, building_graph, export_osm
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = Building([Floor("0", hn.HybridPlanner(topology))])
    >>> anchor = Anchor(48.15, 11.57, heading_deg=30)
    >>> export_osm(building_graph(house), "house.osm", anchor=anchor)
    ()
    """
    checked_type("building", building, BuildingGraph)
    checked_type("anchor", anchor, Anchor)
    file = NewFile.named(path, "OpenStreetMap", "a file of OpenStreetMap", (".osm", ".xml"))
    writer = _Writer(building, anchor)
    file.write("".join(f"{line}\n" for line in writer.lines()).encode())
    return tuple(_left_out(building))


class _Writer:
    """Nodes and ways in the order in which they are written; new ones have negative ids."""

    def __init__(self, building: BuildingGraph, anchor: Anchor) -> None:
        self._building = join_links(building)
        self._anchor = anchor
        self._levels = level_numbers(building)
        self._nodes: list[tuple[tuple[float, float], Tags]] = []
        self._ways: list[tuple[list[int], Tags]] = []
        root = {"name": "root", "hybridnav:building": building.name}
        if anchor.heading_deg:
            root["hybridnav:heading_deg"] = repr(float(anchor.heading_deg))
        self._node((0.0, 0.0), root)
        self._joined = {
            floor.name: frozenset(floor.graph.edges.ravel().tolist())
            for floor in self._building.floors
        }
        self._graph_nodes = {
            floor.name: [
                self._node(point, self._node_tags(floor, node))
                for node, point in enumerate(_pairs(floor.graph.points))
            ]
            for floor in self._building.floors
        }
        shapes = {floor.name: Shapes(floor) for floor in building.floors}
        areas = {floor.name: self._areas(floor, shapes[floor.name]) for floor in building.floors}
        for floor in building.floors:
            self._doors(floor, shapes[floor.name], areas[floor.name])
        for floor in self._building.floors:
            self._edges(floor)
        for link in self._building.links:
            self._link(link, shapes, areas)

    def lines(self) -> Iterator[str]:
        yield "<?xml version='1.0' encoding='UTF-8'?>"
        yield "<osm version='0.6' generator='hybridnav'>"
        for number, (point, tags) in enumerate(self._nodes, start=1):
            place = (f"{angle:.{_DECIMALS}f}" for angle in self._anchor.degrees_of(point))
            head = "<node id='-{}' action='modify' visible='true' lat='{}' lon='{}'"
            yield from _element("node", head.format(number, *place), [], tags)
        for number, (refs, tags) in enumerate(self._ways, start=1):
            inner = [f"<nd ref='-{ref}' />" for ref in refs]
            head = f"<way id='-{number}' action='modify' visible='true'"
            yield from _element("way", head, inner, tags)
        yield "</osm>"

    def _node(self, point: tuple[float, float], tags: Tags) -> int:
        self._nodes.append((point, tags))
        return len(self._nodes)

    def _add_way(self, refs: list[int], tags: Tags) -> int:
        self._ways.append((refs, tags))
        return len(self._ways)

    def _on(self, floor: FloorGraph) -> Tags:
        return {"level": self._levels[floor.name], "level:ref": floor.name}

    def _raised(self, floor: FloorGraph) -> Tags:
        """Return the tags of what lies on a floor; `height` is that of the floor, as in osmAG."""
        height = {} if floor.elevation_m is None else {"height": repr(float(floor.elevation_m))}
        return self._on(floor) | height

    def _node_tags(self, floor: FloorGraph, node: int) -> Tags:
        name = floor.graph.node_facts.get(node, {}).get("name")
        tags = self._on(floor) | ({"name": name} if isinstance(name, str) and name else {})
        own_id = floor.graph.ids[0][node]
        tags |= {ID: str(own_id)} if type(own_id) is int else {}
        return tags | ({} if node in self._joined[floor.name] else {ALONE: "yes"})

    def _areas(self, floor: FloorGraph, shapes: Shapes) -> dict[str, int]:
        """Write the areas of a floor; return the way of each name."""
        corners: dict[tuple[float, float], int] = {}
        ways: dict[str, int] = {}
        for area, ring in zip(floor.areas, shapes.rings, strict=True):
            for point in ring:
                if point not in corners:
                    corners[point] = self._node(point, {})
            refs = [corners[point] for point in ring]
            tags = {"indoor": area.kind, "name": area.name, "osmAG:areaType": "room"}
            way = self._add_way(
                [*refs, refs[0]], tags | {"osmAG:type": "area"} | self._raised(floor)
            )
            ways.setdefault(area.name, way)
        shapes.corners = corners
        return ways

    def _doors(self, floor: FloorGraph, shapes: Shapes, way_of: dict[str, int]) -> None:
        for door in floor.doors:
            if not door.is_opening:
                (x, y), (u, v) = door.ends
                tags = {"door": "yes", "name": door.name} | self._on(floor)
                self._node(((x + u) / 2, (y + v) / 2), tags)
            sides = [way_of[room] for room in door.rooms if room in way_of]
            if len(sides) == 2:  # noqa: PLR2004 - both sides
                refs = [shapes.corners.get(end) or self._node(end, {}) for end in door.ends]
                self._passage(refs, door.name, (sides[0], sides[1]), self._raised(floor))

    def _passage(self, refs: list[int], name: str, joined: tuple[int, int], tags: Tags) -> None:
        sides = {"osmAG:from": f"-{joined[0]}", "osmAG:to": f"-{joined[1]}"}
        self._add_way(refs, {"name": name, "osmAG:type": "passage"} | sides | tags)

    def _edges(self, floor: FloorGraph) -> None:
        """Write each edge, and one that leads back as the same way."""
        graph, refs, ids = floor.graph, self._graph_nodes[floor.name], floor.graph.ids[1]
        waiting: dict[tuple[int, int, str, float | None], list[int]] = {}
        for edge, (tail, head) in enumerate(graph.edges.tolist()):
            door, speed = _facts_of(floor, edge)
            own_id = ids[edge]
            back = waiting.get((head, tail, door, speed))
            if back:
                way_tags = self._ways[back.pop() - 1][1]
                del way_tags["oneway"]
                way_tags |= {ID_BACK: str(own_id)} if type(own_id) is int else {}
                continue
            tags = {"highway": "footway", "indoor": "yes", "oneway": "yes"} | self._on(floor)
            tags |= {"hybridnav:door": door} if door else {}
            tags |= {ID: str(own_id)} if type(own_id) is int else {}
            tags |= {} if speed is None else {"maxspeed": f"{speed * _KM_H:.6g}"}
            way = self._add_way([refs[tail], refs[head]], tags)
            waiting.setdefault((tail, head, door, speed), []).append(way)

    def _link(
        self, link: Link, shapes: dict[str, Shapes], way_of: dict[str, dict[str, int]]
    ) -> None:
        stops = nodes_of_link(self._building, link)
        way = [self._graph_nodes[floor.name][node] for floor, node in stops]
        levels = ";".join(self._levels[floor.name] for floor, _ in stops)
        tags = {"highway": _HIGHWAYS[link.kind], "indoor": "yes", "name": link.name}
        tags |= {"level": levels, "hybridnav:link": link.kind}
        tags |= {None: {}, "up": {"oneway": "yes"}, "down": {"oneway": "-1"}}[link.one_way]
        for key in ("wait_s", "ride_s", "cost_m", "max_radius_m"):
            value = float(getattr(link, key))
            if value and math.isfinite(value):
                tags[f"hybridnav:{key}"] = repr(value)
        self._add_way(way, tags)
        areas = []
        for (floor, node), own_node in zip(stops, way, strict=True):
            middle = tuple(floor.graph.points[node].tolist())
            refs = [self._node(point, {}) for point in cabin_corners(middle, link.max_radius_m)]
            own = {"indoor": "room", "name": link.name, "osmAG:areaType": AREA_TYPES[link.kind]}
            mark = {"hybridnav:link": link.kind}
            own |= {"osmAG:type": "area"} | mark | self._raised(floor)
            area = self._add_way([*refs, refs[0]], own)
            areas.append((floor, area, own_node))
            room = shapes[floor.name].area_at(middle)
            if room in way_of[floor.name]:
                to = way_of[floor.name][room]
                self._passage(
                    refs[:2], f"{link.name} {floor.name}", (area, to), self._raised(floor)
                )
        for (low, below, one), (high, above, other) in itertools.pairwise(areas):
            name = f"{link.name} {low.name} {high.name}"
            on = {"hybridnav:link": link.kind} | self._raised(high)
            self._passage([one, other], name, (below, above), on)


def level_numbers(building: BuildingGraph) -> dict[str, str]:
    """Return the number of each floor for `level`: its name where all are ascending numbers, else
    its place from 0."""
    names = [floor.name for floor in building.floors]
    numbers = [number_of(name) for name in names]
    plain = all(abs(number) <= _MOST_LEVEL and number == round(number, 1) for number in numbers)
    if plain and all(low < high for low, high in itertools.pairwise(numbers)):
        return {name: f"{number:g}" for name, number in zip(names, numbers, strict=True)}
    return {name: str(place) for place, name in enumerate(names)}


def _facts_of(floor: FloorGraph, edge: int) -> tuple[str, float | None]:
    facts = floor.graph.edge_facts.get(edge, {})
    door = facts.get("door_name")
    return door if isinstance(door, str) else "", speed_limit_of(facts)


def _pairs(points: FloatArray) -> list[tuple[float, float]]:
    return [(x, y) for x, y in points.tolist()]


def _element(kind: str, head: str, inner: list[str], tags: Tags) -> Iterator[str]:
    if not inner and not tags:
        yield f"  {head} />"
        return
    yield f"  {head}>"
    yield from (f"    {line}" for line in inner)
    for key, value in tags.items():
        yield f"    <tag k={quoteattr(key)} v={_value(value)} />"
    yield f"  </{kind}>"


def _value(text: str) -> str:
    """Return a text as the value of an attribute; what XML cannot hold becomes U+FFFD."""
    plain = "".join(letter if _is_xml(letter) else "\ufffd" for letter in text)
    return quoteattr(plain, {"\n": "&#10;", "\r": "&#13;", "\t": "&#9;"})


def _is_xml(letter: str) -> bool:
    return letter in "\t\n\r" or (
        letter >= " " and not "\ud800" <= letter <= "\udfff" and letter not in "\ufffe\uffff"
    )


def _left_out(building: BuildingGraph) -> Iterator[str]:
    flags = sorted(
        {
            key
            for floor in building.floors
            for facts in floor.graph.node_facts.values()
            for key, value in facts.items()
            if key.startswith("is_") and value is True
        }
    )
    if flags:
        yield f"facts of nodes: {', '.join(flags)}"
    bent = sum(len(floor.graph.lines) for floor in building.floors)
    if bent:
        yield f"lines of {bent} edges: ways run straight"


# Outlines of areas that share points with passages, and areas of lifts and stairs.

Point = tuple[float, float]
Ring = list[Point]

_NEAR_M = 0.3
"""Distance in metres up to which the end of a door becomes a corner of an outline beside it."""
_LEAST_M = 0.01
"""Least distance in metres of a new corner from both corners of its side: it makes no spike."""
_SHAPE_DECIMALS = 3
"""Decimals of metres to which outlines must not cross themselves, as degrees are rounded."""
_CABIN_M = 2.0
"""Side in metres of the area of a link that holds robots of any size."""


class Shapes:
    """The outlines of a floor's areas, counter-clockwise, with the ends of doors as corners."""

    def __init__(self, floor: FloorGraph) -> None:
        self._names = [area.name for area in floor.areas]
        self._polygons = [shapely.Polygon(area.outline) for area in floor.areas]
        self.rings = [_counter_clockwise(_pairs(area.outline)) for area in floor.areas]
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
    coarse = [(round(x, _SHAPE_DECIMALS), round(y, _SHAPE_DECIMALS)) for x, y in changed]
    return changed if shapely.Polygon(coarse).is_valid else ring


def cabin_corners(middle: Point, max_radius_m: float) -> Ring:
    """Return a square round the end of a link that the largest robot just fits in, or of 2 m."""
    half = max_radius_m if math.isfinite(max_radius_m) else _CABIN_M / 2
    x, y = middle
    return [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]


def _counter_clockwise(ring: Ring) -> Ring:
    return ring if shapely.LinearRing(ring).is_ccw else ring[::-1]
