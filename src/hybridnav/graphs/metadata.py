"""Metadata of nodes and edges for files: what is known, and nothing that is null or infinite."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav.graphs.route_graph import RouteGraph


def node_metadata(graph: RouteGraph, node: int) -> dict[str, Any]:
    """Return what is known of a node: `class`, `room`, `door`."""
    door = int(graph.doors[node])
    return _known({"class": graph.kinds[node], "room": graph.rooms[node], "door": door or None})


def edge_metadata(graph: RouteGraph, chain: Sequence[int]) -> dict[str, Any]:
    """Return what is known of an edge, or of a chain of edges as one.

    Parameters
    ----------
    graph
        The graph.
    chain
        Indices of edges, in the order passed: the room is that of the middle one, doors are those
        of all, measures the least.

    Returns
    -------
    dict
        `class` (door or free), `room`, `door`, `doors`, `lane`, and in metres `width_m`,
        `clearance_m`, `left_m`, `right_m`.
    """
    edges = list(chain)
    doors = list(dict.fromkeys(door for edge in edges for door in graph.edge_doors[edge]))
    room = graph.edge_rooms[edges[len(edges) // 2]]
    known = _known({"class": "door" if doors else "free", "room": room})
    known |= {"door": doors[0], "doors": doors} if doors else {}
    known |= {"lane": "right"} if graph.is_lane[edges].any() else {}
    return known | _known(
        {
            "width_m": float(graph.widths_m[edges].min()),
            "clearance_m": float(graph.clearances_m[edges].min()),
            "left_m": float(graph.left_m[edges].min()),
            "right_m": float(graph.right_m[edges].min()),
        }
    )


def _known(values: dict[str, Any]) -> dict[str, Any]:
    """Return the values that are known and finite, measures in whole millimetres."""
    return {
        name: round(value, 3) if isinstance(value, float) else value
        for name, value in values.items()
        if value is not None and not (isinstance(value, float) and math.isinf(value))
    }
