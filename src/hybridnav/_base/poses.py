"""Poses at even distances along the points of a path."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav._base.trig import directions, hypots, sines_and_cosines
from hybridnav.errors import InvalidValueError

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, LongArray, SignArray

_MAX_POSES = 10_000_000
BEND = 1e-6
"""Radians, and radians per metre, below which a path counts as straight: the rounding of cell
centres on a straight line far from the origin."""
_ROUNDING = 1e-9


class Spread(NamedTuple):
    """Poses along a path, and the step from each one to the next."""

    poses: FloatArray
    """float64 (n, 3), `(x, y, yaw)`, metres and radians in [-pi, pi)."""
    directions: SignArray
    """int8 (n,), 1 ahead or -1 backwards after each pose, at the last one before it."""
    lengths_m: FloatArray
    """float64 (n - 1,), metres driven on each step, on arcs along them; 0 for turns on the spot."""
    turns_rad: FloatArray
    """float64 (n - 1,), turn of the heading on each step, also one by more than half a circle."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Motion of a robot between the points of a path, one row a step.

    `points`: float64 (n, 2), n >= 1, metres; `headings_rad`: float64 (n,), None for a robot that
    faces its direction of travel; `curved`: whether the robot drives an arc of a circle from each
    pose to the next, tangent to both headings; else a straight line, on which it turns evenly;
    `start_rad`, `goal_rad`: heading from which it turns on the spot at the first point, and to
    which at the last one; None for no turn.
    """

    points: FloatArray
    headings_rad: FloatArray | None
    curved: bool
    start_rad: float | None = None
    goal_rad: float | None = None

    @property
    def _steps(self) -> FloatArray:
        return np.diff(self.points, axis=0)

    @property
    def _chords(self) -> FloatArray:
        return hypots(*self._steps.T)

    @property
    def _travel(self) -> FloatArray:
        """Direction of each step; a step without length has that of the step before, or behind."""
        steps = self._steps
        travel = directions(steps[:, 1], steps[:, 0])
        return _filled(travel, self._chords > 0)

    @property
    def _turns(self) -> FloatArray:
        """Turn of the heading on each step, in [-pi, pi)."""
        if self.headings_rad is None:
            return np.zeros(len(self.points) - 1)
        return wrapped(np.diff(self.headings_rad))

    @property
    def lengths_m(self) -> FloatArray:
        """float64 (n - 1,), metres driven on each step."""
        chords = self._chords
        return chords / _chord_of_arc(self._turns / 2) if self.curved else chords

    @property
    def directions(self) -> SignArray:
        """int8 (n - 1,), -1 on backward steps, else 1; a turn on the spot has the value of the step
        before, or behind."""
        ahead = np.ones(len(self.points) - 1)
        if self.headings_rad is not None:
            middle = self.headings_rad[:-1] + self._turns / 2
            ahead = np.where(sines_and_cosines(self._travel - middle)[1] < -_ROUNDING, -1.0, 1.0)
            ahead = _filled(ahead, self.lengths_m > 0)
        return ahead.astype(np.int8)

    @property
    def spot_turns(self) -> LongArray:
        """int64, indices of points at which the robot turns on the spot.

        These are bends of straight lines without headings, with headings the points that differ
        from the next one in heading alone, and endpoints with another heading of their own.
        """
        turns = np.zeros(len(self.points), dtype=np.bool_)
        if self.headings_rad is None:
            turns[1:-1] = np.abs(wrapped(np.diff(self._travel))) > BEND
        else:
            turns[:-1] = (self.lengths_m == 0) & (np.abs(self._turns) > BEND)
        for end, heading in ((0, self.start_rad), (-1, self.goal_rad)):
            turns[end] |= heading is not None and _differ(heading, self._faced[end])
        return np.flatnonzero(turns)

    @property
    def max_curvature_per_m(self) -> float:
        """Largest turn of a metre driven on arcs, in radians."""
        lengths, turns = self.lengths_m, np.abs(self._turns)
        bent = (lengths > 0) & (turns > BEND)
        return float((turns[bent] / lengths[bent]).max(initial=0.0)) if self.curved else 0.0

    @property
    def _faced(self) -> FloatArray:
        """The headings of the motion itself, between the turns at its ends; of a path of one point,
        the one that the robot has or takes there."""
        if len(self.points) == 1 and (self.start_rad is not None or self.goal_rad is not None):
            return np.array([self.goal_rad if self.start_rad is None else self.start_rad])
        if self.headings_rad is not None:
            return self.headings_rad
        travel = self._travel
        return np.append(travel, travel[-1]) if len(travel) else np.zeros(1)

    @property
    def headings_at_points(self) -> FloatArray:
        """float64 (n,), the headings, or the direction of travel after each point, before the last
        one; 0 without motion. At an endpoint with a heading of its own, that one."""
        faced = self._faced.copy()
        for end, heading in ((0, self.start_rad), (-1, self.goal_rad)):
            if heading is not None:
                faced[end] = heading
        return faced

    @property
    def is_left(self) -> BoolArray:
        """bool (n,), whether the robot leaves a point, by a drive or a turn on the spot, before it
        is at the next one; true at the last one. All others repeat the next pose."""
        leaves = self._chords > 0
        if self.headings_rad is not None:
            leaves |= np.diff(self.headings_rad) != 0
        return np.append(leaves, True)

    def bends(self, *, of_rate: bool) -> LongArray:
        """Return the indices of points that even spacing must keep, with both endpoints, int64.

        `of_rate`: whether those count at which the turn of a metre changes, as where a line and an
        arc meet.
        """
        lengths, turns = self.lengths_m, self._turns
        moves = lengths > 0
        rate = np.divide(turns, lengths, out=np.zeros_like(turns), where=moves)
        bent = of_rate & (np.abs(np.diff(rate)) > BEND)
        if not self.curved:
            bent |= np.abs(wrapped(np.diff(self._travel))) > BEND
        else:
            bent |= np.diff(self.directions) != 0
        if self.headings_rad is not None:  # turns on the spot
            bent |= ~moves[1:] | ~moves[:-1]
        kept = np.flatnonzero(bent) + 1
        return np.unique(np.concatenate([[0], kept, [len(self.points) - 1]]))

    def spread(self, spacing_m: float, *, of_rate: bool = False) -> Spread:
        """Return poses at most `spacing_m` apart, even between `bends`.

        No pose occurs twice in a row; two poses at one point are a turn on the spot.

        Raises `InvalidValueError` when the spacing is not positive, or there would be more than ten
        million poses.
        """
        left = np.append((self._chords > 0) | (np.abs(self._turns) > BEND), True)
        if not left.all():  # turns by less than a bend are none
            headings = None if self.headings_rad is None else self.headings_rad[left]
            distinct = replace(self, points=self.points[left], headings_rad=headings)
            return distinct.spread(spacing_m, of_rate=of_rate)
        lengths = self.lengths_m
        total_m = float(lengths.sum())
        if not spacing_m > 0 or total_m / spacing_m > _MAX_POSES:
            raise InvalidValueError(
                f"spacing_m must be above 0 and yield at most {_MAX_POSES} poses on "
                f"{total_m:.4g} m, got {spacing_m}: increase it"
            )
        if len(lengths) == 0:
            pose, still = np.append(self.points[0], wrapped(self._faced))[None], np.zeros(0)
            return self._turned_at_ends(Spread(pose, np.ones(1, np.int8), still, still))
        along = np.concatenate([[0.0], np.cumsum(lengths)])
        bends = self.bends(of_rate=of_rate)
        steps, wanted = [], []
        for first, last in zip(bends[:-1].tolist(), bends[1:].tolist(), strict=True):
            count = max(1, int(np.ceil((along[last] - along[first]) / spacing_m - _ROUNDING)))
            wanted.append(np.linspace(along[first], along[last], count, endpoint=False))
            inside = along[first + 1 : last]
            steps.append(first + np.searchsorted(inside, wanted[-1], side="right"))
        step = np.append(np.concatenate(steps), len(lengths) - 1)
        at = np.append(np.concatenate(wanted), along[-1])
        part = np.append(_part(at[:-1] - along[step[:-1]], lengths[step[:-1]]), 1.0)
        turns = self._turns
        turned = np.concatenate([[0.0], np.cumsum(turns)])[step] + part * turns[step]
        poses, ahead = self._poses(step, part), self.directions[step]
        return self._turned_at_ends(Spread(poses, ahead, np.diff(at), np.diff(turned)))

    def driven(self, spacing_m: float) -> Spread:
        """Return poses as `spread` does, also where lines and arcs meet, with two at each turn on
        the spot, also where lines without headings bend."""
        spread = self.spread(spacing_m, of_rate=True)
        if self.headings_rad is not None:
            return spread
        yaw, moves = spread.poses[:, 2], spread.lengths_m > 0
        turn = wrapped(np.diff(yaw))
        at = 1 + np.flatnonzero((np.abs(turn[:-1]) > BEND) & moves[:-1] & moves[1:])
        before = np.column_stack([spread.poses[at, :2], yaw[at - 1]])
        return Spread(
            np.insert(spread.poses, at, before, 0),
            np.insert(spread.directions, at, spread.directions[at]),
            np.insert(spread.lengths_m, at, 0.0),
            np.insert(spread.turns_rad, at, turn[at - 1]),
        )

    def _turned_at_ends(self, spread: Spread) -> Spread:
        """Return poses with the turns on the spot at both ends."""
        poses, ahead, lengths, turns = spread
        for end, heading in ((0, self.start_rad), (-1, self.goal_rad)):
            if heading is None:
                continue
            turned = poses[end].copy()
            turned[2:] = wrapped(np.array([heading]))
            if _differ(turned[2], poses[end, 2]):
                turn = wrapped(turned[2:] - poses[end, 2])
                turns = np.append(turns, turn) if end else np.append(-turn, turns)
                at = len(poses) if end else 0
                lengths = np.insert(lengths, len(lengths) if end else 0, 0.0)
                poses, ahead = np.insert(poses, at, turned, 0), np.insert(ahead, at, ahead[end])
            poses[end] = turned
        return Spread(poses, ahead, lengths, turns)

    def _poses(self, step: LongArray, part: FloatArray) -> FloatArray:
        place = self.points[step] + part[:, None] * self._steps[step]
        last = part == 1.0
        place[last] = self.points[step[last] + 1]
        if self.headings_rad is None:
            return np.column_stack([place, wrapped(self._travel[step])])
        turns = self._turns[step]
        yaw = self.headings_rad[step] + part * turns
        if self.curved:
            driven = self.lengths_m * self.directions
            place = place + self._off_chord(driven[step], self.headings_rad[step], turns, part)
        return np.column_stack([place, wrapped(yaw)])

    @staticmethod
    def _off_chord(
        driven_m: FloatArray, heading: FloatArray, turns: FloatArray, part: FloatArray
    ) -> FloatArray:
        """Return the offset of an arc from its chord, (x, y), after a share of both."""

        def ahead(part: FloatArray) -> FloatArray:
            half = part * turns / 2
            chord = part * driven_m * _chord_of_arc(half)
            sines, cosines = sines_and_cosines(heading + half)
            return np.column_stack([chord * cosines, chord * sines])

        return ahead(part) - part[:, None] * ahead(np.ones_like(part))


def _chord_of_arc(half_rad: FloatArray) -> FloatArray:
    """Return the ratios of chords to arcs, given half of the turn."""
    sines = sines_and_cosines(half_rad)[0]
    return np.divide(sines, half_rad, out=np.ones_like(sines), where=half_rad != 0)


def _differ(one_rad: float, other_rad: float) -> bool:
    """Return whether a robot turns from one heading to the other."""
    return bool(np.abs(wrapped(np.array([one_rad - other_rad])))[0] > BEND)


def wrapped(angles_rad: FloatArray) -> FloatArray:
    """Return angles wrapped to [-pi, pi)."""
    return (angles_rad + np.pi) % (2 * np.pi) - np.pi


def _part(along_m: FloatArray, lengths_m: FloatArray) -> FloatArray:
    part: FloatArray = np.divide(
        along_m, lengths_m, out=np.zeros_like(along_m), where=lengths_m > 0
    )
    return np.clip(part, 0.0, 1.0)


def _filled(values: FloatArray, known: BoolArray) -> FloatArray:
    """Return values with each unknown one replaced by the last known one before it, else after
    it."""
    if known.all() or not known.any():
        return values
    last = np.maximum.accumulate(np.where(known, np.arange(len(values)), -1))
    last[last < 0] = int(np.flatnonzero(known)[0])
    return values[last]
