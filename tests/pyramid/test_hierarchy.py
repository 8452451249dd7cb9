"""Ways up and down the pyramid, and the kernels between levels, against the receptive fields."""

import gc
import itertools
import os
import weakref
from collections import Counter
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from numba.core.registry import CPUDispatcher

import hybridnav as hn
from hybridnav.errors import HybridNavError, InvalidValueError
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.pyramid.kernels import base as _base_kernels
from hybridnav.pyramid.kernels.fields import level_sizes
from tests.oracle.checks import base_darts, protected_of, sigma_of
from tests.oracle.inclusion import nested_scenes
from tests.oracle.reference import PlaneMap
from tests.strategies import IS_FULL, MAX_SIDE, drawn, examples, occupancy_grid, seeds

LINKAGES = ("radius", "survivor", "diameter")
SIDE = min(24 if IS_FULL else 20, MAX_SIDE)
ORDINARY = settings(max_examples=examples(60, full=300), deadline=None)

each_linkage = pytest.mark.parametrize("linkage", LINKAGES)


def built(scene, linkage):
    return scene.pyramid(linkage)


def sons_of(lower, upper):
    inside = lower.field_of >= 0
    pairs = set(zip(upper.field_of[inside].tolist(), lower.field_of[inside].tolist(), strict=True))
    sons: list[list[int]] = [[] for _ in range(upper.n_vertices)]
    for above, below in sorted(pairs):
        sons[above].append(below)
    assert sum(map(len, sons)) == lower.n_vertices, "a field is split between two above it"
    return sons


def check_fields(pyramid):
    for level in pyramid:
        for vertex in range(level.n_vertices):
            cells = level.receptive_field(vertex)
            assert cells.dtype == np.int64
            assert cells.tolist() == np.argwhere(level.field_of == vertex).tolist()
            assert len(cells) == level.areas[vertex]


def check_ways(pyramid):
    for low, high in itertools.combinations_with_replacement(range(len(pyramid)), 2):
        sons = sons_of(pyramid[low], pyramid[high])
        above = np.empty(pyramid[low].n_vertices, dtype=np.int32)
        for vertex, below in enumerate(sons):
            above[below] = vertex
            found = pyramid.descendants(vertex, level=high, to=low)
            assert found.dtype == np.int64
            assert found.tolist() == below
            if high == low + 1:
                assert pyramid.children(high, vertex).tolist() == below
        found = pyramid.ancestor(np.arange(len(above)), level=low, to=high)
        assert found.dtype == np.int32
        assert found.tolist() == above.tolist()
        if high == low + 1:
            assert pyramid.parent(low).dtype == np.int32
            assert pyramid.parent(low).tolist() == above.tolist()


def check_kernels(pyramid):
    for lower, upper in itertools.pairwise(pyramid):
        contracted = pyramid.contraction_kernel(lower.index)
        removed = pyramid.removal_kernel(lower.index)
        for kernel in (contracted, removed):
            assert kernel.dtype == np.int64
        edges = [frozenset(dart) for dart in base_darts(lower.base_pairs)]
        kept = [frozenset(dart) for dart in base_darts(upper.base_pairs)]
        gone = [edges[arc] for arc in [*contracted.tolist(), *removed.tolist()]]
        assert Counter(gone + kept) == Counter(edges)
        centre = lower.field_of[tuple(upper.cells.T)]
        leaves = []
        for u, v in lower.arcs[contracted].tolist():
            assert lower.classes[u] == lower.classes[v]
            above = pyramid.ancestor([u, v], level=lower.index, to=upper.index)
            assert above[0] == above[1]
            leaves.append(u if v == centre[above[0]] else v)
            assert {u, v} == {leaves[-1], int(centre[above[0]])}
        # Every vertex is the centre of its window or joined to the centre by one contracted arc.
        assert sorted([*leaves, *centre.tolist()]) == list(range(lower.n_vertices))


def check_replay(pyramid, classes):
    plane = PlaneMap(classes)
    for lower, upper in itertools.pairwise(pyramid):
        darts = base_darts(lower.base_pairs)
        survivors = set(map(tuple, upper.cells.tolist()))
        kernel = []
        for arc in pyramid.contraction_kernel(lower.index).tolist():
            survives = tuple(lower.cells[lower.arcs[arc, 0]].tolist()) in survivors
            kernel.append(darts[arc] if survives else darts[arc][::-1])
        plane.step(kernel, removed=[darts[arc] for arc in pyramid.removal_kernel(lower.index)])
        assert plane.level().field_of.tolist() == upper.field_of.tolist()
        assert sigma_of(plane.level()) == sigma_of(upper)
        assert protected_of(plane.level()) == protected_of(upper)


@each_linkage
@given(scene=nested_scenes(SIDE))
@ORDINARY
def test_fields_and_the_ways_between_levels_are_those_of_the_cells(scene, linkage):
    pyramid = built(scene, linkage)
    check_fields(pyramid)
    check_ways(pyramid)


@each_linkage
@given(scene=nested_scenes(SIDE))
@ORDINARY
def test_kernels_are_stars_and_with_what_survives_all_arcs(scene, linkage):
    check_kernels(built(scene, linkage))


@each_linkage
@given(scene=nested_scenes(SIDE if IS_FULL else min(14, SIDE)))
@settings(ORDINARY, max_examples=examples(40, full=300))
def test_kernels_applied_edge_by_edge_give_every_level(scene, linkage):
    check_replay(built(scene, linkage), scene.classes)


@given(scene=nested_scenes(min(14, SIDE)), seed=seeds)
@settings(ORDINARY, max_examples=examples(30))
def test_levels_do_not_depend_on_the_order_they_are_asked_for(scene, seed):
    pyramid, other = built(scene, "radius"), built(scene, "radius")
    rng = np.random.default_rng(seed)
    for index in rng.permutation(len(pyramid)).tolist():
        level = other[index]
        kinds = level.dual.kinds.tolist()
        assert (level.sigma == pyramid[index].sigma).all()
        assert kinds == pyramid[index].dual.kinds.tolist()


def small_pyramid():
    return DualGraphPyramid.build(
        occupancy_grid(drawn("....??", "....??", "..#...", "......")), merge_distance_m=80.0
    )


def test_ancestors_keep_the_shape_of_what_is_asked():
    pyramid = small_pyramid()
    base, top = pyramid[0], pyramid[-1]
    table = np.arange(base.n_vertices - 1).reshape(2, -1)
    assert pyramid.ancestor(table, level=0, to=-1).shape == table.shape
    assert pyramid.ancestor(3, level=0, to=-1).shape == ()
    assert pyramid.ancestor([], level=0, to=-1).shape == (0,)
    endpoints = pyramid.ancestor(base.arcs, level=0, to=-1)
    assert endpoints.tolist() == top.field_of[tuple(np.moveaxis(base.base_pairs, -1, 0))].tolist()


def test_levels_count_from_the_apex_too():
    pyramid = small_pyramid()
    top = len(pyramid) - 1
    assert pyramid.parent(-2).tolist() == pyramid.parent(top - 1).tolist()
    assert pyramid.children(-1, 0).tolist() == pyramid.children(top, 0).tolist()
    assert pyramid.contraction_kernel(-2).tolist() == pyramid.contraction_kernel(top - 1).tolist()
    assert (
        pyramid.descendants(0, level=-1, to=-2).tolist()
        == pyramid.descendants(0, level=top, to=top - 1).tolist()
    )


def test_every_level_is_its_own_ancestor():
    pyramid = small_pyramid()
    for level in pyramid:
        vertices = np.arange(level.n_vertices)
        same = pyramid.ancestor(vertices, level=level.index, to=level.index)
        assert same.tolist() == vertices.tolist()


@pytest.mark.parametrize("vertex", [-1, 99])
def test_a_vertex_that_is_not_there_has_no_kin(vertex):
    pyramid = small_pyramid()
    with pytest.raises(InvalidValueError, match="vert"):
        pyramid[-1].receptive_field(vertex)
    with pytest.raises(InvalidValueError, match="vert"):
        pyramid.ancestor([vertex], level=0, to=-1)
    with pytest.raises(InvalidValueError, match="vert"):
        pyramid.descendants(vertex, level=-1, to=0)
    with pytest.raises(InvalidValueError, match="vert"):
        pyramid.children(-1, vertex)


def test_vertices_are_whole_numbers():
    with pytest.raises(InvalidValueError, match="vert"):
        small_pyramid().ancestor([0.5], level=0, to=-1)


def test_up_is_not_down():
    pyramid = small_pyramid()
    with pytest.raises(InvalidValueError, match="other way"):
        pyramid.ancestor([0], level=1, to=0)
    with pytest.raises(InvalidValueError, match="other way"):
        pyramid.descendants(0, level=0, to=1)


@pytest.mark.parametrize("lines", [["..", ".."], ["."], ["#"]])
def test_nothing_lies_below_the_base_or_above_the_apex(lines):
    pyramid = DualGraphPyramid.build(occupancy_grid(drawn(*lines)), merge_distance_m=0.5)
    assert len(pyramid) == 1
    for ask in (
        lambda: pyramid.children(0, 0),
        lambda: pyramid.parent(0),
        lambda: pyramid.parent(-1),
        lambda: pyramid.contraction_kernel(0),
        lambda: pyramid.removal_kernel(-1),
    ):
        with pytest.raises((HybridNavError, IndexError), match=r"level|apex|base"):
            ask()


def test_below_the_base_of_a_tall_pyramid_is_nothing_either():
    with pytest.raises((HybridNavError, IndexError), match=r"base|below level 0|levels 0 to"):
        small_pyramid().children(0, 0)


def test_a_pyramid_that_nothing_uses_is_gone_without_a_collection_of_garbage() -> None:
    topology = hn.TopologicalMap(
        hn.DualGraphPyramid.build(hn.example_map("figure1"), merge_distance_m=1.0).with_regions(300)
    )
    topology.inclusion.face_of_obstacle  # noqa: B018 - finds the islands
    for level in topology.pyramid:
        assert len(level.dual.kinds)  # outer faces are found from islands too
    gone: list[Callable[[], object]] = [
        weakref.ref(topology.pyramid),
        *(weakref.ref(level) for level in topology.pyramid),
    ]
    gc.disable()
    try:
        del topology, level
        assert [thing() for thing in gone] == [None] * len(gone)
    finally:
        gc.enable()


@ORDINARY
@given(nested_scenes(SIDE))
def test_the_sizes_of_levels_can_be_counted_without_making_them(scene):
    pyramid = scene.pyramid("radius")
    grid, record = pyramid.grid, pyramid.record
    sizes = level_sizes(
        record.vertex_end, record.vertex_parent, record.edge_end, grid.shape[1], len(pyramid)
    )
    loops = [int(level.is_self_loop.sum()) for level in pyramid]
    assert sizes.tolist() == [
        [level.n_vertices, level.n_arcs, n] for level, n in zip(pyramid, loops, strict=True)
    ]


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT", "0") != "0", reason="nothing is compiled")
def test_a_pyramid_with_rooms_is_built_by_the_same_kernels() -> None:
    grid = occupancy_grid(np.ones((8, 64), np.uint8))
    label_of = np.where(np.arange(64) < 32, 0, 1) + np.zeros((8, 1), np.int32)
    hn.DualGraphPyramid.build(grid)
    kernels = [
        kernel for kernel in vars(_base_kernels).values() if isinstance(kernel, CPUDispatcher)
    ]
    before = [kernel.signatures for kernel in kernels]
    hn.DualGraphPyramid.build(grid, rooms=hn.RoomLabels(("west", "east"), label_of))
    assert [kernel.signatures for kernel in kernels] == before
