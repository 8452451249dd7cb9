"""Routes round corners: pairs near each other, where one missing node is a long way round."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import KDTree

import hybridnav as hn
from hybridnav.ext.graphs.attach import Network
from hybridnav.ext.graphs.bends import Corners, is_among
from hybridnav.ext.graphs.judge import FreeSpace


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


def test_a_robot_in_a_hall_is_near_a_node_and_leaves_by_the_nearest():
    # Two halls, and a passage in the middle of the wall between.
    cells = np.ones((102, 302), dtype=np.float32)
    cells[1:-1, 1:-1] = 0.0
    cells[1:40, 150] = cells[60:-1, 150] = 1.0
    grid = hn.OccupancyGrid(cells, hn.Frame(0.1), robot_radius_m=0.2)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=4.0))
    graph = hn.build_route_graph(topology)
    centres = np.argwhere(FreeSpace.of(grid).free) + 0.5
    away = np.asarray(KDTree(graph.positions).query(centres)[0])
    assert away.max() * 0.1 <= 1.0
    nearest = hn.judge_route_graph(graph, pairs=2000).nearest
    assert nearest.solved == 1.0
    assert nearest.mean <= 0.011
    assert nearest.greatest <= 0.15


def near_pairs(space: FreeSpace, count: int, reach: int) -> tuple[np.ndarray, np.ndarray]:
    """Random pairs of cells near each other that do not see each other, of one part."""
    rng = np.random.default_rng(99)
    cells = np.argwhere(space.free)
    starts = cells[rng.integers(len(cells), size=count)]
    goals = starts + rng.integers(-reach, reach + 1, size=(count, 2))
    inside = ((goals >= 0) & (goals < space.free.shape)).all(axis=1)
    starts, goals = starts[inside], goals[inside]
    centres = [np.asarray(end + 0.5, dtype=np.float64) for end in (starts, goals)]
    parts = [space.component_of[tuple(end.T)] for end in (starts, goals)]
    kept = (parts[0] == parts[1]) & ~space.sight.clear(*centres)
    return centres[0][kept], centres[1][kept]


@pytest.mark.parametrize(("seed", "reach"), [(0, 4), (1, 30), (3, 10)])
def test_pairs_near_each_other_have_short_routes_too(seed, reach):
    topology = floor(seed)
    graph = hn.build_route_graph(topology)
    space = FreeSpace.of(topology.grid)
    starts, goals = near_pairs(space, 30_000, reach)
    lengths = Network.of(space.sight, graph.positions, graph.edges).join(starts, goals).best()
    optimum = space.paths(starts, goals).length_cells
    excess = lengths / optimum - 1
    assert len(excess) > 50
    assert excess.max() <= 0.1
    assert excess.min() >= -1e-9


def test_pairs_round_corners_are_free_and_out_of_sight():
    # One wall that ends in the middle: the line between two ends crosses it.
    cells = np.zeros((30, 30), dtype=np.float32)
    cells[:20, 15] = 1.0
    space = FreeSpace.of(hn.OccupancyGrid(cells, robot_radius_m=0))
    corners = Corners.of(space.free)
    assert sorted(corners.positions.tolist()) == [[20.0, 15.0], [20.0, 16.0]]
    starts, goals, ways = corners.pairs(space, 200, np.random.default_rng(0), (0.7, 10.0))
    assert len(starts) > 50
    for start, goal, way in zip(starts, goals, ways, strict=True):
        assert cells[tuple(start.astype(int))] == cells[tuple(goal.astype(int))] == 0.0
        line = start + np.linspace(0, 1, 2001)[:, None] * (goal - start)
        assert cells[tuple(line.astype(int).T)].any() or np.isclose(line, (20, 15)).all(1).any()
        over = [np.hypot(*(start - at)) + np.hypot(*(goal - at)) for at in corners.positions]
        assert min(abs(np.array(over) - way)) < 1e-9


def test_corners_have_one_blocked_cell_of_four_on_the_named_side():
    free = np.random.default_rng(4).random((30, 40)) < 0.7
    corners = Corners.of(free)
    found = {}
    for row in range(1, 30):
        for col in range(1, 40):
            square = [(row + i, col + j) for i in (-1, 0) for j in (-1, 0)]
            blocked = [cell for cell in square if not free[cell]]
            if len(blocked) == 1:
                found[row, col] = tuple(2 * (blocked[0][k] + 0.5 - (row, col)[k]) for k in (0, 1))
    named = zip(corners.positions.tolist(), corners.blocked.tolist(), strict=True)
    assert {tuple(at): tuple(side) for at, side in named} == found
    assert is_among(corners.positions, corners.positions[3:]).tolist() == [False] * 3 + [True] * (
        len(found) - 3
    )


def test_no_node_lies_where_two_blocked_cells_meet():
    # Diagonal pairs of blocked cells, one cell off many corners: bends are moved there on a map of
    # 0.1 m, and both sides see the point, but nothing passes.
    rng = np.random.default_rng(5)
    cells = np.zeros((60, 60), dtype=np.float32)
    for row, col in rng.integers(2, 56, size=(90, 2)).tolist():
        cells[row, col] = cells[row + 1, col + 1] = 1.0
    grid = hn.OccupancyGrid(cells, hn.Frame(0.1), robot_radius_m=0)
    space = FreeSpace.of(grid)
    graph = hn.build_route_graph(
        hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))
    )
    assert (graph.positions % 1 > 0).all()
    assert not cells[tuple(graph.positions.astype(int).T)].any()
    starts, goals = near_pairs(space, 8_000, 6)
    lengths = Network.of(space.sight, graph.positions, graph.edges).join(starts, goals).best()
    optimum = space.paths(starts, goals).length_cells
    assert (lengths >= optimum * (1 - 1e-9)).all()
