"""Values of wrong types, in one line, and the robot's radius, which no map lacks by accident."""

import copy
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.worlds import figure1_world
from hybridnav.ext.live import OnlinePyramid, carry_costs
from hybridnav.harness.judges import CheapestCost
from hybridnav.maps.cells import DEFAULT_ROBOT_RADIUS_M
from hybridnav.maps.files import load_movingai_map, load_ros_map
from tests.layers import layer_of

GRID = hn.OccupancyGrid(np.zeros((3, 5), np.float32), robot_radius_m=0)
PYRAMID = hn.DualGraphPyramid.build(GRID)
TOPOLOGY = hn.TopologicalMap(PYRAMID)
ONLINE: Any = OnlinePyramid.of(PYRAMID)
JUDGE: Any = CheapestCost(GRID)
JUDGES: Any = CheapestCost
PLANNERS: Any = hn.HybridPlanner
BUILD: Any = hn.graphs
MAPS: Any = hn
CARRY: Any = carry_costs
GRAPH = hn.graphs.build_lane_graph(TOPOLOGY)

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
    "graph is": lambda: BUILD.judge_route_graph("graph"),
    "graph is None": lambda: BUILD.export_nav2(None, "graph.geojson"),
    "pairs is 1000": lambda: BUILD.judge_route_graph(GRAPH, pairs=10**20),
    "topology is None": lambda: BUILD.build_lane_graph(None),
    "spacing_m is nan": lambda: BUILD.build_lane_graph(TOPOLOGY, spacing_m=np.nan),
    "grid is 'office'": lambda: MAPS.write_movingai_map("office", "office.map"),
    "before is None": lambda: CARRY(layer_of(np.ones((3, 5))), None, GRID),
    "costs is": lambda: PLANNERS(TOPOLOGY, preset="robot", costs=np.ones((3, 5))),
}


@pytest.mark.parametrize("words", CALLS)
def test_a_value_of_a_wrong_type_ends_in_one_line(words: str) -> None:
    with pytest.raises(hn.errors.InvalidValueError, match=words) as refused:
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


FIGURE1 = Path(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"
PILLAR = np.zeros((9, 9), np.float32)
PILLAR[4, 4] = 1.0


def arrays(**radius: Any) -> hn.OccupancyGrid:
    return hn.OccupancyGrid(PILLAR, hn.Frame(0.1), **radius)


def files(**radius: Any) -> hn.OccupancyGrid:
    return hn.load_map(FIGURE1, **radius)


def ros_files(**radius: Any) -> hn.OccupancyGrid:
    return load_ros_map(FIGURE1, **radius)


def worlds(**radius: Any) -> hn.OccupancyGrid:
    return figure1_world().grid(**radius)


@pytest.mark.parametrize("make", [arrays, files, ros_files, worlds])
def test_who_gives_no_radius_gets_a_robot_and_who_gives_0_a_point(make):
    for grid in (make(), make(robot_radius_m=None)):
        assert grid.robot_radius_m == DEFAULT_ROBOT_RADIUS_M == 0.25
        assert grid.radius_is_default
        assert grid.class_counts()["blocked"] > 0
        np.testing.assert_array_equal(grid.classes, make(robot_radius_m=0.25).classes)
    point = make(robot_radius_m=0)
    assert point.robot_radius_m == 0.0
    assert not point.radius_is_default
    assert point.class_counts()["blocked"] == 0


def test_on_a_movingai_map_the_default_blocks_occupied_cells_alone(tmp_path: Path) -> None:
    path = tmp_path / "a.map"
    path.write_text("type octile\nheight 2\nwidth 3\nmap\n.@.\n...\n")
    grid = load_movingai_map(path)
    assert grid.robot_radius_m == DEFAULT_ROBOT_RADIUS_M
    np.testing.assert_array_equal(grid.classes, load_movingai_map(path, robot_radius_m=0.0).classes)


def test_presets_and_maps_share_the_default() -> None:
    for name in hn.preset_names():
        assert hn.load_preset(name).pyramid.robot_radius_m == DEFAULT_ROBOT_RADIUS_M
    assert hn.Preset().pyramid.robot_radius_m == DEFAULT_ROBOT_RADIUS_M


def test_changing_something_else_does_not_make_the_default_a_choice() -> None:
    grid = arrays()
    for changed in (replace(grid, corner_cutting=True), copy.deepcopy(grid)):
        assert changed.radius_is_default
    assert not replace(grid, robot_radius_m=0.3).radius_is_default
    chosen = replace(grid, robot_radius_m=DEFAULT_ROBOT_RADIUS_M, radius_is_default=False)
    assert not chosen.radius_is_default
    assert not replace(arrays(robot_radius_m=0.25), name="b").radius_is_default


def map_of(grid: hn.OccupancyGrid) -> hn.TopologicalMap:
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid))


def test_a_preset_for_another_robot_is_refused_unless_the_radius_was_given() -> None:
    wide = hn.load_preset("paper", overrides=["pyramid.robot_radius_m=0.15"])
    with pytest.raises(hn.errors.InvalidValueError) as error:
        hn.HybridPlanner(map_of(arrays()), preset=wide)
    message = str(error.value)
    assert "0.15 m" in message
    assert "0.25 m" in message
    assert "robot_radius_m=0.15" in message
    assert "\n" not in message
    for radius_m in (0.15, 0.25, 0.0):
        grid = arrays(robot_radius_m=radius_m)
        result = hn.HybridPlanner(map_of(grid), preset=wide).plan((0.05, 0.05), (0.85, 0.85))
        assert result.solved
        assert result.settings["pyramid"]["robot_radius_m"] == radius_m


def test_a_forgotten_radius_plans_for_a_robot_of_the_presets_size() -> None:
    result = hn.HybridPlanner(map_of(arrays())).plan((0.05, 0.05), (0.85, 0.85))
    assert result.settings["pyramid"]["robot_radius_m"] == 0.25
    pillar = np.array([0.45, 0.45])
    assert np.hypot(*(result.path.points - pillar).T).min() > 0.25
