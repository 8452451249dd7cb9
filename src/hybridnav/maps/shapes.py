"""Worlds of shapes as two grids that enclose them. Public: `ShapeGrids`, `grids_of_shapes`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.base import BaseGeometry

from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps.cells import MAX_CELLS
from hybridnav.maps.frame import Frame
from hybridnav.maps.occupancy import OccupancyGrid

_ROUNDING = 1e-9
"""Part of a cell's side up to which a shape may lie beyond a side and count as ending on it."""
_BLOCK = 64
"""Side of the first blocks that are tried, in cells: a power of two."""
_SPLITS = 4
"""Halvings of a cell that no shape holds alone, before it counts as not wholly inside."""
_QUARTERS = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])


class ShapeGrids(NamedTuple):
    """Two grids of one world of shapes, in one frame, for a robot that is a point.

    Examples
    --------
    >>> import shapely
    >>> grids = hn.grids_of_shapes(shapely.Point(1.0, 1.0), 0.1, (0, 0, 2, 2), radii_m=0.4)
    >>> hn.judge(grids.feasible, [(0.2, 0.2), (1.8, 0.2)], inner=grids.bounding).legal
    True
    """

    feasible: OccupancyGrid
    """Grid whose free cells no shape enters: each path on it is a path among the shapes."""
    bounding: OccupancyGrid
    """Grid that blocks only cells wholly inside the shapes: no path among the shapes is shorter
    than the shortest one on it."""


def grids_of_shapes(
    shapes: BaseGeometry | Sequence[BaseGeometry] | NDArray[Any],
    resolution_m: float,
    bounds: tuple[float, float, float, float],
    *,
    radii_m: ArrayLike = 0.0,
) -> ShapeGrids:
    """Rasterize shapes twice, so that the shortest paths on both grids enclose the one among them.

    Distances of cells to shapes are exact, no cell is sampled. A path may touch shapes, but pass
    neither between two that touch nor out of the bounds. A shape that ends within a billionth of a
    cell of a cell's side ends on that side.

    Parameters
    ----------
    shapes
        shapely geometries of any kind, in metres; none for an empty world.
    resolution_m
        Side of a cell in metres.
    bounds
        `(x_min, y_min, x_max, y_max)` in metres, where the robot's centre may be; the upper ones
        are extended to whole cells.
    radii_m
        Metres by which each shape is wider, one number or one a shape: a disc is a point with its
        radius, and the radius of a robot adds to all.

    Returns
    -------
    ShapeGrids
        `feasible, bounding`; both with the robot's radius 0.

    Raises
    ------
    InvalidValueError
        When a shape is not valid, a radius or the bounds are no such numbers, or there would be too
        many cells.

    Examples
    --------
    >>> import shapely
    >>> disc = shapely.Point(2.0, 2.0)
    >>> feasible, bounding = hn.grids_of_shapes(disc, 0.5, (0, 0, 4, 4), radii_m=1.2)
    >>> (feasible.classes == 0).sum(), (bounding.classes == 0).sum()
    (np.int64(32), np.int64(12))
    """
    world = _World.of(shapes, radii_m)
    frame, size = _frame_of(resolution_m, bounds)
    met, inside = world.cells(frame, size)
    feasible, bounding = (
        OccupancyGrid(cells.astype(np.float32), frame, robot_radius_m=0.0, name=f"{name} shapes")
        for cells, name in ((met, "all cells that meet"), (inside, "cells wholly inside"))
    )
    return ShapeGrids(feasible, bounding)


def _frame_of(resolution_m: float, bounds: Any) -> tuple[Frame, tuple[int, int]]:
    try:
        x_min, y_min, x_max, y_max = map(float, bounds)
        sides = np.array([y_max - y_min, x_max - x_min])
    except (TypeError, ValueError):
        sides = np.array([math.nan])
    if not ((sides > 0) & (sides < math.inf)).all():
        raise InvalidValueError(
            f"bounds are {brief(bounds)}, expected (x_min, y_min, x_max, y_max) in metres, the "
            "least first: state the part of the plane where the robot may be"
        )
    frame = Frame(resolution_m, (x_min, y_min))
    rows, cols = np.ceil(sides / frame.resolution_m - _ROUNDING).astype(np.int64).clip(1).tolist()
    if rows * cols > MAX_CELLS:
        raise InvalidValueError(
            f"bounds of {rows} x {cols} cells, a grid holds at most {MAX_CELLS}: take larger cells"
        )
    return frame, (rows, cols)


class _World(NamedTuple):
    """Shapes, cut into convex parts: the points of a cell furthest from one are its corners."""

    parts: NDArray[Any]
    """Points, lines of two points, convex polygons; object (n,)."""
    reach_m: FloatArray
    """Metres round each part that belong to its shape, float64 (n,)."""
    solid: BaseGeometry
    """Union of all polygons, prepared, so that two that share a side have no seam."""

    @classmethod
    def of(cls, shapes: Any, radii_m: ArrayLike) -> _World:
        """Check shapes and cut them."""
        given = np.atleast_1d(np.asarray(shapes, dtype=object))
        if given.ndim != 1 or not shapely.is_geometry(given).all():
            raise InvalidValueError(
                f"shapes are {brief(shapes)}, expected shapely geometries in metres: make them, or "
                "read a world by load_shapes"
            )
        bad = np.flatnonzero(~shapely.is_valid(given))
        if len(bad):
            why = shapely.is_valid_reason(given[bad[0]])
            raise InvalidValueError(
                f"shape {bad[0]} is not valid ({why:.60}), expected a valid one: mend it by "
                "shapely.make_valid"
            )
        try:
            radii = np.broadcast_to(np.asarray(radii_m, dtype=np.float64), given.shape)
        except (TypeError, ValueError):
            radii = np.array([math.nan])
        if not ((radii >= 0) & (radii < math.inf)).all():
            raise InvalidValueError(
                f"radii_m is {brief(radii_m)}, expected finite metres >= 0, one number or one for "
                f"each of {len(given)} shapes: leave it out for shapes as they are"
            )
        singles, of = shapely.get_parts(given, return_index=True)
        while (shapely.get_type_id(singles) > _POLYGON).any():  # collections of collections
            singles, deeper = shapely.get_parts(singles, return_index=True)
            of = of[deeper]
        parts = [_convex(single) for single in singles if not single.is_empty]
        of = of[~shapely.is_empty(singles)]
        solid = shapely.union_all(singles[shapely.get_type_id(singles) == _POLYGON])
        shapely.prepare(solid)
        flat: NDArray[Any] = np.concatenate([np.empty(0, object), *parts])
        return cls(flat, np.repeat(radii[of], [len(part) for part in parts]), solid)

    def cells(self, frame: Frame, size: tuple[int, int]) -> tuple[BoolArray, BoolArray]:
        """Return the cells that shapes meet, and those wholly inside, bool (rows, cols) each.

        Blocks are tried from large to small; what is decided of a block holds for all its cells.
        """
        tree, step = shapely.STRtree(self.parts), _BLOCK
        shape = tuple(-(-extent // step) for extent in size)
        met, inside = np.zeros(shape, bool), np.zeros(shape, bool)
        low = np.indices(shape).reshape(2, -1).T
        while True:
            meets, holds = self._judged(tree, frame, low, step, splits=_SPLITS * (step == 1))
            met[tuple(low.T)], inside[tuple(low.T)] = meets, holds
            if step == 1:
                return met[: size[0], : size[1]], inside[: size[0], : size[1]]
            step //= 2
            met, inside = (field.repeat(2, axis=0).repeat(2, axis=1) for field in (met, inside))
            low = _quartered(low[meets & ~holds])
            low = low[(low * step < size).all(axis=1)]

    def _judged(
        self, tree: shapely.STRtree, frame: Frame, low: LongArray, step: float, *, splits: int
    ) -> tuple[BoolArray, BoolArray]:
        """Return which blocks shapes meet, and which they hold.

        `low`: int64 (n, 2), the blocks as (row, col), in blocks; `step`: side of a block in cells;
        `splits`: how often blocks are halved that have all corners in shapes, but in no single one.
        """
        side, origin = frame.resolution_m, np.array(frame.origin_m)
        first = origin + (low[:, ::-1] * step + _ROUNDING) * side
        last = origin + ((low[:, ::-1] + 1) * step - _ROUNDING) * side
        boxes = shapely.box(*first.T, *last.T)
        # A part with an inside of its own may end on a side; a line there still parts two cells.
        is_thick = shapely.get_type_id(self.parts) == _POLYGON
        slack = np.where((self.reach_m == 0) & is_thick, 0.0, 2 * _ROUNDING * side)
        furthest = self.reach_m.max(initial=0.0) + 2 * _ROUNDING * side
        of, by = tree.query(boxes, predicate="dwithin", distance=furthest)
        apart = shapely.distance(boxes[of], self.parts[by])
        near = (apart == 0) | (apart < self.reach_m[by] + slack[by])
        of, by = of[near], by[near]
        meets, holds = np.zeros((2, len(low)), bool)
        rims = np.zeros((4, len(low)), bool)
        meets[of] = True
        known, of_known = np.flatnonzero(meets), (np.cumsum(meets) - 1)[of]
        first, last = first[known], last[known]
        corners: Any = shapely.points(
            np.stack([first, last, np.c_[first[:, 0], last[:, 1]], np.c_[last[:, 0], first[:, 1]]])
        )
        apart = shapely.distance(corners[:, of_known], self.parts[by])
        within = (apart == 0) | (apart < self.reach_m[by] - slack[by])
        holds[of[within.all(axis=0)]] = True
        if not self.solid.is_empty:
            holds |= shapely.covers(self.solid, boxes)
        if splits:
            for rim, is_in in zip(rims, within, strict=True):
                rim[of[is_in]] = True
            rest = np.flatnonzero(~holds & rims.all(axis=0))
            if len(rest):
                halves = _quartered(low[rest])
                _, held = self._judged(tree, frame, halves, step / 2, splits=splits - 1)
                holds[rest] = held.reshape(-1, 4).all(axis=1)
        return meets, holds


_POLYGON = 3
"""shapely's number of polygons; those above are of collections."""


def _convex(single: BaseGeometry) -> NDArray[Any]:
    """Return convex parts whose union is a point, line or polygon."""
    if single.geom_type in {"LineString", "LinearRing"}:
        points = shapely.get_coordinates(single)
        lines: Any = shapely.linestrings(np.stack([points[:-1], points[1:]], axis=1))
        return np.atleast_1d(lines)
    if single.geom_type == "Polygon" and not shapely.equals(single, single.convex_hull):
        return shapely.get_parts(shapely.constrained_delaunay_triangles(single))
    return np.array([single], dtype=object)


def _quartered(low: LongArray) -> LongArray:
    """Return the four blocks of half the side of each block, one block's in a row."""
    return (2 * low[:, None] + _QUARTERS).reshape(-1, 2)
