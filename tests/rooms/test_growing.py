"""Rooms that grow out of segments: closing, the judge of boundaries, levels like all others."""

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.maps import CellClass, RoomLabels
from hybridnav.rooms.cutting import Ground, Kind, closed_by_disc, fine_segments, wall_directions
from hybridnav.rooms.merging import EVIDENCE, Forest, JudgedSegments, Likely, Small, merge
from tests.rooms.growth import Growth, contract
from tests.rooms.test_find_rooms import floor
from tests.strategies import MAX_SIDE, class_grids, occupancy_grid, seeds


@st.composite
def cut(draw):
    classes = draw(class_grids(min(MAX_SIDE, 16)))
    rng = np.random.default_rng(draw(seeds))
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


@pytest.mark.parametrize("merged", [merge, contract])
@given(scene=cut())
def test_segments_that_are_left_apart_resist(merged, scene):
    free, label_of = scene
    segments = segments_of(free, label_of)
    merged(segments, [Likely(by_sizes(segments), 0.4)])
    sizes = dict(zip(*np.unique(segments.label_of, return_counts=True), strict=True))
    for pair in neighbours(segments.label_of):
        assert 1 / (1 + sum(sizes[label] for label in pair) / 20) < 0.4


@pytest.mark.parametrize("merged", [merge, contract])
@given(scene=cut())
def test_no_small_segment_is_left_beside_another(merged, scene):
    free, label_of = scene
    segments = segments_of(free, label_of)
    merged(segments, [Small(12)])
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

    merge(segments, [Likely(judge, 0.5)])
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

    with pytest.raises(hn.errors.InvalidValueError, match=r"resistance was given .* not of"):
        hn.DualGraphPyramid.build(grid, resistance=growth(2))
    with pytest.raises(hn.errors.InvalidValueError, match="resistance was given with rooms"):
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


def ground_of(free, resolution_m=0.1):
    return Ground.of(np.where(free, np.uint8(Kind.INSIDE), np.uint8(Kind.WALL)), resolution_m)


def segments_of(free, label_of):
    dense = np.unique(np.append(label_of, -1), return_inverse=True)[1][:-1] - 1
    return JudgedSegments(dense.reshape(free.shape).astype(np.int32), ground_of(free))


def evidence_of(free, label_of):
    """The evidence on the one boundary of two segments, by name."""
    (row,) = segments_of(free, label_of).evidence(np.array([0]))
    return dict(zip(EVIDENCE, row.tolist(), strict=True))


def two_rooms():
    """Rooms of 4 m x 4 m with a door of 1 m in the wall between."""
    free = np.zeros((44, 86), dtype=bool)
    free[2:42, 2:42] = free[2:42, 44:84] = free[17:27, 42:44] = True
    label_of = np.where(free, 0, -1)
    label_of[:, 43:][free[:, 43:]] = 1
    return free, label_of


def corridor():
    """A corridor of 2 m x 16 m, and segments that meet in its middle."""
    free = np.zeros((24, 164), dtype=bool)
    free[2:22, 2:162] = True
    label_of = np.where(free, 0, -1)
    label_of[:, 82:][free[:, 82:]] = 1
    return free, label_of


def test_a_door_has_jambs_and_a_cut_through_a_corridor_has_walls_that_run_on():
    door, cut = evidence_of(*two_rooms()), evidence_of(*corridor())
    assert door["open_m"] == pytest.approx(1.0)
    assert door["jamb_low"] > 0.6
    assert cut["jamb_low"] < 0.2
    assert cut["open_m"] == pytest.approx(2.0)
    assert cut["flush_low"] > 0.9
    assert door["flush_low"] < 0.3
    assert cut["solid_both"] == pytest.approx(1.0, abs=0.02)
    assert cut["open_of_small_breadth"] > 0.9
    assert door["open_of_small_breadth"] < 0.5


def test_the_shipped_judge_keeps_a_door_and_joins_a_corridor():
    forest = Forest.shipped()
    for (free, label_of), n_rooms in ((two_rooms(), 2), (corridor(), 1)):
        segments = segments_of(free, label_of)
        merge(segments, [Likely(forest.judge, 0.5)])
        assert len(np.unique(segments.label_of[free])) == n_rooms


@given(seed=seeds)
def test_a_forest_adds_the_leaves_that_its_thresholds_lead_to(seed):
    rng = np.random.default_rng(seed)
    forest = Forest(
        rng.integers(0, 4, (5, 3)), rng.normal(size=(5, 3)), rng.normal(size=(5, 4)), 0.3
    )
    evidence = rng.normal(size=(6, 4))
    found = forest.judge(np.arange(6), evidence)
    for row, likely in zip(evidence, found, strict=True):
        odds = 0.3
        for features, thresholds, leaves in zip(
            forest.features, forest.thresholds, forest.leaves, strict=True
        ):
            low = int(row[features[0]] > thresholds[0])
            side = 1 + low
            odds += leaves[2 * low + int(row[features[side]] > thresholds[side])]
        assert likely == pytest.approx(1 / (1 + np.exp(-odds)))


@given(classes=class_grids(), seed=seeds)
def test_merged_segments_have_the_evidence_of_segments_that_were_never_apart(classes, seed):
    rng = np.random.default_rng(seed)
    free = classes == hn.CellClass.FREE
    label_of = np.where(free, rng.integers(0, 4, free.shape), -1)
    if not free.any():
        return
    segments = segments_of(free, label_of)
    merge(segments, [Likely(lambda pairs, _: rng.random(len(pairs)), 0.7)])
    again = segments_of(free, segments.label_of)
    state, fresh = segments.state, again.state
    kept = np.flatnonzero(state.versions >= 0)
    for name in ("free", "moments", "rims", "peaks", "opened", "hull_areas", "degrees"):
        assert getattr(fresh, name) == pytest.approx(getattr(state, name)[kept]), name
    alive = np.flatnonzero((state.endpoints[:, 0] >= 0) & (state.open_sides > 0))
    order = np.argsort(
        np.sort(np.searchsorted(kept, state.endpoints[alive]), axis=1) @ [len(kept), 1]
    )
    before = segments.evidence(alive[order])
    after = again.evidence(np.flatnonzero(fresh.open_sides > 0))
    sizes = np.sort(state.free[state.endpoints[alive[order]]], axis=1)
    differ = sizes[:, 0] != sizes[:, 1]  # else either may count as the smaller
    assert after[differ] == pytest.approx(before[differ])


def test_small_segments_go_to_the_neighbour_with_the_longest_open_border():
    free, label_of = corridor()
    label_of[2:22, 80:83] = 2
    label_of[2:8, 80] = 0  # a step makes its border there longer
    segments = segments_of(free, label_of)
    merge(segments, [Small(100)])
    merged = segments.label_of
    assert merged[12, 81] == merged[12, 40] != merged[12, 120]


def test_walls_are_found_in_every_direction_of_a_turned_wing():
    straight, _ = floor()
    turned, _ = floor(0.3)
    sides = [grid.measured == hn.CellClass.OCCUPIED for grid in (straight, turned)]
    rims = [ground_of(~occupied).wall for occupied in sides]
    wide = np.zeros((700, 200), dtype=bool)
    wide[: rims[0].shape[0], : rims[0].shape[1]] = rims[0]
    wide[-rims[1].shape[0] :, : rims[1].shape[1]] = rims[1]
    found = sorted(angle for angle, _ in wall_directions(wide, 0.1))
    assert found == pytest.approx([0.0, 0.3], abs=0.01)


def test_a_bay_of_8_m_is_cut_from_its_corridor():
    free = np.zeros((104, 304), dtype=bool)
    free[2:22, 2:302] = True
    free[22:102, 102:182] = True
    found = fine_segments(ground_of(free))
    bay, hall = np.unique(found[30:100, 105:180]), np.unique(found[3:20, 5:300])
    assert not set(bay.tolist()) & set(hall.tolist())


@pytest.mark.parametrize("seed", range(30))
def test_a_closing_by_distances_is_that_by_a_disc(seed):
    rng = np.random.default_rng(seed)
    free = rng.random(rng.integers(1, 40, 2)) < rng.random()
    occupied = (rng.random(free.shape) < 0.1) & ~free
    reach = rng.uniform(0, 8)
    size = max(1, round(reach))
    row, col = np.ogrid[-size : size + 1, -size : size + 1]
    disc = row * row + col * col <= size * size + 1
    wide = ndimage.binary_closing(np.pad(free, size + 1), disc)
    expected = wide[size + 1 : -size - 1, size + 1 : -size - 1] & ~occupied
    assert (closed_by_disc(free, occupied, reach) == expected).all()
