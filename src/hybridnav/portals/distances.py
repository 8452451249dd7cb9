"""The portal table: exact costs from the sources of portals to all gates."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from hybridnav.portals import _table_kernels as kernels
from hybridnav.portals._path_kernels import UNREACHED
from hybridnav.portals._side_kernels import entries_of
from hybridnav.portals.options import DEFAULT_OPTIONS
from hybridnav.search.moves import DIAGONAL

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import IntArray
    from hybridnav.portals.build import Portals
    from hybridnav.portals.options import PortalOptions


class Tables(NamedTuple):
    """Costs between sources and gates; S sources, G gates, R sides."""

    distance: np.ndarray
    """uint32 (S, G), costs of shortest paths over gates without their last `shift` bits,
    `UNREACHED` for none."""
    between: np.ndarray
    """uint32 (R, R), the least cost between gates of two of the R sides, likewise."""
    shift: int
    """0, but on maps with paths of more than 53,000 cells."""
    gate_field: np.ndarray
    """int32 (G,), the field of each gate."""
    source_at: np.ndarray
    """int32 (G,), a source at each gate, -1 for none."""


def build_tables(portals: Portals, options: PortalOptions = DEFAULT_OPTIONS) -> Tables:
    """Compute the tables of some portals.

    Parameters
    ----------
    portals
        Portals of a map.
    options
        How many rows are computed at once, and how many bits are dropped at least.

    Returns
    -------
    Tables
        Rounded by as many bits as the longest path needs.

    Examples
    --------
    >>> from hybridnav.portals import build_portals, build_tables
    >>> grid = hn.OccupancyGrid(np.zeros((2, 4)), robot_radius_m=0)
    >>> portals = build_portals(grid, np.array([[0, 0, 1, 1], [0, 0, 1, 1]], dtype=np.int32))
    >>> build_tables(portals).distance.shape
    (2, 4)
    """
    source_at = np.full(portals.n_gates, -1, dtype=np.int32)
    source_at[portals.source_gate] = np.arange(len(portals.source_gate))
    shift = options.dropped_bits
    while True:
        distance, between, greatest = _tables(portals, source_at, shift, options.rows_at_once)
        if greatest + DIAGONAL >> shift < UNREACHED:
            return Tables(distance, between, shift, portals.gate_field, source_at)
        shift = greatest.bit_length() - 31


def _tables(
    portals: Portals, source_at: IntArray, shift: int, at_once: int
) -> tuple[NDArray[np.uint32], NDArray[np.uint32], int]:
    """Return the table from sources to gates, that between sides, and the greatest cost in the
    first."""
    sources, field_of = portals.source_gate.astype(np.int64), portals.gate_field
    table = np.empty((len(sources), portals.n_gates), dtype=np.uint32)
    to_sides = np.empty((len(sources), portals.n_sides), dtype=np.uint32)
    greatest = 0
    for first in range(0, len(sources), at_once):
        rows = slice(first, first + at_once)
        longest = kernels.costs_to_gates(
            sources[rows],
            field_of,
            portals.gate_start,
            portals.clique_start,
            portals.clique,
            portals.exit_start,
            portals.exit_gate,
            portals.exit_cost,
            shift,
            table[rows],
        )
        greatest = max(greatest, int(longest))
        of_sides = table[rows, portals.side_gates]
        np.minimum.reduceat(of_sides, portals.side_gates_start[:-1], axis=1, out=to_sides[rows])
    return table, _between(portals, source_at, to_sides, (shift, at_once)), greatest


def _between(
    portals: Portals, source_at: IntArray, to_sides: NDArray[np.uint32], how: tuple[int, int]
) -> NDArray[np.uint32]:
    """Return the least costs from side to side, of paths that enter the second one's field over
    it."""
    shift, at_once = how
    place, source, step = entries_of(portals, source_at, 0, len(portals.side_gates))
    begin = np.searchsorted(place, portals.side_gates_start)
    step = (step >> shift).astype(np.uint32)
    between = np.empty((portals.n_sides, portals.n_sides), dtype=np.uint32)
    for first in range(0, portals.n_sides, at_once):
        last = min(first + at_once, portals.n_sides)
        rows = slice(begin[first], begin[last])
        costs = to_sides[source[rows]]
        costs += np.where(costs == UNREACHED, np.uint32(0), step[rows, None])
        at = begin[first:last] - begin[first]
        # Ways from side to side are the same in both directions, but for their last step.
        between[:, first:last] = np.minimum.reduceat(costs, at, axis=0).T
    return between
