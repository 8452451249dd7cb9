"""The page in a browser, point by point: what people see and click."""

from pathlib import Path
from typing import Any

import pytest

import hybridnav as hn
from hybridnav.ext.page.tiles import palette
from tests.ext.page.browser import Shown
from tests.ext.page.server import Client

START, GOAL = (10.5, 40.5), (70.5, 10.5)


def _planned(shown: Shown) -> None:
    shown.click(*START)
    shown.click(*GOAL)
    shown.wait_plan(1)


def test_two_clicks_show_the_route_with_its_certificate(shown: Shown, client: Client) -> None:
    _planned(shown)
    topology = client.session.planning.topology
    ends = topology.grid.frame.points_of_grid([START[::-1], GOAL[::-1]]).round(2)
    result = hn.HybridPlanner(topology).plan(*ends)
    assert shown.length_m == pytest.approx(result.cost, abs=0.03)  # clicks fall on pixels
    figures = shown.text("#figures")
    assert f"{shown.length_m:.2f} m" in figures
    assert "proved optimal" in figures
    assert "a → door" in shown.text("#way")
    assert "you are at" in shown.text("#words")
    shown.page.click("#optimum")
    shown.wait_text("#figures", "on the cells of the whole grid")
    shown.page.select_option("#preset", "paper")
    shown.wait_plan(2)
    assert "from cell to cell" in shown.text("#figures")


@pytest.mark.full
def test_typed_ends_are_planned_too(shown: Shown) -> None:
    _planned(shown)
    before, typed = shown.length_m, shown.page.input_value("#start")
    shown.page.click("#clear")
    goal = shown.page.input_value("#goal")
    assert goal == ""
    shown.page.fill("#start", typed)
    shown.page.fill("#goal", "nowhere")
    shown.page.click("#ends button[type=submit]")
    shown.wait_text("#status", "two numbers of metres")
    shown.page.fill("#goal", typed)
    shown.page.keyboard.press("Enter")
    shown.wait_plan(2)
    assert shown.length_m == pytest.approx(0, abs=1e-6)
    assert before > 10


@pytest.mark.full
def test_the_route_follows_a_dragged_end(shown: Shown) -> None:
    _planned(shown)
    x, y = shown.at(*GOAL)
    shown.page.mouse.move(x, y)
    shown.page.mouse.down()
    lengths = []
    for step in range(1, 9):
        shown.page.mouse.move(x, y - 4 * step)
        shown.wait(f"document.getElementById('map').dataset.plans >= {1 + step}")
        lengths.append(shown.length_m)
    shown.page.mouse.up()
    shown.wait_plan(10)
    assert len(set(lengths)) == len(lengths)
    assert shown.text("#words") != ""


@pytest.mark.full
def test_zoom_pan_and_levels(shown: Shown) -> None:
    whole = shown.fact("view")
    shown.page.click("#zoom-in")
    shown.wait(f"document.getElementById('map').dataset.view !== '{whole}'")
    assert float(shown.fact("view").split()[2]) == pytest.approx(1.5 * float(whole.split()[2]))
    shown.page.focus("#map")
    for key in ("+", "ArrowLeft", "ArrowUp"):
        before = shown.fact("view")
        shown.page.keyboard.press(key)
        shown.wait(f"document.getElementById('map').dataset.view !== '{before}'")
    shown.page.keyboard.press("0")
    shown.wait(f"document.getElementById('map').dataset.view === '{whole}'")
    assert shown.fact("scale-bar").endswith(" m")
    shown.page.select_option("#colours", "level")
    shown.page.check("#show-graph")
    for level in ("0", "2"):
        shown.page.fill("#level", level)
        shown.wait_text("#level-text", level)
        shown.wait_request(f"graph/{level}.json")
        shown.wait_request(f"tile/level-{level}/")


@pytest.mark.full
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_classes_of_cells_have_their_colours_in_both_themes(shown: Shown, theme: str) -> None:
    shown.page.select_option("#theme", theme)
    shown.page.select_option("#colours", "map")
    shown.page.uncheck("#show-names")
    shown.page.uncheck("#show-doors")
    shown.wait_painted()
    colours = palette("dark" if theme == "dark" else "light")[:, :3].tolist()
    assert shown.colour(20.5, 36.5) == tuple(colours[0])
    assert shown.colour(1.5, 25.5) == tuple(colours[3])


@pytest.mark.full
def test_closures_make_detours_and_are_taken_back(shown: Shown, client: Client) -> None:
    _planned(shown)
    before = shown.length_m
    doors = client.get("floor/0/rooms.json").value["doors"]
    passed = next(door for door in doors if f"a → door {door['number']} " in shown.text("#way"))
    shown.mode("close")
    shown.click(*passed["at"])
    shown.wait_plan(2)
    assert shown.length_m > before
    assert "more than" in shown.text("#figures")
    assert f"door {passed['number']}" in shown.text("#closed")
    shown.page.click("#close-undo")
    shown.wait_plan(3)
    assert shown.length_m == before
    shown.click(20, 8)  # the room c
    shown.wait_plan(4)
    assert "c" in shown.text("#closed")
    shown.page.click("#close-clear")
    shown.wait_plan(5)
    shown.mode("area")
    x, y = passed["at"]
    for corner in ((x - 3, y - 3), (x + 3, y - 3), (x + 3, y + 3), (x - 3, y + 3)):
        shown.click(*corner)
    shown.page.click("#area-done")
    shown.wait_plan(6)
    assert "area 1" in shown.text("#closed")
    assert shown.length_m > before
    shown.page.focus("#map")
    shown.page.keyboard.press("Control+z")
    shown.wait_plan(7)
    assert shown.length_m == before


@pytest.mark.full
def test_alternatives_stand_side_by_side(shown: Shown) -> None:
    _planned(shown)
    first = shown.length_m
    shown.page.select_option("#count", "2")
    shown.page.click("#alternatives")
    shown.page.wait_for_selector(".route-card")
    cards = shown.page.locator(".route-card")
    assert cards.count() == 2
    way = shown.text("#way")
    cards.nth(1).click()
    assert shown.length_m >= first
    assert shown.text("#way") != way


@pytest.mark.full
def test_rooms_are_named_merged_split_and_saved(shown: Shown, client: Client, folder: Path) -> None:
    shown.mode("names")
    shown.click(20, 40)
    shown.wait("document.getElementById('room-name').value === 'a'")
    shown.page.fill("#room-name", "kitchen")
    shown.page.keyboard.press("Enter")
    shown.wait_text("#unsaved", "1 change is not saved")
    shown.page.select_option("#other-room", "b")
    shown.page.click("#merge")
    shown.wait_text("#unsaved", "2 changes are not saved")
    shown.wait_text("#facts", "3 rooms")
    shown.page.click("#split")
    shown.click(38, 47)
    shown.click(38, 24)
    shown.wait_text("#unsaved", "3 changes are not saved")
    assert client.session.rooms.names == ("kitchen", "c", "d", "kitchen 2")
    shown.wait_text("#facts", "4 rooms")
    shown.page.click("#names-undo")
    shown.wait_text("#unsaved", "2 changes are not saved")
    shown.page.click("#save")
    shown.wait_text("#unsaved", "saved to rooms.yaml")
    grid = client.session.grid
    assert set(hn.load_rooms(folder / "rooms.yaml", grid).names) == {"kitchen", "c", "d"}


@pytest.mark.full
def test_a_corner_of_a_room_is_moved(shown: Shown, client: Client) -> None:
    shown.mode("names")
    shown.click(20, 40)
    shown.wait("document.getElementById('room-name').value === 'a'")
    shown.page.click("#corners")
    ring = client.get("floor/0/outlines.json").value["rings"][0][0]
    x, y = min(ring)
    shown.wait_corner(x, y)
    before = client.session.planning.topology.rooms.areas_m2[0]
    left, top = shown.at(x, y)
    shown.page.mouse.move(left, top)
    shown.page.mouse.down()
    shown.page.mouse.move(left + 30, top - 30)
    shown.page.mouse.move(*shown.at(x + 8, y + 8))
    shown.page.mouse.up()
    shown.wait_text("#unsaved", "1 change is not saved")
    assert client.session.planning.topology.rooms.areas_m2[0] < before


@pytest.mark.full
def test_files_are_downloaded(shown: Shown) -> None:
    _planned(shown)
    for button, name in (
        ("#export-png", "four.png"),
        ("[data-export=path-csv]", "path.csv"),
        ("[data-export=nav2]", "route-graph.geojson"),
    ):
        with shown.page.expect_download() as begun:
            shown.page.click(button)
        assert begun.value.suggested_filename == name
        assert begun.value.path().stat().st_size > 100


@pytest.mark.full
def test_two_pages_do_not_lose_each_others_names(context: Any, client: Client) -> None:
    seen = set()

    def once(route: Any) -> None:  # a page that looks again may see the new name before its click
        if (page := route.request.frame.page) not in seen:
            seen.add(page)
            route.continue_()

    context.route("**/closed.json", once)
    one, other = Shown(context, client.address), Shown(context, client.address)
    for shown, room, name in ((one, "a", "kitchen"), (other, "b", "hall")):
        shown.mode("names")
        shown.page.select_option("#room", room)
        shown.page.fill("#room-name", name)
    one.page.click("#rename button")
    one.wait_text("#unsaved", "1 change")
    other.page.click("#rename button")
    other.wait_text("#status", "changed on another page")
    assert client.session.rooms.names == ("kitchen", "b", "c", "d")
    assert other.page.input_value("#room-name") == "hall"
    other.page.click("#rename button")
    other.wait_text("#unsaved", "2 changes")
    assert client.session.rooms.names == ("kitchen", "hall", "c", "d")
