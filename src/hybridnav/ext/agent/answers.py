"""Answers for programs: rooms, routes, reasons, each small, in metres and names, with its proof."""

import math
import tempfile
import threading
from abc import ABC, abstractmethod
from collections import OrderedDict
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from typing import Any

from hybridnav._base.trig import dist
from hybridnav.closures import Blocked
from hybridnav.errors import HybridNavError, InvalidValueError
from hybridnav.ext.agent import places
from hybridnav.ext.agent import questions as ask
from hybridnav.ext.page.requests import Edit, Save
from hybridnav.ext.page.session import Session
from hybridnav.guide import Tour, plan_tour
from hybridnav.planning import HybridPlanner
from hybridnav.reasons.why import explain, explain_solved
from hybridnav.rooms import Rooms
from hybridnav.topology import TopologicalMap

_MOST_PLANNERS = 3
"""Widths whose planners are kept."""
_MOST_POINTS = 200
_PASSED = 16
"""Rooms that a route lists."""


class _Answers(ABC):
    """What answers about a map and about a building share.

    `known`: all functions; `kinds`: of things that can be closed.
    """

    def __init__(
        self, known: Sequence[ask.Tool], kinds: Sequence[str], *, allow_edits: bool
    ) -> None:
        self._known, self.allow_edits = known, allow_edits
        self.tools = ask.tools(known, allow_edits=allow_edits)
        self._lock = threading.RLock()
        self._changes = Changes(kinds)

    def call(self, name: str, arguments: dict[str, Any]) -> dict[str, Any]:
        """Answer a question, by the name of one of `TOOLS` and the arguments of its model.

        Return an `Answer`; with `ok` False if the question cannot be answered as it is, where
        `text` has advice, and `choices` the meanings of a name. Pictures have `png`, bytes.
        """
        functions = {tool: getattr(self, f"_{tool.name}") for tool in self._known}
        with self._lock:
            return ask.answer_of(functions, name, arguments, allow_edits=self.allow_edits)

    @abstractmethod
    def _named(self, asked: Any) -> list[places.Thing]:
        """Return the doors, rooms and links that a question names."""

    def _close(self, asked: Any) -> dict[str, Any]:
        return self._changes.close(self._named(asked))

    def _open(self, asked: Any) -> dict[str, Any]:
        return self._changes.open(self._named(asked))

    def _undo(self, _: ask.TakeBack) -> dict[str, Any]:
        return self._changes.undo()


class MapAnswers(_Answers):
    """Answers about one map. Threads may share it; one call is answered at a time.

    Parameters
    ----------
    session
        The map, its rooms and their file.
    allow_edits
        Whether doors and rooms may be closed, and rooms named.

    Examples
    --------
    >>> hn.save(hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1"))), "f.hnm")
    >>> model = hn.load("f.hnm")
    >>> topology = model.grown(model.fitted(None).pyramid, hn.find_rooms(model.grid))
    >>> from hybridnav.ext.agent import MapAnswers
    >>> from hybridnav.ext.page import Session
    >>> answers = MapAnswers(Session(model, topology, model.fitted(None)))
    >>> answers.call("where_am_i", {"point": [0.5, 0.5]})["room"]
    'room-1'
    """

    def __init__(self, session: Session, *, allow_edits: bool = False) -> None:
        super().__init__(ask.TOOLS, ("doors", "rooms"), allow_edits=allow_edits)
        self._session = session
        self.instructions = ask.INSTRUCTIONS.format(point="[x, y]")
        self._planners: OrderedDict[float, HybridPlanner] = OrderedDict()

    # The map.

    @property
    def _rooms(self) -> Rooms:
        return self._topology.rooms

    @property
    def _topology(self) -> TopologicalMap:
        return self._session.planning.topology

    @property
    def _places(self) -> places.NamedPlaces:
        return places.NamedPlaces(self._rooms)

    def _shut(self, avoiding: list[int | str]) -> Blocked:
        """Return what is closed, in this session and for all, with what one question avoids."""
        return self._session.out_of_order() | places.blocked_of(
            [*self._changes.closed, *self._places.things(avoiding)]
        )

    def _describe_map(self, _: ask.DescribeMap) -> dict[str, Any]:
        grid, facts = self._session.grid, self._places.facts()
        kinds, (wide, high) = facts["rooms"], facts["size_m"]
        text = (
            f"{grid.name}: {wide} x {high} m, {facts['free_m2']} m² free, {sum(kinds.values())} "
            f"rooms (corridors: {kinds['corridor']}, halls: {kinds['hall']}), "
            f"{facts['doors']} doors and openings, robot radius {grid.robot_radius_m} m."
        )
        return {
            "text": text,
            "name": grid.name,
            **facts,
            "robot_radius_m": grid.robot_radius_m,
            "closed": self._changes.now,
            "edits_allowed": self.allow_edits,
        }

    def _list_rooms(self, asked: ask.ListRooms) -> dict[str, Any]:
        return rooms_answer(self._places.asked(asked), asked)

    def _where_am_i(self, asked: ask.WhereAmI) -> dict[str, Any]:
        return self._places.where((asked.point[0], asked.point[1]))

    # Routes.

    def _planner(self, width: float | None) -> HybridPlanner:
        """Return a planner for those of a width, by shortest paths."""
        planning = self._session.planning
        own = planning.planner("shortest")
        if width is None or width / 2 == own.grid.robot_radius_m:
            return own
        key = width / 2
        known = self._planners.get(key)
        if known is None or known.pyramid_rooms is not self._rooms.labels:
            known = self._planners[key] = places.narrowed(own, key)
        self._planners.move_to_end(key)
        while len(self._planners) > _MOST_PLANNERS:
            self._planners.popitem(last=False)
        return known

    def _tour(self, asked: ask.Journey) -> tuple[HybridPlanner, Tour]:
        ends = [self._places.place(asked.start), self._places.place(asked.goal)]
        planner = self._planner(asked.width)
        return planner, plan_tour(planner, ends, blocked=self._shut(asked.avoiding))

    def _route(self, asked: ask.RouteBetween) -> dict[str, Any]:
        planner, tour = self._tour(asked)
        if not tour.solved:
            refused = self._no_path(planner, tour, asked, asked.language)
            return refused | self._near(planner, tour, asked)
        length, bound = round(tour.length_m, 3), places.rounded_down(tour.lower_bound)
        doors = [leg.door.number for leg in tour.legs if leg.door is not None]
        least = places.rounded_down(bound, 2)
        answer: dict[str, Any] = {
            "text": f"{length:.2f} m, and no path is shorter than {least:.2f} m.",
            "status": "solved",
            "length_m": length,
            "lower_bound_m": bound,
            "gap": round(max(tour.gap, 0.0), 9),
            "start": places.rounded(tour.start),
            "goal": places.rounded(tour.goal),
            "rooms": [leg.room or leg.shape for leg in tour.legs][:_PASSED],
            "doors": doors[:_PASSED],
        }
        if asked.words:
            lines = tour.words(asked.language)[asked.words_from :]
            answer["words"] = places.fitting(lines)
            answer["words_left"] = len(lines) - len(answer["words"])
        path = tour.results[0].path
        if asked.points and path is not None:
            answer["points"] = path.points[:_MOST_POINTS].round(3).tolist()
        return answer

    def _near(self, planner: HybridPlanner, tour: Tour, asked: ask.RouteBetween) -> dict[str, Any]:
        """Return a route to the nearest point that can be reached, if it is wanted and near."""
        if asked.within is None or tour.start is None or tour.goal is None:
            return {}
        shut = self._shut(asked.avoiding)
        nearest = planner.plan(tour.start, tour.goal, blocked=shut, within_m=asked.within)
        if nearest.path is None:
            return {}
        bound = math.floor(nearest.lower_bound * 1000) / 1000
        points = nearest.path.points
        answer = {
            "text": f"{nearest.reason} The nearest point that can be reached lies "
            f"{nearest.short_m:.2f} m from the goal; {nearest.cost:.2f} m to it.",
            "status": str(nearest.status),
            "length_m": round(nearest.cost, 3),
            "lower_bound_m": bound,
            "short_m": round(nearest.short_m, 3),
            "start": places.rounded(nearest.start),
            "goal": places.rounded(tuple(points[-1].tolist())),
        }
        return answer | (
            {"points": points[:_MOST_POINTS].round(3).tolist()} if asked.points else {}
        )

    def _no_path(
        self, planner: HybridPlanner, tour: Tour, asked: ask.Journey, language: str
    ) -> dict[str, Any]:
        """Answer that there is no path, and why."""
        why = explain(
            planner,
            tour.start or self._places.place(asked.start),
            tour.goal or self._places.place(asked.goal),
            blocked=self._shut(asked.avoiding),
        )
        words = why.words(language)
        return {
            "text": " ".join(words),
            "status": str(tour.status),
            "reason": words,
            "doors_to_open": [one.which for one in why.to_open if one.kind == "doors"],
            "widest_m": places.doubled(why.widest_m),
        }

    def _can_reach(self, asked: ask.CanReach) -> dict[str, Any]:
        planner, tour = self._tour(asked)
        if not tour.solved:
            return {"can_reach": False, **self._no_path(planner, tour, asked, "en")}
        named = [self._places.place(one) for one in (asked.start, asked.goal)]
        shut = self._shut(asked.avoiding)
        why = explain_solved(planner, (tour.start, tour.goal), named, blocked=shut)
        width = places.doubled(why.widest_m)
        limits = "nothing limits the width"
        if width is not None:
            limits = f"for all who are below {width:.3f} m wide"
        return {
            "text": f"Yes, in {tour.length_m:.2f} m; {limits}.",
            "can_reach": True,
            "length_m": round(tour.length_m, 3),
            "widest_m": width,
            **places.tight_of(why),
        }

    def _explain(self, asked: ask.Explain) -> dict[str, Any]:
        start, goal = self._places.place(asked.start), self._places.place(asked.goal)
        blocked = self._shut(asked.avoiding)
        planner = self._session.planning.planner("shortest")
        radius_m = None if asked.width is None else asked.width / 2
        why = explain(planner, start, goal, blocked=blocked, radius_m=radius_m)
        return {
            "text": " ".join(why.words(asked.language)),
            "has_path": why.has_path,
            "widest_m": places.doubled(why.widest_m),
            "doors_to_open": [one.which for one in why.to_open if one.kind == "doors"],
            "through_unexplored": why.through_unexplored,
            **places.tight_of(why),
        }

    def _nearest(self, asked: ask.Nearest) -> dict[str, Any]:
        """Plan to candidates in order of their straight distances, until no other can be nearer."""
        start, planner = self._places.place(asked.start), self._planner(None)
        here = self._rooms.point_of(start) if isinstance(start, str) else start
        goals, shut = self._places.candidates(asked.of, start), self._shut([])
        if not goals:
            known = [name for name in self._places.listed() if name != start]
            raise places.nothing(asked.of, "nothing", known, self._places.choices)

        def plan(point: places.Point) -> tuple[float, dict[str, Any]]:
            result = planner.plan(here, point, blocked=shut)
            if not math.isfinite(result.cost):
                return result.cost, {}
            bound_m = places.rounded_down(result.lower_bound)
            return result.cost, {"length_m": round(result.cost, 3), "lower_bound_m": bound_m}

        goals.sort(key=lambda goal: dist(goal[1], here))
        least = [(dist(at, here), k, facts, at) for k, (facts, at) in enumerate(goals)]
        return nearest_answer(
            asked, least, plan, lambda _, length_m: f" ({length_m:.2f} m)", " from there"
        )

    def _picture(self, asked: ask.Picture) -> dict[str, Any]:
        from hybridnav import viz  # noqa: PLC0415 - loads matplotlib

        if (asked.start is None) != (asked.goal is None):
            raise InvalidValueError("a picture of a route needs start and goal; of the map neither")
        if asked.start is None or asked.goal is None:
            ax, text = viz.plot_rooms(self._topology), "The map with its rooms."
        else:
            journey = ask.Journey(start=asked.start, goal=asked.goal)
            planner, tour = self._tour(journey)
            if not tour.solved:
                return self._no_path(planner, tour, journey, "en")
            ax = viz.plot_tour(self._topology, tour, blocked=self._shut([]))
            text = f"A route of {tour.length_m:.2f} m."
        return {"text": text, "png": png_of(ax)}

    # Changes.

    def _named(self, asked: ask.Close) -> list[places.Thing]:
        things = self._places.things(asked.doors, of_doors=True)
        return things + self._places.things(asked.rooms)

    def _name_room(self, asked: ask.NameRoom) -> dict[str, Any]:
        old = self._places.meant(asked.room, list(self._rooms.names))

        def rename(old: str, new: str) -> dict[str, Any]:
            renamed(self._session, old, new)
            return self._changes.renamed(old, self._places.room(new))

        return self._changes.change(rename, old, asked.name)


class Changes:
    """What a session has closed and named, and how it takes that back; each returns an answer.

    `kinds`: of things that can be closed.
    """

    def __init__(self, kinds: Sequence[str]) -> None:
        self._kinds = kinds
        self.closed: tuple[places.Thing, ...] = ()
        self._before: list[tuple[places.Thing, ...] | Callable[[], dict[str, Any]]] = []
        """What undoes each change: what was closed, or what gives a room its old name."""

    @property
    def now(self) -> dict[str, list[int | str]]:
        """What is closed, by kind."""
        return {
            kind: [one.shown for one in self.closed if one.kind == kind] for kind in self._kinds
        }

    def _use(self, closed: Iterable[places.Thing]) -> dict[str, Any]:
        self.closed = tuple(dict.fromkeys(closed))
        listed = ", ".join(f"{kind} {things}" for kind, things in self.now.items())
        return {"text": f"closed now: {listed}"[:900], "closed": self.now}

    def close(self, things: Sequence[places.Thing]) -> dict[str, Any]:
        """Close things."""
        if not things:
            raise InvalidValueError(f"give {' or '.join(self._kinds)}")
        self._before.append(self.closed)
        return self._use((*self.closed, *things))

    def open(self, things: Sequence[places.Thing]) -> dict[str, Any]:
        """Open things that are closed."""
        if missing := [one for one in things if one not in self.closed]:
            shown = f"not closed: {missing[0].shown}; closed are {self.now}"
            raise InvalidValueError(shown[:300])
        self.close(things)
        return self._use(one for one in self.closed if one not in things)

    def undo(self) -> dict[str, Any]:
        """Take the last change back."""
        if not self._before:
            raise InvalidValueError("there is nothing to take back in this session")
        before = self._before[-1]
        answer = before() if callable(before) else self._use(before)
        self._before.pop()
        return answer

    def change(
        self, rename: Callable[[str, str], dict[str, Any]], old: str, new: str
    ) -> dict[str, Any]:
        """Rename a room."""
        answer = rename(old, new)
        self._before.append(lambda: rename(new, old))
        return answer

    def renamed(
        self, old: str, room: dict[str, Any], floors: Collection[str | None] = (None,)
    ) -> dict[str, Any]:
        """Call a room of some floors by its new name wherever it is closed."""

        def now(things: tuple[places.Thing, ...]) -> tuple[places.Thing, ...]:
            was = {places.Thing("rooms", old, floor) for floor in floors}
            return tuple(one._replace(which=room["name"]) if one in was else one for one in things)

        self.closed = now(self.closed)
        self._before = [one if callable(one) else now(one) for one in self._before]
        return {"text": f"room {old} is called {room['name']} now, saved.", "room": room}


# What one map and a building both do.


def rooms_answer(rooms: Sequence[dict[str, Any]], asked: ask.ListRooms) -> dict[str, Any]:
    """Return the part of a list of rooms that is asked for."""
    shown = rooms[asked.first : asked.first + asked.count]
    rest = len(rooms) - asked.first - len(shown)
    text = f"{len(rooms)} rooms" + (f", {rest} more after these" if rest > 0 else "")
    return {"text": text, "total": len(rooms), "rooms": shown}


def nearest_answer(
    asked: ask.Nearest,
    goals: Iterable[tuple[float, int, dict[str, Any], Any]],
    plan: Callable[[Any], tuple[float, dict[str, Any]]],
    words: Callable[[dict[str, Any], float], str],
    there: str = "",
) -> dict[str, Any]:
    """Plan to goals in the order of their bounds, until no other can be nearer.

    `goals`: the bound, rank among equals, facts and place of each; `plan`: returns the cost to a
    place, infinite for none, and more facts; `words`: what follows a name, of its facts and cost.
    """
    best: list[tuple[float, int, dict[str, Any]]] = []
    others_m, waiting = math.inf, sorted(goals, key=lambda goal: goal[:2])
    for least_m, k, facts, place in waiting:
        if len(best) >= asked.count and least_m >= best[asked.count - 1][0]:
            others_m = least_m  # no path to this one or a later one is shorter
            break
        cost, figures = plan(place)
        if math.isfinite(cost):
            best = sorted([*best, (cost, k, facts | figures)], key=lambda one: one[:2])
    if not best:
        raise ask.UnclearError(f"none of {len(waiting)} of {asked.of!r:.80} can be reached{there}")
    others_m = min([others_m, *(cost for cost, *_ in best[asked.count :])])
    best = best[: asked.count]
    names = ", ".join(
        f"{one.get('name') or 'door ' + str(one['number'])}{words(one, cost)}"
        for cost, _, one in best
    )
    return {
        "text": f"Nearest: {names}.",
        "nearest": [facts for *_, facts in best],
        "others_at_least_m": places.rounded_down(others_m) if math.isfinite(others_m) else None,
    }


def png_of(ax: Any) -> bytes:
    """Return the picture of the figure of some axes."""
    from hybridnav import viz  # noqa: PLC0415 - loads matplotlib

    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "picture.png"
        viz.save_figure(ax, file, dpi=100)
        return file.read_bytes()


def renamed(session: Session, old: str, new: str) -> None:
    """Give a room another name, and save it, or leave all as it was."""
    change = {"op": "rename", "room": old, "name": new}
    session.edit(Edit(version=session.version, change=change))
    try:
        session.save(Save(version=session.version))
    except HybridNavError:
        session.undo(session.version)
        raise
