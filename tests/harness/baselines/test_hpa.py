"""HPA*: its clusters, its graph, its paths, and its authors' figure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav._base.moves import length_in_cells
from hybridnav.errors import InvalidValueError
from hybridnav.harness.baselines.hpa import HpaStar
from hybridnav.maps import CellClass
from hybridnav.maps.files.movingai import load_movingai_map, read_scenarios
from tests.oracle.grid import assert_legal, components, distances, move_graph, recounted
from tests.strategies import class_grids, drawn, examples, occupancy_grid

if TYPE_CHECKING:
    from pathlib import Path

    from hybridnav.harness.baselines import MethodResult

SIDES = st.sampled_from([2, 3, 5, 10, 64])


def free_cells(classes: Any, seed: int, count: int) -> list[tuple[int, int]]:
    """Some free cells of a map."""
    free = np.argwhere(classes == CellClass.FREE)
    if not len(free):
        return []
    chosen = np.random.default_rng(seed).integers(len(free), size=count)
    return [(int(row), int(col)) for row, col in free[chosen]]


def clusters(shape: tuple[int, int], side: int) -> list[tuple[slice, slice]]:
    """The cells of each cluster."""
    rows, cols = (range(0, extent, side) for extent in shape)
    return [(slice(row, row + side), slice(col, col + side)) for row in rows for col in cols]


def passed(method: HpaStar, answer: MethodResult) -> list[int]:
    """Regions that the cells of an answer pass."""
    assert method.region_of is not None
    assert answer.cells is not None
    regions = method.region_of[answer.cells[:, 0], answer.cells[:, 1]]
    return [int(r) for i, r in enumerate(regions) if i == 0 or r != regions[i - 1]]


@settings(max_examples=examples(60))
@given(classes=class_grids(), side=SIDES, seed=st.integers(0, 1000))
def test_paths_are_legal_never_too_short_and_found_where_there_is_one(
    classes: Any, side: int, seed: int
) -> None:
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


@settings(max_examples=examples(40))
@given(classes=class_grids(), side=SIDES)
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


@settings(max_examples=examples(30))
@given(classes=class_grids(24), side=SIDES)
def test_edges_are_shortest_paths_inside_clusters_and_steps_between_them(
    classes: Any, side: int
) -> None:
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
    classes = drawn(
        "..........",
        "..........",
        "..........",
        ".####.....",
        "..........",
    )
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
def test_start_is_goal(smooth: bool) -> None:  # noqa: FBT001
    method = HpaStar(occupancy_grid(np.ones((25, 25), dtype=np.uint8)), smooth=smooth)
    answer = method.solve((9, 9), (9, 9))
    assert answer.cells is not None
    assert answer.cells.tolist() == [[9, 9]]
    assert answer.nodes == (method.region_of[9, 9],)


def test_queries_do_not_depend_on_those_before() -> None:
    rng = np.random.default_rng(2)
    classes = np.where(rng.random((40, 40)) < 0.2, 0, 1).astype(np.uint8)
    grid = occupancy_grid(classes)
    used = HpaStar(grid, cluster_cells=6)
    chosen = free_cells(classes, 3, 20)
    for start, goal in zip(chosen, reversed(chosen), strict=True):
        again, fresh = used.solve(start, goal), HpaStar(grid, cluster_cells=6).solve(start, goal)
        assert (again.nodes, again.expanded) == (fresh.nodes, fresh.expanded)
        assert again.expanded_nodes == fresh.expanded_nodes
        assert (again.cells is None) == (fresh.cells is None)
        if again.cells is not None and fresh.cells is not None:
            assert again.cells.tolist() == fresh.cells.tolist()


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
    scenarios = [s for s in read_scenarios(folder / "arena2.map.scen") if s.optimum_cells > 0]
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
