"""The page as one file: it opens by double click and asks nobody for anything."""

import io
import json
import re
from base64 import b64decode
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import hybridnav as hn
from tests.ext.page.browser import Shown, browsing


def _save(cli: Any, folder: Path, *more: object) -> Any:
    out = folder.parent / "page.html"
    settings = ("--robot-radius", "0.2", "--save", out, *more)
    return cli("view", folder / "four.yaml", *settings), out


def _data(out: Path) -> Any:
    found = re.search(
        r'<script type="application/json" id="saved">(.*?)</script>', out.read_text("utf-8")
    )
    assert found is not None
    return json.loads(found[1])


def test_the_file_holds_the_map_the_rooms_and_the_routes(cli: Any, folder: Path) -> None:
    done, out = _save(cli, folder, "--route", "0,4:9,12", "--route", "9,12:0,4")
    assert (done.code, done.err) == (0, "")
    assert "18 routes" in done.out  # 4 x 4 between the rooms, and these two
    data = _data(out)
    assert [room["name"] for room in data["floors"][0]["map"]["rooms"]["rooms"]] == [
        "a",
        "b",
        "c",
        "d",
    ]
    planned = [
        cli("plan", folder / "four.yaml", "--robot-radius", 0.2, *ends, "--json").answer
        for ends in (("--start", "0,4", "--goal", "9,12"), ("--start", "9,12", "--goal", "0,4"))
    ]
    lengths = [route["length_m"] for route in data["routes"]]
    assert lengths == pytest.approx([plan["length_m"] for plan in planned])


def test_the_file_has_all_ways_between_rooms_and_a_proof_for_each_start(cli, folder):
    data = _data(_save(cli, folder)[1])
    (floor,), matrix = data["floors"], data["matrix"]
    names = [end["name"] for end in data["ends"]]
    assert sorted(names) == ["a", "b", "c", "d"]
    grid = hn.load_map(folder / "four.yaml", robot_radius_m=0.2)
    points = [grid.frame.points_of_grid(end["point"][::-1]) for end in data["ends"]]
    for number, row in enumerate(matrix):
        for at, route in enumerate(row):
            cost = hn.plan(grid, points[number], points[at]).cost
            assert route["length_m"] == pytest.approx(cost, abs=1e-6)
            first = [route["words"][language][0]["text"] for language in ("en", "de")]
            assert all(names[number] in text for text in first)
            assert first[0] != first[1]
        most, goal = floor["heights"][str(number)]
        proved = hn.plan(grid, points[number], points[names.index(goal)], preset="octile").cost
        assert most == pytest.approx(proved, abs=0.1)
        tile = floor["tiles"][f"heights-{number}"]["found"]["light/0/0/0"]
        drawn = np.array(Image.open(io.BytesIO(b64decode(tile.partition(",")[2]))))
        assert {*np.unique(drawn[..., 3])} == {0, 255}
        at_col, at_row = map(int, data["ends"][number]["point"])
        assert tuple(drawn[at_row, at_col, :3]) == (68, 1, 84)  # the dark end of viridis
    assert data["routes"][0]["length_m"] == max(each["length_m"] for row in matrix for each in row)


@pytest.mark.full
def test_the_office_with_all_its_routes_stays_below_three_megabytes(cli, tmp_path):
    office, out = Path(__file__).parents[3] / "maps/office/office.yaml", tmp_path / "office.html"
    cli("view", office, "--robot-radius", 0.25, "--save", out)
    assert len(_data(out)["matrix"]) == 21
    assert out.stat().st_size < 3e6


def test_the_file_names_no_address_and_holds_no_path(cli: Any, folder: Path) -> None:
    _, out = _save(cli, folder)
    text = out.read_text("utf-8")
    assert not re.search(r"(src|href)=\"(?!data:)", text)
    assert "import " not in text.split('type="module">')[1]
    assert str(folder) not in text


def test_a_name_cannot_end_the_script(cli: Any, folder: Path) -> None:
    rooms = folder / "rooms.yaml"
    text = rooms.read_text("utf-8").replace("name: a", "name: </script><b>")
    rooms.write_text(text, encoding="utf-8")
    _, out = _save(cli, folder)
    assert _data(out)["floors"][0]["map"]["rooms"]["rooms"][0]["name"] == "</script><b>"


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (("--route", "1,2"), "X,Y:X,Y"),
        (("--route", "1,2:3,inf"), "X,Y:X,Y"),
        (("--route", "1,2:3,4:5,6"), "X,Y:X,Y"),
        (("--save", "page.txt"), "must end in .html"),
    ],
)
def test_what_cannot_be_saved_is_refused(cli, folder, more, words):
    done, _ = _save(cli, folder, *more)
    assert done.refuses(2, words)


def test_routes_are_for_saved_pages(cli: Any, folder: Path) -> None:
    assert cli("view", folder / "four.yaml", "--route", "0,4:9,12").refuses(2, "--save")


@pytest.mark.full
def test_the_file_opens_in_a_browser_without_a_server(cli: Any, folder: Path) -> None:
    with browsing() as browser:
        routes = ("0,4:9,12", "9,12:0,4", "0,4:-50,-50")
        _, out = _save(cli, folder, *(part for text in routes for part in ("--route", text)))
        context = browser.new_context(viewport={"width": 1280, "height": 800}, offline=True)
        shown = Shown(context, out.as_uri())
        assert f"{_data(out)['routes'][0]['length_m']:.2f} m" in shown.text("#figures")
        assert "you are at" in shown.text("#words")
        shown.page.locator(".route-card").nth(1).click()
        assert not shown.page.locator("#rename").is_visible()
        shown.page.locator(".route-card").nth(2).click()
        assert shown.text("#status").startswith("No route: ")
        for colours in ("map", "level", "rooms"):
            shown.page.select_option("#colours", colours)
        shown.page.select_option("#theme", "dark")
        shown.page.check("#show-graph")
        shown.page.click("#zoom-in")
        shown.wait("document.getElementById('map').dataset.waiting === '0'")
        assert shown.errors == []
        assert all(url.startswith(("file:", "data:")) for url in shown.requests)


@pytest.mark.full
def test_rooms_are_typed_and_clicked_with_the_network_off(cli: Any, folder: Path) -> None:
    with browsing() as browser:
        data = _data(out := _save(cli, folder)[1])
        names = [end["name"] for end in data["ends"]]
        shown = Shown(browser.new_context(offline=True), out.as_uri(), "staff")
        assert shown.length_m == data["routes"][0]["length_m"]
        for which, text in (("start", "b"), ("goal", "C ")):
            shown.page.fill(f"#{which}", text)
            shown.page.wait_for_selector(f"#{which}-list[data-asked='{text}'] li")
            shown.page.keyboard.press("Enter")
        shown.wait_plan(1)
        route = data["matrix"][names.index("b")][names.index("c")]
        assert shown.length_m == route["length_m"]
        assert shown.text("#words").splitlines()[-1] == route["words"]["en"][-1]["text"]
        shown.page.select_option("#language", "de")
        shown.wait_text("#words", route["words"]["de"][-1]["text"])
        for which, name in (("start", "d"), ("goal", "a")):  # a click means the room around it
            col, row = data["ends"][names.index(name)]["point"]
            shown.click(col + 2, row - 2)
            shown.wait(f"document.getElementById('{which}').value === '{name}'")
        shown.wait_plan(3)  # the other language was one too
        assert shown.length_m == data["matrix"][names.index("d")][names.index("a")]["length_m"]
        shown.page.select_option("#face", "robot")
        shown.page.check("#show-heights")
        shown.wait_text("#legend", "Kein Schritt steigt mehr")
        shown.wait_painted()
        assert data["floors"][0]["heights"][str(names.index("d"))][1] in shown.text("#legend")
        shown.page.fill("#goal", "1, 2")  # no room: the file has no way to it
        shown.page.keyboard.press("Enter")
        shown.wait_text("#status", "Diese Datei hat die Wege")
        assert shown.errors == []
        assert all(url.startswith(("file:", "data:")) for url in shown.requests)


@pytest.mark.full
def test_the_whole_map_stays_in_view_when_the_window_changes(cli: Any, folder: Path) -> None:
    phone = {"width": 390, "height": 844}
    with browsing() as browser:
        _, out = _save(cli, folder)
        known = _data(out)["floors"][0]["map"]["known"]
        shown = Shown(browser.new_context(viewport={"width": 1280, "height": 800}), out.as_uri())
        shown.page.set_viewport_size(phone)
        shown.wait("document.getElementById('map').clientWidth === 390")
        shown.wait(f"{0.95 * 390} > {known[1] - known[0]} * {_SCALE}")
        fitted = float(shown.fact("view").split()[2])
        shown.page.click("#zoom-in")  # a person's own view stays
        shown.wait(f"{_SCALE} > {fitted}")
        scale = float(shown.fact("view").split()[2])
        shown.page.set_viewport_size({"width": 800, "height": 844})
        shown.wait("document.getElementById('map').clientWidth > 390")
        shown.wait("(map => map.width === map.clientWidth)(document.getElementById('map'))")
        shown.wait_painted()
        assert float(shown.fact("view").split()[2]) == scale
        assert shown.errors == []


_SCALE = "Number(document.getElementById('map').dataset.view.split(' ')[2])"
