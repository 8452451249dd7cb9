"""A route graph of lanes, as a person would draw it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, TypeGuard

import numpy as np

from hybridnav._base.copies import frozen
from hybridnav._base.progress import Progress, no_progress
from hybridnav._base.rows import unique_rows
from hybridnav._base.trig import hypots
from hybridnav._base.typing import BoolArray, FloatArray, IntArray, LongArray
from hybridnav.errors import InvalidValueError, brief
from hybridnav.graphs.cover import Aims, complete
from hybridnav.graphs.drawing import ChainGraph, add_chords, drop_ends
from hybridnav.graphs.files.nav2_rules import MOST_ID
from hybridnav.graphs.free_space import LEAST_AREA_M2, FreeSpace, checked_position
from hybridnav.graphs.joining import Nodes, missing_bends
from hybridnav.graphs.lanes import described
from hybridnav.graphs.route_messages import ids_of
from hybridnav.graphs.sketch import DOOR, END, NOTHING, ROOM, Sketch, settled
from hybridnav.graphs.strands import COVER, Layout, Passage, RoomAnchors, lines_of, strands_of
from hybridnav.graphs.waypoint_graph import RouteGraph, WaypointGraph
from hybridnav.maps import CellClass, OccupancyGrid
from hybridnav.maps.checks import checked_between, checked_type
from hybridnav.maps.clearance import clearance_cells
from hybridnav.maps.frame import FARTHEST_M
from hybridnav.maps.orientation import Orientation
from hybridnav.rooms import Rooms
from hybridnav.rooms.cutting import wall_directions
from hybridnav.topology import TopologicalMap

_APART_M = 4.0
"""Distance between lanes in metres by default."""
_ARENA_M2 = 25.0
"""Area in square metres below which lanes are nearer to each other: with 4 m none has a net."""
_SPECK = 0.125
"""Side of the largest obstacle that lanes pass on one side only, in distances between lanes."""
_LEAST_M = 0.3
"""Clearance beyond the robot's radius below which free space gets no lane for its own sake, in
metres: maps of laser scans end in many thin rays."""
_SMALL, _SMALL_NARROW = 1.75, (2.5, 3.5)
"""Length of the smallest rings of lanes, in distances between lanes; and where there is less room
than is asked for, a little less and none beyond the robot's radius."""
_MERGED = 0.25
"""Length below which a chain, or straight edge, becomes one node, in distances between lanes."""
_MOST_MERGED_M = 1.0
"""The most of this, in metres."""
_STEP_M = 0.2
_BEND_M = 2.0
"""Where chains may bend, and what a bend costs, in metres."""
_SNAP_M = 0.8
"""How far nodes move to set edges along walls, in metres."""
_CHORD, _DETOUR, _CHORD_RAD = 2.5, 1.08, math.radians(15)
"""Chords: their length in distances between lanes, the detour that they save, and the angle to
other edges, so that they make no fans."""
_SEEN = 1.6
"""Distance from a node within which robots join it when a dead end is left out, in distances
between lanes."""
_LONGEST = 1.25
"""Length of an edge above which it is divided, in distances between lanes: robots join graphs at
nodes."""
_SAME_M = 1.0
"""Distance in metres within which a node is the same as one of a graph to keep."""
_STANDS = 0.4
"""Distance within which a node before stands for a new one, in distances between lanes."""
_STEPS = 5
_ROUNDS = 4
"""Most times that lanes are led to what crossings have taken theirs."""


def build_lane_graph(  # noqa: PLR0913 - all but the first have defaults
    topology: TopologicalMap,
    *,
    spacing_m: float | None = None,
    margin_m: float = 0.25,
    points: Mapping[str, tuple[float, float]] | None = None,
    keep: RouteGraph | WaypointGraph | None = None,
    progress: Progress = no_progress,
) -> RouteGraph:
    """Build a route graph of lanes: few nodes in the middle of free space, and straight edges.

    One lane runs in the middle of each corridor and aisle; wide halls have a net of lanes. Nodes
    lie at crossings, doors, rooms and ends of lanes, and where lanes bend. Edges run along the
    main directions of walls where there is room for it. Edges are segments that the robot can
    follow, tested exactly. Nodes are connected exactly where free space connects them. Turned and
    mirrored maps have turned and mirrored lanes.

    Parameters
    ----------
    topology
        The map; with rooms, nodes lie in rooms and doors too, and edges name them.
    spacing_m
        Distance between the lanes of a hall in metres. None for 4; where the robot can enter less
        than 25 m², for half the root of that area, 1 at least. Edges are about 1.25 times as long
        at most, and free space farther than 1.1 times from lanes gets one of its own.
    margin_m
        Clearance beyond the robot's radius that lanes keep where there is as much, in metres.
    points
        Named points, `(x, y)` in metres in the map frame: each becomes a node with its name, joined
        to the nearest lane in sight.
    keep
        A graph of the map as it was. Its nodes and edges stay where the robot can still follow
        them, with their ids, and only missing parts are added. A node that an obstacle covers now
        moves off to free space within 1 m, if there is any, and keeps its id too. No id of that
        graph goes to anything else.
    progress
        Called with the number of steps done and of all steps.

    Returns
    -------
    RouteGraph
        Parts of free space below 1 m² have no nodes, nor has free space outside the building.

    Raises
    ------
    InvalidValueError
        When an argument is out of range, the map allows corner cutting, or no part of it is as
        large as 1 m². When a named point is not free, lies in a part that gets no lanes, or has the
        place of another one.

    Notes
    -----
    Cells are thinned to lines in the order of their clearance (C. Pudney, 1998); the pillars that
    make lines a net, and all steps from lines to edges, are ours.

    Examples
    --------
    >>> from hybridnav.graphs import build_lane_graph
    >>> cells = np.ones((24, 180))
    >>> cells[2:-2, 2:-2] = 0.0
    >>> grid = hn.OccupancyGrid(cells, hn.Frame(0.1), robot_radius_m=0.2)
    >>> topology = hn.TopologicalMap(hn.DualGraphPyramid.build(grid, merge_distance_m=2.0))
    >>> graph = build_lane_graph(topology)
    >>> bool((abs(graph.points[:, 1] - 1.2) <= 0.1).all())  # in the middle of a corridor
    True
    """
    checked_type("topology", topology, TopologicalMap)
    if spacing_m is not None:
        checked_between("spacing_m", spacing_m, 0.5, 100)
    checked_between("margin_m", margin_m, 0, 100)
    space = FreeSpace.of(topology.grid)
    rooms = topology.rooms if topology.has_rooms else None
    aims = _aims(space, space.kept(rooms), rooms)
    space, part_of = aims.space, np.where(aims.kept_cells, aims.space.component_of, np.int32(-1))
    named = _named(space, part_of, points or {})
    progress(1, _STEPS)
    layout = _layout(space, part_of, spacing_m)
    drawing = _drawn(aims, part_of, layout, margin_m / space.grid.resolution_m)
    progress(2, _STEPS)
    sketch = _straightened(drawing, layout, aims)
    progress(3, _STEPS)
    _completed(sketch, layout, aims)
    if keep is not None:
        _keep(sketch, keep, layout)
    near = _near(layout, space.grid) / 2
    sketch.add_points(np.array([*named.values()]).reshape(-1, 2), near)
    _connect(sketch, space)
    for _ in range(_ROUNDS):
        sketch.make_plane()
        if not complete(sketch, aims, near):
            break
        _connect(sketch, space)
    is_named = (sketch.positions[:, None] == np.array([*named.values()]).reshape(-1, 2)).all(2)
    if len(sketch.edges):
        sketch.keep_nodes(np.union1d(sketch.edges, np.flatnonzero(is_named.any(axis=1))))
    progress(4, _STEPS)
    graph = _described(topology, space, sketch, named)
    progress(_STEPS, _STEPS)
    return graph if keep is None else _renamed(graph, keep, _same(sketch, keep))


def _aims(space: FreeSpace, is_kept: BoolArray, rooms: Rooms | None) -> Aims:
    """Return what lanes are to reach, on the map as its turn has it."""
    grid = space.grid
    kept = np.append(is_kept, np.False_)[space.component_of]
    if not kept.any():
        raise InvalidValueError(
            f"map {brief(grid.name)} has no free part of {LEAST_AREA_M2:g} m² or more for a robot "
            f"radius of {grid.robot_radius_m:g} m: give a smaller radius"
        )
    step = max(1, round(_STEP_M / grid.resolution_m))
    return Aims(space.turned(Orientation.of(kept)), is_kept, step, rooms)


def _named(
    space: FreeSpace, part_of: IntArray, points: Mapping[str, tuple[float, float]]
) -> dict[str, FloatArray]:
    named = {name: _place_of(space, part_of, name, at) for name, at in points.items()}
    if len({tuple(at) for at in named.values()}) < len(named):
        raise InvalidValueError(f"points must lie apart, got two at one place: {brief(points)}")
    return named


def _place_of(
    space: FreeSpace, part_of: IntArray, name: str, point: tuple[float, float]
) -> FloatArray:
    if not (isinstance(name, str) and name):
        raise InvalidValueError(f"names of points must be texts, got {brief(name)}")
    try:
        x, y = (float(value) for value in point)
    except (TypeError, ValueError):
        x = y = math.nan
    if not abs(x) + abs(y) <= 2 * FARTHEST_M:
        raise InvalidValueError(f"point {brief(name)} must be (x, y) in metres, got {brief(point)}")
    at = checked_position(space, (x, y))
    if at is None or part_of[tuple(at.astype(np.int64))] < 0:
        why = "not free" if at is None else "in a part of free space without lanes"
        raise InvalidValueError(
            f"point {brief(name)} ({x:g}, {y:g}) is {why} for a robot radius of "
            f"{space.grid.robot_radius_m:g} m: move it"
        )
    return settled(at)


def _layout(space: FreeSpace, part_of: IntArray, spacing_m: float | None) -> Layout:
    """Return what strands are to be like; see `build_lane_graph`."""
    grid = space.grid
    area_m2, cell_m = int((part_of >= 0).sum()) * grid.cell_area_m2, grid.resolution_m
    if spacing_m is None:
        # In steps of half a metre: graphs of a map that changes a little keep theirs.
        small_m = max(round(math.sqrt(area_m2)) / 2, 1.0)
        spacing_m = _APART_M if area_m2 >= _ARENA_M2 else small_m
    directions = wall_directions(space.turn.turned(grid.measured == CellClass.OCCUPIED), cell_m)
    return Layout(
        apart=spacing_m / cell_m,
        speck=(_SPECK * spacing_m + 2 * grid.robot_radius_m) / cell_m,
        least=_LEAST_M / cell_m,
        angle_rad=directions[0][0] if directions else 0.0,
    )


def _near(layout: Layout, grid: OccupancyGrid) -> float:
    """Return the distance in cells below which nodes become one."""
    return min(_MERGED * layout.apart, _MOST_MERGED_M / grid.resolution_m)


def _drawn(aims: Aims, part_of: IntArray, layout: Layout, margin: float) -> ChainGraph:
    """Return the lines of lanes, with a node in each room and door that they pass."""
    parts = np.pad(part_of, 1, constant_values=-1)
    clearance = clearance_cells(parts < 0)
    points = [at for _, at in aims.rooms_to_reach]
    cells = np.array(points, dtype=np.int64).reshape(-1, 2)
    known = RoomAnchors(np.pad(aims.label_of, 1, constant_values=-1), cells + 1)
    padded = lines_of(parts, clearance, known, layout)
    lines, ends = (np.ascontiguousarray(each[1:-1, 1:-1]) for each in padded)
    kinds = np.where(ends, END, NOTHING)
    _mark(kinds, lines & (part_of >= 0), aims)
    at, strands = strands_of(lines, kinds != NOTHING)
    passage = Passage(aims.space, clearance[1:-1, 1:-1], margin)
    middles = np.asarray(_freed(at, part_of) + 0.5, dtype=np.float64)
    return ChainGraph(middles, kinds[tuple(at.T)], strands, passage)


def _mark(kinds: LongArray, lines: BoolArray, aims: Aims) -> None:
    """Make a node of the passed cell of each door that is nearest to its middle, and of each room
    that is nearest to its point."""

    def mark(cells: LongArray, point: FloatArray, kind: int) -> None:
        if len(cells):
            away = ((cells + 0.5 - point) ** 2).sum(axis=1)
            kinds[tuple(cells[int(away.argmin())])] = kind

    for number, arcs in aims.doors_to_pass:
        for moves in arcs:
            cells = unique_rows(moves.reshape(-1, 2)).rows
            middle = cells.mean(axis=0) + 0.5
            mark(cells[lines[tuple(cells.T)]], middle, DOOR - 1 + number)
    passed = np.argwhere(lines & (kinds < DOOR))
    label = aims.label_of[tuple(passed.T)]
    for room, at in aims.rooms_to_reach:
        mark(passed[label == room], at, ROOM)


def _straightened(drawing: ChainGraph, layout: Layout, aims: Aims) -> Sketch:
    """Return lines as straight edges: free, few, and along walls, with few dead ends."""
    near, cell_m = _near(layout, aims.space.grid), aims.space.grid.resolution_m
    least, most = _SMALL_NARROW
    drawing.prune(_SMALL * layout.apart, (least * layout.apart, most * layout.apart))
    drawing.merge(near)
    sketch = drawing.straightened(aims.step, _BEND_M / cell_m)
    sketch.repair()
    for _ in range(2):
        sketch.simplify(near, 2 * layout.apart)
        sketch.snap(layout.angle_rad, _SNAP_M / cell_m)
    drop_ends(sketch, COVER * layout.apart, _SEEN * layout.apart, aims.step)
    _connect(sketch, aims.space)
    return sketch


def _completed(sketch: Sketch, layout: Layout, aims: Aims) -> None:
    """Add what lanes have missed, and chords; divide long edges."""
    complete(sketch, aims, _near(layout, aims.space.grid) / 2)
    add_chords(sketch, _CHORD * layout.apart, _DETOUR, _CHORD_RAD)
    sketch.split(_LONGEST * layout.apart)
    _connect(sketch, aims.space)


def _keep(sketch: Sketch, keep: RouteGraph | WaypointGraph, layout: Layout) -> None:
    """Keep a graph before where the robot can follow it."""
    space = sketch.passage.space
    known = settled(space.turn.there(space.grid.frame.positions_of(keep.points)))
    old = sketch.freed(known, _SAME_M / space.grid.resolution_m)
    sketch.keep(old, keep.edges, _same(sketch, keep), _STANDS * layout.apart)
    _connect(sketch, space)


def _freed(cells: LongArray, part_of: IntArray) -> LongArray:
    """Return cells, and instead of those in specks the nearest free ones."""
    from scipy import ndimage  # noqa: PLC0415 - on demand

    is_blocked = part_of[tuple(cells.T)] < 0
    if is_blocked.any():
        nearest = ndimage.distance_transform_edt(
            part_of < 0, return_distances=False, return_indices=True
        )
        cells = cells.copy()
        cells[is_blocked] = nearest[(slice(None), *cells[is_blocked].T)].T
    return cells


def _connect(sketch: Sketch, space: FreeSpace) -> None:
    sketch.unify()  # else parts that meet at one place are joined in vain
    nodes = Nodes(space, sketch.positions)
    edges = [*map(tuple, sketch.edges.tolist())]
    while missing := missing_bends(nodes, np.array(edges, dtype=np.int64).reshape(-1, 2)):
        for path in missing:
            tail, head = nodes.indices_of(path[[0, -1]])
            edges += sketch.add_path(tail, head, path[1:-1])
        nodes.positions = sketch.positions
    sketch.set_edges(edges)


def _same(sketch: Sketch, keep: RouteGraph | WaypointGraph) -> LongArray:
    """Return which node of a graph before each node is, int64 (n,), -1 for none."""
    from scipy.spatial import KDTree  # noqa: PLC0415 - on demand

    grid, turn = sketch.passage.space.grid, sketch.passage.space.turn
    known = turn.there(grid.frame.positions_of(keep.points))
    to_known = np.asarray(KDTree(known).query(sketch.positions)[1], dtype=np.int64)
    to_own = np.asarray(KDTree(sketch.positions).query(known)[1], dtype=np.int64)
    steps = known[to_known] - sketch.positions
    is_same = to_own[to_known] == np.arange(len(to_known))
    is_same &= hypots(steps[:, 0], steps[:, 1]) * grid.resolution_m <= _SAME_M
    return np.where(is_same, to_known, -1)


def _described(
    topology: TopologicalMap, space: FreeSpace, sketch: Sketch, named: Mapping[str, FloatArray]
) -> RouteGraph:
    name_of = {tuple(at): name for name, at in named.items()}
    names = [name_of.get(tuple(at)) for at in sketch.positions.tolist()]
    degree = np.bincount(sketch.edges.ravel(), minlength=len(sketch.kinds))
    by_degree = np.array(["end", "end", "bend", "crossing"])[np.minimum(degree, 3)].tolist()
    kinds = [
        "door" if kind >= DOOR else "room" if kind == ROOM else "point" if name else known
        for kind, known, name in zip(sketch.kinds.tolist(), by_degree, names, strict=True)
    ]
    doors = np.maximum(sketch.kinds - (DOOR - 1), 0).tolist()
    nodes = Nodes(space, space.turn.back(sketch.positions), kinds, doors)
    both = np.concatenate([sketch.edges, sketch.edges[:, ::-1]])
    return replace(described(topology, nodes, both), names=tuple(names))


def _renamed(graph: RouteGraph, keep: RouteGraph | WaypointGraph, same: LongArray) -> RouteGraph:
    """Return a graph with the ids of nodes and edges that are the same as before; all others get
    ids that nothing had."""
    nodes, edges = ids_of(keep)
    id_of = dict(zip(map(tuple, keep.edges.tolist()), edges, strict=True))
    wanted = [nodes[node] if node >= 0 else None for node in same.tolist()]
    wanted += [id_of.get((tail, head)) for tail, head in same[graph.edges].tolist()]
    following = 1 + max((name for name in (*nodes, *edges) if _is_id(name)), default=-1)
    found: list[int] = []
    used: set[int] = set()
    for name in wanted:
        number = name if _is_id(name) and name not in used else following
        following += number == following
        found.append(number)
        used.add(number)
    ids = np.array(found, dtype=np.int64)
    return replace(graph, ids=(frozen(ids[: graph.n_nodes]), frozen(ids[graph.n_nodes :])))


def _is_id(name: Any) -> TypeGuard[int]:
    """Return whether a name is an id that files for Nav2 hold."""
    return isinstance(name, int) and 0 <= name <= MOST_ID
