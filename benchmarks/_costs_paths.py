"""Clearance, length, cost and time of the paths of several presets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from benchmarks._costs_measure import clocked
from hybridnav.harness.outcome import nanmean, nanquantile
from hybridnav.maps.clearance import clearance_cells
from hybridnav.maps.costs import cost_along

if TYPE_CHECKING:
    from benchmarks._costs_measure import Bench, Cell
    from hybridnav._base.typing import FloatArray
    from hybridnav.harness.tables import Row

_PAIRS = 25
_WORDS = ("clearance m", "least m", "length m", "cost m")
ASTAR = "A*"
"""`grid-astar` with the same costs, as Nav2's planner searches the inflated costmap."""


def paths(bench: Bench) -> tuple[Row, list[str]]:
    """Return means of the paths' figures over the pairs solved: mean and least clearance, length,
    cost, and the time of a plan against that of A*."""
    planners = {
        "shortest": hn.HybridPlanner(bench.topology, preset="shortest"),
        "robot": hn.HybridPlanner(bench.topology, preset="robot"),
        ASTAR: hn.HybridPlanner(bench.topology, preset="grid-astar", costs=bench.layer),
    }
    planners["robot"].prepare()
    clearance_m = clearance_cells(bench.grid.measured == hn.CellClass.OCCUPIED)
    clearance_m *= bench.grid.resolution_m
    row: Row = {}
    seconds: dict[str, FloatArray] = {}
    for name, planner in planners.items():
        figures = [_figures(bench, clearance_m, planner, pair) for pair in bench.pairs[:_PAIRS]]
        *columns, seconds[name] = (np.array(column) for column in zip(*figures, strict=True))
        for word, column in zip(_WORDS, columns, strict=True):
            row[f"{name}: {word}"] = nanmean(column)
    ratios = seconds[ASTAR] / seconds["robot"]
    row["robot: plan ms"] = 1e3 * nanquantile(seconds["robot"], 0.5)
    row["robot: plan x"], row["robot: plan x, worst"] = (
        nanquantile(ratios, share) for share in (0.5, 0.0)
    )
    return row, _dear(bench, planners["robot"])


def _dear(bench: Bench, robot: hn.HybridPlanner) -> list[str]:
    """Return a line for each path of `robot` that breaks its proof against A*."""
    wrong = []
    for pair in bench.pairs[:_PAIRS]:
        result = robot.plan(*bench.grid.frame.points_of(np.array(pair)))
        best = bench.by_cells(*pair) * bench.grid.resolution_m
        bound = result.grid_bound
        if bound is not None and not (
            bound <= best * (1 + 1e-9) and result.cost <= best * (1.01 + 1e-4)
        ):
            wrong.append(f"{pair}: robot costs {result.cost}, bound {bound}, A* {best}")
    return wrong


def _figures(
    bench: Bench, clearance_m: FloatArray, planner: hn.HybridPlanner, pair: tuple[Cell, Cell]
) -> tuple[float, ...]:
    """Return mean and least clearance, length and cost of the path between two cells, and the
    seconds of a second plan."""
    ends = bench.grid.frame.points_of(np.array(pair))
    result = planner.plan(*ends)
    if result.path is None:
        return (np.nan,) * (len(_WORDS) + 1)
    seconds = clocked(planner.plan, *ends)
    poses = result.path.poses()[:, :2]  # arcs too, 5 cm apart
    clearance = clearance_m[tuple(bench.grid.frame.cells_of(poses).T)]
    cost = cost_along(bench.grid, bench.layer, poses)
    return float(clearance.mean()), float(clearance.min()), result.path.length_m, cost, seconds
