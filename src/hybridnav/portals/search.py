"""Paths over portals, found by look-ups, and lower bounds on all paths."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.grid.centres import centres
from hybridnav.portals import _answer_kernels as kernels
from hybridnav.portals.any_angle_bound import AnyAngleBound
from hybridnav.search.moves import (
    DIAGONAL,
    FAR,
    STRAIGHT,
    cost_of,
    length_in_cells,
    length_of_cost,
    octile_cost,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.grid import Frame
    from hybridnav.portals.any_angle_bound import Position
    from hybridnav.portals.prepare import BuiltPortals
    from hybridnav.search.grid_search import GridSearch

Cell = tuple[int, int]

_SHORTEST = math.sqrt(2) * STRAIGHT / DIAGONAL
"""Least ratio of a path's length to its integer cost, since DIAGONAL / STRAIGHT > sqrt 2."""


@dataclass(frozen=True, eq=False)
class PortalAnswer:
    """A path over portals; its cells are None if there is none."""

    cells: LongArray | None
    """int64 (n, 2)."""
    points: FloatArray
    """float64 (n, 2), their centres in the map frame."""
    length_cells: float
    """Its length, infinite for none."""
    lower_bound_cells: float
    expanded_border_cells: int
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


class PortalSearch:
    """Search for paths over portals, with lower bounds on all paths.

    Parameters
    ----------
    built
        Fields, portals and tables; see `prepare_portals`.
    cell_search
        Searches inside fields, over cells that paths may use.
    frame
        Turns cells into points.

    Examples
    --------
    >>> from hybridnav.portals import PortalSearch, prepare_portals
    >>> from hybridnav.refine import GridRefiner
    >>> grid = hn.example_map("figure1")
    >>> built = prepare_portals(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    >>> search = PortalSearch(built, GridRefiner(grid).search, grid.frame)
    >>> round(search.path((5, 5), (25, 20)).length_cells, 3)
    27.385
    """

    def __init__(self, built: BuiltPortals, cell_search: GridSearch, frame: Frame) -> None:
        self.built = built
        self._field_of, self.is_exact = built.field_of, built.has_all_gates
        self.portals, self.tables = built.portals, built.tables
        self._cols = built.field_of.shape[1]
        self._search = cell_search
        self._frame = frame.for_kernels

    @property
    def field_of(self) -> NDArray[np.int16 | np.int32]:
        """int16 or int32 (rows, cols), the field of each cell, -1 for none."""
        return self._field_of

    def path(self, start: Cell, goal: Cell, *, epsilon: float = 0.0) -> PortalAnswer:
        """Find a shortest path between two cells, and a lower bound on the length of any.

        Where every border cell is a gate, look-ups find it; elsewhere a search of cells goes on
        from the best path over gates.

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
        """Answer many pairs of cells as `path` does, where look-ups are enough.

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
        """Return a lower bound in cells on all any-angle paths between two points.

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
