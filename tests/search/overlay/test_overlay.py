"""Costs on a multilevel overlay, and what it stores, against Dijkstra's algorithm of scipy."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.errors import HybridNavError, InvalidValueError
from hybridnav.search.overlay import (
    OverlayOptions,
    OverlaySearch,
    PathsTooLongError,
    build_overlay,
    prepare_overlay,
)
from hybridnav.search.overlay.kernels.costs import clique_place
from hybridnav.search.overlay.kernels.exits import reach_over_exits
from hybridnav.search.overlay.kernels.fields import search_near
from hybridnav.search.overlay.kernels.lanes import FAR, NO_PATH
from hybridnav.search.overlay.layout import slots_of
from hybridnav.search.overlay.search import overlay_fields
from tests.search.overlay.judge import UNITS, WeightedJudge
from tests.strategies import examples

SIZES = [(4,), (4, 8), (3, 9, 18), (5, 40), (2, 4, 8, 16)]


def nested(free, sizes):
    """Squares of cells as fields, one size for each level; each size divides the next."""
    rows, cols = np.indices(free.shape)
    return [
        np.where(free, rows // size * 1000 + cols // size, -1).astype(np.int32) for size in sizes
    ]


def world(seed, shape, share):
    rng = np.random.default_rng(seed)
    free = rng.random(shape) > share
    factor = 1 + np.where(rng.random() < 0.3, 0, 3) * rng.random(shape)
    return free, ndimage.uniform_filter(factor, 3) if rng.random() < 0.5 else factor


@given(
    seed=st.integers(0, 10**6),
    sizes=st.sampled_from(SIZES),
    share=st.sampled_from([0.0, 0.15, 0.3, 0.45]),
    has_top=st.booleans(),
    epsilon=st.sampled_from([0.0, 0.0, 0.02, 0.5]),
)
@settings(max_examples=examples(80), deadline=None)
def test_paths_cost_what_dijkstra_finds(seed, sizes, share, has_top, epsilon):
    free, factor = world(seed, (23, 31), share)
    overlay = build_overlay(free, nested(free, sizes), factor, top_bytes=1e9 if has_top else 0)
    search = OverlaySearch(overlay, near_cells=[0, 0, 10, 60, 1000][seed % 5])
    judge = WeightedJudge(free, factor)
    cells = np.argwhere(free)
    rng = np.random.default_rng(seed)
    for start, goal in cells[rng.integers(len(cells), size=(12, 2))].tolist():
        judge.check(search.path(start, goal, epsilon=epsilon), start, goal, epsilon=epsilon)


def test_fields_without_moves_are_passed_by():
    """The first field holds a single cell without a neighbour."""
    free = np.ones((8, 8), dtype=np.bool_)
    free[:2, :2] = [[True, False], [False, False]]
    search = OverlaySearch(build_overlay(free, nested(free, (2, 4, 8))), near_cells=0)
    judge = WeightedJudge(free, np.ones((8, 8)))
    for start, goal in [((2, 0), (0, 3)), ((7, 7), (0, 2)), ((0, 0), (7, 7))]:
        judge.check(search.path(start, goal), start, goal)


def test_costs_of_one_need_no_array():
    free = np.ones((9, 9), dtype=np.bool_)
    search = OverlaySearch(build_overlay(free, nested(free, [3])), near_cells=0)
    assert search.path((0, 0), (8, 8)).cost_cells == pytest.approx(8 * np.sqrt(2))


def test_fields_that_are_not_nested_are_refused():
    free = np.ones((6, 6), dtype=np.bool_)
    with pytest.raises(InvalidValueError, match="must lie in one field of the next level"):
        build_overlay(free, [*nested(free, [2]), *nested(free, [3])])


@pytest.mark.parametrize("bad", [0.5, np.nan, np.inf, -1.0, 5000.0])
def test_factors_out_of_range_are_refused(bad):
    free = np.ones((6, 6), dtype=np.bool_)
    factor = np.ones((6, 6))
    factor[2, 2] = bad
    with pytest.raises(InvalidValueError, match="expected a number from 1 to 1000"):
        build_overlay(free, nested(free, [3]), factor)
    overlay = build_overlay(free, nested(free, [3]))
    with pytest.raises(InvalidValueError, match="expected a number from 1 to 1000"):
        overlay.update(factor)


def test_factors_of_another_shape_are_refused():
    free = np.ones((6, 6), dtype=np.bool_)
    with pytest.raises(InvalidValueError, match=r"the map has \(6, 6\)"):
        build_overlay(free, nested(free, [3]), np.ones((6, 5)))


@pytest.mark.parametrize("bad", [[[1.0, 2.0], [1.0]], "high", None, [["a"]]])
def test_factors_that_are_no_numbers_are_refused(bad):
    free = np.ones((2, 2), dtype=np.bool_)
    overlay = build_overlay(free, nested(free, [2]))
    with pytest.raises(InvalidValueError, match="give an array of rows and columns"):
        overlay.update(bad)


def test_lists_of_factors_are_taken():
    factor: Any = [[1.0, 3.0, 3.0, 1.0]]
    free = np.ones((1, 4), dtype=np.bool_)
    overlay = build_overlay(free, nested(free, [2]))
    overlay.update(factor)
    assert OverlaySearch(overlay).path((0, 0), (0, 3)).cost_cells == 7.0


def test_an_overlay_without_levels_is_refused():
    with pytest.raises(InvalidValueError, match="was given no level"):
        build_overlay(np.ones((2, 2), dtype=np.bool_), [])


@pytest.mark.parametrize("sizes", [("a",), (), (9, 3), (np.nan,)])
def test_sizes_that_do_not_rise_are_refused(sizes):
    with pytest.raises(InvalidValueError, match="expected rising numbers"):
        OverlayOptions(field_cells=sizes)


@pytest.mark.parametrize("places", [17, 2])
def test_costs_are_those_of_the_factors_as_given(places):
    """Factors that are no whole units cost what they are, whole ones too."""
    free = np.ones((5, 9), dtype=np.bool_)
    factor = 1 + np.round(np.random.default_rng(places).random((5, 9)) * 2**places) / 2**places
    overlay = build_overlay(free, nested(free, [3]), factor)
    search = OverlaySearch(overlay)
    WeightedJudge(free, factor).check(search.path((0, 0), (4, 8)), (0, 0), (4, 8))
    factor[1:3, 2:5] = 1 / 3 + 1
    overlay.update(factor, changed=(1, 3, 2, 5))
    WeightedJudge(free, factor).check(search.path((0, 0), (4, 8)), (0, 0), (4, 8))


def test_paths_that_do_not_fit_are_refused_and_change_nothing():
    """A corridor of 24 cells whose factors add up to more than 16,000 cells."""
    free = np.ones((1, 24), dtype=np.bool_)
    overlay = build_overlay(free, nested(free, [24]))
    search = OverlaySearch(overlay, near_cells=0)
    with pytest.raises(PathsTooLongError, match="use smaller fields"):
        overlay.update(np.full((1, 24), 1000.0))
    assert search.path((0, 0), (0, 23)).lower_bound_cells == 23


def test_long_paths_over_fields_that_fit_are_found():
    """Each field is crossed at less than 16,000 cells, all at more than 32 bits hold."""
    free = np.ones((1, 80), dtype=np.bool_)
    factor = np.full((1, 80), 1000.0)
    overlay = build_overlay(free, nested(free, [4, 12]), factor)
    found = OverlaySearch(overlay, near_cells=0).path((0, 0), (0, 79))
    assert found.lower_bound_cells == found.cost_cells == 79 * 1000


def test_endpoints_and_epsilon_out_of_range_are_refused():
    free = np.ones((4, 8), dtype=bool)
    search = OverlaySearch(build_overlay(free, nested(free, (4,)), np.ones((4, 8))))
    for epsilon in (np.nan, np.inf, -0.1):
        with pytest.raises(InvalidValueError, match="epsilon must be a finite number >= 0"):
            search.path((0, 0), (0, 7), epsilon=epsilon)
    for cell in ((-1, 0), (0, 8), (9, 9)):
        for ends in ((cell, (0, 0)), ((0, 0), cell)):
            with pytest.raises(InvalidValueError, match="is not on the map of"):
                search.path(*ends)


@pytest.mark.parametrize("near_cells", [-1, 2_000_000, 0.5, np.nan, "all"])
def test_a_first_search_of_no_whole_number_of_cells_is_refused(near_cells):
    free = np.ones((4, 8), dtype=np.bool_)
    overlay = build_overlay(free, nested(free, [4]))
    with pytest.raises(InvalidValueError, match="expected a whole number from 0"):
        OverlaySearch(overlay, near_cells=near_cells)


def test_cells_close_together_need_no_border_cell():
    """A search among cells settles them, also where one is walled in."""
    free = np.ones((60, 60), dtype=np.bool_)
    free[50:53, 50:53] = [[False] * 3, [False, True, False], [False] * 3]
    factor = 1 + np.random.default_rng(0).random(free.shape)
    search = OverlaySearch(build_overlay(free, nested(free, [5, 15]), factor))
    judge = WeightedJudge(free, factor)
    for start, goal in [((3, 3), (9, 12)), ((9, 12), (9, 12)), ((51, 51), (45, 45))]:
        found = search.path(start, goal)
        judge.check(found, start, goal)
        assert found.expanded_border_cells == 0
        assert 0 <= found.expanded <= 1000


def test_grids_with_corner_cutting_are_refused():
    grid = hn.OccupancyGrid(np.zeros((6, 6), np.float32), robot_radius_m=0, corner_cutting=True)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
    with pytest.raises(InvalidValueError, match="without corner cutting"):
        prepare_overlay(topology)


def test_levels_whose_tables_do_not_fit_are_left_out():
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("office")))
    enterable = topology.grid.enterable()
    most, none = OverlayOptions(), OverlayOptions(table_bytes_per_cell=0)
    assert len(overlay_fields(topology.pyramid, enterable, most)) == 3
    assert len(overlay_fields(topology.pyramid, enterable, none)) == 2
    ends = (48, 215), (531, 294)
    costs = [
        OverlaySearch(prepare_overlay(topology, options=options)).path(*ends).cost_cells
        for options in (most, none)
    ]
    assert costs[0] == costs[1] < np.inf


def stored(seed):
    """An overlay of three levels with all that it can store, and its map."""
    free, factor = world(seed, (23, 31), [0.1, 0.3][seed % 2])
    return build_overlay(free, nested(free, (3, 9, 18)), factor, top_bytes=1e9), free, factor


@pytest.mark.parametrize("seed", range(4))
def test_distances_between_gates_are_least_costs(seed):
    """Each move over the last level leads from or to a gate."""
    overlay, free, factor = stored(seed)
    levels, top, judge = overlay.levels, overlay.top, WeightedJudge(free, factor)
    first = int(levels.node_at[levels.level_at[-2]])
    nodes = np.arange(first, len(levels.cell_of))
    starts = np.repeat(nodes, np.diff(levels.move_at[first:]))
    ends = levels.move_to[levels.move_at[first] :]
    assert (np.isin(starts, top.gates) | np.isin(ends, top.gates)).all()
    assert 0 < len(top.gates) < 0.6 * len(nodes)
    cells = np.array(np.unravel_index(levels.cell_of[top.gates], free.shape)).T
    for k in range(0, len(cells), 5):
        least = judge.least(cells[k])[1][tuple(cells.T)]
        kept = [top.distance[clique_place(k, j)] for j in range(len(cells))]
        is_reached = np.isfinite(least)
        np.testing.assert_array_equal(np.array(kept)[is_reached] / (2 * UNITS), least[is_reached])
        assert (np.array(kept)[~is_reached] > 2 * UNITS * least[is_reached].max()).all()


@pytest.mark.parametrize("seed", range(4))
def test_distances_over_exits_are_least_costs_inside_the_field(seed):
    overlay, free, factor = stored(seed)
    levels = overlay.levels
    slots = slots_of(overlay.ground, (slice(0, 23), slice(0, 31)))
    around = levels.parent[levels.parent[np.maximum(overlay.ground.field_of[slots], 0)]]
    for child in range(levels.level_at[1], levels.level_at[2]):
        field = levels.parent[child]
        inside = free & (around == field)
        judge = WeightedJudge(inside, factor)
        below, nodes = (np.arange(*levels.node_at[each : each + 2]) for each in (child, field))
        ends = np.unravel_index(levels.cell_of[nodes], free.shape)
        for i in range(0, len(below), 4):
            row = levels.clique[levels.clique_at[child] :]
            to_own = np.array([row[clique_place(i, j)] for j in range(len(below))], dtype=np.int64)
            to_own[to_own >= (1 << 30) - 1] = 1 << 60
            reach = np.zeros(len(nodes), dtype=np.int64)
            reach_over_exits(levels, child, to_own, reach)
            start = np.unravel_index(levels.cell_of[below[i]], free.shape)
            least = judge.least(start)[1][ends]
            expected = np.where(np.isfinite(least), least * 2 * UNITS, 1 << 60)
            np.testing.assert_array_equal(reach, expected)


@pytest.mark.parametrize("name", ["steps", "clique", "marks", "move_cost", "distance"])
def test_costs_that_contradict_each_other_end_in_an_error_or_a_path(name):
    refused = 0
    for seed in range(6):
        overlay, free, _ = stored(seed)
        part = overlay.top if name == "distance" else overlay.levels
        array, rng = getattr(part, name), np.random.default_rng(seed)
        wrong = rng.random(array.size) < 0.3
        array[wrong] = rng.permutation(array)[wrong]
        search, cells = OverlaySearch(overlay, near_cells=0), np.argwhere(free)
        for start, goal in cells[rng.integers(len(cells), size=(60, 2))].tolist():
            try:
                found = search.path(start, goal).cells
            except HybridNavError:
                refused += 1
                continue
            if found is not None:
                assert found[[0, -1]].tolist() == [start, goal]
                assert (np.abs(np.diff(found, axis=0)) <= 1).all()
    assert refused


@given(
    seed=st.integers(0, 10**6), share=st.sampled_from([0.0, 0.15, 0.3]), most=st.integers(0, 300)
)
@settings(max_examples=examples(80), deadline=None)
def test_a_search_that_ends_early_states_no_path(seed, share, most):
    """A path that is not proved may pass cells whose distance has fallen since."""
    free, factor = world(seed, (25, 30), share)
    overlay = build_overlay(free, nested(free, [5]), factor)
    judge, distance = WeightedJudge(free, factor), np.full(free.size, FAR, dtype=np.int32)
    cells = np.argwhere(free)
    rng = np.random.default_rng(seed)
    for start, goal in cells[rng.integers(len(cells), size=(20, 2))].tolist():
        ends = (start[0] * 30 + start[1], goal[0] * 30 + goal[1])
        cost, flat, is_proved, expanded = search_near(overlay.ground, *ends, most, distance)
        assert (distance == FAR).all()
        assert expanded <= most
        if not is_proved:
            assert cost == NO_PATH
            assert not flat.size
            continue
        least = judge.least(start)[1][tuple(goal)]
        if np.isinf(least):
            assert cost == NO_PATH
            continue
        assert (flat[0], flat[-1]) == ends
        assert cost * overlay.cost_unit == least
