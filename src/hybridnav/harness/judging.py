"""Judging answers: consistency, collisions, lengths, and the reference against other optima."""

import hashlib
import math
from collections.abc import Container
from contextlib import closing, suppress
from functools import cached_property
from typing import Any

import numpy as np

from hybridnav import check_proof
from hybridnav._base.moves import path_length_in_cells
from hybridnav._base.trig import hypots
from hybridnav._base.typing import LongArray
from hybridnav.errors import InvalidValueError, UnsuitableMapError
from hybridnav.harness.adapters import HybridMethod
from hybridnav.harness.baselines import AnyAngleResult, MethodResult
from hybridnav.harness.consistency import Consistency
from hybridnav.harness.judges import (
    CheapestCost,
    Chords,
    ScipyOptimum,
    VisibilityGraph,
    chords_of,
    judge_line,
    judge_path,
    line_cells,
)
from hybridnav.harness.methods import Prepared, prepare
from hybridnav.harness.names import MethodSpec
from hybridnav.harness.records import Record
from hybridnav.harness.scenes import Pair
from hybridnav.harness.yardstick import (
    ANY_ANGLE_SLACK,
    ARC_SLACK,
    PLANNED,
    SLACK,
    AnyAngleOptimum,
    Fault,
    Kind,
    compared,
)
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.costs import CostLayer, cost_along
from hybridnav.maps.files import example_map
from hybridnav.search.grid_search import GridSearch

Cell = tuple[int, int]

STATED_SLACK, STATED_SLACK_CELLS = 1e-5, 0.0051
"""Scenario files round lengths to two decimals or six digits."""


class Judge:
    """Judge of the answers on one map. Code that the planners do not share judges paths and plans;
    only the best path inside a plan's regions is found by their grid search.

    `reference`: whether the lengths of this method are the optimum: then they are checked against
    other optima too, and any-angle lengths are recorded. With costs its costs are the optimum.
    `costs`: costs of the cells, by which paths are judged too; None for lengths; `sample`: pairs
    whose octile optimum scipy computes too, and whose any-angle optimum a search of the visibility
    graph; None for all.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        prepared: Prepared,
        *,
        reference: bool,
        costs: CostLayer | None = None,
        sample: Container[Pair] | None = None,
    ) -> None:
        self._grid, self._layer = grid, costs
        self._costs = None if costs is None else CostJudge(grid, costs)
        self._oracles = Oracles(grid, sample) if reference else None
        self._region_of = prepared.method.region_of
        self._consistency: Consistency | None = None
        self._search: GridSearch | None = None
        self.region_faults: list[tuple[str, tuple[Cell, Cell]]] = []
        if self._region_of is not None:
            own = prepared.topology if isinstance(prepared.method, HybridMethod) else None
            self._consistency = Consistency(grid, self._region_of, topology=own)
            self._has_arcs = own is not None
            self.region_faults = self._consistency.check_regions()
            free = grid.classes == CellClass.FREE
            units = None if costs is None else costs.units
            self._search = GridSearch(free, corner_cutting=grid.corner_cutting, units=units)
            self._regions = np.zeros(int(self._region_of.max(initial=-1)) + 1, dtype=np.bool_)

    def faults(
        self, pair: Pair, answer: MethodResult
    ) -> tuple[float | None, list[Fault], list[Kind]]:
        """Return the length of the path, counted anew, all faults of the answer, and what was
        checked between its plan and its path."""
        length_m, faults = self._judged_path(pair, answer)
        checked: list[Kind] = []
        if answer.proof is not None:
            checked.append("proofs")
            wrong = _false_proof(self._grid, pair, answer, length_m)
            faults += [Fault("proofs", wrong)] if wrong else []
        checks, status = self._consistency, status_of(answer)
        if checks is None:
            if status == PLANNED:
                raise InvalidValueError(
                    "a plan of regions cannot be judged where region_of is None: state the region "
                    "of each cell, or return a path"
                )
            return length_m, faults, checked
        if answer.nodes is not None:
            checked.append("plan to path")
            arcs = answer.arcs if self._has_arcs else None  # they may belong to another map
            wrong = checks.check_plan(pair.start, pair.goal, answer.nodes, arcs)
            faults += [Fault("plan to path", wrong)] if wrong else []
        there = "solved" if checks.joined(pair.start, pair.goal) else "no path"
        if not answer.gave_up and (status == "no path") != (there == "no path"):
            text = f"solvability: {status}, but on the whole grid: {there}"
            faults.append(Fault("no path", text))
        if answer.is_path and not faults:
            checked.append("path to plan")
            wrong = checks.check_walk(self._cells_of(answer))
            faults += [Fault("path to plan", wrong)] if wrong else []
        return length_m, faults, checked

    def _judged_path(self, pair: Pair, answer: MethodResult) -> tuple[float | None, list[Fault]]:
        if answer.any_angle is not None:
            line, chords = answer.any_angle, self._chords_of(answer.any_angle)
            points = line.points if chords is None else chords.points
            verdict = judge_line(self._grid, points, start=pair.start, goal=pair.goal)
            length_m = verdict.length_m if chords is None else chords.length_m
            wrong = () if chords is None else chords.faults[:1]
            of_path = [Fault("paths", text) for text in (*wrong, *verdict.faults)]
            claims = [Fault("bounds", text) for text in _false_claims(line, length_m)]
            return length_m, of_path + claims
        if answer.cells is None:
            return None, []
        verdict = judge_path(self._grid, answer.cells, start=pair.start, goal=pair.goal)
        faults = [Fault("paths", text) for text in verdict.faults]
        if not answer.bound >= 1 - SLACK:  # negated, so that it holds for NaN too
            faults.append(Fault("bounds", f"a bound is a factor of 1 or more, got {answer.bound}"))
        return verdict.length_m, faults

    def _chords_of(self, line: AnyAngleResult) -> Chords | None:
        """Return a path with arcs as a polyline, None for one of lines."""
        if line.headings_rad is None:
            return None
        return chords_of(self._grid, line.points, line.headings_rad)

    def _cells_of(self, answer: MethodResult) -> LongArray:
        if answer.any_angle is not None:
            chords = self._chords_of(answer.any_angle)
            points = answer.any_angle.points if chords is None else chords.points
            return line_cells(self._grid, points)
        assert answer.cells is not None  # noqa: S101 - the caller has looked
        return answer.cells

    def cost(self, answer: MethodResult, length_m: float | None) -> tuple[Record, list[str]]:
        """Return the cost of a legal path, counted anew, its bound, and faults of the claims about
        them; nothing in a run without costs."""
        if self._costs is None or length_m is None:
            return {}, []
        return self._costs.judged(answer, length_m)

    def oracles(
        self, answer: MethodResult, pair: Pair, length_m: float | None
    ) -> tuple[Record, list[str]]:
        """Return the other optima of a pair, and their contradictions by the reference's answer."""
        if self._oracles is None:
            return {}, []
        optima: Record = {}
        if self._costs is not None:
            optima, faults = self._costs.optima(pair, is_path=answer.is_path)
            if faults:
                return {}, faults
            length_m = optima.get("octile_m")
        figures, faults = self._oracles.ask(answer, pair, length_m)
        return optima | figures, faults

    def in_order_m(self, pair: Pair, answer: MethodResult) -> float | None:
        """Return the length of the shortest path of cells through the regions of the plan in their
        order. None by costs, for no plan, and for one that is read off a path.
        """
        checks = None if self._costs is not None else self._consistency
        was_searched = answer.expanded_nodes if answer.is_path else not answer.gave_up
        if checks is None or not answer.nodes or not was_searched:
            return None
        return (
            checks.shortest_in_order(pair.start, pair.goal, answer.nodes) * self._grid.resolution_m
        )

    def plan_optimum_m(self, pair: Pair, answer: MethodResult) -> float | None:
        """Return the length, or the cost, of the best path inside the regions of the plan; None
        without a plan, or a path there."""
        if answer.nodes is None or self._search is None:
            return None
        self._regions[list(answer.nodes)] = True
        optimum = self._search.search(
            pair.start, pair.goal, field_of=self._region_of, in_corridor=self._regions
        )
        self._regions[list(answer.nodes)] = False
        if optimum.cells is None:
            return None
        if self._layer is not None:
            return self._layer.cost_of_cells(optimum.cells) * self._grid.resolution_m
        return path_length_in_cells(optimum.cells) * self._grid.resolution_m


def status_of(answer: MethodResult) -> str:
    """Return the status of the record of an answer."""
    if answer.is_path:
        return "solved"
    return answer.gave_up or ("no path" if answer.nodes is None else PLANNED)


def _false_claims(line: AnyAngleResult, length_m: float) -> list[str]:
    """Return the false statements of a method about a path.

    The comparisons are negated so that they fail for NaN too.
    """
    wrong = []
    if not abs(line.length_m - length_m) <= SLACK * length_m:
        wrong.append(compared("the length is {}, not {} as reported", length_m, line.length_m))
    if not line.lower_bound_m <= length_m * (1 + SLACK):
        words = "the lower bound {} is above the length {}"
        wrong.append(compared(words, line.lower_bound_m, length_m))
    return wrong


def _false_proof(
    grid: OccupancyGrid, pair: Pair, answer: MethodResult, length_m: float | None
) -> str | None:
    """Return why a proof does not prove the answer to a query, None if it does."""
    proof: dict[str, Any] = answer.proof or {}
    frame = grid.frame
    free = hashlib.sha256(np.packbits(grid.enterable()).tobytes()).hexdigest()
    try:
        check_proof.check(
            grid.measured, [frame.resolution_m, *frame.origin_m, frame.yaw_rad], proof
        )
    except check_proof.Rejected as error:
        return f"the proof is rejected: {error}"
    ends = frame.cells_of([proof["start"], proof["goal"]]).tolist()
    if ends != [list(pair.start), list(pair.goal)] or proof["free_sha256"] != free:
        return "the proof is about other ends, or about another map, radius or closure"
    if (proof["kind"] == "no path") is answer.is_path:
        return "the proof contradicts the answer on whether there is a path"
    if length_m is None or proof["costs"] is not None:
        return None
    is_alike = abs(proof["cost"] - length_m) <= SLACK * length_m
    words = "the proof is about another path, of {}, not {}"
    return None if is_alike else compared(words, proof["cost"], length_m)


class Oracles:
    """Other optima of pairs: the any-angle optimum, the octile optimum of a scenario, and on a
    sample both optima by independent code."""

    def __init__(self, grid: OccupancyGrid, sample: Container[Pair] | None) -> None:
        self._grid = grid
        self._sample = () if grid.corner_cutting else sample
        self._any_angle = None if grid.corner_cutting else AnyAngleOptimum(grid)

    @cached_property
    def _scipy(self) -> ScipyOptimum:
        return ScipyOptimum(self._grid)

    @cached_property
    def _visibility(self) -> VisibilityGraph:
        return VisibilityGraph(self._grid)

    def ask(
        self, answer: MethodResult, pair: Pair, length_m: float | None
    ) -> tuple[Record, list[str]]:
        """Return fields of the record, and faults; `length_m` is the octile optimum as far as the
        reference knows it."""
        figures: Record = {}
        faults = []
        length = math.inf if length_m is None else length_m
        sampled = self._sample is None or pair in self._sample
        if sampled:
            optimum = float(self._scipy.lengths_from(pair.start)[pair.goal])
            figures["scipy_optimum_m"] = optimum if math.isfinite(optimum) else None
            if not (length == optimum or abs(length - optimum) <= SLACK * optimum):
                faults.append(compared("the optimum by scipy is {}, not {}", optimum, length))
        if pair.stated_optimum_cells is not None:
            stated = pair.stated_optimum_cells * self._grid.resolution_m
            off = STATED_SLACK_CELLS * self._grid.resolution_m + STATED_SLACK * stated
            if not abs(length - stated) <= off:
                faults.append(compared("the scenario states {}, not {}", stated, length))
        if self._any_angle is not None and answer.cells is not None and not faults:
            optimum = self._any_angle.length_m(pair.start, pair.goal)
            words = "the any-angle optimum by the mesh is {}"
            if not optimum <= length * (1 + SLACK):
                return figures, [compared(words + ", a path of cells has {}", optimum, length)]
            if sampled:
                other = self._visibility.shortest(pair.start, pair.goal).length_m
                if not abs(optimum - other) <= SLACK * other:
                    return figures, [compared(words + ", by a visibility graph {}", optimum, other)]
                figures["visibility_optimum_m"] = other
            figures["any_angle_m"] = optimum
        return figures, faults


class CostJudge:
    """Judge of the costs of answers on one map.

    A path is judged by its own integral of factors, whether or not its method planned by costs. No
    factor is below 1, so that a proved bound on lengths is one on costs too: it is recorded for
    methods that state none on costs.

    `layer`: costs of its cells.
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

        `answer`: the answer, whose path has no fault; `length_m`: the length of the path, counted
        anew.
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
            stated = claim.lower_bound_m
            bound_m = stated() if callable(stated) else stated
            if not abs(claim.cost_m - cost_m) <= slack_m:
                words = "the cost is {}, not {} as reported"
                faults.append(compared(words, cost_m, claim.cost_m))
            if not bound_m <= cost_m + slack_m:
                words = "the lower bound on costs {} is above the cost {}"
                faults.append(compared(words, bound_m, cost_m))
            if claim.grid_bound_m is not None:
                of_cells = {"cost_grid_bound_m": claim.grid_bound_m}
                if not 0 <= claim.grid_bound_m < math.inf:
                    faults.append(f"{claim.grid_bound_m} m is no lower bound on paths of cells")
        figures: Record = {"cost_m": cost_m, "cost_lower_bound_m": bound_m if bound_m >= 0 else 0.0}
        if not math.isfinite(bound_m):
            figures["cost_lower_bound_m"] = None
        return figures if faults else figures | of_cells, faults

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
        lengths = hypots(steps[:, 0], steps[:, 1])
        costs = lengths * (factors[:-1] + factors[1:]) / 2
        return math.fsum(costs.tolist()) * self._grid.resolution_m


def warm_up(spec: MethodSpec, *, by_costs: bool) -> None:
    """Compile or load the kernels of a method on a small map, so that no time includes it.

    A method that cannot take that map may yet take those of the run.
    """
    if (spec.digest, by_costs) in _WARM or spec.is_recorded:
        return
    grid = example_map("figure1", robot_radius_m=0)
    layer = CostLayer.clearance(grid) if by_costs else None
    with suppress(UnsuitableMapError), closing(prepare(spec, grid, layer)) as prepared:
        Judge(grid, prepared, reference=False, costs=layer)
        for goal in ((2, 2), (grid.shape[0] - 3, 12)):
            prepared.ask((2, 2), goal)()
    _WARM.add((spec.digest, by_costs))


_WARM: set[tuple[str, bool]] = set()
