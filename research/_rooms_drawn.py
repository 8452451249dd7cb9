"""Floors drawn by rule, with the rooms that a person would name: what one room is.

A corridor is one room, round its bends too, unless a door parts it. A bay belongs to its hall. What
is seen through glass is no room.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

import hybridnav as hn
from hybridnav._base.typing import BoolArray
from research._rooms_buildings import Building

Box = tuple[float, float, float, float]
"""A rectangle from its least x and y to its greatest, in metres."""
_WALL_M, _DEPTH_M, _OFFICE_M, _DOOR_M = 0.15, 5.0, 4.0, 0.9
_LEAST_OFFICE_M = 2.2
_SEEN_M = 0.3
"""Walls are known to this depth."""


@dataclass(frozen=True)
class DrawnFloor:
    """A floor in metres: the first room is the corridor or hall that it is about."""

    rooms: tuple[tuple[Box, ...], ...]
    doors: tuple[Box, ...] = ()
    """Free, and in no room."""
    solids: tuple[Box, ...] = ()
    """Partitions inside rooms."""

    def with_offices(self, begin: float, end: float, y: float, side: int) -> DrawnFloor:
        """Return the plan with offices along a wall at y, from x to x, above (1) or below (-1)."""
        count = max(1, int((end - begin + _WALL_M) / (_OFFICE_M + _WALL_M)))
        step = (end - begin + _WALL_M) / count
        low, high = sorted((y + side * _WALL_M, y + side * (_WALL_M + _DEPTH_M)))
        rooms, doors = list(self.rooms), list(self.doors)
        for k in range(count):
            x, at = begin + k * step, begin + k * step + 0.6 + k % 3 * 0.5
            rooms.append(((x, low, x + step - _WALL_M, high),))
            reach = sorted((y - side * 0.01, y + side * (_WALL_M + 0.01)))
            doors.append((at, reach[0], at + _DOOR_M, reach[1]))
        return replace(self, rooms=tuple(rooms), doors=tuple(doors))

    def framed(self) -> DrawnFloor:
        """Return the plan with offices along all walls of its corridor, where they fit."""
        plan = self
        for left, low, right, high in self.rooms[0]:
            for begin, end, wall, side, is_turned in (
                *((left, right, low, -1, False), (left, right, high, 1, False)),
                *((low, high, left, -1, True), (low, high, right, 1, True)),
            ):
                at = begin
                while at + _LEAST_OFFICE_M <= end:
                    one = DrawnFloor(()).with_offices(at, min(end, at + _OFFICE_M), wall, side)
                    one = one.turned() if is_turned else one
                    if any(_meet(one.rooms[0][0], box) for room in plan.rooms for box in room):
                        at += 0.25
                        continue
                    plan = replace(plan, rooms=plan.rooms + one.rooms, doors=plan.doors + one.doors)
                    at += _OFFICE_M
        return plan

    def turned(self) -> DrawnFloor:
        """Return the plan with x and y swapped."""
        rooms = tuple(tuple((b, a, d, c) for a, b, c, d in room) for room in self.rooms)
        return replace(self, rooms=rooms, doors=tuple((b, a, d, c) for a, b, c, d in self.doors))


def _meet(one: Box, other: Box) -> bool:
    """Return whether less than a wall lies between two boxes."""
    gaps = (one[0] - other[2], other[0] - one[2], one[1] - other[3], other[1] - one[3])
    return max(gaps) < _WALL_M - 1e-9


def straight(
    width: float, length: float = 24.0, *, parts: int = 1, door: float = 0.0
) -> DrawnFloor:
    """Draw a corridor between offices; doors of a width across it part it."""
    step = (length + _WALL_M) / parts
    rooms = [((k * step, 0.0, (k + 1) * step - _WALL_M, width),) for k in range(parts)]
    low, high = (width - door) / 2, (width + door) / 2
    ends = [room[0][2] for room in rooms[:-1]]
    doors = [(end - 0.01, low, end + _WALL_M + 0.01, high) for end in ends]
    plan = DrawnFloor(tuple(rooms), tuple(doors))
    return plan.with_offices(0, length, width, 1).with_offices(0, length, 0, -1)


def bend(width: float, along: float = 16.0, up: float = 14.0) -> DrawnFloor:
    """Draw a corridor with a bend, between offices."""
    return DrawnFloor((((0, 0, along, width), (0, 0, width, up)),)).framed()


def crossing(width: float, other: float, *, down: float = 9.0) -> DrawnFloor:
    """Draw two corridors that cross, between offices; `down` 0 makes a branch of one."""
    boxes: tuple[Box, ...] = ((-10, 0, other + 10, width), (0, -down, other, width + 9))
    return DrawnFloor((boxes,)).framed()


def hall(count: int, bay: float, deep: float, front: float = 0.0) -> DrawnFloor:
    """Draw a hall with bays along both sides; a part `front` of the open side of each is closed."""
    length, depth, thin = count * bay, 12.0, 0.06
    solids: list[Box] = []
    for low, high, panel in ((0.0, deep, deep), (depth - deep, depth, depth - deep + thin)):
        solids += [(k * bay - thin / 2, low, k * bay + thin / 2, high) for k in range(1, count)]
        if front:
            panels = [(k * bay, (k + front) * bay) for k in range(count)]
            solids += [(begin, panel - thin, end, panel) for begin, end in panels]
    door = (-_WALL_M - 0.01, depth / 2 - 0.5, 0.01, depth / 2 + 0.5)
    rooms: tuple[Box, Box] = ((0, 0, length, depth), (-_WALL_M - 2.4, 0, -_WALL_M, depth))
    return DrawnFloor(tuple((room,) for room in rooms), (door,), tuple(solids))


def drawn(
    plan: DrawnFloor, side_m: float, turned_rad: float = 0.0, name: str = "drawn:"
) -> Building:
    """Draw a plan, turned, with cells of a side."""
    boxes = np.array([box for room in plan.rooms for box in room] + list(plan.doors))
    low, high = boxes[:, :2].min(axis=0) - 0.5, boxes[:, 2:].max(axis=0) + 0.5
    cosine, sine = math.cos(turned_rad), math.sin(turned_rad)
    spread = abs(np.array([[cosine, sine], [sine, cosine]])) @ (high - low)
    shape = tuple(np.ceil(spread[::-1] / side_m).astype(int))
    y, x = (np.indices(shape) + 0.5) * side_m - spread[::-1, None, None] / 2
    x, y = cosine * x + sine * y, cosine * y - sine * x
    x, y = x + (low + high)[0] / 2, y + (low + high)[1] / 2

    def inside(boxes: Sequence[Box]) -> BoolArray:
        found = np.zeros(shape, np.bool_)
        for left, bottom, right, top in boxes:
            found |= (x >= left) & (x < right) & (y >= bottom) & (y < top)
        return found

    true = np.full(shape, -1, np.int32)
    for number, room in enumerate(plan.rooms):
        true[inside(room)] = number
    free = ((true >= 0) | inside(plan.doors)) & ~inside(plan.solids)
    true[~free] = -1
    deep = ndimage.distance_transform_edt(~free) * side_m > _SEEN_M
    probability = np.where(deep, 0.5, ~free).astype(np.float32)
    grid = hn.OccupancyGrid(probability, hn.Frame(side_m), robot_radius_m=0)
    return Building(name, grid, true, true >= 0, None, None)
