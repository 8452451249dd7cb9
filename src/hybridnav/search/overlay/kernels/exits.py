"""Kernels of exits: where shortest paths to the border of a field leave the fields inside it.

A shortest path from a node of a child, a field of the level below, to a node of the field around it
crosses the child to an exit, and leaves it there by a move. So distances from the exits alone are
stored: about a quarter of the nodes of a child are exits towards a node. The distance of any other
one is the least sum of one to an exit inside the child and of that from the exit.

Stored for a field with n nodes, k children, and m nodes of children, in one array of int32:

* for each child and node, k * n, where their exits begin, counted from the begin of the array;
* the places of l landmarks among the nodes, and the distances from each to all nodes of children;
* for each child and node, a bit for each node of the child, 32 in a number, and behind these the
  distances between exits and the node.
"""

import numpy as np

from hybridnav._base.jit import njit
from hybridnav.search.overlay.kernels.costs import clique_place
from hybridnav.search.overlay.kernels.lanes import FAR, LANES, NO_PATH, lowest_bit
from hybridnav.search.overlay.kernels.paths import append, inside_of

LANDMARKS = 8
"""Most nodes of a field from which the distances to all nodes of its children are stored."""
_WORD = 32
_ALL_BITS = (1 << 32) - 1


@njit(cache=True, nogil=True)
def pack_table(levels, field, distance, is_exit):
    """Return the stored numbers of a field; see above.

    Parameters
    ----------
    levels
        See `Levels`.
    field
        A field above the two finest levels.
    distance
        int32 (n, m), the distances inside it from its nodes to those of its children.
    is_exit
        uint16 (blocks of LANES nodes, m), a bit for each node: whether that of a child is an exit
        towards it.
    """
    n, width = distance.shape
    inner = levels.inner_at[field], levels.inner_at[field + 1]
    begin, n_children = levels.node_at[inner[0]], inner[1] - inner[0]
    marks = _landmarks(levels, field, distance)
    at = n_children * n + marks.size * (1 + width)
    size = at
    for i in range(n):
        for j in range(width):
            size += is_exit[i // LANES, j] >> i % LANES & 1
    for child in range(inner[0], inner[1]):
        count = levels.node_at[child + 1] - levels.node_at[child]
        size += n * ((count + _WORD - 1) // _WORD)
    packed = np.zeros(size, np.int32)
    bits = packed.view(np.uint32)
    for k in range(marks.size):
        packed[n_children * n + k] = marks[k]
        row = n_children * n + marks.size + k * width
        packed[row : row + width] = distance[marks[k]]
    for child in range(n_children):
        first = levels.node_at[inner[0] + child] - begin
        count = levels.node_at[inner[0] + child + 1] - begin - first
        for i in range(n):
            packed[child * n + i] = at
            value = at + (count + _WORD - 1) // _WORD
            for j in range(count):
                if is_exit[i // LANES, first + j] >> i % LANES & 1:
                    bits[at + j // _WORD] |= np.uint32(1 << j % _WORD)
                    packed[value] = distance[i, first + j]
                    value += 1
            at = value
    return packed


@njit(cache=True, nogil=True)
def _landmarks(levels, field, distance):
    """Return the places of nodes of a field that are far from each other."""
    first, begin = levels.node_at[field], levels.node_at[levels.inner_at[field]]
    n = len(distance)
    found = np.empty(min(LANDMARKS, n), np.int32)
    nearest, place = np.full(n, FAR, np.int32), 0
    for k in range(found.size):
        found[k] = place
        for i in range(n):
            nearest[i] = min(nearest[i], distance[place, levels.below[first + i] - begin])
        place = np.argmax(nearest)
    return found


@njit(cache=True, nogil=True)
def exit_landmarks(levels, field):
    """Return the places of the landmarks of a field among its nodes, and where their distances
    begin in `Levels.table`, those to each node of its children; nothing where none are stored."""
    at, n = levels.table_at[field], levels.node_at[field + 1] - levels.node_at[field]
    if levels.table_at[field + 1] == at:
        return levels.table[at:at], at
    count = min(LANDMARKS, n)
    at += (levels.inner_at[field + 1] - levels.inner_at[field]) * n
    return levels.table[at : at + count], at + count


@njit(cache=True, nogil=True)
def _exits_at(levels, child, i):
    """Return where the bits of the exits of a child towards the i-th node of the field around it
    are, and the distances from them."""
    field = levels.parent[child]
    at, n = levels.table_at[field], levels.node_at[field + 1] - levels.node_at[field]
    bits = at + levels.table[at + (child - levels.inner_at[field]) * n + i]
    count = levels.node_at[child + 1] - levels.node_at[child]
    return bits, bits + (count + _WORD - 1) // _WORD


@njit(cache=True, nogil=True)
def reach_over_exits(levels, child, below, reach):
    """Compute distances to the nodes of a field from those to the nodes of one of its children.

    Parameters
    ----------
    levels
        See `Levels`.
    child
        A field whose nodes have exits.
    below
        int64 (n,), the distances from somewhere to its nodes.
    reach
        int64 (m,), changed: those to the nodes of the field around it; NO_PATH where there are no
        exits.
    """
    field = levels.parent[child]
    count = levels.node_at[field + 1] - levels.node_at[field]
    reach[:count] = NO_PATH
    if levels.table_at[field] == levels.table_at[field + 1]:
        return
    table = levels.table[levels.table_at[field] : levels.table_at[field + 1]]
    words = (levels.node_at[child + 1] - levels.node_at[child] + _WORD - 1) // _WORD
    for i in range(count):
        at = np.int64(table[(child - levels.inner_at[field]) * count + i])
        value, least = at + words, np.int64(NO_PATH)
        for word in range(words):
            bits = np.int64(table[at + word]) & _ALL_BITS
            while bits:
                total = below[_WORD * word + lowest_bit(np.uint32(bits))] + table[value]
                least = min(least, total)
                bits &= bits - 1
                value += 1
        reach[i] = least


@njit(cache=True, nogil=True)
def beyond_exits(levels, child, rests):
    """Return the least sums, at the exits of a child, of a distance to a node and what is beyond.

    Parameters
    ----------
    levels
        See `Levels`.
    child
        A field whose nodes have exits.
    rests
        int64 (m,), bounds on the distances from the nodes of the field around it.

    Returns
    -------
    ndarray
        int64 (n,), NO_PATH at nodes that are no exits.
    """
    beyond = np.full(levels.node_at[child + 1] - levels.node_at[child], NO_PATH, np.int64)
    for i in range(rests.size):
        at, value = _exits_at(levels, child, i)
        for word in range(value - at):
            bits = np.int64(levels.table[at + word]) & _ALL_BITS
            while bits:
                j = _WORD * word + lowest_bit(np.uint32(bits))
                beyond[j] = min(beyond[j], rests[i] + levels.table[value])
                bits &= bits - 1
                value += 1
    return beyond


@njit(cache=True, nogil=True)
def _exit_of(levels, child, below, target):
    """Return the exit of a child over which distances to its nodes lead to a node for the least.

    Parameters
    ----------
    levels
        See `Levels`.
    child
        A field whose nodes have exits.
    below
        int64 (n,), the distances from somewhere to its nodes.
    target
        A node of the field around it, which is reached.
    """
    at, value = _exits_at(levels, child, target - levels.node_at[levels.parent[child]])
    least, found = np.int64(NO_PATH), levels.node_at[child]
    for word in range(value - at):
        bits = np.int64(levels.table[at + word]) & _ALL_BITS
        while bits:
            j = _WORD * word + lowest_bit(np.uint32(bits))
            if below[j] + levels.table[value] < least:
                least, found = below[j] + levels.table[value], levels.node_at[child] + j
            bits &= bits - 1
            value += 1
    return np.int64(found)


@njit(cache=True, nogil=True)
def _to_exit(levels, node, target):
    """Return the distance from a node of a child to a node of the field around it, the exit on the
    way there, and the distance from the exit."""
    child = levels.field_of[node]
    first, clique = levels.node_at[child], levels.clique_at[child]
    at, value = _exits_at(levels, child, target - levels.node_at[levels.parent[child]])
    least, found, rest = np.int64(NO_PATH), np.int64(-1), np.int64(NO_PATH)
    for word in range(value - at):
        bits = np.int64(levels.table[at + word]) & _ALL_BITS
        while bits:
            j = _WORD * word + lowest_bit(np.uint32(bits))
            stored = np.int64(levels.table[value])
            inside = levels.clique[clique + clique_place(node - first, j)]
            if inside < FAR and inside + stored < least:
                least, found, rest = inside + stored, first + j, stored
            bits &= bits - 1
            value += 1
    return least, found, rest


@njit(cache=True, nogil=True)
def walk_over_exits(levels, node, target, nodes, n):
    """Append the nodes of a shortest path from a node of a child to one of the field around it.

    Parameters
    ----------
    levels
        See `Levels`.
    node
        A node inside the field, on the level below; it is not appended.
    target
        A node of the field; the one below it is appended last.
    nodes, n
        int64 (room,) and how many of them are filled.

    Returns
    -------
    tuple
        `nodes`, in a new array if there was no room, and their number, -1 if no path is as long as
        the costs state.
    """
    span, last = inside_of(levels, levels.field_of[target]), np.int64(levels.below[target])
    _, leaving, rest = _to_exit(levels, node, target)
    while node != last and leaving >= 0:
        if leaving != node:
            nodes = append(nodes, n, leaving)
            n += 1
            node = leaving
            continue
        leaving = np.int64(-1)
        for at in range(levels.move_at[node], levels.move_at[node + 1]):
            other = np.int64(levels.move_to[at])
            if not span[0] <= other < span[1] or levels.move_cost[at] > rest:
                continue
            least, beyond, rest_beyond = _to_exit(levels, other, target)
            if least + levels.move_cost[at] == rest:
                node, leaving, rest = other, beyond, rest_beyond
                nodes = append(nodes, n, node)
                n += 1
                break
    return nodes, (n if node == last else -1)


@njit(cache=True, nogil=True)
def descend(levels, level, upper, children, reaches):
    """Return the nodes of a path with those of one level replaced by nodes of the level below.

    Parameters
    ----------
    levels
        See `Levels`.
    level
        The level, > 1.
    upper
        int64 (n,), n >= 1, nodes of this level and of levels below.
    children
        The fields of start and goal on the level below.
    reaches
        Two int64 (n,), the distances inside them, from the start and to the goal.

    Returns
    -------
    ndarray
        int64 (m,), empty if no path is as long as the costs state.
    """
    begin = levels.node_at[levels.level_at[level]]
    first, last = upper[0], upper[-1]
    nodes, n = np.empty(2 * upper.size + 64, np.int64), 1
    nodes[0] = first
    if first >= begin:
        nodes[0] = _exit_of(levels, children[0], reaches[0], first)
        nodes, n = walk_over_exits(levels, nodes[0], first, nodes, 1)
    for i in range(1, upper.size):
        if n < 0:
            break
        before, node = upper[i - 1], upper[i]
        field = levels.field_of[node]
        if node >= begin and levels.field_of[before] == field:
            nodes, n = walk_over_exits(levels, np.int64(levels.below[before]), node, nodes, n)
        else:
            nodes = append(nodes, n, levels.below[node] if node >= begin else node)
            n += 1
    if last >= begin and n >= 0:
        tail = np.empty(64, np.int64)
        tail[0] = _exit_of(levels, children[1], reaches[1], last)
        tail, m = walk_over_exits(levels, tail[0], last, tail, 1)
        for i in range(m - 2, -1, -1):
            nodes = append(nodes, n, tail[i])
            n += 1
        n = n if m >= 0 else -1
    return nodes[: max(n, 0)]
