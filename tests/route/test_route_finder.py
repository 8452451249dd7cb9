"""The places and arcs that a path of cells passes."""

from dataclasses import replace

import numpy as np

import hybridnav as hn
from hybridnav.maps import CellClass
from hybridnav.route import RouteFinder
from tests.strategies import drawn, occupancy_grid

CORNERS = drawn(
    "......",
    ".##.#.",
    ".#.#..",
    "......",
)


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
            assert path is not None
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
