"""Layers of costs that follow a map: what stays on its cells, and what is outdated."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from hybridnav.costs import CostLayer
from hybridnav.grid import CellClass, OccupancyGrid
from hybridnav.grid.checks import checked_type
from hybridnav.grid.clearance import within_radius
from hybridnav.online.shift import placed, shift_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._typing import BoolArray


class CarriedCosts(NamedTuple):
    """A layer of costs on a newer map, and where it could not be kept.

    Examples
    --------
    >>> from hybridnav.online import carry_costs
    >>> before = hn.OccupancyGrid(np.array([[0.0, 0.0, 0.0]]), robot_radius_m=0)
    >>> after = hn.OccupancyGrid(np.array([[0.0, 0.0, 1.0]]), robot_radius_m=0)
    >>> layer = hn.CostLayer.clearance(before) | hn.CostLayer(np.array([[2.0, 1.0, 1.0]]))
    >>> carry_costs(layer, before, after).outdated
    array([[False,  True,  True]])
    """

    layer: CostLayer
    """The layer."""
    outdated: BoolArray
    """bool (rows, cols), cells whose factor depends on obstacles that have changed, but could not
    be computed anew. They have the factors that they had, new ones 1."""


def carry_costs(layer: CostLayer, before: OccupancyGrid, after: OccupancyGrid) -> CarriedCosts:
    """Carry a layer of costs over to a map that has changed or grown.

    Factors and closed cells stay on their cells, whatever became of these; new cells have the
    factor 1 and are open. A layer of clearance is made anew from its settings. Where it was joined
    with others, what it contributed is not known any more: cells within its inflation radius of an
    obstacle that came or went are returned as outdated, and new ones within that of any obstacle.

    Parameters
    ----------
    layer
        A layer of the older map.
    before, after
        The maps; the newer one has to cover the older one, cell on cell.

    Returns
    -------
    CarriedCosts
        The layer on the newer map, and the cells that are outdated.

    Raises
    ------
    InvalidValueError
        When the layer is not one of the older map, or the newer map does not cover that.

    Examples
    --------
    >>> from hybridnav.online import carry_costs
    >>> before = hn.OccupancyGrid(np.zeros((1, 2)), robot_radius_m=0)
    >>> after = hn.OccupancyGrid(np.zeros((1, 3)), robot_radius_m=0)
    >>> carried = carry_costs(hn.CostLayer(np.array([[2.0, 4.0]])), before, after)
    >>> carried.layer.factors, carried.outdated.any()
    (array([[2., 4., 1.]], dtype=float32), np.False_)
    """
    checked_type("layer", layer, CostLayer)
    checked_type("before", before, OccupancyGrid)
    checked_type("after", after, OccupancyGrid)
    layer.check_fits(before)
    shift = shift_of(before, after, otherwise="make the costs for the new map")
    nothing = np.zeros(after.shape, np.bool_)
    if layer.source["kind"] == "clearance":
        return CarriedCosts(CostLayer.clearance(after, **_settings(layer.source)), nothing)
    factors = placed(layer.factors, after.shape, shift, 1)
    closed, keepout = (
        None if cells is None else placed(cells, after.shape, shift, 0)
        for cells in (layer.closed, layer.keepout)
    )
    reach_m = max((part["inflation_radius_m"] for part in _clearances(layer.source)), default=None)
    if reach_m is None:
        outdated = nothing
    else:
        is_occupied = after.measured == CellClass.OCCUPIED
        was = placed(before.measured == CellClass.OCCUPIED, after.shape, shift, 0)
        new = placed(np.zeros(before.shape, np.bool_), after.shape, shift, 1)
        cells = math.ceil(reach_m / after.resolution_m)
        outdated = within_radius(was != is_occupied, radius_cells=cells)
        outdated |= new & within_radius(is_occupied, radius_cells=cells)
    return CarriedCosts(CostLayer(factors, closed, layer.source, keepout), outdated)


def _settings(source: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in source.items() if name != "kind"}


def _clearances(source: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield the sources of the layers of clearance that a layer was joined from."""
    if source["kind"] == "clearance":
        yield source
    for part in source.get("of", ()):
        yield from _clearances(part)
