"""Paths on the jump-point graph are legal and as short as any, after changes of the map too."""

import itertools
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import assume
from numpy.typing import NDArray

from benchmarks.worlds import office_world
from hybridnav._base.moves import legal_moves
from hybridnav.maps import CellClass
from hybridnav.search.directed import DirectedSides
from hybridnav.search.octile import (
    JumpPath,
    JumpPaths,
    JumpSearch,
    build_jump_graph,
    contract_graph,
)
from hybridnav.search.octile.kernels.legs import ONWARD
from hybridnav.search.octile.kernels.tables import number_cells, turning_cells
from tests.one_way import random_scene
from tests.oracle.grid import assert_legal, distances, move_graph, recounted
from tests.search.test_grid_search import problem_set, scenario_files
from tests.strategies import MAX_SIDE, class_grids, drawn, examples, seeds, tried

Cell = tuple[int, int]

QUICK_FILES = 4


def searches(free: NDArray[np.bool_]) -> tuple[JumpSearch, JumpSearch]:
    graph = build_jump_graph(free)
    return JumpSearch(graph), JumpSearch(contract_graph(graph))


def assert_shortest(
    found: JumpPath, free: NDArray[np.bool_], endpoints: tuple[Cell, Cell], optimum: float
) -> None:
    if math.isinf(optimum):
        assert found.cells is None
        assert found.length_cells == math.inf
        return
    assert found.cells is not None
    assert_legal(found.cells, free)
    assert (tuple(found.cells[0]), tuple(found.cells[-1])) == endpoints
    assert found.length_cells == recounted(found.cells)
    assert found.length_cells == pytest.approx(optimum, abs=1e-9)


def assert_all_pairs(free: NDArray[np.bool_]) -> None:
    both, moves = searches(free), move_graph(free)
    cells = [(row, col) for row, col in np.argwhere(free).tolist()]
    for start in cells:
        optima = distances(moves, free.shape, start)
        for search, goal in itertools.product(both, cells):
            assert_shortest(search.path(start, goal), free, (start, goal), optima[goal])


def map_of(*lines: str) -> NDArray[np.bool_]:
    free: NDArray[np.bool_] = drawn(*lines) == CellClass.FREE
    return free


@tried(30, class_grids(max_side=6))
def test_paths_between_all_pairs_of_small_maps_are_shortest(classes: Any) -> None:
    assert_all_pairs(classes == CellClass.FREE)


@tried(60, class_grids(), seeds)
def test_paths_are_shortest(classes: Any, seed: int) -> None:
    free = classes == CellClass.FREE
    assume(free.any())
    both, moves = searches(free), move_graph(free)
    cells = [(row, col) for row, col in np.argwhere(free).tolist()]
    rng = np.random.default_rng(seed)
    for _ in range(4):
        start = cells[rng.integers(len(cells))]
        optima = distances(moves, free.shape, start)
        for goal in [cells[i] for i in rng.integers(len(cells), size=8)]:
            for search in both:
                assert_shortest(search.path(start, goal), free, (start, goal), optima[goal])


@pytest.mark.parametrize(
    "free",
    [
        map_of("."),
        map_of("....."),
        map_of(".", ".", "."),
        map_of(".#", "#."),
        map_of("#.#", "...", "#.#"),
        map_of("...", ".#.", "..."),
        map_of("....", ".##.", "...."),
        map_of("..#..", ".#.#.", "#...#", ".#.#.", "..#.."),
        map_of("....#....", ".........", "####.####", "....#...."),
        map_of("#######", "#.....#", "#.###.#", "#.#.#.#", "#.###.#", "#.....#", "#######"),
        map_of(".#.#.#.", ".......", ".#.#.#.", ".......", ".#.#.#."),
        np.ones((5, 9), np.bool_),
    ],
)
def test_paths_between_all_pairs_of_corners_corridors_and_islands(free: NDArray[np.bool_]) -> None:
    assert_all_pairs(free)


def test_a_map_without_free_cells_has_an_empty_graph() -> None:
    graph = build_jump_graph(np.zeros((3, 4), np.bool_))
    assert graph.n_corners == 0
    assert len(graph.ahead) == 0


def test_the_map_given_is_not_changed_and_the_graph_cannot_be() -> None:
    free = map_of("...", ".#.", "...")
    before = free.copy()
    graph = build_jump_graph(free)
    assert (free == before).all()
    for array in (graph.index, graph.ahead, graph.places, graph.first, graph.arcs):
        assert not array.flags.writeable


def speckled(seed: int) -> NDArray[np.bool_]:
    free = np.random.default_rng(seed).random((MAX_SIDE, MAX_SIDE)) > 0.15
    free[0, 0] = free[-1, -1] = True
    return free


def pairs_of(free: NDArray[np.bool_], n: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    cells = np.argwhere(free)
    starts, goals = cells[np.random.default_rng(1).integers(len(cells), size=(2, n))]
    return starts, goals


def path_of(found: JumpPaths, i: int) -> list[list[int]]:
    cells: list[list[int]] = found.cells[found.path_start[i] : found.path_start[i + 1]].tolist()
    return cells


def test_many_pairs_get_the_answers_that_each_gets_alone() -> None:
    free = speckled(2)
    starts, goals = pairs_of(free, 200)
    for search in searches(free):
        found = search.many(starts, goals)
        for i in range(200):
            alone = search.path(tuple(starts[i].tolist()), tuple(goals[i].tolist()))
            assert alone.length_cells == found.length_cells[i]
            assert alone.expanded == found.expanded[i]
            assert path_of(found, i) == ([] if alone.cells is None else alone.cells.tolist())


def test_no_pairs_get_no_answers() -> None:
    none = np.empty((0, 2), np.int64)
    found = JumpSearch(build_jump_graph(speckled(2))).many(none, none)
    assert len(found.length_cells) == len(found.cells) == 0
    assert found.path_start.tolist() == [0]


def test_a_contracted_graph_of_a_building_expands_less_than_a_third() -> None:
    free = office_world().grid(robot_radius_m=0.25).classes == CellClass.FREE
    starts, goals = pairs_of(free, 200)
    flat, contracted = searches(free)
    assert contracted.graph.is_contracted
    before, found = flat.many(starts, goals), contracted.many(starts, goals)
    assert found.length_cells.tolist() == before.length_cells.tolist()
    assert 0 < 3 * found.expanded.sum() < before.expanded.sum()


def test_noise_is_not_contracted_for_minutes() -> None:
    graph = build_jump_graph(np.random.default_rng(0).random((300, 300)) > 0.1)
    assert contract_graph(graph) is graph


def test_a_graph_with_an_arc_without_its_reverse_is_not_contracted() -> None:
    graph = build_jump_graph(drawn("......", "..##..", "......", ".##...", "......") == 1)
    assert contract_graph(graph).is_contracted
    for arc in range(len(graph.arcs)):
        first = (graph.first - (graph.first > arc)).astype(graph.first.dtype)
        halved = replace(graph, first=first, arcs=np.delete(graph.arcs, arc, axis=0))
        assert contract_graph(halved) is halved


@tried(60, class_grids())
def test_where_nothing_has_a_direction_paths_turn_at_corner_cells(classes: Any) -> None:
    free = np.pad(classes == CellClass.FREE, 1)
    moves, cells = legal_moves(free, False).ravel(), np.flatnonzero(free)
    _, corners, *_ = number_cells(free.view(np.uint8))
    turns = turning_cells(moves, free.shape[1], cells)
    assert cells[turns].tolist() == corners.tolist()


def test_paths_with_directions_are_shortest_and_a_missing_one_is_known() -> None:
    n_lone, n_known = 0, 0
    for seed in range(examples(100, 2000)):
        scene = random_scene(seed, side=18, n_ends=6)
        if scene is None or not len(scene.sides):
            continue
        sides = DirectedSides.of([("line", scene.sides)], scene.free.shape)
        graph = build_jump_graph(scene.free, sides)
        both = JumpSearch(graph), JumpSearch(contract_graph(graph))
        n_lone += int(np.count_nonzero(graph.arcs[:, 1] >> 6 & ONWARD))
        for (start, _), (goal, _) in itertools.product(scene.placed, scene.placed):
            optimum = scene.plane.cells_length(start, goal)
            for search in both:
                found = search.path(start, goal)
                assert_shortest(found, scene.free, (start, goal), optimum)
                path = None if found.cells is None else list(map(tuple, found.cells.tolist()))
                assert path is None or scene.plane.allows_moves(path, strict=True)
                n_known += path is None and found.expanded == 0
    assert n_lone > 0
    assert n_known > 0


@pytest.mark.full
def test_a_map_with_a_side_too_long_for_16_bits_is_searched_too() -> None:
    free = np.ones((3, 40_000), np.bool_)
    free[1, 20_000] = free[:2, 30_000] = False
    for search in searches(free):
        found = search.path((0, 0), (0, 39_999))
        assert found.length_cells == pytest.approx(39_999 - 4 + 4 * math.sqrt(2))
        assert found.cells is not None
        assert_legal(found.cells, free)


@pytest.mark.parametrize(
    ("name", "step"),
    [
        *((name, 4) for name in scenario_files()[::8][:QUICK_FILES]),
        *(pytest.param(name, 1, marks=pytest.mark.full) for name in scenario_files()),
    ],
)
def test_lengths_are_those_that_scenarios_state(data: Path, name: str, step: int) -> None:
    grid, problems = problem_set(data / "movingai" / name)
    free = grid.classes == CellClass.FREE
    both = searches(free)
    for problem, search in itertools.product(problems[::step], both):
        scenario = problem.scenario
        found = search.path(scenario.start, scenario.goal)
        assert found.cells is not None
        assert_legal(found.cells, free)
        assert problem.states(found.cells), scenario
