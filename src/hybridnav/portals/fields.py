"""Fields to route on: levels of pyramids that are grown for planning alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.errors import InvalidValueError
from hybridnav.grid import CellClass
from hybridnav.portals.options import DEFAULT_OPTIONS
from hybridnav.pyramid import DualGraphPyramid

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray
    from hybridnav.portals.options import PortalOptions
    from hybridnav.pyramid import Level
    from hybridnav.topology import TopologicalMap


def routing_levels(
    topology: TopologicalMap, options: PortalOptions = DEFAULT_OPTIONS
) -> Iterator[Level]:
    """Yield levels to route on: the one with the largest fields that make enough of them first,
    then larger ones, which have fewer portals, then smaller ones, which have shorter paths.

    Parameters
    ----------
    topology
        The map; its grid, its merge distance and its seed are used.
    options
        How large and how many the fields of the first level are.
    """
    pyramid, resolution_m = topology.pyramid, topology.grid.resolution_m
    widest_m = 2 * max(topology.grid.shape) * resolution_m

    def level_of(distance_m: float) -> Level:
        return DualGraphPyramid.build(
            topology.grid, merge_distance_m=distance_m, linkage="survivor", seed=pyramid.seed
        )[-1]

    first_m = min(options.merge_distance_factor * pyramid.merge_distance_m, widest_m)
    level = level_of(first_m)
    while not _has_fields(level, options.least_fields) and first_m >= 8 * resolution_m:
        first_m /= 2
        level = level_of(first_m)
    yield level
    distance_m = 2 * first_m
    while distance_m < 2 * widest_m:
        yield level_of(distance_m)
        distance_m *= 2
    distance_m = first_m / 2
    while distance_m > resolution_m:
        yield level_of(distance_m)
        distance_m /= 2


def _has_fields(level: Level, least: int) -> bool:
    large = level.areas[level.classes == CellClass.FREE] > level.areas.max(initial=0) / 100
    return int(large.sum()) >= least


def compact_labels(
    field_of: NDArray[np.int16 | np.int32], enterable: BoolArray
) -> NDArray[np.int16 | np.int32]:
    """Number the fields of the cells that may be entered from 0, in their order.

    Parameters
    ----------
    field_of
        int32 (rows, cols), the field of each of these cells.
    enterable
        bool (rows, cols).

    Returns
    -------
    NDArray
        (rows, cols), -1 for all other cells; int16 where that is enough.

    Raises
    ------
    InvalidValueError
        When a cell that may be entered is in no field.
    """
    if field_of.shape != enterable.shape or (field_of[enterable] < 0).any():
        raise InvalidValueError("every cell that may be entered must be in a field")
    is_used = np.zeros(int(field_of.max(initial=-1)) + 1, dtype=np.bool_)
    is_used[field_of[enterable]] = True
    number = np.cumsum(is_used) - 1
    fits = len(is_used) == 0 or number[-1] <= np.iinfo(np.int16).max
    label = np.full(field_of.shape, -1, dtype=np.int16 if fits else np.int32)
    label[enterable] = number[field_of[enterable]]
    return label
