"""What is closed for one query, and the cells that it takes away."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from hybridnav._copies import copies_alike
from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._typing import AnyArray, BoolArray, FloatArray, LongArray
    from hybridnav.grid import Frame
    from hybridnav.topology import TopologicalMap

_SHAPES = ("Polygon", "MultiPolygon", "LineString", "LinearRing", "MultiLineString")
_FEWEST_POINTS = 3
_SLACK_CELLS = 1e-6
"""Depth to which rounding alone may take an area into a cell: 50 nm of a cell of 5 cm, where
coordinates 1,000 km from the frame's origin are known to 0.1 nm."""
_FARTHEST_CELLS = 1e12
"""Coordinates beyond this many cells from the map are taken for a mistake."""
_CHUNK = 1 << 16
"""Squares compared with an area in one call; together with the answer it bounds the memory."""
_QUARTERS = np.array([[0, 0], [0, 1], [1, 0], [1, 1]])


@copies_alike
@dataclass(frozen=True, eq=False)
class Blocked:
    """What is closed for one query: arcs, places, cells, and areas in metres.

    Cells, arcs and places are taken as they are. Areas are obstacles: the robot keeps its radius
    (`grid.robot_radius_m`) off them, as it does off occupied cells.

    Parameters
    ----------
    arcs
        Ids of arcs. No move crosses the boundary of a closed arc: of each two cells that face each
        other across it one is closed. Which ones is chosen to keep other arcs open (a second door
        between the same places), then to cost few free cells, closed or cut off from the rest of
        their place; only a cell that two doors share may close both. Moves past a point where four
        places meet lie on no boundary. A self-loop joins a place to itself and cannot be closed.
    places
        Ids of places; all the cells of their receptive fields are closed.
    cells
        `(row, col)`, shape (n, 2).
    polygons
        Each a shapely `Polygon`, `MultiPolygon`, `LineString` or `MultiLineString`, or the corners
        of a polygon as `(x, y)`, shape (n, 2); metres, map frame. Holes stay open, and so does what
        lies outside the map. A cell is closed when the inside of its square lies nearer than the
        robot's radius to the area, or, with a radius of 0, meets it. A line has no inside: with a
        radius of 0 a line along a side between two cells closes the one with the higher index (as
        `Frame.cells_of` does), so that no path passes a line wherever it is drawn.

    Raises
    ------
    InvalidValueError
        When ids are not integers, cells are not integers of shape (n, 2), or an area has fewer than
        three points, is not finite, intersects itself or is of another kind.
    """

    arcs: Sequence[int] = ()
    places: Sequence[int] = ()
    cells: ArrayLike = ()
    polygons: Sequence[BaseGeometry | ArrayLike] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "arcs", _checked_ids("arcs", self.arcs))
        object.__setattr__(self, "places", _checked_ids("places", self.places))
        object.__setattr__(self, "cells", _checked_cells(self.cells))
        if isinstance(self.polygons, BaseGeometry | str) or not hasattr(self.polygons, "__iter__"):
            raise InvalidValueError(
                f"polygons must be a sequence of areas, got {_shown(self.polygons)}"
            )
        object.__setattr__(self, "polygons", tuple(map(_checked_area, self.polygons)))

    def cells_of(self, topology: TopologicalMap) -> LongArray:
        """Find the cells that may not be entered; occupied ones may be among them.

        Parameters
        ----------
        topology
            The map that the ids belong to.

        Returns
        -------
        LongArray
            int64 (n,), flat cells `row * cols + col`, sorted, each once.

        Raises
        ------
        InvalidValueError
            When the map has no such arc, place or cell, an arc is a self-loop, or an area lies
            absurdly far off the map.
        """
        grid = topology.grid
        places = _found("place", self.places, topology.place_ids)
        arcs = _found("arc", self.arcs, topology.arc_ids)
        cells = _inside(np.asarray(self.cells), grid.shape)
        fields = [topology.level.receptive_field(place) for place in places.tolist()]
        flat = [rowcol[:, 0] * grid.shape[1] + rowcol[:, 1] for rowcol in (cells, *fields)]
        single = np.concatenate([*flat, *_cells_on_boundaries(topology, arcs)])
        runs = [np.stack([single, single + 1], axis=1)]
        radius_cells = grid.robot_radius_m / grid.resolution_m
        for area in cast("Sequence[BaseGeometry]", self.polygons):
            in_cells = _in_cells(area, grid.frame)
            runs += [_runs_near(part, grid.shape, radius_cells) for part in in_cells]
        return _cells_in_runs(np.concatenate(runs))


def as_blocked(value: Blocked | BaseGeometry | Mapping[str, Any]) -> Blocked:
    """Read what is closed from any form that a caller may give it in.

    Parameters
    ----------
    value
        A `Blocked`, one shapely geometry, or a mapping from the names of its fields.

    Raises
    ------
    InvalidValueError
        When it is of another kind, has other names, or its content is not valid.
    """
    if isinstance(value, Blocked):
        return value
    if isinstance(value, BaseGeometry):
        return Blocked(polygons=(value,))
    names = tuple(Blocked.__dataclass_fields__)
    if not isinstance(value, Mapping):
        raise InvalidValueError(
            f"blocked must be a Blocked, a shapely geometry or a mapping, got {_shown(value)}"
        )
    if unknown := [name for name in value if name not in names]:
        raise InvalidValueError(
            f"blocked takes {', '.join(names)}, got {', '.join(map(str, unknown)):.80}"
        )
    return Blocked(**value)


def _shown(value: object) -> str:
    """A value in one short line."""
    return " ".join(f"{value!r:.80}".split())


def _checked_ids(name: str, ids: Sequence[int]) -> tuple[int, ...]:
    try:
        array = np.asarray(list(ids))
    except (TypeError, ValueError):
        array = np.empty((0, 0))
    if array.shape == (0,):
        return ()
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise InvalidValueError(f"{name} must be a sequence of integer ids, got {_shown(ids)}")
    return tuple(array.tolist())


def _checked_cells(cells: ArrayLike) -> AnyArray:
    try:
        array = np.array(cells)
    except ValueError:
        array = np.empty(())
    if array.size == 0 and array.ndim:
        array = np.empty((0, 2), dtype=np.int64)
    if array.ndim != 2 or array.shape[1] != 2 or array.dtype.kind not in "iu":  # noqa: PLR2004
        raise InvalidValueError(
            f"cells must be integers (row, col) of shape (n, 2), got {_shown(cells)}"
        )
    array.flags.writeable = False
    return array


def _checked_area(area: BaseGeometry | ArrayLike) -> BaseGeometry:
    shape = area if isinstance(area, BaseGeometry) else _polygon(area)
    if shape.geom_type not in _SHAPES:
        raise InvalidValueError(f"an area must be one of {', '.join(_SHAPES)}, got {_shown(area)}")
    if shape.is_empty:
        raise InvalidValueError(f"an area needs points, got {_shown(area)}")
    if not np.isfinite(shapely.get_coordinates(shape)).all():
        raise InvalidValueError(f"an area needs finite coordinates, got {_shown(area)}")
    if not shape.is_valid:
        reason = shapely.is_valid_reason(shape)
        raise InvalidValueError(f"an area must be simple, got {_shown(area)}: {reason}")
    return shape


def _polygon(corners: ArrayLike) -> BaseGeometry:
    try:
        points = np.asarray(corners, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        points = np.empty(0)
    if points.ndim != 2 or points.shape[1] != 2:  # noqa: PLR2004
        raise InvalidValueError(
            f"a polygon must be a geometry or points (x, y) of shape (n, 2), got {_shown(corners)}"
        )
    if len(points) < _FEWEST_POINTS:
        raise InvalidValueError(
            f"a polygon needs at least three points, got {_shown(corners)}; "
            "for a line give a LineString"
        )
    if not np.isfinite(points).all():
        raise InvalidValueError(f"an area needs finite coordinates, got {_shown(corners)}")
    return shapely.Polygon(points)


def _found(what: str, ids: Sequence[int], known: LongArray) -> LongArray:
    """Dense indices of ids."""
    if not ids:
        return np.empty(0, dtype=np.int64)
    wanted = np.unique(ids)
    missing = wanted[~np.isin(wanted, known)]
    if len(missing):
        ids_are = f"ids are {known.min()} to {known.max()}" if len(known) else "it has none"
        raise InvalidValueError(f"there is no {what} {missing[0]} on this map, {ids_are}")
    return np.flatnonzero(np.isin(known, wanted))


def _inside(cells: AnyArray, shape: tuple[int, int]) -> LongArray:
    outside = ((cells < 0) | (cells >= np.array(shape))).any(axis=1)
    if outside.any():
        row, col = cells[np.argmax(outside)].tolist()
        raise InvalidValueError(
            f"cells must lie on the map of {shape[0]} x {shape[1]} cells, got ({row}, {col})"
        )
    return cells.astype(np.int64)


def _cells_on_boundaries(topology: TopologicalMap, arcs: LongArray) -> list[LongArray]:
    """Flat cells that close each of some arcs.

    A diagonal between two places across a boundary has a cell pair of that boundary among the four
    cells round its middle, and needs all four: closing one cell of each pair stops it too.
    """
    level, cols = topology.level, topology.grid.shape[1]
    loops = arcs[level.is_self_loop[arcs]]
    if len(loops):
        raise InvalidValueError(
            f"arc {topology.arc_ids[loops[0]]} is a self-loop, closing it would part no places; "
            "close the place or cells instead"
        )
    closed = []
    for arc in arcs.tolist():
        pairs = level.boundary(arc) @ np.array([cols, 1])
        if topology.grid.corner_cutting:
            # A diagonal past the end of a boundary needs no cell but its own two ends.
            closed.append(np.unique(pairs))
            continue
        ends = level.arcs[arc]
        beside = np.isin(level.arcs, ends).any(axis=1) & ~level.is_self_loop
        beside[arcs] = False
        others = [
            level.boundary(other) @ np.array([cols, 1]) for other in np.flatnonzero(beside).tolist()
        ]
        choices = _choices(pairs, others)
        costs = [_cost_of(topology, ends.tolist(), choice, others) for choice in choices]
        closed.append(choices[costs.index(min(costs))])
    return closed


def _choices(pairs: LongArray, others: list[LongArray]) -> list[LongArray]:
    """Either side of a boundary, and from each pair the cell that is less to other boundaries."""
    # The share of each other boundary that a cell closes, summed: a door of one cell counts 1.
    cells = np.concatenate([pairs[:0].ravel(), *(other.ravel() for other in others)])
    shares = np.concatenate([[], *(np.full(other.size, 1 / len(other)) for other in others)])
    known, place = np.unique(np.concatenate([pairs.ravel(), cells]), return_inverse=True)
    share = np.bincount(place[pairs.size :], weights=shares, minlength=len(known))
    heavier = np.subtract(*share[place[: pairs.size].reshape(pairs.shape)].T) > 0
    spared = np.where(heavier, pairs[:, 1], pairs[:, 0])
    return [np.unique(side) for side in (pairs[:, 0], pairs[:, 1], spared)]


def _cost_of(
    topology: TopologicalMap, places: list[int], closed: LongArray, others: list[LongArray]
) -> tuple[int, int, int]:
    """Other arcs closed as well; free cells, and all cells, closed or cut off from their place."""
    from scipy import ndimage  # noqa: PLC0415 - half a second that areas and cells do not need

    level = topology.level
    arcs = sum(bool(np.isin(other, closed).any(axis=1).all()) for other in others)
    lost = {CellClass.FREE: 0, CellClass.UNEXPLORED: 0}
    for place in places:
        field = level.receptive_field(place)
        corner = field.min(axis=0)
        is_open = np.zeros(field.max(axis=0) - corner + 1, dtype=np.bool_)
        flat = field @ np.array([topology.grid.shape[1], 1])
        is_open[tuple((field - corner).T)] = ~np.isin(flat, closed)
        pieces, _ = ndimage.label(is_open)
        largest = np.bincount(pieces.ravel())[1:].max(initial=0)
        lost[CellClass(level.classes[place])] += len(field) - int(largest)
    return arcs, lost[CellClass.FREE], sum(lost.values())


def _in_cells(area: BaseGeometry, frame: Frame) -> list[BaseGeometry]:
    """Parts of an area with x along the columns and y along the rows, one unit a cell."""
    cosine, sine = math.cos(frame.yaw_rad), math.sin(frame.yaw_rad)

    def turned(points: FloatArray) -> FloatArray:
        x, y = ((points - np.array(frame.origin_m)) / frame.resolution_m).T
        return np.stack([cosine * x + sine * y, cosine * y - sine * x], axis=1)

    with np.errstate(over="ignore", invalid="ignore"):
        position = turned(shapely.get_coordinates(area))
    if not (np.abs(position) <= _FARTHEST_CELLS).all():
        raise InvalidValueError(
            f"an area must lie within {_FARTHEST_CELLS:g} cells of the map, got {_shown(area)}"
        )
    return list(shapely.get_parts(shapely.transform(area, turned)))


def _runs_near(part: BaseGeometry, shape: tuple[int, int], radius_cells: float) -> LongArray:
    """Flat cells that an area closes, as runs `[start, stop)`, shape (n, 2).

    Squares of cells are quartered as long as the area closes some of their cells and may not close
    all: work goes with the outline of the area, not with its inside. Distances are exact, where a
    shapely buffer would cut its arcs short.
    """
    left, bottom, right, top = shapely.bounds(part).tolist()
    margin = radius_cells + 1
    low = np.floor(np.clip([bottom - margin, left - margin], 0, shape)).astype(np.int64)
    high = np.ceil(np.clip([top + margin, right + margin], 0, shape)).astype(np.int64)
    shapely.prepare(part)
    # An area closes cells that it enters deeper than rounding may take it. What is as thin as that
    # might slip between cells: for it their squares are half open and leave no gap.
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
    """Whether boxes come as near to an area as a radius.

    `intersects`, `covers` and `dwithin` are the predicates that a prepared geometry answers from
    its index; `relate` would tell inside from rim, but the slack on the boxes does that already.
    """
    boxes = shapely.box(low[:, 1], low[:, 0], high[:, 1], high[:, 0])
    if radius_cells == 0:
        return shapely.intersects(part, boxes)
    return shapely.dwithin(part, boxes, radius_cells)


def _near_throughout(
    part: BaseGeometry, low: FloatArray, high: FloatArray, radius_cells: float
) -> BoolArray:
    """Whether all points of boxes are surely as near to an area as a radius."""
    inside = shapely.covers(part, shapely.box(low[:, 1], low[:, 0], high[:, 1], high[:, 0]))
    reach = radius_cells - np.hypot(*(high - low).T) / 2
    middles = shapely.points((low + high)[:, ::-1] / 2)
    found: BoolArray = inside | (
        (reach >= 0) & shapely.dwithin(part, middles, np.maximum(reach, 0))
    )
    return found


def _rows_of(first: LongArray, last: LongArray, cols: int) -> LongArray:
    """Rows of rectangles of cells as runs of flat cells."""
    heights = last[:, 0] - first[:, 0]
    which = np.repeat(np.arange(len(first)), heights)
    down = np.arange(len(which)) - (np.cumsum(heights) - heights)[which]
    start = (first[which, 0] + down) * cols
    return np.stack([start + first[which, 1], start + last[which, 1]], axis=1)


def _cells_in_runs(runs: LongArray) -> LongArray:
    """Union of runs, expanded; nothing larger than the answer is made."""
    if not len(runs):
        return np.empty(0, dtype=np.int64)
    start, stop = runs[np.argsort(runs[:, 0])].T
    stop = np.maximum.accumulate(stop)
    begins = np.concatenate([[True], start[1:] > stop[:-1]])
    start, stop = start[begins], stop[np.concatenate([begins[1:], [True]])]
    step: LongArray = np.ones(int((stop - start).sum()), dtype=np.int64)
    step[0] = start[0]
    step[np.cumsum(stop - start)[:-1]] = start[1:] - stop[:-1] + 1
    return np.cumsum(step, out=step)
