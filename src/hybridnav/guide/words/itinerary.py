"""Paths by rooms and doors: their legs, and instructions for a person."""

from collections.abc import Sequence
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.typing import LongArray
from hybridnav.guide.words import Instruction
from hybridnav.guide.words.bends import Leg
from hybridnav.guide.words.instruction import Shape
from hybridnav.guide.words.instructions import instructions_of as instructions_of_legs
from hybridnav.guide.words.landmarks import Landmarks
from hybridnav.planning import HybridPlanner, Path
from hybridnav.rooms import Door, Rooms
from hybridnav.rooms.listing import FOUND_NAME, WIDEST_CORRIDOR_M
from hybridnav.route import RouteFinder
from hybridnav.route.visits import visits_of
from hybridnav.topology import TopologicalMap

_LEAST_ROOM_M2 = 6.0
_LEAST_HALL_M2 = 60.0
_LONG_SHAPE = 3.0
"""Length over breadth from which a space is no room."""


def waypoint_text(waypoint: ArrayLike | str) -> str:
    """Return what sentences call a waypoint: its name, or its coordinates in metres."""
    if isinstance(waypoint, str):
        return waypoint
    x, y = np.asarray(waypoint, dtype=np.float64)[:2].tolist()
    return f"({x:.10g}, {y:.10g})"


def heading_of(start: Sequence[float] | None) -> float | None:
    """Return the heading of a start `(x, y, yaw)`, None if it has none."""
    return None if start is None or len(start) < 3 else start[2]  # noqa: PLR2004


class Guide:
    """Descriptions of paths on a map with rooms.

    `rooms`: the rooms; the crossings of their doors are computed once.
    """

    def __init__(self, rooms: Rooms) -> None:
        self._rooms = rooms
        self._route_finder = RouteFinder(rooms)
        self._landmarks = Landmarks(rooms)

    def legs(self, path: Path, *, waypoint: str | None = None) -> list[Leg]:
        """Divide a path into its legs.

        `path`: a cell path, or an any-angle one, whose length is divided in the proportions of its
        cell path; `waypoint`: waypoint at the end of the path. Result: at least one leg; the
        lengths sum to that of the path.
        """
        visits = visits_of(self._rooms, self._route_finder, path.cells, path.length_m)
        legs = [
            Leg(
                self._rooms.name_of(one.label),
                one.length_m,
                one.door,
                endpoint=one.end,
                shape=self._shape(one.vertex, one.cells),
            )
            for one in visits
        ]
        x, y = path.points[-1].tolist()
        return [*legs[:-1], replace(legs[-1], waypoint=waypoint, endpoint=(x, y))]

    def doors(self, path: Path) -> list[Door]:
        """Return the doors and openings that a path passes."""
        return [leg.door for leg in self.legs(path) if leg.door is not None]

    def instructions(
        self,
        paths: Sequence[Path],
        legs: Sequence[Sequence[Leg]],
        *,
        heading_rad: float | None = None,
    ) -> tuple[Instruction, ...]:
        """Return the instructions for a person who walks along paths.

        `paths`: those of a tour in order, at least one; `heading_rad`: heading at the start,
        radians counter-clockwise from the x axis; None if there is none.
        """
        told = [[self._told(leg) for leg in each] for each in legs]
        return tuple(instructions_of_legs(paths, told, self._landmarks, heading_rad))

    def _told(self, leg: Leg) -> Leg:
        """Return a leg as words tell it: a room that nobody has named has the shape of its kind."""
        if leg.room is None or not FOUND_NAME.fullmatch(leg.room):
            return leg
        kind = self._rooms.kinds[self._rooms.labels.index(leg.room)]
        return leg if kind is None else replace(leg, shape=kind.name)

    def _shape(self, vertex: int, cells: LongArray) -> Shape:
        rooms, level = self._rooms, self._rooms.level
        if rooms.label_of_vertex[vertex] >= 0:
            return "room"
        area_m2 = float(level.areas[vertex]) * rooms.grid.cell_area_m2
        if area_m2 < _LEAST_ROOM_M2:
            return "passage"
        field = level.receptive_field(vertex)
        breadth_m = 2 * float(rooms.clearance_m[tuple(field.T)].max())
        if area_m2 >= _LONG_SHAPE * breadth_m * breadth_m:
            nearby_m = 2 * float(np.quantile(rooms.clearance_m[tuple(cells.T)], 0.75))
            if min(breadth_m, nearby_m) <= WIDEST_CORRIDOR_M:
                return "corridor"
        return "hall" if area_m2 >= _LEAST_HALL_M2 else "room"


_GUIDES: WeakKeyDictionary[TopologicalMap, Guide] = WeakKeyDictionary()


def guide_of(planner: HybridPlanner) -> Guide | None:
    """Return what describes the paths of a planner; None on a map without rooms."""
    return None if planner.pyramid_rooms is None else _guide_on(planner.topology)


def _guide_on(topology: TopologicalMap) -> Guide:
    guide = _GUIDES.get(topology)
    if guide is None:
        guide = _GUIDES[topology] = Guide(topology.rooms)
    return guide


def instructions_of(
    path: Path, topology: TopologicalMap, goal: ArrayLike | str, start: Sequence[float]
) -> tuple[Instruction, ...]:
    """Return the instructions of the path of one plan; see `planning.result.Walk`."""
    guide = _guide_on(topology)
    legs = guide.legs(path, waypoint=waypoint_text(goal))
    return guide.instructions([path], [legs], heading_rad=heading_of(start))
