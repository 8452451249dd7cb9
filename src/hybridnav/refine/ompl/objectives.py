"""What a path costs: its length, or the length weighted by nearness to obstacles."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from ompl import base

if TYPE_CHECKING:
    from hybridnav._typing import FloatArray
    from hybridnav.refine.ompl.spaces import StateSpace


class Objective:
    """The objective of a query, for OMPL and for us.

    Parameters
    ----------
    whole
        State space of the whole corridor.
    """

    def __init__(self, whole: StateSpace) -> None:
        self._whole = whole

    def of(self, space: StateSpace) -> Any:
        """The objective in OMPL's terms, for one state space of the query."""
        return base.PathLengthOptimizationObjective(space.information)

    def cost(self, points: FloatArray) -> float:
        """What a path of states costs."""
        return self._whole.length(points)
