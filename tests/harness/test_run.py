"""Runs of the harness: killed and resumed, with workers that die or hang; two runs compared."""

import json
import math
import os
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError, MapError
from hybridnav.harness import workers
from hybridnav.harness.analysis import load_study
from hybridnav.harness.compare import compare_runs
from hybridnav.harness.names import REFERENCE
from hybridnav.harness.output import write_outputs
from hybridnav.harness.records import RECORDS_FILE, read_records
from hybridnav.harness.run import RunSettings, write_records
from hybridnav.harness.scenes import sample_pairs
from hybridnav.maps.files import load_map
from tests.harness import faulty_methods as faulty
from tests.harness.small_runs import ROOMS, ROOT, importable, name_of, write_map
from tests.strategies import full_but

N_PAIRS = 60
TIMES = ("seconds", "stages", "pyramid_seconds", "method_seconds", "environment")


@pytest.fixture(scope="module", autouse=True)
def _importable():
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", importable())
        yield


@pytest.fixture(scope="module")
def rooms(tmp_path_factory):
    return write_map(tmp_path_factory.mktemp("map"), ROOMS)


@pytest.fixture(scope="module")
def settings(rooms, tmp_path_factory):
    """A run of a second or two; on so small a map a descent would lose nothing."""
    preset = tmp_path_factory.mktemp("preset") / "paper.yaml"
    preset.write_text(hn.load_preset("paper", overrides=["planner.levels=places"]).to_yaml())
    return RunSettings(
        maps=(str(rooms),),
        presets=(str(preset),),
        baselines=(name_of(faulty.Slow), "simple-graph"),
        pairs=N_PAIRS,
        merge_distance_m=4.0,
    )


@pytest.fixture(scope="module")
def unbroken(settings, tmp_path_factory):
    """The folder of a run that nothing disturbed."""
    folder = tmp_path_factory.mktemp("unbroken")
    seen = []
    assert write_records(settings, folder, progress=lambda *counts: seen.append(counts)) == total(4)
    assert seen == sorted(seen)
    assert seen[-1] == (total(4), total(4))
    return folder


def total(methods):
    """Records of a run: for each method a preparation, the pairs, and those across."""
    return methods * (1 + N_PAIRS + math.ceil(N_PAIRS / 20))


def timeless(folder):
    """Records by id, without what no two runs have in common."""
    records = read_records(folder)
    plain = [{k: v for k, v in record.items() if k not in TIMES} for record in records]
    assert len({record["id"] for record in plain}) == len(plain)
    return {record["id"]: record for record in plain}


# --- kill and resume ----------------------------------------------------------------------------


def start(settings, folder):
    """Start a run in a process group of its own."""
    command = [sys.executable, "-m", "hybridnav", "evaluate", *settings.maps, "-o", folder]
    command += ["--preset", "paper", "--pairs", settings.pairs, "--merge-distance", 4]
    command += [word for name in settings.baselines for word in ("--baseline", name)]
    return subprocess.Popen(
        list(map(str, command)),
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def kill_once_there_are(count, process, path):
    """Kill a run and all its workers once that many records are written."""
    deadline = time.monotonic() + 60
    while process.poll() is None and time.monotonic() < deadline:
        if path.exists() and path.read_bytes().count(b"\n") >= count:
            break
        time.sleep(0.002)
    assert process.poll() is None, "the run ended before it could be killed"
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()


@pytest.mark.full
def test_a_run_killed_twice_has_the_records_of_an_unbroken_one(settings, unbroken, tmp_path):
    path = tmp_path / RECORDS_FILE
    for count in (1, total(1) + 20):
        kill_once_there_are(count, start(settings, tmp_path), path)
        there = path.read_bytes()
        assert count <= there.count(b"\n") < total(4)
    # The worst that a kill leaves: a line of which a part was written.
    path.write_bytes(there + b'{"id":"56e15eb')
    before = there.count(b"\n")
    assert write_records(settings, tmp_path) == total(4) - before
    assert path.read_bytes().startswith(there)
    assert timeless(tmp_path) == timeless(unbroken)


@pytest.mark.parametrize("count", full_but([3], [2, 3, 7]))
def test_a_run_checks_the_same_sample_wherever_it_was_stopped(count, settings, unbroken, tmp_path):
    lines = (unbroken / RECORDS_FILE).read_bytes().splitlines(keepends=True)
    of_reference = [line for line in lines if json.loads(line)["method"] == REFERENCE]
    (tmp_path / RECORDS_FILE).write_bytes(b"".join(of_reference[:count]))
    write_records(settings, tmp_path)
    assert timeless(tmp_path) == timeless(unbroken)


def test_a_run_that_is_complete_makes_no_record(settings, unbroken):
    before = (unbroken / RECORDS_FILE).read_bytes()
    began = time.monotonic()
    assert write_records(settings, unbroken) == 0
    assert time.monotonic() - began < 2  # no process was started
    assert (unbroken / RECORDS_FILE).read_bytes() == before


def test_a_method_more_costs_that_method_only(settings, unbroken, tmp_path):
    (tmp_path / RECORDS_FILE).write_bytes((unbroken / RECORDS_FILE).read_bytes())
    more = replace(settings, baselines=(*settings.baselines, "grid-dijkstra"), workers=2)
    assert write_records(more, tmp_path) == total(1)
    before = timeless(unbroken)
    after = timeless(tmp_path)
    assert {name: after[name] for name in before} == before


@pytest.mark.usefixtures("here")
def test_a_map_that_changed_is_another_map(settings, tmp_path):
    path = write_map(tmp_path, ROOMS)
    only = replace(settings, maps=(str(path),), presets=(), baselines=(), pairs=3)
    made = write_records(only, tmp_path / "run")
    write_map(tmp_path, ROOMS[::-1])
    assert write_records(only, tmp_path / "run") == made


# --- workers that die or hang -------------------------------------------------------------------


@pytest.mark.parametrize(
    ("method", "status"),
    [(faulty.Dies, "lost"), (faulty.DiesBeforeItsChild, "lost"), (faulty.Hangs, "timeout")],
)
def test_a_worker_that_fails_costs_one_query(settings, tmp_path, monkeypatch, method, status):
    pairs = sample_pairs(load_map(settings.maps[0]), N_PAIRS, seed=settings.seed)
    fatal = pairs[N_PAIRS // 2]
    monkeypatch.setenv(faulty.FATAL_PAIR, fatal.key.partition(":")[2])
    # The timeout must leave time for the imports of a process, on a busy machine too.
    only = replace(settings, presets=(), baselines=(name_of(method),), timeout_s=10.0)
    if method is not faulty.Hangs:
        only = replace(only, timeout_s=100.0 if method is faulty.Dies else 20.0)
    assert write_records(only, tmp_path) == total(2)
    records = timeless(tmp_path).values()
    failed = [record for record in records if record["status"] == status]
    assert [(tuple(r["start"]), tuple(r["goal"])) for r in failed] == [(fatal.start, fatal.goal)]
    assert {r["status"] for r in records} == {"ready", "solved", "no path", status}
    # What is lost stays lost: it is not tried again.
    assert write_records(only, tmp_path) == 0
    study = write_outputs(tmp_path)
    assert study.faults == []
    assert sum(outcome.failures for outcome in study.outcomes) == 1
    assert study.maps == ["rooms"]


def test_a_process_that_dies_before_it_is_ready_is_given_up(settings, tmp_path, monkeypatch):
    # On the small map of the warm-up already.
    monkeypatch.setenv(faulty.FATAL_PAIR, "2,2>2,2")
    baselines = (name_of(faulty.Dies), "grid-dijkstra")
    only = replace(settings, presets=(), baselines=baselines, pairs=5)
    write_records(only, tmp_path)
    outcomes = write_outputs(tmp_path).outcomes
    ready = {outcome.label: outcome.preparation["status"] for outcome in outcomes}
    assert ready == {"grid-astar": "ready", "grid-dijkstra": "ready", name_of(faulty.Dies): "lost"}
    status = {o.label: Counter(record["status"] for record in o.records) for o in outcomes}
    assert status[name_of(faulty.Dies)] == {"lost": 6}
    assert status["grid-astar"] == status["grid-dijkstra"]


@pytest.mark.parametrize(("workers", "timeout_s"), [(0, 1.0), (1, 0.0), (1, math.nan)])
def test_settings_of_workers_out_of_range(settings, tmp_path, workers, timeout_s):
    wrong = replace(settings, workers=workers, timeout_s=timeout_s)
    with pytest.raises(InvalidValueError, match="at least one worker and a positive timeout"):
        write_records(wrong, tmp_path)


def test_no_task_needs_no_process():
    assert list(workers.run_local([], workers=1, timeout_s=1.0)) == []


# --- settings of a run --------------------------------------------------------------------------


def test_what_cannot_be_evaluated_is_said_before_anything_runs(settings, rooms, tmp_path):
    file = tmp_path / "file"
    file.write_text("")
    wrong = {
        "no baseline is called 'x'": (replace(settings, baselines=("x",)), InvalidValueError),
        "step": (replace(settings, lattice_step_m=0.0), InvalidValueError),
        "pairs": (replace(settings, pairs=0), InvalidValueError),
        "seed": (replace(settings, seed=-1), InvalidValueError),
        "nowhere": (replace(settings, maps=("nowhere.yaml",)), MapError),
        "goes with one map": (
            replace(settings, maps=(str(rooms),) * 2, scenarios="x.scen"),
            InvalidValueError,
        ),
    }
    for words, (these, error) in wrong.items():
        with pytest.raises(error, match=words):
            write_records(these, tmp_path / "run")
    with pytest.raises(InvalidValueError, match=r"folder .*file"):
        write_records(settings, file)
    assert not (tmp_path / "run" / RECORDS_FILE).exists()


@pytest.mark.usefixtures("here")
def test_a_map_without_a_free_cell_has_preparations_only(settings, tmp_path):
    path = write_map(tmp_path, ["##", "##"], name="full")
    single = write_map(tmp_path, ["#.#"], name="single")
    only = replace(settings, maps=(str(path), str(single)), baselines=("hpa-star", "simple-graph"))
    assert write_records(only, tmp_path / "run") == 8
    records = read_records(tmp_path / "run")
    assert {(record["type"], record["status"]) for record in records} == {("preparation", "ready")}
    assert write_outputs(tmp_path / "run").faults == []


@pytest.mark.usefixtures("here")
def test_an_infinite_merge_distance_is_written_as_json(settings, rooms, tmp_path):
    preset = tmp_path / "one.yaml"
    preset.write_text("pyramid: {merge_distance_m: .inf}\n")
    ros = ROOT / "maps" / "figure1" / "figure1.yaml"
    only = replace(settings, maps=(str(ros),), presets=(str(preset),), baselines=(), pairs=3)
    write_records(replace(only, merge_distance_m=None), tmp_path / "run")
    record = next(r for r in read_records(tmp_path / "run") if r.get("preset"))
    assert record["preset"]["pyramid"]["merge_distance_m"] is None
    write_records(replace(only, merge_distance_m=math.inf, maps=(str(rooms),)), tmp_path / "other")
    for run in ("run", "other"):
        json.loads((tmp_path / run / "runs.jsonl").read_text(), parse_constant=pytest.fail)
        assert write_outputs(tmp_path / run).faults == []


@pytest.mark.usefixtures("here")
def test_corner_cutting_breaks_the_consistency_of_a_run(settings, tmp_path):
    path = write_map(tmp_path, ["...###", "...###", "###...", "###..."])
    only = replace(settings, maps=(str(path),), baselines=(), pairs=10)
    write_records(only, tmp_path / "run")
    assert write_outputs(tmp_path / "run").faults == []
    write_records(replace(only, corner_cutting=True), tmp_path / "cut")
    study = write_outputs(tmp_path / "cut")
    found = {(outcome.label, fault) for outcome, _, fault in study.faults}
    assert ("paper", "solvability: moves join two cells, regions do not") in found
    assert "moves join two cells" in (tmp_path / "cut" / "report.html").read_text()


# --- two runs compared --------------------------------------------------------------------------


def rows_of(first, second):
    return [dict[str, Any](row) for row in compare_runs(first, second)]


def test_a_run_equals_itself(unbroken):
    rows = compare_runs(unbroken, unbroken)
    assert {row["method"] for row in rows} == {"Slow", "simple-graph", "paper"}
    for row in rows:
        assert row["map"] == "rooms"
        assert row["pairs"] == N_PAIRS
        assert row["solved by the first only"] == row["solved by the second only"] == 0
        assert row["difference, points"] == 0
        assert row["p of the loss"] == row["p of the time"] == 1
        assert row["time, second / first"] == 1
        assert row["loss of the first %"] == row["loss of the second %"]


@pytest.mark.usefixtures("here")
def test_the_difference_of_two_settings_is_second_minus_first(settings, unbroken, tmp_path):
    other = replace(settings, baselines=(), merge_distance_m=2.0)
    write_records(other, tmp_path)
    (row,) = rows_of(unbroken, tmp_path)
    (back,) = rows_of(tmp_path, unbroken)
    assert row["method"] == "paper"
    assert row["pairs"] == N_PAIRS
    difference = row["loss of the second %"] - row["loss of the first %"]
    assert difference != 0
    assert row["difference, points"] == pytest.approx(difference)
    assert back["difference, points"] == pytest.approx(-difference)
    assert row["p of the loss"] == pytest.approx(back["p of the loss"])
    assert 0 < row["p of the loss"] <= 1
    losses = {
        outcome.label: outcome.losses.mean() * 100 for outcome in load_study(tmp_path).outcomes
    }
    assert row["loss of the second %"] == pytest.approx(losses["paper"])


@pytest.mark.usefixtures("here")
def test_runs_with_nothing_in_common(settings, unbroken, tmp_path):
    ros = ROOT / "maps" / "figure1" / "figure1.yaml"
    write_records(replace(settings, maps=(str(ros),), baselines=(), pairs=3), tmp_path / "other")
    with pytest.raises(InvalidValueError, match="share no method, map and pair"):
        compare_runs(unbroken, tmp_path / "other")
    for folder in (tmp_path, tmp_path / "nowhere", Path(__file__)):
        with pytest.raises(InvalidValueError):
            compare_runs(unbroken, folder)
