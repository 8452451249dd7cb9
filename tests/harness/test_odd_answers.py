"""Answers, processes and scenario files of other forms end in records and words, not in errors."""

import math
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError, MapError
from hybridnav.harness import NamedMethod, RunSettings, write_records
from hybridnav.harness.baselines import AnyAngleResult, MethodResult
from hybridnav.harness.judges import judge_path
from hybridnav.harness.output import write_outputs
from hybridnav.harness.records import encode_path, path_steps, read_records
from hybridnav.maps.files import load_scenarios
from tests.harness import faulty_methods as faulty
from tests.harness.small_runs import importable, name_of, write_map

CELLS = np.array([[0, 0], [0, 1]])
POINTS = np.array([[0.5, 0.5], [1.5, 0.5]])
ODD: dict[str, tuple[Any, str]] = {
    "None": (None, "solve must return a MethodResult, got None"),
    "array": (CELLS, r"solve must return a MethodResult, got array([[0, 0], [0, 1]])"),
    "list": ([], "solve must return a MethodResult, got []"),
    "floats": (
        MethodResult(CELLS + 0.5),  # type: ignore[arg-type]
        "got float64 of shape (2, 2): convert them by astype",
    ),
    "seconds": (MethodResult(CELLS, seconds={"coarse": math.nan}), "a finite number, got nan"),
    "counts": (MethodResult(CELLS, expanded=math.nan), "cannot convert float NaN"),  # type: ignore[arg-type]
    "points": (MethodResult(None, any_angle=AnyAngleResult(POINTS * math.nan, 1.0)), "finite"),
    "headings": (
        MethodResult(
            None, any_angle=AnyAngleResult(POINTS, 1.0, headings_rad=np.array([math.nan, 0.0]))
        ),
        "finite",
    ),
}


@pytest.mark.usefixtures("here")
def test_answers_of_another_form_are_faults_in_words(tmp_path, monkeypatch):
    for name, (answer, _) in ODD.items():
        odd = type(name, (faulty.Sound,), {"solve": lambda *_, answer=answer: answer})
        monkeypatch.setattr(faulty, name, odd, raising=False)
    classes = tuple(f"{faulty.__name__}:{name}" for name in ODD)
    file = str(write_map(tmp_path, ["..", ".."]))
    write_records(
        RunSettings(maps=(file,), presets=(), baselines=classes, pairs=1), tmp_path / "run"
    )
    study = write_outputs(tmp_path / "run")
    for name, (_, words) in ODD.items():
        (outcome,) = (one for one in study.outcomes if one.label == name)
        ((record, fault),) = outcome.faults
        assert words in fault, name
        assert record["fault_kinds"] == ["paths"]


@pytest.mark.usefixtures("here")
def test_a_class_without_its_counts_has_no_answers_and_the_run_goes_on(tmp_path, monkeypatch):
    nodeless = type("nodeless", (faulty.Sound,), {"n_nodes": property(lambda _: None)})
    nodeless.__init__ = lambda _self, _grid: None  # type: ignore[misc]
    monkeypatch.setattr(faulty, "nodeless", nodeless, raising=False)
    named = (f"{faulty.__name__}:nodeless",)
    file = str(write_map(tmp_path, ["...", "..."]))
    write_records(RunSettings(maps=(file,), presets=(), baselines=named, pairs=2), tmp_path / "run")
    found = {one["status"] for one in read_records(tmp_path / "run") if one["method"] == named[0]}
    assert found == {"error"}


def test_a_process_that_ends_says_how(tmp_path, monkeypatch):
    """By `os._exit(3)`, `sys.exit`, and a signal."""
    monkeypatch.setenv("PYTHONPATH", importable())
    ends = {"exit": "3", "leave": "5", "kill": "-9"}
    methods = tuple(
        NamedMethod("class", name_of(faulty.Ends), name, {"how": name}) for name in ends
    )
    file = str(write_map(tmp_path, ["...", "..."]))
    write_records(RunSettings(maps=(file,), presets=(), methods=methods, pairs=1), tmp_path / "run")
    pairs = [one for one in read_records(tmp_path / "run") if one["type"] == "pair"]
    said = {one["method"]: one.get("error") for one in pairs}
    assert said["exit"] == "its process ended with exit code 3"
    assert said["leave"] == "its process ended with exit code 5"
    assert said["kill"] == "its process was ended by signal 9 (SIGKILL)"


def test_cells_that_come_twice_have_no_length_and_are_no_fault():
    grid = hn.OccupancyGrid(np.zeros((2, 3), np.float32), robot_radius_m=0)
    cells = np.array([[0, 0], [0, 0], [0, 1], [1, 2], [1, 2]])
    doubled = judge_path(grid, cells, start=(0, 0), goal=(1, 2))
    once = judge_path(grid, cells[[0, 2, 3]], start=(0, 0), goal=(1, 2))
    assert doubled == once
    assert doubled.ok
    assert path_steps(encode_path(cells)) == path_steps(encode_path(cells[[0, 2, 3]])) == 2


# --- scenario files -----------------------------------------------------------------------------

WALL = [
    "........",
    "........",
    "..###...",
    "....#...",
    "....#...",
    "..###...",
    "........",
    "........",
]


@pytest.mark.usefixtures("here")
@pytest.mark.filterwarnings("default::hybridnav.errors.MapWarning")
@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("0 m.map 8 8 2 2 7 7 5", "1 of 1 start or end in a cell that is not free, such as (5, 2)"),
        ("0 maps/dao/arena.map 8 8 0 0 0 7 7", "for map 'arena', and this is 'm', of the same"),
        ("0 maps\\dao\\M.MAP 8 8 0 0 0 7 7", ""),
    ],
)
def test_a_scenario_that_does_not_fit_is_charged_to_its_file(tmp_path, cli, line, said):
    file = write_map(tmp_path, WALL, name="m")
    (tmp_path / "m.scen").write_text(f"version 1\n{line}\n")
    told = cli("evaluate", file, "--scen", tmp_path / "m.scen", "-o", tmp_path / "run")
    assert "counter-examples" not in told.err
    assert said in told.err
    assert ("warning: scenarios" in told.err) == bool(said)
    assert told.code == ("not free" in said)  # nothing was checked


@pytest.mark.parametrize("first", ["", "version 0\n", "version 0.0\n"])
def test_scenarios_of_version_0_state_no_size(tmp_path, first):
    # HOG2, utils/ScenarioLoader.cpp: without "version" as its first word a file is of version 0,
    # and its lines are: bucket map xs ys xg yg dist.
    path = tmp_path / "a.scen"
    path.write_text(f"{first}0 a.map 1 0 2 2 2.4142\n")
    (one,) = load_scenarios(path, shape=(3, 4))
    assert (one.start, one.goal, one.optimum_cells) == ((2, 1), (0, 2), 2.4142)
    assert (one.map_name, one.rows, one.cols) == ("a.map", 3, 4)
    with pytest.raises(MapError, match="version 0 states no size of its map: state it as shape"):
        load_scenarios(path)
    path.write_text(f"{first}0 a.map 1 0 2 3 2.4142\n")
    with pytest.raises(MapError, match=f"line {2 if first else 1}: start or goal lies outside"):
        load_scenarios(path, shape=(3, 4))


def test_floats_are_refused_with_what_to_do():
    grid = hn.OccupancyGrid(np.zeros((2, 3), np.float32), robot_radius_m=0)
    with pytest.raises(InvalidValueError, match="points in metres go into AnyAngleResult"):
        judge_path(grid, [(0.5, 0.5)], start=(0, 0), goal=(0, 0))
