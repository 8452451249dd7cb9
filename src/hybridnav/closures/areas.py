"""The cells that a closure closes: those of areas in metres, and those along boundaries of arcs."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from hybridnav._base.rows import in_runs
from hybridnav._base.trig import hypots
from hybridnav._base.typing import BoolArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, Frame, OccupancyGrid
from hybridnav.maps.occupancy import extent

if TYPE_CHECKING:
    from hybridnav.pyramid import Level


_SHAPES = ("Polygon", "MultiPolygon", "LineString", "LinearRing", "MultiLineString")
_FEWEST_POINTS = 3
_SLACK_CELLS = 1e-6
"""Greatest depth of an area in a cell by rounding alone: 50 nm in a cell of 5 cm, where coordinates
1,000 km from the frame's origin are exact to 0.1 nm."""
_FARTHEST_CELLS = 1e12
"""Cells from the map beyond which coordinates count as a mistake."""
_CHUNK = 1 << 16
"""Squares compared with an area in one call, which bounds the memory."""
_QUARTERS = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])


def checked_area(area: BaseGeometry | ArrayLike) -> BaseGeometry:
    """Return an area as a geometry that is valid, finite and of a kind that can be closed.

    Raises `InvalidValueError` when the area is not like that.
    """
    shape = area if isinstance(area, BaseGeometry) else _polygon(area)
    if shape.geom_type not in _SHAPES:
        raise InvalidValueError(f"an area must be one of {', '.join(_SHAPES)}, got {shown(area)}")
    if shape.is_empty:
        raise InvalidValueError(f"an area needs points, got {shown(area)}")
    if not np.isfinite(shapely.get_coordinates(shape)).all():
        raise InvalidValueError(f"an area needs finite coordinates, got {shown(area)}")
    if not shape.is_valid:
        reason = shapely.is_valid_reason(shape)
        raise InvalidValueError(f"an area must be simple, got {shown(area)}: {reason}")
    return shape


def _polygon(corners: ArrayLike) -> BaseGeometry:
    try:
        points = np.asarray(corners, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        points = np.empty(0)
    if points.ndim != 2 or points.shape[1] != 2:  # noqa: PLR2004
        raise InvalidValueError(
            f"a polygon must be a geometry or points (x, y) of shape (n, 2), got {shown(corners)}"
        )
    if len(points) < _FEWEST_POINTS:
        raise InvalidValueError(
            f"a polygon needs at least three points, got {shown(corners)}; "
            "for a line give a LineString"
        )
    if not np.isfinite(points).all():
        raise InvalidValueError(f"an area needs finite coordinates, got {shown(corners)}")
    return shapely.Polygon(points)


def runs_of(area: BaseGeometry, grid: OccupancyGrid, *, radius_m: float) -> LongArray:
    """Find the flat cells that an area closes on a map, as runs `[start, stop)`, shape (n, 2).

    The robot keeps the radius off the area; 0 for its centre alone.

    Raises `InvalidValueError` when the area closes no cell.
    """
    runs = runs_near(area, grid, radius_m=radius_m)
    if not len(runs):
        raise _beside(area, grid)
    return runs


def runs_near(area: BaseGeometry, grid: OccupancyGrid, *, radius_m: float) -> LongArray:
    """Find the same cells; none for an area beside the map that is near enough to close some."""
    radius_cells = radius_m / grid.resolution_m
    parts = parts_on(area, grid)
    return np.concatenate([_runs_near(part, grid.shape, radius_cells) for part in parts])


def parts_on(area: BaseGeometry, grid: OccupancyGrid) -> list[BaseGeometry]:
    """Return the parts of an area, x along the columns and y along the rows, one unit a cell.

    Raises `InvalidValueError` when no part comes as near to the map as the robot's radius.
    """
    parts = _in_cells(area, grid.frame)
    whole = shapely.box(0, 0, grid.shape[1], grid.shape[0])
    if not shapely.dwithin(parts, whole, grid.robot_radius_m / grid.resolution_m).any():
        raise _beside(area, grid)
    return parts


def _beside(area: BaseGeometry, grid: OccupancyGrid) -> InvalidValueError:
    return InvalidValueError(
        f"an area must meet the map, which spans {extent(grid)}, got {shown(area)}"
    )


def _in_cells(area: BaseGeometry, frame: Frame) -> list[BaseGeometry]:
    def turned(points: FloatArray) -> FloatArray:
        return frame.positions_of(points)[:, ::-1]

    if not (np.abs(turned(shapely.get_coordinates(area))) <= _FARTHEST_CELLS).all():
        raise InvalidValueError(
            f"an area must lie within {_FARTHEST_CELLS:g} cells of the map, got {shown(area)}"
        )
    return list(shapely.get_parts(shapely.transform(area, turned)))


def _runs_near(part: BaseGeometry, shape: tuple[int, int], radius_cells: float) -> LongArray:
    """Find the flat cells that an area closes, as runs `[start, stop)`, shape (n, 2).

    Squares of cells are quartered as long as the area closes some of their cells and may leave
    others open: the work grows with the outline of the area, not with its inside. Distances are
    exact, while a shapely buffer would cut its arcs short.
    """
    left, bottom, right, top = shapely.bounds(part).tolist()
    margin = radius_cells + 1
    low = np.floor(np.clip([bottom - margin, left - margin], 0, shape)).astype(np.int64)
    high = np.ceil(np.clip([top + margin, right + margin], 0, shape)).astype(np.int64)
    shapely.prepare(part)
    # An area closes cells that it enters deeper than by rounding. A thinner area might slip between
    # cells: for it their squares are half open and leave no gap.
    thin = radius_cells == 0 and shapely.is_empty(shapely.buffer(part, -2 * _SLACK_CELLS))
    slack = np.array([-_SLACK_CELLS if thin else _SLACK_CELLS, -_SLACK_CELLS])
    runs = [np.empty((0, 2), dtype=np.int64)]
    extent = int((high - low).max()) if (high > low).all() else 0
    stack = [(low[None], 1 << (extent - 1).bit_length())] if extent else []
    while stack:
        first, size = stack.pop()
        last = np.minimum(first + size, high)
        box = first + slack[0], last + slack[1]
        near = _near(part, *box, radius_cells)
        whole = near.copy()
        if size > 1:
            whole[near] = _near_throughout(part, box[0][near], box[1][near], radius_cells)
        runs.append(_rows_of(first[whole], last[whole], shape[1]))
        quarters = (first[near & ~whole, None] + size // 2 * _QUARTERS).reshape(-1, 2)
        quarters = quarters[(quarters < high).all(axis=1)]
        stack += [(quarters[at : at + _CHUNK], size // 2) for at in range(0, len(quarters), _CHUNK)]
    return np.concatenate(runs)


def _near(part: BaseGeometry, low: FloatArray, high: FloatArray, radius_cells: float) -> BoolArray:
    """Return whether boxes come as near to an area as a radius.

    A prepared geometry answers `intersects`, `covers` and `dwithin` from its index; `relate` would
    separate inside from rim, but the slack on the boxes does that already.
    """
    boxes = shapely.box(low[:, 1], low[:, 0], high[:, 1], high[:, 0])
    if radius_cells == 0:
        return shapely.intersects(part, boxes)
    return shapely.dwithin(part, boxes, radius_cells)


def _near_throughout(
    part: BaseGeometry, low: FloatArray, high: FloatArray, radius_cells: float
) -> BoolArray:
    """Return whether all points of boxes are certainly as near to an area as a radius."""
    inside = shapely.covers(part, shapely.box(low[:, 1], low[:, 0], high[:, 1], high[:, 0]))
    reach: Any = radius_cells - hypots(*(high - low).T) / 2  # shapely types numbers alone
    middles = shapely.points((low + high)[:, ::-1] / 2)
    return inside | ((reach >= 0) & shapely.dwithin(part, middles, np.maximum(reach, 0)))


def _rows_of(first: LongArray, last: LongArray, cols: int) -> LongArray:
    """Return the rows of rectangles of cells as runs of flat cells."""
    heights = last[:, 0] - first[:, 0]
    which = np.repeat(np.arange(len(first)), heights)
    start = in_runs(first[:, 0], heights) * cols
    return np.stack([start + first[which, 1], start + last[which, 1]], axis=1)


def shown(value: object) -> str:
    """Return a value in one short line, for messages."""
    return " ".join(f"{value!r:.80}".split())


# Boundaries of arcs, and the cells that close them.


def cells_on_boundaries(level: Level, arcs: LongArray) -> list[LongArray]:
    """Find the flat cells that close each of some arcs.

    A diagonal between two places across a boundary has a cell pair of that boundary among the four
    cells round its middle, and needs all four: closing one cell of each pair stops it too.

    `level`: the level of the arcs, places or rooms; `arcs`: int64 (n,), dense indices, each once.
    Returns the cells of each arc. Raises `InvalidValueError` when an arc is a self-loop.
    """
    grid = level.grid
    cols = grid.shape[1]
    loops = arcs[level.is_self_loop[arcs]]
    if len(loops):
        raise InvalidValueError(
            f"arc {loops[0]} of level {level.index} is a self-loop, which separates nothing; "
            "close the place or cells instead"
        )
    closed = []
    for arc in arcs.tolist():
        pairs = level.boundary(arc) @ np.array([cols, 1])
        if grid.corner_cutting:
            # A diagonal past the end of a boundary needs no cell but its own two endpoints.
            closed.append(np.unique(pairs))
            continue
        endpoints = level.arcs[arc]
        beside = np.isin(level.arcs, endpoints).any(axis=1) & ~level.is_self_loop
        beside[arcs] = False
        others = [
            level.boundary(other) @ np.array([cols, 1]) for other in np.flatnonzero(beside).tolist()
        ]
        choices = _choices(pairs, others)
        fields = [_Field(level, vertex) for vertex in endpoints.tolist()]
        costs = [_cost_of(fields, choice, others) for choice in choices]
        closed.append(choices[costs.index(min(costs))])
    return closed


def _choices(pairs: LongArray, others: list[LongArray]) -> list[LongArray]:
    """Return both sides of a boundary, and the cell of each pair that matters less to others."""
    # Sum over other boundaries of the share that a cell closes: a door of one cell counts 1.
    cells = np.concatenate([pairs[:0].ravel(), *(other.ravel() for other in others)])
    shares = np.concatenate([[], *(np.full(other.size, 1 / len(other)) for other in others)])
    known, place = np.unique(np.concatenate([pairs.ravel(), cells]), return_inverse=True)
    share = np.bincount(place[pairs.size :], weights=shares, minlength=len(known))
    heavier = np.subtract(*share[place[: pairs.size].reshape(pairs.shape)].T) > 0
    spared = np.where(heavier, pairs[:, 1], pairs[:, 0])
    return [np.unique(cells) for cells in (pairs[:, 0], pairs[:, 1], spared)]


class _Field:
    """The cells of one vertex in the window that they span."""

    def __init__(self, level: Level, vertex: int) -> None:
        rows, cols = level.receptive_field(vertex).T
        self.kind = CellClass(level.classes[vertex])
        self._corner = int(rows.min()), int(cols.min())
        self._n_cols = level.grid.shape[1]
        shape = int(rows.max()) + 1 - self._corner[0], int(cols.max()) + 1 - self._corner[1]
        self._cells = np.zeros(shape, dtype=np.bool_)
        self._cells[rows - self._corner[0], cols - self._corner[1]] = True
        self._size = len(rows)

    def lost(self, closed: LongArray) -> int:
        """Return the number of cells that are closed, or cut off from most of the field."""
        from scipy import ndimage  # noqa: PLC0415 - half a second that areas and cells do not need

        rows, cols = closed // self._n_cols - self._corner[0], closed % self._n_cols
        cols -= self._corner[1]
        shape = self._cells.shape
        inside = (rows >= 0) & (rows < shape[0]) & (cols >= 0) & (cols < shape[1])
        is_open = self._cells.copy()
        is_open[rows[inside], cols[inside]] = False
        components, _ = ndimage.label(is_open)
        return self._size - int(np.bincount(components.ravel())[1:].max(initial=0))


def _cost_of(
    fields: list[_Field], closed: LongArray, others: list[LongArray]
) -> tuple[int, int, int]:
    """Return the number of other arcs closed too, and of free and of all cells lost.

    Cells are lost if they are closed or cut off from their field.
    """
    pairs = np.concatenate([closed[:0].reshape(0, 2), *others])
    of_arc = np.repeat(np.arange(len(others)), [len(other) for other in others])
    is_shut = np.isin(pairs, closed).any(axis=1)
    arcs = len(others) - len(np.unique(of_arc[~is_shut]))
    lost = {CellClass.FREE: 0, CellClass.UNEXPLORED: 0}
    for field in fields:
        lost[field.kind] += field.lost(closed)
    return arcs, lost[CellClass.FREE], sum(lost.values())
