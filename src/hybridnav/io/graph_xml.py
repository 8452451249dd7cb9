"""Reader of GraphML, element by element: no tree of the file is kept."""

from __future__ import annotations

from typing import Any
from xml.parsers import expat

from hybridnav.errors import MapError
from hybridnav.graphs.gather import Gathered, point_of
from hybridnav.graphs.waypoint_graph import WaypointGraph
from hybridnav.io.osm_xml import parse_xml

_DEEPEST = 100
_MOST_TEXT = 2**20
"""Characters of one value."""
_TRUE = ("true", "1")


def read_graphml(text: str, where: str, name: str) -> WaypointGraph:
    """Read a graph.

    Parameters
    ----------
    text
        The file. Nodes have `x` and `y`, or one of the other attributes of
        `WaypointGraph.from_networkx`; nested graphs are read as one.
    where
        What messages begin with.
    name
        Name of a graph that has none.

    Raises
    ------
    MapError
        When it is no GraphML, or declares a document type: entities could make it endless.
    """
    reader = _Reader(where, name)
    parser = expat.ParserCreate("utf-8", namespace_separator=" ")
    parser.buffer_text = True
    parser.StartElementHandler = reader.start
    parser.EndElementHandler = reader.end
    parser.CharacterDataHandler = reader.characters
    parser.StartDoctypeDeclHandler = reader.refuse
    parse_xml(parser, text, where)
    if not reader.is_graphml:
        raise MapError(f"{where}: expected GraphML, got other XML")
    return WaypointGraph(**reader.gathered.fields("graphml", reader.name))


class _Reader:
    """What expat calls."""

    def __init__(self, where: str, name: str) -> None:
        self.gathered = Gathered(where)
        self.name = name
        self.is_graphml = False
        self._where = where
        self._depth = 0
        self._is_directed = [True]
        self._keys: dict[str, tuple[str, str]] = {}
        self._defaults: dict[str, dict[str, Any]] = {}
        self._open: list[tuple[dict[str, str], dict[str, Any]]] = []
        self._key: str | None = None
        self._text: list[str] = []

    def refuse(self, *_: Any) -> None:
        """Refuse a document type."""
        raise MapError(f"{self._where}: GraphML with a document type (DOCTYPE) is not read")

    def start(self, tag: str, given: dict[str, str]) -> None:
        """Begin an element."""
        tag = tag.rpartition(" ")[2]
        self._depth += 1
        if self._depth > _DEEPEST:
            raise MapError(f"{self._where}: XML nested more than {_DEEPEST} deep")
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
        """Take text of a value."""
        if self._key is not None:
            self._text.append(text)
            if sum(map(len, self._text)) > _MOST_TEXT:
                raise MapError(f"{self._where}: a value of more than {_MOST_TEXT} characters")

    def end(self, tag: str) -> None:
        """End an element."""
        tag = tag.rpartition(" ")[2]
        self._depth -= 1
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
