"""Methods that are not asked on a map, because they cannot take it or are too slow, and what the
tables say of it."""

import csv
import json
import math
import re
import time
from dataclasses import replace
from html import unescape

import pytest

from hybridnav.errors import InvalidValueError, UnsuitableMapError
from hybridnav.harness.analysis import load_study, rows_of_map, rows_of_study
from hybridnav.harness.baselines import MethodResult
from hybridnav.harness.baselines.grid import GridAstar
from hybridnav.harness.columns import EFFICIENCY_COLUMNS, figures, loss_columns
from hybridnav.harness.names import NamedMethod
from hybridnav.harness.output import rows_of_methods, write_outputs
from hybridnav.harness.records import read_records
from hybridnav.harness.run import RunSettings, write_records
from hybridnav.harness.tables import Row, ahead_of_presets
from tests.harness.small_runs import ROOMS, name_of, run_in, write_map

pytestmark = pytest.mark.usefixtures("here")

N_PAIRS = 8
LIMIT = "up to 100 columns, this map has 120"


class Narrow(GridAstar):
    """A* on maps of up to 100 columns."""

    def __init__(self, grid):
        super().__init__(grid)
        self.name, self.version, self.settings = "narrow", "narrow 1.2", "columns of its own"
        if grid.shape[1] > 100:
            raise UnsuitableMapError(f"up to 100 columns, this map has {grid.shape[1]}")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("not_asked")
    wide = [f"{'.' * 120}" for _ in range(6)]
    return run_in(
        folder,
        maps=(str(write_map(folder, ROOMS)), str(write_map(folder, wide, "wide"))),
        presets=("octile",),
        baselines=(f"{__name__}:Narrow",),
        methods=(
            NamedMethod("baseline", "HPA*", "HPA* (20)", {"cluster_cells": 20}),
            NamedMethod("preset", "octile", "near", {"planner.allow_unexplored": True}),
        ),
        pairs=N_PAIRS,
        repeat=2,
    )


@pytest.fixture(scope="module")
def study(folder):
    return write_outputs(folder)


def test_it_is_no_fault_and_no_query_without_an_answer(folder, study):
    assert (study.faults, study.failures) == ([], 0)
    rooms, wide = study.of_method("narrow") + study.of_method(f"{__name__}:Narrow")
    assert (rooms.is_asked, wide.is_asked) == (True, False)
    assert (wide.failure, wide.checks, len(wide.references)) == (None, 0, 0)
    records = [r for r in read_records(folder) if r["status"] == "not asked"]
    assert len(records) == 1 + N_PAIRS
    assert {r["error"] for r in records} == {LIMIT}
    assert not any("traceback" in r for r in records)


def test_the_pairs_of_the_map_count_for_the_others(study):
    rows = {str(row["method"]): row for row in rows_of_study(study)}
    assert rows["octile"]["pairs in common"] == 2 * N_PAIRS
    name = next(name for name in rows if "arrow" in name)
    narrow = rows[name]
    assert (narrow["maps"], narrow["pairs"], narrow["solved"]) == (1, N_PAIRS, N_PAIRS)
    # Its means would be those of other pairs.
    assert narrow["pairs in common"] == 0
    for column in ("octile loss mean %", "query ms, median", "preparation s", "memory MB"):
        assert math.isnan(float(narrow[column])), column
    there = {row["method"] for row in rows_of_map(study, "rooms")}
    assert {row["method"] for row in rows_of_map(study, "wide")} == there - {name}
    alone = next(row for row in rows_of_map(study, "rooms") if row["method"] == name)
    assert alone["pairs in common"] == N_PAIRS
    assert float(alone["query ms, median"]) > 0


def test_the_table_of_methods_has_the_reason(folder, study):
    rows = {str(row["method"]): row for row in rows_of_methods(study)}
    name = next(name for name in rows if "arrow" in name)
    assert rows[name] == {
        "method": name,
        "kind": f"class {__name__}:Narrow",
        "version": "narrow 1.2",
        "settings": "columns of its own",
        "not asked": f"on 1 of 2 maps: {LIMIT}",
    }
    assert rows["HPA* (20)"]["kind"] == "baseline hpa-star"
    assert rows["HPA* (20)"]["settings"] == "cluster_cells 20"
    assert rows["near"]["kind"] == "preset octile"
    assert (rows["octile"]["kind"], rows["grid-astar"]["kind"]) == ("preset", "baseline")
    assert "allow_unexplored true" in str(rows["near"]["settings"])
    assert str(rows["octile"]["version"]).startswith("hybridnav ")
    for text in ((folder / file).read_text() for file in ("report.html", "summary.md")):
        assert LIMIT in text
        assert "narrow 1.2" in text


def test_its_metric_is_that_of_the_maps_on_which_it_was_asked(study):
    refused, asked = sorted(study.of_method("narrow"), key=lambda one: one.is_asked)
    assert (refused.is_asked, asked.is_asked) == (False, True)
    refused = replace(refused)
    vars(refused)["metric"] = "any-angle"
    at = {one.map_name: one for one in study.of_method("grid-astar")}
    references = [at[one.map_name] for one in (refused, asked)]
    assert figures([refused, asked], references, set())["metric"] == "octile"


def test_a_run_of_it_alone_checks_nothing_and_says_why(cli, tmp_path):
    wide = write_map(tmp_path, ["." * 120] * 3, "wide")
    done = cli("evaluate", wide, "--baseline", f"{__name__}:Narrow", "-o", tmp_path / "run")
    assert done.code == 1
    assert f"nothing was checked: wide, {__name__}:Narrow: {LIMIT}" in done.err
    assert not load_study(tmp_path / "run").of_method(f"{__name__}:Narrow")[0].is_asked
    done = cli("evaluate", wide, "--baseline", f"{__name__}:Narrow", "--preset", "octile")
    assert done.code == 2  # no folder was named


def test_beside_others_it_exits_with_0(cli, tmp_path):
    wide = write_map(tmp_path, ["." * 120] * 3, "wide")
    arguments = ("--baseline", f"{__name__}:Narrow", "--preset", "octile", "--pairs", 3)
    done = cli("evaluate", wide, *arguments, "-o", tmp_path / "run")
    assert (done.code, done.err) == (0, "")
    assert LIMIT in done.out


# --- ahead of every preset ----------------------------------------------------------------------

PRESETS = {"one", "two"}
LOSSES: list[Row] = [
    {"method": "one", "octile loss mean %": 1.0, "octile loss max %": 9.0, "solved %": 100.0},
    {"method": "two", "octile loss mean %": 2.0, "octile loss max %": 5.0, "solved %": 90.0},
    {"method": "rival", "octile loss mean %": 0.5, "octile loss max %": 5.0, "solved %": 99.0},
    {"method": "best", "octile loss mean %": 0.25, "octile loss max %": 8.0, "solved %": 100.0},
]


def test_who_is_ahead_of_every_preset_is_named():
    said = ahead_of_presets(LOSSES, loss_columns("octile"), PRESETS)
    assert said == (
        'Ahead of every preset here: in "mean %" best (0.250), rival (0.500), against 1.00 of one.'
    )
    times: list[Row] = [
        {"method": "one", "query ms, median": 0.5, "speed-up of means": 4.0},
        {"method": "rival", "query ms, median": 0.2, "speed-up of means": 5.0},
        {"method": "slow", "query ms, median": 2.0, "speed-up of means": math.nan},
    ]
    assert ahead_of_presets(times, EFFICIENCY_COLUMNS, PRESETS) == (
        'Ahead of every preset here: in "query ms, median" rival (0.200), against 0.500 of one; '
        'in "speed-up of means" rival (5.00), against 4.00 of one.'
    )


def test_who_is_not_ahead():
    columns = loss_columns("octile")
    nobody = "No other method is ahead of every preset here."
    one, two, rival, best = LOSSES
    # Nearly equal; worse; with contradictions; on fewer maps.
    assert ahead_of_presets([one, rival | {"octile loss mean %": 0.9999}], columns, {"one"}) == (
        'Ahead of every preset here: in "max %" rival (5.00), against 9.00 of one.'
    )
    assert ahead_of_presets([two, one | {"octile loss max %": 6.0}], columns, {"two"}) != nobody
    wrong = [row | {"faults": 3} for row in (rival, best)]
    assert ahead_of_presets([one, *wrong], columns, {"one"}) == ""
    assert ahead_of_presets([one | {"maps": 3}, best | {"maps": 2}], columns, {"one"}) == ""
    assert ahead_of_presets([best | {"method": "one"}, two], columns, {"one"}) == (
        'Ahead of every preset here: in "max %" two (5.00), against 8.00 of one.'
    )
    assert (
        ahead_of_presets([best | {"method": "one"}, one | {"method": "x"}], columns, {"one"})
        == nobody
    )
    # Nothing to compare with.
    assert ahead_of_presets([rival, best], columns, PRESETS) == ""
    assert ahead_of_presets([one, two], columns, PRESETS) == ""
    assert ahead_of_presets([], columns, PRESETS) == ""


def test_at_most_four_are_named():
    many = [replace_name(LOSSES[3], f"rival {at}", 0.01 * at) for at in range(1, 8)]
    said = ahead_of_presets([LOSSES[0], *many], ("octile loss mean %",), {"one"})
    assert "rival 1 (0.0100), rival 2 (0.0200), rival 3 (0.0300), rival 4 (0.0400), 3 more" in said


def replace_name(row, name, mean):
    return row | {"method": name, "octile loss mean %": mean}


def test_the_report_has_the_sentence_below_its_tables(folder, study):
    rows = rows_of_study(study)
    with (folder / "summary.csv").open() as stream:
        written = {row["method"]: row for row in csv.DictReader(stream)}
    said = ahead_of_presets(rows, EFFICIENCY_COLUMNS, study.presets)
    assert study.presets == {"octile", "near"}
    for file in ("report.html", "summary.md"):
        assert said in unescape((folder / file).read_text())
    own = min(float(written[name]["preparation s"]) for name in study.presets)
    ahead = float(written["grid-astar"]["preparation s"]) < own
    part = re.search(r'in "preparation s" ([^;]*), against', said)
    assert ahead == (part is not None and "grid-astar" in part[1])


QUERY_S = 0.05


class Slow:
    """A method that never finds a path, and takes its time."""

    name, region_of, n_nodes, n_edges, memory_bytes = "slow", None, 0, 0, 0

    def __init__(self, grid):
        del grid

    def solve(self, start, goal):  # noqa: ARG002
        time.sleep(QUERY_S)
        return MethodResult(None)


@pytest.fixture
def settings(tmp_path):
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
    made = write_records(replace(settings, limit_s=2.5 * QUERY_S), folder)
    slow = of_method(folder, Slow.name)
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
    assert write_records(replace(settings, limit_s=2.5 * QUERY_S), folder) == 0
    assert made == len(read_records(folder))


def test_without_a_limit_everything_is_asked(settings, tmp_path):
    write_records(replace(settings, repeat=0), tmp_path / "run")
    slow = of_method(tmp_path / "run", Slow.name)
    assert {record["status"] for record in slow} == {"no path"}


@pytest.mark.parametrize("limit_s", [0.0, -1.0, float("nan")])
def test_a_limit_is_positive(settings, tmp_path, limit_s):
    with pytest.raises(InvalidValueError, match="the limit must be positive"):
        write_records(replace(settings, limit_s=limit_s), tmp_path / "run")


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
    write_records(both, tmp_path / "run")
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
        write_records(replace(both, scenarios=("hall.scen",)), tmp_path / "run")
