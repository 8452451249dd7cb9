"""`hybridnav map`: what it writes, prints and refuses."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import hybridnav as hn

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
    assert cli("map", log, "-o", out, "--max-cells", "9").refuses(3, "12 beyond --max-cells")
    assert not out.exists()
