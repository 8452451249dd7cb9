"""A mesh with closed cells cut out of it is as good as one that is built without them."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hybridnav.grid import CellClass
from hybridnav.mesh import MeshSearch, build_mesh, cut_mesh
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
