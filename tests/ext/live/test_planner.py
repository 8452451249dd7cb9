"""A planner by the pyramid that follows the versions of an on-line one: its answers are those of a
planner made anew, and no version is made dense for them."""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.live import OnlinePyramid
from hybridnav.search.descent import Descent, DescentSettings
from tests.interrupts import Struck, lines_of
from tests.layers import layer_of
from tests.strategies import seeds, tried

KINDS = "plain", "unexplored", "costs", "corners", "windows off", "line of sight", "own places"


def drawn(rng: np.random.Generator) -> Any:
    """Occupancy of a map: open ground with some noise, or rooms."""
    rows, cols = rng.integers(3, 50, 2).tolist()
    values = (rng.random((rows, cols)) < rng.choice([0.0, 0.02, 0.15])).astype(np.float32)
    if rng.random() < 0.5:
        side = int(rng.integers(5, 15))
        values[::side], values[:, ::side] = 1, 1
        values[rng.random((rows, cols)) < 0.1] = 0
    values[rng.random((rows, cols)) < rng.choice([0.0, 0.1])] = np.nan
    return values


def with_change(values: Any, rng: np.random.Generator) -> Any:
    """The map with a box closed, opened or forgotten, or with cells here and there."""
    values, shape = values.copy(), np.array(values.shape)
    low = rng.integers(0, shape)
    high = np.minimum(low + rng.integers(1, 20, 2), shape)
    values[low[0] : high[0], low[1] : high[1]] = rng.choice([0, 1, np.nan])
    if rng.random() < 0.2:
        values[rng.random(values.shape) < 0.01] = rng.choice([0, 1])
    return values


def grid_of(values: Any, kind: str, radius_m: float) -> hn.OccupancyGrid:
    cutting = kind == "corners"
    return hn.OccupancyGrid(values, hn.Frame(0.1), robot_radius_m=radius_m, corner_cutting=cutting)


def preset_of(kind: str, rng: np.random.Generator) -> hn.Preset:
    keys = {"field_cells": rng.choice([1, 8, 40]), "step": rng.choice([2.0, 8.0])}
    keys["ring"] = rng.integers(2)
    keys["horizon_cells"] = 0 if kind == "windows off" else rng.choice([4, 128])
    if kind == "unexplored":
        keys["allow_unexplored"] = "true"
    if kind == "line of sight":
        keys["smooth"] = "line-of-sight"
    if kind == "own places":
        keys = {"levels": "places"}
    return hn.load_preset("paper", overrides=[f"planner.{k}={v}" for k, v in keys.items()])


def told(result: hn.PlanResult) -> tuple[Any, ...]:
    """All that two planners must agree on."""
    points = None if result.path is None else result.path.points.tolist()
    stats = result.stats
    effort = stats.expanded, stats.expanded_places, stats.corridor_cells
    ends = result.status, result.cost, result.lower_bound, effort
    return points, ends, None if result.route is None else result.route.places


@pytest.mark.parametrize("kind", KINDS)
@tried(25, seeds)
def test_plans_on_each_version_are_those_of_a_planner_made_anew(kind: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    values, radius_m = drawn(rng), float(rng.choice([0.0, 0.15]))
    grid, preset, costs = grid_of(values, kind, radius_m), preset_of(kind, rng), None
    if kind == "costs":
        costs = layer_of(rng.uniform(1, 6, grid.shape), rng.random(grid.shape) < 0.05)
    merge_m = float(rng.choice([0.3, 0.8, 3.0]))
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid, merge_distance_m=merge_m))
    planner = hn.HybridPlanner(hn.TopologicalMap(version), preset=preset, costs=costs)
    for turn in range(4):
        planner.prepare()
        for _ in range(rng.integers(1, 3)):
            values = with_change(values, rng)
            version = version.update(grid_of(values, kind, radius_m)).version
        if kind == "costs" and turn == 2:
            costs = layer_of(rng.uniform(1, 6, grid.shape), rng.random(grid.shape) < 0.05)
            planner.update(grid=version, costs=costs)
        else:
            planner.update(grid=version)
        fresh = hn.HybridPlanner(hn.TopologicalMap(version.pyramid), preset=preset, costs=costs)
        unexplored = kind == "unexplored"
        cells = np.argwhere(version.grid.enterable(allow_unexplored=unexplored))
        for _ in range(3 if len(cells) else 0):
            ends = version.grid.frame.points_of(rng.choice(cells, 2))
            shut = cells[rng.random(len(cells)) < rng.choice([0.0, 0.1])]
            blocked = {"cells": shut} if len(shut) else None
            results = [each.plan(*ends, blocked=blocked) for each in (planner, fresh)]
            assert told(results[0]) == told(results[1])


@tried(120, seeds)
def test_what_is_repaired_is_what_the_whole_pyramid_gives(seed: int) -> None:
    """All packed arrays, to the bit; small maps too often visit other levels after a change."""
    rng = np.random.default_rng(seed)
    values, unexplored, by_units = drawn(rng), bool(rng.random() < 0.3), bool(rng.random() < 0.3)
    how = DescentSettings(int(rng.choice([1, 4, 16])), float(rng.choice([1, 8])), 1, 8)
    limits = zip(
        ("MANY_PLACES", "MOST_AT_TOP", "MOST_BLOCKS"), rng.choice([0, 10, 1000], 3), strict=True
    )
    grid = grid_of(values, "", 0)
    merge_m = float(rng.choice([0.15, 0.8, 3.0]))
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid, merge_distance_m=merge_m))
    with pytest.MonkeyPatch.context() as patch:
        for name, limit in limits:
            patch.setattr(f"hybridnav.search.descent.{name}", int(limit))
        units: Any = rng.integers(4096, 9000, values.shape).astype(np.int32) if by_units else None
        free = grid.enterable(allow_unexplored=unexplored)
        descent = Descent(version.pyramid, free, how, units=units)
        for _ in range(4):
            values = with_change(values, rng)
            grid = grid_of(values, "", 0)
            free = grid.enterable(allow_unexplored=unexplored)
            now = version.update(grid).version
            found = now.patched(version, np.argwhere(version.grid.classes != grid.classes))
            fresh = Descent(now.pyramid, free, how, units=units)
            repaired = descent.changed(found, free, units) if found is not None else None
            if repaired is not None:
                for name, whole, part in zip(
                    fresh.fields._fields, fresh.fields, repaired.fields, strict=True
                ):
                    assert whole.dtype == part.dtype, name
                    assert np.array_equal(whole, part), name
                assert np.array_equal(fresh.field_of, repaired.field_of)
            version, descent = now, repaired or fresh


def rooms_of(side: int) -> Any:
    values = np.zeros((side, side), np.float32)
    values[::60], values[:, ::60] = 1, 1
    for at in range(6):  # doors
        values[30 + at :: 60, ::60] = values[::60, 20 + at :: 60] = 0
    return values


def test_no_version_is_made_dense_for_plans(monkeypatch: pytest.MonkeyPatch) -> None:
    values = rooms_of(240)
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid_of(values, "", 0.0)))
    planner = hn.HybridPlanner(hn.TopologicalMap(version), preset="paper")
    ends = (1.05, 1.05), (22.55, 22.55)
    before = planner.plan(*ends)
    values[80:100, 80:100] = 1
    now = version.update(grid_of(values, "", 0.0)).version
    with monkeypatch.context() as patch:

        def refuse(_self: object) -> None:
            raise AssertionError("made dense")

        patch.setattr(OnlinePyramid, "pyramid", property(refuse))
        patch.setattr("hybridnav.search.descent.lowest_of", refuse)
        planner.update(grid=now)
        result = planner.plan(*ends)
        assert result.settings["pyramid"] == before.settings["pyramid"]
        assert result.cost > 0
        assert result.gap >= 0
    fresh = hn.HybridPlanner(hn.TopologicalMap(now.pyramid), preset="paper")
    assert told(result) == told(fresh.plan(*ends))
    assert planner.topology.n_places == now.n_places


@pytest.mark.parametrize("preset", ["shortest", "octile", "grid-astar", "robot"])
def test_other_presets_take_a_version_with_its_places(preset: str) -> None:
    values = rooms_of(120)
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid_of(values, "", 0.0)))
    planner = hn.HybridPlanner(hn.TopologicalMap(version), preset=preset)
    ends = (1.05, 1.05), (11.55, 10.55)
    planner.plan(*ends)
    values[20:40, 20:40] = 1
    version = version.update(grid_of(values, "", 0.0)).version
    planner.update(grid=version, changed=(2.0, 2.0, 4.0, 4.0))
    fresh = hn.HybridPlanner(hn.TopologicalMap(version.pyramid), preset=preset).plan(*ends)
    result = planner.plan(*ends)
    assert result.cost == pytest.approx(fresh.cost)
    assert result.route is not None


def test_a_planner_of_a_build_is_made_anew_from_its_first_version() -> None:
    values = rooms_of(120)
    pyramid = hn.DualGraphPyramid.build(grid_of(values, "", 0.0))
    planner = hn.HybridPlanner(hn.TopologicalMap(pyramid), preset="paper")
    planner.prepare()
    values[20:40, 20:40] = 1
    version = OnlinePyramid.of(pyramid).update(grid_of(values, "", 0.0)).version
    planner.update(grid=version)
    ends = (1.05, 1.05), (11.55, 10.55)
    fresh = hn.HybridPlanner(hn.TopologicalMap(version.pyramid), preset="paper")
    assert told(planner.plan(*ends)) == told(fresh.plan(*ends))


def test_changes_that_no_update_of_the_version_stated_are_refused() -> None:
    values = rooms_of(120)
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid_of(values, "", 0.0)))
    planner = hn.HybridPlanner(hn.TopologicalMap(version), preset="paper")
    ends = (1.05, 1.05), (11.55, 10.55)
    before = told(planner.plan(*ends))
    values[20:40, 20:40] = 1
    values[90, 90] = 1
    stale = version.update(grid_of(values, "", 0.0), changed=(2.0, 2.0, 4.0, 4.0)).version
    with pytest.raises(hn.errors.InvalidValueError, match="1 cells changed outside what the up"):
        planner.update(grid=stale)
    assert told(planner.plan(*ends)) == before
    other = OnlinePyramid.of(hn.DualGraphPyramid.build(grid_of(rooms_of(180), "", 0.0)))
    with pytest.raises(hn.errors.InvalidValueError, match="a shape of cells"):
        planner.update(grid=other)
    assert told(planner.plan(*ends)) == before


def test_an_interrupted_update_leaves_the_version_before_or_now() -> None:
    values = rooms_of(120)
    version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid_of(values, "", 0.0)))
    values = values.copy()
    values[[30, 31, 32, 33, 34, 35], 60] = 1
    now = version.update(replace(version.grid, probability=values)).version
    ends = (1.05, 1.05), (11.55, 3.55)
    topology = hn.TopologicalMap(version)
    fresh = [hn.HybridPlanner(hn.TopologicalMap(each), preset="paper") for each in (version, now)]
    answers = [told(each.plan(*ends)) for each in fresh]
    assert answers[0] != answers[1]
    for turn in range(2):  # the first time loads more
        planner = hn.HybridPlanner(topology, preset="paper")
        planner.plan(*ends)
        count = lines_of(partial(planner.update, grid=now))
        assert told(planner.plan(*ends)) == answers[1], turn
    for strike_at in np.linspace(1, count, 30).astype(int).tolist():
        planner = hn.HybridPlanner(topology, preset="paper")
        planner.plan(*ends)
        with pytest.raises(Struck):
            lines_of(partial(planner.update, grid=now), strike_at=strike_at)
        assert told(planner.plan(*ends)) in answers
        planner.update(grid=now)
        assert told(planner.plan(*ends)) == answers[1]


@pytest.mark.parametrize("merge_m", [1.6, 0.1])
def test_a_map_that_closes_whole_and_opens_again_is_followed(merge_m: float) -> None:
    free = np.zeros((12, 12), np.float32)
    ends = (0.05, 0.05), (1.15, 1.15)
    built = hn.DualGraphPyramid.build(grid_of(free, "", 0.0), merge_distance_m=merge_m)
    version = OnlinePyramid.of(built)
    preset = hn.load_preset("paper", overrides=["planner.field_cells=4"])
    planner = hn.HybridPlanner(hn.TopologicalMap(version), preset=preset)
    open_m = planner.plan(*ends).cost
    for values in (free + 1, free):
        version = version.update(grid_of(values, "", 0.0)).version
        planner.update(grid=version)
        result = planner.plan(*ends)
        assert result.solved is not bool(values[0, 0])
    assert result.cost == open_m
