"""Consistency by its definition: no fault where there is none, and every planted one found."""

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest
from hypothesis import strategies as st

from hybridnav._base.moves import path_length_in_cells
from hybridnav.harness.adapters import HybridMethod
from hybridnav.harness.baselines.grid import GridAstar
from hybridnav.harness.consistency import Consistency
from hybridnav.harness.judging import Judge
from hybridnav.harness.methods import Prepared
from hybridnav.harness.scenes import Pair, sample_pairs
from hybridnav.maps import CellClass
from hybridnav.planning import Preset
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.search.grid_search import GridSearch
from hybridnav.topology import TopologicalMap
from tests.harness import faulty_methods as faulty
from tests.strategies import drawn, occupancy_grid, scenes, tried

LINKAGES = ("survivor", "radius", "diameter")

ROOMS = occupancy_grid(
    drawn(
        "###########",
        "#....#....#",
        "#.........#",
        "#....#....#",
        "#....#....#",
        "#.........#",
        "#....#....#",
        "###########",
    )
)
"""Two rooms, two doors."""

DIAGONAL = occupancy_grid(drawn("...###", "...###", "###...", "###..."))
"""Two rooms that meet at a corner, between two blocked cells."""


def topology_of(grid, merge_distance_m=4.0, linkage="radius"):
    built = DualGraphPyramid.build(grid, merge_distance_m=merge_distance_m, linkage=linkage)
    return TopologicalMap(built)


def said(fault):
    """Return the fault that a check found, an empty text for none."""
    return fault or ""


def without_arcs(topology, lost):
    table = topology.level.boundary_table
    kept = ~np.isin(table[1], lost)
    level = LevelOf(topology.level, (table[0][kept], table[1][kept]))
    field_of = topology.level.field_of
    return Consistency(
        ROOMS, field_of, topology=cast("TopologicalMap", SimpleNamespace(level=level))
    )


def consistency_of(topology):
    return Consistency(topology.grid, topology.level.field_of, topology=topology)


# --- nothing is wrong where nothing is ----------------------------------------------------------


@tried(60, scenes(max_side=16), st.sampled_from(LINKAGES))
def test_the_pyramid_is_consistent_on_any_map(scene, linkage):
    topology = topology_of(scene.grid, scene.merge_distance_m, linkage)
    checks = consistency_of(topology)
    assert checks.check_regions() == []
    method = HybridMethod(topology, Preset())
    free = scene.classes == CellClass.FREE
    whole = GridSearch(free)
    for pair in sample_pairs(scene.grid, 8, seed=scene.seed):
        answer = method.solve(pair.start, pair.goal)
        best = whole.search(pair.start, pair.goal).cells
        joined = checks.joined(pair.start, pair.goal)
        assert (answer.cells is not None) == (best is not None) == joined
        if answer.nodes is not None:
            assert checks.check_plan(pair.start, pair.goal, answer.nodes, answer.arcs) is None
            assert checks.check_plan(pair.start, pair.goal, answer.nodes, None) is None
        for path in (answer.cells, best):
            if path is not None:
                assert checks.check_walk(path) is None


@tried(40, scenes(max_side=12))
def test_regions_of_any_kind_are_judged_without_arcs(scene):
    free = scene.classes == CellClass.FREE
    alone = np.where(free, np.arange(free.size).reshape(free.shape), -1).astype(np.int32)
    checks = Consistency(scene.grid, alone)
    assert checks.check_regions() == []
    whole = GridSearch(free)
    for pair in sample_pairs(scene.grid, 4, seed=0):
        path = whole.search(pair.start, pair.goal).cells
        assert (path is not None) == checks.joined(pair.start, pair.goal)
        if path is not None:
            assert checks.check_walk(path) is None
            nodes = alone[tuple(path.T)].tolist()
            assert checks.check_plan(pair.start, pair.goal, nodes, None) is None


@pytest.mark.parametrize("lines", [["#"], ["?"], ["."], ["?#"], ["##", "##"]])
def test_maps_without_much(lines):
    topology = topology_of(occupancy_grid(drawn(*lines)))
    assert consistency_of(topology).check_regions() == []


# --- corner cutting -----------------------------------------------------------------------------


def test_cutting_corners_breaks_consistency():
    topology = topology_of(DIAGONAL)
    assert consistency_of(topology).check_regions() == []
    cutting = replace(DIAGONAL, corner_cutting=True)
    checks = Consistency(cutting, topology.level.field_of, topology=topology)
    ((text, (one, other)),) = checks.check_regions()
    assert text == "solvability: moves join two cells, regions do not"
    assert DIAGONAL.classes[one] == DIAGONAL.classes[other] == CellClass.FREE
    search = GridSearch(DIAGONAL.classes == CellClass.FREE, corner_cutting=True)
    path = search.search(one, other).cells
    assert path is not None
    assert "no edge" in said(checks.check_walk(path))


def test_a_pyramid_grown_with_corner_cutting_is_caught_too():
    cutting = replace(DIAGONAL, corner_cutting=True)
    topology = topology_of(cutting)
    judge = Judge(
        cutting, Prepared(HybridMethod(topology, Preset()), topology, 0, 0), reference=False
    )
    assert [text for text, _ in judge.region_faults] == [
        "solvability: moves join two cells, regions do not"
    ]


# --- planted faults -----------------------------------------------------------------------------


class LevelOf:
    """A level with another boundary table."""

    def __init__(self, level, boundary_table):
        self._level, self.boundary_table = level, boundary_table

    def __getattr__(self, name):
        return getattr(self._level, name)


def test_a_missing_arc_is_found():
    topology = topology_of(ROOMS, 2.5)
    region_of = topology.level.field_of
    every = np.arange(topology.n_arcs)
    checks = without_arcs(topology, every)
    ((text, cells),) = checks.check_regions()
    assert text == "solvability: moves join two cells, regions do not"
    assert region_of[cells[0]] != region_of[cells[1]]
    assert checks.joined(*cells)
    path = GridSearch(ROOMS.classes == CellClass.FREE).search((2, 1), (2, 9)).cells
    assert path is not None
    assert "no edge" in said(checks.check_walk(path))


def test_every_arc_that_is_the_only_one_is_missed():
    topology = topology_of(ROOMS, 2.5)
    region_of, arcs = topology.level.field_of, topology.arcs
    pairs = [tuple(sorted(pair)) for pair in arcs.tolist()]
    for arc in np.flatnonzero(~topology.level.is_self_loop):
        if pairs.count(pairs[arc]) == 1:
            checks = without_arcs(topology, [arc])
            base = topology.level.boundary_table[0][topology.level.boundary_table[1] == arc][0]
            cell, step = base >> 1, (ROOMS.shape[1] if base & 1 else 1)
            path = np.array([divmod(cell, ROOMS.shape[1]), divmod(cell + step, ROOMS.shape[1])])
            assert f"{region_of[tuple(path[0])]}" in said(checks.check_walk(path))


def test_a_plan_through_an_arc_of_another_door_is_found():
    topology = topology_of(ROOMS, 2.5)
    method = HybridMethod(topology, Preset())
    checks = consistency_of(topology)
    answer = method.solve((2, 1), (2, 9))
    assert answer.nodes is not None
    assert answer.arcs
    assert checks.check_plan((2, 1), (2, 9), answer.nodes, answer.arcs) is None
    for at in range(len(answer.arcs)):
        wrong = list(answer.arcs)
        wrong[at] = next(
            arc
            for arc in range(topology.n_arcs)
            if set(topology.arcs[arc]) != set(topology.arcs[wrong[at]])
        )
        assert f"step {at} of the plan" in said(
            checks.check_plan((2, 1), (2, 9), answer.nodes, wrong)
        )


def test_a_plan_out_of_order_is_found():
    topology = topology_of(ROOMS, 1.5)
    checks = consistency_of(topology)
    nodes = HybridMethod(topology, Preset()).solve((2, 1), (2, 9)).nodes
    assert nodes is not None
    assert len(nodes) > 3
    endpoints = (2, 1), (2, 9)
    assert "no metric path" in checks.check_plan(
        *endpoints, (nodes[0], *nodes[-2:0:-1], nodes[-1]), None
    )
    assert "no metric path" in said(checks.check_plan(*endpoints, (nodes[0], nodes[-1]), None))
    assert "does not start and end" in said(checks.check_plan(*endpoints, nodes[::-1], None))
    assert "does not start and end" in said(checks.check_plan(*endpoints, nodes[:-1], None))
    # A region that there is not, of whose number and another's that of a pair could be made.
    count = int(topology.level.field_of.max()) + 1
    for unknown in (-1, count, *range(count + 1, 3 * count)):
        plan = (nodes[0], unknown, nodes[-1])
        assert "which there is not" in said(checks.check_plan(*endpoints, plan, None))


def test_a_plan_through_the_wrong_piece_of_a_torn_region_is_found():
    # Region 0 is both endpoints of a corridor, region 1 its middle.
    grid = occupancy_grid(drawn("......."))
    region_of = np.array([[0, 0, 1, 1, 1, 0, 0]], dtype=np.int32)
    checks = Consistency(grid, region_of)
    assert [text for text, _ in checks.check_regions()] == [
        "region 0, and maybe others, is not connected"
    ]
    assert "cannot be reached" in said(checks.check_plan((0, 0), (0, 6), (0,), None))
    assert checks.check_plan((0, 0), (0, 6), (0, 1, 0), None) is None


def test_free_cells_without_a_region_are_found():
    region_of = np.array([[0, 0, -1]], dtype=np.int32)
    grid = occupancy_grid(drawn("..."))
    checks = Consistency(grid, region_of)
    assert checks.check_regions() == [("1 free cells are in no region", ((0, 2), (0, 2)))]
    assert checks.check_walk(np.array([(0, 1), (0, 2)])) == "the path leaves the regions"


def test_a_region_over_two_rooms_that_nothing_joins_is_found():
    grid = occupancy_grid(drawn("..#.."))
    checks = Consistency(grid, np.array([[0, 0, -1, 0, 0]], dtype=np.int32))
    texts = [text for text, _ in checks.check_regions()]
    assert texts == [
        "region 0, and maybe others, is not connected",
        "solvability: regions join two cells, moves do not",
    ]


@pytest.mark.parametrize(
    ("method", "words"),
    [
        (faulty.ThroughWall, "not free"),
        (faulty.TooLong, "the optimum by scipy is"),
        (faulty.Jumps, "does not go to a neighbour"),
        (faulty.CutsCorners, "cuts a corner"),
    ],
)
def test_a_reference_with_a_fault_is_caught_by_what_it_does_not_share(method, words):
    pair = Pair((6, 4), (4, 6))
    judge = Judge(ROOMS, Prepared(method(ROOMS), None, 0, 0), reference=True)
    answer = method(ROOMS).solve(pair.start, pair.goal)
    length_m, faults, _ = judge.faults(pair, answer)
    known, wrong = judge.oracles(answer, pair, length_m)
    assert any(words in text for text in [*(fault.text for fault in faults), *wrong])
    assert known["scipy_optimum_m"] == pytest.approx(4.0)


def test_a_false_optimum_of_a_scenario_is_caught():
    method = faulty.Sound(ROOMS)
    judge = Judge(ROOMS, Prepared(method, None, 0, 0), reference=True)
    for stated, wrong in ((4.0, []), (4.004, []), (4.01, [1]), (3.9, [1]), (0.0, [1])):
        pair = Pair((6, 4), (4, 6), "scenario", stated)
        answer = method.solve(pair.start, pair.goal)
        length_m, faults, _ = judge.faults(pair, answer)
        assert not faults
        assert len(judge.oracles(answer, pair, length_m)[1]) == len(wrong)


def test_a_reference_that_finds_no_path_where_there_is_one_is_caught():
    pair = Pair((6, 4), (4, 6))
    method = faulty.MissingDoor(ROOMS)
    answer = method.solve(pair.start, pair.goal)
    assert answer.cells is None
    judge = Judge(ROOMS, Prepared(method, None, 0, 0), reference=True)
    length_m, faults, _ = judge.faults(pair, answer)
    assert faults == [("no path", "solvability: no path, but on the whole grid: solved")]
    assert judge.oracles(answer, pair, length_m)[1] == [
        "the optimum by scipy is 4.000000 m, not inf m"
    ]


class Held(GridAstar):
    """A method of one's own that holds something until it is closed."""

    is_held = True

    def close(self):
        self.is_held = False


def test_whatever_method_has_something_to_close_is_closed():
    method = Held(ROOMS)
    Prepared(method, None, 0, 0).close()
    assert not method.is_held
    Prepared(GridAstar(ROOMS), None, 0, 0).close()


@tried(60, scene=scenes(max_side=9), seed=st.integers(0, 10**6))
def test_the_shortest_path_in_order_is_that_of_all_walks(scene, seed) -> None:
    grid = scene.grid
    free = np.argwhere(grid.classes == CellClass.FREE)
    if not len(free):
        return
    topology = topology_of(grid, scene.merge_distance_m)
    region_of = np.where(grid.classes == CellClass.FREE, topology.level.field_of, -1)
    checks = Consistency(grid, region_of.astype(np.int32))
    rng = np.random.default_rng(seed)
    start, goal = (tuple(cell) for cell in rng.choice(free, 2).tolist())
    found = GridSearch(grid.classes == CellClass.FREE).search(start, goal)
    if found.cells is None:
        return
    passed = region_of[tuple(found.cells.T)].tolist()
    nodes = [one for one, before in zip(passed, [-1, *passed], strict=False) if one != before]
    # The path itself passes them so: nothing is shorter.
    optimum = path_length_in_cells(found.cells)
    assert checks.shortest_in_order(start, goal, nodes) == pytest.approx(optimum)
    # Another walk: back to where one came from, and on; by Bellman and Ford.
    walk = [*nodes[:2], *nodes] if len(nodes) > 1 else nodes
    assert checks.shortest_in_order(start, goal, walk) == pytest.approx(
        bellman_ford(grid, region_of, start, goal, walk)
    )


def bellman_ford(grid, region_of, start, goal, walk):
    """The least length by relaxing all steps until none gets shorter."""
    least = {(0, start): 0.0}
    steps = [(dr, dc) for dr in (-1, 0, 1) for dc in (-1, 0, 1) if dr or dc]
    free = {tuple(cell) for cell in np.argwhere(grid.classes == CellClass.FREE).tolist()}
    is_changed = True
    while is_changed:
        is_changed = False
        for (stage, (row, col)), length in list(least.items()):
            for dr, dc in steps:
                there = (row + dr, col + dc)
                if not {there, (row, col + dc), (row + dr, col)} <= free:
                    continue
                for later in (stage, stage + 1):
                    if later == len(walk) or region_of[there] != walk[later]:
                        continue
                    reached = length + math.hypot(dr, dc)
                    if reached < least.get((later, there), math.inf) - 1e-12:
                        least[later, there] = reached
                        is_changed = True
    return least.get((len(walk) - 1, goal), math.inf)


def test_a_sequence_with_no_path_has_an_infinite_length() -> None:
    topology = topology_of(ROOMS, 2.0)
    checks = Consistency(ROOMS, np.where(ROOMS.classes == 1, topology.level.field_of, -1))
    far = topology.level.field_of[1, 9]
    assert (
        checks.shortest_in_order((1, 1), (1, 9), [topology.level.field_of[1, 1], far]) == math.inf
    )
