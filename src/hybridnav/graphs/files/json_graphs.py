"""Readers of graphs in JSON: GeoJSON of Nav2's route server, and networkx's node-link form."""

import json
import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from hybridnav.errors import MapError
from hybridnav.graphs.files import nav2_rules as rules
from hybridnav.graphs.gather import Gathered, edge_text, name_of, pair_of, point_of, shown
from hybridnav.graphs.waypoint_graph import WaypointGraph

_LINES = ("LineString", "MultiLineString")
_OF_NODE = ("id",)
_OF_EDGE = ("id", "startid", "endid", "cost")
_LINKS = ("links", "edges")


def read_json_graph(text: str, where: str, name: str) -> WaypointGraph:
    """Read a graph in one of the two forms, told apart by their keys.

    `where`: what messages begin with; `name`: name of a graph that has none. Raises `MapError` when
    it is in neither form.
    """
    features, plain = Features(where, may_stop=rules.may_stop(text)), NodeLink(where)
    has: set[str] = set()
    for key, index, value in members_of(text, where):
        has.add(key)
        if index == -1:
            continue
        if key == "features":
            _check_object(value, index, where, "feature")
            features.add(value, f"{where}, feature {index}")
        elif key == "nodes" or key in _LINKS:
            _check_object(value, index, where, key)
            plain.add(key, value)
        elif index is None:
            name = value if key == "name" and isinstance(value, str) and value else name
            plain.set(key, value)
        if key != "features":
            features.check_json(value, key)
    if "features" in has:
        return WaypointGraph(**features.fields(name))
    if "nodes" in has and has & set(_LINKS):
        return WaypointGraph(**plain.fields(plain.name or name))
    raise MapError(
        f"{where}: expected a graph of Nav2 (GeoJSON with 'features') or in node-link form "
        "('nodes' and 'links' or 'edges')"
    )


def _check_object(value: Any, index: int | None, where: str, what: str) -> None:
    if index is None or not isinstance(value, dict):
        raise MapError(f"{where}: expected a list of objects for each {what}, got {value!r:.60}")


class Features:
    """Features of a route graph as Nav2's loader takes them: points are nodes, lines are edges."""

    def __init__(self, where: str, *, may_stop: bool) -> None:
        self._gathered = Gathered(where)
        self._may_stop = may_stop
        self._frame = ""
        self._node_ids: set[Any] = set()
        self._others: list[dict[str, Any]] = []
        self._has_edges = False

    def check_json(self, value: Any, text: str, nodes: tuple[Any, ...] = ()) -> None:
        """Add a finding, at some nodes, on what Nav2's parser refuses anywhere in a file."""
        if self._may_stop:
            for words in rules.no_json(value, text):
                self._gathered.findings.add("stops-loader", f"{words:.200}", nodes=nodes)

    def add(self, feature: dict[str, Any], where: str) -> None:
        """Add one feature."""
        geometry, facts = feature.get("geometry"), feature.get("properties")
        geometry = geometry if isinstance(geometry, dict) else {}
        facts = facts if isinstance(facts, dict) else {}
        kind = geometry.get("type")
        # Tables of drawing programs give every feature all columns, null where it has none.
        has_endpoints = facts.get("startid") is not None or facts.get("endid") is not None
        if kind in _LINES or (kind is None and has_endpoints):
            self._add_edge(feature, facts, where)
        elif kind == "Point" or (kind is None and "id" in facts):
            self._add_node(feature, facts, where)
        else:
            self._others.append(feature)
            at = where.rpartition(", ")[2]
            self.check_json(feature, at)
            if kind is None:
                self._gathered.findings.add("stops-loader", f"{at}: no geometry")

    def _add_node(self, feature: dict[str, Any], facts: dict[str, Any], where: str) -> None:
        if "id" not in facts:
            raise MapError(f"{where}: a node has no id")
        known = rules.held_id(facts["id"])
        geometry = feature.get("geometry")
        point = pair_of(geometry.get("coordinates")) if isinstance(geometry, dict) else None
        text = f"node {shown(name_of(facts['id']))}"
        self._check(feature, text, {"id": facts["id"]}, (known,))
        self._gathered.add_node(known, point, _without(facts, _OF_NODE))
        self._node_ids.add(name_of(known))
        if not self._frame and isinstance(facts.get("frame"), str):
            self._frame = facts["frame"]

    def _add_edge(self, feature: dict[str, Any], facts: dict[str, Any], where: str) -> None:
        for key in ("startid", "endid"):
            if key not in facts:
                raise MapError(f"{where}: an edge has no {key}")
        ids = {key: facts.get(key) for key in _OF_EDGE[:3]}
        name, *endpoints = map(rules.held_id, ids.values())
        text = edge_text(*map(name_of, ids.values()))
        self._check(feature, text, ids, tuple(endpoints))
        if "id" in facts:
            self._gathered.check_edge_name(name, (endpoints[0], endpoints[1]))
        geometry, cost = feature.get("geometry"), facts.get("cost")
        line = geometry.get("coordinates") if isinstance(geometry, dict) else None
        is_cost = isinstance(cost, int | float) and cost == cost and abs(cost) != math.inf  # noqa: PLR0124
        self._gathered.add_edge(
            (endpoints[0], endpoints[1]),
            _without(facts, _OF_EDGE),
            name=name,
            cost=float(cost) if isinstance(cost, bool) else cost if is_cost else None,
            line=_points_of(line) if isinstance(line, list) else None,
        )
        self._has_edges = True

    def _check(
        self, feature: dict[str, Any], text: str, ids: dict[str, Any], at: tuple[Any, ...]
    ) -> None:
        """Add findings at some nodes on ids, and on what Nav2 stops at, or takes otherwise."""
        nodes, findings = tuple(map(name_of, at)), self._gathered.findings
        for key, value in ids.items():
            if not rules.is_id(value):
                findings.add("bad-id", f"{text}: {key} is no number", nodes=nodes)
            elif rules.held_id(value) != value:
                held = f"{text}: Nav2 holds {key} as {rules.held_id(value)}"
                findings.add("fails-later", held, nodes=nodes)
        facts = feature.get("properties")
        facts, is_edge = facts if isinstance(facts, dict) else {}, len(ids) > 1
        for words in rules.refusals(feature, facts, is_edge=is_edge):
            findings.add("stops-loader", f"{text}: {words:.200}", nodes=nodes)
        for words in rules.fails_later(facts, is_edge=is_edge):
            findings.add("fails-later", f"{text}: {words:.200}", nodes=nodes)
        self.check_json(feature, text, nodes)

    def fields(self, name: str) -> dict[str, Any]:
        """Return the fields of the graph."""
        for both in self._gathered.edge_ids & self._node_ids:
            text = f"node and edge {shown(both)}"
            self._gathered.findings.add("repeated-id", text, nodes=(both,))
        if not self._has_edges:
            self._gathered.findings.add("stops-loader", "the graph has no edge")
        return self._gathered.fields("nav2", name, self._frame) | {"others": tuple(self._others)}


class NodeLink:
    """A graph in the form of `networkx.node_link_data`."""

    def __init__(self, where: str) -> None:
        self._gathered = Gathered(where)
        self._where = where
        self._is_directed = False
        self._links: list[tuple[tuple[Any, Any], dict[str, Any]]] = []
        self.name = ""

    def set(self, key: str, value: Any) -> None:
        """Take a member that is no list."""
        if key == "directed":
            self._is_directed = value is True
        if key == "graph" and isinstance(value, dict):
            self.name = str(value.get("name", ""))

    def add(self, key: str, value: dict[str, Any]) -> None:
        """Add a node or a link."""
        if key == "nodes":
            if "id" not in value:
                raise MapError(f"{self._where}: a node has no id")
            self._gathered.add_node(value["id"], point_of(value), _without(value, ("id",)))
            return
        if "source" not in value or "target" not in value:
            raise MapError(f"{self._where}: a link has no source or no target")
        facts = _without(value, ("source", "target", "key"))
        self._links.append(((value["source"], value["target"]), facts))

    def fields(self, name: str) -> dict[str, Any]:
        """Return the fields of the graph."""
        # `directed` may come after the links.
        for endpoints, facts in self._links:
            self._gathered.add_link(endpoints, facts, directed=self._is_directed)
        return self._gathered.fields("node-link", name)


def _points_of(line: list[Any]) -> list[Any]:
    """Return the points of a line, or of the parts of a line; Nav2's own samples hold parts in a
    LineString too."""
    if not (line and isinstance(line[0], list) and line[0] and isinstance(line[0][0], list)):
        return line
    return [point for part in line if isinstance(part, list) for point in part]


def _without(facts: dict[str, Any], keys: tuple[str, ...]) -> dict[str, Any]:
    return {key: value for key, value in facts.items() if key not in keys}


# JSON whose long lists are read value by value, so that a large file never is one large tree.

MOST_BYTES = 2**28
"""Most bytes of a file: a million edges with metadata take about as many."""
MOST_VALUES = 2**24
"""Most values in a file, counted by its commas and brackets."""
_LONGEST = 2**22
"""Most characters of one node or edge, and of each value beside the lists."""
_BLANK = re.compile(r"[ \t\n\r]*")


def members_of(text: str, where: str) -> Iterator[tuple[str, int | None, Any]]:
    """Yield the members of a JSON object, and of its lists each value by itself.

    `text`: the file. NaN and infinities are read as such, as programs write them; `where`: what
    messages begin with. Yields the key of a member, the index in its list (None where it is no
    list; -1 with no value for an empty one), and the value. Raises `MapError` when the text is no
    JSON object, or too large; one line with the place.
    """
    with json_errors(text, where, MOST_VALUES):
        yield from _Scanner(text).members()


@contextmanager
def json_errors(text: str, where: str, most_values: int) -> Iterator[None]:
    """Raise `MapError`, one line with the place, when a text has too many values or is no JSON."""
    if text.count(",") + text.count("[") + text.count("{") > most_values:
        raise MapError(f"{where}: JSON of more than {most_values} values is not read")
    try:
        yield
    except json.JSONDecodeError as failure:
        at = f"line {failure.lineno}, column {failure.colno}"
        raise MapError(f"{where}, {at}: no JSON: {failure.msg}") from None
    except OverflowError as failure:
        raise MapError(f"{where}: {failure}") from None
    except RecursionError:
        raise MapError(f"{where}: JSON nested deeper than anything meant") from None
    except ValueError:  # an integer of more than 4300 digits
        raise MapError(f"{where}: no JSON: a number has too many digits") from None


def finite(text: str) -> float:
    """Return a number that JSON can hold, which Infinity, NaN and 1e999 are not."""
    number = float(text)
    if not math.isfinite(number):
        raise OverflowError(f"{text[:20]} is no number of JSON")
    return number


class _Scanner:
    """A place in a text, from which value after value is read."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self._begin, self._part = 0, text[:_LONGEST]
        self._decoder = json.JSONDecoder()

    def members(self) -> Iterator[tuple[str, int | None, Any]]:
        """Yield as `members_of`."""
        self._take("{")
        if not self._skip("}"):
            while True:
                key = self._value()
                if not isinstance(key, str):
                    raise self._error("expected a key in quotes", self._at)
                self._take(":")
                if self._skip("["):
                    for index, value in self._items():
                        yield key, index, value
                else:
                    yield key, None, self._value()
                if not self._skip(","):
                    break
            self._take("}")
        self._blank()
        if self._at < len(self._text):
            raise self._error("more text after the end", self._at)

    def _items(self) -> Iterator[tuple[int, Any]]:
        if self._skip("]"):
            yield -1, None
            return
        index = 0
        while True:
            yield index, self._value()
            index += 1
            if not self._skip(","):
                break
        self._take("]")

    def _value(self) -> Any:
        """Read one value out of a part of the text, so that none is longer than that part."""
        self._blank()
        for is_new in (False, True):
            if is_new:
                self._begin, self._part = self._at, self._text[self._at : self._at + _LONGEST]
            is_last = self._begin + len(self._part) == len(self._text)
            try:
                value, end = self._decoder.raw_decode(self._part, self._at - self._begin)
            except json.JSONDecodeError as stop:
                failure = self._error(stop.msg, self._begin + stop.pos)
            else:
                if end < len(self._part) or is_last:
                    self._at = self._begin + end
                    return value
                failure = self._error(f"one value of more than {_LONGEST} characters", self._at)
            if is_last:
                break
        if is_last:
            raise failure
        raise self._error(f"one value of more than {_LONGEST} characters, or none", self._at)

    def _blank(self) -> None:
        found = _BLANK.match(self._text, self._at)
        self._at = self._at if found is None else found.end()

    def _skip(self, mark: str) -> bool:
        self._blank()
        is_there = self._text.startswith(mark, self._at)
        self._at += is_there
        return is_there

    def _take(self, mark: str) -> None:
        if not self._skip(mark):
            raise self._error(f"expected {mark!r:.80}", self._at)

    def _error(self, words: str, at: int) -> json.JSONDecodeError:
        return json.JSONDecodeError(words, self._text, at)
