"""Candidates for the nodes of a route graph: rooms, doors, places, bends, cover."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.graphs.space import checked_position
from hybridnav.grid import CellClass
from hybridnav.grid.runs import unique_rows

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._typing import BoolArray, FloatArray
    from hybridnav.graphs.space import FreeSpace
    from hybridnav.mesh import MeshPaths
    from hybridnav.topology import TopologicalMap


@dataclass
class Nodes:
    """Nodes chosen so far."""

    space: FreeSpace
    most: int
    """Number of nodes from which on only needed ones are added."""
    positions: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    """float64 (n, 2), (row, col) in grid units."""
    kinds: list[str] = field(default_factory=list)
    doors: list[int] = field(default_factory=list)
    """The door of each node, 0 for none."""

    def __len__(self) -> int:
        return len(self.positions)

    def add(
        self,
        candidates: FloatArray,
        kind: str,
        spacing_cells: float,
        *,
        most: int | None = None,
        doors: list[int] | None = None,
    ) -> None:
        """Add nodes one by one, unless one within a distance sees them.

        Parameters
        ----------
        candidates
            float64 (k, 2), positions in the order in which they are tried.
        kind
            Their kind.
        spacing_cells
            The distance; 0 for nodes that are needed, whatever the number of nodes.
        most
            Number of nodes at which to stop; None for `most` of all.
        doors
            The door of each; None for none.
        """
        most = self.most if most is None else most
        most = most if spacing_cells else len(self) + len(candidates)
        is_added = self.space.sight.apart(self.positions, candidates, spacing_cells, most)
        count = int(is_added.sum())
        added = [0] * count
        if doors is not None:
            added = [door for door, new in zip(doors, is_added.tolist(), strict=True) if new]
        self.positions = np.concatenate([self.positions, candidates[is_added]])
        self.kinds += [kind] * count
        self.doors += added

    def indices_of(self, positions: Iterable[FloatArray]) -> list[int]:
        """Return the nodes at some positions, all of which have one."""
        rows, cols = self.positions.T
        return [int(np.argmax((rows == row) & (cols == col))) for row, col in positions]


def add_landmarks(
    nodes: Nodes, topology: TopologicalMap, is_kept: BoolArray, spacing_cells: float
) -> None:
    """Add nodes at doors, rooms and free places.

    Parameters
    ----------
    nodes
        What they are added to.
    topology
        The map.
    is_kept
        bool (n_components,), the parts of free space that get nodes.
    spacing_cells
        Places within this distance and in sight of another node are left out.
    """
    space = nodes.space
    if topology.pyramid.rooms is not None:
        rooms = topology.rooms
        middles = rooms.level.boundary_middles
        doors = [(door.number, arc.index) for door in rooms.listed_doors for arc in door.arcs]
        at = [checked_position(space, tuple(middles[arc])) for _, arc in doors]
        _add_kept(nodes, at, "door", is_kept, [number for number, _ in doors])
        named = [name for name, fits in zip(rooms.names, rooms.fits.tolist(), strict=True) if fits]
        _add_kept(
            nodes,
            [checked_position(space, rooms.point_of(name)) for name in named],
            "room",
            is_kept,
        )
    centres = topology.level.cells[topology.classes == CellClass.FREE] + 0.5
    is_large = is_kept[space.components_at(centres)]
    nodes.add(centres[is_large], "place", spacing_cells)


def _add_kept(
    nodes: Nodes,
    positions: list[FloatArray | None],
    kind: str,
    is_kept: BoolArray,
    doors: list[int] | None = None,
) -> None:
    """Add those positions that are free, in parts of free space that get nodes."""
    doors = [0] * len(positions) if doors is None else doors
    kept = [
        (position, door)
        for position, door in zip(positions, doors, strict=True)
        if position is not None and is_kept[nodes.space.components_at(position[None])[0]]
    ]
    if kept:
        nodes.add(
            np.array([position for position, _ in kept]),
            kind,
            0.0,
            doors=[door for _, door in kept],
        )


def bends_of(paths: MeshPaths, which: Iterable[int]) -> FloatArray:
    """Return the positions at which some paths bend, float64 (n, 2), those of most paths first."""
    parts = [paths.positions[paths.path_start[k] + 1 : paths.path_start[k + 1] - 1] for k in which]
    if not parts:
        return np.empty((0, 2))
    bends = unique_rows(np.concatenate(parts))
    found: FloatArray = bends.rows[np.argsort(-bends.n_times, kind="stable")]
    return found
