"""The page as one file that opens without a server."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hybridnav._files import printable, replace_file
from hybridnav.errors import MapError
from hybridnav.view.floors import BuildingSession
from hybridnav.view.page import whole_page
from hybridnav.view.tiles import TILE

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav._typing import PathLike
    from hybridnav.view.requests import FloorsPlanQuery, PlanQuery
    from hybridnav.view.session import Session
    from hybridnav.view.tiles import Layer, Theme

_MOST_CELLS = 4_000_000
"""Cells of a picture of all floors in the file; larger maps are halved until they have no more."""
_THEMES: tuple[Theme, ...] = ("light", "dark")


def save_page(
    shown: Session | BuildingSession,
    path: PathLike,
    queries: Sequence[PlanQuery | FloorsPlanQuery] = (),
) -> None:
    """Write the page with its maps, their rooms and some routes into one HTML file.

    Parameters
    ----------
    shown
        What it shows: a map, or a building with all its floors.
    path
        The file; one that exists is replaced.
    queries
        The routes that it holds, planned now.

    Raises
    ------
    MapError
        When the file cannot be written.

    Examples
    --------
    >>> from pathlib import Path
    >>> from hybridnav.view import Session, save_page
    >>> grid = hn.example_map("figure1")
    >>> hn.save(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), "figure1.hnm")
    >>> model = hn.load("figure1.hnm")
    >>> topology = model.grown(model.fitted(None).pyramid, hn.find_rooms(model.grid))
    >>> save_page(Session(model, topology, model.fitted(None)), "page.html")
    >>> Path("page.html").read_text()[:15]
    '<!doctype html>'
    """
    if isinstance(shown, BuildingSession):
        most = _MOST_CELLS // len(shown.sessions)
        floors = [_map(session, most) for session in shown.sessions]
        data: dict[str, Any] = {"map": shown.describe(), "floors": floors}
    else:
        data = _map(shown, _MOST_CELLS)
    plan: Any = shown.plan if isinstance(shown, BuildingSession) else shown.planning.plan
    data["routes"] = [
        query.model_dump(include={"start", "goal", "preset"}) | plan(query) for query in queries
    ]
    try:
        replace_file(Path(path), whole_page(data).encode())
    except OSError as error:
        raise MapError(f"page {printable(path)}: cannot write: {error.strerror}") from None


def _map(session: Session, most_cells: int) -> dict[str, Any]:
    """Return what a server would answer about a map, as plain values."""
    place = session.planning.topology.pyramid.place_level
    layers = {"map": "map", "rooms": "rooms", f"level-{place}": f"level-{place}"}
    return {
        "map": session.describe(),
        "graph": session.graph(str(place)),
        "tiles": {name: _tiles(session.layer(layer), most_cells) for name, layer in layers.items()},
    }


def _tiles(layer: Layer, most_cells: int) -> dict[str, Any]:
    """Return the tiles of a layer as addresses that hold their data, for both themes."""
    rows, cols = layer.index.shape
    first = 0
    while (rows >> first) * (cols >> first) > most_cells:
        first += 1
    found = {}
    for zoom in range(first, max(layer.n_zooms, first + 1)):
        side = TILE << zoom
        for theme in _THEMES:
            for row in range(-(-rows // side)):
                for col in range(-(-cols // side)):
                    content = base64.b64encode(layer.png(zoom, row, col, theme)).decode()
                    found[f"{theme}/{zoom}/{row}/{col}"] = f"data:image/png;base64,{content}"
    return {"first": first, "found": found}
