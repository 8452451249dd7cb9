"""A method that is too slow takes no study away: what is left is not asked, and says why."""

import json
import time
from dataclasses import replace

import pytest

from hybridnav.errors import InvalidValueError
from hybridnav.harness.baselines import MethodResult
from hybridnav.harness.output import write_outputs
from hybridnav.harness.records import read_records
from hybridnav.harness.run import RunSettings, evaluate
from tests.harness.small_runs import ROOMS, name_of, run_here, write_map

QUERY_S = 0.05


class Slow:
    """A method that never finds a path, and takes its time."""

    name, region_of, n_nodes, n_edges, memory_bytes = "slow", None, 0, 0, 0

    def __init__(self, grid):
        del grid

    def solve(self, start, goal):  # noqa: ARG002, D102
        time.sleep(QUERY_S)
        return MethodResult(None)


@pytest.fixture
def settings(tmp_path, monkeypatch):
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)
    rooms = write_map(tmp_path, ROOMS)
    return RunSettings(
        maps=(str(rooms),), presets=(), baselines=(name_of(Slow), "hpa-star"), pairs=10, repeat=2
    )


def of_method(folder, name):
    found = [r for r in read_records(folder) if r["type"] == "pair" and r["method"] == name]
    assert len(found) == 11
    return found


def test_what_is_left_is_not_asked(settings, tmp_path):
    folder = tmp_path / "run"
    made = evaluate(replace(settings, limit_s=2.5 * QUERY_S), folder)
    slow = of_method(folder, name_of(Slow))
    asked = [record for record in slow if record["status"] != "too slow"]
    left = [record for record in slow if record["status"] == "too slow"]
    assert 1 <= len(asked) <= 3
    assert slow == asked + left
    assert all(f"and {len(asked)} of 11 queries, at most 0.125 s" in r["error"] for r in left[:1])
    assert all(record["status"] == "solved" for record in of_method(folder, "hpa-star")[:10])
    timing = [r for r in read_records(folder) if r["type"] == "timing"]
    assert [len(record["methods"]) for record in timing] == [2]
    study = write_outputs(folder)
    assert study.of_method("slow")[0].failures == len(left)
    assert "not asked after 0." in (folder / "summary.md").read_text()
    assert evaluate(replace(settings, limit_s=2.5 * QUERY_S), folder) == 0
    assert made == len(read_records(folder))


def test_without_a_limit_everything_is_asked(settings, tmp_path):
    evaluate(replace(settings, repeat=0), tmp_path / "run")
    slow = of_method(tmp_path / "run", name_of(Slow))
    assert {record["status"] for record in slow} == {"no path"}


@pytest.mark.parametrize("limit_s", [0.0, -1.0, float("nan")])
def test_a_limit_is_positive(settings, tmp_path, limit_s):
    with pytest.raises(InvalidValueError, match="the limit must be positive"):
        evaluate(replace(settings, limit_s=limit_s), tmp_path / "run")


def test_each_map_may_have_a_scenario_file(settings, tmp_path):
    lines = ["#######", "#.....#", "#######"]
    hall = write_map(tmp_path, lines, "hall")
    row = "0\thall.map\t7\t3\t1\t1\t5\t1\t4.0\n"
    (tmp_path / "hall.scen").write_text("version 1\n" + row)
    both = replace(
        settings,
        maps=(*settings.maps, str(hall)),
        scenarios=("", str(tmp_path / "hall.scen")),
        baselines=("hpa-star",),
        repeat=0,
    )
    evaluate(both, tmp_path / "run")
    kinds = [
        (record["map"], record["kind"])
        for record in read_records(tmp_path / "run")
        if record["type"] == "pair" and record["method"] == "hpa-star"
    ]
    assert kinds.count(("hall", "scenario")) == 1
    assert kinds.count(("rooms", "sampled")) == 10
    run = json.loads((tmp_path / "run" / "runs.jsonl").read_text())
    assert run["scenarios"] == ["", str(tmp_path / "hall.scen")]
    with pytest.raises(InvalidValueError, match="got 1 for 2 maps"):
        evaluate(replace(both, scenarios=("hall.scen",)), tmp_path / "run")
