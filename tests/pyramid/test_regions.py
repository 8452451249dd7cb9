"""Levels above the places: regions by the expansion rating, and on to the apex."""

import copy
import itertools
import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

import hybridnav as hn
from hybridnav.pyramid import Level
from hybridnav.pyramid.islands import LazyIslands
from hybridnav.pyramid.start import kinds_of
from tests.oracle.checks import check_attributes, check_level, check_step
from tests.oracle.pyramid import Base, boundaries
from tests.strategies import MAX_SIDE, Scene, drawn, examples, labelled, occupancy_grid, scenes

SOME = settings(max_examples=examples(40), deadline=None, derandomize=True)
LINKAGES = ("radius", "survivor", "diameter")
TWO_ROOMS = drawn(
    "###############",
    "#......#......#",
    "#......#......#",
    "#.............#",
    "#......#......#",
    "#......#......#",
    "###############",
)


@st.composite
def grown(draw: st.DrawFn, max_side: int = MAX_SIDE) -> tuple[Scene, hn.DualGraphPyramid]:
    scene = draw(scenes(max_side))
    pyramid = scene.pyramid(draw(st.sampled_from(LINKAGES)))
    return scene, pyramid.with_regions(draw(st.sampled_from([1, 4, 9, 30, 100, 10**6])))


def above(pyramid: hn.DualGraphPyramid) -> list[Level]:
    return [pyramid[index] for index in range(pyramid.place_level, len(pyramid))]


def mergeable(level: Level, most_cells: float = np.inf) -> Any:
    same = level.classes[level.arcs[:, 0]] == level.classes[level.arcs[:, 1]]
    small = level.areas[level.arcs].sum(axis=1) <= most_cells
    return np.flatnonzero(same & small & ~level.is_self_loop)


def ratings_of(level: Level, arcs: Any) -> Any:
    """The definition: all cracks between two fields, counted on the cells, and their areas."""
    field = level.field_of
    ratings = []
    for u, v in level.arcs[arcs].tolist():
        pairs = [(field[:-1], field[1:]), (field[:, :-1], field[:, 1:])]
        cracks = sum(int((((a == u) & (b == v)) | ((a == v) & (b == u))).sum()) for a, b in pairs)
        ratings.append(cracks**2 / (int((field == u).sum()) * int((field == v).sum())))
    return np.array(ratings)


def parts_of(cells: Any) -> int:
    return sum(int(ndimage.label(cells == kind)[1]) for kind in (1, 2))


@given(made=grown(max_side=min(MAX_SIDE, 24)))
@SOME
def test_every_level_above_the_places_is_the_plane_map_of_its_fields(made):
    scene, pyramid = made
    base = Base.of(scene.classes)
    for level in above(pyramid):
        check_level(level, base)
        check_attributes(level, scene.classes, resolution_m=scene.resolution_m)
    for lower, upper in itertools.pairwise(above(pyramid)):
        check_step(lower, upper)
        kernels = pyramid.contraction_kernel(lower.index), pyramid.removal_kernel(lower.index)
        assert upper.n_arcs == lower.n_arcs - sum(map(len, kernels))


@given(made=grown(max_side=min(MAX_SIDE, 24)))
@SOME
def test_the_length_of_a_boundary_is_the_number_of_its_cracks(made):
    for level in above(made[1]):
        assert level.n_cracks.tolist() == [len(level.boundary(arc)) for arc in range(level.n_arcs)]
        between = int(level.n_cracks[~level.is_self_loop].sum())
        assert 2 * between == len(boundaries(level.field_of).label_of)
        with pytest.raises(ValueError, match="read-only"):
            level.n_cracks[:] = 0


@given(made=grown())
@SOME
def test_up_to_the_places_the_levels_are_those_of_the_pyramid_below(made):
    scene, pyramid = made
    plain = scene.pyramid(pyramid.linkage)
    assert pyramid.place_level == plain.place_level
    for level in plain:
        same = pyramid[level.index]
        for name in ("field_of", "cells", "base_pairs", "sigma", "protected"):
            np.testing.assert_array_equal(getattr(same, name), getattr(level, name))
    assert pyramid.stats.sizes[: len(plain)] == plain.stats.sizes


@given(scene=scenes(), linkage=st.sampled_from(LINKAGES))
@SOME
def test_the_darts_of_the_places_are_those_that_the_record_describes(scene, linkage):
    pyramid = scene.pyramid(linkage)
    made, level = pyramid[-1].darts, pyramid[-1]
    again = type(level)(level.grid, pyramid.record, level.index, LazyIslands(level.grid)).darts
    for name in ("sigma", "origin", "protected", "base_edge"):
        one, other = getattr(made, name), getattr(again, name)
        np.testing.assert_array_equal(one, other)
        assert (one.dtype, one.flags.writeable) == (other.dtype, other.flags.writeable)
    assert made.n_vertices == again.n_vertices


@given(made=grown())
@SOME
def test_regions_keep_their_size_and_could_not_grow(made):
    pyramid = made[1]
    most, places, regions = pyramid.region_cells, above(pyramid)[0], pyramid[pyramid.region_level]
    assert most is not None
    sons = np.bincount(regions.field_of[tuple(places.cells.T)], minlength=regions.n_vertices)
    assert (regions.areas[sons > 1] <= most).all()
    assert not len(mergeable(regions, most))


@given(made=grown())
@SOME
def test_the_apex_has_one_vertex_for_each_connected_set_of_a_class(made):
    scene, pyramid = made
    assert pyramid[-1].n_vertices == parts_of(scene.classes)
    assert not len(mergeable(pyramid[-1]))


@given(made=grown(max_side=min(MAX_SIDE, 16)))
@SOME
def test_no_arc_is_contracted_beside_one_rated_more_than_twice_as_high(made):
    pyramid = made[1]
    for level in above(pyramid)[:-1]:
        most = pyramid.region_cells if level.index < pyramid.region_level else np.inf
        arcs = mergeable(level, most or np.inf)
        rating = dict(zip(arcs.tolist(), ratings_of(level, arcs).tolist(), strict=True))
        kernel = pyramid.contraction_kernel(level.index).tolist()
        assert kernel
        for arc in kernel:
            beside = (level.arcs[arcs][:, :, None] == level.arcs[arc]).any(axis=(1, 2))
            best = max(rating[other] for other in arcs[beside].tolist())
            assert 2 * rating[arc] >= best * (1 - 1e-12)


@given(scene=labelled(), distance_m=st.sampled_from([1.5, 4.0]))
@SOME
def test_with_rooms_regions_lie_inside_rooms_and_the_rooms_come_above_them(scene, distance_m):
    classes, rooms = scene
    labels = rooms.label_of
    grid = occupancy_grid(classes)
    plain = hn.DualGraphPyramid.build(grid, merge_distance_m=distance_m, rooms=rooms)
    pyramid = plain.with_regions(12)
    for level in above(pyramid):
        check_level(level, Base.of(classes))
    regions, floor = pyramid[pyramid.region_level], pyramid[pyramid.room_level]
    inside = regions.field_of >= 0
    pairs = np.unique(np.stack([regions.field_of[inside], labels[inside]]), axis=1)
    assert pairs.shape[1] == regions.n_vertices
    assert same_partition(floor.field_of, plain[plain.room_level].field_of)
    assert pyramid.place_level <= pyramid.region_level <= pyramid.room_level < len(pyramid)
    assert pyramid[-1].n_vertices == parts_of(classes)


def same_partition(one: Any, other: Any) -> bool:
    n_pairs = int(np.unique(np.stack([one.ravel(), other.ravel()]), axis=1).shape[1])
    return n_pairs == len(np.unique(one)) == len(np.unique(other))


def test_regions_meet_at_the_door() -> None:
    grid = occupancy_grid(TWO_ROOMS)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=2.0).with_regions(40)
    regions = pyramid[pyramid.region_level]
    assert regions.n_cracks.tolist() == [1]
    assert regions.field_of[1, 1] == regions.field_of[5, 6] != regions.field_of[1, 8]
    assert pyramid[-1].n_vertices == 1


def test_a_pyramid_has_regions_only_when_asked_and_shares_the_levels_below() -> None:
    pyramid = hn.DualGraphPyramid.build(occupancy_grid(TWO_ROOMS), merge_distance_m=2.5)
    with pytest.raises(hn.errors.InvalidValueError, match=r"no regions: use pyramid\.with_regions"):
        _ = pyramid.region_level
    larger = pyramid.with_regions(40)
    assert len(larger) > len(pyramid) == pyramid.place_level + 1
    assert larger[larger.place_level] is pyramid[-1]
    assert larger.islands is pyramid.islands
    assert larger.with_regions(40) is larger
    assert larger.with_regions(20).stats.tops == pyramid.with_regions(20).stats.tops
    topology = hn.TopologicalMap(larger)
    assert topology.level is hn.TopologicalMap(pyramid).level


@pytest.mark.parametrize("most_cells", [0, -3, 2.0, True, None, "12"])
def test_a_size_that_is_no_number_of_cells_is_refused(most_cells: Any) -> None:
    pyramid = hn.DualGraphPyramid.build(occupancy_grid(TWO_ROOMS))
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"regions have at most .*, expected a whole"
    ):
        pyramid.with_regions(most_cells)


def test_cells_of_many_regions_have_kinds_of_their_own() -> None:
    classes = np.tile(np.array([1, 2], np.uint8), (2, 40_000))
    labels = np.tile(np.repeat(np.arange(40_000, dtype=np.int32), 2), (2, 1))
    kinds = kinds_of(classes, labels)
    assert len(np.unique(kinds)) == 80_000
    assert ((kinds - 1) % 2 + 1 == classes).all()


@given(scene=scenes(), most_cells=st.sampled_from([9, 100]))
@SOME
def test_equal_seeds_make_equal_regions(scene: Scene, most_cells: int) -> None:
    one, other = (scene.pyramid("radius").with_regions(most_cells) for _ in range(2))
    assert one.stats.sizes == other.stats.sizes
    for level, again in zip(one, other, strict=True):
        np.testing.assert_array_equal(level.field_of, again.field_of)
        np.testing.assert_array_equal(level.base_pairs, again.base_pairs)


def test_copies_have_the_same_levels() -> None:
    grid = occupancy_grid(TWO_ROOMS)
    larger = hn.DualGraphPyramid.build(grid, merge_distance_m=2.5).with_regions(40)
    pickled = pickle.loads(pickle.dumps(larger))  # noqa: S301 - our own
    for again in (pickled, copy.deepcopy(larger)):
        assert again.region_level == larger.region_level
        for level, other in zip(larger, again, strict=True):
            np.testing.assert_array_equal(level.field_of, other.field_of)


def test_a_model_holds_a_pyramid_with_regions(tmp_path: Any) -> None:
    grid = occupancy_grid(TWO_ROOMS)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=2.5).with_regions(40)
    planner = hn.HybridPlanner(hn.TopologicalMap(pyramid), preset="octile")
    hn.save(planner, tmp_path / "rooms.hnm")
    topology = hn.load(tmp_path / "rooms.hnm").topology
    again = topology.pyramid
    assert topology.level.index == again.place_level == pyramid.place_level
    assert again.region_cells == 40
    assert again.with_regions(40) is again
    for one, other in ((pyramid, again), (pyramid.with_regions(20), again.with_regions(20))):
        for level, same in zip(one, other, strict=True):
            np.testing.assert_array_equal(level.field_of, same.field_of)
            np.testing.assert_array_equal(level.sigma, same.sigma)
            np.testing.assert_array_equal(level.protected, same.protected)
