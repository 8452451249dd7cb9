"""Writer of Open-RMF's navigation graphs: YAML of levels, lanes, doors and lifts."""

import itertools
import math
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Any

from hybridnav._base.files import NewFile
from hybridnav._base.trig import dist
from hybridnav._base.typing import PathLike
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet import BuildingGraph, FloorGraph, Link, LinkEnd, join_links
from hybridnav.ext.fleet.link_nodes import nodes_of_link
from hybridnav.graphs.gather import free_name, number_of, quoted
from hybridnav.maps.checks import checked_type

ALIGNED_M = 0.1
"""Most metres between the ends of a lift on two floors: Open-RMF refuses more."""
MOVED_M = 0.5
"""Most metres between them up to which the lift's vertices lie at the mean of its ends."""
_FLAGS = ("is_charger", "is_holding_point", "is_parking_spot", "is_passthrough_point")
"""Facts of nodes that Open-RMF reads as true or false."""
_CABIN_M = 2.0
_DECIMALS = 6


def export_rmf(
    building: BuildingGraph,
    path: PathLike,
    *,
    doors: bool = True,
    cabin_m: tuple[float, float] = (_CABIN_M, _CABIN_M),
) -> tuple[str, ...]:
    """Write a navigation graph as Open-RMF's fleet adapters read it.

    The file is that of `generate_nav_graphs` (open-rmf/rmf_traffic_editor,
    `rmf_building_map_tools/building_map/building.py`), and keeps the rules of `parse_graph`
    (open-rmf/rmf_ros2, `rmf_fleet_adapter/src/rmf_fleet_adapter/agv/parse_graph.cpp`). All levels
    lie in one frame in metres, and each edge is a lane in one direction. Names of vertices are
    unique in the file, and the vertices of a lift lie above each other.

    Parameters
    ----------
    building
        The floors and links. Nodes have `name` from their facts, and flags such as `is_charger`;
        names that occur twice get that of the floor in front. Nodes and edges have `id`, which
        Open-RMF skips, where the graph has whole numbers. Ends of lifts without a node are
        joined as `join_links` does it.
    path
        The file, ending in .yaml or .yml; one that exists is replaced.
    doors
        Whether lanes name the doors that they pass. A fleet adapter asks such a door to open and
        waits for it: leave them out where no adapter drives the doors.
    cabin_m
        Width and depth in metres of the cabins of lifts whose `max_radius_m` is infinite; others
        are as wide and deep as the largest robot that fits in.

    Returns
    -------
    tuple of str
        Facts for which Open-RMF has no place, and lifts whose ends lie 0.1 to 0.5 m apart, as on
        maps of scans, one line each. The vertices of such a lift lie at the mean of the ends, and a
        lane joins them to the nearest node.

    Raises
    ------
    InvalidValueError
        When a lift has ends that lie more than 0.5 m apart: `building.align_floors` brings floors
        into one frame. When this is no building graph, a side of a cabin is not positive and
        finite, two lifts end at one node, or no floor has an edge.
    MapError
        When the name ends otherwise, or the file cannot be written.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, building_graph, export_rmf
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = Building([Floor("0", hn.HybridPlanner(topology))])
    >>> export_rmf(building_graph(house), "house.yaml")
    ()
    """
    checked_type("building", building, BuildingGraph)
    kind = "a navigation graph of Open-RMF"
    file = NewFile.named(path, "navigation graph", kind, (".yaml", ".yml"))
    if not all(0 < side < math.inf for side in cabin_m):
        raise InvalidValueError(f"cabin_m is {cabin_m}, expected two positive numbers of metres")
    if not any(floor.graph.n_edges for floor in building.floors):
        raise InvalidValueError(
            f"building {building.name!r:.60} has no edge, expected lanes: build its graphs by "
            "build_lane_graph, with a smaller spacing_m (--spacing)"
        )
    links = tuple(_aligned(link) for link in building.links)
    moved = [
        f"lift {link.name}: its own ends, {_apart(link)[0]:.2f} m apart: vertices lie at their mean"
        for link, kept in zip(building.links, links, strict=True)
        if kept is not link
    ]
    building = replace(building, links=links)
    lines = _Writer(building, cabin_m, doors=doors).lines()
    file.write("".join(f"{line}\n" for line in lines).encode())
    return (*moved, *_left_out(building, doors=doors))


class _Writer:
    """The lines of a file."""

    def __init__(
        self, building: BuildingGraph, cabin_m: tuple[float, float], *, doors: bool
    ) -> None:
        self._building = join_links(building)
        self._lifts = [link for link in building.links if link.kind == "lift"]
        self._cabin_m = cabin_m
        self._doors = {
            door.name
            for floor in building.floors
            for door in floor.doors
            if doors and not door.is_opening
        }
        self._lift_at: dict[tuple[str, int], str] = {}
        for link in self._lifts:
            for floor, node in nodes_of_link(self._building, link):
                other = self._lift_at.setdefault((floor.name, node), link.name)
                if other != link.name:
                    raise InvalidValueError(
                        f"the lifts {other!r:.60} and {link.name!r:.60} end at one node of floor "
                        f"{floor.name!r:.60}, expected a node for each"
                    )
        self._name_at = _unique_names(self._building.floors)

    def lines(self) -> Iterator[str]:
        """Yield all lines: one vertex, lane, door or lift each, so that people can compare."""
        yield f"building_name: {quoted(self._building.name)}"
        yield from self._door_lines()
        yield "levels:"
        for floor in self._building.floors:
            yield f"  {quoted(floor.name)}:"
            yield from _listed("    lanes:", self._lanes(floor))
            yield from _listed("    vertices:", self._vertices(floor))
        yield from self._lift_lines()

    def _vertices(self, floor: FloorGraph) -> Iterator[str]:
        for node, (x, y) in enumerate(floor.graph.points.tolist()):
            facts = floor.graph.node_facts.get(node, {})
            options = {"name": quoted(self._name_at.get((floor.name, node), ""))}
            options |= _id_option(floor.graph.ids[0][node])
            options |= {flag: "true" for flag in _FLAGS if facts.get(flag) is True}
            if isinstance(facts.get("dock_name"), str):
                options["dock_name"] = quoted(facts["dock_name"])
            lift = self._lift_at.get((floor.name, node))
            if lift is not None:
                options["lift"] = quoted(lift)
            yield f"[{_number(x)}, {_number(y)}, {_mapping(options)}]"

    def _lanes(self, floor: FloorGraph) -> Iterator[str]:
        for edge, (tail, head) in enumerate(floor.graph.edges.tolist()):
            facts = floor.graph.edge_facts.get(edge, {})
            options = _id_option(floor.graph.ids[1][edge])
            if facts.get("door_name") in self._doors:
                options["door_name"] = quoted(facts["door_name"])
            for key in ("dock_name", "undock_name", "orientation_constraint"):
                if isinstance(facts.get(key), str) and facts[key]:
                    options[key] = quoted(facts[key])
            speed = speed_limit_of(facts)
            if speed is not None:
                options["speed_limit"] = _number(speed)
            yield f"[{tail}, {head}, {_mapping(options)}]"

    def _door_lines(self) -> Iterator[str]:
        doors = [
            (floor.name, door)
            for floor in self._building.floors
            for door in floor.doors
            if door.name in self._doors
        ]
        yield "doors:" if doors else "doors: {}"
        for floor, door in doors:
            ends = ", ".join(f"[{_number(x)}, {_number(y)}]" for x, y in door.ends)
            yield f"  {quoted(door.name)}: {{endpoints: [{ends}], map: {quoted(floor)}}}"

    def _lift_lines(self) -> Iterator[str]:
        yield "lifts:" if self._lifts else "lifts: {}"
        for link in self._lifts:
            x, y = (_number(_mean(values)) for values in zip(*_positions(link), strict=True))
            sides = self._cabin_m
            if math.isfinite(link.max_radius_m):
                sides = 2 * link.max_radius_m, 2 * link.max_radius_m
            dims = ", ".join(map(_number, sides))
            yield f"  {quoted(link.name)}: {{position: [{x}, {y}, 0.0], dims: [{dims}]}}"


def _id_option(own_id: Any) -> dict[str, str]:
    """Return the id of a vertex or lane, which Open-RMF does not read and updates keep."""
    return {"id": str(own_id)} if type(own_id) is int else {}


def speed_limit_of(facts: dict[str, Any]) -> float | None:
    """Return the speed limit of an edge in m/s, None for none."""
    value = number_of(facts.get("speed_limit"))
    return value if value > 0 else None


def _number(value: float) -> str:
    """Return a number as YAML 1.1 reads it, without an exponent."""
    return f"{value + 0.0:.{_DECIMALS}f}"


def _mean(values: Iterable[float]) -> float:
    numbers = list(values)
    return math.fsum(numbers) / len(numbers)


def _mapping(options: dict[str, str]) -> str:
    return "{" + ", ".join(f"{key}: {value}" for key, value in options.items()) + "}"


def _listed(head: str, entries: Iterable[str]) -> Iterator[str]:
    first = next(iter(entries := iter(entries)), None)
    yield head if first is not None else f"{head} []"
    for entry in itertools.chain([] if first is None else [first], entries):
        yield f"    - {entry}"


def _unique_names(floors: Iterable[FloorGraph]) -> dict[tuple[str, int], str]:
    wanted = [
        ((floor.name, node), facts["name"])
        for floor in floors
        for node, facts in sorted(floor.graph.node_facts.items())
        if isinstance(facts.get("name"), str) and facts["name"]
    ]
    counts = Counter(name for _, name in wanted)
    once = {name for name, count in counts.items() if count == 1}
    taken, unique = set(once), {}
    for key, name in wanted:
        if name in once:
            unique[key] = name
            continue
        numbered = (f"{key[0]} {name} ({number})" for number in itertools.count(2))
        unique[key] = free_name(itertools.chain([f"{key[0]} {name}"], numbered), taken)
    return unique


def _positions(link: Link) -> list[tuple[float, float]]:
    return [end.position_m for end in link.ends]


def _apart(link: Link) -> tuple[float, LinkEnd, LinkEnd]:
    """Return the two ends of a link that lie farthest apart, and their distance in metres."""
    pairs = itertools.combinations(link.ends, 2)
    return max(
        ((dist(a.position_m, b.position_m), a, b) for a, b in pairs), key=lambda each: each[0]
    )


def _aligned(link: Link) -> Link:
    """Return a link; a lift with its ends at their mean if Open-RMF would refuse it otherwise."""
    far, one, other = _apart(link)
    if link.kind != "lift" or far <= ALIGNED_M:
        return link
    if far > MOVED_M:
        raise InvalidValueError(
            f"lift {link.name!r:.60}: its ends on the floors {one.floor!r:.40} and "
            f"{other.floor!r:.40} lie {far:.2f} m apart, and Open-RMF allows {ALIGNED_M} m, with "
            f"all floors in one frame: move floors by align_floors, or ends to {MOVED_M} m at most"
        )
    x, y = (_mean(values) for values in zip(*_positions(link), strict=True))
    return replace(link, ends=tuple(replace(end, position_m=(x, y)) for end in link.ends))


def _left_out(building: BuildingGraph, *, doors: bool) -> Iterator[str]:
    """Yield what the file does not hold."""
    for link in building.links:
        if link.kind != "lift":
            yield f"{link.kind} {link.name}: Open-RMF knows lifts only"
            continue
        if link.wait_s or link.ride_s or link.cost_m:
            yield f"lift {link.name}: its waiting time, ride time and cost"
        if link.one_way:
            yield f"lift {link.label}: its direction, Open-RMF takes lifts both ways"
    if not doors and any(not door.is_opening for f in building.floors for door in f.doors):
        yield "doors: as asked"
    bent = sum(len(floor.graph.lines) for floor in building.floors)
    if bent:
        yield f"lines of {bent} edges: lanes are straight"
