"""Paths as short text, runs of equal moves, so that every record can hold its own."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.grid.limits import MAX_CELLS
from hybridnav.search.moves import STEPS

if TYPE_CHECKING:
    from hybridnav._typing import LongArray

Cell = tuple[int, int]

# One for each direction, counter-clockwise from east; anything else is written as cells.
_LETTERS = "abcdefgh"
_LETTER_OF = {tuple(step): letter for step, letter in zip(STEPS.tolist(), _LETTERS, strict=True)}
_RUN = re.compile(r"([a-h])(\d{1,9})|\((-?\d{1,18}),(-?\d{1,18})\)")


def encode_path(cells: LongArray) -> str:
    """Write a path's moves, such as "a12b3": twelve steps east, three north-east.

    Parameters
    ----------
    cells
        int64 (n, 2), n >= 1. A step that leads to no neighbour is written as "(rows,cols)".
    """
    steps = np.diff(cells, axis=0)
    ends = np.flatnonzero((steps[1:] != steps[:-1]).any(axis=1)) + 1
    starts = np.concatenate([[0], ends]) if len(steps) else np.empty(0, dtype=np.int64)
    counts = np.diff(np.concatenate([starts, [len(steps)]]))
    text = []
    for at, count in zip(starts.tolist(), counts.tolist(), strict=True):
        rows, cols = steps[at].tolist()
        letter = _LETTER_OF.get((rows, cols))
        text.append(f"{letter}{count}" if letter else f"({rows},{cols})" * count)
    return "".join(text)


def path_steps(text: str) -> int:
    """Return the steps of a path written by `encode_path`."""
    runs = _RUN.finditer(text)
    return sum(int(run.group(2)) if run.group(1) else 1 for run in runs)


def decode_path(start: Cell, text: str) -> LongArray:
    """Return the cells of a path from its first cell and its moves.

    Raises
    ------
    InvalidValueError
        When the text is no path.
    """
    runs = []
    end = total = 0
    for run in _RUN.finditer(text):
        letter, count, rows, cols = run.groups()
        total += int(count or 1)
        if run.start() != end or total > MAX_CELLS:
            break
        end = run.end()
        step = STEPS[[_LETTERS.index(letter)]] if letter else np.array([[int(rows), int(cols)]])
        runs.append((step, int(count or 1)))
    if end != len(text):
        raise InvalidValueError(f"no path: {text[end : end + 20]!r:.80} at character {end}")
    steps = [np.repeat(step, times, axis=0) for step, times in runs]
    cells: LongArray = np.cumsum(np.concatenate([np.array([start]), *steps]), axis=0)
    return cells
