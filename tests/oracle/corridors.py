"""The corridor of the preset `paper`, by counting the arcs of a map one by one."""

from collections import Counter

import hybridnav as hn
from hybridnav.maps import CellClass


def corridor_of(
    topology: hn.TopologicalMap, route: list[int], *, allow_unexplored: bool = False
) -> list[int]:
    """The places of a route, those with two arcs to it, and those beside its ends; ascending."""
    on_route, ends = set(route), {route[0], route[-1]}
    counts: Counter[int] = Counter()
    for arc in topology.arcs.tolist():
        for one, other in (arc, arc[::-1]):
            if other in on_route:
                counts[one] += 2 if other in ends else 1
    may_enter = (topology.level.classes == CellClass.FREE) | allow_unexplored
    return sorted(on_route | {one for one, n in counts.items() if n > 1 and may_enter[one]})
