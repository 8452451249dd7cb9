"""Occupancy grids: probabilities, thresholds, and the classes of cells. Public: `drop_islands`."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from hybridnav._base.copies import copies_alike
from hybridnav._base.typing import BoolArray, ByteArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps.cells import DEFAULT_ROBOT_RADIUS_M, MAX_CELLS, CellClass
from hybridnav.maps.checks import checked_radius, checked_thresholds
from hybridnav.maps.clearance import within_radius
from hybridnav.maps.frame import Frame
from hybridnav.maps.islands import DroppedIslands, without_islands
from hybridnav.maps.messages import grid_message, percentages, read_probability


class _RobotRadius:
    """The radius of a grid: None, which stands for the default, is read as a number."""

    @overload
    def __get__(self, grid: None, owner: type[OccupancyGrid]) -> None: ...

    @overload
    def __get__(self, grid: OccupancyGrid, owner: type[OccupancyGrid]) -> float: ...

    def __get__(self, grid: OccupancyGrid | None, owner: type[OccupancyGrid]) -> float | None:
        if grid is None:  # read by dataclass as the default of the parameter
            return None
        radius_m: float | None = grid.__dict__["robot_radius_m"]
        return DEFAULT_ROBOT_RADIUS_M if radius_m is None else radius_m

    def __set__(self, grid: OccupancyGrid, radius_m: float | None) -> None:
        grid.__dict__["robot_radius_m"] = radius_m


@copies_alike
@dataclass(frozen=True, eq=False)
class OccupancyGrid:
    """A grid of occupancy probabilities, classified by two thresholds (Moravec and Elfes).

    A cell with `p <= free_threshold` (U1) is free, with `p >= occupied_threshold` (U2) occupied,
    and unexplored between; NaN means "never measured" and is unexplored whatever the thresholds.
    Probabilities and thresholds are compared as float32.

    A cell is *blocked* when its centre lies within `robot_radius_m` of the centre of an occupied
    cell (exact Euclidean distance); blocked cells count as occupied in `classes`. Unexplored cells
    and the map's border do not inflate.

    Parameters
    ----------
    probability
        Occupancy in [0, 1] or NaN, shape `(rows, cols)`, row 0 at the lowest y; copied.
    frame
        Resolution and pose in the map frame.
    free_threshold, occupied_threshold
        U1 and U2, `0 <= U1 <= U2 <= 1`; where they are equal, a cell on both is free.
    robot_radius_m
        Radius in metres by which occupied cells are inflated; 0, for a robot that is a point,
        blocks the occupied cells alone. None is the default, 0.25 m.
    corner_cutting
        Whether a diagonal move may pass between two cells if one or both are not free. If True, the
        grid and the topological map are not consistent.
    name
        Name of the map in messages and pictures.
    radius_is_default
        Whether the radius is the default: set if it is None, and kept by `dataclasses.replace`,
        even with a radius that equals the default; pass False to choose that radius.
    least_island_m2
        Square metres that an island must have to be kept; see `drop_islands`. 0 keeps all.

    Raises
    ------
    InvalidValueError
        When the array is not two-dimensional, empty, too large or holds values outside [0, 1], or
        a threshold, the radius or the least area is out of range.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 0.0, 0.5, 1.0]]), robot_radius_m=0)
    >>> grid.classes
    array([[1, 1, 2, 0]], dtype=uint8)
    >>> grid.class_counts()
    {'free': 2, 'unexplored': 1, 'occupied': 1, 'blocked': 0}
    """

    probability: NDArray[np.float32] = field(repr=False)
    frame: Frame = field(default_factory=Frame)
    free_threshold: float = 0.196
    occupied_threshold: float = 0.65
    robot_radius_m: _RobotRadius = _RobotRadius()
    corner_cutting: bool = False
    name: str = "map"
    radius_is_default: bool = False
    least_island_m2: float = 0.0
    measured: ByteArray = field(init=False, repr=False)
    """Class of each cell by the thresholds alone, uint8 `CellClass`."""
    classes: ByteArray = field(init=False, repr=False)
    """Class of each cell after inflation and without dropped islands, uint8 `CellClass`, as graphs
    and planners use it."""
    dropped: DroppedIslands | None = field(init=False, repr=False, default=None)
    """Islands left out by `least_island_m2`; None when that is 0."""

    def __post_init__(self) -> None:
        try:
            probability = np.array(self.probability, dtype=np.float32, order="C")
        except (TypeError, ValueError):
            what = " ".join(f"{self.probability!r:.60}".split())
            raise InvalidValueError(
                f"occupancy probabilities are {what}, expected numbers, float32 (rows, cols)"
            ) from None
        _check_probability(probability)
        given = self.__dict__["robot_radius_m"]
        kept = self.radius_is_default and given == DEFAULT_ROBOT_RADIUS_M
        object.__setattr__(self, "radius_is_default", given is None or kept)
        low, high = checked_thresholds(self.free_threshold, self.occupied_threshold)
        for name, value in (
            ("free_threshold", low),
            ("occupied_threshold", high),
            ("robot_radius_m", checked_radius(self.robot_radius_m)),
            ("least_island_m2", float(self.least_island_m2)),
        ):
            object.__setattr__(self, name, value)
        if not (math.isfinite(self.least_island_m2) and self.least_island_m2 >= 0):
            raise InvalidValueError(
                "the least area of an island must be a finite number of m² >= 0, "
                f"got {self.least_island_m2}"
            )
        measured = np.full(probability.shape, CellClass.UNEXPLORED, dtype=np.uint8)
        measured[probability >= np.float32(high)] = CellClass.OCCUPIED
        measured[probability <= np.float32(low)] = CellClass.FREE
        classes = measured
        if self.robot_radius_m > 0:
            radius_cells = self.robot_radius_m / self.frame.resolution_m
            blocked = within_radius(measured == CellClass.OCCUPIED, radius_cells=radius_cells)
            classes = np.where(blocked, np.uint8(CellClass.OCCUPIED), measured)
        if self.least_island_m2 > 0:
            classes, dropped = without_islands(
                classes, least_area_m2=self.least_island_m2, cell_area_m2=self.frame.cell_area_m2
            )
            object.__setattr__(self, "dropped", dropped)
        for name, array in (
            ("probability", probability),
            ("measured", measured),
            ("classes", classes),
        ):
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    @classmethod
    def from_message(
        cls,
        message: Any,
        *,
        robot_radius_m: float | None = None,
        free_threshold: float = 0.196,
        occupied_threshold: float = 0.65,
        name: str = "map",
    ) -> OccupancyGrid:
        """Make a grid of a `nav_msgs/OccupancyGrid`; ROS is not needed.

        Parameters
        ----------
        message
            Any object or mapping with the fields of the message, of ROS 1 or ROS 2: `data`, and
            `info` with `width`, `height`, `resolution` and `origin`. Values 0 to 100 are
            percentages, -1 was never measured. A resolution in float32 is read as the decimal
            number that it was made of.
        robot_radius_m, free_threshold, occupied_threshold, name
            As in the class.

        Raises
        ------
        InvalidValueError
            When a field is missing, not finite or out of range, `data` has not width x height
            values, or a value is not within -1 to 100. When the orientation of the origin is no
            unit quaternion or tilted by more than 0.02 radians.

        Examples
        --------
        >>> message = hn.OccupancyGrid(np.array([[0.0, np.nan, 1.0]])).to_message()
        >>> message["data"]
        [0, -1, 100]
        >>> hn.OccupancyGrid.from_message(message, robot_radius_m=0).classes
        array([[1, 2, 0]], dtype=uint8)
        """
        probability, frame = read_probability(message)
        return cls(
            probability,
            frame,
            free_threshold=free_threshold,
            occupied_threshold=occupied_threshold,
            robot_radius_m=robot_radius_m,
            name=name,
        )

    def to_message(self, frame_id: str = "map", *, stamp_ns: int = 0) -> dict[str, Any]:
        """Return the map as a `nav_msgs/OccupancyGrid` of ROS 2, in plain dictionaries and lists.

        `hybridnav.messages.fill_message` puts it into a message. Measured cells are returned:
        the robot's radius and dropped islands are no part of it. Percentages are rounded, but never
        across a threshold.

        Parameters
        ----------
        frame_id
            Name of the map frame.
        stamp_ns
            Time in nanoseconds since 1970.

        Raises
        ------
        InvalidValueError
            When the frame has no name, or the time is negative or too large.
        """
        thresholds = self.free_threshold, self.occupied_threshold
        values = percentages(self.probability, self.measured, thresholds)
        return grid_message(values, self.frame, frame_id, stamp_ns)

    @classmethod
    def restored(cls, **attributes: Any) -> OccupancyGrid:
        """Make a grid from the attributes of another one, without computation or checks.

        Parameters
        ----------
        attributes
            Attributes of the class by name; arrays are frozen, not copied.
        """
        grid = cls.__new__(cls)
        for name, value in attributes.items():
            object.__setattr__(grid, name, value)
        for array in (grid.probability, grid.measured, grid.classes):
            array.flags.writeable = False
        return grid

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, cols = self.classes.shape
        return rows, cols

    @property
    def resolution_m(self) -> float:
        """Side of a cell in metres."""
        return self.frame.resolution_m

    @property
    def cell_area_m2(self) -> float:
        """Area of a cell in square metres."""
        return self.frame.cell_area_m2

    def enterable(self, *, allow_unexplored: bool = False) -> BoolArray:
        """Return the cells that paths may use, bool (rows, cols): free and, if allowed, unexplored.

        Parameters
        ----------
        allow_unexplored
            Whether unexplored cells may be entered.
        """
        cells: BoolArray = self.classes == CellClass.FREE
        if allow_unexplored:
            cells |= self.classes == CellClass.UNEXPLORED
        return cells

    def class_counts(self) -> dict[str, int]:
        """Return the number of cells of each class.

        `blocked` counts the cells that only inflation occupies; `closed`, where islands are
        dropped, those of islands.
        """
        counts = np.bincount(self.classes.ravel(), minlength=3)
        occupied = int((self.measured == CellClass.OCCUPIED).sum())
        closed = {} if self.dropped is None else {"closed": self.dropped.closed_cells}
        return {
            "free": int(counts[CellClass.FREE]),
            "unexplored": int(counts[CellClass.UNEXPLORED]),
            "occupied": occupied,
            "blocked": int(counts[CellClass.OCCUPIED]) - occupied - sum(closed.values()),
            **closed,
        }


def extent(grid: OccupancyGrid) -> str:
    """Describe the part of the map frame that a map covers; with yaw, its bounding box."""
    rows, cols = grid.shape
    corners = grid.frame.points_of_grid(np.array([[0, 0], [0, cols], [rows, 0], [rows, cols]]))
    low, high = (np.round(c, 2) + 0.0 for c in (corners.min(axis=0), corners.max(axis=0)))  # no -0
    return f"x {low[0]:.2f} to {high[0]:.2f} m, y {low[1]:.2f} to {high[1]:.2f} m"


def _check_probability(probability: NDArray[np.float32]) -> None:
    if probability.ndim != 2 or probability.size == 0:  # noqa: PLR2004
        raise InvalidValueError(
            "an occupancy grid needs at least one row and one column, "
            f"got an array of shape {probability.shape}"
        )
    if probability.size > MAX_CELLS:
        raise InvalidValueError(
            f"an occupancy grid holds at most {MAX_CELLS} cells, got {probability.size}"
        )
    if (probability < 0).any() or (probability > 1).any():
        raise InvalidValueError("occupancy probabilities must lie in [0, 1] or be NaN")


def drop_islands(grid: OccupancyGrid, least_area_m2: float) -> OccupancyGrid:
    """Leave out the islands of a grid that are smaller than an area.

    An island is a 4-connected set of cells of one class. A free island below the area becomes
    unexplored. After that, an unexplored island below the area is closed: it counts as occupied in
    `classes`, belongs to no place, and is not inflated. It stays where it joins two free areas, so
    that connections stay for a robot that may enter unexplored cells. No cell becomes free,
    occupied cells stay occupied, and free sets of that area or more keep every cell and so their
    paths.

    Parameters
    ----------
    grid
        The map; unchanged.
    least_area_m2
        Square metres that an island must have to be kept, finite; 0 keeps all of them. Cells within
        the robot's radius of an obstacle do not count.

    Returns
    -------
    OccupancyGrid
        The same map with `least_island_m2` set; `dropped` counts the islands that were left out.

    Raises
    ------
    InvalidValueError
        When the area is negative or not finite.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 0.0, 0.0, 1.0, 0.0]]), robot_radius_m=0)
    >>> hn.drop_islands(grid, 2.0).classes
    array([[1, 1, 1, 0, 0]], dtype=uint8)
    """
    return replace(grid, least_island_m2=least_area_m2)
