"""Proofs of results, which `check_proof.py` checks without anything of this package. Public:
`prove`.
"""

import hashlib
import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from hybridnav._base.moves import COL_STEP, ROW_STEP
from hybridnav._base.trig import dist
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.check_proof import ONE, UNIT, cost_of, joins_of
from hybridnav.errors import PlanError
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.cells import CellClass
from hybridnav.maps.clearance import within_radius
from hybridnav.planning import PlanResult
from hybridnav.planning.costs import PlannerCosts
from hybridnav.search.directed import DirectedSides
from hybridnav.search.found import ClosedCells
from hybridnav.search.mesh.slits import lines_of
from hybridnav.search.proofs import (
    grid_near,
    moves_of_cells,
    moves_of_king,
    region_of,
    strings_near,
)

_RATIO = math.sqrt(4 - math.sqrt(8))
"""Most by which moves between corners of cells are dearer than a line."""


def prove(result: PlanResult) -> dict[str, Any]:
    """Return a proof of the answer, plain values for strict JSON.

    It proves that the path is free and has its cost, and that none costs less than its bound; or
    that there is no path. `check_proof.py`, which needs nothing of this package, accepts or rejects
    it: see :doc:`/explanation/what-a-proof-is`.

    Parameters
    ----------
    result
        A result as it was planned; copies hold no map.

    Raises
    ------
    PlanError
        When no proof of such an answer is known: if corners may be cut, for paths of OMPL and
        copies of a result, and with costs other than clearance.

    Examples
    --------
    >>> from hybridnav import check_proof
    >>> grid = hn.example_map("figure1")
    >>> planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    >>> proof = hn.prove(planner.plan((0.5, 0.5), (2.0, 2.5)))
    >>> origin = *grid.frame.origin_m, grid.frame.yaw_rad
    >>> check_proof.check(grid.measured, [grid.resolution_m, *origin], proof)[:43]
    'path from [0.5, 0.5] to [2.0, 2.5], radius '
    """
    if result.ground is None:
        raise PlanError("copies of a result have no proof: ask the result that was planned")
    grid, costs, closed, _ = result.ground
    if grid.corner_cutting:
        raise PlanError(
            "no proof is known where corners may be cut: load the map without corner_cutting"
        )
    kind = result.metric if result.solved else str(result.status)
    make = {
        "no path": _no_path,
        "octile": _cells,
        "weighted": _cells,
        "any-angle": _line,
        "any-angle-weighted": _line_by_costs,
    }.get(kind)
    if make is None or result.refinement is not None:
        raise PlanError(
            f"no proof is known of {kind!r:.80}: expected no path, or a path of the metric octile, "
            "weighted, any-angle or any-angle-weighted that OMPL did not change"
        )
    problem = _Problem(result, grid, costs, closed)
    proof = problem.stated | make(problem)
    if proof.get("bound", 0.0) > proof.get("cost", 0.0) * (1 + 1e-9):
        raise PlanError(
            f"a proof has the bound {proof['bound']!r:.30} m, expected at most the path's cost, "
            f"{proof['cost']!r:.30} m: no path is cheaper than the cheapest, so please report this"
        )
    return proof


@dataclass(frozen=True)
class _Problem:
    """What is to be proved."""

    result: PlanResult
    grid: OccupancyGrid
    costs: PlannerCosts
    closed: ClosedCells | None

    @cached_property
    def allow_unexplored(self) -> bool:
        """Whether unexplored cells may be entered."""
        return bool(self.result.settings["planner"]["allow_unexplored"])

    @cached_property
    def free(self) -> BoolArray:
        """bool (rows, cols), the cells that paths of the query may use."""
        free = self.grid.enterable(allow_unexplored=self.allow_unexplored)
        for shut in (self.closed, self.costs.closed):
            if shut is not None:
                free.ravel()[shut.flat] = False
        return free

    @property
    def one_way(self) -> DirectedSides | None:
        """The directed sides; None for none."""
        return None if self.closed is None else self.closed.one_way

    @property
    def units(self) -> IntArray | None:
        """int32 (rows, cols), the factors in units; None for lengths."""
        return None if self.costs.layer is None else self.costs.layer.units

    @cached_property
    def ends(self) -> FloatArray:
        """float64 (2, 2), positions (row, col) of start and goal in grid units."""
        assert self.result.start and self.result.goal  # noqa: S101, PT018 - results of plans
        points = np.array([self.result.start[:2], self.result.goal[:2]])
        return self.grid.frame.positions_of(points)

    @cached_property
    def stated(self) -> dict[str, Any]:
        """The map, the robot, what is closed, and the two ends."""
        grid, layer, costs = self.grid, self.costs.layer, None
        if layer is not None:
            kind = layer.source.get("kind")
            if kind != "clearance":
                raise PlanError(
                    f"no proof is known of costs of the kind {kind!r:.60}: expected clearance"
                )
            costs = {name: value for name, value in layer.source.items() if name != "kind"}
        kinds = (CellClass.FREE, CellClass.UNEXPLORED)[: 1 + self.allow_unexplored]
        radius_cells = grid.robot_radius_m / grid.resolution_m
        near = within_radius(grid.measured == CellClass.OCCUPIED, radius_cells=radius_cells)
        shut = np.isin(grid.measured, kinds) & ~near & ~self.free
        edges = np.flatnonzero(np.diff(shut.ravel(), prepend=False, append=False))
        one_way = [] if self.one_way is None else lines_of(self.free, self.one_way.sides)
        return {
            "thresholds": [grid.free_threshold, grid.occupied_threshold],
            "map_sha256": hashlib.sha256(grid.measured.tobytes()).hexdigest(),
            "side_m": grid.resolution_m,
            "origin": [*grid.frame.origin_m, grid.frame.yaw_rad],
            "radius_m": grid.robot_radius_m,
            "allow_unexplored": self.allow_unexplored,
            "closed": edges.reshape(-1, 2).tolist(),
            "one_way": one_way,
            "free_sha256": hashlib.sha256(np.packbits(self.free).tobytes()).hexdigest(),
            "costs": costs,
            "start": list(self.result.start or ())[:2],
            "goal": list(self.result.goal or ())[:2],
        }


def _no_path(problem: _Problem) -> dict[str, Any]:
    start = tuple(np.floor(problem.ends[0] + 1e-9).astype(np.int64).tolist())
    return {"kind": "no path", "region": region_of(problem.free, problem.one_way, start)}


def _cells(problem: _Problem) -> dict[str, Any]:
    result, per_cell = problem.result, problem.grid.resolution_m
    assert result.path is not None  # noqa: S101 - it is solved
    cells = result.path.cells
    ends, length = cells[[0, -1]], result.cost / per_cell
    grid = grid_near(problem.free, problem.units, ends, length, problem.one_way)
    limit = math.floor(result.lower_bound / per_cell * (1 - 1e-9) * UNIT)
    return {
        "kind": "cells",
        "cost": result.cost,
        "bound": result.lower_bound,
        "path": _walk(cells),
        **moves_of_cells(grid, limit),
    }


def _line_by_costs(problem: _Problem) -> dict[str, Any]:
    result, per_cell, layer = problem.result, problem.grid.resolution_m, problem.costs.layer
    assert result.path is not None  # noqa: S101 - it is solved
    assert layer is not None  # noqa: S101 - as the metric says
    points = result.path.points if result.line is None else result.line
    if result.line is None and result.path.is_curved:
        raise PlanError("no proof is known of arcs along cells: take smooth='line-of-sight'")
    line, cells = problem.grid.frame.positions_of(points), result.path.cells[[0, -1]]
    # An end on a side may lie a rounding error beyond it, where another cell is blocked.
    line[[0, -1]] = np.clip(line[[0, -1]], cells, cells + 1)
    line = _distinct(line)
    units = np.pad(layer.units, 1, constant_values=ONE)
    cost = cost_of(units, line + 1) * per_cell
    # The corners of the cells of the ends that lie furthest from the other end.
    ahead = line[[0, -1]] - line[[1, -2]] if len(line) > 1 else np.zeros((2, 2))
    corners = np.where(ahead > 0, np.ceil(line[[0, -1]]), np.floor(line[[0, -1]])).astype(np.int64)
    joins = joins_of(units, line[[0, -1]] + 1, corners + 1)
    known = cost / per_cell + joins
    grid = grid_near(problem.free, problem.units, corners, known * _RATIO)
    ends = line[[0, -1]].tolist()
    given = problem.free, layer.factors, ends, cells.tolist(), cost / per_cell
    proof, least = moves_of_king(grid, math.floor(known * UNIT), given)
    bound, proof = max(least / UNIT - joins, dist(*ends)), proof | {"corners": corners.tolist()}
    if problem.one_way is not None:  # the king knows no directions, lengths do
        known = cost / per_cell
        heights, length = strings_near(problem.free, line[[0, -1]], known, problem.one_way)
        if length > bound:
            near = [row for row in heights if min(row[2:]) + dist(row[:2], ends[1]) < length]
            bound, proof = length, {"heights": near}
    bound *= per_cell * (1 - 2e-9)
    return {"kind": "line", "cost": cost, "bound": bound, "line": line.tolist(), **proof}


def _line(problem: _Problem) -> dict[str, Any]:
    result = problem.result
    assert result.path is not None  # noqa: S101 - it is solved
    line = _distinct(problem.grid.frame.positions_of(result.path.points))
    per_cell = problem.grid.resolution_m
    near = result.lower_bound / per_cell * (1 - 1e-9)
    heights, _ = strings_near(problem.free, line[[0, -1]], near, problem.one_way)
    return {
        "kind": "line",
        "cost": result.cost,
        "bound": result.lower_bound,
        "line": line.tolist(),
        "heights": heights,
    }


def _distinct(line: FloatArray) -> FloatArray:
    """Return a line without points that repeat the one before."""
    return line[np.append([True], (np.diff(line, axis=0) != 0).any(axis=1))]


def _walk(cells: LongArray) -> list[Any]:
    """Return the first one of some cells, each an 8-neighbour of the next, and the moves."""
    number = np.zeros((3, 3), np.int64)
    number[ROW_STEP + 1, COL_STEP + 1] = np.arange(8)
    moves = number[tuple(np.diff(cells, axis=0).T + 1)]
    return [cells[0].tolist(), "".join(map(str, moves.tolist()))]
