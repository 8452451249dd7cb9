"""Homotopy by rays, an oracle that knows no pyramid.

From each hole a ray goes up to the rim; the word of a path is the reduced list of its crossings.
"""

import heapq
import itertools
import math
from collections import defaultdict
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Cells = list[tuple[int, int]]
Word = tuple[int, ...]


def holes_of(enterable: NDArray[np.bool_], least_cells: float) -> list[tuple[int, int]]:
    """A cell of each hole whose filled area is large enough."""
    padded = np.pad(~enterable, 1, constant_values=True)
    label, count = ndimage.label(padded, structure=np.ones((3, 3)))
    found = []
    for hole in range(1, count + 1):
        if hole == label[0, 0]:
            continue
        # What cannot be left towards the rim by side steps over other cells.
        outside = ndimage.label(label != hole)[0]
        if (outside != outside[0, 0]).sum() >= least_cells:
            row, col = np.argwhere(label == hole)[0] - 1
            found.append((int(row), int(col)))
    return found


class Rays:
    """Words by vertical rays, each a little right of the middle between two columns."""

    def __init__(self, enterable: NDArray[np.bool_], least_cells: float) -> None:
        self.enterable = enterable
        self.holes = holes_of(enterable, least_cells)
        self._in_col = defaultdict(list)
        for letter, (row, col) in enumerate(self.holes, start=1):
            self._in_col[col].append((letter, row))

    def times(self, word: Word, tail: tuple[int, int], head: tuple[int, int]) -> Word:
        """The word after one step: rays of one column stand in the order of their letters."""
        east = head[1] > tail[1]
        rays = self._in_col[max(tail[1], head[1])] if head[1] != tail[1] else []
        for letter, row in rays if east else reversed(rays):
            if tail[0] + head[0] > 2 * row:
                signed = letter if east else -letter
                word = word[:-1] if word and word[-1] == -signed else (*word, signed)
        return word

    def word_of(self, cells: Any) -> Word:
        """The word of a path of cells."""
        word: Word = ()
        for tail, head in itertools.pairwise(map(tuple, np.asarray(cells).tolist())):
            word = self.times(word, tail, head)
        return word

    def moves(self, cell: tuple[int, int]) -> Cells:
        """Neighbours that a legal move reaches."""
        found = []
        for down, right in itertools.product((-1, 0, 1), repeat=2):
            to = cell[0] + down, cell[1] + right
            if to != cell and all(map(self.free, (to, (cell[0], to[1]), (to[0], cell[1])))):
                found.append(to)
        return found

    def free(self, cell: tuple[int, int]) -> bool:
        """Whether a cell is on the map and may be entered."""
        return all(0 <= i < n for i, n in zip(cell, self.enterable.shape, strict=True)) and bool(
            self.enterable[cell]
        )

    def winds(self, path: Cells, apart: int) -> bool:
        """Whether a path comes back to where it was, or sees it, round a hole."""
        at: dict[tuple[int, int], list[int]] = {}
        for late, cell in enumerate(path):
            for row_step, col_step in ((0, 1), (1, 0), (0, -1), (-1, 0)):
                arm = [cell]
                for _ in range(apart + 1):
                    for early in at.get(arm[-1], []):
                        if self.word_of([*path[early : late + 1], *arm[1:]]) != ():
                            return True
                    further = arm[-1][0] + row_step, arm[-1][1] + col_step
                    if not self.free(further):
                        break
                    arm.append(further)
            at.setdefault(cell, []).append(late)
        return False

    def shortest_paths(
        self, start: tuple[int, int], goal: tuple[int, int], longest: float, most: int
    ) -> Any:
        """Return length and all shortest paths of every class up to a length, None for too many."""
        left = self._lengths(goal)
        lengths: dict[Any, float] = {(start, ()): 0.0}
        before: Any = defaultdict(list)
        heap: Any = [(left.get(start, math.inf), (start, ()))]
        done = set()
        while heap:
            bound, state = heapq.heappop(heap)
            if bound > longest + 1e-9:
                break
            if state in done:
                continue
            done.add(state)
            for to in self.moves(state[0]):
                following = to, self.times(state[1], state[0], to)
                length = lengths[state] + math.dist(state[0], to)
                known = lengths.get(following, math.inf)
                if length < known - 1e-9:
                    lengths[following] = length
                    before[following] = []
                    heapq.heappush(heap, (length + left[to], following))
                if length < known + 1e-9:
                    before[following].append(state)
        classes: Any = {}
        for state in done:
            if state[0] == goal:
                classes[state[1]] = lengths[state], self._all_paths(before, state, start, most)
        return classes

    def _lengths(self, goal: tuple[int, int]) -> dict[tuple[int, int], float]:
        lengths = {goal: 0.0}
        heap = [(0.0, goal)]
        while heap:
            length, cell = heapq.heappop(heap)
            for to in self.moves(cell):
                if length + math.dist(cell, to) < lengths.get(to, math.inf) - 1e-9:
                    lengths[to] = length + math.dist(cell, to)
                    heapq.heappush(heap, (lengths[to], to))
        return lengths

    @staticmethod
    def _all_paths(before: Any, state: Any, start: Any, most: int) -> list[Cells] | None:
        paths: list[Cells] = []
        stack = [(state, [state[0]])]
        while stack:
            at, tail = stack.pop()
            if at == (start, ()):
                paths.append(tail[::-1])
                if len(paths) > most:
                    return None
            stack.extend((other, [*tail, other[0]]) for other in before[at])
        return paths
