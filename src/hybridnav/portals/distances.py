"""The portal table: exact costs from the sources of portals to all gates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.portals import _table_kernels as kernels
from hybridnav.portals._path_kernels import UNREACHED, Tables
from hybridnav.portals._side_kernels import entries_of
from hybridnav.search._costs import DIAGONAL

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import IntArray
    from hybridnav.portals.build import Portals

AT_ONCE = 256
"""So many rows are worked on together, to keep what is thrown away small."""


def build_tables(portals: Portals) -> Tables:
    """Compute the tables of some portals.

    Parameters
    ----------
    portals
        Portals of a map.

    Returns
    -------
    Tables
        Rounded by as many bits as the longest way needs.
    """
    source_at = np.full(portals.n_gates, -1, dtype=np.int32)
    source_at[portals.source_gate] = np.arange(len(portals.source_gate))
    shift = 0
    while True:
        route, between, greatest = _tables(portals, source_at, shift)
        if greatest + DIAGONAL >> shift < UNREACHED:
            return Tables(route, between, shift, portals.gate_field, source_at)
        shift = greatest.bit_length() - 31


def _tables(
    portals: Portals, source_at: IntArray, shift: int
) -> tuple[NDArray[np.uint32], NDArray[np.uint32], int]:
    """The table from sources to gates, that between sides, and the greatest cost in the first."""
    sources, field_of = portals.source_gate.astype(np.int64), portals.gate_field
    table = np.empty((len(sources), portals.n_gates), dtype=np.uint32)
    to_sides = np.empty((len(sources), portals.n_sides), dtype=np.uint32)
    greatest = 0
    for first in range(0, len(sources), AT_ONCE):
        rows = slice(first, first + AT_ONCE)
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
    return table, _between(portals, source_at, to_sides, shift), greatest


def _between(
    portals: Portals, source_at: IntArray, to_sides: NDArray[np.uint32], shift: int
) -> NDArray[np.uint32]:
    """Least costs from side to side, of ways that enter the second one's field over it."""
    place, source, step = entries_of(portals, source_at, 0, len(portals.side_gates))
    begin = np.searchsorted(place, portals.side_gates_start)
    step = (step >> shift).astype(np.uint32)
    between = np.empty((portals.n_sides, portals.n_sides), dtype=np.uint32)
    for first in range(0, portals.n_sides, AT_ONCE):
        last = min(first + AT_ONCE, portals.n_sides)
        rows = slice(begin[first], begin[last])
        costs = to_sides[source[rows]]
        costs += np.where(costs == UNREACHED, np.uint32(0), step[rows, None])
        at = begin[first:last] - begin[first]
        # Ways from side to side are the same in both directions, but for their last step.
        between[:, first:last] = np.minimum.reduceat(costs, at, axis=0).T
    return between
