"""The attempts at one query: its budget, the best path so far, and the last reply."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.refine.ompl.budget import Budget
from hybridnav.refine.ompl.messages import Reply, Search
from hybridnav.refine.ompl.objectives import Objective
from hybridnav.refine.ompl.simplify import Simplifier, simplify
from hybridnav.refine.ompl.spaces import StateSpace

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._typing import FloatArray
    from hybridnav.refine.ompl.messages import Query
    from hybridnav.refine.ompl.search_area import Base, SearchArea

_KEPT = 0.03
"""Share of the time reserved for the reply."""


class Attempts:
    """The state of one query: budget, best path so far, attempts.

    Parameters
    ----------
    base
        The map, and the worker's tables of it.
    query
        The problem.
    send
        Called with each better path.
    """

    def __init__(
        self,
        base: Base,
        query: Query,
        send: Callable[[Reply], None],
    ) -> None:
        began = time.monotonic()
        setup = base.setup
        self.setup, self.query, self.settings = setup, query, setup.settings
        kept_s = _KEPT * (query.deadline_s - began)
        self.budget = Budget(began, query.deadline_s - kept_s, setup.settings.iterations)
        self.search = Search() if query.tells_search else None
        self.bound_m = 0.0
        self._base = base
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
        self.objective = Objective(whole, self.settings, self._base.clearance)
        return whole

    def leave(self, name: str) -> bool:
        """Note the outcome of a corridor, and return whether another one may be tried."""
        outcome = self._outcome()
        self._steps.append(f"{name}: {outcome}")
        return outcome != "solved" and self.budget.left() > 0

    def last_reply(self) -> Reply:
        """Smooth the path if the settings ask for that and time is left, and return the answer."""
        if self.settings.smooth and len(self._best) > 2 and self.budget.left() > 0:  # noqa: PLR2004
            points = Simplifier(self._whole, self.objective).smoother(self._best)
            self._steps.append(f"smoothed: {'no' if points is self._best else 'yes'}")
            self.better(points, self.objective.cost(points))
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
        self.better(points, self.objective.cost(points))
        if not self.settings.simplify:
            return points
        return simplify(whole, points, self.budget, self.objective, self.better)

    def _note(self, x: float, y: float) -> None:
        assert self.search is not None  # noqa: S101 - only called where it is
        self.search.states.append((x, y))

    def _miss(self, points: FloatArray) -> float:
        if not len(points):
            return math.inf
        return float(np.hypot(*(points[-1] - self.query.goal)[:2]))

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
            length_m=self._whole.length(points),
            bound_m=self.bound_m,
            steps=tuple(self._steps),
            trace=tuple(self._trace),
            iterations=self.budget.iterations,
            is_last=is_last,
            search=self.search if is_last else None,
        )
