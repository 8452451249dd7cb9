"""Costs of answers, counted anew, and their optima by the judges' own Dijkstra."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.costs import cost_along
from hybridnav.harness.contradictions import ANY_ANGLE_SLACK, ARC_SLACK, SLACK
from hybridnav.metrics import CheapestCost, chords_of

if TYPE_CHECKING:
    from hybridnav._typing import LongArray
    from hybridnav.baselines import AnyAngleResult, MethodResult
    from hybridnav.costs import CostLayer
    from hybridnav.grid import OccupancyGrid
    from hybridnav.harness.pairs import Pair
    from hybridnav.harness.records import Record


class CostJudge:
    """Judge of the costs of answers on one map.

    A path is judged by its own integral of factors, whether or not its method planned by costs. No
    factor is below 1, so that a proved bound on lengths is one on costs too: it is recorded for
    methods that state none on costs.

    Parameters
    ----------
    grid
        The map.
    layer
        Costs of its cells.
    """

    def __init__(self, grid: OccupancyGrid, layer: CostLayer) -> None:
        self._grid, self._layer = grid, layer

    @cached_property
    def _cheapest(self) -> CheapestCost:
        return CheapestCost(self._grid, self._layer)

    @cached_property
    def _shortest(self) -> CheapestCost:
        return CheapestCost(self._grid)

    def judged(self, answer: MethodResult, length_m: float) -> tuple[Record, list[str]]:
        """Return the fields that the record of a legal path has with costs, and faults of its
        claims.

        Parameters
        ----------
        answer
            The answer, whose path has no fault.
        length_m
            The length of the path, counted anew.
        """
        line, claim = answer.any_angle, answer.by_costs
        if line is not None:
            cost_m, slack_m = self._cost_of_line(line)
            bound_m = line.lower_bound_m
        else:
            assert answer.cells is not None  # noqa: S101 - the answer is a path
            cost_m = self._cost_of_cells(answer.cells)
            bound_m, slack_m = length_m / answer.bound, SLACK * cost_m
        faults = []
        of_cells: Record = {}
        if claim is not None:
            bound_m = claim.lower_bound_m
            if not abs(claim.cost_m - cost_m) <= slack_m:
                faults.append(f"the cost is {cost_m:.6f} m, not {claim.cost_m:.6f} m as reported")
            if not bound_m <= cost_m + slack_m:
                faults.append(
                    f"the lower bound on costs {bound_m:.6f} m is above the cost {cost_m:.6f} m"
                )
            if claim.grid_bound_m is not None:
                of_cells = {"cost_grid_bound_m": claim.grid_bound_m}
                if not 0 <= claim.grid_bound_m < math.inf:
                    faults.append(f"{claim.grid_bound_m} m is no lower bound on paths of cells")
        known: Record = {"cost_m": cost_m, "cost_lower_bound_m": bound_m if bound_m >= 0 else 0.0}
        if not math.isfinite(bound_m):
            known["cost_lower_bound_m"] = None
        return known if faults else known | of_cells, faults

    def _cost_of_line(self, line: AnyAngleResult) -> tuple[float, float]:
        """Return the cost of an any-angle path, and by how much a claim may differ, in metres."""
        if line.headings_rad is None:
            cost_m = cost_along(self._grid, self._layer, line.points)
            return cost_m, ANY_ANGLE_SLACK * cost_m
        chords = chords_of(self._grid, line.points, line.headings_rad)
        cost_m = cost_along(self._grid, self._layer, chords.points)
        return cost_m, ARC_SLACK * cost_m + chords.cost_slack_m(self._grid, self._layer)

    def optima(self, pair: Pair, *, is_path: bool) -> tuple[Record, list[str]]:
        """Return the least cost and the least length of paths of cells, and the contradiction of
        the reference by them."""
        cost_m = self._cheapest.cost_m(pair.start, pair.goal)
        if is_path != math.isfinite(cost_m):
            return {}, ["solvability: Dijkstra's algorithm on the costs contradicts the reference"]
        if not is_path:
            return {}, []
        length_m = self._shortest.cost_m(pair.start, pair.goal)
        return {"weighted_m": cost_m, "octile_m": length_m}, []

    def _cost_of_cells(self, cells: LongArray) -> float:
        """Return the cost of a legal path of cells in metres, move by move."""
        factors = self._layer.factors[cells[:, 0], cells[:, 1]].astype(np.float64)
        steps = np.diff(cells, axis=0)
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        costs = lengths * (factors[:-1] + factors[1:]) / 2
        return math.fsum(costs.tolist()) * self._grid.resolution_m
