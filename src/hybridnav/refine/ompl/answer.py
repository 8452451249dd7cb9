"""The answer to one query: corridor after corridor, until a path is found or time is up."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.refine.ompl import chain
from hybridnav.refine.ompl.budget import Budget
from hybridnav.refine.ompl.corridor import corridor_of
from hybridnav.refine.ompl.messages import Reply, Search
from hybridnav.refine.ompl.objectives import Objective
from hybridnav.refine.ompl.planners import IMPROVING, Problem, solve
from hybridnav.refine.ompl.sampler import draw_from
from hybridnav.refine.ompl.simplify import Simplifier, simplify
from hybridnav.refine.ompl.spaces import StateSpace

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._typing import FloatArray
    from hybridnav.refine.ompl.corridor import Base, Corridor
    from hybridnav.refine.ompl.messages import Query

_KEPT = 0.03
"""Share of the time reserved for the reply."""
_FIRST = 0.7
"""Share of the time left in which a corridor other than the last must yield a path."""
_CHAIN = 0.5
"""Share of that for a chain of poses, before the corridor is searched as one problem."""
_SEARCHED = 0.9
"""Share of the time left for improving planners if the path is simplified afterwards."""
_ENOUGH = 1 + 1e-4
"""A path that is no longer than this times the lower bound needs no improvement."""


class Answering:
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

    def run(self) -> Reply:
        """Try the corridors in turn and return the last reply."""
        last = len(self.query.corridors) - 1
        for number, (name, fields) in enumerate(self.query.corridors):
            corridor = corridor_of(self._base, self.query, fields)
            self._attempt(corridor, part=1.0 if number == last else _FIRST)
            outcome = self._outcome()
            self._steps.append(f"{name}: {outcome}")
            if outcome == "solved" or self.budget.left() <= 0:
                break
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

    def space(self, corridor: Corridor, low: FloatArray, high: FloatArray) -> StateSpace:
        """Return a state space of the query inside some bounds."""
        note = None if self.search is None else self._note
        return StateSpace(self.settings, corridor.check, low, high, note=note)

    def _attempt(self, corridor: Corridor, *, part: float) -> None:
        whole = self._whole = self.space(corridor, *corridor.bounds)
        self.bound_m = whole.length(np.stack([self.query.start, self.query.goal]))
        self.objective = Objective(whole, self.settings, self._base.clearance)
        if np.array_equal(self.query.start, self.query.goal):
            self.better(self.query.start[None], 0.0)
            return
        has_legs = corridor.inside is not None and len(self.query.cells) > 1
        if self.settings.confine == "chain" and has_legs:
            # Legs between poses may be too short for a turning circle or a long robot.
            first_part = part * _CHAIN if self.settings.has_heading else part
            if chain.attempt(self, corridor, whole, part=first_part):
                return
            if not self.settings.has_heading:
                return
        self._at_once(corridor, whole, part=part)

    def _at_once(self, corridor: Corridor, whole: StateSpace, *, part: float) -> None:
        """Solve the whole corridor as one problem."""
        if self.settings.confine == "prm":
            draw_from(corridor, whole)
        improves = self.settings.planner in IMPROVING
        problem = Problem(
            whole,
            self.query.start,
            self.query.goal,
            self.objective.of(whole),
            _ENOUGH * self.bound_m if improves else math.inf,
        )
        share = part * (_SEARCHED if improves and self.settings.simplify else 1.0)
        found = solve(
            problem,
            self.settings,
            self.budget.stopper(share),
            on_path=lambda points: self.better(points, self.objective.cost(points)),
            search=self.search,
        )
        if found.is_exact:
            self.finish(whole, found.points)
        else:
            self.partial(found.points)

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
