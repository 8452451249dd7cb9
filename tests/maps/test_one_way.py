"""Rules of what is passed in one direction alone: their text, and what keeps them: files, models,
maps that change."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.errors import InvalidValueError, RoomsError
from hybridnav.ext.live import OnlineRooms
from hybridnav.rooms import carry_names

RULES = ("door:1=hall", "line:0.5,1:3.5,1")


def rules(*texts: str) -> tuple[hn.OneWayRule, ...]:
    return tuple(map(hn.OneWayRule.of, texts))


@pytest.fixture
def rooms() -> tuple[hn.RoomLabels, hn.OccupancyGrid]:
    """A kitchen on the left of a hall, with a wall between them and a door in it."""
    occupied = np.zeros((4, 9), np.float32)
    occupied[[0, 1, 3], 4] = 1
    grid = hn.OccupancyGrid(occupied, robot_radius_m=0)
    label_of = np.where(np.arange(9) < 5, 0, 1)[None].repeat(4, axis=0)
    doors = hn.TopologicalMap(
        hn.DualGraphPyramid.build(grid, rooms=hn.RoomLabels(("kitchen", "hall"), label_of))
    ).rooms.doors
    positions = {door.number: door.position for door in doors}
    return hn.RoomLabels(
        ("kitchen", "hall"), label_of, doors=positions, one_way=rules(*RULES)
    ), grid


@pytest.mark.parametrize("text", [*RULES, "door:7=", "door:7=a=b: c", "line:-1.5,2:1e-05,4:7,8"])
def test_rules_are_read_as_they_are_written(text: str) -> None:
    rule = hn.OneWayRule.of(text)
    assert str(rule) == text
    assert hn.OneWayRule.of(rule) == rule


@pytest.mark.parametrize(
    "text",
    [
        *(None, 5, "", "door:5", "door:0=hall", "door:-1=hall", "room:hall", "line:1,2"),
        *("line:1,2:1,2", "line:1,2:3", "line:1,2:nan,2", "line:1,2:inf,2", "line:1,2:a,b"),
        "line:1,2:1,2,3",
    ],
)
def test_what_is_no_rule_is_refused_in_one_line(text: Any) -> None:
    with pytest.raises(InvalidValueError, match=r"must be door:N=ROOM, .*, got .*") as refused:
        hn.OneWayRule.of(text)
    assert "\n" not in str(refused.value)


def test_files_and_models_keep_rules(rooms, tmp_path: Path) -> None:
    labels, grid = rooms
    hn.save_rooms(tmp_path / "rooms.yaml", labels, grid)
    read = hn.load_rooms(tmp_path / "rooms.yaml", grid)
    assert tuple(map(str, read.one_way)) == RULES
    hn.save_rooms(tmp_path / "rooms.yaml", replace(read, one_way=rules(RULES[1])), grid)
    assert tuple(map(str, hn.load_rooms(tmp_path / "rooms.yaml", grid).one_way)) == RULES[1:]
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    hn.save(topology, tmp_path / "m.hnm")
    kept = hn.load(tmp_path / "m.hnm").rooms
    assert kept.one_way == labels.one_way


@pytest.mark.parametrize("given", ["door:1=halls", "door=1", "{door: 1}", "[1]"])
def test_a_wrong_rule_in_a_file_is_refused_with_its_place(rooms, given, tmp_path):
    labels, grid = rooms
    file = tmp_path / "rooms.yaml"
    hn.save_rooms(file, labels, grid)
    file.write_text(file.read_text().replace("door:1=hall", given))
    with pytest.raises(RoomsError, match=r"one_way|one-way") as refused:
        hn.load_rooms(file, grid)
    assert "\n" not in str(refused.value)


def test_rules_follow_a_map_that_changes(rooms) -> None:
    labels, grid = rooms
    before = OnlineRooms.of(grid, labels).with_name(2, "ballroom")
    assert tuple(map(str, before.labels.one_way)) == ("door:1=ballroom", RULES[1])
    shut = grid.probability.copy()
    shut[2, 4] = 1
    update = before.update(hn.OccupancyGrid(shut, robot_radius_m=0))
    assert tuple(map(str, update.lost_one_way)) == ("door:1=ballroom",)
    assert tuple(map(str, update.version.labels.one_way)) == RULES[1:]
    shut[:, :5] = 1
    update = update.version.update(hn.OccupancyGrid(shut, robot_radius_m=0))
    assert tuple(map(str, update.lost_one_way)) == RULES[1:]


def test_rules_are_carried_to_a_later_map() -> None:
    grid = hn.example_map("office")
    found = hn.find_rooms(grid)
    topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=found))
    door = next(one for one in topology.rooms.listed_doors if None not in one.rooms)
    named = hn.RoomLabels(
        tuple(f"r {n}" for n in found.names), found.label_of, doors=topology.rooms.labels.doors
    )
    x, y = door.position
    kept = [f"door:{door.number}=r {door.rooms[0]}", f"line:{x},{y - 1}:{x},{y + 1}"]
    lost = ["line:-50,0:-50,9", f"door:{door.number}=r {other_room(door, found)}"]
    carried = carry_names(replace(named, one_way=rules(*kept, *lost)), grid, found, grid)
    assert list(map(str, carried.lost_one_way)) == lost
    assert str(carried.labels.one_way[0]) == kept[0]
    line = np.array(carried.labels.one_way[1].line)
    np.testing.assert_allclose(line, [(x, y - 1), (x, y + 1)], atol=grid.resolution_m)


def other_room(door: hn.Door, rooms: hn.RoomLabels) -> str:
    return next(name for name in rooms.names if name not in door.rooms)
