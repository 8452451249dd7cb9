"""Kernels that take single cells out of places and put them into others.

Windows and tables are those of `near`.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav.ext.live.kernels.near import beside_of, step_to, with_rows


@guarded
@njit(cache=True, nogil=True)
def join_nearest(window, low, table, cells, limit):
    """Let cells without a place join the place beside them with the nearest surviving cell.

    Parameters
    ----------
    window
        Places and classes; the places change.
    low, table
        See above; areas and boxes change.
    cells
        int64 (n,), flat cells that are vertices, none at a side of the window.
    limit
        The squared distance to a surviving cell stays below it.
    """
    place, of_class = window
    numbers, area, survivor, box = table.numbers, table.area, table.survivor, table.box
    cols = place.shape[1]
    flat, classes = place.ravel(), of_class.ravel()

    # A cell waits once at the beginning, and once for each of four neighbours that joins.
    queue = np.empty(5 * cells.size, np.int64)
    head = tail = 0
    for cell in cells:
        for side in range(4):
            beside = cell + step_to(side, cols)
            if flat[beside] >= 0 and classes[beside] == classes[cell]:
                queue[tail] = cell
                tail += 1
                break

    # First in, first out: all places grow by one ring of cells after another.
    while head < tail:
        cell = queue[head]
        head += 1
        # It has joined since, for it waited more than once.
        if flat[cell] >= 0:
            continue
        row, col = cell // cols + low[0], cell % cols + low[1]
        # Among places equally near the least number wins, whatever the order of the sides.
        least, nearest = limit, np.int64(-1)
        for side in range(4):
            beside = cell + step_to(side, cols)
            if flat[beside] < 0 or classes[beside] != classes[cell]:
                continue
            i = np.searchsorted(numbers, np.int64(flat[beside]))
            squared = (row - survivor[i, 0]) ** 2 + (col - survivor[i, 1]) ** 2
            if squared < least or (squared == least and i < nearest):
                least, nearest = squared, i
        # All places beside it are too far; it waits again if another neighbour joins one.
        if nearest < 0:
            continue
        # A place only gains here, so its area and its box stay exact without another look at it.
        flat[cell] = numbers[nearest]
        area[nearest] += 1
        box[nearest, 0], box[nearest, 1] = min(box[nearest, 0], row), min(box[nearest, 1], col)
        box[nearest, 2] = max(box[nearest, 2], row + 1)
        box[nearest, 3] = max(box[nearest, 3], col + 1)
        for side in range(4):
            beside = cell + step_to(side, cols)
            if flat[beside] < 0 and classes[beside] == classes[cell]:
                queue[tail] = beside
                tail += 1


@guarded
@njit(cache=True, nogil=True)
def join_each_other(window, cells, first):
    """Give new numbers to the connected sets of those cells that have no place.

    Parameters
    ----------
    window
        Places and classes; the places change.
    cells
        int64 (n,), flat cells that are vertices.
    first
        The least new number.

    Returns
    -------
    int64 (m, 4)
        The least row and column of each, and the first ones beyond it, in the window.
    """
    place, of_class = window
    rows, cols = place.shape
    flat, classes = place.ravel(), of_class.ravel()
    stack = np.empty(cells.size, np.int64)
    boxes = np.empty((cells.size, 4), np.int64)
    count = 0
    for start in cells:
        if flat[start] >= 0:
            continue
        flat[start] = first + count
        stack[0], size = start, 1
        boxes[count, 0], boxes[count, 1], boxes[count, 2], boxes[count, 3] = rows, cols, 0, 0
        while size > 0:
            size -= 1
            cell = stack[size]
            row, col = cell // cols, cell % cols
            boxes[count, 0], boxes[count, 1] = min(boxes[count, 0], row), min(boxes[count, 1], col)
            boxes[count, 2] = max(boxes[count, 2], row + 1)
            boxes[count, 3] = max(boxes[count, 3], col + 1)
            for side in range(4):
                beside = beside_of(cell, side, rows, cols)
                if beside >= 0 and flat[beside] < 0 and classes[beside] == classes[cell]:
                    flat[beside] = first + count
                    stack[size] = beside
                    size += 1
        count += 1
    return boxes[:count].copy()


@guarded
@njit(cache=True, nogil=True)
def take_out(place, low, table, removed, first):
    """Take cells out of their places, and give new numbers to parts that this cuts off.

    A place that loses half of its cells has a new number too: it has no heir.

    Parameters
    ----------
    place, low, table
        See above; areas change.
    removed
        int64 (n,) twice: flat cells, and the places that they were in, -1 for none.
    first
        The least new number.

    Returns
    -------
    int64 (m,)
        The place of which each new one was a part.
    int64 (k,)
        All places that lost cells.
    int64 (l,)
        Those of them that lost a part, their surviving cell, or a cell at a side of their box.
    """
    numbers, area, survivor, box = table.numbers, table.area, table.survivor, table.box

    # Ordered by place, the cells of each are one run, and those without a place come first.
    order = np.argsort(removed[1], kind="mergesort")
    order = order[np.searchsorted(removed[1][order], 0) :]
    cells, was = removed[0][order], removed[1][order]
    cols = place.shape[1]
    flat = place.ravel()

    # All cells leave before any place is searched: parts are cut off by all of them together.
    for cell in cells:
        flat[cell] = -1
    parts, n_parts = np.empty(16, np.int64), 0
    lost, n_lost = np.empty(cells.size, np.int64), 0
    altered, n_altered = np.empty(cells.size, np.int64), 0

    # One queue and one scratch serve all places: `cut_off` leaves the scratch as it was.
    queue = np.empty(flat.size, np.int64)
    scratch = np.full(place.shape, np.int32(-1), np.int32)
    begin = 0
    while begin < cells.size:
        end = begin
        while end < cells.size and was[end] == was[begin]:
            end += 1
        number = was[begin]
        i = np.searchsorted(numbers, number)
        # Compare with the area before, which shrinks next.
        is_other = 2 * (area[i] - (end - begin)) <= area[i]
        area[i] -= end - begin
        lost[n_lost] = number
        n_lost += 1
        # The box can only shrink if a cell at one of its sides went.
        alters = False
        for cell in cells[begin:end]:
            row, col = cell // cols + low[0], cell % cols + low[1]
            alters |= row == box[i, 0] or row == box[i, 2] - 1
            alters |= col == box[i, 1] or col == box[i, 3] - 1
        n_cut = cut_off(place, cells[begin:end], number, scratch, queue, first + n_parts)
        # The rest is renamed last, for the search above knows its cells by the old number.
        if is_other and area[i] > 0:
            rename(place, low, box[i], number, first + n_parts + n_cut)
            n_cut += 1
        parts = with_rows(parts, n_parts, n_cut)
        parts[n_parts : n_parts + n_cut] = number
        n_parts += n_cut
        if alters or n_cut > 0 or place[survivor[i, 0] - low[0], survivor[i, 1] - low[1]] != number:
            altered[n_altered] = number
            n_altered += 1
        begin = end
    return parts[:n_parts].copy(), lost[:n_lost].copy(), altered[:n_altered].copy()


@njit(cache=True, nogil=True)
def rename(place, low, box, number, final):
    """Write another number of a place, which lies in a box."""
    for row in range(box[0] - low[0], box[2] - low[0]):
        for col in range(box[1] - low[1], box[3] - low[1]):
            if place[row, col] == number:
                place[row, col] = final


@njit(cache=True, nogil=True)
def root_of(parent, item):
    """Return the root of an item in a union-find forest, whose paths become shorter."""
    while parent[item] != item:
        parent[item] = parent[parent[item]]
        item = parent[item]
    return item


@njit(cache=True, nogil=True)
def cut_off(place, cells, number, scratch, queue, first):
    """Give new numbers to the parts that a removal of cells cuts off a place; return how many.

    Searches begin at the cells beside the removed ones and go on by turns until they have met, or
    all but one part is searched.
    """
    cols = place.shape[1]
    flat, marks = place.ravel(), scratch.ravel()
    parent = np.empty(4 * cells.size, np.int64)
    n_open = tail = 0

    # Each part that is cut off has a cell beside a removed one, so a search begins at all of these.
    for cell in cells:
        for side in range(4):
            beside = cell + step_to(side, cols)
            if flat[beside] == number and marks[beside] < 0:
                marks[beside] = parent[n_open] = n_open
                queue[tail] = beside
                n_open += 1
                tail += 1

    # Searches that meet become one set of a union-find forest. `waiting` counts the queued cells
    # of each root, `n_open` the sets that may still meet another one.
    waiting = np.ones(n_open, np.int64)
    part_of = np.full(n_open, np.int64(-1), np.int64)
    n_parts = head = 0

    # One queue makes the searches take turns, so that a small part ends early. The last open set
    # keeps the old number.
    while head < tail and n_open > 1:
        cell = queue[head]
        head += 1
        root = root_of(parent, marks[cell])
        for side in range(4):
            beside = cell + step_to(side, cols)
            if flat[beside] != number:
                continue
            if marks[beside] < 0:
                marks[beside] = root
                waiting[root] += 1
                queue[tail] = beside
                tail += 1
                continue
            other = root_of(parent, marks[beside])
            if other != root:
                parent[other] = root
                waiting[root] += waiting[other]
                n_open -= 1
        waiting[root] -= 1
        # All cells of the part were searched, and it met no other one: it is cut off.
        if waiting[root] == 0 and n_open > 1:
            n_open -= 1
            part_of[root] = n_parts
            n_parts += 1
    if n_parts > 0:
        # The parts were searched whole, so the queue holds all their cells.
        for cell in queue[:tail]:
            part = part_of[root_of(parent, marks[cell])]
            if part >= 0:
                flat[cell] = first + part

    # The next place needs a scratch of -1; only these cells differ.
    for cell in queue[:tail]:
        marks[cell] = -1
    return n_parts
