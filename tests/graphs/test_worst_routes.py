"""Routes round corners: pairs near each other, where one missing node is a long way round."""

from __future__ import annotations

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.graphs.attach import Network
from hybridnav.graphs.space import FreeSpace, pairs_round_corners


def floor(seed: int) -> hn.TopologicalMap:
    """8 x 8 m with boxes of 0.3 to 1.5 m and walls of one cell between which rooms lie."""
    rng = np.random.default_rng(seed)
    cells = np.zeros((80, 80), dtype=np.float32)
    for row, col in rng.integers(4, 64, size=(8, 2)).tolist():
        height, width = rng.integers(3, 16, size=2).tolist()
        cells[row : row + height, col : col + width] = 1.0
    cells[:60, 40] = cells[30, 10:70] = 1.0
    grid = hn.OccupancyGrid(cells, hn.Frame(0.1), robot_radius_m=0.1)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_no_route_is_a_tenth_longer_than_the_shortest_path(seed):
    graph = hn.build_route_graph(floor(seed))
    report = hn.judge_route_graph(graph, pairs=1500)
    assert report.best.solved == 1.0
    assert report.best.mean <= 0.02
    assert report.best.greatest <= 0.1
    assert report.nearest.solved == 1.0


def test_pairs_round_a_corner_have_short_routes_too():
    topology = floor(0)
    graph = hn.build_route_graph(topology)
    space = FreeSpace.of(topology.grid)
    starts, goals = pairs_round_corners(space, (20, 0), np.random.default_rng(99), (1.5, 30.0))
    lengths = Network.of(space.sight, graph.positions, graph.edges).join(starts, goals).best()
    optimum = space.paths(starts, goals).length_cells
    excess = lengths / optimum - 1
    assert len(excess) > 100
    assert np.quantile(excess, 0.99) <= 0.1


def test_pairs_round_corners_are_free_and_out_of_sight():
    # One wall that ends in the middle: the line between two ends crosses it.
    cells = np.zeros((30, 30), dtype=np.float32)
    cells[:20, 15] = 1.0
    space = FreeSpace.of(hn.OccupancyGrid(cells, robot_radius_m=0))
    starts, goals = pairs_round_corners(space, (400, 0), np.random.default_rng(0), (1.0, 10.0))
    assert len(starts) > 50
    for start, goal in zip(starts, goals, strict=True):
        assert cells[tuple(start.astype(int))] == cells[tuple(goal.astype(int))] == 0.0
        line = start + np.linspace(0, 1, 2001)[:, None] * (goal - start)
        assert cells[tuple(line.astype(int).T)].any() or np.isclose(line, (20, 15)).all(1).any()
