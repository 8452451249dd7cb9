"""Writers of graph files, independent of hybridnav: by the libraries' own writers, or by hand."""

import json
from dataclasses import dataclass, field
from typing import Any

import networkx as nx
import yaml


@dataclass
class Plain:
    """A graph as a test draws it."""

    points: dict[Any, Any] = field(default_factory=dict)
    """Node to (x, y)."""
    edges: list[Any] = field(default_factory=list)
    """(tail, head), each once."""
    facts: dict[str, Any] = field(default_factory=dict)
    """A nested value that belongs to every node and edge."""

    @property
    def directed(self):
        graph: nx.DiGraph[Any] = nx.DiGraph(name="drawn")
        for node, (x, y) in self.points.items():
            graph.add_node(node, x=x, y=y)
        graph.add_edges_from(self.edges)
        return graph


def write_nav2(path, plain):
    ids = {node: number for number, node in enumerate(plain.points)}
    features = [
        {
            "type": "Feature",
            "properties": {"id": ids[node], "frame": "map", "metadata": plain.facts},
            "geometry": {"type": "Point", "coordinates": point},
        }
        for node, point in plain.points.items()
    ]
    operation = {"type": "go", "trigger": "ON_EXIT"}
    for number, (tail, head) in enumerate(plain.edges, start=len(ids)):
        line = [plain.points[tail], plain.points[head]]
        kind = "MultiLineString" if number % 2 else "LineString"
        properties = {"id": number, "startid": ids[tail], "endid": ids[head], "cost": number / 7}
        features.append(
            {
                "type": "Feature",
                "properties": properties
                | {"operations": {"go": operation | {"metadata": plain.facts}}},
                "geometry": {"type": kind, "coordinates": [line] if number % 2 else line},
            }
        )
    path.write_text(json.dumps({"type": "FeatureCollection", "features": features}))
    return ids


def _strands_nodes(plain):
    turn = {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0}
    return [
        {
            "meta": {"pointset": "drawn"},
            "node": {
                "name": node,
                "pose": {"position": {"x": x, "y": y, "z": 0.0}, "orientation": turn},
                "properties": plain.facts,
                "edges": [
                    {"action": "move_base", "edge_id": f"{at}", "node": head, "goal": plain.facts}
                    for at, (tail, head) in enumerate(plain.edges)
                    if tail == node
                ],
            },
        }
        for node, (x, y) in plain.points.items()
    ]


def write_strands(path, plain):
    path.write_text(yaml.safe_dump(_strands_nodes(plain), allow_unicode=True), "utf-8")


def write_tmap2(path, plain):
    # One object in many places: the dumper writes anchors and aliases, as LCAS's files have them.
    whole = {"name": "drawn", "metric_map": "drawn", "nodes": _strands_nodes(plain)}
    path.write_text(yaml.safe_dump(whole, allow_unicode=True), "utf-8")


def write_text(path, plain):
    lines = []
    for node, (x, y) in plain.points.items():
        lines += ["node: ", f"\t{node}", "\twaypoint:", f"\t\t{x!r},{y!r},0.0,0.0,0.0,0.0,1.0"]
        lines += ["\tedges:"]
        lines += [f"\t\t {head}, move_base" for tail, head in plain.edges if tail == node]
        lines += ["\tvertices:", "\t\t0.690000,0.287000", "\t\t-0.287000,0.690000"]
    path.write_text("\n".join(lines) + "\n", "utf-8")


def write_graphml(path, plain):
    nx.write_graphml(plain.directed, path)


def write_node_link(path, plain):
    path.write_text(json.dumps(nx.node_link_data(plain.directed, edges="links")))


def write_gml(path, plain):
    nx.write_gml(plain.directed, path)
