"""A mesh that is cut anew where cells changed is as good as one built of the changed map."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hybridnav.harness.judges import VisibilityGraph
from hybridnav.maps import CellClass
from hybridnav.search.mesh import ConvexMesh, MeshSearch, build_mesh, renew_mesh
from tests.oracle.any_angle import some_positions
from tests.oracle.mesh import (
    KINDS,
    assert_sides_agree,
    corners_in_use,
    edges_between_corners,
    search_of,
    twice_the_area,
)
from tests.strategies import class_grids, drawn, examples, occupancy_grid


@st.composite
def cuts(draw: st.DrawFn) -> tuple[Any, Any]:
    """Free cells and some flat cells to close: single ones, and windows."""
    free = draw(class_grids(max_side=14)) == CellClass.FREE
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shut = rng.random(free.shape) < rng.choice([0.02, 0.1])
    row, col = (rng.integers(side) for side in free.shape)
    shut[row : row + rng.integers(5), col : col + rng.integers(5)] = True
    return free, np.flatnonzero(shut)


def assert_as_fresh(mesh: ConvexMesh, free: Any) -> None:
    """Hold that a mesh has the corners and edges of one that is built of the free cells."""
    fresh = build_mesh(free)
    assert corners_in_use(mesh) == corners_in_use(fresh)
    assert len(edges_between_corners(mesh)) == len(edges_between_corners(fresh))


def assert_shortest(searches: list[MeshSearch], free: Any, seed: int) -> None:
    """Hold that paths are as short as those of the visibility graph of the free cells."""
    graph = VisibilityGraph(occupancy_grid(free.astype(np.uint8)))
    for (first, start), (last, goal) in itertools.pairwise(some_positions(free, seed)):
        length = graph.between(start, goal).length_m
        for search in searches:
            found = search.path((first, last), (start, goal))
            assert found.length_cells == pytest.approx(length, abs=1e-9)
            assert found.lower_bound_cells == pytest.approx(length, abs=1e-9)


@settings(max_examples=examples(60), deadline=None)
@given(cuts(), st.integers(0, 2**32 - 1))
def test_cutting_is_building_without(cut: tuple[Any, Any], seed: int) -> None:
    free, closed = cut
    left = free.copy()
    left.ravel()[closed] = False
    mesh = renew_mesh(build_mesh(free), left, closed)
    assert_sides_agree(mesh)
    assert twice_the_area(mesh) == 2 * left.sum()
    assert_as_fresh(mesh, left)
    assume(left.any())
    assert_shortest([search_of(mesh, kind) for kind in KINDS], left, seed)


def test_a_mesh_without_a_change_is_the_same() -> None:
    free = np.ones((4, 5), np.bool_)
    mesh = build_mesh(free)
    assert renew_mesh(mesh, free, np.array([], np.int64)) is mesh


def test_cells_that_were_not_free_and_are_not_change_nothing() -> None:
    free = np.zeros((4, 5), np.bool_)
    assert renew_mesh(build_mesh(free), free, np.array([6])).n_polygons == 0
    free[1, 1:4] = True
    renewed = renew_mesh(build_mesh(free), free, np.array([17]))
    assert twice_the_area(renewed) == 6


def test_only_polygons_that_are_touched_are_made_anew() -> None:
    rng = np.random.default_rng(0)
    free = rng.random((80, 80)) > 0.1
    mesh = build_mesh(free)
    closed = np.flatnonzero(free)[[3000]]
    left = free.copy()
    left.ravel()[closed] = False
    cut = renew_mesh(mesh, left, closed)
    gone = (cut.component[: mesh.n_polygons] < 0).sum()
    assert 1 <= gone <= 12
    assert cut.n_polygons - mesh.n_polygons <= 24


@st.composite
def changes(draw: st.DrawFn) -> list[Any]:
    """Free cells, and what they become: boxes freed, blocked or shuffled, and single cells."""
    maps = [draw(class_grids(max_side=18)) == CellClass.FREE]
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    for _ in range(draw(st.integers(1, 5))):
        free = maps[-1].copy()
        row, col = (int(rng.integers(side)) for side in free.shape)
        box = np.s_[row : row + rng.integers(1, 8), col : col + rng.integers(1, 8)]
        kind = rng.integers(4)
        if kind == 3:
            free ^= rng.random(free.shape) < 0.1
        else:
            free[box] = rng.random(free[box].shape) < kind / 2
        maps.append(free)
    return maps


def prepared_by_queries(mesh: ConvexMesh, free: Any) -> MeshSearch:
    """A search after queries that make it prepare its graph, unless they expand nothing."""
    search, cells = MeshSearch(mesh), np.argwhere(free)
    pairs = cells[np.random.default_rng(0).integers(len(cells), size=(400, 2))].tolist()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hybridnav.search.mesh.search._WORTH", 0)
        for (a, b), (c, d) in pairs:
            search.path(((a, b), (c, d)), ((a + 0.5, b + 0.5), (c + 0.5, d + 0.5)))
            if search.is_prepared:
                break
    return search


@settings(max_examples=examples(80), deadline=None)
@given(changes(), st.integers(0, 2**32 - 1))
def test_a_renewed_mesh_is_as_good_as_a_fresh_one(maps: list[Any], seed: int) -> None:
    mesh = build_mesh(maps[0])
    for before, free in itertools.pairwise(maps):
        older = mesh.n_polygons
        changed = np.flatnonzero(before != free)
        np.random.default_rng(seed).shuffle(changed)
        kept = mesh.first.copy(), mesh.begins.copy()
        mesh = renew_mesh(mesh, free, changed)
        assert (mesh.first[: older + 1] == kept[0]).all()
        assert (mesh.begins[: len(kept[1])] == kept[1]).all()
        assert_sides_agree(mesh)
        assert twice_the_area(mesh) == 2 * free.sum()
        assert_as_fresh(mesh, free)
        if free.any():
            searches = [search_of(mesh, kind) for kind in KINDS]
            assert_shortest([*searches, prepared_by_queries(mesh, free)], free, seed)


def test_a_door_that_opens_and_closes_leaves_the_other_polygons_as_they_are() -> None:
    rng = np.random.default_rng(0)
    free = rng.random((80, 80)) > 0.1
    free[40] = False
    mesh = build_mesh(free)
    door = np.array([40 * 80 + 30, 40 * 80 + 31])
    for turn in range(6):
        free[40, 30:32] = turn % 2 == 0
        renewed = renew_mesh(mesh, free, door)
        gone = (renewed.component[: mesh.n_polygons] < 0) & (mesh.component >= 0)
        assert gone.sum() <= 20
        assert renewed.n_polygons - mesh.n_polygons <= 30
        mesh = renewed


@pytest.mark.parametrize("kind", KINDS)
def test_corners_at_which_walls_run_straight_on_are_left_out(kind: str) -> None:
    old = drawn("#..", "#.#", "...", "#..", "#..", "##.", "#..") == CellClass.FREE
    free = drawn("#.#", "#..", "#.#", "#..", ".#.", "##.", "#..") == CellClass.FREE
    mesh = renew_mesh(build_mesh(old), free, np.flatnonzero(old != free))
    assert_as_fresh(mesh, free)
    found = search_of(mesh, kind).path(((3, 2), (5, 2)), ((3.5, 2.5), (5.5, 2.5)))
    assert found.length_cells == found.lower_bound_cells == pytest.approx(1 + np.sqrt(2))
