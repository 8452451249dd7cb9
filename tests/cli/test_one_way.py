"""Doors that are passed one way, on the command line: for a query, in a journal, in files."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import hybridnav as hn

ROOMS = """\
rooms:
- name: kitchen
  polygon: [[0, 0], [6, 0], [6, 8], [0, 8]]
- name: hall
  polygon: [[6, 0], [12, 0], [12, 8], [6, 8]]
doors:
  1: [6, 2.5]
  2: [6, 6.5]
"""
THERE = ("--from", "2,2.5", "--to", "10,2.5")
BACK = ("--from", "10,2.5", "--to", "2,2.5")
LONGER_M = 10.0


@pytest.fixture
def map_file(tmp_path: Path) -> Path:
    """A kitchen on the left of a hall, with two doors in the wall between them."""
    free = np.full((8, 12), 254, np.uint8)
    free[:, 6] = 0
    free[[1, 5], 6] = 254
    Image.fromarray(free).save(tmp_path / "house.pgm")
    path = tmp_path / "house.yaml"
    path.write_text(
        "image: house.pgm\nresolution: 1\norigin: [0, 0, 0]\nnegate: 0\n"
        "occupied_thresh: 0.65\nfree_thresh: 0.196\n"
    )
    (tmp_path / "rooms.yaml").write_text(ROOMS)
    return path


def length_m(cli, map_file: Path, *query: str, preset: str = "shortest") -> float:
    done = cli("plan", map_file, *query, "--robot-radius", "0", "--json", "--preset", preset)
    assert done.code == 0, done.err
    return json.loads(done.out)["length_m"]


def test_a_query_goes_round_by_the_other_door(cli, map_file: Path) -> None:
    assert length_m(cli, map_file, *BACK) == 8
    assert length_m(cli, map_file, *BACK, "--one-way", "door:1=hall") > LONGER_M
    assert length_m(cli, map_file, *THERE, "--one-way", "door:1=hall") == 8
    line = "line:6,0:6,4"
    assert length_m(cli, map_file, *BACK, "--one-way", line) > LONGER_M
    assert length_m(cli, map_file, *THERE, "--one-way", line) == 8


@pytest.mark.parametrize("preset", ["grid-astar", "octile", "paper", "robot"])
def test_every_preset_goes_round(cli, map_file: Path, preset: str) -> None:
    rule = ("--one-way", "door:1=hall")
    assert length_m(cli, map_file, *BACK, preset=preset) < LONGER_M
    assert length_m(cli, map_file, *BACK, *rule, preset=preset) > LONGER_M
    assert length_m(cli, map_file, *THERE, *rule, preset=preset) < LONGER_M


def test_the_file_of_rooms_holds_for_every_query(cli, map_file: Path) -> None:
    (map_file.parent / "rooms.yaml").write_text(ROOMS + "one_way:\n- door:1=hall\n")
    assert length_m(cli, map_file, *BACK) > LONGER_M
    assert length_m(cli, map_file, "--start", "10,2.5", "--goal", "2,2.5") > LONGER_M
    assert length_m(cli, map_file, *THERE) == 8


def test_the_journal_holds_until_it_is_taken_back(cli, map_file: Path) -> None:
    rule = "one-way:door:1=hall"
    radius = ("--robot-radius", "0")
    done = cli("closed", map_file, *radius, "--close", rule, "--why", "a fire drill")
    assert (done.code, done.err) == (0, "")
    assert rule in done.out
    assert length_m(cli, map_file, *BACK) > LONGER_M
    assert cli("closed", map_file, *radius, "--close", "one-way:door:1=attic").refuses(2, "attic")
    assert cli("closed", map_file, "--open", rule).code == 0
    assert length_m(cli, map_file, *BACK) == 8


def test_the_edges_of_a_graph_lead_one_way(cli, map_file: Path, tmp_path: Path) -> None:
    graph = tmp_path / "graph.json"
    nodes = [{"id": 1, "x": 4.5, "y": 6.5}, {"id": 2, "x": 8.5, "y": 6.5}]
    graph.write_text(
        json.dumps({"directed": True, "nodes": nodes, "links": [{"source": 1, "target": 2}]})
    )
    shut = ("--blocked", "door:1", "--one-way", f"graph:{graph}")
    assert length_m(cli, map_file, *THERE, *shut) > LONGER_M
    assert cli("plan", map_file, *BACK, *shut, "--robot-radius", "0").code == 1


def test_a_graph_has_the_directions_of_the_rooms_beside_the_map(cli, map_file, tmp_path):
    free = map_file.parent / "free.geojson"
    radius = ("--robot-radius", "0")
    assert cli("export", map_file, *radius, "-o", free).code == 0
    (map_file.parent / "rooms.yaml").write_text(ROOMS + "one_way:\n- door:1=hall\n")
    drawn = tmp_path / "graph.geojson"
    assert cli("export", map_file, *radius, "-o", drawn).code == 0
    assert "edge-against" not in cli("check", map_file, drawn, *radius).out
    against = cli("check", map_file, free, *radius)
    assert against.code == 1
    assert "edge-against" in against.out
    # The graph alone states the direction.
    (map_file.parent / "rooms.yaml").write_text(ROOMS)
    assert length_m(cli, map_file, *BACK, "--one-way", f"graph:{drawn}") > LONGER_M
    assert length_m(cli, map_file, *THERE, "--one-way", f"graph:{drawn}") == 8


@pytest.mark.parametrize(
    ("rule", "words"),
    [
        ("door:1", "--one-way: a one-way rule must be door:N=ROOM"),
        ("door:1=attic", "attic"),
        ("door:7=hall", "no door has the number 7"),
        ("line:90,90:99,99", "line"),
        ("graph:none.json", "none.json"),
    ],
)
def test_what_cannot_be_is_refused(cli, map_file: Path, rule: str, words: str) -> None:
    done = cli("plan", map_file, *BACK, "--one-way", rule, "--robot-radius", "0")
    assert done.code in {2, 3}
    assert words in done.err
    assert done.err.count("\n") <= 2


def test_a_picture_has_the_arrow(cli, map_file: Path, tmp_path: Path) -> None:
    query = (*BACK, "--one-way", "door:1=hall", "--robot-radius", "0")
    picture = tmp_path / "plan.svg"
    assert cli("plan", map_file, *query, "--plot", picture).code == 0
    drawn = picture.read_text()
    assert 'id="one-way"' in drawn
    assert 'id="one-way-arrows"' in drawn
    assert cli("plan", map_file, *BACK, "--robot-radius", "0", "--plot", picture).code == 0
    assert "one-way" not in picture.read_text()


def test_a_floor_of_a_building_passes_one_way(cli, map_file: Path) -> None:
    building = map_file.parent / "building.yaml"
    text = "floors:\n- name: '1'\n  map: house.yaml\n  rooms: rooms.yaml\n"
    building.write_text(text)
    query = ("--from", "1:10,2.5", "--to", "1:2,2.5")
    assert length_m(cli, building, *query) == pytest.approx(8, abs=0.1)
    assert length_m(cli, building, *query, "--one-way", "1:door:1=hall") > LONGER_M
    building.write_text(text + "  one_way: ['door:1=hall']\n")
    assert length_m(cli, building, *query) > LONGER_M
    assert length_m(cli, building, "--from", "1:2,2.5", "--to", "1:10,2.5") < LONGER_M
    building.write_text(text + "  one_way: ['door:1=attic']\n")
    done = cli("plan", building, *query, "--robot-radius", "0")
    assert done.refuses(3, "floor 1", "attic")
    building.write_text(text)
    rule = "1:one-way:door:1=hall"
    assert cli("closed", building, "--robot-radius", "0", "--close", rule).code == 0
    assert length_m(cli, building, *query) > LONGER_M


def test_a_building_knows_that_the_way_back_differs(map_file: Path) -> None:
    building_file = map_file.parent / "house-2.yaml"
    floors = "".join(
        f"- name: '{n}'\n  map: house.yaml\n  rooms: rooms.yaml\n  one_way: ['door:1=hall']\n"
        for n in (1, 2)
    )
    links = "".join(
        f"- name: lift {k}\n  kind: lift\n  ends: [{{floor: '1', at: [{x}, 2.5]}}, "
        f"{{floor: '2', at: [{x}, 2.5]}}]\n"
        for k, x in ((1, 2.5), (2, 10.5))
    )
    building_file.write_text(f"floors:\n{floors}links:\n{links}")
    building = hn.ext.fleet.load_building(building_file, robot_radius_m=0)
    building.prepare()
    there, back = building.known[0].cost[0, 1], building.known[0].cost[1, 0]
    assert there == 8
    assert back > LONGER_M
    for start, goal in (((2.5, 1.5), (10.5, 2.5)), ((10.5, 1.5), (2.5, 2.5))):
        one = building.plan(("1", start), ("1", goal))
        assert one.cost == pytest.approx(building.floors[0].planner.distance(start, goal))
    # What the way back costs on a floor between is kept, and bounds no way there.
    shut = {"2": {"doors": [1]}}
    kept = hn.ext.fleet.load_building(building_file, robot_radius_m=0)
    right, left = (10.5, 1.5), (2.5, 1.5)
    round_m = kept.floors[1].planner.plan(right, left, blocked=shut["2"]).cost
    assert kept.plan(("2", right), ("2", left), blocked=shut).cost == round_m > 2 + 8
    there = kept.plan(("2", left), ("2", right), blocked=shut)
    assert [ride.from_floor for ride in there.rides] == ["2", "1"]
    assert there.cost == there.lower_bound == pytest.approx(2 + 8)
