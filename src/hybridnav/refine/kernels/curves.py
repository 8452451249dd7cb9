"""Kernels of the shortest curves of a vehicle with a turning circle, forwards or both ways.

A word is a row of segments: kinds (1 for an arc to the left, 0 for straight on, -1 to the right)
and signed lengths, negative backwards, in turning radii unless stated otherwise. Poses are x, y in
turning radii and phi in radians; `sine` and `cosine` are those of phi. The functions of words take
`kinds` and `lengths`, int64 and float64 (5,), of the best word so far, its length `best`, and
whether to mirror the word and to flip its direction.
"""

import math

import numpy as np

from hybridnav._base.jit import njit
from hybridnav._base.trig import acos, asin, atan2, cos, sin

_FULL = 2 * math.pi
_ROUNDING, _RELATIVE = 1e-9, 1e-14
"""Turning radii, and share of the distance, by which a word may miss the goal: rounding turns an
empty arc into a full turn, and a square root of rounding is far above it."""
LARGEST_HEADING = 1e6
"""Headings in radians above which too few digits remain."""


@njit(cache=True, nogil=True)
def _forward(angle):
    """Bring an angle to [0, 2 pi]; rounding brings one just below 0 to 2 pi."""
    return angle - _FULL * math.floor(angle / _FULL)


@njit(cache=True, nogil=True)
def _wrapped(angle):
    """Bring an angle to [-pi, pi]."""
    return angle - _FULL * np.rint(angle / _FULL)


@njit(cache=True, nogil=True)
def _take(kinds, lengths, best, mirror, flip, back, word, segments):
    """Keep a word if it is shorter than the best one; return the lesser length.

    Parameters
    ----------
    kinds, lengths
        See `shortest_word`.
    best
        Length of the best word so far.
    mirror, flip
        -1 for a word that is mirrored, or driven in the other direction; else 1.
    back
        Whether it is driven from its end.
    word, segments
        Kinds and signed lengths of its segments.
    """
    total = 0.0
    for segment in segments:
        total += abs(segment)
    if total >= best:
        return best
    n = len(segments)
    for i in range(n):
        j = n - 1 - i if back else i
        kinds[j], lengths[j] = mirror * word[i], flip * segments[i]
    for i in range(n, 5):
        kinds[i], lengths[i] = 0, 0.0
    return total


@njit(cache=True, nogil=True)
def _two_segments(x, y, phi, reverses, kinds, lengths):
    """Try the words of at most two segments, which meet few poses, but these by rounding only.

    Return the least length, infinity where none ends within the rounding of the goal.

    A word of three segments has an empty one there. Its length may come out a little below 0, which
    forwards is a full circle. So each word here is found from the heading, and its end compared.
    """
    best, sine, cosine = np.inf, sin(phi), cos(phi)
    near = _ROUNDING + _RELATIVE * (abs(x) + abs(y))
    for s in (1, -1):
        turn = _wrapped(s * phi) if reverses else _forward(s * phi)
        # What an arc to the heading of the goal leaves, seen from the start, and from the goal.
        a, b = x - s * sine, y - s * (1 - cosine)
        ahead, aside = a * cosine + b * sine, b * cosine - a * sine
        if abs(b) <= near and (reverses or a >= -near):
            a = a if reverses else max(a, 0.0)
            best = _take(kinds, lengths, best, 1, 1, False, (0, s), (a, turn))
        if abs(aside) <= near and (reverses or ahead >= -near):
            ahead = ahead if reverses else max(ahead, 0.0)
            best = _take(kinds, lengths, best, 1, 1, False, (s, 0), (turn, ahead))
        # From the centre of the first circle to that of the last, which touches it.
        a, b = x + s * sine, s * y - cosine - 1
        if abs(math.sqrt(a * a + b * b) - 2) <= near:
            t = atan2(a, -b)
            q = t - s * phi
            t, q = (_wrapped(t), _wrapped(q)) if reverses else (_forward(t), _forward(q))
            best = _take(kinds, lengths, best, 1, 1, False, (s, -s), (t, q))
    return best


@njit(cache=True, nogil=True)
def _dubins(x, y, phi, kinds, lengths, best):
    """Find the shortest word forwards from the origin to a pose (L. E. Dubins, 1957); return its
    length.

    An arc, then the tangent of two circles or a long arc between them, then an arc.
    """
    for s in (1, -1):
        for e in (1, -1):
            # From the centre of the first circle to that of the last.
            d_x, d_y = x - e * sin(phi), y + e * cos(phi) - s
            distance, angle = math.sqrt(d_x * d_x + d_y * d_y), atan2(d_y, d_x)
            if s == e:
                t, p, q = _forward(s * angle), distance, _forward(s * (phi - angle))
                best = _take(kinds, lengths, best, 1, 1, False, (s, 0, e), (t, p, q))
                if distance <= 4:
                    p = _FULL - 2 * asin(distance / 4)
                    t = _forward(s * angle + p / 2)
                    q = _forward(s * phi - t + p)
                    best = _take(kinds, lengths, best, 1, 1, False, (s, -s, s), (t, p, q))
            elif distance >= 2:
                angle += s * asin(2 / distance)
                t, q = _forward(s * angle), _forward(e * (phi - angle))
                p = math.sqrt(distance * distance - 4)
                best = _take(kinds, lengths, best, 1, 1, False, (s, 0, e), (t, p, q))
    return best


@njit(cache=True, nogil=True)
def _tau_omega(u, v, xi, eta, phi):
    """Return the first and last arc of four whose middle two are u and v."""
    delta = _wrapped(u - v)
    a, b = sin(u) - sin(delta), cos(u) - cos(delta) - 1
    tau = atan2(eta * a - xi * b, xi * a + eta * b)
    if 2 * (cos(delta) - cos(v) - cos(u)) + 3 < 0:
        tau += math.pi
    tau = _wrapped(tau)
    return tau, _wrapped(tau - u + v - phi)


@njit(cache=True, nogil=True)
def _three_segments(x, y, phi, sine, cosine, kinds, lengths, best, mirror, flip):
    """Try the words of an arc, a straight line and an arc; return the least length.

    Parameters
    ----------
    x, y, phi
        The goal's position, in radii, and heading, in radians, as seen from the start.
    sine, cosine
        Those of `phi`.
    kinds, lengths, best, mirror, flip
        See `_take`.
    """
    xi, eta = x - sine, y - 1 + cosine
    u, t = math.sqrt(xi * xi + eta * eta), atan2(eta, xi)
    v = _wrapped(phi - t)
    best = _take(kinds, lengths, best, mirror, flip, False, (1, 0, 1), (t, u, v))
    xi, eta = x + sine, y - 1 - cosine
    squared = xi * xi + eta * eta
    if squared >= 4:
        u = math.sqrt(squared - 4)
        t = _wrapped(atan2(eta, xi) + atan2(2.0, u))
        v = _wrapped(t - phi)
        best = _take(kinds, lengths, best, mirror, flip, False, (1, 0, -1), (t, u, v))
    return best


@njit(cache=True, nogil=True)
def _four_arcs(x, y, phi, sine, cosine, kinds, lengths, best, mirror, flip):
    """Try the words of four arcs, the middle two equally long; return the least length.

    Parameters
    ----------
    x, y, phi, sine, cosine, kinds, lengths, best, mirror, flip
        See `_three_segments`.
    """
    xi, eta = x + sine, y - 1 - cosine
    squared = xi * xi + eta * eta
    rho = (2 + math.sqrt(squared)) / 4
    if rho <= 1:
        u = acos(rho)
        t, v = _tau_omega(u, -u, xi, eta, phi)
        best = _take(kinds, lengths, best, mirror, flip, False, (1, -1, 1, -1), (t, u, -u, v))
    rho = (20 - squared) / 16
    if 0 <= rho <= 1:
        u = -acos(rho)
        t, v = _tau_omega(u, u, xi, eta, phi)
        best = _take(kinds, lengths, best, mirror, flip, False, (1, -1, 1, -1), (t, u, u, v))
    return best


@njit(cache=True, nogil=True)
def _quarter_turns(x, y, phi, sine, cosine, kinds, lengths, best, mirror, flip):
    """Try the words with a straight line between two quarter turns; return the least length.

    Parameters
    ----------
    x, y, phi, sine, cosine, kinds, lengths, best, mirror, flip
        See `_three_segments`.
    """
    quarter = math.pi / 2
    xi, eta = x + sine, y - 1 - cosine
    squared = xi * xi + eta * eta
    if squared >= 4:
        u = 4 - math.sqrt(squared - 4)
        t = _wrapped(atan2((4 - u) * xi - 2 * eta, -2 * xi + (u - 4) * eta))
        v = _wrapped(t - phi)
        word, segments = (1, -1, 0, 1, -1), (t, -quarter, u, -quarter, v)
        best = _take(kinds, lengths, best, mirror, flip, False, word, segments)
    return best


@njit(cache=True, nogil=True)
def _turned(x, y, phi, sine, cosine, kinds, lengths, best, mirror, flip, back):
    """Try the words that may be driven from their end: three arcs, or one quarter turn.

    Return the least length.

    Parameters
    ----------
    x, y, phi, sine, cosine, kinds, lengths, best, mirror, flip
        See `_three_segments`.
    back
        Whether the word is driven from its end.
    """
    quarter = math.pi / 2
    xi, eta = x - sine, y - 1 + cosine
    distance, angle = math.sqrt(xi * xi + eta * eta), atan2(eta, xi)
    if distance <= 4:
        u = -2 * asin(distance / 4)
        t = _wrapped(angle + u / 2 + math.pi)
        v = _wrapped(phi - t + u)
        best = _take(kinds, lengths, best, mirror, flip, back, (1, -1, 1), (t, u, v))
    if distance >= 2:
        r = math.sqrt(distance * distance - 4)
        u = 2 - r
        t = _wrapped(angle + atan2(r, -2.0))
        v = _wrapped(phi - quarter - t)
        word, segments = (1, -1, 0, 1), (t, -quarter, u, v)
        best = _take(kinds, lengths, best, mirror, flip, back, word, segments)
    xi, eta = x + sine, y - 1 - cosine
    distance = math.sqrt(xi * xi + eta * eta)
    if distance >= 2:
        u, t = 2 - distance, atan2(xi, -eta)
        v = _wrapped(t + quarter - phi)
        word, segments = (1, -1, 0, -1), (t, -quarter, u, v)
        best = _take(kinds, lengths, best, mirror, flip, back, word, segments)
    return best


@njit(cache=True, nogil=True)
def _reeds_shepp(x, y, phi, kinds, lengths, best):
    """Find the shortest word forwards and backwards from the origin to a pose; return its length.

    J. A. Reeds, L. A. Shepp: Optimal paths for a car that goes both forwards and backwards, 1990:
    the words of section 8, each also mirrored, flipped in direction, and driven from its end. They
    are taken with all signs: each ends at the goal, and rounding cannot hide one.
    """
    sine, cosine = sin(phi), cos(phi)
    for flip in (1, -1):
        for mirror in (1, -1):
            a, b, turn, turn_sine = flip * x, mirror * y, flip * mirror * phi, flip * mirror * sine
            pose = (a, b, turn, turn_sine, cosine)
            best = _three_segments(*pose, kinds, lengths, best, mirror, flip)
            best = _four_arcs(*pose, kinds, lengths, best, mirror, flip)
            best = _quarter_turns(*pose, kinds, lengths, best, mirror, flip)
            best = _turned(*pose, kinds, lengths, best, mirror, flip, False)
            a, b = a * cosine + b * turn_sine, a * turn_sine - b * cosine
            pose = (a, b, turn, turn_sine, cosine)
            best = _turned(*pose, kinds, lengths, best, mirror, flip, True)
    return best


@njit(cache=True, nogil=True)
def shortest_word(x0, y0, yaw0, x1, y1, yaw1, radius, reverses, kinds, lengths):
    """Find the shortest curve between two poses; return the number of its segments.

    It is 0 for poses that are not finite or have headings beyond `LARGEST_HEADING`.

    Parameters
    ----------
    x0, y0, yaw0, x1, y1, yaw1
        The poses; headings in radians.
    radius
        Turning radius, in the unit of the positions.
    reverses
        Whether backward segments are allowed.
    kinds
        int64 (5,), receives 1 for an arc to the left, 0 for straight on, -1 for one to the right.
    lengths
        float64 (5,), receives lengths in the unit of the radius, negative backwards.
    """
    if not 0.0 < radius < np.inf:
        return 0
    x, y = (x1 - x0) / radius, (y1 - y0) / radius
    if not (math.isfinite(x) and math.isfinite(y)):
        return 0
    if not (abs(yaw0) <= LARGEST_HEADING and abs(yaw1) <= LARGEST_HEADING):
        return 0
    cosine, sine = cos(yaw0), sin(yaw0)
    x, y, phi = cosine * x + sine * y, cosine * y - sine * x, _wrapped(yaw1 - yaw0)
    best = _two_segments(x, y, phi, reverses, kinds, lengths)
    if reverses:
        best = _reeds_shepp(x, y, phi, kinds, lengths, best)
    else:
        best = _dubins(x, y, phi, kinds, lengths, best)
    if best == np.inf:
        return 0
    n = 5
    while n > 1 and lengths[n - 1] == 0.0:
        n -= 1
    for i in range(n):
        lengths[i] *= radius
    return n
