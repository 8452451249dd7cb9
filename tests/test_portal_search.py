"""Paths over portals, and their bounds, against scipy's Dijkstra on the legal moves."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hybridnav.grid.worlds import figure1_world, office_world
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.route import portal_search
from hybridnav.route._first_way_kernels import side_costs, weigh_sides
from hybridnav.route._portal_kernels import FAR
from hybridnav.route.portal_search import PortalSearch
from hybridnav.search._costs import DIAGONAL, STRAIGHT
from hybridnav.search.grid_search import GridSearch
from hybridnav.topology import TopologicalMap
from tests.divided import Divided, costs_from, partitions, pieces_of
from tests.oracle.grid import assert_legal, centre, moves, recounted
from tests.strategies import MAX_SIDE, drawn, occupancy_grid, scenes

if TYPE_CHECKING:
    from hybridnav.route.portal_search import Effort, PortalAnswer
    from tests.strategies import Scene

EFFORTS: tuple[Effort, ...] = ("stored", "narrow", "wide")
EPSILONS = (0.0, 0.0, 0.01, 0.1, 1.0)
GATES = ("all", "few", "sparse")

SHORT_CELLS = 256


def cost_of(cells: Any) -> int:
    straight, diagonal = moves(cells)
    return straight * STRAIGHT + diagonal * DIAGONAL


def length_of(cost: float) -> float:
    """Length of an integer cost: `b` diagonals are what is left of it modulo a straight move."""
    diagonal = int(cost) * pow(DIAGONAL, -1, STRAIGHT) % STRAIGHT
    return (int(cost) - diagonal * DIAGONAL) // STRAIGHT + diagonal * math.sqrt(2)


class Judge:
    """A search over portals and the searches that it is judged by.

    Paths may cross at all border cells, only at those beside sources ("few"), or, as where the
    others would take too much memory, once in each square of a lattice ("sparse").
    """

    def __init__(self, divided: Divided, gates: str = "all") -> None:
        """Route on the very fields of a partition, with its spacings."""
        topology: Any = SimpleNamespace(grid=divided.grid)
        level = SimpleNamespace(field_of=divided.field_of)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(portal_search, "_routing_levels", lambda _: [level])
            patch.setattr(portal_search, "SPACINGS", (*divided.spacings, 1))
            limit = -1 if gates == "sparse" else math.inf
            patch.setattr(portal_search, "LEAST_BYTES", limit)
            if gates == "sparse":
                patch.setattr(portal_search, "SPARSE_SPACINGS", (divided.spacings[1],))
                patch.setattr(portal_search, "MAX_BYTES_PER_CELL", limit)
                patch.setattr(portal_search, "MAX_SPARSE_BYTES_PER_CELL", math.inf)
            self._set(divided, topology, gates)

    @classmethod
    def of(cls, topology: TopologicalMap, gates: str = "all") -> Judge:
        """Route on the fields that the search itself chooses."""
        judge = cls.__new__(cls)
        fields = next(iter(portal_search._routing_levels(topology))).field_of
        with pytest.MonkeyPatch.context() as patch:
            if gates == "sparse":
                patch.setattr(portal_search, "LEAST_BYTES", 0)
                patch.setattr(portal_search, "MAX_BYTES_PER_CELL", 0)
            judge._set(Divided(topology.grid, fields), topology, gates)
        return judge

    def _set(self, divided: Divided, topology: Any, gates: str) -> None:
        self.divided = divided
        corners, entered = divided.grid.corner_cutting, divided.allow_unexplored
        self.cell_search = GridSearch(divided.free, corner_cutting=corners)
        self.search = PortalSearch(
            topology, self.cell_search, all_gates=gates != "few", allow_unexplored=entered
        )
        assert self.search.is_exact == (gates == "all")
        self.free = np.argwhere(divided.free)
        self.label = divided.label.reshape(divided.grid.shape).astype(np.int32)

    def flat(self, cell: Any) -> int:
        """Number of a cell, row by row."""
        return int(cell[0]) * self.divided.grid.shape[1] + int(cell[1])

    def judge(self, start: Any, goals: Any, rng: np.random.Generator) -> None:
        """Judge ways from one cell to some others, with all efforts."""
        costs = costs_from(self.divided.moves, np.array([self.flat(start)]))[0]
        for goal in goals:
            optimum = costs[self.flat(goal)]
            epsilon = float(rng.choice(EPSILONS))
            found = {}
            for effort in EFFORTS:
                answer = self.search.path(tuple(start), tuple(goal), effort=effort, epsilon=epsilon)
                found[effort] = self.judge_answer(answer, start, goal, optimum)
                if math.isinf(optimum):
                    continue
                # Short ways are improved on the whole map, but for epsilon.
                if answer.length_cells < SHORT_CELLS and (epsilon == 0 or effort == "stored"):
                    assert found[effort] == optimum
                elif effort == "narrow" and epsilon == 0:
                    assert found[effort] == self.best_in_fields(answer, start, goal)
                if effort == "wide":
                    most = (1 + epsilon) * answer.lower_bound_cells
                    assert answer.length_cells <= most * (1 + 1e-9)
            if epsilon == 0:
                assert found["wide"] == optimum
                assert answer.lower_bound_cells in {answer.length_cells, math.inf}

    def judge_answer(self, answer: PortalAnswer, start: Any, goal: Any, optimum: float) -> float:
        """A legal path between the ends where there is one, its points, and its bound."""
        if math.isinf(optimum):
            assert answer.cells is None
            assert answer.points.shape == (0, 2)
            assert answer.length_cells == answer.lower_bound_cells == math.inf
            return math.inf
        cells, grid, free = answer.cells, self.divided.grid, self.divided.free
        assert cells is not None, "a path was missed"
        assert (cells[0].tolist(), cells[-1].tolist()) == (list(start), list(goal))
        assert_legal(cells, np.ones_like(free) if grid.corner_cutting else free, free)
        points = np.array([centre(grid, cell) for cell in cells])
        assert np.allclose(answer.points, points, rtol=0, atol=1e-9)
        assert answer.length_cells == pytest.approx(recounted(cells), rel=1e-14)
        assert cost_of(cells) >= optimum
        assert answer.lower_bound_cells <= length_of(optimum) * (1 + 1e-14)
        return cost_of(cells)

    def best_in_fields(self, answer: PortalAnswer, start: Any, goal: Any) -> int:
        """Cost of the shortest path on the cells of the fields that the first way passes."""
        fields = self.search.fields_passed()
        assert answer.cells is not None
        assert fields[self.label[answer.cells[:, 0], answer.cells[:, 1]]].all()
        best = self.cell_search.search(
            tuple(start), tuple(goal), field_of=self.label, in_corridor=fields
        )
        return cost_of(best.cells)

    def ends(self, rng: np.random.Generator, count: int) -> Any:
        """Some starts, each with goals: any cells, itself, its field, beside it, over a border."""
        portals, cols = self.search.portals, self.divided.grid.shape[1]
        for _ in range(count):
            start = rng.choice(self.free)
            if portals.n_gates and rng.random() < 0.4:
                start = np.array(divmod(int(rng.choice(portals.gate_cell)), cols))
            own = np.argwhere(self.label == self.label[tuple(start)])
            away = np.abs(self.free - start).max(axis=1)
            goals = [start, rng.choice(self.free), rng.choice(self.free), rng.choice(own)]
            goals.append(rng.choice(self.free[away <= 1]))
            if portals.n_gates:
                goals.append(np.array(divmod(int(rng.choice(portals.gate_cell)), cols)))
            yield start.tolist(), [np.asarray(goal).tolist() for goal in goals]

    def run(self, seed: int, count: int = 4) -> None:
        """Judge ways from some starts."""
        rng = np.random.default_rng(seed)
        for start, goals in self.ends(rng, count):
            self.judge(start, goals, rng)


seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=200, derandomize=True, deadline=None)
@given(partitions(), st.sampled_from(GATES), seeds)
def test_paths_and_bounds_on_random_fields(divided: Divided, gates: str, seed: int) -> None:
    assume(divided.free.any())
    Judge(divided, gates).run(seed)


@settings(max_examples=150, derandomize=True, deadline=None)
@given(partitions(), seeds)
def test_ways_by_each_side_cost_at_least_what_bounds_say(divided: Divided, seed: int) -> None:
    assume(divided.free.any())
    search, rng = Judge(divided).search, np.random.default_rng(seed)
    portals, cols = search.portals, divided.grid.shape[1]
    gates, cells = portals.gate_cell.astype(np.int64), np.flatnonzero(divided.free)

    def by_side(side: int, inside: Any, beyond: Any) -> Any:
        """Least cost over the moves of a side's portal, from inside its field to beyond it."""
        begin, end = portals.side_gates_start[side : side + 2]
        own = portals.side_gates[begin:end]
        exits = [range(portals.exit_start[gate], portals.exit_start[gate + 1]) for gate in own]
        return min(
            inside[gates[gate]] + portals.exit_cost[e] + beyond[gates[portals.exit_gate[e]]]
            for gate, moves_out in zip(own, exits, strict=True)
            for e in moves_out
            if portals.exit_portal[e] == portals.side_portal[side]
        )

    for ends in rng.choice(cells, size=(10, 2)):
        inside, costs = costs_from(divided.inside, ends), costs_from(divided.moves, ends)
        fields = divided.label[ends].tolist()
        low = [side_costs(portals, cols, f, int(end)) for f, end in zip(fields, ends, strict=True)]
        bounds = weigh_sides(portals, search.tables, *fields, *low)
        for k in (0, 1):
            first = portals.side_start[fields[k]]
            for i, bound in enumerate(bounds[k].tolist()):
                cost = by_side(first + i, inside[k], costs[1 - k])
                assert bound <= cost
                assert bound < FAR or cost == math.inf


@settings(max_examples=40, derandomize=True, deadline=None)
@given(scenes(min(MAX_SIDE, 40)), st.sampled_from(["all", "few"]), seeds)
def test_paths_and_bounds_on_the_fields_that_are_chosen(
    scene: Scene, gates: str, seed: int
) -> None:
    judge = Judge.of(TopologicalMap(scene.pyramid("survivor")), gates)
    assume(len(judge.free))
    judge.run(seed)


@pytest.mark.parametrize(
    ("name", "merge_distance_m", "gates"),
    [
        ("figure1", 1.0, "all"),
        ("office", 2.0, "all"),
        ("office", 2.0, "few"),
        ("office", math.inf, "sparse"),
    ],
)
def test_paths_and_bounds_on_generated_worlds(
    name: str, merge_distance_m: float, gates: str
) -> None:
    world = figure1_world() if name == "figure1" else office_world()
    pyramid = DualGraphPyramid.build(world.grid(), merge_distance_m=merge_distance_m, seed=1)
    Judge.of(TopologicalMap(pyramid), gates).run(7, 6)


# Little maps, with each pair of their cells

_LITTLE = {
    "one cell": (".",),
    "two fields, one cell each": ("ab",),
    "one-cell door": ("aa#ccc", "aabccc", "aa#ccc"),
    "door between two fields": ("aa#bb", "aaabb", "aa#bb"),
    "fields that meet at a point": ("aab", "aab", "cdd"),
    "a chessboard of cells": ("abab", "baba", "abab"),
    "stairs": ("abcd", "bcde", "cdef", "defg"),
    "stairs along a wall": ("a#dd", "aa#d", "#ab#", "##bb"),
    "walled off": ("aa#cc", "bb#dd"),
    "inside another": ("aaaaa", "abbba", "abcba", "abbba", "aaaaa"),
    "shorter through the other field": ("aba", "a#a", "aaa"),
    "the goal's field is passed twice": ("bbbbb", "a#b#a", "aaaaa"),
}


def divided_as(lines: tuple[str, ...], *, corner_cutting: bool) -> Divided:
    """A map whose fields are the connected pieces of equal letters."""
    letters = np.array([[ord(letter) for letter in line] for line in reversed(lines)])
    grid = occupancy_grid((letters != ord("#")).astype(np.uint8))
    grid = replace(grid, corner_cutting=corner_cutting)
    divided = Divided(grid, letters.astype(np.int32), (4, 2))
    return replace(divided, field_of=pieces_of(divided))


@pytest.mark.parametrize("gates", GATES)
@pytest.mark.parametrize("name", _LITTLE)
def test_all_pairs_of_little_maps(name: str, gates: str) -> None:
    for corner_cutting in (False, True):
        divided = divided_as(_LITTLE[name], corner_cutting=corner_cutting)
        judge, rng = Judge(divided, gates), np.random.default_rng(0)
        cells = judge.free.tolist()
        for start in cells:
            judge.judge(start, cells, rng)


@pytest.mark.parametrize("gates", ["all", "few"])
@pytest.mark.parametrize("drawing", [("#",), ("?",), ("#?", "??")])
def test_a_map_without_free_cells_has_no_portals(drawing: tuple[str, ...], gates: str) -> None:
    pyramid = DualGraphPyramid.build(occupancy_grid(drawn(*drawing)), merge_distance_m=3.0)
    assert Judge.of(TopologicalMap(pyramid), gates).search.portals.n_portals == 0


@settings(max_examples=30, derandomize=True, deadline=None)
@given(partitions(), st.sampled_from(GATES), seeds)
def test_an_answer_depends_on_its_query_only(divided: Divided, gates: str, seed: int) -> None:
    assume(divided.free.any())
    rng = np.random.default_rng(seed)
    judge = Judge(divided, gates)
    free = judge.free
    pairs = rng.integers(len(free), size=(6, 2))
    queries = [
        (tuple(free[i].tolist()), tuple(free[j].tolist()), effort)
        for (i, j), effort in itertools.product(pairs.tolist(), EFFORTS)
    ]
    first = [judge.search.path(start, goal, effort=effort) for start, goal, effort in queries]
    kept = [None if answer.cells is None else answer.cells.copy() for answer in first]
    for k in rng.permutation(len(queries)).tolist():
        start, goal, effort = queries[k]
        again, cells = judge.search.path(start, goal, effort=effort), kept[k]
        assert again.lower_bound_cells == first[k].lower_bound_cells
        assert again.length_cells == first[k].length_cells
        for other in (again.cells, first[k].cells):
            assert (other is None) == (cells is None)
            assert other is None or np.array_equal(other, cells)


@pytest.mark.parametrize("merge_distance", [1.0, 3.0, math.inf])
def test_open_floors_find_a_level_whatever_the_merge_distance(merge_distance: float) -> None:
    grid = occupancy_grid(drawn(*["." * 300] * 300))
    pyramid = DualGraphPyramid.build(grid, merge_distance_m=merge_distance)
    search = GridSearch(grid.enterable())
    found = PortalSearch(TopologicalMap(pyramid), search).path((3, 3), (290, 200), effort="wide")
    assert found.cells is not None
    assert len(found.cells) == 288
