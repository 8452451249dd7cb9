"""Distances without paths: of one pair, and tables of many."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.progress import no_progress
from hybridnav.errors import InvalidValueError
from hybridnav.planner import PlanStatus
from hybridnav.planner.endpoints import read_points

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from contextlib import AbstractContextManager

    from numpy.typing import ArrayLike
    from scipy import sparse

    from hybridnav._base.progress import Progress
    from hybridnav._base.typing import BoolArray, FloatArray, LongArray
    from hybridnav.planner.blocked import Closable
    from hybridnav.planner.planning import Planning
    from hybridnav.search.found import ClosedCells

    Block = tuple[slice, slice, FloatArray]

_PAIRS = 4096
"""Pairs that are planned at a time where there are no labels."""


class Distances:
    """What a planner says of distances; a part of `HybridPlanner`."""

    _now: Planning
    _query: Callable[[], AbstractContextManager[bool]]

    def distance(
        self,
        start: ArrayLike | str,
        goal: ArrayLike | str,
        *,
        blocked: Closable | ClosedCells | None = None,
    ) -> float:
        """Return the cost that a plan would have, and nothing else.

        Parameters
        ----------
        start, goal, blocked
            As in `plan`.

        Returns
        -------
        float
            Metres in the metric of the preset; infinite if there is no path, NaN where `plan`
            refuses an end.

        Examples
        --------
        >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
        >>> round(hn.HybridPlanner(topology).distance((0.5, 0.5), (2.0, 2.5)), 3)
        2.546
        """
        with self._query():
            now = self._now
            return _distance(now, now.read(start, goal, None, blocked, "anywhere"))

    def distances(
        self,
        starts: ArrayLike,
        goals: ArrayLike,
        *,
        nearest: int | None = None,
        blocked: Closable | ClosedCells | None = None,
        progress: Progress = no_progress,
    ) -> Any:
        """Return the costs of plans from all starts to all goals, exactly.

        With `shortest` and `octile` they come from labels of the ends in a hierarchy, less than a
        microsecond a pair on a building. With closures, costs or OMPL each pair is planned.

        Parameters
        ----------
        starts, goals
            `(x, y)` in metres, map frame, shape (n, 2) and (m, 2).
        nearest
            Number of goals to keep for each start; None for all.
        blocked
            As in `plan`.
        progress
            Called after each block with the number of pairs done and of all pairs.

        Returns
        -------
        FloatArray or scipy.sparse.csr_array
            float64 (n, m), as `distance`; with `nearest` sparse, the nearest reachable goals of
            each start in order.

        Raises
        ------
        InvalidValueError
            When a coordinate is not finite, a closed item is not on the map, or `nearest` is no
            whole number from 1 on.

        Examples
        --------
        >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
        >>> planner = hn.HybridPlanner(topology)
        >>> planner.distances([(0.5, 0.5), (1.5, 0.5)], [(0.5, 0.5), (2.0, 2.5)]).round(3)
        array([[0.   , 2.546],
               [1.   , 2.096]])
        """
        with self._query():
            now = self._now
            return _distances(now, (starts, goals), now.closed(blocked), nearest, progress)


def _distance(now: Planning, request: Any) -> float:
    """Return the cost of a shortest path; see `HybridPlanner.distance`."""
    query = now.query(request)
    if isinstance(query, PlanStatus):
        return math.nan
    is_plain = request.smooth == "none" or now.method.metric == "any-angle"
    if now.ompl is not None or not is_plain:
        return now.plan(request).cost
    return now.method.cost_of(query)


def _distances(
    now: Planning,
    ends: tuple[Any, Any],
    closed: ClosedCells | None,
    nearest: int | None,
    progress: Progress = no_progress,
) -> FloatArray | sparse.csr_array[Any, Any]:
    """Return the costs of shortest paths between many ends; see `HybridPlanner.distances`."""
    if nearest is not None and (
        isinstance(nearest, bool) or nearest < 1 or nearest != int(nearest)
    ):
        raise InvalidValueError(f"nearest must be a whole number from 1 on, got {nearest!r:.40}")
    points = [
        read_points(name, one)[:, :2] for name, one in zip(("starts", "goals"), ends, strict=True)
    ]
    cells = [now.grid.frame.cells_of(one) for one in points]
    (starts, start_at), (goals, goal_at) = (
        _usable(now, one, own, closed) for one, own in zip(points, cells, strict=True)
    )
    shape = len(points[0]), len(points[1])
    table = None if nearest else np.full(shape, np.nan)
    kept = _Nearest(shape, min(nearest or 1, max(shape[1], 1)))
    n_blocks, total = 0, max(1, len(starts) * len(goals))
    for rows, columns, lengths in _blocks(now, (starts, goals), closed):
        at, to = start_at[rows], goal_at[columns]
        if table is None:
            kept.add(at, to, lengths)
        else:
            table[np.ix_(at, to)] = lengths
        n_blocks += lengths.size
        progress(n_blocks, total)
    return kept.matrix() if table is None else table


def _usable(
    now: Planning, points: FloatArray, cells: LongArray, closed: ClosedCells | None
) -> tuple[FloatArray, LongArray]:
    """Return the points that a robot can stand on, and their places."""
    able = now.grid.enterable(allow_unexplored=now.preset.planner.allow_unexplored)
    inside = ((cells >= 0) & (cells < able.shape)).all(axis=1)
    good: BoolArray = np.zeros(len(cells), np.bool_)
    good[inside] = able[tuple(cells[inside].T)]
    shut = now.closed_for_all(closed)
    if shut is not None:
        good[good] &= ~shut.holds(cells[good] @ np.array([able.shape[1], 1]))
    return points[good], np.flatnonzero(good)


def _blocks(
    now: Planning, ends: tuple[FloatArray, FloatArray], closed: ClosedCells | None
) -> Iterator[Block]:
    """Yield blocks of the table, in metres: by labels, or pair by pair."""
    labels = None
    if closed is None and now.ompl is None and now.costs.layer is None:
        labels = now.method.labels()
    if labels is None:
        yield from _pair_by_pair(now, ends, closed)
        return
    from hybridnav.search.distance_table import distance_blocks  # noqa: PLC0415 - loads kernels

    frame = now.grid.frame
    starts, goals = ((frame.cells_of(one), frame.positions_of(one)) for one in ends)
    for rows, columns, lengths in distance_blocks(labels, starts, goals):
        yield rows, columns, lengths * frame.resolution_m


def _pair_by_pair(
    now: Planning, ends: tuple[FloatArray, FloatArray], closed: ClosedCells | None
) -> Iterator[Block]:
    """Yield rows of the table by plans of their pairs."""
    starts, goals = ends
    step = max(1, _PAIRS // max(len(goals), 1))
    for first in range(0, len(starts), step):
        some = starts[first : first + step]
        pairs = some.repeat(len(goals), axis=0), np.tile(goals, (len(some), 1))
        cost = now.plan_many(pairs, None, closed).cost.reshape(len(some), len(goals))
        yield slice(first, first + len(some)), slice(0, len(goals)), cost


class _Nearest:
    """The least entries of each row of a table that comes in blocks."""

    def __init__(self, shape: tuple[int, int], count: int) -> None:
        self._shape, self._count = shape, count
        self._cost = np.full((shape[0], count), np.inf)
        self._to = np.zeros((shape[0], count), np.int64)

    def add(self, rows: LongArray, columns: LongArray, lengths: FloatArray) -> None:
        """Take a block."""
        cost = np.concatenate([self._cost[rows], lengths], axis=1)
        to = np.concatenate([self._to[rows], np.tile(columns, (len(rows), 1))], axis=1)
        best = np.argsort(cost, axis=1, kind="stable")[:, : self._count]
        self._cost[rows] = np.take_along_axis(cost, best, axis=1)
        self._to[rows] = np.take_along_axis(to, best, axis=1)

    def matrix(self) -> sparse.csr_array[Any, Any]:
        """Return the finite ones, nearest first in each row."""
        from scipy import sparse  # noqa: PLC0415 - plans do not need it

        kept = np.isfinite(self._cost)
        begin = np.concatenate([[0], np.cumsum(kept.sum(axis=1))])
        return sparse.csr_array((self._cost[kept], self._to[kept], begin), shape=self._shape)
