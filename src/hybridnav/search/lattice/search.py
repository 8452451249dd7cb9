"""Lines of little cost over a lattice."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.threads import Pool
from hybridnav.errors import InvalidValueError
from hybridnav.search.lattice.kernels import queries as kernels

if TYPE_CHECKING:
    from hybridnav._base.typing import AnyArray, FloatArray
    from hybridnav.search.lattice.build import Lattice

Position = tuple[float, float]
Cell = tuple[int, int]

_ROOM = 1024
"""Entries of the open list at first."""


class _Work:
    """Work arrays of one query."""

    def __init__(self, n_nodes: int) -> None:
        self._arrays: tuple[AnyArray, ...] = (
            np.empty(n_nodes),
            np.empty(n_nodes, np.int32),
            np.zeros(n_nodes, np.int64),
            np.full(n_nodes, np.inf),
        )
        self._heap = np.empty((_ROOM, 2), np.int64)
        self._generation = 0

    def next(self, *, larger: bool) -> tuple[AnyArray | int, ...]:
        """Return the arrays with the number of the next query."""
        if larger:
            self._heap = np.empty((2 * len(self._heap), 2), np.int64)
        self._generation += 1
        return *self._arrays, self._heap, self._generation


class LatticeLine(NamedTuple):
    """A line between two positions, and the effort to find it.

    Examples
    --------
    >>> from hybridnav.search.lattice import LatticeLine
    >>> LatticeLine(np.array([[0.5, 0.5], [0.5, 3.5]]), 1).expanded
    1
    """

    positions: FloatArray | None
    """float64 (n, 2), (row, col) in grid units; None if there is no path."""
    expanded: int
    """Number of nodes that the search expanded."""


@copies_alike
class LatticeSearch:
    """Search of a lattice; threads may share it.

    The line leads through nodes of the lattice, by edges in 16 directions. It runs past obstacles
    on the sides that a cheapest path takes, but for near ties, and costs a little more than one: a
    percent or two on maps of buildings. To be shortened, see `refine.CostLine`.

    Parameters
    ----------
    lattice
        The lattice of the map.

    Examples
    --------
    >>> from hybridnav.search.lattice import LatticeSearch, build_lattice
    >>> free, factors = np.ones((4, 12), bool), np.ones((4, 12), np.float32)
    >>> search = LatticeSearch(build_lattice(free, factors))
    >>> search.line((0.5, 0.5), (0.5, 9.0), ((0, 0), (0, 9))).positions
    array([[0.5, 0.5],
           [0.5, 9. ]])
    """

    def __init__(self, lattice: Lattice) -> None:
        self.lattice = lattice
        self._works = Pool(partial(_Work, len(lattice.cells)))

    def line(
        self, start: Position, goal: Position, cells: tuple[Cell, Cell] | None = None
    ) -> LatticeLine:
        """Find a line between two positions.

        The search is A* from the goal: lines to one goal from places on each other agree.

        Parameters
        ----------
        start, goal
            (row, col) in grid units.
        cells
            The free cells (row, col) that hold them; None if they lie inside cells.

        Raises
        ------
        InvalidValueError
            When one of them is no free cell.
        """
        ends = np.array([start, goal])
        ends_in = np.array(cells, dtype=np.int64) if cells else ends.astype(np.int64)
        rows, cols = self.lattice.free.shape
        for row, col in ends_in.tolist():
            if not (0 <= row < rows and 0 <= col < cols and self.lattice.free[row, col]):
                raise InvalidValueError(f"cell ({row}, {col}) is none that may be entered")
        with self._works.lent() as work:
            expanded, larger = kernels.FULL, False
            while expanded == kernels.FULL:
                found, expanded = kernels.find_line(
                    self.lattice.arrays, ends, ends_in, work.next(larger=larger)
                )
                larger = True
        return LatticeLine(found if len(found) else None, expanded)
