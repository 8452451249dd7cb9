"""The visits of a path to rooms, and the doors between them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from hybridnav._base.trig import lengths_along
from hybridnav._base.typing import LongArray

if TYPE_CHECKING:
    from hybridnav.rooms import Door, Rooms
    from hybridnav.route.route import RouteFinder

_SLIVER_M = 0.5
"""Most metres in a room that is entered and left by the same door for it not to count."""


@dataclass(frozen=True, eq=False)
class RoomVisit:
    """The part of a path in one vertex of the room level, mostly a room."""

    vertex: int
    label: int
    """The room, `NO_ROOM` for none."""
    cells: LongArray
    """int64 (n, 2), its cells."""
    length_m: float
    end: tuple[float, float]
    """Where it ends, `(x, y)` in metres, map frame."""
    door: Door | None = None
    """The door or opening to the next one; None without, and at the end."""


def visits_of(
    rooms: Rooms, finder: RouteFinder, cells: LongArray, length_m: float
) -> list[RoomVisit]:
    """Divide a path into visits, at least one, without those that only touch a room.

    `finder`: that of the rooms; `cells`: int64 (n, 2), those of the path; `length_m`: its length,
    which is divided in the proportions of the cells.
    """
    vertices, arcs, steps = finder.crossings(cells)
    along = lengths_along(cells)
    scale = length_m / along[-1] if along[-1] > 0 else 0.0
    labels = rooms.label_of_vertex[vertices].tolist()
    visits: list[RoomVisit] = []
    begun, from_step = 0.0, 0
    for number, arc in enumerate(arcs):
        if labels[number] == labels[number + 1]:
            continue
        step = steps[number]
        # A diagonal past the corner of a third room crosses two boundaries, both at its middle.
        ended = (along[step] + along[step + 1]) / 2
        x, y = rooms.grid.frame.points_of(cells[step : step + 2]).mean(axis=0).tolist()
        own, part_m = cells[from_step : step + 1], float((ended - begun) * scale)
        door = rooms.door_of_arc.get(arc)
        visits.append(RoomVisit(vertices[number], labels[number], own, part_m, (x, y), door))
        begun, from_step = ended, step + 1
    x, y = rooms.grid.frame.points_of(cells[-1:])[0].tolist()
    part_m = float((along[-1] - begun) * scale)
    visits.append(RoomVisit(vertices[-1], labels[-1], cells[from_step:], part_m, (x, y)))
    return _without_grazes(visits)


def _without_grazes(visits: list[RoomVisit]) -> list[RoomVisit]:
    """Join the visits on both sides of one that only touches a room.

    It enters by a door and returns by the same one within half a metre.
    """
    kept: list[RoomVisit] = []
    for visit in visits:
        kept.append(visit)
        while len(kept) > 2:  # noqa: PLR2004
            before, within, behind = kept[-3:]
            if before.door is None or before.door != within.door or within.length_m > _SLIVER_M:
                break
            length_m = before.length_m + within.length_m + behind.length_m
            kept[-3:] = [replace(behind, length_m=length_m)]
    return kept
