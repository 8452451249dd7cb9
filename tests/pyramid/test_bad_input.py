"""Merge distances, linkages, seeds and maps at the edge of what makes sense: defined answers."""

import math
from fractions import Fraction
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest

import hybridnav as hn
from hybridnav.pyramid import DualGraphPyramid, FaceKind
from hybridnav.topology import TopologicalMap
from hybridnav.topology.map import Component, Obstacle
from hybridnav.viz import plot_level, plot_places
from tests.oracle.checks import check_attributes, check_base, check_level
from tests.oracle.inclusion import Surroundings, kept_inside, rotations
from tests.oracle.pyramid import Base
from tests.strategies import drawn, occupancy_grid

LINKAGES = ("radius", "survivor", "diameter")
MAPS = {
    "one free cell": ["."],
    "one unexplored cell": ["?"],
    "one occupied cell": ["#"],
    "two cells": [".?"],
    "one row": ["..??..#..??"],
    "one row of one class": ["..........."],
    "one column": list("..??.#..??"),
    "all occupied": ["####"] * 3,
    "all unexplored": ["?????"] * 4,
    "all free": ["....."] * 4,
    "cells that meet at corners only": [".#.#.", "#.#.#", ".#.#."],
    "checkerboard": [".?.?", "?.?.", ".?.?"],
    "one cell in a wall": ["###", "#.#", "###"],
    "a pillar": ["...", ".#.", "..."],
}

each_linkage = pytest.mark.parametrize("linkage", LINKAGES)
each_map = pytest.mark.parametrize("lines", MAPS.values(), ids=MAPS.keys())


def built(lines, *, resolution_m=1.0, merge_distance_m=4.0, linkage="radius", seed=0):
    return DualGraphPyramid.build(
        occupancy_grid(drawn(*lines), resolution_m=resolution_m),
        merge_distance_m=merge_distance_m,
        linkage=linkage,
        seed=seed,
    )


@pytest.fixture(autouse=True)
def _close_figures():
    yield
    plt.close("all")


@pytest.mark.parametrize("distance", [0, 0.0, -0.0, -1e-9, -4.0, -math.inf, math.nan, np.nan])
def test_a_merge_distance_is_positive(distance):
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"merge distance .* got -?[\dn]|got -inf"
    ) as error:
        built([".."], merge_distance_m=distance)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("linkage", ["single", "", "RADIUS", "radius ", None, 0])
def test_an_unknown_linkage_is_named_with_those_there_are(linkage):
    with pytest.raises(
        hn.errors.InvalidValueError, match="throats, survivor, radius, dia"
    ) as error:
        built([".."], linkage=linkage)
    assert repr(linkage) in str(error.value)


@each_linkage
@each_map
def test_below_one_cell_each_cell_is_a_place(lines, linkage):
    classes = drawn(*lines)
    for distance in (5e-324, 1e-200, 0.01, 1.0 - 1e-9, 1.0):
        pyramid = built(lines, merge_distance_m=distance, linkage=linkage)
        assert len(pyramid) == 1
        assert pyramid[0].n_vertices == (classes > 0).sum()
        assert pyramid[0].areas.tolist() == [1] * pyramid[0].n_vertices
        check_base(pyramid[0], Base.of(classes))


@each_linkage
@pytest.mark.parametrize(("resolution_m", "distance"), [(0.05, 0.05), (0.1, 0.1), (0.3, 0.3)])
def test_one_cell_is_not_below_one_cell_at_any_resolution(resolution_m, distance, linkage):
    few = built(["...."], resolution_m=resolution_m, merge_distance_m=distance, linkage=linkage)
    assert len(few) == 1
    more = math.nextafter(distance, 1) * 1.001
    pairs = built(["...."], resolution_m=resolution_m, merge_distance_m=more, linkage=linkage)
    assert len(pairs) > 1


@each_linkage
@each_map
def test_beyond_the_map_each_connected_set_of_a_class_is_a_place(lines, linkage):
    for distance in (1e18, 1e200, 1.7e308, math.inf):
        level = built(lines, merge_distance_m=distance, linkage=linkage)[-1]
        arcs = level.arcs[~level.is_self_loop]
        assert (level.classes[arcs[:, 0]] != level.classes[arcs[:, 1]]).all()


@each_linkage
@each_map
@pytest.mark.parametrize("distance", [0.5, 2.5, math.inf])
def test_every_level_of_a_degenerate_map_is_a_level(lines, linkage, distance):
    pyramid = built(lines, merge_distance_m=distance, linkage=linkage)
    classes = drawn(*lines)
    base = Base.of(classes)
    for level in pyramid:
        check_level(level, base)
        check_attributes(level, classes, resolution_m=1.0)
        dual = level.dual
        assert dual.edges.shape == (level.n_arcs, 2)
        assert dual.n_faces == len(np.unique(dual.face_of)) == len(dual.kinds)
        joined = len(np.unique(level.arcs))
        n_outside = int((dual.kinds == FaceKind.OUTSIDE).sum())
        assert joined - level.n_arcs + dual.n_faces == 2 * n_outside
        fields = [level.receptive_field(vertex) for vertex in range(level.n_vertices)]
        assert sum(map(len, fields)) == (classes > 0).sum()
    for low, high in zip(range(len(pyramid) - 1), range(1, len(pyramid)), strict=True):
        assert len(pyramid.parent(low)) == pyramid[low].n_vertices
        gone = len(pyramid.contraction_kernel(low)) + len(pyramid.removal_kernel(low))
        assert gone == pyramid[low].n_arcs - pyramid[high].n_arcs


@each_linkage
@each_map
@pytest.mark.parametrize("distance", [0.5, math.inf])
def test_inclusion_has_an_answer_on_a_degenerate_map(lines, linkage, distance):
    topology = TopologicalMap(built(lines, merge_distance_m=distance, linkage=linkage))
    field_of, islands = topology.level.field_of, topology.pyramid.islands
    surroundings = Surroundings(drawn(*lines), field_of)
    masks: dict[Any, Any] = {place: field_of == place for place in range(topology.n_places)}
    assert topology.enclosed_by(Obstacle(0)) == ()
    masks |= {Obstacle(i): islands.obstacle_of == i for i in range(1, len(islands.obstacle_cell))}
    masks |= {Component(i): islands.component_of == i for i in range(len(islands.component_cell))}
    for thing, mask in masks.items():
        assert topology.enclosed_by(thing) in rotations(surroundings.ring(mask))
    for place in range(topology.n_places):
        inside = kept_inside(masks[place])
        enclosed = topology.encloses(place)
        obstacles = range(1, len(islands.obstacle_cell))
        assert enclosed.obstacles.tolist() == [
            i for i in obstacles if inside[masks[Obstacle(i)]].all()
        ]
        assert enclosed.places.tolist() == []
        assert enclosed.components.tolist() == []
    islands_found = topology.unexplored_islands()
    assert all(surroundings.ring(np.isin(field_of, island)) for island in islands_found)


@each_map
def test_a_degenerate_map_can_be_drawn(lines):
    topology = TopologicalMap(built(lines, merge_distance_m=math.inf))
    for axes in (plot_places(topology, self_loops=True), plot_level(topology.pyramid[0])):
        axes.figure.canvas.draw()
        assert axes.images, "the fields are drawn as an image"


@each_linkage
@pytest.mark.parametrize("lines", [["#"], ["####"] * 3, ["#"] * 5])
def test_a_map_without_a_vertex_has_one_level_of_empty_arrays(lines, linkage):
    pyramid = built(lines, linkage=linkage)
    level = pyramid[-1]
    assert len(pyramid) == 1
    assert level is pyramid[0]
    assert (level.n_vertices, level.n_arcs, level.dual.n_faces) == (0, 0, 0)
    empty = (level.cells, level.classes, level.areas, level.arcs, level.base_pairs, level.sigma)
    more = (level.protected, level.max_distance_m, level.through_m, level.dual.edges)
    assert [array.size for array in (*empty, *more)] == [0] * 10
    assert level.cells.shape == level.arcs.shape == level.dual.edges.shape == (0, 2)
    assert (level.field_of == -1).all()
    topology = TopologicalMap(pyramid)
    assert (topology.n_places, topology.n_arcs, topology.parallel_arcs()) == (0, 0, 0)
    assert topology.positions.shape == (0, 2)
    assert topology.place_at((0, 0)) == -1
    assert topology.areas_m2.tolist() == topology.place_ids.tolist() == []
    assert topology.unexplored_islands() == []
    for ask in (topology.encloses, topology.enclosed_by, level.receptive_field, level.boundary):
        with pytest.raises(hn.errors.InvalidValueError, match="got 0"):
            ask(0)


@pytest.mark.parametrize("preset", ["paper", "grid-astar"])
@pytest.mark.parametrize(
    ("lines", "query", "status"),
    [
        (["####"] * 3, ((0.5, 0.5), (2.5, 1.5)), "start occupied"),
        (["????"] * 3, ((0.5, 0.5), (2.5, 1.5)), "start unexplored"),
        (["....", "####"], ((0.5, 0.5), (2.5, 0.5)), "start occupied"),
        (["####", "...."], ((0.5, 0.5), (2.5, 1.5)), "goal occupied"),
        (["."], ((0.5, 0.5), (0.5, 0.5)), "solved"),
        (["."], ((0.5, 0.5), (1.5, 0.5)), "goal outside the map"),
        (["......"], ((0.5, 0.5), (5.5, 0.5)), "solved"),
        (list("......"), ((0.5, 0.5), (0.5, 5.5)), "solved"),
        ([".....#"], ((0.5, 0.5), (5.5, 0.5)), "goal occupied"),
        (["..#..."], ((0.5, 0.5), (5.5, 0.5)), "no path"),
        (["..?..."], ((0.5, 0.5), (5.5, 0.5)), "no path"),
    ],
)
@pytest.mark.parametrize("distance", [0.5, 2.5, math.inf])
def test_plans_on_degenerate_maps_end_with_a_status(lines, query, status, preset, distance):
    topology = TopologicalMap(built(lines, merge_distance_m=distance))
    result = hn.HybridPlanner(topology, preset=preset).plan(*query)
    assert result.status == status
    if status == "solved":
        assert result.path is not None
        assert result.path.length_m == pytest.approx(math.dist(*query))


@each_linkage
@pytest.mark.parametrize(
    "seed",
    [
        0,
        1,
        -1,
        2**31 - 1,
        2**32,
        2**63 - 1,
        -(2**63),
        2**64,
        10**40,
        np.int64(-5),
        np.uint64(2**63),
    ],
)
def test_any_whole_number_is_a_seed(seed, linkage):
    lines = ["..........", "...??.....", "...??.#...", ".........."]
    first, again = (built(lines, merge_distance_m=3.0, linkage=linkage, seed=seed) for _ in "ab")
    base = Base.of(drawn(*lines))
    assert first.seed == int(seed)
    assert first[-1].field_of.tolist() == again[-1].field_of.tolist()
    for level in first:
        check_level(level, base)


@pytest.mark.parametrize("seed", [0.5, math.nan, math.inf, "1", None])
def test_a_seed_is_a_whole_number(seed):
    with pytest.raises(hn.errors.InvalidValueError, match="seed"):
        built([".."], seed=seed)


@pytest.mark.parametrize("distance", ["4", None, [4.0], 4 + 0j])
def test_a_merge_distance_is_a_number(distance):
    with pytest.raises(
        hn.errors.InvalidValueError, match="merge distance must be a positive number"
    ):
        built([".."], merge_distance_m=distance)


@pytest.mark.parametrize("distance", [4, np.float32(4), np.int64(4), Fraction(4), np.array(4.0)])
def test_a_merge_distance_is_any_kind_of_number(distance):
    pyramid = built(["......"], merge_distance_m=distance)
    assert pyramid.merge_distance_m == 4.0
    assert type(pyramid.merge_distance_m) is float


@pytest.mark.parametrize("most_cells", [np.int64(3), np.uint8(3)])
def test_regions_take_any_whole_number(most_cells):
    pyramid = built(["......"], merge_distance_m=2.0)
    assert pyramid.with_regions(most_cells).region_cells == 3
    for wrong in (0, -1, 2.0, True, "3", None):
        with pytest.raises(hn.errors.InvalidValueError, match="expected a whole number >= 1"):
            pyramid.with_regions(wrong)


def test_a_level_above_the_apex_is_an_index_error():
    pyramid = built(["......"], merge_distance_m=2.0)
    for ask in (pyramid.parent, pyramid.contraction_kernel, pyramid.removal_kernel):
        with pytest.raises(IndexError, match="the pyramid has levels 0 to"):
            ask(-1)
    with pytest.raises(IndexError, match="the pyramid has levels 0 to"):
        pyramid.ancestor(0, level=0, to=99)


def test_above_the_rooms_fields_of_one_class_merge_and_no_others():
    lines = ["..??", "..??"]
    rooms = hn.RoomLabels(("west", "east"), np.tile([0, 1, 0, 1], (2, 1)))
    pyramid = DualGraphPyramid.build(occupancy_grid(drawn(*lines)), rooms=rooms)
    assert [pyramid[at].n_vertices for at in (pyramid.room_level, -1)] == [4, 2]


@pytest.mark.parametrize("index", [1, -2, 99])
def test_a_level_that_is_not_there_is_an_index_error(index):
    with pytest.raises(IndexError, match="levels 0 to 0"):
        built(["#"])[index]


@each_linkage
def test_a_snake_of_many_levels_and_a_long_row(linkage):
    row = built(["." * 700], merge_distance_m=math.inf, linkage=linkage)
    assert row[-1].n_vertices == 1
    assert row[-1].n_arcs == 0
    snake = [
        "." * 30 if at % 2 == 0 else ("#" * 29 + "." if at % 4 == 1 else "." + "#" * 29)
        for at in range(31)
    ]
    level = built(snake, merge_distance_m=math.inf, linkage=linkage)[-1]
    assert (level.n_vertices, level.n_arcs) == (1, 0)
