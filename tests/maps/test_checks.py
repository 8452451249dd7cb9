"""Values of wrong types: one line that names what was given, what was expected, what to do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.live import OnlinePyramid, carry_costs
from hybridnav.harness.judges import CheapestCost
from hybridnav.search.overlay import OverlayOptions, prepare_overlay
from tests.layers import layer_of

if TYPE_CHECKING:
    from collections.abc import Callable

GRID = hn.OccupancyGrid(np.zeros((3, 5), np.float32), robot_radius_m=0)
PYRAMID = hn.DualGraphPyramid.build(GRID)
TOPOLOGY = hn.TopologicalMap(PYRAMID)
ONLINE: Any = OnlinePyramid.of(PYRAMID)
JUDGE: Any = CheapestCost(GRID)
JUDGES: Any = CheapestCost
OPTIONS: Any = OverlayOptions
PREPARE: Any = prepare_overlay
PLANNERS: Any = hn.HybridPlanner
BUILD: Any = hn
CARRY: Any = carry_costs
GRAPH = hn.build_route_graph(TOPOLOGY)

CALLS: dict[str, Callable[[], object]] = {
    "grid is": lambda: JUDGES("office"),
    "layer is": lambda: JUDGES(GRID, np.ones((3, 5))),
    "start is": lambda: JUDGE.cost_m("a", (0, 0)),
    "goal is": lambda: JUDGE.cost_m((0, 0), (0.5, 1)),
    r"start is cell \(-1, 0\)": lambda: JUDGE.cost_m((-1, 0), (0, 0)),
    "pyramid is": lambda: OnlinePyramid.of(GRID),  # type: ignore[arg-type]
    "grid is None": lambda: ONLINE.update(None),
    "cell is": lambda: ONLINE.place_at((1.5, 2)),
    "cell is None": lambda: ONLINE.place_at(None),
    "no place 'hall'": lambda: ONLINE.receptive_field("hall"),
    "no place None": lambda: ONLINE.receptive_field(None),
    "no place 1.5": lambda: ONLINE.receptive_field(1.5),
    "field_cells": lambda: OPTIONS(field_cells=None),
    "region_cells": lambda: OPTIONS(region_cells="many"),
    "top_bytes_per_cell": lambda: OPTIONS(top_bytes_per_cell="all"),
    "options is": lambda: PREPARE(TOPOLOGY, options=300),
    "topology is": lambda: PREPARE(GRID),
    "graph is": lambda: BUILD.judge_route_graph("graph"),
    "graph is None": lambda: BUILD.export_nav2(None, "graph.geojson"),
    "pairs is 1000": lambda: BUILD.judge_route_graph(GRAPH, pairs=10**20),
    "topology is None": lambda: BUILD.build_route_graph(None),
    "nodes is 'many'": lambda: BUILD.build_route_graph(TOPOLOGY, nodes="many"),
    "spacing_m is nan": lambda: BUILD.build_route_graph(TOPOLOGY, spacing_m=np.nan),
    "grid is 'office'": lambda: BUILD.write_movingai_map("office", "office.map"),
    "before is None": lambda: CARRY(layer_of(np.ones((3, 5))), None, GRID),
    "costs is": lambda: PLANNERS(TOPOLOGY, preset="robot", costs=np.ones((3, 5))),
}


@pytest.mark.parametrize("words", CALLS)
def test_a_value_of_a_wrong_type_ends_in_one_line(words: str) -> None:
    with pytest.raises(hn.InvalidValueError, match=words) as refused:
        CALLS[words]()
    text = str(refused.value)
    assert "\n" not in text
    assert "expected" in text
    assert ": " in text


def test_numbers_of_numpy_are_cells() -> None:
    cell: Any = (np.int64(0), np.int32(1))
    assert JUDGE.cost_m(cell, (0, 2)) == 1.0
    assert ONLINE.place_at(cell) == 0
    assert CheapestCost(GRID, layer_of(np.full((3, 5), 2.0))).cost_m(cell, (0, 2)) == 2.0
