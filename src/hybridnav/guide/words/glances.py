"""Doors that a person sees from where it stands, or meets on its way."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from hybridnav._base.trig import atan2, cos, dist, hypots, sin
from hybridnav._base.typing import BoolArray, FloatArray
from hybridnav.guide.words.bends import Line
from hybridnav.guide.words.instruction import Hand, Side
from hybridnav.maps import CellClass
from hybridnav.rooms import Door, Rooms
from hybridnav.rooms.listing import FOUND_NAME

_LATERAL_M = 3.5
"""Distance from the path at which a door counts as passed, at most."""
NARROWEST_M = 0.4
"""Width below which a person sees no door."""
_MARGIN_M = 0.75
"""Ends of a stretch at which no door counts: it lies at the corner, not on the way."""
_LOOK_M = 1.0
_FARTHEST_M = 20.0
"""Distance at which a person recognises a door from the start, at most."""
_LEAST_SIDEWAYS, _CLEARLY_SIDEWAYS = 0.5, 0.75
"""Sine of the least angle between a path and the way out by a door beside it."""
FEW, MANY = 3, 5
"""Doors that a person counts with ease, and at most."""
_GUESSED, _GUESS_M = 0.7, 1.5
"""Who guesses a distance looks from 0.7 of it on, less 1.5 m: no other door lies behind that."""
_SIDES: dict[Side, float] = {
    "ahead": 0.0,
    "ahead-left": math.pi / 4,
    "ahead-right": -math.pi / 4,
    "left": math.pi / 2,
    "right": -math.pi / 2,
}
"""Where a door in sight may lie, by its angle to the direction in which a person looks."""
_SECTOR_RAD, _RIVAL_RAD = math.radians(22.5), math.radians(60.0)
"""Angle to the middle of its side up to which a door surely lies there, and perhaps."""
_SURE_RAD = math.radians(12.0)
"""Angle up to which the side of the only door of a room is told: nobody needs it."""
_BESIDE_M = 2.0
"""Distance of a door from which a person sees it however it lies."""
_COUNTED_M = 10.0
"""Distance up to which a person counts doors without walking along them."""
_GRAZING_RAD = math.radians(65.0)
"""Angle to the way through a door from which nobody sees that it is one."""
NEARER_M = 0.7
"""Least difference of two distances that a person sees."""


@dataclass(frozen=True)
class Glance:
    """How a person finds a door by looking round."""

    side: Side | None
    """Where it lies; None for one who knows no direction."""
    ordinal: int | None
    """Which of the doors there, the nearest first; None for the only one."""


@dataclass(frozen=True)
class Look:
    """What a person looks for on the way."""

    door: Door
    hand: Hand
    came_by: int
    """Number of the door behind its back, 0 for none."""


class DoorsInSight:
    """The doors of a map as a person looks for them."""

    def __init__(self, rooms: Rooms) -> None:
        self._rooms = rooms
        self._way_through_rad: dict[int, float] = {}
        self._points_of: dict[int, FloatArray] = {}

    @cached_property
    def _doors_of(self) -> dict[str | None, list[Door]]:
        """The doors that a person notices, by the room on each side: no boundary all round, as that
        of a zone inside a hall."""
        doors: dict[str | None, list[Door]] = {}
        for door in self._rooms.listed_doors:
            is_wide = door.width_m >= NARROWEST_M or door.passable
            is_ring = math.isnan(self.way_out_rad(door, is_forward=True))
            if is_wide and door.passage_m >= NARROWEST_M and not is_ring:
                for room in set(door.rooms):
                    doors.setdefault(room, []).append(door)
        return doors

    def way_out_rad(self, door: Door, *, is_forward: bool) -> float:
        """Return the direction in which one passes a door at right angles.

        `is_forward`: whether one comes from the first of its rooms. Result: radians, map frame: the
        mean of the steps across its boundary, which does not depend on how the boundary winds
        between its ends; NaN for one that closes into a ring: its steps cancel.
        """
        way = self._way_through_rad.get(door.number)
        if way is None:
            way = self._way_through_rad[door.number] = self._way_through(door)
        return way if is_forward else way + math.pi

    def _way_through(self, door: Door) -> float:
        labels, cols = self._rooms.labels, self._rooms.grid.shape[1]
        first, other = (-1 if name is None else labels.index(name) for name in door.rooms)
        flat = self._rooms.cells_beside(door.number)
        label_of = labels.label_of.ravel()
        across = []
        for step in (1, cols):
            pairs = flat[np.isin(flat + step, flat)]
            if step == 1:
                pairs = pairs[pairs % cols != cols - 1]
            tail, head = label_of[pairs], label_of[pairs + step]
            onward = np.count_nonzero((tail == first) & (head == other))
            back = np.count_nonzero((tail == other) & (head == first))
            across.append(int(onward) - int(back))
        if across == [0, 0]:
            return math.nan
        return atan2(across[1], across[0]) + self._rooms.grid.frame.yaw_rad

    def on_the_way(  # noqa: C901 - each door is before, beside or behind
        self, line: Line, between_m: tuple[float, float], room: str | None, look: Look
    ) -> int | None:
        """Return which of the doors at one hand a person takes who walks along a path.

        `between_m`: begin of the stretch, and where it comes to the door, by the length of the
        path; `room`: the room in which it lies, None outside rooms; `look`: the door, the hand at
        which it lies, and the door by which one came. Returns the first, second, ... fifth; -1 for
        the last before the space ends; None where the distance alone shows the door, or nothing
        does.
        """
        begin_m, end_m = between_m
        length_m, heading_rad = end_m - begin_m, line.heading(max(begin_m, end_m - 3.0), end_m)
        before, unsure, is_last = list[float](), False, True
        points, along = line.between(begin_m, end_m)
        for door in self._alike(look.door, room):
            if door.number in (look.door.number, look.came_by):
                continue
            away = hypots(*(points - door.position).T)
            nearest = int(np.argmin(away))
            at_m = float(along[nearest])
            hand, is_clear = self._hand_of(
                door, room, line.heading(max(begin_m, at_m - _LOOK_M), min(end_m, at_m + _LOOK_M))
            )
            if hand != look.hand or away[nearest] > 2 * _LATERAL_M:
                if at_m == end_m and hand == look.hand:
                    is_last = is_last and not self._is_ahead(door, line.at(end_m), heading_rad)
                continue
            if not self._is_seen_in_part(points[nearest].tolist(), door):
                continue
            if at_m > end_m - _MARGIN_M and self._is_ahead(door, look.door.position, heading_rad):
                is_last = False
                continue
            is_near = away[nearest] <= _LATERAL_M and self._is_seen(points[nearest].tolist(), door)
            if at_m < begin_m + _MARGIN_M:
                unsure = unsure or self._is_ahead(door, line.at(begin_m), heading_rad, -1.5)
                continue
            unsure = unsure or not (is_near and is_clear)
            before.append(at_m - begin_m)
        is_alone = all(each < _GUESSED * length_m - _GUESS_M for each in before)
        if not unsure and len(before) < FEW:
            return len(before) + 1
        if is_alone and length_m > _GUESS_M:
            return None
        if is_last and len(before) >= FEW:
            return -1
        return len(before) + 1 if len(before) < MANY else None

    @staticmethod
    def _is_ahead(
        door: Door, point: Sequence[float], heading_rad: float, from_m: float = 0.0
    ) -> bool:
        """Return whether a door lies farther along a heading than a point."""
        across, up = door.position[0] - point[0], door.position[1] - point[1]
        return across * cos(heading_rad) + up * sin(heading_rad) > from_m

    def at_a_glance(  # noqa: C901 - each rival is nearer, farther or as far
        self,
        door: Door,
        room: str | None,
        seen_from: tuple[tuple[float, float], float],
        came_by: int,
    ) -> Glance | None:
        """Return how a person finds a door who looks round in a room.

        `seen_from`: where the person stands, `(x, y)` in metres, map frame, and the direction in
        which it looks, radians; NaN for a person who knows none; `came_by`: number of the door by
        which it came, 0 for none. Returns the side at which it lies, and which of the doors there
        it is, the nearest first; None if that is not clear.
        """
        point, facing_rad = seen_from
        away_m = dist(point, door.position)
        others = [
            one for one in self._alike(door, room) if one.number not in (door.number, came_by)
        ]
        told = self._told(door, room)
        rivals = [one for one in others if told is None or self._told(one, room) == told]
        is_ring = math.isnan(self.way_out_rad(door, is_forward=True))
        only = None if rivals or is_ring or self._is_corridor(room) else Glance(None, None)
        if is_ring or away_m > _FARTHEST_M or not self._is_seen(list(point), door):
            return only
        across, up = door.position[0] - point[0], door.position[1] - point[1]
        way = self.way_out_rad(door, is_forward=door.rooms[0] == room)
        aslant_rad = abs(math.remainder(atan2(up, across) - way, math.tau))
        if aslant_rad > _GRAZING_RAD and away_m > _BESIDE_M:
            return only
        off_rad = turn_to(facing_rad, point, door.position)
        side = next((one for one, to in _SIDES.items() if abs(off_rad - to) <= _SECTOR_RAD), None)
        if side is None and not math.isnan(facing_rad):
            return only
        if only is not None and side is not None and abs(off_rad - _SIDES[side]) > _SURE_RAD:
            return only
        for is_read in (False, True):
            nearer, is_one, is_sure = 0, True, True
            for other in others:
                if is_read and self._told(other, room) != told:
                    continue
                off = 0.0
                if side is not None:
                    off = abs(turn_to(facing_rad, point, other.position) - _SIDES[side])
                    off = min(off, math.tau - off)
                if off > _RIVAL_RAD or not self._is_seen_in_part(list(point), other):
                    continue
                is_one = False
                farther_m = dist(point, other.position) - away_m
                is_sure = is_sure and (farther_m > NEARER_M or off <= _SECTOR_RAD)
                is_sure = is_sure and abs(farther_m) > NEARER_M
                nearer += farther_m < 0
            most_m = _FARTHEST_M if is_one and not is_read else _COUNTED_M
            if is_sure and nearer < FEW and away_m <= most_m:
                return Glance(side, None if is_one else nearer + 1)
            if told is None:
                break
        return only

    def bearing_rad(self, point: tuple[float, float], number: int) -> float:
        """Return the direction from a point to a door, radians."""
        x, y = self._rooms.door(number).position
        return atan2(y - point[1], x - point[0])

    def _told(self, door: Door, room: str | None) -> str | None:
        """Return what a person knows of the space behind a door: its name or its kind."""
        beyond = self._beyond(door, room)
        if beyond is None or is_named(beyond):
            return beyond
        kind = self._rooms.kinds[self._rooms.labels.index(beyond)]
        return None if kind is None else kind.name

    def _is_corridor(self, room: str | None) -> bool:
        """Return whether a space is so long that nobody finds all its doors by looking round."""
        kind = None if room is None else self._rooms.kinds[self._rooms.labels.index(room)]
        return room is None or (kind is not None and kind.name == "corridor")

    @staticmethod
    def _beyond(door: Door, room: str | None) -> str | None:
        return door.rooms[1] if door.rooms[0] == room else door.rooms[0]

    def _alike(self, door: Door, room: str | None) -> list[Door]:
        doors = self._doors_of.get(room, ())
        return [other for other in doors if other.is_opening == door.is_opening]

    def _span(self, door: Door) -> FloatArray:
        """Return the points of a door from end to end, float64 (n, 2), metres."""
        span = self._points_of.get(door.number)
        if span is None:
            frame, cols = self._rooms.grid.frame, self._rooms.grid.shape[1]
            flat = self._rooms.cells_beside(door.number)
            span = frame.points_of(np.column_stack(np.divmod(flat, cols)))
            self._points_of[door.number] = span
        return span

    def _hand_of(
        self, door: Door, room: str | None, heading_rad: float
    ) -> tuple[Hand | None, bool]:
        """Return the hand to which a door leads out of a room, None if it lies across the path, and
        whether that is clear."""
        way = self.way_out_rad(door, is_forward=door.rooms[0] == room)
        sideways = sin(way - heading_rad)
        if not abs(sideways) >= _LEAST_SIDEWAYS:
            return None, False
        return "left" if sideways > 0 else "right", abs(sideways) > _CLEARLY_SIDEWAYS

    def _is_seen_in_part(self, point: list[float], door: Door) -> bool:
        """Return whether no occupied cell lies between a point and the middle of a door, or some
        part of one between two rooms."""
        if self._is_seen(point, door) or None in door.rooms:
            return self._is_seen(point, door)
        return any(self._is_free(point, end) for end in self._span(door).tolist())

    def _is_seen(self, point: list[float], door: Door) -> bool:
        return self._is_free(point, list(door.position))

    def _is_free(self, point: list[float], end: list[float]) -> bool:
        """Return whether no occupied cell, nor what is off the map, lies between two points."""
        frame = self._rooms.grid.frame
        count = 1 + math.ceil(2 * dist(point, end) / frame.resolution_m)
        shares = np.arange(1, count) / count
        (row, col), (to_row, to_col) = frame.position_of(*point), frame.position_of(*end)
        cells = np.floor([row + (to_row - row) * shares, col + (to_col - col) * shares])
        limits = np.reshape(self._rooms.grid.shape, (2, 1))
        rows, cols = np.clip(cells.astype(np.intp), -1, limits)
        return not self._is_hidden[rows, cols].any()

    @cached_property
    def _is_hidden(self) -> BoolArray:
        """Whether nobody looks over a cell; row and column -1, and those after the last, are off
        the map."""
        hidden = self._rooms.grid.measured != CellClass.FREE
        return np.pad(hidden, (0, 1), constant_values=True)


def is_named(room: str | None) -> bool:
    """Return whether people gave a room its name, so that a person reads it on its doors."""
    return room is not None and FOUND_NAME.fullmatch(room) is None


def turn_to(heading_rad: float, point: tuple[float, float], end: Sequence[float]) -> float:
    """Return the turn from a heading towards a point, radians in [-pi, pi]."""
    way = atan2(end[1] - point[1], end[0] - point[0])
    return math.remainder(way - heading_rad, math.tau)
