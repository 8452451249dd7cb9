"""Alternatives: other doors and other sides of obstacles, never the same way by other cells."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.grid import CellClass
from hybridnav.metrics import judge_path
from hybridnav.route.alternatives import AlternativeSearch
from tests.strategies import class_grids, drawn, occupancy_grid
from tests.test_cli import cli  # noqa: F401 - the fixture
from tests.test_named_plans import map_file  # noqa: F401 - the fixture

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


def planner_of(classes, merge_distance_m=2.0):
    pyramid = hn.DualGraphPyramid.build(occupancy_grid(classes), merge_distance_m=merge_distance_m)
    return hn.HybridPlanner(hn.TopologicalMap(pyramid), preset="grid-astar")


def rows_crossed(alternatives):
    """The row in which each path passes the wall."""
    return [
        {int(row) for row, col in alternative.path.cells if col in {6, 7}}
        for alternative in alternatives
    ]


def test_the_second_route_takes_the_other_door():
    found = hn.plan_alternatives(planner_of(TWO_DOORS), (1.5, 1.5), (12.5, 2.5), 3)
    assert rows_crossed(found) == [{2}, {6}]
    assert found[0].path.length_m < found[1].path.length_m
    assert found[0].word != found[1].word


def test_a_hole_that_is_too_small_makes_no_second_route():
    found = hn.plan_alternatives(
        planner_of(TWO_DOORS), (1.5, 1.5), (12.5, 2.5), 3, least_hole_m2=6.5
    )
    assert rows_crossed(found) == [{2}]


def test_without_a_path_there_are_no_alternatives():
    walled = TWO_DOORS.copy()
    walled[:, 6] = 0
    assert hn.plan_alternatives(planner_of(walled), (1.5, 1.5), (12.5, 2.5), 3) == []


@pytest.mark.parametrize("count", [0, 21])
def test_counts_out_of_range_are_refused(count):
    with pytest.raises(hn.InvalidValueError, match="from 1 to 20"):
        hn.plan_alternatives(planner_of(TWO_DOORS), (1.5, 1.5), (12.5, 2.5), count)


@given(classes=class_grids(20), seed=st.integers(0, 2**32 - 1))
def test_alternatives_are_legal_paths_of_different_classes_the_optimum_first(classes, seed):
    free = np.argwhere(classes == CellClass.FREE)
    if len(free) == 0:
        return
    start, goal = np.random.default_rng(seed).choice(free, 2)
    planner = planner_of(classes)
    grid = planner.topology.grid
    ends = grid.frame.points_of([start, goal])
    best = planner.plan(*ends)
    found = hn.plan_alternatives(planner, ends[0], ends[1], 4, least_hole_m2=0.0)
    assert bool(found) == best.solved
    if found:
        assert found[0].path.length_m == pytest.approx(best.cost)
    words = [alternative.word for alternative in found]
    lengths = [alternative.path.length_m for alternative in found]
    assert len(set(words)) == len(words)
    assert lengths == sorted(lengths)
    for alternative in found:
        cells = alternative.path.cells
        verdict = judge_path(grid, cells, start=tuple(start.tolist()), goal=tuple(goal.tolist()))
        assert verdict.faults == ()
        assert verdict.length_m == pytest.approx(alternative.path.length_m)


@given(classes=class_grids(16), seed=st.integers(0, 2**32 - 1))
def test_routes_come_out_by_length_and_no_class_twice(classes, seed):
    topology = planner_of(classes, 1.5).topology
    free = np.flatnonzero(topology.classes == CellClass.FREE)
    if len(free) == 0:
        return
    start, goal = np.random.default_rng(seed).choice(free, 2).tolist()
    search = AlternativeSearch(topology, least_hole_m2=0.0)
    routes = [route for route, _ in zip(search.routes(start, goal), range(8), strict=False)]
    lengths = [route.length_m for route in routes]
    assert lengths == pytest.approx(sorted(lengths))
    assert len({route.word for route in routes}) == len(routes)
    for route in routes:
        assert len(set(route.places)) == len(route.places)
        assert route.word == search.classes.word_of_route(start, route.arcs, topology.arcs)
        assert sum(topology.level.through_m[list(route.arcs)]) == pytest.approx(route.length_m)


def test_the_command_line_lists_alternatives(cli, map_file):  # noqa: F811
    query = ("plan", map_file, "--from", "kitchen", "--to", "lab", "--robot-radius", "0")
    done = cli(*query, "--alternatives", "3")
    assert done.code == 0
    assert "route 1    4.00 m, class -, by kitchen (door 1), hall (door 2), lab" in done.out
    assert "route 2" not in done.out
    answer = cli(*query, "--alternatives", "3", "--json").answer
    assert [len(route["points_m"]) > 1 for route in answer["alternatives"]] == [True]
    assert cli(*query, "--alternatives", "0").code == 2
    assert cli(*query, "--alternatives", "2", "--via", "hall").refuses(2, "--via")
