"""The protocol of planners of cell paths, and what it exchanges: queries and plans."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple, Protocol, runtime_checkable

from hybridnav._base.progress import no_progress
from hybridnav.maps import CellClass
from hybridnav.planner import PlanStats

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hybridnav._base.progress import Progress
    from hybridnav._base.typing import BoolArray, FloatArray, LongArray
    from hybridnav.maps import Frame, OccupancyGrid
    from hybridnav.maps.costs import CostLayer
    from hybridnav.planner import Metric
    from hybridnav.planner.closed import ClosedCells
    from hybridnav.pyramid import Level
    from hybridnav.route import Route
    from hybridnav.search.mesh import MeshSearch
    from hybridnav.search.octile import JumpSearch
    from hybridnav.topology import TopologicalMap

    Prepared = MeshSearch | JumpSearch
    """What planners of cell paths build of a map."""

Cell = tuple[int, int]


class CellQuery(NamedTuple):
    """One query: two cells that may be entered, points in them, and what is closed for it."""

    cells: tuple[Cell, Cell]
    points: tuple[FloatArray, FloatArray]
    """float64 (2,) each, start and goal, `(x, y)` in metres, map frame."""
    closed: ClosedCells | None = None
    """Closed cells, not including start and goal; None for none."""

    @classmethod
    def between(cls, frame: Frame, start: Cell, goal: Cell) -> CellQuery:
        """Return the query between the centres of two cells."""
        points = frame.points_of([start, goal])
        return cls((start, goal), (points[0], points[1]))


class CellQueries(NamedTuple):
    """Many queries with the same closures, arrays of n."""

    cells: tuple[LongArray, LongArray]
    """int64 (n, 2) each, the cells of the starts, and of the goals; they may be entered."""
    points: tuple[FloatArray, FloatArray]
    """float64 (n, 2) each, starts and goals, `(x, y)` in metres, map frame."""
    closed: ClosedCells | None = None
    """Closed cells; a start or a goal may be one. None for none."""


@dataclass(frozen=True, eq=False)
class CellPlan:
    """A path between two cells; its cells are None if none was found."""

    cells: LongArray | None
    points: FloatArray | None = None
    """Centres of the cells, if known already, or the points of an any-angle path."""
    length_cells: float | None = None
    """Length of the path, if known already."""
    bound_cells: float = math.inf
    """Lower bound on the length of all paths, in cells; infinite where it is proved that there is
    none."""
    route: Route | None = None
    """The route that was chosen before the path; None to derive it from the path."""
    stats: PlanStats = field(default_factory=PlanStats)


@dataclass(frozen=True, eq=False)
class CellPlans:
    """Paths of many queries, arrays of n."""

    is_done: BoolArray
    """bool (n,), whether the answer is that of `plan`; False if `plan` must still be called."""
    cost_m: FloatArray
    """float64 (n,), lengths in metres, infinite if there is no path."""
    lower_bound_m: FloatArray
    path_start: LongArray
    """int64 (n + 1,), offsets of the points of each path."""
    points: FloatArray
    """float64 (m, 2), (x, y) in metres, map frame."""


class CellPlanner(Protocol):
    """Planner of cell paths, or of any-angle paths with their cells, on one map by one method."""

    @property
    def metric(self) -> Metric:
        """The metric of all its paths, `octile`, `weighted` or `any-angle`."""
        ...

    @property
    def prepared(self) -> Prepared | None:
        """The structure for queries that is worth keeping, None until it is built."""
        ...

    def prepare(self, progress: Progress = no_progress) -> object:
        """Build the structures for queries, once, and report each step; else the first query does
        it."""
        ...

    def plan(self, query: CellQuery) -> CellPlan:
        """Find a path of the quality that the preset requires, which meets no closed cell."""
        ...

    def plan_many(self, queries: CellQueries) -> CellPlans | None:
        """Find paths for many queries at once; None where `plan` must be called for each.

        A path between cells may meet a closed cell: the caller looks.
        """
        ...

    def bound(self, plan: CellPlan, points: tuple[FloatArray, FloatArray]) -> float:
        """Return a lower bound on all any-angle paths between the points of a plan with a path, in
        metres."""
        ...

    def fields(self, level: Level) -> NDArray[np.int16 | np.int32] | None:
        """Return the field of each cell to which a refiner can be confined.

        Parameters
        ----------
        level
            The level of the places, whose fields some methods plan in.

        Returns
        -------
        NDArray | None
            int16 or int32 (rows, cols), -1 for cells without a field; None if the method plans
            without fields.
        """
        ...


@runtime_checkable
class Updatable(Protocol):
    """A planner of cell paths whose structures follow when costs change."""

    def update(self, costs: CostLayer, box: tuple[int, int, int, int]) -> None:
        """Plan by other costs from now on; no query runs meanwhile.

        Parameters
        ----------
        costs
            The new costs of all cells.
        box
            First row, last row + 1, first column, last column + 1 of the cells that differ.
        """
        ...


@runtime_checkable
class Carried(Protocol):
    """A planner of cell paths whose structures are taken over to the places of a changed map."""

    def carried(self, topology: TopologicalMap, costs: CostLayer | None) -> Carried:
        """Return the planner of a changed map; this one stays as it is until `catch_up`.

        Parameters
        ----------
        topology
            The places of the map now.
        costs
            The costs on it, None for lengths.
        """
        ...

    def catch_up(self) -> None:
        """Bring structures up to date that another planner has built; no query runs meanwhile."""
        ...


@runtime_checkable
class Following(Protocol):
    """A planner of cell paths that plans on the grid alone, and follows its changes."""

    def followed(self, grid: OccupancyGrid, cells: LongArray) -> CellPlanner:
        """Return the planner of a changed map; this one stays as it is.

        Parameters
        ----------
        grid
            The map now.
        cells
            int64 (m, 2), (row, col) of the cells whose class is another one than before.
        """
        ...


def enterable_of(grid: OccupancyGrid, cells: LongArray, *, allow_unexplored: bool) -> BoolArray:
    """Return which of some cells (row, col) may be entered."""
    classes = grid.classes[tuple(cells.T)]
    is_open: BoolArray = classes == CellClass.FREE
    return is_open | (classes == CellClass.UNEXPLORED) if allow_unexplored else is_open
