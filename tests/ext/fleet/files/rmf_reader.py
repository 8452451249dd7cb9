"""A navigation graph of Open-RMF as its fleet adapter takes it.

Written after `parse_graph` of open-rmf/rmf_ros2 (rmf_fleet_adapter/src/rmf_fleet_adapter/agv), with
its errors, and shares no code with hybridnav.
"""

import itertools
import math
from dataclasses import dataclass, field
from typing import Any

import yaml


class RefusedError(Exception):
    """What the fleet adapter would throw."""


@dataclass
class Adapter:
    """What the fleet adapter knows after it has read a file."""

    waypoints: list[tuple[str, float, float]] = field(default_factory=list)
    """Map, x, y."""
    keys: dict[str, int] = field(default_factory=dict)
    lift_of: dict[int, str] = field(default_factory=dict)
    lanes: list[tuple[int, int, str]] = field(default_factory=list)
    """Begin, end, and the event on entry."""
    lifts: dict[str, Any] = field(default_factory=dict)
    doors: dict[str, Any] = field(default_factory=dict)
    speeds: dict[int, float] = field(default_factory=dict)
    """Speed limit of lanes by index."""
    flags: dict[int, set[str]] = field(default_factory=dict)


def _number(text: Any) -> float:
    try:
        return float(text)
    except (TypeError, ValueError) as error:
        raise RefusedError(f"bad conversion: {text!r}") from error


def _index(text: Any) -> int:
    if not isinstance(text, str) or not text.isdigit():
        raise RefusedError(f"bad conversion: {text!r}")
    return int(text)


def read_rmf(path) -> Adapter:
    """Read a file; yaml-cpp converts texts where they are used, as the base loader leaves them."""
    data = yaml.load(path.read_text(encoding="utf-8"), yaml.BaseLoader)  # noqa: S506 - texts
    found = Adapter()
    for name, facts in data["lifts"].items():
        x, y, yaw = map(_number, facts["position"])
        found.lifts[name] = (x, y, yaw, *map(_number, facts["dims"]))
    for name, facts in data["doors"].items():
        found.doors[name] = [tuple(map(_number, end)) for end in facts["endpoints"]], facts["map"]
    if not isinstance(data.get("levels"), dict):
        raise RefusedError("the [levels] key")
    offset = 0
    for level, content in data["levels"].items():
        for x, y, options in content["vertices"]:
            _add_waypoint(found, level, (_number(x), _number(y)), options)
        for begin, end, options in content["lanes"]:
            _add_lane(found, _index(begin) + offset, _index(end) + offset, options)
        offset = len(found.waypoints)
    _join_lifts(found)
    return found


def _add_waypoint(found, level, point, options):
    at = len(found.waypoints)
    found.waypoints.append((level, *point))
    if options.get("name"):
        if options["name"] in found.keys:
            raise RefusedError(f"duplicated waypoint name {options['name']}")
        found.keys[options["name"]] = at
    found.flags[at] = {key for key, value in options.items() if value == "true"}
    if options.get("lift"):
        if options["lift"] not in found.lifts:
            raise RefusedError("lift properties were not provided")
        found.lift_of[at] = options["lift"]


def _add_lane(found, begin, end, options):
    if max(begin, end) >= len(found.waypoints):
        raise RefusedError("no such waypoint")
    if options.get("orientation_constraint") not in {None, "forward", "backward"}:
        raise RefusedError("unrecognized orientation constraint")
    one, other = found.lift_of.get(begin), found.lift_of.get(end)
    if one is not None and other is not None and one != other:
        raise RefusedError("connected waypoints in different lifts")
    event = ""
    if one is None and other is not None:
        event = f"session {other}"
    elif one is not None and other is None:
        event = f"leave {one}"
    elif one is None and "door_name" in options:
        event = f"door {options['door_name']}"
    if "speed_limit" in options:
        found.speeds[len(found.lanes)] = _number(options["speed_limit"])
    found.lanes.append((begin, end, event))


def _join_lifts(found):
    for lift in set(found.lift_of.values()):
        inside = [at for at, name in sorted(found.lift_of.items()) if name == lift]
        for low, high in itertools.pairwise(inside):
            found.lanes.append((low, high, f"move {lift} {found.waypoints[high][0]}"))
            found.lanes.append((high, low, f"move {lift} {found.waypoints[low][0]}"))
        places = [found.waypoints[at][1:] for at in inside]
        if max(math.dist(a, b) for a in places for b in places) > 0.1:
            raise RefusedError(f"bad vertical alignment for the waypoints in lift {lift}")
