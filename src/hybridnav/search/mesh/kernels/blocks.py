"""Kernels of blocks: parts of a mesh that no single polygon disconnects.

A shortest path passes no convex polygon twice, so it stays in the blocks between its endpoints: a
part of the map behind a single polygon is entered only towards an end.
"""

import numpy as np

from hybridnav._base.jit import guarded, njit


@guarded
@njit(cache=True, nogil=True)
def blocks_of(first, twins, polygon_of):
    """Return the blocks (biconnected components) of the graph of polygons, and their tree.

    J. Hopcroft, R. Tarjan: Algorithm 447, efficient algorithms for graph manipulation, 1973.
    """
    n = len(first) - 1
    block_of = np.full(len(twins), -1, np.int32)
    head_of = np.empty(n, np.int32)
    up = np.full(n, -1, np.int32)
    component = np.full(n, -1, np.int32)
    depth = np.zeros(n, np.int32)

    # `number` is the order of visits; `low` the earliest number that a side leads back to from a
    # polygon or from the tree below it.
    number = np.full(n, -1, np.int32)
    low = np.zeros(n, np.int32)
    at = first[:-1].copy()
    came_by = np.full(n, -1, np.int32)
    path = np.empty(n, np.int32)
    waiting = np.empty(len(twins) // 2 + 1, np.int32)  # slots of seen sides, one of each pair
    n_waiting = n_blocks = n_components = clock = 0

    # Depth first, with the path in an array: recursion would be as deep as the mesh is long.
    for root in range(n):
        if number[root] >= 0:
            continue
        path[0] = root
        size = 1
        number[root] = low[root] = clock
        clock += 1
        component[root] = n_components
        while size:
            here = path[size - 1]
            if at[here] < first[here + 1]:
                slot = at[here]
                at[here] += 1
                twin = twins[slot]

                # Only the side of arrival is passed over: another side between both polygons makes
                # a cycle.
                if twin < 0 or twin == came_by[here]:
                    continue
                other = polygon_of[twin]

                # A side waits for its block once: when it leads to a new polygon, or back to an
                # earlier one. Seen from that one, it is known.
                if number[other] < 0:
                    waiting[n_waiting] = slot
                    n_waiting += 1
                    came_by[other] = slot
                    number[other] = low[other] = clock
                    clock += 1
                    component[other] = n_components
                    path[size] = other
                    size += 1
                elif number[other] < number[here]:
                    waiting[n_waiting] = slot
                    n_waiting += 1
                    low[here] = min(low[here], number[other])
                continue

            # All sides are seen: what this polygon leads back to, its parent does.
            size -= 1
            if size == 0:
                break
            parent = path[size - 1]
            low[parent] = min(low[parent], low[here])

            # No side from below leads back past the parent: the sides that wait since the step from
            # the parent are a block, which hangs from it.
            if low[here] >= number[parent]:
                while True:
                    n_waiting -= 1
                    slot = waiting[n_waiting]
                    block_of[slot] = block_of[twins[slot]] = n_blocks
                    for polygon in (polygon_of[slot], polygon_of[twins[slot]]):
                        if polygon != parent:
                            up[polygon] = n_blocks
                    if slot == came_by[here]:
                        break
                head_of[n_blocks] = parent
                n_blocks += 1
        n_components += 1
    # Parents come earlier in the order of visits.
    order = np.empty(n, np.int32)
    for polygon in range(n):
        order[number[polygon]] = polygon
    for polygon in order:
        if up[polygon] >= 0:
            depth[polygon] = depth[head_of[up[polygon]]] + 1
    return (block_of, head_of[:n_blocks].copy(), up), (component, depth)


@njit(cache=True, nogil=True)
def open_blocks(blocks, start, goal, is_open, marked, n):
    """Open the blocks between two polygons of one component; return the index behind the last one.

    `blocks`: `MeshBlocks`; `is_open`: bool (b,), changed; `marked`, `n`: int32, receives opened
    blocks from index n on.
    """
    head, up, depth = blocks.head, blocks.up, blocks.depth
    while start != goal:
        if depth[start] < depth[goal]:
            start, goal = goal, start
        block = up[start]
        if not is_open[block]:
            is_open[block] = True
            marked[n] = block
            n += 1
        if depth[goal] == depth[start] and up[goal] == block:
            break
        start = head[block]
    return n


# Kernels that merge triangles into convex polygons, and find the polygon of each cell.
#
# Points are (row, col) in grid units; with columns to the right and rows upwards, polygons run
# counter-clockwise. A *slot* is a side of a polygon, which lies to the left of it.

WALL = -1
"""The twin of a side that cannot be crossed."""


@guarded
@njit(cache=True, nogil=True)
def are_free(corners, vertices, free):
    """Return whether triangles between walls, (m, 3) corners, lie in free space, bool (m,)."""
    rows, cols = free.shape
    found = np.zeros(len(vertices), np.bool_)
    for triangle in range(len(vertices)):
        row = col = np.int64(0)
        for k in range(3):
            row += corners[vertices[triangle, k], 0]
            col += corners[vertices[triangle, k], 1]
        # No wall passes the middle of a triangle: all cells at that point are of one class.
        row, col = row // 3, col // 3
        found[triangle] = row < rows and col < cols and free[row, col]
    return found


@guarded
@njit(cache=True, nogil=True)
def sides_of_triangles(corners, triangles, neighbours):
    """Link the sides of triangles, side 3 t + k from corner k of triangle t to the next one.

    `corners`: int32 (n, 2); `triangles`: int32 (n, 3), corners counter-clockwise; `neighbours`:
    int32 (n, 3), the triangle across the side from corner k to k + 1, -1 for a wall. Returns int32
    (3 n,) twin of each side, the side after it and the one before it; int64 (3 n,) the squared
    length of a common side at one of its two twins, else 0.
    """
    n = len(triangles)
    twin = np.empty(3 * n, np.int32)
    following = np.empty(3 * n, np.int32)
    before = np.empty(3 * n, np.int32)
    squared = np.zeros(3 * n, np.int64)
    for t in range(n):
        for k in range(3):
            side = 3 * t + k
            following[side] = 3 * t + (k + 1) % 3
            before[side] = 3 * t + (k + 2) % 3
            twin[side] = WALL
            other = neighbours[t, k]
            if other < 0:
                continue
            a, b = triangles[t, k], triangles[t, (k + 1) % 3]
            for m in range(3):
                if triangles[other, m] == b and triangles[other, (m + 1) % 3] == a:
                    twin[side] = 3 * other + m
            if twin[side] > side:
                rows, cols = corners[a, 0] - corners[b, 0], corners[a, 1] - corners[b, 1]
                squared[side] = rows * rows + cols * cols
    return twin, following, before, squared


@guarded
@njit(cache=True, nogil=True)
def merge_across(corners, tail, sides, order):
    """Merge triangles across some sides, in their order, if the union is convex.

    `corners`: int32 (n, 2); `tail`: int32 (s,), the corner at which each side begins; `sides`:
    arrays of `sides_of_triangles`; the sides after and before each side are changed; `order`:
    int64, the sides. Result: see `merge_triangles`.
    """
    twin, following, before = sides
    is_gone = np.zeros(len(tail), np.bool_)
    for side in order:
        other = twin[side]
        # The corners whose angles add up: before the side and behind its twin, and the reverse.
        if _is_left(corners, tail, before[side], following[other]) and _is_left(
            corners, tail, before[other], following[side]
        ):
            is_gone[side] = is_gone[other] = True
            first, last = before[side], following[other]
            following[first], before[last] = last, first
            first, last = before[other], following[side]
            following[first], before[last] = last, first
    return _compact(tail, following, twin, is_gone)


@njit(cache=True, nogil=True)
def _is_left(corners, tail, incoming, outgoing):
    """Return whether the path along two consecutive sides turns left or goes straight on, not
    back."""
    a, b, c = tail[incoming], tail[outgoing], _head(tail, outgoing)
    rows = np.int64(corners[b, 0]) - corners[a, 0]
    cols = np.int64(corners[b, 1]) - corners[a, 1]
    down, across = np.int64(corners[c, 0]) - corners[b, 0], np.int64(corners[c, 1]) - corners[b, 1]
    turn, ahead = cols * down - rows * across, rows * down + cols * across
    return incoming >= 0 and (turn > 0 or (turn == 0 and ahead > 0))


@njit(cache=True, nogil=True)
def _head(tail, side):
    """Return the corner at which a side of a triangle ends: sides are not moved when triangles
    merge."""
    return tail[side - 2] if side % 3 == 2 else tail[side + 1]


@njit(cache=True, nogil=True)
def _compact(tail, following, twin, is_gone):
    """Return the slots of the polygons that are left, one polygon after the other."""
    n = len(tail)
    slot_of = np.full(n, -1, np.int32)
    first = np.empty(n // 3 + 2, np.int32)
    n_slots = n_polygons = 0
    for side in range(n):
        if is_gone[side] or slot_of[side] >= 0:
            continue
        first[n_polygons] = n_slots
        n_polygons += 1
        here = side
        while slot_of[here] < 0:
            slot_of[here] = n_slots
            n_slots += 1
            here = following[here]
    first[n_polygons] = n_slots
    begins = np.empty(n_slots, np.int32)
    twins = np.full(n_slots, WALL, np.int32)
    polygon_of = np.empty(n_slots, np.int32)
    for side in range(n):
        slot = slot_of[side]
        if slot >= 0:
            begins[slot] = tail[side]
            if twin[side] >= 0:
                twins[slot] = slot_of[twin[side]]
    for polygon in range(n_polygons):
        for slot in range(first[polygon], first[polygon + 1]):
            polygon_of[slot] = polygon
    return first[: n_polygons + 1].copy(), begins, twins, polygon_of


@njit(cache=True, nogil=True)
def polygons_of_cells(first, begins, corners, shape):
    """Return the polygon that holds the centre of each cell, int32 (rows, cols), -1 for none.

    If a side passes the centre, either of its polygons is taken.
    """
    found = np.full(shape, -1, np.int32)
    for polygon in range(len(first) - 1):
        low, high = first[polygon], first[polygon + 1]
        bottom = top = corners[begins[low], 0]
        for slot in range(low, high):
            row = corners[begins[slot], 0]
            bottom, top = min(bottom, row), max(top, row)
        for row in range(bottom, top):
            left, right = -np.inf, np.inf
            y = row + 0.5
            for slot in range(low, high):
                after = low if slot + 1 == high else slot + 1
                a, b = corners[begins[slot]], corners[begins[after]]
                if (a[0] <= row) == (b[0] <= row):
                    continue
                x = a[1] + (y - a[0]) * (b[1] - a[1]) / (b[0] - a[0])
                if b[0] > a[0]:  # upwards: free space lies to the left of it
                    right = min(right, x)
                else:
                    left = max(left, x)
            for col in range(max(int(np.ceil(left - 0.5 - 1e-9)), 0), shape[1]):
                if col + 0.5 > right + 1e-9:
                    break
                found[row, col] = polygon
    return found
