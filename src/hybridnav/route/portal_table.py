"""The portal table: exact costs from the sources of portals to all gates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.route import _table_kernels as kernels
from hybridnav.route._portal_kernels import UNREACHED, Tables
from hybridnav.search._costs import DIAGONAL
from hybridnav.topology.portal_layout import offsets_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import IntArray
    from hybridnav.topology.portals import Portals

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
    sources = portals.source_gate
    table = np.empty((len(sources), portals.n_gates), dtype=np.uint32)
    to_sides = np.empty((len(sources), portals.n_sides), dtype=np.uint32)
    greatest = 0
    for first in range(0, len(sources), AT_ONCE):
        rows = slice(first, first + AT_ONCE)
        greatest = max(greatest, _fill(portals, sources[rows], shift, table[rows]))
        of_sides = table[rows, portals.side_gates]
        np.minimum.reduceat(of_sides, portals.side_gates_start[:-1], axis=1, out=to_sides[rows])
    return table, _between(portals, source_at, to_sides, shift), greatest


def _between(
    portals: Portals, source_at: IntArray, to_sides: NDArray[np.uint32], shift: int
) -> NDArray[np.uint32]:
    """Least costs from side to side, of ways that enter the second one's field over it."""
    gates = portals.side_gates.astype(np.int64)
    is_source = source_at[gates] >= 0
    n_entries = np.where(is_source, 1, np.diff(portals.exit_start)[gates])
    starts = offsets_of(n_entries)
    exits = np.arange(starts[-1]) - np.repeat(starts[:-1] - portals.exit_start[gates], n_entries)
    own = np.repeat(is_source, n_entries)
    source = np.where(own, source_at[np.repeat(gates, n_entries)], 0)
    source[~own] = source_at[portals.exit_gate[exits[~own]]]
    step = np.zeros(len(source), dtype=np.uint32)
    step[~own] = portals.exit_cost[exits[~own]] >> shift
    begin = starts[portals.side_gates_start]
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


def _fill(portals: Portals, sources: IntArray, shift: int, table: NDArray[np.uint32]) -> int:
    """Fill the table of some sources; gives the greatest cost in it."""
    return int(
        kernels.costs_to_gates(
            sources.astype(np.int64),
            portals.gate_field,
            portals.gate_start,
            portals.clique_start,
            portals.clique,
            portals.exit_start,
            portals.exit_gate,
            portals.exit_cost,
            shift,
            table,
        )
    )
