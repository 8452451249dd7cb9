"""The bound on the cost of all paths at any angle, against the cost of paths that there are."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

import hybridnav as hn
from hybridnav.refine import CostLine
from hybridnav.refine.kernels.cost_line import cost_of
from hybridnav.search.lattice import LatticeSearch, build_lattice, cost_bound
from tests.layers import layer_of
from tests.oracle.any_angle_cost import SidePoints
from tests.search.lattice.scenes import SEEDS, Field, fields, settled
from tests.strategies import MAX_SIDE, examples

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


@given(fields(min(MAX_SIDE, 14)), SEEDS)
@settings(max_examples=examples(300), deadline=None)
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
    assert bound >= min(math.dist(*ends), known)
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


def office_fields() -> Any:
    """Free cells and costs of the office, and pairs of positions in it."""
    grid = hn.load_map(Path("maps/office/office.yaml"), robot_radius_m=0.25)
    line = CostLine(grid, hn.CostLayer.clearance(grid))
    cells = np.argwhere(line.free)
    return line, np.random.default_rng(3).choice(cells, (12, 2)) + 0.5


def test_it_is_near_the_cost_of_good_paths_in_a_building() -> None:
    line, pairs = office_fields()
    search = LatticeSearch(build_lattice(line.free.view(bool), line.factors))
    gaps = []
    for start, goal in pairs:
        path = line.settle(search.line(tuple(start), tuple(goal)).positions)
        cost = cost_of(line.factors, path)
        gaps.append(cost / bound_of(line.free, line.factors, (start, goal), known=cost) - 1)
    assert np.mean(gaps) < 0.02
    assert max(gaps) < 0.04


def test_a_known_path_that_is_too_dear_costs_little() -> None:
    """The bound is on all paths, whatever is known; a dear one only widens the search."""
    line, pairs = office_fields()
    start, goal = pairs[0]
    search = LatticeSearch(build_lattice(line.free.view(bool), line.factors))
    cost = cost_of(line.factors, line.settle(search.line(tuple(start), tuple(goal)).positions))
    bounds = [
        bound_of(line.free, line.factors, (start, goal), known=share * cost) for share in (1, 1.5)
    ]
    assert bounds[1] <= cost
    assert bounds[1] > 0.95 * bounds[0]


def test_walls_raise_it() -> None:
    free, factors = np.ones((30, 30), np.uint8), np.ones((30, 30), np.float32)
    free[:29, 15] = 0
    around = 2 * math.dist((0.5, 14.5), (29, 15.5))
    bound = bound_of(free, factors, ((0.5, 14.5), (0.5, 16.5)))
    assert 0.85 * around < bound <= around
    free[29, 15] = 0
    assert math.isinf(bound_of(free, factors, ((0.5, 14.5), (0.5, 16.5))))
