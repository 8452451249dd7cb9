"""Clearance and length of the paths of several presets."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import hybridnav as hn
from hybridnav.costs import cost_along
from hybridnav.grid.clearance import clearance_cells
from hybridnav.harness.outcome import nanmean

if TYPE_CHECKING:
    from benchmarks._costs_measure import Bench, Cell
    from hybridnav._typing import FloatArray
    from hybridnav.harness.tables import Row

_PAIRS = 25
_SPACING_M = 0.05


def paths(bench: Bench) -> tuple[Row, list[str]]:
    """Return mean clearance, least clearance, length and cost of paths, over the pairs solved."""
    names = [name for name in ("shortest", "robot") if name in hn.preset_names()]
    planners: dict[str, hn.HybridPlanner] = {
        str(name): hn.HybridPlanner(
            bench.topology, preset=name, costs=None if name == "shortest" else bench.layer
        )
        for name in names
    }
    planners["grid-astar"] = hn.HybridPlanner(
        bench.topology, preset="grid-astar", costs=bench.layer
    )
    clearance_m = clearance_cells(bench.grid.measured == hn.CellClass.OCCUPIED)
    clearance_m *= bench.grid.resolution_m
    row: Row = {}
    for name, planner in planners.items():
        figures = [_figures(bench, clearance_m, planner, pair) for pair in bench.pairs[:_PAIRS]]
        means = [nanmean(np.array(column)) for column in zip(*figures, strict=True)]
        for word, mean in zip(("clearance m", "least m", "length m", "cost m"), means, strict=True):
            row[f"{name}: {word}"] = mean
    return row, []


def _figures(
    bench: Bench, clearance_m: FloatArray, planner: hn.HybridPlanner, pair: tuple[Cell, Cell]
) -> tuple[float, float, float, float]:
    """Return mean and least clearance, length and cost of the path between two cells."""
    result = planner.plan(*bench.grid.frame.points_of(np.array(pair)))
    if result.path is None:
        return np.nan, np.nan, np.nan, np.nan
    cells = bench.grid.frame.cells_of(_spaced(result.path.points))
    clearance = clearance_m[tuple(cells.T)]
    cost = cost_along(bench.grid, bench.layer, result.path.points)
    return float(clearance.mean()), float(clearance.min()), result.path.length_m, cost


def _spaced(points: FloatArray) -> FloatArray:
    """Return points on a polyline, 5 cm apart."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    at = np.arange(0.0, along[-1], _SPACING_M)
    return np.stack([np.interp(at, along, points[:, k]) for k in range(2)], axis=1)
