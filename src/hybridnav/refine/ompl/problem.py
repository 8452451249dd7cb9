"""Corridors in the worker: cells, bounds, and the checks of states and motions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.maps import OccupancyGrid
from hybridnav.refine.motions import MotionCheck
from hybridnav.refine.ompl.client import OmplQuery, Setup

Box = tuple[int, int, int, int]
"""First and last row, first and last column of a box, the last ones exclusive."""


def boxes_of(field_of: NDArray[np.int16 | np.int32]) -> LongArray:
    """Return the smallest box of each field, int64 (n_fields, 4); see `Box`."""
    n_fields = int(field_of.max(initial=-1)) + 1
    boxes = np.zeros((n_fields, 4), dtype=np.int64)
    boxes[:, 0], boxes[:, 2] = field_of.shape
    rows, cols = np.nonzero(field_of >= 0)
    fields = field_of[rows, cols]
    np.minimum.at(boxes[:, 0], fields, rows)
    np.maximum.at(boxes[:, 1], fields, rows + 1)
    np.minimum.at(boxes[:, 2], fields, cols)
    np.maximum.at(boxes[:, 3], fields, cols + 1)
    return boxes


class Corridors:
    """Corridors of fields along paths of cells.

    Parameters
    ----------
    field_of
        int16 or int32 (rows, cols), the field of each cell, -1 for none; None where the whole map
        is the only corridor.
    widened
        Whether the first corridor has the neighbours of the passed fields too.
    """

    def __init__(
        self, field_of: NDArray[np.int16 | np.int32] | None, *, widened: bool = False
    ) -> None:
        self._field_of, self._widened = field_of, widened
        if field_of is None:
            return
        # The pairs of neighbours, in either order, each once.
        self._n_fields = int(field_of.max(initial=-1)) + 1
        keys = []
        for one, other in ((field_of[:, :-1], field_of[:, 1:]), (field_of[:-1], field_of[1:])):
            differ = (one != other) & (one >= 0) & (other >= 0)
            keys.append(one[differ].astype(np.int64) * self._n_fields + other[differ])
        pairs = np.unique(np.concatenate(keys))
        self._beside = pairs // max(self._n_fields, 1), pairs % max(self._n_fields, 1)

    def of(self, cells: LongArray) -> tuple[tuple[str, BoolArray | None], ...]:
        """Return names of corridors along a path of cells, in their order, and which fields each
        has; None for the whole map."""
        if self._field_of is None:
            return (("whole map", None),)
        tails, heads = self._beside
        passed = np.zeros(self._n_fields, dtype=np.bool_)
        passed[self._field_of[cells[:, 0], cells[:, 1]]] = True
        wider = passed.copy()
        wider[heads[passed[tails]]] = True
        wider[tails[passed[heads]]] = True
        widened = ("widened corridor", wider)
        return (widened,) if self._widened else (("corridor", passed), widened)


class Base:
    """Tables of the map that the worker makes once."""

    def __init__(self, setup: Setup) -> None:
        self.setup = setup
        field_of = setup.field_of
        self.boxes = np.empty((0, 4), np.int64) if field_of is None else boxes_of(field_of)
        self.check = MotionCheck(
            setup.grid, footprint=setup.settings.body, allow_unexplored=setup.allow_unexplored
        )


@dataclass(frozen=True, eq=False)
class SearchArea:
    """The part of the map that a query may search."""

    grid: OccupancyGrid
    inside: BoolArray | None
    """bool (rows, cols); None for the whole map."""
    box: Box
    check: MotionCheck
    allow_unexplored: bool

    @cached_property
    def bounds(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest x and y, float64 (2,) each, metres, map frame."""
        return bounds_of(self.grid, self.box)


def bounds_of(grid: OccupancyGrid, box: Box) -> tuple[FloatArray, FloatArray]:
    """Return the lowest and highest x and y of a box of cells, float64 (2,) each."""
    top, bottom, left, right = box
    corners = np.array([[top, left], [top, right], [bottom, left], [bottom, right]])
    points = grid.frame.points_of_grid(corners)
    return points.min(axis=0), points.max(axis=0)


def search_area_of(base: Base, query: OmplQuery, fields: BoolArray | None) -> SearchArea:
    """Return the corridor of some fields; for None, that of all cells."""
    setup, grid, inside = base.setup, base.setup.grid, None
    box: Box = (0, grid.shape[0], 0, grid.shape[1])
    if fields is not None and setup.field_of is not None:
        chosen = base.boxes[fields]
        box = (
            int(chosen[:, 0].min()),
            int(chosen[:, 1].max()),
            int(chosen[:, 2].min()),
            int(chosen[:, 3].max()),
        )
        part = setup.field_of[box[0] : box[1], box[2] : box[3]]
        inside = np.zeros(grid.shape, dtype=np.bool_)
        # -1, for no field, reads the last entry, which is False.
        inside[box[0] : box[1], box[2] : box[3]] = np.append(fields, False)[part]
    check = base.check.confined(inside=inside, closed=query.closed, solid=query.solid)
    return SearchArea(grid, inside, box, check, setup.allow_unexplored)
