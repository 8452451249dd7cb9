"""The page of a building that opens before all its floors are there."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hybridnav.view.opening import Opening, PreparingError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from hybridnav.grid import OccupancyGrid
    from hybridnav.view.floors import BuildingSession
    from hybridnav.view.session import Session


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
    >>> from hybridnav.view import BuildingOpening, BuildingSession
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
