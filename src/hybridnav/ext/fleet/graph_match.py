"""The graph of a building that others have made, matched to its maps; faults and routes found."""

import itertools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from hybridnav._base.copies import frozen
from hybridnav._base.trig import dist
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet.align import Pose, moved_floor, moved_point, placed_pose
from hybridnav.ext.fleet.building import Building
from hybridnav.ext.fleet.floors import Floor
from hybridnav.ext.fleet.link_nodes import BuildingGraph, FloorGraph, Point, join_links
from hybridnav.ext.fleet.links import Link
from hybridnav.graphs import Excess, Finding, GraphCheck
from hybridnav.graphs.attach import placed_points
from hybridnav.maps.checks import checked_type

AT_LINK_M = 1.0
"""Distance in metres up to which the end of a graph's link is taken for that of the building's."""
_SNAPPED = 1e-3
"""Cells, up to which a node is taken to lie at a corner or the centre of a cell."""


@dataclass(frozen=True)
class MatchedLink:
    """A link of a graph, and the one of the building that it stands for.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Link, LinkEnd, MatchedLink
    >>> lift = Link(name="lift", kind="lift", ends=(LinkEnd("1", (0, 0)), LinkEnd("2", (0, 0))))
    >>> MatchedLink(lift, None, {"1": "L1"}, {"1": (0.5, 0.0)}).own is None
    True
    """

    drawn: Link
    """The link of the graph, as it was read."""
    own: Link | None
    """The link of the building; None if it has none."""
    floors: dict[str, str]
    """The graph's name of each floor at which it stops, by the building's."""
    ends: dict[str, Point]
    """Where it stops on each of them, `(x, y)` in metres in the frame of the map."""


def rides_of(link: MatchedLink) -> Iterator[tuple[str, str, bool]]:
    """Yield from which floor to which a link of a graph leads, and whether the building's may."""
    for one, other in itertools.permutations(link.ends, 2):
        if link.drawn.leads(link.floors[one], link.floors[other]):
            yield one, other, link.own is None or link.own.leads(one, other)


@dataclass(frozen=True, eq=False)
class MatchedGraph:
    """The graph of a building on the maps of its floors. Made by `match_graph`.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, building_graph, match_graph
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = Building([Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")])
    >>> matched = match_graph(house, building_graph(house))
    >>> list(matched.floors), matched.unknown_floors
    (['1', '2'], ())
    """

    building: Building
    name: str
    floors: dict[str, FloorGraph]
    """The graph of each floor by its name in the building, in the frame of its map, with a node at
    each end of a link."""
    links: tuple[MatchedLink, ...]
    unknown_floors: tuple[str, ...]
    """Names of the floors of the graph that the building does not have."""

    @property
    def away_m(self) -> float:
        """Greatest distance between the end of a link and that of the building's, in metres; 0
        where none is known."""
        away = [
            dist(link.ends[end.floor], end.position_m)
            for link in self.links
            if link.own is not None
            for end in link.own.ends
            if end.floor in link.ends
        ]
        return max(away, default=0.0)


@dataclass(frozen=True, eq=False)
class BuildingGraphCheck:
    """The graph of a building on its maps, and its faults. Made by `check_building_graph`.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, building_graph
    >>> from hybridnav.ext.fleet import check_building_graph, match_graph
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = Building([Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")])
    >>> graph = building_graph(house)
    >>> check = check_building_graph(match_graph(house, graph))
    >>> [found.kind for found in check.findings], list(check.floors)  # no link joins the floors
    (['island'], ['1', '2'])
    """

    matched: MatchedGraph
    floors: dict[str, GraphCheck]
    """The faults on each floor, by its name."""
    findings: tuple[Finding, ...]
    """Faults of floors, links, and the graph as a whole; empty for none."""

    @property
    def count(self) -> int:
        """Number of all cases of all findings."""
        own = sum(finding.count for finding in self.findings)
        return own + sum(check.count for check in self.floors.values())


Answer = Literal["solved", "contradicted", "no path, right", "no path, wrong", "no node in sight"]


@dataclass(frozen=True)
class RouteCounts:
    """Routes between some pairs of points, beside the optimum of the building.

    Examples
    --------
    >>> from hybridnav.ext.fleet import RouteCounts
    >>> counts = RouteCounts({"solved": 3, "no path, wrong": 1}, None, 4.0, 20.0, (1e-4, 1e-3))
    >>> counts.pairs, counts.inconsistent
    (4, 1)
    """

    answers: dict[Answer, int]
    """Number of pairs by the answer of the graph."""
    loss: Excess | None
    """Cost of the solved routes over the optimum, less 1; None if none is solved."""
    steps: float
    """Mean number of straight lines and rides of the solved routes."""
    expanded: float
    """Mean number of nodes that the searches of the solved routes have expanded."""
    seconds: tuple[float, float]
    """Median of the wall-clock seconds for a route on the graph, and for one by the building."""

    @property
    def pairs(self) -> int:
        """Number of pairs."""
        return sum(self.answers.values())

    @property
    def inconsistent(self) -> int:
        """Number of pairs whose answer the building contradicts."""
        return self.answers.get("contradicted", 0) + self.answers.get("no path, wrong", 0)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        loss = None if self.loss is None else vars(self.loss) | {}
        return {
            "pairs": self.pairs,
            "answers": dict(self.answers),
            "loss": loss,
            "steps": self.steps,
            "expanded": self.expanded,
            "seconds": {"graph": self.seconds[0], "building": self.seconds[1]},
        }


@dataclass(frozen=True, eq=False)
class BuildingGraphReport:
    """Consistency, loss and efficiency of the routes on the graph of a building. Made by
    `judge_building_graph`.

    Examples
    --------
    >>> from hybridnav.ext.fleet import BuildingGraphReport, RouteCounts
    >>> counts = RouteCounts({"solved": 3}, None, 4.0, 20.0, (1e-4, 1e-3))
    >>> BuildingGraphReport({"one floor": counts}, ()).counts["one floor"].inconsistent
    0
    """

    counts: dict[str, RouteCounts]
    """The figures of the pairs on `one floor`, on `two floors`, and of `all`; kinds without pairs
    are left out."""
    contradictions: tuple[str, ...]
    """The first 100 pairs whose answer the building contradicts, and why, one line each."""


def match_graph(
    building: Building,
    graph: BuildingGraph,
    *,
    floors: Mapping[str, str] | None = None,
    align: bool = False,
) -> MatchedGraph:
    """Match the graph of a building to its floors and links.

    Floors are matched by their names. So are links. A link with another name is taken for one of
    the same kind if the ends of both lie within 1 m on two floors or more.

    Parameters
    ----------
    building
        The building.
    graph
        The graph, as `load_building_graph` reads it.
    floors
        The building's name of floors that the graph calls otherwise, by the graph's name.
    align
        Whether the frame of each floor of the graph is another one than that of its map. The floor
        is then moved so that the ends of links lie at those of the building's links of the same
        names. One link shifts it; several turn it too, by the rigid motion with the least sum of
        squared distances. Links that are drawn in another place than the others, and the walls,
        suggest are not followed. Floors at which no such link stops stay as they are.

    Raises
    ------
    InvalidValueError
        When no floor has a counterpart, a name in `floors` is not known, two floors have one
        counterpart, or `align` has no link to go by.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, building_graph, match_graph
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = Building([Floor("ground", hn.HybridPlanner(topology))])
    >>> drawn = building_graph(Building([Floor("L1", house.floors[0].planner)]))
    >>> list(match_graph(house, drawn, floors={"L1": "ground"}).floors)
    ['ground']
    """
    checked_type("building", building, Building)
    joined = join_links(checked_type("graph", graph, BuildingGraph))
    own_name = _matched_floors(building, joined, floors or {})
    poses = dict.fromkeys(own_name, (0.0, 0.0, 0.0))
    if align:
        # Without the nodes of `joined`: a link drawn elsewhere says nothing about the walls.
        poses |= _poses(building, graph, own_name)
    by_own = {own: name for name, own in own_name.items()}
    return MatchedGraph(
        building=building,
        name=graph.name,
        floors={
            floor.name: _placed(joined.floor(by_own[floor.name]), poses[by_own[floor.name]], floor)
            for floor in building.floors
            if floor.name in by_own
        },
        links=_matched_links(building, joined, own_name, poses),
        unknown_floors=tuple(f.name for f in joined.floors if f.name not in own_name),
    )


def _placed(graph: FloorGraph, pose: Pose, floor: Floor) -> FloorGraph:
    """Return the graph of a floor in the frame of its map.

    Files round: nodes at a corner or the centre of a cell are put there again, or those at a wall
    would lie in it by a micrometre. None is put from a free cell into a blocked one.
    """
    moved = moved_floor(graph, pose)
    grid = floor.planner.grid
    free, points = grid.enterable(allow_unexplored=False), moved.graph.points
    positions = grid.frame.positions_of(points)
    halves = np.round(2.0 * positions) / 2.0
    put = grid.frame.points_of_grid(halves)
    is_near = (np.abs(positions - halves) <= _SNAPPED).all(axis=1) & (halves.sum(axis=1) % 1 == 0)
    is_near &= placed_points(put, grid, free)[2] | ~placed_points(points, grid, free)[2]
    points = np.where(is_near[:, None], put, points)
    return replace(moved, name=floor.name, graph=replace(moved.graph, points=frozen(points)))


def _matched_floors(
    building: Building, graph: BuildingGraph, given: Mapping[str, str]
) -> dict[str, str]:
    names = [floor.name for floor in building.floors]
    matched = {floor.name: floor.name for floor in graph.floors if floor.name in names}
    for name, own in given.items():
        matched[graph.floor(name).name] = building.floor(own).name
    if not matched:
        theirs = ", ".join(floor.name for floor in graph.floors)
        raise InvalidValueError(
            f"graph {graph.name!r:.60} has the floors {theirs[:200]} and the building has "
            f"{', '.join(names)[:200]}: give the building's name of each, such as "
            f"{{{graph.floors[0].name!r:.60}: {names[0]!r:.60}}}"
        )
    for own in names:
        twice = [name for name, other in matched.items() if other == own]
        if len(twice) > 1:
            raise InvalidValueError(
                f"floors {twice[0]!r:.60} and {twice[1]!r:.60} of the graph are both floor "
                f"{own!r:.60} of the building, expected one"
            )
    return matched


def _poses(building: Building, graph: BuildingGraph, own_name: dict[str, str]) -> dict[str, Pose]:
    own_links = {link.name: link for link in building.links}
    poses = {}
    for name, own in own_name.items():
        pairs = [
            (end.position_m, own_end.position_m)
            for link in graph.links
            if (end := link.end_on(name)) is not None
            and link.name in own_links
            and (own_end := own_links[link.name].end_on(own)) is not None
        ]
        if pairs:
            theirs, ours = (np.array(points) for points in zip(*pairs, strict=True))
            drawn, grid = graph.floor(name).graph, building.floor(own).planner.grid
            middles = drawn.points[drawn.edges].mean(axis=1)
            points = np.concatenate([drawn.points, middles])
            poses[name] = placed_pose(theirs, ours, points, grid)
    if not poses:
        names = ", ".join(link.name for link in graph.links) or "none"
        raise InvalidValueError(
            f"graph {graph.name!r:.60} has the links {names[:200]}, and none of the building's "
            "stops at the same floors: there is nothing to align by, move its floors by moved_floor"
        )
    return poses


def _matched_links(
    building: Building, graph: BuildingGraph, own_name: dict[str, str], poses: dict[str, Pose]
) -> tuple[MatchedLink, ...]:
    own_links = {link.name: link for link in building.links}
    taken = {link.name for link in graph.links}
    matched = []
    for link in graph.links:
        stops = [end for end in link.ends if end.floor in own_name]
        ends = {own_name[end.floor]: moved_point(end.position_m, poses[end.floor]) for end in stops}
        own = own_links.get(link.name)
        if own is None:
            free = [other for other in building.links if other.name not in taken]
            own = _nearest(link, ends, free)
        if own is not None:
            taken.add(own.name)
        matched.append(MatchedLink(link, own, {own_name[e.floor]: e.floor for e in stops}, ends))
    return tuple(matched)


def _nearest(drawn: Link, ends: dict[str, Point], links: list[Link]) -> Link | None:
    """Return the link of the same kind that stops at the same places; None if there is none."""
    best, least = None, AT_LINK_M
    for link in links:
        away = [dist(end.position_m, ends[end.floor]) for end in link.ends if end.floor in ends]
        if link.kind == drawn.kind and len(away) > 1 and max(away) <= least:
            best, least = link, max(away)
    return best
