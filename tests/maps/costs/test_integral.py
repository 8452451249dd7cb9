"""Costs along polylines, against shapely's intersections with the squares of the cells."""

from __future__ import annotations

import itertools
import math
import re
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.maps.costs import cost_along
from tests.layers import grid_of, layer_of
from tests.strategies import examples

ROWS, COLS = 6, 8


def by_shapely(factors: Any, points: Any) -> float:
    """Sum of the lengths inside each square; what lies on a line between two counts for the larger.

    Squares are shrunk to be half open for that: a segment on their line is counted once.
    """
    total = 0.0
    for tail, head in itertools.pairwise(points):
        segment = shapely.LineString([tail, head])
        level = [tail[k] == head[k] and tail[k] == int(tail[k]) for k in range(2)]
        for row, col in np.ndindex(ROWS, COLS):
            length = shapely.intersection(shapely.box(col, row, col + 1, row + 1), segment).length
            if not any(level):
                total += length * factors[row, col]
                continue
            # On a line: counted by the upper cell, for both.
            beside = (row, col - 1) if level[0] else (row - 1, col)
            is_lower = (col if level[0] else row) + 1 == (tail[0] if level[0] else tail[1])
            if is_lower and (tail[0] if level[0] else tail[1]) < (COLS if level[0] else ROWS):
                continue
            factor = factors[row, col]
            if not is_lower and min(beside) >= 0:
                factor = max(factor, factors[beside])
            total += length * factor
    return total


coordinates = st.one_of(
    st.integers(0, 12).map(lambda n: n / 2),
    st.integers(0, 6 * 2**20).map(lambda n: n / 2**20),
    st.floats(0, 6),
)


@given(
    st.lists(st.tuples(coordinates, coordinates), min_size=2, max_size=5), st.integers(0, 2**32 - 1)
)
@settings(max_examples=examples(150), deadline=None)
def test_the_cost_is_the_exact_integral(points: Any, seed: int) -> None:
    factors = np.floor(np.random.default_rng(seed).uniform(1, 9, (ROWS, COLS)) * 2**14) / 2**14
    grid = grid_of(np.zeros((ROWS, COLS)), robot_radius_m=0)
    layer = layer_of(factors)
    rounded = [tuple(math.floor(c * 2**24 + 0.5) / 2**24 for c in point) for point in points]
    cost = cost_along(grid, layer, points)
    assert cost == pytest.approx(by_shapely(factors, rounded), rel=1e-9, abs=1e-9)
    assert cost_along(grid, layer, points[::-1]) == pytest.approx(cost, rel=1e-12, abs=1e-12)


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=examples(60))
def test_paths_of_cells_cost_what_their_moves_cost(seed: int) -> None:
    rng = np.random.default_rng(seed)
    steps = rng.integers(-1, 2, (40, 2))
    cells = [np.array([10, 10])]
    for step in steps[steps.any(axis=1)]:
        if ((cells[-1] + step >= 0) & (cells[-1] + step < 21)).all():
            cells.append(cells[-1] + step)
    path = np.array(cells)
    frame = hn.Frame(0.05, (3.0, -2.0), 0.4)
    grid = grid_of(np.zeros((21, 21)), frame, robot_radius_m=0)
    layer = layer_of(rng.uniform(1, 5, (21, 21)))
    along = layer.factors[path[:, 0], path[:, 1]].astype(float)
    lengths = np.hypot(*np.diff(path, axis=0).T) * 0.05
    moves = float((lengths * (along[1:] + along[:-1]) / 2).sum())
    assert layer.cost_of_cells(path) * 0.05 == pytest.approx(moves, rel=1e-12)
    assert cost_along(grid, layer, frame.points_of(path)) == pytest.approx(moves, rel=1e-6)


def test_a_point_costs_nothing_and_a_diagonal_passes_no_side_cell() -> None:
    grid = grid_of(np.zeros((2, 2)), robot_radius_m=0)
    layer = layer_of(np.array([[1.0, 900.0], [900.0, 3.0]]))
    assert cost_along(grid, layer, [(0.3, 0.4)]) == 0
    assert cost_along(grid, layer, [(0.5, 0.5), (1.5, 1.5)]) == pytest.approx(2 * math.sqrt(2))
    assert cost_along(grid, layer, [(1.0, 0.0), (1.0, 1.0)]) == 900


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(0.5, 0.5), (2.5, 0.5)], "point (2.500, 0.500) m lies outside the map"),
        ([(0.5, math.nan)], "points must be finite numbers"),
        (
            [0.5, 0.5],
            "points must be finite numbers (x, y) of shape (n, 2), n >= 1, got shape (2,)",
        ),
        (np.empty((0, 2)), "points must be finite numbers"),
        ([(0.5, 0.5), (0.5,)], "give each point two"),
        ("home", "give each point two"),
    ],
)
def test_unusable_points_are_refused(points: Any, message: str) -> None:
    grid = grid_of(np.zeros((2, 2)), robot_radius_m=0)
    with pytest.raises(hn.InvalidValueError, match=re.escape(message)):
        cost_along(grid, layer_of(np.ones((2, 2))), points)
