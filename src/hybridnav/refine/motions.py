"""Exact validity of states and motions of a robot against the free space of a grid."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.grid import Frame
from hybridnav.refine import _motion_kernels as kernels

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, ByteArray, FloatArray, LongArray
    from hybridnav.grid import OccupancyGrid


class MotionCheck:
    """Exact validity of states and motions of a robot against free space, in the map frame.

    A disc robot is a point on a grid that was inflated by its radius. It stays in the union of the
    closed squares of the cells that it may stand on, and never passes between two blocked cells
    that meet at a corner (unless the grid allows corner cutting). What is not a finite number, or
    lies outside the map, is not valid. Points are rounded to 2^-24 of a cell; every test of a
    straight line between rounded points is exact.

    Parameters
    ----------
    grid
        The map.
    inside
        bool (rows, cols), the cells that the base may stand on (a corridor); None for all.
        Whether a cell is blocked is judged on the whole map: a line may pass through the corner
        between two free cells outside.
    closed
        int64 (n,), flat cells that the base may not enter either; None for none.
    allow_unexplored
        Whether the base may enter unexplored cells.

    Raises
    ------
    InvalidValueError
        When `inside` does not have the shape of the map, or a closed cell lies outside it.
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        *,
        inside: BoolArray | None = None,
        closed: LongArray | None = None,
        allow_unexplored: bool = False,
    ) -> None:
        self._marks = _marks_of(
            grid, inside=inside, closed=closed, allow_unexplored=allow_unexplored
        )
        self._place = _place_of(grid.frame)

    def state_valid(self, x: float, y: float, yaw: float = 0.0) -> bool:  # noqa: ARG002
        """Whether the robot may be at a point.

        Parameters
        ----------
        x, y
            Metres, map frame.
        yaw
            Heading in radians, counter-clockwise from the x axis; of no effect on a disc.
        """
        valid: bool = kernels.point_stands(self._marks, self._place, x, y)
        return valid

    def motion_valid(self, x0: float, y0: float, x1: float, y1: float) -> bool:
        """Whether a disc robot may drive straight from one point to another.

        Parameters
        ----------
        x0, y0, x1, y1
            Metres, map frame.
        """
        valid: bool = kernels.point_runs(self._marks, self._place, x0, y0, x1, y1)
        return valid


def _marks_of(
    grid: OccupancyGrid,
    *,
    inside: BoolArray | None,
    closed: LongArray | None,
    allow_unexplored: bool,
) -> ByteArray:
    """What each cell is to the base of the robot, uint8 (rows, cols)."""
    free = grid.enterable(allow_unexplored=allow_unexplored)
    if closed is not None:
        cells = np.asarray(closed, dtype=np.int64)
        if cells.size and (cells.min() < 0 or cells.max() >= free.size):
            raise InvalidValueError(
                f"closed cells must be flat indices below {free.size}, "
                f"got {cells.min()} to {cells.max()}"
            )
        free.flat[cells] = False
    stand = free
    if inside is not None:
        if inside.shape != free.shape:
            raise InvalidValueError(
                f"the mask of a corridor must have the map's shape {free.shape}, got {inside.shape}"
            )
        stand = free & inside
    if grid.corner_cutting:
        free = np.ones_like(free)
    marks = free.view(np.uint8) + stand.view(np.uint8)
    marks.flags.writeable = False
    return marks


def _place_of(frame: Frame) -> FloatArray:
    """Where a grid lies in the map frame, as the kernels want it, float64 (6,)."""
    # The frame at the origin gives the two axes without the rounding of a far origin.
    axes = Frame(frame.resolution_m, yaw_rad=frame.yaw_rad).points_of_grid(np.eye(2))
    return np.concatenate([frame.origin_m, (axes / frame.resolution_m**2).ravel()])
