"""Grid search with factors, from sets of cells, against optima that MovingAI states; predicates."""

import itertools
import math
import os
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav._base.moves import octile_distance_in_cells, path_length_in_cells
from hybridnav.maps import CellClass
from hybridnav.maps.files.movingai import Scenario, load_scenarios
from hybridnav.search.grid_search import GridSearch, cheapest_waypoints
from hybridnav.search.kernels import grid_search as kernels
from tests.oracle.grid import (
    assert_legal,
    counted,
    distances,
    move_graph,
    moves,
    recounted,
    weighted,
)
from tests.strategies import class_grids, drawn, seeds, tried

ONE = 1 << 14


def random_units(shape: tuple[int, int], rng: np.random.Generator) -> Any:
    """Units of all kinds: ones, noise, slopes, a few walls of high cost."""
    kind = rng.integers(5)
    if kind == 0:
        return np.full(shape, ONE, np.int32)
    if kind == 1:
        return rng.integers(ONE, 3 * ONE, shape, dtype=np.int32)
    if kind == 2:
        slope = np.add.outer(np.arange(shape[0]), np.arange(shape[1]))
        return (ONE + slope * rng.integers(1, 2000)).astype(np.int32)
    if kind == 3:
        return np.where(rng.random(shape) < 0.3, 1000 * ONE, ONE).astype(np.int32)
    return rng.choice(np.array([2 * ONE, 2 * ONE + 1, 5 * ONE], np.int32), shape)


@tried(200, class_grids(max_side=24), seeds)
def test_the_path_is_the_cheapest(classes: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    enterable = classes == CellClass.FREE
    assume(enterable.any())
    units = random_units(enterable.shape, rng)
    factors = units / ONE
    search = GridSearch(enterable, units=units)
    graph = weighted(move_graph(enterable), factors)
    free = np.argwhere(enterable)
    for _ in range(4):
        start, goal = (tuple(free[rng.integers(len(free))].tolist()) for _ in range(2))
        optimum = distances(graph, enterable.shape, start)[goal]
        found = search.search(start, goal)
        assert (found.cells is None) == np.isinf(optimum)
        if found.cells is not None:
            assert_legal(found.cells, enterable)
            assert tuple(found.cells[0]) == start
            assert tuple(found.cells[-1]) == goal
            cost = counted(found.cells, factors)
            assert abs(cost - optimum) <= 1e-9 * optimum
            assert cost >= octile_distance_in_cells(start, goal) * (1 - 1e-12)


@tried(100, class_grids(max_side=16), seeds)
def test_a_corridor_and_closed_cells_are_kept(classes: Any, seed: int) -> None:
    rng = np.random.default_rng(seed)
    enterable = classes == CellClass.FREE
    units = random_units(enterable.shape, rng)
    field_of = rng.integers(0, 4, enterable.shape).astype(np.int32)
    in_corridor = rng.random(4) < 0.8
    blocked = np.flatnonzero(rng.random(enterable.size) < 0.1)
    is_open = enterable.copy()
    is_open.flat[blocked] = False
    inside = is_open & in_corridor[field_of]
    assume(inside.any())
    search = GridSearch(enterable, units=units)
    cells = np.argwhere(inside)
    start, goal = (tuple(cells[rng.integers(len(cells))].tolist()) for _ in range(2))
    for standable, more in (
        (is_open, {}),
        (inside, {"field_of": field_of, "in_corridor": in_corridor}),
    ):
        graph = weighted(move_graph(is_open, standable), units / ONE)
        optimum = distances(graph, enterable.shape, start)[goal]
        found = search.search(start, goal, blocked=blocked, **more)
        assert (found.cells is None) == np.isinf(optimum)
        if found.cells is not None:
            assert_legal(found.cells, is_open, standable)
            assert abs(counted(found.cells, units / ONE) - optimum) <= 1e-9 * optimum


def test_equal_factors_cost_as_many_times_the_length() -> None:
    enterable = np.ones((30, 30), np.bool_)
    enterable[5:25, 12] = False
    plain = GridSearch(enterable).search((10, 2), (15, 28)).cells
    for units in (ONE, 7 * ONE + 3):
        search = GridSearch(enterable, units=np.full(enterable.shape, units, np.int32))
        found = search.search((10, 2), (15, 28)).cells
        assert plain is not None
        assert found is not None
        ones = np.ones(enterable.shape)
        assert counted(found, ones) == counted(plain, ones)


def test_a_path_keeps_its_distance_where_that_is_cheap() -> None:
    enterable = drawn(".......", ".......", ".......") == CellClass.FREE
    units = np.full(enterable.shape, ONE, np.int32)
    units[0, 1:6] = 3 * ONE
    found = GridSearch(enterable, units=units).search((0, 0), (0, 6)).cells
    assert found is not None
    assert found[:, 0].tolist() == [0, 1, 1, 1, 1, 1, 0]


def test_searches_that_start_anew_forget_the_first_ones() -> None:
    rng = np.random.default_rng(3)
    enterable = rng.random((12, 12)) > 0.2
    units = random_units(enterable.shape, rng)
    search, graph = GridSearch(enterable, units=units), weighted(move_graph(enterable), units / ONE)
    with search._works.lent() as work:
        work.generation = kernels.WIDE_GENERATIONS - 3
    free = np.argwhere(enterable)
    for _ in range(8):
        start, goal = (tuple(free[rng.integers(len(free))].tolist()) for _ in range(2))
        optimum = distances(graph, enterable.shape, start)[goal]
        cells = search.search(start, goal).cells
        assert (cells is None) == np.isinf(optimum)
        if cells is not None:
            assert abs(counted(cells, units / ONE) - optimum) <= 1e-9 * optimum


def test_a_full_bucket_starts_the_search_anew_with_more_room() -> None:
    rng = np.random.default_rng(0)
    enterable = np.ones((300, 300), np.bool_)
    units = rng.integers(ONE, 3 * ONE, enterable.shape, dtype=np.int32)
    search = GridSearch(enterable, units=units)
    first = search.search((0, 0), (299, 299)).cells
    with search._works.lent() as work:
        work.waiting = work.waiting[: kernels.n_buckets(ONE, 3 * ONE) * 2]
    second = search.search((0, 0), (299, 299)).cells
    assert first is not None
    assert second is not None
    assert (first == second).all()


@given(classes=class_grids(9), seed=seeds, n_sets=st.integers(2, 4))
def test_stops_are_as_cheap_as_the_best_of_all_choices(classes, seed, n_sets):
    enterable = classes == CellClass.FREE
    cells = np.flatnonzero(enterable)
    if len(cells) == 0:
        return
    rng = np.random.default_rng(seed)
    sets = [rng.choice(cells, min(len(cells), 3), replace=False) for _ in range(n_sets)]
    search = GridSearch(enterable)
    cols = classes.shape[1]

    def length(waypoints):
        total = 0.0
        for tail, head in itertools.pairwise(waypoints):
            found = search.search(divmod(int(tail), cols), divmod(int(head), cols))
            total += np.inf if found.cells is None else path_length_in_cells(found.cells)
        return total

    best = min(map(length, itertools.product(*sets)))
    waypoints = cheapest_waypoints(enterable, sets)
    if waypoints is None:
        assert best == np.inf
    else:
        assert all(waypoint in members for waypoint, members in zip(waypoints, sets, strict=True))
        assert abs(length(waypoints) - best) < 1e-9


PROBLEMS = 24
LONGEST = 6
HYBRID_PROBLEMS = 8


def scenario_files() -> list[str]:
    """Every scenario file below the reference data; one that cannot be there without it."""
    folder = Path(os.environ.get("HYBRIDNAV_DATA", "")) / "movingai"
    found = sorted(file.relative_to(folder).as_posix() for file in folder.glob("**/*.scen"))
    return found or ["none"]


@dataclass(frozen=True)
class Problem:
    """A problem and the stated optimum's own arithmetic."""

    scenario: Scenario
    half_unit: float
    """Half a unit of the last digit that the file gives."""
    root: float
    """What the makers of the file took for the square root of 2."""

    def states(self, cells: Any) -> bool:
        """Whether the path's moves add up to the stated optimum, to the digits given."""
        straight, diagonal = moves(cells)
        error = straight + diagonal * self.root - self.scenario.optimum_cells
        return abs(error) <= self.half_unit + 1e-9

    @property
    def slack(self) -> float:
        """By how much the stated optimum may differ from the true one."""
        relative = abs(self.root / math.sqrt(2) - 1)
        return self.half_unit + self.scenario.optimum_cells * relative + 1e-9


@lru_cache(maxsize=1)
def problem_set(file: Path) -> tuple[hn.OccupancyGrid, list[Problem]]:
    """The map of a scenario file and a sample of its problems, the longest ones last."""
    grid = hn.load_map(file.with_suffix(""), robot_radius_m=0.0)
    lines = [line.split() for line in file.read_text().splitlines()[1:]]
    digits = digits_of([line[-1] for line in lines if line])
    problems = [
        Problem(scenario, *digit)
        for scenario, digit in zip(load_scenarios(file), digits, strict=True)
    ]
    order = np.argsort([problem.scenario.optimum_cells for problem in problems], kind="stable")
    others = np.random.default_rng(0).choice(order[:-LONGEST], PROBLEMS - LONGEST, replace=False)
    return grid, [problems[i] for i in (*others.tolist(), *order[-LONGEST:].tolist())]


def digits_of(optima: list[str]) -> list[tuple[float, float]]:
    """Half a unit of the last digit of each optimum, and the root of 2 that it was made with.

    There are two kinds of files. One gives a fixed number of decimals, two or eight; those with
    eight took 1.414213562 for the root, as 200 problems of each such file show to the last digit.
    The other gives six significant digits, trailing zeros dropped, of lengths in float32.
    """
    single = float(np.float32(math.sqrt(2)))
    decimals = {len(optimum.partition(".")[2]) for optimum in optima}
    if len(decimals) == 1:
        (places,) = decimals
        return [(0.5 * 10.0**-places, 1.414213562 if places == 8 else single)] * len(optima)
    return [(0.5 * 10.0 ** (len(optimum.partition(".")[0]) - 6), single) for optimum in optima]


@pytest.mark.parametrize("name", scenario_files())
def test_grid_astar_equals_the_stated_optimum_to_the_digits_given(data: Path, name: str) -> None:
    grid, problems = problem_set(data / "movingai" / name)
    enterable = grid.classes == CellClass.FREE
    search = GridSearch(enterable)
    for problem in problems:
        scenario = problem.scenario
        assert (scenario.rows, scenario.cols) == grid.shape
        found = search.search(scenario.start, scenario.goal)
        assert found.cells is not None, scenario
        assert_legal(found.cells, enterable)
        assert tuple(found.cells[0]) == scenario.start
        assert tuple(found.cells[-1]) == scenario.goal
        assert path_length_in_cells(found.cells) == recounted(found.cells)
        assert problem.states(found.cells), (scenario, recounted(found.cells))


@pytest.mark.parametrize("name", scenario_files())
def test_the_hybrid_planner_solves_them_too_and_its_bounds_hold(data: Path, name: str) -> None:
    grid, problems = problem_set(data / "movingai" / name)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=40.0))
    planner = hn.HybridPlanner(topology, preset="paper")
    for problem in problems[-HYBRID_PROBLEMS:]:
        scenario = problem.scenario
        start, goal = grid.frame.points_of([scenario.start, scenario.goal])
        result = planner.plan(start, goal).raise_for_status()
        assert_legal(result.path.cells, grid.classes == CellClass.FREE)
        assert result.cost == pytest.approx(recounted(result.path.cells), rel=1e-12)
        assert result.cost >= scenario.optimum_cells - problem.slack
        assert result.lower_bound <= scenario.optimum_cells + problem.slack
