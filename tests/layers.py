"""Maps and layers of costs from arrays of any type."""

from typing import Any

import hybridnav as hn


def grid_of(probability: Any, frame: hn.Frame | None = None, **settings: Any) -> hn.OccupancyGrid:
    """A map of occupancies in cells of 1 m, unless a frame is given."""
    return hn.OccupancyGrid(probability, hn.Frame() if frame is None else frame, **settings)


def layer_of(factors: Any, closed: Any = None) -> hn.CostLayer:
    return hn.CostLayer(factors, closed)
