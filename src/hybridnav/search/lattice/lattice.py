"""The lattice of a map, one node for each part of a block of cells, and lines of little cost."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.threads import Pool, cores
from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.search.lattice.kernels import queries as kernels
from hybridnav.search.lattice.kernels.build import (
    NO_PART,
    REACH,
    choose_landmarks,
    costs_from,
    lay_edges,
    lay_nodes,
)

_SIDES = ((4, 0.35), (2, 0.5), (1, 4.0))
"""Cells on a side of a block, and the most walls beside a free cell, in the mean: where there are
many, nodes of large blocks are not on the way."""
_LANDMARKS = 12
_FEW = 256
_MOST_SPENT = 2.0
"""Nodes, in those of the map, with which a lattice that was renewed is built anew."""


@copies_alike
@dataclass(frozen=True, eq=False)
class Lattice:
    """Nodes and edges over the free cells of a map; a value, which updates replace.

    A block has 4 x 4 cells; in narrow maps, such as mazes, 2 x 2 or one. Each connected part of its
    free cells has a node, in its cheapest cell. Edges lead to blocks up to a knight's move away:
    straight segments with the exact integral of the factors along them. Parts that meet without
    seeing each other are joined by the cheapest path of cells inside them. So two cells are
    connected in the lattice just if they are on the grid.

    Examples
    --------
    >>> from hybridnav.search.lattice import build_lattice
    >>> lattice = build_lattice(np.ones((8, 8), bool), np.ones((8, 8), np.float32))
    >>> lattice.cells.tolist(), lattice.side
    ([9, 13, 41, 45], 4)
    """

    free: AnyArray
    """uint8 (rows, cols), 1 where a cell may be entered."""
    factors: AnyArray
    """float32 (rows, cols), >= 1."""
    nodes_of: AnyArray
    """int32 (blocks, 2), the first node of each block, and how many it has."""
    parts: AnyArray
    """uint8 (rows, cols), the part of each free cell in its block, 255 for other cells."""
    cells: AnyArray
    """int32 (nodes,), flat cells; after updates also nodes that no block has any more."""
    edges_of: AnyArray
    """int64 (nodes, 2), the first edge of each node, and how many it has."""
    to: AnyArray
    """int32 (edges,), the node at the other end; each edge is listed at both."""
    costs: AnyArray
    """float32 (edges,), cost in cells, below 0 for an edge inside two parts."""
    landmarks: AnyArray
    """float32 (nodes, k), the cost from each landmark to each node, infinite where there is no
    path; k is 0 without landmarks, which make searches faster."""
    side: int
    """Cells on a side of a block."""

    @property
    def arrays(self) -> kernels.LatticeNet:
        """The lattice as kernels take it."""
        return kernels.LatticeNet(*(getattr(self, name) for name in kernels.LatticeNet._fields))

    @property
    def n_nodes(self) -> int:
        """Number of nodes that blocks have."""
        return int(self.nodes_of[:, 1].sum())

    def renewed(self, free: BoolArray, factors: FloatArray, changed: LongArray) -> Lattice:
        """Return the lattice after some cells changed, without landmarks.

        Parameters
        ----------
        free, factors
            As for `build_lattice`, of all cells now.
        changed
            int64 (k,), flat cells; no other cell may differ.
        """
        if not len(changed):
            return self
        rows, cols = free.shape
        side = self.side
        down, across = -(-rows // side), -(-cols // side)
        is_changed = np.zeros((down, across), np.bool_)
        row, col = np.divmod(changed, cols)
        is_changed[row // side, col // side] = True
        # Edges that pass a changed block have both ends this near to it.
        is_near = is_changed.copy()
        for block in np.argwhere(is_changed):
            low, high = np.maximum(block - REACH, 0), block + REACH + 1
            is_near[low[0] : high[0], low[1] : high[1]] = True
        laid = np.flatnonzero(is_changed), np.flatnonzero(is_near)
        before = (
            self.nodes_of.copy(), self.parts.copy(), self.cells, self.edges_of, self.to, self.costs
        )  # fmt: skip
        made = _laid(free, factors, side, laid, before)
        return _built(free, factors) if made.is_spent or _side_of(free) != side else made

    def with_landmarks(self, n: int = _LANDMARKS) -> Lattice:
        """Return the lattice with landmarks, at most `n`, found on all cores.

        Lines do not depend on them: costs of edges are such that hardly two lines cost the same.

        Notes
        -----
        A. Goldberg, C. Harrelson: Computing the shortest path: A* search meets graph theory, 2005.
        """
        used = np.zeros(len(self.cells), np.bool_)
        for extra in range(int(self.nodes_of[:, 1].max(initial=0))):
            used[self.nodes_of[self.nodes_of[:, 1] > extra, 0] + extra] = True
        nodes = np.flatnonzero(used)
        order = nodes[np.argsort(self.cells[nodes], kind="stable")]
        cols = self.free.shape[1]
        chosen = choose_landmarks(self.edges_of, self.to, self.cells, cols, order, n)
        table = np.full((len(self.cells), len(chosen)), np.inf, np.float32)

        def fill(k: int) -> None:
            table[:, k] = costs_from(self.edges_of, self.to, self.costs, chosen[k])

        with ThreadPoolExecutor(cores()) as pool:
            list(pool.map(fill, range(len(chosen))))
        return replace(self, landmarks=table)

    @property
    def is_spent(self) -> bool:
        """Whether updates have left more unused nodes and edges than used ones."""
        used = int(self.edges_of[:, 1].sum())
        nodes, edges = _MOST_SPENT * self.n_nodes, _MOST_SPENT * used
        return len(self.cells) > nodes + _FEW or len(self.to) > edges + 16 * _FEW


def build_lattice(free: BoolArray, factors: FloatArray) -> Lattice:
    """Build the lattice of a map, with landmarks, in time nearly linear in its cells.

    Parameters
    ----------
    free
        bool (rows, cols), which cells may be entered.
    factors
        float32 (rows, cols), >= 1, cost of a metre in each cell, in metres.

    Raises
    ------
    InvalidValueError
        When the two are no arrays of one shape.

    Examples
    --------
    >>> from hybridnav.search.lattice import build_lattice
    >>> build_lattice(np.ones((8, 8), bool), np.ones((8, 8), np.float32)).n_nodes
    4
    """
    if free.ndim != 2 or free.shape != factors.shape:  # noqa: PLR2004
        raise InvalidValueError(
            f"free cells and factors must have one shape (rows, cols), got {free.shape} and "
            f"{factors.shape}"
        )
    return _built(free, factors).with_landmarks()


def _built(free: BoolArray, factors: FloatArray) -> Lattice:
    """Return the lattice of a map, without landmarks."""
    rows, cols = free.shape
    side = _side_of(free)
    blocks = np.arange(-(-rows // side) * -(-cols // side))
    none = (
        np.zeros((len(blocks), 2), np.int32),
        np.full(free.shape, NO_PART, np.uint8),
        np.empty(0, np.int32),
        np.empty((0, 2), np.int64),
        np.empty(0, np.int32),
        np.empty(0, np.float32),
    )
    return _laid(free, factors, side, (blocks, blocks), none)


def _side_of(free: BoolArray) -> int:
    """Return the cells on a side of a block that suit a map, by the walls beside its free cells."""
    is_free = free != 0
    walls = np.count_nonzero(is_free[1:] != is_free[:-1])
    walls += np.count_nonzero(is_free[:, 1:] != is_free[:, :-1])
    share = int(walls) / max(int(is_free.sum()), 1)
    return next(side for side, most in _SIDES if share <= most)


def _laid(
    free: BoolArray,
    factors: FloatArray,
    side: int,
    blocks: tuple[LongArray, LongArray],
    before: tuple[AnyArray, ...],
) -> Lattice:
    nodes_of, parts, cells, edges_of, to, costs = before
    is_free = np.ascontiguousarray(free).view(np.uint8)
    factor = np.ascontiguousarray(factors, dtype=np.float32)
    # Kernels are compiled once for arrays that may not be written, whatever they are given.
    is_free, factor = is_free.view(), factor.view()
    is_free.flags.writeable = factor.flags.writeable = False
    n, m = len(cells), len(to)
    more = len(blocks[0]) + len(blocks[0]) // 8 + 1
    cells = np.concatenate([cells, np.empty(more, np.int32)])
    cells, n = lay_nodes(is_free, factor, side, blocks[0], nodes_of, parts, cells, n)
    cells = cells[:n].copy()
    of_nodes = np.zeros((n, 2), np.int64)
    of_nodes[: len(edges_of)] = edges_of
    room = 16 * int(nodes_of[blocks[1], 1].sum()) + 1
    to = np.concatenate([to, np.empty(room, np.int32)])
    costs = np.concatenate([costs, np.empty(room, np.float32)])
    to, costs, m = lay_edges(
        is_free, factor, side, blocks[1], nodes_of, parts, cells, of_nodes, to, costs, m
    )
    none = np.empty((n, 0), np.float32)
    return Lattice(
        is_free,
        factor,
        nodes_of,
        parts,
        cells,
        of_nodes,
        to[:m].copy(),
        costs[:m].copy(),
        none,
        side,
    )


# Lines of little cost over a lattice.


Position = tuple[float, float]
Cell = tuple[int, int]

_ROOM = 1024
"""Entries of the open list at first."""


def _work_for(n_nodes: int) -> kernels.Work:
    """Return the work arrays of queries."""
    before, mark = np.empty(n_nodes, np.int32), np.zeros(n_nodes, np.int64)
    rest, heap = np.full(n_nodes, np.inf), np.empty((_ROOM, 2), np.int64)
    return kernels.Work(np.empty(n_nodes), before, mark, rest, np.empty(n_nodes), heap, 0)


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
    on the sides that a cheapest path takes, except for near ties. It costs a percent or two more on
    maps of buildings. To be shortened, see `refine.CostLine`.

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
        self.lattice, self._arrays = lattice, lattice.arrays
        self._works = Pool(partial(_work_for, len(lattice.cells)))

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
        work = self._works.take()
        while True:
            work = work._replace(generation=work.generation + 1)
            found, expanded = kernels.find_line(self._arrays, ends, ends_in, work)
            if expanded != kernels.FULL:
                break
            work = work._replace(heap=np.empty((2 * len(work.heap), 2), np.int64))
        self._works.give(work)
        return LatticeLine(found if len(found) else None, expanded)
