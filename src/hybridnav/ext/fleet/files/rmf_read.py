"""Floors of Open-RMF's files while they are read: vertices by number, lanes, doors, lifts."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from hybridnav.errors import MapError
from hybridnav.ext.fleet import BuildingGraph, DoorLine, FloorGraph, Link, LinkEnd
from hybridnav.graphs import WaypointGraph
from hybridnav.graphs.gather import Gathered, pair_of, shown

MOST_FLOORS, MOST_LINKS = 1000, 1000
"""Most levels of a file, and most links between them."""

_MOST_DIGITS = 15

Point = tuple[float, float]
Name = int | str


@dataclass
class RmfFloor:
    """One level."""

    name: str
    where: str
    elevation_m: float | None = None
    doors: list[DoorLine] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Begin without vertices."""
        self.gathered = Gathered(f"{self.where}, level {shown(self.name)}")
        self.points: list[Point | None] = []
        self._ids: list[Name] = []

    def add_vertex(
        self, name: str, point: Point | None, facts: Mapping[str, Any], taken: set[Name]
    ) -> None:
        """Add the next vertex, by its name, or by its number if it has none or one that is taken,
        which Open-RMF refuses.

        `name`: its name; empty for none; `point`: `(x, y)` in metres; None if there is none;
        `facts`: all else; `taken`: names of all floors so far.
        """
        is_new = bool(name) and name not in taken
        if name and not is_new:
            where = f"vertex {shown(name)} of level {shown(self.name)}"
            self.gathered.findings.add("repeated-id", where, *([point] if point else []))
        number: Name = name if is_new else len(self._ids)
        taken.add(number if is_new else "")
        self._ids.append(number)
        self.points.append(point)
        self.gathered.add_node(number, point, dict(facts) | ({"name": name} if name else {}))

    def add_lane(self, vertices: tuple[int, int], facts: Mapping[str, Any]) -> None:
        """Add an edge between two vertices by their numbers."""
        tail, head = (self._ids[end] if 0 <= end < len(self._ids) else end for end in vertices)
        self.gathered.add_edge((tail, head), facts)

    @property
    def is_empty(self) -> bool:
        """Whether no vertex has a point."""
        return not any(self.points)

    def graph(self, name: str) -> FloorGraph:
        """Return the floor."""
        graph = WaypointGraph(**self.gathered.fields("rmf", name))
        return FloorGraph(
            name=self.name, graph=graph, elevation_m=self.elevation_m, doors=tuple(self.doors)
        )


@dataclass
class RmfLift:
    """One lift: its first vertex on each floor."""

    dims_m: tuple[float, float] | None = None
    ends: dict[str, Point] = field(default_factory=dict)


def building_of(
    floors: Iterable[RmfFloor], lifts: Mapping[str, RmfLift], name: str, where: str
) -> BuildingGraph:
    """Return what was read, without floors that have no vertices, and without lifts that stop at
    fewer than two of the rest, which are findings of the first floor.

    `floors`: floors, from the lowest to the highest where that is known; `lifts`: lifts by name;
    `name`: name of the building; `where`: what messages begin with. Raises `MapError` when no floor
    has a vertex.
    """
    kept = [floor for floor in floors if not floor.is_empty]
    if not kept:
        raise MapError(f"{where}: no level has a vertex, expected vertices [x, y, ...]")
    place = {floor.name: at for at, floor in enumerate(kept)}
    links = []
    for lift, rmf_lift in lifts.items():
        stops = sorted((place[floor], floor) for floor in rmf_lift.ends if floor in place)
        if len(stops) > 1:
            ends = tuple(LinkEnd(floor, rmf_lift.ends[floor]) for _, floor in stops)
            fits: dict[str, Any] = (
                {} if rmf_lift.dims_m is None else {"max_radius_m": min(rmf_lift.dims_m) / 2}
            )
            links.append(Link(name=lift, kind="lift", ends=ends, **fits))
        else:
            at = f"lift {shown(lift)}, vertices in its cabin on {len(stops)} levels"
            kept[0].gathered.findings.add("link-unread", at, *rmf_lift.ends.values())
    check_link_count(len(links), where)
    graphs = tuple(floor.graph(f"{name} {floor.name}") for floor in kept)
    return BuildingGraph(name=name, floors=graphs, links=tuple(links))


def check_link_count(count: int, where: str) -> None:
    """Refuse more lifts, stairs and ramps than any building has: they are matched one by one."""
    if count > MOST_LINKS:
        raise MapError(f"{where}: more than {MOST_LINKS} lifts, stairs and ramps are not read")


def id_fact(text: str) -> dict[str, int]:
    """Return a text of digits as the fact `id`, by which an update knows a node or edge again."""
    is_id = text.isascii() and text.isdigit() and len(text) <= _MOST_DIGITS
    return {"id": int(text)} if is_id else {}


def mapping_of(value: Any, where: str, what: str, most: int | None = None) -> dict[str, Any]:
    """Return a mapping with keys as texts; an empty one for none.

    Raises `MapError` when it is no mapping, or has more than `most` members.
    """
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise MapError(f"{where}: expected {what} as a mapping, got {value!r:.60}")
    if most is not None and len(value) > most:
        raise MapError(f"{where}: more than {most} {what} are not read")
    return {str(key): item for key, item in value.items()}


def list_of(value: Any, where: str, what: str) -> list[Any]:
    """Return a list; an empty one for none.

    Raises `MapError` when it is no list.
    """
    if value is None:
        return []
    if not isinstance(value, list):
        raise MapError(f"{where}: expected {what} as a list, got {value!r:.60}")
    return value


def lane_ends(entry: Any, where: str) -> tuple[int, int]:
    """Return the numbers of two vertices with which an entry begins.

    Raises `MapError` when it does not.
    """
    if isinstance(entry, list) and len(entry) >= 2:  # noqa: PLR2004
        tail, head = entry[:2]
        if type(tail) is int and type(head) is int:
            return tail, head
    raise MapError(f"{where}: expected [vertex, vertex, ...] with two numbers, got {entry!r:.60}")


def options_of(entry: list[Any], at: int, where: str) -> dict[str, Any]:
    """Return the options of an entry, the item at an index; an empty mapping if it has none."""
    return mapping_of(entry[at] if len(entry) > at else None, where, "options")


def points_of(value: Any, where: str) -> tuple[Point, Point]:
    """Return the two ends of a door.

    Raises `MapError` when these are not two points.
    """
    ends = [pair_of(end) for end in value] if isinstance(value, list) else []
    if len(ends) != 2 or None in ends:  # noqa: PLR2004
        raise MapError(f"{where}: expected endpoints [[x, y], [x, y]], got {value!r:.60}")
    first, second = (end for end in ends if end is not None)
    return first, second


# Reader of Open-RMF's navigation graphs.


def is_rmf(data: Any) -> bool:
    """Return whether parsed YAML is a file of Open-RMF: a mapping with levels."""
    return isinstance(data, dict) and isinstance(data.get("levels"), dict)


def read_rmf(data: dict[str, Any], where: str, name: str) -> BuildingGraph:
    """Read a navigation graph, by the rules of `parse_graph` (open-rmf/rmf_ros2).

    `data`: the file as parsed; `where`: what messages begin with; `name`: name of a building that
    has none. Returns one floor for each level with vertices, in the order of the file, all in one
    frame. Vertices have their names as ids, or their numbers. A lift ends at its first vertex of
    each level; the file states no times. Raises `MapError` when it is not of this form.
    """
    floors: list[RmfFloor] = []
    taken: set[Name] = set()
    lifts = {
        lift: RmfLift(_dims(facts, f"{where}, lift {shown(lift)}"))
        for lift, facts in mapping_of(data.get("lifts"), where, "lifts").items()
    }
    for level, content in mapping_of(data["levels"], where, "levels", MOST_FLOORS).items():
        floor = RmfFloor(level, where)
        at = f"{where}, level {shown(level)}"
        for lift, point in _filled(floor, mapping_of(content, at, "the level"), taken, at):
            lifts.setdefault(lift, RmfLift()).ends.setdefault(level, point)
        floors.append(floor)
    by_name = {floor.name: floor for floor in floors}
    for door, facts in mapping_of(data.get("doors"), where, "doors").items():
        at = f"{where}, door {shown(door)}"
        entry = mapping_of(facts, at, "the door")
        on = by_name.get(str(entry.get("map")))
        if on is None:
            raise MapError(f"{at}: it is on level {entry.get('map')!r:.60}, which is not there")
        on.doors.append(DoorLine(door, points_of(entry.get("endpoints"), at)))
    return building_of(floors, lifts, str(data.get("building_name") or name), where)


def _filled(
    floor: RmfFloor, content: dict[str, Any], taken: set[Name], where: str
) -> list[tuple[str, Point]]:
    lifts = []
    for number, entry in enumerate(list_of(content.get("vertices"), where, "vertices")):
        at = f"{where}, vertex {number}"
        options, point = options_of(list_of(entry, at, "[x, y, options]"), 2, at), pair_of(entry)
        name, lift = options.pop("name", None), options.get("lift")
        floor.add_vertex("" if name is None else str(name), point, options, taken)
        if isinstance(lift, str) and lift and point is not None:
            lifts.append((lift, point))
    for number, entry in enumerate(list_of(content.get("lanes"), where, "lanes")):
        at = f"{where}, lane {number}"
        floor.add_lane(lane_ends(entry, at), options_of(entry, 2, at))
    return lifts


def _dims(facts: Any, where: str) -> tuple[float, float] | None:
    """Return width and depth of a cabin in metres."""
    dims = pair_of(mapping_of(facts, where, "the lift").get("dims"))
    return dims if dims is not None and min(dims) > 0 else None
