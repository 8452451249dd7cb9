"""From a topological map to a route graph."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.trig import hypots
from hybridnav.errors import InvalidValueError, brief
from hybridnav.ext.graphs.bends import (
    Nodes,
    add_landmarks,
    bend_paths,
    bend_round_corners,
    bends_of,
)
from hybridnav.ext.graphs.judge import LEAST_AREA_M2, RIM_CELLS, FreeSpace
from hybridnav.ext.graphs.kernels import spanner
from hybridnav.ext.graphs.lanes import described
from hybridnav.ext.graphs.waypoint_graph import RouteGraph, components_of
from hybridnav.maps.checks import checked_between, checked_type
from hybridnav.topology import TopologicalMap

if TYPE_CHECKING:
    from hybridnav._base.typing import BoolArray, FloatArray, LongArray

# Edges of a route graph: a spanner of sight, joined wherever free space is.

_NEAREST = 200
"""Number of nearest nodes to which a node may have edges."""
_MOST_NODES = 1 << 31
"""More than any number of nodes, so that two nodes make one number."""
_TRIED = 8
"""Nearest nodes of other parts that are tried as partners of a part without connection."""


class SightPairs:
    """Which nodes near each other edges may join; a pair is tested once, while nodes are added."""

    def __init__(self, nodes: Nodes) -> None:
        self._nodes = nodes
        self._keys = np.empty(0, dtype=np.int64)
        self._seen = np.empty(0, dtype=np.bool_)

    def among(self, needed: LongArray) -> LongArray:
        """Return the pairs that edges may join among the nearest nodes of each.

        `needed`: int64 (k, 2), pairs in sight that count although others are nearer. Returns int64
        (m, 2), lower node first.
        """
        from scipy.spatial import KDTree  # noqa: PLC0415 - most uses of the package need no graph

        positions = self._nodes.positions
        near = min(_NEAREST, len(positions) - 1)
        heads = np.asarray(KDTree(positions).query(positions, k=list(range(2, near + 2)))[1])
        tails = np.repeat(np.arange(len(positions)), near)
        pairs = np.stack([tails, heads.ravel()], axis=1).astype(np.int64)
        pairs = np.concatenate([pairs, needed])
        # One sorted number a pair: rows take ten times as long, and unique three times.
        keys = np.sort(pairs.min(axis=1) * _MOST_NODES + pairs.max(axis=1))
        keys = keys[np.diff(keys, prepend=-1) > 0]
        tails, heads = np.divmod(keys, _MOST_NODES)
        seen = np.zeros(len(keys), dtype=np.bool_)
        at = np.searchsorted(self._keys, keys)
        is_known = at < len(self._keys)
        is_known[is_known] = self._keys[at[is_known]] == keys[is_known]
        seen[is_known] = self._seen[at[is_known]]
        new = ~is_known
        seen[new] = self._nodes.space.joins(positions[tails[new]], positions[heads[new]])
        self._keys, self._seen = keys, seen
        return np.stack([tails[seen], heads[seen]], axis=1)


def sight_edges(nodes: Nodes, known: SightPairs, stretch: float, needed: LongArray) -> LongArray:
    """Choose edges between nodes in sight of each other.

    `known`: the pairs of these nodes; `stretch`: for two nodes in sight, a route over the chosen
    edges is at most this many times as long as the segment between them; `needed`: int64 (k, 2),
    pairs in sight that count although others are nearer. Returns int64 (m, 2), lower node first, by
    length.

    Notes
    -----
    I. Althöfer, G. Das, D. Dobkin, D. Joseph, J. Soares: On sparse spanners of weighted graphs,
    1993 (the greedy spanner).
    """
    positions = nodes.positions
    if len(positions) < 2:  # noqa: PLR2004
        return np.empty((0, 2), dtype=np.int64)
    pairs = known.among(needed)
    steps = positions[pairs[:, 1]] - positions[pairs[:, 0]]
    lengths = hypots(steps[:, 0], steps[:, 1])
    order = np.argsort(lengths, kind="stable")
    pairs, lengths = pairs[order], lengths[order]
    found: LongArray = pairs[spanner(positions, pairs, lengths, stretch)]
    return found


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


_PAIRS = 3000
"""Random pairs whose shortest paths determine where nodes lie."""
_BEND_M = 0.5
"""Distance within which one bend of a random path stands for all that it sees, in metres."""
_OFF_M = 0.1
"""How far bends are moved off the blocked cell, in metres: from there more is in sight. On the map
office the routes of an equal number of nodes are 1.6 % too long instead of 2.2 %."""
_BENDS_SHARE = 0.85
"""Share of a given number of nodes that bends may take: points that see no node have no route."""
_FIRST_COVER_M = 8.0
"""Distance in metres within which points see a node first, where the number of nodes is given."""
_NEARER = 0.5
"""Factor on that distance for the bends of pairs round corners, in the first round."""
_JUDGES = 500
"""Random pairs that the graph is tried with, in the end."""
_STEPS = 5
_NO_LIMIT = 1 << 62


@dataclass(frozen=True)
class _Wanted:
    """What the user has asked for, in cells."""

    stretch: float
    spacing: float
    bend: float
    off: float
    first_cover: float


def build_route_graph(  # noqa: PLR0913 - all but the first have defaults
    topology: TopologicalMap,
    *,
    nodes: int | None = None,
    spacing_m: float = 1.0,
    stretch: float = 1.05,
    seed: int = 0,
    progress: Progress = no_progress,
) -> RouteGraph:
    """Build a route graph whose edges are straight and free for the robot.

    Nodes lie at doors, rooms and places, where shortest paths bend, and so that every free point
    sees a node nearby. Edges are segments that the robot can follow, tested exactly. Nodes are
    connected exactly where free space connects them.

    Parameters
    ----------
    topology
        The map; with rooms, nodes lie in rooms and doors too, and edges name them.
    nodes
        Number of nodes to aim at: fewer nodes, longer routes. There are more where doors, rooms and
        places, or the bends that connect them, need them. None for as many as routes within some
        percent of the shortest paths need.
    spacing_m
        Distance in metres within which every free point sees a node, unless `nodes` is reached
        before. It matters to robots that join the graph at the nearest node. With 2 m instead of 1
        m, routes from there are up to 2.8 times as long as the shortest path.
    stretch
        At least 1. Two nodes that see each other have a route at most this many times as long as
        the segment between them. With a smaller number there are more edges: 1.02 instead of 1.05
        makes 1.6 times as many.
    seed
        Seed of the random pairs whose shortest paths determine where nodes lie.
    progress
        Called with the number of steps done and of all steps.

    Returns
    -------
    RouteGraph
        Parts of free space below 1 m² have no nodes, nor has free space outside the building that
        no door joins with it, as the margin of its image. Where one node sees all, it is alone,
        without an edge; Nav2 and RMF need a smaller `spacing_m` there.

    Raises
    ------
    InvalidValueError
        When an argument is out of range, the map allows corner cutting, or no part of it is as
        large as 1 m².

    Examples
    --------
    >>> from hybridnav.ext.graphs import build_route_graph
    >>> grid = hn.OccupancyGrid(np.zeros((10, 40)), robot_radius_m=0)
    >>> pyramid = hn.DualGraphPyramid.build(grid, merge_distance_m=12.0)
    >>> graph = build_route_graph(hn.TopologicalMap(pyramid), spacing_m=8.0)
    >>> bool((graph.lengths_m > 0).all())
    True
    """
    checked_type("topology", topology, TopologicalMap)
    if nodes is not None:
        checked_between("nodes", nodes, 1, 1e7)
    checked_between("spacing_m", spacing_m, 1e-3, 1e6)
    checked_between("stretch", stretch, 1, 1e6)
    grid = topology.grid
    space = FreeSpace.of(grid)
    cell_m = grid.resolution_m
    most = _NO_LIMIT if nodes is None else nodes
    wanted = _Wanted(
        stretch,
        spacing_m / cell_m,
        _BEND_M / cell_m,
        round(_OFF_M / cell_m) + RIM_CELLS,
        max(_FIRST_COVER_M, spacing_m) / cell_m,
    )
    progress(1, _STEPS)
    chosen = Nodes(space, most)
    is_kept = space.kept(topology.rooms if topology.pyramid.rooms is not None else None)
    add_landmarks(chosen, topology, is_kept, min(wanted.bend, wanted.spacing))
    if not len(chosen):
        raise InvalidValueError(
            f"map {brief(grid.name)} has no free part of {LEAST_AREA_M2:g} m² or more for a robot "
            f"radius of {grid.robot_radius_m:g} m: give a smaller radius"
        )
    rng = np.random.default_rng(seed)
    edges = _refined(chosen, wanted, is_kept, rng, progress)
    graph = described(topology, chosen, np.concatenate([edges, edges[:, ::-1]]))
    progress(_STEPS, _STEPS)
    return graph


def _refined(
    chosen: Nodes, wanted: _Wanted, is_kept: BoolArray, rng: np.random.Generator, progress: Progress
) -> LongArray:
    """Add bends and cover until routes are short; return the edges."""
    space = chosen.space
    starts, goals = space.random_pairs(_PAIRS, rng, is_kept)
    paths = space.paths(starts, goals)
    progress(2, _STEPS)
    bends = space.moved_off(bends_of(paths, range(len(starts))), wanted.off)
    share = len(chosen) + max(0, int(_BENDS_SHARE * (chosen.most - len(chosen))))
    chosen.add(bends, "bend", wanted.bend, most=share)
    cells = np.argwhere(space.free)
    cells = cells[is_kept[space.component_of[tuple(cells.T)]]]
    centres = rng.permutation(cells) + 0.5
    if chosen.most < _NO_LIMIT:
        chosen.add(centres, "cover", wanted.first_cover)
    chosen.add(centres, "cover", wanted.spacing)
    progress(3, _STEPS)
    bend_round_corners(chosen, is_kept, rng, (wanted.bend * _NEARER, wanted.off))
    known = SightPairs(chosen)
    edges = _joined(chosen, known, wanted.stretch)
    progress(4, _STEPS)
    n_joined = len(chosen)
    if n_joined < chosen.most:
        bend_paths(chosen, edges, space.random_pairs(_JUDGES, rng, is_kept))
    return edges if len(chosen) == n_joined else _joined(chosen, known, wanted.stretch)


def _joined(chosen: Nodes, known: SightPairs, stretch: float) -> LongArray:
    """Return edges that join the nodes of each part of free space, adding bends for them."""
    paths: list[FloatArray] = []
    while True:
        needed = np.array(
            [chosen.indices_of(pair) for path in paths for pair in pairwise(path)], dtype=np.int64
        ).reshape(-1, 2)
        edges = sight_edges(chosen, known, stretch, needed)
        missing = missing_bends(chosen, edges)
        if not missing:
            return edges
        chosen.add(np.concatenate([path[1:-1] for path in missing]), "bend", 0.0)
        paths += missing
