"""Grid paths judged by other means than the package's: edge lists for scipy, plain recounting."""

import math
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, sparse
from scipy.sparse import csgraph

from hybridnav.maps import OccupancyGrid

Bools = NDArray[np.bool_]
Cells = NDArray[np.int64]
Floats = NDArray[np.float64]
Moves: TypeAlias = "sparse.csr_array[np.float64, tuple[int, int]]"

Cell = tuple[int, int]


def move_graph(enterable: Bools, standable: Bools | None = None) -> Moves:
    """Graph of the legal moves: nodes are flat cells, weights 1 and sqrt 2.

    A diagonal needs both side cells enterable, wherever they are; both its endpoints, and those of
    a step along a side, must be standable (by default: enterable).
    """
    stand = enterable if standable is None else enterable & standable
    flat = np.arange(enterable.size).reshape(enterable.shape)
    tails, heads, weights = [], [], []
    side = stand[:, :-1] & stand[:, 1:], stand[:-1] & stand[1:]
    both_sides_up = enterable[:-1, 1:] & enterable[1:, :-1]
    both_sides_down = enterable[:-1, :-1] & enterable[1:, 1:]
    up = stand[:-1, :-1] & stand[1:, 1:] & both_sides_up
    down = stand[1:, :-1] & stand[:-1, 1:] & both_sides_down
    for tail, head, legal, weight in (
        (flat[:, :-1], flat[:, 1:], side[0], 1.0),
        (flat[:-1], flat[1:], side[1], 1.0),
        (flat[:-1, :-1], flat[1:, 1:], up, math.sqrt(2)),
        (flat[1:, :-1], flat[:-1, 1:], down, math.sqrt(2)),
    ):
        tails.append(tail[legal])
        heads.append(head[legal])
        weights.append(np.full(int(legal.sum()), weight))
    entries = np.concatenate(weights), (np.concatenate(tails), np.concatenate(heads))
    graph = sparse.coo_array(entries, shape=(enterable.size, enterable.size))
    return graph.tocsr()


def distances(graph: Moves, shape: tuple[int, int], source: Cell) -> Floats:
    """Shortest distance from one cell to every cell, infinite where there is no path."""
    flat = source[0] * shape[1] + source[1]
    return csgraph.dijkstra(graph, directed=False, indices=[flat]).reshape(shape)


def weighted(graph: Any, factors: Any) -> Any:
    """Graph of moves with lengths times the mean factors of their cells, as floats."""
    entries = graph.tocoo()
    tails, heads = entries.coords
    flat = factors.ravel()
    weights = entries.data * (flat[tails] + flat[heads]) / 2
    return sparse.coo_array((weights, (tails, heads)), shape=graph.shape).tocsr()


def counted(cells: Any, factors: Any) -> float:
    """Cost of a path of cells, counted move by move."""
    along = factors[cells[:, 0], cells[:, 1]]
    lengths = np.hypot(*np.diff(cells, axis=0).T)
    return float((lengths * (along[1:] + along[:-1]) / 2).sum())


def assert_legal(cells: Any, enterable: Bools, standable: Bools | None = None) -> None:
    """Assert that a path stands on legal cells and moves legally; corners on the whole grid."""
    path = np.asarray(cells)
    assert path.ndim == 2
    assert path.shape[1] == 2
    assert len(path) >= 1
    assert (path >= 0).all()
    assert (path < enterable.shape).all()
    stand = enterable if standable is None else enterable & standable
    assert stand[path[:, 0], path[:, 1]].all(), "stands on a cell that may not be entered"
    step = np.abs(np.diff(path, axis=0))
    assert (step.max(axis=1) == 1).all() if len(step) else True, "consecutive cells do not touch"
    # For a step along a side the two cells tested here are its own endpoints.
    here, there = path[:-1], path[1:]
    assert enterable[here[:, 0], there[:, 1]].all(), "cuts a corner"
    assert enterable[there[:, 0], here[:, 1]].all(), "cuts a corner"


def moves(cells: Any) -> tuple[int, int]:
    """Steps along a side and along a diagonal of a path of 8-neighbour moves."""
    turned = (np.diff(cells, axis=0) != 0).all(axis=1)
    diagonal = int(turned.sum())
    return len(turned) - diagonal, diagonal


def recounted(cells: Any) -> float:
    """Length in cells of a path of 8-neighbour moves, a + b sqrt 2 with counted a and b."""
    straight, diagonal = moves(cells)
    return straight + diagonal * math.sqrt(2)


def centre(grid: OccupancyGrid, cell: Cell) -> tuple[float, float]:
    """Centre of a cell in the map frame, by the definition of the frame and not by its code."""
    y, x = ((index + 0.5) * grid.resolution_m for index in cell)
    yaw = grid.frame.yaw_rad
    return (
        grid.frame.origin_m[0] + x * math.cos(yaw) - y * math.sin(yaw),
        grid.frame.origin_m[1] + x * math.sin(yaw) + y * math.cos(yaw),
    )


def length_of_points(points: Floats) -> float:
    return math.fsum(np.hypot(*np.diff(points, axis=0).T).tolist())


def components(enterable: Bools) -> NDArray[np.int32]:
    """Label of the connected set of each cell, 0 where none may be entered.

    A diagonal needs both its sides, so 4-neighbours decide what is connected.
    """
    labels, _ = ndimage.label(enterable)
    return np.asarray(labels, dtype=np.int32)


def inflated(occupied: Bools, radius_cells: float) -> Bools:
    """Cells whose centre lies within a radius of the centre of an occupied cell."""
    if not occupied.any():
        return np.zeros_like(occupied)
    distance = ndimage.distance_transform_edt(~occupied)
    # Distances are roots of whole numbers: no other one lies within 1e-6 of the radius.
    blocked: Bools = np.asarray(distance) <= radius_cells + 1e-6
    return blocked
