"""Answers over the floors of a building: those of one map, with floors and links."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from hybridnav.errors import InvalidValueError, brief
from hybridnav.ext.agent import floors as ask
from hybridnav.ext.agent import places
from hybridnav.ext.agent.answers import _Answers, nearest_answer, png_of, renamed, rooms_answer
from hybridnav.ext.agent.places import NamedPlaces, Thing
from hybridnav.ext.agent.questions import INSTRUCTIONS, DescribeMap, NameRoom, UnclearError
from hybridnav.ext.fleet import Building, BuildingPlan, Link
from hybridnav.ext.fleet.building import legs_of, tightest
from hybridnav.ext.fleet.links import ClosedLink
from hybridnav.ext.page import Site
from hybridnav.guide.words import check_language
from hybridnav.guide.words.itinerary import guide_of
from hybridnav.maps.names import folded, place_of_name, read_point
from hybridnav.planning import Profile

Waypoint = tuple[str, "tuple[float, float] | str"]
"""A floor, and a point or a name on it."""
_WITH_FLOORS = (
    ' "floor 2, lobby" is a room with its floor, "floor 2, door 4" a door, "lift@2" a link.'
)
_PASSED = 8
"""Rooms and doors that a route lists on each floor."""
_MOST_POINTS = 200
_KIND = re.compile(r"(link|room)[: ]\s*(.+)", re.IGNORECASE)


class BuildingAnswers(_Answers):
    """Answers about a building. Threads may share it; one call is answered at a time.

    Parameters
    ----------
    site
        The building, its rooms and their files.
    allow_edits
        Whether doors, rooms and links may be closed, and rooms named.

    Examples
    --------
    >>> from hybridnav.ext.agent import BuildingAnswers
    >>> from hybridnav.ext.fleet import Building, Floor, Link, LinkEnd
    >>> from hybridnav.ext.page import Site
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floors = [Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")]
    >>> lift = Link(name="lift", kind="lift", ends=tuple(LinkEnd(n, (0.5, 0.5)) for n in "12"))
    >>> answers = BuildingAnswers(Site.of_building(Building(floors, [lift]), "house"))
    >>> answers.call("route", {"start": ["1", 1.5, 0.5], "goal": ["2", 0.5, 0.5]})["length_m"]
    1.0
    """

    def __init__(self, site: Site, *, allow_edits: bool = False) -> None:
        super().__init__(ask.TOOLS, ("doors", "rooms", "links"), allow_edits=allow_edits)
        self._site = site
        self.instructions = INSTRUCTIONS.format(point="[floor, x, y]") + _WITH_FLOORS

    # The building.

    @property
    def _building(self) -> Building:
        return self._site.building("shortest")

    @property
    def _names(self) -> FloorNames:
        sessions = zip(self._site.names, self._site.sessions, strict=True)
        on = {name: NamedPlaces(one.planning.topology.rooms) for name, one in sessions}
        return FloorNames(on, self._building.links)

    def _describe_map(self, _: DescribeMap) -> dict[str, Any]:
        building, on = self._building, self._names.on
        radius_m = building.robot_radius_m
        links = [
            {"name": one.name, "kind": one.kind, "floors": [end.floor for end in one.ends]}
            for one in building.links
        ]
        by = ", ".join(one.label for one in building.links) or "no link"
        return {
            "text": f"{self._site.name}: floors {', '.join(on)}, joined by {by}; "
            f"robot radius {radius_m} m.",
            "name": self._site.name,
            "floors": [{"floor": floor} | one.facts() for floor, one in on.items()],
            "links": links,
            "robot_radius_m": radius_m,
            "closed": self._changes.now,
            "edits_allowed": self.allow_edits,
        }

    def _list_rooms(self, asked: Any) -> dict[str, Any]:
        names = self._names
        on = names.on if asked.floor is None else {(one := names.floor(asked.floor)): names.on[one]}
        rooms = [room | {"floor": floor} for floor, one in on.items() for room in one.asked(asked)]
        return rooms_answer(rooms, asked)

    def _where_am_i(self, asked: Any) -> dict[str, Any]:
        names = self._names
        floor, point = names.place(asked.point)
        place = names.on[floor].where(names.point_of((floor, point)))
        return place | {"text": f"Floor {floor}: {place['text']}", "floor": floor}

    # Routes.

    def _how(self, avoiding: list[int | str], width: float | None = None) -> dict[str, Any]:
        """Return the conditions of a query, as `Building.plan` takes them."""
        shut = [*self._changes.closed, *self._names.things(avoiding)]
        on: dict[str, list[Thing]] = {}
        for one in shut:
            if one.kind != "links":
                on.setdefault(one.floor or "", []).append(one)
        wide = None
        if width is not None:
            wide = Profile(
                name=f"{width:g} m wide", through_private=True, costs=False, width_m=width
            )
        return {
            "blocked": {floor: places.blocked_of(things) for floor, things in on.items()},
            "closed_links": [str(one.shown) for one in shut if one.kind == "links"],
            "profile": wide,
        }

    def _legs(
        self, start: Any, goal: Any, how: dict[str, Any], via: Any = ()
    ) -> list[BuildingPlan]:
        stops = [self._names.place(stop) for stop in (start, *via, goal)]
        return legs_of(self._building, stops, how)

    def _no_path(self, legs: Sequence[BuildingPlan], language: str) -> dict[str, Any]:
        """Answer that there is no route, and why."""
        plan = legs[-1]
        words = [*plan.reasons.get(language, ()), *([plan.note] if plan.note else [])]
        text = " ".join(words) or f"There is no route: {plan.status}."
        return {
            "text": text if len(legs) == 1 else f"Leg {len(legs)}: {text}",
            "status": str(plan.status),
            "reason": words,
            "to_open": list(plan.to_open),
        }

    def _route(self, asked: Any) -> dict[str, Any]:
        check_language(asked.language)
        legs = self._legs(
            asked.start, asked.goal, self._how(asked.avoiding, asked.width), asked.via
        )
        if not legs[-1].solved:
            return self._no_path(legs, asked.language)
        cost = sum(leg.cost for leg in legs)
        answer: dict[str, Any] = {
            "status": "solved",
            "length_m": round(sum(leg.length_m for leg in legs), 3),
            "cost_m": round(cost, 3),
            "travel_s": round(sum(leg.travel_s for leg in legs), 1),
            "parts": [part for leg in legs for part in self._parts(leg)],
        }
        answer["text"] = f"{_said(legs)}; its cost is {cost:.2f} m"
        # The end of a leg in a room is a choice, which no bound of the legs proves to be best.
        if not any(isinstance(leg.goal[1], str) for leg in legs[:-1]):
            bound = sum(leg.lower_bound for leg in legs)
            answer["lower_bound_m"] = places.rounded_down(bound)
            answer["gap"] = round(max(cost / bound - 1, 0.0), 9) if bound else 0.0
            answer["text"] += f", and none is below {places.rounded_down(bound, 2):.2f} m"
        answer["text"] += "."
        lines = [line for leg in legs for line in leg.words(asked.language)][asked.words_from :]
        if asked.words:
            answer["words"] = places.fitting(lines)
            answer["words_left"] = len(lines) - len(answer["words"])
        if asked.points:
            answer["points"] = [
                [floor, *point]
                for leg in legs
                for floor, result in zip(leg.floors, leg.results, strict=True)
                if result.path is not None
                for point in result.path.points[:, :2].round(3).tolist()
            ][:_MOST_POINTS]
        return answer

    def _parts(self, leg: BuildingPlan) -> list[dict[str, Any]]:
        """Return the way on each floor, and the ride that it ends with."""
        parts = []
        for floor, result, ride in zip(leg.floors, leg.results, [*leg.rides, None], strict=True):
            guide, path = guide_of(self._building.floor(floor).planner), result.path
            assert path is not None  # noqa: S101 - it is solved
            passed = [] if guide is None else guide.legs(path)
            part = {
                "floor": floor,
                "length_m": round(path.length_m, 3),
                "rooms": [one.room or one.shape for one in passed][:_PASSED],
                "doors": [one.door.number for one in passed if one.door is not None][:_PASSED],
            }
            parts.append(part | ({} if ride is None else {"ride": ride.to_dict()}))
        return parts

    def _can_reach(self, asked: Any) -> dict[str, Any]:
        legs = self._legs(asked.start, asked.goal, self._how(asked.avoiding, asked.width))
        if not legs[-1].solved:
            return {"can_reach": False, **self._no_path(legs, "en")}
        figures = {"length_m": round(legs[0].length_m, 3), "cost_m": round(legs[0].cost, 3)}
        return {"text": f"Yes, {_said(legs)}.", "can_reach": True, **figures}

    def _explain(self, asked: Any) -> dict[str, Any]:
        check_language(asked.language)
        how = self._how(asked.avoiding, asked.width)
        legs = self._legs(asked.start, asked.goal, how)
        if not legs[-1].solved:
            return {"has_path": False, **self._no_path(legs, asked.language)}
        radius_m = None if asked.width is None else asked.width / 2
        lines = tightest(self._building, legs, how["blocked"], asked.language, radius_m=radius_m)
        return {"text": " ".join(lines), "status": "solved", "has_path": True, "reason": lines}

    def _nearest(self, asked: Any) -> dict[str, Any]:
        """Plan to candidates in the order of their bounds, until no other can be nearer."""
        names, building, how = self._names, self._building, self._how([])
        start = names.place(asked.start)
        here = start[0], names.point_of(start)
        closed = {key: how[key] for key in ("blocked", "closed_links")}

        def plan_to(place: Waypoint) -> tuple[float, dict[str, Any]]:
            plan = building.plan(here, place, **how)
            if not plan.solved:
                return math.inf, {}
            return plan.cost, {
                "floor": place[0],
                "length_m": round(plan.length_m, 3),
                "cost_m": round(plan.cost, 3),
                "lower_bound_m": places.rounded_down(plan.lower_bound),
            }

        goals = [
            (building.least_m(here, (floor, point), **closed), k, facts, (floor, point))
            for k, (floor, facts, point) in enumerate(names.candidates(asked.of, start))
        ]
        words = " on floor {floor} (cost {cost_m:.2f} m)"
        return nearest_answer(asked, goals, plan_to, lambda one, _: words.format(**one))

    def _picture(self, asked: Any) -> dict[str, Any]:
        from hybridnav.ext.fleet.plot import plot_building  # noqa: PLC0415 - loads matplotlib

        if (asked.start is None) != (asked.goal is None):
            raise InvalidValueError("a picture of a route needs start and goal; of the map neither")
        legs: list[BuildingPlan] = []
        if asked.start is not None and asked.goal is not None:
            legs = self._legs(asked.start, asked.goal, self._how([]))
            if not legs[-1].solved:
                return self._no_path(legs, "en")
        ax = plot_building(self._building, legs)[0]
        return {"text": f"A route of {_said(legs)}." if legs else "The floors.", "png": png_of(ax)}

    # Changes.

    def _named(self, asked: Any) -> list[Thing]:
        names = self._names
        return names.things(asked.doors, of_doors=True) + names.things(asked.rooms + asked.links)

    def _name_room(self, asked: NameRoom) -> dict[str, Any]:
        floor, old = self._names.named(*self._names.parted(asked.room))
        of = dict(zip(self._site.names, self._site.sessions, strict=True))
        session, floors = of[floor], [name for name in of if of[name] is of[floor]]

        def rename(old: str, new: str) -> dict[str, Any]:
            renamed(session, old, new)
            room = self._names.on[floor].room(new) | {"floor": floor}
            answer = self._changes.renamed(old, room, floors)
            caution = session.notice.partition("; ")[2]
            return answer | {"text": f"{answer['text']} {caution}".strip()}

        return self._changes.change(rename, old, asked.name)


def _said(legs: Sequence[BuildingPlan]) -> str:
    """Return the length, the rides and the time of a route in words."""
    by = " and ".join(ride.link.name for leg in legs for ride in leg.rides)
    length_m, travel_s = sum(leg.length_m for leg in legs), sum(leg.travel_s for leg in legs)
    return f"{length_m:.2f} m{f' by {by}' if by else ''}, in {travel_s:.0f} s"


class FloorNames:
    """The rooms, points, doors and links of a building, by what programs call them.

    `on`: those of each floor.
    """

    def __init__(self, on: Mapping[str, NamedPlaces], links: Sequence[Link]) -> None:
        self.on, self._links = on, links

    def floor(self, text: str) -> str:
        """Return the floor that a text names, as "2", or "floor 2"."""
        names = tuple(self.on)
        short = re.sub(r"^(?:floor|etage)\s+", "", text.strip(), flags=re.IGNORECASE)
        alike = [one for one in names if folded(one) in {folded(text), folded(short)}]
        return alike[0] if len(alike) == 1 else names[place_of_name(short, names, "floor")]

    def parted(self, text: str) -> tuple[str | None, str]:
        """Return the floor that a text names, None for none, and the rest: "2:lobby", "floor 2,
        lobby", "lobby on floor 2"."""
        text = text.strip()
        if text in {*self._known(None, points=True), *(link.name for link in self._links)}:
            return None, text
        # The longest name first: one floor may be called as another one with a colon.
        for name in sorted(self.on, key=len, reverse=True):
            this = re.escape(name)
            for form in (
                rf"(?:(?:floor|etage)\s+{this}\s*[,:]|{this}\s*:)\s*(.+)",
                rf"(.+?),?\s+(?:on |auf )?\(?(?:floor|etage)\s+{this}\)?",
            ):
                match = re.fullmatch(form, text, re.IGNORECASE)
                if match is not None:
                    return name, match[1].strip()
        other = re.match(
            r"(?:floor|etage)\s+([^,:]+)[,:]|(?!link|door|room)([^:,]+):", text, re.IGNORECASE
        )
        if other is not None:
            place_of_name(other[1] or other[2], tuple(self.on), "floor")
        return None, text

    def place(self, given: str | tuple[str, float, float]) -> Waypoint:
        """Return a place as buildings take it."""
        if not isinstance(given, str):
            floor, x, y = given
            return self.floor(floor), (x, y)
        on, rest = self.parted(given)
        point = read_point(rest)
        if point is None:
            return self.named(on, rest, points=True)
        if on is None or len(point) != 2:  # noqa: PLR2004
            raise InvalidValueError(
                f"a point of a building is [floor, x, y], as [{next(iter(self.on))!r:.40}, 1.5, "
                f"2.0], got {given!r:.80}"
            )
        return on, (point[0], point[1])

    def point_of(self, place: Waypoint) -> tuple[float, float]:
        """Return the point of a place."""
        floor, point = place
        if not isinstance(point, str):
            return point
        x, y = self.on[floor].rooms.point_of(point)[:2]
        return x, y

    def named(self, floor: str | None, text: str, *, points: bool = False) -> tuple[str, str]:
        """Return the floor and the name of the room, or named point, that a text means."""
        name = places.meant(text, self._known(floor, points=points), self._choices)
        return self._on_one_floor(name, floor)

    def _choices(self, names: Iterable[str]) -> list[dict[str, Any]]:
        """Return what an answer shows of names: each on each floor that has it."""
        choices: list[dict[str, Any]] = []
        for name in names:
            having = [each for each, one in self.on.items() if name in one.names(points=True)]
            choices += [self.on[each].choices([name])[0] | {"floor": each} for each in having]
            choices += [] if having else [{"name": name}]
        return choices[: places.SHOWN]

    def things(self, given: list[int | str], *, of_doors: bool = False) -> list[Thing]:
        """Return what a list names: "floor 2, door 4", "2:lobby", "north lift", "north lift@2".

        `of_doors`: whether "floor 2, 4" is a door too.
        """
        return [self._thing(one, of_doors=of_doors) for one in given]

    def _thing(self, given: int | str, *, of_doors: bool) -> Thing:
        floor, text = self.parted(str(given))
        number = places.door_of(text, of_doors=of_doors or isinstance(given, int))
        if number is not None:
            if floor is None:
                raise InvalidValueError(
                    f"a door of a building needs its floor, as 'floor {next(iter(self.on))}, door "
                    f"{number}', got {brief(given)}"
                )
            return Thing("doors", self.on[floor].rooms.listed_door(number).number, floor)
        links = [link.name for link in self._links]
        before, at, stop = text.rpartition("@")
        if at and (before in links or _KIND.match(before)):
            floor, text = self.floor(stop), before
        rooms = self._known(floor)
        kind = None if text in {*links, *rooms} else _KIND.fullmatch(text)
        if kind is not None:  # what reasons call it: "link lift", "room lab"
            text = kind[2]
            links, rooms = (links, []) if kind[1].lower() == "link" else ([], rooms)
        name = places.meant(text, [*rooms, *links], self._choices)
        if name in links and name in rooms:
            raise UnclearError(
                f"{name!r:.80} is a link and a room: say 'link {name:.80}' or 'room {name:.80}'"
            )
        if name in links:
            of = ClosedLink.of(name if floor is None else f"{name}@{floor}", self._links)
            return Thing("links", of.link, of.floor)
        return Thing("rooms", *reversed(self._on_one_floor(name, floor)))

    def candidates(
        self, of: str, start: Waypoint
    ) -> list[tuple[str, dict[str, Any], tuple[float, float]]]:
        """Return rooms or doors of a kind or name, each with its floor and a point to go to."""
        floor, text = self.parted(of)
        named = [
            (each, facts, point)
            for each, one in self._on(floor).items()
            for facts, point in one.candidates(text, start[1] if each == start[0] else "")
        ]
        if not named:
            raise places.nothing(of, "nothing", self._known(floor), self._choices)
        return named

    def _on(self, floor: str | None) -> Mapping[str, NamedPlaces]:
        return self.on if floor is None else {floor: self.on[floor]}

    def _known(self, floor: str | None, *, points: bool = False) -> list[str]:
        """Return the names of rooms, and of points, on a floor, or on all, each once."""
        known = (name for one in self._on(floor).values() for name in one.names(points=points))
        return list(dict.fromkeys(known))

    def _on_one_floor(self, name: str, floor: str | None) -> tuple[str, str]:
        having = [each for each, one in self._on(floor).items() if name in one.names(points=True)]
        if len(having) == 1:
            return having[0], name
        raise UnclearError(
            f"{name!r:.80} is a name on floors {' and '.join(having)[:80]}: ask again with its "
            f"floor, as 'floor {having[0]}, {name:.80}'",
            self._choices([name]),
        )
