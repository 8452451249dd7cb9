"""What a path costs: its length, or the length weighted by nearness to obstacles."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from ompl import base

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray
    from hybridnav.refine.ompl.clearance import Clearance
    from hybridnav.refine.ompl.spaces import StateSpace


class Objective:
    """The objective of a query, for OMPL and for us.

    Parameters
    ----------
    whole
        State space of the whole corridor.
    clearance
        What weights the length; None for the length itself.
    """

    def __init__(self, whole: StateSpace, clearance: Clearance | None) -> None:
        self._whole = whole
        self._clearance = clearance

    def of(self, space: StateSpace) -> Any:
        """The objective in OMPL's terms, for one state space of the query."""
        if self._clearance is None:
            return base.PathLengthOptimizationObjective(space.information)
        return _Weighted(space, self._clearance)

    def cost(self, points: FloatArray) -> float:
        """What a path of states costs."""
        if self._clearance is None:
            return self._whole.length(points)
        return self._clearance.cost_of(points)


class _Weighted(base.OptimizationObjective):  # type: ignore[misc]  # the bindings have no types
    """The clearance objective as OMPL asks for it; distances bound it from below."""

    def __init__(self, space: StateSpace, clearance: Clearance) -> None:
        super().__init__(space.information)
        self._cost = clearance.cost
        self._flat = space.dimension == 2  # noqa: PLR2004

    def _ends(self, first: Any, second: Any) -> tuple[float, float, float, float]:
        if self._flat:
            return first[0], first[1], second[0], second[1]
        return first.getX(), first.getY(), second.getX(), second.getY()

    def motionCost(self, first: Any, second: Any) -> Any:  # noqa: N802 - OMPL's names
        return base.Cost(self._cost(*self._ends(first, second)))

    def motionCostHeuristic(self, first: Any, second: Any) -> Any:  # noqa: N802
        x0, y0, x1, y1 = self._ends(first, second)
        return base.Cost(math.hypot(x1 - x0, y1 - y0))

    def stateCost(self, state: Any) -> Any:  # noqa: ARG002, N802
        return base.Cost(0.0)
