"""What a planner says beside its paths: distances of pairs and tables, and reasons."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError, renamed
from hybridnav.maps.costs import CostLayer
from hybridnav.planning.endpoints import directed, read_points
from hybridnav.planning.planning import Planning
from hybridnav.search.found import ClosedCells, Query

if TYPE_CHECKING:
    from scipy import sparse

    from hybridnav.closures.blocked import Closable
    from hybridnav.closures.one_way import OneWayLike
    from hybridnav.planning import HybridPlanner, Path, PlanBatch
    from hybridnav.planning.private_rooms import Privacy
    from hybridnav.reasons import Explanation

    Block = tuple[slice, slice, FloatArray]
    Planned = Callable[[tuple[FloatArray, FloatArray]], PlanBatch]

_WORTH = 1000
"""Least number of pairs round closures for which a hierarchy without these cells is built."""
_PAIRS = 4096
"""Pairs that are planned at a time where there are no labels."""


@dataclass(frozen=True)
class Unanswered:
    """What the reasons of a query without a path are found from."""

    now: Planning
    """How it was planned."""
    ends: tuple[Any, Any]
    """Start and goal, `(x, y)` or `(x, y, yaw)`, metres, map frame."""
    closed: Closable | ClosedCells | None

    def __call__(self, radius_m: float | None = None) -> Explanation:
        """Find the reasons, for a robot of a radius in metres; None for the map's."""
        from hybridnav.reasons.why import reasons_of  # noqa: PLC0415 - plans need no shapely

        return reasons_of(self.now, self.ends, self.closed, radius_m=radius_m)


class Questions:
    """What a planner says beside its paths; a part of `HybridPlanner`."""

    _now: Planning
    _privacy: Privacy | None
    _query: Callable[[], AbstractContextManager[bool]]
    _closing: Callable[..., Closable | ClosedCells | None]
    plan_many: Callable[..., PlanBatch]

    @property
    def given_costs(self) -> CostLayer | None:
        """The costs that were given to the planner, beside those of its preset."""
        return self._now.costs.given

    def distance(
        self,
        start: ArrayLike | str,
        goal: ArrayLike | str,
        *,
        blocked: Closable | ClosedCells | None = None,
        one_way: OneWayLike | None = None,
    ) -> float:
        """Return the cost that a plan would have, and nothing else.

        Parameters
        ----------
        start, goal, blocked, one_way
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
            now, closed = self._now, self._closing([start, goal], directed(blocked, one_way))
            return _distance(now, now.read(start, goal, closed))

    def path_between(
        self, start: ArrayLike | str, goal: ArrayLike | str, blocked: Closable | ClosedCells | None
    ) -> Path | None:
        """Return the path of a plan, and no word of why there is none."""
        with self._query():
            now, closed = self._now, self._closing([start, goal], blocked)
            return now.plan(now.read(start, goal, closed)).path

    def asked(
        self,
        start: ArrayLike | str,
        goal: ArrayLike | str,
        blocked: Closable | ClosedCells | None,
    ) -> Unanswered:
        """Return what the reasons of a query are found from; see `hybridnav.explain`."""
        with self._query():
            now, closed = self._now, self._closing([start, goal], blocked)
            return Unanswered(now, now.read(start, goal, closed, "point").poses, closed)

    def explain(
        self,
        start: ArrayLike | str,
        goal: ArrayLike | str,
        *,
        blocked: Closable | ClosedCells | None = None,
        radius_m: float | None = None,
    ) -> Explanation:
        """Return `hybridnav.explain(planner, start, goal, ...)`: write that."""
        renamed("HybridPlanner.explain(...)", "hybridnav.explain(planner, ...)")
        from hybridnav.reasons import explain  # noqa: PLC0415 - an old name alone needs it

        return explain(cast("HybridPlanner", self), start, goal, blocked=blocked, radius_m=radius_m)

    def distances(  # noqa: PLR0913 - all but two have defaults
        self,
        starts: ArrayLike,
        goals: ArrayLike,
        *,
        nearest: int | None = None,
        blocked: Closable | ClosedCells | None = None,
        one_way: OneWayLike | None = None,
        progress: Progress = no_progress,
    ) -> Any:
        """Return the costs of plans from all starts to all goals, exactly.

        With lengths they come from labels of the ends in a hierarchy, less than a microsecond a
        pair on a building; with closures in one of the map without these cells, for a thousand
        pairs or more. With costs `grid-astar` searches once from each start. `robot`, `paper`, OMPL
        and paths that are smoothed are planned pair by pair.

        Parameters
        ----------
        starts, goals
            `(x, y)` in metres, map frame, shape (n, 2) and (m, 2).
        nearest
            Number of goals to keep for each start; None for all.
        blocked, one_way
            As in `plan`. The costs there and back may differ then.
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
               [1.   , 2.125]])
        """
        wanted, blocked = (nearest, progress), directed(blocked, one_way)
        if self._privacy is not None:  # each pair has private rooms of its own

            def planned(pairs: tuple[FloatArray, FloatArray]) -> PlanBatch:
                return self.plan_many(*pairs, blocked=blocked)

            return _distances(self._now, (starts, goals), None, wanted, planned)
        with self._query():
            return _distances(self._now, (starts, goals), self._now.closed(blocked), wanted)


def _distance(now: Planning, query: Query) -> float:
    """Return the cost of a shortest path; see `HybridPlanner.distance`."""
    if query.refused is not None:
        return math.nan
    if not now.is_plain:
        return now.plan(query).cost
    return now.method.find(query).cost_m


def _distances(
    now: Planning,
    ends: tuple[Any, Any],
    closed: ClosedCells | None,
    wanted: tuple[int | None, Progress],
    planned: Planned | None = None,
) -> FloatArray | sparse.csr_array[Any, Any]:
    """Return the costs of shortest paths between many ends; see `HybridPlanner.distances`.

    With `planned` each pair is planned by it.
    """
    nearest, progress = wanted
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
    is_whole = (len(starts), len(goals)) == shape
    n_blocks, total = 0, max(1, len(starts) * len(goals))
    for rows, columns, lengths in _blocks(now, (starts, goals), closed, planned):
        at, to = start_at[rows], goal_at[columns]
        if table is None:
            kept.add(at, to, lengths)
        else:
            table[(rows, columns) if is_whole else np.ix_(at, to)] = lengths
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
    shut = now.costs.closing(closed)
    if shut is not None:
        good[good] &= ~shut.holds(cells[good] @ np.array([able.shape[1], 1]))
    return points[good], np.flatnonzero(good)


def _blocks(
    now: Planning,
    ends: tuple[FloatArray, FloatArray],
    closed: ClosedCells | None,
    planned: Planned | None,
) -> Iterator[Block]:
    """Yield blocks of the table, in metres: by labels, or pair by pair."""
    labels, is_worth = None, closed is None or len(ends[0]) * len(ends[1]) >= _WORTH
    if planned is None and now.is_plain and is_worth:
        labels = now.method.labels(closed)
    if labels is None:
        yield from _pair_by_pair(
            ends, planned or (lambda pairs: now.plan_many(pairs, None, closed))
        )
        return
    from hybridnav.search.distance_table import distance_blocks  # noqa: PLC0415 - loads kernels

    frame = now.grid.frame
    starts, goals = ((frame.cells_of(one), frame.positions_of(one)) for one in ends)
    for rows, columns, lengths in distance_blocks(labels, starts, goals):
        yield rows, columns, lengths * frame.resolution_m


def _pair_by_pair(ends: tuple[FloatArray, FloatArray], planned: Planned) -> Iterator[Block]:
    """Yield rows of the table by plans of their pairs."""
    starts, goals = ends
    step = max(1, _PAIRS // max(len(goals), 1))
    for first in range(0, len(starts), step):
        some = starts[first : first + step]
        pairs = some.repeat(len(goals), axis=0), np.tile(goals, (len(some), 1))
        cost = planned(pairs).cost.reshape(len(some), len(goals))
        yield slice(first, first + len(some)), slice(0, len(goals)), cost


class _Nearest:
    """The least entries of each row of a table that comes in blocks."""

    def __init__(self, shape: tuple[int, int], count: int) -> None:
        self._shape, self._count = shape, count
        self._cost = np.full((shape[0], count), np.inf)
        self._to = np.zeros((shape[0], count), np.int64)

    def add(self, rows: LongArray, columns: LongArray, lengths: FloatArray) -> None:
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
