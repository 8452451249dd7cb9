"""Kernels of the exact overlay: cells on boundaries, distances inside fields, the overlay search.

Costs are the integers of `hybridnav.search.moves`.
"""

from __future__ import annotations

import heapq

import numpy as np

from hybridnav._jit import guarded, njit
from hybridnav.search.arrays import grow
from hybridnav.search.moves import COL_STEP, DIAGONAL, ROW_STEP, STRAIGHT, octile_cost

_NONE = np.int64(1) << 62


@njit(cache=True, nogil=True)
def field_boxes(labels, cols, n_fields):
    """Return the bounding boxes of fields: least row and column, greatest row and column."""
    boxes = np.empty((n_fields, 4), np.int64)
    boxes[:, :2] = labels.size
    boxes[:, 2:] = -1
    for cell in range(labels.size):
        field = labels[cell]
        if field >= 0:
            row, col = cell // cols, cell % cols
            boxes[field, 0] = min(boxes[field, 0], row)
            boxes[field, 1] = min(boxes[field, 1], col)
            boxes[field, 2] = max(boxes[field, 2], row)
            boxes[field, 3] = max(boxes[field, 3], col)
    return boxes


@njit(cache=True, nogil=True)
def boundary_cells(labels, moves, cols):
    """Return the flat cells with a legal move into another field, ascending."""
    found = np.empty(1024, np.int64)
    count = 0
    for cell in range(labels.size):
        mask = moves[cell]
        for k in range(8):
            if mask >> k & 1 and labels[cell + ROW_STEP[k] * cols + COL_STEP[k]] != labels[cell]:
                if count == found.size:
                    found = grow(found)
                found[count] = cell
                count += 1
                break
    return found[:count].copy()


@guarded
@njit(cache=True, nogil=True)
def cross_edges(labels, moves, cols, node_cell):
    """Return the legal moves between fields by their first node: offsets, heads, costs."""
    node_of = np.empty(labels.size, np.int32)
    for node in range(node_cell.size):
        node_of[node_cell[node]] = node
    first = np.zeros(node_cell.size + 1, np.int32)
    heads = np.empty(1024, np.int32)
    costs = np.empty(1024, np.int32)
    count = 0
    for node in range(node_cell.size):
        cell = np.int64(node_cell[node])
        mask = moves[cell]
        for k in range(8):
            if not mask >> k & 1:
                continue
            to = cell + ROW_STEP[k] * cols + COL_STEP[k]
            if labels[to] == labels[cell]:
                continue
            if count == heads.size:
                heads, costs = grow(heads), grow(costs)
            heads[count] = node_of[to]
            costs[count] = DIAGONAL if k & 1 else STRAIGHT
            count += 1
        first[node + 1] = count
    return first, heads[:count].copy(), costs[:count].copy()


@njit(cache=True, nogil=True)
def inner_moves(labels, moves, cols, field, box):
    """Return the moves that stay in a field, one byte mask for each cell of its bounding box."""
    width = box[3] - box[1] + 1
    inner = np.zeros((box[2] - box[0] + 1) * width, np.uint8)
    local = 0
    for row in range(box[0], box[2] + 1):
        for col in range(box[1], box[3] + 1):
            cell = row * cols + col
            if labels[cell] == field:
                mask = moves[cell]
                for k in range(8):
                    if mask >> k & 1:
                        if labels[cell + ROW_STEP[k] * cols + COL_STEP[k]] != field:
                            mask &= ~np.uint8(1 << k)
                inner[local] = mask
            local += 1
    return inner


@njit(cache=True, nogil=True)
def keep_table():
    """Return the useful moves after a move in each direction, out of a cell with all eight.

    All others lead back, or to a cell that the previous cell reaches at no greater cost.
    """
    keep = np.zeros(8, np.uint8)
    for k in range(8):
        for further in range(8):
            rows = ROW_STEP[k] + ROW_STEP[further]
            cols = COL_STEP[k] + COL_STEP[further]
            if max(abs(rows), abs(cols)) == 2:
                keep[k] |= 1 << further
    return keep


@njit(cache=True, nogil=True)
def distances_from(inner, width, source, keep, distance, closed, came, open_cells):
    """Fill in the costs of shortest paths inside a field from one cell, `_NONE` for no path.

    Buckets as wide as a straight step make the search label-setting (Dinic 1978); three take turns.
    A cell is improved at most once by each neighbour, which bounds the buckets.

    Parameters
    ----------
    inner
        uint8 (n,), the moves of the cells in the field's bounding box.
    width
        Columns of the box.
    source
        Index of a cell in the box.
    keep
        Result of `keep_table`.
    distance, closed, came, open_cells
        Work arrays from `room_for`: integer costs (filled in), cells done, directions, buckets.
    """
    distance[:] = _NONE
    closed[:] = False
    step = ROW_STEP * width + COL_STEP
    count = np.zeros(3, np.int64)
    distance[source] = 0
    came[source] = -1
    open_cells[0, 0] = source
    count[0] = 1
    turn = 0
    while count[0] + count[1] + count[2] > 0:
        slot = turn % 3
        while count[slot] > 0:
            count[slot] -= 1
            cell = open_cells[slot, count[slot]]
            if closed[cell]:
                continue
            closed[cell] = True
            cost = distance[cell]
            mask = inner[cell]
            k = came[cell]
            if k >= 0 and inner[cell - step[k]] == 255:
                mask &= keep[k]
            for k in range(8):
                if not mask >> k & 1:
                    continue
                to = cell + step[k]
                new_cost = cost + (DIAGONAL if k & 1 else STRAIGHT)
                if new_cost >= distance[to]:
                    continue
                distance[to] = new_cost
                came[to] = k
                into = new_cost // STRAIGHT % 3
                open_cells[into, count[into]] = to
                count[into] += 1
        turn += 1


@njit(cache=True, nogil=True)
def room_for(size):
    """Return the work arrays of `distances_from` for a box of `size` cells."""
    return (
        np.empty(size, np.int64),
        np.empty(size, np.bool_),
        np.empty(size, np.int8),
        np.empty((3, 8 * size + 1), np.int32),
    )


@njit(cache=True, nogil=True)
def local_of(cells, cols, box):
    """Return the indices of flat cells in the bounding box of their field."""
    width = box[3] - box[1] + 1
    local = np.empty(cells.size, np.int64)
    for i in range(cells.size):
        local[i] = (cells[i] // cols - box[0]) * width + cells[i] % cols - box[1]
    return local


@njit(cache=True, nogil=True)
def fill_cliques(labels, moves, cols, boxes, node_cell, node_first, clique_first, clique):
    """Fill `clique` with the distances between boundary cells inside fields; return if all fit.

    Parameters
    ----------
    labels
        int32 (n_cells,), the field of each flat cell.
    moves
        uint8 (n_cells,), its legal moves.
    cols
        Columns of the grid.
    boxes
        int64 (n_fields, 4), from `field_boxes`.
    node_cell, node_first
        Flat boundary cells by field; those of field f begin at `node_first[f]`.
    clique_first, clique
        Flat square matrices of integer costs, that of field f from `clique_first[f]` on. A distance
        must fit the type of `clique`.
    """
    keep = keep_table()
    largest = np.iinfo(clique.dtype).max
    for field in range(boxes.shape[0]):
        nodes = node_cell[node_first[field] : node_first[field + 1]]
        if nodes.size == 0:
            continue
        box = boxes[field]
        inner = inner_moves(labels, moves, cols, field, box)
        local = local_of(nodes, cols, box)
        distance, closed, came, open_cells = room_for(inner.size)
        width = np.int64(box[3] - box[1] + 1)
        position = clique_first[field]
        for source in local:
            distances_from(inner, width, source, keep, distance, closed, came, open_cells)
            for to in local:
                if distance[to] > largest:
                    return False
                clique[position] = distance[to]
                position += 1
    return True


@guarded
@njit(cache=True, nogil=True)
def distances_to_nodes(labels, moves, cols, boxes, node_cell, node_first, cell, other):
    """Return the distances inside its field from a cell to the boundary cells and to another cell.

    The latter is `_NONE` in another field. The third result is the number of cells reached.

    Parameters
    ----------
    labels, moves, cols, boxes, node_cell, node_first
        See `fill_cliques`.
    cell, other
        Flat cells.
    """
    field = labels[cell]
    box = boxes[field]
    inner = inner_moves(labels, moves, cols, field, box)
    distance, closed, came, open_cells = room_for(inner.size)
    endpoints = local_of(np.array([cell, other]), cols, box)
    width = np.int64(box[3] - box[1] + 1)
    distances_from(inner, width, endpoints[0], keep_table(), distance, closed, came, open_cells)
    local = local_of(node_cell[node_first[field] : node_first[field + 1]], cols, box)
    direct = distance[endpoints[1]] if labels[other] == field else _NONE
    return distance[local], direct, closed.sum()


@njit(cache=True, nogil=True)
def relax(heap, best, came, by_cross, node_cell, cols, goal, bound, node, new_cost, via, across):
    """Note a cheaper path to a node, unless no path through it can cost less than `bound`.

    Parameters
    ----------
    heap
        Pairs of an estimate and a node; grows.
    best, came
        int64 and int32 (n_nodes,), cost and predecessor; changed.
    by_cross
        bool (n_nodes,), whether a node is reached across a boundary; changed.
    node_cell
        Flat cell of each node.
    cols
        Columns of the grid.
    goal
        Flat cell.
    bound
        Integer cost of the best path so far.
    node, new_cost
        The node, and the integer cost of the path to it.
    via, across
        The node before, and whether a boundary lies between.
    """
    if new_cost >= best[node]:
        return
    cell = np.int64(node_cell[node])
    rest = octile_cost(cell // cols - goal // cols, cell % cols - goal % cols)
    if new_cost + rest >= bound:
        return
    best[node] = new_cost
    came[node] = via
    by_cross[node] = across
    heapq.heappush(heap, (new_cost + rest, node))


@guarded
@njit(cache=True, nogil=True)
def overlay_search(
    node_field,
    node_cell,
    cols,
    node_first,
    clique_first,
    clique,
    cross_first,
    cross_head,
    cross_cost,
    start_field,
    start_distance,
    goal_field,
    goal_distance,
    goal,
    direct,
):
    """Search the overlay by A*, from the boundary cells of the start's field to those of the
    goal's.

    A node reached inside its field is left only across the boundary: two paths in a row inside one
    field are never shorter than one.

    Parameters
    ----------
    node_field, node_cell
        Field and flat cell of each node.
    cols
        Columns of the grid.
    node_first, clique_first, clique
        See `fill_cliques`.
    cross_first, cross_head, cross_cost
        The moves of `cross_edges`.
    start_field, goal_field
        Fields of the two endpoints.
    start_distance, goal_distance
        Results of `distances_to_nodes`.
    goal
        Flat cell.
    direct
        Integer cost of the best path that never leaves the start's field.

    Returns
    -------
    tuple
        The cost, `_NONE` for no path; the nodes of the path, none if the direct path wins; whether
        each was reached across a boundary; the expansions.
    """
    best = np.full(node_cell.size, _NONE)
    came = np.full(node_cell.size, -1, np.int32)
    by_cross = np.zeros(node_cell.size, np.bool_)
    closed = np.zeros(node_cell.size, np.bool_)
    bound, last = np.int64(direct), np.int64(-1)
    heap = [(np.int64(0), np.int64(0))]
    heap.pop()
    for i in range(start_distance.size):
        node = np.int64(node_first[start_field] + i)
        cost = start_distance[i]
        relax(heap, best, came, by_cross, node_cell, cols, goal, bound, node, cost, -1, False)
    expanded = 0
    while len(heap) > 0:
        estimate, node = heapq.heappop(heap)
        if estimate >= bound:
            break
        if closed[node]:
            continue
        closed[node] = True
        expanded += 1
        cost = best[node]
        for i in range(cross_first[node], cross_first[node + 1]):
            to, to_cost = np.int64(cross_head[i]), cost + cross_cost[i]
            relax(heap, best, came, by_cross, node_cell, cols, goal, bound, to, to_cost, node, True)
        if not by_cross[node]:
            continue
        field = node_field[node]
        low = np.int64(node_first[field])
        if field == goal_field and cost + goal_distance[node - low] < bound:
            bound, last = cost + goal_distance[node - low], node
        size = node_first[field + 1] - low
        row = clique_first[field] + (node - low) * size
        for i in range(size):
            to, to_cost = low + i, cost + clique[row + i]
            relax(
                heap, best, came, by_cross, node_cell, cols, goal, bound, to, to_cost, node, False
            )
    count = 0
    node = last
    while node >= 0:
        count += 1
        node = np.int64(came[node])
    nodes = np.empty(count, np.int64)
    node = last
    for i in range(count - 1, -1, -1):
        nodes[i] = node
        node = np.int64(came[node])
    return bound, nodes, by_cross[nodes], expanded
