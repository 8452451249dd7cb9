"""Costs as the judges read them: of cheapest paths of cells, and of arcs of circles. Public:
`Chords` and `chords_of`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.trig import cos, hypot, hypots, sin, sines_and_cosines
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.harness.judges.kernels import cheapest_cost
from hybridnav.maps import CellClass
from hybridnav.maps.checks import checked_cell, checked_points, checked_type

if TYPE_CHECKING:
    from hybridnav.harness.judges.judge import Cell
    from hybridnav.maps import OccupancyGrid
    from hybridnav.maps.costs import CostLayer


class CheapestCost:
    """Dijkstra's algorithm on the legal moves of a grid, with a factor in each cell.

    A move costs its length times the mean factor of its two cells. With the planners this shares
    the classes of the cells and their factors; the search is its own, in floating point. It takes
    24 bytes a cell.

    Parameters
    ----------
    grid
        The map. Free cells are entered; whether corners may be cut is that of the map.
    layer
        Costs of its cells; None for lengths. Cells that it closes are not entered.

    Raises
    ------
    InvalidValueError
        When the grid or the layer is none, or the layer is one of another map.

    Examples
    --------
    >>> from hybridnav.harness.judges import CheapestCost
    >>> grid = hn.OccupancyGrid(np.zeros((2, 3)), robot_radius_m=0)
    >>> layer = hn.CostLayer(np.array([[1.0, 9.0, 1.0], [1.0, 1.0, 1.0]]))
    >>> round(CheapestCost(grid, layer).cost_m((0, 0), (0, 2)), 3)
    2.828
    """

    def __init__(self, grid: OccupancyGrid, layer: CostLayer | None = None) -> None:
        # What imports the other judges needs neither settings nor costs.
        from hybridnav.maps import OccupancyGrid  # noqa: PLC0415
        from hybridnav.maps.costs import CostLayer  # noqa: PLC0415

        checked_type("grid", grid, OccupancyGrid)
        free = np.array(grid.classes == CellClass.FREE)
        factors = np.ones(grid.shape)
        if layer is not None:
            checked_type("layer", layer, CostLayer).check_fits(grid)
            factors = layer.factors.astype(np.float64)
            free.flat[layer.inflated(grid).closed_flat] = False
        self._factors = np.pad(np.where(free, factors, 0.0), 1)
        self._cuts_corners = grid.corner_cutting
        self._shape = grid.shape
        self._resolution_m = grid.resolution_m

    def cost_m(self, start: Cell, goal: Cell) -> float:
        """Return the cost of a cheapest path between two cells in metres, a sum of moves.

        It is infinite where there is no path.

        Parameters
        ----------
        start, goal
            (row, col), inside the map.

        Raises
        ------
        InvalidValueError
            When start or goal is no cell of the map.

        Notes
        -----
        E. W. Dijkstra: A note on two problems in connexion with graphs, 1959.
        """
        (rows, cols), flat = self._shape, []
        for name, cell in (("start", start), ("goal", goal)):
            row, col = checked_cell(name, cell)
            if not (0 <= row < rows and 0 <= col < cols):
                raise InvalidValueError(
                    f"{name} is cell ({row}, {col}), expected one of the map of {rows} rows and "
                    f"{cols} columns: give a cell inside"
                )
            flat.append((row + 1) * (cols + 2) + col + 1)
        if not self._factors.ravel()[flat].all():
            return np.inf
        cost = cheapest_cost(self._factors, self._cuts_corners, flat[0], flat[1])
        return float(cost) * self._resolution_m


# Arcs of circles as the judges read them: by short chords, with lengths in closed form.

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
        lengths_m = hypots(steps[:, 0], steps[:, 1])
        return float((lengths_m * (near.max(axis=0) - near.min(axis=0))).sum())


def chords_of(grid: OccupancyGrid, points: ArrayLike, headings_rad: ArrayLike) -> Chords:
    """Return a path of lines and arcs as a polyline.

    From each point to the next the path is a line, if both have the same heading, else the arc of a
    circle that is tangent to both. Between two equal points the robot turns on the spot.

    Parameters
    ----------
    grid
        The map, for the size of its cells.
    points
        `(x, y)` in metres, map frame, shape (n, 2), n >= 1, finite.
    headings_rad
        The direction of travel at each point, shape (n,), finite, counter-clockwise from the x
        axis.

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
        chord_m = hypot(*step.tolist())
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
    return start + np.stack([along, across], axis=1)
