"""Why there is no route over floors: what is closed, where an end lies, or what walls enclose."""

import operator
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce
from itertools import permutations
from typing import Any

from hybridnav.closures.blocked import Blocked, Closable, as_blocked
from hybridnav.ext.fleet.floors import Floor
from hybridnav.ext.fleet.links import ClosedLink, Endpoint, Link, LinkNetwork
from hybridnav.ext.fleet.plan import BuildingPlan
from hybridnav.planning import PlanStatus
from hybridnav.reasons.why import Explanation, each_closure, explain
from hybridnav.reasons.why_words import Closure, closure_words

_WORDS = {
    "en": {
        "link": "link {0}",
        "stop": "link {0} on floor {1}",
        "up": "the way down by link {0}",
        "down": "the way up by link {0}",
        "stairs": "the way by stairs",
        "on": "floor {0}, {1}",
        "open": "{0} is closed, and there is no other way.",
        "more": "If {0} open, there is a route; if one of them stays closed, none.",
        "and": "and",
        "apart": "No lift, stairs or ramp that this robot can take leads from floor {0} to floor "
        "{1}.",
        "cut": "One way only, and not that way: {0}.",
        "end": "Floor {0}: {1}",
        "between": "On a floor between, no way joins the ends of the links.",
    },
    "de": {
        "link": "Verbindung {0}",
        "stop": "Verbindung {0} auf Etage {1}",
        "up": "der Weg hinab über Verbindung {0}",
        "down": "der Weg hinauf über Verbindung {0}",
        "stairs": "der Weg über Treppen",
        "on": "Etage {0}, {1}",
        "open": "Gesperrt ist {0}, und einen anderen Weg gibt es nicht.",
        "more": "Mit {0} offen gibt es einen Weg; bleibt eines davon gesperrt, keinen.",
        "and": "und",
        "apart": "Kein Aufzug, keine Treppe und keine Rampe, die dieser Roboter nehmen kann, "
        "führt von Etage {0} auf Etage {1}.",
        "cut": "Nur in einer Richtung, und nicht in dieser: {0}.",
        "end": "Etage {0}: {1}",
        "between": "Auf einer Etage dazwischen verbindet kein Weg die Enden der Verbindungen.",
    },
}


@dataclass(frozen=True)
class Shut:
    """One thing that is closed in a building: a link, all stairs, or a thing on a floor."""

    link: ClosedLink | None = None
    floor: str | None = None
    closure: Closure | None = None
    blocked: Blocked | None = None

    def named(self, language: str) -> str:
        """Return its name in a sentence."""
        words = _WORDS[language]
        if self.link is not None:
            key = self.link.left or ("link" if self.link.floor is None else "stop")
            return words[key].format(*self.link)
        if self.floor is None or self.closure is None:
            return words["stairs"]
        return words["on"].format(self.floor, closure_words(self.closure, language))


def shut_of(
    blocked: Mapping[str, Closable], links: Collection[ClosedLink], *, stairs: bool
) -> list[Shut]:
    """Return what is closed in a query, each thing once."""
    things = [Shut(link=one) for one in dict.fromkeys(links)]
    things += [] if stairs else [Shut()]
    for floor, given in blocked.items():
        for closure, one in each_closure(as_blocked(given)):
            things.append(Shut(floor=floor, closure=closure, blocked=one))
    return things


def conditions(shut: Sequence[Shut], given: Mapping[str, Closable]) -> dict[str, Any]:
    """Return the conditions of a query with these things closed, and the directions of `given`."""
    directed = {floor: as_blocked(one).directions for floor, one in given.items()}
    blocked = {floor: [Blocked(one_way=one)] for floor, one in directed.items() if one is not None}
    for one in shut:
        if one.floor is not None and one.blocked is not None:
            blocked.setdefault(one.floor, []).append(one.blocked)
    merged = {floor: reduce(operator.or_, each) for floor, each in blocked.items()}
    links = [one.link for one in shut if one.link is not None]
    return {"blocked": merged, "closed_links": links, "stairs": Shut() not in shut}


def to_open(shut: Sequence[Shut], is_solved: Callable[[list[Shut]], bool]) -> list[Shut]:
    """Return things that open a route, none of which can stay closed; empty where none does.

    `is_solved`: whether there is a route with these closed alone.

    Notes
    -----
    U. Junker: QuickXplain, AAAI 2004: few queries where few of many things matter.
    """
    if not shut or not is_solved([]):
        return []

    def search(opened: list[Shut], rest: list[Shut], *, is_new: bool) -> list[Shut]:
        if is_new and is_solved([one for one in shut if one not in opened]):
            return []
        if len(rest) == 1:
            return rest
        one, other = rest[: len(rest) // 2], rest[len(rest) // 2 :]
        second = search(opened + one, other, is_new=True)
        return search(opened + second, one, is_new=bool(second)) + second

    return search([], list(shut), is_new=False)


def reasons(
    plan: BuildingPlan,
    endpoints: tuple[Endpoint, Endpoint],
    floors: Sequence[Floor],
    network: LinkNetwork,
    opening: tuple[list[Shut], Mapping[str, Blocked], Mapping[str, Blocked]],
) -> dict[str, tuple[str, ...]]:
    """Return why a plan has no route, in each language.

    `network`: the links that may be used with nothing closed; `opening`: what would have to open,
    what is closed on each floor, and what of it always is: by a profile, or as a direction.
    """
    opened, blocked, always = opening
    at = [_point_of(end, floors) for end in endpoints]
    is_end = plan.status.name.startswith(("START_", "GOAL_"))
    if is_end and not (opened and isinstance(endpoints[_is_goal(plan)].waypoint, str)):
        number = int(_is_goal(plan))
        floor = floors[endpoints[number].floor]
        why = explain(floor.planner, at[number], at[number], blocked=blocked.get(floor.name))
        ends = tuple(one for one in why.blocked_ends if one.is_start == (number == 0))
        return _each(lambda to: _on(floor, replace(why, blocked_ends=ends).words(to), to))
    if opened:
        return _each(lambda to: [_opening([one.named(to) for one in opened], to)])
    if plan.status is not PlanStatus.NO_PATH:
        return _each(lambda _: [])
    for number, floor in enumerate(floors[end.floor] for end in endpoints):
        enclosed = _enclosed(number, endpoints, floors, network, always)
        if enclosed is not None:
            # Under a profile ends of links may lie in private rooms.
            by = [one for end in enclosed.blocked_ends for one in end.closures][:1]
            shut = [Shut(floor=floor.name, closure=one) for one in by]
            return {
                to: tuple(
                    [_opening([one.named(to) for one in shut], to)]
                    if shut
                    else _on(floor, enclosed.words(to), to)
                )
                for to in _WORDS
            }
    names = [floors[end.floor].name for end in endpoints]
    reached = {names[0]}
    for _ in floors:
        for link in network.links:
            for one, other in permutations([stop.floor for stop in link.ends], 2):
                reached |= {other} if one in reached and link.leads(one, other) else set()
    if names[1] not in reached:
        # Links between what is reached and what is not lead the other way.
        cut = [
            one.label for one in network.links if len({e.floor in reached for e in one.ends}) > 1
        ]
        lines = ["apart", *(["cut"] if cut else [])]
        words = {"apart": names, "cut": [", ".join(cut)]}
        return _each(lambda to: [_WORDS[to][line].format(*words[line]) for line in lines])
    return _each(lambda to: [_WORDS[to]["between"]])


def on_floor(floor: str, line: str, language: str) -> str:
    """Return a line about one floor, with its name."""
    return _WORDS[language]["end"].format(floor, line)


def _enclosed(
    number: int,
    endpoints: tuple[Endpoint, Endpoint],
    floors: Sequence[Floor],
    network: LinkNetwork,
    blocked: Mapping[str, Blocked],
) -> Explanation | None:
    """Return why no end of a link, nor the goal on the same floor, can be reached.

    The search begins at the start, number 0, or at the goal. None where one can, or there is none.
    """
    floor = floors[endpoints[number].floor]
    here, other = (_point_of(endpoints[which], floors) for which in (number, 1 - number))
    ways: list[tuple[float, ...]] = [
        stop.position_m
        for link in network.links
        if (stop := link.end_on(floor.name)) and _leads(link, floor.name, number)
    ]
    ways += [other] if endpoints[0].floor == endpoints[1].floor else []
    pairs = [((here, way), (way, here))[number] for way in ways]
    reasons = [explain(floor.planner, *pair, blocked=blocked.get(floor.name)) for pair in pairs]
    return reasons[-1] if reasons and not any(one.has_path for one in reasons) else None


def _leads(link: Link, floor: str, number: int) -> bool:
    """Return whether a link leads away from a floor, number 0, or to it."""
    pairs = [(floor, end.floor) for end in link.ends if end.floor != floor]
    return any(link.leads(*pair[:: -1 if number else 1]) for pair in pairs)


def _each(lines: Callable[[str], list[str]]) -> dict[str, tuple[str, ...]]:
    return {language: tuple(lines(language)) for language in _WORDS}


def _is_goal(plan: BuildingPlan) -> bool:
    return plan.status.name.startswith("GOAL_")


def _point_of(end: Endpoint, floors: Sequence[Floor]) -> tuple[float, ...]:
    if not isinstance(end.waypoint, str):
        return tuple(float(number) for number in end.waypoint)  # type: ignore[union-attr, arg-type]
    floor = floors[end.floor]
    points = {} if floor.rooms is None else floor.rooms.points
    return tuple(points.get(end.waypoint) or floor.planner.topology.rooms.point_of(end.waypoint))


def _on(floor: Floor, lines: Sequence[str], language: str) -> list[str]:
    """Return lines about one floor, the first one with its name."""
    return [on_floor(floor.name, lines[0], language), *lines[1:]]


def _opening(names: Sequence[str], language: str) -> str:
    words = _WORDS[language]
    if len(names) == 1:
        text = words["open"].format(names[0])
    else:
        text = words["more"].format(f"{', '.join(names[:-1])} {words['and']} {names[-1]}")
    return text[:1].upper() + text[1:]
