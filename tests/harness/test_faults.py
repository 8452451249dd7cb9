"""Methods with a planted fault are caught by a run of the harness; sound ones are not."""

import csv
import json
import math
import re
import shlex
import sys
from collections import Counter
from dataclasses import replace
from html import unescape

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.harness.analysis import load_study, rows_of_study, to_frame
from hybridnav.harness.baselines import AnyAngleResult, MethodResult
from hybridnav.harness.columns import MEANINGS, consistency_row, figures
from hybridnav.harness.judging import Judge
from hybridnav.harness.methods import Prepared
from hybridnav.harness.output import write_outputs
from hybridnav.harness.records import read_records
from hybridnav.harness.report import command_of
from hybridnav.harness.run import RunSettings, write_records
from hybridnav.harness.scenes import Pair
from hybridnav.harness.yardstick import KINDS, contradiction
from tests.harness import faulty_methods as faulty
from tests.harness.small_runs import ROOMS, importable, label_of, name_of, outcome_of, write_map

FAULTS = {
    faulty.ThroughWall: "is not free",
    faulty.CutsCorners: "cuts a corner",
    faulty.TooLong: "breaks its bound, 1.000000 x optimum",
    faulty.Jumps: "is below the optimum",
    faulty.StopsShort: "the last cell is",
    faulty.LeavesTheMap: "is outside the map",
    faulty.WalksThroughAll: "solvability: solved, but on the whole grid: no path",
    faulty.NoCells: "no answer to judge",
    faulty.MissingDoor: "solvability: no path, but on the whole grid: solved",
    faulty.SkipsRegions: "no metric path inside regions",
    faulty.Backwards: "the plan does not start and end in the regions of start and goal",
    faulty.UnknownRegions: "the plan names region 1000000, which there is not",
    faulty.PlansAcrossWalls: "no metric path inside regions",
    faulty.PlansForAll: "solvability: planned, but on the whole grid: no path",
    faulty.PlansOfNothing: "cannot be judged where region_of is None: state the region",
    faulty.TornRegion: "is not connected",
    faulty.HomelessCells: "free cells are in no region",
}
OF_KIND = {
    faulty.CutsCorners: {"paths", "bounds"},
    faulty.StopsShort: {"paths", "bounds"},
    faulty.TooLong: {"bounds"},
    faulty.Jumps: {"paths", "bounds"},
    faulty.WalksThroughAll: {"paths", "no path", "bounds"},
    faulty.LeavesTheMap: {"paths", "no path"},
    faulty.MissingDoor: {"no path"},
    faulty.SkipsRegions: {"plan to path"},
    faulty.Backwards: {"plan to path"},
    faulty.UnknownRegions: {"plan to path"},
    faulty.PlansAcrossWalls: {"plan to path"},
    faulty.PlansForAll: {"plan to path", "no path"},
    faulty.TornRegion: {"regions"},
    faulty.HomelessCells: {"regions", "path to plan"},
}
"""Kinds of their faults; `paths` for the others."""
SOUND = (faulty.Sound, faulty.SoundPlaces, faulty.HonestlyLong)
FAILING = (faulty.Raises, faulty.CannotBeMade, faulty.FailsAtOnce)
N_PAIRS = 40


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("faults")
    methods = map(name_of, (*FAULTS, *SOUND, *FAILING))
    settings = RunSettings(
        maps=(str(write_map(folder, ROOMS)),),
        presets=("paper",),
        baselines=("simple-graph", *methods),
        pairs=N_PAIRS,
        merge_distance_m=4.0,
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", importable())
        write_records(settings, folder / "run")
    return folder / "run"


@pytest.fixture(scope="module")
def study(folder):
    return write_outputs(folder)


@pytest.mark.parametrize("method", FAULTS)
def test_a_planted_fault_is_caught(study, method):
    found = [fault for _, fault in outcome_of(study, method).faults]
    assert any(FAULTS[method] in fault for fault in found), found[:3]


@pytest.mark.parametrize("method", ["grid-astar", "simple-graph", "paper", *SOUND])
def test_a_sound_method_has_no_fault(study, method):
    outcome = outcome_of(study, method)
    assert outcome.faults == []
    assert outcome.checks == N_PAIRS + 2
    assert outcome.failures == 0


@pytest.mark.parametrize("method", FAULTS)
def test_a_planted_fault_is_in_the_column_of_its_kind(study, method):
    row = consistency_row([outcome_of(study, method)])
    kinds = {kind for kind in KINDS if row[f"{kind} wrong"]}
    assert OF_KIND.get(method, {"paths"}) == kinds, kinds
    for kind in KINDS:
        assert 0 <= int(row[f"{kind} wrong"]) <= int(row[f"{kind} checked"])


@pytest.mark.parametrize("method", ["grid-astar", "simple-graph", "paper", *SOUND])
def test_the_table_of_consistency_counts_checks(study, method):
    row = consistency_row([outcome_of(study, method)])
    assert [row[f"{kind} wrong"] for kind in KINDS] == [0] * len(KINDS)
    layers = (1, N_PAIRS, N_PAIRS) if row["regions checked"] else (0, 0, 0)
    counted = [row[f"{kind} checked"] for kind in KINDS]
    assert counted == [*layers, N_PAIRS, N_PAIRS + 2, N_PAIRS, 0]  # no proofs
    assert row['"no path", right'] == 2
    assert row["paths"] == f"0 of {N_PAIRS}"
    assert bool(row["regions"]) == (row["regions checked"] == 1)


def test_every_column_of_the_report_is_explained(folder, study):
    report = (folder / "report.html").read_text()
    columns = {unescape(text) for text in re.findall(r'<th scope="col"[^>]*>([^<]*)', report)}
    section = report.partition('id="columns"')[2]
    explained = set(map(unescape, re.findall(r"<dt>([^<]*)</dt>", section)))
    assert "overflow-x" not in report
    by_distance = {column for column in columns if re.search(r"\(\d+\)$", column)}
    assert columns - by_distance == explained
    assert explained <= MEANINGS.keys()
    assert study.labels


def test_counter_examples_can_be_pasted_and_lead_to_their_pictures(folder, study):
    report = unescape((folder / "report.html").read_text())
    links = re.findall(r'<a href="#(case-[^"]*)">picture', report)
    assert len(links) > 10
    assert all(report.count(f'id="{link}"') == 1 for link in links)
    commands = re.findall("<code>(hybridnav plan [^<]*)</code>", report)
    assert len(commands) > 20
    # The first fault is that of a pair: its command has the centres of the two cells in metres.
    outcome, record, _ = next(fault for fault in study.faults if fault[1]["type"] == "pair")
    words = shlex.split(command_of(outcome, record))
    grid = hn.load_map(words[2], robot_radius_m=float(words[5].partition("=")[2]))
    points = [list(map(float, word.partition("=")[2].split(","))) for word in words[3:5]]
    assert grid.frame.cells_of(points).tolist() == [record["start"], record["goal"]]
    assert words[6:] == ["--preset=grid-astar"]  # a class is no preset: the reference plans
    of_preset = replace(outcome, preparation=outcome.preparation | {"preset": {"name": "paper"}})
    assert shlex.split(command_of(of_preset, record))[6:] == ["--preset=paper"]


def test_nothing_is_found_that_was_not_planted(study):
    for method in (faulty.ThroughWall, faulty.HomelessCells, faulty.TooLong, faulty.Backwards):
        found = [fault for _, fault in outcome_of(study, method).faults]
        wrong = [fault for fault in found if FAULTS[method] not in fault]
        if method is faulty.ThroughWall:  # a cell inside an obstacle is several things at once
            wrong = [one for one in wrong if "blocked cell" not in one and "corner" not in one]
        if method is faulty.HomelessCells:  # nor can paths and plans be there
            wrong = [one for one in wrong if "leaves the regions" not in one]
        assert not wrong


def test_all_that_is_lost_by_a_lie_is_counted(study):
    outcome = outcome_of(study, faulty.TooLong)
    assert len(outcome.faults) == N_PAIRS
    # A path that breaks its bound is no solved pair: it has no loss.
    row = figures([outcome], [], set())
    assert (row["solved"], row["solved %"], row["pairs"]) == (0, 0, N_PAIRS)
    honest = outcome_of(study, faulty.HonestlyLong)
    assert (honest.losses >= 0.05 - 1e-9).all()


def test_a_failing_method_leaves_records_and_the_run_goes_on(study):
    outcome = outcome_of(study, faulty.Raises)
    status = Counter(record["status"] for record in outcome.records)
    assert status.keys() == {"solved", "no path", "error"} or status.keys() == {"solved", "error"}
    assert {record.get("error") for record in outcome.records if record["status"] == "error"} == {
        "RuntimeError: odd rows are beyond me"
    }
    assert outcome.failures == status["error"]
    assert outcome.faults == []


@pytest.mark.parametrize(
    ("method", "words"),
    [(faulty.CannotBeMade, "RuntimeError: too small a map"), (faulty.FailsAtOnce, "KeyError")],
)
def test_a_preparation_that_fails_fails_all_its_pairs(study, method, words):
    outcome = outcome_of(study, method)
    assert outcome.preparation["status"] == "error"
    assert {record["status"] for record in outcome.records} == {"error"}
    assert len(outcome.records) == N_PAIRS + 2
    assert all(words in record["error"] for record in (outcome.preparation, *outcome.records))
    assert outcome.faults == []


def test_every_query_has_one_record(folder):
    records = read_records(folder)
    ids = [record["id"] for record in records]
    assert len(set(ids)) == len(ids)
    methods = 3 + len(FAULTS) + len(SOUND) + len(FAILING)
    assert len(ids) == methods * (1 + N_PAIRS + 2)


def test_counter_examples_are_in_all_that_is_written(folder, study):
    with (folder / "summary.csv").open() as stream:
        rows = {row["method"]: row for row in csv.DictReader(stream)}
    for method in FAULTS:
        assert int(rows[label_of(method)]["faults"]) > 0
    for method in ("grid-astar", "simple-graph", "paper", *map(label_of, SOUND)):
        assert int(rows[method]["faults"]) == 0
    report = (folder / "report.html").read_text()
    assert report.count("data:image/png") > 3
    assert "is not free" in report
    assert "when the last run began" in report  # without --repeat there is a load, too
    assert f"{len(study.faults)} counter-examples" in (folder / "summary.md").read_text()
    assert load_study(str(folder)).labels == study.labels


def test_a_data_frame_holds_what_the_tables_say(study):
    frame = to_frame(study)
    rows = {str(row["method"]): row for row in rows_of_study(study)}
    ends = ["start_row", "start_col", "goal_row", "goal_col"]
    solved = frame[frame["length_m"].notna()].groupby(ends)["method"].nunique()
    common = solved == frame[frame["length_m"].notna()]["method"].nunique()
    for label, part in frame.groupby("method"):
        row = rows[str(label)]
        assert part["octile_optimum_m"].count() == row["pairs"]
        assert part["length_m"].count() == row["solved"]
        asked = sum(len(outcome.records) for outcome in study.of_method(str(label)))
        assert len(part) == asked == N_PAIRS + 2
        there = common.reindex(part.set_index(ends).index, fill_value=False)
        shared = part[there.to_numpy(bool)]
        shared = shared[shared["length_m"].notna()]
        assert len(shared) == row["pairs in common"]
        expected = {
            "octile loss mean %": 100 * shared["octile_loss"].mean(),
            "any-angle loss max %": 100 * shared["any_angle_loss"].max(),
            "octile loss mean of all solved %": 100 * part["octile_loss"].mean(),
            "query ms, median": 1e3 * shared["seconds"].median(),
            "expansions": shared["expanded"].mean(),
            "speed-up": (shared["reference_seconds"] / shared["seconds"]).median(),
            "speed-up of means": shared["reference_seconds"].mean() / shared["seconds"].mean(),
        }
        for column, value in expected.items():
            assert value == pytest.approx(row[column], nan_ok=True), (label, column)
    lengths = frame["octile_optimum_m"] * (1 + frame["octile_loss"])
    known = frame["octile_loss"].notna()
    assert lengths[known].to_numpy() == pytest.approx(frame["length_m"][known].to_numpy())
    queries = frame[frame["octile_optimum_m"].notna()].groupby(ends)
    assert (queries["octile_optimum_m"].nunique() == 1).all()


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize("costs", [(), ("clearance",)])
def test_head_tables_records_and_data_frame_count_alike(tmp_path, cli, costs):
    run, by = tmp_path / "run", [f"--costs={cost}" for cost in costs]
    for name in (*(f"Liar{seed}" for seed in range(6)), "TornRegion"):
        by += ["--baseline", f"{faulty.__name__}:{name}"]
    said = cli("evaluate", str(write_map(tmp_path, ROOMS)), "--pairs", "20", *by, "-o", str(run))
    assert said.code == 1

    def number(pattern, text):
        return int(re.findall(pattern, text)[0])

    records = read_records(run)
    found = Counter(record["method"] for record in records for _ in record["faults"])
    count = sum(found.values())
    assert count > 100
    assert number(r"checked, (\d+) counter-examples", said.out) == count
    assert number(r"counter-examples: (\d+)", said.err) == count
    assert number(r"(\d+) counter-examples in", (run / "report.html").read_text()) == count
    study = load_study(run)
    kinds = Counter(kind for record in records for kind in record.get("fault_kinds", ()))
    rows = rows_of_study(study)
    for kind in KINDS:
        assert sum(int(row[f"{kind} wrong"]) for row in rows) == kinds[kind], kind
    frame = to_frame(study)
    for row in rows:
        method = str(row["method"])
        mine = frame[frame["method"] == method]
        of_pairs = int(mine["faults"].sum())
        known = found[method]
        assert (row["faults"], of_pairs + int(row["regions wrong"])) == (known, known)
        assert mine["length_m"].count() == row["solved"]
        assert mine.loc[mine["faults"] > 0, "length_m"].isna().all()
    for record in records:
        kinds_there = record.get("fault_kinds", [])
        assert len(record["faults"]) == len(set(kinds_there)) == len(kinds_there)


def test_a_false_no_path_of_a_method_with_regions_counts_once(folder, study):
    outcome = outcome_of(study, faulty.MissingDoor)
    wrong = [one for one in outcome.records if one["status"] == "no path" and one["faults"]]
    lines = map(json.loads, (folder / "records.jsonl").read_text().splitlines())
    written = [one for one in lines if one["method"] == label_of(faulty.MissingDoor)]
    assert len(wrong) == len(outcome.faults) == sum(len(one["faults"]) for one in written) > 5


@pytest.mark.parametrize("bound", [math.nan, 0.5, -math.inf, 0.0])
def test_a_bound_that_is_no_factor_is_a_contradiction(bound):
    grid = hn.OccupancyGrid(np.zeros((2, 3), np.float32), robot_radius_m=0)
    prepared = Prepared(faulty.Sound(grid), None, 0.0, 0.0)
    answer = MethodResult(np.array([[0, 0], [0, 1]]), bound=bound)
    _, found, _ = Judge(grid, prepared, reference=False).faults(Pair((0, 0), (0, 1)), answer)
    assert found == [("bounds", f"a bound is a factor of 1 or more, got {bound}")]


OPTIMA = {"status": "solved", "length_m": 5.0, "any_angle_m": 4.5, "weighted_m": 7.0}
LINE = {"status": "solved", "metric": "any-angle", "length_m": 6.0}
CELLS = {"status": "solved", "length_m": 5.0}


@pytest.mark.parametrize(
    ("record", "words"),
    [
        (CELLS | {"length_m": 4.99999995}, "length 4.99999995 m is below the optimum 5.0 m"),
        (
            CELLS | {"length_m": 7.500000075, "bound": 1.5},
            "length 7.500000075 m breaks its bound, 1.500000 x optimum 5.000000 m = 7.5 m",
        ),
        (CELLS | {"cost_m": 6.99999993}, "cost 6.99999993 m is below the weighted optimum 7.0 m"),
        (
            CELLS | {"cost_m": 8.0, "cost_lower_bound_m": 7.00000007},
            "the lower bound on costs 7.00000007 m is above the weighted optimum 7.0 m",
        ),
        (
            LINE | {"cost_m": 8.0, "cost_grid_bound_m": 7.00000007},
            "the lower bound on paths of cells 7.00000007 m is above the weighted optimum 7.0 m",
        ),
        (
            LINE | {"length_m": 4.5 * (1 - 1.1e-6)},
            "length 4.499995 m is below the any-angle optimum 4.500000 m",
        ),
    ],
)
def test_a_contradiction_is_seen_in_its_digits(record, words):
    assert contradiction(record, OPTIMA) == ("bounds", words)


def test_a_claim_that_is_wrong_is_seen_in_its_digits():
    grid = hn.OccupancyGrid(np.zeros((1, 2), np.float32), robot_radius_m=0)
    judge = Judge(grid, Prepared(faulty.Sound(grid), None, 0.0, 0.0), reference=False)
    points = np.array([[0.5, 0.5], [1.5, 0.5]])
    line = AnyAngleResult(points, 1.00000002, lower_bound_m=1.00000001)
    _, found, _ = judge.faults(Pair((0, 0), (0, 1)), MethodResult(None, any_angle=line))
    assert [text for _, text in found] == [
        "the length is 1.0 m, not 1.00000002 m as reported",
        "the lower bound 1.00000001 m is above the length 1.0 m",
    ]


def test_a_data_frame_without_pandas_is_refused_in_one_line(study, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(hn.errors.InvalidValueError, match=r"pip install 'hybridnav\[study\]'"):
        to_frame(study)
