"""Boundaries of arcs, and the cells that close them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass

if TYPE_CHECKING:
    from hybridnav._base.typing import LongArray
    from hybridnav.pyramid import Level


def cells_on_boundaries(level: Level, arcs: LongArray) -> list[LongArray]:
    """Find the flat cells that close each of some arcs.

    A diagonal between two places across a boundary has a cell pair of that boundary among the four
    cells round its middle, and needs all four: closing one cell of each pair stops it too.

    Parameters
    ----------
    level
        The level of the arcs, places or rooms.
    arcs
        int64 (n,), dense indices, each once.

    Returns
    -------
    list of LongArray
        The cells of each arc.

    Raises
    ------
    InvalidValueError
        When an arc is a self-loop.
    """
    grid = level.grid
    cols = grid.shape[1]
    loops = arcs[level.is_self_loop[arcs]]
    if len(loops):
        raise InvalidValueError(
            f"arc {loops[0]} of level {level.index} is a self-loop, which separates nothing; "
            "close the place or cells instead"
        )
    closed = []
    for arc in arcs.tolist():
        pairs = level.boundary(arc) @ np.array([cols, 1])
        if grid.corner_cutting:
            # A diagonal past the end of a boundary needs no cell but its own two endpoints.
            closed.append(np.unique(pairs))
            continue
        endpoints = level.arcs[arc]
        beside = np.isin(level.arcs, endpoints).any(axis=1) & ~level.is_self_loop
        beside[arcs] = False
        others = [
            level.boundary(other) @ np.array([cols, 1]) for other in np.flatnonzero(beside).tolist()
        ]
        choices = _choices(pairs, others)
        fields = [_Field(level, vertex) for vertex in endpoints.tolist()]
        costs = [_cost_of(fields, choice, others) for choice in choices]
        closed.append(choices[costs.index(min(costs))])
    return closed


def _choices(pairs: LongArray, others: list[LongArray]) -> list[LongArray]:
    """Return both sides of a boundary, and the cell of each pair that matters less to others."""
    # Sum over other boundaries of the share that a cell closes: a door of one cell counts 1.
    cells = np.concatenate([pairs[:0].ravel(), *(other.ravel() for other in others)])
    shares = np.concatenate([[], *(np.full(other.size, 1 / len(other)) for other in others)])
    known, place = np.unique(np.concatenate([pairs.ravel(), cells]), return_inverse=True)
    share = np.bincount(place[pairs.size :], weights=shares, minlength=len(known))
    heavier = np.subtract(*share[place[: pairs.size].reshape(pairs.shape)].T) > 0
    spared = np.where(heavier, pairs[:, 1], pairs[:, 0])
    return [np.unique(cells) for cells in (pairs[:, 0], pairs[:, 1], spared)]


class _Field:
    """The cells of one vertex in the window that they span."""

    def __init__(self, level: Level, vertex: int) -> None:
        rows, cols = level.receptive_field(vertex).T
        self.kind = CellClass(level.classes[vertex])
        self._corner = int(rows.min()), int(cols.min())
        self._n_cols = level.grid.shape[1]
        shape = int(rows.max()) + 1 - self._corner[0], int(cols.max()) + 1 - self._corner[1]
        self._cells = np.zeros(shape, dtype=np.bool_)
        self._cells[rows - self._corner[0], cols - self._corner[1]] = True
        self._size = len(rows)

    def lost(self, closed: LongArray) -> int:
        """Return the number of cells that are closed, or cut off from most of the field."""
        from scipy import ndimage  # noqa: PLC0415 - half a second that areas and cells do not need

        rows, cols = closed // self._n_cols - self._corner[0], closed % self._n_cols
        cols -= self._corner[1]
        shape = self._cells.shape
        inside = (rows >= 0) & (rows < shape[0]) & (cols >= 0) & (cols < shape[1])
        is_open = self._cells.copy()
        is_open[rows[inside], cols[inside]] = False
        components, _ = ndimage.label(is_open)
        return self._size - int(np.bincount(components.ravel())[1:].max(initial=0))


def _cost_of(
    fields: list[_Field], closed: LongArray, others: list[LongArray]
) -> tuple[int, int, int]:
    """Return the number of other arcs closed too, and of free and of all cells lost.

    Cells are lost if they are closed or cut off from their field.
    """
    pairs = np.concatenate([closed[:0].reshape(0, 2), *others])
    of_arc = np.repeat(np.arange(len(others)), [len(other) for other in others])
    is_shut = np.isin(pairs, closed).any(axis=1)
    arcs = len(others) - len(np.unique(of_arc[~is_shut]))
    lost = {CellClass.FREE: 0, CellClass.UNEXPLORED: 0}
    for field in fields:
        lost[field.kind] += field.lost(closed)
    return arcs, lost[CellClass.FREE], sum(lost.values())
