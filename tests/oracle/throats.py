"""Parts of a map by their definition: clearances by brute force, a flood on sets of squares."""

from collections import deque
from typing import Any

import numpy as np

Square = tuple[int, int]
SIDES = ((0, 1), (1, 0), (0, -1), (-1, 0))


def clearances(classes: Any, most: int) -> Any:
    """Least length of a chain of steps from each square's clearest free cell to one that is not."""
    obstacles = np.argwhere(classes != 1)
    away = np.zeros(classes.shape, dtype=np.int64)
    for row, col in np.argwhere(classes == 1).tolist():
        small, large = np.sort(np.abs(obstacles - (row, col)), axis=1).T
        # Steps of 5 along rows and columns, 7 along diagonals, 11 by knight's moves.
        lengths = np.where(large >= 2 * small, 5 * large + small, 4 * large + 3 * small)
        away[row, col] = min(int(lengths.min(initial=most)), most)
    rows, cols = (side + 1 & ~1 for side in classes.shape)
    padded = np.zeros((rows, cols), dtype=np.int64)
    padded[: classes.shape[0], : classes.shape[1]] = away
    return padded.reshape(rows // 2, 2, cols // 2, 2).max(axis=(1, 3))


def crossings(classes: Any) -> set[tuple[Square, Square]]:
    free = {tuple(cell) for cell in np.argwhere(classes == 1).tolist()}
    found = set()
    for row, col in free:
        for down, right in SIDES:
            beside = (row + down, col + right)
            if beside in free:
                found.add(((row // 2, col // 2), (beside[0] // 2, beside[1] // 2)))
    return {(one, other) for one, other in found if one != other}


class Groups:
    """Sets that merge; the name of one is the least of those it was made from."""

    def __init__(self) -> None:
        self.name: dict[int, int] = {}
        self.size: dict[int, int] = {}

    def merge(self, one: int, other: int) -> int:
        """Merge two groups; return the name of the result."""
        first, second = min(one, other), max(one, other)
        self.size[first] += self.size.pop(second)
        self.name = {key: first if name == second else name for key, name in self.name.items()}
        return first


class Flood:
    """A flood of squares from the greatest clearance to the least."""

    def __init__(self, classes: Any, most: int, limits: tuple[float, float, float]) -> None:
        self.away, self.meets = clearances(classes, most), crossings(classes)
        self.most, self.limits = most, limits
        self.begun: dict[Square, int] = {}
        self.fine, self.coarse = Groups(), Groups()
        self.widest: list[int] = []
        self.queues: list[deque[Square]] = [deque() for _ in range(most + 1)]
        for level in range(most, 0, -1):
            seeds = [(int(row), int(col)) for row, col in np.argwhere(self.away == level)]
            self.empty_queue(level)
            for seed in seeds:
                if seed not in self.begun:
                    self.begin(seed, level)
                    self.visit(seed, level)
                    self.empty_queue(level)

    def empty_queue(self, level: int) -> None:
        """Visit what waits at a level, and what comes to wait there."""
        while self.queues[level]:
            self.visit(self.queues[level].popleft(), level)

    def begin(self, square: Square, level: int) -> None:
        """Let a square begin parts of its own."""
        new = self.begun[square] = len(self.widest)
        self.widest.append(level)
        for groups in (self.fine, self.coarse):
            groups.name[new], groups.size[new] = new, 0

    def visit(self, square: Square, level: int) -> None:
        """Count a square, and look at those beside it."""
        here = self.begun[square]
        for groups in (self.fine, self.coarse):
            groups.size[groups.name[here]] += 1
        for down, right in SIDES:
            beside = (square[0] + down, square[1] + right)
            if (square, beside) not in self.meets:
                continue
            if beside in self.begun:
                self.meet(here, self.begun[beside], level)
            else:
                self.begun[beside] = here
                self.queues[min(level, int(self.away[beside]))].append(beside)

    def meet(self, here: int, there: int, level: int) -> None:
        """Merge what is to be one where two parts meet."""
        small, slight, depth = self.limits
        one, other = self.fine.name[here], self.fine.name[there]
        if one == other:
            return
        is_wide = level == self.most or min(self.widest[one], self.widest[other]) < level + depth
        joins = is_wide or min(self.fine.size[one], self.fine.size[other]) < small
        two = self.coarse.name[here], self.coarse.name[there]
        least = min(self.coarse.size[part] for part in two)
        if two[0] != two[1] and (joins or least < slight):
            self.coarse.merge(*two)
        if joins:
            self.fine.merge(one, other)


def parts_of(classes: Any, distance_cells: float) -> Any:
    """Fine part of each cell for a merge distance in cells, -1 where it is not free, and the part
    of each fine part."""
    if not np.isfinite(distance_cells):
        distance_cells = 2.0**31
    limit = np.ceil(distance_cells**2 * (1 - 1e-9))
    most = int(min(max(1.5 * limit**0.5, 5), 60_000))
    flood = Flood(classes, most, (max(limit / 320, 9) / 4, max(limit / 40, 9) / 4, 15))
    number = {name: k for k, name in enumerate(sorted(set(flood.fine.name.values())))}
    part_number: dict[int, int] = {}
    for name in number:
        part_number.setdefault(flood.coarse.name[name], len(part_number))
    fine_of = np.full(classes.shape, -1)
    for row, col in np.argwhere(classes == 1).tolist():
        fine_of[row, col] = number[flood.fine.name[flood.begun[row // 2, col // 2]]]
    part_of = [part_number[flood.coarse.name[name]] for name in number]
    return fine_of, np.array(part_of, dtype=np.int64)


def labels_of(classes: Any, distance_cells: float) -> Any:
    """The part of each cell, -1 where it is not free."""
    fine_of, part_of = parts_of(classes, distance_cells)
    return np.append(part_of, -1)[fine_of]
