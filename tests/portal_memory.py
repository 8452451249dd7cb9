"""Portals of large maps, prepared once a process: they take seconds, and many tests share a map."""

from __future__ import annotations

import functools
import hashlib
from collections import OrderedDict
from typing import TYPE_CHECKING, Any

from hybridnav import portals
from hybridnav.portals import BuiltPortals, PortalOptions, prepare_portals

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

    from hybridnav.topology import TopologicalMap

LEAST_CELLS = 20_000
"""Smaller maps are prepared anew each time, as users do."""
MOST = 4
"""As many maps and settings are kept: the portals of the office weigh 100 MB."""

_KEPT: OrderedDict[Hashable, BuiltPortals] = OrderedDict()


def remember_portals(replace: Callable[[object, str, object], None]) -> None:
    """Let planners of equal large maps share their portals, whose arrays none of them writes.

    `replace` is `setattr`, or that of a patch.
    """
    replace(portals, "prepare_portals", shared_portals)


@functools.wraps(prepare_portals)
def shared_portals(topology: TopologicalMap, **choices: Any) -> BuiltPortals:
    """Return what `prepare_portals` returns, of large maps the same object each time."""
    if topology.grid.classes.size < LEAST_CELLS:
        return prepare_portals(topology, **choices)
    progress = choices.pop("progress", None)
    key = _key_of(topology, **choices)
    if key not in _KEPT:
        _KEPT[key] = prepare_portals(topology, **choices)
    _KEPT.move_to_end(key)
    while len(_KEPT) > MOST:
        _KEPT.popitem(last=False)
    if progress is not None:
        progress(1, 2)
        progress(2, 2)
    return _KEPT[key]


def _key_of(
    topology: TopologicalMap,
    *,
    allow_unexplored: bool = False,
    options: PortalOptions | None = None,
) -> Hashable:
    """Return all that portals depend on: the cells, and every setting."""
    grid, pyramid = topology.grid, topology.pyramid
    return (
        hashlib.blake2b(grid.classes.tobytes()).digest(),
        grid.shape,
        grid.resolution_m,
        grid.corner_cutting,
        pyramid.merge_distance_m,
        pyramid.linkage,
        pyramid.seed,
        allow_unexplored,
        options or PortalOptions(),
    )
