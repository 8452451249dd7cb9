"""A mesh that is cut anew where cells changed is as good as one built of the changed map."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hybridnav.grid import CellClass
from hybridnav.mesh import MeshSearch, build_mesh, cut_mesh, locate_polygons, renew_mesh
from tests.oracle.any_angle import some_positions
from tests.oracle.mesh import assert_sides_agree, twice_the_area
from tests.strategies import class_grids, examples


@st.composite
def cuts(draw: st.DrawFn) -> tuple[Any, Any]:
    """Free cells and some flat cells to close: single ones, and windows."""
    free = draw(class_grids(max_side=14)) == CellClass.FREE
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shut = rng.random(free.shape) < rng.choice([0.02, 0.1])
    row, col = (rng.integers(side) for side in free.shape)
    shut[row : row + rng.integers(5), col : col + rng.integers(5)] = True
    return free, np.flatnonzero(shut)


@settings(max_examples=examples(60), deadline=None)
@given(cuts(), st.integers(0, 2**32 - 1))
def test_cutting_is_building_without(cut: tuple[Any, Any], seed: int) -> None:
    free, closed = cut
    left = free.copy()
    left.ravel()[closed] = False
    mesh = cut_mesh(build_mesh(free), left, closed)
    assert_sides_agree(mesh)
    assert twice_the_area(mesh) == 2 * left.sum()
    assume(left.any())
    wanted, searches = MeshSearch(build_mesh(left)), (MeshSearch(mesh), MeshSearch(mesh))
    searches[1].prepare()
    endpoints = some_positions(left, seed)
    for (first, start), (last, goal) in itertools.pairwise(endpoints):
        query = (first, last), (start, goal)
        length = wanted.path(*query).length_cells
        for search in searches:
            assert search.path(*query).length_cells == pytest.approx(length, abs=1e-9)


def test_what_is_not_free_cuts_nothing() -> None:
    free = np.ones((4, 5), np.bool_)
    free[1, 1] = False
    mesh = build_mesh(free)
    assert cut_mesh(mesh, free, np.array([6])) is mesh


def test_only_polygons_that_are_touched_are_made_anew() -> None:
    rng = np.random.default_rng(0)
    free = rng.random((80, 80)) > 0.1
    mesh = build_mesh(free)
    closed = np.flatnonzero(free)[[3000]]
    left = free.copy()
    left.ravel()[closed] = False
    cut = cut_mesh(mesh, left, closed)
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
        located = locate_polygons(mesh, free)
        assert ((located.polygon_at >= 0) == free).all()
        assert (mesh.component[located.polygon_at[free]] >= 0).all()
        if not free.any():
            continue
        wanted, searches = MeshSearch(build_mesh(free)), (MeshSearch(mesh), MeshSearch(located))
        endpoints = some_positions(free, seed)
        for (first, start), (last, goal) in itertools.pairwise(endpoints):
            query = (first, last), (start, goal)
            length = wanted.path(*query).length_cells
            for search in searches:
                assert search.path(*query).length_cells == pytest.approx(length, abs=1e-9)


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
