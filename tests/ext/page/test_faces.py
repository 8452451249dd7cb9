"""The page as staff see it, on a laptop and on a phone, in both languages."""

import itertools
import json
import re
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest

import hybridnav as hn
from tests.ext.page.browser import WINDOW, Shown
from tests.ext.page.server import Client, served, site_of, write_map

ASSETS = files("hybridnav.ext.page") / "assets"
LAPTOP = {"width": 1440, "height": 900}
PHONE = {"width": 390, "height": 844}
OTHERS = [(PHONE, "en"), (LAPTOP, "en"), (LAPTOP, "de")]
WHOLE = """(id) => {
    const box = document.getElementById(id).getBoundingClientRect();
    const top = document.elementFromPoint(box.left + 8, box.top + 8);
    return box.height > 0 && box.top >= 0 && box.bottom <= innerHeight
        && document.getElementById(id).contains(top);
}"""


def _table(language: str) -> dict[str, Any]:
    table: dict[str, Any] = json.loads((ASSETS / f"{language}.json").read_text(encoding="utf-8"))
    return table


def _opened(browser: Any, client: Client, size: Any = None, **more: Any) -> Shown:
    context = browser.new_context(**{**WINDOW, "viewport": size or LAPTOP, **more})
    return Shown(context, client.address, face="staff")


@pytest.mark.parametrize(
    ("size", "language"),
    [(PHONE, "de"), *(pytest.param(*one, marks=pytest.mark.full) for one in OTHERS)],
)
def test_from_the_entrance_to_a_ward(browser, house, folder, size, language):
    texts = _table(language)
    shown = _opened(browser, house, size, locale=language)
    shown.take("start", "ENTR")
    shown.take("goal", "ward 10")
    shown.wait_plan(1)
    assert "entrance → ward 10" in shown.text("#trip")
    words = shown.text("#words")
    assert "lift" in words
    assert "ward 10" in words
    # Seen without scrolling: the map with the route, and the words.
    for part in ("map", "trip", "figures", "words"):
        assert shown.page.evaluate(WHOLE, part), part
    colours = {shown.colour(*point) for point in _line(house)}
    assert (0xC4, 0x12, 0x2F) in colours
    # The lift is shut.
    shown.mode("close")
    shown.page.select_option("#close-link", "lift")
    shown.wait_text("#closed", texts["since"].split(" ")[0])
    shown.wait_text("#words", "stairs")
    assert [item.what for item in hn.Journal(folder / "house.yaml").items()] == ["link:lift"]
    shown.mode("route")
    assert "lift" not in shown.text("#words")
    assert texts["detour-staff"].partition(" ")[2] in shown.text("#figures")
    # A room is named, and it shows that saving works.
    shown.mode("names")
    shown.page.select_option("#room", "office 10")
    shown.page.fill("#room-name", "chapel")
    shown.page.keyboard.press("Enter")
    shown.wait_text("#unsaved", texts["unsaved-1"])
    shown.page.click("#save")
    shown.page.wait_for_selector("#status.done")
    assert shown.text("#status") in {"Saved to rooms.yaml", "Gespeichert in rooms.yaml"}
    assert shown.page.evaluate(WHOLE, "status")
    assert "chapel" in (folder / "rooms.yaml").read_text("utf-8")
    assert shown.errors == []
    shown.page.context.close()


def _line(house: Client) -> list[list[float]]:
    """Return points between the ends of the first part of the way."""
    ends = [
        {"floor": floor, **house.post(f"floor/{floor}/stand", {"name": name}).value}
        for floor, name in ((0, "entrance"), (2, "ward 10"))
    ]
    start, goal = ({key: end[key] for key in ("floor", "point", "name")} for end in ends)
    asked = {"start": start, "goal": goal, "preset": "shortest"}
    line = house.post("plan", asked).value["parts"][0]["line"]
    return [
        [x + share * (u - x), y + share * (v - y)]
        for (x, y), (u, v) in itertools.pairwise(line)
        for share in (0.3, 0.5, 0.7)
    ]


def test_staff_see_no_words_of_robots(browser: Any, house: Client) -> None:
    shown = _opened(browser, house)
    shown.take("start", "entrance")
    shown.take("goal", "ward 2")
    shown.wait_plan(1)
    for mode in ("route", "close", "names"):
        shown.mode(mode)
        seen = shown.text("body").lower()
        for word in ("gap", "bound", "preset", "places and arcs", "grid", "cells", "nav2", "cost"):
            assert word not in seen, (mode, word)
    shown.page.select_option("#face", "robot")
    seen = shown.text("body").lower()
    assert all(word in seen for word in ("gap", "bound", "preset", "places and arcs", "nav2"))


def test_face_and_language_are_remembered_in_the_address(browser: Any, house: Client) -> None:
    shown = _opened(browser, house, locale="de-AT")
    assert shown.text("#ends button[type=submit]") == "Weg zeigen"
    assert shown.page.locator("html").get_attribute("lang") == "de"
    shown.take("start", "entrance")
    shown.take("goal", "KUCHE")
    shown.wait_plan(1)
    assert "Lift" in shown.text("#words") or "Aufzug" in shown.text("#words")
    shown.page.select_option("#language", "en")
    shown.wait_text("#words", "take the lift")
    shown.page.select_option("#face", "robot")
    shown.page.reload()
    shown.page.wait_for_selector("canvas[data-ready=true]")
    assert shown.page.locator("#optimum").is_visible()
    assert shown.text("#ends button[type=submit]") == "Show the way"
    other = Shown(shown.page.context, shown.page.url)
    assert other.page.locator("#optimum").is_visible()
    assert shown.errors == other.errors == []


@pytest.mark.full
def test_what_the_server_says_is_said_in_german(browser: Any, house: Client) -> None:
    shown = _opened(browser, house, locale="de-DE")
    shown.mode("names")
    shown.page.select_option("#room", "entrance")
    shown.page.fill("#room-name", "lobby")
    shown.page.keyboard.press("Enter")
    shown.wait_text("#status", "Ein anderer Raum heißt 'lobby': beide vereinen")
    shown.page.fill("#room-name", "Eingang")
    shown.page.keyboard.press("Enter")
    shown.wait_text("#unsaved", "1 Änderung ist nicht gespeichert")
    shown.page.click("#save")
    shown.wait_text("#status", "Gespeichert in rooms.yaml")


@pytest.mark.full
def test_a_line_of_the_words_lights_its_door_and_the_other_way_round(browser, house):
    shown = _opened(browser, house)
    shown.take("start", "entrance")
    shown.take("goal", "office 10")
    shown.wait_plan(1)
    lines = shown.page.locator("#words button")
    texts = lines.all_inner_texts()
    doors = house.get("floor/0/rooms.json").value["doors"]
    at, number = next(
        (at, int(found[1]))
        for at, text in enumerate(texts)
        if (found := re.search(r"door (\d+)", text))
    )
    lines.nth(at).hover()
    shown.wait(f"document.getElementById('map').dataset.lit === '{at} {number}'")
    position = next(door["at"] for door in doors if door["number"] == number)
    shown.page.mouse.move(5, 400)
    shown.wait("document.getElementById('map').dataset.lit === ''")
    shown.page.mouse.move(*shown.at(*position))
    shown.wait_text("#words .lit", f"door {number}")
    shown.click(*position)  # which is no new start
    assert "entrance" in shown.text("#trip")


@pytest.mark.full
def test_a_line_on_another_floor_shows_that_floor(browser: Any, house: Client) -> None:
    shown = _opened(browser, house)
    shown.take("start", "entrance")
    shown.take("goal", "ward 10")
    shown.wait_plan(1)
    shown.page.locator("#words button").last.click()
    shown.wait_text("#facts", "Floor 2")


def test_a_click_on_a_chair_means_its_room(browser: Any, wards: Path) -> None:
    with served(site_of(wards / "four.yaml"), wards) as client:
        shown = _opened(browser, client)
        shown.click(17.0, 36.2)
        shown.wait("document.getElementById('start').value === 'Küche'")
        assert "Küche: the nearest spot that is free" in shown.text("#status")
        shown.click(70, 10)
        shown.wait_plan(1)
        assert shown.length_m > 10
        shown.page.click("#clear")
        shown.page.select_option("#face", "robot")
        shown.click(17.0, 36.2)  # a robot stands where it is put
        shown.click(70, 10)
        shown.wait_text("#status", "No route: start occupied")
        shown.page.context.close()


@pytest.mark.full
def test_lists_have_ward_2_before_ward_10(browser: Any, wards: Path) -> None:
    with served(site_of(wards / "four.yaml"), wards) as client:
        shown = _opened(browser, client)
        rooms = shown.page.locator("#room option").all_inner_texts()
        assert rooms[1:] == ["Küche", "ward 1", "Ward 2", "ward 10"]
        shown.page.fill("#start", "nowhere")
        shown.page.keyboard.press("Enter")
        shown.wait_text("#status", "No room is called “nowhere”")
        shown.take("start", "Ward 10")
        shown.page.click("#start-star")
        shown.wait_text("#status", "Ward 10 is a favourite")
        shown.page.click("#clear")
        shown.page.click("#goal")
        shown.page.wait_for_selector("#goal-list li")
        shown.wait_text("#goal-list li", "★ ward 10")
        shown.page.keyboard.press("ArrowDown")
        shown.page.keyboard.press("Enter")
        shown.wait("document.getElementById('goal').value === 'ward 10'")
        assert shown.page.locator("#goal-star").get_attribute("aria-pressed") == "true"
        assert shown.errors == []


@pytest.mark.parametrize("size", [PHONE, pytest.param(LAPTOP, marks=pytest.mark.full)])
def test_names_stay_inside_of_their_rooms_or_are_left_out(browser, folder, size):
    names = ("a name that is far too long for a room of nine metres", "ward 2", "ward 10", "d")
    write_map(folder, rooms=names)
    grid = hn.load_map(folder / "four.yaml", robot_radius_m=0.2)
    label_of = hn.load_rooms(folder / "rooms.yaml", grid).label_of
    with served(site_of(folder / "four.yaml"), folder) as client:
        shown = _opened(browser, client, size)
        for zoom in range(4):
            shown.wait_painted()
            placed = json.loads(shown.fact("names"))
            found = {name for name, *_ in placed}
            assert {"ward 2", "ward 10", "d"} <= found or zoom
            x, y, scale = map(float, shown.fact("view").split())
            box = shown.page.locator("#map").bounding_box()
            for name, left, top, right, bottom in placed:
                assert left >= 0
                assert right <= box["width"]
                for across in (left + 4, right - 4):
                    for down in (top + 4, bottom - 4):
                        col = x + (across - box["width"] / 2) / scale
                        row = y - (down - box["height"] / 2) / scale
                        assert names[label_of[int(row), int(col)]] == name
            shown.page.click("#zoom-in")
        shown.page.context.close()


def test_doors_have_numbers_where_they_can_be_read(browser: Any, client: Client) -> None:
    shown = _opened(browser, client)
    door = client.get("floor/0/rooms.json").value["doors"][0]
    blue = (0x0B, 0x5C, 0xAD)

    def has_number() -> bool:
        shown.wait_painted()
        scale = float(shown.fact("view").split()[2])
        reach = range(-22, 23)
        at = [
            (door["at"][0] + dx / scale, door["at"][1] + dy / scale)
            for dx in reach
            for dy in (7, 8, 9)
        ]
        return blue in {shown.colour(*point) for point in at}

    assert has_number()
    for _ in range(6):
        shown.page.click("#zoom-out")
    assert not has_number()


# --- tables of texts


def test_the_languages_say_the_same_things() -> None:
    english, german = _table("en"), _table("de")
    assert english.keys() == german.keys()
    for key in english.keys() - {"server"}:
        holes = [sorted(re.findall(r"\{\d\}", table[key])) for table in (english, german)]
        assert holes[0] == holes[1], key
    assert english["server"] == []
    for pattern, _ in german["server"]:
        re.compile(pattern)


def test_every_text_of_the_page_stands_in_the_tables() -> None:
    table = _table("en")
    html = (ASSETS / "page.html").read_text(encoding="utf-8")
    used = set(re.findall(r'data-(?:text|label|placeholder|empty)="([^"]*)"', html))
    modules = [each for each in ASSETS.iterdir() if each.name.endswith(".js")]
    code = "\n".join(each.read_text(encoding="utf-8") for each in modules)
    used |= set(re.findall(r'\bt\(\s*"([^"]+)"', code))
    assert used <= table.keys()
    words = {text for text in re.findall(r">([^<>]+)<", html) if re.search(r"[A-Za-z]{2}", text)}
    assert {text.strip() for text in words} == {"hybridnav", "&minus;"}
    assert not re.findall(r'say\(["`]\w', code)
    unused = {
        key
        for key in table.keys() - used
        if f'"{key}"' not in code
        and not re.match(r"shape-|level-|profile-|named-robot|own-name|server", key)
    }
    assert unused <= {"lift", "stairs", "ramp", "any-angle", "octile"}


@pytest.mark.parametrize(
    ("message", "expected"),
    [
        ("start occupied", "Start ist nicht frei"),
        ("no path", "es führt keiner hin"),
        ("preparing routes, 40 %", "Wege werden vorbereitet, 40 %"),
        (
            "profile wheelchair forbids every route: the way is by stairs (east stairs)",
            "so ist keiner erlaubt. Es gibt einen über Treppen (east stairs)",
        ),
        (
            (
                "profile a forbids every route: the way is by private rooms (x) and stairs, or by "
                "places less than 1.00 m wide (door 3, 0.80 m wide)"
            ),
            (
                "so ist keiner erlaubt. Es gibt einen über private Räume (x) und Treppen, oder "
                "über Stellen unter 1.00 m Breite (Tür 3, 0.80 m breit)"
            ),
        ),
        ("the line does not cut 'a' in two", "die Linie teilt 'a' nicht"),
        (
            "door 3 joins a and b, and leads into no 'c': name the room that it leads into",
            "Tür 3 führt nicht nach c",
        ),
    ],
)
def test_german_has_words_for_what_the_server_says(message: str, expected: str) -> None:
    for pattern, words in _table("de")["server"]:
        message = re.sub(pattern, words.replace("$", "\\"), message, count=1)
    assert message == expected
