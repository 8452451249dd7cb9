"""Every public function and command that plans: by costs as scipy's Dijkstra, or a refusal.

Whatever plans stands in one of the lists below, and a test compares them with what is public: so a
function that is new has to choose.
"""

import inspect
import json
import re
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
import pytest
from PIL import Image

import hybridnav as hn
from hybridnav import viz
from hybridnav.harness import RunSettings, load_study, write_records
from hybridnav.maps.costs import cost_along
from tests.floors import random_floor
from tests.harness.small_runs import run_here
from tests.layers import grid_of, layer_of
from tests.oracle.grid import assert_legal, distances, move_graph, weighted

HONOUR = {"grid-astar": True, "paper": False, "robot": False}
"""Presets that plan by costs, and whether their paths of cells are the cheapest."""
REFUSE = {"shortest", "octile", "ompl"}
COMMANDS = {"plan", "build", "evaluate", "view", "judge"}
"""Commands that make a planner."""
NO_PLANNER = {"show", "rooms", "compare", "preset", "map", "replay", "explore", "export", "check"}
NO_PLANNER |= {"closed", "serve", "verify"}  # `serve` plans shortest paths alone
RADIUS_M = 0.25
CLEARANCE = "clearance:multiplier=4"


class Scene(NamedTuple):
    """A map with rooms, the costs of its cells, and the weighted graph of scipy."""

    name: str
    topology: hn.TopologicalMap
    layer: hn.CostLayer
    graph: Any
    pairs: list[tuple[tuple[int, int], tuple[int, int]]]

    @property
    def grid(self) -> hn.OccupancyGrid:
        return self.topology.grid

    def points(self, pair: Any) -> Any:
        return self.grid.frame.points_of(list(pair))

    def least_m(self, pair: Any, shut: Any = None) -> float:
        """The cost of a cheapest path of cells, round some cells."""
        graph = self.graph
        if shut is not None:
            is_open = self.grid.enterable()
            is_open[tuple(np.transpose(shut))] = False
            graph = weighted(move_graph(is_open), self.layer.factors.astype(float))
        costs = distances(graph, self.grid.shape, pair[0])
        return float(costs[pair[1]]) * self.grid.resolution_m

    def check(self, found: Any, pair: Any, *, cheapest: bool, shut: Any = None) -> None:
        """A result, alternative or tour of one plan against the weighted optimum."""
        result = found if isinstance(found, hn.PlanResult) else found.results[0]
        least_m = self.least_m(pair, shut)
        assert result.solved == np.isfinite(least_m)
        if result.path is None:
            return
        if result.metric == "weighted":
            assert_legal(result.path.cells, self.grid.enterable())
        along = cost_along(self.grid, self.layer, result.path.points)
        assert result.cost == pytest.approx(along, rel=1e-6)
        assert result.lower_bound <= result.cost * (1 + 1e-9)
        if result.metric == "weighted":
            assert result.cost >= least_m * (1 - 1e-9)
            assert result.lower_bound <= least_m * (1 + 1e-9)
            if cheapest:
                assert result.cost == pytest.approx(least_m, rel=1e-9)
                assert result.gap == pytest.approx(0, abs=1e-9)
        else:
            assert result.metric == "any-angle-weighted"
            assert result.lower_bound <= least_m * (1 + 1e-9)
            if cheapest:
                assert result.cost <= least_m * (1 + 1e-9)


def scene_of(name: str, topology: hn.TopologicalMap, layer: hn.CostLayer) -> Scene:
    rng = np.random.default_rng(3)
    free = np.argwhere(topology.grid.enterable())
    pairs = []
    for row, col, to_row, to_col in (
        free[rng.integers(len(free), size=(3, 2))].reshape(3, 4).tolist()
    ):
        pairs.append(((row, col), (to_row, to_col)))
    graph = weighted(move_graph(topology.grid.enterable()), layer.factors.astype(float))
    return Scene(name, topology, layer, graph, pairs)


@pytest.fixture(scope="module", params=["floor", "office"])
def scene(request: Any) -> Scene:
    if request.param == "floor":
        floor = random_floor(np.random.default_rng(8))
        topology = floor.topology
        factors = np.random.default_rng(1).choice([1.0, 1.5, 6.0], topology.grid.shape)
        return scene_of("floor", topology, layer_of(factors))
    grid = hn.example_map("office", robot_radius_m=RADIUS_M)
    labels = np.full(grid.shape, -1, np.int32)
    labels[:, : grid.shape[1] // 2], labels[:, grid.shape[1] // 2 :] = 0, 1
    rooms = hn.RoomLabels(("west", "east"), np.where(grid.enterable(), labels, -1))
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    return scene_of("office", topology, hn.CostLayer.clearance(grid, multiplier=4.0))


def preset_of(name: str) -> hn.Preset:
    """A preset that plans paths of cells by the given costs alone."""
    overrides = ["planner.smooth=none", "planner.costs=null"] if name == "robot" else []
    return hn.load_preset(name, overrides=overrides)


def planner_of(scene: Scene, preset: str) -> hn.HybridPlanner:
    return hn.HybridPlanner(scene.topology, preset=preset_of(preset), costs=scene.layer)


# --- functions ----------------------------------------------------------------------------------


def plan(scene: Scene, preset: str, _tmp: Any) -> None:
    planner = planner_of(scene, preset)
    for smooth in ("none", "line-of-sight"):
        for pair in scene.pairs:
            result = planner.plan(*scene.points(pair), smooth=smooth)
            scene.check(result, pair, cheapest=HONOUR[preset])


def plan_blocked(scene: Scene, preset: str, _tmp: Any) -> None:
    planner = planner_of(scene, preset)
    for pair in scene.pairs:
        first = planner.plan(*scene.points(pair))
        if first.path is None or len(first.path.cells) < 20:
            continue
        shut = first.path.cells[len(first.path.cells) // 2][None]
        again = planner.plan(*scene.points(pair), blocked={"cells": shut})
        scene.check(again, pair, cheapest=HONOUR[preset], shut=shut)


def plan_many(scene: Scene, preset: str, _tmp: Any) -> None:
    points = np.array([scene.points(pair) for pair in scene.pairs])
    batch = planner_of(scene, preset).plan_many(points[:, 0], points[:, 1])
    for number, pair in enumerate(scene.pairs):
        least_m = scene.least_m(pair)
        assert (batch.status[number] == "solved") == np.isfinite(least_m)
        if np.isfinite(least_m):
            if preset != "robot":  # whose paths are none of cells
                assert batch.cost[number] >= least_m * (1 - 1e-9)
            assert batch.lower_bound[number] <= least_m * (1 + 1e-9)
            if HONOUR[preset]:
                assert batch.cost[number] == pytest.approx(least_m, rel=1e-9)


def plan_tour(scene: Scene, preset: str, _tmp: Any) -> None:
    planner = planner_of(scene, preset)
    for pair in scene.pairs:
        points = scene.points(pair)
        tour = hn.plan_tour(planner, [points[0], points[1], points[0]])
        if tour.solved:
            assert tour.cost == pytest.approx(sum(part.cost for part in tour.results))
            scene.check(tour.results[0], pair, cheapest=HONOUR[preset])
            scene.check(tour.results[1], pair[::-1], cheapest=HONOUR[preset])


def named_rooms(scene: Scene, preset: str, _tmp: Any) -> None:
    rooms = scene.topology.pyramid.rooms
    name = rooms.names[-1]
    inside = (rooms.label_of == len(rooms.names) - 1) & scene.grid.enterable()
    start = scene.pairs[0][0]
    result = planner_of(scene, preset).plan(scene.points([start, start])[0], name)
    costs = distances(scene.graph, scene.grid.shape, start)[inside]
    least_m = float(costs.min()) * scene.grid.resolution_m
    assert result.solved == np.isfinite(least_m)
    if result.path is not None:
        assert result.lower_bound <= least_m * (1 + 1e-9)
        if HONOUR[preset]:
            assert result.cost == pytest.approx(least_m, rel=1e-9)


def plan_alternatives(scene: Scene, preset: str, _tmp: Any) -> None:
    planner = planner_of(scene, preset)
    for pair in scene.pairs:
        points = scene.points(pair)
        found = hn.plan_alternatives(planner, points[0], points[1], 2)
        assert bool(found) == np.isfinite(scene.least_m(pair))
        for number, other in enumerate(found):
            scene.check(other.tour, pair, cheapest=HONOUR[preset] and not number)


def model(scene: Scene, preset: str, tmp: Any) -> None:
    planner = planner_of(scene, preset)
    hn.save(planner, tmp / "kept.hnm")
    kept = hn.load(tmp / "kept.hnm").planner(preset_of(preset), costs=scene.layer)
    for pair in scene.pairs:
        result = kept.plan(*scene.points(pair))
        scene.check(result, pair, cheapest=HONOUR[preset])
        assert result.cost == planner.plan(*scene.points(pair)).cost


def pictures(scene: Scene, preset: str, _tmp: Any) -> None:
    planner = planner_of(scene, preset)
    pair = next(pair for pair in scene.pairs if np.isfinite(scene.least_m(pair)))
    points = scene.points(pair)
    result = planner.plan(*points)
    cost = f"cost {result.cost:.1f} m"
    assert cost in viz.plot_plan(scene.topology, result).get_title()
    tour = hn.plan_tour(planner, [*points])
    assert cost in viz.plot_tour(scene.topology, tour).get_title()
    found = hn.plan_alternatives(planner, points[0], points[1], 1)
    legend = viz.plot_alternatives(scene.topology, found).get_legend()
    texts = "" if legend is None else " ".join(text.get_text() for text in legend.get_texts())
    assert f"cost {result.cost:.2f} m" in texts


FUNCTIONS = (
    plan,
    plan_blocked,
    plan_many,
    plan_tour,
    named_rooms,
    plan_alternatives,
    model,
    pictures,
)


@pytest.mark.parametrize("preset", HONOUR)
@pytest.mark.parametrize("function", FUNCTIONS)
def test_each_function_plans_by_costs_as_scipy_does(scene, function, preset, tmp_path):
    function(scene, preset, tmp_path)


def test_all_that_plans_is_in_a_list(cli: Any) -> None:
    tested = {function.__name__ for function in FUNCTIONS}
    public = {name for name in hn.__all__ if name.startswith("plan")}
    methods = {name for name, _ in inspect.getmembers(hn.HybridPlanner) if name.startswith("plan")}
    assert public | methods == {name for name in tested if name.startswith("plan")} - {
        "plan_blocked"
    }
    assert set(hn.preset_names()) == HONOUR.keys() | REFUSE
    listed = re.findall(r"^    ([a-z]+)  +\S", cli("--help").out, flags=re.MULTILINE)
    assert set(listed) == COMMANDS | NO_PLANNER


# --- the command line and the harness -----------------------------------------------------------


def pgm(scene: Scene, folder: Any) -> Any:
    """The map as a file: its free cells alone."""
    pixels = np.where(scene.grid.enterable()[::-1], 254, 0).astype(np.uint8)
    Image.fromarray(pixels).save(folder / "map.pgm")
    path = folder / "map.yaml"
    path.write_text(
        f"image: map.pgm\nresolution: {scene.grid.resolution_m}\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return path


@pytest.mark.parametrize("preset", HONOUR)
def test_the_commands_plan_and_judge_by_costs(scene, preset, cli, tmp_path, monkeypatch):
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)
    path = pgm(scene, tmp_path)
    grid = hn.load_map(path, robot_radius_m=0)
    layer = hn.CostLayer.clearance(grid, multiplier=4.0)
    graph = weighted(move_graph(grid.enterable()), layer.factors.astype(float))
    for pair in scene.pairs:
        points = grid.frame.points_of(list(pair))
        ends = [f"{x!r},{y!r}" for x, y in points.tolist()]
        query = ("plan", path, f"--start={ends[0]}", f"--goal={ends[1]}", "--robot-radius", "0")
        done = cli(*query, "--preset", preset, "--costs", CLEARANCE, "--smooth", "none", "--json")
        least_m = distances(graph, grid.shape, pair[0])[pair[1]] * grid.resolution_m
        assert done.code == (0 if np.isfinite(least_m) else 1)
        if np.isfinite(least_m):
            cost_m, bound_m = (json.loads(done.out)[name] for name in ("cost", "lower_bound"))
            assert bound_m <= least_m * (1 + 1e-9)
            if HONOUR[preset]:
                assert cost_m == pytest.approx(least_m, rel=1e-9)
    run = RunSettings(maps=(str(path),), presets=(preset,), pairs=2, costs=(CLEARANCE,))
    write_records(replace(run, robot_radius_m=0.0), tmp_path / "run")
    study = load_study(tmp_path / "run")
    assert study.faults == []
    assert study.checks
    for record in study.outcomes[0].records:
        if record["status"] == "solved":
            costs = distances(graph, grid.shape, tuple(record["start"])) * grid.resolution_m
            assert record["weighted_m"] == pytest.approx(costs[tuple(record["goal"])], rel=1e-9)


@pytest.mark.parametrize("preset", sorted(REFUSE))
def test_presets_that_know_lengths_only_refuse_in_one_line(preset: str, cli: Any) -> None:
    layer = layer_of(np.ones((3, 4)))
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(grid_of(np.zeros((3, 4)), robot_radius_m=0))
    )
    with pytest.raises(hn.errors.InvalidValueError, match="knows lengths only") as refused:
        hn.HybridPlanner(topology, preset=preset, costs=layer)
    assert f"preset {preset} cannot plan by costs: method " in str(refused.value)
    assert "with grid-astar and" in str(refused.value)
    assert "\n" not in str(refused.value)
    with pytest.raises(hn.errors.PresetError, match=r"planner\.costs: no key of method"):
        hn.load_preset(preset, overrides=["planner.costs.clearance={}"])
    query = ("plan", "maps/figure1/figure1.yaml", "--start", "0.5,0.5", "--goal", "2,2.5")
    done = cli(*query, "--robot-radius", "0", "--preset", preset, "--costs", "clearance")
    assert done.refuses(2, "planner.costs: no key of method")
