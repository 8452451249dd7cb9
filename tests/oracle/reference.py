"""A plane map of dictionaries, contracted and simplified one edge at a time.

The explicit dual graph contraction of docs/pyramid.md, as plainly as it can be written: a dart is
named by the base edge it comes from, as `(cell, cell)`, at every level. It validates the oracle
and, given the same kernels, must end with the same darts as any other implementation.
"""

import random
from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np

from tests.oracle.pyramid import AnyArray, Base, Cell, Dart, alpha, orbits

ALL_RULES = frozenset({1, 2, 3, 4})


@dataclass(frozen=True)
class ReferenceLevel:
    """A level as arrays, with the names that `hybridnav.pyramid` uses."""

    field_of: AnyArray
    cells: AnyArray
    classes: AnyArray
    arcs: AnyArray
    base_pairs: AnyArray
    sigma: AnyArray
    protected: AnyArray

    @property
    def n_vertices(self) -> int:
        return len(self.cells)

    @property
    def n_arcs(self) -> int:
        """Count of arcs, self-loops included."""
        return len(self.arcs)


class PlaneMap:
    """One level that is contracted and simplified in place.

    `classes`: `CellClass` of each cell; `rules`: which of the four redundancy rules hold; less than
    all of them only to show their need.
    """

    def __init__(self, classes: AnyArray, *, rules: Collection[int] = ALL_RULES) -> None:
        base = Base.of(classes)
        self.classes = classes
        self.rules = rules
        self.sigma = dict(base.sigma)
        self.before = {later: dart for dart, later in base.sigma.items()}
        walks = base.ordinary + base.protected
        self.face = {dart: face for face, walk in enumerate(walks) for dart in walk}
        self.ordinary = set(range(len(base.ordinary)))
        self.vertex: dict[Cell, Cell] = {
            (int(row), int(col)): (int(row), int(col)) for row, col in np.argwhere(classes)
        }
        self.field = {cell: [cell] for cell in self.vertex}
        self.outer = self._outer_faces()

    def _outer_faces(self) -> set[int]:
        """Face that surrounds each component: right of the first dart of its first cell."""
        outer: set[int] = set()
        seen: set[Cell] = set()
        for cell in sorted(self.vertex):
            if cell in seen:
                continue
            todo = [cell]
            while todo:
                row, col = todo.pop()
                if (row, col) in self.vertex and (row, col) not in seen:
                    seen.add((row, col))
                    todo += [(row, col + 1), (row + 1, col), (row, col - 1), (row - 1, col)]
            # The row below holds nothing of the component, nor does the cell to the west.
            for head in ((cell[0], cell[1] + 1), (cell[0] + 1, cell[1])):
                if head in self.vertex:
                    outer.add(self.face[cell, head])
                    break
        return outer

    def phi(self, dart: Dart) -> Dart:
        """Next dart round the face."""
        return self.sigma[alpha(dart)]

    def is_loop(self, dart: Dart) -> bool:
        """Whether both endpoints of the dart's edge are one vertex."""
        return self.vertex[dart[0]] == self.vertex[dart[1]]

    def contractible(self) -> list[Dart]:
        """Darts between different vertices of one class, in order."""
        return [
            dart
            for dart in sorted(self.sigma)
            if not self.is_loop(dart) and self.classes[dart[0]] == self.classes[dart[1]]
        ]

    def contract(self, dart: Dart) -> None:
        """Contract an edge; the vertex that the dart leaves survives."""
        centre, leaf = self.vertex[dart[0]], self.vertex[dart[1]]
        if centre == leaf:
            raise ValueError(f"a self-loop cannot be contracted, got {dart}")
        ahead, back = self.sigma[dart], self.before[dart]
        leaf_ahead, leaf_back = self.sigma[alpha(dart)], self.before[alpha(dart)]
        if ahead != dart and leaf_ahead != alpha(dart):
            self._link(back, leaf_ahead)
            self._link(leaf_back, ahead)
        elif ahead != dart:
            self._link(back, ahead)
        elif leaf_ahead != alpha(dart):
            self._link(leaf_back, leaf_ahead)
        self._forget(dart)
        for cell in self.field.pop(leaf):
            self.vertex[cell] = centre
            self.field[centre].append(cell)

    def remove(self, dart: Dart) -> int:
        """Remove an edge and return the face that its two faces become."""
        kept, merged = self.face[dart], self.face[alpha(dart)]
        if kept == merged:
            raise ValueError(f"a bridge cannot be removed, got {dart}")
        for half in (dart, alpha(dart)):
            if self.sigma[half] != half:
                self._link(self.before[half], self.sigma[half])
            self._forget_half(half)
        for other, face in self.face.items():
            if face == merged:
                self.face[other] = kept
        if merged not in self.ordinary:
            self.ordinary.discard(kept)
        if merged in self.outer:
            self.outer.add(kept)
        return kept

    def _link(self, dart: Dart, later: Dart) -> None:
        self.sigma[dart] = later
        self.before[later] = dart

    def _forget(self, dart: Dart) -> None:
        self._forget_half(dart)
        self._forget_half(alpha(dart))

    def _forget_half(self, dart: Dart) -> None:
        del self.sigma[dart], self.before[dart], self.face[dart]

    def simplify(
        self, *, only: Collection[Dart] | None = None, rng: random.Random | None = None
    ) -> list[Dart]:
        """Remove redundant edges until no rule finds one; return them, a dart each.

        `only`: darts, both halves of each edge, among which the edges must be chosen: what another
        implementation removed; `rng`: order of the faces; without it, by number. Raises
        `ValueError` when a rule asks for an edge that is not in `only`.
        """
        walks = {self.face[walk[0]]: list(walk) for walk in self._walks()}
        todo = sorted(self.ordinary & walks.keys())
        removed = []
        while todo:
            face = todo.pop(rng.randrange(len(todo)) if rng else -1)
            if face not in walks or face not in self.ordinary:
                continue
            choice = self._redundant(walks[face], only)
            if choice is None:
                continue
            removed.append(choice)
            darts = walks.pop(face) + walks.pop(self.face[alpha(choice)])
            left = [dart for dart in darts if dart not in (choice, alpha(choice))]
            merged = self.remove(choice)
            if left:
                walks[merged] = self._walk(left[0])
                todo.append(merged)
        return removed

    def _walks(self) -> list[tuple[Dart, ...]]:
        return orbits({dart: self.phi(dart) for dart in self.sigma})

    def _walk(self, start: Dart) -> list[Dart]:
        walk = [start]
        while (dart := self.phi(walk[-1])) != start:
            walk.append(dart)
        return walk

    def _redundant(self, walk: list[Dart], only: Collection[Dart] | None) -> Dart | None:
        crossing = [dart for dart in walk if not self.is_loop(dart)]
        if not crossing:
            rule = 1 if len(walk) == 1 else 2 if len(walk) == 2 else 4
            choices = sorted(walk, key=lambda dart: (not self._encloses(dart), dart))
        elif len(crossing) == 2 and crossing[0] != alpha(crossing[1]):
            rule = 2 if len(walk) == 2 else 3
            choices = sorted(crossing)
        else:
            return None
        if rule not in self.rules:
            return None
        if only is None:
            return choices[0]
        for dart in choices:
            if dart in only:
                return dart
        raise ValueError(f"rule {rule} asks for one of {choices} to be removed; none was")

    def _encloses(self, loop: Dart) -> bool:
        """Whether the far side of a self-loop, seen from its face, holds the outer face."""
        todo, seen = [alpha(loop)], set()
        while todo:
            dart = todo.pop()
            if dart in seen:
                continue
            if self.face[dart] in self.outer:
                return True
            seen.add(dart)
            todo.append(self.phi(dart))
            if dart not in (loop, alpha(loop)):
                todo.append(alpha(dart))
        return False

    def step(self, contracted: Iterable[Dart], *, removed: Collection[Dart] | None = None) -> None:
        """Make the next level of this one.

        `contracted`: the contraction kernels: a dart per edge, from the surviving vertex to the
        other; `removed`: the removal kernels, a dart per edge in any direction; without it, this
        class chooses. Raises `ValueError` when a kernel breaks a rule or leaves an edge that a rule
        removes.
        """
        for dart in contracted:
            self.contract(dart)
        if removed is None:
            self.simplify()
            return
        both = {half for dart in removed for half in (dart, alpha(dart))}
        gone = self.simplify(only=both)
        if 2 * len(gone) != len(both):
            extra = both - {half for dart in gone for half in (dart, alpha(dart))}
            raise ValueError(f"no rule asks for these edges to be removed: {sorted(extra)}")

    def level(self) -> ReferenceLevel:
        """Return the map as arrays: vertices and arcs in the order of their cells."""
        cells = sorted(self.field)
        dense = {cell: index for index, cell in enumerate(cells)}
        field_of = np.full(self.classes.shape, -1, dtype=np.int32)
        for cell, survivor in self.vertex.items():
            field_of[cell] = dense[survivor]
        edges = sorted(dart for dart in self.sigma if dart < alpha(dart))
        darts = [half for dart in edges for half in (dart, alpha(dart))]
        number = {dart: index for index, dart in enumerate(darts)}
        endpoints = [[dense[self.vertex[cell]] for cell in dart] for dart in edges]
        return ReferenceLevel(
            field_of=field_of,
            cells=np.array(cells, dtype=int).reshape(-1, 2),
            classes=np.array([self.classes[cell] for cell in cells], dtype=np.uint8),
            arcs=np.array(endpoints, dtype=np.int32).reshape(-1, 2),
            base_pairs=np.array(edges, dtype=int).reshape(-1, 2, 2),
            sigma=np.array([number[self.sigma[dart]] for dart in darts], dtype=np.int32),
            protected=np.array(
                [self.face[dart] not in self.ordinary for dart in darts], dtype=bool
            ),
        )
