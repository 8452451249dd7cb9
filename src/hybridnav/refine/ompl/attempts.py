"""The attempts at one query: its budget, the best path so far, and the last reply."""

from __future__ import annotations

import itertools
import math
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from ompl import base, geometric

from hybridnav._base.trig import hypot, hypots
from hybridnav._base.typing import FloatArray
from hybridnav.refine.ompl.client import OmplQuery, Reply, Search
from hybridnav.refine.ompl.problem import Base, SearchArea
from hybridnav.refine.ompl.solve import StateSpace

_KEPT = 0.03
"""Share of the time reserved for the reply."""


class Attempts:
    """The state of one query: budget, best path so far, attempts.

    `base`: the map, and the worker's tables of it; `send`: called with each better path.
    """

    def __init__(self, base: Base, query: OmplQuery, send: Callable[[Reply], None]) -> None:
        began = time.monotonic()
        setup = base.setup
        self.setup, self.query, self.settings = setup, query, setup.settings
        kept_s = _KEPT * (query.deadline_s - began)
        self.budget = Budget(began, query.deadline_s - kept_s, setup.settings.iterations)
        self.search = Search() if query.tells_search else None
        self.bound_m = 0.0
        self._send = send
        self._steps: list[str] = []
        self._trace: list[tuple[float, float]] = []
        self._best = np.empty((0, 3))
        self._cost = math.inf
        self._near: FloatArray = np.empty((0, 3))

    def enter(self, corridor: SearchArea) -> StateSpace:
        """Begin with a corridor, and return the state space of all of it."""
        whole = self._whole = self.space(corridor, *corridor.bounds)
        self.bound_m = whole.length(np.stack([self.query.start, self.query.goal]))
        return whole

    def leave(self, name: str) -> bool:
        """Note the outcome of a corridor, and return whether another one may be tried."""
        outcome = self._outcome()
        self._steps.append(f"{name}: {outcome}")
        return outcome != "solved" and self.budget.left() > 0

    def last_reply(self) -> Reply:
        """Return the answer."""
        return self._reply(is_last=True)

    def better(self, points: FloatArray, cost: float) -> None:
        """Note a path and send it, if it is better than the best so far and free of contact.

        Not all planners check the states that they insert between others.
        """
        if cost < self._cost and self._whole.is_valid(points):
            self._best, self._cost = points, cost
            self._trace.append((self.budget.seconds(), cost))
            self._send(self._reply(is_last=False))

    def partial(self, points: FloatArray) -> None:
        """Note a path that ends elsewhere, if it ends nearer to the goal than others and the
        start."""
        least = min(self._miss(self._near), self._miss(self.query.start[None]))
        if self._miss(points) < least and self._whole.is_valid(points):
            self._near = points

    def space(self, corridor: SearchArea, low: FloatArray, high: FloatArray) -> StateSpace:
        """Return a state space of the query inside some bounds."""
        note = None if self.search is None else self._note
        return StateSpace(self.settings, corridor.check, low, high, note=note)

    def finish(self, whole: StateSpace, points: FloatArray) -> FloatArray:
        """Note a path from start to goal, simplify it, and return the result."""
        self.better(points, whole.length(points))
        if not self.settings.simplify:
            return points
        return simplify(whole, points, self.budget, self.better)

    def _note(self, x: float, y: float) -> None:
        assert self.search is not None  # noqa: S101 - only called where it is
        self.search.states.append((x, y))

    def _miss(self, points: FloatArray) -> float:
        if not len(points):
            return math.inf
        return float(hypots(*(points[-1] - self.query.goal)[:2]))

    def _outcome(self) -> Any:
        if len(self._best):
            return "solved"
        return "approximate" if len(self._near) else "timeout"

    def _reply(self, *, is_last: bool) -> Reply:
        outcome = self._outcome()
        points = self._best if outcome == "solved" else self._near
        return Reply(
            outcome,
            points,
            self._cost,
            steps=tuple(self._steps),
            trace=tuple(self._trace),
            iterations=self.budget.iterations,
            is_last=is_last,
            search=self.search if is_last else None,
        )


# Shortening by OMPL's PathSimplifier.

_SEGMENT_STATES = 16
"""States of the segments that are simplified one by one: PathSimplifier tries pairs of states
anywhere on the path, nearly all of which are out of sight of each other on a long path, and some of
its steps take quadratic time."""
_STEPS = 8
"""Steps for each state of a segment."""
_SNAP = 1e-3
_LEAST_GAIN = 5e-4
"""Share that a round must gain to count as fruitful."""
_FRUITLESS = 3


def simplify(
    space: StateSpace,
    points: FloatArray,
    budget: Budget,
    on_better: Callable[[FloatArray, float], None],
) -> FloatArray:
    """Shorten a path by rounds of PathSimplifier, until they gain nothing or the time is up.

    `space`: state space with the checks of the whole corridor; `points`: float64 (n, 3), a valid
    path; `on_better`: called with each better path and its cost.
    """
    simplifier = Simplifier(space)
    cost, fruitless, shift = space.length(points), 0, 0
    while len(points) > 2 and fruitless < _FRUITLESS and budget.left() > 0:  # noqa: PLR2004
        before = cost
        points = _round(simplifier, points, budget, shift)
        cost = space.length(points)
        fruitless = 0 if cost < before * (1 - _LEAST_GAIN) else fruitless + 1
        shift = 0 if shift else _SEGMENT_STATES // 2
        on_better(points, cost)
    return points


def _round(simplifier: Simplifier, points: FloatArray, budget: Budget, shift: int) -> FloatArray:
    """Simplify segment by segment; segments begin at other states in every other round."""
    cuts = [0, *range(shift or _SEGMENT_STATES, len(points) - 1, _SEGMENT_STATES), len(points) - 1]
    done = [points[:1]]
    for first, last in itertools.pairwise(cuts):
        segment = points[first : last + 1]
        if len(segment) > 2 and budget.left() > 0:  # noqa: PLR2004
            segment = simplifier.shorter(segment)
            budget.spend(_STEPS * (last - first))
        done.append(segment[1:])
    return np.concatenate(done)


class Simplifier:
    """OMPL's PathSimplifier, with checked results.

    OMPL assumes that parts of valid motions are valid, but a point between two others can be
    rounded to the wrong side of a corner that their line grazes.

    `space`: state space with the checks.
    """

    def __init__(self, space: StateSpace) -> None:
        self._space = space
        self._own = objective_of(space)
        self._simplifier = geometric.PathSimplifier(space.information, None, self._own)

    def shorter(self, points: FloatArray) -> FloatArray:
        """Drop states, and join points between them; return the path itself if that is in vain."""
        path = self._path_of(points)
        steps = _STEPS * len(points)
        self._simplifier.reduceVertices(path, steps, steps, 1.0)
        self._simplifier.partialShortcutPath(path, steps, steps, 0.33, _SNAP)
        return self._checked(path, points)

    def _path_of(self, points: FloatArray) -> Any:
        path = geometric.PathGeometric(self._space.information)
        state = self._space.information.allocState()
        for point in points:
            self._space.fill(state, point)
            path.append(state)
        return path

    def _checked(self, path: Any, points: FloatArray) -> FloatArray:
        found = self._space.driven(self._space.points(path.getStates()))
        cost_of = self._space.length
        return found if cost_of(found) < cost_of(points) and self._space.is_valid(found) else points


# The length as an objective of OMPL.


def objective_of(space: StateSpace) -> Any:
    """Return OMPL's object for the length of paths in a state space.

    Turns on the spot cost nothing, but with PRM, which waits forever for objectives in Python.
    """
    if space.spins and not space.is_roadmap:
        return _Line(space)
    return base.PathLengthOptimizationObjective(space.information)


class _Line(base.OptimizationObjective):  # type: ignore[misc]  # the bindings have no types
    """Cost of the base's straight lines without turns; distances bound it from below.

    OMPL's own path length counts half a metre for each radian of an SE2 path.
    """

    def __init__(self, space: StateSpace) -> None:
        super().__init__(space.information)

    def motionCost(self, first: Any, second: Any) -> Any:  # noqa: N802 - OMPL's names
        return base.Cost(hypot(second.getX() - first.getX(), second.getY() - first.getY()))

    def motionCostHeuristic(self, first: Any, second: Any) -> Any:  # noqa: N802
        return self.motionCost(first, second)

    def stateCost(self, state: Any) -> Any:  # noqa: ARG002, N802
        return base.Cost(0.0)


# Budgets: the time, or the iterations, that a query has left.


class Budget:
    """The budget of a query, counted in seconds, or in iterations if these are given.

    Only a budget in iterations is repeatable from a seed.

    `began_s`, `deadline_s`: times of `time.monotonic`; `iterations`: None to count seconds.
    """

    def __init__(self, began_s: float, deadline_s: float, iterations: int | None) -> None:
        self.began_s = began_s
        self.iterations = 0
        self._most = iterations
        self._deadline_s = deadline_s
        self._whole_s = max(deadline_s - began_s, 1e-6)

    def left(self) -> float:
        """Return the share that is left, 1 at the beginning, 0 at the end."""
        if self._most is not None:
            return max(1 - self.iterations / self._most, 0.0)
        return max((self._deadline_s - time.monotonic()) / self._whole_s, 0.0)

    def seconds(self) -> float:
        """Return the seconds since the beginning."""
        return time.monotonic() - self.began_s

    def spend(self, iterations: int) -> None:
        """Count iterations that no stopper saw."""
        self.iterations += iterations

    def stopper(self, part: float, *, most: int | None = None) -> Callable[[], bool]:
        """Return a function for planners that states whether a share of the rest is spent.

        Planners call it once an iteration.

        `part`: share of the budget left now, in (0, 1]; `most`: most iterations; None for no limit.
        """
        until = sys.maxsize if most is None else self.iterations + most
        if self._most is not None:
            until = min(until, self.iterations + max(int(part * (self._most - self.iterations)), 1))

            def is_spent() -> bool:
                self.iterations += 1
                return self.iterations > until

        else:
            now = time.monotonic()
            end = now + part * (self._deadline_s - now)
            clock = time.monotonic

            def is_spent() -> bool:
                self.iterations += 1
                return clock() >= end or self.iterations > until

        return is_spent
