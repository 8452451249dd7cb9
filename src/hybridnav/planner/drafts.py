"""Plans whose costs are known, and whose results are made only if they are wanted."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

from hybridnav.planner import PlanStatus

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav.planner import PlanResult, PlanStats
    from hybridnav.planner.cell_planner import CellPlan, CellQuery
    from hybridnav.planner.mesh_plans import OverMesh


@dataclass(frozen=True, eq=False)
class PlanDraft:
    """A plan between two waypoints, for those who compare many and want the result of few."""

    status: PlanStatus
    cost: float
    """As in `PlanResult`."""
    lower_bound: float
    stats: PlanStats
    result: Callable[[], PlanResult]
    """Makes the result."""

    @classmethod
    def of(cls, result: PlanResult) -> Self:
        """Return the draft of a result that is made already."""
        return cls(result.status, result.cost, result.lower_bound, result.stats, lambda: result)

    def __reduce__(self) -> tuple[Callable[[PlanResult], PlanDraft], tuple[PlanResult]]:
        """Make the result, with which copies travel without the planner and its map."""
        return PlanDraft.of, (self.result(),)


def draft_on_mesh(
    cells: OverMesh, query: CellQuery, result_of: Callable[[CellPlan], PlanResult]
) -> PlanDraft:
    """Return the draft of a path, whose cells are found for its result alone.

    Parameters
    ----------
    cells
        The planner of paths.
    query
        The query.
    result_of
        Makes the result of a plan.
    """
    found = cells.found(query)
    cost, path = found.length_m, found.path
    if not 0 < cost < float("inf"):
        return PlanDraft.of(result_of(cells.completed(found)))
    bound = min(cost * (path.lower_bound_cells / path.length_cells), cost)
    made = lambda: result_of(cells.completed(found))  # noqa: E731 - called once, by the caller
    return PlanDraft(PlanStatus.SOLVED, cost, bound, found.stats, made)
