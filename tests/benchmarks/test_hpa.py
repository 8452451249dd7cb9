"""HPA* and Thrun's map: clusters, critical points, regions, graphs, paths, authors' figures."""

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from benchmarks.baselines.hpa import HpaStar
from benchmarks.baselines.thrun import ThrunMap, joined_regions
from hybridnav._base.moves import length_in_cells
from hybridnav.errors import InvalidValueError
from hybridnav.harness.baselines import MethodResult
from hybridnav.maps import CellClass
from hybridnav.maps.files.movingai import load_movingai_map, load_scenarios
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

SIDES = st.sampled_from([2, 3, 5, 10, 64])


def clusters(shape: tuple[int, int], side: int) -> list[tuple[slice, slice]]:
    rows, cols = (range(0, extent, side) for extent in shape)
    return [(slice(row, row + side), slice(col, col + side)) for row in rows for col in cols]


def passed(method: HpaStar, answer: MethodResult) -> list[int]:
    assert method.region_of is not None
    assert answer.cells is not None
    regions = method.region_of[answer.cells[:, 0], answer.cells[:, 1]]
    return [int(r) for i, r in enumerate(regions) if i == 0 or r != regions[i - 1]]


@tried(60, classes=class_grids(), side=SIDES, seed=st.integers(0, 1000))
def test_paths_are_legal_never_too_short_and_found_where_there_is_one(classes, side, seed):
    grid = occupancy_grid(classes)
    enterable = classes == CellClass.FREE
    raw = HpaStar(grid, cluster_cells=side, smooth=False)
    methods = (
        raw,
        HpaStar(grid, cluster_cells=side),
        HpaStar(grid, cluster_cells=side, line_cells=100),
    )
    graph = move_graph(enterable)
    chosen = free_cells(classes, seed, 5)
    for start in chosen:
        optima = distances(graph, grid.shape, start)
        for goal in chosen:
            answers = [method.solve(start, goal) for method in methods]
            if math.isinf(optima[goal]):
                assert all(a.cells is None and a.nodes is None for a in answers)
                continue
            for answer in answers:
                assert answer.cells is not None
                assert_legal(answer.cells, enterable)
                assert tuple(answer.cells[0]) == start
                assert tuple(answer.cells[-1]) == goal
                assert recounted(answer.cells) >= optima[goal] - 1e-9
                assert recounted(answer.cells) <= recounted(answers[0].cells) + 1e-9
                assert math.isinf(answer.bound)
            assert answers[0].nodes == answers[1].nodes == tuple(passed(raw, answers[0]))


@tried(40, classes=class_grids(), side=SIDES)
def test_regions_are_the_connected_pieces_of_the_clusters(classes: Any, side: int) -> None:
    region_of = HpaStar(occupancy_grid(classes), cluster_cells=side).region_of
    enterable = classes == CellClass.FREE
    assert ((region_of >= 0) == enterable).all()
    seen: set[int] = set()
    for cluster in clusters(classes.shape, side):
        pieces = components(enterable[cluster])
        pairs = {
            (int(piece), int(region))
            for piece, region in zip(pieces.flat, region_of[cluster].flat, strict=True)
            if piece
        }
        regions = {region for _, region in pairs}
        assert len(pairs) == len(regions) == pieces.max()
        assert not regions & seen
        seen |= regions
    assert seen == set(range(len(seen)))


@tried(30, classes=class_grids(24), side=SIDES)
def test_edges_are_shortest_paths_inside_clusters_and_steps_between_them(classes, side):
    method = HpaStar(occupancy_grid(classes), cluster_cells=side)
    graph = method._graph
    cols = classes.shape[1]
    cells = [divmod(int(cell), cols) for cell in graph.cells]
    enterable = classes == CellClass.FREE
    assert method.n_nodes == len(cells)
    assert 2 * method.n_edges == len(graph.endpoints)
    for node, (row, col) in enumerate(cells):
        mine = (row // side, col // side)
        rows, columns = (slice(at * side, (at + 1) * side) for at in mine)
        inside = np.zeros_like(enterable)
        inside[rows, columns] = True
        truth = distances(move_graph(enterable, inside), classes.shape, (row, col))
        edges = slice(int(graph.first[node]), int(graph.first[node + 1]))
        endpoints, lengths = graph.endpoints[edges], length_in_cells(graph.costs[edges])
        found = {int(end): float(x) for end, x in zip(endpoints, lengths, strict=True)}
        assert len(found) == len(endpoints)
        for other, cell in enumerate(cells):
            if (cell[0] // side, cell[1] // side) != mine:
                steps = abs(cell[0] - row) + abs(cell[1] - col)
                assert other not in found or (steps == 1 and found[other] == 1.0)
            elif other != node:
                assert found.get(other, math.inf) == pytest.approx(truth[cell])


def test_short_entrances_have_one_transition_and_long_ones_two() -> None:
    for width, expected in ((5, [(2, 9)]), (6, [(0, 9), (5, 9)])):
        classes = np.zeros((10, 20), dtype=np.uint8)
        classes[:width] = CellClass.FREE
        method = HpaStar(occupancy_grid(classes))
        cells = [divmod(int(cell), 20) for cell in method._graph.cells]
        assert cells == expected + [(row, col + 1) for row, col in expected]


def test_runs_end_where_clusters_do_and_at_obstacles() -> None:
    classes = np.ones((20, 20), dtype=np.uint8)
    classes[14, 9] = CellClass.OCCUPIED
    method = HpaStar(occupancy_grid(classes))
    left = [divmod(int(cell), 20) for cell in method._graph.cells]
    rows = sorted(row for row, col in left if col == 9 and (row, 10) in left)
    # Above row 10 there are a run of four and one of five; (10, 9) belongs to the run between the
    # lower and the upper cluster.
    assert rows == [0, 9, 10, 11, 17]


def test_start_and_goal_in_one_cluster_take_the_better_way() -> None:
    classes = drawn("..........", "..........", "..........", ".####.....", "..........")
    method = HpaStar(occupancy_grid(classes), cluster_cells=5, smooth=False)
    left, right = int(method.region_of[0, 0]), int(method.region_of[0, 9])
    inside = method.solve((3, 0), (3, 3))
    assert inside.cells is not None
    assert recounted(inside.cells) == 3.0
    assert inside.nodes == (left,)
    # Ten inside the cluster; six through the transitions in the rows 0 and 3.
    outside = method.solve((0, 4), (2, 4))
    assert outside.cells is not None
    assert recounted(outside.cells) == 6.0
    assert outside.nodes == (left, right, left)


def test_pieces_of_one_cluster_are_joined_through_others() -> None:
    classes = drawn("..#..", "..#..", ".....", "#####", ".....")
    classes[1, 4] = CellClass.FREE
    method = HpaStar(occupancy_grid(classes), cluster_cells=3)
    answer = method.solve((0, 0), (2, 0))
    assert answer.cells is not None
    assert method.region_of[0, 0] != method.region_of[2, 0]
    assert recounted(answer.cells) == 10.0


@pytest.mark.parametrize("smooth", [True, False])
def test_start_is_goal(smooth: bool) -> None:
    method = HpaStar(occupancy_grid(np.ones((25, 25), dtype=np.uint8)), smooth=smooth)
    answer = method.solve((9, 9), (9, 9))
    assert answer.cells.tolist() == [[9, 9]]
    assert answer.nodes == (method.region_of[9, 9],)


def test_methods_have_names_and_sizes() -> None:
    grid = occupancy_grid(np.ones((30, 30), dtype=np.uint8))
    smooth, raw = HpaStar(grid), HpaStar(grid, smooth=False)
    assert (smooth.name, raw.name) == ("hpa-star", "hpa-star-raw")
    assert HpaStar(grid, line_cells=50).name == "hpa-star-lines-50"
    assert smooth.memory_bytes > raw.memory_bytes > 0


def test_senseless_sizes_are_refused() -> None:
    grid = occupancy_grid(np.ones((5, 5), dtype=np.uint8))
    with pytest.raises(InvalidValueError, match="clusters must be at least 2"):
        HpaStar(grid, cluster_cells=1)
    with pytest.raises(InvalidValueError, match="lines must be at least 1"):
        HpaStar(grid, line_cells=0)


def test_loss_on_a_game_map_is_that_of_the_paper(data: Path) -> None:
    folder = data / "movingai" / "dao"
    grid = load_movingai_map(folder / "arena2.map")
    scenarios = [s for s in load_scenarios(folder / "arena2.map.scen") if s.optimum_cells > 0]
    enterable = grid.classes == CellClass.FREE
    smooth, raw = HpaStar(grid), HpaStar(grid, smooth=False)
    losses = []
    for scenario in scenarios[:: len(scenarios) // 100]:
        answers = [method.solve(scenario.start, scenario.goal) for method in (smooth, raw)]
        for answer in answers:
            assert answer.cells is not None
            assert_legal(answer.cells, enterable)
        # The file gives six significant digits.
        lengths = [recounted(answer.cells) for answer in answers]
        losses.append([length / scenario.optimum_cells - 1 for length in lengths])
    assert np.min(losses) > -1e-5
    smoothed, unsmoothed = np.mean(losses, axis=0)
    assert 0.002 < smoothed < 0.02, "the paper: about 1 % after smoothing"
    assert unsmoothed > 2 * smoothed


Cell = tuple[int, int]


def two_rooms(door: int, *, rows: int = 21, cols: int = 31) -> Any:
    """Two rooms beside each other, joined by a door of so many cells in the middle of the wall."""
    classes = np.zeros((rows, cols), np.uint8)
    classes[1:-1, 1:-1] = CellClass.FREE
    wall = cols // 2
    classes[:, wall] = CellClass.OCCUPIED
    low = rows // 2 - door // 2
    classes[low : low + door, wall] = CellClass.FREE
    return classes


def region_of(made: ThrunMap) -> Any:
    assert made.region_of is not None
    return made.region_of


@tried(50, scene=scenes(), epsilon=st.sampled_from([1, 2, 5, 10, 40]))
def test_regions_partition_free_space_and_are_connected(scene: Scene, epsilon: int) -> None:
    made = ThrunMap(scene.grid, epsilon_cells=epsilon)
    regions = region_of(made)
    free = scene.classes == CellClass.FREE
    assert np.array_equal(regions >= 0, free)
    assert np.array_equal(np.unique(regions[free]), np.arange(made.n_nodes))
    for region in range(made.n_nodes):
        assert ndimage.label(regions == region)[1] == 1
    assert made.n_nodes >= components(free).max(initial=0)


@tried(40, scene=scenes(), epsilon=st.sampled_from([1, 3, 10]), seed=st.integers(0, 10**6))
def test_solvability_is_that_of_the_grid(scene: Scene, epsilon: int, seed: int) -> None:
    made = ThrunMap(scene.grid, epsilon_cells=epsilon)
    again = ThrunMap(scene.grid, epsilon_cells=epsilon)
    assert np.array_equal(region_of(made), region_of(again))
    free = scene.classes == CellClass.FREE
    component = components(free)
    search = GridSearch(free)
    for start, goal in free_pairs(scene.classes, 8, seed):
        answer, same = made.solve(start, goal), again.solve(start, goal)
        assert answer.nodes == same.nodes
        assert (answer.cells is not None) == (component[start] == component[goal])
        if answer.cells is None:
            assert answer.nodes is None
            continue
        assert same.cells is not None
        assert np.array_equal(answer.cells, same.cells)
        assert tuple(answer.cells[0]) == start
        assert tuple(answer.cells[-1]) == goal
        assert_legal(answer.cells, free)
        assert answer.nodes is not None
        assert answer.nodes[0] == region_of(made)[start]
        assert answer.nodes[-1] == region_of(made)[goal]
        assert np.isin(region_of(made)[tuple(answer.cells.T)], answer.nodes).all()
        optimum = search.search(start, goal).cells
        assert recounted(answer.cells) >= recounted(optimum) - 1e-9


@tried(40, scene=scenes(), epsilon=st.sampled_from([1, 3, 10]))
def test_critical_points_are_free_and_their_basis_points_are_obstacles_on_two_sides(scene, epsilon):
    made = ThrunMap(scene.grid, epsilon_cells=epsilon)
    padded = np.pad(scene.classes == CellClass.FREE, 1)
    clearance = np.asarray(ndimage.distance_transform_edt(padded))
    points, basis = made.critical_points + 1, made.basis_points + 1
    assert padded[tuple(points.T)].all()
    assert not padded[tuple(np.moveaxis(basis, -1, 0))].any()
    away = (basis - points[:, None]).astype(float)
    lengths = np.linalg.norm(away, axis=-1)
    # Each is the nearest of the cell itself or of one beside it, so at most two steps farther.
    assert (lengths <= clearance[tuple(points.T)][:, None] + 2 * np.sqrt(2) + 1e-9).all()
    assert ((away[:, 0] * away[:, 1]).sum(axis=1) <= -0.5 * lengths.prod(axis=1) + 1e-9).all()


@pytest.mark.parametrize("door", [1, 2, 3, 5])
def test_two_rooms_with_a_narrow_door_are_cut_at_the_door(door: int) -> None:
    classes = two_rooms(door)
    made = ThrunMap(occupancy_grid(classes))
    wall = classes.shape[1] // 2
    middle = (classes.shape[0] - 1) / 2
    near = np.abs(made.critical_points - [middle, wall]).max(axis=1) <= 1
    assert near.any(), made.critical_points
    regions = region_of(made)
    assert regions[5, 5] != regions[5, -6]
    assert made.n_nodes >= 2
    # No region reaches across the wall beyond the line at the door.
    for region in range(made.n_nodes):
        cols = np.nonzero(regions == region)[1]
        assert cols.max() <= wall + 1 or cols.min() >= wall - 1
    answer = made.solve((5, 5), (5, 25))
    assert answer.nodes is not None
    assert len(answer.nodes) >= 2


def test_one_convex_room_is_not_cut_into_pieces() -> None:
    classes = np.pad(np.ones((15, 15), np.uint8), 1)
    made = ThrunMap(occupancy_grid(classes))
    assert made.n_nodes == 1
    assert made.n_edges == 0


def test_a_larger_epsilon_leaves_no_more_critical_points() -> None:
    rng = np.random.default_rng(5)
    classes = np.where(rng.random((60, 60)) < 0.06, CellClass.OCCUPIED, CellClass.FREE)
    counts = [
        len(ThrunMap(occupancy_grid(classes), epsilon_cells=epsilon).critical_points)
        for epsilon in (2, 10, 40)
    ]
    assert counts[0] > counts[1] >= counts[2]


def test_a_large_map_of_many_narrowings_is_prepared() -> None:
    # Runs times cells exceed 32 bits here.
    side = 20 * MAX_SIDE
    noise = np.random.default_rng(0).random((side, side))
    classes = np.where(noise < 0.05, CellClass.OCCUPIED, CellClass.FREE)
    made = ThrunMap(occupancy_grid(classes), epsilon_cells=1)
    assert made.n_nodes > side
    assert np.array_equal(region_of(made) >= 0, classes == CellClass.FREE)


def test_unexplored_cells_are_obstacles_and_the_maps_border_is_one() -> None:
    walled = two_rooms(3)
    unexplored = np.where(walled == CellClass.OCCUPIED, CellClass.UNEXPLORED, walled)
    bare = two_rooms(3)[1:-1, 1:-1]
    made = [ThrunMap(occupancy_grid(classes)) for classes in (walled, unexplored, bare)]
    assert np.array_equal(region_of(made[0]), region_of(made[1]))
    assert np.array_equal(region_of(made[0])[1:-1, 1:-1], region_of(made[2]))


@pytest.mark.parametrize("line", ["#", "?", "#?"])
def test_a_map_without_a_free_cell_can_be_prepared(line: str) -> None:
    made = ThrunMap(occupancy_grid(drawn(line)))
    assert made.n_nodes == made.n_edges == 0


def test_start_equal_to_goal_is_one_cell_in_one_region() -> None:
    answer = ThrunMap(occupancy_grid(two_rooms(2))).solve((4, 4), (4, 4))
    assert answer.cells.tolist() == [[4, 4]]
    assert answer.nodes is not None
    assert len(answer.nodes) == 1


def test_wrong_arguments_are_named() -> None:
    grid = occupancy_grid(two_rooms(2))
    with pytest.raises(InvalidValueError, match="epsilon must be at least 1 cell, got 0"):
        ThrunMap(grid, epsilon_cells=0)
    with pytest.raises(InvalidValueError, match=r"free cell.*got \(0, 0\)"):
        ThrunMap(grid).solve((0, 0), (5, 5))


def test_without_scikit_image_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "skimage", None)
    with pytest.raises(InvalidValueError, match=r"hybridnav\[study\]"):
        ThrunMap(occupancy_grid(two_rooms(2)))


def test_the_depot_is_cut_into_regions_whose_paths_are_a_little_longer(data: Path) -> None:
    grid = hn.load_map(
        data / "nav2" / "maps" / "depot.yaml", robot_radius_m=0.25, free_threshold=0.19
    )
    made = ThrunMap(grid)
    free = np.asarray(grid.classes == CellClass.FREE)
    assert 50 < made.n_nodes < 500
    search = GridSearch(free)
    losses = []
    for start, goal in free_pairs(grid.classes, 100, seed=3):
        optimum, answer = search.search(start, goal).cells, made.solve(start, goal)
        assert (answer.cells is None) == (optimum is None)
        if optimum is not None and len(optimum) > 1:
            losses.append(recounted(answer.cells) / recounted(optimum) - 1)
    assert min(losses) >= -1e-9
    assert np.mean(losses) < 0.1


def test_regions_are_joined_by_legal_moves_only() -> None:
    region_of = np.array([[0, 1, 4], [2, 3, -1], [-1, -1, 5]], np.int32)
    pairs, middles = joined_regions(region_of)
    assert pairs.tolist() == [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [1, 4], [2, 3]]
    assert middles[0].tolist() == [0.0, 0.5]
    assert middles[2].tolist() == [0.5, 0.5]
    cut, _ = joined_regions(region_of, corner_cutting=True)
    assert {(3, 4), (3, 5)} <= {(u, v) for u, v in cut.tolist()}
