"""Readers of topological maps of STRANDS and LCAS, of GraphML and of GML."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any
from xml.parsers import expat

from hybridnav._base.trig import atan2, cos, sin
from hybridnav._base.xml_reader import XmlReader
from hybridnav._base.yaml_file import Limits
from hybridnav.errors import InvalidValueError, MapError
from hybridnav.graphs.gather import Gathered, number_of, pair_of, point_of
from hybridnav.graphs.waypoint_graph import WaypointGraph

LIMITS = Limits(max_bytes=2**25, max_values=300_000, aliases=True)
"""How much of a file is read; a map of 90 nodes has 11,000 values."""
_TEXT = "topological map"


def read_yaml_graph(data: Any, where: str, name: str) -> WaypointGraph:
    """Read a topological map: a list of nodes (STRANDS) or a mapping with `nodes` (tmap2).

    `data`: the file as parsed; `where`: what messages begin with; `name`: name of a graph that has
    none. Raises `MapError` when it is in neither form.
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


# Reader of GraphML, element by element: no tree of the file is kept.

_MOST_TEXT = 2**20
"""Characters of one value."""
_TRUE = ("true", "1")


def read_graphml(text: str, where: str, name: str) -> WaypointGraph:
    """Read a graph.

    `text`: the file. Nodes have `x` and `y`, or one of the other attributes of
    `WaypointGraph.from_networkx`; nested graphs are read as one; `where`: what messages begin with;
    `name`: name of a graph that has none. Raises `MapError` when it is no GraphML, or declares a
    document type: entities could make it endless.
    """
    reader = _Reader(where, name)
    parser = expat.ParserCreate("utf-8", namespace_separator=" ")
    parser.buffer_text = True
    parser.CharacterDataHandler = reader.characters
    reader.parse(text, parser)
    if not reader.is_graphml:
        raise MapError(f"{where}: expected GraphML, got other XML")
    return WaypointGraph(**reader.gathered.fields("graphml", reader.name))


class _Reader(XmlReader):
    deepest, kind = 100, "GraphML"

    def __init__(self, where: str, name: str) -> None:
        super().__init__(where)
        self.gathered = Gathered(where)
        self.name = name
        self.is_graphml = False
        self._is_directed = [True]
        self._keys: dict[str, tuple[str, str]] = {}
        self._open: list[tuple[dict[str, str], dict[str, Any]]] = []
        self._key: str | None = None
        self._text: list[str] = []

    def start(self, tag: str, given: dict[str, str]) -> None:
        """Begin an element."""
        tag = tag.rpartition(" ")[2]
        if self._depth == 1:
            self.is_graphml = tag == "graphml"
        elif tag == "key":
            name = given.get("attr.name", given.get("id", ""))
            self._keys[given.get("id", "")] = name, given.get("attr.type", "string")
            self._key, self._text = given.get("id", ""), []
        elif tag == "graph":
            default = given.get("edgedefault", "directed")
            self._is_directed.append(default != "undirected")
        elif tag in {"node", "edge"}:
            self._open.append((given, {}))
        elif tag == "data":
            self._key, self._text = given.get("key", ""), []

    def characters(self, text: str) -> None:
        if self._key is not None:
            self._text.append(text)
            if sum(map(len, self._text)) > _MOST_TEXT:
                raise MapError(f"{self._where}: a value of more than {_MOST_TEXT} characters")

    def end(self, tag: str) -> None:
        tag = tag.rpartition(" ")[2]
        if tag == "data" and self._key is not None:
            name, kind = self._keys.get(self._key, (self._key, "string"))
            value = _value("".join(self._text), kind)
            if self._open:
                self._open[-1][1][name] = value
            elif name == "name" and value:
                self.name = str(value)
            self._key = None
        elif tag == "key":
            self._key = None
        elif tag == "graph":
            self._is_directed.pop()
        elif tag == "node" and self._open:
            self._add_node(*self._open.pop())
        elif tag == "edge" and self._open:
            self._add_edge(*self._open.pop())

    def _add_node(self, given: dict[str, str], facts: dict[str, Any]) -> None:
        if "id" not in given:
            raise MapError(f"{self._where}: a node has no id")
        self.gathered.add_node(given["id"], point_of(facts), facts)

    def _add_edge(self, given: dict[str, str], facts: dict[str, Any]) -> None:
        if "source" not in given or "target" not in given:
            raise MapError(f"{self._where}: an edge has no source or no target")
        endpoints, name = (given["source"], given["target"]), given.get("id")
        if name is not None:
            self.gathered.check_edge_name(name, endpoints)
        stated = given.get("directed")
        directed = self._is_directed[-1] if stated is None else stated in _TRUE
        self.gathered.add_link(endpoints, facts, directed=directed, name=name)


def _value(text: str, kind: str) -> Any:
    """Return a value as its type states; the text itself where it is no such value."""
    try:
        if kind in {"int", "long"}:
            return int(text)
        if kind in {"float", "double"}:
            return float(text)
    except ValueError:
        return text
    return text.strip().lower() in _TRUE if kind == "boolean" else text


# Reader of GML, by networkx.

MOST_GML = 2**24
"""Bytes of a file: networkx takes some 2 s for each million."""
_NOT_PLAIN = re.compile(
    r'#.*|"[^"]*"|(?<![\w.])([-+]?(?:\d+\.?\d*|\.\d+)[eE][-+]?\d{1,6})(?![\w.])'
)


def _plain_gml(found: re.Match[str]) -> str:
    if found[1]:
        return f"{float(found[1]):.17E}"
    return "" if found[0].startswith("#") else found[0]


def read_gml(text: str, where: str, name: str) -> WaypointGraph:
    """Read a graph, as SWAGGER of NVIDIA writes it: `graph [`, nodes with a point as for GraphML.

    Nodes are called by their labels if all have one of their own, else by their ids. `where`: what
    messages begin with; `name`: name of a graph that has none. Raises `MapError` when it is no GML.
    """
    import networkx as nx  # noqa: PLC0415 - on demand

    # networkx reads 1e-05 as 1, and -5 as the attribute e; a quote in a comment begins a text.
    plain = _NOT_PLAIN.sub(_plain_gml, text)
    try:
        read = nx.parse_gml(plain.replace("\r", "\n"), label="id")
    except (nx.NetworkXError, ValueError, TypeError, LookupError, AttributeError) as error:
        cause = " ".join(str(error).split())
        said = cause if cause.isprintable() else repr(cause)
        raise MapError(f"{where}: no GML that networkx can read: {said:.200}") from None
    except RecursionError:
        raise MapError(f"{where}: GML nested deeper than anything meant") from None
    labels = {node: facts.get("label") for node, facts in read.nodes(data=True)}
    if len({each for each in labels.values() if isinstance(each, str)}) == len(labels):
        names = {node: node if each == str(node) else each for node, each in labels.items()}
        read = nx.relabel_nodes(read, names)
    try:
        found = WaypointGraph.from_networkx(read, name=str(read.graph.get("name") or name))
    except InvalidValueError as error:
        raise MapError(f"{where}: {str(error).partition(': ')[2]}") from None
    return replace(found, format="gml")


# Reader of STRANDS's older topological maps: plain text, indented by tabs.

_POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")
_SECTIONS = ("waypoint", "edges", "vertices")


def is_text_graph(text: str) -> bool:
    """Return whether a text begins as such a map: "node:" and an indented name below."""
    lines = text[:4096].split("\n", 2)
    return (
        len(lines) > 1 and lines[0].strip() == "node:" and lines[1][:1].isspace() and
        bool(lines[1].strip()) and ":" not in lines[1]
    )  # fmt: skip


@dataclass
class _Node:
    name: str = ""
    pose: list[str] = field(default_factory=list)
    edges: list[list[str]] = field(default_factory=list)
    vertices: list[tuple[float, float]] = field(default_factory=list)


def read_text_graph(text: str, where: str, name: str) -> WaypointGraph:
    """Read a map of blocks `node:`, each with a name, `waypoint:` (x, y, z, and a quaternion),
    `edges:` (a line each: the other node, the action) and `vertices:`.

    `where`: what messages begin with; `name`: name of the graph. Raises `MapError` when a line is
    not as expected; the text names it.
    """
    gathered = Gathered(where)
    node, section = _Node(), ""
    for number, line in enumerate(text.splitlines(), start=1):
        word = line.strip()
        at = f"{where}, line {number}"
        if word == "node:":
            _add(gathered, node, at)
            node, section = _Node(), "node"
        elif word.endswith(":") and word[:-1] in _SECTIONS:
            section = word[:-1]
        elif word:
            _take(node, section, word, at)
    _add(gathered, node, where)
    return WaypointGraph(**gathered.fields("strands-text", name, "map"))


def _take(node: _Node, section: str, word: str, where: str) -> None:
    parts = [part.strip() for part in word.split(",")]
    if section == "node" and not node.name:
        node.name = word
    elif section == "waypoint" and not node.pose:
        node.pose = parts
    elif section == "edges" and parts[0]:
        node.edges.append(parts)
    elif section == "vertices":
        point = pair_of(parts)
        if point is None:
            raise MapError(f"{where}: expected a vertex x,y in metres, got {word!r:.60}")
        node.vertices.append(point)
    else:
        raise MapError(f"{where}: expected a section of a node, got {word!r:.60}")


def _add(gathered: Gathered, node: _Node, where: str) -> None:
    """Add a finished node; the first block has none before it."""
    if not node.name:
        if node.pose or node.edges or node.vertices:
            raise MapError(f"{where}: a node before has no name")
        return
    pose = dict(zip(_POSE, map(number_of, node.pose), strict=False))
    facts: dict[str, Any] = {"pose": pose} if pose else {}
    if node.vertices:
        facts["vertices"] = node.vertices
    gathered.add_node(node.name, pair_of(node.pose), facts)
    for other, *action in node.edges:
        facts = {"action": action[0]} if action else {}
        if action[1:]:
            facts["more"] = action[1:]
        gathered.add_edge((node.name, other), facts)
