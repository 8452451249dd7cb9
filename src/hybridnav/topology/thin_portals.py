"""Portals with fewer gates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.topology.portal_layout import offsets_of, starts_of

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray
    from hybridnav.topology.portals import Portals


def with_paths_only(portals: Portals) -> Portals:
    """The same portals without the gates to which no paths are stored."""
    kept: BoolArray = np.diff(portals.row_start) > 0
    new_gate = np.cumsum(kept, dtype=np.int32) - np.int32(1)
    of_gate = np.repeat(np.arange(portals.n_gates), np.diff(portals.exit_start))
    exits = kept[of_gate] & kept[portals.exit_gate]
    sides = kept[portals.side_gates]
    of_side = np.repeat(np.arange(portals.n_sides), np.diff(portals.side_gates_start))
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
        clique_start=offsets_of(np.array(sizes, dtype=np.int64) ** 2),
        clique=np.concatenate([np.empty(0, dtype=np.int32), *clique]),
        exit_start=starts_of(new_gate[of_gate[exits]], n_kept),
        exit_gate=new_gate[portals.exit_gate[exits]],
        exit_cost=portals.exit_cost[exits],
        side_gates_start=starts_of(of_side[sides], portals.n_sides),
        side_gates=new_gate[portals.side_gates[sides]],
        source_gate=new_gate[portals.source_gate],
    )
