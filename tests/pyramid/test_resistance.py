"""Contraction that narrow boundaries resist: levels of the pyramid like all others."""

from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.grid import CellClass, RoomLabels
from hybridnav.pyramid import Resistance
from tests.strategies import MAX_SIDE, class_grids, drawn, occupancy_grid


@st.composite
def steered(draw):
    """A map, a clearance for each cell, and a share."""
    classes = draw(class_grids(min(MAX_SIDE, 16)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    clearance = ndimage.distance_transform_edt(np.pad(classes != CellClass.OCCUPIED, 1))[1:-1, 1:-1]
    if draw(st.booleans()):
        clearance = rng.integers(0, draw(st.sampled_from([2, 9])), classes.shape).astype(np.float64)
    return classes, Resistance(clearance, draw(st.sampled_from([0.3, 0.8, 1.0])))


def grown(classes, resistance):
    return hn.DualGraphPyramid.build(
        occupancy_grid(classes), merge_distance_m=2.0, resistance=resistance
    )


def resists(level, arc, resistance):
    """The definition, cell by cell."""
    pairs = level.boundary(arc)
    width = max(min(resistance.clearance[tuple(cell)] for cell in pair) for pair in pairs)
    peaks = [
        max(resistance.clearance[tuple(cell)] for cell in level.receptive_field(int(vertex)))
        for vertex in level.arcs[arc]
    ]
    return width < resistance.share * min(peaks)


def contractible(level):
    """Arcs between two fields of one class."""
    classes = level.classes[level.arcs]
    return np.flatnonzero((classes[:, 0] == classes[:, 1]) & ~level.is_self_loop).tolist()


@given(scene=steered())
def test_what_is_contracted_did_not_resist_and_all_that_is_left_does(scene):
    classes, resistance = scene
    pyramid = grown(classes, resistance)
    for level in pyramid[pyramid.place_level : -1]:
        kernel = pyramid.contraction_kernel(level.index).tolist()
        assert kernel
        assert not any(resists(level, arc, resistance) for arc in kernel)
    apex = pyramid[-1]
    assert all(resists(apex, arc, resistance) for arc in contractible(apex))


@given(scene=steered())
def test_levels_above_the_places_are_plane_graphs_of_connected_fields(scene):
    classes, resistance = scene
    pyramid = grown(classes, resistance)
    graph = nx.grid_2d_graph(*classes.shape)
    graph.remove_nodes_from([cell for cell in graph if classes[cell] == CellClass.OCCUPIED])
    n_parts = nx.number_connected_components(graph)
    for level in pyramid[pyramid.place_level :]:
        isolated = level.n_vertices - len(np.unique(level.arcs))
        assert level.n_vertices - level.n_arcs + level.dual.n_faces == 2 * n_parts - isolated
        for vertex in range(level.n_vertices):
            field = list(map(tuple, level.receptive_field(vertex).tolist()))
            assert nx.is_connected(graph.subgraph(field))
            assert len({classes[cell] for cell in field}) == 1


@given(scene=steered())
def test_places_are_those_of_a_pyramid_without_resistance(scene):
    classes, resistance = scene
    pyramid = grown(classes, resistance)
    plain = hn.DualGraphPyramid.build(occupancy_grid(classes), merge_distance_m=2.0)
    assert (pyramid[pyramid.place_level].field_of == plain[-1].field_of).all()


def test_two_doors_between_the_same_rooms_stay_two_arcs():
    classes = drawn(
        "#############",
        "#.....#.....#",
        "#...........#",
        "#.....#.....#",
        "#.....#.....#",
        "#.....#.....#",
        "#...........#",
        "#.....#.....#",
        "#############",
    )
    clearance = ndimage.distance_transform_edt(classes != CellClass.OCCUPIED)
    apex = grown(classes, Resistance(clearance, 0.8))[-1]
    assert np.sort(apex.arcs, axis=1).tolist() == [[0, 1], [0, 1]]
    assert apex.field_of[4, 1] == apex.field_of[1, 5] != apex.field_of[4, 11]


def test_a_threshold_that_yields_to_both_rooms_joins_only_one_of_them():
    # A place of its own between two rooms as high as it is wide: as a star with two leaves it would
    # merge both rooms at once.
    classes = np.full((1, 9), CellClass.FREE, dtype=np.uint8)
    clearance = np.array([[9.0, 9, 9, 1, 1, 1, 9, 9, 9]])
    pyramid = hn.DualGraphPyramid.build(
        occupancy_grid(classes), merge_distance_m=1.5, resistance=Resistance(clearance, 0.8)
    )
    fields = pyramid[-1].field_of[0]
    assert fields[0] == fields[2] != fields[6] == fields[8]
    assert pyramid[-1].n_vertices == 2


@pytest.mark.parametrize("share", [0.0, 1.1, float("nan")])
def test_shares_and_clearances_that_mean_nothing_are_refused(share):
    with pytest.raises(hn.InvalidValueError, match="share"):
        Resistance(np.zeros((2, 2)), share)
    with pytest.raises(hn.InvalidValueError, match="finite"):
        Resistance(np.full((2, 2), np.inf), 0.5)


def test_a_clearance_may_be_lists_and_must_be_rows_of_columns():
    grid = occupancy_grid(np.ones((2, 3), dtype=np.uint8))
    rows: Any = [[1, 1, 0], [1, 1, 0]]
    built = [
        hn.DualGraphPyramid.build(grid, resistance=Resistance(clearance, 0.8))
        for clearance in (rows, np.array(rows, dtype=np.float64))
    ]
    np.testing.assert_array_equal(built[0][-1].field_of, built[1][-1].field_of)
    for wrong in ([1.0, 2.0], [[1.0], [1.0, 2.0]], [["a"]]):
        with pytest.raises(hn.InvalidValueError, match="clearance"):
            Resistance(wrong, 0.8)  # type: ignore[arg-type]


def test_a_resistance_of_another_map_or_with_rooms_is_refused():
    grid = occupancy_grid(np.ones((3, 3), dtype=np.uint8))
    rooms = RoomLabels(("a",), np.zeros((3, 3), dtype=np.int32))
    for more in ({"resistance": Resistance(np.zeros((2, 2)), 0.5)}, {"rooms": rooms}):
        arguments = {"resistance": Resistance(np.zeros((3, 3)), 0.5)} | more
        with pytest.raises(hn.InvalidValueError, match="resistance"):
            hn.DualGraphPyramid.build(grid, **arguments)
