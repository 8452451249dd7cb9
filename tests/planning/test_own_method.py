"""Methods of the user's own, `method: module:Class`, in presets."""

import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.search.found import Found
from hybridnav.search.grid_search import GridSearch

START, GOAL = (0.5, 0.5), (2.0, 2.5)


class ByCells:
    """Grid A*, with nothing of `Method` but what is needed."""

    metric = "octile"

    def __init__(
        self,
        grid: hn.OccupancyGrid,
        *,
        costs: Any = None,
        allow_unexplored: bool = False,
        stretch: float = 1.0,
    ) -> None:
        assert costs is None
        self._search = GridSearch(grid.enterable(allow_unexplored=allow_unexplored))
        self._resolution_m, self._stretch = grid.resolution_m, stretch
        self.n_prepared, self.frame = 0, grid.frame

    def prepare(self) -> None:
        self.n_prepared += 1

    def find(self, query: Any) -> Any:
        found = self._search.search(*query.cells)
        if found.cells is None:
            return Found(None)
        steps = np.abs(np.diff(found.cells, axis=0)).sum(axis=1)
        length_m = float(np.sqrt(steps).sum()) * self._resolution_m * self._stretch
        return Found(found.cells, length_m, query.straight_m)


class Faulty:
    """Answers whatever it is told to."""

    metric = "octile"
    answer: Any = None

    def __init__(self, *given: Any, **keywords: Any) -> None:
        pass

    def find(self, _query: Any) -> Any:
        return self.answer


class NoMetric(Faulty):
    """Has a metric that there is none of."""

    metric = "fast"


class NeedsMore:
    """Takes no costs."""

    def __init__(self, grid: hn.OccupancyGrid) -> None:
        pass


@pytest.fixture(scope="module")
def topology() -> hn.TopologicalMap:
    return hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))


@pytest.fixture(autouse=True)
def _module(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mine", sys.modules[__name__])


def planner_of(topology: hn.TopologicalMap, name: str, *overrides: str) -> hn.HybridPlanner:
    preset = hn.load_preset("paper", overrides=[f"planner.method=mine:{name}", *overrides])
    return hn.HybridPlanner(topology, preset=preset)


def test_a_preset_plans_by_the_method_that_it_names(topology: hn.TopologicalMap) -> None:
    planner = planner_of(topology, "ByCells")
    planner.prepare()
    result, best = planner.plan(START, GOAL), hn.HybridPlanner(topology, preset="grid-astar")
    assert result.solved
    assert result.metric == "octile"
    assert result.cost == pytest.approx(best.plan(START, GOAL).cost)
    assert result.lower_bound == pytest.approx(np.hypot(1.5, 2.0))
    assert result.route is not None
    assert planner.plan(START, GOAL, smooth="line-of-sight").metric == "any-angle"
    assert planner.plan_many([START], [GOAL]).cost[0] == result.cost
    liar = planner_of(topology, "ByCells", "planner.settings.stretch=2.0")
    for ask in (liar.plan, liar.distance):
        with pytest.raises(hn.errors.PresetError, match=r"find returned 5.* m for a path of 2"):
            ask(START, GOAL)


def test_closed_cells_are_kept_to_whatever_the_method_does(topology: hn.TopologicalMap) -> None:
    planner = planner_of(topology, "ByCells")
    open_path = planner.plan(START, GOAL).path
    middle = open_path.cells[len(open_path.cells) // 2]
    closed = {"cells": [tuple(map(int, middle))]}
    around = planner.plan(START, GOAL, blocked=closed)
    exact = hn.HybridPlanner(topology, preset="grid-astar").plan(START, GOAL, blocked=closed)
    assert around.status is exact.status
    assert around.cost == pytest.approx(exact.cost)
    assert around.path is None or not (around.path.cells == middle).all(axis=1).any()


def test_a_changed_map_makes_the_method_anew() -> None:
    grid = hn.OccupancyGrid(np.zeros((9, 9), np.float32), robot_radius_m=0)
    walled = np.zeros((9, 9), np.float32)
    walled[4] = 1
    planner = planner_of(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), "ByCells")
    assert planner.plan((0.5, 0.5), (0.5, 8.5)).solved
    planner.update(grid=hn.OccupancyGrid(walled, robot_radius_m=0))
    assert planner.plan((0.5, 0.5), (0.5, 8.5)).status is hn.PlanStatus.NO_PATH


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("Missing", "module mine has nothing of that name, expected a class Missing"),
        ("planner_of", "module mine has a function, expected a class planner_of"),
        ("NoMetric", "its metric is 'fast', expected one of octile, weighted, any-angle"),
        ("NeedsMore", "it makes no method of the map, TypeError: "),
    ],
)
def test_a_class_that_is_no_method_is_refused_when_a_planner_is_made(topology, name, message):
    with pytest.raises(hn.errors.PresetError) as caught:
        planner_of(topology, name)
    assert str(caught.value).startswith(f"planner.method: mine:{name}: {message}")


@pytest.mark.parametrize(
    ("answer", "shown"),
    [
        (None, "a NoneType"),
        (np.zeros((2, 2)), "a ndarray"),
        (Found(np.array([[0, 0], [1, 1]]), 1.0, 1.0), "a path from (0, 0) to (1, 1)"),
    ],
)
def test_an_answer_that_is_none_is_refused(topology, answer, shown, monkeypatch):
    monkeypatch.setattr(Faulty, "answer", answer)
    with pytest.raises(hn.errors.PresetError) as caught:
        planner_of(topology, "Faulty").plan(START, GOAL)
    assert str(caught.value).startswith(f"planner.method: mine:Faulty: find returned {shown}, exp")


@pytest.mark.parametrize("metric", ["octile", "any-angle"])
def test_a_path_without_a_bound_is_not_called_optimal(topology, metric, monkeypatch):
    found = hn.HybridPlanner(topology, preset="grid-astar").plan(START, GOAL)
    length_m = found.path.length_m
    answer = Found(found.path.cells, length_m, 0.0, found.path.points)
    monkeypatch.setattr(Faulty, "answer", answer)
    monkeypatch.setattr(Faulty, "metric", metric)
    planner = planner_of(topology, "Faulty")
    result = planner.plan(START, GOAL)
    assert result.lower_bound == pytest.approx(math.dist(*found.path.points[[0, -1]]))
    assert result.gap == pytest.approx(length_m / result.lower_bound - 1)
    monkeypatch.setattr(Faulty, "answer", replace(answer, lower_bound_m=math.inf))  # not stated
    with pytest.raises(hn.errors.PresetError, match="a path whose lower_bound_m is inf, expected"):
        planner.plan(START, GOAL)


def test_costs_do_not_go_with_a_method_that_is_not_known(topology: hn.TopologicalMap) -> None:
    preset = hn.load_preset("paper", overrides=["planner.method=mine:ByCells"])
    layer = hn.CostLayer(np.ones(topology.grid.shape, np.float32))
    with pytest.raises(
        hn.errors.InvalidValueError, match="cannot plan by costs: method mine:ByCells"
    ):
        hn.HybridPlanner(topology, preset=preset, costs=layer)


def test_a_path_at_any_angle_through_closed_cells_is_refused(topology, monkeypatch):
    monkeypatch.setattr(ByCells, "metric", "any-angle")
    planner = planner_of(topology, "ByCells")
    path = planner.plan(START, GOAL).path
    cell = tuple(map(int, path.cells[len(path.cells) // 2]))
    with pytest.raises(hn.errors.PresetError, match="a path through closed cells"):
        planner.plan(START, GOAL, blocked={"cells": [cell]})


@pytest.fixture
def preset_file(tmp_path: Path) -> Path:
    file = tmp_path / "own.yaml"
    file.write_text("planner: {method: 'mine:ByCells', settings: {stretch: 1.5}}\n")
    return file


def test_a_file_names_a_method_and_its_settings(preset_file: Path) -> None:
    preset = hn.load_preset(preset_file)
    assert (preset.planner.method, preset.planner.settings) == ("mine:ByCells", {"stretch": 1.5})
    again = preset_file.with_name("again.yaml")
    again.write_text(preset.to_yaml())
    assert hn.load_preset(again).planner == preset.planner
    with pytest.raises(
        hn.errors.PresetError, match=r"planner\.method: should be a class of your own"
    ):
        hn.load_preset("paper", overrides=["planner.method='a b:C'"])
