"""Paths of least cost on a multilevel overlay."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.threads import Pool
from hybridnav.errors import HybridNavError, InvalidValueError
from hybridnav.search.overlay.kernels import queries as kernels
from hybridnav.search.overlay.kernels.lanes import FAR, NO_PATH
from hybridnav.search.overlay.layout import NodeWork

if TYPE_CHECKING:
    from hybridnav._base.typing import LongArray
    from hybridnav.search.overlay.build import Overlay

KERNEL = kernels.find_path
"""The kernel whose compiled form shows that a search was run before."""

_MOST_NEAR = 1_000_000
"""Most cells of the first search; its open list takes 80 bytes for each."""
_NEAR = 250
"""Cells of the first search where tables answer: a twentieth of the time of such a query."""
_NEAR_WHERE_STALE = 4_000
_NEAR_IN_HALLS = 256_000
_CELLS_A_NODE = 35
"""Half the cells that A* expands while a border cell is expanded."""
_SAMPLES, _TRIES = 16, 4_000

Cell = tuple[int, int]


@dataclass(frozen=True, eq=False)
class OverlayPath:
    """A path of least cost between two cells; its cells are None if there is none."""

    cells: LongArray | None
    """int64 (n, 2), (row, col) of the cells passed."""
    cost_cells: float
    """Cost of the path in cells, of the factors as given; infinite for none."""
    lower_bound_cells: float
    """No path costs less: the least cost in units of the rounded factors, which are not larger."""
    expanded: int
    """Cells that searches among cells expanded, near both ends or inside a field."""
    expanded_border_cells: int
    """Border cells that searches over cliques expanded."""


class _Work:
    """Work arrays of one query."""

    def __init__(self, n_cells: int, n_nodes: int) -> None:
        self.cells = np.full(n_cells, FAR, dtype=np.int32)
        self.nodes = NodeWork(
            distance=np.full(n_nodes, NO_PATH, dtype=np.int64),
            before=np.empty(n_nodes, dtype=np.int32),
            ahead=np.full(n_nodes, -1, dtype=np.int64),
            seen=np.empty(n_nodes, dtype=np.int32),
            counts=np.zeros(1, dtype=np.int64),
        )


@copies_alike
class OverlaySearch:
    """Search of an overlay; threads may share it, also while another one updates the overlay.

    Parameters
    ----------
    overlay
        Fields and costs.
    near_cells
        Cells that A* expands at most, >= 0, before fields are looked at: it settles pairs of cells
        that are close together in less time. Every number finds paths of least cost. None measures
        it on 16 pairs of cells: 250 where tables lead over the map; in open halls, where searches
        over border cells do, as many as take half their time, up to 256,000; and 4,000 at least
        while tables are stale.

    Raises
    ------
    InvalidValueError
        When `near_cells` is out of range.

    Examples
    --------
    >>> from hybridnav.search.overlay import OverlaySearch, build_overlay
    >>> free, factor = np.ones((3, 6), dtype=bool), np.ones((3, 6))
    >>> factor[1, 2:4] = 3.0
    >>> halves = np.arange(6, dtype=np.int32) // 3 + np.zeros((3, 1), dtype=np.int32)
    >>> overlay = build_overlay(free, [halves], factor)
    >>> path = OverlaySearch(overlay).path((1, 0), (1, 5))
    >>> round(path.cost_cells, 3), len(path.cells)
    (5.828, 6)
    >>> overlay.update(np.ones((3, 6)), changed=(1, 2, 2, 4))
    >>> OverlaySearch(overlay).path((1, 0), (1, 5)).cost_cells
    5.0
    """

    def __init__(self, overlay: Overlay, *, near_cells: int | None = None) -> None:
        if near_cells is not None and not (
            isinstance(near_cells, int | np.integer) and 0 <= near_cells <= _MOST_NEAR
        ):
            raise InvalidValueError(
                f"near_cells is {near_cells!r:.60}, expected a whole number from 0 to {_MOST_NEAR}:"
                " leave it out for its default"
            )
        self._overlay = overlay
        self._is_measured = near_cells is None
        self._near_cells = 0 if near_cells is None else int(near_cells)
        self._make_works()
        if self._is_measured:
            self._near_cells = self._measured_near()

    def _make_works(self) -> None:
        self._n_nodes = len(self._overlay.levels.cell_of)
        n_cells = self._overlay.shape[0] * self._overlay.shape[1]
        self._works = Pool(partial(_Work, n_cells, self._n_nodes))

    def _measured_near(self) -> int:
        """Return the cells of the first search, by the border cells of queries without it."""
        rng, cols = np.random.default_rng(0), self._overlay.shape[1]
        flat = rng.integers(self._overlay.shape[0] * cols, size=_TRIES)
        cells = filter(self._overlay.is_open, zip(*divmod(flat, cols), strict=True))
        sampled = list(islice(cells, 2 * _SAMPLES))
        pairs = zip(sampled[:_SAMPLES], sampled[_SAMPLES:], strict=False)
        found = [self._path(*pair, 0.0, 0) for pair in pairs]
        expanded = [path.expanded_border_cells for path in found if path.cells is not None]
        median = float(np.median(expanded)) if expanded else 0.0
        return min(_NEAR + round(_CELLS_A_NODE * median), _NEAR_IN_HALLS)

    def path(self, start: Cell, goal: Cell, *, epsilon: float = 0.0) -> OverlayPath:
        """Find a path of least cost between two cells that may be entered.

        Parameters
        ----------
        start, goal
            (row, col); there is no path from or to a closed cell.
        epsilon
            The search ends once no path can be cheaper by more than this part, finite, >= 0.

        Raises
        ------
        InvalidValueError
            When a cell is not on the map, or epsilon is out of range.
        """
        overlay = self._overlay
        if not 0 <= epsilon < math.inf:
            raise InvalidValueError(f"epsilon must be a finite number >= 0, got {epsilon!r:.80}")
        for cell in (start, goal):
            if not all(0 <= at < size for at, size in zip(cell, overlay.shape, strict=True)):
                raise InvalidValueError(
                    f"cell {cell} is not on the map of {overlay.shape} rows and columns"
                )
        is_stale = self._is_measured and not overlay.is_current
        near_cells = max(self._near_cells, _NEAR_WHERE_STALE) if is_stale else self._near_cells
        return self._path(start, goal, epsilon, near_cells)

    def _path(self, start: Cell, goal: Cell, epsilon: float, near_cells: int) -> OverlayPath:
        overlay = self._overlay
        cols = overlay.shape[1]
        ends = (int(start[0]) * cols + int(start[1]), int(goal[0]) * cols + int(goal[1]))
        with overlay.turn():
            if self._n_nodes != len(overlay.levels.cell_of):
                self._make_works()
            with self._works.lent() as work:
                cost, bound, cells, sums, expanded, expanded_nodes = kernels.find_path(
                    overlay.ground,
                    overlay.levels,
                    overlay.top,
                    ends,
                    float(epsilon),
                    near_cells,
                    work.cells,
                    work.nodes,
                )
            if cost == kernels.TORN:
                raise HybridNavError(
                    f"the stored costs of this overlay lead to no path from {start} to {goal} "
                    "although they state one: build it anew, and report this as a fault"
                )
            if cost >= NO_PATH:
                return OverlayPath(None, math.inf, math.inf, expanded, expanded_nodes)
            real = overlay.cost_of(cells, sums)
        return OverlayPath(cells, real, bound * overlay.cost_unit, expanded, expanded_nodes)
