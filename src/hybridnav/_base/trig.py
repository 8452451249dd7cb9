"""Sines, angles, exponentials, logarithms and lengths that are equal on every processor.

The functions of numpy and of the C library have variants for groups of processors, which differ in
the last bit, and one bit decides which cell a beam meets. These use `+ - * /` and `sqrt` alone,
which IEEE 754 defines exactly, in a fixed order; `%`, `frexp` and `ldexp` are exact, too. They
are within two units in the last place. Kernels call the functions of a number; those of an array
have the same values. `math.dist` has one value everywhere, too, but not that of a kernel: a bound
of one could lie above a cost of the other.

References
----------
FDLIBM, Sun Microsystems 1993: the polynomials and the reduction of arguments.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, TypeVar

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._base.typing import FloatArray

    Number = TypeVar("Number", float, FloatArray)

_FAR = 2.0**20
"""Radians from which on whole turns of `math.tau`, not of 2 pi, are taken off first."""
_PER_QUARTER = 6.36619772367581382433e-01
_HALF_PI = (1.57079632673412561417e00, 6.07710050630396597660e-11, 2.02226624879595063154e-21)
"""Half of pi in three parts, the first two of 33 bits."""
_PER_LN2 = 1.44269504088896338700e00
_LN2 = (6.93147180369123816490e-01, 1.90821492927058770002e-10)
_PI_REST = 1.2246467991473531772e-16
_ARCTANS = (
    (4.63647609000806093515e-01, 2.26987774529616870924e-17),
    (7.85398163397448278999e-01, 3.06161699786838301793e-17),
    (9.82793723247329054082e-01, 1.39033110312309984516e-17),
    (1.57079632679489655800e00, 6.12323399573676603587e-17),
)
"""Arc tangents of 1/2, 1, 3/2 and infinity, and what their rounding lost."""
_GREATEST_EXP, _LEAST_EXP = 709.782712893384, -745.133219101941


def _sine(rest: Number, tail: Number) -> Number:
    """Return the sine of an angle of at most an eighth of a turn, given in two parts."""
    z = rest * rest
    r = -2.50507602534068634195e-08 + z * 1.58969099521155010221e-10
    r = 8.33333333332248946124e-03 + z * (
        -1.98412698298579493134e-04 + z * (2.75573137070700676789e-06 + z * r)
    )
    v = z * rest
    return rest - ((z * (0.5 * tail - v * r) - tail) + v * 1.66666666666666324348e-01)


def _cosine(rest: Number, tail: Number) -> Number:
    """Return the cosine of an angle of at most an eighth of a turn, given in two parts."""
    z = rest * rest
    r = 2.08757232129817482790e-09 + z * -1.13596475577881948265e-11
    r = 2.48015872894767294178e-05 + z * (-2.75573143513906633035e-07 + z * r)
    r = z * (4.16666666666666019037e-02 + z * (-1.38888888888741095749e-03 + z * r))
    half = 0.5 * z
    w = 1.0 - half
    return w + (((1.0 - w) - half) + (z * r - rest * tail))


def _off_quarter(angle: Number, quarter: Number) -> tuple[Number, Number]:
    """Return what an angle exceeds a number of quarter turns by, in two parts."""
    rough = angle - quarter * _HALF_PI[0]
    taken = quarter * _HALF_PI[1]
    rest = rough - taken
    lost = quarter * _HALF_PI[2] - ((rough - rest) - taken)
    whole = rest - lost
    return whole, (rest - whole) - lost


def _odd_series(x: Number) -> Number:
    """Return `x - atan(x)` for `x` of at most 7/16."""
    z = x * x
    w = z * z
    even = 6.66107313738753120669e-02 + w * (
        4.97687799461593236017e-02 + w * 1.62858201153657823623e-02
    )
    even = 1.42857142725034663711e-01 + w * (9.09088713343650656196e-02 + w * even)
    odd = -5.83357013379057348645e-02 + w * -3.65315727442169155270e-02
    odd = -1.11111104054623557880e-01 + w * (-7.69187620504482999495e-02 + w * odd)
    even = z * (3.33333333333329318027e-01 + w * even)
    return x * (even + w * (-1.99999999998764832476e-01 + w * odd))


def _quadrant_and_rest(angle: float) -> tuple[int, float, float]:
    if abs(angle) >= _FAR:
        angle %= math.tau
    quarter = math.floor(angle * _PER_QUARTER + 0.5) if math.isfinite(angle) else 0
    rest, tail = _off_quarter(angle, float(quarter))
    return quarter & 3, rest, tail


def sin(angle_rad: float) -> float:
    """Return the sine of an angle in radians."""
    quadrant, rest, tail = _quadrant_and_rest(angle_rad)
    value = _cosine(rest, tail) if quadrant & 1 else _sine(rest, tail)
    return -value if quadrant & 2 else value


def cos(angle_rad: float) -> float:
    """Return the cosine of an angle in radians."""
    quadrant, rest, tail = _quadrant_and_rest(angle_rad)
    value = _sine(rest, tail) if quadrant & 1 else _cosine(rest, tail)
    return -value if (quadrant + 1) & 2 else value


def tan(angle_rad: float) -> float:
    """Return the tangent of an angle in radians."""
    return sin(angle_rad) / cos(angle_rad)


def _arctan(x: float) -> float:
    """Return the arc tangent of a number >= 0."""
    if x < 0.4375:  # noqa: PLR2004 - 7/16, 11/16, 19/16 and 39/16
        return x - _odd_series(x)
    if x < 0.6875:  # noqa: PLR2004
        (whole, lost), x = _ARCTANS[0], (2.0 * x - 1.0) / (2.0 + x)
    elif x < 1.1875:  # noqa: PLR2004
        (whole, lost), x = _ARCTANS[1], (x - 1.0) / (x + 1.0)
    elif x < 2.4375:  # noqa: PLR2004
        (whole, lost), x = _ARCTANS[2], (x - 1.5) / (1.0 + 1.5 * x)
    else:
        (whole, lost), x = _ARCTANS[3], -1.0 / x
    return whole - ((_odd_series(x) - lost) - x)


def atan2(y: float, x: float) -> float:
    """Return the direction of `(x, y)` in radians, from -pi to pi."""
    if math.isnan(x) or math.isnan(y):
        return math.nan
    if math.isinf(x) and math.isinf(y):
        x, y = math.copysign(1.0, x), math.copysign(1.0, y)
    if math.isinf(y) or abs(x) * 2.0**60 < abs(y):
        return math.copysign(_ARCTANS[3][0], y)
    angle = _arctan(abs(y / x)) if x != 0.0 else 0.0
    if math.copysign(1.0, x) < 0.0:
        angle = math.pi - (angle - _PI_REST)
    return math.copysign(angle, y)


def asin(x: float) -> float:
    """Return the arc sine of a number within [-1, 1]."""
    return atan2(x, math.sqrt((1.0 - x) * (1.0 + x)))


def acos(x: float) -> float:
    """Return the arc cosine of a number within [-1, 1]."""
    return atan2(math.sqrt((1.0 - x) * (1.0 + x)), x)


def exp(x: float) -> float:
    """Return the exponential of a number, infinite where it would be too large."""
    if not _LEAST_EXP <= x <= _GREATEST_EXP:
        return x if math.isnan(x) else 0.0 if x < 0.0 else math.inf
    k = math.floor(x * _PER_LN2 + 0.5)
    high, low = x - k * _LN2[0], k * _LN2[1]
    r = high - low
    t = r * r
    c = -1.65339022054652515390e-06 + t * 4.13813679705723846039e-08
    c = -2.77777777770155933842e-03 + t * (6.61375632143793436117e-05 + t * c)
    c = r - t * (1.66666666666666019037e-01 + t * c)
    return math.ldexp(1.0 - ((low - (r * c) / (2.0 - c)) - high), k)


def log(x: float) -> float:
    """Return the natural logarithm of a finite number above 0."""
    m, k = math.frexp(x)
    if m < math.sqrt(0.5):
        m, k = 2.0 * m, k - 1
    f = m - 1.0
    s = f / (2.0 + f)
    z = s * s
    w = z * z
    even = w * (
        3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01)
    )
    odd = 1.818357216161805012e-01 + w * 1.479819860511658591e-01
    odd = z * (6.666666666666735130e-01 + w * (2.857142874366239149e-01 + w * odd))
    half = 0.5 * f * f
    return k * _LN2[0] - ((half - (s * (half + (odd + even)) + k * _LN2[1])) - f)


def hypot(x: float, y: float) -> float:
    """Return the length of a vector; infinite above 1e154, 0 below 1e-162."""
    right, up = float(x), float(y)
    return math.sqrt(right * right + up * up)


IN_KERNELS = (
    *(_sine, _cosine, _off_quarter, _odd_series, _quadrant_and_rest, _arctan),
    *(sin, cos, tan, atan2, asin, acos, exp, log, hypot),
)
"""What kernels can call."""


def dist(one: Sequence[float] | FloatArray, other: Sequence[float] | FloatArray) -> float:
    """Return the distance of two points `(x, y)`, by `hypot`."""
    (x, y), (to_x, to_y) = one, other
    return hypot(float(to_x) - float(x), float(to_y) - float(y))


def hypots(x: ArrayLike, y: ArrayLike) -> FloatArray:
    """Return the lengths of vectors `(x, y)`, of their shape: `hypot` of arrays."""
    rights, ups = np.asarray(x, np.float64), np.asarray(y, np.float64)
    with np.errstate(over="ignore"):
        return np.sqrt(rights * rights + ups * ups)


def lengths_along(points: ArrayLike) -> FloatArray:
    """Return the length of a line up to each of its points, float64 (n,).

    `points`: (n, 2), n >= 1; lengths are in their unit.
    """
    return np.concatenate([[0.0], np.cumsum(hypots(*np.diff(points, axis=0).T))])


def sines_and_cosines(angles_rad: ArrayLike) -> tuple[FloatArray, FloatArray]:
    """Return the sines and the cosines of angles in radians, float64 of their shape."""
    angles = np.asarray(angles_rad, dtype=np.float64)
    angles = np.where(np.abs(angles) >= _FAR, angles % math.tau, angles)
    quarter = np.floor(angles * _PER_QUARTER + 0.5)
    rest, tail = _off_quarter(angles, quarter)
    sine, cosine = _sine(rest, tail), _cosine(rest, tail)
    quadrant = quarter % 4
    is_odd = quadrant % 2 == 1
    sines, cosines = np.where(is_odd, cosine, sine), np.where(is_odd, sine, cosine)
    turned = (quadrant == 1) | (quadrant == 2)  # noqa: PLR2004 - quadrants of negative cosines
    return np.where(quadrant >= 2, -sines, sines), np.where(turned, -cosines, cosines)  # noqa: PLR2004


def directions(y: ArrayLike, x: ArrayLike) -> FloatArray:
    """Return the directions of vectors `(x, y)` in radians, from -pi to pi: `atan2` of arrays."""
    ups, rights = np.broadcast_arrays(np.asarray(y, np.float64), np.asarray(x, np.float64))
    pairs = zip(ups.ravel().tolist(), rights.ravel().tolist(), strict=True)
    return np.array([atan2(up, right) for up, right in pairs]).reshape(ups.shape)
