"""Fields to route on: regions, a level of the pyramid above the places."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.portals.options import DEFAULT_OPTIONS

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray
    from hybridnav.portals.options import PortalOptions
    from hybridnav.pyramid import DualGraphPyramid, Level


def routing_levels(
    pyramid: DualGraphPyramid, enterable: BoolArray, options: PortalOptions = DEFAULT_OPTIONS
) -> Iterator[Level]:
    """Yield the levels of a pyramid to route on, the best one first.

    The first is that of the regions, or where a place is much larger than a region, the next one
    below without such fields; then all levels below follow.

    Parameters
    ----------
    pyramid
        The pyramid of a map; it goes on above the places.
    enterable
        bool (rows, cols), cells that may be entered, in whole fields.
    options
        How many regions there are at least.
    """
    most_cells = -(-max(int(enterable.sum()), 1) // options.least_regions)
    largest = options.largest_field_factor * most_cells
    pyramid = pyramid.with_regions(most_cells)
    for index in range(pyramid.region_level, -1, -1):
        level = pyramid[index]
        if np.bincount(level.field_of[enterable]).max(initial=0) <= largest:
            yield level


def compact_labels(
    field_of: NDArray[np.int16 | np.int32], enterable: BoolArray
) -> NDArray[np.int16 | np.int32]:
    """Number the fields of the cells that may be entered from 0, in their order.

    Parameters
    ----------
    field_of
        int32 (rows, cols), the field of each of these cells.
    enterable
        bool (rows, cols).

    Returns
    -------
    NDArray
        (rows, cols), -1 for all other cells; int16 where that is enough.

    Raises
    ------
    InvalidValueError
        When a cell that may be entered is in no field.
    """
    if field_of.shape != enterable.shape or (field_of[enterable] < 0).any():
        raise InvalidValueError("every cell that may be entered must be in a field")
    is_used = np.zeros(int(field_of.max(initial=-1)) + 1, dtype=np.bool_)
    is_used[field_of[enterable]] = True
    number = np.cumsum(is_used) - 1
    fits = len(is_used) == 0 or number[-1] <= np.iinfo(np.int16).max
    label = np.full(field_of.shape, -1, dtype=np.int16 if fits else np.int32)
    label[enterable] = number[field_of[enterable]]
    return label
