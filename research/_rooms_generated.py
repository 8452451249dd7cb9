"""Generated floors with known rooms, as a robot maps them: clutter, shadows, noise and drift."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy import ndimage

import hybridnav as hn
from hybridnav._base.typing import BoolArray, FloatArray, IntArray
from research._rooms_buildings import Building

_CELL_M = 0.05
_MARGIN = 80
"""Cells round the floor, for rays that leave it through windows."""
_WALL, _FURNITURE, _GLASS = 1, 2, 3


def _n(length_m: float) -> int:
    """Return a length in cells."""
    return max(1, round(length_m / _CELL_M))


class Area(NamedTuple):
    """Cells from `low` to `high`, (row, col).

    Its sides are the low ends of both axes, 0 and 1, and the high ones, 2 and 3.
    """

    low: tuple[int, int]
    high: tuple[int, int]

    def side(self, axis: int) -> int:
        """Return the number of rows (axis 0) or columns (axis 1)."""
        return self.high[axis] - self.low[axis]

    def part(self, axis: int, begin: int, end: int) -> Area:
        """Return what lies between two offsets along an axis."""
        low, high = list(self.low), list(self.high)
        low[axis], high[axis] = self.low[axis] + begin, self.low[axis] + end
        return Area((low[0], low[1]), (high[0], high[1]))

    def along(self, side: int, begin: int, end: int) -> Area:
        """Return what lies between two distances from a side."""
        axis, is_high = side % 2, side // 2
        n = self.side(axis)
        return self.part(axis, n - end, n - begin) if is_high else self.part(axis, begin, end)

    @property
    def cells(self) -> tuple[slice, slice]:
        """Index of the cells."""
        (a, b), (c, d) = np.maximum(self, 0).tolist()
        return slice(a, c), slice(b, d)


class _Floor:
    """A floor while it is drawn; 0 is free."""

    def __init__(self, random: np.random.Generator) -> None:
        self.random = random
        size = self.length(14, 32), self.length(25, 60)
        self.matter = np.full((size[0] + 2 * _MARGIN, size[1] + 2 * _MARGIN), _WALL, np.int8)
        self.room_of = np.full(self.matter.shape, -1, np.int32)
        self.wall = self.length(0.1, 0.3)
        self.breadth_m, self.room_m = random.uniform(1.5, 3.6), random.uniform(1.8, 6.5)
        self.clutter = random.uniform(0.1, 2.5)
        self.rooms: list[Area] = []
        self.doors: list[Area] = []
        self.corridors: list[Area] = []
        self.divide(Area((_MARGIN, _MARGIN), (_MARGIN + size[0], _MARGIN + size[1])), ())
        for room in self.rooms:
            self.furnish(room)
        for low, high in self.doors:  # kept clear, but for the leaf of some
            near = self.matter[Area((low[0] - 14, low[1] - 14), (high[0] + 14, high[1] + 14)).cells]
            near[near == _FURNITURE] = 0
            if self.chance(0.5):
                angle, steps = random.uniform(0, 2 * math.pi), np.arange(2, self.length(0.6, 1.0))
                rows = (random.choice([low[0], high[0]]) + steps * math.sin(angle)).astype(int)
                cols = (random.choice([low[1], high[1]]) + steps * math.cos(angle)).astype(int)
                free = self.matter[rows, cols] == 0
                self.matter[rows[free], cols[free]] = _FURNITURE

    def chance(self, share: float) -> bool:
        """Return True with a probability."""
        return bool(self.random.random() < share)

    def length(self, low_m: float, high_m: float) -> int:
        """Return a random length in cells."""
        return _n(self.random.uniform(low_m, high_m))

    def carve(self, area: Area, label: int = -1) -> None:
        """Make an area free, as a part of a room or as a new one."""
        self.matter[area.cells] = 0
        self.room_of[area.cells] = label if label >= 0 else self.room_of.max() + 1

    def divide(self, area: Area, reached: tuple[int, ...]) -> None:
        """Lead corridors into an area until its parts are small, then draw rooms.

        `reached` are the sides on which a corridor runs; a further one begins there.
        """
        start = int(self.random.choice(reached or (int(area.side(1) > area.side(0)),)))
        along, across = start % 2, 1 - start % 2
        n, length = area.side(across), area.side(along)
        is_shallow = length < self.length(8, 14) and self.chance(0.8)
        if reached and (n < self.length(12, 26) or is_shallow):
            self.fill(area, start, reached)
            return
        breadth = _n(self.breadth_m * self.random.uniform(0.8, 1.25))
        begin = int((n - breadth) * self.random.uniform(0.3, 0.7))
        corridor = area.part(across, begin, begin + breadth)
        ends = [side for side in reached if side % 2 == along]
        self.carve(corridor, self.beyond(corridor, ends[0]) if ends and self.chance(0.6) else -1)
        self.corridors.append(corridor)
        if length > _n(16) and self.chance(0.5):
            at = int(length * self.random.uniform(0.3, 0.7))
            self.carve(corridor.part(along, at, length))
            self.gate(corridor.part(along, at, at + self.wall), across)
        for end in ends:
            if self.beyond(corridor, end) != self.beyond(corridor.along(end, 3, length), end):
                self.gate(corridor.along(end, 0, self.wall), across)
        low, high = area.part(across, 0, begin), area.part(across, begin + breadth, n)
        self.divide(low, (across + 2, *(side for side in reached if side != across + 2)))
        self.divide(high, (across, *(side for side in reached if side != across)))

    def beyond(self, area: Area, side: int) -> int:
        """Return the room in front of the middle of a side."""
        (a, b), (c, d) = area.along(side, -2, 0)
        return int(self.room_of[(a + c) // 2, (b + d) // 2])

    def gate(self, wall: Area, axis: int) -> None:
        """Draw a wall across a corridor, with a door in it."""
        width = min(self.length(0.9, 2.2), int(0.8 * wall.side(axis)))
        begin = (wall.side(axis) - width) // 2
        self.matter[wall.cells], self.room_of[wall.cells] = _WALL, -1
        self.open(wall.part(axis, begin, begin + width))

    def open(self, area: Area) -> None:
        """Make a part of a wall free."""
        self.matter[area.cells] = 0
        self.doors.append(area)

    def fill(self, area: Area, side: int, reached: tuple[int, ...]) -> None:
        """Draw rooms along a side, or along that and the other one, or one hall."""
        axis, other = 1 - side % 2, (side + 2) % 4
        depth, n = area.side(side % 2), area.side(axis)
        both = other in reached and depth > _n(6)
        is_deep = depth > _n(9) and n < _n(22) and other not in reached
        if self.chance(0.5 if is_deep else 0.15):
            self.room(area, side, is_hall=True)
            return
        middle = depth if other in reached else min(depth, self.length(3.5, 9))
        middle = int(depth * self.random.uniform(0.4, 0.6)) if both else middle
        rows = [(area.along(side, 0, middle), side)]
        rows += [(area.along(side, middle, depth), other)] if both else []
        for row, door_side in rows:
            at, varied = 0, self.random.integers(2)
            while n - at > _n(1.5):
                width = _n(self.room_m * (1 + varied * self.random.uniform(-0.5, 0.8)))
                width = width if n - at - width > _n(1.5) else n - at
                if self.chance(0.92):
                    self.room(row.part(axis, at, at + width), door_side, is_hall=False)
                at += width

    def room(self, area: Area, side: int, *, is_hall: bool) -> None:
        """Draw a room, with doors on a side, or with that side open."""
        axis, half = 1 - side % 2, max(1, self.wall // 2)
        n, depth = area.side(axis), area.side(side % 2)
        inner = area.along(side, self.wall, depth - half).part(axis, half, n - half)
        self.carve(inner)
        self.rooms.append(inner)
        for _ in range(self.random.integers(1, 4) if is_hall else 1 + self.chance(0.15)):
            kind = self.random.random()
            width = self.length(0.75, 1.1) if kind < 0.75 else self.length(1.2, 2.0)
            if kind > (0.6 if is_hall else 0.9):
                width = int(n * self.random.uniform(0.3, 1.0))
            width = min(width, n - 2 * half)
            spare = (n - 2 * half - width) * self.random.choice([0.1, 0.9, self.random.random()])
            begin = half + int(spare)
            self.open(area.along(side, 0, self.wall).part(axis, begin, begin + width))
        wall = area.along(side, self.wall, depth - half).part(axis, -half, half)
        if self.chance(0.6) and (self.room_of[wall.part(axis, -2, 0).cells] >= 0).all():
            begin = int((wall.side(side % 2) - 20) * self.random.random())
            self.open(wall.part(side % 2, begin, begin + 18))  # to the room before

    def put(self, thing: Area) -> None:
        """Put furniture into free cells: a block, or its legs."""
        seen = self.matter[thing.cells]
        mask = seen == 0
        if self.chance(0.4):
            mask[2:-2] = mask[:, 2:-2] = False
        seen[mask] = _FURNITURE

    def scatter(self, room: Area, mean: float) -> None:
        """Put chairs anywhere, and half as many things against the walls, some square to them."""
        for _ in range(self.random.poisson(mean)):
            row, col = self.random.integers(room.low, room.high).tolist()
            self.put(Area((row, col), (row + self.length(0.1, 0.3), col + self.length(0.1, 0.3))))
        for _ in range(self.random.poisson(mean / 2)):
            depth, length = self.length(0.3, 0.9), self.length(0.8, 2.5)
            depth, length = (length, depth) if self.chance(0.15) else (depth, length)
            side = int(self.random.integers(4))
            at = int(max(0, room.side(1 - side % 2) - length) * self.random.random())
            self.put(room.along(side, 0, depth).part(1 - side % 2, at, at + length))

    def furnish(self, room: Area) -> None:
        """Put furniture into a room, and what rooms of some kinds have."""
        area_m2 = room.side(0) * room.side(1) * _CELL_M * _CELL_M
        self.scatter(room, area_m2 * self.clutter / 3)
        long = int(room.side(1) > room.side(0))
        n, breadth = room.side(long), room.side(1 - long)
        kind = self.random.integers(7) if area_m2 > 12 else 0
        if kind == 1:  # a table with chairs
            table = room.part(0, room.side(0) // 3, 2 * room.side(0) // 3)
            table = table.part(1, room.side(1) // 3, 2 * room.side(1) // 3)
            self.put(table)
            for side in range(4):
                for at in range(4, table.side(1 - side % 2) - 8, 14):
                    self.put(table.along(side, -9, -4).part(1 - side % 2, at, at + 6))
        elif kind == 2:  # rows of seats
            for row in range(room.low[0] + 20, room.high[0] - 20, self.length(0.8, 1.2)):
                for col in range(room.low[1] + 20, room.high[1] - 20, 12):
                    self.put(Area((row, col), (row + 2, col + 2)))
        elif kind in {3, 4}:  # benches, or the partitions of cubicles
            step, thick = self.length(1.8, 3.2), 1 if kind == 4 else self.length(0.5, 0.9)
            reach = int(breadth * self.random.uniform(0.25, 0.5))
            away = self.length(0.6, 1.2) if self.chance(0.5) else 0
            for at in range(step, n - step // 2, step):
                for side in (1 - long, 3 - long)[: 1 + self.chance(0.6)]:
                    self.put(room.along(side, away, away + reach).part(long, at, at + thick))

    def poses(self) -> FloatArray:
        """Return where the robot scans from: in corridors and in most rooms."""
        entered = self.random.uniform(0.4, 1.0)
        visited = [room for room in self.rooms if self.chance(entered)]
        counts = [max(area.side(0), area.side(1)) // 24 for area in self.corridors]
        counts += [area.side(0) * area.side(1) // 1600 for area in visited]
        found: FloatArray = np.concatenate(
            [
                self.random.uniform(*area, (3 + count, 2))
                for area, count in zip(self.corridors + visited, counts, strict=True)
            ]
        )
        is_free: BoolArray = self.matter[tuple(found.astype(int).T)] == 0
        return found[is_free]


@njit(cache=True)
def _scan(matter, poses, rays, reach):  # type: ignore[no-untyped-def] # noqa: ANN001, ANN202
    """Count the rays that cross each cell, and that end in it.

    `rays` holds three random numbers of each ray: where it begins, what glass does, roughness.
    """
    seen, hit = np.zeros(matter.shape, np.int32), np.zeros(matter.shape, np.int32)
    for k in range(len(poses)):
        for ray in range(rays.shape[1]):
            angle = 2 * math.pi * (ray + rays[k, 0, 0]) / rays.shape[1]
            by_row, by_col = math.sin(angle) * 0.7, math.cos(angle) * 0.7
            row, col = poses[k]
            for _ in range(int(reach / 0.7)):
                row, col = row + by_row, col + by_col
                r, c = int(row), int(col)
                if not (1 < r < matter.shape[0] - 2 and 1 < c < matter.shape[1] - 2):
                    break
                if matter[r, c] == 0 or (matter[r, c] == _GLASS and rays[k, ray, 1] < 0.7):
                    seen[r, c] += 1
                    continue
                off = (rays[k, ray, 2] - 0.5) * 2.6
                hit[int(row + by_row * off), int(col + by_col * off)] += 1
                break
    return seen, hit


def generated(seed: int) -> Building:
    """Return a floor with corridors, rooms and furniture, as scans from inside it show it."""
    random = np.random.default_rng(seed)
    floor = _Floor(random)
    matter = floor.matter
    panes = random.random(np.array(matter.shape) // 40 + 1).repeat(40, axis=0).repeat(40, axis=1)
    glass = panes[: matter.shape[0], : matter.shape[1]] < random.choice([0.0, 0.1, 0.3])
    matter[glass & (matter == _WALL)] = _GLASS
    thick = ndimage.distance_transform_edt(matter != 0) > 3 * floor.wall
    matter[thick & glass] = 0  # the yard
    poses = floor.poses()
    rays = random.random((len(poses), int(random.integers(300, 900)), 3))
    seen, hit = _scan(matter, poses, rays, floor.length(7, 25))
    occupied = hit > 0.3 * seen
    occupied &= random.random(matter.shape) > random.choice([0.0, 0.1, 0.3])
    known = np.where(occupied, 2, np.where(seen > 0, 1, 0))
    style = random.random()
    if style < 0.2:
        known[ndimage.binary_dilation(occupied)] = 2
    elif style < 0.3:
        known[occupied] = 0
    known, true = _drifted(known, floor.room_of, random)
    step = int(random.choice([1, 1, 2, 5, 5]))  # some maps have larger cells
    known, true = (_coarse(each, step) for each in (known, true))
    probability = np.array([0.5, 0.0, 1.0], np.float32)[known]
    grid = hn.OccupancyGrid(probability, hn.Frame(step * _CELL_M), robot_radius_m=0)
    return Building(f"generated {seed}", grid, true, (known == 1) & (true >= 0), None, None)


def _coarse(values: IntArray, step: int) -> IntArray:
    """Return the greatest value in each square: a wall before free, a room before none."""
    rows, cols = (n // step for n in values.shape)
    squares = values[: rows * step, : cols * step].reshape(rows, step, cols, step)
    greatest: IntArray = squares.max(axis=(1, 3))
    return greatest


def _drifted(
    known: IntArray, room_of: IntArray, random: np.random.Generator
) -> tuple[IntArray, IntArray]:
    """Turn every second map, and bend all slowly."""
    angle = random.uniform(-math.pi / 4, math.pi / 4) * random.integers(2)
    side = int(math.hypot(*known.shape)) if angle else 0
    size = max(known.shape[0], side), max(known.shape[1], side)
    rows, cols = np.indices(size) - np.array(size)[:, None, None] / 2
    cosine, sine = math.cos(angle), math.sin(angle)
    rows, cols = cosine * rows - sine * cols, sine * rows + cosine * cols
    bend = random.uniform(0, 6)
    (by_col, by_row), phase = 2 * math.pi / random.uniform(300, 900, 2), random.uniform(0, 6, 2)
    at = (
        rows + bend * np.sin(cols * by_col + phase[0]) + known.shape[0] / 2,
        cols + bend * np.sin(rows * by_row + phase[1]) + known.shape[1] / 2,
    )
    known = ndimage.map_coordinates(known, at, order=0, cval=0)
    room_of = ndimage.map_coordinates(room_of, at, order=0, cval=-1)
    used = (np.flatnonzero(known.any(axis=axis)) for axis in (1, 0))
    window = tuple(slice(max(0, each[0] - 5), each[-1] + 6) for each in used)
    return known[window], room_of[window]
