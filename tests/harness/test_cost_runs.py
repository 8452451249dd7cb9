"""Runs of the harness with costs: optima, planted faults, records, resume, refusals."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav._base.poses import Motion
from hybridnav.harness import (
    RunSettings,
    compare_runs,
    load_study,
    to_frame,
    write_outputs,
    write_records,
)
from hybridnav.harness.analysis import rows_of_study
from hybridnav.harness.records import RECORDS_FILE, decode_path, read_records
from hybridnav.maps.costs import cost_along
from tests.harness import faulty_costs as faulty
from tests.harness.small_runs import ROOMS, name_of, outcome_of, run_here, write_map
from tests.layers import layer_of
from tests.oracle.grid import distances, move_graph, weighted

FAULTS = {
    faulty.DearSaidOptimal: "is above the weighted optimum",
    faulty.DearSaidCheap: "as reported",
    faulty.BoundAboveItsCost: "is above the cost",
    faulty.ClaimsNothing: "not nan m as reported",
    faulty.FalseBoundOfLine: "is above the weighted optimum",
    faulty.ArcsSaidCheap: "as reported",
    faulty.ArcsAskew: "neither a line nor an arc tangent",
    faulty.ArcsSaidBelowTheGrid: "bound on paths of cells",
    faulty.ArcsBoundedByNothing: "nan m is no lower bound on paths of cells",
}
SOUND = (faulty.Cheapest, faulty.HonestlyDear, faulty.WithArcs, faulty.ByLength)
PRESETS = ("shortest", "octile", "paper")
COSTS = ("clearance:inflation_radius_m=3,scaling=0.5,multiplier=6",)
N_PAIRS = 30


@pytest.fixture(scope="module", autouse=True)
def _here():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("hybridnav.harness.run.run_local", run_here)
        yield


@pytest.fixture(scope="module")
def settings(tmp_path_factory: Any) -> RunSettings:
    smoothed = hn.load_preset("grid-astar", overrides=["planner.smooth=line-of-sight"])
    return RunSettings(
        maps=(str(write_map(tmp_path_factory.mktemp("map"), ROOMS)),),
        presets=(*PRESETS, "robot", smoothed),
        baselines=("hpa-star", *map(name_of, (*FAULTS, *SOUND))),
        pairs=N_PAIRS,
        costs=COSTS,
    )


@pytest.fixture(scope="module")
def folder(settings: RunSettings, tmp_path_factory: Any) -> Any:
    folder = tmp_path_factory.mktemp("costs") / "run"
    write_records(settings, folder)
    return folder


@pytest.fixture(scope="module")
def study(folder: Any) -> Any:
    return write_outputs(folder)


@pytest.fixture(scope="module")
def scene(settings: RunSettings) -> Any:
    grid = hn.load_map(settings.maps[0], robot_radius_m=0)
    layer = hn.CostLayer.clearance(grid, inflation_radius_m=3, scaling=0.5, multiplier=6)
    return grid, layer, weighted(move_graph(grid.enterable()), layer.factors.astype(float))


@pytest.mark.parametrize("method", FAULTS)
def test_a_planted_fault_is_caught(study: Any, method: Any) -> None:
    found = [(record["id"], fault) for record, fault in outcome_of(study, method).faults]
    caught = {name for name, fault in found if FAULTS[method] in fault}
    assert len(caught) == N_PAIRS, found[:3]
    assert caught == {name for name, _ in found}


@pytest.mark.parametrize(
    "method", ["grid-astar", "grid-astar+line-of-sight", "hpa-star", "robot", *PRESETS, *SOUND]
)
def test_a_sound_method_has_no_fault(study: Any, method: Any) -> None:
    outcome = outcome_of(study, method)
    assert outcome.faults == []
    assert outcome.failures == 0
    assert np.isfinite(outcome.losses).all()


def test_the_optimum_of_each_pair_is_that_of_scipy(folder: Any, scene: Any) -> None:
    grid, _, graph = scene
    for record in read_records(folder):
        if record["type"] == "pair" and "weighted_m" in record:
            goal = tuple(record["goal"])
            lengths = distances(move_graph(grid.enterable()), grid.shape, tuple(record["start"]))
            costs = distances(graph, grid.shape, tuple(record["start"]))
            assert record["weighted_m"] == pytest.approx(costs[goal], rel=1e-12)
            assert record["octile_m"] == pytest.approx(lengths[goal], rel=1e-12)


def test_every_path_has_its_own_cost_beside_its_length(folder: Any, scene: Any) -> None:
    grid, layer, _ = scene
    judged = 0
    for record in read_records(folder):
        if record["type"] == "preparation":
            assert record["costs"] == COSTS[0]
            assert record["cost_source"] == layer.source
        elif record["status"] == "solved" and "cost_m" in record and not record["faults"]:
            points = record.get("points")
            if points is None:
                points = grid.frame.points_of(decode_path(tuple(record["start"]), record["path"]))
            rel = 1e-9
            if "headings_rad" in record:
                motion = Motion(np.array(points), np.array(record["headings_rad"]), curved=True)
                points, rel = motion.spread(1e-3)[0][:, :2], 1e-4
            assert record["cost_m"] == pytest.approx(cost_along(grid, layer, points), rel=rel)
            assert record["cost_m"] >= record["length_m"] * (1 - 1e-9)
            assert (record["cost_lower_bound_m"] or 0) <= record["cost_m"] * (1 + 1e-9)
            judged += 1
    assert judged > 5 * N_PAIRS


def test_losses_gaps_and_metrics_are_about_costs(study: Any) -> None:
    assert study.metric == "weighted"
    metric = {outcome.label: outcome.metric for outcome in study.outcomes}
    assert metric["grid-astar"] == metric["paper"] == "weighted"
    assert metric["grid-astar+line-of-sight"] == "any-angle-weighted"
    assert (metric["shortest"], metric["octile"]) == ("any-angle", "octile")
    best = outcome_of(study, "grid-astar")
    assert (best.losses == 0).all()
    assert (best.gaps == 0).all()
    for label in ("shortest", "octile", "paper"):
        outcome = outcome_of(study, label)
        assert outcome.losses == pytest.approx(outcome.costs_m / best.costs_m - 1, abs=1e-9)
        # A bound on lengths is one on costs, because no factor is below 1.
        assert (outcome.costs_m / (1 + outcome.gaps) <= best.costs_m * (1 + 1e-9)).all()
    taut = outcome_of(study, "grid-astar+line-of-sight")
    assert (taut.losses <= 1e-9).all()
    assert taut.losses.min() < 0
    assert outcome_of(study, "shortest").losses.max() > 0.1


def test_arcs_are_judged_as_they_are_driven(folder: Any, study: Any) -> None:
    robot, best = outcome_of(study, "robot"), outcome_of(study, "grid-astar")
    assert robot.metric == "any-angle-weighted"
    curved = [record for record in robot.records if record.get("headings_rad")]
    turned = [len(set(np.round(record["headings_rad"], 6).tolist())) > 1 for record in curved]
    assert len(curved) == sum(record["status"] == "solved" for record in robot.records)
    assert sum(turned) > N_PAIRS / 3
    assert np.isnan(robot.grid_gaps).all()  # its bound is on paths at any angle
    assert np.nanmax(robot.losses) <= 0.01
    assert np.isnan(best.grid_gaps).all()
    frame = to_frame(load_study(folder))
    own = frame[frame["method"] == "robot"]
    within = own["cost_lower_bound_m"] <= own["weighted_optimum_m"] * (1 + 1e-9)
    assert within[own["cost_m"].notna()].all()


def test_tables_and_report_name_the_costs(folder: Any, study: Any) -> None:
    rows: dict[str, Any] = {str(row["method"]): row for row in rows_of_study(study)}
    assert rows["octile"]["length mean m"] < rows["grid-astar"]["length mean m"]
    assert rows["octile"]["cost mean m"] > rows["grid-astar"]["cost mean m"]
    assert rows["grid-astar"]["weighted loss mean %"] == rows["grid-astar"]["gap max %"] == 0
    told = (folder / "summary.md").read_text()
    assert "| length mean m | cost mean m | gap mean % | gap max % |" in told
    assert "## Loss over the least cost of paths of cells" in told
    assert "octile optimum" not in told
    report = (folder / "report.html").read_text()
    assert COSTS[0] in report
    assert "% too dear" in report
    assert "the least cost of paths of cells, for the costs of all paths" in report
    assert json.loads((folder / "runs.jsonl").read_text())["costs"] == COSTS[0]


def test_a_data_frame_holds_costs(study: Any) -> None:
    frame = to_frame(study)
    assert set(frame["costs"]) == {COSTS[0]}
    costs = frame["weighted_optimum_m"] * (1 + frame["weighted_loss"])
    known = frame["cost_m"].notna()
    assert costs[known].to_numpy() == pytest.approx(frame["cost_m"][known].to_numpy())
    queries = frame[frame["weighted_optimum_m"].notna()].groupby(
        ["start_row", "start_col", "goal_row", "goal_col"]
    )
    assert (queries["weighted_optimum_m"].nunique() == 1).all()
    proved = frame[(frame["method"] == "grid-astar") & frame["cost_m"].notna()]
    assert proved["gap"].to_numpy() == pytest.approx(0)


def test_the_same_run_can_be_shown_by_lengths(folder: Any) -> None:
    study = load_study(folder, metric="octile")
    octile = outcome_of(study, "octile")
    assert octile.losses == pytest.approx(0)
    assert (outcome_of(study, "grid-astar").losses >= -1e-9).all()
    assert outcome_of(study, "grid-astar").losses.max() > 0.01
    assert np.isnan(outcome_of(study, "shortest").losses).all()
    study = load_study(folder, metric="any-angle")
    assert outcome_of(study, "shortest").losses == pytest.approx(0, abs=1e-6)


def test_a_run_resumes_and_refuses_other_costs(settings, folder, tmp_path):
    lines = (folder / RECORDS_FILE).read_bytes().splitlines(keepends=True)
    (tmp_path / RECORDS_FILE).write_bytes(b"".join(lines[: len(lines) // 2]))
    assert write_records(settings, tmp_path) == len(lines) - len(lines) // 2
    assert write_records(settings, tmp_path) == 0
    runs = (tmp_path / "runs.jsonl").read_text()
    for other, words in (((), "without costs"), (("clearance",), "with costs clearance")):
        with pytest.raises(hn.errors.InvalidValueError, match=words) as refused:
            write_records(replace(settings, presets=PRESETS, costs=other), tmp_path)
        assert "\n" not in str(refused.value)
    assert (tmp_path / "runs.jsonl").read_text() == runs
    both = (folder / RECORDS_FILE).read_text()
    plain = replace(settings, presets=(), baselines=(), costs=(), pairs=2)
    write_records(plain, tmp_path / "plain")
    path = tmp_path / "plain" / RECORDS_FILE
    path.write_text(path.read_text() + both)
    with pytest.raises(hn.errors.InvalidValueError, match="records with different costs"):
        load_study(tmp_path / "plain")


def test_runs_with_costs_are_compared_by_costs(folder: Any) -> None:
    rows: dict[str, Any] = {str(row["method"]): row for row in compare_runs(folder, folder)}
    study = load_study(folder)
    octile = outcome_of(study, "octile")
    assert rows["octile"]["loss of the first %"] == pytest.approx(100 * octile.losses.mean())
    other = folder.parent / "lengths"
    write_records(RunSettings(maps=(octile.preparation["file"],), pairs=2), other)
    with pytest.raises(hn.errors.InvalidValueError, match="share no method, map and pair"):
        compare_runs(folder, other)
    with pytest.raises(hn.errors.InvalidValueError, match="has no costs to refer to"):
        load_study(other, metric="weighted")


def test_cells_that_costs_close_are_occupied_for_all(settings: RunSettings, tmp_path: Any) -> None:
    grid = hn.load_map(settings.maps[0], robot_radius_m=0)
    closed = np.zeros(grid.shape, np.bool_)
    closed[:, 9] = True  # the doors between west and east
    layer = layer_of(np.full(grid.shape, 2.0), closed)
    only = replace(settings, baselines=(name_of(faulty.ByLength),), presets=("shortest",))
    write_records(replace(only, costs=layer), tmp_path)
    study = write_outputs(tmp_path)
    assert study.faults == []
    assert study.costs == f"array {layer.digest[:12]}"
    other = layer_of(np.full(grid.shape, 3.0), closed)
    with pytest.raises(hn.errors.InvalidValueError, match=r"with costs array [0-9a-f]{12}"):
        write_records(replace(only, costs=other), tmp_path)
    write_records(replace(only, costs=layer_of(np.full(grid.shape, 2.0), closed)), tmp_path)
    for outcome in study.outcomes:
        for record in outcome.records:
            west = record["start"][1] < 9, record["goal"][1] < 9
            assert record["start"][1] != 9
            assert (record["status"] == "solved") <= (west[0] == west[1])
            if record["status"] == "solved":
                assert record["cost_m"] == pytest.approx(2 * record["length_m"])


@pytest.mark.parametrize(
    ("costs", "message"),
    [
        (("height",), "costs must begin with clearance, speed, keepout, got 'height'"),
        (("clearance:scaling=-1",), "scaling must be a finite number >= 0"),
        (layer_of(np.ones((3, 4))), "costs of 4 x 3 cells are not those of a map of"),
    ],
)
def test_wrong_costs_are_refused_in_one_line(settings, tmp_path, costs, message):
    with pytest.raises(hn.errors.InvalidValueError, match=message) as refused:
        write_records(replace(settings, costs=costs), tmp_path / "run")
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "run").exists()


def test_a_preset_with_costs_of_its_own_takes_those_of_the_run(settings, tmp_path):
    own = hn.load_preset("paper", overrides=["planner.costs.clearance={}"])
    only = replace(settings, baselines=(), presets=(own,), pairs=5)
    with pytest.raises(
        hn.errors.InvalidValueError, match=r"preset paper plans by costs, and this run"
    ):
        write_records(replace(only, costs=()), tmp_path)
    write_records(only, tmp_path)
    paper = outcome_of(load_study(tmp_path), "paper")
    assert paper.faults == []
    assert paper.metric == "weighted"
