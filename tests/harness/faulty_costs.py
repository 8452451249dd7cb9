"""Methods that plan by costs, each with one planted fault, for the harness to catch."""

import math
from dataclasses import replace
from typing import Any

import numpy as np

import hybridnav as hn
from hybridnav.harness.baselines import AnyAngleResult, CostClaim, MethodResult
from hybridnav.harness.baselines.grid import GridAstar
from hybridnav.maps.costs import cost_along
from hybridnav.planning import HybridPlanner
from hybridnav.pyramid import DualGraphPyramid
from hybridnav.topology import TopologicalMap
from tests.harness.faulty_methods import length_of

Cell = tuple[int, int]


class Cheapest(GridAstar):
    """A method without a fault, for the others to derive from: A* by costs, lengths without."""

    def __init__(self, grid: hn.OccupancyGrid, *, costs: hn.CostLayer | None = None) -> None:
        super().__init__(grid, costs=costs)
        self.name = type(self).__name__
        self.grid, self.layer = grid, costs

    def solve(self, start: Cell, goal: Cell) -> MethodResult:
        answer = super().solve(start, goal)
        if answer.cells is None or answer.by_costs is None:
            return answer
        return self.changed(answer, answer.by_costs)

    def changed(self, answer: MethodResult, claim: CostClaim) -> MethodResult:  # noqa: ARG002
        return answer

    def cost_m(self, cells: Any) -> float:
        return self.layer.cost_of_cells(cells) * self.grid.resolution_m


class DearSaidOptimal(Cheapest):
    """A dearer path, to and fro at its start, with its true cost and gap 0."""

    def changed(self, answer: MethodResult, claim: CostClaim) -> MethodResult:
        assert answer.cells is not None
        if len(answer.cells) < 2:
            return answer
        cells = np.concatenate([answer.cells[:2], answer.cells])
        return replace(answer, cells=cells, by_costs=self.claimed(claim, self.cost_m(cells)))

    def claimed(self, claim: CostClaim, cost_m: float) -> CostClaim:
        return replace(claim, cost_m=cost_m, lower_bound_m=cost_m)


class DearSaidCheap(DearSaidOptimal):
    """A dearer path that claims the cost of the cheapest."""

    def claimed(self, claim: CostClaim, cost_m: float) -> CostClaim:  # noqa: ARG002
        return claim


class HonestlyDear(DearSaidOptimal):
    """A dearer path with its true cost and the right bound: no fault."""

    def claimed(self, claim: CostClaim, cost_m: float) -> CostClaim:
        return replace(claim, cost_m=cost_m)


class BoundAboveItsCost(Cheapest):
    """The cheapest path, and a bound above its cost."""

    def changed(self, answer: MethodResult, claim: CostClaim) -> MethodResult:
        return replace(answer, by_costs=replace(claim, lower_bound_m=1.01 * claim.cost_m + 0.01))


class ClaimsNothing(Cheapest):
    """The cheapest path, and claims that are no numbers."""

    def changed(self, answer: MethodResult, claim: CostClaim) -> MethodResult:  # noqa: ARG002
        return replace(answer, by_costs=CostClaim(math.nan, math.nan))


class FalseBoundOfLine(Cheapest):
    """An any-angle path, round about, whose cost it claims as the bound on all of them."""

    def changed(self, answer: MethodResult, claim: CostClaim) -> MethodResult:  # noqa: ARG002
        assert answer.cells is not None
        assert self.layer is not None
        cells = np.concatenate([answer.cells[:2], answer.cells])
        points = self.grid.frame.points_of(cells)
        cost_m = cost_along(self.grid, self.layer, points)
        line = AnyAngleResult(points, length_of(points))
        return MethodResult(None, any_angle=line, by_costs=CostClaim(cost_m, cost_m))


class WithArcs(Cheapest):
    """The cheapest path with rounded bends, and its true claims: no fault."""

    def __init__(self, grid: hn.OccupancyGrid, *, costs: hn.CostLayer | None = None) -> None:
        super().__init__(grid, costs=costs)
        topology = TopologicalMap(DualGraphPyramid.build(grid))
        self.planner = HybridPlanner(topology, preset="grid-astar", costs=costs)

    def changed(self, answer: MethodResult, claim: CostClaim) -> MethodResult:  # noqa: ARG002
        assert answer.cells is not None
        ends = self.grid.frame.points_of(answer.cells[[0, -1]])
        found = self.planner.plan(*ends, smooth="arcs")
        assert found.path is not None
        line = AnyAngleResult(
            found.path.points, found.path.length_m, headings_rad=found.path.headings_rad
        )
        own = CostClaim(found.cost, found.lower_bound, found.grid_bound)
        return self.with_fault(MethodResult(None, any_angle=line, by_costs=own), line, own)

    def with_fault(
        self,
        answer: MethodResult,
        line: AnyAngleResult,  # noqa: ARG002
        claim: CostClaim,  # noqa: ARG002
    ) -> MethodResult:
        return answer


class ArcsSaidCheap(WithArcs):
    """Arcs that claim 3 % less than their cost."""

    def with_fault(
        self, answer: MethodResult, line: AnyAngleResult, claim: CostClaim
    ) -> MethodResult:
        dear = replace(claim, cost_m=0.97 * claim.cost_m, lower_bound_m=0.0)
        return replace(answer, any_angle=line, by_costs=dear)


class ArcsAskew(WithArcs):
    """Arcs whose headings are not those of the path."""

    def with_fault(
        self, answer: MethodResult, line: AnyAngleResult, claim: CostClaim
    ) -> MethodResult:
        assert line.headings_rad is not None
        askew = replace(line, headings_rad=line.headings_rad + 0.1)
        return replace(answer, any_angle=askew, by_costs=claim)


class ArcsSaidBelowTheGrid(WithArcs):
    """Arcs with a false bound on paths of cells."""

    def with_fault(
        self, answer: MethodResult, line: AnyAngleResult, claim: CostClaim
    ) -> MethodResult:
        assert claim.grid_bound_m is not None
        false = replace(claim, grid_bound_m=1.001 * claim.grid_bound_m + 0.001)
        return replace(answer, any_angle=line, by_costs=false)


class ArcsBoundedByNothing(WithArcs):
    """Arcs with a bound on paths of cells that is no number."""

    def with_fault(
        self, answer: MethodResult, line: AnyAngleResult, claim: CostClaim
    ) -> MethodResult:
        return replace(answer, any_angle=line, by_costs=replace(claim, grid_bound_m=math.nan))


class ByLength(GridAstar):
    """A method that knows no costs: the shortest path, proved to be."""

    def __init__(self, grid: hn.OccupancyGrid) -> None:
        super().__init__(grid)
