"""What goes wrong on the page is said where people see it, and nothing they did is lost."""

import time
from typing import Any

import pytest

from tests.ext.page.browser import Shown
from tests.ext.page.server import Client

pytestmark = pytest.mark.full
START, GOAL = (10.5, 40.5), (70.5, 10.5)
SEEN = """() => {
    const box = document.getElementById('status').getBoundingClientRect();
    const at = document.elementFromPoint(box.left + 20, box.top + box.height / 2);
    return box.height > 0 && box.top >= 0 && box.bottom <= innerHeight && at.id === 'status';
}"""


def _planned(shown: Shown) -> None:
    shown.click(*START)
    shown.click(*GOAL)
    shown.wait_plan(1)


def test_a_message_is_seen_however_far_the_panel_is_scrolled(shown: Shown) -> None:
    shown.click(*START)
    shown.page.locator("[data-export=model]").scroll_into_view_if_needed()
    shown.click(36.5, 44)  # in a wall
    shown.wait_text("#status", "No route: goal occupied")
    assert shown.page.evaluate(SEEN)
    shown.page.locator("#modes").scroll_into_view_if_needed()
    assert shown.page.evaluate(SEEN)


def test_a_message_goes_with_what_it_was_about(shown: Shown) -> None:
    shown.page.fill("#start", "nowhere")
    shown.page.click("#ends button[type=submit]")
    shown.wait_text("#status", "two numbers of metres")
    shown.page.select_option("#colours", "level")
    assert shown.text("#status") == ""
    shown.mode("names")
    shown.page.select_option("#room", "a")
    shown.page.click("#split")
    shown.wait_text("#status", "two points")
    shown.click(20, 47)
    shown.wait_text("#status", "the other end")
    shown.click(20, 24)
    shown.wait_text("#unsaved", "1 change is not saved")
    assert shown.text("#status") == ""


def test_a_change_that_is_refused_is_said_and_stays_said(shown: Shown) -> None:
    shown.mode("names")
    shown.page.select_option("#room", "a")
    shown.page.fill("#room-name", "kitchen")
    shown.page.keyboard.press("Enter")
    shown.wait_text("#unsaved", "1 change is not saved")
    shown.page.click("#corners")
    shown.page.click("#save")
    shown.wait_text("#unsaved", "saved to rooms.yaml")
    shown.page.select_option("#other-room", "d")
    shown.page.click("#merge")
    shown.wait_text("#status", "do not touch")
    shown.page.wait_for_timeout(500)
    assert shown.page.evaluate(SEEN)


def test_a_level_of_too_many_vertices_says_so_until_another_is_chosen(shown, client, monkeypatch):
    monkeypatch.setattr("hybridnav.ext.page.drawing.MOST_VERTICES", 100)
    assert client.get("floor/0/graph/0.json").value["drawn"] is False
    shown.page.select_option("#colours", "level")
    shown.page.check("#show-graph")
    shown.page.fill("#level", "0")
    shown.wait_text("#level-note", "too many to draw its arcs")
    shown.page.fill("#level", shown.page.locator("#level").get_attribute("max"))
    shown.wait("document.getElementById('level-note').textContent === ''")


def test_far_points_are_refused_in_words(shown: Shown) -> None:
    shown.page.fill("#start", "1e9, 3")
    shown.page.fill("#goal", "1, 3")
    shown.page.keyboard.press("Enter")
    shown.wait_text("#status", "Start lies far outside of the map")
    shown.page.click("#clear")
    assert shown.page.input_value("#start") == shown.page.input_value("#goal") == ""


def test_that_there_are_no_routes_is_said(shown: Shown) -> None:
    shown.click(*START)
    shown.click(36.5, 44)
    shown.wait_plan(1)
    shown.page.click("#alternatives")
    shown.wait_text("#status", "No other ways: ")


@pytest.mark.parametrize(
    ("button", "name"), [("#alternatives", "alternatives"), ("#optimum", "optimum")]
)
def test_an_answer_about_ends_that_were_moved_is_dropped(shown, button, name):
    _planned(shown)
    held: list[Any] = []
    shown.page.route(f"**/{name}", lambda route: held.append(route))  # noqa: PLW0108 - Playwright writes on it
    shown.page.click(button)
    while not held:
        shown.page.wait_for_timeout(20)
    shown.page.click("#clear")
    shown.click(*START)
    shown.click(30.5, 30.5)
    shown.wait_plan(2)
    length = shown.length_m
    with shown.page.expect_response(f"**/{name}"):
        held[0].continue_()
    shown.page.wait_for_timeout(200)
    assert shown.length_m == length
    assert shown.page.locator(".route-card").count() == 0
    assert "whole grid" not in shown.text("#figures")


def test_changes_in_quick_succession_all_count(shown: Shown, client: Client) -> None:
    def slow(route: Any) -> None:
        time.sleep(0.2)
        route.continue_()

    shown.page.route("**/edit", slow)
    shown.mode("names")
    for room, name in (("a", "kitchen"), ("b", "hall"), ("c", "attic")):
        shown.page.select_option("#room", room)
        shown.page.fill("#room-name", name)
        shown.page.keyboard.press("Enter")
    shown.wait_text("#unsaved", "3 changes are not saved")
    assert client.session.rooms.names == ("kitchen", "hall", "attic", "d")
    shown.page.focus("#map")
    for _ in range(3):
        shown.page.keyboard.press("Control+z")
    shown.wait("document.querySelector('#unsaved').textContent === ''")
    assert client.session.rooms.names == ("a", "b", "c", "d")
    assert shown.text("#status") == ""


def test_a_closed_room_stays_closed_under_its_new_name(shown: Shown) -> None:
    shown.page.select_option("#close-room", "b")
    shown.page.select_option("#close-door", "1")
    shown.mode("names")
    shown.page.select_option("#room", "b")
    shown.page.fill("#room-name", "kitchen")
    shown.page.keyboard.press("Enter")
    shown.wait_text("#unsaved", "1 change is not saved")
    here = ["on", "this", "page", "only", "Open"]
    assert shown.text("#closed").split() == ["kitchen", *here, "door", "1", *here]


def test_what_is_closed_no_more_is_said(shown: Shown) -> None:
    shown.page.select_option("#close-room", "b")
    shown.mode("names")
    shown.page.select_option("#room", "a")
    shown.page.select_option("#other-room", "b")
    shown.page.click("#merge")
    shown.wait_text("#status", "Open again, as it is there no more: b")
    assert shown.text("#closed") == ""


def test_rooms_that_another_page_has_saved_are_not_called_unsaved(context, shown):
    other = Shown(context, shown.page.url)
    shown.mode("names")
    shown.page.select_option("#room", "a")
    shown.page.fill("#room-name", "kitchen")
    shown.page.keyboard.press("Enter")
    shown.wait_text("#unsaved", "1 change is not saved")
    other.page.evaluate("window.dispatchEvent(new Event('focus'))")
    other.wait_text("#unsaved", "1 change is not saved")
    other.page.click("#save")
    other.wait_text("#unsaved", "saved to rooms.yaml")
    shown.page.evaluate("window.dispatchEvent(new Event('focus'))")
    shown.wait_text("#unsaved", "saved to rooms.yaml")
    assert shown.page.locator("#names-undo").is_disabled()


def test_a_dead_server_is_said_after_a_drag(shown: Shown, client: Client) -> None:
    shown.mode("names")
    shown.click(20, 40)
    shown.wait("document.getElementById('room-name').value === 'a'")
    shown.page.click("#corners")
    corner = min(client.get("floor/0/outlines.json").value["rings"][0][0])
    shown.wait_corner(*corner)
    shown.page.route("**/*", lambda route: route.abort())
    x, y = shown.at(*corner)
    shown.page.mouse.move(x, y)
    shown.page.mouse.down()
    shown.page.mouse.move(x + 40, y - 40, steps=4)
    shown.page.mouse.up()
    shown.wait_text("#status", "The server does not answer")
    shown.page.click("#zoom-in")
    shown.page.focus("#map")
    shown.page.keyboard.press("Control+z")
    shown.wait_text("#status", "The server does not answer")


def test_all_is_done_by_the_keyboard_alone(shown: Shown, client: Client) -> None:
    def go(key: str, times: int = 1) -> None:
        for _ in range(times):
            shown.page.keyboard.press(key)

    shown.page.focus("#map")
    for point in (START, GOAL):
        _walk_to(shown, *point)
        go("Space")
    shown.wait_plan(1)
    assert shown.length_m > 10
    # A room is cut by two points.
    go("0")
    shown.page.select_option("#room", "a")
    shown.page.focus("input[value=route]")
    go("ArrowDown", 3)
    assert shown.page.is_checked("input[value=names]")
    shown.page.focus("#split")
    go("Enter")
    shown.page.focus("#map")
    _walk_to(shown, 20, 47)
    go("Space")
    _walk_to(shown, 20, 24)
    go("Space")
    shown.wait_text("#unsaved", "1 change is not saved")
    assert client.session.rooms.names == ("a", "b", "c", "d", "a 2")
    # A corner is taken up and put down elsewhere.
    go("0")
    shown.page.select_option("#room", "d")
    shown.page.focus("#corners")
    go("Enter")
    shown.page.focus("#map")
    area = client.session.planning.topology.rooms.areas_m2[3]
    ring = client.get("floor/0/outlines.json").value["rings"][3][0]
    x, y = max(ring)
    shown.wait_painted()
    shown.wait_corner(x, y)
    _walk_to(shown, x, y)
    go("Space")
    shown.wait_text("#status", "press space again")
    go("ArrowLeft")
    go("ArrowUp" if y < 20 else "ArrowDown")
    go("Space")
    shown.wait_text("#unsaved", "2 changes are not saved")
    assert client.session.planning.topology.rooms.areas_m2[3] != area


def _walk_to(shown: Shown, x: float, y: float) -> None:
    """Move the map by arrow keys until a point lies in its middle, to a few pixels."""
    shown.wait_painted()
    for key in (("ArrowRight", "ArrowLeft"), ("ArrowUp", "ArrowDown")):
        middle = [float(part) for part in shown.fact("view").split()]
        at = 0 if "ArrowRight" in key else 1
        pixels = ((x, y)[at] - middle[at]) * middle[2]
        steps = round(pixels / 8)
        for _ in range(abs(steps)):
            shown.page.keyboard.press(f"Shift+{key[steps < 0]}")
        shown.wait_painted()
