"""What the page draws over the cells, in grid units: `[x, y]` along columns and rows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav.maps import CellClass
from hybridnav.viz.places import Places

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike

    from hybridnav._base.typing import BoolArray, FloatArray
    from hybridnav.maps import OccupancyGrid, RoomLabels
    from hybridnav.pyramid import Level
    from hybridnav.topology.rooms import Door, Rooms

MOST_VERTICES = 20_000
"""Vertices of a level beyond which its graph is not sent: it would be one grey area."""
_DECIMALS = 3
_METRE_DECIMALS = 6
"""Decimals of points in metres: the page converts them there and back."""


def in_grid(points_m: ArrayLike, grid: OccupancyGrid) -> list[Any]:
    """Return points `(x, y)` in metres as `[column, row]` in grid units."""
    points = np.asarray(points_m, dtype=np.float64)
    if not points.size:
        return []
    found: list[Any] = np.round(grid.frame.positions_of(points)[..., ::-1], _DECIMALS).tolist()
    return found


def in_metres(point: Sequence[float], grid: OccupancyGrid) -> tuple[float, float]:
    """Return a point `[column, row]` in grid units as `(x, y)` in metres."""
    x, y = grid.frame.points_of_grid([point[1], point[0]]).round(_METRE_DECIMALS).tolist()
    return x, y


def known_box(grid: OccupancyGrid) -> list[int]:
    """Return the box of the cells that are not unexplored: first and last column and row."""
    known: BoolArray = grid.measured != CellClass.UNEXPLORED
    if not known.any():
        return [0, grid.shape[1], 0, grid.shape[0]]
    rows, cols = np.flatnonzero(known.any(axis=1)), np.flatnonzero(known.any(axis=0))
    return [int(cols[0]), int(cols[-1]) + 1, int(rows[0]), int(rows[-1]) + 1]


def level_graph(level: Level) -> dict[str, Any]:
    """Return positions, arcs and self-loops of a level, drawn as in the pictures of places.

    Specks of a scan's noise have no dot and no arcs. An arc runs through the middle of its
    boundary.
    """
    facts = {
        "level": level.index,
        "vertices": level.n_vertices,
        "arcs": level.n_arcs,
        "self_loops": int(level.is_self_loop.sum()),
    }
    if level.n_vertices > MOST_VERTICES:
        return facts | {"drawn": False}
    places = Places(level)
    seen = places.large[level.arcs].all(axis=1) & ~level.is_self_loop
    n_free = places.free[level.arcs].sum(axis=1)
    lines = {
        name: _lines(places.lines(seen & (n_free == free)), level.grid)
        for name, free in (("unexplored_arcs", 0), ("rim_arcs", 1), ("free_arcs", 2))
    }
    looped = level.is_self_loop & places.large[level.arcs[:, 0]]
    lines["loops"] = _lines(places.loops(looped), level.grid)
    dots = {
        name: in_grid(places.positions[mask & places.large], level.grid)
        for name, mask in (("unexplored_dots", ~places.free), ("free_dots", places.free))
    }
    areas = level.areas[places.free & places.large]
    spacing = float(np.sqrt(np.median(areas))) if len(areas) else 1.0
    return facts | {"drawn": True, "spacing": round(spacing, 2)} | lines | dots


def _lines(lines: list[FloatArray], grid: OccupancyGrid) -> list[Any]:
    return in_grid(np.stack(lines), grid) if lines else []


def map_facts(grid: OccupancyGrid, n_zooms: int) -> dict[str, Any]:
    """Return what a page needs to know of a map before it draws its cells.

    Parameters
    ----------
    grid
        The map.
    n_zooms
        Number of sizes of its tiles.
    """
    up, along = grid.frame.axes_m.tolist()
    return {
        "name": grid.name,
        "rows": grid.shape[0],
        "cols": grid.shape[1],
        "resolution_m": grid.resolution_m,
        "robot_radius_m": grid.robot_radius_m,
        "frame": {"origin": list(grid.frame.origin_m), "up": up, "along": along},
        "known": known_box(grid),
        "zooms": n_zooms,
    }


def room_facts(rooms: Rooms) -> dict[str, Any]:
    """Return names, areas and positions of rooms, and their doors without gaps; `listed` tells
    which of them the page shows unless it is asked for all."""
    grid = rooms.grid
    shown = {door.number for door in rooms.listed_doors}
    return {
        "rooms": [
            {
                "name": name,
                "area_m2": round(area, 2),
                "fits": fits,
                "listed": is_listed,
                "at": in_grid(_middle(rooms, name, centre), grid),
            }
            for name, area, fits, is_listed, centre in zip(
                rooms.names,
                rooms.areas_m2.tolist(),
                rooms.fits.tolist(),
                rooms.is_listed.tolist(),
                _centres_m(rooms.labels, grid),
                strict=True,
            )
        ],
        "doors": [
            _door(door, grid) | {"listed": door.number in shown}
            for door in rooms.doors
            if not door.is_gap
        ],
    }


def _centres_m(labels: RoomLabels, grid: OccupancyGrid) -> list[tuple[float, float]]:
    """Return the centre of the free cells of each room, `(x, y)` in metres.

    Sums of rows and columns: a tenth of the time that sorting the cells takes on 16 M of them.
    """
    rows, cols = np.nonzero((grid.measured == CellClass.FREE) & (labels.label_of >= 0))
    of, n_rooms = labels.label_of[rows, cols], len(labels.names)
    counts = np.maximum(np.bincount(of, minlength=n_rooms), 1)
    sums = [np.bincount(of, weights=at, minlength=n_rooms) for at in (rows, cols)]
    middles = np.stack(sums, axis=1) / counts[:, None] + 0.5
    points: list[list[float]] = grid.frame.points_of_grid(middles).tolist()
    return [(x, y) for x, y in points]


def _middle(rooms: Rooms, name: str, centre_m: tuple[float, float]) -> tuple[float, float]:
    """Return where a room's name stands: its centre, unless that lies in another room."""
    return centre_m if rooms.at(centre_m) == name else rooms.point_of(name)


def _door(door: Door, grid: OccupancyGrid) -> dict[str, Any]:
    return {
        "number": door.number,
        "rooms": list(door.rooms),
        "kind": door.kind,
        "passable": door.passable,
        "width_m": round(door.width_m, 2),
        "at": in_grid(door.position, grid),
    }
