"""Tools for programs over the floors of a building, judged by graphs of rooms and plain plans."""

import asyncio
import itertools
import json
import re
import shutil
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest

import hybridnav as hn
from hybridnav.cli.map_options import MapOptions
from hybridnav.ext.agent import TOOLS, BuildingAnswers
from hybridnav.ext.agent.floors import TOOLS as OVER_FLOORS
from hybridnav.ext.fleet import Building, Floor, Link, LinkEnd
from hybridnav.ext.page import Site
from hybridnav.ext.page.command import BuildingPage
from tests.drawn_rooms import HOUSE, topology_of
from tests.ext.agent.test_agent import asked, check_listed, connected
from tests.ext.fleet.scenes import random_building
from tests.strategies import examples

pytest.importorskip("mcp")

SHIPPED = Path(__file__).parents[3] / "maps"
STOPS = {"lift": ("1", "2", "3"), "stairs": ("1", "2"), "ramp": ("2", "3")}
AT = {"lift": (1.0, 3.0), "stairs": (20.0, 3.0), "ramp": (16.0, 3.0)}


def house() -> Building:
    """Three floors of one drawing, joined in their corridors."""
    floors = [Floor(name, hn.HybridPlanner(topology_of(HOUSE))) for name in "123"]
    return Building(
        floors,
        [
            Link(name=name, kind=name, ends=tuple(LinkEnd(floor, AT[name]) for floor in stops))  # type: ignore[arg-type]
            for name, stops in STOPS.items()
        ],
    )


def asker(building: Building, *, allow_edits: bool = True) -> Any:
    answers = BuildingAnswers(Site.of_building(building, "house"), allow_edits=allow_edits)

    def ask(name: str, /, **arguments: Any) -> dict[str, Any]:
        found = answers.call(name, arguments)
        next(one for one in OVER_FLOORS if one.name == name).gives.model_validate(found)
        if not {"points", "count", "via"} & arguments.keys():
            assert len(json.dumps(found, ensure_ascii=False).encode()) <= 2048, found
        return found

    return ask


class Judge:
    """The rooms of the house as a graph, from which things are taken."""

    def __init__(self, building: Building) -> None:
        self.rooms = {floor.name: floor.planner.topology.rooms for floor in building.floors}
        self.things = [
            ("doors", f"floor {floor}, door {door.number}")
            for floor, rooms in self.rooms.items()
            for door in rooms.listed_doors
        ]
        self.things += [
            ("rooms", f"floor {floor}, {name}")
            for floor, rooms in self.rooms.items()
            for name in rooms.names
        ]
        self.things += [("links", name) for name in STOPS]
        self.things += [("links", f"{name}@{on}") for name, stops in STOPS.items() for on in stops]

    def joined(self, start: tuple[str, str], goal: tuple[str, str], shut: set[str]) -> bool:
        """Whether one can go from room to room past what is shut."""
        graph: nx.Graph[Any] = nx.Graph()
        for floor, rooms in self.rooms.items():
            graph.add_nodes_from((floor, name) for name in rooms.names)
            for door in rooms.listed_doors:
                if f"floor {floor}, door {door.number}" not in shut:
                    one, other = door.rooms
                    graph.add_edge((floor, one), (floor, other))
        for link, stops in STOPS.items():
            for floor in stops:
                if not {link, f"{link}@{floor}"} & shut:
                    graph.add_edge(link, (floor, "corridor"))
        graph.remove_nodes_from(
            [node for node in [*graph] if f"floor {node[0]}, {node[1]}" in shut]
        )
        return start in graph and goal in graph and nx.has_path(graph, start, goal)


@pytest.mark.parametrize("seed", range(examples(3)))
def test_what_is_closed_over_floors_stays_closed_until_it_is_opened(seed):
    """Sequences of close, open and undo; what `explain` wants opened, `open` opens."""
    building = house()
    ask, judge, rng = asker(building), Judge(building), np.random.default_rng(seed)
    nodes = [(floor, name) for floor, rooms in judge.rooms.items() for name in rooms.names]
    shut: list[str] = []
    before: list[list[str]] = []
    kinds = {text: kind for kind, text in judge.things}
    for _ in range(40):
        step = rng.choice(["close", "close", "open", "undo", "explain"])
        start, goal = (nodes[k] for k in rng.choice(len(nodes), 2, replace=False))
        ends = {"start": f"floor {start[0]}, {start[1]}", "goal": f"{goal[0]}:{goal[1]}"}
        if step == "close":
            chosen = [judge.things[k][1] for k in rng.choice(len(judge.things), 4, replace=False)]
            before.append(shut)
            shut = list(dict.fromkeys([*shut, *chosen]))
            by = {
                kind: [one for one in chosen if kinds[one] == kind] for kind in set(kinds.values())
            }
            found = ask("close", **by)
        elif step == "open" and shut:
            chosen = [shut[k] for k in rng.choice(len(shut), min(2, len(shut)), replace=False)]
            before.append(shut)
            shut = [one for one in shut if one not in chosen]
            found = ask("open", doors=json.dumps(chosen))
        elif step == "undo" and before:
            shut = before.pop()
            found = ask("undo")
        else:
            found = ask("explain", **ends)
            assert found["has_path"] == judge.joined(start, goal, set(shut)), (ends, shut, found)
            if not found["has_path"]:
                assert judge.joined(start, goal, set())
                assert found["reason"]
                opened = set(shut)
                for text in found["to_open"]:
                    now = ask("open", rooms=text)["closed"]
                    opened = {one for kind in now.values() for one in kind}
                assert judge.joined(start, goal, opened), (ends, shut, found)
                assert ask("can_reach", **ends)["can_reach"]
                for _ in found["to_open"]:  # not one of them can stay closed
                    ask("undo")
            continue
        closed = found["closed"]
        assert sorted(itertools.chain(*closed.values())) == sorted(shut)
        assert all(kinds[one] == kind for kind, things in closed.items() for one in things)
        assert ask("can_reach", **ends)["can_reach"] == judge.joined(start, goal, set(shut))


@pytest.mark.parametrize(
    "text",
    [
        "floor 2, door 6",
        "2:door 6",
        "2:door:6",
        "Floor 2: Door 6",
        "door 6 on floor 2",
        "Etage 2, Tür 6",
    ],
)
def test_a_door_is_named_with_its_floor_in_many_ways(text):
    ask = asker(house())
    shut = {"doors": ["floor 2, door 6"], "rooms": [], "links": []}
    for kind in ("doors", "rooms", "links"):
        assert ask("close", **{kind: text})["closed"] == shut
        assert ask("open", **{kind: [text]})["closed"] == {key: [] for key in shut}
    assert ask("close", doors='["2:6"]')["closed"] == shut


@pytest.mark.parametrize(
    ("given", "shown"),
    [
        ("lift", "lift"),
        ("link lift", "lift"),
        ("link:LIFT", "lift"),
        ("lift@2", "lift@2"),
        ("link lift on floor 2", "lift@2"),
        ("floor 2, lift", "lift@2"),
        ("2:room:lab", "floor 2, lab"),
        ("floor 2, room lab", "floor 2, lab"),
        ("the Lab on floor 2", "floor 2, lab"),
    ],
)
def test_links_and_rooms_are_named_as_reasons_name_them(given, shown):
    closed = asker(house())("close", rooms=given)["closed"]
    assert list(itertools.chain(*closed.values())) == [shown]


def test_a_name_on_several_floors_is_asked_back():
    ask = asker(house())
    found = ask("route", start="1:lab", goal="lab")
    assert not found["ok"]
    assert "floors 1 and 2 and 3" in found["text"]
    assert [(one["name"], one["floor"]) for one in found["choices"]] == [("lab", n) for n in "123"]
    found = ask("route", start="1:lab", goal="2:labb")
    assert "did you mean lab" in found["text"]
    assert {one["name"] for one in found["choices"]} >= {"lab"}
    assert "did you mean lift" in ask("close", links="lfit")["text"]
    assert "needs its floor, as 'floor 1, door 6'" in ask("close", doors=6)["text"]
    assert ask("nearest", of="lab", start="2:kitchen")["nearest"][0]["floor"] == "2"


def test_a_route_over_floors_is_the_plan_leg_by_leg():
    building = house()
    ask = asker(building)
    stops: list[Any] = [("1", "kitchen"), ("3", (19.75, 6.25)), ("2", "den")]
    found = ask("route", start="1:kitchen", via=[["3", 19.75, 6.25]], goal="2:den", points=True)
    first = building.plan(*stops[:2])
    second = building.plan(*stops[1:])
    assert found["length_m"] == pytest.approx(first.length_m + second.length_m, abs=2e-3)
    assert found["cost_m"] == pytest.approx(first.cost + second.cost, abs=2e-3)
    assert found["lower_bound_m"] <= found["cost_m"]
    assert found["words"] == [*first.words(), *second.words()]
    assert [part["floor"] for part in found["parts"]] == [*first.floors, *second.floors]
    rides = [part["ride"]["link"] for part in found["parts"] if "ride" in part]
    assert rides == [ride.link.name for ride in (*first.rides, *second.rides)]
    assert found["points"][-1][0] == "2"
    assert sum(part["length_m"] for part in found["parts"]) == pytest.approx(
        found["length_m"], abs=5e-3
    )
    one = ask("route", start="1:kitchen", via="2:lab", goal="2:den")
    assert "lower_bound_m" not in one  # a room on the way leaves a choice
    assert one["words"] == ask("route", start="1:kitchen", via='["2:lab"]', goal="2:den")["words"]
    rest = ask("route", start="1:kitchen", via="2:lab", goal="2:den", words_from=2)
    assert rest["words"] == one["words"][2:]
    refused = ask("route", start="1:kitchen", via="2:lab", goal="2:den", avoiding="floor 2, den")
    assert refused["text"].startswith("Leg 2: Floor 2, room den is closed")
    assert refused["to_open"] == ["floor 2, room den"]


def test_a_width_goes_by_doors_that_are_wide_enough():
    ask = asker(house())
    ends = {"start": "1:kitchen", "goal": "2:lab"}
    assert ask("can_reach", **ends, width=0.9)["can_reach"]
    wide = ask("can_reach", **ends, width=1.5)
    assert not wide["can_reach"]
    assert "1.5 m wide" in wide["text"]
    assert ask("route", **ends, width=1.5)["status"] == "no path"
    lines = ask("explain", **ends, width=0.9)["reason"]
    assert any("radius of 0.45 m" in line for line in lines)
    assert {line.split(":")[0] for line in lines} == {"Floor 1", "Floor 2"}


def test_nothing_is_nearer_than_what_is_nearest():
    building = house()
    ask, rooms = asker(building), Judge(building).rooms
    listed = ask("list_rooms", kind="room", count=50)["rooms"]
    of_kind = {(one["floor"], one["name"]) for one in listed}
    assert len(of_kind) < sum(len(one.names) for one in rooms.values())
    ask("close", links="lift", doors=["floor 2, door 6"])
    closed: dict[str, Any] = {"closed_links": ["lift"], "blocked": {"2": {"doors": [6]}}}
    shut_in = ask("nearest", of="rooms", start="2:lab")
    assert "none of 14 of 'rooms' can be reached" in shut_in["text"]
    for floor, start in (("1", "kitchen"), ("2", "den"), ("3", "hall")):
        here = floor, rooms[floor].point_of(start)
        plans = {
            (on, name): building.plan(here, (on, one.point_of(name)), **closed).cost
            for on, name in of_kind - {(floor, start)}
            for one in [rooms[on]]
        }
        costs = sorted(plans.values())
        found = ask("nearest", of="rooms", start=f"{floor}:{start}", count=3)
        kept = [(one["floor"], one["name"]) for one in found["nearest"]]
        assert [one["cost_m"] for one in found["nearest"]] == pytest.approx(
            sorted(plans[one] for one in kept), abs=1e-3
        )
        others = [cost for one, cost in plans.items() if one not in kept]
        assert found["others_at_least_m"] <= min(others)
        assert found["nearest"][0]["cost_m"] == pytest.approx(costs[0], abs=1e-3)


@pytest.mark.parametrize("seed", range(examples(10)))
def test_the_bound_without_a_plan_is_below_its_cost(seed):
    scene = random_building(seed)
    for _ in range(4):
        ends = [scene.named(scene.somewhere()) for _ in range(2)]
        least_m = scene.building.least_m(*ends)
        assert 0 <= least_m <= scene.building.plan(*ends).cost


@pytest.mark.parametrize("allow_edits", [False, True])
@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("route", {}),
        ("route", {"start": [1.0, 2.0], "goal": "2:lab"}),
        ("route", {"start": ["9", 1.0, 2.0], "goal": "2:lab"}),
        ("route", {"start": ["1", 1e99, 2.0], "goal": "2:lab"}),
        ("route", {"start": ["1", True, 2.0], "goal": "2:lab"}),
        ("route", {"start": True, "goal": "2:lab"}),
        ("route", {"start": "1:nan,2", "goal": "2:lab"}),
        ("route", {"start": "1:1e300,2", "goal": "2:lab"}),
        ("route", {"start": "1:", "goal": "2:lab"}),
        ("route", {"start": "1,2", "goal": "2:lab"}),
        ("route", {"start": "[" * 190, "goal": "2:lab"}),
        ("route", {"start": "9:lab", "goal": "2:lab"}),
        ("route", {"start": "floor 9, lab", "goal": "2:lab"}),
        ("route", {"start": "\x00\n", "goal": "2:lab"}),
        ("route", {"start": "1:lab", "goal": "2:lab", "avoiding": ["1:lab"]}),
        ("route", {"start": "1:lab", "goal": "2:lab", "avoiding": ["door 6"]}),
        ("route", {"start": "1:lab", "goal": "2:lab", "avoiding": [6]}),
        ("route", {"start": "1:lab", "goal": "2:lab", "avoiding": [True]}),
        ("route", {"start": "1:lab", "goal": "2:lab", "avoiding": ["2:door 999999999"]}),
        ("route", {"start": "1:lab", "goal": "2:lab", "avoiding": ["ramp@1"]}),
        ("route", {"start": "1:lab", "goal": "2:lab", "via": ["nowhere"]}),
        ("route", {"start": "1:lab", "goal": "2:lab", "via": ["2:lab"] * 99}),
        ("route", {"start": "1:lab", "goal": "2:lab", "within": 2}),
        ("route", {"start": "1:lab", "goal": "2:lab", "width": 90}),
        ("route", {"start": "1:lab", "goal": "2:lab", "width": True}),
        ("route", {"start": "1:lab", "goal": "2:lab", "language": "xx"}),
        ("explain", {"start": "1:lab", "goal": "2:lab", "language": "xx"}),
        ("explain", {"start": ["1", 0.1, 0.1], "goal": "2:lab", "width": 50}),
        ("where_am_i", {"point": ["1", -50, 1]}),
        ("list_rooms", {"floor": "9"}),
        ("nearest", {"of": "\x00", "start": "1:lab"}),
        ("nearest", {"of": "floor 9, rooms", "start": "1:lab"}),
        ("close", {}),
        ("close", {"links": ["@", "lift@"]}),
        ("close", {"links": ["lift@9"]}),
        ("close", {"doors": ["2:0"]}),
        ("open", {"links": "lift"}),
        ("undo", {}),
        ("name_room", {"room": "lab", "name": "x"}),
        ("name_room", {"room": "2:lab", "name": "x"}),
        ("picture", {"start": "1:lab"}),
        ("_how", {}),
        ("", {}),
    ],
)
def test_hostile_calls_end_in_one_line(name, arguments, allow_edits):
    answers = BuildingAnswers(Site.of_building(HOUSE_OF_ALL, "house"), allow_edits=allow_edits)
    found = answers.call(name, arguments)
    assert "\n" not in found["text"]
    assert len(json.dumps(found)) < 2000
    assert not found["ok"] or found["status"] != "solved"


HOUSE_OF_ALL = house()


def test_rooms_are_named_over_floors_and_taken_back(tmp_path):
    shutil.copytree(SHIPPED, tmp_path / "maps")
    file = tmp_path / "maps" / "building" / "building.yaml"
    site = BuildingPage(MapOptions(map_file=file, robot_radius_m=0.25)).make(lambda _: None)
    answers = BuildingAnswers(site, allow_edits=True)
    assert answers.call("close", {"rooms": "archive"})["ok"]
    named = answers.call("name_room", {"room": "floor 2, archive", "name": "attic"})
    assert named["room"]["name"], named["room"]["floor"] == ("attic", "2")
    assert "name: attic" in (file.parent / "rooms-2.yaml").read_text(encoding="utf-8")
    assert answers.call("describe_map", {})["closed"]["rooms"] == ["floor 2, attic"]
    lost = answers.call("name_room", {"room": "1:stairwell", "name": "staircase"})
    assert "link east stairs names room stairwell" in lost["text"]
    assert answers.call("route", {"start": "staircase", "goal": "2.04"})["ok"]
    for _ in range(2):
        assert answers.call("undo", {})["ok"]
    assert answers.call("describe_map", {})["closed"]["rooms"] == ["floor 2, archive"]
    assert "attic" not in (file.parent / "rooms-2.yaml").read_text(encoding="utf-8")


def test_what_is_out_of_order_is_closed_for_programs_too(tmp_path):
    shutil.copytree(SHIPPED, tmp_path / "maps")
    file = tmp_path / "maps" / "building" / "building.yaml"
    journal = hn.Journal(file)
    journal.close("link:north lift")
    site = BuildingPage(MapOptions(map_file=file, robot_radius_m=0.25)).make(lambda _: None)
    answers = BuildingAnswers(site)
    found = answers.call("route", {"start": "office 5", "goal": "2.04"})
    assert [part["ride"]["link"] for part in found["parts"][:1]] == ["east stairs"]
    journal.close("link:east stairs")
    found = answers.call("can_reach", {"start": "office 5", "goal": "2.04"})
    assert not found["can_reach"]
    assert len(found["to_open"]) == 1


@pytest.mark.full
def test_a_client_asks_a_building(tmp_path):
    shutil.copytree(SHIPPED, tmp_path / "maps")
    file = tmp_path / "maps" / "building" / "building.yaml"

    async def main() -> None:
        async with connected(file, "--allow-edits") as one, connected(file) as other:
            await check_listed(one, other, TOOLS)
            rooms = await asked(other, "list_rooms", name="lobby")
            assert [room["floor"] for room in rooms["rooms"]] == ["1", "2"]
            found = await asked(one, "route", start="office 5", goal="2.04")
            plan = hn.ext.fleet.load_building(file, robot_radius_m=0.2).plan("office 5", "2.04")
            assert found["length_m"] == round(plan.length_m, 3)
            assert found["words"] == plan.words()
            assert [part["floor"] for part in found["parts"]] == ["1", "2"]
            near = await asked(one, "where_am_i", point='["2", 36.0, 5.0]')
            assert (near["floor"], near["room"]) == ("2", "library")
            closed = await asked(one, "close", links='["north lift@2", "east stairs"]')
            assert closed["closed"]["links"] == ["north lift@2", "east stairs"]
            why = await asked(one, "explain", start="office 5", goal="2.04")
            assert not why["has_path"]
            assert (await asked(one, "open", links=why["to_open"]))["ok"]
            assert (await asked(one, "can_reach", start="office 5", goal="2.04"))["can_reach"]
            assert (await asked(other, "describe_map"))["closed"]["links"] == []
            assert "--allow-edits" in (await asked(other, "close", links="north lift"))["text"]
            picture = await one.call_tool("picture", {"start": "office 5", "goal": "2.04"})
            assert [part.type for part in picture.content] == ["text", "image"]

    asyncio.run(main())


def test_the_widest_way_to_a_room_is_not_that_to_the_jambs_of_its_door(cli):
    """All doors on these ways are 0.95 m wide; robots of 0.4 m go where a robot of 0.25 m goes."""
    building = hn.ext.fleet.load_building(
        SHIPPED / "building" / "building.yaml", robot_radius_m=0.4
    )
    assert building.plan("office 5", "2.04").solved
    ends = "--from", "office 5", "--to", "2.04", "--robot-radius", "0.25", "--why"
    over_floors = cli("plan", SHIPPED / "building" / "building.yaml", *ends).out
    office = SHIPPED / "office" / "office.yaml"
    stops = "--start", "1,13.2", "--to", "room-7", "--via", "room-6"
    on_one = cli("plan", office, *stops, "--robot-radius", "0.25", "--why").out
    for told, count in ((over_floors, 2), (on_one, 1)):
        radii = [float(one) for one in re.findall(r"every radius below (\d\.\d+) m", told)]
        assert len(radii) == count
        assert min(radii) > 0.45
