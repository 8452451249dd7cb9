"""The map frame: the one place where cells become metres and metres become cells."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.trig import cos, sin
from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.errors import InvalidValueError

_LARGEST_M = 1e150
"""Coordinates beyond are taken for this one, so that no product of them overflows."""
LEAST_RESOLUTION_M, MOST_RESOLUTION_M = 1e-4, 1e3
"""Sides that a cell may have: 0.1 mm is finer than any range sensor, and a cell of 1 km is too
coarse for any robot; other values are mistakes of units."""
FARTHEST_M = 1e9
"""Metres from the origin of the map frame within which a grid must lie: this includes any place on
Earth, in any frame, and keeps the centre of the smallest cell exact to a hundredth of its side."""
_MANY = 2.0**40
"""More cells than any map has."""


class FramePose(NamedTuple):
    """A frame in numbers."""

    resolution: float
    """Side of a cell in metres."""
    x: float
    """x of the origin, metres."""
    y: float
    """y of the origin, metres."""
    cosine: float
    """Cosine of the yaw."""
    sine: float
    """Sine of the yaw."""


@dataclass(frozen=True, slots=True)
class Frame:
    """Pose and scale of a grid in the map frame.

    Parameters
    ----------
    resolution_m
        Side of a cell in metres.
    origin_m
        The lower-left corner of cell (0, 0), `(x, y)` in metres.
    yaw_rad
        Rotation of the grid about that corner, counter-clockwise, in radians: columns run along
        `(cos yaw, sin yaw)`, rows along `(-sin yaw, cos yaw)`.

    Raises
    ------
    InvalidValueError
        When a value is not finite, the resolution is not within 0.1 mm and 1 km, or the origin
        farther than a million kilometres.

    Examples
    --------
    >>> frame = hn.Frame(resolution_m=0.5, origin_m=(1.0, 2.0))
    >>> frame.cells_of([2.2, 3.0])
    array([2, 2])
    >>> frame.points_of([2, 2])
    array([2.25, 3.25])
    """

    resolution_m: float = 1.0
    origin_m: tuple[float, float] = (0.0, 0.0)
    yaw_rad: float = 0.0
    for_kernels: FramePose = field(init=False, repr=False, compare=False)
    """The frame as kernels take it."""
    """Cosine and sine of the yaw."""

    def __post_init__(self) -> None:
        # numpy numbers may be float32, which would spoil all lengths computed from them.
        x, y = self.origin_m
        object.__setattr__(self, "resolution_m", float(self.resolution_m))
        object.__setattr__(self, "origin_m", (float(x), float(y)))
        object.__setattr__(self, "yaw_rad", float(self.yaw_rad))
        if not LEAST_RESOLUTION_M <= self.resolution_m <= MOST_RESOLUTION_M:
            raise InvalidValueError(
                f"resolution must be a positive number of metres from {LEAST_RESOLUTION_M:g} to "
                f"{MOST_RESOLUTION_M:g}, got {self.resolution_m:g}"
            )
        if not all(map(math.isfinite, (*self.origin_m, self.yaw_rad))):
            raise InvalidValueError(
                f"origin and yaw must be finite, got {self.origin_m} and {self.yaw_rad}"
            )
        if not all(abs(value) <= FARTHEST_M for value in (*self.origin_m, self.yaw_rad)):
            raise InvalidValueError(
                f"origin must lie within {FARTHEST_M:g} m, and yaw within as many radians, "
                f"got {self.origin_m} and {self.yaw_rad:g}"
            )
        turn = cos(self.yaw_rad), sin(self.yaw_rad)
        pose = FramePose(self.resolution_m, *self.origin_m, *turn)
        object.__setattr__(self, "for_kernels", pose)

    @property
    def cell_area_m2(self) -> float:
        """Area of a cell in square metres."""
        return self.resolution_m * self.resolution_m  # a power differs between processors

    @property
    def axes_m(self) -> FloatArray:
        """Vectors `(x, y)` of one row and of one column in metres, float64 (2, 2)."""
        # A frame at the origin yields them without the rounding of a far origin.
        return Frame(self.resolution_m, yaw_rad=self.yaw_rad).points_of_grid(np.eye(2))

    @property
    def per_metre(self) -> FloatArray:
        """Rows, then columns, in a metre along x and along y, float64 (2, 2)."""
        return self.axes_m / self.cell_area_m2

    def moved(self, pose: tuple[float, float, float]) -> Frame:
        """Return this frame where a pose puts the coordinates in which it is given.

        Parameters
        ----------
        pose
            `(x, y, yaw)` in metres and radians, of those coordinates in the new ones: a point p
            becomes R(yaw) p + (x, y).

        Raises
        ------
        InvalidValueError
            When the pose is not three finite numbers, or the frame would lie too far away.

        Examples
        --------
        >>> hn.Frame(0.5, (1.0, 2.0)).moved((10.0, 0.0, 0.5)).yaw_rad
        0.5
        """
        try:
            x, y, yaw = map(float, pose)
        except (TypeError, ValueError):
            raise InvalidValueError(
                f"a pose must be three numbers (x, y, yaw), got {pose!r:.80}"
            ) from None
        origin = Frame(origin_m=(x, y), yaw_rad=yaw).points_of_grid(self.origin_m[::-1])
        return Frame(self.resolution_m, (origin[0], origin[1]), self.yaw_rad + yaw)

    def points_of(self, cells: ArrayLike) -> FloatArray:
        """Return the centres of cells in the map frame.

        Parameters
        ----------
        cells
            `(row, col)` along the last axis, any leading shape.

        Returns
        -------
        FloatArray
            `(x, y)` in metres along the last axis.
        """
        return self.points_of_grid(np.asarray(cells, dtype=np.float64) + 0.5)

    def points_of_grid(self, positions: ArrayLike) -> FloatArray:
        """Return the map points of positions in grid units, where cell (0, 0) spans [0, 1] x [0,
        1].

        Parameters
        ----------
        positions
            `(row, col)` along the last axis, real numbers: cell corners are integers.

        Returns
        -------
        FloatArray
            `(x, y)` in metres along the last axis.
        """
        rowcol = np.asarray(positions, dtype=np.float64) * self.resolution_m
        along_x, along_y = rowcol[..., 1], rowcol[..., 0]
        cosine, sine = self.for_kernels[3:]
        points = np.empty_like(rowcol)
        points[..., 0] = self.origin_m[0] + cosine * along_x - sine * along_y
        points[..., 1] = self.origin_m[1] + sine * along_x + cosine * along_y
        return points

    def cells_of(self, points: ArrayLike) -> LongArray:
        """Return the cells that contain points of the map frame; they may lie outside the grid.

        A point on the side between two cells belongs to the one with the higher index.

        Parameters
        ----------
        points
            `(x, y)` in metres along the last axis, finite.

        Returns
        -------
        LongArray
            `(row, col)` along the last axis.

        Raises
        ------
        InvalidValueError
            When a coordinate is not finite.
        """
        xy = np.asarray(points, dtype=np.float64)
        if not np.isfinite(xy).all():
            raise InvalidValueError(f"points need finite coordinates in metres, got {points!r:.80}")
        # A centre from points_of must map back to its cell: 1e-9 of a cell absorbs rounding.
        cells = np.floor(np.clip(self.positions_of(xy) + 1e-9, -_MANY, _MANY))
        return cells.astype(np.int64)

    def cell_of(self, x: float, y: float) -> tuple[int, int]:
        """Return the cell that contains one point, like `cells_of` in a tenth of the time.

        Parameters
        ----------
        x, y
            Finite, in metres, map frame.
        """
        row, col = self.position_of(x, y)
        row, col = row + 1e-9, col + 1e-9
        if -_MANY < row < _MANY and -_MANY < col < _MANY:
            return math.floor(row), math.floor(col)
        return math.floor(min(max(row, -_MANY), _MANY)), math.floor(min(max(col, -_MANY), _MANY))

    def position_of(self, x: float, y: float) -> tuple[float, float]:
        """Return one point as (row, column) in grid units, where cell (0, 0) spans [0, 1] x [0, 1].

        Parameters
        ----------
        x, y
            Finite, in metres, map frame.
        """
        _, x0, y0, cosine, sine = self.for_kernels
        # Numbers at the end of their range must become "outside" without an overflow.
        along = min(max(x, -_LARGEST_M), _LARGEST_M) - x0
        across = min(max(y, -_LARGEST_M), _LARGEST_M) - y0
        row = (cosine * across - sine * along) / self.resolution_m
        return row, (cosine * along + sine * across) / self.resolution_m

    def positions_of(self, points: FloatArray) -> FloatArray:
        """Return many points as (row, column) in grid units, like `position_of`.

        Parameters
        ----------
        points
            `(x, y)` in metres along the last axis, finite, map frame.

        Returns
        -------
        FloatArray
            `(row, col)` along the last axis.
        """
        _, x0, y0, cosine, sine = self.for_kernels
        along = np.clip(points[..., 0], -_LARGEST_M, _LARGEST_M) - x0
        across = np.clip(points[..., 1], -_LARGEST_M, _LARGEST_M) - y0
        row = (cosine * across - sine * along) / self.resolution_m
        return np.stack([row, (cosine * along + sine * across) / self.resolution_m], axis=-1)
