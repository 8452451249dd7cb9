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
_SPLINES, _LEAST_MOVE = 3, 1e-4
"""Rounds of subdivision, each of which doubles the states, and the least share of the length by
which a state must move."""


def simplify(
    space: StateSpace,
    points: FloatArray,
    budget: Budget,
    objective: Objective,
    on_better: Callable[[FloatArray, float], None],
) -> FloatArray:
    """Shorten a path by rounds of PathSimplifier, until they gain nothing or the time is up.

    Parameters
    ----------
    space
        State space with the checks of the whole corridor.
    points
        float64 (n, 3), a valid path.
    budget
        The budget of the query.
    objective
        Cost of a path.
    on_better
        Called with each better path and its cost.
    """
    simplifier = Simplifier(space, objective)
    cost, fruitless, shift = objective.cost(points), 0, 0
    while len(points) > 2 and fruitless < _FRUITLESS and budget.left() > 0:  # noqa: PLR2004
        before = cost
        points = _round(simplifier, points, budget, shift)
        cost = objective.cost(points)
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

    Parameters
    ----------
    space
        State space with the checks.
    objective
        Cost of a path.
    """

    def __init__(self, space: StateSpace, objective: Objective) -> None:
        self._space = space
        self._objective = objective
        self._own = objective.of(space)
        self._simplifier = geometric.PathSimplifier(space.information, None, self._own)

    def shorter(self, points: FloatArray) -> FloatArray:
        """Drop states, and join points between them; return the path itself if that is in vain."""
        path = self._path_of(points)
        steps = _STEPS * len(points)
        self._simplifier.reduceVertices(path, steps, steps, 1.0)
        self._simplifier.partialShortcutPath(path, steps, steps, 0.33, _SNAP)
        return self._checked(path, points)

    def smoother(self, points: FloatArray) -> FloatArray:
        """Round the bends of a path of straight motions by B-splines, where there is room.

        Return the path itself if that is in vain. States at the corner of an obstacle stay.
        """
        path = self._path_of(points)
        least_m = _LEAST_MOVE * self._space.length(points)
        self._simplifier.smoothBSpline(path, _SPLINES, least_m)
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
        cost_of = self._objective.cost
        return found if cost_of(found) < cost_of(points) and self._space.is_valid(found) else points
