"""Solution of one problem by one planner of OMPL; imported by the worker alone."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from ompl import base, geometric

from hybridnav.errors import OmplError
from hybridnav.refine.ompl.settings import PARAMETERS, REAL, ROADMAPS

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._base.typing import FloatArray
    from hybridnav.refine.ompl import OmplSettings
    from hybridnav.refine.ompl.client import Search
    from hybridnav.refine.ompl.spaces import StateSpace


IMPROVING = frozenset({"RRTstar", "InformedRRTstar", "BITstar", "PRMstar"})
"""Planners that continue after the first solution."""
NEAR = 1e-6
"""Distance from the goal, in metres and radians, below which a path ends there."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A problem from one state to another."""

    space: StateSpace
    """State space with its checks and bounds."""
    start: FloatArray
    """float64 (3,)."""
    goal: FloatArray
    objective: Any
    """Objective of OMPL."""
    enough: float = math.inf
    """Cost at which a planner that improves paths may stop; infinity: at the first path."""


@dataclass(frozen=True, eq=False)
class Searched:
    """Result of a planner."""

    points: FloatArray
    """float64 (n, 3), as returned by `StateSpace.driven`; without rows if no path was found."""
    is_exact: bool
    """Whether the path ends at the goal."""


def solve(
    problem: Problem,
    settings: OmplSettings,
    is_spent: Callable[[], bool],
    *,
    on_path: Callable[[FloatArray], None] | None = None,
    search: Search | None = None,
) -> Searched:
    """Solve a problem by the planner of the settings.

    Parameters
    ----------
    problem
        The problem.
    settings
        Planner and parameters.
    is_spent
        Called once an iteration; True ends the search.
    on_path
        Called with each better path of a planner that continues, float64 (n, 3).
    search
        Receives the motions of tree or roadmap.
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
        _grow(planner, definition, problem, is_spent, on_path)
    elif settings.planner in IMPROVING and on_path is not None:
        _improve(planner, definition, problem, is_spent, on_path)
    else:
        planner.solve(base.PlannerTerminationCondition(is_spent))
    if search is not None:
        _note_edges(space, planner, search)
    return _found(problem, definition)


def make(settings: OmplSettings, information: Any) -> Any:
    """Return a planner with its parameters.

    Raises
    ------
    OmplError
        When OMPL refuses one of them together with the others.
    """
    planner = getattr(geometric, settings.planner)(information)
    setters = PARAMETERS[settings.planner]
    if settings.space == "differential" and "range" in setters:
        # A state part of the way has an intermediate heading, in which a long robot rarely fits.
        planner.setRange(information.getStateSpace().getMaximumExtent())
    # BIT* refuses just-in-time sampling while it uses k nearest neighbours.
    ordered = sorted(settings.parameters.items(), key=lambda item: item[0] != "use_k_nearest")
    for name, value in ordered:
        getattr(planner, setters[name])(float(value) if name in REAL else value)
    for name, value in ordered:
        taken = getattr(planner, f"get{setters[name].removeprefix('set')}")()
        if taken != value:
            raise OmplError(
                f"planner.ompl.parameters: {settings.planner} does not take {name}: {value} "
                f"together with the others; it keeps {taken}"
            )
    return planner


_FIRST_SLICE, _MOST_SLICE = 64, 1 << 20
"""Iterations after which a planner that continues is asked for its path; twice as many each
time."""
_WORTH = 0.01
"""Share by which a path must be shorter to be fetched at once."""


def _improve(
    planner: Any,
    definition: Any,
    problem: Problem,
    is_spent: Callable[[], bool],
    on_path: Callable[[FloatArray], None],
) -> None:
    """Run a planner slice by slice, so that its paths are known even if it must be killed."""
    best, size, over = math.inf, _FIRST_SLICE, False
    best_cost = planner.bestCost
    while not over:
        left, worth = size, best * (1 - _WORTH)

        def ended(worth: float = worth) -> bool:
            nonlocal left, over
            left -= 1
            over = is_spent()
            return over or left < 0 or best_cost().value() < worth

        planner.solve(base.PlannerTerminationCondition(ended))
        found = _found(problem, definition)
        if found.is_exact:
            best = best_cost().value()
            on_path(found.points)
        # A planner that ends by itself has nothing left to do.
        over = over or best <= problem.enough or left == size
        size = min(2 * size, _MOST_SLICE)


_FIRST_GROWTH, _MOST_GROWTH = 25, 5000
"""Iterations by which a roadmap grows before it is asked for a path; twice as many each time."""
_ASK_S = 0.001


def _grow(
    planner: Any,
    definition: Any,
    problem: Problem,
    is_spent: Callable[[], bool],
    on_path: Callable[[FloatArray], None] | None,
) -> None:
    """Grow a roadmap and ask it for paths, in turn.

    `solve` of PRM looks for paths in a thread of its own, which asks the termination condition: a
    condition in Python would wait there forever, because the bindings never release the
    interpreter. So roadmaps grow under conditions in Python and are queried under conditions by the
    clock.
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
        found = _found(problem, definition)
        if found.is_exact:
            cost = definition.getSolutionPath().cost(problem.objective).value()
            if cost < best and on_path is not None:
                on_path(found.points)
            best = min(cost, best)
            over = over or cost <= problem.enough
        growth = min(2 * growth, _MOST_GROWTH)


def _found(problem: Problem, definition: Any) -> Searched:
    path = definition.getSolutionPath() if definition.hasSolution() else None
    if path is None:
        return Searched(np.empty((0, 3)), is_exact=False)
    points = problem.space.driven(problem.space.points(path.getStates()))
    if not len(points):
        return Searched(points, is_exact=False)
    # OMPL's own flag is wrong for roadmaps that grew after a first answer.
    off = points[-1] - problem.goal
    turned = 0.0 if problem.space.dimension == 2 else math.remainder(off[2], math.tau)  # noqa: PLR2004
    return Searched(points, is_exact=bool(math.hypot(off[0], off[1]) + abs(turned) <= NEAR))


def _note_edges(space: StateSpace, planner: Any, search: Search) -> None:
    data = base.PlannerData(space.information)
    planner.getPlannerData(data)
    count = data.numVertices()
    points = space.points([data.getVertex(index).getState() for index in range(count)])
    for tail in range(count):
        heads = data.getEdges(tail)
        search.edges.extend((*points[tail, :2], *points[head, :2]) for head in heads)
