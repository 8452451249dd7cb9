"""Links between floors: lifts, stairs and ramps, where they stand and what a ride costs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, get_args

from hybridnav.errors import InvalidValueError

LinkKind = Literal["lift", "stairs", "ramp"]


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
    """Name of the floor."""
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
    """A lift, stairs or a ramp. It leads in both directions between any two of its ends.

    A ride costs `wait_s`, and from one end to the next one `ride_s`, in seconds, and `cost_m` in
    metres on top: what a planner charges is `cost_m + speed * seconds`.

    Raises
    ------
    InvalidValueError
        When the kind is not known, there are not two ends on different floors, a time or the cost
        is negative or not finite, or the greatest radius is not above 0.

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
    """What it is: robots that climb no stairs are kept from stairs."""
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

    def __post_init__(self) -> None:
        """Refuse what no planner could use."""
        if self.kind not in get_args(LinkKind):
            known = ", ".join(get_args(LinkKind))
            raise InvalidValueError(
                f"link {self.name} is of kind {self.kind!r:.40}, not one of {known}"
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
        """Return what a ride is charged in metres.

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
