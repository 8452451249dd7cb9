"""Files of buildings: what they say, what is refused in one line, and models of buildings."""

import math
import re
import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

import hybridnav as hn
from hybridnav.ext.fleet.files import is_building
from tests.ext.fleet.scenes import random_building
from tests.plans import PLAIN

MAPS = Path(__file__).parents[4] / "maps"
WALLS = np.zeros((7, 12), dtype=np.float32)
WALLS[[0, -1]] = WALLS[:, [0, -1]] = 1.0
WALLS[1:4, 6] = WALLS[5, 6] = 1.0  # a door in row 4
ROOMS = (
    "rooms:\n- {name: lab, polygon: [[0, 0], [3, 0], [3, 3.5], [0, 3.5]]}\n"
    "- {name: hall, polygon: [[3, 0], [6, 0], [6, 3.5], [3, 3.5]]}\n"
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    grid = hn.OccupancyGrid(WALLS, hn.Frame(0.5), name="two rooms", robot_radius_m=0)
    hn.write_ros_map(grid, tmp_path / "two.yaml")
    (tmp_path / "rooms.yaml").write_text(ROOMS, encoding="utf-8")
    return tmp_path


def description(**change: Any) -> dict[str, Any]:
    """A building of two floors and a lift, as a tree."""
    floors = [
        {"name": name, "map": "two.yaml", "rooms": "rooms.yaml", "elevation_m": 3.0 * number}
        for number, name in enumerate(("1", "2"))
    ]
    ends: list[dict[str, Any]] = [{"floor": "1", "at": [1.2, 1.2]}, {"floor": "2", "room": "hall"}]
    lift = {"name": "lift", "kind": "lift", "wait_s": 10, "ride_s": 4, "ends": ends}
    return {"speed_m_s": 0.25, "floors": floors, "links": [lift]} | change


def written(folder: Path, tree: Any) -> Path:
    file = folder / "building.yaml"
    file.write_text(tree if isinstance(tree, str) else yaml.safe_dump(tree), encoding="utf-8")
    return file


def loaded(folder: Path, tree: Any) -> hn.ext.fleet.Building:
    return hn.ext.fleet.load_building(written(folder, tree), robot_radius_m=0)


def test_a_file_says_what_the_building_is(folder: Path) -> None:
    building = loaded(folder, description())
    assert [floor.name for floor in building.floors] == ["1", "2"]
    assert [floor.elevation_m for floor in building.floors] == [0.0, 3.0]
    assert building.speed_m_s == 0.25
    lift = building.link("lift")
    assert (lift.kind, lift.wait_s, lift.ride_s, lift.cost_m) == ("lift", 10, 4, 0)
    assert math.isinf(lift.max_radius_m)
    assert lift.ends[0] == hn.ext.fleet.LinkEnd("1", (1.2, 1.2))
    rooms = building.floor("2").planner.topology.rooms
    assert lift.ends[1].position_m == rooms.point_of("hall")
    plan = building.plan(("1", (1.2, 2.2)), ("2", "lab"))
    assert plan.charge_m == 0.25 * 14
    assert plan.gap == 0.0


@pytest.mark.parametrize("preset", ["shortest", "octile", "grid-astar", "paper", "robot"])
def test_a_link_leads_up_alone_if_the_file_says_so(folder: Path, preset: str) -> None:
    written(folder, with_link(one_way="up"))
    file = folder / "building.yaml"
    building = hn.ext.fleet.load_building(file, robot_radius_m=0, preset=preset)
    assert building.link("lift").label == "lift ↑"
    hn.save(building, folder / "b.hnm")
    filed = hn.ext.fleet.load_building(folder / "b.hnm")
    ends = ("1", (1.2, 2.2)), ("2", "lab")
    for house in (building, filed):
        assert house.links[0].one_way == "up"
        assert house.plan(*ends).solved
        back = house.plan(*ends[::-1])
        assert back.lower_bound == math.inf
        assert back.reasons["en"][1] == "One way only, and not that way: lift ↑."


def test_an_end_stands_on_the_side_of_a_door_that_is_said(folder: Path) -> None:
    for room, yaw_rad, x in (("lab", math.pi, 2.75), ("hall", 0.0, 3.25)):
        end = {"floor": "2", "door": 1, "room": room}
        lift = description()["links"][0] | {"ends": [{"floor": "1", "at": [1.2, 1.2]}, end]}
        found = loaded(folder, description(links=[lift])).link("lift").ends[1]
        assert found.yaw_rad == pytest.approx(yaw_rad)
        assert found.position_m == pytest.approx((x, 2.25))
    given_yaw = {"floor": "2", "door": 1, "room": "lab", "yaw_rad": 1.0}
    lift |= {"ends": [{"floor": "1", "at": [1.2, 1.2]}, given_yaw]}
    assert loaded(folder, description(links=[lift])).link("lift").ends[1].yaw_rad == 1.0
    lift |= {"ends": [{"floor": "1", "at": [1.2, 1.2]}, {"floor": "2", "door": 1}]}
    assert loaded(folder, description(links=[lift])).link("lift").ends[1].yaw_rad is None


def with_end(**end: Any) -> dict[str, Any]:
    lift = description()["links"][0] | {"ends": [{"floor": "1", "at": [1.2, 1.2]}, end]}
    return description(links=[lift])


def with_link(**change: Any) -> dict[str, Any]:
    return description(links=[description()["links"][0] | change])


def with_floor(**change: Any) -> dict[str, Any]:
    floors = description()["floors"]
    return description(floors=[floors[0], floors[1] | change])


REFUSED: dict[str, tuple[Any, str]] = {
    "empty": ("", "expected a mapping of keys to values, got nothing"),
    "list": ("- 1\n", "expected a mapping of keys to values"),
    "no floors": (description(floors=[]), "floors is empty, expected at least one floor"),
    "floors no list": (description(floors="1"), "floors must be a list, got '1'"),
    "floor no mapping": (description(floors=["1"]), "line 2: expected a mapping with name, map"),
    "unknown key": (description(lifts=[]), "unknown key 'lifts'; known are floors, links, speed"),
    "unknown key of an end": (with_end(floor="2", where=[1, 1]), "unknown key 'where'; known are"),
    "no name": (with_floor(name=None), "name must be a name, got None"),
    "name of a float": (with_floor(name=3.1), '3.1 is a number: write it as "3.1"'),
    "two of a name": (with_floor(name="1") | {"links": []}, "floor 1: the name is given twice"),
    "no map": (with_floor(map=None), "map is missing, expected a map file or a model"),
    "map elsewhere": (with_floor(map="none.yaml"), "floor 2: map"),
    "rooms elsewhere": (with_floor(rooms="none.yaml"), "none.yaml: no such file"),
    "height": (with_floor(elevation_m="high"), "elevation_m must be a finite number, got 'high'"),
    "both rooms": (with_floor(find_rooms=True), "rooms and find_rooms are both given"),
    "find what": (with_floor(find_rooms="yes, please"), "find_rooms must be true or false"),
    "speed": (description(speed_m_s=0), "speed_m_s is 0.0, expected a finite number"),
    "one way": (
        with_link(one_way="2"),
        "link lift: one_way must be up or down, or left out for both ways, got '2'",
    ),
    "kind": (with_link(kind="rope"), "link lift: kind must be lift, stairs, ramp, got 'rope'"),
    "wait": (with_link(wait_s=-1), "wait_s is -1.0, expected a finite number >= 0"),
    "endless ride": (with_link(ride_s=float("inf")), "ride_s must be a finite number, got inf"),
    "one end": (with_link(ends=[{"floor": "1", "at": [1.2, 1.2]}]), "has ends on 1, expected two"),
    "no place": (with_end(floor="2"), "lacks its place: give at: [x, y], room: NAME or door:"),
    "two places": (with_end(floor="2", at=[1, 1], door=1), "at and door are both given"),
    "no point": (with_end(floor="2", at=[1]), "at must be [x, y] in metres, got [1]"),
    "NaN": (with_end(floor="2", at=[1, float("nan")]), "at must be a finite number, got nan"),
    "door by name": (with_end(floor="2", door="front"), "door must be the number of a door"),
    "unknown floor": (with_end(floor="3", at=[1, 1]), "no floor is called '3': there are 1, 2"),
    "unknown room": (with_end(floor="2", room="haal"), "no room is called 'haal': did you mean"),
    "unknown door": (with_end(floor="2", door=7), "no door has the number 7: the doors are 1;"),
    "wrong room": (with_end(floor="2", at=[1.2, 1.2], room="hall"), "lies in room lab, expected"),
    "in a wall": (with_end(floor="2", at=[0.2, 0.2]), "(0.2, 0.2) on floor 2 lies in an occupied"),
    "two links of a name": (
        description(links=description()["links"] + description()["links"]),
        "link lift: the name is given twice",
    ),
    "outside": (with_end(floor="2", at=[99, 0]), "(99, 0) on floor 2 lies outside the map"),
    "anchors": ("floors: &a [*a]\n", "anchors and aliases are not supported"),
    "tags": ("floors: !!python/object:os.system {}\n", "tags are not supported"),
    "deep": ("floors: " + "[" * 60 + "]" * 60, "nested more than 32 deep"),
    "key twice": ("floors: []\nfloors: []\n", "key 'floors' is given twice"),
}


WHOLE = {"empty", "list", "no floors", "floors no list", "unknown key", "speed"}
"""What is wrong with the file as a whole; all else stands in a line."""


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_wrong_is_one_line(folder: Path, name: str) -> None:
    tree, message = REFUSED[name]
    with pytest.raises(hn.errors.MapError) as refused:
        loaded(folder, tree)
    text = str(refused.value)
    assert message in text
    assert text.startswith(f"building {folder / 'building.yaml'}")
    assert name in WHOLE or re.search(r"line \d+", text)
    assert "\n" not in text
    assert len(text) < 500 + len(str(folder)) * 2


@pytest.mark.parametrize(
    "settings", [{"robot_radius_m": -1}, {"robot_radius_m": "wide"}, {"max_cells": 0}]
)
def test_a_wrong_setting_is_no_fault_of_the_file(folder: Path, settings: Any) -> None:
    loaded(folder, description())
    with pytest.raises(hn.errors.InvalidValueError, match="must be a") as refused:
        hn.ext.fleet.load_building(folder / "building.yaml", **settings)
    assert "line" not in str(refused.value)


def test_an_end_that_is_cut_off_is_refused(folder: Path) -> None:
    probability = np.zeros((20, 40), dtype=np.float32)
    probability[10, :] = probability[:, 30] = 1.0
    probability[:4, 4] = probability[3, :4] = 1.0  # a closet of 3 x 4 cells
    hn.write_ros_map(hn.OccupancyGrid(probability, hn.Frame(0.5), robot_radius_m=0),
                     folder / "wing.yaml")  # fmt: skip
    ends = [{"floor": "1", "at": [1.2, 1.2]}, {"floor": "2", "at": [1.2, 0.7]}]
    tree = with_link(ends=ends)
    tree["floors"][1] |= {"map": "wing.yaml", "rooms": None}
    with pytest.raises(
        hn.errors.MapError,
        match=r"line \d+: link lift: .* lies in a part of 3 m² that is cut off from the rest",
    ):
        loaded(folder, tree)
    ends[1]["at"] = [17.0, 2.0]  # a wing of its own
    assert loaded(folder, tree).plan(("1", (1.2, 1.2)), ("2", (16.0, 1.0))).solved


def test_a_link_that_is_too_narrow_needs_no_free_ends(folder: Path) -> None:
    narrow = with_end(floor="2", at=[0.2, 0.2])
    narrow["links"][0]["max_radius_m"] = 0.1
    file = written(folder, narrow)
    building = hn.ext.fleet.load_building(file, robot_radius_m=0.2)
    assert not building.plan(("1", (1.2, 1.2)), ("2", (1.2, 1.2))).solved
    # Nor does one whose door has no free cell for the robot.
    by_door = with_end(floor="2", door=1, room="hall")
    by_door["links"][0]["max_radius_m"] = 0.7
    with pytest.raises(
        hn.errors.MapError, match=r"door 1 has no free cell for a robot radius of 0\.6 m"
    ):
        hn.ext.fleet.load_building(written(folder, by_door), robot_radius_m=0.6)
    by_door["links"][0]["max_radius_m"] = 0.3
    building = hn.ext.fleet.load_building(written(folder, by_door), robot_radius_m=0.6)
    door = building.floor("2").planner.topology.rooms.door(1)
    assert building.link("lift").ends[1].position_m == door.position
    assert not building.plan(("1", (1.2, 1.2)), ("2", (1.2, 1.2))).solved


@PLAIN
@given(st.binary(max_size=200))
def test_bytes_are_refused_in_one_line(content: bytes) -> None:
    file = Path("bytes.yaml")
    file.write_bytes(b"floors:\n" + content)
    try:
        with pytest.raises(hn.errors.MapError) as refused:
            hn.ext.fleet.load_building(file)
        assert "\n" not in str(refused.value)
    finally:
        file.unlink()


def test_a_large_file_is_refused_soon(folder: Path) -> None:
    ends = [{"floor": "1", "at": [1.2, 1.2]}, {"floor": "2", "at": [1.2, 1.2]}]
    links = [{"name": f"lift {number}", "kind": "lift", "ends": ends} for number in range(1500)]
    began = time.perf_counter()
    with pytest.raises(hn.errors.MapError):
        loaded(folder, yaml.dump(description(links=links), Dumper=_NoAliases))
    assert time.perf_counter() - began < 20


class _NoAliases(yaml.SafeDumper):
    def ignore_aliases(self, data: Any) -> bool:
        del data
        return True


def test_buildings_are_told_from_maps(folder: Path, tmp_path: Path) -> None:
    building = loaded(folder, description())
    hn.save(building, folder / "b.hnm")
    hn.save(building.floors[0].planner, folder / "m.hnm")
    assert is_building(folder / "building.yaml")
    assert is_building(folder / "b.hnm")
    for other in (folder / "two.yaml", folder / "rooms.yaml", folder / "m.hnm", tmp_path,
                  folder / "two.pgm", folder / "none.yaml",
                  folder / f"{'long' * 99}.yaml"):  # fmt: skip
        assert not is_building(other)
    with pytest.raises(
        hn.errors.ModelError, match="it is that of a building, expected one of a map"
    ):
        hn.load(folder / "b.hnm")
    with pytest.raises(
        hn.errors.ModelError, match="it is that of a map, expected one of a building"
    ):
        hn.ext.fleet.load_building(folder / "m.hnm")


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("preset", ["shortest", "octile"])
def test_a_model_answers_as_the_building(tmp_path: Path, preset: str, compress: bool) -> None:
    scene = random_building(5, preset=preset)
    scene.building.prepare()
    hn.save(scene.building, tmp_path / "b.hnm", compress=compress)
    twin = hn.ext.fleet.load_building(tmp_path / "b.hnm")
    assert twin.links == scene.building.links
    for one, other in zip(scene.building.known, twin.known, strict=True):
        np.testing.assert_array_equal(one.lower, other.lower)
        np.testing.assert_array_equal(one.cost, other.cost)
    for _ in range(20):
        start, goal = scene.named(scene.somewhere()), scene.named(scene.somewhere())
        expected, found = scene.building.plan(start, goal), twin.plan(start, goal)
        assert found.status == expected.status
        assert found.cost == expected.cost
        assert found.lower_bound == expected.lower_bound
        assert [ride.link for ride in found.rides] == [ride.link for ride in expected.rides]


def test_a_model_for_another_robot_or_preset_knows_nothing_of_the_first(folder: Path) -> None:
    building = loaded(folder, description())
    building.prepare()
    hn.save(building, folder / "b.hnm")
    wide = hn.ext.fleet.load_building(folder / "b.hnm", robot_radius_m=0.3)
    assert wide.robot_radius_m == 0.3
    assert all(np.isnan(known.cost).all() for known in wide.known)
    octile = hn.ext.fleet.load_building(folder / "b.hnm", preset="octile")
    assert all(np.isnan(known.cost).all() for known in octile.known)
    start, goal = ("1", (1.2, 2.2)), ("2", (1.2, 1.2))
    expected = hn.ext.fleet.load_building(
        folder / "building.yaml", robot_radius_m=0, preset="octile"
    )
    assert octile.plan(start, goal).cost == expected.plan(start, goal).cost
    assert octile.plan(start, goal).metric == "octile"


def test_an_altered_model_is_refused(folder: Path) -> None:
    building = loaded(folder, description())
    file = folder / "b.hnm"
    hn.save(building, file)
    content = file.read_bytes()
    rng = np.random.default_rng(0)
    for at in [*rng.integers(0, len(content), 60).tolist(), 0, 9, 20]:
        altered = bytearray(content)
        altered[at] ^= 0x40
        file.write_bytes(bytes(altered))
        try:
            hn.ext.fleet.load_building(file).plan(("1", (1.2, 2.2)), ("2", (1.2, 1.2)))
        except hn.errors.MapError as refused:
            assert "\n" not in str(refused)  # noqa: PT017 - some bytes are padding
    for length in (0, 5, 30, len(content) // 2, len(content) - 1):
        file.write_bytes(content[:length])
        with pytest.raises(hn.errors.MapError):
            hn.ext.fleet.load_building(file)


def test_the_demonstration_loads_and_has_both_links(tmp_path: Path) -> None:
    shutil.copytree(MAPS, tmp_path / "maps")
    building = hn.ext.fleet.load_building(tmp_path / "maps" / "building" / "building.yaml")
    assert [link.kind for link in building.links] == ["lift", "stairs"]
    found = building.alternatives("hall", "library", 3, max_stretch=9.0)
    assert [plan.rides[0].link.name for plan in found] == ["east stairs", "north lift"]


def test_gdc_is_a_real_building(data: Path, tmp_path: Path) -> None:
    lines = ["floors:"]
    for name in ("2", "3"):
        at = data / "bwi_gdc" / name
        lines.append(f'- {{name: "{name}", map: "{at / name}.yaml", rooms: "{at}/locations.yaml"}}')
    lines.append("links:")
    for lift in ("south", "east", "west"):
        ends = ", ".join(f'{{floor: "{n}", room: l{n}_elev_{lift}}}' for n in ("2", "3"))
        lines.append(f"- {{name: {lift} lift, kind: lift, wait_s: 20, ends: [{ends}]}}")
    building = hn.ext.fleet.load_building(written(tmp_path, "\n".join(lines)), robot_radius_m=0.25)
    plan = building.plan("l3_516", "l2_302")
    assert plan.gap == 0.0
    start, goal = (np.asarray(end) for end in (plan.results[0].start, plan.results[1].goal))
    upper, lower = (building.floor(name).planner for name in ("3", "2"))
    ways = [
        upper.plan(start, three.position_m).cost + 10.0 + lower.plan(two.position_m, goal).cost
        for two, three in (link.ends for link in building.links)
    ]
    assert plan.cost <= min(ways) + 1e-9
    found = building.alternatives("l2_302", "l3_516", 3)
    assert len({one.rides[0].link.name for one in found}) == len(found) == 3
    assert any("take the" in line and "lift to floor 2" in line for line in plan.words())
