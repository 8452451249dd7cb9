"""A reader of route graphs by the rules of Nav2's loader, and nothing of hybridnav's.

It follows `geojson_graph_file_loader.cpp` of nav2_route: what that loader refuses, or would read
otherwise than written, fails here. Above it asks what strict readers of GeoJSON ask.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

UNSIGNED = 2**32


@dataclass(frozen=True)
class Nav2Graph:
    """What Nav2 holds of a file: nodes by id, and directed edges by id."""

    frames: dict[int, str]
    points: dict[int, tuple[float, float]]
    node_facts: dict[int, dict[str, Any]]
    edges: dict[int, tuple[int, int]]
    costs: dict[int, float]
    edge_facts: dict[int, dict[str, Any]]
    lines: dict[int, list[tuple[float, float]]]

    def parts(self) -> list[set[int]]:
        """Sets of nodes that edges, taken in both directions, connect."""
        beside: dict[int, set[int]] = {node: set() for node in self.points}
        for tail, head in self.edges.values():
            beside[tail].add(head)
            beside[head].add(tail)
        parts, seen = [], set()
        for node in beside:
            if node in seen:
                continue
            part, waiting = {node}, [node]
            while waiting:
                new = beside[waiting.pop()] - part
                part |= new
                waiting += new
            seen |= part
            parts.append(part)
        return parts


def read_nav2(path: Path, *, costs: bool = True, lines: bool = True) -> Nav2Graph:
    """Read a file, or fail. Graphs of others may state no costs, and other lines."""
    whole = json.loads(path.read_text("utf-8"), parse_constant=_refuse)
    assert whole["type"] == "FeatureCollection"
    graph = Nav2Graph({}, {}, {}, {}, {}, {}, {})
    edges = []
    for feature in whole["features"]:
        assert feature["type"] == "Feature"
        kind = feature["geometry"]["type"]
        assert kind in {"Point", "LineString"}
        if kind == "Point":
            _read_node(graph, feature)
        else:
            edges.append(feature)
    assert graph.points, "Nav2 refuses a graph without nodes"
    assert edges, "Nav2 refuses a graph without edges"
    for feature in edges:
        _read_edge(graph, feature, costs=costs, lines=lines)
    return graph


def _read_node(graph: Nav2Graph, feature: dict[str, Any]) -> None:
    properties = feature["properties"]
    number = _id_of(properties["id"])
    assert number not in graph.points, "ids are unique"
    x, y = (_finite(value) for value in feature["geometry"]["coordinates"])
    graph.points[number] = x, y
    assert isinstance(properties["frame"], str)
    graph.frames[number] = properties["frame"]
    graph.node_facts[number] = _metadata(properties)


def _read_edge(graph: Nav2Graph, feature: dict[str, Any], *, costs: bool, lines: bool) -> None:
    properties = feature["properties"]
    number, tail, head = (_id_of(properties[key]) for key in ("id", "startid", "endid"))
    assert number not in graph.points, "ids are unique over nodes and edges"
    assert number not in graph.edges, "ids are unique"
    assert tail in graph.points
    assert head in graph.points
    line = [(_finite(x), _finite(y)) for x, y in feature["geometry"]["coordinates"]]
    assert len(line) >= 2, "a LineString has two positions or more"
    assert not lines or (line[0], line[-1]) == (graph.points[tail], graph.points[head])
    graph.edges[number] = tail, head
    if costs or "cost" in properties:
        graph.costs[number] = _finite(properties["cost"])
    graph.edge_facts[number] = _metadata(properties)
    graph.lines[number] = line


def _metadata(properties: dict[str, Any]) -> dict[str, Any]:
    facts = properties.get("metadata", {})
    assert isinstance(facts, dict)
    _check_facts(facts)
    return facts


def _check_facts(value: Any) -> None:
    """Nested values are Nav2's to read, null and what JSON has no number for are not."""
    for each in value.values() if isinstance(value, dict) else value:
        if isinstance(each, (dict, list)):
            _check_facts(each)
            continue
        assert isinstance(each, (bool, int, float, str)), "null stops Nav2's loader"
        assert not isinstance(each, float) or math.isfinite(each)


def _id_of(value: Any) -> int:
    assert isinstance(value, int)
    assert not isinstance(value, bool)
    assert 0 <= value < UNSIGNED
    return value


def _finite(value: Any) -> float:
    assert isinstance(value, (int, float))
    assert math.isfinite(value)
    return float(value)


def _refuse(text: str) -> None:
    raise AssertionError(f"{text} is no JSON")
