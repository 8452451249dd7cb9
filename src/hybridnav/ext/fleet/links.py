"""Links between floors: lifts, stairs and ramps, their ends, and the cheapest ways over rides."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps.names import place_of_name

LinkKind = Literal["lift", "stairs", "ramp"]
"""Kinds of links between floors."""
Direction = Literal["up", "down"]
DIRECTIONS: tuple[Direction, ...] = get_args(Direction)
"""Towards later ends of a link, and towards earlier ones."""


@dataclass(frozen=True)
class LinkEnd:
    """A point of a floor where robots enter and leave a link.

    Raises
    ------
    InvalidValueError
        When the position is not two finite numbers, or the direction is not finite.

    Examples
    --------
    >>> from hybridnav.ext.fleet import LinkEnd
    >>> LinkEnd("3", (1.5, 2.0)).floor
    '3'
    """

    floor: str
    position_m: tuple[float, float]
    """`(x, y)` in metres, in the frame of the floor."""
    yaw_rad: float | None = None
    """Direction in which one leaves the link here, radians counter-clockwise from the x axis of
    the floor's frame: words then name the first turn. None if it is not known."""

    def __post_init__(self) -> None:
        """Refuse positions and directions that are not numbers."""
        x, y = self.position_m
        if self.yaw_rad is not None and not math.isfinite(self.yaw_rad):
            raise InvalidValueError(
                f"an end of a link on floor {self.floor} has the direction {self.yaw_rad!r:.40}, "
                "expected a finite number of radians, or None"
            )
        if not (math.isfinite(x) and math.isfinite(y)):
            raise InvalidValueError(
                f"an end of a link on floor {self.floor} lies at {self.position_m!r:.60}, expected "
                "two finite numbers of metres"
            )


@dataclass(frozen=True, kw_only=True)
class Link:
    """A lift, stairs or a ramp. It leads from any of its ends to any other, or one way only.

    A ride costs `wait_s`, and from one end to the next one `ride_s`, in seconds, and `cost_m` in
    metres on top: a planner charges `cost_m + speed * seconds`.

    Raises
    ------
    InvalidValueError
        When the kind or the direction is not known, or there are not two ends on different floors.
        When a time or the cost is negative or not finite, or the greatest radius is not above 0.

    Examples
    --------
    >>> from hybridnav.ext.fleet import Link, LinkEnd
    >>> ends = LinkEnd("1", (0.0, 4.0)), LinkEnd("2", (0.5, 4.0)), LinkEnd("3", (0.0, 4.0))
    >>> lift = Link(name="west lift", kind="lift", ends=ends, wait_s=20, ride_s=5)
    >>> lift.seconds("1", "3"), lift.charge_m("1", "3", speed_m_s=0.5)
    (30.0, 15.0)
    """

    name: str
    """Name, unlike those of other links of the building."""
    kind: LinkKind
    """Its kind: robots that climb no stairs are kept from stairs."""
    ends: tuple[LinkEnd, ...]
    """Two or more, on different floors, from the lowest to the highest."""
    wait_s: float = 0.0
    """Seconds until it can be entered, on average."""
    ride_s: float = 0.0
    """Seconds from one end to the next."""
    cost_m: float = 0.0
    """Metres that a ride is charged beside its time."""
    max_radius_m: float = math.inf
    """Radius in metres of the largest robot that fits in."""
    one_way: Direction | None = None
    """`"up"` leads to later ends alone, as an escalator, `"down"` to earlier ones; None to all."""

    def __post_init__(self) -> None:
        """Refuse what no planner could use."""
        if self.kind not in get_args(LinkKind):
            kinds = ", ".join(get_args(LinkKind))
            raise InvalidValueError(
                f"link {self.name} is of kind {self.kind!r:.40}, not one of {kinds}"
            )
        if self.one_way not in (None, *DIRECTIONS):
            raise InvalidValueError(
                f"link {self.name}: one_way is {self.one_way!r:.40}, expected up, down, or None "
                "for both ways"
            )
        floors = [end.floor for end in self.ends]
        if len(floors) <= 1 or len(set(floors)) < len(floors):
            raise InvalidValueError(
                f"link {self.name} has ends on {', '.join(floors) or 'no floor'}, expected two or "
                "more different floors"
            )
        for field in ("wait_s", "ride_s", "cost_m"):
            value = getattr(self, field)
            if not (math.isfinite(value) and value >= 0):
                raise InvalidValueError(
                    f"link {self.name}: {field} is {value}, expected a finite number >= 0"
                )
        if not self.max_radius_m > 0:
            raise InvalidValueError(
                f"link {self.name}: max_radius_m is {self.max_radius_m}, expected more than 0"
            )

    def admits(self, robot_radius_m: float, *, stairs: bool = True) -> bool:
        """Return whether a robot may use it.

        Parameters
        ----------
        robot_radius_m
            Radius of the robot in metres.
        stairs
            Whether the robot takes stairs.
        """
        return robot_radius_m <= self.max_radius_m and (stairs or self.kind != "stairs")

    @property
    def label(self) -> str:
        """Its name, with an arrow where it leads one way: `escalator ↑`."""
        return self.name + {None: "", "up": " ↑", "down": " ↓"}[self.one_way]

    def leads(self, from_floor: str, to_floor: str) -> bool:
        """Return whether one may ride from one floor that it stops at to another.

        Parameters
        ----------
        from_floor, to_floor
            Names of the floors.
        """
        floors = [end.floor for end in self.ends if end.floor in (from_floor, to_floor)]
        backward = "down" if floors == [from_floor, to_floor] else "up"
        return self.one_way != backward

    def end_on(self, floor: str) -> LinkEnd | None:
        """Return the end on a floor, None if it does not stop there.

        Parameters
        ----------
        floor
            Name of the floor.
        """
        return next((end for end in self.ends if end.floor == floor), None)

    def seconds(self, from_floor: str, to_floor: str) -> float:
        """Return the seconds of a ride with the wait before it.

        Parameters
        ----------
        from_floor, to_floor
            Names of floors that it stops at.

        Raises
        ------
        InvalidValueError
            When it does not stop at one of them.
        """
        floors = [end.floor for end in self.ends]
        for floor in (from_floor, to_floor):
            if floor not in floors:
                raise InvalidValueError(
                    f"link {self.name} does not stop on floor {floor!s:.80}: it stops on "
                    f"{', '.join(floors)}"
                )
        rides = abs(floors.index(from_floor) - floors.index(to_floor))
        return float(self.wait_s + self.ride_s * rides)

    def charge_m(self, from_floor: str, to_floor: str, *, speed_m_s: float) -> float:
        """Return the charge of a ride in metres.

        Parameters
        ----------
        from_floor, to_floor
            Names of floors that it stops at.
        speed_m_s
            Metres per second that the robot drives: seconds are worth so many metres.

        Raises
        ------
        InvalidValueError
            When it does not stop at one of the floors.
        """
        return self.cost_m + speed_m_s * self.seconds(from_floor, to_floor)


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
    """Its charge, in metres."""

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


class ClosedLink(NamedTuple):
    """A link that is out of order, on one floor or on all, or but for one direction."""

    link: str
    """Name of the link."""
    floor: str | None = None
    """Floor on which nobody enters or leaves it, None for all."""
    left: Direction | None = None
    """The direction that stays open, None for none."""

    @classmethod
    def of(cls, text: str, links: Sequence[Link]) -> ClosedLink:
        """Return what a text names: `north lift`, `north lift@2`, or `north lift=up`.

        Raises `InvalidValueError` when no link has this name, or stops there.
        """
        by_text = {link.name: cls(link.name) for link in links}
        if isinstance(text, str) and "@" in text:
            stops = [cls(link.name, end.floor) for link in links for end in link.ends]
            by_text = {f"{one.link}@{one.floor}": one for one in stops} | by_text
        if isinstance(text, str) and text.endswith(tuple(f"={way}" for way in DIRECTIONS)):
            ways = [cls(link.name, left=way) for link in links for way in DIRECTIONS]
            by_text = {f"{one.link}={one.left}": one for one in ways} | by_text
        return list(by_text.values())[place_of_name(text, tuple(by_text), "link")]


def left_by(link: Link, closed: Collection[ClosedLink]) -> Link | None:
    """Return what closures leave of a link on all its floors: it, its one direction, or None."""
    given = (link.one_way, *(one.left for one in closed if one.link == link.name))
    ways = {way for way in given if way is not None}
    if ClosedLink(link.name) in closed or len(ways) > 1:
        return None
    return replace(link, one_way=ways.pop()) if ways else link


# The ends of links, the rides between them, and the cheapest ways over them.

Part = tuple[int, int]
"""A path on one floor: from the start, or the end of a link, to an end, or the goal."""


class End(NamedTuple):
    """The end of a link in the network."""

    link: int
    """Index of the link."""
    floor: int
    """Index of the floor."""
    at: int
    """Its row in the table of the floor."""


@dataclass(frozen=True)
class Endpoint:
    """Start or goal of a query: the index of its floor, and a point or a name on it."""

    floor: int
    waypoint: ArrayLike | str


class ChosenParts(NamedTuple):
    """A route: its parts in order, between which rides lead."""

    cost: float
    """Costs of its parts, and charges of its rides, in metres."""
    parts: tuple[Part, ...]
    """Its paths on floors."""


START, GOAL = -1, -2
"""Where the first part of a route begins, and where its last one ends."""


class LinkNetwork:
    """The ends of the links of a building, and the rides between them.

    `links`: the links that may be used; `floor_of`: index of each floor, by its name; `rows`: row
    in its floor's table of each end, by link and floor; `speed_m_s`: metres per second, by which
    rides are charged; `closed`: ends that are left out. A ride past one takes as long as before.
    """

    def __init__(
        self,
        links: Sequence[Link],
        floor_of: dict[str, int],
        rows: dict[tuple[str, str], int],
        speed_m_s: float,
        closed: Collection[ClosedLink] = (),
    ) -> None:
        self.links = tuple(links)
        stops = [
            (number, end.floor)
            for number, link in enumerate(links)
            for end in link.ends
            if ClosedLink(link.name, end.floor) not in closed
        ]
        self.ends = [
            End(number, floor_of[floor], rows[links[number].name, floor]) for number, floor in stops
        ]
        self.on_floor: list[list[int]] = [[] for _ in floor_of]
        of_link: list[list[int]] = [[] for _ in links]
        for number, end in enumerate(self.ends):
            self.on_floor[end.floor].append(number)
            of_link[end.link].append(number)
        names = [floor for _, floor in stops]
        self.rides: list[list[tuple[int, float]]] = [
            [
                (other, link.charge_m(names[number], names[other], speed_m_s=speed_m_s))
                for other in of_link[end.link]
                if other != number and link.leads(names[number], names[other])
            ]
            for number, end in enumerate(self.ends)
            for link in (links[end.link],)
        ]
        legs = [(tail, head, charge) for tail, to in enumerate(self.rides) for head, charge in to]
        self._tails, self._heads = (
            np.array([leg[:2] for leg in legs], dtype=np.int64).reshape(-1, 2).T
        )
        self._charges = np.array([leg[2] for leg in legs], dtype=np.float64)
        self._on_floor = [np.array(ends, dtype=np.int64) for ends in self.on_floor]
        self._floor_of = np.array([end.floor for end in self.ends], dtype=np.int64)
        self._at = np.array([end.at for end in self.ends], dtype=np.int64)

    def cheapest(
        self, first: FloatArray, last: FloatArray, costs_on: Callable[[int], FloatArray]
    ) -> ChosenParts | None:
        """Return the cheapest route with at least one ride; None if there is none.

        `first`: float64 (n_ends,), the cost from the start to each end, infinite on other floors;
        `last`: float64 (n_ends,), that from each end to the goal; `costs_on`: returns the costs
        between the ends on a floor, float64, by their rows in its table.

        Notes
        -----
        All ends are relaxed at once, by turns over rides and over floors, until nothing is cheaper
        (R. Bellman: On a routing problem, 1958; L. Ford: Network flow theory, 1956). A turn costs
        the square of the ends on a floor, and there are as many as rides on a cheapest route.
        """
        reached, left = first.copy(), np.full(len(first), np.inf)
        came, rode = np.full((2, len(first)), START)
        fresh, least_charge = reached < np.inf, self._charges.min(initial=math.inf)
        while fresh.any():
            legs = np.flatnonzero(fresh[self._tails])
            arrived = reached[self._tails[legs]] + self._charges[legs]
            is_less = arrived < left[self._heads[legs]]
            legs, arrived = legs[is_less], arrived[is_less]
            np.minimum.at(left, self._heads[legs], arrived)
            is_least = arrived == left[self._heads[legs]]
            heads = self._heads[legs[is_least]]
            rode[heads] = self._tails[legs[is_least]]
            # A route that goes on by another ride costs a charge more at least.
            onward = np.unique(heads[left[heads] + least_charge <= (left + last).min()])
            fresh = self._walked(onward, left, costs_on, (reached, came))
        end = int((left + last).argmin()) if len(left) else START
        if end == START or not left[end] + last[end] < np.inf:
            return None
        return self._traced(end, (first, last), (came, rode), costs_on)

    def _walked(
        self,
        onward: LongArray,
        left: FloatArray,
        costs_on: Callable[[int], FloatArray],
        reached_by: tuple[FloatArray, LongArray],
    ) -> np.ndarray:
        """Relax the costs of all ends from those at which rides have ended.

        `onward`: int64 (k,), these ends; `left`: float64 (n_ends,), the cost at which each is left;
        `costs_on`: as in `cheapest`; `reached_by`: the cost at which each end is reached, and from
        which end; both are overwritten.
        """
        reached, came = reached_by
        fresh = np.zeros(len(reached), dtype=np.bool_)
        for floor in np.unique(self._floor_of[onward]).tolist():
            ends, rows = self._on_floor[floor], onward[self._floor_of[onward] == floor]
            sums = costs_on(floor)[np.ix_(self._at[rows], self._at[ends])] + left[rows, None]
            sums[rows[:, None] == ends] = np.inf
            best = sums.argmin(axis=0)
            least = sums[best, np.arange(len(ends))]
            is_less = least < reached[ends]
            reached[ends[is_less]] = least[is_less]
            came[ends[is_less]] = rows[best[is_less]]
            fresh[ends[is_less]] = True
        return fresh

    def _traced(
        self,
        end: int,
        outer: tuple[FloatArray, FloatArray],
        steps: tuple[LongArray, LongArray],
        costs_on: Callable[[int], FloatArray],
    ) -> ChosenParts:
        """Return the route that ends with a ride to an end, its cost summed from the start."""
        came, rode = steps
        parts: list[Part] = [(end, GOAL)]
        costs = [float(outer[1][end])]
        while end != START:
            entered = int(rode[end])
            before = int(came[entered])
            charge = dict(self.rides[entered])[end]
            part = (before, entered)
            one, other = (self.ends[each] for each in part)
            cost = outer[0][entered] if before == START else costs_on(one.floor)[one.at, other.at]
            parts.append(part)
            costs += [charge, float(cost)]
            end = before
        total = 0.0
        for cost in reversed(costs):
            total += cost
        return ChosenParts(total, tuple(reversed(parts)))
