"""The timing pass: interleaved, repeated, resumed pair by pair; its circumstances."""

import json
import math
import statistics
import time
from collections import Counter
from dataclasses import replace
from datetime import datetime, timedelta, timezone

import pytest

from hybridnav.errors import InvalidValueError
from hybridnav.harness.analysis import load_study
from hybridnav.harness.baselines.grid import GridAstar as Baseline
from hybridnav.harness.methods import baseline_spec
from hybridnav.harness.output import write_outputs
from hybridnav.harness.records import RECORDS_FILE, read_records
from hybridnav.harness.run import RunSettings, write_records
from hybridnav.harness.scenes import MapSpec, Pair, read_scene, sample_pairs
from hybridnav.harness.timing import TimingTask, circumstances_of
from hybridnav.maps.files import load_map
from tests.harness import faulty_methods as faulty
from tests.harness.small_runs import ROOMS, importable, name_of, write_map

N_PAIRS, REPEAT = 12, 3
TIMES = ("times", "date", "load")
ANSWERS = N_PAIRS + 1
"""With the pair across components."""


@pytest.fixture
def settings(tmp_path):
    rooms = write_map(tmp_path, ROOMS)
    return RunSettings(
        maps=(str(rooms),),
        presets=(),
        baselines=("hpa-star", "thrun"),
        pairs=N_PAIRS,
        repeat=REPEAT,
    )


def timed(folder):
    return [r for r in read_records(folder) if r["type"] in {"timing", "timed pair"}]


@pytest.mark.usefixtures("here")
def test_times_are_medians_of_all_methods_on_every_pair(settings, tmp_path):
    made = write_records(settings, tmp_path / "run")
    assert made == 3 * (1 + ANSWERS) + 1 + ANSWERS
    head, *pairs = timed(tmp_path / "run")
    assert len(head["methods"]) == 3
    for record in pairs:
        assert sorted(record["times"]) == head["methods"]
        assert {len(times) for times in record["times"].values()} == {REPEAT}
        assert all(time > 0 for times in record["times"].values() for time in times)
    study = write_outputs(tmp_path / "run")
    for outcome in study.outcomes:
        sha = outcome.preparation["method_sha"]
        medians = {
            (tuple(r["start"]), tuple(r["goal"])): statistics.median(r["times"][sha]) for r in pairs
        }
        ends = [(tuple(r["start"]), tuple(r["goal"])) for r in outcome.references]
        assert outcome.seconds.tolist() == [medians[end] for end in ends]
        assert len(outcome.spreads) == N_PAIRS
        assert (outcome.spreads >= 0).all()
    text = (tmp_path / "run" / "report.html").read_text()
    assert f"medians of {REPEAT} queries of each pair" in text
    for words in ("load of the machine", "measured", "command", "processor"):
        assert f"<dt>{words}</dt>" in text
    assert "spread %" in (tmp_path / "run" / "summary.md").read_text()


def test_the_order_of_methods_is_shuffled_by_a_seed(settings, monkeypatch):
    asked = []

    class Spy:
        n_nodes = n_edges = memory_bytes = 0
        region_of = None

        def __init__(self, name):
            self.name = name

        def solve(self, start, goal):  # noqa: ARG002
            asked.append(self.name)

    class Made:
        def __init__(self, spec):
            self.ask = Spy(spec.name).solve

        def close(self):
            asked.append("closed")

    monkeypatch.setattr("hybridnav.harness.timing.warm_up", lambda *_, **__: None)
    monkeypatch.setattr("hybridnav.harness.timing.prepare", lambda spec, *_: Made(spec))
    spec = MapSpec(settings.maps[0], 0.0)
    methods = tuple(baseline_spec(name) for name in ("grid-astar", "hpa-star", "thrun"))
    pairs = tuple(Pair((1, 1), (2, col)) for col in range(2, 8))
    task = TimingTask(spec, read_scene(spec).digest, methods, pairs, 20)
    list(task.run())
    turns = [tuple(asked[at : at + 3]) for at in range(0, len(asked) - 3, 3)]
    assert all(sorted(turn) == ["grid-astar", "hpa-star", "thrun"] for turn in turns)
    assert set(Counter(turns).values()) <= set(range(5, 40))
    assert len(set(turns)) == 6
    assert asked[-3:] == ["closed"] * 3
    first, asked[:] = list(asked), []
    list(task.run())
    assert asked == first
    asked.clear()
    list(replace(task, seed=1).run())
    assert asked != first


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("left", [1, 2, 7])
def test_a_pass_that_was_broken_off_goes_on(settings, tmp_path, left):
    write_records(settings, tmp_path / "run")
    lines = (tmp_path / "run" / RECORDS_FILE).read_bytes().splitlines(keepends=True)
    before = [json.loads(line) for line in lines]
    (tmp_path / "run" / RECORDS_FILE).write_bytes(b"".join(lines[: -ANSWERS - 1 + left]))
    assert write_records(settings, tmp_path / "run") == ANSWERS + 1 - left
    after = read_records(tmp_path / "run")
    plain = [[{k: v for k, v in r.items() if k not in TIMES} for r in rs] for rs in (before, after)]
    assert plain[0] == plain[1]
    assert write_records(settings, tmp_path / "run") == 0


@pytest.mark.usefixtures("here")
def test_a_method_more_is_timed_with_the_others_again(settings, tmp_path):
    write_records(settings, tmp_path / "run")
    more = replace(settings, baselines=(*settings.baselines, "grid-dijkstra"))
    assert write_records(more, tmp_path / "run") == 2 * (1 + ANSWERS)
    study = load_study(tmp_path / "run")
    assert study.circumstances.apart == ()
    sizes = {len(r["times"]) for r in timed(tmp_path / "run") if r["type"] == "timed pair"}
    assert sizes == {3, 4}
    write_records(replace(settings, baselines=("weighted-astar",), repeat=0), tmp_path / "run")
    report = write_outputs(tmp_path / "run").circumstances
    assert report.apart == ("weighted-astar",)
    assert "weighted-astar were not taken beside" in (tmp_path / "run" / "summary.md").read_text()


@pytest.mark.full
def test_a_query_that_was_lost_is_not_asked_again(settings, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", importable())
    pairs = sample_pairs(load_map(settings.maps[0]), N_PAIRS, seed=settings.seed)
    fatal = pairs[N_PAIRS // 2]
    monkeypatch.setenv(faulty.FATAL_PAIR, fatal.key.partition(":")[2])
    run = replace(settings, baselines=(name_of(faulty.Dies),))
    write_records(run, tmp_path / "run")
    found = timed(tmp_path / "run")
    assert {record["status"] for record in found} == {"ready", "timed"}
    sizes = {(tuple(r["start"]), tuple(r["goal"])): len(r["times"]) for r in found[1:]}
    assert {ends for ends, size in sizes.items() if size == 1} == {(fatal.start, fatal.goal)}
    assert Counter(sizes.values()) == {2: ANSWERS - 1, 1: 1}


@pytest.mark.usefixtures("here")
def test_a_busy_machine_is_a_warning(settings, tmp_path):
    write_records(settings, tmp_path / "run")
    path = tmp_path / "run" / RECORDS_FILE
    for load, is_busy in ((0.9, False), (1.4, False), (1.9, True)):
        records = [r | ({"load": load} if "load" in r else {}) for r in read_records(path.parent)]
        path.write_text("".join(json.dumps(record) + "\n" for record in records))
        study = write_outputs(path.parent)
        assert study.circumstances.is_busy == is_busy
        for file in ("summary.md", "report.html"):
            assert ("The machine was busy" in (path.parent / file).read_text()) == is_busy


def loads_over_time(before, within, seconds, step_s=20):
    """Records of a pass of some seconds; each second of it has a load, and the mean forgets."""
    began = datetime(2026, 5, 1, tzinfo=timezone.utc)
    load, found = before, []
    for second in range(seconds + 1):
        if second % step_s == 0:
            date = (began + timedelta(seconds=second)).isoformat()
            found.append({"status": "timed", "repeat": 2, "date": date, "load": round(load, 2)})
        load += (1 - math.exp(-1 / 60)) * (within(second) - load)
    return found


@pytest.mark.parametrize(
    ("before", "within", "seconds", "is_busy"),
    [
        (3.0, lambda _: 1.0, 300, False),  # the run's own answers, then the pass alone
        (8.0, lambda _: 1.0, 300, False),
        (0.2, lambda _: 1.0, 300, False),
        (3.0, lambda _: 2.0, 300, True),
        (0.2, lambda _: 2.0, 300, True),
        (2.0, lambda second: 1.0 if second < 200 else 4.0, 300, True),
        (3.0, lambda second: 4.0 if second < 60 else 1.0, 300, True),
        (3.0, lambda _: 1.0, 40, True),  # too short to tell: the machine may be busy
    ],
)
def test_the_load_of_the_answers_before_is_not_that_of_the_pass(before, within, seconds, is_busy):
    about = circumstances_of(loads_over_time(before, within, seconds), (), {}, ())
    assert about.loads[0] == before
    assert about.is_busy == is_busy
    assert bool(about.warnings) == is_busy
    words = dict(about.facts)["load of the machine"]
    assert words.startswith(f"{before:.2f} at the start")
    assert ("without earlier load" in words) == (seconds > 60)


@pytest.mark.usefixtures("here")
def test_without_repeats_the_report_says_how_times_were_taken(settings, tmp_path):
    write_records(replace(settings, repeat=0), tmp_path / "run")
    assert timed(tmp_path / "run") == []
    write_outputs(tmp_path / "run")
    report = (tmp_path / "run" / "report.html").read_text()
    assert "of single queries, one method after the other" in report
    with pytest.raises(InvalidValueError, match="repeats are at least 0, got -1"):
        write_records(replace(settings, repeat=-1), tmp_path / "run")


@pytest.mark.usefixtures("here")
def test_a_slow_method_is_asked_once_for_all_pairs_but_the_first_two(
    settings, tmp_path, monkeypatch
):
    monkeypatch.setattr("hybridnav.harness.timing.LONG_S", 0.0)
    write_records(settings, tmp_path / "run")
    pairs = [record for record in timed(tmp_path / "run") if record["type"] == "timed pair"]
    counts = [{len(times) for times in record["times"].values()} for record in pairs]
    assert counts == [{REPEAT}] * 2 + [{1}] * (ANSWERS - 2)


@pytest.mark.usefixtures("here")
def test_a_first_query_that_prepares_is_no_long_one(settings, tmp_path):
    class_ = replace(settings, baselines=(name_of(Lazy),))
    write_records(class_, tmp_path / "run")
    pairs = [record for record in timed(tmp_path / "run") if record["type"] == "timed pair"]
    assert {len(times) for record in pairs for times in record["times"].values()} == {REPEAT}
    _, outcome = load_study(tmp_path / "run").outcomes
    assert outcome.seconds.max() < 0.05


class Lazy(Baseline):
    """A method that prepares in front of its first query."""

    def __init__(self, grid):
        super().__init__(grid)
        self.is_ready = False

    def solve(self, start, goal):
        """Plan between two free cells."""
        if not self.is_ready:
            self.is_ready = True
            time.sleep(0.2)
        return super().solve(start, goal)
