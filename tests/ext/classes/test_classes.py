"""Words: every ordinary face reads the identity, every hole one generator, and paths have equal
words when one can be pulled onto the other; dead ends, against networkx on the cells."""

import itertools
from typing import Any

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.classes.classes import HomotopyClasses, inverse, product
from hybridnav.ext.classes.search import DeadEnds
from hybridnav.maps import CellClass
from hybridnav.search.grid_search import GridSearch
from tests.oracle.rays import Rays, holes_of
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


def topology_of(classes, merge_distance_m=3.0, resolution_m=1.0):
    grid = occupancy_grid(classes, resolution_m=resolution_m)
    pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m)
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
        boundary = homotopy._round(int(np.flatnonzero(homotopy.face_of == face)[0]))
        word = cyclically_reduced(homotopy.word_of_route(boundary))
        if homotopy.is_hole[face]:
            assert len(word) == 1
            generators.append(abs(word[0]))
        else:
            assert word == ()
    assert sorted(generators) == list(range(1, len(generators) + 1))
    assert len(generators) == len(holes_of(homotopy.enterable_cells, max(least, 1)))


def words_of_blocks(homotopy):
    """What the full 2x2 blocks read, counter-clockwise."""
    free = homotopy.enterable_cells
    full = free[:-1, :-1] & free[:-1, 1:] & free[1:, :-1] & free[1:, 1:]
    for row, col in np.argwhere(full).tolist():
        ring = [(row, col), (row, col + 1), (row + 1, col + 1), (row + 1, col), (row, col)]
        yield homotopy.word_of_path(np.array(ring))


@given(
    classes=class_grids(18),
    merge_distance_m=st.sampled_from([1.5, 3.0, 20.0]),
    unexplored=st.booleans(),
)
def test_cells_read_the_identity_round_every_full_block(classes, merge_distance_m, unexplored):
    topology = topology_of(classes, merge_distance_m)
    homotopy = HomotopyClasses(topology, allow_unexplored=unexplored, least_hole_m2=0.0)
    assert set(words_of_blocks(homotopy)) <= {()}


def tours(free, rng, count):
    """Closed paths from one cell by random others, the shortest path from each to the next."""
    label = np.cumsum(free).reshape(free.shape)
    search = GridSearch(free)
    start = tuple(rng.choice(np.argwhere(free)).tolist())
    for _ in range(count):
        waypoints = [start, *(tuple(c) for c in rng.choice(np.argwhere(free), 3).tolist()), start]
        legs = [
            search.search(a, b, field_of=label.astype(np.int32), in_corridor=inside).cells
            for a, b in itertools.pairwise(waypoints)
            for inside in [keeping(rng, label, a, b)]
        ]
        found = [leg for leg in legs if leg is not None]
        if len(found) == len(legs):
            yield np.concatenate([found[0], *(leg[1:] for leg in found[1:])])


def keeping(rng, label, *endpoints):
    """All cells but some, so that paths differ."""
    inside = rng.random(int(label.max()) + 1) < 0.9
    inside[[label[end] for end in endpoints]] = True
    return inside


def random_map(rng):
    classes = np.ones(rng.integers(6, 16, 2), np.uint8)
    classes[rng.random(classes.shape) < rng.choice([0.05, 0.15, 0.25])] = 0
    classes[rng.random(classes.shape) < rng.choice([0.0, 0.1])] = 2
    for _ in range(rng.integers(0, 3)):
        row, col = (int(rng.integers(0, side)) for side in classes.shape)
        classes[row : row + rng.integers(1, 5), col : col + rng.integers(1, 5)] = 0
    return classes


@pytest.mark.parametrize("merge_distance_m", [1.5, 3.0, 30.0])
@pytest.mark.parametrize("least", [0.0, 3.0])
def test_paths_have_equal_words_exactly_when_rays_say_so(merge_distance_m, least):
    rng = np.random.default_rng(int(10 * merge_distance_m + least))
    seen = {True: 0, False: 0}
    for _ in range(120):
        topology = topology_of(random_map(rng), merge_distance_m)
        unexplored = bool(rng.integers(2))
        homotopy = HomotopyClasses(topology, allow_unexplored=unexplored, least_hole_m2=least)
        free = homotopy.enterable_cells
        rays = Rays(free, max(least, 1))
        if not free.any():
            continue
        paths = tours(free, rng, 6)
        words = [(homotopy.word_of_path(path), rays.word_of(path)) for path in paths]
        for one, other in itertools.combinations([*words, ((), ())], 2):
            same = one[0] == other[0]
            assert same == (one[1] == other[1])
            seen[same] += 1
    assert min(seen.values()) > 100


def test_a_place_that_encloses_an_obstacle_tells_its_sides_apart():
    classes = np.ones((9, 9), np.uint8)
    classes[4, 4] = 0
    topology = topology_of(classes, 30.0)
    assert topology.n_places == 1
    over = np.array([(3, 3), (4, 3), (5, 3), (5, 4), (5, 5)])
    under = np.array([(3, 3), (3, 4), (3, 5), (4, 5), (5, 5)])
    homotopy = HomotopyClasses(topology, least_hole_m2=1.0)
    assert homotopy.word_of_path(over) != homotopy.word_of_path(under)
    coarser = HomotopyClasses(topology, least_hole_m2=1.5)
    assert coarser.word_of_path(over) == coarser.word_of_path(under) == ()


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
    graph: Any = topology.level.to_networkx()
    start, goal = topology.place_at((1, 1)), topology.place_at((6, 8))
    routes: Any = nx.all_simple_edge_paths(graph, start, goal)
    for edges in routes:
        darts = [2 * arc + (topology.arcs[arc, 0] != tail) for tail, _, arc in edges]
        words.add(homotopy.word_of_route(darts))
    assert len(words) == classes


def test_an_unexplored_island_is_a_hole_unless_it_may_be_entered():
    island = np.where(RING == 0, 2, RING).astype(np.uint8)
    island[[0, -1]] = island[:, [0, -1]] = 0
    topology = topology_of(island, 2.5)
    assert HomotopyClasses(topology).is_hole.sum() == 2  # with the outside
    assert HomotopyClasses(topology, allow_unexplored=True).is_hole.sum() == 1


ROOMS = drawn(
    "###############",
    "#.............#",
    "#.###########.#",
    "#.#.........#.#",
    "#.#.###.....#.#",
    "#.#.#.#..#..#.#",
    "#.#.###.....#.#",
    "#.#.........#.#",
    "#.###########.#",
    "#.............#",
    "###############",
)
"""A walk round a walled room that holds a walled cell and a pillar."""


@pytest.mark.parametrize(("least", "holes"), [(0.0, 3), (1.5, 2), (9.0, 2), (9.5, 1), (78.0, 0)])
def test_holes_are_measured_filled_and_every_part_has_its_own_outside(least, holes):
    homotopy = HomotopyClasses(topology_of(ROOMS, 3.0), least_hole_m2=least)
    assert np.isinf(homotopy.areas_m2).sum() == len(homotopy.roots)
    finite = homotopy.is_hole & np.isfinite(homotopy.areas_m2)
    assert sorted(homotopy.areas_m2[finite]) == [area for area in (1.0, 9.0, 77.0) if area >= least]
    letters = {abs(letter) for word in homotopy.words for letter in word}
    assert len(letters) == finite.sum() == holes


def test_a_negative_area_is_refused():
    with pytest.raises(hn.errors.InvalidValueError, match=">= 0"):
        HomotopyClasses(topology_of(RING), least_hole_m2=-1.0)


def walks_of(free):
    """Cells that may be entered, joined by their sides: no move cuts a corner."""
    walks = nx.grid_2d_graph(*free.shape)
    walks.remove_nodes_from([cell for cell in walks if not free[cell]])
    return walks


def runs_of(free, longest):
    """Cells of each run along a row or a column that is not too long, by looking at each cell."""
    found = []
    for step in ((0, 1), (1, 0)):
        runs: Any = nx.Graph()
        runs.add_nodes_from(walks_of(free))
        runs.add_edges_from(
            (a, b) for a, b in walks_of(free).edges if (b[0] - a[0], b[1] - a[1]) == step
        )
        found += [run for run in nx.connected_components(runs) if len(run) <= longest]
    return found


@given(classes=class_grids(12), reach=st.integers(1, 4), seed=st.integers(0, 2**32 - 1))
def test_what_is_taken_out_lies_behind_a_passage_from_start_and_goal(classes, reach, seed):
    free = classes == CellClass.FREE
    cells = np.argwhere(free)
    if len(cells) == 0:
        return
    chosen = np.random.default_rng(seed).choice(cells, 2).tolist()
    start, goal = (tuple(cell) for cell in chosen)
    walks = walks_of(free)
    if not nx.has_path(walks, start, goal):
        return
    left = DeadEnds(free, reach).left(start, goal)
    assert not (left & ~free).any()
    assert left[start]
    assert left[goal]
    behind = set()
    for run in runs_of(free, reach + 1):
        rest = walks.subgraph(set(walks) - run)
        endpoints = {end for end in (start, goal) if end in rest}
        for part in nx.connected_components(rest):
            if not endpoints & part and any(
                beside in run for cell in part for beside in walks[cell]
            ):
                behind |= part
    taken = set(map(tuple, np.argwhere(free & ~left).tolist()))
    assert taken <= behind


NICHES = drawn(
    "##############",
    "#.....#......#",
    "#.....#..##..#",
    "#........##..#",
    "#.....#......#",
    "#.....#......#",
    "##############",
)


def test_a_room_with_one_narrow_door_is_taken_out_unless_an_end_lies_there():
    free = NICHES == CellClass.FREE
    west, hall = (2, 2), (1, 8)
    # From the hall the western room is a dead end; from there all behind the doorway is.
    left = DeadEnds(free, 1).left(hall, (5, 12))
    assert not left[:, :6].any()
    assert (left[:, 6:] == free[:, 6:]).all()
    left = DeadEnds(free, 1).left(west, (5, 4))
    assert (left[:, :6] == free[:, :6]).all()
    assert not left[:, 7:].any()
    assert (DeadEnds(free, 1).left(west, hall) == free).all()


def test_a_room_with_two_doors_or_a_wide_one_is_no_dead_end():
    for doors in ([1], [2], [4]):  # a second one, and one of two cells
        free = NICHES == CellClass.FREE
        free[doors, 6] = True
        left = DeadEnds(free, 1 if doors == [1] else 0).left((1, 8), (5, 12))
        assert left[1:6, 1:6].all()
