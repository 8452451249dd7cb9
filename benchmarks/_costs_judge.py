"""Judges of the answers that the tables of costs measure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from hybridnav._base.moves import COL_STEP, ROW_STEP, legal_moves
from hybridnav.harness.judges import CheapestCost
from hybridnav.harness.outcome import nanmean

if TYPE_CHECKING:
    from benchmarks._costs_measure import Bench, Cell
    from hybridnav._base.typing import LongArray
    from hybridnav.harness.tables import Row

EPSILON = 0.01
_SOURCES, _GOALS = 10, 5
"""Cells from which Dijkstra's algorithm is run on each map, and goals of each."""
_MOST_CELLS = 3_000_000
"""Free cells up to which scipy is asked: it needs a graph of all moves in memory."""
_SLACK = 1e-4
"""Share by which rounding to integers may change a cost."""
_ROOT = 1482910
"""sqrt 2 in units of 1 / 2^20, rounded down, as the overlay counts."""


def judged(bench: Bench) -> tuple[list[str], Row]:
    """Compare all answers with those of A*; return what is wrong, and losses and gaps."""
    wrong, excess, gaps = [], [], []
    for start, goal in bench.pairs:
        best = bench.optimum[start, goal] = bench.by_cells(start, goal)
        for epsilon in (0.0, EPSILON):
            found = bench.search.path(start, goal, epsilon=epsilon)
            most = best * (1 + epsilon + _SLACK)
            if not found.lower_bound_cells <= best * (1 + 1e-12) or not found.cost_cells <= most:
                wrong.append(
                    f"{start} to {goal}, epsilon {epsilon}: cost {found.cost_cells}, bound "
                    f"{found.lower_bound_cells}, A* {best}"
                )
        if np.isfinite(best):
            excess.append(100 * (found.cost_cells / best - 1))
            gaps.append(found.cost_cells / found.lower_bound_cells - 1 <= EPSILON + _SLACK)
    share = 100 * nanmean(np.array(gaps, dtype=np.float64))
    return wrong, {"excess mean %": nanmean(np.array(excess)), "gap <= 1 % of pairs": share}


def by_dijkstra(bench: Bench) -> list[str]:
    """Compare exact answers with those of scipy's Dijkstra on the same integer costs; on large maps
    with the judges' own, which needs no graph of all moves."""
    asked = [
        (bench.pairs[k][0], [bench.pairs[(k + j) % len(bench.pairs)][1] for j in range(_GOALS)])
        for k in range(min(_SOURCES, len(bench.pairs)))
    ]
    if bench.n_free > _MOST_CELLS:
        return _by_own_dijkstra(bench, [(start, goal) for start, goals in asked for goal in goals])
    graph, number = graph_of(bench)
    wrong = []
    for start, goals in asked:
        least = dijkstra(graph.tocsr(), directed=False, indices=number[start])
        for goal in goals:
            found = bench.search.path(start, goal).lower_bound_cells
            expected = least[number[goal]] * bench.overlay.cost_unit
            if found != expected:
                wrong.append(f"{start} to {goal}: {found}, Dijkstra's algorithm {expected}")
    return wrong


def _by_own_dijkstra(bench: Bench, pairs: list[tuple[Cell, Cell]]) -> list[str]:
    cheapest, wrong = CheapestCost(bench.grid, bench.layer), []
    for start, goal in pairs:
        found = bench.search.path(start, goal)
        least = cheapest.cost_m(start, goal) / bench.grid.resolution_m
        if not found.lower_bound_cells <= least * (1 + 1e-9) <= found.cost_cells * (1 + 2e-9):
            wrong.append(
                f"{start} to {goal}: cost {found.cost_cells}, bound {found.lower_bound_cells}, "
                f"Dijkstra's algorithm {least}"
            )
    return wrong


def graph_of(bench: Bench) -> tuple[coo_matrix, LongArray]:
    """Return the graph of all moves, half of them, with integer costs, and the numbers of cells."""
    enterable = bench.grid.enterable()
    moves, units = legal_moves(enterable, False), bench.layer.units.astype(np.int64)
    number = np.cumsum(enterable).reshape(enterable.shape) - 1
    tails, heads, costs = [], [], []
    for k in range(4):
        rows, cols = np.nonzero(moves >> k & 1)
        there = rows + ROW_STEP[k], cols + COL_STEP[k]
        total = units[rows, cols] + units[there]
        tails.append(number[rows, cols])
        heads.append(number[there])
        costs.append(total * _ROOT >> 20 if k & 1 else total)
    entries = (
        np.concatenate(costs).astype(np.float64),
        (np.concatenate(tails), np.concatenate(heads)),
    )
    n = int(enterable.sum())
    return coo_matrix(entries, shape=(n, n)), number
