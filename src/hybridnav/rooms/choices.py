"""What people choose on a map: where to stand in a room, and the doors that lead somewhere."""

from __future__ import annotations

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.maps import NO_ROOM, CellClass
from hybridnav.maps.room_labels import Point
from hybridnav.rooms.level import Door, Rooms
from hybridnav.rooms.listing import free_components

_REACH_M = 2.0
"""Metres from a room within which a point on furniture or a wall means it."""


def free_point(rooms: Rooms, name: str, near: Point | None = None) -> Point:
    """Return where the robot may stand in a room: the centre of the nearest free cell.

    Cells that furniture walls off do not count, unless there are no others.

    Parameters
    ----------
    rooms
        The rooms of a map.
    name
        One of them.
    near
        A point `(x, y)` in metres, map frame; None for that of the room.

    Returns
    -------
    tuple of float
        `(x, y)` in metres, map frame; `near` itself if the robot may stand there.

    Raises
    ------
    InvalidValueError
        When there is no such room, or the robot's radius leaves no free cell of it.

    Examples
    --------
    >>> from hybridnav.rooms.choices import free_point
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 1.0, 0.0, 0.0]]), robot_radius_m=0)
    >>> labels = hn.RoomLabels(("kitchen",), np.zeros((1, 4)))
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    >>> free_point(topology.rooms, "kitchen", (1.2, 0.5))
    (2.5, 0.5)
    """
    grid, parts = rooms.grid, rooms.vertices_of(name)
    if not len(parts):
        raise InvalidValueError(
            f"room {name!r:.80} has no free cell for this robot radius, "
            f"{grid.robot_radius_m:g} m: choose a smaller one, or another room"
        )
    joined = free_components(rooms.level)
    free = rooms.is_free
    sizes = np.bincount(joined[free], weights=rooms.level.areas[free])[joined[parts]]
    best = parts[sizes == sizes.max()]
    cells = np.concatenate([rooms.level.receptive_field(int(part)) for part in best])
    point = rooms.point_of(name) if near is None else near
    if (cells == grid.frame.cell_of(*point)).all(axis=1).any():
        return point
    away = cells + 0.5 - grid.frame.positions_of(np.array([point]))[0]
    x, y = grid.frame.points_of(cells[int(np.argmin((away * away).sum(axis=1)))]).tolist()
    return x, y


def room_near(rooms: Rooms, point: Point) -> str | None:
    """Return the room that a person means by a point: the one that it lies in, or on whose
    furniture or wall it lies.

    Parameters
    ----------
    rooms
        The rooms of a map.
    point
        `(x, y)` in metres, map frame.

    Returns
    -------
    str or None
        The name; None on free cells in no room, and farther than 2 m from all rooms.

    Examples
    --------
    >>> from hybridnav.rooms.choices import room_near
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 1.0, 0.0]]), robot_radius_m=0)
    >>> labels = hn.RoomLabels(("kitchen",), np.array([[0, -1, -1]]))
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, rooms=labels))
    >>> room_near(topology.rooms, (1.4, 0.5)), room_near(topology.rooms, (2.5, 0.5))
    ('kitchen', None)
    """
    grid, of = rooms.grid, rooms.labels.label_of
    name = rooms.at(point)
    row, col = grid.frame.cell_of(*point)
    is_on_map = 0 <= row < of.shape[0] and 0 <= col < of.shape[1]
    if name is not None or (is_on_map and grid.measured[row, col] == CellClass.FREE):
        return name
    reach = round(_REACH_M / grid.resolution_m)
    top, left = (max(0, at - reach) for at in (row, col))
    window = of[top : max(0, row + reach + 1), left : max(0, col + reach + 1)]
    cells = np.argwhere(window != NO_ROOM)
    away = cells + 0.5 + (top, left) - grid.frame.positions_of(np.array([point]))[0]
    squared = (away * away).sum(axis=1)
    if not len(cells) or squared.min() > reach * reach:
        return None
    return rooms.names[int(window[tuple(cells[int(np.argmin(squared))])])]


def leading_doors(rooms: Rooms) -> list[Door]:
    """Return the listed doors that the robot passes and that lead to another room, by number.

    Doors to a nook without a name lead nowhere if one room alone lies beside it.

    Examples
    --------
    >>> from hybridnav.rooms.choices import leading_doors
    >>> grid = hn.OccupancyGrid(np.zeros((30, 90)), robot_radius_m=0)
    >>> of = np.repeat([[0, 1, -1]], 30, axis=1).repeat(30, axis=0)
    >>> rooms = hn.TopologicalMap(
    ...     hn.DualGraphPyramid.build(grid, rooms=hn.RoomLabels(("a", "b"), of))
    ... ).rooms
    >>> [door.rooms for door in rooms.listed_doors]
    [('a', 'b'), ('b', None)]
    >>> [door.rooms for door in leading_doors(rooms)]
    [('a', 'b')]
    """
    doors = [door for door in rooms.listed_doors if door.passable]
    arcs = rooms.level.arcs
    sides = [set(arcs[door.arcs[0].index].tolist()) for door in doors]
    beside: dict[int, set[int]] = {}
    for pair in sides:
        for vertex in pair:
            beside.setdefault(vertex, set()).update(pair - {vertex})
    named = rooms.label_of_vertex >= 0
    return [
        door
        for door, pair in zip(doors, sides, strict=True)
        if all(named[vertex] or len(beside[vertex]) > 1 for vertex in pair)
    ]
