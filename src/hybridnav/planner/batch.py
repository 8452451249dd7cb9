"""Many queries at once: those that look-ups answer in one kernel, the others one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.grid import CellClass
from hybridnav.planner.cell_plans import OverPortals
from hybridnav.planner.jump_plans import OverJumps
from hybridnav.planner.mesh_plans import OverMesh
from hybridnav.result import PlanBatch, PlanStatus

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.planner.cell_plans import CellPlanner, CellPlans
    from hybridnav.planner.closed import ClosedCells
    from hybridnav.planner.planner import HybridPlanner, Smooth


def plan_many(
    planner: HybridPlanner,
    cell_planner: CellPlanner | None,
    ends: tuple[FloatArray, FloatArray],
    smooth: Smooth,
    closed: ClosedCells | None,
) -> PlanBatch:
    """Return the answers of `planner.plan` to pairs of points, in arrays.

    Parameters
    ----------
    planner
        Planner of the remaining queries.
    cell_planner
        Planner for many queries at once; None leaves all to `planner`.
    ends
        Starts and goals, float64 (n, 2) each, or poses (n, 3).
    smooth
        `"none"` or `"line-of-sight"`.
    closed
        Closed cells; None for none.
    """
    starts, goals = ends
    n, grid = len(starts), planner.topology.grid
    status = np.full(n, str(PlanStatus.SOLVED), dtype=f"U{max(map(len, PlanStatus))}")
    cost, bound = np.full(n, np.inf), np.full(n, np.inf)
    paths: list[FloatArray] = [np.empty((0, 2))] * n
    headings = [np.empty(0)] * n
    left = np.ones(n, dtype=np.bool_)
    first, last = grid.frame.cells_of(starts[:, :2]), grid.frame.cells_of(goals[:, :2])
    asked = np.flatnonzero(_are_free(planner, first) & _are_free(planner, last))
    found = None
    if len(asked) and isinstance(cell_planner, OverMesh) and not cell_planner.has_budget:
        pairs = (first[asked], last[asked]), (starts[asked], goals[asked])
        found = cell_planner.plan_many(*pairs, closed)
    elif len(asked) and smooth == "none" and isinstance(cell_planner, OverPortals | OverJumps):
        found = cell_planner.plan_many(first[asked], last[asked])
    if found is not None:
        kept = found.is_done
        if closed is not None:
            kept = kept & ~_met(closed, found, (first[asked], last[asked]), grid)
        done = asked[kept]
        left[done] = False
        cost[done] = found.cost_m[kept]
        bound[done] = np.minimum(found.lower_bound_m[kept], cost[done])
        status[done[np.isinf(cost[done])]] = str(PlanStatus.NO_PATH)
        for i, k in zip(done.tolist(), np.flatnonzero(kept).tolist(), strict=True):
            paths[i] = found.points[found.path_start[k] : found.path_start[k + 1]]
    for i in np.flatnonzero(left).tolist():
        result = planner.plan(starts[i], goals[i], smooth=smooth, blocked=closed)
        status[i], cost[i], bound[i] = str(result.status), result.cost, result.lower_bound
        if result.path is not None:
            paths[i] = result.path.points
            if result.path.headings_rad is not None:
                headings[i] = result.path.headings_rad
    return PlanBatch(
        status=status,
        cost=cost,
        lower_bound=bound,
        path_start=np.concatenate([[0], np.cumsum([len(p) for p in paths])]).astype(np.int64),
        points=np.concatenate([np.empty((0, 2)), *paths]),
        headings_rad=np.concatenate([np.empty(0), *headings]) if starts.shape[1] > 2 else None,  # noqa: PLR2004
    )


def _met(
    closed: ClosedCells,
    found: CellPlans,
    ends: tuple[LongArray, LongArray],
    grid: OccupancyGrid,
) -> BoolArray:
    """Return which answers meet closed cells, bool (n,).

    They meet them with an end or, if paths are of cells, on the path.
    """
    across = np.array([grid.shape[1], 1])
    met: BoolArray = closed.holds(ends[0] @ across) | closed.holds(ends[1] @ across)
    if found.metric != "octile":
        return met
    for k in np.flatnonzero(found.is_done & ~met).tolist():
        points = found.points[found.path_start[k] : found.path_start[k + 1]]
        met[k] = len(points) and closed.meets(grid.frame.cells_of(points), grid)
    return met


def _are_free(planner: HybridPlanner, cells: LongArray) -> BoolArray:
    """Return whether cells (n, 2) lie on the map and are free."""
    classes = planner.topology.grid.classes
    inside = ((cells >= 0) & (cells < classes.shape)).all(axis=1)
    free = np.zeros(len(cells), dtype=np.bool_)
    free[inside] = classes[tuple(cells[inside].T)] == CellClass.FREE
    return free
