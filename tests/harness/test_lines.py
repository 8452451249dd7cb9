"""Any-angle paths in the harness: judged, set beside their like, presets that have them, OMPL."""

import csv
import json
import math
import re
import time
import uuid
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.subjects._study_data import part_figures
from hybridnav.errors import InvalidValueError
from hybridnav.harness import AnyAngleOptimum, load_study
from hybridnav.harness.compare import compare_runs
from hybridnav.harness.judges import VisibilityGraph
from hybridnav.harness.methods import preset_spec
from hybridnav.harness.outcome import pairs_in_common
from hybridnav.harness.output import report_of, write_outputs
from hybridnav.harness.records import query_key, read_records
from hybridnav.harness.run import RunSettings, methods_of, write_records
from hybridnav.harness.yardstick import OPTIMA, Yardstick, contradiction
from hybridnav.maps.files import load_map
from hybridnav.planning import load_preset
from tests.cli.test_commands import FIGURE
from tests.harness import faulty_methods as faulty
from tests.harness.small_runs import (
    ROOMS,
    ROOT,
    label_of,
    name_of,
    outcome_of,
    run_here,
    run_in,
    write_map,
)

FAULTS = {
    faulty.LineThroughWall: "m enters a blocked cell",
    faulty.LineSaidShort: "m as reported",
    faulty.LineBelowItsBound: "is above the length",
    faulty.LineBesideTheGoal: "the last point",
    faulty.LineFromElsewhere: "the first point",
    faulty.LineSaidOptimal: "m is above the any-angle optimum",
    faulty.LineForAll: "solvability: solved, but on the whole grid: no path",
    faulty.LineOfNothing: "no answer to judge: points need finite coordinates",
    faulty.LineUnsaid: "not nan m as reported",
    faulty.LineOverHomelessCells: "the path leaves the regions",
}
SOUND = (faulty.SoundLine, faulty.OwnGridOrNothing)
PRESETS = ("paper", "octile")
METRICS: tuple[Yardstick, ...] = ("both", "any-angle", "octile")
N_PAIRS = 40


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    smooth = [load_preset(name, overrides=["planner.smooth=line-of-sight"]) for name in PRESETS]
    return run_in(
        tmp_path_factory.mktemp("lines"),
        presets=("paper", *smooth),
        baselines=tuple(map(name_of, (*FAULTS, *SOUND))),
        pairs=N_PAIRS,
        merge_distance_m=4.0,
    )


@pytest.fixture(scope="module")
def study(folder):
    return write_outputs(folder)


@pytest.fixture(scope="module")
def rows(folder, study):
    assert study.outcomes
    with (folder / "summary.csv").open() as stream:
        return {row["method"]: row for row in csv.DictReader(stream)}


@pytest.mark.parametrize("method", FAULTS)
def test_a_planted_fault_is_caught(study, method):
    found = [fault for _, fault in outcome_of(study, method).faults]
    assert any(FAULTS[method] in fault for fault in found), found[:3]
    if method in (faulty.LineSaidShort, faulty.LineBelowItsBound, faulty.LineUnsaid):
        assert len({record["id"] for record, _ in outcome_of(study, method).faults}) == N_PAIRS


@pytest.mark.parametrize("method", [*SOUND, *(f"{name}+line-of-sight" for name in PRESETS)])
def test_a_sound_method_has_no_fault(study, method):
    outcome = outcome_of(study, method)
    assert outcome.faults == []
    assert outcome.checks + outcome.failures == N_PAIRS + 2
    assert outcome.metric == "any-angle"


def test_losses_refer_to_the_shortest_any_angle_path(study):
    outcome = outcome_of(study, faulty.SoundLine)
    graph = VisibilityGraph(load_map(outcome.preparation["file"], robot_radius_m=0))
    lengths = [
        graph.shortest(tuple(record["start"]), tuple(record["goal"])).length_m
        for record in outcome.references
    ]
    np.testing.assert_allclose(outcome.losses, outcome.lengths_m / lengths - 1, atol=1e-9)
    assert (outcome.losses < 0.05).all()
    # Beside the grid's optimum they would be shorter than what is shortest.
    assert (outcome.lengths_m < outcome.optima_m * (1 - 1e-3)).any()


def test_no_path_in_any_metric_is_shorter_than_the_yardstick(study):
    for outcome in study.outcomes:
        losses = outcome.any_angle_losses[np.isfinite(outcome.any_angle_losses)]
        assert (losses >= 0).all(), outcome.label
        # Along the grid a path is never shorter than the grid's own optimum either.
        assert np.isfinite(outcome.octile_losses).any() <= (outcome.metric == "octile")
        assert not (outcome.octile_losses < 0).any()
    longer = outcome_of(study, "grid-astar").any_angle_losses
    assert longer.mean() > 0.01
    np.testing.assert_array_equal(outcome_of(study, "grid-astar").octile_losses, 0)


def test_both_losses_are_over_the_pairs_that_all_methods_solved(study, rows):
    third = {query_key(r) for r in outcome_of(study, faulty.OwnGridOrNothing).references}
    solved = [outcome.solved_keys for outcome in study.outcomes if outcome.solved_keys]
    common = set.intersection(*solved)
    assert 3 < len(common) < len(third)
    assert pairs_in_common(study.outcomes) == common
    for label, row in rows.items():
        outcome = outcome_of(study, label)
        kept = outcome.among(common) & np.isfinite(outcome.lengths_m)
        assert int(row["pairs in common"]) == kept.sum()
        assert kept.sum() in (0, len(common))
        if kept.any():
            lengths, best = outcome.lengths_m[kept], outcome.any_angle_optima_m[kept]
            loss = 100 * (lengths / best - 1).mean()
            assert float(row["any-angle loss mean %"]) == pytest.approx(loss, abs=1e-6)
        is_octile = outcome.metric == "octile"
        assert (row["octile loss mean %"] != "") == (bool(kept.any()) and is_octile)


def test_the_metric_decides_what_losses_refer_to(folder, study):
    line = label_of(faulty.SoundLine)
    for metric in ("any-angle", "octile"):
        other = write_outputs(folder, metric=metric)
        cells, lines = outcome_of(other, "grid-astar"), outcome_of(other, line)
        own = cells.octile_losses if metric == "octile" else cells.any_angle_losses
        np.testing.assert_array_equal(cells.losses, own)
        assert np.isfinite(lines.losses).any() == (metric == "any-angle")
        assert np.isfinite(lines.seconds).sum() == np.isfinite(lines.lengths_m).sum()
        table = (folder / "summary.md").read_text()
        shown = [name for name in ("any-angle", "octile") if f"Loss over the {name}" in table]
        assert shown == [metric]
        report = (folder / "report.html").read_text()
        assert f"the {metric} optimum" in report
        assert ", octile paths" not in report
    both = write_outputs(folder)
    np.testing.assert_array_equal(outcome_of(both, line).losses, outcome_of(study, line).losses)
    with pytest.raises(
        InvalidValueError, match="both, any-angle, octile, weighted, got metric 'l2'"
    ):
        write_outputs(folder, metric="l2")  # type: ignore[arg-type]


def test_runs_are_compared_over_the_optimum_that_is_asked_for(folder):
    loss: dict[tuple[str, str], Any] = {
        (metric, str(row["method"])): row["loss of the first %"]
        for metric in METRICS
        for row in compare_runs(folder, folder, metric=metric)
    }
    line = label_of(faulty.SoundLine)
    assert loss["any-angle", "paper"] > loss["octile", "paper"] + 1
    assert loss["both", "paper"] == loss["octile", "paper"]
    assert loss["both", line] == loss["any-angle", line]
    assert math.isnan(loss["octile", line])


def test_a_line_below_the_optimum_is_a_contradiction():
    reference = {"status": "solved", "length_m": 11.0, "any_angle_m": 10.0}
    line = {"status": "solved", "metric": "any-angle", "length_m": 9.99, "lower_bound_m": 9.0}
    assert contradiction(line, reference) == (
        "bounds",
        "length 9.990000 m is below the any-angle optimum 10.000000 m",
    )
    assert contradiction({**line, "length_m": 10.0 - 1e-9}, reference) is None
    assert contradiction({**line, "length_m": 10.5, "lower_bound_m": 10.1}, reference) == (
        "bounds",
        "the lower bound 10.100000 m is above the any-angle optimum 10.000000 m",
    )
    assert contradiction(line, {"status": "solved", "length_m": 11.0}) is None


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("factor", "words"), [(2.0, "a path of cells has"), (0.99, "by a visibility graph")]
)
def test_a_yardstick_that_is_wrong_is_found_out(folder, tmp_path, monkeypatch, factor, words):
    right = AnyAngleOptimum.length_m
    monkeypatch.setattr(AnyAngleOptimum, "length_m", lambda *endpoints: factor * right(*endpoints))
    only = RunSettings(maps=(str(folder.parent / "rooms.map"),), presets=(), pairs=5)
    write_records(only, tmp_path)
    faults = [fault for _, _, fault in write_outputs(tmp_path).faults]
    assert len(faults) >= 3
    assert all("the any-angle optimum by the mesh is" in fault for fault in faults)
    assert all(words in fault for fault in faults)


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("factor", [1.0, 0.999])
def test_a_map_of_many_corners_is_checked_like_any_other(tmp_path, monkeypatch, factor):
    side = 95  # with 4 corners round each of 2,209 blocked cells
    lines = ["." * side if row % 2 == 0 else ".#" * (side // 2) + "." for row in range(side)]
    right = AnyAngleOptimum.length_m
    monkeypatch.setattr(AnyAngleOptimum, "length_m", lambda *endpoints: factor * right(*endpoints))
    run = tmp_path / "run"
    write_records(RunSettings(maps=(str(write_map(tmp_path, lines)),), presets=(), pairs=5), run)
    faults = [fault for _, _, fault in write_outputs(run).faults]
    checked = 3 if factor == 1 else 0
    assert len(faults) == 3 - checked
    assert all("by a visibility graph" in fault for fault in faults)
    records = [json.loads(line) for line in (run / "records.jsonl").read_text().splitlines()]
    both = [
        (r["any_angle_m"], r["visibility_optimum_m"])
        for r in records
        if "visibility_optimum_m" in r
    ]
    assert len(both) == checked
    assert all(one == pytest.approx(other, rel=1e-9) for one, other in both)
    asked = 5 - len(faults)
    assert f"Checked any-angle: {checked} of {asked}." in (run / "summary.md").read_text()
    report = re.sub(r"(\s*<[^>]*>\s*)+", " ", (run / "report.html").read_text())
    assert f"checked any-angle {checked} of {asked}" in report


def test_records_whose_any_angle_lengths_are_not_proved_are_refused(folder, tmp_path):
    lines = (folder / "records.jsonl").read_text().splitlines()
    at = next(at for at, line in enumerate(lines) if '"any_angle_m"' in line)
    for exact, error in ((True, None), (False, rf"line {at + 1}: .* take a new folder$")):
        old = json.loads(lines[at]) | {"any_angle_exact": exact}
        records = "\n".join([*lines[:at], json.dumps(old), *lines[at + 1 :], ""])
        (tmp_path / "records.jsonl").write_text(records)
        if error is None:
            assert len(load_study(tmp_path).outcomes) > 3
            continue
        with pytest.raises(InvalidValueError, match=error):
            load_study(tmp_path)


def test_each_optimum_has_charts_of_the_methods_in_its_tables(folder, study, rows):
    metrics = [row["metric"] for row in rows.values()]
    assert metrics == sorted(metrics, reverse=True)
    assert rows["paper"]["metric"] == rows["grid-astar"]["metric"] == "octile"
    assert rows["paper"]["by the grid"] == ""
    for name in ("octile+line-of-sight", label_of(faulty.SoundLine)):
        assert rows[name]["metric"] == "any-angle"
        assert rows[name]["octile loss mean %"] == ""
    report = (folder / "report.html").read_text()
    assert "all maps" not in report
    for title in ("Speed against loss", "Loss"):
        for optimum in OPTIMA:
            assert report.count(f"<strong>{title} over {OPTIMA[optimum]}, rooms.") == (
                optimum != "weighted"
            )
    # No method alone where the tables compare it with others.
    losses = report_of(study, "", [], {"rooms": list(rows.values())}).maps[0].losses
    by_cells = {name for name, row in rows.items() if row["metric"] == "octile"}
    assert losses.keys() == {OPTIMA["any-angle"], OPTIMA["octile"]}
    assert losses[OPTIMA["octile"]].keys() == by_cells
    assert losses[OPTIMA["any-angle"]].keys() == rows.keys()
    assert np.isfinite(losses[OPTIMA["any-angle"]]["grid-astar"]).all()


def test_a_path_by_the_grid_is_not_its_method_s(study, rows):
    outcome = outcome_of(study, faulty.OwnGridOrNothing)
    turns = [(record["start"][0] + record["goal"][0]) % 3 for record in outcome.references]
    own, grid = turns.count(1), turns.count(2)
    assert min(own, grid, turns.count(0)) > 3
    row = rows[label_of(faulty.OwnGridOrNothing)]
    assert (row["solved"], row["by the grid"]) == (str(own), str(grid))
    # Its own are as good as can be, the grid's longer: those do not count.
    assert np.isfinite(outcome.losses).sum() == own
    taut = outcome_of(study, faulty.SoundLine)
    assert float(row["any-angle loss max %"]) <= 100 * taut.losses.max()
    assert np.nanmax(outcome.fallback_losses) > 0.03
    assert np.isfinite(outcome.seconds).sum() == own
    late = [record for record in outcome.records if record["status"] == "timeout"]
    assert len(late) == outcome.failures == turns.count(0)


def test_the_study_counts_a_method_s_own_paths_by_themselves(study):
    found = part_figures(study)
    label = label_of(faulty.OwnGridOrNothing)
    outcome = outcome_of(study, faulty.OwnGridOrNothing)
    assert label not in {row["method"] for row in found["methods"]}
    (row,) = [row for row in found["others"] if row["method"] == label]
    own = np.isfinite(outcome.losses).sum()
    assert (row["solved"], row["pairs in common"]) == (own, own)
    assert row["by the grid %"] == pytest.approx(100 * outcome.by_grid / N_PAIRS, rel=1e-5)
    assert row["any-angle loss max %"] < 100 * np.nanmax(outcome.fallback_losses)
    (late,) = [one for one in found["unanswered"] if one["method"] == label]
    assert (late["what"], late["queries"]) == ("too slow", outcome.failures)


def test_a_run_of_lines_equals_itself_and_differs_from_one_of_cells(folder, tmp_path, monkeypatch):
    name = label_of(faulty.SoundLine)
    rows = {row["method"]: row for row in compare_runs(folder, folder)}
    assert rows[name]["difference, points"] == 0
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)
    settings = RunSettings(
        maps=(str(folder.parent / "rooms.map"),), pairs=N_PAIRS, merge_distance_m=4.0
    )
    smooth = load_preset("octile", overrides=["planner.smooth=line-of-sight"])
    write_records(replace(settings, presets=("octile",)), tmp_path / "cells")
    write_records(replace(settings, presets=(smooth,)), tmp_path / "lines")
    # What is no loss by definition is no chart of its own.
    write_outputs(tmp_path / "lines")
    report = (tmp_path / "lines" / "report.html").read_text()
    assert "<strong>Loss over the any-angle optimum, rooms." in report
    assert "<strong>Loss over the octile optimum" not in report
    (row,) = compare_runs(tmp_path / "cells", tmp_path / "lines")
    assert row["method"] == "octile+line-of-sight against octile"
    cells, lines = (
        next(o for o in write_outputs(tmp_path / run).outcomes if o.label != "grid-astar")
        for run in ("cells", "lines")
    )
    # With two metrics both losses are over the any-angle optimum, the shorter one.
    shorter = 100 * ((lines.lengths_m - cells.lengths_m) / lines.any_angle_optima_m).mean()
    assert row["difference, points"] == pytest.approx(shorter)
    assert shorter < -1


MARK = "HYBRIDNAV_TEST_MARK"


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ("space: se2", "space se2 needs headings"),
        ("{space: dubins, turning_radius_m: 0.5}", "space dubins needs headings"),
        ("{space: reeds-shepp, turning_radius_m: 0.5}", "space reeds-shepp needs headings"),
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
    write_records(only, tmp_path / "run")
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


@pytest.mark.full
@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="needs /proc")
def test_ompl_through_evaluate_leaves_no_process(cli, tmp_path, monkeypatch):
    pytest.importorskip("ompl")
    mark = uuid.uuid4().hex
    monkeypatch.setenv(MARK, mark)
    out = tmp_path / "run"
    star = tmp_path / "star.yaml"
    star.write_text("planner: {method: ompl, ompl: {planner: RRTstar}}")
    arguments = ["evaluate", FIGURE, "--preset", "ompl", "--preset", star]
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
    write_records(RunSettings(maps=(str(map_file),), presets=(preset,), pairs=8), tmp_path)
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
