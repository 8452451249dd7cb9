"""Kernels that bring cells and labels from one frame of a map to another one."""

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import njit

_ONE = 2.0**32
"""A cell, in the numbers that positions are."""


class ViewFrame(NamedTuple):
    """A frame of cells that is turned about the middle of the map, and coarser."""

    rows: int
    """Rows of the frame."""
    cols: int
    """Columns of it."""
    cosine: float
    """Cosine of the angle by which it is turned."""
    sine: float
    """Sine of it."""
    side: float
    """Side of its cells, in those of the map."""


@njit(cache=True, nogil=True)
def seen(kinds, frame, n):
    """Return the kinds of the cells of a frame: wall if one of n x n points in each is, else what
    half of them are; uint8.

    `kinds`: uint8 (rows, cols) of the map, see `cutting.Kind`; `frame`: a `ViewFrame`.
    """
    rows, cols = kinds.shape
    cells = np.empty((frame.rows, frame.cols), np.uint8)
    # Positions in 32 bits of whole cells and 32 below them, so that a point is an addition away.
    step = frame.side / n
    down, right = int(step * frame.cosine * _ONE), int(step * frame.sine * _ONE)
    half = n * n + 1 >> 1
    counts = np.empty(frame.cols, np.int64)  # 16 bits for each kind
    for i in range(frame.rows):
        counts[:] = 0
        for k in range(n):
            y = (i + (k + 0.5) / n - 0.5 * frame.rows) * frame.side
            x = (0.5 / n - 0.5 * frame.cols) * frame.side
            row = int((frame.cosine * y + frame.sine * x + 0.5 * rows) * _ONE)
            col = int((frame.cosine * x - frame.sine * y + 0.5 * cols) * _ONE)
            for j in range(frame.cols):
                for _ in range(n):
                    at_row, at_col = row >> 32, col >> 32
                    if 0 <= at_row < rows and 0 <= at_col < cols:
                        counts[j] += 1 << 16 * np.int64(kinds[at_row, at_col])
                    row += right
                    col += down
        for j in range(frame.cols):
            kind = (
                2
                if counts[j] >> 32 & 65535 >= half
                else 1
                if counts[j] >> 16 & 65535 >= half
                else 0
            )
            cells[i, j] = 3 if counts[j] >> 48 > 0 else kind
    return cells


@njit(cache=True, nogil=True)
def brought(label_of, frame, onto, free):
    """Return labels of a frame on the free cells of another one, int32; -1 elsewhere.

    `label_of`: int32, of the cells of the `ViewFrame` `frame`; `onto`: the other one; `free`: bool,
    its free cells.
    """
    taken = np.full(free.shape, np.int32(-1), np.int32)
    # From one frame to the map, and from there to the other one.
    cosine = frame.cosine * onto.cosine + frame.sine * onto.sine
    sine = frame.cosine * onto.sine - frame.sine * onto.cosine
    times = onto.side / frame.side
    for i in range(onto.rows):
        y = (i + 0.5 - 0.5 * onto.rows) * times
        for j in range(onto.cols):
            if free[i, j]:
                x = (j + 0.5 - 0.5 * onto.cols) * times
                row = int(np.floor(cosine * y + sine * x + 0.5 * frame.rows))
                col = int(np.floor(cosine * x - sine * y + 0.5 * frame.cols))
                if 0 <= row < frame.rows and 0 <= col < frame.cols:
                    taken[i, j] = label_of[row, col]
    return taken


@njit(cache=True, nogil=True)
def smoothed(label_of, reach):
    """Return labels with smooth borders, int32: a cell at a border takes the label beside it that
    most cells round it have.

    Cells are counted in pairs that lie opposite each other and both have labels, so that a border
    stays where it is beside a wall. `label_of`: int32 (rows, cols), -1 for none; `reach`: cells to
    each side that are counted.
    """
    rows, cols = label_of.shape
    taken = label_of.copy()
    for row in range(rows):
        for col in range(cols):
            own = label_of[row, col]
            if own < 0:
                continue
            best, most = own, -1
            for step in ((0, 1), (1, 0), (0, -1), (-1, 0)):
                r, c = row + step[0], col + step[1]
                if not (0 <= r < rows and 0 <= c < cols):
                    continue
                other = label_of[r, c]
                if other < 0 or other == own:
                    continue
                n_own = n_other = 0
                high = min(reach, row, rows - 1 - row)
                wide = min(reach, col, cols - 1 - col)
                for down in range(-high, high + 1):
                    for right in range(-wide, wide + 1):
                        label = label_of[row + down, col + right]
                        if label >= 0 and label_of[row - down, col - right] >= 0:
                            n_own += label == own
                            n_other += label == other
                most = max(most, n_own)
                if n_other > most:
                    best, most = other, n_other
            taken[row, col] = best
    return taken
