"""What one page shows: a session for each floor, and routes over all of them. Public: `Site`."""

from __future__ import annotations

import threading
from copy import copy
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeAlias

from hybridnav._base.trig import dist
from hybridnav.errors import InvalidValueError
from hybridnav.ext.fleet import Building, BuildingPlan, Floor
from hybridnav.ext.fleet.checks import check_closing
from hybridnav.ext.fleet.plan import GuidedRoute
from hybridnav.ext.page.kept import Closings, Named, RoomsFile
from hybridnav.ext.page.requests import facts_of, finite, in_grid, in_metres, lines_of
from hybridnav.ext.page.session import Session
from hybridnav.guide import Tour
from hybridnav.models import Model
from hybridnav.planning import PROFILES, HybridPlanner, load_preset, preset_names
from hybridnav.rooms import Rooms, find_rooms

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from typing_extensions import Self

    from hybridnav.closures import Blocked, OutOfOrder
    from hybridnav.ext.fleet.files.entries import EndEntry, LinkEntry
    from hybridnav.ext.page.drawing import PagePlanning
    from hybridnav.ext.page.requests import AlternativesQuery, PartQuery, PathQuery, PlanQuery

_MOST_DIGITS = 3
_NO_FILE = (
    "Changes of rooms of this floor cannot be saved here: give the floor rooms: FILE in the file "
    "of the building, inside its folder, or export the model, which keeps them."
)
_IN_MODEL = (
    "This building is a model: Save is for maps. Export the model to keep changes of rooms; they "
    "are lost when the command ends."
)
_NEAR_M = 1.0
"""Metres from a door within which the end of a link is taken to be at it."""


Routes: TypeAlias = "PagePlanning | _OverFloors"
"""What plans between points of the floors of a site, in grid units. One floor and several differ
here alone: on one map a route is described by its rooms and doors, and others differ from it by
these; over floors both go by links."""


class Site:
    """The content of a page: a map, or the floors of a building. Threads may share it.

    A map is a site of one floor, whose name is empty: nothing on the page names it.

    Parameters
    ----------
    name
        What the page calls it.
    floors
        The floors by their names, from the lowest to the highest.
    routes
        Returns what plans over them now: changes of rooms make it anew.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor
    >>> from hybridnav.ext.page import Site
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floors = [Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")]
    >>> Site.of_building(Building(floors), "two floors").describe()["floors"]
    ['1', '2']
    """

    def __init__(
        self,
        name: str,
        floors: Mapping[str, Session],
        routes: Callable[[], Routes],
        closings: Closings,
    ) -> None:
        self.name = name
        self.names, self.sessions = tuple(floors), tuple(floors.values())
        self._routes = routes
        self.closings = closings
        """The profiles, and what is out of order."""

    @classmethod
    def of_map(cls, session: Session) -> Self:
        """Return the site of one map."""
        closings = Closings(
            PROFILES, session.journal, lambda item: item.check_on(session.planning.topology)
        )
        return cls(session.grid.name, {"": session}, lambda: session.planning, closings)

    @classmethod
    def of_building(
        cls,
        building: Building,
        name: str,
        files: Mapping[str, RoomsFile] | None = None,
        links: Sequence[LinkEntry] = (),
    ) -> Self:
        """Return the site of a building.

        Floors without rooms get the rooms that `find_rooms` finds. Floors of one map have one
        session: a change of its rooms is one on both.

        Parameters
        ----------
        building
            The building.
        name
            What the page calls it.
        files
            The files of rooms by the names of floors; rooms of other floors cannot be saved. None
            for a building that no file describes, such as that of a model.
        links
            The links as the file of the building describes them: a page that saves rooms says which
            of them name a room or a door that is there no more.
        """
        routes = _OverFloors(building, files, links)
        names = [floor.name for floor in building.floors]
        closings = Closings(building.profiles, building.journal, routes.check_closing)
        return cls(name, dict(zip(names, routes.sessions, strict=True)), lambda: routes, closings)

    @property
    def site(self) -> Site:
        """The site itself; see `Opening.site`."""
        return self

    def floor(self, text: str) -> Session:
        """Return the session of a floor by its number, as it stands in an address.

        Raises
        ------
        InvalidValueError
            When there is no such floor.
        """
        is_number = text.isascii() and text.isdigit() and len(text) < _MOST_DIGITS
        number = int(text) if is_number else -1
        self._check(number, text)
        return self.sessions[number]

    @property
    def named(self) -> Named:
        """The rooms that the robot fits in, and all points, each with the number of its floor."""
        pairs: list[tuple[int, str]] = []
        for number, session in enumerate(self.sessions):
            rooms = session.planning.topology.rooms
            fitting = [name for name, fits in zip(rooms.names, rooms.fits, strict=True) if fits]
            points = [name for name in rooms.labels.points if name not in rooms.names]
            pairs += [(number, name) for name in (*fitting, *points)]
        return Named(self.name, self.names, pairs)

    def building(self, preset: str) -> Building:
        """Return the building with planners by a preset, of the rooms as they are now.

        Raises
        ------
        InvalidValueError
            When there is no such preset, it cannot plan over floors, or the site is one map.
        """
        routes = self._routes()
        if not isinstance(routes, _OverFloors):
            raise InvalidValueError(f"{self.name} is one map, not a building")
        return routes.building(preset)

    def _check(self, number: int, given: object) -> None:
        if not 0 <= number < len(self.sessions):
            raise InvalidValueError(
                f"floors are from 0 to {len(self.sessions) - 1}, got {given!r:.40}"
            )

    def describe(self) -> dict[str, Any]:
        """Return the facts that a page needs beside its maps."""
        routes = self._routes()
        facts = {"name": self.name, "ready": True, "floors": list(self.names)}
        return facts | {"links": routes.links, "presets": routes.presets}

    def state(self) -> dict[str, Any]:
        """Return that everything is there; see `Opening.state`."""
        return {"ready": True, "stage": ""}

    def changes(self) -> dict[str, Any]:
        """Return what may have changed: the journal, and the version of each floor."""
        versions = [session.version for session in self.sessions]
        return self.closings.describe() | {"versions": versions}

    def routes(self, query: PathQuery | None = None) -> Routes:
        """Return what answers a query, whose floors there are, each closed once.

        Raises
        ------
        InvalidValueError
            When there is no such floor, or one is given twice.
        """
        closed = [] if query is None else [each.floor for each in query.closed.floors]
        for number in closed if query is None else (query.start.floor, query.goal.floor, *closed):
            self._check(number, number)
        if len(set(closed)) < len(closed):
            raise InvalidValueError(f"a floor is given twice: {closed}"[:200])
        return self._routes()


class _OverFloors:
    """Routes over the floors of a building; see `Site.of_building`."""

    def __init__(
        self, building: Building, files: Mapping[str, RoomsFile] | None, links: Sequence[LinkEntry]
    ) -> None:
        self._building = building
        self._first = building.floors[0].planner.preset.name
        self._made = {self._first: building}
        self._making = threading.Lock()
        names: dict[HybridPlanner, list[str]] = {}
        for floor in building.floors:
            names.setdefault(floor.planner, []).append(floor.name)
        made = {
            planner: self._session(planner, here, files, links) for planner, here in names.items()
        }
        self.sessions = tuple(made[floor.planner] for floor in building.floors)

    def _session(
        self,
        planner: HybridPlanner,
        names: Sequence[str],
        files: Mapping[str, RoomsFile] | None,
        links: Sequence[LinkEntry],
    ) -> Session:
        """Return the session of the floors of one map, whose planner keeps what it has prepared."""
        model, topology = Model(planner.grid), planner.topology
        if not topology.has_rooms:
            topology = model.grown(planner.preset.pyramid, find_rooms(model.grid))
        file = (files or {}).get(names[0])
        session = Session(model, topology, planner.preset, costs=planner.costs, file=file)
        if self._building.journal is not None and len(names) == 1:
            session.out_of_order = partial(self._building.journal.closures, names[0])
        session.no_file = _IN_MODEL if files is None else _NO_FILE
        ends = [(link, end) for link in links for end in link.ends if end.floor in names]
        session.caution = lambda rooms: self._caution(rooms, ends)
        session.planning.adopt(planner)
        return session

    def _caution(self, rooms: Rooms, ends: Sequence[tuple[LinkEntry, EndEntry]]) -> str:
        """Return which links of the file rooms have left without their end."""
        lost = []
        for link, end in ends:
            names = (*rooms.names, *rooms.labels.points)
            if end.room is not None and end.room not in names:
                lost.append(f"link {link.name} names room {end.room}")
            elif end.door is not None and not self._is_at(rooms, link.name, end):
                lost.append(f"link {link.name} names door {end.door}")
        if not lost:
            return ""
        what = ", ".join(lost)
        return f"{what}, which is there no more: change it in the file of the building"

    def _is_at(self, rooms: Rooms, link: str, end: EndEntry) -> bool:
        """Return whether the end of a link still lies at its door, which merged rooms have lost."""
        placed = self._building.link(link).end_on(end.floor)
        door = next((door for door in rooms.doors if door.number == end.door), None)
        if placed is None or door is None:
            return False
        return dist(placed.position_m, door.position) <= max(door.width_m, _NEAR_M)

    @property
    def presets(self) -> list[str]:
        """The names to choose from, the one of the start first."""
        others = [name for name in preset_names() if name != self._first and _is_plain(name)]
        return [self._first, *others]

    @property
    def links(self) -> list[dict[str, Any]]:
        """The links as plain values."""
        building, number_of = self._building, self._number_of
        return [
            {
                "name": link.name,
                "kind": link.kind,
                "label": link.label,
                "fits": link.admits(building.robot_radius_m),
                "ends": [
                    {
                        "floor": number_of[end.floor],
                        "at": in_grid(end.position_m, self.sessions[number_of[end.floor]].grid),
                    }
                    for end in link.ends
                ],
            }
            for link in building.links
        ]

    def check_closing(self, item: OutOfOrder) -> None:
        """Refuse to close what is not in the building, with the rooms as they are now."""
        check_closing(item, self.building(self._first).floors, self._building.links)

    @property
    def _number_of(self) -> dict[str, int]:
        return {floor.name: number for number, floor in enumerate(self._building.floors)}

    def kept(self) -> Building:
        """Return what a model of the building holds."""
        return self.building(self._first)

    def building(self, preset: str) -> Building:
        """Return the building with planners by a preset; see `Site.building`."""
        planners = [session.planning.planner(preset) for session in self.sessions]
        with self._making:
            made = self._made.get(preset)
            if made is None or any(
                floor.planner is not planner
                for floor, planner in zip(made.floors, planners, strict=True)
            ):
                floors = [
                    Floor(floor.name, planner, floor.elevation_m)
                    for floor, planner in zip(self._building.floors, planners, strict=True)
                ]
                made = Building(
                    floors,
                    self._building.links,
                    speed_m_s=self._building.speed_m_s,
                    profiles=self._building.profiles,
                    journal=self._building.journal,
                )
                self._made[preset] = made
            return made

    def plan(self, query: PlanQuery) -> dict[str, Any]:
        """Return a plan over floors with its certificate; unless it is brief, with words."""
        plan = self._outcome(query)
        return self._facts(plan, query.language) | ({} if query.brief else self._words(plan, query))

    def alternatives(self, query: AlternativesQuery) -> dict[str, Any]:
        start, goal = self._ends(query)
        building, how = self.building(query.preset), self._how(query)
        plans = building.alternatives(start, goal, query.count, **how)
        routes = [self._facts(plan, query.language) | self._words(plan, query) for plan in plans]
        few = len(routes) < query.count
        note = "there are no more routes by other links up to twice as dear" if few else ""
        return {"routes": routes, "complete": not few, "note": note}

    def on_floor(self, query: PartQuery) -> Tour:
        """Return the parts of a route on one floor, to be written.

        Raises `InvalidValueError` when there is no route, or it does not visit the floor.
        """
        name = self._building.floors[query.floor].name
        plan = self._outcome(query)
        here = [
            part for floor, part in zip(plan.floors, plan.results, strict=True) if floor == name
        ]
        if not plan.solved:
            raise InvalidValueError(f"there is no route: {plan.status}")
        if not here:
            raise InvalidValueError(f"the route does not visit floor {name}: choose another floor")
        return Tour(tuple(here), ())

    def _words(self, plan: BuildingPlan, query: PathQuery) -> dict[str, Any]:
        source = plan.instructions_source
        if query.goal.name is not None and isinstance(source, GuidedRoute):
            plan = replace(plan, instructions_source=replace(source, goal=query.goal.name))
        numbers = [self._number_of[name] for name in plan.floors]
        floors = [(number, self.sessions[number].grid) for number in numbers]
        return {"words": lines_of(plan.instructions, query.language, floors)}

    def _outcome(self, query: PathQuery) -> BuildingPlan:
        start, goal = self._ends(query)
        building = self.building(query.preset)
        if query.all_open:
            building = copy(building)
            building.journal = None
        return building.plan(start, goal, **self._how(query))

    def _ends(self, query: PathQuery) -> list[tuple[str, tuple[float, float]]]:
        return [
            (
                self._building.floors[end.floor].name,
                in_metres(end.point, self.sessions[end.floor].grid),
            )
            for end in (query.start, query.goal)
        ]

    def _how(self, query: PathQuery) -> dict[str, Any]:
        """Return the conditions of a query, as `Building.plan` takes them."""
        blocked: dict[str, Blocked] = {}
        for each in query.closed.floors:
            closed = self.sessions[each.floor].planning.blocked(each)
            if closed is not None:
                blocked[self._building.floors[each.floor].name] = closed
        links, stairs = query.closed.links, query.stairs
        how = {"blocked": blocked, "closed_links": links, "stairs": stairs}
        return how | {"profile": query.profile}

    def _facts(self, plan: BuildingPlan, language: str) -> dict[str, Any]:
        number_of = self._number_of
        parts = []
        for name, result in zip(plan.floors, plan.results, strict=True):
            number = number_of[name]
            assert result.path is not None  # noqa: S101 - a plan without a route has no parts
            line = in_grid(result.path.points, self.sessions[number].grid)
            parts.append({"floor": number, "line": line})
        rides = [
            {
                "link": ride.link.name,
                "kind": ride.link.kind,
                "from": number_of[ride.from_floor],
                "to": number_of[ride.to_floor],
                "seconds": ride.seconds,
                "charge_m": ride.charge_m,
            }
            for ride in plan.rides
        ]
        figures = ("length_m", "charge_m", "travel_s")
        return (
            facts_of(plan, parts, language)
            | {"rides": rides}
            | {name: finite(getattr(plan, name)) for name in figures}
        )


def _is_plain(preset: str) -> bool:
    """Return whether a preset plans over floors: without headings."""
    ompl = load_preset(preset).planner.sampling
    return ompl is None or not ompl.has_heading
