"""Kernels of views: the corners seen from a point of a mesh at which a path may bend, and the arcs
to them of which a hierarchy is contracted.

A view spreads over the polygons from side to side, between two rays. A corner that lies on a line
behind another one is left out if a path may bend at the other: the path to it consists of two
edges.

Costs of arcs are whole numbers, distances in 1 / `UNITS` cells, rounded down: sums of them are
exact and never exceed the distance.
"""

import math

import numpy as np

from hybridnav._base.jit import guarded, njit, overload
from hybridnav._base.kernels.exact import turn_of
from hybridnav._base.trig import hypot
from hybridnav.search.contraction import pack
from hybridnav.search.mesh.kernels.intervals import APART, SPLIT, polygons_of_endpoints
from hybridnav.search.mesh.kernels.state import DONE, PAUSED, WORK_FULL, Target, Targets, ViewRoom

# Bits of a pending interval: a corner at which paths may bend limits it on the left, on the right.
_LEFT, _RIGHT = 1, 2
_BENDING = 4
"""Paths may bend round corners of kinds below this one."""


@njit(cache=True, nogil=True)
def distance(ax, ay, bx, by):
    """Return the distance between two points."""
    return math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay))


@njit(cache=True, nogil=True)
def touches(kind, dx, dy):
    """Return whether a line through a corner in a direction touches the one blocked cell there.

    A path in that direction may bend round the cell.
    """
    if kind >= _BENDING:
        return False
    ex = 1.0 if kind & 1 else -1.0
    ey = 1.0 if kind & 2 else -1.0
    return dx * ex * dy * ey <= 0.0


@njit(cache=True, nogil=True)
def lobe_of(kind, dx, dy):
    """Return the quadrant, 0 or 1, beside a corner's blocked cell that contains a direction.

    The direction touches the cell. A shortest path leaves the corner into the quadrant in which it
    arrives there.
    """
    ex = 1.0 if kind & 1 else -1.0
    ey = 1.0 if kind & 2 else -1.0
    return 0 if dx * ex >= 0.0 and dy * ey <= 0.0 else 1


@njit(cache=True, nogil=True)
def axes(kind, lobe):
    """Return the right and the left limit of a quadrant of `lobe_of`, as directions.

    Quadrant 2 is the one opposite to the blocked cell.
    """
    ex = 1.0 if kind & 1 else -1.0
    ey = 1.0 if kind & 2 else -1.0
    qx, qy = ex if lobe == 0 else -ex, ey if lobe == 1 else -ey
    return (qx, 0.0, 0.0, qy) if qx * qy > 0.0 else (0.0, qy, qx, 0.0)


@njit(cache=True, nogil=True)
def _pend(room, n, slot, marks, lx, ly, rx, ry):
    """Append an interval to those pending, and return their number.

    Parameters
    ----------
    room
        A `ViewRoom`.
    n
        Number of intervals before.
    slot, marks
        Slot of the interval's side, and marks of its endpoints.
    lx, ly, rx, ry
        Points on the left and right ray, in cells.
    """
    whole, real = room.whole, room.real
    whole[n, 0], whole[n, 1] = slot, marks
    real[n, 0], real[n, 1], real[n, 2], real[n, 3] = lx, ly, rx, ry
    return n + 1


@njit(cache=True, nogil=True)
def view_room(n):
    """Return room for n pending intervals and corners."""
    return ViewRoom(np.empty((n, 2), np.int32), np.empty((n, 4)), np.empty(n, np.int32))


@njit(cache=True, nogil=True)
def see_from_point(mesh, x, y, starts, target, room, found):
    """Find the corners seen from a point.

    Parameters
    ----------
    mesh, room
        A `Mesh`, a `ViewRoom`.
    x, y
        The point.
    starts
        int32 polygons that contain it.
    target
        A `Target`, or `Targets`.
    found
        Number of corners already in the room.

    Returns
    -------
    tuple
        Number of corners afterwards, -1 if the room is too small; whether the other point is seen.
    """
    cx, cy, kinds, twins = mesh.x, mesh.y, mesh.kinds, mesh.twins
    first, begins, finishes, seen = mesh.first, mesh.begins, mesh.finishes, room.seen
    n = 0
    for polygon in starts:
        low, high = first[polygon], first[polygon + 1]
        if found + high - low > len(seen) or n + high - low > len(room.whole):
            return -1, False
        for slot in range(low, high):
            u, w = begins[slot], finishes[slot]
            if touches(kinds[u], cx[u] - x, cy[u] - y):
                seen[found] = u
                found += 1
            if twins[slot] >= 0 and turn_of(x, y, cx[u], cy[u], cx[w], cy[w]) > 0:
                marks = _LEFT * (kinds[w] < _BENDING) + _RIGHT * (kinds[u] < _BENDING)
                n = _pend(room, n, twins[slot], marks, cx[w], cy[w], cx[u], cy[u])
    return _spread(mesh, x, y, target, room, n, found)


@njit(cache=True, nogil=True)
def see_from_corner(mesh, corner, slot, lobe, target, room, found):
    """Find the corners seen from a corner in one of the quadrants beside its blocked cell; return
    their number afterwards, -1 if the room is too small.

    Parameters
    ----------
    mesh, target, room, found
        See `see_from_point`.
    corner
        One that paths may bend round.
    slot
        The wall that begins there: its polygon is the first one round the corner.
    lobe
        See `lobe_of`.
    """
    first, begins, twins, polygon_of = mesh.first, mesh.begins, mesh.twins, mesh.polygon_of
    x, y = mesh.x[corner], mesh.y[corner]
    rx, ry, lx, ly = axes(mesh.kinds[corner], lobe)
    quadrant = (x + rx, y + ry, x + lx, y + ly)
    n = 0
    while slot >= 0:
        polygon = polygon_of[slot]
        low, high = first[polygon], first[polygon + 1]
        if found + high - low > len(room.seen) or n + high - low > len(room.whole):
            return -1
        last = slot - 1 if slot > low else high - 1
        sides = (slot, begins[last], twins[last] < 0)
        n, found = _see_round(mesh, x, y, quadrant, sides, room, n, found)
        slot = twins[last]
    found, _ = _spread(mesh, x, y, target, room, n, found)
    return found


@njit(cache=True, nogil=True)
def walls_at(mesh):
    """Return a slot of a wall that begins at each corner, int32 (n,), -1 for none."""
    begins, twins, polygon_of, component = mesh.begins, mesh.twins, mesh.polygon_of, mesh.component
    wall = np.full(len(mesh.kinds), -1, np.int32)
    for slot in range(len(begins)):
        if twins[slot] < 0 and component[polygon_of[slot]] >= 0:
            wall[begins[slot]] = slot
    return wall


@njit(cache=True, nogil=True)
def see_quadrant(mesh, corner, slot, lobe, target, room):
    """Return the number of corners seen, see `see_from_corner`, and the room, which may grow."""
    found = see_from_corner(mesh, corner, slot, lobe, target, room, 0)
    while found < 0:
        room = view_room(2 * len(room.seen))
        found = see_from_corner(mesh, corner, slot, lobe, target, room, 0)
    return found, room


@njit(cache=True, nogil=True)
def _see_round(mesh, x, y, quadrant, sides, room, n, found):
    """Note the view in a quadrant of a polygon, from one of its corners.

    The view holds the corners of the polygon, except those behind others, and pending intervals on
    the sides opposite to the point.

    Parameters
    ----------
    mesh, x, y, room, found
        See `see_from_point`.
    quadrant
        rx, ry, lx, ly, points on the right and left limit.
    sides
        Slots of the sides beside the corner, and whether the polygon is the last one round it.
    n
        Number of pending intervals.
    """
    cx, cy, kinds, finishes = mesh.x, mesh.y, mesh.kinds, mesh.finishes
    first, twins, polygon_of, seen = mesh.first, mesh.twins, mesh.polygon_of, room.seen
    rx, ry, lx, ly = quadrant
    # The corners beside the point; the far one is the near one of the next polygon.
    slot, far, is_last = sides
    near = finishes[slot]
    low, high = first[polygon_of[slot]], first[polygon_of[slot] + 1]
    ux, uy, u = x, y, -1
    right_u, is_u = 0, False
    for _ in range(high - low - 1):
        w = finishes[slot]
        wx, wy = cx[w], cy[w]
        right_w, left_w = turn_of(x, y, rx, ry, wx, wy), turn_of(x, y, lx, ly, wx, wy)
        is_w = right_w >= 0 and left_w <= 0
        if (
            is_w
            and touches(kinds[w], wx - x, wy - y)
            and (w == near or not _is_behind(mesh, x, y, near, w))
            and (w == far or not _is_behind(mesh, x, y, far, w))
            and (w != far or is_last)
        ):
            seen[found] = w
            found += 1
        twin = twins[slot]
        is_seen = (is_u and turn_of(x, y, lx, ly, ux, uy) < 0) or (right_u < 0 < right_w)
        if u >= 0 and twin >= 0 and is_seen and turn_of(x, y, ux, uy, wx, wy) > 0:
            plx, ply, prx, pry, marks = lx, ly, rx, ry, 0
            if is_w:
                plx, ply, marks = wx, wy, marks | _LEFT * (kinds[w] < _BENDING)
            if is_u:
                prx, pry, marks = ux, uy, marks | _RIGHT * (kinds[u] < _BENDING)
            n = _pend(room, n, twin, marks, plx, ply, prx, pry)
        ux, uy, u, right_u, is_u = wx, wy, w, right_w, is_w
        slot = low if slot + 1 == high else slot + 1
    return n, found


@njit(cache=True, nogil=True)
def _is_behind(mesh, x, y, corner, other):
    """Return whether a corner lies, seen from a point, behind another that paths may bend round."""
    cx, cy = mesh.x, mesh.y
    ux, uy, wx, wy = cx[corner], cy[corner], cx[other], cy[other]
    if mesh.kinds[corner] >= _BENDING or turn_of(x, y, ux, uy, wx, wy) != 0:
        return False
    return (ux - x) * (wx - x) + (uy - y) * (wy - y) > 0.0


def _is_seen(target, polygon, x, y, rays):
    (tx, ty, goals), (lx, ly, rx, ry) = target, rays
    for goal in goals:
        if goal == polygon and turn_of(x, y, rx, ry, tx, ty) >= 0:
            return turn_of(x, y, lx, ly, tx, ty) <= 0
    return False


def _are_seen(target, polygon, x, y, rays):
    begin, points, is_seen = target.begin, target.points, target.is_seen
    lx, ly, rx, ry = rays
    for k in target.members[begin[polygon] : begin[polygon + 1]]:
        tx, ty = points[k, 1], points[k, 0]
        if turn_of(x, y, rx, ry, tx, ty) >= 0 and turn_of(x, y, lx, ly, tx, ty) <= 0:
            is_seen[k] = True
    return False


_LOOKS = {Target: _is_seen, Targets: _are_seen}


def has_target(target, polygon, x, y, rays):
    """Return whether a `Target` in a polygon is seen from a point between two rays; of `Targets`,
    mark those that are."""
    return _LOOKS[type(target)](target, polygon, x, y, rays)


@overload(has_target)
def _has_target_of_class(target, polygon, x, y, rays):  # noqa: ARG001 - numba's rule
    return _LOOKS[target.instance_class]


@njit(cache=True, nogil=True)
def _spread(mesh, x, y, target, room, n, found):
    """Follow the pending intervals; return the result of `see_from_point`.

    Parameters
    ----------
    mesh, x, y, target, room, found
        See `see_from_point`.
    n
        Number of pending intervals.
    """
    cx, cy, kinds, finishes = mesh.x, mesh.y, mesh.kinds, mesh.finishes
    first, twins, polygon_of = mesh.first, mesh.twins, mesh.polygon_of
    whole, real, seen = room.whole, room.real, room.seen
    is_target_seen = False
    while n:
        n -= 1
        entry, marks = whole[n, 0], whole[n, 1]
        lx, ly, rx, ry = real[n, 0], real[n, 1], real[n, 2], real[n, 3]
        polygon = polygon_of[entry]
        low, high = first[polygon], first[polygon + 1]

        # A polygon adds at most one corner and one interval a side: checked once, not in the loop.
        if found + high - low > len(seen) or n + high - low > len(whole):
            return -1, False

        # All of a convex polygon that lies between the rays is seen, hence a target there too.
        is_target_seen |= has_target(target, polygon, x, y, (lx, ly, rx, ry))

        # The first end is the right one of the entry. It lies on the right ray or right of it, so
        # the ray itself limits the first interval.
        right_u = left_u = -1
        bends_u = 0
        ux, uy = lx, ly
        slot = entry
        for left_over in range(high - low - 2, -1, -1):
            slot = low if slot + 1 == high else slot + 1
            w = finishes[slot]
            wx, wy = cx[w], cy[w]
            bends_w = kinds[w] < _BENDING
            right_w = turn_of(x, y, rx, ry, wx, wy)
            left_w = turn_of(x, y, lx, ly, wx, wy) if right_w >= 0 else -1

            # The last end is the left one of the entry, noted with the polygon before. A corner on
            # a ray that comes from a corner at which paths may bend is behind that corner.
            if bends_w and left_over and right_w >= 0 >= left_w:
                is_behind = (right_w == 0 and marks & _RIGHT) or (left_w == 0 and marks & _LEFT)
                if not is_behind and touches(kinds[w], wx - x, wy - y):
                    seen[found] = w
                    found += 1

            # An end between the rays limits the next interval. One on a ray replaces it only if
            # paths may bend there, as it then hides what is behind it.
            if right_w > 0 > left_u and twins[slot] >= 0:
                plx, ply, prx, pry, kept = lx, ly, rx, ry, marks
                if left_w < 0 or (left_w == 0 and bends_w):
                    plx, ply, kept = wx, wy, (kept & _RIGHT) | _LEFT * bends_w
                if right_u > 0 or (right_u == 0 and bends_u):
                    prx, pry, kept = ux, uy, (kept & _LEFT) | _RIGHT * bends_u
                n = _pend(room, n, twins[slot], kept, plx, ply, prx, pry)

            # Counter-clockwise, all further ends lie left of the left ray too.
            if left_w > 0:
                break
            ux, uy, bends_u, right_u, left_u = wx, wy, bends_w, right_w, left_w
    return found, is_target_seen


@njit(cache=True, nogil=True)
def look(mesh, cells, endpoints, work):
    """Find the corners that the endpoints of a query see, or the answer if that needs no corner.

    `mesh`, `endpoints`: see `successors`; `cells`: see `polygons_of_endpoints`; `work`: a
    `CornerWork` or `HierarchyWork`, whose bounds receive the length and lower bound of the answer:
    infinite if the endpoints are not connected, their distance if they see each other. Returns
    `DONE` with the answer, `WORK_FULL`, or `PAUSED`, when the room holds the corners that the goal
    sees and then those that the start sees; the indices at which both lists end.
    """
    sx, sy, tx, ty = endpoints
    starts, goals = work.starts, work.goals
    how, n_starts, n_goals = polygons_of_endpoints(mesh, cells, endpoints, starts, goals)
    if how == APART:
        work.bounds[:] = np.inf
        return DONE, 0, 0
    if how == SPLIT:
        nowhere = Target(0.0, 0.0, starts[:0])
        n, _ = see_from_point(mesh, tx, ty, goals[:n_goals], nowhere, work.room, 0)
        if n < 0:
            return WORK_FULL, 0, 0
        target = Target(tx, ty, goals[:n_goals])
        n_all, is_seen = see_from_point(mesh, sx, sy, starts[:n_starts], target, work.room, n)
        if n_all < 0:
            return WORK_FULL, 0, 0
        if not is_seen:
            return PAUSED, n, n_all
    work.bounds[:] = hypot(tx - sx, ty - sy)
    return DONE, 0, 0


UNITS = float(1 << 34)
"""Units of cost per cell: a path of 100,000 segments is exact to 1e-5 cells, and one of 5e8 cells
fits."""
_SECTORS = 32
"""Sectors of a quadrant, by which directions are sorted."""


@njit(cache=True, nogil=True)
def cost_of(ax, ay, bx, by):
    """Return the cost of the segment between two points."""
    return np.int64(distance(ax, ay, bx, by) * UNITS)


@njit(cache=True, nogil=True)
def class_of(kind, dx, dy):
    """Return the class of a direction from a corner that touches its blocked cell.

    The class is its quadrant (see `lobe_of`) and, in there, its sector by slope.
    """
    across = abs(dy)
    sector = min(int(across / (abs(dx) + across) * _SECTORS), _SECTORS - 1)
    return lobe_of(kind, dx, dy) * _SECTORS + sector


@njit(cache=True, nogil=True)
def classes_that_follow():
    """Return the classes that may follow each class at a corner on a shortest path.

    See `contract`. A path goes from one quadrant beside the blocked cell to the other, and does not
    bend away from that cell. Two neighbouring sectors always may follow each other: every excluded
    path is then longer than the shortest one by more than the rounding of costs.

    Returns int64 (4, 64).
    """
    table = np.zeros((4, 2 * _SECTORS), np.int64)
    for one in range(_SECTORS):
        for two in range(max(one - 1, 0), _SECTORS):
            table[:, one] |= np.int64(1) << _SECTORS + two
            table[:, _SECTORS + two] |= np.int64(1) << one
    return table


@guarded
@njit(cache=True, nogil=True)
def arcs_of(mesh, first, heads):
    """Build the arcs of the graph of corners, as `contract` takes them.

    `mesh`: a `Mesh`; `first`, `heads`: results of `edges_of`. Returns int64 (n + 1,),
    offsets of the arcs of each corner; int64 (m, 2), these arcs.
    """
    cx, cy, kinds = mesh.x, mesh.y, mesh.kinds
    arcs = np.empty((len(heads), 2), np.int64)
    for corner in range(len(kinds)):
        x, y = cx[corner], cy[corner]
        for k in range(first[2 * corner], first[2 * corner + 2]):
            other = np.int64(heads[k])
            dx, dy = cx[other] - x, cy[other] - y
            near, far = class_of(kinds[corner], dx, dy), class_of(kinds[other], -dx, -dy)
            arcs[k, 0] = cost_of(x, y, cx[other], cy[other])
            arcs[k, 1] = pack(other, near, far)
    return first[::2].copy(), arcs
