"""Method `grid-astar`: grid A* on the whole map; and what other methods of cells share with it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from hybridnav._base.clock import clock
from hybridnav._base.moves import octile_distance_in_cells
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.typing import BoolArray, LongArray
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.costs import CostLayer
from hybridnav.planning import PlannerSettings
from hybridnav.planning.methods.own_refiner import own_refiner
from hybridnav.refine import GridRefiner
from hybridnav.search.found import ClosedCells, Found, Method, Metric, PlanStats, Query
from hybridnav.search.grid_search import directed_moves
from hybridnav.topology import TopologicalMap

if TYPE_CHECKING:
    from hybridnav.search.distance_table import LabelSource


class KnownMap(NamedTuple):
    """What a method is made for: a map, and what is known of it."""

    grid: OccupancyGrid
    """The map."""
    topology: TopologicalMap | None
    """Its places; None where a changed grid has none yet."""
    costs: CostLayer | None = None
    """Costs of the cells; None for lengths."""
    prepared: object | None = None
    """Structures that another method of the same map and settings has built."""

    def refiner(self, settings: PlannerSettings) -> GridRefiner:
        """Return the search of cells by these costs."""
        allowed = settings.allow_unexplored
        return GridRefiner(self.grid, allow_unexplored=allowed, costs=self.costs)


def on_cells(
    refiner: GridRefiner,
    cells: LongArray | None,
    *,
    bound_cells: float | None = None,
    stats: PlanStats,
) -> Found:
    """Return the answer for a path of cells: its cost, and its bound, the cost itself for None."""
    per_cell = refiner.grid.resolution_m

    def cost_m() -> float:
        return refiner.cost_in_cells(cells) * per_cell

    if bound_cells is None:
        cost = cost_m()
        return Found(cells, cost, cost, stats=stats)
    # The cost along the cells is counted if somebody reads it: a path that is smoothed has its own.
    return Found(cells, cost_m, bound_cells * per_cell, stats=stats)


def round_closed(found: Found, query: Query, refiner: GridRefiner) -> Found:
    """Return the answer itself if it meets nothing closed, else the best path round all of it.

    What is closed makes no path shorter, so a bound stays valid.
    """
    closed = query.closed
    if closed is None or not found.has_path or not closed.meets(found.cells, refiner.grid):
        return found
    began = clock()
    path = refiner.search.search(*query.cells, blocked=closed.flat, one_way=closed.one_way)
    seconds = {**found.stats.seconds, "around": clock() - began}
    expanded = found.stats.expanded + path.expanded
    if path.cells is None:
        return Found(None, stats=PlanStats(expanded=expanded, seconds=seconds))
    stats = replace(found.stats, expanded=expanded, seconds=seconds)
    return on_cells(refiner, path.cells, stats=stats)


def enterable_of(grid: OccupancyGrid, cells: LongArray, *, allow_unexplored: bool) -> BoolArray:
    """Return which of some cells (row, col) may be entered."""
    classes = grid.classes[tuple(cells.T)]
    is_open: BoolArray = classes == CellClass.FREE
    return is_open | (classes == CellClass.UNEXPLORED) if allow_unexplored else is_open


class WholeMap(Method):
    """Grid A* on the whole map: optimal; or a refiner of the user's own, with the octile bound.

    `known`: the map and its costs; `settings`: whether unexplored cells may be entered, and the
    refiner, used where nothing is closed.
    """

    def __init__(self, known: KnownMap, settings: PlannerSettings) -> None:
        self.metric: Metric = "octile" if known.costs is None else "weighted"
        self.refiners = known.refiner(settings), own_refiner(known.grid, settings)
        """The search of cells, with the costs; and that of the user's own, None for none."""

    def prepare(self, progress: Progress = no_progress) -> object:
        """Build the search of cells; see `Method`."""
        search = self.refiners[0].search
        progress(1, 1)
        return search

    def labels(self, closed: ClosedCells | None = None) -> LabelSource | None:
        """Return labels of lengths, or by costs a search from each start; None with a refiner of
        the user's own. See `Method`."""
        if self.refiners[1] is not None:
            return None
        # Loads kernels for tables alone.
        from hybridnav.search.distance_table import GridLabels  # noqa: PLC0415
        from hybridnav.search.octile.labels import jump_labels  # noqa: PLC0415

        refiner = self.refiners[0]
        cells, cutting = refiner.enterable(closed), refiner.grid.corner_cutting
        units = None if refiner.costs is None else refiner.costs.units
        one_way = None if closed is None else closed.one_way
        by_cells = cutting or units is not None or one_way is not None
        found = None if by_cells else jump_labels(cells)
        moves = directed_moves(cells, one_way, corner_cutting=cutting)
        return found or GridLabels(moves, units)

    def find(self, query: Query) -> Found:
        """Find a shortest path; see `Method`."""
        began = clock()
        refiner, own = self.refiners
        cells, expanded = (own or refiner).refine(*query.cells, None)
        # A refiner of the user's own proves nothing.
        bound = octile_distance_in_cells(*query.cells) if own is not None else None
        seconds = {"refine": clock() - began}
        stats = PlanStats(expanded=expanded, seconds=seconds)
        found = on_cells(refiner, cells, bound_cells=bound, stats=stats)
        return round_closed(found, query, refiner)
