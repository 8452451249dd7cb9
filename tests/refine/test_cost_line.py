"""Lines by costs: walks over segments against those that test and price apart, bends that are
straight."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.maps.costs.integral import segment_cost
from hybridnav.refine.kernels.arcs import round_bends
from hybridnav.refine.kernels.cost_line import legal_cost
from hybridnav.refine.kernels.segments import is_legal
from tests.strategies import examples

SIDE = 8
coordinates = st.one_of(
    st.integers(0, 2 * SIDE).map(lambda n: n / 2),
    st.integers(0, SIDE * 2**24).map(lambda n: n / 2**24),
)


@given(
    st.lists(coordinates, min_size=4, max_size=4), st.integers(0, 2**32 - 1), st.floats(0.1, 3.0)
)
@settings(max_examples=examples(300), deadline=None)
def test_one_walk_finds_what_two_do(ends: Any, seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    free = (rng.random((SIDE, SIDE)) < 0.9).astype(np.uint8)
    factors = rng.uniform(1, 5, (SIDE, SIDE)).astype(np.float32)
    if ends[:2] == ends[2:]:
        assert legal_cost(free, factors, *ends, np.inf) == 0
        return
    cost = segment_cost(factors, *ends)
    found = legal_cost(free, factors, *ends, np.inf)
    if not is_legal(free, *ends, 1, 1):
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
    points, directions, cost, length = round_bends(free, factors, line, 3.0, 1.0)
    np.testing.assert_array_equal(points[1], line[1])
    np.testing.assert_allclose(directions[:3], math.sqrt(0.5))
    arc = np.hypot(*(points[2] - line[2]))  # from the bend to either end of the arc
    expected = 30 * math.sqrt(2) - 2 * arc + arc * math.pi / 2
    assert cost == pytest.approx(expected, rel=1e-6)
    assert length == pytest.approx(expected, rel=1e-6)
