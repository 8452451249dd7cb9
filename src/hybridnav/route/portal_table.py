"""The portal table: exact costs from the sources of portals to all gates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.route import _table_kernels as kernels
from hybridnav.route._portal_kernels import Tables
from hybridnav.topology.thin_portals import thinned

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import BoolArray, IntArray
    from hybridnav.topology.portals import Portals


def build_tables(
    portals: Portals, *, kept: BoolArray | None = None, bounded: bool = True
) -> tuple[Portals, Tables]:
    """Compute the table of some portals, and drop gates if asked.

    Parameters
    ----------
    portals
        Portals of a map.
    kept
        bool (G,), gates to keep, their paths and their table: routes cross at these only, while the
        bounds stay those of all gates. None keeps all.
    bounded
        Whether every border cell is a gate; else the table bounds nothing.

    Returns
    -------
    tuple
        The portals with the gates that are left, and the tables.
    """
    bound = _costs(portals)
    route = bound
    is_high = np.zeros(2 * portals.n_portals, dtype=np.bool_)
    is_high[portals.portal_sides[:, 1]] = True
    lift = np.where(is_high, portals.portal_cost[portals.side_portal], 0)
    reach = portals.side_radius.astype(np.int64) + lift
    if kept is not None:
        portals = thinned(portals, kept)
        bound = np.ascontiguousarray(bound[:, kept])
        route = _costs(portals)
    if not bounded:
        bound = np.empty((0, 0), dtype=np.float32)
    return portals, Tables(route, bound, reach, _field_of_gate(portals))


def _field_of_gate(portals: Portals) -> IntArray:
    sizes = np.diff(portals.gate_start)
    return np.repeat(np.arange(portals.n_fields, dtype=np.int32), sizes)


def _costs(portals: Portals) -> NDArray[np.float32]:
    table = np.empty((len(portals.source_gate), portals.n_gates), dtype=np.float32)
    kernels.costs_to_gates(
        portals.source_gate.astype(np.int64),
        _field_of_gate(portals),
        portals.gate_start,
        portals.clique_start,
        portals.clique,
        portals.exit_start,
        portals.exit_gate,
        portals.exit_cost,
        table,
    )
    return table
