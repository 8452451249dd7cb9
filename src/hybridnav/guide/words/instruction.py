"""Instructions for a person who walks along a path: the geometry of sentences, without words.
Public: `Space`, `Turn`, `Landmark`, `Wall`, `Doorway` and `FloorChange`.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

Kind = Literal["start", "turn", "cross", "ride", "arrive"]
Vehicle = Literal["lift", "stairs", "ramp"]
Shape = Literal["corridor", "hall", "room", "passage", "storey"]
Hand = Literal["left", "right"]
Side = Literal[
    "left", "right", "ahead", "behind", "ahead-left", "ahead-right", "behind-left", "behind-right"
]
LEAST_BEND_RAD = math.radians(55.0)
"""Turn from which a bend counts."""
_SHARP_RAD = math.radians(135.0)
_ROUND_RAD = math.radians(175.0)


@dataclass(frozen=True)
class Space:
    """A room, or free space without a name, which is described by its shape.

    Examples
    --------
    >>> from hybridnav.guide.words import Space
    >>> Space("kitchen").to_dict()
    {'name': 'kitchen', 'shape': 'room'}
    """

    name: str | None
    """Name of the room, None outside rooms."""
    shape: Shape = "room"
    """Its shape; of a room that nobody has named its kind, of one with a name `"room"`."""

    def to_dict(self) -> dict[str, Any]:
        """Return the plain values for JSON."""
        return {"name": self.name, "shape": self.shape}


@dataclass(frozen=True)
class Turn:
    """A change of direction.

    Examples
    --------
    >>> from hybridnav.guide.words import Turn
    >>> Turn(1.6).hand, Turn(-1.6).hand, Turn(2.6).is_sharp
    ('left', 'right', True)
    """

    angle_rad: float
    """Radians in [-pi, pi], counter-clockwise."""

    @property
    def hand(self) -> Hand:
        """The hand to which it leads."""
        return "left" if self.angle_rad > 0 else "right"

    @property
    def is_slight(self) -> bool:
        """Whether it is below 55 degrees."""
        return abs(self.angle_rad) < LEAST_BEND_RAD

    @property
    def is_sharp(self) -> bool:
        """Whether it exceeds 135 degrees."""
        return abs(self.angle_rad) > _SHARP_RAD

    @property
    def is_round(self) -> bool:
        """Whether it leads back, so that its hand means nothing: above 175 degrees."""
        return abs(self.angle_rad) > _ROUND_RAD


@dataclass(frozen=True)
class Landmark:
    """A door or an opening by which a person finds the direction at the start, or the goal.

    Examples
    --------
    >>> from hybridnav.guide.words import Landmark, Space
    >>> Landmark(7, Space("kitchen"), "left").is_opening
    False
    """

    door: int
    """Its number."""
    beyond: Space
    """The space behind it."""
    side: Side
    """Where it lies for a person who faces along the path."""
    is_opening: bool = False
    """Whether it is too wide to be a door."""

    def to_dict(self) -> dict[str, Any]:
        """Return the plain values for JSON."""
        return {
            "door": self.door,
            "beyond": self.beyond.to_dict(),
            "side": self.side,
            "is_opening": self.is_opening,
        }


@dataclass(frozen=True)
class Wall:
    """How a person finds a door by a wall of the room.

    Examples
    --------
    >>> from hybridnav.guide.words import Wall
    >>> Wall("left", 2).is_opposite
    False
    """

    hand: Hand | None
    """The hand at which it lies; of the wall opposite that to which one turns along it; None for
    one who looks round for the nearest door."""
    ordinal: int | None
    """Its number among the doors in the wall, or the openings, behind the passed ones, from 1 to 5.
    None where the name at the door is enough."""
    past: int = 0
    """How many openings one passes before the door, 3 at most."""
    is_opposite: bool = False
    """Whether it is the wall opposite the door at one's back."""
    length_m: float = field(default=0.0, compare=False)
    """How far one walks along it, in metres, without the way to the wall opposite."""
    via: Wall | None = None
    """The wall by which one goes to another door first, and turns one's back to it."""


@dataclass(frozen=True)
class Doorway:
    """The passage from one space into another.

    Examples
    --------
    >>> from hybridnav.guide.words import Space, Doorway
    >>> Doorway(Space("hall"), door=7, width_m=0.9).is_opening
    False
    """

    into: Space
    """The space behind it."""
    door: int | None = None
    """Number of the door; None where the spaces meet without one, as at unexplored cells."""
    width_m: float = 0.0
    """Width of the door in metres."""
    passage_m: float = math.inf
    """Diameter of the largest disc that passes: what furniture leaves of the width."""
    is_opening: bool = False
    """Whether it is too wide to be a door."""
    is_first: bool = False
    """Whether it is the first one after the start or a waypoint: the path leaves a room by it."""
    beside: Side | None = None
    """Where the door lies for a person who comes along the path; None for ahead."""
    ordinal: int | None = None
    """Its number among the doors there, or the openings: 1 to 5 for the first to the fifth, -1 for
    the last one. None where it is the only one, or its distance shows it."""
    wall: Wall | None = None
    """The wall that leads to it from the door before; None where the words follow none."""
    is_seen: bool = False
    """Whether a person sees it from where the instruction before ends, and walks there."""
    behind: Turn | None = None
    """Turn just behind it."""
    onward: Hand | None = None
    """Hand to which the path goes for a person who stands in the door and looks out; None for
    straight on, and beside `behind`."""


@dataclass(frozen=True)
class FloorChange:
    """A ride by a lift, stairs or a ramp from one floor to another.

    Examples
    --------
    >>> from hybridnav.guide.words import FloorChange
    >>> FloorChange("west lift", "lift", "3").has_exit
    False
    """

    link: str
    kind: Vehicle
    floor: str
    """Name of the floor to which it leads."""
    has_exit: bool = False
    """Whether the direction is known in which one leaves it: the instruction has the turn from
    there, or none for straight on."""

    def to_dict(self) -> dict[str, Any]:
        """Return the plain values for JSON."""
        return {
            "link": self.link,
            "kind": self.kind,
            "floor": self.floor,
            "has_exit": self.has_exit,
        }


@dataclass(frozen=True)
class Instruction:
    """One step of a description: a start, a turn, a door, a ride to another floor, or an arrival.

    Examples
    --------
    >>> from hybridnav.guide.words import Instruction, Space, Turn
    >>> Instruction("turn", (3.0, 1.0), 8.0, 8.0, Space(None, "corridor"), turn=Turn(1.6)).turn
    Turn(angle_rad=1.6)
    """

    kind: Kind
    position: tuple[float, float]
    """Point of the path, `(x, y)` in metres, map frame."""
    at_m: float
    """Length of the path from its start, over all waypoints, in metres."""
    after_m: float
    """Metres since the instruction before."""
    space: Space
    """The space in which it is followed."""
    turn: Turn | None = None
    """The turn; of a start that from the robot's heading, of a door that just before it, of a ride
    that out of it."""
    doorway: Doorway | None = None
    """The door or opening that a path crosses; None but for the kind `cross`."""
    waypoint: str | None = None
    """Name or coordinates of the waypoint at which one arrives."""
    landmark: Landmark | None = None
    """The sign of the direction at a start without a heading, or of the place of a goal."""
    change: FloorChange | None = None
    """The ride; None but for the kind `ride`."""
    heading_rad: float | None = None
    """Direction of the first step at a start without a landmark, radians, map frame (x is east,
    REP 103); else None."""

    def to_dict(self) -> dict[str, Any]:
        """Return the plain values for JSON."""
        return {
            "kind": self.kind,
            "position": list(self.position),
            "at_m": self.at_m,
            "after_m": self.after_m,
            "space": self.space.to_dict(),
            "turn_rad": _angle(self.turn),
            "doorway": None if self.doorway is None else _doorway(self.doorway),
            "waypoint": self.waypoint,
            "landmark": None if self.landmark is None else self.landmark.to_dict(),
            "change": None if self.change is None else self.change.to_dict(),
            "heading_rad": self.heading_rad,
        }


def _doorway(doorway: Doorway) -> dict[str, Any]:
    return {
        "into": doorway.into.to_dict(),
        "door": doorway.door,
        "width_m": doorway.width_m,
        "passage_m": None if math.isinf(doorway.passage_m) else doorway.passage_m,
        "is_opening": doorway.is_opening,
        "is_first": doorway.is_first,
        "beside": doorway.beside,
        "ordinal": doorway.ordinal,
        "wall": None if doorway.wall is None else asdict(doorway.wall),
        "is_seen": doorway.is_seen,
        "behind_rad": _angle(doorway.behind),
        "onward": doorway.onward,
    }


def _angle(turn: Turn | None) -> float | None:
    return None if turn is None else turn.angle_rad
