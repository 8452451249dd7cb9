"""The dual of every level: faces told apart by geometry, and dual edges by walks round faces."""

from collections import Counter
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given, settings

from benchmarks.worlds import figure1_world
from hybridnav.pyramid import DualGraphPyramid, FaceKind
from tests.oracle.checks import crossing_darts, phi_walks
from tests.oracle.inclusion import nested_scenes, signed_area
from tests.oracle.pyramid import Base, boundaries, canonical, face_sequences, holes, orbits
from tests.strategies import IS_FULL, MAX_SIDE, drawn, examples, occupancy_grid

LINKAGES = ("radius", "survivor", "diameter")
SIDE = min(24 if IS_FULL else 20, MAX_SIDE)
ORDINARY = settings(max_examples=examples(40, full=300), deadline=None)

each_linkage = pytest.mark.parametrize("linkage", LINKAGES)


def levels_of(scene, linkage):
    return scene.pyramid(linkage)


def check_walks(level):
    dual = level.dual
    walks = sorted(phi_walks(level), key=min)
    assert dual.n_faces == len(walks) == len(dual.kinds)
    assert dual.face_of.shape == (2 * level.n_arcs,)
    for face, walk in enumerate(walks):
        assert (dual.face_of[list(walk)] == face).all()
    assert dual.edges.shape == (level.n_arcs, 2)
    for arc, (right, left) in enumerate(dual.edges.tolist()):
        assert 2 * arc in walks[right]
        assert 2 * arc + 1 in walks[left]


def check_kinds(level, base):
    """Faces are outside or protected as the cells that their base walks go round say.

    A face lies on the right: a walk round a hole goes clockwise, that round a component does not.
    """
    dual = level.dual
    found = boundaries(level.field_of)
    expected = Counter(
        (FaceKind.PROTECTED if protected else FaceKind.ORDINARY, sequence)
        for (protected, sequence), count in face_sequences(base, level.field_of, found).items()
        for _ in range(count)
    )
    alone = holes(level.field_of) == 0  # what is one place without a hole has no face
    for walk in base.protected:
        if signed_area([dart[0] for dart in walk]) >= 0:
            key = canonical_walk(walk, level.field_of, found)
            if key or not alone[level.field_of[walk[0][0]]]:
                expected[FaceKind.PROTECTED, key] -= 1
                expected[FaceKind.OUTSIDE, key] += 1
    assert faces_of(level, found) == +expected
    assert ((dual.kinds != FaceKind.ORDINARY)[dual.face_of] == level.protected).all()


def canonical_walk(walk, field_of, found):
    crossing = (dart for dart in walk if field_of[dart[0]] != field_of[dart[1]])
    return canonical(tuple((found.label_of[dart], int(field_of[dart[0]])) for dart in crossing))


def faces_of(level, found):
    label = np.full(level.n_arcs, -1)
    label[~level.is_self_loop] = [found.label_of[dart] for dart in crossing_darts(level)]
    origin = level.arcs.ravel()
    faces: Counter[Any] = Counter()
    for walk in phi_walks(level):
        steps = ((int(label[dart // 2]), int(origin[dart])) for dart in walk)
        sequence = canonical(tuple(step for step in steps if step[0] >= 0))
        faces[FaceKind(level.dual.kinds[level.dual.face_of[walk[0]]]), sequence] += 1
    return faces


def check_duality(level):
    dual = level.dual
    sigma, face_of = level.sigma.tolist(), dual.face_of
    phi = {dart: sigma[dart ^ 1] for dart in range(len(sigma))}
    faces_of_dual = orbits({dart: phi[dart ^ 1] for dart in phi})
    origin = level.arcs.ravel()
    assert len(faces_of_dual) == len(np.unique(origin))
    assert all(len(np.unique(origin[list(walk)])) == 1 for walk in faces_of_dual)
    vertices: nx.Graph[int] = nx.Graph(level.arcs.tolist())
    dual_vertices: nx.Graph[int] = nx.Graph(dual.edges.tolist())
    pieces = {
        frozenset(face_of[np.isin(origin, list(v))]) for v in nx.connected_components(vertices)
    }
    assert pieces == set(map(frozenset, nx.connected_components(dual_vertices)))
    for piece in pieces:
        arcs = np.isin(dual.edges[:, 0], list(piece))
        n_vertices = len(np.unique(level.arcs[arcs]))
        assert n_vertices - int(arcs.sum()) + len(piece) == 2
        assert int((dual.kinds[list(piece)] == FaceKind.OUTSIDE).sum()) == 1
    # What is a loop on one side is a bridge on the other.
    assert bridges(dual.edges) == set(np.flatnonzero(level.is_self_loop).tolist())
    assert bridges(level.arcs) == set(np.flatnonzero(dual.edges[:, 0] == dual.edges[:, 1]).tolist())


def bridges(endpoints):
    pairs = [tuple(sorted(pair)) for pair in endpoints.tolist()]
    times = Counter(pairs)
    graph: nx.Graph[int] = nx.Graph(pair for pair in pairs if pair[0] != pair[1])
    found: Any = nx.bridges(graph)
    cut = {tuple(sorted(pair)) for pair in found}
    return {edge for edge, pair in enumerate(pairs) if pair in cut and times[pair] == 1}


@each_linkage
@given(scene=nested_scenes(SIDE))
@ORDINARY
def test_faces_of_every_level_are_told_apart_as_their_cells_say(scene, linkage):
    base = Base.of(scene.classes)
    for level in levels_of(scene, linkage):
        check_walks(level)
        check_kinds(level, base)


@each_linkage
@given(scene=nested_scenes(SIDE))
@ORDINARY
def test_the_dual_of_the_dual_is_the_graph(scene, linkage):
    for level in levels_of(scene, linkage):
        check_duality(level)


PLAIN, HOLE, OUTSIDE = FaceKind.ORDINARY, FaceKind.PROTECTED, FaceKind.OUTSIDE


@each_linkage
@pytest.mark.parametrize(
    ("lines", "kinds"),
    [
        pytest.param(["....", ".??.", "...."], [PLAIN, OUTSIDE], id="island"),
        pytest.param(["...", ".#.", "..."], [HOLE, OUTSIDE], id="pillar"),
        pytest.param(["..??", "..#?", "..??"], [HOLE, OUTSIDE], id="two doors"),
        pytest.param(["..??", "..??"], [OUTSIDE], id="two places"),
        pytest.param(["..??", "..??", "####", "..??"], [OUTSIDE, OUTSIDE], id="two components"),
        pytest.param(
            [".....", ".###.", ".#.#.", ".###.", "....."], [HOLE, OUTSIDE], id="cell walled in"
        ),
        pytest.param(
            ["......", ".####.", ".#.?#.", ".####.", "......"],
            [HOLE, OUTSIDE, OUTSIDE],
            id="room walled in",
        ),
        pytest.param([".?.", "?.?"], [PLAIN, PLAIN, OUTSIDE], id="checkerboard"),
        pytest.param(
            ["?????", "?..??", "?..#?", "?????"], [HOLE, OUTSIDE], id="island at an obstacle"
        ),
        pytest.param(["..", ".."], [], id="one place"),
        pytest.param([".#."], [], id="two places without an arc"),
        pytest.param(["##", "##"], [], id="nothing"),
    ],
)
def test_faces_of_small_maps(lines, kinds, linkage):
    grid = occupancy_grid(drawn(*lines))
    dual = DualGraphPyramid.build(grid, merge_distance_m=80.0, linkage=linkage)[-1].dual
    assert sorted(dual.kinds.tolist()) == sorted(kinds)


def test_the_base_of_an_open_map_has_a_face_for_each_block_and_the_outside():
    dual = DualGraphPyramid.build(occupancy_grid(drawn("....", "....", "....")))[0].dual
    assert Counter(dual.kinds.tolist()) == {PLAIN: 6, OUTSIDE: 1}
    # The outside has twice the sides of the map for neighbours, corners included.
    outside = int(np.flatnonzero(dual.kinds == OUTSIDE)[0])
    assert int((dual.edges == outside).sum()) == 10


@each_linkage
def test_figure_1_has_an_obstacle_a_wall_and_the_ring_round_the_island(linkage):
    pyramid = DualGraphPyramid.build(
        figure1_world().grid(robot_radius_m=0), merge_distance_m=np.inf, linkage=linkage
    )
    level, dual = pyramid[-1], pyramid[-1].dual
    assert sorted(dual.kinds.tolist()) == [PLAIN, HOLE, OUTSIDE]
    order = np.argsort(dual.kinds)
    ring, obstacle, outside = order.tolist()
    endpoints = [tuple(sorted(pair)) for pair in dual.edges[~level.is_self_loop].tolist()]
    doors = tuple(sorted((obstacle, outside)))
    # Both doors part the obstacle from the wall; the island's edge closes on itself.
    assert sorted(endpoints) == sorted([doors, doors, (ring, ring)])
    loop = dual.edges[level.is_self_loop].tolist()
    assert [sorted(pair) for pair in loop] in (
        [sorted((ring, outside))],
        [sorted((ring, obstacle))],
    )


def test_arrays_of_a_dual_are_not_writeable():
    dual = DualGraphPyramid.build(occupancy_grid(drawn("..?", "..?")))[0].dual
    for array in (dual.face_of, dual.kinds, dual.edges):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
