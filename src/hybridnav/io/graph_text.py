"""Reader of STRANDS's older topological maps: plain text, indented by tabs."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from hybridnav.errors import MapError
from hybridnav.graphs.gather import Gathered, number_of, pair_of
from hybridnav.graphs.waypoint_graph import WaypointGraph

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

    Parameters
    ----------
    text
        The file.
    where
        What messages begin with.
    name
        Name of the graph.

    Raises
    ------
    MapError
        When a line is not as expected; the text names it.
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
    """Take one line of a section."""
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
