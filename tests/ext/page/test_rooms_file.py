"""Names that people have typed survive two tabs, a killed server and a full disk."""

import errno
import json
import os
import signal
import subprocess
import sys
import time
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridnav as hn
from hybridnav.ext.page import Session
from hybridnav.ext.page.kept import RoomsFile
from hybridnav.ext.page.requests import Edit
from tests.ext.page.server import Client, session_of


def _rename(client: Client, version: int, room: str, name: str) -> Any:
    change = {"op": "rename", "room": room, "name": name}
    return client.post("floor/0/edit", {"version": version, "change": change})


def test_saved_rooms_are_those_of_the_page(client: Client, folder: Path) -> None:
    assert _rename(client, 0, "a", "kitchen").value["unsaved"] == 1
    assert (folder / ".rooms.yaml.edits").exists()
    found = client.post("floor/0/save", {"version": 1}).value
    assert (found["unsaved"], found["notice"]) == (0, "saved to rooms.yaml")
    read = hn.load_rooms(folder / "rooms.yaml", client.session.grid)
    grid, shown = client.session.grid, client.session.rooms
    for x, y in grid.frame.points_of(np.argwhere(grid.measured == hn.CellClass.FREE)).tolist():
        assert read.at((x, y), grid) == shown.at((x, y), grid)
    assert set(read.names) == {"kitchen", "b", "c", "d"}
    assert not (folder / ".rooms.yaml.edits").exists()


def test_of_two_tabs_the_later_one_is_told(client: Client) -> None:
    assert _rename(client, 0, "a", "kitchen").code == 200
    assert _rename(client, 0, "b", "hall").code == 409
    assert client.post("floor/0/undo", {"version": 0}).code == 409
    assert client.post("floor/0/save", {"version": 0}).code == 409
    assert _rename(client, 1, "b", "hall").code == 200
    assert list(client.session.rooms.names) == ["kitchen", "hall", "c", "d"]


def test_undo_goes_back_change_by_change(client: Client) -> None:
    _rename(client, 0, "a", "kitchen")
    client.post(
        "floor/0/edit", {"version": 1, "change": {"op": "merge", "room": "c", "other": "d"}}
    )
    assert list(client.session.rooms.names) == ["kitchen", "b", "c"]
    client.post("floor/0/undo", {"version": 2})
    assert list(client.session.rooms.names) == ["kitchen", "b", "c", "d"]
    client.post("floor/0/undo", {"version": 3})
    assert list(client.session.rooms.names) == ["a", "b", "c", "d"]
    assert client.post("floor/0/undo", {"version": 4}).code == 422


def test_a_file_that_others_changed_is_not_written_over_unasked(client, folder):
    _rename(client, 0, "a", "kitchen")
    text = (folder / "rooms.yaml").read_text(encoding="utf-8").replace("name: d", "name: attic")
    (folder / "rooms.yaml").write_text(text, encoding="utf-8")
    refused = client.post("floor/0/save", {"version": 1})
    assert (refused.code, "changed by another program" in refused.value["error"]) == (409, True)
    assert (folder / "rooms.yaml").read_text(encoding="utf-8") == text
    assert client.post("floor/0/save", {"version": 1, "replace": True}).code == 200


def test_a_full_disk_loses_neither_the_file_nor_the_names(client, folder, monkeypatch):
    before = (folder / "rooms.yaml").read_bytes()

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr("hybridnav._base.files._write", full)
    found = _rename(client, 0, "a", "kitchen")
    assert (found.code, "No space left" in found.value["notice"]) == (200, True)
    assert client.post("floor/0/save", {"version": 1}).code == 507
    assert list(client.session.rooms.names) == ["kitchen", "b", "c", "d"]
    assert (folder / "rooms.yaml").read_bytes() == before
    monkeypatch.undo()
    assert client.post("floor/0/save", {"version": 1}).code == 200
    assert "kitchen" in (folder / "rooms.yaml").read_text(encoding="utf-8")


def _asked(host: str, method: str, path: str, body: bytes | None = None) -> tuple[int, bytes]:
    connection = HTTPConnection(host, timeout=60)
    connection.request(method, path, body, {"content-type": "application/json"})
    response = connection.getresponse()
    found = response.status, response.read()
    connection.close()
    return found


def _wait_until_ready(host: str, token: str) -> None:
    ends_at = time.monotonic() + 60
    while not json.loads(_asked(host, "GET", f"/{token}/state.json")[1])["ready"]:
        assert time.monotonic() < ends_at
        time.sleep(0.05)


def test_a_killed_server_loses_no_names(folder: Path) -> None:
    command = [sys.executable, "-m", "hybridnav", "view", str(folder / "four.yaml")]
    settings = ["--no-browser", "--robot-radius", "0.2"]
    with subprocess.Popen([*command, *settings], stdout=subprocess.PIPE, text=True) as server:
        try:
            address = server.stdout.readline().split()[1]
            host, token = address.removeprefix("http://").rstrip("/").split("/")
            _wait_until_ready(host, token)
            body = b'{"version": 0, "change": {"op": "rename", "room": "a", "name": "kitchen"}}'
            assert _asked(host, "POST", f"/{token}/floor/0/edit", body)[0] == 200
        finally:
            server.send_signal(signal.SIGKILL)
    session = session_of(folder / "four.yaml")
    assert session.rooms.names == ("kitchen", "b", "c", "d")
    assert session.notice == "unsaved changes of rooms are back: 1"


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "null", '{"changes": 3}', '{"changes": [1, null, {"op": "x"}]}', "[" * 9999],
)
def test_a_journal_that_makes_no_sense_is_no_obstacle(folder: Path, text: str) -> None:
    (folder / ".rooms.yaml.edits").write_text(text, encoding="utf-8")
    assert session_of(folder / "four.yaml").rooms.names == ("a", "b", "c", "d")


def test_links_out_of_the_folder_are_not_followed(folder: Path) -> None:
    outside = folder.parent / "outside.yaml"
    (folder / "rooms.yaml").rename(outside)
    (folder / "rooms.cells.png").rename(outside.with_name("rooms.cells.png"))
    (folder / "rooms.yaml").symlink_to(outside)
    with pytest.raises(hn.errors.RoomsError, match="leads out of"):
        session_of(folder / "four.yaml")


def test_a_link_made_later_is_not_followed_either(client: Client, folder: Path) -> None:
    victim = folder.parent / "victim.yaml"
    victim.write_text("precious", encoding="utf-8")
    (folder / "rooms.yaml").unlink()
    (folder / "rooms.yaml").symlink_to(victim)
    (folder / ".rooms.yaml.edits").symlink_to(victim)
    codes = [
        _rename(client, 0, "a", "kitchen").code,
        client.post("floor/0/save", {"version": 0}).code,
    ]
    assert all(code >= 400 for code in codes)
    assert victim.read_text(encoding="utf-8") == "precious"


def test_an_image_of_cells_that_is_a_link_is_not_followed(client: Client, folder: Path) -> None:
    victim = folder.parent / "victim.png"
    victim.write_text("precious", encoding="utf-8")
    (folder / "rooms.cells.png").unlink()
    (folder / "rooms.cells.png").symlink_to(victim)
    assert _rename(client, 0, "a", "kitchen").code == 200
    assert client.post("floor/0/save", {"version": 1}).code >= 400
    assert victim.read_text(encoding="utf-8") == "precious"


def test_a_page_without_a_file_saves_nothing(folder: Path) -> None:
    session = session_of(folder / "four.yaml")
    topology = session.planning.topology
    model = hn.load(folder / "four.yaml", robot_radius_m=0.2)
    plain = Session(model, topology, model.fitted(None))
    assert plain.describe()["can_save"] is False
    assert RoomsFile(folder, "rooms.yaml").kept() == []


@pytest.mark.parametrize("known", ["saved", "found"])
def test_doors_keep_their_numbers_when_rooms_change(folder: Path, known: str) -> None:
    if known == "found":
        (folder / "rooms.yaml").unlink()  # those that are found have no numbers on file
    session = session_of(folder / "four.yaml")

    def doors() -> dict[int, list[float]]:
        return {door["number"]: door["at"] for door in session.describe_rooms()["doors"]}

    def split(room: str, line: list[list[float]], name: str) -> None:
        change = {"op": "split", "room": room, "line": line, "name": name}
        session.edit(Edit(version=session.version, change=change))

    before = doors()
    names = session.rooms.names
    for at, (x, top, bottom) in enumerate(((20, 47, 24), (20, 20, 2), (65, 20, 2))):
        split(names[(0, 2, 3)[at]], [[x, top], [x, bottom]], f"x{at}")
        now = doors()
        assert len(now) == len(before) + 1
        assert now.items() >= before.items()
        before = now


def test_a_second_save_writes_over_only_what_the_first_told_of(client, folder):
    file = folder / "rooms.yaml"

    def changed_by_others(name: str) -> str:
        text = file.read_text(encoding="utf-8").replace("name: d", f"name: {name}", 1)
        file.write_text(text, encoding="utf-8")
        return text

    _rename(client, 0, "a", "kitchen")
    text = changed_by_others("d1")
    # A conflict of another kind has told nobody of the file.
    assert client.post("floor/0/save", {"version": 0}).code == 409
    assert client.post("floor/0/save", {"version": 1, "replace": True}).code == 409
    assert file.read_text(encoding="utf-8") == text
    text = changed_by_others("d1x")
    assert client.post("floor/0/save", {"version": 1, "replace": True}).code == 409
    assert file.read_text(encoding="utf-8") == text
    assert client.post("floor/0/save", {"version": 1, "replace": True}).code == 200
    assert "kitchen" in file.read_text(encoding="utf-8")
