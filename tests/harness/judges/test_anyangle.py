"""Any-angle paths: known answers, bounds, symmetry, and brute force over all lattice corners."""

import csv
import math
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import assume
from hypothesis import strategies as st

from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges import ScipyOptimum, VisibilityGraph, segment_faults
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.files import load_map
from tests.oracle.grid import length_of_points
from tests.strategies import class_grids, drawn, framed, occupancy_grid, seeds, tried

Cell = tuple[int, int]

yaws = st.sampled_from([0.0, 0.7])


def two_cells(classes: Any, seed: int) -> tuple[Cell, Cell]:
    """Two free cells, drawn anew for each seed."""
    free = np.argwhere(classes == CellClass.FREE)
    assume(len(free))
    (a, b), (c, d) = np.random.default_rng(seed).choice(free, 2).tolist()
    return (a, b), (c, d)


def brute_force(grid: OccupancyGrid, start: Cell, goal: Cell) -> float:
    """Length of a shortest path over all corners of all cells, whatever lies at them.

    At a corner where two blocked cells meet no path may turn from one free cell to the other:
    such corners are left out, no shortest path bends there.
    """
    free = np.pad(grid.classes == CellClass.FREE, 1)
    endpoints = [(row + 0.5, col + 0.5) for row, col in (start, goal)]
    corners = [
        (float(row), float(col))
        for row, col in np.ndindex(grid.shape[0] + 1, grid.shape[1] + 1)
        if free[row : row + 2, col : col + 2].any() and not _pinched(free, row, col)
    ]
    nodes = [*endpoints, *corners]
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(range(len(nodes)))
    for i, one in enumerate(nodes):
        for j in range(i):
            if not segment_faults(grid, grid.frame.points_of_grid([one, nodes[j]])):
                graph.add_edge(i, j, weight=math.dist(one, nodes[j]) * grid.resolution_m)
    try:
        return float(nx.dijkstra_path_length(graph, 0, 1))
    except nx.NetworkXNoPath:
        return math.inf


def _pinched(free: Any, row: int, col: int) -> bool:
    (a, b), (c, d) = free[row : row + 2, col : col + 2].tolist()
    return bool(a == d and b == c and a != b)


@tried(150, class_grids(max_side=12), seeds, yaws)
def test_optimum_lies_between_the_straight_line_and_the_grid_optimum(classes, seed, yaw_rad):
    start, goal = two_cells(classes, seed)
    grid = framed(classes, yaw_rad)
    octile_m = ScipyOptimum(grid).lengths_from(start)[goal]
    graph = VisibilityGraph(grid)
    found, back = graph.shortest(start, goal), graph.shortest(goal, start)
    assert found.length_m == pytest.approx(back.length_m, rel=1e-12)
    if found.points is None:
        assert math.isinf(found.length_m)
        assert math.isinf(octile_m)
        return
    assert math.dist(start, goal) * 0.05 <= found.length_m + 1e-12
    assert found.length_m <= octile_m + 1e-12
    assert not segment_faults(grid, found.points)
    assert length_of_points(found.points) == pytest.approx(found.length_m, abs=1e-9)
    np.testing.assert_allclose(found.points[0], grid.frame.points_of(start))
    np.testing.assert_allclose(found.points[-1], grid.frame.points_of(goal))


@tried(40, class_grids(max_side=5), seeds)
def test_no_path_over_any_lattice_corners_is_shorter(classes: Any, seed: int) -> None:
    start, goal = two_cells(classes, seed)
    grid = occupancy_grid(classes)
    expected = brute_force(grid, start, goal)
    assert VisibilityGraph(grid).shortest(start, goal).length_m == pytest.approx(
        expected, rel=1e-12
    )


ONE_SQUARE = np.ones((12, 12), np.uint8)
ONE_SQUARE[3:9, 3:9] = CellClass.OCCUPIED


@pytest.mark.parametrize(
    ("start", "goal", "length"),
    [
        ((0, 0), (0, 11), 11.0),
        ((0, 0), (11, 11), math.hypot(2.5, 8.5) + math.hypot(8.5, 2.5)),
        ((5, 0), (5, 11), 2 * math.hypot(2.5, 2.5) + 6.0),
        ((2, 2), (9, 9), 2 * math.hypot(0.5, 6.5)),
        ((4, 4), (0, 0), math.inf),
        ((7, 1), (7, 1), 0.0),
    ],
)
def test_one_square_obstacle_has_the_known_shortest_paths(start, goal, length):
    found = VisibilityGraph(framed(ONE_SQUARE)).shortest(start, goal)
    assert found.length_m == pytest.approx(length * 0.05, rel=1e-12)


def test_no_path_squeezes_between_two_cells_that_meet_at_a_corner() -> None:
    grid = occupancy_grid(drawn("....", ".#..", "..#.", "...."))
    found = VisibilityGraph(grid).shortest((1, 1), (2, 2))
    # By the outer corners (1, 2), (1, 3) and (2, 3) of the lower of the two blocked cells.
    assert found.length_m == pytest.approx(2 * math.hypot(0.5, 0.5) + 2, rel=1e-12)
    assert found.points is not None
    assert not segment_faults(grid, found.points)
    closed = occupancy_grid(drawn("#.", ".#"))
    assert VisibilityGraph(closed).shortest((0, 0), (1, 1)).points is None


def test_unexplored_cells_are_crossed_only_when_allowed() -> None:
    grid = occupancy_grid(drawn("..?.."))
    assert VisibilityGraph(grid).shortest((0, 0), (0, 4)).points is None
    assert VisibilityGraph(grid, allow_unexplored=True).shortest((0, 0), (0, 4)).length_m == 4


def test_a_map_of_many_corners_has_the_stated_optima(data: Path) -> None:
    folder = data / "any_angle_optima"
    grid = load_map(folder / "tsc_y4.map", robot_radius_m=0)
    graph = VisibilityGraph(grid)
    assert len(graph.corners) == 19_574
    stated = (folder / "tsc_y4.csv").read_text(encoding="utf-8").splitlines()
    for row in list(csv.DictReader(stated))[::25]:
        start, goal = (
            (grid.shape[0] - 1 - int(float(row[f"{end}y"])), int(float(row[f"{end}x"])))
            for end in "sg"
        )
        found = graph.shortest(start, goal)
        assert found.length_m == pytest.approx(float(row["length_cells"]), abs=1e-6)
        assert found.points is not None
        assert not segment_faults(grid, found.points)


def test_cells_outside_the_map_are_refused() -> None:
    with pytest.raises(InvalidValueError, match=r"\(12, 0\) lies outside"):
        VisibilityGraph(occupancy_grid(ONE_SQUARE)).shortest((12, 0), (0, 0))
