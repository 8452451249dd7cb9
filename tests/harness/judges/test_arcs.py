"""Arcs as the judges read them: on their circles, as long as these, and priced within the slack."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.harness.judges import chords_of, judge_line
from hybridnav.maps.costs import cost_along
from tests.layers import grid_of, layer_of
from tests.strategies import examples

GRID = grid_of(np.zeros((40, 40)), hn.Frame(0.5), robot_radius_m=0)
CENTRE = np.array([10.0, 10.0])


def arc(radius_m: float, start_rad: float, turn_rad: float) -> tuple[Any, Any]:
    """Points and headings of an arc about the centre of the map, in two parts."""
    at = start_rad + turn_rad * np.array([0.0, 0.4, 1.0])
    points = CENTRE + radius_m * np.stack([np.cos(at), np.sin(at)], axis=1)
    return points, at + math.copysign(math.pi / 2, turn_rad)


@given(
    st.floats(0.3, 9.0),
    st.floats(-4, 4),
    st.floats(0.01, 3.0),
    st.booleans(),
    st.integers(0, 2**32 - 1),
)
@settings(max_examples=examples(60))
def test_chords_lie_on_the_circle_and_have_its_length(
    radius_m: float,
    start_rad: float,
    turn_rad: float,
    to_the_left: bool,  # noqa: FBT001 - drawn
    seed: int,
) -> None:
    turn_rad = turn_rad if to_the_left else -turn_rad
    points, headings = arc(radius_m, start_rad, turn_rad)
    chords = chords_of(GRID, points, headings)
    assert chords.faults == ()
    assert chords.length_m == pytest.approx(radius_m * abs(turn_rad), rel=1e-9)
    assert np.hypot(*(chords.points - CENTRE).T) == pytest.approx(radius_m, rel=1e-9)
    middle = (chords.points[1:] + chords.points[:-1]) / 2 - CENTRE
    assert (radius_m - np.hypot(*middle.T) <= 1.01e-4 * 0.5).all()
    layer = layer_of(np.random.default_rng(seed).uniform(1, 4, GRID.shape))
    n = math.ceil(radius_m * abs(turn_rad) / 0.125)
    at = start_rad + turn_rad * np.arange(n + 1) / n
    priced = CENTRE + radius_m * np.stack([np.cos(at), np.sin(at)], axis=1)
    cost_m = cost_along(GRID, layer, chords.points)
    ratio = radius_m * abs(turn_rad) / np.hypot(*np.diff(priced, axis=0).T).sum()
    slack_m = chords.cost_slack_m(GRID, layer) + 1e-5 * cost_m
    assert abs(cost_along(GRID, layer, priced) * ratio - cost_m) <= slack_m * 1.001
    smooth = layer_of(1 + (layer.factors - 1) / 60)
    assert chords.cost_slack_m(GRID, smooth) < 0.05 * chords.length_m


def test_a_line_between_arcs_and_turns_on_the_spot() -> None:
    points = np.array([[2.0, 2.0], [3.0, 3.0], [5.0, 3.0], [5.0, 3.0], [5.0, 4.0]])
    headings = np.array([math.pi / 2, 0.0, 0.0, math.pi / 2, math.pi / 2])
    chords = chords_of(GRID, points, headings)
    assert chords.faults == ()
    assert chords.length_m == pytest.approx(math.pi / 2 + 3)
    assert chords.cost_slack_m(GRID, layer_of(np.ones(GRID.shape))) == 0


@pytest.mark.parametrize(
    "headings", [[0.3, 0.0], [math.pi / 2, 0.2], [-math.pi / 2, math.pi], [math.pi, math.pi]]
)
def test_a_step_that_is_no_arc_is_a_fault(headings: Any) -> None:
    chords = chords_of(GRID, [(2.0, 2.0), (3.0, 3.0)], headings)
    assert len(chords.faults) == 1
    assert "step 0 of the path is neither" in chords.faults[0]


def test_an_arc_through_an_obstacle_is_seen_though_its_chord_is_free() -> None:
    probability = np.zeros((40, 40))
    probability[20:, 20] = 1.0
    grid = grid_of(probability, hn.Frame(0.5), robot_radius_m=0)
    points = grid.frame.points_of([(18, 10), (18, 30)])
    ends: Any = {"start": (18, 10), "goal": (18, 30)}
    assert judge_line(grid, points, **ends).ok
    chords = chords_of(grid, points, [math.pi / 2, -math.pi / 2])
    assert chords.faults == ()
    assert not judge_line(grid, chords.points, **ends).ok
    below = chords_of(grid, points, [-0.5, 0.5])
    assert judge_line(grid, below.points, **ends).ok


@pytest.mark.parametrize("headings", [[0.0], [0.0, math.nan], [[0.0, 0.0]]])
def test_headings_that_are_none_are_refused(headings: Any) -> None:
    with pytest.raises(hn.InvalidValueError, match="state one for each point"):
        chords_of(GRID, [(2.0, 2.0), (3.0, 3.0)], headings)


def test_a_step_far_beyond_the_map_takes_no_more_points_than_its_ends() -> None:
    chords = chords_of(GRID, [(1.0, 1.0), (1e12, 1.0)], [0.5, -0.5])
    assert chords.points.tolist() == [[1.0, 1.0], [1e12, 1.0]]
