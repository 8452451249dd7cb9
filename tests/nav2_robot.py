"""What a robot with Nav2 makes of a bundle, by Nav2's rules, and nothing of hybridnav's.

It follows `map_io.cpp` of nav2_map_server, the costmap filters of nav2_costmap_2d, and the scorers
and operations of nav2_route: what these refuse, or stop at, fails here.
"""

import json
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

ON_GRAPH = {"nav2_route::TriggerEvent"}
"""Operations that a graph may name; others act on their own, and one named there is unknown."""
OTHER_OPERATIONS = {"nav2_route::AdjustSpeedLimit", "nav2_route::ReroutingService"}


@dataclass(frozen=True)
class Mask:
    """A filter mask as it is published: -1 for unknown."""

    data: np.ndarray
    resolution: float
    origin: tuple[float, float]

    @classmethod
    def load(cls, path: Path) -> "Mask":
        """Read a map in the mode raw: values up to 100 stay, others become unknown."""
        stated = yaml.safe_load(path.read_text())
        assert stated["mode"] == "raw"
        assert {"image", "resolution", "origin", "free_thresh", "occupied_thresh"} <= set(stated)
        assert stated["negate"] in {0, 1}
        x, y, yaw = stated["origin"]
        assert yaw == 0, "costmap filters do not read the yaw"
        magic, size, white, pixels = (path.parent / stated["image"]).read_bytes().split(b"\n", 3)
        assert (magic, white) == (b"P5", b"255")
        cols, rows = map(int, size.split())
        shade = np.frombuffer(pixels, np.uint8).reshape(rows, cols)[::-1] / 255
        value = np.round(shade * 255)
        return cls(np.where(value <= 100, value, -1).astype(int), stated["resolution"], (x, y))

    def at(self, x: float, y: float) -> int | None:
        """Return the value at a pose, None outside."""
        if x < self.origin[0] or y < self.origin[1]:
            return None
        col, row = (
            int((p - o) / self.resolution) for p, o in zip((x, y), self.origin, strict=True)
        )
        inside = row < self.data.shape[0] and col < self.data.shape[1]
        return int(self.data[row, col]) if inside else None


class ZoneFilter:
    """`ZoneParameterFilter`, by its parameters."""

    def __init__(self, parameters: dict[str, Any], mask: Mask) -> None:
        self.mask, self.state = mask, 0
        self.names = {}
        for name in parameters.get("states", []):
            number = parameters[name]["id"]
            assert isinstance(number, int)
            assert 0 < number <= 255
            self.names[number] = name

    def process(self, x: float, y: float) -> int:
        """Return the state at a pose: it stays on unknown cells, and is 0 outside."""
        value = self.mask.at(x, y)
        if value is None:
            self.state = 0
        elif value >= 0:
            assert value == 0 or value in self.names, f"unknown state {value} encountered"
            self.state = value
        return self.state


def speed_limit(mask: Mask, info: dict[str, Any], x: float, y: float) -> float | None:
    """Return the limit of `SpeedFilter` at a pose, None for none."""
    value = mask.at(x, y)
    assert value != -1, "an unknown cell is an error of this filter"
    if not value:
        return None
    limit = value * info["multiplier"] + info["base"]
    return limit if limit >= 0 and (limit <= 100 or info["type"] == 2) else None


def is_lethal(mask: Mask, x: float, y: float) -> bool:
    """Return whether `KeepoutFilter` closes a cell to the centre of the robot."""
    value = mask.at(x, y)
    return value is not None and value >= 0 and round(2.54 * value) >= 253


def as_float(metadata: dict[str, Any], key: str, default: float) -> float:
    """Return a value as a scorer casts it: an integer is a bad cast, which stops the server."""
    value = metadata.get(key, default)
    assert isinstance(value, float), f"bad any_cast of {key}: {value!r}"
    return value


def score(parameters: dict[str, Any], edge: dict[str, Any], tail: Any, head: Any) -> float:
    """Return the cost of an edge: the sum over the scorers that are named.

    Nodes are pairs of a point and metadata.
    """
    length = math.dist(tail[0], head[0])
    total = 0.0
    for name in parameters["edge_cost_functions"]:
        own = parameters[name]
        weight = own.get("weight", 1.0)
        assert isinstance(weight, float), "a parameter of another type is refused"
        if own["plugin"] == "nav2_route::DistanceScorer":
            tag = own.get("speed_tag", "speed_limit")
            total += weight * length / as_float(edge, tag, 1.0)
        elif own["plugin"] == "nav2_route::TimeScorer":
            speed = as_float(edge, own.get("speed_tag", "abs_speed_limit"), 0.0)
            total += weight * length / (speed if speed > 0 else own.get("max_vel", 0.5))
        elif own["plugin"] == "nav2_route::PenaltyScorer":
            total += weight * as_float(edge, own.get("penalty_tag", "penalty"), 0.0)
        elif own["plugin"] == "nav2_route::SemanticScorer":
            costs = {each: own[each] for each in own["semantic_classes"]}
            assert all(isinstance(cost, float) for cost in costs.values())
            for facts in (head[1], edge):
                found = facts.get(own.get("semantic_key", "class"), "")
                assert isinstance(found, str)
                total += weight * costs.get(found, 0.0)
        else:
            assert own["plugin"] == "nav2_route::DynamicEdgesScorer"  # nothing is closed
    return total


def called(parameters: dict[str, Any], operations: list[dict[str, Any]], trigger: str) -> list[str]:
    """Return the services that are called for operations of an edge or node at an event."""
    plugins = {name: parameters[name] for name in parameters["operations"]}
    assert {one["plugin"] for one in plugins.values()} <= ON_GRAPH | OTHER_OPERATIONS
    known = {name: one for name, one in plugins.items() if one["plugin"] in ON_GRAPH}
    found = []
    for operation in operations:
        assert operation["trigger"] in {"NODE", "ON_ENTER", "ON_EXIT"}
        if operation["trigger"] == trigger:
            assert operation["type"] in known, "does not exist in route operations loaded"
            name = operation["metadata"].get("service_name", "")
            assert isinstance(name, str)
            name = name or known[operation["type"]].get("service_name", "")
            assert name, "needs a service"
            assert re.fullmatch(r"(/[A-Za-z][A-Za-z0-9]*(_[A-Za-z0-9]+)*)+", name), "no name in ROS"
            assert len(name) <= 255 - 8, "longer than RMW_TOPIC_MAX_NAME_LENGTH"
            found.append(name)
    return found


def read_bundle(folder: Path) -> tuple[dict[str, Any], list[Any], dict[int, Any]]:
    """Return the parameters, the edges (properties) and the nodes (point, metadata) of a bundle."""
    parameters = yaml.safe_load((folder / "nav2_params.yaml").read_text())
    server = parameters["route_server"]["ros__parameters"]
    assert server[server["graph_file_loader"]]["plugin"] == "nav2_route::GeoJsonGraphFileLoader"
    features = json.loads(Path(server["graph_filepath"]).read_text())["features"]
    nodes = {
        each["properties"]["id"]: (
            each["geometry"]["coordinates"],
            each["properties"].get("metadata", {}),
        )
        for each in features
        if each["geometry"]["type"] == "Point"
    }
    edges = [each["properties"] for each in features if each["geometry"]["type"] != "Point"]
    return parameters, edges, nodes
