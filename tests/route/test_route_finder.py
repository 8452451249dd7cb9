"""The places and arcs that a path of cells passes."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import assume

import hybridnav as hn
from hybridnav.maps import CellClass
from hybridnav.route import RouteFinder
from tests.strategies import class_grids, drawn, occupancy_grid, seeds, tried

CORNERS = drawn("......", ".##.#.", ".#.#..", "......")


def test_walks_on_grids_with_corner_cutting_know_where_no_arc_is():
    grid = replace(occupancy_grid(CORNERS), corner_cutting=True)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.5))
    walks = RouteFinder(topology)
    free = np.argwhere(CORNERS == CellClass.FREE)
    planner = hn.HybridPlanner(topology, preset="octile")
    pinched = 0
    for start in free:
        for goal in free:
            path = planner.plan(*grid.frame.points_of([start, goal])).path
            cells = path.cells
            places, arcs = walks.of(cells)
            assert len(arcs) == len(places) - 1
            assert [places[0], places[-1]] == [topology.place_at(tuple(c)) for c in cells[[0, -1]]]
            for arc, tail, head in zip(arcs, places, places[1:], strict=False):
                pinched += arc == -1
                assert arc == -1 or set(topology.arcs[arc].tolist()) == {tail, head}
    assert pinched


def test_walks_know_their_arcs_on_maps_of_one_column():
    grid = occupancy_grid(np.ones((9, 1), np.uint8))
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.5))
    places, arcs = RouteFinder(topology).of(np.column_stack([np.arange(9), np.zeros(9, int)]))
    assert len(places) == topology.n_places > 1
    for arc, tail, head in zip(arcs, places, places[1:], strict=False):
        assert set(topology.arcs[arc].tolist()) == {tail, head}


def is_graze(arcs: list[int], steps: list[int], at: int) -> bool:
    return arcs[at] == arcs[at + 1] >= 0 and steps[at + 1] - steps[at] <= 10


@tried(60, class_grids(), seeds)
def test_a_route_is_the_walk_over_borders_without_its_grazes(classes: Any, seed: int) -> None:
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(occupancy_grid(classes), merge_distance_m=1.0)
    )
    free = np.argwhere(topology.grid.classes == CellClass.FREE)
    assume(len(free) > 1)
    rng = np.random.default_rng(seed)
    cells = free[rng.integers(len(free), size=1)]
    open_cells = set(map(tuple, free.tolist()))
    for _ in range(60):  # a walk that comes back often, along sides of cells
        row, col = cells[-1].tolist()
        beside = [(row + 1, col), (row - 1, col), (row, col + 1), (row, col - 1)]
        beside = [cell for cell in beside if cell in open_cells]
        if beside:
            cells = np.append(cells, [beside[rng.integers(len(beside))]], axis=0)
    places, arcs, steps = RouteFinder(topology).crossings(cells)
    field = topology.level.field_of[tuple(cells.T)].tolist()
    assert [places[0], places[-1]] == [field[0], field[-1]]
    assert len(places) - 1 == len(arcs) == len(steps)
    assert steps == sorted(steps)
    for arc, tail, head, step in zip(arcs, places, places[1:], steps, strict=False):
        assert set(topology.level.arcs[arc].tolist()) == {tail, head}
        assert {field[step], field[step + 1]} == {tail, head}
    assert not any(is_graze(arcs, steps, at) for at in range(len(arcs) - 1))
    # A visit longer than a graze, or through two arcs, stays.
    crossed = [at for at in range(len(field) - 1) if field[at] != field[at + 1]]
    for at, after in itertools.pairwise(crossed):
        if after - at > 10:
            assert field[after] in places


def in_a_row() -> RouteFinder:
    grid = hn.OccupancyGrid(np.zeros((1, 60), np.float32))
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=10.0)
    return RouteFinder(hn.TopologicalMap(pyramid))


def walked(cols: list[int]) -> tuple[list[int], list[int]]:
    return in_a_row().of(np.column_stack([np.zeros_like(cols), cols]))


def test_a_line_along_a_toothed_border_names_each_place_once() -> None:
    full = walked(list(range(60)))
    assert len(full[0]) > 3
    # Back and forth over each border, by up to five cells.
    cols = [0]
    for col in range(1, 60):
        last = max(col - 5, 0)
        cols += [col, *range(col - 1, last - 1, -1), *range(last + 1, col + 1)]
    assert walked(cols) == full


def test_a_long_visit_that_returns_by_its_arc_is_named() -> None:
    places, arcs = walked(list(range(60)))
    there_and_back = [*range(60), *range(58, -1, -1)]
    assert walked(there_and_back) == (places + places[-2::-1], arcs + arcs[::-1])
