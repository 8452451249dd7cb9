"""The portal table: exact costs from the sources of portals to all gates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.route import _table_kernels as kernels
from hybridnav.route._portal_kernels import UNREACHED, Tables
from hybridnav.search._costs import DIAGONAL
from hybridnav.topology.portal_layout import offsets_of
from hybridnav.topology.thin_portals import with_paths_only

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import IntArray
    from hybridnav.topology.portals import Portals

AT_ONCE = 256
"""So many rows are worked on together, to keep what is thrown away small."""


def build_tables(portals: Portals) -> tuple[Portals, Tables]:
    """Compute the tables of some portals, and drop the gates to which no paths are stored.

    Parameters
    ----------
    portals
        Portals of a map.

    Returns
    -------
    tuple
        The portals with the gates that are left, and the tables: ways cross at these only, while
        what is known between sides stays that of all gates.
    """
    shift = 0
    while True:
        route, between, greatest = _tables(portals, shift)
        if greatest + DIAGONAL >> shift < UNREACHED:
            break
        shift = greatest.bit_length() - 31
    if route is None:
        portals = with_paths_only(portals)
        route = np.empty((len(portals.source_gate), portals.n_gates), dtype=np.uint32)
        _fill(portals, portals.source_gate, shift, route)
    source_at = np.full(portals.n_gates, -1, dtype=np.int32)
    source_at[portals.source_gate] = np.arange(len(portals.source_gate))
    return portals, Tables(route, between, shift, portals.gate_field, source_at)


def _tables(
    portals: Portals, shift: int
) -> tuple[NDArray[np.uint32] | None, NDArray[np.uint32], int]:
    """The table of all gates, None if some of them will go, that between sides, the longest way."""
    field_of = portals.gate_field
    tail = np.repeat(np.arange(portals.n_gates), np.diff(portals.exit_start))
    sources = np.unique(tail[field_of[tail] < field_of[portals.exit_gate]]).astype(np.int32)
    keeps_all = bool((np.diff(portals.row_start) > 0).all())
    height = len(sources) if keeps_all else min(AT_ONCE, len(sources))
    table = np.empty((height, portals.n_gates), dtype=np.uint32)
    to_sides = np.empty((len(sources), portals.n_sides), dtype=np.uint32)
    greatest = 0
    for first in range(0, len(sources), AT_ONCE):
        rows = slice(first, min(first + AT_ONCE, len(sources)))
        part = table[rows] if keeps_all else table[: rows.stop - rows.start]
        greatest = max(greatest, _fill(portals, sources[rows], shift, part))
        of_sides = part[:, portals.side_gates]
        np.minimum.reduceat(of_sides, portals.side_gates_start[:-1], axis=1, out=to_sides[rows])
    return table if keeps_all else None, _between(portals, sources, to_sides, shift), greatest


def _between(
    portals: Portals, sources: IntArray, to_sides: NDArray[np.uint32], shift: int
) -> NDArray[np.uint32]:
    """Least costs from side to side, of ways that enter the second one's field over it."""
    source_at = np.full(portals.n_gates, -1, dtype=np.int64)
    source_at[sources] = np.arange(len(sources))
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
