"""Tours with several waypoints, described by rooms and doors, and routes in their order."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeVar, overload

from numpy.typing import ArrayLike

from hybridnav.closures.blocked import Closable
from hybridnav.errors import InvalidValueError
from hybridnav.guide.words import Instruction, sentences
from hybridnav.guide.words.bends import Leg
from hybridnav.guide.words.itinerary import guide_of, heading_of, waypoint_text
from hybridnav.planning import Metric, PlanResult, PlanStatus
from hybridnav.planning.named import At
from hybridnav.planning.planner import HybridPlanner
from hybridnav.planning.settings import Smooth
from hybridnav.search.found import ClosedCells

_T = TypeVar("_T")
_COUNTS = ("expanded", "expanded_places", "expanded_intervals", "corridor_cells")


@dataclass(frozen=True, eq=False)
class Tour:
    """A tour through waypoints: a plan between each two, and the legs of all plans.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> waypoints = [(0.5, 0.5), (1.5, 0.5), (0.5, 0.5)]
    >>> round(hn.plan_tour(hn.HybridPlanner(topology), waypoints).length_m, 3)
    2.0
    """

    results: tuple[PlanResult, ...]
    """Plans from waypoint to waypoint, up to the first that is not solved."""
    legs: tuple[Leg, ...]
    """The tour by rooms; none unless it is solved and the map has rooms."""
    instructions: tuple[Instruction, ...] = ()
    """Instructions for a person along the tour; none unless it has legs."""

    @property
    def status(self) -> PlanStatus:
        """Status of the first plan that is not solved, else solved."""
        return self.results[-1].status

    @property
    def solved(self) -> bool:
        """Whether all plans are solved."""
        return self.status is PlanStatus.SOLVED

    @property
    def length_m(self) -> float:
        """Length of the whole tour in metres, infinite unless it is solved."""
        if not self.solved:
            return math.inf
        return sum(result.path.length_m for result in self.results if result.path is not None)

    @property
    def duration_s(self) -> float | None:
        """Seconds of all plans, with a stop at each waypoint; None unless the tour is solved and
        its preset has limits."""
        parts = [result.duration_s for result in self.results]
        if not self.solved or None in parts:
            return None
        return sum(part for part in parts if part is not None)

    @property
    def start(self) -> tuple[float, ...] | None:
        """Start of the tour, as `PlanResult.start`."""
        return self.results[0].start

    @property
    def goal(self) -> tuple[float, ...] | None:
        """Goal of the last plan."""
        return self.results[-1].goal

    @property
    def metric(self) -> Metric:
        """The metric of the plans."""
        return self.results[0].metric

    @property
    def cost(self) -> float:
        """Cost of the whole tour in the metric, infinite unless it is solved: the length, unless
        the metric weights it."""
        return sum(result.cost for result in self.results)

    @property
    def lower_bound(self) -> float:
        """A proved bound on the cost of a tour of the points of the waypoints, in their order."""
        return sum(result.lower_bound for result in self.results)

    @property
    def gap(self) -> float:
        """Proved distance from the optimum between the waypoints, cost / lower bound - 1; NaN
        unless the tour is solved."""
        if not self.solved:
            return math.nan
        return self.cost / self.lower_bound - 1 if self.lower_bound > 0 else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for strict JSON.

        These are those of `PlanResult.to_dict` for the whole tour, `legs`, `instructions`, and the
        `words` for a person in English.

        Points and headings, places and arcs are those of all plans in order, with the place of a
        waypoint once. If the robot turns at a waypoint, its point occurs twice. Counts and seconds
        are sums.
        """
        parts = [result.to_dict() for result in self.results]
        points, headings = _joined_points(parts)
        places = [parts[0]["places"], *((part["places"] or [])[1:] for part in parts[1:])]
        return parts[0] | {
            "status": str(self.status),
            "goal": parts[-1]["goal"],
            "settings": parts[-1]["settings"],
            "length_m": self.length_m if self.solved else None,
            "duration_s": self.duration_s,
            "cost": self.cost if self.solved else None,
            "lower_bound": self.lower_bound if self.solved else None,
            "gap": self.gap if self.solved else None,
            "places": self._whole(parts, "places", places),
            "arcs": self._whole(parts, "arcs", [part["arcs"] for part in parts]),
            "points": points if self.solved else None,
            "headings_rad": headings if self.solved else None,
            "steps": self._whole(parts, "steps", [part["steps"] for part in parts]),
            **{name: sum(part[name] for part in parts) for name in _COUNTS},
            "seconds": _summed([part["seconds"] for part in parts]),
            "legs": [leg.to_dict() for leg in self.legs],
            "instructions": [instruction.to_dict() for instruction in self.instructions],
            "words": self.words(),
        }

    def _whole(
        self, parts: list[dict[str, Any]], name: str, lists: list[list[Any]]
    ) -> list[Any] | None:
        if not self.solved or any(part[name] is None for part in parts):
            return None
        return [item for part in lists for item in part]

    def words(self, language: str = "en") -> list[str]:
        """Return a description of the tour for a person, one sentence a line.

        Parameters
        ----------
        language
            Code of a language, one of `hybridnav.guide.words.languages`.

        Returns
        -------
        list of str
            No lines without legs.

        Raises
        ------
        InvalidValueError
            When there are no sentences in this language.
        """
        return sentences(self.instructions, language)


def _joined_points(parts: list[dict[str, Any]]) -> tuple[list[list[float]], list[float]]:
    """Return points and headings of all parts.

    A point at which one part ends and the next begins occurs once, unless the robot turns there. A
    part of one point, to a waypoint at the robot's position, has no heading of its own and is left
    out unless all parts are like that.
    """
    parts = [part for part in parts if len(part["points"] or []) > 1] or parts[:1]
    points: list[list[float]] = []
    headings: list[float] = []
    for part in parts:
        begun, faced = part["points"] or [], part["headings_rad"] or []
        if points and begun and points[-1] == begun[0]:
            points.pop()
            left = headings.pop()
            if left != faced[0]:
                points.append(begun[0])
                headings.append(left)
        points += begun
        headings += faced
    return points, headings


def _summed(parts: list[dict[str, float]]) -> dict[str, float]:
    stages = dict.fromkeys(stage for part in parts for stage in part)
    return {stage: round(sum(part.get(stage, 0.0) for part in parts), 6) for stage in stages}


@dataclass(frozen=True, eq=False)
class Ranked(Sequence[_T]):
    """Routes that a search has found, the best first: a sequence of them."""

    found: tuple[_T, ...]
    """The routes."""
    complete: bool
    """Whether there are as many as requested, or all that keep to the limits: False where the
    search stopped before."""
    note: str = ""
    """The reason why there are fewer than requested, one line; empty if there are not."""

    @overload
    def __getitem__(self, index: int) -> _T: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[_T, ...]: ...

    def __getitem__(self, index: int | slice) -> _T | tuple[_T, ...]:
        """Return one route, or some."""
        return self.found[index]

    def __len__(self) -> int:
        """Return the number of routes."""
        return len(self.found)


def plan_tour(
    planner: HybridPlanner,
    waypoints: Sequence[ArrayLike | str],
    *,
    at: At = "anywhere",
    smooth: Smooth | None = None,
    blocked: Closable | ClosedCells | None = None,
) -> Tour:
    """Plan a tour that visits waypoints in the given order.

    Parameters
    ----------
    planner
        Planner of each part.
    waypoints
        Two or more: points `(x, y)` in metres, or `(x, y, yaw)` with the heading in radians that
        the robot has there, names of rooms or of named points. OMPL in a space with headings needs
        the yaw, and names face along the path.
    at
        Position in a room: `"anywhere"`, chosen for all waypoints together so that the whole cell
        path is cheapest, or at the room's `"point"`.
    smooth, blocked
        As in `HybridPlanner.plan`.

    Returns
    -------
    Tour
        It ends with the first part that is not solved.

    Raises
    ------
    InvalidValueError
        When there are fewer than two waypoints, a name is not known, a point is not two or
        three finite numbers, or a closed item is not on the map.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> waypoints = [(0.5, 0.5), (2.0, 2.5), (0.5, 0.5)]
    >>> tour = hn.plan_tour(hn.HybridPlanner(topology), waypoints)
    >>> tour.solved, len(tour.results)
    (True, 2)
    """
    if len(waypoints) < 2:  # noqa: PLR2004
        raise InvalidValueError(f"a tour needs at least two waypoints, got {len(waypoints)}")
    points = planner.points_of(waypoints, at=at, blocked=blocked)
    results: list[PlanResult] = []
    for pair in itertools.pairwise(points):
        results.append(planner.plan(*pair, smooth=smooth, blocked=blocked))
        if not results[-1].solved:
            break
    return tour_of(planner, results, waypoints)


def tour_of(
    planner: HybridPlanner, results: Sequence[PlanResult], waypoints: Sequence[ArrayLike | str]
) -> Tour:
    """Return the tour of plans from waypoint to waypoint.

    `planner`: planner of the map; without rooms the tour has no legs; `results`: plans in order, at
    least one; only the last may be unsolved; `waypoints`: points or names, one more than plans if
    all are solved.
    """
    guide = guide_of(planner) if results[-1].solved else None
    if guide is None:
        return Tour(tuple(results), ())
    paths = [result.path for result in results if result.path is not None]
    legs = [
        guide.legs(path, waypoint=waypoint_text(waypoint))
        for path, waypoint in zip(paths, waypoints[1:], strict=True)
    ]
    heading_rad = heading_of(results[0].start)
    instructions = guide.instructions(paths, legs, heading_rad=heading_rad)
    return Tour(tuple(results), tuple(itertools.chain(*legs)), instructions)
