"""A waypoint graph in the manner of NVIDIA SWAGGER, written anew from a description of its method.

It is not SWAGGER, which needs CUDA and an environment of its own, and no line is taken from it. The
steps, their order and the distances are those that its pages describe
(https://github.com/nvidia-isaac/SWAGGER, docs/algorithm.md and docs/tutorial.md): nodes along the
skeleton of the space that is free for the robot, along contours round the obstacles, and where
neither is near; edges along the skeleton and those of a Delaunay triangulation; then close nodes
are merged and crumbs removed. Two things are this code's own: every edge is tested exactly against
the cells, and a piece of the skeleton that bends is halved until its halves are free.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import networkx as nx
import numpy as np
from numpy.typing import ArrayLike
from scipy import ndimage
from scipy.spatial import Delaunay, KDTree, QhullError
from skimage import feature, measure, morphology

from hybridnav._base.typing import BoolArray, LongArray
from hybridnav.refine import Sight

Cell = tuple[int, int]

SKELETON_M = 1.5
"""Most metres between two nodes along the skeleton."""
INFLATION = 1.5
"""Contours run at this many times the robot's radius from obstacles, or, for a point, a cell and a
half from them."""
BOUNDARY_M = 2.5
"""Metres between two nodes along a contour."""
SPACE_M = 1.5
"""Metres from all nodes and obstacles from which on free space gets a node of its own."""
MERGE_M = 0.25
"""Metres within which two nodes become one."""
CRUMB_M = 0.25
"""Metres of edges below which a part of the graph is left out."""

_MOST_ROUNDS = 20
"""Times that free space is filled; a few are enough on all maps of the study."""
_AROUND = tuple((row, col) for row in (-1, 0, 1) for col in (-1, 0, 1) if row or col)


@dataclass(frozen=True)
class Distances:
    """What a cell and a robot measure, for the distances above."""

    cell_m: float
    radius_m: float

    def cells(self, metres: float) -> float:
        """Return a distance in cells."""
        return metres / self.cell_m


def skeleton_of(free: BoolArray) -> BoolArray:
    """Return the skeleton of free space, bool (rows, cols)."""
    padded = morphology.skeletonize(np.pad(free, 1))  # type: ignore[no-untyped-call]
    return np.asarray(padded[1:-1, 1:-1], dtype=np.bool_)


def swagger_like(
    free: BoolArray, skeleton: BoolArray, sizes: Distances
) -> tuple[LongArray, LongArray]:
    """Return nodes and edges.

    `free`: bool (rows, cols), the cells that the centre of the robot may enter; `skeleton`: bool
    (rows, cols), their skeleton; `sizes`: sides of cells, and the radius by which obstacles have
    grown. Returns int64 (n, 2), the cells of the nodes as (row, col), sorted; int64 (m, 2), edges,
    once for both directions.
    """
    sight = Sight(free)
    graph: nx.Graph[Cell] = nx.Graph()
    _add_skeleton(graph, skeleton, sight, sizes)
    _add_contours(graph, free, sizes)
    _fill_space(graph, free, sizes)
    _triangulate(graph, sight)
    _merge(graph, sight, sizes)
    _remove_crumbs(graph, sizes)
    cells = sorted(graph)
    index = {cell: at for at, cell in enumerate(cells)}
    edges = sorted(sorted((index[tail], index[head])) for tail, head in graph.edges)
    nodes = np.array(cells, dtype=np.int64).reshape(-1, 2)
    return nodes, np.array(edges, dtype=np.int64).reshape(-1, 2)


def _sees(sight: Sight, tails: ArrayLike, heads: ArrayLike) -> BoolArray:
    """Return which cells see each other from centre to centre."""
    first, second = (np.asarray(ends, dtype=np.float64) + 0.5 for ends in (tails, heads))
    return sight.clear(first, second)


def _add_skeleton(
    graph: nx.Graph[Cell], skeleton: BoolArray, sight: Sight, sizes: Distances
) -> None:
    """Add nodes along the branches of the skeleton, and edges between consecutive ones."""
    step = max(1, int(sizes.cells(SKELETON_M)))
    for branch in branches(skeleton):
        n_pieces = -(-(len(branch) - 1) // step)
        ends = np.linspace(0, len(branch) - 1, n_pieces + 1).round().astype(int).tolist()
        graph.add_nodes_from(branch[at] for at in ends)
        waiting = list(pairwise(ends))
        while waiting:
            clear = _sees(
                sight, [branch[low] for low, _ in waiting], [branch[high] for _, high in waiting]
            )
            pieces = list(zip(waiting, clear.tolist(), strict=True))
            graph.add_edges_from(
                (branch[low], branch[high]) for (low, high), is_ok in pieces if is_ok
            )
            bent = [piece for piece, is_ok in pieces if not is_ok and piece[1] - piece[0] > 1]
            halves = [(low, (low + high) // 2, high) for low, high in bent]
            graph.add_nodes_from(branch[middle] for _, middle, _ in halves)
            waiting = [piece for half in halves for piece in pairwise(half)]


def branches(skeleton: BoolArray) -> list[list[Cell]]:
    """Return the branches of a skeleton as runs of cells, ends included.

    A branch runs between two cells that have another number of neighbours than two, or round a ring
    without such a cell.
    """
    cells = {(row, col) for row, col in np.argwhere(skeleton).tolist()}
    beside = {
        (row, col): [cell for at in _AROUND if (cell := (row + at[0], col + at[1])) in cells]
        for row, col in cells
    }
    knots = [cell for cell in sorted(cells) if len(beside[cell]) != 2]
    seen: set[Cell] = set(knots)
    done: set[tuple[Cell, Cell]] = set()
    found: list[list[Cell]] = [[cell] for cell in knots if not beside[cell]]
    for knot in knots:
        for first in beside[knot]:
            if (knot, first) not in done:
                found.append(_followed(knot, first, beside, seen))
                done.add((found[-1][-1], found[-1][-2]))
    for cell in sorted(cells - seen):
        if cell not in seen:
            seen.add(cell)
            found.append(_followed(cell, beside[cell][0], beside, seen))
    return found


def _followed(
    knot: Cell, first: Cell, beside: dict[Cell, list[Cell]], seen: set[Cell]
) -> list[Cell]:
    """Return the branch from a knot by way of a neighbour to the next knot."""
    branch = [knot, first]
    while branch[-1] != knot and len(beside[branch[-1]]) == 2:
        seen.add(branch[-1])
        one, other = beside[branch[-1]]
        branch.append(other if one == branch[-2] else one)
    return branch


def _add_contours(graph: nx.Graph[Cell], free: BoolArray, sizes: Distances) -> None:
    """Add nodes along contours round the obstacles."""
    away = ndimage.distance_transform_edt(np.pad(free, 1))
    level = max(1.5, 1.0 + (INFLATION - 1) * sizes.cells(sizes.radius_m))
    step = sizes.cells(BOUNDARY_M)
    for line in measure.find_contours(away, level):  # type: ignore[no-untyped-call]
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
        n_nodes = int(along[-1] // step)
        at = np.searchsorted(along, step * np.arange(n_nodes))
        for row, col in (np.rint(line[at]).astype(int) - 1).tolist():
            if free[row, col]:
                graph.add_node((row, col))


def _fill_space(graph: nx.Graph[Cell], free: BoolArray, sizes: Distances) -> None:
    """Add nodes where no node and no obstacle is near, until there is no such place."""
    least = sizes.cells(SPACE_M)
    left = np.pad(free, 1)
    for row, col in graph:
        left[row + 1, col + 1] = False
    for _ in range(_MOST_ROUNDS):
        away = ndimage.distance_transform_edt(left)
        peaks = feature.peak_local_max(  # type: ignore[no-untyped-call]
            away, min_distance=max(1, int(least)), threshold_abs=least, exclude_border=False
        )
        if not len(peaks):
            return
        left[tuple(peaks.T)] = False
        graph.add_nodes_from((row - 1, col - 1) for row, col in peaks.tolist())


def _triangulate(graph: nx.Graph[Cell], sight: Sight) -> None:
    """Add the edges of a Delaunay triangulation that are free."""
    cells = np.array(sorted(graph), dtype=np.int64).reshape(-1, 2)
    try:
        corners = Delaunay(cells).simplices
    except (QhullError, ValueError):  # too few nodes, or all on one line
        return
    sides = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]])
    sides = np.unique(np.sort(sides, axis=1), axis=0)
    ends = cells[sides]
    for tail, head in ends[_sees(sight, ends[:, 0], ends[:, 1])].tolist():
        graph.add_edge(tuple(tail), tuple(head))


def _merge(graph: nx.Graph[Cell], sight: Sight, sizes: Distances) -> None:
    """Merge close nodes where the edges of both stay free."""
    cells = sorted(graph)
    if not cells:
        return
    close = KDTree(np.array(cells)).query_pairs(sizes.cells(MERGE_M))
    for first, second in sorted(close):
        kept, gone = cells[first], cells[second]
        if kept not in graph or gone not in graph:
            continue
        moved = [cell for cell in graph[gone] if cell != kept]
        heads = [gone, *moved]
        if _sees(sight, [kept] * len(heads), heads).all():
            graph.remove_node(gone)
            graph.add_edges_from((kept, cell) for cell in moved)


def _remove_crumbs(graph: nx.Graph[Cell], sizes: Distances) -> None:
    """Remove parts of the graph with hardly any edges."""
    least = sizes.cells(CRUMB_M)
    for part in list(nx.connected_components(graph)):
        edges = graph.subgraph(part).edges
        length = sum(float(np.hypot(t[0] - h[0], t[1] - h[1])) for t, h in edges)
        if length < least or len(part) == 1:
            graph.remove_nodes_from(part)
