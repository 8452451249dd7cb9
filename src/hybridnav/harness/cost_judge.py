"""Costs of answers, counted anew, and their optima by the judges' own Dijkstra."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.costs import cost_along
from hybridnav.harness.contradictions import ANY_ANGLE_SLACK, SLACK
from hybridnav.metrics import CheapestCost

if TYPE_CHECKING:
    from hybridnav._typing import LongArray
    from hybridnav.baselines import MethodResult
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
            cost_m, slack = cost_along(self._grid, self._layer, line.points), ANY_ANGLE_SLACK
            bound_m = line.lower_bound_m
        else:
            assert answer.cells is not None  # noqa: S101 - the answer is a path
            cost_m, slack = self._cost_of_cells(answer.cells), SLACK
            bound_m = length_m / answer.bound
        faults = []
        if claim is not None:
            bound_m = claim.lower_bound_m
            if not abs(claim.cost_m - cost_m) <= slack * cost_m:
                faults.append(f"the cost is {cost_m:.6f} m, not {claim.cost_m:.6f} m as reported")
            if not bound_m <= cost_m * (1 + slack):
                faults.append(
                    f"the lower bound on costs {bound_m:.6f} m is above the cost {cost_m:.6f} m"
                )
        known = {"cost_m": cost_m, "cost_lower_bound_m": bound_m if bound_m >= 0 else 0.0}
        return known if math.isfinite(bound_m) else known | {"cost_lower_bound_m": None}, faults

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
