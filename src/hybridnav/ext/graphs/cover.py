"""Rooms, doors and free points that lanes have missed, and what is left out in the end."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from hybridnav.ext.graphs.judge import LEAST_AREA_M2, checked_position
from hybridnav.ext.graphs.lanes import DoorsPassed
from hybridnav.ext.graphs.sketch import DOOR, END, NOTHING, ROOM
from hybridnav.maps.geometry import cells_of_line

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
    from hybridnav.ext.graphs.judge import FreeSpace
    from hybridnav.ext.graphs.sketch import Sketch
    from hybridnav.ext.graphs.waypoint_graph import RouteGraph
    from hybridnav.refine import Sight
    from hybridnav.topology import TopologicalMap
    from hybridnav.topology.rooms import Rooms

_NEAREST = (1, 4, 16, 64)
"""Nearest nodes by which points are looked for, one number after the other: most see the first."""
_UNSEEN = 0.02
"""Share of free points that need see no node."""
_REACH_M = 4.0
"""Distance in metres within which a node is chosen for points that see none."""
_TRIED = 4
"""Nearest nodes in a room that a door is joined to."""


def rooms_to_reach(
    rooms: Rooms, space: FreeSpace, is_kept: BoolArray
) -> Iterator[tuple[int, FloatArray]]:
    """Yield each listed room that the robot can be in, and the position of its point.

    `is_kept`: bool (n_components,), the parts of free space that get nodes.
    """
    for room in np.flatnonzero(rooms.is_listed & rooms.fits).tolist():
        at = checked_position(space, rooms.point_of(rooms.names[room]))
        if at is not None and is_kept[space.components_at(at[None])[0]]:
            yield room, at


def doors_to_pass(
    rooms: Rooms, space: FreeSpace, is_kept: BoolArray
) -> Iterator[tuple[int, LongArray]]:
    """Yield the number of each listed door that the robot passes, and the moves through it between
    free cells, int64 (n, 2, 2), the nearest to its middle first."""
    frame, cols = rooms.grid.frame, space.free.shape[1]
    for door in rooms.listed_doors:
        if not door.passable:
            continue
        moves = np.stack(np.divmod(rooms.moves_through(door.number), cols), axis=-1)
        moves = moves[space.free[moves[..., 0], moves[..., 1]].all(axis=1)]
        if len(moves) and is_kept[space.component_of[tuple(moves[0, 0])]]:
            middle = frame.positions_of(np.array([door.position]))
            middle = frame.positions_of(np.array([door.position]))
            away = ((moves.mean(axis=1) + 0.5 - middle) ** 2).sum(axis=1)
            yield door.number, moves[np.argsort(away, kind="stable")]


def complete(
    sketch: Sketch, rooms: Rooms | None, is_kept: BoolArray, near: float, step: int
) -> None:
    """Add a node to each room and door without one, and where free points see none.

    `is_kept`: bool (n_components,), the parts of free space that get nodes; `near`: distance in
    cells within which edges lead through a new node; `step`: cells between the points looked at.
    """
    space = sketch.passage.space
    if rooms is not None:
        passes, at = DoorsPassed(rooms), sketch.positions
        lines = [cells_of_line(space.free, at[edge]) for edge in sketch.edges]
        passed = {number for line in lines for number in passes.passed(line)}
        for number, moves in doors_to_pass(rooms, space, is_kept):
            is_marked = sketch.kinds == DOOR - 1 + number
            if number not in passed or not is_marked.any():
                sketch.kinds[is_marked] = NOTHING  # it lies beside the door
                _lead_through(sketch, number, moves[0] + 0.5, rooms.labels.label_of, near)
        label_of = rooms.labels.label_of
        bare = [
            at
            for room, at in rooms_to_reach(rooms, space, is_kept)
            if not (label_of[tuple(space.cells_at(sketch.positions).T)] == room).any()
        ]
        _add(sketch, np.array(bare).reshape(-1, 2), ROOM, near)
    looked = np.zeros_like(space.free)
    looked[step // 2 :: step, step // 2 :: step] = True
    looked &= space.free
    looked[looked] = is_kept[space.component_of[looked]]
    _cover(sketch, looked[step // 2 :: step, step // 2 :: step], near, step)


def _add(sketch: Sketch, points: FloatArray, kind: int, near: float) -> None:
    """Add nodes, joined to the nearest edge in sight of them, or of their way to the next node."""
    from scipy.spatial import KDTree  # noqa: PLC0415 - on demand

    space, at = sketch.passage.space, sketch.positions
    part, tree = space.components_at(at), KDTree(at)
    for point in points:
        sketch.add_points(point[None], near)
        (node,) = sketch.add_nodes(point[None])
        sketch.kinds[node] = max(sketch.kinds[node], kind)
        if (sketch.edges == node).any():
            continue
        ends = np.asarray(tree.query(point, k=list(range(1, min(_NEAREST[1], len(at)) + 1)))[1])
        ends = ends[part[ends] == space.components_at(point[None])[0]]
        if not len(ends):
            continue
        paths = space.paths(np.repeat(point[None], len(ends), axis=0), at[ends])
        k = int(np.argmin(paths.length_cells))
        line = space.joinable(paths.positions[paths.path_start[k] : paths.path_start[k + 1]])
        _lead(sketch, node, line[1:], near)


def _lead_through(
    sketch: Sketch, number: int, move: FloatArray, label_of: IntArray, near: float
) -> None:
    """Add a node to a door, and lead a lane from it to the nearest one on either side.

    `move`: float64 (2, 2), the centres of two cells, one on each side.
    """
    space = sketch.passage.space
    at = sketch.positions.copy()
    (door,) = sketch.add_nodes(move[:1])
    sketch.kinds[door] = DOOR - 1 + number
    labels = label_of[tuple(space.cells_at(at).T)]
    part = space.components_at(at)
    for side in move:
        cell = tuple(side.astype(int))
        within = label_of == label_of[cell]
        before = len(sketch.edges)
        sketch.add_points(move[:1], near, within)
        if len(sketch.edges) > before:
            continue
        there = np.flatnonzero(part == space.component_of[cell])
        inside = there[labels[there] == label_of[cell]]
        ends = inside if len(inside) else there
        away = ((at[ends] - side) ** 2).sum(axis=1)
        ends = ends[np.argsort(away, kind="stable")[:_TRIED]]
        ends = ends[ends != door]
        if not len(ends):
            continue
        paths = space.paths(np.repeat(side[None], len(ends), axis=0), at[ends])
        k = int(np.argmin(paths.length_cells))
        line = paths.positions[paths.path_start[k] : paths.path_start[k + 1]]
        line = line if side is move[0] else np.concatenate([move[:1], line])
        _lead(sketch, door, space.joinable(line)[1:], near, within)


def _lead(
    sketch: Sketch, node: int, line: FloatArray, near: float, within: BoolArray | None = None
) -> None:
    """Lead a lane from a node along a line to the first place from which an edge is in sight."""
    for spot in line:
        count = len(sketch.edges)
        is_known = (sketch.positions == spot).all(axis=1).any()
        sketch.add_points(spot[None], near, None if is_known else within)
        (following,) = sketch.add_nodes(spot[None])
        is_joined = is_known or len(sketch.edges) > count
        sketch.set_edges([*sketch.edges.tolist(), (node, following)])
        node = following
        if is_joined:
            break


def _cover(sketch: Sketch, looked: BoolArray, near: float, step: int) -> None:
    """Add nodes where free points see none: of points nearby, those that most of them see.

    `looked`: bool (rows, cols), which of the cells at a distance of `step` are looked at.
    """
    from scipy import ndimage  # noqa: PLC0415 - on demand
    from scipy.spatial import KDTree  # noqa: PLC0415

    space = sketch.passage.space
    spots = np.argwhere(looked)
    points = np.asarray(spots * step + step // 2 + 0.5, dtype=np.float64)
    is_unseen = ~sees(space.sight, points, sketch.positions)
    most = int(_UNSEEN * len(points))
    if is_unseen.sum() <= most:
        return
    places = np.zeros_like(looked)
    places[tuple(spots[is_unseen].T)] = True
    reach_m = _REACH_M / (step * space.grid.resolution_m)
    beside = ndimage.binary_dilation(
        places, np.ones((3, 3), dtype=np.bool_), iterations=max(1, round(reach_m / 4))
    )
    fits = is_unseen | (beside[tuple(spots.T)] & (spots % 2 == 0).all(axis=1))
    unseen, new = points[is_unseen], points[fits]
    # By clearance: of equal ones the first is chosen.
    new = new[np.argsort(-sketch.passage.at(new), kind="stable")]
    near_by = KDTree(unseen).query_ball_point(new, reach_m * step, return_sorted=True)
    of = np.repeat(np.arange(len(new)), [len(each) for each in near_by])
    seen = np.concatenate(near_by).astype(np.int64)
    fits = space.sight.clear(new[of], unseen[seen])
    of, seen = of[fits], seen[fits]
    left, chosen = np.ones(len(unseen), dtype=np.bool_), []
    while left.sum() > most:
        best = int(np.bincount(of[left[seen]], minlength=len(new)).argmax())
        chosen.append(new[best])
        left[seen[of == best]] = False
    _add(sketch, np.array(chosen), END, near)


def sees(sight: Sight, points: FloatArray, nodes: FloatArray) -> BoolArray:
    """Return which points see one of their nearest nodes, bool (p,)."""
    from scipy.spatial import KDTree  # noqa: PLC0415 - on demand

    tree, seen = KDTree(nodes), np.zeros(len(points), dtype=np.bool_)
    for low, high in pairwise((0, *_NEAREST)):
        left = np.flatnonzero(~seen)
        ranks = list(range(low + 1, min(high, len(nodes)) + 1))
        if not len(left) or not ranks:
            break
        at = np.asarray(tree.query(points[left], k=ranks)[1], dtype=np.int64)
        tails = np.repeat(points[left], len(ranks), axis=0)
        seen[left] = sight.clear(tails, nodes[at.ravel()]).reshape(at.shape).any(axis=1)
    return seen


# What a graph leaves out.


def left_out(topology: TopologicalMap, graph: RouteGraph) -> tuple[str, ...]:
    """Return a line for each listed room and door, and each part of free space, without a node.

    Doors are those that the robot passes, rooms those that it fits into, and parts those of 1 m² or
    more; each line states why.
    """
    from scipy import ndimage  # noqa: PLC0415 - on demand

    grid = topology.grid
    part_of, count = ndimage.label(grid.enterable(allow_unexplored=False))
    cells = np.floor(graph.positions).astype(np.int64)
    has_node = np.bincount(part_of[tuple(cells.T)], minlength=count + 1) > 0
    area_m2 = np.bincount(part_of.ravel(), minlength=count + 1) * grid.cell_area_m2
    is_told = has_node | (area_m2 < LEAST_AREA_M2)
    is_told[0] = True

    def why(part: int) -> str:
        if has_node[part]:
            return "the graph passes it by"
        return f"no way leads there from the graph ({area_m2[part]:.1f} m²)"

    lines = []
    if topology.pyramid.rooms is not None:
        rooms = topology.rooms
        visited = rooms.labels.label_of[tuple(cells.T)]
        for room in np.setdiff1d(np.flatnonzero(rooms.is_listed & rooms.fits), visited).tolist():
            part = part_of[grid.frame.cell_of(*rooms.point_of(rooms.names[room]))]
            lines.append(f"{rooms.names[room]}: {why(part)}")
            is_told[part] = True
        for door in rooms.listed_doors:
            beside = part_of.ravel()[rooms.cells_beside(door.number)].max()
            if door.passable and door.number not in graph.doors:
                lines.append(f"door {door.number}: {why(beside)}")
    parts = np.flatnonzero(~is_told)
    for part in parts[np.argsort(-area_m2[parts], kind="stable")].tolist():
        row, col = np.argwhere(part_of == part)[0].tolist()
        x, y = grid.frame.points_of(np.array([row, col])).tolist()
        lines.append(f"free space at ({x:.2f}, {y:.2f}): {why(part)}")
    return tuple(lines)
