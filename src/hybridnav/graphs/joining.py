"""Nodes of a route graph, and paths that join its parts where free space does."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from hybridnav._base.typing import FloatArray, LongArray
from hybridnav.graphs.free_space import FreeSpace
from hybridnav.graphs.waypoint_graph import components_of

_TRIED = 8
"""Nearest nodes of other parts that are tried as partners of a part without connection."""


@dataclass
class Nodes:
    """Nodes of a route graph in free space."""

    space: FreeSpace
    positions: FloatArray
    """float64 (n, 2), (row, col) in grid units."""
    kinds: list[str] = field(default_factory=list)
    doors: list[int] = field(default_factory=list)
    """The door of each node, 0 for none."""

    def indices_of(self, positions: Iterable[FloatArray]) -> list[int]:
        """Return the nodes at some positions; each has one."""
        rows, cols = self.positions.T
        return [int(np.argmax((rows == row) & (cols == col))) for row, col in positions]


def missing_bends(nodes: Nodes, edges: LongArray) -> list[FloatArray]:
    """Find paths that join parts of a graph which free space connects.

    `edges`: the edges between them. Returns for each part but the largest in its part of free
    space, positions on the shortest path to one of the nearest nodes of another part, (row, col) in
    grid units.
    """
    positions = nodes.positions
    part = components_of(len(positions), edges, "weak")
    component = nodes.space.components_at(positions)
    starts, goals = [], []
    for where in np.unique(component).tolist():
        inside = np.flatnonzero(component == where)
        parts, sizes = np.unique(part[inside], return_counts=True)
        for one in np.delete(parts, int(sizes.argmax())).tolist():
            mine, others = inside[part[inside] == one], inside[part[inside] != one]
            steps = positions[others][:, None] - positions[mine][None]
            away = (steps**2).sum(axis=2).min(axis=1)
            for other in others[np.argsort(away, kind="stable")[:_TRIED]].tolist():
                steps = positions[mine] - positions[other]
                starts.append(mine[int((steps**2).sum(axis=1).argmin())])
                goals.append(other)
    if not starts:
        return []
    paths = nodes.space.paths(positions[starts], positions[goals])
    best: dict[int, int] = {}
    for k, start in enumerate(starts):
        known = best.get(int(part[start]), k)
        best[int(part[start])] = min(known, k, key=lambda at: paths.length_cells[at])
    lines = np.split(paths.positions, paths.path_start[1:-1])
    return [nodes.space.joinable(lines[k]) for k in best.values()]
