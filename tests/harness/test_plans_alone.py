"""A planner that answers with regions alone: what is judged of it, measured, and shown."""

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.harness.analysis import load_study, rows_of_study, to_frame
from hybridnav.harness.compare import compare_runs
from hybridnav.harness.output import write_outputs
from hybridnav.harness.records import read_records
from hybridnav.harness.run import RunSettings, write_records
from hybridnav.maps import CellClass
from tests.harness import faulty_methods as faulty
from tests.harness.small_runs import ROOMS, name_of, outcome_of, run_in, write_map
from tests.oracle.grid import distances, move_graph

N_PAIRS = 20
METHODS = (faulty.SoundPlaces, faulty.PlansAlone)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return run_in(
        tmp_path_factory.mktemp("plans"),
        presets=("octile",),
        baselines=tuple(map(name_of, METHODS)),
        pairs=N_PAIRS,
        repeat=1,
    )


@pytest.fixture(scope="module")
def study(folder):
    return write_outputs(folder)


def test_joined_regions_are_an_answer_and_no_counter_example(study):
    outcome = outcome_of(study, faulty.PlansAlone)
    assert (outcome.faults, outcome.failures, outcome.failure) == ([], 0, None)
    assert outcome.checks == len(outcome.records) == N_PAIRS + 1
    status = [record["status"] for record in outcome.records]
    assert status.count("planned") == outcome.planned.sum() == N_PAIRS
    assert status.count("no path") == 1
    row = next(row for row in rows_of_study(study) if row["method"] == "PlansAlone")
    assert (row["metric"], row["solved %"], row["planned %"]) == ("regions", 0, 100)
    assert (row["plan to path"], row["paths"]) == (f"0 of {N_PAIRS}", "")
    assert row['"no path", right'] == 1


def test_the_losses_of_a_plan_are_those_of_paths_inside_its_regions(study):
    """By scipy's Dijkstra on the cells of the plan's regions, and by the plans of paths."""
    outcome = outcome_of(study, faulty.PlansAlone)
    grid = hn.load_map(outcome.preparation["file"], robot_radius_m=0)
    method, free = faulty.PlansAlone(grid), grid.classes == CellClass.FREE
    frame = to_frame(study)
    whole = move_graph(free)
    own = frame[(frame["method"] == "PlansAlone") & (frame["status"] == "planned")]
    assert len(own) == N_PAIRS
    for row in own.to_dict("records"):
        start, goal = (row["start_row"], row["start_col"]), (row["goal_row"], row["goal_col"])
        nodes = method.solve(start, goal).nodes or ()
        inside = free & np.isin(method.region_of, nodes)
        # A diagonal may pass cells outside the regions, but stands on those inside.
        confined = distances(move_graph(free, inside), grid.shape, start)[goal]
        best = distances(whole, grid.shape, start)[goal]
        assert row["plan_loss"] == pytest.approx(confined / best - 1, abs=1e-9)
        assert row["in_order_loss"] >= row["plan_loss"] - 1e-9
        assert row["plan_steps"] == len(nodes) - 1
        assert row["backups"] == method.n_nodes * row["plan_steps"]
        assert np.isnan(row["length_m"])
    with_paths = frame[(frame["method"] == "SoundPlaces") & (frame["status"] == "solved")]
    for column in ("plan_loss", "in_order_loss", "plan_steps"):
        known = with_paths[column].notna().to_numpy()
        assert known.sum() > N_PAIRS / 2
        assert own[column][known].to_numpy() == pytest.approx(with_paths[column][known].to_numpy())


def test_it_has_a_row_of_losses_and_times_and_is_in_no_chart_of_paths(folder, study):
    text = (folder / "summary.md").read_text()
    losses = text.partition("## Loss over the octile optimum")[2].partition("## ")[0]
    assert "| PlansAlone | regions | 0 | 100 |" in losses
    any_angle = text.partition("## Loss over the any-angle optimum")[2].partition("## ")[0]
    assert "octile" in any_angle
    assert "PlansAlone" not in any_angle
    row = next(row for row in rows_of_study(study) if row["method"] == "PlansAlone")
    outcome = outcome_of(study, faulty.PlansAlone)
    assert row["loss of the plan %"] == pytest.approx(100 * outcome.plan_losses.mean())
    assert row["backups"] == pytest.approx(outcome.preparation["n_nodes"] * float(row["steps"]))
    assert float(row["query ms, median"]) > 0
    assert row["pairs in common"] == N_PAIRS
    # Quick plans without a path are not ahead of presets, which find paths.
    assert "PlansAlone (" not in text
    report = (folder / "report.html").read_text()
    assert "PlansAlone: " not in report.partition("data:image/svg+xml")[2].replace("%3A", ":")


def test_runs_of_it_compare_by_time_alone(folder):
    rows = [row for row in compare_runs(folder, folder) if row["method"] == "PlansAlone"]
    assert rows[0]["time, second / first"] == 1.0
    assert np.isnan(float(rows[0]["loss of the first %"]))


@pytest.mark.usefixtures("here")
def test_by_costs_the_loss_of_a_plan_is_one_of_costs(tmp_path):
    settings = RunSettings(
        maps=(str(write_map(tmp_path, ROOMS)),),
        presets=(),
        baselines=(name_of(faulty.PlansAlone),),
        pairs=5,
        costs=("clearance",),
    )
    write_records(settings, tmp_path / "run")
    (row,) = (r for r in rows_of_study(load_study(tmp_path / "run")) if r["method"] == "PlansAlone")
    assert float(row["loss of the plan %"]) >= 0
    records = [r for r in read_records(tmp_path / "run") if r["status"] == "planned"]
    assert all(r["in_order_m"] is None and r["plan_optimum_m"] > 0 for r in records)
