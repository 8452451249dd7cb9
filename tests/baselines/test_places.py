"""Baselines on the places of a topological map: the simple graph and the exact overlay."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.baselines import _overlay_kernels, overlay
from hybridnav.baselines.overlay import ExactOverlay
from hybridnav.baselines.regions import joined_regions
from hybridnav.baselines.simple_graph import SimpleGraphPyramid, first_arcs
from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.pyramid.simple import report_of
from hybridnav.route import MaxDistanceSearch
from hybridnav.search.arc_search import ArcSearch
from hybridnav.search.grid_search import GridSearch
from tests.oracle.grid import assert_legal, components, distances, move_graph, recounted
from tests.strategies import MAX_SIDE, Scene, drawn, examples, occupancy_grid, scenes

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from hybridnav.baselines import Method, MethodResult

Cell = tuple[int, int]
METHODS: list[Callable[[hn.TopologicalMap], Method]] = [ExactOverlay, SimpleGraphPyramid]
# A room that no path enters.
SEALED = drawn(
    ".........",
    "..####...",
    "..#..#...",
    "..####...",
    ".........",
)
both = pytest.mark.parametrize("make", METHODS)


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


def free_pairs(classes: Any, count: int, seed: int) -> list[tuple[Cell, Cell]]:
    cells = np.argwhere(classes == CellClass.FREE)
    if not len(cells):
        return []
    chosen = cells[np.random.default_rng(seed).integers(len(cells), size=(count, 2))]
    return [((a, b), (c, d)) for (a, b), (c, d) in chosen.tolist()]


def endpoints_match(answer: MethodResult, start: Cell, goal: Cell) -> bool:
    cells = answer.cells
    return cells is not None and tuple(cells[0]) == start and tuple(cells[-1]) == goal


def assert_plan_holds(method: Method, answer: MethodResult, start: Cell, goal: Cell) -> None:
    """The plan goes from the start's place to the goal's, and the path stays inside it."""
    region_of = method.region_of
    assert region_of is not None
    assert answer.cells is not None
    if answer.nodes is None:
        return
    assert answer.nodes[0] == region_of[start]
    assert answer.nodes[-1] == region_of[goal]
    assert np.isin(region_of[answer.cells[:, 0], answer.cells[:, 1]], answer.nodes).all()


@settings(max_examples=examples(150))
@given(scene=scenes(), seed=st.integers(0, 10**6))
def test_the_overlay_is_as_short_as_the_grid_optimum(scene: Scene, seed: int) -> None:
    topology = map_of_scene(scene)
    method = ExactOverlay(topology)
    free = scene.classes == CellClass.FREE
    graph = move_graph(free)
    arcs = {frozenset(pair) for pair in topology.arcs.tolist()}
    for start, goal in free_pairs(scene.classes, 8, seed):
        optimum = distances(graph, free.shape, start)[goal]
        answer = method.solve(start, goal)
        if np.isinf(optimum):
            assert answer.cells is None
            continue
        assert endpoints_match(answer, start, goal)
        assert_legal(answer.cells, free)
        assert recounted(answer.cells) == pytest.approx(optimum, abs=1e-9)
        assert answer.bound == 1.0
        assert_plan_holds(method, answer, start, goal)
        nodes = answer.nodes or ()
        assert all(frozenset(pair) in arcs for pair in itertools.pairwise(nodes))


@pytest.mark.parametrize("merge_distance_m", [2.0, 6.0, 15.0, float("inf")])
@pytest.mark.parametrize("linkage", ["radius", "survivor"])
def test_the_overlay_equals_the_grid_search_on_rooms(merge_distance_m: float, linkage: str) -> None:
    classes = rooms(MAX_SIDE * 3, seed=4)
    method = ExactOverlay(map_of(classes, merge_distance_m=merge_distance_m, linkage=linkage))
    search = GridSearch(classes == CellClass.FREE)
    for start, goal in free_pairs(classes, 60, seed=1):
        expected = search.search(start, goal).cells
        answer = method.solve(start, goal)
        assert (answer.cells is None) == (expected is None)
        if expected is not None:
            assert_legal(answer.cells, classes == CellClass.FREE)
            assert recounted(answer.cells) == pytest.approx(recounted(expected), abs=1e-9)


def test_a_path_through_a_corner_where_fields_share_no_arc_makes_no_plan() -> None:
    answers = []
    for seed in range(30):
        topology = map_of(np.ones((9, 9), np.uint8), merge_distance_m=2.5, seed=seed)
        method = ExactOverlay(topology)
        arcs = {frozenset(pair) for pair in topology.arcs.tolist()}
        field_of = topology.level.field_of
        for row, col in np.ndindex(8, 8):
            # Every shortest path between the two is the diagonal move.
            fields = frozenset((int(field_of[row, col]), int(field_of[row + 1, col + 1])))
            answer = method.solve((row, col), (row + 1, col + 1))
            assert answer.cells is not None
            assert len(answer.cells) == 2
            assert (answer.nodes is None) == (len(fields) == 2 and fields not in arcs)
            answers.append(answer)
    assert any(answer.nodes is None for answer in answers)


@both
def test_a_path_inside_one_field_and_one_that_must_leave_it(make: Callable[..., Method]) -> None:
    classes = drawn("...", ".#.", "...")
    method = make(map_of(classes, merge_distance_m=float("inf")))
    answer = method.solve((0, 0), (2, 2))
    assert recounted(answer.cells) == 4
    assert answer.nodes == (0,)


@both
def test_start_equal_to_goal_is_one_cell(make: Callable[..., Method]) -> None:
    method = make(map_of(SEALED, merge_distance_m=3.0))
    answer = method.solve((0, 4), (0, 4))
    assert answer.cells is not None
    assert answer.cells.tolist() == [[0, 4]]
    assert answer.nodes is not None
    assert len(answer.nodes) == 1


@both
@pytest.mark.parametrize("cell", [(-1, 0), (0, 9), (5, 0), (1, 2)])
def test_a_cell_that_is_not_free_is_named(make: Callable[..., Method], cell: Cell) -> None:
    method = make(map_of(SEALED, merge_distance_m=3.0))
    with pytest.raises(InvalidValueError, match=rf"free cell.* got \({cell[0]}, {cell[1]}\)"):
        method.solve((0, 0), cell)
    with pytest.raises(InvalidValueError, match="free cell"):
        method.solve(cell, (0, 0))


@both
@settings(max_examples=examples(60))
@given(scene=scenes(), seed=st.integers(0, 10**6))
def test_solvability_is_that_of_the_grid(
    make: Callable[..., Method], scene: Scene, seed: int
) -> None:
    topology = map_of_scene(scene)
    method, again = make(topology), make(topology)
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


@pytest.mark.parametrize("make", METHODS)
@pytest.mark.parametrize("line", ["#", "?", "#?"])
def test_a_map_without_a_free_cell_can_be_prepared(make: Callable[..., Method], line: str) -> None:
    method = make(map_of(drawn(line)))
    assert method.n_nodes == method.n_edges == 0


@settings(max_examples=examples(80))
@given(scene=scenes(), seed=st.integers(0, 10**6))
def test_the_simple_graph_plans_as_the_multigraph_where_no_arcs_are_parallel(
    scene: Scene, seed: int
) -> None:
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
        assert plan.vertices is not None
        assert plan.vertices.tolist() == [0, middle, 3, 4]
        assert graph.search(0, 5).vertices is None


def test_regions_are_joined_by_legal_moves_only() -> None:
    region_of = np.array([[0, 1, 4], [2, 3, -1], [-1, -1, 5]], np.int32)
    pairs, middles = joined_regions(region_of)
    assert pairs.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [1, 4], [2, 3]]
    assert middles[0].tolist() == [0.0, 0.5]
    assert middles[2].tolist() == [0.5, 0.5]
    cut, _ = joined_regions(region_of, corner_cutting=True)
    assert {(3, 4), (3, 5)} <= {(u, v) for u, v in cut.tolist()}


def test_corner_cutting_reaches_the_overlay() -> None:
    classes = drawn("#.", ".#")
    for corner_cutting in (False, True):
        grid = hn.OccupancyGrid(
            np.where(classes == CellClass.FREE, 0, 1).astype(np.float32),
            corner_cutting=corner_cutting,
        )
        for make in METHODS:
            answer = make(map_of(grid)).solve((0, 0), (1, 1))
            assert (answer.cells is not None) == (corner_cutting and make is ExactOverlay)


def test_too_many_distances_are_refused_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(overlay, "MAX_CLIQUE_BYTES", 100)
    with pytest.raises(InvalidValueError, match="boundary cells need") as error:
        ExactOverlay(map_of(np.ones((12, 12), np.uint8), merge_distance_m=3.0))
    assert "\n" not in str(error.value)


def test_distances_too_long_for_32_bits_take_64(monkeypatch: pytest.MonkeyPatch) -> None:
    topology = map_of(rooms(MAX_SIDE, seed=2), merge_distance_m=6.0)
    plain = ExactOverlay(topology)
    fill = _overlay_kernels.fill_cliques

    def fill_all_but_32_bits(*arrays: Any) -> bool:
        return bool(fill(*arrays)) and arrays[-1].dtype != np.int32

    monkeypatch.setattr(_overlay_kernels, "fill_cliques", fill_all_but_32_bits)
    wide = ExactOverlay(topology)
    assert wide.memory_bytes > plain.memory_bytes
    for start, goal in free_pairs(topology.grid.classes, 20, seed=0):
        one, other = plain.solve(start, goal), wide.solve(start, goal)
        assert (one.cells is None) == (other.cells is None)
        if one.cells is not None and other.cells is not None:
            assert np.array_equal(one.cells, other.cells)


def test_the_kernel_says_when_distances_do_not_fit() -> None:
    made = ExactOverlay(map_of(np.ones((3, 40), np.uint8), merge_distance_m=12.0))
    arrays = (
        made._labels.ravel(),
        made._moves,
        made._cols,
        made._boxes,
        made._node_cell,
        made._node_first,
        made._clique_first,
    )
    size = int(made._clique_first[-1])
    assert _overlay_kernels.fill_cliques(*arrays, np.empty(size, np.int32))
    assert not _overlay_kernels.fill_cliques(*arrays, np.empty(size, np.int16))


def test_the_depot_is_planned_exactly(data: Path) -> None:
    grid = hn.load_map(
        data / "nav2" / "maps" / "depot.yaml", robot_radius_m=0.25, free_threshold=0.19
    )
    topology = map_of(grid, merge_distance_m=4.0)
    exact, simple = ExactOverlay(topology), SimpleGraphPyramid(topology)
    assert exact.n_nodes > 1000
    free = np.asarray(grid.classes == CellClass.FREE)
    search = GridSearch(free)
    for start, goal in free_pairs(grid.classes, 60, seed=3):
        optimum = search.search(start, goal).cells
        answer = exact.solve(start, goal)
        near = simple.solve(start, goal)
        assert (answer.cells is None) == (optimum is None) == (near.cells is None)
        if optimum is not None:
            assert_legal(answer.cells, free)
            assert recounted(answer.cells) == pytest.approx(recounted(optimum), abs=1e-9)
            assert recounted(near.cells) >= recounted(optimum) - 1e-9
