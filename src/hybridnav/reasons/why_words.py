"""Sentences for `Explanation`, in English and in German. Public: `Closure`, `TightPlace` and
`BlockedEnd`.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from hybridnav.guide.words import check_language
from hybridnav.planning import PlanStatus
from hybridnav.rooms import Door
from hybridnav.rooms.listing import FOUND_NAME


class Closure(NamedTuple):
    """One thing that is closed: of `Blocked`, or by the costs of the planner.

    Examples
    --------
    >>> hn.reasons.Closure("doors", 12)
    Closure(kind='doors', which=12)
    """

    kind: str
    """The name of an attribute of `Blocked`, `"costs"`, or of what has a direction: `"doors"`,
    `"openings"`, `"arcs"`, `"lines"`, `"sides"` or `"named"`."""
    which: Any
    """Its number or name; of areas and keepout the place in the sequence, from 0; None for cells
    and costs."""


class TightPlace(NamedTuple):
    """A point at which a path is tight.

    Examples
    --------
    >>> hn.reasons.TightPlace((0.5, 2.0)).point
    (0.5, 2.0)
    """

    point: tuple[float, float]
    """`(x, y)` in metres, map frame."""
    door: Door | None = None
    """The door that it lies in, if any."""


class BlockedEnd(NamedTuple):
    """An end of a query that the robot cannot stand on.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> why = hn.explain(hn.HybridPlanner(topology), (0.5, 0.5), (-2.0, 2.5))
    >>> print(why.blocked_ends[0].status)
    goal outside the map
    """

    is_start: bool
    """Whether it is the start, else the goal."""
    status: PlanStatus
    """As of a plan."""
    clearance_m: float
    """Distance to the nearest occupied cell; 0 in one, and outside the map."""
    closures: tuple[Closure, ...]
    """What closes its cell."""
    nearest: tuple[float, float] | None
    """The nearest point that the robot can stand on, `(x, y)` in metres; None if there is none."""
    nearest_m: float
    """How far away it is, metres."""


_TABLES = {
    "en": {
        "start": "the start",
        "goal": "the goal",
        "outside": "{End} lies outside the map.",
        "occupied": "{End} lies in an obstacle.",
        "near": "{End} lies {clear} m from an obstacle: a radius of {radius} m needs more.",
        "island": "{End} lies in an island of the map that is left out.",
        "unexplored": "{End} lies in unexplored cells.",
        "blocked": "{End} is closed by {closures}.",
        "nearest": "The nearest point for this robot is {point}, {far} m away.",
        "path": "There is a path for a radius of {radius} m.",
        "unfit": "{End} leaves no room for the footprint with this heading.",
        "path_tight": "A path exists for every radius below {widest} m; it is tightest {place}.",
        "everything": "Nothing on the map limits the radius.",
        "open": "{Closures} {is_are} closed, and there is no other way.",
        "open_more": "If {closures} open, there is a path; no fewer suffice.",
        "cut_off": "The cells that closing takes leave no path, although one leads round them.",
        "radius": "A radius of {radius} m does not fit; every one below {widest} m does. It is "
        "tightest {place}.",
        "radius_opened": "A radius of {radius} m does not fit even with nothing closed; then every "
        "one below {widest} m does. It is tightest {place}.",
        "unexplored_way": "Unexplored cells lie between, and a way may lead through them.",
        "walls": "Obstacles and unexplored cells enclose {end}: {area} m² can be reached from it.",
        "at": "at {point}",
        "in_door": "in {kind} {number} ({width} m wide), at {point}",
        "door": "door",
        "opening": "opening",
        "and": "and",
        "doors": "door {which}",
        "rooms": "room {which}",
        "arcs": "arc {which}",
        "places": "place {which}",
        "polygons": "area {order}",
        "keepout": "keep-out area {order}",
        "openings": "opening {which}",
        "lines": "line {which}",
        "sides": "the given sides of cells",
        "away": "Only {closures} {leads} away from the start, and may be crossed only towards it.",
        "towards": "Only {closures} {leads} to the goal, and may be crossed only away from it.",
        "cells": "the given set of cells",
        "named": "{which}",
        "costs": "the keep-out of the costs",
        "is": "is",
        "are": "are",
        "leads": "leads",
        "lead": "lead",
    },
    "de": {
        "start": "der Start",
        "goal": "das Ziel",
        "outside": "{End} liegt außerhalb der Karte.",
        "occupied": "{End} liegt in einem Hindernis.",
        "near": "{End} liegt {clear} m von einem Hindernis: Radius {radius} m braucht mehr.",
        "island": "{End} liegt in einer Insel der Karte, die ausgelassen ist.",
        "unexplored": "{End} liegt in unerforschten Zellen.",
        "blocked": "{End} ist gesperrt durch {closures}.",
        "nearest": "Der nächste Punkt für diesen Roboter ist {point}, {far} m entfernt.",
        "path": "Für einen Radius von {radius} m gibt es einen Weg.",
        "unfit": "{End} lässt mit dieser Richtung keinen Platz für den Umriss.",
        "path_tight": "Es gibt einen Weg für jeden Radius unter {widest} m; am engsten ist er "
        "{place}.",
        "everything": "Nichts auf der Karte begrenzt den Radius.",
        "open": "Gesperrt {is_are} {closures}, und einen anderen Weg gibt es nicht.",
        "open_more": "Mit {closures} offen gibt es einen Weg; weniger genügen nicht.",
        "cut_off": "Die Zellen, die das Sperren belegt, lassen keinen Weg, obwohl einer um sie "
        "herumführt.",
        "radius": "Ein Radius von {radius} m passt nicht hindurch; jeder unter {widest} m passt. "
        "Am engsten ist es {place}.",
        "radius_opened": "Ein Radius von {radius} m passt auch dann nicht hindurch, wenn nichts "
        "gesperrt ist; jeder unter {widest} m passt dann. Am engsten ist es {place}.",
        "unexplored_way": "Unerforschte Zellen liegen dazwischen, durch die ein Weg führen kann.",
        "walls": "Hindernisse und unerforschte Zellen schließen {end} ein: {area} m² sind von dort "
        "erreichbar.",
        "at": "bei {point}",
        "in_door": "in {kind} {number} ({width} m breit), bei {point}",
        "door": "Tür",
        "opening": "Durchgang",
        "and": "und",
        "doors": "Tür {which}",
        "rooms": "Raum {which}",
        "arcs": "Bogen {which}",
        "places": "Ort {which}",
        "polygons": "Fläche {order}",
        "keepout": "Sperrfläche {order}",
        "openings": "Durchgang {which}",
        "lines": "Linie {which}",
        "sides": "die angegebenen Zellseiten",
        "away": "Vom Start weg {leads} nur {closures}, erlaubt allein in Richtung Start.",
        "towards": "Zum Ziel {leads} nur {closures}, erlaubt allein vom Ziel weg.",
        "cells": "die angegebene Zellmenge",
        "named": "{which}",
        "costs": "der Sperrbereich der Kosten",
        "is": "ist",
        "are": "sind",
        "leads": "führt",
        "lead": "führen",
    },
}


def closure_words(closure: Closure, language: str) -> str:
    """Return what sentences call a closure, as "door 4"; `language`: `en` or `de`."""
    return _named(closure, _TABLES[language])


def _named(closure: Closure, table: dict[str, str]) -> str:
    if closure.kind == "rooms" and FOUND_NAME.fullmatch(str(closure.which)):
        return str(closure.which)  # "room-1" says what it is
    order = closure.which + 1 if isinstance(closure.which, int) else ""
    return table[closure.kind].format(which=closure.which, order=order)


def sentences(why: Any, language: str) -> list[str]:
    """Write an explanation, one sentence or two a line; see `Explanation.words`."""
    mark = check_language(language).decimal
    writer = _Writer(_TABLES[language], mark, why.radius_m)
    if why.blocked_ends:
        lines = [line for end in why.blocked_ends for line in writer.end(end)]
        if 0 < why.widest_m <= why.radius_m:
            lines += writer.tight("radius", why.widest_m, why.tight)
        return lines
    unfit = [why.unfit_end] if why.unfit_end else []
    lines = [writer.say("unfit", end=writer.table[end]) for end in unfit]
    if why.has_path:
        return [*lines, writer.say("path"), *writer.tight("path_tight", why.widest_m, why.tight)]
    if why.against or why.to_open:
        lines.append(writer.against(why) if why.against else writer.opening(why.to_open))
    elif why.opened.radius_m > why.radius_m:
        lines.append(writer.say("cut_off"))
    elif why.closed.radius_m > 0:
        lines += writer.tight("radius", why.widest_m, why.tight)
    elif why.opened.radius_m > 0:
        lines += writer.tight("radius_opened", why.opened.radius_m, why.tight)
    if why.through_unexplored:
        lines.append(writer.say("unexplored_way"))
    if not lines:
        end = int(why.reached_m2[1] < why.reached_m2[0])
        area = writer.number(why.reached_m2[end], 1)
        lines.append(writer.say("walls", end=writer.table[("start", "goal")[end]], area=area))
    return lines


class _Writer:
    """Writes sentences of one table."""

    def __init__(self, table: dict[str, str], decimal: str, radius_m: float) -> None:
        self.table, self._decimal, self._radius_m = table, decimal, radius_m

    def number(self, value: float, digits: int = 2) -> str:
        """Write a number, rounded down to the safe side."""
        if not math.isfinite(value):
            return "∞"
        scale = 10**digits
        return f"{math.floor(value * scale + 1e-6) / scale:.{digits}f}".replace(".", self._decimal)

    def say(self, key: str, **parts: str) -> str:
        """Fill in a sentence; `{End}` and `{Closures}` begin with a capital letter."""
        for name, text in list(parts.items()):
            parts[name.capitalize()] = text[:1].upper() + text[1:]
        radius = f"{self._radius_m:g}".replace(".", self._decimal)
        return self.table[key].format(radius=radius, **parts)

    def _point(self, point: tuple[float, ...]) -> str:
        return f"({point[0]:.2f}, {point[1]:.2f})"

    def tight(self, key: str, radius_m: float, place: TightPlace | None) -> list[str]:
        """Say up to which radius there is a path, and where it is tightest."""
        if place is None or not math.isfinite(radius_m):
            return [self.table["everything"]]
        at = self.table["at"].format(point=self._point(place.point))
        if place.door is not None:
            kind, door = self.table[place.door.kind], place.door
            width = self.number(min(door.width_m, door.passage_m))
            at = self.table["in_door"].format(
                point=self._point(place.point), kind=kind, number=door.number, width=width
            )
        return [self.say(key, widest=self.number(radius_m), place=at)]

    def end(self, end: BlockedEnd) -> list[str]:
        """Say why the robot cannot stand at an end, and where it can."""
        name = self.table["start" if end.is_start else "goal"]
        kind = end.status.value.split(" ", 1)[1]
        if end.status in {PlanStatus.START_OUTSIDE, PlanStatus.GOAL_OUTSIDE}:
            kind = "outside"
        elif kind == "occupied" and end.clearance_m > 0:
            kind = "near" if end.clearance_m <= self._radius_m else "island"
        clear, by = self.number(end.clearance_m), self.listed(end.closures)
        lines = [self.say(kind, end=name, clear=clear, closures=by)]
        if end.nearest is not None:
            far = self.number(end.nearest_m)
            lines.append(self.say("nearest", point=self._point(end.nearest), far=far))
        return lines

    def listed(self, closures: Sequence[Closure]) -> str:
        """List closures: "door 3, door 5 and room kitchen"."""
        names = [_named(one, self.table) for one in closures]
        if len(names) < 2:  # noqa: PLR2004
            return "".join(names)
        return f"{', '.join(names[:-1])} {self.table['and']} {names[-1]}"

    def against(self, why: Any) -> str:
        """Say what may only be crossed the other way."""
        verb = self.table["leads" if len(why.against) == 1 else "lead"]
        key = "away" if why.parts_start else "towards"
        return self.say(key, closures=self.listed(why.against), leads=verb)

    def opening(self, closures: Sequence[Closure]) -> str:
        listed, verb = self.listed(closures), self.table["is" if len(closures) == 1 else "are"]
        if len(closures) == 1:
            return self.say("open", closures=listed, is_are=verb)
        return self.say("open_more", closures=listed)
