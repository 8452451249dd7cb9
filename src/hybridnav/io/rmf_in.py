"""Reader of Open-RMF's navigation graphs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hybridnav.building import DoorLine
from hybridnav.errors import MapError
from hybridnav.graphs.gather import pair_of, shown
from hybridnav.io.rmf_floors import (
    MOST_FLOORS,
    Name,
    Point,
    RmfFloor,
    RmfLift,
    building_of,
    lane_ends,
    list_of,
    mapping_of,
    options_of,
    points_of,
)

if TYPE_CHECKING:
    from hybridnav.building import BuildingGraph


def is_rmf(data: Any) -> bool:
    """Return whether parsed YAML is a file of Open-RMF: a mapping with levels."""
    return isinstance(data, dict) and isinstance(data.get("levels"), dict)


def read_rmf(data: dict[str, Any], where: str, name: str) -> BuildingGraph:
    """Read a navigation graph, by the rules of `parse_graph` (open-rmf/rmf_ros2).

    Parameters
    ----------
    data
        The file as parsed.
    where
        What messages begin with.
    name
        Name of a building that has none.

    Returns
    -------
    BuildingGraph
        One floor for each level with vertices, in the order of the file, all in one frame. Vertices
        have their names as ids, or their numbers. A lift ends at its first vertex of each level;
        the file states no times.

    Raises
    ------
    MapError
        When it is not of this form.
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
        known = mapping_of(facts, at, "the door")
        on = by_name.get(str(known.get("map")))
        if on is None:
            raise MapError(f"{at}: it is on level {known.get('map')!r:.60}, which is not there")
        on.doors.append(DoorLine(door, points_of(known.get("endpoints"), at)))
    return building_of(floors, lifts, str(data.get("building_name") or name), where)


def _filled(
    floor: RmfFloor, content: dict[str, Any], taken: set[Name], where: str
) -> list[tuple[str, Point]]:
    """Add vertices and lanes; return the lifts of vertices, with their points."""
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
