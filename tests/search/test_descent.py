"""Descents through the levels: what is packed, routes, and paths against scipy's searches."""

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume
from hypothesis import strategies as st
from scipy import sparse
from scipy.sparse import csgraph

import hybridnav as hn
from hybridnav.maps import CellClass
from hybridnav.search.descent import (
    Descent,
    DescentSettings,
    Planes,
    has_small_places,
    layers_over,
    levels_by,
    pack,
    sizes_of,
)
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.kernels import descent as kernels
from hybridnav.search.lowest import lowest_of
from tests.oracle.grid import assert_legal, distances, move_graph, recounted
from tests.strategies import free_cells, scenes, seeds, tried

HOW = st.builds(
    DescentSettings,
    field_cells=st.sampled_from([1, 4, 16]),
    step=st.sampled_from([1.0, 2.0, 8.0]),
    ring=st.integers(0, 2),
    horizon_cells=st.sampled_from([1, 4, 1000]),
)


def made(scene: Any, how: DescentSettings) -> tuple[Any, Descent]:
    pyramid = scene.pyramid("radius")
    return pyramid, Descent(pyramid, scene.classes == CellClass.FREE, how)


@tried(300, scenes(), HOW, seeds)
def test_a_path_is_legal_and_there_whenever_one_is(scene: Any, how: Any, seed: int) -> None:
    enterable = scene.classes == CellClass.FREE
    cells = free_cells(scene.classes, seed, 6)
    assume(cells)
    _, descent = made(scene, how)
    graph = move_graph(enterable)
    for start, goal in itertools.pairwise(cells):  # a sequence: each leaves its marks to the next
        optimum = distances(graph, enterable.shape, start)[goal]
        found = descent.find(start, goal)
        assert (found.cells is None) == math.isinf(optimum)
        corridor = descent.corridor(start, goal)[1]
        assert (corridor is None) == math.isinf(optimum)
        if found.cells is None or corridor is None:
            continue
        assert_legal(found.cells, enterable)
        assert tuple(found.cells[0]) == start
        assert tuple(found.cells[-1]) == goal
        assert recounted(found.cells) == pytest.approx(found.length)
        assert found.length >= optimum - 1e-9
        assert corridor.n_cells == corridor.mask().sum() >= found.corridor_cells
        inside = move_graph(enterable, corridor.mask())
        assert math.isfinite(distances(inside, enterable.shape, start)[goal])


@tried(150, scenes(), HOW)
def test_the_levels_are_packed_as_the_pyramid_has_them(scene: Any, how: Any) -> None:
    pyramid = scene.pyramid("radius")
    enterable = scene.classes == CellClass.FREE
    sizes = sizes_of(pyramid)
    levels = levels_by(sizes, how)
    lowest = lowest_of(pyramid, sizes, levels, None, by_distance=True)
    fields = pack(lowest, Planes(lowest.layers, 0, 0), enterable, by_units=False)
    assert levels[0] == pyramid.place_level
    assert (np.diff(levels) < 0).all()
    for k, index in enumerate(levels):
        level, start = pyramid[index], fields.starts[k]
        assert fields.starts[k + 1] - start == level.n_vertices
        is_free = level.classes == CellClass.FREE
        arcs = level.arcs[is_free[level.arcs].all(axis=1)].tolist()
        joined = {tuple(sorted(pair)) for pair in arcs if pair[0] != pair[1]}
        packed = []
        for v in range(level.n_vertices):
            own = slice(*fields.first[start + v : start + v + 2])
            packed += [(v, int(w) - start) for w in fields.neighbour[own]]
        assert sorted(packed) == sorted([*joined, *(pair[::-1] for pair in joined)])
        if k == 0:
            continue
        parents = pyramid.ancestor(np.arange(level.n_vertices), level=index, to=levels[k - 1])
        own = slice(start, start + level.n_vertices)
        assert (fields.parent[own] == parents + fields.starts[k - 1]).all()
        middles = [level.receptive_field(v).mean(axis=0) for v in range(level.n_vertices)]
        np.testing.assert_allclose(fields.middle[own], np.reshape(middles, (-1, 2)), atol=1e-4)


@tried(200, scenes(), seeds)
def test_the_route_of_places_is_the_cheapest_by_max_distance(scene: Any, seed: int) -> None:
    cells = free_cells(scene.classes, seed, 2)
    assume(cells)
    pyramid, descent = made(scene, DescentSettings(field_cells=1))
    level = pyramid[pyramid.place_level]
    places = descent.find(*cells).places
    free = level.classes == CellClass.FREE
    arcs = level.arcs[free[level.arcs].all(axis=1) & ~level.is_self_loop]
    costs = level.max_distance_m[free[level.arcs].all(axis=1) & ~level.is_self_loop]
    table = np.full((level.n_vertices, level.n_vertices), np.inf)
    np.minimum.at(table, (arcs[:, 0], arcs[:, 1]), costs)
    table = np.minimum(table, table.T)
    ends = [int(level.field_of[cell]) for cell in cells]
    least = csgraph.dijkstra(sparse.csr_array(np.where(np.isinf(table), 0, table)))[ends[0]]
    if math.isinf(least[ends[1]]):
        assert not len(places)
        return
    assert [places[0], places[-1]] == ends
    total = sum(table[u, v] for u, v in itertools.pairwise(places.tolist()))
    assert total == pytest.approx(least[ends[1]], rel=1e-6)


def test_a_descent_that_runs_out_of_room_begins_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """With room for a few entries each search stops, and starts again with twice as much."""
    rng = np.random.default_rng(5)
    walls = (rng.random((50, 50)) < 0.25).astype(np.float32)
    grid = hn.OccupancyGrid(walls, robot_radius_m=0)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=3.0)
    graph, free = move_graph(grid.enterable()), np.argwhere(grid.enterable())
    monkeypatch.setattr("hybridnav.search.descent._ROOM", 1)
    for _ in range(20):  # each with work arrays of its own
        descent = Descent(pyramid, grid.enterable(), DescentSettings(field_cells=8))
        start, goal = (tuple(cell) for cell in rng.choice(free, 2).tolist())
        found = descent.find(start, goal)
        optimum = distances(graph, grid.shape, start)[goal]
        assert (found.cells is None) == math.isinf(optimum)
        if found.cells is not None:
            assert_legal(found.cells, grid.enterable())
            assert recounted(found.cells) <= 2 * optimum


def test_long_routes_are_found_part_by_part() -> None:
    """Routes of more fields than a part has: their costs add up, and no field comes twice."""
    rng = np.random.default_rng(6)
    walls = (rng.random((120, 120)) < 0.3).astype(np.float32)
    walls[:, 30::30] = 1
    walls[[3, 116, 3], [30, 60, 90]] = 0
    grid = hn.OccupancyGrid(walls, robot_radius_m=0)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=2.0)
    graph = move_graph(grid.enterable())
    descent = Descent(pyramid, grid.enterable(), DescentSettings(field_cells=2, step=2.0))
    reached = distances(graph, grid.shape, (3, 29))
    free, longest = np.argwhere(np.isfinite(reached)), 0
    for _ in range(40):
        start, goal = (tuple(cell) for cell in rng.choice(free, 2).tolist())
        watched = descent.watch(start, goal)
        for kept in watched.levels[1:]:
            assert len(set(kept.route.tolist())) == len(kept.route)
            longest = max(longest, len(kept.route))
        assert_legal(watched.cells, grid.enterable())
        optimum = distances(graph, grid.shape, start)[goal]
        assert recounted(watched.cells) <= 1.15 * optimum
    assert longest > 100


@tried(150, scenes(), st.sampled_from([1, 4, 9]), st.sampled_from(["small", "many", "few"]))
def test_fields_above_are_what_arcs_connect_inside_a_block(scene, field_cells, kind):
    pyramid, enterable = scene.pyramid("radius"), scene.classes == CellClass.FREE
    how = DescentSettings(field_cells=field_cells)
    limits = {"small": (0, 9, 2), "many": (10**9, 2, 2), "few": (10**9, 10**9, 2)}[kind]
    with pytest.MonkeyPatch.context() as patch:
        for name, limit in zip(("MANY_PLACES", "MOST_AT_TOP", "MOST_BLOCKS"), limits, strict=True):
            patch.setattr(f"hybridnav.search.descent.{name}", limit)
        sizes = sizes_of(pyramid)
        is_small = has_small_places(sizes, how)
        levels = [pyramid.place_level] if is_small else levels_by(sizes, how)
        lowest = lowest_of(pyramid, sizes, levels, None, by_distance=not is_small)
        planes = layers_over(lowest, enterable, how, is_by_places=True)
    (layers, named, _), level = planes, pyramid[levels[-1]]
    fields = pack(lowest, planes, enterable, by_units=False)
    is_open = level.classes == CellClass.FREE
    if kind == "few":
        assert len(layers) == len(levels)
    if named >= 0:
        assert len(layers[named].vertex) == pyramid[pyramid.place_level].n_vertices
    for k, (above, below) in enumerate(itertools.pairwise(layers)):
        assert fields.starts[k + 1] - fields.starts[k] == len(above.vertex)
        assert above.of[above.vertex].tolist() == list(range(len(above.vertex)))
        parents = fields.parent[fields.starts[k + 1] : fields.starts[k + 2]] - fields.starts[k]
        held = is_open[below.vertex]
        assert (parents[held] == above.of[below.vertex][held]).all()
        # Each field is connected: the sons of a route's fields hold a route.
        ends = below.of[level.arcs]
        ends = ends[(ends >= 0).all(axis=1)]
        ends = ends[held[ends].all(axis=1)]
        inside = ends[parents[ends[:, 0]] == parents[ends[:, 1]]]
        graph = sparse.coo_array((np.ones(len(inside)), tuple(inside.T)), shape=(len(held),) * 2)
        parts = csgraph.connected_components(graph, directed=False)[1][held]
        pairs = set(zip(parts.tolist(), parents[held].tolist(), strict=True))
        assert len(pairs) == len(set(parts.tolist())) == len(set(parents[held].tolist()))
        beside = {(int(a), int(b)) for a, b in parents[ends].tolist() if a != b}
        joined = set()
        for v in range(len(above.vertex)):
            own = slice(*fields.first[fields.starts[k] + v : fields.starts[k] + v + 2])
            joined |= {(v, int(w) - int(fields.starts[k])) for w in fields.neighbour[own]}
        assert joined == beside | {pair[::-1] for pair in beside}


def test_small_places_are_planned_from_blocks_above_them() -> None:
    grid = hn.OccupancyGrid(np.zeros((60, 60), dtype=np.float32), robot_radius_m=0)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=0.1)
    descent = Descent(pyramid, grid.enterable(), DescentSettings(field_cells=64))
    found = descent.find((0, 0), (59, 59))
    assert not len(found.places)
    assert found.cells is not None
    assert recounted(found.cells) == pytest.approx(59 * math.sqrt(2))
    assert found.expanded_fields <= 64  # of 3,600 places


@tried(100, scenes(), HOW, seeds)
def test_a_watched_descent_narrows_to_its_path(scene: Any, how: Any, seed: int) -> None:
    cells = free_cells(scene.classes, seed, 2)
    assume(cells)
    _, descent = made(scene, how)
    found, watched = descent.find(*cells), descent.watch(*cells)
    assert (watched is None) == (found.cells is None)
    if watched is None or found.cells is None:
        return
    assert (watched.cells == found.cells).all()
    above = on_route = np.ones(scene.classes.shape, dtype=np.bool_)
    for kept in watched.levels:
        assert kept.kept[kept.route].all()
        assert [kept.field_of[cell] for cell in cells] == kept.route[[0, -1]].tolist()
        joined = set(map(tuple, kept.arcs.tolist()))
        assert joined.issuperset(itertools.pairwise(kept.route.tolist()))
        on_route = np.isin(kept.field_of, kept.route)
        assert above[on_route].all()  # sons of what was kept above
        above = np.append(kept.kept, False)[kept.field_of]
        if how.ring == 0:
            assert (above == on_route).all()
    assert (above == on_route).all()
    assert watched.levels[0].route.tolist() == found.places.tolist()


@pytest.mark.parametrize(
    ("closed", "horizon", "stages"),
    [
        (slice(94, 106), 128, []),
        (slice(85, 115), 8, ["kept"]),
        (slice(60, 140), 128, ["kept", "whole"]),
        (slice(0, 200), 128, ["kept", "whole"]),
    ],
)
def test_closed_cells_widen_the_search_step_by_step(closed, horizon, stages, monkeypatch):
    """First by windows that go round, then in fields kept above, at last on the whole map."""
    walls = np.zeros((200, 200), dtype=np.float32)
    walls[:, 100] = 1
    walls[60:140, 100] = walls[190:, 100] = 0  # a gate, and a way round it far away
    grid = hn.OccupancyGrid(walls, robot_radius_m=0)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=40.0)
    keys = [f"planner.{key}" for key in ("field_cells=16", f"horizon_cells={horizon}")]
    preset = hn.load_preset("paper", overrides=keys)
    planner = hn.HybridPlanner(hn.TopologicalMap(pyramid), preset=preset)
    seen, search = [], GridSearch.search

    def watched(self: GridSearch, *ends: Any, **limits: Any) -> Any:
        seen.append("whole" if limits.get("in_corridor") is None else "kept")
        return search(self, *ends, **limits)

    monkeypatch.setattr(GridSearch, "search", watched)
    shut = np.zeros(grid.shape, dtype=np.bool_)
    shut[closed, 100] = True
    ends = (100, 5), (100, 195)
    points = grid.frame.points_of(np.array(ends))
    result = planner.plan(*points, blocked={"cells": np.argwhere(shut & grid.enterable())})
    assert seen == stages
    left = grid.enterable() & ~shut
    optimum = distances(move_graph(left), grid.shape, ends[0])[ends[1]]
    assert result.solved is math.isfinite(optimum)
    if result.path is None:
        return
    assert_legal(result.path.cells, left)
    assert recounted(result.path.cells) <= optimum * (1 if "whole" in stages else 1.1) + 1e-9


class _FilledNumpy:
    """numpy whose empty arrays hold one number, as memory that was used before may."""

    def __init__(self, number: int) -> None:
        self._number = number

    def __getattr__(self, name: str) -> Any:
        return getattr(np, name)

    def empty(self, shape: Any, dtype: Any = float) -> Any:
        return np.full(shape, self._number, dtype)


def test_a_window_that_ends_where_it_begins_adds_no_cell(monkeypatch: pytest.MonkeyPatch) -> None:
    """Closed cells led a window back to the cell in hand; what memory held before became a cell."""
    for name, value in {"MANY_PLACES": 0, "MOST_AT_TOP": 10, "MOST_BLOCKS": 2}.items():
        monkeypatch.setattr(f"hybridnav.search.descent.{name}", value)
    occupied = np.zeros((30, 5), np.float32)
    occupied[[0, 4, 26, 29], [4, 0, 0, 0]] = occupied[23:25, :4] = 1
    grid = hn.OccupancyGrid(occupied, hn.Frame(0.1), robot_radius_m=0)
    how = DescentSettings(field_cells=4, step=1.0, ring=2, horizon_cells=1)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=0.8)
    descent = Descent(pyramid, grid.enterable(), how)
    closed = [9, 13, 16, 21, 22, 28, 29, 35, 39, 42, 48, 55, 57, 68, 72, 75, 80, 86, 88, 97, 98]
    closed += [100, 103, 104, 105, 112, 125, 126, 135, 144]
    left = grid.enterable().copy()
    left.ravel()[closed] = False
    assert math.isinf(distances(move_graph(left), left.shape, (6, 1))[3, 3])
    ends, shut = ((6, 1), (3, 3)), np.array(closed)
    assert descent.find(*ends, closed=shut).cells is None  # compiled
    for name, kernel in list(vars(kernels).items()):
        if getattr(kernel, "__module__", "") == kernels.__name__:
            monkeypatch.setattr(kernels, name, getattr(kernel, "py_func", kernel))
    beyond = 4 * grid.shape[1] + 3  # between the start and the goal, past two closed corners
    monkeypatch.setattr(kernels, "np", _FilledNumpy(beyond))
    assert descent.find(*ends, closed=shut).cells is None
