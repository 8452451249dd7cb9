"""Portals of large maps, prepared once a process: they take seconds, and many tests share a map."""

from __future__ import annotations

import hashlib
from collections import OrderedDict
from typing import TYPE_CHECKING, Any

from hybridnav.portals import search as portal_search
from hybridnav.portals.distances import build_tables
from hybridnav.topology import TopologicalMap

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

LEAST_CELLS = 20_000
"""Smaller maps are prepared anew each time, as users do."""
MOST = 4
"""As many maps and settings are kept: the portals of the office weigh 100 MB."""

_SETTINGS = (
    "SPACING",
    "SPARSE_SPACINGS",
    "ALL_GATES_LEVELS",
    "MAX_BYTES_PER_CELL",
    "MAX_SPARSE_BYTES_PER_CELL",
    "LEAST_BYTES",
    "LEAST_FIELDS",
)


def remember_portals(replace: Callable[[object, str, object], None]) -> None:
    """Let planners of equal large maps share their portals, whose arrays none of them writes.

    `replace` is `setattr`, or that of a patch.
    """
    find_portals = portal_search._portals_of
    portals_of: OrderedDict[Hashable, Any] = OrderedDict()
    tables_of: OrderedDict[Hashable, Any] = OrderedDict()

    def found(topology: TopologicalMap, *choices: Any) -> Any:
        is_map = isinstance(topology, TopologicalMap)  # and nothing that stands for one
        if not is_map or topology.grid.classes.size < LEAST_CELLS:
            return find_portals(topology, *choices)
        key = _key_of(topology, *choices[1:])
        return _kept(portals_of, key, lambda: find_portals(topology, *choices))

    def built(portals: Any) -> Any:
        if not any(portals is kept[1] for kept in portals_of.values()):
            return build_tables(portals)
        # The portals stay in the record, so that no others get their id.
        return _kept(tables_of, id(portals), lambda: (portals, build_tables(portals)))[1]

    replace(portal_search, "_portals_of", found)
    replace(portal_search, "build_tables", built)


def _key_of(topology: TopologicalMap, *choices: Any) -> Hashable:
    """Return all that portals depend on: the cells, and every setting of their search."""
    grid, pyramid = topology.grid, topology.pyramid
    return (
        hashlib.blake2b(grid.classes.tobytes()).digest(),
        grid.shape,
        grid.resolution_m,
        grid.corner_cutting,
        pyramid.merge_distance_m,
        pyramid.seed,
        *choices,
        *(getattr(portal_search, name) for name in _SETTINGS),
    )


def _kept(record: OrderedDict[Hashable, Any], key: Hashable, make: Callable[[], Any]) -> Any:
    if key not in record:
        record[key] = make()
    record.move_to_end(key)
    while len(record) > MOST:
        record.popitem(last=False)
    return record[key]
