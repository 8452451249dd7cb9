"""All that Nav2 needs of a map in one folder: graph, masks, poses and parameters. Public:
`export_bundle`.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hybridnav._base.files import printable
from hybridnav._base.trig import atan2, cos, hypot, sin
from hybridnav._base.typing import AnyArray, FloatArray, PathLike
from hybridnav._base.yaml_file import read_yaml
from hybridnav.errors import InvalidValueError, MapError, brief
from hybridnav.graphs.files.nav2 import nav2_bytes, nav2_features
from hybridnav.graphs.gather import quoted
from hybridnav.graphs.waypoint_graph import RouteGraph
from hybridnav.maps import DEFAULT_MAX_CELLS, Frame, OccupancyGrid
from hybridnav.maps.checks import checked_type
from hybridnav.maps.costs.factors import mask_on_map
from hybridnav.maps.costs.files import CostSpec, parse_costs
from hybridnav.maps.files.ros import read_mask
from hybridnav.planning.speed import SpeedMap
from hybridnav.rooms import Door, Rooms
from hybridnav.topology import TopologicalMap

MOST_ROOMS = 100
"""Largest value that map_server's mode `raw` keeps; a larger one becomes unknown."""
_CLASSES = ("corridor", "door", "free", "hall", "room")
_MARGIN_M = 0.25
"""Clearance beyond the robot's radius below which an edge is narrow, in metres: what lanes keep."""
_GRAPH, _NAMES, _PARAMS = "graph.geojson", "room_names.yaml", "nav2_params.yaml"
_FILES = {_GRAPH, _NAMES, _PARAMS, "poses.yaml", "README.md"} | {
    f"{kind}_mask.{ending}" for kind in ("rooms", "keepout", "speed") for ending in ("pgm", "yaml")
}


@dataclass(frozen=True)
class _Mask:
    """A mask, and what Nav2's costmap filter info states about it."""

    kind: str
    values: NDArray[np.int8]
    """int8 (rows, cols), 0 to 100, -1 for unknown, row 0 at the lowest y."""
    frame: Frame
    type: int
    base: float = 0.0
    multiplier: float = 1.0

    def files(self) -> dict[str, bytes]:
        """Return its image and YAML file, by name, for map_server's mode `raw`."""
        values, frame = self.values, self.frame
        if frame.yaw_rad:  # costmap filters read the origin of a mask and not its yaw
            rows, cols = values.shape
            corners = frame.points_of_grid([[0, 0], [0, cols], [rows, 0], [rows, cols]])
            (left, low), side = corners.min(axis=0).tolist(), frame.resolution_m
            size = np.ceil((corners.max(axis=0) - [left, low]) / side).astype(np.int64)
            cells = np.zeros(size[::-1], dtype=np.float32)
            frame = Frame(side, (left, low))
            upright = OccupancyGrid(cells, frame, robot_radius_m=0)
            values = mask_on_map(upright, values, self.frame)
        # A value of 0 makes unknown cells of a costmap free for the keepout filter, and an unknown
        # one is an error for the speed filter.
        unknown = np.int16(255 if self.kind == "keepout" else 0)  # int8 has no 255
        pixels = np.where(values < 0, unknown, values).astype(np.uint8)[::-1]
        head = f"P5\n{pixels.shape[1]} {pixels.shape[0]}\n255\n"
        described = _rendered("bundle_mask.yaml.j2", {"kind": self.kind, "frame": frame})
        image = head.encode() + pixels.tobytes()
        return {f"{self.kind}_mask.pgm": image, f"{self.kind}_mask.yaml": described}


def export_bundle(  # noqa: PLR0913 - the last four have defaults
    topology: TopologicalMap,
    graph: RouteGraph,
    folder: PathLike,
    *,
    costs: Sequence[str] = (),
    operations: bool = False,
    lifts: Iterable[str] = (),
    frame: str = "map",
) -> tuple[str, ...]:
    """Write all that Nav2 needs of a map into one folder, or nothing.

    The folder holds `graph.geojson`, whose edges have metadata for the scorers of the route server.
    In `rooms_mask.yaml` the value of a cell is the number of its room, and `room_names.yaml` has
    these numbers. There are `keepout_mask.yaml` and `speed_mask.yaml`, if they are given, and
    `poses.yaml`, goals in rooms, doors and lifts. `nav2_params.yaml` is to be merged into the
    parameters of the robot; a `README.md` explains all.

    Parameters
    ----------
    topology
        The map, built with rooms.
    graph
        A route graph of it.
    folder
        A new or empty folder, or a bundle of before, which is replaced: rooms keep their numbers by
        name.
    costs
        Masks, `keepout:FILE` or `speed:FILE`, with settings as for `load_speed_mask`; one of a kind
        at most. Edges through keepout zones are left out, speed limits become metadata of edges.
    operations
        Whether edges through doors ask to open them: an operation `OpenDoor` at the entry of the
        edge, with the door's own service. Without a server for it, Nav2 ends the route there. Edges
        that end at a lift call it likewise, by `CallLift`.
    lifts
        Named points of the graph at which lifts are, each a goal.
    frame
        Name of the map frame.

    Returns
    -------
    tuple of str
        Things left out of the bundle: rooms without a number, edges in keepout zones.

    Raises
    ------
    InvalidValueError
        When the map has no rooms, or the graph is one of another map or keeps no edge. When a mask
        has another form, a lift is no named point or has the service of another one, or the folder
        holds other files.
    MapError
        When a mask cannot be read, or the folder cannot be written.

    Examples
    --------
    >>> from hybridnav.graphs import build_lane_graph, export_bundle
    >>> grid = hn.OccupancyGrid(np.zeros((20, 60)), hn.Frame(0.1), robot_radius_m=0.2)
    >>> labels = np.arange(60) // 30 * np.ones((20, 1), dtype=int)
    >>> rooms = hn.RoomLabels(("kitchen", "store"), labels)
    >>> pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=2.0, rooms=rooms)
    >>> topology = hn.TopologicalMap(pyramid)
    >>> export_bundle(topology, build_lane_graph(topology), "robot")
    ()
    """
    grid = checked_type("topology", topology, TopologicalMap).grid
    checked_type("graph", graph, RouteGraph)
    if not topology.has_rooms or graph.grid is not grid:
        raise InvalidValueError(
            "a bundle needs a map with rooms and a graph of it: build the pyramid with rooms="
            "find_rooms(grid), and the graph from that"
        )
    before = check_bundle(folder)
    specs = checked_masks(costs)
    numbers, left_out = _numbered(topology.rooms, before)
    values = np.array([numbers.get(name, 0) for name in (*topology.rooms.names, "")], np.int8)
    masks = [_Mask("rooms", values[topology.rooms.labels.label_of], grid.frame, type=4)]
    masks += [_read(spec) for spec in specs.values()]
    n_edges, graph = graph.n_edges, without_keepout(graph, specs)
    features = nav2_features(graph, frame)
    nodes, edges = features[: graph.n_nodes], features[graph.n_nodes :]
    for node in nodes:  # else the semantic scorer would count a node as an edge of that class
        metadata = node["properties"]["metadata"]
        node["properties"]["metadata"] = {"kind": metadata.pop("class"), **metadata}
    for edge, known in zip(edges, _edge_facts(topology.rooms, graph, specs), strict=True):
        edge["properties"]["metadata"] |= known
    doors = {door.number: door for door in topology.rooms.doors}
    services = _services(graph, lifts)
    if operations:
        _add_operations(edges, graph, doors, services)
    if graph.n_edges < n_edges:
        left_out += [f"{n_edges - graph.n_edges:,} edges through keepout zones"]
    facts = {
        "name": grid.name,
        "folder": str(Path(folder).resolve()),
        "frame": frame,
        "rooms": sorted((number, name) for name, number in numbers.items()),
        "left_out": left_out,
        "masks": masks,
        "operations": ["OpenDoor", *["CallLift"] * bool(services)] * operations,
        "classes": _CLASSES,
        "poses": _poses(topology.rooms, graph, doors, services),
    }
    files = {_GRAPH: nav2_bytes(grid.name, nodes + edges)}
    for mask in masks:
        files |= mask.files()
    for name in (_NAMES, _PARAMS, "poses.yaml", "README.md"):
        files[name] = _rendered(f"bundle_{name}.j2", facts)
    _write(Path(folder).resolve(), files)
    return tuple(left_out)


def check_bundle(folder: PathLike) -> dict[str, int]:
    """Return the numbers of rooms of a bundle that would be replaced, empty for a new folder.

    Raises `InvalidValueError` when the folder is none, or holds other files.
    """
    path = Path(folder)
    try:
        names = {each.name for each in path.iterdir()} if path.exists() else set()
        is_there = path.resolve().parent.is_dir()
    except OSError as error:  # no folder, or a name that is too long
        raise InvalidValueError(f"bundle {printable(path)}: {error.strerror}") from None
    if not is_there:
        raise InvalidValueError(f"bundle {printable(path)}: there is no folder to put it into")
    strange = sorted(names - _FILES) or sorted(names)[:1] * (not names >= {_GRAPH, _PARAMS})
    if strange:
        raise InvalidValueError(
            f"bundle {printable(path)} must be a new or empty folder or a bundle of before, and it "
            f"holds {printable(strange[0])}"
        )
    if _NAMES not in names:
        return {}
    known = read_yaml(path / _NAMES, what="room names", error=InvalidValueError).get("rooms")
    pairs = known.items() if isinstance(known, dict) else ()
    return {str(name): n for n, name in pairs if isinstance(n, int) and 0 < n <= MOST_ROOMS}


def checked_masks(costs: Sequence[str]) -> dict[str, CostSpec]:
    """Return the masks that some texts state, by kind.

    Raises `InvalidValueError` when one is no mask, or a second one of its kind.
    """
    found: dict[str, CostSpec] = {}
    for spec in parse_costs(costs):
        if spec.kind == "clearance" or spec.kind in found:
            raise InvalidValueError(
                f"costs of a bundle are one keepout:FILE and one speed:FILE at most, got "
                f"{spec.kind} {'twice' if spec.kind in found else 'too'}"
            )
        found[spec.kind] = spec
    return found


def _read(spec: CostSpec) -> _Mask:
    """Return a mask as its file holds it."""
    values, frame = read_mask(spec.file, max_cells=DEFAULT_MAX_CELLS)
    frame = frame.moved(spec.pose)
    if spec.kind == "keepout":
        return _Mask("keepout", values, frame, type=0)
    get = spec.settings.get
    base, multiplier = get("base", 100.0), get("multiplier", -1.0)
    is_absolute = get("unit") == "m/s"
    return _Mask("speed", values, frame, 1 + is_absolute, base, multiplier)


def _numbered(rooms: Rooms, before: Mapping[str, int]) -> tuple[dict[str, int], list[str]]:
    """Return the number of each listed room, and what is said about those without one."""
    shown = np.flatnonzero(rooms.is_listed)
    largest = shown[np.argsort(-rooms.areas_m2[shown], kind="stable")][:MOST_ROOMS]
    names = [rooms.names[at] for at in np.sort(largest)]
    taken = {before[name] for name in names if name in before}
    free = iter(sorted({*range(1, MOST_ROOMS + 1)} - taken))
    numbers = {name: before[name] if name in before else next(free) for name in names}
    others = [rooms.names[at] for at in shown if rooms.names[at] not in numbers]
    return numbers, [f"room {name}: masks hold {MOST_ROOMS} rooms" for name in others]


def _least(graph: RouteGraph, values: AnyArray) -> FloatArray:
    """Return the least value of the map's cells that each edge touches, float64 (m,)."""
    cells = SpeedMap(values, graph.grid.frame)
    least = [cells.least_along(graph.points[edge])[0] for edge in graph.edges]
    return np.array(least, dtype=np.float64)


def _edge_facts(
    rooms: Rooms, graph: RouteGraph, specs: Mapping[str, CostSpec]
) -> list[dict[str, Any]]:
    """Return what scorers read of each edge. Nav2 takes these numbers for floats and fails on
    integers, so each is written with its point."""
    percent, full_mps = np.full(graph.n_edges, 100.0), math.nan
    if "speed" in specs:
        percent = _least(graph, 100.0 / specs["speed"].layer(graph.grid).factors.astype(np.float64))
        full_mps = specs["speed"].settings.get("full_speed_mps", math.nan)
    named = zip(rooms.names, rooms.kinds, strict=True)
    classes = {name: "room" if kind is None else kind.name for name, kind in named}
    has_jambs = {door.number for door in rooms.doors if not door.is_opening}
    spare = (graph.clearances_m - graph.grid.robot_radius_m) / _MARGIN_M
    penalties = graph.lengths_m * (1 - np.clip(spare, 0, 1))
    found: list[dict[str, Any]] = []
    for edge, room in enumerate(graph.edge_rooms):
        kind = "free" if room is None else classes[room]
        kind = "door" if has_jambs.intersection(graph.edge_doors[edge]) else kind
        # On every edge: without it the distance scorer takes 1 for 100 per cent.
        facts: dict[str, Any] = {"class": kind, "speed_limit": round(float(percent[edge]), 1)}
        if percent[edge] < 100 and not math.isnan(full_mps):  # noqa: PLR2004 - per cent
            facts["abs_speed_limit"] = round(float(percent[edge]) / 100 * full_mps, 3)
        if penalties[edge] > 0:
            facts["penalty"] = round(float(penalties[edge]), 3)
        found.append(facts)
    return found


def without_keepout(graph: RouteGraph, specs: Mapping[str, CostSpec]) -> RouteGraph:
    """Return a graph without the edges that touch a cell of a keepout zone, and without nodes that
    these leave alone; `specs`: masks by kind, as of `checked_masks`.

    Raises `InvalidValueError` when no edge is left.
    """
    shut = specs["keepout"].layer(graph.grid).keepout if "keepout" in specs else None
    if shut is None:
        return graph
    edges = np.flatnonzero(_least(graph, np.where(shut, 0.5, 1.0)) == 1)
    if not len(edges):
        raise InvalidValueError("keepout zones leave the graph no edge: give another mask")
    nodes = np.setdiff1d(np.arange(graph.n_nodes), np.setdiff1d(graph.edges, graph.edges[edges]))
    return replace(
        graph,
        positions=graph.positions[nodes],
        kinds=tuple(graph.kinds[node] for node in nodes),
        rooms=tuple(graph.rooms[node] for node in nodes),
        doors=graph.doors[nodes],
        names=tuple(graph.names[node] for node in nodes),
        edges=np.searchsorted(nodes, graph.edges[edges]),
        edge_rooms=tuple(graph.edge_rooms[edge] for edge in edges),
        edge_doors=tuple(graph.edge_doors[edge] for edge in edges),
        widths_m=graph.widths_m[edges],
        clearances_m=graph.clearances_m[edges],
        left_m=graph.left_m[edges],
        right_m=graph.right_m[edges],
        ids=(graph.ids[0][nodes], graph.ids[1][edges]),
    )


def _services(graph: RouteGraph, lifts: Iterable[str]) -> dict[str, str]:
    found: dict[str, str] = {}
    for name in dict.fromkeys(lifts):
        # Names in ROS have 247 letters of ASCII at most: others become their codes.
        text = f"lift {name}".encode("ascii", "backslashreplace").decode()
        service = f"/{re.sub('[^0-9A-Za-z]+', '_', text)[:200].strip('_')}/call"
        if name is None or name not in graph.names or service in found.values():
            raise InvalidValueError(
                f"lift {brief(name)} must be a named point of the graph, with a service that no "
                f"other lift has, got {service}: rename it"
            )
        found[name] = service
    return found


def _add_operations(
    edges: Sequence[dict[str, Any]],
    graph: RouteGraph,
    doors: Mapping[int, Door],
    services: Mapping[str, str],
) -> None:
    """Let each edge ask for its doors, and for the lift where it ends, at its entry; openings have
    nothing to open."""
    for edge, passed, head in zip(edges, graph.edge_doors, graph.edges[:, 1].tolist(), strict=True):
        shut = [number for number in passed if not doors[number].is_opening]
        known = [{"door": number, "service_name": f"/door_{number}/open"} for number in shut]
        name = graph.names[head]
        known += [{"lift": name, "service_name": services[name]}] if name in services else []
        if known:
            edge["properties"]["operations"] = [
                {"type": "OpenDoor" if "door" in each else "CallLift", "trigger": "ON_ENTER"}
                | {"metadata": each}
                for each in known
            ]


def _poses(
    rooms: Rooms, graph: RouteGraph, doors: Mapping[int, Door], lifts: Iterable[str]
) -> list[tuple[str, tuple[float, ...]]]:
    """Return goals by name: x and y in metres, and z and w of the heading's quaternion."""
    names = np.array(rooms.names)[rooms.is_listed & rooms.fits].tolist()
    found = [(name, (*rooms.point_of(name), 0.0, 1.0)) for name in names]
    in_door = {n: node for node, n in reversed([*enumerate(graph.doors.tolist())]) if n}
    for number, node in sorted(in_door.items()):
        (x, y), (u, v) = rooms.door_ends(number)
        at = graph.points[node]
        ahead = np.array([v - y, x - u])
        ahead /= max(hypot(*ahead), 1e-9)
        beyond = [rooms.at(tuple((at + sign * ahead).tolist())) for sign in (1, -1)]
        first, second = doors[number].rooms
        # It heads into the second room, unless the first one lies there.
        if beyond[0] == first or (beyond[1] == second and beyond[0] != second):
            ahead = -ahead
        for room, sign in ((second, 1), (first, -1)):
            half = atan2(sign * ahead[1], sign * ahead[0]) / 2
            name = f"door {number} into {'no room' if room is None else room}"
            found.append((name, (*at.tolist(), sin(half), cos(half))))
    of_lifts = {name: (*graph.points[graph.names.index(name)].tolist(), 0.0, 1.0) for name in lifts}
    by_name = dict(found) | of_lifts  # a room of that name is left for the lift
    return [(name, tuple(round(value, 4) for value in at)) for name, at in by_name.items()]


def _rendered(template: str, known: Mapping[str, Any]) -> bytes:
    from jinja2 import Environment, StrictUndefined  # noqa: PLC0415 - on demand

    text = resources.files("hybridnav.graphs").joinpath(template).read_text(encoding="utf-8")
    # Names are quoted as YAML; nothing of it is HTML.
    environment = Environment(
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,  # noqa: S701
    )
    environment.filters["quoted"] = quoted
    return environment.from_string(text).render(**known).encode()


def _write(target: Path, files: Mapping[str, bytes]) -> None:
    """Write a folder whole or not at all, in place of one that exists."""
    try:
        with TemporaryDirectory(prefix=".hybridnav.", dir=target.parent) as held:
            new, old = Path(held, "new"), Path(held, "old")
            new.mkdir()
            for name, content in files.items():
                (new / name).write_bytes(content)
            if target.exists():
                target.rename(old)
            try:
                new.rename(target)
            finally:
                if old.exists() and not target.exists():
                    old.rename(target)
    except OSError as error:
        raise MapError(f"bundle {printable(target)}: cannot write: {error.strerror}") from None
