"""`hybridnav view`: a local page for people who would rather click than type. Public: `serve`."""

from __future__ import annotations

import re
import secrets
import socket
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from hybridnav._base.files import printable
from hybridnav.cli import options
from hybridnav.cli.common import UsageError, answer, check_output
from hybridnav.cli.map_options import FloorOptions, MapOptions
from hybridnav.cli.options import Costs, OneMap, option
from hybridnav.cli.reading import check_room_to_be
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet.command import load_floors, preset_of_floors
from hybridnav.maps.names import read_point

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from typing_extensions import Self

    import hybridnav as hn
    from hybridnav.ext.fleet.files.entries import Entries, FloorEntry
    from hybridnav.ext.page import Opening, Site
    from hybridnav.ext.page.kept import RoomsFile

_ROOMS = "rooms.yaml"
_TWO = 2
_FAR_M = 1e6
"""Metres beyond which no map reaches."""
_POINT = r"[^:]+,[^:]+"

SaveOption = Annotated[
    Path | None, option("--save FILE", "Write the page into one .html file instead of serving it.")
]
RouteOption = Annotated[
    list[str] | None,
    option(
        "--route X,Y:X,Y",
        "A route of the saved page, in metres; FLOOR:X,Y:FLOOR:X,Y in a building. May be repeated.",
    ),
]
PortOption = Annotated[int, option("--port N", "Port on 127.0.0.1; 0 for any.", min=0, max=65535)]
BrowserOption = Annotated[bool, option("--browser/--no-browser", "Open the page in the browser.")]
EditsOption = Annotated[
    bool,
    option(
        "--allow-edits",
        "Let programs that call the server close and open doors and rooms, and name rooms.",
    ),
]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ViewOptions(FloorOptions):
    """The options of `hybridnav view`."""

    save: SaveOption = None
    routes: RouteOption = None
    port: PortOption = 0
    browser: BrowserOption = True
    allow_edits: EditsOption = False
    rooms_file: OneMap[options.RoomsOption] = None
    costs: OneMap[options.CostsOption] = None


def view(args: ViewOptions) -> None:
    """Open MAP as a page: click routes, close doors, name rooms.

    The page is on 127.0.0.1; Ctrl-C ends it. Without --rooms, rooms are those of rooms.yaml beside
    the map, if there. MAP may be a building: the page then has its floors.

    Example: hybridnav view maps/office/office.yaml --save office.html
    """
    check_output(args.save, "--save", (".html",))
    if args.routes and args.save is None:
        raise UsageError("--route is for a saved page: add --save FILE, or leave it out")
    page: MapPage | BuildingPage
    if args.is_building:
        page = BuildingPage(args)
    else:
        for text in args.routes or ():
            _ends(text, ("",))
        page = MapPage.read(args, args.rooms_file, options.parsed_costs(args.costs))
    if args.save is not None:
        _save(page.make(lambda _: None), args.save, args.routes or ())
    else:
        _serve(page, args.port, browser=args.browser, allow_edits=args.allow_edits)


def _serve(source: MapPage | BuildingPage, port: int, *, browser: bool, allow_edits: bool) -> None:
    """Serve a page until Ctrl-C, and print its address."""

    def ready(address: str) -> None:
        answer(f"page       {address}\nCtrl-C     ends it\n")
        if browser:
            import webbrowser  # noqa: PLC0415 - on demand

            webbrowser.open(address)

    serve(source.opening(), source.folder, port=port, allow_edits=allow_edits, ready=ready)


@dataclass(frozen=True)
class MapPage:
    """The page of one map; the file of its rooms is read before it opens."""

    model: hn.Model
    settings: hn.Preset
    file: RoomsFile
    rooms: hn.RoomLabels | None
    costs: hn.CostLayer | None
    journal: hn.Journal

    @classmethod
    def read(cls, args: MapOptions, rooms_file: Path | None, costs: Costs) -> Self:
        """Read a map, and its rooms."""
        # These load numba, which help and wrong usage can do without.
        import hybridnav as hn  # noqa: PLC0415
        from hybridnav.ext.page.kept import RoomsFile  # noqa: PLC0415

        preset = options.PRESET if costs else None
        settings = args.settings(preset, overrides=costs.overrides)
        model = args.load(settings, {})
        check_room_to_be(model.grid, allow_unexplored=settings.planner.allow_unexplored)
        path = args.map_file.parent / _ROOMS if rooms_file is None else rooms_file
        file, journal = RoomsFile(path.parent, path.name), hn.Journal(args.map_file)
        rooms = hn.load_rooms(path, model.grid) if path.exists() else model.rooms
        return cls(model, settings, file, rooms, costs.read(model.grid), journal)

    @property
    def folder(self) -> Path:
        """The only folder in which anything is written."""
        return self.file.folder

    def opening(self) -> Opening:
        """Return what the page shows at once: the cells."""
        from hybridnav.ext.page import Opening  # noqa: PLC0415 - loads numba and matplotlib

        return Opening(self.model.grid, self.make)

    def make(self, tell: Callable[[str], None]) -> Site:
        """Return what the page shows then."""
        # These load numba and matplotlib, which help and wrong usage can do without.
        import hybridnav as hn  # noqa: PLC0415
        from hybridnav.ext.page import Session, Site  # noqa: PLC0415

        rooms = self.rooms
        if rooms is None:
            tell("finding rooms")
            rooms = hn.find_rooms(self.model.grid)
        tell("building places")
        topology = self.model.grown(self.settings.pyramid, rooms)
        return Site.of_map(
            Session(
                self.model,
                topology,
                self.settings,
                costs=self.costs,
                file=self.file,
                journal=self.journal,
            )
        )


@dataclass(frozen=True)
class BuildingPage:
    """The page of a building."""

    args: MapOptions

    @property
    def file(self) -> Path:
        """The file of the building."""
        return self.args.map_file

    @property
    def folder(self) -> Path:
        """The only folder in which anything is written."""
        return self.file.parent

    def opening(self) -> Opening | Site:
        """Return what the page shows at once: the cells of the lowest floor, or a model, which has
        all that it needs."""
        # These load numba and matplotlib, which wrong usage can do without.
        from hybridnav.ext.fleet.files.read import load_floor  # noqa: PLC0415
        from hybridnav.ext.page import Opening  # noqa: PLC0415

        entries = self._entries()
        if entries is None:
            return self.make(lambda _: None)
        lowest = load_floor(
            entries.floors[0],
            self.folder,
            robot_radius_m=self.args.robot_radius_m,
            preset=preset_of_floors(self.args),
            max_cells=self.args.max_cells,
        )
        names = [floor.name for floor in entries.floors]
        return Opening(lowest.grid, self.make, name=self.file.stem, floors=names)

    def make(self, tell: Callable[[str], None]) -> Site:
        """Load the building, and return what the page shows then."""
        from hybridnav.ext.page import Site  # noqa: PLC0415 - loads numba and matplotlib

        entries, name = self._entries(), self.file.stem
        n_floors = 0 if entries is None else len(entries.floors)
        tell(f"reading {n_floors} floors" if n_floors != 1 else "reading the floor")
        building = load_floors(self.args, {})
        if entries is None:
            return Site.of_building(building, name)
        files = _rooms_files(entries.floors, self.folder)
        return Site.of_building(building, name, files, entries.links)

    def _entries(self) -> Entries | None:
        """Return what the file of the building describes; None for a model."""
        from hybridnav.ext.fleet.files.entries import read_building_entries  # noqa: PLC0415
        from hybridnav.models.model import is_model  # noqa: PLC0415

        return None if is_model(self.file) else read_building_entries(self.file)


def _rooms_files(floors: Sequence[FloorEntry], folder: Path) -> dict[str, RoomsFile]:
    from hybridnav.ext.page.kept import RoomsFile  # noqa: PLC0415 - loads numpy

    files = {}
    for entry in floors:
        if entry.rooms_file is None:
            continue
        path = folder / entry.rooms_file
        if path.parent.resolve().is_relative_to(folder.resolve()):
            files[entry.name] = RoomsFile(path.parent, path.name)
    return files


# The page as a file.


def _save(site: Site, path: Path, routes: Sequence[str]) -> None:
    """Write a page into a file, with routes as they were typed."""
    from hybridnav.ext.page import save_page  # noqa: PLC0415 - loads numba and matplotlib
    from hybridnav.ext.page.requests import FloorPoint, PlanQuery  # noqa: PLC0415

    queries = []
    for text in routes:
        start, goal = (
            FloorPoint(
                floor=number, point=list(site.sessions[number].grid.frame.position_of(*point)[::-1])
            )
            for number, point in _ends(text, site.names)
        )
        queries.append(PlanQuery(start=start, goal=goal, preset=site.routes().presets[0]))
    n_routes = save_page(site, path, queries)
    counts = f"{path.stat().st_size / 1e6:.1f} MB, {n_routes} routes"
    floors = f"{len(site.names)} floors, " if site.names[0] else ""
    answer(f"page       {printable(path)}, {floors}{counts}\n")


def _ends(text: str, names: Sequence[str]) -> list[tuple[int, tuple[float, ...]]]:
    """Return the floors and points of a route as it was typed, `X,Y:X,Y` for a map."""
    before = {f"{name}:" if name else "": number for number, name in enumerate(names)}
    floor = "|".join(re.escape(each) for each in sorted(before, key=len, reverse=True))
    match = re.fullmatch(rf"({floor})({_POINT}):({floor})({_POINT})", text)
    expected = "must be X,Y:X,Y in metres"
    if names[0]:
        listed = f"{', '.join(names):.200}"
        expected = f"of a building must be FLOOR:X,Y:FLOOR:X,Y, floors of {listed}"
    refusal = f"--route {expected}, got {text!r:.80}"
    if match is None:
        raise UsageError(refusal)
    ends = []
    for prefix, typed in (match.group(1, 2), match.group(3, 4)):
        point = read_point(typed)
        if point is None or len(point) != _TWO or not all(abs(part) < _FAR_M for part in point):
            no_point = f"--route: {typed!r:.80} is no point X,Y in metres"
            raise UsageError(no_point if names[0] else refusal)
        ends.append((before[prefix], point))
    return ends


# The server on 127.0.0.1.


def serve(
    shown: Site | Opening,
    folder: Path,
    *,
    port: int = 0,
    allow_edits: bool = False,
    ready: Callable[[str], object] | None = None,
) -> None:
    """Serve a page on 127.0.0.1 until Ctrl-C.

    Parameters
    ----------
    shown
        The content of the page: a site, or one that is prepared meanwhile.
    folder
        The only folder in which anything is written.
    port
        The port; 0 for a free one.
    allow_edits
        Whether programs that call the server may change the map for others, as people may.
    ready
        Called with the address, which holds a token that nobody can guess.

    Raises
    ------
    InvalidValueError
        When the port is taken or out of range, or the extra `view` is not installed.
    HybridNavError
        When the map cannot be prepared.

    Examples
    --------
    >>> from contextlib import suppress
    >>> from pathlib import Path
    >>> from hybridnav.ext.page import Session, Site, serve
    >>> grid = hn.example_map("figure1")
    >>> hn.save(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)), "figure1.hnm")
    >>> model = hn.load("figure1.hnm")
    >>> topology = model.grown(model.fitted(None).pyramid, hn.find_rooms(model.grid))
    >>> site = Site.of_map(Session(model, topology, model.fitted(None)))
    >>> def ready(address):
    ...     print(address[:17])
    ...     raise KeyboardInterrupt  # as Ctrl-C does
    >>> with suppress(KeyboardInterrupt):
    ...     serve(site, Path(), ready=ready)
    http://127.0.0.1:
    """
    try:
        from hybridnav.ext.page import app  # noqa: PLC0415 - an extra
    except ModuleNotFoundError as error:
        raise InvalidValueError(
            f"the page needs the package {error.name}, which is not installed: "
            "pip install 'hybridnav[view]'"
        ) from None
    from hybridnav.ext.page import Opening  # noqa: PLC0415 - loads numba and matplotlib

    opening = shown if isinstance(shown, Opening) else None
    token = secrets.token_urlsafe(24)
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as listening:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            listening.bind(("127.0.0.1", port))
        except (OSError, OverflowError) as error:
            reason = getattr(error, "strerror", "expected one from 0 to 65535")
            raise InvalidValueError(f"port {port} cannot be used: {reason}") from None
        listening.listen(app.MOST_CONNECTIONS)
        port = listening.getsockname()[1]
        server = app.make_server(
            app.make_app(shown, token=token, port=port, folder=folder, allow_edits=allow_edits)
        )
        if opening is not None:
            opening.begin(on_failure=lambda: setattr(server, "should_exit", True))
        if ready is not None:
            ready(f"http://127.0.0.1:{port}/{token}/")
        server.run(sockets=[listening])
    if opening is not None and opening.problem is not None:
        raise opening.problem
