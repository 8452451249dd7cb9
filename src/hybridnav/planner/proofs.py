"""Proofs of results, which `check_proof.py` checks without anything of this package."""

from __future__ import annotations

import base64
import hashlib
import math
import zlib
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy import ndimage

from hybridnav._base.moves import COL_STEP, ROW_STEP
from hybridnav.check_proof import UNIT, costs_of_cells, costs_of_corners, dearest
from hybridnav.errors import PlanError
from hybridnav.maps.cells import CellClass
from hybridnav.maps.clearance import within_radius
from hybridnav.maps.costs import cost_along
from hybridnav.search.kernels.proofs import ONE, OUTSIDE, tree_of, walls_round
from hybridnav.search.mesh import MeshSearch, build_mesh, shortest_paths

if TYPE_CHECKING:
    from hybridnav._base.typing import AnyArray, BoolArray, ByteArray, FloatArray, LongArray
    from hybridnav.maps import Frame, OccupancyGrid
    from hybridnav.planner import PlanResult
    from hybridnav.planner.costs import PlannerCosts
    from hybridnav.search.found import ClosedCells

_CENTRED, _FINE = 2, 2**24
"""Parts of a cell in which ends are counted: those of centres, and of exact tests."""
_RATIO = math.sqrt(4 - math.sqrt(8))
"""Most by which moves between corners of cells are dearer than a line."""


def proof_of(
    result: PlanResult, grid: OccupancyGrid, costs: PlannerCosts, closed: ClosedCells | None
) -> dict[str, Any]:
    """Return the proof of a result; see `PlanResult.proof`.

    Parameters
    ----------
    result
        The result of a query.
    grid, costs, closed
        The map and the costs that it was planned by, and the closed cells of the query.
    """
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
    return problem.stated | make(problem)


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

    @cached_property
    def ends(self) -> FloatArray:
        """float64 (2, 2), positions (row, col) of start and goal in grid units."""
        assert self.result.start and self.result.goal  # noqa: S101, PT018 - results of plans
        points = np.array([self.result.start[:2], self.result.goal[:2]])
        return self.grid.frame.positions_of(points)

    @property
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
        return {
            "thresholds": [grid.free_threshold, grid.occupied_threshold],
            "map_sha256": hashlib.sha256(grid.measured.tobytes()).hexdigest(),
            "side_m": grid.resolution_m,
            "origin": [*grid.frame.origin_m, grid.frame.yaw_rad],
            "radius_m": grid.robot_radius_m,
            "allow_unexplored": self.allow_unexplored,
            "closed": edges.reshape(-1, 2).tolist(),
            "free_sha256": hashlib.sha256(np.packbits(self.free).tobytes()).hexdigest(),
            "costs": costs,
            "start": list(self.result.start or ())[:2],
            "goal": list(self.result.goal or ())[:2],
        }


def _no_path(problem: _Problem) -> dict[str, Any]:
    start, goal = np.floor(problem.ends + 1e-9).astype(np.int64).tolist()
    chains = [parting_chain(problem.free, *ends) for ends in ((start, goal), (goal, start))]
    first, second = chains
    if first is None or second is None:
        raise PlanError("the two ends are connected: there is no proof that there is no path")
    chain = min(first, second, key=len)
    ends = [[2 * row + 1, 2 * col + 1] for row, col in (start, goal)]
    return {"kind": "no path", "grain": _CENTRED, "ends": ends, "chain": _walk(chain)}


def _cells(problem: _Problem) -> dict[str, Any]:
    result, per_cell = problem.result, problem.grid.resolution_m
    assert result.path is not None  # noqa: S101 - it is solved
    cells = result.path.cells
    tree = _Tree(problem, costs_of_cells, cells[[0, -1]], result.cost / per_cell)
    limit = math.floor(result.lower_bound / per_cell * (1 - 1e-9) * UNIT)
    return {
        "kind": "cells",
        "grain": _CENTRED,
        "ends": (2 * cells[[0, -1]] + 1).tolist(),
        "cost": result.cost,
        "bound": result.lower_bound,
        "path": _walk(cells),
        **tree.stated(limit),
    }


class _Tree:
    """The tree of cheapest paths between two nodes, cells or corners of cells.

    Parameters
    ----------
    problem
        What is to be proved.
    costs_of
        Returns the costs of moves between nodes, from walls and factors with a rim.
    ends
        int64 (2, 2), the nodes (row, col).
    length_cells
        Length that no path of interest has.
    """

    def __init__(
        self, problem: _Problem, costs_of: Any, ends: LongArray, length_cells: float
    ) -> None:
        self.low, high = _box_of(problem.free, (ends[0], ends[1]), length_cells)
        part = np.s_[self.low[0] : high[0], self.low[1] : high[1]]
        # There are more corners than cells in a row.
        walls = np.pad(~problem.free[part], (1, 2), constant_values=True)
        factors, layer = np.full(walls.shape, ONE), problem.costs.layer
        if layer is not None:
            factors[1:-2, 1:-2] = layer.units[part]
        self._costs = costs_of(walls, factors)
        self._ends = ends - self.low + 1

    def grown(self, limit: int) -> tuple[ByteArray, int]:
        """Return the tree up to a limit, with a rim, and the least cost of the second node."""
        start, goal = map(tuple, self._ends.tolist())
        tree, cost = tree_of(self._costs, start, goal, limit)
        return tree, int(cost)

    def stated(self, limit: int) -> dict[str, Any]:
        """Return the part of the tree that proves that no path costs less than a limit."""
        tree, _ = self.grown(limit)
        shown = np.concatenate([np.argwhere(tree < OUTSIDE), self._ends])
        first, last = shown.min(axis=0), shown.max(axis=0) + 1
        kept = tree[first[0] : last[0], first[1] : last[1]]
        text = base64.b85encode(zlib.compress(kept.tobytes(), 9)).decode()
        return {"box": [*(first + self.low - 1).tolist(), *kept.shape], "tree": text}


def _line_by_costs(problem: _Problem) -> dict[str, Any]:
    result, frame, layer = problem.result, problem.grid.frame, problem.costs.layer
    assert result.path is not None  # noqa: S101 - it is solved
    assert layer is not None  # noqa: S101 - as the metric says
    points = result.path.points if result.line is None else result.line
    if result.line is None and result.path.is_curved:
        raise PlanError("no proof is known of arcs along cells: take smooth='line-of-sight'")
    stated = _stated_line(frame, points)
    line = np.array(stated["line"]) / stated["grain"]
    cost = cost_along(problem.grid, layer, points)
    corners = np.rint(line[[0, -1]]).astype(np.int64)
    units = np.pad(layer.units, 1, constant_values=ONE)
    apart = np.hypot(*(corners - line[[0, -1]]).T)
    joins = (apart * dearest(units, line[[0, -1]] + 1)).sum() / ONE
    length = (cost / frame.resolution_m + joins) * _RATIO
    tree = _Tree(problem, costs_of_corners, corners, length)
    _, least = tree.grown(math.floor(length * UNIT))
    bound = max(least / UNIT / _RATIO - joins, math.dist(*line[[0, -1]])) * (1 - 2e-9)
    limit = math.floor((bound * (1 - 1e-9) + joins) * _RATIO * UNIT)
    return {
        "kind": "line by costs",
        **stated,
        "cost": cost,
        "bound": bound * frame.resolution_m,
        **tree.stated(limit),
    }


def _stated_line(frame: Frame, points: FloatArray) -> dict[str, Any]:
    """Return points of a line in whole numbers of a part of a cell."""
    fine = np.rint(frame.positions_of(points) * _FINE).astype(np.int64)
    grain = _FINE if (fine % (_FINE // _CENTRED)).any() else _CENTRED
    line = fine // (_FINE // grain)
    return {"grain": grain, "ends": line[[0, -1]].tolist(), "line": line.tolist()}


def _line(problem: _Problem) -> dict[str, Any]:
    result, frame = problem.result, problem.grid.frame
    assert result.path is not None  # noqa: S101 - it is solved
    stated = _stated_line(frame, result.path.points)
    ends = np.array(stated["ends"]) / stated["grain"]
    bound = result.lower_bound / frame.resolution_m
    cells = result.path.cells[[0, -1]]
    corners, distances = _corners_near(problem.free, ends, cells, bound)
    return {
        "kind": "line",
        **stated,
        "cost": result.cost,
        "bound": result.lower_bound,
        "corners": [
            [row, col, p]
            for (row, col), p in zip(corners.tolist(), distances.tolist(), strict=True)
        ],
    }


def _box_of(
    free: BoolArray, cells: tuple[AnyArray, AnyArray], length_cells: float
) -> tuple[LongArray, LongArray]:
    """Return the first row and column, and the ends of both, of all cells that a path of some
    length between two cells can reach, and of some more."""
    low, high = np.minimum(*cells), np.maximum(*cells)
    spare = np.maximum(length_cells - (high - low), 0) / 2 + 3
    first = np.maximum(low - spare, 0).astype(np.int64)
    return first, np.minimum(high + spare, free.shape).astype(np.int64)


def _walk(cells: LongArray) -> list[Any]:
    """Return the first one of some cells, each an 8-neighbour of the next, and the moves."""
    number = np.zeros((3, 3), np.int64)
    number[ROW_STEP + 1, COL_STEP + 1] = np.arange(8)
    moves = number[tuple(np.diff(cells, axis=0).T + 1)]
    return [cells[0].tolist(), "".join(map(str, moves.tolist()))]


def parting_chain(
    free: BoolArray, start: tuple[int, int], goal: tuple[int, int]
) -> LongArray | None:
    """Return walls that part two cells: a closed chain that goes round one of the two.

    Parameters
    ----------
    free
        bool (rows, cols), cells that may be entered; all else, and the outside, are walls.
    start, goal
        Free cells (row, col).

    Returns
    -------
    LongArray | None
        int64 (n, 2), (row, col), the last one equal to the first one; each is an 8-neighbour of
        the next one. Cells outside the map, from -1 to rows or columns, are its rim. It is the
        border of all that can be reached from the start, on the side of the goal. None where the
        two are connected.
    """
    parts, _ = ndimage.label(np.pad(free, 2))
    area = parts == parts[start[0] + 2, start[1] + 2]
    if area[goal[0] + 2, goal[1] + 2]:
        return None
    others, _ = ndimage.label(~area, np.ones((3, 3)))
    side = others == others[goal[0] + 2, goal[1] + 2]
    row, col = divmod(int(np.argmax(area[1:] & side[:-1])), area.shape[1])
    chain = walls_round(area, row + 1, col) - 2
    chain = np.concatenate([chain, chain[:1]])
    is_new = np.ones(len(chain), np.bool_)
    is_new[1:] = (chain[1:] != chain[:-1]).any(axis=1)
    found: LongArray = chain[is_new]
    return found


def _corners_near(
    free: BoolArray, ends: FloatArray, cells: LongArray, bound_cells: float
) -> tuple[LongArray, FloatArray]:
    """Return the corners (row, col) over which a path may be shorter than the bound, as far as
    their distances from the start and the straight way to the goal tell, and these distances."""
    low, high = _box_of(free, (cells[0], cells[1]), bound_cells)
    part = np.pad(free[low[0] : high[0], low[1] : high[1]], 1)
    walls = [~part[i : i - 1 or None, j : j - 1 or None] for i in (0, 1) for j in (0, 1)]
    corners = np.argwhere(np.sum(walls, axis=0) == 1)
    to_goal = np.hypot(*(corners + low - ends[1]).T)
    is_near = np.hypot(*(corners + low - ends[0]).T) + to_goal < bound_cells
    corners, to_goal = corners[is_near], to_goal[is_near]
    if not len(corners):
        return corners, to_goal
    # Of the three free cells at a corner, the one below it on the left or the one above that.
    at = corners - 1
    at[~part[tuple(corners.T)]] += (1, 0)
    count = len(corners)
    found = shortest_paths(
        MeshSearch(build_mesh(np.ascontiguousarray(part[1:-1, 1:-1]))),
        (np.tile(cells[0] - low, (count, 1)), at),
        (np.tile(ends[0] - low, (count, 1)), corners.astype(np.float64)),
    ).length_cells
    is_near = found + to_goal < bound_cells
    return corners[is_near] + low, found[is_near]
