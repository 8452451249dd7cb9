"""Ways with several stops, told by rooms and doors."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.planner.closed import ClosedCells
from hybridnav.planner.itinerary import Guide, Leg, in_words
from hybridnav.planner.named import At, stop_points
from hybridnav.result import PlanStatus

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from hybridnav.planner.blocked import Closable
    from hybridnav.planner.planner import HybridPlanner, Smooth
    from hybridnav.result import Metric, PlanResult


@dataclass(frozen=True, eq=False)
class Tour:
    """A way through stops: a plan between each two, and the legs of all."""

    results: tuple[PlanResult, ...]
    """Plans from stop to stop, up to the first that is not solved."""
    legs: tuple[Leg, ...]
    """The way by rooms; none unless it is solved, or where the map has no rooms."""

    @property
    def status(self) -> PlanStatus:
        """That of the first plan that is not solved, else solved."""
        return self.results[-1].status

    @property
    def solved(self) -> bool:
        """Whether all plans are."""
        return self.status is PlanStatus.SOLVED

    @property
    def length_m(self) -> float:
        """Length of the whole way in metres, infinite unless it is solved."""
        if not self.solved:
            return math.inf
        return sum(result.path.length_m for result in self.results if result.path is not None)

    @property
    def metric(self) -> Metric:
        """The metric of the plans."""
        return self.results[0].metric

    @property
    def cost(self) -> float:
        """Cost of the whole way in the metric, infinite unless it is solved: the length, but where
        the metric weighs it."""
        return sum(result.cost for result in self.results)

    @property
    def lower_bound(self) -> float:
        """A proved bound on the cost of a way between the points of the stops, in their order."""
        return sum(result.lower_bound for result in self.results)

    def in_words(self) -> list[str]:
        """The way in sentences for a person; no lines where there are no legs."""
        return in_words(self.legs) if self.legs else []


def plan_tour(
    planner: HybridPlanner,
    stops: Sequence[ArrayLike | str],
    *,
    at: At = "anywhere",
    smooth: Smooth | None = None,
    blocked: Closable | None = None,
) -> Tour:
    """Plan a way that visits stops in the order given.

    Parameters
    ----------
    planner
        Plans each part.
    stops
        Two or more: points `(x, y)` in metres, names of rooms or of named points. With OMPL in a
        space with headings points are `(x, y, yaw)`, and names face the way.
    at
        Where in a room: `"anywhere"`, chosen for all stops together so that the whole way is
        shortest, or at the room's `"point"`.
    smooth, blocked
        As in `HybridPlanner.plan`.

    Raises
    ------
    InvalidValueError
        When there are fewer than two stops, a name is not known, a point is not two finite numbers,
        or what is blocked is not on the map.
    """
    if len(stops) < 2:  # noqa: PLR2004
        raise InvalidValueError(f"a way needs at least two stops, got {len(stops)}")
    closed = None if blocked is None else ClosedCells(planner.closed_cells(blocked))
    points = stop_points(planner, stops, at=at, blocked=closed)
    results: list[PlanResult] = []
    for pair in itertools.pairwise(points):
        results.append(planner.plan(*pair, smooth=smooth, blocked=closed))
        if not results[-1].solved:
            break
    topology = planner.topology
    legs: list[Leg] = []
    if results[-1].solved and topology.pyramid.rooms is not None:
        guide = Guide(topology.rooms)
        for result, stop in zip(results, stops[1:], strict=True):
            if result.path is not None:
                legs += guide.legs(result.path, stop=_told(stop))
    return Tour(tuple(results), tuple(legs))


def _told(stop: ArrayLike | str) -> str:
    if isinstance(stop, str):
        return stop
    x, y = np.asarray(stop, dtype=np.float64)[:2].tolist()
    return f"({x:.10g}, {y:.10g})"
