"""Methods by name: aliases, names and settings, classes that were mended, tracebacks."""

import csv
import json
import re
import sys
import time
from dataclasses import replace
from html import unescape

import pytest

from hybridnav.errors import InvalidValueError
from hybridnav.harness.analysis import load_study, rows_of_study, to_frame
from hybridnav.harness.compare import compare_runs
from hybridnav.harness.methods import baseline_spec
from hybridnav.harness.names import BASELINES, NamedMethod, class_of, source_hash
from hybridnav.harness.output import write_outputs
from hybridnav.harness.records import RECORDS_FILE, read_records
from hybridnav.harness.run import RunSettings, methods_of, write_records
from hybridnav.harness.workers import run_local
from tests.harness.small_runs import ROOMS, write_map

pytestmark = pytest.mark.usefixtures("here")

CLASS = """
from hybridnav.harness.baselines.grid import GridAstar

class Mine(GridAstar):
    def __init__(self, grid, *, name="HPA* of mine", weight=1):
        super().__init__(grid)
        self.name = name
        self.weight = weight
        if grid.shape != (30, 40) and weight == 3:
            self.helper()

    def helper(self):
        raise RuntimeError("weights above 2 are beyond me")

    def solve(self, start, goal):
        answer = super().solve(start, goal)
        return answer  # mended: {}
"""


@pytest.fixture
def settings(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.delitem(sys.modules, "mine", raising=False)
    (tmp_path / "mine.py").write_text(CLASS)
    rooms = write_map(tmp_path, ROOMS)
    return RunSettings(maps=(str(rooms),), presets=(), pairs=5, baselines=("mine:Mine",))


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ("A*", "grid-astar"),
        ("HPA*", "hpa-star"),
        ("hpa*", "hpa-star"),
        ("HPA* raw", "hpa-star-raw"),
        ("Dijkstra", "grid-dijkstra"),
        ("weighted A*", "weighted-astar"),
        ("WA*", "weighted-astar"),
        ("Thrun", "thrun"),
        *((name, name) for name in BASELINES),
    ],
)
def test_names_of_the_literature(written, name):
    assert baseline_spec(written).name == name


def test_a_name_that_is_not_there_has_a_hint():
    with pytest.raises(InvalidValueError, match=r"did you mean hpa-star\?"):
        baseline_spec("hpa-sta")


def test_a_class_is_called_what_it_calls_itself(settings, tmp_path):
    write_records(settings, tmp_path / "run")
    assert write_outputs(tmp_path / "run").labels == ["grid-astar", "HPA* of mine"]
    assert "HPA* of mine" in (tmp_path / "run" / "report.html").read_text()


def test_a_class_that_takes_the_name_of_another_method_has_its_path(settings, tmp_path):
    (tmp_path / "mine.py").write_text(CLASS.replace("HPA* of mine", "grid-astar"))
    write_records(settings, tmp_path / "run")
    study = write_outputs(tmp_path / "run")
    assert study.labels == ["grid-astar", "mine:Mine"]
    assert study.checks > 0
    assert study.faults == []


OTHERS = """
import os
from hybridnav.errors import UnsuitableMapError
from hybridnav.harness.baselines.grid import GridAstar

class Base(GridAstar):
    name = ""
    def __init__(self, grid):
        own = type(self).name
        super().__init__(grid)
        self.name = own or "said when made"
        self.is_real = grid.shape != (30, 40)

class Said(Base):
    name = "said by the class"

class Made(Base):
    pass

class Reference(Base):
    name = "grid-astar"

class Preset(Base):
    name = "octile"

class Twin(Base):
    name = "twin"

class OtherTwin(Twin):
    pass

class Lost(Base):
    name = "ends in a query"
    def solve(self, start, goal):
        if self.is_real:
            os._exit(3)
        return super().solve(start, goal)

class LostUnmade(Base):
    def __init__(self, grid):
        super().__init__(grid)
        if self.is_real:
            os._exit(4)

class Wrong(Base):
    name = "cannot be made"
    def __init__(self, grid):
        super().__init__(grid)
        if self.is_real:
            raise RuntimeError("not today")

class Narrow(Base):
    def __init__(self, grid):
        super().__init__(grid)
        if len(grid.classes) > 11 and self.is_real:
            raise UnsuitableMapError("up to 11 rows")
"""
NAMES = {
    "Said": "said by the class",
    "Made": "said when made",
    "Reference": "others:Reference",
    "Preset": "others:Preset",
    "Twin": "others:Twin",
    "OtherTwin": "others:OtherTwin",
    "Lost": "ends in a query",
    "LostUnmade": "others:LostUnmade",
    "Wrong": "cannot be made",
}
"""What each class is called, wherever it is."""


def names_in_tables(folder):
    """Return the names of methods in all that is written of a run but its records."""
    study = write_outputs(folder)
    found = {"labels": study.labels, "frame": to_frame(study)["method"].unique().tolist()}
    for file in ("summary.csv", "maps.csv"):
        with (folder / file).open() as stream:
            found[file] = [row["method"] for row in csv.DictReader(stream)]
    text = (folder / "summary.md").read_text()
    methods = text.partition("## Methods\n\n")[2].partition("\n\n")[0].splitlines()[2:]
    found["summary.md"] = [line.split(" | ")[0].removeprefix("| ") for line in methods]
    (facts,) = re.findall(
        r"<dt>methods</dt>\s*<dd>(.*?)</dd>", (folder / "report.html").read_text()
    )
    found["report.html"] = unescape(facts).split(", ")
    return {where: set(names) for where, names in found.items()}


def test_a_method_has_one_name_in_records_and_tables(tmp_path, monkeypatch):
    """Of classes that name themselves, take others' names, end their process, and are not made."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    monkeypatch.setattr("hybridnav.harness.run.run_local", run_local)  # processes end
    monkeypatch.setattr("hybridnav.harness.workers._ATTEMPTS", 1)
    (tmp_path / "others.py").write_text(OTHERS)
    settings = RunSettings(
        maps=(str(write_map(tmp_path, ROOMS)),),
        presets=("octile",),
        baselines=tuple(f"others:{name}" for name in NAMES),
        methods=(NamedMethod("class", "others:Said", "named by a user"),),
        pairs=1,
    )
    write_records(settings, tmp_path / "run")
    expected = {"grid-astar", "octile", "named by a user", *NAMES.values()}
    file = tmp_path / "run" / RECORDS_FILE
    lines = [json.loads(line) for line in file.read_text().splitlines()]
    assert {line["method"] for line in lines} == expected
    for path, name in NAMES.items():
        of_class = [one for one in lines if f"/others:{path}-" in one["id"]]
        assert {one["method"] for one in of_class} == {name}
        assert [one["made_by"] for one in of_class if "made_by" in one] == [f"others:{path}"]
    names = names_in_tables(tmp_path / "run")
    assert names == dict.fromkeys(names, expected)
    assert load_study(tmp_path / "run").faults == []
    compared = compare_runs(tmp_path / "run", tmp_path / "run")
    assert {row["method"] for row in compared} == expected - {"grid-astar"}
    assert write_records(settings, tmp_path / "run") == 0
    # Version 0.1 wrote `module:class`, and what a class calls itself into its preparation alone.
    older = []
    for line in lines:
        path = line["id"].split("/")[1].rpartition("-")[0]
        is_named = path.startswith("others:") and line["method"] == NAMES[path[7:]] != path
        own = {"label": line["method"]} if is_named and line["type"] == "preparation" else {}
        older.append(line | {"method": path if is_named else line["method"]} | own)
    file.write_text("".join(f"{json.dumps(line)}\n" for line in older))
    assert names_in_tables(tmp_path / "run") == names
    assert {one["method"] for one in read_records(tmp_path / "run")} == expected
    assert write_records(settings, tmp_path / "run") == 0


def test_a_class_has_its_name_on_maps_too_on_which_it_is_not_asked(settings, tmp_path):
    (tmp_path / "others.py").write_text(OTHERS)
    tall = str(write_map(tmp_path, [*ROOMS, *ROOMS], "tall"))
    run = replace(settings, maps=(tall, *settings.maps), baselines=("others:Narrow",))
    write_records(run, tmp_path / "run")
    names = names_in_tables(tmp_path / "run")
    assert names == {where: {"grid-astar", "said when made"} for where in names}
    records = read_records(tmp_path / "run")
    assert {one["method"] for one in records} == {"grid-astar", "said when made"}


def test_a_class_that_was_mended_is_run_again(settings, tmp_path):
    made = write_records(settings, tmp_path / "run")
    assert write_records(settings, tmp_path / "run") == 0
    (tmp_path / "mine.py").write_text(CLASS.replace("{}", "twice"))
    assert write_records(settings, tmp_path / "run") == made // 2
    study = write_outputs(tmp_path / "run")
    assert study.labels == ["grid-astar", "HPA* of mine"]
    sources = [r["source"] for r in read_records(tmp_path / "run") if "source" in r]
    assert study.of_method("HPA* of mine")[0].preparation["source"] == sources[-1]
    words = "answers 6 on rooms (asked again)."
    assert words in (tmp_path / "run" / "summary.md").read_text()
    # Back again: the records are there, and the tables show them.
    (tmp_path / "mine.py").write_text(CLASS)
    assert write_records(settings, tmp_path / "run") == 0
    study = write_outputs(tmp_path / "run")
    assert study.of_method("HPA* of mine")[0].preparation["source"] == sources[0]


def test_answers_before_a_class_was_mended_enter_no_table_with_new_ones(settings, tmp_path):
    halls = str(write_map(tmp_path, ROOMS[::-1], "halls"))
    write_records(replace(settings, maps=(*settings.maps, halls)), tmp_path / "run")
    (tmp_path / "mine.py").write_text(CLASS.replace("{}", "twice"))
    write_records(settings, tmp_path / "run")
    study = write_outputs(tmp_path / "run")
    assert [o.map_name for o in study.of_method("HPA* of mine")] == ["rooms"]
    (row,) = [row for row in rows_of_study(study) if row["method"] == "HPA* of mine"]
    assert (row["maps"], row["pairs"]) == (1, 5)
    words = (
        "Left out, because class mine:Mine (HPA* of mine) was changed after them: answers 6 on "
        "rooms (asked again), 6 on halls (not asked again)."
    )
    assert study.warnings[:1] == [words]
    for name in ("summary.md", "report.html"):
        assert words in (tmp_path / "run" / name).read_text()
    # A run that adds a method does not bring the old answers back.
    write_records(replace(settings, maps=(halls,), baselines=("weighted-astar",)), tmp_path / "run")
    assert write_outputs(tmp_path / "run").warnings == [words]


def test_a_class_is_another_one_when_a_file_that_it_imports_was_mended(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(str(tmp_path))
    package = tmp_path / "planners_of_mine"
    (package / "parts").mkdir(parents=True)
    for folder in (package, package / "parts"):
        (folder / "__init__.py").write_text("")
    (package / "method.py").write_text(
        "import json\nimport hybridnav\nfrom planners_of_mine.parts import deep\n"
        "class Mine:\n    pass\n"
    )
    (package / "parts" / "deep.py").write_text("from planners_of_mine.parts.deeper import LIMIT, f")
    deeper = package / "parts" / "deeper.py"
    deeper.write_text("LIMIT = 3\ndef f():\n    return LIMIT\n")
    (package / "other.py").write_text("x = 1")
    class_of("planners_of_mine.method:Mine")
    before = source_hash("planners_of_mine.method:Mine")
    (package / "other.py").write_text("x = 2")  # nobody imports it
    assert source_hash("planners_of_mine.method:Mine") == before
    deeper.write_text("LIMIT = 4\ndef f():\n    return LIMIT\n")
    assert source_hash("planners_of_mine.method:Mine") != before
    # Modules side by side, without a package.
    (tmp_path / "alone.py").write_text("from beside_it import f\nclass Mine:\n    pass\n")
    (tmp_path / "beside_it.py").write_text("def f():\n    return 1\n")
    class_of("alone:Mine")
    before = source_hash("alone:Mine")
    (tmp_path / "beside_it.py").write_text("def f():\n    return 2\n")
    assert source_hash("alone:Mine") != before
    assert source_hash("builtins:object") == ""


def test_methods_have_names_and_settings_of_their_own(settings, tmp_path):
    named = (
        NamedMethod("baseline", "HPA*", "HPA* (20)", {"cluster_cells": 20}),
        NamedMethod("class", "mine:Mine", "heavy", {"weight": 2}),
        NamedMethod("class", "mine:Mine", settings={"weight": 1}),
        NamedMethod("preset", "shortest", "near", {"planner.epsilon": 0.1}),
    )
    run = replace(settings, baselines=(), methods=named)
    write_records(run, tmp_path / "run")
    study = write_outputs(tmp_path / "run")
    assert study.faults == []
    assert set(study.labels) == {"grid-astar", "HPA* (20)", "heavy", "mine:Mine", "near"}
    near = study.of_method("near")[0].preparation
    assert near["preset"]["planner"]["epsilon"] == 0.1
    specs = {spec.name: spec for spec in methods_of(run, None)}
    assert specs["HPA* (20)"].settings == {"cluster_cells": 20}
    assert len({spec.digest for spec in specs.values()}) == 5


def test_a_class_that_fails_shows_its_traceback(settings, tmp_path):
    bad = NamedMethod("class", "mine:Mine", "bad", {"weight": 3})
    write_records(replace(settings, baselines=(), methods=(bad,)), tmp_path / "run")
    write_outputs(tmp_path / "run")
    for file in ("summary.md", "report.html"):
        text = (tmp_path / "run" / file).read_text()
        assert "weights above 2 are beyond me" in text
        assert "in helper" in text
        assert "harness/task.py" not in text


def test_a_class_that_fails_costs_no_reference(settings, tmp_path):
    bad = NamedMethod("class", "mine:Mine", "bad", {"weight": 3})
    only = replace(settings, baselines=(), methods=(bad,))
    seen = []
    made = write_records(only, tmp_path / "run", progress=lambda *counts: seen.append(counts))
    assert seen[-1][0] <= seen[-1][1] == 2 * made
    study = write_outputs(tmp_path / "run")
    assert (study.labels, study.checks, study.failures) == (["bad"], 0, made - 1)
    assert write_records(only, tmp_path / "run") == 0
    # Beside a method that works the reference is asked.
    assert write_records(replace(only, baselines=("thrun",)), tmp_path / "run") == 2 * made
    assert write_outputs(tmp_path / "run").labels == ["grid-astar", "thrun", "bad"]


def test_a_module_that_cannot_be_imported_is_told_at_once(settings, tmp_path):
    (tmp_path / "broken.py").write_text("import nothing_of_that_name\n")
    began = time.monotonic()
    with pytest.raises(InvalidValueError, match=r"ModuleNotFoundError: .*nothing_of_that_name"):
        write_records(replace(settings, baselines=("broken:Class",)), tmp_path / "run")
    assert time.monotonic() - began < 5
