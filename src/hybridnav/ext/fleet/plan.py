"""Plans over floors, from the routes that a search has chosen. Public: `BuildingAlternatives`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

from typing_extensions import Self

from hybridnav._base.copies import Source, made, made_state
from hybridnav.errors import PlanError
from hybridnav.ext.fleet.links import Ride
from hybridnav.guide.tour import Ranked
from hybridnav.guide.words import FloorChange, Instruction, Space, sentences
from hybridnav.guide.words.itinerary import Guide, heading_of
from hybridnav.planning import Metric, Path, PlanResult, PlanStats, PlanStatus

COUNTS = ("expanded", "expanded_places", "expanded_intervals")
"""The counts of `PlanStats` that add up."""


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
    instructions_source: Source[tuple[Instruction, ...]] = field(default=(), repr=False)
    """The instructions, or how to find them."""
    profile: str | None = None
    """Name of the profile that it was planned under; None for none."""
    note: str = ""
    """The reason, one line, where the profile leaves no route."""
    reasons: Mapping[str, tuple[str, ...]] = field(default_factory=dict, repr=False)
    """Why there is no route, in sentences, by the code of the language; none with a route."""

    to_open: tuple[str, ...] = ()
    """What would have to open for a route, all of it, as `link lift` and `floor 2, door 4`; none
    with a route, and where opening does not help."""

    @cached_property
    def instructions(self) -> tuple[Instruction, ...]:
        """Instructions for a person; none without a route, and if no floor has rooms."""
        return made(self.instructions_source)

    def __getstate__(self) -> dict[str, Any]:
        """Return the state with what is found on demand, so that copies hold no map."""
        return made_state(self)

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
            Code of a language, one of `hybridnav.guide.words.languages`.

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
            why = " ".join(self.reasons.get("en", ()))
            raise PlanError(f"no route over floors was planned: {self.status}. {why}".strip(". "))
        return self

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for strict JSON.

        Infinite or missing values are None. `results` has those of `PlanResult.to_dict` for each
        floor, and the floor.
        """
        solved = self.solved
        return {
            "status": str(self.status),
            "metric": self.metric,
            "start": _plain(self.start),
            "goal": _plain(self.goal),
            "length_m": self.length_m if solved else None,
            "charge_m": self.charge_m if solved else None,
            "cost": self.cost if solved else None,
            "lower_bound": self.lower_bound if solved else None,
            "gap": self.gap if solved else None,
            "travel_s": self.travel_s if solved else None,
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
            "why": None
            if solved
            else {"words": list(self.reasons.get("en", ())), "to_open": list(self.to_open)},
            **({} if self.profile is None else {"profile": self.profile, "note": self.note}),
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


# Instructions for a person on a route over floors.


@dataclass(frozen=True, eq=False)
class GuidedRoute:
    """A route over floors whose instructions are found when somebody reads them."""

    guides: Sequence[Guide | None]
    """The source of descriptions on each floor that is visited; None on one without rooms."""
    results: Sequence[PlanResult]
    rides: Sequence[Ride]
    goal: str
    """What words call the goal."""

    def __call__(self) -> tuple[Instruction, ...]:
        """Find the instructions; none if no floor has rooms."""
        if all(guide is None for guide in self.guides):
            return ()
        told: list[Instruction] = []
        driven_m = 0.0
        for number, (guide, result) in enumerate(zip(self.guides, self.results, strict=True)):
            path, ride = result.path, self.rides[number] if number < len(self.rides) else None
            assert path is not None  # noqa: S101 - a route is solved
            before = self.rides[number - 1] if number else None
            here = self._on_floor(guide, path, before, heading_of(result.start))
            here = [replace(one, at_m=one.at_m + driven_m) for one in here]
            if before is not None and here[0].kind == "start" and len(here) > 1:
                here = self._joined(told, here)
            if ride is not None:
                change = self._change(ride, self.guides[number + 1])
                last = replace(here[-1], waypoint=None, landmark=None)
                here[-1] = replace(last, kind="ride", change=change)
            told += here
            driven_m += path.length_m
        return tuple(told)

    def _joined(self, told: list[Instruction], here: list[Instruction]) -> list[Instruction]:
        """Return the instructions on a floor behind a ride, the last one of `told`.

        The turn of the first step belongs to the sentence of the ride, and a start that shows no
        direction needs none.
        """
        change, start = told[-1].change, here[0]
        if change is not None and change.has_exit:
            told[-1] = replace(told[-1], turn=start.turn)
            return here[1:]
        is_needed = start.landmark is not None or start.heading_rad is not None
        return here if is_needed else here[1:]

    def _change(self, ride: Ride, guide: Guide | None) -> FloorChange:
        """Return what words say of a ride; `guide` is that of the floor where it ends."""
        end = ride.link.end_on(ride.to_floor)
        has_exit = guide is not None and end is not None and end.yaw_rad is not None
        return FloorChange(ride.link.name, ride.link.kind, ride.to_floor, has_exit=has_exit)

    def _on_floor(
        self, guide: Guide | None, path: Path, before: Ride | None, heading_rad: float | None
    ) -> list[Instruction]:
        """Return the instructions on one floor, from a start to an arrival."""
        if guide is None:
            x, y = path.points[-1].tolist()
            storey = Space(None, "storey")
            length_m = path.length_m
            return [Instruction("arrive", (x, y), length_m, length_m, storey, waypoint=self.goal)]
        if before is not None:
            end = before.link.end_on(before.to_floor)
            heading_rad = None if end is None else end.yaw_rad
        legs = guide.legs(path, waypoint=self.goal)
        return list(guide.instructions([path], [legs], heading_rad=heading_rad))


# Routes over floors by different links, and whether there may be more.


class BuildingAlternatives(Ranked[BuildingPlan]):
    """The routes that `Building.alternatives` has found, the cheapest first: a sequence of plans.

    One that is not solved if there is no route. `complete` and `note` are as in `Alternatives`.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Building, Floor
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> house = Building([Floor("1", hn.HybridPlanner(topology))])
    >>> found = house.alternatives(("1", (0.5, 0.5)), ("1", (2.0, 2.5)), 2)
    >>> len(found), found[0].solved, found.complete
    (1, True, True)
    """

    def told(self, facts: dict[str, Any]) -> BuildingAlternatives:
        """Return the same, with more fields of each plan."""
        plans = tuple(replace(plan, **facts) for plan in self)
        return BuildingAlternatives(plans, self.complete, self.note)

    @classmethod
    def of(
        cls, plans: tuple[BuildingPlan, ...], limits: tuple[int, float], *, complete: bool
    ) -> BuildingAlternatives:
        """Return the alternatives of a query, with the reason why there are no more.

        Parameters
        ----------
        plans
            The plans.
        limits
            Most routes, and cost of one over that of the first, at most.
        complete
            Whether the search has looked at all sequences of links that keep to the limits.
        """
        count, stretch = limits
        if not plans[0].solved:
            return cls(plans, complete=True, note=f"no route was planned: {plans[0].status}")
        if len(plans) >= count:
            return cls(plans, complete=True)
        if not complete:
            note = f"the search stopped after {len(plans)} of {count} routes: there may be more"
            return cls(plans, complete=False, note=note)
        reason = f"no other sequence of links is at most {stretch:g} times as dear as the first"
        return cls(plans, complete=True, note=f"{len(plans)} of {count}: {reason}")
