"""Which rooms and doors lists and pictures show: no rays of a scan, no nameless pockets."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Literal

import numpy as np

from hybridnav._base.rows import connected_parts
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.maps import CellClass, RoomLabels
from hybridnav.maps.clearance import clearance_cells
from hybridnav.pyramid import Level

LEAST_WIDTH_M = 1.0
"""Mean width below which a space is listed only if the robot can enter it, in metres."""
_LEAST_AREA_M2 = 1.0
"""Area below which a space without a name is a pocket, in square metres: the least area of a room
that is found."""
FOUND_NAME = re.compile(r"room-\d+")
"""Names that `find_rooms` gives. Who gave another name wants to see it."""


@dataclass(frozen=True, eq=False)
class Listing:
    """Spaces of a map that are listed: rooms, and connected nameless free cells."""

    space_of: IntArray
    """int32 (rows, cols), the space of each free cell as measured: its room, or a number from
    `n_rooms` on for each connected set of cells in no room; -1 for other cells."""
    is_listed: BoolArray
    """bool (n_spaces,), spaces that are listed."""
    begins: BoolArray
    """bool (n_spaces,), spaces in which a robot may begin: wide ones, the largest, and rooms with a
    name of their own. What free cells join with one has a way in."""

    @classmethod
    def of(cls, labels: RoomLabels, level: Level) -> Listing:
        """Find what is listed.

        A room is left out if it is narrower than 1 m in the mean and has no way in: such rooms are
        rays of a laser through glass. One with a name of its own is always listed. A
        space without a name has to be wide enough and enterable, so that pockets between outlines
        make no doors.

        `level`: the room level of a pyramid that was built with them.
        """
        from scipy import ndimage  # noqa: PLC0415 - most imports of the package need no rooms

        n_rooms = len(labels.names)
        is_free = level.grid.measured == CellClass.FREE
        nameless, n_nameless = ndimage.label(is_free & (labels.label_of < 0))
        space_of = np.where(is_free, labels.label_of, -1).astype(np.int32)
        space_of[nameless > 0] = nameless[nameless > 0] + (n_rooms - 1)
        n_spaces = n_rooms + n_nameless
        areas = np.bincount(space_of[is_free], minlength=n_spaces)
        is_wide = _mean_widths(space_of, areas) * level.grid.resolution_m >= LEAST_WIDTH_M
        begins = is_wide | (areas == areas.max(initial=1))
        own = [FOUND_NAME.fullmatch(name) is None for name in labels.names]
        is_own = np.array(own, np.bool_)
        begins[:n_rooms] |= is_own
        can_enter = _enterable(space_of[tuple(level.cells.T)], level, begins)
        side_m = level.grid.resolution_m
        is_large = areas * (side_m * side_m) >= _LEAST_AREA_M2
        is_listed = is_wide & can_enter & is_large
        is_listed[:n_rooms] = (is_wide | can_enter)[:n_rooms] | is_own
        return cls(space_of, is_listed, begins)


def _mean_widths(space_of: IntArray, areas: LongArray) -> FloatArray:
    """Return the mean width of each space in cells: four times the mean distance to its rim, which
    is exact for a strip."""
    padded = np.pad(space_of, 1, constant_values=-1)
    inner = padded[1:-1, 1:-1]
    is_rim = np.zeros(space_of.shape, dtype=np.bool_)
    for beside in (padded[2:, 1:-1], padded[:-2, 1:-1], padded[1:-1, 2:], padded[1:-1, :-2]):
        is_rim |= beside != inner
    inside = space_of >= 0
    depths = clearance_cells(is_rim)[inside] + 0.5
    total = np.bincount(space_of[inside], weights=depths, minlength=len(areas))
    return 4 * total / np.maximum(areas, 1)


def _enterable(space_of: IntArray, level: Level, begins: BoolArray) -> BoolArray:
    """Return the spaces that free cells join with one in which a robot is, at the robot's radius.

    `space_of`: int32 (n_vertices,), the space of each vertex; `begins`: as in `Listing`.
    """
    is_free = level.classes == CellClass.FREE
    parts = free_components(level)[is_free]
    spaces = space_of[is_free]
    joined = np.bincount(parts, weights=begins[spaces], minlength=1) > 0
    return np.bincount(spaces, weights=joined[parts], minlength=len(begins)) > 0


def free_components(level: Level) -> LongArray:
    """Return the connected set of each vertex of a level, int64 (n_vertices,), joined by arcs
    between free ones alone."""
    arcs = level.arcs[(level.classes == CellClass.FREE)[level.arcs].all(axis=1)]
    return connected_parts(arcs, level.n_vertices)


# Kinds of rooms by their shapes: corridors and halls.


WIDEST_CORRIDOR_M = 4.0
"""Breadth above which nothing is a corridor, in metres."""
_LONG = 4.0
"""Length of a corridor, in breadths."""
_LEAST_SPACE_M2 = 1.0
"""Free space of no room in a hole of one, that is space beyond walls and no furniture."""
_NARROWEST_M = 1.2
"""Mean width below which a long room is a ray of a scan, in metres."""
_SMOOTH = 0.62
"""Least mean width of a corridor by its area and outline, over its breadth: rays have long
outlines."""
_LEAST_HALL_M2 = 90.0


@dataclass(frozen=True)
class RoomKind:
    """Kind of a room by its shape.

    Examples
    --------
    >>> from hybridnav.rooms import RoomKind
    >>> RoomKind("corridor", 0.9).name
    'corridor'
    """

    name: Literal["corridor", "hall"]
    """A corridor is at least four times as long as it is broad, and at most 4 m broad; a hall has
    90 m² or more, furniture included."""
    confidence: float
    """From 0.5 for a room at these limits to 1 for one far from them; no measured share."""


def kinds_of(
    label_of: IntArray, is_free: BoolArray, resolution_m: float
) -> tuple[RoomKind | None, ...]:
    """Return the kind of each room, None for one that is just a room.

    Holes of a room that hold no other one, and no free space to stand in, are filled first, for
    furniture makes nothing narrow. The breadth is that of the widest tenth of a room, since alcoves
    and crossings widen a corridor at a few points.

    `label_of`: int32 (rows, cols), the room of each cell, -1 for none; `is_free`: bool (rows,
    cols), free cells as measured; `resolution_m`: side of a cell in metres.
    """
    from scipy import ndimage  # noqa: PLC0415 - most imports of the package need no rooms

    found: list[RoomKind | None] = []
    label = np.where(is_free, label_of, np.int32(-1))
    for number, window in enumerate(ndimage.find_objects(label + 1)):
        if window is None:
            found.append(None)
            continue
        cells = np.pad(label[window], 1, constant_values=-1)
        own = cells == number
        hole_of, _ = ndimage.label(ndimage.binary_fill_holes(own) & ~own)
        n_labelled, n_free = (
            np.bincount(hole_of.ravel(), inner.ravel())
            for inner in (cells >= 0, np.pad(is_free[window], 1))
        )
        is_filled = (n_labelled == 0) & (n_free * resolution_m**2 < _LEAST_SPACE_M2)
        inside = own | (hole_of > 0) & is_filled[hole_of]
        depths_m = (clearance_cells(~inside)[inside]) * resolution_m
        area_m2 = np.count_nonzero(inside) * (resolution_m * resolution_m)
        broadest_m, breadth_m = 2 * depths_m.max(), 2 * float(np.quantile(depths_m, 0.9))
        sides = sum(np.count_nonzero(inside ^ np.roll(inside, 1, axis)) for axis in (0, 1))
        outline_m = sides * resolution_m * np.pi / 4  # that of a disc of as many sides
        is_narrow = breadth_m <= WIDEST_CORRIDOR_M and 4 * depths_m.mean() >= _NARROWEST_M
        is_smooth = 2 * area_m2 >= _SMOOTH * breadth_m * outline_m
        length = area_m2 / (broadest_m * broadest_m)
        if is_narrow and is_smooth and length >= _LONG:
            found.append(RoomKind("corridor", float(1 - 0.5 * _LONG / length)))
        elif area_m2 >= _LEAST_HALL_M2:
            found.append(RoomKind("hall", 1 - 0.5 * _LEAST_HALL_M2 / area_m2))
        else:
            found.append(None)
    return tuple(found)
