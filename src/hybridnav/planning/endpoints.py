"""Checks of starts and goals."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.geometry import classes_at
from hybridnav.search.found import Cell, ClosedCells, PlanStatus, Pose, Position

if TYPE_CHECKING:
    from hybridnav.closures.blocked import Closable
    from hybridnav.closures.one_way import OneWayLike

Ends = tuple[tuple[FloatArray, FloatArray], tuple[Pose, Pose]]
"""Points of start and goal, float64 (2,), and positions, or poses where given or needed."""


_FREE, _UNEXPLORED = int(CellClass.FREE), int(CellClass.UNEXPLORED)
_OUTSIDE = PlanStatus.START_OUTSIDE, PlanStatus.GOAL_OUTSIDE
_REFUSED = (
    {
        CellClass.OCCUPIED: PlanStatus.START_OCCUPIED,
        CellClass.UNEXPLORED: PlanStatus.START_UNEXPLORED,
    },
    {
        CellClass.OCCUPIED: PlanStatus.GOAL_OCCUPIED,
        CellClass.UNEXPLORED: PlanStatus.GOAL_UNEXPLORED,
    },
)


def check_at(at: str) -> None:
    """Refuse a position in a room that is none of the two.

    Raises `InvalidValueError` when it is another word.
    """
    if at not in {"anywhere", "point"}:
        raise InvalidValueError(f"at must be 'anywhere' or 'point', got {brief(at)}")


def places_of_endpoints(
    grid: OccupancyGrid, poses: tuple[Pose, Pose], *, allow_unexplored: bool
) -> tuple[tuple[Cell, Cell], tuple[Position, Position], PlanStatus | None]:
    """Return the cells of start and goal, their positions, (row, col) in grid units, and the status
    of one that is not valid; `poses`: `(x, y)` in metres, map frame, and maybe a yaw."""
    (x, y, *_), (to_x, to_y, *_) = poses
    start, goal = classes_at((x, y, to_x, to_y), grid.classes, grid.frame.for_kernels)
    cells, positions, status = (start[1], goal[1]), (start[2], goal[2]), None
    if not start[0] == _FREE == goal[0]:
        status = _refused(start[0], goal[0], allow_unexplored=allow_unexplored)
    return cells, positions, status


def _refused(start: int, goal: int, *, allow_unexplored: bool) -> PlanStatus | None:
    """Return the status of a query by the classes of its ends, -1 outside the map."""
    if start < 0 or goal < 0:
        return _OUTSIDE[start >= 0]
    for of_class, refused in zip((start, goal), _REFUSED, strict=True):
        if of_class != _FREE and not (allow_unexplored and of_class == _UNEXPLORED):
            return refused[CellClass(of_class)]
    return None


def directed(
    blocked: Closable | ClosedCells | None, one_way: OneWayLike | None
) -> Closable | ClosedCells | None:
    """Return closures with directions: they are one thing from here on."""
    if one_way is None:
        return blocked
    from hybridnav.closures.blocked import Blocked, as_blocked  # noqa: PLC0415 - loads shapely
    from hybridnav.closures.one_way import OneWay  # noqa: PLC0415

    if blocked is None and isinstance(one_way, OneWay):
        return one_way  # by which the sides are found again
    given: Any = {} if blocked is None else blocked
    return as_blocked(given) | Blocked(one_way=one_way)


def refusal(
    closed: ClosedCells, cells: tuple[Cell, Cell], shape: tuple[int, int]
) -> PlanStatus | None:
    """Return the status of a query whose start or goal is closed, None if neither is."""
    if not len(closed.flat):  # directions alone
        return None
    shut = closed.holds(np.array(cells) @ [shape[1], 1])
    if not shut.any():
        return None
    return PlanStatus.START_BLOCKED if shut[0] else PlanStatus.GOAL_BLOCKED


def _numbers(given: ArrayLike) -> FloatArray:
    """Convert to float64; a single NaN for a value that is not numeric."""
    try:
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return np.full(1, np.nan)


def read_point(name: str, point: ArrayLike) -> FloatArray:
    """Return a position, float64 (2,)."""
    xy = _numbers(point)
    if xy.shape != (2,) or not (math.isfinite(xy[0]) and math.isfinite(xy[1])):
        raise InvalidValueError(
            f"{name} must be two finite coordinates (x, y) in metres, got {point!r:.80}"
        )
    return xy


def read_ends(start: ArrayLike, goal: ArrayLike, *, needs_heading: bool) -> Ends:
    """Return start and goal."""
    try:
        ends = np.asarray(start, dtype=np.float64), np.asarray(goal, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        ends = _numbers(start), _numbers(goal)
    if not needs_heading and ends[0].shape == ends[1].shape == (2,):
        first, last = ends[0].tolist(), ends[1].tolist()
        if math.isfinite(first[0] + first[1] + last[0] + last[1]):
            return ends, (tuple(first), tuple(last))
    first = _pose("start", start, ends[0], needs_heading=needs_heading)
    last = _pose("goal", goal, ends[1], needs_heading=needs_heading)
    return (first[:2], last[:2]), (tuple(first.tolist()), tuple(last.tolist()))


def _pose(name: str, given: ArrayLike, pose: FloatArray, *, needs_heading: bool) -> FloatArray:
    """Check a position or a pose."""
    if pose.shape == (2,) and not needs_heading and np.isfinite(pose).all():
        return pose
    if pose.shape != (3,) or not np.isfinite(pose).all():
        pair = "" if needs_heading else "two finite coordinates (x, y) in metres, or "
        raise InvalidValueError(
            f"{name} must be {pair}three finite numbers (x, y, yaw) in metres and radians, "
            f"got {given!r:.80}"
        )
    return pose


def read_points(name: str, points: ArrayLike, *, needs_heading: bool = False) -> FloatArray:
    """Return positions, float64 (n, 2), or with headings (n, 3); n may be 0.

    Headings that are given and not needed are left out: nothing of a batch depends on them.
    """
    rows, width = _numbers(points), 3 if needs_heading else 2
    if rows.shape in {(0,), (0, 2), (0, 3)}:
        return np.empty((0, width))
    if rows.ndim != 2 or rows.shape[1] not in {width, 3} or not np.isfinite(rows).all():  # noqa: PLR2004
        pair = "" if needs_heading else "coordinates (x, y) in metres, shape (n, 2), or "
        raise InvalidValueError(
            f"{name} must be finite {pair}poses (x, y, yaw) in metres and radians, shape (n, 3), "
            f"got {points!r:.80}"
        )
    return rows[:, :width]
