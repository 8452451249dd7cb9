"""`hybridnav explore`, `map` and `replay`: what they write, print, draw and refuse."""

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image, ImageSequence

import hybridnav as hn
from tests.ext.live.files.bag_writer import KINDS
from tests.ext.live.files.drive import driven


@pytest.fixture
def plan(tmp_path: Path) -> Path:
    """The file of a floor plan: two rooms with a door between them."""
    cells = np.zeros((30, 50), dtype=np.float32)
    cells[[0, -1]] = cells[:, [0, -1]] = 1.0
    cells[:, 24] = 1.0
    cells[10:20, 24] = 0.0
    hn.write_ros_map(hn.OccupancyGrid(cells, hn.Frame(0.1)), tmp_path / "plan.yaml")
    return tmp_path / "plan.yaml"


def test_a_robot_makes_a_map_that_other_commands_read(cli: Any, plan: Path) -> None:
    out = plan.with_name("made.yaml")
    done = cli("explore", plan, "--robot-radius", 0.2, "--start", "1,1", "-o", out)
    assert done.code == 0
    assert "known      100 % of what the robot can reach, nothing in reach is unknown" in done.out
    assert "given up   0 cells" in done.out
    assert cli("plan", out, "--start", "1,1", "--goal", "4,1").code == 0
    again = cli("explore", plan, "--robot-radius", 0.2, "--start", "1,1", "--json")
    figures = json.loads(again.out)
    assert (figures["complete"], figures["share_known"], figures["given_up"]) == (True, 1.0, 0)
    assert f"driven     {figures['driven_m']:.1f} m" in done.out
    assert figures["cells"] == hn.load_map(out, robot_radius_m=0.2).class_counts()


def test_an_animation_shows_the_map_growing(cli: Any, plan: Path) -> None:
    picture = plan.with_name("grown.gif")
    options = ("--range", 2, "--plot", picture, "--frames", 3)
    assert cli("explore", plan, "--robot-radius", 0.2, "--start", "1,1", *options).code == 0
    with Image.open(picture) as frames:
        shown = [np.asarray(frame.convert("L")) for frame in ImageSequence.Iterator(frames)]
    assert 1 < len(shown) <= 3
    assert (shown[0] != shown[-1]).mean() > 0.01


def test_the_rule_of_the_next_goal_decides_how_far_the_robot_drives(cli: Any, plan: Path) -> None:
    common = ("explore", plan, "--robot-radius", 0.2, "--start", "1,1", "--json")
    driven = [json.loads(cli(*common, *by).out)["driven_m"] for by in ((), ("--by", "frontier"))]
    assert driven[0] < driven[1]
    assert cli(*common, "--by", "luck").refuses(2, "--by must be one of path, frontier, room")


def test_the_end_by_the_number_of_goals_is_stated(cli: Any, plan: Path) -> None:
    options = ("--range", 2, "--most-goals", 1)
    done = cli("explore", plan, "--robot-radius", 0.2, *options)
    assert done.code == 0
    assert "ended by --most-goals" in done.out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--start", "here"), "--start must be two finite numbers X,Y in metres, got 'here'"),
        (("--start", "nan,1"), "--start must be two finite numbers X,Y in metres, got 'nan,1'"),
        (("--start", "0.05,0.05"), "the start (0.05, 0.05) is not in a free cell of the plan"),
        (("--range", "nan"), "max_range_m is nan, expected a finite number > 0"),
        (("--noise", "-1"), "noise_m is -1.0, expected a finite length >= 0"),
        (("-o", "made.png"), "--out"),
        (("--robot-radius", "99"), "a robot radius of 99 m leaves no free cell"),
        (("--plot", "made.png"), "--plot must end in .gif"),
    ],
)
def test_wrong_options_end_in_one_line(cli, plan, options, said):
    done = cli("explore", plan, *options)
    assert done.code in {2, 3}
    assert said in done.err
    assert done.err.count("\n") == 1


def test_the_floor_plan_is_never_replaced(cli: Any, plan: Path) -> None:
    before = {file: file.read_bytes() for file in plan.parent.iterdir()}
    for name in ("plan.yaml", "plan.yml", "../" + plan.parent.name + "/plan.yaml"):
        assert cli("explore", plan, "-o", plan.parent / name).refuses(2, "replace the floor plan")
    assert {file: file.read_bytes() for file in plan.parent.iterdir()} == before


def test_the_image_of_the_floor_plan_is_never_replaced(cli: Any, plan: Path) -> None:
    image = plan.with_name("picture.pgm")
    plan.with_suffix(".pgm").rename(image)
    plan.write_text(plan.read_text().replace("plan.pgm", "picture.pgm"))
    before = image.read_bytes()
    out = plan.with_name("picture.yaml")
    assert cli("explore", plan, "-o", out).refuses(2, "replace the floor plan")
    assert image.read_bytes() == before


def room_log(path: Path, *, extra: str = "") -> Path:
    """Write the log of a laser that turns in a room of 4 x 3 m."""
    lines = []
    for k in range(12):
        heading = k * math.tau / 12
        ranges = []
        for beam in range(181):
            angle = heading + math.radians(beam - 90)
            along, across = math.cos(angle), math.sin(angle)
            reach = min(2.0 / max(abs(along), 1e-9), 1.5 / max(abs(across), 1e-9))
            ranges.append(f"{reach + 0.01:.3f}")
        pose = f"5.0 5.0 {heading:.6f}"
        lines.append(f"FLASER 181 {' '.join(ranges)} {pose} {pose} {k} robot {k}\n")
    path.write_text("".join(lines) + extra, encoding="utf-8")
    return path


def test_a_log_becomes_a_map_that_other_commands_read(cli: Any, tmp_path: Path) -> None:
    log, out = room_log(tmp_path / "room.log", extra="FLASER 181 1.0 1."), tmp_path / "room.yaml"
    done = cli("map", log, "-o", out, "--force", "--resolution", "0.1")
    assert (done.code, done.err) == (0, "")
    assert "scans      12, recorded in 11 s" in done.out
    assert "log        left out 1 of 13 scans: 1 line cut off" in done.out
    grid = hn.load_map(out, robot_radius_m=0)

    def kind(x: float, y: float) -> hn.CellClass:
        return hn.CellClass(int(grid.measured[tuple(grid.frame.cells_of([x, y]))]))

    assert {kind(x, y) for x in (3.5, 5.0, 6.5) for y in (4.0, 5.0, 6.0)} == {hn.CellClass.FREE}
    walls = [(7.05, 5.0), (2.95, 5.0), (5.0, 6.55), (5.0, 3.45)]
    assert {kind(x, y) for x, y in walls} == {hn.CellClass.OCCUPIED}
    assert grid.shape == (32, 42)
    assert cli("plan", out, "--start", "3.5,4", "--goal", "6.5,6").code == 0


@pytest.mark.parametrize("name", ["log.yaml", "log.pgm"])
def test_the_log_is_never_replaced(cli: Any, tmp_path: Path, name: str) -> None:
    log = room_log(tmp_path / name)
    before = log.read_bytes()
    assert cli("map", log, "-o", tmp_path / "log.yaml").refuses(2, "would replace the log")
    assert log.read_bytes() == before


def test_the_figures_are_one_object(cli: Any, tmp_path: Path) -> None:
    log, out = room_log(tmp_path / "room.log"), tmp_path / "room.yaml"
    answer = cli("map", log, "-o", out, "--force", "--resolution", "0.1", "--json").answer
    grid = hn.load_map(out, robot_radius_m=0)
    assert (answer["rows"], answer["cols"]) == grid.shape
    assert answer["cells"] == grid.class_counts()
    assert (answer["scans"], answer["left_out"], answer["recorded_s"]) == (12, {}, 11.0)


def test_settings_of_the_sensor_reach_the_map(cli: Any, tmp_path: Path) -> None:
    log, out = room_log(tmp_path / "room.log"), tmp_path / "room.yaml"
    settings = ("--max-range", "1.9", "--clear-range", "1.0", "--hit", "0.7", "--pass", "0.4")
    assert cli("map", log, "-o", out, "--force", "--resolution", "0.1", *settings).code == 0
    grid = hn.load_map(out, robot_radius_m=0)
    far = grid.frame.cells_of([7.05, 5.0])
    assert far[1] >= grid.shape[1]  # the walls at 2 m are beyond
    middle = grid.frame.cells_of([5.05, 6.55])
    assert grid.measured[tuple(middle)] == hn.CellClass.OCCUPIED


def test_what_cannot_be_mapped_is_refused(cli: Any, tmp_path: Path) -> None:
    log, out = room_log(tmp_path / "room.log"), tmp_path / "room.yaml"
    empty = tmp_path / "empty.log"
    empty.write_text("ODOM 1 2 3\nFLASER 3 1\n", encoding="utf-8")
    assert cli("map", empty, "-o", out, "--force").refuses(3, "no scan", "FLASER", "1 line cut off")
    assert cli("map", log, "-o", out, "--force", "--max-range", "0.5").refuses(
        3, "no reading below"
    )
    assert cli("map", tmp_path / "no.log", "-o", out, "--force").refuses(3, "no such file")
    assert cli("map", log, "-o", tmp_path / "room.png").refuses(2, "must end in .yaml")
    assert cli("map", log, "-o", tmp_path / "no" / "room.yaml").refuses(2, "cannot write")
    assert cli("map", log, "-o", out, "--force", "--resolution", "0").refuses(2, "resolution")
    assert cli("map", log, "-o", out, "--force", "--hit", "0.4").refuses(2, "when_hit")
    assert cli("map", log, "-o", out, "--force", "--least", "0.5").refuses(2, "least_probability")
    assert cli("map", log, "-o", out, "--force", "--max-cells", "9").refuses(
        3, "12 beyond --max-cells"
    )
    assert not out.exists()


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_becomes_a_map_of_its_scans(cli, tmp_path, kind):
    out = tmp_path / "room.yaml"
    bag = driven(kind).write(tmp_path)
    done = cli("map", bag, "-o", out, "--force", "--resolution", 0.1, "--json")
    assert (done.code, done.err) == (0, "")
    assert (done.answer["scans"], done.answer["left_out"]) == (40, {})
    grid = hn.load_map(out, robot_radius_m=0)
    walls = grid.frame.points_of(np.argwhere(grid.measured == hn.CellClass.OCCUPIED))
    away = np.minimum(np.abs(np.abs(walls[:, 0]) - 4), np.abs(np.abs(walls[:, 1]) - 3))
    assert len(walls) > 50
    assert away.max() < 0.11
    shown = cli("map", bag, "-o", out, "--force", "--resolution", 0.1).out
    assert [line.split()[0] for line in shown.splitlines()] == [
        "map", "extent", "cells", "scans", "log", "seconds",
    ]  # fmt: skip
    assert cli("replay", bag, "--every", 10, "--resolution", 0.2, "--json").code == 0


def test_the_map_of_a_bag_is_written_as_it_is(cli, tmp_path):
    grid = hn.example_map("figure1")
    hn.ext.live.save_bag(tmp_path / "kept.bag", grid=grid)
    out = tmp_path / "kept.yaml"
    done = cli("map", tmp_path / "kept.bag", "-o", out, "--force", "--topic", "/map", "--json")
    assert done.answer["cells"]["free"] == (grid.measured == hn.CellClass.FREE).sum()
    again = hn.load_map(out, robot_radius_m=grid.robot_radius_m)
    assert (again.measured == grid.measured).all()
    assert cli("map", tmp_path / "kept.bag", "-o", out, "--topic", "/map").refuses(
        2, "kept.yaml exists: add --force to write over it"
    )
    out.unlink()
    assert cli("map", tmp_path / "kept.bag", "-o", out, "--topic", "/map").refuses(
        2, "kept.pgm exists: add --force to write over it"
    )
    shown = cli("map", tmp_path / "kept.bag", "-o", out, "--force", "--topic", "/map").out
    assert [line.split()[0] for line in shown.splitlines()] == ["map", "extent", "cells"]


def test_wrong_topics_and_frames_end_in_one_line(cli, tmp_path):
    bag, out = driven("mcap").write(tmp_path), tmp_path / "m.yaml"
    assert cli("map", bag, "-o", out, "--force", "--topic", "/rear").refuses(
        3, "'/rear'", "/scan: name one"
    )
    moon = cli("map", bag, "-o", out, "--force", "--frame", "moon")
    assert moon.refuses(3, "no scan of a laser", "40 no transforms from laser to moon")
    log = tmp_path / "some.log"
    log.write_text("")
    assert cli("map", log, "-o", out, "--force", "--topic", "/scan").refuses(
        2, "--topic is for bags"
    )
    assert cli("map", log, "-o", out, "--force", "--frame", "odom").refuses(
        2, "--frame is for bags"
    )
    assert not out.exists()


def two_maps(folder: Path) -> list[Path]:
    """Write a map of two rooms, and the same with a closed door."""
    probability = np.zeros((12, 25), np.float32)
    probability[:, 12] = 1.0
    files = []
    for name, door in (("open", 0.0), ("shut", 1.0)):
        probability[4:8, 12] = door
        grid = hn.OccupancyGrid(probability, hn.Frame(0.25), robot_radius_m=0)
        files.append(folder / f"{name}.yaml")
        hn.write_ros_map(grid, files[-1])
    return files


def test_maps_are_replayed_one_after_the_other(cli: Any, tmp_path: Path) -> None:
    done = cli("replay", *two_maps(tmp_path), "--robot-radius", "0", "--rooms-every", "1")
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert lines[0] == "maps       2, the last of 25 x 12 cells"
    assert lines[1].endswith("2 rooms, 0 doors")
    assert "doors      0 born, 1 died, 0 merged, 0 split, 0 changed" in lines
    assert lines[-1].startswith("check      ")
    assert lines[-1].endswith("each boundary of their fields is one arc")


def test_a_log_is_replayed_scan_by_scan_and_drawn(cli: Any, tmp_path: Path) -> None:
    log, picture = room_log(tmp_path / "room.log"), tmp_path / "room.gif"
    options = "--resolution", "0.1", "--robot-radius", "0", "--frames", "4", "--json"
    done = cli("replay", log, "--every", "2", *options, "--plot", picture)
    assert (done.code, done.err) == (0, "")
    found = json.loads(done.out)
    assert (found["maps"], found["n_rooms"], found["faults"]) == (6, 1, [])
    assert found["places"]["updates"] == 5
    with Image.open(picture) as image:
        assert image.n_frames in {3, 4}  # type: ignore[attr-defined]
        assert image.width == 1100


def test_names_are_followed_if_asked(cli: Any, tmp_path: Path) -> None:
    first, second = two_maps(tmp_path)
    grid = hn.load_map(second, robot_radius_m=0)
    labels = np.zeros(grid.shape, np.int32)
    labels[:, 12:] = 1
    rooms = tmp_path / "named.yaml"
    hn.save_rooms(rooms, hn.RoomLabels(("kitchen", "hall"), labels), grid)
    gone = tmp_path / "gone.yaml"
    probability = np.where(np.arange(25) > 11, 1.0, grid.probability)
    hn.write_ros_map(hn.OccupancyGrid(probability, grid.frame, robot_radius_m=0), gone)
    options = "--robot-radius", "0", "--rooms-every", "1"
    done = cli("replay", first, second, gone, *options, "--rooms", rooms)
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert ", 1 rooms, 0 doors" in lines[1]
    assert "names      lost with their rooms: hall" in lines
    found = json.loads(cli("replay", first, second, *options, "--json").out)
    assert (found["lost_names"], found["faults"]) == ([], [])


def test_few_scans_of_a_log_are_read_if_asked(cli: Any, tmp_path: Path) -> None:
    log = room_log(tmp_path / "room.log")
    done = cli("replay", log, "--scans", "1", "--resolution", "0.1", "--json")
    assert json.loads(done.out)["maps"] == 1
    plain = cli("replay", log, "--scans", "1", "--resolution", "0.1")
    assert "places     no update" in plain.out
    assert "log        left out 0 of 1 scans" in plain.out


def test_scans_that_need_too_many_cells_are_counted(cli: Any, tmp_path: Path) -> None:
    log = room_log(tmp_path / "room.log")
    done = cli("replay", log, "--resolution", "0.1", "--max-cells", 10)
    assert done.refuses(3, "no scan with a reading", "beyond --max-cells")


@pytest.mark.parametrize(
    ("files", "options", "message"),
    [
        (["a.yaml", "b.log"], [], "replay a log alone"),
        (["a.log", "b.log"], [], "got 2 logs"),
        (["a.yaml"], ["--every", "2"], "are for a log"),
        (["a.log"], ["--rooms", "rooms.yaml"], "--rooms is for map files"),
        (["a.log"], ["--plot", "a.png"], "--plot must end in .gif"),
        (["a.log"], ["--every", "0"], "--every"),
    ],
)
def test_wrong_usage_ends_in_one_line(cli, files, options, message):
    done = cli("replay", *files, *options)
    assert (done.code, done.out) == (2, "")
    assert message in done.err
    assert done.err.count("\n") == 1


def test_input_that_cannot_be_replayed_ends_in_one_line(cli: Any, tmp_path: Path) -> None:
    empty = tmp_path / "empty.log"
    empty.write_text("nothing\n", encoding="utf-8")
    first, _ = two_maps(tmp_path)
    other = tmp_path / "other.yaml"
    hn.write_ros_map(
        hn.OccupancyGrid(np.zeros((3, 3), np.float32), hn.Frame(0.25), robot_radius_m=0), other
    )
    for arguments, message in (
        ([tmp_path / "none.log"], "none.log"),
        ([empty], "no scan with a reading"),
        ([first, other], "does not cover"),
        ([room_log(tmp_path / "room.log"), "--resolution", "nan"], "resolution"),
        ([first, "--merge-distance", "0"], "merge"),
        ([first, "--rooms", tmp_path / "none.yaml"], "none.yaml"),
    ):
        done = cli("replay", *arguments)
        assert done.code != 0
        assert message in done.err
        assert done.err.count("\n") == 1
