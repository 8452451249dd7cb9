"""Rooms, doors, parts and points of free space that lanes have missed, and what is left out."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from hybridnav._base.trig import hypots
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.graphs.free_space import LEAST_AREA_M2, FreeSpace, checked_position
from hybridnav.graphs.lanes import DoorsPassed
from hybridnav.graphs.sketch import DOOR, END, NOTHING, ROOM, Sketch
from hybridnav.graphs.waypoint_graph import RouteGraph
from hybridnav.maps.geometry import cells_of_line
from hybridnav.refine import Sight
from hybridnav.rooms import Rooms
from hybridnav.topology import TopologicalMap

_NEAREST = (1, 4, 16, 64)
"""Nearest nodes by which points are looked for, one number after the other: most see the first."""
_UNSEEN = 0.02
"""Share of free points that need see no node."""
_REACH_M = 4.0
"""Distance in metres within which a node is chosen for points that see none."""
_TRIED = 4
"""Nearest nodes that a lane is led to."""


@dataclass(frozen=True, eq=False)
class Aims:
    """What lanes are to reach: rooms, doors, parts of free space, and points that see a node."""

    space: FreeSpace
    is_kept: BoolArray
    """bool (n_components,), the parts of free space that get nodes."""
    step: int
    """Cells between the points that are to see a node, along rows and columns."""
    rooms: Rooms | None

    @cached_property
    def label_of(self) -> IntArray:
        """int32 (rows, cols), the room of each cell, -1 for none."""
        none = np.full(self.space.free.shape, -1, dtype=np.int32)
        return none if self.rooms is None else self.space.turn.turned(self.rooms.labels.label_of)

    @cached_property
    def kept_cells(self) -> BoolArray:
        """bool (rows, cols), the cells of these parts."""
        return np.append(self.is_kept, np.False_)[self.space.component_of]

    @cached_property
    def rooms_to_reach(self) -> list[tuple[int, FloatArray]]:
        """Each listed room that the robot can be in, and the position of its named point, or amid
        its cells with most room if no node may lie there."""
        if (rooms := self.rooms) is None:
            return []
        clearance_m = self.space.turn.turned(rooms.clearance_m)
        found = []
        for room in np.flatnonzero(rooms.is_listed & rooms.fits).tolist():
            point = rooms.labels.points.get(rooms.names[room])
            at = None if point is None else checked_position(self.space, point)
            if at is None or not self.kept_cells[tuple(at.astype(np.int64))]:
                cells = np.argwhere(self.kept_cells & (self.label_of == room))
                clear = clearance_m[tuple(cells.T)]
                deepest = cells[clear == clear.max(initial=0.0)] + 0.5
                at = deepest[_away(deepest).argmin()] if len(cells) else None
            if at is not None:
                found.append((room, at))
        return sorted(found, key=lambda each: each[1].tolist())

    @cached_property
    def doors_to_pass(self) -> list[tuple[int, list[LongArray]]]:
        """The number of each listed door that the robot passes, and the moves through it between
        free cells: for each arc, the longest first, int64 (n, 2, 2), those in its middle first."""
        if (rooms := self.rooms) is None:
            return []
        found = []
        for door in rooms.listed_doors:
            arcs = [self._moves(rooms.level.boundary(arc.index)) for arc in door.arcs]
            arcs = sorted(filter(len, arcs), key=lambda moves: (-len(moves), moves[0].tolist()))
            found += [(door.number, arcs)] if arcs else []
        return sorted(found, key=lambda each: each[1][0][0].tolist())

    def _moves(self, pairs: LongArray) -> LongArray:
        """Return pairs of neighbours, int64 (n, 2, 2) cells of the map, as the turn has them."""
        sides = np.sort(self.space.turn.there(pairs + 0.5), axis=1)  # they differ in row or col
        sides = sides[np.lexsort(sides.reshape(-1, 4).T)]
        moves = sides[np.argsort(_away(sides.mean(axis=1)), kind="stable")].astype(np.int64)
        return moves[self.kept_cells[moves[..., 0], moves[..., 1]].all(axis=1)]

    @cached_property
    def _passes(self) -> DoorsPassed | None:
        return None if self.rooms is None else DoorsPassed(self.rooms)

    def passed(self, ends: FloatArray) -> set[int]:
        """Return the doors that edges pass, float64 (m, 2, 2) positions of their ends."""
        if self._passes is None:
            return set()
        lines = (cells_of_line(self.space.free, line) + 0.5 for line in ends)
        cells = (self.space.turn.back(line).astype(np.int64) for line in lines)
        return {number for line in cells for number in self._passes.passed(line)}

    @cached_property
    def looked(self) -> tuple[LongArray, FloatArray]:
        """The free points that are to see a node: int64 (p, 2) rows and columns of a lattice in the
        middle of the map, and float64 (p, 2) positions."""
        free, step = self.space.free, self.step
        first = [(side - 1) % step // 2 for side in free.shape]
        lattice = tuple(slice(start, None, step) for start in first)
        spots = np.argwhere(self.kept_cells[lattice])
        return spots, np.asarray(spots * step + first + 0.5, dtype=np.float64)


def _away(positions: FloatArray) -> FloatArray:
    """Return the square of the distance of each position from their mean, float64 (n,)."""
    return ((positions - positions.mean(axis=0)) ** 2).sum(axis=1)


def free_moves(rooms: Rooms, number: int, free: BoolArray) -> LongArray:
    """Return the moves through a door between free cells, int64 (n, 2, 2)."""
    moves = np.stack(np.divmod(rooms.moves_through(number), free.shape[1]), axis=-1)
    return moves[free[moves[..., 0], moves[..., 1]].all(axis=1)]


def complete(sketch: Sketch, aims: Aims, near: float) -> bool:
    """Lead lanes to what has none: to rooms, through doors, where free points see no node, and in
    parts of free space with a single node.

    `near`: distance in cells within which edges lead through a new node. Returns whether anything
    was missing.
    """
    passed = aims.passed(sketch.positions[sketch.edges])
    kinds = set(sketch.kinds.tolist())
    bare = [
        (number, np.concatenate(arcs))
        for number, arcs in aims.doors_to_pass
        if number not in passed or DOOR - 1 + number not in kinds
    ]
    for number, moves in bare:
        sketch.kinds[sketch.kinds == DOOR - 1 + number] = NOTHING  # it lies beside the door
        _lead_through(sketch, aims, number, moves, near)
    visited = set(aims.label_of[tuple(aims.space.cells_at(sketch.positions).T)].tolist())
    rooms = [at for room, at in aims.rooms_to_reach if room not in visited]
    _add(sketch, rooms, ROOM, near)
    chosen = _cover(sketch, aims)
    _add(sketch, chosen, END, near)
    return any([bare, rooms, chosen, _lengthen(sketch, aims)])


def _add(sketch: Sketch, points: list[FloatArray], kind: int, near: float) -> None:
    """Add nodes, joined to the nearest edge in sight of them, or of their way to the next node."""
    for point in points:
        at = sketch.positions
        sketch.add_points(point[None], near)
        (node,) = sketch.add_nodes(point[None])
        sketch.kinds[node] = max(sketch.kinds[node], kind)
        if not (sketch.edges == node).any():
            _lead(sketch, node, _line_to_next(sketch, point, at), near)


def _line_to_next(
    sketch: Sketch, start: FloatArray, at: FloatArray, within: BoolArray | None = None
) -> FloatArray:
    """Return the way to the next of some nodes, float64 (k, 2), without its start; empty where
    there is none.

    `at`: float64 (n, 2), the nodes; `within`: cells in which nodes come first.
    """
    space = sketch.passage.space
    ends = at[space.components_at(at) == space.components_at(start[None])[0]]
    inside = ends if within is None else ends[within[tuple(space.cells_at(ends).T)]]
    ends = inside if len(inside) else ends
    ends = ends[(ends != start).any(axis=1)]
    ends = ends[np.argsort(((ends - start) ** 2).sum(axis=1), kind="stable")[:_TRIED]]
    if not len(ends):
        return np.empty((0, 2))
    paths = space.paths(np.repeat(start[None], len(ends), axis=0), ends)
    k = int(np.argmin(paths.length_cells))
    line = paths.positions[paths.path_start[k] : paths.path_start[k + 1]]
    return space.joinable(line)[1:]


def _lead_through(sketch: Sketch, aims: Aims, number: int, moves: LongArray, near: float) -> None:
    """Add a node to a door, and lead a lane from it to the nearest one on either side.

    `moves`: int64 (n, 2, 2), pairs of cells, one on each side, the best one first.
    """
    taken = sketch.positions[sketch.kinds >= DOOR]
    ways = np.stack([moves, moves[:, ::-1]], axis=1).reshape(-1, 2, 2) + 0.5
    is_taken = (ways[:, None, 0] == taken).all(axis=2).any(axis=1)
    one, other = ways[int(np.argmin(is_taken))]
    at = sketch.positions
    (door,) = sketch.add_nodes(one[None])
    sketch.kinds[door] = DOOR - 1 + number
    here, there = (aims.label_of == aims.label_of[tuple(side.astype(int))] for side in (one, other))
    _join(sketch, door, at, here, near)
    before = sketch.positions, sketch.kinds.copy(), sketch.edges
    _join(sketch, door, at, there, near)
    ends = sketch.edges[(sketch.edges == door).any(axis=1)]
    if number not in aims.passed(sketch.positions[ends]):
        # A straight edge passes beside the door: this one leads through it.
        sketch.positions, sketch.kinds, sketch.edges = before
        (beyond,) = sketch.add_nodes(other[None])
        sketch.set_edges([*sketch.edges.tolist(), (door, beyond)])
        _join(sketch, beyond, at, there, near)


def _join(sketch: Sketch, node: int, at: FloatArray, within: BoolArray, near: float) -> None:
    """Join a node to an edge in some cells, or lead a lane from it to the next node there.

    `at`: float64 (n, 2), the nodes to choose from.
    """
    count = len(sketch.edges)
    sketch.add_points(sketch.positions[[node]], near, within)
    if len(sketch.edges) == count:
        _lead(sketch, node, _line_to_next(sketch, sketch.positions[node], at, within), near, within)


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


def _lengthen(sketch: Sketch, aims: Aims) -> bool:
    """Lead a lane along the middle of each part of free space without an edge; return whether there
    was one."""
    space, passage = aims.space, sketch.passage
    part = space.components_at(sketch.positions)
    bare = np.setdiff1d(np.flatnonzero(aims.is_kept), part[sketch.edges])
    for which in bare.tolist():
        spots: FloatArray = np.argwhere(space.component_of == which).astype(np.float64) + 0.5
        room = passage.at(spots)
        nodes = sketch.positions[: len(part)][part == which]
        start = nodes[0] if len(nodes) else spots[int(room.argmax())]
        fits = space.joins(np.repeat(start[None], len(spots), axis=0), spots)
        away = np.where(fits, hypots(*(spots - start).T), 0.0)
        away = np.where(room >= room.max() / 2, away, away / len(spots))
        if away.max() > 0:
            ends = sketch.add_nodes(np.stack([start, spots[int(away.argmax())]]))
            sketch.set_edges([*sketch.edges.tolist(), ends])
    return len(bare) > 0


def _cover(sketch: Sketch, aims: Aims) -> list[FloatArray]:
    """Choose nodes where free points see none: of points nearby, those that most of them see."""
    from scipy import ndimage  # noqa: PLC0415 - on demand
    from scipy.spatial import KDTree  # noqa: PLC0415

    sight = aims.space.sight
    spots, points = aims.looked
    is_unseen = ~sees(sight, points, sketch.positions)
    most = int(_UNSEEN * len(points))
    if is_unseen.sum() <= most:
        return []
    places = np.zeros(spots.max(axis=0) + 1, dtype=np.bool_)
    places[tuple(spots[is_unseen].T)] = True
    reach_m = _REACH_M / (aims.step * aims.space.grid.resolution_m)
    beside = ndimage.binary_dilation(
        places, np.ones((3, 3), dtype=np.bool_), iterations=max(1, round(reach_m / 4))
    )
    fits = is_unseen | (beside[tuple(spots.T)] & (spots % 2 == 0).all(axis=1))
    unseen, new = points[is_unseen], points[fits]
    # By clearance: of equal ones the first is chosen.
    new = new[np.argsort(-sketch.passage.at(new), kind="stable")]
    near_by = KDTree(unseen).query_ball_point(new, reach_m * aims.step, return_sorted=True)
    of = np.repeat(np.arange(len(new)), [len(each) for each in near_by])
    seen = np.concatenate(near_by).astype(np.int64)
    fits = sight.clear(new[of], unseen[seen])
    of, seen = of[fits], seen[fits]
    left, chosen = np.ones(len(unseen), dtype=np.bool_), []
    while left.sum() > most:
        best = int(np.bincount(of[left[seen]], minlength=len(new)).argmax())
        chosen.append(new[best])
        left[seen[of == best]] = False
    return chosen


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
    """Return a line for each listed room, door, and part of free space that no lane leads into, and
    for each part whose lanes nothing joins with those of the largest.

    Doors are those that the robot passes, rooms those that it fits into, and parts those of 1 m² or
    more; each line states why.
    """
    from scipy import ndimage  # noqa: PLC0415 - on demand

    grid = topology.grid
    free = grid.enterable(allow_unexplored=False)
    part_of, count = ndimage.label(free)
    cells = np.floor(graph.positions).astype(np.int64)
    has_node = np.bincount(part_of[tuple(cells.T)], minlength=count + 1) > 0
    area_m2 = np.bincount(part_of.ravel(), minlength=count + 1) * grid.cell_area_m2
    is_told = (area_m2 < LEAST_AREA_M2) & ~has_node
    is_told[[0, int(np.where(has_node, area_m2, 0).argmax())]] = True

    def why(part: int) -> str:
        if has_node[part]:
            return "the graph passes it by"
        return f"no way leads there from the graph ({area_m2[part]:.1f} m²)"

    lines = []
    if topology.has_rooms:
        rooms = topology.rooms
        visited = rooms.labels.label_of[tuple(cells.T)]
        for room in np.setdiff1d(np.flatnonzero(rooms.is_listed & rooms.fits), visited).tolist():
            part = part_of[grid.frame.cell_of(*rooms.point_of(rooms.names[room]))]
            lines.append(f"{rooms.names[room]}: {why(part)}")
            is_told[part] = True
        passed = {number for doors in graph.edge_doors for number in doors}
        for door in rooms.listed_doors:
            moves = free_moves(rooms, door.number, free)
            is_missed = door.number not in graph.doors or door.number not in passed
            if door.passable and is_missed and len(moves):
                lines.append(f"door {door.number}: {why(part_of[tuple(moves[0, 0])])}")
    room_of = dict(zip(part_of[tuple(cells.T)].tolist(), graph.rooms, strict=True))
    parts = np.flatnonzero(~is_told)
    for part in parts[np.argsort(-area_m2[parts], kind="stable")].tolist():
        x, y = grid.frame.points_of(np.argwhere(part_of == part)[:1])[0].tolist()
        where = room_of.get(part) or f"free space at ({x:.2f}, {y:.2f})"
        own = "lanes of its own, for " if has_node[part] else ""
        rest = "the other ones" if has_node[part] else "the graph"
        lines.append(f"{where}: {own}no way leads there from {rest} ({area_m2[part]:.1f} m²)")
    return tuple(lines)
