"""Shortening and smoothing by OMPL's PathSimplifier."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import numpy as np
from ompl import geometric

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._typing import FloatArray
    from hybridnav.refine.ompl.budget import Budget
    from hybridnav.refine.ompl.objectives import Objective
    from hybridnav.refine.ompl.spaces import StateSpace

_PIECE = 16
"""States of the pieces that are simplified each for itself: PathSimplifier tries pairs of states
anywhere on the path, of which on a long one nearly all are out of sight of each other, and some of
its steps take time with the square of the states."""
_STEPS = 8
"""Steps for each state of a piece."""
_SNAP = 1e-3
_LEAST_GAIN = 5e-4
"""Rounds that gain less than this part are fruitless."""
_FRUITLESS = 3


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
    simplifier = geometric.PathSimplifier(space.information, None, objective.of(space))
    best, best_cost = points, objective.cost(points)
    fruitless, shift = 0, 0
    while len(best) > 2 and fruitless < _FRUITLESS and budget.left() > 0:  # noqa: PLR2004
        found = _round(space, simplifier, best, budget, shift)
        cost = objective.cost(found)
        fruitless = 0 if cost < best_cost * (1 - _LEAST_GAIN) else fruitless + 1
        shift = 0 if shift else _PIECE // 2
        if cost < best_cost:
            best, best_cost = found, cost
            on_better(best, best_cost)
    return best


def _round(
    space: StateSpace, simplifier: Any, points: FloatArray, budget: Budget, shift: int
) -> FloatArray:
    """Simplify piece by piece; the pieces begin at other states in every other round."""
    cuts = [0, *range(shift or _PIECE, len(points) - 1, _PIECE), len(points) - 1]
    done = [points[:1]]
    for first, last in itertools.pairwise(cuts):
        piece = points[first : last + 1]
        if len(piece) > 2 and budget.left() > 0:  # noqa: PLR2004
            piece = simplified(space, simplifier, piece)
            budget.spend(_STEPS * (last - first))
        done.append(piece[1:])
    return np.concatenate(done)


def simplified(space: StateSpace, simplifier: Any, points: FloatArray) -> FloatArray:
    """Drop states, and join points anywhere between them.

    OMPL takes parts of valid motions for valid, but a point between two others can be rounded to
    the wrong side of a corner that their line grazes: so what comes out is checked again.
    """
    path = geometric.PathGeometric(space.information)
    state = space.information.allocState()
    for point in points:
        space.fill(state, point)
        path.append(state)
    steps = _STEPS * len(points)
    simplifier.reduceVertices(path, steps, steps, 1.0)
    simplifier.partialShortcutPath(path, steps, steps, 0.33, _SNAP)
    found = space.points(path.getStates())
    return found if space.is_valid(found) else points
