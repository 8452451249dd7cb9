"""Alternatives: paths between two points that differ for people."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any, Literal, Protocol, TypeVar, get_args, overload

from hybridnav._base.extension import extension
from hybridnav.errors import InvalidValueError
from hybridnav.maps.checks import checked_whole
from hybridnav.planner.by_doors import Chosen, DoorTours, RouteLimits
from hybridnav.planner.tour import Tour, plan_tour

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from numpy.typing import ArrayLike

    from hybridnav.planner import Path, PlanResult
    from hybridnav.planner.blocked import Closable
    from hybridnav.planner.named import At
    from hybridnav.planner.planner import HybridPlanner


# Options of alternatives: their defaults, their ranges, and where each changes something.

By = Literal["doors", "homotopy"]
"""Difference between two paths: the doors that they pass, or the sides of obstacles."""
MOST = 20
"""Most alternatives of one query."""
_MAX_OVERLAP, _MAX_STRETCH = 0.8, 2.0
_BY_DOORS = ("max_overlap", "max_stretch", "inside_rooms")
_BY_CLASSES = ("least_hole_m2", "most_states", "time_limit_s")
_T = TypeVar("_T")


def check_used(by: str, given: Mapping[str, object]) -> None:
    """Refuse a difference that does not exist, and options that change nothing with it.

    Parameters
    ----------
    by
        The difference between paths.
    given
        The options that the caller gave, by name.
    """
    if by not in get_args(By):
        raise InvalidValueError(f"by must be 'doors' or 'homotopy', got {by!r:.80}")
    idle: Iterable[str] = ()
    where = "by='doors'"
    if by == "homotopy":
        idle = _BY_DOORS
    elif "inside_rooms" not in given:
        idle, where = _BY_CLASSES, "by='homotopy' or inside_rooms=True"
    for name in idle:
        if name in given:
            raise InvalidValueError(
                f"{name}={given[name]!r:.80} was given with by={by!r:.80}, and it is for "
                f"alternatives with {where}: leave it out"
            )


def limits_of(count: int, max_overlap: float | None, max_stretch: float | None) -> RouteLimits:
    """Return the limits if they are in range; None stands for the default."""
    limits = {"max_overlap": (max_overlap, 0.0, 1.0), "max_stretch": (max_stretch, 1.0, math.inf)}
    for name, (value, low, high) in limits.items():
        if value is not None and not (isinstance(value, Real) and low <= float(value) <= high):
            most = "or more" if math.isinf(high) else f"to {high:g}"
            raise InvalidValueError(
                f"{name} must be a number from {low:g} {most}, got {value!r:.80}"
            )
    return RouteLimits(
        checked_whole("alternatives", count, 1, MOST),
        _or(max_overlap, _MAX_OVERLAP),
        _or(max_stretch, _MAX_STRETCH),
    )


def _or(given: _T | None, default: _T) -> _T:
    """Return what was given, or the default for None."""
    return default if given is None else given


@dataclass(frozen=True, eq=False)
class Alternative:
    """A plan with its words, and how much of its path it shares with another.

    Examples
    --------
    >>> probability = np.zeros((5, 7))
    >>> probability[1:4, 1:6] = 1.0
    >>> rooms = hn.RoomLabels(("west", "east"), np.tile([0, 0, 0, 1, 1, 1, 1], (5, 1)))
    >>> grid = hn.OccupancyGrid(probability, robot_radius_m=0)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    >>> found = hn.plan_alternatives(hn.HybridPlanner(topology), (0.5, 2.5), (6.5, 2.5), 3)
    >>> [(other.doors, round(other.path.length_m, 2)) for other in found]
    [((1,), 8.16), ((2,), 8.16)]
    """

    tour: Tour
    """The plan. Its lower bound holds for every path between its endpoints, not only for those by
    the same doors: the gap states by how much the alternative can be longer than the optimum."""
    overlap: float = 0.0
    """Share of its length, or of its cost with a planner by costs, in common with one before it,
    the greatest one; 0 for the first."""
    word: tuple[int, ...] | None = None
    """Reduced word of its homotopy class, by homotopy; None by doors."""

    @property
    def result(self) -> PlanResult:
        """The result of the plan."""
        return self.tour.results[0]

    @property
    def path(self) -> Path:
        """The path."""
        path = self.result.path
        assert path is not None  # noqa: S101 - alternatives are solved
        return path

    @property
    def doors(self) -> tuple[int, ...]:
        """Numbers of the doors passed, in order."""
        return tuple(leg.door.number for leg in self.tour.legs if leg.door is not None)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for strict JSON: those of the tour, `doors`, `overlap` and `word`."""
        word = None if self.word is None else list(self.word)
        doors = {"doors": list(self.doors), "overlap": self.overlap, "word": word}
        return self.tour.to_dict() | doors


@dataclass(frozen=True, eq=False)
class Alternatives(Sequence[Alternative]):
    """Alternatives of one query, and whether they are all.

    Examples
    --------
    >>> probability = np.zeros((5, 5))
    >>> probability[1:4, 1:4] = 1.0
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(probability, robot_radius_m=0))
    >>> planner = hn.HybridPlanner(hn.TopologicalMap(pyramid))
    >>> found = hn.plan_alternatives(planner, (0.5, 0.5), (4.5, 4.5), 3, by="homotopy")
    >>> len(found), found.complete
    (2, True)
    """

    found: tuple[Alternative, ...]
    """The alternatives; none if no path exists."""
    complete: bool
    """Whether these are as many as requested, or all: by homotopy all classes, by doors all
    candidates within the limits, which are not all sequences of doors. False if the search stopped
    before."""
    note: str = ""
    """The reason why there are fewer than requested, one line; empty if there are not."""

    @overload
    def __getitem__(self, index: int) -> Alternative: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Alternative, ...]: ...

    def __getitem__(self, index: int | slice) -> Alternative | tuple[Alternative, ...]:
        """Return one alternative, or some."""
        return self.found[index]

    def __len__(self) -> int:
        """Return the number of alternatives found."""
        return len(self.found)


def unplanned(status: str) -> Alternatives:
    """Return the alternatives of a query without a path."""
    return Alternatives((), complete=True, note=f"no path was planned: {status}")


def plan_alternatives(  # noqa: PLR0913 - all but four have defaults
    planner: HybridPlanner,
    start: ArrayLike | str,
    goal: ArrayLike | str,
    count: int,
    *,
    by: By = "doors",
    max_overlap: float | None = None,
    max_stretch: float | None = None,
    inside_rooms: bool = False,
    at: At = "anywhere",
    blocked: Closable | None = None,
    least_hole_m2: float | None = None,
    most_states: int | None = None,
    time_limit_s: float | None = None,
) -> Alternatives:
    """Plan paths between the same two points that differ for people.

    By doors, two paths differ by the sequence of doors that they pass. The first is the plain plan.
    Then sequences are tried in the order of their length on the graph of doors, which measures the
    paths inside rooms: for each pair of doors of a room, the shortest sequence that passes both in
    turn, unless it passes a room twice. Each that keeps to the limits is planned by the preset of
    the planner while the doors that lead off it are closed, by the cells along one side of each,
    and the path has to keep to the limits too. At most four sequences for each requested
    alternative are planned.

    With a planner by costs the cheapest paths take the place of the shortest: sequences are tried
    in the order of their cost, and overlap and stretch are measured in cost.

    By homotopy, two paths differ if they pass an obstacle on two sides. All are octile paths,
    whatever the preset: the first is a shortest one, the planner's own if that is octile and
    shortest, and each other is a shortest path of its class on the whole map. They have no limits.
    Winding paths are left out: after a circle round a hole they return to an earlier point, or
    within sight of it along a row or a column, nearer than the side of a square hole of the least
    area (at least one cell, at most 1 m and half the shortest path).

    Parameters
    ----------
    planner
        Planner of all paths; by homotopy not with OMPL.
    start, goal
        Points `(x, y)` in metres, or names as in `HybridPlanner.plan`. All alternatives have the
        endpoints of the plain plan.
    count
        Most alternatives, the first included, from 1 to 20.
    by
        `"doors"`, for people, on a map with rooms; or `"homotopy"`, exact.
    max_overlap
        Greatest share of its length, or of its cost, from 0 to 1, that an alternative by doors has
        in common with a shorter one: what lies within a robot's diameter (at least a cell) of the
        other path, and all between the same two doors of one room. None is 0.8.
    max_stretch
        Greatest length, or cost, of an alternative by doors over that of the first, at least 1.
        None is 2.
    inside_rooms
        Whether paths by the same doors count as alternatives too if they pass an obstacle inside a
        room on two sides. Then only what lies near the other path is in common. Not with OMPL.
    at
        Position in a named room, as in `HybridPlanner.plan`.
    blocked
        Closures for this query, as in `HybridPlanner.plan`. They make no holes: paths on both sides
        of a closed area are of one class if nothing else lies between them.
    least_hole_m2
        By homotopy and inside rooms, holes of a smaller area do not count: obstacles and, unless
        they may be entered, unexplored islands, with all that they surround, in square metres.
        None is 1.
    most_states
        By homotopy and inside rooms, pairs of a cell and a class that are looked at before the
        search stops, from 1 to 2^26; more take more time and memory. None is a million.
    time_limit_s
        By homotopy and inside rooms, seconds before the search stops; inside rooms, for all
        sequences of doors together. None is 10.

    Returns
    -------
    Alternatives
        The first, then the others by length, or by cost; none if no path exists. If there are
        fewer than requested, its `note` states the reason.

    Raises
    ------
    InvalidValueError
        When an option is out of range or changes nothing by doors, or by homotopy, an end is not
        valid, a closed item is not on the map, or, by homotopy and inside rooms, the planner plans
        by costs, it refines with OMPL, or its grid allows corner cutting.

    Examples
    --------
    >>> probability = np.zeros((5, 5))
    >>> probability[1:4, 1:4] = 1.0
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(probability, robot_radius_m=0))
    >>> planner = hn.HybridPlanner(hn.TopologicalMap(pyramid), preset="octile")
    >>> found = hn.plan_alternatives(planner, (0.5, 0.5), (4.5, 4.5), 3, by="homotopy")
    >>> [other.path.length_m for other in found]
    [8.0, 8.0]
    """
    options = {
        "max_overlap": max_overlap,
        "max_stretch": max_stretch,
        "inside_rooms": inside_rooms or None,
        "least_hole_m2": least_hole_m2,
        "most_states": most_states,
        "time_limit_s": time_limit_s,
    }
    check_used(by, {name: value for name, value in options.items() if value is not None})
    needs_classes = by == "homotopy" or inside_rooms
    if planner.costs is not None and needs_classes:
        raise InvalidValueError(
            "homotopy classes are searched for their shortest paths, and this planner plans by "
            'costs: take by="doors" without inside_rooms, or a planner without costs'
        )
    limits = limits_of(count, max_overlap, max_stretch)
    closed = planner.closed(blocked)
    waypoints = [start, goal]
    classes: Classes | None = None
    if needs_classes:
        homotopy = extension("methods", "homotopy")
        effort = homotopy.effort_of(least_hole_m2, most_states, time_limit_s)
        classes = homotopy.ClassTours(planner, waypoints, closed, effort)
    first = plan_tour(planner, waypoints, at=at, blocked=closed)
    if not first.solved:
        return unplanned(first.status)
    if classes is not None and by == "homotopy":
        return _by_homotopy(classes, first, limits)
    search = None
    if planner.topology.pyramid.rooms is not None:
        search = DoorTours(planner, first, waypoints, planner.closed_for_all(closed))
    return _by_doors(search, classes, first, limits, by_costs=planner.costs is not None)


class Classes(Protocol):
    """The search for tours of other homotopy classes than a first one."""

    stopped: str
    """Description of the limit at which the search stopped, empty if it did not."""

    def find(self, first: Tour, count: int) -> list[tuple[Tour, tuple[int, ...]]]:
        """Return tours of other classes with their words, the shortest first."""
        ...

    def inside(self, search: DoorTours, chosen: list[Chosen], limits: RouteLimits) -> list[Chosen]:
        """Return what was chosen by doors, and tours by other sides of obstacles inside rooms."""
        ...


def _by_homotopy(classes: Classes, first: Tour, limits: RouteLimits) -> Alternatives:
    """Return the alternatives by sides of obstacles."""
    tours = classes.find(first, limits.count)
    found = tuple(Alternative(tour, word=word) for tour, word in tours)
    note = classes.stopped or _fewer(
        len(found), limits, "no other path passes an obstacle on another side"
    )
    return Alternatives(found, complete=not classes.stopped, note=note)


def _by_doors(
    search: DoorTours | None,
    classes: Classes | None,
    first: Tour,
    limits: RouteLimits,
    *,
    by_costs: bool,
) -> Alternatives:
    """Return the alternatives by sequences of doors.

    Parameters
    ----------
    search
        The search for sequences of doors; None on a map without rooms.
    classes
        The search inside rooms; None for none.
    first
        The plain plan, solved.
    limits
        What they must keep to.
    by_costs
        Whether the planner plans by costs.
    """
    chosen = [Chosen(first)]
    if search is not None:
        chosen = search.find(limits)
        if classes is not None and len(chosen) < limits.count:
            chosen = classes.inside(search, chosen, limits)
    stopped = _stopped(search, classes) if len(chosen) < limits.count else ""
    found = tuple(Alternative(one.tour, one.overlap) for one in chosen)
    note = stopped or _fewer(len(found), limits, _reason(search, limits, by_costs=by_costs))
    return Alternatives(found, complete=not stopped, note=note)


def _stopped(search: DoorTours | None, classes: Classes | None) -> str:
    """Describe which search stopped before it had looked at everything."""
    if classes is not None and classes.stopped:
        return classes.stopped
    if search is not None and not search.is_complete:
        return f"the search stopped after {search.n_planned} sequences of doors: there may be more"
    return ""


def _fewer(count: int, limits: RouteLimits, reason: str) -> str:
    """Return the reason why there are fewer alternatives than requested, empty if there are not."""
    return "" if count >= limits.count else f"{count} of {limits.count}: {reason}"


def _reason(search: DoorTours | None, limits: RouteLimits, *, by_costs: bool) -> str:
    """Describe why there are no more alternatives by doors."""
    if search is None:
        return "the map has no rooms, so no doors; by homotopy, sides of obstacles count"
    if search.is_in_one_room:
        return "no door lies between start and goal; by homotopy, sides of obstacles count"
    better, worse = ("cheaper", "dear") if by_costs else ("shorter", "long")
    return (
        "no other candidate sequence of doors shares at most "
        f"{limits.max_overlap:.0%} with a {better} one and is at most {limits.max_stretch:g} times "
        f"as {worse} as the first"
    )
