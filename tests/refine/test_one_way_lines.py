"""Lines past sides with a direction: the exact test against moves and against crossings, and lines
that are pulled taut."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
from hypothesis import given, settings

import hybridnav as hn
from hybridnav.refine import LineOfSight
from hybridnav.refine.one_way import on_grain, shorten, wrong_at
from hybridnav.search.directed import DirectedSides
from hybridnav.search.found import ClosedCells
from hybridnav.search.grid_search import GridSearch
from tests.closures.test_one_way import STEPS, forbidden_by
from tests.strategies import examples, seeds

PLAIN = settings(max_examples=examples(60), deadline=None, derandomize=True)
SEED = seeds
SHAPE = 9, 11


def random_sides(rng: np.random.Generator, shape: tuple[int, int]) -> DirectedSides:
    """A few chains along rows and columns, and single sides."""
    sides = []
    for _ in range(int(rng.integers(1, 6))):
        row, col = (int(rng.integers(0, n - 1)) for n in shape)
        down, across = ((0, 1), (1, 0))[int(rng.integers(2))]
        for k in range(int(rng.integers(1, 7))):  # a chain that runs across its own direction
            one = row + k * across, col + k * down
            other = one[0] + down, one[1] + across
            if other[0] < shape[0] and other[1] < shape[1]:
                sides.append((*one, *other) if rng.random() < 0.8 else (*other, *one))
    return DirectedSides.of([("sides", np.array(sides))], shape)


@PLAIN
@given(SEED)
def test_a_line_over_centres_obeys_just_if_its_moves_do(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sides = random_sides(rng, SHAPE)
    forbidden, free = forbidden_by(sides.sides, SHAPE), np.ones(SHAPE, np.bool_)
    cell, cells, is_legal = (4, 5), [(4, 5)], True
    for k in rng.integers(0, 8, 12).tolist():
        to = cell[0] + STEPS[k][0], cell[1] + STEPS[k][1]
        if not (0 <= to[0] < SHAPE[0] and 0 <= to[1] < SHAPE[1]):
            continue
        is_legal &= not forbidden[cell] >> k & 1
        cell = to
        cells.append(to)
        wrong = wrong_at(sides, free, np.array(cells) + 0.5, (cells[0], cell))
        assert (wrong is None) is bool(is_legal)


@PLAIN
@given(SEED)
def test_a_line_past_no_corner_obeys_just_if_it_crosses_each_side_rightly(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sides, free = random_sides(rng, SHAPE), np.ones(SHAPE, np.bool_)
    line = np.rint(rng.uniform(0, 1, (4, 2)) * SHAPE * 2.0**24) / 2.0**24
    back = {(*row[2:], *row[:2]) for row in sides.sides.tolist()}
    is_legal = True
    for first, last in pairwise(line):  # far more steps than crossings
        at = first + np.linspace(0, 1, 40_001)[:, None] * (last - first)
        cells = np.floor(at).astype(int)
        moved = np.flatnonzero((np.diff(cells, axis=0) != 0).any(axis=1))
        steps = np.hstack([cells[moved], cells[moved + 1]])
        if (np.abs(steps[:, :2] - steps[:, 2:]).sum(axis=1) != 1).any():
            return  # so near a corner that this judge does not see round which side
        is_legal &= not any(tuple(step) in back for step in steps.tolist())
    ends: Any = [tuple(map(int, np.floor(line[k]))) for k in (0, -1)]
    assert (wrong_at(sides, free, line, ends) is None) is is_legal


def test_a_line_may_touch_the_end_of_a_chain_and_run_along_its_near_lip() -> None:
    # From west to east over the side between columns 4 and 5, in rows 2 to 4.
    chain = np.array([(row, 4, row, 5) for row in (2, 3, 4)])
    sides, free = DirectedSides.of([("door", chain)], SHAPE), np.ones(SHAPE, np.bool_)

    def obeys(first: Any, last: Any, *line: Any, free: Any = free) -> bool:
        return wrong_at(sides, free, np.array(line), (first, last)) is None

    assert obeys((3, 3), (3, 6), (3.5, 3.5), (3.5, 6.5))
    assert not obeys((3, 6), (3, 3), (3.5, 6.5), (3.5, 3.5))
    assert obeys((1, 6), (1, 3), (1.5, 6.5), (2.0, 5.0), (1.5, 3.5))  # touches its end
    assert obeys((3, 6), (1, 3), (3.5, 6.5), (2.0, 5.0), (1.5, 3.5))  # round its end
    assert not obeys((3, 6), (3, 3), (3.5, 6.5), (3.0, 5.0), (3.5, 3.5))  # through a corner of it
    assert obeys((2, 5), (4, 5), (2.5, 5.0), (4.5, 5.0))  # along it, on one side
    assert obeys((6, 5), (0, 4), (6.5, 5.5), (5.0, 5.0), (2.0, 5.0), (0.5, 4.5))  # along and round
    assert obeys((6, 5), (2, 4), (6.5, 5.5), (5.5, 5.0), (3.0, 5.0), (2.5, 4.5))  # on its far lip
    assert not obeys((4, 6), (2, 4), (4.5, 6.5), (4.0, 5.0), (3.0, 5.0), (2.5, 4.5))
    assert obeys((3, 4), (3, 5), (3.0, 5.0), (4.0, 5.0))  # the ends lie on both lips
    assert not obeys((3, 5), (3, 4), (3.0, 5.0), (4.0, 5.0))
    wall = free.copy()
    wall[1] = False  # its end is in a wall: no way round
    assert not obeys((3, 6), (2, 3), (3.5, 6.5), (2.0, 5.0), (2.5, 3.5), free=wall)


@PLAIN
@given(SEED)
def test_a_taut_line_obeys_and_is_no_longer_than_its_cells(seed: int) -> None:
    rng = np.random.default_rng(seed)
    shape = 16, 18
    sides = random_sides(rng, shape)
    occupied = rng.random(shape) < 0.1
    grid = hn.OccupancyGrid(occupied.astype(np.float32), robot_radius_m=0)
    free = grid.enterable()
    cells = np.argwhere(free)
    first, last = (tuple(cells[k].tolist()) for k in rng.integers(0, len(cells), 2))
    path = GridSearch(free).search(first, last, one_way=sides).cells
    if path is None:
        return
    ends = [grid.frame.points_of(np.array([cell]))[0] for cell in (first, last)]
    closed = ClosedCells(np.empty(0, np.int64), one_way=sides)
    line = shorten(LineOfSight(grid), closed, path, ends)
    assert np.array_equal(line[[0, -1]][: len(line)], np.array(ends)[: len(line)])
    assert wrong_at(sides, free, on_grain(line, grid.frame, shape), (first, last)) is None
    length = np.hypot(*np.diff(line, axis=0).T).sum()
    steps = np.hypot(*np.diff(path, axis=0).T).sum()
    assert length <= steps + 1e-9
    assert length >= math.dist(*ends) - 1e-9
