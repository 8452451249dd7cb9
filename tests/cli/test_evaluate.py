"""`hybridnav evaluate` and `hybridnav compare`: their files, their output, their exit codes."""

import csv
import json
import re
import warnings

import pytest

from hybridnav.harness.records import RECORDS_FILE, read_records
from hybridnav.harness.scenes import sample_pairs
from hybridnav.maps.files import load_map
from tests.cli.test_commands import FIGURE
from tests.harness import faulty_methods as faulty
from tests.harness.small_runs import ROOMS, importable, label_of, name_of, run_here, write_map

OUTPUTS = {RECORDS_FILE, "runs.jsonl", "summary.csv", "maps.csv", "summary.md", "report.html"}


@pytest.fixture(autouse=True)
def _importable(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", importable())


@pytest.fixture
def here(monkeypatch):
    """No processes."""
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_here)


@pytest.fixture
def rooms(tmp_path):
    return write_map(tmp_path, ROOMS)


def scenarios(folder, *lines, size="20\t11"):
    path = folder / "rooms.scen"
    problems = "".join(f"0\trooms.map\t{size}\t{line}\n" for line in lines)
    path.write_text(f"version 1\n{problems}")
    return path


def test_an_evaluation_of_the_figure(cli, tmp_path):
    out = tmp_path / "deep" / "run"
    arguments = ["evaluate", FIGURE, "--preset", "paper", "--baseline", "simple-graph"]
    arguments += ["--pairs", 20, "--seed", 5, "-o", out]
    done = cli(*arguments)
    assert (done.code, done.err) == (0, "")
    assert {path.name for path in out.iterdir()} == OUTPUTS
    for words in ("60 answers checked, 0 counter-examples", "## Loss", "## Efficiency", "report: "):
        assert words in done.out
    with (out / "summary.csv").open() as stream:
        rows = {row["method"]: row for row in csv.DictReader(stream)}
    assert rows.keys() == {"grid-astar", "simple-graph", "paper"}
    assert rows["grid-astar"]["octile loss max %"] == "0.0"
    assert {(row["pairs"], row["solved"], row["faults"]) for row in rows.values()} == {
        ("20", "20", "0")
    }
    run = json.loads((out / "runs.jsonl").read_text())
    assert (run["seed"], run["pairs"], run["sampler_version"]) == (5, 20, 1)
    report = (out / "report.html").read_text()
    assert "http://" not in report.replace("http://www.w3.org", "")
    assert "https://" not in report
    # Again: nothing to do, the same answer.
    before = (out / RECORDS_FILE).read_bytes()
    assert cli(*arguments).out == done.out
    assert (out / RECORDS_FILE).read_bytes() == before
    # And beside itself.
    beside = cli("compare", out, out)
    assert (beside.code, beside.err) == (0, "")
    assert "| paper | figure1 | 20 |" in beside.out


def test_a_counter_example_is_an_exit_code(cli, rooms, tmp_path):
    out = tmp_path / "run"
    bad = faulty.ThroughWall
    done = cli("evaluate", rooms, "--baseline", name_of(bad), "--pairs", 12, "-o", out)
    assert done.code == 1
    assert done.err.startswith("hybridnav: ")
    assert done.err.count("\n") == 1
    assert "counter-examples: " in done.err
    assert "is not free" in done.err
    assert "## Consistency" in done.out
    assert {path.name for path in out.iterdir()} == OUTPUTS
    assert {record["method"] for record in read_records(out)} == {"grid-astar", label_of(bad)}


def test_queries_in_which_a_method_raises_are_counted(cli, rooms, tmp_path):
    query = ("evaluate", rooms, "--baseline", name_of(faulty.Raises), "--pairs", 12)
    done = cli(*query, "-o", tmp_path / "run")
    records = read_records(tmp_path / "run")
    n_raised = sum(record["status"] == "error" for record in records)
    assert n_raised > 0
    assert done.code == 0  # as the pages say: the other answers may be sound
    words = f"hybridnav: queries that failed: {n_raised}, the first: rooms, "
    assert done.err.startswith(words)
    assert done.err.endswith("RuntimeError: odd rows are beyond me\n")
    assert done.err.count("\n") == 1


@pytest.mark.usefixtures("here")
def test_corner_cutting_is_a_counter_example(cli, tmp_path):
    path = write_map(tmp_path, ["...###", "...###", "###...", "###..."])
    query = ("evaluate", path, "--corner-cutting", "--pairs", 5, "-o", tmp_path / "run")
    assert cli(*query).refuses(2, "such as octile")
    done = cli(*query, "--preset", "octile")
    assert done.code == 1
    assert "counter-examples" in done.err


@pytest.mark.full
def test_a_method_that_forks_has_one_record_a_pair(cli, rooms, tmp_path, monkeypatch):
    pairs = sample_pairs(load_map(rooms), 6, seed=0)
    monkeypatch.setenv(faulty.FATAL_PAIR, pairs[3].key.partition(":")[2])
    out = tmp_path / "run"
    forks = ("--baseline", name_of(faulty.Forks), "--pairs", 6, "--repeat", 2)
    done = cli("evaluate", rooms, *forks, "-o", out)
    assert (done.code, done.err) == (0, "")
    records = read_records(out)
    assert len({record["id"] for record in records}) == len(records)
    answered = [r["status"] for r in records if r["method"] == label_of(faulty.Forks)]
    assert len(answered) == 1 + 6 + 1
    assert set(answered) <= {"ready", "solved", "no path"}
    assert len([r for r in records if r["status"] == "timed"]) == 7


@pytest.mark.usefixtures("here")
def test_texts_of_methods_do_not_steer_the_terminal(cli, rooms, tmp_path):
    out = tmp_path / "run"
    done = cli("evaluate", rooms, "--baseline", name_of(faulty.RaisesEscapes), "-o", out)
    summary = (out / "summary.md").read_text(encoding="utf-8")
    for text in (done.out, done.err, summary, (out / "report.html").read_text(encoding="utf-8")):
        assert re.findall("[\x00-\x08\x0b-\x1f\x7f-\x9f]", text) == []
    assert r"\x1b[2J\x1b]0;owned\x07\x9b31m" in summary


@pytest.mark.usefixtures("here")
def test_the_pairs_of_a_lattice(cli, tmp_path):
    path = write_map(tmp_path, ["....", "....", "...."])
    out = tmp_path / "run"
    done = cli("evaluate", path, "--all-pairs", 2, "--preset", "grid-astar", "-o", out)
    assert (done.code, done.err) == (0, "")
    pairs = [record for record in read_records(out) if record["type"] == "pair"]
    assert len(pairs) == 1
    assert {record["kind"] for record in pairs} == {"lattice"}


@pytest.mark.usefixtures("here")
def test_a_scenario_file_and_its_optimum(cli, rooms, tmp_path):
    # From the left room to the right one, along the third row: 10 straight steps.
    right = scenarios(tmp_path, "4\t3\t14\t3\t10", "1\t1\t1\t1\t0", "1\t1\t3\t2\t2.41421356")
    done = cli("evaluate", rooms, "--scen", right, "--preset", "paper", "-o", tmp_path / "right")
    assert (done.code, done.err) == (0, "")
    assert "6 answers checked, 0 counter-examples" in done.out
    wrong = scenarios(tmp_path, "4\t3\t14\t3\t10.5")
    done = cli("evaluate", rooms, "--scen", wrong, "--preset", "paper", "-o", tmp_path / "wrong")
    assert done.code == 1
    assert "the scenario states 10.500000 m, not 10.000000 m" in done.err
    # A robot that is not a point has another optimum, and some ends it cannot stand on.
    both = scenarios(tmp_path, "3\t3\t14\t4\t10.5", "1\t1\t14\t3\t13")
    arguments = ("--robot-radius", 1, "--preset", "paper", "-o", tmp_path / "inflated")
    with warnings.catch_warnings():
        warnings.simplefilter("default")  # the command prints it
        done = cli("evaluate", rooms, "--scen", both, *arguments)
    assert done.code == 0
    assert "1 of 2 start or end in a cell that is not free" in done.err
    assert "0 counter-examples" in done.out


@pytest.mark.usefixtures("here")
def test_each_table_has_the_loss_over_one_optimum(cli, rooms, tmp_path):
    out = tmp_path / "run"
    arguments = ["evaluate", rooms, "--preset", "grid-astar", "--pairs", 10, "-o", out]
    for metric in ("any-angle", "octile", "both"):
        done = cli(*arguments, "--metric", metric)
        assert (done.code, done.err) == (0, "")
        with (out / "summary.csv").open() as stream:
            (row,) = csv.DictReader(stream)
        assert float(row["octile loss mean %"]) == 0 < float(row["any-angle loss mean %"])
        assert row["pairs in common"] == "10"
        for optimum in ("any-angle", "octile"):
            heading = f"## Loss over the {optimum} optimum"
            assert (heading in done.out) == (metric in (optimum, "both"))


def test_wrong_usage_and_unreadable_files(cli, rooms, tmp_path):
    out = ("-o", tmp_path / "run")
    other = scenarios(tmp_path, "1\t1\t2\t2\t1.41", size="8\t8")
    file = tmp_path / "file"
    file.write_text("")
    cases = [
        ((rooms, "--scen", other, *out), 2, "8 x 8 cells, rooms has 11 x 20"),
        ((rooms, "--scen", other, "--all-pairs", 1, *out), 2, "--scen"),
        ((rooms, rooms, "--scen", other, *out), 2, "one map"),
        ((rooms, "--baseline", "star", *out), 2, "no baseline is called 'star'"),
        ((rooms, "--preset", "nonsense", *out), 2, "nonsense"),
        ((rooms, "--set", "planner.nonsense=1", *out), 2, "nonsense"),
        ((rooms, "--pairs", 0, *out), 2, "--pairs"),
        ((rooms, "--seed", -1, *out), 2, "seed"),
        ((rooms, "--all-pairs", "nan", *out), 2, "step"),
        ((rooms, "--workers", 0, *out), 2, "worker"),
        ((rooms, "--timeout", 0, *out), 2, "timeout"),
        ((rooms, "--robot-radius", -1, *out), 2, "radius"),
        ((rooms, "--scheduler", "nonsense", *out), 2, "scheduler nonsense"),
        ((rooms, "--metric", "l2", *out), 2, "got metric 'l2'"),
        ((rooms, "--metric", "any-angle", "--corner-cutting", *out), 2, "take --metric octile"),
        ((rooms,), 2, "--out"),
        ((*out,), 2, "MAP"),
        ((rooms, "-o", file), 2, "file"),
        ((tmp_path / "none.yaml", *out), 3, "none.yaml"),
        ((rooms, tmp_path / "none.map", *out), 3, "none.map"),
        ((rooms, "--scen", tmp_path / "none.scen", *out), 3, "none.scen"),
        ((rooms, "--scen", rooms, *out), 3, "version 1"),
    ]
    for arguments, code, words in cases:
        assert cli("evaluate", *arguments).refuses(code, words), arguments
    assert not (tmp_path / "run" / RECORDS_FILE).exists() or not read_records(tmp_path / "run")


def test_a_damaged_record_is_named(cli, rooms, tmp_path):
    out = tmp_path / "run"
    out.mkdir()
    (out / RECORDS_FILE).write_text("nonsense\n")
    assert cli("evaluate", rooms, "-o", out).refuses(2, "records.jsonl, line 1")
    assert cli("compare", out, out).refuses(2, "records.jsonl, line 1")


def test_runs_that_cannot_be_compared(cli, tmp_path):
    assert cli("compare", tmp_path, tmp_path / "none").refuses(2, "no records there")
    assert cli("compare", tmp_path, tmp_path, "--metric", "l2").refuses(2, "got metric 'l2'")


def test_costs_are_judged_and_printed_beside_lengths(cli, tmp_path):
    query = ("evaluate", FIGURE, "--robot-radius", "0", "--pairs", "5", "-o", tmp_path / "run")
    done = cli(*query, "--preset", "shortest", "--costs", "clearance:multiplier=4")
    assert done.code == 0
    assert "| length mean m | cost mean m | gap mean % |" in done.out
    assert cli(*query, "--metric", "weighted").refuses(2, "--metric weighted goes with --costs")
    assert cli(*query, "--costs", "walls").refuses(2, "--costs must begin with clearance")
    assert cli(*query).refuses(2, "holds a run with costs clearance:multiplier=4")
