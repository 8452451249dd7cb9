"""Changes far from each other are contracted apart."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy import ndimage

from hybridnav.online import _ring_kernels
from hybridnav.online.tiles import NO_PLACE, Box

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from hybridnav._typing import BoolArray, IntArray
    from hybridnav.online.places import PlaceTable


class Group(NamedTuple):
    """Changed cells, and the places that hold them."""

    places: set[int]
    """Places that are contracted anew."""
    box: Box
    """The least box of the changed cells."""
    differs: BoolArray
    """The changed cells in it."""


def changed_groups(
    box: Box, differs: BoolArray, place: IntArray, table: PlaceTable
) -> Iterator[Group]:
    """Yield groups of changed cells that lie far enough from each other.

    Parameters
    ----------
    box
        Cells.
    differs, place
        bool and int32 of its shape, those of them that changed, and the place of each.
    table
        The places.
    """
    places = [number for number in np.unique(place[differs]).tolist() if number != NO_PLACE]
    apart, _ = ndimage.label(differs & (place == NO_PLACE), np.ones((3, 3)))
    found = [
        (rows.start, cols.start, rows.stop, cols.stop) for rows, cols in ndimage.find_objects(apart)
    ]
    low = np.tile(np.array(box[:2], np.int64), 2)
    boxes = np.concatenate(
        [
            table.read(places)["box"].astype(np.int64).reshape(-1, 4),
            np.array(found, np.int64).reshape(-1, 4) + low,
        ]
    )
    group_of = _ring_kernels.box_groups(boxes)
    row, col = np.nonzero(differs)
    at = np.searchsorted(places, place[row, col]) if places else np.zeros(len(row), np.int64)
    is_apart = place[row, col] == NO_PLACE
    at[is_apart] = len(places) + apart[row, col][is_apart] - 1
    group_of_cell = group_of[at]
    for group in np.unique(group_of).tolist():
        inside = group_of_cell == group
        rows, cols = row[inside], col[inside]
        part = Box(int(rows.min()), int(cols.min()), int(rows.max()) + 1, int(cols.max()) + 1)
        mask = np.zeros(part.shape, np.bool_)
        mask[rows - part.low_row, cols - part.low_col] = True
        members = {number for i, number in enumerate(places) if group_of[i] == group}
        yield Group(members, part.moved(*box[:2]), mask)


def place_groups(places: Sequence[int], table: PlaceTable) -> Iterator[Group]:
    """Yield groups of places that lie far enough from each other."""
    group_of = _ring_kernels.box_groups(table.read(places)["box"].astype(np.int64))
    for group in np.unique(group_of).tolist():
        members = {number for i, number in enumerate(places) if group_of[i] == group}
        yield Group(members, Box(0, 0, 0, 0), np.zeros((0, 0), np.bool_))
