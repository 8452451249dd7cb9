"""What a search of the mesh looked at: intervals that are seen, in order, up to the goal."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hybridnav.harness.judges import segment_faults
from hybridnav.maps import CellClass
from hybridnav.search.mesh import MeshSearch, SearchTrace, build_mesh, trace_search
from tests.strategies import class_grids, drawn, examples, occupancy_grid

seeds = st.integers(0, 2**32 - 1)


def traced(classes: Any, seed: int) -> SearchTrace:
    """A search between the centres of two free cells."""
    free = classes == CellClass.FREE
    cells = np.argwhere(free)
    assume(len(cells))
    (a, b), (c, d) = np.random.default_rng(seed).choice(cells, 2).tolist()
    return trace_search(
        build_mesh(free), ((a, b), (c, d)), ((a + 0.5, b + 0.5), (c + 0.5, d + 0.5))
    )


def cross(first: Any, second: Any) -> float:
    """Twice the area of a triangle."""
    return float(first[0] * second[1] - first[1] * second[0])


@settings(max_examples=examples(60), deadline=None)
@given(class_grids(max_side=14), seeds)
def test_every_interval_is_seen_from_its_root(classes: Any, seed: int) -> None:
    trace = traced(classes, seed)
    grid = occupancy_grid(classes)
    for root, endpoints in zip(trace.roots, trace.intervals, strict=True):
        length = np.hypot(*(endpoints[1] - endpoints[0]))
        for share in (0.25, 0.5, 0.75):
            point = endpoints[0] + share * (endpoints[1] - endpoints[0])
            # The endpoints are rounded; on the line of a wall a point may lie in it by as much.
            if (
                length > 1e-6
                and abs(cross(endpoints[1] - endpoints[0], root - endpoints[0])) > 1e-6 * length
            ):
                assert not segment_faults(grid, grid.frame.points_of_grid([root, point]))


@settings(max_examples=examples(60), deadline=None)
@given(class_grids(max_side=14), seeds)
def test_costs_rise_from_interval_to_interval_by_the_way_between_roots(
    classes: Any, seed: int
) -> None:
    trace = traced(classes, seed)
    start = trace.parents < 0
    np.testing.assert_allclose(
        trace.costs_cells[start], np.hypot(*(trace.roots[start] - trace.endpoints[0]).T)
    )
    assert (trace.parents < np.arange(len(trace.parents))).all()
    later = np.flatnonzero(~start)
    before = trace.parents[later]
    path = np.hypot(*(trace.roots[later] - trace.roots[before]).T)
    more = trace.costs_cells[later] - trace.costs_cells[before]
    # A wall on one line with the corner bends the way twice: then it is longer than straight.
    assert (more >= path - 1e-9).all()
    if trace.path.positions is not None and len(trace.parents):
        turn = trace.path.positions[-2]
        assert (trace.roots == turn).all(axis=1).any() or (
            np.isclose(trace.intervals, turn).all(axis=2).any()
        )


def test_a_trace_of_one_wall() -> None:
    classes = drawn(".....", "..#..", "..#..")
    search = build_mesh(classes == CellClass.FREE)
    cells = (0, 0), (0, 4)
    trace = trace_search(search, cells, ((0.5, 0.5), (0.5, 4.5)))
    assert trace.path.length_cells == pytest.approx(2 * math.hypot(1.5, 1.5) + 1)
    assert trace.path.expanded <= len(trace.parents)
    # The start sees the first intervals, the upper corners of the wall the others.
    assert set(map(tuple, trace.roots.tolist())) <= {(0.5, 0.5), (2.0, 2.0), (2.0, 3.0)}
    assert trace.roots[0].tolist() == [0.5, 0.5]


def test_a_search_that_looks_at_nothing_has_no_intervals() -> None:
    classes = drawn("..#..")
    mesh = build_mesh(classes == CellClass.FREE)
    for goal, length in (((0, 1), 1.0), ((0, 4), math.inf)):
        trace = trace_search(mesh, ((0, 0), goal), ((0.5, 0.5), (0.5, goal[1] + 0.5)))
        assert trace.intervals.shape == (0, 2, 2)
        assert trace.path.length_cells == length


def test_a_trace_finds_room_for_its_intervals(monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(3)
    free = rng.random((40, 40)) > 0.2
    free[0, 0] = free[-1, -1] = True
    mesh, endpoints = build_mesh(free), (((0, 0), (39, 39)), ((0.5, 0.5), (39.5, 39.5)))
    wide = trace_search(mesh, *endpoints)
    monkeypatch.setattr("hybridnav.search.mesh.search._ROOM", 4)
    narrow = trace_search(mesh, *endpoints)
    np.testing.assert_array_equal(wide.intervals, narrow.intervals)
    assert len(wide.parents) >= wide.path.expanded > 4
    assert wide.path.length_cells == MeshSearch(mesh).path(*endpoints).length_cells
