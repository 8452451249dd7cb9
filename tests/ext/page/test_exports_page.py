"""Each export button, from the click to a file that others read; what fails is said on the page."""

import csv
import errno
import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from PIL import Image

import hybridnav as hn
from tests.ext.page.browser import WINDOW, Shown
from tests.ext.page.server import Client, query_of

QUERY = query_of([10.5, 40.5], [70.5, 10.5])
KINDS = ("path-geojson", "path-csv", "nav2", "rooms", "model")


def _request(kind: str) -> tuple[str, Any]:
    """Return the address of a file, and what is sent to it."""
    above = "floor/0/" if kind in {"nav2", "rooms"} else ""
    return f"{above}export/{kind}", QUERY | {"floor": 0} if kind.startswith("path") else None


def test_rooms_as_geojson_are_the_rooms(client: Client) -> None:
    found = json.loads(client.post("floor/0/export/rooms", None).body)
    grid, labels = client.session.grid, client.session.rooms
    areas = {
        each["properties"]["room"]: shapely.geometry.shape(each["geometry"])
        for each in found["features"]
        if each["properties"]["feature"] == "room"
    }
    assert set(areas) == {"a", "b", "c", "d"}
    cells = np.argwhere(grid.measured == hn.CellClass.FREE)[::7]
    for x, y in grid.frame.points_of(cells).tolist():
        name = labels.at((x, y), grid)
        assert name is not None
        assert areas[name].distance(shapely.Point(x, y)) <= 0.1
    doors = [f["properties"] for f in found["features"] if "number" in f["properties"]]
    assert {tuple(sorted(door["rooms"])) for door in doors} == {
        ("a", "b"),
        ("a", "c"),
        ("b", "d"),
        ("c", "d"),
    }


@pytest.mark.parametrize("kind", KINDS)
def test_a_full_disk_is_one_line(client, folder, kind, monkeypatch):
    before = sorted(file.name for file in folder.iterdir())
    name, value = _request(kind)

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr("hybridnav._base.files._write", full)
        answer = client.post(name, value)
    assert answer.code == 507
    assert "No space left" in answer.value["error"]
    assert answer.value["error"].isprintable()
    assert str(folder) not in answer.value["error"]
    assert sorted(file.name for file in folder.iterdir()) == before
    assert client.post(name, value).code == 200


@pytest.mark.parametrize("kind", KINDS)
def test_a_folder_that_cannot_be_written_is_one_line(client, kind, monkeypatch):
    def refused(*_: object, **__: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS))

    monkeypatch.setattr("tempfile._os.mkdir", refused)
    answer = client.post(*_request(kind))
    assert answer.code == 507
    assert "the folder maps takes no files: Read-only file system" in answer.value["error"]
    assert answer.value["error"].isprintable()


# --- in a browser


@pytest.fixture
def shown(browser: Any, client: Client) -> Iterator[Shown]:
    """The page of four rooms with a route."""
    context = browser.new_context(**WINDOW)
    shown = Shown(context, client.address)
    yield shown
    assert shown.errors == []
    context.close()


def _downloaded(shown: Shown, button: str, folder: Path) -> Path:
    with shown.page.expect_download() as begun:
        shown.page.click(button)
    file = folder / str(begun.value.suggested_filename)
    begun.value.save_as(file)
    return file


@pytest.mark.full
def test_every_button_hands_out_a_file_that_others_read(shown, client, tmp_path):
    shown.page.click("[data-export=path-csv]")
    shown.wait_text("#status", "Set a start and a goal first")
    shown.click(10.5, 40.5)
    shown.click(70.5, 10.5)
    shown.wait_plan(1)
    got = tmp_path / "got"
    got.mkdir()
    picture = _downloaded(shown, "#export-png", got)
    assert picture.name == "four.png"
    with Image.open(picture) as opened:
        pixels = np.asarray(opened.convert("RGB"))
    assert pixels.shape[1] > 900
    assert len(np.unique(pixels[::20, ::20].reshape(-1, 3), axis=0)) > 5
    line = json.loads(_downloaded(shown, "[data-export=path-geojson]", got).read_text("utf-8"))
    path = shapely.geometry.shape(line["features"][0]["geometry"])
    assert path.length == pytest.approx(shown.length_m, abs=1e-3)
    with _downloaded(shown, "[data-export=path-csv]", got).open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert (float(rows[0]["x"]), float(rows[0]["y"])) == pytest.approx(path.coords[0])
    assert (float(rows[-1]["x"]), float(rows[-1]["y"])) == pytest.approx(path.coords[-1])
    graph = json.loads(_downloaded(shown, "[data-export=nav2]", got).read_text("utf-8"))
    kinds = {feature["geometry"]["type"] for feature in graph["features"]}
    assert "Point" in kinds
    assert kinds & {"LineString", "MultiLineString"}
    rooms = json.loads(_downloaded(shown, "[data-export=rooms]", got).read_text("utf-8"))
    names = {each["properties"].get("room") for each in rooms["features"]}
    assert {"a", "b", "c", "d"} <= names
    model = hn.load(_downloaded(shown, "[data-export=model]", got))
    assert model.rooms.names == client.session.rooms.names
    assert shown.text("#status") == ""


@pytest.mark.full
def test_what_cannot_be_written_is_said_and_nothing_is_lost(shown, client, monkeypatch, tmp_path):
    shown.click(10.5, 40.5)
    shown.click(70.5, 10.5)
    shown.wait_plan(1)
    shown.page.select_option("#room", "a")
    shown.page.fill("#room-name", "kitchen")
    shown.page.click("#rename button")
    shown.wait_text("#unsaved", "1 change")
    shown.wait_plan(2)  # with the new name; an answer clears the line of what is said
    length_m = shown.length_m

    def full(*_: object, **__: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr("hybridnav._base.files._write", full)
        for kind in KINDS:
            shown.page.click(f"[data-export={kind}]")
            shown.wait_text("#status", "No space left")
            assert "\n" not in shown.text("#status")
            shown.page.click("#zoom-in")  # the page goes on
        shown.page.click("#save")
        shown.wait_text("#status", "No space left")
    assert (shown.length_m, client.session.rooms.names[0]) == (length_m, "kitchen")
    assert "1 change" in shown.text("#unsaved")
    for kind in KINDS:
        _downloaded(shown, f"[data-export={kind}]", tmp_path)
