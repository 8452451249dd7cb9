"""Where a line touches what it must not, and how far it stays off obstacles. Public: `Contact` and
`Clearance`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.trig import hypots, lengths_along
from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.harness.judges import kernels
from hybridnav.harness.judges.judge import free_classes, grid_positions
from hybridnav.maps import CellClass
from hybridnav.maps.checks import checked_points

if TYPE_CHECKING:  # judges load no more of maps than they need
    from hybridnav.maps import OccupancyGrid

_WITHIN_CELLS = 1 / 128
"""Cells by which depths, and the least clearance, may be off."""
_STEP_CELLS, _MOST_STEPS = 0.25, 1_000_000
"""Cells between samples of the clearance, and how many of them there may be."""


@dataclass(frozen=True)
class Contact:
    """A piece of a path outside the free space of a map.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.array([[0, 0, 1, 1, 0, 0]]), robot_radius_m=0)
    >>> (met,) = hn.judge(grid, [(0.5, 0.5), (5.5, 0.5)]).contacts
    >>> met.what, met.from_m, met.to_m, met.depth_m
    ('obstacle', 1.5, 3.5, 1.0)
    """

    what: str
    """What is met where it is deepest: an "obstacle", what is "near an obstacle" (within the
    radius), "unexplored", "outside the map", or a "corner" between two blocked cells."""
    x: float
    """x of its deepest place, metres, map frame."""
    y: float
    """y of it."""
    depth_m: float
    """Metres from there to the nearest free cell, infinite without any; 0 at corners."""
    from_m: float
    """Metres along the path at which it begins."""
    to_m: float
    """Metres along the path at which it ends."""


@dataclass(frozen=True)
class Clearance:
    """Distances from a path to the squares of occupied cells, in metres; infinite without any.

    Examples
    --------
    >>> grid = hn.OccupancyGrid(np.array([[0, 0, 0, 0], [0, 1, 0, 0]]), robot_radius_m=0)
    >>> clear = hn.judge(grid, [(0.5, 0.5), (3.5, 0.5)], limit_m=1.0).clearance
    >>> clear.least_m, clear.limit_m
    (0.5, 1.0)
    """

    least_m: float
    mean_m: float
    """Mean over the length of the path."""
    limit_m: float
    below: float
    """Share of the length with less clearance than the limit."""
    x: float
    """x of where it is least, metres, map frame."""
    y: float
    """y of it."""


def contacts_of(
    grid: OccupancyGrid, points: ArrayLike, *, allow_unexplored: bool = False
) -> tuple[Contact, ...]:
    """Return every piece of a line that lies outside the free space, in order.

    Whether there is one is decided exactly, as by `segment_faults`; where it begins and how deep
    it goes is found in floating point, depths to a hundredth of a cell.

    Parameters
    ----------
    grid
        The map.
    points
        `(x, y)` in metres, map frame, shape (n, 2), n >= 1, finite.
    allow_unexplored
        Whether unexplored cells count as free.

    Returns
    -------
    tuple of Contact
        None of a legal line.

    Raises
    ------
    InvalidValueError
        When the points are no finite array of shape (n, 2) or there is none.

    Examples
    --------
    >>> from hybridnav.harness.judges import contacts_of
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 1.0, 0.0]]), robot_radius_m=0)
    >>> (contact,) = contacts_of(grid, [(0.5, 0.5), (2.5, 0.5)])
    >>> contact.what, contact.x, contact.depth_m, contact.from_m, contact.to_m
    ('obstacle', 1.5, 0.5, 0.5, 1.5)
    """
    positions = grid_positions(grid.frame, checked_points(points))
    free_of = free_classes(allow_unexplored=allow_unexplored)
    faulty = kernels.segment_codes(grid.classes, free_of, positions) != kernels.CLEAR
    bends = np.flatnonzero(kernels.crossed_joints(grid.classes, free_of, positions))
    if not faulty.any() and not len(bends):
        return ()
    spans = kernels.faulty_spans(grid.classes, free_of, positions, faulty)
    at_bends = np.stack([bends - 1.0, np.ones(len(bends)), np.ones(len(bends))], axis=1)
    spans = np.concatenate([spans, at_bends])
    spans = spans[np.lexsort((spans[:, 1], spans[:, 0]))]
    segment = spans[:, 0].astype(np.int64)
    start, step = positions[segment], positions[np.minimum(segment + 1, len(positions) - 1)]
    step = step - start
    first, last = start + spans[:, 1:2] * step, start + spans[:, 2:] * step
    free = np.ascontiguousarray(free_of[grid.classes])
    near = kernels.neighbours_in_row(free)
    deepest = kernels.farthest(near, first, last, 1.0, _WITHIN_CELLS)
    if not free.any():
        deepest[:, 1] = math.inf
    begins = lengths_along(positions)[segment]
    length = hypots(step[:, 0], step[:, 1])
    ranges = begins[:, None] + spans[:, 1:] * length[:, None]
    # One contact goes on over the points of the path.
    is_new = np.append(True, ranges[1:, 0] - np.maximum.accumulate(ranges[:-1, 1]) > kernels.SMALL)
    group = np.flatnonzero(is_new)
    places = first + deepest[:, :1] * (last - first)
    per_cell, contacts = grid.resolution_m, []
    for low, high in zip(group, np.append(group[1:], len(spans)), strict=True):
        at = int(low + np.argmax(deepest[low:high, 1]))
        x, y = grid.frame.points_of_grid(places[at]).tolist()
        depth, begin, end = deepest[at, 1], ranges[low, 0], ranges[low:high, 1].max()
        what = "corner" if depth <= kernels.SMALL and begin == end else _what(grid, places[at])
        contacts.append(
            Contact(what, x, y, *(float(value) * per_cell for value in (depth, begin, end)))
        )
    return tuple(contacts)


def _what(grid: OccupancyGrid, position: FloatArray) -> str:
    """Return what stands at a position outside the free space."""
    row, col = np.floor(position).astype(np.int64).tolist()
    rows, cols = grid.shape
    if not (0 <= row < rows and 0 <= col < cols):
        return "outside the map"
    if grid.classes[row, col] == CellClass.UNEXPLORED:
        return "unexplored"
    return "obstacle" if grid.measured[row, col] == CellClass.OCCUPIED else "near an obstacle"


def clearance_of(grid: OccupancyGrid, points: ArrayLike, *, limit_m: float) -> Clearance:
    """Measure how far a line stays off occupied cells.

    Parameters
    ----------
    grid
        The map; cells within the radius of the robot are no obstacles here.
    points
        `(x, y)` in metres, map frame, shape (n, 2), n >= 1, finite.
    limit_m
        The limit of `Clearance.below`, metres.

    Returns
    -------
    Clearance
        The least to a hundredth of a cell; mean and share of samples a quarter of a cell apart.

    Raises
    ------
    InvalidValueError
        When the points are no finite array of shape (n, 2) or there is none.

    Examples
    --------
    >>> from hybridnav.harness.judges import clearance_of
    >>> grid = hn.OccupancyGrid(np.array([[0.0, 0.0, 1.0]]), robot_radius_m=0)
    >>> clearance_of(grid, [(0.5, 0.5), (1.5, 0.5)], limit_m=1.0)
    Clearance(least_m=0.5, mean_m=1.0, limit_m=1.0, below=0.5, x=1.5, y=0.5)
    """
    xy = checked_points(points)
    positions = grid_positions(grid.frame, xy)
    occupied = grid.measured == CellClass.OCCUPIED
    if not occupied.any():
        return Clearance(math.inf, math.inf, limit_m, 0.0, *xy[0].tolist())
    near = kernels.neighbours_in_row(occupied)
    first, last = positions[: max(len(positions) - 1, 1)], positions[min(1, len(positions) - 1) :]
    nearest = kernels.farthest(near, first, last, -1.0, _WITHIN_CELLS)
    at = int(np.argmin(nearest[:, 1]))
    place = first[at] + nearest[at, 0] * (last[at] - first[at])
    samples, weights = _sampled(first, last)
    distances = kernels.distances_to(near, samples)
    total = weights.sum()
    mean, below = distances[0], float(distances[0] * grid.resolution_m < limit_m)
    if total > 0:
        mean = (distances * weights).sum() / total
        below = weights[distances * grid.resolution_m < limit_m].sum() / total
    x, y = grid.frame.points_of_grid(place).tolist()
    least_m, mean_m = (float(value) * grid.resolution_m for value in (nearest[at, 1], mean))
    return Clearance(least_m, mean_m, limit_m, float(below), x, y)


def _sampled(first: FloatArray, last: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the middles of equal pieces of each segment, and the length of each piece."""
    step = last - first
    length = hypots(step[:, 0], step[:, 1])
    spacing = max(_STEP_CELLS, float(length.sum()) / _MOST_STEPS)
    count: LongArray = np.maximum(np.ceil(length / spacing), 1).astype(np.int64)
    which = np.repeat(np.arange(len(first)), count)
    order = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
    share = (order + 0.5) / count[which]
    return first[which] + share[:, None] * step[which], (length / count)[which]
