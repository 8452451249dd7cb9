"""The kernel that enters what a window was contracted to."""

from __future__ import annotations

from hybridnav._jit import njit

_SURVIVES = 255


@njit(cache=True, nogil=True)
def enter(cells, changed, record, field_of, numbers):
    """Enter the record of a window into its cells, in place.

    Nothing changes beyond the cells that began anew, and their edges.

    Parameters
    ----------
    cells
        The fields class, end, parent, edges and place of `CELL`, of shape (rows, cols).
    changed
        bool and uint8 (rows, cols): the cells that began anew, and the `CellClass` of these now, 0
        elsewhere.
    record
        `vertex_end`, `vertex_parent` and `edge_end` of the window, flat.
    field_of
        int32 (rows, cols), the fields.
    numbers
        int64 (n_fields,), the number of the place of each.
    """
    of_class, end, parent, edges, place = cells
    gone, fresh = changed
    vertex_end, vertex_parent, edge_end = record
    rows, cols = gone.shape
    for row in range(rows):
        for col in range(cols):
            cell = row * cols + col
            if gone[row, col]:
                end[row, col] = vertex_end[cell]
                parent[row, col, 0] = parent[row, col, 1] = 0
                of_class[row, col] = fresh[row, col]
                place[row, col] = -1
                if fresh[row, col] > 0:
                    place[row, col] = numbers[field_of[row, col]]
                    if vertex_end[cell] != _SURVIVES:
                        parent[row, col, 0] = vertex_parent[cell] // cols - row
                        parent[row, col, 1] = vertex_parent[cell] % cols - col
            for north in range(2):
                to_row, to_col = row + north, col + 1 - north
                if to_row == rows or to_col == cols:
                    continue
                if gone[row, col] or gone[to_row, to_col]:
                    edges[row, col, north] = edge_end[2 * cell + north]
