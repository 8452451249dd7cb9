"""The structures that searches over portals need, built from a map."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain, islice
from typing import TYPE_CHECKING

from hybridnav._progress import no_progress
from hybridnav.errors import InvalidValueError
from hybridnav.portals.build import PathTooLongError, PortalsTooLargeError, build_portals
from hybridnav.portals.distances import build_tables
from hybridnav.portals.fields import compact_labels, routing_levels
from hybridnav.portals.options import DEFAULT_OPTIONS

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np
    from numpy.typing import NDArray

    from hybridnav._progress import Progress
    from hybridnav._typing import BoolArray
    from hybridnav.portals.build import Portals
    from hybridnav.portals.distances import Tables
    from hybridnav.portals.options import PortalOptions
    from hybridnav.pyramid import Level
    from hybridnav.topology import TopologicalMap


@dataclass(frozen=True, eq=False)
class BuiltPortals:
    """Fields, portals and tables of a map."""

    field_of: NDArray[np.int16 | np.int32]
    """int16 or int32 (rows, cols), the field of each cell, -1 for none."""
    portals: Portals
    tables: Tables
    has_all_gates: bool
    """Whether every border cell is a gate."""


def prepare_portals(
    topology: TopologicalMap,
    *,
    allow_unexplored: bool = False,
    options: PortalOptions = DEFAULT_OPTIONS,
    progress: Progress = no_progress,
) -> BuiltPortals:
    """Build the portals of a map, those of the first fields that fit into memory.

    The fields are the regions of `topology.pyramid.with_regions(...)`, a level above the places.
    Where these take too much memory, or paths inside them are too long, fewer border cells become
    gates, and levels below are tried.

    Parameters
    ----------
    topology
        The map; its pyramid goes on above the places.
    allow_unexplored
        Whether unexplored cells may be entered.
    options
        Sizes and limits.
    progress
        Called after each step with the number of steps done and of all.

    Returns
    -------
    BuiltPortals
        Fields, portals and tables, ready for `PortalSearch`.

    Raises
    ------
    InvalidValueError
        When no level of the map has portals within the limits.

    Examples
    --------
    >>> from hybridnav.portals import prepare_portals
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(hn.example_map("figure1")))
    >>> prepare_portals(topology).has_all_gates
    True
    """
    enterable = topology.grid.enterable(allow_unexplored=allow_unexplored)
    field_of, portals, has_all_gates = _first_that_fits(
        topology, enterable, allow_unexplored, options
    )
    progress(1, 2)
    built = BuiltPortals(field_of, portals, build_tables(portals, options), has_all_gates)
    progress(2, 2)
    return built


def _first_that_fits(
    topology: TopologicalMap,
    enterable: BoolArray,
    allow_unexplored: bool,  # noqa: FBT001 - private
    options: PortalOptions,
) -> tuple[NDArray[np.int16 | np.int32], Portals, bool]:
    """Return fields, their portals, and whether every border cell is a gate."""
    n_cells = max(int(enterable.sum()), 1)
    levels = routing_levels(topology.pyramid, enterable, options)
    for level, spacing, gate_spacing in _choices(levels, options):
        field_of = compact_labels(level.field_of, enterable)
        has_all_gates = gate_spacing == 1
        per_cell = options.most_sparse_bytes_per_cell
        if has_all_gates:
            per_cell = options.most_bytes_per_cell
        try:
            portals = build_portals(
                topology.grid,
                field_of,
                spacing_cells=spacing,
                gate_spacing_cells=gate_spacing,
                allow_unexplored=allow_unexplored,
                max_bytes=max(per_cell * n_cells, options.least_bytes),
            )
        except (PortalsTooLargeError, PathTooLongError):
            continue
        return field_of, portals, has_all_gates
    raise InvalidValueError("no level of the map makes portals of an acceptable size")


def _choices(levels: Iterator[Level], options: PortalOptions) -> Iterator[tuple[Level, int, int]]:
    """Yield levels and the spacings of portals and of gates, those with gates everywhere first."""
    first = list(islice(levels, options.all_border_cells_levels))
    for level in first:
        yield level, options.spacing_cells, 1
    for level in chain(first, levels):
        for spacing in options.sparse_spacings_cells:
            yield level, spacing, spacing
