"""A judge of paths over portals, and of their bounds, by scipy's Dijkstra on the legal moves."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from scipy import sparse

from hybridnav.portals import BuiltPortals, PortalOptions, PortalSearch, build_tables
from hybridnav.portals.fields import compact_labels
from hybridnav.search.grid_search import GridSearch
from hybridnav.search.moves import DIAGONAL, STRAIGHT
from tests.divided import Divided, costs_from
from tests.oracle.grid import assert_legal, centre, moves, recounted
from tests.portal_memory import shared_portals

if TYPE_CHECKING:
    from hybridnav.portals.search import PortalAnswer
    from hybridnav.topology import TopologicalMap

EPSILONS = (0.0, 0.0, 0.01, 0.1, 1.0)


def cost_of(cells: Any) -> int:
    """Integer cost of a path."""
    straight, diagonal = moves(cells)
    return straight * STRAIGHT + diagonal * DIAGONAL


def length_of(cost: float) -> float:
    """Length of an integer cost: `b` diagonals are what is left of it modulo a straight move."""
    diagonal = int(cost) * pow(DIAGONAL, -1, STRAIGHT) % STRAIGHT
    return (int(cost) - diagonal * DIAGONAL) // STRAIGHT + diagonal * math.sqrt(2)


class Judge:
    """A search over portals and the searches that it is judged by.

    Gates are those of `Divided.portals`; the table is rounded by some bits, None for as many as it
    needs.
    """

    def __init__(self, divided: Divided, gates: str = "all", *, bits: int | None = 0) -> None:
        """Route on the very fields of a partition, with its spacings."""
        portals = divided.portals(gates, least_spacing=2)
        tables = build_tables(portals, PortalOptions(dropped_bits=bits or 0))
        field_of = compact_labels(divided.field_of, divided.free)
        self._set(divided, BuiltPortals(field_of, portals, tables, gates == "all"))
        assert bits in {None, self.search.tables.shift}

    @classmethod
    def of(cls, topology: TopologicalMap, gates: str = "all") -> Judge:
        """Route on the fields that the search itself chooses."""
        judge = cls.__new__(cls)
        options = PortalOptions(all_border_cells_levels=0, least_bytes=0)
        chosen = {"options": options} if gates == "sparse" else {}
        built = shared_portals(topology, **chosen)
        judge._set(Divided(topology.grid, built.field_of), built)
        assert judge.search.is_exact == (gates == "all")
        return judge

    def _set(self, divided: Divided, built: BuiltPortals) -> None:
        self.divided = divided
        self.cell_search = GridSearch(divided.free, corner_cutting=divided.grid.corner_cutting)
        self.search = PortalSearch(built, self.cell_search, divided.grid.frame)
        self.is_rounded = self.search.tables.shift > 0
        self.free = np.argwhere(divided.free)
        self.label = built.field_of

    @property
    def gate_moves(self) -> Any:
        """Graph of the moves inside fields, and of those between gates."""
        portals, size = self.search.portals, self.divided.label.size
        tail = np.repeat(portals.gate_cell, np.diff(portals.exit_start))
        endpoints = tail, portals.gate_cell[portals.exit_gate]
        exits = sparse.coo_array((portals.exit_cost.astype(float), endpoints), shape=(size, size))
        return (self.divided.inside + exits).tocsr()

    def flat(self, cell: Any) -> int:
        """Number of a cell, row by row."""
        return int(cell[0]) * self.divided.grid.shape[1] + int(cell[1])

    def path(self, start: Any, goal: Any, epsilon: float = 0.0) -> PortalAnswer:
        """What is judged."""
        return self.search.path(tuple(start), tuple(goal), epsilon=epsilon)

    def judge(self, start: Any, goals: Any, rng: np.random.Generator) -> None:
        """Judge paths from one cell to some others."""
        at = np.array([self.flat(start)])
        costs = costs_from(self.divided.moves, at)[0]
        for goal in goals:
            optimum = costs[self.flat(goal)]
            epsilon = float(rng.choice(EPSILONS))
            answer = self.path(start, goal, epsilon)
            self.judge_answer(answer, start, goal, optimum)
            if math.isfinite(optimum):
                self.judge_promise(answer, epsilon, (start, goal))

    def judge_answer(self, answer: PortalAnswer, start: Any, goal: Any, optimum: float) -> None:
        """A legal path between the endpoints where there is one, its points, and its bound."""
        if math.isinf(optimum):
            assert answer.cells is None
            assert answer.points.shape == (0, 2)
            assert answer.length_cells == answer.lower_bound_cells == math.inf
            return
        cells, grid, free = answer.cells, self.divided.grid, self.divided.free
        assert cells is not None, "a path was missed"
        assert (cells[0].tolist(), cells[-1].tolist()) == (list(start), list(goal))
        assert_legal(cells, np.ones_like(free) if grid.corner_cutting else free, free)
        points = np.array([centre(grid, cell) for cell in cells])
        assert np.allclose(answer.points, points, rtol=0, atol=1e-9)
        assert answer.length_cells == pytest.approx(recounted(cells), rel=1e-14)
        assert cost_of(cells) >= optimum
        assert answer.lower_bound_cells <= length_of(optimum) * (1 + 1e-14)
        low, high = sorted(abs(a - b) for a, b in zip(start, goal, strict=True))
        assert answer.lower_bound_cells >= (high - low + low * math.sqrt(2)) * (1 - 1e-9)
        if cost_of(cells) > optimum:
            assert answer.lower_bound_cells < answer.length_cells

    def judge_promise(
        self, answer: PortalAnswer, epsilon: float, endpoints: tuple[Any, Any]
    ) -> None:
        """What an answer promises of itself."""
        by_gates = self.search.is_exact and not self.is_rounded
        share = self.label[tuple(endpoints[0])] == self.label[tuple(endpoints[1])]
        if by_gates and not share:
            assert answer.expanded == 0, "cells were searched for what gates know"
        assert answer.length_cells <= (1 + epsilon) * answer.lower_bound_cells * (1 + 1e-9)
        if epsilon == 0:
            assert answer.lower_bound_cells == answer.length_cells

    def endpoints(self, rng: np.random.Generator, count: int) -> Any:
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
        """Judge paths from some starts."""
        rng = np.random.default_rng(seed)
        for start, goals in self.endpoints(rng, count):
            self.judge(start, goals, rng)
