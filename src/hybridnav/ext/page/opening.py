"""A page that opens before its map is prepared: cells first, then rooms, places and routes."""

from __future__ import annotations

import logging
import threading
import time
from typing import TYPE_CHECKING, Any

from hybridnav.errors import HybridNavError
from hybridnav.ext.page.drawing import map_facts
from hybridnav.ext.page.tiles import hex_colours, map_layer

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hybridnav.ext.page.session import Session
    from hybridnav.ext.page.site import Site
    from hybridnav.ext.page.tiles import Layer
    from hybridnav.maps import OccupancyGrid


_LOG = logging.getLogger("hybridnav.ext.page")


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

    def layer(self, name: str) -> Layer:
        """Return the layer `map`.

        Raises `PreparingError` when another one is asked for.
        """
        if name != "map":
            raise PreparingError(f"not yet: {self._stage()}")
        return self._layer
