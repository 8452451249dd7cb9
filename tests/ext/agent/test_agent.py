"""Tools for programs, through the real protocol and HTTP, judged by what was painted."""

import asyncio
import json
import os
import subprocess
import sys
import threading
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.agent import TOOLS, MapAnswers, questions
from hybridnav.ext.page import Opening, Session, Site
from hybridnav.ext.page.kept import RoomsFile
from tests.ext.agent.questions import RESOLUTION_M, Judge, PaintedFloor
from tests.ext.page.server import served

mcp = pytest.importorskip("mcp")


def session_of(floor: PaintedFloor, folder: Path) -> Session:
    path = write_floor(floor, folder)
    model = hn.load(path, robot_radius_m=0.2)
    rooms = hn.load_rooms(folder / "rooms.yaml", model.grid)
    settings = model.fitted(hn.load_preset("shortest"))
    topology = model.grown(settings.pyramid, rooms)
    return Session(model, topology, settings, file=RoomsFile(folder, "rooms.yaml"))


def write_floor(floor: PaintedFloor, folder: Path) -> Path:
    frame = hn.Frame(resolution_m=RESOLUTION_M)
    grid = hn.OccupancyGrid((~floor.free).astype(np.float32), frame, robot_radius_m=0.2)
    hn.write_ros_map(grid, folder / "floor.yaml")
    hn.save_rooms(folder / "rooms.yaml", hn.RoomLabels(floor.names, floor.label_of), grid)
    return folder / "floor.yaml"


def asker(answers: MapAnswers) -> Any:
    def ask(name: str, /, **arguments: Any) -> dict[str, Any]:
        return checked(name, arguments, answers.call(name, arguments))

    return ask


def checked(name: str, arguments: dict[str, Any], found: dict[str, Any]) -> dict[str, Any]:
    """The answer, which has the fields that its schema states, and is small."""
    next(tool for tool in TOOLS if tool.name == name).gives.model_validate(found)
    if not {"points", "count"} & arguments.keys():
        assert len(json.dumps(found, ensure_ascii=False).encode()) <= 2048, found
    return found


@pytest.mark.parametrize("seed", range(3))
def test_answers_agree_with_what_was_painted(seed, tmp_path):
    floor = PaintedFloor(seed)
    answers = MapAnswers(session_of(floor, tmp_path), allow_edits=True)
    kinds = Counter(Judge(floor, asker(answers)).questions(64))
    assert len(kinds) == 8
    assert min(kinds.values()) == 8


@asynccontextmanager
async def connected(path: Path, *more: str) -> AsyncIterator[Any]:
    """A client of a server in a process of its own."""
    from mcp import ClientSession, StdioServerParameters
    from mcp.client.stdio import stdio_client

    words = ["-m", "hybridnav", "serve", str(path), "--robot-radius", "0.2", *more]
    server = StdioServerParameters(command=sys.executable, args=words, env=dict(os.environ))
    async with stdio_client(server) as streams, ClientSession(*streams) as client:
        await client.initialize()
        yield client


async def asked(client: Any, name: str, /, **arguments: Any) -> dict[str, Any]:
    result = await client.call_tool(name, arguments)
    found: dict[str, Any] = json.loads(result.content[0].text)
    assert found == result.structured_content
    assert result.is_error == (not found["ok"])
    return found if name == "rout" else checked(name, arguments, found)


@pytest.mark.full
@pytest.mark.parametrize("seed", range(10))
def test_a_hundred_questions_a_map_through_the_protocol(seed, tmp_path):
    floor = PaintedFloor(100 + seed)
    path = write_floor(floor, tmp_path)

    async def main() -> Counter[str]:
        async with connected(path, "--allow-edits") as client:
            loop = asyncio.get_running_loop()

            def ask(name: str, /, **arguments: Any) -> dict[str, Any]:
                call = asked(client, name, **arguments)
                return asyncio.run_coroutine_threadsafe(call, loop).result(120)

            def judge() -> Counter[str]:
                return Counter(Judge(floor, ask).questions(104))

            return await asyncio.to_thread(judge)

    assert min(asyncio.run(main()).values()) == 13


async def check_listed(editor: Any, reader: Any, tools: Any) -> None:
    """Check that one client sees all functions, described, and another those that only read."""
    listed = (await editor.list_tools()).tools
    assert [tool.name for tool in listed] == [tool.name for tool in tools]
    reading = [tool.name for tool in tools if not tool.edits]
    assert [tool.name for tool in (await reader.list_tools()).tools] == reading
    for tool in listed:
        assert tool.description
        assert tool.input_schema["type"] == "object"


@pytest.mark.full
def test_two_clients_errors_and_a_call_that_is_cancelled(tmp_path):
    floor = PaintedFloor(0)
    path = write_floor(floor, tmp_path)

    async def main() -> None:
        async with connected(path, "--allow-edits") as one, connected(path) as other:
            await check_listed(one, other, TOOLS)
            assert (await asked(one, "close", rooms=[floor.names[0]]))["ok"]
            refused = await asked(other, "close", rooms=[floor.names[0]])
            assert "--allow-edits" in refused["text"]
            assert (await asked(other, "describe_map"))["closed"] == {"doors": [], "rooms": []}
            with pytest.raises(asyncio.TimeoutError):  # another class before Python 3.11
                await asyncio.wait_for(asked(one, "picture"), 0.001)
            assert (await asked(one, "describe_map"))["closed"]["rooms"] == [floor.names[0]]
            picture = await one.call_tool("picture", {})
            assert [part.type for part in picture.content] == ["text", "image"]
            assert "did you mean route" in (await asked(one, "rout"))["text"]

    asyncio.run(main())


def test_the_page_gives_the_same_answers_as_json(tmp_path):
    floor = PaintedFloor(1)
    session = session_of(floor, tmp_path)
    with served(Site.of_map(session), tmp_path) as client:
        described = client.get("openapi.json").value
        assert sorted(described["paths"]) == sorted(
            f"/floor/{{floor}}/api/{tool.name}" for tool in TOOLS if not tool.edits
        )
        point, _, room = floor.inner_point()
        found = client.post("floor/0/api/where_am_i", {"point": point})
        assert found.code == 200
        assert found.value == MapAnswers(session).call("where_am_i", {"point": point})
        assert found.value["room"] == floor.names[room]
        assert client.post("floor/0/api/close", {"rooms": [floor.names[0]]}).code == 422
        assert client.post("floor/0/api/route", [1]).code == 422
        assert client.post("floor/7/api/describe_map", {}).code == 422
        png = client.post("floor/0/api/picture", {}).value["png"]
        assert png.startswith("iVBOR")


@pytest.mark.parametrize("allow_edits", [False, True])
@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("route", {}),
        ("route", {"start": [0, 0], "goal": [1e99, 0]}),
        ("route", {"start": [float("nan"), 0], "goal": [1, 0]}),
        ("route", {"start": "[NaN, 0]", "goal": [1, 0]}),
        ("route", {"start": "[" * 190, "goal": [1, 0]}),
        ("route", {"start": [True, False], "goal": [1, 0]}),
        ("route", {"start": [1, 1], "goal": [1, 1], "width": True}),
        ("route", {"start": [1, 1], "goal": [1, 1], "words_from": True}),
        ("route", {"start": [1, 1], "goal": [1, 1], "avoiding": [True]}),
        ("close", {"doors": [True]}),
        ("close", {"doors": [1.0]}),
        ("route", {"start": "../../etc/passwd", "goal": [1, 1]}),
        ("route", {"start": [1, 1], "goal": [1, 1], "avoiding": ["door 99999"]}),
        ("route", {"start": [1, 1], "goal": [1, 1], "language": "xx"}),
        ("route", {"start": [1, 1], "goal": [1, 1], "width": -1}),
        ("route", {"start": [1, 1], "goal": [1, 1], "width": 90}),
        ("where_am_i", {"point": [1, 1, 1]}),
        ("where_am_i", {"point": [-50, 1]}),
        ("list_rooms", {"count": 10**9}),
        ("list_rooms", {"unknown": 1}),
        ("nearest", {"of": "\x00", "start": [1, 1]}),
        ("close", {"doors": ["0"], "rooms": "all"}),
        ("close", {}),
        ("open", {"doors": [1]}),
        ("undo", {}),
        ("name_room", {"room": "nowhere", "name": "x"}),
        ("__init__", {}),
        ("call", {}),
        ("", {}),
        ("picture", {"start": [1, 1]}),
    ],
)
def test_hostile_calls_end_in_one_line(name, arguments, allow_edits, tmp_path):
    answers = MapAnswers(session_of(PaintedFloor(2), tmp_path), allow_edits=allow_edits)
    found = answers.call(name, arguments)
    assert "\n" not in found["text"]
    assert len(json.dumps(found)) < 2000
    assert not found["ok"] or found["status"] != "solved"


def test_lists_come_as_text_and_one_thing_without_a_list(tmp_path):
    """Language models send "[1.0, 13.2]" for a point, and one name for a list of one."""
    floor = PaintedFloor(2)
    answers = MapAnswers(session_of(floor, tmp_path), allow_edits=True)
    ask = asker(answers)
    point, _, room = floor.inner_point()
    assert ask("where_am_i", point=json.dumps(point)) == ask("where_am_i", point=point)
    goal = floor.names[(room + 1) % len(floor.names)]
    plain = ask("route", start=point, goal=goal)
    assert ask("route", start=json.dumps(point), goal=goal) == plain
    door = plain["doors"][0]
    shut = ask("can_reach", start=point, goal=goal, avoiding=[f"door {door}"])
    for avoiding in (f"door {door}", json.dumps([f"door {door}"]), door, [door], f"[{door}]"):
        assert ask("can_reach", start=point, goal=goal, avoiding=avoiding) == shut
    for doors in ([door], [f"door {door}"], f"door {door}", [str(door)], f"[{door}]", door):
        assert ask("close", doors=doors)["closed"] == {"doors": [door], "rooms": []}
        assert ask("open", doors=doors)["closed"] == {"doors": [], "rooms": []}
    both = ask("close", doors=[f"door {door}", goal])["closed"]
    assert both == {"doors": [door], "rooms": [goal]}


def test_a_route_ends_near_a_goal_that_cannot_be_reached(tmp_path):
    floor = PaintedFloor(2)
    answers = MapAnswers(session_of(floor, tmp_path))
    ask = asker(answers)
    start = floor.inner_point()[0]
    goal = [-0.5, 1.5]  # beside the map, whose wall is a cell thick; the robot keeps 0.2 m off it
    assert "short_m" not in ask("route", start=start, goal=goal)
    assert "short_m" not in ask("route", start=start, goal=goal, within=0.6)
    found = ask("route", start=start, goal=goal, within=1.5, points=True)
    assert found["status"] == "near the goal"
    assert found["short_m"] == pytest.approx(np.hypot(*np.subtract(found["goal"], goal)), abs=2e-3)
    assert 0.6 < found["short_m"] <= 1.5
    assert found["lower_bound_m"] <= found["length_m"] + 1e-3
    assert found["points"][-1] == found["goal"]
    assert "outside the map" in found["text"]
    assert ask("route", start=start, goal=start, within=1)["status"] == "solved"


def test_a_room_is_reached_as_wide_as_its_door(tmp_path):
    """The path to a room ends beside the jambs of its door: that point is no narrow place."""
    floor = PaintedFloor(2)
    ask = asker(MapAnswers(session_of(floor, tmp_path)))
    start = floor.inner_point()[0]
    widths = []
    for name in floor.names:
        found = ask("can_reach", start=start, goal=name)
        if found["can_reach"] and found["widest_m"] is not None:
            widths.append(found["widest_m"])
            assert ask("can_reach", start=start, goal=name, width=found["widest_m"] - 0.01)
            told = ask("explain", start=start, goal=name)
            assert found["widest_m"] >= told["widest_m"]
    assert widths


def test_a_mistake_is_answered_in_words(tmp_path):
    floor = PaintedFloor(2)
    answers = MapAnswers(session_of(floor, tmp_path))
    point = floor.inner_point()[0]

    def text(name: str, **arguments: Any) -> str:
        return str(answers.call(name, arguments)["text"])

    place = "a place is a name, or a point [x, y] of two numbers"
    for wrong in ([1, 2, 3], [True, 1], 7, None, "[1]", {"x": 1}):
        assert place in text("route", start=wrong, goal=point), wrong
    assert "a point is [x, y], two numbers in metres" in text("where_am_i", point="hall")
    assert "did you mean avoiding" in text("route", start=point, goal=point, avoid=["door 1"])
    assert "goal is missing" in text("route", start=point)
    found = text("route", start=point, goal=point, avoiding=[{}])
    assert found.startswith("avoiding[0]: ")
    assert "got {}" in found
    assert text("route", start=point, goal=point, width="x").startswith("width: expected")
    refused = text("rout")
    assert "did you mean route" in refused
    assert "undo" not in text("und")  # it is not listed here


def test_kinds_are_taken_in_the_plural_and_choices_hold_what_was_meant(tmp_path):
    floor = PaintedFloor(2)
    answers = MapAnswers(session_of(floor, tmp_path), allow_edits=True)
    start = floor.inner_point()[0]
    for kind in ("room", "door", "hall", "corridor"):
        one, many, loud = (
            answers.call("nearest", {"of": of, "start": start})
            for of in (kind, f"{kind}s", f" {kind.upper()}S")
        )
        assert many.get("nearest") == one.get("nearest") == loud.get("nearest")
    assert answers.call("nearest", {"of": "rooms", "start": start})["ok"]
    for name, arguments in (
        ("route", {"start": start, "goal": floor.names[0] + "x"}),
        ("close", {"rooms": [floor.names[0] + "x"]}),
        ("nearest", {"of": floor.names[0] + "x", "start": start}),
    ):
        found = answers.call(name, arguments)
        checked(name, arguments, found)
        assert "did you mean" in found["text"]
        assert found["choices"][0]["name"] == floor.names[0]
        for choice in found["choices"]:
            assert choice["name"] in found["text"]


def test_no_other_room_is_nearer_than_the_bound(tmp_path):
    """A bound that is rounded to the nearest millimetre is above half of the lengths."""
    floor = PaintedFloor(2)
    session = session_of(floor, tmp_path)
    answers, (start, *_) = MapAnswers(session, allow_edits=False), floor.inner_point()
    topology = session.planning.topology
    planner, rooms = hn.HybridPlanner(topology), topology.rooms
    for away_m in np.arange(40) * 0.00117:
        begin = (start[0] + away_m, start[1])
        found = answers.call("nearest", {"of": "rooms", "start": list(begin)})
        (nearest,) = found["nearest"]
        others = [name for name in rooms.names if name not in (nearest["name"], rooms.at(begin))]
        costs = [planner.plan(begin, rooms.point_of(name)).cost for name in others]
        assert found["others_at_least_m"] <= min(costs)


def test_a_page_that_prepares_says_when_to_ask_again(tmp_path):
    session, go_on = session_of(PaintedFloor(1), tmp_path), threading.Event()

    def make(_: Any) -> Site:
        go_on.wait(60)
        return Site.of_map(session)

    opening = Opening(session.grid, make)
    opening.begin()
    with served(opening, tmp_path) as client:
        for path, body in (("floor/0/api/describe_map", {}), ("find", {"text": "x"})):
            found = client.post(path, body)
            assert found.code == 503
            assert int(found.headers["retry-after"]) >= 1
            assert "not yet" in str(found.value)
        assert client.post("floor/7/api/describe_map", {}).code in {422, 503}
        go_on.set()
        opening.wait()
        assert client.post("floor/0/api/describe_map", {}).code == 200


def test_names_of_rooms_are_saved_and_taken_back(tmp_path):
    floor = PaintedFloor(3)
    session = session_of(floor, tmp_path)
    answers = MapAnswers(session, allow_edits=True)
    old = floor.names[0]
    assert answers.call("close", {"rooms": [old]})["ok"]
    assert answers.call("name_room", {"room": old, "name": "Archive"})["ok"]
    assert "Archive" in hn.load_rooms(tmp_path / "rooms.yaml", session.grid).names
    assert answers.call("describe_map", {})["closed"]["rooms"] == ["Archive"]
    for bad in ("", "x" * 300, floor.names[1], "two\nlines", "1,2"):
        found = answers.call("name_room", {"room": "Archive", "name": bad})
        assert not found["ok"], bad
    (tmp_path / "rooms.yaml").write_text("someone else's", encoding="utf-8")
    found = answers.call("name_room", {"room": "Archive", "name": "Attic"})
    assert not found["ok"]
    assert (tmp_path / "rooms.yaml").read_text(encoding="utf-8") == "someone else's"
    assert session.rooms.names[0] == "Archive"
    answers.call("undo", {})


def test_small_answers_and_a_limit_in_time(tmp_path, monkeypatch):
    floor = PaintedFloor(4)
    answers = MapAnswers(session_of(floor, tmp_path))
    start, goal = (floor.inner_point()[0] for _ in range(2))
    for name, arguments in (
        ("describe_map", {}),
        ("list_rooms", {}),
        ("where_am_i", {"point": start}),
        ("route", {"start": start, "goal": goal}),
        ("nearest", {"of": "door", "start": start, "count": 5}),
        ("explain", {"start": start, "goal": goal}),
    ):
        assert len(json.dumps(answers.call(name, arguments)).encode()) <= 2048, name
    monkeypatch.setattr(questions, "LIMIT_S", 0.05)
    monkeypatch.setattr(answers, "call", lambda *_: __import__("time").sleep(0.4))
    late = asyncio.run(questions.answered(answers.call, "route", {}))
    assert not late["ok"]
    assert "no answer within" in late["text"]


def test_a_long_route_comes_in_parts(tmp_path):
    """Rooms in a row, each with a door at another end: more words than an answer holds."""
    n = 40
    free = np.ones((12, 10 * n), np.bool_)
    labels = np.full(free.shape, -1, np.int32)
    for k in range(n):
        free[:, 10 * k + 9] = False
        labels[:, 10 * k : 10 * k + 10] = k
        if k < n - 1:
            at = 1 if k % 2 else 7
            free[at : at + 4, 10 * k + 9] = True
    names = tuple(f"the long name of a room, number {k}" for k in range(n))
    floor = PaintedFloor(0)
    floor.free, floor.label_of, floor.names = free, labels, names
    ask = asker(MapAnswers(session_of(floor, tmp_path)))
    route = {"start": names[0], "goal": names[-1]}
    whole, part = [], ask("route", **route)
    assert part["words_left"] > 0
    while True:
        whole += part["words"]
        if not part["words_left"]:
            break
        part = ask("route", **route, words_from=len(whole))
    assert f"number {n - 1}" in whole[-1]
    assert len(whole) > 20


def test_a_model_is_served_as_a_map_is(tmp_path):
    floor = PaintedFloor(6)
    session = session_of(floor, tmp_path)
    planner = session.planning.planner("shortest")
    hn.save(planner, tmp_path / "floor.hnm")

    async def main() -> dict[str, Any]:
        async with connected(tmp_path / "floor.hnm") as client:
            return await asked(client, "list_rooms", count=50)

    found = asyncio.run(main())
    assert {room["name"] for room in found["rooms"]} == set(floor.names)


def test_nothing_outside_the_folder_is_read_or_written(tmp_path):
    inside, outside = tmp_path / "maps", tmp_path / "secret"
    inside.mkdir()
    outside.mkdir()
    path = write_floor(PaintedFloor(7), inside)
    (inside / "rooms.yaml").rename(outside / "rooms.yaml")
    (inside / "rooms.yaml").symlink_to(outside / "rooms.yaml")
    words = [sys.executable, "-m", "hybridnav", "serve", str(path), "--robot-radius", "0.2"]
    done = subprocess.run(words, input="", capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode != 0
    assert "leads out of" in done.stderr
    assert done.stderr.count("\n") == 1


def test_what_is_out_of_order_is_closed_for_programs_too(tmp_path):
    floor = PaintedFloor(2)
    plain = session_of(floor, tmp_path)
    point, _, room = floor.inner_point()
    goal = floor.names[(room + 1) % len(floor.names)]
    ends = {"start": point, "goal": goal}
    assert MapAnswers(plain).call("route", ends)["status"] == "solved"
    journal = hn.Journal(tmp_path / "floor.yaml")
    journal.close(f"room:{goal}")
    topology, preset = plain.planning.topology, hn.load_preset("shortest")
    model = hn.load(tmp_path / "floor.yaml", robot_radius_m=0.2)
    answers = MapAnswers(Session(model, topology, model.fitted(preset), journal=journal))
    for name in ("route", "can_reach", "explain"):
        assert f"closed by room {goal}" in answers.call(name, ends)["text"]
    assert not answers.call("nearest", {"of": goal, "start": point})["ok"]
    assert journal.open(f"room:{goal}")
    assert answers.call("route", ends)["status"] == "solved"
    for door in topology.rooms.doors:
        if goal in door.rooms and not door.is_gap:
            other = door.rooms[door.rooms[0] == goal]
            journal.close(f"one-way:door:{door.number}={other or ''}")
    for name in ("route", "can_reach", "explain"):
        assert "may be crossed only" in answers.call(name, ends)["text"]
    assert answers.call("route", {"start": goal, "goal": point})["status"] == "solved"


@pytest.mark.parametrize("of", ["map", "building"])
def test_the_example_asks_a_map(of, tmp_path):
    path = Path(__file__).parents[3] / "maps" / "building" / "building.yaml"
    path = path if of == "building" else write_floor(PaintedFloor(5), tmp_path)
    file = Path(__file__).parents[3] / "examples" / "ask_a_map.py"
    done = subprocess.run(
        [sys.executable, str(file), str(path)],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    told = [line.split(":")[0] for line in done.stdout.splitlines() if ": " in line]
    assert told == ["describe_map", "list_rooms", "route", "can_reach", "explain"]
    assert len(file.read_text(encoding="utf-8").splitlines()) <= 40
