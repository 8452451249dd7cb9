"""Hostile requests about floors end in a 4xx, and nothing outside the folder is read or written."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import pytest

from tests.ext.page.server import TOKEN, building_site_of, folder_in, served, write_building

if TYPE_CHECKING:
    from collections.abc import Iterator

    from tests.ext.page.server import Client

START, GOAL = {"floor": 0, "point": [20.5, 40.5]}, {"floor": 1, "point": [60.5, 8.5]}
QUERY: dict[str, Any] = {"start": START, "goal": GOAL, "preset": "shortest"}


@pytest.fixture(scope="module")
def building(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Client]:
    """One server for all hostile requests: none may change any file."""
    folder = folder_in(tmp_path_factory.mktemp("hostile"))
    session = building_site_of(write_building(folder))

    def files() -> dict[str, bytes]:
        return {str(f): f.read_bytes() for f in folder.parent.rglob("*") if f.is_file()}

    before = files()
    with served(session, folder) as client:
        yield client
    assert files() == before


@pytest.mark.parametrize(
    "name",
    [
        *("floor/2/map.json", "floor/-1/map.json", "floor/99999999999999999999/map.json"),
        *("floor/1e0/map.json", "floor/%D9%A1/map.json", "floor//map.json", "floor/map.json"),
        *("floor/../../secret.txt", "floor/..%2f..%2fsecret.txt/map.json", "floor/0%00/map.json"),
        *("floor/2/tile/map/0/0/0.png", "floor/0/tile/map/0/9/0.png", "floor/+1/rooms.json"),
        *("floor/0/../1/../../../secret.txt", "floor/0/graph/-1.json", "tile/map/0/0/0.png"),
        "rooms.json",
    ],
)
def test_floors_that_are_none_are_refused(building: Client, name: str) -> None:
    answer = building.get(name)
    assert 400 <= answer.code < 500
    assert b"secret" not in answer.body or b"error" in answer.body
    assert building.get("floor/1/rooms.json").code == 200


@pytest.mark.parametrize(
    "change",
    [
        {"start": {"floor": 2, "point": [1, 1]}},
        {"start": {"floor": 10**30, "point": [1, 1]}},
        {"start": {"floor": -1, "point": [1, 1]}},
        {"start": {"floor": "0", "point": [1, 1]}},
        {"start": {"floor": True, "point": [1, 1]}},
        {"start": {"floor": 0.0, "point": [1, 1]}},
        {"start": {"floor": 0, "point": [math.nan, 1]}},
        {"start": {"floor": 0}},
        {"start": [1, 1]},
        {"goal": None},
        {"stairs": 1},
        {"preset": "../shortest"},
        {"preset": "no-such-preset"},
        {"closed": {"links": ["no such link"]}},
        {"closed": {"links": "lift"}},
        {"closed": {"links": [1]}},
        {"closed": {"floors": [{"floor": 7, "rooms": ["a"]}]}},
        {"closed": {"floors": [{"floor": 0, "rooms": ["e"]}]}},
        {"closed": {"floors": [{"floor": 0, "doors": [999]}]}},
        {"closed": {"floors": [{"floor": 0, "rooms": ["a"]}] * 2}},
        {"closed": {"floors": [{"floor": 0, "files": ["/etc/passwd"]}]}},
        {"closed": {"doors": [1]}},
        {"more": 1},
    ],
)
def test_wrong_queries_over_floors_are_refused(building: Client, change: dict[str, Any]) -> None:
    for name in ("plan", "alternatives", "export/path-csv"):
        floor = {"floor": 0} if name.startswith("export") else {}
        answer = building.post(name, QUERY | floor | change)
        assert answer.code == 422
        assert answer.value["error"].isprintable()


@pytest.mark.parametrize("headers", [{"origin": "https://evil.example"}, {"host": "evil.example"}])
def test_foreign_origins_reach_no_floor(building: Client, headers: dict[str, str]) -> None:
    assert building.get("floor/0/map.json", **headers).code == 403
    assert building.post("floor/0/save", {"version": 0}, **headers).code == 403
    assert building.post("plan", QUERY, **headers).code == 403


@pytest.mark.parametrize("path", ["/floor/0/map.json", f"/{TOKEN[:-1]}/floor/0/map.json"])
def test_without_the_token_no_floor_is_shown(building: Client, path: str) -> None:
    assert building.send("GET", path).code == 403


@pytest.mark.parametrize(
    ("kind", "value"),
    [("nav2", None), ("rooms", None), ("../x", None), ("path-csv", None), ("path-csv", QUERY)],
)
def test_files_that_a_building_has_not_are_refused(building: Client, kind: str, value: Any) -> None:
    assert 400 <= building.post(f"export/{kind}", value).code < 500
