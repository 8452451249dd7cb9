"""Paths: the cells and points of a plan, poses for a controller."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from hybridnav._base.copies import Source, copies_alike, frozen, made
from hybridnav._base.poses import Motion
from hybridnav._base.typing import FloatArray, LongArray, SignArray
from hybridnav.errors import InvalidValueError
from hybridnav.messages import path_message

if TYPE_CHECKING:
    from hybridnav.maps import Frame
    from hybridnav.planning.speed import MotionLimits, SpeedMap, SpeedProfile
    from hybridnav.search.found import Found

    End = Sequence[float] | FloatArray


@copies_alike
@dataclass(frozen=True, eq=False)
class Path:
    """A path through the grid, between the centres of two cells, or at any angle between two
    points.

    Examples
    --------
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> path = hn.HybridPlanner(topology).plan((0.5, 0.5), (2.0, 2.5)).path
    >>> path.points
    array([[0.5, 0.5],
           [1.3, 1.2],
           [1.4, 1.4],
           [1.6, 1.9],
           [2. , 2.5]])
    >>> len(path.poses(spacing_m=0.25))
    13
    """

    cells_source: Source[LongArray] = field(repr=False)
    """The `cells`, or how to find them."""
    points_source: Source[FloatArray] = field(repr=False)
    """The `points`, or how to find them."""
    length_m: float
    """Driven length in metres, on arcs along them; for a cell path it is counted as a + b sqrt 2
    cells from the moves."""
    headings_rad: FloatArray | None = None
    """float64 (m,), heading at each point, counter-clockwise from the x axis; None if the state
    space has none."""
    is_curved: bool = False
    """Whether the robot drives an arc of a circle from each point to the next, as in the spaces
    `dubins` and `reeds-shepp`; else a straight line."""
    start_heading_rad: float | None = None
    """Heading from which the robot turns on the spot before it sets out; None for no turn."""
    goal_heading_rad: float | None = None
    """Heading to which the robot turns on the spot once it is there; None for no turn."""

    def __post_init__(self) -> None:
        if self.headings_rad is not None:
            frozen(self.headings_rad)
        if not callable(self.points_source):
            check_length(self.length_m, float(self._motion.lengths_m.sum()))

    @cached_property
    def cells(self) -> LongArray:
        """int64 (n, 2), cells stood on as (row, col); consecutive ones are 8-neighbours. A path
        shortened by line of sight keeps the cells of the original path."""
        return frozen(made(self.cells_source))

    @cached_property
    def points(self) -> FloatArray:
        """float64 (m, 2), (x, y) in metres, map frame: the centres of the cells, or the few points
        where an any-angle path turns. With `is_curved` those at which lines and arcs meet: straight
        lines between them are chords, shorter than the driven ones; `poses` lie on the arcs."""
        return frozen(made(self.points_source))

    @cached_property
    def _motion(self) -> Motion:
        ends = self.start_heading_rad, self.goal_heading_rad
        return Motion(self.points, self.headings_rad, self.is_curved, *ends)

    def turned_at_ends(self, start: End, goal: End) -> Path:
        """Return the path with turns on the spot from the yaw of its start, and to that of its
        goal.

        Parameters
        ----------
        start, goal
            `(x, y)`, no turn, or `(x, y, yaw)`, metres and radians, map frame.
        """
        if len(start) == len(goal) == 2:  # noqa: PLR2004
            return self
        first, last = (float(end[2]) if len(end) > 2 else None for end in (start, goal))  # noqa: PLR2004
        return replace(self, start_heading_rad=first, goal_heading_rad=last)

    @property
    def headings_at_points(self) -> FloatArray:
        """float64 (m,), `headings_rad`, or the direction of travel after each point, before the
        last one; 0 without motion. At an endpoint with a heading of its own, that one."""
        return self._motion.headings_at_points

    def poses(self, spacing_m: float = 0.05) -> FloatArray:
        """Return poses along the path for a controller, evenly spaced.

        Poses lie where straight lines bend, where the robot turns on the spot and where it
        reverses. Between two of these all steps are equal, as few as keep the spacing, along lines
        and arcs alike. A step is shorter than half of it only where two of these are so close.

        Parameters
        ----------
        spacing_m
            Most metres from one pose to the next, driven on arcs along them.

        Returns
        -------
        FloatArray
            float64 (n, 3), `(x, y, yaw)`, metres and radians in [-pi, pi), map frame, from first to
            last point. Without `headings_rad` the yaw is the direction of travel: at a bend the one
            after it, at the end the one before it, 0 without motion. With `headings_rad` it is the
            heading of the robot, as it turns along the path. With `start_heading_rad` that is the
            yaw of the first pose, with `goal_heading_rad` that of the last one. No pose occurs
            twice in a row: a turn on the spot, and nothing else, is two poses at one point.

        Raises
        ------
        InvalidValueError
            When the spacing is not positive, or so small that there would be more than ten million
            poses.
        """
        return self._motion.spread(spacing_m).poses

    def directions(self, spacing_m: float = 0.05) -> SignArray:
        """Return the direction, ahead or backwards, in which the robot leaves each of the `poses`.

        Parameters
        ----------
        spacing_m
            As in `poses`.

        Returns
        -------
        SignArray
            int8 (n,), 1 for ahead, -1 for backwards, which is more than 90 degrees off the heading;
            the last one is that of the step before.
        """
        return self._motion.spread(spacing_m).directions

    def profile(
        self, limits: MotionLimits, spacing_m: float = 0.05, *, speed_map: SpeedMap | None = None
    ) -> SpeedProfile:
        """Return the speed along the path with which the robot arrives first.

        Parameters
        ----------
        limits
            Most speed, acceleration, braking, lateral acceleration and turning rate.
        spacing_m
            As in `poses`, with further ones where lines and arcs meet; it changes neither speeds
            nor times, but with `speed_map`.
        speed_map
            Limits of zones; each step from pose to pose keeps the least limit that the straight
            line between them touches. None for no zones.

        Raises
        ------
        InvalidValueError
            As for `poses`.

        Examples
        --------
        >>> from hybridnav.planning import MotionLimits
        >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
        >>> path = hn.HybridPlanner(topology).plan((0.5, 0.5), (1.5, 0.5)).path
        >>> profile = path.profile(MotionLimits(max_speed_m_s=0.5, max_acceleration_m_s2=2.5))
        >>> profile.speed_m_s.max(), round(profile.duration_s, 3)
        (np.float64(0.5), 2.2)
        """
        # Loads a module that plans whose speeds nobody reads do not need.
        from hybridnav.planning.speed import profile_of  # noqa: PLC0415

        driven = self._motion.driven(spacing_m)
        return profile_of(driven, limits, speed_map, is_curved=self.is_curved)

    def to_message(
        self, frame_id: str = "map", *, spacing_m: float = 0.05, stamp_ns: int = 0
    ) -> dict[str, Any]:
        """Return the `poses` as a `nav_msgs/Path` of ROS 2, in plain dictionaries and lists, which
        `hybridnav.messages.fill_message` puts into a message.

        Parameters
        ----------
        frame_id
            Name of the map frame.
        spacing_m
            As in `poses`.
        stamp_ns
            Time in nanoseconds since 1970, of the path and of each pose.

        Raises
        ------
        InvalidValueError
            As for `poses`, or when the frame has no name or the time is out of range.

        Examples
        --------
        >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
        >>> path = hn.HybridPlanner(topology).plan((0.5, 0.5), (1.5, 0.5)).path
        >>> path.to_message(spacing_m=1.0)["poses"][1]["pose"]["position"]
        {'x': 1.5, 'y': 0.5, 'z': 0.0}
        """
        return path_message(self.poses(spacing_m), frame_id, stamp_ns)

    @property
    def spot_turns(self) -> LongArray:
        """int64, indices of points at which the robot turns on the spot. They are bends of straight
        lines, points that differ from the next one in heading alone, and endpoints with another
        heading than the path."""
        return self._motion.spot_turns

    @property
    def max_curvature_per_m(self) -> float:
        """Largest curvature, 1 / the least radius of an arc, 1 / m; 0 for straight lines."""
        return self._motion.max_curvature_per_m

    @property
    def reversals(self) -> LongArray:
        """int64, indices of the points where the robot changes between ahead and backwards."""
        return np.flatnonzero(np.diff(self._motion.directions)) + 1


def path_of(found: Found, frame: Frame, *, is_of_cells: bool) -> Path:
    """Return the path that a method found; cells and their centres are found when they are read."""
    points, cells, cost = found.points, found.cells_source, found.cost_source
    assert cells is not None  # noqa: S101 - the caller has looked
    length_m = found.cost_m if callable(cost) else cost
    if callable(cells):
        cells = partial(cells_of, found)
    if points is None:
        return Path(cells, partial(_centres, cells, frame, length_m), length_m)
    points = points if is_of_cells or length_m > 0 else points[:1]
    if found.measured_m is None:
        return Path(cells, partial(_checked, points, length_m), length_m)
    check_length(length_m, found.measured_m)
    return Path(cells, partial(made, points), length_m)


def cells_of(found: Found) -> LongArray:
    """Return the cells of the path that a method found."""
    return found.cells


def _checked(points: FloatArray, length_m: float) -> FloatArray:
    """Return the points of a path, after a check of the length that it states."""
    from hybridnav.maps.geometry import polyline_length  # noqa: PLC0415 - compiled

    # A copy, because read-only arrays would compile the kernel again.
    check_length(length_m, polyline_length(np.array(points, np.float64)))
    return points


def _centres(cells: Source[LongArray], frame: Frame, length_m: float) -> FloatArray:
    """Return the centres of the cells of a path, after a check of the length that it states."""
    from hybridnav.maps.geometry import centres, polyline_length  # noqa: PLC0415 - compiled

    points = centres(frozen(made(cells)), frame.for_kernels)
    check_length(length_m, polyline_length(points))
    return points


_SHARE = 1e-6
"""Share of the length, and of a metre, that the rounding of points far away may amount to."""


def is_length(stated_m: Any, driven_m: Any) -> Any:
    """Return whether a path, or each, is as long as stated, but for the rounding of its points."""
    return abs(stated_m - driven_m) <= _SHARE * (1 + driven_m)


def check_length(stated_m: float, driven_m: float) -> None:
    """Refuse a path that is not as long as stated."""
    if not is_length(stated_m, driven_m):
        raise InvalidValueError(
            f"a path states a length of {stated_m:.6g} m, expected that of its points, "
            f"{driven_m:.6g} m: correct what made it"
        )
