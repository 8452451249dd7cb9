"""Many plans at once: those that look-ups answer in one kernel, the others one by one."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property, partial
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import frozen
from hybridnav.maps import CellClass
from hybridnav.planning.path import check_length, is_length
from hybridnav.planning.result import PlanStatus
from hybridnav.search.found import ClosedCells, QueryMany

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any

    from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, LongArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.planning import PlanResult
    from hybridnav.search.found import FoundMany, Method


@dataclass(frozen=True, eq=False)
class PlanBatch:
    """Outcomes of many queries, arrays of n.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> planner = hn.HybridPlanner(topology)
    >>> batch = planner.plan_many([(0.5, 0.5), (0.5, 0.5)], [(2.0, 2.5), (1.5, 0.5)])
    >>> batch.cost.round(3)
    array([2.546, 1.   ])
    """

    status: AnyArray
    """str (n,), the values of `PlanStatus`."""
    cost: FloatArray
    """float64 (n,), metres; infinite where there is no path."""
    bound_source: FloatArray | Callable[[], FloatArray]
    """The lower bounds, or how to find them."""
    path_start: LongArray
    """int64 (n + 1,), query i has the points `path_start[i]` to `path_start[i + 1]`."""
    points: FloatArray
    """float64 (m, 2), (x, y) in metres, map frame, of all paths."""
    headings_rad: FloatArray | None = None
    """float64 (m,), the heading at each point; None in spaces without headings."""

    def __post_init__(self) -> None:
        """Make the arrays read-only."""
        for value in vars(self).values():
            if isinstance(value, np.ndarray):
                frozen(value)

    def __reduce__(self) -> tuple[type[PlanBatch], tuple[Any, ...]]:
        """Copy the bounds themselves, so that copies hold no map."""
        source = self.lower_bound if callable(self.bound_source) else self.bound_source
        values = vars(self) | {"bound_source": source}
        return PlanBatch, tuple(values[field.name] for field in fields(self))

    @cached_property
    def lower_bound(self) -> FloatArray:
        """float64 (n,), metres, as in `PlanResult`; those of any-angle paths by costs are found
        when they are read first, in tens of milliseconds each on maps of buildings."""
        source = self.bound_source
        return frozen(source()) if callable(source) else source

    @property
    def gap(self) -> FloatArray:
        """float64 (n,), proved distances from the optimum; NaN where there is no path."""
        gap = np.full(len(self.cost), np.nan)
        solved = np.isfinite(self.cost)
        np.divide(self.cost, self.lower_bound, out=gap, where=solved & (self.lower_bound > 0))
        gap[solved & (self.lower_bound <= 0)] = 1.0
        return gap - 1

    def path(self, query: int) -> FloatArray:
        """Return the points of one path, float64 (k, 2); none where there is no path."""
        return self.points[self.path_start[query] : self.path_start[query + 1]]


def plan_many(
    grid: OccupancyGrid,
    at_once: Method | None,
    endpoints: tuple[FloatArray, FloatArray],
    closed: ClosedCells | None,
    alone: Callable[[FloatArray, FloatArray], PlanResult],
) -> PlanBatch:
    """Return the answers to pairs of points, in arrays.

    `at_once`: planner for many queries at once; None leaves all to `alone`; `endpoints`: starts and
    goals, float64 (n, 2) each, or poses (n, 3); `closed`: closed cells; None for none; `alone`:
    plans one of the remaining queries, between two of the `endpoints`.
    """
    starts, goals = endpoints
    n = len(starts)
    status = np.full(n, str(PlanStatus.SOLVED), dtype=f"U{max(map(len, PlanStatus))}")
    cost, bound = np.full(n, np.inf), np.full(n, np.inf)
    counts, source = np.zeros(n, np.int64), np.zeros(n, np.int64)
    paths: dict[int, FloatArray] = {}
    headings = [np.empty(0)]
    late: dict[int, Callable[[], float]] = {}
    left = np.ones(n, dtype=np.bool_)
    first, last = grid.frame.cells_of(starts[:, :2]), grid.frame.cells_of(goals[:, :2])
    asked = np.flatnonzero(_are_free(grid, first) & _are_free(grid, last))
    found = None
    if len(asked) and at_once is not None:
        cells = first[asked], last[asked]
        found = at_once.find_many(QueryMany(cells, (starts[asked], goals[asked]), closed))
    if at_once is not None and found is not None:
        kept = found.is_done
        _check_lengths(found, at_once.metric)
        if closed is not None:
            on_cells = found if at_once.metric == "octile" else None
            kept = kept & ~_met(closed, cells, grid, on_cells)
        done = asked[kept]
        left[done] = False
        cost[done] = found.cost_m[kept]
        bound[done] = np.minimum(found.lower_bound_m[kept], cost[done])
        status[done[np.isinf(cost[done])]] = str(PlanStatus.NO_PATH)
        source[done] = found.path_start[:-1][kept]
        counts[done] = np.diff(found.path_start)[kept]
        still = done[~(cost[done] > 0)]
        counts[still] = np.minimum(counts[still], 1)
    for i in np.flatnonzero(left).tolist():
        result = alone(starts[i], goals[i])
        status[i], cost[i] = str(result.status), result.cost
        if callable(result.bound_source):
            late[i] = result.bound_source
        else:
            bound[i] = result.bound_source
        if result.path is not None:
            paths[i] = result.path.points
            counts[i] = len(paths[i])
            if result.path.headings_rad is not None:
                headings.append(result.path.headings_rad)
    path_start = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    is_whole = found is not None and not left.any() and path_start[-1] == len(found.points)
    points = found.points if found is not None and is_whole else np.empty((path_start[-1], 2))
    if found is not None and not is_whole:
        counts[left] = 0
        points[_rows(path_start[:-1], counts)] = found.points[_rows(source, counts)]
    for i, path in paths.items():
        points[path_start[i] : path_start[i + 1]] = path
    has_yaw = starts.shape[1] > 2  # noqa: PLR2004
    return PlanBatch(
        status=status,
        cost=cost,
        bound_source=partial(_with_late, bound, late) if late else bound,
        path_start=path_start,
        points=points,
        headings_rad=np.concatenate(headings) if has_yaw else None,
    )


def _check_lengths(found: FoundMany, metric: str) -> None:
    """Refuse paths whose costs are not the lengths of their points, by metrics of lengths."""
    if metric not in {"octile", "any-angle"}:
        return
    from hybridnav.maps.geometry import polyline_lengths  # noqa: PLC0415 - compiled

    driven_m = polyline_lengths(found.points, found.path_start)
    goes = found.is_done & np.isfinite(found.cost_m)
    stated_m, driven_m = found.cost_m[goes], driven_m[goes]
    for wrong in np.flatnonzero(~is_length(stated_m, driven_m))[:1]:
        check_length(stated_m[wrong], driven_m[wrong])


def _rows(begin: LongArray, counts: LongArray) -> LongArray:
    """Return the rows of runs that begin somewhere, one run after the other."""
    before = np.cumsum(counts) - counts
    return np.repeat(begin - before, counts) + np.arange(counts.sum())


def _with_late(bound: FloatArray, late: dict[int, Callable[[], float]]) -> FloatArray:
    """Return bounds with those that are found only now."""
    bound = bound.copy()
    for i, source in late.items():
        bound[i] = source()
    return bound


def _met(
    closed: ClosedCells,
    endpoints: tuple[LongArray, LongArray],
    grid: OccupancyGrid,
    found: FoundMany | None,
) -> BoolArray:
    """Return which queries meet closed cells with an endpoint, or with their paths, bool (n,).

    Only paths of cells are given; None for others.
    """
    across = np.array([grid.shape[1], 1])
    met: BoolArray = closed.holds(endpoints[0] @ across) | closed.holds(endpoints[1] @ across)
    if found is None:
        return met
    for k in np.flatnonzero(found.is_done & ~met).tolist():
        points = found.points[found.path_start[k] : found.path_start[k + 1]]
        met[k] = len(points) and closed.meets(grid.frame.cells_of(points), grid)
    return met


def _are_free(grid: OccupancyGrid, cells: LongArray) -> BoolArray:
    """Return whether cells (n, 2) lie on the map and are free."""
    classes = grid.classes
    inside = ((cells >= 0) & (cells < classes.shape)).all(axis=1)
    free = np.zeros(len(cells), dtype=np.bool_)
    free[inside] = classes[tuple(cells[inside].T)] == CellClass.FREE
    return free
