"""A page's server in a thread, and a client that sends what browsers and attackers would."""

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

import numpy as np

import hybridnav as hn
from hybridnav.cli.map_options import MapOptions
from hybridnav.ext.page import Session, Site
from hybridnav.ext.page.app import make_app, make_server
from hybridnav.ext.page.command import BuildingPage
from hybridnav.ext.page.kept import RoomsFile

TOKEN = "0123456789abcdef"  # noqa: S105 - of a test
MAP = """\
####################
#........#.........#
#........#.........#
#..................#
#........#.........#
#........#.........#
####.#########.#####
#........#.........#
#........#.........#
#..................#
#........#.........#
####################
"""
"""Four rooms in a ring; a letter is a square metre."""
FINE = 4
FRAME = hn.Frame(resolution_m=0.25, origin_m=(-3.0, 2.0), yaw_rad=0.3)


def write_map(
    folder: Path,
    name: str = "four",
    rooms: tuple[str, str, str, str] = ("a", "b", "c", "d"),
    rooms_file: str = "rooms.yaml",
    frame: hn.Frame = FRAME,
) -> Path:
    """Write the map of four rooms, turned and off the origin, and its rooms with names."""
    walls = np.array([[letter == "#" for letter in line] for line in MAP.split()], dtype=float)
    probability = np.kron(walls, np.ones((FINE, FINE)))[::-1]
    grid = hn.OccupancyGrid(probability, frame=frame, robot_radius_m=0.2)
    hn.write_ros_map(grid, folder / f"{name}.yaml")
    rows, cols = np.indices(grid.shape)
    labels = 2 * (rows < grid.shape[0] // 2 - 2) + (cols >= 9 * FINE + 2)
    hn.save_rooms(folder / rooms_file, hn.RoomLabels(rooms, labels), grid)
    return folder / f"{name}.yaml"


BUILDING = """\
speed_m_s: 0.5
floors:
- {name: ground, map: four.yaml, rooms: rooms.yaml}
- {name: "2: upper", map: upper.yaml, rooms: more/rooms-2.yaml, elevation_m: 3.0}
links:
- name: lift
  kind: lift
  wait_s: 10
  ends: [{floor: ground, room: a}, {floor: "2: upper", room: e}]
- name: stairs
  kind: stairs
  cost_m: 4
  ends: [{floor: ground, room: d}, {floor: "2: upper", door: 3, room: f}]
- name: hatch
  kind: ramp
  max_radius_m: 0.1
  ends: [{floor: ground, room: b}, {floor: "2: upper", room: h}]
"""


def write_building(folder: Path) -> Path:
    """Write a building of two floors in a folder with the map of four rooms."""
    (folder / "more").mkdir()
    frame = hn.Frame(resolution_m=0.25, origin_m=(10.0, -4.0), yaw_rad=-0.7)
    write_map(folder, "upper", ("e", "f", "g", "h"), "more/rooms-2.yaml", frame)
    (folder / "building.yaml").write_text(BUILDING, encoding="utf-8")
    return folder / "building.yaml"


HOUSE = """\
floors:
- {name: "0", map: four.yaml, rooms: rooms.yaml}
- {name: "1", map: one.yaml, rooms: rooms-1.yaml, elevation_m: 3.0}
- {name: "2", map: two.yaml, rooms: rooms-2.yaml, elevation_m: 6.0}
links:
- name: lift
  kind: lift
  wait_s: 1
  ends: [{floor: "0", room: lobby}, {floor: "1", room: lobby}, {floor: "2", room: lobby}]
- name: stairs
  kind: stairs
  cost_m: 30
  ends:
  - {floor: "0", room: stairwell}
  - {floor: "1", room: stairwell}
  - {floor: "2", room: stairwell}
"""


def write_house(folder: Path) -> Path:
    """Write a building of three floors with a lift and stairs; an office is private."""
    write_map(folder, "four", ("entrance", "office 10", "lobby", "stairwell"))
    write_map(folder, "one", ("ward 1", "ward 2", "lobby", "stairwell"), "rooms-1.yaml")
    write_map(folder, "two", ("ward 10", "Küche", "lobby", "stairwell"), "rooms-2.yaml")
    grid, file = hn.load_map(folder / "four.yaml"), folder / "rooms.yaml"
    private = {"office 10": hn.RoomUse(private=True)}
    hn.save_rooms(file, replace(hn.load_rooms(file, grid), uses=private), grid)
    (folder / "house.yaml").write_text(HOUSE, encoding="utf-8")
    return folder / "house.yaml"


def folder_in(above: Path) -> Path:
    """Make the folder of a map, with a file above it that no page may read or change."""
    inside = above / "maps"
    inside.mkdir()
    (above / "secret.txt").write_text("secret", encoding="utf-8")
    write_map(inside)
    return inside


def session_of(file: Path) -> Session:
    """Return the session that the command would make."""
    model = hn.load(file, robot_radius_m=0.2)
    settings = model.fitted(None)
    rooms_path = file.parent / "rooms.yaml"
    rooms = hn.load_rooms(rooms_path, model.grid) if rooms_path.exists() else None
    topology = model.grown(settings.pyramid, rooms or hn.find_rooms(model.grid))
    rooms_file, journal = RoomsFile(file.parent, "rooms.yaml"), hn.Journal(file)
    return Session(model, topology, settings, file=rooms_file, journal=journal)


def site_of(file: Path) -> Site:
    """Return what the command would show of a map."""
    return Site.of_map(session_of(file))


@dataclass(frozen=True)
class Answer:
    """What the server answered."""

    code: int
    body: bytes
    headers: dict[str, str]

    @property
    def value(self) -> Any:
        return json.loads(self.body)


@dataclass(frozen=True)
class Client:
    """A client of one server."""

    port: int
    session: Any
    """The lowest floor that it shows."""

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.port}/{TOKEN}/"

    def send(
        self,
        method: str,
        path: str,
        body: bytes | None = None,
        headers: dict[str, str] | None = None,
    ) -> Answer:
        """Send any request; the path is that after the server's name."""
        connection = HTTPConnection("127.0.0.1", self.port, timeout=300)  # one may compile
        try:
            connection.request(method, path, body, headers or {})
            response = connection.getresponse()
            named = {name.lower(): value for name, value in response.getheaders()}
            return Answer(response.status, response.read(), named)
        finally:
            connection.close()

    def get(self, name: str, **headers: str) -> Answer:
        """Get a file of the page."""
        return self.send("GET", f"/{TOKEN}/{name}", None, headers)

    def post(self, name: str, value: Any, **headers: str) -> Answer:
        """Send a request of the page."""
        kind = {"content-type": "application/json"}
        return self.send("POST", f"/{TOKEN}/{name}", json.dumps(value).encode(), kind | headers)


def building_page(file: Path, robot_radius_m: float | None = 0.2) -> BuildingPage:
    """Return what the command makes a page of a building of."""
    return BuildingPage(MapOptions(map_file=file, robot_radius_m=robot_radius_m, max_cells=10**6))


def building_site_of(file: Path) -> Site:
    """Return what the command would show of a building."""
    return building_page(file).make(lambda _: None)


def query_of(start: list[float], goal: list[float]) -> dict[str, Any]:
    """Return a query between two points of a map."""
    ends = {"start": {"floor": 0, "point": start}, "goal": {"floor": 0, "point": goal}}
    return {**ends, "preset": "shortest"}


@contextmanager
def served(shown: Any, folder: Path) -> Iterator[Client]:
    """Serve a site until the end of the block."""
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        port = listening.getsockname()[1]
        app = make_app(shown, token=TOKEN, port=port, folder=folder)
        server = make_server(app)
        thread = threading.Thread(target=lambda: server.run(sockets=[listening]), daemon=True)
        thread.start()
        try:
            yield Client(port, next(iter(getattr(shown, "sessions", ())), None))
        finally:
            server.should_exit = True
            thread.join(20)
