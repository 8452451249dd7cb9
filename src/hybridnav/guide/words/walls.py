"""The walls of a room as a person follows them, with what leads out in each."""

import math
from collections.abc import Iterator, Mapping

import numpy as np

from hybridnav._base.trig import lengths_along
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.guide.words.instruction import Hand

_STEPS = ((0, 1), (1, 0), (0, -1), (-1, 0))
"""From a cell to its neighbours, (row, col), counter-clockwise."""


class RoomWalls:
    """The closed walls of a room.

    `label_of`: int32 (rows, cols), the label of each free cell, another value elsewhere; `label`:
    that of the room; `exits`: the cells on both sides of each boundary, int64 (n, 2), by its
    number; `step`: how many sides of cells a person walks past straight on.
    """

    def __init__(
        self, label_of: IntArray, label: int, exits: Mapping[int, LongArray], step: int
    ) -> None:
        inside = label_of == label
        rows, cols = (np.flatnonzero(inside.any(axis=axis)) for axis in (1, 0))
        self._first = int(rows[0]) - 1, int(cols[0]) - 1
        self._inside = np.pad(inside[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1], 1)
        self._sides, following = _sides_of(self._inside)
        exit_of = np.zeros(len(self._sides), dtype=np.int64)
        for number, ends in exits.items():
            for own, other in (ends.T, ends.T[::-1]):
                cell, beside = (np.divmod(each, label_of.shape[1]) for each in (own, other))
                is_own = inside[cell]
                over = np.subtract(beside, cell)[:, is_own]
                course = np.select([over[1] > 0, over[0] > 0, over[1] < 0], [0, 1, 2], 3)
                exit_of[self._side(cell[0][is_own], cell[1][is_own], course)] = number
        self._place: dict[int, tuple[int, int]] = {}
        self.walls: list[list[list[int]]] = []
        """What leads out in each wall as somebody meets it who has the wall at the right hand: its
        number, and its first and last side of a cell in the wall."""
        self._exit_of: list[int] = exit_of.tolist()
        self._lengths: list[FloatArray] = []
        self._follow(following.tolist(), step)

    def _side(self, row: LongArray, col: LongArray, course: LongArray) -> LongArray:
        """Return the indices of the sides of cells of the room that look along steps."""
        flat = (row - self._first[0]) * self._inside.shape[1] + col - self._first[1]
        return np.searchsorted(self._sides, 4 * flat + course)

    def _length_along(self, sides: list[int], step: int) -> FloatArray:
        """Return how far it is to each side for a person, who walks straight past what is small,
        float64 (n + 1,), in cells."""
        cells = self._sides[[*sides[::step], sides[0]]] // 4
        row_col = np.stack(np.divmod(cells, self._inside.shape[1]), axis=1)
        lengths = lengths_along(row_col)
        ends = np.append(np.arange(0, len(sides), step), len(sides))
        return np.interp(np.arange(len(sides) + 1), ends, lengths)

    def _follow(self, following: list[int], step: int) -> None:
        exit_of = self._exit_of
        for begin, number in enumerate(exit_of):
            if number == 0 or begin in self._place:
                continue
            met, at, sides = [[number, 0, 0]], begin, list[int]()
            while at not in self._place:
                self._place[at] = len(self.walls), len(sides)
                if exit_of[at] not in (0, met[-1][0]):
                    met.append([exit_of[at], len(sides), 0])
                if exit_of[at]:
                    met[-1][2] = len(sides)
                sides.append(at)
                at = following[at]
            if len(met) > 1 and met[-1][0] == number:
                met[0][1] = met.pop()[1]
            self.walls.append(met)
            self._lengths.append(self._length_along(sides, step))

    def of_exit(self, number: int) -> tuple[int, int] | None:
        """Return the wall in which a boundary lies, by its index, and where; None for none."""
        for index, met in enumerate(self.walls):
            for exit_number, first, last in met:
                if exit_number == number:
                    return index, (first + last) // 2 if first <= last else first
        return None

    def ahead(
        self, cell: tuple[float, float], step: tuple[float, float]
    ) -> tuple[tuple[int, int], float, bool] | None:
        """Return where one comes to a wall straight on, how far it is, and whether no door is
        there.

        `cell`: where one begins, (row, col), in cells; `step`: step of a cell's length, likewise.
        Returns the wall by its index and the side of a cell, and the cells up to there, past what
        stands free.
        """
        row, col = (value - first for value, first in zip(cell, self._first, strict=True))
        last = None
        for count in range(4 * sum(self._inside.shape)):
            here = math.floor(row), math.floor(col)
            if all(0 <= one < size for one, size in zip(here, self._inside.shape, strict=True)):
                if self._inside[here]:
                    last = here
                elif last is not None:
                    side = self._side_between(last, here)
                    if side in self._place:
                        return self._place[side], count / 2, self._exit_of[side] == 0
            row, col = row + step[0] / 2, col + step[1] / 2
        return None

    def _side_between(self, last: tuple[int, int], here: tuple[int, int]) -> int:
        """Return the side at which a line leaves the room, from a cell of it to another cell."""
        for course, (up, right) in enumerate(_STEPS):
            beside = last[0] + up, last[1] + right
            is_towards = up * (here[0] - last[0]) + right * (here[1] - last[1]) > 0
            if is_towards and not self._inside[beside]:
                flat = last[0] * self._inside.shape[1] + last[1]
                return int(np.searchsorted(self._sides, 4 * flat + course))
        return 0

    def met(self, begin: tuple[int, int], hand: Hand) -> Iterator[tuple[int, float]]:
        """Yield the numbers of what leads out in a wall, and how far each is, in cells.

        `begin`: the wall, and where one begins; `hand`: that at which one has it.
        """
        lengths, sign = self._lengths[begin[0]], 1 if hand == "right" else -1
        length = float(lengths[-1]) or math.inf  # round a cell nobody walks
        reached = []
        for number, first, last in self.walls[begin[0]]:
            at = first if hand == "right" else last
            reached.append((float(sign * (lengths[at] - lengths[begin[1]]) % length), number))
        yield from ((number, away) for away, number in sorted(reached))


def _sides_of(inside: BoolArray) -> tuple[LongArray, LongArray]:
    """Return the sides of cells at which a region ends, ascending.

    Return also the index of the side that follows each for a person who has the rim at the right
    hand.

    A side is four times its flat cell, plus the number of the step over it.
    """
    steps = np.array([row * inside.shape[1] + col for row, col in _STEPS])
    flat = inside.ravel()
    cells = np.flatnonzero(flat)
    sides = np.sort(np.concatenate([4 * cells[~flat[cells + s]] + n for n, s in enumerate(steps)]))
    cell, course = np.divmod(sides, 4)
    ahead = cell + steps[(course + 1) % 4]
    beyond = ahead + steps[course]
    onward = np.where(flat[ahead], 4 * ahead + course, 4 * cell + (course + 1) % 4)
    onward = np.where(flat[ahead] & flat[beyond], 4 * beyond + (course - 1) % 4, onward)
    return sides, np.searchsorted(sides, onward)
