"""The portal planner: routes over portals of fields that are chosen for routing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.route import _answer_kernels as kernels
from hybridnav.route._portal_kernels import FAR, Work
from hybridnav.route.portal_table import build_tables
from hybridnav.search._costs import DIAGONAL, STRAIGHT
from hybridnav.search.octile import cost_of, length_of_cost
from hybridnav.topology.portals import (
    PathTooLongError,
    PortalsTooLargeError,
    build_portals,
    compact_labels,
)
from hybridnav.topology.thin_portals import beside_sources

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.pyramid import Level
    from hybridnav.search.grid_search import GridSearch
    from hybridnav.topology import TopologicalMap
    from hybridnav.topology.portals import Portals

Cell = tuple[int, int]
Effort = Literal["stored", "narrow", "wide"]

SPACINGS = (16, 4, 1)
"""Of portals, sources and gates, in cells, where every border cell can be a gate."""
SPARSE_SPACINGS = (16, 32, 64, 128, 256)
"""Of all three where that would take too much memory: open floors have long borders."""
MAX_BYTES_PER_CELL = 640
MAX_SPARSE_BYTES_PER_CELL = 160
LEAST_BYTES = 16e6
"""What any map may take."""
LEAST_FIELDS = 16
"""With fewer fields of the size asked for, half the size is tried: a field is searched cell by cell
where start and goal share it."""

_SHORTEST = math.sqrt(2) * STRAIGHT / DIAGONAL
"""A path is as much shorter than its integer cost says at most: DIAGONAL / STRAIGHT > sqrt 2."""
_MODES = {"stored": kernels.STORED, "narrow": kernels.NARROW, "wide": kernels.WIDE}


@dataclass(frozen=True, eq=False)
class PortalAnswer:
    """A path over portals; None for its cells where there is none."""

    cells: LongArray | None
    """int64 (n, 2)."""
    points: FloatArray
    """float64 (n, 2), their centres in the map frame."""
    length_cells: float
    """Its length, infinite for none."""
    lower_bound_cells: float
    expanded_gates: int
    expanded: int
    """Cells that were expanded."""


class PortalSearch:
    """Paths over portals, and lower bounds on all paths.

    The fields are not the places: a level of its own, grown with the linkage "survivor" and twice
    the merge distance of the places, routes better and costs less.

    Parameters
    ----------
    topology
        The map; of it only the grid, the merge distance and the seed are used.
    cell_search
        Searches inside fields, over cells that paths may use.
    all_gates
        Whether paths may cross borders at all cells, not only beside sources.
    allow_unexplored
        Whether unexplored cells may be entered; as in `cell_search`.
    """

    def __init__(
        self,
        topology: TopologicalMap,
        cell_search: GridSearch,
        *,
        all_gates: bool = True,
        allow_unexplored: bool = False,
    ) -> None:
        grid = topology.grid
        self._cols = grid.shape[1]
        self._search = cell_search
        enterable = grid.enterable(allow_unexplored=allow_unexplored)
        n_cells = max(int(enterable.sum()), 1)
        for level in _routing_levels(topology):
            self._field_of = compact_labels(level.field_of, enterable)
            portals = self._fitting(grid, n_cells, allow_unexplored=allow_unexplored)
            if portals is not None:
                break
        else:
            raise InvalidValueError("no level of the map makes portals of an acceptable size")
        self.is_exact = all_gates and self._has_all_gates
        kept = None if all_gates or not self._has_all_gates else beside_sources(portals)
        self.portals, self.tables = build_tables(portals, kept=kept, bounded=self._has_all_gates)
        self._work = _work_of(self.portals)
        frame = grid.frame
        self._frame = (
            frame.resolution_m,
            *frame.origin_m,
            math.cos(frame.yaw_rad),
            math.sin(frame.yaw_rad),
        )

    @property
    def field_of(self) -> NDArray[np.int16 | np.int32]:
        """int16 or int32 (rows, cols), the field of each cell, -1 for none."""
        return self._field_of

    def _fitting(
        self, grid: OccupancyGrid, n_cells: int, *, allow_unexplored: bool
    ) -> Portals | None:
        """The portals with the closest spacing that fit into memory."""
        sparse = [(spacing,) * 3 for spacing in SPARSE_SPACINGS]
        for spacings in (SPACINGS, *sparse):
            self._has_all_gates = spacings is SPACINGS
            limit = MAX_BYTES_PER_CELL if self._has_all_gates else MAX_SPARSE_BYTES_PER_CELL
            try:
                return build_portals(
                    grid,
                    self._field_of,
                    spacing_cells=spacings[0],
                    source_spacing_cells=spacings[1],
                    gate_spacing_cells=spacings[2],
                    allow_unexplored=allow_unexplored,
                    max_bytes=max(limit * n_cells, LEAST_BYTES),
                )
            except PortalsTooLargeError:
                continue
            except PathTooLongError:
                break
        return None

    def path(
        self, start: Cell, goal: Cell, *, effort: Effort, epsilon: float = 0.0
    ) -> PortalAnswer:
        """A short path between two cells, and a lower bound on the length of any.

        Parameters
        ----------
        start, goal
            Cells that may be entered.
        effort
            How far the first way is improved: not at all ("stored"), to the shortest over gates of
            its fields ("narrow"), or to the shortest of all ("wide"). Ways of less than 256 cells
            are improved to the shortest of all always.
        epsilon
            "narrow" and "wide" stop once no path can be shorter by more than this part.
        """
        cols, expanded = self._cols, 0
        upper, inside = FAR, None
        if self._field_of[start] == self._field_of[goal]:
            one = np.zeros(self.portals.n_fields, dtype=np.bool_)
            one[self._field_of[start]] = True
            inside, expanded = self._inside(start, goal, one, None)
            upper = FAR if inside is None else cost_of(inside)
        cost, path, lower, gates = kernels.answer(
            self.portals, self.tables, cols, start[0] * cols + start[1],
            goal[0] * cols + goal[1], upper,
            _MODES[effort] if self.is_exact else kernels.STORED, epsilon, self._work,
        )  # fmt: skip
        if cost >= FAR:
            return PortalAnswer(None, np.empty((0, 2)), math.inf, math.inf, gates, expanded)
        better, searched = None, 0
        by_cells = effort == "stored" or not self.is_exact
        if by_cells and lower < cost and (effort == "wide" or cost < kernels.SHORT):
            found = self._search.search(start, goal, limit=cost)
            better, searched = found.cells, found.expanded
            lower = cost if better is None else cost_of(better)
        elif effort == "narrow" and not self.is_exact:
            better, searched = self._inside(start, goal, self.fields_passed(), cost)
        expanded += searched
        if better is not None:
            path, inside, cost = np.empty(0, np.int64), better, cost_of(better)
            lower = min(lower, cost)
        if len(path) or inside is None:
            cells, points = kernels.unfold(path, cols, *self._frame)
        else:
            cells, points = inside, kernels.centres(inside, *self._frame)
        length = length_of_cost(cost)
        bound = length if lower >= cost else lower / STRAIGHT * _SHORTEST
        return PortalAnswer(cells, points, length, bound, gates, expanded)

    def fields_passed(self) -> BoolArray:
        """bool (F,), fields of the first way of the last query."""
        passed: BoolArray = self._work.passed == self._work.generation[0]
        return passed

    def _inside(
        self, start: Cell, goal: Cell, fields: BoolArray, limit: int | None
    ) -> tuple[LongArray | None, int]:
        """The shortest path on the cells of some fields, if it costs less than a limit."""
        found = self._search.search(
            start, goal, field_of=self._field_of, in_corridor=fields, limit=limit
        )
        return found.cells, found.expanded


def _work_of(portals: Portals) -> Work:
    gates, sides, fields = portals.n_gates, 2 * portals.n_portals, portals.n_fields

    def whole(count: int) -> LongArray:
        return np.zeros(count, dtype=np.int64)

    return Work(
        at=whole(gates),
        seen=whole(gates),
        parent=whole(gates),
        via=whole(gates),
        ahead=whole(gates),
        side_seen=whole(sides),
        side_ahead=whole(sides),
        passed=whole(fields),
        generation=whole(1),
    )


def _routing_levels(topology: TopologicalMap) -> Iterator[Level]:
    """Levels to route on: the one with the largest fields that make enough of them first, then
    larger ones, which have fewer portals, then smaller ones, which have shorter paths."""
    pyramid, resolution_m = topology.pyramid, topology.grid.resolution_m
    widest_m = 2 * max(topology.grid.shape) * resolution_m

    def level_of(distance_m: float) -> Level:
        return DualGraphPyramid.build(
            topology.grid, merge_distance_m=distance_m, linkage="survivor", seed=pyramid.seed
        )[-1]

    first_m = min(2 * pyramid.merge_distance_m, widest_m)
    level = level_of(first_m)
    while not _has_enough_fields(level) and first_m >= 8 * resolution_m:
        first_m /= 2
        level = level_of(first_m)
    yield level
    distance_m = 2 * first_m
    while distance_m < 2 * widest_m:
        yield level_of(distance_m)
        distance_m *= 2
    distance_m = first_m / 2
    while distance_m > resolution_m:
        yield level_of(distance_m)
        distance_m /= 2


def _has_enough_fields(level: Level) -> bool:
    large = level.areas[level.classes == CellClass.FREE] > level.areas.max(initial=0) / 100
    return int(large.sum()) >= LEAST_FIELDS
