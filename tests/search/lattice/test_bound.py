"""The bound on the cost of all paths at any angle, against the cost of paths that there are."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.maps.costs import cost_along
from hybridnav.refine import CostLine
from hybridnav.search.lattice import LatticeSearch, build_lattice, cost_bound
from tests.layers import layer_of
from tests.oracle.any_angle_cost import SidePoints
from tests.search.lattice.scenes import Field, fields, settled
from tests.strategies import MAX_SIDE, seeds, tried

Ends = tuple[tuple[float, float], tuple[float, float]]
Cells = tuple[tuple[int, int], tuple[int, int]]


def bound_of(
    free: Any, factors: Any, ends: Ends, cells: Cells | None = None, known: float = math.inf
) -> float:
    """The bound between two positions, of the cells in which they lie."""
    row, col, to_row, to_col = (int(at) for end in ends for at in end)
    return cost_bound(free, factors, ends, cells or ((row, col), (to_row, to_col)), known)


INSIDE = 1e-9
"""Cells by which an end on a side is moved into its cell, for the oracle."""


@tried(300, fields(min(MAX_SIDE, 14)), seeds)
def test_no_path_costs_less(field: Field, seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells, ends = field.positions(rng, 2)
    if len(ends) < 2 or any(field.is_split(end) for end in ends):
        return
    inside = np.clip(ends, cells + INSIDE, cells + 1 - INSIDE)
    least = SidePoints(field.free, field.factors).cost(*inside.tolist())
    first, last = map(tuple, cells.tolist())
    own: Any = (first, last)
    search = LatticeSearch(build_lattice(field.free, field.factors))
    line = search.line(tuple(ends[0]), tuple(ends[1]), own)
    if line.positions is not None:  # the oracle's path is not quite the cheapest
        least = min(least, field.cost(settled(field, line.positions)))
    start, goal = map(tuple, ends.tolist())
    free, known = field.free.view(np.uint8), least * rng.choice([1.0001, 1.02, 1.3, 3]) + 1e-6
    factors = layer_of(field.factors).factors  # rounded, as costs of paths are counted
    loose = cost_bound(free, factors, (start, goal), own)
    bound = cost_bound(free, factors, (start, goal), own, known)
    assert max(bound, loose) <= least * (1 + 1e-9) + 1e-6
    # Lengths of the own hypot may differ from these in the last bit.
    assert bound >= min(math.dist(*ends), known) * (1 - 1e-15)
    if math.isfinite(bound):
        half = cost_bound(free, factors, (start, goal), own, loose / 2)
        assert half == pytest.approx(loose / 2, abs=1e-9)


def test_an_end_that_rounding_moved_over_a_side_has_the_factor_of_its_own_cell() -> None:
    """0.3 m is cell 3 of cells of 0.1 m, and 0.3 / 0.1 is less than 3."""
    free = np.array([[0, 1, 1, 1, 0], [0, 0, 0, 1, 1]], np.uint8)
    factors = np.array([[1, 20, 20, 20, 1], [20, 20, 20, 1, 1]], np.float32)
    start, goal = (1 - 1e-13, 4.6), (1.14, 3.8)
    own = SidePoints(free, factors, 31).cost((1 + 1e-9, 4.6), goal)
    assert bound_of(free, factors, (start, goal), ((1, 4), (1, 3))) <= own + 1e-6
    shut = np.array([[0], [1]], np.uint8)
    dear = np.array([[1], [20]], np.float32)
    ends = (1 - 1e-13, 0.61), (1.05, 0.22)
    assert bound_of(shut, dear, ends, ((1, 0), (1, 0))) <= 20 * math.dist((1, 0.61), (1.05, 0.22))


def test_it_is_tight_along_the_lines_of_the_grid() -> None:
    free, factors = np.ones((20, 20), np.uint8), np.full((20, 20), 3, np.float32)
    assert bound_of(free, factors, ((2, 3), (2, 17))) == pytest.approx(3 * 14 / 1.0823922)
    assert bound_of(free, factors, ((2, 3), (2, 17)), known=20) == 20
    assert bound_of(free, factors, ((2, 3), (2, 3))) == 0


def office_paths() -> tuple[CostLine, list[tuple[Ends, float]]]:
    """Free cells and factors of the office, and ends of good paths with their costs in cells."""
    grid = hn.load_map(Path("maps/office/office.yaml"), robot_radius_m=0.25)
    layer = hn.CostLayer.clearance(grid)
    line = CostLine(grid, layer)
    search = LatticeSearch(build_lattice(line.free.view(bool), line.factors))
    found = []
    for ends in np.random.default_rng(3).choice(np.argwhere(line.free), (12, 2)) + 0.5:
        start, goal = map(tuple, ends.tolist())
        path = search.line(start, goal).positions
        assert path is not None
        points = grid.frame.points_of_grid(line.settle(path))
        found.append(((start, goal), cost_along(grid, layer, points) / grid.resolution_m))
    return line, found


def test_it_is_near_the_cost_of_good_paths_in_a_building() -> None:
    line, found = office_paths()
    bounds = [bound_of(line.free, line.factors, ends, known=cost) for ends, cost in found]
    gaps = [cost / bound - 1 for (_, cost), bound in zip(found, bounds, strict=True)]
    assert np.mean(gaps) < 0.02
    assert max(gaps) < 0.04


def test_a_path_that_is_too_dear_makes_it_a_little_lower() -> None:
    """The bound is on all paths, whatever is known; a dear one only widens the search."""
    line, found = office_paths()
    ends, cost = found[0]
    bound, loose = (bound_of(line.free, line.factors, ends, known=k * cost) for k in (1, 1.5))
    assert 0.95 * bound < loose <= cost


def test_no_path_leads_between_two_blocked_cells_that_meet_at_a_corner() -> None:
    """A wall of cells that meet at corners alone; only its end at the bottom is open."""
    free, factors = np.ones((30, 31), np.uint8), np.ones((30, 31), np.float32)
    free[np.arange(29), 15 + np.arange(29) % 2] = 0
    ends = (0.5, 14.5), (0.5, 17.5)
    corners = [(29, 15), (29, 16), (28, 17)]
    around = sum(map(math.dist, [ends[0], *corners], [*corners, ends[1]]))
    for known in (math.inf, around * 1.001):
        bound = bound_of(free, factors, ends, known=known)
        assert 0.85 * around < bound <= around + 1e-6


def test_walls_raise_it() -> None:
    free, factors = np.ones((30, 30), np.uint8), np.ones((30, 30), np.float32)
    free[:29, 15] = 0
    around = 2 * math.dist((0.5, 14.5), (29, 15.5))
    bound = bound_of(free, factors, ((0.5, 14.5), (0.5, 16.5)))
    assert 0.85 * around < bound <= around
    free[29, 15] = 0
    assert math.isinf(bound_of(free, factors, ((0.5, 14.5), (0.5, 16.5))))
