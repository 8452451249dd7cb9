"""A page opens with the cells of its map; what takes long follows."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any

import pytest

import hybridnav as hn
from hybridnav.ext.page import Opening, serve
from tests.ext.page.browser import WINDOW, browsing
from tests.ext.page.server import folder_in, query_of, served, session_of, site_of

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from hybridnav.ext.page import Site


class _Held:
    """A site that is made when the test lets it."""

    def __init__(self, file: Path) -> None:
        self.go_on = threading.Event()
        self.file = file
        grid = hn.load(file, robot_radius_m=0.2).grid
        self.opening = Opening(grid, self._make)

    def _make(self, tell: Callable[[str], None]) -> Site:
        tell("finding rooms")
        assert self.go_on.wait(60)
        return site_of(self.file)


def test_cells_are_there_before_rooms(folder: Path) -> None:
    held = _Held(folder / "four.yaml")
    whole = session_of(folder / "four.yaml")
    with served(held.opening, folder) as client:
        held.opening.begin()
        assert client.get("map.json").value["floors"] == [""]
        found = client.get("floor/0/map.json").value
        assert (found["ready"], found["rooms"]["rooms"], found["levels"]) == (False, [], [])
        assert {found["rows"], found["cols"]} == set(whole.grid.shape)
        tile = client.get("floor/0/tile/map/0/0/0.png?theme=dark")
        assert tile.body == whole.layer("map").png(0, 0, 0, "dark")
        assert client.get("state.json").value["stage"] == "finding rooms"
        query = query_of([10.5, 40.5], [70.5, 10.5])
        change = {"op": "rename", "room": "a", "name": "x"}
        for name, value in (
            ("plan", query),
            ("floor/0/export/rooms", None),
            ("floor/0/edit", {"version": 0, "change": change}),
            ("floor/0/save", {"version": 0}),
        ):
            refused = client.post(name, value)
            assert (refused.code, refused.value["error"]) == (503, "not yet: finding rooms")
        for name in ("rooms.json", "outlines.json", "graph/0.json", "tile/rooms/0/0/0.png"):
            assert client.get(f"floor/0/{name}").code == 503
        assert client.get("floor/0/tile/map/9/0/0.png").code == 422
        held.go_on.set()
        held.opening.wait()
        assert client.get("state.json").value["stage"] == ""
        assert client.get("floor/0/map.json").value == whole.describe()
        assert client.post("plan", query).value["solved"]


def test_what_cannot_be_prepared_ends_the_server(folder: Path) -> None:
    def make(_: Callable[[str], None]) -> Site:
        raise hn.InvalidValueError("no rooms today")

    opening = Opening(hn.load(folder / "four.yaml", robot_radius_m=0.2).grid, make)
    with pytest.raises(hn.InvalidValueError, match="no rooms today"):
        serve(opening, folder)


def test_a_wrong_file_of_rooms_is_refused_before_the_page_opens(cli: Any, folder: Path) -> None:
    (folder / "rooms.yaml").write_text("rooms: 3\n", encoding="utf-8")
    assert cli("view", folder / "four.yaml", "--robot-radius", 0.2).refuses(3, "rooms")


@pytest.mark.full
def test_the_page_shows_cells_and_how_far_it_is(tmp_path: Path) -> None:
    folder = folder_in(tmp_path)
    held = _Held(folder / "four.yaml")
    with served(held.opening, folder) as client, browsing() as browser:
        held.opening.begin()
        page = browser.new_context(**WINDOW).new_page()
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(client.address)
        page.wait_for_selector("canvas[data-open=true]")
        page.wait_for_selector("text=Finding rooms")
        assert page.locator("#progress progress").is_visible()
        page.mouse.click(300, 400)  # nothing to plan with yet
        page.keyboard.press("Tab")
        focused = "document.activeElement.closest('[inert]') === null"
        assert page.evaluate(focused)
        assert page.locator("#ends").evaluate("form => form.closest('[inert]') !== null")
        held.go_on.set()
        page.wait_for_selector("canvas[data-ready=true]")
        page.wait_for_selector("#progress", state="hidden")
        assert page.locator("#colours").input_value() == "rooms"
        page.select_option("#room", "a")
        assert errors == []
