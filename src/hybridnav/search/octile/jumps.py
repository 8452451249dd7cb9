"""The jump-point graph of free cells, its contraction, and shortest octile paths on it, exact."""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, fields, replace
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hybridnav._base.copies import copies_alike
from hybridnav._base.kernels.places import places_of
from hybridnav._base.moves import DIAGONAL, FAR, STRAIGHT
from hybridnav._base.threads import SHARES, Pool, cores
from hybridnav.maps.geometry import centres
from hybridnav.search.contraction import NO_ARC, contract, renumbered
from hybridnav.search.octile.kernels import queries as kernels
from hybridnav.search.octile.kernels.legs import (
    BACKWARD,
    COLUMN_BITS,
    KIND_BITS,
    ONWARD,
    CornerCells,
    arcs_of,
    components,
    legs_that_follow,
)
from hybridnav.search.octile.kernels.tables import look_ahead, number_cells
from hybridnav.search.octile.sides import (
    near_sides,
    offsets_by,
    strong_parts,
    with_corners,
    with_reverses,
)
from hybridnav.search.watched import octile_of, recorded

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._base.typing import (
        AnyArray,
        BoolArray,
        FloatArray,
        IntArray,
        LongArray,
    )
    from hybridnav.search.directed import DirectedSides
    from hybridnav.search.watched import SearchRecord


_SHORT = 32_000
"""Longest side of a map whose distances fit 16 bits."""
_SETTLED = 1
"""Most corner cells that a witness search settles during contraction, so that it sees single arcs.
With 10 there are 4 to 13 % fewer shortcuts, in twice the time."""
_MOST_LOOKED = 400
"""Arcs per free cell that the contraction may examine before it is given up. Most maps need fewer
than 50, the worst of 43 real ones 250; noise, with a tenth of all cells blocked one by one, would
take minutes."""


@copies_alike
@dataclass(frozen=True, eq=False)
class JumpGraph:
    """Corner cells, arcs between those without another one in between, and distances to them.

    A corner cell has a blocked cell at one of its corners, with free cells beside it: shortest
    paths turn there. An arc is a leg: moves along one diagonal and one side next to it, which may
    come in any order. Cells are those of the smallest rectangle round all free ones, in a frame of
    blocked ones; a flat cell is its place in that rectangle.

    Contracted, arcs lead from each corner cell to cells that were contracted after it, and corner
    cells are numbered from the last one contracted to the first.
    """

    origin: tuple[int, int]
    """Row and column of the frame's first cell."""
    shape: tuple[int, int]
    """Rows and columns of the framed rectangle."""
    index: LongArray
    """int64 (words, 3), for every 64 flat cells: the free ones, the corner cells, and the counts of
    both before them, free ones in the high half."""
    ahead: NDArray[np.int16 | np.int32]
    """int16 or int32 (n_free, 8), by free cell in the order of rows and by direction. Along a side
    it is the distance to the next corner cell, along a diagonal to the next cell that is a corner
    cell or sees one along a side. If there is none, it is minus the number of legal moves."""
    order: IntArray
    """int32 (n,), the number of each corner cell in the order of rows."""
    places: LongArray
    """int64 (n,), row and column in the frame of each corner cell and its blocked corners."""
    first: IntArray
    """int32 (n + 1,), where the arcs of each corner cell begin."""
    arcs: LongArray
    """int64 (m, 2), the cost of each arc in the units of `hybridnav.search`, its head, the class of
    its first leg, and of its last one backwards."""
    middles: LongArray
    """int64 (m,), the corner cell that a shortcut leads past and two of its arcs, see `contract` in
    the kernels. -1 for an arc of the graph; empty where the graph is not contracted."""
    component: IntArray
    """int32 (n,), the connected part of the graph that each corner cell belongs to; of one with
    directions the strong part, first those of parts that are not strong."""
    behind: NDArray[np.int16 | np.int32] | None = None
    """As `ahead`, of the moves backwards, if they have directions; else None."""
    reach: BoolArray | None = None
    """bool (k, k), whether each of the first k parts can be left for each other one; or None."""

    @property
    def n_corners(self) -> int:
        """Number of corner cells."""
        return len(self.places)

    @property
    def is_contracted(self) -> bool:
        """Whether arcs lead only to corner cells contracted later."""
        return len(self.middles) > 0

    @property
    def memory_bytes(self) -> int:
        """Bytes of its arrays."""
        arrays = (getattr(self, part.name) for part in fields(self))
        return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))


def build_jump_graph(free: BoolArray, one_way: DirectedSides | None = None) -> JumpGraph:
    """Build the jump-point graph of free cells.

    Parameters
    ----------
    free
        bool (rows, cols); cells outside are blocked.
    one_way
        Sides that may be crossed in one direction only; None for none.

    Returns
    -------
    JumpGraph
        Without corner cells if no path turns. Work and memory are linear in cells, except for the
        arcs.

    Notes
    -----
    Beside sides with a direction, cells are corner cells where a turn cannot be replaced by moves
    past them. By replacing all others, diagonal moves first, a shortest path becomes one of legs
    with their diagonal first: these are the arcs, each from where it is legal. The last leg, to a
    goal that is no corner cell, becomes one with its diagonal last.

    D. Harabor, T. Uras, P. Stuckey, S. Koenig: Regarding jump point search and subgoal graphs,
    2019. T. Uras, S. Koenig, C. Hernández: Subgoal graphs for optimal pathfinding in eight-neighbor
    grids, 2013 (arcs where no other corner cell lies between).

    Examples
    --------
    >>> from hybridnav.search.octile import build_jump_graph
    >>> free = np.ones((4, 6), dtype=bool)
    >>> free[1:3, 2:4] = False
    >>> build_jump_graph(free).n_corners
    4
    """
    rows, cols = (np.flatnonzero(free.any(axis=axis)) for axis in (1, 0))
    low = (int(rows[0]), int(cols[0])) if len(rows) else (0, 0)
    high = (int(rows[-1]) + 1, int(cols[-1]) + 1) if len(rows) else (0, 0)
    inside = np.ascontiguousarray(free[low[0] : high[0], low[1] : high[1]])
    framed = np.pad(inside.view(np.uint8), 1)
    height, width = framed.shape
    halts, corners, kinds, index = number_cells(framed)
    distances = np.int16 if max(inside.shape) <= _SHORT else np.int32
    ahead = np.empty((int(np.count_nonzero(inside)), 8), dtype=distances)
    origin, barred, behind = (low[0] - 1, low[1] - 1), np.empty((0, width), np.uint8), ahead
    if one_way is not None:
        barred, against, *near = near_sides(framed, one_way, origin)
        corners, kinds = with_corners((index, halts), corners, kinds, near)
        behind = np.empty_like(ahead)
        look_ahead(framed, halts, behind, against)
    look_ahead(framed, halts, ahead, barred)
    row, col = np.divmod(corners.astype(np.int64), width)
    places = (row << COLUMN_BITS | col) << KIND_BITS | kinds
    order, none = np.arange(len(corners), dtype=np.int32), np.empty(0, np.int64)
    tables = [(index, each, order, width) for each in (ahead, behind)]
    first, arcs = arcs_of(*tables, corners, places, one_way is not None)
    if one_way is None:
        component, further = components(first, arcs), list[Any]()
    else:
        component, reach = strong_parts(first, arcs)
        first, arcs = with_reverses(first, arcs)
        further = [behind, reach]
    arrays = index, ahead, order, places, first, arcs, none, component, *further
    for array in arrays:
        array.flags.writeable = False
    return JumpGraph(origin, (height, width), *arrays)


def contract_graph(graph: JumpGraph) -> JumpGraph:
    """Contract a jump-point graph, which makes queries several times faster.

    If there are several shortest paths, a contracted graph may find another one.

    Parameters
    ----------
    graph
        A graph that is not contracted; unchanged.

    Returns
    -------
    JumpGraph
        The contracted graph, or the graph itself if contraction takes too long.

    Notes
    -----
    R. Geisberger, P. Sanders, D. Schultes, D. Delling: Contraction hierarchies: faster and simpler
    hierarchical routing in road networks, 2008.

    Examples
    --------
    >>> from hybridnav.search.octile import build_jump_graph, contract_graph
    >>> free = np.ones((4, 6), dtype=bool)
    >>> free[1:3, 2:4] = False
    >>> contract_graph(build_jump_graph(free)).is_contracted
    True
    """
    kinds = (graph.places & (1 << KIND_BITS) - 1).astype(np.uint8)
    effort = _SETTLED, _MOST_LOOKED * len(graph.ahead)
    n, tails = graph.n_corners, np.repeat(np.arange(graph.n_corners), np.diff(graph.first))
    # Corner cells with arcs in one direction alone are left: between the others, and to them, arcs
    # lead both ways.
    is_lone = graph.arcs[:, 1] >> 6 & (ONWARD | BACKWARD) > 0
    lone, kept = graph.arcs[is_lone], np.isin(np.arange(n), tails[is_lone])
    kept = kept if len(lone) else kept[:0]
    first, arcs = offsets_by(tails[~is_lone], n), graph.arcs[~is_lone]
    *found, taken = contract(kinds, first, arcs, legs_that_follow(), effort, kept)
    if len(arcs) and not len(found[1]):
        return graph
    if len(lone):
        at = found[0][tails[is_lone] + 1]
        found[0] = found[0] + offsets_by(tails[is_lone], n)
        found[1], found[2] = np.insert(found[1], at, lone, axis=0), np.insert(found[2], at, -1)
    top_first = taken[::-1]
    order = np.empty(len(taken), np.int32)
    order[top_first] = np.arange(len(taken), dtype=np.int32)
    first, arcs, middles = renumbered(*found, order)
    places, component = graph.places[top_first], graph.component[top_first]
    for array in (order, places, component, first, arcs, middles):
        array.flags.writeable = False
    return replace(
        graph,
        order=order,
        places=places,
        first=first,
        arcs=arcs,
        middles=middles,
        component=component,
    )


# Shortest octile paths on a jump-point graph, exact.


KERNEL = kernels.path_between
"""The kernel whose compiled form shows that a search was run before."""

Cell = tuple[int, int]

_LEAST = 64
"""Least number of queries that justifies a thread."""


class JumpPath(NamedTuple):
    """A shortest path between two cells; its cells are None if there is none."""

    cells: LongArray | None
    """int64 (n, 2), (row, col) of the cells passed."""
    length_cells: float
    """Length of the path, a + b sqrt 2 of its moves; infinite for none."""
    expanded: int
    """Corner cells that the search expanded."""


@dataclass(frozen=True, eq=False)
class JumpPaths:
    """Shortest paths between many pairs of cells, arrays of n."""

    length_cells: FloatArray
    """float64 (n,), infinite where there is no path."""
    path_start: LongArray
    """int64 (n + 1,), where the cells of each path begin."""
    cells: AnyArray
    """int64 (c, 2), (row, col) of the cells passed; or float64, their centres `(x, y)`."""
    expanded: LongArray
    """int64 (n,), corner cells that each search expanded."""


class _Work:
    """Work arrays of one query."""

    def __init__(self, n_corners: int, n_arcs: int) -> None:
        records = np.full((n_corners, 4), FAR, dtype=np.int64)
        # A corner cell is expanded at most once, so each arc is queued at most once.
        heaps = tuple(np.empty((n_corners + n_arcs + 1, 2), dtype=np.int64) for _ in range(2))
        touched, found = np.empty(n_corners, np.int64), np.empty(n_corners, np.int32)
        self.arrays = records, heaps, touched, found
        self.places: LongArray | None = None
        """The places of the graph's arrays and of these, once somebody has asked for them."""


@copies_alike
class JumpSearch:
    """Exact shortest octile paths over the free cells of a graph; threads may share it.

    Moves go to the 8 neighbours; a diagonal needs both side cells free (no corner cutting).

    Parameters
    ----------
    graph
        The graph of the map's free cells, contracted or not.

    Notes
    -----
    D. Harabor, T. Uras, P. Stuckey, S. Koenig: Regarding jump point search and subgoal graphs,
    2019.

    Examples
    --------
    >>> from hybridnav.search.octile import JumpSearch, build_jump_graph
    >>> search = JumpSearch(build_jump_graph(np.ones((3, 4), dtype=bool)))
    >>> search.path((0, 0), (2, 3)).length_cells
    3.8284271247461903
    """

    def __init__(self, graph: JumpGraph) -> None:
        self.graph = graph
        tables = graph.index, graph.ahead, graph.order, graph.shape[1]
        back = tables if graph.behind is None else (tables[0], graph.behind, *tables[2:])
        reach = np.empty((0, 0), np.bool_) if graph.reach is None else graph.reach
        reach.flags.writeable = False
        corners, arcs = (graph.places, graph.component), (graph.first, graph.arcs)
        self.arrays = CornerCells(tables, *corners, legs_that_follow(), *arcs, back, reach)
        self._works = Pool(partial(_Work, graph.n_corners, len(graph.arcs)))

    def path(self, start: Cell, goal: Cell) -> JumpPath:
        """Find a shortest path between two free cells."""
        work = self._works.take()
        given = self._given(work)
        cells, straight, diagonal, expanded = kernels.path_between(*given, (start, goal))
        self._works.give(work)
        if straight < 0:
            return JumpPath(None, math.inf, expanded)
        return JumpPath(cells, straight + diagonal * math.sqrt(2.0), expanded)

    def _given(self, work: _Work) -> tuple[LongArray, AnyArray, AnyArray]:
        """Return what kernels take of the graph and of work arrays."""
        arrays, graph = self.arrays, self.graph
        places = work.places
        if places is None:
            (index, _, order, width), *corners = arrays[:6]
            rest = graph.middles, arrays.reach, width, *graph.origin, work.arrays
            places = work.places = places_of(index, order, *corners, *rest)
        return places, arrays.tables[1], arrays.back[1]

    def watch(self, start: Cell, goal: Cell) -> SearchRecord:
        """Search between two free cells, and return the corner cells that were reached.

        A contracted graph is searched from both ends; the parents of a cell lead to its own end.
        """
        graph, work = self.graph, _Work(self.graph.n_corners, len(self.graph.arcs))
        records, _, touched, _ = work.arrays
        touched[:] = -1
        given = self._given(work)
        path, straight, diagonal, _ = kernels.path_between(*given, (start, goal))
        nodes = touched[: np.argmax(np.append(touched, -1) < 0)]
        side, which = np.nonzero(records[nodes, 2:].T != FAR)  # the kernel clears costs alone
        nodes = nodes[which]
        by = records[nodes, 2 + side]
        begins, row = by == NO_ARC, graph.places[nodes] >> COLUMN_BITS + KIND_BITS
        col = graph.places[nodes] >> KIND_BITS & (1 << COLUMN_BITS) - 1
        cells = np.stack([row, col], axis=1).astype(np.int64) + np.array(graph.origin)
        ends = np.array([start, goal])
        number = np.full((2, graph.n_corners), -1)
        number[side, nodes] = np.arange(len(nodes))
        parents = np.where(begins, -1, number[side, np.where(begins, 0, by >> 32)])
        first = octile_of(abs(cells - ends[side]))
        steps = first.copy()  # of a graph that may have no arc
        steps[~begins] = graph.arcs[by[~begins] & 0xFFFFFFFF, 0]
        best = straight * STRAIGHT + diagonal * DIAGONAL if straight >= 0 else None
        return recorded(cells, parents, steps, ends[1 - side], (best, path))

    def many(
        self, starts: LongArray, goals: LongArray, frame: tuple[float, ...] | None = None
    ) -> JumpPaths:
        """Find shortest paths between many pairs of free cells, int64 (n, 2) each, on all cores.

        With a `Frame.for_kernels` the cells are stated by their centres.
        """
        endpoints = np.ascontiguousarray(np.hstack([starts, goals]).reshape(-1, 4), dtype=np.int64)
        n_parts = max(1, min(SHARES * cores(), len(endpoints) // _LEAST))
        with ThreadPoolExecutor(cores()) as pool:
            found = list(pool.map(self._paths, np.array_split(endpoints, n_parts)))
            ends = np.cumsum([0, *(len(part[1]) for part in found)])
            cells = np.empty((ends[-1], 2), np.int64 if frame is None else np.float64)

            def put(k: int) -> None:
                part = found[k][1]
                cells[ends[k] : ends[k + 1]] = part if frame is None else centres(part, frame)

            list(pool.map(put, range(n_parts)))
        counts = np.concatenate([part[2] for part in found])
        length = counts[:, 0] + counts[:, 1] * math.sqrt(2.0)
        length[counts[:, 0] < 0] = np.inf
        sizes = np.concatenate([np.diff(part[0]) for part in found])
        path_start = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
        return JumpPaths(length, path_start, cells, counts[:, 2])

    def _paths(self, endpoints: LongArray) -> tuple[Any, Any, Any]:
        """Return the offsets of the paths, their cells, and the moves and expansions of each."""
        work = self._works.take()
        found: tuple[Any, Any, Any] = kernels.paths(*self._given(work), endpoints)
        self._works.give(work)
        return found
