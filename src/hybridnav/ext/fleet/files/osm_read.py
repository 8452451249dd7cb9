"""Reader of OpenStreetMap's XML of buildings: indoor tags, area graphs (osmAG), foot ways."""

import itertools
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from hybridnav._base.trig import dist
from hybridnav.errors import MapError
from hybridnav.ext.fleet import (
    BuildingGraph,
    DoorLine,
    FloorArea,
    FloorGraph,
    Link,
    LinkEnd,
    LinkKind,
)
from hybridnav.ext.fleet.files import osm_xml as osm
from hybridnav.ext.fleet.files.osm_write import ALONE, ID, ID_BACK
from hybridnav.ext.fleet.files.rmf_read import MOST_FLOORS, check_link_count, id_fact
from hybridnav.ext.fleet.links import DIRECTIONS, Direction
from hybridnav.graphs import WaypointGraph
from hybridnav.graphs.gather import Findings, Gathered, free_name, number_of, shown

Point = tuple[float, float]
Points = list[tuple[float, Point]]
Way = Direction | None

_VERTICAL: dict[str, LinkKind] = {"elevator": "lift", "stairs": "stairs"}
"""Values of `osmAG:areaType` that join levels."""
_FACTS = ("wait_s", "ride_s", "cost_m", "max_radius_m")
_ALONG = {"yes": 1, "true": 1, "1": 1, "forward": 1, "-1": -1, "backward": -1}
"""Values of `oneway` and `conveying`: along the line, or back."""
_KM_H = 3.6


@dataclass
class OsmFloor:
    """What lies on one level."""

    name: str
    level: float
    routes: list[osm.OsmWay] = field(default_factory=list)
    areas: list[osm.OsmWay] = field(default_factory=list)
    passages: list[osm.OsmWay] = field(default_factory=list)
    alone: set[int] = field(default_factory=set)
    """Nodes of the graph that are part of no way."""
    elevation_m: float | None = None

    def describe(self, tags: osm.Tags) -> None:
        """Take the name of the level from an element, and its height from an area of osmAG."""
        self.name = tags.get("level:ref") or self.name
        height = number_of(tags.get("height"))
        if tags.get("osmAG:type") == "area" and not math.isnan(height):
            self.elevation_m = height


def read_osm(
    text: str, where: str, name: str, *, anchor: osm.Anchor | None = None
) -> BuildingGraph:
    """Read a building.

    `where`: what messages begin with; `name`: name of a building that has none; `anchor`: where its
    frame is to lie on the Earth; None for the node named root of an area graph, or else the least
    latitude and longitude. Returns a floor for each level, from the lowest to the highest. Where a
    level has ways with `highway`, its nodes and edges are those; else nodes stand for areas, doors
    and passages, joined as `add_area_graph` does it. Raises `MapError` when it is no XML of
    OpenStreetMap, or has no level with a node.
    """
    data = osm.read_osm_xml(text, where)
    if not data.places:
        raise MapError(f"{where}: no node has a latitude and a longitude")
    points = osm.points_of(data, anchor or osm.anchor_of(data))
    floors = _sorted_floors(data, where)
    graphs = [
        _floor(floor, data, points, f"{where}, level {shown(floor.name)}") for floor in floors
    ]
    kept = [
        (floor, graph) for floor, graph in zip(floors, graphs, strict=True) if graph is not None
    ]
    if not kept:
        raise MapError(
            f"{where}: no level has a node, expected rooms (indoor=room), areas of osmAG or ways "
            "with highway and level"
        )
    level_names = {floor.level: floor.name for floor, _ in kept}
    links = _Links(data, points, level_names, where)
    joined = tuple(links.found(floors))
    first, *others = (graph for _, graph in kept if graph is not None)
    links.findings.add_all(first.graph.findings)
    first = replace(first, graph=replace(first.graph, findings=links.findings.collected()))
    title = osm.title_of(data, name)
    return BuildingGraph(name=title, floors=(first, *others), links=joined)


def _sorted_floors(data: osm.OsmData, where: str) -> list[OsmFloor]:
    """Return the levels, each with its ways; ways without a level lie on 0."""
    floors: dict[float, OsmFloor] = {}
    for way in data.ways:
        part, levels = osm.part_of(way), osm.levels_of(way.tags) or [0.0]
        is_link = len(levels) > 1 and osm.link_kind(way.tags, is_line=True) is not None
        if part == "" or (part == "routes" and is_link):
            continue
        for level in levels:
            floor = floors.setdefault(level, OsmFloor(f"{level:g}", level))
            getattr(floor, part).append(way)
        if len(levels) == 1:
            floors[levels[0]].describe(way.tags)
    for node, tags in data.tags.items():
        for level in osm.levels_of(tags)[:1] if ALONE in tags else ():
            floor = floors.setdefault(level, OsmFloor(f"{level:g}", level))
            floor.alone.add(node)
            floor.describe(tags)
    if len(floors) > MOST_FLOORS:
        raise MapError(f"{where}: more than {MOST_FLOORS} levels are not read")
    ordered = sorted(floors.values(), key=lambda floor: floor.level)
    counts = Counter(floor.name for floor in ordered)
    if max(counts.values(), default=1) > 1:
        for floor in ordered:
            floor.name = f"{floor.level:g}"
    return ordered


def _floor(
    floor: OsmFloor, data: osm.OsmData, points: dict[int, Point | None], where: str
) -> FloorGraph | None:
    """Return the graph of a level, None without a node."""
    gathered = Gathered(where)
    if floor.routes or floor.alone:
        _add_routes(gathered, floor, data, points)
    else:
        own = {way.id for way in floor.areas}
        inner = [way for way in floor.passages if not _leaves(way, own, data.closed)]
        add_area_graph(gathered, floor.areas, inner, data.tags, points)
    if not gathered.has_nodes:
        return None
    rooms = [way for way in floor.areas if _is_room(way)]
    names = {way.id: way.tags.get("name", f"way {way.id}") for way in rooms}
    return FloorGraph(
        name=floor.name,
        graph=WaypointGraph(**gathered.fields("osm", floor.name)),
        elevation_m=floor.elevation_m,
        doors=tuple(_doors(floor, names, data, points)),
        areas=tuple(_areas(rooms, names, points)),
    )


def _leaves(element: osm.OsmWay, own: set[int], elsewhere: frozenset[int]) -> bool:
    """Return whether a passage leads to an area of another level."""
    sides = [number_of(element.tags.get(key)) for key in ("osmAG:from", "osmAG:to")]
    return any(side in elsewhere and side not in own for side in sides)


def _add_routes(
    gathered: Gathered, floor: OsmFloor, data: osm.OsmData, points: dict[int, Point | None]
) -> None:
    """Add the nodes of ways, and an edge between each two that follow each other."""
    used = floor.alone.union(*(way.refs for way in floor.routes))
    for node in itertools.chain(data.places, data.lost):
        if node in used:
            tags = data.tags.get(node, {})
            gathered.add_node(node, points.get(node), tags | id_fact(tags.get(ID, "")))
    for way in floor.routes:
        facts: dict[str, Any] = dict(way.tags)
        if "hybridnav:door" in facts:
            facts["door_name"] = facts["hybridnav:door"]
        speed = number_of(facts.get("maxspeed"))
        if speed > 0:
            facts["speed_limit"] = round(speed / _KM_H, 6)
        along = _along(way)
        ahead, back = (facts | id_fact(way.tags.get(key, "")) for key in (ID, ID_BACK))
        for pair in itertools.pairwise(way.refs):
            if along >= 0:
                gathered.add_edge(pair, ahead)
            if along <= 0:
                gathered.add_edge(pair[::-1], back)


def _along(line: osm.OsmWay) -> int:
    """Return 1 for a line that is taken along itself alone, -1 back alone, 0 for both ways."""
    return _ALONG.get(line.tags.get("oneway", line.tags.get("conveying", "")), 0)


def _is_room(element: osm.OsmWay) -> bool:
    kind = element.tags.get("osmAG:areaType", "room")
    return kind in {"room", "corridor"} and "hybridnav:link" not in element.tags


def _areas(
    rooms: list[osm.OsmWay], names: dict[int, str], points: dict[int, Point | None]
) -> list[FloorArea]:
    areas = []
    for way in rooms:
        corners = [points.get(node) for node in way.refs[:-1]]
        if None not in corners and len(set(corners)) > 2:  # noqa: PLR2004
            is_corridor = "corridor" in {way.tags.get("osmAG:areaType"), way.tags.get("indoor")}
            outline = np.array(corners, dtype=np.float64)
            areas.append(FloorArea(names[way.id], "corridor" if is_corridor else "room", outline))
    return areas


def _doors(
    floor: OsmFloor, names: dict[int, str], data: osm.OsmData, points: dict[int, Point | None]
) -> list[DoorLine]:
    """Return the passages between two areas of a level."""
    by_name = {name: way for way, name in names.items()}
    doors = []
    for way in floor.passages:
        sides = [_area(way.tags.get(key), names, by_name) for key in ("osmAG:from", "osmAG:to")]
        rooms = [names[side] for side in sides if side is not None]
        ends = [point for node in way.refs[:2] if (point := points.get(node)) is not None]
        if len(rooms) < 2 or len(ends) < 2 or sides[0] == sides[1]:  # noqa: PLR2004 - both
            continue
        name = way.tags.get("name", f"way {way.id}")
        is_opening = name not in data.door_names
        doors.append(DoorLine(name, (ends[0], ends[1]), (rooms[0], rooms[1]), is_opening))
    return doors


class _Links:
    """What joins levels: ways and nodes with several levels, and areas of one name."""

    def __init__(
        self,
        data: osm.OsmData,
        points: dict[int, Point | None],
        names: dict[float, str],
        where: str,
    ) -> None:
        self._data, self._points, self._names, self._where = data, points, names, where
        self._taken: set[str] = set()
        self.findings = Findings()
        """Links that cannot be placed."""
        self._levels_at: dict[int, set[float]] = {}
        """Levels of the foot ways that pass a node."""
        self._lifts: list[tuple[osm.OsmWay, bool]] = []
        """Ways that are lifts, and whether they are links."""

    def found(self, floors: list[OsmFloor]) -> list[Link]:
        for floor in floors:
            for node in itertools.chain.from_iterable(way.refs for way in floor.routes):
                self._levels_at.setdefault(node, set()).add(floor.level)
        links = [*self._from_ways(), *self._from_nodes()]
        grouped: dict[tuple[str, LinkKind], list[tuple[float, Point]]] = {}
        for floor in floors:
            for way in floor.areas:
                kind = _VERTICAL.get(way.tags.get("osmAG:areaType", ""))
                corners = [point for node in way.refs[:-1] if (point := self._points.get(node))]
                name = way.tags.get("name", "")
                if kind is not None and corners and name and name not in self._taken:
                    x, y = np.mean(corners, axis=0).tolist()
                    grouped.setdefault((name, kind), []).append((floor.level, (x, y)))
        for (name, kind), stops in grouped.items():
            links.append(self._link(name, kind, stops, {}))
        return [link for link in links if link is not None]

    def _from_ways(self) -> list[Link | None]:
        links = []
        for way in self._data.ways:
            kind = osm.link_kind(way.tags, is_line=not way.is_closed)
            if kind is not None and len(osm.levels_of(way.tags)) > 1:
                name, served = way.tags.get("name", ""), self._served_levels(way)
                one_way = None if way.is_closed else self._direction(way, served)
                links.append(self._link(name, kind, served, way.tags, one_way))
                if kind != "lift":
                    self._note(links[-1], kind, f"way {way.id}")
            if kind == "lift":
                placed = len(osm.levels_of(way.tags)) > 1 and links[-1] is not None
                self._lifts.append((way, placed))
            elif kind == "stairs" and not osm.levels_of(way.tags):
                self._note_astray(way)
        return links

    def _direction(self, line: osm.OsmWay, served: Points) -> Way:
        """Return the one direction in which a line is taken, as an escalator is; None for both."""
        points = [self._points.get(node) for node in line.refs]
        levels = [level for level, _ in sorted(served, key=lambda each: points.index(each[1]))]
        if not _along(line) or len(levels) < 2:  # noqa: PLR2004
            return None
        return DIRECTIONS[(levels[0] < levels[-1]) != (_along(line) > 0)]

    def _note_astray(self, line: osm.OsmWay) -> None:
        """Note steps without a level, which are read as a way of level 0, beside other levels."""
        beside = {0.0}
        for node in line.refs:
            beside |= self._levels_at.get(node, set())
            beside.update(osm.levels_of(self._data.tags.get(node, {})))
        if len(beside) > 1:
            levels = ", ".join(f"{level:g}" for level in sorted(beside - {0.0}))
            self.findings.add("link-unread", f"stairs, way {line.id}: no level, beside {levels}")

    def _served_levels(self, line: osm.OsmWay) -> list[tuple[float, Point]]:
        """Return where a link stops.

        That is at nodes that state one level, or that a foot way of the level passes. Without such
        nodes it is an area in its middle, and a line of two levels at its other end, or by its
        incline.
        """
        levels = osm.levels_of(line.tags)
        placed = [(node, at) for node in line.refs if (at := self._points.get(node)) is not None]
        stops: dict[float, Point] = {}
        for node, at in placed:
            own = osm.levels_of(self._data.tags.get(node, {}))
            passed = self._levels_at.get(node, set()).intersection(levels)
            for level in own if len(own) == 1 else passed:
                stops.setdefault(level, at)
        lost = [level for level in levels if level not in stops]
        if line.is_closed:
            shape = _shape(line, self._points) if lost else None
            middle = None if shape is None else shape.representative_point()
            stops |= {} if middle is None else dict.fromkeys(lost, (middle.x, middle.y))
        elif lost and len(levels) == 2 and len(placed) > 1:  # noqa: PLR2004
            ends = [at for _, at in (placed[0], placed[-1])]
            incline = line.tags.get("incline", "")
            if len(lost) == 1:
                stops[lost[0]] = max(ends, key=lambda at: dist(at, *stops.values()))
            elif incline:
                is_down = incline == "down" or incline.startswith("-")
                stops = dict(zip(levels, ends[:: -1 if is_down else 1], strict=True))
        return list(stops.items())

    def _from_nodes(self) -> list[Link | None]:
        links: list[Link | None] = []
        shapes: list[Any] = [
            _shape(way, self._points) if way.is_closed else None for way, _ in self._lifts
        ]
        areas = shapely.STRtree(shapes)
        is_placed = [placed for _, placed in self._lifts]
        for node, tags in self._data.tags.items():
            kind, levels = osm.link_kind(tags, is_line=False), osm.levels_of(tags)
            point = self._points.get(node)
            if kind is None or not (kind == "lift" or len(levels) > 1):
                continue
            around = []
            if kind == "lift" and point is not None:
                around = areas.query(shapely.Point(point), predicate="intersects").tolist()
            if any(self._lifts[k][1] for k in around):
                continue  # the lift is its area
            stops = [(level, point) for level in levels if point is not None]
            links.append(self._link(tags.get("name", ""), kind, stops, tags))
            self._note(links[-1], kind, f"node {node}")
            for k in around:
                is_placed[k] |= links[-1] is not None
        for (way, _), placed in zip(self._lifts, is_placed, strict=True):
            if not placed:
                self.findings.add("link-unread", f"lift, way {way.id}")
        return links

    def _note(self, link: Link | None, kind: LinkKind, where: str) -> None:
        """Note a link that stops at fewer than two levels."""
        if link is None:
            self.findings.add("link-unread", f"{kind}, {where}")

    def _link(
        self, name: str, kind: LinkKind, points: Points, tags: osm.Tags, one_way: Way = None
    ) -> Link | None:
        """Return a link, None if it stops at fewer than two levels."""
        ends: dict[float, LinkEnd] = {}
        for level, point in sorted(points, key=lambda each: each[0]):
            if level in self._names:
                ends.setdefault(level, LinkEnd(self._names[level], point))
        if len(ends) < 2:  # noqa: PLR2004
            return None
        numbered = (f"{name or kind} {number}" for number in itertools.count(1))
        own = free_name(itertools.chain([name] if name else [], numbered), self._taken)
        check_link_count(len(self._taken), self._where)
        given = {key: number_of(tags.get(f"hybridnav:{key}")) for key in _FACTS}
        figures = {key: value for key, value in given.items() if value > 0}
        return Link(name=own, kind=kind, ends=tuple(ends.values()), one_way=one_way, **figures)


# The graph of rooms and doors that have no ways between them.

_MOST_DOORS = 60
"""Doors of one area that are joined with each other; 1,770 pairs."""
_MOST_PAIRS = 100_000
"""Pairs of doors of all areas that are tried."""


def add_area_graph(
    gathered: Gathered,
    areas: Sequence[osm.OsmWay],
    passages: Sequence[osm.OsmWay],
    tags: Mapping[int, osm.Tags],
    points: Mapping[int, Point | None],
) -> None:
    """Add a node in each area, one in each passage or door, and edges between them.

    An area is joined with its passages, in both directions, and two of its passages with each other
    where the segment between them stays inside it. A passage (osmAG) belongs to the two areas that
    it names, by their ids or names; a door, a node, to those whose outline it is part
    of.

    `gathered`: what they are added to; ids are `way ID` and `node ID`; `areas`: closed ways;
    `passages`: ways of two nodes; `tags`: tags of nodes; `points`: points of nodes in metres; None
    for none.
    """
    shapes = {way.id: shape for way in areas if (shape := _shape(way, points)) is not None}
    inside: dict[int, list[tuple[str, Point]]] = {area: [] for area in shapes}
    by_name: dict[str, int] = {}
    for way in areas:
        if way.id in shapes:
            place = shapes[way.id].representative_point()
            gathered.add_node(f"way {way.id}", (place.x, place.y), way.tags)
            by_name.setdefault(way.tags.get("name", ""), way.id)
    for way in passages:
        sides = [_area(way.tags.get(key), shapes, by_name) for key in ("osmAG:from", "osmAG:to")]
        if sides[0] == sides[1]:
            continue
        middle = _middle([points.get(node) for node in way.refs[:2]])
        gathered.add_node(f"way {way.id}", middle, way.tags)
        for side in sides:
            if side is not None and middle is not None:
                inside[side].append((f"way {way.id}", middle))
    _add_doors(gathered, areas, inside, tags, points)
    _join(gathered, shapes, inside)


def _join(
    gathered: Gathered,
    shapes: Mapping[int, BaseGeometry],
    inside: Mapping[int, list[tuple[str, Point]]],
) -> None:
    """Add edges between each area and its doors, and between those that see each other."""
    left = _MOST_PAIRS
    for area, doors in inside.items():
        for door, _ in doors:
            gathered.add_link((f"way {area}", door), {}, directed=False)
        pairs = list(itertools.islice(itertools.combinations(doors[:_MOST_DOORS], 2), left))
        left -= len(pairs)
        shapely.prepare(shapes[area])
        for (one, at), (other, there) in pairs:
            if at != there and shapes[area].covers(shapely.LineString([at, there])):
                gathered.add_link((one, other), {}, directed=False)


def _shape(ring: osm.OsmWay, points: Mapping[int, Point | None]) -> BaseGeometry | None:
    """Return the area inside a way; None for what contains others, and without points."""
    corners = [point for node in ring.refs[:-1] if (point := points.get(node)) is not None]
    is_whole = len(corners) == len(ring.refs) - 1
    if not is_whole or ring.tags.get("osmAG:areaType") == "structure":
        return None
    return shapely.make_valid(shapely.Polygon(corners))


def _middle(ends: list[Point | None]) -> Point | None:
    there = [end for end in ends if end is not None]
    if not there:
        return None
    return sum(x for x, _ in there) / len(there), sum(y for _, y in there) / len(there)


def _add_doors(
    gathered: Gathered,
    areas: Sequence[osm.OsmWay],
    inside: dict[int, list[tuple[str, Point]]],
    tags: Mapping[int, osm.Tags],
    points: Mapping[int, Point | None],
) -> None:
    added: set[int] = set()
    for way in areas:
        for node in dict.fromkeys(way.refs) if way.id in inside else ():
            point = points.get(node)
            if point is None or not osm.is_door(tags.get(node, {})):
                continue
            if node not in added:
                gathered.add_node(f"node {node}", point, tags[node])
                added.add(node)
            inside[way.id].append((f"node {node}", point))


def _area(value: str | None, areas: Mapping[int, object], by_name: Mapping[str, int]) -> int | None:
    """Return the area that a passage names, by its id or by its name."""
    number = number_of(value)
    if number in areas:
        return int(number)
    return by_name.get(value) if value else None
