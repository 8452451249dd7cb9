"""Candidates for the nodes of a route graph: rooms, doors, places, bends, cover."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.trig import hypots, sines_and_cosines
from hybridnav.ext.graphs.attach import MANY_CANDIDATES, Network
from hybridnav.ext.graphs.judge import RIM_CELLS, FreeSpace, checked_position
from hybridnav.ext.graphs.kernels import log_uniform
from hybridnav.maps import CellClass
from hybridnav.maps.islands import unique_rows

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hybridnav._base.typing import BoolArray, FloatArray, LongArray
    from hybridnav.search.mesh import MeshPaths
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

        `candidates`: float64 (k, 2), positions in the order in which they are tried; `kind`: their
        kind; `spacing_cells`: the distance; 0 for nodes that are needed, whatever the number of
        nodes; `most`: number of nodes at which to stop; None for `most` of all; `doors`: the door
        of each; None for none.
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
        """Return the nodes at some positions; each has one."""
        rows, cols = self.positions.T
        return [int(np.argmax((rows == row) & (cols == col))) for row, col in positions]


def add_landmarks(
    nodes: Nodes, topology: TopologicalMap, is_kept: BoolArray, spacing_cells: float
) -> None:
    """Add nodes at doors, rooms and free places.

    `is_kept`: bool (n_components,), the parts of free space that get nodes; `spacing_cells`: places
    within this distance and in sight of another node are left out.
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


# Bends that make the routes of a graph short: pairs are tried, and their paths bent at nodes.

_LONG = 0.03
"""Excess of a route over the shortest path from which on the bends of that path become nodes."""
_LONG_NEAR = 0.08
"""The same for pairs round a corner, over the way round it."""
_NEARER = 0.5
"""Factor on the distance between bends, in each round."""
_LEAST_CELLS = 0.5
"""Least distance between bends, in cells: corners are one cell apart, so each may become a node."""
_DRAWS = (3, 100)
"""Least and greatest number of draws round a corner; most are no pair that bends there."""
_ALL_DRAWS = 150_000
"""Draws of all corners of a round, within these."""
_NEAREST_CELLS, _FARTHEST_M = 0.7, 4.0
"""Distances of the ends of these pairs from the corner, in cells and in metres."""
_ROUNDS = 16
_SETTLED = 0.002
"""Share of the corners at which bad pairs are left when no more are drawn."""


def bend_round_corners(
    chosen: Nodes, is_kept: BoolArray, rng: np.random.Generator, bends_cells: tuple[float, float]
) -> None:
    """Add bends until pairs round corners see one node over which the way is short.

    `chosen`: the nodes, which are added to; `is_kept`: bool (n_components,), the parts of free
    space that get nodes; `bends_cells`: distance within which one bend stands for all that it sees,
    in the first round; and how far bends are moved off the blocked cell then.
    """
    space = chosen.space
    reach = _NEAREST_CELLS, max(_FARTHEST_M / space.grid.resolution_m, 2.0)
    corners = Corners.of(space.free)
    corners = corners.where(is_kept[space.components_at(corners.nodes)])
    spacing, off = bends_cells
    pairs = np.empty((0, 2)), np.empty((0, 2)), np.empty(0)
    for _ in range(_ROUNDS):
        left = corners.where(~is_among(corners.nodes, chosen.positions))
        if len(chosen) >= chosen.most or not len(left.positions):
            return
        draws = int(np.clip(_ALL_DRAWS // len(left.positions), *_DRAWS))
        drawn = left.pairs(space, draws, rng, reach)
        starts, goals, ways = (np.concatenate(each) for each in zip(pairs, drawn, strict=True))
        is_long = ~space.sight.shared(starts, goals, (1 + _LONG_NEAR) * ways, chosen.positions)
        pairs = starts[is_long], goals[is_long], ways[is_long]
        bends = bends_of(space.paths(*pairs[:2]), range(len(pairs[0])))
        before = len(chosen)
        chosen.add(space.moved_off(bends, off), "bend", max(spacing, _LEAST_CELLS))
        if spacing <= _LEAST_CELLS and len(chosen) - before <= _SETTLED * len(corners.positions):
            return
        spacing, off = spacing * _NEARER, RIM_CELLS


def bend_paths(chosen: Nodes, edges: LongArray, pairs: tuple[FloatArray, FloatArray]) -> None:
    """Add the bends of shortest paths whose routes are too long.

    `chosen`: the nodes, which are added to; `edges`: int64 (m, 2), the edges, each once; `pairs`:
    float64 (p, 2), starts and goals.
    """
    space = chosen.space
    paths = space.paths(*pairs)
    both = np.concatenate([edges, edges[:, ::-1]])
    network = Network.of(space.sight, chosen.positions, both)
    lengths = replace(network, candidates=MANY_CANDIDATES).join(*pairs).best()
    is_long = lengths > (1 + _LONG) * paths.length_cells
    bends = bends_of(paths, np.flatnonzero(is_long).tolist())
    chosen.add(space.moved_off(bends, RIM_CELLS), "bend", _LEAST_CELLS)


# Corners of obstacles, and pairs of positions whose shortest paths bend there.


def is_among(positions: FloatArray, others: FloatArray) -> BoolArray:
    """Return which positions are among others, bool (n,), both float64 (n, 2)."""
    # One number a position: sorting rows takes ten times as long.
    one, other = (each[:, 0] * (1 << 26) + each[:, 1] for each in (positions, others))
    found: BoolArray = np.isin(one, other)
    return found


@dataclass(frozen=True, eq=False)
class Corners:
    """The lattice corners with one blocked cell of four: all that shortest paths bend at."""

    positions: FloatArray
    """float64 (n, 2), (row, col) in grid units."""
    blocked: FloatArray
    """float64 (n, 2), 1 or -1: on which side of the corner the blocked cell lies."""

    @classmethod
    def of(cls, free: BoolArray) -> Corners:
        """Find the corners.

        `free`: bool (rows, cols).
        """
        rows, cols = free.shape[0] - 1, free.shape[1] - 1
        beside = np.stack(
            [~free[row : row + rows, col : col + cols] for row in (0, 1) for col in (0, 1)]
        )
        at = np.nonzero(beside.sum(axis=0) == 1)
        which = beside[:, at[0], at[1]].argmax(axis=0)
        sides = np.stack([which // 2, which % 2], axis=1) * 2.0 - 1.0
        return cls((np.stack(at, axis=1) + 1).astype(np.float64), sides)

    @property
    def nodes(self) -> FloatArray:
        """float64 (n, 2), where nodes lie nearest to each, in the free cell across."""
        return self.positions - RIM_CELLS * self.blocked

    def where(self, chosen: BoolArray) -> Corners:
        """Return some of the corners, bool (n,)."""
        return Corners(self.positions[chosen], self.blocked[chosen])

    def pairs(
        self,
        space: FreeSpace,
        draws: int,
        rng: np.random.Generator,
        reach_cells: tuple[float, float],
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Draw pairs of centres of free cells that see a corner, but not each other.

        The way over the corner is taut. Random pairs of a whole map are far apart; these are near
        each other, where one detour counts.

        `space`: free space; `draws`: number of draws at each corner; many are no such pair;
        `reach_cells`: the least and the greatest distance of an end from the corner, in cells; its
        logarithm is uniform. Returns float64 (n, 2) starts and goals, and float64 (n,) the lengths
        of the ways over the corners, at least those of the shortest paths.
        """
        sight = space.sight
        corners = np.repeat(self.positions, draws, axis=0)
        blocked = np.repeat(self.blocked, draws, axis=0)
        angles = rng.uniform(0.0, np.pi / 2, size=(2, len(corners)))
        # Together less than a right angle, or the way over the corner is not taut.
        angles = np.where(angles.sum(axis=0) > np.pi / 2, np.pi / 2 - angles, angles)
        sines, along = sines_and_cosines(angles)
        beside = -sines
        ends: list[FloatArray] = []
        for step in ((along[0], beside[0]), (beside[1], along[1])):
            steps = np.stack(step, axis=1) * blocked
            reach = np.maximum(sight.reaches(corners, steps, reach_cells[1]), reach_cells[0])
            away = log_uniform(reach_cells[0], reach, rng.uniform(size=len(corners)))
            ends.append(np.floor(corners + away[:, None] * steps) + 0.5)
        both = np.concatenate(ends, axis=1)
        inside = (both > 0).all(axis=1) & (both < np.tile(space.free.shape, 2)).all(axis=1)
        ends, corners = [end[inside] for end in ends], corners[inside]
        fits = np.ones(len(corners), dtype=np.bool_)
        for end in ends:
            fits &= space.free[tuple(end.astype(np.int64).T)]
        for end in ends:
            fits[fits] = sight.clear(end[fits], corners[fits])
        fits[fits] = ~sight.clear(ends[0][fits], ends[1][fits])
        starts, goals, corners = ends[0][fits], ends[1][fits], corners[fits]
        return starts, goals, hypots(*(starts - corners).T) + hypots(*(goals - corners).T)
