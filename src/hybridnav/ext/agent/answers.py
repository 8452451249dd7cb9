"""Answers for programs: rooms, routes, reasons, each small, in metres and names, with its proof."""

from __future__ import annotations

import math
import tempfile
import threading
from collections import OrderedDict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from hybridnav.errors import HybridNavError, InvalidValueError
from hybridnav.ext.agent import places
from hybridnav.ext.agent import questions as ask
from hybridnav.ext.page.requests import Edit, Save
from hybridnav.maps import CellClass
from hybridnav.maps.names import did_you_mean, matching
from hybridnav.planner import Blocked, HybridPlanner, Tour, plan_tour

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav.ext.page.session import Session
    from hybridnav.topology import TopologicalMap
    from hybridnav.topology.rooms import Rooms

_MOST_PLANNERS = 3
"""Widths whose planners are kept."""
_MOST_POINTS = 200
_PASSED = 16
"""Rooms that a route lists."""


class MapAnswers:
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
        self._session, self.allow_edits = session, allow_edits
        self._lock = threading.RLock()
        self._closed = Blocked()
        self._before: list[tuple[str, str] | Blocked] = []
        """What each change took: what was closed, or the old and the new name of a room."""
        self._planners: OrderedDict[float, HybridPlanner] = OrderedDict()

    def call(self, name: str, arguments: dict[str, Any]) -> dict[str, Any]:
        """Answer a question.

        Parameters
        ----------
        name
            The name of one of `TOOLS`.
        arguments
            Those of its model.

        Returns
        -------
        dict
            An `Answer`; with `ok` False if the question cannot be answered as it is, where `text`
            has advice, and `choices` the meanings of a name. Pictures have `png`, bytes.
        """
        tool = next((one for one in ask.TOOLS if one.name == name), None)
        try:
            if tool is None:
                names = tuple(one.name for one in ask.tools(allow_edits=self.allow_edits))
                raise InvalidValueError(f"no function {name!r:.80}{did_you_mean(name, names)}")
            if tool.edits and not self.allow_edits:
                raise InvalidValueError(
                    f"{name} changes what others see: start the server with --allow-edits"
                )
            asked = tool.asks.model_validate(arguments)
            answer: Callable[[Any], dict[str, Any]] = getattr(self, f"_{name}")
            with self._lock:
                return {"ok": True, **answer(asked)}
        except ValidationError as error:
            assert tool is not None  # noqa: S101 - its model has refused
            return _refused(ask.mistake(error, tuple(tool.asks.model_fields))[:300])
        except places.UnclearError as error:
            return _refused(str(error)) | {"choices": error.choices}
        except HybridNavError as error:
            return _refused(str(error))

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
        """Return what is closed in this session with what one question avoids."""
        return self._closed | self._places.blocked(avoiding)

    def _describe_map(self, _: ask.DescribeMap) -> dict[str, Any]:
        grid, rooms = self._session.grid, self._rooms
        listed = self._places.listed()
        kinds = [self._places.kind(one) for one in listed]
        rows, cols = grid.shape
        size = [round(cols * grid.resolution_m, 2), round(rows * grid.resolution_m, 2)]
        free = round(float((grid.measured == CellClass.FREE).sum() * grid.cell_area_m2), 1)
        counts = {kind: kinds.count(kind) for kind in ("room", "corridor", "hall")}
        text = (
            f"{grid.name}: {size[0]} x {size[1]} m, {free} m² free, {len(listed)} rooms "
            f"(corridors: {counts['corridor']}, halls: {counts['hall']}), "
            f"{len(rooms.listed_doors)} doors and openings, robot radius {grid.robot_radius_m} m."
        )
        corners = grid.frame.points_of_grid(np.array([[0, 0], [rows, cols]])).round(2).tolist()
        return {
            "text": text,
            "name": grid.name,
            "size_m": size,
            "corners": corners,
            "free_m2": free,
            "rooms": counts,
            "doors": len(rooms.listed_doors),
            "robot_radius_m": grid.robot_radius_m,
            "closed": self._closed_now(),
            "edits_allowed": self.allow_edits,
        }

    def _list_rooms(self, asked: ask.ListRooms) -> dict[str, Any]:
        names = self._places.listed()
        if asked.kind is not None:
            names = [name for name in names if self._places.kind(name) == asked.kind]
        if asked.name.strip():
            names = [names[at] for at in matching(asked.name, names)]
        shown = names[asked.first : asked.first + asked.count]
        rest = len(names) - asked.first - len(shown)
        text = f"{len(names)} rooms" + (f", {rest} more after these" if rest > 0 else "")
        return {
            "text": text,
            "total": len(names),
            "rooms": [self._places.room(name) for name in shown],
        }

    def _where_am_i(self, asked: ask.WhereAmI) -> dict[str, Any]:
        rooms, grid = self._rooms, self._session.grid
        x, y = asked.point
        row, col = grid.frame.cell_of(x, y)
        if not (0 <= row < grid.shape[0] and 0 <= col < grid.shape[1]):
            raise InvalidValueError("the point lies outside the map: describe_map has its corners")
        name = rooms.at((x, y))
        is_free = grid.measured[row, col] == CellClass.FREE
        ground = CellClass(grid.measured[row, col]).name.lower()
        near = sorted(rooms.listed_doors, key=lambda door: math.dist(door.position, (x, y)))
        doors = [] if name is None else self._places.doors_of(name)
        beside = [
            {"door": door.number, "to": other, "kind": door.kind}
            for door in doors
            for other in door.rooms
            if other != name
        ]
        place = "no room"
        if name is not None:
            place = f"{self._places.kind(name)} {name}".replace("room room", "room")
        text = f"({x:g}, {y:g}) lies in {place}" + ("" if is_free else f", on {ground} ground")
        answer: dict[str, Any] = {
            "text": f"{text}.",
            "room": name,
            "ground": ground,
            "beside": beside[: places.SHOWN],
        }
        if near:
            answer["nearest_door"] = {
                "number": near[0].number,
                "straight_m": round(math.dist(near[0].position, (x, y)), 2),
            }
        return answer

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
        found = planner.plan(tour.start, tour.goal, blocked=shut, within_m=asked.within)
        if found.path is None:
            return {}
        bound = math.floor(found.lower_bound * 1000) / 1000
        points = found.path.points
        answer = {
            "text": f"{found.reason} The nearest point that can be reached lies "
            f"{found.short_m:.2f} m from the goal; {found.cost:.2f} m to it.",
            "status": str(found.status),
            "length_m": round(found.cost, 3),
            "lower_bound_m": bound,
            "short_m": round(found.short_m, 3),
            "start": places.rounded(found.start),
            "goal": places.rounded(tuple(points[-1].tolist())),
        }
        return answer | (
            {"points": points[:_MOST_POINTS].round(3).tolist()} if asked.points else {}
        )

    def _no_path(
        self, planner: HybridPlanner, tour: Tour, asked: ask.Journey, language: str
    ) -> dict[str, Any]:
        """Answer that there is no path, and why."""
        why = planner.explain(
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
        ends: Any = tour.start, tour.goal
        why = planner.explain(*ends, blocked=self._shut(asked.avoiding))
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
        why = planner.explain(start, goal, blocked=blocked, radius_m=radius_m)
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
        goals = self._places.candidates(asked.of, start)
        goals.sort(key=lambda goal: math.dist(goal[1], here))
        best: list[tuple[float, dict[str, Any]]] = []
        others_m = math.inf
        for facts, point in goals:
            straight_m = math.dist(point, here)
            if len(best) >= asked.count and straight_m >= best[asked.count - 1][0]:
                others_m = straight_m  # no path to this one or a later one is shorter
                break
            found = planner.draft(here, point, blocked=self._closed)
            if math.isfinite(found.cost):
                bound_m = places.rounded_down(found.lower_bound)
                lengths = {"length_m": round(found.cost, 3), "lower_bound_m": bound_m}
                best.append((found.cost, facts | lengths))
                best.sort(key=lambda one: one[0])
        if not best:
            raise places.UnclearError(
                f"none of {len(goals)} of {asked.of!r:.80} can be reached from there"
            )
        others_m = min([others_m, *(length for length, _ in best[asked.count :])])
        best = best[: asked.count]
        names = ", ".join(
            f"{facts.get('name') or 'door ' + str(facts['number'])} ({length:.2f} m)"
            for length, facts in best
        )
        return {
            "text": f"Nearest: {names}.",
            "nearest": [facts for _, facts in best],
            "others_at_least_m": places.rounded_down(others_m) if math.isfinite(others_m) else None,
        }

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
            ax = viz.plot_tour(self._topology, tour, blocked=self._closed)
            text = f"A route of {tour.length_m:.2f} m."
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "picture.png"
            viz.save_figure(ax, file, dpi=100)
            return {"text": text, "png": file.read_bytes()}

    # Changes.

    def _closed_now(self) -> dict[str, Any]:
        return {"doors": list(self._closed.doors), "rooms": list(self._closed.rooms)}

    def _changed(self, closed: Blocked) -> dict[str, Any]:
        """Take over what is closed from now on."""
        self._before.append(self._closed)
        return self._use(closed)

    def _use(self, closed: Blocked) -> dict[str, Any]:
        self._closed = closed
        now = self._closed_now()
        return {"text": f"closed now: doors {now['doors']}, rooms {now['rooms']}", "closed": now}

    def _named(self, asked: ask.Close) -> tuple[list[Any], list[str]]:
        named = self._places.blocked(asked.doors, of_doors=True) | self._places.blocked(asked.rooms)
        if not named.doors and not named.rooms:
            raise InvalidValueError("give doors or rooms")
        return list(named.doors), list(named.rooms)

    def _close(self, asked: ask.Close) -> dict[str, Any]:
        doors, rooms = self._named(asked)
        now = self._closed_now()
        return self._changed(
            Blocked(
                doors=list(dict.fromkeys(now["doors"] + doors)),
                rooms=list(dict.fromkeys(now["rooms"] + rooms)),
            )
        )

    def _open(self, asked: ask.Open) -> dict[str, Any]:
        doors, rooms = self._named(asked)
        now = self._closed_now()
        if missing := [*set(doors) - set(now["doors"]), *set(rooms) - set(now["rooms"])]:
            raise InvalidValueError(f"not closed: {missing[0]}; closed are {now}")
        return self._changed(
            Blocked(
                doors=[door for door in now["doors"] if door not in doors],
                rooms=[room for room in now["rooms"] if room not in rooms],
            )
        )

    def _undo(self, _: ask.TakeBack) -> dict[str, Any]:
        if not self._before:
            raise InvalidValueError("there is nothing to take back in this session")
        before = self._before[-1]
        if not isinstance(before, Blocked):
            old, new = before
            answer = self._rename(new, old)
            self._before.pop()
            return answer
        self._before.pop()
        return self._use(before)

    def _name_room(self, asked: ask.NameRoom) -> dict[str, Any]:
        old = self._places.meant(asked.room, list(self._rooms.names))
        answer = self._rename(old, asked.name)
        self._before.append((old, asked.name))
        return answer

    def _rename(self, old: str, new: str) -> dict[str, Any]:
        session = self._session
        change = {"op": "rename", "room": old, "name": new}
        session.edit(Edit(version=session.version, change=change))
        try:
            session.save(Save(version=session.version))
        except HybridNavError:
            session.undo(session.version)
            raise

        def renamed(closed: Blocked) -> Blocked:
            rooms = [new if one == old else one for one in closed.rooms]
            return Blocked(doors=closed.doors, rooms=rooms)

        self._closed = renamed(self._closed)
        self._before = [renamed(one) if isinstance(one, Blocked) else one for one in self._before]
        return {"text": f"room {old} is called {new} now, saved.", "room": self._places.room(new)}


def _refused(text: str) -> dict[str, Any]:
    return {"ok": False, "text": text}
