"""The pyramid against the oracle: every level of random maps, maps with known answers, blocks."""

import copy
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hybridnav.pyramid import DualGraphPyramid
from tests.oracle.blocks import blocks, in_pieces, piece_of
from tests.oracle.checks import (
    base_darts,
    check_attributes,
    check_base,
    check_cap,
    check_level,
    check_links,
    check_step,
    passes,
    protected_of,
    sigma_of,
)
from tests.oracle.pyramid import Base, Dart
from tests.oracle.reference import PlaneMap
from tests.oracle.throats import labels_of, parts_of
from tests.strategies import IS_FULL, MAX_SIDE, Scene, drawn, examples, occupancy_grid, scenes

LINKAGES = ("radius", "survivor", "diameter", "throats")
ORDINARY = settings(max_examples=examples(40, full=100), deadline=None)
ARRAYS = (
    "field_of",
    "cells",
    "classes",
    "areas",
    "arcs",
    "base_pairs",
    "sigma",
    "protected",
    "max_distance_m",
    "through_m",
)

each_linkage = pytest.mark.parametrize("linkage", LINKAGES)


def build(scene, linkage):
    return scene.pyramid(linkage)


def levels_of(pyramid):
    levels = [pyramid[index] for index in range(len(pyramid))]
    assert [level.index for level in levels] == list(range(len(levels)))
    return levels


def check_topology(levels, scene):
    base = Base.of(scene.classes)
    check_base(levels[0], base)
    for level in levels:
        check_level(level, base)


def check_merging(levels, scene, linkage):
    cap = {"limit_m": scene.merge_distance_m, "resolution_m": scene.resolution_m}
    for lower, upper in itertools.pairwise(levels):
        check_step(lower, upper)
        if linkage == "survivor":
            distance = scene.merge_distance_m / scene.resolution_m
            waiting = in_pieces(scene.classes, distance, lower.index)
            check_links(lower, upper, waiting, **cap)
    top, parts = levels[-1], None
    if linkage == "throats":
        linkage = "radius"
        parts = labels_of(scene.classes, scene.merge_distance_m / scene.resolution_m)
        parts = parts[tuple(top.cells.T)]
    if linkage != "survivor":
        for level in levels:
            check_cap(level, linkage=linkage, **cap)
    assert not passes(top, linkage=linkage, parts=parts, **cap).any()


def check_all_attributes(levels, scene):
    for level in levels:
        check_attributes(level, scene.classes, resolution_m=scene.resolution_m)


def check_replay(levels, scene):
    """Contract and remove, edge by edge, what each level lost: the same darts must be left."""
    plane = PlaneMap(scene.classes)
    for lower, upper in itertools.pairwise(levels):
        lost, choices = lost_edges(lower, upper)
        endpoints = (replayed(plane, kernel, lost) for kernel in itertools.product(*choices))
        fitting = [end for end in endpoints if end and end.sigma == sigma_of(upper)][:1]
        assert fitting, f"no kernels lead from level {lower.index} to the next"
        plane = fitting[0]
        assert {dart for dart, face in plane.face.items() if face not in plane.ordinary} == (
            protected_of(upper)
        )
        assert np.array_equal(plane.level().field_of, upper.field_of)


def lost_edges(lower, upper):
    """Edges that go, and for each merged vertex the darts that may have been contracted.

    There is nearly always one such dart: of two that go, one would be a self-loop that a rule
    removes at once, although no rule removed it while it was an arc.
    """
    parent = upper.field_of[lower.cells[:, 0], lower.cells[:, 1]]
    centre = lower.field_of[upper.cells[:, 0], upper.cells[:, 1]][parent]
    kept = set(base_darts(upper.base_pairs))
    kept |= {(head, tail) for tail, head in kept}
    lost: list[Dart] = []
    choices: dict[int, list[Dart]] = {}
    for (u, v), dart in zip(lower.arcs.tolist(), base_darts(lower.base_pairs), strict=True):
        if dart in kept:
            continue
        lost.append(dart)
        if u != v and centre[v] == u:
            choices.setdefault(v, []).append(dart)
        elif u != v and centre[u] == v:
            choices.setdefault(u, []).append(dart[::-1])
    return lost, list(choices.values())


def replayed(plane, kernel, lost):
    edges = {frozenset(dart) for dart in kernel}
    after = copy.deepcopy(plane)
    try:
        after.step(kernel, removed=[dart for dart in lost if frozenset(dart) not in edges])
    except ValueError:
        return None
    return after


@each_linkage
@given(scene=scenes())
@ORDINARY
def test_every_level_is_the_plane_map_of_its_fields(scene, linkage):
    check_topology(levels_of(build(scene, linkage)), scene)


@each_linkage
@given(scene=scenes())
@ORDINARY
def test_windows_are_stars_and_fields_keep_the_cap(scene, linkage):
    check_merging(levels_of(build(scene, linkage)), scene, linkage)


@each_linkage
@given(scene=scenes())
@ORDINARY
def test_attributes_of_arcs_are_the_brute_force_ones(scene, linkage):
    check_all_attributes(levels_of(build(scene, linkage)), scene)


@each_linkage
@given(scene=scenes(max_side=min(20 if IS_FULL else 16, MAX_SIDE)))
@ORDINARY
def test_levels_follow_from_the_rules_edge_by_edge(scene, linkage):
    check_replay(levels_of(build(scene, linkage)), scene)


@each_linkage
@given(scene=scenes())
@settings(ORDINARY, max_examples=examples(30))
def test_equal_seeds_give_equal_pyramids(scene, linkage):
    first, second = levels_of(build(scene, linkage)), levels_of(build(scene, linkage))
    assert len(first) == len(second)
    for level, again in zip(first, second, strict=True):
        for name in ARRAYS:
            one, other = getattr(level, name), getattr(again, name)
            assert one.dtype == other.dtype
            assert np.array_equal(one, other), name


def places_of(classes, *, merge_distance_m=100.0, linkage="radius"):
    scene = Scene(classes=classes, resolution_m=1.0, merge_distance_m=merge_distance_m, seed=0)
    levels = levels_of(build(scene, linkage))
    check_topology(levels, scene)
    check_merging(levels, scene, linkage)
    check_all_attributes(levels, scene)
    check_replay(levels, scene)
    return levels[-1]


@each_linkage
@pytest.mark.parametrize(
    ("lines", "places", "arcs", "loops"),
    [
        pytest.param(["......", "..??..", "..??..", "......"], 2, 1, 1, id="island"),
        pytest.param([".....", ".??#.", "....."], 2, 1, 1, id="island that touches an obstacle"),
        pytest.param(["....", ".??.", "#...", "...."], 2, 1, 0, id="island cornered at the rim"),
        pytest.param(["..??", "..#?", "..??"], 2, 2, 0, id="two doors"),
        pytest.param(["....", ".#..", "...."], 1, 0, 1, id="pillar"),
        pytest.param([".....", ".#.#.", "....."], 1, 0, 2, id="two pillars"),
        pytest.param(["?????", "?...?", "?.?.?", "?...?", "?????"], 3, 2, 2, id="ring in a ring"),
        pytest.param([".....", ".###.", ".#.#.", ".###.", "....."], 2, 0, 1, id="cell walled in"),
        pytest.param(["..#??", "..#??"], 2, 0, 0, id="two rooms without a door"),
        pytest.param(["..?", ".??", "?#?"], 3, 2, 0, id="staircase"),
        pytest.param(["."], 1, 0, 0, id="one cell"),
        pytest.param(["#"], 0, 0, 0, id="one obstacle"),
        pytest.param(["........"], 1, 0, 0, id="one row"),
        pytest.param(["."] * 8, 1, 0, 0, id="one column"),
        pytest.param(["..?..#.."], 4, 2, 0, id="one row of all classes"),
        pytest.param([".?.", "?.?", ".?."], 9, 12, 0, id="checkerboard"),
    ],
)
def test_places_of_small_maps(lines, places, arcs, loops, linkage):
    top = places_of(drawn(*lines), linkage=linkage)
    n_loops = int((top.arcs[:, 0] == top.arcs[:, 1]).sum())
    assert (top.n_vertices, top.n_arcs - n_loops, n_loops) == (places, arcs, loops)


def test_an_island_and_what_surrounds_it():
    top = places_of(drawn("......", "..??..", "..??..", "......"))
    loop, arc = np.argsort(top.arcs[:, 0] != top.arcs[:, 1])
    free = int(np.flatnonzero(top.classes == 1)[0])
    assert top.arcs[loop].tolist() == [free, free]
    assert sorted(top.arcs[arc].tolist()) == [0, 1]
    assert len(top.boundary(arc)) == 8
    assert top.areas[free] == 20
    # From one corner of the map to the other, and from a corner to the island's far corner.
    assert top.max_distance_m[loop] == pytest.approx(np.hypot(3, 5))
    assert top.max_distance_m[arc] == pytest.approx(np.hypot(2, 3))
    # The loop goes round the island: the face on one of its sides is the protected outside.
    assert sorted(top.protected[2 * loop : 2 * loop + 2].tolist()) == [False, True]


def test_two_doors_are_two_arcs_with_their_own_boundaries():
    top = places_of(drawn("..#??", "...??", "..#??", "...??", "..#??"))
    assert (top.n_vertices, top.n_arcs) == (2, 2)
    doors = {frozenset(base_darts(np.sort(top.boundary(arc), axis=1))) for arc in range(2)}
    assert doors == {frozenset([((row, 2), (row, 3))]) for row in (1, 3)}
    assert top.max_distance_m.tolist() == pytest.approx([np.hypot(4, 4)] * 2)


@pytest.mark.parametrize(("resolution_m", "distance_m"), [(1.0, 3.0), (0.1, 0.1 + 0.2)])
def test_cells_as_far_apart_as_the_merge_distance_do_not_merge(resolution_m, distance_m):
    grid = occupancy_grid(drawn("....."), resolution_m=resolution_m)
    top = DualGraphPyramid.build(grid, merge_distance_m=distance_m)[-1]
    cols = np.arange(5)
    assert (np.abs(cols - top.cells[top.field_of[0], 1]) < 3).all()


def test_nothing_merges_below_the_size_of_a_cell():
    grid = occupancy_grid(drawn("..", ".."), resolution_m=0.1)
    pyramid = DualGraphPyramid.build(grid, merge_distance_m=0.1)
    assert len(pyramid) == 1
    assert pyramid[-1].n_vertices == 4


DISTANCES = settings(max_examples=examples(30), deadline=None, derandomize=True)


@st.composite
def open_scenes(draw):
    shape = tuple(draw(st.integers(2, max(2, MAX_SIDE))) for _ in range(2))
    classes = np.full(shape, draw(st.sampled_from([1, 2])), dtype=np.uint8)
    for _ in range(draw(st.integers(0, 4))):
        row, col = (draw(st.integers(0, side - 1)) for side in shape)
        height, width = draw(st.integers(1, 5)), draw(st.integers(1, 5))
        classes[row : row + height, col : col + width] = draw(st.sampled_from([0, 0, 1, 2]))
    distance = draw(st.sampled_from([3.9, 4.0, 7.0, 8.0, 12.0, 16.0, 40.0, np.inf]))
    return Scene(classes, 1.0, distance, draw(st.integers(0, 3)))


def check_blocks(scene, linkage):
    pyramid = scene.pyramid(linkage)
    distance = scene.merge_distance_m / scene.resolution_m
    kinds = scene.classes
    if linkage == "throats":  # blocks lie in one fine part
        kinds = np.where(kinds == 0, 0, 3 * (parts_of(kinds, distance)[0] + 1) + kinds)
    for block in blocks(kinds, distance):
        assert len(pyramid) > block.whole_at
        for level in range(block.whole_at + 1):
            field_of = pyramid[level].field_of
            fields = field_of[block.window]
            pairs = np.unique(np.stack([fields, piece_of(block, level)]).reshape(2, -1), axis=1)
            pieces = block.side**2 >> level
            assert pairs.shape[1] == len(np.unique(pairs[0])) == pieces
            assert np.isin(field_of, fields).sum() == block.side**2
        row, col = pyramid[block.whole_at].cells[fields[0, 0]] - block[:2]
        far = max(row, block.side - 1 - row), max(col, block.side - 1 - col)
        assert max(far) <= block.side * 5 // 8


@pytest.mark.parametrize("linkage", LINKAGES)
@given(scene=st.one_of(open_scenes(), scenes()))
@DISTANCES
def test_blocks_merge_by_halves_and_with_nothing_else_until_they_are_whole(scene, linkage):
    check_blocks(scene, linkage)


@pytest.mark.parametrize("linkage", LINKAGES)
@given(scene=open_scenes())
@DISTANCES
def test_levels_of_open_ground_are_plane_maps(scene, linkage):
    pyramid = scene.pyramid(linkage)
    base = Base.of(scene.classes)
    for level in range(len(pyramid)):
        check_level(pyramid[level], base)


def test_the_sizes_in_the_statistics_are_those_of_the_levels():
    rng = np.random.default_rng(5)
    classes = np.ones((MAX_SIDE, MAX_SIDE + 3), dtype=np.uint8)
    classes[rng.random(classes.shape) < 0.01] = 0
    pyramid = DualGraphPyramid.build(occupancy_grid(classes), merge_distance_m=18.0)
    assert len(pyramid.stats.sizes) == len(pyramid)
    for index, size in enumerate(pyramid.stats.sizes):
        level = pyramid[index]
        loops = int((level.arcs[:, 0] == level.arcs[:, 1]).sum())
        assert (size.vertices, size.arcs, size.self_loops) == (
            level.n_vertices,
            level.n_arcs,
            loops,
        )


def test_the_definition_finds_blocks_of_every_size():
    classes = np.ones((32, 32), dtype=np.uint8)
    assert {block.side for block in blocks(classes, 16.0)} == {2, 4, 8}
    assert {block.side for block in blocks(classes, 15.9)} == {2, 4}
    assert {block.side for block in blocks(classes, 4.0)} == {2}
    assert not blocks(classes, 3.9)
    assert in_pieces(classes, 16.0, 5).sum() == 4 * 64
    assert not in_pieces(classes, 16.0, 6).any()
