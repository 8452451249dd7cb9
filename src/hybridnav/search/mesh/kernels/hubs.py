"""Kernels of hub labels: shortest any-angle paths without a search.

The label of a corner holds hubs, corners that many shortest paths pass, with the distances to them:
any two corners that a path joins have a hub of a shortest one in both labels. A label is parted by
the corner to which the path to the hub goes next, in the order of directions, those nearest to the
wall first. A path that arrives at a corner may go on only to the first few of them without being
slack, so a query reads one label in twenty.

T. Akiba, Y. Iwata, Y. Yoshida: Fast exact shortest-path distance queries on large networks by
pruned landmark labeling, 2013. J. Du, B. Shen, S. Zhao, M. A. Cheema, A. N. Toosi: Ultrafast
Euclidean shortest path computation using hub labeling, 2023.
"""

import math

import numpy as np
from numba.extending import overload

from hybridnav._base.jit import guarded, njit
from hybridnav._base.kernels.arrays import fetch, grow, push
from hybridnav._base.kernels.exact import is_legal, turn_of
from hybridnav._base.trig import hypot
from hybridnav.search.kernels.labels import reach_next
from hybridnav.search.mesh.kernels.polyanya import DONE, EXPANDED, WORK_FULL, put_corner
from hybridnav.search.mesh.kernels.squares import line_before, quarter_of
from hybridnav.search.mesh.kernels.views import distance, lobe_of


@njit(cache=True, nogil=True)
def _reach_on_mesh(mesh, edges, here, work, size, n_touched):
    """Reach the corners to which a shortest path may go on; see `reach_next`."""
    cx, cy, kinds = mesh[0], mesh[1], mesh[2]
    first, heads = edges
    costs, before, touched, heap = work
    x, y, cost, last, hand = cx[here], cy[here], costs[here], before[here], 0.0
    low, high, px, py = first[2 * here], first[2 * here + 2], x, y
    if last >= 0:
        px, py, kind = cx[last], cy[last], kinds[here]
        at = 2 * here + lobe_of(kind, x - px, y - py)
        low, high = first[at], first[at + 1]
        # The blocked cell lies on the left of the path here, or on the right.
        hand = (x - px) * (1.0 if kind & 2 else -1.0) - (y - py) * (1.0 if kind & 1 else -1.0)
    for other in heads[low:high]:
        reached = cost + distance(x, y, cx[other], cy[other])
        known = costs[other]
        if reached < known and turn_of(px, py, x, y, cx[other], cy[other]) * hand >= 0.0:
            if known == np.inf:
                touched[n_touched] = other
                n_touched += 1
            costs[other], before[other] = reached, here
            push(heap, size, reached, float(other))
            size += 1
    return size, n_touched


@overload(reach_next)
def _reach_of_mesh(graph, edges, here, work, size, n_touched):  # noqa: ARG001 - numba's rule
    """Return what stands for `reach_next` on a mesh."""

    def reach(graph, edges, here, work, size, n_touched):
        return _reach_on_mesh(graph, edges, here, work, size, n_touched)

    return reach if len(graph) == 8 else None


# A query. An entry holds the rank of its hub above the distance to it, in units.

FAR = 1 << 62
"""No distance from the start."""
ABOVE = 12
"""Bits of the number of a corner of a square, below a distance from the start. Distances have at
most 47 bits, two of them 48: `FAR` is above all sums."""


@njit(cache=True, nogil=True)
def _sees(polygon_at, cell, x, y, to_x, to_y):
    """Return whether a point in the closed square of a cell sees another point."""
    row, col = cell
    if x == math.floor(x) and y == math.floor(y):
        # Where two free cells meet only at a corner, a point there belongs to one of them.
        up, right = 1 if y > row else -1, 1 if x > col else -1
        rows, cols = polygon_at.shape
        if 0 <= row + up < rows and 0 <= col + right < cols:
            is_shut = polygon_at[row + up, col] < 0 and polygon_at[row, col + right] < 0
            if is_shut and ((to_x - x) * right > 0.0 or (to_y - y) * up > 0.0):
                return False
    return (x == to_x and y == to_y) or is_legal(polygon_at, y, x, to_y, to_x, 0, 0)


@njit(cache=True, nogil=True)
def _see_each_other(polygon_at, cells, endpoints):
    """Return whether the ends of a query see each other."""
    from_row, from_col, to_row, to_col = cells
    sx, sy, tx, ty = endpoints
    if sx == tx and sy == ty and from_row != to_row and from_col != to_col:
        return polygon_at[from_row, to_col] >= 0 or polygon_at[to_row, from_col] >= 0
    return _sees(polygon_at, (from_row, from_col), sx, sy, tx, ty) and _sees(
        polygon_at, (to_row, to_col), tx, ty, sx, sy
    )


@njit(cache=True, nogil=True)
def view_of_square(mesh, labels, x, y, sights, views_at, costs):
    """List the corners that see something of a point's quarter of a square.

    Parameters
    ----------
    mesh
        See `successors`.
    labels
        The arrays of `HubLabels`.
    x, y
        The point.
    sights, views_at, costs
        Written by corner: 1 if it sees all of the quarter, else 0; its view; its distance in units.

    Returns
    -------
    int
        How many there are, or -1 without room.
    """
    cx, cy = mesh[0], mesh[1]
    entries, layout, begin, views = labels[:4]
    row, col = line_before(y, layout[0] / 2), line_before(x, layout[0] / 2)
    square = (row + 1 >> 1) * int(layout[1]) + (col + 1 >> 1)
    bit, units = quarter_of(row, col), 1.0 / layout[3]
    low, high, n = begin[square], begin[square + 1], 0
    if high - low > len(costs):
        return -1
    for at in range(low, high):
        seen = views[at, 0]
        if seen & bit:
            for k in range(views[at, 1], views[at, 2], 8):
                fetch(entries, k)
            corner, sights[n], views_at[n] = seen >> 8, (seen & bit << 4) > 0, at
            dx, dy = cx[corner] - x, cy[corner] - y
            costs[n] = np.int64(math.sqrt(dx * dx + dy * dy) * units + 0.5)
            n += 1
    return n


@njit(cache=True, nogil=True)
def is_hidden(mesh, polygon_at, cell, point, corner, sights, k):
    """Return whether a point does not see a corner, which is found out once.

    Parameters
    ----------
    mesh
        See `successors`.
    polygon_at
        int32 (rows, cols), -1 for cells that are not free.
    cell, point
        The cell of the point, and its x and y.
    corner
        The corner.
    sights, k
        Where the answer is kept: 1 for seen, -1 for hidden, 0 before that.
    """
    if sights[k] == 0:
        is_seen = _sees(polygon_at, cell, point[0], point[1], mesh[0][corner], mesh[1][corner])
        sights[k] = 1 if is_seen else -1
    return sights[k] < 0


@guarded
@njit(cache=True, nogil=True)
def query_hubs(mesh, labels, where, endpoints, work, effort):
    """Find a shortest path between two points by the labels of corners.

    `mesh`, `endpoints`: see `successors`; `labels`: the arrays of `HubLabels`; `where`: see
    `look_round`; `work`: room for the corners of both ends: int8 (2, n) whether the end
    sees each (1), or not (-1), or it is not known (0); int32 (2, n) their views; int64 (2, n)
    distances to them; int64 (n,) least distances by the corners of the goal. By hub, int64 the
    least distance from the start, above the number of its corner (`FAR`); int32 hubs touched.
    Counts and bounds. `effort`: see `query`; with a limit of 0 the length is found without the
    path. Result: see `query`.
    """
    component, polygon_at, cells = where
    sights, at, costs, totals, least, touched, counts, bounds = work
    sx, sy, tx, ty = endpoints
    entries, layout, _, views = labels[:4]
    shift = int(layout[2])
    mask = (np.int64(1) << shift) - 1
    none = np.empty(0, np.int32)
    counts[:] = 0
    # The straight line, if nothing is in between.
    bounds[:] = hypot(tx - sx, ty - sy)
    if _see_each_other(polygon_at, cells, endpoints):
        return DONE, _path_through(mesh, endpoints, none, none)
    bounds[:] = np.inf
    inner = polygon_at[cells[0], cells[1]], polygon_at[cells[2], cells[3]]
    if component[inner[0]] != component[inner[1]]:
        return DONE, np.empty((0, 2))
    # The corners in sight of the squares of both ends.
    n_start = view_of_square(mesh, labels, sx, sy, sights[0], at[0], costs[0])
    n_goal = view_of_square(mesh, labels, tx, ty, sights[1], at[1], costs[1])
    if n_start < 0 or n_goal < 0:
        return WORK_FULL, np.empty((0, 2))

    # All corners of the start, seen or not: the least distances to hubs, then to corners of the
    # goal. They are lower bounds.
    n_touched = 0
    for k in range(n_start):
        cost = costs[0, k]
        for j in range(views[at[0, k], 1], views[at[0, k], 2]):
            packed = entries[j]
            hub, reached = packed >> shift, cost + (packed & mask) << ABOVE | k
            known = least[hub]
            if reached < known:
                least[hub] = reached
                if known == FAR:
                    touched[n_touched] = hub
                    n_touched += 1
    for m in range(n_goal):
        least_to = FAR
        for j in range(views[at[1, m], 1], views[at[1, m], 2]):
            packed = entries[j]
            least_to = min(least_to, (packed & mask) + (least[packed >> shift] >> ABOVE))
        totals[m] = costs[1, m] + least_to

    # The corner of the goal with the least bound is looked at until none is better than the path.
    # If the corner of the start is hidden, the hub has its next best corner.
    best, best_hub, one, two = FAR >> ABOVE, -1, -1, -1
    while n_goal:
        m = totals[:n_goal].argmin()
        if totals[m] >= best:
            break
        totals[m] = FAR
        view = at[1, m]
        if is_hidden(mesh, polygon_at, cells[2:], (tx, ty), views[view, 0] >> 8, sights[1], m):
            continue
        for j in range(views[view, 1], views[view, 2]):
            packed = entries[j]
            hub, reached = packed >> shift, costs[1, m] + (packed & mask)
            while reached + (least[hub] >> ABOVE) < best:
                k = least[hub] & ((1 << ABOVE) - 1)
                corner = views[at[0, k], 0] >> 8
                if is_hidden(mesh, polygon_at, cells[:2], (sx, sy), corner, sights[0], k):
                    least[hub] = _next_best(labels, at[0, :n_start], hub, sights[0], costs[0])
                else:
                    best, best_hub = reached + (least[hub] >> ABOVE), hub
                    one, two = corner, views[view, 0] >> 8
    # Only what was touched is reset. Then the path from hub to hub, and its length in order.
    for hub in touched[:n_touched]:
        least[hub] = FAR
    if one >= 0:
        bounds[:] = best * layout[3]
    if one < 0 or effort[2] == 0:
        return DONE, np.empty((0, 2))
    # The corners from either end to the hub.
    there = _corners_to(labels, one, best_hub, shift)
    back = _corners_to(labels, two, best_hub, shift)
    path = _path_through(mesh, endpoints, there, back)
    length = 0.0
    for k in range(len(path) - 1):
        length += distance(path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1])
    bounds[:] = length
    counts[EXPANDED] = len(there) + len(back)
    return DONE, path


@njit(cache=True, nogil=True)
def _next_best(labels, at, hub, sights, costs):
    """Return the least distance to a hub by a corner that is not known as hidden, above the
    corner's number."""
    entries, layout, _, views = labels[:4]
    shift = int(layout[2])
    mask = (np.int64(1) << shift) - 1
    best = FAR
    for k in range(len(at)):
        if sights[k] >= 0:
            for j in range(views[at[k], 1], views[at[k], 2]):
                packed = entries[j]
                if packed >> shift == hub:
                    best = min(best, costs[k] + (packed & mask) << ABOVE | k)
    return best


@njit(cache=True, nogil=True)
def _corners_to(labels, corner, hub, shift):
    """Return the corners on the path from a corner to a hub in its label, with both, int32."""
    entries, first, offset, heads = labels[0], labels[4], labels[5], labels[6]
    found, n = np.empty(16, np.int32), 0
    # Each corner on the path has the hub in its label too; the count ends a walk in altered labels.
    for _ in range(len(first)):
        if n == len(found):
            found = grow(found)
        found[n] = corner
        n += 1
        part, last = first[2 * corner], first[2 * corner + 2]
        at, end = offset[part], offset[last]
        while at < end and entries[at] >> shift != hub:
            at += 1
        while part < last and offset[part + 1] <= at:
            part += 1
        if part == last or heads[part] == corner:
            break
        corner = heads[part]
    return found[:n]


@njit(cache=True, nogil=True)
def _path_through(mesh, endpoints, there, back):
    """Return the path through some corners and, backwards, some others; see `path_to`."""
    cx, cy = mesh[0], mesh[1]
    sx, sy, tx, ty = endpoints
    n = len(there) + len(back) + 1
    path = np.empty((n + 1, 2))
    path[n, 0], path[n, 1] = ty, tx
    for corner in back:
        n = put_corner(path, n, cx[corner], cy[corner])
    # Both end with the hub.
    for corner in there[-2::-1]:
        n = put_corner(path, n, cx[corner], cy[corner])
    n = put_corner(path, n, sx, sy)
    return path[n:].copy()
