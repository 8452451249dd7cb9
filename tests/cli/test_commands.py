"""The command line: its answers, its exit codes, and its messages for wrong usage."""

import io
import json
import math
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageSequence

import hybridnav as hn
from hybridnav.cli import common
from hybridnav.cli.rendering import summary
from hybridnav.planning.text import rounded_bound

MAPS = Path(__file__).parents[2] / "maps"
FIGURE = MAPS / "figure1" / "figure1.yaml"
OFFICE = MAPS / "office" / "office.yaml"
OFFICE_QUERY = (OFFICE, "--start", "1.0,13.2", "--goal", "40.6,19.4")
GREYS = {"#": 0, ".": 254, "?": 205}
SHADED = {"free_thresh": 0.25}
"""A threshold that calls grey 205 free."""


@pytest.fixture
def draw(tmp_path):
    """Write a map of 1 m cells drawn with y up; further keywords replace keys of the YAML."""

    def draw(*lines, name="m.yaml", **keys):
        pixels = bytes(GREYS[letter] for line in lines for letter in line)
        image = b"P5\n%d %d\n255\n" % (len(lines[0]), len(lines)) + pixels
        (tmp_path / "m.pgm").write_bytes(image)
        values = {"image": "m.pgm", "resolution": 1.0, "origin": [0, 0, 0], "negate": 0}
        values |= {"occupied_thresh": 0.65, "free_thresh": 0.196} | keys
        path = tmp_path / name
        path.write_text("".join(f"{key}: {value}\n" for key, value in values.items()))
        return path

    return draw


@pytest.fixture
def rooms(draw):
    """Two rooms with one door, an unexplored corner, and a closet without a door."""
    return draw(
        "#########", "#...#?..#", "#.......#", "#...#...#", "#########", "#.......#", "#########"
    )


# --- plan ---------------------------------------------------------------------------------------


def test_a_plan_as_json(cli, rooms):
    done = cli("plan", rooms, "--start", "1.5,3.5", "--goal", "7.2,4.9", "--json")
    assert (done.code, done.err) == (0, "")
    answer = done.answer
    keys = {"status", "metric", "length_m", "places", "arcs", "points", "expanded", "seconds"}
    assert keys <= answer.keys()
    assert not {"optimum_m", "loss", "grid_expanded"} & answer.keys()
    assert answer["status"] == "solved"
    assert answer["metric"] == "any-angle"
    # From the point to a corner of the door, and to the point.
    points = answer["points"]
    assert (points[0], points[-1]) == ([1.5, 3.5], [7.2, 4.9])
    assert 5 < answer["length_m"] < 5 + math.sqrt(2)
    assert answer["gap"] == 0
    assert sum(map(math.dist, points, points[1:])) == pytest.approx(answer["length_m"])
    assert len(answer["arcs"]) == len(answer["places"]) - 1
    assert answer["expanded_intervals"] > 0
    assert all(seconds >= 0 for seconds in answer["seconds"].values())


def test_a_comparison_adds_the_figures_of_the_whole_grid(cli):
    answer = cli("plan", *OFFICE_QUERY, "--preset", "paper", "--compare", "--json").answer
    whole = cli("plan", *OFFICE_QUERY, "--preset", "grid-astar", "--json").answer
    assert answer["optimum_m"] == whole["length_m"]
    assert answer["grid_expanded"] == whole["expanded"]
    assert answer["loss"] == answer["length_m"] / whole["length_m"] - 1
    assert answer["loss"] >= 0
    assert len(whole["places"]) == len(whole["arcs"]) + 1


def test_a_comparison_mixes_no_metrics(cli):
    query = (*OFFICE_QUERY, "--compare")
    answer, told = cli("plan", *query, "--json").answer, cli("plan", *query).out
    assert answer["metric"] == "any-angle"
    assert answer["optimum_m"] is answer["loss"] is None
    assert answer["length_m"] < answer["grid_length_m"]
    assert f"grid       {answer['grid_length_m']:.2f} m (octile), " in told
    assert "loss" not in told
    assert "optimum  " not in told
    assert f"expanded   {answer['expanded_intervals']:,} intervals\n" in told


def test_the_summary_says_what_the_json_says(cli):
    query = (*OFFICE_QUERY, "--preset", "paper", "--compare")
    done = cli("plan", *query)
    assert (done.code, done.err) == (0, "")
    figures = cli("plan", *query, "--json").answer
    lines = dict(line.split(maxsplit=1) for line in done.out.splitlines())
    assert lines["query"] == "office, (1, 13.2) to (40.6, 19.4), robot radius 0.25 m"
    assert lines["status"] == "solved"
    assert lines["length"] == f"{figures['length_m']:.2f} m (octile)"
    ids = " ".join(map(str, figures["places"]))
    assert lines["places"] == f"{len(figures['places'])}: {ids}"
    assert lines["expanded"].startswith(f"{figures['expanded']:,} cells, ")
    assert lines["optimum"].startswith(f"{figures['optimum_m']:.2f} m, loss ")
    assert lines["grid"].startswith(f"{figures['grid_expanded']:,} cells")
    # A certificate may be rounded to the safe side only.
    bound, gap = (float(word) for word in lines["bound"].split() if word[0].isdigit())
    assert bound <= figures["lower_bound"] < bound + 0.01
    assert gap >= 100 * figures["gap"] > gap - 0.1


def test_a_path_equal_to_its_bound_is_called_optimal(cli, rooms):
    done = cli("plan", rooms, "--start", "1.5,3.5", "--goal", "1.5,3.5", "--compare")
    assert "bound      0.00 m, the path is optimal" in done.out
    assert "arcs       0\n" in done.out
    query = ("plan", rooms, "--start", "1.5,3.5", "--goal", "1.5,3.5", "--preset", "octile")
    assert "loss 0.00 %" in cli(*query, "--compare").out


@given(st.floats(0, 1e4), st.floats(0, 2))
def test_a_bound_is_rounded_down_and_that_of_an_optimal_path_is_its_length(cost, gap):
    bound = cost / (1 + gap)
    least, stated = rounded_bound(bound, cost)
    assert least == f"{cost:.2f}" if stated == "optimal" else float(least) <= bound + 1e-12
    assert stated == "optimal" or gap > 0
    assert stated != "optimal" or gap < 1e-6 or cost < 1e-300
    assert rounded_bound(0.0, 1.0) == ("0.00", "not proved to be near the optimum")
    above = math.nextafter(0.045, 1)  # prints as 0.05, and the bound as 0.04
    assert rounded_bound(math.nextafter(0.045, 0), above) == (f"{above:.2f}", "optimal")


def test_a_path_that_ends_short_of_the_goal_says_by_how_much():
    points = np.array([[1.0, 1.0], [1.5, 1.0]])
    path = hn.Path(np.zeros((2, 2), dtype=np.int64), points, 0.5)
    endpoints = (1.0, 1.0), (1.5, 3.25, 0.5)
    result = hn.PlanResult(
        hn.PlanStatus.APPROXIMATE,
        "any-angle",
        path,
        start=endpoints[0],
        goal=endpoints[1],
        settings_source={"preset": "ompl"},
    )
    grid = hn.OccupancyGrid(np.zeros((4, 4), np.float32), hn.Frame(1.0))
    text = summary(grid, endpoints, result.to_dict())
    assert "status     approximate\n" in text
    assert "path       ends 2.25 m short of the goal after 0.50 m\n" in text


@pytest.mark.parametrize(
    ("endpoints", "status"),
    [
        ("-0.1,3.5 7.5,3.5", "start outside the map"),
        ("1.5,3.5 1e300,3.5", "goal outside the map"),
        ("0.5,3.5 7.5,3.5", "start occupied"),
        ("1.5,3.5 4.5,3.5", "goal occupied"),
        ("5.5,5.5 7.5,3.5", "start unexplored"),
        ("1.5,3.5 5.5,5.5", "goal unexplored"),
        ("1.5,3.5 1.5,1.5", "no path"),
    ],
)
@pytest.mark.parametrize("preset", ["paper", "grid-astar"])
def test_what_is_not_solved_exits_with_1_and_names_the_status(
    cli, rooms, preset, endpoints, status
):
    start, goal = endpoints.split()
    query = ("plan", rooms, "--start", start, "--goal", goal, "--preset", preset, "--compare")
    text = cli(*query)
    assert (text.code, text.err) == (1, "")
    assert f"status     {status}\n" in text.out
    assert "optimum    none, the whole grid has no path either\n" in text.out
    extent = "extent     x 0.00 to 9.00 m, y 0.00 to 7.00 m\n"
    assert (extent in text.out) is ("outside" in status)
    done = cli(*query, "--json")
    assert (done.code, done.err) == (1, "")
    answer = done.answer
    assert answer["status"] == status
    nothing = ("length_m", "places", "arcs", "points", "optimum_m", "loss", "gap")
    assert all(answer[key] is None for key in nothing)


@pytest.mark.parametrize("compare", [(), ("--compare",)])
def test_ends_outside_the_map_are_told_before_anything_is_prepared(cli, rooms, tmp_path, compare):
    query = ("plan", rooms, "--start", "1.5,3.5", "--goal", "99,3.5", *compare)
    early = cli(*query, "--json").answer
    assert early["seconds"].keys() == {"load"}
    # A picture needs all that was prepared: the answer is the same.
    late = cli(*query, "--json", "--plot", tmp_path / "a.svg").answer
    assert "prepare" in late["seconds"]
    for key in ("seconds", "grid_seconds"):
        early.pop(key, None), late.pop(key, None)
    assert early == late


@pytest.mark.parametrize("more", [(), ("--alternatives", 2)])
def test_points_of_a_tour_outside_the_map_are_told_at_once_too(cli, rooms, tmp_path, more):
    for start, goal in (("-1,3.5", "room-1"), ("room-1", "99,3.5"), ("-1,3.5", "99,3.5")):
        query = ("plan", rooms, "--from", start, "--to", goal, *more)
        done = cli(*query, "--json")
        assert (done.code, done.err) == (1, "")
        early = done.answer
        late = json.loads(cli(*query, "--json", "--plot", tmp_path / "a.svg").out)
        assert early.pop("seconds").keys() == {"load"}
        assert late.pop("seconds").keys() > {"load"}
        for key, end in (("start", start), ("goal", goal)):
            if end == "room-1":  # where in it, nobody has asked yet
                assert early.pop(key) is None
                late.pop(key)
        assert early == late
        assert "extent     x 0.00 to 9.00 m, y 0.00 to 7.00 m\n" in cli(*query).out


def test_negative_coordinates_are_no_options(cli, draw):
    path = draw("...", "...", origin=[-3, -2, 0])
    for endpoints in (
        ["--start", "-2.5,-1.5", "--goal", "-.5,-1.5"],
        ["--start=-2.5,-1.5", "--goal=-0.5,-1.5"],
        ["--goal", " -5e-1 , -1.5 ", "--start", "-2.5,-1.5"],
    ):
        answer = cli("plan", path, *endpoints, "--json").answer
        assert answer["points"] == [[-2.5, -1.5], [-0.5, -1.5]]


def test_points_are_in_the_map_frame_of_a_turned_map(cli, draw):
    path = draw("...", "...", origin=[10, 20, math.pi / 2])
    done = cli("plan", path, "--start", "9.5,20.5", "--goal", "9.5,22.5", "--json")
    assert done.answer["points"] == [[9.5, 20.5], [9.5, 22.5]]
    assert "extent     x 8.00 to 10.00 m, y 20.00 to 23.00 m\n" in cli("show", path).out


def test_the_version_is_the_packages(cli):
    done = cli("--version")
    assert (done.code, done.out, done.err) == (0, f"hybridnav {hn.__version__}\n", "")
    assert "--version" in cli("--help").out


# --- settings -----------------------------------------------------------------------------------


def test_settings_change_the_plan_and_are_recorded(cli, rooms):
    query = ("plan", rooms, "--start", "1.5,3.5", "--goal", "5.5,5.5", "--json")
    assert cli(*query).answer["status"] == "goal unexplored"
    done = cli(*query, "--set", "planner.allow_unexplored=true", "--seed", 7)
    assert (done.code, done.answer["status"]) == (0, "solved")
    assert done.answer["settings"]["planner"]["allow_unexplored"] is True
    assert done.answer["settings"]["pyramid"]["seed"] == 7
    settings = ("--set", "pyramid.merge_distance_m=8", "--set", "pyramid.merge_distance_m= 2.5")
    assert cli(*query, *settings).answer["settings"]["pyramid"]["merge_distance_m"] == 2.5


def test_an_option_wins_over_set_and_set_over_the_preset(cli, rooms):
    query = ("plan", rooms, "--start", "1.5,3.5", "--goal", "7.5,3.5", "--json")
    wide = ("--set", "pyramid.robot_radius_m=1")
    assert cli(*query, *wide).answer["status"] == "start occupied"
    assert cli(*query, *wide, "--robot-radius", "0.25").answer["status"] == "solved"
    assert cli(*query, "--robot-radius", "1e-5").answer["status"] == "solved"


@pytest.mark.parametrize("command", ["plan", "tour", "rooms"])
def test_a_radius_that_leaves_no_free_cell_is_told_as_that(cli, rooms, command):
    endpoints = {
        "plan": ("--start", "1.5,3.5", "--goal", "7.5,3.5"),
        "tour": ("--from", "room-1", "--to", "7.5,3.5"),
        "rooms": (),
    }[command]
    name = "rooms" if command == "rooms" else "plan"
    done = cli(name, rooms, *endpoints, "--robot-radius", 25)
    assert done.refuses(2, "a robot radius of 25 m leaves no free cell on m", "--robot-radius")
    assert cli(name, rooms, *endpoints, "--robot-radius", 0.5).code == 0


def test_an_infinite_merge_distance_still_gives_strict_json(cli, rooms):
    query = ("plan", rooms, "--start", "1.5,3.5", "--goal", "7.5,3.5")
    done = cli(*query, "--set", "pyramid.merge_distance_m=.inf", "--json")
    assert done.code == 0
    assert done.answer["settings"]["pyramid"]["merge_distance_m"] is None
    assert len(done.answer["places"]) == 1


def test_a_preset_may_be_a_file_of_ones_own(cli, rooms, tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text("pyramid: {merge_distance_m: 2.5}\nplanner: {corridor: neighbours}\n")
    query = ("plan", rooms, "--start", "1.5,3.5", "--goal", "7.5,3.5", "--json")
    settings = cli(*query, "--preset", file).answer["settings"]
    assert settings["preset"] == "mine"
    assert settings["planner"]["corridor"] == "neighbours"
    assert settings["pyramid"]["merge_distance_m"] == 2.5


def test_the_preset_commands(cli, rooms, tmp_path):
    lines = cli("preset", "list").out.splitlines()
    assert [line.split()[0] for line in lines] == hn.preset_names()
    assert any(
        " ".join(line.split()) == "paper max-distance arcs, down the levels, grid A*"
        for line in lines
    )
    assert cli("preset", "check", "paper").out == "paper: valid\n"
    # What is shown is a preset file itself.
    copy = tmp_path / "copy.yaml"
    copy.write_text(cli("preset", "show", "grid-astar").out)
    assert cli("preset", "check", copy).out == "copy: valid\n"
    done = cli("plan", rooms, "--start", "1.5,3.5", "--goal", "7.5,3.5", "--preset", copy)
    assert (done.code, "the path is optimal" in done.out) == (0, True)


# --- wrong usage and unreadable input -----------------------------------------------------------

ENDS = ("--start", "1,1", "--goal", "2,2")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["fly"], ["'fly'", "hybridnav --help"]),
        (["plan", FIGURE, "--start", "1,1"], ["'--goal'", "hybridnav plan --help"]),
        (["plan", *ENDS], ["'MAP'"]),
        (["plan", FIGURE, *ENDS, "--fast"], ["--fast"]),
        (["plan", FIGURE, FIGURE, *ENDS], ["unexpected"]),
        (["plan", FIGURE, "--start", "1", "--goal", "2,2"], ["'--start'", "X,Y", "'1'"]),
        (["plan", FIGURE, "--start", "1,1", "--goal", "2,2,2,2"], ["'--goal'", "'2,2,2,2'"]),
        (["plan", FIGURE, "--start", "[m],1", "--goal", "2,2"], ["'[m],1'"]),
        (["plan", FIGURE, "--start", "nan,1", "--goal", "2,2"], ["finite", "'nan,1'"]),
        (["plan", FIGURE, "--start", "1,-inf", "--goal", "2,2"], ["finite", "'1,-inf'"]),
        (["plan", FIGURE, *ENDS, "--preset", "best"], ["'best'", "octile, ompl, paper"]),
        (["plan", FIGURE, *ENDS, "--preset", ""], ["''", "octile, ompl, paper"]),
        (["plan", FIGURE, *ENDS, "--preset", "a\nb"], ["'a\\nb'"]),
        (["plan", FIGURE, *ENDS, "--set", "pyramid.speed=3"], ["pyramid.speed", "seed"]),
        (["plan", FIGURE, *ENDS, "--set", "pyramid.seed"], ["'pyramid.seed'"]),
        (["plan", FIGURE, *ENDS, "--set", "seed=3"], ["'seed=3'", "section.key=value"]),
        (["plan", FIGURE, *ENDS, "--set", "pyramid.seed=x"], ["pyramid.seed", "'x'"]),
        (["plan", FIGURE, *ENDS, "--set", "pyramid.a\nb=x"], ["pyramid.a\\nb"]),
        (["plan", FIGURE, *ENDS, "--robot-radius", "-1"], ["robot_radius_m", "-1"]),
        (["plan", FIGURE, *ENDS, "--robot-radius", "nan"], ["robot_radius_m", "nan"]),
        (["plan", FIGURE, *ENDS, "--robot-radius", "inf"], ["robot_radius_m", "inf"]),
        (["plan", FIGURE, *ENDS, "--robot-radius", "wide"], ["--robot-radius"]),
        (["plan", FIGURE, *ENDS, "--seed", "-1"], ["pyramid.seed", "-1"]),
        (["plan", FIGURE, *ENDS, "--seed", "1.5"], ["--seed"]),
        (["show", FIGURE, "--level", "99"], ["--level", "99"]),
        (["show", FIGURE, "--level", "-99"], ["--level", "-99"]),
        (["show", FIGURE, "--level", "top"], ["--level"]),
        (["preset", "list", "all"], ["all", "hybridnav preset list --help"]),
        (["preset", "check", "best"], ["'best'", "octile, ompl, paper"]),
        (["preset", "show"], ["NAME|FILE"]),
    ],
)
def test_wrong_usage_is_one_line_and_exit_code_2(cli, arguments, words):
    assert cli(*arguments).refuses(2, *words)


@pytest.mark.parametrize("arguments", [[], ["preset"]])
def test_a_command_that_lacks_its_command_gets_help(cli, arguments):
    done = cli(*arguments)
    assert (done.code, done.out) == (2, "")
    assert "Commands:" in done.err


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        ({"image": "gone.pgm"}, ["gone.pgm", "no such file"]),
        ({"resolution": ".nan"}, ["resolution", "nan"]),
        ({"occupied_thresh": 0.196, "free_thresh": 0.65}, ["free_thresh", "0.65"]),
        ({"origin": "&a [*a]"}, ["line 3", "anchors"]),
        ({"mode": "!!python/object/apply:os.abort []"}, ["tags"]),
    ],
)
@pytest.mark.parametrize("command", ["plan", "show"])
def test_a_bad_map_is_one_line_and_exit_code_3(cli, draw, command, keys, words):
    endpoints = ENDS if command == "plan" else ()
    assert cli(command, draw("..", **keys), *endpoints).refuses(3, "m.yaml", *words)


def test_files_that_are_not_there_or_not_meant(cli, rooms, tmp_path):
    gone = tmp_path / "two\nlines.yaml"
    assert cli("plan", gone, *ENDS).refuses(3, "two\\nlines.yaml", "no such file")
    assert cli("show", tmp_path).refuses(3, "expected one of .yaml, .yml, .map, .hnm")
    assert cli("show", rooms.with_suffix(".pgm")).refuses(3, "the YAML file that names this image")
    assert cli("show", rooms, "--preset", gone).refuses(3, "preset", "no such file")
    assert cli("show", rooms, "--preset", rooms).refuses(3, "m.yaml: image: unknown key")
    assert cli("preset", "check", rooms).refuses(3, "m.yaml: image: unknown key")
    bad = tmp_path / "no preset is called.yaml"
    bad.write_text("planner: {corridor: 3}\n")
    # The file is wrong, and stays so whatever else the command line says.
    override = ("--set", "planner.corridor=route")
    assert cli("show", rooms, "--preset", bad, *override).refuses(3, "planner.corridor", "got 3")


def test_a_map_that_does_not_fit_into_memory(cli, rooms, monkeypatch):
    def exhaust(*_arguments, **_options):
        raise MemoryError

    monkeypatch.setattr("hybridnav.models.model.load_map", exhaust)
    assert cli("show", rooms).refuses(3, "out of memory")


@pytest.mark.filterwarnings("default::hybridnav.errors.MapWarning")
def test_a_warning_is_one_line_beside_the_result(cli, draw):
    path = draw("??...#", **SHADED)
    done = cli(
        "plan", path, "--start", "0.5,0.5", "--goal", "4.5,0.5", "--json", "--robot-radius", 0
    )
    assert (done.code, done.answer["length_m"]) == (0, 4)
    assert done.err.startswith("hybridnav: warning: map ")
    assert "grey 205" in done.err
    assert done.err.count("\n") == 1


# --- stderr -------------------------------------------------------------------------------------


def test_ctrl_c_ends_without_a_word(cli, rooms, monkeypatch):
    def interrupt(*_arguments, **_options):
        raise KeyboardInterrupt

    monkeypatch.setattr("hybridnav.models.model.load_map", interrupt)
    done = cli("show", rooms)
    assert (done.code, done.out, done.err) == (130, "", "")


class _Terminal(io.StringIO):
    def isatty(self):
        return True


def test_progress_is_for_terminals_only(cli, draw, monkeypatch):
    path = draw(".", name="[m].yaml")
    for colour in ("FORCE_COLOR", "CLICOLOR_FORCE", "TTY_COMPATIBLE"):
        monkeypatch.setenv(colour, "1")
    assert cli("show", path).err == ""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "500")  # long names of folders are not wrapped
    monkeypatch.setattr(sys, "stderr", terminal := _Terminal())
    done = cli("show", path)
    assert (done.code, done.out[:14]) == (0, "map        [m]")
    assert "reading " in terminal.getvalue()
    assert "[m].yaml" in terminal.getvalue()


@pytest.mark.parametrize(("patience_s", "has_bar"), [(0.05, True), (60.0, False)])
def test_a_long_stage_has_a_bar_with_its_time(monkeypatch, patience_s, has_bar):
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(common, "_PATIENCE_S", patience_s)
    monkeypatch.setattr(sys, "stderr", terminal := _Terminal())
    with common.stage("planning [m]", {}, "plan"):
        time.sleep(0.5)
    shown = terminal.getvalue()
    assert "planning [m]" in shown
    assert ("\u2501" in shown, "0:00:00" in shown) == (has_bar, has_bar)


# --- show ---------------------------------------------------------------------------------------


def _table(text):
    """Rows of the table of levels as lists of words, without thousands separators."""
    lines = text.replace(",", "").splitlines()
    first = next(n for n, line in enumerate(lines) if line.split()[:2] == ["level", "vertices"])
    return [line.split() for line in lines[first + 1 : lines.index("", first)]]


def test_show_goes_on_above_the_places_and_names_the_levels(cli, tmp_path):
    picture = tmp_path / "regions.png"
    done = cli("show", OFFICE, "--robot-radius", 0.25, "--regions", 26420, "--plot", picture)
    rows = _table(done.out)
    assert [row[-1] for row in rows if row[-1] == "places"] == ["places"]
    grid = hn.load_map(OFFICE, robot_radius_m=0.25)
    pyramid = hn.DualGraphPyramid.build(grid).with_regions(26420)
    assert [int(row[1]) for row in rows] == [level.n_vertices for level in pyramid]
    assert rows[pyramid.region_level][-2:] == ["regions", "<"]
    apex = cli("show", OFFICE, "--robot-radius", 0.25, "--regions", 26420, "--level", -1)
    assert _table(apex.out)[-1][-1] == "<"
    assert picture.stat().st_size > 10_000
    refused = cli("show", OFFICE, "--regions", 0)
    assert refused.refuses(2, "--regions")


def test_show_watches_a_descent(cli, tmp_path):
    moving, strip = tmp_path / "descent.gif", tmp_path / "descent.png"
    for file in (moving, strip):
        done = cli("show", OFFICE, "--robot-radius", 0.25, "--watch", "descent", file)
        assert done.code == 0

    def n_frames(file):
        with Image.open(file) as animation:
            return sum(1 for _ in ImageSequence.Iterator(animation))

    assert n_frames(moving) >= 3
    assert strip.stat().st_size > 10_000
    assert cli("show", OFFICE, "--watch", "fall", moving).refuses(2, "one of growth, descent")
    refused = cli("show", OFFICE, "--watch", "descent", tmp_path / "descent.mp4")
    assert refused.refuses(2, "--watch must end in .gif, .html, .png")
    paper = ("show", OFFICE, "--preset", "paper", "--watch", "descent")
    assert cli(*paper, tmp_path / "two.gif", "--set", "planner.step=2").code == 0
    assert n_frames(tmp_path / "two.gif") > n_frames(moving)  # a level for each halving
    refused = cli(*paper, moving, "--set", "planner.levels=places")
    assert refused.refuses(2, "--watch: the preset has levels: places")


def test_show_tells_what_the_library_knows(cli):
    done = cli("show", FIGURE, "--robot-radius", 0, "--set", "pyramid.merge_distance_m=10")
    assert (done.code, done.err) == (0, "")
    assert "map        figure1, 40 x 30 cells of 0.1 m, 4.00 x 3.00 m\n" in done.out
    counts = "501 free, 494 unexplored, 205 occupied, 0 blocked by a robot radius of 0 m"
    assert f"cells      {counts}\n" in done.out
    pyramid = hn.DualGraphPyramid.build(hn.load_map(FIGURE, robot_radius_m=0), merge_distance_m=10)
    table = _table(done.out)
    assert len(table) == len(pyramid)
    for index, row in enumerate(table):
        level = pyramid[index]
        sizes = [index, level.n_vertices, level.n_arcs, int(level.is_self_loop.sum())]
        assert row[:4] == list(map(str, sizes))
        if index:
            assert float(row[4]) == round(pyramid[index - 1].n_vertices / level.n_vertices, 2)
    # The paper's Fig. 1: a double boundary and an inclusion.
    assert table[-1][1:4] == ["3", "4", "1"]
    assert "1 free and 2 unexplored vertices" in done.out
    assert "1 parallel arcs" in done.out
    assert "seconds " in done.out
    assert not [line for line in done.out.splitlines() if line != line.rstrip()]


@pytest.mark.parametrize(("level", "row"), [("0", 0), ("-1", -1), ("2", 2), ("-2", -2)])
def test_the_level_asked_for_is_marked(cli, level, row):
    table = _table(cli("show", FIGURE, "--level", level).out)
    assert [words for words in table if words[-1] == "<"] == [table[row]]


@pytest.mark.parametrize("lines", [["#"], ["."], ["?"], ["###", "###"], [".#?"]])
def test_show_and_plan_bear_the_smallest_maps(cli, draw, lines):
    path = draw(*lines)
    assert cli("show", path).code == 0
    done = cli("plan", path, "--start", "0.5,0.5", "--goal", "0.5,0.5", "--compare")
    assert done.code == (0 if lines[0][0] == "." else 1)


# --- pictures -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "magic"), [("a.png", b"\x89PNG"), ("b.PDF", b"%PDF"), ("c.svg", b"<?xml")]
)
def test_plot_draws_a_picture_beside_the_result(cli, rooms, tmp_path, name, magic):
    picture = tmp_path / name
    endpoints = ("--start", "1.5,3.5", "--goal", "7.5,3.5")
    done = cli("plan", rooms, *endpoints, "--compare", "--json", "--plot", picture)
    assert (done.code, done.err) == (0, "")
    assert done.answer["status"] == "solved"
    assert picture.read_bytes().startswith(magic)


def test_plot_draws_what_is_not_solved_and_any_level(cli, rooms, tmp_path):
    picture = tmp_path / "a.png"
    for outside in ("--start", "1.5,1.5"), ("--start", "-1e300,3"):
        done = cli("plan", rooms, *outside, "--goal", "7.5,3.5", "--plot", picture)
        assert (done.code, done.err) == (1, "")
        _check_png(picture)
    for level in (0, -1):
        assert cli("show", rooms, "--level", level, "--plot", picture).code == 0
        _check_png(picture)


def _check_png(path):
    with Image.open(path) as image:
        assert min(image.size) > 100
        image.load()
    path.unlink()


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("no/a.png", "no folder"),
        ("a.xyz", ".png"),
        ("a", ".png"),
        ("folder.png", "is a folder"),
        ("m.yaml/a.png", "no folder"),
        ("x" * 300 + ".png", "too long"),
        ("two\nlines.jpg", "two\\nlines.jpg"),
    ],
)
@pytest.mark.parametrize("command", ["plan", "show"])
def test_a_picture_that_cannot_be_is_refused_before_the_work(cli, tmp_path, command, name, word):
    (tmp_path / "folder.png").mkdir()
    endpoints = ENDS if command == "plan" else ()
    # The map is not even looked for: that would be exit code 3.
    done = cli(command, tmp_path / "gone.yaml", *endpoints, "--plot", tmp_path / name)
    assert done.refuses(2, "--plot", word)


def test_a_result_is_not_lost_with_its_picture(cli, rooms, tmp_path):
    picture = tmp_path / "a.png"
    picture.symlink_to("/dev/full")
    endpoints = ("--start", "1.5,3.5", "--goal", "7.5,3.5")
    done = cli("plan", rooms, *endpoints, "--json", "--plot", picture)
    assert (done.code, done.answer["status"]) == (2, "solved")
    assert done.err.count("\n") == 1
    assert "a.png" in done.err


BUILDING = MAPS / "building" / "building.yaml"


@pytest.mark.parametrize("command", ["plan", "build", "view", "export", "check"])
def test_help_of_what_takes_buildings_says_so(cli, command):
    assert "building of several floors (.yaml or .hnm)" in " ".join(
        cli(command, "--help").out.split()
    )


@pytest.mark.parametrize("command", ["show", "rooms", "explore", "replay"])
def test_a_building_where_a_map_is_meant_is_named(cli, command):
    assert cli(command, BUILDING).refuses(3, "a building, expected one map: name that of a floor")
    assert "of several floors" not in cli(command, "--help").out


def test_rooms_beside_the_map_are_listed_and_found_anew_on_demand(cli, rooms, tmp_path):
    square = "[[1, 2], [4, 2], [4, 6], [1, 6]]"
    beside = tmp_path / "rooms.yaml"
    beside.write_text(f"rooms:\n- name: kitchen\n  polygon: {square}\n")
    radius = ("--robot-radius", 0)
    assert [one["name"] for one in cli("rooms", rooms, *radius, "--json").answer["rooms"]] == [
        "kitchen"
    ]
    for option in (("--find",), ("--least-area", 0.5)):
        found = cli("rooms", rooms, *radius, *option, "--json").answer["rooms"]
        assert "kitchen" not in [one["name"] for one in found]
    before = beside.read_text()
    for out in ("rooms.yaml", "m.yaml"):
        done = cli("rooms", rooms, *radius, "--find", "-o", tmp_path / out)
        assert done.refuses(2, f"{out} exists", "add --force")
    assert beside.read_text() == before
    assert cli("rooms", rooms, "--find", "--rooms", beside).refuses(2, "--find is for rooms")
    assert cli("rooms", rooms, *radius, "--find", "-o", beside, "--force").code == 0
    assert "kitchen" not in hn.load_rooms(beside, hn.load_map(rooms)).names


@pytest.mark.parametrize("kind", ["nav2", "rooms", "places"])
def test_export_writes_over_nothing_without_force(cli, rooms, tmp_path, kind):
    out = tmp_path / "graph.geojson"
    out.write_text("mine")
    query = ("export", rooms, "--robot-radius", 0, "--format", kind, "-o", out)
    assert cli(*query).refuses(2, "graph.geojson exists: add --force to write over it")
    assert out.read_text() == "mine"
    assert cli(*query, "--force").code == 0
    assert out.read_text() != "mine"


def test_a_proof_is_written_and_verified(cli, rooms, tmp_path):
    proof = tmp_path / "proof.json"
    plan = ("plan", rooms, "--start", "1.5,3.5", "--goal", "7.2,4.9", "--proof", proof)
    assert cli(*plan).code == 0
    done = cli("verify", rooms, proof)
    assert (done.code, done.err) == (0, "")
    assert done.out.startswith("accepted   path from [1.5, 3.5] to [7.2, 4.9], radius 0.25 m")
    proof.write_text(proof.read_text().replace('"radius_m":0.25', '"radius_m":1.5'))
    done = cli("verify", rooms, proof)
    assert done.code == 1
    assert done.out == "rejected   map, radius and closed cells leave other cells free\n"
    for text, code in (("{}", 3), ("no JSON", 3), ('{"thresholds": [1]}', 3), ("[]", 3)):
        proof.write_text(text)
        done = cli("verify", rooms, proof)
        assert (done.code, done.out, done.err.count("\n")) == (code, "", 1)
    assert cli("verify", rooms, tmp_path / "none.json").code == 3
    assert cli(*plan[:-1], tmp_path / "proof.txt").code == 2
    assert cli(*plan, "--alternatives", "2").code == 2


def test_a_proof_of_no_path_is_verified(cli, draw, tmp_path):
    walled = draw("#######", "#..#..#", "#######")
    plan = ("plan", walled, "--start", "1.5,1.5", "--goal", "5.5,1.5", "--proof")
    assert cli(*plan, tmp_path / "p.json").code == 1
    done = cli("verify", walled, tmp_path / "p.json")
    assert done.out == "accepted   no path from [1.5, 1.5] to [5.5, 1.5], radius 0.25 m\n"
