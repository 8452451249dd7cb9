"""Files that the page hands out: route graph, model, path, rooms."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from hybridnav._files import printable
from hybridnav.errors import InvalidValueError, MapError
from hybridnav.graphs import build_route_graph
from hybridnav.io import export_nav2, export_path, export_rooms, save

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav.view.floors import BuildingSession
    from hybridnav.view.planning import Planning
    from hybridnav.view.requests import FloorsPathQuery, PathQuery

KINDS = {
    "nav2": "route-graph.geojson",
    "model": "model.hnm",
    "rooms": "rooms.geojson",
    "path-geojson": "path.geojson",
    "path-csv": "path.csv",
}
"""Name of the file of each kind."""
_OF_BUILDING = ("model", "path-geojson", "path-csv")


def exported(planning: Planning, kind: str, query: PathQuery | None, folder: Path) -> bytes:
    """Return the content of a file.

    Parameters
    ----------
    planning
        The planners.
    kind
        One of `KINDS`.
    query
        The query whose path is written; None for a file without a path.
    folder
        Where a temporary folder may lie for the time of the writing.

    Raises
    ------
    InvalidValueError
        When the kind is not known, or a path is wanted without a query.
    """
    if kind not in KINDS:
        raise InvalidValueError(f"a file is one of {', '.join(KINDS)}, got {kind!r:.80}")
    if kind.startswith("path") and query is None:
        raise InvalidValueError("a path needs a start and a goal")
    return _content(KINDS[kind], _writer(planning, kind, query), folder)


def exported_building(
    building: BuildingSession, kind: str, query: FloorsPathQuery | None, folder: Path
) -> tuple[str, bytes]:
    """Return the name and the content of a file about a whole building.

    Parameters
    ----------
    building
        The building.
    kind
        `model`, or `path-geojson` or `path-csv` for the part of a route on one floor.
    query
        The query whose path is written, and the floor; None for the model.
    folder
        Where a temporary folder may lie for the time of the writing.

    Raises
    ------
    InvalidValueError
        When the kind is not known, a path is wanted without a query, or the route does not visit
        the floor.
    """
    if kind not in _OF_BUILDING:
        raise InvalidValueError(f"a file is one of {', '.join(_OF_BUILDING)}, got {kind!r:.80}")
    if kind == "model":
        made = building.building(building.preset)
        return KINDS[kind], _content(
            KINDS[kind], lambda file: save(made, file, compress=True), folder
        )
    if query is None:
        raise InvalidValueError("a path needs a start, a goal and a floor")
    parts = building.on_floor(query)
    return KINDS[kind], _content(KINDS[kind], lambda file: export_path(parts, file), folder)


def _content(name: str, write: Callable[[Path], None], folder: Path) -> bytes:
    """Return what a writer writes; its temporary folder lies where the page may write."""
    try:
        with tempfile.TemporaryDirectory(prefix=".hybridnav-", dir=folder) as inside:
            file = Path(inside) / name
            try:
                write(file)
            except MapError as error:
                # What the temporary folder is called helps nobody.
                raise MapError(str(error).replace(printable(file), name)) from None
            return file.read_bytes()
    except OSError as error:
        where = printable(folder.resolve().name)
        raise MapError(
            f"{name} cannot be written: the folder {where} takes no files: {error.strerror}"
        ) from None


def _writer(planning: Planning, kind: str, query: PathQuery | None) -> Callable[[Path], None]:
    topology = planning.topology
    if kind == "nav2":
        return lambda file: export_nav2(build_route_graph(topology), file)
    if kind == "model":
        return lambda file: save(planning.planner(planning.presets[0]), file, compress=True)
    if kind == "rooms" or query is None:
        return lambda file: export_rooms(topology.rooms, file)
    result = planning.outcome(query)
    return lambda file: export_path(result, file)
