"""Homotopy classes of routes on a plane graph, as reduced words of a free group.

Two routes between the same places are of one class when one can be pushed into the other without
crossing a hole. Every arc gets a word so that round an ordinary face the words cancel and round a
hole they leave one generator; the class of a route is the reduced product along its arcs. To search
with such signatures is the idea of S. Bhattacharya, M. Likhachev, V. Kumar: Topological constraints
in search-based robot path planning, 2012.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.pyramid.dual import FaceKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.topology.map import TopologicalMap

Word = tuple[int, ...]
"""Generators 1, 2, ... and their inverses -1, -2, ..., none beside its own inverse."""

IDENTITY: Word = ()


def product(*words: Word) -> Word:
    """The reduced product of reduced words.

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
    """The inverse of a word."""
    return tuple(-letter for letter in reversed(word))


class HomotopyClasses:
    """Words of the arcs between places that may be entered.

    Places that may not be entered are taken out of the graph first: the faces round them become one
    hole. Of the faces that are left, a spanning tree of the dual is rooted at the largest hole, the
    outside where there is one. Arcs that it does not cross get the empty word; from the leaves to
    the root, the arc between a face and its parent gets the word that makes the face's boundary,
    read in rotation order from that arc, the identity, or one new generator for a hole.

    Parameters
    ----------
    topology
        The map.
    allow_unexplored
        Whether unexplored places may be entered.
    least_hole_m2
        Holes of a smaller area do not count: routes on both sides are of one class.

    Raises
    ------
    InvalidValueError
        When the area is negative or not a number.
    """

    def __init__(
        self,
        topology: TopologicalMap,
        *,
        allow_unexplored: bool = False,
        least_hole_m2: float = 1.0,
    ) -> None:
        if not least_hole_m2 >= 0:
            raise InvalidValueError(
                f"least hole must be a number of square metres >= 0, got {least_hole_m2}"
            )
        level = topology.level
        self.enterable: BoolArray = level.classes == CellClass.FREE
        if allow_unexplored:
            self.enterable = np.ones_like(self.enterable)
        kept: BoolArray = np.asarray(self.enterable[level.arcs].all(axis=1))
        self.phi = _phi_without(level.sigma, kept)
        self.face_of = _orbits(self.phi)
        """int64 (2 n_arcs,), the face on the right of each dart that is left, -1 for others."""
        self.areas_m2 = _hole_areas(topology, kept, self.enterable, self.face_of)
        """float64 (n_faces,), area of the hole in each face, 0 for ordinary ones."""
        self.is_hole: BoolArray = (self.areas_m2 > 0) & (self.areas_m2 >= least_hole_m2)
        self.words: list[Word] = [IDENTITY] * len(kept)
        """The word of dart 2a of each arc a; that of 2a + 1 is its inverse."""
        self.roots: list[int] = []
        """One face of each connected part of the graph, whose reading the others determine."""
        self._assign()

    def word_of_dart(self, dart: int) -> Word:
        """The word of a dart."""
        word = self.words[dart >> 1]
        return inverse(word) if dart & 1 else word

    def word_of_route(self, start: int, arcs: Iterable[int], ends: LongArray) -> Word:
        """The class of a route.

        Parameters
        ----------
        start
            Dense index of the first place.
        arcs
            Dense indices of the arcs passed, none of them a self-loop.
        ends
            int (n_arcs, 2), the places that each arc joins.
        """
        words = []
        at = start
        for arc in arcs:
            first, second = ends[arc].tolist()
            words.append(self.word_of_dart(2 * arc if first == at else 2 * arc + 1))
            at = second if first == at else first
        return product(*words)

    def reading(self, face: int, *, first: int | None = None) -> Word:
        """The word of a face's boundary, in rotation order from one of its darts."""
        start = int(np.flatnonzero(self.face_of == face)[0]) if first is None else first
        return product(*(self.word_of_dart(dart) for dart in self._round(start)))

    def _round(self, start: int) -> list[int]:
        darts, dart = [start], int(self.phi[start])
        while dart != start:
            darts.append(dart)
            dart = int(self.phi[dart])
        return darts

    def _assign(self) -> None:
        n_faces = len(self.areas_m2)
        darts_of: list[list[int]] = [[] for _ in range(n_faces)]
        for dart in np.flatnonzero(self.face_of >= 0).tolist():
            darts_of[int(self.face_of[dart])].append(dart)
        # The dart on each face whose arc leads to the parent; order runs from roots to leaves.
        up = np.full(n_faces, -1, dtype=np.int64)
        seen = np.zeros(n_faces, dtype=np.bool_)
        order: list[int] = []
        for root in np.argsort(-self.areas_m2, kind="stable").tolist():
            if seen[root]:
                continue
            self.roots.append(root)
            seen[root] = True
            queue = deque([root])
            while queue:
                face = queue.popleft()
                order.append(face)
                for dart in darts_of[face]:
                    beyond = int(self.face_of[dart ^ 1])
                    if not seen[beyond]:
                        seen[beyond] = True
                        up[beyond] = dart ^ 1
                        queue.append(beyond)
        generator = 0
        for face in reversed(order):
            if up[face] < 0:
                continue
            dart = int(up[face])
            target = IDENTITY
            if self.is_hole[face]:
                generator += 1
                target = (generator,)
            rest = product(*(self.word_of_dart(other) for other in self._round(dart)[1:]))
            word = product(target, inverse(rest))
            self.words[dart >> 1] = inverse(word) if dart & 1 else word


def _phi_without(sigma: LongArray | np.ndarray, kept: BoolArray) -> LongArray:
    """Next dart round the face in the map of the kept arcs alone, -1 for darts of others."""
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


def _hole_areas(
    topology: TopologicalMap, kept: BoolArray, enterable: BoolArray, face_of: LongArray
) -> FloatArray:
    """Area of what cannot be entered in each face of the kept map: obstacles with all that they
    surround, and places; infinite for the outside."""
    level, inclusion = topology.level, topology.inclusion
    dual = level.dual
    group = np.arange(dual.n_faces)
    for one, other in dual.edges[~kept].tolist():
        one, other = _find(group, one), _find(group, other)  # noqa: PLW2901 - their groups
        group[max(one, other)] = min(one, other)
    area = np.zeros(dual.n_faces)
    faces = inclusion.face_of_obstacle[1:]
    inside = faces >= 0
    np.add.at(area, faces[inside], inclusion.obstacle_cells[1:][inside])
    # A protected face counts even where rounding or nesting leaves it no cells of its own.
    area[(dual.kinds == FaceKind.PROTECTED) & (area <= 0)] = 1.0
    area[dual.kinds == FaceKind.OUTSIDE] = np.inf
    total = np.zeros(dual.n_faces)
    for face in range(dual.n_faces):
        total[_find(group, face)] += area[face]
    origin = level.arcs.ravel()
    for place in np.flatnonzero(~enterable).tolist():
        darts = np.flatnonzero(origin == place)
        if len(darts):
            total[_find(group, int(dual.face_of[darts[0]]))] += level.areas[place]
    areas = np.zeros(int(face_of.max(initial=-1)) + 1)
    for dart in np.flatnonzero(face_of >= 0).tolist():
        areas[face_of[dart]] = total[_find(group, int(dual.face_of[dart]))]
    m2: FloatArray = areas * np.float64(topology.grid.resolution_m**2)
    return m2


def _find(group: LongArray, face: int) -> int:
    while group[face] != face:
        group[face] = group[group[face]]
        face = int(group[face])
    return face
