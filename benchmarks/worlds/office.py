"""The office: a floor plan as data, painted and then seen through a noisy scanner."""

from typing import NamedTuple

import numpy as np

from benchmarks.worlds.scan import (
    Point,
    Rect,
    glimpse,
    hide_depths,
    shadow,
    speckle,
    window,
    wobble,
)
from benchmarks.worlds.world import FREE, OCCUPIED, UNEXPLORED, World
from hybridnav._base.typing import ByteArray
from hybridnav.maps.frame import Frame

_FRAME = Frame(resolution_m=0.05, origin_m=(-3.0, -2.0))
_SHAPE = (580, 960)
_WALL_M = 0.2
_JAMB_M = 0.1
_STEP_M = 0.4
"""A doorway has no noise: it is clear but for 0.1 m of its width, 0.4 m to either side."""


class _Door(NamedTuple):
    x: float
    y: float
    along_x: bool
    """Whether the wall that holds the door runs along x."""
    width_m: float = 1.0


# Rectangles run along the middle of the walls. Rooms that share a side share a wall.
_CORRIDOR: tuple[Rect, ...] = (
    (5.6, 6.2, 29.2, 8.6),
    (5.6, 16.4, 29.2, 18.8),
    (5.6, 6.2, 8.0, 18.8),
    (26.8, 6.2, 29.2, 18.8),
)
ROOMS: dict[str, Rect] = {
    "south-west office": (0.0, 0.0, 8.6, 6.2),
    "seminar room": (8.6, 0.0, 16.8, 6.2),
    "office 1": (16.8, 0.0, 20.8, 6.2),
    "office 2": (20.8, 0.0, 24.8, 6.2),
    "office 3": (24.8, 0.0, 29.2, 6.2),
    "office 4": (0.0, 6.2, 5.6, 10.4),
    "office 5": (0.0, 10.4, 5.6, 14.6),
    "office 6": (0.0, 14.6, 5.6, 18.8),
    "north-west office": (0.0, 18.8, 8.2, 25.0),
    "secretary": (8.2, 18.8, 12.4, 25.0),
    "director": (12.4, 18.8, 17.4, 25.0),
    "laboratory": (21.4, 18.8, 29.2, 25.0),
    "kitchen": (8.0, 8.6, 13.2, 16.4),
    "meeting room": (13.2, 8.6, 18.6, 12.6),
    "sealed archive": (13.2, 12.6, 18.6, 16.4),
    "library": (21.4, 8.6, 26.8, 16.4),
    "hall": (29.2, 3.4, 42.0, 21.6),
    "reception": (37.2, 17.4, 42.0, 21.6),
}
"""`(x0, y0, x1, y1)` of each room in metres."""
_UNEXPLORED: dict[str, Rect] = {
    "lift shafts": (18.6, 8.6, 21.4, 16.4),
    "store": (17.4, 18.8, 21.4, 25.0),
}
DOORS: tuple[_Door, ...] = (
    _Door(7.2, 6.2, along_x=True),  # south-west office
    _Door(9.9, 6.2, along_x=True),  # seminar room, twice onto one corridor
    _Door(15.5, 6.2, along_x=True),
    _Door(17.8, 6.2, along_x=True),
    _Door(23.8, 6.2, along_x=True),
    _Door(26.0, 6.2, along_x=True),
    _Door(5.6, 9.3, along_x=False),
    _Door(5.6, 12.5, along_x=False),
    _Door(5.6, 15.7, along_x=False),
    _Door(6.9, 18.8, along_x=True),  # north-west office
    _Door(11.2, 18.8, along_x=True),
    _Door(12.4, 23.4, along_x=False),  # between secretary and director
    _Door(16.3, 18.8, along_x=True),
    _Door(19.4, 18.8, along_x=True),  # store, never entered
    _Door(22.7, 18.8, along_x=True),
    _Door(8.0, 10.2, along_x=False, width_m=1.4),  # kitchen
    _Door(15.9, 8.6, along_x=True),
    _Door(26.8, 14.8, along_x=False),
    _Door(29.2, 7.5, along_x=False),  # hall, three doors from the corridor
    _Door(29.2, 12.5, along_x=False, width_m=1.8),
    _Door(29.2, 17.5, along_x=False),
    _Door(37.2, 18.7, along_x=False),  # reception
    _Door(35.6, 3.4, along_x=True, width_m=1.8),  # way out
)
_PILLARS: tuple[tuple[float, float, float], ...] = (
    (32.8, 6.6, 0.9),
    (38.4, 6.6, 0.0),
    (32.8, 10.4, 0.0),
    (38.4, 10.4, 1.3),
    (32.8, 14.2, 1.2),
    (38.4, 14.2, 0.0),
    (32.8, 18.0, 0.8),
)
"""Middle of each pillar and length of the shadow behind it, metres."""
_PILLAR_M = 0.5
_CUPBOARDS: tuple[Rect, ...] = (
    (0.1, 1.2, 0.6, 4.4),
    (8.7, 1.6, 9.1, 4.2),
    (19.2, 0.1, 20.7, 0.6),
    (24.2, 0.6, 24.7, 2.6),
    (28.6, 3.2, 29.1, 5.6),
    (0.1, 6.8, 0.5, 8.8),
    (1.0, 14.0, 3.6, 14.5),
    (0.1, 15.4, 0.5, 17.6),
    (2.2, 24.4, 5.8, 24.9),
    (8.3, 20.4, 8.7, 22.6),
    (16.8, 20.6, 17.3, 24.2),
    (8.1, 15.7, 12.2, 16.3),
    (12.5, 11.4, 13.1, 14.6),
    (21.5, 9.4, 22.0, 15.6),
    (22.9, 9.4, 23.4, 12.4),
    (24.3, 9.4, 24.8, 12.4),
    (28.6, 20.4, 29.1, 24.2),
    (23.4, 21.6, 26.8, 22.4),
    (41.2, 5.0, 41.9, 8.0),
    (38.6, 18.6, 39.1, 20.4),
    (13.2, 18.3, 15.2, 18.7),
    (30.6, 21.0, 34.4, 21.5),
)
_TABLES: tuple[Rect, ...] = (
    (3.2, 2.0, 5.0, 3.2),
    (11.0, 2.2, 14.6, 3.6),
    (17.6, 2.2, 19.2, 3.2),
    (21.6, 2.4, 23.2, 3.4),
    (25.8, 1.4, 27.4, 2.4),
    (1.6, 7.2, 3.2, 8.2),
    (1.2, 11.2, 2.8, 12.2),
    (2.0, 16.6, 3.6, 17.6),
    (2.6, 20.8, 4.8, 22.2),
    (9.6, 21.2, 11.0, 22.2),
    (13.8, 21.0, 15.4, 22.2),
    (9.4, 12.2, 10.8, 13.6),
    (14.4, 10.0, 17.4, 11.2),
    (14.8, 14.0, 16.8, 15.0),
    (24.0, 13.6, 25.4, 14.6),
)
_LEG_M = 0.1
_ISLAND: tuple[tuple[float, float, float], ...] = (
    (35.3, 12.2, 0.9),
    (35.9, 12.6, 0.8),
    (35.2, 12.9, 0.7),
)
"""Discs `(x, y, radius)` in metres that were never seen from close by."""
_GLIMPSES: tuple[tuple[Point, tuple[Point, Point], float], ...] = (
    ((19.5, 17.7), ((19.85, 18.8), (18.95, 18.8)), 5.6),  # into the store
    ((35.9, 5.6), ((34.8, 3.4), (36.4, 3.4)), 4.8),  # out of the hall
)
"""Where the scanner stood, the two sides of the doorway from right to left, reach in metres."""
_HALL_VIEW: Point = (35.6, 11.0)


def office_world(*, seed: int = 0) -> World:
    """Build an office floor of 42 x 25 m at 5 cm, as a SLAM scan would map it.

    A corridor makes a loop round a core of rooms; the seminar room has two doors onto it, the hall
    three; an inner door joins secretary and director; the sealed archive has no door; the store was
    only seen from outside; the hall has pillars, an unexplored island and a way out. The unexplored
    ground outside belongs to the map: 960 x 580 cells, origin (-3, -2) m.

    `seed`: seed of the scanner's noise; the floor plan itself is always the same. Equal seeds
    produce equal bytes. Doorways stay clear over at least 0.9 m whatever the noise.
    """
    rng = np.random.Generator(np.random.PCG64(seed))
    cells = _painted()
    _scan(cells, rng)
    cells = speckle(hide_depths(wobble(cells, rng), rng), rng)
    for door in DOORS:
        _fill(cells, _opening(door, width_m=door.width_m - _JAMB_M, depth_m=_STEP_M), FREE)
    return World(cells[::-1], _FRAME, "office")


def _painted() -> ByteArray:
    """Paint the floor plan as it is, row 0 at the lowest y."""
    cells = np.full(_SHAPE, UNEXPLORED)
    _build(cells, _CORRIDOR, inside=FREE)
    for room in ROOMS.values():
        _build(cells, (room,), inside=FREE)
    for room in _UNEXPLORED.values():
        _build(cells, (room,), inside=UNEXPLORED)
    for door in DOORS:
        _fill(cells, _opening(door, width_m=door.width_m, depth_m=_WALL_M), FREE)
    for rect in _CUPBOARDS:
        _fill(cells, rect, OCCUPIED)
    for x0, y0, x1, y1 in _TABLES:
        for x, y in ((x0, y0), (x1, y0), (x0, y1), (x1, y1)):
            _fill(cells, (x, y, x, y), OCCUPIED, grow_m=_LEG_M / 2)
    for x, y, _ in _PILLARS:
        _fill(cells, (x, y, x, y), OCCUPIED, grow_m=_PILLAR_M / 2)
    return cells


def _build(cells: ByteArray, rects: tuple[Rect, ...], *, inside: np.uint8) -> None:
    """Build walls round the union of rectangles: all their walls first, then their insides."""
    for rect in rects:
        _fill(cells, rect, OCCUPIED, grow_m=_WALL_M / 2)
    for rect in rects:
        _fill(cells, rect, inside, grow_m=-_WALL_M / 2)


def _fill(cells: ByteArray, rect: Rect, value: np.uint8, *, grow_m: float = 0.0) -> None:
    cells[window(_FRAME, rect, grow_m=grow_m)] = value


def _opening(door: _Door, *, width_m: float, depth_m: float) -> Rect:
    """Return the rectangle in the middle of a door, `depth_m` deep to either side of the wall."""
    half, depth = width_m / 2, depth_m
    if door.along_x:
        return door.x - half, door.y - depth, door.x + half, door.y + depth
    return door.x - depth, door.y - half, door.x + depth, door.y + half


def _scan(cells: ByteArray, rng: np.random.Generator) -> None:
    """Free the part of unexplored ground that was seen, and hide the unseen part of the hall."""
    points = _FRAME.points_of(np.moveaxis(np.indices(_SHAPE), 0, -1))
    unexplored = cells == UNEXPLORED
    for view, jambs, reach_m in _GLIMPSES:
        seen = glimpse(points, view, jambs, reach_m=reach_m, rng=rng)
        cells[seen & unexplored] = FREE
    unseen = np.zeros(_SHAPE, dtype=np.bool_)
    for x, y, length_m in _PILLARS:
        if length_m:
            # A square pillar is up to 1.4 times as wide as its side when seen at an angle.
            unseen |= shadow(points, _HALL_VIEW, (x, y), width_m=1.4 * _PILLAR_M, length_m=length_m)
    for x, y, radius in _ISLAND:
        unseen |= ((points - (x, y)) ** 2).sum(axis=-1) < radius**2
    cells[unseen & (cells == FREE)] = UNEXPLORED
