"""`hybridnav view` for a building of several floors."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hybridnav._files import printable
from hybridnav.cli.building import BuildingSource
from hybridnav.cli.common import answer
from hybridnav.cli.errors import UsageError
from hybridnav.grid.names import read_point

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from hybridnav.io.building_entries import FloorEntry
    from hybridnav.view import BuildingOpening, BuildingSession
    from hybridnav.view.requests import FloorsPlanQuery
    from hybridnav.view.rooms_file import RoomsFile

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
    from hybridnav.io.building_entries import read_building_entries  # noqa: PLC0415
    from hybridnav.io.buildings import load_floor  # noqa: PLC0415
    from hybridnav.io.models import is_model  # noqa: PLC0415
    from hybridnav.view import BuildingOpening  # noqa: PLC0415

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
    from hybridnav.io.building_entries import read_building_entries  # noqa: PLC0415
    from hybridnav.io.models import is_model  # noqa: PLC0415
    from hybridnav.view import BuildingSession  # noqa: PLC0415

    file: Path = given["map_file"]
    if is_model(file):
        return BuildingSession(building, file.stem)
    entries = read_building_entries(file)
    files = _rooms_files(entries.floors, file.parent)
    return BuildingSession(building, file.stem, files, entries.links)


def _rooms_files(floors: Sequence[FloorEntry], folder: Path) -> dict[str, RoomsFile]:
    """Return the files of rooms that a description names in its folder, by floor."""
    from hybridnav.view.rooms_file import RoomsFile  # noqa: PLC0415 - loads numpy

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
    from hybridnav.view import save_page  # noqa: PLC0415 - loads numba and matplotlib

    save_page(session, path, [_query(text, session) for text in routes])
    floors, size = len(session.sessions), path.stat().st_size / 1e6
    counts = f"{floors} floors, {size:.1f} MB, {len(routes)} routes"
    answer(f"page       {printable(path)}, {counts}\n")


def _query(text: str, session: BuildingSession) -> FloorsPlanQuery:
    """Return the query of a route as it was typed."""
    from hybridnav.view.graph import in_grid  # noqa: PLC0415 - loads numpy
    from hybridnav.view.requests import FloorPoint, FloorsPlanQuery  # noqa: PLC0415

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
