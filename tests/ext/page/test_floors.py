"""What the server answers about buildings: floors, routes over them, rooms of each, files."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely

import hybridnav as hn
from tests.ext.page.server import (
    Client,
    building_site_of,
    query_of,
    served,
    session_of,
    write_building,
)

START: dict[str, Any] = {"floor": 0, "point": [20.5, 40.5]}
GOAL: dict[str, Any] = {"floor": 1, "point": [60.5, 8.5]}
QUERY: dict[str, Any] = {"start": START, "goal": GOAL, "preset": "shortest"}


def _own(folder: Path) -> hn.ext.fleet.Building:
    return hn.ext.fleet.load_building(folder / "building.yaml", robot_radius_m=0.2)


def _ends(building: hn.ext.fleet.Building) -> list[Any]:
    ends = []
    for end in (START, GOAL):
        floor = building.floors[end["floor"]]
        x, y = end["point"]
        at = floor.planner.grid.frame.points_of_grid([(y, x)]).round(6)[0]
        ends.append((floor.name, tuple(at.tolist())))
    return ends


def test_floors_and_links_are_described(building: Client) -> None:
    found = building.get("map.json").value
    assert found["floors"] == ["ground", "2: upper"]
    assert [(link["name"], link["kind"], link["fits"]) for link in found["links"]] == [
        ("lift", "lift", True),
        ("stairs", "stairs", True),
        ("hatch", "ramp", False),
    ]
    assert not any("se2" in name or "dubins" in name for name in found["presets"])
    floors = [building.get(f"floor/{number}/map.json").value for number in (0, 1)]
    assert [room["name"] for room in floors[1]["rooms"]["rooms"]] == ["e", "f", "g", "h"]
    for link in found["links"]:
        for end in link["ends"]:
            room = building.post(f"floor/{end['floor']}/at", {"point": end["at"]}).value["room"]
            letter = {"lift": "ae", "stairs": "df", "hatch": "bh"}[link["name"]][end["floor"]]
            assert room == letter


def test_a_plan_over_floors_is_that_of_the_library(building: Client, folder: Path) -> None:
    found = building.post("plan", QUERY).value
    own = _own(folder)
    plan = own.plan(*_ends(own))
    for name in ("length_m", "charge_m", "cost", "lower_bound", "gap", "travel_s"):
        assert found[name] == pytest.approx(getattr(plan, name))
    assert [part["floor"] for part in found["parts"]] == [0, 1]
    for part, result, floor in zip(found["parts"], plan.results, own.floors, strict=True):
        rows_and_cols = np.array(part["line"])[:, ::-1]
        points = floor.planner.grid.frame.points_of_grid(rows_and_cols)
        np.testing.assert_allclose(points, result.path.points, atol=1e-3)
    assert [ride["link"] for ride in found["rides"]] == [ride.link.name for ride in plan.rides]
    assert [line["text"] for line in found["words"]] == plan.words()
    assert "words" not in building.post("plan", QUERY | {"brief": True}).value
    by_cells = building.post("optimum", QUERY).value
    assert by_cells["metric"] == "octile"
    assert by_cells["cost"] == pytest.approx(
        hn.ext.fleet.load_building(
            folder / "building.yaml", robot_radius_m=0.2, preset="grid-astar"
        )
        .plan(*_ends(own))
        .cost
    )


def test_links_doors_and_stairs_are_closed(building: Client, folder: Path) -> None:
    own = _own(folder)
    ends = _ends(own)
    taken = building.post("plan", QUERY).value["rides"][0]["link"]
    for closed, how in (
        ({"links": [taken]}, {"closed_links": [taken]}),
        (
            {"floors": [{"floor": 0, "rooms": ["b"]}, {"floor": 1, "doors": [1]}]},
            {"blocked": {"ground": {"rooms": ["b"]}, "2: upper": {"doors": [1]}}},
        ),
    ):
        found = building.post("plan", QUERY | {"closed": closed}).value
        assert found["cost"] == pytest.approx(own.plan(*ends, **how).cost)
    assert building.post("plan", QUERY | {"stairs": False}).value["rides"][0]["kind"] == "lift"
    both = building.post("plan", QUERY | {"closed": {"links": ["lift", "stairs"]}}).value
    assert (both["solved"], both["parts"]) == (False, [])


def test_alternatives_take_other_links(building: Client) -> None:
    found = building.post("alternatives", QUERY | {"count": 3}).value
    links = [route["rides"][0]["link"] for route in found["routes"]]
    assert sorted(links) == ["lift", "stairs"]
    assert found["routes"][0]["cost"] <= found["routes"][1]["cost"]
    assert "no more routes" in found["note"]


def test_names_are_saved_to_the_file_of_their_floor(building: Client, folder: Path) -> None:
    ground = (folder / "rooms.yaml").read_bytes()
    change = {"op": "rename", "room": "g", "name": "attic"}
    assert building.post("floor/1/edit", {"version": 0, "change": change}).code == 200
    assert (folder / "more" / ".rooms-2.yaml.edits").exists()
    assert building.post("floor/1/save", {"version": 1}).value["notice"] == "saved to rooms-2.yaml"
    assert (folder / "rooms.yaml").read_bytes() == ground
    own = _own(folder)
    assert set(own.floors[1].rooms.names) == {"e", "f", "attic", "h"}
    goal = {"floor": 1, "point": [20.5, 8.5]}
    words = building.post("plan", QUERY | {"goal": goal}).value["words"]
    assert "attic" in " ".join(line["text"] for line in words)


@pytest.mark.parametrize(
    ("change", "caution"),
    [
        ({"op": "rename", "room": "e", "name": "attic"}, "link lift names room e"),
        ({"op": "merge", "room": "e", "other": "f"}, "link stairs names room f"),
        (
            {"op": "merge", "room": "f", "other": "h"},
            "link stairs names door 3, link hatch names room h",
        ),
    ],
)
def test_a_link_that_loses_its_room_is_named(building, folder, change, caution):
    building.post("floor/1/edit", {"version": 0, "change": change})
    notice = building.post("floor/1/save", {"version": 1}).value["notice"]
    assert notice.startswith(f"saved to rooms-2.yaml; {caution}")
    with pytest.raises(hn.errors.MapError):  # as the notice says, the file has to be changed
        _own(folder)


def test_rooms_outside_the_folder_are_not_saved(folder: Path) -> None:
    file = write_building(folder)
    outside = folder.parent / "rooms-2.yaml"
    for name in ("rooms-2.yaml", "rooms-2.cells.png"):
        (folder / "more" / name).rename(folder.parent / name)
    text = file.read_text("utf-8").replace("more/rooms-2.yaml", "../rooms-2.yaml")
    file.write_text(text, encoding="utf-8")
    before = outside.read_bytes()
    with served(building_site_of(file), folder) as client:
        assert client.get("floor/0/map.json").value["can_save"] is True
        assert client.get("floor/1/map.json").value["can_save"] is False
        assert "rooms: FILE" in client.get("floor/1/map.json").value["no_file"]
        change = {"op": "rename", "room": "e", "name": "attic"}
        client.post("floor/1/edit", {"version": 0, "change": change})
        assert client.post("floor/1/save", {"version": 1}).code == 422
    assert outside.read_bytes() == before


def test_floors_of_one_map_share_their_rooms(folder: Path) -> None:
    planner = session_of(folder / "four.yaml").planning.planner("shortest")
    floors = [hn.ext.fleet.Floor(name, planner) for name in ("1", "2")]
    from hybridnav.ext.page import Site

    with served(Site.of_building(hn.ext.fleet.Building(floors), "twice"), folder) as client:
        change = {"op": "rename", "room": "a", "name": "kitchen"}
        assert client.post("floor/0/edit", {"version": 0, "change": change}).code == 200
        assert client.get("floor/1/rooms.json").value["rooms"][-1]["name"] == "kitchen"


def test_a_floor_without_rooms_gets_those_that_are_found(folder: Path) -> None:
    from hybridnav.ext.page import Site

    grid = hn.load(folder / "four.yaml", robot_radius_m=0.2).grid
    planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    building = hn.ext.fleet.Building([hn.ext.fleet.Floor("1", planner)])
    with served(Site.of_building(building, "bare"), folder) as client:
        found = client.get("floor/0/rooms.json").value["rooms"]
        assert [room["name"] for room in found] == list(hn.find_rooms(grid).names)
        end = {"floor": 0, "point": [20.5, 40.5]}
        assert client.post("plan", {"start": end, "goal": end, "preset": "shortest"}).value[
            "solved"
        ]


def test_files_of_a_building(building: Client, folder: Path, tmp_path: Path) -> None:
    before = sorted(file.name for file in folder.iterdir())
    model = tmp_path / "own.hnm"
    model.write_bytes(building.post("export/model", None).body)
    assert [floor.name for floor in hn.ext.fleet.load_building(model).floors] == [
        "ground",
        "2: upper",
    ]
    own = _own(folder)
    plan = own.plan(*_ends(own))
    for number, result in enumerate(plan.results):
        content = building.post("export/path-geojson", QUERY | {"floor": number}).body
        line = shapely.geometry.shape(json.loads(content)["features"][0]["geometry"])
        np.testing.assert_allclose(line.coords, result.path.points, atol=1e-6)
        rooms = json.loads(building.post(f"floor/{number}/export/rooms", None).body)
        names = [f["properties"].get("room") for f in rooms["features"]]
        assert ("e" in names) == (number == 1)
    assert sorted(file.name for file in folder.iterdir()) == before
    elsewhere = QUERY | {"goal": START, "floor": 1}
    refused = building.post("export/path-csv", elsewhere)
    assert (refused.code, "does not visit" in refused.value["error"]) == (422, True)


def test_a_model_says_beforehand_that_it_saves_no_rooms_and_how_to_keep_them(folder, tmp_path):
    model, out = tmp_path / "building.hnm", tmp_path / "changed.hnm"
    hn.save(hn.ext.fleet.load_building(write_building(folder), robot_radius_m=0.2), model)
    before = sorted(tmp_path.iterdir())
    with served(building_site_of(model), tmp_path) as client:
        found = client.get("floor/1/map.json").value
        assert found["can_save"] is False
        assert "Export the model" in found["no_file"]
        change = {"op": "rename", "room": "e", "name": "attic"}
        assert client.post("floor/1/edit", {"version": 0, "change": change}).code == 200
        content = client.post("export/model", None).body
    assert sorted(tmp_path.iterdir()) == before
    out.write_bytes(content)
    rooms = hn.ext.fleet.load_building(out).floors[1].rooms
    assert set(rooms.names) == {"attic", "f", "g", "h"}


def test_what_is_out_of_order_and_who_goes_are_told_and_changed(building, folder):
    found = building.get("closed.json").value
    assert [one["name"] for one in found["profiles"]] == ["visitor", "staff", "wheelchair", "cart"]
    assert (found["closed"], found["can_close"]) == ([], True)
    first = building.post("plan", QUERY).value["rides"][0]["link"]
    change = {"what": f"link:{first}", "closed": True, "why": "repair"}
    (item,) = building.post("closed", change).value["closed"]
    assert (item["what"], item["why"]) == (f"link:{first}", "repair")
    assert [one.what for one in hn.Journal(folder / "building.yaml").items()] == [item["what"]]
    assert building.post("plan", QUERY).value["rides"][0]["link"] != first
    for what in ("link:none", "3:door:1", "2: upper:room:none", "door:1", "nothing"):
        refused = building.post("closed", change | {"what": what})
        assert refused.code == 422, what
    hn.Journal(folder / "building.yaml").open(item["what"])
    assert building.get("closed.json").value["closed"] == []
    assert building.post("plan", QUERY).value["rides"][0]["link"] == first
    by_lift = building.post("plan", QUERY | {"profile": "cart"}).value
    assert [ride["kind"] for ride in by_lift["rides"]] == ["lift"]
    assert building.post("plan", QUERY | {"profile": "nobody"}).code == 422
    door = building.post("closed", {"what": "2: upper:room:e", "closed": True}).value["closed"]
    assert [one["what"] for one in door] == ["2: upper:room:e"]
    assert (
        building.post("closed", {"what": "2: upper:room:e", "closed": False}).value["closed"] == []
    )


@pytest.mark.parametrize(("language", "reason"), [("en", "Link "), ("de", "Verbindung ")])
def test_why_there_is_no_route_is_told_in_the_language_of_the_page(
    building: Client, folder: Path, language: str, reason: str
) -> None:
    links = [link.name for link in _own(folder).links]
    shut = QUERY | {"language": language, "closed": {"links": links}}
    told = building.post("plan", shut).value
    assert not told["solved"]
    assert reason.lower() in told["why"].lower()


def test_a_map_has_them_too(client: Client, folder: Path) -> None:
    query = query_of([10.5, 40.5], [70.5, 10.5])
    assert client.post("plan", query).value["solved"]
    client.post("closed", {"what": "room:a", "closed": True})
    assert (folder / "four.closed.yaml").is_file()
    assert not client.post("plan", query).value["solved"]
    client.post("closed", {"what": "room:a", "closed": False})
    assert client.post("plan", query | {"profile": "visitor"}).value["solved"]
    assert client.post("closed", {"what": "link:lift", "closed": True}).code == 422
    (folder / "four.closed.yaml").unlink()
    (folder / "four.closed.yaml").symlink_to(folder.parent / "elsewhere.yaml")
    assert client.post("closed", {"what": "room:a", "closed": True}).code == 422
    assert not (folder.parent / "elsewhere.yaml").exists()
