"""The graph of rooms and doors that have no ways between them."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING

import shapely

from hybridnav.ext.graphs.gather import number_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from shapely.geometry.base import BaseGeometry

    from hybridnav.ext.graphs.files.osm_xml import OsmWay, Tags
    from hybridnav.ext.graphs.gather import Gathered

Point = tuple[float, float]
_MOST_DOORS = 60
"""Doors of one area that are joined with each other; 1,770 pairs."""
_MOST_PAIRS = 100_000
"""Pairs of doors of all areas that are tried."""


def add_area_graph(
    gathered: Gathered,
    areas: Sequence[OsmWay],
    passages: Sequence[OsmWay],
    tags: Mapping[int, Tags],
    points: Mapping[int, Point | None],
) -> None:
    """Add a node in each area, one in each passage or door, and edges between them.

    An area is joined with its passages, in both directions, and two of its passages with each other
    where the segment between them stays inside it. A passage (osmAG) belongs to the two areas that
    it names, by their ids or names; a door, a node with `door`, to those whose outline it is part
    of.

    Parameters
    ----------
    gathered
        What they are added to; ids are `way ID` and `node ID`.
    areas
        Closed ways.
    passages
        Ways of two nodes.
    tags
        Tags of nodes.
    points
        Points of nodes in metres; None for none.
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


def _shape(ring: OsmWay, points: Mapping[int, Point | None]) -> BaseGeometry | None:
    """Return the area inside a way; None for what contains others, and without points."""
    corners = [point for node in ring.refs[:-1] if (point := points.get(node)) is not None]
    is_whole = len(corners) == len(ring.refs) - 1
    if not is_whole or ring.tags.get("osmAG:areaType") == "structure":
        return None
    return shapely.make_valid(shapely.Polygon(corners))


def _middle(found: list[Point | None]) -> Point | None:
    """Return the middle of the points that are there, None without any."""
    known = [end for end in found if end is not None]
    if not known:
        return None
    return sum(x for x, _ in known) / len(known), sum(y for _, y in known) / len(known)


def _add_doors(
    gathered: Gathered,
    areas: Sequence[OsmWay],
    inside: dict[int, list[tuple[str, Point]]],
    tags: Mapping[int, Tags],
    points: Mapping[int, Point | None],
) -> None:
    """Add the nodes with `door` on outlines of areas."""
    added: set[int] = set()
    for way in areas:
        for node in dict.fromkeys(way.refs) if way.id in inside else ():
            point = points.get(node)
            if "door" not in tags.get(node, {}) or point is None:
                continue
            if node not in added:
                gathered.add_node(f"node {node}", point, tags[node])
                added.add(node)
            inside[way.id].append((f"node {node}", point))


def _area(
    value: str | None, shapes: Mapping[int, BaseGeometry], by_name: Mapping[str, int]
) -> int | None:
    number = number_of(value)
    if number in shapes:
        return int(number)
    return by_name.get(value) if value else None
