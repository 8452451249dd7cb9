"""Kernels that contract a graph of corners into a hierarchy.

R. Geisberger, P. Sanders, D. Schultes, D. Delling: Contraction hierarchies, 2008. Corners are
removed one by one. A shortcut is added between two neighbours of a removed corner if the path
through it may be the only shortest one.

The arcs from one corner are adjacent in a pool, int64 (n, 3): the cost; the head and the classes at
both endpoints (see `pack`); the middle, which is the corner that a shortcut leads past or -1, and
the number of legs. Each arc comes with its reverse.

A *class* groups arcs by the way they leave a corner, and a table states which two classes a
shortest path may join there: a bend to the wrong side is never on one.
"""

from typing import NamedTuple

import numpy as np

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import grow_rows, pop, push

SLACK = 6000
"""Delay with which a corner may still be contracted, in thousandths of a level. With 0 there are 3
% fewer shortcuts, in twice the time."""
_UNKNOWN = -(1 << 40)
_MOST_ARCS = 1 << 16
"""Most arcs from a corner, whose positions have 16 bits, see `contract`."""
_CORE = 256
"""Arcs of the best corner from which on the corners left, the core, are removed in the order of
their arcs. The last 1,024 of 64 million cells take 1.5 seconds instead of 20, and a fifth fewer
arcs; maps of up to 16 million cells had no such core."""
HEAD_SHIFT = 12
"""Bits of the two classes of an arc, see `pack`."""


@njit(cache=True, nogil=True)
def pack(head, near, far):
    """Return an arc's head, its class at its tail, and its class at its head, in one number.

    Classes are below 64 and describe how the arc leads away from the corner.
    """
    return head << HEAD_SHIFT | near << 6 | far


@njit(cache=True, nogil=True)
def have_reverses(first, heads):
    """Return whether each arc of a graph occurs once, and once in the other direction.

    `first`, `heads`: offsets of the arcs of each corner, and the corner at which each arc ends.
    """
    n = first.size - 1
    begin = np.zeros(n + 1, np.int64)
    for arc in range(heads.size):
        begin[heads[arc] + 1] += 1
    for node in range(n):
        begin[node + 1] += begin[node]
    tails, at = np.empty(heads.size, np.int64), begin.copy()
    for node in range(n):
        for arc in range(first[node], first[node + 1]):
            tails[at[heads[arc]]] = node
            at[heads[arc]] += 1
    seen = np.full(n, -1, np.int64)
    for node in range(n):
        for arc in range(first[node], first[node + 1]):
            if seen[heads[arc]] == node:
                return False
            seen[heads[arc]] = node
        if begin[node + 1] - begin[node] != first[node + 1] - first[node]:
            return False
        for arc in range(begin[node], begin[node + 1]):
            if seen[tails[arc]] != node:
                return False
    return True


class _Pool(NamedTuple):
    """The arcs of a graph, with room for more."""

    begin: np.ndarray
    """int64 (n,), where the part of each corner begins."""
    size: np.ndarray
    """int64 (n,), its arcs."""
    room: np.ndarray
    """int64 (n,), and what it has room for."""
    arcs: np.ndarray
    """int64 (m, 3)."""
    used: int
    """Rows of `arcs` that are used."""


class _Left(NamedTuple):
    """The graph of the corners that are left; see `_Pool` and `contract`."""

    begin: np.ndarray
    size: np.ndarray
    pool: np.ndarray
    kinds: np.ndarray
    follow: np.ndarray


@njit(cache=True, nogil=True)
def _pool_of(first, arcs):
    """Return a pool of the arcs of a graph, with room for more."""
    n = first.size - 1
    begin, size, room = np.empty(n, np.int64), np.empty(n, np.int64), np.empty(n, np.int64)
    pool = np.empty((2 * arcs.shape[0] + 4 * n, 3), np.int64)
    used = 0
    for node in range(n):
        begin[node], size[node] = used, first[node + 1] - first[node]
        for k in range(size[node]):
            arc = first[node] + k
            pool[used + k, 0], pool[used + k, 1] = arcs[arc, 0], arcs[arc, 1]
            pool[used + k, 2] = -1 << 32 | 1
        room[node] = size[node] + 2
        used += room[node]
    return _Pool(begin, size, room, pool, used)


@njit(cache=True, nogil=True)
def _search(graph, node, source, limit, n_wanted, stamp, work):
    """Search for paths from a neighbour of a corner that avoid the corner (witness search).

    Parameters
    ----------
    graph
        `_Left`.
    node
        The corner that paths must avoid.
    source
        The neighbour.
    limit
        Greatest cost of a path.
    n_wanted
        Number of corners whose record has the stamp in column 2: the search ends when it has
        settled them.
    stamp
        Number of this search.
    work
        Records, int64 (n, 3): distance, stamp and class of the path back, stamp of the wanted
        corners; a heap; the most corners to settle. The heap has room for that number times the
        greatest number of arcs from a corner.
    """
    begin, size, pool = graph.begin, graph.size, graph.pool
    kinds, follow = graph.kinds, graph.follow
    records, heap, most_settled = work
    records[node, 0], records[node, 1] = -1, stamp << 8
    records[source, 0], records[source, 1] = 0, stamp << 8 | 255
    heap[0, 0], heap[0, 1] = 0, source
    waiting, settled = 1, 0
    while waiting > 0 and settled < most_settled and n_wanted > 0:
        cost = heap[0, 0]
        at = pop(heap, waiting)
        waiting -= 1
        if cost != records[at, 0]:
            continue
        settled += 1
        n_wanted -= records[at, 2] == stamp
        last = records[at, 1] & 255
        may_follow = np.int64(-1) if last == 255 else follow[kinds[at], last]
        for arc in range(begin[at], begin[at] + size[at]):
            packed = pool[arc, 1]
            further = cost + pool[arc, 0]
            if further > limit or may_follow >> (packed >> 6 & 63) & 1 == 0:
                continue
            there = packed >> HEAD_SHIFT
            if records[there, 1] >> 8 != stamp or further < records[there, 0]:
                records[there, 0], records[there, 1] = further, stamp << 8 | packed & 63
                push(heap, waiting, further, there)
                waiting += 1


@njit(cache=True, nogil=True)
def _shortcuts(graph, node, stamp, work, joined):
    """Find the shortcuts that the removal of a corner needs.

    `graph`, `work`: see `_search`; `stamp`: number of the last search; `joined`: bool (n, n), room
    for all pairs of arcs from the corner; set where a shortcut joins the two. Result: number of
    shortcuts, number of legs in them, stamp of the last search.
    """
    begin, size, pool = graph.begin, graph.size, graph.pool
    kinds, follow = graph.kinds, graph.follow
    records = work[0]
    n_pairs = n_legs = 0
    end = begin[node] + size[node]
    joined[:] = False
    for one in range(begin[node], end - 1):
        cost, packed = pool[one, 0], pool[one, 1]
        may_follow = follow[kinds[node], packed >> 6 & 63]
        stamp += 1
        n_wanted, limit = 0, np.int64(0)
        for two in range(one + 1, end):
            if may_follow >> (pool[two, 1] >> 6 & 63) & 1:
                records[pool[two, 1] >> HEAD_SHIFT, 2] = stamp
                limit = max(limit, cost + pool[two, 0])
                n_wanted += 1
        if n_wanted == 0:
            continue
        _search(graph, node, packed >> HEAD_SHIFT, limit, n_wanted, stamp, work)
        for two in range(one + 1, end):
            if may_follow >> (pool[two, 1] >> 6 & 63) & 1 == 0:
                continue
            there = pool[two, 1] >> HEAD_SHIFT
            if records[there, 1] >> 8 != stamp or records[there, 0] > cost + pool[two, 0]:
                joined[one - begin[node], two - begin[node]] = True
                joined[two - begin[node], one - begin[node]] = True
                n_pairs += 1
                n_legs += (pool[one, 2] & 0xFFFFFFFF) + (pool[two, 2] & 0xFFFFFFFF)
    return n_pairs, n_legs, stamp


@njit(cache=True, nogil=True)
def _take_out(begin, size, pool, node):
    """Remove the arcs to a corner from the parts of its neighbours."""
    for arc in range(begin[node], begin[node] + size[node]):
        other = pool[arc, 1] >> HEAD_SHIFT
        last = begin[other] + size[other] - 1
        for at in range(begin[other], last + 1):
            if pool[at, 1] >> HEAD_SHIFT == node:
                pool[at] = pool[last]
                size[other] -= 1
                break


@njit(cache=True, nogil=True)
def _room_for(parts, pool, used, tail, wanted):
    """Make room for more arcs from a corner; return the pool, a new one if it was full, and the
    used number of its rows."""
    begin, size, room = parts
    if size[tail] + wanted > room[tail]:
        room[tail] = 2 * (size[tail] + wanted)
        while used + room[tail] > pool.shape[0]:
            pool = grow_rows(pool)
        pool[used : used + size[tail]] = pool[begin[tail] : begin[tail] + size[tail]]
        begin[tail] = used
        used += room[tail]
    return pool, used


@njit(cache=True, nogil=True)
def _put_in(parts, node, one, joined, work):
    """Put the shortcuts past a removed corner into the part of one of its neighbours.

    An arc that leads to the same head already is improved instead.

    Parameters
    ----------
    parts
        Begin and size of parts of the pool, and the pool, in which there is room.
    node
        The removed corner.
    one
        The position of the arc to the neighbour, of those from the corner.
    joined
        Bool (n,), the arcs from the corner to the heads of the shortcuts.
    work
        Records, in whose column 2 the place of each head is noted, and a new negative mark.
    """
    begin, size, pool = parts
    records, mark = work
    there = pool[begin[node] + one]
    tail = there[1] >> HEAD_SHIFT
    first = begin[tail]
    for k in range(size[tail]):
        records[pool[first + k, 1] >> HEAD_SHIFT, 2] = mark << 32 | k
    for two in range(joined.size):
        if not joined[two]:
            continue
        back = pool[begin[node] + two]
        cost, head = there[0] + back[0], back[1] >> HEAD_SHIFT
        noted = records[head, 2]
        at = first + (noted & 0xFFFFFFFF)
        if noted >> 32 != mark:
            at = first + size[tail]
            size[tail] += 1
        elif cost >= pool[at, 0]:
            continue
        pool[at, 0], pool[at, 1] = cost, pack(head, there[1] & 63, back[1] & 63)
        pool[at, 2] = node << 32 | (there[2] & 0xFFFFFFFF) + (back[2] & 0xFFFFFFFF)


@njit(cache=True, nogil=True)
def _packed_arcs(begin, size, pool):
    """Return the arcs left in the pool, packed.

    The result holds the offsets of each corner's arcs, their costs and heads, and their middles
    (see `contract`).
    """
    n = begin.size
    first = np.zeros(n + 1, np.int32)
    for node in range(n):
        first[node + 1] = first[node] + size[node]
    arcs, middles = np.empty((first[n], 2), np.int64), np.full(first[n], np.int64(-1))
    for node in range(n):
        for k in range(size[node]):
            arc = pool[begin[node] + k]
            arcs[first[node] + k, 0], arcs[first[node] + k, 1] = arc[0], arc[1]
            middle = arc[2] >> 32
            if middle >= 0:
                to_tail = to_head = np.int64(0)
                for at in range(size[middle]):
                    other = pool[begin[middle] + at, 1] >> HEAD_SHIFT
                    to_tail = at if other == node else to_tail
                    to_head = at if other == arc[1] >> HEAD_SHIFT else to_head
                middles[first[node] + k] = middle << 32 | to_tail << 16 | to_head
    return first, arcs, middles


@guarded
@njit(cache=True, nogil=True)
def contract(kinds, first, arcs, follow, effort, kept):
    """Contract the corners of a graph, first those that leave few and short shortcuts.

    `kinds`: uint8 (n,), kinds of corners; `first`, `arcs`: the graph: offsets of the arcs of each
    corner; int64 (m, 2), the cost of each, and the result of `pack`. Each arc comes with its
    reverse; a graph with one that does not is given up at once. `follow`: int64 (kinds, classes):
    bit c is set where a shortest path that passes a corner of this kind along an arc of the one
    class may continue along one of class c. If the bit is not set, the two must cost more than
    another path, by more than the rounding of costs. `effort`: most corners that a witness search
    settles; most arcs to examine before contraction is given up, as it also is for a corner with
    more than `_MOST_ARCS` arcs. `kept`: bool (n,), corners that are left, with arcs between them;
    empty for none. Returns int32 (n + 1,), where the arcs of each corner to those contracted after
    it begin; int64 (u, 2), these arcs; int64 (u,), the corner that each leads
    past, in the high half, and the positions among its arcs of those to the tail and to the head,
    16 bits each, -1 for an arc of the graph; int32 (n,), the corners in the order of their removal,
    those that are left last. If contraction is given up, there are no arcs.
    """
    n = first.size - 1
    most_settled, most_looked = effort
    made = _pool_of(first, arcs)
    begin, size, room = made.begin, made.size, made.room
    pool, used = made.arcs, made.used
    level, taken = np.zeros(n, np.int64), np.empty(n, np.int32)

    # Keys that are not known lie below all others: every corner is rated before the first is
    # removed.
    queue = np.empty((n, 2), np.int64)
    most, waiting = np.int64(1), 0
    for node in range(n):
        most = max(most, size[node])
        if kept.size == 0 or not kept[node]:
            push(queue, waiting, _UNKNOWN + size[node], node)
            waiting += 1
        else:
            taken[n - 1 - (node - waiting)] = node

    # A witness search queues the arcs of the corners that it settles, at most `most` for each.
    records = np.zeros((n, 3), np.int64)
    heap = np.empty((most_settled * most + 1, 2), np.int64)
    joined = np.empty(most * most, np.bool_)
    stamp = looked = mark = np.int64(0)
    n_removed = waiting
    is_core, is_given_up = False, not have_reverses(first, arcs[:, 1] >> HEAD_SHIFT)
    while waiting > 0:
        node = pop(queue, waiting)
        waiting -= 1

        # The corners left are joined so closely that to count their shortcuts again and again takes
        # too long: from here on, those with the fewest arcs go first. No count is needed for that.
        if not is_core and size[node] >= _CORE and 16 * size[node] > waiting:
            is_core = True
            queue[:waiting, 0] = 0
        if is_core and waiting > 0 and size[node] > queue[0, 0]:
            push(queue, waiting, size[node], node)
            waiting += 1
            continue

        # Estimate what the witness searches will look at before they run: a graph on which they
        # take too long is given up in time.
        legs = np.int64(0)
        for arc in range(begin[node], begin[node] + size[node]):
            legs += pool[arc, 2] & 0xFFFFFFFF
            looked += size[node] + most_settled * size[pool[arc, 1] >> HEAD_SHIFT]

        # The result has 16 bits for a position among the arcs of a corner: hence the last limit.
        if is_given_up or looked > most_looked or size[node] > _MOST_ARCS:
            size[:] = 0
            break

        # Shortcuts gave corners more arcs than the graph did: the work arrays follow.
        if most_settled * most >= heap.shape[0]:
            heap = np.empty((2 * most_settled * most + 1, 2), np.int64)
        n_arcs = size[node]
        if n_arcs * n_arcs > joined.size:
            joined = np.empty(2 * n_arcs * n_arcs, np.bool_)
        table = joined[: n_arcs * n_arcs].reshape(n_arcs, n_arcs)
        graph, work = _Left(begin, size, pool, kinds, follow), (records, heap, most_settled)
        n_pairs, n_legs, stamp = _shortcuts(graph, node, stamp, work, table)

        # Prefer corners whose removal adds few arcs and legs for those that it takes away. The
        # level spreads removals over the map, so that the hierarchy stays flat.
        key = 1000 * level[node]
        if size[node] > 0:
            key += 1000 * n_pairs // size[node] + 1000 * n_legs // legs

        # Keys age as neighbours are removed: a corner that is now clearly worse than the next one
        # waits again.
        if waiting > 0 and not is_core and key > queue[0, 0] + SLACK:
            push(queue, waiting, key, node)
            waiting += 1
            continue

        # The corner keeps its own arcs: they lead only to corners removed later, up the hierarchy.
        taken[n_removed - waiting - 1] = node
        _take_out(begin, size, pool, node)
        for arc in range(begin[node], begin[node] + size[node]):
            other = pool[arc, 1] >> HEAD_SHIFT
            level[other] = max(level[other], level[node] + 1)

        # A shortcut takes the class at each of its ends from the arc there, so `follow` holds for
        # it too, and its legs from both. Each comes with its reverse.
        for one in range(n_arcs):
            n_wanted = 0
            for two in range(n_arcs):
                n_wanted += table[one, two]
            if n_wanted > 0:
                mark -= 1
                tail = pool[begin[node] + one, 1] >> HEAD_SHIFT
                pool, used = _room_for((begin, size, room), pool, used, tail, n_wanted)
                _put_in((begin, size, pool), node, one, table[one], (records, mark))
                most = max(most, size[tail])
    first, arcs, middles = _packed_arcs(begin, size, pool)
    return first, arcs, middles, taken


@guarded
@njit(cache=True, nogil=True)
def renumbered(first, arcs, middles, order):
    """Renumber the corners of a hierarchy.

    Every search climbs to the corners that were removed last: if these have the first numbers, so
    that their arcs are adjacent, they stay in the processor's cache.

    `first`, `arcs`, `middles`: results of `contract`; `order`: int32 (n,), the new number of each
    corner. Returns the three arrays in the new order.
    """
    n = order.size
    new_first = np.zeros(n + 1, np.int32)
    for node in range(n):
        new_first[order[node] + 1] = first[node + 1] - first[node]
    for node in range(n):
        new_first[node + 1] += new_first[node]
    new_arcs, new_middles = np.empty_like(arcs), np.empty_like(middles)
    for node in range(n):
        at = new_first[order[node]]
        for arc in range(first[node], first[node + 1]):
            packed = arcs[arc, 1]
            new_arcs[at, 0] = arcs[arc, 0]
            head = np.int64(order[packed >> HEAD_SHIFT])
            new_arcs[at, 1] = pack(head, packed >> 6 & 63, packed & 63)
            past = middles[arc]
            if past >= 0:
                past = np.int64(order[past >> 32]) << 32 | past & 0xFFFFFFFF
            new_middles[at] = past
            at += 1
    return new_first, new_arcs, new_middles
