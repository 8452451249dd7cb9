"""Shortening and smoothing by OMPL's PathSimplifier."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from ompl import geometric

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._typing import FloatArray
    from hybridnav.refine.ompl.budget import Budget
    from hybridnav.refine.ompl.objectives import Objective
    from hybridnav.refine.ompl.spaces import StateSpace

_LEAST_GAIN = 5e-4
"""Rounds that gain less than this part are fruitless."""
_FRUITLESS = 3
_ROUND = 50
"""Steps of a round for each state of the path, at most `_MOST`."""
_MOST = 2000


def simplify(
    space: StateSpace,
    points: FloatArray,
    budget: Budget,
    objective: Objective,
    on_better: Callable[[FloatArray, float], None],
) -> FloatArray:
    """Shorten a path by rounds of PathSimplifier, until they gain nothing or the time is over.

    Parameters
    ----------
    space
        State space with the checks of the whole corridor.
    points
        float64 (n, 3), a valid path.
    budget
        What is left.
    objective
        What a path costs.
    on_better
        Called with each better path and its cost.
    """
    best, best_cost = points, objective.cost(points)
    fruitless = 0
    simplifier = geometric.PathSimplifier(space.information, None, objective.of(space))
    while len(best) > 2 and fruitless < _FRUITLESS and budget.left() > 0:  # noqa: PLR2004
        path = _path_of(space, best)
        steps = min(_ROUND * len(best), _MOST)
        _round(space, simplifier, path, steps)
        budget.spend(steps)
        found = space.points(path.getStates())
        cost = objective.cost(found)
        fruitless = 0 if cost < best_cost * (1 - _LEAST_GAIN) else fruitless + 1
        if cost < best_cost:
            best, best_cost = found, cost
            on_better(best, best_cost)
    return best


def _round(space: StateSpace, simplifier: Any, path: Any, steps: int) -> None:
    """Drop states, join points anywhere on the path; move the states that are left."""
    simplifier.reduceVertices(path, steps, steps, 1.0)
    if space.has_straight_motions:
        simplifier.partialShortcutPath(path, steps, steps, 0.33, 0.005)
        simplifier.partialShortcutPath(path, steps, steps, 0.05, 0.005)
    simplifier.collapseCloseVertices(path, 0, 0)


def _path_of(space: StateSpace, points: FloatArray) -> Any:
    path = geometric.PathGeometric(space.information)
    state = space.information.allocState()
    for point in np.asarray(points):
        space.fill(state, point)
        path.append(state)
    return path
