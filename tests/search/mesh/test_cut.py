"""A mesh cut anew, and paths round closed cells, are as good as those of a mesh of the new map."""

import itertools
import math
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np
import pytest
from hypothesis import assume
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.harness.judges import VisibilityGraph
from hybridnav.maps import CellClass
from hybridnav.search.mesh import (
    ConvexMesh,
    DetourSearch,
    MeshSearch,
    build_mesh,
    renew_mesh,
    shortest_paths,
)
from tests.interrupts import Struck, lines_of
from tests.oracle.any_angle import some_positions
from tests.oracle.mesh import (
    KINDS,
    assert_sides_agree,
    corners_in_use,
    edges_between_corners,
    search_of,
    twice_the_area,
)
from tests.strategies import class_grids, drawn, occupancy_grid, seeds, tried


@st.composite
def closures(draw: st.DrawFn, least: int = 1) -> tuple[Any, Any]:
    """Free cells and some flat cells to close: single ones, and a window with a least side."""
    free = draw(class_grids(max_side=14)) == CellClass.FREE
    rng = np.random.default_rng(draw(seeds))
    shut = rng.random(free.shape) < rng.choice([0.0, 0.02, 0.1])
    row, col = (rng.integers(side) for side in free.shape)
    height, width = rng.integers(least, 6, 2)
    shut[row : row + height, col : col + width] = True
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


@tried(60, closures(least=0), seeds)
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
    rng = np.random.default_rng(draw(seeds))
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


@tried(80, changes(), seeds)
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


def without(free: Any, closed: Any) -> Any:
    left = free.copy()
    left.ravel()[closed] = False
    return left


def queries(free: Any, seed: int) -> Iterator[tuple[Any, Any]]:
    """Cells and positions of both endpoints, centres and degenerate ones."""
    for (first, start), (last, goal) in itertools.pairwise(some_positions(free, seed)):
        yield (first, last), (start, goal)


def detour_of(
    case: tuple[Any, Any], kind: str = "intervals"
) -> tuple[Any, MeshSearch, DetourSearch, MeshSearch]:
    """The cells that closures leave, searches of the whole mesh and round the closures, and one of
    a mesh built without them."""
    free, closed = case
    left = without(free, closed)
    assume(left.any())
    search = search_of(build_mesh(free), kind)
    return left, search, DetourSearch(search, free, closed), MeshSearch(build_mesh(left))


@tried(120, closures(), seeds, st.sampled_from(KINDS))
def test_a_detour_is_the_shortest_path_of_a_mesh_without(case, seed, kind):
    left, search, round_it, anew = detour_of(case, kind)
    for query in queries(left, seed):
        optimum = anew.path(*query).length_cells
        found, opened = round_it.search.path(*query), search.path(*query)
        assert found.length_cells == pytest.approx(optimum, abs=1e-9)
        assert found.lower_bound_cells == found.length_cells
        assert (found.positions is None) == math.isinf(optimum)
        if found.positions is not None:
            legs = np.diff(found.positions, axis=0)
            assert np.hypot(*legs.T).sum() == pytest.approx(optimum, abs=1e-9)
            assert not round_it.is_met_by(found) or (found.positions % 1 == 0).all(axis=1).any()
        if not round_it.is_met_by(opened):
            assert opened.length_cells == pytest.approx(optimum, abs=1e-9)


@tried(40, closures(), seeds)
def test_what_is_closed_in_turns_leaves_the_open_map_and_the_others_alone(case, seed):
    free, closed = case
    search = MeshSearch(build_mesh(free))
    search.prepare()
    parts = closed, closed[::2], closed[: len(closed) // 2]
    rounds = [DetourSearch(search, free, part) for part in parts]
    lefts = [without(free, part) for part in parts]
    assume(lefts[0].any())
    anew = [MeshSearch(build_mesh(left)) for left in lefts]
    opened = MeshSearch(build_mesh(free))
    for query in queries(lefts[0], seed):
        for round_it, fresh in zip([*rounds, *rounds], [*anew, *anew], strict=True):
            optimum = fresh.path(*query).length_cells
            assert round_it.search.path(*query).length_cells == pytest.approx(optimum, abs=1e-9)
            assert search.path(*query).length_cells == pytest.approx(
                opened.path(*query).length_cells, abs=1e-9
            )


@tried(60, closures(), seeds)
def test_a_detour_on_a_renewed_mesh_is_the_shortest_path_of_a_fresh_one(case, seed):
    free, closed = case
    before = free ^ (np.random.default_rng(seed).random(free.shape) < 0.1)
    left = without(free, closed)
    assume(left.any())
    mesh = renew_mesh(build_mesh(before), free, np.flatnonzero(before != free))
    search, anew = MeshSearch(mesh), MeshSearch(build_mesh(left))
    round_it = DetourSearch(MeshSearch(mesh), free, closed)
    for query in queries(left, seed):
        optimum = anew.path(*query).length_cells
        opened = search.path(*query)
        assert round_it.search.path(*query).length_cells == pytest.approx(optimum, abs=1e-9)
        if not round_it.is_met_by(opened):
            assert opened.length_cells == pytest.approx(optimum, abs=1e-9)


@tried(40, closures(), seeds)
def test_many_paths_are_judged_as_one_by_one(case: tuple[Any, Any], seed: int) -> None:
    left, search, round_it, _ = detour_of(case)
    cells, positions = zip(*queries(left, seed), strict=True)
    pairs = np.array(cells), np.array(positions)
    many = shortest_paths(
        search, (pairs[0][:, 0], pairs[0][:, 1]), (pairs[1][:, 0], pairs[1][:, 1])
    )
    met = [round_it.is_met_by(search.path(*query)) for query in queries(left, seed)]
    assert round_it.are_met_by(many).tolist() == met


@pytest.mark.parametrize("is_prepared", [False, True])
def test_a_path_along_a_closed_cell_is_left_alone_and_one_across_is_not(*, is_prepared):
    free = np.ones((6, 9), np.bool_)
    free[2, 4] = False
    search = MeshSearch(build_mesh(free))
    if is_prepared:
        search.prepare()
    query = ((2, 0), (2, 8)), ((2.5, 0.5), (2.5, 8.5))
    opened = search.path(*query)
    assert opened.positions is not None
    # Round the one blocked cell goes the path above or below: what lies on the other side is free.
    above = bool(opened.positions[1, 0] == 3)
    for cell, is_met in (((1 if above else 3, 4), False), ((3 if above else 1, 4), True)):
        round_it = DetourSearch(search, free, np.array([cell[0] * 9 + cell[1]]))
        assert round_it.is_met_by(opened) is is_met
        assert round_it.search.path(*query).length_cells == pytest.approx(opened.length_cells)


@pytest.mark.parametrize("is_prepared", [False, True])
def test_two_cells_that_meet_at_a_corner_let_nothing_through(*, is_prepared: bool) -> None:
    free = np.ones((4, 4), np.bool_)
    search = MeshSearch(build_mesh(free))
    if is_prepared:
        search.prepare()
    query = ((0, 0), (3, 3)), ((0.5, 0.5), (3.5, 3.5))
    apart = DetourSearch(search, free, np.array([1 * 4 + 2, 2 * 4 + 1]))
    opened = search.path(*query)
    assert apart.is_met_by(opened)
    assert apart.search.path(*query).length_cells > opened.length_cells
    one = DetourSearch(search, free, np.array([1 * 4 + 2]))
    assert not one.is_met_by(opened)


@tried(25, closures(), seeds, st.sampled_from([0.01, 0.3]))
def test_a_detour_is_as_near_the_optimum_as_it_was_asked_to_be(case, seed, epsilon):
    left, _, round_it, anew = detour_of(case)
    for query in queries(left, seed):
        optimum = anew.path(*query).length_cells
        found = round_it.search.path(*query, epsilon=epsilon)
        assert math.isinf(found.length_cells) == math.isinf(optimum)
        if math.isfinite(optimum):
            assert found.lower_bound_cells <= optimum + 1e-9
            assert optimum - 1e-9 <= found.length_cells <= (1 + epsilon) * optimum + 1e-9


HALLS = drawn(
    "##########################",
    "#......#........#........#",
    "#......#........#........#",
    "#...........#........#...#",
    "#......#........#........#",
    "####.######.#########.####",
    "#........................#",
    "#........................#",
    "####.######.#########.####",
    "#......#........#........#",
    "#...#...............#....#",
    "#......#........#........#",
    "##########################",
)


def halls() -> tuple[hn.HybridPlanner, list[Any], list[Any]]:
    """A prepared planner, pairs of points, and what may be closed."""
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(occupancy_grid(HALLS), merge_distance_m=4.0)
    )
    planner = hn.HybridPlanner(topology)
    planner.prepare()
    cells = np.argwhere(HALLS == CellClass.FREE)
    rng = np.random.default_rng(4)
    points = topology.grid.frame.points_of(rng.choice(cells, 24))
    shut = [planner.closed({"cells": cells[at : at + 6]}) for at in range(0, 100, 9)]
    return planner, list(itertools.pairwise(points)), shut


def test_threads_that_close_different_things_disturb_nobody() -> None:
    planner, pairs, shut = halls()
    asked = [(pair, closed) for closed in (*shut, None) for pair in pairs] * 3

    def cost(query: Any) -> float:
        pair, closed = query
        return planner.plan(*pair, blocked=closed).cost

    alone = [cost(query) for query in asked]
    other, _, _ = halls()
    planner = other
    with ThreadPoolExecutor(4) as pool:
        assert list(pool.map(cost, asked)) == alone


def test_an_interrupt_leaves_nothing_closed_and_nothing_changed() -> None:
    planner, pairs, shut = halls()
    pair = max(pairs, key=lambda of: planner.plan(*of).cost)
    opened = planner.plan(*pair).cost
    closed = next(one for one in shut if opened < planner.plan(*pair, blocked=one).cost)
    wanted = planner.plan(*pair, blocked=closed).cost
    for at in range(1, 400, 7):
        again, _, _ = halls()
        asked = partial(again.plan, *pair, blocked=closed)
        try:
            lines = lines_of(asked, strike_at=at)
        except Struck:
            lines = at
        assert again.plan(*pair).cost == opened
        assert asked().cost == wanted
        if lines < at:
            break
    assert at > 100
