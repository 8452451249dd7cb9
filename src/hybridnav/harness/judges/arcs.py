"""Arcs of circles as the judges read them: by short chords, with lengths in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.trig import cos, sin, sines_and_cosines
from hybridnav.errors import InvalidValueError
from hybridnav.maps.checks import checked_points

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from hybridnav._base.typing import FloatArray
    from hybridnav.maps import OccupancyGrid
    from hybridnav.maps.costs import CostLayer

_SAGITTA_CELLS = 1e-4
"""Greatest distance of a chord from its arc."""
_CHORD_CELLS, _CHORD_RAD = 0.05, 0.01
"""Longest chord, and greatest turn of an arc on it: it is 4e-6 shorter than its arc."""
_PRICED_CHORD_CELLS = 0.25
"""Chords along which methods may price arcs."""
_OFF_CELLS = 1e-4
"""Distance by which the endpoint of a step may lie off the curve that its headings describe."""
_LEAST_TURN_RAD = 1e-9


@dataclass(frozen=True, eq=False)
class Chords:
    """A path of lines and arcs as a polyline that is nowhere more than 1e-4 of a cell off it.

    Examples
    --------
    >>> from hybridnav.harness.judges import chords_of
    >>> grid = hn.OccupancyGrid(np.zeros((3, 3)), robot_radius_m=0)
    >>> chords = chords_of(grid, [(0.5, 0.5), (1.5, 1.5)], [0.0, np.pi / 2])
    >>> chords.cost_slack_m(grid, hn.CostLayer(np.ones((3, 3))))
    0.0
    """

    points: FloatArray
    """float64 (m, 2), `(x, y)` in metres, map frame."""
    off_m: FloatArray
    """float64 (m - 1,), the distance within which chords of a quarter of a cell lie from the arc of
    each segment; 0 for straight ones."""
    length_m: float
    """Length of lines and arcs, in closed form."""
    faults: tuple[str, ...]
    """Steps that are neither lines nor arcs tangent to both headings."""

    def cost_slack_m(self, grid: OccupancyGrid, layer: CostLayer) -> float:
        """Return by how much the costs of a path may differ whose arcs are priced along chords of a
        quarter of a cell.

        Within the distance of such a chord a segment may meet another cell: the difference is at
        most its length times the range of the factors there.

        Parameters
        ----------
        grid
            The map.
        layer
            Costs of its cells.

        Returns
        -------
        float
            Metres of cost.
        """
        bent = self.off_m > 0
        positions = grid.frame.positions_of(self.points)
        ends = np.stack([positions[:-1][bent], positions[1:][bent]])
        off = (self.off_m[bent] / grid.resolution_m + _SAGITTA_CELLS)[:, np.newaxis]
        most = np.array(grid.shape) - 1
        low = np.clip(np.floor(ends.min(axis=0) - off), 0, most).astype(np.int64)
        high = np.clip(np.floor(ends.max(axis=0) + off), 0, most).astype(np.int64)
        near = np.stack(
            [layer.factors[rows[:, 0], cols[:, 1]] for rows in (low, high) for cols in (low, high)]
        )
        steps = np.diff(self.points, axis=0)[bent]
        lengths_m = np.hypot(steps[:, 0], steps[:, 1])
        return float((lengths_m * (near.max(axis=0) - near.min(axis=0))).sum())


def chords_of(grid: OccupancyGrid, points: ArrayLike, headings_rad: ArrayLike) -> Chords:
    """Return a path of lines and arcs as a polyline.

    From each point to the next the path is a line, if both have the same heading, else the arc of a
    circle that is tangent to both; between two equal points the robot turns on the spot.

    Parameters
    ----------
    grid
        The map, for the size of its cells.
    points
        `(x, y)` in metres, map frame, shape (n, 2), n >= 1, finite.
    headings_rad
        The direction of travel at each point, shape (n,), finite, counter-clockwise from the x
        axis.

    Returns
    -------
    Chords
        The polyline, the length of the path, and its faults.

    Raises
    ------
    InvalidValueError
        When points or headings are not finite arrays of these shapes.

    Examples
    --------
    >>> from hybridnav.harness.judges import chords_of
    >>> grid = hn.OccupancyGrid(np.zeros((3, 3)), robot_radius_m=0)
    >>> chords = chords_of(grid, [(0.5, 0.5), (1.5, 1.5)], [0.0, np.pi / 2])
    >>> round(chords.length_m, 6), chords.faults
    (1.570796, ())
    """
    xy = checked_points(points)
    headings = np.asarray(headings_rad, dtype=np.float64)
    if headings.shape != (len(xy),) or not np.isfinite(headings).all():
        raise InvalidValueError(
            f"headings have the shape {headings.shape}, expected {len(xy)} finite numbers: state "
            "one for each point"
        )
    side_m = grid.resolution_m
    parts, off_m, lengths_m, faults = [xy[:1]], [np.empty(0)], [0.0], []
    for at in range(len(xy) - 1):
        step = xy[at + 1] - xy[at]
        chord_m = math.hypot(*step.tolist())
        if chord_m == 0:  # on the spot
            continue
        turn = (headings[at + 1] - headings[at] + math.pi) % math.tau - math.pi
        middle = headings[at] + turn / 2
        aside_m = abs(cos(middle) * step[1] - sin(middle) * step[0])
        ahead_m = cos(middle) * step[0] + sin(middle) * step[1]
        if aside_m > _OFF_CELLS * side_m or ahead_m < 0:
            faults.append(
                f"step {at} of the path is neither a line nor an arc tangent to its headings"
            )
        # A step longer than the map ends outside, where judges of segments find it.
        if abs(turn) < _LEAST_TURN_RAD or chord_m > sum(grid.shape) * side_m:
            parts.append(xy[at + 1 : at + 2])
            off_m.append(np.zeros(1))
            lengths_m.append(chord_m)
            continue
        radius_m = chord_m / (2 * sin(abs(turn) / 2))
        parts.append(_arc(xy[at], headings[at], turn, radius_m, side_m))
        parts[-1][-1] = xy[at + 1]
        priced_chord_m = _PRICED_CHORD_CELLS * side_m
        priced_m = priced_chord_m * priced_chord_m / (8 * radius_m)
        off_m.append(np.full(len(parts[-1]), priced_m))
        lengths_m.append(radius_m * abs(turn))
    return Chords(np.concatenate(parts), np.concatenate(off_m), math.fsum(lengths_m), tuple(faults))


def _arc(
    start: FloatArray, heading_rad: float, turn_rad: float, radius_m: float, side_m: float
) -> FloatArray:
    """Return points along an arc, without the first one."""
    chord_m = min(math.sqrt(8 * _SAGITTA_CELLS * side_m * radius_m), _CHORD_CELLS * side_m)
    n = max(2, math.ceil(max(radius_m / chord_m, 1 / _CHORD_RAD) * abs(turn_rad)))
    hand = math.copysign(1.0, turn_rad)
    angles = heading_rad + turn_rad * np.arange(1, n + 1) / n
    sines, cosines = sines_and_cosines(angles)
    along = hand * radius_m * (sines - sin(heading_rad))
    across = hand * radius_m * (cos(heading_rad) - cosines)
    found: FloatArray = start + np.stack([along, across], axis=1)
    return found
