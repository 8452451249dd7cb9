"""The any-angle finish: legal, never longer, taut, near the exact optimum; by costs too."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import ndimage

from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges import VisibilityGraph, segment_faults
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.costs.integral import legal_cost, segment_cost
from hybridnav.maps.files import load_map
from hybridnav.refine.grid import LineOfSight
from hybridnav.refine.kernels.arcs import round_bends
from hybridnav.refine.kernels.line_of_sight import clear_segments
from hybridnav.refine.kernels.taut import FREE
from hybridnav.search.grid_search import GridSearch
from tests.oracle.grid import length_of_points
from tests.strategies import (
    MAX_SIDE,
    class_grids,
    drawn,
    examples,
    framed,
    occupancy_grid,
    seeds,
    tried,
)

yaws = st.sampled_from([0.0, 0.7, -2.5])


def paths_of(
    grid: OccupancyGrid, rng: np.random.Generator, n: int, *, allow_unexplored: bool = False
) -> list[Any]:
    """Octile-optimal paths between random cells."""
    enterable = grid.enterable(allow_unexplored=allow_unexplored)
    search = GridSearch(enterable, corner_cutting=grid.corner_cutting)
    cells = np.argwhere(enterable)
    if not len(cells):
        return []
    pairs = rng.choice(cells, (n, 2)).tolist()
    found = [search.search(tuple(start), tuple(goal)).cells for start, goal in pairs]
    return [cells for cells in found if cells is not None]


def length(points: Any) -> float:
    return length_of_points(points) if len(points) > 1 else 0.0


def ends_in(grid: OccupancyGrid, cells: Any, rng: np.random.Generator) -> tuple[Any, Any]:
    """Points in the first and last cell: anywhere, and often on the rim or at the centre."""
    offset = rng.random((2, 2))
    rounded = rng.random((2, 2)) < 0.3
    offset[rounded] = np.rint(2 * offset[rounded]) / 2
    start, goal = grid.frame.points_of_grid(cells[[0, -1]] + offset)
    return (start, start.copy()) if len(cells) == 1 and rng.random() < 0.3 else (start, goal)


def length_over_centres(grid: OccupancyGrid, cells: Any, start: Any, goal: Any) -> float:
    return length(np.concatenate([[start], grid.frame.points_of(cells[1:-1]), [goal]]))


def without_islands(classes: Any) -> Any:
    """The map with the obstacles freed that do not hang together with its border."""
    occupied = np.pad(classes != CellClass.FREE, 1, constant_values=True)
    labels, _ = ndimage.label(occupied, structure=np.ones((3, 3)))
    kept = (labels == labels[0, 0])[1:-1, 1:-1]
    return np.where(kept, CellClass.OCCUPIED, CellClass.FREE).astype(np.uint8)


def at_blocked_corner(grid: OccupancyGrid, points: Any) -> bool:
    """Whether each inner point is a corner of exactly one blocked cell."""
    free = np.pad(grid.classes == CellClass.FREE, 1)
    low = np.argwhere(np.ones(np.add(grid.shape, 1)))
    squares = [free[row : row + 2, col : col + 2].sum() == 3 for row, col in low]
    corners = grid.frame.points_of_grid(low[squares])
    return all(np.abs(corners - point).max(axis=1).min() < 1e-9 for point in points[1:-1])


@given(class_grids(), seeds, yaws)
@settings(max_examples=examples(400), derandomize=True)
def test_shortened_path_is_legal_and_never_longer(classes: Any, seed: int, yaw_rad: float) -> None:
    rng = np.random.default_rng(seed)
    grid = framed(classes, yaw_rad)
    finish = LineOfSight(grid)
    for cells in paths_of(grid, rng, 4):
        start, goal = ends_in(grid, cells, rng)
        points = finish.shorten(cells, start, goal)
        assert points.dtype == np.float64
        np.testing.assert_array_equal(points[0], start)
        np.testing.assert_array_equal(points[-1], goal)
        assert not segment_faults(grid, points)
        assert length(points) <= length_over_centres(grid, cells, start, goal) + 1e-9


@pytest.mark.parametrize("blocked", [0.05, 0.15, 0.3, 0.4])
def test_thousands_of_noisy_paths_are_legal(blocked: float) -> None:
    rng = np.random.default_rng(int(100 * blocked))
    side = min(30, MAX_SIDE)
    for _ in range(40 if side == 30 else 3):
        classes = (rng.random((side, side)) >= blocked).astype(np.uint8)
        grid = framed(classes, float(rng.uniform(-3, 3)))
        finish = LineOfSight(grid)
        for cells in paths_of(grid, rng, 20):
            start, goal = ends_in(grid, cells, rng)
            points = finish.shorten(cells, start, goal)
            assert not segment_faults(grid, points)
            assert length(points) <= length_over_centres(grid, cells, start, goal) + 1e-9


@given(class_grids(max_side=16), seeds)
@settings(max_examples=examples(100), derandomize=True)
def test_inner_points_are_blocked_corners_that_cannot_be_left_out(classes: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    grid = framed(classes)
    finish = LineOfSight(grid)
    for cells in paths_of(grid, rng, 3):
        points = finish.shorten(cells, *grid.frame.points_of(cells[[0, -1]]))
        assert at_blocked_corner(grid, points)
        for k in range(1, len(points) - 1):
            assert segment_faults(grid, points[[k - 1, k + 1]])


@given(class_grids(max_side=16), seeds, yaws)
@settings(max_examples=examples(150), derandomize=True)
@example(drawn("......", ".####.", ".#....", ".#.##.", "...#.."), 3, 0.0)
def test_path_is_the_optimum_where_no_obstacle_can_be_passed_on_two_sides(classes, seed, yaw_rad):
    rng = np.random.default_rng(seed)
    grid = framed(without_islands(classes), yaw_rad)
    finish, graph = LineOfSight(grid), VisibilityGraph(grid)
    for cells in paths_of(grid, rng, 3):
        start, goal = grid.frame.points_of(cells[[0, -1]])
        points = finish.shorten(cells, start, goal)
        first, last = cells[[0, -1]].tolist()
        optimum_m = graph.shortest(tuple(first), tuple(last)).length_m
        assert length(points) == pytest.approx(optimum_m, abs=1e-9)
        back = finish.shorten(cells[::-1], goal, start)
        assert length(back) == pytest.approx(optimum_m, abs=1e-9)


def losses(grid: OccupancyGrid, rng: np.random.Generator, n: int) -> list[float]:
    finish, graph = LineOfSight(grid), VisibilityGraph(grid)
    found = []
    for cells in paths_of(grid, rng, n):
        points = finish.shorten(cells, *grid.frame.points_of(cells[[0, -1]]))
        first, last = cells[[0, -1]].tolist()
        optimum_m = graph.shortest(tuple(first), tuple(last)).length_m
        found.append(length(points) / optimum_m - 1 if optimum_m else 0.0)
    return found


def test_optimal_grid_paths_come_close_to_the_optimum_among_scattered_obstacles() -> None:
    rng = np.random.default_rng(5)
    side = min(50, MAX_SIDE)
    found: list[float] = []
    for blocked in (0.02, 0.05, 0.15, 0.3):
        classes = (rng.random((side, side)) >= blocked).astype(np.uint8)
        found += losses(framed(classes, 0.4), rng, 60 if side == 50 else 4)
    assert min(found) >= -1e-9
    assert np.mean(found) <= 0.005


def test_optimal_grid_paths_come_close_to_the_optimum_in_a_building(data: Path) -> None:
    whole = load_map(data / "willow" / "willow-2010-02-18-0.10.yaml", robot_radius_m=0.25)
    part = whole.classes[200:380, 250:430]
    found = losses(framed(part), np.random.default_rng(0), 150)
    assert min(found) >= -1e-9
    assert np.mean(found) <= 0.002
    assert max(found) <= 0.03


def test_way_is_led_past_the_other_side_where_that_is_shorter() -> None:
    classes = np.ones((12, 12), np.uint8)
    classes[2:8, 5:7] = CellClass.OCCUPIED
    grid = occupancy_grid(classes)
    up = [(4, col) for col in range(1, 4)] + [(row, 4) for row in range(4, 9)]
    over = [(8, 5), (8, 6)] + [(row, 7) for row in range(8, 3, -1)]
    cells = np.array(up + over + [(4, 8), (4, 9), (4, 10)])
    points = LineOfSight(grid).shorten(cells, *grid.frame.points_of(cells[[0, -1]]))
    np.testing.assert_allclose(points, [(1.5, 4.5), (5, 2), (7, 2), (10.5, 4.5)])


STAIRS = drawn("####..", "###..#", "##..##", "#..###", "..####", ".#####")
DOOR = drawn(".....", ".....", "##.##", ".....", ".....")


@pytest.mark.parametrize(
    ("classes", "start", "goal", "inner"),
    [
        (np.ones((9, 9), np.uint8), (0, 0), (8, 3), []),
        (np.ones((9, 9), np.uint8), (4, 4), (4, 5), []),
        (np.ones((1, 9), np.uint8), (0, 0), (0, 8), []),
        (DOOR, (0, 2), (4, 2), []),
        (DOOR, (0, 0), (4, 0), [(2, 2), (2, 3)]),
        (STAIRS, (1, 0), (4, 4), []),
    ],
)
def test_known_paths(classes: Any, start: Any, goal: Any, inner: Any) -> None:
    grid = occupancy_grid(classes)
    cells = GridSearch(grid.enterable()).search(start, goal).cells
    assert cells is not None
    endpoints = grid.frame.points_of([start, goal])
    points = LineOfSight(grid).shorten(cells, *endpoints)
    np.testing.assert_allclose(points, [endpoints[0], *inner, endpoints[1]], atol=1e-12)


def test_ends_in_one_cell() -> None:
    finish = LineOfSight(framed(np.ones((3, 3), np.uint8), 0.7))
    centre = framed(np.ones((3, 3), np.uint8), 0.7).frame.points_of((1, 1))
    cells = np.array([[1, 1]])
    np.testing.assert_array_equal(finish.shorten(cells, centre, centre), [centre])
    near = centre + 1e-13
    np.testing.assert_array_equal(finish.shorten(cells, centre, near), [centre, near])
    far = centre + 0.01
    np.testing.assert_array_equal(finish.shorten(cells, centre, far), [centre, far])


def test_point_outside_its_cell_is_refused() -> None:
    grid = framed(np.ones((3, 3), np.uint8), 0.7)
    cells = np.array([[1, 1], [1, 2]])
    start, goal = grid.frame.points_of(cells)
    with pytest.raises(InvalidValueError, match="outside its cell"):
        LineOfSight(grid).shorten(cells, goal, start)


def test_unexplored_cells_are_walls_unless_allowed() -> None:
    grid = occupancy_grid(drawn(".....", ".???.", "....."))
    cells = np.array([(1, 0), (2, 1), (2, 2), (2, 3), (1, 4)])
    endpoints = grid.frame.points_of(cells[[0, -1]])
    assert len(LineOfSight(grid).shorten(cells, *endpoints)) == 4
    assert len(LineOfSight(grid, allow_unexplored=True).shorten(cells, *endpoints)) == 2


@given(class_grids(max_side=20), seeds, yaws)
@settings(max_examples=examples(150), derandomize=True)
def test_cut_corners_never_fail(classes: Any, seed: int, yaw_rad: float) -> None:
    rng = np.random.default_rng(seed)
    grid = framed(classes, yaw_rad, corner_cutting=True)
    finish = LineOfSight(grid)
    for cells in paths_of(grid, rng, 4):
        start, goal = ends_in(grid, cells, rng)
        points = finish.shorten(cells, start, goal)
        np.testing.assert_array_equal(points[[0, -1]], [start, goal])
        assert all("two blocked cells" in fault for fault in segment_faults(grid, points))
        over = np.concatenate([[start], grid.frame.points_of(cells), [goal]])
        assert length(points) <= length(over) + 1e-9


def test_cut_corner_between_two_blocked_cells_stays_a_point() -> None:
    grid = framed(drawn("#.", ".#"), corner_cutting=True)
    cells = np.array([(0, 0), (1, 1)])
    start, goal = grid.frame.points_of_grid([(0.5, 0.2), (1.5, 1.2)])
    points = LineOfSight(grid).shorten(cells, start, goal)
    np.testing.assert_allclose(points[1], grid.frame.points_of_grid((1, 1)))
    assert math.isclose(length(points), 0.05 * (math.hypot(0.5, 0.8) + math.hypot(0.5, 0.2)))


# Lines by costs: walks over segments against those that test and price apart, bends that are
# straight.
SIDE = 8
coordinates = st.one_of(
    st.integers(0, 2 * SIDE).map(lambda n: n / 2),
    st.integers(0, SIDE * 2**24).map(lambda n: n / 2**24),
)


@tried(300, st.lists(coordinates, min_size=4, max_size=4), seeds, st.floats(0.1, 3.0))
def test_one_walk_finds_what_two_do(ends: Any, seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    free = (rng.random((SIDE, SIDE)) < 0.9).astype(np.uint8)
    factors = rng.uniform(1, 5, (SIDE, SIDE)).astype(np.float32)
    if ends[:2] == ends[2:]:
        assert legal_cost(free, factors, *ends, np.inf) == 0
        return
    cost = segment_cost(factors, *ends)
    found = legal_cost(free, factors, *ends, np.inf)
    if not clear_segments(free * np.uint8(FREE), np.array([ends[:2]]), np.array([ends[2:]]))[0]:
        assert found == np.inf
        return
    assert found == pytest.approx(cost, rel=1e-12)
    assert legal_cost(free, factors, *ends[2:], *ends[:2], np.inf) == found
    most = share * cost
    bounded = legal_cost(free, factors, *ends, most)
    assert bounded == found or (bounded == np.inf and found > most)


def test_a_bend_that_is_straight_has_no_arc() -> None:
    free, factors = np.ones((40, 40), np.uint8), np.ones((40, 40), np.float32)
    line = np.array([[0.5, 0.5], [10.5, 10.5], [20.5, 20.5], [30.5, 10.5]])
    points, headings, cost, length = round_bends(free, factors, line, 3.0, 1.0)
    np.testing.assert_array_equal(points[1], line[1])
    np.testing.assert_allclose(headings[:3], math.pi / 4)
    np.testing.assert_allclose(headings[3:], 3 * math.pi / 4)
    arc = np.hypot(*(points[2] - line[2]))  # from the bend to either end of the arc
    expected = 30 * math.sqrt(2) - 2 * arc + arc * math.pi / 2
    assert cost == pytest.approx(expected, rel=1e-6)
    assert length == pytest.approx(expected, rel=1e-6)


def test_a_line_that_turns_back_keeps_bends_that_differ():
    """The middle of the two bends is the goal: as one bend they would leave a line of no length."""
    free = np.ones((4, 3), np.uint8)
    line = np.array([[1.0, 1.5], [2.5, 2.5], [3.5, 1.5], [3.0, 2.0]])
    points, headings, cost, length = round_bends(free, np.ones((4, 3), np.float32), line, 0.3, 1.0)
    assert np.isfinite(headings).all()
    assert points[[0, -1]].tolist() == line[[0, -1]].tolist()
    assert np.hypot(2, 0.5) <= length <= cost + 1e-9
