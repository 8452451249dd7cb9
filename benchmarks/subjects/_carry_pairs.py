"""Pairs of maps with a known transform, and who would carry which name: shares no code with the
method."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy import ndimage

import hybridnav as hn

if TYPE_CHECKING:
    from collections.abc import Callable

    from hybridnav._base.typing import AnyArray, ByteArray, FloatArray
    from hybridnav.rooms import Transform

UNEXPLORED = 2
CODES = {hn.CellClass.OCCUPIED: 0, hn.CellClass.FREE: 1, hn.CellClass.UNEXPLORED: UNEXPLORED}
NEAR_M = 0.5
LEAST_TO_CARRY, LEAST_RIGHT, LEAST_SEEN = 0.6, 0.4, 0.5
"""A person carries a name if at least 0.6 of what both maps show of either room lies in the other,
and half of the old room is shown. It is wrong to carry one if either share is below 0.4."""


@dataclass(frozen=True)
class Changes:
    """What differs between a map and its later one, beside the frame."""

    angle_rad: float | None = None
    """None for any."""
    crop: float = 1.0
    """Share of width and height that is kept."""
    drift: float = 0.0
    """Largest displacement by waves, about, as a share of the longer side of the map."""
    furniture: float = 0.0
    """Share of free space in which new boxes stand; half of the old small obstacles go."""
    walls: int = 0
    """Pieces of 1.5 to 4 m that are built or torn down."""
    shut: float = 0.0
    """Share of the doors that are shut."""
    noise: float = 0.02
    """Share of the free cells beside walls that are taken for walls."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two maps, and where each point of the newer one lies on the older one."""

    old: hn.OccupancyGrid
    new: hn.OccupancyGrid
    to_old: Callable[[FloatArray], FloatArray]
    angle_rad: float
    """From the old frame to the new one."""

    @cached_property
    def free_points(self) -> tuple[FloatArray, FloatArray]:
        """Some free points of the new map: where they lie on the old one, and on the new one."""
        cells = np.argwhere(self.new.measured == hn.CellClass.FREE)[::97]
        points = self.new.frame.points_of(cells)
        return self.to_old(points), points

    def error(self, transform: Transform) -> tuple[float, float]:
        """Return the median error of free points in metres, and that of the angle in degrees."""
        old, new = self.free_points
        away = np.hypot(*(transform.moved(old) - new).T)
        turn = math.remainder(transform.rotation_rad - self.angle_rad, math.tau)
        return float(np.median(away)), abs(math.degrees(turn))


def changed(grid: hn.OccupancyGrid, seed: int, what: Changes, doors: FloatArray) -> Pair:
    """Return a map with a later one that is made of it.

    Parameters
    ----------
    grid
        The map.
    seed
        For all that is drawn.
    what
        What differs.
    doors
        float64 (n, 3), the middle of each door and its width in metres, of which some are shut.
    """
    rng = np.random.default_rng(seed)
    angle = rng.uniform(-np.pi, np.pi) if what.angle_rad is None else what.angle_rad
    shift = rng.uniform(-50, 50, 2)
    cells = _altered(grid, what, doors, rng)
    points = grid.frame.points_of(np.argwhere(cells != UNEXPLORED))
    low, high = points.min(axis=0), points.max(axis=0)
    middle, side_m = (low + high) / 2, float((high - low).max())
    phase = rng.uniform(0, 2 * np.pi, 2)
    cosine, sine = math.cos(angle), math.sin(angle)
    turn = np.array([[cosine, -sine], [sine, cosine]])

    def to_old(new: FloatArray) -> FloatArray:
        plain = (new - shift) @ turn
        waves = (plain - middle)[:, ::-1] / side_m * 2 * np.pi + phase
        moved: FloatArray = plain + what.drift * side_m * np.sin(waves)
        return moved

    there = points @ turn.T + shift
    low, high = there.min(axis=0) - 1, there.max(axis=0) + 1
    size = (high - low) * what.crop
    low = low + rng.uniform(0, 1, 2) * (high - low - size)
    rows, cols = np.ceil(size[::-1] / grid.resolution_m).astype(int)
    frame = hn.Frame(grid.resolution_m, (float(low[0]), float(low[1])))
    every = frame.points_of(np.indices((rows, cols)).reshape(2, -1).T)
    classes = looked_up(cells, grid, to_old(every), UNEXPLORED).reshape(rows, cols)
    probability = np.array([1.0, 0.0, 0.5], np.float32)[classes]
    new = hn.OccupancyGrid(probability, frame, name=f"{grid.name} later", robot_radius_m=0)
    return Pair(grid, new, to_old, angle)


def classes_of(grid: hn.OccupancyGrid) -> ByteArray:
    """Return 0 for occupied, 1 for free, 2 for unexplored cells."""
    cells = np.full(grid.shape, UNEXPLORED, np.uint8)
    for measured, code in CODES.items():
        cells[grid.measured == measured] = code
    return cells


def looked_up(
    array: AnyArray, grid: hn.OccupancyGrid, points: FloatArray, nothing: int
) -> AnyArray:
    """Return the values of an array of a grid at points."""
    cells = grid.frame.cells_of(points)
    inside = ((cells >= 0) & (cells < grid.shape)).all(axis=1)
    found = np.full(len(points), nothing, array.dtype)
    found[inside] = array[tuple(cells[inside].T)]
    return found


def _altered(
    grid: hn.OccupancyGrid, what: Changes, doors: FloatArray, rng: np.random.Generator
) -> ByteArray:
    """Return the classes of cells with other furniture, walls and doors."""
    cells, side = classes_of(grid), grid.resolution_m
    shut = doors[rng.random(len(doors)) < what.shut]
    for x, y, width_m in shut:
        row, col = grid.frame.cells_of([x, y])
        away = np.hypot(*(np.indices(cells.shape) - np.array([row, col])[:, None, None])) * side
        cells[(away < width_m / 2 + side) & (cells == 1)] = 0
    if what.furniture:
        part_of, count = ndimage.label(cells == 0, np.ones((3, 3)))
        sizes = np.bincount(part_of.ravel())
        gone = (sizes < 1.7 / side) & (rng.random(count + 1) < 0.5)
        gone[0] = False
        cells[gone[part_of]] = 1
        free = np.argwhere(cells == 1)
        left = what.furniture * len(free)
        while left > 0:
            at, half = free[rng.integers(len(free))], rng.uniform(0.15, 0.6, 2) / side
            low, high = np.maximum(at - half, 0).astype(int), (at + half).astype(int) + 1
            box = cells[low[0] : high[0], low[1] : high[1]]
            box[box == 1] = 0
            left -= 4 * half[0] * half[1]
    for _ in range(what.walls):
        rim = np.argwhere((cells == 0) & ndimage.binary_dilation(cells == 1))
        at, long = rim[rng.integers(len(rim))], rng.uniform(0.75, 2.0) / side
        half = np.array([long, 0.1 / side]) if rng.random() < 0.5 else np.array([0.1 / side, long])
        low, high = np.maximum(at - half, 0).astype(int), (at + half).astype(int) + 1
        box = cells[low[0] : high[0], low[1] : high[1]]
        built = rng.random() < 0.5
        box[box == (1 if built else 0)] = 0 if built else 1
    edge = ndimage.binary_dilation(cells == 0) & (cells == 1)
    cells[edge & (rng.random(cells.shape) < what.noise)] = 0
    return cells


@dataclass(frozen=True)
class Truth:
    """Who would carry what."""

    to_carry: dict[str, str]
    """The new room of each old one whose name a person carries."""
    allowed: set[tuple[str, str]]
    """Old and new rooms of which it is not wrong to carry the name."""


def truth_of(pair: Pair, old: hn.RoomLabels, new: hn.RoomLabels) -> Truth:
    """Judge by the cells of the new map, each looked up where it lies on the old one."""
    cells = np.argwhere(classes_of(pair.new) != UNEXPLORED)
    there = pair.to_old(pair.new.frame.points_of(cells))
    was = looked_up(classes_of(pair.old), pair.old, there, UNEXPLORED)
    room = looked_up(old.label_of, pair.old, there, -1)
    is_free = classes_of(pair.new)[tuple(cells.T)] == 1
    now = np.where(is_free, new.label_of[tuple(cells.T)], -1)
    n_old, n_new = len(old.names), len(new.names)
    shown = (was == 1) & (room >= 0)
    seen_old = np.bincount(room[shown], minlength=n_old)
    seen_new = np.bincount(now[(was != UNEXPLORED) & (now >= 0)], minlength=n_new)
    met = shown & (now >= 0)
    both = np.zeros((n_old, n_new))
    np.add.at(both, (room[met], now[met]), 1)
    old_cells = old.label_of[(classes_of(pair.old) == 1) & (old.label_of >= 0)]
    scale = (pair.new.resolution_m / pair.old.resolution_m) ** 2
    visible = seen_old * scale / np.maximum(np.bincount(old_cells, minlength=n_old), 1)
    share = np.minimum(
        both / np.maximum(seen_old, 1)[:, None], both / np.maximum(seen_new, 1)[None, :]
    )
    sure = (share >= LEAST_TO_CARRY) & (visible >= LEAST_SEEN)[:, None]
    right = share >= LEAST_RIGHT
    return Truth(
        {old.names[i]: new.names[j] for i, j in np.argwhere(sure).tolist()},
        {(old.names[i], new.names[j]) for i, j in np.argwhere(right).tolist()},
    )


def doors_to_carry(
    pair: Pair, truth: Truth, old: hn.Rooms, new: hn.Rooms
) -> tuple[dict[int, set[int]], set[tuple[int, int]]]:
    """Return the old doors that a person carries, each with the new ones that it may be, and the
    pairs of which it is not wrong to carry the number.

    A new door is an old one if its middle lies within half a metre of it, on the old map, and one
    of its rooms has a name that a person carries there. It is not wrong to carry the number to one
    whose boundary passes within a metre, be it a gap: the door is shut.
    """
    found: dict[int, set[int]] = {}
    allowed: set[tuple[int, int]] = set()
    others = new.doors
    middles = pair.to_old(np.array([door.position for door in others]).reshape(-1, 2))
    ends = np.array([new.door_ends(door.number) for door in others]).reshape(-1, 2)
    lines = pair.to_old(ends).reshape(-1, 2, 2)
    for door in old.doors:
        if door.is_gap:
            continue
        heirs = {truth.to_carry[room] for room in door.rooms if room in truth.to_carry}
        at = np.array(door.position)
        for other, middle, (one, two) in zip(others, middles, lines, strict=True):
            along = np.clip(((at - one) @ (two - one)) / max((two - one) @ (two - one), 1e-9), 0, 1)
            if min(np.hypot(*(one + along * (two - one) - at)), np.hypot(*(middle - at))) < 1:
                allowed.add((door.number, other.number))
            same = not other.is_gap and heirs & set(other.rooms)
            if same and np.hypot(*(middle - at)) < NEAR_M:
                found.setdefault(door.number, set()).add(other.number)
    return found, allowed
