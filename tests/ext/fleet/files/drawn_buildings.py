"""Random buildings of graphs: floors, names, facts, doors and links, in frames of their own."""

from typing import Any

import networkx as nx
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.fleet import BuildingGraph, DoorLine, FloorGraph, Link, LinkEnd

NAMES = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=8)
COORDINATES = st.integers(-500_000, 500_000).map(lambda value: value / 1000)
POINTS = st.tuples(COORDINATES, COORDINATES)


@st.composite
def floors(draw, name, number):
    plain: nx.DiGraph[Any] = nx.DiGraph()
    points = draw(st.lists(POINTS, min_size=1, max_size=6, unique=True))
    for node, (x, y) in enumerate(points):
        facts = {"name": draw(NAMES)} if draw(st.booleans()) else {}
        if draw(st.booleans()):
            facts["is_charger"] = True
        plain.add_node(node, x=x, y=y, **facts)
    doors = draw(st.lists(st.tuples(POINTS, POINTS), max_size=2))
    lines = tuple(DoorLine(f"{number}/{at}", ends) for at, ends in enumerate(doors))
    pairs = st.tuples(*[st.integers(0, len(points) - 1)] * 2)
    for tail, head in draw(st.lists(pairs, max_size=8, unique=True)):
        facts = {"speed_limit": 0.5} if draw(st.booleans()) else {}
        if lines and draw(st.booleans()):
            facts["door_name"] = lines[0].name
        plain.add_edge(tail, head, **facts)
    graph = hn.graphs.WaypointGraph.from_networkx(plain)
    return FloorGraph(name=name, graph=graph, doors=lines, elevation_m=3.5 * number)


@st.composite
def buildings(draw, *, kinds=("lift", "stairs", "ramp"), aligned=False):
    """One to four floors, and links between points that are nodes or none."""
    names = draw(st.lists(NAMES, min_size=1, max_size=4, unique=True))
    drawn = [draw(floors(name, number)) for number, name in enumerate(names)]
    links = []
    wanted = draw(st.lists(NAMES, max_size=3, unique=True)) if len(names) > 1 else []
    for name in wanted:
        kind = draw(st.sampled_from(kinds))
        stops = draw(st.sets(st.sampled_from(names), min_size=2))
        at = draw(POINTS)
        ends = [
            LinkEnd(floor, at if aligned else draw(POINTS)) for floor in names if floor in stops
        ]
        radius = draw(st.sampled_from([0.5, 1.25, float("inf")]))
        times = {key: draw(st.integers(0, 60)) / 2 for key in ("wait_s", "ride_s", "cost_m")}
        way = draw(st.sampled_from([None, None, "up", "down"]))
        facts = times | {"max_radius_m": radius, "one_way": way}
        links.append(Link(name=name, kind=kind, ends=tuple(ends), **facts))
    return BuildingGraph(name=draw(NAMES), floors=tuple(drawn), links=tuple(links))
