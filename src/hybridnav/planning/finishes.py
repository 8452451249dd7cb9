"""Finishes: what is done with the paths that a method finds, chosen when a planner is made. Public:
`Refinement`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol, get_args

from hybridnav._base.clock import clock
from hybridnav._base.copies import Source, copies_alike, made
from hybridnav._base.moves import path_length_in_cells
from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import OccupancyGrid
from hybridnav.maps.costs import CostLayer, cost_along
from hybridnav.maps.geometry import polyline_length
from hybridnav.planning import PlannerSettings
from hybridnav.planning.path import Path, cells_of, path_of
from hybridnav.planning.settings import Smooth
from hybridnav.refine import LineOfSight
from hybridnav.refine.one_way import shorten, wrong_at
from hybridnav.search.found import ClosedCells, Found, Metric, PlanStatus, Query

if TYPE_CHECKING:
    from hybridnav.refine import CostLine

_CHORD = 0.25
"""Cells from one point of a curve to the next that is looked at for sides with a direction."""

Answer = Literal["circumscribed disc", "inscribed disc", "OMPL", "grid"]


@dataclass(frozen=True)
class Refinement:
    """History of the path of a sampling-based planner."""

    steps: tuple[str, ...]
    """Attempts in order, with outcomes: `corridor: timeout`, `widened corridor: solved`."""
    by: Answer
    """The source of the answer. The path of the `circumscribed disc` is valid with every heading.
    The `inscribed disc` proves that there is no path, or the robot can drive its cheapest one.
    `OMPL` sampled it. The path of the `grid`, pulled taut, counts where all else failed."""
    trace: tuple[tuple[float, float], ...] = ()
    """Seconds and cost of each better path."""
    iterations: int = 0
    """Iterations of planners and simplification."""

    @property
    def by_grid(self) -> bool:
        """Whether the path is the grid's, shortened by line of sight."""
        return self.by == "grid"


class Finished(NamedTuple):
    """A path as its result shows it.

    `metric`, `path`, `weighted_cost`, `grid_bound`, `line`, `status` and `refinement` are as in
    `PlanResult`; `bound`: proved bound on the optimum in the metric, metres, or how to find it.
    """

    metric: Metric
    path: Path | None
    bound: Source[float]
    weighted_cost: float | None = None
    grid_bound: float | None = None
    line: FloatArray | None = None
    status: PlanStatus = PlanStatus.SOLVED
    refinement: Refinement | None = None


class Finish(Protocol):
    """What is done with the paths that a method finds."""

    def finished(self, query: Query, found: Found) -> Finished:
        """Return the path of an answer that has one."""
        ...


def make_finish(
    grid: OccupancyGrid,
    settings: PlannerSettings,
    layer: CostLayer | None,
    metric: Metric,
    smooth: Smooth,
) -> Finish:
    """Make the finish of the paths of a method without OMPL; `layer`: the costs of its planner,
    None for lengths; `metric`: that of the method."""
    if layer is None:
        if metric == "octile" and smooth == "line-of-sight":
            return InSight(grid, allow_unexplored=settings.allow_unexplored)
        return AsFound(grid, metric)
    costs = CostFinish(grid, layer, settings)
    if metric == "weighted":
        return CellsByCosts(grid) if smooth == "none" else CutShort(costs, smooth)
    return LineByCosts(costs, metric, smooth)


def checked_smooth(smooth: Smooth, *, has_arcs: bool) -> Smooth:
    """Return what is smoothed, if there is such a thing; `has_arcs`: whether bends can be
    rounded."""
    if smooth not in get_args(Smooth):
        known = ", ".join(map(repr, get_args(Smooth)))
        raise InvalidValueError(f"smooth must be {known}, or None, got {smooth!r:.80}")
    if smooth == "arcs" and not has_arcs:
        raise InvalidValueError(
            "smooth 'arcs' rounds bends of paths by costs without OMPL, and this planner plans "
            "no such paths: give it costs, or take 'line-of-sight'"
        )
    return smooth


def _line_of(cells: Source[LongArray], points: FloatArray) -> Path:
    """Return the path of lines through points, one point if it goes nowhere."""
    length_m = polyline_length(points)
    return Path(cells, partial(made, points if length_m > 0 else points[:1]), length_m)


@copies_alike
class AsFound:
    """Paths by lengths stay as the method found them."""

    def __init__(self, grid: OccupancyGrid, metric: Metric) -> None:
        self._frame, self._metric, self._is_of_cells = grid.frame, metric, metric == "octile"

    def finished(self, query: Query, found: Found) -> Finished:  # noqa: ARG002 - as of the others
        """Return the path as it is; see `Finish`."""
        path = path_of(found, self._frame, is_of_cells=self._is_of_cells)
        return Finished(self._metric, path, found.optimum or found.lower_bound_m)


@copies_alike
class InSight:
    """Paths of cells by lengths are shortened by line of sight.

    `allow_unexplored`: whether unexplored cells may be entered.
    """

    def __init__(self, grid: OccupancyGrid, *, allow_unexplored: bool) -> None:
        self._grid, self._allow_unexplored = grid, allow_unexplored

    @cached_property
    def _sight(self) -> LineOfSight:
        return LineOfSight(self._grid, allow_unexplored=self._allow_unexplored)

    def finished(self, query: Query, found: Found) -> Finished:
        """Return the any-angle path; see `Finish`."""
        began = clock()
        points = shorten(self._sight, query.closed, found.cells, query.points)
        found.stats.seconds["smooth"] = clock() - began
        return Finished("any-angle", _line_of(found.cells, points), query.straight_m)


@copies_alike
class CellsByCosts:
    """Cheapest paths of cells stay as the method found them."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self._frame = grid.frame

    def finished(self, query: Query, found: Found) -> Finished:  # noqa: ARG002 - as of the others
        """Return the path as it is; see `Finish`."""
        points = self._frame.points_of(found.cells)
        length_m = path_length_in_cells(found.cells) * self._frame.resolution_m
        bound = found.optimum or found.lower_bound_m
        return Finished("weighted", Path(found.cells, points, length_m), bound, found.cost_m)


@copies_alike
class CutShort:
    """Cheapest paths of cells become any-angle ones, as cheap or cheaper, maybe with arcs."""

    def __init__(self, costs: CostFinish, smooth: Smooth) -> None:
        self._costs, self._has_arcs = costs, smooth == "arcs"

    def finished(self, query: Query, found: Found) -> Finished:
        """Return the any-angle path; see `Finish`."""
        began = clock()
        points, cells = self._costs.shortened(query, found.cells), found.cells
        if self._has_arcs:
            path, cost_m = self._costs.arcs(query, cells, points)
        else:
            path, cost_m = self._costs.line(cells, points)
        found.stats.seconds["smooth"] = clock() - began
        bound = partial(self._costs.bound, query, cost_m)
        return Finished("any-angle-weighted", path, bound, cost_m, found.lower_bound_m)


@copies_alike
class LineByCosts:
    """Cheapest any-angle paths stay as they are, or their bends become arcs."""

    def __init__(self, costs: CostFinish, metric: Metric, smooth: Smooth) -> None:
        self._costs, self._metric, self._has_arcs = costs, metric, smooth == "arcs"

    def finished(self, query: Query, found: Found) -> Finished:
        """Return the path; see `Finish`."""
        points = found.points
        assert points is not None  # noqa: S101 - any-angle methods state them
        cells = partial(cells_of, found)
        if self._has_arcs:
            began = clock()
            path, cost_m = self._costs.arcs(query, cells, points)
            found.stats.seconds["arcs"] = clock() - began
        else:
            path, cost_m = _line_of(cells, points), found.cost_m
        bound = partial(self._costs.bound, query, cost_m)
        return Finished(self._metric, path, bound, cost_m, line=points)


@copies_alike
class CostFinish:
    """The last step of plans by costs: length and cost of a path, and its any-angle finish.

    `layer`: costs of its cells; `settings`: whether unexplored cells may be entered, and the
    turning radius.
    """

    def __init__(self, grid: OccupancyGrid, layer: CostLayer, settings: PlannerSettings) -> None:
        self.layer = layer
        self._grid = grid
        self._allow_unexplored = settings.allow_unexplored
        self._turning_radius_m: float = getattr(settings, "turning_radius_m", math.nan)

    def shortened(self, query: Query, cells: LongArray) -> FloatArray:
        """Return the any-angle path that cells are cut short to, `(x, y)` in metres."""
        return shorten(self._line, query.closed, cells, query.points)

    def line(self, cells: Source[LongArray], points: FloatArray) -> tuple[Path, float]:
        """Return an any-angle path, and its cost in metres.

        `cells`: those that it passes, or how to find them; `points`: `(x, y)` in metres.
        """
        path = _line_of(cells, points)
        return path, max(cost_along(self._grid, self.layer, points), path.length_m)

    def arcs(
        self, query: Query, cells: Source[LongArray], points: FloatArray
    ) -> tuple[Path, float]:
        """Return an any-angle path with rounded bends, and its cost in metres; see `line`. Where
        arcs would cross a side the wrong way, the path keeps its bends."""
        line, closed = self._line_for(query.closed), query.closed
        found = line.arcs(points, radius_m=self._turning_radius_m)
        # Measured as it was made.
        at = partial(made, found.points)
        path = Path(cells, at, found.length_m, found.headings_rad, is_curved=True)
        if closed is not None and closed.one_way is not None and len(points) > 1:
            curve = line.on_grain(path.poses(_CHORD * self._grid.resolution_m)[:, :2])
            first, last = map(tuple, path.cells[[0, -1]].tolist())
            if wrong_at(closed.one_way, line.free, curve, (first, last)) is not None:
                return self.line(path.cells, points)
        return path, max(found.cost_m, found.length_m)

    def bound(self, query: Query, cost_m: float) -> float:
        """Return a lower bound on the cost of all any-angle paths of a query, in metres.

        It is at most the cost of a path that is known; where corners may be cut, it is the
        distance.
        """
        if self._grid.corner_cutting:
            return min(query.straight_m, cost_m)
        # Loads modules that plans whose bound nobody reads do not need.
        from hybridnav.search.lattice import cost_bound  # noqa: PLC0415

        line, frame = self._line_for(query.closed), self._grid.frame
        first, last = (frame.position_of(*point.tolist()) for point in query.points)
        per_cell = frame.resolution_m
        known = cost_m / per_cell
        found = cost_bound(line.free, line.factors, (first, last), query.cells, known)
        if query.one_way is not None:  # no cost is below a length
            from hybridnav.search.proofs import strings_near  # noqa: PLC0415 - as above

            given = line.free, (first, last), known, query.one_way
            found = max(found, strings_near(*given)[1] * (1 - 2e-9))
        return min(max(found * per_cell, query.straight_m), cost_m)

    def _line_for(self, closed: ClosedCells | None) -> CostLine:
        """Return the shortener of paths; with closed cells, one for this query."""
        return self._line if closed is None else self._line.closing(closed.flat)

    @cached_property
    def _line(self) -> CostLine:
        from hybridnav.refine import CostLine  # noqa: PLC0415 - with costs alone

        return CostLine(self._grid, self.layer, allow_unexplored=self._allow_unexplored)
