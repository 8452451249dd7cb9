"""The answer to one query: corridor after corridor, until a path is found or time is up."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from ompl import base, util

from hybridnav.refine.ompl import chain
from hybridnav.refine.ompl.attempts import Attempts
from hybridnav.refine.ompl.problem import search_area_of
from hybridnav.refine.ompl.solve import IMPROVING, Problem, solve

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav.refine.ompl.client import OmplQuery, Reply
    from hybridnav.refine.ompl.problem import Base, SearchArea
    from hybridnav.refine.ompl.spaces import StateSpace


_FIRST = 0.7
"""Share of the time left in which a corridor other than the last must yield a path."""
_CHAIN = 0.5
"""Share of that for a chain of poses, before the corridor is searched as one problem."""
_SEARCHED = 0.9
"""Share of the time left for improving planners if the path is simplified afterwards."""
_ENOUGH = 1 + 1e-4
"""A path that is no longer than this times the lower bound needs no improvement."""


def answer(base: Base, query: OmplQuery, send: Callable[[Reply], None]) -> Reply:
    """Try the corridors of a query in turn and return the last reply.

    Parameters
    ----------
    base
        The map, and the worker's tables of it.
    query
        The problem.
    send
        Called with each better path.
    """
    attempts = Attempts(base, query, send)
    last = len(query.corridors) - 1
    for number, (name, fields) in enumerate(query.corridors):
        corridor = search_area_of(base, query, fields)
        _attempt(attempts, corridor, part=1.0 if number == last else _FIRST)
        if not attempts.leave(name):
            break
    return attempts.last_reply()


def _attempt(attempts: Attempts, corridor: SearchArea, *, part: float) -> None:
    whole, query, settings = attempts.enter(corridor), attempts.query, attempts.settings
    if np.array_equal(query.start, query.goal):
        attempts.better(query.start[None], 0.0)
        return
    has_legs = corridor.inside is not None and len(query.cells) > 1
    if settings.confine == "chain" and has_legs:
        # Legs between poses may be too short for a turning circle or a long robot.
        first_part = part * _CHAIN if settings.has_heading else part
        if chain.attempt(attempts, corridor, whole, part=first_part) or not settings.has_heading:
            return
    _at_once(attempts, corridor, whole, part=part)


def _at_once(attempts: Attempts, corridor: SearchArea, whole: StateSpace, *, part: float) -> None:
    """Solve the whole corridor as one problem."""
    settings = attempts.settings
    if settings.confine == "prm":
        draw_from(corridor, whole)
    improves = settings.planner in IMPROVING
    problem = Problem(
        whole,
        attempts.query.start,
        attempts.query.goal,
        attempts.objective.of(whole),
        _ENOUGH * attempts.bound_m if improves else math.inf,
    )
    share = part * (_SEARCHED if improves and settings.simplify else 1.0)
    found = solve(
        problem,
        settings,
        attempts.budget.stopper(share),
        on_path=lambda points: attempts.better(points, attempts.objective.cost(points)),
        search=attempts.search,
    )
    if found.is_exact:
        attempts.finish(whole, found.points)
    else:
        attempts.partial(found.points)


# States drawn from the cells of a corridor, for planners with a valid-state sampler.


class _CellSampler(base.ValidStateSampler):  # type: ignore[misc]  # the bindings have no types
    """Points in cells, each cell as likely as any other, with any heading."""

    def __init__(self, information: Any, corridor: SearchArea, space: StateSpace) -> None:
        super().__init__(information)
        self._cells = corridor.cells
        self._frame = corridor.grid.frame
        self._space = space
        self._random = util.RNG()

    def sample(self, state: Any) -> bool:
        """Fill a state and return whether it is valid."""
        uniform = self._random.uniformReal
        row, col = self._cells[self._random.uniformInt(0, len(self._cells) - 1)].tolist()
        x, y = self._frame.points_of_grid((row + uniform(0, 1), col + uniform(0, 1))).tolist()
        self._space.fill(state, (x, y, uniform(-math.pi, math.pi)))
        return bool(self._space.state_valid(state))

    def sampleNear(self, state: Any, near: Any, distance: float) -> bool:  # noqa: N802, ARG002
        """Fill a state anywhere: only PRM's expansion asks for near ones, and it is not used."""
        return self.sample(state)


def draw_from(corridor: SearchArea, space: StateSpace) -> None:
    """Make a space draw its valid states from the cells of a corridor."""

    def allocate(information: Any) -> _CellSampler:
        sampler = _CellSampler(information, corridor, space)
        space.keep(sampler)
        return sampler

    space.information.setValidStateSamplerAllocator(allocate)
    space.information.setup()
