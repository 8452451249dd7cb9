"""The page itself: one HTML file, one style sheet, plain ES modules."""

from __future__ import annotations

import base64
import json
import tempfile
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hybridnav._base.files import printable, replace_file
from hybridnav.errors import InvalidValueError, MapError
from hybridnav.ext.graphs import build_lane_graph
from hybridnav.ext.graphs.files import export_nav2
from hybridnav.ext.page.tiles import TILE
from hybridnav.planner import export_path, export_rooms
from hybridnav.planner.guide import languages
from hybridnav.planner.saved import save

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hybridnav._base.typing import PathLike
    from hybridnav.ext.page.requests import PartQuery, PlanQuery
    from hybridnav.ext.page.session import Session
    from hybridnav.ext.page.site import Site
    from hybridnav.ext.page.tiles import Layer, Theme


_NAMES = (
    *("texts.js", "scene.js", "draw.js", "link.js", "route.js", "closures.js", "floors.js"),
    *("names.js", "ends.js", "pictures.js", "main.js"),
)
"""The modules of the page."""
ASSETS = (("page.css", "text/css"), *((name, "text/javascript") for name in _NAMES))
"""Names and kinds of the files beside the page."""
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""What the browser lets the page load: nothing but its own files."""
_SAVED_POLICY = (
    "default-src 'none'; script-src 'unsafe-inline' data: blob:; style-src 'unsafe-inline'; "
    "img-src data: blob:; base-uri 'none'; form-action 'none'"
)


def asset(name: str) -> str:
    """Return the text of a file of the page."""
    return (files("hybridnav.ext.page") / "assets" / name).read_text(encoding="utf-8")


def live_page() -> str:
    """Return the page that a server stands behind."""
    head = '<link rel="stylesheet" href="page.css">\n<script type="module" src="main.js"></script>'
    return asset("page.html").replace("<!-- head -->", head).replace("<!-- end -->", _texts())


def _texts() -> str:
    """Return the texts of the page in all languages, as its modules read them."""
    tables = ", ".join(f'"{code}": {asset(f"{code}.json")}' for code in languages())
    return f'<script type="application/json" id="texts">{{{tables}}}</script>\n'


def whole_page(data: object) -> str:
    """Return the page with everything inside, which opens without a server.

    `data`: what the server would answer, as plain values.
    """
    modules = "\n".join(_plain(asset(name)) for name in _NAMES)
    # `</script>` in a name of a room must not end the script.
    text = json.dumps(data, allow_nan=False).replace("<", "\\u003c")
    head = (
        f'<meta http-equiv="Content-Security-Policy" content="{_SAVED_POLICY}">\n'
        f"<style>\n{asset('page.css')}</style>\n"
    )
    end = _texts() + (
        f'<script type="application/json" id="saved">{text}</script>\n'
        f'<script type="module">\n{modules}</script>\n'
    )
    page = asset("page.html").replace("<!-- head -->", head)
    return page.replace("<!-- end -->", end)


def _plain(module: str) -> str:
    """Return a module's text without imports and exports: names differ between the modules."""
    lines = [line for line in module.splitlines() if not line.startswith("import ")]
    return "\n".join(line.removeprefix("export ") for line in lines)


# The page as one file that opens without a server.

_MOST_CELLS = 4_000_000
"""Cells of a picture of all floors in the file; larger maps are halved until they have no more."""
_THEMES: tuple[Theme, ...] = ("light", "dark")


def save_page(site: Site, path: PathLike, queries: Sequence[PlanQuery] = ()) -> None:
    """Write the page with its maps, their rooms and some routes into one HTML file.

    Parameters
    ----------
    site
        Its content.
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
    >>> from hybridnav.ext.page import Session, Site, save_page
    >>> grid = hn.example_map("figure1")
    >>> hn.save(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), "figure1.hnm")
    >>> model = hn.load("figure1.hnm")
    >>> topology = model.grown(model.fitted(None).pyramid, hn.find_rooms(model.grid))
    >>> save_page(Site.of_map(Session(model, topology, model.fitted(None))), "page.html")
    >>> Path("page.html").read_text()[:15]
    '<!doctype html>'
    """
    most = _MOST_CELLS // len(site.sessions)
    data: dict[str, Any] = {
        "map": site.describe(),
        "floors": [_map(session, most) for session in site.sessions],
        "routes": [
            query.model_dump(include={"start", "goal", "preset"}) | site.routes(query).plan(query)
            for query in queries
        ],
    }
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


# Files that the page hands out: route graph, model, path, rooms.

KINDS = {
    "nav2": "route-graph.geojson",
    "model": "model.hnm",
    "rooms": "rooms.geojson",
    "path-geojson": "path.geojson",
    "path-csv": "path.csv",
}
"""Name of the file of each kind."""
WHOLE = ("model", "path-geojson", "path-csv")
"""Those that are about the whole site; the others are about a floor."""


def exported(site: Site, kind: str, query: PartQuery | None, folder: Path) -> tuple[str, bytes]:
    """Return the name and the content of a file about a whole site.

    `kind`: one of `WHOLE`; `query`: the query whose path is written, and the floor; None for the
    model; `folder`: where a temporary folder may lie for the time of the writing. Raises
    `InvalidValueError` when the kind is not known, a path is wanted without a query, or the route
    does not visit the floor.
    """
    _check_kind(kind, WHOLE)
    if kind == "model":
        kept = site.routes().kept()
        return _content(kind, lambda file: save(kept, file, compress=True), folder)
    if query is None:
        raise InvalidValueError("a path needs a start, a goal and a floor")
    part = site.routes(query).on_floor(query)
    return _content(kind, lambda file: export_path(part, file), folder)


def exported_floor(session: Session, kind: str, folder: Path) -> tuple[str, bytes]:
    """Return the name and the content of a file about a floor.

    `kind`: `nav2` or `rooms`; `folder`: as for `exported`. Raises `InvalidValueError` when the kind
    is not known.
    """
    _check_kind(kind, [each for each in KINDS if each not in WHOLE])
    topology = session.planning.topology
    if kind == "nav2":
        graph = build_lane_graph(topology)
        return _content(kind, lambda file: export_nav2(graph, file), folder)
    return _content(kind, lambda file: export_rooms(topology.rooms, file), folder)


def _check_kind(kind: str, known: Sequence[str]) -> None:
    if kind not in known:
        raise InvalidValueError(f"a file is one of {', '.join(known)}, got {kind!r:.80}")


def _content(kind: str, write: Callable[[Path], None], folder: Path) -> tuple[str, bytes]:
    """Return the name of a file and what a writer writes; its temporary folder lies where the page
    may write."""
    name = KINDS[kind]
    try:
        with tempfile.TemporaryDirectory(prefix=".hybridnav-", dir=folder) as inside:
            file = Path(inside) / name
            try:
                write(file)
            except MapError as error:
                # What the temporary folder is called helps nobody.
                raise MapError(str(error).replace(printable(file), name)) from None
            return name, file.read_bytes()
    except OSError as error:
        where = printable(folder.resolve().name)
        raise MapError(
            f"{name} cannot be written: the folder {where} takes no files: {error.strerror}"
        ) from None
