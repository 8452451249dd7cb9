"""Bends that make the routes of a graph short: pairs are tried, and their paths bent at nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from hybridnav.graphs.attach import MANY_CANDIDATES, Network
from hybridnav.graphs.corners import Corners, is_among
from hybridnav.graphs.nodes import bends_of
from hybridnav.graphs.space import RIM_CELLS

if TYPE_CHECKING:
    from hybridnav._typing import BoolArray, FloatArray, LongArray
    from hybridnav.graphs.nodes import Nodes

_LONG = 0.03
"""Excess of a route over the shortest path from which on the bends of that path become nodes."""
_LONG_NEAR = 0.08
"""The same for pairs round a corner, over the way round it."""
_NEARER = 0.5
"""Factor on the distance between bends, in each round."""
_LEAST_CELLS = 0.5
"""Least distance between bends, in cells: corners are one cell apart, so each may become a node."""
_DRAWS = (3, 100)
"""Least and greatest number of draws round a corner, most of which are no pair that bends there."""
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

    Parameters
    ----------
    chosen
        The nodes, which are added to.
    is_kept
        bool (n_components,), the parts of free space that get nodes.
    rng
        Source of random numbers.
    bends_cells
        Distance within which one bend stands for all that it sees, in the first round; and how far
        bends are moved off the blocked cell then.
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

    Parameters
    ----------
    chosen
        The nodes, which are added to.
    edges
        int64 (m, 2), the edges, each once.
    pairs
        float64 (p, 2), starts and goals.
    """
    space = chosen.space
    paths = space.paths(*pairs)
    both = np.concatenate([edges, edges[:, ::-1]])
    network = Network.of(space.sight, chosen.positions, both).with_candidates(MANY_CANDIDATES)
    lengths = network.join(*pairs).best()
    is_long = lengths > (1 + _LONG) * paths.length_cells
    bends = bends_of(paths, np.flatnonzero(is_long).tolist())
    chosen.add(space.moved_off(bends, RIM_CELLS), "bend", _LEAST_CELLS)
