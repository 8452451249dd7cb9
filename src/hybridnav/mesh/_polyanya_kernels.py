"""Kernels of Polyanya: shortest any-angle paths by a search of intervals on a convex mesh.

M. L. Cui, D. D. Harabor, A. Grastien: Compromise-free pathfinding on a navigation mesh, 2017.

Points are x = column, y = row in grid units: corners are whole numbers, the two ends of a query are
rounded to 2^-24 of a cell, so that every side test is exact (see `turn_of`). An interval on a side
is never computed: it is what two rays from its root leave of the side, and a ray is the root and a
corner that limits the view, or a corner's mirror image of a root.
"""

from __future__ import annotations

import math

import numpy as np

from hybridnav._jit import njit
from hybridnav.search._exact_kernels import turn_of

NO_ROOM = -2.0
"""What `shortest` returns as length when there are more nodes than room."""

# Columns of a node's whole numbers.
_SLOT, _ROOT, _PARENT, _ENDS = 0, 1, 2, 3
# Bits of _ENDS: the interval ends at the left, at the right corner of its side. Below zero, where
# the root is an end of its side: the path bends at corner -1 - _ENDS too, on its way to the root.
_LEFT, _RIGHT = 1, 2
# Columns of a node's reals: cost of the root, points on the rays.
_G, _LX, _LY, _RX, _RY = 0, 1, 2, 3, 4

_SAME = 1e-9
"""Costs of a root that differ by less are taken for equal, in cells."""


@njit(cache=True, nogil=True)
def _turns(kind, dx, dy, side):
    """Return whether a path that arrives at a corner in a direction may bend to a side round it, 1
    for the left: the corner's one blocked cell must lie on that side."""
    if kind >= 4:
        return False
    ex = 1.0 if kind & 1 else -1.0
    ey = 1.0 if kind & 2 else -1.0
    return dx * ey * side >= 0.0 and -dy * ex * side >= 0.0


@njit(cache=True, nogil=True)
def _cut(px, py, qx, qy, ax, ay, bx, by):
    """Where the line from p through q meets that from a to b, rounded: for estimates alone."""
    ux, uy = qx - px, qy - py
    vx, vy = bx - ax, by - ay
    cross = ux * vy - uy * vx
    if cross == 0.0:
        return ax, ay
    share = ((px - ax) * uy - (py - ay) * ux) / -cross
    share = min(max(share, 0.0), 1.0)
    return ax + share * vx, ay + share * vy


@njit(cache=True, nogil=True)
def _estimate(x, y, lx, ly, rx, ry, tx, ty):
    """Length of the shortest way from a root through an interval to the goal."""
    # The goal on the near side is seen in the mirror of the side.
    vx, vy = lx - rx, ly - ry
    near = vx * (y - ry) - vy * (x - rx)
    far = vx * (ty - ry) - vy * (tx - rx)
    if near * far > 0.0:
        share = 2.0 * far / (vx * vx + vy * vy)
        tx, ty = tx + share * vy, ty - share * vx
    if (lx - x) * (ty - y) - (ly - y) * (tx - x) > 0.0:
        return math.hypot(lx - x, ly - y) + math.hypot(tx - lx, ty - ly)
    if (rx - x) * (ty - y) - (ry - y) * (tx - x) < 0.0:
        return math.hypot(rx - x, ry - y) + math.hypot(tx - rx, ty - ry)
    return math.hypot(tx - x, ty - y)


@njit(cache=True, nogil=True)
def _push(heap, size, key, value):
    """Put an entry into a binary heap."""
    at = size
    while at > 0:
        above = (at - 1) >> 1
        if heap[0][above] <= key:
            break
        heap[0][at], heap[1][at] = heap[0][above], heap[1][above]
        at = above
    heap[0][at], heap[1][at] = key, value


@njit(cache=True, nogil=True)
def _pop(heap, size):
    """Take the least entry out of a heap of `size`, which then has one fewer."""
    found = heap[1][0]
    size -= 1
    key, value = heap[0][size], heap[1][size]
    at = 0
    while True:
        below = 2 * at + 1
        if below >= size:
            break
        if below + 1 < size and heap[0][below + 1] < heap[0][below]:
            below += 1
        if heap[0][below] >= key:
            break
        heap[0][at], heap[1][at] = heap[0][below], heap[1][below]
        at = below
    heap[0][at], heap[1][at] = key, value
    return found


@njit(cache=True, nogil=True)
def shortest(mesh, blocks, ends, polygons, work):
    """Shortest path between two points of a mesh.

    Parameters
    ----------
    mesh
        float64 x and y of corners, uint8 kinds, int32 first, begins, twins, polygon_of.
    blocks
        int32 block of each slot, and bool whether the search may enter each block.
    ends
        sx, sy, tx, ty.
    polygons
        int32 polygons that hold the start, and those that hold the goal.
    work
        Nodes as int32 (n, 4) and float64 (n, 5), heap keys and values, best cost of each corner
        (infinite), int32 corners touched.

    Returns
    -------
    tuple
        Length, infinite without a path, or `NO_ROOM`; the last node, -1 for none; nodes expanded;
        corners touched.
    """
    cx, cy, kinds, first, begins, twins, polygon_of = mesh
    block_of, is_open = blocks
    sx, sy, tx, ty = ends
    starts, goals = polygons
    whole, real, keys, values, best, touched = work
    heap = (keys, values)
    n = size = n_touched = expanded = 0
    for polygon in starts:
        low, high = first[polygon], first[polygon + 1]
        if n + high - low > len(whole):
            return NO_ROOM, -1, expanded, n_touched
        for slot in range(low, high):
            twin = twins[slot]
            if twin < 0 or not is_open[block_of[slot]]:
                continue
            u = begins[slot]
            w = begins[low if slot + 1 == high else slot + 1]
            ux, uy, wx, wy = cx[u], cy[u], cx[w], cy[w]
            root, g, x, y, marks = -1, 0.0, sx, sy, _LEFT | _RIGHT
            if turn_of(sx, sy, ux, uy, wx, wy) == 0:
                # The start lies on the side, or on its line.
                from_u = abs(ux - sx) + abs(uy - sy)
                from_w = abs(wx - sx) + abs(wy - sy)
                if from_u + from_w == abs(ux - wx) + abs(uy - wy):
                    continue
                root, side = (u, -1) if from_u < from_w else (w, 1)
                if not _turns(kinds[root], cx[root] - sx, cy[root] - sy, side):
                    continue
                x, y = cx[root], cy[root]
                g = math.hypot(x - sx, y - sy)
            whole[n, _SLOT], whole[n, _ROOT], whole[n, _PARENT], whole[n, _ENDS] = (
                twin,
                root,
                -1,
                marks,
            )
            real[n, _G] = g
            real[n, _LX], real[n, _LY], real[n, _RX], real[n, _RY] = wx, wy, ux, uy
            _push(heap, size, g + _estimate(x, y, wx, wy, ux, uy, tx, ty), n)
            n, size = n + 1, size + 1
    while size:
        node = _pop(heap, size)
        size -= 1
        if whole[node, _SLOT] < 0:
            return real[node, _G], node, expanded, n_touched
        while True:
            expanded += 1
            polygon = polygon_of[whole[node, _SLOT]]
            # Three successors for each side at most, and the goal.
            if n + 3 * (first[polygon + 1] - first[polygon]) + 1 > len(whole):
                return NO_ROOM, -1, expanded, n_touched
            made = n
            n = _successors(mesh, blocks, ends, goals, whole, real, node, n)
            # Costs of roots: worse ones go.
            kept = made
            only = True
            for new in range(made, n):
                root = whole[new, _ROOT]
                g = real[new, _G]
                if root >= 0 and whole[new, _SLOT] >= 0:
                    if g > best[root] + _SAME:
                        continue
                    if g < best[root]:
                        if best[root] == np.inf:
                            touched[n_touched] = root
                            n_touched += 1
                        best[root] = g
                whole[kept], real[kept] = whole[new], real[new]
                only = only and whole[new, _SLOT] >= 0
                kept += 1
            n = kept
            if n == made + 1 and only:
                node = made
                continue
            for new in range(made, n):
                slot, root = whole[new, _SLOT], whole[new, _ROOT]
                key = real[new, _G]
                if slot >= 0:
                    key += _key(mesh, whole, real, new, sx, sy, tx, ty)
                _push(heap, size, key, new)
                size += 1
            break
        while size:
            top = values[0]
            root = whole[top, _ROOT]
            if root < 0 or whole[top, _SLOT] < 0 or real[top, _G] <= best[root] + _SAME:
                break
            _pop(heap, size)
            size -= 1
    return np.inf, -1, expanded, n_touched


@njit(cache=True, nogil=True)
def _key(mesh, whole, real, node, sx, sy, tx, ty):
    """Estimate of what is left from a node's root."""
    cx, cy, _, first, begins, _, polygon_of = mesh
    slot, root, marks = whole[node, _SLOT], whole[node, _ROOT], whole[node, _ENDS]
    x, y = (sx, sy) if root < 0 else (cx[root], cy[root])
    polygon = polygon_of[slot]
    a = begins[slot]
    b = begins[first[polygon] if slot + 1 == first[polygon + 1] else slot + 1]
    if root in (a, b):
        return math.hypot(tx - x, ty - y)
    lx, ly, rx, ry = real[node, _LX], real[node, _LY], real[node, _RX], real[node, _RY]
    if not marks & _LEFT:
        lx, ly = _cut(x, y, lx, ly, cx[a], cy[a], cx[b], cy[b])
    if not marks & _RIGHT:
        rx, ry = _cut(x, y, rx, ry, cx[a], cy[a], cx[b], cy[b])
    return _estimate(x, y, lx, ly, rx, ry, tx, ty)


@njit(cache=True, nogil=True)
def _put(whole, real, n, slot, root, parent, marks, g, lx, ly, rx, ry):
    """Write a node."""
    whole[n, _SLOT], whole[n, _ROOT], whole[n, _PARENT], whole[n, _ENDS] = slot, root, parent, marks
    real[n, _G] = g
    real[n, _LX], real[n, _LY], real[n, _RX], real[n, _RY] = lx, ly, rx, ry
    return n + 1


@njit(cache=True, nogil=True)
def _successors(mesh, blocks, ends, goals, whole, real, node, n):
    """Write the successors of a node; returns the number of nodes."""
    cx, cy, kinds, first, begins, twins, polygon_of = mesh
    block_of, is_open = blocks
    sx, sy, tx, ty = ends
    entry, root, marks = whole[node, _SLOT], whole[node, _ROOT], whole[node, _ENDS]
    g = real[node, _G]
    x, y = (sx, sy) if root < 0 else (cx[root], cy[root])
    polygon = polygon_of[entry]
    low, high = first[polygon], first[polygon + 1]
    a = begins[entry]
    b = begins[low if entry + 1 == high else entry + 1]
    is_goal = False
    for goal in goals:
        is_goal = is_goal or goal == polygon
    if root in (a, b):
        return _all_seen(mesh, blocks, ends, is_goal, whole, real, node, n)
    lx, ly, rx, ry = real[node, _LX], real[node, _LY], real[node, _RX], real[node, _RY]
    turns_right = marks & _RIGHT and _turns(kinds[b], cx[b] - x, cy[b] - y, -1)
    turns_left = marks & _LEFT and _turns(kinds[a], cx[a] - x, cy[a] - y, 1)
    g_right = g + math.hypot(cx[b] - x, cy[b] - y) if turns_right else np.inf
    g_left = g + math.hypot(cx[a] - x, cy[a] - y) if turns_left else np.inf
    if is_goal:
        to_right, to_left = turn_of(x, y, rx, ry, tx, ty), turn_of(x, y, lx, ly, tx, ty)
        if to_right >= 0 and to_left <= 0:
            n = _put(whole, real, n, -1, root, node, 0, g + math.hypot(tx - x, ty - y), 0, 0, 0, 0)
        elif to_right < 0 and turns_right:
            length = g_right + math.hypot(tx - cx[b], ty - cy[b])
            n = _put(whole, real, n, -1, b, node, 0, length, 0, 0, 0, 0)
        elif to_left > 0 and turns_left:
            length = g_left + math.hypot(tx - cx[a], ty - cy[a])
            n = _put(whole, real, n, -1, a, node, 0, length, 0, 0, 0, 0)
    u, ux, uy = b, cx[b], cy[b]
    right_u, left_u = 0 if marks & _RIGHT else -1, -1
    slot = entry
    for _ in range(high - low - 1):
        slot = low if slot + 1 == high else slot + 1
        w = begins[low if slot + 1 == high else slot + 1]
        wx, wy = cx[w], cy[w]
        right_w = turn_of(x, y, rx, ry, wx, wy)
        left_w = turn_of(x, y, lx, ly, wx, wy)
        twin = twins[slot]
        if twin >= 0 and is_open[block_of[slot]]:
            # Seen from the root, between the rays.
            if right_w > 0 and left_u < 0:
                seen = 0
                plx, ply, prx, pry = lx, ly, rx, ry
                if left_w <= 0:
                    plx, ply, seen = wx, wy, seen | _LEFT
                if right_u >= 0:
                    prx, pry, seen = ux, uy, seen | _RIGHT
                n = _put(whole, real, n, twin, root, node, seen, g, plx, ply, prx, pry)
            elif right_u == 0 and right_w == 0:
                if u == b:
                    if turns_right:
                        n = _put(whole, real, n, twin, b, node, 3, g_right, wx, wy, ux, uy)
                elif _turns(kinds[u], ux - x, uy - y, -1):
                    cost = g + math.hypot(ux - x, uy - y)
                    n = _put(whole, real, n, twin, u, node, 3, cost, wx, wy, ux, uy)
            elif left_u == 0 and left_w == 0:
                if w == a:
                    if turns_left:
                        n = _put(whole, real, n, twin, a, node, 3, g_left, wx, wy, ux, uy)
                elif _turns(kinds[w], wx - x, wy - y, 1):
                    cost = g + math.hypot(wx - x, wy - y)
                    n = _put(whole, real, n, twin, w, node, 3, cost, wx, wy, ux, uy)
            if turns_right and (right_u < 0 or (u == b and right_w < 0)):
                by, cost = b, g_right
                seen, plx, ply = _LEFT | _RIGHT, wx, wy
                if right_w > 0:
                    seen, plx, ply = _RIGHT, 2 * cx[b] - x, 2 * cy[b] - y
                elif u != b and turn_of(cx[b], cy[b], ux, uy, wx, wy) == 0:
                    # Behind a wall on one line with it: two bends at once.
                    by, cost = u, g_right + math.hypot(ux - cx[b], uy - cy[b])
                    seen = -1 - b
                if by == b or _turns(kinds[u], ux - cx[b], uy - cy[b], -1):
                    n = _put(whole, real, n, twin, by, node, seen, cost, plx, ply, ux, uy)
            if turns_left and (left_w > 0 or (w == a and left_u > 0)):
                by, cost = a, g_left
                seen, prx, pry = _LEFT | _RIGHT, ux, uy
                if left_u < 0:
                    seen, prx, pry = _LEFT, 2 * cx[a] - x, 2 * cy[a] - y
                elif w != a and turn_of(cx[a], cy[a], wx, wy, ux, uy) == 0:
                    by, cost = w, g_left + math.hypot(wx - cx[a], wy - cy[a])
                    seen = -1 - a
                if by == a or _turns(kinds[w], wx - cx[a], wy - cy[a], 1):
                    n = _put(whole, real, n, twin, by, node, seen, cost, wx, wy, prx, pry)
        u, ux, uy, right_u, left_u = w, wx, wy, right_w, left_w
    return n


@njit(cache=True, nogil=True)
def _all_seen(mesh, blocks, ends, is_goal, whole, real, node, n):
    """The successors of a node whose root is an end of its side: all of the polygon is seen."""
    cx, cy, kinds, first, begins, twins, polygon_of = mesh
    block_of, is_open = blocks
    _, _, tx, ty = ends
    entry, root, g = whole[node, _SLOT], whole[node, _ROOT], real[node, _G]
    x, y = cx[root], cy[root]
    polygon = polygon_of[entry]
    low, high = first[polygon], first[polygon + 1]
    if is_goal:
        n = _put(whole, real, n, -1, root, node, 0, g + math.hypot(tx - x, ty - y), 0, 0, 0, 0)
    slot = entry
    for _ in range(high - low - 1):
        slot = low if slot + 1 == high else slot + 1
        twin = twins[slot]
        if twin < 0 or not is_open[block_of[slot]]:
            continue
        u = begins[slot]
        w = begins[low if slot + 1 == high else slot + 1]
        ux, uy, wx, wy = cx[u], cy[u], cx[w], cy[w]
        by, cost = root, g
        if root not in (u, w) and turn_of(x, y, ux, uy, wx, wy) == 0:
            from_u, from_w = abs(ux - x) + abs(uy - y), abs(wx - x) + abs(wy - y)
            by, side = (u, -1) if from_u < from_w else (w, 1)
            if not _turns(kinds[by], cx[by] - x, cy[by] - y, side):
                continue
            cost += math.hypot(cx[by] - x, cy[by] - y)
        n = _put(whole, real, n, twin, by, node, _LEFT | _RIGHT, cost, wx, wy, ux, uy)
    return n
