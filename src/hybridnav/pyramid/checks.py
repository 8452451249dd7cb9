"""Checks of what a pyramid is built with, and of vertices."""

from __future__ import annotations

import math
import operator
from typing import TYPE_CHECKING, get_args

import numpy as np

from hybridnav.errors import InvalidValueError, brief
from hybridnav.pyramid.record import Linkage

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._typing import LongArray
    from hybridnav.grid import OccupancyGrid, RoomLabels
    from hybridnav.pyramid.steering import Resists


def checked_settings(merge_distance_m: float, linkage: str, seed: int) -> int:
    """Return the seed if all settings of a pyramid are in range."""
    try:
        is_none = math.isnan(merge_distance_m)
    except TypeError:
        is_none = True
    if is_none or merge_distance_m <= 0:
        raise InvalidValueError(
            f"merge distance must be a positive number of metres, got {brief(merge_distance_m)}"
        )
    if linkage not in get_args(Linkage):
        raise InvalidValueError(
            f"linkage must be one of {', '.join(get_args(Linkage))}, got {brief(linkage)}"
        )
    try:
        return operator.index(seed)
    except TypeError:
        raise InvalidValueError(f"seed must be a whole number, got {seed!r:.80}") from None


def checked_most_cells(most_cells: int) -> int:
    """Return the most cells of a region."""
    try:
        found = 0 if isinstance(most_cells, bool) else operator.index(most_cells)
    except TypeError:
        found = 0
    if found < 1:
        raise InvalidValueError(
            f"regions have at most {brief(most_cells)} cells, expected a whole number >= 1"
        )
    return found


def check_fit(grid: OccupancyGrid, rooms: RoomLabels | None, resistance: Resists | None) -> None:
    """Refuse rooms and resistances of other grids, and both together."""
    if rooms is not None and rooms.label_of.shape != grid.shape:
        raise InvalidValueError(
            f"rooms are labels of {rooms.label_of.shape} cells, the grid has {grid.shape}"
        )
    if resistance is not None and (rooms is not None or resistance.shape != grid.shape):
        raise InvalidValueError(
            f"a resistance was given with rooms or for a map not of {grid.shape} cells: give "
            "it alone, made from this map"
        )


def checked_vertices(vertices: ArrayLike, level: int, n_vertices: int) -> LongArray:
    """Return indices of vertices of a level as an array."""
    found = np.asarray(vertices)
    if found.size == 0:
        return found.astype(np.int64)
    if not np.issubdtype(found.dtype, np.integer):
        raise InvalidValueError(f"vertices must be whole numbers, got {vertices!s:.80}")
    if found.min() < 0 or found.max() >= n_vertices:
        raise InvalidValueError(
            f"vertices of level {level} are 0 to {n_vertices - 1}, got {vertices!s:.80}"
        )
    return found.astype(np.int64)
