"""The judge of paths against shapely, against fractions, and against paths with planted faults."""

import itertools
import math
import subprocess
import sys
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges import ScipyOptimum, judge_path, segment_faults
from hybridnav.maps import CellClass, OccupancyGrid
from tests.oracle.grid import distances, move_graph
from tests.strategies import class_grids, drawn, framed, occupancy_grid, seeds, tried

Position = tuple[Fraction, Fraction]

small_maps = class_grids(max_side=7)


def faults_of(grid: OccupancyGrid, *positions: tuple[float, float]) -> tuple[str, ...]:
    """Faults of a polyline in grid units, (row, col)."""
    return segment_faults(grid, grid.frame.points_of_grid(positions))


def shapely_finds_no_fault(free: Any, start: Any, end: Any) -> bool:
    """A segment, by what shapely makes of it and of the squares of the cells.

    Positions of a few halves only: shapely's relations are exact for such numbers.
    """
    rows, cols = free.shape
    line = shapely.LineString([start[::-1], end[::-1]])
    cells = [(row, col) for row, col in np.ndindex(rows, cols)]
    box_of = {cell: shapely.box(cell[1], cell[0], cell[1] + 1, cell[0] + 1) for cell in cells}
    if not shapely.box(0, 0, cols, rows).covers(line):
        return False
    if any(line.relate_pattern(box_of[cell], "T********") for cell in cells if not free[cell]):
        return False
    for (row, col), (turn, way) in itertools.product(cells, ((0, 1), (1, 0))):
        # A side shared by two blocked cells, or the map's rim beside one: not in the free space.
        before = (row - turn, col - way)
        side = shapely.LineString([(col, row), (col + turn, row + way)])
        last = (row + turn, col + way)
        for pair, place in (((before, (row, col)), side), (((row, col), last), _far(side, way))):
            free_pair = any(cell in box_of and free[cell] for cell in pair)
            if not free_pair and line.intersection(place).length > 0:
                return False
    return not any(
        _blocked_across(free, row, col)
        and line.relate_pattern(shapely.Point(col, row), "0********")
        for row in range(1, rows)
        for col in range(1, cols)
    )


def _far(side: shapely.LineString, way: int) -> shapely.LineString:
    """The opposite side of the same cell."""
    return shapely.LineString([(x + way, y + 1 - way) for x, y in side.coords])


def _blocked_across(free: Any, row: int, col: int) -> bool:
    (low, right), (left, high) = free[row - 1 : row + 1, col - 1 : col + 1].tolist()
    return (low, high) != (right, left) and low == high and right == left


def fractions_find_no_fault(free: Any, start: Position, end: Position) -> bool:
    """A segment, cut where it crosses the lattice: each piece and each crossing on its own."""
    way = [b - a for a, b in zip(start, end, strict=True)]
    cuts = {Fraction(0), Fraction(1)}
    for axis in (0, 1):
        low, high = sorted((start[axis], end[axis]))
        if way[axis]:
            lines = range(math.ceil(low), math.floor(high) + 1)
            cuts |= {(line - start[axis]) / way[axis] for line in lines}
    before: set[tuple[int, ...]] | None = None
    for first, last in itertools.pairwise(sorted(cuts)):
        middle, corner = (
            (start[0] + t * way[0], start[1] + t * way[1]) for t in ((first + last) / 2, first)
        )
        here = _free_cells_at(free, middle)
        if not here or (before is not None and not _joined(free, corner, before, here)):
            return False
        before = here
    return True


def _free_cells_at(free: Any, position: Position) -> set[tuple[int, ...]]:
    ranges = [range(math.ceil(value) - 1, math.floor(value) + 1) for value in position]
    cells = itertools.product(*ranges)
    return {
        cell for cell in cells if min(cell) >= 0 and np.less(cell, free.shape).all() and free[cell]
    }


def _joined(free: Any, corner: Position, before: set[Any], after: set[Any]) -> bool:
    """Whether free cells before and after a point are one across sides that end there."""
    around, seen = _free_cells_at(free, corner), set(before)
    while True:
        more = {
            c for c in around - seen if any(abs(c[0] - s[0]) + abs(c[1] - s[1]) == 1 for s in seen)
        }
        if not more:
            return bool(seen & after)
        seen |= more


@tried(150, small_maps, seeds)
def test_segments_on_halves_are_judged_as_shapely_does(classes: Any, seed: int) -> None:
    rng, free = np.random.default_rng(seed), classes == CellClass.FREE
    grid = framed(classes, 0.4)
    for _ in range(8):
        start, end = rng.integers(0, 2 * np.array(classes.shape) + 1, size=(2, 2)) / 2
        assume((start != end).any())
        legal = not faults_of(grid, tuple(start), tuple(end))
        assert legal == shapely_finds_no_fault(free, start, end), (start, end)
        assert legal == (not faults_of(grid, tuple(end), tuple(start)))


@tried(200, small_maps, seeds, st.sampled_from([1, 2, 3, 64, 2**24]))
def test_segments_are_judged_exactly(classes: Any, seed: int, parts: int) -> None:
    rng, free = np.random.default_rng(seed), classes == CellClass.FREE
    parts = 1 << (parts.bit_length() - 1)
    grid = occupancy_grid(classes)
    for _ in range(8):
        start, end = rng.integers(0, parts * np.array(classes.shape) + 1, size=(2, 2)) / parts
        assume((start != end).any())
        exact = [(Fraction(row), Fraction(col)) for row, col in (start.tolist(), end.tolist())]
        legal = not faults_of(grid, tuple(start), tuple(end))
        assert legal == fractions_find_no_fault(free, exact[0], exact[1]), (start, end)


def test_a_segment_that_misses_a_corner_by_a_hair_is_told_from_one_that_meets_it() -> None:
    grid = occupancy_grid(drawn(".#", "..").repeat(40, axis=0).repeat(40, axis=1))
    hair = 2.0**-24
    assert not faults_of(grid, (79.0, 1.0), (1.0, 79.0))
    assert faults_of(grid, (79.0, 1.0 + hair), (1.0, 79.0))
    assert faults_of(grid, (79.0 + hair, 1.0), (1.0, 79.0))
    assert not faults_of(grid, (79.0, 1.0 - hair), (1.0, 79.0))


def test_a_miss_that_rounded_products_cannot_tell_is_told() -> None:
    # Past the corner (40, 40) by 2^-48 / 57 cells: n (2 n - 1) - (n - 1) (2 n + 1) = 1.
    n, quantum = 20 * 2**24, 2.0**-24
    start = (40 - (n - 1) * quantum, 40 - n * quantum)
    end = (start[0] + (2 * n - 1) * quantum, start[1] + (2 * n + 1) * quantum)
    for sketch, legal in ((("#.", ".."), False), (("..", ".#"), True)):
        classes = drawn(*sketch).repeat(40, axis=0).repeat(40, axis=1)
        assert (not faults_of(occupancy_grid(classes), start, end)) == legal
        assert (not faults_of(occupancy_grid(classes), end, start)) == legal


PINCHED = drawn(".#.", "#..", "...")


@pytest.mark.parametrize(
    ("positions", "fault"),
    [
        ([(0.5, 0.5), (0.5, 2.5)], None),
        ([(2.5, 0.5), (1.5, 1.5)], "between two blocked"),
        ([(2.5, 0.5), (2.0, 1.0)], None),
        ([(2.5, 0.5), (2.0, 1.0), (1.5, 1.9)], "bend"),
        ([(2.5, 0.5), (2.0, 1.0), (2.0, 1.0), (1.5, 1.9)], "bend"),
        ([(1.2, 1.5), (2.0, 1.0), (1.5, 1.9)], None),
        ([(2.0, 0.0), (2.0, 2.0)], "between two blocked"),
        ([(3.0, 1.0), (1.0, 1.0)], "between two blocked"),
        ([(1.0, 0.0), (1.0, 3.0)], None),
        ([(2.5, 2.5), (2.5, 0.5)], "enters a blocked cell"),
        ([(0.5, 0.5), (0.5, 3.5)], "leaves the map"),
        ([(0.0, 0.0), (0.0, 3.0)], None),
        ([(1.5, 0.5)], "enters a blocked cell"),
        ([(1.5, 1.0)], None),
        ([(0.5, 0.5), (0.5, 0.5)], None),
    ],
)
@pytest.mark.parametrize("yaw_rad", [0.0, 0.7])
def test_polylines_touch_blocked_cells_and_never_squeeze_between_two(positions, fault, yaw_rad):
    faults = faults_of(framed(PINCHED, yaw_rad), *positions)
    assert len(faults) == (0 if fault is None else 1)
    assert fault is None or fault in faults[0]


def test_a_line_along_the_side_of_two_blocked_cells_is_not_free() -> None:
    grid = occupancy_grid(drawn(".##.", ".##."))
    (fault,) = faults_of(grid, (1.0, 0.5), (1.0, 3.5))
    assert "side between two blocked cells" in fault
    (rim,) = faults_of(grid, (0.0, 0.0), (0.0, 4.0))
    assert "side between two blocked cells" in rim


ROOM = drawn(".....", "..#..", ".....", ".#.?.", "..#..")


@pytest.mark.parametrize(
    ("cells", "faults"),
    [
        ([(4, 0), (4, 1), (4, 2), (4, 3)], []),
        ([(4, 0), (3, 0), (2, 1), (2, 2), (2, 3)], ["last cell is (2, 3), not (4, 3)"]),
        ([(3, 0), (4, 1), (4, 2), (4, 3)], ["first cell is (3, 0), not (4, 0)"]),
        (
            [(4, 0), (4, 1), (3, 2), (4, 3)],
            ["(3, 2) is not free", "enters a blocked cell (and 1 more)"],
        ),
        ([(4, 0), (4, 1), (5, 2), (4, 3)], ["(5, 2) is outside the map"]),
        ([(4, 0), (4, 1), (4, 3)], ["from (4, 1) to (4, 3) does not go to a neighbour"]),
        ([(4, 0), (4, 0), (4, 1), (4, 2), (4, 3)], []),
        ([(4, 0), (3, 0), (3, 1), (4, 2), (4, 3)], ["from (3, 1) to (4, 2) cuts a corner"]),
        ([(4, 0), (3, 0), (3, 3), (4, 3)], ["does not go to a neighbour", "enters a blocked cell"]),
        ([(9**18, -(9**18)), (4, 3)], ["first cell", "outside", "does not go"]),
    ],
)
def test_each_planted_fault_is_named_once(cells: Any, faults: list[str]) -> None:
    verdict = judge_path(occupancy_grid(ROOM), cells, start=(4, 0), goal=(4, 3))
    assert len(verdict.faults) == len(faults), verdict.faults
    assert all(want in got for want, got in zip(faults, verdict.faults, strict=True))
    assert verdict.ok == (not faults)


def test_a_diagonal_between_two_blocked_cells_is_told_from_a_cut_corner() -> None:
    verdict = judge_path(occupancy_grid(ROOM), [(0, 1), (1, 2)], start=(0, 1), goal=(1, 2))
    assert len(verdict.faults) == 1
    assert "passes between two blocked cells that meet at a corner" in verdict.faults[0]


def test_unexplored_cells_are_free_only_when_allowed() -> None:
    grid, cells = occupancy_grid(ROOM), [(2, 3), (1, 3), (1, 4)]
    endpoints: Any = {"start": (2, 3), "goal": (1, 4)}
    assert not judge_path(grid, cells, **endpoints).ok
    assert judge_path(grid, cells, allow_unexplored=True, **endpoints).ok
    points = grid.frame.points_of(cells)
    assert segment_faults(grid, points)
    assert not segment_faults(grid, points, allow_unexplored=True)


def test_a_long_path_has_the_length_that_its_moves_have() -> None:
    grid = framed(np.full((700, 700), CellClass.FREE, np.uint8), 0.4)
    steps = np.array([(1, 1), (0, 1), (1, 0)]).repeat((301, 200, 100), axis=0)
    cells = np.concatenate([[(0, 0)], np.random.default_rng(0).permutation(steps).cumsum(axis=0)])
    verdict = judge_path(grid, cells, start=(0, 0), goal=tuple(cells[-1]))
    assert verdict.ok
    assert verdict.length_m == pytest.approx(0.05 * (300 + 301 * math.sqrt(2)), rel=1e-14)


@pytest.mark.parametrize("cells", [[(0.5, 1.0)], [0, 1], [[(0, 1)]], [(0, 1, 2)]])
def test_what_is_no_path_of_cells_is_refused(cells: Any) -> None:
    with pytest.raises(InvalidValueError, match="whole numbers"):
        judge_path(occupancy_grid(ROOM), cells, start=(0, 0), goal=(0, 0))


@pytest.mark.parametrize("points", [[], [1.0, 2.0], [(0.0, math.nan)], [(0.0, 0.0, 0.0)]])
def test_what_is_no_polyline_is_refused(points: Any) -> None:
    with pytest.raises(InvalidValueError, match="points"):
        segment_faults(occupancy_grid(ROOM), points)


def test_an_empty_path_is_a_fault_and_a_single_cell_is_none() -> None:
    grid, nothing = occupancy_grid(ROOM), np.empty((0, 2), np.int64)
    assert judge_path(grid, nothing, start=(0, 0), goal=(0, 0)).faults == ("the path has no cells",)
    single = judge_path(grid, [(0, 0)], start=(0, 0), goal=(0, 0))
    assert single.ok
    assert single.length_m == 0


@given(class_grids(), seeds, st.booleans())
def test_optima_are_those_of_an_edge_list(classes: Any, seed: int, allow: bool) -> None:
    enterable = (classes == CellClass.FREE) | ((classes == CellClass.UNEXPLORED) & allow)
    assume(enterable.any())
    rng = np.random.default_rng(seed)
    row, col = rng.choice(np.argwhere(enterable)).tolist()
    grid = framed(classes, 0.4)
    expected = distances(move_graph(enterable), enterable.shape, (row, col)) * 0.05
    found = ScipyOptimum(grid, allow_unexplored=allow).lengths_from((row, col))
    np.testing.assert_allclose(found, np.where(enterable, expected, np.inf), rtol=1e-12)


def test_optima_want_cells_of_the_map_and_have_none_for_blocked_ones() -> None:
    grid = occupancy_grid(ROOM)
    assert np.isinf(ScipyOptimum(grid).lengths_from((0, 2))).all()
    assert np.isinf(ScipyOptimum(grid).lengths_from((0, 0))[0, 2])
    with pytest.raises(InvalidValueError, match=r"\(-1, 0\) lies outside"):
        ScipyOptimum(grid).lengths_from((-1, 0))


def test_the_judges_load_no_planner() -> None:
    """What they share with planners is the grid and the exact comparison of two products."""
    code = (
        "import sys, hybridnav.harness.judges as judges\n"
        "assert [getattr(judges, name) for name in judges.__all__]\n"
        "print(*sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {name for name in done.stdout.split() if name.startswith("hybridnav.")}
    packages = {name.split(".")[1] for name in loaded}
    assert packages == {"errors", "_version", "_base", "maps", "harness"}
    of_harness = {name for name in loaded if name.startswith("hybridnav.harness.")}
    assert all(name.startswith("hybridnav.harness.judges") for name in of_harness)
    shared = {"clock", "compiler", "jit", "kernels", "kernels.exact", "shipped", "trig", "typing"}
    of_base = {name for name in loaded if name.startswith("hybridnav._base.")}
    assert of_base == {f"hybridnav._base.{name}" for name in shared}
