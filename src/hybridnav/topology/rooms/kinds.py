"""Kinds of rooms by their shapes: corridors and halls."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from hybridnav.maps.clearance import clearance_cells

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, IntArray

WIDEST_CORRIDOR_M = 4.0
"""Breadth above which nothing is a corridor, in metres."""
_LONG = 4.0
"""Length of a corridor, in breadths."""
_NARROWEST_M = 1.2
"""Mean width below which a long room is a ray of a scan, in metres."""
_SMOOTH = 0.62
"""Least mean width of a corridor by its area and outline, over its breadth: rays have long
outlines."""
_LEAST_HALL_M2 = 90.0


@dataclass(frozen=True)
class RoomKind:
    """What a room is by its shape.

    Examples
    --------
    >>> from hybridnav.topology.rooms import RoomKind
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

    Holes of a room are filled first, for furniture makes nothing narrow. The breadth is that of the
    widest tenth of a room, since alcoves and crossings widen a corridor at a few points.

    Parameters
    ----------
    label_of
        int32 (rows, cols), the room of each cell, -1 for none.
    is_free
        bool (rows, cols), free cells as measured.
    resolution_m
        Side of a cell in metres.
    """
    from scipy import ndimage  # noqa: PLC0415 - most imports of the package need no rooms

    found: list[RoomKind | None] = []
    label = np.where(is_free, label_of, np.int32(-1))
    for number, window in enumerate(ndimage.find_objects(label + 1)):
        if window is None:
            found.append(None)
            continue
        inside = ndimage.binary_fill_holes(np.pad(label[window] == number, 1))
        depths_m = (clearance_cells(~inside)[inside]) * resolution_m
        area_m2 = np.count_nonzero(inside) * resolution_m**2
        broadest_m, breadth_m = 2 * depths_m.max(), 2 * float(np.quantile(depths_m, 0.9))
        sides = sum(np.count_nonzero(inside ^ np.roll(inside, 1, axis)) for axis in (0, 1))
        outline_m = sides * resolution_m * np.pi / 4  # that of a disc of as many sides
        is_narrow = breadth_m <= WIDEST_CORRIDOR_M and 4 * depths_m.mean() >= _NARROWEST_M
        is_smooth = 2 * area_m2 >= _SMOOTH * breadth_m * outline_m
        length = area_m2 / broadest_m**2
        if is_narrow and is_smooth and length >= _LONG:
            found.append(RoomKind("corridor", float(1 - 0.5 * _LONG / length)))
        elif area_m2 >= _LEAST_HALL_M2:
            found.append(RoomKind("hall", 1 - 0.5 * _LEAST_HALL_M2 / area_m2))
        else:
            found.append(None)
    return tuple(found)
