"""Kernels of intervals: the part of a side seen from a root, and the intervals behind it.

Points are x = column, y = row in grid units: corners are whole numbers, the two endpoints of a
query are rounded to 2^-24 of a cell, so that every side test is exact (see `turn_of`). An interval
on a side is never computed: it is the part of the side between two rays from its root. A ray is the
root and a corner that limits the view, or the mirror image of a root in a corner.
"""

import math

from hybridnav._base.jit import njit
from hybridnav._base.kernels.exact import turn_of
from hybridnav._base.trig import hypot
from hybridnav.search.mesh.kernels.state import Mesh

DIRECTED, LEFTWARD, RIGHTWARD = 8, 1, 2
"""Bits of the kind of a corner of directed sides: a path may bend to the left, to the right."""
# Columns of a node's whole numbers.
SLOT, ROOT, PARENT, ENDS = 0, 1, 2, 3
# Bits of ENDS: the interval ends at the left, at the right corner of its side. Below zero the root
# is an end of its side, and the path also bends at corner -1 - ENDS on its way to the root.
_LEFT, _RIGHT = 1, 2
WHOLE_SIDE = _LEFT | _RIGHT
# Columns of a node's reals: cost of the root, points on the rays.
G, _LX, _LY, _RX, _RY = 0, 1, 2, 3, 4


@njit(cache=True, nogil=True)
def turns(kind, dx, dy, hand):
    """Return whether a path may bend round a corner to a hand, 1 for the left.

    The path arrives in the direction (dx, dy); the one blocked cell of the corner must lie on that
    hand. Corners of directed sides allow hands.
    """
    if kind >= 4:
        return kind & (DIRECTED | (LEFTWARD if hand > 0 else RIGHTWARD)) > DIRECTED
    ex = 1.0 if kind & 1 else -1.0
    ey = 1.0 if kind & 2 else -1.0
    return dx * ey * hand >= 0.0 and -dy * ex * hand >= 0.0


@njit(cache=True, nogil=True)
def _cut(px, py, qx, qy, ax, ay, bx, by):
    """Return where the line from p through q meets the line from a to b, rounded: for estimates
    only.

    Parameters
    ----------
    px, py, qx, qy
        Two points of the first line, in cells.
    ax, ay, bx, by
        Ends of the second.
    """
    ux, uy = qx - px, qy - py
    vx, vy = bx - ax, by - ay
    cross = ux * vy - uy * vx
    if cross == 0.0:
        return ax, ay
    share = ((px - ax) * uy - (py - ay) * ux) / -cross
    share = min(max(share, 0.0), 1.0)
    return ax + share * vx, ay + share * vy


@njit(cache=True, nogil=True)
def estimate(x, y, lx, ly, rx, ry, tx, ty):
    """Return the length of the shortest path from a root through an interval to the goal.

    Parameters
    ----------
    x, y
        The root, in cells.
    lx, ly, rx, ry
        Left and right end of the interval.
    tx, ty
        The goal.
    """
    # The goal on the near side is seen in the mirror of the side.
    vx, vy = lx - rx, ly - ry
    near = vx * (y - ry) - vy * (x - rx)
    far = vx * (ty - ry) - vy * (tx - rx)
    if near * far > 0.0:
        share = 2.0 * far / (vx * vx + vy * vy)
        tx, ty = tx + share * vy, ty - share * vx
    if (lx - x) * (ty - y) - (ly - y) * (tx - x) > 0.0:
        return hypot(lx - x, ly - y) + hypot(tx - lx, ty - ly)
    if (rx - x) * (ty - y) - (ry - y) * (tx - x) < 0.0:
        return hypot(rx - x, ry - y) + hypot(tx - rx, ty - ry)
    return hypot(tx - x, ty - y)


@njit(cache=True, nogil=True)
def estimate_of(mesh, endpoints, whole, real, node):
    """Return the estimate of the rest of a path from a node's root."""
    cx, cy = mesh.x, mesh.y
    sx, sy, tx, ty = endpoints
    slot, root, marks = whole[node, SLOT], whole[node, ROOT], whole[node, ENDS]
    x, y = (sx, sy) if root < 0 else (cx[root], cy[root])
    a, b = mesh.begins[slot], mesh.finishes[slot]
    if root in (a, b):
        return hypot(tx - x, ty - y)
    lx, ly, rx, ry = real[node, _LX], real[node, _LY], real[node, _RX], real[node, _RY]
    if not marks & _LEFT:
        lx, ly = _cut(x, y, lx, ly, cx[a], cy[a], cx[b], cy[b])
    if not marks & _RIGHT:
        rx, ry = _cut(x, y, rx, ry, cx[a], cy[a], cx[b], cy[b])
    return estimate(x, y, lx, ly, rx, ry, tx, ty)


@njit(cache=True, nogil=True)
def put(nodes, n, slot, root, parent, marks, g, lx, ly, rx, ry):
    """Write node n and return the number of nodes.

    Parameters
    ----------
    nodes
        int32 (m, 4) and float64 (m, 5); the other arguments are their columns.
    n
        Number of nodes before.
    slot, root, parent, marks
        Slot of the node's side, corner number of its root, node before, and `ENDS`.
    g
        Cost of the root, in cells.
    lx, ly, rx, ry
        Points on the left and right ray, in cells.
    """
    whole, real = nodes
    whole[n, SLOT], whole[n, ROOT], whole[n, PARENT], whole[n, ENDS] = slot, root, parent, marks
    real[n, G] = g
    real[n, _LX], real[n, _LY], real[n, _RX], real[n, _RY] = lx, ly, rx, ry
    return n + 1


@njit(cache=True, nogil=True)
def _put_goal(nodes, n, root, parent, length):
    """Write a node for the goal, reached from a root."""
    return put(nodes, n, -1, root, parent, 0, length, 0.0, 0.0, 0.0, 0.0)


@njit(cache=True, nogil=True)
def root_behind(mesh, slot, root):
    """Return the root of a node as the polygon behind its side has it: a corner of directed sides
    occurs once for each part of its surroundings."""
    if root >= 0 and mesh.kinds[root] >= DIRECTED:
        for end in (mesh.begins[slot], mesh.finishes[slot]):
            if mesh.x[end] == mesh.x[root] and mesh.y[end] == mesh.y[root]:
                return end
    return root


@njit(cache=True, nogil=True)
def place_round(mesh, slot, root):
    """Return a number of the polygon behind a side and its corner, if that is the root and one of
    directed sides, else -1: round such a corner one may walk for ever."""
    if mesh.kinds[root] >= DIRECTED:
        if mesh.begins[slot] == root:
            return len(mesh.x) + slot
        if mesh.finishes[slot] == root:
            polygon = mesh.polygon_of[slot]
            is_last = slot + 1 == mesh.first[polygon + 1]
            return len(mesh.x) + (mesh.first[polygon] if is_last else slot + 1)
    return -1


@njit(cache=True, nogil=True)
def along(mesh, x, y, u, w):
    """Return the end of a side nearer to a point on its line, and the hand to which a path bends
    there.

    A path that continues behind the side bends to the right at its right end.
    """
    cx, cy = mesh.x, mesh.y
    from_u = abs(cx[u] - x) + abs(cy[u] - y)
    from_w = abs(cx[w] - x) + abs(cy[w] - y)
    return (u, -1) if from_u < from_w else (w, 1)


@njit(cache=True, nogil=True)
def successors(mesh, blocks, endpoints, is_goal, nodes, node, n):
    """Write the successors of a node and return the number of nodes.

    Parameters
    ----------
    mesh
        A `Mesh`.
    blocks
        int32 block of each slot, and bool whether the search may enter each block.
    endpoints
        sx, sy, tx, ty.
    is_goal
        Whether the goal is in the polygon behind the node's side.
    nodes
        int32 (m, 4) and float64 (m, 5), with room for three more nodes a side, and the goal.
    node, n
        Number of the node, and of all nodes.
    """
    cx, cy, kinds, first = mesh.x, mesh.y, mesh.kinds, mesh.first
    begins, finishes, twins = mesh.begins, mesh.finishes, mesh.twins
    block_of, is_open = blocks
    sx, sy, tx, ty = endpoints
    whole, real = nodes
    entry, root, marks = whole[node, SLOT], whole[node, ROOT], whole[node, ENDS]
    g = real[node, G]
    x, y = (sx, sy) if root < 0 else (cx[root], cy[root])
    polygon = mesh.polygon_of[entry]
    low, high = first[polygon], first[polygon + 1]
    a, b = begins[entry], finishes[entry]

    # From an end of the side, the root sees the whole polygon, which is convex.
    if root in (a, b):
        return _all_seen(mesh, blocks, endpoints, is_goal, nodes, node, n)

    # A path may bend round an end of the interval that is a corner: only so does it reach what the
    # rays leave hidden.
    lx, ly, rx, ry = real[node, _LX], real[node, _LY], real[node, _RX], real[node, _RY]
    turns_right = marks & _RIGHT and turns(kinds[b], cx[b] - x, cy[b] - y, -1)
    turns_left = marks & _LEFT and turns(kinds[a], cx[a] - x, cy[a] - y, 1)
    g_right = g + hypot(cx[b] - x, cy[b] - y) if turns_right else math.inf
    g_left = g + hypot(cx[a] - x, cy[a] - y) if turns_left else math.inf

    # The goal is seen, or hidden behind the one end that a path to it bends round.
    if is_goal:
        to_right, to_left = turn_of(x, y, rx, ry, tx, ty), turn_of(x, y, lx, ly, tx, ty)
        if to_right >= 0 and to_left <= 0:
            n = _put_goal(nodes, n, root, node, g + hypot(tx - x, ty - y))
        elif to_right < 0 and turns_right:
            n = _put_goal(nodes, n, b, node, g_right + hypot(tx - cx[b], ty - cy[b]))
        elif to_left > 0 and turns_left:
            n = _put_goal(nodes, n, a, node, g_left + hypot(tx - cx[a], ty - cy[a]))

    # Counter-clockwise from the right end of the entry. A turn above zero means left of the ray;
    # those of the far end w serve as those of the near end u of the next side.
    right_u, left_u = 0 if marks & _RIGHT else -1, -1
    slot = entry
    for _ in range(high - low - 1):
        slot = low if slot + 1 == high else slot + 1
        u, w, twin = begins[slot], finishes[slot], twins[slot]
        ux, uy, wx, wy = cx[u], cy[u], cx[w], cy[w]
        right_w = turn_of(x, y, rx, ry, wx, wy)
        left_w = turn_of(x, y, lx, ly, wx, wy)

        # Walls lead nowhere, closed blocks only to dead ends (see `blocks_of`).
        if twin >= 0 and is_open[block_of[slot]]:
            if right_w > 0 and left_u < 0:
                # Seen from the root, between the rays.
                seen = 0
                plx, ply, prx, pry = lx, ly, rx, ry
                if left_w <= 0:
                    plx, ply, seen = wx, wy, seen | _LEFT
                if right_u >= 0:
                    prx, pry, seen = ux, uy, seen | _RIGHT
                n = put(nodes, n, twin, root, node, seen, g, plx, ply, prx, pry)
            elif right_u == 0 and right_w == 0:
                # On the line of the right ray, which passes the end u first: there a path bends.
                if (u == b and turns_right) or (u != b and turns(kinds[u], ux - x, uy - y, -1)):
                    cost = g + hypot(ux - x, uy - y)
                    n = put(nodes, n, twin, u, node, WHOLE_SIDE, cost, wx, wy, ux, uy)
            elif left_u == 0 and left_w == 0:
                # On the line of the left ray, which passes the end w first.
                if (w == a and turns_left) or (w != a and turns(kinds[w], wx - x, wy - y, 1)):
                    cost = g + hypot(wx - x, wy - y)
                    n = put(nodes, n, twin, w, node, WHOLE_SIDE, cost, wx, wy, ux, uy)

            # Hidden on the right, wholly or in part: a path comes round b. Where the right ray cuts
            # the side, it limits the interval, continued behind b.
            if turns_right and (right_u < 0 or (u == b and right_w < 0)):
                by, more, seen = _hidden(mesh, b, u, w, right_w > 0, -1)
                if by >= 0:
                    plx, ply = (wx, wy) if right_w <= 0 else (2 * cx[b] - x, 2 * cy[b] - y)
                    seen = seen if seen < 0 else seen | _RIGHT
                    n = put(nodes, n, twin, by, node, seen, g_right + more, plx, ply, ux, uy)

            # The same on the left, from a.
            if turns_left and (left_w > 0 or (w == a and left_u > 0)):
                by, more, seen = _hidden(mesh, a, w, u, left_u < 0, 1)
                if by >= 0:
                    prx, pry = (ux, uy) if left_u >= 0 else (2 * cx[a] - x, 2 * cy[a] - y)
                    seen = seen if seen < 0 else seen | _LEFT
                    n = put(nodes, n, twin, by, node, seen, g_left + more, wx, wy, prx, pry)
        right_u, left_u = right_w, left_w
    return n


@njit(cache=True, nogil=True)
def _hidden(mesh, corner, near, far, is_cut, hand):
    """Return how a path bends round a corner to a side behind it, with the end `near` closer to the
    wall.

    The result holds the root of the interval, -1 if the path may not bend; the distance from the
    corner to the root; the marks of the interval, without that of its near end if the far end is
    cut off.
    """
    cx, cy = mesh.x, mesh.y
    if is_cut:
        return corner, 0.0, 0
    if (
        near != corner
        and turn_of(cx[corner], cy[corner], cx[near], cy[near], cx[far], cy[far]) == 0
    ):
        # Behind a wall on one line with it: two bends at once.
        dx, dy = cx[near] - cx[corner], cy[near] - cy[corner]
        if not turns(mesh.kinds[near], dx, dy, hand):
            return -1, 0.0, 0
        return near, hypot(dx, dy), -1 - corner
    return corner, 0.0, WHOLE_SIDE


@njit(cache=True, nogil=True)
def _all_seen(mesh, blocks, endpoints, is_goal, nodes, node, n):
    """Write the successors of a node whose root is an end of its side, so that it sees all of the
    polygon.

    Parameters
    ----------
    mesh, blocks, endpoints, is_goal, nodes, node, n
        See `successors`.
    """
    cx, cy, kinds, first = mesh.x, mesh.y, mesh.kinds, mesh.first
    begins, finishes, twins = mesh.begins, mesh.finishes, mesh.twins
    block_of, is_open = blocks
    _, _, tx, ty = endpoints
    whole, real = nodes
    entry, root, g = whole[node, SLOT], whole[node, ROOT], real[node, G]
    x, y = cx[root], cy[root]
    polygon = mesh.polygon_of[entry]
    if is_goal:
        n = _put_goal(nodes, n, root, node, g + hypot(tx - x, ty - y))
    for slot in range(first[polygon], first[polygon + 1]):
        twin = twins[slot]
        if slot == entry or twin < 0 or not is_open[block_of[slot]]:
            continue
        u, w = begins[slot], finishes[slot]
        ux, uy, wx, wy = cx[u], cy[u], cx[w], cy[w]
        by, cost = root, g
        if root not in (u, w) and turn_of(x, y, ux, uy, wx, wy) == 0:
            by, hand = along(mesh, x, y, u, w)
            if not turns(kinds[by], cx[by] - x, cy[by] - y, hand):
                continue
            cost += hypot(cx[by] - x, cy[by] - y)
        n = put(nodes, n, twin, by, node, WHOLE_SIDE, cost, wx, wy, ux, uy)
    return n


# The polygons that contain the endpoints of a query.

APART, MET, SPLIT = -1, 1, 0
"""Positions of the endpoints of a query: not connected, in one polygon, in several."""


@njit(cache=True, nogil=True)
def polygons_of_endpoints(mesh, cells, endpoints, starts, goals):
    """Find the polygons that contain the endpoints of a query.

    `mesh`, `endpoints`: see `successors`; `cells`: `Ends`; `starts`, `goals`: int32, room for as
    many polygons as the mesh has. Returns `APART`, `MET` or `SPLIT`; the numbers of polygons that
    contain the start and the goal.
    """
    sx, sy, tx, ty = endpoints
    inner = polygon_in(mesh, cells.polygon, cells.row, cells.col)
    last = polygon_in(mesh, cells.to_polygon, cells.to_row, cells.to_col)
    if mesh.component[inner] != mesh.component[last]:
        return APART, 0, 0
    n_starts = polygons_with(mesh, inner, cells.row, cells.col, sx, sy, starts)
    n_goals = polygons_with(_backward(mesh), last, cells.to_row, cells.to_col, tx, ty, goals)
    for k in range(n_starts):
        for m in range(n_goals):
            if starts[k] == goals[m]:
                return MET, n_starts, n_goals
    return SPLIT, n_starts, n_goals


@njit(cache=True, nogil=True)
def _backward(mesh):
    """Return the mesh with its directed sides reversed."""
    ways = mesh.begins, mesh.finishes, mesh.backs
    return Mesh(
        mesh.x, mesh.y, mesh.kinds, mesh.first, *ways, mesh.polygon_of, mesh.component, mesh.twins
    )


@njit(cache=True, nogil=True)
def polygon_in(mesh, polygon, row, col):
    """Return a polygon with the centre of a free cell; in a renewed mesh, one of the last."""
    cx, cy, first, component = mesh.x, mesh.y, mesh.first, mesh.component
    begins, finishes = mesh.begins, mesh.finishes
    if polygon >= 0 and component[polygon] >= 0:
        return polygon
    for other in range(len(first) - 2, -1, -1):
        holds = component[other] >= 0
        for slot in range(first[other], first[other + 1]):
            u, w = begins[slot], finishes[slot]
            holds = holds and turn_of(cx[u], cy[u], cx[w], cy[w], col + 0.5, row + 0.5) >= 0
        if holds:
            return other
    return polygon


@njit(cache=True, nogil=True)
def polygons_with(mesh, inner, row, col, x, y, found):
    """Find the polygons with a point of a free cell, also on their sides, reached inside the cell.

    Parameters
    ----------
    mesh
        See `successors`.
    inner
        The polygon at the centre of the cell.
    row, col
        The cell.
    x, y
        The point, in the closed square of the cell: where two free cells meet only at a corner, it
        belongs to this cell.
    found
        int32, room for the polygons, as many as the mesh has; their number is returned.
    """
    cx, cy, first, twins = mesh.x, mesh.y, mesh.first, mesh.twins
    begins, finishes, polygon_of = mesh.begins, mesh.finishes, mesh.polygon_of
    found[0] = inner
    n = 1
    at = 0
    while at < n:
        polygon = found[at]
        at += 1
        low, high = first[polygon], first[polygon + 1]
        for slot in range(low, high):
            if twins[slot] < 0:
                continue
            u = begins[slot]
            w = finishes[slot]
            # The segment from the centre to the point meets no wall: its polygons are connected.
            if not _touch(cx[u], cy[u], cx[w], cy[w], col + 0.5, row + 0.5, x, y):
                continue
            other = polygon_of[twins[slot]]
            is_known = False
            for k in range(n):
                is_known = is_known or found[k] == other
            if not is_known:
                found[n] = other
                n += 1
    kept = 0
    for k in range(n):
        polygon = found[k]
        low, high = first[polygon], first[polygon + 1]
        holds = True
        for slot in range(low, high):
            u = begins[slot]
            w = finishes[slot]
            holds = holds and turn_of(cx[u], cy[u], cx[w], cy[w], x, y) >= 0
        if holds:
            found[kept] = polygon
            kept += 1
    return kept


@njit(cache=True, nogil=True)
def _touch(ax, ay, bx, by, px, py, qx, qy):
    """Return whether two segments have a point in common.

    Parameters
    ----------
    ax, ay, bx, by
        Ends of one segment, in cells.
    px, py, qx, qy
        Ends of the other.
    """
    if max(ax, bx) < min(px, qx) or max(px, qx) < min(ax, bx):
        return False
    if max(ay, by) < min(py, qy) or max(py, qy) < min(ay, by):
        return False
    return (
        turn_of(ax, ay, bx, by, px, py) * turn_of(ax, ay, bx, by, qx, qy) <= 0
        and turn_of(px, py, qx, qy, ax, ay) * turn_of(px, py, qx, qy, bx, by) <= 0
    )
