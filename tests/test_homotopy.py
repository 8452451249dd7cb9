"""Words of arcs: every ordinary face reads the identity, every hole one generator, and a route
that is pushed about without crossing a hole keeps its word."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.topology.homotopy import HomotopyClasses, inverse, product
from tests.strategies import class_grids, drawn, occupancy_grid

LETTERS = st.lists(st.integers(1, 4).flatmap(lambda g: st.sampled_from([g, -g])), max_size=12)


def reduced(letters):
    return product(*((letter,) for letter in letters))


@given(LETTERS, LETTERS, LETTERS)
def test_words_are_a_free_group(a, b, c):
    a, b, c = map(reduced, (a, b, c))
    assert product(product(a, b), c) == product(a, product(b, c)) == product(a, b, c)
    assert product(a, inverse(a)) == ()
    assert inverse(product(a, b)) == product(inverse(b), inverse(a))
    assert all(x != -y for x, y in itertools.pairwise(a))


def cyclically_reduced(word):
    while len(word) > 1 and word[0] == -word[-1]:
        word = word[1:-1]
    return word


def topology_of(classes, merge_distance_m=3.0):
    pyramid = hn.DualGraphPyramid.build(occupancy_grid(classes), merge_distance_m=merge_distance_m)
    return hn.TopologicalMap(pyramid)


@given(
    classes=class_grids(18),
    merge_distance_m=st.sampled_from([1.5, 3.0, 6.0]),
    unexplored=st.booleans(),
    least=st.sampled_from([0.0, 1.5, 4.0]),
)
def test_faces_read_the_identity_and_holes_one_generator_each(
    classes, merge_distance_m, unexplored, least
):
    topology = topology_of(classes, merge_distance_m)
    homotopy = HomotopyClasses(topology, allow_unexplored=unexplored, least_hole_m2=least)
    generators = []
    for face in range(len(homotopy.areas_m2)):
        if face in homotopy.roots:
            continue
        word = cyclically_reduced(homotopy.reading(face))
        if homotopy.is_hole[face]:
            assert len(word) == 1
            generators.append(abs(word[0]))
            assert homotopy.areas_m2[face] >= least
        else:
            assert word == ()
    assert sorted(generators) == list(range(1, len(generators) + 1))


@given(
    classes=class_grids(18),
    seed=st.integers(0, 2**32 - 1),
    least=st.sampled_from([0.0, 3.0]),
)
def test_a_route_pushed_over_an_ordinary_face_keeps_its_word(classes, seed, least):
    topology = topology_of(classes, 2.0)
    homotopy = HomotopyClasses(topology, least_hole_m2=least)
    rng = np.random.default_rng(seed)
    darts = np.flatnonzero(homotopy.face_of >= 0)
    plain = [
        int(dart)
        for dart in darts
        if not homotopy.is_hole[homotopy.face_of[dart]]
        and homotopy.face_of[dart] not in homotopy.roots
    ]
    if not plain:
        return
    # Any one dart of such a face, against the way round the face's other side.
    for dart in rng.choice(plain, min(5, len(plain)), replace=False).tolist():
        others, at = [], int(homotopy.phi[dart])
        while at != dart:
            others.append(at)
            at = int(homotopy.phi[at])
        detour = product(*(homotopy.word_of_dart(other) for other in others))
        assert inverse(detour) == homotopy.word_of_dart(dart)


RING = drawn(
    "##########",
    "#........#",
    "#........#",
    "#..####..#",
    "#..####..#",
    "#........#",
    "#........#",
    "##########",
)


@pytest.mark.parametrize(("least", "classes"), [(0.0, 2), (8.0, 2), (8.5, 1)])
def test_two_sides_of_a_hole_are_two_classes_unless_it_is_too_small(least, classes):
    topology = topology_of(RING, 2.5)
    homotopy = HomotopyClasses(topology, least_hole_m2=least)
    words = set()
    graph = topology.level.to_networkx()
    import networkx as nx

    start, goal = topology.place_at((1, 1)), topology.place_at((6, 8))
    for edges in nx.all_simple_edge_paths(graph, start, goal):
        arcs = [edge[-1] for edge in edges]
        words.add(homotopy.word_of_route(start, arcs, topology.arcs))
    assert len(words) == classes


def test_an_unexplored_island_is_a_hole_unless_it_may_be_entered():
    island = np.where(RING == 0, 2, RING).astype(np.uint8)
    island[[0, -1]] = island[:, [0, -1]] = 0
    topology = topology_of(island, 2.5)
    assert HomotopyClasses(topology).is_hole.sum() == 2  # with the outside
    assert HomotopyClasses(topology, allow_unexplored=True).is_hole.sum() == 1


def test_a_negative_area_is_refused():
    with pytest.raises(hn.InvalidValueError, match=">= 0"):
        HomotopyClasses(topology_of(RING), least_hole_m2=-1.0)
