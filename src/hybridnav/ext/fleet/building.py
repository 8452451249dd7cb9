"""Buildings: several floors with their planners, and the links that join them."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from hybridnav._base.progress import no_progress
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet.checks import check_floors, check_links, check_speed
from hybridnav.ext.fleet.floors import FloorTable, building_parts
from hybridnav.ext.fleet.links import LinkNetwork
from hybridnav.ext.fleet.plan import Answers, BuildingAlternatives
from hybridnav.ext.fleet.search import Endpoint, LinkSearch
from hybridnav.maps.names import did_you_mean, place_of_name
from hybridnav.planner import PlanStatus
from hybridnav.planner.endpoints import cells_of_endpoints, read_point, refusal
from hybridnav.planner.named import check_names

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Mapping, Sequence

    from numpy.typing import ArrayLike

    from hybridnav._base.progress import Progress
    from hybridnav.ext.fleet.floors import Floor, Known
    from hybridnav.ext.fleet.links import Link
    from hybridnav.ext.fleet.plan import BuildingPlan
    from hybridnav.planner import HybridPlanner
    from hybridnav.planner.blocked import Closable
    from hybridnav.planner.named import At
    from hybridnav.planner.saved.container import Part
    from hybridnav.search.found import ClosedCells


class Building:
    """Several floors of a building, joined by links: lifts, stairs and ramps.

    Threads may share it. Its planners may follow changes of their maps and costs
    (`HybridPlanner.update`): what is known of the floor before is then forgotten.

    Parameters
    ----------
    floors
        The floors, from the lowest to the highest: planners of one preset, for one robot.
    links
        The links between them.
    speed_m_s
        Metres per second that the robot drives: a second of a ride costs as many metres.

    Raises
    ------
    InvalidValueError
        When two floors or two links have one name, the planners differ in preset or robot radius,
        or plan with headings, a link names an unknown floor, or the robot cannot stand at an end of
        a link that it fits in.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, Link, LinkEnd
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floors = [Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")]
    >>> ends = LinkEnd("1", (0.5, 0.5)), LinkEnd("2", (0.5, 0.5))
    >>> lift = Link(name="lift", kind="lift", ends=ends, wait_s=20, ride_s=5)
    >>> building = Building(floors, [lift])
    >>> plan = building.plan(("1", (1.5, 0.5)), ("2", (2.0, 2.5)))
    >>> round(plan.length_m, 3), plan.charge_m, plan.gap
    (3.546, 12.5, 0.0)
    """

    def __init__(
        self, floors: Sequence[Floor], links: Sequence[Link] = (), *, speed_m_s: float = 0.5
    ) -> None:
        check_floors(floors)
        check_links(links, floors)
        self.floors = tuple(floors)
        self.links = tuple(links)
        self.speed_m_s = check_speed(speed_m_s)
        self._index_of = {floor.name: number for number, floor in enumerate(floors)}
        ends: dict[str, list[tuple[str, tuple[float, float]]]] = {f.name: [] for f in floors}
        for link in links:
            for end in link.ends:
                ends[end.floor].append((link.name, end.position_m))
        self._rows = {
            (name, floor): row for floor in ends for row, (name, _) in enumerate(ends[floor])
        }
        self._tables = [
            FloorTable(floor, np.array([at for _, at in ends[floor.name]]).reshape(-1, 2))
            for floor in floors
        ]
        self._networks: dict[tuple[frozenset[str], bool], LinkNetwork] = {}

    def __repr__(self) -> str:
        floors, links = len(self.floors), len(self.links)
        return (
            f"Building({floors} floor{'s' if floors != 1 else ''}, "
            f"{links} link{'s' if links != 1 else ''})"
        )

    @property
    def robot_radius_m(self) -> float:
        """Radius of the robot that all floors are for, in metres."""
        return self.floors[0].planner.grid.robot_radius_m

    def floor(self, name: str) -> Floor:
        """Return the floor with a name.

        Raises
        ------
        InvalidValueError
            When there is none; the message suggests the nearest ones.
        """
        return self.floors[self._floor_index(name)]

    def link(self, name: str) -> Link:
        """Return the link with a name.

        Raises
        ------
        InvalidValueError
            When there is none; the message suggests the nearest ones.
        """
        known = tuple(link.name for link in self.links)
        return self.links[place_of_name(name, known, "link")]

    def plan(  # noqa: PLR0913 - start, goal, and conditions with defaults
        self,
        start: FloorWaypoint,
        goal: FloorWaypoint,
        *,
        blocked: Mapping[str, Closable] | None = None,
        closed_links: Collection[str] = (),
        stairs: bool = True,
        at: At = "anywhere",
    ) -> BuildingPlan:
        """Plan a route between two points, or rooms, of any floors.

        Parameters
        ----------
        start, goal
            The name of a floor, and a point `(x, y)` in metres of its frame or the name of a room
            or of a point on it: `("3", (1.5, 2.0))`, `("3", "kitchen")`. Or such a name alone if
            only one floor has it.
        blocked
            Closures for this query by the name of the floor, each as in `HybridPlanner.plan`.
        closed_links
            Names of links that are out of order.
        stairs
            Whether the robot takes stairs.
        at
            Position in a named room, as in `HybridPlanner.plan`.

        Returns
        -------
        BuildingPlan
            A cheapest route by all links that may be used, or a status that states the reason.

        Raises
        ------
        InvalidValueError
            When a floor, link or name is not known, a name is that of rooms on several floors, a
            point is not two finite numbers, or a closed item is not on its floor.
        """
        return self._plans(start, goal, blocked, (closed_links, stairs), at, (1, 1.0))[0]

    def alternatives(  # noqa: PLR0913 - start, goal, count, and conditions with defaults
        self,
        start: FloorWaypoint,
        goal: FloorWaypoint,
        count: int,
        *,
        max_stretch: float = 2.0,
        blocked: Mapping[str, Closable] | None = None,
        closed_links: Collection[str] = (),
        stairs: bool = True,
        at: At = "anywhere",
    ) -> BuildingAlternatives:
        """Plan routes by different links, the cheapest first.

        Two routes differ if the sequences of their links do; no route takes a link twice. The lower
        bound of each is that of all routes, so that its gap states by how much it can be dearer
        than the optimum.

        Parameters
        ----------
        start, goal, blocked, closed_links, stairs, at
            As in `plan`.
        count
            Most routes.
        max_stretch
            Cost of a route over that of the first one, at most.

        Returns
        -------
        BuildingAlternatives
            Plans. There are fewer than `count` where there are no more, or where the search stopped
            before (its `complete` is False then); one unsolved plan if there is no route.

        Raises
        ------
        InvalidValueError
            As in `plan`, or when the count or the stretch is below 1.
        """
        if isinstance(count, bool) or not isinstance(count, int) or count < 1:
            raise InvalidValueError(f"count must be a whole number from 1 on, got {count!r:.40}")
        if not max_stretch >= 1:
            raise InvalidValueError(f"max_stretch must be 1 or more, got {max_stretch!r:.40}")
        limits = count, max_stretch
        return self._plans(start, goal, blocked, (closed_links, stairs), at, limits)

    def prepare(self, *, progress: Progress = no_progress) -> None:
        """Build the structures of all planners, and the costs between the ends of links, now.

        Floors with more than 128 ends have none computed in advance: queries compute what they
        need.

        Parameters
        ----------
        progress
            Called after each floor with the number of floors done and of all floors.
        """
        for number, floor in enumerate(self.floors, start=1):
            floor.planner.prepare()
            self._current()[number - 1].fill()
            progress(number, len(self.floors))

    @property
    def known(self) -> tuple[Known, ...]:
        """What is known of the costs between the ends of links on each floor."""
        return tuple(table.known for table in self._current())

    def adopt(self, known: Sequence[Known]) -> None:
        """Take over what another building of the same maps, links and preset has computed.

        Parameters
        ----------
        known
            `known` of that building.
        """
        self._tables = [
            FloorTable(table.floor, table.positions_m, of)
            for table, of in zip(self._tables, known, strict=True)
        ]

    def model_parts(
        self, parts_of: Callable[[HybridPlanner], list[Part]], *, compress: bool
    ) -> list[Part]:
        """Return the parts of the file of its model, for `save`."""
        return building_parts(
            self.floors, self.links, self.known, self.speed_m_s, parts_of, compress=compress
        )

    def _floor_index(self, name: str) -> int:
        return place_of_name(name, tuple(self._index_of), "floor")

    def _current(self) -> list[FloorTable]:
        """Return the tables, new ones for floors whose maps or costs have changed."""
        for number, table in enumerate(self._tables):
            if not table.is_current:
                self._tables[number] = table.renewed()
        return list(self._tables)

    def _network(self, closed_links: Collection[str], stairs: bool) -> LinkNetwork:  # noqa: FBT001
        """Return the links that may be used."""
        if isinstance(closed_links, str):
            raise InvalidValueError(
                f"closed_links must be names of links, got the text {closed_links!r:.80}: put it "
                "into a list"
            )
        key = frozenset(self.link(name).name for name in closed_links), bool(stairs)
        found = self._networks.get(key)
        if found is None:
            radius_m = self.robot_radius_m
            links = [
                link
                for link in self.links
                if link.name not in key[0] and link.admits(radius_m, stairs=key[1])
            ]
            found = LinkNetwork(links, self._index_of, self._rows, self.speed_m_s)
            self._networks = {**dict(list(self._networks.items())[-15:]), key: found}
        return found

    def _plans(  # noqa: PLR0913, PLR0917 - what both public methods were given
        self,
        start: FloorWaypoint,
        goal: FloorWaypoint,
        blocked: Mapping[str, Closable] | None,
        usable: tuple[Collection[str], bool],
        at: At,
        limits: tuple[int, float],
    ) -> BuildingAlternatives:
        """Plan as many routes as are wanted; again where a map changes meanwhile."""
        began = time.perf_counter()
        network = self._network(*usable)
        answers = Answers(self.floors, network, self.speed_m_s)
        while True:
            tables = self._current()
            endpoints = (
                endpoint_of("start", start, self.floors),
                endpoint_of("goal", goal, self.floors),
            )
            closed = self._closed(blocked)
            search = LinkSearch(network, tables, endpoints, closed, at)
            found = answers.found(search, endpoints, limits, began)
            if not found[0].solved:
                refused = refusal_of(endpoints, self.floors, closed)
                found = found if refused is None else (answers.refused(refused, endpoints),)
            if all(table.is_current for table in tables):
                return BuildingAlternatives.of(found, limits, complete=search.is_complete)

    def _closed(self, blocked: Mapping[str, Closable] | None) -> dict[int, ClosedCells]:
        """Return the closed cells of floors, by index."""
        closed = {}
        for name, closure in (blocked or {}).items():
            index = self._floor_index(name)
            cells = self.floors[index].planner.closed(closure)
            if cells is not None:
                closed[index] = cells
        return closed


# Starts and goals in buildings: a floor, and a point or a name on it.

FloorWaypoint: TypeAlias = "str | tuple[str, ArrayLike | str]"
"""A floor and a point or name on it, or a name that only one floor has."""


def endpoint_of(what: str, given: Any, floors: Sequence[Floor]) -> Endpoint:
    """Return the floor of a start or goal, and the point or name on it.

    Parameters
    ----------
    what
        "start" or "goal".
    given
        What the caller gave.
    floors
        The floors of the building.

    Raises
    ------
    InvalidValueError
        When it is neither, the floor or the name is not known, the name is on several floors, or
        the point is not two finite numbers.
    """
    if isinstance(given, str):
        index, waypoint = _floor_of_name(given, floors), given
    elif isinstance(given, tuple | list) and len(given) == 2 and isinstance(given[0], str):  # noqa: PLR2004
        names = tuple(floor.name for floor in floors)
        index, waypoint = place_of_name(given[0], names, "floor"), given[1]
    else:
        raise InvalidValueError(
            f"{what} must be a floor and a point or name on it, such as ('3', (1.5, 2.0)), or a "
            f"name alone, got {given!r:.80}"
        )
    if isinstance(waypoint, str):
        check_names(floors[index].planner.topology, [waypoint])
        return Endpoint(index, waypoint)
    return Endpoint(index, read_point(what, waypoint))


def _floor_of_name(name: str, floors: Sequence[Floor]) -> int:
    """Return the index of the only floor that has a name."""
    names_of = [
        () if floor.rooms is None else (*floor.rooms.names, *floor.rooms.points) for floor in floors
    ]
    found = [number for number, names in enumerate(names_of) if name in names]
    if len(found) == 1:
        return found[0]
    if not found:
        known = tuple(dict.fromkeys(each for names in names_of for each in names))
        hint = did_you_mean(name, known) if known else ": no floor has rooms"
        raise InvalidValueError(f"no room or point of the building is called {name!r:.80}{hint}")
    on = " and ".join(floors[number].name for number in found[:3])
    raise InvalidValueError(
        f"{name!r:.80} is a name on floors {on}: give the floor too, as in "
        f"{floors[found[0]].name}:{name:.80}, or in Python the pair of floor and name"
    )


def refusal_of(
    endpoints: tuple[Endpoint, Endpoint], floors: Sequence[Floor], closed: dict[int, ClosedCells]
) -> PlanStatus | None:
    """Return the status of a query whose start or goal point cannot be entered; None if both can,
    and for names."""
    for end, kind in zip(endpoints, ("START", "GOAL"), strict=True):
        if isinstance(end.waypoint, str):
            continue
        planner = floors[end.floor].planner
        grid, allowed = planner.grid, planner.preset.planner.allow_unexplored
        point = read_point(kind, end.waypoint)
        cells = cells_of_endpoints(grid, (point, point), allow_unexplored=allowed)
        status = cells if isinstance(cells, PlanStatus) else None
        shut = planner.closed_for_all(closed.get(end.floor))
        if status is None and shut is not None and not isinstance(cells, PlanStatus):
            status = refusal(shut, cells, grid.shape)
        if status is not None:
            return PlanStatus[status.name.replace("START", kind)]
    return None
