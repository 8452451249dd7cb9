"""Kernels that repair a hierarchy of corners round closed cells, without a look at the rest of it.

An arc is *stale* if the path that it stands for meets a closed cell. Corners whose arcs change get
a *patch*, a list of arcs of their own: those of the hierarchy at their positions, then new ones.
The hierarchy itself stays, and so do queries of others that use it. What a contraction in the same
order would find for the patched corners is found again, and the corners of the closed cells are
contracted before all others.

J. Dibbelt, B. Strasser, D. Wagner: Customizable contraction hierarchies, 2016 (lower triangles).
"""

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow, pop, push
from hybridnav._base.moves import FAR
from hybridnav.search.contraction import HEAD_SHIFT, pack
from hybridnav.search.mesh.kernels.closures import (
    CHANGED,
    DEAD,
    KIND,
    crosses,
    is_beside,
)
from hybridnav.search.mesh.kernels.corner_search import see_from_new
from hybridnav.search.mesh.kernels.views import class_of, cost_of, touches, view_room

_GROUP = 64
"""Corners, neighbours on the map, that have a box in common."""
_ROOM = 4
"""Room for new arcs in a patch."""


@guarded
@njit(cache=True, nogil=True)
def footing_of(mesh, hierarchy):
    """Find what repairs need of a hierarchy.

    `mesh`: see `successors`; `hierarchy`: see `query_hierarchy`. Returns int32 (n,), numbers of
    corners in an order in which all arcs lead upwards; int32 (n + 1,) and (u,), the arcs that end
    at each corner; int32 (u,), where each begins; float32 (n, 4) and (groups, 4), least x and y,
    greatest x and y of the edges that are arcs from a corner, and from the corners of a group.
    """
    cx, cy = mesh[0], mesh[1]
    first, arcs, middles = hierarchy[0], hierarchy[1], hierarchy[2]
    n = len(first) - 1
    begin = np.zeros(n + 1, np.int32)
    tails = np.empty(len(arcs), np.int32)
    boxes = np.empty((n, 4), np.float32)
    groups = np.empty(((n + _GROUP - 1) // _GROUP, 4), np.float32)
    # A box of nothing, which the first edge replaces.
    for box in (boxes, groups):
        box[:, :2], box[:, 2:] = np.inf, -np.inf
    for node in range(n):
        # Edges alone count for the boxes: shortcuts are found through them.
        for arc in range(first[node], first[node + 1]):
            head = arcs[arc, 1] >> HEAD_SHIFT
            tails[arc] = node
            begin[head + 1] += 1
            if middles[arc] < 0:
                for box in (boxes[node], groups[node // _GROUP]):
                    box[0] = min(box[0], cx[node], cx[head])
                    box[1] = min(box[1], cy[node], cy[head])
                    box[2] = max(box[2], cx[node], cx[head])
                    box[3] = max(box[3], cy[node], cy[head])
    # The arcs into each corner, by the corners that they come from.
    below = begin[1:].copy()
    for node in range(n):
        begin[node + 1] += begin[node]  # where those of the next corner begin
    into, at = np.empty(len(arcs), np.int32), begin.copy()
    for arc in range(len(arcs)):
        head = arcs[arc, 1] >> HEAD_SHIFT
        into[at[head]] = arc
        at[head] += 1
    # A corner follows when all below it have been numbered.
    rank, order, count = np.empty(n, np.int32), np.empty(n, np.int32), 0
    for node in range(n):
        if below[node] == 0:
            order[count] = node
            count += 1
    for k in range(n):
        node = order[k]
        rank[node] = k
        for arc in range(first[node], first[node + 1]):
            head = arcs[arc, 1] >> HEAD_SHIFT
            below[head] -= 1
            if below[head] == 0:
                order[count] = head
                count += 1
    return rank, begin, into, tails, boxes, groups


# The patches. `patches` holds int32 (n,), the number of each corner's patch, 0 for none; int64 (p,
# 4) begin, size, room and corner of each; int64 (m, 4) cost, head and classes, middle, and whether
# an arc has changed. Row 0 of the second counts patches and used rows of the third; its third
# number is set if there was no room, and then nothing counts.


@njit(cache=True, nogil=True)
def _patch(hierarchy, patches, node):
    """Give a corner a patch with its arcs, unless it has one; return whether it has one now."""
    at, lists, pool = patches
    if at[node]:
        return True
    first, arcs, middles = hierarchy[0], hierarchy[1], hierarchy[2]
    low = high = 0
    if node < len(first) - 1:
        low, high = first[node], first[node + 1]
    size, begin, number = high - low, lists[0, 1], lists[0, 0] + 1
    if number == len(lists) or begin + size + _ROOM > len(pool):
        lists[0, 2] = 1
        return False
    lists[0, 0], lists[0, 1] = number, begin + size + _ROOM
    lists[number, 0], lists[number, 1] = begin, size
    lists[number, 2], lists[number, 3] = size + _ROOM, node
    for k in range(size):
        pool[begin + k, 0], pool[begin + k, 1] = arcs[low + k, 0], arcs[low + k, 1]
        pool[begin + k, 2], pool[begin + k, 3] = middles[low + k], 0
    at[node] = number
    return True


@njit(cache=True, nogil=True)
def _write(pool, row, cost, packed, middle):
    """Write an arc that has changed."""
    pool[row, 0], pool[row, 1], pool[row, 2], pool[row, 3] = cost, packed, middle, 1


@njit(cache=True, nogil=True)
def _offer(hierarchy, patches, tail, cost, packed, middle):
    """Put an arc into a corner's list, unless one that costs no more has its head.

    Return whether the list has changed.
    """
    first, arcs = hierarchy[0], hierarchy[1]
    at, lists, pool = patches
    head = packed >> HEAD_SHIFT
    if not at[tail]:
        for k in range(first[tail], first[tail + 1]):
            if arcs[k, 1] >> HEAD_SHIFT == head:
                if arcs[k, 0] <= cost:
                    return False
                break
        if not _patch(hierarchy, patches, tail):
            return False
    own = at[tail]
    begin, size = lists[own, 0], lists[own, 1]
    for k in range(begin, begin + size):
        if pool[k, 1] >> HEAD_SHIFT == head:
            if pool[k, 0] <= cost:
                return False
            _write(pool, k, cost, packed, middle)
            return True
    if size == lists[own, 2]:
        to, room = lists[0, 1], 2 * size
        if to + room > len(pool):
            lists[0, 2] = 1
            return False
        for k in range(size):
            for column in range(4):
                pool[to + k, column] = pool[begin + k, column]
        lists[own, 0], lists[own, 2], lists[0, 1] = to, room, to + room
        begin = to
    _write(pool, begin + size, cost, packed, middle)
    lists[own, 1] += 1
    return True


@njit(cache=True, nogil=True)
def _spoil(hierarchy, patches, stack, n, tail, position):
    """Mark an arc as stale, and stack it; return the size of the stack, which has room."""
    at, lists, pool = patches
    if not _patch(hierarchy, patches, tail):
        return n
    row = lists[at[tail], 0] + position
    if pool[row, 3] == 0:
        pool[row, 0], pool[row, 3] = FAR, 1
        stack[n, 0], stack[n, 1] = tail, position
        n += 1
    return n


@njit(cache=True, nogil=True)
def _spoil_all(mesh, hierarchy, footing, around, patches):
    """Mark all arcs as stale whose path meets a closed cell."""
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    first, arcs, middles, follow = hierarchy
    rank, _, _, _, boxes, groups = footing
    closure, free = around[0], around[1]
    low_y, high_y = closure[0][0], closure[0][1] + 1
    low_x, high_x = closure[0][2], closure[0][3] + 1
    stack, n = np.empty((len(patches[2]), 2), np.int32), 0
    # Boxes of groups, then of corners, leave few edges to test exactly.
    for group in range(len(groups)):
        box = groups[group]
        if box[0] > high_x or box[2] < low_x or box[1] > high_y or box[3] < low_y:
            continue
        for node in range(group * _GROUP, min(group * _GROUP + _GROUP, len(boxes))):
            box = boxes[node]
            if box[0] > high_x or box[2] < low_x or box[1] > high_y or box[3] < low_y:
                continue
            for arc in range(first[node], first[node + 1]):
                head = arcs[arc, 1] >> HEAD_SHIFT
                if middles[arc] >= 0 or not is_beside(
                    closure[0], cx[node], cy[node], cx[head], cy[head]
                ):
                    continue
                is_dead = (kinds[node] | kinds[head]) & DEAD
                if is_dead or crosses(closure, free, cx[node], cy[node], cx[head], cy[head]):
                    n = _spoil(hierarchy, patches, stack, n, node, arc - first[node])

    # A shortcut is stale if one of the two arcs that it stands for is.
    while n > 0:
        n -= 1
        node, position = stack[n, 0], stack[n, 1]
        stale = arcs[first[node] + position, 1]
        may_follow = follow[kinds[node] & KIND, stale >> 6 & 63]
        one = stale >> HEAD_SHIFT
        # Where a cheaper arc had the same ends, no shortcut past this corner was kept.
        for arc in range(first[node], first[node + 1]):
            other = arcs[arc, 1] >> HEAD_SHIFT
            if may_follow >> (arcs[arc, 1] >> 6 & 63) & 1 == 0 or other == one:
                continue
            low, high = (one, other) if rank[one] < rank[other] else (other, one)
            for k in range(first[low], first[low + 1]):
                if arcs[k, 1] >> HEAD_SHIFT == high:
                    if middles[k] >> 32 == node:
                        n = _spoil(hierarchy, patches, stack, n, low, k - first[low])
                    break


@njit(cache=True, nogil=True)
def _mend(mesh, hierarchy, footing, around, edges, patches, node, row_of):
    """Find the least costs of the stale arcs of a corner, by corners below.

    Parameters
    ----------
    mesh, hierarchy, footing, around, edges
        See `repair`.
    patches, node
        Room for the results of `repair`, and the corner.
    row_of
        int32 (n,), 0, and so it is left.
    """
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    first, arcs, middles, follow = hierarchy
    _, begin, into, tails, _, _ = footing
    closure, free = around[0], around[1]
    at, lists, pool = patches
    base = lists[at[node], 0]
    n_stale = 0
    # Its stale arcs, by the corners where they end; none to corners that cannot be passed.
    for position in range(first[node + 1] - first[node]):
        row = base + position
        head = pool[row, 1] >> HEAD_SHIFT
        if pool[row, 3] == 0 or (kinds[node] | kinds[head]) & DEAD:
            continue
        row_of[head] = row + 1
        n_stale += 1
        # A shortcut may stand for an edge as long as it.
        if middles[first[node] + position] < 0:
            continue
        for k in range(edges[0][2 * node], edges[0][2 * node + 2]):
            if edges[1][k] == head and not crosses(
                closure, free, cx[node], cy[node], cx[head], cy[head]
            ):
                cost = cost_of(cx[node], cy[node], cx[head], cy[head])
                if cost < pool[row, 0]:
                    dx, dy = cx[head] - cx[node], cy[head] - cy[node]
                    near = class_of(kinds[node], dx, dy)
                    far = class_of(kinds[head], -dx, -dy)
                    _write(pool, row, cost, pack(head, near, far), -1)
    # Each corner below with arcs to both ends of a stale one may join them. Those of its arcs that
    # have changed were offered before; these have not.
    for k in range(begin[node], begin[node + 1] if n_stale else begin[node]):
        low = tails[into[k]]
        here = into[k] - first[low]
        if at[low]:
            rows = pool[lists[at[low], 0] : lists[at[low], 0] + first[low + 1] - first[low]]
            to_node, by = rows[here, 0], rows[here, 1]
        else:
            to_node, by = arcs[into[k], 0], arcs[into[k], 1]
        may_follow = follow[kinds[low] & KIND, by >> 6 & 63]
        for other in range(first[low + 1] - first[low]):
            row = row_of[arcs[first[low] + other, 1] >> HEAD_SHIFT] - 1
            if row < 0:
                continue
            if at[low]:
                cost, packed = to_node + rows[other, 0], rows[other, 1]
            else:
                cost, packed = to_node + arcs[first[low] + other, 0], arcs[first[low] + other, 1]
            if cost < pool[row, 0] and may_follow >> (packed >> 6 & 63) & 1:
                past = np.int64(low) << 32 | here << 16 | other
                head = packed >> HEAD_SHIFT
                _write(pool, row, cost, pack(head, by & 63, packed & 63), past)
    # The room of marks is left as it was.
    for position in range(first[node + 1] - first[node]):
        row_of[pool[base + position, 1] >> HEAD_SHIFT] = 0


@guarded
@njit(cache=True, nogil=True)
def repair(mesh, hierarchy, footing, around, edges, place, room):
    """Find the patches of a hierarchy round closed cells.

    Parameters
    ----------
    mesh
        See `successors`, with the corners and kinds of `corners_round`.
    hierarchy
        See `query_hierarchy`; the first four.
    footing
        Result of `footing_of`.
    around
        See `look_round`.
    edges
        Result of `edges_of`.
    place
        Component of polygons, and the polygon of each cell.
    room
        Most arcs of patches.

    Returns
    -------
    tuple
        int32 (n,), the number of each corner's patch, 0 for none; int64 (p, 4), where it begins and
        its size, without rows if the room is too small; int64 (m, 4), the arcs.
    """
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    rank, follow = footing[0], hierarchy[3]
    n_old, n_all = around[4], len(cx)
    patches = (
        np.zeros(n_all, np.int32),
        np.empty((room // 8 + 1, 4), np.int64),
        np.empty((room, 4), np.int64),
    )
    at, lists, pool = patches
    lists[0] = 0
    _spoil_all(mesh, hierarchy, footing, around, patches)

    # Arcs between the new corners, and to those that they see.
    view = view_room(1024)
    polygons = np.empty(len(place[0]), np.int32)
    for corner in range(n_old, n_all):
        x, y, kind = cx[corner], cy[corner], kinds[corner]
        if not _patch(hierarchy, patches, corner):
            break
        n, view = see_from_new(mesh, around, place, (x, y), view, polygons)
        # Only segments along which a path may bend round it, each once.
        for k in range(n):
            other = np.int64(view[2][k])
            dx, dy = cx[other] - x, cy[other] - y
            if n_old <= other <= corner or not touches(kind, dx, dy) or kinds[other] & CHANGED:
                continue
            near, far = class_of(kind, dx, dy), class_of(kinds[other], -dx, -dy)
            cost = cost_of(x, y, cx[other], cy[other])
            _offer(hierarchy, patches, corner, cost, pack(other, near, far), -1)

    # Upwards, corner by corner: mend its stale arcs, and offer what joins two of its arcs of which
    # one has changed. New corners come first.
    queue, waiting = np.empty((len(lists), 2), np.int64), 0
    is_queued, row_of = np.zeros(n_all, np.bool_), np.zeros(n_all, np.int32)
    heads, classes = np.empty(64, np.int32), np.empty(64, np.int32)
    for k in range(1, lists[0, 0] + 1):
        node = lists[k, 3]
        push(queue, waiting, _rank_of(rank, node, n_all), node)
        waiting += 1
        is_queued[node] = True
    after = np.empty(256, np.int32)
    # A corner is taken once: what is offered to it comes from corners below.
    while waiting > 0 and not lists[0, 2]:
        node = pop(queue, waiting)
        waiting -= 1
        if node < n_old:
            _mend(mesh, hierarchy, footing, around, edges, patches, node, row_of)

        # Lists of its arcs by class: one arc in twenty may follow another. Its own patch stays as
        # it is, those of corners above may move.
        base, size, n_classes = lists[at[node], 0], lists[at[node], 1], 0
        while size > len(after):
            after = grow(after)
        heads[:] = -1
        for one in range(size):
            if pool[base + one, 0] < FAR:
                near = pool[base + one, 1] >> 6 & 63
                if heads[near] < 0:
                    classes[n_classes] = near
                    n_classes += 1
                after[one], heads[near] = heads[near], one
        for one in range(size):
            a = base + one
            if pool[a, 3] == 0 or pool[a, 0] == FAR:
                continue
            # Only arcs that leave into the other quadrant, without a bend to the wrong side.
            may_follow = follow[kinds[node] & KIND, pool[a, 1] >> 6 & 63]
            up = _rank_of(rank, pool[a, 1] >> HEAD_SHIFT, n_all)
            for near in classes[:n_classes]:
                two = heads[near] if may_follow >> near & 1 else -1
                while two >= 0:
                    this, b = two, base + two
                    two = after[two]
                    if this == one or (pool[b, 3] and this < one):
                        continue
                    # The new arc belongs to the lower one of the two ends.
                    low, high, to_low, to_high = a, b, one, this
                    if up > _rank_of(rank, pool[b, 1] >> HEAD_SHIFT, n_all):
                        low, high, to_low, to_high = b, a, this, one
                    tail = pool[low, 1] >> HEAD_SHIFT
                    packed = pack(
                        pool[high, 1] >> HEAD_SHIFT, pool[low, 1] & 63, pool[high, 1] & 63
                    )
                    past = np.int64(node) << 32 | to_low << 16 | to_high
                    cost = pool[a, 0] + pool[b, 0]
                    if _offer(hierarchy, patches, tail, cost, packed, past) and not is_queued[tail]:
                        push(queue, waiting, _rank_of(rank, tail, n_all), tail)
                        waiting += 1
                        is_queued[tail] = True
    n_patches = 0 if lists[0, 2] else lists[0, 0] + 1
    return at, lists[:n_patches].copy(), pool[: lists[0, 1]].copy()


@njit(cache=True, nogil=True)
def _rank_of(rank, node, n_all):
    """Return the place of a corner in the order; new ones come first."""
    return np.int64(rank[node]) if node < len(rank) else np.int64(node) - n_all
