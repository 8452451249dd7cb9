"""`hybridnav replay`: what it prints, draws and refuses."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

import hybridnav as hn
from tests.cli.test_map import room_log

if TYPE_CHECKING:
    from pathlib import Path


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


def test_regions_and_names_are_followed_if_asked(cli: Any, tmp_path: Path) -> None:
    first, second = two_maps(tmp_path)
    grid = hn.load_map(second, robot_radius_m=0)
    labels = np.zeros(grid.shape, np.int32)
    labels[:, 12:] = 1
    rooms = tmp_path / "named.yaml"
    hn.save_rooms(rooms, hn.RoomLabels(("kitchen", "hall"), labels), grid)
    gone = tmp_path / "gone.yaml"
    probability = np.where(np.arange(25) > 11, 1.0, grid.probability)
    hn.write_ros_map(hn.OccupancyGrid(probability, grid.frame, robot_radius_m=0), gone)
    options = "--robot-radius", "0", "--rooms-every", "1", "--regions", "50"
    done = cli("replay", first, second, gone, *options, "--rooms", rooms)
    assert (done.code, done.err) == (0, "")
    lines = done.out.splitlines()
    assert " regions, 1 rooms, 0 doors" in lines[1]
    assert any(line.startswith("regions    2 updates") for line in lines)
    assert "names      lost with their rooms: hall" in lines
    found = json.loads(cli("replay", first, second, *options, "--json").out)
    assert found["regions"]["updates"] == 1
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
        (["a.yaml"], ["--regions", "0"], "--regions"),
        (["a.log"], ["--plot", "a.png"], "--plot must end in .gif"),
        (["a.log"], ["--every", "0"], "--every"),
    ],
)
def test_wrong_usage_ends_in_one_line(
    cli: Any, files: list[str], options: list[str], message: str
) -> None:
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
