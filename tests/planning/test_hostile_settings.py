"""Wrong input by mistake or on purpose: refused in one line, before the work."""

import json
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav._base.yaml_file import parse_value
from hybridnav.cli.app import run
from hybridnav.maps.names import read_point
from hybridnav.refine.ompl.settings import OmplSettings

FIGURE = Path(__file__).parents[2] / "maps" / "figure1" / "figure1.yaml"
QUERY = ("plan", str(FIGURE), "--start", "0.5,1.5", "--goal", "3.5,1.5")
KEYS = {
    "image": "m.pgm", "resolution": "0.05", "origin": "[0, 0, 0]", "negate": "0",
    "occupied_thresh": "0.65", "free_thresh": "0.196",
}  # fmt: skip


def _refused(capsys, code, *arguments):
    """The one line that a command is refused with."""
    assert run([str(argument) for argument in arguments]) == code
    told = capsys.readouterr()
    assert told.out == ""
    assert told.err.startswith("hybridnav: ")
    assert told.err.count("\n") == 1
    assert told.err.strip().isprintable()
    assert len(told.err) < 600
    return told.err


# --- footprints ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("footprint", "words"),
    [
        ("CIRCULARSTRING (0 0, 1 1, 2 0)", "or POLYGON ((x y, ...))"),
        ("CURVEPOLYGON (CIRCULARSTRING (0 0, 4 0, 4 4, 0 4, 0 0))", "or POLYGON ((x y, ...))"),
        ("'" + "[" * 5000 + "'", "expected corners as [[x, y], ...]"),
        ("[" * 5000, "the value is not YAML"),
        ("POLYGON " + "(" * 5000, "or POLYGON ((x y, ...))"),
        ("POLYGON ((-9 -9, 9 -9, 9 9, -9 -9), (1 0, 2 0, 2 1, 1 0))", "must have no holes"),
        ("POLYGON ((5 5, 6 5, 6 6, 5 5))", "must hold the robot's base"),
        ("[[1, 0], [2, 0], [2, 1]]", "must hold the robot's base"),
    ],
)
def test_a_footprint_that_is_none_is_refused(capsys, footprint, words):
    ompl = ("--preset", "ompl", "--set", "planner.ompl.space=se2")
    told = _refused(capsys, 2, *QUERY, *ompl, "--set", f"planner.ompl.footprint={footprint}")
    assert words in told


def test_the_base_may_lie_on_the_outline():
    for corners in ([[0, 0], [1, 0], [1, 1]], [[0, -1], [1, -1], [1, 1], [0, 1]]):
        assert OmplSettings.model_validate({"space": "se2", "footprint": corners}).footprint
        polygon = shapely.Polygon(corners)
        assert OmplSettings.model_validate({"space": "se2", "footprint": polygon}).footprint


# --- maps ---------------------------------------------------------------------------------------


@pytest.fixture
def load(tmp_path):
    """Load a map of one cell whose YAML has these values."""

    def load(**values):
        (tmp_path / "m.pgm").write_bytes(b"P5\n1 1\n255\n\xff")
        text = "".join(f"{key}: {value}\n" for key, value in (KEYS | values).items())
        (tmp_path / "a.yaml").write_text(text)
        return hn.load_map(tmp_path / "a.yaml")

    return load


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"resolution": "12:30:45"}, "resolution must be a finite number, got '12:30:45'"),
        ({"resolution": "1:30.5"}, "resolution must be a finite number, got '1:30.5'"),
        ({"resolution": "1e-300"}, "resolution must be a positive number of metres from 0.0001 to"),
        ({"resolution": "1e308"}, "resolution must be a positive number of metres from 0.0001 to"),
        ({"resolution": "99e-6"}, "got 9.9e-05"),
        ({"resolution": "1001"}, "got 1001"),
        ({"origin": "[1e308, 0, 0]"}, "origin must lie within 1e"),
        ({"origin": "[0, -1.1e9, 0]"}, "origin must lie within 1e"),
        ({"origin": "[0, 0, 1e308]"}, "as many radians"),
        ({"origin": "[0, 1:30, 0]"}, "origin must be a finite number, got '1:30'"),
        ({"negate": "2"}, "negate must be 0 or 1, got 2"),
        ({"negate": "-1"}, "negate must be 0 or 1, got -1"),
        ({"negate": "1:00"}, "negate must be 0 or 1"),
    ],
)
def test_a_value_that_no_map_has_is_refused_in_one_line(load, values, words):
    with pytest.raises(hn.errors.MapError) as refused:
        load(**values)
    assert words in str(refused.value)
    assert "a.yaml" in str(refused.value)
    assert str(refused.value).isprintable()


def test_values_at_the_bounds_load_and_know_their_cells(load):
    for resolution_m in (1e-4, 1e3):
        for origin in ("[0, 0, 0]", "[1e9, -1e9, 3.14]", "[-1.0e9, 5e-2, 0]"):
            frame = load(resolution=resolution_m, origin=origin, negate="false").frame
            cells = np.array([[0, 0], [7, 3], [10_000, 12_000]])
            np.testing.assert_array_equal(frame.cells_of(frame.points_of(cells)), cells)


def test_numbers_of_the_command_line_are_read_as_those_of_files(capsys):
    told = _refused(capsys, 2, *QUERY, "--set", "pyramid.robot_radius_m=1:30")
    assert "robot_radius_m: " in told
    assert "got '1:30'" in told


@given(st.one_of(st.integers(-(10**9), 10**9), st.floats(allow_nan=False, allow_infinity=False)))
def test_a_number_in_yaml_is_that_number(number):
    text = f"{number!r}"
    assert float(parse_value(text)) == number


# --- names --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "what"),
    [(name, "point") for name in ("1,2", " 1 , 2.5,-3e2", "nan,inf", "1_0,2")]
    + [(name, "door") for name in ("door 1", "Door  20", "Tür 1", "TUER 3", "door7")],
)
def test_no_room_and_no_point_has_the_name_of_a_point_or_a_door(tmp_path, name, what):
    grid = hn.load_map(FIGURE, robot_radius_m=0)
    label_of = np.zeros(grid.shape, dtype=np.int32)
    with pytest.raises(hn.errors.InvalidValueError, match=f"must not read as a {what}"):
        hn.RoomLabels((name,), label_of)
    with pytest.raises(hn.errors.InvalidValueError, match=f"must not read as a {what}"):
        hn.RoomLabels(("hall",), label_of, {name: (0.5, 1.5)})
    path = tmp_path / "rooms.yaml"
    ring = [[0, 0], [4, 0], [4, 3], [0, 3]]
    path.write_text(json.dumps({"rooms": [{"name": name, "polygon": ring}]}))
    with pytest.raises(hn.errors.RoomsError, match=f"must not read as a {what}"):
        hn.load_rooms(path, grid)


@given(st.text(st.characters(codec="utf-8"), max_size=8))
def test_a_name_is_a_room_s_or_a_point_s_never_both(text):
    try:
        hn.RoomLabels((text,), np.zeros((1, 1), np.int32))
    except hn.errors.InvalidValueError:
        return
    assert read_point(text) is None


# --- options ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--at", "nowhere"), "--at must be anywhere or point, got 'nowhere'"),
        (("--at", ""), "--at must be anywhere or point, got ''"),
        (("--max-overlap", "0.8"), "--max-overlap is for alternatives: add --alternatives N"),
        (("--max-stretch", "2"), "--max-stretch is for alternatives: add --alternatives N"),
    ],
)
def test_an_option_is_checked_whether_it_is_needed_or_not(capsys, options, words):
    assert words in _refused(capsys, 2, *QUERY, *options)


def test_what_cannot_be_written_is_told_before_the_work(capsys, monkeypatch, tmp_path):
    def refuse(*_arguments, **_options):
        raise PermissionError(13, "Permission denied")

    home = "hybridnav.maps.files.formats.load_map"
    monkeypatch.setattr(home, lambda *_, **__: pytest.fail("the map was read"))
    # Tests may run as root, who may write everywhere.
    monkeypatch.setattr(Path, "touch", refuse)
    told = _refused(capsys, 2, *QUERY, "--plot", tmp_path / "p.png")
    assert f"--plot: cannot write '{tmp_path / 'p.png'}': Permission denied" in told
    assert "--out: cannot write" in _refused(capsys, 2, "rooms", FIGURE, "-o", tmp_path / "r.yaml")
    old = tmp_path / "old.png"
    old.write_bytes(b"")
    assert "--plot: cannot write" in _refused(capsys, 2, *QUERY, "--plot", old)


def test_trying_to_write_leaves_nothing(capsys, tmp_path):
    old = tmp_path / "old.png"
    old.write_bytes(b"a picture")
    for name in ("old.png", "new.png"):
        _refused(capsys, 2, *QUERY, "--plot", tmp_path / name, "--at", "nowhere")
    assert [path.name for path in tmp_path.iterdir()] == ["old.png"]
    assert old.read_bytes() == b"a picture"
