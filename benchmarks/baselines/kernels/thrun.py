"""Kernels of Thrun's map: critical lines on the grid, and the regions that take their cells."""

import numpy as np

from hybridnav._base.jit import njit


@njit(cache=True, nogil=True)
def draw_lines(free, cells, basis):
    """Return the free cells on the lines from critical points to their basis points.

    A line steps along one side at a time (the cells that the straight segment passes through), so
    no 4-neighbour move and no diagonal one can slip across it.
    """
    on_line = np.zeros(free.shape, np.bool_)
    for i in range(cells.shape[0]):
        row, col = cells[i]
        for j in range(2):
            rows, cols = basis[i, j, 0] - row, basis[i, j, 1] - col
            row_step = 1 if rows > 0 else -1
            col_step = 1 if cols > 0 else -1
            rows, cols = abs(rows), abs(cols)
            r = c = 0
            while True:
                at_row, at_col = row + r * row_step, col + c * col_step
                if not free[at_row, at_col]:
                    break
                on_line[at_row, at_col] = True
                # The side by which the segment leaves its cell: compare (r + 1/2) / rows with (c +
                # 1/2) / cols, both multiplied out.
                if r < rows and (c >= cols or (2 * r + 1) * cols <= (2 * c + 1) * rows):
                    r += 1
                elif c < cols:
                    c += 1
                else:
                    break
    return on_line


@njit(cache=True, nogil=True)
def give_away(labels, on_line):
    """Assign each cell of a line to a region beside it, in rounds outwards from the regions.

    `labels` is changed; cells of lines that no region can reach keep -1.
    """
    rows, cols = labels.shape
    row_step = (0, 1, 0, -1)
    col_step = (1, 0, -1, 0)
    waiting = np.empty(on_line.sum(), np.int64)
    taker = np.empty(waiting.size, np.int32)
    count = 0
    for cell in range(labels.size):
        if on_line[cell // cols, cell % cols]:
            waiting[count] = cell
            count += 1
    while True:
        left = taken = 0
        for i in range(count):
            row, col = waiting[i] // cols, waiting[i] % cols
            label = -1
            for k in range(4):
                r, c = row + row_step[k], col + col_step[k]
                if 0 <= r < rows and 0 <= c < cols and labels[r, c] >= 0:
                    label = labels[r, c]
                    break
            taker[i] = label
        for i in range(count):
            if taker[i] >= 0:
                labels[waiting[i] // cols, waiting[i] % cols] = taker[i]
                taken += 1
            else:
                waiting[left] = waiting[i]
                left += 1
        count = left
        if taken == 0 or count == 0:
            return
