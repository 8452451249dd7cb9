"""Features of a GeoJSON file for Nav2, of a graph that others have made."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.io.graph_json import MOST_ID

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav.graphs import WaypointGraph

_DEEPEST = 64
_LARGEST = 2**1023
"""Integers beyond have more digits than readers take."""


def features_of(graph: WaypointGraph, frame: str) -> list[dict[str, Any]]:
    """Return the features of a graph.

    Facts of a graph that is from Nav2 stay where they are; those of others go to `metadata`, with
    the id as `name`. Nothing is null and no number infinite: such facts are left out.

    Parameters
    ----------
    graph
        The graph.
    frame
        Name of the frame of nodes that state none.

    Raises
    ------
    InvalidValueError
        When a fact is nested deeper than 64 levels, as one that contains itself.
    """
    used: set[int] = set()
    nodes = _ids(graph.names, used)
    edges = _ids(graph.edge_names, used)
    is_own = graph.format == "nav2"
    features = []
    for node, point in enumerate(graph.points.tolist()):
        facts = _properties(graph.node_facts.get(node, {}), graph.names[node], is_own=is_own)
        geometry = {"type": "Point", "coordinates": point}
        features.append(_feature({"id": nodes[node], "frame": frame} | facts, geometry))
    points, costs = graph.points, graph.costs.tolist()
    for edge, (tail, head) in enumerate(graph.edges.tolist()):
        facts = _properties(graph.edge_facts.get(edge, {}), graph.edge_names[edge], is_own=is_own)
        ends = {"id": edges[edge], "startid": nodes[tail], "endid": nodes[head]}
        cost = {} if math.isnan(costs[edge]) else {"cost": costs[edge]}
        line = graph.lines.get(edge, points[[tail, head]])
        geometry = {"type": "LineString", "coordinates": line.tolist()}
        features.append(_feature(ends | cost | facts, geometry))
    return features + [_plain(other, 0) for other in graph.others]


def _feature(properties: dict[str, Any], geometry: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "properties": properties, "geometry": geometry}


def _ids(names: Sequence[int | str | None], used: set[int]) -> list[int]:
    """Return an id for each name, the name itself where it is an id that nothing else has."""
    ids: list[int] = []
    wanted = {name for name in names if isinstance(name, int) and 0 <= name <= MOST_ID}
    following = 0
    for name in names:
        if isinstance(name, int) and name in wanted and name not in used:
            chosen = name
        else:
            while following in used or following in wanted:
                following += 1
            chosen = following
        used.add(chosen)
        ids.append(chosen)
    return ids


def _properties(facts: dict[str, Any], name: int | str | None, *, is_own: bool) -> dict[str, Any]:
    plain: dict[str, Any] = _plain(facts, 0)
    if is_own:
        return plain
    known = {"name": name} if isinstance(name, str) else {}
    return {"metadata": known | plain} if known or plain else {}


def _plain(value: Any, depth: int) -> Any:
    """Return a value as JSON has it, None for what is left out."""
    if depth > _DEEPEST:
        raise InvalidValueError(
            f"a fact is nested more than {_DEEPEST} deep, or contains itself: leave it out"
        )
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    if isinstance(value, dict):
        items = ((str(key), _plain(item, depth + 1)) for key, item in value.items())
        return {key: item for key, item in items if item is not None}
    if isinstance(value, list | tuple):
        listed = (_plain(item, depth + 1) for item in value)
        return [item for item in listed if item is not None]
    if isinstance(value, bool | str) or value is None:
        return value
    if isinstance(value, int):
        return value if abs(value) < _LARGEST else None
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return str(value)
