"""Doors and openings as a person meets them: how they lie to a path, and which are passed."""

import math
from collections.abc import Collection, Iterator
from dataclasses import replace

import numpy as np

from hybridnav._base.poses import wrapped
from hybridnav._base.trig import cos, directions, dist, hypots, sin
from hybridnav.guide.words import Landmark, Space, Wall
from hybridnav.guide.words.bends import Line
from hybridnav.guide.words.glances import (
    FEW,
    MANY,
    NARROWEST_M,
    NEARER_M,
    DoorsInSight,
    is_named,
    turn_to,
)
from hybridnav.guide.words.instruction import Hand, Side
from hybridnav.guide.words.walls import RoomWalls
from hybridnav.maps import CellClass
from hybridnav.rooms import Door, Rooms

_FARTHEST_M = 20.0
"""Distance at which a person recognises a door from the start, at most."""
_NEARBY_M = 5.0
"""Distance of a door that shows a person where a path ends, at most."""
_NEAREST_M = 0.7
"""Distance from a door below which nobody can tell where it lies."""
_HANDS: tuple[Hand, ...] = ("left", "right")
_ASKEW_RAD = tuple(math.radians(degrees) for degrees in (0, 6, -6, 12, -12))
"""How far off the right angle with a door a person may come to the wall opposite."""
_ACROSS_M, _BESIDE_HIT_M = 10.0, 0.5
"""How far the wall opposite may be, and how near a door may be where one comes to it."""
_FARTHEST_WALL_M = 100.0
"""Length of wall that nobody follows farther."""
_STRIDE_M = 1.0
"""Length of wall that a person walks past straight on."""
_GAP_M = 1.2
"""Distance of two boundaries that are one door, across a gap between two outlines."""
_MOST_PAST, _PASSED_M = 3, 5.0
"""Openings that a person passes at a wall, at most, and the length of wall that each is worth."""
_AHEAD_RAD = math.radians(15.0)
"""Angle to the path up to which a landmark lies ahead, or behind."""
_TOWARDS_RAD = math.radians(20.0)
"""Angle to the first stretch up to which a path leads towards some part of its exit."""
_BESIDE_RAD = math.radians(60.0)
"""Angle to the path from which a landmark lies at one hand."""


class Landmarks(DoorsInSight):
    """The doors of a map, as a person on a path sees them."""

    def __init__(self, rooms: Rooms) -> None:
        super().__init__(rooms)
        self._walls: dict[str, RoomWalls] = {}
        self._led_from: dict[tuple[int, str], list[tuple[float, int, Wall]]] = {}

    def along_a_wall(
        self, came_by: int, door: Door, room: str | None, most_m: float, beyond: str | None
    ) -> Wall | None:
        """Return the wall of a room that leads a person from one door to another.

        `came_by`: number of the door behind the person; `room`: the room, None outside rooms;
        `most_m`: length of wall that nobody follows farther, metres; `beyond`: the room behind the
        door, or behind a gap that follows it. Returns the shortest: that of the door, or the one
        opposite, at either hand. None where all are too long, or have too many doors.
        """
        if room is None or came_by == door.number:
            return None
        return self._by_walls(came_by, door, room, most_m, beyond)

    def from_a_door(
        self, point: tuple[float, float], door: Door, room: str | None, most_m: float
    ) -> Wall | None:
        """Return the way to one of the nearest doors and along a wall to another, None for none.

        The parameters are those of `along_a_wall`, but for the point where the person looks round.
        A nearest door counts while each is clearly nearer than the next one, or nobody can tell
        which is meant.
        """
        if room is None or self._is_corridor(room):
            return None
        visible = sorted(
            (dist(point, near.position), near.number)
            for near in self._doors_of.get(room, ())
            if not near.is_opening and self._is_seen_in_part(list(point), near)
        )
        farther_m = [*(away_m for away_m, _ in visible[1:]), math.inf]
        for rank, (away_m, number) in enumerate(visible[:FEW]):
            if farther_m[rank] - away_m < NEARER_M:
                return None
            wall = self._by_walls(number, door, room, most_m - away_m)
            if wall is not None and wall.via is None:
                return replace(wall, via=Wall(None, rank + 1))
        return None

    def _by_walls(
        self, came_by: int, door: Door, room: str, most_m: float, beyond: str | None = None
    ) -> Wall | None:
        is_read = is_named(beyond) and beyond is not None
        ways = [
            (length_m, wall)
            for length_m, number, wall in self._led(came_by, room)
            if number == door.number and length_m <= most_m
            if wall.ordinal is not None or is_read
        ]
        if not ways:
            ways = [
                (to_m + on_m, replace(onward, via=wall))
                for to_m, via, wall in self._led(came_by, room)
                if via != door.number and to_m < most_m and wall.ordinal is not None
                if not self._rooms.door(via).is_opening
                for on_m, number, onward in self._led(via, room)
                if number == door.number and to_m + on_m <= most_m
                if onward.ordinal is not None or is_read
            ]
        return min(ways, key=lambda one: one[0])[1] if ways else None

    def _led(self, came_by: int, room: str) -> list[tuple[float, int, Wall]]:
        """Return to which doors walls lead a person from a door of a room, and how far they are.

        Each with its number: that of an opening which is passed counts 5 m more.
        """
        key = came_by, room
        if key not in self._led_from:
            begin = self._walls_of(room).of_exit(came_by)
            led = [] if begin is None else list(self._in_wall(begin, room, came_by))
            across = [list(self._in_wall(*hit)) for hit in self._opposite(came_by, room)]
            if len(across) == len(_ASKEW_RAD):
                askew = [{(one[1], one[2].hand): one[2] for one in each} for each in across]
                for length_m, number, wall in across[0]:
                    walls = [each.get((number, wall.hand)) for each in askew]
                    if walls == [wall] * len(walls):
                        led.append((length_m, number, wall))
                    elif None not in walls:
                        led.append((length_m, number, replace(wall, ordinal=None, past=0)))
            self._led_from[key] = led
        return self._led_from[key]

    def _in_wall(
        self,
        begin: tuple[int, int],
        room: str,
        came_by: int,
        across_m: float = 0.0,
        is_clear_there: bool = True,  # noqa: FBT001, FBT002 - as _opposite yields it
    ) -> Iterator[tuple[float, int, Wall]]:
        """Yield the doors and openings in a wall up to one that is unclear, with both hands."""
        side_m, is_opposite = self._rooms.grid.resolution_m, across_m > 0.0
        noticed = {one.number for one in self._doors_of.get(room, ())}
        for hand in _HANDS:
            turn = _HANDS[hand == "left"] if is_opposite else hand
            openings = doors_behind = 0
            is_clear = is_clear_there
            for number, away in self._walls_of(room).met(begin, hand):
                door, length_m = self._rooms.door(number), across_m + side_m * away
                if number == came_by and not is_opposite:
                    continue
                is_clear = is_clear and not (is_opposite and side_m * away < _BESIDE_HIT_M)
                is_clear = is_clear and number in noticed and self._is_clear(door)
                if door.is_opening:
                    openings, doors_behind = openings + 1, 0
                    wall = Wall(turn, openings, is_opposite=is_opposite)
                else:
                    doors_behind += 1
                    wall = Wall(turn, doors_behind, openings, is_opposite)
                if wall.past > _MOST_PAST or length_m > _FARTHEST_WALL_M:
                    break
                if not is_clear or (wall.ordinal or 0) > MANY:
                    wall = replace(wall, ordinal=None, past=0)
                wall = replace(wall, length_m=length_m - across_m)
                yield length_m + _PASSED_M * wall.past, number, wall

    def _opposite(
        self, came_by: int, room: str
    ) -> Iterator[tuple[tuple[int, int], str, int, float, bool]]:
        """Yield where the wall is opposite a door, straight on and a little askew, with the room,
        the door, how far it is, and whether no door is there."""
        door, walls, frame = self._rooms.door(came_by), self._walls_of(room), self._rooms.grid.frame
        way = self.way_out_rad(door, is_forward=door.rooms[1] == room) - frame.yaw_rad
        for askew_rad in () if math.isnan(way) else _ASKEW_RAD:
            step = sin(way + askew_rad), cos(way + askew_rad)
            hit = walls.ahead(frame.position_of(*door.position), step)
            if hit is not None and hit[1] * frame.resolution_m <= _ACROSS_M:
                yield hit[0], room, came_by, hit[1] * frame.resolution_m, hit[2]

    def _is_clear(self, door: Door) -> bool:
        """Return whether a person sees a door or an opening where a boundary lies.

        A gap between two outlines that has one at one side and the other at the other shows none.
        """
        if None not in door.rooms:
            return True
        near = [
            (dist(one.position, door.position), one.number, one.is_opening)
            for one in self._doors_of.get(None, ())
            if one.number != door.number and not set(one.rooms) & set(door.rooms) - {None}
        ]
        return bool(near) and min(near)[0] < _GAP_M and min(near)[2] == door.is_opening

    def _walls_of(self, room: str) -> RoomWalls:
        """Return the walls of a room, with a person's doors and openings, and what else leads out
        of all rooms."""
        if room not in self._walls:
            rooms, seen = self._rooms, {one.number for one in self._doors_of.get(room, ())}
            exits = {
                door.number: rooms.moves_through(door.number)
                for door in rooms.doors
                if room in door.rooms and door.passage_m >= NARROWEST_M
                if door.number in seen or (door.passable and None in door.rooms)
            }
            label_of = np.where(
                rooms.grid.measured == CellClass.FREE, rooms.labels.label_of, np.int32(-1)
            )
            step = max(1, round(_STRIDE_M / rooms.grid.resolution_m))
            self._walls[room] = RoomWalls(label_of, rooms.labels.index(room), exits, step)
        return self._walls[room]

    def at_start(self, line: Line, room: str | None, exits: Collection[int]) -> Landmark | None:
        """Return the door that shows a person at the begin of a path in which direction to go.

        `room`: the room of its begin, None outside rooms; `exits`: numbers of the doors by which
        the path leaves the room. Returns the exit straight ahead, over furniture too; else the exit
        in sight if it lies ahead at one hand; else the nearest other door in sight, within 20 m;
        else the exit in sight; else what lies ahead behind furniture, or, for a path that stays in
        the room, anywhere.
        """
        point, heading_rad = line.at(0.0), line.first_heading()
        marks: list[tuple[int, float, int, Landmark]] = []
        for door in self._doors_of.get(room, ()):
            away_m, is_exit = dist(point, door.position), door.number in exits
            is_far = away_m > _FARTHEST_M and not is_exit
            named = self._beyond(door, room)
            others = [one for one in self._doors_of[room] if self._beyond(one, room) == named]
            if away_m < _NEAREST_M or is_far or not is_named(named) or len(others) > 1:
                continue
            seen = self._mark(door, room, point, heading_rad)
            if (
                is_exit
                and self._leads_to(door, point, heading_rad)
                and self._is_seen(list(point), door)
            ):
                return replace(seen, side="ahead")
            if self._is_seen(list(point), door):
                rank = (0 if seen.side.startswith("ahead") else 2) if is_exit else 1
                marks.append((rank, away_m, door.number, seen))
        return min(marks, key=lambda one: one[:3])[3] if marks else None

    def at_goal(
        self, point: tuple[float, float], heading_rad: float, room: str | None, but: Collection[int]
    ) -> Landmark | None:
        """Return the door that shows a person where a path ends.

        `point`: where it ends, `(x, y)` in metres, map frame; `heading_rad`: direction in which the
        person looks, radians; NaN without one; `room`: the room in which it ends, None outside
        rooms; `but`: numbers of the doors by which the path comes. Returns the nearest other door
        in sight, within 5 m.
        """
        near = [
            (away_m, door.number, door)
            for door in self._doors_of.get(room, ())
            for away_m in [dist(point, door.position)]
            if _NEAREST_M <= away_m <= _NEARBY_M and door.number not in but
            if not (door.is_opening and None in door.rooms) and self._is_seen(list(point), door)
        ]
        if not near or math.isnan(heading_rad):
            return None
        return self._mark(min(near)[2], room, point, heading_rad)

    def _mark(
        self, door: Door, room: str | None, point: tuple[float, float], heading_rad: float
    ) -> Landmark:
        """Return a door as a landmark for a person at a point of a room.

        Where it lies is judged by its nearest point: the middle of a wide opening lies ahead of one
        who stands beside it.
        """
        span = self._span(door)
        away_m = hypots(*(span - point).T)
        nearest = int(np.argmin(away_m))
        middle = turn_to(heading_rad, point, door.position)
        if away_m[nearest] < _NEAREST_M:
            way = self.way_out_rad(door, is_forward=door.rooms[0] == room)
            angle = math.remainder(way - heading_rad, math.tau)
        else:
            angle = turn_to(heading_rad, point, span[nearest].tolist())
        if abs(middle) <= _AHEAD_RAD and abs(angle) <= _BESIDE_RAD:
            angle = middle
        beyond = door.rooms[1] if door.rooms[0] == room else door.rooms[0]
        return Landmark(door.number, Space(beyond), _side(angle), is_opening=door.is_opening)

    def _leads_to(self, door: Door, point: tuple[float, float], heading_rad: float) -> bool:
        """Return whether some part of a door lies in the direction of a path."""
        across, up = (self._span(door) - point).T
        off = wrapped(directions(up, across) - heading_rad)
        return bool((np.abs(off) <= _TOWARDS_RAD).any())


def _side(angle_rad: float) -> Side:
    """Return where something lies, by its angle to the direction of the path."""
    is_left, off = angle_rad > 0, abs(angle_rad)
    if off <= _AHEAD_RAD:
        return "ahead"
    if off >= math.pi - _AHEAD_RAD:
        return "behind"
    if off < _BESIDE_RAD:
        return "ahead-left" if is_left else "ahead-right"
    if off > math.pi - _BESIDE_RAD:
        return "behind-left" if is_left else "behind-right"
    return "left" if is_left else "right"
