"""Layers of costs on maps that change and grow."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live import carry_costs
from tests.strategies import examples


def grid_of(classes, south=0, west=0):
    probability = np.array([1.0, 0.0, 0.5], np.float32)[classes]
    frame = hn.Frame(0.5, (-0.5 * west, -0.5 * south))
    return hn.OccupancyGrid(probability, frame, robot_radius_m=0)


@st.composite
def changes(draw):
    """A map, the map later, grown on all sides, and where the first lies in it."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    rows, cols = draw(st.integers(1, 9)), draw(st.integers(1, 9))
    south, north, west, east = draw(st.tuples(*[st.integers(0, 3)] * 4))
    before = rng.choice(3, (rows, cols), p=[0.15, 0.75, 0.1])
    after = rng.choice(3, (rows + south + north, cols + west + east), p=[0.15, 0.75, 0.1])
    inside = np.s_[south : south + rows, west : west + cols]
    after[inside] = np.where(rng.random((rows, cols)) < 0.9, before, after[inside])
    return grid_of(before), grid_of(after, south, west), inside, rng


@settings(max_examples=examples(100), deadline=None)
@given(changes())
def test_factors_and_closed_cells_stay_on_their_cells(case):
    before, after, inside, rng = case
    layer = hn.CostLayer(rng.integers(1, 9, before.shape), rng.random(before.shape) < 0.3)
    carried = carry_costs(layer, before, after)
    factors, closed = np.ones(after.shape), np.zeros(after.shape, bool)
    factors[inside], closed[inside] = layer.factors, False if layer.closed is None else layer.closed
    assert np.array_equal(carried.layer.factors, factors)
    found = np.zeros(after.shape, bool) if carried.layer.closed is None else carried.layer.closed
    assert np.array_equal(found, closed)
    assert not carried.outdated.any()
    assert carried.layer.source == layer.source


@settings(max_examples=examples(100), deadline=None)
@given(changes(), st.sampled_from([0.0, 0.7, 1.5]))
def test_clearance_is_that_of_the_newer_map_and_outdated_where_it_was_joined(case, radius_m):
    before, after, inside, rng = case
    clear = {"inflation_radius_m": radius_m, "multiplier": 3.0}
    alone = hn.CostLayer.clearance(before, **clear)
    fresh = hn.CostLayer.clearance(after, **clear)
    carried = carry_costs(alone, before, after)
    assert np.array_equal(carried.layer.factors, fresh.factors)
    assert not carried.outdated.any()
    own = rng.integers(1, 5, before.shape)
    padded = np.ones(after.shape)
    padded[inside] = own
    joined = carry_costs(alone | hn.CostLayer(own), before, after)
    expected = (fresh | hn.CostLayer(padded)).factors
    known = ~joined.outdated
    assert np.array_equal(joined.layer.factors[known], expected[known])


def test_costs_of_another_map_are_refused_in_one_line():
    before, after = grid_of(np.ones((3, 3), int)), grid_of(np.ones((2, 3), int))
    layer = hn.CostLayer(np.ones((3, 3), np.float32))
    for wrong, grids in (
        (hn.CostLayer(np.ones((2, 2), np.float32)), (before, before)),
        (layer, (before, after)),
    ):
        with pytest.raises(InvalidValueError, match="cells") as error:
            carry_costs(wrong, *grids)
        assert "\n" not in str(error.value)
