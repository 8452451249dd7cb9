"""Pairs of the harness: the sampler, the lattice, scenario files; and paths as text."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from benchmarks.worlds import office_world
from hybridnav.errors import InvalidValueError
from hybridnav.harness.records import decode_path, encode_path
from hybridnav.harness.scenes import (
    STRATA,
    Pair,
    components,
    lattice_pairs,
    sample_pairs,
    scenario_pairs,
)
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.files.movingai import Scenario
from tests.strategies import drawn, occupancy_grid, scenes, tried

TWO_PARTS = occupancy_grid(drawn("....#..", "....#..", "....#.."))
OFFICE = office_world().grid(robot_radius_m=0)


def lengths_m(grid, pairs):
    endpoints = np.array([(pair.start, pair.goal) for pair in pairs], dtype=float)
    return np.hypot(*(endpoints[:, 0] - endpoints[:, 1]).T) * grid.resolution_m


# --- the sampler --------------------------------------------------------------------------------


def test_equal_seeds_give_equal_pairs():
    first = sample_pairs(OFFICE, 40, seed=7)
    assert first == sample_pairs(OFFICE, 40, seed=7)
    assert first != sample_pairs(OFFICE, 40, seed=8)


def test_the_sampler_of_this_version_gives_these_pairs():
    # When this changes, so must SAMPLER_VERSION: records name the version.
    keys = [pair.key for pair in sample_pairs(TWO_PARTS, 4, seed=0)]
    assert keys == [
        "sampled:2,2>1,3",
        "sampled:0,2>2,1",
        "sampled:0,3>0,0",
        "sampled:1,2>0,3",
        "across:1,0>2,6",
    ]


@given(scenes(max_side=14), st.integers(1, 60), st.integers(0, 5))
def test_pairs_are_what_they_are_said_to_be(scene, count, seed):
    grid = scene.grid
    labels, sizes = components(grid)
    pairs = sample_pairs(grid, count, seed=seed)
    assert len(set(pairs)) == len(pairs)
    assert len({pair.key for pair in pairs}) == len(pairs)
    sampled = [pair for pair in pairs if pair.kind == "sampled"]
    across = [pair for pair in pairs if pair.kind == "across"]
    assert len(sampled) <= count
    assert sampled + across == pairs
    for pair in pairs:
        assert all(type(number) is int for cell in (pair.start, pair.goal) for number in cell)
        assert grid.classes[pair.start] == grid.classes[pair.goal] == CellClass.FREE
        assert (labels[pair.start] == labels[pair.goal]) == (pair.kind == "sampled")
        assert sizes[labels[pair.start] - 1] == sizes.max()
        assert pair.start != pair.goal
    if sizes.size and sizes.max() > 1:
        assert sampled
    assert bool(across) == (sizes.size > 1)


def test_components_are_those_that_moves_join():
    labels, sizes = components(occupancy_grid(drawn("..#", "##.", "..#")))
    assert sorted(sizes) == [1, 2, 2]
    assert labels.max() == 3
    assert (labels == 0).sum() == 4


def test_as_many_pairs_as_asked_for_no_nearer_than_asked_for():
    for least_distance_m in (1.0, 10.0):
        pairs = sample_pairs(OFFICE, 200, seed=1, least_distance_m=least_distance_m)
        sampled = [pair for pair in pairs if pair.kind == "sampled"]
        assert len(sampled) == 200
        assert lengths_m(OFFICE, sampled).min() >= least_distance_m


def test_every_class_of_distance_has_as_many_pairs():
    pairs = [pair for pair in sample_pairs(OFFICE, 500, seed=3) if pair.kind == "sampled"]
    lengths = lengths_m(OFFICE, pairs)
    # The last class begins at 4/5 of the 95th percentile: each fifth of the range up to there
    # has a fifth of the pairs, which is far from what random pairs have.
    edges = np.linspace(1.0, np.quantile(lengths, 0.9), STRATA + 1)
    counts = np.histogram(lengths, [*edges[:-1], np.inf])[0]
    assert counts.min() >= 60
    assert counts.max() <= 140


def test_a_least_distance_beyond_the_map_is_halved_until_there_are_pairs():
    pairs = sample_pairs(TWO_PARTS, 10, seed=0, least_distance_m=40.0)
    lengths = lengths_m(TWO_PARTS, [pair for pair in pairs if pair.kind == "sampled"])
    assert len(lengths) == 10
    assert lengths.min() >= 2.5


def test_one_pair_in_twenty_more_joins_two_components():
    pairs = sample_pairs(TWO_PARTS, 41, seed=0)
    across = [pair for pair in pairs if pair.kind == "across"]
    assert len(across) == 3
    assert all(pair.start[1] < 4 < pair.goal[1] for pair in across)


@pytest.mark.parametrize(
    ("lines", "kinds"),
    [
        (["."], []),
        (["#"], []),
        (["???"], []),
        ([".."], ["sampled", "sampled"]),
        ([".#."], ["across"]),
        (["..#.."], ["sampled", "sampled", "across"]),
    ],
)
def test_maps_of_a_few_cells(lines, kinds):
    grid = occupancy_grid(drawn(*lines))
    assert [pair.kind for pair in sample_pairs(grid, 20, seed=0)] == kinds


@pytest.mark.parametrize(("count", "seed"), [(0, 0), (-1, 0), (10**9, 0), (5, -1)])
def test_numbers_out_of_range_are_refused(count, seed):
    with pytest.raises(InvalidValueError):
        sample_pairs(TWO_PARTS, count, seed=seed)


# --- the lattice --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("step_m", "cells"), [(1.0, 18), (0.3, 18), (2.0, 3), (4.0, 2), (50.0, 0), (1e300, 0)]
)
def test_all_pairs_of_a_lattice(step_m, cells):
    pairs = lattice_pairs(TWO_PARTS, step_m)
    assert len(set(pairs)) == len(pairs) == cells * (cells - 1) // 2
    assert not {(pair.goal, pair.start) for pair in pairs} & {(p.start, p.goal) for p in pairs}
    assert all(TWO_PARTS.classes[p.start] == TWO_PARTS.classes[p.goal] == 1 for p in pairs)


def test_the_step_of_a_lattice_is_in_metres():
    grid = occupancy_grid(drawn(*["." * 12] * 12), resolution_m=0.5)
    starts = {cell for pair in lattice_pairs(grid, 2.0) for cell in (pair.start, pair.goal)}
    assert starts == {(row, col) for row in (2, 6, 10) for col in (2, 6, 10)}


@pytest.mark.parametrize("step_m", [0.0, -1.0, np.nan, np.inf])
def test_a_step_that_is_no_length_is_refused(step_m):
    with pytest.raises(InvalidValueError, match="step"):
        lattice_pairs(TWO_PARTS, step_m)


def test_a_lattice_of_too_many_pairs_is_refused():
    grid = OccupancyGrid(np.zeros((80, 80), dtype=np.float32))
    with pytest.raises(InvalidValueError, match="larger step"):
        lattice_pairs(grid, 1.0)


# --- scenario files -----------------------------------------------------------------------------


def scenario(start, goal, optimum=2.0, shape=(3, 7)):
    rows, cols = shape
    return Scenario(0, "m.map", rows, cols, start, goal, optimum)


def test_scenarios_keep_their_optimum_and_none_comes_twice():
    stated = [scenario((0, 0), (0, 2)), scenario((1, 0), (0, 0), 1.0), scenario((0, 0), (0, 2))]
    assert scenario_pairs(TWO_PARTS, stated) == [
        Pair((0, 0), (0, 2), "scenario", 2.0),
        Pair((1, 0), (0, 0), "scenario", 1.0),
    ]


def test_scenarios_of_another_map_are_refused():
    with pytest.raises(InvalidValueError, match="7 x 3 cells, map has 3 x 7"):
        scenario_pairs(TWO_PARTS, [scenario((0, 0), (0, 2), shape=(7, 3))])


def test_what_a_scenario_states_does_not_hold_on_an_inflated_map():
    stated = [scenario((0, 0), (0, 2)), scenario((0, 0), (0, 3))]
    inflated = replace(TWO_PARTS, robot_radius_m=1.0)
    assert scenario_pairs(inflated, stated) == [Pair((0, 0), (0, 2), "scenario")]
    cutting = replace(TWO_PARTS, corner_cutting=True)
    assert {pair.stated_optimum_cells for pair in scenario_pairs(cutting, stated)} == {None}


# --- paths as text ------------------------------------------------------------------------------


@given(
    arrays.arrays(np.int64, (2,), elements=st.integers(-5, 400)),
    st.lists(st.tuples(st.integers(-2, 2), st.integers(-2, 2), st.integers(1, 12)), max_size=12),
)
def test_a_path_comes_back_from_its_text(start, runs):
    steps = [step[:2] for step in runs for _ in range(step[2])]
    cells = np.cumsum(np.array([start, *steps], dtype=np.int64), axis=0)
    text = encode_path(cells)
    np.testing.assert_array_equal(decode_path(tuple(start.tolist()), text), cells)


def test_a_path_far_outside_any_map_comes_back():
    cells = np.array([(0, 0), (-(2**40), 2**40), (3, 3)])
    np.testing.assert_array_equal(decode_path((0, 0), encode_path(cells)), cells)


def test_text_of_paths():
    assert encode_path(np.array([(2, 3)])) == ""
    assert encode_path(np.array([(0, 0), (0, 1), (0, 2), (1, 3), (1, 3), (0, 3)])) == "a2b1(0,0)g1"


@tried(300, st.text(alphabet="abhi0123456789(),- x²", max_size=6))
def test_damaged_text_is_refused_in_words(text):
    try:
        decode_path((0, 0), text)
    except InvalidValueError:
        return
    assert encode_path(decode_path((0, 0), text)) or not text.strip("abh0")


@pytest.mark.parametrize(
    "text",
    ["a", "3", "a3i2", "a3 b2", "(1,2", "a9999999999", "a999999999", "a999999999x", "b2(,1)", "é"],
)
def test_text_that_is_no_path_is_refused(text):
    with pytest.raises(InvalidValueError, match="no path"):
        decode_path((0, 0), text)
