"""Rooms by name: what the server finds, where one stands, and the favourites that it keeps."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.page import kept
from hybridnav.ext.page.requests import Favour, Find
from tests.ext.page.server import (
    Client,
    building_site_of,
    query_of,
    served,
    site_of,
    write_building,
)

FILE = ".hybridnav-favourites.json"


def _found(client: Client, text: str) -> list[tuple[int, str]]:
    places = client.post("find", {"text": text}).value["found"]
    return [(place["floor"], place["name"]) for place in places]


def test_places_are_found_as_people_type_them(wards: Path) -> None:
    with served(site_of(wards / "four.yaml"), wards) as client:
        assert _found(client, "KUCHE") == [(0, "Küche")]
        assert [name for _, name in _found(client, "ward")] == ["ward 1", "Ward 2", "ward 10"]
        everything = [name for _, name in _found(client, "")]
        assert everything == ["chair", "Küche", "ward 1", "Ward 2", "ward 10"]
        assert _found(client, "kitchen") == []
        rooms = client.get("floor/0/rooms.json").value["rooms"]
        assert [room["name"] for room in rooms] == ["Küche", "ward 1", "Ward 2", "ward 10"]


def test_a_floor_may_stand_before_the_name(building: Client) -> None:
    assert _found(building, "e") == [(1, "e")]
    assert _found(building, "GROUND: a") == [(0, "a")]
    assert _found(building, "ground: e") == []


def test_outlines_are_in_the_order_of_the_rooms(wards: Path) -> None:
    with served(site_of(wards / "four.yaml"), wards) as client:
        rooms = client.get("floor/0/rooms.json").value["rooms"]
        for room, rings in zip(
            rooms, client.get("floor/0/outlines.json").value["rings"], strict=True
        ):
            corners = np.array(rings[0])
            assert (corners.min(axis=0) <= room["at"]).all()
            assert (corners.max(axis=0) >= room["at"]).all()


def test_one_stands_on_the_nearest_free_cell(wards: Path) -> None:
    site = site_of(wards / "four.yaml")
    grid = site.sessions[0].grid
    with served(site, wards) as client:
        free = client.post("floor/0/stand", {"point": [8.5, 30.5]}).value
        assert free == {"name": "Küche", "point": [8.5, 30.5], "away_m": 0.0}
        named = client.post("floor/0/stand", {"name": "chair"}).value
        assert named == {"name": "chair", "point": [19.5, 36.0], "away_m": 0.0}
        found = client.post("floor/0/stand", {"point": [17.0, 36.2]}).value
        col, row = found["point"]
        assert grid.classes[int(row), int(col)] == hn.CellClass.FREE
        away_m = 0.25 * np.hypot(col - 17.0, row - 36.2)
        assert found["away_m"] == pytest.approx(away_m, abs=0.01)
        rows, cols = np.nonzero(grid.classes == hn.CellClass.FREE)
        least_m = 0.25 * np.hypot(cols + 0.5 - 17.0, rows + 0.5 - 36.2).min()
        assert away_m == pytest.approx(least_m, abs=0.01)
        query = query_of(found["point"], [70.5, 10.5])
        assert client.post("plan", query).value["solved"]
        assert client.post("floor/0/stand", {"name": "nowhere"}).code == 422
        assert client.post("floor/0/stand", {"point": [1e6, 5]}).value["name"] is None


def test_words_call_the_ends_by_their_names_in_the_language(wards: Path) -> None:
    with served(site_of(wards / "four.yaml"), wards) as client:
        query = query_of([8.5, 30.5], [70.5, 10.5])
        query["goal"]["name"] = "ward 1"
        english = client.post("plan", query).value["words"]
        assert "you are there" in english[-1]["text"] or "ward 1" in english[-1]["text"]
        assert not any("(" in line["text"] for line in english)
        german = client.post("plan", query | {"language": "de"}).value["words"]
        assert [line["at"] for line in german] == [line["at"] for line in english]
        assert "Tür" in " ".join(line["text"] for line in german)
        assert client.post("plan", query | {"language": "xx"}).code == 422


@pytest.mark.parametrize("language", ["en", "de"])
def test_a_line_that_names_a_door_is_about_it(building: Client, language: str) -> None:
    query = {
        "start": {"floor": 0, "point": [20.5, 40.5]},
        "goal": {"floor": 1, "point": [60.5, 8.5], "name": "h"},
        "preset": "shortest",
        "language": language,
    }
    found = building.post("plan", query).value
    doors = [
        {
            door["number"]: door["at"]
            for door in building.get(f"floor/{n}/rooms.json").value["doors"]
        }
        for n in (0, 1)
    ]
    told = [line for line in found["words"] if line["door"] is not None]
    assert all(f" {line['door']}" in line["text"] for line in told)
    crossed = [line for line in told if re.search("(by|through) door|durch Tür", line["text"])]
    assert crossed
    for line in crossed:
        assert np.hypot(*np.subtract(doors[line["floor"]][line["door"]], line["at"])) < 4
    floors = [line["floor"] for line in found["words"]]
    assert floors == sorted(floors)
    assert set(floors) == {0, 1}


def test_favourites_come_first_and_outlive_the_page(folder: Path) -> None:
    file = write_building(folder)
    place: dict[str, Any] = {"floor": 1, "name": "g"}
    with served(building_site_of(file), folder) as client:
        assert client.post("favour", place | {"kept": True}).code == 200
        assert client.post("favour", {"floor": 0, "name": "g", "kept": True}).code == 422
    with served(building_site_of(file), folder) as client:
        places = client.post("find", {"text": ""}).value["found"]
        assert (places[0]["name"], places[0]["favourite"]) == ("g", True)
        assert not any(place["favourite"] for place in places[1:])
        assert client.post("favour", place | {"kept": False}).code == 200
        assert not client.post("find", {"text": "g"}).value["found"][0]["favourite"]


@pytest.mark.parametrize(
    "text", ["", "[]", "{", '{"four": 3}', '{"four": [["", 7], "x"]}', "[" * 9999]
)
def test_a_file_of_favourites_that_is_none_does_no_harm(folder: Path, text: str) -> None:
    (folder / FILE).write_text(text, encoding="utf-8")
    with served(site_of(folder / "four.yaml"), folder) as client:
        assert len(_found(client, "")) == 4
        asked = {"floor": 0, "name": "a", "kept": True}
        assert client.post("favour", asked).code == 200
    assert ["", "a"] in json.loads((folder / FILE).read_text("utf-8"))["four"]


def test_favourites_are_not_written_through_a_link(folder: Path) -> None:
    (folder / FILE).symlink_to(folder.parent / "secret.txt")
    with served(site_of(folder / "four.yaml"), folder) as client:
        answer = client.post("favour", {"floor": 0, "name": "a", "kept": True})
        assert answer.code == 422
        assert "link" in answer.value["error"]
    assert (folder.parent / "secret.txt").read_text("utf-8") == "secret"


def test_no_more_favourites_are_written_than_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr(kept, "_MOST_OF_FAVOURITES", 100)
    places = [(0, f"a room {number}") for number in range(9)]
    finder, site = kept.Finder(tmp_path), kept.Named("site", ("ground",), places)
    with pytest.raises(hn.errors.InvalidValueError, match="is full: remove favourites"):
        [finder.favour(site, Favour(floor=0, name=name, kept=True)) for _, name in places]
    found = finder.find(site, Find(text=""))["found"]
    assert kept.Finder(tmp_path).find(site, Find(text=""))["found"] == found
    assert sum(each["favourite"] for each in found) > 1
    finder.favour(site, Favour(floor=0, name="a room 0", kept=False))


def test_no_more_changes_are_kept_than_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr(kept, "_MOST_BYTES", 200)
    file = kept.RoomsFile(tmp_path, "rooms.yaml")
    few, many = [{"name": "x" * 50}], [{"name": "x" * 200}]
    assert file.keep(few) is None
    assert file.keep(many) == "more than 200 bytes are not read again"
    assert file.kept() == few
