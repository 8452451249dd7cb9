"""Lower bounds on any-angle paths, from the straight distances between the sides of fields."""

from __future__ import annotations

import math
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.portals._any_angle_kernels import least_over_boxes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from hybridnav._typing import FloatArray
    from hybridnav.portals.build import Portals

Position = tuple[float, float]


class AnyAngleBound:
    """A bound on the length of every path in free space between two points.

    A path that leaves a field passes one of its portals, through the square of one of the portal's
    border cells. Between two portals it is at least as long as the straight line between the boxes
    of these squares, and so is a path of several such legs as the shortest path over portals.

    Parameters
    ----------
    portals
        Portals whose boxes hold all border cells.
    """

    def __init__(self, portals: Portals) -> None:
        self._side_start = portals.side_start
        # As first and last edge along each axis: a cell is a closed square.
        self._box = portals.side_box.astype(np.float64) + np.array([0, 1, 0, 1])
        self._portal = np.empty(len(self._box), dtype=np.int64)
        self._portal[portals.portal_sides] = np.arange(len(portals.portal_sides))[:, None]

    def of(self, field: int, goal_field: int, start: Position, goal: Position) -> float:
        """Return a lower bound in cells on all paths between two points.

        Parameters
        ----------
        field, goal_field
            The fields of the cells that hold the points.
        start, goal
            Points as (row, column) in grid units: cell (0, 0) spans [0, 1] x [0, 1].
        """
        line = math.dist(start, goal)
        if field == goal_field:
            return line
        first, last = self._side_start[field : field + 2], self._side_start[goal_field:]
        sides = int(first[0]), int(first[1]), int(last[0]), int(last[1])
        over = least_over_boxes(self._box, self._portal, self._between, sides, start, goal)
        return max(line, float(over))

    @cached_property
    def _between(self) -> NDArray[np.float32]:
        """float32 (P, P), least lengths from portal to portal, rounded down."""
        n = len(self._box) // 2
        pairs = [np.empty((3, 0))]
        for first, last in zip(self._side_start[:-1], self._side_start[1:], strict=True):
            if last - first > 1:
                box = self._box[first:last]
                apart = _gaps(box[:, None], box[None])
                i, j = np.nonzero(~np.eye(len(box), dtype=np.bool_))
                portal = self._portal[first:last]
                pairs.append(np.stack([portal[i], portal[j], apart[i, j]]))
        tail, head, length = np.concatenate(pairs, axis=1)
        # The same two portals may share two fields; zero would be no edge.
        order = np.lexsort((length, head, tail))
        tail, head, length = tail[order], head[order], length[order]
        kept = np.ones(len(tail), dtype=np.bool_)
        kept[1:] = (np.diff(tail) != 0) | (np.diff(head) != 0)
        entries = np.maximum(length[kept], 1e-9), (tail[kept].astype(int), head[kept].astype(int))
        # Most planners have no portals, and it takes as long to load as they all.
        from scipy import sparse  # noqa: PLC0415
        from scipy.sparse import csgraph  # noqa: PLC0415

        graph = sparse.coo_array(entries, shape=(n, n)).tocsr()
        costs = csgraph.dijkstra(graph) if n else np.empty((0, 0))
        below: NDArray[np.float32] = np.nextafter(
            np.maximum(costs * (1 - 1e-6) - 1e-3, 0).astype(np.float32), np.float32(0)
        )
        return below


def _gaps(box: FloatArray, other: FloatArray) -> FloatArray:
    """Return the distances between boxes, four numbers along the last axis."""
    down = np.maximum(box[..., 0] - other[..., 1], other[..., 0] - box[..., 1])
    right = np.maximum(box[..., 2] - other[..., 3], other[..., 2] - box[..., 3])
    gaps: FloatArray = np.hypot(np.maximum(down, 0), np.maximum(right, 0))
    return gaps
