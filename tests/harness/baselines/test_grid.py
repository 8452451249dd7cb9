"""Baselines on cells and on places: against scipy's Dijkstra, and as simple graphs."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.harness.baselines import MethodResult, Solver
from hybridnav.harness.baselines.grid import GridAstar, GridDijkstra, WeightedAstar
from hybridnav.harness.baselines.regions import SimpleGraphPyramid, first_arcs
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.pyramid.graphs import report_of
from hybridnav.route import MaxDistanceSearch
from hybridnav.route.coarse import ArcSearch
from hybridnav.search.grid_search import GridSearch
from tests.harness.small_runs import free_pairs
from tests.oracle.grid import assert_legal, components, distances, move_graph, recounted
from tests.strategies import (
    MAX_SIDE,
    Scene,
    class_grids,
    drawn,
    free_cells,
    occupancy_grid,
    scenes,
    tried,
)

METHODS: dict[str, Callable[[OccupancyGrid], Solver]] = {
    "grid-astar": GridAstar,
    "grid-dijkstra": GridDijkstra,
    "weighted-astar-1.5": WeightedAstar,
    "weighted-astar-1": lambda grid: WeightedAstar(grid, weight=1.0),
    "weighted-astar-4": lambda grid: WeightedAstar(grid, weight=4.0),
}

WALL = drawn(
    "......#......",
    "......#......",
    "......#......",
    "......#......",
    "......#......",
    ".............",
)


def make(name: str, grid: OccupancyGrid) -> Solver:
    """The method that tables call by this name."""
    method = METHODS[name](grid)
    assert method.name == name
    return method


@pytest.mark.parametrize("name", METHODS)
@tried(40, classes=class_grids(), seed=st.integers(0, 1000))
def test_paths_are_legal_and_as_long_as_the_bound_allows(name, classes, seed):
    grid = occupancy_grid(classes)
    method = make(name, grid)
    enterable = classes == CellClass.FREE
    graph = move_graph(enterable)
    assert method.n_nodes == enterable.sum()
    assert method.n_edges == graph.nnz
    chosen = free_cells(classes, seed, 5)
    for start in chosen:
        optima = distances(graph, grid.shape, start)
        for goal in chosen:
            answer = method.solve(start, goal)
            if math.isinf(optima[goal]):
                assert answer.cells is None
                assert math.isinf(answer.bound)
                continue
            assert answer.cells is not None
            assert_legal(answer.cells, enterable)
            assert tuple(answer.cells[0]) == start
            assert tuple(answer.cells[-1]) == goal
            length = recounted(answer.cells)
            assert length >= optima[goal] - 1e-9
            assert length <= answer.bound * optima[goal] + 1e-9
            assert answer.nodes is None
            assert answer.expanded <= method.n_nodes or name == "grid-astar"


@pytest.mark.parametrize("name", ["grid-astar", "grid-dijkstra", "weighted-astar-1"])
def test_exact_methods_say_so(name: str) -> None:
    method = make(name, occupancy_grid(WALL))
    answer = method.solve((5, 0), (5, 12))
    assert answer.cells is not None
    assert answer.bound == 1.0
    assert recounted(answer.cells) == pytest.approx(2 + 10 * math.sqrt(2))


def test_weighted_bound_is_the_weight_or_less() -> None:
    rng = np.random.default_rng(5)
    classes = np.where(rng.random((60, 60)) < 0.3, 0, 1).astype(np.uint8)
    method = WeightedAstar(occupancy_grid(classes), weight=3.0)
    chosen = free_cells(classes, 1, 60)
    answers = [method.solve(a, b) for a, b in zip(chosen, reversed(chosen), strict=True)]
    bounds = [answer.bound for answer in answers if answer.cells is not None]
    assert all(1.0 <= bound <= 3.0 for bound in bounds)
    assert np.median(bounds) < 2.0, "a search proves more than its weight on most maps"


def test_greater_weights_expand_fewer_cells_and_dijkstra_most() -> None:
    grid = occupancy_grid(np.ones((80, 80), dtype=np.uint8))
    counts = {name: make(name, grid).solve((40, 10), (45, 70)).expanded for name in METHODS}
    assert counts["weighted-astar-4"] <= counts["weighted-astar-1.5"] < counts["grid-dijkstra"]
    assert counts["grid-astar"] < counts["grid-dijkstra"]
    assert counts["weighted-astar-1.5"] == 60, "without obstacles only the path is expanded"


@pytest.mark.parametrize("name", METHODS)
def test_start_is_goal(name: str) -> None:
    answer = make(name, occupancy_grid(WALL)).solve((2, 3), (2, 3))
    assert answer.cells.tolist() == [[2, 3]]
    assert answer.bound == 1.0


@pytest.mark.parametrize("name", METHODS)
def test_corners_are_cut_where_the_grid_allows_it(name: str) -> None:
    grid = occupancy_grid(drawn("#.", ".#"))
    assert make(name, grid).solve((0, 0), (1, 1)).cells is None
    cutting = OccupancyGrid(grid.probability, corner_cutting=True)
    answer = make(name, cutting).solve((0, 0), (1, 1))
    assert answer.cells.tolist() == [[0, 0], [1, 1]]


@pytest.mark.parametrize("weight", [0.5, math.nan, math.inf])
def test_weights_below_one_are_refused(weight: float) -> None:
    with pytest.raises(InvalidValueError, match="weight must be"):
        WeightedAstar(occupancy_grid(WALL), weight=weight)


Cell = tuple[int, int]
# A room that no path enters.
SEALED = drawn(".........", "..####...", "..#..#...", "..####...", ".........")


def map_of(grid: Any, **build: Any) -> hn.TopologicalMap:
    if not isinstance(grid, hn.OccupancyGrid):
        grid = occupancy_grid(grid)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, **build))


def map_of_scene(scene: Scene) -> hn.TopologicalMap:
    return map_of(scene.grid, merge_distance_m=scene.merge_distance_m, seed=scene.seed)


def rooms(side: int, seed: int) -> Any:
    """Noise of all three classes and walls with doors, in which most cells stay connected."""
    rng = np.random.default_rng(seed)
    classes = np.full((side, side), CellClass.FREE, np.uint8)
    noise = rng.random((side, side))
    classes[noise < 0.08] = CellClass.OCCUPIED
    classes[noise > 0.96] = CellClass.UNEXPLORED
    for wall in range(side // 4, side, side // 4):
        doors = rng.integers(side, size=3)
        classes[wall] = CellClass.OCCUPIED
        classes[wall - 1 : wall + 2, doors] = CellClass.FREE
    return classes


def endpoints_match(answer: MethodResult, start: Cell, goal: Cell) -> bool:
    cells = answer.cells
    return cells is not None and tuple(cells[0]) == start and tuple(cells[-1]) == goal


def assert_plan_holds(method: Solver, answer: MethodResult, start: Cell, goal: Cell) -> None:
    """The plan goes from the start's place to the goal's, and the path stays inside it; with a
    simple graph also in places that its edges join to it."""
    region_of = method.region_of
    assert region_of is not None
    assert answer.cells is not None
    if answer.nodes is None:
        return
    assert answer.nodes[0] == region_of[start]
    assert answer.nodes[-1] == region_of[goal]
    regions = set(answer.nodes)
    if isinstance(method, SimpleGraphPyramid):
        pairs = np.concatenate(
            [
                np.stack([region_of[:, :-1].ravel(), region_of[:, 1:].ravel()], axis=1),
                np.stack([region_of[:-1].ravel(), region_of[1:].ravel()], axis=1),
            ]
        )
        regions |= set(pairs[np.isin(pairs, answer.nodes).any(axis=1)].ravel().tolist())
    assert np.isin(region_of[answer.cells[:, 0], answer.cells[:, 1]], list(regions)).all()


def test_a_path_inside_one_field_and_one_that_must_leave_it() -> None:
    classes = drawn("...", ".#.", "...")
    method = SimpleGraphPyramid(map_of(classes, merge_distance_m=float("inf")))
    answer = method.solve((0, 0), (2, 2))
    assert recounted(answer.cells) == 4
    assert answer.nodes == (0,)


def test_start_equal_to_goal_is_one_cell() -> None:
    method = SimpleGraphPyramid(map_of(SEALED, merge_distance_m=3.0))
    answer = method.solve((0, 4), (0, 4))
    assert answer.cells.tolist() == [[0, 4]]
    assert answer.nodes is not None
    assert len(answer.nodes) == 1


@pytest.mark.parametrize("cell", [(-1, 0), (0, 9), (5, 0), (1, 2)])
def test_a_cell_that_is_not_free_is_named(cell: Cell) -> None:
    method = SimpleGraphPyramid(map_of(SEALED, merge_distance_m=3.0))
    with pytest.raises(InvalidValueError, match=rf"free cell.* got \({cell[0]}, {cell[1]}\)"):
        method.solve((0, 0), cell)
    with pytest.raises(InvalidValueError, match="free cell"):
        method.solve(cell, (0, 0))


@tried(60, scene=scenes(), seed=st.integers(0, 10**6))
def test_solvability_is_that_of_the_grid(scene: Scene, seed: int) -> None:
    topology = map_of_scene(scene)
    method, again = SimpleGraphPyramid(topology), SimpleGraphPyramid(topology)
    free = scene.classes == CellClass.FREE
    component = components(free)
    assert method.region_of is not None
    assert np.array_equal(method.region_of, np.where(free, topology.level.field_of, -1))
    for start, goal in free_pairs(scene.classes, 8, seed):
        answer, same = method.solve(start, goal), again.solve(start, goal)
        assert (answer.cells is not None) == (component[start] == component[goal])
        assert answer.nodes == same.nodes
        if answer.cells is not None:
            assert endpoints_match(answer, start, goal)
            assert_legal(answer.cells, free)
            assert_plan_holds(method, answer, start, goal)
            assert same.cells is not None
            assert np.array_equal(answer.cells, same.cells)


@pytest.mark.parametrize("line", ["#", "?", "#?"])
def test_a_map_without_a_free_cell_can_be_prepared(line: str) -> None:
    method = SimpleGraphPyramid(map_of(drawn(line)))
    assert method.n_nodes == method.n_edges == 0


@tried(80, scene=scenes(), seed=st.integers(0, 10**6))
def test_the_simple_graph_plans_as_the_multigraph_where_no_arcs_are_parallel(scene, seed):
    topology = map_of_scene(scene)
    method = SimpleGraphPyramid(topology)
    report = report_of(topology.arcs, topology.n_places)
    assert len(first_arcs(topology.level)) == report.n_edges
    if report.n_parallel_dropped:
        return
    search = MaxDistanceSearch(topology)
    for start, goal in free_pairs(scene.classes, 8, seed):
        route = search.search(topology.place_at(start), topology.place_at(goal))
        nodes = method.solve(start, goal).nodes
        assert nodes == (None if route is None else tuple(route.places.tolist()))


def test_the_simple_graph_keeps_the_first_of_parallel_arcs_and_no_self_loop() -> None:
    seen = 0
    for seed in range(20):
        level = map_of(rooms(min(MAX_SIDE, 24), seed), merge_distance_m=6.0).level
        kept = first_arcs(level)
        assert not level.is_self_loop[kept].any()
        pairs = [frozenset(pair) for pair in level.arcs[kept].tolist()]
        assert len(set(pairs)) == len(pairs)
        for group in report_of(level.arcs, level.n_vertices).parallel:
            assert group.arcs[0] in kept
            assert not np.isin(group.arcs[1:], kept).any()
            # What makes merging them harmless to the costs, and blind to the doors.
            assert len(set(level.max_distance_m[list(group.arcs)].tolist())) == 1
            seen += 1
    assert seen


def test_the_simple_graph_counts_free_places_and_the_edges_between_them() -> None:
    topology = map_of(rooms(12, seed=1), merge_distance_m=2.0)
    method = SimpleGraphPyramid(topology)
    free = topology.classes == CellClass.FREE
    assert method.n_nodes == free.sum() > 1
    graph = topology.level.to_simple_graph().graph
    assert method.n_edges == sum(free[u] and free[v] for u, v in graph.edges)


def test_a_search_on_arcs_decides_between_equal_walks_by_the_second_cost() -> None:
    edges = np.array([[0, 1], [1, 3], [2, 0], [3, 2], [4, 3]])
    costs = np.array([1.0, 2.0, 2.0, 1.0, 1.0])
    for ties, middle in (([1.0, 1, 2, 1, 0], 1), ([2.0, 1, 1, 1, 0], 2)):
        graph = ArcSearch(np.ones(6, dtype=np.bool_), edges, costs, np.array(ties))
        plan = graph.search(0, 4)
        assert plan.vertices.tolist() == [0, middle, 3, 4]
        assert graph.search(0, 5).vertices is None


def test_places_that_only_corners_join_are_not_joined() -> None:
    classes = drawn("#.", ".#")
    for corner_cutting in (False, True):
        grid = hn.OccupancyGrid(
            np.where(classes == CellClass.FREE, 0, 1).astype(np.float32),
            corner_cutting=corner_cutting,
        )
        assert SimpleGraphPyramid(map_of(grid)).solve((0, 0), (1, 1)).cells is None


def test_the_depot_is_planned(data: Path) -> None:
    grid = hn.load_map(
        data / "nav2" / "maps" / "depot.yaml", robot_radius_m=0.25, free_threshold=0.19
    )
    topology = map_of(grid, merge_distance_m=4.0)
    simple = SimpleGraphPyramid(topology)
    free = np.asarray(grid.classes == CellClass.FREE)
    search = GridSearch(free)
    for start, goal in free_pairs(grid.classes, 60, seed=3):
        optimum = search.search(start, goal).cells
        near = simple.solve(start, goal)
        assert (optimum is None) == (near.cells is None)
        if optimum is not None:
            assert_legal(near.cells, free)
            assert recounted(near.cells) >= recounted(optimum) - 1e-9
