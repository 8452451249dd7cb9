"""The oracle itself: answers known by hand, and its agreement with an explicit contraction."""

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.oracle.checks import check_base, check_level
from tests.oracle.pyramid import (
    Base,
    boundaries,
    distances_in_fields,
    farthest_squared,
    full_blocks,
    holes,
    n_field_pieces,
    through_cells,
)
from tests.oracle.reference import ALL_RULES, PlaneMap
from tests.strategies import IS_FULL, class_grids, drawn, examples

ISLAND = drawn("......", "..??..", "..??..", "......")
"""A free place round an unexplored island."""
SPANNING = [((0, 0), (0, 1)), ((0, 0), (1, 0)), ((1, 0), (1, 1))]
"""Contractions that leave a 2x2 block one self-loop."""
PILLAR = drawn("....", ".#..", "....")
TWO_DOORS = drawn("..??", "..#?", "..??")
"""An obstacle on the line between a free and an unexplored place."""


def by_class(classes):
    plane = PlaneMap(classes)
    collapse(plane)
    return plane.level().field_of


def collapse(plane, rng=None):
    """Contract edge by edge until no edge of one class is left, then simplify."""
    edges = plane.contractible()
    for dart in rng.sample(edges, len(edges)) if rng else edges:
        if not plane.is_loop(dart):
            plane.contract(dart)
    plane.simplify(rng=rng)


def halve(plane, rng):
    """Contract a random forest of edges of one class; simplify in random order."""
    for dart in rng.sample(plane.contractible(), len(plane.contractible()) // 2):
        if dart in plane.sigma and not plane.is_loop(dart) and rng.random() < 0.3:
            plane.contract(dart)
    plane.simplify(rng=rng)


@pytest.mark.parametrize(
    ("lines", "ordinary", "protected", "components", "obstacle_sets"),
    [
        (["."], 0, 0, 1, 1),
        (["#"], 0, 0, 0, 1),
        (["...."], 0, 1, 1, 1),
        (["..", ".."], 1, 1, 1, 1),
        (["...", ".#.", "..."], 0, 2, 1, 2),
        (["..#..", "#####", ".?#.#"], 0, 3, 4, 1),
        (["....", ".#..", "..#.", "...."], 2, 2, 1, 2),
    ],
)
def test_base_counts(lines, ordinary, protected, components, obstacle_sets):
    base = Base.of(drawn(*lines))
    counts = (len(base.ordinary), len(base.protected), base.n_components, base.n_obstacle_sets)
    assert counts == (ordinary, protected, components, obstacle_sets)


def test_base_darts_turn_counter_clockwise_with_y_up():
    sigma = base_sigma_round((1, 1))
    assert sigma == [((1, 1), (1, 2)), ((1, 1), (2, 1)), ((1, 1), (1, 0)), ((1, 1), (0, 1))]


def base_sigma_round(cell):
    sigma = Base.of(np.ones((3, 3), dtype=np.uint8)).sigma
    darts = [(cell, (cell[0], cell[1] + 1))]
    for _ in range(3):
        darts.append(sigma[darts[-1]])
    assert sigma[darts[-1]] == darts[0]
    return darts


@given(class_grids(max_side=12))
@settings(max_examples=examples(60), deadline=None, derandomize=True)
def test_base_faces_are_blocks_and_obstacles(classes):
    base = Base.of(classes)
    inside = np.where(classes > 0, 0, -1)
    padded = np.pad(classes > 0, 1)
    beside = padded[2:, 1:-1] | padded[:-2, 1:-1] | padded[1:-1, 2:] | padded[1:-1, :-2]
    n_isolated = int(((classes > 0) & ~beside).sum())
    assert len(base.ordinary) == full_blocks(inside)
    assert len(base.protected) == base.n_protected(n_isolated)


def test_boundary_round_an_island_is_one_ring():
    found = boundaries(by_class(ISLAND))
    assert (found.n_boundaries, len(found.label), found.ring.tolist()) == (1, 8, [True])
    assert found.n_ordinary_faces == 1


def test_two_doors_are_two_boundaries():
    assert boundaries(by_class(TWO_DOORS)).ring.tolist() == [False, False]


def test_corner_of_three_fields_is_a_meeting_point():
    found = boundaries(np.array([[0, 0], [1, 2]]))
    assert (found.n_boundaries, found.meetings) == (3, [(0, 0)])


def test_a_block_that_is_not_full_opens_a_ring_and_two_cut_it():
    assert boundaries(np.array([[0, 0, 0], [0, 1, 0], [0, 0, -1]])).ring.tolist() == [False]
    assert boundaries(np.array([[0, 0, -1], [0, 1, 0], [0, 0, -1]])).ring.tolist() == [False] * 2


def test_pieces_and_holes_of_fields():
    assert n_field_pieces(np.array([[0, 1], [1, 0]])) == 4
    assert holes(by_class(PILLAR)).tolist() == [1]
    assert holes(by_class(drawn(".....", ".#.#.", "....."))).tolist() == [2]
    # Two obstacles that touch at a corner are one hole; one at the border is none.
    assert holes(by_class(drawn("....", ".#..", "..#.", "...."))).tolist() == [1]
    assert holes(by_class(drawn("...", ".#.", ".#."))).tolist() == [0]


def test_paths_in_fields_cut_no_corner():
    classes = drawn("..", ".#")
    reach = distances_in_fields(classes, np.where(classes > 0, 0, -1), np.array([[0, 0]]))
    assert reach[1].tolist() == [1, 2]
    # A side cell may lie outside the field, or unexplored beside an unexplored field, but
    # unexplored beside a free field it is not enterable.
    field_of = np.array([[0, 0], [-1, 0]])
    start = np.array([[0, 0]])
    assert distances_in_fields(drawn("..", ".."), field_of, start)[1, 1] == math.sqrt(2)
    assert distances_in_fields(drawn("?.", ".."), field_of, start)[1, 1] == 2
    assert distances_in_fields(drawn(".?", "??"), field_of, start)[1, 1] == math.sqrt(2)


def test_through_is_measured_at_the_nearest_crack():
    classes = np.ones((2, 4), dtype=np.uint8)
    field_of = np.array([[0, 0, 1, 1], [0, 0, 1, 1]])
    reach = distances_in_fields(classes, field_of, np.array([[0, 0], [1, 3]]))
    assert through_cells(boundaries(field_of), reach).tolist() == [2 + math.sqrt(2)]


def test_farthest_cells():
    assert farthest_squared(np.array([[0, 0], [0, 1]]), np.array([[3, 1], [0, 2]])) == 10


@pytest.mark.parametrize(
    ("classes", "arcs", "loops"),
    [
        (ISLAND, 1, 1),
        (PILLAR, 0, 1),
        (TWO_DOORS, 2, 0),
        (drawn("."), 0, 0),
        (drawn("........"), 0, 0),
        (drawn("..?.."), 2, 0),
        # The island is linked to both sides of its obstacle, and the free ring encloses it.
        (drawn(".....", ".??#.", "....."), 1, 1),
        # Rings in rings: the middle one keeps what it encloses apart from what surrounds it.
        (drawn("?????", "?...?", "?.?.?", "?...?", "?????"), 2, 2),
        # A room behind walls belongs to the hole that the walls make.
        (drawn(".....", ".###.", ".#.#.", ".###.", "....."), 0, 1),
    ],
)
def test_collapsed_maps_have_the_arcs_of_their_boundaries(classes, arcs, loops):
    plane = PlaneMap(classes)
    collapse(plane)
    level = plane.level()
    check_level(level, Base.of(classes))
    n_loops = int((level.arcs[:, 0] == level.arcs[:, 1]).sum())
    assert (level.n_arcs - n_loops, n_loops) == (arcs, loops)


@given(class_grids(max_side=24 if IS_FULL else 14), st.randoms(use_true_random=False))
@settings(max_examples=examples(40, full=600), deadline=None)
def test_rules_and_oracle_agree(classes, rng):
    base = Base.of(classes)
    plane = PlaneMap(classes)
    check_base(plane.level(), base)
    for _ in range(4):
        halve(plane, rng)
        check_level(plane.level(), base)
    collapse(plane, rng)
    check_level(plane.level(), base)


def is_noticed(rule, seed):
    rng = random.Random(seed)
    weights = [1, 12, 12 * (seed % 2)]
    classes = np.array(rng.choices([0, 1, 2], weights, k=144), dtype=np.uint8)
    plane = PlaneMap(classes.reshape(12, 12), rules=ALL_RULES - {rule})
    collapse(plane, rng)
    try:
        check_level(plane.level(), Base.of(plane.classes))
    except AssertionError:
        return True
    return False


@pytest.mark.parametrize("rule", sorted(ALL_RULES))
def test_every_rule_is_needed(rule):
    assert any(is_noticed(rule, seed) for seed in range(300))


def test_replayed_kernels_give_the_same_darts():
    rng = random.Random(3)
    classes = np.array(rng.choices([0, 1, 2], [1, 9, 3], k=400), dtype=np.uint8).reshape(20, 20)
    first, second = PlaneMap(classes), PlaneMap(classes)
    kernel = []
    for dart in rng.sample(first.contractible(), 300):
        if dart in first.sigma and not first.is_loop(dart):
            first.contract(dart)
            kernel.append(dart)
    removed = first.simplify(rng=rng)
    # The order of a kernel matters to who survives only; the fields here keep theirs.
    second.step(kernel, removed=removed[::-1])
    assert second.sigma == first.sigma
    with pytest.raises(ValueError, match="no rule asks"):
        PlaneMap(np.ones((3, 3), dtype=np.uint8)).step([], removed=[((0, 0), (0, 1))])
    with pytest.raises(ValueError, match="none was"):
        PlaneMap(np.ones((2, 2), dtype=np.uint8)).step(SPANNING, removed=[])
