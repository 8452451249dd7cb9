"""A page opens with the cells of its lowest floor; what takes long follows."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from typing_extensions import Self

import hybridnav as hn
from hybridnav.ext.page import Opening, Site, serve
from tests.ext.page.browser import WINDOW, browsing
from tests.ext.page.server import (
    building_page,
    building_site_of,
    folder_in,
    query_of,
    served,
    session_of,
    site_of,
    write_building,
)

OVER_FLOORS = {
    "start": {"floor": 0, "point": [20.5, 40.5]},
    "goal": {"floor": 1, "point": [60.5, 8.5]},
    "preset": "shortest",
}


class _Held:
    """A site that is made when the test lets it."""

    def __init__(self, file: Path, stage: str = "finding rooms", **more: Any) -> None:
        self.go_on = threading.Event()
        self.file, self.stage = file, stage
        grid = hn.load(file.parent / "four.yaml", robot_radius_m=0.2).grid
        self.opening = Opening(grid, self._make, **more)

    @classmethod
    def building(cls, folder: Path) -> Self:
        file = write_building(folder)
        return cls(file, "reading 2 floors", name="building", floors=["ground", "2: upper"])

    def _make(self, tell: Callable[[str], None]) -> Site:
        tell(self.stage)
        assert self.go_on.wait(60)
        return (building_site_of if self.file.stem == "building" else site_of)(self.file)


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
        raise hn.errors.InvalidValueError("no rooms today")

    opening = Opening(hn.load(folder / "four.yaml", robot_radius_m=0.2).grid, make)
    with pytest.raises(hn.errors.InvalidValueError, match="no rooms today"):
        serve(opening, folder)


def test_a_wrong_file_of_rooms_is_refused_before_the_page_opens(cli: Any, folder: Path) -> None:
    (folder / "rooms.yaml").write_text("rooms: 3\n", encoding="utf-8")
    assert cli("view", folder / "four.yaml", "--robot-radius", 0.2).refuses(3, "rooms")


def test_cells_of_the_lowest_floor_are_there_first(folder: Path) -> None:
    held = _Held.building(folder)
    whole = building_site_of(held.file)
    with served(held.opening, folder) as client:
        held.opening.begin()
        found = client.get("map.json").value
        assert (found["ready"], found["floors"]) == (False, ["ground", "2: upper"])
        assert client.get("floor/0/map.json").value["ready"] is False
        tile = client.get("floor/0/tile/map/0/0/0.png")
        assert tile.body == whole.sessions[0].layer("map").png(0, 0, 0, "light")
        assert client.get("state.json").value["stage"] == "reading 2 floors"
        assert client.get("floor/1/map.json").code == 503
        assert client.get("floor/7/map.json").code == 503
        for name in ("plan", "optimum", "alternatives", "export/model", "floor/0/save"):
            value = {"version": 0} if name.endswith("save") else OVER_FLOORS
            assert client.post(name, None if "export" in name else value).code == 503
        held.go_on.set()
        held.opening.wait()
        assert client.get("map.json").value == whole.describe()
        assert client.get("floor/1/map.json").value == whole.sessions[1].describe()
        assert client.get("state.json").value["stage"] == ""
        assert client.get("floor/7/map.json").code == 422
        plan = client.post("plan", OVER_FLOORS).value
        assert plan["solved"]
        assert plan["seconds"] < 1  # nothing is left to prepare on either floor


def test_what_is_wrong_with_a_building_ends_the_server(folder: Path) -> None:
    file = write_building(folder)
    file.write_text(file.read_text("utf-8").replace("room: e}", "room: nowhere}"), "utf-8")
    opening = building_page(file).opening()
    with pytest.raises(hn.errors.MapError, match="nowhere"):
        serve(opening, folder)


def test_a_wrong_lowest_floor_is_refused_before_the_page_opens(folder: Path) -> None:
    file = write_building(folder)
    (folder / "four.yaml").unlink()
    with pytest.raises(hn.errors.MapError, match=r"floor ground.*four\.yaml"):
        building_page(file).opening()


def test_a_model_has_all_its_floors_at_once(folder: Path, tmp_path: Path) -> None:
    model = tmp_path / "building.hnm"
    hn.save(hn.ext.fleet.load_building(write_building(folder), robot_radius_m=0.2), model)
    shown = building_page(model, robot_radius_m=None).opening()
    assert isinstance(shown, Site)


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
        page.check("input[value=names]")
        page.select_option("#room", "a")
        assert errors == []


@pytest.mark.full
def test_the_page_goes_on_when_all_floors_are_there(tmp_path: Path) -> None:
    folder = folder_in(tmp_path)
    held = _Held.building(folder)
    with served(held.opening, folder) as client, browsing() as browser:
        held.opening.begin()
        page = browser.new_context(**WINDOW).new_page()
        errors: list[str] = []
        page.on("pageerror", lambda error: errors.append(str(error)))
        page.goto(client.address)
        page.wait_for_selector("canvas[data-open=true]")
        page.wait_for_selector("text=Reading 2 floors")
        # Whatever people try meanwhile does no harm.
        page.mouse.move(300, 300)
        page.mouse.down()
        page.mouse.move(350, 350)
        page.mouse.up()
        page.mouse.click(300, 400)
        page.focus("#map")
        for key in ("PageUp", "Control+z", "Space", "Enter", "Escape"):
            page.keyboard.press(key)
        assert page.locator("#status").inner_text() == ""
        held.go_on.set()
        page.wait_for_selector("canvas[data-ready=true]")
        assert page.locator("#close-link option").count() == 4
        page.select_option("#floor", "1")
        page.wait_for_selector("text=Floor 2: upper")
        assert page.locator("#start").input_value() == ""
        assert errors == []
