"""State of the mesh's kernels: `Mesh`; what is searched, `MeshBlocks`, `Corners` or `Hierarchy`;
their work arrays; rooms and targets of views; `MeshClosure`.

Points are x = column, y = row in grid units: corners are whole numbers. Kernels that exist for each
kind of graph, or of target, are chosen by the class of the tuple.
"""

from typing import NamedTuple

import numpy as np

GROWING = frozenset(
    {"from_goal", "from_start", "heap", "keys", "real", "seen", "room", "values", "whole"}
)
"""Fields with room that a query may run out of."""


class Mesh(NamedTuple):
    """A mesh; see `ConvexMesh` for a field that says nothing here."""

    x: np.ndarray
    """float64 (n,), of the corners."""
    y: np.ndarray
    kinds: np.ndarray
    first: np.ndarray
    begins: np.ndarray
    finishes: np.ndarray
    """int32 (s,), the corner at which each side ends."""
    twins: np.ndarray
    polygon_of: np.ndarray
    component: np.ndarray


class Ends(NamedTuple):
    """The free cells of start and goal, and `ConvexMesh.polygon_at` there."""

    row: int
    col: int
    to_row: int
    to_col: int
    polygon: int
    to_polygon: int


class MeshBlocks(NamedTuple):
    """What a query of intervals searches: the blocks of a mesh and their tree; see `blocks_of`."""

    block_of: np.ndarray
    """int32 (s,), the block of each slot, -1 for walls."""
    head: np.ndarray
    """int32 (b,), the polygon of each block that is nearest to the root."""
    up: np.ndarray
    """int32 (p,), the block through which each polygon is reached from the root, -1 for a root."""
    component: np.ndarray
    """int32 (p,), of each polygon."""
    depth: np.ndarray
    """int32 (p,), steps from the root in the tree of blocks."""


class Corners(NamedTuple):
    """The graph of the corners of a mesh, with landmarks; see `CornerGraph`."""

    first: np.ndarray
    heads: np.ndarray
    landmark_distances: np.ndarray


class Hierarchy(NamedTuple):
    """The contracted graph of the corners of a mesh; see `CornerHierarchy`."""

    first: np.ndarray
    arcs: np.ndarray
    middles: np.ndarray
    follow: np.ndarray


class Heap(NamedTuple):
    """A binary heap."""

    keys: np.ndarray
    """float64 (m,)."""
    values: np.ndarray
    """int32 (m,)."""


class ViewRoom(NamedTuple):
    """Room for views."""

    whole: np.ndarray
    """int32 (m, 2), slots and marks of pending intervals."""
    real: np.ndarray
    """float64 (m, 4), points on their left and right rays."""
    seen: np.ndarray
    """int32 (m,), corners that are seen."""


class Target(NamedTuple):
    """A point that a view looks for."""

    x: float
    y: float
    polygons: np.ndarray
    """int32, those that contain it, none of which contains the point that looks; none for no
    target."""


class Targets(NamedTuple):
    """Many points, of which a view marks those that it sees."""

    begin: np.ndarray
    """int64 (p + 1,), offsets of the points in each polygon."""
    members: np.ndarray
    """int32, their numbers."""
    points: np.ndarray
    """float64 (n, 2), (row, col)."""
    is_seen: np.ndarray
    """bool (n,), changed."""


class IntervalWork(NamedTuple):
    """Work arrays of a query of intervals."""

    starts: np.ndarray
    """int32 (p,), room for the polygons of the start."""
    goals: np.ndarray
    counts: np.ndarray
    """int64 (`N_COUNTS`,), see `polyanya`."""
    bounds: np.ndarray
    """float64 (2,), length of the best path known, and lower bound on every path."""
    is_open: np.ndarray
    """bool (b,), whether the search may enter each block."""
    marked: np.ndarray
    """int32 (b,), those that it may."""
    whole: np.ndarray
    """int32 (m, 4), slot, root, node before and ends of nodes."""
    real: np.ndarray
    """float64 (m, 5), cost of their roots, points on their rays."""
    heap: Heap
    best: np.ndarray
    """float64 (n,), best cost of each corner, infinite."""
    touched: np.ndarray
    """int32 (n,), corners whose cost is set."""


class CornerWork(NamedTuple):
    """Work arrays of a query of the graph of corners; the first four are those of intervals."""

    starts: np.ndarray
    goals: np.ndarray
    counts: np.ndarray
    bounds: np.ndarray
    room: ViewRoom
    costs: np.ndarray
    """float64 (n,), cost of each corner, infinite."""
    estimates: np.ndarray
    """float64 (n,), of what is left from there."""
    came: np.ndarray
    """int32 (n,), the corner before."""
    to_goal: np.ndarray
    """float64 (n,), length to the goal, infinite where that is not seen."""
    touched: np.ndarray
    """int32 (n,), corners whose cost is set."""
    heap: Heap
    goal_bounds: np.ndarray
    """float64 (2, landmarks), bounds on the distance of the goal from each."""


class HierarchyWork(NamedTuple):
    """Work arrays of a query of the hierarchy; the first four are those of intervals."""

    starts: np.ndarray
    goals: np.ndarray
    counts: np.ndarray
    bounds: np.ndarray
    room: ViewRoom
    records: np.ndarray
    """int64 (n, 4), cost of each corner from the start and from the goal (`FAR`), and the tail and
    arc by which it was reached from either."""
    touched: np.ndarray
    """int32 (n,), corners whose cost is set."""
    from_start: np.ndarray
    """int64 (m, 2), heap."""
    from_goal: np.ndarray


class CornerBend(NamedTuple):
    """A corner at which a path may bend, or its start."""

    px: float
    """x of the point before."""
    py: float
    x: float
    y: float
    hand: float
    """The hand to which a path bends there: above zero for the left, 0 for either."""


class MeshClosure(NamedTuple):
    """Closed cells in rows."""

    box: np.ndarray
    """int64 (4,), first and last row, first and last column of them."""
    starts: np.ndarray
    """int64, offsets of the cells of each of these rows."""
    cols: np.ndarray
    """int64, their columns."""
