"""Kernels that take single cells out of places and put them into others.

A window has the places and classes of its cells, int32 and uint8 (rows, cols); `low` is its first
row and column, two integers. A `table` has the columns of the places (see `PlaceTable.columns`),
the numbers ascending.
"""

from __future__ import annotations

import numpy as np

from hybridnav._base.jit import guarded, njit


@njit(cache=True, nogil=True)
def beside_of(cell, side, rows, cols):
    """Return the flat cell on a side of another one, 0 east to 3 south, -1 beyond the window."""
    row, col = cell // cols, cell % cols
    if side == 0:
        return cell + 1 if col + 1 < cols else -1
    if side == 1:
        return cell + cols if row + 1 < rows else -1
    if side == 2:
        return cell - 1 if col > 0 else -1
    return cell - cols if row > 0 else -1


@njit(cache=True, nogil=True)
def step_to(side, cols):
    """Return what a flat cell on a side differs by, for cells that are at no side of the window.

    `beside_of` divides, which takes longer than all else that is done for a cell.
    """
    if side == 0:
        return 1
    if side == 1:
        return cols
    if side == 2:
        return -1
    return -cols


@guarded
@njit(cache=True, nogil=True)
def look_again(place, low, table, numbers, limit):
    """Bring areas, boxes and surviving cells of places up to date.

    Their boxes hold them. A place from no cell of which all others are near enough loses those that
    are too far from the one nearest to its surviving cell before.

    Parameters
    ----------
    place, low, table
        See above; changed.
    numbers
        int64 (n,), the places.
    limit
        Squared distances to a surviving cell stay below it.

    Returns
    -------
    int64 (m,)
        The flat cells that were lost.
    int64 (k,)
        The places that have another surviving cell.
    """
    all_numbers, area, survivor, _, is_stale = table
    moved, n_moved = np.empty(numbers.size, np.int64), 0
    cells, n_cells = np.empty(16, np.int64), 0
    around = np.empty(4, np.int64)
    for number in numbers:
        i = np.searchsorted(all_numbers, number)
        is_stale[i] = True
        measure(place, low, (number, i), table, around)
        if area[i] == 0:
            continue
        at_row, at_col = np.int64(survivor[i, 0] - low[0]), np.int64(survivor[i, 1] - low[1])
        is_in = around[0] <= at_row < around[2] and around[1] <= at_col < around[3]
        if is_in and place[at_row, at_col] == number:
            continue
        found, is_near = survivor_in(place, number, around, (at_row, at_col), limit)
        survivor[i, 0], survivor[i, 1] = found[0] + low[0], found[1] + low[1]
        moved[n_moved] = number
        n_moved += 1
        if not is_near:
            lost = leave_near(place, number, around, found, limit)
            if n_cells + lost.size > cells.size:
                longer = np.empty(2 * (n_cells + lost.size), np.int64)
                longer[:n_cells] = cells[:n_cells]
                cells = longer
            cells[n_cells : n_cells + lost.size] = lost
            n_cells += lost.size
            measure(place, low, (number, i), table, around)
    return cells[:n_cells].copy(), moved[:n_moved].copy()


@njit(cache=True, nogil=True)
def measure(place, low, of_place, table, around):
    """Bring the area and the box of a place, given by number and row, up to date.

    `around` receives its box in the window, where it has cells; the box in the table holds it.
    """
    number, i = of_place
    area, box = table[1], table[3]
    n_found = 0
    low_row, low_col, high_row, high_col = place.shape[0], place.shape[1], 0, 0
    for row in range(box[i, 0] - low[0], box[i, 2] - low[0]):
        for col in range(box[i, 1] - low[1], box[i, 3] - low[1]):
            if place[row, col] == number:
                n_found += 1
                low_row, low_col = min(low_row, row), min(low_col, col)
                high_row, high_col = max(high_row, row + 1), max(high_col, col + 1)
    area[i] = n_found
    if n_found > 0:
        around[0], around[1], around[2], around[3] = low_row, low_col, high_row, high_col
        for k in range(4):
            box[i, k] = around[k] + low[k & 1]


@njit(cache=True, nogil=True)
def leave_near(place, number, box, survivor, limit):
    """Leave a place the cells near its surviving one that connect to it; return the others, flat.

    `box` holds the place, in the window.
    """
    cols = place.shape[1]
    flat = place.ravel()
    lost, n_lost = np.empty((box[2] - box[0]) * (box[3] - box[1]), np.int64), 0
    for row in range(box[0], box[2]):
        for col in range(box[1], box[3]):
            if place[row, col] == number:
                place[row, col] = -1
                lost[n_lost] = row * cols + col
                n_lost += 1
    waits = np.zeros(flat.size, np.bool_)
    waits[lost[:n_lost]] = True
    stack, size = np.empty(n_lost, np.int64), 1
    stack[0] = survivor[0] * cols + survivor[1]
    waits[stack[0]] = False
    while size > 0:
        size -= 1
        cell = stack[size]
        flat[cell] = number
        for side in range(4):
            beside = cell + step_to(side, cols)
            if not waits[beside]:
                continue
            squared = (beside // cols - survivor[0]) ** 2 + (beside % cols - survivor[1]) ** 2
            if squared < limit:
                waits[beside] = False
                stack[size] = beside
                size += 1
    return lost[:n_lost][waits[lost[:n_lost]]]


@njit(cache=True, nogil=True)
def survivor_in(place, number, box, before, limit):
    """Return a cell of a place, and whether no other one is too far from it.

    Tried are the cells that are nearest to the surviving one before and to the middle of the box;
    the first of them is returned where neither suits.
    """
    first_row, first_col = nearest_cell(place, number, box, float(before[0]), float(before[1]))
    if is_within(place, number, box, (first_row, first_col), limit):
        return (first_row, first_col), True
    middle = (box[0] + box[2] - 1) / 2, (box[1] + box[3] - 1) / 2
    row, col = nearest_cell(place, number, box, middle[0], middle[1])
    if is_within(place, number, box, (row, col), limit):
        return (row, col), True
    return (first_row, first_col), False


@njit(cache=True, nogil=True)
def is_within(place, number, box, cell, limit):
    """Return whether all cells of a place in a box are near enough to a cell."""
    row, col = np.int64(cell[0]), np.int64(cell[1])
    for i in range(box[0], box[2]):
        left = limit - (i - row) ** 2
        for j in range(box[1], box[3]):
            if (j - col) ** 2 >= left and place[i, j] == number:
                return False
    return True


@njit(cache=True, nogil=True)
def nearest_cell(place, number, box, row, col):
    """Return the cell of a place in a box that is nearest to a point, row and column."""
    least, found_row, found_col = np.inf, np.int64(-1), np.int64(-1)
    for i in range(box[0], box[2]):
        for j in range(box[1], box[3]):
            if place[i, j] == number:
                squared = (i - row) ** 2 + (j - col) ** 2
                if squared < least:
                    least, found_row, found_col = squared, i, j
    return found_row, found_col


@guarded
@njit(cache=True, nogil=True)
def join_nearest(window, low, table, cells, limit):
    """Let cells without a place join the place beside them with the nearest surviving cell.

    Parameters
    ----------
    window
        Places and classes; the places change.
    low, table
        See above; areas, boxes and stale places change.
    cells
        int64 (n,), flat cells that are vertices, none at a side of the window.
    limit
        The squared distance to a surviving cell stays below it.
    """
    place, of_class = window
    numbers, area, survivor, box, is_stale = table
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
        is_stale[nearest] = True
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
        See above; areas and stale places change.
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
    numbers, area, survivor, box, is_stale = table

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
        is_stale[i] = True
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
        if n_parts + n_cut > parts.size:
            longer = np.empty(2 * (n_parts + n_cut), np.int64)
            longer[:n_parts] = parts[:n_parts]
            parts = longer
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
