"""The legs of a path: its parts inside one room each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from hybridnav.planner.guide import Space

if TYPE_CHECKING:
    from hybridnav.planner.guide.instruction import Shape
    from hybridnav.topology.rooms import Door


@dataclass(frozen=True)
class Leg:
    """The part of a path inside one room."""

    room: str | None
    """Name of the room, None outside rooms."""
    length_m: float
    door: Door | None = None
    """The door at the end of the leg; None on the last leg, and at a boundary that is no door (to
    or from unexplored cells)."""
    waypoint: str | None = None
    """Waypoint at the end of the leg: its name or its coordinates."""
    endpoint: tuple[float, float] = (0.0, 0.0)
    """Point where it ends, `(x, y)` in metres, map frame."""
    shape: Shape = "room"
    """Shape of the space outside rooms."""

    @property
    def space(self) -> Space:
        """The room, or the space outside rooms by its shape."""
        return Space(self.room, "room" if self.room is not None else self.shape)

    def to_dict(self) -> dict[str, Any]:
        """Return the plain values for JSON."""
        return {
            "room": self.room,
            "length_m": self.length_m,
            "door": None if self.door is None else self.door.number,
            "door_kind": None if self.door is None else self.door.kind,
            "door_width_m": None if self.door is None else self.door.width_m,
            "door_m": None if self.door is None else list(self.door.position),
            "waypoint": self.waypoint,
        }
