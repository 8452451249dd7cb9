"""Portals with fewer gates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.topology.portal_layout import offsets_of, starts_of

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray
    from hybridnav.topology.portals import Portals


def beside_sources(portals: Portals) -> BoolArray:
    """bool (G,), the gates that sources lie at, and the nearest ones across from them."""
    kept = np.zeros(portals.n_gates, dtype=np.bool_)
    kept[portals.source_gate] = True
    kept[portals.side_gate] = True
    order = np.lexsort((portals.side_gates_cost, portals.side_gates_source))
    side = np.repeat(np.arange(2 * portals.n_portals), np.diff(portals.side_gates_start))
    is_high = np.zeros(2 * portals.n_portals, dtype=np.bool_)
    is_high[portals.portal_sides[:, 1]] = True
    order = order[is_high[side[order]]]
    source = portals.side_gates_source[order]
    first = np.ones(len(order), dtype=np.bool_)
    first[1:] = np.diff(source) != 0
    kept[portals.side_gates[order[first]]] = True
    return kept


def thinned(portals: Portals, kept: BoolArray) -> Portals:
    """The same portals with some of their gates.

    Parameters
    ----------
    portals
        All sources and all gates that stand for portals must be kept.
    kept
        bool (G,), gates to keep.
    """
    new_gate = np.cumsum(kept, dtype=np.int32) - np.int32(1)
    of_gate = np.repeat(np.arange(portals.n_gates), np.diff(portals.exit_start))
    exits = kept[of_gate] & kept[portals.exit_gate]
    sides = kept[portals.side_gates]
    of_side = np.repeat(np.arange(2 * portals.n_portals), np.diff(portals.side_gates_start))
    lengths = np.diff(portals.row_start)
    n_kept = int(kept.sum())
    clique, sizes = [], []
    for f in range(portals.n_fields):
        own = kept[portals.gate_start[f] : portals.gate_start[f + 1]]
        costs = portals.clique[portals.clique_start[f] : portals.clique_start[f + 1]]
        clique.append(costs.reshape(len(own), len(own))[np.ix_(own, own)].ravel())
        sizes.append(int(own.sum()))
    return portals._replace(
        gate_start=offsets_of(np.array(sizes, dtype=np.int64)),
        gate_cell=portals.gate_cell[kept],
        row_start=offsets_of(lengths[kept]),
        rows=portals.rows[np.repeat(kept, lengths)],
        clique_start=offsets_of(np.array(sizes, dtype=np.int64) ** 2),
        clique=np.concatenate([np.empty(0, dtype=np.int32), *clique]),
        exit_start=starts_of(new_gate[of_gate[exits]], n_kept),
        exit_gate=new_gate[portals.exit_gate[exits]],
        exit_cost=portals.exit_cost[exits],
        exit_portal=portals.exit_portal[exits],
        side_gate=new_gate[portals.side_gate],
        side_gates_start=starts_of(of_side[sides], 2 * portals.n_portals),
        side_gates=new_gate[portals.side_gates[sides]],
        side_gates_source=portals.side_gates_source[sides],
        side_gates_cost=portals.side_gates_cost[sides],
        source_gate=new_gate[portals.source_gate],
    )
