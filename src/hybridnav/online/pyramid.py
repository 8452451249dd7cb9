"""A pyramid that follows its map."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._copies import frozen
from hybridnav.errors import InvalidValueError
from hybridnav.online.dense import pyramid_of, state_of
from hybridnav.online.draft import Draft, State
from hybridnav.online.identities import settle
from hybridnav.online.tiles import Box
from hybridnav.pyramid.record import SURVIVES
from hybridnav.pyramid.window import Criterion

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._typing import LongArray
    from hybridnav.grid import OccupancyGrid
    from hybridnav.pyramid import DualGraphPyramid, Linkage

MOST_SIDE = 32_767
"""Rows or columns of the largest grid: steps between cells have two bytes."""
_ALIGNED = 1e-6
"""Part of a cell by which the origins of two grids may lie beside whole cells."""


@dataclass(frozen=True, eq=False)
class OnlinePyramid:
    """One version of a pyramid that follows its map: the places and all levels below them.

    `update` returns the next version and leaves this one as it is: both share what did not change.
    A version is a value: plans on an older one go on, in any thread.

    Places have numbers that last from version to version. They are not indices of `pyramid`, the
    dense form of a version, in which `place_numbers` states the number of each vertex.

    Examples
    --------
    >>> from dataclasses import replace
    >>> from hybridnav.online import OnlinePyramid
    >>> grid = hn.example_map("figure1")
    >>> online = OnlinePyramid.of(hn.DualGraphPyramid.build(grid, merge_distance_m=1.0))
    >>> online.n_places, online.place_at((5, 13))
    (10, 0)
    >>> probability = grid.probability.copy()
    >>> probability[5, 13] = 1.0
    >>> update = online.update(replace(grid, probability=probability), changed=(5, 13, 5, 13))
    >>> update.version.place_at((5, 13)), update.changed
    (-1, (0, 2))
    """

    grid: OccupancyGrid
    """The map of this version."""
    merge_distance_m: float
    linkage: Linkage
    seed: int
    low: tuple[int, int]
    """Row and column of cell (0, 0) among the cells of the first version, negative where the map
    has grown."""
    _criterion: Criterion = field(repr=False)
    _state: State = field(repr=False)

    @classmethod
    def of(cls, pyramid: DualGraphPyramid) -> OnlinePyramid:
        """Make the first version from a pyramid; its places are numbered as the vertices are.

        Parameters
        ----------
        pyramid
            A pyramid without rooms; levels above its places are left out.

        Raises
        ------
        InvalidValueError
            When the pyramid was built with rooms, or its grid is too long.
        """
        if pyramid.rooms is not None:
            raise InvalidValueError(
                "the pyramid was built with rooms, expected one without: "
                "build it without rooms, and find them on a version"
            )
        _check_sides(pyramid.grid)
        # Loading a version needs no decimation.
        from hybridnav.pyramid.decimation import squared_limit  # noqa: PLC0415

        limit = squared_limit(pyramid.merge_distance_m, pyramid.grid.resolution_m)
        return cls(
            pyramid.grid,
            pyramid.merge_distance_m,
            pyramid.linkage,
            pyramid.seed,
            (0, 0),
            Criterion(pyramid.linkage, limit, pyramid.seed),
            state_of(pyramid),
        )

    def update(self, grid: OccupancyGrid, *, changed: ArrayLike | None = None) -> Update:
        """Return the next version, that of a changed map.

        Fields of places that hold no changed cell keep their cells, their levels and their numbers,
        unless they are merged with what was contracted anew beside them. All others are dissolved
        into cells and contracted again, with the fields beside them taking part whole.

        Parameters
        ----------
        grid
            The map now, with the cells of this version's grid: its frame may have its origin whole
            rows and columns lower, and it may be larger on any side.
        changed
            Where measurements changed, as a mask, bool (rows, cols) of the new grid, or as a box of
            four numbers, the least row and column and the greatest. The robot's radius is added on
            all sides, and cells by which the map grew always count. Only there are cells compared.
            None compares all cells, as do grids with another radius or other thresholds.

        Returns
        -------
        Update
            The next version, and what became of the places.

        Raises
        ------
        InvalidValueError
            When the grid has cells of another size or at other points, or does not cover the one of
            this version, or `changed` is no mask and no box of it.
        """
        rows, cols = self._shift(grid)
        low = self.low[0] - rows, self.low[1] - cols
        whole = Box(0, 0, *grid.shape)
        box = _box_of(changed, grid)
        if box is None or _settings(grid) != _settings(self.grid) or grid.least_island_m2 > 0:
            box = whole
        old = Box(0, 0, *self.grid.shape).moved(rows, cols)
        # Obstacles in new cells reach into those at the former rim.
        apart = old.narrowed(_reach(grid), whole)
        inside = box.common(apart)
        boxes = [*_outside(apart, whole), *([] if inside.is_empty else [inside])]
        draft = Draft(self._state, self._criterion)
        for part in boxes:
            draft.change(part.moved(*low), grid.classes[part.inside(whole)])
        events = settle(draft)
        version = replace(self, grid=grid, low=low, _state=draft.close())
        return Update(version, *events)

    def _shift(self, grid: OccupancyGrid) -> tuple[int, int]:
        """Return the rows and columns by which cell (0, 0) lies lower than before, once checked."""
        old, new = self.grid.frame, grid.frame
        if (old.resolution_m, old.yaw_rad) != (new.resolution_m, new.yaw_rad):
            raise InvalidValueError(
                f"the grid has cells of {new.resolution_m:g} m with yaw {new.yaw_rad:g}, expected "
                f"{old.resolution_m:g} m and {old.yaw_rad:g}: build a new pyramid"
            )
        exact = [-value for value in old.position_of(*new.origin_m)]
        rows, cols = map(round, exact)
        if max(abs(exact[0] - rows), abs(exact[1] - cols)) > _ALIGNED:
            raise InvalidValueError(
                f"the origin of the grid lies {exact[0]:g} rows and {exact[1]:g} columns lower, "
                "expected whole numbers: keep the cells where they are"
            )
        if (
            min(rows, cols) < 0
            or rows + self.grid.shape[0] > grid.shape[0]
            or cols + self.grid.shape[1] > grid.shape[1]
        ):
            raise InvalidValueError(
                f"the grid of {grid.shape} cells, {rows} rows and {cols} columns lower, does not "
                f"cover the one before, of {self.grid.shape} cells: mark lost cells as unexplored"
            )
        _check_sides(grid)
        return rows, cols

    @property
    def n_places(self) -> int:
        """Places of the version."""
        return int(self._state.vertex_ends[SURVIVES])

    @property
    def n_levels(self) -> int:
        """Levels up to that of the places, the base included."""
        return int(np.count_nonzero(self._state.vertex_ends[1:SURVIVES])) + 1

    def place_at(self, cell: tuple[int, int]) -> int:
        """Return the number of the place that holds a cell (row, col) of the grid.

        -1 for an occupied cell and for one outside the grid.
        """
        row, col = cell[0] + self.low[0], cell[1] + self.low[1]
        return int(self._state.tiles.read(Box(row, col, row + 1, col + 1))["place"][0, 0])

    def receptive_field(self, place: int) -> LongArray:
        """Return the cells of a place, int64 (n, 2), (row, col) of the grid, in the order of rows.

        Raises
        ------
        InvalidValueError
            When the version has no such place.
        """
        if not self._state.places.has(place):
            raise InvalidValueError(
                f"there is no place {place!r:.40} in this version, expected one of its "
                f"{self.n_places}: an update states what became of a place"
            )
        box = Box(*self._state.places.read([place])[0]["box"].tolist())
        cells = np.argwhere(self._state.tiles.read(box)["place"] == place)
        found: LongArray = cells + np.array(box[:2]) - np.array(self.low)
        return found

    @cached_property
    def pyramid(self) -> DualGraphPyramid:
        """The version as a pyramid of dense arrays; on large maps this takes far longer than an
        update.

        Raises
        ------
        InvalidValueError
            When cells of the grid changed outside what an update stated.
        """
        return pyramid_of(self._state, self._box(), self)

    @cached_property
    def place_numbers(self) -> LongArray:
        """int64 (n_places,), the number of the place of each vertex of the last level of
        `pyramid`."""
        rows, cols = self.pyramid[-1].cells.T
        place = self._state.tiles.read(self._box())["place"]
        return frozen(place[rows, cols].astype(np.int64))

    def _box(self) -> Box:
        return Box(0, 0, *self.grid.shape).moved(*self.low)


@dataclass(frozen=True, eq=False)
class Update:
    """A new version, and what became of the places of the one before, by number.

    Examples
    --------
    >>> from hybridnav.online import OnlinePyramid
    >>> grid = hn.OccupancyGrid(np.zeros((3, 5)), robot_radius_m=0)
    >>> version = OnlinePyramid.of(hn.DualGraphPyramid.build(grid))
    >>> wall = np.array([0.0, 0.0, 1.0, 0.0, 0.0])
    >>> update = version.update(hn.OccupancyGrid(np.tile(wall, (3, 1)), robot_radius_m=0))
    >>> update.died, update.split
    ((0,), {0: (1, 2)})
    """

    version: OnlinePyramid
    """The new version."""
    born: tuple[int, ...]
    """Places that are none of the old ones; their numbers are new."""
    died: tuple[int, ...]
    """Old places that are no more."""
    merged: dict[int, int]
    """Those of them most of whose cells went into another place, with that place."""
    split: dict[int, tuple[int, ...]]
    """Old places of which several new ones mostly consist, with these."""
    changed: tuple[int, ...]
    """Places that kept their number, and most of their cells, but not all that they were."""


def _box_of(changed: ArrayLike | None, grid: OccupancyGrid) -> Box | None:
    """Return the box of the cells that a change may touch, once checked; None for all."""
    if changed is None:
        return None
    given = np.asarray(changed)
    if given.dtype == np.bool_ and given.shape == grid.shape:
        rows, cols = np.flatnonzero(given.any(axis=1)), np.flatnonzero(given.any(axis=0))
        if not len(rows):
            return Box(0, 0, 0, 0)
        box = Box(int(rows[0]), int(cols[0]), int(rows[-1]) + 1, int(cols[-1]) + 1)
    elif given.shape == (4,) and np.issubdtype(given.dtype, np.integer):
        low_row, low_col, high_row, high_col = given.tolist()
        if not (
            0 <= low_row <= high_row < grid.shape[0] and 0 <= low_col <= high_col < grid.shape[1]
        ):
            raise InvalidValueError(
                f"changed is the box {tuple(given.tolist())}, expected the least row and column "
                f"and the greatest, inside {grid.shape} cells"
            )
        box = Box(low_row, low_col, high_row + 1, high_col + 1)
    else:
        raise InvalidValueError(
            f"changed cells are an array of {given.dtype} of shape {given.shape}, expected a mask "
            f"of {grid.shape} cells or a box of four whole numbers: the least row and column, and "
            "the greatest"
        )
    return box.widened(_reach(grid)).common(Box(0, 0, *grid.shape))


def _reach(grid: OccupancyGrid) -> int:
    """Return the cells within which an obstacle decides on the class of a cell, and one more."""
    return math.ceil(grid.robot_radius_m / grid.resolution_m) + 1


def _settings(grid: OccupancyGrid) -> tuple[Any, ...]:
    """Return what decides on the class of a cell beside its probability."""
    return (
        grid.free_threshold,
        grid.occupied_threshold,
        grid.robot_radius_m,
        grid.least_island_m2,
    )


def _outside(inner: Box, outer: Box) -> list[Box]:
    """Return the boxes that make up an outer box without an inner one."""
    low, high = inner.low_row, inner.high_row
    boxes = [
        Box(outer.low_row, outer.low_col, low, outer.high_col),
        Box(high, outer.low_col, outer.high_row, outer.high_col),
        Box(low, outer.low_col, high, inner.low_col),
        Box(low, inner.high_col, high, outer.high_col),
    ]
    return [box for box in boxes if not box.is_empty]


def _check_sides(grid: OccupancyGrid) -> None:
    if max(grid.shape) > MOST_SIDE:
        raise InvalidValueError(
            f"the grid has {grid.shape} cells, expected at most {MOST_SIDE} rows and columns: "
            "divide the map"
        )
