"""Costs of paths: length, or length weighted by nearness to obstacles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ompl import base

from hybridnav.config.ompl import ROADMAPS

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._typing import FloatArray
    from hybridnav.config import OmplSettings
    from hybridnav.refine.ompl.clearance import Clearance
    from hybridnav.refine.ompl.spaces import StateSpace


class Objective:
    """The objective of a query, for OMPL and for this package.

    Parameters
    ----------
    whole
        State space of the whole corridor.
    settings
        State space and planner.
    clearance
        Weight of the length; None for the length itself.
    """

    def __init__(
        self, whole: StateSpace, settings: OmplSettings, clearance: Clearance | None
    ) -> None:
        self._whole = whole
        self._clearance = clearance
        # PRM waits forever for objectives in Python: it minimises length and turns.
        turns = settings.space in {"se2", "differential"}
        self._is_own = turns and settings.planner not in ROADMAPS

    def of(self, space: StateSpace) -> Any:
        """Return the OMPL object of the objective for one state space of the query."""
        if self._clearance is not None:
            return _Line(space, self._clearance.cost)
        if self._is_own:
            return _Line(space, _length)
        return base.PathLengthOptimizationObjective(space.information)

    def cost(self, points: FloatArray) -> float:
        """Return the cost of a path of states."""
        if self._clearance is None:
            return self._whole.length(points)
        return self._clearance.cost_of(points)


def _length(x0: float, y0: float, x1: float, y1: float) -> float:
    return math.hypot(x1 - x0, y1 - y0)


class _Line(base.OptimizationObjective):  # type: ignore[misc]  # the bindings have no types
    """Cost of the base's straight lines without turns; distances bound it from below.

    OMPL's own path length counts half a metre for each radian of an SE2 path.
    """

    def __init__(
        self, space: StateSpace, cost: Callable[[float, float, float, float], float]
    ) -> None:
        super().__init__(space.information)
        self._cost = cost
        self._flat = space.dimension == 2  # noqa: PLR2004

    def _endpoints(self, first: Any, second: Any) -> tuple[float, float, float, float]:
        if self._flat:
            return first[0], first[1], second[0], second[1]
        return first.getX(), first.getY(), second.getX(), second.getY()

    def motionCost(self, first: Any, second: Any) -> Any:  # noqa: N802 - OMPL's names
        return base.Cost(self._cost(*self._endpoints(first, second)))

    def motionCostHeuristic(self, first: Any, second: Any) -> Any:  # noqa: N802
        return base.Cost(_length(*self._endpoints(first, second)))

    def stateCost(self, state: Any) -> Any:  # noqa: ARG002, N802
        return base.Cost(0.0)
