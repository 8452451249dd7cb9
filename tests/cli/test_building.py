"""`hybridnav plan` and `build` for a building."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest

import hybridnav as hn
from tests.houses import FIGURE, write_house

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Two floors of one little map, with a lift and stairs."""
    return write_house(tmp_path)


QUERY = "--start", "1:1.5,0.6", "--goal", "2:0.5,0.5", "--robot-radius", "0"


def test_a_route_over_floors_is_printed(cli: Any, file: Path) -> None:
    ran = cli("plan", file, *QUERY)
    assert ran.code == 0
    told = ran.out.splitlines()
    building = hn.load_building(file, robot_radius_m=0)
    plan = building.plan(("1", (1.5, 0.6)), ("2", (0.5, 0.5)))
    assert told[0] == "query      house.yaml, 1:1.5,0.6 to 2:0.5,0.5, robot radius 0 m"
    assert told[1] == "status     solved"
    assert told[2] == f"length     {plan.length_m:.2f} m (any-angle)"
    assert told[3] == "rides      ladder from floor 1 to floor 2, 0 s, charged 1.00 m"
    assert told[4] == f"cost       {plan.cost:.2f} m, {plan.travel_s:.0f} s"
    assert told[5] == f"bound      {plan.cost:.2f} m, the route is optimal"
    answer = json.loads(cli("plan", file, *QUERY, "--json").out)
    assert answer["cost"] == plan.cost
    assert answer["floors"] == ["1", "2"]
    assert answer["rides"][0]["link"] == "ladder"


def test_links_and_doors_are_closed(cli: Any, file: Path) -> None:
    by_lift = json.loads(cli("plan", file, *QUERY, "--no-stairs", "--json").out)
    assert [ride["link"] for ride in by_lift["rides"]] == ["lift"]
    closed = json.loads(cli("plan", file, *QUERY, "--blocked", "link:ladder", "--json").out)
    assert closed["cost"] == by_lift["cost"]
    assert closed["blocked"] == ["link:ladder"]
    none = cli("plan", file, *QUERY, "--blocked", "link:ladder", "--blocked", "link:lift")
    assert none.code == 1
    assert "status     no path" in none.out
    door = cli("plan", file, *QUERY, "--blocked", "2:door:1")
    assert (door.code, "no door has the number 1" in door.err) == (2, True)
    room = cli("plan", file, *QUERY, "--blocked", "2:room:room-1")
    assert (room.code, "status     goal blocked" in room.out) == (1, True)
    both = cli("plan", file, *QUERY, "--alternatives", "3", "--max-stretch", "9").out
    assert "route 1    cost" in both
    assert both.count(", by ") == 2
    assert "routes     2 of 3: no other sequence of links is at most 9 times as dear" in both


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--start", "1:1,1"), "missing option '--goal' or '--to'"),
        (("--start", "1,1", "--goal", "2:1,1"), "a point of a building needs its floor, as 1:1,1"),
        (("--start", "4:1,1", "--goal", "2:1,1"), "no floor is called '4': there are 1, 2"),
        (("--start", "1:1,nan", "--goal", "2:1,1"), "expected FLOOR:X,Y, finite numbers"),
        (("--start", "1:1,1,1", "--goal", "2:1,1"), "expected FLOOR:X,Y, finite numbers"),
        (("--from", "attic", "--goal", "2:1,1"), "no room or point of the building is called"),
        ((*QUERY, "--compare"), "--compare is for one map, and this is a building: leave it out"),
        ((*QUERY, "--blocked", "door:1"), "no floor is called 'door'"),
        ((*QUERY, "--blocked", "areas"), "--blocked must be link:NAME, or FLOOR:"),
        ((*QUERY, "--blocked", "link:hoist"), "no link is called 'hoist'"),
        ((*QUERY, "--max-stretch", "3"), "--max-stretch is for alternatives"),
        ((*QUERY, "--language", "fr"), "language must be one of"),
    ],
)
def test_wrong_usage_is_one_line(
    cli: Any, file: Path, arguments: tuple[str, ...], message: str
) -> None:
    ran = cli("plan", file, *arguments)
    assert ran.code == 2
    assert message in ran.err
    assert ran.err.count("\n") == 1


def test_options_of_buildings_mean_nothing_on_one_map(cli: Any) -> None:
    query = "plan", FIGURE, "--goal", "2.0,2.5", "--robot-radius", "0"
    ran = cli(*query, "--start", "0.5,0.5", "--no-stairs")
    assert (ran.code, "--no-stairs is for a building" in ran.err) == (2, True)
    ran = cli(*query, "--start", "1:0.5,0.5")
    assert (ran.code, "expected X,Y in metres" in ran.err) == (2, True)


def test_an_unreadable_building_is_no_usage(cli: Any, file: Path) -> None:
    file.write_text(file.read_text(encoding="utf-8").replace("kind: lift", "kind: rope"))
    ran = cli("plan", file, *QUERY)
    assert ran.code == 3
    assert "line 5: link lift: kind must be lift, stairs, ramp, got 'rope'" in ran.err
    assert ran.err.count("\n") == 1


def test_a_model_is_built_and_plans_alike(cli: Any, file: Path, tmp_path: Path) -> None:
    out = tmp_path / "house.hnm"
    ran = cli("build", file, "-o", out, "--robot-radius", "0")
    assert ran.code == 0
    assert "floors     2: 1, 2" in ran.out
    assert "links      2: lift, ladder" in ran.out
    one = json.loads(cli("plan", file, *QUERY, "--json").out)
    other = json.loads(cli("plan", out, *QUERY[:4], "--json").out)
    assert one["cost"] == other["cost"]
    assert cli("build", file, "-o", out, "--seed", "3").code == 2
    assert cli("build", file, "-o", out, "--preset", "octile", "--preset", "paper").code == 2


def test_the_floors_are_drawn(cli: Any, file: Path, tmp_path: Path) -> None:
    for number, more in enumerate(
        ((), ("--alternatives", "2", "--max-stretch", "9"), ("--blocked", "link:lift"))
    ):
        picture = tmp_path / f"{number}.svg"
        assert cli("plan", file, *QUERY, *more, "--plot", picture).code == 0
        drawn = picture.read_text(encoding="utf-8")
        assert 'id="link-ladder"' in drawn
        assert 'id="route-1"' in drawn
        assert ('id="route-2"' in drawn) == (number == 1)
