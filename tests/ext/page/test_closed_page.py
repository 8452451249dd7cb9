"""Who goes, and what is closed for all, as people choose and see them on the page."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

import hybridnav as hn
from tests.ext.page.browser import WINDOW, Shown
from tests.ext.page.server import Client, query_of


@pytest.fixture
def people(browser: Any, house: Client) -> Iterator[list[Shown]]:
    """Two of the staff at their own browsers, one speaks German; nothing may fail."""
    contexts = [browser.new_context(**WINDOW, locale=language) for language in ("en", "de")]
    shown = [Shown(context, house.address, face="staff") for context in contexts]
    yield shown
    assert [one.errors for one in shown] == [[], []]
    for context in contexts:
        context.close()


def _journal(folder: Path) -> list[tuple[str, str, str]]:
    return [(one.what, one.why, one.by) for one in hn.Journal(folder / "house.yaml").items()]


def _planned(shown: Shown, goal: str) -> None:
    shown.take("start", "entrance")
    shown.take("goal", goal)
    shown.wait_plan(1)


def _settle(shown: Shown, profile: str) -> None:
    number = int(shown.fact("plans"))
    shown.page.select_option("#profile", profile)
    shown.wait_plan(number + 1)


def test_who_goes_is_chosen_and_told(people: list[Shown]) -> None:
    english, german = people
    _planned(english, "stairwell")
    free = english.length_m
    for profile, has_office in (("staff", True), ("visitor", False)):
        _settle(english, profile)
        assert ("office 10" in english.text("#words")) == has_office
        assert english.length_m > free - 1e-6
    assert "than the shortest way" in english.text("#figures")
    assert "not through private rooms" in english.text("#asks")
    assert english.page.locator("#stairs").is_visible()
    english.page.reload()
    english.page.wait_for_selector("canvas[data-ready=true]")
    assert english.page.input_value("#profile") == "visitor"
    assert "profile=visitor" in english.page.url
    options = german.page.locator("#profile option").all_inner_texts()
    assert options == ["alle", "Besucher", "Personal", "Rollstuhl", "Wagen"]
    german.page.select_option("#profile", "wheelchair")
    assert "keine Treppen, 0,90\u00a0m breit" in german.text("#asks")
    assert not german.page.locator("#stairs").is_visible()


def test_a_refused_profile_says_why_until_another_is_chosen(people, folder):
    hn.Journal(folder / "house.yaml").close("link:lift")
    for shown in people:
        shown.wait_text("#closed", "lift")
        _planned(shown, "ward 10")
        _settle(shown, "wheelchair")
    english, german = people
    why = "No route: profile wheelchair forbids every route: the way is by stairs (stairs)"
    assert english.text("#status") == why
    for mode in ("close", "names", "route"):  # it stands as long as it is so
        english.mode(mode)
        assert english.text("#status") == why
    assert (
        german.text("#status")
        == "Kein Weg: so ist keiner erlaubt. Es gibt einen über Treppen (stairs)"
    )
    _settle(english, "")
    assert english.text("#status") == ""
    assert "stairs" in english.text("#words")


def test_what_is_closed_lasts_and_others_see_it_at_once(people: list[Shown], folder: Path) -> None:
    english, german = people
    _planned(english, "ward 10")
    assert "lift" in english.text("#words")
    german.mode("close")
    german.page.fill("#why", "Wartung")
    german.page.fill("#by", "Anna")
    german.page.select_option("#close-link", "lift")
    german.wait_text("#closed", "Anna · Wartung")
    assert _journal(folder) == [("link:lift", "Wartung", "Anna")]
    english.wait_text("#status", "Closed by somebody else: lift, Anna")
    english.wait_text("#words", "stairs")
    assert "longer than with everything open" in english.text("#figures")
    assert english.text("#closed-count").strip() == "(1)"
    english.page.reload()
    english.page.wait_for_selector("canvas[data-ready=true]")
    english.mode("close")
    english.wait_text("#closed", "Anna · Wartung")
    english.page.click("#closed button")
    german.wait_text("#status", "Von jemand anderem geöffnet: lift")
    german.wait("document.querySelector('#closed').textContent === ''")
    assert _journal(folder) == []


def test_a_click_turns_a_door_until_it_is_open_both_ways(people: list[Shown], folder: Path) -> None:
    english, german = people
    building = hn.ext.fleet.load_building(folder / "house.yaml", robot_radius_m=0)
    rooms = building.floors[0].planner.topology.rooms.door(2).rooms
    english.mode("close")
    english.page.check("#one-way")
    for room in rooms:
        english.page.select_option("#close-door", "2")
        english.wait_text("#closed", f"door 2, only into {room or 'no room'}, floor 0")
        german.wait_text("#closed", f"Tür 2, nur nach {room or 'kein Raum'}")
        assert [what for what, _, _ in _journal(folder)] == [f"0:one-way:door:2={room or ''}"]
    english.page.select_option("#close-door", "2")
    english.wait("document.querySelector('#closed').textContent === ''")
    assert _journal(folder) == []


def test_of_two_who_close_the_same_the_last_one_counts(people: list[Shown], folder: Path) -> None:
    english, german = people
    english.mode("close")
    english.page.fill("#why", "repair")
    english.page.select_option("#close-door", "2")
    german.wait_text("#closed", "repair")
    hn.Journal(folder / "house.yaml").close("0:door:2", why="painted", by="porter")
    for shown in people:
        shown.wait_text("#closed", "porter · painted")
    german.mode("close")
    german.page.click("#closed button")
    english.wait("document.querySelector('#closed').textContent === ''")
    english.page.select_option("#close-room", "lobby")
    english.wait_text("#closed", "lobby, floor 0")
    english.page.click("#close-undo")
    english.wait("document.querySelector('#closed').textContent === ''")
    assert _journal(folder) == []


@pytest.mark.full
def test_a_closed_room_stays_closed_under_its_new_name(people: list[Shown], folder: Path) -> None:
    english, german = people
    english.mode("close")
    english.page.select_option("#close-room", "office 10")
    german.wait_text("#closed", "office 10")
    english.mode("names")
    english.page.select_option("#room", "office 10")
    english.page.fill("#room-name", "chapel")
    english.page.keyboard.press("Enter")
    for shown in people:
        shown.wait_text("#closed", "chapel")
        assert shown.page.locator("#closed li").count() == 1
    assert [what for what, *_ in _journal(folder)] == ["0:room:chapel"]
    assert "chapel" in german.page.locator("#room").inner_text()  # of the other page too
    _planned(german, "stairwell")
    assert "chapel" not in german.text("#words")


@pytest.mark.full
def test_a_robot_tries_closures_on_its_page_alone(browser, house, folder):
    context = browser.new_context(**WINDOW)
    shown = Shown(context, house.address)
    shown.page.select_option("#close-link", "lift")
    shown.wait_text("#closed", "on this page only")
    assert _journal(folder) == []
    shown.page.click("#close-clear")
    shown.page.check("#lasting")
    shown.page.select_option("#close-link", "lift")
    shown.wait_text("#closed", "since")
    assert [what for what, *_ in _journal(folder)] == ["link:lift"]
    assert shown.errors == []
    context.close()


def test_a_plan_with_all_open_passes_what_is_out_of_order(client: Client, house: Client) -> None:
    del client  # of the same folder
    ends = [
        house.post(f"floor/{n}/stand", {"name": name}).value["point"]
        for n, name in ((0, "entrance"), (0, "stairwell"))
    ]
    query = query_of(*ends)
    open_m = house.post("plan", query).value["length_m"]
    for what in ("0:room:lobby", "0:room:office 10"):
        house.post("closed", {"what": what, "closed": True, "by": "Anna"})
    assert not house.post("plan", query).value["solved"]
    assert house.post("plan", query | {"all_open": True}).value["length_m"] == open_m
