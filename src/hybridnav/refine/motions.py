"""Exact validity of states and motions of a robot in the free space of a grid."""

from __future__ import annotations

import copy
import itertools
import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import Self

from hybridnav._base.copies import copies_alike
from hybridnav._base.typing import BoolArray, ByteArray, FloatArray, LongArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import CellClass, Frame, OccupancyGrid
from hybridnav.maps.clearance import clearance_cells
from hybridnav.refine.kernels import motions as kernels
from hybridnav.refine.kernels.sweep import Body, look_ahead

if TYPE_CHECKING:
    from hybridnav.refine.footprint import Footprint

_FARTHEST_CELLS = 5000


@copies_alike
class MotionCheck:
    """Exact validity of states and motions of a robot in free space, in the map frame.

    A disc robot is a point on a grid inflated by its radius. It stays in the union of the closed
    squares of the cells that it may stand on. It never passes between two blocked cells that meet
    at a corner (unless the grid allows corner cutting). Numbers that are not finite, points outside
    the map and headings above a million are not valid. Points are rounded to 2^-24 of a cell; every
    test of a straight line between rounded points is exact.

    With a footprint the base keeps these rules, on a grid inflated by no more than the inscribed
    radius. The footprint must not meet the inside of a cell that is occupied without inflation
    (`OccupancyGrid.measured`). As for the disc, unexplored and closed cells and the ground outside
    the map stop only the base. A motion is valid only if every state on it is. Motions without a
    turn and turns on the spot are decided exactly, others up to a hundredth of a cell.

    Parameters
    ----------
    grid
        The map.
    footprint
        Outline of the robot, see `Footprint.of`; None for a disc.
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
        When `inside` does not have the shape of the map, or a closed cell lies outside it. When the
        footprint is refused, reaches more than 5000 cells, or is narrower than the inflation of the
        map.

    Examples
    --------
    >>> from hybridnav.refine import MotionCheck
    >>> check = MotionCheck(hn.OccupancyGrid(np.array([[0.0, 1.0, 0.0]]), robot_radius_m=0))
    >>> check.state_valid(0.5, 0.5), check.motion_valid(0.5, 0.5, 2.5, 0.5)
    (True, False)
    """

    def __init__(
        self,
        grid: OccupancyGrid,
        *,
        footprint: ArrayLike | Footprint | None = None,
        inside: BoolArray | None = None,
        closed: LongArray | None = None,
        allow_unexplored: bool = False,
    ) -> None:
        self._grid = grid
        self._allow_unexplored = allow_unexplored
        self._place = _place_of(grid.frame)
        self._is_disc = footprint is None
        self._body = _no_body() if footprint is None else _body_of(grid, footprint)
        self._marks = self._marks_of(inside, closed)

    def confined(
        self,
        *,
        inside: BoolArray | None = None,
        closed: LongArray | None = None,
        solid: LongArray | None = None,
    ) -> Self:
        """Return a check of the same robot and map in another corridor, without the work on the
        footprint.

        Parameters
        ----------
        inside, closed
            As in the class; they replace those of this check.
        solid
            int64 (n,), flat cells that the footprint must not meet either; None for none.
        """
        other = copy.copy(self)
        other._marks = self._marks_of(inside, closed)  # noqa: SLF001 - of the same class
        if solid is not None and not self._is_disc:
            occupied = self._grid.measured == CellClass.OCCUPIED
            occupied.flat[solid] = True
            around = {
                "ahead": look_ahead(occupied),
                "clearance": clearance_cells(occupied).astype(np.float32),
            }
            other._body = self._body._replace(**around)  # noqa: SLF001
        return other

    def state_valid(self, x: float, y: float, yaw: float = 0.0) -> bool:
        """Return whether the robot may be at a point.

        Parameters
        ----------
        x, y
            Metres, map frame.
        yaw
            Heading in radians, counter-clockwise from the x axis; without effect on a disc.
        """
        valid: bool
        if self._is_disc:
            valid = kernels.point_stands(self._marks, self._place, x, y)
        else:
            valid = kernels.body_stands(self._marks, self._place, self._body, x, y, yaw)
        return valid

    def motion_valid(self, x0: float, y0: float, x1: float, y1: float) -> bool:
        """Return whether a disc robot, or the base of another one, may drive straight between two
        points.

        Parameters
        ----------
        x0, y0, x1, y1
            Metres, map frame.
        """
        return kernels.point_runs(self._marks, self._place, x0, y0, x1, y1)

    def turn_valid(  # noqa: PLR0913, PLR0917 - numbers, as OMPL has them
        self, x0: float, y0: float, yaw0: float, x1: float, y1: float, yaw1: float
    ) -> bool:
        """Return whether the robot may go straight from pose to pose in an even turn, the short
        way.

        This is the interpolation of OMPL's `SE2StateSpace`, for a holonomic robot, which moves in
        any direction with any heading.

        Parameters
        ----------
        x0, y0, x1, y1
            Metres, map frame.
        yaw0, yaw1
            Headings in radians.
        """
        return kernels.body_turns(self._marks, self._place, self._body, x0, y0, yaw0, x1, y1, yaw1)

    def drive_valid(  # noqa: PLR0913, PLR0917 - numbers, as OMPL has them
        self,
        x0: float,
        y0: float,
        yaw0: float,
        x1: float,
        y1: float,
        yaw1: float,
        *,
        backwards: bool = False,
    ) -> bool:
        """Return whether a robot with differential drive may go from pose to pose.

        It turns on the spot to the direction of travel, drives straight, and turns to its last
        heading; each turn goes as `spin` does. Between equal points it only turns.

        Parameters
        ----------
        x0, y0, yaw0, x1, y1, yaw1
            Poses, metres and radians, map frame.
        backwards
            Whether it drives backwards: its heading is then opposite to the direction of travel.
        """
        return kernels.body_drives_straight(
            self._marks, self._place, self._body, x0, y0, yaw0, x1, y1, yaw1, backwards
        )

    def spin(self, x: float, y: float, yaw0: float, yaw1: float) -> float:
        """Return the turn on the spot by which the robot gets from one heading to another.

        Parameters
        ----------
        x, y
            Metres, map frame.
        yaw0, yaw1
            Headings in radians.

        Returns
        -------
        float
            Radians, positive counter-clockwise: the short way if it is free, else the other way
            round; NaN if neither is.
        """
        return kernels.turn_on_the_spot(self._marks, self._place, self._body, x, y, yaw0, yaw1)

    def curve_valid(  # noqa: PLR0913, PLR0917 - numbers, as OMPL has them
        self,
        x0: float,
        y0: float,
        yaw0: float,
        kinds: LongArray,
        lengths_m: FloatArray,
        radius_m: float,
    ) -> bool:
        """Return whether the robot may drive a curve of arcs and straight lines.

        Parameters
        ----------
        x0, y0, yaw0
            Start pose, metres and radians, map frame.
        kinds
            int64 (n,), 1 for an arc to the left, 0 for straight on, -1 for an arc to the right.
        lengths_m
            float64 (n,), metres, negative backwards. No arc may exceed a full turn.
        radius_m
            Radius of every arc, positive.
        """
        return kernels.body_drives(
            self._marks, self._place, self._body, x0, y0, yaw0, kinds, lengths_m, radius_m
        )

    def dubins_valid(  # noqa: PLR0913, PLR0917 - numbers, as OMPL has them
        self, x0: float, y0: float, yaw0: float, x1: float, y1: float, yaw1: float, radius_m: float
    ) -> bool:
        """Return whether the robot may drive the shortest curve forwards; see `shortest_curve`.

        Parameters
        ----------
        x0, y0, yaw0, x1, y1, yaw1
            Poses, metres and radians, map frame.
        radius_m
            Turning radius.
        """
        return kernels.body_steers(
            self._marks, self._place, self._body, x0, y0, yaw0, x1, y1, yaw1, radius_m, False
        )

    def reeds_shepp_valid(  # noqa: PLR0913, PLR0917 - numbers, as OMPL has them
        self, x0: float, y0: float, yaw0: float, x1: float, y1: float, yaw1: float, radius_m: float
    ) -> bool:
        """Return whether the robot may drive the shortest curve that may go backwards too.

        Parameters are those of `dubins_valid`.
        """
        return kernels.body_steers(
            self._marks, self._place, self._body, x0, y0, yaw0, x1, y1, yaw1, radius_m, True
        )

    def path_valid(self, points: ArrayLike) -> bool:
        """Return whether the robot may go along a polyline.

        Parameters
        ----------
        points
            `(x, y)` in metres for a disc, (n, 2), n >= 1; bends at corners of cells are judged too.
            Or `(x, y, yaw)`, (n, 3), for a robot that turns between them as in `turn_valid`.

        Raises
        ------
        InvalidValueError
            When the points have another shape.
        """
        path = np.ascontiguousarray(points, dtype=np.float64)
        if path.ndim != 2 or path.shape[1] not in {2, 3} or not len(path):  # noqa: PLR2004
            raise InvalidValueError(
                f"a path needs points (n, 2) or (n, 3), n >= 1, got {path.shape}"
            )
        if not kernels.polyline_runs(self._marks, self._place, path):
            return False
        if path.shape[1] == 2:  # noqa: PLR2004
            return True
        poses = path.tolist()
        turns = itertools.pairwise(poses)
        return self.state_valid(*poses[0]) and all(self.turn_valid(*a, *b) for a, b in turns)

    def _marks_of(self, inside: BoolArray | None, closed: LongArray | None) -> ByteArray:
        """Return the mark of each cell for the base of the robot, uint8 (rows, cols)."""
        free = self._grid.enterable(allow_unexplored=self._allow_unexplored)
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
                    f"the mask of a corridor must have the map's shape {free.shape}, "
                    f"got {inside.shape}"
                )
            stand = free & inside.astype(np.bool_, copy=False)
        if self._grid.corner_cutting:
            free = np.ones_like(free)
        return free.view(np.uint8) + stand.view(np.uint8)


def _place_of(frame: Frame) -> FloatArray:
    """Return the pose of a grid in the map frame, float64 (8,); see the kernels."""
    rates = *frame.per_metre.ravel(), frame.yaw_rad, 1 / frame.resolution_m
    return np.array([*frame.origin_m, *rates])


def _no_body() -> Body:
    """Return a body of the kernels for a disc, which has only its base."""
    nowhere = np.zeros((0, 0), dtype=np.bool_)
    distance = nowhere.astype(np.float32)
    offsets = np.zeros(1, dtype=np.int64)
    return Body(look_ahead(nowhere), distance, np.empty((0, 2)), offsets, np.zeros(2))


def _body_of(grid: OccupancyGrid, shape: ArrayLike | Footprint) -> Body:
    """Return a body of the kernels for a footprint, with the cells that it must not meet."""
    from hybridnav.refine.footprint import Footprint  # noqa: PLC0415 - loads shapely

    footprint = Footprint.of(shape)
    radii = np.array([footprint.inscribed_radius_m, footprint.circumscribed_radius_m])
    radii /= grid.resolution_m
    if radii[1] > _FARTHEST_CELLS:
        raise InvalidValueError(
            f"a footprint may reach {_FARTHEST_CELLS} cells, this one reaches "
            f"{footprint.circumscribed_radius_m:g} m on cells of {grid.resolution_m:g} m"
        )
    if grid.robot_radius_m > footprint.inscribed_radius_m * (1 + 1e-9):
        raise InvalidValueError(
            f"the map is inflated by {grid.robot_radius_m:g} m, but the largest circle about the "
            f"base inside the footprint has a radius of {footprint.inscribed_radius_m:g} m: load "
            "the map with that robot_radius_m (--robot-radius "
            f"{math.floor(footprint.inscribed_radius_m * 1e4 + 1e-6) / 1e4:g}), or paths that the "
            "robot can take are closed"
        )
    parts = footprint.convex_parts()
    offsets = np.cumsum([0, *map(len, parts)])
    occupied = grid.measured == CellClass.OCCUPIED
    return Body(
        look_ahead(occupied),
        clearance_cells(occupied).astype(np.float32),
        np.concatenate(parts) / grid.resolution_m,
        offsets.astype(np.int64),
        radii,
    )
