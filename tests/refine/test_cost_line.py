"""Lines that settle where they cost least: legal, never dearer, with the same ends, near the
cheapest; and their arcs."""

from typing import Any

import numpy as np
import pytest
from scipy import ndimage

from hybridnav.refine import CostLine
from hybridnav.search.lattice import LatticeSearch, build_lattice
from tests.layers import grid_of, layer_of
from tests.oracle.any_angle_cost import SidePoints
from tests.search.lattice.scenes import Field, fields, settled
from tests.strategies import MAX_SIDE, drawn, seeds, tried

SLACK = 1e-12
"""Rounding of sums of costs, relative."""


def check(field: Field, line: Any) -> Any:
    """The line that another one settles to is legal, no dearer, and has the same ends."""
    found = settled(field, line)
    assert (found[[0, -1]] == line[[0, -1]]).all()
    assert field.faults(found) == ()
    assert field.cost(found) <= field.cost(line) * (1 + SLACK)
    assert settled(field, line).tobytes() == found.tobytes()
    assert (np.diff(found, axis=0) != 0).any(axis=1).all()  # no point stands there twice
    return found


def lattice_lines(field: Field, rng: np.random.Generator, count: int) -> list[Any]:
    search = LatticeSearch(build_lattice(field.free, field.factors))
    cells, ends = (each.reshape(-1, 2, 2) for each in field.positions(rng, 2 * count))
    found = [
        search.line(tuple(start), tuple(goal), (tuple(a), tuple(b))).positions
        for (start, goal), (a, b) in zip(ends.tolist(), cells.tolist(), strict=True)
    ]
    return [line for line in found if line is not None and (line[0] != line[-1]).any()]


@tried(150, fields(MAX_SIDE), seeds)
def test_it_is_legal_and_never_dearer(field: Field, seed: int) -> None:
    for line in lattice_lines(field, np.random.default_rng(seed), 6):
        check(field, line)


@tried(60, fields(MAX_SIDE), seeds)
def test_a_line_that_settled_stays_legal_and_no_dearer_when_it_settles_again(field, seed):
    for line in lattice_lines(field, np.random.default_rng(seed), 3):
        check(field, check(field, line))


@tried(60, fields(MAX_SIDE), seeds)
def test_lines_that_wander_and_return_to_a_place(field: Field, seed: int) -> None:
    """Out and back, so that the ends may be the same, over cells in any order."""
    rng = np.random.default_rng(seed)
    lines = lattice_lines(field, rng, 2)
    for line in lines:
        check(field, np.concatenate([line, line[-2::-1]]))
        inner = rng.integers(len(line))
        back = np.concatenate([line[: inner + 1], line[:inner][::-1], line[1:]])
        if (np.diff(back, axis=0) != 0).any(axis=1).all():
            check(field, back)


@tried(60, fields(MAX_SIDE), seeds)
def test_lines_that_graze_obstacles_where_all_costs_are_alike(field: Field, seed: int) -> None:
    """From corner to corner of blocked cells, and along their sides."""
    plain = Field(field.free, np.ones(field.free.shape, np.float32))
    rng = np.random.default_rng(seed)
    blocked = np.argwhere(~plain.free)
    if not len(blocked):
        return
    for _ in range(10):
        corners = blocked[rng.integers(len(blocked), size=5)] + rng.integers(0, 2, (5, 2))
        line = corners.astype(float)
        line = line[np.append(True, (np.diff(line, axis=0) != 0).any(axis=1))]
        if plain.faults(line) == ():
            check(plain, line)


def test_the_rest_of_a_line_whose_point_stands_there_twice() -> None:
    field = Field(np.ones((4, 9), np.bool_), np.ones((4, 9), np.float32))
    line = CostLine(field.grid, layer_of(field.factors))
    points = np.array([[0.5, 0.5], [3.5, 2.5], [3.5, 2.5], [8.5, 0.5]])
    rest = line.rest_of(points, np.array([1.0, 0.5]), 100.0)
    assert rest is not None
    assert rest[[0, -1]].tolist() == [[1.0, 0.5], [8.5, 0.5]]


def test_a_line_round_the_end_of_a_thin_wall_is_pulled_towards_it() -> None:
    """The sharpest turn, where chains end farthest from the cheapest: 8.1 % dearer."""
    free = np.ones((20, 20), np.bool_)
    free[:12, 10] = False
    field = Field(free, np.ones(free.shape, np.float32))
    start, goal = (2.5, 4.5), (2.5, 15.5)
    line = LatticeSearch(build_lattice(free, field.factors)).line(start, goal).positions
    assert line is not None
    least = SidePoints(free, field.factors, 15).cost(start, goal)
    assert field.cost(line) > 1.1 * least
    assert field.cost(check(field, line)) <= 1.09 * least


@pytest.mark.parametrize(
    "points",
    [
        [[0.5, 0.5]],
        [[0.5, 0.5], [0.5, 3.5]],
        [[0.0, 0.0], [3.0, 4.0]],
        [[0.5, 0.5], [0.5, 0.5 + 2.0**-24]],
        [[1.0, 0.0], [1.0, 4.0]],
        [[0.0, 0.0], [0.0, 4.0], [3.0, 4.0]],
        [[0.5, 0.5], [0.5, 0.5 + 2.0**-24], [0.5, 0.5 + 2.0**-23]],
        [[0.5, 0.5], [1.5, 1.5], [0.5, 0.5]],
    ],
)
def test_short_lines_and_lines_along_the_rim(points: list[list[float]]) -> None:
    field = Field(np.ones((3, 4), np.bool_), np.ones((3, 4), np.float32))
    check(field, np.array(points))


def test_ends_on_sides_and_corners_stay_where_they_are() -> None:
    free = drawn("....#...", "....#...", "........", "##..#..#", "....#...") == 1
    field = Field(free, np.random.default_rng(0).uniform(1, 4, free.shape).astype(np.float32))
    search = LatticeSearch(build_lattice(field.free, field.factors))
    ends = [(0.0, 4.0), (1.0, 3.5), (2.0, 4.0), (5.0, 0.0), (3.0, 5.0), (0.0, 8.0), (2.0, 2.0)]

    def cell_of(end: tuple[float, float]) -> tuple[int, int]:
        """A free cell that an end lies in, or at the side of."""
        away = np.abs(np.argwhere(free) + 0.5 - end).max(axis=1)
        row, col = np.argwhere(free)[away.argmin()].tolist()
        return row, col

    for start in ends:
        for goal in ends:
            line = search.line(start, goal, (cell_of(start), cell_of(goal))).positions
            assert line is not None
            if start != goal:
                check(field, line)


@tried(60, fields(MAX_SIDE), seeds)
def test_paths_of_cells_become_no_dearer(field: Field, seed: int) -> None:
    """By `shorten`, which takes cells, and points in metres."""
    rng = np.random.default_rng(seed)
    cells = np.argwhere(field.free)
    if not len(cells):
        return
    path = [cells[rng.integers(len(cells))]]
    for _ in range(20):
        to = path[-1] + rng.permutation([[0, 1], [1, 0], [0, -1], [-1, 0]])[0]
        if (to >= 0).all() and (to < field.free.shape).all() and field.free[tuple(to)]:
            path.append(to)
    walked = np.array(path)
    start, goal = (walked[k] + rng.uniform(0.1, 0.9, 2) for k in (0, -1))
    line = CostLine(field.grid, layer_of(field.factors))
    found = line.shorten(walked, start[::-1].copy(), goal[::-1].copy())
    assert (found[0] == start[::-1]).all()
    assert (found[-1] == goal[::-1]).all()
    assert field.faults(found[:, ::-1]) == ()
    over_cells = np.concatenate([start[None], walked[1:-1] + 0.5, goal[None]])
    assert field.cost(found[:, ::-1]) <= field.cost(over_cells) * (1 + SLACK) + 1e-6


def smooth_field(seed: int, side: int = 40) -> Field:
    """A hall with boxes, and factors from 1 to 4 that change over some four cells."""
    rng = np.random.default_rng(seed)
    free = np.ones((side, side), np.bool_)
    for _ in range(rng.integers(2, 8)):
        row, col = rng.integers(side, size=2)
        free[row : row + rng.integers(1, 9), col : col + rng.integers(1, 9)] = False
    noise = ndimage.gaussian_filter(rng.normal(size=free.shape), 4, mode="nearest")
    factors = 1 + 3 * (noise - noise.min()) / np.ptp(noise)
    return Field(free, factors.astype(np.float32))


def losses(count: int) -> Any:
    """Costs of lines that settled, of 20 cells at least, relative to the oracle's, less 1."""
    found = []
    for seed in range(count):
        field = smooth_field(seed)
        rng = np.random.default_rng(seed)
        _, ends = field.positions(rng, 2, inside=True)
        if np.hypot(*(ends[0] - ends[1])) < 20:
            continue
        search = LatticeSearch(build_lattice(field.free, field.factors))
        line = search.line(tuple(ends[0]), tuple(ends[1])).positions
        assert line is not None
        least = SidePoints(field.free, field.factors).cost(*ends.tolist())
        found.append(field.cost(check(field, line)) / least - 1)
    return np.array(found)


def test_it_is_near_the_cheapest_where_costs_are_smooth() -> None:
    """Measured on 40 maps of 40 x 40 cells: by 0.07 % on average, by 1.2 % at most. The oracle's 7
    points a side miss the least by 0.1 %, so lines can cost less than its paths."""
    loss = losses(40)
    assert len(loss) >= 15
    assert loss.min() >= -0.01
    assert loss.mean() <= 0.002
    assert loss.max() <= 0.015


@tried(60, fields(MAX_SIDE), seeds)
def test_arcs_cost_at_most_a_two_hundredth_more(field: Field, seed: int) -> None:
    grid = grid_of(1.0 - field.free, robot_radius_m=0)
    finish = CostLine(grid, layer_of(field.factors))
    for line in lattice_lines(field, np.random.default_rng(seed), 3):
        points = np.ascontiguousarray(settled(field, line)[:, ::-1])
        for radius_m in (0.3, 2.0):
            arcs = finish.arcs(points, radius_m=radius_m)
            assert arcs.cost_m <= field.cost(points[:, ::-1]) * 1.005 * (1 + 1e-9)
            assert (arcs.points[[0, -1]] == points[[0, -1]]).all()
            # Costs are those of positions on the grain.
            assert arcs.length_m <= arcs.cost_m * (1 + 1e-9) + 2.0**-24 * len(arcs.points)
            assert len(arcs.headings_rad) == len(arcs.points)
