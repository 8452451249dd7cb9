"""Search methods that presets could name too, as methods of the harness."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.harness.columns import consistency_row
from hybridnav.harness.methods import baseline_spec, prepare
from hybridnav.harness.output import write_outputs
from hybridnav.harness.run import RunSettings, write_records
from hybridnav.search.found import Found, Query
from tests.harness.small_runs import ROOMS, name_of, run_here, write_map
from tests.planning.test_own_method import ByCells


class Boastful(ByCells):
    """Proves that its detours are shortest."""

    def find(self, query: Query) -> Found:
        found: Found = super().find(query)
        if not found.has_path:
            return found
        cells = found.cells
        there = np.concatenate([cells[:2], cells]) if len(cells) > 1 else cells
        return Found(there, 1.0, 1.0)


class AtAnyAngle(ByCells):
    """Claims to plan at any angle, along the cells."""

    metric = "any-angle"

    def find(self, query: Query) -> Found:
        found: Found = super().find(query)
        if not found.has_path:
            return found
        points = self.frame.points_of(found.cells)
        points = points if found.cost_m > 0 else points[:1]
        return Found(found.cells, found.cost_m, query.straight_m, points)


class Unsure(ByCells):
    """Finds nothing, and proves nothing."""

    def find(self, query: Query) -> Found:
        return Found(None, lower_bound_m=query.straight_m)


def outcome_of(method: type, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Any:
    """Ask a method six pairs in this process; return what the study makes of it."""
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)
    monkeypatch.setitem(sys.modules, "mine", sys.modules[__name__])
    settings = RunSettings(
        maps=(str(write_map(tmp_path, ROOMS)),),
        presets=(),
        baselines=(name_of(method),),
        pairs=6,
        robot_radius_m=0.0,
    )
    write_records(settings, tmp_path / "run")
    study = write_outputs(tmp_path / "run")
    (outcome,) = study.of_method(method.__name__)
    return outcome


@pytest.mark.parametrize(
    ("method", "is_faulty", "share"),
    [(ByCells, False, 1), (Boastful, True, 1), (AtAnyAngle, False, 1), (Unsure, False, 0)],
)
def test_a_search_method_is_asked_and_judged_like_any_other(
    method: type[ByCells],
    is_faulty: bool,
    share: int,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    outcome = outcome_of(method, tmp_path, monkeypatch)
    assert outcome.checks == (7 if share else 0)
    assert bool(outcome.faults) == is_faulty
    assert np.isfinite(outcome.lengths_m).any() == (share > 0 and not is_faulty)
    if method is Unsure:
        statuses = {record["status"] for record in outcome.records}
        assert statuses == {"no path, and no proof of none"}


def test_a_search_method_is_closed_at_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    closed: list[ByCells] = []

    def close(method: ByCells) -> None:
        closed.append(method)

    monkeypatch.setattr(ByCells, "close", close, raising=False)
    grid = hn.OccupancyGrid(np.zeros((3, 4), np.float32), robot_radius_m=0)
    method = prepare(baseline_spec(name_of(ByCells)), grid)
    assert method.ask((0, 0), (2, 3))().is_path
    assert not closed
    method.close()
    assert len(closed) == 1


class Proving:
    """Answers as preset octile does, with a proof."""

    metric = "octile"

    def __init__(self, grid: hn.OccupancyGrid) -> None:
        topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid))
        self.planner = hn.HybridPlanner(topology, preset="octile")

    def find(self, query: Query) -> Found:
        result = self.planner.plan(*query.points)
        cells = None if result.path is None else result.path.cells
        return Found(cells, result.cost, result.lower_bound, proof=self.proof(result))

    def proof(self, result: hn.PlanResult) -> dict[str, Any]:
        return hn.prove(result)


class ProvingTooMuch(Proving):
    """Claims a bound that is above the cost."""

    def proof(self, result: hn.PlanResult) -> dict[str, Any]:
        proof = hn.prove(result)
        return {**proof, "bound": proof.get("bound", 0) * 1.01}


class ProvingAnother(Proving):
    """Proves the answer to another query."""

    def proof(self, result: hn.PlanResult) -> dict[str, Any]:
        assert result.start is not None
        assert result.goal is not None
        return hn.prove(self.planner.plan(result.goal, result.start))


@pytest.mark.parametrize(
    ("method", "text"),
    [
        (Proving, None),
        (ProvingTooMuch, "the proof is rejected"),
        (ProvingAnother, "the proof is about other ends"),
    ],
)
def test_proofs_of_a_method_are_checked_and_counted(method, text, tmp_path, monkeypatch):
    outcome = outcome_of(method, tmp_path, monkeypatch)
    row = consistency_row([outcome])
    pairs = len(outcome.records)
    assert row["proofs checked"] == pairs
    if text is None:
        assert row["proofs"] == f"0 of {pairs}"
        assert not outcome.faults
    else:
        assert str(row["proofs"]).split()[0] != "0"
        assert all(text in fault for _, fault in outcome.faults)
