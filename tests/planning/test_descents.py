"""Random small maps: answers of `paper` down the levels, against Dijkstra's algorithm of scipy."""

import math
from typing import Any

import numpy as np
import pytest
from scipy import ndimage

import hybridnav as hn
from hybridnav.ext.live import OnlinePyramid
from hybridnav.search import descent
from tests.oracle.grid import assert_legal, counted, distances, move_graph, weighted
from tests.strategies import examples

PAIRS = 3
"""Pairs of cells that each map is asked for, before and after its change."""


def random_occupancy(rng: np.random.Generator) -> Any:
    """Occupancy of noise, blobs or rooms, NaN where nothing is known."""
    rows, cols = rng.integers(2, 34, 2).tolist()
    kind = rng.integers(3)
    if kind == 0:
        occupied = rng.random((rows, cols)) < rng.uniform(0, 0.45)
    elif kind == 1:
        smooth = ndimage.uniform_filter(rng.random((rows, cols)), int(rng.integers(2, 5)))
        occupied = smooth < np.quantile(smooth, rng.uniform(0.0, 0.45))
    else:
        side = int(rng.integers(3, 9))
        occupied = (np.indices((rows, cols)) % side == 0).any(axis=0)
        occupied &= rng.random((rows, cols)) < rng.uniform(0.6, 1.0)
    values = occupied.astype(np.float32)
    values[rng.random((rows, cols)) < rng.choice([0.0, 0.0, 0.1, 0.3])] = np.nan
    return values


def told(result: hn.PlanResult) -> tuple[Any, ...]:
    """All of an answer, points and effort too."""
    stats, points = result.stats, result.path and result.path.points.tolist()
    effort = stats.expanded, stats.expanded_places, stats.corridor_cells
    return result.status, result.cost, result.lower_bound, points, effort


class Scene:
    """A random map whose planner answers, before and after changes."""

    def __init__(self, seed: int) -> None:
        self.rng = rng = np.random.default_rng(seed)
        self.values, self.cuts = random_occupancy(rng), bool(rng.random() < 0.2)
        pyramid = self.pyramid()
        self.version = OnlinePyramid.of(pyramid) if rng.random() < 0.5 else None
        self.unexplored, by_costs = bool(rng.random() < 0.3), rng.random() < 0.2
        shape = self.values.shape
        self.factors = rng.integers(4, 13, shape) / 4 if by_costs else np.ones(shape)
        self.always = (rng.random(shape) < 0.1) & by_costs
        self.costs = hn.CostLayer(self.factors, closed=self.always) if by_costs else None
        keys = {
            "allow_unexplored": str(self.unexplored).lower(),
            "field_cells": rng.choice([1, 4, 16, 128]),
            "step": rng.choice([1.0, 2.0, 8.0]),
            "ring": rng.integers(3),
            "horizon_cells": rng.choice([0, 1, 3, 8, 128]),
            "levels": rng.choice(["descent", "descent", "places"]),
        }
        overrides = [f"planner.{key}={value}" for key, value in keys.items()]
        self.preset = hn.load_preset("paper", overrides=overrides)
        self.planner = self.planner_of(self.version or pyramid)
        self.anew: hn.HybridPlanner | None = None
        """One that must answer alike, where the places follow a changed map."""

    def grid(self) -> hn.OccupancyGrid:
        frame = hn.Frame(0.1)
        return hn.OccupancyGrid(self.values, frame, robot_radius_m=0, corner_cutting=self.cuts)

    def pyramid(self) -> hn.DualGraphPyramid:
        merge_m = float(self.rng.choice([0.15, 0.3, 0.8, 3.0]))
        return hn.DualGraphPyramid.build(self.grid(), merge_distance_m=merge_m)

    def planner_of(self, places: Any) -> hn.HybridPlanner:
        topology = hn.TopologicalMap(places)
        return hn.HybridPlanner(topology, preset=self.preset, costs=self.costs)

    def change(self) -> None:
        """Fill or clear a rectangle."""
        corners = self.rng.integers(0, np.array(self.values.shape) + 1, (2, 2))
        low, high = np.sort(corners, axis=0)
        self.values = self.values.copy()
        self.values[low[0] : high[0], low[1] : high[1]] = self.rng.choice([0.0, 1.0])
        if self.version is None:
            self.planner.update(topology=hn.TopologicalMap(self.pyramid()))
            return
        self.version = self.version.update(self.grid()).version
        self.planner.update(grid=self.version)
        self.anew = self.planner_of(self.version.pyramid)

    def ask(self) -> int:
        """Ask for some pairs, judge the answers, and return how many were asked for."""
        grid, asked = self.planner.grid, 0
        is_open = grid.enterable(allow_unexplored=self.unexplored) & ~self.always
        for _ in range(PAIRS):
            shut = self.rng.random(is_open.shape) < self.rng.choice([0.0, 0.0, 0.05, 0.2])
            if not (is_open & ~shut).any():
                continue
            ends = self.rng.choice(np.argwhere(is_open & ~shut), 2)
            closed = {"cells": np.argwhere(shut & is_open)} if shut.any() else None
            points = grid.frame.points_of(ends)
            result = self.planner.plan(*points, blocked=closed)
            self.judge(result, is_open & ~shut, ends)
            if self.anew is not None:
                assert told(result) == told(self.anew.plan(*points, blocked=closed))
            asked += 1
        return asked

    def judge(self, result: hn.PlanResult, is_open: Any, ends: Any) -> None:
        """A path is there if one is, is legal, has its cost and its bound the optimum."""
        sides = np.ones_like(is_open) if self.cuts else is_open
        graph = weighted(move_graph(sides, is_open), self.factors)
        least = 0.1 * distances(graph, is_open.shape, tuple(ends[0]))[tuple(ends[1])]
        assert result.solved is math.isfinite(least)
        if result.path is None:
            return
        cells = result.path.cells
        assert cells[[0, -1]].tolist() == ends.tolist()
        assert_legal(cells, sides, is_open)
        cost = 0.1 * counted(cells, self.factors)
        assert result.cost == pytest.approx(cost, rel=1e-6, abs=1e-9)
        assert result.lower_bound == pytest.approx(least, rel=1e-9, abs=1e-12)
        assert result.lower_bound <= cost * (1 + 1e-12)
        assert least <= cost * (1 + 1e-6)


def test_no_answer_down_the_levels_is_wrong(monkeypatch: pytest.MonkeyPatch) -> None:
    """On half of the maps the places follow the map: then all is as in a planner made anew."""
    asked, n_maps = 0, examples(120)
    for seed in range(n_maps):
        rng = np.random.default_rng([seed, 1])
        limits = int(rng.choice([0, 1000])), *rng.choice([2, 10, 1000], 2).tolist()
        for name, limit in zip(("MANY_PLACES", "MOST_AT_TOP", "MOST_BLOCKS"), limits, strict=True):
            monkeypatch.setattr(descent, name, limit)
        scene = Scene(seed)
        for turn in range(2 if scene.version is None else 5):
            if turn:
                scene.change()
            asked += scene.ask()
    assert asked > 5 * n_maps
