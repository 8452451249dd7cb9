"""Models on the command line: built, planned on, listed, drawn, measured."""

from pathlib import Path

import numpy as np
import pytest

import hybridnav as hn
from benchmarks.worlds import figure1_world

FIGURE = Path(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"
QUERY = ("--start", "0.55,0.55", "--goal", "2.55,2.85")
SMALL = ("--robot-radius", "0", "--set", "pyramid.merge_distance_m=2")


@pytest.fixture
def model(cli, tmp_path):
    path = tmp_path / "m.hnm"
    done = cli("build", FIGURE, "-o", path, *SMALL, "--preset", "shortest", "--preset", "octile")
    assert done.code == 0
    assert done.err == ""
    assert "shortest, octile" in done.out
    return path


def test_a_model_is_planned_on_as_its_map_is(cli, model):
    for preset in ((), ("--preset", "octile"), ("--preset", "paper")):
        on_map = cli("plan", FIGURE, *QUERY, *SMALL, *preset, "--json")
        on_model = cli("plan", model, *QUERY, *preset, "--json")
        assert (on_model.code, on_model.err) == (0, "")
        expected, answer = on_map.answer, on_model.answer
        for key in ("length_m", "points", "places", "arcs", "settings", "lower_bound"):
            assert answer[key] == expected[key], key
        assert "mesh" not in answer["seconds"]
        assert "graph" not in answer["seconds"]


def test_what_the_command_line_states_wins_over_a_model(cli, model):
    done = cli("plan", model, *QUERY, "--robot-radius", "0.05", "--json")
    assert done.answer["settings"]["pyramid"]["robot_radius_m"] == 0.05
    assert done.err.count("\n") == 1
    assert "was made with other settings" in done.err
    done = cli("plan", model, *QUERY, "--set", "pyramid.merge_distance_m=1", "--json")
    assert done.answer["settings"]["pyramid"]["merge_distance_m"] == 1
    assert done.err == ""


def test_show_takes_a_model(cli, model):
    shown = cli("show", model)
    assert shown.code == 0
    assert shown.out.split("seconds")[0] == cli("show", FIGURE, *SMALL).out.split("seconds")[0]


@pytest.mark.full
def test_evaluate_takes_a_model(cli, model, tmp_path):
    done = cli("evaluate", model, "-o", tmp_path / "run", "--pairs", "3", "--preset", "shortest")
    assert done.code == 0
    radius = {record["robot_radius_m"] for record in _records(tmp_path / "run", "preparation")}
    assert radius == {0.0}


def _records(folder, kind):
    from hybridnav.harness.records import read_records

    return [record for record in read_records(folder) if record["type"] == kind]


def test_rooms_of_a_model_are_listed_and_planned_between(cli, tmp_path):
    grid = figure1_world().grid(robot_radius_m=0.0)
    label_of = np.zeros(grid.shape, np.int32)
    label_of[:, grid.shape[1] // 2 :] = 1
    hn.save_rooms(tmp_path / "rooms.yaml", hn.RoomLabels(("west", "east"), label_of), grid)
    path = tmp_path / "m.hnm"
    cli("build", FIGURE, "-o", path, *SMALL, "--rooms", tmp_path / "rooms.yaml")
    (tmp_path / "rooms.yaml").unlink()
    listed = cli("rooms", path)
    assert (listed.code, listed.err) == (0, "")
    assert "west" in listed.out
    assert "west" not in cli("rooms", path, "--find").out
    done = cli("plan", path, "--from", "west", "--to", "east", "--json")
    assert (done.code, done.err) == (0, "")
    assert done.answer["status"] == "solved"


def test_a_model_is_built_of_a_model(cli, model, tmp_path):
    small = tmp_path / "small.hnm"
    done = cli("build", model, "-o", small, "--compress")
    assert done.code == 0
    assert "shortest, octile" in done.out
    assert small.stat().st_size < model.stat().st_size / 2
    assert hn.load(small).planner("octile").prepared is not None


def test_wrong_use_is_told_before_the_work(cli, tmp_path):
    out = ("-o", tmp_path / "m.hnm")
    assert cli("build", FIGURE, "-o", tmp_path / "m.yaml").refuses(2, "must end in .hnm")
    assert cli("build", FIGURE, "-o", tmp_path / "no" / "m.hnm").refuses(2, "cannot write")
    rooms = ("--rooms", "rooms.yaml", "--find-rooms")
    assert cli("build", FIGURE, *out, *rooms).refuses(2, "--find-rooms")
    assert cli("build", FIGURE, *out, "--robot-radius", "9").refuses(2, "robot radius of 9 m")
    assert cli("plan", tmp_path / "m.hnm", *QUERY).refuses(3, "no such file")
    (tmp_path / "m.hnm").write_bytes(b"P5 1 1 255\n.")
    assert cli("plan", tmp_path / "m.hnm", *QUERY).refuses(3, "no model of hybridnav")
    assert cli("evaluate", tmp_path / "m.hnm", "-o", tmp_path / "run").refuses(3, "no model")


def test_a_model_of_more_cells_than_allowed_names_the_option(cli, model):
    refused = cli("plan", model, *QUERY, "--max-cells", "100")
    assert refused.refuses(3, "--max-cells")
