"""Corridors: the receptive fields that a refiner may stand on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, IntArray, LongArray
    from hybridnav.topology import TopologicalMap


@dataclass(frozen=True, eq=False)
class Corridor:
    """Union of the receptive fields of some places. Moves are judged on the whole grid: a corridor
    limits only the cells stood on."""

    field_of: IntArray
    """int32 (rows, cols), the place of each cell."""
    places: BoolArray
    """bool (n_places,), those in the corridor."""
    n_cells: int
    """Number of cells in the corridor."""

    def mask(self) -> BoolArray:
        """Return the cells in the corridor, bool (rows, cols)."""
        inside: BoolArray = (self.field_of >= 0) & self.places[self.field_of]
        return inside


def corridor_of(
    topology: TopologicalMap, places: LongArray, *, neighbours: BoolArray | None = None
) -> Corridor:
    """Return the receptive fields of the places of a route.

    Parameters
    ----------
    topology
        The map of the route.
    places
        Dense indices of the route's places.
    neighbours
        bool (n_places,), places to include too where an arc joins them to the route; None for
        the route alone.

    Returns
    -------
    Corridor
        The places, and the number of their cells.

    Examples
    --------
    >>> from hybridnav.route import corridor_of
    >>> pyramid = hn.DualGraphPyramid.build(hn.OccupancyGrid(np.zeros((1, 30))))
    >>> corridor_of(hn.TopologicalMap(pyramid), np.array([0, 1])).n_cells
    10
    """
    inside = np.zeros(topology.n_places, dtype=np.bool_)
    inside[places] = True
    if neighbours is not None:
        touched = inside[topology.arcs].any(axis=1)
        beside = np.zeros_like(inside)
        beside[topology.arcs[touched].ravel()] = True
        inside |= beside & neighbours
    return Corridor(topology.level.field_of, inside, int(topology.level.areas[inside].sum()))
