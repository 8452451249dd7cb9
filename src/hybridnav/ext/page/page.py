"""The page itself: one HTML file, one style sheet, plain ES modules. Public: `Opening`."""

from __future__ import annotations

import base64
import json
import logging
import tempfile
import threading
import time
from collections.abc import Callable, Sequence
from importlib.resources import files
from itertools import product
from pathlib import Path
from typing import Any

from hybridnav._base.files import NewFile, printable
from hybridnav._base.typing import PathLike
from hybridnav.errors import HybridNavError, InvalidValueError, MapError
from hybridnav.ext.page.drawing import map_facts
from hybridnav.ext.page.requests import FloorPoint, PartQuery, PlanQuery, Stand, in_metres
from hybridnav.ext.page.session import Session
from hybridnav.ext.page.site import Site
from hybridnav.ext.page.tiles import TILE, MapLayer, Theme, heights_layer, hex_colours, map_layer
from hybridnav.graphs import build_lane_graph
from hybridnav.graphs.files import export_nav2
from hybridnav.guide.words import languages
from hybridnav.maps import OccupancyGrid
from hybridnav.models import export_path, export_rooms, save
from hybridnav.reasons import prove

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
_MOST_ENDS = 24
"""Rooms of all floors, the largest, between which a file has all routes."""
_Facts = dict[str, Any]
_THEMES: tuple[Theme, ...] = ("light", "dark")


def save_page(site: Site, path: PathLike, queries: Sequence[PlanQuery] = ()) -> int:
    """Write the page with its maps, their rooms, and routes between them into one HTML file.

    It has the routes between the 24 largest rooms, in all languages, and for each start on a map
    the heights of the proof of its farthest goal.

    Parameters
    ----------
    site
        Its content.
    path
        The file; one that exists is replaced.
    queries
        Further routes, which it shows first.

    Returns
    -------
    int
        How many routes it has.

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
    2
    >>> Path("page.html").read_text()[:15]
    '<!doctype html>'
    """
    most = _MOST_CELLS // len(site.sessions)
    ends = _ends(site)
    asked = [_between(site, *pair) for pair in product(ends, ends)]
    plans = [_in_languages(site, query) for query in asked]
    matrix = [plans[at : at + len(ends)] for at in range(0, len(plans), len(ends) or 1)]
    if ends and not queries:
        queries = [asked[max(range(len(plans)), key=lambda at: _length_m(plans[at]))]]
    floors = [_map(session, most) for session in site.sessions]
    if len(floors) == 1:
        _add_heights(floors[0], site.sessions[0], ends, matrix)
    data: dict[str, Any] = {
        "map": site.describe(),
        "floors": floors,
        "ends": ends,
        "matrix": matrix,
        "routes": [
            query.model_dump(include={"start", "goal", "preset"}) | _in_languages(site, query)
            for query in queries
        ],
    }
    NewFile(Path(path), f"page {printable(path)}").write(whole_page(data).encode())
    return len(plans) + len(queries)


def _ends(site: Site) -> list[dict[str, Any]]:
    """Return the rooms between which a file has all routes; none if the preset samples."""
    preset = site.routes().presets[0]
    if any(one.planning.planner(preset).preset.planner.sampling for one in site.sessions):
        return []
    candidates = []
    for number, session in enumerate(site.sessions):
        rooms = session.planning.topology.rooms
        named = zip(rooms.names, rooms.areas_m2.tolist(), rooms.fits & rooms.is_listed, strict=True)
        candidates += [(-area, number, name) for name, area, is_end in named if is_end]
    return [
        {"floor": number} | site.sessions[number].stand(Stand(name=name))
        for _, number, name in sorted(candidates)[:_MOST_ENDS]
    ]


def _between(site: Site, one: dict[str, Any], other: dict[str, Any]) -> PlanQuery:
    keys = ("floor", "point", "name")
    start, goal = (FloorPoint(**{key: end[key] for key in keys}) for end in (one, other))
    return PlanQuery(start=start, goal=goal, preset=site.routes().presets[0])


def _length_m(route: dict[str, Any]) -> float:
    return route["length_m"] or 0.0


def _in_languages(site: Site, query: PlanQuery) -> dict[str, Any]:
    plans = {
        code: site.routes(query).plan(query.model_copy(update={"language": code}))
        for code in languages()
    }
    said = {key: {code: plan[key] for code, plan in plans.items()} for key in ("words", "why")}
    return {**next(iter(plans.values())), **said}


def _add_heights(floor: _Facts, session: Session, ends: list[_Facts], matrix: Any) -> None:
    """Add to what a file has of a floor the heights of a proof for each end: that of the path of
    cells to its farthest goal."""
    floor["heights"] = {}
    planner, closed = session.planning.planner("octile"), session.out_of_order()
    if planner.costs is not None:
        return
    for number, (end, routes) in enumerate(zip(ends, matrix, strict=True)):
        farthest, route = max(zip(ends, routes, strict=True), key=lambda pair: _length_m(pair[1]))
        if not _length_m(route):
            continue
        start, goal = (in_metres(each["point"], session.grid) for each in (end, farthest))
        proof = prove(planner.plan(start, goal, blocked=closed))
        layer, most = heights_layer(session.grid, proof)
        floor["heights"][number] = [most, farthest["name"]]
        floor["tiles"][f"heights-{number}"] = _tiles(layer, _MOST_CELLS, is_overlay=True)


def _map(session: Session, most_cells: int) -> dict[str, Any]:
    """Return what a server would answer about a map, as plain values."""
    place = session.planning.topology.pyramid.place_level
    layers = {"map": "map", "rooms": "rooms", f"level-{place}": f"level-{place}"}
    return {
        "map": session.describe(),
        "graph": session.graph(str(place)),
        "rings": session.outlines()["rings"],
        "tiles": {name: _tiles(session.layer(layer), most_cells) for name, layer in layers.items()},
    }


def _tiles(layer: MapLayer, most_cells: int, *, is_overlay: bool = False) -> dict[str, Any]:
    """Return the tiles of a layer as addresses that hold their data, for both themes; an overlay is
    equal in both, and of one size."""
    rows, cols = layer.index.shape
    first = 0
    while (rows >> first) * (cols >> first) > most_cells:
        first += 1
    tiles = {}
    last = first if is_overlay else max(layer.n_zooms - 1, first)
    for zoom in range(first, last + 1):
        side = TILE << zoom
        for theme in _THEMES[:1] if is_overlay else _THEMES:
            for row in range(-(-rows // side)):
                for col in range(-(-cols // side)):
                    content = base64.b64encode(layer.png(zoom, row, col, theme, 9)).decode()
                    tiles[f"{theme}/{zoom}/{row}/{col}"] = f"data:image/png;base64,{content}"
    return {"first": first, "last": last, "found": tiles}


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


def _check_kind(kind: str, kinds: Sequence[str]) -> None:
    if kind not in kinds:
        raise InvalidValueError(f"a file is one of {', '.join(kinds)}, got {kind!r:.80}")


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


# A page that opens before its map is prepared: cells first, then rooms, places and routes.

_LOG = logging.getLogger("hybridnav.ext.page")


RETRY = {"retry-after": "1"}
"""Header of answers to requests that come too early: the seconds until the next one."""


class PreparingError(HybridNavError):
    """Something was asked for that is not there yet."""


class Opening:
    """A site on a page that begins with the cells of its lowest floor. Threads share it.

    The rooms, places and planners of its floors are prepared in a thread.

    Parameters
    ----------
    grid
        The map of the lowest floor.
    make
        Makes the site; it is given what to call with the name of each stage.
    name
        Its name on the page; None for the name of the map.
    floors
        Names of the floors, from the lowest to the highest; one map has none.

    Examples
    --------
    >>> from hybridnav.ext.page import Opening, Session, Site
    >>> hn.save(hn.example_map("figure1"), "figure1.hnm")
    >>> model = hn.load("figure1.hnm")
    >>> def make(tell):
    ...     tell("finding rooms")
    ...     topology = model.grown(model.fitted(None).pyramid, hn.find_rooms(model.grid))
    ...     return Site.of_map(Session(model, topology, model.fitted(None)))
    >>> opening = Opening(model.grid, make)
    >>> opening.floor("0").describe()["ready"]
    False
    >>> opening.begin()
    >>> opening.wait()
    >>> opening.floor("0").describe()["ready"]
    True
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        make: Callable[[Callable[[str], None]], Site],
        *,
        name: str | None = None,
        floors: Sequence[str] = ("",),
    ) -> None:
        self._make, self._floors = make, list(floors)
        self._name = grid.name if name is None else name
        self._cells = Cells(grid, lambda: self._stage)
        self._began = time.monotonic()
        self._stage = "preparing the map"
        self._site: Site | None = None
        self.problem: Exception | None = None
        """Why it could not be prepared; None while all is well."""
        self._thread = threading.Thread(target=self._prepare, daemon=True)
        self._on_failure: Callable[[], object] = lambda: None

    def begin(self, *, on_failure: Callable[[], object] = lambda: None) -> None:
        """Begin to prepare.

        Parameters
        ----------
        on_failure
            Called, in the thread, when it fails; `problem` then says why.
        """
        self._on_failure = on_failure
        self._began = time.monotonic()
        self._thread.start()

    def wait(self) -> None:
        """Wait until all is prepared, or has failed."""
        self._thread.join()

    def _prepare(self) -> None:
        try:
            site = self._make(self._tell)
            site.sessions[0].describe()  # rooms and their names, while nobody waits for them
            self._site = site
            self._tell("preparing routes")
            for session in dict.fromkeys(site.sessions):
                planner = session.planning.planner(session.planning.presets[0])
                planner.prepare(progress=self._count)
        except Exception as error:  # noqa: BLE001 - it is raised where the page is served
            self.problem = error
            self._on_failure()
        self._tell("")

    def _count(self, done: int, of: int) -> None:
        self._stage = f"preparing routes, {100 * done // max(of, 1)} %"

    def _tell(self, stage: str) -> None:
        _LOG.info("%s after %.1f s", stage or "ready", time.monotonic() - self._began)
        self._stage = stage

    @property
    def site(self) -> Site:
        """The site.

        Raises
        ------
        PreparingError
            While it is not there.
        """
        if self._site is None:
            raise PreparingError(f"not yet: {self._stage}")
        return self._site

    def floor(self, text: str) -> Session | Cells:
        """Return a floor by its number, as it stands in an address, as far as it is prepared.

        Raises
        ------
        InvalidValueError
            When there is no such floor.
        PreparingError
            When it is not there yet.
        """
        return self._cells if self._site is None and text == "0" else self.site.floor(text)

    def state(self) -> dict[str, Any]:
        """Return how far it is: whether rooms and places are there, and the present step."""
        return {
            "ready": self._site is not None,
            "stage": self._stage,
            "seconds": round(time.monotonic() - self._began, 1),
        }

    def describe(self) -> dict[str, Any]:
        """Return the facts that a page needs beside its maps: the floors alone, until the rest is
        there."""
        if self._site is not None:
            return self._site.describe()
        facts: dict[str, Any] = {"name": self._name, "ready": False, "floors": self._floors}
        return facts | {"links": [], "presets": []}


class Cells:
    """A floor that has its cells only."""

    def __init__(self, grid: OccupancyGrid, stage: Callable[[], str]) -> None:
        self._grid, self._layer, self._stage = grid, map_layer(grid), stage

    def describe(self) -> dict[str, Any]:
        """Return what a page needs to know to draw the cells."""
        nothing: dict[str, Any] = {"rooms": [], "doors": [], "version": 0, "unsaved": 0}
        return map_facts(self._grid, self._layer.n_zooms) | {
            "ready": False,
            "levels": [],
            "presets": [],
            "colours": {"light": hex_colours("light"), "dark": hex_colours("dark")},
            "can_save": False,
            "file": "",
            "no_file": "",
            "rooms": nothing | {"notice": ""},
        }

    def layer(self, name: str) -> MapLayer:
        """Return the layer `map`.

        Raises `PreparingError` when another one is asked for.
        """
        if name != "map":
            raise PreparingError(f"not yet: {self._stage()}")
        return self._layer
