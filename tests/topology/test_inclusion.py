"""Inclusion against walks between cells: what encloses what, and what goes round it."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.worlds import figure1_world
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.topology import TopologicalMap
from hybridnav.topology.map import Component, Obstacle
from tests.oracle.inclusion import (
    Surroundings,
    filled_area,
    grown,
    kept_inside,
    nested_maps,
    nested_scenes,
    rotations,
    sets_of,
)
from tests.strategies import IS_FULL, MAX_SIDE, class_grids, drawn, examples, occupancy_grid, seeds

LINKAGES = ("radius", "survivor", "diameter")
SIDE = min(24 if IS_FULL else 20, MAX_SIDE)
ORDINARY = settings(max_examples=examples(50, full=300), deadline=None)

each_linkage = pytest.mark.parametrize("linkage", LINKAGES)


def topology_of(scene, linkage):
    return TopologicalMap(
        DualGraphPyramid.build(
            scene.grid, merge_distance_m=scene.merge_distance_m, linkage=linkage, seed=scene.seed
        )
    )


def map_of(*lines, merge_distance_m=80.0, linkage="radius", resolution_m=1.0):
    grid = occupancy_grid(drawn(*lines), resolution_m=resolution_m)
    return TopologicalMap(
        DualGraphPyramid.build(
            grid, merge_distance_m=merge_distance_m * resolution_m, linkage=linkage
        )
    )


def masks_of(topology):
    """Every place, obstacle but the rim, and component, and the cells of each."""
    field_of, islands = topology.level.field_of, topology.pyramid.islands
    places = {place: field_of == place for place in range(topology.n_places)}
    n_obstacles, n_components = len(islands.obstacle_cell), len(islands.component_cell)
    obstacles = {Obstacle(i): islands.obstacle_of == i for i in range(1, n_obstacles)}
    components = {Component(i): islands.component_of == i for i in range(n_components)}
    return places | obstacles | components


def enclosed_things(enclosed):
    return [
        *enclosed.places.tolist(),
        *map(Obstacle, enclosed.obstacles.tolist()),
        *map(Component, enclosed.components.tolist()),
    ]


def place_sets(topology, rng):
    """Some connected sets of places, as a walk over arcs picks them up."""
    for _ in range(min(8, topology.n_places)):
        found = [int(rng.integers(topology.n_places))]
        for _ in range(int(rng.integers(1, 12))):
            here = topology.arcs == rng.choice(found)
            beside = set(topology.arcs[here.any(axis=1)].ravel().tolist()) - set(found)
            found += [int(rng.choice(sorted(beside)))] if beside else []
        yield found


def insides(topology):
    """Cells that each place encloses, bool (n_places, rows, cols)."""
    field_of = topology.level.field_of
    masks = [kept_inside(field_of == place) for place in range(topology.n_places)]
    return np.array(masks, dtype=bool).reshape(-1, *field_of.shape)


def check_encloses(topology, inside):
    expected: list[list[Any]] = [[] for _ in inside]
    for thing, mask in masks_of(topology).items():
        for place in np.flatnonzero(inside[:, mask].all(axis=1)).tolist():
            expected[place].append(thing)
    for place, things in enumerate(expected):
        enclosed = topology.encloses(place)
        assert enclosed_things(enclosed) == things
        assert enclosed.ignored == 0


def check_ring(topology, thing, mask):
    """The answer is the tour, written with its smallest place first."""
    surroundings = Surroundings(topology.grid.classes, topology.level.field_of)
    ring = topology.enclosed_by(thing)
    assert ring in rotations(surroundings.ring(mask)), thing
    assert not ring or ring[0] == min(ring)


def check_meaning(topology, inside, thing, mask):
    """What the answer promises, whichever way it was found."""
    field_of = topology.level.field_of
    ring = topology.enclosed_by(thing)
    whole, at_rim = Surroundings(topology.grid.classes, field_of).with_obstacles(mask)
    assert (not ring) == at_rim, thing
    wall = np.isin(field_of, ring)
    assert not (wall & mask).any()
    assert kept_inside(wall)[mask].all() == bool(ring)
    assert all(grown(whole)[field_of == place].any() for place in ring)
    if len(ring) > 1:
        steps = np.sort(np.stack([ring, np.roll(ring, -1)], axis=1), axis=1)
        code = np.array([topology.n_places, 1])
        assert np.isin(steps @ code, np.sort(topology.arcs, axis=1) @ code).all()
    enclosing = np.flatnonzero(inside[:, mask].all(axis=1)).tolist()
    assert ring or not enclosing
    for place in enclosing:
        # The ring lies inside whatever place encloses the thing alone, or passes through it.
        assert all(one == place or inside[place][field_of == one].all() for one in ring), thing
    if len(ring) == 1:
        assert ring[0] in enclosing


@each_linkage
@given(scene=nested_scenes(SIDE))
@ORDINARY
def test_a_place_encloses_what_no_walk_round_it_joins_to_the_outside(scene, linkage):
    topology = topology_of(scene, linkage)
    check_encloses(topology, insides(topology))


@each_linkage
@given(scene=nested_scenes(SIDE))
@ORDINARY
def test_what_goes_round_a_thing_is_a_tour_along_its_edge(scene, linkage):
    topology = topology_of(scene, linkage)
    for thing, mask in masks_of(topology).items():
        check_ring(topology, thing, mask)


@given(
    scene=nested_scenes(SIDE if IS_FULL else min(16, SIDE)),
    seed=seeds,
    linkage=st.sampled_from(LINKAGES),
)
@ORDINARY
def test_several_connected_places_are_one_thing(scene, seed, linkage):
    topology = topology_of(scene, linkage)
    inside = insides(topology)
    for places in place_sets(topology, np.random.default_rng(seed)):
        mask = np.isin(topology.level.field_of, places)
        check_ring(topology, places, mask)
        check_meaning(topology, inside, places, mask)


@each_linkage
@given(scene=nested_scenes(SIDE if IS_FULL else min(12, SIDE)))
@settings(ORDINARY, max_examples=examples(25, full=300))
def test_the_places_round_a_thing_part_it_from_the_outside(scene, linkage):
    topology = topology_of(scene, linkage)
    inside = insides(topology)
    for thing, mask in masks_of(topology).items():
        check_meaning(topology, inside, thing, mask)


@given(scene=nested_scenes(SIDE))
@ORDINARY
def test_unexplored_islands_are_the_unexplored_sets_with_places_all_round(scene):
    topology = topology_of(scene, "radius")
    field_of = topology.level.field_of
    surroundings = Surroundings(scene.classes, field_of)
    unknown = sets_of(scene.classes == CellClass.UNEXPLORED, diagonal=False)
    masks = [unknown == label for label in range(int(unknown.max(initial=-1)) + 1)]
    expected = [
        tuple(np.unique(field_of[mask]).tolist()) for mask in masks if surroundings.ring(mask)
    ]
    assert topology.unexplored_islands() == sorted(expected)


@given(scene=nested_scenes(SIDE), least=st.integers(1, 40))
@ORDINARY
def test_small_obstacles_are_left_out_with_all_inside_them_and_counted(scene, least):
    topology = topology_of(scene, "survivor")
    masks = masks_of(topology)
    for place in range(topology.n_places):
        found = topology.encloses(place)
        inside = [Obstacle(i) for i in found.obstacles.tolist()]
        small = [x for x in inside if filled_area(masks[x]) < least - 0.5]
        lost = np.zeros(scene.classes.shape, dtype=bool)
        for obstacle in small:
            lost |= ~masks[obstacle] & _walled(masks[obstacle])
        enclosed = topology.encloses(place, least_area_m2=least - 0.5)
        expected = [
            x for x in enclosed_things(found) if x not in small and not lost[masks[x]].all()
        ]
        assert enclosed_things(enclosed) == expected
        assert enclosed.ignored == sum(not lost[masks[x]].all() for x in small)


def _walled(obstacle):
    """Cells that an obstacle surrounds for steps between 4-neighbours."""
    around = sets_of(np.pad(~obstacle, 1, constant_values=True), diagonal=False)[1:-1, 1:-1]
    return around > 0


@given(classes=st.one_of(nested_maps(SIDE), class_grids(SIDE)))
@ORDINARY
def test_obstacles_and_components_are_the_connected_sets_of_the_grid(classes):
    islands = DualGraphPyramid.build(occupancy_grid(classes)).islands
    occupied = np.pad(classes == CellClass.OCCUPIED, 1, constant_values=True)
    obstacles = sets_of(occupied, diagonal=True)[1:-1, 1:-1]
    components = sets_of(classes != CellClass.OCCUPIED, diagonal=False)
    assert np.array_equal(islands.obstacle_of, obstacles)
    assert np.array_equal(islands.component_of, components)
    for component, obstacle in enumerate(islands.surrounding_obstacle.tolist()):
        wall = obstacles == obstacle
        around = grown(components == component) & wall
        assert around.any() or obstacle == 0
        assert obstacle == 0 or _walled(wall)[components == component].all()


@each_linkage
def test_figure_1_tells_meeting_twice_from_lying_inside(linkage):
    pyramid = DualGraphPyramid.build(
        figure1_world().grid(robot_radius_m=0), merge_distance_m=np.inf, linkage=linkage
    )
    topology = TopologicalMap(pyramid)
    a, b, c = (topology.place_at(cell) for cell in ((5, 5), (5, 35), (14, 9)))
    assert sorted((a, b, c)) == [0, 1, 2]
    assert topology.classes[[a, b, c]].tolist() == [1, 2, 2]
    arcs = sorted(tuple(sorted(endpoints)) for endpoints in topology.arcs.tolist())
    assert arcs == sorted([(a, a), *2 * [tuple(sorted((a, b)))], tuple(sorted((a, c)))])
    assert topology.encloses(a).places.tolist() == [c]
    assert [topology.encloses(a).obstacles.size, topology.encloses(a).components.size] == [0, 0]
    assert [enclosed_things(topology.encloses(place)) for place in (b, c)] == [[], []]
    assert [topology.enclosed_by(place) for place in (a, b, c)] == [(), (), (a,)]
    assert topology.unexplored_islands() == [(c,)]
    # The obstacle on the line between A and B lies in neither; both together go round it.
    assert topology.enclosed_by(Obstacle(1)) == tuple(sorted((a, b)))


@each_linkage
@pytest.mark.parametrize("merge_distance_m", [80.0, 0.5])
def test_islands_in_islands_in_islands(linkage, merge_distance_m):
    rings = ["?????????", "?.......?", "?.?????.?", "?.?...?.?", "?.?.?.?.?"]
    topology = map_of(*rings, *rings[-2::-1], merge_distance_m=merge_distance_m, linkage=linkage)
    if merge_distance_m < 1:
        middle = topology.place_at((4, 4))
        assert len(topology.enclosed_by(middle)) == 8
        assert all(not enclosed_things(topology.encloses(place)) for place in range(81))
        assert len(topology.unexplored_islands()) == 2
        return
    outer, one, two, three, four = (topology.place_at((at, at)) for at in range(5))
    order = [outer, one, two, three, four]
    for at, place in enumerate(order):
        assert topology.encloses(place).places.tolist() == sorted(order[at + 1 :])
        assert topology.enclosed_by(place) == tuple(order[at - 1 : at] if at else [])
    assert topology.unexplored_islands() == sorted([(two,), (four,)])


WALLED = (
    ".............",
    ".###########.",
    ".#?????????#.",
    ".#?#######?#.",
    ".#?#..?..#?#.",
    ".#?#######?#.",
    ".#?????????#.",
    ".###########.",
    ".............",
)


@each_linkage
def test_a_room_walled_off_in_a_moat_walled_off_in_a_yard(linkage):
    topology = map_of(*WALLED, linkage=linkage)
    yard, moat = topology.place_at((0, 0)), topology.place_at((2, 2))
    left, middle, right = (topology.place_at((4, col)) for col in (4, 6, 8))
    islands = topology.pyramid.islands
    wall, inner_wall = (Obstacle(int(islands.obstacle_of[cell])) for cell in ((1, 1), (3, 3)))
    components = [Component(int(islands.component_of[at, at])) for at in (0, 2, 4)]
    inside_moat = [*sorted([left, middle, right]), inner_wall, components[2]]
    assert enclosed_things(topology.encloses(moat)) == inside_moat
    everything = sorted([moat, left, middle, right])
    assert topology.encloses(yard).places.tolist() == everything
    assert {Obstacle(i) for i in topology.encloses(yard).obstacles} == {wall, inner_wall}
    assert {Component(i) for i in topology.encloses(yard).components} == set(components[1:])
    assert [topology.enclosed_by(component) for component in components] == [(), (yard,), (moat,)]
    assert [topology.enclosed_by(obstacle) for obstacle in (wall, inner_wall)] == [(yard,), (moat,)]
    assert topology.enclosed_by([left, middle, right]) == (moat,)
    assert topology.enclosed_by(moat) == (yard,)


def test_a_part_of_a_walled_off_room_lies_inside_what_the_room_lies_in():
    topology = map_of("......", ".####.", ".#.?#.", ".####.", "......")
    yard, part, unknown = (topology.place_at(cell) for cell in ((0, 0), (2, 2), (2, 3)))
    assert topology.encloses(yard).places.tolist() == sorted([part, unknown])
    assert topology.enclosed_by(part) == (yard,)
    assert topology.enclosed_by(unknown) == (yard,)
    assert topology.unexplored_islands() == [(unknown,)]


def test_the_places_round_a_thing_are_the_nearest_even_where_one_encloses_it_alone():
    topology = map_of(".......", ".?????.", ".?..#..", ".?????.", ".......")
    yard, pocket, island = (topology.place_at(cell) for cell in ((0, 0), (2, 2), (1, 1)))
    assert topology.encloses(yard).places.tolist() == sorted([pocket, island])
    assert topology.enclosed_by(pocket) == tuple(sorted([yard, island]))
    assert topology.enclosed_by(island) == (yard,)
    assert topology.enclosed_by([island, pocket]) == (yard,)


@pytest.mark.parametrize(
    ("least_area_m2", "obstacles", "ignored"),
    [(0.0, 3, 0), (0.015, 2, 1), (0.045, 1, 2), (9, 0, 3)],
)
def test_the_least_area_is_in_square_metres(least_area_m2, obstacles, ignored):
    lines = [
        "..............",
        ".#.##.####....",
        "...##.#..#....",
        "......####....",
        "............" + "..",
    ]
    topology = map_of(*lines, resolution_m=0.1)
    place = topology.place_at((0, 0))
    enclosed = topology.encloses(place, least_area_m2=least_area_m2)
    assert (len(enclosed.obstacles), enclosed.ignored) == (obstacles, ignored)
    # The room is as large as its walls and its floor.
    assert len(enclosed.components) == (least_area_m2 < 0.1)


def test_what_a_place_in_a_small_room_encloses_does_not_count_the_room_as_small():
    topology = map_of("#####", "#...#", "#.?.#", "#...#", "#####", "#####")
    inner = map_of(".......", ".#####.", ".#...#.", ".#.?.#.", ".#...#.", ".#####.", ".......")
    for case, at in ((topology, (2, 1)), (inner, (2, 2))):
        place = case.place_at(at)
        assert case.encloses(place, least_area_m2=30.0).places.tolist() == [
            case.place_at((at[0] + 1, at[1] + 1))
        ]


def test_answers_can_be_asked_about_as_they_come():
    topology = map_of("....", ".??.", ".??.", "....")
    place = topology.place_at((0, 0))
    for inner in topology.encloses(place).places:
        assert topology.enclosed_by(inner) == (place,)
    assert topology.encloses(topology.arcs[0, 0]).places.size in {0, 1}


@pytest.mark.parametrize("thing", [-1, 2, [0, 2], [], Obstacle(2), Obstacle(-1), Component(1)])
def test_what_is_not_there_has_no_surroundings(thing):
    topology = map_of("......", ".?.#..", "......")
    with pytest.raises(InvalidValueError, match=r"(must be from 0 to|at least one place)"):
        topology.enclosed_by(thing)


@pytest.mark.parametrize("place", [-1, 2])
def test_a_place_that_is_not_there_encloses_nothing(place):
    with pytest.raises(InvalidValueError, match="place must be from 0 to 1"):
        map_of("......", ".?.#..", "......").encloses(place)


def test_places_far_apart_are_no_thing():
    topology = map_of("..........", ".?..?...?.", "..........")
    one, other = np.flatnonzero(topology.classes == CellClass.UNEXPLORED)[[0, 2]].tolist()
    with pytest.raises(InvalidValueError, match="connected"):
        topology.enclosed_by([one, other])


@pytest.mark.parametrize("least_area_m2", [float("nan"), -1.0])
def test_a_least_area_is_an_area(least_area_m2):
    with pytest.raises(InvalidValueError, match="least area"):
        map_of("...", ".#.", "...").encloses(0, least_area_m2=least_area_m2)


def test_the_rim_is_surrounded_by_nothing():
    assert map_of("#.", "..").enclosed_by(Obstacle(0)) == ()
