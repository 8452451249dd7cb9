"""Alternatives by homotopy: other sides of obstacles, not the same route by other cells, and not
round and round."""

import gc
import math
import time
import weakref
from dataclasses import replace
from functools import partial
from typing import Any, cast

import numba
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

import hybridnav as hn
from hybridnav.ext.classes import AlternativeSearch, alternative_search, search
from hybridnav.ext.classes.kernels import classes as _class_kernels
from hybridnav.ext.classes.kernels import trees as _tree_kernels
from hybridnav.harness.judges import judge_path
from hybridnav.maps import CellClass
from hybridnav.route import RouteFinder
from tests.oracle.rays import Rays
from tests.planner.test_named_plans import map_file  # noqa: F401 - the fixture
from tests.strategies import class_grids, drawn, occupancy_grid

by_homotopy = partial(hn.plan_alternatives, by="homotopy")

TWO_DOORS = drawn(
    "##############",
    "#.....##.....#",
    "#............#",
    "#.....##.....#",
    "#.....##.....#",
    "#.....##.....#",
    "#............#",
    "#.....##.....#",
    "##############",
)


def topology_of(classes, merge_distance_m=2.0, **frame):
    grid = occupancy_grid(classes, **frame)
    return hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m))


def planner_of(classes, preset="grid-astar", **frame):
    return hn.HybridPlanner(topology_of(classes, **frame), preset=preset)


def rows_crossed(alternatives):
    """The row in which each path passes the wall."""
    return [
        {int(row) for row, col in alternative.path.cells if col in {6, 7}}
        for alternative in alternatives
    ]


@pytest.mark.parametrize("preset", ["grid-astar", "shortest", "octile", "paper"])
def test_the_second_route_takes_the_other_door(preset):
    found = by_homotopy(planner_of(TWO_DOORS, preset), (1.5, 1.5), (12.5, 2.5), 3)
    assert rows_crossed(found) == [{2}, {6}]
    assert found[0].path.length_m < found[1].path.length_m
    assert found[0].word != found[1].word


def test_a_hole_that_is_too_small_makes_no_second_route():
    found = by_homotopy(planner_of(TWO_DOORS), (1.5, 1.5), (12.5, 2.5), 3, least_hole_m2=6.5)
    assert rows_crossed(found) == [{2}]


def test_without_a_path_there_are_no_alternatives():
    walled = TWO_DOORS.copy()
    walled[:, 6] = 0
    assert len(by_homotopy(planner_of(walled), (1.5, 1.5), (12.5, 2.5), 3)) == 0


@pytest.mark.parametrize("count", [0, 21, 2.5, "3", None])
def test_counts_out_of_range_are_refused(count):
    with pytest.raises(hn.errors.InvalidValueError, match="from 1 to 20"):
        by_homotopy(planner_of(TWO_DOORS), (1.5, 1.5), (12.5, 2.5), count)


def test_a_search_that_gives_up_says_so_and_starts_with_a_shortest_path():
    endpoints = (1.5, 1.5), (12.5, 6.5)
    planner = planner_of(TWO_DOORS, "paper", merge_distance_m=6.0)
    optimum = planner_of(TWO_DOORS).plan(*endpoints).cost
    whole = by_homotopy(planner, *endpoints, 3)
    assert whole.complete
    assert len(whole) == 2
    for room in (1, 20, 100):
        found = by_homotopy(planner, *endpoints, 3, most_states=room)
        assert not found.complete
        assert found[0].path.length_m == pytest.approx(optimum)
        assert [other.word for other in found] == [other.word for other in whole][: len(found)]
    assert by_homotopy(planner, *endpoints, 1, most_states=100).complete


@pytest.mark.parametrize("seconds", [0, -1.0, math.nan, "3"])
def test_a_time_limit_that_is_no_limit_is_refused(seconds):
    with pytest.raises(
        hn.errors.InvalidValueError, match="a number of seconds above 0: leave it out"
    ):
        by_homotopy(planner_of(TWO_DOORS), (1.5, 1.5), (12.5, 2.5), 2, time_limit_s=seconds)


def test_a_search_stops_in_time_with_a_shortest_path(monkeypatch):
    """The clock strikes after some slices: what was found by then is kept."""
    classes = np.ones((40, 40), np.uint8)
    classes[2:38:3, 2:38:3] = 0
    planner = planner_of(classes, merge_distance_m=30.0)
    ends = (0.5, 0.5), (39.5, 39.5)
    whole = by_homotopy(planner, *ends, 20)
    assert whole.complete
    looks = iter(range(10**6))
    monkeypatch.setattr("hybridnav.ext.classes.search.perf_counter", lambda: float(next(looks)))
    late = by_homotopy(planner, *ends, 20, time_limit_s=2.5, most_states=1 << 22)
    assert late.complete is False
    assert late.note == "the search stopped after 2.5 s (time_limit_s): there may be more"
    assert 1 <= len(late) < 20
    for other, known in zip(late, whole, strict=False):
        assert other.path.length_m == pytest.approx(known.path.length_m)


def test_no_time_limit_counts_the_compilation_of_kernels(monkeypatch):
    """Each kernel has met the types of its arguments before the clock is looked at."""
    clocks = ("hybridnav.ext.classes.alternatives", "hybridnav.ext.classes.search")
    names = {
        _class_kernels: ("begin", "find_classes", "path_to"),
        _tree_kernels: ("word_at",),
        search: ("field_distances", "legal_moves"),
    }
    ready: set[Any] = set()
    late: set[Any] = set()
    looks: list[float] = []

    def noted(kernel, name):
        def call(*arguments):
            call_types = (name, *map(numba.typeof, arguments))
            (late if looks else ready).add(call_types)
            return kernel(*arguments)

        return call

    def clock():
        looks.append(time.monotonic())
        return looks[-1]

    planner = planner_of(TWO_DOORS)
    for module, of_module in names.items():
        for name in of_module:
            monkeypatch.setattr(module, name, noted(getattr(module, name), name))
    for where in clocks:
        monkeypatch.setattr(f"{where}.perf_counter", clock)
    assert len(by_homotopy(planner, (1.5, 1.5), (12.5, 2.5), 3)) == 2
    assert {name for name, *_ in late} == {name for each in names.values() for name in each}
    assert late <= ready


@pytest.mark.parametrize("most_states", [0, -1, 1 << 27])
def test_a_search_of_no_or_too_many_states_is_refused(most_states):
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"expected a whole number from 1 to \d+: leave it out"
    ):
        by_homotopy(planner_of(TWO_DOORS), (1.5, 1.5), (12.5, 2.5), 2, most_states=most_states)


def test_the_search_on_a_map_is_kept_while_the_map_is():
    topology = topology_of(TWO_DOORS)
    first = alternative_search(topology)
    assert alternative_search(topology, least_hole_m2=1) is first
    assert alternative_search(topology_of(TWO_DOORS)) is not first
    others = [alternative_search(topology, least_hole_m2=area) for area in (2.0, 7.0)]
    others.append(alternative_search(topology, allow_unexplored=True))
    assert len({id(search) for search in (first, *others)}) == 4
    gone = weakref.ref(others[1])
    del first, others, topology
    gc.collect()
    assert gone() is None


def test_one_obstacle_has_two_sides_and_no_turns_round_it():
    """However often a route goes round a pillar: the classes of such turns are without end."""
    classes = np.ones((15, 25), np.uint8)
    classes[6:9, 11:14] = 0
    planner = planner_of(classes, merge_distance_m=300.0)
    assert planner.topology.n_places == 1
    found = by_homotopy(planner, (1.5, 6.5), (23.5, 6.5), 20)
    assert len(found) == 2
    assert {min(a.path.cells[:, 0].max(), 9) for a in found} == {6, 9}


def test_no_route_goes_into_a_room_round_a_table_and_out_again():
    """Cells of a quarter of a metre; the door is three of them wide, the table 2 m long."""
    classes = np.zeros((30, 40), np.uint8)
    classes[1:8, 1:39] = 1
    classes[10:29, 5:35] = 1
    classes[8:10, 18:21] = 1
    classes[16:22, 16:24] = 0
    planner = planner_of(classes, resolution_m=0.25)
    assert len(by_homotopy(planner, (0.4, 0.4), (9.6, 0.4), 5)) == 1
    inside = by_homotopy(planner, (0.4, 0.4), (5.0, 7.0), 5)
    assert len(inside) == 2


def test_between_points_of_a_room_with_one_door_the_search_soon_knows_that_there_is_no_more():
    """Beyond the door are a hundred pillars; the paths round them would take hours to list."""
    classes = np.ones((31, 45), np.uint8)
    classes[2:30:3, 15:44:3] = 0
    classes[:, 12] = 0
    classes[15, 12] = 1
    found = AlternativeSearch(topology_of(classes)).paths((3, 2), (28, 9), 3, most_states=5000)
    assert found.complete
    assert len(found.paths) == 1


def any_two(classes, seed):
    free = np.argwhere(classes == CellClass.FREE)
    if len(free) == 0:
        return None
    endpoints = np.random.default_rng(seed).choice(free, 2).tolist()
    return tuple(endpoints[0]), tuple(endpoints[1])


@given(classes=class_grids(20), seed=st.integers(0, 2**32 - 1))
def test_alternatives_are_legal_paths_of_different_classes_the_optimum_first(classes, seed):
    endpoints = any_two(classes, seed)
    if endpoints is None:
        return
    planner = planner_of(classes)
    grid = planner.grid
    points = grid.frame.points_of(endpoints)
    best = planner.plan(*points)
    found = by_homotopy(planner, points[0], points[1], 4, least_hole_m2=0.0)
    assert bool(found) == best.solved
    if found:
        assert found[0].path.length_m == pytest.approx(best.cost)
    rays = Rays(classes == CellClass.FREE, 1)
    assert len({rays.word_of(other.path.cells) for other in found}) == len(found)
    assert len({other.word for other in found}) == len(found)
    lengths = [other.path.length_m for other in found]
    assert lengths == pytest.approx(sorted(lengths))
    for other in found:
        verdict = judge_path(grid, other.path.cells, start=endpoints[0], goal=endpoints[1])
        assert verdict.faults == ()
        assert verdict.length_m == pytest.approx(other.path.length_m)


def crowded_map(rng):
    """A little map with walls and pillars, all free cells of one piece more often than not."""
    classes = np.ones(rng.integers(5, 10, 2), np.uint8)
    for _ in range(rng.integers(1, 6)):
        row, col = (int(rng.integers(0, side)) for side in classes.shape)
        classes[row : row + rng.integers(1, 4), col : col + rng.integers(1, 4)] = 0
    return classes


@pytest.mark.parametrize(("resolution_m", "least_hole_m2", "apart"), [(1, 0, 1), (0.5, 1, 2)])
def test_no_shorter_class_that_does_not_wind_is_left_out(resolution_m, least_hole_m2, apart):
    """Against all pairs of a cell and a word of rays, and all shortest paths of every class."""
    rng = np.random.default_rng(apart)
    compared = wound = 0
    for number in range(2500):
        if number >= 250 and wound > 5:  # one class in 40 winds where few holes count
            break
        classes = crowded_map(rng)
        endpoints: Any = any_two(classes, rng.integers(2**32))
        if endpoints is None:
            continue
        topology = topology_of(classes, 2.0 * resolution_m, resolution_m=resolution_m)
        found = AlternativeSearch(topology, least_hole_m2=least_hole_m2).paths(
            endpoints[0], endpoints[1], 4
        )
        rays = Rays(classes == CellClass.FREE, max(least_hole_m2 / resolution_m**2, 1))
        offered = {rays.word_of(path.cells): path for path in found.paths}
        assert found.complete
        assert len(offered) == len(found.paths)
        if not offered:
            continue
        shortest = found.paths[0].length_cells
        reach = max(1, min(apart, int(shortest / 2)))
        for path in found.paths:
            assert not rays.winds(list(map(tuple, path.cells.tolist())), reach)
        # Where fewer came than asked for, there is nothing more up to far longer.
        full = len(offered) == 4
        longest = found.paths[-1].length_cells - 1e-6 if full else shortest + 12
        classes_there = rays.shortest_paths(endpoints[0], endpoints[1], longest, most=200)
        for word, (length, paths) in classes_there.items():
            if word in offered:
                assert offered[word].length_cells >= length - 1e-9
            if paths is None:
                continue
            winding = [rays.winds(path, reach) for path in paths]
            wound += all(winding)
            if not any(winding):
                assert offered[word].length_cells == pytest.approx(length)
                compared += 1
    assert compared > 200
    assert wound > 5


def test_start_and_goal_in_one_cell_have_one_path():
    found = by_homotopy(planner_of(TWO_DOORS), (1.5, 1.5), (1.6, 1.6), 3)
    assert [other.path.length_m for other in found] == [0.0]


CORNERS = drawn(
    "......",
    ".##.#.",
    ".#.#..",
    "......",
)


def test_grids_with_corner_cutting_have_walks_and_no_alternatives():
    grid = replace(occupancy_grid(CORNERS), corner_cutting=True)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=1.5))
    with pytest.raises(hn.errors.InvalidValueError, match="corner cutting"):
        AlternativeSearch(topology)
    walks = RouteFinder(topology)
    free = np.argwhere(CORNERS == CellClass.FREE)
    planner = hn.HybridPlanner(topology, preset="octile")
    pinched = 0
    for start in free:
        for goal in free:
            path = planner.plan(*grid.frame.points_of([start, goal])).path
            assert path is not None
            cells = path.cells
            places, arcs = walks.of(cells)
            assert len(arcs) == len(places) - 1
            assert [places[0], places[-1]] == [topology.place_at(tuple(c)) for c in cells[[0, -1]]]
            for arc, tail, head in zip(arcs, places, places[1:], strict=False):
                pinched += arc == -1
                assert arc == -1 or set(topology.arcs[arc].tolist()) == {tail, head}
    assert pinched


def test_walks_know_their_arcs_on_maps_of_one_column():
    topology = topology_of(np.ones((9, 1), np.uint8), 1.5)
    places, arcs = RouteFinder(topology).of(np.column_stack([np.arange(9), np.zeros(9, int)]))
    assert len(places) == topology.n_places > 1
    for arc, tail, head in zip(arcs, places, places[1:], strict=False):
        assert set(topology.arcs[arc].tolist()) == {tail, head}


def test_a_preset_with_ompl_is_refused(cli, map_file):  # noqa: F811
    pytest.importorskip("ompl")
    planner = planner_of(TWO_DOORS, "ompl")
    with pytest.raises(hn.errors.InvalidValueError, match="without OMPL"):
        by_homotopy(planner, (1.5, 1.5), (12.5, 2.5), 2)
    query: tuple[Any, ...] = (
        "plan",
        map_file,
        "--from",
        "kitchen",
        "--to",
        "lab",
        "--by",
        "homotopy",
    )
    query += ("--alternatives", "2")
    assert cli(*query, "--preset", "ompl").refuses(2, "without OMPL")


def test_the_command_line_lists_alternatives(cli, map_file):  # noqa: F811
    query: tuple[Any, ...] = (
        "plan",
        map_file,
        "--from",
        "kitchen",
        "--to",
        "lab",
        "--robot-radius",
        "0",
    )
    query += ("--by", "homotopy")
    done = cli(*query, "--alternatives", "3", "--at", "point")
    assert done.code == 0
    passed = "by kitchen (door 1), hall (door 2), lab"
    assert f"route 1    7.41 m (octile), {passed}" in done.out
    assert "route 2" not in done.out
    assert "routes     1 of 3: no other path passes an obstacle on another side" in done.out
    nearest = cli(*query, "--alternatives", "3")
    assert f"route 1    4.00 m (octile), {passed}" in nearest.out
    answer = cli(*query, "--alternatives", "3", "--json").answer
    assert [len(route["points"]) > 1 for route in answer["alternatives"]] == [True]
    assert cli(*query, "--alternatives", "0").code == 2
    assert cli(*query, "--alternatives", "2", "--via", "hall").refuses(2, "--via")
    assert cli(*query, "--alternatives", "2", "--by", "words").refuses(2, "doors or homotopy")


@pytest.fixture
def two_doors_file(tmp_path):
    pixels = np.where(TWO_DOORS[::-1] == 0, 0, 254).astype(np.uint8)
    Image.fromarray(pixels).save(tmp_path / "doors.pgm")
    path = tmp_path / "doors.yaml"
    path.write_text(
        "image: doors.pgm\nresolution: 1.0\norigin: [0, 0, 0]\n"
        "negate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    return path


def test_the_command_line_leads_through_either_door(cli, two_doors_file):
    endpoints = ("--start", "1.5,1.5", "--goal", "12.5,2.5")
    query: tuple[Any, ...] = (
        "plan",
        two_doors_file,
        *endpoints,
        "--robot-radius",
        "0",
        "--alternatives",
        "3",
    )
    query += ("--by", "homotopy")
    done = cli(*query)
    assert "class" not in done.out
    lines = [line for line in done.out.splitlines() if line.startswith("route ")]
    # Ten straight steps and one diagonal; and up to the other door and down again.
    lengths = [10 + math.sqrt(2), 4 + 5 * math.sqrt(2) + 2 + 4 * math.sqrt(2)]
    assert len(lines) == 2
    assert lines[0].startswith(f"route 1    {lengths[0]:.2f} m (octile)")
    routes = cli(*query, "--json").answer["alternatives"]
    ways = [[y for x, y in route["points"] if 6 < x < 8] for route in routes]
    assert [set(way) for way in ways] == [{2.5}, {6.5}]
    assert routes[0]["word"] != routes[1]["word"]
    small = cli(*query, "--least-hole", "7").out
    assert "route 1" in small
    assert "route 2" not in small


def test_the_command_line_states_that_the_search_stopped(cli, two_doors_file, monkeypatch):
    endpoints = ("--start", "1.5,1.5", "--goal", "12.5,2.5")
    query: tuple[Any, ...] = (
        "plan",
        two_doors_file,
        *endpoints,
        "--robot-radius",
        "0",
        "--alternatives",
        "3",
    )
    query += ("--by", "homotopy")
    assert "may be more" not in cli(*query).out
    assert cli(*query, "--json").answer["alternatives_complete"] is True
    limits: dict[str, tuple[Any, str]] = {
        "most_states": (100, "100 states"),
        "time_limit_s": (1e-9, "1e-09 s"),
    }
    whole = hn.plan_alternatives
    monkeypatch.setattr("hybridnav.ext.classes.search._SLICE", 8)
    for name, (limit, shown) in limits.items():
        monkeypatch.setattr(hn, "plan_alternatives", partial(whole, **cast("Any", {name: limit})))
        told = f"routes     the search stopped after {shown} ({name}): there may be more\n"
        assert told in cli(*query).out
        answer = cli(*query, "--json").answer
        assert answer["alternatives_complete"] is False
        assert "stopped" in answer["alternatives_note"]
