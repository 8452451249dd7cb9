"""Shortest curves: they arrive, they are as short as OMPL's, they bend no more than they may."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.errors import InvalidValueError
from hybridnav.refine.curves import shortest_curve
from tests.strategies import examples

RADIUS_M = 0.8

anywhere = st.tuples(st.floats(-4, 4), st.floats(-4, 4), st.floats(-4, 4))
on_lattice = st.tuples(*[st.integers(-4, 4)] * 3).map(
    lambda steps: (0.4 * steps[0], 0.4 * steps[1], math.pi / 4 * steps[2])
)
poses = st.one_of(anywhere, on_lattice)
both = pytest.mark.parametrize("reverses", [False, True])


@both
@given(start=poses, goal=poses)
@settings(max_examples=examples(125), derandomize=True)
def test_curve_arrives_and_bends_by_its_radius(
    reverses: bool,  # noqa: FBT001
    start: Any,
    goal: Any,
) -> None:
    curve = shortest_curve(start, goal, radius_m=RADIUS_M, reverses=reverses)
    along = curve.poses(0.01)
    np.testing.assert_array_equal(along[0], start)
    assert np.abs(along[-1, :2] - goal[:2]).max() < 1e-7
    assert abs(math.remainder(along[-1, 2] - goal[2], math.tau)) < 1e-7
    assert reverses or (curve.lengths_m >= 0).all()
    steps, turns = np.diff(along[:, :2], axis=0), np.diff(along[:, 2])
    chords = np.hypot(*steps.T)
    assert chords.sum() == pytest.approx(curve.length_m, rel=1e-4, abs=1e-9)
    assert (np.abs(turns) <= chords / RADIUS_M * 1.001 + 1e-9).all()
    # Nothing moves sideways: the chord runs along the heading in the middle of its step.
    middle = along[:-1, 2] + turns / 2
    assert np.abs(steps[:, 1] * np.cos(middle) - steps[:, 0] * np.sin(middle)).max(initial=0) < 1e-9
    assert curve.length_m >= math.dist(start[:2], goal[:2]) - 1e-9


@both
@given(start=poses, goal=poses)
@settings(max_examples=examples(125), derandomize=True)
def test_curve_is_as_long_as_that_of_ompl(
    reverses: bool,  # noqa: FBT001
    start: Any,
    goal: Any,
) -> None:
    base = pytest.importorskip("ompl.base")
    space = (base.ReedsSheppStateSpace if reverses else base.DubinsStateSpace)(RADIUS_M)
    states = [space.allocState(), space.allocState()]
    for state, (x, y, yaw) in zip(states, (start, goal), strict=True):
        state.setX(x)
        state.setY(y)
        state.setYaw(math.remainder(yaw, math.tau))
    curve = shortest_curve(start, goal, radius_m=RADIUS_M, reverses=reverses)
    assert curve.length_m == pytest.approx(space.distance(*states), abs=1e-5)


@given(start=poses, goal=poses)
@settings(max_examples=examples(60), derandomize=True)
def test_going_backwards_makes_no_curve_longer_and_works_both_ways(start: Any, goal: Any) -> None:
    forwards = shortest_curve(start, goal, radius_m=RADIUS_M, reverses=False)
    either = shortest_curve(start, goal, radius_m=RADIUS_M, reverses=True)
    back = shortest_curve(goal, start, radius_m=RADIUS_M, reverses=True)
    assert either.length_m <= forwards.length_m + 1e-6
    assert back.length_m == pytest.approx(either.length_m, abs=1e-6)


def test_reversing_out_of_a_dead_end() -> None:
    curve = shortest_curve((2, 0, 0), (0, 0, 0), radius_m=1, reverses=True)
    assert curve.lengths_m.sum() == -2
    assert curve.length_m == 2
    assert shortest_curve((2, 0, 0), (0, 0, 0), radius_m=1, reverses=False).length_m > 2 * math.pi


@both
def test_no_way_has_no_length(reverses: bool) -> None:  # noqa: FBT001
    curve = shortest_curve((1, 2, 3), (1, 2, 3), radius_m=1, reverses=reverses)
    assert curve.length_m == pytest.approx(0, abs=1e-9)
    assert curve.poses(0.1)[-1] == pytest.approx((1, 2, 3))


@pytest.mark.parametrize("wrong", [math.nan, math.inf, 1e300])
def test_poses_and_radii_that_make_no_sense_are_refused(wrong: float) -> None:
    with pytest.raises(InvalidValueError, match="poses must be finite"):
        shortest_curve((0, 0, 0), (0, 0, wrong), radius_m=1, reverses=False)
    for radius_m in (0, -1, math.nan, math.inf):
        with pytest.raises(InvalidValueError, match="radius positive"):
            shortest_curve((0, 0, 0), (1, 0, 0), radius_m=radius_m, reverses=True)
    curve = shortest_curve((0, 0, 0), (9, 0, 0), radius_m=1, reverses=False)
    for step_m in (0, -1, math.nan, 1e-12):
        with pytest.raises(InvalidValueError, match="step must be a length"):
            curve.poses(step_m)
