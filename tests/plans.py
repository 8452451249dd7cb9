"""Small maps and points for tests of every preset that plans on the grid."""

from typing import Any

import numpy as np
import pytest
from hypothesis import settings

import hybridnav as hn
from tests.strategies import Scene, drawn, examples

PRESETS = ("paper", "grid-astar", "octile")
PLAIN = settings(max_examples=examples(25), deadline=None, derandomize=True)
TWO_ROOMS = drawn(
    ".......#.......",
    "...............",
    ".......#.......",
    ".......#.......",
    ".......#.......",
    ".......#.......",
    ".......#.......",
    "...............",
    ".......#.......",
)
presets = pytest.mark.parametrize("preset", PRESETS)


def map_of(grid: hn.OccupancyGrid, **build: Any) -> hn.TopologicalMap:
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, **build))


def grid_of(classes: Any, *, corner_cutting: bool = False) -> hn.OccupancyGrid:
    """A grid of a few centimetres, turned and away from the origin."""
    probability = np.where(classes == 2, 0.5, classes == 0).astype(np.float32)
    frame = hn.Frame(0.05, origin_m=(3.1, -20.4), yaw_rad=0.7)
    return hn.OccupancyGrid(probability, frame, corner_cutting=corner_cutting, robot_radius_m=0)


def scene_map(scene: Scene, *, corner_cutting: bool = False) -> hn.TopologicalMap:
    grid = grid_of(scene.classes, corner_cutting=corner_cutting)
    distance_m = scene.merge_distance_m / scene.resolution_m * 0.05
    return map_of(grid, merge_distance_m=distance_m, seed=scene.seed)


def points_in(grid: hn.OccupancyGrid, rng: np.random.Generator, n: int) -> Any:
    """Pairs of points, shape (n, 2, 2), anywhere in cells that are free."""
    cells = np.argwhere(grid.enterable())
    chosen = cells[rng.integers(len(cells), size=2 * n)] if len(cells) else cells
    inside = rng.uniform(0.02, 0.98, size=(len(chosen), 2))
    return grid.frame.points_of_grid(chosen + inside).reshape(-1, 2, 2)


def answer(result: hn.PlanResult) -> tuple[Any, ...]:
    """What two equal results share."""
    points = None if result.path is None else result.path.points.tolist()
    return result.status, result.metric, result.cost, result.lower_bound, points
