"""Shortest paths of different homotopy classes, shortest first."""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Integral, Real
from time import perf_counter
from typing import TYPE_CHECKING
from weakref import WeakKeyDictionary

import numpy as np
from scipy import ndimage, sparse

from hybridnav._base.kernels.moves import field_distances
from hybridnav._base.moves import legal_moves, length_in_cells
from hybridnav.errors import InvalidValueError
from hybridnav.ext.classes.classes import HomotopyClasses
from hybridnav.ext.classes.kernels import classes as _class_kernels
from hybridnav.ext.classes.kernels import trees as _tree_kernels
from hybridnav.maps.islands import in_runs

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, IntArray, LongArray
    from hybridnav.ext.classes.classes import Word
    from hybridnav.topology import TopologicalMap


Cell = tuple[int, int]

MOST_STATES = 1_000_000
"""Default number of pairs of a cell and a word that a search examines before it gives up."""
TIME_LIMIT_S = 10.0
"""Default number of seconds after which a search gives up."""
_SLICE = 256
"""States that a search takes between looks at the clock: some milliseconds."""
_LARGEST_GAP_M = 1.0
"""A path that comes back nearer to itself than this winds, however large holes are that count."""


@dataclass(frozen=True, eq=False)
class ClassPath:
    """A path and its class."""

    cells: LongArray
    """int64 (n, 2), legal moves."""
    word: Word
    """Reduced word of its class."""
    length_cells: float
    """Octile length."""


@dataclass(frozen=True, eq=False)
class ClassPaths:
    """Outcome of a search."""

    paths: tuple[ClassPath, ...]
    """The shortest first, no class twice."""
    complete: bool
    """Whether these are as many as requested, or all; False if the search gave up."""
    shortest_cells: float
    """Octile length of a shortest path from start to goal, infinite where there is none."""
    is_late: bool = False
    """Whether it gave up because its time was over."""


def alternative_search(
    topology: TopologicalMap, *, allow_unexplored: bool = False, least_hole_m2: float = 1.0
) -> AlternativeSearch:
    """Return the search on a map, made for the first query in up to a second.

    It is kept as long as the map, for the last few areas used.

    Parameters
    ----------
    topology, allow_unexplored, least_hole_m2
        As in `AlternativeSearch`.

    Returns
    -------
    AlternativeSearch
        The same object for the same arguments.

    Examples
    --------
    >>> from hybridnav.ext.classes import alternative_search
    >>> probability = np.zeros((5, 5))
    >>> probability[1:4, 1:4] = 1.0
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(probability, robot_radius_m=0))
    >>> paths = alternative_search(hn.TopologicalMap(pyramid)).paths((0, 0), (4, 4), 3)
    >>> [path.length_cells for path in paths.paths]
    [8.0, 8.0]
    """
    kept = _KEPT.setdefault(topology, {})
    asked = bool(allow_unexplored), float(least_hole_m2)
    made = kept.get(asked)
    if made is None:
        made = AlternativeSearch(
            topology, allow_unexplored=allow_unexplored, least_hole_m2=least_hole_m2
        )
        kept[asked] = made
        for oldest in list(kept)[:-_MOST_KEPT]:
            kept.pop(oldest, None)  # another thread may have been here
    return made


class AlternativeSearch:
    """Search over pairs of a cell and the word of the path to it.

    A* over pairs of a cell and a reduced word, with the exact length of the path that is left as
    the estimate. A path *winds* when it returns after it has circled a hole: it stands on a cell
    that it has passed, or sees one along a row or a column, and the loop between the two cannot be
    drawn together. It sees as far as the side of a square hole of the least area, but at least one
    cell, at most 1 m, and at most half the shortest path. Paths that wind are not pursued: turns
    round a pillar, and paths through a door, round a table and out again.

    A class without a winding shortest path is found, with a shortest path, before any longer class.
    A class with some winding shortest path is found with another path, or not at all; a class whose
    paths all wind is never found.

    Parameters
    ----------
    topology
        The map.
    allow_unexplored
        Whether unexplored cells may be entered.
    least_hole_m2
        Holes of a smaller area do not count.

    Raises
    ------
    InvalidValueError
        When the area is negative, or the grid allows corner cutting: a path between two blocked
        cells that meet at a corner goes through a hole.

    Examples
    --------
    >>> from hybridnav.ext.classes import AlternativeSearch
    >>> probability = np.zeros((5, 5))
    >>> probability[2, 2] = 1.0
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(probability, robot_radius_m=0))
    >>> paths = AlternativeSearch(hn.TopologicalMap(pyramid)).paths((0, 0), (4, 4), 3)
    >>> len(paths.paths), paths.complete
    (2, True)
    """

    def __init__(
        self,
        topology: TopologicalMap,
        *,
        allow_unexplored: bool = False,
        least_hole_m2: float = 1.0,
    ) -> None:
        grid = topology.grid
        if grid.corner_cutting:
            raise InvalidValueError("alternatives need a grid without corner cutting")
        self.classes = HomotopyClasses(
            topology, allow_unexplored=allow_unexplored, least_hole_m2=least_hole_m2
        )
        gap_m = min(math.sqrt(least_hole_m2), _LARGEST_GAP_M)
        self._apart = max(1, round(gap_m / grid.resolution_m))
        words = self.classes.cell_words.words
        self._letters = _tree_kernels.Letters(
            np.cumsum([0, *map(len, words)], dtype=np.int64),
            np.array([letter for word in words for letter in word], dtype=np.int32),
        )
        self._enterable = np.ascontiguousarray(self.classes.enterable_cells)
        self._dead_ends: DeadEnds | None = None
        self._compile()

    def paths(  # noqa: PLR0913 - independent limits of one search
        self,
        start: Cell,
        goal: Cell,
        count: int,
        *,
        closed: LongArray | None = None,
        most_states: int = MOST_STATES,
        time_limit_s: float = TIME_LIMIT_S,
    ) -> ClassPaths:
        """Find paths of different classes.

        Parameters
        ----------
        start, goal
            Cells (row, col) that may be entered.
        count
            Paths at most.
        closed
            int64 (m,), flat cells that may not be entered; None for none. Start and goal are not
            among them. They make no holes: words are those of the open map.
        most_states
            Pairs of a cell and a word that are looked at before the search gives up, from 1 to
            2^26; each takes 85 bytes while the search runs.
        time_limit_s
            Seconds before the search gives up; infinite for no limit. Kernels are compiled before,
            when the search on a map is made.

        Raises
        ------
        InvalidValueError
            When `most_states` is out of range, or the time limit is not a number above 0.
        """
        check_limits(most_states, time_limit_s)
        until = perf_counter() + time_limit_s
        enterable = self._enterable
        if closed is not None:
            enterable = enterable.copy()
            enterable.ravel()[closed] = False
        plane, shortest = self._plane(enterable, start, goal)
        first = start[0] * plane.cols + start[1]
        found, reason = _search(plane, first, count, most_states, until)
        is_whole = reason in {_class_kernels.FOUND, _class_kernels.EXHAUSTED}
        return ClassPaths(found, is_whole, shortest, is_late=reason == _class_kernels.PAUSED)

    def _plane(
        self, enterable: BoolArray, start: Cell, goal: Cell
    ) -> tuple[_class_kernels.Plane, float]:
        """Return what a search works on, and the octile length of a shortest path."""
        cols = enterable.shape[1]
        first, last = start[0] * cols + start[1], goal[0] * cols + goal[1]
        label = np.where(enterable, np.int32(0), np.int32(-1)).ravel()
        left = field_distances(enterable.astype(np.uint8), label, np.array([last]))
        shortest = float(length_in_cells(left[[first]])[0]) if left[first] >= 0 else math.inf
        apart = self._apart if shortest == math.inf else min(self._apart, int(shortest / 2))
        apart = max(1, apart)
        moves = legal_moves(self._dead_ends_of(enterable, apart).left(start, goal), False).ravel()
        of_edge = self.classes.cell_words.of_edge
        plane = _class_kernels.Plane(moves, cols, left, of_edge, self._letters, last, apart)
        return plane, shortest

    def _compile(self) -> None:
        """Compile all kernels, which no time limit counts, by a search on one cell."""
        plane, _ = self._plane(np.ones((1, 1), dtype=np.bool_), (0, 0), (0, 0))
        _search(plane, 0, 1, 64, math.inf)

    def _dead_ends_of(self, enterable: BoolArray, apart: int) -> DeadEnds:
        """Return the dead ends: cells that no shortest path of a class enters. They are kept while
        nothing is closed."""
        if enterable is not self._enterable:
            return DeadEnds(enterable, apart)
        dead_ends = self._dead_ends
        if dead_ends is None or dead_ends.reach != apart:
            self._dead_ends = dead_ends = DeadEnds(enterable, apart)
        return dead_ends


def _search(
    plane: _class_kernels.Plane, first: int, count: int, most_states: int, until: float
) -> tuple[tuple[ClassPath, ...], int]:
    """Return the paths found, and why the search ended: `PAUSED` if its time was over.

    Parameters
    ----------
    plane
        The map of the search, and its goal.
    first
        Flat cell of the start.
    count, most_states
        As in `AlternativeSearch.paths`.
    until
        Time of `perf_counter` at which the search gives up.
    """
    states = _class_kernels.States.of_room(most_states)
    tree = _tree_kernels.Tree.of_room(most_states)
    waiting = _class_kernels.Open.of_room(plane.left.size, most_states, count)
    _class_kernels.begin(plane, states, waiting, first)
    reason, is_late = _class_kernels.PAUSED, False
    while reason == _class_kernels.PAUSED and not is_late:
        reason = _class_kernels.find_classes(plane, states, tree, waiting, _SLICE)
        is_late = reason == _class_kernels.PAUSED and perf_counter() >= until
    found = []
    for state in waiting.goals[: waiting.used[_class_kernels.GOALS]].tolist():
        flat = _class_kernels.path_to(states, state)
        word = tuple(_tree_kernels.word_at(tree, states.word[state]).tolist())
        length = float(length_in_cells(states.cost[[state]])[0])
        found.append(ClassPath(np.stack(np.divmod(flat, plane.cols), axis=1), word, length))
    return tuple(found), reason


def check_limits(most_states: int, time_limit_s: float) -> None:
    """Refuse limits of a search that are out of range.

    Raises
    ------
    InvalidValueError
        When one is.
    """
    if not (isinstance(most_states, Integral) and 1 <= most_states <= _class_kernels.MOST_STATES):
        raise InvalidValueError(
            f"most_states is {most_states!r:.80}, expected a whole number from 1 to "
            f"{_class_kernels.MOST_STATES}: leave it out for {MOST_STATES}"
        )
    if not (isinstance(time_limit_s, Real) and time_limit_s > 0):
        raise InvalidValueError(
            f"time_limit_s is {time_limit_s!r:.80}, expected a number of seconds above 0: "
            f"leave it out for {TIME_LIMIT_S:g}"
        )


_MOST_KEPT = 4
_KEPT: WeakKeyDictionary[TopologicalMap, dict[tuple[bool, float], AlternativeSearch]] = (
    WeakKeyDictionary()
)


# Dead ends: parts of a map that only winding paths enter.


class DeadEnds:
    """The parts of a map behind narrow passages.

    A *passage* is a run of cells along a row or a column from one blocked cell to the next. A path
    enters and leaves the part behind it through the passage alone, at two cells that see each other
    along it. If the loop between the two can be drawn together, the path along the passage is
    shorter and of the same class. Otherwise the path winds if the passage is at most as wide as
    `reach`. So no shortest path of a class that does not wind goes there.

    Parameters
    ----------
    enterable
        bool (rows, cols), the cells that may be entered; moves between them cut no corners.
    reach
        Cells between two cells of a passage at most.
    """

    def __init__(self, enterable: BoolArray, reach: int) -> None:
        self.reach = reach
        self._enterable = enterable
        rows, cols = enterable.shape
        self._node_of = np.full(rows * cols, -1, dtype=np.int32)
        n_passages = 0
        for along_rows in (True, False):
            cells, run_of = _short_runs(enterable if along_rows else enterable.T, reach + 1)
            if not along_rows:
                cells = cells % rows * cols + cells // rows
            # Crossing passages are not two nodes: only the one along a row counts.
            crossed = np.bincount(run_of, self._node_of[cells] >= 0)[run_of] > 0
            numbers, run_of = np.unique(run_of[~crossed], return_inverse=True)
            self._node_of[cells[~crossed]] = n_passages + run_of
            n_passages += len(numbers)
        rest = enterable & (self._node_of < 0).reshape(enterable.shape)
        parts, n_parts = ndimage.label(rest)
        self._node_of[rest.ravel()] = n_passages - 1 + parts[rest]
        self._is_passage = np.arange(n_passages + n_parts) < n_passages
        self._graph = _neighbours(self._node_of.reshape(enterable.shape), n_passages + n_parts)

    def left(self, start: Cell, goal: Cell) -> BoolArray:
        """Return the cells that remain for paths from start to goal.

        Parameters
        ----------
        start, goal
            Cells (row, col) that may be entered.

        Returns
        -------
        BoolArray
            bool (rows, cols).
        """
        first, last = (
            int(self._node_of[row * self._enterable.shape[1] + col]) for row, col in (start, goal)
        )
        behind = _class_kernels.behind_passages(
            self._graph.indptr, self._graph.indices, self._is_passage, first, last
        )
        # The last entry is for the cells of no node, whose number is -1.
        dead = np.append(behind, True)[self._node_of]
        remaining: BoolArray = ~dead.reshape(self._enterable.shape)
        return remaining


def _short_runs(enterable: BoolArray, longest: int) -> tuple[LongArray, LongArray]:
    """Return the flat cells of the short runs along rows, and the number of each cell's run."""
    cols = enterable.shape[1]
    steps = np.diff(np.pad(enterable, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    row, begins = np.nonzero(steps == 1)
    lengths = np.nonzero(steps == -1)[1] - begins
    short = lengths <= longest
    row, begins, lengths = row[short], begins[short], lengths[short]
    return in_runs(row * cols + begins, lengths), np.repeat(np.arange(len(lengths)), lengths)


def _neighbours(node_of: IntArray, n_nodes: int) -> sparse.csr_array:
    """Return the nodes that hold cells with a common side, each pair in both directions."""
    pairs = [np.empty((0, 2), dtype=np.int64)]
    for one, other in ((node_of[:, :-1], node_of[:, 1:]), (node_of[:-1], node_of[1:])):
        between = (one >= 0) & (other >= 0) & (one != other)
        pairs.append(np.stack([one[between], other[between]], axis=1))
    tail, head = np.concatenate(pairs).T
    ones = np.ones(2 * len(tail), dtype=np.int8)
    joined = (np.concatenate([tail, head]), np.concatenate([head, tail]))
    return sparse.coo_array((ones, joined), shape=(n_nodes, n_nodes)).tocsr()
