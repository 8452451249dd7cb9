"""Bends of a line a second time: by chords over lengths of it, and by a recursion on points.

They share nothing with `hybridnav.guide.words.bends`.
"""

import itertools
import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class Corner:
    """A bend: where it lies by the length of the line, and its degrees, to the left if positive."""

    at_m: float
    degrees: float


class Windows:
    """Headings of a line before and after each of its points, over windows of its length."""

    def __init__(self, points: FloatArray, step_m: float = 0.05) -> None:
        lengths = [math.dist(a, b) for a, b in itertools.pairwise(points)]
        self.length_m = math.fsum(lengths)
        self._step_m = step_m
        where = np.concatenate([[0.0], np.cumsum(lengths)])
        self._along = np.arange(0.0, self.length_m + step_m / 2, step_m)
        self._z = np.interp(self._along, where, points[:, 0]) + 1j * np.interp(
            self._along, where, points[:, 1]
        )

    def turns(self, window_m: float) -> tuple[FloatArray, FloatArray]:
        """Where a window fits on both sides, and the degrees from one chord to the other."""
        n = round(window_m / self._step_m)
        before, after = self._z[n:-n] - self._z[: -2 * n], self._z[2 * n :] - self._z[n:-n]
        return self._along[n:-n], np.degrees(np.angle(after / before))

    def corners(self, least_degrees: float) -> list[Corner]:
        """Corners that nobody disputes: two metres of the line are straight on both sides of
        them."""
        n = round(2.0 / self._step_m)
        found: list[Corner] = []
        for at in range(n, len(self._z) - n):
            before, after = self._z[at - n : at + 1], self._z[at : at + n + 1]
            if not (_is_straight(before) and _is_straight(after)):
                continue
            turn = math.degrees(np.angle((after[-1] - after[0]) / (before[-1] - before[0])))
            if abs(turn) < least_degrees:
                continue
            corner = Corner(float(self._along[at]), turn)
            if found and corner.at_m - found[-1].at_m < 1.0:
                found[-1] = max(found[-1], corner, key=lambda one: abs(one.degrees))
            else:
                found.append(corner)
        return found

    def turns_near(self, at_m: float, hand: int, least_degrees: float) -> bool:
        """Whether the line turns to a hand, 1 for left, -1 for right, within a metre of a point."""
        for window_m in (0.5, 1.0, 1.5, 2.0, 3.0):
            if 2 * window_m >= self.length_m:
                break
            along, degrees = self.turns(window_m)
            near = np.abs(along - at_m) <= 1.0
            if near.any() and (hand * degrees[near]).max() >= least_degrees:
                return True
        return False


def _is_straight(z: NDArray[Any]) -> bool:
    chord = z[-1] - z[0]
    if abs(chord) == 0:
        return False
    off = np.abs(((z - z[0]) / (chord / abs(chord))).imag)
    return bool(off.max() <= 0.15)


def simplified_corners(
    points: FloatArray, *, tolerance_m: float = 0.75, least_degrees: float = 55.0
) -> list[Corner]:
    """Corners of the line simplified by Douglas and Peucker's method, one by one."""
    lengths = [math.dist(a, b) for a, b in itertools.pairwise(points)]
    where = [0.0]
    for length in lengths:
        where.append(where[-1] + length)
    z = [complex(x, y) for x, y in points.tolist()]
    kept = sorted(_kept(z, 0, len(z) - 1, tolerance_m))
    corners = []
    for before, at, after in zip(kept[:-2], kept[1:-1], kept[2:], strict=True):
        ratio = (z[after] - z[at]) / (z[at] - z[before])
        degrees = math.degrees(math.atan2(ratio.imag, ratio.real))
        if abs(degrees) >= least_degrees:
            corners.append(Corner(where[at], degrees))
    return corners


def _kept(z: list[complex], first: int, last: int, tolerance_m: float) -> set[int]:
    worst, at = tolerance_m, None
    for inner in range(first + 1, last):
        off = _off(z[inner], z[first], z[last])
        if off > worst:
            worst, at = off, inner
    if at is None:
        return {first, last}
    return _kept(z, first, at, tolerance_m) | _kept(z, at, last, tolerance_m)


def _off(point: complex, begin: complex, end: complex) -> float:
    along = end - begin
    if along == 0:
        return abs(point - begin)
    share = ((point - begin) / along).real
    return abs(point - begin - min(1.0, max(0.0, share)) * along)
