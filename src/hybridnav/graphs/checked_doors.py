"""Doors that no edge of a graph passes, and rooms in which no node lies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.graphs.facts import DoorsPassed
from hybridnav.grid.lines import cells_of_line
from hybridnav.grid.runs import unique_rows

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray
    from hybridnav.graphs.findings import Findings
    from hybridnav.graphs.placed import PlacedGraph
    from hybridnav.graphs.space import FreeSpace
    from hybridnav.topology import Rooms, TopologicalMap

Counts = tuple[int, int]


def add_rooms_and_doors(  # noqa: PLR0913, PLR0917 - one call, all of it needed
    findings: Findings,
    topology: TopologicalMap,
    placed: PlacedGraph,
    is_clear: BoolArray,
    space: FreeSpace,
    is_large: BoolArray,
) -> tuple[Counts, Counts]:
    """Add doors that no edge passes, and rooms without nodes.

    Parameters
    ----------
    findings
        What they are added to.
    topology
        The map; without rooms nothing is added.
    placed
        The graph on the map.
    is_clear
        bool (m,), the edges that the robot can follow.
    space
        Free space.
    is_large
        bool (n_components,), the parts of free space that need nodes.

    Returns
    -------
    tuple
        Number of doors that edges pass and of all, of rooms with nodes and of all.
    """
    if topology.pyramid.rooms is None:
        return (0, 0), (0, 0)
    rooms = topology.rooms
    part_of = space.component_of.ravel()
    is_kept = (part_of >= 0) & is_large[part_of]
    passes = DoorsPassed(rooms)
    passed: set[int] = set()
    clear = np.flatnonzero(is_clear)
    # Both directions of a straight edge pass the same doors.
    first = unique_rows(np.sort(placed.edges[clear], axis=1)).first
    for edge in {*clear[first].tolist(), *placed.lines} & set(clear.tolist()):
        passed |= set(passes.passed(cells_of_line(space.free, placed.line_of(edge))))
    wanted = [
        door
        for door in rooms.listed_doors
        if door.passable and is_kept[rooms.cells_beside(door.number)].any()
    ]
    for door in wanted:
        if door.number not in passed:
            names = " and ".join("no room" if name is None else name for name in door.rooms)
            findings.add("missing-door", f"door {door.number} between {names}", door.position)
    met = sum(door.number in passed for door in wanted)
    return (met, len(wanted)), _add_rooms(findings, rooms, placed, is_kept)


def _add_rooms(findings: Findings, rooms: Rooms, placed: PlacedGraph, is_kept: BoolArray) -> Counts:
    label_of = rooms.labels.label_of
    visited = set(label_of[tuple(placed.cells[placed.is_free].T)].tolist())
    inside = np.zeros(len(rooms.names), dtype=np.bool_)
    labels = label_of.ravel()[is_kept]
    inside[labels[labels >= 0]] = True
    wanted = [name for name in rooms.names if inside[rooms.labels.index(name)]]
    missing = [name for name in wanted if rooms.labels.index(name) not in visited]
    for name in missing:
        findings.add("missing-room", f"room {name}", rooms.point_of(name))
    return len(wanted) - len(missing), len(wanted)
