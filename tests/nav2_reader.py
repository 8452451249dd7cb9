"""A reader of route graphs by the rules of Nav2's loader and scorers, and nothing of hybridnav's.

Transcribed from nav2_route 1.5.0 (ros-navigation/navigation2, main of August 2026; 1.3.13 of Jazzy
and 1.4.2 of Kilted have the same rules), in `nav2_route/src/plugins`:

* `graph_file_loaders/geojson_graph_file_loader.cpp`, with what nlohmann/json converts;
* `edge_cost_functions/*_scorer.cpp`, which take metadata by `any_cast` (`types.hpp`);
* `route_operation_client.hpp`, and `route_planner.cpp` for costs that are not overridable.

What these refuse, or would hold otherwise than written, fails here. Above it asks what strict
readers of GeoJSON ask.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

UNSIGNED = 2**32
SCORED = {  # parameter -> default key: distance_, time_ (both) and penalty_scorer.cpp
    "DistanceScorer.speed_tag": "speed_limit",  # adjust_speed_limit.cpp reads it too
    "TimeScorer.speed_tag": "abs_speed_limit",
    "TimeScorer.time_tag": "abs_time_taken",
    "PenaltyScorer.penalty_tag": "penalty",
}


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
    whole = json.loads(path.read_text("utf-8"), parse_constant=_refuse, parse_float=_number)
    json.dumps(whole, ensure_ascii=False).encode()  # nlohmann refuses half a surrogate pair
    assert whole["type"] == "FeatureCollection"
    graph = Nav2Graph({}, {}, {}, {}, {}, {}, {})
    edges = []
    for feature in whole["features"]:
        assert feature["type"] == "Feature"
        kind = feature["geometry"]["type"]  # a const operator[]: a geometry of null throws
        if kind == "Point":
            _read_node(graph, feature)
        elif kind in {"LineString", "MultiLineString"}:
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
    _check_operations(properties)
    _score_class(graph.node_facts[number])


def _read_edge(graph: Nav2Graph, feature: dict[str, Any], *, costs: bool, lines: bool) -> None:
    properties = feature["properties"]
    number, tail, head = (_id_of(properties[key]) for key in ("id", "startid", "endid"))
    assert number not in graph.points, "ids are unique over nodes and edges"
    assert number not in graph.edges, "ids are unique"
    assert tail in graph.points, "NoValidGraph: start id does not exist"
    assert head in graph.points, "NoValidGraph: end id does not exist"
    line = feature["geometry"]["coordinates"]
    if line and isinstance(line[0][0], list):
        line = [point for part in line for point in part]
    line = [(_finite(x), _finite(y)) for x, y in line]
    assert len(line) >= 2, "a LineString has two positions or more"
    assert not lines or (line[0], line[-1]) == (graph.points[tail], graph.points[head])
    graph.edges[number] = tail, head
    if costs or "cost" in properties:
        graph.costs[number] = _finite(properties["cost"])
    overridable = properties.get("overridable", True)
    assert isinstance(overridable, bool), "type_error.302: type must be boolean"
    assert overridable or properties.get("cost", 0) > 0, "NoValidGraph at planning"
    facts = graph.edge_facts[number] = _metadata(properties)
    graph.lines[number] = line
    _check_operations(properties)
    _score_class(facts)
    for key in SCORED.values():
        assert isinstance(facts.get(key, 1.0), float), f"bad any_cast<float>: {key}"
    assert facts.get("speed_limit", 1.0) > 0, "DistanceScorer divides by it"


def _score_class(facts: dict[str, Any]) -> None:
    assert isinstance(facts.get("class", ""), str), "bad any_cast<std::string> in SemanticScorer"


def _check_operations(properties: dict[str, Any]) -> None:
    """An operation is an object with a text and a trigger; `SERIALIZE_ENUM` makes NODE of words
    that it does not know, which reads otherwise than written."""
    given = properties.get("operations", [])
    for operation in given.values() if isinstance(given, dict) else given:
        assert isinstance(operation["type"], str)
        assert operation["trigger"] in {"NODE", "ON_ENTER", "ON_EXIT"}
        facts = _metadata(operation)
        assert isinstance(facts.get("service_name", ""), str), "bad any_cast<std::string>"


def _metadata(properties: dict[str, Any]) -> dict[str, Any]:
    """`convertMetaDataFromJson`: objects nest; a list holds plain values; null throws."""
    facts = properties.get("metadata", {})
    if isinstance(facts, list):  # items() has its numbers as keys; objects in it are lost
        facts = {str(at): each for at, each in enumerate(facts) if not isinstance(each, dict)}
    elif not isinstance(facts, dict):  # items() of a plain value is that value, without a key
        facts = {"": facts}
    _check_facts(facts)
    return facts


def _check_facts(facts: dict[str, Any]) -> None:
    for each in facts.values():
        if isinstance(each, dict):
            _check_facts(each)
        else:
            for one in each if isinstance(each, list) else [each]:
                _check_plain(one)


def _check_plain(value: Any) -> None:
    """`setPrimitiveType`: unsigned int, int, float, bool or text, or it throws."""
    assert isinstance(value, (bool, int, float, str)), f"Failed to convert {value!r}"
    if isinstance(value, int):
        assert -(2**31) <= value < UNSIGNED, "held in 32 bits: becomes another number"


def _id_of(value: Any) -> int:
    assert isinstance(value, int)
    assert not isinstance(value, bool)
    assert 0 <= value < UNSIGNED
    return value


def _finite(value: Any) -> float:
    assert isinstance(value, (int, float))
    assert math.isfinite(value)
    return float(value)


def _number(text: str) -> float:
    assert math.isfinite(float(text)), "out_of_range.406: number overflow"
    return float(text)


def _refuse(text: str) -> None:
    raise AssertionError(f"{text} is no JSON")
