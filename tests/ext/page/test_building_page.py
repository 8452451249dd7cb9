"""The page of a building in a browser: floors, routes over them, closures, names."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import hybridnav as hn
from tests.ext.page.browser import WINDOW, Shown
from tests.ext.page.server import Client


@pytest.fixture
def shown(browser: Any, building: Client) -> Iterator[Shown]:
    """The page of the building; nothing on it may fail."""
    context = browser.new_context(**WINDOW)
    shown = Shown(context, building.address)
    yield shown
    assert shown.errors == []
    assert all(url.startswith((building.address, "blob:", "data:")) for url in shown.requests)
    context.close()


def _to_floor(shown: Shown, number: int, name: str) -> None:
    shown.page.select_option("#floor", str(number))
    shown.wait_text("#facts", f"Floor {name}")
    shown.wait_painted()


def _planned(shown: Shown) -> None:
    shown.click(20.5, 40.5)
    _to_floor(shown, 1, "2: upper")
    shown.click(60.5, 8.5)
    shown.wait_plan(1)


def test_start_and_goal_on_different_floors(shown: Shown, folder: Path) -> None:
    _planned(shown)
    own = hn.ext.fleet.load_building(folder / "building.yaml", robot_radius_m=0.2)
    ends = []
    for number, point in ((0, (40.5, 20.5)), (1, (8.5, 60.5))):
        floor = own.floors[number]
        at = floor.planner.grid.frame.points_of_grid([point])[0]
        ends.append((floor.name, tuple(at.tolist())))
    plan = own.plan(*ends)
    assert shown.length_m == pytest.approx(plan.length_m, abs=0.05)  # clicks fall on pixels
    figures = shown.text("#figures")
    for text in (f"{plan.cost:.1f}", plan.rides[0].link.name, "ground to 2: upper", "optimal"):
        assert text in figures
    assert "charged" in figures
    assert "2: upper" in shown.text("#words")
    assert shown.text("#way").startswith("floor ground → ")
    assert shown.page.input_value("#goal").startswith("2: upper: ")
    options = shown.page.locator("#floor option").all_inner_texts()
    assert options == ["2: upper (B)", "ground (A)"]  # as in a house
    shown.page.click("#optimum")
    shown.wait_text("#figures", "on the cells of the whole grid")


@pytest.mark.full
def test_the_route_is_drawn_on_each_floor(shown: Shown, building: Client) -> None:
    _planned(shown)
    query = {
        "start": {"floor": 0, "point": [20.5, 40.5]},
        "goal": {"floor": 1, "point": [60.5, 8.5]},
        "preset": "shortest",
    }
    parts = building.post("plan", query).value["parts"]
    red = (0xC4, 0x12, 0x2F)
    shown.page.uncheck("#show-names")
    shown.page.uncheck("#show-doors")
    for part in reversed(parts):
        name = ["ground", "2: upper"][part["floor"]]
        if part["floor"] == 0:
            _to_floor(shown, 0, name)
        shown.wait_painted()
        (x, y), (to_x, to_y) = part["line"][:2]
        assert shown.colour((x + to_x) / 2, (y + to_y) / 2) == red


@pytest.mark.full
def test_the_floor_is_chosen_by_keys_and_buttons(shown: Shown) -> None:
    assert shown.page.locator("#floor-down").is_disabled()
    shown.page.focus("#map")
    shown.page.keyboard.press("PageUp")
    shown.wait_text("#facts", "Floor 2: upper")
    shown.page.keyboard.press("PageUp")  # there is none
    shown.wait_painted()
    assert "Floor 2: upper" in shown.text("#facts")
    shown.page.click("#floor-down")
    shown.wait_text("#facts", "Floor ground")
    shown.wait_painted()
    view = shown.fact("view")
    shown.page.click("#zoom-in")
    shown.wait(f"document.getElementById('map').dataset.view !== '{view}'")
    zoomed = shown.fact("view")
    shown.page.click("#floor-up")
    shown.wait_text("#facts", "Floor 2: upper")
    shown.page.click("#floor-down")
    shown.wait_text("#facts", "Floor ground")
    shown.wait(f"document.getElementById('map').dataset.view === '{zoomed}'")  # as it was left


@pytest.mark.full
def test_typed_ends_name_their_floor(shown: Shown) -> None:
    _planned(shown)
    typed = [shown.page.input_value(f"#{end}") for end in ("start", "goal")]
    before = shown.length_m
    shown.page.click("#clear")
    for end, text in zip(("start", "goal"), typed, strict=True):
        shown.page.fill(f"#{end}", text)
    shown.page.click("#ends button[type=submit]")
    shown.wait_plan(2)
    assert shown.length_m == pytest.approx(before, abs=0.02)
    shown.page.fill("#start", "cellar: 1, 2")
    shown.page.keyboard.press("Enter")
    shown.wait_text("#status", "the name of a floor")


@pytest.mark.full
def test_links_are_closed_by_a_click_and_by_the_list(shown: Shown, building: Client) -> None:
    _planned(shown)
    links = {link["name"]: link for link in building.get("map.json").value["links"]}
    figures = shown.text("#figures")
    taken = "lift" if "lift, floor" in figures else "stairs"
    other = {"lift": "stairs", "stairs": "lift"}[taken]
    shown.mode("close")
    shown.click(*links[taken]["ends"][1]["at"])
    shown.wait_plan(2)
    assert taken in shown.text("#closed")
    assert f"{other}, floor" in shown.text("#figures")
    assert "more than" in shown.text("#figures")
    shown.page.select_option("#close-link", other)
    shown.wait_text("#status", "No route")
    shown.page.click("#close-clear")
    shown.wait("document.querySelector('#closed').textContent === ''")
    shown.click(60, 40)  # the room f, on this floor alone
    shown.wait_text("#closed", "f, floor 2: upper")
    shown.page.click("#close-undo")
    shown.wait("document.querySelector('#closed').textContent === ''")
    shown.page.uncheck("#stairs")
    shown.wait_text("#figures", "lift, floor")


@pytest.mark.full
def test_alternatives_take_other_links(shown: Shown) -> None:
    _planned(shown)
    shown.page.click("#alternatives")
    shown.page.wait_for_selector(".route-card")
    cards = shown.page.locator(".route-card")
    assert sorted(card.split("\n")[-1] for card in cards.all_inner_texts()) == [
        "by lift",
        "by stairs",
    ]
    cards.nth(1).click()
    assert "more" in cards.nth(1).inner_text()


@pytest.mark.full
def test_an_end_is_dragged_on_its_floor(shown: Shown) -> None:
    _planned(shown)
    before = shown.length_m
    x, y = shown.at(60.5, 8.5)
    shown.page.mouse.move(x, y)
    shown.page.mouse.down()
    for step in range(1, 6):
        shown.page.mouse.move(x, y - 4 * step)
        shown.wait(f"document.getElementById('map').dataset.plans >= {1 + step}")
    shown.page.mouse.up()
    shown.wait_plan(7)
    assert shown.length_m != before


@pytest.mark.full
def test_rooms_of_a_floor_are_named_and_saved(shown: Shown, folder: Path) -> None:
    ground = (folder / "rooms.yaml").read_bytes()
    _to_floor(shown, 1, "2: upper")
    shown.mode("names")
    shown.click(20, 10)
    shown.wait("document.getElementById('room-name').value === 'g'")
    shown.page.fill("#room-name", "attic")
    shown.page.keyboard.press("Enter")
    shown.wait_text("#unsaved", "1 change is not saved")
    _to_floor(shown, 0, "ground")
    assert shown.text("#unsaved") == ""
    assert "attic" not in shown.page.locator("#room").inner_text()
    _to_floor(shown, 1, "2: upper")
    shown.wait_text("#unsaved", "1 change is not saved")
    shown.page.click("#save")
    shown.wait_text("#unsaved", "saved to rooms-2.yaml")
    assert (folder / "rooms.yaml").read_bytes() == ground
    assert "attic" in (folder / "more" / "rooms-2.yaml").read_text("utf-8")


@pytest.mark.full
def test_a_saved_page_has_all_floors(cli, building, folder, browser):
    del building  # has written the files
    out = folder.parent / "page.html"
    own = hn.ext.fleet.load_building(folder / "building.yaml", robot_radius_m=0.2)
    points = []
    for floor, name in zip(own.floors, ("a", "h"), strict=True):
        x, y = floor.planner.topology.rooms.point_of(name)
        points.append(f"{floor.name}:{x:.2f},{y:.2f}")
    done = cli(
        *("view", folder / "building.yaml", "--robot-radius", 0.2, "--save", out),
        *("--route", ":".join(points), "--route", ":".join(reversed(points))),
    )
    assert (done.code, done.err) == (0, "")
    assert "2 floors" in done.out
    context = browser.new_context(**WINDOW, offline=True)
    shown = Shown(context, out.as_uri())
    assert "optimal" in shown.text("#figures")
    assert shown.page.locator(".route-card").count() == 2
    _to_floor(shown, 1, "2: upper")
    assert "h" in [
        room["name"]
        for room in shown.page.evaluate(
            "JSON.parse(document.getElementById('saved').textContent).floors[1].map.rooms.rooms"
        )
    ]
    shown.page.select_option("#colours", "level")
    shown.page.check("#show-graph")
    shown.wait("document.getElementById('map').dataset.waiting === '0'")
    assert not shown.page.locator("#rename").is_visible()
    assert shown.errors == []
    assert all(url.startswith(("file:", "data:")) for url in shown.requests)
    context.close()
