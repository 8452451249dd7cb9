"""Costs of any-angle paths: exact integrals of the factors of cells along polylines."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from hybridnav._base.kernels.exact import GRAIN
from hybridnav._base.typing import FloatArray
from hybridnav.errors import InvalidValueError
from hybridnav.maps import Frame, OccupancyGrid
from hybridnav.maps.checks import checked_points
from hybridnav.maps.costs.kernels import legal_cost, line_cost, segment_cost
from hybridnav.maps.costs.layer import CostLayer

__all__ = ["cost_along", "legal_cost", "segment_cost"]

_OFF = 1e-6
"""Cells by which a point may lie outside the map by rounding."""


def cost_along(grid: OccupancyGrid, layer: CostLayer, points: ArrayLike) -> float:
    """Return the cost of a polyline: the integral of the factors of the cells along it.

    On the line between two cells the larger of their factors counts.

    Parameters
    ----------
    grid
        The map.
    layer
        Costs of its cells.
    points
        `(x, y)` in metres, map frame, shape (n, 2), n >= 1, on the map. They are rounded to 2^-24
        of a cell.

    Returns
    -------
    float
        Metres, each counted as many times as the factor of its cell states.

    Raises
    ------
    InvalidValueError
        When the points are no finite array of shape (n, 2), or one lies outside the map, or the
        layer is one of another map.

    Examples
    --------
    >>> from hybridnav.maps.costs import cost_along
    >>> grid = hn.OccupancyGrid(np.zeros((1, 3)), robot_radius_m=0)
    >>> layer = hn.CostLayer(np.array([[1.0, 2.0, 4.0]]))
    >>> cost_along(grid, layer, [(0.5, 0.5), (2.5, 0.5)])
    4.5
    """
    layer.check_fits(grid)
    xy = checked_points(points)
    positions = _positions_on(grid.frame, xy)
    most = np.array(grid.shape, dtype=np.float64)
    outside = ((positions < -_OFF) | (positions > most + _OFF)).any(axis=1)
    if outside.any():
        x, y = xy[int(outside.argmax())].tolist()
        raise InvalidValueError(f"point ({x:.3f}, {y:.3f}) m lies outside the map")
    cost = line_cost(layer.factors, np.clip(positions, 0.0, most))
    return float(cost) * grid.resolution_m


def _positions_on(frame: Frame, points: FloatArray) -> FloatArray:
    """Return points `(x, y)` in metres as positions (row, col), rounded to 2^-24 of a cell."""
    return np.rint(frame.positions_of(points) * GRAIN) / GRAIN
