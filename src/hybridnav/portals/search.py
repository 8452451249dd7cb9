"""The portal planner: paths over portals of fields that are grown for planning alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import chain, islice
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._progress import no_progress
from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.portals import _answer_kernels as kernels
from hybridnav.portals._path_kernels import FAR, Tables, centres
from hybridnav.portals.any_angle_bound import AnyAngleBound
from hybridnav.portals.build import (
    PathTooLongError,
    PortalsTooLargeError,
    build_portals,
    compact_labels,
)
from hybridnav.portals.distances import build_tables
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.search._costs import DIAGONAL, STRAIGHT
from hybridnav.search._kernels import octile_cost
from hybridnav.search.octile import cost_of, length_in_cells, length_of_cost

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from hybridnav._progress import Progress
    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.portals.any_angle_bound import Position
    from hybridnav.portals.build import Portals
    from hybridnav.pyramid import Level
    from hybridnav.search.grid_search import GridSearch
    from hybridnav.topology import TopologicalMap

Cell = tuple[int, int]

SPACING = 16
"""Of portals, in cells, where every border cell can be a gate."""
SPARSE_SPACINGS = (16, 32, 64, 128, 256)
"""Of portals and gates where that would take too much memory: open floors have long borders."""
ALL_GATES_LEVELS = 2
"""So many levels are tried with gates everywhere, before fewer gates are."""
MAX_BYTES_PER_CELL = 640
MAX_SPARSE_BYTES_PER_CELL = 160
LEAST_BYTES = 16e6
"""What any map may take."""
LEAST_FIELDS = 16
"""With fewer fields of the size asked for, half the size is tried: a field is searched cell by cell
where start and goal share it."""

_SHORTEST = math.sqrt(2) * STRAIGHT / DIAGONAL
"""A path is as much shorter than its integer cost says at most: DIAGONAL / STRAIGHT > sqrt 2."""


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


@dataclass(frozen=True, eq=False)
class PortalAnswers:
    """Paths of many queries over portals, arrays of n."""

    is_done: BoolArray
    """bool (n,), whether `PortalSearch.path` answers the same; others need a search of cells."""
    length_cells: FloatArray
    """float64 (n,), infinite where there is no path."""
    lower_bound_cells: FloatArray
    path_start: LongArray
    """int64 (n + 1,), where the points of each path begin."""
    points: FloatArray
    """float64 (m, 2), centres of cells in the map frame."""


@dataclass(frozen=True, eq=False)
class BuiltPortals:
    """What is built of a map before paths are found over its portals."""

    field_of: NDArray[np.int16 | np.int32]
    """int16 or int32 (rows, cols), the field of each cell, -1 for none."""
    portals: Portals
    tables: Tables
    has_all_gates: bool
    """Whether every border cell was a gate."""


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
    allow_unexplored
        Whether unexplored cells may be entered; as in `cell_search`.
    built
        What another search has built of the same map with the same settings, None to build it.
    progress
        Called after each step of building with the number of steps done and of all.
    """

    def __init__(
        self,
        topology: TopologicalMap,
        cell_search: GridSearch,
        *,
        allow_unexplored: bool = False,
        built: BuiltPortals | None = None,
        progress: Progress = no_progress,
    ) -> None:
        grid = topology.grid
        self._cols = grid.shape[1]
        self._search = cell_search
        if built is None:
            enterable = grid.enterable(allow_unexplored=allow_unexplored)
            field_of, portals, has_all_gates = _portals_of(topology, enterable, allow_unexplored)
            progress(1, 2)
            built = BuiltPortals(field_of, portals, build_tables(portals), has_all_gates)
            progress(2, 2)
        self.built = built
        self._field_of, self.is_exact = built.field_of, built.has_all_gates
        self.portals, self.tables = built.portals, built.tables
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

    def path(self, start: Cell, goal: Cell, *, epsilon: float = 0.0) -> PortalAnswer:
        """A shortest path between two cells, and a lower bound on the length of any.

        Where every border cell is a gate, look-ups find it; elsewhere a search of cells goes on
        from the best way over gates.

        Parameters
        ----------
        start, goal
            Cells that may be entered.
        epsilon
            The search ends once no path can be shorter by more than this part.
        """
        cols, expanded = self._cols, 0
        upper, inside = FAR, None
        if self._field_of[start] == self._field_of[goal]:
            one = np.zeros(self.portals.n_fields, dtype=np.bool_)
            one[self._field_of[start]] = True
            found = self._search.search(start, goal, field_of=self._field_of, in_corridor=one)
            inside, expanded = found.cells, found.expanded
            upper = FAR if inside is None else cost_of(inside)
        cost, lower, walked, cells, points = kernels.answer(
            self.portals, self.tables, cols, start[0] * cols + start[1], goal[0] * cols + goal[1],
            upper, epsilon, self._frame,
        )  # fmt: skip
        line = octile_cost(start[0] - goal[0], start[1] - goal[1])
        lower = max(line, lower) if self.is_exact else line
        lower = min(lower, cost)
        if cost >= FAR:
            return PortalAnswer(None, np.empty((0, 2)), math.inf, math.inf, walked, expanded)
        if lower * (1 + epsilon) < cost:
            found = self._search.search(start, goal, limit=cost)
            expanded += found.expanded
            cells = np.empty((0, 2), np.int64) if found.cells is not None else cells
            inside = inside if found.cells is None else found.cells
            cost = lower = cost if found.cells is None else cost_of(found.cells)
        if inside is not None and not len(cells):
            cells, points = inside, centres(inside, self._frame)
        length = length_of_cost(cost)
        bound = length if lower >= cost else lower / STRAIGHT * _SHORTEST
        return PortalAnswer(cells, points, length, bound, walked, expanded)

    def many(self, starts: LongArray, goals: LongArray, *, epsilon: float = 0.0) -> PortalAnswers:
        """`path` for many pairs of cells, as far as look-ups answer them.

        Parameters
        ----------
        starts, goals
            int64 (n, 2), cells that may be entered.
        epsilon
            As in `path`.
        """
        rows = np.array([self._cols, 1])
        costs, lower, begin, points = kernels.answers(
            self.portals, self.tables, self._cols, starts @ rows, goals @ rows, epsilon, self._frame
        )
        away = np.abs(starts - goals)
        line = away.max(axis=1) * STRAIGHT + away.min(axis=1) * (DIAGONAL - STRAIGHT)
        lower = np.minimum(np.maximum(line, lower) if self.is_exact else line, costs)
        share = self._field_of[tuple(starts.T)] == self._field_of[tuple(goals.T)]
        is_done = (lower * (1 + epsilon) >= costs) & ~share
        length, bound = length_in_cells(costs), lower / STRAIGHT * _SHORTEST
        unreached = costs >= FAR
        length[unreached] = bound[unreached] = math.inf
        bound = np.where(lower >= costs, length, bound)
        return PortalAnswers(is_done, length, bound, begin, points)

    def any_angle_bound(
        self, start: Cell, goal: Cell, positions: tuple[Position, Position]
    ) -> float:
        """No any-angle path between two points is shorter, in cells.

        Parameters
        ----------
        start, goal
            The cells that hold the points.
        positions
            The points as (row, column) in grid units: cell (0, 0) spans [0, 1] x [0, 1].
        """
        fields = int(self._field_of[start]), int(self._field_of[goal])
        if not self.is_exact:
            return math.dist(*positions)
        return self._any_angle_bound.of(*fields, *positions)

    @cached_property
    def _any_angle_bound(self) -> AnyAngleBound:
        return AnyAngleBound(self.portals)


def _portals_of(
    topology: TopologicalMap,
    enterable: BoolArray,
    allow_unexplored: bool,  # noqa: FBT001
) -> tuple[NDArray[np.int16 | np.int32], Portals, bool]:
    """Fields to route on and their portals, the first that fit into memory, and whether every
    border cell is a gate."""
    n_cells = max(int(enterable.sum()), 1)
    for level, spacing, gate_spacing in _choices(topology):
        field_of = compact_labels(level.field_of, enterable)
        has_all_gates = gate_spacing == 1
        limit = MAX_BYTES_PER_CELL if has_all_gates else MAX_SPARSE_BYTES_PER_CELL
        try:
            portals = build_portals(
                topology.grid,
                field_of,
                spacing_cells=spacing,
                gate_spacing_cells=gate_spacing,
                allow_unexplored=allow_unexplored,
                max_bytes=max(limit * n_cells, LEAST_BYTES),
            )
        except (PortalsTooLargeError, PathTooLongError):
            continue
        return field_of, portals, has_all_gates
    raise InvalidValueError("no level of the map makes portals of an acceptable size")


def _choices(topology: TopologicalMap) -> Iterator[tuple[Level, int, int]]:
    """Levels and spacings of portals and of gates: those with gates everywhere first."""
    levels = _routing_levels(topology)
    first = list(islice(levels, ALL_GATES_LEVELS))
    for level in first:
        yield level, SPACING, 1
    for level in chain(first, levels):
        for spacing in SPARSE_SPACINGS:
            yield level, spacing, spacing


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
