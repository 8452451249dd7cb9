"""Hostile requests end in a 4xx, and nothing outside the folder is read or written."""

import math
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.ext.page.server import (
    TOKEN,
    Client,
    building_site_of,
    folder_in,
    query_of,
    served,
    site_of,
    write_building,
)

QUERY = query_of([10.5, 40.5], [70.5, 10.5])


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a building and its maps, with another file above it that nothing may touch."""
    folder = folder_in(tmp_path_factory.mktemp("hostile"))
    write_building(folder)
    return folder


@pytest.fixture(scope="module", params=["four.yaml", "building.yaml"])
def client(folder: Path, request: pytest.FixtureRequest) -> Iterator[Client]:
    """One server for all hostile requests to a map or a building: none may change anything."""
    made = site_of if request.param == "four.yaml" else building_site_of
    with served(made(folder / request.param), folder) as client:
        yield client


@pytest.fixture(autouse=True)
def _nothing_changes(folder: Path, client: Client) -> Any:
    """Compare all files before and after each hostile test."""

    def files() -> dict[str, bytes]:
        return {str(f): f.read_bytes() for f in folder.parent.rglob("*") if f.is_file()}

    before = files()
    yield
    assert client.get("floor/0/rooms.json").code == 200  # it still answers
    assert files() == before


@pytest.mark.parametrize(
    "path",
    [
        "/",
        "/map.json",
        "/wrong-token/map.json",
        f"/{TOKEN}",
        f"/{TOKEN[:-1]}/map.json",
        f"/{TOKEN.upper()}/map.json",
        f"//{TOKEN}/map.json",
        f"/{TOKEN}x/map.json",
        "/floor/0/map.json",
        f"/{TOKEN[:-1]}/floor/0/map.json",
    ],
)
def test_without_the_token_nothing_is_answered(client: Client, path: str) -> None:
    answer = client.send("GET", path)
    assert answer.code == 403
    assert b"rooms" not in answer.body


@pytest.mark.parametrize(
    "name",
    [
        "../secret.txt",
        "..%2f..%2fsecret.txt",
        "%2e%2e/%2e%2e/secret.txt",
        "..\\..\\secret.txt",
        "page.css/../../secret.txt",
        "//etc/passwd",
        "page.py",
        "assets/page.css",
        "tile/../../secret.txt/0/0/0.png",
        "tile/map/0/0/..%2f0.png",
        "graph/..%2f..%2fsecret.json",
        "graph/%00.json",
        "costs/..%2fshortest.json",
        "costs/%2e%2e%2fplanners%2fshortest.yaml.json",
        "tile/map/99999999999999999999/0/0.png",
        "tile/map/0/-1/0.png",
        "tile/map/0/1e3/0.png",
        "tile/map/0/٣/0.png".encode().decode("latin-1"),
        "tile/map/2/0/0.png",
        "tile/level-999/0/0/0.png",
        "tile/level-/0/0/0.png",
        "tile/nothing/0/0/0.png",
        "graph/-1.json",
        "graph/1e9.json",
    ],
)
def test_paths_upward_and_numbers_out_of_range_are_refused(client: Client, name: str) -> None:
    from urllib.parse import quote

    if name.startswith(("tile/", "graph/", "costs/")):
        name = f"floor/0/{name}"
    answer = client.get(quote(name, safe="/%.:\\") if not name.isascii() else name)
    assert 400 <= answer.code < 500
    assert b"secret" not in answer.body or b"error" in answer.body


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
def test_floors_that_are_none_are_refused(client: Client, name: str) -> None:
    answer = client.get(name)
    assert 400 <= answer.code < 500
    assert b"secret" not in answer.body or b"error" in answer.body


@pytest.mark.parametrize(
    ("kind", "value"),
    [("nav2", None), ("rooms", None), ("../x", None), ("path-csv", None), ("path-csv", QUERY)],
)
def test_files_that_a_site_has_not_are_refused(client: Client, kind: str, value: Any) -> None:
    assert 400 <= client.post(f"export/{kind}", value).code < 500


@pytest.mark.parametrize(
    "headers",
    [
        {"origin": "https://evil.example"},
        {"origin": "null"},
        {"origin": "http://127.0.0.1:1"},
        {"host": "evil.example"},
        {"host": "127.0.0.1.evil.example:80"},
        {"host": "127.0.0.1"},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "same-site"},
    ],
)
@pytest.mark.parametrize("method", ["GET", "POST"])
def test_foreign_origins_and_hosts_are_refused(client, headers, method):
    if method == "GET":
        for name in ("map.json", "floor/0/map.json"):
            assert client.get(name, **headers).code == 403
    else:
        assert client.post("plan", QUERY, **headers).code == 403
        assert client.post("floor/0/save", {"version": 0}, **headers).code == 403


def test_its_own_origin_is_welcome(client: Client) -> None:
    own = {"origin": f"http://127.0.0.1:{client.port}", "sec-fetch-site": "same-origin"}
    assert client.post("plan", QUERY, **own).code == 200


@pytest.mark.parametrize(
    "change",
    [
        {"start": {"floor": 0, "point": [1e300, 0]}},
        {"start": {"floor": 0, "point": [math.inf, 0]}},
        {"start": {"floor": 0, "point": [math.nan, 0]}},
        {"start": {"floor": 0, "point": [10**400, 0]}},
        {"start": {"floor": 0, "point": ["1", "2"]}},
        {"start": {"floor": 0, "point": [True, False]}},
        {"start": {"floor": 0, "point": [1, 2, 3]}},
        {"start": None},
        {"start": {"x": 1}},
        {"start": [1, 1]},
        {"start": {"floor": 2, "point": [1, 1]}},
        {"start": {"floor": 10**30, "point": [1, 1]}},
        {"start": {"floor": -1, "point": [1, 1]}},
        {"start": {"floor": "0", "point": [1, 1]}},
        {"start": {"floor": True, "point": [1, 1]}},
        {"start": {"floor": 0.0, "point": [1, 1]}},
        {"start": {"floor": 0}},
        {"goal": None},
        {"stairs": 1},
        {"preset": "../planners/shortest"},
        {"preset": "/etc/passwd"},
        {"preset": "no-such-preset"},
        {"preset": 1},
        {"closed": {"floors": [{"floor": 0, "doors": [10**30]}]}},
        {"closed": {"floors": [{"floor": 0, "doors": ["1"]}]}},
        {"closed": {"floors": [{"floor": 0, "doors": [999999]}]}},
        {"closed": {"floors": [{"floor": 0, "rooms": ["no such room"]}]}},
        {"closed": {"floors": [{"floor": 0, "rooms": [["a"]]}]}},
        {"closed": {"floors": [{"floor": 0, "polygons": [[[0, 0], [1, 1]]]}]}},
        {"closed": {"floors": [{"floor": 0, "polygons": [[[0, 0], [9, 9], [9, 0], [0, 9]]]}]}},
        {"closed": {"floors": [{"floor": 0, "polygons": [[[0, 0]] * 1001]}]}},
        {"closed": {"floors": [{"floor": 0, "files": ["/etc/passwd"]}]}},
        {"closed": {"doors": [1]}},
        {"closed": {"links": ["no such link"]}},
        {"closed": {"links": "lift"}},
        {"closed": {"links": [1]}},
        {"closed": {"floors": [{"floor": 7, "rooms": ["a"]}]}},
        {"closed": {"floors": [{"floor": 0, "rooms": ["e"]}]}},
        {"closed": {"floors": [{"floor": 0, "rooms": ["a"]}] * 2}},
        {"more": 1},
    ],
)
def test_wrong_types_and_huge_numbers_are_refused(client: Client, change: dict[str, Any]) -> None:
    for name in ("plan", "optimum", "alternatives", "export/path-csv"):
        floor = {"floor": 0} if name.startswith("export") else {}
        answer = client.post(name, QUERY | floor | change)
        if name == "optimum" and change.get("preset") == "no-such-preset":
            continue  # it has a preset of its own
        assert answer.code == 422
        assert answer.value["error"]
        assert answer.value["error"].isprintable()


@pytest.mark.parametrize("value", [None, [], 1, "plan", {}, {"version": 0}, {"version": -1}])
@pytest.mark.parametrize(
    "name",
    ["plan", "alternatives", "find", "favour", "floor/0/edit", "floor/0/at", "floor/0/stand"],
)
def test_what_is_no_request_is_refused(client: Client, name: str, value: Any) -> None:
    assert client.post(name, value).code == 422


@pytest.mark.parametrize(
    "change",
    [
        {"op": "delete", "room": "a"},
        {"op": ["rename"]},
        {"op": "rename", "room": "a", "name": ""},
        {"op": "rename", "room": "a", "name": "b"},
        {"op": "rename", "room": "a", "name": "two\nlines"},
        {"op": "rename", "room": "a", "name": "1,2"},
        {"op": "rename", "room": "a", "name": "x" * 201},
        {"op": "rename", "room": "nowhere", "name": "x"},
        {"op": "merge", "room": "a", "other": "a"},
        {"op": "merge", "room": "a", "other": "d"},
        {"op": "split", "room": "a", "line": [[0, 0], [0, 0]], "name": "x"},
        {"op": "split", "room": "a", "line": [[1e7, 0], [1e7, 9]], "name": "x"},
        {"op": "split", "room": "a", "line": [[1e9, 0], [0, 9]], "name": "x"},
        {"op": "move", "room": "a", "corner": [500, 500], "to": [1, 1]},
        {"op": "rename", "room": "a", "name": "x", "file": "../x"},
    ],
)
def test_changes_that_are_none_are_refused(client: Client, change: dict[str, Any]) -> None:
    answer = client.post("floor/0/edit", {"version": 0, "change": change})
    assert answer.code == 422
    assert client.session.rooms.names == ("a", "b", "c", "d")


@pytest.mark.parametrize(
    ("body", "kind", "code"),
    [
        (b"{", "application/json", 422),
        (b"\xff\xfe", "application/json", 422),
        (b"[" * 100_000, "application/json", 422),
        (b"{}", "text/plain", 415),
        (b"{}", "application/x-www-form-urlencoded", 415),
        (b" " * 3_000_000, "application/json", 413),
    ],
)
def test_bodies_that_are_no_json_are_refused(client, body, kind, code):
    answer = client.send("POST", f"/{TOKEN}/plan", body, {"content-type": kind})
    assert answer.code == code


@pytest.mark.parametrize("method", ["PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"])
def test_other_methods_are_refused(client: Client, method: str) -> None:
    assert client.send(method, f"/{TOKEN}/floor/0/save").code in {403, 405}


def test_answers_may_not_be_framed_sniffed_or_reached_from_elsewhere(client: Client) -> None:
    headers = client.get("").headers
    assert "default-src 'none'" in headers["content-security-policy"]
    assert "unsafe" not in headers["content-security-policy"]
    assert headers["x-frame-options"] == "DENY"
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert "access-control-allow-origin" not in headers


def test_many_requests_at_once_are_all_answered(client: Client) -> None:
    codes: list[int] = []

    def ask() -> None:
        codes.extend(client.post("plan", QUERY).code for _ in range(5))

    threads = [threading.Thread(target=ask) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert codes == [200] * 40
