"""Presets with any-angle paths in the harness: which are refused, what they are called, OMPL."""

import math
import time
import uuid
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError
from hybridnav.harness.methods import preset_spec
from hybridnav.harness.output import write_outputs
from hybridnav.harness.records import read_records
from hybridnav.harness.run import RunSettings, evaluate, methods_of
from hybridnav.planner import load_preset
from tests.cli.test_commands import FIGURE
from tests.harness.small_runs import ROOMS, ROOT, run_here, write_map

N_PAIRS = 40
MARK = "HYBRIDNAV_TEST_MARK"


@pytest.fixture
def here(monkeypatch):
    """No processes but OMPL's."""
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)


def outcome_of(study, label):
    return next(outcome for outcome in study.outcomes if outcome.label == label)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ("space: se2", "space se2 needs headings"),
        ("{space: dubins, turning_radius_m: 0.5}", "space dubins needs headings"),
        ("{space: reeds-shepp, turning_radius_m: 0.5}", "space reeds-shepp needs headings"),
        ("{objective: clearance}", "objective clearance"),
    ],
)
def test_a_preset_in_another_metric_is_refused_in_one_line(cli, tmp_path, settings, words):
    settings = settings if settings.startswith("{") else f"{{{settings}}}"
    arguments = ["--preset", "ompl", "--set", f"planner.ompl={settings}"]
    done = cli("evaluate", FIGURE, *arguments, "-o", tmp_path / "run")
    assert done.refuses(2, words)
    assert "preset ompl" in done.err
    assert not (tmp_path / "run").exists()


def test_a_preset_with_costs_in_a_run_by_lengths_is_refused_in_one_line(cli, tmp_path):
    arguments = ["--preset", "paper", "--set", "planner.costs.clearance={}"]
    done = cli("evaluate", FIGURE, *arguments, "-o", tmp_path / "run")
    assert done.refuses(2, "preset paper plans by costs, and this run measures lengths")


def test_lines_go_not_with_corner_cutting():
    smooth = load_preset("paper", overrides=["planner.smooth=line-of-sight"])
    settings = RunSettings(maps=("x.yaml",), presets=("paper", smooth), corner_cutting=True)
    with pytest.raises(InvalidValueError, match=r"method paper\+line-of-sight.*corner cutting"):
        methods_of(settings, None)
    assert methods_of(replace(settings, presets=("paper",)), None)


def test_what_a_smoothed_preset_is_called():
    smooth = load_preset("grid-astar", overrides=["planner.smooth=line-of-sight"])
    names = [s.name for s in methods_of(RunSettings(maps=(), presets=(smooth,)), None)]
    assert names == ["grid-astar", "grid-astar+line-of-sight"]
    assert preset_spec("paper").metric == "octile"
    assert preset_spec("shortest").metric == "any-angle"


@pytest.mark.usefixtures("here")
def test_the_preset_of_shortest_paths_loses_nothing(tmp_path):
    only = RunSettings(
        maps=(str(write_map(tmp_path, ROOMS)),),
        presets=("shortest", "grid-astar"),
        pairs=N_PAIRS,
        merge_distance_m=4.0,
    )
    evaluate(only, tmp_path / "run")
    study = write_outputs(tmp_path / "run", metric="any-angle")
    assert study.faults == []
    losses = outcome_of(study, "shortest").losses
    np.testing.assert_array_equal(losses, np.zeros(N_PAIRS))
    assert (outcome_of(study, "grid-astar").losses >= losses).all()
    with pytest.raises(InvalidValueError, match=r"method shortest.*corner cutting"):
        methods_of(replace(only, corner_cutting=True), None)


# --- OMPL ---------------------------------------------------------------------------------------


def ompl_processes_with(mark):
    """Command lines of OMPL's processes that have the mark in their environment."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        try:
            command = (process / "cmdline").read_bytes().replace(b"\0", b" ").decode()
            if "hybridnav.refine.ompl" in command:
                found += [command] * (mark.encode() in (process / "environ").read_bytes())
        except OSError:  # it has ended
            continue
    return found


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="needs /proc")
def test_ompl_through_evaluate_leaves_no_process(cli, tmp_path, monkeypatch):
    pytest.importorskip("ompl")
    mark = uuid.uuid4().hex
    monkeypatch.setenv(MARK, mark)
    out = tmp_path / "run"
    methods = tmp_path / "methods.yaml"
    settings = "{planner.ompl.planner: RRTstar, planner.ompl.budget_s: 0.3}"
    star = f"{{name: star, preset: ompl, settings: {settings}}}"
    methods.write_text(f"methods: [{star}]")
    arguments = ["evaluate", FIGURE, "--preset", "ompl", "--methods", methods]
    arguments += ["--set", "planner.ompl.budget_s=0.3", "--pairs", 5, "--workers", 2, "-o", out]
    done = cli(*arguments)
    assert (done.code, done.err) == (0, "")
    assert "15 answers checked, 0 counter-examples" in done.out
    deadline = time.monotonic() + 10
    while ompl_processes_with(mark) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert ompl_processes_with(mark) == []
    records = [r for r in read_records(out) if r["method"] != "grid-astar" and r["type"] == "pair"]
    solved = [record for record in records if record["status"] == "solved"]
    assert len(solved) == 10
    for record in solved:
        assert 0 < record["lower_bound_m"] <= record["length_m"] * (1 + 1e-9)
        # On a machine that is busy the time may pass before there is any.
        first_s = record["stages"].get("first path", 0.0 if record["by_grid"] else math.inf)
        assert first_s <= record["stages"]["refine"]
    # Again: nothing to do, the same answer.
    assert cli(*arguments).out == done.out
    assert len(read_records(out)) == 3 * 6


@pytest.mark.usefixtures("here")
def test_what_ompl_does_not_find_is_not_its_own(tmp_path):
    pytest.importorskip("ompl")
    hopeless = "{confine: mask, iterations: 1, budget_s: 10, simplify: false}"
    preset = load_preset("ompl", overrides=[f"planner.ompl={hopeless}"])
    map_file = ROOT / "maps" / "office" / "office.yaml"
    evaluate(RunSettings(maps=(str(map_file),), presets=(preset,), pairs=8), tmp_path)
    outcome = outcome_of(write_outputs(tmp_path), "ompl")
    by_grid = [r for r in outcome.records if r.get("by_grid")]
    assert outcome.by_grid == len(by_grid) > 0
    assert np.isfinite(outcome.losses).sum() == 8 - len(by_grid)
    assert outcome.faults == []
    assert not math.isnan(np.nanmean(outcome.fallback_losses))


def test_a_planner_that_is_closed_answers_again():
    pytest.importorskip("ompl")
    grid = hn.load_map(FIGURE, robot_radius_m=0)
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), preset="ompl")
    start, goal = grid.frame.points_of([[2, 2], [4, 9]])
    planner.close()
    planner.close()
    assert planner.plan(start, goal).solved
