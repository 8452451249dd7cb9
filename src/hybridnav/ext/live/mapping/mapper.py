"""Occupancy grids that grow scan by scan. Public: `Mapper`."""

import math

import numpy as np
from numpy.typing import NDArray

from hybridnav._base.trig import cos, sin
from hybridnav._base.typing import IntArray
from hybridnav.errors import InvalidValueError
from hybridnav.ext.live.mapping.kernels import (
    BeamLimits,
    add_hits,
    add_passes,
    beam_ends,
    probabilities,
)
from hybridnav.ext.live.mapping.scans import LaserScan, checked_array, checked_number
from hybridnav.ext.live.mapping.sensors import MOST_RANGE_CELLS, LaserModel, log_odds_of
from hybridnav.maps import DEFAULT_MAX_CELLS, MAX_CELLS, Frame, OccupancyGrid
from hybridnav.maps.checks import checked_type, checked_whole

Area = tuple[float, float, float, float]
_MARGIN_CELLS = 64
"""Cells beyond a scan by which extents grow at least, so that not every scan makes them grow."""
_NO_LIMIT = 1e-300
"""Probabilities stay within this and 1 - this, so that few scans can overrule many: doors open."""


class Mapper:
    """An occupancy grid in log odds that scans are added to (Moravec and Elfes).

    Each cell starts at the odds of 0.5. A scan adds the log odds of its inverse model, which is
    Bayes' rule for cells that are independent of each other (Elfes 1989). Sums stay within the odds
    of `least_probability` and its complement. The extents grow with the scans: cells lie on a
    lattice that never moves, so a grid that grew is bit for bit one that was large from the start.

    A scan that does not fit into the greatest size with those before is refused. While only one
    scan has met cells, it is the earlier one that goes: a wrong first pose does not cost the map.

    Parameters
    ----------
    resolution_m
        Side of a cell in metres.
    laser
        Inverse model of the sensor; its default if None.
    corner_m
        A corner of the lattice of cells, `(x, y)` in metres, map frame.
    yaw_rad
        Rotation of the lattice about that corner, counter-clockwise, in radians.
    least_probability
        Least occupancy of a cell, from 0 up to, not including, 0.5. By default a few scans undo
        what many have seen before, so the map follows changes. 0 sets no limit: all scans count
        alike.
    max_cells
        The most cells that the grid may have. A scan that needs more has a wrong pose, or the
        resolution is too fine.

    Raises
    ------
    InvalidValueError
        When a value is out of range, or a sensor reaches farther than 2^14 cells.

    Examples
    --------
    >>> from hybridnav.ext.live.mapping import LaserScan, Mapper
    >>> mapper = Mapper(resolution_m=1.0)
    >>> pose = (0.5, 0.5, 0.0)
    >>> mapper.add(LaserScan(np.array([3.0]), pose=pose, start_rad=0.0, step_rad=0.0))
    (0.0, 0.0, 4.0, 1.0)
    >>> mapper.to_grid(robot_radius_m=0).classes
    array([[1, 1, 1, 0]], dtype=uint8)
    """

    def __init__(  # noqa: PLR0913 - all have defaults
        self,
        *,
        resolution_m: float = 0.05,
        laser: LaserModel | None = None,
        corner_m: tuple[float, float] = (0.0, 0.0),
        yaw_rad: float = 0.0,
        least_probability: float = 0.02,
        max_cells: int = DEFAULT_MAX_CELLS,
    ) -> None:
        corner = checked_array("corner_m", corner_m)
        if corner.shape != (2,):
            raise InvalidValueError(
                f"corner_m is {corner_m!r:.80}, expected (x, y): give two numbers of metres"
            )
        x_m, y_m = corner.tolist()
        self._frame = Frame(
            checked_number("resolution_m", resolution_m),
            (x_m, y_m),
            checked_number("yaw_rad", yaw_rad),
        )
        self._laser = LaserModel() if laser is None else laser
        checked_type("laser", self._laser, LaserModel)
        least = checked_number("least_probability", least_probability)
        if not 0 <= least < 0.5:  # noqa: PLR2004 - the prior
            raise InvalidValueError(
                f"least_probability is {least}, expected 0 <= least_probability < 0.5: 0.02 "
                "follows changes, 0 counts all scans alike"
            )
        self._limit = -log_odds_of(max(least, _NO_LIMIT))
        self._max_cells = checked_whole("max_cells", max_cells, 1, MAX_CELLS)
        far_m = self._laser.max_range_m + self._laser.depth_m
        if far_m / self.resolution_m > MOST_RANGE_CELLS:
            raise InvalidValueError(
                f"a range of {far_m:g} m is {far_m / self.resolution_m:.0f} cells of "
                f"{self.resolution_m:g} m, more than {MOST_RANGE_CELLS}: take larger cells or a "
                "shorter range"
            )
        self._corner = (0, 0)
        """Row and column, on the lattice, of the first cell of the arrays."""
        self._evidence: NDArray[np.float32] = np.zeros((0, 0), np.float32)
        self._seen_at: IntArray = np.zeros((0, 0), np.int32)
        self._n_scans = 0
        self._n_met = 0
        """Number of scans in the grid that have met cells."""

    @property
    def resolution_m(self) -> float:
        """Side of a cell in metres."""
        return self._frame.resolution_m

    @property
    def n_scans(self) -> int:
        """Number of scans that were added."""
        return self._n_scans

    @property
    def has_cells(self) -> bool:
        """Whether any scan has met a cell, so that there is a grid."""
        return bool((self._seen_at > 0).any())

    def _grown(self, box: tuple[int, int, int, int]) -> Area | None:
        """Make the arrays hold a box of cells that a scan may meet, by its first and last row and
        column. Return the box in metres; None if they cannot hold it.
        """
        if not self._grow(*box):
            if self._n_met != 1:
                return None
            before = self._corner, self._evidence, self._seen_at
            self._evidence, self._seen_at = self._evidence[:0, :0], self._seen_at[:0, :0]
            if not self._grow(*box):
                self._corner, self._evidence, self._seen_at = before
                return None
            self._n_met, self._n_scans = 0, self._n_scans - 1
        self._n_met += 1
        first_row, last_row, first_col, last_col = box
        corners = [(r, c) for r in (first_row, last_row + 1) for c in (first_col, last_col + 1)]
        points = self._frame.points_of_grid(corners)
        (x_min, y_min), (x_max, y_max) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
        return x_min, y_min, x_max, y_max

    def _on_lattice(self, pose: tuple[float, float, float]) -> tuple[float, float, float]:
        """Return a pose in the axes of the lattice, relative to its corner, metres and radians."""
        (x0, y0), yaw_rad = self._frame.origin_m, self._frame.yaw_rad
        x, y, heading_rad = pose[0] - x0, pose[1] - y0, pose[2] - yaw_rad
        cosine, sine = cos(yaw_rad), sin(yaw_rad)
        return cosine * x + sine * y, cosine * y - sine * x, heading_rad

    def add(self, scan: LaserScan) -> Area | None:
        """Add a scan.

        Parameters
        ----------
        scan
            Readings of a laser, with its pose. Readings that are none are left out.

        Returns
        -------
        tuple or None
            `(x_min, y_min, x_max, y_max)` in metres, map frame, along sides of cells: the area that
            holds all cells whose evidence the scan may have changed, as `OnlinePyramid.update` and
            `HybridPlanner.update` take it. It is the sensor's position if the scan has no reading.
            None if the grid would exceed its greatest size with the scan, and has not changed.

        Raises
        ------
        InvalidValueError
            When it is no scan.
        """
        if not isinstance(scan, LaserScan):
            raise InvalidValueError(
                f"a map grows by scans, got {scan!r:.80} of type {type(scan).__name__}: make a "
                "LaserScan of the readings and the pose"
            )
        model = self._laser
        high_m = min(model.max_range_m, scan.max_range_m)
        hits, ends, kinds, box = beam_ends(
            scan.ranges_m,
            self._on_lattice(scan.pose),
            (scan.start_rad, scan.step_rad),
            BeamLimits(
                model.min_range_m,
                high_m,
                min(model.clear_range_m, high_m),
                model.tolerance_m,
                model.depth_m,
            ),
            self.resolution_m,
        )
        if not kinds.any():
            self._n_scans += 1
            return (*scan.pose[:2], *scan.pose[:2])
        area = self._grown(tuple(box.tolist()))
        if area is None:
            return None
        self._n_scans += 1
        odds = log_odds_of(model.when_hit), log_odds_of(model.when_passed), self._limit
        changes = tuple(np.float32(change) for change in odds)
        for add in (add_hits, add_passes) if model.hits_win else (add_passes, add_hits):
            add(
                self._evidence,
                self._seen_at,
                self._corner,
                (hits, ends, kinds),
                self._n_scans,
                changes,
            )
        return area

    def _grow(self, first_row: int, last_row: int, first_col: int, last_col: int) -> bool:
        """Make the arrays hold a box of cells; return whether it is within the greatest size."""
        rows, cols = self._evidence.shape
        row, col = self._corner if rows else (first_row, first_col)
        need = (
            (min(first_row, row), max(last_row + 1, row + rows)),
            (min(first_col, col), max(last_col + 1, col + cols)),
        )
        if need == ((row, row + rows), (col, col + cols)):
            return True
        if math.prod(end - begin for begin, end in need) > self._max_cells:
            return False
        # A margin in proportion to the extents, so that copying costs little in total.
        margins = [max(_MARGIN_CELLS, (end - begin) // 4) for begin, end in need]
        (top, bottom), (left, right) = (
            (begin - margin * (begin < old), end + margin * (end > old + size))
            for (begin, end), margin, old, size in zip(
                need, margins, (row, col), (rows, cols), strict=True
            )
        )
        if (bottom - top) * (right - left) > self._max_cells:
            (top, bottom), (left, right) = need
        for name in ("_evidence", "_seen_at"):
            old_array = getattr(self, name)
            new = np.zeros((bottom - top, right - left), old_array.dtype)
            new[row - top : row - top + rows, col - left : col - left + cols] = old_array
            setattr(self, name, new)
        self._corner = (top, left)
        return True

    def _part(self, area: Area | None) -> tuple[tuple[int, int], tuple[slice, slice]]:
        """Return the first cell of an area on the lattice, and the slices of the arrays for it."""
        (top, left), (rows, cols) = self._corner, self._seen_at.shape
        if area is None:
            return (top, left), np.s_[:rows, :cols]
        sides = checked_array("area", area)
        if sides.shape != (4,) or (sides[2:] < sides[:2]).any():
            raise InvalidValueError(
                f"area is {area!r:.80}, expected (x_min, y_min, x_max, y_max) in metres"
            )
        corners = [self._frame.position_of(x, y) for x in sides[::2] for y in sides[1::2]]
        low, high = np.min(corners, axis=0), np.max(corners, axis=0)
        first = np.clip(np.floor(low) - (top, left), 0, (rows, cols)).astype(int).tolist()
        beyond = np.clip(np.ceil(high) - (top, left), 0, (rows, cols)).astype(int).tolist()
        corner = top + first[0], left + first[1]
        return corner, np.s_[first[0] : beyond[0], first[1] : beyond[1]]

    def to_grid(
        self,
        *,
        robot_radius_m: float | None = None,
        free_threshold: float = 0.196,
        occupied_threshold: float = 0.65,
        name: str = "map",
        area: Area | None = None,
    ) -> OccupancyGrid:
        """Return the occupancy grid of all scans so far, cut to the cells that they have met.

        Parameters
        ----------
        robot_radius_m
            Radius in metres by which occupied cells are inflated; None is the default, 0.25 m.
        free_threshold, occupied_threshold
            U1 and U2 of the grid.
        name
            Name of the map.
        area
            `(x_min, y_min, x_max, y_max)` in metres, map frame: only cells that it meets, and
            nothing beyond them. None for all.

        Returns
        -------
        OccupancyGrid
            Probabilities, NaN where no scan has been; the frame lies on the lattice of cells.

        Raises
        ------
        InvalidValueError
            When no scan has met a cell, there or at all, or a threshold or the radius is out of
            range.
        """
        (top, left), within = self._part(area)
        evidence, met = self._evidence[within], self._seen_at[within] > 0
        rows, cols = (np.flatnonzero(met.any(axis=axis)) for axis in (1, 0))
        if not rows.size:
            raise InvalidValueError("a map needs at least one scan with a reading, add one first")
        window = np.s_[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
        probability = probabilities(evidence[window], met[window])
        first = [int(rows[0]) + top, int(cols[0]) + left]
        x, y = self._frame.points_of_grid(first).tolist()
        return OccupancyGrid(
            probability,
            Frame(self.resolution_m, (x, y), self._frame.yaw_rad),
            free_threshold=free_threshold,
            occupied_threshold=occupied_threshold,
            robot_radius_m=robot_radius_m,
            name=name,
        )
