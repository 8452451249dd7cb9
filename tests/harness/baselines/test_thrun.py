"""Thrun's map: critical points where free space narrows, regions that partition it, plans."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.harness.baselines.thrun import ThrunMap
from hybridnav.maps import CellClass
from hybridnav.search.grid_search import GridSearch
from tests.oracle.grid import assert_legal, components, recounted
from tests.strategies import MAX_SIDE, Scene, drawn, examples, occupancy_grid, scenes

if TYPE_CHECKING:
    from pathlib import Path

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


def free_pairs(classes: Any, count: int, seed: int) -> list[tuple[Cell, Cell]]:
    cells = np.argwhere(classes == CellClass.FREE)
    if not len(cells):
        return []
    chosen = cells[np.random.default_rng(seed).integers(len(cells), size=(count, 2))]
    return [((a, b), (c, d)) for (a, b), (c, d) in chosen.tolist()]


def region_of(made: ThrunMap) -> Any:
    assert made.region_of is not None
    return made.region_of


@settings(max_examples=examples(50))
@given(scene=scenes(), epsilon=st.sampled_from([1, 2, 5, 10, 40]))
def test_regions_partition_free_space_and_are_connected(scene: Scene, epsilon: int) -> None:
    made = ThrunMap(scene.grid, epsilon_cells=epsilon)
    regions = region_of(made)
    free = scene.classes == CellClass.FREE
    assert np.array_equal(regions >= 0, free)
    assert np.array_equal(np.unique(regions[free]), np.arange(made.n_nodes))
    for region in range(made.n_nodes):
        assert ndimage.label(regions == region)[1] == 1
    assert made.n_nodes >= components(free).max(initial=0)


@settings(max_examples=examples(40))
@given(scene=scenes(), epsilon=st.sampled_from([1, 3, 10]), seed=st.integers(0, 10**6))
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


@settings(max_examples=examples(40))
@given(scene=scenes(), epsilon=st.sampled_from([1, 3, 10]))
def test_critical_points_are_free_and_their_basis_points_are_obstacles_on_two_sides(
    scene: Scene, epsilon: int
) -> None:
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
    assert answer.cells is not None
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
