"""`hybridnav explore`: what it writes, prints and refuses."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image, ImageSequence

import hybridnav as hn

if TYPE_CHECKING:
    from pathlib import Path


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
    options = ("--sensor", "sonar", "--range", 2, "--most-goals", 1)
    done = cli("explore", plan, "--robot-radius", 0.2, *options)
    assert done.code == 0
    assert "ended by --most-goals" in done.out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--start", "here"), "--start must be two finite numbers X,Y in metres, got 'here'"),
        (("--start", "nan,1"), "--start must be two finite numbers X,Y in metres, got 'nan,1'"),
        (("--start", "0.05,0.05"), "the start (0.05, 0.05) is not in a free cell of the plan"),
        (("--sensor", "eyes"), "--sensor must be laser or sonar, got 'eyes'"),
        (("--range", "nan"), "max_range_m is nan, expected a finite number > 0"),
        (("--noise", "-1"), "noise_m is -1.0, expected a finite length >= 0"),
        (("-o", "made.png"), "--out"),
        (("--robot-radius", "99"), "a robot radius of 99 m leaves no free cell"),
        (("--plot", "made.png"), "--plot must end in .gif"),
    ],
)
def test_wrong_options_end_in_one_line(
    cli: Any, plan: Path, options: tuple[str, ...], said: str
) -> None:
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
