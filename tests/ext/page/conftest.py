"""A page of a little map, served for one test."""

from typing import Any

import pytest

pytest.importorskip("uvicorn", reason="the page needs the extra view")
pytest.importorskip("starlette", reason="the page needs the extra view")

from collections.abc import Iterator
from pathlib import Path

import hybridnav as hn
from tests.ext.page.browser import WINDOW, Shown, browsing
from tests.ext.page.server import (
    FRAME,
    Client,
    building_site_of,
    folder_in,
    served,
    site_of,
    write_building,
    write_house,
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A browser for all tests of a file."""
    with browsing() as browser:
        yield browser


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The folder of a map, with another one beside it that nothing may touch."""
    return folder_in(tmp_path)


@pytest.fixture
def wards(folder: Path) -> Path:
    """The map, its rooms named as in a hospital, with a chair in the middle of the kitchen."""
    probability = hn.load_map(folder / "four.yaml").probability.copy()
    probability[34:38, 15:19] = 1.0
    grid = hn.OccupancyGrid(probability, frame=FRAME, robot_radius_m=0.2)
    hn.write_ros_map(grid, folder / "four.yaml")
    rooms = hn.load_rooms(folder / "rooms.yaml", grid)
    names = ("Küche", "ward 10", "Ward 2", "ward 1")
    chair = {"chair": tuple(FRAME.points_of_grid([36.0, 19.5]).tolist())}
    hn.save_rooms(folder / "rooms.yaml", hn.RoomLabels(names, rooms.label_of, chair), grid)
    return folder


@pytest.fixture
def client(folder: Path) -> Iterator[Client]:
    """A client of a server of the page."""
    with served(site_of(folder / "four.yaml"), folder) as client:
        yield client


@pytest.fixture
def building(folder: Path) -> Iterator[Client]:
    """A client of a server of a building of two floors."""
    site = building_site_of(write_building(folder))
    with served(site, folder) as client:
        yield client


@pytest.fixture
def house(folder: Path) -> Iterator[Client]:
    """A client of a server of a building of three floors with a lift and stairs."""
    with served(building_site_of(write_house(folder)), folder) as client:
        yield client


@pytest.fixture
def context(browser: Any) -> Iterator[Any]:
    """A person of its own, with a window of 1280 pixels."""
    context = browser.new_context(**WINDOW)
    yield context
    context.close()


@pytest.fixture
def shown(context: Any, client: Client) -> Iterator[Shown]:
    """The page of four rooms; nothing on it may fail, or ask another server."""
    shown = Shown(context, client.address)
    yield shown
    assert shown.errors == []
    assert all(url.startswith((client.address, "blob:", "data:")) for url in shown.requests)
