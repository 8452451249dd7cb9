"""Alternatives: paths between two points that pass other doors."""

import math
from dataclasses import dataclass
from numbers import Real
from typing import Any

from numpy.typing import ArrayLike

from hybridnav.closures.blocked import Closable
from hybridnav.errors import InvalidValueError
from hybridnav.guide.by_doors import Chosen, DoorTours, RouteLimits
from hybridnav.guide.tour import Ranked, Tour, plan_tour
from hybridnav.maps.checks import checked_whole
from hybridnav.planning import Path, PlanResult
from hybridnav.planning.named import At
from hybridnav.planning.planner import HybridPlanner

MOST = 20
"""Most alternatives of one query."""
_MAX_OVERLAP, _MAX_STRETCH = 0.8, 2.0


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
        _MAX_OVERLAP if max_overlap is None else max_overlap,
        _MAX_STRETCH if max_stretch is None else max_stretch,
    )


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
    the same doors. The gap states by how much the alternative can be longer than the optimum."""
    overlap: float = 0.0
    """Share of its length, or of its cost with a planner by costs, in common with one before it,
    the greatest one; 0 for the first."""

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
        """Return plain values for strict JSON: those of the tour, `doors` and `overlap`."""
        return self.tour.to_dict() | {"doors": list(self.doors), "overlap": self.overlap}


class Alternatives(Ranked[Alternative]):
    """Alternatives of one query, a sequence: none if no path exists.

    `complete` states whether these are as many as requested, or all candidates within the limits,
    which are not all sequences of doors; `note` why there are fewer.

    Examples
    --------
    >>> probability = np.zeros((5, 5))
    >>> probability[1:4, 1:4] = 1.0
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(probability, robot_radius_m=0))
    >>> planner = hn.HybridPlanner(hn.TopologicalMap(pyramid))
    >>> found = hn.plan_alternatives(planner, (0.5, 0.5), (4.5, 4.5), 3)
    >>> len(found), found.complete
    (1, True)
    >>> found.note
    '1 of 3: the map has no rooms, so no doors'
    """


def unplanned(status: str) -> Alternatives:
    """Return the alternatives of a query without a path."""
    return Alternatives((), complete=True, note=f"no path was planned: {status}")


def plan_alternatives(  # noqa: PLR0913 - all but four have defaults
    planner: HybridPlanner,
    start: ArrayLike | str,
    goal: ArrayLike | str,
    count: int,
    *,
    max_overlap: float | None = None,
    max_stretch: float | None = None,
    at: At = "anywhere",
    blocked: Closable | None = None,
) -> Alternatives:
    """Plan paths between the same two points that pass other sequences of doors.

    The first is the plain plan. Then sequences are tried in the order of their length on the graph
    of doors, which measures the paths inside rooms. For each pair of doors of a room that is the
    shortest sequence that passes both in turn, unless it passes a room twice. Sequences within the
    limits are planned by the preset of the planner while the doors that lead off them are closed,
    by the cells along one side of each. The path has to keep to the limits too. At most four
    sequences for each requested alternative are planned.

    With a planner by costs the cheapest paths take the place of the shortest. Sequences are tried
    in the order of their cost, and overlap and stretch are measured in cost.

    Parameters
    ----------
    planner
        Planner of all paths, on a map with rooms.
    start, goal
        Points `(x, y)` in metres, or names as in `HybridPlanner.plan`. All alternatives have the
        endpoints of the plain plan.
    count
        Most alternatives, the first included, from 1 to 20.
    max_overlap
        Greatest share of its length, or of its cost, from 0 to 1, that an alternative has in common
        with a shorter one. Parts within a robot's diameter (at least a cell) of the other path
        count, and all between the same two doors of one room. None is 0.8.
    max_stretch
        Greatest length, or cost, of an alternative over that of the first, at least 1. None is 2.
    at
        Position in a named room, as in `HybridPlanner.plan`.
    blocked
        Closures for this query, as in `HybridPlanner.plan`.

    Returns
    -------
    Alternatives
        The first, then the others by length, or by cost; none if no path exists. If there are
        fewer than requested, its `note` states the reason.

    Raises
    ------
    InvalidValueError
        When an option is out of range, an end is not valid, or a closed item is not on the map.

    Examples
    --------
    >>> probability = np.zeros((5, 7))
    >>> probability[1:4, 1:6] = 1.0
    >>> rooms = hn.RoomLabels(("west", "east"), np.tile([0, 0, 0, 1, 1, 1, 1], (5, 1)))
    >>> grid = hn.OccupancyGrid(probability, robot_radius_m=0)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=rooms))
    >>> planner = hn.HybridPlanner(topology, preset="octile")
    >>> found = hn.plan_alternatives(planner, (0.5, 2.5), (6.5, 2.5), 3)
    >>> [round(other.path.length_m, 2) for other in found]
    [10.0, 10.0]
    """
    limits = limits_of(count, max_overlap, max_stretch)
    waypoints = [start, goal]
    first = plan_tour(planner, waypoints, at=at, blocked=blocked)
    if not first.solved:
        return unplanned(first.status)
    search = None
    if planner.topology.has_rooms:
        closed = planner.closed_for_all(planner.closed(blocked, waypoints))
        search = DoorTours(planner, first, waypoints, closed)
    return _by_doors(search, first, limits, by_costs=planner.costs is not None)


def _by_doors(
    search: DoorTours | None, first: Tour, limits: RouteLimits, *, by_costs: bool
) -> Alternatives:
    """Return the alternatives by sequences of doors.

    `search`: the search for sequences of doors; None on a map without rooms; `first`: the plain
    plan, solved; `limits`: what they must keep to; `by_costs`: whether the planner plans by costs.
    """
    chosen = [Chosen(first)] if search is None else search.find(limits)
    alternatives = tuple(Alternative(one.tour, one.overlap) for one in chosen)
    if len(alternatives) == limits.count:
        return Alternatives(alternatives, complete=True)
    if search is not None and not search.is_complete:
        n_planned = search.n_planned
        note = f"the search stopped after {n_planned} sequences of doors: there may be more"
        return Alternatives(alternatives, complete=False, note=note)
    reason = _reason(search, limits, by_costs=by_costs)
    note = f"{len(alternatives)} of {limits.count}: {reason}"
    return Alternatives(alternatives, complete=True, note=note)


def _reason(search: DoorTours | None, limits: RouteLimits, *, by_costs: bool) -> str:
    if search is None:
        return "the map has no rooms, so no doors"
    if search.is_in_one_room:
        return "no door lies between start and goal"
    better, worse = ("cheaper", "dear") if by_costs else ("shorter", "long")
    return (
        "no other candidate sequence of doors shares at most "
        f"{limits.max_overlap:.0%} with a {better} one and is at most {limits.max_stretch:g} times "
        f"as {worse} as the first"
    )
