"""One problem given to one planner of OMPL."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from ompl import base, geometric

from hybridnav.config.ompl import PARAMETERS, REAL

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._typing import FloatArray
    from hybridnav.config import OmplSettings
    from hybridnav.refine.ompl.messages import Search
    from hybridnav.refine.ompl.spaces import StateSpace

ROADMAPS = frozenset({"PRM", "PRMstar"})
IMPROVING = frozenset({"RRTstar", "InformedRRTstar", "BITstar", "PRMstar"})
"""Planners that go on after the first solution."""
NEAR = 1e-6
"""A path that ends nearer to the goal than this, metres and radians, ends there."""


@dataclass(frozen=True, eq=False)
class Problem:
    """From one state to another."""

    space: StateSpace
    """With its checks and bounds."""
    start: FloatArray
    """float64 (3,)."""
    goal: FloatArray
    objective: Any
    """Of OMPL."""
    enough: float = math.inf
    """Cost at which a planner that improves paths may stop; infinity: at the first path."""


@dataclass(frozen=True, eq=False)
class Found:
    """What a planner found."""

    points: FloatArray
    """float64 (n, 3); without rows where it found nothing."""
    is_exact: bool
    """Whether the path ends at the goal."""


def solve(
    problem: Problem,
    settings: OmplSettings,
    is_spent: Callable[[], bool],
    *,
    on_cost: Callable[[float], None] | None = None,
    search: Search | None = None,
) -> Found:
    """Give a problem to the planner of the settings.

    Parameters
    ----------
    problem
        What is to be solved.
    settings
        Planner and parameters.
    is_spent
        Asked once an iteration; ends the search.
    on_cost
        Called with the cost of each better path, where the planner tells it.
    search
        Where the motions of tree or roadmap are noted.
    """
    space = problem.space
    problem.objective.setCostThreshold(base.Cost(min(problem.enough, 1e300)))
    definition = base.ProblemDefinition(space.information)
    definition.setStartAndGoalStates(space.state(problem.start), space.state(problem.goal))
    definition.setOptimizationObjective(problem.objective)
    planner = make(settings, space.information)
    planner.setProblemDefinition(definition)
    planner.setup()
    if settings.planner in ROADMAPS:
        _grow(planner, definition, problem, is_spent, on_cost)
    else:
        condition = base.PlannerTerminationCondition(_watched(planner, is_spent, on_cost))
        planner.solve(condition)
    if search is not None:
        _note_edges(space, planner, search)
    return _found(problem, definition)


def make(settings: OmplSettings, information: Any) -> Any:
    """A planner with its parameters."""
    planner = getattr(geometric, settings.planner)(information)
    # Just-in-time sampling is refused while BIT* takes k nearest neighbours.
    ordered = sorted(settings.parameters.items(), key=lambda item: item[0] != "use_k_nearest")
    for name, value in ordered:
        set_value = getattr(planner, PARAMETERS[settings.planner][name])
        set_value(float(value) if name in REAL else value)
    return planner


def _watched(
    planner: Any, is_spent: Callable[[], bool], on_cost: Callable[[float], None] | None
) -> Callable[[], bool]:
    """A stopper that tells of better paths."""
    if on_cost is None or not hasattr(planner, "bestCost"):
        return is_spent
    best_cost = planner.bestCost
    best = math.inf

    def watched() -> bool:
        nonlocal best
        cost = best_cost().value()
        if cost < best:
            best = cost
            on_cost(cost)
        return is_spent()

    return watched


_FIRST_GROWTH, _MOST_GROWTH = 25, 5000
"""Iterations by which a roadmap grows before it is asked for a path; twice as many each time."""
_ASK_S = 0.001


def _grow(
    planner: Any,
    definition: Any,
    problem: Problem,
    is_spent: Callable[[], bool],
    on_cost: Callable[[float], None] | None,
) -> None:
    """Grow a roadmap and ask it for paths, in turn.

    `solve` of PRM looks for paths in a thread of its own, which asks the termination condition: a
    condition in Python would wait there for ever, because the bindings never release the
    interpreter. So roadmaps grow under conditions in Python and are asked under ones by the clock.
    """
    best, growth, over = math.inf, _FIRST_GROWTH, False
    while not over:
        left = growth

        def grown() -> bool:
            nonlocal left, over
            left -= 1
            over = is_spent()
            return over or left < 0

        planner.growRoadmapPtc(base.PlannerTerminationCondition(grown))
        planner.solve(base.timedPlannerTerminationCondition(_ASK_S))
        if _found(problem, definition).is_exact:
            cost = definition.getSolutionPath().cost(problem.objective).value()
            if cost < best and on_cost is not None:
                on_cost(cost)
            best = min(cost, best)
            over = over or cost <= problem.enough
        growth = min(2 * growth, _MOST_GROWTH)


def _found(problem: Problem, definition: Any) -> Found:
    path = definition.getSolutionPath() if definition.hasSolution() else None
    if path is None:
        return Found(np.empty((0, 3)), is_exact=False)
    points = problem.space.points(path.getStates())
    # OMPL's own flag is wrong for roadmaps that grew after a first answer.
    off = points[-1] - problem.goal
    turned = 0.0 if problem.space.dimension == 2 else math.remainder(off[2], math.tau)  # noqa: PLR2004
    return Found(points, is_exact=bool(math.hypot(off[0], off[1]) + abs(turned) <= NEAR))


def _note_edges(space: StateSpace, planner: Any, search: Search) -> None:
    data = base.PlannerData(space.information)
    planner.getPlannerData(data)
    count = data.numVertices()
    points = space.points([data.getVertex(index).getState() for index in range(count)])
    for tail in range(count):
        heads = data.getEdges(tail)
        search.edges.extend((*points[tail, :2], *points[head, :2]) for head in heads)
