"""Plans over floors: the plans on each floor, and the rides between them."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Self

from hybridnav.errors import PlanError
from hybridnav.planner import PlanStats, PlanStatus
from hybridnav.planner.guide import sentences

if TYPE_CHECKING:
    from collections.abc import Sequence

    from hybridnav.ext.fleet.links import Link
    from hybridnav.planner import Metric, PlanResult
    from hybridnav.planner.guide import Instruction
    from hybridnav.planner.result import InstructionSource

COUNTS = ("expanded", "expanded_places", "expanded_border_cells", "expanded_intervals")
"""The counts of `PlanStats` that add up."""


@dataclass(frozen=True)
class Ride:
    """One use of a link, from the floor where it is entered to the one where it is left.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Link, LinkEnd, Ride
    >>> ends = LinkEnd("1", (0.0, 4.0)), LinkEnd("2", (0.5, 4.0))
    >>> lift = Link(name="west lift", kind="lift", ends=ends, wait_s=20, ride_s=5)
    >>> Ride(lift, "1", "2", charge_m=12.5).seconds
    25.0
    """

    link: Link
    from_floor: str
    to_floor: str
    charge_m: float
    """What it costs, in metres."""

    @property
    def seconds(self) -> float:
        """Seconds of the wait and of the ride."""
        return self.link.seconds(self.from_floor, self.to_floor)

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for JSON."""
        return {
            "link": self.link.name,
            "kind": self.link.kind,
            "from_floor": self.from_floor,
            "to_floor": self.to_floor,
            "seconds": self.seconds,
            "charge_m": self.charge_m,
        }


@dataclass(frozen=True, eq=False)
class BuildingPlan:
    """Outcome of one query over floors; made by `Building.plan`.

    `results[i]` is the plan on `floors[i]`, and `rides[i]` leads from it to the next one. Without a
    route there are none.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor, Link, LinkEnd
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> floors = [Floor(name, hn.HybridPlanner(topology)) for name in ("1", "2")]
    >>> ends = LinkEnd("1", (0.5, 0.5)), LinkEnd("2", (0.5, 0.5))
    >>> building = Building(floors, [Link(name="lift", kind="lift", ends=ends)])
    >>> plan = building.plan(("1", (0.5, 0.5)), ("2", (2.0, 2.5)))
    >>> plan.floors, len(plan.rides), plan.gap
    (('1', '2'), 1, 0.0)
    """

    status: PlanStatus
    metric: Metric
    start: tuple[str, tuple[float, ...] | str]
    """Floor of the start, and `(x, y)` in metres in its frame, or the name that was given."""
    goal: tuple[str, tuple[float, ...] | str]
    """Floor of the goal, and its point or name."""
    results: tuple[PlanResult, ...] = ()
    """The plan on each floor that is visited, in order; one more than there are rides."""
    floors: tuple[str, ...] = ()
    """Name of the floor of each of them."""
    rides: tuple[Ride, ...] = ()
    lower_bound: float = math.inf
    """A proved bound on the costs of all routes by all links that may be used, in metres; infinite
    where it is proved that there is none."""
    speed_m_s: float = 0.5
    """Metres per second that the robot drives."""
    stats: PlanStats = field(default_factory=PlanStats)
    """Effort of the query, with that for plans which are not on the route."""
    instruction_source: InstructionSource | tuple[Instruction, ...] = field(default=(), repr=False)
    """The instructions, or the data to find them from."""

    @cached_property
    def instructions(self) -> tuple[Instruction, ...]:
        """What a person does along the route; none without a route, and if no floor has rooms."""
        source = self.instruction_source
        return source if isinstance(source, tuple) else source.instructions()

    def __getstate__(self) -> dict[str, Any]:
        """Return the state with what is found on demand, so that copies hold no map."""
        state = {name: value for name, value in vars(self).items() if name != "instructions"}
        return state | {"instruction_source": self.instructions}

    @property
    def solved(self) -> bool:
        """Whether there is a route."""
        return self.status is PlanStatus.SOLVED

    @property
    def length_m(self) -> float:
        """Metres driven on all floors, infinite unless it is solved."""
        if not self.solved:
            return math.inf
        return sum(result.path.length_m for result in self.results if result.path is not None)

    @property
    def charge_m(self) -> float:
        """What all rides cost, in metres."""
        return sum(ride.charge_m for ride in self.rides)

    @property
    def cost(self) -> float:
        """Costs of the plans on all floors and of the rides, metres; infinite without a route."""
        if not self.solved:
            return math.inf
        return cost_of(self.results, self.rides)

    @property
    def gap(self) -> float:
        """Proved distance from the optimum, cost / lower bound - 1; NaN without a route."""
        if not self.solved:
            return math.nan
        return self.cost / self.lower_bound - 1 if self.lower_bound > 0 else 0.0

    @property
    def travel_s(self) -> float:
        """Seconds of the route: its length at `speed_m_s`, and the waits and rides."""
        return self.length_m / self.speed_m_s + sum(ride.seconds for ride in self.rides)

    def words(self, language: str = "en") -> list[str]:
        """Return a description of the route for a person, one sentence a line.

        Parameters
        ----------
        language
            Code of a language, one of `hybridnav.planner.guide.languages`.

        Returns
        -------
        list of str
            No lines without a route; rides alone where floors have no rooms.

        Raises
        ------
        InvalidValueError
            When there are no sentences in this language.
        """
        return sentences(self.instructions, language)

    def raise_for_status(self) -> Self:
        """Return the plan itself if it is solved.

        Raises
        ------
        PlanError
            When it is not; the text names the status.
        """
        if not self.solved:
            raise PlanError(f"no route over floors was planned: {self.status}")
        return self

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for strict JSON.

        Infinite or missing values are None. `results` has those of `PlanResult.to_dict` for each
        floor, and the floor.
        """
        known = self.solved
        return {
            "status": str(self.status),
            "metric": self.metric,
            "start": _plain(self.start),
            "goal": _plain(self.goal),
            "length_m": self.length_m if known else None,
            "charge_m": self.charge_m if known else None,
            "cost": self.cost if known else None,
            "lower_bound": self.lower_bound if known else None,
            "gap": self.gap if known else None,
            "travel_s": self.travel_s if known else None,
            "floors": list(self.floors),
            "rides": [ride.to_dict() for ride in self.rides],
            "results": [
                {"floor": floor} | result.to_dict()
                for floor, result in zip(self.floors, self.results, strict=True)
            ],
            **{name: getattr(self.stats, name) for name in COUNTS},
            "seconds": {stage: round(s, 6) for stage, s in self.stats.seconds.items()},
            "instructions": [instruction.to_dict() for instruction in self.instructions],
            "words": self.words(),
        }


def _plain(end: tuple[str, tuple[float, ...] | str]) -> list[Any]:
    floor, waypoint = end
    return [floor, waypoint if isinstance(waypoint, str) else list(waypoint)]


def cost_of(results: Sequence[PlanResult], rides: Sequence[Ride]) -> float:
    """Return the cost of a route in metres, summed from its start to its goal."""
    cost = results[0].cost
    for ride, result in zip(rides, results[1:], strict=True):
        cost += ride.charge_m
        cost += result.cost
    return cost


def stats_of(planned: list[PlanStats], seconds: float) -> PlanStats:
    """Return the effort of a query.

    Parameters
    ----------
    planned
        The effort of each plan that was made for it.
    seconds
        Wall-clock seconds of all; what the stages of the plans leave is called `links`.
    """
    stages: dict[str, float] = {}
    for stats in planned:
        for stage, spent in stats.seconds.items():
            stages[stage] = stages.get(stage, 0.0) + spent
    stages["links"] = max(seconds - sum(stages.values()), 0.0)
    sums = {name: sum(getattr(stats, name) for stats in planned) for name in COUNTS}
    return PlanStats(**sums, seconds=stages)
