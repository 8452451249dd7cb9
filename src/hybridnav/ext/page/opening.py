"""A page that opens before its map is prepared: cells first, then rooms, places and routes."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING, Any

from hybridnav.errors import HybridNavError
from hybridnav.ext.page.graph import map_facts
from hybridnav.ext.page.tiles import hex_colours, map_layer

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from hybridnav.ext.page.floors import BuildingSession
    from hybridnav.ext.page.session import Session
    from hybridnav.ext.page.tiles import Layer
    from hybridnav.maps import OccupancyGrid


_LOG = logging.getLogger("hybridnav.ext.page")


class PreparingError(HybridNavError):
    """Something was asked for that is not there yet."""


class Opening:
    """A map on a page, whose rooms, places and planner are prepared in a thread. Threads share it.

    Parameters
    ----------
    grid
        The map.
    make
        Makes the session; it is given what to call with the name of each stage.
    also
        Returns other sessions whose routes are prepared after that, for the other floors of a
        building.

    Examples
    --------
    >>> from hybridnav.ext.page import Opening, Session
    >>> hn.save(hn.example_map("figure1"), "figure1.hnm")
    >>> model = hn.load("figure1.hnm")
    >>> def make(tell):
    ...     tell("finding rooms")
    ...     topology = model.grown(model.fitted(None).pyramid, hn.find_rooms(model.grid))
    ...     return Session(model, topology, model.fitted(None))
    >>> opening = Opening(model.grid, make)
    >>> opening.describe()["ready"]
    False
    >>> opening.begin()
    >>> opening.wait()
    >>> opening.describe()["ready"]
    True
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        make: Callable[[Callable[[str], None]], Session],
        *,
        also: Callable[[], Iterable[Session]] = tuple,
    ) -> None:
        self._grid, self._make, self._also = grid, make, also
        self._layer = map_layer(grid)
        self._began = time.monotonic()
        self._stage = "preparing the map"
        self._session: Session | None = None
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
            session = self._make(self._tell)
            session.describe()  # rooms and their names, while nobody waits for them
            self._session = session
            self._tell("preparing routes")
            for each in (session, *self._also()):
                planner = each.planning.planner(each.planning.presets[0])
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
    def session(self) -> Session:
        """The session.

        Raises
        ------
        PreparingError
            While it is not there.
        """
        if self._session is None:
            raise PreparingError(f"not yet: {self._stage}")
        return self._session

    def state(self) -> dict[str, Any]:
        """Return how far it is: whether rooms and places are there, and what is being done."""
        return {
            "ready": self._session is not None,
            "stage": self._stage,
            "seconds": round(time.monotonic() - self._began, 1),
        }

    def describe(self) -> dict[str, Any]:
        """Return what a page needs to know of the map: its cells alone, until the rest is there."""
        if self._session is not None:
            return self._session.describe()
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

    def layer(self, name: str) -> Layer:
        """Return a layer; until all is there, only `map`.

        Raises
        ------
        PreparingError
            When it is not there yet.
        """
        if self._session is None and name == "map":
            return self._layer
        return self.session.layer(name)


# The page of a building that opens before all its floors are there.


class BuildingOpening:
    """A building on a page that begins with the cells of its lowest floor. Threads share it.

    Parameters
    ----------
    name
        What the page calls it.
    floors
        Names of the floors, from the lowest to the highest.
    grid
        The map of the lowest floor.
    make
        Makes the session; it is given what to call with the name of each stage.

    Examples
    --------
    >>> from hybridnav.ext.page import BuildingOpening, BuildingSession
    >>> grid = hn.example_map("figure1")
    >>> def make(tell):
    ...     tell("reading floors")
    ...     planner = hn.HybridPlanner(hn.TopologicalMap(hn.DualGraphPyramid.build(grid)))
    ...     return BuildingSession(hn.Building([hn.Floor("1", planner)]), "one floor")
    >>> opening = BuildingOpening("one floor", ["1"], grid, make)
    >>> opening.floor("0").describe()["ready"]
    False
    >>> opening.begin()
    >>> opening.wait()
    >>> opening.floor("0").describe()["ready"]
    True
    """

    def __init__(
        self,
        name: str,
        floors: Sequence[str],
        grid: OccupancyGrid,
        make: Callable[[Callable[[str], None]], BuildingSession],
    ) -> None:
        self._name, self._floors, self._make = name, list(floors), make
        self._made: BuildingSession | None = None
        self._lowest = Opening(grid, self._first, also=self._others)

    def _first(self, tell: Callable[[str], None]) -> Session:
        made = self._make(tell)
        self._made = made
        return made.sessions[0]

    def _others(self) -> Iterable[Session]:
        assert self._made is not None  # noqa: S101 - they come after the first
        return dict.fromkeys(self._made.sessions[1:])

    def begin(self, *, on_failure: Callable[[], object] = lambda: None) -> None:
        """Begin to prepare; see `Opening.begin`."""
        self._lowest.begin(on_failure=on_failure)

    def wait(self) -> None:
        """Wait until all is prepared, or has failed."""
        self._lowest.wait()

    @property
    def problem(self) -> Exception | None:
        """Why it could not be prepared; None while all is well."""
        return self._lowest.problem

    @property
    def session(self) -> BuildingSession:
        """The session.

        Raises
        ------
        PreparingError
            While it is not there.
        """
        self._lowest.session  # noqa: B018 - raises while it is not there
        assert self._made is not None  # noqa: S101 - the session of its lowest floor is there
        return self._made

    def floor(self, text: str) -> Session | Opening:
        """Return what is there of a floor by its number, as it stands in an address.

        Raises
        ------
        InvalidValueError
            When there is no such floor.
        PreparingError
            When it is not there yet.
        """
        try:
            return self.session.floor(text)
        except PreparingError:
            if text != "0":
                raise
            return self._lowest

    def describe(self) -> dict[str, Any]:
        """Return what a page needs to know of the building: its floors alone, until the rest is
        there."""
        try:
            return self.session.describe()
        except PreparingError:
            facts: dict[str, Any] = {"name": self._name, "floors": self._floors, "ready": False}
            return facts | {"links": [], "presets": []}
