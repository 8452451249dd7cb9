"""Files that the page hands out: route graph, model, path, rooms."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from hybridnav.errors import InvalidValueError
from hybridnav.graphs import build_route_graph
from hybridnav.io import export_nav2, export_path, export_rooms, save

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav.view.planning import Planning
    from hybridnav.view.requests import PathQuery

KINDS = {
    "nav2": "route-graph.geojson",
    "model": "model.hnm",
    "rooms": "rooms.geojson",
    "path-geojson": "path.geojson",
    "path-csv": "path.csv",
}
"""Name of the file of each kind."""


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
    with tempfile.TemporaryDirectory(prefix=".hybridnav-", dir=folder) as inside:
        file = Path(inside) / KINDS[kind]
        _writer(planning, kind, query)(file)
        return file.read_bytes()


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
