"""`hybridnav view`: a local page for people who would rather click than type."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from hybridnav._base.files import printable
from hybridnav.cli.common import answer, check_output
from hybridnav.cli.costs import PRESET, CostsOption, parsed_costs
from hybridnav.cli.errors import UsageError
from hybridnav.cli.options import BesideRoomsOption, MapOrBuildingArgument
from hybridnav.cli.reading import MapOptions, check_room_to_be, load_model, with_map
from hybridnav.ext.fleet.command import (
    BuildingSource,
    check_options,
    is_building_file,
    refused_options,
)
from hybridnav.maps.names import read_point

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import hybridnav as hn
    from hybridnav.ext.fleet.files.entries import FloorEntry
    from hybridnav.ext.page import BuildingOpening, BuildingSession, Opening, Session
    from hybridnav.ext.page.requests import FloorsPlanQuery, PlanQuery
    from hybridnav.ext.page.rooms_file import RoomsFile


_ROOMS = "rooms.yaml"
_TWO = 2

SaveOption = Annotated[
    Path | None,
    typer.Option(
        "--save", metavar="FILE", help="Write the page into one .html file instead of serving it."
    ),
]
RouteOption = Annotated[
    list[str] | None,
    typer.Option(
        "--route",
        metavar="X,Y:X,Y",
        help="A route of the saved page, in metres; FLOOR:X,Y:FLOOR:X,Y in a building. May be "
        "repeated.",
    ),
]
PortOption = Annotated[
    int,
    typer.Option("--port", metavar="N", min=0, max=65535, help="Port on 127.0.0.1; 0 for any."),
]
BrowserOption = Annotated[
    bool, typer.Option("--browser/--no-browser", help="Open the page in the browser.")
]


@with_map()
def view(
    ctx: typer.Context,
    map_file: MapOrBuildingArgument,
    save: SaveOption = None,
    routes: RouteOption = None,
    port: PortOption = 0,
    browser: BrowserOption = True,
    rooms_file: BesideRoomsOption = None,
    costs: CostsOption = None,
    *,
    reading: MapOptions,
) -> None:
    """Open MAP as a page on 127.0.0.1: click routes, close doors, name rooms. Ctrl-C ends it.

    MAP may be a building: the page then has its floors.
    """
    check_output(save, "--save", (".html",))
    if routes and save is None:
        raise UsageError("--route is for a saved page: add --save FILE, or leave it out")
    if is_building_file(map_file):
        check_options(refused_options(ctx, VIEW_OPTIONS))
        if save is not None:
            save_building(building_session(ctx.params), save, routes or ())
        else:
            _serve(building_opening(ctx.params), map_file.parent, port, browser=browser)
        return
    pairs = [_endpoints(text) for text in routes or ()]
    given = parsed_costs(costs)
    settings = reading.settings(
        map_file, preset=PRESET if given else None, overrides=given.overrides
    )
    model = load_model(map_file, settings, {}, reading)
    check_room_to_be(model.grid, allow_unexplored=settings.planner.allow_unexplored)
    rooms_path = map_file.parent / _ROOMS if rooms_file is None else rooms_file
    make = _maker(model, settings, rooms_path, given.read(model.grid))
    if save is not None:
        _save(make(lambda _: None), save, pairs, settings.name)
        return
    from hybridnav.ext.page import Opening  # noqa: PLC0415 - loads numba and matplotlib

    _serve(Opening(model.grid, make), rooms_path.parent, port, browser=browser)


def _serve(
    shown: Opening | BuildingOpening | BuildingSession, folder: Path, port: int, *, browser: bool
) -> None:
    """Serve a page until Ctrl-C, and print its address."""
    from hybridnav.ext.page import serve  # noqa: PLC0415 - loads numba and matplotlib

    def ready(address: str) -> None:
        answer(f"page       {address}\nCtrl-C     ends it\n")
        if browser:
            import webbrowser  # noqa: PLC0415 - on demand

            webbrowser.open(address)

    serve(shown, folder, port=port, ready=ready)


def _maker(
    model: hn.Model, settings: hn.Preset, rooms_path: Path, costs: hn.CostLayer | None
) -> Callable[[Callable[[str], None]], Session]:
    """Return what makes the session of a map, in a thread; the file of rooms is read now."""
    # These load numba and matplotlib, which help and wrong usage can do without.
    import hybridnav as hn  # noqa: PLC0415
    from hybridnav.ext.page import Session  # noqa: PLC0415
    from hybridnav.ext.page.rooms_file import RoomsFile  # noqa: PLC0415

    file = RoomsFile(rooms_path.parent, rooms_path.name)
    given = hn.load_rooms(rooms_path, model.grid) if rooms_path.exists() else model.rooms

    def make(tell: Callable[[str], None]) -> Session:
        rooms = given
        if rooms is None:
            tell("finding rooms")
            rooms = hn.find_rooms(model.grid)
        tell("building places")
        topology = model.grown(settings.pyramid, rooms)
        return Session(model, topology, settings, costs=costs, file=file)

    return make


def _endpoints(text: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return the two points of `X,Y:X,Y`."""
    points = [read_point(part) for part in text.split(":")]
    good = [p for p in points if p is not None and len(p) == _TWO and all(map(math.isfinite, p))]
    if len(points) != _TWO or len(good) != _TWO:
        raise UsageError(f"--route must be X,Y:X,Y in metres, got {text!r:.80}")
    return good[0], good[1]


def _save(
    session: Session,
    path: Path,
    pairs: list[tuple[tuple[float, ...], tuple[float, ...]]],
    preset: str,
) -> None:
    import numpy as np  # noqa: PLC0415 - help and wrong usage can do without

    from hybridnav.ext.page import save_page  # noqa: PLC0415 - loads numba and matplotlib
    from hybridnav.ext.page.requests import PlanQuery  # noqa: PLC0415

    queries: list[PlanQuery] = []
    for start, goal in pairs:
        first, last = session.grid.frame.positions_of(np.array([start, goal]))[:, ::-1].tolist()
        queries.append(PlanQuery(start=first, goal=last, preset=preset))
    save_page(session, path, queries)
    size = path.stat().st_size / 1e6
    answer(f"page       {printable(path)}, {size:.1f} MB, {len(queries)} routes\n")


# `hybridnav view` for a building of several floors.

VIEW_OPTIONS = frozenset(
    {
        *("map_file", "save", "routes", "port", "browser"),
        *("preset", "overrides", "robot_radius_m", "max_cells"),
    }
)
"""Parameters of `hybridnav view` that mean something for a building."""
_POINT = r"[^:]+,[^:]+"


def building_opening(given: Mapping[str, Any]) -> BuildingOpening | BuildingSession:
    """Return what the page of a building shows at once: the cells of its lowest floor, or a model,
    which has all that it needs.

    Parameters
    ----------
    given
        The values of the parameters of `hybridnav view` by their names.
    """
    # These load numba and matplotlib, which wrong usage can do without.
    from hybridnav.ext.fleet.files.entries import read_building_entries  # noqa: PLC0415
    from hybridnav.ext.fleet.files.read import load_floor  # noqa: PLC0415
    from hybridnav.ext.page import BuildingOpening  # noqa: PLC0415
    from hybridnav.planner.saved import is_model  # noqa: PLC0415

    file: Path = given["map_file"]
    if is_model(file):
        return building_session(given)
    floors = read_building_entries(file).floors
    source = BuildingSource.of(given)
    lowest = load_floor(
        floors[0],
        file.parent,
        robot_radius_m=source.robot_radius_m,
        preset=source.settings,
        max_cells=source.max_cells,
    )

    def make(tell: Callable[[str], None]) -> BuildingSession:
        tell(f"reading {len(floors)} floors" if len(floors) > 1 else "reading the floor")
        return building_session(given)

    names = [floor.name for floor in floors]
    return BuildingOpening(file.stem, names, lowest.grid, make)


def building_session(given: Mapping[str, Any]) -> BuildingSession:
    """Load a building, and return what its page shows.

    Parameters
    ----------
    given
        The values of the parameters of `hybridnav view` by their names.
    """
    building = BuildingSource.of(given).load({})
    # These load numba and matplotlib, which wrong usage can do without.
    from hybridnav.ext.fleet.files.entries import read_building_entries  # noqa: PLC0415
    from hybridnav.ext.page import BuildingSession  # noqa: PLC0415
    from hybridnav.planner.saved import is_model  # noqa: PLC0415

    file: Path = given["map_file"]
    if is_model(file):
        return BuildingSession(building, file.stem)
    entries = read_building_entries(file)
    files = _rooms_files(entries.floors, file.parent)
    return BuildingSession(building, file.stem, files, entries.links)


def _rooms_files(floors: Sequence[FloorEntry], folder: Path) -> dict[str, RoomsFile]:
    """Return the files of rooms that a description names in its folder, by floor."""
    from hybridnav.ext.page.rooms_file import RoomsFile  # noqa: PLC0415 - loads numpy

    found = {}
    for entry in floors:
        if entry.rooms_file is None:
            continue
        path = folder / entry.rooms_file
        if path.parent.resolve().is_relative_to(folder.resolve()):
            found[entry.name] = RoomsFile(path.parent, path.name)
    return found


def save_building(session: BuildingSession, path: Path, routes: Sequence[str]) -> None:
    """Write the page of a building into a file.

    Parameters
    ----------
    session
        What it shows.
    path
        The file.
    routes
        The routes as they were typed, `FLOOR:X,Y:FLOOR:X,Y`.
    """
    from hybridnav.ext.page import save_page  # noqa: PLC0415 - loads numba and matplotlib

    save_page(session, path, [_query(text, session) for text in routes])
    floors, size = len(session.sessions), path.stat().st_size / 1e6
    counts = f"{floors} floors, {size:.1f} MB, {len(routes)} routes"
    answer(f"page       {printable(path)}, {counts}\n")


def _query(text: str, session: BuildingSession) -> FloorsPlanQuery:
    """Return the query of a route as it was typed."""
    from hybridnav.ext.page.graph import in_grid  # noqa: PLC0415 - loads numpy
    from hybridnav.ext.page.requests import FloorPoint, FloorsPlanQuery  # noqa: PLC0415

    names = session.describe()["floors"]
    floor = "|".join(re.escape(name) for name in sorted(names, key=len, reverse=True))
    found = re.fullmatch(rf"({floor}):({_POINT}):({floor}):({_POINT})", text)
    if found is None:
        raise UsageError(
            "--route of a building must be FLOOR:X,Y:FLOOR:X,Y, floors of "
            f"{', '.join(names):.200}, got {text!r:.80}"
        )
    ends = []
    for name, typed in (found.group(1, 2), found.group(3, 4)):
        number = names.index(name)
        point = read_point(typed)
        if point is None or len(point) != 2 or not all(abs(part) < 1e6 for part in point):  # noqa: PLR2004
            raise UsageError(f"--route: {typed!r:.80} is no point X,Y in metres")
        at = in_grid(point, session.sessions[number].grid)
        ends.append(FloorPoint(floor=number, point=at))
    return FloorsPlanQuery(start=ends[0], goal=ends[1], preset=session.preset)
