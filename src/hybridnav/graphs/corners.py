"""Corners of obstacles, and pairs of positions whose shortest paths bend there."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._trig import sines_and_cosines
from hybridnav.graphs._spanner_kernels import log_uniform
from hybridnav.graphs.space import RIM_CELLS

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray
    from hybridnav.graphs.space import FreeSpace


def is_among(positions: FloatArray, others: FloatArray) -> BoolArray:
    """Return which positions are among others, bool (n,), both float64 (n, 2)."""
    # One number a position: sorting rows takes ten times as long.
    one, other = (each[:, 0] * (1 << 26) + each[:, 1] for each in (positions, others))
    found: BoolArray = np.isin(one, other)
    return found


@dataclass(frozen=True, eq=False)
class Corners:
    """The lattice corners with one blocked cell of four: all that shortest paths bend at."""

    positions: FloatArray
    """float64 (n, 2), (row, col) in grid units."""
    blocked: FloatArray
    """float64 (n, 2), 1 or -1: on which side of the corner the blocked cell lies."""

    @classmethod
    def of(cls, free: BoolArray) -> Corners:
        """Find the corners.

        Parameters
        ----------
        free
            bool (rows, cols).
        """
        rows, cols = free.shape[0] - 1, free.shape[1] - 1
        beside = np.stack(
            [~free[row : row + rows, col : col + cols] for row in (0, 1) for col in (0, 1)]
        )
        at = np.nonzero(beside.sum(axis=0) == 1)
        which = beside[:, at[0], at[1]].argmax(axis=0)
        sides = np.stack([which // 2, which % 2], axis=1) * 2.0 - 1.0
        return cls((np.stack(at, axis=1) + 1).astype(np.float64), sides)

    @property
    def nodes(self) -> FloatArray:
        """float64 (n, 2), where nodes lie nearest to each, in the free cell across."""
        return self.positions - RIM_CELLS * self.blocked

    def where(self, chosen: BoolArray) -> Corners:
        """Return some of the corners, bool (n,)."""
        return Corners(self.positions[chosen], self.blocked[chosen])

    def pairs(
        self,
        space: FreeSpace,
        draws: int,
        rng: np.random.Generator,
        reach_cells: tuple[float, float],
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Draw pairs of centres of free cells that see a corner, but not each other.

        The way over the corner is taut. Random pairs of a whole map are far apart; these are near
        each other, where one detour counts.

        Parameters
        ----------
        space
            Free space.
        draws
            Number of draws at each corner; many are no such pair.
        rng
            Source of random numbers.
        reach_cells
            The least and the greatest distance of an end from the corner, in cells; its logarithm
            is uniform.

        Returns
        -------
        tuple
            float64 (n, 2) starts and goals, and float64 (n,) the lengths of the ways over the
            corners, at least those of the shortest paths.
        """
        sight = space.sight
        corners = np.repeat(self.positions, draws, axis=0)
        blocked = np.repeat(self.blocked, draws, axis=0)
        angles = rng.uniform(0.0, np.pi / 2, size=(2, len(corners)))
        # Together less than a right angle, or the way over the corner is not taut.
        angles = np.where(angles.sum(axis=0) > np.pi / 2, np.pi / 2 - angles, angles)
        sines, along = sines_and_cosines(angles)
        beside = -sines
        ends: list[FloatArray] = []
        for step in ((along[0], beside[0]), (beside[1], along[1])):
            steps = np.stack(step, axis=1) * blocked
            reach = np.maximum(sight.reaches(corners, steps, reach_cells[1]), reach_cells[0])
            away = log_uniform(reach_cells[0], reach, rng.uniform(size=len(corners)))
            ends.append(np.floor(corners + away[:, None] * steps) + 0.5)
        both = np.concatenate(ends, axis=1)
        inside = (both > 0).all(axis=1) & (both < np.tile(space.free.shape, 2)).all(axis=1)
        ends, corners = [end[inside] for end in ends], corners[inside]
        fits = np.ones(len(corners), dtype=np.bool_)
        for end in ends:
            fits &= space.free[tuple(end.astype(np.int64).T)]
        for end in ends:
            fits[fits] = sight.clear(end[fits], corners[fits])
        fits[fits] = ~sight.clear(ends[0][fits], ends[1][fits])
        starts, goals, corners = ends[0][fits], ends[1][fits], corners[fits]
        return starts, goals, np.hypot(*(starts - corners).T) + np.hypot(*(goals - corners).T)
