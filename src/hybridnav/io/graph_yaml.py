"""Readers of topological maps in YAML: those of STRANDS, and LCAS's tmap2."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from hybridnav._trig import atan2, cos, sin
from hybridnav.config.yaml_file import Limits
from hybridnav.errors import MapError
from hybridnav.graphs.gather import Gathered, number_of, pair_of
from hybridnav.graphs.waypoint_graph import WaypointGraph

if TYPE_CHECKING:
    from collections.abc import Mapping

LIMITS = Limits(max_bytes=2**25, max_values=300_000, aliases=True)
"""How much of a file is read; a map of 90 nodes has 11,000 values."""
_TEXT = "topological map"


def read_yaml_graph(data: Any, where: str, name: str) -> WaypointGraph:
    """Read a topological map: a list of nodes (STRANDS) or a mapping with `nodes` (tmap2).

    Parameters
    ----------
    data
        The file as parsed.
    where
        What messages begin with.
    name
        Name of a graph that has none.

    Raises
    ------
    MapError
        When it is in neither form.
    """
    gathered = Gathered(where)
    if isinstance(data, list):
        pose_of = _Poses({})
        for index, entry in enumerate(data):
            _add_node(gathered, entry, pose_of, f"{where}, node {index}")
        metas = [entry["meta"] for entry in data if isinstance(entry.get("meta"), dict)]
        of_first: dict[str, Any] = next((meta for meta in metas if "pointset" in meta), {})
        name = str(of_first.get("pointset", name))
        return WaypointGraph(**gathered.fields("strands", name, "map"))
    if not isinstance(data, dict) or not isinstance(data.get("nodes"), list):
        shown = "nothing" if data is None else f"{data!r:.60}"
        raise MapError(
            f"{where}: expected a {_TEXT}, a list of nodes or a mapping with 'nodes', got {shown}"
        )
    pose_of = _Poses(data.get("transformation"))
    for index, entry in enumerate(data["nodes"]):
        _add_node(gathered, entry, pose_of, f"{where}, node {index}")
    name = str(data.get("name", name))
    return WaypointGraph(**gathered.fields("tmap2", name, pose_of.parent))


def _add_node(gathered: Gathered, entry: Any, pose_of: _Poses, where: str) -> None:
    """Add a node and the edges that begin there."""
    node = entry.get("node") if isinstance(entry, dict) else None
    if not isinstance(node, dict) or "name" not in node:
        raise MapError(f"{where}: expected a mapping 'node' with a 'name', got {entry!r:.60}")
    facts = {key: value for key, value in node.items() if key not in {"name", "edges"}}
    if isinstance(entry.get("meta"), dict):
        facts["meta"] = entry["meta"]
    gathered.add_node(node["name"], pose_of.point(node), facts)
    edges = node.get("edges")
    for edge in edges if isinstance(edges, list) else []:
        if not isinstance(edge, dict) or "node" not in edge:
            raise MapError(f"{where}: expected edges with 'node', got {edge!r:.60}")
        endpoints, name = (node["name"], edge["node"]), edge.get("edge_id")
        name = None if name == "" else name
        if name is not None:
            gathered.check_edge_name(name, endpoints)
        rest = {key: value for key, value in edge.items() if key not in {"node", "edge_id"}}
        gathered.add_edge(endpoints, rest, name=name)


class _Poses:
    """Points of nodes in the frame of the map; tmap2 may hold them in a frame of its own."""

    def __init__(self, transformation: Any) -> None:
        given = transformation if isinstance(transformation, dict) else {}
        self.parent = str(given.get("parent", "map"))
        self._child = given.get("child")
        self._shift = pair_of(given.get("translation"))
        self._yaw = _yaw_of(given.get("rotation"))

    def point(self, node: Mapping[str, Any]) -> tuple[float, float] | None:
        """Return the point of a node in metres, None for none."""
        pose = node.get("pose")
        point = pair_of(pose.get("position")) if isinstance(pose, dict) else None
        frame = node.get("parent_frame")
        if point is None or frame is None or frame == self.parent or frame != self._child:
            return point
        x, y = point
        shift_x, shift_y = self._shift or (0.0, 0.0)
        cosine, sine = cos(self._yaw), sin(self._yaw)
        return shift_x + cosine * x - sine * y, shift_y + sine * x + cosine * y


def _yaw_of(rotation: Any) -> float:
    """Return the yaw of a quaternion {w, x, y, z} in radians, 0 for none."""
    if not isinstance(rotation, dict):
        return 0.0
    w, x, y, z = (number_of(rotation.get(axis, 0.0)) for axis in "wxyz")
    yaw = atan2(2 * (w * z + x * y), w * w + x * x - y * y - z * z)
    return yaw if math.isfinite(yaw) else 0.0
