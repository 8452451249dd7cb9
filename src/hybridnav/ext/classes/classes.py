"""Homotopy classes of routes on a plane graph, as reduced words of a free group.

Two routes between the same places are of one class when one can be pushed into the other without
crossing a hole. Every arc has a word: round an ordinary face the words cancel, and round a hole
they leave one generator. The class of a route is the reduced product along its arcs, self-loops
included. The search with such signatures is an idea of S. Bhattacharya, M. Likhachev, V. Kumar:
Topological constraints in search-based robot path planning, 2012.

Cells have words too. A contracted base edge reads the identity, and one that stands for an arc
reads its word. A removed one reads a word with which the full 2x2 blocks beside it read the
identity. So a path of cells has the class of its route, however it winds through the fields and
round the holes inside one field.
"""

from __future__ import annotations

from collections import deque
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass
from hybridnav.pyramid.islands import RIM, Islands

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.topology.map import TopologicalMap

Word = tuple[int, ...]
"""Generators 1, 2, ... and their inverses -1, -2, ..., none beside its own inverse."""

IDENTITY: Word = ()

_EAST, _SOUTH = 0, 3


def product(*words: Word) -> Word:
    """Return the reduced product of reduced words.

    Parameters
    ----------
    words
        Reduced words, in order.
    """
    result: list[int] = []
    for word in words:
        at = 0
        while at < len(word) and result and result[-1] == -word[at]:
            result.pop()
            at += 1
        result.extend(word[at:])
    return tuple(result)


def inverse(word: Word) -> Word:
    """Return the inverse of a word."""
    return tuple(-letter for letter in reversed(word))


class CellWords(NamedTuple):
    """Words of the steps between cells that may be entered."""

    of_edge: IntArray
    """int32 (2 rows cols,), number of the word of each base edge (2 * flat cell, plus 1 for a step
    north), read from the lower cell to the higher one; 0 the identity, a minus the inverse."""
    words: list[Word]
    """The word of each number; that of 0 is the identity."""


class HomotopyClasses:
    """Words of the arcs between places that may be entered, and of the steps between their cells.

    Places that may not be entered are removed from the graph first: the faces round them become one
    hole. The rest may fall into connected parts; for each a spanning tree of the dual is rooted at
    its outer face. Arcs that the tree does not cross have the empty word. From the leaves to the
    root, the arc between a face and its parent receives a word: with it the face's boundary, read
    in rotation order from that arc, is the identity, or one new generator for a hole.

    Parameters
    ----------
    topology
        The map.
    allow_unexplored
        Whether unexplored places may be entered.
    least_hole_m2
        Holes of a smaller area do not count: routes on both sides are of one class. The area is
        that of the hole filled: obstacles, with all that they surround.

    Raises
    ------
    InvalidValueError
        When the area is negative or not a number.

    Examples
    --------
    >>> from hybridnav.ext.classes import HomotopyClasses
    >>> probability = np.zeros((3, 3))
    >>> probability[1, 1] = 1.0
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(probability, robot_radius_m=0))
    >>> classes = HomotopyClasses(hn.TopologicalMap(pyramid))
    >>> ring = [(0, 0), (0, 1), (0, 2), (1, 2), (2, 2), (2, 1), (2, 0), (1, 0), (0, 0)]
    >>> classes.word_of_path(np.array(ring))
    (-1,)
    """

    def __init__(
        self,
        topology: TopologicalMap,
        *,
        allow_unexplored: bool = False,
        least_hole_m2: float = 1.0,
    ) -> None:
        if not 0 <= least_hole_m2 < np.inf:
            raise InvalidValueError(
                f"least hole must be a finite number of square metres >= 0, got {least_hole_m2}"
            )
        level = topology.level
        self._level = level
        self.enterable: BoolArray = level.classes == CellClass.FREE
        if allow_unexplored:
            self.enterable = np.ones_like(self.enterable)
        self.enterable_cells = topology.grid.enterable(allow_unexplored=allow_unexplored)
        """bool (rows, cols), the cells of places that may be entered."""
        kept: BoolArray = np.asarray(self.enterable[level.arcs].all(axis=1))
        self.phi = _phi_without(level.sigma, kept)
        self.face_of = _orbits(self.phi)
        """int64 (2 n_arcs,), the face on the right of each dart that is left, -1 for others."""
        self.roots: list[int] = []
        """The outer face of each connected part, whose reading the other faces determine."""
        self.areas_m2: FloatArray = np.zeros(int(self.face_of.max(initial=-1)) + 1)
        """float64 (n_faces,), area of the hole in each face, 0 for ordinary ones and infinite for
        outer faces."""
        self._measure(topology)
        self.is_hole: BoolArray = (self.areas_m2 > 0) & (self.areas_m2 >= least_hole_m2)
        self.words: list[Word] = [IDENTITY] * len(kept)
        """The word of dart 2a of each arc a; that of 2a + 1 is its inverse."""
        self._assign()

    def word_of_route(self, darts: Iterable[int]) -> Word:
        """Return the class of a route.

        Parameters
        ----------
        darts
            The darts passed: 2a along arc a, 2a + 1 against it, self-loops included.
        """
        words = self.words
        return product(*(inverse(words[d >> 1]) if d & 1 else words[d >> 1] for d in darts))

    def word_of_path(self, cells: LongArray) -> Word:
        """Return the class of a path of cells.

        Parameters
        ----------
        cells
            int64 (n, 2), moves without corner cutting over cells that may be entered.
        """
        cols = self.enterable_cells.shape[1]
        # A diagonal goes by the cell in its own row: full blocks read the identity.
        corners = np.empty((2 * len(cells) - 1, 2), dtype=np.int64)
        corners[::2] = cells
        corners[1::2, 0], corners[1::2, 1] = cells[:-1, 0], cells[1:, 1]
        flat = corners[:, 0] * cols + corners[:, 1]
        low, step = np.minimum(flat[:-1], flat[1:]), np.diff(flat)
        moved = step != 0
        edges = 2 * low + (corners[:-1, 0] != corners[1:, 0])
        numbers = (np.sign(step) * self.cell_words.of_edge[np.where(moved, edges, 0)])[moved]
        words = self.cell_words.words
        return product(
            *(words[n] if n > 0 else inverse(words[-n]) for n in numbers[numbers != 0].tolist())
        )

    @cached_property
    def cell_words(self) -> CellWords:
        """The words of base edges."""
        from hybridnav.ext.classes.kernels.trees import spread_words  # noqa: PLC0415 - loads numba

        of_edge = np.zeros(2 * self.enterable_cells.size, dtype=np.int32)
        carrying = np.array([word != IDENTITY for word in self.words], dtype=np.bool_)
        arcs = np.flatnonzero(carrying)
        of_edge[self._level.base_edges[arcs]] = 1 + np.arange(len(arcs))
        products = spread_words(self.enterable_cells, self._level.removed_edges, of_edge)
        words = [IDENTITY, *(self.words[arc] for arc in arcs.tolist())]
        for factors in products.tolist():
            words.append(product(*(words[n] if n > 0 else inverse(words[-n]) for n in factors)))
        number_of = {IDENTITY: 0}
        renumbered = np.zeros(len(words), dtype=np.int32)
        distinct = [IDENTITY]
        for number, word in enumerate(words):
            if inverse(word) in number_of:
                renumbered[number] = -number_of[inverse(word)]
                continue
            if word not in number_of:
                number_of[word] = len(distinct)
                distinct.append(word)
            renumbered[number] = number_of[word]
        return CellWords(np.sign(of_edge) * renumbered[np.abs(of_edge)], distinct)

    def _round(self, start: int) -> list[int]:
        """Return the darts of a face's boundary, in rotation order from one of them."""
        darts, dart = [start], int(self.phi[start])
        while dart != start:
            darts.append(dart)
            dart = int(self.phi[dart])
        return darts

    def _measure(self, topology: TopologicalMap) -> None:
        """Find the outer faces, and the areas of the holes among the cells that may be entered."""
        cells = self.enterable_cells
        masked = np.where(cells, np.uint8(CellClass.FREE), np.uint8(CellClass.OCCUPIED))
        islands = Islands.of_classes(masked)
        outer = self._level.face_darts(islands.component_cell, _SOUTH, among=cells)
        self.roots = self.face_of[outer[outer >= 0]].tolist()
        inner = self._level.face_darts(islands.obstacle_cell[RIM + 1 :], _EAST, among=cells)
        found = inner >= 0
        filled = islands.filled_cells()[RIM + 1 :] * topology.grid.cell_area_m2
        self.areas_m2[self.face_of[inner[found]]] = filled[found]
        self.areas_m2[self.roots] = np.inf

    def _assign(self) -> None:
        n_faces = len(self.areas_m2)
        darts_of: list[list[int]] = [[] for _ in range(n_faces)]
        for dart in np.flatnonzero(self.face_of >= 0).tolist():
            darts_of[int(self.face_of[dart])].append(dart)
        # The dart on each face whose arc leads to the parent; order runs from roots to leaves.
        up = np.full(n_faces, -1, dtype=np.int64)
        seen = np.zeros(n_faces, dtype=np.bool_)
        seen[self.roots] = True
        queue, order = deque(self.roots), []
        while queue:
            face = queue.popleft()
            for dart in darts_of[face]:
                beyond = int(self.face_of[dart ^ 1])
                if not seen[beyond]:
                    seen[beyond] = True
                    up[beyond] = dart ^ 1
                    order.append(beyond)
                    queue.append(beyond)
        generator = 0
        for face in reversed(order):
            dart = int(up[face])
            target = IDENTITY
            if self.is_hole[face]:
                generator += 1
                target = (generator,)
            word = product(target, inverse(self.word_of_route(self._round(dart)[1:])))
            self.words[dart >> 1] = inverse(word) if dart & 1 else word


def _phi_without(sigma: LongArray | np.ndarray, kept: BoolArray) -> LongArray:
    """Return the next dart round the face in the map of the kept arcs alone, -1 for other darts."""
    n_darts = len(sigma)
    following = np.full(n_darts, -1, dtype=np.int64)
    stays = np.repeat(kept, 2)
    for dart in np.flatnonzero(stays).tolist():
        after = int(sigma[dart ^ 1])
        while not stays[after]:
            after = int(sigma[after])
        following[dart] = after
    return following


def _orbits(phi: LongArray) -> LongArray:
    face_of = np.full(len(phi), -1, dtype=np.int64)
    count = 0
    for start in np.flatnonzero(phi >= 0).tolist():
        if face_of[start] >= 0:
            continue
        dart = start
        while face_of[dart] < 0:
            face_of[dart] = count
            dart = int(phi[dart])
        count += 1
    return face_of
