"""What the subject `ompl` measures of a map: each planner, on the whole map and in the corridor."""

from __future__ import annotations

import hashlib
import time
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

import hybridnav as hn
from benchmarks.common import read
from benchmarks.subjects._queries_measure import (
    MOVINGAI_MERGE_DISTANCE_M,
    ROS_MERGE_DISTANCE_M,
)
from hybridnav.harness.judges import segment_faults
from hybridnav.harness.records import environment
from hybridnav.harness.scenes import map_digest, sample_pairs
from hybridnav.harness.yardstick import AnyAngleOptimum
from hybridnav.planning import load_preset
from hybridnav.planning.methods.ompl import OmplPlanner

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from hybridnav._base.typing import FloatArray, LongArray
    from hybridnav.harness.scenes import Pair
    from hybridnav.planning import PlannerSettings

Record = dict[str, Any]

MAPS = (
    "willow/willow-2010-02-18-0.10.yaml",
    "bwi_gdc/3/3.yaml",
    "strands/tsc_y4/tsc_1701.yaml",
    "radish_grids/intel.yaml",
    "nav2/maps/depot.yaml",
    "aws_small_warehouse/002/map.yaml",
    "movingai/mazes/maze512-8-5.map",
    "movingai/rooms/32room_005.map",
)
PLANNERS = ("RRTConnect", "InformedRRTstar", "BITstar")
BUDGETS_S = (0.25, 1.0, 5.0)
CONFINEMENTS = (("RRTConnect", "chain"), ("RRTConnect", "mask"), ("BITstar", "chain"),
                ("BITstar", "mask"), ("PRMstar", "chain"))  # fmt: skip
NEAR = 1.02
"""A path is near the optimum when it is no longer than this times it."""


@dataclass(frozen=True)
class Method:
    """A planner of OMPL, where it may search, and for how long."""

    planner: str
    scope: str
    """`whole map`, or how the corridor is kept: `chain` or `mask`."""
    budget_s: float

    @property
    def name(self) -> str:
        """What tables call it."""
        return f"{self.planner}, {self.scope}, {self.budget_s:g} s"

    @property
    def settings(self) -> PlannerSettings:
        """Section `planner` of its preset."""
        confine = "mask" if self.scope == "whole map" else self.scope
        ompl = f"planner: {self.planner}, confine: {confine}, budget_s: {self.budget_s}"
        return load_preset("ompl", overrides=[f"planner.ompl={{{ompl}}}"]).planner

    @cached_property
    def digest(self) -> str:
        """The same for equal settings."""
        return hashlib.sha256(self.settings.model_dump_json().encode()).hexdigest()[:12]


def methods(*, confinements: bool = False) -> list[Method]:
    """Those of the table, or those of the comparison of confinements."""
    if confinements:
        return [Method(planner, scope, 1.0) for planner, scope in CONFINEMENTS]
    return [
        Method(planner, scope, budget_s)
        for planner in PLANNERS
        for scope in ("whole map", "chain")
        for budget_s in BUDGETS_S
    ]


@dataclass(frozen=True, eq=False)
class Problem:
    """A pair of a map with its coarse path and its any-angle optimum."""

    pair: Pair
    poses: tuple[FloatArray, FloatArray]
    cells: LongArray
    best_m: float


class Bench:
    """A map with its problems, and what every method is asked with.

    Parameters
    ----------
    path
        The map's file.
    pairs, seed
        As `sample_pairs` takes them; pairs without a path are left out.
    """

    def __init__(self, path: Path, *, pairs: int, seed: int) -> None:
        is_movingai = path.suffix == ".map"
        self.grid = read(path)
        self.sha = map_digest(self.grid)
        pyramid = hn.DualGraphPyramid.build(
            self.grid,
            merge_distance_m=MOVINGAI_MERGE_DISTANCE_M if is_movingai else ROS_MERGE_DISTANCE_M,
        )
        topology = hn.TopologicalMap(pyramid)
        self._coarse = hn.HybridPlanner(topology, preset="shortest")
        optimum = AnyAngleOptimum(self.grid)
        self.problems: list[Problem] = []
        for pair in sample_pairs(self.grid, pairs, seed=seed):
            points = self.grid.frame.points_of(np.array([pair.start, pair.goal]))
            coarse = self._coarse.plan(*points)
            if coarse.path is None:
                continue
            length_m = optimum.length_m(pair.start, pair.goal)
            poses = np.column_stack([points, np.zeros(2)])
            self.problems.append(Problem(pair, (poses[0], poses[1]), coarse.path.cells, length_m))

    def planner(self, method: Method) -> OmplPlanner:
        """The planner of a method; its process runs until it is dropped."""
        whole = method.scope == "whole map"
        field_of = None if whole else self._coarse.topology.level.field_of
        settings: Any = method.settings
        return OmplPlanner(self.grid, settings, field_of)

    def records(self, method: Method, there: set[str]) -> Iterator[Record]:
        """Records of a method that are not there yet."""
        missing = [p for p in self.problems if self.record_id(method, p) not in there]
        if not missing:
            return
        planner = self.planner(method)
        planner.plan(missing[0].cells, missing[0].poses, None)  # loads what is loaded once
        for problem in missing:
            yield self._record(method, problem, planner)

    def record_id(self, method: Method, problem: Problem) -> str:
        """The same for equal map, method and pair."""
        return f"{self.sha[:12]}/{method.name}-{method.digest}/{problem.pair.key}"

    def _record(self, method: Method, problem: Problem, planner: OmplPlanner) -> Record:
        began = time.perf_counter()
        found = planner.plan(problem.cells, problem.poses, None)
        seconds = time.perf_counter() - began
        by_grid = found.refinement.by_grid
        own = found.path if not by_grid and found.status == "solved" else None
        trace = found.refinement.trace
        near = [s for s, cost in trace if cost <= NEAR * problem.best_m]
        return {
            "id": self.record_id(method, problem),
            "type": "ompl",
            "map": self.grid.name,
            "map_sha": self.sha,
            "method": method.name,
            "method_sha": method.digest,
            "planner": method.planner,
            "scope": method.scope,
            "budget_s": method.budget_s,
            "status": "line of sight" if by_grid else str(found.status),
            "steps": list(found.refinement.steps),
            "length_m": None if own is None else own.length_m,
            "fallback_m": found.path.length_m if by_grid and found.path is not None else None,
            "best_m": problem.best_m,
            "first_s": trace[0][0] if trace and own is not None else None,
            "near_s": near[0] if near and own is not None else None,
            "seconds": seconds,
            "faults": [] if own is None else list(segment_faults(self.grid, own.points)),
            "environment": environment(),
        }
