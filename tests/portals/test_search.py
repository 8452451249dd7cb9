"""Paths over portals, and their bounds, against scipy's Dijkstra on the legal moves."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hybridnav.grid.worlds import figure1_world, office_world
from hybridnav.portals import PortalSearch, prepare_portals
from hybridnav.portals._side_kernels import bounds_by_sides, side_costs
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.moves import FAR, STRAIGHT
from hybridnav.topology import TopologicalMap
from tests.divided import GATES, Divided, components_of, costs_from, partitions
from tests.portal_judge import EPSILONS, Judge, length_of
from tests.strategies import MAX_SIDE, drawn, examples, occupancy_grid, scenes

if TYPE_CHECKING:
    from tests.strategies import Scene

seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=examples(60), derandomize=True, deadline=None)
@given(partitions(), st.sampled_from(GATES), seeds)
def test_paths_and_bounds_on_random_fields(divided: Divided, gates: str, seed: int) -> None:
    assume(divided.free.any())
    Judge(divided, gates).run(seed)


@settings(max_examples=examples(30), derandomize=True, deadline=None)
@given(partitions(), st.sampled_from(GATES), st.integers(1, 16), seeds)
def test_paths_and_bounds_with_a_rounded_table(
    divided: Divided, gates: str, bits: int, seed: int
) -> None:
    assume(divided.free.any())
    Judge(divided, gates, bits=bits).run(seed)


@settings(max_examples=examples(50), derandomize=True, deadline=None)
@given(partitions(), st.sampled_from([0, 0, 3]), seeds)
def test_ways_by_two_sides_cost_at_least_what_bounds_say(
    divided: Divided, bits: int, seed: int
) -> None:
    assume(divided.free.any())
    search, rng = Judge(divided, bits=bits).search, np.random.default_rng(seed)
    cols = divided.grid.shape[1]
    starts, cells = search.portals.side_start, np.flatnonzero(divided.free)
    for endpoints in rng.choice(cells, size=(6, 2)).tolist():
        fields = divided.label[endpoints].tolist()
        low = [
            side_costs(search.portals, cols, *pair) for pair in zip(fields, endpoints, strict=True)
        ]
        first, last = starts[fields].tolist()
        bounds = bounds_by_sides(search.tables.between, search.tables.shift, first, last, *low)
        assert bounds.shape == (starts[fields[0] + 1] - first, starts[fields[1] + 1] - last)
        inside = costs_from(divided.inside, np.array(endpoints))
        for (i, j), bound in np.ndenumerate(bounds):
            cost = cost_by_sides(divided, search.portals, (first + i, last + j), inside)
            assert bound <= cost
            assert (bound >= FAR) == (cost == math.inf)


def cost_by_sides(divided: Divided, portals: Any, sides: tuple[int, int], inside: Any) -> float:
    """Least cost from the start to a gate of its side inside their field, to another field's cell
    beside a gate of the goal's side, into that gate, and inside its field to the goal."""
    starts = portals.side_gates_start
    out, into = (portals.side_gates[starts[side] : starts[side + 1]] for side in sides)
    tails = portals.gate_cell[out]
    over = (inside[0][tails][:, None] + costs_from(divided.moves, tails)).min(axis=0)
    best = math.inf
    for gate in into.tolist():
        exits = slice(*portals.exit_start[gate : gate + 2])
        beside = portals.gate_cell[portals.exit_gate[exits]]
        entered = (over[beside] + portals.exit_cost[exits]).min()
        best = min(best, entered + inside[1][portals.gate_cell[gate]])
    return best


@settings(max_examples=examples(50), derandomize=True, deadline=None)
@given(partitions(), st.sampled_from(GATES), st.sampled_from([0, 9]), seeds)
def test_many_answers_are_those_of_each_pair(
    divided: Divided, gates: str, bits: int, seed: int
) -> None:
    assume(divided.free.any())
    rng = np.random.default_rng(seed)
    judge = Judge(divided, gates, bits=bits)
    free = judge.free
    starts, goals = free[rng.integers(len(free), size=(2, 12))]
    epsilon = float(rng.choice(EPSILONS))
    found = judge.search.many(starts, goals, epsilon=epsilon)
    assert found.path_start[-1] == len(found.points)
    for k, (start, goal) in enumerate(zip(starts.tolist(), goals.tolist(), strict=True)):
        answer = judge.path(start, goal, epsilon)
        share = judge.label[tuple(start)] == judge.label[tuple(goal)]
        if judge.search.is_exact and not (share or bits):
            assert found.is_done[k]
        if not (share or bits):  # as short as a path over gates can be, within the part asked for
            over_gates = costs_from(judge.gate_moves, np.array([judge.flat(start)]))[0]
            best = over_gates[judge.flat(goal)]
            assert (found.length_cells[k] == math.inf) == (best == math.inf)
            if math.isfinite(best):
                length = length_of(best)
                assert length * (1 - 1e-9) <= found.length_cells[k]
                assert found.length_cells[k] <= (1 + epsilon) * length * (1 + 1e-9)
        if found.is_done[k]:
            assert not share
            assert answer.expanded == 0
            assert found.length_cells[k] == answer.length_cells
            assert found.lower_bound_cells[k] == answer.lower_bound_cells
            points = found.points[slice(*found.path_start[k : k + 2])]
            assert np.array_equal(points, answer.points)


@settings(max_examples=examples(15), derandomize=True, deadline=None)
@given(scenes(min(MAX_SIDE, 40)), seeds)
def test_paths_and_bounds_on_the_fields_that_are_chosen(scene: Scene, seed: int) -> None:
    judge = Judge.of(TopologicalMap(scene.pyramid("survivor")))
    assume(len(judge.free))
    judge.run(seed)


@pytest.mark.parametrize(
    ("name", "merge_distance_m", "gates"),
    [
        ("figure1", 1.0, "all"),
        ("office", 4.0, "all"),
        pytest.param("office", 2.0, "all", marks=pytest.mark.full),
        ("office", math.inf, "sparse"),
    ],
)
def test_paths_and_bounds_on_generated_worlds(
    name: str, merge_distance_m: float, gates: str
) -> None:
    is_small = name == "figure1"
    world, radius_m = (figure1_world(), 0.0) if is_small else (office_world(), 0.25)
    pyramid = DualGraphPyramid.build(
        world.grid(robot_radius_m=radius_m), merge_distance_m=merge_distance_m
    )
    Judge.of(TopologicalMap(pyramid), gates).run(7, 6)


# Little maps, with each pair of their cells

_LITTLE = {
    "one cell": (".",),
    "two fields, one cell each": ("ab",),
    "one-cell door": ("aa#ccc", "aabccc", "aa#ccc"),
    "door between two fields": ("aa#bb", "aaabb", "aa#bb"),
    "fields that meet at a point": ("aab", "aab", "cdd"),
    "a chessboard of cells": ("abab", "baba", "abab"),
    "stairs": ("abcd", "bcde", "cdef", "defg"),
    "stairs along a wall": ("a#dd", "aa#d", "#ab#", "##bb"),
    "walled off": ("aa#cc", "bb#dd"),
    "inside another": ("aaaaa", "abbba", "abcba", "abbba", "aaaaa"),
    "shorter through the other field": ("aba", "a#a", "aaa"),
    "the goal's field is passed twice": ("bbbbb", "a#b#a", "aaaaa"),
    "a field of one border cell": ("bbb", "bbb", "abb"),
}


def divided_as(lines: tuple[str, ...], *, corner_cutting: bool) -> Divided:
    """A map whose fields are the connected components of equal letters."""
    letters = np.array([[ord(letter) for letter in line] for line in reversed(lines)])
    grid = occupancy_grid((letters != ord("#")).astype(np.uint8))
    grid = replace(grid, corner_cutting=corner_cutting)
    divided = Divided(grid, letters.astype(np.int32), (4, 2))
    return replace(divided, field_of=components_of(divided))


@pytest.mark.parametrize("gates", GATES)
@pytest.mark.parametrize("name", _LITTLE)
def test_all_pairs_of_little_maps(name: str, gates: str) -> None:
    for corner_cutting in (False, True):
        divided = divided_as(_LITTLE[name], corner_cutting=corner_cutting)
        for bits in (0, 5):
            judge, rng = Judge(divided, gates, bits=bits), np.random.default_rng(0)
            cells = judge.free.tolist()
            for start in cells:
                judge.judge(start, cells, rng)


@pytest.mark.parametrize("drawing", [("#",), ("?",), ("#?", "??")])
def test_a_map_without_free_cells_has_no_portals(drawing: tuple[str, ...]) -> None:
    pyramid = DualGraphPyramid.build(occupancy_grid(drawn(*drawing)), merge_distance_m=3.0)
    assert Judge.of(TopologicalMap(pyramid)).search.portals.n_gates == 0


@settings(max_examples=examples(15), derandomize=True, deadline=None)
@given(partitions(), st.sampled_from(GATES), seeds)
def test_an_answer_depends_on_its_query_only(divided: Divided, gates: str, seed: int) -> None:
    assume(divided.free.any())
    rng = np.random.default_rng(seed)
    judge = Judge(divided, gates)
    free = judge.free
    queries = free[rng.integers(len(free), size=(6, 2))].tolist()
    first = [judge.path(start, goal) for start, goal in queries]
    kept = [None if answer.cells is None else answer.cells.copy() for answer in first]
    for k in rng.permutation(len(queries)).tolist():
        again, cells = judge.path(*queries[k]), kept[k]
        assert again.lower_bound_cells == first[k].lower_bound_cells
        assert again.length_cells == first[k].length_cells
        for other in (again.cells, first[k].cells):
            assert (other is None) == (cells is None)
            assert other is None or np.array_equal(other, cells)


@pytest.mark.parametrize("merge_distance", [1.0, 3.0, math.inf])
def test_open_floors_find_a_level_whatever_the_merge_distance(merge_distance: float) -> None:
    grid = occupancy_grid(drawn(*["." * 300] * 300))
    pyramid = DualGraphPyramid.build(grid, merge_distance_m=merge_distance)
    built = prepare_portals(TopologicalMap(pyramid))
    search = PortalSearch(built, GridSearch(grid.enterable()), grid.frame)
    found = search.path((3, 3), (290, 200))
    assert found.cells is not None
    assert len(found.cells) == 288


def test_ways_too_long_for_the_table_are_rounded_only_there() -> None:
    # A corridor to and fro, 55,737 steps along: lanes of 400 cells, joined at either end in turn.
    free = np.zeros((277, 400), dtype=np.uint8)
    free[::2] = 1
    free[1::4, -1] = free[3::4, 0] = 1
    row, col = np.indices(free.shape)
    step = row // 2 * 401 + np.where(row % 2, 400, np.where(row // 2 % 2, 399 - col, col))
    divided = Divided(occupancy_grid(free), (step // 1000).astype(np.int32), (16, 4))
    judge = Judge(divided, bits=None)
    portals, tables = judge.search.portals, judge.search.tables
    at = step.ravel()[portals.gate_cell].astype(np.int64)
    costs = np.abs(at[portals.source_gate, None] - at) * STRAIGHT
    assert tables.shift == 2
    assert np.array_equal(tables.distance, costs >> 2)
    along = np.argwhere(free)[np.argsort(step[free == 1])]
    for first, last in ((0, 55737), (55737, 0), (3, 53900), (1500, 1400), (999, 1000)):
        answer = judge.path(along[first], along[last])
        onward = 1 if last > first else -1
        assert answer.cells is not None
        assert np.array_equal(answer.cells, along[np.arange(first, last + onward, onward)])
        assert answer.length_cells == answer.lower_bound_cells == abs(first - last)
