"""Rooms that grow out of segments: levels of a pyramid like all others."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.maps import CellClass, RoomLabels
from hybridnav.topology.rooms.growing import Growth, Likely, Small, contract
from tests.strategies import MAX_SIDE, class_grids, occupancy_grid
from tests.topology.test_judging import segments_of


@st.composite
def cut(draw):
    """Free cells, and segments of them."""
    classes = draw(class_grids(min(MAX_SIDE, 16)))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    free = classes == CellClass.FREE
    parts = rng.integers(0, draw(st.sampled_from([2, 9])), free.shape)
    rows, cols = np.indices(free.shape) // 4
    label_of = np.where(draw(st.booleans()), parts, 9 * rows + cols)
    return free, np.where(free, label_of, -1)


def by_sizes(segments):
    """A judge that likes two segments the better, the smaller they are together."""

    def judge(pairs, _evidence):
        cells = segments.state.free[segments.state.endpoints[pairs]].sum(axis=1)
        return 1 / (1 + cells / 20)

    return judge


def neighbours(label_of):
    """Sides between any two labels, counted one by one."""
    sides: dict[frozenset[int], int] = {}
    for a, b in ((label_of[1:], label_of[:-1]), (label_of[:, 1:], label_of[:, :-1])):
        touch = (a >= 0) & (b >= 0) & (a != b)
        for pair in zip(a[touch].tolist(), b[touch].tolist(), strict=True):
            sides[frozenset(pair)] = sides.get(frozenset(pair), 0) + 1
    return sides


@given(scene=cut())
def test_places_are_the_segments_and_fields_of_the_apex_what_is_left_of_them(scene):
    free, label_of = scene
    segments = segments_of(free, label_of)
    pyramid = contract(segments, [Likely(by_sizes(segments), 0.4)])
    for level, labels in (
        (pyramid[pyramid.place_level], label_of),
        (pyramid[-1], segments.label_of),
    ):
        parts, n_parts = np.full(free.shape, -1), 0
        for label in np.unique(labels[free]):
            part_of, n = ndimage.label(labels == label)
            parts[part_of > 0] = part_of[part_of > 0] + n_parts
            n_parts += n
        assert level.n_vertices == n_parts
        both = np.stack([parts[free], level.field_of.reshape(free.shape)[free]])
        assert len(np.unique(both, axis=1).T) == n_parts


@given(scene=cut())
def test_segments_that_are_left_apart_resist(scene):
    free, label_of = scene
    segments = segments_of(free, label_of)
    contract(segments, [Likely(by_sizes(segments), 0.4)])
    sizes = dict(zip(*np.unique(segments.label_of, return_counts=True), strict=True))
    for pair in neighbours(segments.label_of):
        assert 1 / (1 + sum(sizes[label] for label in pair) / 20) < 0.4


@given(scene=cut())
def test_no_small_segment_is_left_beside_another(scene):
    free, label_of = scene
    segments = segments_of(free, label_of)
    contract(segments, [Small(12)])
    labels = segments.label_of
    beside = {label for pair in neighbours(labels) for label in pair}
    assert all((labels == label).sum() >= 12 for label in beside)
    # What was large and had no small neighbour stays as it was.
    before = neighbours(label_of)
    for label in np.unique(label_of[free]).tolist():
        around = {label}.union(*(pair for pair in before if label in pair))
        if all((label_of == one).sum() >= 12 for one in around):
            cells = label_of == label
            assert (cells == (labels == labels[cells][0])).all()


def test_the_likeliest_of_several_merges_first_and_the_others_are_judged_again():
    free = np.ones((4, 40), dtype=bool)
    label_of = np.arange(40)[None].repeat(4, axis=0) // 10
    likely = {frozenset((1, 2)): 0.9, frozenset((0, 1)): 0.8, frozenset((2, 3)): 0.7}
    segments = segments_of(free, label_of)
    asked = []

    def judge(pairs, _evidence):
        ends = [frozenset(pair) for pair in segments.state.endpoints[pairs].tolist()]
        asked.append(ends)
        return np.array([likely.get(pair, 0.0) for pair in ends])

    contract(segments, [Likely(judge, 0.5)])
    assert set(asked[0]) == set(likely)
    (kept,) = set(segments.owner_of[[1, 2]].tolist())
    assert set(asked[1]) == {frozenset((0, kept)), frozenset((kept, 3))}


def test_levels_above_segments_are_plane_graphs_with_duals():
    free = np.random.default_rng(5).random((24, 24)) < 0.85
    rows, cols = np.indices(free.shape) // 3
    segments = segments_of(free, np.where(free, 8 * rows + cols, -1))
    pyramid = contract(segments, [Likely(by_sizes(segments), 0.2)])
    assert len(pyramid) - 1 > pyramid.place_level
    assert pyramid[-1].dual.n_faces > 0
    for level in pyramid[pyramid.place_level :]:
        graph: nx.Graph[int] = nx.Graph()
        graph.add_nodes_from(range(level.n_vertices))
        graph.add_edges_from(level.arcs.tolist())
        # Euler's formula: each connected part has an outer face, which is not counted without arcs.
        n_faces = level.dual.n_faces + nx.number_of_isolates(graph)
        n_parts = nx.number_connected_components(graph)
        assert level.n_vertices - level.n_arcs + n_faces == 2 * n_parts


def test_a_map_without_free_cells_has_no_levels_above():
    segments = segments_of(np.zeros((3, 3), dtype=bool), np.full((3, 3), -1))
    assert contract(segments, [Small(4)])[-1].n_vertices == 0
    assert (segments.label_of == -1).all()


def test_a_resistance_of_another_map_or_with_rooms_is_refused():
    grid = occupancy_grid(np.ones((3, 3), dtype=np.uint8))
    rooms = RoomLabels(("a",), np.zeros((3, 3), dtype=np.int32))

    def growth(side):
        label_of = np.zeros((side, side), dtype=np.int32)
        return Growth(segments_of(np.ones((side, side), dtype=bool), label_of), [Small(4)])

    with pytest.raises(hn.InvalidValueError, match=r"resistance was given .* not of"):
        hn.DualGraphPyramid.build(grid, resistance=growth(2))
    with pytest.raises(hn.InvalidValueError, match="resistance was given with rooms"):
        hn.DualGraphPyramid.build(grid, resistance=growth(3), rooms=rooms)


@pytest.mark.parametrize("n_segments", [300, 1000])
def test_many_segments_merge_in_few_levels(n_segments):
    free = np.ones((2, 3 * n_segments), dtype=bool)
    label_of = np.arange(3 * n_segments)[None].repeat(2, axis=0) // 3
    segments = segments_of(free, label_of)
    rising = Likely(lambda pairs, _: 0.5 + segments.state.endpoints[pairs].sum(axis=1) / 1e5, 0.5)
    pyramid = contract(segments, [rising, Small(4)])
    assert pyramid[-1].n_vertices == 1
    assert len(pyramid) < 100
