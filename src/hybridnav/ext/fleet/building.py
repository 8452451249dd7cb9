"""Buildings: several floors with their planners, and the links that join them."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.clock import clock
from hybridnav._base.progress import Progress, no_progress
from hybridnav.closures import Journal
from hybridnav.closures.blocked import Blocked, Closable, as_blocked
from hybridnav.errors import InvalidValueError, MapError, brief
from hybridnav.ext.fleet import checks, why
from hybridnav.ext.fleet.floors import Floor, FloorTable, Known, building_parts
from hybridnav.ext.fleet.links import ClosedLink, Endpoint, Link, LinkNetwork, left_by
from hybridnav.ext.fleet.plan import BuildingAlternatives, BuildingPlan
from hybridnav.ext.fleet.search import Answers, LinkSearch
from hybridnav.maps.names import place_of_name
from hybridnav.models.container import Part
from hybridnav.planning import HybridPlanner, Profile
from hybridnav.planning.named import At
from hybridnav.planning.private_rooms import Privacy
from hybridnav.planning.profile import PROFILES, profile_of
from hybridnav.reasons.why import explain_solved
from hybridnav.search.found import ClosedCells

FloorWaypoint: TypeAlias = "str | tuple[str, ArrayLike | str]"
"""A floor and a point or name on it, or a name that only one floor has."""

_MOST_PROFILED = 7
"""Profiles beside the last one whose planners are kept."""


class _Asked(NamedTuple):
    """The conditions of a query; see `Building.plan`."""

    blocked: Mapping[str, Closable]
    closed_links: Collection[Any]
    """As given, `ClosedLink` once they are checked."""
    stairs: bool
    at: At


class Building:
    """Several floors of a building, joined by links: lifts, stairs and ramps.

    Threads may share it. Its planners may follow changes of their maps and costs
    (`HybridPlanner.update`): earlier distances of the floor are then forgotten.

    Parameters
    ----------
    floors
        The floors, from the lowest to the highest: planners of one preset, for one robot.
    links
        The links between them.
    speed_m_s
        Metres per second that the robot drives: a second of a ride costs as many metres.
    profiles
        Profiles beside those of `hybridnav.planning.PROFILES`, or in place of one of their names.
    journal
        Things out of order: closed for all queries until they are opened again. None for none.

    Raises
    ------
    InvalidValueError
        When two floors or two links have one name, or a link names an unknown floor. When the
        planners differ in preset or robot radius, or plan with headings. When the robot cannot
        stand at an end of a link that it fits in.

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
        self,
        floors: Sequence[Floor],
        links: Sequence[Link] = (),
        *,
        speed_m_s: float = 0.5,
        profiles: Sequence[Profile] = (),
        journal: Journal | None = None,
    ) -> None:
        checks.check_floors(floors)
        checks.check_links(links, floors)
        self.floors = tuple(floors)
        self.links = tuple(links)
        self.speed_m_s = checks.check_speed(speed_m_s)
        self.profiles = tuple({one.name: one for one in (*PROFILES, *profiles)}.values())
        """The profiles that `plan` knows by name."""
        self.journal = journal
        self._privacy: Privacy | None = None
        self._profiled: dict[Profile, tuple[list[FloorTable], Building]] = {}
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
        self._networks: dict[tuple[frozenset[ClosedLink], bool], LinkNetwork] = {}

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
        names = tuple(link.name for link in self.links)
        return self.links[place_of_name(name, names, "link")]

    def plan(  # noqa: PLR0913 - start, goal, and conditions with defaults
        self,
        start: FloorWaypoint,
        goal: FloorWaypoint,
        *,
        blocked: Mapping[str, Closable] | None = None,
        closed_links: Collection[str] = (),
        stairs: bool = True,
        at: At = "anywhere",
        profile: Profile | str | None = None,
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
            Names of links that are out of order, with `@FLOOR` for one floor: `"north lift@2"`; or
            with the one direction that is left: `"stairs=up"`.
        stairs
            Whether the robot takes stairs.
        at
            Position in a named room, as in `HybridPlanner.plan`.
        profile
            A `Profile`, or the name of one of `profiles`. Its costs, width, links and closed rooms
            hold, also for the bound. None for the robot of the maps, which passes all rooms.

        Returns
        -------
        BuildingPlan
            A cheapest route by all links that may be used, or a status that states the reason.

        Raises
        ------
        InvalidValueError
            When a floor, link, profile or name is not known, or a name is that of rooms on several
            floors. When a point is not two finite numbers, or a closed item is not on its floor.
        MapError
            When the journal cannot be read, or closes things that are not in the building.
        """
        asked = _Asked(blocked or {}, closed_links, stairs, at)
        return self._under_profile(start, goal, asked, profile, (1, 1.0))[0]

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
        profile: Profile | str | None = None,
    ) -> BuildingAlternatives:
        """Plan routes by different links, the cheapest first.

        Two routes differ if the sequences of their links do; no route takes a link twice. The lower
        bound of each is that of all routes, so that its gap states by how much it can be dearer
        than the optimum.

        Parameters
        ----------
        start, goal, blocked, closed_links, stairs, at, profile
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
        asked = _Asked(blocked or {}, closed_links, stairs, at)
        return self._under_profile(start, goal, asked, profile, (count, max_stretch))

    def least_m(
        self,
        start: FloorWaypoint,
        goal: FloorWaypoint,
        *,
        blocked: Mapping[str, Closable] | None = None,
        closed_links: Collection[str] = (),
    ) -> float:
        """Return a bound on the cost of a route without planning one, by straight lines and links.

        Parameters
        ----------
        start, goal, blocked, closed_links
            As in `plan`.

        Returns
        -------
        float
            Metres that no route costs less than; infinite where no links join the floors.
        """
        asked = self._in_order(_Asked(blocked or {}, closed_links, stairs=True, at="anywhere"))
        return self._search(start, goal, asked)[0].bound()

    def prepare(self, *, progress: Progress = no_progress) -> None:
        """Build the structures of all planners, and the costs between the ends of links, now.

        Floors with more than 128 ends have none computed in advance: queries compute them as
        needed.

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
        """Known costs between the ends of links on each floor."""
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
        facts = {"speed_m_s": self.speed_m_s, "profiles": self.profiles}
        return building_parts(
            self.floors, self.links, self.known, facts, parts_of, compress=compress
        )

    def _floor_index(self, name: str) -> int:
        return place_of_name(name, tuple(self._index_of), "floor")

    def _current(self) -> list[FloorTable]:
        """Return the tables, new ones for floors whose maps or costs have changed."""
        for number, table in enumerate(self._tables):
            if not table.is_current:
                self._tables[number] = table.renewed()
        return list(self._tables)

    def _network(self, closed: Collection[ClosedLink], stairs: bool) -> LinkNetwork:  # noqa: FBT001
        """Return the links that may be used."""
        key = frozenset(closed), bool(stairs)
        network = self._networks.get(key)
        if network is None:
            radius_m = self.robot_radius_m
            fitting = [link for link in self.links if link.admits(radius_m, stairs=key[1])]
            links = [left for link in fitting if (left := left_by(link, key[0])) is not None]
            network = LinkNetwork(links, self._index_of, self._rows, self.speed_m_s, key[0])
            self._networks = {**dict(list(self._networks.items())[-15:]), key: network}
        return network

    def _under_profile(
        self,
        start: FloorWaypoint,
        goal: FloorWaypoint,
        asked: _Asked,
        profile: Profile | str | None,
        limits: tuple[int, float],
    ) -> BuildingAlternatives:
        """Plan as many routes as are wanted, under a profile, without what is out of order."""
        asked = self._in_order(asked)
        if profile is None:
            return self._with_reasons(self._plans(start, goal, asked, limits), start, goal, asked)
        chosen = profile_of(profile, self.profiles)

        def plans(one: Profile, most: tuple[int, float]) -> BuildingAlternatives:
            return self._under(one)._plans(start, goal, asked, most)  # noqa: SLF001 - a like one

        def wider(one: Profile) -> tuple[BuildingPlan, Sequence[Floor]]:
            return plans(one, (1, 1.0))[0], self._under(one).floors

        under = self._under(chosen)
        routes = under._with_reasons(plans(chosen, limits), start, goal, asked)  # noqa: SLF001
        note = "" if routes[0].solved else checks.reason_under(chosen, wider)
        of: dict[str, Any] = {"profile": chosen.name, "note": note}
        return routes.told(of)

    def _with_reasons(
        self,
        routes: BuildingAlternatives,
        start: FloorWaypoint,
        goal: FloorWaypoint,
        asked: _Asked,
    ) -> BuildingAlternatives:
        if routes[0].solved:
            return routes
        shut = why.shut_of(asked.blocked, asked.closed_links, stairs=asked.stairs)

        def is_solved(still: list[why.Shut]) -> bool:
            given = asked._replace(**why.conditions(still, asked.blocked))
            return self._plans(start, goal, given, (1, 1.0))[0].solved

        endpoints = checks.endpoints_of(start, goal, self.floors)
        network = self._network((), stairs=True)

        def shut_on(blocked: Mapping[str, Closable]) -> dict[str, Blocked]:
            """Return what is closed on floors, with what the profile closes."""
            on = {name: as_blocked(given) for name, given in blocked.items()}
            for index, own in self._closures(blocked, endpoints, network)[1].items():
                name = self.floors[index].name
                on[name] = on.get(name, Blocked()) | own
            return on

        always = why.conditions([], asked.blocked)["blocked"]
        opening = why.to_open(shut, is_solved), shut_on(asked.blocked), shut_on(always)
        of: dict[str, Any] = {
            "reasons": why.reasons(routes[0], endpoints, self.floors, network, opening),
            "to_open": tuple(one.named("en") for one in opening[0]),
        }
        return routes.told(of)

    def _under(self, profile: Profile) -> Building:
        """Return the building under a profile, made anew where a map or costs have changed."""
        tables = self._current()
        kept = self._profiled.get(profile)
        if kept is None or any(a is not b for a, b in zip(kept[0], tables, strict=True)):
            floors = checks.floors_under(self.floors, profile)
            links = checks.links_under(self.links, {floor.name: floor for floor in floors}, profile)
            made = Building(floors, links, speed_m_s=self.speed_m_s)
            own = Privacy(profile, checks.profiled(floors, profile))
            shut = [
                table.closing(table.floor.planner.closed(own.rooms_closed(number)))
                for number, table in enumerate(made._current())
            ]
            made._privacy, made._tables = own, shut
            last = list(self._profiled.items())[-_MOST_PROFILED:]
            self._profiled = {**dict(last), profile: (tables, made)}
            return made
        return kept[1]

    def _in_order(self, asked: _Asked) -> _Asked:
        """Return the conditions of a query with what the journal closes."""
        if not isinstance(asked.blocked, Mapping):
            raise InvalidValueError(
                "blocked of a building must be a mapping from names of floors to what is closed "
                f"there, as {{{brief(self.floors[0].name)}: {{'doors': [4]}}}}, "
                f"got {asked.blocked!r:.80}"
            )
        links_given = asked.closed_links
        if isinstance(links_given, str) or not isinstance(links_given, Iterable):
            raise InvalidValueError(
                f"closed_links must be a list of names of links, as ['lift', 'stairs@2'], got "
                f"{links_given!r:.80}"
            )
        blocked = dict(asked.blocked)
        links = [ClosedLink.of(text, self.links) for text in links_given]
        for item in () if self.journal is None else self.journal.items():
            try:
                if item.link is not None:
                    links.append(ClosedLink.of(item.link, self.links))
                    continue
                floor = self.floor(item.floor or "")
                floor.planner.closed(item.blocked)
            except InvalidValueError as error:
                raise MapError(f"closed {item.what}: {error}; open it by its name") from None
            given = blocked.get(floor.name)
            own = item.blocked if given is None else as_blocked(given) | item.blocked
            blocked[floor.name] = own
        return asked._replace(blocked=blocked, closed_links=links)

    def _plans(
        self, start: FloorWaypoint, goal: FloorWaypoint, asked: _Asked, limits: tuple[int, float]
    ) -> BuildingAlternatives:
        """Plan as many routes as are wanted; again where a map changes meanwhile."""
        began = clock()
        answers = Answers(
            self.floors, self._network(asked.closed_links, asked.stairs), self.speed_m_s
        )
        while True:
            search, tables, endpoints, closed = self._search(start, goal, asked)
            plans = answers.found(search, endpoints, limits, began)
            if not plans[0].solved:
                refused = checks.refusal_of(endpoints, self.floors, closed)
                plans = plans if refused is None else (answers.refused(refused, endpoints),)
            if all(table.is_current for table in tables):
                return BuildingAlternatives.of(plans, limits, complete=search.is_complete)

    def _search(
        self, start: FloorWaypoint, goal: FloorWaypoint, asked: _Asked
    ) -> tuple[LinkSearch, list[FloorTable], tuple[Endpoint, Endpoint], dict[int, ClosedCells]]:
        """Return the search of a query, and what it is made of."""
        network, tables = self._network(asked.closed_links, asked.stairs), self._current()
        endpoints = checks.endpoints_of(start, goal, self.floors)
        closed = self._closed(asked.blocked, endpoints, network)
        search = LinkSearch(network, tables, endpoints, closed, asked.at)
        return search, tables, endpoints, closed

    def _closed(
        self,
        blocked: Mapping[str, Closable],
        endpoints: tuple[Endpoint, Endpoint],
        network: LinkNetwork,
    ) -> dict[int, ClosedCells]:
        """Return the closed cells of floors, by index, where they are others than always."""
        closed, more = self._closures(blocked, endpoints, network)
        own = self._privacy
        if own is None:
            return closed
        for index, table in enumerate(self._tables):
            cells_of, shut = table.floor.planner.closed, closed.get(index)
            closure = own.joined(cells_of, more.get(index), shut)
            if closure is not table.closed:
                closed[index] = closure or ClosedCells(np.empty(0, dtype=np.int64))
        return closed

    def _closures(
        self,
        blocked: Mapping[str, Closable],
        endpoints: tuple[Endpoint, Endpoint],
        network: LinkNetwork,
    ) -> tuple[dict[int, ClosedCells], dict[int, Blocked]]:
        """Return what a query closes on floors, by index, and what the profile closes there."""
        closed = {}
        for name, closure in blocked.items():
            index = self._floor_index(name)
            cells = self.floors[index].planner.closed(closure)
            if cells is not None:
                closed[index] = cells
        if self._privacy is None:
            return closed, {}
        ends = [(end.floor, end.waypoint) for end in endpoints]
        links: list[list[tuple[int, ArrayLike]]] = [[] for _ in network.links]
        for end in network.ends:
            position_m = self._tables[end.floor].positions_m[end.at]
            links[end.link].append((end.floor, position_m))
        return closed, self._privacy.blocked(ends, closed, links)


def legs_of(
    building: Building, waypoints: Sequence[FloorWaypoint], how: Mapping[str, Any]
) -> list[BuildingPlan]:
    """Plan from each waypoint to the next, up to a leg without a route.

    `how`: conditions as `plan` takes them. A leg begins where the one before it ended, also in a
    named room.
    """
    legs: list[BuildingPlan] = []
    start = waypoints[0]
    for goal in waypoints[1:]:
        legs.append(building.plan(start, goal, **how))
        if not legs[-1].solved:
            break
        path = legs[-1].results[-1].path
        assert path is not None  # noqa: S101 - it is solved
        x, y = path.points[-1][:2].tolist()
        start = legs[-1].goal[0], (x, y)
    return legs


def tightest(
    building: Building,
    legs: Sequence[BuildingPlan],
    blocked: Mapping[str, Blocked],
    language: str,
    *,
    radius_m: float | None = None,
) -> list[str]:
    """Return, for each floor of a route, the widest robot that could go, and the tightest place.

    `blocked`: what the query closes on floors; `radius_m`: of who goes, None for the robot.
    """
    journal, lines = building.journal, []
    for before, leg in zip([None, *legs], legs, strict=False):
        begin = leg.start[1] if before is None else before.goal[1]
        last = len(leg.floors) - 1
        for at, (name, result) in enumerate(zip(leg.floors, leg.results, strict=True)):
            assert result.path is not None  # noqa: S101 - it is solved
            ends = result.path.points[0][:2], result.path.points[-1][:2]
            named = begin if at == 0 else None, leg.goal[1] if at == last else None
            shut = blocked.get(name, Blocked())
            shut |= Blocked() if journal is None else journal.closures(name)
            planner = building.floor(name).planner
            reasons = explain_solved(planner, ends, named, blocked=shut, radius_m=radius_m)
            lines += [why.on_floor(name, line, language) for line in reasons.words(language)]
    return list(dict.fromkeys(lines))  # a tour passes a place again
