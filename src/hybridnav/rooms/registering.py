"""The rigid transform between two maps of one building, found from their walls and free space."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from scipy import fft, ndimage

from hybridnav._base.trig import atan2, cos, sin
from hybridnav._base.typing import AnyArray, BoolArray, FloatArray, LongArray
from hybridnav.maps import CellClass, OccupancyGrid

_COARSE_M, _FINE_M = 0.2, 0.1
"""Sides of the pixels in which translations are searched, and distances to walls kept."""
_COARSE_PIXELS, _FINE_PIXELS = 400, 2000
"""Most pixels along a side of a map: those of larger maps are larger."""
_ANGLES = 360
"""Directions of the Hough spectrum, over half a turn."""
_TURNS = 6
"""Peaks of the correlation of two spectra that are looked at; each stands for two rotations."""
_SHIFTS = 4
"""Translations that are looked at for each rotation."""
_REFINED = 24
"""Candidates that are refined: those of the highest correlation."""
_APART_PIXELS = 10
"""Side of the squares of translations; only the best of each is a candidate."""
_BINOMIAL = (1 / 16, 4 / 16, 6 / 16, 4 / 16, 1 / 16)
_FREE_WEIGHT = 0.3
"""What a wall on free space of the other map costs, where a wall on a wall counts 1."""
_REACHES_M, _LAST_REACHES_M = (1.0, 0.4), (0.4, 0.2)
"""Distances beyond which a wall has no partner, one after the other; then those for the best."""
_STEPS = 8
"""Steps of the refinement with each reach."""
_SAMPLE, _LARGE_SAMPLE = 4000, 12_000
"""Most points of the walls of a map by which candidates are compared, and the best is refined."""
HIT_M = 0.15
"""How near a wall has to lie to one of the other map to be the same."""
_KNOWN_M = 0.3
"""How far from known cells the walls of the other map count as seen."""
_SAME_M, _SAME_RAD = 0.5, 0.05
_USUAL_CHANCE = 0.4
"""Share of walls on walls at a wrong place of a large overlap: of other buildings, 0.3 to 0.5."""
_LEAST_WALLS = 100
"""Fewest wall cells that a map can be recognized by."""
_LEAST_EXCESS = 0.12
"""Least length of walls on walls above that of chance, as a share of all walls of the map that has
fewer: other buildings reach 0.1."""
_EQUAL = 0.6
"""Share of the best candidate's excess from which on another one is as good."""


@dataclass(frozen=True)
class Transform:
    """A rotation about the origin, then a translation: from one map frame to another.

    Examples
    --------
    >>> from hybridnav.rooms import Transform
    >>> Transform(0.0, (1.0, 2.0)).moved([[3.0, 3.0]])
    array([[4., 5.]])
    """

    rotation_rad: float
    """Counter-clockwise, in radians, within -pi and pi."""
    translation_m: tuple[float, float]
    """`(x, y)` in metres."""

    def moved(self, points: FloatArray | list[list[float]]) -> FloatArray:
        """Return points `(x, y)` in metres, float64 (n, 2), in the other frame."""
        return turned(np.asarray(points, np.float64), self.rotation_rad) + self.translation_m

    @property
    def inverse(self) -> Transform:
        """The transform back."""
        x, y = turned(-np.array([self.translation_m]), -self.rotation_rad)[0].tolist()
        return Transform(-self.rotation_rad, (x, y))


class Registration(NamedTuple):
    """The transform between two maps, or why there is none."""

    best: Candidate | None
    """From the older map to the newer one, about their centres."""
    share: float
    """Share of the walls that both maps show, among those that both could."""
    reason: str
    """Why there is no transform; empty if there is one."""


def turned(points: FloatArray, angle_rad: float) -> FloatArray:
    """Return points turned about the origin, counter-clockwise, float64 (n, 2)."""
    c, s = cos(angle_rad), sin(angle_rad)
    x, y = points[..., 0], points[..., 1]
    return np.stack([c * x - s * y, s * x + c * y], axis=-1)


class Surface:
    """What the registration of a map looks at: points relative to the centre of its walls."""

    def __init__(self, grid: OccupancyGrid) -> None:
        free = grid.measured == CellClass.FREE
        beside = ndimage.binary_dilation(free, np.ones((3, 3), np.bool_))
        self.is_wall: BoolArray = (grid.measured == CellClass.OCCUPIED) & beside
        self._per = grid.frame.resolution_m
        walls = grid.frame.points_of(np.argwhere(self.is_wall))
        self.centre: FloatArray = (
            (walls.min(axis=0) + walls.max(axis=0)) / 2 if len(walls) else np.zeros(2)
        )
        self.walls: FloatArray = walls - self.centre
        self.sample = self.thinned(_SAMPLE)
        self.length_m = len(walls) * self._per
        self.extent_m = 2 * float(np.abs(self.walls).max(initial=0.0)) + self._per
        self.hit_m = max(HIT_M, 1.5 * self._per)
        self.grid, self._free = grid, free

    def thinned(self, most: int) -> FloatArray:
        """Return at most so many points of the walls."""
        return self.walls[:: max(1, -(-len(self.walls) // most))]

    def pixels(self, cells: BoolArray, side_m: float) -> tuple[FloatArray, FloatArray]:
        """Return some cells in squares of about a side: middles, and numbers of cells."""
        per = max(1.0, side_m / self._per)
        row, col = np.nonzero(cells)
        key = (row / per).astype(np.int64) * cells.shape[1] + (col / per).astype(np.int64)
        _, of, n = np.unique(key, return_inverse=True, return_counts=True)
        sums = [np.bincount(of, each + 0.5, len(n)) / n for each in (row, col)]
        return self.grid.frame.points_of_grid(np.stack(sums, axis=1)) - self.centre, n.astype(float)

    def pictures_of(self, side_m: float) -> Pictures:
        """Return the pixels of walls and free space; see `Pictures`."""
        per = max(1.0, side_m / self._per)
        walls, n_walls = self.pixels(self.is_wall, side_m)
        free, n_free = self.pixels(self._free, side_m)
        return Pictures(
            side_m,
            (walls, np.minimum(n_walls / per, 1.0)),
            (free, np.minimum(n_free / (per * per), 1.0)),
        )

    @cached_property
    def field(self) -> WallDistances:
        """Distances to the walls."""
        side_m = max(_FINE_M, self._per, self.extent_m / _FINE_PIXELS)
        # Cells lie inside pixels, not on their borders: points would be drawn to one side.
        low = self.walls.min(axis=0) - 2 * _REACHES_M[0] - self._per / 2
        shape = _shape((self.walls.max(axis=0) + 2 * _REACHES_M[0] - low) / side_m)
        at = _flat(self.walls, low, side_m, shape)
        known = np.zeros(shape, np.bool_)
        free = _flat(self.pixels(self._free, side_m)[0], low, side_m, shape)
        known.ravel()[free[free >= 0]] = True
        n = np.bincount(at, minlength=known.size)
        is_bare = n.reshape(shape) == 0
        away, nearest = ndimage.distance_transform_edt(
            is_bare, sampling=side_m, return_indices=True
        )
        # Where two walls are equally near, the transform names the first in the order of the array:
        # run on the array turned round, it names the other one, so that both are known.
        turned_round = ndimage.distance_transform_edt(
            is_bare[::-1, ::-1], return_distances=False, return_indices=True
        )[:, ::-1, ::-1]
        known |= n.reshape(shape) > 0
        known = ndimage.binary_dilation(known, iterations=max(1, round(_KNOWN_M / side_m)))
        middles = [np.bincount(at, x, known.size) / np.maximum(n, 1) for x in self.walls.T]
        points = np.stack(middles, axis=1)
        first = points[nearest[0] * shape[1] + nearest[1]]
        last = points[known.size - 1 - (turned_round[0] * shape[1] + turned_round[1])]
        partner = (first + last) / 2
        return WallDistances(low, side_m, known, away, partner)


class Pictures(NamedTuple):
    """Pixels of a map as points with weights up to 1, to be drawn turned."""

    side_m: float
    """Side of a pixel."""
    walls: tuple[FloatArray, FloatArray]
    """Points of walls, float64 (n, 2), and their weights."""
    free: tuple[FloatArray, FloatArray]
    """The same of free space."""

    def drawn(
        self, angle_rad: float, low: FloatArray, shape: tuple[int, int]
    ) -> tuple[AnyArray, AnyArray]:
        """Return float32 images of the map turned about its centre: its walls, and what a wall of
        another map gains at each pixel."""
        walls, free = np.zeros((2, *shape), np.float32)
        for image, (points, weights) in ((walls, self.walls), (free, self.free)):
            at = _flat(turned(points, angle_rad), low, self.side_m, shape)
            inside = at >= 0
            image.ravel()[:] = np.bincount(at[inside], weights[inside], image.size)
            np.minimum(image, 1.0, out=image)
        gain = _blurred(_blurred(walls, 0, "constant"), 1, "constant")
        free[ndimage.maximum_filter(walls, 3) > 0] = 0.0
        return walls, gain - np.float32(_FREE_WEIGHT) * free


class WallDistances(NamedTuple):
    """Distances to the walls of a map, on pixels."""

    low: FloatArray
    """Lower corner of the pixels."""
    side_m: float
    """Side of a pixel."""
    known: BoolArray
    """Pixels within 0.3 m of free cells or walls."""
    away_m: FloatArray
    """float64 (rows, cols), the distance from each to the nearest wall."""
    partner: FloatArray
    """float64 (rows, cols, 2), the nearest point of a wall; the middle of two equally near."""

    def at(self, points: FloatArray) -> tuple[BoolArray, FloatArray, FloatArray]:
        """Return whether points are known, how far the next wall is in metres, and where."""
        at = _flat(points, self.low, self.side_m, self.known.shape)
        return (
            (at >= 0) & self.known.ravel()[at],
            self.away_m.ravel()[at],
            self.partner.reshape(-1, 2)[at],
        )


class Candidate(NamedTuple):
    """A rotation and a shift of points relative to the centres, and how well they fit."""

    angle_rad: float
    """The rotation, counter-clockwise."""
    shift_m: FloatArray
    """float64 (2,), where the centre of the old walls comes to lie."""
    hits_m: float = 0.0
    """Length of walls that lie on walls, both maps together."""
    seen_m: float = 0.0
    """Length of walls that the other map could show."""

    @property
    def share(self) -> float:
        """Hits among what is seen."""
        return self.hits_m / self.seen_m if self.seen_m else 0.0

    def excess_m(self, chance: float) -> float:
        """Return the hits above those of chance."""
        return self.hits_m - chance * self.seen_m

    def is_like(self, other: Candidate) -> bool:
        """Return whether two candidates are one: within half a metre and 0.05 rad."""
        turn = math.remainder(self.angle_rad - other.angle_rad, math.tau)
        away = float(np.abs(self.shift_m - other.shift_m).max())
        return abs(turn) < _SAME_RAD and away < _SAME_M


def register(one: Surface, other: Surface) -> Registration:
    """Find the rigid transform between two maps of one building, if one alone fits.

    Rotations are the peaks of the circular correlation of Hough spectra. For each, the walls and
    the free space of both maps are correlated over all translations. The best candidates are
    refined point by point, then compared by the walls that lie on walls, above what chance makes:
    the share of all candidates but the best.

    Parameters
    ----------
    one, other
        The maps, the older one first. No scale is estimated.

    References
    ----------
    S. Carpin: Fast and accurate map merging for multi-robot systems, 2008. The refinement is the
    iterative closest point method with weights; the comparison of candidates is ours.
    """
    for name, surface in (("old", one), ("new", other)):
        if len(surface.walls) < _LEAST_WALLS:
            return Registration(None, 0.0, f"the {name} map has too few walls to recognize it by")
    coarse = _candidates(one, other)
    refined = [_compared(refine(each, one.sample, other.field), one, other) for each in coarse]
    ranked = _ranked(refined)
    excess_m, best = ranked[0]
    if excess_m < 2 * _LEAST_EXCESS * min(one.length_m, other.length_m):
        return Registration(None, best.share, "the walls of the maps do not fit anywhere")
    if len(ranked) > 1 and ranked[1][0] > _EQUAL * excess_m:
        turn = math.degrees(ranked[1][1].angle_rad - best.angle_rad) % 360
        reason = f"two transforms fit equally well, {turn:.0f} degrees apart"
        return Registration(None, best.share, reason)
    last = refine(best, one.thinned(_LARGE_SAMPLE), other.field, reaches_m=_LAST_REACHES_M)
    return Registration(last, _compared(last, one, other).share, "")


def transform_of(best: Candidate, one: Surface, other: Surface) -> Transform:
    """Return the transform of a candidate between the frames of two maps."""
    angle = math.remainder(best.angle_rad, math.tau)
    x, y = (best.shift_m + other.centre - turned(one.centre, angle)).tolist()
    return Transform(angle, (x, y))


def _ranked(candidates: list[Candidate]) -> list[tuple[float, Candidate]]:
    """Return candidates that differ, with their hits in metres above those of chance, the best
    first."""
    distinct: list[Candidate] = []
    for each in sorted(candidates, key=lambda each: -each.excess_m(_USUAL_CHANCE)):
        if not any(each.is_like(other) for other in distinct):
            distinct.append(each)
    seen_m = sum(each.seen_m for each in distinct[1:])
    chance = sum(each.hits_m for each in distinct[1:]) / seen_m if seen_m else _USUAL_CHANCE
    ranked = [(each.excess_m(chance), each) for each in distinct]
    return sorted(ranked, key=lambda each: -each[0])


def _rotations(old: FloatArray, new: FloatArray, side_m: float) -> list[float]:
    """Return the likeliest rotations of the walls of a map to those of another, in radians."""
    one, other = (_spectrum(points, side_m) for points in (old, new))
    both = fft.irfft(fft.rfft(other) * np.conj(fft.rfft(one)), _ANGLES)
    smooth = _blurred(both, 0, "wrap")
    peaks = np.flatnonzero((smooth >= np.roll(smooth, 1)) & (smooth > np.roll(smooth, -1)))
    best = peaks[np.argsort(-smooth[peaks], kind="stable")][:_TURNS]
    return [math.pi * (at / _ANGLES + half) for at in best.tolist() for half in (0, 1)]


def _blurred(array: AnyArray, axis: int, mode: Literal["constant", "wrap"]) -> AnyArray:
    """Return an array blurred over a pixel or so, by binomial weights along one axis."""
    return ndimage.correlate1d(array, _BINOMIAL, axis=axis, mode=mode)


def _spectrum(points: FloatArray, side_m: float) -> FloatArray:
    """Return how sharp the projection of walls is in each direction, standardized."""
    sharp = np.zeros(_ANGLES)
    reach = float(np.abs(points).max()) * 2
    for at in range(_ANGLES):
        along = turned(points, -math.pi * at / _ANGLES)[:, 0] + reach
        steps = np.diff(np.bincount((along / side_m).astype(np.int64)).astype(np.float64))
        sharp[at] = (steps * steps).sum()
    spread = float(sharp.std())
    return (sharp - sharp.mean()) / (spread or 1.0)


def _candidates(one: Surface, other: Surface) -> list[Candidate]:
    """Return rotations and translations of the highest correlation, unrefined."""
    side_m = max(_COARSE_M, one.extent_m / _COARSE_PIXELS, other.extent_m / _COARSE_PIXELS)
    old, new = one.pictures_of(side_m), other.pictures_of(side_m)
    low, shape = _box(new, turn=False)
    low_old, shape_old = _box(old, turn=True)
    whole = tuple(
        fft.next_fast_len(a + b, real=True) for a, b in zip(shape, shape_old, strict=True)
    )
    walls, gain = (fft.rfft2(image, whole) for image in new.drawn(0.0, low, shape))
    found: list[tuple[float, float, FloatArray]] = []
    for angle in _rotations(old.walls[0], new.walls[0], side_m):
        moved = [np.conj(fft.rfft2(image, whole)) for image in old.drawn(angle, low_old, shape_old)]
        sums = fft.irfft2(gain * moved[0] + walls * moved[1], whole)
        for value, peak in _peaks(sums):
            at = np.where(peak >= shape, peak - np.array(whole), peak)
            found.append((-value, angle, at[::-1] * side_m + low - low_old))
    found.sort(key=lambda each: each[:2])
    return [Candidate(angle, shift) for _, angle, shift in found[:_REFINED]]


def _peaks(sums: FloatArray) -> list[tuple[float, LongArray]]:
    """Return the highest sums, each in a square of its own, and where they are."""
    size = _APART_PIXELS
    rows, cols = (-(-n // size) for n in sums.shape)
    padded = np.full((rows * size, cols * size), -np.inf, np.float32)
    padded[: sums.shape[0], : sums.shape[1]] = sums
    squares = padded.reshape(rows, size, cols, size).swapaxes(1, 2).reshape(-1, size * size)
    inside = squares.argmax(axis=1)
    values = squares[np.arange(len(squares)), inside]
    best = np.argsort(-values, kind="stable")[:_SHIFTS]
    square, within = np.divmod(best, cols), np.divmod(inside[best], size)
    at = np.stack(square, axis=1) * size + np.stack(within, axis=1)
    return list(zip(values[best].tolist(), at, strict=True))


def _box(pictures: Pictures, *, turn: bool) -> tuple[FloatArray, tuple[int, int]]:
    """Return the lower corner and the shape of an image that holds a map, or any turn of it."""
    points = np.concatenate([pictures.walls[0], pictures.free[0]])
    if turn:
        reach = math.sqrt(float((points * points).sum(axis=1).max()))
        low, high = np.full(2, -reach), np.full(2, reach)
    else:
        low, high = points.min(axis=0), points.max(axis=0)
    return low, _shape((high - low) / pictures.side_m)


def refine(
    start: Candidate,
    points: FloatArray,
    field: WallDistances,
    *,
    reaches_m: tuple[float, ...] = _REACHES_M,
    turns: bool = True,
) -> Candidate:
    """Return a candidate after steps towards the nearest walls, the nearer the heavier.

    `start`, `points`, `field`: the candidate, walls of the old map, and distances to those of the
    new one; `reaches_m`: distances beyond which a wall has no partner, one after the other;
    `turns`: whether to turn, too.
    """
    angle, shift = start.angle_rad, start.shift_m
    for reach in reaches_m:
        for _ in range(_STEPS):
            known, away, partner = field.at(turned(points, angle) + shift)
            near = known & (away < reach)
            weight = (1 - (away[near] / reach) ** 2) ** 2
            total = float(weight.sum())
            if not total:
                break
            mine, theirs = points[near], partner[near]
            centre, goal = ((weight[:, None] * each).sum(axis=0) / total for each in (mine, theirs))
            if turns:
                (a, b), (c, d) = (mine - centre).T, (theirs - goal).T
                sine, cosine = (weight * (a * d - b * c)).sum(), (weight * (a * c + b * d)).sum()
                angle = atan2(float(sine), float(cosine))
            shift = goal - turned(centre, angle)
    return Candidate(angle, shift)


def _compared(each: Candidate, one: Surface, other: Surface) -> Candidate:
    hits_m = seen_m = 0.0
    there = turned(one.sample, each.angle_rad) + each.shift_m
    back = turned(other.sample - each.shift_m, -each.angle_rad)
    limit = max(one.hit_m, other.hit_m)
    for points, field, of in ((there, other.field, one), (back, one.field, other)):
        known, away, _ = field.at(points)
        hits_m += float((known & (away < limit)).mean()) * of.length_m
        seen_m += float(known.mean()) * of.length_m
    return Candidate(each.angle_rad, each.shift_m, hits_m, seen_m)


def _shape(size: FloatArray) -> tuple[int, int]:
    """Return rows and columns of an image of a size in pixels, x first."""
    return math.ceil(size[1]) + 1, math.ceil(size[0]) + 1


def _flat(points: FloatArray, low: FloatArray, side_m: float, shape: tuple[int, ...]) -> LongArray:
    """Return the flat pixel of each point, -1 outside of the image."""
    col, row = np.floor((points - low) / side_m).astype(np.int64).T
    inside = (row >= 0) & (row < shape[0]) & (col >= 0) & (col < shape[1])
    return np.where(inside, row * shape[1] + col, -1)
