"""`hybridnav map`: what it writes, prints and refuses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import hybridnav as hn
from tests.ext.live.files.bag_writer import KINDS
from tests.ext.live.files.drive import driven

if TYPE_CHECKING:
    from pathlib import Path


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
    done = cli("map", log, "-o", out, "--resolution", "0.1")
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
    answer = cli("map", log, "-o", out, "--resolution", "0.1", "--json").answer
    grid = hn.load_map(out, robot_radius_m=0)
    assert (answer["rows"], answer["cols"]) == grid.shape
    assert answer["cells"] == grid.class_counts()
    assert (answer["scans"], answer["left_out"], answer["recorded_s"]) == (12, {}, 11.0)


def test_settings_of_the_sensor_reach_the_map(cli: Any, tmp_path: Path) -> None:
    log, out = room_log(tmp_path / "room.log"), tmp_path / "room.yaml"
    settings = ("--max-range", "1.9", "--clear-range", "1.0", "--hit", "0.7", "--pass", "0.4")
    assert cli("map", log, "-o", out, "--resolution", "0.1", *settings).code == 0
    grid = hn.load_map(out, robot_radius_m=0)
    far = grid.frame.cells_of([7.05, 5.0])
    assert far[1] >= grid.shape[1]  # the walls at 2 m are beyond
    middle = grid.frame.cells_of([5.05, 6.55])
    assert grid.measured[tuple(middle)] == hn.CellClass.OCCUPIED


def test_what_cannot_be_mapped_is_refused(cli: Any, tmp_path: Path) -> None:
    log, out = room_log(tmp_path / "room.log"), tmp_path / "room.yaml"
    empty = tmp_path / "empty.log"
    empty.write_text("ODOM 1 2 3\nFLASER 3 1\n", encoding="utf-8")
    assert cli("map", empty, "-o", out).refuses(3, "no scan", "FLASER", "1 line cut off")
    assert cli("map", log, "-o", out, "--max-range", "0.5").refuses(3, "no reading below")
    assert cli("map", tmp_path / "no.log", "-o", out).refuses(3, "no such file")
    assert cli("map", log, "-o", tmp_path / "room.png").refuses(2, "must end in .yaml")
    assert cli("map", log, "-o", tmp_path / "no" / "room.yaml").refuses(2, "cannot write")
    assert cli("map", log, "-o", out, "--resolution", "0").refuses(2, "resolution")
    assert cli("map", log, "-o", out, "--hit", "0.4").refuses(2, "when_hit")
    assert cli("map", log, "-o", out, "--least", "0.5").refuses(2, "least_probability")
    assert cli("map", log, "-o", out, "--max-cells", "9").refuses(3, "12 beyond --max-cells")
    assert not out.exists()


@pytest.mark.parametrize("kind", KINDS)
def test_a_bag_becomes_a_map_of_its_scans(cli, tmp_path, kind):
    out = tmp_path / "room.yaml"
    bag = driven(kind).write(tmp_path)
    done = cli("map", bag, "-o", out, "--resolution", 0.1, "--json")
    assert (done.code, done.err) == (0, "")
    assert (done.answer["scans"], done.answer["left_out"]) == (40, {})
    grid = hn.load_map(out, robot_radius_m=0)
    walls = grid.frame.points_of(np.argwhere(grid.measured == hn.CellClass.OCCUPIED))
    away = np.minimum(np.abs(np.abs(walls[:, 0]) - 4), np.abs(np.abs(walls[:, 1]) - 3))
    assert len(walls) > 50
    assert away.max() < 0.11
    shown = cli("map", bag, "-o", out, "--resolution", 0.1).out
    assert [line.split()[0] for line in shown.splitlines()] == [
        "map", "extent", "cells", "scans", "log", "seconds",
    ]  # fmt: skip
    assert cli("replay", bag, "--every", 10, "--resolution", 0.2, "--json").code == 0


def test_the_map_of_a_bag_is_written_as_it_is(cli, tmp_path):
    grid = hn.example_map("figure1")
    hn.save_bag(tmp_path / "kept.bag", grid=grid)
    out = tmp_path / "kept.yaml"
    done = cli("map", tmp_path / "kept.bag", "-o", out, "--topic", "/map", "--json")
    assert done.answer["cells"]["free"] == (grid.measured == hn.CellClass.FREE).sum()
    again = hn.load_map(out, robot_radius_m=grid.robot_radius_m)
    assert (again.measured == grid.measured).all()
    shown = cli("map", tmp_path / "kept.bag", "-o", out, "--topic", "/map").out
    assert [line.split()[0] for line in shown.splitlines()] == ["map", "extent", "cells"]


def test_wrong_topics_and_frames_end_in_one_line(cli, tmp_path):
    bag, out = driven("mcap").write(tmp_path), tmp_path / "m.yaml"
    assert cli("map", bag, "-o", out, "--topic", "/rear").refuses(3, "'/rear'", "/scan: name one")
    moon = cli("map", bag, "-o", out, "--frame", "moon")
    assert moon.refuses(3, "no scan of a laser", "40 no transforms from laser to moon")
    log = tmp_path / "some.log"
    log.write_text("")
    assert cli("map", log, "-o", out, "--topic", "/scan").refuses(2, "--topic is for bags")
    assert cli("map", log, "-o", out, "--frame", "odom").refuses(2, "--frame is for bags")
    assert not out.exists()
