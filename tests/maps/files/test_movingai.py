"""MovingAI maps and scenarios, read and written."""

from pathlib import Path

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError, MapError, MapNotFoundError
from hybridnav.maps import CellClass, Frame
from hybridnav.maps.files import Scenario, load_map, load_scenarios
from tests.strategies import class_grids, drawn, occupancy_grid, tried

HEADER = "type octile\nheight 3\nwidth 4\nmap\n"
BODY = ".GS.\n@OTW\n..@.\n"


@pytest.fixture
def write(tmp_path):
    def write(content, name="a.map"):
        path = tmp_path / name
        path.write_bytes(content.encode("latin-1") if isinstance(content, str) else content)
        return path

    return write


def _one_line(path, reader=load_map):
    with pytest.raises(MapError) as caught:
        reader(path)
    text = str(caught.value)
    assert text.isprintable()
    assert path.name in text
    return text


def test_the_last_line_is_row_0_and_cells_are_1_m_from_the_origin(write):
    grid = load_map(write(HEADER + BODY))
    free, occupied = CellClass.FREE, CellClass.OCCUPIED
    expected = [[free, free, occupied, free], [occupied] * 4, [free] * 4]
    np.testing.assert_array_equal(grid.classes, expected)
    assert grid.frame == Frame(1.0, (0.0, 0.0), 0.0)
    assert grid.name == "a"


@pytest.mark.parametrize(
    "content",
    [
        (HEADER + BODY).replace("\n", "\r\n"),
        HEADER + BODY.rstrip(),
        HEADER + BODY + "\n\n",
        "type octile\nwidth 4\nheight 3\nmap\n" + BODY,
        HEADER.replace("\n", "\r\n") + BODY,
    ],
    ids=["crlf", "no newline at the end", "blank end", "width first", "mixed"],
)
def test_line_ends_and_the_order_of_the_header_do_not_matter(write, content):
    expected = load_map(write(HEADER + BODY, "b.map")).classes
    np.testing.assert_array_equal(load_map(write(content)).classes, expected)


def test_inflation_is_in_metres_of_1_m_cells(write):
    grid = load_map(write(HEADER + "....\n....\n@...\n"), robot_radius_m=1.0)
    assert grid.class_counts() == {"free": 9, "unexplored": 0, "occupied": 1, "blocked": 2}


def test_thresholds_are_recorded_and_change_no_class(write):
    path = write(HEADER + BODY)
    grid = load_map(path, free_threshold=0.0, occupied_threshold=1.0)
    assert (grid.free_threshold, grid.occupied_threshold) == (0.0, 1.0)
    np.testing.assert_array_equal(grid.classes, load_map(path).classes)
    with pytest.raises(InvalidValueError, match="thresholds"):
        load_map(path, free_threshold=0.9)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "not a MovingAI map"),
        ("\x00\xff\xfe" * 100, "not a MovingAI map"),
        (BODY, "not a MovingAI map"),
        ("\n" * 100_000, "not a MovingAI map"),
        ("a" * 100_000, "not a MovingAI map"),
        ("type octile\nheight 3\nwidth 4\n", "not a MovingAI map"),
        ("height 3\nwidth 4\nmap\n" + BODY, "type octile"),
        ("type tile\nheight 3\nwidth 4\nmap\n" + BODY, "type octile"),
        ("type octile\nwidth 4\nmap\n" + BODY, "height"),
        ("type octile\nheight 3\nwidth -4\nmap\n" + BODY, "width"),
        ("type octile\nheight 0\nwidth 4\nmap\n", "height"),
        ("type octile\nheight 3\nwidth 99999999999999999999\nmap\n", "width"),
        ("type octile\nheight 900000\nwidth 900000\nmap\n", "at most"),
        ("type octile\nheight 4000\nwidth 4000\nmap\n....", "line 5: 4 characters"),
        (HEADER + "....\n....\n", "only 2 rows, expected 3"),
        (HEADER + BODY + "....\n", "at least 4 rows, expected 3"),
        (HEADER + "....\n...\n....\n", "line 6: 3 characters, expected 4"),
        (HEADER + "....\n......\n..\n", "line 6: 6 characters, expected 4"),
        (HEADER + "....\n.x..\n....\n", "line 6: column 2 holds 'x'"),
        (HEADER + "....\n....\n..\x1b.\n", "line 7: column 3 holds '\\x1b'"),
        (HEADER + "....\n....\n..\xe9.\n", "line 7: column 3 holds '\\xe9'"),
    ],
)
def test_a_damaged_map_gives_one_line_that_says_where(write, content, words):
    assert words in _one_line(write(content))


def test_a_map_that_is_missing_or_a_directory(tmp_path):
    with pytest.raises(MapNotFoundError, match=r"no\.map: no such file"):
        load_map(tmp_path / "no.map")
    (tmp_path / "folder.map").mkdir()
    assert "directory" in _one_line(tmp_path / "folder.map")


@pytest.mark.parametrize("separator", ["\t", " ", "  "])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize("version", ["version 1", "version 1.0"])
def test_scenarios_count_rows_from_the_bottom(write, separator, end, version):
    columns = ["7", "maps/dao/a.map", "4", "3", "0", "2", "3", "1", "3.41421356"]
    path = write(end.join([version, separator.join(columns), "", ""]), "a.scen")
    expected = Scenario(7, "maps/dao/a.map", 3, 4, (0, 0), (1, 3), 3.41421356)
    assert load_scenarios(path) == [expected]


def test_a_map_name_may_hold_spaces_between_tabs(write):
    path = write("version 1\n0\tmy map.map\t4\t3\t0\t0\t1\t0\t1\n", "a.scen")
    assert load_scenarios(path)[0].map_name == "my map.map"


GOOD = "0 a.map 4 3 0 0 1 0 1\n"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", "line 1: expected 'version 1'"),
        (GOOD, "line 1: expected 'version 1'"),
        ("version 2\n" + GOOD, "line 1: expected 'version 1'"),
        ("version 1\n" + GOOD + "0 a.map 4 3 0 0\n", "line 3: 6 columns, expected 9"),
        ("version 1\n" + GOOD + "0 a.map 4 3 0 0 1 x 1\n", "line 3: expected a whole number"),
        ("version 1\n" + GOOD + "0 a.map 4 3 0 -1 1 1 1\n", "line 3: expected a whole number"),
        ("version 1\n" + GOOD + "0 a.map 4 3 4 0 1 1 1\n", "line 3: start or goal lies outside"),
        ("version 1\n" + GOOD + "0 a.map 4 3 0 0 1 3 1\n", "line 3: start or goal lies outside"),
        ("version 1\n" + GOOD + "0 a.map 4 3 0 0 1 1 nan\n", "line 3: expected a length"),
        ("version 1\n" + GOOD + "0 a.map 4 3 0 0 1 1 \xff\n", "line 3: expected a length"),
        ("\x00\x1b\xff" * 50, "line 1"),
    ],
)
def test_a_damaged_scenario_file_gives_one_line_that_says_where(write, content, words):
    assert words in _one_line(write(content, "a.scen"), load_scenarios)


def test_missing_scenarios(tmp_path):
    with pytest.raises(MapNotFoundError, match=r"no\.scen: no such file"):
        load_scenarios(tmp_path / "no.scen")


def test_all_reference_maps_load_and_their_scenarios_stand_on_free_cells(data):
    paths = sorted(data.glob("movingai/*/*.map"))
    assert paths
    for path in paths:
        grid = load_map(path)
        scenarios = load_scenarios(path.with_suffix(".map.scen"))
        assert scenarios
        assert {(scenario.rows, scenario.cols) for scenario in scenarios} == {grid.shape}
        endpoints = np.array([(scenario.start, scenario.goal) for scenario in scenarios])
        assert (grid.classes[endpoints[..., 0], endpoints[..., 1]] == CellClass.FREE).all(), (
            path.name
        )
        # No shortest path is shorter than the octile distance: rows and columns are not mixed up.
        low, high = np.sort(abs(endpoints[:, 0] - endpoints[:, 1]), axis=1).T
        optimum = np.array([scenario.optimum_cells for scenario in scenarios])
        assert (optimum > high + (2**0.5 - 1) * low - 0.006).all(), path.name


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("maps")


@tried(60, class_grids())
def test_free_cells_survive_and_all_others_are_occupied(folder, classes):
    hn.write_movingai_map(occupancy_grid(classes), folder / "again.map")
    again = hn.load_map(folder / "again.map", robot_radius_m=0)
    free = classes == hn.CellClass.FREE
    assert np.array_equal(again.measured == hn.CellClass.FREE, free)
    assert np.array_equal(again.measured == hn.CellClass.OCCUPIED, ~free)


def test_a_file_that_was_read_is_written_with_equal_bytes(folder):
    text = "type octile\nheight 2\nwidth 3\nmap\n.@.\n@..\n"
    (folder / "one.map").write_text(text)
    grid = hn.load_map(folder / "one.map", robot_radius_m=5.0)
    hn.write_movingai_map(grid, folder / "two.map")
    assert (folder / "two.map").read_bytes() == text.encode()


def test_the_first_line_of_the_map_is_its_highest_row(folder):
    hn.write_movingai_map(occupancy_grid(drawn(".#?", "...")), folder / "rows.map")
    assert (folder / "rows.map").read_text().splitlines()[4:] == [".@@", "..."]


def test_what_cannot_be_written_is_refused(folder):
    grid = occupancy_grid(drawn("."))
    with pytest.raises(hn.errors.MapError, match=r"must be named \.map"):
        hn.write_movingai_map(grid, folder / "map.txt")
    with pytest.raises(hn.errors.MapError, match="cannot write"):
        hn.write_movingai_map(grid, folder / "none" / "one.map")
