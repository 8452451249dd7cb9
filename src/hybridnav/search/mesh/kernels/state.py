"""State of the mesh's kernels: `Mesh`; what is searched, `MeshBlocks`, `Corners` or `Hierarchy`;
their work arrays; rooms and targets of views; `MeshClosure`, `Slits`.

Points are x = column, y = row in grid units: corners are whole numbers. Kernels that exist for each
kind of graph, or of target, are chosen by the class of the tuple.
"""

from typing import NamedTuple

import numpy as np

DONE, PAUSED, WORK_FULL = 0, 1, 2
"""Status of a run of the search: the answer is good enough; the limit of expansions is reached;
there are more nodes than room."""

# Whole numbers that a search keeps between runs: nodes written, entries of the heap, corners
# touched, nodes expanded, the last node of the best path (-1 if the search did not find it); and
# for a query: its stage, polygons of start and goal, blocks or corners marked.
N, SIZE, TOUCHED, EXPANDED, LAST, BEGUN, STARTS, GOALS, MARKED = range(9)
N_COUNTS = 9
# Reals: the length of the best path known, a lower bound on every path.
UPPER, LOWER = 0, 1

GROWING = frozenset(
    {"from_goal", "from_start", "heap", "keys", "real", "seen", "room", "values", "whole"}
)
"""Fields with room that a query may run out of."""


class Mesh(NamedTuple):
    """A mesh; see `ConvexMesh` for a field that says nothing here."""

    x: np.ndarray
    """Those of the corners."""
    y: np.ndarray
    """Those of the corners."""
    kinds: np.ndarray
    """What blocked cells meet at each corner."""
    first: np.ndarray
    """Offsets of the sides of each polygon."""
    begins: np.ndarray
    """The corner at which each side begins."""
    finishes: np.ndarray
    """int32 (s,), the corner at which each side ends."""
    twins: np.ndarray
    """The same side of the next polygon, -1 for walls."""
    polygon_of: np.ndarray
    """The polygon of each side."""
    component: np.ndarray
    """The part of free space of each polygon."""
    backs: np.ndarray
    """int32 (s,), the slot whose twin each slot is, -1 for none: `twins` without directed sides."""


class Ends(NamedTuple):
    """The free cells of start and goal, and `ConvexMesh.polygon_at` there."""

    row: int
    """That of the start."""
    col: int
    """That of the start."""
    to_row: int
    """That of the goal."""
    to_col: int
    """That of the goal."""
    polygon: int
    """At the start."""
    to_polygon: int
    """At the goal."""


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
    """Offsets of the edges of each corner."""
    heads: np.ndarray
    """The corners to which they lead."""
    landmark_distances: np.ndarray
    """Lengths of shortest paths."""


class Hierarchy(NamedTuple):
    """The contracted graph of the corners of a mesh; see `CornerHierarchy`."""

    first: np.ndarray
    """Offsets of the arcs of each corner."""
    arcs: np.ndarray
    """Their heads and lengths, upward in the order of contraction."""
    middles: np.ndarray
    """The corner that an arc skips, -1 for none."""
    follow: np.ndarray
    """By what a path goes on at each corner."""


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
    """Column, grid units."""
    y: float
    """Row, grid units."""
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
    """int32 (p,), room for the polygons of the goal."""
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
    """Nodes that wait, by their estimates."""
    best: np.ndarray
    """float64 (n,), best cost of each corner, infinite; with directed sides float64 (n + s,), also
    that of a corner of these in the polygon whose slot begins there."""
    touched: np.ndarray
    """int32, places in `best` that are set."""


class CornerWork(NamedTuple):
    """Work arrays of a query of the graph of corners; the first four are those of intervals."""

    starts: np.ndarray
    """As in `IntervalWork`."""
    goals: np.ndarray
    """As in `IntervalWork`."""
    counts: np.ndarray
    """As in `IntervalWork`."""
    bounds: np.ndarray
    """As in `IntervalWork`."""
    room: ViewRoom
    """For the views of both ends."""
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
    """Corners that wait."""
    goal_bounds: np.ndarray
    """float64 (2, landmarks), bounds on the distance of the goal from each."""


class HierarchyWork(NamedTuple):
    """Work arrays of a query of the hierarchy; the first four are those of intervals."""

    starts: np.ndarray
    """As in `IntervalWork`."""
    goals: np.ndarray
    """As in `IntervalWork`."""
    counts: np.ndarray
    """As in `IntervalWork`."""
    bounds: np.ndarray
    """As in `IntervalWork`."""
    room: ViewRoom
    """For the views of both ends."""
    records: np.ndarray
    """int64 (n, 4), cost of each corner from the start and from the goal (`FAR`), and the tail and
    arc by which it was reached from either."""
    touched: np.ndarray
    """int32 (n,), corners whose cost is set."""
    from_start: np.ndarray
    """int64 (m, 2), heap."""
    from_goal: np.ndarray
    """int64 (m, 2), heap of the search from the goal."""


class CornerBend(NamedTuple):
    """A corner at which a path may bend, or its start."""

    px: float
    """x of the point before."""
    py: float
    """Y of the point before."""
    x: float
    """Place of the corner, grid units."""
    y: float
    """Place of the corner, grid units."""
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


class Slits(NamedTuple):
    """Directed sides as straight lines, and the points at which these end."""

    lines: np.ndarray
    """float64 (n, 4), x and y of the lower end of each line, and of the other one."""
    ways: np.ndarray
    """uint8 (n,), the ways in which each may be crossed, `UP` and `DOWN`."""
    points: np.ndarray
    """int64 (k,), the ends as flat lattice points, sorted, each once."""
    reach: np.ndarray
    """bool (k, 4, 4), which cells round a point are reached round it from each of them, counter-
    clockwise from the one with the higher row and column; blocked ones from none."""
    kinds: np.ndarray
    """uint8 (k, 4), the kind of the point as each of these cells has it."""
    wide: int
    """Lattice points in a row."""
